//! Pictures of spheres in which every pixel is exactly right, on every device.
//!
//! This is the face of a workspace; `docs/architecture.md` has the map. It passes on:
//!
//! * [`render`]: a device draws a scene, the one entry for every caller.
//! * [`scene`], [`camera`], [`drawing`]: what is drawn, from where, and what comes of it.
//!   [`framing`]: what a camera leaves out. [`unseen`]: why a picture is empty.
//! * [`depth`]: distances of ids. [`image`]: their colours. [`part`]: pictures in parts, and
//!   merging.
//! * the rest of `planisphere-core`, for tests and for those who draw in other ways.
//!
//! With the feature `cli` (the program) there are also `load`, `make`, `npy`, `png` and `output`,
//! which read and write files, with `gpu` the GPU device, and with `window` the window as `view`.
//! Without default features the library draws on the CPU, and no clap, wgpu or winit is built.
//!
//! ```
//! use glam::DVec3;
//! use planisphere::{
//!     camera::{Camera, ImageSize, Region, View},
//!     render::{Engine, Device},
//!     scene::{Scene, Sphere},
//! };
//!
//! let ball = Sphere { center: DVec3::new(5.0, 2.0, 0.0), radius: 2.0, color: [217, 79, 61] };
//! let scene = Scene::from_spheres(&[ball])?;
//! let image = ImageSize { width: 64, height: 64 };
//! let view = View::new(Camera::orthographic(DVec3::ZERO, DVec3::X), image);
//! let drawing = Engine::open(&Device::Cpu)?.draw(&scene, &view, Region::whole(image))?;
//! assert_eq!(drawing.ids[32 * 64 + 19], 0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#[cfg(feature = "cli")]
pub mod cli;
#[cfg(feature = "cli")]
mod explain;

pub use planisphere_core::{
    axes, bins, camera, cover, cpu, depth, drawing, exact, filter, fov, framing, host, ids, order,
    pair, part, pool, project, projected, scene, simd, text, tile, unseen,
};
#[cfg(feature = "gpu")]
pub use planisphere_gpu as gpu;
pub use planisphere_image as image;
#[cfg(feature = "cli")]
pub use planisphere_io::{load, make, npy, output, png};
pub use planisphere_renderer as render;
#[cfg(feature = "window")]
pub use planisphere_window as view;
