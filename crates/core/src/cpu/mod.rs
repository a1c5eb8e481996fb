//! The native device: tiles on all cores, f64, no driver.
//!
//! How a sphere is drawn into a tile is told in [`crate::tile`]; here, which tiles there are, and
//! which spheres come when.
//!
//! A scene that is drawn for the first time is looked at sphere by sphere: tile lists come in
//! waves, front spheres first if there are many, and what they hide is not listed again. One that
//! is drawn again is put in order ([`crate::order`]): each tile then takes groups of neighbours,
//! nearest first, until what it holds hides the rest.

mod alike;
mod paint;

use std::{
    fmt,
    ops::Range,
    sync::{Arc, Mutex},
};

use rayon::prelude::*;

use crate::{
    bins::{Binner, Entry, Keep, MOST_SHIFT, Window, Workspace, split},
    camera::{Projection, Region, View},
    cover::{BLOCK, Cover},
    drawing::{Control, DrawError, Drawing, Met, Workload},
    exact::decide::Truth,
    host::Host,
    order::{BYTES, GROUP, Kept, Ordered, has_room},
    pool,
    pool::Later,
    scene::Scene,
    tile::{Exact, Mode},
};
use paint::{Depths, Group, Painter, Source, Sums, Tile, hidden};

/// Side of the largest tile, pixels.
const SIDE: usize = 64;
// Lists are made of tiles of this side and of half of it, see `shift`; `Depths` has whole blocks of
// both.
const _: () = assert!(SIDE == 1 << SIDE.ilog2() && SIDE.ilog2() <= MOST_SHIFT);
const _: () = assert!((SIDE / 2).is_multiple_of(BLOCK));
/// Blocks a side of a tile; for each the farthest depth is kept.
const BLOCKS: usize = Tile::BLOCKS;
/// About how many entries one wave has at most; each takes 84 bytes while the lists are made, 40
/// after.
pub const WAVE: usize = 1 << 18;
/// Bytes of an entry while lists are made and sorted.
const ENTRY: u64 = 124;
// An entry, its key, and its copy in the list; and room to grow.
const _: () = assert!(size_of::<Entry>() == 40 && 2 * 40 + size_of::<u32>() == 84);
/// Pixels of a band at most: its state is 12 bytes a pixel when there are several waves.
pub const BAND: usize = 4 << 20;

/// log2 of the side of a region's tiles: large ones share work best, as long as there are enough
/// for all threads.
pub fn shift(region: Region) -> u32 {
    let tiles =
        region.width.div_ceil(SIDE as u32) as usize * region.height.div_ceil(SIDE as u32) as usize;
    if tiles >= 8 * rayon::current_num_threads() { SIDE.ilog2() } else { SIDE.ilog2() - 1 }
}

/// Tuning thresholds: from how many spheres (or tiles) on each optimisation is worth its set-up
/// cost, and how much is done at a time. They never change a pixel.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// A scene that is drawn again is put in order.
    pub order: usize,
    /// It is found out what large spheres hide.
    pub cover: usize,
    /// It is found out how deep spheres lie, and the front ones are drawn first.
    pub sample: usize,
    /// About how many entries one wave of lists has at most.
    pub wave: usize,
    /// Spheres of so many pixels across are looked for in whole blocks.
    pub blocks: u32,
}

impl Default for Effort {
    fn default() -> Self {
        Self { order: ORDERED, cover: 1 << 12, sample: SAMPLED, wave: WAVE, blocks: BLOCKS_FROM }
    }
}

/// The native device: memory that is kept from one picture to the next. What is found of a scene
/// is kept in the scene ([`crate::order::Kept`]).
#[derive(Default)]
pub struct Cpu {
    effort: Effort,
    lists: Workspace<Entry>,
    tiles: Vec<Tile>,
    groups: Workspace<Group>,
    control: Control,
    host: Host,
    /// Memory for the next ids.
    lent: Vec<i32>,
}

impl fmt::Debug for Cpu {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Cpu").field("effort", &self.effort).finish_non_exhaustive()
    }
}

/// Where a region comes in a picture that is drawn in pieces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Piece {
    /// Bands of all pieces, see [`bands`].
    pub bands: usize,
    /// Whether none was drawn before.
    pub first: bool,
}

