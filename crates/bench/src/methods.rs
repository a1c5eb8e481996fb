//! The inexact ways to find the nearest sphere that `bench accuracy` holds against ours, in f32 as
//! they are commonly written.
//!
//! All of them look at the same spheres: those of the conservative tile lists of
//! [`planisphere_core::bins`], at the pixels of each sphere's bounding box, roughly front to back,
//! so that they differ in the formula only. Rays are made in f64 and rounded once, and nothing
//! outside a sphere's box is tested: both are kind to them.

use std::time::Instant;

use rayon::prelude::*;

use planisphere_core::{
    bins::{Binner, Entry, KeepAll, Workspace, split},
    camera::{Region, View},
    exact::decide::Truth,
    scene::Scene,
    simd,
};

/// log2 of the side of a tile.
const SHIFT: u32 = 5;
const SIDE: usize = 1 << SHIFT;
const LANES: usize = 16;

/// How a ray is held against a sphere.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Formula {
    /// `b^2 - 4 a c` and `(-b -+ sqrt) / 2 a`.
    Textbook,
    /// The distance of the centre from the ray as `|L|^2 - (L.d)^2`.
    Geometric,
    /// The same distance from the vector itself, and the roots without cancellation (Haines,
    /// Guenther and Akenine-Moller, "Precision improvements for ray / sphere intersection", Ray
    /// Tracing Gems, chapter 7).
    Shifted,
}

/// A picture by a formula.
pub struct Inexact {
    /// Row by row: the nearest sphere, -1 for none.
    pub ids: Vec<i32>,
    /// Their distances.
    pub depths: Vec<f32>,
    /// Pixels that spheres were tested at.
    pub tests: u64,
    /// Milliseconds of the lists, of this.
    pub lists: f64,
}

/// A ray and a sphere, as f32.
#[derive(Clone, Copy)]
struct Pair {
    origin: [f32; 3],
    direction: [f32; 3],
    center: [f32; 3],
    radius: f32,
}

#[inline(always)]
fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
fn minus(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// One formula: the sign that tells a hit, and both roots.
trait Roots {
    fn roots(pair: Pair) -> (f32, f32, f32);
}

struct Textbook;
struct Geometric;
struct Shifted;

impl Roots for Textbook {
    #[inline(always)]
    fn roots(Pair { origin, direction, center, radius }: Pair) -> (f32, f32, f32) {
        let f = minus(origin, center);
        let (a, b, c) =
            (dot(direction, direction), 2.0 * dot(f, direction), dot(f, f) - radius * radius);
        let square = b * b - 4.0 * a * c;
        let root = square.sqrt();
        (square, (-b - root) / (2.0 * a), (-b + root) / (2.0 * a))
    }
}

impl Roots for Geometric {
    #[inline(always)]
    fn roots(Pair { origin, direction, center, radius }: Pair) -> (f32, f32, f32) {
        let l = minus(center, origin);
        let a = dot(direction, direction);
        let along = dot(l, direction) / a;
        let square = radius * radius - (dot(l, l) - along * along * a);
        let half = (square / a).sqrt();
        (square, along - half, along + half)
    }
}

impl Roots for Shifted {
    #[inline(always)]
    fn roots(Pair { origin, direction, center, radius }: Pair) -> (f32, f32, f32) {
        let f = minus(origin, center);
        let a = dot(direction, direction);
        let b = -dot(f, direction);
        let apart = [0, 1, 2].map(|k| f[k] + b / a * direction[k]);
        let square = radius * radius - dot(apart, apart);
        let c = dot(f, f) - radius * radius;
        let root = (a * square).sqrt();
        let q = b + if b < 0.0 { -root } else { root };
        let (one, other) = (c / q, q / a);
        (square, if one < other { one } else { other }, if one < other { other } else { one })
    }
}

/// The rays of a tile and what they have met.
struct Tile {
    rays: [[f32; SIDE * SIDE]; 6],
    depth: [f32; SIDE * SIDE],
    id: [i32; SIDE * SIDE],
}

struct Paint<'a, F> {
    lists: &'a [Entry],
    spheres: &'a Scene,
    planes: [f32; 2],
    tile: &'a mut Tile,
    formula: std::marker::PhantomData<F>,
}

impl<F: Roots> simd::Work for Paint<'_, F> {
    type Output = u64;

    #[inline(always)]
    fn run<L: simd::Lanes>(self) -> u64 {
        let [near, far] = self.planes;
        let mut tests = 0;
        for entry in self.lists {
            let sphere = self.spheres.known(entry.index.at());
            let (center, radius) = (sphere.center.as_vec3().to_array(), sphere.radius as f32);
            let [left, right, top, bottom] = entry.window.map(usize::from);
            for row in top..=bottom {
                for first in (left / LANES * LANES..=right).step_by(LANES) {
                    let at = row * SIDE + first;
                    tests += LANES as u64;
                    let Tile { rays, depth, id } = &mut *self.tile;
                    for k in at..at + LANES {
                        let (origin, direction) = (
                            [rays[0][k], rays[1][k], rays[2][k]],
                            [rays[3][k], rays[4][k], rays[5][k]],
                        );
                        let (square, one, other) =
                            F::roots(Pair { origin, direction, center, radius });
                        let t = if one >= near { one } else { other };
                        let wins = (square >= 0.0) & (t >= near) & (t <= far) & (t < depth[k]);
                        depth[k] = if wins { t } else { depth[k] };
                        id[k] = if wins { entry.index.id() } else { id[k] };
                    }
                }
            }
        }
        tests
    }
}

