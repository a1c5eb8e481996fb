//! The height of a perspective screen from its field of view, correctly rounded.
//!
//! `2 tan(fov / 2)` is worked out in integers, with an interval that holds the truth, until both
//! ends of the interval round to the same f64: the same bits on every machine, whatever its libm.

use crate::{
    angle::{Interval, round_quotient},
    axes::split,
    camera::CameraError,
};

/// The f64 nearest to `2 tan(degrees / 2)`, the height at distance 1 of a screen with this vertical
/// field of view. The f64 of `degrees` is taken as an exact number.
///
/// # Errors
/// When `degrees` is not greater than 0 and less than 180.
pub fn height_from_fov(degrees: f64) -> Result<f64, CameraError> {
    if !(degrees > 0.0 && degrees < 180.0) {
        return Err(CameraError::Fov(degrees));
    }
    // By Niven's theorem this is the only angle of a rational number of degrees with a rational
    // tangent: at every other one an interval that shrinks gets clear of the boundaries between
    // rounded numbers.
    if degrees == 90.0 {
        return Ok(2.0);
    }
    let (mantissa, exponent) = split(degrees);
    // Fixed point loses as many leading bits as the angle is small.
    let mut bits = 256 + usize::try_from(-exponent).unwrap_or(0);
    loop {
        let angle = Interval::of_pi(mantissa, exponent - 1, 180, bits);
        let (sin, cos) = angle.sin_cos(bits);
        let low = round_quotient(&(sin.low * 2u8), &cos.high);
        let high = round_quotient(&(sin.high * 2u8), &cos.low);
        if low == high {
            return Ok(low);
        }
        bits *= 2;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Worked out apart, to 420 decimals: pi by Gauss and Legendre, the tangent by doubling a small
    /// angle.
    #[test]
    fn heights_are_the_nearest_numbers() {
        let known: [(f64, u64); 18] = [
            (1e-320, 0x23),
            (1e-306, 0xc8cde35cb3d39),
            (1e-09, 0x3db330aa445be654),
            (0.1, 0x3f5c98717d802106),
            (1.0, 0x3f91df645e10066f),
            (29.999999999999996, 0x3fe126145e9ecd56),
            (30.0, 0x3fe126145e9ecd56),
            (40.0, 0x3fe74b49cf3902d4),
            (45.0, 0x3fea827999fcef32),
            (60.0, 0x3ff279a74590331c),
            (75.25, 0x3ff8aa62af2a357d),
            (89.99999999999999, 0x3ffffffffffffffe),
            (90.0, 0x4000000000000000),
            (90.00000000000001, 0x4000000000000001),
            (120.0, 0x400bb67ae8584caa),
            (135.0, 0x4013504f333f9de6),
            (179.0, 0x406ca5ac71978af1),
            (179.99999999999997, 0x433ca5dc1a63c1f8),
        ];
        for (degrees, bits) in known {
            let height = height_from_fov(degrees).unwrap();
            assert_eq!(
                height.to_bits(),
                bits,
                "{degrees} degrees: {height:?}, not {:?}",
                f64::from_bits(bits)
            );
        }
        assert_eq!(height_from_fov(5e-324), Ok(0.0));
        for none in [0.0, -1.0, 180.0, f64::INFINITY] {
            assert_eq!(height_from_fov(none), Err(CameraError::Fov(none)));
        }
        assert!(height_from_fov(f64::NAN).is_err());
    }
}
