//! Reads a PNG of any program as colours: 8 bits a channel, straight alpha. What is no PNG is named
//! for what it is.

use std::{fmt, io};

use png::{BitDepth, ColorType, Decoder, DecodingError, Transformations};

use planisphere_core::{camera::MAX_SIDE, text};

/// A picture to compare with.
#[derive(Clone, PartialEq, Eq)]
pub struct Golden {
    /// Columns and rows.
    pub size: [u32; 2],
    /// sRGB and straight alpha, row by row from the top.
    pub pixels: Vec<[u8; 4]>,
}

impl fmt::Debug for Golden {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Golden").field("size", &self.size).finish_non_exhaustive()
    }
}

/// Why bytes are no picture that can be compared. Its `Display` is to be read after a name, and
/// ends with the fix.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ReadError {
    /// There is nothing.
    #[error("is empty; write it again")]
    Empty,
    /// What stands in a repository for a file of Git LFS.
    #[error("is a Git LFS pointer, not the picture itself; fetch that with `git lfs pull`")]
    LfsPointer,
    /// A PNG that was taken for text.
    #[error(
        "is a PNG whose line ends were changed, as of a text; mark it as binary (`*.png binary` in \
         .gitattributes), and write it again"
    )]
    LineEnds,
    /// Something else; says what.
    #[error("is {0}, not a PNG; name a PNG")]
    Other(&'static str),
    /// The end is missing.
    #[error("is a PNG that is cut short; write it again")]
    Cut,
    /// Pixels that have no equal in the pictures that are drawn.
    #[error("has 16 bits a channel, and pictures are drawn with 8; save it with 8 bits a channel")]
    Sixteen,
    /// More than one picture.
    #[error("is an animated PNG; save the one picture that is meant")]
    Animated,
    /// Larger than any picture that is drawn.
    #[error("has {} x {} pixels, and a side has at most {MAX_SIDE}; make it smaller", .0[0], .0[1])]
    TooLarge([u32; 2]),
    /// No memory for its pixels.
    #[error("needs about {} of memory, which is not there; free some", text::bytes(*.0))]
    Memory(u64),
    /// Says what is wrong with it.
    #[error("is a damaged PNG ({0}); write it again")]
    Damaged(String),
}

const SIGNATURE: &[u8] = b"\x89PNG\r\n\x1a\n";

/// Beginnings of files that are taken for pictures, and what these are.
const OTHERS: [(&[u8], &str); 12] = [
    (b"\xff\xd8\xff", "a JPEG"),
    (b"GIF8", "a GIF"),
    (b"BM", "a BMP"),
    (b"II*\0", "a TIFF"),
    (b"MM\0*", "a TIFF"),
    (b"v/1\x01", "an OpenEXR picture"),
    (b"\0\0\x01\0", "an icon"),
    (b"%PDF", "a PDF"),
    (b"PK\x03\x04", "a zip archive"),
    (b"\x1f\x8b", "compressed (gzip)"),
    (b"\x93NUMPY", "a NumPy array"),
    (b"qoif", "a QOI picture"),
];

/// What bytes are that do not begin as a PNG.
fn other(bytes: &[u8]) -> ReadError {
    if bytes.is_empty() {
        return ReadError::Empty;
    }
    if SIGNATURE.starts_with(bytes) {
        return ReadError::Cut;
    }
    if bytes.starts_with(b"\x89PNG") {
        return ReadError::LineEnds;
    }
    if bytes.starts_with(b"version https://git-lfs") {
        return ReadError::LfsPointer;
    }
    let found = OTHERS.iter().find(|(start, _)| bytes.starts_with(start));
    if let Some((_, what)) = found {
        return ReadError::Other(what);
    }
    match bytes {
        [b'R', b'I', b'F', b'F', _, _, _, _, b'W', b'E', b'B', b'P', ..] => {
            ReadError::Other("a WebP")
        }
        [_, _, _, _, b'f', b't', b'y', b'p', b'a', b'v', b'i', ..] => ReadError::Other("an AVIF"),
        [b'P', b'1'..=b'7', end, ..] if end.is_ascii_whitespace() => {
            ReadError::Other("a picture of Netpbm (PPM)")
        }
        _ => ReadError::Other(kind_of_text(bytes)),
    }
}

