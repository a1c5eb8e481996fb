//! From where a scene is seen.

use std::ops::Range;

use glam::{DQuat, DVec3};
use planisphere_core::{
    axes::Axes,
    camera::{self, CameraError, ImageSize, MAX_SIDE, Projection, ScreenSize, View},
    fov::height_from_fov,
};

use crate::{Error, Scene};

/// From where a scene is seen. A camera is always valid: what would break it is an error here, not
/// a black picture later.
///
/// Lengths are world units. Directions may have any length but zero. Points and directions come as
/// anything that becomes `[f64; 3]`: arrays, or the vectors of any mathematics crate.
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

    /// The same from elsewhere, in another direction.
    ///
    /// # Errors
    /// When a number is not finite, or the direction is zero or along what is up.
    pub fn look(
        self,
        eye: impl Into<[f64; 3]>,
        direction: impl Into<[f64; 3]>,
    ) -> Result<Self, Error> {
        Self::checked(camera::Camera { origin: vector(eye), view: vector(direction), ..self.0 })
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
    /// picture of some columns and rows. Clip distances are given up.
    #[must_use]
    pub fn fit(self, scene: &Scene, [width, height]: [u32; 2]) -> Self {
        let mut core = self.0;
        let side = |side: u32| side.clamp(1, MAX_SIDE);
        let image = ImageSize { width: side(width), height: side(height) };
        core.frame(scene.core().bounds(), image);
        // Of scenes beyond what f64 can frame the camera stays.
        Self::checked(core).unwrap_or(self)
    }

    /// Turned about a point, in degrees: `across` about what is up, to the right for positive
    /// angles, and `over` towards what is up. It stays as far away, and clip distances stay.
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

    /// Where it stands, world units.
    pub fn eye(&self) -> [f64; 3] {
        self.0.origin.to_array()
    }

    /// Where it looks: a unit vector.
    pub fn direction(&self) -> [f64; 3] {
        Axes::new(self.0.view, self.0.up).forward.nearest().to_array()
    }

    /// Where the ray of a pixel begins, and its direction, in the world: column and row from the
    /// top left, in a picture of some columns and rows. A distance `t` is at `begin + t direction`.
    pub fn ray(&self, size: [u32; 2], [column, row]: [u32; 2]) -> [[f64; 3]; 2] {
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
