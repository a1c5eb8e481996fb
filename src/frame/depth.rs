//! The depth plane: the distance of the hit that each pixel was coloured from.
//!
//! Which wall of the sphere is seen, and its distance, come from [`crate::exact::decide`], with at least 40
//! bits whatever cancels. What is left is the rounding to f32: every depth is within 0.51 units in the last place of the
//! exact one.

use rayon::prelude::*;

use crate::{
    camera::{Region, View},
    exact::decide::{Tally, Truth},
    scene::Scene,
};

/// Distances along the view direction (contract: `t`) of the ids of a region of a view; +infinity where the id is -1.
/// Distances beyond f32 are +infinity too.
///
/// # Panics
/// When the ids are not those of this region and view.
pub fn depth_plane(scene: &Scene, view: &View, region: Region, ids: &[i32]) -> Vec<f32> {
    depths(scene, &Truth::new(view, scene.bounds()), region, ids).expect("the ids are this view's")
}

/// The same for ids that others have found; none when one of them is no sphere that the pixel's ray meets.
///
/// # Panics
/// When there are not as many ids as pixels.
pub fn depths(scene: &Scene, truth: &Truth, region: Region, ids: &[i32]) -> Option<Vec<f32>> {
    assert_eq!(ids.len(), region.pixels(), "the ids are the region's");
    let width = region.width as usize;
    let mut depths = vec![f32::INFINITY; ids.len()];
    let rows = depths.par_chunks_mut(width).zip(ids.par_chunks(width)).zip(region.y..region.y + region.height);
    rows.map(|((depths, ids), row)| {
        for ((depth, &id), column) in depths.iter_mut().zip(ids).zip(region.x..) {
            if let Ok(index) = usize::try_from(id) {
                let pixel = truth.pixel(column, row);
                let hit = pixel.hit(scene.sphere(index).into(), &mut Tally::default())?;
                *depth = pixel.distance(&hit) as f32;
            }
        }
        Some(())
    })
    .collect::<Option<()>>()?;
    Some(depths)
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
                let hit = truth.pixel(column, row).hit(scene.sphere(0).into(), &mut Tally::default());
                ids.push(if hit.is_some() { 0 } else { -1 });
            }
        }
        depth_plane(&scene, &view, Region::whole(view.image), &ids)
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
