//! Writes a part as a NumPy archive (`.npz`): a zip file of uncompressed `.npy` arrays,
//! little-endian, the same bytes on every machine.
//!
//! | array | type, shape | |
//! | --- | --- | --- |
//! | `pixels` | records, (height, width) | `id`, `low` and `high`, see below |
//! | `indices` | int64, (M,) | the spheres that are seen, rising |
//! | `centers`, `radii`, `colors` | float64, (M, 3) and (M,); uint8, (M, 3) | exact |
//! | `ranges` | int64, (R, 2) | first and one past the last index of the spheres that were drawn |
//! | `extent` | float64, (2, 4) | least and greatest x, y, z, radius; nan for none |
//! | `image`, `region` | int64, (2,), (4,) | width, height; column, row, width, height |
//! | `projection` | uint8, () | 0 orthographic, 1 perspective |
//! | `origin`, `view`, `up` | float64, (3,) | the camera's, unrounded |
//! | `screen` | float64, (2,) | width and height; nan for what follows from the image |
//! | `clip` | float64, (2,) | near and far |
//! | `background` | uint8, (3,) | sRGB |
//! | `version` | int64, () | 1 |
//!
//! `id` is the index of the nearest sphere in the whole scene: int32 or, where that is too short,
//! int64; -1 for none. The distance lies between `low` and `high`, float64, which are apart by at
//! most 2^-20 of it or 8 of the least positive numbers. Both are inf for none; `high` is, too,
//! where no f64 is as large. `centers`, `radii` and `colors` are the numbers of the spheres that
//! are seen; `extent` is of the centres and radii of all spheres that were drawn. `image` is of
//! the whole picture, `region` of the part.

use std::{
    fmt,
    io::{self, Write},
};

use crate::npy::{archive::Archive, record_header as npy_record_header};
use planisphere_core::{
    camera::{Projection, Region, ScreenSize},
    part::{Meta, Pixel, Pixels, VERSION},
    scene::Sphere,
};

/// A part on its way out: first its pixels, row by row, then its spheres.
pub struct PartWriter<'a, W: Write> {
    archive: Archive<W>,
    meta: &'a Meta,
    wide: bool,
    left: usize,
}

impl<W: Write> fmt::Debug for PartWriter<'_, W> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { meta, left, .. } = self;
        f.debug_struct("PartWriter").field("meta", meta).field("left", left).finish_non_exhaustive()
    }
}

impl<'a, W: Write> PartWriter<'a, W> {
    /// Begins the archive.
    ///
    /// # Errors
    /// The writer's.
    pub fn new(out: W, meta: &'a Meta) -> io::Result<Self> {
        let wide = meta.last().is_some_and(|last| last > i32::MAX as u64);
        let mut archive = Archive::new(out);
        let Region { width, height, .. } = meta.region;
        let id = if wide { "<i8" } else { "<i4" };
        let header = npy_record_header(
            &[("id", id), ("low", "<f8"), ("high", "<f8")],
            &[height as usize, width as usize],
        );
        let left = meta.region.pixels();
        archive.start("pixels", &header, left * Pixels::record(wide))?;
        Ok(Self { archive, meta, wide, left })
    }

    /// Takes the next pixels.
    ///
    /// # Errors
    /// The writer's.
    pub fn pixels(&mut self, pixels: impl Iterator<Item = Pixel>) -> io::Result<()> {
        const CHUNK: usize = 1 << 18;
        let mut bytes = Vec::with_capacity(CHUNK + 24);
        for Pixel { id, bounds } in pixels {
            match self.wide {
                true => bytes.extend(id.to_le_bytes()),
                false => bytes.extend((id as i32).to_le_bytes()),
            }
            bounds.iter().for_each(|bound| bytes.extend(bound.to_le_bytes()));
            self.left -= 1;
            if bytes.len() >= CHUNK {
                self.archive.write_all(&bytes)?;
                bytes.clear();
            }
        }
        self.archive.write_all(&bytes)
    }

    /// Takes the spheres that are seen, by rising index, and ends the archive.
    ///
    /// # Errors
    /// The writer's.
    ///
    /// # Panics
    /// When pixels are missing.
    pub fn finish(
        mut self,
        spheres: impl Iterator<Item = (u64, Sphere)> + Clone,
    ) -> io::Result<()> {
        assert_eq!(self.left, 0, "all pixels come before the end");
        let count = spheres.clone().count();
        let archive = &mut self.archive;
        let n = |index: u64| (index as i64).to_le_bytes();
        archive.array("indices", "<i8", &[count], spheres.clone().map(|(index, _)| n(index)))?;
        archive.array(
            "centers",
            "<f8",
            &[count, 3],
            spheres.clone().flat_map(|(_, s)| reals(s.center.to_array())),
        )?;
        archive.array(
            "radii",
            "<f8",
            &[count],
            spheres.clone().map(|(_, s)| s.radius.to_le_bytes()),
        )?;
        archive.array("colors", "|u1", &[count, 3], spheres.map(|(_, s)| s.color))?;

        let Meta { view, region, background, ranges, bounds } = self.meta;
        archive.array(
            "ranges",
            "<i8",
            &[ranges.len(), 2],
            ranges.iter().flat_map(|range| [n(range.start), n(range.end)]),
        )?;
        let extent = bounds.map_or([f64::NAN; 8], |b| {
            let ([x, y, z], [u, v, w]) = (b.min_center.to_array(), b.max_center.to_array());
            [x, y, z, b.min_radius, u, v, w, b.max_radius]
        });
        archive.array("extent", "<f8", &[2, 4], reals(extent).into_iter())?;
        let whole = [view.image.width, view.image.height].map(|side| n(side.into()));
        archive.array("image", "<i8", &[2], whole.into_iter())?;
        let part = [region.x, region.y, region.width, region.height].map(|side| n(side.into()));
        archive.array("region", "<i8", &[4], part.into_iter())?;
        let camera = &view.camera;
        let projection = match camera.projection {
            Projection::Orthographic => 0u8,
            Projection::Perspective => 1,
        };
        archive.array("projection", "|u1", &[], [[projection]].into_iter())?;
        for (name, vector) in [("origin", camera.origin), ("view", camera.view), ("up", camera.up)]
        {
            archive.array(name, "<f8", &[3], reals(vector.to_array()).into_iter())?;
        }
        let screen = match camera.size {
            ScreenSize::Width(width) => [width, f64::NAN],
            ScreenSize::Height(height) => [f64::NAN, height],
            ScreenSize::Both { width, height } => [width, height],
        };
        archive.array("screen", "<f8", &[2], reals(screen).into_iter())?;
        archive.array("clip", "<f8", &[2], reals([camera.near, camera.far]).into_iter())?;
        archive.array("background", "|u1", &[3], [*background].into_iter())?;
        archive.array("version", "<i8", &[], [VERSION.to_le_bytes()].into_iter())?;
        self.archive.finish()
    }
}

fn reals<const N: usize>(values: [f64; N]) -> [[u8; 8]; N] {
    // One bit pattern for all that is not a number.
    values.map(|value| if value.is_nan() { f64::NAN } else { value }.to_le_bytes())
}
