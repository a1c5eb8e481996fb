//! Pictures of spheres in which every pixel is exactly right.
pub mod camera;
pub mod exact;
pub mod gpu;
pub mod plan;
pub mod render;
pub mod scene;
pub mod shader;
