//! Parts of pictures as NumPy archives (`.npz`), read and written; what a part is tells
//! [`planisphere_core::part`]. Bytes suffice for both; with the feature `read`, files are mapped.

#[cfg(feature = "read")]
mod files;
mod read;
mod write;

#[cfg(feature = "read")]
pub use files::{part, parts};
pub use read::{PartError, PartProblem, read};
pub use write::PartWriter;
