//! Which spheres may be seen in which tile, roughly front to back: lists by one pass over the
//! spheres and a counting sort.
//!
//! A tile is a square of pixels; its list is split into *slabs* of depth by each sphere's nearest
//! point, so that drawing can stop early. Lists are conservative: a sphere that is not listed for a
//! tile is seen at none of its pixels. Both devices use them. Spheres are read where they lie,
//! projected in batches, and only what is kept is written. Where the lists of all spheres would be
//! too long for memory, they come in *waves*; what is drawn from them does not depend on the order.

use std::ops::Range;

use crate::{
    camera::{MAX_SIDE, Region},
    drawing::{Control, Met},
    exact::decide::Truth,
    float::U,
    ids::{SortedIndex, SphereIndex},
    order::{GROUP, Ordered},
    pool,
    project::{BATCH, Batch, Projector},
    projected::Projected,
    scene::{Block, Scene},
    simd,
};

/// Relative bound of the edge of a slab: lemma B1 of docs/numerics.md needs 3 u.
pub const EDGE: f64 = 4.0 * U;
/// log2 of the side of a tile in pixels, at most.
pub const MOST_SHIFT: u32 = 6;
// A `Window` is of `u8`.
const _: () = assert!(1 << MOST_SHIFT <= 1 << u8::BITS);
/// Slabs of a tile, at most.
const MOST_SLABS: u64 = 64;
/// Slabs of all tiles together, at most, where tiles have several.
const SLABS: u64 = 1 << 18;
// Keys are `u32` in `Found`. Numbers of tiles are `i32` in `Visit::batch`, of whatever side.
const _: () = assert!(SLABS <= 1 << u32::BITS);
const _: () = assert!(MAX_SIDE as u64 * MAX_SIDE as u64 <= i32::MAX as u64);
/// A tile misses a disc if it is farther from the middle than the radius by this many position
/// bounds (lemma B2 of docs/numerics.md).
pub const APART: f64 = 1.5;

/// Of fewer spheres lists are made by one thread.
const LITTLE: f64 = 1024.0;
/// To write fewer entries, other threads are not woken.
const FEW: usize = 1 << 15;

/// The tiles and slabs of a region.
#[derive(Clone, Copy, Debug)]
pub struct Grid {
    /// Side of a tile in pixels is `1 << shift`; at most [`MOST_SHIFT`].
    pub shift: u32,
    /// Tiles across.
    pub columns: u32,
    /// Tiles down.
    pub rows: u32,
    /// Slabs of depth.
    pub slabs: u32,
    /// Where the first begins.
    pub start: f64,
    per_depth: f64,
}

impl Grid {
    fn new(scene: &Scene, projector: &Projector, shift: u32) -> Self {
        let Region { width, height, .. } = projector.region;
        let (columns, rows) = (width.div_ceil(1 << shift), height.div_ceil(1 << shift));
        let bounds = scene.bounds();
        // The depths of the corners of the box, reduced to what the planes leave.
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for corner in bounds.corners() {
            let s = projector.project(corner, bounds.max_radius);
            (low, high) = (low.min(s.nearest()), high.max(s.z));
        }
        (low, high) = (
            low.max(projector.near - 2.0 * bounds.max_radius * projector.scale),
            high.min(projector.far),
        );
        let per_depth = 1.0 / (high - low);
        let usable = per_depth.is_finite() && per_depth > 0.0 && low.is_finite();
        let per_depth = if usable { per_depth } else { 0.0 };
        let one = Self { shift, columns, rows, slabs: 1, start: low, per_depth };
        one.with_slabs(Self::wanted(one.tiles(), scene.len() as f64))
    }

    /// How many slabs so many spheres want.
    fn wanted(tiles: usize, spheres: f64) -> u32 {
        // A slab to about 4,096 spheres a tile is plenty; few tiles may have more slabs.
        let by_tiles = SLABS / tiles.max(1) as u64;
        let by_spheres = (spheres / 256.0) as u64;
        by_tiles.min(by_spheres).clamp(1, MOST_SLABS) as u32
    }

    /// The same with so many slabs, if there can be several.
    fn with_slabs(self, slabs: u32) -> Self {
        if self.per_depth > 0.0 {
            Self {
                slabs,
                per_depth: self.per_depth * (f64::from(slabs) / f64::from(self.slabs)),
                ..self
            }
        } else {
            self
        }
    }

