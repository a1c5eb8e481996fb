//! Tiles: the nearest sphere so far at every pixel, and what is drawn into them.

use std::{cell::RefCell, marker::PhantomData, mem::MaybeUninit, sync::Mutex};

use rayon::prelude::*;

use super::{BLOCKS, Mode, NONE, SIDE};
use crate::{
    bins::{Binner, Entry, Grid, Item, Lists, Window, towards_eye},
    camera::{Projection, Region},
    cover::{BLOCK, Cover, covers},
    exact::decide::{Ball, Hit, Root, Tally, Truth},
    filter::{BACK, Look, Margins, Row, length},
    order::Ordered,
    plan::UNDECIDED,
    project::{BATCH, Batch, Projected},
    render::Counts,
    scene::Scene,
    simd::{self, LANES, Lanes},
};

/// A bit of a holder's index where it is one of several that may be nearest.
const OPEN: i32 = i32::MIN;

/// Nothing that begins behind these depths is seen in a tile.
#[derive(Clone, Copy)]
pub(super) struct Depths {
    /// Of the whole tile.
    pub(super) farthest: f64,
    /// Of each block.
    blocks: [f64; BLOCKS * BLOCKS],
}

impl Depths {
    const NONE: Self = Self { farthest: f64::INFINITY, blocks: [f64::INFINITY; BLOCKS * BLOCKS] };

    /// Of tiles of which only a cover is known.
    pub(super) fn of_tiles(cover: Option<&Cover>, grid: &Grid) -> Vec<Self> {
        (0..grid.tiles()).map(|tile| Self::new(cover, grid.corner(tile))).collect()
    }

    fn new(cover: Option<&Cover>, ([x, y], side): ([usize; 2], usize)) -> Self {
        let Some(cover) = cover else { return Self::NONE };
        let depth = |block: usize| {
            let (column, row) = (block % BLOCKS, block / BLOCKS);
            let inside = column * BLOCK < side && row * BLOCK < side;
            if inside { cover.depth(x / BLOCK + column, y / BLOCK + row) } else { f64::NEG_INFINITY }
        };
        let blocks = std::array::from_fn(depth);
        Self { farthest: blocks.iter().copied().fold(f64::NEG_INFINITY, f64::max), blocks }
    }
}

/// The pixels of a tile.
#[repr(align(64))]
#[derive(Clone)]
pub(super) struct Tile {
    /// Upper bound of the holder's depth; infinite for none, negative infinite outside the region.
    high: [f64; SIDE * SIDE],
    /// Index of the holder.
    id: [i32; SIDE * SIDE],
    /// No holder's depth is less than its upper bound by more than this.
    slack: f64,
    /// Blocks whose depth may have become less.
    stale: u64,
}

impl Default for Tile {
    fn default() -> Self {
        Self { high: [f64::NEG_INFINITY; SIDE * SIDE], id: [NONE; SIDE * SIDE], slack: 0.0, stale: 0 }
    }
}

impl Tile {
    /// Some holder's bounds are as far apart as this, or so the roundings here and in comparisons make it seem.
    ///
    /// [`crate::filter`] leaves over more than the tenth of `W` that is added: the width of an interval is `2 W`, and one
    /// rounding of a depth is below `0.05 E / sqrt T`.
    #[inline(always)]
    fn widen(&mut self, width: f64) {
        let slack = 1.05 * width;
        self.slack = if slack > self.slack { slack } else { self.slack };
    }

    /// The holder's depth lies between these.
    fn hold(&mut self, at: usize, low: f64, high: f64) {
        self.widen(high - low + high.abs() * (8.0 * f64::EPSILON));
        self.high[at] = high;
    }

