//! Writes pixels as PNG: RGB or RGBA of 8 or 16 bits, never with a palette.
//!
//! Rows are filtered and compressed in bands, side by side, so that a picture of any size needs
//! little memory.

use std::{
    io::{self, Write},
    marker::PhantomData,
};

use png::{
    BitDepth, ColorType, Encoder, PixelDimensions, SrgbRenderingIntent, Unit, Writer,
    chunk::ChunkType,
};

use super::bands::Filtered;
use crate::{
    picture::{About, Rows},
    png::{Rows as Compressed, into_io, invalid},
};

/// Pixels of a band of rows. The bytes of files depend on it.
const BAND: usize = 1 << 16;

/// Inches in a metre, of dots.
const INCH: f64 = 0.0254;

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
        let writer = begin(out, about)?;
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

/// An encoder with all that comes before the texts.
pub(in crate::picture) fn encoder<W: Write>(
    out: W,
    about: &About,
) -> io::Result<Encoder<'static, W>> {
    for (key, value) in about.text {
        check_text(key, value)?;
    }
    let mut encoder = Encoder::new(out, about.size[0], about.size[1]);
    encoder.set_color(if about.alpha { ColorType::Rgba } else { ColorType::Rgb });
    encoder.set_depth(if about.depth16 { BitDepth::Sixteen } else { BitDepth::Eight });
    encoder.set_source_srgb(SrgbRenderingIntent::Perceptual);
    if let Some(dpi) = about.dpi {
        let dots = (dpi / INCH).round();
        if !(1.0..=f64::from(i32::MAX)).contains(&dots) {
            return Err(invalid(format!("{dpi} dots per inch are none that a PNG holds")));
        }
        let dots = dots as u32;
        encoder.set_pixel_dims(Some(PixelDimensions { xppu: dots, yppu: dots, unit: Unit::Meter }));
    }
    Ok(encoder)
}

/// Writes all that comes before the pixels.
fn begin<W: Write>(out: W, about: &About) -> io::Result<Writer<W>> {
    let mut writer = encoder(out, about)?.write_header().map_err(into_io)?;
    write_texts(&mut writer, about)?;
    Ok(writer)
}

/// Writes texts, in their order.
pub(in crate::picture) fn write_texts<W: Write>(
    writer: &mut Writer<W>,
    about: &About,
) -> io::Result<()> {
    for (key, value) in about.text {
        let (name, data) = text_chunk(key, value);
        writer.write_chunk(ChunkType(name), &data).map_err(into_io)?;
    }
    Ok(())
}

/// Refuses a key or a text that a PNG cannot hold.
fn check_text(key: &str, value: &str) -> io::Result<()> {
    let shown = format!("`{}`", planisphere_core::text::value(key));
    let latin = key.chars().all(|c| matches!(c, ' '..='~' | '\u{a1}'..='\u{ff}'));
    let spaces = key.starts_with(' ') || key.ends_with(' ') || key.contains("  ");
    if !(1..=79).contains(&key.chars().count()) || !latin || spaces {
        return Err(invalid(format!(
            "the key {shown} of a text is none that a PNG holds; give it 1 to 79 visible \
             characters of Latin-1, with single spaces between them"
        )));
    }
    if value.contains('\0') {
        return Err(invalid(format!(
            "the text of {shown} has a character 0, which a PNG cannot hold; leave it out"
        )));
    }
    Ok(())
}

/// A text that was checked, as a chunk: `tEXt` where Latin-1 has its characters, else `iTXt`.
fn text_chunk(key: &str, value: &str) -> ([u8; 4], Vec<u8>) {
    let latin = |text: &str| text.chars().map(|c| c as u8).collect::<Vec<u8>>();
    let key = latin(key);
    if value.chars().all(|c| matches!(c, '\n' | ' '..='~' | '\u{a0}'..='\u{ff}')) {
        (*b"tEXt", [&key, &[0][..], &latin(value)].concat())
    } else {
        // Not compressed, in no language, with no key in one.
        (*b"iTXt", [&key, &[0, 0, 0, 0, 0][..], value.as_bytes()].concat())
    }
}
