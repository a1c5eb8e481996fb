//! Pictures of formats whose encoders need all pixels at once.

use std::io::{self, Write};

use super::{About, Kind, Rows, jpeg, qoi, tiff, webp};
use crate::png::invalid;

/// Values of pixels: three each, or four with alpha.
#[derive(Debug)]
pub(super) enum Values {
    Eight(Vec<u8>),
    Sixteen(Vec<u16>),
}

/// What a picture is, apart from its texts.
#[derive(Debug)]
pub(super) struct Whole<W> {
    out: W,
    kind: Kind,
    pub size: [u32; 2],
    pub alpha: bool,
    pub dpi: Option<f64>,
    pub values: Values,
}

impl<W: Write> Whole<W> {
    /// Begins a picture, for whose pixels there is memory.
    pub fn new(out: W, kind: Kind, about: &About) -> io::Result<Self> {
        let About { size, alpha, dpi, .. } = *about;
        jpeg::check(kind, dpi)?;
        tiff::check(kind, about)?;
        let count = u64::from(size[0]) * u64::from(size[1]) * if alpha { 4 } else { 3 };
        let values = usize::try_from(count).ok().and_then(|count| {
            Some(if about.depth16 {
                Values::Sixteen(with_room(count)?)
            } else {
                Values::Eight(with_room(count)?)
            })
        });
        let values = values.ok_or_else(|| {
            let [name, width, height] = [kind.name(), &size[0].to_string(), &size[1].to_string()];
            let words = format!(
                "there is no memory for the {width} x {height} pixels of a {name}, which is \
                 written as a whole; make it smaller, or write a .png"
            );
            io::Error::new(io::ErrorKind::OutOfMemory, words)
        })?;
        Ok(Self { out, kind, size, alpha, dpi, values })
    }

    /// Takes the next rows, which are of the picture's depth.
    pub fn push(&mut self, rows: Rows) -> io::Result<()> {
        let Self { size, alpha, .. } = *self;
        match (&mut self.values, rows) {
            (Values::Eight(to), Rows::Eight(pixels)) => take(to, pixels, size, alpha),
            (Values::Sixteen(to), Rows::Sixteen(pixels)) => take(to, pixels, size, alpha),
            (Values::Eight(_), Rows::Sixteen(_)) => Err(super::depth(false)),
            (Values::Sixteen(_), Rows::Eight(_)) => Err(super::depth(true)),
        }
    }

    /// Encodes and writes the picture, after all of its rows.
    pub fn finish(mut self) -> io::Result<()> {
        let row = self.size[0] as usize * if self.alpha { 4 } else { 3 };
        let missing = match &self.values {
            Values::Eight(values) => self.size[1] as usize - values.len() / row,
            Values::Sixteen(values) => self.size[1] as usize - values.len() / row,
        };
        if missing > 0 {
            return Err(invalid(format!("{missing} rows are missing")));
        }
        let bytes = match (self.kind, &self.values) {
            (Kind::Jpeg, Values::Eight(values)) => jpeg::encode(&self, values)?,
            (Kind::Webp, Values::Eight(values)) => webp::encode(&self, values)?,
            (Kind::Qoi, Values::Eight(values)) => qoi::encode(&self, values)?,
            (Kind::Tiff, values) => tiff::encode(&self, values)?,
            (kind, _) => return Err(super::unwritten(kind)),
        };
        self.out.write_all(&bytes)?;
        self.out.flush()
    }
}

/// No values yet, and memory for so many.
fn with_room<T>(count: usize) -> Option<Vec<T>> {
    let mut values = Vec::new();
    values.try_reserve_exact(count).ok()?;
    Some(values)
}

/// Adds rows to the values of a picture.
fn take<T: Copy>(
    to: &mut Vec<T>,
    pixels: &[[T; 4]],
    [width, height]: [u32; 2],
    alpha: bool,
) -> io::Result<()> {
    let channels = if alpha { 4 } else { 3 };
    let (width, height) = (width as usize, height as usize);
    if !pixels.len().is_multiple_of(width) {
        return Err(invalid(format!("{} pixels are no whole rows of {width}", pixels.len())));
    }
    let (rows, missing) = (pixels.len() / width, height - to.len() / channels / width);
    if rows > missing {
        return Err(invalid(format!("{rows} rows come where {missing} are missing")));
    }
    if alpha {
        to.extend_from_slice(pixels.as_flattened());
    } else {
        to.extend(pixels.iter().flat_map(|[red, green, blue, _]| [*red, *green, *blue]));
    }
    Ok(())
}
