//! All of a PNG that comes before its pixels.

use std::io::{self, Write};

use png::{
    BitDepth, ColorType, Encoder, PixelDimensions, SrgbRenderingIntent, Unit, Writer,
    chunk::ChunkType,
};

use super::rows::{into_io, invalid};

/// Inches in a metre, of dots.
pub(crate) const INCH: f64 = 0.0254;

/// What a picture is beside its pixels.
#[derive(Clone, Copy, Debug, Default)]
pub struct About<'a> {
    /// Width and height.
    pub size: [u32; 2],
    /// Whether alpha is written; else the fourth value of pixels is ignored.
    pub alpha: bool,
    /// Whether a channel has 16 bits; else 8.
    pub depth16: bool,
    /// Pixels per inch, where the format holds it.
    pub dpi: Option<f64>,
    /// Keys and texts, where the format holds them.
    pub text: &'a [(String, String)],
}

/// An encoder with all that comes before the texts.
pub(crate) fn encoder<W: Write>(out: W, about: &About) -> io::Result<Encoder<'static, W>> {
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
pub(crate) fn begin<W: Write>(out: W, about: &About) -> io::Result<Writer<W>> {
    let mut writer = encoder(out, about)?.write_header().map_err(into_io)?;
    write_texts(&mut writer, about)?;
    Ok(writer)
}

/// Writes texts, in their order.
pub(crate) fn write_texts<W: Write>(writer: &mut Writer<W>, about: &About) -> io::Result<()> {
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
