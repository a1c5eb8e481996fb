//! Distances on their way from exact numbers to f64: quotients that keep their own exponent, so
//! that no step on the way leaves the range of f64, whatever the exponents of a scene.

use dashu_int::{
    IBig,
    ops::{Abs, BitTest},
};

use super::field::sign_of;

/// Bound of the relative error of a [`Distance`] that [`super::decide::Pixel::measure`] gives.
pub const DISTANCE_ERROR: f64 = f64::from_bits((1023 - 40) << 52);

/// The least positive f64.
const LEAST: f64 = f64::from_bits(1);

/// `mantissa * 2^exponent`, with a mantissa of 0 or of a magnitude from 1 to 2.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distance {
    mantissa: f64,
    exponent: i64,
}

impl Distance {
    /// Exactly 0: the camera is on the surface.
    pub const ZERO: Self = Self { mantissa: 0.0, exponent: 0 };

    /// A finite number, exactly.
    pub fn exact(value: f64) -> Self {
        if value == 0.0 {
            return Self::ZERO;
        }
        // Subnormal numbers become normal first; a power of two rounds nothing here.
        let (value, lifted) =
            if value.is_normal() { (value, 0) } else { (value * two_to(100), 100) };
        let bits = value.to_bits();
        let mantissa = f64::from_bits(bits & !(0x7ff << 52) | 1023 << 52);
        Self { mantissa, exponent: (bits >> 52 & 0x7ff) as i64 - 1023 - lifted }
    }

    /// An integer of any size: its first 64 bits, cut off and rounded once. Within `2^-63 + 2^-53`
    /// of it, as a part of it.
    pub fn leading(value: &IBig) -> Self {
        let drop = value.bit_len().saturating_sub(64);
        let leading = (value.clone().abs() >> drop).to_f64().value();
        Self::exact(f64::from(sign_of(value)) * leading).times_two_to(drop as i64)
    }

    /// The quotient, rounded once: within `2^-53` of it, as a part of it. The divisor is not 0.
    pub fn over(self, divisor: Self) -> Self {
        // Of mantissas from 1 to 2: between 1/2 and 2, far from the ends of f64.
        Self::exact(self.mantissa / divisor.mantissa).times_two_to(self.exponent - divisor.exponent)
    }

    /// The product with a power of two, exactly.
    pub fn times_two_to(self, power: i64) -> Self {
        if self.mantissa == 0.0 { self } else { Self { exponent: self.exponent + power, ..self } }
    }

    /// The nearest f64: rounded once where that is subnormal, and not at all elsewhere; infinite
    /// from 2^1024 on.
    pub fn to_f64(self) -> f64 {
        match self.exponent {
            1024.. => self.mantissa * f64::INFINITY,
            -1022..1024 => self.mantissa * two_to(self.exponent),
            // The first product is normal and exact, so that the second rounds alone. Below 2^-1075
            // it gives 0.
            -1080..-1022 => self.mantissa * two_to(-1022) * two_to(self.exponent + 1022),
            _ => 0.0,
        }
    }

    /// Bounds of every number `x >= 0` of which this is within [`DISTANCE_ERROR`], as a part of
    /// `x`; of 0, which is exact, both are 0.
    ///
    /// With `E` for that error and `l` for the least positive f64, they are apart by at most
    /// `5 E x + 6 l`. The upper one is infinite only for `x` beyond all f64, or all but: lemma L3
    /// of docs/numerics.md.
    pub fn bounds(self) -> [f64; 2] {
        if self.mantissa == 0.0 {
            return [0.0; 2];
        }
        let value = self.to_f64();
        let low = value.min(f64::MAX) * (1.0 - 2.0 * DISTANCE_ERROR) - 2.0 * LEAST;
        [low.max(0.0), value * (1.0 + 2.0 * DISTANCE_ERROR) + 2.0 * LEAST]
    }
}