/// Draws a whole picture by a formula.
pub fn draw(scene: &Scene, view: &View, formula: Formula) -> Inexact {
    let begun = Instant::now();
    let region = Region::whole(view.image);
    let truth = Truth::new(view, scene.bounds());
    let binner = Binner::new(scene, &truth, region, SHIFT);
    let grid = binner.grid;
    let mut workspace = Workspace::<Entry>::default();
    // One wave: scenes here are small.
    let lists = binner.lists(&mut split(0..scene.len()), &KeepAll, usize::MAX, &mut workspace);
    let lists_time = begun.elapsed().as_secs_f64() * 1e3;
    let camera = &view.camera;
    let rays = Rays::new(view);
    let painted: Vec<(Box<Tile>, u64)> = (0..grid.tiles())
        .into_par_iter()
        .map(|number| {
            let (x, y) =
                (number % grid.columns as usize * SIDE, number / grid.columns as usize * SIDE);
            let mut tile = Box::new(Tile {
                rays: [[0.0; SIDE * SIDE]; 6],
                depth: [f32::INFINITY; SIDE * SIDE],
                id: [-1; SIDE * SIDE],
            });
            let mut tests = 0;
            if lists.tile(&grid, number).is_empty() {
                return (tile, tests);
            }
            rays.fill(x, y, &mut tile.rays);
            for slab in 0..grid.slabs {
                let lists = lists.slab(&grid, number, slab);
                if lists.is_empty() {
                    continue;
                }
                let farthest = tile.depth.iter().copied().fold(f32::NEG_INFINITY, f32::max);
                if f64::from(farthest) < grid.slab_start(slab) {
                    break;
                }
                let planes = [camera.near as f32, camera.far as f32];
                macro_rules! paint {
                    ($formula:ty) => {
                        simd::dispatch(Paint {
                            lists,
                            spheres: scene,
                            planes,
                            tile: &mut tile,
                            formula: std::marker::PhantomData::<$formula>,
                        })
                    };
                }
                tests += match formula {
                    Formula::Textbook => paint!(Textbook),
                    Formula::Geometric => paint!(Geometric),
                    Formula::Shifted => paint!(Shifted),
                };
            }
            (tile, tests)
        })
        .collect();
    let width = region.width as usize;
    let (mut ids, mut depths) = (vec![-1; region.pixels()], vec![f32::INFINITY; region.pixels()]);
    let mut tests = 0;
    for (number, (tile, some)) in painted.iter().enumerate() {
        tests += some;
        let (x, y) = (number % grid.columns as usize * SIDE, number / grid.columns as usize * SIDE);
        let across = SIDE.min(width - x);
        for row in 0..SIDE.min(region.height as usize - y) {
            let (to, from) = ((y + row) * width + x, row * SIDE);
            ids[to..to + across].copy_from_slice(&tile.id[from..from + across]);
            depths[to..to + across].copy_from_slice(&tile.depth[from..from + across]);
        }
    }
    Inexact { ids, depths, tests, lists: lists_time }
}

/// Rays of a picture in f64, from which those of a tile are rounded.
struct Rays {
    first: planisphere_core::camera::Ray,
    right: [glam::DVec3; 2],
    down: [glam::DVec3; 2],
}

impl Rays {
    fn new(view: &View) -> Self {
        // Differences over the whole width lose less than those of neighbours.
        let (last_x, last_y) = (view.image.width.max(2) - 1, view.image.height.max(2) - 1);
        let first = view.ray(0, 0);
        let (right, down) = (view.ray(last_x, 0), view.ray(0, last_y));
        let step = |to: planisphere_core::camera::Ray, steps: u32| {
            [
                (to.origin - first.origin) / f64::from(steps),
                (to.direction - first.direction) / f64::from(steps),
            ]
        };
        Self { first, right: step(right, last_x), down: step(down, last_y) }
    }

    fn fill(&self, x: usize, y: usize, rays: &mut [[f32; SIDE * SIDE]; 6]) {
        for row in 0..SIDE {
            for column in 0..SIDE {
                let (i, j) = ((x + column) as f64, (y + row) as f64);
                let origin = self.first.origin + i * self.right[0] + j * self.down[0];
                let direction = self.first.direction + i * self.right[1] + j * self.down[1];
                let numbers = origin.to_array().into_iter().chain(direction.to_array());
                for (ray, number) in rays.iter_mut().zip(numbers) {
                    ray[row * SIDE + column] = number as f32;
                }
            }
        }
    }
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
    fn formulas_are_nearly_right_where_nothing_is_hard() {
        let image = ImageSize { width: 75, height: 66 };
        for recipe in
            [Recipe::new(Kind::Uniform, 100), Recipe::new(Kind::Uniform, 100).in_perspective()]
        {
            let made = recipe.make(image);
            let view = View::new(made.camera, image);
            let exact = reference::exact(&made.scene, &view, Region::whole(image)).ids;
            let hits = exact.iter().filter(|&&id| id >= 0).count();
            assert!(hits > 500);
            for (formula, most) in
                [(Formula::Textbook, 40), (Formula::Geometric, 40), (Formula::Shifted, 5)]
            {
                let drawn = draw(&made.scene, &view, formula);
                let wrong = Wrong::count(&drawn.ids, &exact);
                assert!(wrong.total() <= most, "{}: {formula:?}: {wrong:?} of {hits}", made.name);
                assert!(
                    drawn.tests > 0
                        && drawn
                            .depths
                            .iter()
                            .zip(&drawn.ids)
                            .all(|(d, &id)| d.is_finite() == (id >= 0))
                );
            }
        }
    }
}
