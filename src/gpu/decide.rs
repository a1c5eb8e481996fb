//! The pixels that the device's filter left over: decided on the host among the spheres of their tiles.
//!
//! First by f64 with the bounds of the native device ([`crate::filter`]), and where those do not tell, exactly. As there, the holder of a
//! pixel is exact at all times, so lists may come in any order and in any number of waves.

use glam::DVec3;
use rayon::prelude::*;

use super::lists::{Spheres, Wave};
use crate::{
    camera::{Projection, Region},
    exact::decide::{Ball, Hit, Root, Tally},
    filter::{BACK, Look, Margins, Row, length},
    plan::{NONE, TILE, TILE_PIXELS, UNDECIDED},
    project::{Projected, Projector},
    simd::{self, LANES, Lanes},
};

const SIDE: usize = TILE as usize;
const _: () = assert!(SIDE == LANES, "a row of a tile is one vector");

/// Below this many tiles, waking other threads costs more than it saves.
const FEW: usize = 256;

/// So many spheres of a list are remembered, to know their duplicates.
const SEEN: usize = 2 * LANES;

/// What decides: the spheres, and the lists of a wave.
#[derive(Clone, Copy)]
pub struct Among<'a> {
    /// The spheres.
    pub spheres: Spheres<'a>,
    /// Their projection in the region.
    pub projector: &'a Projector,
    /// The lists.
    pub wave: &'a Wave,
}

/// Decides all that is left over in some tiles of a region, given in ascending order and `columns` to a row, when the lists are whole.
/// Returns the number of pixels too.
pub fn decide(among: Among<'_>, tiles: &[u32], columns: u32, ids: &mut [i32]) -> (usize, Tally) {
    let region = among.projector.region;
    let row_of_tiles = |(tiles, ids): (&[u32], &mut [i32])| {
        let (mut pixels, mut tally) = (0, Tally::default());
        let mut open = Open::default();
        for &tile in tiles {
            open.find(tile, columns, region, ids);
            pixels += open.pixels();
            tally += open.look(among);
            open.write(region, ids);
        }
        (pixels, tally)
    };
    let sum = |a: (usize, Tally), b: (usize, Tally)| {
        let mut tally = a.1;
        tally += b.1;
        (a.0 + b.0, tally)
    };
    let mut rows = Vec::new();
    let mut rest = ids;
    let mut first = 0;
    for tiles in tiles.chunk_by(|a, b| a / columns == b / columns) {
        let row = tiles[0] / columns;
        let below = rest.split_off_mut(..(row - first) as usize * SIDE * region.width as usize);
        debug_assert!(below.is_some());
        let height = SIDE.min((region.height - row * TILE) as usize);
        if let Some(ids) = rest.split_off_mut(..height * region.width as usize) {
            rows.push((tiles, ids));
        }
        first = row + 1;
    }
    if tiles.len() < FEW {
        rows.into_iter().map(row_of_tiles).fold(Default::default(), sum)
    } else {
        rows.into_par_iter().map(row_of_tiles).reduce(Default::default, sum)
    }
}

/// The pixels to decide when lists come in waves.
pub struct Undecided {
    tiles: Vec<Open>,
    /// How many pixels.
    pub pixels: usize,
}

impl Undecided {
    /// Gathers them from some tiles of a region whose tiles come `columns` to a row.
    pub fn find(tiles: &[u32], ids: &[i32], region: Region, columns: u32) -> Self {
        let row = region.width as usize * SIDE;
        let open = |&tile: &u32| {
            let first = (tile / columns) as usize * row;
            let mut open = Open::default();
            open.find(tile, columns, region, &ids[first..ids.len().min(first + row)]);
            open
        };
        let tiles: Vec<Open> = tiles.par_iter().map(open).collect();
        let pixels = tiles.iter().map(Open::pixels).sum();
        Self { tiles, pixels }
    }

    /// Which tiles have any.
    pub fn mask(&self, tiles: usize) -> Vec<bool> {
        let mut mask = vec![false; tiles];
        self.tiles.iter().for_each(|open| mask[open.tile as usize] = true);
        mask
    }

