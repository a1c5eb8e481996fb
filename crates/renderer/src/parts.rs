//! Parts of a picture: what one machine saw of its spheres, and the whole that they make.

use std::{fmt, io, ops::Range, sync::Arc};

use planisphere_core::{
    camera::Region,
    depth,
    drawing::Control,
    exact::decide::Truth,
    part::{self, Meta, Pixel, Seen, merge::Merge},
};
use planisphere_image::Paint;
use planisphere_io::part::PartWriter;

use crate::{
    Camera, Error, Look, Picture, Renderer, Request, Scene,
    bands::{BAND, PIECE, bands},
    picture::opaque,
    renderer::{drawn, sized},
    subject::{Indices, Subject},
};

/// What one machine saw: ids, bounds of depths, and the exact numbers of the spheres that are seen.
/// Parts of the spheres, or of the pixels, or of both, make the picture that one machine would have
/// drawn of all, byte for byte.
#[derive(Clone)]
pub struct Part(Arc<part::Part>);

impl fmt::Debug for Part {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let part::Part { name, meta, indices, .. } = &*self.0;
        f.debug_struct("Part")
            .field("name", name)
            .field("region", &meta.region)
            .field("spheres", &meta.ranges)
            .field("seen", &indices.len())
            .finish_non_exhaustive()
    }
}

impl Renderer {
    /// What this machine sees of the spheres of a request's scene, of which the first has the index
    /// `first` in the whole: for [`Part::merge`]. All parts of a picture have one camera and one
    /// size; [`Camera::fit`] of a part of the spheres would give each another.
    ///
    /// # Errors
    /// As [`Renderer::draw`].
    pub fn draw_part(&self, request: &Request, first: u64) -> Result<Part, Error> {
        self.with(request, &Control::new(), |engine, control| {
            let ids = drawn(engine, request, control)?.ids;
            of_request(request, first, control, |subject| {
                let Region { y, width, .. } = request.region;
                written(subject, |some| {
                    let start = (some.y - y) as usize * width as usize;
                    Ok(ids[start..start + some.pixels()].to_vec())
                })
            })
        })
    }
}

/// What a request shows, as it goes out; the scene's first sphere has the index `first` in the
/// whole.
pub(crate) fn of_request<T>(
    request: &Request,
    first: u64,
    control: &Control,
    work: impl FnOnce(&Subject) -> Result<T, Error>,
) -> Result<T, Error> {
    let (scene, view) = (request.scene.core(), request.view());
    let spheres = scene.len() as u64;
    let range = (spheres > 0).then(|| first..first + spheres);
    let meta = Meta {
        view,
        region: request.region,
        background: request.look.behind(),
        ranges: range.into_iter().collect(),
        bounds: (spheres > 0).then(|| scene.bounds()),
    };
    let truth = Truth::new(&view, scene.bounds());
    let (meta, truth, indices) = (&meta, &truth, Indices::From { first });
    work(&Subject { meta, scene, truth, indices, band: BAND, control, not_seen: &|_, _, _| None })
}

impl Part {
    /// Merges parts into one: in any order, any number at a time, in steps if need be.
    ///
    /// # Errors
    /// When they are not parts of one picture, overlap, leave a gap of pixels inside of what they
    /// hold together, or contradict each other. Spheres that are in none are no error: see
    /// [`Part::missing`].
    pub fn merge(parts: impl IntoIterator<Item = Part>) -> Result<Self, Error> {
        let parts: Vec<part::Part> = parts.into_iter().map(|part| (*part.0).clone()).collect();
        let merge = Merge::new(&parts, None)?;
        merged(&merge, &Control::new(), |subject| {
            written(subject, |some| Ok(merge.band(some)?.ids))
        })
    }

    /// The first spheres, and the first pixels, that the part does not hold: of all spheres up to
    /// the last that it does, and of the whole picture. None if it is a whole picture; that spheres
    /// come after its last, it cannot know.
    pub fn missing(&self) -> Option<(Range<u64>, Region)> {
        let Meta { view, region, ranges, .. } = &self.0.meta;
        let whole = Region::whole(view.image);
        let mut next = 0;
        for range in ranges {
            if range.start > next {
                return Some((next..range.start, whole));
            }
            next = range.end;
        }
        let below = (region.y + region.height, whole.height);
        let aside = (region.x + region.width, whole.width);
        let rows = |y, end| Region { y, height: end - y, ..whole };
        let columns = |x, end| Region { x, width: end - x, ..*region };
        let missing = if region.y > 0 {
            rows(0, region.y)
        } else if region.x > 0 {
            columns(0, region.x)
        } else if aside.0 < aside.1 {
            columns(aside.0, aside.1)
        } else if below.0 < below.1 {
            rows(below.0, below.1)
        } else {
            return None;
        };
        Some((0..next, missing))
    }

