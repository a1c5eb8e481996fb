//! Nice numbers, and how they are written: ticks of a range, and lengths.
//!
//! A nice number is a whole number times a power of ten, and is turned into f64 by reading its
//! digits, which rounds once. So its label says exactly what it is.

use crate::maps;

/// A whole number times a power of ten.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Decimal {
    whole: i64,
    power: i32,
}

impl Decimal {
    /// The nearest f64.
    pub fn value(self) -> f64 {
        format!("{}e{}", self.whole, self.power).parse().expect("it is a number")
    }

    /// All its digits, without a power of ten.
    fn plain(self) -> String {
        let (sign, digits) = (if self.whole < 0 { "−" } else { "" }, self.whole.unsigned_abs());
        if self.power >= 0 {
            let zeros = if digits == 0 { 0 } else { self.power as usize };
            return format!("{sign}{digits}{}", "0".repeat(zeros));
        }
        let behind = self.power.unsigned_abs() as usize;
        let digits = format!("{digits:0>width$}", width = behind + 1);
        let (before, behind) = digits.split_at(digits.len() - behind);
        format!("{sign}{before}.{behind}")
    }

    /// The power of ten of its first digit; none of 0.
    fn first_power(self) -> Option<i32> {
        let digits = self.whole.unsigned_abs().checked_ilog10()?;
        Some(self.power + digits as i32)
    }
}

/// Ticks of a bar.
#[derive(Clone, Debug, PartialEq)]
pub struct Ticks {
    /// Of each its place, from 0 to 1, and its label. From low to high.
    pub marks: Vec<(f64, String)>,
    /// The power of ten that all labels are times; 0 where they are as they are.
    pub power: i32,
}

/// A label that is longer than this, in digits, is written with a power of ten if that is shorter.
const LONG: usize = 6;

/// The least step, in units of the last place of the larger end.
const LEAST_ULPS: f64 = 16.0;

/// Ticks of a range, from few to many: each choice has 4 to 7 of them at multiples of 1, 2 or 5
/// times a power of ten, and where these have none, of 2.5 times one.
///
/// A range that is too narrow for that in f64 has its ends, and one number alone a tick in the
/// middle.
pub fn ticks(range: [f64; 2]) -> Vec<Ticks> {
    let [low, high] = range;
    if low == high {
        let (label, power) = written(low);
        return vec![Ticks { marks: vec![(0.5, label)], power }];
    }
    let largest = low.abs().max(high.abs());
    // Neighbouring ticks must be different numbers, and their places must be told apart.
    let least_step = LEAST_ULPS * (largest - largest.next_down());
    let half = 0.5 * high - 0.5 * low;
    let power = scientific(half).1;
    let mut found = Vec::new();
    for factors in [&[5, 2, 1][..], &[25]] {
        for power in [power + 1, power, power - 1, power - 2] {
            for &factor in factors {
                let step = Decimal { whole: factor, power };
                let count =
                    if step.value() < least_step { Vec::new() } else { inside(step, range) };
                if (4..=7).contains(&count.len()) {
                    found.push(labelled(&count, range));
                }
            }
        }
        if !found.is_empty() {
            return found;
        }
    }
    vec![ends(range)]
}

/// More steps than there are up to any number: a step is at least 16 units in the last place.
const MOST_COUNT: i64 = 1 << 50;

/// The multiples of a step inside of a range; of more than 8 only some.
fn inside(step: Decimal, [low, high]: [f64; 2]) -> Vec<Decimal> {
    let times = |count: i64| Decimal { whole: count * step.whole, ..step };
    // The first that is not below, halving from what is certainly too low and high enough: no
    // quotient, which is rounded, decides.
    let (mut below, mut count) = (-MOST_COUNT, MOST_COUNT);
    while count - below > 1 {
        let middle = (below + count) / 2;
        if times(middle).value() < low { below = middle } else { count = middle }
    }
    (count..count + 9).map(times).take_while(|tick| tick.value() <= high).collect()
}

/// Ticks with labels that have as many decimals as one of them needs.
fn labelled(ticks: &[Decimal], range: [f64; 2]) -> Ticks {
    let mut ticks = ticks.to_vec();
    while ticks.iter().all(|tick| tick.whole % 10 == 0) {
        ticks.iter_mut().for_each(|tick| {
            *tick = Decimal { whole: tick.whole / 10, power: tick.power + 1 };
        });
    }
    let longest = |power: i32| {
        let lengths = ticks.iter().map(|tick| digits(&moved(*tick, power).plain()));
        lengths.max().unwrap_or(0)
    };
    let first = ticks.iter().filter_map(|tick| tick.first_power()).max().unwrap_or(0);
    let plain = longest(0);
    let power = if plain > LONG && longest(first) < plain { first } else { 0 };
    let mark = |tick: &Decimal| (maps::place(tick.value(), range), moved(*tick, power).plain());
    Ticks { marks: ticks.iter().map(mark).collect(), power }
}

