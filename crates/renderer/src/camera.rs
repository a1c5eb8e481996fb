//! From where a scene is seen.

use std::ops::Range;

use glam::{DQuat, DVec3};
use planisphere_core::{
    axes::Axes,
    camera::{self, CameraError, ImageSize, MAX_SIDE, Pitch, Projection, ScreenSize, View},
    fov::height_from_fov,
    scene, turn,
};
use rayon::prelude::*;

use crate::{Error, Scene};

/// From where a scene is seen. A camera is always valid: what would break it is an error here, not
/// a black picture later.
///
/// Lengths are world units. Directions may have any length but zero. Points and directions come as
/// anything that becomes `[f64; 3]`: arrays, or the f64 vectors of any mathematics crate (of f32
/// vectors, `v.as_dvec3()` in glam, or `v.map(f64::from)` of an array).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera(camera::Camera);

fn vector(of: impl Into<[f64; 3]>) -> DVec3 {
    DVec3::from_array(of.into())
}

impl Camera {
    /// Parallel rays along (-1, -1, -1), z up. [`Camera::fit`] places it.
    pub fn isometric() -> Self {
        Self(camera::Camera {
            size: ScreenSize::Height(10.0),
            ..camera::Camera::orthographic(DVec3::ZERO, DVec3::NEG_ONE)
        })
    }

    /// Parallel rays along `direction`, from the plane through `eye` on. The picture is `height`
    /// world units high.
    ///
    /// # Errors
    /// When a number is not finite, the direction is zero, or the height is not positive.
    pub fn orthographic(
        eye: impl Into<[f64; 3]>,
        direction: impl Into<[f64; 3]>,
        height: f64,
    ) -> Result<Self, Error> {
        let size = ScreenSize::Height(height);
        let (eye, direction) = (vector(eye), vector(direction));
        Self::checked(camera::Camera { size, ..upright(eye, direction) })
    }

    /// Rays from `eye`. `fov` is the vertical field of view in degrees.
    ///
    /// # Errors
    /// When a number is not finite, the direction is zero, or the angle is not greater than 0 and
    /// less than 180.
    pub fn perspective(
        eye: impl Into<[f64; 3]>,
        direction: impl Into<[f64; 3]>,
        fov: f64,
    ) -> Result<Self, Error> {
        let size = ScreenSize::Height(height_from_fov(fov)?);
        let (eye, direction) = (vector(eye), vector(direction));
        let projection = Projection::Perspective;
        Self::checked(camera::Camera { projection, size, ..upright(eye, direction) })
    }

    /// The same from elsewhere, in another direction. What is up stays, where it was said.
    ///
    /// # Errors
    /// When a number is not finite, or the direction is zero or along what was said to be up.
    pub fn look(
        self,
        eye: impl Into<[f64; 3]>,
        direction: impl Into<[f64; 3]>,
    ) -> Result<Self, Error> {
        let upright = upright(vector(eye), vector(direction));
        let said = self.0.up != DVec3::Z && self.0.up != DVec3::Y;
        let up = if said { self.0.up } else { upright.up };
        Self::checked(camera::Camera { origin: upright.origin, view: upright.view, up, ..self.0 })
    }

    /// Which way is up: z without, and y for a camera that looks along z.
    ///
    /// # Errors
    /// When it is not finite, zero, or along the view direction.
    pub fn up(self, up: impl Into<[f64; 3]>) -> Result<Self, Error> {
        Self::checked(camera::Camera { up: vector(up), ..self.0 })
    }

    /// Nearest and farthest distance along the view direction that is seen, both included. Without
    /// it, from 0 on without end.
    ///
    /// # Errors
    /// When the nearest is negative, or not less than the farthest.
    pub fn clip(self, distances: Range<f64>) -> Result<Self, Error> {
        Self::checked(camera::Camera { near: distances.start, far: distances.end, ..self.0 })
    }

    /// Moved back, and a picture of parallel rays resized, until every sphere just fits into a
    /// picture of some columns and rows, with 4 % to spare. Clip distances are given up; the
    /// direction stays. It looks at every sphere. Where these are so far away or so large that f64
    /// cannot frame them, the camera stays as it is.
    #[must_use]
    pub fn fit(self, scene: &Scene, size: [u32; 2]) -> Self {
        let [width, height] = size;
        let side = |side: u32| side.clamp(1, MAX_SIDE);
        let image = ImageSize { width: side(width), height: side(height) };
        if let Some(fitted) = self.fitted(scene.core(), image) {
            return fitted;
        }
        // Of no spheres, and where squares of numbers leave the range of f64. Of scenes beyond what
        // f64 can frame at all the camera stays.
        let mut core = self.0;
        core.frame(scene.core().bounds(), image);
        Self::checked(core).unwrap_or(self)
    }

