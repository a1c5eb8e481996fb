//! Pictures of spheres in which every pixel is exactly right.
pub mod camera;
pub mod cli;
pub mod exact;
pub mod fov;
pub mod frame;
pub mod load;
pub mod make;
pub mod output;
pub mod render;
pub mod scene;
