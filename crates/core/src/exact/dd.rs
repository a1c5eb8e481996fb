//! Numbers of 100 bits with a certain error: a pair of f64 and a bound.
//!
//! Sums are algorithm 6 and products algorithm 11 of Joldes, Muller and Popescu, "Tight and
//! rigorous error bounds for basic building blocks of double-word arithmetic" (ACM TOMS 44, 2017).
//! With `u = 2^-53`, sums are within `3 u^2` and products within `5 u^2` of the exact result; the
//! latter is proved by Muller and Rideau (ACM TOMS 48, 2022). Quotients and roots are derived in
//! docs/numerics.md, lemmas D3 and D4. The last bits of what falls below 2^-968 are lost to
//! underflow, which `ABSOLUTE` covers. The error travels along, rounded up.

use std::ops::{Add, Mul, Neg, Sub};

use crate::float::{FLOOR, U};

/// Bound of the relative error of a sum of pairs (lemma D1).
const SUM: f64 = 3.0 * U * U;
/// Bound of the relative error of a product of pairs, of a quotient and of a square root (lemmas D2
/// to D4).
const PRODUCT: f64 = 5.0 * U * U;
/// Bound of the absolute error of one operation that underflows.
const ABSOLUTE: f64 = FLOOR;
/// Covers the roundings of a bound made of at most 16 operations.
const UP: f64 = 1.0 + 32.0 * f64::EPSILON;

/// Exact sum of two f64 as a pair (Knuth).
fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let part = sum - a;
    (sum, (a - (sum - part)) + (b - part))
}

/// Exact sum when `a` is not the smaller (Dekker).
fn fast_two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    (sum, b - (sum - a))
}

/// Exact product of two f64 as a pair (needs no underflow).
fn two_product(a: f64, b: f64) -> (f64, f64) {
    let product = a * b;
    (product, a.mul_add(b, -product))
}

/// A real number: within `error` of `high + low`.
#[derive(Clone, Copy, Debug)]
pub struct Bounded {
    high: f64,
    low: f64,
    error: f64,
}

impl Bounded {
    /// Zero.
    pub const ZERO: Self = Self { high: 0.0, low: 0.0, error: 0.0 };

    /// An exact f64.
    pub fn exact(value: f64) -> Self {
        Self { high: value, low: 0.0, error: 0.0 }
    }

    /// `high + low`, within `error`; `low` at most half a unit in the last place of `high`.
    pub fn pair(high: f64, low: f64, error: f64) -> Self {
        Self { high, low, error }
    }

    /// The exact difference of two f64.
    pub fn difference(a: f64, b: f64) -> Self {
        let (high, low) = two_sum(a, -b);
        Self { high, low, error: 0.0 }
    }

    /// An integer times an exact f64, over an integer (each integer at most 2^53).
    pub fn ratio(factor: f64, value: f64, divisor: f64) -> Self {
        // One Newton step: the quotient of the high part, and what remains of the exact product
        // divided again. `(product - back) - back_low` is exact (lemma D3).
        let (product, product_low) = two_product(factor, value);
        let first = product / divisor;
        let (back, back_low) = two_product(first, divisor);
        let rest = ((product - back) - back_low) + product_low;
        let (high, low) = fast_two_sum(first, rest / divisor);
        Self { high, low, error: (high.abs() * PRODUCT + ABSOLUTE) * UP }
    }

    /// The same number, less certain.
    pub fn widened(self, error: f64) -> Self {
        Self { error: self.error + error, ..self }
    }

    /// The nearest f64, nearly.
    pub fn value(self) -> f64 {
        self.high
    }

    /// A lower and an upper bound; infinite after an overflow.
    pub fn bounds(self) -> [f64; 2] {
        // u for the low part and u for the rounding of the difference.
        let off = (self.error + self.high.abs() * f64::EPSILON) * UP;
        let (low, high) = (self.high - off, self.high + off);
        if low <= high { [low, high] } else { [f64::NEG_INFINITY, f64::INFINITY] }
    }

    /// Whether [`Self::value`] is within `relative` (2^-50 or more) of the number, as a part of it.
    pub fn is_within(self, relative: f64) -> bool {
        self.error <= self.high.abs() * relative
    }

