//! Pictures of spheres in which every pixel is exactly right, on every device.
//!
//! A [`Scene`] holds checked spheres, a [`Camera`] says from where they are seen, a [`Request`] is
//! one picture of them, a [`Renderer`] draws it, and a [`Picture`] is what comes of it: colours,
//! the index of the sphere at every pixel, and its distance.
#![cfg_attr(
    feature = "files",
    doc = concat!("\n```no_run\n", include_str!("../examples/first.rs"), "```")
)]
//!
//! # What to know
//!
//! * **Exact.** At every pixel the nearest sphere is found, whatever the numbers: what
//!   floating point cannot tell is decided by exact arithmetic. All devices give the same bytes.
//! * **One renderer for the whole program.** It draws with `&self`, from any thread, any scene.
//!   What is derived from a scene is kept in the scene, and shared. [`Renderer`] tells what it does
//!   to its host.
//! * **To wait or not.** [`Renderer::draw`] blocks. [`Renderer::start`] gives a [`Job`]: a future
//!   of any runtime, with progress, that is cancelled when it is dropped.
//! * **Memory.** Pictures go into memory of yours ([`Renderer::draw_to`]), into a picture that is
//!   there ([`Renderer::draw_into`]), or band by band ([`Renderer::draw_bands`]). At most
//!   [`Renderer::in_flight`] pictures are drawn at a time, first come first served.
//! * **Errors** are of one type to match on, [`Error`], and name the fix.
//! * **Flat.** Spheres are discs of their colours, without light; [`Hit::normal`] and depths are
//!   there to shade with.
//! * Points and directions are anything that becomes `[f64; 3]`: the f64 vectors of any mathematics
//!   crate. No type of another crate is part of this one but behind its feature.
//!
//! # Features
//!
//! | feature | what it brings |
//! | --- | --- |
//! | `png` | [`Picture::write_png`], to any writer |
//! | `files` | [`Picture::save`]: whole files or none; brings `png`; with `parts` [`files`] |
//! | `read` | [`read`]: scene files and their arrays |
//! | `formats` | [`read`] takes files of particles, too: XYZ, LAMMPS, PDB ...; brings `read` |
//! | `overlay` | [`Overlay`]: title, legend, scale bar and axes over a picture |
//! | `parts` | [`Part`]: pictures of which each machine draws a part |
//! | `gpu` | GPUs by wgpu ([`Device`]), and devices of yours ([`Renderer::from_wgpu`]) |
//! | `cli`, `window`, `bench` | the program; on by default |
//!
//! For a library take `default-features = false`, and the features that you use. Without any 25
//! crates are built, this one's included; with `files` 42, and `gpu` brings wgpu.
//!
//! The crates below this one (`planisphere-core` and others) promise nothing to anybody else: what
//! is here is what stays.
#![cfg_attr(not(feature = "cli"), forbid(unsafe_code))]
#![warn(missing_debug_implementations)]

#[cfg(feature = "cli")]
#[doc(hidden)]
pub mod cli;

#[cfg(feature = "parts")]
#[doc(inline)]
pub use planisphere_renderer::Part;
#[cfg(feature = "gpu")]
pub use planisphere_renderer::wgpu;
#[doc(inline)]
pub use planisphere_renderer::{
    Camera, Device, Difference, Error, Hit, Job, Look, MAX_SIDE, Picture, Region, Renderer,
    Request, Scene, Sphere, Spheres,
};
#[cfg(feature = "read")]
#[doc(inline)]
pub use planisphere_renderer::{Document, read, start_read};
#[cfg(feature = "overlay")]
#[doc(inline)]
pub use planisphere_renderer::{Legend, Map, Overlay};
#[cfg(all(feature = "files", feature = "parts"))]
#[doc(inline)]
pub use planisphere_renderer::{Plan, files, report};
