//! Writes the colour plane as PNG: a palette where at most 256 colours occur, RGB otherwise, never alpha.
//!
//! Rows are coloured and encoded band by band, so that an image of any size needs little memory beyond its ids. The
//! settings were chosen by measuring ten kinds of filter and compression on 1024 x 1024 pictures, from a few large
//! spheres to a million of one pixel:
//!
//! | picture | chosen | ms | KB | level 6 there | KB |
//! | --- | --- | --- | --- | --- | --- |
//! | palette, 12 large spheres | filter Up, fdeflate | 0.1 | 14 | 2.3 | 10 |
//! | palette, 1e5 spheres of 8 px | filter Up, fdeflate | 2.4 | 341 | 72 | 310 |
//! | RGB, 1e5 spheres of 8 px | no filter, level 1 | 13 | 800 | 46 | 586 |
//! | RGB, 1e6 spheres of 1.4 px | no filter, level 1 | 25 | 2477 | 173 | 2428 |
//!
//! fdeflate writes literals at more than 8 bits each, so that busy palette pictures take level 1 as well.

use std::io::{self, Write};

use png::{BitDepth, ColorType, DeflateCompression, Encoder, EncodingError, Filter, StreamWriter, Writer};
use rayon::prelude::*;

use super::{Paint, PlaneError};
use crate::camera::Region;

/// Pixels that are coloured at a time.
const BAND: usize = 1 << 20;

/// Bytes of an image data chunk.
const CHUNK: usize = 1 << 18;

/// Writes the picture of a region's ids.
///
/// # Errors
/// The writer's; of the kind `InvalidInput` when the ids are not those of this region and scene.
pub fn write_png(out: &mut dyn Write, region: Region, ids: &[i32], paint: &Paint) -> io::Result<()> {
    if ids.len() != region.pixels() {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, PlaneError::Length { ids: ids.len(), region }));
    }
    checked(paint, ids)?;
    let width = region.width as usize;
    let palette = Palette::of(ids, paint);
    let mut encoder = Encoder::new(out, region.width, region.height);
    encoder.set_deflate_compression(DeflateCompression::Level(1));
    encoder.set_filter(Filter::NoFilter);
    let bits = match &palette {
        Some(palette) => {
            let (bits, depth) = palette.depth();
            encoder.set_color(ColorType::Indexed);
            encoder.set_depth(depth);
            encoder.set_palette(palette.bytes());
            if !palette.busy {
                encoder.set_deflate_compression(DeflateCompression::FdeflateUltraFast);
                encoder.set_filter(Filter::Up);
            }
            bits
        }
        None => {
            encoder.set_color(ColorType::Rgb);
            encoder.set_depth(BitDepth::Eight);
            24
        }
    };
    let mut writer = encoder.write_header().map_err(into_io)?;
    let mut stream = writer.stream_writer_with_size(CHUNK).map_err(into_io)?;
    let row_bytes = (width * bits).div_ceil(8);
    let band_rows = (BAND / width).max(1);
    let mut bytes = vec![0; row_bytes * band_rows.min(region.height as usize)];
    for ids in ids.chunks(band_rows * width) {
        let rows = &mut bytes[..ids.len() / width * row_bytes];
        rows.par_chunks_mut(row_bytes).zip(ids.par_chunks(width)).for_each(|(row, ids)| match &palette {
            Some(palette) => palette.fill(row, ids, paint, bits),
            None => paint.fill(row, ids),
        });
        stream.write_all(rows)?;
    }
    stream.finish().map_err(into_io)?;
    writer.finish().map_err(into_io)
}

/// A picture that comes in rows, some at a time: RGB, as the colours of what is still to come are not known.
pub struct PngFile<W: Write> {
    writer: Writer<W>,
    width: usize,
}

impl<W: Write> PngFile<W> {
    /// Begins the picture of a region.
    ///
    /// # Errors
    /// The writer's.
    pub fn new(out: W, region: Region) -> io::Result<Self> {
        let mut encoder = Encoder::new(out, region.width, region.height);
        encoder.set_deflate_compression(DeflateCompression::Level(1));
        encoder.set_filter(Filter::NoFilter);
        encoder.set_color(ColorType::Rgb);
        encoder.set_depth(BitDepth::Eight);
        Ok(Self { writer: encoder.write_header().map_err(into_io)?, width: region.width as usize })
    }

