//! The native device: tiles on all cores, f64, no driver.
//!
//! Each tile keeps, for every pixel, the nearest sphere so far and an interval that certainly holds its depth. A sphere's test
//! at a pixel ends in one of three ways: certainly behind or a miss; certainly in front; or in doubt, and then
//! [`crate::exact`] decides at once between it and the holder. So the holder is exact at all times, in any order of spheres.
//!
//! **Bounds.** `P` is the position bound of [`crate::project`], u = 2^-53, all in view lengths.
//!
//! *Orthographic.* `dx = sx - x` is within `D = P` of the truth. For `d^2 = dx^2 + dy^2 <= 4 r^2`,
//! `q = r^2 - d^2` is within `2 sqrt 2 d D + 2 D^2 + 4 u (r^2 + d^2) <= E = 6 r D + 2 D^2 + 32 u r^2` of the truth. Farther out
//! the truth is below `-3/4 d^2` and the error below `0.1 d^2` as long as `D <= r / 16`, so that `q < -E` still holds.
//! A larger `D` makes the sphere *vague*: `E` is infinite and every pixel of its box is decided exactly.
//!
//! *Perspective*, with `dir = (sx, sy, 1)`, `a = |dir|^2`, `K = 1 + max |s|`: `n = z sx - x` and `m = y - z sy` are within
//! `D = K P`, `k = n sy + m sx` within `2 K D + 10 u K |n, m|`, and `q = a r^2 - (n^2 + m^2 + k^2)` within
//! `E = 12 K^2 r D + 6 K^2 D^2 + 300 u K^3 r^2`, where the sum is at most `4 a r^2`; vague when `K D > r / 64`.
//! Depths are compared as `y = t a = b - sqrt q`, `b = x sx + y sy + z`, which spares a division; `b` is within `2 K P`.
//!
//! *Depth.* A hit is *solid* if `q >= T = max(4 E, 2^-16 r^2)`: then it is certain, and its square root is within
//! `E / sqrt T + u K r` of the truth, so that its depth is within `W = E / sqrt T + 4 K P + 2 u K r`. The few hits between
//! `-E` and `T` are no nearer than `b - sqrt(T + E) - W`; if that is not enough to reject them, they are decided exactly.

use std::{marker::PhantomData, ops::Range, sync::Mutex, time::Instant};

use rayon::prelude::*;

use crate::{
    bins::{Binner, Entry, Keep, Lists, Window, Workspace, split},
    camera::{Projection, Region, View},
    exact::decide::{Ball, Pixel, Tally, Truth},
    project::{FLOOR, Projected, U},
    render::{Counts, DrawError, Drawing, Times},
    scene::Scene,
    simd,
};

/// log2 of the side of a tile.
const SHIFT: u32 = 5;
/// Side of a tile, pixels.
const SIDE: usize = 1 << SHIFT;
/// Side of a block, for which the farthest depth is kept.
const BLOCK: usize = 8;
/// Blocks a side of a tile.
const BLOCKS: usize = SIDE / BLOCK;
/// Pixels tested together.
const LANES: usize = 8;
/// No sphere.
const NONE: u64 = u64::MAX;
/// About how many entries one wave has at most; each takes 84 bytes while the lists are made, 40 after.
const WAVE: usize = 1 << 20;
/// Pixels of a band at most: its state is 24 bytes a pixel when there are several waves.
const BAND: usize = 4 << 20;

/// What the tile kernel does with its bounds. Only [`Exact`] is used to draw; the others are compiled apart for `bench`, which
/// measures what exactness costs.
trait Mode: Copy + Send + Sync + 'static {
    /// Whether hits and depths have bounds; without, plain comparisons of rounded numbers.
    const BOUNDS: bool;
    /// Whether what the bounds leave open is decided; without, such pixels are [`UNDECIDED`].
    const DECIDES: bool;
}

/// The device.
#[derive(Clone, Copy)]
struct Exact;

impl Mode for Exact {
    const BOUNDS: bool = true;
    const DECIDES: bool = true;
}

/// Bounds without decisions.
#[derive(Clone, Copy)]
struct FilterOnly;

