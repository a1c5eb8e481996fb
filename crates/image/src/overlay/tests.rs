//! What is drawn: colours, lengths, places and bytes.

use std::{f64::consts::FRAC_1_SQRT_2, path::Path};

use super::{
    Axes, Laid, Legend, Overlay, OverlayError, ScaleBar, block::Style, layout::layout, legend,
    light::darker,
};
use crate::{
    linear::LIN,
    maps::{self, Map},
};

/// Looking along -z, y up.
const FLAT: Axes = Axes { right: [1.0, 0.0, 0.0], up: [0.0, 1.0, 0.0], back: [0.0, 0.0, 1.0] };

/// Turned by an eighth about y.
const TURNED: Axes = Axes {
    right: [FRAC_1_SQRT_2, 0.0, -FRAC_1_SQRT_2],
    up: [0.0, 1.0, 0.0],
    back: [FRAC_1_SQRT_2, 0.0, FRAC_1_SQRT_2],
};

fn bar(range: [f64; 2], label: &str) -> Option<Legend> {
    Some(Legend::Bar { map: Map::VIRIDIS, range, label: label.into() })
}

fn keys(names: &[&str]) -> Option<Legend> {
    let key =
        |(index, name): (usize, &&str)| ((*name).to_owned(), Map::TAB10.category(index as u64));
    Some(Legend::Keys(names.iter().enumerate().map(key).collect()))
}

fn scale_bar(length: Option<f64>, pixels_per_unit: f64, unit: &str) -> Option<ScaleBar> {
    Some(ScaleBar { length, pixels_per_unit, unit: Some(unit.into()) })
}

/// Everything at once, on black.
fn all() -> Overlay {
    Overlay {
        title: Some("Shear flow, t = 12.5 ps".into()),
        legend: bar([-0.0012, 3.1], "velocity (Å/ps)"),
        scale_bar: scale_bar(None, 20.0, "Å"),
        axes: Some(TURNED),
        background: [0; 3],
    }
}

/// Overlays of many kinds.
fn many() -> Vec<Overlay> {
    let on = |background| Overlay { background, ..Overlay::default() };
    vec![
        all(),
        Overlay { legend: keys(&["H", "C", "Oxygen"]), background: [255; 3], ..all() },
        Overlay { title: Some("Ängström: ρ(r)".into()), ..on([255; 3]) },
        Overlay { legend: bar([0.0, 1.0], ""), ..on([0; 3]) },
        Overlay { legend: bar([0.0, 3.2e-7], "p (Pa)"), ..on([255; 3]) },
        Overlay { legend: bar([5.0, 5.0], "n"), ..on([0; 3]) },
        Overlay { legend: keys(&["type 1", "type 2"]), axes: Some(FLAT), ..on([128; 3]) },
        Overlay { scale_bar: scale_bar(Some(1.25), 30.1, "µm"), ..on([0; 3]) },
        Overlay { scale_bar: scale_bar(None, 1e-9, "m"), axes: Some(TURNED), ..on([0; 3]) },
        Overlay { axes: Some(TURNED), title: Some("g".into()), ..on([255; 3]) },
    ]
}

/// A picture with something in it.
fn picture([width, height]: [u32; 2]) -> Vec<[u8; 4]> {
    let pixel = |index: u32| {
        let [x, y] = [index % width, index / width].map(|place| (place % 251) as u8);
        [x, y, x ^ y, if (x / 16 + y / 16) % 3 == 0 { 0 } else { 255 - x / 8 }]
    };
    (0..width * height).map(pixel).collect()
}

fn fnv(bytes: &[u8]) -> u64 {
    let mix = |hash: u64, byte: &u8| (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, mix)
}

