//! The native device: tiles on all cores, f64, no driver.
//!
//! Each tile keeps, for every pixel, the nearest sphere so far and an interval that certainly holds its depth. A sphere's test
//! at a pixel ends in one of three ways: certainly behind or a miss; certainly in front; or in doubt, and then
//! [`crate::exact`] decides at once between it and the holder. So the holder is exact at all times, in any order of spheres.
//!
//! The bounds are derived in [`crate::filter`].

use std::{marker::PhantomData, ops::Range, sync::Mutex, time::Instant};

use rayon::prelude::*;

use crate::{
    bins::{Binner, Entry, Keep, Lists, Met, Window, Workspace, split},
    camera::{Projection, Region, View},
    exact::decide::{Ball, Hit, Root, Tally, Truth},
    filter::{BACK, Look, Margins, Row, length},
    plan::UNDECIDED,
    render::{Counts, DrawError, Drawing, Times},
    scene::Scene,
    simd::{self, LANES, Lanes},
};

/// log2 of the side of a tile.
pub(crate) const SHIFT: u32 = 5;
/// Side of a tile, pixels.
const SIDE: usize = 1 << SHIFT;
/// Side of a block, for which the farthest depth is kept.
const BLOCK: usize = 8;
/// Blocks a side of a tile.
const BLOCKS: usize = SIDE / BLOCK;
/// No sphere, as an index among f64: the conversion to i32 gives -1.
const NONE: f64 = -1.0;
/// About how many entries one wave has at most; each takes 84 bytes while the lists are made, 40 after.
pub(crate) const WAVE: usize = 1 << 20;
/// Pixels of a band at most: its state is 24 bytes a pixel when there are several waves.
pub(crate) const BAND: usize = 4 << 20;

/// What the tile kernel does with its bounds. Only [`Exact`] is used to draw; the others are compiled apart for `bench`, which
/// measures what exactness costs.
trait Mode: Copy + Send + Sync + 'static {
    /// Whether hits and depths have bounds; without, plain comparisons of rounded numbers.
    const BOUNDS: bool;
    /// Whether what the bounds leave open is decided; without, such pixels are [`crate::plan::UNDECIDED`].
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

/// Added to a holder's index where it is one of several that may be nearest; indices themselves are smaller.
const OPEN: f64 = (1u64 << 32) as f64;

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
    /// Index of the holder, as an f64 so that it can be chosen along with the others.
    id: [f64; SIDE * SIDE],
    /// No holder's depth is less than its upper bound by more than this.
    slack: f64,
    /// Blocks whose depth may have become less.
    stale: u32,
}

impl Default for Tile {
    fn default() -> Self {
        let outside = [f64::NEG_INFINITY; SIDE * SIDE];
        Self { high: outside, id: [NONE; SIDE * SIDE], slack: 0.0, stale: 0 }
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
        *self = Self { stale: u32::MAX, ..Self::default() };
        for row in 0..rows.min(SIDE) {
            let pixels = row * SIDE..row * SIDE + columns.min(SIDE);
            self.high[pixels].fill(f64::INFINITY);
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
        let mut met = lists.met;
        drawing.counts.tiles += grid.tiles();
        if !behind && left.iter().all(Range::is_empty) {
            let drawn = Instant::now();
            drawing.counts.entries += lists.entries.len();
            drawing.counts.empty += (0..grid.tiles()).filter(|&tile| lists.tile(&grid, tile).is_empty()).count();
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
            let mut empty = vec![true; grid.tiles()];
            let mut second = false;
            loop {
                let drawn = Instant::now();
                drawing.counts.entries += lists.entries.len();
                empty.iter_mut().enumerate().for_each(|(tile, empty)| *empty &= lists.tile(&grid, tile).is_empty());
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
                // The second time the same spheres are on the screen again.
                met += Met { on_screen: if second { 0 } else { lists.met.on_screen }, ..lists.met };
                drawing.times.prepare += milliseconds(prepared);
            }
            let drawn = Instant::now();
            painter.gather::<M>(&self.tiles, ids);
            drawing.counts.empty += empty.iter().filter(|empty| **empty).count();
            drawing.times.render += milliseconds(drawn);
        }
        let Sums { tally, tests } = sums.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
        drawing.counts.tests += tests;
        drawing.counts.undecided += tally.signs as usize;
        drawing.counts.small += tally.small as usize;
        drawing.counts.exact += tally.big as usize;
        drawing.counts.note(band == drawing.region, met);
    }
}

fn milliseconds(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}

/// From this many spheres on, it is found out first how deep they lie.
pub(crate) const SAMPLED: usize = 1 << 17;
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
                *to = if !M::DECIDES && id >= OPEN { UNDECIDED } else { id as i32 };
            }
        }
    }

    fn paint_tile<M: Mode>(&self, lists: &Lists<Entry>, tile: usize, state: &mut Tile, depths: &mut Depths) {
        let work = PaintTile { painter: self, lists, tile, state, depths, sums: Sums::default() };
        let sums = match self.binner.projector.projection {
            Projection::Orthographic => simd::dispatch(Ortho(work, PhantomData::<M>)),
            Projection::Perspective => simd::dispatch(Persp(work, PhantomData::<M>)),
        };
        let mut all = self.sums.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        all.tally += sums.tally;
        all.tests += sums.tests;
    }
}

