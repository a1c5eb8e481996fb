//! Rows of pixels as bands of bytes that are filtered and packed.
//!
//! Every row has the filter of Paeth: on shaded spheres it is the best of the five nearly always,
//! and a choice by row costs more time than it saves bytes.

use super::pack::pack;
use crate::{png::Bands, zlib::Adler};

/// The number of Paeth's filter.
const PAETH: u8 = 4;

/// A channel's value.
pub(in crate::picture) trait Channel: Copy + Sync + 'static {
    /// Adds pixels as they lie in a row of a file.
    fn bytes(row: &[[Self; 4]], alpha: bool, out: &mut Vec<u8>);
    /// Its bytes.
    const BYTES: usize = size_of::<Self>();
}

impl Channel for u8 {
    fn bytes(row: &[[u8; 4]], alpha: bool, out: &mut Vec<u8>) {
        if alpha {
            out.extend_from_slice(row.as_flattened());
        } else {
            let begin = out.len();
            out.resize(begin + 3 * row.len(), 0);
            for (out, [red, green, blue, _]) in
                out[begin..].as_chunks_mut::<3>().0.iter_mut().zip(row)
            {
                *out = [*red, *green, *blue];
            }
        }
    }
}

impl Channel for u16 {
    fn bytes(row: &[[u16; 4]], alpha: bool, out: &mut Vec<u8>) {
        let channels = if alpha { 4 } else { 3 };
        for pixel in row {
            out.extend(pixel[..channels].iter().flat_map(|value| value.to_be_bytes()));
        }
    }
}

/// How pixels are compressed: with their alpha, or without.
pub(in crate::picture) struct Filtered<T> {
    pub alpha: bool,
    pub of: std::marker::PhantomData<T>,
}

impl<T: Channel> Bands for Filtered<T> {
    type Pixel = [T; 4];

    fn compress(&self, above: &[[T; 4]], rows: &[[T; 4]], width: usize) -> (Vec<u8>, Adler) {
        // Before each row there is a pixel of zeros, and above the first row there are zeros.
        let pixel = T::BYTES * if self.alpha { 4 } else { 3 };
        let row_bytes = pixel * width;
        let laid = |row: &[[T; 4]], out: &mut Vec<u8>| {
            out.clear();
            out.resize(pixel, 0);
            T::bytes(row, self.alpha, out);
            out.resize(pixel + row_bytes, 0);
        };
        let (mut before, mut current) = (Vec::new(), Vec::new());
        laid(above, &mut before);
        let mut filtered = vec![0; rows.len() / width * (1 + row_bytes)];
        for (row, out) in rows.chunks_exact(width).zip(filtered.chunks_exact_mut(1 + row_bytes)) {
            laid(row, &mut current);
            out[0] = PAETH;
            filter(&mut out[1..], &current, &before, pixel);
            std::mem::swap(&mut before, &mut current);
        }
        (pack(&filtered), Adler::of(&filtered))
    }
}

/// What each byte of a row differs from what is expected by the one before it, the one above, and
/// the one before that. Both rows begin with a pixel of zeros.
fn filter(out: &mut [u8], row: &[u8], above: &[u8], pixel: usize) {
    let count = out.len();
    let (bytes, up) = (&row[pixel..][..count], &above[pixel..][..count]);
    let (left, corner) = (&row[..count], &above[..count]);
    for k in 0..count {
        out[k] = bytes[k].wrapping_sub(expected(left[k], up[k], corner[k]));
    }
}

/// Paeth's predictor: of the three the one nearest to `left + up - corner`.
fn expected(left: u8, up: u8, corner: u8) -> u8 {
    let [a, b, c] = [left, up, corner].map(i16::from);
    let [from_left, from_up, from_corner] = [b - c, a - c, a + b - 2 * c].map(i16::abs);
    let (other, least) = if from_up <= from_corner { (up, from_up) } else { (corner, from_corner) };
    if from_left <= least { left } else { other }
}
