//! What was drawn: planes of pixels, and what is met at one.

use std::{
    fmt,
    sync::{Arc, OnceLock},
    time::Duration,
};

use glam::DVec3;
use planisphere_core::{
    camera::{Region, View},
    drawing::{Control, Counts},
    exact::decide::{Root, Tally, Truth},
};
use planisphere_image::{
    Paint,
    compare::{Difference, Pixels, compare},
};
#[cfg(feature = "png")]
use planisphere_io::png;

use crate::Request;
#[cfg(feature = "png")]
use crate::{
    Error,
    bands::{PIECE, bands},
};

/// Planes of pixels, row by row from the top, and what they are of. A plane that was not asked for
/// is empty.
#[derive(Clone, Default)]
pub struct Picture {
    /// None of a picture that nothing was drawn into yet.
    pub(crate) request: Option<Request>,
    pub(crate) ids: Vec<i32>,
    /// Made when it is first asked for, unless memory for it was there.
    pub(crate) rgba: OnceLock<Vec<[u8; 4]>>,
    pub(crate) depth: Vec<f32>,
    pub(crate) counts: Counts,
    pub(crate) elapsed: Duration,
    pub(crate) by: Option<String>,
    /// Of the job in whose turn it is looked at.
    pub(crate) control: Option<Control>,
    /// What the scene's spheres are called, rising, where that is not their place in it.
    pub(crate) indices: Option<Arc<[u64]>>,
}

impl fmt::Debug for Picture {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Picture")
            .field("size", &self.size())
            .field("color", &self.has_colors())
            .field("depth", &!self.depth.is_empty())
            .field("elapsed", &self.elapsed)
            .finish_non_exhaustive()
    }
}

/// A colour without transparency.
pub(crate) fn opaque([r, g, b]: [u8; 3]) -> [u8; 4] {
    [r, g, b, 255]
}

/// What a ray meets first.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Hit {
    /// Index of the sphere in the scene.
    pub index: usize,
    /// Distance along the view direction, world units.
    pub depth: f64,
    /// Where, in the world.
    pub point: [f64; 3],
    /// Unit vector from the sphere's centre to the point; zero where f64 do not tell these apart.
    pub normal: [f64; 3],
    /// Whether it is the inner wall: the camera, or the nearest distance that is seen, lies inside
    /// of the sphere.
    pub inside: bool,
}

impl Hit {
    /// What a sphere's hit at a pixel of the whole image is; none if its ray does not meet it.
    pub(crate) fn of(request: &Request, [column, row]: [u32; 2], index: usize) -> Option<Self> {
        let (core, view) = (request.scene.core(), request.view());
        let sphere = core.sphere(index)?;
        let truth = Truth::new(&view, core.bounds());
        let pixel = truth.pixel(column, row);
        let hit = pixel.hit(sphere.into(), &mut Tally::default())?;
        let depth = pixel.distance(&hit);
        let ray = view.ray(column, row);
        let point = ray.origin + depth * ray.direction;
        let offset = point - sphere.center;
        // Squares of extreme numbers leave the range of f64.
        let normal = (offset / offset.abs().max_element()).try_normalize().unwrap_or(DVec3::ZERO);
        let inside = hit.root() == Root::Far;
        let (point, normal) = (point.to_array(), normal.to_array());
        Some(Self { index, depth, point, normal, inside })
    }
}

impl Picture {
    /// Columns and rows: of the region that was drawn.
    pub fn size(&self) -> [u32; 2] {
        let region = self.region();
        [region.width, region.height]
    }

    /// Index of the sphere at each pixel, -1 for none.
    pub fn ids(&self) -> &[i32] {
        &self.ids
    }

    /// Distance along the view direction at each pixel, world units; infinite for none.
    pub fn depth(&self) -> &[f32] {
        &self.depth
    }

    /// sRGB and straight alpha, 8 bits each. They are made when they are first asked for: a picture
    /// that is only saved needs none of them.
    pub fn rgba(&self) -> &[[u8; 4]] {
        // Not inside of the lock, where no rayon may be (`planisphere_core::pool`). Two who ask at
        // once may find the same twice.
        match self.rgba.get() {
            Some(rgba) => rgba,
            None => {
                let rgba = self.colored();
                self.rgba.get_or_init(|| rgba)
            }
        }
    }

    /// The colours of the ids.
    fn colored(&self) -> Vec<[u8; 4]> {
        let Some(paint) = self.paint() else { return Vec::new() };
        let mut rgba = vec![[0; 4]; self.ids.len()];
        let filled = paint.fill(&self.ids, &mut rgba, opaque);
        filled.expect("the ids are of this scene");
        rgba
    }

