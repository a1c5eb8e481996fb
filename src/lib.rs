//! Pictures of spheres in which every pixel is exactly right, on every device.
//!
//! The way of a frame, top to bottom; each layer knows only those below it:
//!
//! * [`cli`], `view` (the window), [`mod@bench`]: what a person runs.
//! * [`render`]: a device draws a scene, the one entry for every caller. [`part`] merges pictures
//!   drawn in several places.
//! * [`cpu`] and [`gpu`]: two devices, one answer. The GPU executes what [`plan`] lays out, with
//!   variants of the shader from [`shader`].
//! * [`order`], [`cover`]: what can be skipped: groups of neighbours as a whole, and what large
//!   spheres hide.
//! * [`tile`]: the nearest sphere at every pixel of a tile. How the native device draws, and the
//!   other decides what is left over. [`pair`]: the order of two spheres that all but coincide.
//! * [`bins`], [`project`], [`filter`], [`simd`], [`pool`]: spheres into view space, tile lists,
//!   and one ray against one sphere, in f64 with bounds that are derived next to them; all lanes,
//!   all cores.
//! * [`exact`]: what the filters leave in doubt, decided without rounding.
//! * [`scene`], [`camera`], [`frame`], [`fov`]: plain data: what is drawn, from where, into which
//!   planes. [`framing`]: what a camera leaves out. [`unseen`]: why a picture is empty. [`memory`]:
//!   how much is left.
//!
//! [`load`], [`make`] and [`output`] read and write files; nothing else does. [`identity`] tells
//! whether two names are one file, [`litter`] what must not be left behind, [`text`] what is shown
//! of names and values.
//!
//! ```
//! use glam::DVec3;
//! use planisphere::{
//!     camera::{Camera, ImageSize, Region, View},
//!     render::{Device, DeviceChoice},
//!     scene::{Scene, Sphere},
//! };
//!
//! let ball = Sphere { center: DVec3::new(5.0, 2.0, 0.0), radius: 2.0, color: [217, 79, 61] };
//! let scene = Scene::from_spheres(&[ball])?;
//! let image = ImageSize { width: 64, height: 64 };
//! let view = View::new(Camera::orthographic(DVec3::ZERO, DVec3::X), image);
//! let drawing = Device::open(&DeviceChoice::Cpu)?.draw(&scene, &view, Region::whole(image))?;
//! assert_eq!(drawing.ids[32 * 64 + 19], 0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#[cfg(feature = "cli")]
pub mod cli;
#[cfg(feature = "cli")]
mod explain;

pub use planisphere_core::{
    axes, bins, camera, cover, cpu, depth, drawing, exact, filter, fov, framing, ids, order, pair,
    part, pool, project, projected, scene, simd, text, tile, unseen,
};
#[cfg(feature = "gpu")]
pub use planisphere_gpu as gpu;
pub use planisphere_image as image;
#[cfg(feature = "cli")]
pub use planisphere_io::{load, make, npy, output, png};
pub use planisphere_renderer as render;
#[cfg(feature = "window")]
pub use planisphere_window as view;
