//! The pixels that the device's filter left over: decided on the host among the spheres of their tiles.
//!
//! First by f64 with the bounds of the native device ([`crate::filter`]), and where those do not tell, exactly. As there, the holder of a
//! pixel is exact at all times, so lists may come in any order and in any number of waves.

use rayon::prelude::*;

use super::lists::{Spheres, Wave};
use crate::{
    camera::{Projection, Region},
    exact::decide::{Ball, Tally, Truth},
    filter::{Look, Margins, Row},
    plan::{NONE, TILE, UNDECIDED},
    project::{Projected, Projector},
    scene::Scene,
};

/// A pixel and the nearest sphere so far.
struct Cell {
    /// Place inside the region.
    column: u32,
    row: u32,
    /// Bounds of the holder's depth times |dir|^2, in view lengths.
    low: f64,
    high: f64,
    holder: Option<u32>,
}

/// The pixels to decide, by tile.
pub struct Undecided {
    tiles: Vec<(u32, Vec<Cell>)>,
    /// How many pixels.
    pub pixels: usize,
}

impl Undecided {
    /// Gathers them from some tiles of a region whose tiles come `columns` to a row.
    pub fn find(tiles: &[u32], ids: &[i32], region: Region, columns: u32) -> Self {
        let tiles: Vec<(u32, Vec<Cell>)> = tiles
            .par_iter()
            .map(|&tile| {
                let (x, y) = (tile % columns * TILE, tile / columns * TILE);
                let (right, bottom) = (region.width.min(x + TILE), region.height.min(y + TILE));
                let pixels = (y..bottom).flat_map(|row| (x..right).map(move |column| (column, row)));
                let left_over = pixels
                    .filter(|&(column, row)| ids[row as usize * region.width as usize + column as usize] == UNDECIDED);
                let (low, high) = (f64::INFINITY, f64::INFINITY);
                (tile, left_over.map(|(column, row)| Cell { column, row, low, high, holder: None }).collect())
            })
            .collect();
        let pixels = tiles.iter().map(|(_, cells)| cells.len()).sum();
        Self { tiles, pixels }
    }

    /// Which tiles have any.
    pub fn mask(&self, tiles: usize) -> Vec<bool> {
        let mut mask = vec![false; tiles];
        self.tiles.iter().for_each(|(tile, _)| mask[*tile as usize] = true);
        mask
    }

    /// Looks at the spheres of a wave.
    pub fn look(&mut self, spheres: Spheres<'_>, projector: &Projector, wave: &Wave) -> Tally {
        let Spheres { scene, truth, order } = spheres;
        self.tiles
            .par_iter_mut()
            .map(|(tile, cells)| {
                let mut tally = Tally::default();
                for &place in wave.tile(*tile as usize) {
                    let index = order.index(place);
                    let ball = Ball::from(scene.sphere(index as usize));
                    let candidate = Candidate::new(projector, index, ball);
                    for cell in &mut *cells {
                        candidate.meet(scene, truth, projector, cell, &mut tally);
                    }
                }
                tally
            })
            .reduce(Tally::default, |mut a, b| {
                a += b;
                a
            })
    }

    /// Writes what was decided.
    pub fn write(&self, ids: &mut [i32], region: Region) {
        for cell in self.tiles.iter().flat_map(|(_, cells)| cells) {
            let at = cell.row as usize * region.width as usize + cell.column as usize;
            ids[at] = cell.holder.map_or(NONE, |index| index as i32);
        }
    }
}

/// A sphere that may be nearest.
struct Candidate {
    index: u32,
    ball: Ball,
    sphere: Projected,
    margins: Margins,
}

impl Candidate {
    fn new(projector: &Projector, index: u32, ball: Ball) -> Self {
        let sphere = projector.project(ball.center, ball.radius);
        let margins = match projector.projection {
            Projection::Orthographic => Margins::new::<false>(&sphere, projector.screen),
            Projection::Perspective => Margins::new::<true>(&sphere, projector.screen),
        };
        Self { index, ball, sphere, margins }
    }

    /// Takes the pixel if it is nearer than the holder; as `PaintTile::clipped` of the native device, pixel by pixel.
    fn meet(&self, scene: &Scene, truth: &Truth, projector: &Projector, cell: &mut Cell, tally: &mut Tally) {
        let (sx, sy) = (projector.columns[cell.column as usize], projector.rows[cell.row as usize]);
        let planes = [projector.near, projector.far];
        let look = match projector.projection {
            Projection::Orthographic => {
                Row::new::<false>(&self.sphere, sy).look::<false>(&self.margins, planes, cell.high, sx)
            }
            Projection::Perspective => {
                Row::new::<true>(&self.sphere, sy).look::<true>(&self.margins, planes, cell.high, sx)
            }
        };
        match look {
            Look::Gone => {}
            Look::Seen([low, high]) if high < cell.low => {
                (cell.low, cell.high, cell.holder) = (low, high, Some(self.index));
            }
            _ => self.settle(scene, truth, projector, cell, tally),
        }
    }

    /// Decides exactly between the sphere and the holder.
    #[cold]
    fn settle(&self, scene: &Scene, truth: &Truth, projector: &Projector, cell: &mut Cell, tally: &mut Tally) {
        let holder = cell.holder.map(|index| (index, Ball::from(scene.sphere(index as usize))));
        if let Some((index, held)) = holder
            && held == self.ball
        {
            cell.holder = Some(index.min(self.index));
            return;
        }
        let pixel = truth.pixel(projector.region.x + cell.column, projector.region.y + cell.row);
        let Some(hit) = pixel.hit(self.ball, tally) else { return };
        if let Some((index, held)) = holder {
            let held = pixel.hit(held, tally).expect("the holder of a pixel is hit there");
            if pixel.order(&hit, &held, tally).then(self.index.cmp(&index)).is_gt() {
                return;
            }
        }
        let [low, high] = pixel.interval(&hit);
        (cell.low, cell.high, cell.holder) = (low, high, Some(self.index));
    }
}
