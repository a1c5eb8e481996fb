//! The pixels that the device's filter left over: decided on the host among the spheres of their
//! tiles.
//!
//! As the native device draws, see [`planisphere_core::tile`]: so lists may come in any order and
//! in any number of waves.

use std::{
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicUsize, Ordering},
    },
    time::{Duration, Instant},
};

use glam::DVec3;
use rayon::prelude::*;

use super::{
    execute::Pixels,
    lists::{Spheres, Wave},
};
use crate::plan::TILE;
use planisphere_core::{
    camera::Region,
    drawing::Control,
    exact::decide::Tally,
    ids::{NONE, SortedIndex, SphereIndex, TileIndex},
    project::Projector,
    projected::Projected,
    scene::Ball,
    simd::{LANES, Lanes},
    tile::{self, Exact, Place, Tile},
};

const SIDE: usize = TILE as usize;

/// So many tiles a thread decides at a time, at most.
const MANY: usize = 32;

/// So many spheres of a list are asked for before its turn comes.
const SOON: usize = 2 * LANES;

/// So many spheres of a list are remembered, to know their duplicates.
const SEEN: usize = 2 * LANES;
// `Seen::repeats` looks at whole vectors.
const _: () = assert!(SEEN.is_multiple_of(LANES));

/// What decides: the spheres, and the lists of a wave.
#[derive(Clone, Copy)]
pub struct Among<'a> {
    /// The spheres.
    pub spheres: Spheres<'a>,
    /// Their projection in the region.
    pub projector: &'a Projector,
    /// The lists.
    pub wave: &'a Wave,
    /// What is decided after this is cancelled may be anything.
    pub control: &'a Control,
}

/// Tiles of a row of tiles, and the ids of all its pixels.
type RowOfTiles<'a> = (&'a [(TileIndex, Pixels)], &'a mut [i32]);

/// The undecided pixels of a band whose lists came in one batch. A pixel that no listed sphere
/// covers shows its tile's entry of `backgrounds`.
#[derive(Clone, Copy)]
pub struct LeftOver<'a> {
    /// What decides.
    pub among: Among<'a>,
    /// Tiles in a row of the band.
    pub columns: u32,
    /// By tile of the band.
    pub backgrounds: &'a [i32],
}

impl LeftOver<'_> {
    /// Decides some tiles, given in ascending order, on all threads.
    pub fn decide(&self, tiles: &[(TileIndex, Pixels)], ids: &mut [i32]) -> Tally {
        let mut rows = self.rows(tiles, 0, ids);
        let part = (tiles.len() / rayon::current_num_threads()).clamp(1, MANY);
        let part = (part * rows.len()).div_ceil(tiles.len().max(1)).max(1);
        rows.par_chunks_mut(part).map(|rows| self.decide_rows(rows)).reduce(Tally::default, add)
    }

    /// Splits the ids of some rows of tiles.
    fn rows<'a>(
        &self,
        tiles: &'a [(TileIndex, Pixels)],
        first_row: u32,
        ids: &'a mut [i32],
    ) -> Vec<RowOfTiles<'a>> {
        let all = self.among.projector.region.width as usize * SIDE;
        let mut rows_of_ids = ids.chunks_mut(all).zip(first_row..);
        let row_of = |tile: TileIndex| tile.0 / self.columns;
        let of_row = |tiles: &'a [(TileIndex, Pixels)]| {
            let (ids, _) = rows_of_ids.find(|&(_, row)| row == row_of(tiles[0].0))?;
            Some((tiles, ids))
        };
        tiles.chunk_by(|a, b| row_of(a.0) == row_of(b.0)).filter_map(of_row).collect()
    }

    fn decide_rows(&self, rows: &mut [RowOfTiles<'_>]) -> Tally {
        let Self { among, columns, backgrounds } = *self;
        let mut tally = Tally::default();
        let (mut open, mut desk) = (Open::default(), Desk::new());
        // Prefetch for all tiles together, so that the waits for memory overlap: first the lists,
        // then the first spheres that each names.
        let tiles = || rows.iter().flat_map(|row| row.0).map(|tile| tile.0);
        tiles().for_each(|tile| among.wave.prefetch(tile));
        tiles()
            .flat_map(|tile| among.wave.tile(tile).iter().take(SOON))
            .for_each(|&place| among.spheres.prefetch(place));
        for (tiles, ids) in rows {
            if among.control.is_cancelled() {
                break;
            }
            for &(tile, pixels) in *tiles {
                open.begin(tile, columns, pixels);
                tally += open.look(among, &mut desk);
                open.write(among.projector.region, backgrounds[tile.at()], ids);
            }
        }
        tally
    }
}

