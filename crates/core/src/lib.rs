//! Which sphere is the nearest at each pixel, exactly: scene, camera, bounds, predicates, tile
//! lists, and the CPU that draws with them.
//!
//! This crate knows no file, no clock, no device and no printing, and builds for any target. The
//! layers, top to bottom; each knows only those below it:
//!
//! * [`cpu`]: the native device. [`part`]: pictures that were drawn in several places, and merging.
//!   [`depth`]: distances of ids. [`levels`]: what looks ask of hits. [`unseen`]: why a picture is
//!   empty.
//! * [`tile`]: the nearest sphere at every pixel of a tile. How the native device draws, and how
//!   the undecided pixels of another device are decided. [`pair`]: the order of two spheres that
//!   all but coincide.
//! * [`order`], [`cover`]: what can be skipped: clusters of neighbours, and what large spheres
//!   hide.
//! * [`bins`], [`project`], [`filter`], [`projected`], [`simd`], [`pool`]: spheres into view space,
//!   tile lists, and one ray against one sphere, in f64 with proved bounds; all lanes, all cores.
//! * [`exact`]: what the filters leave in doubt, decided without rounding.
//! * [`turn`]: a camera that turns. [`axes`]: the camera's axes as integers over square roots, and
//!   as pairs of f64.
//! * [`scene`], [`camera`], [`fov`], [`framing`], [`drawing`], [`ids`]: plain data: what is drawn,
//!   from where, what comes of it. [`text`]: how names and values from
//!   outside are shown. [`host`]: the clock and the memory that others hand in.

#![cfg_attr(not(test), warn(clippy::print_stdout, clippy::print_stderr))]

mod angle;
pub mod axes;
pub mod bins;
pub mod camera;
pub mod cover;
pub mod cpu;
pub mod depth;
pub mod drawing;
pub mod exact;
pub mod filter;
pub mod float;
pub mod fov;
pub mod framing;
pub mod host;
pub mod ids;
pub mod levels;
pub mod order;
pub mod pair;
pub mod part;
pub mod pool;
pub mod project;
pub mod projected;
pub mod scene;
pub mod simd;
pub mod text;
pub mod tile;
pub mod turn;
pub mod unseen;
