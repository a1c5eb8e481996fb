//! The truth: signs and orders decided without rounding.
//!
//! * [`dd`]: arithmetic of 100 bits with a certain bound; settles all but ties.
//! * [`small`]: the short cut for true ties with rational axes, in 128-bit integers.
//! * [`field`]: exact algebra with the square roots of the axes; settles everything.
//! * [`decide`]: hits and their order at one pixel, by the first that can tell.
//! * [`levels`]: what looks ask: how much a hit is turned to the eye, and how far it is.
//! * [`distance`]: how far a hit is, as f64 and as bounds, whatever the exponents.
//!
//! This layer knows scenes, cameras and their [`crate::axes`] as numbers, and nothing of devices.

pub mod dd;
pub mod decide;
pub mod distance;
pub mod field;
pub mod levels;
pub mod small;