/// Resolves undecided pixels while ids are copied into the picture: each thread those of the few
/// tiles that it has just copied, so that no thread waits for another.
pub struct AtOnce<'a> {
    left_over: LeftOver<'a>,
    /// The most undecided pixels that are resolved here. If a band has more, the CPU draws all of
    /// it.
    most: usize,
    seen: AtomicUsize,
    done: Mutex<Done>,
}

/// What was decided at once.
#[derive(Clone, Copy, Default)]
pub struct Done {
    /// How.
    pub tally: Tally,
    /// How many pixels.
    pub pixels: usize,
    /// Time of all threads together.
    pub spent: Duration,
}

impl<'a> AtOnce<'a> {
    /// Nothing yet.
    pub fn new(left_over: LeftOver<'a>, most: usize) -> Self {
        Self { left_over, most, seen: AtomicUsize::new(0), done: Mutex::default() }
    }

    /// Resolves the undecided pixels of some rows of tiles on this thread. `tiles` are in ascending
    /// order; `ids` are all pixels of these rows, the first of which is `first_row`. Returns false,
    /// and does nothing, if there are more than [`MANY`] tiles or too many pixels: the caller
    /// leaves them for later.
    pub fn decide(&self, tiles: &[(TileIndex, Pixels)], first_row: u32, ids: &mut [i32]) -> bool {
        let pixels = count(tiles);
        if self.seen.fetch_add(pixels, Ordering::Relaxed) + pixels > self.most || tiles.len() > MANY
        {
            return false;
        }
        let begin = Instant::now();
        let tally = self.left_over.decide_rows(&mut self.left_over.rows(tiles, first_row, ids));
        let mut done = self.done.lock().unwrap_or_else(PoisonError::into_inner);
        done.tally += tally;
        done.pixels += pixels;
        done.spent += begin.elapsed();
        true
    }

