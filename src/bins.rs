//! Which spheres may be seen in which tile, roughly front to back: exact-size lists by count, scan and scatter.
//!
//! A tile is a square of pixels; its list is split into *slabs* of depth by each sphere's nearest point, so that drawing can
//! stop early. Lists are conservative: a sphere that is not listed for a tile is seen at none of its pixels. Both devices use
//! them. Spheres are read where they lie, projected in batches, and only what is kept is written.

use std::ops::Range;

use rayon::prelude::*;

use crate::{
    camera::Region,
    exact::decide::Truth,
    project::{BATCH, Batch, Footprint, Projected, Projector},
    scene::Scene,
    simd,
};

/// The tiles and slabs of a region.
#[derive(Clone, Copy, Debug)]
pub struct Grid {
    /// Side of a tile in pixels is `1 << shift`; at most 32.
    pub shift: u32,
    /// Tiles across.
    pub columns: u32,
    /// Tiles down.
    pub rows: u32,
    /// Slabs of depth.
    pub slabs: u32,
    start: f64,
    per_depth: f64,
}

impl Grid {
    fn new(scene: &Scene, projector: &Projector, shift: u32) -> Self {
        let Region { width, height, .. } = projector.region;
        let (columns, rows) = (width.div_ceil(1 << shift), height.div_ceil(1 << shift));
        let bounds = scene.bounds();
        // The depths of the corners of the box, reduced to what the planes leave.
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for corner in 0..8 {
            let pick = |k: usize| if corner >> k & 1 == 0 { bounds.min_center[k] } else { bounds.max_center[k] };
            let s = projector.project([0, 1, 2].map(pick).into(), bounds.max_radius, 0);
            (low, high) = (low.min(s.nearest()), high.max(s.z));
        }
        (low, high) = (low.max(projector.near - 2.0 * bounds.max_radius * projector.scale), high.min(projector.far));
        // A slab to about 4,096 spheres a tile is plenty; few tiles may have more slabs.
        let tiles = u64::from(columns) * u64::from(rows);
        let by_tiles = (1 << 18) / tiles.max(1);
        let by_spheres = scene.len() as u64 / 256;
        let wanted = by_tiles.min(by_spheres).clamp(1, 64) as u32;
        let per_depth = f64::from(wanted) / (high - low);
        let usable = per_depth.is_finite() && per_depth > 0.0 && low.is_finite();
        let (slabs, per_depth) = if usable { (wanted, per_depth) } else { (1, 0.0) };
        Self { shift, columns, rows, slabs, start: low, per_depth }
    }

    /// Number of tiles.
    pub fn tiles(&self) -> usize {
        self.columns as usize * self.rows as usize
    }

    #[inline(always)]
    fn slab(&self, nearest: f64) -> u32 {
        // A cast of what is below 0 or NaN gives 0.
        (((nearest - self.start) * self.per_depth) as u32).min(self.slabs - 1)
    }

    /// Nothing in this slab or later ones begins nearer than this.
    pub fn slab_start(&self, slab: u32) -> f64 {
        if slab == 0 {
            return f64::NEG_INFINITY;
        }
        // The slab's rounding is a few parts in 2^53 of the depths that enter it.
        let exact = self.start + f64::from(slab) / self.per_depth;
        exact - 1e-12 * (exact.abs() + self.start.abs() + 1.0 / self.per_depth)
    }
}

/// What a tile list holds: a sphere in view space and its pixels in this tile.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
pub struct Entry {
    /// The sphere.
    pub sphere: Projected,
    /// First and last column, first and last row inside the tile, a byte each.
    pub window: [u8; 4],
}

/// Which spheres go into a tile's list.
pub trait Keep: Sync {
    /// Whether this one does.
    fn keep(&self, tile: usize, slab: u32, sphere: &Projected, window: [u8; 4]) -> bool;
}

/// All of them.
pub struct KeepAll;

impl Keep for KeepAll {
    #[inline(always)]
    fn keep(&self, _: usize, _: u32, _: &Projected, _: [u8; 4]) -> bool {
        true
    }
}

/// How many entries each slab of each tile gets, for each part of the spheres.
pub struct Counts {
    /// Spheres of each part.
    parts: Vec<Range<usize>>,
    /// `[part][tile * slabs + slab]`.
    counts: Vec<Vec<u32>>,
    /// Pixels that the entries' boxes cover, `[part][tile * slabs + slab]`, saturating.
    areas: Vec<Vec<u32>>,
}

impl Counts {
    /// Entries in all.
    pub fn total(&self) -> u64 {
        self.counts.iter().flatten().map(|&c| u64::from(c)).sum()
    }

