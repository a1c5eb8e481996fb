//! Planes of numbers on their way into files: one in an array of its own, row by row, or all in one
//! archive or OpenEXR picture, which are written when all ids are known.

use std::{io::Write, sync::Arc, time::Instant};

use planisphere_core::{camera::Region, depth};
#[cfg(feature = "exr")]
use planisphere_io::picture::{
    About,
    exr::{Channel, write_exr},
};
use planisphere_io::{
    npy::{self, Archive, Plane},
    output::{Shared, Sink, Target},
};

use crate::{
    Error,
    bands::{PIECE, bands},
    spent::Report,
    subject::{Indices, Subject},
};

/// What the numbers of a plane are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Data {
    Ids,
    Depth,
    Normals,
    Positions,
}

impl Data {
    /// All, in the order of an archive.
    const ALL: [Self; 4] = [Self::Ids, Self::Depth, Self::Normals, Self::Positions];

    /// Its name in an archive.
    fn name(self) -> &'static str {
        match self {
            Self::Ids => "ids",
            Self::Depth => "depth",
            Self::Normals => "normals",
            Self::Positions => "positions",
        }
    }

    /// The header of its array, and how many bytes its numbers have.
    fn header(self, subject: &Subject) -> (Vec<u8>, usize) {
        let Region { width, height, .. } = subject.meta.region;
        let (descr, bytes) = match self {
            Self::Ids if is_wide(subject) => ("<i8", 8),
            Self::Ids => ("<i4", 4),
            Self::Depth | Self::Normals | Self::Positions => ("<f4", 4),
        };
        let shape = [height as usize, width as usize, 3];
        let axes = if matches!(self, Self::Normals | Self::Positions) { 3 } else { 2 };
        let count = shape[..axes].iter().product::<usize>();
        (npy::header(descr, &shape[..axes]), bytes * count)
    }

    /// Its numbers for the ids of some rows.
    fn of(
        self,
        subject: &Subject,
        some: Region,
        ids: &Arc<Plane<i32>>,
        spent: &mut Report,
    ) -> Result<Shared, Error> {
        if self == Self::Ids {
            return Ok(named(subject, ids));
        }
        let begin = Instant::now();
        let (scene, truth) = (subject.scene, subject.truth);
        let numbers: Shared = match self {
            Self::Normals => Arc::new(Plane(
                subject.plane(some, &ids.0, |some, ids| depth::normals(scene, truth, some, ids))?,
            )),
            Self::Positions => Arc::new(Plane(
                subject
                    .plane(some, &ids.0, |some, ids| depth::positions(scene, truth, some, ids))?,
            )),
            Self::Ids | Self::Depth => Arc::new(Plane(subject.depths(some, &ids.0)?)),
        };
        spent.depth += begin.elapsed().as_secs_f64() * 1e3;
        Ok(numbers)
    }
}

/// Whether ids take 8 bytes.
fn is_wide(subject: &Subject) -> bool {
    let each = matches!(subject.indices, Indices::Each(_));
    each && subject.meta.last().is_some_and(|last| last > i32::MAX as u64)
}

/// Ids as the reader knows them: the scene's own, or those of the whole.
fn named(subject: &Subject, ids: &Arc<Plane<i32>>) -> Shared {
    let (all, indices) = (ids.0.iter(), &subject.indices);
    match indices {
        Indices::From { .. } => ids.clone(),
        Indices::Each(_) if is_wide(subject) => {
            Arc::new(Plane::<i64>(all.map(|&id| indices.of_id(id)).collect()))
        }
        Indices::Each(_) => {
            Arc::new(Plane::<i32>(all.map(|&id| indices.of_id(id) as i32).collect()))
        }
    }
}

/// An array of one plane.
pub(crate) struct Array<'a> {
    target: &'a Target,
    pub sink: Sink,
    pub data: Data,
}

impl<'a> Array<'a> {
    /// Begins the array.
    pub fn begin(target: &'a Target, data: Data, subject: &Subject) -> Result<Self, Error> {
        let mut sink = target.clone().open()?;
        sink.write_all(&data.header(subject).0).map_err(|error| target.io(error))?;
        Ok(Self { target, sink, data })
    }

