//! What binary64 arithmetic is off by, for all bounds.

/// Half a unit in the last place of 1.
pub const U: f64 = f64::EPSILON / 2.0;
/// Covers underflow in squares: what is smaller is in doubt.
pub const FLOOR: f64 = f64::from_bits((1023 - 960) << 52);
