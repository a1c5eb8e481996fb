//! The library: the types that `planisphere` passes on, and what draws behind them.
//!
//! * [`Renderer`] draws a [`Request`]; [`Job`] is one under way. `turns` lets few at a time.
//! * `engine`: an opened device, and why this one; `source`: what a renderer opened, and hands
//!   out to many pictures; `hybrid`: who draws what a GPU leaves.
//! * `files`: the way of a picture into files; `parts`: of which each machine draws one; `subject`
//!   is what both are of. `plan`: what a picture will take.
//! * `overlay`: what is drawn over a picture.
//! * `on_wgpu`: devices of the caller's.

#![cfg_attr(not(test), warn(clippy::print_stdout, clippy::print_stderr))]
#![forbid(unsafe_code)]
#![warn(missing_debug_implementations)]

#[cfg(all(feature = "files", feature = "parts"))]
mod about;
mod bands;
mod camera;
mod engine;
mod error;
#[cfg(all(feature = "files", feature = "parts"))]
pub mod files;
#[cfg(feature = "gpu")]
mod hybrid;
mod job;
#[cfg(feature = "gpu")]
mod on_wgpu;
mod openness;
#[cfg(feature = "overlay")]
mod overlay;
#[cfg(feature = "parts")]
mod parts;
mod picture;
mod pixels;
#[cfg(all(feature = "files", feature = "parts"))]
mod plan;
#[cfg(all(feature = "files", feature = "parts"))]
mod planes;
#[cfg(feature = "read")]
mod read;
mod renderer;
mod request;
mod scene;
mod source;
#[cfg(all(feature = "files", feature = "parts"))]
mod spent;
#[cfg(feature = "parts")]
mod subject;
mod turns;

pub use camera::Camera;
pub use engine::{Device, PassedOver};
#[doc(hidden)]
pub use engine::{DeviceError, Engine, Opened, host};
pub use error::Error;
#[cfg(feature = "gpu")]
#[doc(hidden)]
pub use hybrid::{Hybrid, REST};
pub use job::Job;
#[cfg(feature = "overlay")]
pub use overlay::{Legend, Map, Overlay};
#[cfg(feature = "parts")]
pub use parts::Part;
pub use picture::{Hit, Picture};
#[cfg(all(feature = "files", feature = "parts"))]
pub use plan::Plan;
pub use planisphere_core::camera::{MAX_SIDE, Region};
#[cfg(feature = "gpu")]
pub use planisphere_gpu::{adapters::adapters, wgpu};
pub use planisphere_image::compare::Difference;
#[doc(hidden)]
pub use planisphere_image::compare::{Pixels as Compared, compare, shown};
pub use planisphere_image::look::{Look, LookError};
#[cfg(all(feature = "overlay", feature = "read"))]
#[doc(hidden)]
pub use read::overlay;
#[cfg(feature = "read")]
pub use read::{Document, read, start_read};
pub use renderer::Renderer;
pub use request::Request;
pub use scene::{Scene, Sphere, Spheres};

/// What was done for a picture, in numbers.
pub mod report {
    pub use planisphere_core::drawing::{Counts, Times};
}
