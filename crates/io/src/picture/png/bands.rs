//! Rows of pixels as bands of bytes that are filtered and packed.
//!
//! Every row has the filter of Paeth: on shaded spheres it is the best of the five nearly always,
//! and a choice by row costs more time than it saves bytes. But small spheres of few colours repeat
//! whole pixels, which filters hide. So some rows of each band are tried as runs of one colour,
//! too.

use super::pack::pack;
use crate::{
    png::{Bands, as_runs},
    zlib::Adler,
};

/// Of so many rows one is tried as runs of one colour.
const SAMPLE: usize = 16;

/// The number of Paeth's filter.
const PAETH: u8 = 4;

/// A channel's value.
pub(in crate::picture) trait Channel: Copy + Sync + 'static {
    /// Adds pixels as they lie in a row of a file.
    fn bytes(row: &[[Self; 4]], alpha: bool, out: &mut Vec<u8>);
    /// Some rows without alpha as runs of one colour; `None` where that is never worth a try.
    fn as_runs(_rows: &[[Self; 4]], _width: usize) -> Option<(Vec<u8>, Adler)> {
        None
    }
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

    fn as_runs(rows: &[[u8; 4]], width: usize) -> Option<(Vec<u8>, Adler)> {
        Some(as_runs(rows, width))
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
        if !self.alpha
            && self.are_runs(rows, width)
            && let Some(runs) = T::as_runs(rows, width)
        {
            return runs;
        }
        self.filtered(above, rows, width)
    }
}

impl<T: Channel> Filtered<T> {
    /// Whether some rows in the middle are shorter as runs of one colour.
    fn are_runs(&self, rows: &[[T; 4]], width: usize) -> bool {
        let count = rows.len() / width;
        let first = count / 2;
        let some = &rows[first * width..(first + count.div_ceil(SAMPLE)) * width];
        let above = &rows[first.saturating_sub(1) * width..first * width];
        T::as_runs(some, width)
            .is_some_and(|(runs, _)| runs.len() < self.filtered(above, some, width).0.len())
    }

    /// Some rows as one band, below another row or none.
    fn filtered(&self, above: &[[T; 4]], rows: &[[T; 4]], width: usize) -> (Vec<u8>, Adler) {
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

#[cfg(test)]
mod tests {
    use std::marker::PhantomData;

    use super::*;
    use crate::zlib::unpacked;

    #[test]
    fn each_band_is_written_in_the_shorter_way() {
        let random = crate::make::Random { seed: 3 };
        let opaque = Filtered::<u8> { alpha: false, of: PhantomData };
        let width = 200;
        // Few colours in no order, and even slopes.
        let few = |k: u64| [1, 2, 3].map(|c| (random.bits(random.bits(k / 3) % 9) >> c) as u8);
        let slope = |k: u64| [k % 200, k / 200, k % 200 / 2 + k / 200].map(|value| value as u8);
        for (are_runs, color) in [(true, &few as &dyn Fn(u64) -> [u8; 3]), (false, &slope)] {
            let pixels: Vec<[u8; 4]> = (0..200 * 40)
                .map(|k| {
                    let [red, green, blue] = color(k);
                    [red, green, blue, k as u8]
                })
                .collect();
            assert_eq!(opaque.are_runs(&pixels, width), are_runs);
            let (packed, adler) = opaque.compress(&[], &pixels, width);
            let bytes = unpacked(&packed);
            assert_eq!(adler, Adler::of(&bytes));
            assert!(bytes.chunks(601).all(|row| row[0] == if are_runs { 0 } else { PAETH }));
            let filtered = opaque.filtered(&[], &pixels, width).0;
            let runs = as_runs(&pixels, width).0;
            assert_eq!(packed.len(), filtered.len().min(runs.len()));
        }
    }

    /// The predictor as the standard (9.4) writes it.
    #[test]
    fn the_filter_is_that_of_the_standard() {
        let standard = |a: u8, b: u8, c: u8| {
            let [a, b, c] = [a, b, c].map(i32::from);
            let p = a + b - c;
            let [pa, pb, pc] = [a, b, c].map(|value| (p - value).abs());
            (if pa <= pb && pa <= pc {
                a
            } else if pb <= pc {
                b
            } else {
                c
            }) as u8
        };
        for a in 0..=255 {
            for b in 0..=255 {
                for c in (0..=255).step_by(3) {
                    assert_eq!(expected(a, b, c), standard(a, b, c), "{a} {b} {c}");
                }
            }
        }
    }
}