    /// Number of tiles.
    pub fn tiles(&self) -> usize {
        self.columns as usize * self.rows as usize
    }

    /// First column and row of a tile, and its side, in pixels.
    #[inline(always)]
    pub fn corner(&self, tile: usize) -> ([usize; 2], usize) {
        let columns = self.columns as usize;
        ([(tile % columns) << self.shift, (tile / columns) << self.shift], 1 << self.shift)
    }

    /// The number of a slab of a tile, by a depth in it.
    #[inline(always)]
    fn key(&self, tile: usize, nearest: f64) -> usize {
        tile * self.slabs as usize + self.slab(nearest) as usize
    }

    /// The slab of what begins at a depth.
    #[inline(always)]
    pub fn slab(&self, nearest: f64) -> u32 {
        // A cast of what is below 0 or NaN gives 0.
        (((nearest - self.start) * self.per_depth) as i32).clamp(0, self.slabs as i32 - 1) as u32
    }

    /// Nothing in this slab or later ones begins nearer than this.
    pub fn slab_start(&self, slab: u32) -> f64 {
        if slab == 0 {
            return f64::NEG_INFINITY;
        }
        // Lemma B1: `slab` rounds by 2 u of a depth, the quotient here by u, the sums by u of both.
        let depth = f64::from(slab) / self.per_depth;
        let edge = self.start + depth;
        edge - EDGE * (depth + edge.abs())
    }
}

/// What a tile list holds for a sphere.
pub trait Item: Copy + Default + Send + Sync {
    /// True: lists have one start a tile, and the least depth of each tile is kept. False: they
    /// have one start for each slab of each tile, and no least depths.
    const BY_TILE: bool = false;

    /// For a sphere that begins at depth `nearest`, and its pixels in the tile. Its number is that
    /// among what lists are made of: a [`SphereIndex`]; of a scene in order a [`SortedIndex`]; of
    /// clusters that stand for their spheres ([`Ordered::groups`]) that of a cluster.
    fn new(sphere: Projected, nearest: f64, number: u32, window: Window) -> Self;
}

impl Item for SortedIndex {
    const BY_TILE: bool = true;

    #[inline(always)]
    fn new(_: Projected, _: f64, number: u32, _: Window) -> Self {
        Self(number)
    }
}

/// First and last column, first and last row inside a tile.
pub type Window = [u8; 4];

/// A sphere in view space and its pixels in this tile, in lists of a scene that is not in order.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
pub struct Entry {
    /// The sphere.
    pub sphere: Projected,
    /// Which it is.
    pub index: SphereIndex,
    /// Its pixels.
    pub window: Window,
}

impl Item for Entry {
    #[inline(always)]
    fn new(sphere: Projected, _: f64, number: u32, window: Window) -> Self {
        Self { sphere, index: SphereIndex(number), window }
    }
}

/// A depth as f32, rounded towards the eye.
#[inline(always)]
pub fn towards_eye(depth: f64) -> f32 {
    let rounded = depth as f32;
    if f64::from(rounded) > depth { rounded.next_down() } else { rounded }
}

/// Which spheres go into a tile's list: those that begin in a range of depths, and pass a closer
/// look.
pub trait Keep: Sync {
    /// The least and the greatest depth at which what is kept begins.
    fn depths(&self, tile: usize) -> [f64; 2];

    /// In no tile anything is kept that begins behind this.
    fn farthest(&self) -> f64 {
        f64::INFINITY
    }

    /// The occluder of a tile, if it has one: a sphere that certainly covers all of its pixels, and
    /// hides whatever is not kept there. Gives its place and its near depth. It is appended to the
    /// tile's list only if a listed sphere may reach behind that depth, or if later batches of
    /// lists follow.
    #[inline(always)]
    fn behind(&self, _tile: usize) -> Option<(SortedIndex, f64)> {
        None
    }

    /// Whether an earlier batch of lists has the tiles' occluders already.
    fn listed(&self) -> bool {
        false
    }

    /// Whether a sphere that begins in the range is kept, given its pixels in the tile.
    fn keep(&self, tile: usize, nearest: f64, window: Window) -> bool;
}

/// All of them.
pub struct KeepAll;

impl Keep for KeepAll {
    #[inline(always)]
    fn depths(&self, _: usize) -> [f64; 2] {
        [f64::NEG_INFINITY, f64::INFINITY]
    }

