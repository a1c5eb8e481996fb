//! From lists to ids, tile by tile: which spheres and groups are drawn into a tile, nearest first,
//! and what is left out as hidden.

use std::{
    cell::RefCell,
    marker::PhantomData,
    mem::MaybeUninit,
    sync::{
        Mutex,
        atomic::{AtomicUsize, Ordering},
    },
};

use rayon::prelude::*;

use super::{BLOCKS, LISTED, SIDE, alike::Alike};
use crate::{
    bins::{Binner, Entry, Grid, Item, Lists, Window, towards_eye},
    camera::Region,
    cover::{BLOCK, Cover, covers},
    drawing::{Control, Counts},
    exact::decide::{Tally, Truth},
    ids::{NONE, SphereIndex, UNDECIDED},
    order::Ordered,
    pair, pool,
    project::{BATCH, Batch},
    projected::Projected,
    scene::{Ball, Scene},
    simd::{self, LANES, Lanes},
    tile::{self, Mode},
};

pub(super) type Tile = tile::Tile<SIDE>;
type Place<'a> = tile::Place<'a, SIDE>;

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
            if inside {
                cover.depth(x / BLOCK + column, y / BLOCK + row)
            } else {
                f64::NEG_INFINITY
            }
        };
        let blocks = std::array::from_fn(depth);
        Self { farthest: blocks.iter().copied().fold(f64::NEG_INFINITY, f64::max), blocks }
    }
}

/// Whether a sphere that begins at depth `nearest` is hidden in a window: at all its pixels
/// something in front of that depth is held already.
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
    /// Where a sphere of this radius is listed, in view lengths, it is found out which blocks show
    /// one sphere.
    pub(super) blocks: f64,
    /// Tiles that are begun after this is cancelled hold anything.
    pub(super) control: &'a Control,
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

/// The sphere at the back of a tile's list, if it covers the whole tile and begins where all the
/// others have ended.
struct Background {
    index: SphereIndex,
    /// Its number in the list: an index, or that of a group. What is left out of a tile is told by
    /// it, in [`PaintTile::without`].
    number: u32,
    /// Whether there is nothing else.
    sole: bool,
}

/// A group of spheres in a tile's list.
#[derive(Clone, Copy, Default)]
pub(super) struct Group {
    number: u32,
    /// Nothing of it is nearer.
    nearest: f32,
    window: Window,
}

impl Item for Group {
    #[inline(always)]
    fn new(_: Projected, nearest: f64, number: u32, window: Window) -> Self {
        Self { number, nearest: towards_eye(nearest), window }
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
    #[inline(always)]
    fn rows(&self, grid: &Grid, tile: usize, write: impl Fn(usize, &mut [MaybeUninit<i32>])) {
        let Region { width, height, .. } = self.region;
        let ([x, y], side) = grid.corner(tile);
        let across = side.min(width as usize - x);
        for row in 0..side.min(height as usize - y) {
            let start = (y + row) * width as usize + x;
            // SAFETY: inside the region; these pixels belong to this tile alone, and their memory
            // outlives the threads.
            write(row, unsafe {
                std::slice::from_raw_parts_mut(self.ids.add(start).cast(), across)
            });
        }
    }
}

/// After so many tiles it is told how far the picture is.
const TOLD: usize = 16;

thread_local! {
    static TILE: RefCell<Box<Tile>> = RefCell::default();
}

impl Painter<'_> {
    /// Draws all there is, and appends the ids of the region.
    pub(super) fn paint_once<M: Mode>(
        &self,
        source: Source<'_>,
        depths: &[Depths],
        ids: &mut Vec<i32>,
    ) {
        let (tiles, done) = (self.binner.grid.tiles(), AtomicUsize::new(0));
        Canvas::append(ids, self.binner.projector.region, |canvas| {
            pool::each(tiles, |tile| {
                let done = done.fetch_add(1, Ordering::Relaxed);
                if done.is_multiple_of(TOLD) {
                    self.control.reach(LISTED + (1.0 - LISTED) * done as f32 / tiles as f32);
                }
                if self.control.is_cancelled() || source.is_empty(self.binner, tile) {
                    return self.fill(tile, NONE, canvas);
                }
                let background = self.background(source, tile);
                if let Some(Background { index, sole: true, .. }) = background {
                    return self.fill(tile, index.id(), canvas);
                }
                TILE.with_borrow_mut(|state| {
                    let mut depths = depths[tile];
                    let number = background.as_ref().map(|background| background.number);
                    let id = background.map_or(NONE, |background| background.index.id());
                    self.paint_tile::<M>(
                        source,
                        tile,
                        number,
                        state,
                        &mut depths,
                        Some((canvas, id)),
                    );
                });
            });
        });
    }

