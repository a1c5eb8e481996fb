//! What the tests of planisphere are made with.
//!
//! * [`faults`]: faults that are planted into a copy of the sources, each of which a test must
//!   find.
//! * [`instructions`]: what frames cost, counted.
//! * [`api`]: the public items of the library.

pub mod api;
pub mod faults;
pub mod instructions;