#[test]
fn a_bar_has_the_colours_of_its_values() {
    for (map, range, size) in [
        (Map::VIRIDIS, [0.0, 1.0], [1024, 1024]),
        (Map::ALL[7], [-273.15, 12.0], [640, 480]),
        (Map::ALL[5], [f64::MIN, f64::MAX], [300, 2000]),
        (Map::ALL[2], [1e-9, 2e-9], [120, 120]),
        (Map::TAB10, [0.0, 10.0], [400, 400]),
        (Map::VIRIDIS, [4.0, 4.0], [400, 400]),
    ] {
        let legend = Some(Legend::Bar { map, range, label: "v".into() });
        let overlay = Overlay { legend, ..Overlay::default() };
        let blocks = layout(&overlay, size).unwrap().blocks;
        let rows = blocks.into_iter().find_map(|(block, _)| block.rows).expect("a bar");
        let mut pixels = picture(size);
        overlay.draw(size, &mut pixels).unwrap();
        let count = rows.colors.len();
        for row in 0..count {
            // The value in the middle of the row, by the rule that colours spheres.
            let part = 1.0 - (row as f64 + 0.5) / count as f64;
            let value = range[0] * (1.0 - part) + range[1] * part;
            let place = maps::place(value, range);
            // Where one colour ends and the next begins, the value is rounded to one of them.
            let near = [place, place - 1e-12, place + 1e-12].map(|place| map.color(place).unwrap());
            for column in 0..rows.width {
                let [x, y] = [rows.at[0] as usize + column, rows.at[1] as usize + row];
                let [red, green, blue, alpha] = pixels[y * size[0] as usize + x];
                assert_eq!(alpha, 255);
                assert!(near.contains(&[red, green, blue]), "{map:?} {range:?} {row}");
            }
        }
        // All of them, where there are rows enough.
        let mut found = legend::colors(map, range, 2560);
        found.dedup();
        let colors =
            if range[0] == range[1] { 1 } else { if map == Map::TAB10 { 10 } else { 250 } };
        assert!(found.len() >= colors, "{} colours of {map:?}", found.len());
    }
}

#[test]
fn ticks_are_at_the_colours_of_their_numbers() {
    let size = [1024, 1024];
    let overlay = Overlay { legend: bar([0.0, 10.0], ""), ..Overlay::default() };
    let mut pixels = vec![[0, 0, 0, 255]; 1024 * 1024];
    overlay.draw(size, &mut pixels).unwrap();
    let blocks = layout(&overlay, size).unwrap().blocks;
    let rows = blocks.into_iter().find_map(|(block, _)| block.rows).expect("a bar");
    let style = Style::new(size, true);
    // Right of the frame: white where a tick is.
    let column = rows.at[0] as usize + rows.width + style.thin() as usize + 1;
    let ticks: Vec<i64> =
        (0..1024).filter(|y| pixels[*y as usize * 1024 + column] == [255; 4]).collect();
    let height = rows.colors.len() as f64;
    let mut expected = Vec::new();
    for value in [10.0, 8.0, 6.0, 4.0, 2.0, 0.0] {
        let y = rows.at[1] as f64 + height * (1.0 - value / 10.0);
        let first = (y - 0.5 * style.thin()).round() as i64;
        expected.extend(first..first + style.thin() as i64);
    }
    assert_eq!(ticks, expected);
}

