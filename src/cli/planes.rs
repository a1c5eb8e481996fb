//! The planes of a picture on their way out: PNG, ids, depths and what merging needs, band by band
//! where the picture is so large that not even its ids should lie in memory.

use std::{io::Write, sync::Arc, time::Instant};

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
    output::{Shared, Sink, Staged, Target},
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

impl Picture<'_> {
    /// What gives ids their colours.
    fn paint(&self) -> Paint<'_> {
        Paint { scene: self.scene, background: self.meta.background }
    }
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

    /// Of an id of the scene; -1 is none.
    fn of_id(&self, id: i32) -> i64 {
        usize::try_from(id).map_or(-1, |place| self.of(place) as i64)
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
    let open = |target: &Option<Target>| target.clone().map(Target::open).transpose();
    let ids = outputs.ids.as_ref().map(|target| Ids::begin(target, picture)).transpose()?;
    let depths = outputs.depth.as_ref().map(|target| Depths::begin(target, picture)).transpose()?;
    let mut part_sink = open(&outputs.visibility)?;
    let part = outputs.visibility.as_ref().zip(part_sink.as_mut());
    let part = part.map(|(target, sink)| Part::begin(target, sink, picture)).transpose()?;
    let mut png_sink = open(&outputs.picture)?;
    let png = outputs.picture.as_ref().zip(png_sink.as_mut());
    let png = png.map(|(target, sink)| match outputs.palette {
        true => Ok(Png::palette(target, sink)),
        false => Png::rgb(target, sink, picture),
    });
    let mut planes = Planes { picture, depths, part, ids, png: png.transpose()? };

    for band in bands(picture.meta.region, picture.band) {
        planes.take(band, draw(band)?, spent)?;
    }

    let (_progress, start) = (Progress::step("encoding"), Instant::now());
    let (ids_sink, depth_sink) = planes.finish()?;
    let mut staged = Vec::new();
    for sink in [png_sink, ids_sink, depth_sink, part_sink].into_iter().flatten() {
        staged.push(sink.finish()?);
    }
    spent.encode += start.elapsed().as_secs_f64() * 1e3;
    Ok(staged)
}

/// The planes that are wanted, on their way out.
struct Planes<'a> {
    picture: &'a Picture<'a>,
    depths: Option<Depths<'a>>,
    part: Option<Part<'a>>,
    ids: Option<Ids<'a>>,
    png: Option<Png<'a>>,
}

impl Planes<'_> {
    /// Takes the ids of the next band.
    fn take(&mut self, band: Region, ids: Vec<i32>, spent: &mut Spent) -> Result<(), Failure> {
        if let Some(depths) = &mut self.depths {
            let _progress = Progress::step("working out depths");
            depths.take(self.picture, band, &ids, spent)?;
        }
        let _progress = Progress::step("encoding");
        if let Some(part) = &mut self.part {
            part.take(self.picture, band, &ids, spent)?;
        }
        timed(&mut spent.encode, || {
            let ids = Arc::new(Plane(ids));
            if let Some(plane) = &mut self.ids {
                plane.take(&ids)?;
            }
            match &mut self.png {
                Some(png) => png.take(ids, self.picture),
                None => Ok(()),
            }
        })
    }

    /// Ends the picture and the part, and gives back where ids and depths have gone.
    fn finish(self) -> Result<(Option<Sink>, Option<Sink>), Failure> {
        if let Some(png) = self.png {
            png.finish(self.picture)?;
        }
        if let Some(part) = self.part {
            part.finish(self.picture)?;
        }
        Ok((self.ids.map(|ids| ids.sink), self.depths.map(|depths| depths.sink)))
    }
}

/// Begins an array of a picture's pixels, of a type.
fn array(target: &Target, descr: &str, picture: &Picture) -> Result<Sink, Failure> {
    let Region { width, height, .. } = picture.meta.region;
    let mut sink = target.clone().open()?;
    let header = npy::header(descr, &[height as usize, width as usize]);
    sink.write_all(&header).map_err(|error| target.io(error))?;
    Ok(sink)
}

/// The array of ids.
struct Ids<'a> {
    target: &'a Target,
    sink: Sink,
    numbers: Numbers<'a>,
}

/// The ids that the reader knows.
enum Numbers<'a> {
    /// The scene's own.
    Own,
    /// Those of the whole, of 4 bytes.
    Four(&'a Indices<'a>),
    /// The same, of 8 bytes, which some take.
    Eight(&'a Indices<'a>),
}

impl<'a> Ids<'a> {
    /// Begins the array.
    fn begin(target: &'a Target, picture: &'a Picture) -> Result<Self, Failure> {
        let indices = &picture.indices;
        let wide = picture.meta.last().is_some_and(|last| last > i32::MAX as u64);
        let (descr, numbers) = match indices {
            Indices::From { .. } => ("<i4", Numbers::Own),
            Indices::Each(_) if wide => ("<i8", Numbers::Eight(indices)),
            Indices::Each(_) => ("<i4", Numbers::Four(indices)),
        };
        Ok(Self { target, sink: array(target, descr, picture)?, numbers })
    }

