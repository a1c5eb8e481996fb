//! Reads a PNG's pixels and its texts.
//!
//! Every kind of PNG is expanded to red, green, blue and straight alpha. Values are those that the
//! file holds: its gamma and its colour profile, if there are any, are not applied.

use std::io::{self, BufRead, Seek};

use png::{
    BitDepth, ColorType, DecodeOptions, Decoder, DecodingError, Limits, Reader, Transformations,
    Unit,
};

use crate::{
    picture::sniff::{FIRST, LFS, sniff},
    png::INCH,
};
use planisphere_core::text;

/// The first bytes of a PNG.
const SIGNATURE: [u8; 8] = *b"\x89PNG\r\n\x1a\n";

/// Bytes that the decoder may take for all that is not pixels: texts, profiles and a row.
const BESIDE: usize = 64 << 20;

/// Bytes that one compressed text may have.
const TEXT: usize = 8 << 20;

/// What a PNG holds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Decoded<T = u8> {
    /// Width and height.
    pub size: [u32; 2],
    /// Row by row: red, green, blue and straight alpha, which is full where the file has none.
    pub pixels: Vec<[T; 4]>,
    /// Whether the file holds alpha, be it of one colour only.
    pub alpha: bool,
    /// Bits of a channel in the file, or of an index of its palette: 1, 2, 4, 8 or 16.
    pub bits: u8,
    /// Its texts by their keys: first those in Latin-1, then compressed ones, then those in UTF-8;
    /// in the order of the file within each.
    pub text: Vec<(String, String)>,
}

/// What a PNG says of itself.
#[derive(Clone, Debug, PartialEq)]
pub struct Header {
    /// Width and height.
    pub size: [u32; 2],
    /// Whether the file holds alpha, be it of one colour only.
    pub alpha: bool,
    /// Bits of a channel, or of an index of its palette: 1, 2, 4, 8 or 16.
    pub bits: u8,
    /// Pixels per inch, across and down.
    pub dpi: Option<[f64; 2]>,
    /// As of [`Decoded::text`].
    pub text: Vec<(String, String)>,
}

/// Why a PNG is not read: words that follow the file's name, and end with the fix.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The file has no bytes.
    #[error("is empty; name a PNG, or write it again")]
    Empty,
    /// It is a small text file in place of the picture.
    #[error("is {LFS}, not the picture itself; fetch that with `git lfs pull`")]
    Pointer,
    /// It is something else that is known.
    #[error("is {0}, not a PNG; convert it to PNG, or name another file")]
    Other(&'static str),
    /// A transfer as text has changed its bytes.
    #[error(
        "is a PNG whose line ends were changed, as of a text; mark it as binary (`*.png binary` in \
         .gitattributes), and write or copy it again"
    )]
    LineEnds,
    /// It is something else.
    #[error("is not a PNG: it begins with {0}; name a PNG")]
    Unknown(String),
    /// It ends too early.
    #[error("is a PNG that is cut short; write or copy it again")]
    Cut,
    /// It is damaged.
    #[error("is a damaged PNG ({}); write or copy it again", text::value(.0))]
    Damaged(String),
    /// It holds more than one picture.
    #[error("is an animation of {0} pictures; save the one that is meant")]
    Animated(u32),
    /// Its values do not fit into 8 bits.
    #[error("has 16 bits a channel, where 8 are needed; save it with 8 bits a channel")]
    Deep,
    /// Its pixels need too much memory.
    #[error(
        "has {} x {} pixels, which need {}, and {} may be used; name a smaller picture",
        .size[0], .size[1], text::bytes(*.bytes), text::bytes(*.most)
    )]
    TooLarge {
        /// Width and height.
        size: [u32; 2],
        /// What its pixels need.
        bytes: u64,
        /// What may be used.
        most: u64,
    },
    /// Its texts or its profile need too much memory.
    #[error("has texts that need more than {}; save it without them", text::bytes(BESIDE as u64))]
    TooMuchText,
    /// The reader's own error.
    #[error("cannot be read: {0}")]
    Io(io::Error),
}

impl From<DecodingError> for ReadError {
    fn from(error: DecodingError) -> Self {
        match error {
            DecodingError::IoError(error) => error.into(),
            DecodingError::LimitsExceeded => Self::TooMuchText,
            other => Self::Damaged(other.to_string()),
        }
    }
}