    /// Looks at the spheres of a wave.
    pub fn look(&mut self, among: Among<'_>) -> Tally {
        self.tiles.par_iter_mut().map(|open| open.look(among)).reduce(Tally::default, |mut a, b| {
            a += b;
            a
        })
    }

    /// Writes what was decided.
    pub fn write(&self, ids: &mut [i32], region: Region) {
        let row = region.width as usize * SIDE;
        for open in &self.tiles {
            let first = open.corner[1] as usize * region.width as usize;
            let last = ids.len().min(first + row);
            open.write(region, &mut ids[first..last]);
        }
    }
}

/// The open pixels of a tile.
struct Open {
    tile: u32,
    /// First column and row, in the region.
    corner: [u32; 2],
    /// Of each row, its open pixels.
    rows: [u8; SIDE],
    /// Upper bound of the depth of the nearest sphere so far, times |dir|^2, in view lengths; negative infinite where nothing is open.
    high: [f64; TILE_PIXELS],
    /// Its index, or [`NONE`].
    id: [f64; TILE_PIXELS],
    /// No depth is less than its upper bound by more than this.
    slack: f64,
    /// Nothing that begins farther is seen; view lengths.
    farthest: f64,
}

impl Default for Open {
    fn default() -> Self {
        Self {
            tile: 0,
            corner: [0; 2],
            rows: [0; SIDE],
            high: [f64::NEG_INFINITY; TILE_PIXELS],
            id: [f64::from(NONE); TILE_PIXELS],
            slack: 0.0,
            farthest: f64::INFINITY,
        }
    }
}

impl Open {
    /// Starts with a tile; `ids` are of its row of tiles.
    fn find(&mut self, tile: u32, columns: u32, region: Region, ids: &[i32]) {
        (self.tile, self.corner) = (tile, [tile % columns * TILE, tile / columns * TILE]);
        (self.rows, self.slack, self.farthest) = ([0; SIDE], 0.0, f64::INFINITY);
        self.high.fill(f64::NEG_INFINITY);
        self.id.fill(f64::from(NONE));
        for (row, ids) in ids.chunks(region.width as usize).enumerate() {
            for (column, &id) in ids[self.corner[0] as usize..].iter().take(SIDE).enumerate() {
                if id == UNDECIDED {
                    self.rows[row] |= 1 << column;
                    self.high[row * SIDE + column] = f64::INFINITY;
                }
            }
        }
    }

    fn pixels(&self) -> usize {
        u64::from_ne_bytes(self.rows).count_ones() as usize
    }

    /// Writes what was decided; `ids` are of the tile's row of tiles.
    fn write(&self, region: Region, ids: &mut [i32]) {
        for (row, ids) in ids.chunks_mut(region.width as usize).enumerate() {
            for (column, to) in ids[self.corner[0] as usize..].iter_mut().take(SIDE).enumerate() {
                if self.rows[row] >> column & 1 == 1 {
                    *to = self.id[row * SIDE + column] as i32;
                }
            }
        }
    }

    /// Looks at the tile's list in a wave.
    fn look(&mut self, among: Among<'_>) -> Tally {
        let work = Paint { among, open: self, tally: Tally::default() };
        match among.projector.projection {
            Projection::Orthographic => simd::dispatch(Ortho(work)),
            Projection::Perspective => simd::dispatch(Persp(work)),
        }
    }

    /// As the native device, see `Tile::widen` there.
    #[inline(always)]
    fn widen(&mut self, width: f64) {
        self.slack = self.slack.max(1.05 * width);
    }

    /// The depth of a pixel's holder lies between these.
    #[inline(always)]
    fn hold(&mut self, at: usize, low: f64, high: f64) {
        self.widen(high - low + high.abs() * (8.0 * f64::EPSILON));
        self.high[at] = high;
    }
}

struct Ortho<'a>(Paint<'a>);

impl simd::Work for Ortho<'_> {
    type Output = Tally;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Tally {
        self.0.run::<L, false>()
    }
}

