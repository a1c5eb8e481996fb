//! Reads parts of pictures from bytes: NumPy archives as [`crate::part`] describes them, checked
//! once from end to end. This file knows of no file.

use std::{io, ops::Range};

use bytes::Bytes;
use glam::DVec3;
use rayon::prelude::*;
use zip::{CompressionMethod, ZipArchive, result::ZipError};

use crate::npy::read::{Descr, Header, header};
use planisphere_core::{
    camera::{Camera, ImageSize, MAX_SIDE, Projection, Region, ScreenSize, View},
    part::{Meta, Part, Pixels, VERSION},
    scene::{Block, Bounds, Colors, Radii, Reals, Scene},
    text,
};

/// Why bytes are no part that can be merged.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}: {problem}; {}", text::name(.name), .problem.fix())]
pub struct PartError {
    /// What the part is called.
    pub name: String,
    /// What is wrong.
    pub problem: PartProblem,
}

/// What is wrong with a part. Its `Display` is to be read after the part's name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PartProblem {
    /// It is no part, or not as it was written; in words.
    #[error("{0}")]
    Damaged(String),
    /// It has another format, this one.
    #[error("is a part of format {0}; this planisphere reads format {VERSION}", VERSION = VERSION)]
    Version(i64),
    /// This array of it is compressed, and so was saved by another program.
    #[error("its array `{0}` is compressed")]
    Compressed(String),
}

impl PartProblem {
    /// What to do about it.
    pub fn fix(&self) -> &'static str {
        match self {
            Self::Damaged(_) => "write the part again, and hand over all of its bytes",
            Self::Version(_) => "merge with the version of planisphere that wrote it",
            Self::Compressed(_) => {
                "leave the archive as it was written, or save it with numpy.savez, not \
                 savez_compressed"
            }
        }
    }
}

/// Reads a part from its bytes, wherever they come from: a file, a socket, a bucket. `name` is for
/// messages. Pixels are not copied: the part keeps the bytes, which must not change.
///
/// # Errors
/// When the bytes are not a part, or not as they were written.
pub fn read(name: &str, bytes: Bytes) -> Result<Part, PartError> {
    checked(name, bytes).map_err(|problem| PartError { name: name.into(), problem })
}

/// As [`read`].
fn checked(name: &str, bytes: Bytes) -> Result<Part, PartProblem> {
    if bytes.is_empty() {
        return Err(PartProblem::Damaged("is empty".into()));
    }
    let whole: &[u8] = &bytes;
    let archive = ZipArchive::new(io::Cursor::new(whole)).map_err(|error| damaged(&error))?;
    let mut archive = Archive { archive, whole };
    let [version] = archive.integers("version", &[])?;
    if version != VERSION {
        return Err(PartProblem::Version(version));
    }
    let meta = meta(&mut archive)?;
    let Region { width, height, .. } = meta.region;

    let pixels = archive.entry("pixels")?;
    let fields = |id| [("id", id), ("low", "<f8"), ("high", "<f8")];
    let wide = match &pixels.descr {
        descr if is_record(descr, &fields("<i4")) => false,
        descr if is_record(descr, &fields("<i8")) => true,
        _ => return Err(wrong("pixels")),
    };
    let length = Pixels::record(wide) * meta.region.pixels();
    if pixels.shape != [height as usize, width as usize] || pixels.data.len() != length {
        return Err(wrong("pixels"));
    }
    let pixels = Pixels { bytes: bytes.slice(pixels.data), wide };

    let indices = archive.entry("indices")?;
    let [count] = indices.shape[..] else { return Err(wrong("indices")) };
    let numbers = archive.numbers(&indices, "indices", "<i8", &[count], i64::from_le_bytes)?;
    let inside = |index: i64| {
        meta.ranges.iter().any(|range| (range.start as i64..range.end as i64).contains(&index))
    };
    if !(numbers.is_sorted_by(|a, b| a < b) && numbers.iter().all(|&index| inside(index))) {
        return Err(wrong("indices"));
    }
    let indices = numbers.into_iter().map(|index| index as u64).collect();
    let [centers, radii, colors] = ["centers", "radii", "colors"].map(|name| archive.entry(name));
    let centers = archive.numbers(&centers?, "centers", "<f8", &[count, 3], f64::from_le_bytes)?;
    let radii = archive.numbers(&radii?, "radii", "<f8", &[count], f64::from_le_bytes)?;
    let colors = archive.numbers(&colors?, "colors", "|u1", &[count, 3], |[byte]: [u8; 1]| byte)?;
    let spheres = Block {
        centers: Reals::F64(centers.into()),
        radii: Radii::Each(Reals::F64(radii.into())),
        colors: Colors::Each(colors.into()),
    };
    let within = |scene: Scene| {
        let (own, all) = (scene.bounds(), meta.bounds?);
        let inside = own.min_center.cmpge(all.min_center).all()
            && own.max_center.cmple(all.max_center).all();
        (inside && own.min_radius >= all.min_radius && own.max_radius <= all.max_radius)
            .then_some(())
    };
    let scene = Scene::new(vec![spheres.clone()])
        .map_err(|error| PartProblem::Damaged(error.to_string()))?;
    if count > 0 && within(scene).is_none() {
        return Err(wrong("extent"));
    }
    Ok(Part { name: name.into(), meta, pixels, indices, spheres })
}