    #[inline(always)]
    fn keep(&self, _: usize, _: f64, _: Window) -> bool {
        true
    }
}

/// Whether a depth lies outside a range; NaN does not.
#[inline(always)]
fn outside(depth: f64, [least, greatest]: [f64; 2]) -> bool {
    (depth < least) | (depth > greatest)
}

/// The lists of all tiles.
pub struct Lists<I> {
    /// `entries[starts[k]..starts[k + 1]]` is slab `k % slabs` of tile `k / slabs`; or tile `k`,
    /// see [`Item::BY_TILE`].
    pub starts: Vec<u32>,
    /// Spheres, tile by tile, slab by slab.
    pub entries: Vec<I>,
    /// For each tile that has entries the least depth at which one begins, see [`Item::BY_TILE`];
    /// of others it says nothing.
    pub nearest: Vec<f64>,
    /// What was met on the way.
    pub met: Met,
}

impl<I> Default for Lists<I> {
    fn default() -> Self {
        Self { starts: Vec::new(), entries: Vec::new(), nearest: Vec::new(), met: Met::default() }
    }
}

impl<I> Lists<I> {
    /// The entries of a slab of a tile.
    pub fn slab(&self, grid: &Grid, tile: usize, slab: u32) -> &[I] {
        let key = tile * grid.slabs as usize + slab as usize;
        &self.entries[self.starts[key] as usize..self.starts[key + 1] as usize]
    }

    /// The entries of a tile, front slabs first.
    pub fn tile(&self, grid: &Grid, tile: usize) -> &[I] {
        let slabs = grid.slabs as usize;
        &self.entries[self.starts[tile * slabs] as usize..self.starts[(tile + 1) * slabs] as usize]
    }
}

/// Makes lists for one region.
pub struct Binner<'a> {
    /// The spheres.
    pub scene: &'a Scene,
    /// The same in order: then groups are looked at first, ranges count groups, and what is listed
    /// is numbered by its place in the order.
    pub ordered: Option<&'a Ordered>,
    /// The camera.
    pub projector: Projector,
    /// The tiles.
    pub grid: Grid,
    /// So little is kept that one thread will do.
    little: bool,
    control: Option<&'a Control>,
}

impl<'a> Binner<'a> {
    /// For tiles with sides of `1 << shift` pixels.
    ///
    /// # Panics
    /// When that is more than [`MOST_SHIFT`].
    pub fn new(scene: &'a Scene, truth: &Truth, region: Region, shift: u32) -> Self {
        assert!(shift <= MOST_SHIFT, "tiles are at most 64 pixels wide");
        let projector = Projector::new(truth, region);
        let grid = Grid::new(scene, &projector, shift);
        Self { scene, ordered: None, projector, grid, little: false, control: None }
    }

    /// Ends when this is cancelled; lists then hold anything, and spheres are left.
    pub fn until(self, control: &'a Control) -> Self {
        Self { control: Some(control), ..self }
    }

    /// Whether it was cancelled.
    #[inline(always)]
    fn is_cancelled(&self) -> bool {
        self.control.is_some_and(Control::is_cancelled)
    }

    /// Goes by the groups of the same spheres in order.
    pub fn by_groups(self, ordered: Option<&'a Ordered>) -> Self {
        Self { ordered, ..self }
    }

    /// Chooses the number of depth slabs by how many spheres are kept, which a sample of the
    /// clusters tells.
    pub fn for_kept<K: Keep>(mut self, keep: &K) -> Self {
        let share = simd::dispatch(Share { binner: &self, keep });
        // If few spheres are visible, lists are short, and nearly empty slabs cost more than the
        // early stops that they allow.
        let kept = 0.25 * share * self.scene.len() as f64;
        self.grid = self.grid.with_slabs(Grid::wanted(self.grid.tiles(), kept));
        self.little = kept < LITTLE;
        self
    }

    /// Pixels that the boxes of what is kept cover in each slab of each tile, `[tile * slabs +
    /// slab]`, looking at one batch of the scene in `step`.
    pub fn sample<K: Keep>(&self, step: usize, keep: &K) -> Vec<u64> {
        let mut areas = vec![0u64; self.grid.tiles() * self.grid.slabs as usize];
        for first in (0..self.scene.len()).step_by(step * BATCH) {
            if self.is_cancelled() {
                break;
            }
            let batch = first..(first + BATCH).min(self.scene.len());
            simd::dispatch(Visit {
                binner: self,
                spheres: batch,
                keep,
                limit: usize::MAX,
                emit: |key: usize, _, _, _, _, [left, right, top, bottom]: Window| {
                    areas[key] +=
                        step as u64 * u64::from(right - left + 1) * u64::from(bottom - top + 1);
                    0
                },
            });
        }
        areas
    }