    /// Nothing is seen yet in the first columns and rows; beyond them there are no pixels.
    fn clear(&mut self, columns: usize, rows: usize) {
        (self.slack, self.stale) = (0.0, u64::MAX);
        self.id.fill(NONE);
        for (row, high) in self.high.chunks_exact_mut(SIDE).enumerate() {
            let inside = if row < rows { columns } else { 0 };
            high[..inside].fill(f64::INFINITY);
            high[inside..].fill(f64::NEG_INFINITY);
        }
    }
}

/// Whether everything in a window lies in front of a depth.
#[inline(always)]
pub(super) fn hidden(depths: &Depths, nearest: f64, [left, right, top, bottom]: Window) -> bool {
    let mut farthest = f64::NEG_INFINITY;
    for row in top as usize / BLOCK..=(bottom as usize / BLOCK).min(BLOCKS - 1) {
        for column in left as usize / BLOCK..=(right as usize / BLOCK).min(BLOCKS - 1) {
            let block = depths.blocks[row * BLOCKS + column];
            farthest = if block > farthest { block } else { farthest };
        }
    }
    nearest > farthest
}

/// Draws lists into tiles.
pub(super) struct Painter<'a> {
    /// What the indices are of.
    pub(super) scene: &'a Scene,
    pub(super) truth: &'a Truth,
    /// Of what is listed.
    pub(super) binner: &'a Binner<'a>,
    pub(super) sums: &'a Mutex<Sums>,
}

/// What a tile is drawn from.
#[derive(Clone, Copy)]
pub(super) enum Source<'a> {
    /// Spheres.
    Spheres(&'a Lists<Entry>),
    /// Groups of spheres.
    Groups(&'a Lists<Group>, &'a Ordered),
}

impl Source<'_> {
    fn is_empty(&self, binner: &Binner, tile: usize) -> bool {
        match self {
            Self::Spheres(lists) => lists.tile(&binner.grid, tile).is_empty(),
            Self::Groups(lists, _) => lists.tile(&binner.grid, tile).is_empty(),
        }
    }
}

/// A sphere behind all else in a tile.
struct Background {
    index: i32,
    /// Its number in the list: an index, or that of a group.
    number: u32,
    /// Whether there is nothing else.
    sole: bool,
}

/// A group of spheres in a tile's list.
#[derive(Clone, Copy, Default)]
pub(super) struct Group {
    index: u32,
    /// Nothing of it is nearer.
    nearest: f32,
    window: Window,
}

impl Item for Group {
    #[inline(always)]
    fn new(_: Projected, nearest: f64, index: u32, window: Window) -> Self {
        Self { index, nearest: towards_eye(nearest), window }
    }
}

/// Pixels of a region that tiles write, each its own.
struct Canvas {
    ids: *mut i32,
    region: Region,
}

// SAFETY: tiles do not overlap, and each is written by one thread; see `Canvas::rows`.
unsafe impl Sync for Canvas {}

impl Canvas {
    /// Appends the pixels of a region to `ids`.
    fn append(ids: &mut Vec<i32>, region: Region, paint: impl FnOnce(&Self)) {
        ids.reserve(region.pixels());
        paint(&Self { ids: ids.spare_capacity_mut().as_mut_ptr().cast(), region });
        // SAFETY: reserved above; `paint` wrote every tile, and each tile all its pixels.
        unsafe { ids.set_len(ids.len() + region.pixels()) };
    }

    /// The rows of a tile, each with its place in the tile.
    fn rows(&self, grid: &Grid, tile: usize, write: impl Fn(usize, &mut [MaybeUninit<i32>])) {
        let Region { width, height, .. } = self.region;
        let ([x, y], side) = grid.corner(tile);
        let across = side.min(width as usize - x);
        for row in 0..side.min(height as usize - y) {
            let start = (y + row) * width as usize + x;
            // SAFETY: inside the region; these pixels belong to this tile alone, and their memory outlives the threads.
            write(row, unsafe { std::slice::from_raw_parts_mut(self.ids.add(start).cast(), across) });
        }
    }
}

thread_local! {
    static TILE: RefCell<Box<Tile>> = RefCell::default();
}