    /// Nothing is seen yet.
    #[inline(always)]
    pub(super) fn clear(&self, tile: usize, state: &mut Tile) {
        let Region { width, height, .. } = self.binner.projector.region;
        let ([x, y], side) = self.binner.grid.corner(tile);
        state.clear(side.min(width as usize - x), side.min(height as usize - y));
    }

    /// Draws on top of what there is.
    pub(super) fn paint<M: Mode>(
        &self,
        source: Source<'_>,
        tiles: &mut [Tile],
        depths: &mut [Depths],
    ) {
        tiles.par_iter_mut().zip(depths).with_max_len(8).enumerate().for_each(
            |(tile, (state, depths))| {
                if !self.control.is_cancelled() && !source.is_empty(self.binner, tile) {
                    self.paint_tile::<M>(source, tile, None, state, depths, None);
                }
            },
        );
    }

    /// Appends the ids of all tiles.
    pub(super) fn gather(&self, tiles: &[Tile], ids: &mut Vec<i32>) {
        Canvas::append(ids, self.binner.projector.region, |canvas| {
            pool::each(tiles.len(), |tile| self.write(tile, &tiles[tile], NONE, canvas));
        });
    }

    /// What covers a tile behind all else that is listed there.
    fn background(&self, source: Source<'_>, tile: usize) -> Option<Background> {
        /// Longer lists are seldom all in front of something.
        const MOST: usize = 64;
        let Binner { projector, grid, scene, .. } = self.binner;
        let project = |scene: &Scene, at: usize| {
            let (block, at) = scene.locate(at);
            projector.project(block.center(at), block.radius(at))
        };
        // The last to begin: its number, and the index of its sphere.
        let (number, index, count) = match source {
            Source::Spheres(lists) => {
                let entries = lists.tile(grid, tile);
                let nearest = |entry: &Entry| entry.sphere.nearest();
                let last = entries.iter().max_by(|a, b| nearest(a).total_cmp(&nearest(b)));
                last.filter(|_| entries.len() <= MOST)
                    .map(|last| (last.index.0, last.index, entries.len()))
            }
            Source::Groups(lists, ordered) => {
                let groups = lists.tile(grid, tile);
                let last = groups.iter().max_by(|a, b| a.nearest.total_cmp(&b.nearest));
                let only = last
                    .filter(|_| groups.len() <= MOST)
                    .and_then(|last| ordered.only(last.number));
                last.zip(only).map(|(last, only)| (last.number, only, groups.len()))
            }
        }?;
        let sphere = project(self.scene, index.at());
        let in_front = |other: u32, sphere_or_group: &dyn Fn() -> Projected| {
            other == number || sphere_or_group().farthest() < sphere.nearest()
        };
        let all_in_front = match source {
            Source::Spheres(lists) => {
                lists.tile(grid, tile).iter().all(|entry| in_front(entry.index.0, &|| entry.sphere))
            }
            Source::Groups(lists, _) => lists
                .tile(grid, tile)
                .iter()
                .all(|group| in_front(group.number, &|| project(scene, group.number as usize))),
        };
        let ([x, y], side) = grid.corner(tile);
        let columns = x..(x + side).min(projector.region.width as usize);
        let rows = y..(y + side).min(projector.region.height as usize);
        let found = all_in_front && covers(projector, &sphere, columns, rows);
        found.then_some(Background { index, number, sole: count == 1 })
    }

    /// Writes one id to all pixels of a tile.
    fn fill(&self, tile: usize, id: i32, canvas: &Canvas) {
        canvas.rows(&self.binner.grid, tile, |_, to| to.fill(MaybeUninit::new(id)));
    }

    /// Writes the ids of a tile; where there is none, `background`.
    #[inline(always)]
    fn write(&self, tile: usize, state: &Tile, background: i32, canvas: &Canvas) {
        canvas.rows(&self.binner.grid, tile, |row, to| {
            for (to, &id) in to.iter_mut().zip(state.ids(row)) {
                to.write(if id == NONE { background } else { id.max(UNDECIDED) });
            }
        });
    }