    /// Entries, and pixels of their boxes, of each slab of a tile.
    pub fn of_tile(&self, grid: &Grid, tile: usize) -> impl Iterator<Item = (u64, u64)> {
        let slabs = grid.slabs as usize;
        (tile * slabs..(tile + 1) * slabs).map(|key| {
            let sum = |all: &[Vec<u32>]| all.iter().map(|part| u64::from(part[key])).sum::<u64>();
            (sum(&self.counts), sum(&self.areas))
        })
    }

    /// Forgets the slabs of each tile from `cut[tile]` on.
    pub fn truncate(&mut self, grid: &Grid, cut: &[u32]) {
        let slabs = grid.slabs as usize;
        for part in &mut self.counts {
            for (tile, &cut) in cut.iter().enumerate() {
                part[tile * slabs + cut as usize..(tile + 1) * slabs].fill(0);
            }
        }
    }
}

/// The lists of all tiles.
pub struct Lists {
    /// `entries[starts[k]..starts[k + 1]]` is slab `k % slabs` of tile `k / slabs`.
    pub starts: Vec<u32>,
    /// Spheres, tile by tile, slab by slab.
    pub entries: Vec<Entry>,
}

impl Lists {
    /// The entries of a slab of a tile.
    pub fn slab(&self, grid: &Grid, tile: usize, slab: u32) -> &[Entry] {
        let key = tile * grid.slabs as usize + slab as usize;
        &self.entries[self.starts[key] as usize..self.starts[key + 1] as usize]
    }

    /// The entries of a tile, front slabs first.
    pub fn tile(&self, grid: &Grid, tile: usize) -> &[Entry] {
        let slabs = grid.slabs as usize;
        &self.entries[self.starts[tile * slabs] as usize..self.starts[(tile + 1) * slabs] as usize]
    }
}

/// Makes lists for one region.
pub struct Binner<'a> {
    /// The spheres.
    pub scene: &'a Scene,
    /// The camera.
    pub projector: Projector,
    /// The tiles.
    pub grid: Grid,
}

impl<'a> Binner<'a> {
    /// For tiles with sides of `1 << shift` pixels.
    pub fn new(scene: &'a Scene, truth: &Truth, region: Region, shift: u32) -> Self {
        let projector = Projector::new(truth, region);
        let grid = Grid::new(scene, &projector, shift);
        Self { scene, projector, grid }
    }

    /// Counts what is kept of some spheres.
    pub fn count<K: Keep>(&self, spheres: Range<usize>, keep: &K) -> Counts {
        let parts = split(spheres);
        let (counts, areas) = parts
            .par_iter()
            .map(|part| {
                let keys = self.grid.tiles() * self.grid.slabs as usize;
                let (mut counts, mut areas) = (vec![0u32; keys], vec![0u32; keys]);
                self.visit(part.clone(), keep, |key, entry| {
                    let [left, right, top, bottom] = entry.window;
                    counts[key] += 1;
                    let area = u32::from(right - left + 1) * u32::from(bottom - top + 1);
                    areas[key] = areas[key].saturating_add(area);
                });
                (counts, areas)
            })
            .unzip();
        Counts { parts, counts, areas }
    }

    /// Writes the lists of what was counted; `keep` must answer as it did then (or keep less than was counted never).
    pub fn scatter<K: Keep>(&self, counts: Counts, keep: &K) -> Lists {
        let Counts { parts, mut counts, .. } = counts;
        let keys = self.grid.tiles() * self.grid.slabs as usize;
        let mut starts = vec![0u32; keys + 1];
        let mut total = 0u32;
        for key in 0..keys {
            starts[key] = total;
            for part in &mut counts {
                let count = part[key];
                part[key] = total;
                total = total.checked_add(count).expect("waves keep lists below 2^32 entries");
            }
        }
        starts[keys] = total;
        let mut entries: Vec<Entry> = Vec::with_capacity(total as usize);
        let target = Target(entries.as_mut_ptr());
        let limit = total as usize;
        let written: usize = parts
            .par_iter()
            .zip(&mut counts)
            .map(|(part, next)| {
                let target = &target;
                let mut written = 0;
                self.visit(part.clone(), keep, |key, entry| {
                    let at = next[key] as usize;
                    next[key] += 1;
                    assert!(at < limit, "more entries than were counted");
                    // SAFETY: `at` lies inside the allocation, and no other part or key writes it: the scan gave each part
                    // and key a range of its own, of the counted length, and the count below proves that all were filled.
                    unsafe { target.0.add(at).write(entry) };
                    written += 1;
                });
                written
            })
            .sum();
        assert_eq!(written, limit, "as many entries as were counted");
        // SAFETY: all `total` entries were written.
        unsafe { entries.set_len(limit) };
        Lists { starts, entries }
    }

