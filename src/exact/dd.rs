//! Numbers of 100 bits with a certain error: a pair of f64 and a bound.
//!
//! The pair arithmetic is that of Joldes, Muller and Popescu, "Tight and rigorous error bounds for basic building blocks of
//! double-word arithmetic" (ACM TOMS 44, 2017): addition (their algorithm 6) is within 3 u^2 and multiplication
//! (algorithm 12) within 5 u^2 of the exact result, u = 2^-53. Both are under `RELATIVE`; products that fall below
//! 2^-968 lose bits to underflow, which `ABSOLUTE` covers. The error travels along, rounded up.

use std::ops::{Add, Mul, Neg, Sub};

/// Bound of the relative error of one operation on pairs.
const RELATIVE: f64 = f64::from_bits((1023 - 100) << 52);
/// Bound of the absolute error of one operation that underflows.
const ABSOLUTE: f64 = f64::from_bits((1023 - 960) << 52);
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
        // One Newton step: the quotient of the high part, and what remains of the exact product divided again.
        let (product, product_low) = two_product(factor, value);
        let first = product / divisor;
        let (back, back_low) = two_product(first, divisor);
        let rest = ((product - back) - back_low) + product_low;
        let (high, low) = fast_two_sum(first, rest / divisor);
        Self { high, low, error: (high.abs() * (4.0 * RELATIVE) + ABSOLUTE) * UP }
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
        let off = (self.error + self.high.abs() * (2.0 * f64::EPSILON)) * UP;
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
            return Self { high: 0.0, low: 0.0, error: (self.high.abs() * f64::EPSILON + self.error).sqrt() * UP };
        }
        let root = self.high.sqrt();
        let (square, square_low) = two_product(root, root);
        let rest = ((self.high - square) - square_low) + self.low;
        let (high, low) = fast_two_sum(root, rest / (2.0 * root));
        // |sqrt x - sqrt y| is at most |x - y| / sqrt y and at most sqrt |x - y|.
        let carried = (self.error / root).min(self.error.sqrt()) * (1.0 + 4.0 * f64::EPSILON);
        // The Newton step leaves (rest / root)^2 / (8 root): below 2^-103 of the root.
        Self { high, low, error: (carried + 4.0 * RELATIVE * root + ABSOLUTE) * UP }
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
        Self { high, low, error: (self.error + other.error + RELATIVE * high.abs()) * UP }
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
        let carried = self.high.abs() * other.error + other.high.abs() * self.error + self.error * other.error;
        Self { high, low, error: (carried + RELATIVE * high.abs() + ABSOLUTE) * UP }
    }
}

#[cfg(test)]
mod tests {
    use dashu_int::IBig;

    use super::*;
    use crate::exact::axes::integer;

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

    /// Every operation contains the exact result of its exact operands, and its bound is not loose.
    #[test]
    fn the_bound_holds_against_integers() {
        let mut state = 7;
        for _ in 0..20_000 {
            let mut number = || {
                let bits = random(&mut state);
                let high = (bits >> 11) as f64 * 2f64.powi(-53 + (bits % 40) as i32 - 20);
                let high = if bits & 1 == 0 { high } else { -high };
                let low = high * 2f64.powi(-54) * ((random(&mut state) % 1000) as f64 / 1000.0);
                let (high, low) = two_sum(high, low);
                Bounded { high, low, error: 0.0 }
            };
            let (a, b) = (number(), number());
            let (fa, fb) = (fixed(a.high) + fixed(a.low), fixed(b.high) + fixed(b.low));
            let check = |result: Bounded, exact: IBig, shift: usize| {
                // Exact is given in units of 2^-(300 + shift).
                let got = (fixed(result.high) + fixed(result.low)) << shift;
                let off = (got - exact).to_f64().value().abs();
                let unit = 2f64.powi(-300) * 2f64.powi(-(shift as i32));
                assert!(off * unit <= result.error, "{a:?} {b:?} {result:?}");
                assert!(result.error <= result.high.abs() * 2f64.powi(-97) + 1e-250);
            };
            check(a + b, &fa + &fb, 0);
            check(a - b, &fa - &fb, 0);
            check(a * b, &fa * &fb, 300);
            let root = if a.high > 0.0 { a } else { -a }.sqrt();
            let square = root * root - if a.high > 0.0 { a } else { -a };
            assert!(square.high.abs() <= square.error && square.error < a.high.abs() * 1e-28);
        }
    }

    #[test]
    fn ratio_is_good_to_its_bound() {
        let mut state = 11;
        for _ in 0..20_000 {
            let factor = (random(&mut state) % 65536) as f64 - 32768.0;
            let divisor = (random(&mut state) % 65535 + 1) as f64;
            let value = (random(&mut state) >> 11) as f64 * 2f64.powi(-30);
            let ratio = Bounded::ratio(factor, value, divisor);
            let off = (fixed(ratio.high) + fixed(ratio.low)) * fixed(divisor) - fixed(factor) * fixed(value);
            let off = off.to_f64().value().abs() * 2f64.powi(-600) / divisor;
            assert!(off <= ratio.error, "{factor} {value} {divisor}");
        }
    }

    #[test]
    fn the_sign_of_doubt_is_none() {
        assert_eq!(Bounded::exact(0.0).sign(), Some(0));
        assert_eq!(Bounded::pair(1e-20, 0.0, 1e-19).sign(), None);
        assert_eq!(Bounded::pair(-1e-18, 0.0, 1e-19).sign(), Some(-1));
        assert_eq!((Bounded::exact(1.0) - Bounded::exact(1.0)).sign(), Some(0));
    }
}
