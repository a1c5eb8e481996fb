//! Two kinds of intervals that are certain to hold the real number they stand for: quick ones of
//! f64, and ones of big integers with as many binary places as are asked for. This file knows
//! nothing of spheres.

use std::cmp::Ordering;

use dashu_int::{
    IBig, UBig,
    ops::{BitTest, DivEuclid, SquareRoot},
};

/// Real numbers known to lie between two ends. `Places` is how finely the ends are kept.
pub trait Real: Clone {
    /// How finely the ends are kept.
    type Places: Copy;
    /// Just this number.
    fn exact(value: f64, places: Self::Places) -> Self;
    /// `odd * length / (2 * divisor)`.
    fn offset(odd: i64, length: f64, divisor: u32, places: Self::Places) -> Self;
    /// `self + other`.
    fn plus(&self, other: &Self) -> Self;
    /// `self - other`.
    fn minus(&self, other: &Self) -> Self;
    /// `self * other`.
    fn times(&self, other: &Self) -> Self;
    /// `self * self`, never below 0.
    fn square(&self) -> Self;
    /// The square root of the part that is not negative.
    fn root(&self) -> Self;
    /// The sign, when it is certain. A number that is certainly 0 is `Equal`.
    fn sign(&self) -> Option<Ordering>;

    /// Whether it is certainly below zero.
    fn negative(&self) -> bool {
        self.sign() == Some(Ordering::Less)
    }
}

/// An interval of f64. Every operation moves both ends outwards by one step, whichever way the
/// machine rounded. An end of infinity says only that the number, which is finite, may be beyond
/// the largest f64.
#[derive(Clone, Copy, Debug)]
pub struct Rough {
    /// Lower end, below infinity.
    pub low: f64,
    /// Upper end, above minus infinity.
    pub high: f64,
}

impl Rough {
    /// From two ends that were each rounded to nearest once. Where the machine gave no number,
    /// nothing is known.
    fn outwards(low: f64, high: f64) -> Self {
        Self {
            low: if low.is_nan() { f64::NEG_INFINITY } else { low.next_down() },
            high: if high.is_nan() { f64::INFINITY } else { high.next_up() },
        }
    }
}

/// A product of two ends. Nothing times an unbounded but finite number is nothing.
fn end_product(a: f64, b: f64) -> f64 {
    if a == 0.0 || b == 0.0 { 0.0 } else { a * b }
}

impl Real for Rough {
    type Places = ();

    fn exact(value: f64, (): ()) -> Self {
        Self { low: value, high: value }
    }

    fn offset(odd: i64, length: f64, divisor: u32, (): ()) -> Self {
        if odd == 0 {
            return Self { low: 0.0, high: 0.0 };
        }
        // The integers are below 2^53, so they are f64 without rounding. A quotient of the ends of
        // a product that was moved outwards is moved outwards again.
        let product = Self::exact(odd as f64, ()).times(&Self::exact(length, ()));
        let divisor = 2.0 * f64::from(divisor);
        Self::outwards(product.low / divisor, product.high / divisor)
    }

    fn plus(&self, other: &Self) -> Self {
        Self::outwards(self.low + other.low, self.high + other.high)
    }

    fn minus(&self, other: &Self) -> Self {
        Self::outwards(self.low - other.high, self.high - other.low)
    }

    fn times(&self, other: &Self) -> Self {
        let ends = [
            end_product(self.low, other.low),
            end_product(self.low, other.high),
            end_product(self.high, other.low),
            end_product(self.high, other.high),
        ];
        Self::outwards(
            ends.iter().copied().fold(f64::INFINITY, f64::min),
            ends.iter().copied().fold(f64::NEG_INFINITY, f64::max),
        )
    }

    fn square(&self) -> Self {
        let (low, high) = (self.low.abs(), self.high.abs());
        let (least, most) = if low < high { (low, high) } else { (high, low) };
        let least = if self.low <= 0.0 && self.high >= 0.0 { 0.0 } else { least };
        Self { low: (least * least).next_down().max(0.0), high: (most * most).next_up() }
    }

    fn root(&self) -> Self {
        Self {
            low: self.low.max(0.0).sqrt().next_down().max(0.0),
            high: self.high.max(0.0).sqrt().next_up(),
        }
    }

