//! The loop that anybody writes first, as a baseline on the CPU: at every pixel every sphere, one
//! at a time, in f32.

use rayon::prelude::*;

use planisphere_core::{
    camera::{Projection, Region, View},
    exact::decide::Truth,
    project::Projector,
    scene::Scene,
};

/// Ids by plain f32; rows are spread over the cores. Some pixels are wrong.
pub fn draw(scene: &Scene, view: &View, region: Region) -> Vec<i32> {
    let projector = Projector::new(&Truth::new(view, scene.bounds()), region);
    let mut spheres = Vec::with_capacity(scene.len());
    for (_, block) in scene.blocks() {
        for index in 0..block.len() {
            let s = projector.project(block.center(index), block.radius(index));
            spheres.push([s.x, s.y, s.z, s.r].map(|v| v as f32));
        }
    }
    let planes = [projector.near, projector.far].map(|plane| plane as f32);
    let mut ids = vec![-1; region.pixels()];
    ids.par_chunks_mut(region.width as usize).enumerate().for_each(|(row, ids)| {
        let sy = projector.rows[row] as f32;
        for (id, &sx) in ids.iter_mut().zip(&projector.columns) {
            *id = match projector.projection {
                Projection::Orthographic => nearest(&spheres, planes, |[x, y, z, r]| {
                    let (dx, dy) = (sx as f32 - x, sy - y);
                    (z, r * r - dx * dx - dy * dy, 1.0)
                }),
                Projection::Perspective => nearest(&spheres, planes, |[x, y, z, r]| {
                    let sx = sx as f32;
                    let a = sx * sx + sy * sy + 1.0;
                    let b = x * sx + y * sy + z;
                    (b, b * b - a * (x * x + y * y + z * z - r * r), a)
                }),
            };
        }
    });
    ids
}

/// `test` gives `b`, `q` and `a` of the roots `(b -+ sqrt q) / a`.
#[inline(always)]
fn nearest(
    spheres: &[[f32; 4]],
    [near, far]: [f32; 2],
    test: impl Fn([f32; 4]) -> (f32, f32, f32),
) -> i32 {
    let (mut best, mut id) = (f32::INFINITY, -1);
    for (index, &sphere) in spheres.iter().enumerate() {
        let (b, q, a) = test(sphere);
        if q >= 0.0 {
            let root = q.sqrt();
            let first = (b - root) / a;
            let t = if first >= near { first } else { (b + root) / a };
            if t >= near && t <= far && t < best {
                (best, id) = (t, index as i32);
            }
        }
    }
    id
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        reference::{self, Wrong},
        scenes::{Kind, Recipe},
    };
    use planisphere_core::camera::ImageSize;

    #[test]
    fn it_is_nearly_right() {
        let image = ImageSize { width: 64, height: 64 };
        for recipe in
            [Recipe::new(Kind::Uniform, 200), Recipe::new(Kind::Uniform, 200).in_perspective()]
        {
            let made = recipe.make(image);
            let (view, region) = (View::new(made.camera, image), Region::whole(image));
            let exact = reference::exact(&made.scene, &view, region).ids;
            let wrong = Wrong::count(&draw(&made.scene, &view, region), &exact);
            assert!(wrong.total() < 10, "{wrong:?}");
        }
    }
}