    /// Takes the next ids.
    pub fn take(
        &mut self,
        subject: &Subject,
        band: Region,
        ids: &Arc<Plane<i32>>,
        spent: &mut Report,
    ) -> Result<(), Error> {
        let numbers = self.data.of(subject, band, ids, spent)?;
        let begin = Instant::now();
        let given = self.sink.give(numbers);
        spent.encode += begin.elapsed().as_secs_f64() * 1e3;
        Ok(given.map_err(|error| self.target.io(error))?)
    }
}

/// All planes in one archive.
pub(crate) struct All<'a> {
    target: &'a Target,
    sink: Sink,
    ids: Vec<i32>,
}

impl<'a> All<'a> {
    /// Begins the archive.
    pub fn begin(target: &'a Target, subject: &Subject) -> Result<Self, Error> {
        let ids = Vec::with_capacity(subject.meta.region.pixels());
        Ok(Self { target, sink: target.clone().open()?, ids })
    }

    /// Takes the next ids.
    pub fn take(&mut self, ids: &[i32]) {
        self.ids.extend_from_slice(ids);
    }

    /// Writes the planes, one after the other.
    pub fn finish(mut self, subject: &Subject, spent: &mut Report) -> Result<Sink, Error> {
        let io = |error| self.target.io(error);
        let mut archive = Archive::new(&mut self.sink);
        let region = subject.meta.region;
        for data in Data::ALL {
            let (header, bytes) = data.header(subject);
            archive.start(data.name(), &header, bytes).map_err(io)?;
            for some in bands(region, PIECE) {
                subject.control.check()?;
                let start = (some.y - region.y) as usize * region.width as usize;
                let ids = Arc::new(Plane(self.ids[start..start + some.pixels()].to_vec()));
                let numbers = data.of(subject, some, &ids, spent)?;
                archive.write_all((*numbers).as_ref()).map_err(io)?;
            }
        }
        archive.finish().map_err(io)?;
        Ok(self.sink)
    }
}

/// An OpenEXR picture: colours in linear light, and all planes.
#[cfg(feature = "exr")]
pub(crate) struct Exr<'a> {
    target: &'a Target,
    sink: &'a mut Sink,
    text: &'a [(String, String)],
    pixels: Vec<[f32; 4]>,
    ids: Vec<i32>,
}

#[cfg(feature = "exr")]
impl<'a> Exr<'a> {
    /// Begins the picture.
    pub fn begin(target: &'a Target, sink: &'a mut Sink, about: &About<'a>) -> Self {
        let [width, height] = about.size.map(|side| side as usize);
        let (pixels, ids) =
            (Vec::with_capacity(width * height), Vec::with_capacity(width * height));
        Self { target, sink, text: about.text, pixels, ids }
    }

    /// Takes the next pixels.
    pub fn take_pixels(&mut self, pixels: &[[f32; 4]]) {
        self.pixels.extend_from_slice(pixels);
    }

    /// Takes the next ids.
    pub fn take(&mut self, ids: &[i32]) {
        self.ids.extend_from_slice(ids);
    }

    /// Writes the picture.
    pub fn finish(self, subject: &Subject) -> Result<(), Error> {
        let (scene, truth, region) = (subject.scene, subject.truth, subject.meta.region);
        let depths = subject.depths(region, &self.ids)?;
        let normals = subject
            .plane(region, &self.ids, |some, ids| depth::normals(scene, truth, some, ids))?;
        let positions = subject
            .plane(region, &self.ids, |some, ids| depth::positions(scene, truth, some, ids))?;
        let [colors, normal, position] = [
            ["R", "G", "B", "A"],
            ["normal.X", "normal.Y", "normal.Z", ""],
            ["position.X", "position.Y", "position.Z", ""],
        ];
        let mut channels =
            vec![("depth.Z", Channel::F32(&depths)), ("id", Channel::Ids(&self.ids))];
        for (at, name) in colors.into_iter().enumerate() {
            channels.push((name, Channel::Of4(&self.pixels, at)));
        }
        for at in 0..3 {
            channels.push((normal[at], Channel::Of3(&normals, at)));
            channels.push((position[at], Channel::Of3(&positions, at)));
        }
        let size = [region.width, region.height];
        let written = write_exr(self.sink, size, &channels, self.text);
        Ok(written.map_err(|error| self.target.io(error))?)
    }
}
