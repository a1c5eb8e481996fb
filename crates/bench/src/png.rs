//! Time and size of a picture's PNG: as RGB, with a palette, and as the `png` crate writes RGB.
//!
//! A picture of more than 256 colours has no palette. It is measured a second time with its colours
//! brought to at most 256 (three bits of red and green, two of blue), and both ways write the same
//! pixels then.

use std::{
    io::{self, Write as _},
    time::Instant,
};

use ::png::{BitDepth, ColorType, DeflateCompression, Encoder, Filter};
use serde::Serialize;

use super::{
    process::cpu_time,
    speed::{BenchError, Conditions},
    statistics::Summary,
    table::{Table, number},
};
use planisphere_core::{
    camera::{Region, View},
    scene::{Scene, Sphere},
};
use planisphere_image::Paint;
use planisphere_io::png::{About, PaletteError, write_palette_png, write_png};
use planisphere_renderer::{Device, Engine};

/// A picture to measure.
pub struct Picture {
    /// What it is called.
    pub name: String,
    /// Its spheres.
    pub scene: Scene,
    /// How they are seen.
    pub view: View,
    /// Where none is.
    pub background: [u8; 3],
}

/// A way of writing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Way {
    /// With a palette.
    Palette,
    /// As `render` does.
    Rgb,
    /// The `png` crate at level 1 without a filter.
    CrateLevel1,
    /// The `png` crate's fastest, with differences to the row above.
    CrateFastest,
}

impl Way {
    const ALL: [Self; 4] = [Self::Palette, Self::Rgb, Self::CrateLevel1, Self::CrateFastest];

    fn words(self) -> &'static str {
        match self {
            Self::Palette => "palette",
            Self::Rgb => "RGB",
            Self::CrateLevel1 => "RGB, png crate, level 1",
            Self::CrateFastest => "RGB, png crate, fdeflate, filter Up",
        }
    }

    /// The file; none where there are too many colours.
    fn write(self, region: Region, ids: &[i32], paint: &Paint) -> io::Result<Option<Vec<u8>>> {
        let mut bytes = Vec::new();
        let about = About { size: [region.width, region.height], ..About::default() };
        match self {
            Self::Palette => match write_palette_png(&mut bytes, &about, ids, paint) {
                Err(PaletteError::TooManyColors) => return Ok(None),
                Err(PaletteError::Io(error)) => return Err(error),
                Ok(()) => {}
            },
            Self::Rgb => write_png(&mut bytes, region, ids, paint)?,
            Self::CrateLevel1 => {
                let compression = DeflateCompression::Level(1);
                by_crate(
                    &mut bytes,
                    region,
                    &paint.colors(ids).map_err(io::Error::other)?,
                    compression,
                    Filter::NoFilter,
                )?;
            }
            Self::CrateFastest => {
                let compression = DeflateCompression::FdeflateUltraFast;
                by_crate(
                    &mut bytes,
                    region,
                    &paint.colors(ids).map_err(io::Error::other)?,
                    compression,
                    Filter::Up,
                )?;
            }
        }
        Ok(Some(bytes))
    }
}

fn by_crate(
    bytes: &mut Vec<u8>,
    region: Region,
    colors: &[[u8; 3]],
    compression: DeflateCompression,
    filter: Filter,
) -> io::Result<()> {
    let mut encoder = Encoder::new(bytes, region.width, region.height);
    encoder.set_color(ColorType::Rgb);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_deflate_compression(compression);
    encoder.set_filter(filter);
    let mut writer = encoder.write_header().map_err(io::Error::other)?;
    let mut stream = writer.stream_writer_with_size(1 << 18).map_err(io::Error::other)?;
    stream.write_all(colors.as_flattened())?;
    stream.finish().map_err(io::Error::other)?;
    writer.finish().map_err(io::Error::other)
}

/// One picture, written one way.
#[derive(Debug, Serialize)]
pub struct Row {
    /// The picture.
    pub picture: String,
    /// The way.
    pub way: Way,
    /// Bytes of the file.
    pub bytes: usize,
    /// Milliseconds of wall time.
    pub wall: Summary,
    /// Milliseconds of processor time of all threads, where the system counts it.
    pub cpu: Option<Summary>,
    /// Wall time over the palette's, round by round, where there is a palette.
    pub wall_over_palette: Option<Summary>,
    /// Processor time over the palette's.
    pub cpu_over_palette: Option<Summary>,
    /// Size over the palette's.
    pub bytes_over_palette: Option<f64>,
}

/// What was measured, and where.
#[derive(Debug, Serialize)]
pub struct Report {
    /// Of this form.
    pub version: u32,
    /// The machine and the program.
    pub conditions: Conditions,
    /// Rounds that count.
    pub rounds: usize,
    /// One for each picture and way.
    pub rows: Vec<Row>,
}

