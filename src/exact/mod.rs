//! The truth: signs and orders decided without rounding.
//!
//! * [`axes`]: the camera's axes as integers and as pairs of f64.
pub mod axes;
