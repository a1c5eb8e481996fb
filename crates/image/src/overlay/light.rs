//! Colours over colours, in linear light and in integers.
//!
//! A source of colour s and coverage a (0 to 255) is laid over a pixel of colour d and alpha b,
//! both straight. With S and D, which are s and d in linear light from 0 to 65535:
//!
//! ```text
//! A     = 255 a + b (255 - a)                               from 0 to 65025
//! alpha = floor((A + 127) / 255)
//! C     = floor((255 a S + b (255 - a) D + floor(A / 2)) / A)
//! ```
//!
//! The colour is the largest byte that begins at C or below. Where a is 0 the pixel stays as it
//! is; where a is 255 it becomes the source, opaque, byte for byte.

use crate::linear::{LIN, edge};

/// The largest alpha, and the largest coverage.
const WHOLE: u32 = 255;

/// Lays a colour over a pixel (sRGB, straight alpha) that it covers in part, of 255.
pub fn over(pixel: &mut [u8; 4], color: [u8; 3], cover: u8) {
    if cover == 0 {
        return;
    }
    let source = WHOLE * u32::from(cover);
    let behind = u32::from(pixel[3]) * (WHOLE - u32::from(cover));
    let whole = source + behind;
    for channel in 0..3 {
        let [s, d] = [color[channel], pixel[channel]].map(|byte| u64::from(LIN[usize::from(byte)]));
        let sum = u64::from(source) * s + u64::from(behind) * d;
        pixel[channel] = byte((sum + u64::from(whole / 2)) / u64::from(whole));
    }
    pixel[3] = ((whole + WHOLE / 2) / WHOLE) as u8;
}

/// The byte of linear light: the largest that does not begin above it. It is found bit by bit.
fn byte(light: u64) -> u8 {
    (0..8).rev().fold(0, |byte, bit| {
        let more = byte | 1 << bit;
        if u64::from(edge(more, 1)) <= light { more } else { byte }
    })
}

/// Coverage of black letters: larger, so that from black to white the bytes are even, not the
/// light. Black that fades evenly in light looks thinner than white that does.
///
/// `255 - floor((255 LIN[255 - cover] + 32767) / 65535)`; nothing stays nothing, and all all.
pub fn darker(cover: u8) -> u8 {
    let light = u32::from(LIN[usize::from(255 - cover)]);
    255 - ((255 * light + 32_767) / 65_535) as u8
}

/// Whether white is easier to read on a colour than black: its contrast with it is larger, by the
/// definition of WCAG 2: (Y1 + 0.05) / (Y2 + 0.05) of luminances.
pub fn wants_white(color: [u8; 3]) -> bool {
    // Luminance of sRGB's primaries, in ten thousandths.
    let parts = color.iter().zip([2126, 7152, 722]);
    let light: u64 = parts.map(|(&byte, part)| u64::from(LIN[usize::from(byte)]) * part).sum();
    // The square root of 1.05 x 0.05, less 0.05.
    light * 1000 < 179 * 65_535 * 10_000
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Linear light of an sRGB value from 0 to 1.
    fn eotf(c: f64) -> f64 {
        if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
    }

    #[test]
    fn bytes_begin_at_their_edges() {
        for byte in 0..=255 {
            let from = u64::from(edge(byte, 1));
            assert_eq!(
                (super::byte(from), super::byte(u64::from(LIN[usize::from(byte)]))),
                (byte, byte)
            );
            assert!(byte == 0 || super::byte(from - 1) == byte - 1, "{byte}");
        }
        assert_eq!((super::byte(0), super::byte(65_535)), (0, 255));
    }

    #[test]
    fn all_and_nothing_are_exact() {
        for byte in 0..=255 {
            let color = [byte, 255 - byte, byte / 2];
            for alpha in [0, 1, 128, 255] {
                let mut pixel = [7, 8, 9, alpha];
                over(&mut pixel, color, 0);
                assert_eq!(pixel, [7, 8, 9, alpha]);
                over(&mut pixel, color, 255);
                assert_eq!(pixel, [color[0], color[1], color[2], 255]);
            }
        }
    }

    #[test]
    fn nothing_behind_gives_the_colour_itself() {
        for cover in 1..=255 {
            let mut pixel = [200, 0, 90, 0];
            over(&mut pixel, [10, 130, 250], cover);
            assert_eq!(pixel, [10, 130, 250, cover], "the hidden colour has no part in it");
        }
    }

    #[test]
    fn alphas_join_and_colours_mix_by_weight() {
        // Half of half: the pixel is covered to three quarters, two thirds of it the source.
        let mut pixel = [0, 0, 0, 128];
        over(&mut pixel, [255, 255, 255], 128);
        assert_eq!(pixel[3], 192);
        let expected = 128.0 * 255.0 / (128.0 * 255.0 + 128.0 * 127.0);
        let found = eotf(f64::from(pixel[0]) / 255.0);
        assert!((found - expected).abs() < 0.005, "{found} for {expected}");
        // White over black by half is half the light, not half the byte.
        let mut pixel = [0, 0, 0, 255];
        over(&mut pixel, [255, 255, 255], 128);
        assert_eq!(pixel, [188, 188, 188, 255]);
        // A colour over itself stays, whatever the cover.
        for cover in 0..=255 {
            let mut pixel = [12, 34, 56, 255];
            over(&mut pixel, [12, 34, 56], cover);
            assert_eq!(pixel, [12, 34, 56, 255]);
        }
    }

    #[test]
    fn black_letters_grow() {
        assert_eq!((darker(0), darker(255)), (0, 255));
        for cover in 0..=255_u8 {
            assert!(darker(cover) >= cover);
            let mut pixel = [255; 4];
            over(&mut pixel, [0; 3], darker(cover));
            // Near black a step of coverage is many bytes.
            let most = if cover < 200 { 2 } else { 13 };
            assert!(pixel[0].abs_diff(255 - cover) <= most, "{cover}: {pixel:?}");
        }
    }

    #[test]
    fn text_has_the_larger_contrast() {
        assert!(wants_white([0, 0, 0]) && wants_white([60, 60, 60]) && wants_white([0, 0, 255]));
        assert!(!wants_white([255; 3]) && !wants_white([130; 3]) && !wants_white([0, 255, 0]));
    }
}
