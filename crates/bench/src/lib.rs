//! Measurements: how fast pictures are drawn ([`speed`]), how right they are at what price
//! ([`accuracy`]), and how fast and how small they are written ([`png`]).
//!
//! This module makes scenes, runs devices and whole processes, compares with exact ids, and puts
//! the figures into tables; the command line prints them. The inexact kernels that pictures are
//! compared with live here and nowhere else.

#![cfg_attr(not(test), warn(clippy::print_stdout, clippy::print_stderr))]

pub mod accuracy;
pub mod methods;
pub mod modes;
pub mod naive;
pub mod plot;
pub mod png;
pub mod process;
pub mod reference;
pub mod scenes;
pub mod speed;
pub mod statistics;
pub mod table;

pub use planisphere_core::camera::{ImageSize, View};