/// Rows of a band of so many columns.
fn band_rows(width: u32) -> usize {
    (BAND / width as usize).max(SIDE) / SIDE * SIDE
}

/// In how many bands a region is drawn.
pub fn bands(region: Region) -> usize {
    (region.height as usize).div_ceil(band_rows(region.width.max(1)))
}

/// Spheres of fewer pixels across seldom cover a block whole and alone.
const BLOCKS_FROM: u32 = 16 * BLOCK as u32;

/// A scene as it is drawn: with its order, if there is one.
#[derive(Clone, Copy)]
struct Subject<'a> {
    scene: &'a Scene,
    truth: &'a Truth,
    ordered: Option<&'a Ordered>,
    /// A good part of the spheres all but coincide.
    crowded: bool,
}

impl Cpu {
    /// With other thresholds, to test that they do not show.
    pub fn with(effort: Effort) -> Self {
        Self { effort, ..Self::default() }
    }

    /// With a clock and a look at the memory, which this crate does not have.
    #[must_use]
    pub fn on(self, host: Host) -> Self {
        Self { host, ..self }
    }

    /// Drawings end when this is cancelled, and tell it how far they are.
    pub fn controlled_by(&mut self, control: &Control) {
        self.control = control.clone();
    }

    /// Lends memory, such as ids of a picture that is no longer needed, for the next ids.
    pub fn lend(&mut self, ids: Vec<i32>) {
        self.lent = ids;
    }

    /// Finds out whether the scene is worth ordering, and orders it. None if it is not in order,
    /// or another thread puts it into order now.
    ///
    /// To order costs about as much as to draw a few times, and of very many spheres a dozen times.
    /// It is worth that at once where a good part of the spheres all but coincide: then groups lie
    /// as a whole inside of other spheres, and equal ones are left out.
    fn order(&self, scene: &Scene, piece: Piece) -> Result<Option<Arc<Ordered>>, DrawError> {
        let (kept, bands) = (scene.kept::<Kept>(), piece.bands);
        let before = if piece.first { kept.count() } else { kept.counted().saturating_sub(1) };
        if scene.len() < self.effort.order {
            return Ok(None);
        }
        let again = before >= if scene.len() < LONG { 1 } else { PATIENCE };
        if again || bands > BANDS || kept.crowded(scene) {
            self.prepare(scene)
        } else {
            Ok(kept.ordered())
        }
    }

    /// Puts a scene into order now, as drawing it several times would. None if it cannot be, or
    /// another thread is at it.
    ///
    /// # Errors
    /// When it was cancelled.
    pub fn prepare(&self, scene: &Scene) -> Result<Option<Arc<Ordered>>, DrawError> {
        pool::enter(|| {
            scene.kept::<Kept>().order(|| match has_room(scene, &self.host) {
                true => Ordered::new(scene, &self.control),
                false => Ok(None),
            })
        })
    }

    /// Draws a region of a view of a scene on all cores.
    ///
    /// # Errors
    /// When there is no such picture, it was cancelled, or memory does not suffice.
    pub fn draw(
        &mut self,
        scene: &Scene,
        view: &View,
        region: Region,
    ) -> Result<Drawing, DrawError> {
        self.draw_as::<Exact>(scene, view, region)
    }

    /// The same, as a piece of a picture that is drawn in several: all are one picture for what is
    /// found of a scene that is drawn again.
    ///
    /// # Errors
    /// As [`Cpu::draw`].
    pub fn draw_piece(
        &mut self,
        scene: &Scene,
        view: &View,
        region: Region,
        piece: Option<Piece>,
    ) -> Result<Drawing, DrawError> {
        self.draw_in::<Exact>(scene, view, region, piece)
    }

    /// As [`Cpu::draw`], in a mode that the caller brings: ids may be [`crate::ids::UNDECIDED`] or
    /// wrong, as the mode has it.
    ///
    /// # Errors
    /// As [`Cpu::draw`].
    pub fn draw_as<M: Mode>(
        &mut self,
        scene: &Scene,
        view: &View,
        region: Region,
    ) -> Result<Drawing, DrawError> {
        self.draw_in::<M>(scene, view, region, None)
    }