impl From<io::Error> for ReadError {
    fn from(error: io::Error) -> Self {
        match error.kind() {
            io::ErrorKind::UnexpectedEof => Self::Cut,
            _ => Self::Io(error),
        }
    }
}

/// A channel's value.
trait Sample: bytemuck::Pod {
    /// From what the decoder gives: bytes as they lie in the file.
    fn of(value: Self) -> Self;
    const MOST: Self;
}

impl Sample for u8 {
    fn of(value: Self) -> Self {
        value
    }
    const MOST: Self = u8::MAX;
}

impl Sample for u16 {
    fn of(value: Self) -> Self {
        Self::from_be(value)
    }
    const MOST: Self = u16::MAX;
}

/// Reads a PNG of at most 8 bits a channel, whose pixels need at most so many bytes.
///
/// # Errors
/// When it is no PNG, is damaged, cut short, or too large; when it has 16 bits a channel, which
/// [`read_deep`] reads; and the reader's own.
pub fn read(from: impl BufRead + Seek, most: u64) -> Result<Decoded, ReadError> {
    let mut reader = opened(from)?;
    if reader.info().bit_depth == BitDepth::Sixteen {
        return Err(ReadError::Deep);
    }
    pixels(&mut reader, most)
}

/// Reads a PNG of any depth as 16 bits a channel. Of fewer bits the full value is the full one.
///
/// # Errors
/// As of [`read`], but for the depth.
pub fn read_deep(from: impl BufRead + Seek, most: u64) -> Result<Decoded<u16>, ReadError> {
    let mut reader = opened(from)?;
    if reader.info().bit_depth == BitDepth::Sixteen {
        return pixels(&mut reader, most);
    }
    // The pixels of both depths are there at once.
    let Decoded { size, pixels, alpha, bits, text } = pixels::<u8, _>(&mut reader, most / 3)
        .map_err(|error| match error {
            ReadError::TooLarge { size, bytes, .. } => {
                ReadError::TooLarge { size, bytes: 3 * bytes, most }
            }
            other => other,
        })?;
    let pixels = pixels.into_iter().map(|pixel| pixel.map(|value| 257 * u16::from(value)));
    Ok(Decoded { size, pixels: pixels.collect(), alpha, bits, text })
}

/// Width and height of a PNG of any kind, of which no more than the header is read.
///
/// # Errors
/// When it is no PNG, or its header is damaged or cut short; and the reader's own.
pub fn size(from: impl BufRead + Seek) -> Result<[u32; 2], ReadError> {
    let mut decoder = begun(from)?;
    let header = decoder.read_header_info()?;
    Ok([header.width, header.height])
}

/// What a PNG of any kind says of itself. Its pixels are passed over, for its texts may come after
/// them.
///
/// # Errors
/// When it is no PNG, is damaged or cut short; and the reader's own.
pub fn header(from: impl BufRead + Seek) -> Result<Header, ReadError> {
    let mut reader = opened(from)?;
    reader.finish()?;
    let info = reader.info();
    let dpi = info.pixel_dims.filter(|dims| dims.unit == Unit::Meter);
    Ok(Header {
        size: [info.width, info.height],
        alpha: has_alpha(info),
        bits: info.bit_depth as u8,
        dpi: dpi.map(|dims| [dims.xppu, dims.yppu].map(|dots| f64::from(dots) * INCH)),
        text: texts(info)?,
    })
}

/// Whether there is alpha, be it of one colour only.
fn has_alpha(info: &png::Info<'_>) -> bool {
    info.trns.is_some() || matches!(info.color_type, ColorType::GrayscaleAlpha | ColorType::Rgba)
}

/// Reads all that comes before the pixels.
fn opened<R: BufRead + Seek>(from: R) -> Result<Reader<R>, ReadError> {
    let reader = begun(from)?.read_info()?;
    match reader.info().animation_control {
        Some(animation) => Err(ReadError::Animated(animation.num_frames)),
        None => Ok(reader),
    }
}

/// A decoder of what begins as a PNG does.
fn begun<R: BufRead + Seek>(mut from: R) -> Result<Decoder<R>, ReadError> {
    let begin = from.stream_position()?;
    let mut first = Vec::new();
    io::Read::read_to_end(&mut io::Read::take(&mut from, FIRST as u64), &mut first)?;
    is_png(&first)?;
    from.seek(io::SeekFrom::Start(begin))?;
    let mut options = DecodeOptions::default();
    options.set_ignore_checksums(false);
    options.set_skip_ancillary_crc_failures(false);
    let mut decoder = Decoder::new_with_options(from, options);
    decoder.set_limits(Limits { bytes: BESIDE });
    decoder.set_transformations(Transformations::EXPAND | Transformations::ALPHA);
    Ok(decoder)
}

