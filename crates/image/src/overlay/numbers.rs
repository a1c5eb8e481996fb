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
    let least_step = 16.0 * (largest - largest.next_down());
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

/// The multiples of a step inside of a range; of more than 8 only some.
fn inside(step: Decimal, [low, high]: [f64; 2]) -> Vec<Decimal> {
    let times = |count: i64| Decimal { whole: count * step.whole, ..step };
    // The quotient is off by less than one: it is below 2^53 / 16.
    let mut count = (low / step.value()).floor() as i64 - 1;
    while times(count).value() < low {
        count += 1;
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
    let labels = range.map(short);
    let marks = [0.0, 1.0].into_iter().zip(labels).collect();
    Ticks { marks, power: 0 }
}

/// The shortest digits that tell a finite number from others, and the power of ten of the first.
fn scientific(value: f64) -> (String, i32) {
    let text = format!("{value:e}");
    let (digits, power) = text.split_once('e').expect("it has an exponent");
    (digits.replace('-', "−"), power.parse().expect("a whole number"))
}

/// A number's shortest digits, divided by a power of ten where that is shorter; and the power.
fn written(value: f64) -> (String, i32) {
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