    /// A region that is a piece of a picture, or by itself.
    fn draw_in<M: Mode>(
        &mut self,
        scene: &Scene,
        view: &View,
        region: Region,
        piece: Option<Piece>,
    ) -> Result<Drawing, DrawError> {
        let mut drawing = Drawing::new(scene, view, region, std::mem::take(&mut self.lent))?;
        let piece = piece.unwrap_or(Piece { bands: bands(region), first: true });
        pool::enter(|| {
            let result = self.draw_into::<M>(scene, view, &mut drawing, piece);
            if result.is_err() {
                drop(Later::from(std::mem::take(&mut drawing.ids)));
            }
            result
        })?;
        Ok(drawing)
    }

    /// The same into a drawing that has no ids yet.
    fn draw_into<M: Mode>(
        &mut self,
        scene: &Scene,
        view: &View,
        drawing: &mut Drawing,
        piece: Piece,
    ) -> Result<(), DrawError> {
        let host = self.host;
        self.control.check()?;
        let truth = Truth::new(view, scene.bounds());
        let region = drawing.region;
        let rows = band_rows(region.width);
        let begun = host.now();
        let ordered = self.order(scene, piece)?;
        let crowded = ordered.is_some() && scene.kept::<Kept>().crowded(scene);
        let subject = Subject { scene, truth: &truth, ordered: ordered.as_deref(), crowded };
        drawing.times.prepare += host.since(begun);
        let whole = self.control.clone();
        let mut top = 0;
        while top < region.height {
            let height = (region.height - top).min(rows as u32);
            let band = Region { y: region.y + top, height, ..region };
            let share = [top, top + height].map(|row| row as f32 / region.height as f32);
            let control = whole.part(share);
            if !self.draw_groups::<M>(subject, band, drawing, &control)? {
                self.draw_band::<M>(subject, band, drawing, &control)?;
            }
            self.control.check()?;
            control.reach(1.0);
            top += height;
        }
        Ok(())
    }

    /// One band of an ordered scene, or nothing if the scene is not in order or its groups lie in
    /// too many tiles.
    fn draw_groups<M: Mode>(
        &mut self,
        Subject { scene, truth, ordered, crowded }: Subject<'_>,
        band: Region,
        drawing: &mut Drawing,
        control: &Control,
    ) -> Result<bool, DrawError> {
        let host = self.host;
        let Some(ordered) = ordered else { return Ok(false) };
        let begun = host.now();
        let binner = Binner::new(&ordered.groups, truth, band, shift(band)).until(control);
        let mut left = split(0..ordered.groups.len());
        // Where spheres all but coincide, a group costs little in many tiles.
        let spread = if crowded { SPREAD * GROUP } else { SPREAD };
        let limit = scene.len() / GROUP * spread + binner.grid.tiles();
        let cover = self.cover(scene, &binner);
        let depths = Depths::of_tiles(cover.as_ref(), &binner.grid);
        let visible =
            Visible::in_front(&vec![f64::INFINITY; depths.len()], &depths, cover.is_some());
        let lists = binner.lists(&mut left, &visible, limit, &mut self.groups);
        drawing.times.prepare += host.since(begun);
        control.check()?;
        if !left.iter().all(Range::is_empty) {
            return Ok(false);
        }
        control.reach(LISTED);
        let drawn = host.now();
        let sums = Mutex::new(Sums::default());
        // Groups come without a list of their spheres.
        let blocks = f64::INFINITY;
        let painter = Painter { scene, truth, binner: &binner, sums: &sums, blocks, control };
        painter.paint_once::<M>(Source::Groups(lists, ordered), &depths, &mut drawing.ids);
        drawing.times.render += host.since(drawn);
        drawing.counts.tiles += binner.grid.tiles();
        let empty =
            (0..binner.grid.tiles()).filter(|&tile| lists.tile(&binner.grid, tile).is_empty());
        drawing.counts.empty += empty.count();
        let sums = sums.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
        drawing.counts.entries += sums.entries as usize;
        sums.add_to(&mut drawing.counts);
        Ok(true)
    }

    /// The radius, in view lengths, from which spheres are looked for in whole blocks; infinite if
    /// there is none as large.
    fn blocks(&self, scene: &Scene, truth: &Truth) -> f64 {
        let view = truth.view();
        let least = 0.5 * f64::from(self.effort.blocks) * view.pitch_x.to_f64();
        let parallel = view.camera.projection == Projection::Orthographic;
        let any = parallel && scene.bounds().max_radius >= least;
        if any { least * truth.scale() } else { f64::INFINITY }
    }