impl Mode for FilterOnly {
    const BOUNDS: bool = true;
    const DECIDES: bool = false;
}

/// Neither: wrong where rounding matters.
#[derive(Clone, Copy)]
struct Uncertified;

impl Mode for Uncertified {
    const BOUNDS: bool = false;
    const DECIDES: bool = false;
}

/// In place of an id by [`Cpu::draw_filter_only`]: the bounds leave open which sphere is nearest.
pub const UNDECIDED: i32 = -2;
/// Set in a holder's id where it is one of several that may be nearest; ids themselves are shorter.
const OPEN: u64 = 1 << 32;

/// Nothing that begins behind these depths is seen in a tile.
#[derive(Clone, Copy)]
struct Depths {
    /// Of the whole tile.
    farthest: f64,
    /// Of each block.
    blocks: [f64; BLOCKS * BLOCKS],
}

impl Depths {
    const NONE: Self = Self { farthest: f64::INFINITY, blocks: [f64::INFINITY; BLOCKS * BLOCKS] };
}

/// The pixels of a tile.
#[repr(align(64))]
#[derive(Clone)]
struct Tile {
    /// Upper bound of the holder's depth; infinite for none, negative infinite outside the region.
    high: [f64; SIDE * SIDE],
    /// Lower bound of it.
    low: [f64; SIDE * SIDE],
    /// The holder.
    id: [u64; SIDE * SIDE],
    /// Blocks whose depth may have become less.
    stale: u32,
}

impl Default for Tile {
    fn default() -> Self {
        let outside = [f64::NEG_INFINITY; SIDE * SIDE];
        Self { high: outside, low: outside, id: [NONE; SIDE * SIDE], stale: 0 }
    }
}

impl Tile {
    /// Nothing is seen yet in the first columns and rows; beyond them there are no pixels.
    fn clear(&mut self, columns: usize, rows: usize) {
        *self = Self { stale: u32::MAX, ..Self::default() };
        for row in 0..rows.min(SIDE) {
            let pixels = row * SIDE..row * SIDE + columns.min(SIDE);
            self.high[pixels.clone()].fill(f64::INFINITY);
            self.low[pixels].fill(f64::INFINITY);
        }
    }
}

/// The native device: memory that is kept from one picture to the next.
#[derive(Default)]
pub struct Cpu {
    lists: Workspace<Entry>,
    tiles: Vec<Tile>,
}

impl Cpu {
    /// Draws a region of a view of a scene on all cores.
    ///
    /// # Errors
    /// When memory does not suffice.
    pub fn draw(&mut self, scene: &Scene, view: &View, region: Region) -> Result<Drawing, DrawError> {
        self.draw_as::<Exact>(scene, view, region)
    }

    /// For `bench` only: as [`Cpu::draw`], but pixels that the bounds leave open are [`UNDECIDED`], and counted.
    ///
    /// # Errors
    /// When memory does not suffice.
    pub fn draw_filter_only(&mut self, scene: &Scene, view: &View, region: Region) -> Result<Drawing, DrawError> {
        let mut drawing = self.draw_as::<FilterOnly>(scene, view, region)?;
        drawing.counts.undecided = drawing.ids.par_iter().filter(|&&id| id == UNDECIDED).count();
        Ok(drawing)
    }

    /// For `bench` only: as [`Cpu::draw`] without bounds and decisions. Ids are wrong where rounding matters.
    ///
    /// # Errors
    /// When memory does not suffice.
    pub fn draw_uncertified(&mut self, scene: &Scene, view: &View, region: Region) -> Result<Drawing, DrawError> {
        self.draw_as::<Uncertified>(scene, view, region)
    }