    /// Lists of what is kept of the spheres that are left; takes them out of `left`.
    ///
    /// Ends early, with spheres left, when about `limit` entries have come together. The memory of
    /// `workspace` is used again.
    pub fn lists<'w, I: Item, K: Keep>(
        &self,
        left: &mut [Range<usize>],
        keep: &K,
        limit: usize,
        workspace: &'w mut Workspace<I>,
    ) -> &'w mut Lists<I> {
        let Workspace { found, lists } = workspace;
        self.count(left, keep, limit, found);
        let whole = left.iter().all(Range::is_empty);
        lists.met = Met::default();
        found.iter().for_each(|found| lists.met += found.met);
        Scan::new(self.grid, keep, whole, found, lists).run();
        scatter(found, &mut lists.entries);
        lists
    }

    /// The first step: each thread keeps items of its part, and counts them by key.
    fn count<I: Item, K: Keep>(
        &self,
        left: &mut [Range<usize>],
        keep: &K,
        limit: usize,
        found: &mut Vec<Found<I>>,
    ) {
        let tiles = self.grid.tiles();
        let keys = tiles * self.grid.slabs as usize;
        let limit = (limit / left.len().max(1)).max(1);
        found.resize_with(left.len(), Found::default);
        let look = |(left, found): (&mut Range<usize>, &mut Found<I>)| {
            found.clear(keys, if I::BY_TILE { tiles } else { 0 });
            let emit = |key: usize,
                        tile: usize,
                        sphere: Projected,
                        nearest: f64,
                        number: u32,
                        window: Window| {
                if I::BY_TILE
                    && let Some((_, begins)) = keep.behind(tile)
                {
                    found.mixed[tile] |= !(sphere.farthest() < begins);
                }
                found.add(key, tile, nearest, I::new(sphere, nearest, number, window))
            };
            (left.start, found.met) =
                simd::dispatch(Visit { binner: self, spheres: left.clone(), keep, limit, emit });
        };
        if self.little {
            left.iter_mut().zip(&mut *found).for_each(look);
        } else {
            pool::each_of(left.iter_mut().zip(&mut *found), look);
        }
    }
}

/// The second step: where each part's entries of each key go, from the counts.
struct Scan<'a, I, K> {
    grid: Grid,
    keep: &'a K,
    /// Whether nothing is left to be looked at.
    whole: bool,
    /// Whether tiles' occluders are in earlier lists.
    listed: bool,
    /// Whether few tiles have entries.
    few: bool,
    found: &'a mut [Found<I>],
    lists: &'a mut Lists<I>,
    /// Entries before the next tile.
    total: u32,
    /// Where the next entries of each slab of a tile go.
    next: [u32; MOST_SLABS as usize],
}

impl<'a, I: Item, K: Keep> Scan<'a, I, K> {
    fn new(
        grid: Grid,
        keep: &'a K,
        whole: bool,
        found: &'a mut [Found<I>],
        lists: &'a mut Lists<I>,
    ) -> Self {
        let (tiles, listed) = (grid.tiles(), keep.listed());
        lists.nearest.resize(if I::BY_TILE { tiles } else { 0 }, f64::INFINITY);
        let items: usize = found.iter().map(|found| found.keys.len()).sum();
        let few = I::BY_TILE && whole && items < tiles / 4;
        lists.starts.clear();
        let next = [0; MOST_SLABS as usize];
        Self { grid, keep, whole, listed, few, found, lists, total: 0, next }
    }

    fn run(mut self) {
        let tiles = self.grid.tiles();
        if self.few {
            for (at, bits) in self.touched().into_iter().enumerate() {
                let mut bits = bits;
                while bits != 0 {
                    self.tile(at * 64 + bits.trailing_zeros() as usize);
                    bits &= bits - 1;
                }
            }
        } else {
            (0..tiles).for_each(|tile| self.tile(tile));
        }
        if I::BY_TILE {
            self.lists.starts.resize(tiles, self.total);
        }
        self.lists.starts.push(self.total);
    }

