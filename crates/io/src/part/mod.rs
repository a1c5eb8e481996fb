//! Parts of pictures as NumPy archives (`.npz`), read and written; what a part is tells
//! [`planisphere_core::part`].

mod read;
mod write;

pub use read::{part, parts};
pub use write::PartWriter;