    /// Draws a tile but for what is left out; from nothing on and into the picture if `whole` tells
    /// where, and what lies behind all else.
    fn paint_tile<M: Mode>(
        &self,
        source: Source<'_>,
        tile: usize,
        without: Option<u32>,
        state: &mut Tile,
        depths: &mut Depths,
        whole: Option<(&Canvas, i32)>,
    ) {
        let (sums, mode) = (Sums::default(), PhantomData::<M>);
        let drawn = Drawn::default();
        let work = PaintTile {
            painter: self,
            source,
            without,
            tile,
            state,
            depths,
            whole,
            drawn,
            open: [u8::MAX; BLOCKS],
            settled: false,
            sums,
            mode,
        };
        let sums = tile::dispatch(self.binner.projector.projection, work);
        let mut all = self.sums.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        all.tally += sums.tally;
        all.tests += sums.tests;
        all.alike += sums.alike;
        all.entries += sums.entries;
    }
}

/// What tiles count.
#[derive(Clone, Copy, Default)]
pub(super) struct Sums {
    pub(super) tally: Tally,
    /// Pixels that spheres were tested at.
    pub(super) tests: u64,
    /// Pixels of blocks that certainly show one sphere.
    pub(super) alike: u64,
    /// Spheres that were tested at all.
    pub(super) entries: u64,
}

impl Sums {
    pub(super) fn add_to(self, counts: &mut Counts) {
        counts.tests += self.tests;
        counts.alike += self.alike as usize;
        counts.undecided += self.tally.signs as usize;
        counts.small += self.tally.small as usize;
        counts.exact += self.tally.big as usize;
    }
}

/// The last spheres that were drawn into a tile.
#[derive(Default)]
struct Drawn {
    spheres: Vec<Known>,
    next: usize,
}

/// A sphere that was drawn.
#[derive(Clone, Copy)]
struct Known {
    ball: Ball,
    index: SphereIndex,
    /// A clip plane may cut it: then it does not hide all that lies inside of it.
    cut: bool,
}

impl Drawn {
    /// How many are remembered.
    const MOST: usize = 16;

    /// Whether a sphere is nowhere seen in the tile: it is the same as one of these that comes
    /// before it, or lies inside of one.
    fn hide(&self, ball: Ball, index: SphereIndex) -> bool {
        let hides = |known: &Known| {
            if ball == known.ball {
                known.index < index
            } else {
                !known.cut && pair::inside(&ball, &known.ball)
            }
        };
        self.spheres.iter().any(hides)
    }

    /// Whether a ball lies inside of one of these.
    fn hold(&self, ball: Ball) -> bool {
        self.spheres.iter().any(|known| !known.cut && pair::inside(&ball, &known.ball))
    }

    /// Remembers a sphere, in place of the one that was remembered longest.
    fn add(&mut self, sphere: Known) {
        if self.spheres.len() < Self::MOST {
            self.spheres.push(sphere);
        } else {
            self.spheres[self.next] = sphere;
            self.next = (self.next + 1) % Self::MOST;
        }
    }
}

/// After so many spheres the depths of blocks are brought up to date.
const FRESH: usize = 64;

struct PaintTile<'a, M> {
    painter: &'a Painter<'a>,
    source: Source<'a>,
    /// What is listed and left out, by [`Background::number`].
    without: Option<u32>,
    tile: usize,
    state: &'a mut Tile,
    depths: &'a mut Depths,
    /// See [`Painter::paint_tile`].
    whole: Option<(&'a Canvas, i32)>,
    /// What was drawn since the tile is known to be crowded.
    drawn: Drawn,
    /// A bit for each block of each row of blocks in which it is not known what is seen.
    open: [u8; BLOCKS],
    /// Whether it is known of any.
    settled: bool,
    sums: Sums,
    mode: PhantomData<M>,
}

impl<M: Mode> tile::Work for PaintTile<'_, M> {
    type Output = Sums;

    #[inline(always)]
    fn run<L: Lanes, const PERSPECTIVE: bool>(mut self) -> Sums {
        let Painter { scene, truth, binner, .. } = *self.painter;
        let place = Place::new(scene, truth, &binner.projector, binner.grid.corner(self.tile).0);
        let place = place.until(self.painter.control);
        if self.whole.is_some() {
            self.painter.clear(self.tile, self.state);
        }
        self.state.begin::<M>(&place);
        match self.source {
            Source::Spheres(lists) => self.spheres::<L, PERSPECTIVE>(lists, &place),
            Source::Groups(lists, ordered) => self.groups::<L, PERSPECTIVE>(lists, ordered, &place),
        }
        if let Some((canvas, background)) = self.whole {
            self.painter.write(self.tile, self.state, background, canvas);
        }
        self.sums.tally = self.state.take_tally();
        self.sums
    }
}