    /// What gives the ids their colours, if these were asked for.
    fn paint(&self) -> Option<Paint<'_>> {
        let request = self.request.as_ref().filter(|request| request.color)?;
        Some(Paint { scene: request.scene.core(), background: request.look.behind() })
    }

    fn has_colors(&self) -> bool {
        self.request.as_ref().is_some_and(|request| request.color)
    }

    /// The same without alpha, as most encoders want it.
    pub fn to_rgb(&self) -> Vec<[u8; 3]> {
        self.rgba().iter().map(|&[r, g, b, _]| [r, g, b]).collect()
    }

    /// Colours, ids and depths: the planes themselves.
    pub fn into_planes(self) -> (Vec<[u8; 4]>, Vec<i32>, Vec<f32>) {
        self.rgba();
        (self.rgba.into_inner().unwrap_or_default(), self.ids, self.depth)
    }

    /// What is seen at a pixel, column and row from the top left of what was drawn: of a region,
    /// from its own corner. None where nothing is, and outside of the picture.
    pub fn hit(&self, pixel: [u32; 2]) -> Option<Hit> {
        let [column, row] = pixel;
        let Region { x, y, width, height } = self.region();
        if column >= width || row >= height {
            return None;
        }
        let id = *self.ids.get(row as usize * width as usize + column as usize)?;
        let index = usize::try_from(id).ok()?;
        let place = match &self.indices {
            None => index,
            Some(indices) => indices.binary_search(&(index as u64)).ok()?,
        };
        let hit = Hit::of(self.request.as_ref()?, [x + column, y + row], place)?;
        Some(Hit { index, ..hit })
    }

    /// A PNG, RGB with 8 bits a channel, to any writer. In the turn of a job
    /// ([`crate::Renderer::start_with`]) it ends when that is cancelled.
    ///
    /// # Errors
    /// When the picture was drawn without colours, or the writer fails.
    #[cfg(feature = "png")]
    pub fn write_png(&self, mut out: impl std::io::Write) -> Result<(), Error> {
        let (Some(request), Some(paint)) = (&self.request, self.paint()) else {
            return Err(Error::NoPlane { plane: "colors" });
        };
        match self.indices {
            None if request.is_plain() => self.write_rows(&mut out, paint)?,
            _ => png::write_rgb(&mut out, self.size(), &self.to_rgb())?,
        }
        // Colours may lie in files as well.
        request.scene.check()
    }

    /// The ids as a PNG, some rows at a time.
    #[cfg(feature = "png")]
    fn write_rows(&self, out: impl std::io::Write, paint: Paint) -> Result<(), Error> {
        let region = self.region();
        let about = png::About { size: self.size(), ..png::About::default() };
        let mut rows = png::PngRows::new(out, &about, paint)?;
        for some in bands(region, PIECE) {
            let start = (some.y - region.y) as usize * region.width as usize;
            rows.push(&self.ids[start..start + some.pixels()])?;
            if let Some(control) = &self.control {
                control.check()?;
                control.reach((start + some.pixels()) as f32 / region.pixels() as f32);
            }
        }
        Ok(rows.finish()?)
    }

    /// A PNG file, whole or not at all: one that was there stays as it is until the new one is
    /// complete.
    ///
    /// # Errors
    /// When the picture was drawn without colours, its name has the ending of another format, or
    /// the file cannot be written.
    #[cfg(feature = "files")]
    pub fn save(&self, path: impl AsRef<std::path::Path>) -> Result<(), Error> {
        use planisphere_io::output::{self, Target};

        let target = Target::File(path.as_ref().to_path_buf());
        target.check_ending("the picture", "a picture", "png")?;
        target.check()?;
        let mut sink = target.clone().open()?;
        self.write_png(&mut sink).map_err(|error| match error {
            Error::Io(error) => target.io(error).into(),
            other => other,
        })?;
        output::commit(vec![sink.finish()?])?;
        Ok(())
    }

    /// Pixel by pixel against another.
    pub fn compare(&self, other: &Picture) -> Difference {
        compare(self.pixels(), other.pixels(), 0)
    }

    /// As it is compared.
    #[doc(hidden)]
    pub fn pixels(&self) -> Pixels<'_> {
        Pixels { size: self.size(), rgba: self.rgba() }
    }

    /// How long it took, from the call to the last byte.
    pub fn elapsed(&self) -> Duration {
        self.elapsed
    }

    /// Pixels that took exact arithmetic.
    pub fn exact(&self) -> u64 {
        self.counts.exact as u64
    }

    /// What drew it where that was not the renderer's own device, and why: the picture is the same.
    pub fn drawn_by(&self) -> Option<&str> {
        self.by.as_deref()
    }

    pub(crate) fn region(&self) -> Region {
        let none = Region { x: 0, y: 0, width: 0, height: 0 };
        self.request.as_ref().map_or(none, |request| request.region)
    }

    /// The view that it is of.
    #[doc(hidden)]
    pub fn view(&self) -> Option<View> {
        self.request.as_ref().map(Request::view)
    }
}
