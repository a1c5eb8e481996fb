//! The forms that pixels come in: sRGB of 8 bits a channel, of 16 bits, and linear light in floats.

use crate::{
    linear::{Encoder, WHITE},
    linear16::Encoder16,
    shaded::Linear,
};

/// Some samples of a pixel: the sum of their values, which are linear or encoded, and their number.
#[derive(Clone, Copy, Debug)]
pub struct Sum {
    /// Of each channel.
    pub sum: Linear,
    /// Samples whose values these are: 1 at least.
    pub count: u32,
    /// All of the pixel's samples.
    pub all: u32,
}

/// A form of pixels.
pub trait Form: Copy + Default + Send + Sync {
    /// What values are encoded with.
    type Tables<'t>: Copy + Sync;

    /// Takes the tables, of which one is there.
    fn tables(eight: &Encoder) -> Self::Tables<'_>;

    /// A linear value as it is averaged where encoded values are.
    fn encoded(tables: Self::Tables<'_>, value: u32) -> u32;

    /// The pixel of one linear colour that covers it.
    fn whole(tables: Self::Tables<'_>, color: Linear) -> Self;

    /// The pixel that shows nothing but a background, which has this colour and is seen through.
    fn clear(tables: Self::Tables<'_>, color: Linear) -> Self;

    /// The mean of linear values.
    fn mean(tables: Self::Tables<'_>, samples: Sum) -> Self;

    /// The mean of encoded values.
    fn mean_encoded(tables: Self::Tables<'_>, samples: Sum) -> Self;

    /// Pixels of 8 bits a channel, which can be drawn over; none of others.
    fn bytes(_: &mut [Self]) -> Option<&mut [[u8; 4]]> {
        None
    }
}

/// `most count / all`, rounded.
fn part(most: u32, Sum { count, all, .. }: Sum) -> u32 {
    (2 * most * count + all) / (2 * all)
}

/// The rounded mean of a sum.
fn rounded(sum: u32, count: u32) -> u32 {
    (2 * sum + count) / (2 * count)
}

/// sRGB and straight alpha, 8 bits each.
impl Form for [u8; 4] {
    type Tables<'t> = &'t Encoder;

    fn tables(eight: &Encoder) -> &Encoder {
        eight
    }

    fn bytes(pixels: &mut [Self]) -> Option<&mut [Self]> {
        Some(pixels)
    }

    #[inline(always)]
    fn encoded(tables: &Encoder, value: u32) -> u32 {
        tables.byte(value).into()
    }

    #[inline(always)]
    fn whole(tables: &Encoder, color: Linear) -> Self {
        let [r, g, b] = color.map(|value| tables.byte(value));
        [r, g, b, 255]
    }

    fn clear(tables: &Encoder, color: Linear) -> Self {
        let [r, g, b, _] = Self::whole(tables, color);
        [r, g, b, 0]
    }

    #[inline]
    fn mean(tables: &Encoder, samples: Sum) -> Self {
        let [r, g, b] = samples.sum.map(|sum| tables.mean(sum, samples.count));
        [r, g, b, part(255, samples) as u8]
    }

    #[inline]
    fn mean_encoded(_: &Encoder, samples: Sum) -> Self {
        let [r, g, b] = samples.sum.map(|sum| rounded(sum, samples.count) as u8);
        [r, g, b, part(255, samples) as u8]
    }
}

/// sRGB and straight alpha, 16 bits each.
impl Form for [u16; 4] {
    type Tables<'t> = &'static Encoder16;

    fn tables(_: &Encoder) -> &'static Encoder16 {
        Encoder16::get()
    }

    #[inline(always)]
    fn encoded(tables: &Encoder16, value: u32) -> u32 {
        tables.value(value).into()
    }

    #[inline(always)]
    fn whole(tables: &Encoder16, color: Linear) -> Self {
        let [r, g, b] = color.map(|value| tables.value(value));
        [r, g, b, u16::MAX]
    }

    fn clear(tables: &'static Encoder16, color: Linear) -> Self {
        let [r, g, b, _] = Self::whole(tables, color);
        [r, g, b, 0]
    }

    #[inline]
    fn mean(tables: &Encoder16, samples: Sum) -> Self {
        let [r, g, b] = samples.sum.map(|sum| tables.mean(sum, samples.count));
        [r, g, b, part(u16::MAX.into(), samples) as u16]
    }

    #[inline]
    fn mean_encoded(_: &Encoder16, samples: Sum) -> Self {
        let [r, g, b] = samples.sum.map(|sum| rounded(sum, samples.count) as u16);
        [r, g, b, part(u16::MAX.into(), samples) as u16]
    }
}

/// Linear light multiplied by alpha, and alpha, each rounded once. There are no encoded values:
/// means of these are those of linear ones.
impl Form for [f32; 4] {
    type Tables<'t> = ();

    fn tables(_: &Encoder) {}

    #[inline(always)]
    fn encoded((): (), value: u32) -> u32 {
        value
    }

    #[inline(always)]
    fn whole((): (), color: Linear) -> Self {
        let [r, g, b] = color.map(|value| value as f32 / WHITE as f32);
        [r, g, b, 1.0]
    }

    fn clear((): (), _: Linear) -> Self {
        [0.0; 4]
    }

    #[inline]
    fn mean((): (), Sum { sum, count, all }: Sum) -> Self {
        // Of up to 256 samples, all of these are below 2^24: floats hold them.
        let [r, g, b] = sum.map(|sum| sum as f32 / (WHITE * all) as f32);
        [r, g, b, count as f32 / all as f32]
    }

    #[inline]
    fn mean_encoded((): (), samples: Sum) -> Self {
        Self::mean((), samples)
    }
}