impl Painter<'_> {
    /// Draws all there is, and appends the ids of the region.
    pub(super) fn paint_once<M: Mode>(&self, source: Source<'_>, depths: &[Depths], ids: &mut Vec<i32>) {
        Canvas::append(ids, self.binner.projector.region, |canvas| {
            (0..self.binner.grid.tiles()).into_par_iter().with_max_len(4).for_each(|tile| {
                if source.is_empty(self.binner, tile) {
                    return self.fill(tile, NONE, canvas);
                }
                let background = self.background(source, tile);
                if let Some(Background { index, sole: true, .. }) = background {
                    return self.fill(tile, index, canvas);
                }
                TILE.with_borrow_mut(|state| {
                    self.clear(tile, state);
                    let mut depths = depths[tile];
                    let number = background.as_ref().map(|background| background.number);
                    self.paint_tile::<M>(source, tile, number, state, &mut depths);
                    if let Some(Background { index, .. }) = background {
                        state.id.iter_mut().filter(|id| **id == NONE).for_each(|id| *id = index);
                    }
                    self.write::<M>(tile, state, canvas);
                });
            });
        });
    }

    /// Nothing is seen yet.
    pub(super) fn clear(&self, tile: usize, state: &mut Tile) {
        let Region { width, height, .. } = self.binner.projector.region;
        let ([x, y], side) = self.binner.grid.corner(tile);
        state.clear(side.min(width as usize - x), side.min(height as usize - y));
    }

    /// Draws on top of what there is.
    pub(super) fn paint<M: Mode>(&self, source: Source<'_>, tiles: &mut [Tile], depths: &mut [Depths]) {
        tiles.par_iter_mut().zip(depths).with_max_len(8).enumerate().for_each(|(tile, (state, depths))| {
            if !source.is_empty(self.binner, tile) {
                self.paint_tile::<M>(source, tile, None, state, depths);
            }
        });
    }

    /// Appends the ids of all tiles.
    pub(super) fn gather<M: Mode>(&self, tiles: &[Tile], ids: &mut Vec<i32>) {
        Canvas::append(ids, self.binner.projector.region, |canvas| {
            tiles.par_iter().enumerate().for_each(|(tile, state)| self.write::<M>(tile, state, canvas));
        });
    }

    /// What covers a tile behind all else that is listed there.
    fn background(&self, source: Source<'_>, tile: usize) -> Option<Background> {
        /// Longer lists are seldom all in front of something.
        const MOST: usize = 64;
        let Binner { projector, grid, scene, .. } = self.binner;
        let project = |index: u32| {
            let (block, at) = scene.locate(index as usize);
            projector.project(block.center(at), block.radius(at))
        };
        // Of what is listed: its sphere, and its number in the list's own terms.
        let listed: Vec<(Projected, u32)> = match source {
            Source::Spheres(lists) => match lists.tile(grid, tile) {
                entries if entries.len() > MOST => return None,
                entries => entries.iter().map(|entry| (entry.sphere, entry.index)).collect(),
            },
            Source::Groups(lists, _) => match lists.tile(grid, tile) {
                groups if groups.len() > MOST => return None,
                groups => groups.iter().map(|group| (project(group.index), group.index)).collect(),
            },
        };
        let (last, number) = *listed.iter().max_by(|a, b| a.0.nearest().total_cmp(&b.0.nearest()))?;
        let in_front = |(sphere, other): &(Projected, u32)| {
            *other == number || sphere.z + sphere.r + sphere.bound() < last.nearest()
        };
        let ([x, y], side) = grid.corner(tile);
        let columns = x..(x + side).min(projector.region.width as usize);
        let rows = y..(y + side).min(projector.region.height as usize);
        let index = match source {
            Source::Spheres(_) => number,
            Source::Groups(_, ordered) => ordered.only(number)?,
        };
        let (block, at) = self.scene.locate(index as usize);
        let sphere = projector.project(block.center(at), block.radius(at));
        let found = listed.iter().all(in_front) && covers(projector, &sphere, columns, rows);
        found.then_some(Background { index: index as i32, number, sole: listed.len() == 1 })
    }

    /// Writes one index to all pixels of a tile.
    fn fill(&self, tile: usize, index: i32, canvas: &Canvas) {
        canvas.rows(&self.binner.grid, tile, |_, to| to.fill(MaybeUninit::new(index)));
    }

    /// Writes the ids of a tile.
    fn write<M: Mode>(&self, tile: usize, state: &Tile, canvas: &Canvas) {
        canvas.rows(&self.binner.grid, tile, |row, to| {
            for (to, &id) in to.iter_mut().zip(&state.id[row * SIDE..]) {
                to.write(if !M::DECIDES && id < NONE { UNDECIDED } else { id });
            }
        });
    }

    fn paint_tile<M: Mode>(
        &self,
        source: Source<'_>,
        tile: usize,
        without: Option<u32>,
        state: &mut Tile,
        depths: &mut Depths,
    ) {
        let work = PaintTile { painter: self, source, without, tile, state, depths, sums: Sums::default() };
        let sums = match self.binner.projector.projection {
            Projection::Orthographic => simd::dispatch(Ortho(work, PhantomData::<M>)),
            Projection::Perspective => simd::dispatch(Persp(work, PhantomData::<M>)),
        };
        let mut all = self.sums.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        all.tally += sums.tally;
        all.tests += sums.tests;
        all.entries += sums.entries;
    }
}

