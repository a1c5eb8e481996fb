//! PNG of pixels: written row by row, and read back.

mod bands;
mod pack;
mod read;
mod write;

pub use self::read::{Decoded, ReadError, read, read_deep};
pub(super) use self::write::{Pixels, encoder, write_texts};
