//! The planes of a picture on their way out: PNG, ids, depths and what merging needs, band by band
//! where the picture is so large that not even its ids should lie in memory.

use std::{sync::Arc, time::Instant};

use super::{Failure, args::Outputs, progress::Progress};
use planisphere_core::{
    camera::Region,
    depth,
    exact::decide::Truth,
    part::{Meta, Pixel, Seen},
    scene::Scene,
};
use planisphere_image::Paint;
use planisphere_io::{
    npy,
    npy::Plane,
    output::{OutputError, Staged, Target},
    part::PartWriter,
    png,
    png::{PaletteError, PngRows},
};

/// Pixels that are drawn at a time, at most: 8K is one band.
pub(super) const BAND: usize = 1 << 25;

/// What a picture is of.
pub(super) struct Picture<'a> {
    /// View, region, background, and which spheres of the whole there are.
    pub meta: &'a Meta,
    /// The spheres that ids are of.
    pub scene: &'a Scene,
    /// The decisions of the view.
    pub truth: &'a Truth,
    /// What the spheres are called outside.
    pub indices: Indices<'a>,
    /// Pixels that are wanted at a time; at most [`BAND`].
    pub band: usize,
}

/// Indices of the spheres in the whole.
pub(super) enum Indices<'a> {
    /// In the scene's order, from the first on; arrays of ids are of the scene itself, from 0.
    From {
        /// In the whole.
        first: u64,
    },
    /// One each, rising.
    Each(&'a [u64]),
}

impl Indices<'_> {
    fn of(&self, place: usize) -> u64 {
        match self {
            Self::From { first } => first + place as u64,
            Self::Each(indices) => indices[place],
        }
    }
}

/// Milliseconds of the steps here.
#[derive(Default)]
pub(super) struct Spent {
    /// Distances.
    pub depth: f64,
    /// Planes to bytes.
    pub encode: f64,
}

fn timed<T>(total: &mut f64, work: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let result = work();
    *total += start.elapsed().as_secs_f64() * 1e3;
    result
}