struct Persp<'a>(Paint<'a>);

impl simd::Work for Persp<'_> {
    type Output = Tally;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Tally {
        self.0.run::<L, true>()
    }
}

/// Spheres that may be nearest.
struct Batch {
    index: [u32; LANES],
    ball: [Ball; LANES],
    sphere: [Projected; LANES],
    /// Nothing of the sphere is nearer.
    nearest: [f64; LANES],
    /// Columns and rows of the tile in which it may be seen.
    window: [[u8; 2]; LANES],
}

/// One of them.
struct Candidate {
    index: u32,
    ball: Ball,
    sphere: Projected,
    /// Rows of the tile in which it may be seen.
    rows: u8,
    margins: Margins,
}

/// Bits `first ..= last` of a row of a tile that begins at `from`; what is NaN reaches the tile's side.
#[inline(always)]
fn window([first, last]: [f64; 2], from: f64) -> u8 {
    const LAST: f64 = (SIDE - 1) as f64;
    let (first, last) = (first.ceil() - from, last.floor() - from);
    let first = if first > 0.0 { first } else { 0.0 };
    let last = if last < LAST { last } else { LAST };
    // Beyond the tile's sides a shift is out of range.
    if first > LAST || last < 0.0 { 0 } else { (0xff << first as u32) & (0xff >> (7 - last as u32)) }
}

struct Paint<'a> {
    among: Among<'a>,
    open: &'a mut Open,
    tally: Tally,
}

