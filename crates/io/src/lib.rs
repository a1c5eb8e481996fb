//! Files in and out: scenes and arrays become a [`planisphere_core::scene::Scene`], pictures and
//! planes become bytes, and bytes become whole files or none.
//!
//! This crate knows no device. A format has a module of its own, with both directions where both
//! are needed. Each is built where its feature is asked for; `npy` always is:
//!
//! | feature | modules | |
//! | --- | --- | --- |
//! | `png` | `png` | ids or colours become a PNG |
//! | `png` | `camera` | a camera becomes the text that a picture holds |
//! | `png` | `picture` | pixels become a PNG, and come back from one |
//! | `pictures` | | pixels become JPEG, WebP, QOI and TIFF, and animations: GIF and APNG |
//! | `exr` | `picture::exr` | planes of floats and ids become OpenEXR |
//! | `parts` | `part` | parts of pictures as bytes; with `read`, from files |
//! | `read` | `load`, `identity` | reads scene files and their arrays |
//! | `particles` | `particles` | what files of particles share; each format is a feature more |
//! | `formats` | | all of these, and `compressed`: gzip, zstd, xz and bzip2 are unpacked |
//! | `convert` | `particles::write` | spheres and columns become files of other programs |
//! | `files` | `output`, `litter`, `identity` | writes files, and leaves nothing else behind |
//! | `make` | `make` | makes large scenes |

#![cfg_attr(not(test), warn(clippy::print_stdout, clippy::print_stderr))]
#![warn(missing_debug_implementations)]

/// Names and lines, with what is unseen in them shown.
pub use planisphere_core::text;

#[cfg(feature = "png")]
pub mod camera;
#[cfg(feature = "read")]
mod colors;
#[cfg(any(feature = "files", feature = "read"))]
pub mod identity;
#[cfg(feature = "read")]
#[cfg_attr(
    not(feature = "formats"),
    allow(dead_code, reason = "each format uses a part of what they share")
)]
mod input;
#[cfg(feature = "read")]
#[cfg_attr(
    not(feature = "particles"),
    allow(dead_code, reason = "files of particles alone have one")
)]
pub mod legend;
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
#[cfg_attr(
    not(feature = "formats"),
    allow(dead_code, reason = "each format uses a part of what they share")
)]
pub mod particles;
#[cfg(feature = "png")]
pub mod picture;
#[cfg(feature = "png")]
pub mod png;
#[cfg(feature = "read")]
mod zeros;
#[cfg(feature = "png")]
mod zlib;