/// A power of two that is normal.
fn two_to(power: i64) -> f64 {
    f64::from_bits(((power + 1023) as u64) << 52)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::axes::integer;

    /// The exact number, times `2^4000`.
    fn whole(distance: Distance) -> IBig {
        let shift = distance.exponent + 4000;
        integer(distance.mantissa, -100) << shift as usize >> 100
    }

    fn random(state: &mut u64) -> u64 {
        *state = state.wrapping_mul(0x5851_f42d_4c95_7f2d).wrapping_add(0x1405_7b7e_f767_814f);
        *state ^ *state >> 31
    }

    #[test]
    fn f64_come_through_as_they_are() {
        for value in [1.0, 3.0, -0.1, 5e-324, 1.5e-310, f64::MIN_POSITIVE, f64::MAX, 0.0] {
            assert_eq!(Distance::exact(value).to_f64(), value);
        }
        let least = Distance::exact(LEAST);
        assert_eq!(least.times_two_to(-1).to_f64(), 0.0, "half of the least is even");
        assert_eq!(Distance::exact(3.0 * LEAST).times_two_to(-1).to_f64(), 2.0 * LEAST);
        assert_eq!(least.times_two_to(3000).to_f64(), f64::INFINITY);
        assert_eq!(least.times_two_to(-3000).to_f64(), 0.0);
        assert_eq!(Distance::exact(1.0).times_two_to(1023).to_f64(), two_to(1023));
        assert_eq!(Distance::exact(1.0).times_two_to(1024).to_f64(), f64::INFINITY);
    }

    /// Quotients of integers of very different lengths, either way, are within what is said.
    #[test]
    fn quotients_of_any_size() {
        let mut state = 3;
        let mut worst = 0.0f64;
        for round in 0..20_000 {
            let long = |state: &mut u64, bits: u64| -> IBig {
                let words = (0..1 + bits / 64)
                    .fold(IBig::ONE, |x, _| (x << 64) + IBig::from(random(state)));
                words >> (random(state) % 64) as usize
            };
            let lengths = [random(&mut state) % 3000, random(&mut state) % 3000];
            let [a, b] = lengths.map(|bits| long(&mut state, bits));
            let a = if round % 2 == 0 { a } else { -a };
            let quotient = Distance::leading(&a).over(Distance::leading(&b));
            // a / b and the quotient, times 2^4000 b.
            let off = whole(quotient) * &b - (&a << 4000);
            let part =
                Distance::leading(&off).over(Distance::leading(&(&a << 4000))).to_f64().abs();
            assert!(part <= 4.0 * (f64::EPSILON / 2.0), "{part:e}");
            worst = worst.max(part);
        }
        assert!(worst > f64::EPSILON / 4.0, "{worst:e}");
    }

    /// Bounds hold all that they stand for, at every exponent, and are as near as is said.
    #[test]
    fn bounds_hold_at_every_exponent() {
        let mut state = 5;
        let mut worst = [0.0f64; 2];
        for exponent in -1100..1030 {
            for _ in 0..8 {
                let mantissa = 1.0 + (random(&mut state) >> 12) as f64 / (1u64 << 52) as f64;
                let x = Distance { mantissa, exponent };
                for off in [-1.0, -0.5, 0.0, 0.5, 1.0] {
                    // Within the error of x, and exactly.
                    let near = Distance::exact(mantissa * (1.0 + off * DISTANCE_ERROR * 0.999))
                        .times_two_to(exponent);
                    let [low, high] = near.bounds();
                    let end = |end: f64| {
                        if end.is_finite() {
                            whole(Distance::exact(end))
                        } else {
                            IBig::ONE << 6000
                        }
                    };
                    assert!(
                        end(low) <= whole(x) && whole(x) <= end(high),
                        "{x:?}: {low:e} to {high:e}"
                    );
                    assert!(low.is_finite() && low >= 0.0);
                    if high < f64::INFINITY {
                        let value = x.to_f64();
                        assert!(
                            high - low <= 5.0 * DISTANCE_ERROR * value + 6.0 * LEAST,
                            "{x:?}: {low:e} to {high:e}"
                        );
                        // How much of the way to each end is taken.
                        worst[0] = worst[0]
                            .max((value - low) / (high - low))
                            .max((high - value) / (high - low));
                        if exponent < -1074 {
                            worst[1] = worst[1].max(high / LEAST);
                        }
                    } else {
                        assert!(exponent >= 1023 && low >= f64::MAX * (1.0 - 3.0 * DISTANCE_ERROR));
                    }
                }
            }
        }
        assert!(worst[0] > 0.7 && worst[1] >= 2.0, "{worst:?}");
        assert_eq!(Distance::ZERO.bounds(), [0.0; 2]);
    }
}
