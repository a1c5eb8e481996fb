//! Writes pixels as PNG: RGB or RGBA of 8 or 16 bits, never with a palette.
//!
//! Rows are filtered and compressed in bands, side by side, so that a picture of any size needs
//! little memory.

use std::{
    io::{self, Write},
    marker::PhantomData,
};

use super::bands::Filtered;
use crate::{
    picture::Rows,
    png::{About, Rows as Compressed, head},
};

/// Pixels of a band of rows. The bytes of files depend on it.
const BAND: usize = 1 << 16;

/// A PNG whose pixels come in rows.
#[derive(Debug)]
pub(in crate::picture) enum Pixels<W: Write> {
    Eight(Compressed<W, Filtered<u8>>),
    Sixteen(Compressed<W, Filtered<u16>>),
}

impl<W: Write> Pixels<W> {
    /// Begins a picture.
    pub fn new(out: W, about: &About) -> io::Result<Self> {
        let (size, alpha) = (about.size, about.alpha);
        let writer = head::begin(out, about)?;
        Ok(if about.depth16 {
            Self::Sixteen(Compressed::new(writer, size, Filtered { alpha, of: PhantomData }, BAND))
        } else {
            Self::Eight(Compressed::new(writer, size, Filtered { alpha, of: PhantomData }, BAND))
        })
    }

    /// Takes the next rows, which are of the picture's depth.
    pub fn push(&mut self, rows: Rows) -> io::Result<()> {
        match (self, rows) {
            (Self::Eight(to), Rows::Eight(pixels)) => to.take(pixels),
            (Self::Sixteen(to), Rows::Sixteen(pixels)) => to.take(pixels),
            (Self::Eight(_), Rows::Sixteen(_)) => Err(super::super::depth(false)),
            (Self::Sixteen(_), Rows::Eight(_)) => Err(super::super::depth(true)),
        }
    }

    /// Ends the file, after all of its rows.
    pub fn finish(self) -> io::Result<()> {
        match self {
            Self::Eight(to) => to.finish(),
            Self::Sixteen(to) => to.finish(),
        }
    }
}