    fn draw_as<M: Mode>(&mut self, scene: &Scene, view: &View, region: Region) -> Result<Drawing, DrawError> {
        let truth = Truth::new(view, scene.bounds());
        let mut ids = Vec::new();
        ids.try_reserve_exact(region.pixels()).map_err(|_| {
            let bytes = 4 * region.pixels();
            DrawError::Memory(format!("{bytes} bytes for the ids of {} pixels cannot be had", region.pixels()))
        })?;
        let mut drawing = Drawing {
            region,
            ids,
            counts: Counts { spheres: scene.len(), pixels: region.pixels(), ..Counts::default() },
            times: Times::default(),
        };
        let rows = (BAND / region.width as usize).max(SIDE) / SIDE * SIDE;
        let mut top = 0;
        while top < region.height {
            let height = (region.height - top).min(rows as u32);
            let band = Region { y: region.y + top, height, ..region };
            let start = drawing.ids.len();
            // The memory was reserved; what a tile does not reach stays background.
            drawing.ids.resize(start + band.pixels(), -1);
            self.draw_band::<M>(scene, &truth, band, &mut drawing, start);
            top += height;
        }
        Ok(drawing)
    }

    /// One band: its spheres in as many waves as memory wants, front ones first where that saves work.
    fn draw_band<M: Mode>(&mut self, scene: &Scene, truth: &Truth, band: Region, drawing: &mut Drawing, start: usize) {
        let begun = Instant::now();
        let binner = Binner::new(scene, truth, band, SHIFT);
        let grid = binner.grid;
        let sums = Mutex::new(Sums::default());
        let painter = Painter { scene, truth, binner: &binner, sums: &sums };
        let ids = &mut drawing.ids[start..];
        let front = if scene.len() >= SAMPLED { front_depths(&binner) } else { vec![f64::INFINITY; grid.tiles()] };
        let mut behind = front.iter().any(|&depth| depth < f64::INFINITY);
        let mut left = split(0..scene.len());
        let in_front = Visible { front: &front, drawn: None };
        let mut lists = binner.lists(&mut left, &in_front, WAVE, &mut self.lists);
        drawing.times.prepare += milliseconds(begun);
        if !behind && left.iter().all(Range::is_empty) {
            let drawn = Instant::now();
            drawing.counts.entries += lists.entries.len();
            painter.paint_once::<M>(lists, ids);
            drawing.times.render += milliseconds(drawn);
        } else {
            let drawn = Instant::now();
            self.tiles.resize_with(grid.tiles(), Tile::default);
            self.tiles.par_iter_mut().enumerate().for_each(|(tile, state)| {
                let (column, row) = (tile % grid.columns as usize, tile / grid.columns as usize);
                state.clear(band.width as usize - column * SIDE, band.height as usize - row * SIDE);
            });
            drawing.times.render += milliseconds(drawn);
            let mut depths = vec![Depths::NONE; grid.tiles()];
            let mut second = false;
            loop {
                let drawn = Instant::now();
                drawing.counts.entries += lists.entries.len();
                painter.paint::<M>(lists, &mut self.tiles, &mut depths);
                drawing.times.render += milliseconds(drawn);
                if left.iter().all(Range::is_empty) {
                    if !std::mem::take(&mut behind) {
                        break;
                    }
                    second = true;
                    left = split(0..scene.len());
                }
                let prepared = Instant::now();
                let visible = Visible { front: &front, drawn: second.then_some(&depths) };
                lists = binner.lists(&mut left, &visible, WAVE, &mut self.lists);
                drawing.times.prepare += milliseconds(prepared);
            }
            let drawn = Instant::now();
            painter.gather::<M>(&self.tiles, ids);
            drawing.times.render += milliseconds(drawn);
        }
        let Sums { tally, tests } = sums.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
        drawing.counts.tests += tests;
        drawing.counts.undecided += tally.signs as usize;
        drawing.counts.exact += tally.ties as usize;
        drawing.counts.big += tally.big as usize;
    }
}

/// What tiles count.
#[derive(Default)]
struct Sums {
    tally: Tally,
    /// Pixels that spheres were tested at.
    tests: u64,
}

fn milliseconds(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}

/// From this many spheres on, it is found out first how deep they lie.
const SAMPLED: usize = 1 << 17;
/// Layers of spheres' boxes that are drawn before the rest is looked at: what shows through eight is little.
const LAYERS: u64 = 8;

