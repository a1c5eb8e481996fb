//! f32 as an unfriendly device may compute it, within what WGSL allows.
//!
//! Sums, differences and products are rounded to either neighbour; products may be fused into sums;
//! sums of several terms may be taken in another order; quotients are off by up to 2.5 units in the
//! last place, square roots by the 4.5 that they inherit from `1 / inverseSqrt`; subnormal numbers
//! may become 0, going in or coming out. Which of these happens is drawn from a seed, for each
//! operation anew or for each place in the program once and for all: errors that always point the
//! same way are the ones that add up.

use std::rc::Rc;

/// Which neighbour is taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rounding {
    /// The nearest, as ordinary devices do.
    Nearest,
    /// The lower.
    Down,
    /// The upper.
    Up,
    /// Either, drawn each time.
    Random,
    /// Either, drawn once for each operation of the program.
    Fixed,
}

/// How often out of 256 times.
#[derive(Clone, Copy, Debug)]
pub struct Habits {
    /// How it rounds.
    pub rounding: Rounding,
    /// Fuses a product into a sum.
    pub contract: u8,
    /// Takes a sum in another order.
    pub reorder: u8,
    /// Flushes a subnormal number.
    pub flush: u8,
}

impl Habits {
    /// IEEE 754 to the letter.
    pub const FRIENDLY: Self =
        Self { rounding: Rounding::Nearest, contract: 0, reorder: 0, flush: 0 };

    /// One of many kinds.
    pub fn of_seed(seed: u64) -> Self {
        let often = |k: u64| [0, 128, 255][(seed / k % 3) as usize];
        let roundings = [Rounding::Fixed, Rounding::Random, Rounding::Down, Rounding::Up];
        let rounding = roundings[(seed % 4) as usize];
        Self {
            rounding,
            contract: often(4),
            reorder: [0, 128][(seed / 12 % 2) as usize],
            flush: often(24),
        }
    }
}

/// What a sum is made of.
#[derive(Clone, Copy, Debug)]
struct Term {
    value: f32,
    /// Before it was rounded, if it is a product.
    product: Option<f64>,
}

/// How a number came about, as far as a compiler could use it.
#[derive(Clone, Debug, Default)]
enum Source {
    #[default]
    Plain,
    Product(f64),
    Sum(Rc<[Term]>),
}

/// A number and how it came about.
#[derive(Clone, Debug, Default)]
pub struct Float {
    /// Its value.
    pub value: f32,
    source: Source,
}

impl From<f32> for Float {
    fn from(value: f32) -> Self {
        Self { value, source: Source::Plain }
    }
}

impl Float {
    fn terms(&self) -> Vec<Term> {
        match &self.source {
            Source::Plain => vec![Term { value: self.value, product: None }],
            Source::Product(exact) => vec![Term { value: self.value, product: Some(*exact) }],
            Source::Sum(terms) => terms.to_vec(),
        }
    }

    /// With the other sign, which is exact.
    pub fn negated(&self) -> Self {
        let flip = |t: &Term| Term { value: -t.value, product: t.product.map(|p| -p) };
        let source = match &self.source {
            Source::Plain => Source::Plain,
            Source::Product(exact) => Source::Product(-exact),
            Source::Sum(terms) => Source::Sum(terms.iter().map(flip).collect()),
        };
        Self { value: -self.value, source }
    }
}

/// Longer sums are kept in their order.
const TERMS: usize = 8;

/// The device's arithmetic.
pub struct Unfriendly {
    habits: Habits,
    seed: u64,
    state: u64,
}

fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// The exact sum of two f64 as a pair.
fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let part = sum - a;
    (sum, (a - (sum - part)) + (b - part))
}

/// The f32 next to the exact number `high + low`, on both sides; twice the same if it is one.
fn neighbours(high: f64, low: f64) -> [f32; 2] {
    let nearest = high as f32;
    let above = f64::from(nearest) - high;
    let side = if above != 0.0 { above } else { -low };
    match side {
        0.0 => [nearest; 2],
        s if s > 0.0 => [nearest.next_down(), nearest],
        _ => [nearest, nearest.next_up()],
    }
}

impl Unfriendly {
    /// With habits, and a seed for its choices.
    pub fn new(habits: Habits, seed: u64) -> Self {
        Self { habits, seed: mix(seed ^ 0x9e37_79b9_7f4a_7c15), state: mix(seed) }
    }

    fn bits(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        mix(self.state)
    }

    fn chance(&mut self, often: u8) -> bool {
        often > 0 && (self.bits() >> 56) as u8 <= often
    }

    /// One of many, for the operation at `site` always the same.
    fn choice(&mut self, site: u64, many: u64) -> u64 {
        match self.habits.rounding {
            Rounding::Down => 0,
            Rounding::Up => many - 1,
            Rounding::Fixed => mix(self.seed ^ site) % many,
            Rounding::Random | Rounding::Nearest => self.bits() % many,
        }
    }

    fn flushed(&mut self, value: f32) -> f32 {
        if value.is_subnormal() && self.chance(self.habits.flush) {
            0.0f32.copysign(value)
        } else {
            value
        }
    }

