//! Writes the colour plane as PNG: RGB, or with a palette where that is asked for; never alpha.
//!
//! RGB is what every reader takes for the picture: some programs read the indices of a palette as
//! if they were it. Rows are coloured and compressed in bands, side by side, so that a picture of
//! any size needs little memory beyond its ids. The compressor is our own (`deflate.rs`): it is
//! given runs, and so it is about as fast on three bytes a pixel as general ones are on one, and
//! its files are about as small as theirs with a palette. `benches/results/png.txt` has the
//! numbers.

mod deflate;
mod rows;

use std::{
    fmt,
    io::{self, Write},
    ops::Range,
};

use png::{BitDepth, ColorType, DeflateCompression, Encoder, Filter};
use rayon::prelude::*;

pub(crate) use self::rows::{Bands, Rows, into_io, invalid};
use self::{
    deflate::{Band, Run},
    rows::CHUNK,
};
use crate::zlib::Adler;
use planisphere_core::{
    camera::{MAX_SIDE, Region},
    depth::PlaneError,
};
use planisphere_image::Paint;

/// Pixels of a band of rows. The bytes of files depend on it, and on nothing else here.
const BAND: usize = 1 << 16;

/// Pixels of a picture with a palette that are packed at a time.
const PACKED: usize = 1 << 20;

/// Why a picture has no palette.
#[derive(Debug, thiserror::Error)]
pub enum PaletteError {
    /// It has more colours than a palette holds.
    #[error("the picture has more than 256 colours, and a palette holds no more")]
    TooManyColors,
    /// The writer's own error.
    #[error("{0}")]
    Io(#[from] io::Error),
}

/// Writes the picture of a region's ids, as RGB.
///
/// # Errors
/// The writer's; of the kind `InvalidInput` when the ids are not those of this region and scene.
pub fn write_png(
    out: &mut dyn Write,
    region: Region,
    ids: &[i32],
    paint: &Paint,
) -> io::Result<()> {
    checked(paint, region, ids)?;
    let mut rows = PngRows::new(out, region, *paint)?.0;
    rows.take(ids)?;
    rows.finish()
}

/// Writes a picture of colours, as RGB: sRGB, row by row, of at most [`MAX_SIDE`] pixels a side.
/// The file has the same bytes as [`write_png`]'s of ids that have these colours.
///
/// # Errors
/// The writer's; of the kind `InvalidInput` when a side is 0 or too long, or there are not
/// `width * height` pixels.
pub fn write_rgb(
    out: &mut dyn Write,
    [width, height]: [u32; 2],
    pixels: &[[u8; 3]],
) -> io::Result<()> {
    let sides = [width, height].iter().all(|side| (1..=MAX_SIDE).contains(side));
    if !sides || pixels.len() as u64 != u64::from(width) * u64::from(height) {
        let words = format!("{} pixels are no picture of {width} x {height}", pixels.len());
        return Err(invalid(words));
    }
    let mut rows = begin(out, [width, height], Rgb)?;
    rows.take(pixels)?;
    rows.finish()
}

/// A picture that comes in rows, some at a time, as RGB: the same file as [`write_png`]'s.
pub struct PngRows<'a, W: Write>(Rows<W, Runs<Paint<'a>>>);

impl<'a, W: Write> PngRows<'a, W> {
    /// Begins the picture of a region.
    ///
    /// # Errors
    /// The writer's.
    pub fn new(out: W, region: Region, paint: Paint<'a>) -> io::Result<Self> {
        begin(out, [region.width, region.height], paint).map(Self)
    }

    /// Takes the ids of the next rows.
    ///
    /// # Errors
    /// The writer's; of the kind `InvalidInput` when an id is none of the scene's spheres,
    /// a row is not whole, or there are more rows than the region has.
    pub fn push(&mut self, ids: &[i32]) -> io::Result<()> {
        self.0.bands.0.check(ids).map_err(invalid)?;
        self.0.take(ids)
    }

    /// Ends the file, after all of its rows.
    ///
    /// # Errors
    /// The writer's; of the kind `InvalidInput` when rows are missing.
    pub fn finish(self) -> io::Result<()> {
        self.0.finish()
    }
}

impl<W: Write> fmt::Debug for PngRows<'_, W> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("PngRows").field(&self.0).finish()
    }
}

/// What pixels are given as.
trait Source: Copy + Sync {
    /// One of them.
    type Pixel: Copy + Sync;