    /// Square.
    pub fn square(self) -> Self {
        self * self
    }

    /// The sign, if it is certain; a certain zero counts.
    pub fn sign(self) -> Option<i32> {
        if self.high.abs() * (1.0 - f64::EPSILON) > self.error {
            Some(if self.high > 0.0 { 1 } else { -1 })
        } else if self.high == 0.0 && self.low == 0.0 && self.error == 0.0 {
            Some(0)
        } else {
            None
        }
    }

    /// Square root; of a number that may be negative, the square root of its positive part.
    pub fn sqrt(self) -> Self {
        if self.high <= 0.0 {
            return Self {
                high: 0.0,
                low: 0.0,
                error: (self.high.abs() * f64::EPSILON + self.error).sqrt() * UP,
            };
        }
        let root = self.high.sqrt();
        let (square, square_low) = two_product(root, root);
        let rest = ((self.high - square) - square_low) + self.low;
        let (high, low) = fast_two_sum(root, rest / (2.0 * root));
        // |sqrt x - sqrt y| is at most |x - y| / sqrt y and at most sqrt |x - y|. The remainder
        // loses what underflows.
        let error = self.error + ABSOLUTE;
        let carried = (error / root).min(error.sqrt()) * (1.0 + 4.0 * f64::EPSILON);
        // The Newton step is within 4.2 u^2 of the root (lemma D4).
        Self { high, low, error: (carried + PRODUCT * root) * UP }
    }
}

impl Neg for Bounded {
    type Output = Self;

    fn neg(self) -> Self {
        Self { high: -self.high, low: -self.low, error: self.error }
    }
}

impl Add for Bounded {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        let (s_high, s_low) = two_sum(self.high, other.high);
        let (t_high, t_low) = two_sum(self.low, other.low);
        let (v_high, v_low) = fast_two_sum(s_high, s_low + t_high);
        let (high, low) = fast_two_sum(v_high, t_low + v_low);
        // Sums of f64 do not underflow inexactly: the relative bound is all.
        Self { high, low, error: (self.error + other.error + SUM * high.abs()) * UP }
    }
}

impl Sub for Bounded {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for Bounded {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        let (c_high, c_low) = two_product(self.high, other.high);
        let t_low = self.high.mul_add(other.low, self.low * other.high);
        let (high, low) = fast_two_sum(c_high, c_low + t_low);
        // |high| bounds |value| up to one unit in its last place, which UP covers.
        let carried = self.high.abs() * other.error
            + other.high.abs() * self.error
            + self.error * other.error;
        Self { high, low, error: (carried + PRODUCT * high.abs() + ABSOLUTE) * UP }
    }
}

#[cfg(test)]
mod tests {
    use dashu_int::IBig;

    use super::*;
    use crate::axes::integer;

    /// `value * 2^300`, exact for the operands of these tests.
    fn fixed(value: f64) -> IBig {
        integer(value, -300)
    }

