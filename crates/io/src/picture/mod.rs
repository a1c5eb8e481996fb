//! Pictures that are pixels, rather than ids of spheres: each format has a file of its own.

pub mod png;
mod sniff;
