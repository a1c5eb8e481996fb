//! JPEG: quality 95, with a colour for each pixel (4:4:4).

use std::io;

use jpeg_encoder::{ColorType, Encoder, EncodingError, PixelDensity, SamplingFactor};

use super::{Kind, whole::Whole};
use crate::png::invalid;

/// At 95 the steps of brightness are 2 levels or less, which no eye sees.
const QUALITY: u8 = 95;

/// Refuses a resolution that a JPEG cannot hold.
pub(super) fn check(kind: Kind, dpi: Option<f64>) -> io::Result<()> {
    match dpi {
        Some(dpi) if kind == Kind::Jpeg && density(dpi).is_none() => Err(invalid(format!(
            "{dpi} dots per inch are none that a JPEG holds; give it 1 to {}",
            u16::MAX
        ))),
        _ => Ok(()),
    }
}

/// Whole dots per inch.
fn density(dpi: f64) -> Option<u16> {
    let whole = dpi.round();
    (1.0..=f64::from(u16::MAX)).contains(&whole).then_some(whole as u16)
}

/// The file of a picture without alpha.
pub(super) fn encode<W>(picture: &Whole<W>, values: &[u8]) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, QUALITY);
    encoder.set_sampling_factor(SamplingFactor::R_4_4_4);
    encoder.set_optimized_huffman_tables(true);
    if let Some(density) = picture.dpi.and_then(density) {
        encoder.set_density(PixelDensity::dpi(density));
    }
    let [width, height] = picture.size.map(|side| side as u16);
    encoder.encode(values, width, height, ColorType::Rgb).map_err(|error| match error {
        EncodingError::IoError(error) => error,
        other => io::Error::other(other),
    })?;
    Ok(bytes)
}
