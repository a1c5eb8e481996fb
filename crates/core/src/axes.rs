//! The camera's orthonormal axes, which are irrational in general.
//!
//! With the view direction `d` and `e = d x up`, `g = e x d`, the axes of the contract are
//!
//! ```text
//!     forward = -w = d / |d|        right = u = e / |e|        up' = v = g / (|d| |e|)
//! ```
//!
//! since `up x w = -(up x d) / |d|` and `w x u = (e x d) / (|d| |e|)`. Scaled by powers of two, `d`
//! and `up` are integer vectors, and so are `e` and `g`: the axes are integer vectors over the
//! square roots of `A = |d|^2`, `B = |e|^2` and `A B`. Nothing is lost; for the filters the axes
//! are also given as pairs of f64, good to 2^-100.

use dashu_int::{IBig, Sign, UBig, ops::BitTest, ops::SquareRoot};
use glam::DVec3;

/// Splits a finite number into `mantissa * 2^exponent` with a mantissa of at most 53 bits; zero
/// gives (0, `i32::MAX`).
pub fn split(value: f64) -> (i64, i32) {
    if value == 0.0 {
        return (0, i32::MAX);
    }
    let bits = value.to_bits();
    let biased = (bits >> 52 & 0x7ff) as i32;
    let fraction = (bits & ((1 << 52) - 1)) as i64;
    let (mantissa, exponent) =
        if biased == 0 { (fraction, -1074) } else { (fraction | 1 << 52, biased - 1075) };
    let zeros = mantissa.trailing_zeros();
    let magnitude = mantissa >> zeros;
    (if value < 0.0 { -magnitude } else { magnitude }, exponent + zeros as i32)
}

/// `value / 2^exponent`, which must be an integer.
pub fn integer(value: f64, exponent: i32) -> IBig {
    let (mantissa, own) = split(value);
    if mantissa == 0 {
        return IBig::ZERO;
    }
    assert!(own >= exponent, "the common exponent is the least one");
    IBig::from(mantissa) << (own - exponent) as usize
}

/// The least exponent of some numbers: divided by two to that, all are integers. All zero gives 0.
pub fn least_exponent(values: impl IntoIterator<Item = f64>) -> i32 {
    let least = values.into_iter().map(|v| split(v).1).min().unwrap_or(i32::MAX);
    if least == i32::MAX { 0 } else { least }
}

/// An integer vector.
pub type Vector = [IBig; 3];

/// Dot product.
pub fn dot(a: &Vector, b: &Vector) -> IBig {
    &a[0] * &b[0] + &a[1] * &b[1] + &a[2] * &b[2]
}

/// Cross product.
pub fn cross(a: &Vector, b: &Vector) -> Vector {
    [&a[1] * &b[2] - &a[2] * &b[1], &a[2] * &b[0] - &a[0] * &b[2], &a[0] * &b[1] - &a[1] * &b[0]]
}

/// A vector of f64 as integers, times some power of two.
fn direction(v: DVec3) -> Vector {
    let exponent = least_exponent(v.to_array());
    v.to_array().map(|c| integer(c, exponent))
}

/// Whether two vectors are parallel (or one is zero), exactly.
pub fn parallel(a: DVec3, b: DVec3) -> bool {
    cross(&direction(a), &direction(b)).iter().all(IBig::is_zero)
}

/// A unit vector as pairs of f64: `high[k] + low[k]` is within [`Axis::ERROR`] of the truth,
/// `high[k]` within half a unit in its last place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axis {
    /// Nearest f64 of each component.
    pub high: DVec3,
    /// What is left of each component.
    pub low: DVec3,
}

impl Axis {
    /// Bound of each component's error: lemma D7 of docs/numerics.md.
    pub const ERROR: f64 = f64::from_bits((1023 - 107) << 52);

    /// The nearest f64 of each component.
    pub fn nearest(self) -> DVec3 {
        self.high
    }

    /// `n / sqrt(square)`, component by component.
    fn new(n: &Vector, square: &IBig) -> Self {
        let square = UBig::try_from(square.clone()).expect("a square is not negative");
        let mut axis = Self { high: DVec3::ZERO, low: DVec3::ZERO };
        for k in 0..3 {
            let (sign, magnitude) = n[k].clone().into_parts();
            if magnitude.is_zero() {
                continue;
            }
            // The quotient gets at least 124 bits.
            let shift = (128 + square.bit_len() / 2).saturating_sub(magnitude.bit_len());
            let root = ((magnitude.sqr() << (2 * shift)) / &square).sqrt();
            let root = IBig::from_parts(sign, root);
            let high = root.to_f64().value();
            let rest = root - integer(high, 0);
            let low = rest.to_f64().value();
            axis.high[k] = scaled(high, -(shift as i32));
            axis.low[k] = scaled(low, -(shift as i32));
        }
        axis
    }
}