/// Draws band by band, from the top, and writes what is wanted. `draw` gives the spheres of the
/// scene that are seen, -1 for none. Files get their names when they are committed.
pub(super) fn write(
    outputs: &Outputs,
    picture: &Picture,
    spent: &mut Spent,
    mut draw: impl FnMut(Region) -> Result<Vec<i32>, Failure>,
) -> Result<Vec<Staged>, Failure> {
    let Picture { meta, scene, truth, indices, band } = picture;
    let region = meta.region;
    let shape = [region.height as usize, region.width as usize];
    let open = |target: &Option<Target>| target.clone().map(Target::open).transpose();
    let or = |target: &Option<Target>| {
        let target = target.clone().unwrap_or(Target::Stdout);
        move |error| -> OutputError { target.io(error) }
    };

    // Ids that the reader knows: the scene's own, or those of the whole, with as many bytes as
    // these take.
    let wide = match indices {
        Indices::From { .. } => false,
        Indices::Each(_) => meta.last().is_some_and(|last| last > i32::MAX as u64),
    };
    let mut ids_sink = open(&outputs.ids)?;
    if let Some(sink) = &mut ids_sink {
        let header = npy::header(if wide { "<i8" } else { "<i4" }, &shape);
        std::io::Write::write_all(sink, &header).map_err(or(&outputs.ids))?;
    }
    let mut depth_sink = open(&outputs.depth)?;
    if let Some(sink) = &mut depth_sink {
        std::io::Write::write_all(sink, &npy::header("<f4", &shape)).map_err(or(&outputs.depth))?;
    }
    let mut part_sink = open(&outputs.visibility)?;
    let mut part = match &mut part_sink {
        Some(sink) => Some((
            PartWriter::new(sink, meta).map_err(or(&outputs.visibility))?,
            Seen::new(scene.len()),
        )),
        None => None,
    };
    let paint = Paint { scene, background: meta.background };
    let mut png_sink = open(&outputs.picture)?;
    let mut rows = match &mut png_sink {
        Some(sink) if !outputs.palette => {
            Some(PngRows::new(sink, region, paint).map_err(or(&outputs.picture))?)
        }
        _ => None,
    };
    // A palette takes all colours before the first row.
    let mut all = Arc::new(Plane(Vec::new()));

    for band in bands(region, *band) {
        let ids = draw(band)?;
        if let Some(sink) = &mut depth_sink {
            let _progress = Progress::step("working out depths");
            let plane = timed(&mut spent.depth, || depth::depths(scene, truth, band, &ids))?;
            timed(&mut spent.encode, || sink.give(Arc::new(Plane(plane))))
                .map_err(or(&outputs.depth))?;
        }
        let _progress = Progress::step("encoding");
        if let Some((part, seen)) = &mut part {
            seen.mark(&ids);
            // Bounds take four times the memory of ids: some rows at a time.
            for some in bands(band, 1 << 20) {
                let start = (some.y - band.y) as usize * band.width as usize;
                let place = start..start + some.pixels();
                let work = || depth::distance_bounds(scene, truth, some, &ids[place.clone()]);
                let bounds = timed(&mut spent.depth, work)?;
                let id = |id: i32| usize::try_from(id).map_or(-1, |place| indices.of(place) as i64);
                let pixels =
                    ids[place].iter().zip(bounds).map(|(&k, bounds)| Pixel { id: id(k), bounds });
                timed(&mut spent.encode, || part.pixels(pixels))
                    .map_err(or(&outputs.visibility))?;
            }
        }
        timed(&mut spent.encode, || -> Result<(), Failure> {
            let ids = Arc::new(Plane(ids));
            if let Some(sink) = &mut ids_sink {
                let index =
                    |id: i32| usize::try_from(id).map_or(-1, |place| indices.of(place) as i64);
                match indices {
                    Indices::From { .. } => sink.give(ids.clone()),
                    Indices::Each(_) if wide => {
                        sink.give(Arc::new(Plane(ids.0.iter().map(|&id| index(id)).collect())))
                    }
                    Indices::Each(_) => sink
                        .give(Arc::new(Plane(ids.0.iter().map(|&id| index(id) as i32).collect()))),
                }
                .map_err(or(&outputs.ids))?;
            }
            if let Some(rows) = &mut rows {
                rows.push(&ids.0).map_err(or(&outputs.picture))?;
            } else if outputs.picture.is_some() && outputs.palette {
                // One band is the usual case, and is not copied.
                if all.0.is_empty() {
                    all = ids;
                } else {
                    let all = &mut Arc::make_mut(&mut all).0;
                    all.reserve_exact(region.pixels() - all.len());
                    all.extend_from_slice(&ids.0);
                }
            }
            Ok(())
        })?;
    }

    let (_progress, start) = (Progress::step("encoding"), Instant::now());
    let mut staged = Vec::new();
    rows.map_or(Ok(()), PngRows::finish).map_err(or(&outputs.picture))?;
    if let (true, Some(sink)) = (outputs.palette, &mut png_sink) {
        png::write_palette_png(sink, region, &all.0, &paint).map_err(|error| match error {
            PaletteError::Io(error) => or(&outputs.picture)(error).into(),
            PaletteError::TooManyColors => Failure::Usage(format!(
                "--palette: {error}; leave out --palette, and the same pixels are written as RGB"
            )),
        })?;
    }
    let finish = |(part, seen): (PartWriter<_>, Seen)| {
        part.finish(seen.iter().map(|place| (indices.of(place), scene.known(place))))
    };
    part.map_or(Ok(()), finish).map_err(or(&outputs.visibility))?;
    for sink in [png_sink, ids_sink, depth_sink, part_sink].into_iter().flatten() {
        staged.push(sink.finish()?);
    }
    spent.encode += start.elapsed().as_secs_f64() * 1e3;
    Ok(staged)
}

/// A region in bands of whole rows, of at most so many pixels where a row is not more.
fn bands(region: Region, pixels: usize) -> impl Iterator<Item = Region> {
    // Tiles of 64 rows or less are not cut, so that none is drawn twice.
    let rows = (pixels / region.width as usize).max(1);
    let rows = if rows >= 64 { rows / 64 * 64 } else { rows } as u32;
    (region.y..region.y + region.height).step_by(rows as usize).map(move |y| Region {
        y,
        height: rows.min(region.y + region.height - y),
        ..region
    })
}
