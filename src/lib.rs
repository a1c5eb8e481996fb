//! Pictures of spheres in which every pixel is exactly right.
pub mod bins;
pub mod camera;
pub mod cpu;
pub mod exact;
pub mod project;
pub mod render;
pub mod scene;
pub mod simd;
