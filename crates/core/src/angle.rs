//! Angles in integers: pi, sine and cosine as intervals that hold the truth, and quotients rounded
//! once to the nearest f64. The same bits on every machine, whatever its libm.

use dashu_int::{IBig, UBig, ops::BitTest};

/// A real number between `low` and `high`, in units of `2^-bits`.
#[derive(Clone)]
pub(crate) struct Interval {
    pub low: IBig,
    pub high: IBig,
}

impl Interval {
    /// `mantissa * 2^exponent * pi / denominator`, which is below 4.
    pub fn of_pi(mantissa: i64, exponent: i32, denominator: u32, bits: usize) -> Self {
        let pi = pi(bits + 64);
        let scale = |pi: IBig| {
            let product = pi * mantissa;
            let product = if exponent >= 0 {
                product << exponent as usize
            } else {
                product >> -exponent as usize
            };
            (product / denominator) >> 64
        };
        // Three times rounded down, each by less than one unit.
        Self { low: scale(pi.low), high: scale(pi.high) + 3 }
    }

    /// Sine and cosine of an angle in (0, pi / 2), by their series about 0.
    pub fn sin_cos(&self, bits: usize) -> (Self, Self) {
        let one = IBig::ONE << bits;
        // The error of a Taylor series that alternates is below its first term left out.
        let series = |x: &IBig, first: IBig, from: u32| {
            let square = (x * x) >> bits;
            let (mut term, mut sum, mut k) = (first.clone(), first, from);
            let mut terms = 1u32;
            while !term.is_zero() {
                term = ((term * &square) >> bits) / (k * (k + 1));
                k += 2;
                sum = if terms % 2 == 1 { sum - &term } else { sum + &term };
                terms += 1;
            }
            // Each term is a product of rounded numbers in [0, 2): off by at most 4 units, the
            // terms after the last by 1.
            (sum, IBig::from(4 * terms + 1))
        };
        let interval = |(sum, error): (IBig, IBig)| Self { low: &sum - &error, high: sum + error };
        let (sin_low, sin_high) =
            (series(&self.low, self.low.clone(), 2), series(&self.high, self.high.clone(), 2));
        let (cos_low, cos_high) = (series(&self.low, one.clone(), 1), series(&self.high, one, 1));
        // Sine rises and cosine falls between 0 and pi / 2.
        let sin = Self { low: interval(sin_low).low, high: interval(sin_high).high };
        let cos = Self { low: interval(cos_high).low, high: interval(cos_low).high };
        (sin, cos)
    }
}

/// Pi, by Machin's formula: 16 atan(1/5) - 4 atan(1/239).
fn pi(bits: usize) -> Interval {
    let atan_inverse = |n: u32| {
        let mut power = (IBig::ONE << bits) / n;
        let (mut sum, mut k) = (IBig::ZERO, 0u32);
        while !power.is_zero() {
            let term = &power / (2 * k + 1);
            sum = if k % 2 == 0 { sum + term } else { sum - term };
            power /= n * n;
            k += 1;
        }
        // Each term is rounded down twice, and what is left out is below one unit.
        (sum, IBig::from(2 * k + 1))
    };
    let ((fifth, fifth_error), (other, other_error)) = (atan_inverse(5), atan_inverse(239));
    let middle = fifth * 16 - other * 4;
    let error = fifth_error * 16 + other_error * 4;
    Interval { low: &middle - &error, high: middle + error }
}

/// The f64 nearest to `numerator / denominator`, both positive (else 0, the end of an interval that
/// is still too wide); halfway cases to even.
pub(crate) fn round_quotient(numerator: &IBig, denominator: &IBig) -> f64 {
    let positive = |n: &IBig| UBig::try_from(n.clone()).ok().filter(|n| !n.is_zero());
    let (Some(numerator), Some(denominator)) = (positive(numerator), positive(denominator)) else {
        return 0.0;
    };
    // A shift that gives the quotient 54 to 56 bits, or fewer where f64 has fewer: multiples of
    // 2^-1075.
    let surplus = numerator.bit_len() as i64 - denominator.bit_len() as i64;
    let shift = (55 - surplus).min(1075);
    let (numerator, denominator) = if shift >= 0 {
        (numerator << shift as usize, denominator)
    } else {
        (numerator, denominator << -shift as usize)
    };
    let quotient = &numerator / &denominator;
    let rest = numerator - &quotient * denominator;
    let quotient = u64::try_from(quotient).expect("at most 56 bits");
    // At least one bit more than f64 keeps; a last bit that stands for the rest decides the halfway
    // cases.
    let sticky = quotient << 1 | u64::from(!rest.is_zero());
    round_scaled(sticky, -(shift as i32) - 1)
}

/// `n * 2^exponent` rounded once, to even, also where f64 gets coarser; `exponent >= -1076`, `n <
/// 2^57`.
fn round_scaled(n: u64, exponent: i32) -> f64 {
    let length = 64 - n.leading_zeros() as i32;
    // Bits to drop: to 53, or down to multiples of 2^-1074.
    let drop = (length - 53).max(-1074 - exponent).max(0);
    let (kept, dropped) = (n >> drop, n & ((1 << drop) - 1));
    let half = (1u64 << drop) >> 1;
    let up = dropped > half || (dropped == half && drop > 0 && kept & 1 == 1);
    crate::axes::scaled((kept + u64::from(up)) as f64, exponent + drop)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quotients_are_rounded_once_and_to_even() {
        let quotient = |a: u128, b: u128| round_quotient(&IBig::from(a), &IBig::from(b));
        for (a, b) in
            [(1, 3), (2, 3), (10, 1), (1, 10), (7, 1 << 70), ((1 << 53) + 1, 1), ((1 << 53) + 3, 2)]
        {
            assert_eq!(quotient(a, b), a as f64 / b as f64, "{a} / {b}");
        }
        // Just above halfway, by far less than the bits kept.
        let halfway = (IBig::from((1u64 << 53) + 1) << 200) + IBig::ONE;
        assert_eq!(round_quotient(&halfway, &(IBig::ONE << 200)), ((1u64 << 53) + 2) as f64);
        // 3/2 and 1/2 of the least subnormal: to even.
        assert_eq!(round_quotient(&IBig::from(3), &(IBig::ONE << 1075)), f64::from_bits(2));
        assert_eq!(round_quotient(&IBig::from(1), &(IBig::ONE << 1075)), 0.0);
        assert_eq!(round_quotient(&IBig::from(5), &(IBig::ONE << 1076)), f64::from_bits(1));
    }
}
