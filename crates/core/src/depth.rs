//! Distances of the hits that pixels were coloured from: the depth plane, and bounds for those who
//! merge.
//!
//! The filter's f64 bounds tell most: where both ends of the interval round to the same f32, that
//! is the depth. Elsewhere [`crate::exact::decide`] says which wall of the sphere is seen, and its
//! distance with at least 40 bits whatever cancels; what is left is the rounding to f32. So every
//! depth is within 0.51 units in the last place of the exact one. Which way is taken depends on the
//! sphere, the pixel and the extent of the scene alone: parts and regions give the bytes of the
//! whole.
//!
//! **Beyond f32.** Infinity is the background's and no hit's. A depth is the nearest *finite* f32:
//! what lies beyond the largest is given as the largest. What lies nearer than half of the least
//! positive f32 is given as 0.

use glam::DVec3;
use rayon::prelude::*;

use crate::{
    axes::{Axes, Axis},
    camera::{Projection, Ray, Region, View, ViewError},
    exact::decide::{Pixel, Tally, Truth},
    filter::{BACK, Look, Margins, Row, Screen, length},
    project::Projector,
    projected::Projected,
    scene::{Ball, Scene},
};

/// Why there is no plane of some ids.
#[derive(Clone, Debug, thiserror::Error, PartialEq)]
pub enum PlaneError {
    /// The region of the view has no picture.
    #[error("{0}")]
    View(#[from] ViewError),
    /// There are not as many ids as pixels.
    #[error(
        "there are {ids} ids for the {} x {} pixels of the region; give one for each",
        .region.width, .region.height
    )]
    Length {
        /// How many there are.
        ids: usize,
        /// For these pixels.
        region: Region,
    },
    /// An id is none of the scene's spheres.
    #[error(
        "id {id} is none of the scene's {spheres} spheres; give ids of this scene, and -1 for the \
         background"
    )]
    NoSphere {
        /// The id.
        id: i32,
        /// Spheres of the scene.
        spheres: usize,
    },
    /// A pixel's ray does not meet the sphere.
    #[error(
        "sphere {id} is not seen at column {column}, row {row}; give the ids of this view of this \
         scene"
    )]
    NotSeen {
        /// The sphere.
        id: i32,
        /// Column in the whole image.
        column: u32,
        /// Row in the whole image.
        row: u32,
    },
}

/// Distances along the view direction (contract: `t`) of the ids of a region of a view; +infinity
/// where the id is -1. Distances beyond f32 are [`f32::MAX`]: a hit's is always finite.
///
/// # Errors
/// When the region of the view has no picture, or the ids are not those of this region of
/// this view of the scene.
pub fn depth_plane(
    scene: &Scene,
    view: &View,
    region: Region,
    ids: &[i32],
) -> Result<Vec<f32>, PlaneError> {
    view.check(region)?;
    depths(scene, &Truth::new(view, scene.bounds()), region, ids)
}

/// The same for a view that was checked.
///
/// # Errors
/// When the ids are not those of this region of this view of the scene.
pub fn depths(
    scene: &Scene,
    truth: &Truth,
    region: Region,
    ids: &[i32],
) -> Result<Vec<f32>, PlaneError> {
    plane(scene, truth, region, ids, f32::INFINITY, |bounds, pixel, ball, _| match bounds {
        Some([low, high]) if low as f32 == high as f32 => Some(nearest(low)),
        _ => Some(nearest(pixel.distance(&pixel.hit(ball, &mut Tally::default())?))),
    })
}

/// The nearest finite f32.
fn nearest(distance: f64) -> f32 {
    (distance as f32).min(f32::MAX)
}

/// Bounds of the distances of the ids of a region, infinite where the id is -1.
///
/// The distance lies between them for certain. They are apart by at most [`BOUNDS_RATIO`] of the
/// upper one, or by [`BOUNDS_APART`] where that is more; both are 0 where the distance is. The
/// lower one is never infinite, the upper one only if the distance is above `f64::MAX (1 - 2^-37)`:
/// no f64 is as large, or none that could be told apart.
///
/// # Errors
/// As [`depths`].
pub fn distance_bounds(
    scene: &Scene,
    truth: &Truth,
    region: Region,
    ids: &[i32],
) -> Result<Vec<[f64; 2]>, PlaneError> {
    plane(scene, truth, region, ids, [f64::INFINITY; 2], |bounds, pixel, ball, _| match bounds {
        Some([low, high]) if high - low <= BOUNDS_RATIO * high => bounds,
        _ => Some(pixel.measure(&pixel.hit(ball, &mut Tally::default())?).bounds()),
    })
}

