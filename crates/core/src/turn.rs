//! A camera that turns about a line: the same bits on every machine.
//!
//! Sine and cosine are the nearest f64, worked out in integers; all else is sums, products,
//! quotients and square roots of f64, which every machine rounds alike.

use dashu_int::IBig;
use glam::DVec3;

use crate::{
    angle::{Interval, round_quotient},
    axes::parallel,
    camera::Camera,
};

/// Sine and cosine of `part / of` of a whole turn, each the nearest f64. `of` is not 0.
///
/// ```
/// use planisphere_core::turn::sin_cos;
///
/// assert_eq!(sin_cos(1, 4), [1.0, 0.0]);
/// assert_eq!(sin_cos(1, 12), [0.5, 0.75f64.sqrt()]);
/// ```
#[must_use]
pub fn sin_cos(part: u32, of: u32) -> [f64; 2] {
    let (part, of) = (u64::from(part % of), u64::from(of));
    let (quarter, rest) = (4 * part / of, 4 * part % of);
    let [sin, cos] = within_quarter(rest, of);
    match quarter {
        0 => [sin, cos],
        1 => [cos, -sin],
        2 => [-sin, -cos],
        _ => [-cos, sin],
    }
}

/// Of `rest / of` of a quarter turn, which is less than one.
fn within_quarter(rest: u64, of: u64) -> [f64; 2] {
    if rest == 0 {
        return [0.0, 1.0];
    }
    // By Niven's theorem a third and two thirds are the only angles here with a sine or cosine that
    // is rational: at every other one an interval that shrinks gets clear of the boundaries between
    // rounded numbers.
    let exact = [(3 * rest == of).then_some(0.5), (3 * rest == 2 * of).then_some(0.5)];
    let mut bits = 256;
    loop {
        let angle = Interval::of_pi(rest as i64, -1, of as u32, bits);
        let (sin, cos) = angle.sin_cos(bits);
        let one = IBig::ONE << bits;
        let nearest = |of: &Interval| {
            let [low, high] = [&of.low, &of.high].map(|end| round_quotient(end, &one));
            (low == high).then_some(low)
        };
        let [sin_known, cos_known] = exact;
        if let (Some(sin), Some(cos)) =
            (sin_known.or_else(|| nearest(&sin)), cos_known.or_else(|| nearest(&cos)))
        {
            return [sin, cos];
        }
        bits *= 2;
    }
}