/// Refuses what does not begin as a PNG does.
fn is_png(first: &[u8]) -> Result<(), ReadError> {
    if first.starts_with(&SIGNATURE) {
        Ok(())
    } else if first.is_empty() {
        Err(ReadError::Empty)
    } else if SIGNATURE.starts_with(first) {
        Err(ReadError::Cut)
    } else if first.starts_with(b"\x89PNG") {
        Err(ReadError::LineEnds)
    } else {
        Err(match sniff(first) {
            Some(name) if name == LFS => ReadError::Pointer,
            Some(name) => ReadError::Other(name),
            None => {
                let begin = &first[..first.len().min(SIGNATURE.len())];
                ReadError::Unknown(format!("\"{}\"", begin.escape_ascii()))
            }
        })
    }
}

/// Reads the pixels and all that comes after them.
fn pixels<T: Sample, R: BufRead + Seek>(
    reader: &mut Reader<R>,
    most: u64,
) -> Result<Decoded<T>, ReadError> {
    let info = reader.info();
    let (size, bits) = ([info.width, info.height], info.bit_depth as u8);
    let alpha = has_alpha(info);
    let count = u64::from(size[0]) * u64::from(size[1]);
    let bytes = count.saturating_mul(size_of::<[T; 4]>() as u64);
    let too_large = || ReadError::TooLarge { size, bytes, most };
    let fits =
        bytes <= most && usize::try_from(bytes).is_ok_and(|bytes| bytes <= isize::MAX as usize);
    if !fits {
        return Err(too_large());
    }
    let count = count as usize;
    let mut pixels: Vec<[T; 4]> = Vec::new();
    pixels.try_reserve_exact(count).map_err(|_| too_large())?;
    pixels.resize(count, [T::MOST; 4]);
    let output = reader.next_frame(bytemuck::cast_slice_mut(&mut pixels))?;
    let samples = pixels.as_flattened_mut();
    match output.color_type {
        ColorType::Rgba => samples.iter_mut().for_each(|value| *value = T::of(*value)),
        ColorType::GrayscaleAlpha => {
            // Two values become four where they lie, from the last pixel on.
            for k in (0..count).rev() {
                let [gray, alpha] = [0, 1].map(|at| T::of(samples[2 * k + at]));
                samples[4 * k..4 * k + 4].copy_from_slice(&[gray, gray, gray, alpha]);
            }
        }
        other => {
            return Err(ReadError::Damaged(format!("its colours are of the kind {other:?}")));
        }
    }
    reader.finish()?;
    Ok(Decoded { size, pixels, alpha, bits, text: texts(reader.info())? })
}

