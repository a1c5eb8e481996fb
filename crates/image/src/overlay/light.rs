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
//! The colour is the largest byte whose [`FROM`] is at most C. Where a is 0 the pixel stays as it
//! is; where a is 255 it becomes the source, opaque, byte for byte.

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

/// The byte of linear light: the largest whose threshold is not above it.
fn byte(light: u64) -> u8 {
    (FROM.partition_point(|&from| u64::from(from) <= light) - 1) as u8
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

/// Linear light of a byte of sRGB: round(65535 eotf(c / 255)).
pub const LIN: [u16; 256] = [
    0, 20, 40, 60, 80, 99, 119, 139, 159, 179, 199, 219, 241, 264, 288, 313, 340, 367, 396, 427,
    458, 491, 526, 562, 599, 637, 677, 718, 761, 805, 851, 898, 947, 997, 1048, 1101, 1156, 1212,
    1270, 1330, 1391, 1453, 1517, 1583, 1651, 1720, 1790, 1863, 1937, 2013, 2090, 2170, 2250, 2333,
    2418, 2504, 2592, 2681, 2773, 2866, 2961, 3058, 3157, 3258, 3360, 3464, 3570, 3678, 3788, 3900,
    4014, 4129, 4247, 4366, 4488, 4611, 4736, 4864, 4993, 5124, 5257, 5392, 5530, 5669, 5810, 5953,
    6099, 6246, 6395, 6547, 6700, 6856, 7014, 7174, 7335, 7500, 7666, 7834, 8004, 8177, 8352, 8528,
    8708, 8889, 9072, 9258, 9445, 9635, 9828, 10022, 10219, 10417, 10619, 10822, 11028, 11235,
    11446, 11658, 11873, 12090, 12309, 12530, 12754, 12980, 13209, 13440, 13673, 13909, 14146,
    14387, 14629, 14874, 15122, 15371, 15623, 15878, 16135, 16394, 16656, 16920, 17187, 17456,
    17727, 18001, 18277, 18556, 18837, 19121, 19407, 19696, 19987, 20281, 20577, 20876, 21177,
    21481, 21787, 22096, 22407, 22721, 23038, 23357, 23678, 24002, 24329, 24658, 24990, 25325,
    25662, 26001, 26344, 26688, 27036, 27386, 27739, 28094, 28452, 28813, 29176, 29542, 29911,
    30282, 30656, 31033, 31412, 31794, 32179, 32567, 32957, 33350, 33745, 34143, 34544, 34948,
    35355, 35764, 36176, 36591, 37008, 37429, 37852, 38278, 38706, 39138, 39572, 40009, 40449,
    40891, 41337, 41785, 42236, 42690, 43147, 43606, 44069, 44534, 45002, 45473, 45947, 46423,
    46903, 47385, 47871, 48359, 48850, 49344, 49841, 50341, 50844, 51349, 51858, 52369, 52884,
    53401, 53921, 54445, 54971, 55500, 56032, 56567, 57105, 57646, 58190, 58737, 59287, 59840,
    60396, 60955, 61517, 62082, 62650, 63221, 63795, 64372, 64952, 65535,
];

/// Where a byte of sRGB begins: ceil(65535 eotf((b - 1/2) / 255)), and 0 for 0.
const FROM: [u16; 256] = [
    0, 10, 30, 50, 70, 90, 110, 130, 150, 170, 189, 209, 230, 253, 276, 301, 327, 354, 382, 412,
    443, 475, 509, 544, 580, 618, 657, 698, 740, 783, 828, 875, 923, 972, 1023, 1075, 1129, 1185,
    1242, 1300, 1360, 1422, 1486, 1551, 1617, 1685, 1755, 1827, 1900, 1975, 2052, 2130, 2210, 2292,
    2376, 2461, 2548, 2637, 2727, 2820, 2914, 3010, 3108, 3208, 3309, 3412, 3518, 3625, 3734, 3844,
    3957, 4072, 4188, 4307, 4427, 4550, 4674, 4800, 4928, 5059, 5191, 5325, 5461, 5599, 5740, 5882,
    6026, 6173, 6321, 6471, 6624, 6778, 6935, 7094, 7255, 7418, 7583, 7750, 7919, 8091, 8265, 8440,
    8618, 8798, 8981, 9165, 9352, 9541, 9732, 9925, 10121, 10318, 10518, 10720, 10925, 11132,
    11341, 11552, 11765, 11981, 12199, 12420, 12643, 12868, 13095, 13325, 13557, 13791, 14028,
    14267, 14508, 14752, 14998, 15247, 15498, 15751, 16007, 16265, 16525, 16788, 17054, 17321,
    17592, 17864, 18139, 18417, 18697, 18980, 19264, 19552, 19842, 20134, 20429, 20727, 21027,
    21329, 21634, 21942, 22252, 22564, 22880, 23197, 23518, 23840, 24166, 24494, 24824, 25158,
    25493, 25832, 26173, 26516, 26862, 27211, 27563, 27917, 28273, 28633, 28995, 29359, 29727,
    30097, 30469, 30845, 31223, 31603, 31987, 32373, 32762, 33153, 33547, 33944, 34344, 34747,
    35152, 35560, 35970, 36384, 36800, 37219, 37640, 38065, 38492, 38922, 39355, 39790, 40229,
    40670, 41114, 41561, 42011, 42463, 42918, 43377, 43838, 44301, 44768, 45238, 45710, 46185,
    46663, 47144, 47628, 48115, 48605, 49097, 49593, 50091, 50592, 51096, 51604, 52114, 52627,
    53142, 53661, 54183, 54708, 55235, 55766, 56300, 56836, 57376, 57918, 58464, 59012, 59564,
    60118, 60675, 61236, 61799, 62366, 62935, 63508, 64083, 64662, 65244,
];

#[cfg(test)]
mod tests {
    use super::*;

    /// Linear light of an sRGB value from 0 to 1.
    fn eotf(c: f64) -> f64 {
        if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
    }

    #[test]
    fn tables_are_the_curve_of_srgb() {
        for byte in 0..256 {
            let c = byte as f64;
            assert_eq!(f64::from(LIN[byte]), (65_535.0 * eotf(c / 255.0)).round(), "{byte}");
            let from = (65_535.0 * eotf((c - 0.5) / 255.0)).ceil().max(0.0);
            assert_eq!(f64::from(FROM[byte]), from, "{byte}");
            assert_eq!(super::byte(u64::from(LIN[byte])), byte as u8);
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