/// Everything but pixels and spheres.
fn meta(archive: &mut Archive) -> Result<Meta, PartProblem> {
    let image: [i64; 2] = archive.integers("image", &[2])?;
    let [width, height] =
        image.map(|side| u32::try_from(side).ok().filter(|side| (1..=MAX_SIDE).contains(side)));
    let (Some(width), Some(height)) = (width, height) else { return Err(wrong("image")) };
    let image = ImageSize { width, height };
    let region: [i64; 4] = archive.integers("region", &[4])?;
    let [x, y, width, height] = region.map(|side| u32::try_from(side).unwrap_or(u32::MAX));
    let fits = |from: u32, length: u32, side: u32| {
        length > 0 && from.checked_add(length).is_some_and(|end| end <= side)
    };
    if !(fits(x, width, image.width) && fits(y, height, image.height)) {
        return Err(wrong("region"));
    }
    let region = Region { x, y, width, height };

    let projection = match archive.array("projection", "|u1", &[], |[byte]: [u8; 1]| byte)?[..] {
        [0] => Projection::Orthographic,
        [1] => Projection::Perspective,
        _ => return Err(wrong("projection")),
    };
    let mut vector = |name| archive.reals(name, &[3]).map(DVec3::from_array);
    let (origin, view, up) = (vector("origin")?, vector("view")?, vector("up")?);
    let size = match archive.reals("screen", &[2])? {
        [width, height] if height.is_nan() => ScreenSize::Width(width),
        [width, height] if width.is_nan() => ScreenSize::Height(height),
        [width, height] => ScreenSize::Both { width, height },
    };
    let [near, far] = archive.reals("clip", &[2])?;
    let camera = Camera { projection, origin, view, up, size, near, far };
    let none = |error| PartProblem::Damaged(format!("its camera is none: {error}"));
    camera.check().map_err(none)?;
    let background = archive.array("background", "|u1", &[3], |[byte]: [u8; 1]| byte)?;

    let ranges = archive.entry("ranges")?;
    let [count, 2] = ranges.shape[..] else { return Err(wrong("ranges")) };
    let ends = archive.numbers(&ranges, "ranges", "<i8", &[count, 2], i64::from_le_bytes)?;
    let ends: Vec<u64> =
        ends.into_iter().map(|end| u64::try_from(end).unwrap_or(u64::MAX)).collect();
    let ranges: Vec<Range<u64>> = ends.chunks_exact(2).map(|ends| ends[0]..ends[1]).collect();
    let sound = ranges.iter().all(|range| range.start < range.end && range.end <= i64::MAX as u64);
    if !sound || !ranges.is_sorted_by(|a, b| a.end < b.start) {
        return Err(wrong("ranges"));
    }
    let extent: [f64; 8] = archive.reals("extent", &[2, 4])?;
    let bounds = if ranges.is_empty() {
        None
    } else if extent.iter().all(|value| value.is_finite()) {
        let [x, y, z, min_radius, u, v, w, max_radius] = extent;
        let (min_center, max_center) = (DVec3::new(x, y, z), DVec3::new(u, v, w));
        if !(min_center.cmple(max_center).all() && 0.0 < min_radius && min_radius <= max_radius) {
            return Err(wrong("extent"));
        }
        Some(Bounds { min_center, max_center, min_radius, max_radius })
    } else {
        return Err(wrong("extent"));
    };
    let background = background.try_into().map_err(|_| wrong("background"))?;
    Ok(Meta { view: View::new(camera, image), region, background, ranges, bounds })
}

fn wrong(array: &str) -> PartProblem {
    PartProblem::Damaged(format!(
        "is no part of a picture: its array `{array}` is not as it should be"
    ))
}

fn damaged(error: &dyn std::fmt::Display) -> PartProblem {
    PartProblem::Damaged(format!("is no part of a picture, or damaged: {error}"))
}

/// Whether a type is a record of exactly these fields, each with a name and a type.
fn is_record(descr: &Descr, wanted: &[(&str, &str)]) -> bool {
    let Descr::Record(fields) = descr else { return false };
    fields.len() == wanted.len()
        && fields.iter().zip(wanted).all(|(field, (name, code))| {
            field.name == *name
                && field.shape.is_empty()
                && field.descr == Descr::One((*code).into())
        })
}

/// An archive in memory.
struct Archive<'a> {
    archive: ZipArchive<io::Cursor<&'a [u8]>>,
    whole: &'a [u8],
}

/// One array: its type as NumPy writes it, its shape, and where its numbers lie in the archive.
struct Entry {
    descr: Descr,
    shape: Vec<usize>,
    data: Range<usize>,
}

