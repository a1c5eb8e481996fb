//! Pictures that are pixels, rather than ids of spheres: each format has a file of its own.
//!
//! [`Encoder`] takes rows of pixels, whatever the format, and writes the same bytes however many
//! rows come at a time and on however many threads.

#[cfg(feature = "pictures")]
pub mod animation;
#[cfg(feature = "exr")]
pub mod exr;
#[cfg(feature = "pictures")]
mod jpeg;
mod kind;
pub mod png;
#[cfg(feature = "pictures")]
mod qoi;
mod sniff;
#[cfg(feature = "pictures")]
mod tiff;
#[cfg(feature = "pictures")]
mod webp;
#[cfg(feature = "pictures")]
mod whole;

use std::{
    fmt,
    io::{self, Write},
};

pub use self::kind::{Kind, UnknownEnding};
pub use crate::png::About;
use crate::png::invalid;

/// Whole rows of pixels: red, green, blue and straight alpha, in sRGB.
#[derive(Clone, Copy, Debug)]
pub enum Rows<'a> {
    /// Of 8 bits a channel.
    Eight(&'a [[u8; 4]]),
    /// Of 16 bits a channel.
    Sixteen(&'a [[u16; 4]]),
}

/// A picture whose pixels come in rows.
pub struct Encoder<W: Write>(Format<W>);

enum Format<W: Write> {
    Png(png::Pixels<W>),
    #[cfg(feature = "pictures")]
    Whole(whole::Whole<W>),
}

impl<W: Write> Encoder<W> {
    /// Begins a picture.
    ///
    /// # Errors
    /// The writer's; of the kind `InvalidInput` when the format cannot hold such a picture.
    pub fn new(out: W, kind: Kind, about: &About) -> io::Result<Self> {
        if about.size.contains(&0) {
            let [width, height] = about.size;
            return Err(invalid(format!("{width} x {height} pixels are no picture")));
        }
        kind.check(about)?;
        match kind {
            Kind::Png => png::Pixels::new(out, about).map(Format::Png).map(Self),
            Kind::Exr => Err(unwritten(kind)),
            #[cfg(feature = "pictures")]
            _ => whole::Whole::new(out, kind, about).map(Format::Whole).map(Self),
            #[cfg(not(feature = "pictures"))]
            _ => Err(unwritten(kind)),
        }
    }

    /// Takes the next rows.
    ///
    /// # Errors
    /// The writer's; of the kind `InvalidInput` when a row is not whole, has another depth than
    /// the picture, or is one more than the picture has.
    pub fn push(&mut self, rows: Rows) -> io::Result<()> {
        match &mut self.0 {
            Format::Png(to) => to.push(rows),
            #[cfg(feature = "pictures")]
            Format::Whole(to) => to.push(rows),
        }
    }

    /// Ends the file, after all of its rows.
    ///
    /// # Errors
    /// The writer's; of the kind `InvalidInput` when rows are missing.
    pub fn finish(self) -> io::Result<()> {
        match self.0 {
            Format::Png(to) => to.finish(),
            #[cfg(feature = "pictures")]
            Format::Whole(to) => to.finish(),
        }
    }
}

impl<W: Write> fmt::Debug for Encoder<W> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Encoder").finish_non_exhaustive()
    }
}

/// Rows of another depth than the picture has.
fn depth(depth16: bool) -> io::Error {
    let [is, comes] = if depth16 { [16, 8] } else { [8, 16] };
    invalid(format!("rows of {comes} bits a channel come for a picture of {is}"))
}

/// A format in which rows of colours are not written.
fn unwritten(kind: Kind) -> io::Error {
    let words = match kind {
        Kind::Exr => {
            "an OpenEXR picture holds planes of floats, not colours of 8 or 16 bits; write \
                      a .png, or these planes"
                .to_owned()
        }
        _ => format!("this build writes no {}; write a .png", kind.name()),
    };
    io::Error::new(io::ErrorKind::Unsupported, words)
}