    /// Takes the next ids.
    fn take(&mut self, ids: &Arc<Plane<i32>>) -> Result<(), Failure> {
        let all = ids.0.iter();
        let bytes: Shared = match self.numbers {
            Numbers::Own => ids.clone(),
            Numbers::Four(indices) => {
                Arc::new(Plane::<i32>(all.map(|&id| indices.of_id(id) as i32).collect()))
            }
            Numbers::Eight(indices) => {
                Arc::new(Plane::<i64>(all.map(|&id| indices.of_id(id)).collect()))
            }
        };
        Ok(self.sink.give(bytes).map_err(|error| self.target.io(error))?)
    }
}

/// The array of distances.
struct Depths<'a> {
    target: &'a Target,
    sink: Sink,
}

impl<'a> Depths<'a> {
    /// Begins the array.
    fn begin(target: &'a Target, picture: &Picture) -> Result<Self, Failure> {
        Ok(Self { target, sink: array(target, "<f4", picture)? })
    }

    /// Works out the next distances.
    fn take(
        &mut self,
        picture: &Picture,
        band: Region,
        ids: &[i32],
        spent: &mut Spent,
    ) -> Result<(), Failure> {
        let work = || depth::depths(picture.scene, picture.truth, band, ids);
        let plane = timed(&mut spent.depth, work)?;
        let given = timed(&mut spent.encode, || self.sink.give(Arc::new(Plane(plane))));
        Ok(given.map_err(|error| self.target.io(error))?)
    }
}

/// What merging needs.
struct Part<'a> {
    target: &'a Target,
    writer: PartWriter<'a, &'a mut Sink>,
    seen: Seen,
}

impl<'a> Part<'a> {
    /// Begins the archive.
    fn begin(
        target: &'a Target,
        sink: &'a mut Sink,
        picture: &'a Picture,
    ) -> Result<Self, Failure> {
        let writer = PartWriter::new(sink, picture.meta).map_err(|error| target.io(error))?;
        Ok(Self { target, writer, seen: Seen::new(picture.scene.len()) })
    }

    /// Works out what is between the distances of the next pixels.
    fn take(
        &mut self,
        picture: &Picture,
        band: Region,
        ids: &[i32],
        spent: &mut Spent,
    ) -> Result<(), Failure> {
        let Picture { scene, truth, indices, .. } = picture;
        self.seen.mark(ids);
        // Bounds take four times the memory of ids: some rows at a time.
        for some in bands(band, 1 << 20) {
            let start = (some.y - band.y) as usize * band.width as usize;
            let ids = &ids[start..start + some.pixels()];
            let work = || depth::distance_bounds(scene, truth, some, ids);
            let bounds = timed(&mut spent.depth, work)?;
            let pixels =
                ids.iter().zip(bounds).map(|(&id, bounds)| Pixel { id: indices.of_id(id), bounds });
            timed(&mut spent.encode, || self.writer.pixels(pixels))
                .map_err(|error| self.target.io(error))?;
        }
        Ok(())
    }

    /// Ends the archive, with the spheres that are seen.
    fn finish(self, picture: &Picture) -> Result<(), Failure> {
        let Picture { scene, indices, .. } = picture;
        let spheres = self.seen.iter().map(|place| (indices.of(place), scene.known(place)));
        Ok(self.writer.finish(spheres).map_err(|error| self.target.io(error))?)
    }
}

/// The colours.
struct Png<'a> {
    target: &'a Target,
    form: Form<'a>,
}

/// How colours are written.
enum Form<'a> {
    /// Row by row.
    Rgb(PngRows<'a, &'a mut Sink>),
    /// With a palette, which takes all colours before the first row.
    Palette { sink: &'a mut Sink, all: Arc<Plane<i32>> },
}

impl<'a> Png<'a> {
    /// Begins a picture of 8 bits a channel.
    fn rgb(target: &'a Target, sink: &'a mut Sink, picture: &'a Picture) -> Result<Self, Failure> {
        let rows = PngRows::new(sink, picture.meta.region, picture.paint());
        let rows = rows.map_err(|error| target.io(error))?;
        Ok(Self { target, form: Form::Rgb(rows) })
    }

    /// A picture with a palette.
    fn palette(target: &'a Target, sink: &'a mut Sink) -> Self {
        let all = Arc::new(Plane(Vec::new()));
        Self { target, form: Form::Palette { sink, all } }
    }

    /// Takes the next ids.
    fn take(&mut self, ids: Arc<Plane<i32>>, picture: &Picture) -> Result<(), Failure> {
        match &mut self.form {
            Form::Rgb(rows) => rows.push(&ids.0).map_err(|error| self.target.io(error))?,
            // One band is the usual case, and is not copied.
            Form::Palette { all, .. } if all.0.is_empty() => *all = ids,
            Form::Palette { all, .. } => {
                let all = &mut Arc::make_mut(all).0;
                all.reserve_exact(picture.meta.region.pixels() - all.len());
                all.extend_from_slice(&ids.0);
            }
        }
        Ok(())
    }

    /// Ends the picture.
    fn finish(self, picture: &Picture) -> Result<(), Failure> {
        let Self { target, form } = self;
        match form {
            Form::Rgb(rows) => Ok(rows.finish().map_err(|error| target.io(error))?),
            Form::Palette { sink, all } => {
                let written =
                    png::write_palette_png(sink, picture.meta.region, &all.0, &picture.paint());
                written.map_err(|error| match error {
                    PaletteError::Io(error) => target.io(error).into(),
                    PaletteError::TooManyColors => Failure::Usage(format!(
                        "--palette: {error}; leave out --palette, and the same pixels are written \
                         as RGB"
                    )),
                })
            }
        }
    }
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