impl Paint<'_> {
    #[inline(always)]
    fn run<L: Lanes, const PERSPECTIVE: bool>(mut self) -> Tally {
        let Among { spheres: Spheres { scene, truth, order }, projector, wave } = self.among;
        let [x, y] = self.open.corner.map(|c| c as usize);
        let columns = L::load(&projector.columns[x..]);
        let rows: [f64; SIDE] = std::array::from_fn(|k| projector.rows[y + k]);
        // Screens so wide that |dir|^2 overflows have no depths to go by.
        let usable = projector.screen.kappa < 1e70;
        let disorder = wave.lists().disorder * truth.scale() * (1.0 + 4.0 * f64::EPSILON);
        let open_rows = (0..SIDE).fold(0, |bits, row| bits | u8::from(self.open.rows[row] != 0) << row);
        let open_columns = self.open.rows.into_iter().fold(0, |bits, row| bits | row);
        let zero = Ball { center: DVec3::ZERO, radius: 0.0 };
        let mut batch = Batch {
            index: [0; LANES],
            ball: [zero; LANES],
            sphere: [Projected::default(); LANES],
            nearest: [0.0; LANES],
            window: [[0; 2]; LANES],
        };
        // The last spheres that were looked at: a later one that is the same is nowhere seen.
        let mut depths = [f64::INFINITY; SEEN];
        let mut seen = [(u32::MAX, zero); SEEN];
        let mut count = 0;
        for places in wave.tile(self.open.tile as usize).chunks(LANES) {
            for (k, &place) in places.iter().enumerate() {
                batch.index[k] = order.index(place);
                let (block, at) = scene.locate(batch.index[k] as usize);
                batch.ball[k] = Ball { center: block.center(at), radius: block.radius(at) };
            }
            for k in 0..LANES {
                let s = projector.project(batch.ball[k].center, batch.ball[k].radius);
                let [across, down] = projector.extent::<PERSPECTIVE>(&s);
                batch.sphere[k] = s;
                batch.nearest[k] = s.nearest();
                batch.window[k] = [window(across, x as f64), window(down, y as f64)];
            }
            for k in 0..places.len() {
                let (sphere, nearest, [across, down]) = (batch.sphere[k], batch.nearest[k], batch.window[k]);
                if nearest > self.open.farthest {
                    // No later sphere begins nearer than this by more than the disorder, and the roundings of both places.
                    if nearest - sphere.bound() - disorder > self.open.farthest {
                        return self.tally;
                    }
                    continue;
                }
                let rows_seen = down & open_rows;
                if rows_seen == 0 || across & open_columns == 0 {
                    continue;
                }
                let (index, ball, z) = (batch.index[k], batch.ball[k], L::splat(sphere.z));
                let mut again = false;
                for first in (0..SEEN).step_by(LANES) {
                    let depths = L::load(&depths[first..]);
                    let mut same = !(depths.less(z) | z.less(depths));
                    while same != 0 {
                        let (earlier, other) = seen[first + same.trailing_zeros() as usize];
                        same &= same - 1;
                        again |= earlier < index && other == ball;
                    }
                }
                if again {
                    continue;
                }
                (depths[count % SEEN], seen[count % SEEN]) = (sphere.z, (index, ball));
                count += 1;
                let margins = Margins::new::<PERSPECTIVE>(&sphere, projector.screen);
                let candidate = Candidate { index, ball, sphere, rows: rows_seen, margins };
                let nearer = match projector.cuts(&sphere) {
                    false => self.whole::<L, PERSPECTIVE>(&candidate, columns, &rows),
                    true => self.clipped::<PERSPECTIVE>(&candidate, &projector.columns[x..], &rows),
                };
                if nearer && usable {
                    self.freshen::<L, PERSPECTIVE>(columns, &rows);
                }
            }
        }
        self.tally
    }

    /// Brings the farthest depth up to date.
    #[inline(always)]
    fn freshen<L: Lanes, const PERSPECTIVE: bool>(&mut self, columns: L, rows: &[f64; SIDE]) {
        let mut farthest = L::splat(f64::NEG_INFINITY);
        for row in 0..SIDE {
            let high = L::load(&self.open.high[row * SIDE..]);
            let depth = if PERSPECTIVE {
                // From t a back to t.
                let depth = high.div(length(columns, rows[row]));
                depth.add(depth.max(L::splat(0.0).sub(depth)).mul(L::splat(BACK)))
            } else {
                high
            };
            // What is NaN lies outside the region.
            farthest = depth.max(farthest);
        }
        self.open.farthest = farthest.greatest();
    }

    /// A sphere that no plane can cut, as `PaintTile::whole` of the native device. Returns whether some pixel's depth has become less.
    #[inline(always)]
    fn whole<L: Lanes, const PERSPECTIVE: bool>(&mut self, c: &Candidate, columns: L, rows: &[f64; SIDE]) -> bool {
        let Margins { doubt, solid, width, rim } = c.margins;
        let vague = solid == f64::INFINITY;
        if !vague {
            self.open.widen(2.0 * width);
        }
        let before = if vague { 0.0 } else { 1.1 * width };
        let id = f64::from(c.index);
        // A holder that turned out to be the same sphere.
        let mut twin = f64::NAN;
        let mut nearer = false;
        let zero = L::splat(0.0);
        let mut left = c.rows;
        while left != 0 {
            let row = left.trailing_zeros() as usize;
            left &= left - 1;
            let (open, at) = (self.open.rows[row], row * SIDE);
            let (q, b) = Row::new::<PERSPECTIVE>(&c.sphere, rows[row]).meet::<L, PERSPECTIVE>(columns);
            let high = L::load(&self.open.high[at..]);
            let ahead = b.sub(L::splat(before)).sub(high).max(zero);
            let lose = q.less(L::splat(-doubt)) | L::splat(rim * rim).max(q).less(ahead.mul(ahead)) | !open;
            if lose == u8::MAX {
                continue;
            }
            // What is NaN is in doubt.
            let sure = L::splat(solid).less(q) & open;
            let depth = b.sub(q.max(zero).sqrt());
            let most = depth.add(L::splat(width));
            let win = sure & most.less(high.sub(L::splat(self.open.slack)));
            if win != 0 {
                L::select(win, most, high).store(&mut self.open.high[at..]);
                let ids = L::load(&self.open.id[at..]);
                L::select(win, L::splat(id), ids).store(&mut self.open.id[at..]);
                nearer = true;
            }
            let mut undecided = !(win | lose);
            if undecided == 0 {
                continue;
            }
            let (mut leasts, mut mosts) = ([0.0; LANES], [0.0; LANES]);
            depth.sub(L::splat(width)).store(&mut leasts);
            most.store(&mut mosts);
            while undecided != 0 {
                let k = undecided.trailing_zeros() as usize;
                undecided &= undecided - 1;
                if self.open.id[at + k] == twin {
                    // Known to be the same sphere, under another index.
                    self.open.id[at + k] = twin.min(id);
                    continue;
                }
                let depth = (sure >> k & 1 == 1).then_some([leasts[k], mosts[k]]);
                match self.settle(c, at + k, depth) {
                    Settled::Kept => {}
                    Settled::Taken => nearer = true,
                    Settled::Twin(holder) => twin = holder,
                }
            }
        }
        nearer
    }

    /// A sphere that a plane may cut: either root, pixel by pixel. Returns whether some pixel's depth has become less.
    #[inline(always)]
    fn clipped<const PERSPECTIVE: bool>(&mut self, c: &Candidate, columns: &[f64], rows: &[f64; SIDE]) -> bool {
        let projector = self.among.projector;
        let mut nearer = false;
        let mut left = c.rows;
        while left != 0 {
            let row = left.trailing_zeros() as usize;
            left &= left - 1;
            let mut open = self.open.rows[row];
            let line = Row::new::<PERSPECTIVE>(&c.sphere, rows[row]);
            while open != 0 {
                let column = open.trailing_zeros() as usize;
                open &= open - 1;
                let at = row * SIDE + column;
                let planes = [projector.near, projector.far];
                match line.look::<PERSPECTIVE>(&c.margins, planes, self.open.high[at], columns[column]) {
                    Look::Gone => {}
                    Look::Seen([low, high]) if high < self.open.high[at] - self.open.slack => {
                        self.open.hold(at, low, high);
                        self.open.id[at] = f64::from(c.index);
                        nearer = true;
                    }
                    _ => nearer |= matches!(self.settle(c, at, None), Settled::Taken),
                }
            }
        }
        nearer
    }

    /// Decides exactly between a sphere and the holder of a pixel; `depth` bounds the depth of a sphere that no plane cuts and that is
    /// hit for certain.
    #[cold]
    #[inline(never)]
    fn settle(&mut self, c: &Candidate, at: usize, depth: Option<[f64; 2]>) -> Settled {
        let Among { spheres: Spheres { scene, truth, .. }, projector, .. } = self.among;
        let index = f64::from(c.index);
        let holder = self.open.id[at];
        let held = (holder != f64::from(NONE)).then(|| Ball::from(scene.sphere(holder as usize)));
        if held == Some(c.ball) {
            self.open.id[at] = holder.min(index);
            return Settled::Twin(holder);
        }
        let [x, y] = self.open.corner;
        let Region { x: left, y: top, .. } = projector.region;
        let pixel = truth.pixel(left + x + (at % SIDE) as u32, top + y + (at / SIDE) as u32);
        let tally = &mut self.tally;
        let hit = match depth {
            Some(_) => Some(Hit::known(c.ball, Root::Near)),
            None => pixel.hit(c.ball, tally),
        };
        let Some(hit) = hit else { return Settled::Kept };
        if let Some(held) = held {
            // The holder was seen when it became the holder; which wall is plain where no plane cuts it.
            let whole = !projector.cuts(&projector.project(held.center, held.radius));
            let held = match whole {
                true => Hit::known(held, Root::Near),
                false => pixel.hit(held, tally).expect("the holder of a pixel is hit there"),
            };
            if pixel.order(&hit, &held, tally).then(index.total_cmp(&holder)).is_gt() {
                return Settled::Kept;
            }
        }
        let [low, high] = depth.unwrap_or_else(|| pixel.interval(&hit));
        self.open.hold(at, low, high);
        self.open.id[at] = index;
        Settled::Taken
    }
}

/// What a decision has come to.
enum Settled {
    /// The holder stays.
    Kept,
    /// The sphere is the holder now.
    Taken,
    /// Both are the same sphere; this was the holder.
    Twin(f64),
}