/// How far [`distance_bounds`] are apart at most, as a part of the upper one.
pub const BOUNDS_RATIO: f64 = f64::from_bits((1023 - 20) << 52);
/// How far they may be apart where that part is less than a few of the least positive numbers.
pub const BOUNDS_APART: f64 = 8.0 * f64::from_bits(1);

/// Bounds of the filter are used inside of these, in world units, where nothing is subnormal.
const USED: [f64; 2] = [1e-290, 1e290];

/// Where the hits of the ids of a region lie, in the world; NaN where the id is -1.
///
/// Each coordinate is the nearest f32 of a number that is within [`POINT_ERROR`] of the exact one,
/// as a part of the greatest length on the way: from the world's origin to the camera's, and from
/// there to the hit. Beyond f32 it is the largest.
///
/// # Errors
/// As [`depths`].
pub fn positions(
    scene: &Scene,
    truth: &Truth,
    region: Region,
    ids: &[i32],
) -> Result<Vec<[f32; 3]>, PlaneError> {
    let rays = Rays::new(truth.view());
    plane(scene, truth, region, ids, [f32::NAN; 3], |bounds, pixel, ball, at| {
        let ray = rays.at(at);
        let point = ray.origin + distance(bounds, 0.0, &pixel, ball)? * ray.direction;
        Some(point.to_array().map(|x| (x as f32).clamp(-f32::MAX, f32::MAX)))
    })
}

/// Unit vectors from the spheres' centres to the hits of the ids of a region, in the world: they
/// point outward, also on inner walls. Zeros where the id is -1, and where f64 do not tell the
/// point from the centre.
///
/// A vector is within `2^-22 + 2 POINT_ERROR L / r` of the exact one, with the sphere's radius r
/// and the greatest length L on the way: from the centre to the camera's origin, and from there to
/// the hit. For spheres whose radius is more than 2^-14 of that it is within 2^-21.
///
/// # Errors
/// As [`depths`].
pub fn normals(
    scene: &Scene,
    truth: &Truth,
    region: Region,
    ids: &[i32],
) -> Result<Vec<[f32; 3]>, PlaneError> {
    let rays = Rays::new(truth.view());
    plane(scene, truth, region, ids, [0.0; 3], |bounds, pixel, ball, at| {
        let distance = distance(bounds, NORMAL_ERROR * ball.radius, &pixel, ball)?;
        // The origin's difference to the centre comes first: both may be far from the world's.
        let (on_screen, direction) = rays.parts(at);
        let offset = (rays.origin - ball.center) + on_screen + distance * direction;
        // Squares of extreme numbers leave the range of f64.
        let normal = (offset / offset.abs().max_element()).try_normalize().unwrap_or(DVec3::ZERO);
        Some(normal.to_array().map(|x| x as f32))
    })
}

/// How far a point in f64 may be off, as a part of the lengths on its way.
pub const POINT_ERROR: f64 = f64::from_bits((1023 - 38) << 52);

/// How far distances may be off for normals, as a part of the radius.
const NORMAL_ERROR: f64 = f64::from_bits((1023 - 24) << 52);

/// The distance of a hit in f64: from bounds that are apart by at most so much, or by 2^-39 of the
/// distance, or worked out.
fn distance(bounds: Option<[f64; 2]>, apart: f64, pixel: &Pixel<'_>, ball: Ball) -> Option<f64> {
    const RATIO: f64 = 2.0 * crate::exact::distance::DISTANCE_ERROR;
    match bounds {
        Some([low, high]) if high - low <= apart.max(RATIO * low) => Some(0.5 * low + 0.5 * high),
        _ => Some(pixel.distance(&pixel.hit(ball, &mut Tally::default())?)),
    }
}

/// The rays of a view in f64: what [`View::ray`] gives, worked out once.
struct Rays {
    projection: Projection,
    origin: DVec3,
    right: DVec3,
    up: DVec3,
    forward: DVec3,
    columns: Vec<f64>,
    rows: Vec<f64>,
}

