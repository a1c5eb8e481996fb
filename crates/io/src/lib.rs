//! Files in and out: scenes and arrays become a [`planisphere_core::scene::Scene`], pictures and
//! planes become bytes, and bytes become whole files or none.
//!
//! This crate knows no device. A format has a module of its own, with both directions where both
//! are needed: [`npy`], [`png`], [`part`]. [`load`] reads scene files, [`output`] writes files;
//! [`identity`] tells whether two names are one file, [`litter`] what must not be left behind.
//! [`make`] makes large scenes.

#![cfg_attr(not(test), warn(clippy::print_stdout, clippy::print_stderr))]

pub mod identity;
pub mod litter;
pub mod load;
pub mod make;
pub mod npy;
pub mod output;
pub mod part;
pub mod png;
