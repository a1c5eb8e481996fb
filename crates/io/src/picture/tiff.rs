//! TIFF of 8 or 16 bits a channel, deflated with differences between neighbours.

use std::io::{self, Cursor};

use tiff::{
    TiffError,
    encoder::{
        Compression, DeflateLevel, Predictor, Rational, TiffEncoder,
        colortype::{ColorType, RGB8, RGB16, RGBA8, RGBA16},
    },
    tags::{ResolutionUnit, Tag},
};

use super::{
    About, Kind,
    whole::{Values, Whole},
};
use crate::png::invalid;
use planisphere_core::text;

/// Most bytes of pixels, with which places in the file have 32 bits.
const MOST: u64 = (1 << 32) - (1 << 24);

/// What says that alpha is straight (`ExtraSamples`).
const STRAIGHT: [u16; 1] = [2];

/// A resolution's denominator.
const PARTS: u32 = 1000;

/// Refuses what a TIFF cannot hold.
pub(super) fn check(kind: Kind, about: &About) -> io::Result<()> {
    if kind != Kind::Tiff {
        return Ok(());
    }
    let [width, height] = about.size.map(u64::from);
    let of_pixel = if about.alpha { 4 } else { 3 } * if about.depth16 { 2 } else { 1 };
    if (width * height).saturating_mul(of_pixel) > MOST {
        return Err(invalid(format!(
            "a TIFF holds at most {} of pixels, and the picture is {width} x {height}; make it \
             smaller, or write a .png",
            text::bytes(MOST)
        )));
    }
    match about.dpi {
        Some(dpi) if density(dpi).is_none() => {
            Err(invalid(format!("{dpi} dots per inch are none that a TIFF holds")))
        }
        _ => Ok(()),
    }
}

/// Dots per inch, in thousandths.
fn density(dpi: f64) -> Option<u32> {
    let parts = (dpi * f64::from(PARTS)).round();
    (1.0..=f64::from(u32::MAX)).contains(&parts).then_some(parts as u32)
}

/// The file of a picture.
pub(super) fn encode<W>(picture: &Whole<W>, values: &Values) -> io::Result<Vec<u8>> {
    let mut out = Cursor::new(Vec::new());
    match (values, picture.alpha) {
        (Values::Eight(values), false) => encode_as::<RGB8, W>(&mut out, picture, values),
        (Values::Eight(values), true) => encode_as::<RGBA8, W>(&mut out, picture, values),
        (Values::Sixteen(values), false) => encode_as::<RGB16, W>(&mut out, picture, values),
        (Values::Sixteen(values), true) => encode_as::<RGBA16, W>(&mut out, picture, values),
    }
    .map_err(|error| match error {
        TiffError::IoError(error) => error,
        other => io::Error::other(other),
    })?;
    Ok(out.into_inner())
}

/// Encodes values of one kind of pixels.
fn encode_as<C: ColorType, W>(
    out: &mut Cursor<Vec<u8>>,
    picture: &Whole<W>,
    values: &[C::Inner],
) -> Result<(), TiffError>
where
    [C::Inner]: tiff::encoder::TiffValue,
{
    let [width, height] = picture.size;
    let mut encoder = TiffEncoder::new(out)?
        .with_compression(Compression::Deflate(DeflateLevel::Balanced))
        .with_predictor(Predictor::Horizontal);
    let mut image = encoder.new_image::<C>(width, height)?;
    if let Some(parts) = picture.dpi.and_then(density) {
        image.resolution(ResolutionUnit::Inch, Rational { n: parts, d: PARTS });
    }
    if picture.alpha {
        image.encoder().write_tag(Tag::ExtraSamples, &STRAIGHT[..])?;
    }
    image.write_data(values)
}
