//! NumPy's array format (`.npy`), read and written.

#[cfg(any(feature = "convert", feature = "parts"))]
pub(crate) mod archive;
#[cfg(feature = "read")]
pub(crate) mod array;
#[cfg(feature = "read")]
mod integers;
#[cfg(feature = "read")]
pub(crate) mod number;
#[cfg(any(feature = "parts", feature = "read"))]
pub(crate) mod read;
mod write;

#[cfg(any(feature = "convert", feature = "parts"))]
pub use archive::Archive;
#[cfg(feature = "read")]
pub use integers::{Integers, NotIntegers};
pub use write::{Plane, header, record_header, write_f32, write_i32};