    /// Tiles that have entries, a bit for each.
    fn touched(&self) -> Vec<u64> {
        let mut touched = vec![0u64; self.grid.tiles().div_ceil(64)];
        for &key in self.found.iter().flat_map(|found| &found.keys) {
            let tile = key as usize / self.grid.slabs as usize;
            touched[tile / 64] |= 1 << (tile % 64);
        }
        touched
    }

    /// The next tile.
    #[inline(always)]
    fn tile(&mut self, tile: usize) {
        if I::BY_TILE && self.begin(tile) == f64::INFINITY {
            return;
        }
        let slabs = self.grid.slabs as usize;
        let keys = tile * slabs..(tile + 1) * slabs;
        let next = &mut self.next[..slabs];
        next.fill(0);
        for part in &*self.found {
            next.iter_mut().zip(&part.counts[keys.clone()]).for_each(|(sum, count)| *sum += count);
        }
        for next in &mut *next {
            if !I::BY_TILE {
                self.lists.starts.push(self.total);
            }
            let count = std::mem::replace(next, self.total);
            self.total =
                self.total.checked_add(count).expect("a wave is shorter than 2^32 entries");
        }
        for part in &mut *self.found {
            for (next, to) in next.iter_mut().zip(&mut part.counts[keys.clone()]) {
                // Keys without items stay at 0.
                let count = *to;
                *to = if count == 0 { 0 } else { *next };
                *next += count;
            }
        }
    }

    /// Where the list of a tile starts, with its occluder if it must be listed; gives the least
    /// depth of the list, infinite if it is empty.
    #[inline(always)]
    fn begin(&mut self, tile: usize) -> f64 {
        let Self { keep, whole, found, lists, total, .. } = self;
        if self.few {
            // The tiles between the last one and this have no entries: their lists start here,
            // too.
            lists.starts.resize(tile, *total);
        }
        lists.starts.push(*total);
        let mut nearest =
            found.iter().map(|found| found.nearest[tile]).fold(f64::INFINITY, f64::min);
        if !self.listed
            && let Some((index, begins)) = keep.behind(tile)
            && (!*whole || found.iter().any(|found| found.mixed[tile]))
            && let Some(first) = found.first_mut()
        {
            let item = I::new(Projected::default(), begins, index.0, Window::default());
            first.add(self.grid.key(tile, begins), tile, begins, item);
            nearest = nearest.min(begins);
        }
        lists.nearest[tile] = nearest;
        nearest
    }
}

/// The third step: every item to its place.
fn scatter<I: Item>(found: &mut [Found<I>], entries: &mut Vec<I>) {
    let limit = found.iter().map(|found| found.items.len()).sum();
    entries.clear();
    entries.reserve(limit);
    let target = Target(entries.as_mut_ptr());
    let write = |Found { items, keys, counts, .. }: &mut Found<I>| {
        let target = &target;
        for (item, key) in items.iter().zip(&*keys) {
            let at = counts[*key as usize];
            counts[*key as usize] += 1;
            assert!((at as usize) < limit, "more entries than were counted");
            // SAFETY: `at` lies inside the allocation, and nothing else writes it: the scan gave
            // this part and key a range of its own, as long as the number of its items.
            unsafe { target.0.add(at as usize).write(*item) };
        }
    };
    if limit < FEW {
        found.iter_mut().for_each(write);
    } else {
        pool::each_of(found.iter_mut(), write);
    }
    // SAFETY: the ranges that the scan gave out cover 0..limit, and each part filled its own.
    unsafe { entries.set_len(limit) };
}

/// Memory for lists, kept from one to the next.
pub struct Workspace<I> {
    found: Vec<Found<I>>,
    /// What was made last.
    pub lists: Lists<I>,
}

impl<I> Default for Workspace<I> {
    fn default() -> Self {
        Self { found: Vec::new(), lists: Lists::default() }
    }
}

/// What one thread finds. Lengths of vectors change with every item: two threads' must not share a
/// cache line, nor a pair of lines, which are fetched together.
#[repr(align(128))]
struct Found<I> {
    items: Vec<I>,
    /// Tile and slab of each item.
    keys: Vec<u32>,
    /// How many items a key has.
    counts: Vec<u32>,
    /// See [`Lists::nearest`].
    nearest: Vec<f64>,
    /// For each tile: whether a listed sphere may reach behind the near depth of the tile's
    /// occluder (see [`Keep::behind`]), which must be listed then.
    mixed: Vec<bool>,
    /// What was met on the way.
    met: Met,
}

