//! PNG of pixels: read back.

mod read;

pub use self::read::{Decoded, ReadError, read, read_deep};
