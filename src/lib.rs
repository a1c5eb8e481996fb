//! Pictures of spheres in which every pixel is exactly right.
pub mod bench;
pub mod bins;
pub mod camera;
pub mod cli;
pub mod cpu;
pub mod exact;
pub mod fov;
pub mod frame;
pub mod load;
pub mod make;
pub mod output;
pub mod project;
pub mod render;
pub mod scene;
pub mod simd;
