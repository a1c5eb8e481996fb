//! The library.
#![cfg_attr(not(test), warn(clippy::print_stdout, clippy::print_stderr))]

mod engine;
#[cfg(feature = "gpu")]
mod hybrid;

pub use engine::{Device, DeviceError, Engine, Opened, PassedOver, host};
#[cfg(feature = "gpu")]
pub use hybrid::{Hybrid, REST};
