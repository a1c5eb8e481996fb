//! Files in and out: scenes and arrays become a [`planisphere_core::scene::Scene`], pictures and
//! planes become bytes, and bytes become whole files or none.
//!
//! This crate knows no device. A format has a module of its own with both directions: [`npy`],
//! [`png`], [`part`]. [`load`] reads scene files, [`output`] writes files; [`identity`] tells
//! whether two names are one file, [`litter`] what must not be left behind. [`make`] makes large
//! scenes.

pub mod identity;
pub mod litter;
pub mod load;
pub mod make;
pub mod npy;
pub mod output;
pub mod part;
pub mod png;