    /// As [`Camera::fit`], by what every sphere takes of the screen; none of no spheres, and where
    /// numbers are beyond f64.
    fn fitted(self, scene: &scene::Scene, image: ImageSize) -> Option<Self> {
        let bounds = (!scene.is_empty()).then(|| scene.bounds())?;
        let middle = 0.5 * bounds.min_center + 0.5 * bounds.max_center;
        let axes = Axes::new(self.0.view, self.0.up);
        let axes = [axes.right, axes.up, axes.forward].map(|axis| axis.nearest());
        let [right, up, forward] = axes;
        let mut core = camera::Camera { near: 0.0, far: f64::INFINITY, ..self.0 };
        match core.projection {
            Projection::Orthographic => {
                let [low, high] = extent(scene, |center, radius| {
                    let at = DVec3::from_array(axes.map(|axis| (center - middle).dot(axis)));
                    [at - radius, at + radius]
                });
                let (size, aside) = (MARGIN * (high - low), 0.5 * low + 0.5 * high);
                let [across, down] = [image.width, image.height].map(f64::from);
                core.size = match size.x * down >= size.y * across {
                    true => ScreenSize::Width(size.x),
                    false => ScreenSize::Height(size.y),
                };
                // So far back that nothing is behind the camera when it is turned about the scene.
                let depth = low.z - size.length();
                core.origin = middle + aside.x * right + aside.y * up + depth * forward;
            }
            Projection::Perspective => {
                let view = View::new(core, image);
                let half = |sides: u32, pitch: Pitch| 0.5 * f64::from(sides) * pitch.to_f64();
                let tan = [half(image.width, view.pitch_x), half(image.height, view.pitch_y)];
                // A sphere touches a side of the pyramid where it is `radius / cos` beside it.
                let [_, high] = extent(scene, |center, radius| {
                    let [x, y, z] = axes.map(|axis| (center - middle).dot(axis));
                    let far = |aside: f64, tan: f64| {
                        (aside.abs() + radius * (1.0 + tan * tan).sqrt()) / tan - z
                    };
                    let far = far(x, tan[0]).max(far(y, tan[1])).max(radius - z);
                    [DVec3::splat(far); 2]
                });
                core.origin = middle - MARGIN * high.x * forward;
            }
        }
        Self::checked(core).ok()
    }

    /// Turned about a point, in degrees: `across` about what is up, to the right for positive
    /// angles, and `over` towards what is up. It stays as far away, and clip distances stay. To
    /// keep a whole scene in view, turn first and [`Camera::fit`] after. By angles or about points
    /// that are not finite it is not turned.
    #[must_use]
    pub fn orbit(self, about: impl Into<[f64; 3]>, across: f64, over: f64) -> Self {
        let about = vector(about);
        let camera::Camera { origin, view, up, .. } = self.0;
        let axes = Axes::new(view, up);
        let axis = (up / up.abs().max_element()).normalize();
        let turn = DQuat::from_axis_angle(axis, across.to_radians())
            * DQuat::from_axis_angle(axes.right.nearest(), -over.to_radians());
        let origin = about + turn * (origin - about);
        let view = turn * axes.forward.nearest();
        // A turn over the pole would look along what is up: the camera stays there.
        Self::checked(camera::Camera { origin, view, ..self.0 }).unwrap_or(self)
    }

    /// Turned by `part / of` of a whole turn about the line through a point along `axis`, from
    /// whose tip it goes counterclockwise: a turntable of `of` pictures. It stays as far away, and
    /// clip distances stay; the numbers are the same on every machine.
    ///
    /// # Errors
    /// When `of` is 0, the axis is zero or not finite, or numbers leave the range of `f64`.
    pub fn turned(
        self,
        about: impl Into<[f64; 3]>,
        axis: impl Into<[f64; 3]>,
        part: u32,
        of: u32,
    ) -> Result<Self, Error> {
        let (about, axis) = (vector(about), vector(axis));
        let wrong = |field, words: &str| Err(Error::Camera { field, words: words.into() });
        if of == 0 {
            return wrong("of", "a turn of 0 pictures is none; give 1 or more");
        }
        if !axis.is_finite() || axis == DVec3::ZERO {
            return wrong("axis", "the axis is no direction; give finite numbers, not all 0");
        }
        if !about.is_finite() {
            return wrong("about", "the point is not finite; give finite numbers");
        }
        Self::checked(turn::turned(self.0, about, axis, part, of))
    }