    /// Begins the rows.
    ///
    /// # Errors
    /// The writer's.
    pub fn rows<'a>(&'a mut self, paint: Paint<'a>) -> io::Result<PngRows<'a, W>> {
        let stream = self.writer.stream_writer_with_size(CHUNK).map_err(into_io)?;
        Ok(PngRows { stream, paint, width: self.width, bytes: Vec::new() })
    }

    /// Ends the file, after its rows.
    ///
    /// # Errors
    /// The writer's.
    pub fn finish(self) -> io::Result<()> {
        self.writer.finish().map_err(into_io)
    }
}

/// The rows of a picture, from the top.
pub struct PngRows<'a, W: Write> {
    stream: StreamWriter<'a, W>,
    paint: Paint<'a>,
    width: usize,
    bytes: Vec<u8>,
}

impl<W: Write> PngRows<'_, W> {
    /// Takes the ids of the next rows.
    ///
    /// # Errors
    /// The writer's; of the kind `InvalidInput` when an id is none of the scene's spheres.
    pub fn push(&mut self, ids: &[i32]) -> io::Result<()> {
        checked(&self.paint, ids)?;
        let band = (BAND / self.width).max(1) * self.width;
        for ids in ids.chunks(band) {
            self.bytes.resize(3 * ids.len(), 0);
            self.bytes.par_chunks_mut(3 * self.width).zip(ids.par_chunks(self.width)).for_each(|(row, ids)| {
                self.paint.fill(row, ids);
            });
            self.stream.write_all(&self.bytes)?;
        }
        Ok(())
    }

    /// Ends the rows.
    ///
    /// # Errors
    /// The writer's, or when rows are missing.
    pub fn finish(self) -> io::Result<()> {
        self.stream.finish().map_err(into_io)
    }
}

/// Ids of the scene, or an error of a writer.
fn checked(paint: &Paint, ids: &[i32]) -> io::Result<()> {
    paint.check(ids).map_err(|error| io::Error::new(io::ErrorKind::InvalidInput, error))
}

/// The writer's own errors as they are.
fn into_io(error: EncodingError) -> io::Error {
    match error {
        EncodingError::IoError(error) => error,
        other => io::Error::other(other),
    }
}

impl Paint<'_> {
    /// Fills a row with colours, three bytes a pixel.
    fn fill(&self, row: &mut [u8], ids: &[i32]) {
        let row = row.as_chunks_mut::<3>().0;
        self.runs(ids).for_each(|(run, color)| row[run].fill(color));
    }
}

/// At most 256 colours, in order.
struct Palette {
    colors: Vec<[u8; 3]>,
    /// Whether neighbours differ often.
    busy: bool,
}

impl Palette {
    /// The colours of a picture, unless there are too many.
    fn of(ids: &[i32], paint: &Paint) -> Option<Self> {
        let part = |ids: &[i32]| {
            let (mut colors, mut changes, mut last) = (Vec::with_capacity(257), 0usize, None);
            for (_, color) in paint.runs(ids) {
                if last != Some(color) {
                    last = Some(color);
                    changes += 1;
                    if let Err(at) = colors.binary_search(&color) {
                        colors.insert(at, color);
                    }
                    if colors.len() > 256 {
                        return None;
                    }
                }
            }
            Some((colors, changes))
        };
        let merge = |(mut a, n): (Vec<[u8; 3]>, usize), (b, m): (Vec<[u8; 3]>, usize)| {
            a.extend(b);
            a.sort_unstable();
            a.dedup();
            (a.len() <= 256).then_some((a, n + m))
        };
        let (colors, changes) = ids.par_chunks(1 << 16).map(part).try_reduce(|| (Vec::new(), 0), merge)?;
        Some(Self { colors, busy: changes > ids.len() / 4 })
    }

    /// Bits of an index.
    fn depth(&self) -> (usize, BitDepth) {
        match self.colors.len() {
            0..=2 => (1, BitDepth::One),
            3..=4 => (2, BitDepth::Two),
            5..=16 => (4, BitDepth::Four),
            _ => (8, BitDepth::Eight),
        }
    }

    fn bytes(&self) -> Vec<u8> {
        self.colors.concat()
    }

