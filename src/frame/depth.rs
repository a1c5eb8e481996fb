//! Distances of the hits that pixels were coloured from: the depth plane, and bounds for those who merge.
//!
//! The filter's f64 bounds tell most: where both ends of the interval round to the same f32, that is the depth. Elsewhere
//! [`crate::exact::decide`] says which wall of the sphere is seen, and its distance with at least 40 bits whatever cancels;
//! what is left is the rounding to f32. So every depth is within 0.51 units in the last place of the exact one. Which way
//! is taken depends on the sphere, the pixel and the extent of the scene alone: parts and regions give the bytes of the whole.

use rayon::prelude::*;

use crate::{
    camera::{Projection, Region, View},
    exact::decide::{Ball, DISTANCE_ERROR, Tally, Truth},
    filter::{BACK, Look, Margins, Row, Screen, length},
    project::{Projected, Projector},
    scene::Scene,
};

use super::PlaneError;

/// Distances along the view direction (contract: `t`) of the ids of a region of a view; +infinity where the id is -1.
/// Distances beyond f32 are +infinity too.
///
/// # Errors
/// When the region of the view has no picture, or the ids are not those of this region of this view of the scene.
pub fn depth_plane(scene: &Scene, view: &View, region: Region, ids: &[i32]) -> Result<Vec<f32>, PlaneError> {
    view.check(region)?;
    depths(scene, &Truth::new(view, scene.bounds()), region, ids)
}

/// The same for a view that was checked.
///
/// # Errors
/// When the ids are not those of this region of this view of the scene.
pub fn depths(scene: &Scene, truth: &Truth, region: Region, ids: &[i32]) -> Result<Vec<f32>, PlaneError> {
    plane(scene, truth, region, ids, f32::INFINITY, |bounds, distance| match bounds {
        Some([low, high]) if low as f32 == high as f32 => Some(low as f32),
        _ => Some(distance()? as f32),
    })
}

/// Bounds of the distances of the ids of a region, infinite where the id is -1.
///
/// # Errors
/// As [`depths`].
pub fn distance_bounds(scene: &Scene, truth: &Truth, region: Region, ids: &[i32]) -> Result<Vec<[f64; 2]>, PlaneError> {
    plane(scene, truth, region, ids, [f64::INFINITY; 2], |bounds, distance| match bounds {
        Some(bounds) => Some(bounds),
        None => Some(around(distance()?)),
    })
}

/// Distances below this, in world units, may have fewer bits than the rest.
const LEAST: f64 = 1e-290;

/// Certain bounds of what is within [`DISTANCE_ERROR`] of a distance.
fn around(distance: f64) -> [f64; 2] {
    if distance < LEAST {
        return [0.0, 2.0 * LEAST];
    }
    if distance == f64::INFINITY {
        // Beyond f64, or all but.
        return [0.5 * f64::MAX, f64::INFINITY];
    }
    // Twice the error covers the roundings here.
    [distance * (1.0 - 2.0 * DISTANCE_ERROR), distance * (1.0 + 2.0 * DISTANCE_ERROR)]
}

/// A plane of the ids of a region: `value` gets the filter's bounds of a hit's distance, if it has any, and a way to work out the
/// distance with more bits, if there is a hit.
fn plane<T: Copy + Send>(
    scene: &Scene,
    truth: &Truth,
    region: Region,
    ids: &[i32],
    background: T,
    value: impl Fn(Option<[f64; 2]>, &dyn Fn() -> Option<f64>) -> Option<T> + Sync,
) -> Result<Vec<T>, PlaneError> {
    if ids.len() != region.pixels() {
        return Err(PlaneError::Length { ids: ids.len(), region });
    }
    let lens = Lens::new(truth);
    let width = region.width as usize;
    let mut values = vec![background; ids.len()];
    let rows = values.par_chunks_mut(width).zip(ids.par_chunks(width)).zip(region.y..region.y + region.height);
    rows.map(|((values, ids), row)| {
        let mut last = None;
        for ((to, &id), column) in values.iter_mut().zip(ids).zip(region.x..) {
            let Ok(index) = usize::try_from(id) else { continue };
            let (ball, line) = match last {
                Some((known, ball, line)) if known == id => (ball, line),
                _ => {
                    let sphere = scene.sphere(index).ok_or(PlaneError::NoSphere { id, spheres: scene.len() })?;
                    let ball = Ball::from(sphere);
                    (ball, lens.line(ball, row))
                }
            };
            last = Some((id, ball, line));
            let distance = || {
                let pixel = truth.pixel(column, row);
                Some(pixel.distance(&pixel.hit(ball, &mut Tally::default())?))
            };
            let seen = value(lens.bounds(&line, column, row), &distance);
            *to = seen.ok_or(PlaneError::NotSeen { id, column, row })?;
        }
        Ok(())
    })
    .collect::<Result<(), PlaneError>>()?;
    Ok(values)
}

