//! The pixels that the device's filter left over: decided on the host among the spheres of their tiles.
//!
//! As the native device draws, see [`crate::tile`]: so lists may come in any order and in any number of waves.

use glam::DVec3;
use rayon::prelude::*;

use super::{
    execute::Pixels,
    lists::{Spheres, Wave},
};
use crate::{
    camera::Region,
    exact::decide::{Ball, Tally},
    plan::{NONE, TILE},
    project::{Projected, Projector},
    simd::{LANES, Lanes},
    tile::{self, Exact, Place, Tile},
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

/// Decides all that is left over in some tiles of a region, given in ascending order and `columns` to a row, when the lists are whole. Where no
/// sphere of a tile's list is met, `backgrounds` is seen.
pub fn decide(among: Among<'_>, tiles: &[(u32, Pixels)], columns: u32, backgrounds: &[i32], ids: &mut [i32]) -> Tally {
    let region = among.projector.region;
    let row_of_tiles = |(tiles, ids): (&[(u32, Pixels)], &mut [i32])| {
        let mut tally = Tally::default();
        let mut open = Open::default();
        for &(tile, pixels) in tiles {
            open.begin(tile, columns, pixels);
            tally += open.look(among);
            open.write(region, backgrounds[tile as usize], ids);
        }
        tally
    };
    let sum = |mut a: Tally, b: Tally| {
        a += b;
        a
    };
    let mut rows = Vec::new();
    let mut rest = ids;
    let mut first = 0;
    for tiles in tiles.chunk_by(|a, b| a.0 / columns == b.0 / columns) {
        let row = tiles[0].0 / columns;
        let below = rest.split_off_mut(..(row - first) as usize * SIDE * region.width as usize);
        debug_assert!(below.is_some());
        let height = SIDE.min((region.height - row * TILE) as usize);
        if let Some(ids) = rest.split_off_mut(..height * region.width as usize) {
            rows.push((tiles, ids));
        }
        first = row + 1;
    }
    if tiles.len() < FEW {
        // What is not in the cache is waited for at once, and not tile by tile.
        for &(tile, _) in tiles {
            among.wave.tile(tile as usize).iter().take(LANES).for_each(|&place| among.spheres.prefetch(place));
        }
        rows.into_iter().map(row_of_tiles).fold(Default::default(), sum)
    } else {
        rows.into_par_iter().map(row_of_tiles).reduce(Default::default, sum)
    }
}

/// The pixels to decide when lists come in waves.
pub struct Undecided {
    tiles: Vec<Open>,
}

impl Undecided {
    /// Those of some tiles of a region whose tiles come `columns` to a row.
    pub fn new(tiles: &[(u32, Pixels)], columns: u32) -> Self {
        let open = |&(tile, pixels): &(u32, Pixels)| {
            let mut open = Open::default();
            open.begin(tile, columns, pixels);
            open
        };
        Self { tiles: tiles.par_iter().map(open).collect() }
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
    tile: u32,
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
        Self { tile: 0, corner: [0; 2], pixels: 0, window: [0; 2], state: Tile::default(), farthest: f64::INFINITY }
    }
}

impl Open {
    /// Starts with some pixels of a tile.
    fn begin(&mut self, tile: u32, columns: u32, pixels: Pixels) {
        (self.tile, self.corner) = (tile, [tile % columns * TILE, tile / columns * TILE]);
        (self.pixels, self.window, self.farthest) = (pixels, [0; 2], f64::INFINITY);
        self.state.clear(0, 0);
        for [column, row] in places(pixels) {
            self.window[0] |= 1 << column;
            self.window[1] |= 1 << row;
            self.state.open(column, row);
        }
    }

    /// Writes what was decided, and `background` where nothing is met; `ids` are of the tile's row of tiles.
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
    fn look(&mut self, among: Among<'_>) -> Tally {
        tile::dispatch(among.projector.projection, Paint { among, open: self });
        self.state.take_tally()
    }
}

/// Spheres that may be nearest.
struct Batch {
    ball: [Ball; LANES],
    sphere: [Projected; LANES],
    /// Nothing of the sphere is nearer.
    nearest: [f64; LANES],
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
}

impl tile::Work for Paint<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes, const PERSPECTIVE: bool>(self) {
        let Among { spheres, projector, wave } = self.among;
        let Spheres { scene, truth, .. } = spheres;
        let Open { tile, corner, window: [open_columns, open_rows], ref mut state, ref mut farthest, .. } = *self.open;
        let [x, y] = corner.map(|at| at as usize);
        let place = Place::new(scene, truth, projector, [x, y]);
        state.begin::<Exact>(&place);
        let disorder = wave.lists().disorder * truth.scale() * (1.0 + 4.0 * f64::EPSILON);
        let zero = Ball { center: DVec3::ZERO, radius: 0.0 };
        let mut batch = Batch { ball: [zero; LANES], sphere: [Projected::default(); LANES], nearest: [0.0; LANES] };
        // The last spheres that were looked at: a later one that is the same is nowhere seen.
        let mut depths = [f64::INFINITY; SEEN];
        let mut seen = [(u32::MAX, zero); SEEN];
        let mut count = 0;
        let list = wave.tile(tile as usize);
        for (turn, places) in list.chunks(LANES).enumerate() {
            // While these are looked at, the next come.
            list.iter().skip((turn + 1) * LANES).take(LANES).for_each(|&place| spheres.prefetch(place));
            places.iter().zip(&mut batch.ball).for_each(|(&place, ball)| *ball = spheres.ball(place));
            for k in 0..LANES {
                let s = projector.project(batch.ball[k].center, batch.ball[k].radius);
                batch.sphere[k] = s;
                batch.nearest[k] = s.nearest();
            }
            for (k, &at) in places.iter().enumerate() {
                let (sphere, nearest) = (batch.sphere[k], batch.nearest[k]);
                if nearest > *farthest {
                    // No later sphere begins nearer than this by more than the disorder, and the roundings of both places.
                    if nearest - sphere.bound() - disorder > *farthest {
                        return;
                    }
                    continue;
                }
                let mut rows_seen = open_rows;
                // One row is sooner looked at than known to be missed.
                if !open_rows.is_power_of_two() {
                    let [across, down] = projector.extent::<PERSPECTIVE>(&sphere);
                    rows_seen &= window(down, y as f64);
                    if rows_seen == 0 || window(across, x as f64) & open_columns == 0 {
                        continue;
                    }
                }
                let (index, ball, z) = (spheres.index(at), batch.ball[k], L::splat(sphere.z));
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
                let (cut, rows) = (projector.cuts(&sphere), (0..SIDE).filter(|row| rows_seen >> row & 1 == 1));
                state.draw::<L, PERSPECTIVE, Exact>(&place, index, &sphere, cut, [0, SIDE - 1], rows);
                if let Some((_, depth)) = state.freshen::<L, PERSPECTIVE>(&place) {
                    *farthest = depth;
                }
            }
        }
    }
}