/// What tiles count.
#[derive(Clone, Copy, Default)]
pub(super) struct Sums {
    pub(super) tally: Tally,
    /// Pixels that spheres were tested at.
    pub(super) tests: u64,
    /// Spheres that were tested at all.
    pub(super) entries: u64,
}

impl Sums {
    pub(super) fn add_to(self, counts: &mut Counts) {
        counts.tests += self.tests;
        counts.undecided += self.tally.signs as usize;
        counts.small += self.tally.small as usize;
        counts.exact += self.tally.big as usize;
    }
}

struct Ortho<'a, M>(PaintTile<'a>, PhantomData<M>);

impl<M: Mode> simd::Work for Ortho<'_, M> {
    type Output = Sums;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Sums {
        self.0.run::<L, false, M>()
    }
}

struct Persp<'a, M>(PaintTile<'a>, PhantomData<M>);

impl<M: Mode> simd::Work for Persp<'_, M> {
    type Output = Sums;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Sums {
        self.0.run::<L, true, M>()
    }
}

/// No bounds at all, for `bench`.
const PLAIN: Margins = Margins { doubt: 0.0, solid: 0.0, width: 0.0, rim: 0.0 };

/// After so many spheres the depths of blocks are brought up to date.
const FRESH: usize = 64;

/// What the bounds leave open of eight pixels.
struct Doubt {
    /// A bit for each pixel to be decided.
    undecided: u8,
    /// For each that is certainly hit.
    sure: u8,
    /// Bounds of the depths of certain hits.
    leasts: [f64; LANES],
    mosts: [f64; LANES],
}

/// Where the pixels of a tile lie.
#[derive(Clone, Copy)]
struct Place<'a> {
    /// On the screen.
    columns: &'a [f64; SIDE],
    rows: &'a [f64; SIDE],
    /// First column and row of the region.
    corner: [usize; 2],
}

struct PaintTile<'a> {
    painter: &'a Painter<'a>,
    source: Source<'a>,
    /// What is listed and left out.
    without: Option<u32>,
    tile: usize,
    state: &'a mut Tile,
    depths: &'a mut Depths,
    sums: Sums,
}