    fn rounded(&mut self, site: u64, high: f64, low: f64) -> f32 {
        let value = match self.habits.rounding {
            Rounding::Nearest => {
                // The tie is decided by the low part: f64 holds the rest.
                let [down, up] = neighbours(high, low);
                let (below, above) = ((high - f64::from(down)) + low, (f64::from(up) - high) - low);
                if below == above {
                    high as f32
                } else if below < above {
                    down
                } else {
                    up
                }
            }
            _ => neighbours(high, low)[self.choice(site, 2) as usize],
        };
        self.flushed(value)
    }

    fn pair(&mut self, site: u64, a: Term, b: Term) -> f32 {
        let (a_value, b_value) =
            (f64::from(self.flushed(a.value)), f64::from(self.flushed(b.value)));
        // One fused product at most: a machine has no more.
        let fuse = self.chance(self.habits.contract);
        let (x, y) = match (a.product, b.product) {
            (Some(p), None) if fuse => (p, b_value),
            (None, Some(p)) if fuse => (a_value, p),
            (Some(p), Some(q)) if fuse => {
                if self.bits() & 1 == 0 {
                    (p, b_value)
                } else {
                    (a_value, q)
                }
            }
            _ => (a_value, b_value),
        };
        let (high, low) = two_sum(x, y);
        self.rounded(site, high, low)
    }

    /// Sum.
    pub fn add(&mut self, site: u64, a: &Float, b: &Float) -> Float {
        if self.habits.reorder == 0 {
            let whole = |f: &Float| Term {
                value: f.value,
                product: if let Source::Product(p) = f.source { Some(p) } else { None },
            };
            return self.pair(site, whole(a), whole(b)).into();
        }
        let mut terms = a.terms();
        terms.extend(b.terms());
        if terms.len() > TERMS {
            let plain = |f: &Float| Term { value: f.value, product: None };
            return self.pair(site, plain(a), plain(b)).into();
        }
        let source = Source::Sum(terms.clone().into());
        let value = if terms.len() > 2 && self.chance(self.habits.reorder) {
            for k in (1..terms.len()).rev() {
                terms.swap(k, (self.bits() % (k as u64 + 1)) as usize);
            }
            let mut sum = terms[0];
            for (k, &term) in terms[1..].iter().enumerate() {
                sum = Term { value: self.pair(site + k as u64, sum, term), product: None };
            }
            sum.value
        } else {
            let whole = |f: &Float| Term {
                value: f.value,
                product: if let Source::Product(p) = f.source { Some(p) } else { None },
            };
            self.pair(site, whole(a), whole(b))
        };
        Float { value, source }
    }

    /// Product.
    pub fn mul(&mut self, site: u64, a: &Float, b: &Float) -> Float {
        let exact = f64::from(self.flushed(a.value)) * f64::from(self.flushed(b.value));
        let value = self.rounded(site, exact, 0.0);
        Float {
            value,
            source: if self.habits.contract > 0 { Source::Product(exact) } else { Source::Plain },
        }
    }

    /// What lies up to so many (relative) units of 2^-23 from a number, rounded towards it.
    fn near(&mut self, site: u64, exact: f64, units: f64) -> Float {
        if self.habits.rounding == Rounding::Nearest {
            return (exact as f32).into();
        }
        // As far off as may be, mostly.
        let part = [-1.0, -1.0, 0.3, 1.0, 1.0][self.choice(site, 5) as usize];
        let moved = exact + exact.abs() * (part * units * f64::from(f32::EPSILON));
        let [down, up] = neighbours(moved, 0.0);
        let value = if moved > exact { down } else { up };
        self.flushed(value).into()
    }

    /// Quotient: 2.5 units in the last place.
    pub fn div(&mut self, site: u64, a: &Float, b: &Float) -> Float {
        let exact = f64::from(self.flushed(a.value)) / f64::from(self.flushed(b.value));
        // Units in the last place are relative ones over the mantissa.
        let mantissa =
            f64::from(f32::from_bits(((exact.abs() as f32).to_bits() & 0x7f_ffff) | 0x3f80_0000));
        self.near(site, exact, 2.5 / mantissa)
    }

    /// Square root: the errors of `inverseSqrt` (2 units) and of a quotient (2.5), each relative at
    /// worst. Of a negative number it is whatever the device likes.
    pub fn sqrt(&mut self, site: u64, a: &Float) -> Float {
        let value = self.flushed(a.value);
        if value < 0.0 && self.habits.rounding != Rounding::Nearest {
            // Anything.
            let any = [f32::NEG_INFINITY, -1.0, 0.0, 1.0, 1e30, f32::INFINITY, f32::NAN];
            return any[self.choice(site, any.len() as u64) as usize].into();
        }
        self.near(site, f64::from(value).sqrt(), 4.5)
    }

    /// From an integer.
    pub fn convert(&mut self, site: u64, value: f64) -> Float {
        self.rounded(site, value, 0.0).into()
    }

    /// A number as a comparison sees it.
    pub fn seen(&mut self, a: &Float) -> f32 {
        self.flushed(a.value)
    }
}