    fn sign(&self) -> Option<Ordering> {
        if self.low > 0.0 {
            Some(Ordering::Greater)
        } else if self.high < 0.0 {
            Some(Ordering::Less)
        } else if self.low == 0.0 && self.high == 0.0 {
            Some(Ordering::Equal)
        } else {
            None
        }
    }
}

/// An interval whose ends are whole multiples of `2^-places`.
#[derive(Clone, Debug)]
pub struct Fixed {
    low: IBig,
    high: IBig,
    places: usize,
}

/// `mantissa * 2^exponent` is this number; the mantissa is odd, or both are 0.
pub fn split(value: f64) -> (i64, i32) {
    assert!(value.is_finite(), "only finite numbers are exact: {value}");
    let bits = value.to_bits();
    let stored = ((bits >> 52) & 0x7ff) as i32;
    let fraction = (bits & ((1 << 52) - 1)) as i64;
    let (mantissa, exponent) =
        if stored == 0 { (fraction, -1074) } else { (fraction | 1 << 52, stored - 1075) };
    if mantissa == 0 {
        return (0, 0);
    }
    let even = mantissa.trailing_zeros();
    let odd = mantissa >> even;
    (if value < 0.0 { -odd } else { odd }, exponent + even as i32)
}

/// `value / 2^shift`, rounded down.
fn floor_shift(value: &IBig, shift: usize) -> IBig {
    value >> shift
}

/// `value / 2^shift`, rounded up.
fn ceil_shift(value: &IBig, shift: usize) -> IBig {
    -((-value) >> shift)
}

/// `value / divisor` for a positive divisor, rounded up.
fn ceil_div(value: IBig, divisor: &IBig) -> IBig {
    -((-value).div_euclid(divisor))
}

impl Fixed {
    /// Just this whole number.
    pub fn whole(value: &IBig, places: usize) -> Self {
        let end = value << places;
        Self { low: end.clone(), high: end, places }
    }

    /// `self / divisor`, for a divisor that is certainly positive.
    pub fn over(&self, divisor: &Self) -> Self {
        assert!(divisor.low > IBig::ZERO, "the divisor must be positive");
        let least = if self.low < IBig::ZERO { &divisor.low } else { &divisor.high };
        let most = if self.high < IBig::ZERO { &divisor.high } else { &divisor.low };
        Self {
            low: (&self.low << self.places).div_euclid(least),
            high: ceil_div(&self.high << self.places, most),
            places: self.places,
        }
    }

    /// Whether it certainly lies strictly between `-2^exponent` and `2^exponent`.
    pub fn within(&self, exponent: i64) -> bool {
        let Ok(shift) = usize::try_from(self.places as i64 + exponent) else { return false };
        // A magnitude of at most `shift` bits is below 2^shift.
        [&self.low, &self.high].into_iter().all(|end| magnitude_bits(end) <= shift)
    }

    /// Whether it is certainly positive, and its ends differ by at most `2^-bits` of the lower one.
    pub fn is_known_to(&self, bits: usize) -> bool {
        self.low > IBig::ZERO && &self.high - &self.low <= (&self.low >> bits)
    }

    /// The orders of both ends against an f64, which may be infinite.
    pub fn against(&self, value: f64) -> [Ordering; 2] {
        if value.is_infinite() {
            return [if value > 0.0 { Ordering::Less } else { Ordering::Greater }; 2];
        }
        let (mantissa, exponent) = split(value);
        let (mantissa, shift) = (IBig::from(mantissa), i64::from(exponent) + self.places as i64);
        [&self.low, &self.high].map(|end| {
            if shift >= 0 {
                end.cmp(&(&mantissa << shift as usize))
            } else {
                (end << shift.unsigned_abs() as usize).cmp(&mantissa)
            }
        })
    }

    /// The lower end as an f64, nearly, and what it must be multiplied with as a power of two: for
    /// messages.
    pub fn words(&self) -> String {
        let drop = magnitude_bits(&self.low).saturating_sub(60);
        let leading = (&self.low >> drop).to_f64().value();
        format!("{leading:e} 2^{}", drop as i64 - self.places as i64)
    }

    /// The nearest f64, if it is certain and not subnormal.
    pub fn nearest(&self) -> Option<f64> {
        let scale = 2f64.powi(-(self.places as i32));
        // The conversion rounds to nearest; scaling by a power of two is exact for normal numbers.
        let [low, high] = [&self.low, &self.high].map(|end| end.to_f64().value() * scale);
        let certain = low == high && (low == 0.0 || low.is_normal());
        (self.places <= 900 && certain).then_some(low)
    }

