//! The exact ids that measurements are compared with: every sphere that may be seen at a pixel is
//! decided by [`planisphere_core::exact::decide`].
//!
//! Which spheres may be seen at a pixel comes from the conservative lists of
//! [`planisphere_core::bins`]; plain f64 leaves out what misses or lies behind by a thousand times
//! its bound. The independent judge of the tests shares neither.

use rayon::prelude::*;

use planisphere_core::{
    bins::{Binner, Entry, KeepAll, Workspace, split},
    camera::{Projection, Region, View},
    exact::decide::{Hit, Tally, Truth},
    ids::SphereIndex,
    scene::{Ball, Scene},
};

/// log2 of the side of a tile.
const SHIFT: u32 = 5;
/// Entries of a wave of lists: 84 bytes each.
const WAVE: usize = 1 << 22;

/// What is seen.
pub struct Reference {
    /// Row by row: the nearest sphere, -1 for none.
    pub ids: Vec<i32>,
    /// Pixels that the spheres cover, summed over the spheres, hidden or not.
    pub covered: u64,
}

/// A tile's pixels.
struct State {
    best: Vec<Option<(SphereIndex, Hit)>>,
    /// Upper bound of the best's distance.
    high: Vec<f64>,
    covered: u64,
}

/// Decides a region of a view of a scene.
pub fn exact(scene: &Scene, view: &View, region: Region) -> Reference {
    let truth = Truth::new(view, scene.bounds());
    let binner = Binner::new(scene, &truth, region, SHIFT);
    let grid = binner.grid;
    let side = 1usize << SHIFT;
    let mut tiles: Vec<State> = (0..grid.tiles())
        .map(|_| State {
            best: vec![None; side * side],
            high: vec![f64::INFINITY; side * side],
            covered: 0,
        })
        .collect();
    let mut workspace = Workspace::<Entry>::default();
    let mut left = split(0..scene.len());
    loop {
        let lists = binner.lists(&mut left, &KeepAll, WAVE, &mut workspace);
        tiles.par_iter_mut().enumerate().for_each(|(tile, state)| {
            let corner = [tile % grid.columns as usize * side, tile / grid.columns as usize * side];
            for entry in lists.tile(&grid, tile) {
                decide(&truth, &binner, entry, scene, corner, state);
            }
        });
        if left.iter().all(|left| left.is_empty()) {
            break;
        }
    }
    let width = region.width as usize;
    let mut ids = vec![-1; region.pixels()];
    for (tile, state) in tiles.iter().enumerate() {
        let (x, y) = (tile % grid.columns as usize * side, tile / grid.columns as usize * side);
        for row in y..(y + side).min(region.height as usize) {
            for column in x..(x + side).min(width) {
                if let Some((index, _)) = &state.best[(row - y) * side + column - x] {
                    ids[row * width + column] = index.id();
                }
            }
        }
    }
    Reference { ids, covered: tiles.iter().map(|state| state.covered).sum() }
}

/// One sphere at its pixels of a tile.
fn decide(
    truth: &Truth,
    binner: &Binner,
    entry: &Entry,
    scene: &Scene,
    [x, y]: [usize; 2],
    state: &mut State,
) {
    let (s, projector) = (&entry.sphere, &binner.projector);
    let mut tally = Tally::default();
    let ball = Ball::from(scene.known(entry.index.at()));
    let orthographic = projector.projection == Projection::Orthographic;
    let reach = (s.r + 1e3 * s.bound()) * (1.0 + 1e-9);
    let [left, right, top, bottom] = entry.window.map(usize::from);
    for row in top..=bottom {
        for column in left..=right {
            let at = (row << SHIFT) + column;
            let (sx, sy) = (projector.columns[x + column], projector.rows[y + row]);
            let a = if orthographic { 1.0 } else { 1.0 + sx * sx + sy * sy };
            let apart = if orthographic {
                (sx - s.x) * (sx - s.x) + (sy - s.y) * (sy - s.y)
            } else {
                let (n, m) = (s.z * sx - s.x, s.y - s.z * sy);
                (n * n + m * m + (n * sy + m * sx) * (n * sy + m * sx)) / a
            };
            state.covered += u64::from(apart <= s.r * s.r);
            // In perspective `apart` may be off by much more than the bound where the screen is
            // wide: then no short cut.
            let short_cut = orthographic || projector.screen.kappa < 100.0;
            if short_cut && apart > reach * reach || s.nearest() > state.high[at] {
                continue;
            }
            let (i, j) =
                (projector.region.x + (x + column) as u32, projector.region.y + (y + row) as u32);
            let pixel = truth.pixel(i, j);
            let Some(hit) = pixel.hit(ball, &mut tally) else { continue };
            let wins = state.best[at].as_ref().is_none_or(|(holder, held)| {
                pixel.order(&hit, held, &mut tally).then(entry.index.cmp(holder)).is_lt()
            });
            if wins {
                let high = pixel.interval(&hit)[1] / a;
                state.high[at] = high + 1e-12 * high.abs();
                state.best[at] = Some((entry.index, hit));
            }
        }
    }
}