impl Rays {
    fn new(view: &View) -> Self {
        let axes = Axes::new(view.camera.view, view.camera.up);
        let [right, up, forward] = [axes.right, axes.up, axes.forward].map(Axis::nearest);
        let (x, y) = (0.5 * view.pitch_x.to_f64(), 0.5 * view.pitch_y.to_f64());
        let columns = (0..view.image.width).map(|at| f64::from(view.odd_x(at)) * x).collect();
        let rows = (0..view.image.height).map(|at| f64::from(view.odd_y(at)) * y).collect();
        let (projection, origin) = (view.camera.projection, view.camera.origin);
        Self { projection, origin, right, up, forward, columns, rows }
    }

    /// From the camera's origin to the ray's, and its direction.
    fn parts(&self, [column, row]: [u32; 2]) -> (DVec3, DVec3) {
        let on_screen =
            self.columns[column as usize] * self.right + self.rows[row as usize] * self.up;
        match self.projection {
            Projection::Orthographic => (on_screen, self.forward),
            Projection::Perspective => (DVec3::ZERO, self.forward + on_screen),
        }
    }

    fn at(&self, place: [u32; 2]) -> Ray {
        let (on_screen, direction) = self.parts(place);
        Ray { origin: self.origin + on_screen, direction }
    }
}