impl<I: Item> Found<I> {
    /// Nothing is found yet of so many keys, and tiles if these are told apart, see
    /// [`Item::BY_TILE`].
    fn clear(&mut self, keys: usize, tiles: usize) {
        if self.counts.len() == keys && self.nearest.len() == tiles && self.keys.len() < keys / 8 {
            // Few were written, and tiles have as many slabs as then.
            let slabs = keys / tiles.max(1);
            for key in self.keys.iter().map(|&key| key as usize) {
                self.counts[key] = 0;
                if tiles > 0 {
                    (self.nearest[key / slabs], self.mixed[key / slabs]) = (f64::INFINITY, false);
                }
            }
        } else {
            self.counts.clear();
            self.counts.resize(keys, 0);
            self.nearest.clear();
            self.nearest.resize(tiles, f64::INFINITY);
            self.mixed.clear();
            self.mixed.resize(tiles, false);
        }
        self.items.clear();
        self.keys.clear();
    }

    /// An item that begins at a depth, in a slab of a tile's list by its number. Returns how many
    /// items there are.
    #[inline(always)]
    fn add(&mut self, key: usize, tile: usize, nearest: f64, item: I) -> usize {
        if I::BY_TILE {
            let least = &mut self.nearest[tile];
            *least = if nearest < *least { nearest } else { *least };
        }
        self.counts[key] += 1;
        self.keys.push(key as u32);
        self.items.push(item);
        self.items.len()
    }
}

impl<I> Default for Found<I> {
    fn default() -> Self {
        let (items, keys, counts) = (Vec::new(), Vec::new(), Vec::new());
        Self { items, keys, counts, nearest: Vec::new(), mixed: Vec::new(), met: Met::default() }
    }
}

/// Where entries are written by several threads.
struct Target<I>(*mut I);

// SAFETY: each thread writes places of its own, see `scatter`.
unsafe impl<I> Sync for Target<I> {}

/// Contiguous parts of some spheres, one a thread; few spheres are one part.
pub fn split(spheres: Range<usize>) -> Vec<Range<usize>> {
    split_into(spheres, 1 << 12, BATCH)
}

/// The same for groups of spheres.
pub fn split_groups(groups: Range<usize>) -> Vec<Range<usize>> {
    split_into(groups, (1 << 12) / GROUP, 1)
}

fn split_into(all: Range<usize>, least: usize, multiple: usize) -> Vec<Range<usize>> {
    let parts = rayon::current_num_threads().min(all.len().div_ceil(least)).max(1);
    let size = all.len().div_ceil(parts).next_multiple_of(multiple).max(multiple);
    (0..parts)
        .map(|part| {
            let start = (all.start + part * size).min(all.end);
            start..(start + size).min(all.end)
        })
        .collect()
}

/// Projects spheres and hands out what is kept, tile by tile; ends early once `emit` answers
/// `limit` or more. Takes the key, the tile, the sphere, where it begins, its number (see
/// [`Item::new`]) and its pixels.
struct Visit<'a, K, F> {
    binner: &'a Binner<'a>,
    spheres: Range<usize>,
    keep: &'a K,
    limit: usize,
    emit: F,
}

impl<K: Keep, F: FnMut(usize, usize, Projected, f64, u32, Window) -> usize> simd::Work
    for Visit<'_, K, F>
{
    /// The first sphere, or group, that was not looked at, and what was met before it.
    type Output = (usize, Met);

    #[inline(always)]
    fn run<L: simd::Lanes>(mut self) -> (usize, Met) {
        let Binner { scene, ordered, projector, .. } = self.binner;
        let farthest = self.keep.farthest();
        let mut batch = Batch::default();
        let mut met = Met::default();
        let Range { start, end } = self.spheres;
        let Some(ordered) = ordered else {
            for (before, block) in scene.blocks() {
                let end = (before + block.len()).min(end);
                let mut first = before.max(start);
                while first < end {
                    projector.project_batch(block, first - before, &mut batch);
                    let len = batch.len.min(end - first);
                    let found = self.batch(&mut batch, len, farthest, first, &mut met);
                    first += len;
                    if found >= self.limit || self.binner.is_cancelled() {
                        return (first, met);
                    }
                }
            }
            return (end, met);
        };
        let Some((_, groups)) = ordered.groups.blocks().next() else { return (end, met) };
        let mut around = Batch::default();
        for some in (start..end).step_by(BATCH) {
            if self.binner.is_cancelled() {
                return (some, met);
            }
            let [mut on_screen, hidden] =
                self.binner.groups_seen(groups, (self.keep, farthest), some..end, &mut around);
            while on_screen != 0 {
                let k = on_screen.trailing_zeros() as usize;
                on_screen &= on_screen - 1;
                let [first, next] = [0, 1].map(|more| ordered.starts[some + k + more] as usize);
                if hidden >> k & 1 == 1 {
                    met.on_screen += next - first;
                    continue;
                }
                projector.project_batch(&ordered.block, first, &mut batch);
                let found = self.batch(&mut batch, next - first, farthest, first, &mut met);
                if found >= self.limit {
                    return (some + k + 1, met);
                }
            }
        }
        (end, met)
    }
}