    /// Packs a row of indices, the first pixel in the highest bits.
    fn fill(&self, row: &mut [u8], ids: &[i32], paint: &Paint, bits: usize) {
        row.fill(0);
        let per_byte = 8 / bits;
        for (run, color) in paint.runs(ids) {
            let index = self.colors.binary_search(&color).expect("the palette holds every colour") as u8;
            // Whole bytes, and the pixels before and after them.
            let whole = run.start.div_ceil(per_byte)..run.end / per_byte;
            let before = run.start..run.end.min(whole.start * per_byte);
            let after = before.end.max(whole.end * per_byte)..run.end;
            if !whole.is_empty() {
                row[whole].fill((0..per_byte).fold(0u32, |byte, _| byte << bits | u32::from(index)) as u8);
            }
            for at in before.chain(after) {
                row[at / per_byte] |= index << (8 - bits - bits * (at % per_byte));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::scene::{Scene, Sphere};

    fn scene(colors: usize) -> Scene {
        let color = |k: usize| [(k / 256) as u8, (k % 256) as u8, 77];
        let spheres: Vec<_> =
            (0..colors).map(|k| Sphere { center: DVec3::ZERO, radius: 1.0, color: color(k) }).collect();
        Scene::from_spheres(&spheres).unwrap()
    }

    #[test]
    fn pictures_come_back_at_every_depth() {
        for (spheres, depth) in [(1, 1), (3, 2), (15, 4), (255, 8), (256, 24), (3000, 24)] {
            let scene = scene(spheres);
            let paint = Paint { scene: &scene, background: [200, 100, 50] };
            for (width, height) in [(1, 1), (1, 40), (13, 7), (1500, 1024)] {
                let region = Region { x: 5, y: 6, width, height };
                for run in [1, 50] {
                    let ids: Vec<i32> = (0..region.pixels()).map(|k| (k / run % (spheres + 1)) as i32 - 1).collect();
                    let mut bytes = Vec::new();
                    write_png(&mut bytes, region, &ids, &paint).unwrap();
                    let decoder = png::Decoder::new(io::Cursor::new(&bytes));
                    let info = decoder.read_info().unwrap();
                    let header = info.info();
                    if ids.len() > 2 * spheres * run {
                        assert_eq!(header.bits_per_pixel(), depth, "{spheres} spheres");
                    }
                    let image = image::load_from_memory(&bytes).unwrap().into_rgb8();
                    assert_eq!((image.width(), image.height()), (width, height));
                    assert!(image.pixels().zip(&ids).all(|(pixel, &id)| Some(pixel.0) == paint.color(id)));
                }
            }
        }
    }

    #[test]
    fn rows_are_the_picture() {
        let scene = scene(300);
        let paint = Paint { scene: &scene, background: [200, 100, 50] };
        let region = Region { x: 0, y: 0, width: 31, height: 40 };
        let ids: Vec<i32> = (0..region.pixels()).map(|k| (k % 301) as i32 - 1).collect();
        let (mut whole, mut bytes) = (Vec::new(), Vec::new());
        write_png(&mut whole, region, &ids, &paint).unwrap();
        let mut file = PngFile::new(&mut bytes, region).unwrap();
        let mut rows = file.rows(paint).unwrap();
        ids.chunks(31 * 7).for_each(|ids| rows.push(ids).unwrap());
        rows.finish().unwrap();
        file.finish().unwrap();
        assert_eq!(bytes, whole);
    }

    #[test]
    fn foreign_ids_are_refused() {
        let scene = scene(2);
        let paint = Paint { scene: &scene, background: [0; 3] };
        let region = Region { x: 0, y: 0, width: 2, height: 2 };
        for ids in [&[0, 1, -1, 2][..], &[0, 1, -1], &[0; 5]] {
            let error = write_png(&mut Vec::new(), region, ids, &paint).unwrap_err();
            assert_eq!(error.kind(), io::ErrorKind::InvalidInput, "{error}");
        }
        let mut file = PngFile::new(Vec::new(), region).unwrap();
        let error = file.rows(paint).unwrap().push(&[0, 2]).unwrap_err();
        assert!(error.to_string().contains("id 2"), "{error}");
    }

    #[test]
    fn the_writers_error_keeps_its_kind() {
        struct Closed;
        impl Write for Closed {
            fn write(&mut self, _: &[u8]) -> io::Result<usize> {
                Err(io::ErrorKind::BrokenPipe.into())
            }
            fn flush(&mut self) -> io::Result<()> {
                Ok(())
            }
        }
        let scene = scene(1);
        let region = Region { x: 0, y: 0, width: 3, height: 3 };
        let paint = Paint { scene: &scene, background: [0; 3] };
        let error = write_png(&mut Closed, region, &[0; 9], &paint).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::BrokenPipe);
    }
}
