//! What the tests of planisphere are made with.
//!
//! * [`faults`]: faults that are planted into a copy of the sources, each of which a test must
//!   find.

pub mod faults;
pub mod instructions;