    fn random(state: &mut u64) -> u64 {
        *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = *state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A pair with mantissas that round badly: many are just above a power of two.
    fn number(state: &mut u64) -> Bounded {
        let bits = random(state);
        let short = bits >> 3 & 1 == 0;
        let mantissa = if short {
            1.0 + (random(state) >> 11 >> (bits % 40)) as f64 * 2f64.powi(-53)
        } else {
            (random(state) >> 11) as f64 * 2f64.powi(-53)
        };
        let high = mantissa
            * 2f64.powi((bits >> 8) as i32 % 40 - 20)
            * if bits & 1 == 0 { 1.0 } else { -1.0 };
        let low = high
            * 2f64.powi(-54)
            * ((random(state) % 1001) as f64 / 1000.0)
            * if bits & 2 == 0 { 1.0 } else { -1.0 };
        let (high, low) = two_sum(high, low);
        Bounded { high, low, error: 0.0 }
    }

    /// The exact value in units of 2^-300.
    fn whole(x: Bounded) -> IBig {
        fixed(x.high) + fixed(x.low)
    }

    /// Every operation contains the exact result of its exact operands, and no bound is eight times
    /// what is needed.
    #[test]
    fn bounds_hold_against_integers_and_are_not_loose() {
        let mut state = 7;
        let mut worst = [0.0f64; 4];
        for _ in 0..300_000 {
            let (a, b) = (number(&mut state), number(&mut state));
            let mut check = |kind: usize, result: Bounded, off: IBig, unit: f64| {
                let ratio = off.to_f64().value().abs() * unit / result.error;
                assert!(ratio <= 1.0, "{ratio} of the bound: {a:?} {b:?} {result:?}");
                assert!(result.error <= result.high.abs() * 2f64.powi(-103) + 1e-250);
                worst[kind] = worst[kind].max(ratio);
            };
            let unit = 2f64.powi(-300);
            // Sums of one sign: what cancels is known better than the bound says.
            let (sum, product) = (a + b, a * b);
            if sum.error > 0.0 {
                check(0, sum, whole(sum) - whole(a) - whole(b), unit);
            }
            check(1, product, (whole(product) << 300) - whole(a) * whole(b), unit * unit);
            let square = if a.high > 0.0 { a } else { -a };
            let root = square.sqrt();
            // |root - sqrt square| = |root^2 - square| / (root + sqrt square).
            let off = whole(root) * whole(root) - (whole(square) << 300);
            check(2, root, off, unit * unit / (2.0 * root.high));
            let (factor, divisor) = (
                (random(&mut state) % 65536) as f64 + 1.0,
                (random(&mut state) % 65535 + 1) as f64,
            );
            let ratio = Bounded::ratio(factor, a.high, divisor);
            let off = whole(ratio) * fixed(divisor) - fixed(factor) * fixed(a.high);
            check(3, ratio, off, unit * unit / divisor);
        }
        println!("sum, product, root, ratio: {worst:.3?} of the bound");
        assert!(worst.iter().all(|&w| w > 0.125), "{worst:?}");
    }

    /// Where bits are lost to underflow the bound still holds.
    #[test]
    fn underflow_is_covered() {
        let mut state = 5;
        let scale = |x: Bounded, power: i32| Bounded {
            high: x.high * 2f64.powi(power),
            low: x.low * 2f64.powi(power),
            error: 0.0,
        };
        let mut lost = 0;
        for _ in 0..20_000 {
            let (a, b) = (scale(number(&mut state), -500), scale(number(&mut state), -520));
            let product = a * b;
            let exact = |x: Bounded| integer(x.high, -1074) + integer(x.low, -1074);
            // In units of 2^-1074.
            let off: IBig = ((exact(product) << 1074) - exact(a) * exact(b)) >> 1000;
            let off = off.to_f64().value().abs() * 2f64.powi(-74);
            let units = |error: f64| error * 2f64.powi(537) * 2f64.powi(537);
            assert!(off <= units(product.error), "{a:?} {b:?}");
            lost += usize::from(off > units(PRODUCT * product.high.abs()));
        }
        assert!(lost > 1000, "{lost}");
    }

    /// `bounds` holds the pair and its error, and is not eight times wider than the low part and a
    /// rounding ask for.
    #[test]
    fn bounds_are_close() {
        let mut state = 9;
        let mut worst = 0.0f64;
        for _ in 0..100_000 {
            let a = number(&mut state);
            let [low, high] = a.bounds();
            let above = (fixed(high) - whole(a)).to_f64().value();
            let below = (whole(a) - fixed(low)).to_f64().value();
            assert!(above >= 0.0 && below >= 0.0, "{a:?}");
            let off = fixed(a.high.abs() * f64::EPSILON).to_f64().value();
            worst = worst.max(1.0 - above.min(below) / off);
        }
        assert!(worst > 0.125, "{worst}");
    }

    #[test]
    fn the_sign_of_doubt_is_none() {
        assert_eq!(Bounded::exact(0.0).sign(), Some(0));
        assert_eq!(Bounded::pair(1e-20, 0.0, 1e-19).sign(), None);
        assert_eq!(Bounded::pair(-1e-18, 0.0, 1e-19).sign(), Some(-1));
        assert_eq!((Bounded::exact(1.0) - Bounded::exact(1.0)).sign(), Some(0));
    }
}