/// Divided by a power of ten.
fn moved(tick: Decimal, power: i32) -> Decimal {
    Decimal { power: tick.power - power, ..tick }
}

/// The characters of a label without its sign.
fn digits(label: &str) -> usize {
    label.trim_start_matches('−').chars().count()
}

/// The two ends, with as many digits as tell them from other numbers.
fn ends(range: [f64; 2]) -> Ticks {
    let of = |labels: [String; 2], power| Ticks {
        marks: [0.0, 1.0].into_iter().zip(labels).collect(),
        power,
    };
    let [(low, p), (high, q)] = range.map(written);
    // Zero is zero times any power.
    if p == q || range[0] == 0.0 || range[1] == 0.0 {
        return of([low, high], if p == 0 { q } else { p });
    }
    let plain = range.map(|end| format!("{end}").replace('-', "−"));
    if plain.iter().all(|label| digits(label) <= 3 * LONG) {
        return of(plain, 0);
    }
    of(range.map(short), 0)
}

/// The shortest digits that tell a finite number from others, and the power of ten of the first.
fn scientific(value: f64) -> (String, i32) {
    let text = format!("{value:e}");
    let (digits, power) = text.split_once('e').expect("it has an exponent");
    (digits.replace('-', "−"), power.parse().expect("a whole number"))
}

/// A number's shortest digits, divided by a power of ten where that is shorter; and the power.
fn written(value: f64) -> (String, i32) {
    // Zero has no sign.
    let value = value + 0.0;
    let plain = format!("{value}").replace('-', "−");
    let (short, power) = scientific(value);
    if digits(&plain) > LONG && digits(&short) < digits(&plain) {
        (short, power)
    } else {
        (plain, 0)
    }
}

/// A number as a label by itself: its shortest digits, with its power of ten if that is shorter.
pub fn short(value: f64) -> String {
    match written(value) {
        (digits, 0) => digits,
        (digits, power) if digits == "1" => power_of_ten(power)[2..].to_owned(),
        (digits, power) => digits + &power_of_ten(power),
    }
}

/// "×10³" and the like.
pub fn power_of_ten(power: i32) -> String {
    let raised = |c: char| match c.to_digit(10) {
        Some(digit) => ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'][digit as usize],
        None => '⁻',
    };
    format!("×10{}", power.to_string().chars().map(raised).collect::<String>())
}

