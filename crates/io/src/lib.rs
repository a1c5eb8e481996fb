//! Files in and out: scenes and arrays become a [`planisphere_core::scene::Scene`], pictures and
//! planes become bytes, and bytes become whole files or none.
//!
//! This crate knows no device. A format has a module of its own, with both directions where both
//! are needed. Each is built where its feature is asked for; `npy` always is:
//!
//! | feature | modules | |
//! | --- | --- | --- |
//! | `png` | `png` | ids or colours become a PNG |
//! | `parts` | `part` | parts of pictures as bytes; with `read`, from files |
//! | `read` | `load`, `identity` | reads scene files and their arrays |
//! | `files` | `output`, `litter`, `identity` | writes files, and leaves nothing else behind |
//! | `make` | `make` | makes large scenes |

#![cfg_attr(not(test), warn(clippy::print_stdout, clippy::print_stderr))]
#![warn(missing_debug_implementations)]

/// Names and lines, with what is unseen in them shown.
pub use planisphere_core::text;

#[cfg(any(feature = "files", feature = "read"))]
pub mod identity;
#[cfg(feature = "files")]
pub mod litter;
#[cfg(feature = "read")]
pub mod load;
// Tests of other formats take random numbers from it.
#[cfg(any(feature = "make", test))]
pub mod make;
pub mod npy;
#[cfg(feature = "files")]
pub mod output;
#[cfg(feature = "parts")]
pub mod part;
#[cfg(feature = "particles")]
pub mod particles;
#[cfg(feature = "png")]
pub mod png;