    /// Places and colours of pixels side by side that are alike; neighbours may have one colour.
    fn runs(&self, row: &[Self::Pixel]) -> impl Iterator<Item = (Range<usize>, [u8; 3])>;
}

/// Ids, which are known to be the scene's.
impl Source for Paint<'_> {
    type Pixel = i32;

    fn runs(&self, row: &[i32]) -> impl Iterator<Item = (Range<usize>, [u8; 3])> {
        Paint::runs(self, row)
    }
}

/// Colours.
#[derive(Clone, Copy)]
struct Rgb;

impl Source for Rgb {
    type Pixel = [u8; 3];

    fn runs(&self, row: &[[u8; 3]]) -> impl Iterator<Item = (Range<usize>, [u8; 3])> {
        let mut start = 0;
        row.chunk_by(|a, b| a == b).map(move |alike| {
            let run = start..start + alike.len();
            start = run.end;
            (run, alike[0])
        })
    }
}

/// Colours with a fourth value that is none of theirs.
#[derive(Clone, Copy)]
struct Opaque;

impl Source for Opaque {
    type Pixel = [u8; 4];

    fn runs(&self, row: &[[u8; 4]]) -> impl Iterator<Item = (Range<usize>, [u8; 3])> {
        let mut start = 0;
        row.chunk_by(|[a @ .., _], [b @ .., _]| a == b).map(move |alike| {
            let run = start..start + alike.len();
            start = run.end;
            let [color @ .., _] = alike[0];
            (run, color)
        })
    }
}

/// Some rows of colours as one band of runs, without the fourth values. It refers to nothing before
/// it, so that any other band may lie there.
pub(crate) fn as_runs(rows: &[[u8; 4]], width: usize) -> (Vec<u8>, Adler) {
    Runs(Opaque).compress(&[], rows, width)
}

/// Pixels as runs of one colour.
struct Runs<S>(S);

impl<S: Source> Bands for Runs<S> {
    type Pixel = S::Pixel;

    fn compress(&self, above: &[S::Pixel], rows: &[S::Pixel], width: usize) -> (Vec<u8>, Adler) {
        let mut band = Band::new(width, colored(&self.0, above, Vec::new()));
        let mut runs = Vec::new();
        for row in rows.chunks_exact(width) {
            runs = band.row(colored(&self.0, row, runs));
        }
        band.finish()
    }
}

/// Begins a picture as RGB.
fn begin<W: Write, S: Source>(
    out: W,
    [width, height]: [u32; 2],
    source: S,
) -> io::Result<Rows<W, Runs<S>>> {
    let mut encoder = Encoder::new(out, width, height);
    encoder.set_color(ColorType::Rgb);
    encoder.set_depth(BitDepth::Eight);
    let writer = encoder.write_header().map_err(into_io)?;
    Ok(Rows::new(writer, [width, height], Runs(source), BAND))
}

/// Writes the picture of a region's ids, as indices of a palette.
///
/// # Errors
/// When there are too many colours, before anything is written; and the writer's, of the
/// kind `InvalidInput` when the ids are not those of this region and scene.
pub fn write_palette_png(
    out: &mut dyn Write,
    region: Region,
    ids: &[i32],
    paint: &Paint,
) -> Result<(), PaletteError> {
    checked(paint, region, ids)?;
    let palette = Palette::of(ids, paint).ok_or(PaletteError::TooManyColors)?;
    let width = region.width as usize;
    let (bits, depth) = palette.depth();
    let mut encoder = Encoder::new(out, region.width, region.height);
    encoder.set_color(ColorType::Indexed);
    encoder.set_depth(depth);
    encoder.set_palette(palette.bytes());
    if palette.busy {
        // fdeflate would write most bytes as literals of more than 8 bits.
        encoder.set_deflate_compression(DeflateCompression::Level(1));
        encoder.set_filter(Filter::NoFilter);
    } else {
        encoder.set_deflate_compression(DeflateCompression::FdeflateUltraFast);
        encoder.set_filter(Filter::Up);
    }
    let mut writer = encoder.write_header().map_err(into_io)?;
    let mut stream = writer.stream_writer_with_size(CHUNK).map_err(into_io)?;
    let row_bytes = (width * bits).div_ceil(8);
    let band_rows = (PACKED / width).max(1);
    let mut bytes = vec![0; row_bytes * band_rows.min(region.height as usize)];
    for ids in ids.chunks(band_rows * width) {
        let rows = &mut bytes[..ids.len() / width * row_bytes];
        rows.par_chunks_mut(row_bytes)
            .zip(ids.par_chunks(width))
            .for_each(|(row, ids)| palette.fill(row, ids, paint, bits));
        stream.write_all(rows)?;
    }
    stream.finish().map_err(into_io)?;
    writer.finish().map_err(into_io)?;
    Ok(())
}

