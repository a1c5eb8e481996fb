//! Draws overlays over spheres, to look at: `overlay FOLDER` writes PNG files.

use std::path::Path;

use planisphere_image::{
    maps::Map,
    overlay::{Axes, Legend, Overlay, ScaleBar},
};

/// Discs with a bright middle, in the colours of a map.
fn picture([width, height]: [u32; 2], background: [u8; 4]) -> Vec<[u8; 4]> {
    let mut pixels = vec![background; (width * height) as usize];
    let (w, h) = (f64::from(width), f64::from(height));
    let mut state = 12_345_u64;
    let mut random = || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / (1_u64 << 31) as f64
    };
    for _ in 0..400 {
        let (x, y, r) = (random() * w, random() * h, (0.01 + 0.03 * random()) * w.min(h));
        let color = Map::VIRIDIS.color(random()).expect("a number");
        for j in (y - r).max(0.0) as u32..((y + r + 1.0) as u32).min(height) {
            for i in (x - r).max(0.0) as u32..((x + r + 1.0) as u32).min(width) {
                let (dx, dy) = ((f64::from(i) + 0.5 - x) / r, (f64::from(j) + 0.5 - y) / r);
                let square = dx * dx + dy * dy;
                if square < 1.0 {
                    let light = 0.35 + 0.65 * (1.0 - square).sqrt();
                    let [red, green, blue] = color.map(|c| (f64::from(c) * light) as u8);
                    pixels[(j * width + i) as usize] = [red, green, blue, 255];
                }
            }
        }
    }
    pixels
}

fn main() {
    let folder = std::env::args().nth(1).expect("a folder");
    let s = |x: f64| x.sqrt();
    // From (1, -1, 1), z up, nearly.
    let axes = Axes {
        right: [1.0 / s(2.0), 1.0 / s(2.0), 0.0],
        up: [-1.0 / s(6.0), 1.0 / s(6.0), 2.0 / s(6.0)],
        back: [1.0 / s(3.0), -1.0 / s(3.0), 1.0 / s(3.0)],
    };
    let flat = Axes { right: [1.0, 0.0, 0.0], up: [0.0, 1.0, 0.0], back: [0.0, 0.0, 1.0] };
    let away = Axes { right: [1.0, 0.0, 0.0], up: [0.0, 0.0, 1.0], back: [0.0, -1.0, 0.0] };
    let bar = Legend::Bar {
        map: Map::VIRIDIS,
        range: [-0.0012, 0.0031],
        label: "velocity (Å/ps)".into(),
    };
    let plain =
        Legend::Bar { map: Map::ALL[7], range: [0.0, 1.0], label: "Temperature (K)".into() };
    let elements = [
        ("Hydrogen", [255, 255, 255]),
        ("Carbon", [144, 144, 144]),
        ("Nitrogen", [48, 80, 248]),
        ("Oxygen", [255, 13, 13]),
        ("Sulphur", [255, 255, 48]),
    ];
    let keys = Legend::Keys(elements.map(|(name, color)| (name.to_owned(), color)).to_vec());
    for [width, height] in
        [[96, 96], [256, 256], [512, 512], [1024, 1024], [1920, 1080], [4096, 4096]]
    {
        let scale = f64::from(width) / 51.2;
        let scale_bar = |length, unit: &str| {
            Some(ScaleBar { length, pixels_per_unit: scale, unit: Some(unit.into()) })
        };
        let dark = Overlay {
            title: Some("Shear flow, t = 12.5 ps".into()),
            legend: Some(bar.clone()),
            scale_bar: scale_bar(None, "Å"),
            axes: Some(axes),
            background: [0; 3],
        };
        let bright = Overlay {
            title: Some("AVATAR: Ångström".into()),
            legend: Some(keys.clone()),
            scale_bar: scale_bar(Some(7.7), "nm"),
            axes: Some(flat),
            background: [255; 3],
        };
        let grey = Overlay {
            legend: Some(plain.clone()),
            axes: Some(away),
            background: [255; 3],
            ..dark.clone()
        };
        let names = (1..=60).map(|kind| (format!("type {kind}"), Map::ALL[9].category(kind)));
        let kinds = Overlay {
            legend: Some(Legend::Keys(names.collect())),
            title: None,
            background: [255; 3],
            ..dark.clone()
        };
        for (name, overlay, back) in [
            ("kinds", kinds, [255; 4]),
            ("dark", dark, [0, 0, 0, 255]),
            ("bright", bright, [255; 4]),
            ("clear", grey, [255, 255, 255, 0]),
        ] {
            let mut pixels = picture([width, height], back);
            let start = std::time::Instant::now();
            let drawn = overlay.draw([width, height], &mut pixels);
            let path = Path::new(&folder).join(format!("{name}-{width}x{height}.png"));
            let report = std::io::Write::write_fmt(
                &mut std::io::stderr(),
                format_args!("{}: {:?}, {drawn:?}\n", path.display(), start.elapsed()),
            );
            report.expect("a line");
            image::save_buffer(
                &path,
                pixels.as_flattened(),
                width,
                height,
                image::ColorType::Rgba8,
            )
            .expect("a file");
        }
    }
}
