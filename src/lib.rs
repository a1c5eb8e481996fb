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
//! Features add to it: `png` writes pictures (as `png`), `read` reads scene files (`load`), `files`
//! writes files whole or not at all (`output`), `parts` reads and writes parts; each of these four
//! brings `npy`. With `gpu` there is the GPU device, with `window` the window as `view`, with `cli`
//! the program, and all that reads and writes. Without default features the library draws on the
//! CPU, and is built from 25 packages.
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
#[cfg(feature = "read")]
pub use planisphere_io::load;
#[cfg(feature = "cli")]
pub use planisphere_io::make;
#[cfg(any(feature = "files", feature = "parts", feature = "png", feature = "read"))]
pub use planisphere_io::npy;
#[cfg(feature = "files")]
pub use planisphere_io::output;
#[cfg(feature = "png")]
pub use planisphere_io::png;
pub use planisphere_renderer as render;
#[cfg(feature = "window")]
pub use planisphere_window as view;
