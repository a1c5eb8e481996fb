//! A camera of which some is left out: the rest is chosen so that the whole scene is seen.
//!
//! Every number that is given stays as it is. What is left out:
//! * a direction: from the origin, if that is given, to the middle of the scene; else from above
//!   the (1, 1) corner;
//! * `up`: z, or y where the direction was chosen and is along z;
//! * a size: a field of view of 40 degrees (perspective), or as wide as the scene is from here
//!   (orthographic);
//! * an origin beside a `view` and a size (orthographic): zero. Such a camera says all there is to
//!   say of what it sees, and parts of a picture that have it fit together;
//! * any other origin: so far back from the middle of the scene, or from the point that is looked
//!   at, that the whole scene is inside of the screen, behind `near` and, where that can be, before
//!   `far`.

use glam::DVec3;

use crate::{
    axes::{Axes, Axis, parallel},
    camera::{Camera, ImageSize, Projection, ScreenSize, View},
    fov::height_from_fov,
    scene::Bounds,
};

/// What is left free around the scene: screens are wider, and distances longer, by this.
const MARGIN: f64 = 1.05;

/// The vertical field of view where none is given, in degrees.
pub const FOV: f64 = 40.0;

/// The size of a perspective screen where none is given.
fn usual_size() -> ScreenSize {
    ScreenSize::Height(height_from_fov(FOV).expect("40 degrees are an angle of a screen"))
}

/// Numbers of a camera; what is none is chosen to suit the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wanted {
    /// Orthographic or perspective.
    pub projection: Projection,
    /// Position, in world units.
    pub origin: Option<DVec3>,
    /// View direction; not beside `look_at`.
    pub view: Option<DVec3>,
    /// A point in the middle of the picture.
    pub look_at: Option<DVec3>,
    /// Which way is up.
    pub up: Option<DVec3>,
    /// Size of the screen.
    pub size: Option<ScreenSize>,
    /// Nearest distance that is seen.
    pub near: f64,
    /// Farthest distance that is seen; infinity for none.
    pub far: f64,
    /// How many times larger things are than on a screen of the size that is given or chosen:
    /// positive.
    pub zoom: f64,
}

impl Default for Wanted {
    fn default() -> Self {
        Self {
            projection: Projection::Orthographic,
            origin: None,
            view: None,
            look_at: None,
            up: None,
            size: None,
            near: 0.0,
            far: f64::INFINITY,
            zoom: 1.0,
        }
    }
}

/// A size divided by a number.
fn divided(size: ScreenSize, by: f64) -> ScreenSize {
    match size {
        ScreenSize::Width(width) => ScreenSize::Width(width / by),
        ScreenSize::Height(height) => ScreenSize::Height(height / by),
        ScreenSize::Both { width, height } => {
            ScreenSize::Both { width: width / by, height: height / by }
        }
    }
}

/// A ball around all spheres: its middle and its radius, at least a little.
fn ball(bounds: &Bounds) -> (DVec3, f64) {
    let center = 0.5 * bounds.min_center + 0.5 * bounds.max_center;
    let half = 0.5 * bounds.max_center - 0.5 * bounds.min_center;
    let reach = length(half) + bounds.max_radius;
    (center, if reach > 0.0 { reach } else { 1.0 })
}

/// The length of a vector. Squares may leave the range of f64: a power of two is taken out, which
/// changes no bit elsewhere.
fn length(vector: DVec3) -> f64 {
    let power =
        f64::from_bits(vector.abs().max_element().to_bits() & (0x7ff << 52)).max(f64::MIN_POSITIVE);
    (vector / power).length() * power
}

/// A vector as long as one unit.
fn unit(vector: DVec3) -> DVec3 {
    (vector / vector.abs().max_element()).normalize()
}

/// How far in front of the middle of the scene a camera stands that sees all of it. `aside`: from
/// the line of sight to the middle.
fn distance(camera: &Camera, image: ImageSize, (center, reach): (DVec3, f64), aside: f64) -> f64 {
    let (near, far) = (camera.near, camera.far);
    // Where f64 are coarse, the origin is rounded: a few steps farther.
    let step = f64::EPSILON * center.abs().max_element();
    let coarse = if step > 1e-3 * reach { 4.0 * step } else { 0.0 };
    let nearest = near + MARGIN * reach + coarse;
    match camera.projection {
        Projection::Orthographic => {
            (2.0 * reach + coarse).min((far - MARGIN * reach).max(nearest)).max(nearest)
        }
        Projection::Perspective => {
            // The ball touches a cone of half angle a at distance reach / sin a.
            let view = View::new(*camera, image);
            let narrow = f64::from(image.width.min(image.height));
            let half_tan = 0.5 * narrow * view.pitch_x.to_f64().min(view.pitch_y.to_f64());
            let touching = MARGIN * reach * (1.0 + half_tan * half_tan).sqrt() / half_tan;
            (touching + MARGIN * aside / half_tan + coarse).max(nearest)
        }
    }
}