/// All texts with their keys.
fn texts(info: &png::Info<'_>) -> Result<Vec<(String, String)>, ReadError> {
    let mut all: Vec<(String, String)> = Vec::new();
    let latin = info.uncompressed_latin1_text.iter();
    all.extend(latin.map(|chunk| (chunk.keyword.clone(), chunk.text.clone())));
    for chunk in &info.compressed_latin1_text {
        let mut chunk = chunk.clone();
        chunk.decompress_text_with_limit(TEXT)?;
        all.push((chunk.keyword.clone(), chunk.get_text()?));
    }
    for chunk in &info.utf8_text {
        let mut chunk = chunk.clone();
        chunk.decompress_text_with_limit(TEXT)?;
        all.push((chunk.keyword.clone(), chunk.get_text()?));
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;

    /// A file of a kind of PNG, with bytes that a seed makes.
    fn file(color: ColorType, depth: BitDepth, [width, height]: [u32; 2], clear: bool) -> Vec<u8> {
        let mut out = Vec::new();
        let mut encoder = png::Encoder::new(&mut out, width, height);
        encoder.set_color(color);
        encoder.set_depth(depth);
        if color == ColorType::Indexed {
            let colors = 1 << (depth as usize);
            encoder.set_palette((0..3 * colors).map(|k| (k * 37) as u8).collect::<Vec<_>>());
            if clear {
                encoder.set_trns(vec![0, 100, 255][..colors.min(3)].to_vec());
            }
        } else if clear {
            let values = if color == ColorType::Rgb { 3 } else { 1 };
            encoder.set_trns([0, 1].repeat(values));
        }
        let row = color.samples() * depth as usize * width as usize;
        let random = crate::make::Random { seed: row as u64 };
        let bytes: Vec<u8> = (0..row.div_ceil(8) * height as usize)
            .map(|k| if clear && k % 5 < 2 { k as u8 % 5 } else { random.bits(k as u64) as u8 })
            .collect();
        encoder.add_text_chunk("Title".into(), "café".into()).unwrap();
        encoder.add_ztxt_chunk("Scene".into(), "a\n".repeat(999)).unwrap();
        encoder.add_itxt_chunk("Comment".into(), "球 a b".into()).unwrap();
        let mut writer = encoder.write_header().unwrap();
        writer.write_image_data(&bytes).unwrap();
        writer.finish().unwrap();
        out
    }

    fn every_kind() -> Vec<(ColorType, BitDepth)> {
        let all = [BitDepth::One, BitDepth::Two, BitDepth::Four, BitDepth::Eight];
        let mut kinds: Vec<_> = all.map(|depth| (ColorType::Indexed, depth)).into();
        kinds.extend(all.map(|depth| (ColorType::Grayscale, depth)));
        for color in [ColorType::GrayscaleAlpha, ColorType::Rgb, ColorType::Rgba] {
            kinds.push((color, BitDepth::Eight));
        }
        for color in
            [ColorType::Grayscale, ColorType::GrayscaleAlpha, ColorType::Rgb, ColorType::Rgba]
        {
            kinds.push((color, BitDepth::Sixteen));
        }
        kinds
    }

    #[test]
    fn every_kind_is_read() {
        for (color, depth) in every_kind() {
            for (size, clear) in
                [([1, 1], false), ([7, 5], true), ([7, 5], false), ([33, 2], false)]
            {
                let has_alpha = matches!(color, ColorType::GrayscaleAlpha | ColorType::Rgba);
                let bytes = file(color, depth, size, clear && !has_alpha);
                let want = image::load_from_memory(&bytes).unwrap();
                let deep = read_deep(Cursor::new(&bytes), 1 << 20).unwrap();
                assert_eq!((deep.size, deep.bits), (size, depth as u8));
                assert_eq!(deep.alpha, has_alpha || clear, "{color:?} {depth:?}");
                let pixels: Vec<_> = want.to_rgba16().pixels().map(|pixel| pixel.0).collect();
                assert_eq!(deep.pixels, pixels, "{color:?} {depth:?}");
                let read = read(Cursor::new(&bytes), 1 << 20);
                if depth == BitDepth::Sixteen {
                    assert!(matches!(read, Err(ReadError::Deep)));
                    continue;
                }
                let read = read.unwrap();
                let pixels: Vec<_> = want.to_rgba8().pixels().map(|pixel| pixel.0).collect();
                assert_eq!(read.pixels, pixels, "{color:?} {depth:?}");
                let texts = ["café".to_owned(), "a\n".repeat(999), "球 a b".to_owned()];
                let keys = ["Title", "Scene", "Comment"].map(str::to_owned);
                assert!(read.text.into_iter().eq(keys.into_iter().zip(texts)));
            }
        }
    }

    /// Red in all pixels but the last, which is green: 3 x 3, interlaced, one bit, with a palette.
    #[test]
    fn interlaced_pictures_are_read() {
        let mut out = SIGNATURE.to_vec();
        let mut chunk = |name: &[u8; 4], data: &[u8]| {
            let named = [name, data].concat();
            out.extend((data.len() as u32).to_be_bytes());
            out.extend(&named);
            let mut crc = flate2::Crc::new();
            crc.update(&named);
            out.extend(crc.sum().to_be_bytes());
        };
        chunk(b"IHDR", &[0, 0, 0, 3, 0, 0, 0, 3, 1, 3, 0, 0, 1]);
        chunk(b"PLTE", &[255, 0, 0, 0, 255, 0]);
        // Passes 1, 5 (row 2), 6 (rows 0 and 2) and 7 (row 1): columns 0 and 2, 0 and 2, 1, all.
        let rows = [[0, 0], [0, 0], [0, 0b0100_0000], [0, 0], [0, 0], [0, 0b0010_0000]];
        let mut zlib = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
        rows.iter().for_each(|row| io::Write::write_all(&mut zlib, row).unwrap());
        chunk(b"IDAT", &zlib.finish().unwrap());
        chunk(b"IEND", &[]);
        let Decoded { pixels, .. } = read(Cursor::new(&out), 1000).unwrap();
        let want = image::load_from_memory(&out).unwrap().to_rgba8();
        assert!(want.pixels().map(|pixel| &pixel.0).eq(&pixels), "{pixels:?}");
        assert_eq!(pixels.iter().filter(|pixel| **pixel == [0, 255, 0, 255]).count(), 2);
    }

    #[test]
    fn what_is_no_png_is_named() {
        for (bytes, want) in [
            (&b""[..], "is empty"),
            (b"version https://git-lfs.github.com/spec/v1\noid sha256:1\n", "git lfs pull"),
            (b"\xff\xd8\xff\xe0\0\x10JFIF", "is a JPEG, not a PNG"),
            (b"GIF89a", "is a GIF"),
            (b"RIFF\x10\0\0\0WEBPVP8 ", "is a WebP"),
            (b"BM\x10\0\0\0", "is a BMP"),
            (b"P6\n2 2\n255\n", "Netpbm"),
            (b"\n<!DOCTYPE html><html>", "HTML"),
            (b"<?xml version='1.0'?><svg xmlns=''>", "is an SVG"),
            (b"404: Not Found", r#"it begins with "404: Not""#),
            (b"\x01\x02\x03\x04", r#"it begins with "\x01\x02\x03\x04""#),
            (b"\x89PNG\n\x1a\n\0\0", "*.png binary"),
            (b"\x89P", "cut short"),
            (b"\x93NUMPY\x01\0", "NumPy"),
            (b"\x89PNG\r\n\x1a\n", "cut short"),
        ] {
            let errors = [
                read(Cursor::new(bytes), 1 << 20).unwrap_err(),
                size(Cursor::new(bytes)).unwrap_err(),
            ];
            for error in errors {
                assert!(error.to_string().contains(want), "{bytes:?}: {error}");
            }
        }
    }

    #[test]
    fn damage_is_told() {
        let whole = file(ColorType::Rgb, BitDepth::Eight, [20, 20], false);
        assert_eq!(size(Cursor::new(&whole)).unwrap(), [20, 20]);
        for end in 0..whole.len() {
            let error = read(Cursor::new(&whole[..end]), 1 << 20).unwrap_err();
            let early = matches!(error, ReadError::Cut) || end == 0;
            assert!(early, "{end} of {} bytes: {error:?}", whole.len());
        }
        for at in 8..whole.len() {
            let mut bytes = whole.clone();
            bytes[at] ^= 0x10;
            assert!(read(Cursor::new(&bytes), 1 << 20).is_err(), "byte {at}");
        }
    }

    #[test]
    fn what_is_too_large_is_refused() {
        let bytes = file(ColorType::Grayscale, BitDepth::One, [64, 64], false);
        let need = 64 * 64 * 4;
        assert!(read(Cursor::new(&bytes), need).is_ok());
        let error = read(Cursor::new(&bytes), need - 1).unwrap_err().to_string();
        assert!(error.starts_with("has 64 x 64 pixels, which need "), "{error}");
        assert!(read_deep(Cursor::new(&bytes), 3 * need).is_ok());
        assert!(read_deep(Cursor::new(&bytes), 3 * need - 1).is_err());
        // A header of four billion columns and rows takes no memory.
        let mut huge = bytes.clone();
        huge[16..24].copy_from_slice(&[0x7f, 255, 255, 255, 0x7f, 255, 255, 255]);
        let mut crc = flate2::Crc::new();
        crc.update(&huge[12..29]);
        huge[29..33].copy_from_slice(&crc.sum().to_be_bytes());
        assert!(read(Cursor::new(&huge), u64::MAX).is_err());
    }

    #[test]
    fn animations_are_refused() {
        let mut out = Vec::new();
        let mut encoder = png::Encoder::new(&mut out, 1, 1);
        encoder.set_animated(2, 0).unwrap();
        let mut writer = encoder.write_header().unwrap();
        writer.write_image_data(&[1]).unwrap();
        writer.write_image_data(&[2]).unwrap();
        writer.finish().unwrap();
        let error = read(Cursor::new(&out), 1 << 20).unwrap_err();
        assert!(matches!(error, ReadError::Animated(2)), "{error}");
    }
}
