//! Pictures from files, whoever has written them.

mod read;

pub use read::{Golden, ReadError, png_size, read_png};