#[test]
fn nothing_overlaps_and_nothing_leaves_the_picture() {
    let sizes =
        [64, 65, 80, 96, 100, 128, 200, 255, 256, 400, 432, 433, 512, 777, 1024, 2048, 4096];
    let (mut fit, mut drawn) = (0, 0);
    for overlay in many() {
        for size in sizes.iter().flat_map(|&a| [[a, a], [a, 64], [64, a], [a, a * 9 / 16 + 30]]) {
            let regions = match overlay.regions(size) {
                Ok(regions) => regions,
                Err(OverlayError::TooSmall { least, .. }) => {
                    assert!(least[0] >= size[0] && least[1] >= size[1], "{size:?}: {least:?}");
                    continue;
                }
                Err(OverlayError::LengthInPixels { .. } | OverlayError::NoRoom { .. })
                    if size[0] < 200 || size[1] < 200 =>
                {
                    continue;
                }
                Err(error) => panic!("{size:?}: {error}"),
            };
            fit += 1;
            for (index, &[x, y, w, h]) in regions.iter().enumerate() {
                assert!(x + w <= size[0] && y + h <= size[1] && w > 0 && h > 0, "{size:?}");
                for &[x2, y2, w2, h2] in &regions[..index] {
                    let apart = x + w <= x2 || x2 + w2 <= x || y + h <= y2 || y2 + h2 <= y;
                    assert!(apart, "{size:?}: {regions:?}");
                }
            }
            if size[0] * size[1] > 600_000 {
                continue;
            }
            drawn += 1;
            let (before, mut after) = (picture(size), picture(size));
            overlay.draw(size, &mut after).unwrap();
            for (index, _) in before.iter().zip(&after).enumerate().filter(|(_, (a, b))| a != b) {
                let [i, j] = [index as u32 % size[0], index as u32 / size[0]];
                let inside =
                    |&[x, y, w, h]: &[u32; 4]| (x..x + w).contains(&i) && (y..y + h).contains(&j);
                assert!(
                    regions.iter().any(inside),
                    "{size:?}: ({i}, {j}) is outside of {regions:?}"
                );
            }
        }
    }
    assert!(fit > 400 && drawn > 200, "{fit} layouts, {drawn} drawn");
}

#[test]
fn each_part_alone_has_room_in_64_pixels() {
    let none = Overlay::default();
    for overlay in [
        Overlay { title: Some("Cells".into()), ..none.clone() },
        Overlay { legend: bar([0.0, 1.0], ""), ..none.clone() },
        Overlay { legend: bar([0.0, 3.0], ""), ..none.clone() },
        Overlay { legend: keys(&["H", "C", "O"]), ..none.clone() },
        Overlay { scale_bar: scale_bar(None, 3.0, "Å"), ..none.clone() },
        Overlay { axes: Some(TURNED), ..none.clone() },
        none,
    ] {
        overlay.regions([64, 64]).unwrap_or_else(|error| panic!("{overlay:?}: {error}"));
    }
}

#[test]
fn a_picture_of_twice_the_size_looks_the_same() {
    for overlay in many() {
        let mut larger = overlay.clone();
        if let Some(bar) = &mut larger.scale_bar {
            bar.pixels_per_unit *= 4.0;
        }
        let small = overlay.regions([1024, 768]).unwrap();
        let large = larger.regions([4096, 3072]).unwrap();
        assert_eq!(small.len(), large.len());
        for (small, large) in small.iter().zip(&large) {
            for (small, large) in small.iter().zip(large) {
                let off = (f64::from(*large) / 4.0 - f64::from(*small)).abs();
                assert!(off <= 6.0, "{small} and {large}");
            }
        }
    }
}

#[test]
fn the_least_size_is_enough_and_a_smaller_one_is_not() {
    let overlay = all();
    let Err(OverlayError::TooSmall { least: [width, height], .. }) = overlay.regions([64, 64])
    else {
        panic!("{:?}", overlay.regions([64, 64]));
    };
    let of = |side: u32| {
        // The same picture: the world is as wide.
        let pixels_per_unit = 20.0 * f64::from(side) / 64.0;
        let scale_bar = scale_bar(None, pixels_per_unit, "Å");
        Overlay { scale_bar, ..all() }.regions([side, side])
    };
    assert_eq!(width, height);
    assert!(of(width).is_ok());
    assert!((64..width).all(|side| of(side).is_err()), "{width}");
}