/// A camera turned by `part / of` of a whole turn about the line through `about` along `axis`: a
/// vector of any length but zero, from whose tip the camera is seen to go counterclockwise. Screen
/// and clip distances stay. Numbers may leave the range of f64: [`Camera::check`] finds it.
#[must_use]
pub fn turned(camera: Camera, about: DVec3, axis: DVec3, part: u32, of: u32) -> Camera {
    let [sin, cos] = sin_cos(part, of);
    if [sin, cos] == [0.0, 1.0] {
        return camera;
    }
    let axis = (axis / axis.abs().max_element()).normalize();
    let turned = |vector: DVec3| {
        // What lies along the axis stays; of an axis of the world that is exact.
        let along = vector.dot(axis) * axis;
        // The last sum turns -0 into 0.
        along + cos * (vector - along) + sin * axis.cross(vector) + DVec3::ZERO
    };
    // Squares of extreme numbers leave the range of f64.
    let direction = |vector: DVec3| turned(vector / vector.abs().max_element());
    Camera {
        origin: about + turned(camera.origin - about),
        view: direction(camera.view),
        up: if parallel(camera.up, axis) { camera.up } else { direction(camera.up) },
        ..camera
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::axes::split;

    /// `2^scale * value` as an integer.
    fn scaled(value: f64, scale: usize) -> IBig {
        let (mantissa, exponent) = split(value);
        if mantissa == 0 {
            return IBig::ZERO;
        }
        IBig::from(mantissa) << (scale as i32 + exponent) as usize
    }

    /// The product of two complex numbers in units of `2^-bits`.
    fn product([a, b]: &[IBig; 2], [c, d]: &[IBig; 2], bits: usize) -> [IBig; 2] {
        [(a * c - b * d) >> bits, (a * d + b * c) >> bits]
    }

    /// The unit root of `of` parts, found apart from the series: Newton's way to the root of
    /// `z^of = 1` near the f64.
    fn root(of: u32, bits: usize) -> [IBig; 2] {
        let [sin, cos] = sin_cos(1, of);
        let mut z = [scaled(cos, bits), scaled(sin, bits)];
        for _ in 0..5 {
            let mut power = [IBig::ONE << bits, IBig::ZERO];
            let mut square = z.clone();
            let mut left = of;
            while left > 0 {
                if left & 1 == 1 {
                    power = product(&power, &square, bits);
                }
                square = product(&square, &square, bits);
                left >>= 1;
            }
            // z (1 - (z^of - 1) / of): the error is squared each time.
            let step =
                [(IBig::ONE << bits) - (&power[0] - (IBig::ONE << bits)) / of, -&power[1] / of];
            z = product(&z, &step, bits);
        }
        z
    }

    #[test]
    fn sine_and_cosine_are_the_nearest_numbers() {
        const BITS: usize = 400;
        let mut worst = 0.0f64;
        for of in [5, 7, 12, 24, 30, 97, 120, 360, 1000, 4321] {
            let unit = root(of, BITS);
            let mut z = [IBig::ONE << BITS, IBig::ZERO];
            for part in 0..of {
                let [sin, cos] = sin_cos(part, of);
                for (value, truth) in [(cos, &z[0]), (sin, &z[1])] {
                    let off = scaled(value, BITS) - truth;
                    let place = (value.abs().to_bits() + 1, value.abs());
                    let ulp = f64::from_bits(place.0) - place.1;
                    let off = (off >> (BITS - 300)).to_f64().value() * 2f64.powi(-300) / ulp;
                    // The truth of what is 0 is 0 to 2^-380.
                    if value != 0.0 {
                        worst = worst.max(off.abs());
                        assert!(off.abs() <= 0.5 + 1e-9, "{part} of {of}: {off} ulp");
                    }
                }
                z = product(&z, &unit, BITS);
            }
        }
        assert!(worst > 0.45, "{worst} ulp: nothing was compared");
    }

    #[test]
    fn what_is_rational_is_exact() {
        assert_eq!([0, 1, 2, 3, 4].map(|part| sin_cos(part, 4)[0]), [0.0, 1.0, 0.0, -1.0, 0.0]);
        assert_eq!([0, 1, 2, 3, 4].map(|part| sin_cos(part, 4)[1]), [1.0, 0.0, -1.0, 0.0, 1.0]);
        assert_eq!([1, 2, 4, 5].map(|part| sin_cos(part, 6)[1]), [0.5, -0.5, -0.5, 0.5]);
        assert_eq!([1, 5, 7, 11].map(|part| sin_cos(part, 12)[0]), [0.5, 0.5, -0.5, -0.5]);
        let [sin, cos] = sin_cos(u32::MAX - 1, u32::MAX);
        assert!(sin < 0.0 && sin > -1.5e-9 && cos == 1.0, "{sin} {cos}");
        assert_eq!(sin_cos(0, 1), [0.0, 1.0]);
    }

    #[test]
    fn a_quarter_about_an_axis_is_exact() {
        let camera = Camera {
            origin: DVec3::new(3.0, 1.0, 0.3),
            view: DVec3::new(-2.0, -1.0, 0.5),
            ..Camera::orthographic(DVec3::ZERO, DVec3::X)
        };
        let about = DVec3::new(1.0, 0.0, 0.0);
        let found = turned(camera, about, DVec3::Z, 1, 4);
        assert_eq!(found.origin, DVec3::new(0.0, 2.0, 0.3));
        assert_eq!((found.view, found.up), (DVec3::new(0.5, -1.0, 0.25), DVec3::Z));
        let about_x = turned(camera, about, DVec3::X, 3, 4);
        assert_eq!((about_x.origin, about_x.up), (DVec3::new(3.0, 0.3, -1.0), DVec3::Y));
        assert_eq!(turned(camera, about, DVec3::Z, 0, 7), camera);
        assert_eq!(turned(camera, about, DVec3::Z, 7, 7), camera);
    }

    #[test]
    fn distances_stay_about_any_line() {
        let camera = Camera {
            origin: DVec3::new(10.0, -4.0, 7.0),
            up: DVec3::new(1.0, 2.0, 3.0),
            ..Camera::orthographic(DVec3::ZERO, DVec3::new(-1.0, 0.25, -0.5))
        };
        let about = DVec3::new(0.5, 0.25, -1.0);
        for axis in [camera.up, DVec3::new(1e-300, 2e-300, -1e-300), DVec3::Y] {
            for part in 0..11 {
                let found = turned(camera, about, axis, part, 11);
                assert_eq!(found.check(), Ok(()));
                let far = |camera: &Camera| (camera.origin - about).length();
                assert!((far(&found) - far(&camera)).abs() < 1e-14 * far(&camera));
                let cos = |camera: &Camera| {
                    (camera.origin - about).normalize().dot(camera.view.normalize())
                };
                assert!((cos(&found) - cos(&camera)).abs() < 1e-14);
            }
        }
        let whole = turned(camera, about, camera.up, 3, 11);
        assert_eq!(whole.up, camera.up);
    }
}