impl Archive<'_> {
    /// Finds an array, and reads it once to see that it is as it was written.
    fn entry(&mut self, name: &str) -> Result<Entry, PartProblem> {
        let missing =
            || PartProblem::Damaged(format!("is no part of a picture: it has no array `{name}`"));
        let index = self.archive.index_for_name(&format!("{name}.npy")).ok_or_else(missing)?;
        let compressed = || PartProblem::Compressed(name.into());
        let mut file = self.archive.by_index(index).map_err(|error| match error {
            ZipError::UnsupportedArchive(_) => compressed(),
            error => damaged(&error),
        })?;
        if file.compression() != CompressionMethod::Stored {
            return Err(compressed());
        }
        io::copy(&mut file, &mut io::sink()).map_err(|error| damaged(&error))?;
        let place = file.data_start().and_then(|start| {
            let start = usize::try_from(start).ok()?;
            Some(start..start.checked_add(usize::try_from(file.size()).ok()?)?)
        });
        let place =
            place.filter(|place| place.end <= self.whole.len()).ok_or_else(|| wrong(name))?;
        let (Header { descr, fortran, shape }, offset) =
            header(&self.whole[place.clone()]).map_err(|error| damaged(&error))?;
        if fortran {
            return Err(wrong(name));
        }
        Ok(Entry { descr, shape, data: place.start + offset..place.end })
    }

    /// The numbers of an array of this type and shape.
    fn numbers<T: Send, const N: usize>(
        &self,
        entry: &Entry,
        name: &str,
        descr: &str,
        shape: &[usize],
        read: fn([u8; N]) -> T,
    ) -> Result<Vec<T>, PartProblem> {
        let count = shape.iter().try_fold(1usize, |count, &n| count.checked_mul(n));
        let length = count.and_then(|count| count.checked_mul(N));
        if entry.descr != Descr::One(descr.into())
            || entry.shape != shape
            || length != Some(entry.data.len())
        {
            return Err(wrong(name));
        }
        Ok(self.whole[entry.data.clone()]
            .as_chunks::<N>()
            .0
            .par_iter()
            .map(|&bytes| read(bytes))
            .collect())
    }

    fn array<T: Send, const N: usize>(
        &mut self,
        name: &str,
        descr: &str,
        shape: &[usize],
        read: fn([u8; N]) -> T,
    ) -> Result<Vec<T>, PartProblem> {
        let entry = self.entry(name)?;
        self.numbers(&entry, name, descr, shape, read)
    }

    fn integers<const N: usize>(
        &mut self,
        name: &str,
        shape: &[usize],
    ) -> Result<[i64; N], PartProblem> {
        self.array(name, "<i8", shape, i64::from_le_bytes)?.try_into().map_err(|_| wrong(name))
    }

    fn reals<const N: usize>(
        &mut self,
        name: &str,
        shape: &[usize],
    ) -> Result<[f64; N], PartProblem> {
        self.array(name, "<f8", shape, f64::from_le_bytes)?.try_into().map_err(|_| wrong(name))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::part::PartWriter;
    use planisphere_core::{part::Pixel, scene::Sphere};

    #[test]
    fn a_part_comes_back_from_bytes() {
        let ball = Sphere { center: DVec3::new(5.0, 0.0, 0.5), radius: 2.0, color: [1, 2, 3] };
        let image = ImageSize { width: 4, height: 3 };
        let meta = Meta {
            view: View::new(Camera::orthographic(DVec3::ZERO, DVec3::X), image),
            region: Region { x: 1, y: 1, width: 2, height: 2 },
            background: [9, 8, 7],
            ranges: vec![Range { start: 40, end: 41 }],
            bounds: Some(Scene::from_spheres(&[ball]).unwrap().bounds()),
        };
        let near = Pixel { id: 40, bounds: [3.0, 3.0] };
        let none = Pixel { id: -1, bounds: [f64::INFINITY; 2] };
        let mut bytes = Vec::new();
        let mut writer = PartWriter::new(&mut bytes, &meta).unwrap();
        writer.pixels([near, none, near, none].into_iter()).unwrap();
        writer.finish([(40, ball)].into_iter()).unwrap();

        let part = read("left", Bytes::from(bytes.clone())).unwrap();
        assert_eq!((part.name.as_str(), &part.meta, &part.indices[..]), ("left", &meta, &[40][..]));
        let records = part.pixels.bytes.chunks_exact(Pixels::record(false));
        let ids: Vec<&[u8]> = records.map(|record| &record[..4]).collect();
        assert_eq!(ids, [40i32, -1, 40, -1].map(i32::to_le_bytes));

        let refused = |bytes: Vec<u8>| match read("left", bytes.into()) {
            Ok(_) => panic!("that is no part"),
            Err(error) => error,
        };
        let empty = refused(Vec::new());
        assert_eq!(empty.problem, PartProblem::Damaged("is empty".into()));
        assert_eq!(
            empty.to_string(),
            "left: is empty; write the part again, and hand over all of its bytes"
        );
        assert!(matches!(refused(b"words".to_vec()).problem, PartProblem::Damaged(_)));
        // A byte of a pixel.
        let mut other = bytes.clone();
        other[200] ^= 1;
        assert!(matches!(refused(other).problem, PartProblem::Damaged(_)));
        bytes.truncate(bytes.len() - 30);
        assert!(matches!(refused(bytes).problem, PartProblem::Damaged(_)));
    }
}