    /// Where it stands, world units.
    pub fn eye(&self) -> [f64; 3] {
        self.0.origin.to_array()
    }

    /// Where it looks: a unit vector.
    pub fn direction(&self) -> [f64; 3] {
        Axes::new(self.0.view, self.0.up).forward.nearest().to_array()
    }

    /// Where the ray of a pixel begins, and its direction, in the world: column and row from the
    /// top left, in a picture of some columns and rows. A distance `t` along the view direction is
    /// at `begin + t direction`: in perspective `direction` is longer than 1 off the middle.
    pub fn ray(&self, size: [u32; 2], pixel: [u32; 2]) -> [[f64; 3]; 2] {
        let [column, row] = pixel;
        let camera::Ray { origin, direction } = self.view(size).ray(column, row);
        [origin.to_array(), direction.to_array()]
    }

    /// Where a point of the world lies in a picture of some columns and rows: column and row, of
    /// which the middles of pixels are whole numbers, and its distance along the view direction.
    /// None behind a camera of perspective.
    pub fn project(&self, size: [u32; 2], point: impl Into<[f64; 3]>) -> Option<[f64; 3]> {
        let (view, axes) = (self.view(size), Axes::new(self.0.view, self.0.up));
        let offset = vector(point) - self.0.origin;
        let [right, up, depth] =
            [axes.right, axes.up, axes.forward].map(|axis| offset.dot(axis.nearest()));
        let length = match self.0.projection {
            Projection::Orthographic => 1.0,
            Projection::Perspective if depth > 0.0 => depth,
            Projection::Perspective => return None,
        };
        let middle = size.map(|side| 0.5 * f64::from(side) - 0.5);
        let x = middle[0] + right / length / view.pitch_x.to_f64();
        let y = middle[1] - up / length / view.pitch_y.to_f64();
        Some([x, y, depth])
    }

    pub(crate) fn view(&self, [width, height]: [u32; 2]) -> View {
        View::new(self.0, ImageSize { width, height })
    }

    fn checked(core: camera::Camera) -> Result<Self, Error> {
        core.check()?;
        Ok(Self(core))
    }
}

/// What is left free around a scene.
const MARGIN: f64 = 1.04;

/// The least and the greatest of what every sphere takes.
fn extent(scene: &scene::Scene, of: impl Fn(DVec3, f64) -> [DVec3; 2] + Sync) -> [DVec3; 2] {
    const PART: usize = 1 << 14;
    let none = || [DVec3::INFINITY, DVec3::NEG_INFINITY];
    let both = |a: [DVec3; 2], b: [DVec3; 2]| [a[0].min(b[0]), a[1].max(b[1])];
    let of_block = |block: &scene::Block| {
        let one = |k: usize| of(block.center(k), block.radius(k));
        if block.len() <= PART {
            return (0..block.len()).map(one).fold(none(), both);
        }
        let parts = (0..block.len()).into_par_iter().with_min_len(PART);
        parts.fold(none, |all, k| both(all, one(k))).reduce(none, both)
    };
    scene.blocks().map(|(_, block)| of_block(block)).fold(none(), both)
}

/// With z up, or y where it looks along z.
fn upright(eye: DVec3, direction: DVec3) -> camera::Camera {
    let along_z = direction.x == 0.0 && direction.y == 0.0 && direction.z != 0.0;
    let up = if along_z { DVec3::Y } else { DVec3::Z };
    camera::Camera { up, ..camera::Camera::orthographic(eye, direction) }
}

/// Of the inner crates, which promise nothing.
#[doc(hidden)]
impl TryFrom<camera::Camera> for Camera {
    type Error = CameraError;

    fn try_from(core: camera::Camera) -> Result<Self, CameraError> {
        core.check()?;
        Ok(Self(core))
    }
}