/// For each tile, a depth before which several layers of spheres begin, by a sample; infinite if there are not as many. A
/// guess: it decides only the order of work.
fn front_depths(binner: &Binner) -> Vec<f64> {
    let grid = &binner.grid;
    let areas = binner.sample(16);
    areas
        .chunks(grid.slabs as usize)
        .map(|slabs| {
            let mut area = 0;
            let enough = slabs.iter().position(|pixels| {
                area += pixels;
                area >= LAYERS * (SIDE * SIDE) as u64
            });
            enough.map_or(f64::INFINITY, |slab| grid.slab_start(slab as u32 + 1))
        })
        .collect()
}

/// What begins in front of a depth, or what begins behind it and is not hidden by what is drawn.
struct Visible<'a> {
    /// For each tile.
    front: &'a [f64],
    /// What is drawn of each tile, for the second.
    drawn: Option<&'a [Depths]>,
}

impl Keep for Visible<'_> {
    #[inline(always)]
    fn depths(&self, tile: usize) -> [f64; 2] {
        match self.drawn {
            None => [f64::NEG_INFINITY, self.front[tile]],
            // What begins at the very depth comes twice, which does no harm.
            Some(drawn) => [self.front[tile], drawn[tile].farthest],
        }
    }

    #[inline(always)]
    fn keep(&self, tile: usize, nearest: f64, window: Window) -> bool {
        self.drawn.is_none_or(|drawn| !hidden(&drawn[tile], nearest, window))
    }
}

/// Whether everything in a window lies in front of a depth.
#[inline(always)]
fn hidden(depths: &Depths, nearest: f64, [left, right, top, bottom]: Window) -> bool {
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
struct Painter<'a> {
    scene: &'a Scene,
    truth: &'a Truth,
    binner: &'a Binner<'a>,
    sums: &'a Mutex<Sums>,
}

/// Ids that tiles write, each its own pixels.
struct Canvas(*mut i32, usize);

// SAFETY: tiles do not overlap, and each is written by one thread; see `Painter::write`.
unsafe impl Sync for Canvas {}

impl Painter<'_> {
    /// Draws all there is, straight into the ids.
    fn paint_once<M: Mode>(&self, lists: &Lists<Entry>, ids: &mut [i32]) {
        let grid = &self.binner.grid;
        let canvas = Canvas(ids.as_mut_ptr(), ids.len());
        (0..grid.tiles()).into_par_iter().with_max_len(8).for_each(|tile| {
            if lists.tile(grid, tile).is_empty() {
                return;
            }
            let region = self.binner.projector.region;
            let (column, row) = (tile % grid.columns as usize, tile / grid.columns as usize);
            let mut state = Tile::default();
            state.clear(region.width as usize - column * SIDE, region.height as usize - row * SIDE);
            self.paint_tile::<M>(lists, tile, &mut state, &mut Depths::NONE.clone());
            self.write::<M>(tile, &state, &canvas);
        });
    }

    /// Draws on top of what there is.
    fn paint<M: Mode>(&self, lists: &Lists<Entry>, tiles: &mut [Tile], depths: &mut [Depths]) {
        let grid = &self.binner.grid;
        tiles.par_iter_mut().zip(depths).with_max_len(8).enumerate().for_each(|(tile, (state, depths))| {
            if !lists.tile(grid, tile).is_empty() {
                self.paint_tile::<M>(lists, tile, state, depths);
            }
        });
    }

    /// Writes the ids of all tiles.
    fn gather<M: Mode>(&self, tiles: &[Tile], ids: &mut [i32]) {
        let canvas = Canvas(ids.as_mut_ptr(), ids.len());
        tiles.par_iter().enumerate().for_each(|(tile, state)| self.write::<M>(tile, state, &canvas));
    }

    fn write<M: Mode>(&self, tile: usize, state: &Tile, canvas: &Canvas) {
        let Region { width, height, .. } = self.binner.projector.region;
        let columns = self.binner.grid.columns as usize;
        let (x, y) = (tile % columns * SIDE, tile / columns * SIDE);
        let across = SIDE.min(width as usize - x);
        for row in 0..SIDE.min(height as usize - y) {
            let start = (y + row) * width as usize + x;
            assert!(start + across <= canvas.1);
            // SAFETY: inside the ids, checked above; these pixels belong to this tile alone, and the ids outlive the threads.
            let to = unsafe { std::slice::from_raw_parts_mut(canvas.0.add(start), across) };
            for (to, &id) in to.iter_mut().zip(&state.id[row * SIDE..]) {
                // NONE becomes -1.
                *to = if !M::DECIDES && id != NONE && id & OPEN != 0 { UNDECIDED } else { id as i32 };
            }
        }
    }

    fn paint_tile<M: Mode>(&self, lists: &Lists<Entry>, tile: usize, state: &mut Tile, depths: &mut Depths) {
        let work = PaintTile { painter: self, lists, tile, state, depths, sums: Sums::default() };
        let Sums { tally, tests } = match self.binner.projector.projection {
            Projection::Orthographic => simd::dispatch(Ortho::<M>(work, PhantomData)),
            Projection::Perspective => simd::dispatch(Persp::<M>(work, PhantomData)),
        };
        let mut sums = self.sums.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        sums.tally += tally;
        sums.tests += tests;
    }
}

