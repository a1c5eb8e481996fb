//! The library: a scene, a request, a renderer, a picture.
#![cfg_attr(not(test), warn(clippy::print_stdout, clippy::print_stderr))]
#![forbid(unsafe_code)]

mod camera;
mod engine;
mod error;
#[cfg(all(feature = "files", feature = "parts"))]
pub mod files;
#[cfg(feature = "gpu")]
mod hybrid;
mod job;
#[cfg(feature = "parts")]
mod parts;
mod picture;
#[cfg(all(feature = "files", feature = "parts"))]
mod plan;
#[cfg(feature = "read")]
mod read;
mod renderer;
mod request;
mod scene;
#[cfg(feature = "parts")]
mod subject;
mod turns;

pub use camera::Camera;
pub use engine::{Device, DeviceError, Engine, Opened, PassedOver, host};
pub use error::Error;
#[cfg(feature = "gpu")]
pub use hybrid::{Hybrid, REST};
pub use job::Job;
#[cfg(feature = "parts")]
pub use parts::Part;
pub use picture::{Difference, Hit, Picture};
#[cfg(all(feature = "files", feature = "parts"))]
pub use plan::Plan;
pub use planisphere_core::camera::{MAX_SIDE, Region};
#[cfg(feature = "gpu")]
pub use planisphere_gpu::adapters::adapters;
#[cfg(feature = "read")]
pub use read::{Document, read};
pub use renderer::Renderer;
pub use request::{Look, Request};
pub use scene::{Scene, Sphere, Spheres};

/// What was done for a picture, in numbers.
pub mod report {
    pub use planisphere_core::drawing::{Counts, Times};
}