/// Measures pictures: in each round every way once, in turn; one round before them does not count.
///
/// # Errors
/// When a picture cannot be drawn.
pub fn measure(
    pictures: &[Picture],
    rounds: usize,
    say: &mut dyn FnMut(&str),
) -> Result<Report, BenchError> {
    let mut rows = Vec::new();
    for picture in pictures {
        say(&picture.name);
        let region = Region::whole(picture.view.image);
        let mut device = Engine::open(&Device::Cpu)?;
        let ids = device.draw(&picture.scene, &picture.view, region)?.ids;
        let paint = Paint { scene: &picture.scene, background: picture.background };
        let true_colors = of(&picture.name, region, &ids, &paint, rounds)?;
        let has_palette = true_colors.iter().any(|row| row.way == Way::Palette);
        rows.extend(true_colors);
        if !has_palette {
            let fewer = fewer_colors(&picture.scene);
            let paint = Paint { scene: &fewer, background: fewer_bits(picture.background) };
            rows.extend(of(
                &format!("{}, at most 256 colours", picture.name),
                region,
                &ids,
                &paint,
                rounds,
            )?);
        }
    }
    Ok(Report { version: 1, conditions: Conditions::here(&[]), rounds, rows })
}

/// All ways of one picture.
fn of(
    name: &str,
    region: Region,
    ids: &[i32],
    paint: &Paint,
    rounds: usize,
) -> io::Result<Vec<Row>> {
    let mut measured: Vec<(Way, usize, Vec<f64>, Vec<f64>)> = Vec::new();
    for way in Way::ALL {
        if let Some(bytes) = way.write(region, ids, paint)? {
            measured.push((way, bytes.len(), Vec::new(), Vec::new()));
        }
    }
    // The clock of processor time may be coarse: each measurement takes at least this long.
    let often: usize = if region.pixels() < 1 << 22 { 8 } else { 1 };
    for _ in 0..rounds {
        for (way, _, walls, cpus) in &mut measured {
            let (cpu, start) = (cpu_time(), Instant::now());
            for _ in 0..often {
                std::hint::black_box(way.write(region, ids, paint)?);
            }
            walls.push(start.elapsed().as_secs_f64() * 1e3 / often as f64);
            cpus.extend(cpu_time().zip(cpu).map(|(after, before)| (after - before) / often as f64));
        }
    }
    let palette = measured.iter().find(|(way, ..)| *way == Way::Palette).cloned();
    let row = |(way, bytes, walls, cpus): &(Way, usize, Vec<f64>, Vec<f64>)| {
        let base = palette.as_ref();
        Some(Row {
            picture: name.into(),
            way: *way,
            bytes: *bytes,
            wall: Summary::of(walls)?,
            cpu: Summary::of(cpus),
            wall_over_palette: base.and_then(|(_, _, base, _)| Summary::of_ratios(walls, base)),
            cpu_over_palette: base.and_then(|(_, _, _, base)| Summary::of_ratios(cpus, base)),
            bytes_over_palette: base.map(|(_, base, ..)| *bytes as f64 / *base as f64),
        })
    };
    Ok(measured.iter().filter_map(row).collect())
}

/// Three bits of red and green, two of blue.
fn fewer_bits([red, green, blue]: [u8; 3]) -> [u8; 3] {
    [red & 0xe0, green & 0xe0, blue & 0xc0]
}

/// The same spheres in at most 256 colours.
fn fewer_colors(scene: &Scene) -> Scene {
    let sphere = |k| {
        let sphere = scene.sphere(k).expect("it is one of the scene");
        Sphere { color: fewer_bits(sphere.color), ..sphere }
    };
    Scene::from_spheres(&(0..scene.len()).map(sphere).collect::<Vec<_>>())
        .expect("spheres of a scene are a scene")
}

impl Report {
    /// As a table.
    pub fn text(&self) -> String {
        let mut table = Table::new(&[
            "picture, way",
            "wall ms",
            "cpu ms",
            "KB",
            "wall / palette",
            "cpu / palette",
            "KB / palette",
        ]);
        let mut last = "";
        for row in &self.rows {
            if row.picture != last {
                last = &row.picture;
                let mut cells = vec![String::new(); 7];
                cells[0].clone_from(&row.picture);
                table.row(cells);
            }
            let spread = format!(
                "{} ({}-{})",
                number(Some(row.wall.median)),
                number(Some(row.wall.least)),
                number(Some(row.wall.greatest))
            );
            table.row(vec![
                format!("  {}", row.way.words()),
                spread,
                number(row.cpu.map(|s| s.median)),
                number(Some(row.bytes as f64 * 1e-3)),
                number(row.wall_over_palette.map(|s| s.median)),
                number(row.cpu_over_palette.map(|s| s.median)),
                number(row.bytes_over_palette),
            ]);
        }
        format!(
            "{}\n\
             Ids to the bytes of a PNG in memory, the ways in turn: medians of {} rounds, with \
             the least and the greatest in brackets; ratios round by round.\n\
             cpu is processor time of all threads. A KB is 1000 bytes.\n\
             \n\
             {}",
            self.conditions.text(),
            self.rounds,
            table.text()
        )
    }
}