struct Ortho<'a, M>(PaintTile<'a>, PhantomData<M>);

impl<M: Mode> simd::Work for Ortho<'_, M> {
    type Output = Sums;

    #[inline(always)]
    fn run(self) -> Sums {
        self.0.run::<false, M>()
    }
}

struct Persp<'a, M>(PaintTile<'a>, PhantomData<M>);

impl<M: Mode> simd::Work for Persp<'_, M> {
    type Output = Sums;

    #[inline(always)]
    fn run(self) -> Sums {
        self.0.run::<true, M>()
    }
}

struct PaintTile<'a> {
    painter: &'a Painter<'a>,
    lists: &'a Lists<Entry>,
    tile: usize,
    state: &'a mut Tile,
    depths: &'a mut Depths,
    sums: Sums,
}

/// The bounds of one sphere; see the file's head.
struct Margins {
    /// `E`.
    doubt: f64,
    /// `T`.
    solid: f64,
    /// `W`.
    width: f64,
    /// A hit that is not solid begins no nearer than `b` less this.
    rim: f64,
}

impl Margins {
    #[inline(always)]
    fn new<const PERSPECTIVE: bool, M: Mode>(s: &Projected, kappa: f64) -> Self {
        if !M::BOUNDS {
            return Self { doubt: 0.0, solid: 0.0, width: 0.0, rim: 0.0 };
        }
        let (position, square) = (s.bound(), s.r * s.r);
        let (delta, doubt, vague) = if PERSPECTIVE {
            let (delta, wide) = (kappa * position, kappa * kappa);
            let doubt = 12.0 * wide * s.r * delta + 6.0 * wide * delta * delta + 300.0 * U * wide * kappa * square;
            (delta, doubt, kappa * delta > s.r / 64.0)
        } else {
            let doubt = 6.0 * s.r * position + 2.0 * position * position + 32.0 * U * square;
            (position, doubt, position > s.r / 16.0)
        };
        if vague {
            let rim = kappa * 2.0 * s.r + 8.0 * kappa * delta;
            return Self { doubt: f64::INFINITY, solid: f64::INFINITY, width: f64::INFINITY, rim };
        }
        let doubt = doubt + FLOOR;
        let least = square * (1.0 / 65536.0);
        let solid = if 4.0 * doubt > least { 4.0 * doubt } else { least };
        let width = (doubt / solid.sqrt() + 4.0 * kappa * position + 2.0 * U * kappa * s.r) * (1.0 + 1e-9);
        let rim = (solid + doubt).sqrt() * (1.0 + 1e-9) + width;
        Self { doubt, solid, width, rim }
    }
}