/// What kind of text bytes are, if they are any.
fn kind_of_text(bytes: &[u8]) -> &'static str {
    let start = &bytes[..bytes.len().min(512)];
    let is_text = |byte: &u8| !byte.is_ascii_control() || byte.is_ascii_whitespace();
    if !start.iter().all(is_text) {
        return "something else";
    }
    let start = String::from_utf8_lossy(start).trim_start().to_ascii_lowercase();
    if ["<!doctype html", "<html"].iter().any(|tag| start.starts_with(tag)) {
        "HTML"
    } else if start.contains("<svg") {
        "an SVG"
    } else {
        "text"
    }
}

/// A decoder's words.
fn damaged(error: DecodingError) -> ReadError {
    match error {
        DecodingError::IoError(error) if error.kind() == io::ErrorKind::UnexpectedEof => {
            ReadError::Cut
        }
        other => ReadError::Damaged(text::value(&other.to_string())),
    }
}

/// A PNG whose header was read, and its columns and rows.
struct Begun<'a> {
    decoder: Decoder<io::Cursor<&'a [u8]>>,
    size: [u32; 2],
}

/// Begins to read, up to the size.
fn begun(bytes: &[u8]) -> Result<Begun<'_>, ReadError> {
    if !bytes.starts_with(SIGNATURE) {
        return Err(other(bytes));
    }
    let mut decoder = Decoder::new(io::Cursor::new(bytes));
    decoder.set_transformations(Transformations::EXPAND);
    decoder.ignore_checksums(false);
    // Neither changes a pixel.
    decoder.set_ignore_text_chunk(true);
    decoder.set_ignore_iccp_chunk(true);
    let header = decoder.read_header_info().map_err(damaged)?;
    let (size, depth) = ([header.width, header.height], header.bit_depth);
    if size.iter().any(|side| *side > MAX_SIDE) {
        return Err(ReadError::TooLarge(size));
    }
    if depth == BitDepth::Sixteen {
        return Err(ReadError::Sixteen);
    }
    Ok(Begun { decoder, size })
}

/// Columns and rows of a PNG, before its pixels are read.
///
/// # Errors
/// When it is none, or none that can be compared.
pub fn png_size(bytes: &[u8]) -> Result<[u32; 2], ReadError> {
    begun(bytes).map(|begun| begun.size)
}