    /// The planes of what the part holds: colours, ids, and depths.
    ///
    /// # Errors
    /// When it is damaged, or an index is beyond what `i32` holds.
    pub fn picture(&self, look: &Look) -> Result<Picture, Error> {
        let parts = [(*self.0).clone()];
        let merge = Merge::new(&parts, None)?;
        let meta = merge.meta();
        if let Some(last) = meta.last().filter(|&last| last > i32::MAX as u64) {
            return Err(Error::Size { what: "spheres", found: last, limit: i32::MAX as u64 });
        }
        let (scene, region) = (Scene::from(merge.scene().clone()), meta.region);
        let image = meta.view.image;
        let camera = Camera::try_from(meta.view.camera)?;
        let request = Request::new(&scene, camera, [image.width, image.height])?;
        let request = request.region(region)?.look(look.clone()).with_depth();
        let places = merge.band(region)?.ids;
        let (mut rgba, mut depth) = (Vec::new(), Vec::new());
        sized(&mut rgba, places.len(), "colors")?;
        let paint = Paint { scene: merge.scene(), background: look.behind() };
        paint.fill(&places, &mut rgba, opaque)?;
        depth.extend(merged(&merge, &Control::new(), |subject| subject.depths(region, &places))?);
        let indices: Arc<[u64]> = merge.indices().into();
        let index = |&place: &i32| usize::try_from(place).map_or(-1, |place| indices[place] as i32);
        let ids = places.iter().map(index).collect();
        let (request, indices) = (Some(request), Some(Arc::clone(&indices)));
        Ok(Picture { request, ids, rgba: rgba.into(), depth, indices, ..Picture::default() })
    }

    /// The part as bytes (`.npz`), to a file, a socket, a bucket.
    ///
    /// # Errors
    /// The writer's.
    pub fn write(&self, out: impl io::Write) -> Result<(), Error> {
        let part::Part { meta, indices, spheres, .. } = &*self.0;
        let mut writer = PartWriter::new(out, meta)?;
        let Region { x, width, .. } = meta.region;
        for row in meta.region.y..meta.region.y + meta.region.height {
            writer.pixels(self.0.row(row, x..x + width))?;
        }
        let seen = indices.iter().enumerate().map(|(at, &index)| (index, spheres.sphere(at)));
        Ok(writer.finish(seen)?)
    }

    /// And back, from any owner of bytes, which are kept and must not change. All is checked.
    ///
    /// # Errors
    /// When they are no part, or not as it was written.
    pub fn read(bytes: impl AsRef<[u8]> + Send + 'static) -> Result<Self, Error> {
        let mut part = planisphere_io::part::read("the part", bytes::Bytes::from_owner(bytes))?;
        let Meta { region: Region { x, y, width, height }, ranges, .. } = &part.meta;
        let spheres = match (ranges.first(), ranges.last()) {
            (Some(first), Some(last)) => format!("spheres {} to {}", first.start, last.end - 1),
            _ => "no spheres".into(),
        };
        part.name = format!("the part of {spheres} in {x},{y},{width},{height}");
        Ok(Self(Arc::new(part)))
    }
}

/// A part of what a subject has; `ids` gives those of some rows.
fn written(
    subject: &Subject,
    mut ids: impl FnMut(Region) -> Result<Vec<i32>, Error>,
) -> Result<Part, Error> {
    let mut bytes = Vec::new();
    let mut plane = PartPlane::begin(&mut bytes, subject)?;
    for some in bands(subject.meta.region, PIECE) {
        subject.control.check()?;
        let ids = ids(some)?;
        let bounds = PartPlane::<&mut Vec<u8>>::bounds(subject, some, &ids)?;
        plane.take(subject, &ids, bounds)?;
    }
    plane.finish(subject)?;
    Part::read(bytes)
}

/// What is merged, as it goes out.
pub(crate) fn merged<T>(
    merge: &Merge,
    control: &Control,
    work: impl FnOnce(&Subject) -> Result<T, Error>,
) -> Result<T, Error> {
    let (meta, scene, truth) = (merge.meta(), merge.scene(), merge.truth());
    let indices = Indices::Each(merge.indices());
    let not_seen = |id, column, row| Some(merge.not_seen(id, column, row));
    work(&Subject { meta, scene, truth, indices, band: MERGED, control, not_seen: &not_seen })
}

/// Pixels that are merged at a time.
const MERGED: usize = 1 << 22;

/// What merging needs, on its way into bytes.
pub(crate) struct PartPlane<'a, W: io::Write> {
    writer: PartWriter<'a, W>,
    seen: Seen,
}

impl<'a, W: io::Write> PartPlane<'a, W> {
    /// Begins the archive.
    pub fn begin(out: W, subject: &Subject<'a>) -> io::Result<Self> {
        let writer = PartWriter::new(out, subject.meta)?;
        Ok(Self { writer, seen: Seen::new(subject.scene.len()) })
    }

    /// What the distances of some pixels lie between.
    pub fn bounds(subject: &Subject, some: Region, ids: &[i32]) -> Result<Vec<[f64; 2]>, Error> {
        depth::distance_bounds(subject.scene, subject.truth, some, ids)
            .map_err(|error| subject.refused(error))
    }

    /// Takes the next pixels.
    pub fn take(
        &mut self,
        subject: &Subject,
        ids: &[i32],
        bounds: Vec<[f64; 2]>,
    ) -> io::Result<()> {
        self.seen.mark(ids);
        let indices = &subject.indices;
        let pixel = |(&id, bounds)| Pixel { id: indices.of_id(id), bounds };
        self.writer.pixels(ids.iter().zip(bounds).map(pixel))
    }

    /// Ends the archive, with the spheres that are seen.
    pub fn finish(self, subject: &Subject) -> io::Result<()> {
        let Subject { scene, indices, .. } = subject;
        let spheres = self.seen.iter().map(|place| (indices.of(place), scene.known(place)));
        self.writer.finish(spheres)
    }
}