impl PaintTile<'_> {
    #[inline(always)]
    fn run<const PERSPECTIVE: bool, M: Mode>(mut self) -> Sums {
        let grid = self.painter.binner.grid;
        let (x, y) = (self.tile % grid.columns as usize * SIDE, self.tile / grid.columns as usize * SIDE);
        let projector = &self.painter.binner.projector;
        let columns: [f64; SIDE] = std::array::from_fn(|k| projector.columns[x + k]);
        let rows: [f64; SIDE] = std::array::from_fn(|k| projector.rows[y + k]);
        let lists = self.lists;
        for slab in 0..grid.slabs {
            let entries = lists.slab(&grid, self.tile, slab);
            if entries.is_empty() {
                continue;
            }
            if self.depths.farthest < grid.slab_start(slab) {
                break;
            }
            for some in entries.chunks(64) {
                for entry in some {
                    if hidden(self.depths, entry.sphere.nearest(), entry.window) {
                        continue;
                    }
                    let [left, right, top, bottom] = entry.window.map(u64::from);
                    let lanes = LANES as u64;
                    self.sums.tests += (right / lanes - left / lanes + 1) * lanes * (bottom - top + 1);
                    let s = &entry.sphere;
                    let bound = s.bound();
                    // The planes may cut it: then every pixel is looked at by itself.
                    if s.z - s.r - bound <= projector.near || s.z + s.r + bound >= projector.far {
                        self.clipped::<PERSPECTIVE, M>(entry, &columns, &rows, [x, y]);
                    } else {
                        self.whole::<PERSPECTIVE, M>(entry, &columns, &rows, [x, y]);
                    }
                }
                self.freshen::<PERSPECTIVE>(&columns, &rows);
            }
        }
        self.sums
    }

    /// Brings the farthest depth of the blocks up to date.
    #[inline(always)]
    fn freshen<const PERSPECTIVE: bool>(&mut self, columns: &[f64; SIDE], rows: &[f64; SIDE]) {
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
            let mut farthest = [f64::NEG_INFINITY; BLOCK];
            for row in y..y + BLOCK {
                for k in 0..BLOCK {
                    let mut depth = self.state.high[row * SIDE + x + k];
                    if PERSPECTIVE {
                        // From t a back to t; two roundings up.
                        depth /= 1.0 + columns[x + k] * columns[x + k] + rows[row] * rows[row];
                        depth += depth.abs() * (16.0 * U);
                    }
                    // A pixel outside the region is NaN or negative infinite here and hides nothing.
                    farthest[k] = if depth > farthest[k] { depth } else { farthest[k] };
                }
            }
            let farthest = farthest.into_iter().fold(f64::NEG_INFINITY, f64::max);
            // Screens so wide that |dir|^2 overflows have no depths to go by.
            let usable = self.painter.binner.projector.kappa < 1e70;
            self.depths.blocks[block] = if usable { farthest } else { f64::INFINITY };
        }
        self.depths.farthest = self.depths.blocks.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    }

    #[inline(always)]
    fn touch(&mut self, row: usize, first: usize) {
        self.state.stale |= 1 << (row / BLOCK * BLOCKS + first / BLOCK);
    }

    /// A sphere that no plane can cut: the near root, in vector form.
    #[inline(always)]
    fn whole<const PERSPECTIVE: bool, M: Mode>(
        &mut self,
        entry: &Entry,
        columns: &[f64; SIDE],
        rows: &[f64; SIDE],
        corner: [usize; 2],
    ) {
        let s = &entry.sphere;
        let kappa = self.painter.binner.projector.kappa;
        let Margins { doubt, solid, width, rim } = Margins::new::<PERSPECTIVE, M>(s, kappa);
        let square = s.r * s.r;
        let front = s.nearest();
        let id = u64::from(entry.index);
        let [left, right, top, bottom] = entry.window.map(usize::from);
        for row in top..=bottom {
            // Per row: the part of q that does not change along it.
            let sy = rows[row];
            let (m, along) = if PERSPECTIVE { (s.y - s.z * sy, s.y * sy + s.z) } else { (sy - s.y, s.z) };
            let (fixed, over) = if PERSPECTIVE { (m * m, 1.0 + sy * sy) } else { (square - m * m, 0.0) };
            for first in (left / LANES * LANES..=right).step_by(LANES) {
                let at = row * SIDE + first;
                let high: &mut [f64; LANES] = (&mut self.state.high[at..at + LANES]).try_into().expect("LANES long");
                let low: &mut [f64; LANES] = (&mut self.state.low[at..at + LANES]).try_into().expect("LANES long");
                let ids: &mut [u64; LANES] = (&mut self.state.id[at..at + LANES]).try_into().expect("LANES long");
                let (mut undecided, mut changed) = ([0u64; LANES], 0u64);
                let (mut qs, mut bs, mut possible) = ([0.0; LANES], [0.0; LANES], 0u64);
                for k in 0..LANES {
                    let sx = columns[first + k];
                    let (q, b) = if PERSPECTIVE {
                        let n = s.z * sx - s.x;
                        let cross = n * sy + m * sx;
                        let q = (over + sx * sx) * square - (fixed + n * n + cross * cross);
                        (q, s.x * sx + along)
                    } else {
                        let dx = sx - s.x;
                        (fixed - dx * dx, along)
                    };
                    // The nearest that parallel rays can meet; a square root would tell more, at a price.
                    let behind = !PERSPECTIVE & (front > high[k]);
                    possible |= u64::from(!((q < -doubt) | behind));
                    (qs[k], bs[k]) = (q, b);
                }
                if possible == 0 {
                    continue;
                }
                for k in 0..LANES {
                    let (q, b) = (qs[k], bs[k]);
                    let root = if q > 0.0 { q } else { 0.0 }.sqrt();
                    let sure = q >= solid;
                    let depth = b - root;
                    let least = if sure { depth - width } else { b - rim };
                    let most = depth + width;
                    let win = sure & (most < if M::BOUNDS { low[k] } else { high[k] });
                    let lose = (q < -doubt) | (least > high[k]);
                    undecided[k] = u64::from(M::BOUNDS & !(win | lose));
                    changed |= u64::from(win);
                    high[k] = if win { most } else { high[k] };
                    if M::BOUNDS {
                        low[k] = if win { least } else { low[k] };
                    }
                    ids[k] = if win { id } else { ids[k] };
                }
                if changed != 0 {
                    self.touch(row, first);
                }
                if undecided.iter().fold(0, |any, &u| any | u) != 0 {
                    for (k, &undecided) in undecided.iter().enumerate() {
                        if undecided == 0 {
                            continue;
                        }
                        let at = row * SIDE + first + k;
                        if M::DECIDES {
                            self.settle(entry.index, at, corner);
                        } else {
                            let depth = bs[k] - qs[k].max(0.0).sqrt();
                            let sure = qs[k] >= solid;
                            self.leave_open(
                                entry.index,
                                at,
                                if sure { depth - width } else { bs[k] - rim },
                                sure,
                                depth + width,
                            );
                        }
                    }
                }
            }
        }
    }

    /// A sphere that a plane may cut: either root, pixel by pixel.
    #[inline(always)]
    fn clipped<const PERSPECTIVE: bool, M: Mode>(
        &mut self,
        entry: &Entry,
        columns: &[f64; SIDE],
        rows: &[f64; SIDE],
        corner: [usize; 2],
    ) {
        let s = &entry.sphere;
        let projector = &self.painter.binner.projector;
        let Margins { doubt, solid, width, rim } = Margins::new::<PERSPECTIVE, M>(s, projector.kappa);
        let square = s.r * s.r;
        let [left, right, top, bottom] = entry.window.map(usize::from);
        for row in top..=bottom {
            let sy = rows[row];
            for column in left..=right {
                let (sx, at) = (columns[column], row * SIDE + column);
                let (q, b, a) = if PERSPECTIVE {
                    let (n, m) = (s.z * sx - s.x, s.y - s.z * sy);
                    let (cross, a) = (n * sy + m * sx, 1.0 + sx * sx + sy * sy);
                    (a * square - (m * m + n * n + cross * cross), s.x * sx + s.y * sy + s.z, a)
                } else {
                    let (dx, dy) = (sx - s.x, sy - s.y);
                    (square - (dx * dx + dy * dy), s.z, 1.0)
                };
                if q < -doubt || b - rim.max(q.max(0.0).sqrt() + width) > self.state.high[at] {
                    continue;
                }
                let root = q.max(0.0).sqrt();
                // The planes in the units of the depths, with the bounds of their own roundings.
                let [near, far] = [projector.near, projector.far].map(|plane| {
                    let plane = plane * a;
                    if plane == f64::INFINITY {
                        (plane, plane)
                    } else {
                        (plane * (1.0 - 8.0 * U), plane * (1.0 + 8.0 * U))
                    }
                });
                let inside = |depth: f64| depth - width >= near.1 && depth + width <= far.0;
                let outside = |depth: f64| depth + width < near.0 || depth - width > far.1;
                let (first, second) = (b - root, b + root);
                if !M::BOUNDS {
                    let seen = |depth: f64| depth >= projector.near * a && depth <= projector.far * a;
                    let depth = if b - root >= projector.near * a { b - root } else { b + root };
                    if seen(depth) && depth < self.state.high[at] {
                        self.state.high[at] = depth;
                        self.state.id[at] = u64::from(entry.index);
                        self.touch(row, column);
                    }
                    continue;
                }
                let depth = if q < solid {
                    None
                } else if inside(first) {
                    Some(first)
                } else if first - width > far.1 || (outside(first) && outside(second)) {
                    continue;
                } else if first + width < near.0 && inside(second) {
                    Some(second)
                } else {
                    None
                };
                match depth {
                    Some(depth) if depth - width > self.state.high[at] => {}
                    Some(depth) if depth + width < self.state.low[at] => {
                        self.state.high[at] = depth + width;
                        self.state.low[at] = depth - width;
                        self.state.id[at] = u64::from(entry.index);
                        self.touch(row, column);
                    }
                    _ if M::DECIDES => self.settle(entry.index, at, corner),
                    _ => {
                        let sure = depth.is_some();
                        let least = b - rim.max(root + width);
                        self.leave_open(entry.index, at, least, sure, depth.unwrap_or(f64::INFINITY) + width);
                    }
                }
            }
        }
    }

    /// For [`FilterOnly`]: a sphere that may be seen, no nearer than `least`; if it is for `sure`, no farther than `most`.
    #[cold]
    #[inline(never)]
    fn leave_open(&mut self, index: u32, at: usize, least: f64, sure: bool, most: f64) {
        let (holder, state) = (self.state.id[at], &mut *self.state);
        state.id[at] = OPEN | if holder == NONE { u64::from(index) } else { holder };
        state.low[at] = if least < state.low[at] { least } else { state.low[at] };
        if sure && most < state.high[at] {
            state.high[at] = most;
            self.touch(at / SIDE, at % SIDE);
        }
    }

    /// Decides exactly between a sphere and the holder of a pixel.
    #[cold]
    #[inline(never)]
    fn settle(&mut self, index: u32, at: usize, [x, y]: [usize; 2]) {
        let region = self.painter.binner.projector.region;
        let (column, row) = ((x + at % SIDE) as u32, (y + at / SIDE) as u32);
        if column >= region.width || row >= region.height {
            return;
        }
        let scene = self.painter.scene;
        let ball = Ball::from(scene.sphere(index as usize));
        let holder = self.state.id[at];
        let held = (holder != NONE).then(|| Ball::from(scene.sphere(holder as usize)));
        if held == Some(ball) {
            self.state.id[at] = holder.min(u64::from(index));
            return;
        }
        let pixel: Pixel = self.painter.truth.pixel(region.x + column, region.y + row);
        let Some(hit) = pixel.hit(ball, &mut self.sums.tally) else { return };
        if let Some(held) = held {
            // The holder was seen when it became the holder.
            let held = pixel.hit(held, &mut self.sums.tally).expect("the holder of a pixel is hit there");
            let order = pixel.order(&hit, &held, &mut self.sums.tally);
            if order.then(u64::from(index).cmp(&holder)).is_gt() {
                return;
            }
        }
        let [low, high] = hit.interval();
        self.state.low[at] = low;
        self.state.high[at] = high;
        self.state.id[at] = u64::from(index);
        self.touch(at / SIDE, at % SIDE);
    }
}
