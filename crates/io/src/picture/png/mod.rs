//! PNG of pixels: written row by row, and read back.

mod bands;
mod pack;
mod read;
mod write;

pub use self::read::{Decoded, Header, ReadError, header, read, read_deep, size};
pub(super) use self::write::Pixels;
