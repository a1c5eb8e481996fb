//! The library.
#![cfg_attr(not(feature = "cli"), forbid(unsafe_code))]

#[cfg(feature = "cli")]
#[doc(hidden)]
pub mod cli;

pub use planisphere_renderer::*;