#[test]
fn a_scale_bar_is_as_long_as_it_says() {
    for (pixels, size) in [(100.0, 512), (33.3, 512), (77.77, 1024), (7.25, 300), (200.9, 4096)] {
        let scale_bar = scale_bar(Some(2.5), pixels / 2.5, "nm");
        let overlay = Overlay { scale_bar, ..Overlay::default() };
        let mut picture = vec![[0, 0, 0, 255]; size * 600];
        overlay.draw([size as u32, 600], &mut picture).unwrap();
        // White over black, in the middle row of the bar.
        let row = 600 - Style::new([size as u32, 600], true).margin as usize - 2;
        let light = picture[row * size..][..size].iter().map(|[red, ..]| LIN[usize::from(*red)]);
        let length = light.map(f64::from).sum::<f64>() / 65_535.0;
        assert!((length - pixels).abs() < 0.01, "{length} for {pixels}");
    }
}

#[test]
fn the_length_of_a_scale_bar_is_chosen() {
    for (size, scale, length) in [
        (1024, 20.0, 10.0),
        (1024, 1.0, 200.0),
        (64, 3.0, 5.0),
        (500, 1e-9, 1e11),
        (800, 3e12, 5e-11),
    ] {
        let style = Style::new([size, size], true);
        let bar = ScaleBar { length: None, pixels_per_unit: scale, unit: None };
        let [found, pixels] = bar.length(&style).unwrap();
        assert_eq!((found, pixels), (length, length * scale));
        let part = pixels / f64::from(size);
        assert!((0.12..=0.32).contains(&part), "{part} of the width");
    }
}

#[test]
fn letters_of_axes_stay_in_their_square() {
    let mut state = 7_u64;
    let mut random = || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / (1_u64 << 30) as f64 - 1.0
    };
    for round in 0..2000 {
        // A turn by a quaternion; the first ones are quarter turns.
        let whole = |digit: i32| f64::from(round / digit % 3 - 1);
        let q = if round < 81 { [1, 3, 9, 27].map(whole) } else { [0.0; 4].map(|_| random()) };
        let length = q.iter().map(|part| part * part).sum::<f64>().sqrt();
        if length == 0.0 {
            continue;
        }
        let [w, x, y, z] = q.map(|part| part / length);
        let axes = Axes {
            right: [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)],
            up: [2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x)],
            back: [2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)],
        };
        let overlay = Overlay { axes: Some(axes), ..Overlay::default() };
        for size in [64, 1024] {
            let regions = overlay.regions([size, size]).unwrap_or_else(|e| panic!("{axes:?}: {e}"));
            let side = (5.3 * (f64::from(size) / 28.0).max(12.0)).ceil() as u32;
            let [_, _, width, height] = regions[0];
            assert!(width <= side && height <= side + 1, "{axes:?}: {regions:?}");
        }
    }
}

#[test]
fn nearer_axes_lie_over_farther_ones() {
    // z comes towards the eye, and ends over where the others begin; turned around, it is behind.
    let size = [512, 512];
    let color = |axes: Axes| {
        let overlay = Overlay { axes: Some(axes), background: [0; 3], ..Overlay::default() };
        let mut pixels = vec![[0, 0, 0, 255]; 512 * 512];
        overlay.draw(size, &mut pixels).unwrap();
        let half = 2.65 * 512.0 / 28.0;
        pixels[(512.0 - half) as usize * 512 + half as usize]
    };
    assert_eq!(color(FLAT), [62, 123, 250, 255]);
    let behind = Axes { up: [0.0, -1.0, 0.0], back: [0.0, 0.0, -1.0], ..FLAT };
    assert_ne!(color(behind), [62, 123, 250, 255]);
}