impl<M: Mode> PaintTile<'_, M> {
    #[inline(always)]
    fn spheres<L: Lanes, const PERSPECTIVE: bool>(
        &mut self,
        lists: &Lists<Entry>,
        place: &Place<'_>,
    ) {
        let Binner { projector, grid, .. } = self.painter.binner;
        let blocks = self.painter.blocks;
        if !PERSPECTIVE && M::BOUNDS && blocks < f64::INFINITY && self.whole.is_some() {
            let entries = lists.tile(grid, self.tile);
            if entries.iter().any(|entry| entry.sphere.r >= blocks) {
                self.settle_blocks::<L>(entries, place);
            }
        }
        for slab in 0..grid.slabs {
            let entries = lists.slab(grid, self.tile, slab);
            if entries.is_empty() {
                continue;
            }
            if self.depths.farthest < grid.slab_start(slab) {
                break;
            }
            for some in
                [self.first(entries), entries].into_iter().flat_map(|entries| entries.chunks(FRESH))
            {
                if self.painter.control.is_cancelled() {
                    return;
                }
                for entry in some {
                    let out = self.without == Some(entry.index.0);
                    if !out && !hidden(self.depths, entry.sphere.nearest(), entry.window) {
                        self.entry::<L, PERSPECTIVE>(entry, projector.cuts(&entry.sphere), place);
                    }
                }
                self.freshen::<L, PERSPECTIVE>(place);
            }
        }
    }

    /// Finds blocks that show one sphere for certain: nothing is drawn there any more.
    #[inline(always)]
    fn settle_blocks<L: Lanes>(&mut self, entries: &[Entry], place: &Place<'_>) {
        let Binner { projector, .. } = self.painter.binner;
        let [columns, rows] = place.samples();
        let mut alike = Alike::new(columns, rows);
        for entry in entries.iter().filter(|entry| self.without != Some(entry.index.0)) {
            let Entry { sphere, index, window } = entry;
            let certain = sphere.r >= projector.screen.plain && !projector.cuts(sphere);
            alike.add::<L>(*index, sphere, *window, &projector.screen, certain);
        }
        for ([column, row], id) in alike.found() {
            self.state.settle_block([column, row], id);
            self.depths.blocks[row * BLOCKS + column] = f64::NEG_INFINITY;
            self.open[row] &= !(1 << column);
            self.settled = true;
            self.sums.alike += (BLOCK * BLOCK) as u64;
        }
        self.depths.farthest = self.depths.blocks.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    }

    /// Where very many spheres are listed, the one that begins nearest: where they all but
    /// coincide, it may hold all others.
    #[inline]
    fn first<'e>(&self, entries: &'e [Entry]) -> &'e [Entry] {
        /// Shorter lists are as soon drawn in any order.
        const MANY: usize = 1 << 12;
        if entries.len() < MANY {
            return &[];
        }
        let nearest = |entry: &&Entry| entry.sphere.nearest();
        entries
            .iter()
            .min_by(|a, b| nearest(a).total_cmp(&nearest(b)))
            .map_or(&[], std::slice::from_ref)
    }

    /// The spheres of groups, nearest groups first.
    #[inline(always)]
    fn groups<L: Lanes, const PERSPECTIVE: bool>(
        &mut self,
        lists: &Lists<Group>,
        ordered: &Ordered,
        place: &Place<'_>,
    ) {
        let Binner { projector, grid, .. } = self.painter.binner;
        let [x, y] = grid.corner(self.tile).0.map(|at| at as i32);
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
                if self.painter.control.is_cancelled() {
                    return;
                }
                let out = self.without == Some(group.number);
                if out || hidden(self.depths, group.nearest.into(), group.window) {
                    continue;
                }
                let first = ordered.starts[group.number as usize] as usize;
                let count = ordered.starts[group.number as usize + 1] as usize - first;
                // If no clip plane cuts the cluster's bounding sphere, none cuts its spheres. If a
                // sphere that was drawn holds the bounding sphere, it hides the whole cluster.
                let around = ordered.groups.known(group.number as usize);
                if self.state.is_crowded() && self.drawn.hold(around.into()) {
                    continue;
                }
                let cut = projector.cuts(&projector.project(around.center, around.radius));
                projector.project_batch(&ordered.block, first, &mut batch);
                projector.footprints(&mut batch);
                let farthest = self.depths.farthest;
                let mut seen = 0u64;
                for k in 0..BATCH {
                    let across =
                        (batch.left[k] <= batch.right[k].min(x + last)) & (batch.right[k] >= x);
                    let down =
                        (batch.top[k] <= batch.bottom[k].min(y + last)) & (batch.bottom[k] >= y);
                    seen |= u64::from(across & down & !(batch.nearest[k] > farthest)) << k;
                }
                seen &= u64::MAX >> (BATCH - count);
                spheres.clear();
                while seen != 0 {
                    let k = seen.trailing_zeros() as usize;
                    seen &= seen - 1;
                    let (left, right, top, bottom) =
                        (batch.left[k], batch.right[k], batch.top[k], batch.bottom[k]);
                    let wide = (left < x) | (right > x + last) && (top < y) | (bottom > y + last);
                    if wide && self.painter.binner.misses(&batch.sphere(k), column, row) {
                        continue;
                    }
                    let inside = |value: i32, from: i32| (value - from).clamp(0, last) as u8;
                    let window =
                        [inside(left, x), inside(right, x), inside(top, y), inside(bottom, y)];
                    if !hidden(self.depths, batch.nearest[k], window) {
                        let index = ordered.indices[first + k];
                        spheres.push(Entry { sphere: batch.sphere(k), index, window });
                    }
                }
                for entry in &spheres {
                    let cut = cut && projector.cuts(&entry.sphere);
                    self.entry::<L, PERSPECTIVE>(entry, cut, place);
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
    fn entry<L: Lanes, const PERSPECTIVE: bool>(
        &mut self,
        entry: &Entry,
        cut: bool,
        place: &Place<'_>,
    ) {
        if self.state.is_crowded() && self.is_hidden(entry, cut, place) {
            return;
        }
        let [left, right, top, bottom] = entry.window.map(usize::from);
        self.sums.entries += 1;
        let Entry { sphere, index, .. } = entry;
        if !PERSPECTIVE && self.settled {
            self.sums.tests += simd::dispatch(InOpen::<M> {
                state: self.state,
                place,
                entry,
                cut,
                open: &self.open,
                mode: PhantomData,
            });
            return;
        }
        self.sums.tests += ((right / LANES - left / LANES + 1) * LANES * (bottom - top + 1)) as u64;
        self.state.draw::<L, PERSPECTIVE, M>(
            place,
            *index,
            sphere,
            cut,
            [left, right],
            top..bottom + 1,
        );
    }

    /// Where spheres all but coincide: whether those that were drawn before hide this one. If not,
    /// it is one of them from now on.
    #[cold]
    #[inline(never)]
    fn is_hidden(&mut self, entry: &Entry, cut: bool, place: &Place<'_>) -> bool {
        let (ball, index) = (place.ball(entry.index), entry.index);
        let hidden = self.drawn.hide(ball, index);
        if !hidden {
            self.drawn.add(Known { ball, index, cut });
        }
        hidden
    }

    /// Brings the farthest depth of the blocks up to date.
    #[inline(always)]
    fn freshen<L: Lanes, const PERSPECTIVE: bool>(&mut self, place: &Place<'_>) {
        let mut fresh = false;
        while let Some((block, farthest)) = self.state.freshen::<L, PERSPECTIVE>(place) {
            let known = &mut self.depths.blocks[block];
            // What is held only comes nearer.
            *known = if farthest < *known { farthest } else { *known };
            fresh = true;
        }
        if fresh {
            self.depths.farthest =
                self.depths.blocks.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        }
    }
}

/// A sphere in the blocks of which it is not known what they show, for parallel rays; apart, so
/// that what most spheres need is compiled well. Gives how many pixels it was tested at.
struct InOpen<'a, M> {
    state: &'a mut Tile,
    place: &'a Place<'a>,
    entry: &'a Entry,
    cut: bool,
    open: &'a [u8; BLOCKS],
    mode: PhantomData<M>,
}

impl<M: Mode> simd::Work for InOpen<'_, M> {
    type Output = u64;

    #[inline(always)]
    fn run<L: Lanes>(self) -> u64 {
        let Self { state, place, entry: Entry { sphere, index, window }, cut, open, .. } = self;
        let [left, right, top, bottom] = window.map(usize::from);
        let window = (u8::MAX >> (BLOCKS - 1 - right / BLOCK)) & (u8::MAX << (left / BLOCK));
        let mut tests = 0;
        for row in top / BLOCK..=bottom / BLOCK {
            let mut open = open[row] & window;
            let down = top.max(row * BLOCK)..bottom.min(row * BLOCK + BLOCK - 1) + 1;
            // Blocks side by side at once.
            while open != 0 {
                let first = open.trailing_zeros() as usize;
                let count = (open >> first).trailing_ones() as usize;
                open &= !(u8::MAX >> (BLOCKS - count) << first);
                let across = [left.max(first * BLOCK), right.min((first + count) * BLOCK - 1)];
                tests += (count * BLOCK * down.len()) as u64;
                state.draw::<L, false, M>(place, *index, sphere, cut, across, down.clone());
            }
        }
        tests
    }
}
