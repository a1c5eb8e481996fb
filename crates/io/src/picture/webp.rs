//! WebP without loss.

use std::io;

use image_webp::{ColorType, EncodingError, WebPEncoder};

use super::whole::Whole;

/// The file of a picture.
pub(super) fn encode<W>(picture: &Whole<W>, values: &[u8]) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let [width, height] = picture.size;
    let colors = if picture.alpha { ColorType::Rgba8 } else { ColorType::Rgb8 };
    WebPEncoder::new(&mut bytes).encode(values, width, height, colors).map_err(
        |error| match error {
            EncodingError::IoError(error) => error,
            other => io::Error::other(other),
        },
    )?;
    Ok(bytes)
}
