//! NumPy's array format (`.npy`), read and written.

pub(crate) mod read;
mod write;

pub use write::{Plane, header, record_header, write_f32, write_i32};