impl<K: Keep, F: FnMut(usize, usize, Projected, f64, u32, Window) -> usize> Visit<'_, K, F> {
    /// The first spheres of a batch that is projected; they are numbered from `first` on. Answers
    /// with what `emit` said last.
    #[inline(always)]
    fn batch(
        &mut self,
        batch: &mut Batch,
        len: usize,
        farthest: f64,
        first: usize,
        met: &mut Met,
    ) -> usize {
        let Binner { projector, grid, .. } = self.binner;
        projector.footprints(batch);
        let last_tile = grid.tiles() as i32 - 1;
        let on_screen = batch.on_screen(len);
        met.on_screen += on_screen.count_ones() as usize;
        let mut behind = 0u64;
        for k in 0..BATCH {
            behind |= u64::from(batch.nearest[k] > farthest) << k;
        }
        let mut seen = on_screen & !behind;
        if seen.count_ones() > 8 {
            // A sphere inside one tile, as most small ones are, can be told by that tile's depths.
            // Off screen, the tile is made up, and the answer not used.
            let (mut tiles, mut several) = ([0; BATCH], 0u64);
            for k in 0..BATCH {
                let (left, right) = (batch.left[k] >> grid.shift, batch.right[k] >> grid.shift);
                let (top, bottom) = (batch.top[k] >> grid.shift, batch.bottom[k] >> grid.shift);
                tiles[k] = (top * grid.columns as i32 + left).clamp(0, last_tile);
                several |= u64::from((left != right) | (top != bottom)) << k;
            }
            let mut gone = 0u64;
            for k in 0..BATCH {
                gone |=
                    u64::from(outside(batch.nearest[k], self.keep.depths(tiles[k] as usize))) << k;
            }
            seen &= !gone | several;
        }
        let mut found = 0;
        while seen != 0 {
            let k = seen.trailing_zeros() as usize;
            seen &= seen - 1;
            let before = found;
            let behind;
            (found, behind) = self.place(batch, k, (first + k) as u32, found);
            met.listed += usize::from(found != before || behind);
        }
        found
    }

    /// Offers a sphere to its tiles. Returns what `emit` said last, and whether the sphere lies
    /// behind all else in some.
    #[inline(always)]
    fn place(&mut self, batch: &Batch, k: usize, number: u32, mut found: usize) -> (usize, bool) {
        let grid = &self.binner.grid;
        let (left, right, top, bottom) =
            (batch.left[k], batch.right[k], batch.top[k], batch.bottom[k]);
        let (left_tile, right_tile) = (left >> grid.shift, right >> grid.shift);
        let (top_tile, bottom_tile) = (top >> grid.shift, bottom >> grid.shift);
        let nearest = batch.nearest[k];
        let last = (1 << grid.shift) - 1;
        let mut behind = false;
        let keep = self.keep;
        let tile_at =
            |column: i32, row: i32| row as usize * grid.columns as usize + column as usize;
        let covers = |tile: usize| keep.behind(tile).is_some_and(|(other, _)| other.0 == number);
        let mut offer = |tile: usize, window: Window| {
            if covers(tile) {
                behind = true;
            } else if !outside(nearest, keep.depths(tile)) && keep.keep(tile, nearest, window) {
                let key = grid.key(tile, nearest);
                found = (self.emit)(key, tile, batch.sphere(k), nearest, number, window);
            }
        };
        if left_tile == right_tile && top_tile == bottom_tile {
            // Most small spheres.
            let inside = |value: i32| (value & last) as u8;
            offer(
                tile_at(left_tile, top_tile),
                [inside(left), inside(right), inside(top), inside(bottom)],
            );
            return (found, behind);
        }
        let many = right_tile - left_tile > 1 && bottom_tile - top_tile > 1;
        for row in top_tile..=bottom_tile {
            for column in left_tile..=right_tile {
                let tile = tile_at(column, row);
                if many && !covers(tile) && self.binner.misses(&batch.sphere(k), column, row) {
                    continue;
                }
                let (x, y) = (column << grid.shift, row << grid.shift);
                let inside = |value: i32, from: i32| (value - from).clamp(0, last) as u8;
                offer(tile, [inside(left, x), inside(right, x), inside(top, y), inside(bottom, y)]);
            }
        }
        (found, behind)
    }
}