/// A screen around a ball, as seen from the camera's origin.
fn fitted(camera: &Camera, image: ImageSize, (center, reach): (DVec3, f64)) -> ScreenSize {
    let axes = Axes::new(camera.view, camera.up);
    let offset = center - camera.origin;
    let half = [axes.right, axes.up].map(Axis::nearest).map(|axis| {
        let aside = offset.dot(axis).abs();
        // Within the margin it is the rounding of an origin that is meant to be straight ahead.
        if aside > 0.01 * reach { reach + aside } else { reach }
    });
    let [across, down] = [image.width, image.height].map(f64::from);
    if half[0] * down >= half[1] * across {
        ScreenSize::Width(2.0 * half[0] * MARGIN)
    } else {
        ScreenSize::Height(2.0 * half[1] * MARGIN)
    }
}

impl Wanted {
    /// Makes rays come from one point, or be parallel. The size of a screen of the other kind means
    /// something else: it is chosen anew.
    pub fn set_perspective(&mut self, perspective: bool) {
        let projection = match perspective {
            true => Projection::Perspective,
            false => Projection::Orthographic,
        };
        if self.projection != projection {
            (self.projection, self.size) = (projection, None);
        }
    }

    /// The camera, if it does not depend on the scene: all that would be chosen to suit it is
    /// given.
    pub fn fixed(&self) -> Option<Camera> {
        let orthographic = self.projection == Projection::Orthographic;
        let complete = orthographic && self.view.is_some() && self.size.is_some();
        let origin = self.origin.or(complete.then_some(DVec3::ZERO))?;
        let view = self.view.or_else(|| Some(self.look_at? - origin))?;
        let size = match self.projection {
            Projection::Orthographic => self.size?,
            Projection::Perspective => self.size.unwrap_or_else(usual_size),
        };
        let up = self.up.unwrap_or(DVec3::Z);
        Some(Camera {
            projection: self.projection,
            origin,
            view,
            up,
            size: divided(size, self.zoom),
            near: self.near,
            far: self.far,
        })
    }

    /// The direction and what is up, once there is a scene to look at.
    fn direction(&self, center: DVec3) -> (DVec3, DVec3) {
        let given = self.view.or_else(|| Some(self.look_at? - self.origin?));
        if let Some(view) = given {
            return (view, self.up.unwrap_or(DVec3::Z));
        }
        let towards = self.origin.map(|origin| center - origin).filter(|view| *view != DVec3::ZERO);
        let corner = DVec3::new(-1.0, -1.0, -0.75);
        match (towards, self.up) {
            (Some(view), None) if parallel(view, DVec3::Z) => (view, DVec3::Y),
            (Some(view), up) => (view, up.unwrap_or(DVec3::Z)),
            (None, Some(up)) if parallel(corner, up) => (DVec3::new(-1.0, 1.0, -0.75), up),
            (None, up) => (corner, up.unwrap_or(DVec3::Z)),
        }
    }

    /// The camera for a scene and an image. What is given stays; [`Camera::check`] says whether all
    /// of it together is a camera.
    pub fn camera(&self, bounds: &Bounds, image: ImageSize) -> Camera {
        if let Some(camera) = self.fixed() {
            return camera;
        }
        let (center, reach) = ball(bounds);
        let (view, up) = self.direction(center);
        let size = self.size.unwrap_or_else(usual_size);
        let &Self { projection, near, far, .. } = self;
        let mut camera = Camera { projection, origin: DVec3::ZERO, view, up, size, near, far };
        if camera.check().is_err() {
            return camera;
        }
        camera.origin = match self.origin {
            Some(origin) => origin,
            None => self.stand_back(&camera, image, (center, reach)),
        };
        if self.size.is_none() && projection == Projection::Orthographic {
            camera.size = fitted(&camera, image, (center, reach));
        }
        camera.size = divided(camera.size, self.zoom);
        camera
    }

    /// The origin of a camera that is complete but for it.
    fn stand_back(
        &self,
        camera: &Camera,
        image: ImageSize,
        (center, reach): (DVec3, f64),
    ) -> DVec3 {
        let direction = unit(camera.view);
        match self.look_at {
            // Spheres so small that the next f64 is outside of all of them: from the middle, their
            // inner walls are seen.
            _ if reach < 0.125 * f64::EPSILON * center.abs().max_element() => center,
            None => center - distance(camera, image, (center, reach), 0.0) * direction,
            Some(point) => {
                let (offset, ahead) = (center - point, (center - point).dot(direction));
                let aside = length(offset - ahead * direction);
                // The point is in front of the camera, too.
                let back = (distance(camera, image, (center, reach), aside) - ahead).max(reach);
                point - back * direction
            }
        }
    }
}

impl Camera {
    /// A camera that sees the whole of a scene: orthographic, from above the (1, 1) corner, for a
    /// file without `[camera]`.
    pub fn framing(bounds: Bounds, image: ImageSize) -> Self {
        Wanted::default().camera(&bounds, image)
    }

    /// Moves the camera along its view direction, and sizes an orthographic screen, so that
    /// everything inside `bounds` is seen.
    pub fn frame(&mut self, bounds: Bounds, image: ImageSize) {
        let &mut Self { projection, view, up, size, .. } = self;
        let size = (projection == Projection::Perspective).then_some(size);
        *self = Wanted { projection, view: Some(view), up: Some(up), size, ..Wanted::default() }
            .camera(&bounds, image);
    }
}
