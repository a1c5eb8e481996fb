//! Pictures of spheres in which every pixel is exactly right.
pub mod camera;
pub mod exact;
pub mod fov;
pub mod frame;
pub mod load;
pub mod output;
pub mod render;
pub mod scene;