/// The nice number nearest to a positive one: 1, 2 or 5 times a power of ten, by their ratio.
pub fn nearest_nice(value: f64) -> f64 {
    let power = scientific(value).1;
    let nice = [(1, power), (2, power), (5, power), (1, power + 1)];
    let nice = nice.map(|(whole, power)| Decimal { whole, power }.value());
    // Ratios, the larger by the smaller; the first of equal ones.
    let ratio = |nice: f64| if nice > value { nice / value } else { value / nice };
    nice.into_iter().reduce(|a, b| if ratio(b) < ratio(a) { b } else { a }).unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ranges, and the labels of the choice with most ticks, with their power of ten.
    const KNOWN: [([f64; 2], &str, i32); 39] = [
        ([0.0, 1.0], "0.0 0.2 0.4 0.6 0.8 1.0", 0),
        ([0.0, 10.0], "0 2 4 6 8 10", 0),
        ([-1.0, 1.0], "−1.0 −0.5 0.0 0.5 1.0", 0),
        ([0.1, 0.3], "0.10 0.15 0.20 0.25 0.30", 0),
        ([0.0, 7.0], "0 2 4 6", 0),
        ([1.0, 8.0], "2 4 6 8", 0),
        ([0.0, 255.0], "0 50 100 150 200 250", 0),
        ([0.0, std::f64::consts::TAU], "0 1 2 3 4 5 6", 0),
        ([-5.0, -3.0], "−5.0 −4.5 −4.0 −3.5 −3.0", 0),
        ([-40.0, 1250.0], "0 200 400 600 800 1000 1200", 0),
        ([99.9, 100.1], "99.90 99.95 100.00 100.05 100.10", 0),
        ([273.15, 300.0], "275 280 285 290 295 300", 0),
        ([0.2, 14.9], "2 4 6 8 10 12 14", 0),
        ([2.2, 16.9], "4 6 8 10 12 14 16", 0),
        ([0.0, 19.9], "0 5 10 15", 0),
        // Steps of 1, 2 and 5 give 3 ticks or 8 and more.
        ([0.3, 17.8], "2.5 5.0 7.5 10.0 12.5 15.0 17.5", 0),
        ([-13.0, 4.9], "−12.5 −10.0 −7.5 −5.0 −2.5 0.0 2.5", 0),
        ([-4.9, 12.9], "−2.5 0.0 2.5 5.0 7.5 10.0 12.5", 0),
        // Long numbers have a power of ten in common, where that makes them shorter.
        ([-0.0012, 0.0031], "−0.001 0.000 0.001 0.002 0.003", 0),
        ([0.0, 0.000_72], "0.0000 0.0002 0.0004 0.0006", 0),
        ([0.0, 3.2e-7], "0.0 0.5 1.0 1.5 2.0 2.5 3.0", -7),
        ([0.0, 250_000.0], "0 50000 100000 150000 200000 250000", 0),
        ([0.0, 1_000_000.0], "0.0 0.2 0.4 0.6 0.8 1.0", 6),
        ([123_456.0, 123_460.0], "123456 123457 123458 123459 123460", 0),
        ([6.02e23, 6.03e23], "6.020 6.022 6.024 6.026 6.028 6.030", 23),
        (
            [1e9, 1e9 + 1.0],
            "1000000000.0 1000000000.2 1000000000.4 1000000000.6 1000000000.8 1000000001.0",
            0,
        ),
        // The largest and the least.
        ([f64::MIN, f64::MAX], "−1.5 −1.0 −0.5 0.0 0.5 1.0 1.5", 308),
        ([0.0, f64::MAX], "0.0 0.5 1.0 1.5", 308),
        ([-1e-300, 1e-300], "−1.0 −0.5 0.0 0.5 1.0", -300),
        ([0.0, 1e-320], "0.0 0.2 0.4 0.6 0.8 1.0", -320),
        // Too narrow for f64: the ends.
        ([0.0, 5e-324], "0 5", -324),
        ([5e-324, 1e-323], "5×10⁻³²⁴ 10⁻³²³", 0),
        ([1.0, 1.0 + f64::EPSILON], "1 1.0000000000000002", 0),
        ([1e15, 1e15 + 1.0], "1000000000000000 1000000000000001", 0),
        // One number alone.
        ([5.0, 5.0], "5", 0),
        ([-0.0, 0.0], "0", 0),
        ([-0.0, -0.0], "0", 0),
        ([1e-7, 1e-7], "1", -7),
        ([-2.5e10, -2.5e10], "−2.5", 10),
    ];

    #[test]
    fn ticks_are_nice() {
        for (range, labels, power) in KNOWN {
            let ticks = ticks(range).pop().expect("a choice");
            let found: Vec<&str> = ticks.marks.iter().map(|(_, label)| label.as_str()).collect();
            assert_eq!((found.join(" ").as_str(), ticks.power), (labels, power), "{range:?}");
        }
        let places: Vec<f64> = ticks([-40.0, 1250.0])[0].marks.iter().map(|mark| mark.0).collect();
        assert_eq!(places[1], maps::place(200.0, [-40.0, 1250.0]));
    }

    /// A label as the number that it says.
    fn said(label: &str, power: i32) -> f64 {
        format!("{}e{power}", label.replace('−', "-")).parse().expect("a number")
    }

    #[test]
    fn every_range_has_four_to_seven_at_the_places_they_say() {
        let mut state = 1_u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(99_999);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        let mut counted = 0;
        for round in 0..12_000 {
            let scale = 10.0_f64.powi(round % 600 - 300);
            let low = scale * (random() - 0.5);
            let high = low + scale * random() * 10.0_f64.powi(-(round % 13));
            let range = [low, high];
            let ulp = low.abs().max(high.abs());
            let ulp = ulp - ulp.next_down();
            for ticks in ticks(range) {
                if high - low < 150.0 * ulp {
                    continue;
                }
                counted += 1;
                assert!((4..=7).contains(&ticks.marks.len()), "{range:?}: {ticks:?}");
                for pair in ticks.marks.windows(2) {
                    assert!(pair[0].0 < pair[1].0, "{range:?}: {ticks:?}");
                }
                for (place, label) in &ticks.marks {
                    let value = said(label, ticks.power);
                    assert!(low <= value && value <= high, "{range:?}: {label}");
                    assert_eq!(*place, maps::place(value, range));
                }
            }
        }
        assert!(counted > 12_000, "{counted} choices");
    }

    #[test]
    fn numbers_are_short() {
        for (value, label) in [
            (0.0, "0"),
            (-0.0, "0"),
            (1.0, "1"),
            (0.1, "0.1"),
            (-7.7, "−7.7"),
            (0.0001, "0.0001"),
            (0.000_25, "2.5×10⁻⁴"),
            (1e-7, "10⁻⁷"),
            (-1.5e-7, "−1.5×10⁻⁷"),
            (200_000.0, "200000"),
            (1_234_567.0, "1234567"),
            (2e6, "2×10⁶"),
            (5e22, "5×10²²"),
            (1e300, "10³⁰⁰"),
        ] {
            assert_eq!(short(value), label);
        }
    }

    #[test]
    fn the_nearest_nice_number_is_near() {
        for (value, nice) in [
            (1.0, 1.0),
            (1.4, 1.0),
            (1.42, 2.0),
            (3.1, 2.0),
            (3.2, 5.0),
            (7.0, 5.0),
            (7.1, 10.0),
            (0.0102, 0.01),
            (31_892.3, 50_000.0),
            (5e-324, 5e-324),
            (f64::MAX, 1e308),
        ] {
            assert_eq!(nearest_nice(value), nice, "{value}");
        }
    }
}
