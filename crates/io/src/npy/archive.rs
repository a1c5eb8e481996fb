//! Writes NumPy archives (`.npz`): zip files of uncompressed arrays, the same bytes everywhere.

use std::{
    fmt,
    io::{self, Write},
};

use zip::{
    CompressionMethod, ZipWriter,
    write::{SimpleFileOptions, StreamWriter},
};

use super::header;

/// Bytes that are handed on at a time.
const CHUNK: usize = 1 << 18;

/// An archive on its way out, array by array.
pub struct Archive<W: Write> {
    zip: ZipWriter<StreamWriter<W>>,
    /// Each array begins at a multiple of so many bytes, so that it can be used where it lies.
    alignment: u16,
}

impl<W: Write> fmt::Debug for Archive<W> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Archive").field("alignment", &self.alignment).finish_non_exhaustive()
    }
}

impl<W: Write> Archive<W> {
    /// Begins it.
    pub fn new(out: W) -> Self {
        Self { zip: ZipWriter::new_stream(out), alignment: 0 }
    }

    /// Begins one whose arrays can be used where they lie.
    #[cfg(feature = "convert")]
    pub fn aligned(out: W) -> Self {
        Self { alignment: 64, ..Self::new(out) }
    }

    /// Begins an array: its header, and how many bytes its numbers have, which come next.
    ///
    /// # Errors
    /// The writer's.
    pub fn start(&mut self, name: &str, header: &[u8], bytes: usize) -> io::Result<()> {
        let large = bytes + header.len() > u32::MAX as usize;
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Stored)
            .with_alignment(self.alignment)
            .large_file(large);
        self.zip.start_file(format!("{name}.npy"), options)?;
        self.zip.write_all(header)
    }

    /// Takes bytes of the array that was begun.
    ///
    /// # Errors
    /// The writer's.
    pub fn write_all(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.zip.write_all(bytes)
    }

    /// Writes a whole array, whose items are given as their bytes.
    ///
    /// # Errors
    /// The writer's.
    pub fn array<const N: usize>(
        &mut self,
        name: &str,
        descr: &str,
        shape: &[usize],
        items: impl Iterator<Item = [u8; N]>,
    ) -> io::Result<()> {
        let size = descr[2..].parse::<usize>().unwrap_or(1) * shape.iter().product::<usize>();
        self.start(name, &header(descr, shape), size)?;
        let mut bytes = Vec::with_capacity(CHUNK + N);
        for item in items {
            bytes.extend(item);
            if bytes.len() >= CHUNK {
                self.write_all(&bytes)?;
                bytes.clear();
            }
        }
        self.write_all(&bytes)
    }

    /// Ends it.
    ///
    /// # Errors
    /// The writer's.
    pub fn finish(self) -> io::Result<()> {
        self.zip.finish().map(|_| ()).map_err(io::Error::from)
    }
}