/// The share of groups of which anything may be kept.
struct Share<'a, K> {
    binner: &'a Binner<'a>,
    keep: &'a K,
}

impl<K: Keep> simd::Work for Share<'_, K> {
    type Output = f64;

    #[inline(always)]
    fn run<L: simd::Lanes>(self) -> f64 {
        // So many batches tell enough.
        const BATCHES: usize = 64;
        let Self { binner, keep } = self;
        let Some((_, groups)) = binner.ordered.and_then(|ordered| ordered.groups.blocks().next())
        else {
            return 1.0;
        };
        let mut around = Batch::default();
        let (farthest, mut seen, mut of) = (keep.farthest(), 0, 0);
        let step = groups.len().div_ceil(BATCHES * BATCH) * BATCH;
        for some in (0..groups.len()).step_by(step) {
            let [on_screen, hidden] =
                binner.groups_seen(groups, (keep, farthest), some..groups.len(), &mut around);
            seen += (on_screen & !hidden).count_ones();
            of += around.len;
        }
        f64::from(seen) / of as f64
    }
}

impl Binner<'_> {
    /// Culls the first batch of some clusters. The first mask has a bit for each cluster on the
    /// screen; the second for each of these that is hidden, as it begins behind the farthest depth
    /// that is kept in all its tiles. `farthest` is [`Keep::farthest`].
    #[inline(always)]
    fn groups_seen<K: Keep>(
        &self,
        groups: &Block,
        (keep, farthest): (&K, f64),
        some: Range<usize>,
        around: &mut Batch,
    ) -> [u64; 2] {
        let Self { grid, projector, .. } = self;
        projector.project_batch(groups, some.start, around);
        projector.footprints(around);
        let on_screen = around.on_screen(around.len.min(some.len()));
        let (mut left, mut hidden) = (on_screen, 0);
        while left != 0 {
            let k = left.trailing_zeros() as usize;
            left &= left - 1;
            let nearest = around.nearest[k];
            let tiles = |first: i32, last: i32| {
                (first >> grid.shift) as usize..=(last >> grid.shift) as usize
            };
            let hides = || {
                tiles(around.top[k], around.bottom[k]).all(|row| {
                    let mut columns = tiles(around.left[k], around.right[k]);
                    columns.all(|column| {
                        nearest > keep.depths(row * grid.columns as usize + column)[1]
                    })
                })
            };
            hidden |= u64::from(nearest > farthest || hides()) << k;
        }
        [on_screen, hidden]
    }

    /// Whether a tile inside a sphere's bounding box lies outside its disc, for certain; only told
    /// for parallel rays.
    #[inline(always)]
    pub fn misses(&self, sphere: &Projected, column: i32, row: i32) -> bool {
        if self.projector.projection == crate::camera::Projection::Perspective {
            return false;
        }
        let Region { width, height, .. } = self.projector.region;
        let first = |tile: i32| (tile as usize) << self.grid.shift;
        let last = |tile: i32, count: u32| {
            (first(tile) + (1 << self.grid.shift) - 1).min(count as usize - 1)
        };
        let (columns, rows) = (&self.projector.columns, &self.projector.rows);
        let apart = |low: f64, high: f64, at: f64| (low - at).max(at - high).max(0.0);
        let dx = apart(columns[first(column)], columns[last(column, width)], sphere.x);
        let dy = apart(rows[last(row, height)], rows[first(row)], sphere.y);
        // Lemma B2: the distance is within `9.9 u L + 4.3 u d`; the rest of `1.5 P` is for squares.
        let reach = sphere.r + APART * sphere.bound();
        dx * dx + dy * dy > reach * reach
    }
}