/// Refuses ids that are not one of the scene for each pixel.
fn checked(paint: &Paint, region: Region, ids: &[i32]) -> io::Result<()> {
    if ids.len() != region.pixels() {
        return Err(invalid(PlaneError::Length { ids: ids.len(), region }));
    }
    paint.check(ids).map_err(invalid)
}

/// The runs of one colour, in memory that is there.
fn colored<S: Source>(source: &S, row: &[S::Pixel], mut colored: Vec<Run>) -> Vec<Run> {
    colored.clear();
    for (run, [red, green, blue]) in source.runs(row) {
        let (end, color) = (run.end as u32, u32::from_be_bytes([0, red, green, blue]));
        match colored.last_mut() {
            Some(last) if last.color == color => last.end = end,
            _ => colored.push(Run { end, color }),
        }
    }
    colored
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
        let (colors, changes) =
            ids.par_chunks(1 << 16).map(part).try_reduce(|| (Vec::new(), 0), merge)?;
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
            let index =
                self.colors.binary_search(&color).expect("the palette holds every colour") as u8;
            // Whole bytes, and the pixels before and after them.
            let whole = run.start.div_ceil(per_byte)..run.end / per_byte;
            let before = run.start..run.end.min(whole.start * per_byte);
            let after = before.end.max(whole.end * per_byte)..run.end;
            if !whole.is_empty() {
                let byte = (0..per_byte).fold(0u32, |byte, _| byte << bits | u32::from(index));
                row[whole].fill(byte as u8);
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
    use planisphere_core::scene::{Scene, Sphere};

    fn scene(colors: usize) -> Scene {
        let color = |k: usize| [(k / 256) as u8, (k % 256) as u8, 77];
        let spheres: Vec<_> = (0..colors)
            .map(|k| Sphere { center: DVec3::ZERO, radius: 1.0, color: color(k) })
            .collect();
        Scene::from_spheres(&spheres).unwrap()
    }

    /// What a decoder that is not ours makes of a file, and the bits of its pixels.
    fn decoded(bytes: &[u8]) -> (image::RgbImage, usize) {
        let info = png::Decoder::new(io::Cursor::new(bytes)).read_info().unwrap();
        let bits = info.info().bits_per_pixel();
        (image::load_from_memory(bytes).unwrap().into_rgb8(), bits)
    }

    #[test]
    fn pictures_come_back() {
        for (spheres, depth) in [(1, 1), (3, 2), (15, 4), (255, 8), (256, 24), (3000, 24)] {
            let scene = scene(spheres);
            let paint = Paint { scene: &scene, background: [200, 100, 50] };
            for (width, height) in [(1, 1), (1, 40), (13, 7), (1500, 100), (11_000, 9), (32_768, 3)]
            {
                let region = Region { x: 5, y: 6, width, height };
                for run in [1, 50] {
                    let ids: Vec<i32> = (0..region.pixels())
                        .map(|k| (k / run % (spheres + 1)) as i32 - 1)
                        .collect();
                    let mut rgb = Vec::new();
                    write_png(&mut rgb, region, &ids, &paint).unwrap();
                    let mut files = vec![rgb];
                    let mut indexed = Vec::new();
                    match write_palette_png(&mut indexed, region, &ids, &paint) {
                        Ok(()) => files.push(indexed),
                        Err(error) => {
                            assert!(matches!(error, PaletteError::TooManyColors), "{error}");
                            assert!(indexed.is_empty() && spheres >= 256, "{spheres} spheres");
                        }
                    }
                    for (bytes, want) in files.iter().zip([24, depth]) {
                        let (image, bits) = decoded(bytes);
                        if ids.len() > 2 * spheres * run {
                            assert_eq!(bits, want, "{spheres} spheres");
                        }
                        assert_eq!((image.width(), image.height()), (width, height));
                        assert!(
                            image
                                .pixels()
                                .zip(&ids)
                                .all(|(pixel, &id)| Some(pixel.0) == paint.color(id))
                        );
                    }
                    // A second one, which has another inflater.
                    let mut rows = Vec::new();
                    let idat = chunks(&files[0], *b"IDAT");
                    io::Read::read_to_end(
                        &mut flate2::read::ZlibDecoder::new(idat.as_slice()),
                        &mut rows,
                    )
                    .unwrap();
                    let rows = rows.chunks_exact(3 * width as usize + 1);
                    assert_eq!(rows.len(), height as usize);
                    assert!(rows.zip(ids.chunks_exact(width as usize)).all(|(row, ids)| {
                        row[0] == 0
                            && row[1..]
                                .as_chunks::<3>()
                                .0
                                .iter()
                                .zip(ids)
                                .all(|(p, &id)| Some(*p) == paint.color(id))
                    }));
                }
            }
        }
    }

    /// The data of all chunks of a name, joined.
    fn chunks(mut file: &[u8], name: [u8; 4]) -> Vec<u8> {
        let mut all = Vec::new();
        file = &file[8..];
        while let Some((length, rest)) = file.split_first_chunk::<4>() {
            let length = u32::from_be_bytes(*length) as usize;
            if rest[..4] == name {
                all.extend_from_slice(&rest[4..4 + length]);
            }
            file = &rest[length + 8..];
        }
        all
    }

    /// Pictures of every mixture of runs that a seed makes: long and short, new and repeated, as
    /// above and beside.
    #[test]
    fn random_pictures_come_back() {
        let scene = scene(3000);
        let paint = Paint { scene: &scene, background: [200, 100, 50] };
        for seed in 0..300u64 {
            let random = crate::make::Random { seed };
            let mut counter = 0;
            let mut below = |limit: u64| {
                counter += 1;
                random.bits(counter) % limit
            };
            let width = 1 + below([20, 300, 12_000][seed as usize % 3]) as usize;
            let height = 1 + below(1 + 200_000 / width as u64) as usize;
            let most = [3, 200, 3001][below(3) as usize];
            let (longest, colors) = (1 + below(200), 1 + below(most));
            let mut ids: Vec<i32> = Vec::with_capacity(width * height + 200);
            while ids.len() < width * height {
                let (run, kind) = (1 + below(longest) as usize, below(4));
                for k in 0..run {
                    let at = ids.len();
                    ids.push(match kind {
                        // As above, as above but shifted, or a colour.
                        0 | 1 if at > width => ids[at - width - kind as usize],
                        _ if k > 0 => ids[at - 1],
                        _ => below(colors) as i32 - 1,
                    });
                }
            }
            ids.truncate(width * height);
            let region = Region { x: 0, y: 0, width: width as u32, height: height as u32 };
            let mut bytes = Vec::new();
            write_png(&mut bytes, region, &ids, &paint).unwrap();
            let (image, _) = decoded(&bytes);
            assert!(
                image.pixels().zip(&ids).all(|(pixel, &id)| Some(pixel.0) == paint.color(id)),
                "seed {seed}"
            );
        }
    }

    #[test]
    fn rows_are_the_picture() {
        let scene = scene(300);
        let paint = Paint { scene: &scene, background: [200, 100, 50] };
        let region = Region { x: 0, y: 0, width: 311, height: 1000 };
        let ids: Vec<i32> = (0..region.pixels()).map(|k| (k / 7 % 301) as i32 - 1).collect();
        let mut whole = Vec::new();
        write_png(&mut whole, region, &ids, &paint).unwrap();
        // A band has 210 rows.
        for rows_at_a_time in [1, 7, 209, 210, 211, 640, 999] {
            let mut bytes = Vec::new();
            let mut rows = PngRows::new(&mut bytes, region, paint).unwrap();
            ids.chunks(311 * rows_at_a_time).for_each(|ids| rows.push(ids).unwrap());
            rows.finish().unwrap();
            assert!(bytes == whole, "{rows_at_a_time} rows at a time");
        }
        // However many threads there are.
        for threads in [1, 3] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let mut bytes = Vec::new();
            pool.install(|| write_png(&mut bytes, region, &ids, &paint)).unwrap();
            assert!(bytes == whole, "{threads} threads");
        }
    }

    #[test]
    fn colours_give_the_file_of_their_ids() {
        // Colours come twice, and the background's is a sphere's, too.
        let mut spheres: Vec<_> = [7, 7, 9]
            .map(|red| Sphere { center: DVec3::ZERO, radius: 1.0, color: [red; 3] })
            .into();
        spheres.extend_from_within(..);
        let scene = Scene::from_spheres(&spheres).unwrap();
        let paint = Paint { scene: &scene, background: [9; 3] };
        for (width, height) in [(1, 1), (3, 400), (311, 1000), (32_768, 5)] {
            let region = Region { x: 0, y: 0, width, height };
            let random = crate::make::Random { seed: u64::from(width) };
            let ids: Vec<i32> = (0..region.pixels() as u64)
                .map(|k| (random.bits(k / 4 * (k % 3)) % 7) as i32 - 1)
                .collect();
            let (mut of_ids, mut of_colors) = (Vec::new(), Vec::new());
            write_png(&mut of_ids, region, &ids, &paint).unwrap();
            let colors = paint.colors(&ids).unwrap();
            write_rgb(&mut of_colors, [width, height], &colors).unwrap();
            assert!(of_ids == of_colors, "{width} x {height}");
        }
        let too_long = MAX_SIDE + 1;
        for (size, pixels) in
            [([2, 3], 5), ([2, 3], 7), ([0, 5], 0), ([5, 0], 0), ([too_long, 1], too_long)]
        {
            let pixels = vec![[0; 3]; pixels as usize];
            let error = write_rgb(&mut Vec::new(), size, &pixels).unwrap_err();
            assert_eq!(error.kind(), io::ErrorKind::InvalidInput, "{size:?}: {error}");
        }
    }

    /// Flat pictures are far smaller than their colours; what has no order is hardly larger.
    #[test]
    fn files_are_small() {
        let scene = scene(3000);
        let paint = Paint { scene: &scene, background: [0; 3] };
        let region = Region { x: 0, y: 0, width: 1000, height: 1000 };
        let size = |id: &dyn Fn(usize) -> i32| {
            let ids: Vec<i32> = (0..region.pixels()).map(id).collect();
            let mut bytes = Vec::new();
            write_png(&mut bytes, region, &ids, &paint).unwrap();
            bytes.len()
        };
        let empty = size(&|_| -1);
        assert!(empty < 8_000, "nothing: {empty} bytes");
        let disc =
            |k: usize| (k % 1000).abs_diff(500).pow(2) + (k / 1000).abs_diff(500).pow(2) < 160_000;
        let flat = size(&|k| i32::from(disc(k)) - 1);
        assert!(flat < 16_000, "a disc: {flat} bytes");
        let random = crate::make::Random { seed: 1 };
        let noise = size(&|k| (random.bits(k as u64) % 3000) as i32);
        assert!(noise < 3_100_000, "noise: {noise} bytes");
    }

    #[test]
    fn foreign_ids_are_refused() {
        let scene = scene(2);
        let paint = Paint { scene: &scene, background: [0; 3] };
        let region = Region { x: 0, y: 0, width: 2, height: 2 };
        for ids in [&[0, 1, -1, 2][..], &[0, 1, -1], &[0; 5], &[]] {
            let error = write_png(&mut Vec::new(), region, ids, &paint).unwrap_err();
            assert_eq!(error.kind(), io::ErrorKind::InvalidInput, "{error}");
            let error = write_palette_png(&mut Vec::new(), region, ids, &paint).unwrap_err();
            assert!(
                matches!(&error, PaletteError::Io(e) if e.kind() == io::ErrorKind::InvalidInput),
                "{error}"
            );
        }
        let rows = || PngRows::new(Vec::new(), region, paint).unwrap();
        for (ids, words) in
            [(&[0, 2][..], "id 2"), (&[0, 1, 0], "whole rows"), (&[0; 6], "3 rows come where 2")]
        {
            let error = rows().push(ids).unwrap_err();
            assert!(
                error.kind() == io::ErrorKind::InvalidInput && error.to_string().contains(words),
                "{error}"
            );
        }
        let mut rows = rows();
        rows.push(&[0, 1]).unwrap();
        let error = rows.finish().unwrap_err();
        assert!(error.to_string().contains("1 rows are missing"), "{error}");
        // No picture at all.
        let nothing = Region { height: 0, ..region };
        assert!(write_png(&mut Vec::new(), nothing, &[], &paint).is_err());
        assert!(write_palette_png(&mut Vec::new(), nothing, &[], &paint).is_err());
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