    /// What was decided.
    pub fn done(&self) -> Done {
        *self.done.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// How many pixels are open.
pub fn count(tiles: &[(TileIndex, Pixels)]) -> usize {
    tiles.iter().map(|tile| tile.1.count_ones() as usize).sum()
}

fn add(mut a: Tally, b: Tally) -> Tally {
    a += b;
    a
}

/// The pixels to decide when lists come in waves.
pub struct Undecided {
    tiles: Vec<Open>,
}

impl Undecided {
    /// Those of some tiles of a region whose tiles come `columns` to a row.
    pub fn new(tiles: &[(TileIndex, Pixels)], columns: u32) -> Self {
        let open = |&(tile, pixels): &(TileIndex, Pixels)| {
            let mut open = Open::default();
            open.begin(tile, columns, pixels);
            open
        };
        Self { tiles: tiles.par_iter().map(open).collect() }
    }

    /// Which tiles have any.
    pub fn mask(&self, tiles: usize) -> Vec<bool> {
        let mut mask = vec![false; tiles];
        self.tiles.iter().for_each(|open| mask[open.tile.at()] = true);
        mask
    }

    /// Looks at the spheres of a wave.
    pub fn look(&mut self, among: Among<'_>) -> Tally {
        self.tiles
            .par_iter_mut()
            .map_init(Desk::new, |desk, open| open.look(among, desk))
            .reduce(Tally::default, add)
    }

    /// Writes what was decided.
    pub fn write(&self, ids: &mut [i32], region: Region) {
        let row = region.width as usize * SIDE;
        for open in &self.tiles {
            let first = open.corner[1] as usize * region.width as usize;
            let last = ids.len().min(first + row);
            open.write(region, NONE, &mut ids[first..last]);
        }
    }
}

/// Column and row of some pixels of a tile.
fn places(mut pixels: Pixels) -> impl Iterator<Item = [usize; 2]> {
    std::iter::from_fn(move || {
        let at = (pixels != 0).then(|| pixels.trailing_zeros() as usize)?;
        pixels &= pixels - 1;
        Some([at / SIDE, at % SIDE])
    })
}

/// The open pixels of a tile.
struct Open {
    tile: TileIndex,
    /// First column and row, in the region.
    corner: [u32; 2],
    /// Which are open.
    pixels: Pixels,
    /// Columns and rows with open pixels, a bit for each.
    window: [u8; 2],
    state: Tile<SIDE>,
    /// Nothing that begins farther is seen; view lengths.
    farthest: f64,
}

impl Default for Open {
    fn default() -> Self {
        Self {
            tile: TileIndex::default(),
            corner: [0; 2],
            pixels: 0,
            window: [0; 2],
            state: Tile::default(),
            farthest: f64::INFINITY,
        }
    }
}

impl Open {
    /// Starts with some pixels of a tile.
    fn begin(&mut self, tile: TileIndex, columns: u32, pixels: Pixels) {
        (self.tile, self.corner) = (tile, [tile.0 % columns * TILE, tile.0 / columns * TILE]);
        (self.pixels, self.window, self.farthest) = (pixels, [0; 2], f64::INFINITY);
        self.state.clear(0, 0);
        for [column, row] in places(pixels) {
            self.window[0] |= 1 << column;
            self.window[1] |= 1 << row;
            self.state.open(column, row);
        }
    }

    /// Writes what was decided, and `background` where nothing is met; `ids` are of the tile's row
    /// of tiles.
    fn write(&self, region: Region, background: i32, ids: &mut [i32]) {
        for [column, row] in places(self.pixels) {
            let id = self.state.ids(row)[column];
            if id >= NONE {
                let at = row * region.width as usize + self.corner[0] as usize + column;
                ids[at] = if id == NONE { background } else { id };
            }
        }
    }

    /// Looks at the tile's list in a wave.
    fn look(&mut self, among: Among<'_>, desk: &mut Desk) -> Tally {
        tile::dispatch(among.projector.projection, Paint { among, open: self, desk });
        self.state.take_tally()
    }
}

/// Spheres of a list.
struct Batch {
    ball: [Ball; LANES],
    x: [f64; LANES],
    y: [f64; LANES],
    z: [f64; LANES],
    r: [f64; LANES],
    /// Nothing of the sphere is nearer.
    nearest: [f64; LANES],
    /// No later sphere of the list begins nearer than this less the disorder.
    begin: [f64; LANES],
    /// Which a plane may cut, a bit for each.
    cut: u8,
}

impl Batch {
    /// Nothing yet.
    fn new() -> Self {
        let (ball, zeros) = ([Ball { center: DVec3::ZERO, radius: 0.0 }; LANES], [0.0; LANES]);
        Self { ball, x: zeros, y: zeros, z: zeros, r: zeros, nearest: zeros, begin: zeros, cut: 0 }
    }

    /// Takes what lies at some places. Returns a bit for each.
    #[inline(always)]
    fn take(&mut self, places: &[SortedIndex], spheres: Spheres<'_>, projector: &Projector) -> u8 {
        for (k, &place) in places.iter().enumerate() {
            let ball = spheres.ball(place);
            self.ball[k] = ball;
            (self.x[k], self.y[k], self.z[k]) = ball.center.into();
            self.r[k] = ball.radius * projector.scale;
        }
        projector.turn([&mut self.x, &mut self.y, &mut self.z]);
        self.cut = 0;
        for k in 0..LANES {
            let sphere = self.sphere(k);
            self.nearest[k] = sphere.nearest();
            self.begin[k] = self.nearest[k] - sphere.bound();
            self.cut |= u8::from(projector.cuts(&sphere)) << k;
        }
        0xff >> (LANES - places.len())
    }

    #[inline(always)]
    fn sphere(&self, k: usize) -> Projected {
        Projected { x: self.x[k], y: self.y[k], z: self.z[k], r: self.r[k] }
    }

    #[inline(always)]
    fn lanes<L: Lanes>(&self) -> [L; 4] {
        [&self.x, &self.y, &self.z, &self.r].map(|values| L::load(values))
    }
}

/// What is at hand while a tile's list is looked at.
struct Desk {
    batch: Batch,
    seen: Seen,
}

impl Desk {
    fn new() -> Self {
        let batch = Batch::new();
        let seen = Seen {
            depths: [f64::INFINITY; SEEN],
            indices: [SphereIndex(u32::MAX); SEEN],
            balls: [batch.ball[0]; SEEN],
            count: 0,
        };
        Self { batch, seen }
    }
}

/// The last spheres that were drawn: a later one that is the same is nowhere seen.
struct Seen {
    /// Of their centres.
    depths: [f64; SEEN],
    indices: [SphereIndex; SEEN],
    balls: [Ball; SEEN],
    /// Where the next is kept.
    count: usize,
}

impl Seen {
    #[inline(always)]
    fn clear(&mut self) {
        self.depths.fill(f64::INFINITY);
        self.indices.fill(SphereIndex(u32::MAX));
        self.count = 0;
    }

    /// Whether a sphere is the same as one before it in the scene; if not it is kept.
    #[inline(always)]
    fn repeats<L: Lanes>(&mut self, index: SphereIndex, ball: Ball, depth: f64) -> bool {
        let Self { depths, indices, balls, count } = self;
        let z = L::splat(depth);
        let mut again = false;
        for first in (0..SEEN).step_by(LANES) {
            let depths = L::load(&depths[first..]);
            let mut same = !(depths.less(z) | z.less(depths));
            while same != 0 {
                let earlier = first + same.trailing_zeros() as usize;
                same &= same - 1;
                again |= indices[earlier] < index && balls[earlier] == ball;
            }
        }
        if !again {
            (depths[*count], indices[*count], balls[*count]) = (depth, index, ball);
            *count = (*count + 1) % SEEN;
        }
        again
    }
}

/// Which of some numbers is least, of those whose bit is set; NaN is not.
#[inline(always)]
fn least(values: &[f64; LANES], mut bits: u8) -> usize {
    let mut least = bits.trailing_zeros() as usize;
    while bits != 0 {
        let k = bits.trailing_zeros() as usize;
        bits &= bits - 1;
        least = if values[k] < values[least] { k } else { least };
    }
    least
}

/// Bits `first ..= last` of a row of a tile that begins at `from`; what is NaN reaches the tile's
/// side.
#[inline(always)]
fn window([first, last]: [f64; 2], from: f64) -> u8 {
    const LAST: f64 = (SIDE - 1) as f64;
    let (first, last) = (first.ceil() - from, last.floor() - from);
    let first = if first > 0.0 { first } else { 0.0 };
    let last = if last < LAST { last } else { LAST };
    // Beyond the tile's sides a shift is out of range.
    if first > LAST || last < 0.0 {
        0
    } else {
        (0xff << first as u32) & (0xff >> (7 - last as u32))
    }
}

/// The rows of a tile with open pixels that a sphere may be seen in, a bit for each; `open` are
/// columns and rows with open pixels.
#[inline(always)]
fn rows_seen<const PERSPECTIVE: bool>(
    projector: &Projector,
    sphere: &Projected,
    [x, y]: [usize; 2],
    [open_columns, open_rows]: [u8; 2],
) -> u8 {
    // With one open row, testing it is cheaper than finding out that the sphere misses it.
    if open_rows.is_power_of_two() {
        return open_rows;
    }
    let [across, down] = projector.extent::<PERSPECTIVE>(sphere);
    let rows = open_rows & window(down, y as f64);
    if window(across, x as f64) & open_columns == 0 { 0 } else { rows }
}

struct Paint<'a> {
    among: Among<'a>,
    open: &'a mut Open,
    desk: &'a mut Desk,
}

impl tile::Work for Paint<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes, const PERSPECTIVE: bool>(self) {
        let Among { spheres, projector, wave, control } = self.among;
        let Spheres { scene, truth, .. } = spheres;
        let Open { tile, corner, pixels, window: open, ref mut state, ref mut farthest } =
            *self.open;
        let [x, y] = corner.map(|at| at as usize);
        let place = Place::new(scene, truth, projector, [x, y]).until(control);
        state.begin::<Exact>(&place);
        let disorder = wave.lists().disorder * truth.scale() * (1.0 + 4.0 * f64::EPSILON);
        // Most tiles have one open pixel: then spheres are looked at there eight at a time, and
        // drawn from the front if they may be seen.
        let single = pixels.is_power_of_two().then(|| places(pixels).next()).flatten();
        let Desk { batch, seen } = self.desk;
        seen.clear();
        let list = wave.tile(tile);
        for (turn, places) in list.chunks(LANES).enumerate() {
            if control.is_cancelled() {
                return;
            }
            // While these are looked at, the next come.
            list.iter()
                .skip(turn * LANES + SOON)
                .take(LANES)
                .for_each(|&place| spheres.prefetch(place));
            let all = batch.take(places, spheres, projector);
            let mut fronts = batch.nearest;
            if let Some(at) = single {
                Tile::front::<L, PERSPECTIVE>(&place, batch.lanes(), batch.cut, at)
                    .store(&mut fronts);
            }
            let mut left = all;
            loop {
                // Drop spheres that begin behind the farthest depth held; if one pixel is open,
                // also those that begin behind its depth or miss its ray.
                left &= !L::splat(*farthest).less(L::load(&batch.nearest));
                if let Some(at) = single {
                    left &= !L::splat(state.high(at)).less(L::load(&fronts));
                }
                if left == 0 {
                    break;
                }
                let k = if single.is_some() {
                    least(&fronts, left)
                } else {
                    left.trailing_zeros() as usize
                };
                left &= !(1 << k);
                let sphere = batch.sphere(k);
                let rows_seen = rows_seen::<PERSPECTIVE>(projector, &sphere, [x, y], open);
                if rows_seen == 0 {
                    continue;
                }
                let (index, ball) = (spheres.index(places[k]), batch.ball[k]);
                if seen.repeats::<L>(index, ball, sphere.z) {
                    continue;
                }
                let (cut, rows) =
                    (batch.cut >> k & 1 == 1, (0..SIDE).filter(|row| rows_seen >> row & 1 == 1));
                state.draw::<L, PERSPECTIVE, Exact>(
                    &place,
                    index,
                    &sphere,
                    cut,
                    [0, SIDE - 1],
                    rows,
                );
                if let Some(at) = single {
                    *farthest = state.farthest::<L, PERSPECTIVE>(&place, at);
                } else if let Some((_, depth)) = state.freshen::<L, PERSPECTIVE>(&place) {
                    *farthest = depth;
                }
            }
            // Early stop. Lists are sorted but for `disorder`: a later sphere begins at most that
            // much nearer than any of these. `begin` allows for the roundings of both.
            if all & L::splat(*farthest).less(L::load(&batch.begin).sub(L::splat(disorder))) != 0 {
                return;
            }
        }
    }
}