/// `value * 2^exponent`; rounded, perhaps twice, only where it becomes subnormal.
pub fn scaled(value: f64, exponent: i32) -> f64 {
    let power = |e: i32| f64::from_bits(((e + 1023) as u64) << 52);
    let (mut value, mut exponent) = (value, exponent);
    while exponent < -1022 && value != 0.0 {
        value *= power(-1022);
        exponent += 1022;
    }
    while exponent > 1023 && value.is_finite() {
        value *= power(1023);
        exponent -= 1023;
    }
    value * power(exponent.clamp(-1022, 1023))
}

/// The axes of a camera: exact as integers over square roots, and as pairs of f64.
#[derive(Clone, Debug)]
pub struct Axes {
    /// `d`, the view direction.
    pub d: Vector,
    /// `e = d x up`.
    pub e: Vector,
    /// `g = e x d`.
    pub g: Vector,
    /// `A = |d|^2`.
    pub a: IBig,
    /// `B = |e|^2`; `|g|^2 = A B`.
    pub b: IBig,
    /// `u`, to the right in the picture.
    pub right: Axis,
    /// `v`, up in the picture.
    pub up: Axis,
    /// `-w`, along the view direction.
    pub forward: Axis,
}

impl Axes {
    /// Of the view direction and the up of a checked camera.
    pub fn new(view: DVec3, up: DVec3) -> Self {
        let d = direction(view);
        let e = cross(&d, &direction(up));
        let g = cross(&e, &d);
        let (a, b) = (dot(&d, &d), dot(&e, &e));
        assert!(
            a.sign() == Sign::Positive && !b.is_zero(),
            "a checked camera has a view direction and an up"
        );
        let (right, up, forward) =
            (Axis::new(&e, &b), Axis::new(&g, &(&a * &b)), Axis::new(&d, &a));
        Self { d, e, g, a, b, right, up, forward }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn split_and_integer_give_the_number_back() {
        for value in [1.0, -0.1, 3.0e300, 5e-324, -1.5e-310, 0.0, f64::MAX] {
            let (mantissa, exponent) = split(value);
            if value != 0.0 {
                assert_eq!(scaled(mantissa as f64, exponent), value);
                assert_eq!(integer(value, exponent), IBig::from(mantissa));
            }
        }
    }

    #[test]
    fn axes_are_orthonormal_and_right_handed_at_every_scale() {
        for scale in [1.0, 1e-300, 1e300, 5e-324] {
            for (view, up) in [
                ([1.0, 0.0, 0.0], DVec3::Z),
                ([1.0, -2.0, 3.0], DVec3::Z),
                ([3.0, 4.0, 1.0], DVec3::Y),
            ] {
                let axes = Axes::new(DVec3::from_array(view) * scale, up);
                let [u, v, f] = [axes.right, axes.up, axes.forward].map(Axis::nearest);
                assert!((u.cross(v) + f).length() < 1e-15, "right x up = back");
                for (a, b, want) in
                    [(u, u, 1.0), (v, v, 1.0), (f, f, 1.0), (u, v, 0.0), (v, f, 0.0)]
                {
                    assert!((a.dot(b) - want).abs() < 1e-15);
                }
                assert!(v.dot(up) > 0.0 && f.dot(DVec3::from_array(view)) > 0.0);
            }
        }
    }

    /// Against roots with 300 more bits: within the bound, which is not eight times what is needed.
    #[test]
    fn the_low_part_carries_on_where_the_high_part_ends() {
        const PLACES: usize = 300;
        let mut worst = 0.0f64;
        let mut state = 1u64;
        let mut random = || {
            state = state.wrapping_mul(0x5851_f42d_4c95_7f2d).wrapping_add(0x1405_7b7e_f767_814f);
            (state >> 40) as f64 - 8_388_608.0
        };
        for _ in 0..2000 {
            let view = DVec3::new(random(), random(), random());
            let axes = Axes::new(view, DVec3::Z);
            for (axis, n, square) in [
                (axes.right, &axes.e, axes.b.clone()),
                (axes.up, &axes.g, &axes.a * &axes.b),
                (axes.forward, &axes.d, axes.a.clone()),
            ] {
                for k in 0..3 {
                    let root: UBig =
                        (((&n[k] * &n[k]) << (2 * PLACES)) / &square).into_parts().1.sqrt();
                    let exact = IBig::from_parts(n[k].sign(), root);
                    // A low part may have bits below 2^-300.
                    let pair = (integer(axis.high[k], -1000) + integer(axis.low[k], -1000))
                        >> (1000 - PLACES);
                    let off = (exact - pair).to_f64().value().abs() * 2f64.powi(-(PLACES as i32))
                        / Axis::ERROR;
                    assert!(off <= 1.0, "{off} of the bound at {view}");
                    assert!(axis.low[k].abs() <= axis.high[k].abs() * 2f64.powi(-53));
                    worst = worst.max(off);
                }
            }
        }
        println!("axes: {worst:.3} of the bound");
        assert!(worst > 0.125, "{worst}");
    }

    #[test]
    fn parallel_is_exact() {
        assert!(parallel(DVec3::new(0.1, 0.2, 0.3), DVec3::new(-0.2, -0.4, -0.6)));
        assert!(!parallel(DVec3::new(1.0, 0.0, 1e-300), DVec3::X));
        assert!(parallel(DVec3::X, DVec3::ZERO));
    }
}