#[test]
fn letters_lie_on_nothing_as_they_should() {
    // On transparent pixels, ink and halo alone: no hidden colour comes through.
    let size = [400, 300];
    let title = Some("Transparent".into());
    let overlay = Overlay { title, background: [255; 3], ..Overlay::default() };
    let mut drawn = Vec::new();
    for hidden in [[255, 0, 0, 0], [0, 0, 0, 0], [255, 255, 255, 0]] {
        let mut pixels = vec![hidden; 400 * 300];
        overlay.draw(size, &mut pixels).unwrap();
        assert!(pixels.iter().all(|pixel| pixel[3] != 0 || *pixel == hidden));
        pixels.retain(|pixel| pixel[3] > 0);
        assert!(pixels.iter().all(|[r, g, b, _]| r == g && g == b), "black and white alone");
        assert!(pixels.contains(&[0, 0, 0, 255]) && pixels.iter().any(|p| p[3] == 185));
        drawn.push(pixels);
    }
    assert!(drawn[0] == drawn[1] && drawn[1] == drawn[2]);
    // Laid over white it looks as drawn over white, but for what 8 bits cannot hold.
    let (mut clear, mut white) = (vec![[0; 4]; 400 * 300], vec![[255; 4]; 400 * 300]);
    overlay.draw(size, &mut clear).unwrap();
    overlay.draw(size, &mut white).unwrap();
    for (clear, white) in clear.iter().zip(&white) {
        let [light, behind] = [LIN[usize::from(clear[0])], 65_535].map(f64::from);
        let alpha = f64::from(clear[3]) / 255.0;
        let over = light * alpha + behind * (1.0 - alpha);
        assert!(
            (over - f64::from(LIN[usize::from(white[0])])).abs() < 800.0,
            "{clear:?} {white:?}"
        );
    }
    assert_eq!(darker(0), 0);
}

#[test]
fn rows_in_pieces_have_the_bytes_of_the_whole() {
    let size = [320, 240];
    for overlay in many() {
        let mut whole = picture(size);
        overlay.draw(size, &mut whole).unwrap();
        let laid: Laid = overlay.lay(size).unwrap();
        assert_eq!(laid.regions(), overlay.regions(size).unwrap());
        for rows in [1, 7, 64, 240] {
            let mut pieces = picture(size);
            for (index, piece) in pieces.chunks_mut(rows * 320).enumerate() {
                laid.onto((index * rows) as u32, piece).unwrap();
            }
            assert!(pieces == whole, "{rows} rows at a time");
        }
    }
}

#[test]
fn bytes_are_the_same_everywhere() {
    // Of `many()` over `picture()`, in order, of 320 x 240 and of 1000 x 700 pixels. They were
    // looked at before they were written down. Another value on another machine is a defect; after
    // a change that is meant, look at what is written into the folder PLANISPHERE_OVERLAYS, and put
    // it here.
    let hashes: Vec<[u64; 2]> = many()
        .iter()
        .map(|overlay| {
            [[320, 240], [1000, 700]].map(|size| {
                let mut pixels = picture(size);
                overlay.draw(size, &mut pixels).unwrap();
                show(&pixels, size);
                fnv(pixels.as_flattened())
            })
        })
        .collect();
    assert_eq!(hashes, GOLDEN, "{hashes:#x?}");
}

/// Writes a picture into the folder that the environment names, if it names one, to be looked at.
fn show(pixels: &[[u8; 4]], [width, height]: [u32; 2]) {
    if let Some(folder) = std::env::var_os("PLANISPHERE_OVERLAYS") {
        let bytes = pixels.as_flattened();
        let path = Path::new(&folder).join(format!("{:016x}.png", fnv(bytes)));
        image::save_buffer(path, bytes, width, height, image::ColorType::Rgba8).expect("a file");
    }
}

/// Hashes (FNV-1a of 64 bits) of pixels.
const GOLDEN: [[u64; 2]; 10] = [
    [0xe8d3_11e7_42ce_2a31, 0x3459_06e7_39c1_265f],
    [0x66f8_fc36_99aa_1dbe, 0xa0a8_d243_72ac_a21c],
    [0x07cf_4c2a_cda7_73b4, 0xcaa9_f5e4_7ef4_41aa],
    [0x74b0_3245_1365_4b5d, 0x15e5_0b87_085f_bc40],
    [0xe9c1_0f71_2d4f_e96d, 0x1625_1317_0748_fe7c],
    [0x656b_320d_6c49_1b5a, 0xc89c_57f6_281a_289f],
    [0x16dc_5e8c_dc97_c866, 0x5fa3_1095_a6c2_d001],
    [0xdca6_7c3e_b3d4_c994, 0x080c_e528_1739_a89e],
    [0x2215_1b1a_328c_83f3, 0xa8f9_334a_4efd_7799],
    [0x4ea0_9be7_c399_c26d, 0x8af9_5452_311b_b0eb],
];

