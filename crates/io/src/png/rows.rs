//! Compresses rows in bands, side by side, and writes them as the data of a PNG.

use std::{
    fmt,
    io::{self, Write},
};

use png::{EncodingError, Writer, chunk::IDAT};
use rayon::prelude::*;

use crate::zlib::{Adler, HEADER, LAST};

/// Bands that are compressed before they are written.
const BANDS: usize = 256;

/// Bytes of an image data chunk, about.
pub(super) const CHUNK: usize = 1 << 18;

/// Most bytes of a chunk: it holds no more than 2^31 - 1.
const MOST: usize = 1 << 30;

/// How rows are compressed.
pub(crate) trait Bands: Sync {
    /// What rows consist of.
    type Pixel: Copy + Sync;

    /// Some rows as one band, below another row or none, and the checksum of what is compressed.
    fn compress(
        &self,
        above: &[Self::Pixel],
        rows: &[Self::Pixel],
        width: usize,
    ) -> (Vec<u8>, Adler);
}

/// The data of a picture, whose pixels come in rows.
pub(crate) struct Rows<W: Write, B: Bands> {
    writer: Writer<W>,
    pub(crate) bands: B,
    width: usize,
    /// Pixels of a band, which is whole rows.
    band: usize,
    /// Rows that are still to come.
    missing: usize,
    /// The last row that was compressed; empty before the first.
    above: Vec<B::Pixel>,
    /// Rows after it that make no band yet.
    held: Vec<B::Pixel>,
    /// What is to be written.
    bytes: Vec<u8>,
    adler: Adler,
}

impl<W: Write, B: Bands> Rows<W, B> {
    /// Begins the data, in bands of so many pixels, or of one row. The bytes depend on that number,
    /// but neither on the threads nor on how many rows are taken at a time.
    pub(crate) fn new(
        writer: Writer<W>,
        [width, height]: [u32; 2],
        bands: B,
        pixels: usize,
    ) -> Self {
        let width = width as usize;
        Self {
            writer,
            bands,
            width,
            band: (pixels / width).max(1) * width,
            missing: height as usize,
            above: Vec::new(),
            held: Vec::new(),
            bytes: HEADER.into(),
            adler: Adler::new(),
        }
    }

    /// Takes the next rows.
    pub(crate) fn take(&mut self, mut pixels: &[B::Pixel]) -> io::Result<()> {
        let (count, width, band) = (pixels.len(), self.width, self.band);
        if !count.is_multiple_of(width) {
            return Err(invalid(format!("{count} pixels are no whole rows of {width}")));
        }
        let rows = count / width;
        let Some(missing) = self.missing.checked_sub(rows) else {
            return Err(invalid(format!("{rows} rows come where {} are missing", self.missing)));
        };
        self.missing = missing;
        if !self.held.is_empty() {
            let (now, later) = pixels.split_at(count.min(band - self.held.len()));
            self.held.extend_from_slice(now);
            pixels = later;
            if self.held.len() < band && self.missing > 0 {
                return Ok(());
            }
            let held = std::mem::take(&mut self.held);
            self.compress(&held)?;
        }
        // Only the last band of a picture may be shorter.
        let whole = if self.missing == 0 { pixels.len() } else { pixels.len() / band * band };
        self.compress(&pixels[..whole])?;
        self.held.extend_from_slice(&pixels[whole..]);
        Ok(())
    }

    /// Compresses bands, side by side, and writes them.
    fn compress(&mut self, pixels: &[B::Pixel]) -> io::Result<()> {
        let (width, band) = (self.width, self.band);
        for pixels in pixels.chunks(BANDS * band) {
            let (above, compressor) = (&self.above, &self.bands);
            let bands = pixels.par_chunks(band).enumerate().map(|(k, rows)| {
                let before =
                    if k == 0 { above.as_slice() } else { &pixels[k * band - width..k * band] };
                compressor.compress(before, rows, width)
            });
            for (bytes, adler) in bands.collect::<Vec<_>>() {
                self.adler = self.adler.then(adler);
                self.bytes.extend(bytes);
                if self.bytes.len() >= CHUNK {
                    self.write()?;
                }
            }
            self.above.clear();
            self.above.extend_from_slice(&pixels[pixels.len() - width..]);
        }
        Ok(())
    }

    /// Writes a chunk, or several where one would be too long.
    fn write(&mut self) -> io::Result<()> {
        for data in self.bytes.chunks(MOST) {
            self.writer.write_chunk(IDAT, data).map_err(into_io)?;
        }
        self.bytes.clear();
        Ok(())
    }

    /// Ends the file, after all of its rows.
    pub(crate) fn finish(mut self) -> io::Result<()> {
        if self.missing > 0 {
            return Err(invalid(format!("{} rows are missing", self.missing)));
        }
        self.bytes.extend(LAST);
        self.bytes.extend(self.adler.bytes());
        self.write()?;
        self.writer.finish().map_err(into_io)
    }
}

impl<W: Write, B: Bands> fmt::Debug for Rows<W, B> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { width, missing, .. } = self;
        f.debug_struct("Rows")
            .field("width", width)
            .field("missing", missing)
            .finish_non_exhaustive()
    }
}

/// What is wrong with what is given, as an error of a writer.
pub(crate) fn invalid(error: impl Into<Box<dyn std::error::Error + Send + Sync>>) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidInput, error)
}

/// The writer's own errors as they are.
pub(crate) fn into_io(error: EncodingError) -> io::Error {
    match error {
        EncodingError::IoError(error) => error,
        other => io::Error::other(other),
    }
}