impl PaintTile<'_> {
    #[inline(always)]
    fn run<L: Lanes, const PERSPECTIVE: bool, M: Mode>(mut self) -> Sums {
        let grid = &self.painter.binner.grid;
        let ([x, y], _) = grid.corner(self.tile);
        let projector = &self.painter.binner.projector;
        let some = |values: &[f64], from: usize| {
            std::array::from_fn(|k| values.get(from + k).copied().unwrap_or(f64::INFINITY))
        };
        let (columns, rows) = (some(&projector.columns, x), some(&projector.rows, y));
        let place = Place { columns: &columns, rows: &rows, corner: [x, y] };
        if M::BOUNDS {
            // For all spheres whose bounds are those of the screen.
            self.state.widen(2.0 * projector.screen.width);
        }
        match self.source {
            Source::Spheres(lists) => self.spheres::<L, PERSPECTIVE, M>(lists, place),
            Source::Groups(lists, ordered) => self.groups::<L, PERSPECTIVE, M>(lists, ordered, place),
        }
        self.sums
    }

    #[inline(always)]
    fn spheres<L: Lanes, const PERSPECTIVE: bool, M: Mode>(&mut self, lists: &Lists<Entry>, place: Place<'_>) {
        let Binner { projector, grid, .. } = self.painter.binner;
        for slab in 0..grid.slabs {
            let entries = lists.slab(grid, self.tile, slab);
            if entries.is_empty() {
                continue;
            }
            if self.depths.farthest < grid.slab_start(slab) {
                break;
            }
            for some in entries.chunks(FRESH) {
                for entry in some {
                    let out = self.without == Some(entry.index);
                    if !out && !hidden(self.depths, entry.sphere.nearest(), entry.window) {
                        self.entry::<L, PERSPECTIVE, M>(entry, projector.cuts(&entry.sphere), place);
                    }
                }
                self.freshen::<L, PERSPECTIVE>(place);
            }
        }
    }

    /// The spheres of groups, nearest groups first.
    #[inline(always)]
    fn groups<L: Lanes, const PERSPECTIVE: bool, M: Mode>(
        &mut self,
        lists: &Lists<Group>,
        ordered: &Ordered,
        place: Place<'_>,
    ) {
        let Binner { projector, grid, .. } = self.painter.binner;
        let [x, y] = place.corner.map(|at| at as i32);
        let (column, row) = (x >> grid.shift, y >> grid.shift);
        let last = (1 << grid.shift) - 1;
        let mut groups = Vec::new();
        let mut batch = Batch::default();
        let mut spheres = Vec::with_capacity(BATCH);
        let mut drawn = 0;
        for slab in 0..grid.slabs {
            if self.depths.farthest < grid.slab_start(slab) {
                break;
            }
            groups.clear();
            groups.extend_from_slice(lists.slab(grid, self.tile, slab));
            groups.sort_unstable_by(|a, b| a.nearest.total_cmp(&b.nearest));
            for group in &groups {
                let out = self.without == Some(group.index);
                if out || hidden(self.depths, group.nearest.into(), group.window) {
                    continue;
                }
                let first = ordered.starts[group.index as usize] as usize;
                let count = ordered.starts[group.index as usize + 1] as usize - first;
                // What no plane cuts of the group is not cut of its spheres.
                let around = ordered.groups.sphere(group.index as usize);
                let cut = projector.cuts(&projector.project(around.center, around.radius));
                projector.project_batch(&ordered.block, first, &mut batch);
                projector.footprints(&mut batch);
                let farthest = self.depths.farthest;
                let mut seen = 0u64;
                for k in 0..BATCH {
                    let across = (batch.left[k] <= batch.right[k].min(x + last)) & (batch.right[k] >= x);
                    let down = (batch.top[k] <= batch.bottom[k].min(y + last)) & (batch.bottom[k] >= y);
                    seen |= u64::from(across & down & !(batch.nearest[k] > farthest)) << k;
                }
                seen &= u64::MAX >> (BATCH - count);
                spheres.clear();
                while seen != 0 {
                    let k = seen.trailing_zeros() as usize;
                    seen &= seen - 1;
                    let (left, right, top, bottom) = (batch.left[k], batch.right[k], batch.top[k], batch.bottom[k]);
                    let wide = (left < x) | (right > x + last) && (top < y) | (bottom > y + last);
                    if wide && self.painter.binner.misses(&batch.sphere(k), column, row) {
                        continue;
                    }
                    let inside = |value: i32, from: i32| (value - from).clamp(0, last) as u8;
                    let window = [inside(left, x), inside(right, x), inside(top, y), inside(bottom, y)];
                    if !hidden(self.depths, batch.nearest[k], window) {
                        let index = ordered.indices[first + k];
                        spheres.push(Entry { sphere: batch.sphere(k), index, window });
                    }
                }
                for entry in &spheres {
                    let cut = cut && projector.cuts(&entry.sphere);
                    self.entry::<L, PERSPECTIVE, M>(entry, cut, place);
                }
                drawn += spheres.len();
                if drawn >= FRESH {
                    self.freshen::<L, PERSPECTIVE>(place);
                    drawn = 0;
                }
            }
        }
    }

    #[inline(always)]
    fn entry<L: Lanes, const PERSPECTIVE: bool, M: Mode>(&mut self, entry: &Entry, cut: bool, place: Place<'_>) {
        let [left, right, top, bottom] = entry.window.map(u64::from);
        let lanes = LANES as u64;
        self.sums.entries += 1;
        self.sums.tests += (right / lanes - left / lanes + 1) * lanes * (bottom - top + 1);
        if cut {
            self.clipped::<PERSPECTIVE, M>(entry, place);
        } else {
            self.whole::<L, PERSPECTIVE, M>(entry, place);
        }
    }

    /// Brings the farthest depth of the blocks up to date.
    #[inline(always)]
    fn freshen<L: Lanes, const PERSPECTIVE: bool>(&mut self, Place { columns, rows, .. }: Place<'_>) {
        if self.state.stale == 0 {
            return;
        }
        while self.state.stale != 0 {
            let block = self.state.stale.trailing_zeros() as usize;
            self.state.stale &= self.state.stale - 1;
            if block >= BLOCKS * BLOCKS {
                continue;
            }
            let (x, y) = (block % BLOCKS * BLOCK, block / BLOCKS * BLOCK);
            let sx = L::load(&columns[x..]);
            let mut farthest = L::splat(f64::NEG_INFINITY);
            for row in y..y + BLOCK {
                let high = L::load(&self.state.high[row * SIDE + x..]);
                let depth = if PERSPECTIVE {
                    // From t a back to t.
                    let depth = high.div(length(sx, rows[row]));
                    depth.add(depth.max(L::splat(0.0).sub(depth)).mul(L::splat(BACK)))
                } else {
                    high
                };
                // A pixel outside the region is NaN or negative infinite here and hides nothing.
                farthest = depth.max(farthest);
            }
            let farthest = farthest.greatest();
            // Screens so wide that |dir|^2 overflows have no depths to go by.
            let usable = self.painter.binner.projector.screen.kappa < 1e70;
            let known = &mut self.depths.blocks[block];
            // What is held only comes nearer.
            *known = if usable && farthest < *known { farthest } else { *known };
        }
        self.depths.farthest = self.depths.blocks.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    }

    #[inline(always)]
    fn touch(&mut self, row: usize, first: usize) {
        self.state.stale |= 1u64 << (row / BLOCK * BLOCKS + first / BLOCK);
    }

    /// A sphere that no plane can cut: the near root, in vector form.
    #[inline(always)]
    fn whole<L: Lanes, const PERSPECTIVE: bool, M: Mode>(
        &mut self,
        entry: &Entry,
        Place { columns, rows, corner }: Place<'_>,
    ) {
        let s = &entry.sphere;
        let margins =
            if M::BOUNDS { Margins::new::<PERSPECTIVE>(s, self.painter.binner.projector.screen) } else { PLAIN };
        let Margins { doubt, solid, width, rim } = margins;
        // What is vague is never in front for certain, and has no width.
        let lift = if solid == f64::INFINITY { 0.0 } else { width };
        if M::BOUNDS && s.r < self.painter.binner.projector.screen.plain {
            self.state.widen(2.0 * lift);
        }
        let id = entry.index as i32;
        // A holder that turned out to be the same sphere.
        let mut twin: Option<i32> = None;
        let [left, right, top, bottom] = entry.window.map(usize::from);
        let zero = L::splat(0.0);
        let mut slack = L::splat(self.state.slack);
        for row in top..=bottom {
            let line = Row::new::<PERSPECTIVE>(s, rows[row]);
            let lifted = line.lifted(lift);
            for vector in left / LANES..right / LANES + 1 {
                let first = vector * LANES;
                let at = row * SIDE + first;
                let sx = L::load(&columns[first..]);
                let high = L::load(&self.state.high[at..]);
                let (q, b) = lifted.meet::<L, PERSPECTIVE>(sx);
                // `b - high`, with `W` added.
                let above = b.sub(high);
                // Behind what is held for certain: `b - sqrt q - W > high`, or squared, `q < (b - W - high)^2`, which needs no root.
                // For hits that are not solid, `rim` stands for root and `W`. The tenth added to `W` covers the roundings of
                // the differences and the square, 2.5 u of the depth: see [`crate::filter`] for what `W` is at least.
                let ahead = above.sub(L::splat(2.1 * lift)).max(zero);
                let lose = q.less(L::splat(-doubt)) | L::splat(rim * rim).max(q).less(ahead.mul(ahead));
                if lose == u8::MAX {
                    continue;
                }
                let root = q.max(zero).sqrt();
                // What is NaN is in doubt. In front for certain: `b - sqrt q + W < high - slack`.
                let sure = L::splat(solid).less(q);
                let win = sure & above.add(slack).less(root);
                if win != 0 {
                    L::select(win, b.sub(root), high).store(&mut self.state.high[at..]);
                    L::mark(win, id, &mut self.state.id[at..]);
                    self.touch(row, first);
                }
                let undecided = !(win | lose);
                if !M::BOUNDS || undecided == 0 {
                    continue;
                }
                let (mut leasts, mut mosts) = ([0.0; LANES], [0.0; LANES]);
                line.meet::<L, PERSPECTIVE>(sx).1.sub(root).sub(L::splat(width)).store(&mut leasts);
                b.sub(root).store(&mut mosts);
                let doubt = Doubt { undecided, sure, leasts, mosts };
                self.decide::<PERSPECTIVE, M>(entry, at, corner, &doubt, &mut twin);
                slack = L::splat(self.state.slack);
            }
        }
    }

    /// Decides between a sphere and the holders of some of eight pixels.
    #[cold]
    #[inline(never)]
    fn decide<const PERSPECTIVE: bool, M: Mode>(
        &mut self,
        entry: &Entry,
        first: usize,
        corner: [usize; 2],
        &Doubt { mut undecided, sure, leasts, mosts }: &Doubt,
        twin: &mut Option<i32>,
    ) {
        while undecided != 0 {
            let k = undecided.trailing_zeros() as usize;
            undecided &= undecided - 1;
            let (at, sure) = (first + k, sure >> k & 1 == 1);
            if let Some(twin) = *twin
                && self.state.id[at] == twin
            {
                // Known to be the same sphere, under another index.
                self.state.id[at] = twin.min(entry.index as i32);
            } else if M::DECIDES {
                let depth = sure.then_some([leasts[k], mosts[k]]);
                *twin = self.settle::<PERSPECTIVE>(entry, at, corner, depth).or(*twin);
            } else {
                self.leave_open(entry, at, leasts[k], if sure { mosts[k] } else { f64::INFINITY });
            }
        }
    }

    /// A sphere that a plane may cut: either root, pixel by pixel.
    #[inline(always)]
    fn clipped<const PERSPECTIVE: bool, M: Mode>(&mut self, entry: &Entry, Place { columns, rows, corner }: Place<'_>) {
        let s = &entry.sphere;
        let projector = &self.painter.binner.projector;
        let margins = if M::BOUNDS { Margins::new::<PERSPECTIVE>(s, projector.screen) } else { PLAIN };
        let [left, right, top, bottom] = entry.window.map(usize::from);
        for row in top..=bottom {
            let line = Row::new::<PERSPECTIVE>(s, rows[row]);
            for column in left..=right {
                let (sx, at) = (columns[column], row * SIDE + column);
                match line.look::<PERSPECTIVE>(&margins, [projector.near, projector.far], self.state.high[at], sx) {
                    Look::Gone => {}
                    Look::Seen([low, high]) if high < self.state.high[at] - self.state.slack => {
                        self.state.hold(at, low, high);
                        self.state.id[at] = entry.index as i32;
                        self.touch(row, column);
                    }
                    _ if !M::BOUNDS => {}
                    _ if !M::DECIDES => self.leave_open(entry, at, f64::NEG_INFINITY, f64::INFINITY),
                    _ => {
                        self.settle::<PERSPECTIVE>(entry, at, corner, None);
                    }
                }
            }
        }
    }

    /// For `bench`: the sphere may or may not be the nearest, and begins and ends at these depths at the latest.
    fn leave_open(&mut self, entry: &Entry, at: usize, least: f64, most: f64) {
        let (holder, state) = (self.state.id[at], &mut *self.state);
        state.id[at] = OPEN | if holder == NONE { entry.index as i32 } else { holder };
        state.widen(state.high[at] - least);
        if most < state.high[at] {
            state.high[at] = most;
            self.touch(at / SIDE, at % SIDE);
        }
    }

    /// Decides exactly between a sphere and the holder of a pixel. Answers with the holder if it is the same sphere.
    ///
    /// `depth` bounds the depth of a sphere that no plane cuts and that is hit for certain.
    #[cold]
    #[inline(never)]
    fn settle<const PERSPECTIVE: bool>(
        &mut self,
        entry: &Entry,
        at: usize,
        [x, y]: [usize; 2],
        depth: Option<[f64; 2]>,
    ) -> Option<i32> {
        let Painter { scene, truth, binner, .. } = *self.painter;
        let region = binner.projector.region;
        let (column, row) = ((x + at % SIDE) as u32, (y + at / SIDE) as u32);
        if column >= region.width || row >= region.height {
            return None;
        }
        let index = entry.index as i32;
        let ball = Ball::from(scene.sphere(entry.index as usize));
        let holder = self.state.id[at];
        let held = (holder != NONE).then(|| Ball::from(scene.sphere(holder as usize)));
        if held == Some(ball) {
            self.state.id[at] = holder.min(index);
            return Some(holder);
        }
        let pixel = truth.pixel(region.x + column, region.y + row);
        let hit = match depth {
            Some(_) => Hit::known(ball, Root::Near),
            None => pixel.hit(ball, &mut self.sums.tally)?,
        };
        if let Some(held) = held {
            // The holder was seen when it became the holder; which wall is plain where no plane cuts it.
            let whole = !binner.projector.cuts(&binner.projector.project(held.center, held.radius));
            let held = match whole {
                true => Hit::known(held, Root::Near),
                false => pixel.hit(held, &mut self.sums.tally).expect("the holder of a pixel is hit there"),
            };
            let order = pixel.order(&hit, &held, &mut self.sums.tally);
            if order.then(index.cmp(&holder)).is_gt() {
                return None;
            }
        }
        let [low, high] = depth.unwrap_or_else(|| pixel.interval(&hit));
        self.state.hold(at, low, high);
        self.state.id[at] = index;
        self.touch(at / SIDE, at % SIDE);
        None
    }
}