    fn cover(&self, scene: &Scene, binner: &Binner) -> Option<Cover> {
        if scene.len() >= self.effort.cover { Cover::new(scene, &binner.projector) } else { None }
    }

    /// One band: its spheres in as many waves as memory wants, front ones first where that saves
    /// work.
    fn draw_band<M: Mode>(
        &mut self,
        Subject { scene, truth, .. }: Subject<'_>,
        band: Region,
        drawing: &mut Drawing,
        control: &Control,
    ) -> Result<(), DrawError> {
        let host = self.host;
        let begun = host.now();
        let binner = Binner::new(scene, truth, band, shift(band)).until(control);
        let grid = binner.grid;
        let sums = Mutex::new(Sums::default());
        let blocks = self.blocks(scene, truth);
        let painter = Painter { scene, truth, binner: &binner, sums: &sums, blocks, control };
        let cover = self.cover(scene, &binner);
        let mut depths = Depths::of_tiles(cover.as_ref(), &grid);
        let mut front = vec![f64::INFINITY; grid.tiles()];
        if scene.len() >= self.effort.sample {
            front = front_depths(&binner, &Visible::in_front(&front, &depths, cover.is_some()));
        }
        let mut behind = front.iter().any(|&depth| depth < f64::INFINITY);
        let mut left = split(0..scene.len());
        let in_front = Visible::in_front(&front, &depths, cover.is_some());
        let mut lists = binner.lists(&mut left, &in_front, self.effort.wave, &mut self.lists);
        drawing.times.prepare += host.since(begun);
        control.check()?;
        let mut met = lists.met;
        drawing.counts.tiles += grid.tiles();
        if !behind && left.iter().all(Range::is_empty) {
            let drawn = host.now();
            drawing.counts.entries += lists.entries.len();
            drawing.counts.empty +=
                (0..grid.tiles()).filter(|&tile| lists.tile(&grid, tile).is_empty()).count();
            painter.paint_once::<M>(Source::Spheres(lists), &depths, &mut drawing.ids);
            drawing.times.render += host.since(drawn);
        } else {
            let drawn = host.now();
            clear(&mut self.tiles, &painter, grid.tiles());
            drawing.times.render += host.since(drawn);
            let mut empty = vec![true; grid.tiles()];
            let mut second = false;
            loop {
                let drawn = host.now();
                drawing.counts.entries += lists.entries.len();
                empty
                    .iter_mut()
                    .enumerate()
                    .for_each(|(tile, empty)| *empty &= lists.tile(&grid, tile).is_empty());
                painter.paint::<M>(Source::Spheres(lists), &mut self.tiles, &mut depths);
                drawing.times.render += host.since(drawn);
                control.check()?;
                control.reach(looked(&left, scene.len(), behind, second));
                if left.iter().all(Range::is_empty) {
                    if !std::mem::take(&mut behind) {
                        break;
                    }
                    second = true;
                    left = split(0..scene.len());
                }
                let prepared = host.now();
                let visible = match second {
                    false => Visible::in_front(&front, &depths, true),
                    true => Visible::behind(&front, &depths),
                };
                lists = binner.lists(&mut left, &visible, self.effort.wave, &mut self.lists);
                // The second time the same spheres are on the screen again.
                met += Met { on_screen: if second { 0 } else { lists.met.on_screen }, ..lists.met };
                drawing.times.prepare += host.since(prepared);
            }
            let drawn = host.now();
            painter.gather(&self.tiles, &mut drawing.ids);
            drawing.counts.empty += empty.iter().filter(|empty| **empty).count();
            drawing.times.render += host.since(drawn);
        }
        sums.into_inner()
            .unwrap_or_else(std::sync::PoisonError::into_inner)
            .add_to(&mut drawing.counts);
        drawing.counts.note(band == drawing.region, met);
        Ok(())
    }
}

/// About how much of a band is done when its lists are made.
const LISTED: f32 = 0.3;

/// What part of a band's spheres was looked at: in two passes where some are left for a second.
fn looked(left: &[Range<usize>], spheres: usize, behind: bool, second: bool) -> f32 {
    let left: usize = left.iter().map(Range::len).sum();
    let pass = 1.0 - left as f32 / spheres.max(1) as f32;
    match (behind, second) {
        (false, false) => pass,
        (true, _) => 0.5 * pass,
        (false, true) => 0.5 + 0.5 * pass,
    }
}