/// Pixels at which ids are wrong, by kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Wrong {
    /// Background where there is a sphere.
    pub missed: usize,
    /// A sphere where there is background.
    pub extra: usize,
    /// Another sphere.
    pub swapped: usize,
}

impl Wrong {
    /// Counts; what was left undecided is not an answer, and not wrong.
    ///
    /// # Panics
    /// When the pictures differ in size.
    pub fn count(ids: &[i32], exact: &[i32]) -> Self {
        assert_eq!(ids.len(), exact.len(), "ids of one picture");
        let mut wrong = Self::default();
        for (&id, &truth) in ids.iter().zip(exact) {
            match (id, truth) {
                _ if id == truth || id == planisphere_core::ids::UNDECIDED => {}
                (-1, _) => wrong.missed += 1,
                (_, -1) => wrong.extra += 1,
                _ => wrong.swapped += 1,
            }
        }
        wrong
    }

    /// All kinds together.
    pub fn total(self) -> usize {
        self.missed + self.extra + self.swapped
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenes::{Kind, Recipe};
    use planisphere_core::camera::ImageSize;

    /// Every sphere at every pixel, with no lists.
    fn plainly(scene: &Scene, view: &View, region: Region) -> Vec<i32> {
        let truth = Truth::new(view, scene.bounds());
        let ball = |k: usize| (SphereIndex(k as u32), Ball::from(scene.known(k)));
        let balls = || (0..scene.len()).map(ball);
        let pixels = (region.y..region.y + region.height)
            .flat_map(|j| (region.x..region.x + region.width).map(move |i| (i, j)));
        pixels
            .map(|(i, j)| {
                let seen = truth.pixel(i, j).nearest(balls(), &mut Tally::default());
                seen.map_or(-1, SphereIndex::id)
            })
            .collect()
    }

    #[test]
    fn lists_and_short_cuts_leave_nothing_out() {
        let image = ImageSize { width: 70, height: 45 };
        let region = Region { x: 3, y: 5, width: 50, height: 39 };
        for kind in [
            Kind::Uniform,
            Kind::Lattice,
            Kind::Twice,
            Kind::Coincident,
            Kind::Molecule,
            Kind::Hidden,
        ] {
            for recipe in [Recipe::new(kind, 300), Recipe::new(kind, 300).in_perspective()] {
                let made = recipe.make(image);
                let view = View::new(made.camera, image);
                let reference = exact(&made.scene, &view, region);
                assert_eq!(reference.ids, plainly(&made.scene, &view, region), "{}", made.name);
                let hits = reference.ids.iter().filter(|&&id| id >= 0).count() as u64;
                assert!(reference.covered >= hits, "{}", made.name);
            }
        }
    }

    #[test]
    fn wrong_pixels_are_told_apart() {
        let wrong = Wrong::count(&[-1, -1, 3, 3, 3, -2], &[-1, 2, -1, 4, 3, 7]);
        assert_eq!(wrong, Wrong { missed: 1, extra: 1, swapped: 1 });
        assert_eq!(wrong.total(), 3);
    }
}