    /// An f64 interval that holds this one. Meant for numbers of moderate size.
    pub fn rough(&self) -> Rough {
        assert!(self.places <= 900, "2^-places must be a normal f64");
        let scale = 2f64.powi(-(self.places as i32));
        // The conversion rounds to nearest; scaling by a power of two rounds only below the normal
        // numbers.
        let near = |end: &IBig| end.to_f64().value();
        Rough {
            low: (near(&self.low).next_down() * scale).next_down(),
            high: (near(&self.high).next_up() * scale).next_up(),
        }
    }
}

/// Length of the magnitude in bits, 0 for 0.
pub fn magnitude_bits(value: &IBig) -> usize {
    let (_, magnitude) = value.clone().into_parts();
    BitTest::bit_len(&magnitude)
}

/// The largest whole number whose square is not above `value`, for `value >= 0`.
fn whole_root(value: &IBig) -> IBig {
    let (_, magnitude) = value.clone().into_parts();
    let root: UBig = magnitude.sqrt();
    IBig::from(root)
}

/// The root of a whole number, if it is whole itself.
pub fn perfect_root(value: &IBig) -> Option<IBig> {
    let root = whole_root(value);
    (&root * &root == *value).then_some(root)
}

impl Real for Fixed {
    type Places = usize;

    fn exact(value: f64, places: usize) -> Self {
        let (mantissa, exponent) = split(value);
        let mantissa = IBig::from(mantissa);
        let shift = exponent as i64 + places as i64;
        if shift >= 0 {
            let end = mantissa << shift as usize;
            Self { low: end.clone(), high: end, places }
        } else {
            let shift = shift.unsigned_abs() as usize;
            Self { low: floor_shift(&mantissa, shift), high: ceil_shift(&mantissa, shift), places }
        }
    }

    fn offset(odd: i64, length: f64, divisor: u32, places: usize) -> Self {
        let (mantissa, exponent) = split(length);
        let top = IBig::from(odd) * IBig::from(mantissa);
        let bottom = IBig::from(2 * i64::from(divisor));
        let shift = exponent as i64 + places as i64;
        let (top, bottom) = if shift >= 0 {
            (top << shift as usize, bottom)
        } else {
            (top, bottom << shift.unsigned_abs() as usize)
        };
        Self { low: top.clone().div_euclid(&bottom), high: ceil_div(top, &bottom), places }
    }

    fn plus(&self, other: &Self) -> Self {
        Self { low: &self.low + &other.low, high: &self.high + &other.high, places: self.places }
    }

    fn minus(&self, other: &Self) -> Self {
        Self { low: &self.low - &other.high, high: &self.high - &other.low, places: self.places }
    }

    fn times(&self, other: &Self) -> Self {
        let ends = [
            &self.low * &other.low,
            &self.low * &other.high,
            &self.high * &other.low,
            &self.high * &other.high,
        ];
        let least = ends.iter().min().expect("four products");
        let most = ends.iter().max().expect("four products");
        Self {
            low: floor_shift(least, self.places),
            high: ceil_shift(most, self.places),
            places: self.places,
        }
    }

    fn square(&self) -> Self {
        let low = &self.low * &self.low;
        let high = &self.high * &self.high;
        let (least, most) = if low < high { (low, high) } else { (high, low) };
        let holds_zero = self.low <= IBig::ZERO && self.high >= IBig::ZERO;
        Self {
            low: if holds_zero { IBig::ZERO } else { floor_shift(&least, self.places) },
            high: ceil_shift(&most, self.places),
            places: self.places,
        }
    }

    fn root(&self) -> Self {
        let low = if self.low > IBig::ZERO {
            whole_root(&(&self.low << self.places))
        } else {
            IBig::ZERO
        };
        let high = if self.high > IBig::ZERO {
            whole_root(&(&self.high << self.places)) + IBig::ONE
        } else {
            IBig::ZERO
        };
        Self { low, high, places: self.places }
    }

    fn sign(&self) -> Option<Ordering> {
        if self.low > IBig::ZERO {
            Some(Ordering::Greater)
        } else if self.high < IBig::ZERO {
            Some(Ordering::Less)
        } else if self.low == IBig::ZERO && self.high == IBig::ZERO {
            Some(Ordering::Equal)
        } else {
            None
        }
    }
}