/// Tiles that hold nothing yet.
fn clear(tiles: &mut Vec<Tile>, painter: &Painter<'_>, count: usize) {
    tiles.resize_with(count, Tile::default);
    tiles.par_iter_mut().enumerate().for_each(|(tile, state)| painter.clear(tile, state));
}

/// From this many spheres on, a scene that is drawn again is put in order.
pub const ORDERED: usize = 1 << 14;
/// From so many on ordering takes many seconds, and waits until it was drawn so often.
const LONG: usize = 1 << 25;
const PATIENCE: u32 = 12;
/// A picture of more bands is drawn from a scene in order at once.
pub const BANDS: usize = 2;
/// As long as a group lies in about this many tiles on average, order pays.
const SPREAD: usize = 32;

/// From this many spheres on, it is found out first how deep they lie.
pub const SAMPLED: usize = 1 << 17;
/// How often the boxes of the front spheres cover a tile, by a sample, before a second pass looks
/// at the rest: little shows through eight layers.
const LAYERS: u64 = 8;

/// Bytes that drawing needs at most, beyond the scene and the ids. On the safe side.
pub fn memory(work: &Workload) -> u64 {
    let entries = work.entries.min(WAVE as u64) * ENTRY;
    // What is known of each pixel: a depth or two and a sphere, 24 bytes, where drawing takes
    // several turns.
    let turns = work.spheres >= SAMPLED || work.entries > WAVE as u64;
    let state = u64::from(turns) * 24 * work.region.pixels().min(BAND) as u64;
    entries + state + u64::from(in_order(work)) * BYTES * work.spheres as u64
}

/// Whether a first picture is drawn from a scene in order, as its spheres are looked at for each of
/// several bands.
pub fn in_order(work: &Workload) -> bool {
    work.spheres >= ORDERED && work.region.pixels().div_ceil(BAND) > BANDS
}

/// For each tile, a depth before which several layers of spheres begin, by a sample; infinite if
/// there are not as many. A guess: it decides only the order of work.
fn front_depths(binner: &Binner, visible: &Visible) -> Vec<f64> {
    let grid = &binner.grid;
    let areas = binner.sample(16, visible);
    areas
        .chunks(grid.slabs as usize)
        .map(|slabs| {
            let mut area = 0;
            let enough = slabs.iter().position(|pixels| {
                area += pixels;
                area >= LAYERS << (2 * grid.shift)
            });
            enough.map_or(f64::INFINITY, |slab| grid.slab_start(slab as u32 + 1))
        })
        .collect()
}

/// What begins in front of a depth, or what begins behind it, and is not known to be hidden.
struct Visible<'a> {
    /// For each tile.
    ranges: Vec<[f64; 2]>,
    /// What is known of each tile, if anything.
    depths: Option<&'a [Depths]>,
}

impl<'a> Visible<'a> {
    fn in_front(front: &[f64], depths: &'a [Depths], hides: bool) -> Self {
        let ranges = front
            .iter()
            .zip(depths)
            .map(|(front, depths)| [f64::NEG_INFINITY, front.min(depths.farthest)]);
        Self { ranges: ranges.collect(), depths: hides.then_some(depths) }
    }

    /// For the second pass: spheres that begin at or behind `front`. One that begins exactly there
    /// was drawn in the first pass as well, which changes nothing.
    fn behind(front: &[f64], depths: &'a [Depths]) -> Self {
        let ranges = front.iter().zip(depths).map(|(&front, depths)| [front, depths.farthest]);
        Self { ranges: ranges.collect(), depths: Some(depths) }
    }
}

impl Keep for Visible<'_> {
    #[inline(always)]
    fn depths(&self, tile: usize) -> [f64; 2] {
        self.ranges[tile]
    }

    fn farthest(&self) -> f64 {
        self.ranges.iter().map(|range| range[1]).fold(f64::NEG_INFINITY, f64::max)
    }

    #[inline(always)]
    fn keep(&self, tile: usize, nearest: f64, window: Window) -> bool {
        self.depths.is_none_or(|depths| !hidden(&depths[tile], nearest, window))
    }
}