/// A plane of the ids of a region: `value` gets the filter's bounds of a hit's distance, if it has
/// any, the pixel, with which it can work out the distance with more bits, the sphere, and the
/// column and row; it gives nothing if the sphere is not hit there.
fn plane<T: Copy + Send>(
    scene: &Scene,
    truth: &Truth,
    region: Region,
    ids: &[i32],
    background: T,
    value: impl Fn(Option<[f64; 2]>, Pixel<'_>, Ball, [u32; 2]) -> Option<T> + Sync,
) -> Result<Vec<T>, PlaneError> {
    if ids.len() != region.pixels() {
        return Err(PlaneError::Length { ids: ids.len(), region });
    }
    let lens = Lens::new(truth);
    let width = region.width as usize;
    let mut values = vec![background; ids.len()];
    let rows = values
        .par_chunks_mut(width)
        .zip(ids.par_chunks(width))
        .zip(region.y..region.y + region.height);
    rows.map(|((values, ids), row)| {
        let mut last = None;
        for ((to, &id), column) in values.iter_mut().zip(ids).zip(region.x..) {
            let Ok(index) = usize::try_from(id) else { continue };
            let (ball, line) = match last {
                Some((known, ball, line)) if known == id => (ball, line),
                _ => {
                    let sphere = scene
                        .sphere(index)
                        .ok_or(PlaneError::NoSphere { id, spheres: scene.len() })?;
                    let ball = Ball::from(sphere);
                    (ball, lens.line(&lens.sphere(ball), row))
                }
            };
            last = Some((id, ball, line));
            let bounds = lens.bounds(&line, column, row);
            let seen = value(bounds, truth.pixel(column, row), ball, [column, row]);
            *to = seen.ok_or(PlaneError::NotSeen { id, column, row })?;
        }
        Ok(())
    })
    .collect::<Result<(), PlaneError>>()?;
    Ok(values)
}

/// The filter, set up for single pixels of a whole view.
pub struct Lens {
    projector: Projector,
    /// Without the short cut whose bounds depend on other spheres.
    screen: Screen,
}

/// A sphere in view space, with its bounds.
#[derive(Clone, Copy)]
pub struct Shown {
    pub(crate) sphere: Projected,
    pub(crate) margins: Margins,
}

/// A sphere in a row.
#[derive(Clone, Copy)]
pub struct Line {
    pub(crate) row: Row,
    pub(crate) margins: Margins,
}

impl Lens {
    /// Of a view.
    pub fn new(truth: &Truth) -> Self {
        let projector = Projector::new(truth, Region::whole(truth.view().image));
        let screen = Screen { plain: f64::INFINITY, ..projector.screen };
        Self { projector, screen }
    }

    /// The camera of the whole image.
    pub fn projector(&self) -> &Projector {
        &self.projector
    }

    /// A sphere.
    pub fn sphere(&self, ball: Ball) -> Shown {
        let sphere = self.projector.project(ball.center, ball.radius);
        let margins = match self.projector.projection {
            Projection::Orthographic => Margins::new::<false>(&sphere, self.screen),
            Projection::Perspective => Margins::new::<true>(&sphere, self.screen),
        };
        Shown { sphere, margins }
    }

    /// The same in a row of the image.
    #[inline(always)]
    pub fn line(&self, &Shown { ref sphere, margins }: &Shown, row: u32) -> Line {
        let sy = self.projector.rows[row as usize];
        let row = match self.projector.projection {
            Projection::Orthographic => Row::new::<false>(sphere, sy),
            Projection::Perspective => Row::new::<true>(sphere, sy),
        };
        Line { row, margins }
    }

    /// Bounds of the distance of a hit, world units, if the filter has any that are certain.
    #[inline(always)]
    pub fn bounds(&self, line: &Line, column: u32, row: u32) -> Option<[f64; 2]> {
        let (sx, sy) = (self.projector.columns[column as usize], self.projector.rows[row as usize]);
        let planes = [self.projector.near, self.projector.far];
        let (look, a) = match self.projector.projection {
            Projection::Orthographic => {
                (line.row.look::<false>(&line.margins, planes, f64::INFINITY, sx), 1.0)
            }
            Projection::Perspective => {
                (line.row.look::<true>(&line.margins, planes, f64::INFINITY, sx), length(sx, sy))
            }
        };
        let Look::Seen([low, high]) = look else { return None };
        // Nothing is subnormal from here on, so that roundings are as `BACK` has them: a sphere
        // that is not vague has `1024 A D <= r` and `D >= 8 u r`, so that `a` is below 2^41.
        if !(low > LEAST_IN_VIEW && high < f64::MAX) {
            return None;
        }
        // From `y` to `t`, and by a power of two to world units, which rounds nothing in this
        // range.
        let (low, high) = (low / a, high / a);
        let (low, high) = (low - BACK * low, high + BACK * high);
        let (low, high) = (low / self.projector.scale, high / self.projector.scale);
        (low > USED[0] && high < USED[1]).then_some([low, high])
    }
}

/// The least depth in view lengths, times `|dir|^2`, of which bounds are used.
const LEAST_IN_VIEW: f64 = f64::from_bits((1023 - 900) << 52);

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::camera::{Camera, ImageSize, Projection, ScreenSize};
    use crate::scene::Sphere;

    /// The one sphere's ids and depths at all pixels.
    fn plane(camera: Camera, size: u32, center: DVec3, radius: f64) -> Vec<f32> {
        let scene = Scene::from_spheres(&[Sphere { center, radius, color: [0; 3] }]).unwrap();
        camera.check().unwrap();
        let view = View::new(camera, ImageSize { width: size, height: size });
        let truth = Truth::new(&view, scene.bounds());
        let mut ids = Vec::new();
        for row in 0..size {
            for column in 0..size {
                let hit = truth
                    .pixel(column, row)
                    .hit(scene.sphere(0).unwrap().into(), &mut Tally::default());
                ids.push(if hit.is_some() { 0 } else { -1 });
            }
        }
        depth_plane(&scene, &view, Region::whole(view.image), &ids).unwrap()
    }

    #[test]
    fn depths_follow_the_walls() {
        let camera =
            Camera { size: ScreenSize::Width(4.0), ..Camera::orthographic(DVec3::ZERO, DVec3::X) };
        let outside = plane(camera, 5, DVec3::new(5.0, 0.0, 0.0), 2.0);
        // Samples at -1.6, -0.8, 0, 0.8, 1.6.
        assert_eq!(outside[12], 3.0);
        assert_eq!(outside[11], (5.0 - (4.0f64 - 0.64).sqrt()) as f32);
        assert_eq!(outside[0], f32::INFINITY);
        let inside = plane(camera, 5, DVec3::new(1.0, 0.0, 0.0), 2.0);
        assert_eq!(inside[12], 3.0);
        let cut = plane(Camera { near: 4.0, ..camera }, 5, DVec3::new(5.0, 0.0, 0.0), 2.0);
        assert_eq!(cut[12], 7.0);
        assert_eq!(
            plane(Camera { near: 4.0, far: 6.0, ..camera }, 5, DVec3::new(5.0, 0.0, 0.0), 2.0)[12],
            f32::INFINITY
        );
        let perspective =
            Camera { projection: Projection::Perspective, size: ScreenSize::Height(2.0), ..camera };
        assert_eq!(plane(perspective, 5, DVec3::new(5.0, 0.0, 0.0), 2.0)[12], 3.0);
        // A planet under the feet: 1e-3 above a radius of 6.4e6.
        let planet = plane(camera, 5, DVec3::new(6.4e6 + 1e-3, 0.0, 0.0), 6.4e6);
        assert!((f64::from(planet[12]) - 1e-3).abs() < 1e-9, "{}", planet[12]);
    }
}