/// The filter, set up for single pixels of a whole view.
struct Lens {
    projector: Projector,
    /// Without the short cut whose bounds depend on other spheres.
    screen: Screen,
}

/// A sphere in a row.
#[derive(Clone, Copy)]
struct Line {
    row: Row,
    margins: Margins,
}

impl Lens {
    fn new(truth: &Truth) -> Self {
        let projector = Projector::new(truth, Region::whole(truth.view().image));
        let screen = Screen { plain: f64::INFINITY, ..projector.screen };
        Self { projector, screen }
    }

    fn line(&self, ball: Ball, row: u32) -> Line {
        let sphere: Projected = self.projector.project(ball.center, ball.radius);
        let sy = self.projector.rows[row as usize];
        match self.projector.projection {
            Projection::Orthographic => {
                Line { row: Row::new::<false>(&sphere, sy), margins: Margins::new::<false>(&sphere, self.screen) }
            }
            Projection::Perspective => {
                Line { row: Row::new::<true>(&sphere, sy), margins: Margins::new::<true>(&sphere, self.screen) }
            }
        }
    }

    /// Bounds of the distance of a hit, world units, if the filter has any that are certain.
    fn bounds(&self, line: &Line, column: u32, row: u32) -> Option<[f64; 2]> {
        let (sx, sy) = (self.projector.columns[column as usize], self.projector.rows[row as usize]);
        let planes = [self.projector.near, self.projector.far];
        let (look, a) = match self.projector.projection {
            Projection::Orthographic => (line.row.look::<false>(&line.margins, planes, f64::INFINITY, sx), 1.0),
            Projection::Perspective => {
                (line.row.look::<true>(&line.margins, planes, f64::INFINITY, sx), length(sx, sy))
            }
        };
        let Look::Seen([low, high]) = look else { return None };
        // From `y` to `t`, and by a power of two to world units, which rounds nothing in this range.
        let (low, high) = (low / a, high / a);
        let (low, high) = (low - BACK * low.abs(), high + BACK * high.abs());
        let (low, high) = (low / self.projector.scale, high / self.projector.scale);
        (low > LEAST && high < 1e290).then_some([low, high])
    }
}

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
                let hit = truth.pixel(column, row).hit(scene.sphere(0).unwrap().into(), &mut Tally::default());
                ids.push(if hit.is_some() { 0 } else { -1 });
            }
        }
        depth_plane(&scene, &view, Region::whole(view.image), &ids).unwrap()
    }

    #[test]
    fn depths_follow_the_walls() {
        let camera = Camera { size: ScreenSize::Width(4.0), ..Camera::orthographic(DVec3::ZERO, DVec3::X) };
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
        let perspective = Camera { projection: Projection::Perspective, size: ScreenSize::Height(2.0), ..camera };
        assert_eq!(plane(perspective, 5, DVec3::new(5.0, 0.0, 0.0), 2.0)[12], 3.0);
        // A planet under the feet: 1e-3 above a radius of 6.4e6.
        let planet = plane(camera, 5, DVec3::new(6.4e6 + 1e-3, 0.0, 0.0), 6.4e6);
        assert!((f64::from(planet[12]) - 1e-3).abs() < 1e-9, "{}", planet[12]);
    }
}