/// Reads a PNG of any colour type, whole: its checksums are looked at, and its end must be there.
///
/// # Errors
/// When it is none, is damaged, or cannot be compared.
pub fn read_png(bytes: &[u8]) -> Result<Golden, ReadError> {
    let Begun { decoder, size } = begun(bytes)?;
    let mut reader = decoder.read_info().map_err(damaged)?;
    if reader.info().animation_control.is_some() {
        return Err(ReadError::Animated);
    }
    let count = size[0] as usize * size[1] as usize;
    let none = || ReadError::Memory(8 * count as u64);
    let length = reader.output_buffer_size().ok_or_else(none)?;
    let mut decoded = Vec::new();
    decoded.try_reserve_exact(length).map_err(|_| none())?;
    decoded.resize(length, 0);
    let info = reader.next_frame(&mut decoded).map_err(damaged)?;
    reader.finish().map_err(damaged)?;
    let mut pixels: Vec<[u8; 4]> = Vec::new();
    pixels.try_reserve_exact(count).map_err(|_| none())?;
    match info.color_type {
        ColorType::Grayscale => pixels.extend(decoded.iter().map(|&v| [v, v, v, 255])),
        ColorType::GrayscaleAlpha => {
            pixels.extend(decoded.as_chunks::<2>().0.iter().map(|&[v, a]| [v, v, v, a]));
        }
        ColorType::Rgb => {
            pixels.extend(decoded.as_chunks::<3>().0.iter().map(|&[r, g, b]| [r, g, b, 255]));
        }
        ColorType::Rgba => pixels.extend(decoded.as_chunks::<4>().0),
        // What is asked for has none.
        ColorType::Indexed => return Err(ReadError::Damaged("its palette is not used".into())),
    }
    if pixels.len() != count {
        return Err(ReadError::Damaged(format!("{} pixels of {count}", pixels.len())));
    }
    Ok(Golden { size, pixels })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A PNG of some form, by another encoder's way than ours.
    fn written(size: [u32; 2], color: ColorType, depth: BitDepth, data: &[u8]) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, size[0], size[1]);
        encoder.set_color(color);
        encoder.set_depth(depth);
        if color == ColorType::Indexed {
            encoder.set_palette(vec![1, 2, 3, 4, 5, 6, 7, 8, 9]);
            encoder.set_trns(vec![255, 77]);
        }
        let mut writer = encoder.write_header().unwrap();
        writer.write_image_data(data).unwrap();
        writer.finish().unwrap();
        bytes
    }

    #[test]
    fn every_kind_becomes_colours() {
        use ColorType::{Grayscale, GrayscaleAlpha, Indexed, Rgb, Rgba};
        let check = |color, depth, data: &[u8], wanted: [[u8; 4]; 2]| {
            let found = read_png(&written([2, 1], color, depth, data));
            let found = found.unwrap_or_else(|error| panic!("{color:?}: {error}"));
            assert_eq!((found.size, &found.pixels[..]), ([2, 1], &wanted[..]), "{color:?}");
        };
        let eight = BitDepth::Eight;
        check(Rgb, eight, &[1, 2, 3, 4, 5, 6], [[1, 2, 3, 255], [4, 5, 6, 255]]);
        check(Rgba, eight, &[1, 2, 3, 4, 5, 6, 7, 8], [[1, 2, 3, 4], [5, 6, 7, 8]]);
        check(Grayscale, eight, &[7, 9], [[7, 7, 7, 255], [9, 9, 9, 255]]);
        check(Grayscale, BitDepth::Two, &[0x60], [[85, 85, 85, 255], [170, 170, 170, 255]]);
        check(GrayscaleAlpha, eight, &[7, 1, 9, 2], [[7, 7, 7, 1], [9, 9, 9, 2]]);
        check(Indexed, eight, &[2, 1], [[7, 8, 9, 255], [4, 5, 6, 77]]);
        check(Indexed, BitDepth::Two, &[0x90], [[7, 8, 9, 255], [4, 5, 6, 77]]);
    }

    #[test]
    fn what_is_no_png_is_named() {
        let cases: [(&[u8], &str); 15] = [
            (b"", "is empty"),
            (b"version https://git-lfs.github.com/spec/v1\noid sha256:1\n", "git lfs pull"),
            (b"\xff\xd8\xff\xe0\0\x10JFIF", "is a JPEG"),
            (b"GIF89a", "is a GIF"),
            (b"RIFF\x10\0\0\0WEBPVP8 ", "is a WebP"),
            (b"BM\x10\0\0\0", "is a BMP"),
            (b"P6\n2 2\n255\n", "Netpbm"),
            (b"\n<!DOCTYPE html><html>", "is HTML"),
            (b"<?xml version='1.0'?><svg xmlns=''>", "is an SVG"),
            (b"404: Not Found", "is text"),
            (b"\x01\x02\x03\x04", "is something else"),
            (b"\x89PNG\n\x1a\n\0\0", "*.png binary"),
            (b"\x89P", "cut short"),
            (b"\x93NUMPY\x01\0", "NumPy"),
            (b"\x89PNG\r\n\x1a\n", "cut short"),
        ];
        for (bytes, words) in cases {
            for error in [read_png(bytes).unwrap_err(), png_size(bytes).unwrap_err()] {
                assert!(error.to_string().contains(words), "{bytes:?}: {error}");
            }
        }
    }

    #[test]
    fn a_cut_or_damaged_picture_is_refused() {
        let data: Vec<u8> = (0..300u32).map(|k| (k * k % 251) as u8).collect();
        let bytes = written([10, 10], ColorType::Rgb, BitDepth::Eight, &data);
        assert_eq!(png_size(&bytes), Ok([10, 10]));
        for end in 1..bytes.len() {
            assert_eq!(read_png(&bytes[..end]), Err(ReadError::Cut), "{end} of {}", bytes.len());
        }
        for at in 8..bytes.len() {
            let mut other = bytes.clone();
            other[at] ^= 0x10;
            // What is beyond the marks of the end is not looked at.
            assert!(read_png(&other).is_err() || at >= bytes.len() - 12, "{at}");
        }
        let wide = written([10, 10], ColorType::Rgb, BitDepth::Sixteen, &[0; 600]);
        assert_eq!(read_png(&wide), Err(ReadError::Sixteen));
        let long = written([MAX_SIDE + 1, 1], ColorType::Grayscale, BitDepth::One, &[0; 4097]);
        assert_eq!(read_png(&long), Err(ReadError::TooLarge([MAX_SIDE + 1, 1])));
    }
}
