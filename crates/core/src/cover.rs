//! What a few large spheres hide, known before anything is drawn.
//!
//! A sphere hides what begins behind it in a block of pixels that it covers whole. Its depth there
//! is greatest at a corner of the block (lemma C1 of docs/numerics.md: the part of a ball in front
//! of a plane is convex, and so is its picture). So four pixels tell, with the bounds of
//! [`crate::filter`].

use std::ops::Range;

use crate::{
    camera::Projection,
    filter::{BACK, Look, Margins, Row, length},
    project::Projector,
    projected::Projected,
    scene::Scene,
    simd::LANES,
};

/// Side of a block, pixels.
pub const BLOCK: usize = 8;
// `Tile::freshen` takes a row of a block as one vector.
const _: () = assert!(BLOCK == LANES);
/// Side of a square that is tried before its blocks.
const SQUARE: usize = 64;
// Squares begin where blocks do, see `Cover::add`.
const _: () = assert!(SQUARE.is_multiple_of(BLOCK));

/// Depths behind which nothing is seen.
pub struct Cover {
    /// Blocks across.
    columns: usize,
    /// Of each block, row by row; infinite where it is not covered.
    depths: Vec<f64>,
    /// What covers it: which of the scene's large spheres; no number of one if nothing does.
    by: Vec<u32>,
    /// Where each of these begins.
    nearest: Vec<f64>,
    /// The greatest of the depths.
    farthest: f64,
}

impl Cover {
    /// Of a region; none if no sphere is much larger than others, or none of these covers a block.
    pub fn new(scene: &Scene, projector: &Projector) -> Option<Self> {
        if !Self::may_be(scene) || !projector.screen.has_depths() {
            return None;
        }
        let blocks = |pixels: u32| (pixels as usize).div_ceil(BLOCK);
        let (columns, rows) = (blocks(projector.region.width), blocks(projector.region.height));
        let blocks = columns * rows;
        let mut cover = Self {
            columns,
            depths: vec![f64::INFINITY; blocks],
            by: vec![u32::MAX; blocks],
            nearest: Vec::new(),
            farthest: f64::INFINITY,
        };
        for &index in scene.large() {
            let (block, at) = scene.locate(index.at());
            let sphere = projector.project(block.center(at), block.radius(at));
            match projector.projection {
                Projection::Orthographic => cover.add::<false>(projector, &sphere),
                Projection::Perspective => cover.add::<true>(projector, &sphere),
            }
            cover.nearest.push(sphere.nearest());
        }
        cover.farthest = cover.depths.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        cover.depths.iter().any(|depth| *depth < f64::INFINITY).then_some(cover)
    }

    /// Whether some spheres of a scene are so much larger than others that it is worth a look.
    pub fn may_be(scene: &Scene) -> bool {
        scene.bounds().max_radius >= 8.0 * scene.bounds().min_radius
    }

    /// The depth behind which nothing is seen in the block of a column and a row of blocks; beyond
    /// the region, nothing is.
    pub fn depth(&self, column: usize, row: usize) -> f64 {
        let inside = column < self.columns;
        self.depths
            .get(row * self.columns + column)
            .filter(|_| inside)
            .copied()
            .unwrap_or(f64::NEG_INFINITY)
    }

    /// The depths behind which nothing is seen, block by block.
    pub fn depths(&self) -> &[f64] {
        &self.depths
    }

    /// The greatest of them.
    pub fn farthest(&self) -> f64 {
        self.farthest
    }

    /// What covers a block, by its number: which of the scene's large spheres, and where it begins.
    #[inline(always)]
    pub fn sphere(&self, block: usize) -> Option<(usize, f64)> {
        let by = self.by[block] as usize;
        self.nearest.get(by).map(|&nearest| (by, nearest))
    }

    /// The next of the large spheres.
    fn add<const PERSPECTIVE: bool>(&mut self, projector: &Projector, sphere: &Projected) {
        if projector.cuts(sphere) {
            return;
        }
        let margins = Margins::new::<PERSPECTIVE>(sphere, projector.screen);
        let [width, height] =
            [projector.region.width, projector.region.height].map(|side| side as usize);
        let [x, y] = projector.extent::<PERSPECTIVE>(sphere);
        // Whole blocks inside its box; a cast of what is below 0 or NaN gives 0.
        let inside = |[first, last]: [f64; 2], pixels: usize| {
            let end = if last >= pixels as f64 - 1.0 {
                pixels
            } else {
                (last as usize + 1) / BLOCK * BLOCK
            };
            (first.ceil() as usize).next_multiple_of(BLOCK).min(end)..end
        };
        let (across, down) = (inside(x, width), inside(y, height));
        for top in down.clone().step_by(BLOCK).filter(|top| top % SQUARE == 0 || *top == down.start)
        {
            let rows = top..(top / SQUARE * SQUARE + SQUARE).min(down.end);
            for left in across
                .clone()
                .step_by(BLOCK)
                .filter(|left| left % SQUARE == 0 || *left == across.start)
            {
                let columns = left..(left / SQUARE * SQUARE + SQUARE).min(across.end);
                let whole = greatest::<PERSPECTIVE>(
                    projector,
                    sphere,
                    &margins,
                    columns.clone(),
                    rows.clone(),
                );
                for row in rows.clone().step_by(BLOCK) {
                    for column in columns.clone().step_by(BLOCK) {
                        let of_block = || {
                            let [across, down] = [
                                column..(column + BLOCK).min(width),
                                row..(row + BLOCK).min(height),
                            ];
                            greatest::<PERSPECTIVE>(projector, sphere, &margins, across, down)
                        };
                        if let Some(depth) = whole.or_else(of_block) {
                            let at = row / BLOCK * self.columns + column / BLOCK;
                            if depth < self.depths[at] {
                                (self.depths[at], self.by[at]) = (depth, self.nearest.len() as u32);
                            }
                        }
                    }
                }
            }
        }
    }
}

/// Whether a sphere is certainly met, and not cut, at all pixels of a rectangle.
pub fn covers(
    projector: &Projector,
    sphere: &Projected,
    columns: Range<usize>,
    rows: Range<usize>,
) -> bool {
    let greatest = match projector.projection {
        Projection::Orthographic => greatest::<false>,
        Projection::Perspective => greatest::<true>,
    };
    let margins = match projector.projection {
        Projection::Orthographic => Margins::new::<false>(sphere, projector.screen),
        Projection::Perspective => Margins::new::<true>(sphere, projector.screen),
    };
    !projector.cuts(sphere) && greatest(projector, sphere, &margins, columns, rows).is_some()
}

/// The greatest depth of a sphere that no plane cuts over a rectangle of pixels; none unless it
/// certainly covers all of them.
fn greatest<const PERSPECTIVE: bool>(
    projector: &Projector,
    sphere: &Projected,
    margins: &Margins,
    columns: Range<usize>,
    rows: Range<usize>,
) -> Option<f64> {
    let mut greatest = f64::NEG_INFINITY;
    for row in [rows.start, rows.end - 1] {
        let sy = projector.rows[row];
        let line = Row::new::<PERSPECTIVE>(sphere, sy);
        for column in [columns.start, columns.end - 1] {
            let sx = projector.columns[column];
            let look = line.look::<PERSPECTIVE>(
                margins,
                [projector.near, projector.far],
                f64::INFINITY,
                sx,
            );
            let Look::Seen([_, high]) = look else { return None };
            let depth = if PERSPECTIVE { high / length(sx, sy) } else { high };
            greatest = greatest.max(depth + depth.abs() * BACK);
        }
    }
    Some(greatest)
}