/// The error of an overlay in a picture of 512 x 512 pixels.
fn refused(overlay: &Overlay) -> String {
    overlay.regions([512, 512]).expect_err("an error").to_string()
}

#[test]
fn what_has_no_meaning_is_refused() {
    let none = Overlay::default();
    let title = |title: &str| refused(&Overlay { title: Some(title.into()), ..none.clone() });
    assert_eq!(
        title("原子 1"),
        "the title \"原子 1\" has the character '原' (U+539F), which the font does not have; it has \
         Latin, Greek and Cyrillic letters, digits, and signs of units"
    );
    assert!(title("two\nlines").contains(r"'\n' (U+000A)"));
    assert!(title(" ").contains("in which no letter is"));
    assert!(title(&"long ".repeat(60)).contains("nor has a larger one of this shape"));
    let legend = |legend| refused(&Overlay { legend, ..none.clone() });
    for range in [[1.0, 0.0], [f64::NAN, 1.0], [0.0, f64::INFINITY]] {
        assert!(legend(bar(range, "")).contains("give two finite numbers, the lower one first"));
    }
    assert!(legend(keys(&[])).contains("no entries"));
    assert!(legend(keys(&["C", ""])).contains("the legend has the text \"\""));
    assert!(legend(keys(&["a"; 100_000])).contains("no room for the legend"));
    let length = |length, scale| {
        refused(&Overlay { scale_bar: scale_bar(length, scale, "Å"), ..none.clone() })
    };
    assert!(length(None, 0.0).contains("has 0 pixels a unit"));
    assert!(length(None, f64::NAN).contains("give a positive number"));
    assert!(length(Some(-1.0), 1.0).contains("the length -1; give a positive number"));
    assert_eq!(
        length(Some(500.0), 2.0),
        "the scale bar of the length 500 is 1000 pixels long; give a length from 1 to 247, for \
         which there is room"
    );
    assert!(length(Some(0.5), 2.0).contains("give a length from 1 to 247"));
    for (right, up) in [([2.0, 0.0, 0.0], FLAT.up), (FLAT.up, FLAT.up), (FLAT.right, [f64::NAN; 3])]
    {
        let axes = Some(Axes { right, up, ..FLAT });
        assert!(refused(&Overlay { axes, ..none.clone() }).contains("not those of a camera"));
    }
    let axes = Some(Axes { back: [0.0, 0.0, -1.0], ..FLAT });
    assert!(refused(&Overlay { axes, ..none }).contains("right x up is back"));
}

#[test]
fn pixels_must_be_those_of_the_picture() {
    let overlay = Overlay { title: Some("t".into()), ..Overlay::default() };
    let mut pixels = vec![[0; 4]; 100 * 99];
    let error = overlay.draw([100, 100], &mut pixels).unwrap_err();
    assert_eq!(error, OverlayError::Pixels { found: 9900, width: 100, height: 100, first: 0 });
    assert!(pixels.iter().all(|pixel| *pixel == [0; 4]), "nothing is drawn");
    let laid = overlay.lay([100, 100]).unwrap();
    assert!(laid.onto(1, &mut pixels).is_ok());
    assert!(laid.onto(2, &mut pixels).is_err() && laid.onto(0, &mut pixels[1..]).is_err());
    for size in [[0, 0], [0, 10], [10, 0], [1, 1]] {
        assert!(overlay.draw(size, &mut []).is_err());
        let nothing =
            Overlay::default().draw(size, &mut vec![[0; 4]; (size[0] * size[1]) as usize]);
        assert_eq!(nothing, Ok(()));
    }
}