    fn visit<K: Keep, F: FnMut(usize, Entry)>(&self, spheres: Range<usize>, keep: &K, emit: F) {
        simd::dispatch(Visit { binner: self, spheres, keep, emit });
    }
}

/// Where entries are written by several threads.
struct Target(*mut Entry);

// SAFETY: each thread writes places of its own, see `Binner::scatter`.
unsafe impl Sync for Target {}

/// Contiguous parts of some spheres, one a thread; few spheres are one part.
fn split(spheres: Range<usize>) -> Vec<Range<usize>> {
    const LEAST: usize = 1 << 12;
    let parts = rayon::current_num_threads().min(spheres.len().div_ceil(LEAST)).max(1);
    let size = spheres.len().div_ceil(parts).next_multiple_of(BATCH).max(BATCH);
    (0..parts)
        .map(|part| {
            let start = (spheres.start + part * size).min(spheres.end);
            start..(start + size).min(spheres.end)
        })
        .collect()
}

/// Projects spheres and hands out what is kept, tile by tile.
struct Visit<'a, K, F> {
    binner: &'a Binner<'a>,
    spheres: Range<usize>,
    keep: &'a K,
    emit: F,
}

impl<K: Keep, F: FnMut(usize, Entry)> simd::Work for Visit<'_, K, F> {
    type Output = ();

    #[inline(always)]
    fn run(mut self) {
        let projector = &self.binner.projector;
        let mut batch = Batch::default();
        let mut footprints = [Footprint::default(); BATCH];
        for (start, block) in self.binner.scene.blocks() {
            let end = (start + block.len()).min(self.spheres.end);
            let mut first = start.max(self.spheres.start);
            while first < end {
                projector.project_batch(block, first - start, &mut batch);
                let len = batch.len.min(end - first);
                let at = |k: usize| Projected {
                    x: batch.x[k],
                    y: batch.y[k],
                    z: batch.z[k],
                    r: batch.r[k],
                    index: (first + k) as u32,
                };
                for (k, footprint) in footprints.iter_mut().enumerate() {
                    *footprint = projector.footprint(&at(k));
                }
                for (k, footprint) in footprints.iter().enumerate().take(len) {
                    if !footprint.is_empty() {
                        self.place(at(k), *footprint);
                    }
                }
                first += len;
            }
        }
    }
}

impl<K: Keep, F: FnMut(usize, Entry)> Visit<'_, K, F> {
    #[inline(always)]
    fn place(&mut self, sphere: Projected, footprint: Footprint) {
        let grid = &self.binner.grid;
        let Footprint { left, right, top, bottom } = footprint;
        let (left_tile, right_tile) = (left >> grid.shift, right >> grid.shift);
        let (top_tile, bottom_tile) = (top >> grid.shift, bottom >> grid.shift);
        let slab = grid.slab(sphere.nearest());
        let last = (1 << grid.shift) - 1;
        let many = right_tile - left_tile > 1 && bottom_tile - top_tile > 1;
        for row in top_tile..=bottom_tile {
            for column in left_tile..=right_tile {
                if many && self.binner.misses(&sphere, column, row) {
                    continue;
                }
                let (x, y) = (column << grid.shift, row << grid.shift);
                let inside = |value: i32, from: i32| (value - from).clamp(0, last) as u8;
                let window = [inside(left, x), inside(right, x), inside(top, y), inside(bottom, y)];
                let tile = row as usize * grid.columns as usize + column as usize;
                if self.keep.keep(tile, slab, &sphere, window) {
                    (self.emit)(tile * grid.slabs as usize + slab as usize, Entry { sphere, window });
                }
            }
        }
    }
}

impl Binner<'_> {
    /// Whether a tile inside a sphere's bounding box lies outside its disc, for certain; only told for parallel rays.
    #[inline(always)]
    fn misses(&self, sphere: &Projected, column: i32, row: i32) -> bool {
        if self.projector.projection == crate::camera::Projection::Perspective {
            return false;
        }
        let Region { width, height, .. } = self.projector.region;
        let first = |tile: i32| (tile as usize) << self.grid.shift;
        let last = |tile: i32, count: u32| (first(tile) + (1 << self.grid.shift) - 1).min(count as usize - 1);
        let (columns, rows) = (&self.projector.columns, &self.projector.rows);
        let apart = |low: f64, high: f64, at: f64| (low - at).max(at - high).max(0.0);
        let dx = apart(columns[first(column)], columns[last(column, width)], sphere.x);
        let dy = apart(rows[last(row, height)], rows[first(row)], sphere.y);
        // Each of dx, dy is within `bound` of the truth, and so is the radius.
        let reach = sphere.r + 4.0 * sphere.bound();
        dx * dx + dy * dy > reach * reach * (1.0 + 1e-12)
    }
}