/// What tiles count.
#[derive(Clone, Copy, Default)]
struct Sums {
    tally: Tally,
    /// Pixels that spheres were tested at.
    tests: u64,
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

struct PaintTile<'a> {
    painter: &'a Painter<'a>,
    lists: &'a Lists<Entry>,
    tile: usize,
    state: &'a mut Tile,
    depths: &'a mut Depths,
    sums: Sums,
}

impl PaintTile<'_> {
    #[inline(always)]
    fn run<L: Lanes, const PERSPECTIVE: bool, M: Mode>(mut self) -> Sums {
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
                    if projector.cuts(&entry.sphere) {
                        self.clipped::<PERSPECTIVE, M>(entry, &columns, &rows, [x, y]);
                    } else {
                        self.whole::<L, PERSPECTIVE, M>(entry, &columns, &rows, [x, y]);
                    }
                }
                self.freshen::<L, PERSPECTIVE>(&columns, &rows);
            }
        }
        self.sums
    }

    /// Brings the farthest depth of the blocks up to date.
    #[inline(always)]
    fn freshen<L: Lanes, const PERSPECTIVE: bool>(&mut self, columns: &[f64; SIDE], rows: &[f64; SIDE]) {
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
    fn whole<L: Lanes, const PERSPECTIVE: bool, M: Mode>(
        &mut self,
        entry: &Entry,
        columns: &[f64; SIDE],
        rows: &[f64; SIDE],
        corner: [usize; 2],
    ) {
        let s = &entry.sphere;
        let margins =
            if M::BOUNDS { Margins::new::<PERSPECTIVE>(s, self.painter.binner.projector.screen) } else { PLAIN };
        let Margins { doubt, solid, width, rim } = margins;
        let vague = solid == f64::INFINITY;
        if !vague {
            self.state.widen(2.0 * width);
        }
        // How far before `b` what must be nearer than the holder begins, less its square root.
        let before = if vague { 0.0 } else { 1.1 * width };
        let id = f64::from(entry.index);
        // A holder that turned out to be the same sphere.
        let mut twin = f64::NAN;
        let [left, right, top, bottom] = entry.window.map(usize::from);
        let zero = L::splat(0.0);
        for row in top..=bottom {
            let line = Row::new::<PERSPECTIVE>(s, rows[row]);
            for first in (left / LANES * LANES..=right).step_by(LANES) {
                let at = row * SIDE + first;
                let sx = L::load(&columns[first..]);
                let high = L::load(&self.state.high[at..]);
                let (q, b) = line.meet::<L, PERSPECTIVE>(sx);
                // Behind what is held for certain: `b - sqrt q - W > high`, or squared, `q < (b - W - high)^2`, which needs no root.
                // For hits that are not solid, `rim` stands for root and `W`. The tenth added to `W` covers the roundings of
                // the difference and the square, 1.5 u of the depth: see [`crate::filter`] for what `W` is at least.
                let ahead = b.sub(L::splat(before)).sub(high).max(zero);
                let lose = q.less(L::splat(-doubt)) | L::splat(rim * rim).max(q).less(ahead.mul(ahead));
                if lose == u8::MAX {
                    continue;
                }
                let root = q.max(zero).sqrt();
                // What is NaN is in doubt.
                let sure = L::splat(solid).less(q);
                let depth = b.sub(root);
                let most = depth.add(L::splat(width));
                let win = sure & most.less(high.sub(L::splat(self.state.slack)));
                if win != 0 {
                    L::select(win, most, high).store(&mut self.state.high[at..]);
                    let ids = L::load(&self.state.id[at..]);
                    L::select(win, L::splat(id), ids).store(&mut self.state.id[at..]);
                    self.touch(row, first);
                }
                let mut undecided = !(win | lose);
                if !M::BOUNDS || undecided == 0 {
                    continue;
                }
                let (mut leasts, mut mosts) = ([0.0; LANES], [0.0; LANES]);
                depth.sub(L::splat(width)).store(&mut leasts);
                most.store(&mut mosts);
                while undecided != 0 {
                    let k = undecided.trailing_zeros() as usize;
                    undecided &= undecided - 1;
                    let at = at + k;
                    if self.state.id[at] == twin {
                        // Known to be the same sphere, under another index.
                        self.state.id[at] = twin.min(id);
                        continue;
                    }
                    if !M::DECIDES {
                        self.leave_open(
                            entry,
                            at,
                            leasts[k],
                            if sure >> k & 1 == 1 { mosts[k] } else { f64::INFINITY },
                        );
                        continue;
                    }
                    let depth = (sure >> k & 1 == 1).then_some([leasts[k], mosts[k]]);
                    twin = self.settle::<PERSPECTIVE>(entry, at, corner, depth).unwrap_or(twin);
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
                        self.state.id[at] = f64::from(entry.index);
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
        state.id[at] = OPEN + if holder == NONE { f64::from(entry.index) } else { holder % OPEN };
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
    ) -> Option<f64> {
        let Painter { scene, truth, binner, .. } = *self.painter;
        let region = binner.projector.region;
        let (column, row) = ((x + at % SIDE) as u32, (y + at / SIDE) as u32);
        if column >= region.width || row >= region.height {
            return None;
        }
        let index = f64::from(entry.index);
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
            if order.then(index.total_cmp(&holder)).is_gt() {
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
