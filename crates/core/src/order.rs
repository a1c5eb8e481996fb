//! Spheres in an order in which neighbours in space lie together, in groups with a sphere around
//! each.
//!
//! A group that is off the screen or hidden is skipped with all its spheres: that is worth it for
//! what is drawn more than once, and on a GPU, which takes spheres in this order, at once. It is
//! made once for a scene, and exactness rests on two things here: a group's sphere holds its
//! spheres whole, and what is left out is the same as an earlier sphere.

use std::{
    fmt,
    ops::Range,
    sync::{
        Arc, Mutex, OnceLock, PoisonError,
        atomic::{AtomicU32, Ordering},
    },
};

use glam::DVec3;
use rayon::prelude::*;

use crate::{
    drawing::{Control, DrawError},
    host::Host,
    ids::{SortedIndex, SphereIndex},
    pair,
    pool::Later,
    project::BATCH,
    scene::{Ball, Block, Colors, Column, Radii, Reals, Scene},
};

/// Spheres in a group, at most.
pub const GROUP: usize = BATCH;
// `bins` and `cpu::paint` project a group as one batch.
const _: () = assert!(GROUP <= BATCH);
/// Bytes a sphere that it takes at most to put a scene in order, and to keep it.
pub const BYTES: u64 = 40;

/// Whether the machine has twice the memory that it takes to put a scene in order.
pub fn has_room(scene: &Scene, host: &Host) -> bool {
    (host.has_room)(2 * BYTES * scene.len() as u64)
}
/// Numbers from 2^-RANGE to 2^RANGE have squares that neither overflow nor vanish.
const RANGE: i32 = 400;

/// A scene in order.
pub struct Ordered {
    /// The same centres and radii, to the bit; colours are left out.
    pub block: Block,
    /// Index in the scene of each sphere, by its [`SortedIndex`].
    pub indices: Vec<SphereIndex>,
    /// First sphere of each group, and their number at the end: by the number of a group, places in
    /// this order.
    pub starts: Vec<u32>,
    /// Sphere `k` holds group `k` whole.
    pub groups: Scene,
}

impl fmt::Debug for Ordered {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { indices, groups, .. } = self;
        f.debug_struct("Ordered")
            .field("spheres", &indices.len())
            .field("groups", &groups.len())
            .finish()
    }
}

impl Ordered {
    /// Of a scene, in groups as tight as may be. Spheres that are the same as an earlier one, which
    /// are seen nowhere, are left out if there are many. None where exponents are so extreme that
    /// squares of f64 could leave their range: without it everything works,
    /// slower.
    ///
    /// # Errors
    /// When it was cancelled.
    pub fn new(scene: &Scene, control: &Control) -> Result<Option<Self>, DrawError> {
        if !usable(scene) {
            return Ok(None);
        }
        let arranged = arranged(scene, &distinct(scene, control)?, control)?;
        Self::of(scene, arranged, control).map(Some)
    }

    /// The same, several times sooner made, with looser groups. No group lies across a multiple of
    /// `part` spheres.
    ///
    /// # Errors
    /// When it was cancelled.
    pub fn coarse(
        scene: &Scene,
        part: usize,
        control: &Control,
    ) -> Result<Option<Self>, DrawError> {
        if !usable(scene) {
            return Ok(None);
        }
        let arranged = along_a_curve(scene, &distinct(scene, control)?, part, control)?;
        Self::of(scene, arranged, control).map(Some)
    }

    /// Number of spheres.
    pub fn len(&self) -> usize {
        self.indices.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.indices.is_empty()
    }

    fn of(
        scene: &Scene,
        (indices, starts): (Vec<SphereIndex>, Vec<u32>),
        control: &Control,
    ) -> Result<Self, DrawError> {
        let (bounds, indices) = (scene.bounds(), Later::from(indices));
        let count = indices.len();
        let blocks = || scene.blocks().map(|(_, block)| block).filter(|block| !block.is_empty());
        let single = blocks().all(|block| matches!(block.centers, Reals::F32(_)));
        let centers = if single {
            let row = |k: usize| center(scene, indices[k]).as_vec3().to_array();
            Reals::F32(Column::of_rows(made(count, control, row)?))
        } else {
            let row = |k: usize| center(scene, indices[k]).to_array();
            Reals::F64(Column::of_rows(made(count, control, row)?))
        };
        let radii = if bounds.min_radius == bounds.max_radius {
            Radii::Same(bounds.max_radius)
        } else if blocks().all(|block| matches!(block.radii, Radii::Each(Reals::F32(_)))) {
            let radius = |k: usize| radius(scene, indices[k]) as f32;
            Radii::Each(Reals::F32(made(count, control, radius)?.into()))
        } else {
            let radius = |k: usize| radius(scene, indices[k]);
            Radii::Each(Reals::F64(made(count, control, radius)?.into()))
        };
        let block = Block { centers, radii, colors: Colors::Same([0; 3]) };
        let group = |k: usize| around(&block, starts[k] as usize..starts[k + 1] as usize);
        let groups: Vec<(DVec3, f64)> = made(starts.len() - 1, control, group)?;
        let (middles, reaches): (Vec<[f64; 3]>, Vec<f64>) =
            groups.into_iter().map(|(middle, reach)| (middle.to_array(), reach)).unzip();
        let groups = Scene::new(vec![Block {
            centers: Reals::F64(Column::of_rows(middles)),
            radii: Radii::Each(Reals::F64(reaches.into())),
            colors: Colors::Same([0; 3]),
        }]);
        Ok(Self {
            block,
            indices: indices.keep(),
            starts,
            groups: groups.expect("finite and positive, as the exponents are not extreme"),
        })
    }

    /// Where some spheres lie, given by ascending indices; none for those that are left out.
    pub fn places_of(&self, indices: &[SphereIndex]) -> Vec<Option<SortedIndex>> {
        let number = |(place, index): (usize, &SphereIndex)| {
            Some((indices.binary_search(index).ok()?, SortedIndex(place as u32)))
        };
        let found: Vec<(usize, SortedIndex)> =
            self.indices.par_iter().enumerate().filter_map(number).collect();
        let mut places = vec![None; indices.len()];
        found.into_iter().for_each(|(number, place)| places[number] = Some(place));
        places
    }

    /// The groups of some consecutive spheres, which begin and end with groups.
    pub fn groups_of(&self, spheres: Range<usize>) -> Range<usize> {
        let group = |first: usize| self.starts.partition_point(|&start| (start as usize) < first);
        group(spheres.start)..group(spheres.end)
    }

    /// The index of the only sphere of a group; none if there are several.
    pub fn only(&self, group: u32) -> Option<SphereIndex> {
        let [first, end] = [0, 1].map(|k| self.starts[group as usize + k]);
        (end - first == 1).then(|| self.indices[first as usize])
    }
}

/// Whether a good part of a scene's spheres all but coincide, by a sample of them. A guess: it
/// decides only the order of work.
pub fn is_crowded(scene: &Scene) -> bool {
    /// So many are looked at, evenly spread.
    const SAMPLE: usize = 128;
    /// About how many pairs of the sample all but coincide if a sixteenth of the spheres lies in
    /// one place.
    const PAIRS: usize = SAMPLE * SAMPLE / 512;
    let sample: Vec<Ball> = (0..SAMPLE.min(scene.len()))
        .map(|k| scene.known(k * scene.len() / SAMPLE.min(scene.len())).into())
        .collect();
    let mut pairs = 0;
    for (k, one) in sample.iter().enumerate() {
        pairs += sample[..k].iter().filter(|other| pair::near(one, other)).count();
        if pairs >= PAIRS {
            return true;
        }
    }
    false
}

/// Whether no square of a distance leaves the range of f64, and memory is not short.
fn usable(scene: &Scene) -> bool {
    let bounds = scene.bounds();
    let limit = f64::from(RANGE).exp2();
    let far = bounds.max_center.abs().max(bounds.min_center.abs()).max_element();
    far < limit && bounds.max_radius < limit && bounds.min_radius > 1.0 / limit && !scene.is_empty()
}

fn center(scene: &Scene, index: SphereIndex) -> DVec3 {
    let (block, at) = scene.locate(index.at());
    block.center(at)
}

fn radius(scene: &Scene, index: SphereIndex) -> f64 {
    let (block, at) = scene.locate(index.at());
    block.radius(at)
}

/// Spheres, or groups, that a thread looks at before it asks whether it was cancelled.
const PART: usize = 1 << 12;

/// What `make` gives for `0..count`, by all threads.
///
/// # Errors
/// When it was cancelled.
fn made<T: Copy + Send + 'static>(
    count: usize,
    control: &Control,
    make: impl Fn(usize) -> T + Sync,
) -> Result<Vec<T>, DrawError> {
    let mut all = Later::from(Vec::with_capacity(count));
    all.spare_capacity_mut()[..count].par_chunks_mut(PART).enumerate().try_for_each(
        |(part, to)| {
            control.check()?;
            to.iter_mut().enumerate().for_each(|(at, to)| {
                to.write(make(part * PART + at));
            });
            Ok::<(), DrawError>(())
        },
    )?;
    // SAFETY: reserved above, and each of them was written, or this was left by an error.
    unsafe { all.set_len(count) };
    Ok(all.keep())
}

/// A sphere that holds a group whole. The factor is far above the roundings of a distance and a
/// sum.
fn around(block: &Block, spheres: Range<usize>) -> (DVec3, f64) {
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for sphere in spheres.clone() {
        (low, high) = (low.min(block.center(sphere)), high.max(block.center(sphere)));
    }
    let middle = 0.5 * low + 0.5 * high;
    let reach = |sphere| block.center(sphere).distance(middle) + block.radius(sphere);
    (middle, spheres.map(reach).fold(0.0, f64::max) * (1.0 + 1e-12))
}

/// A sphere to be put in order.
#[derive(Clone, Copy, Default)]
struct Item {
    /// Place in the scene's box, from 0 to [`ONE`] on its longest side; the last bits of x are the
    /// sphere's class of size.
    at: [u32; 3],
    index: SphereIndex,
}

const ONE: f64 = (1u64 << 32) as f64;
/// Classes of size, as a power of two.
const CLASSES: u32 = 2;

impl Item {
    /// Number of its class, and of its cell among those of `1 << bits` along each axis.
    #[inline(always)]
    fn cell(&self, bits: u32) -> usize {
        let [x, y, z] = self.at.map(|at| at.checked_shr(32 - bits).unwrap_or(0) as usize);
        let class = self.at[0] as usize % (1 << CLASSES);
        (((((class << bits) | x) << bits) | y) << bits) | z
    }
}

/// The size class of a sphere. Large spheres get clusters of their own: among small ones they would
/// make the cluster's bounding sphere large.
fn class(greatest: f64, radius: f64) -> u32 {
    let exponent = |value: f64| (value.to_bits() >> 52) as u32;
    ((exponent(greatest) - exponent(radius)) / 3).min((1 << CLASSES) - 1)
}

/// Turns counts into where each begins, from `first` on. Returns where the last ends.
fn add_up(counts: &mut [u32], first: u32) -> u32 {
    counts.iter_mut().fold(first, |total, count| total + std::mem::replace(count, total))
}

/// Indices in ascending order, without those of spheres that are the same as an earlier one: all of
/// them, unless many are the same.
fn distinct(scene: &Scene, control: &Control) -> Result<Later<SphereIndex>, DrawError> {
    /// A first look takes one sphere in this many. A hash of its numbers chooses it, so that equal
    /// spheres are chosen together.
    const SAMPLE: u64 = 64;
    let same = |a: SphereIndex, b: SphereIndex| {
        center(scene, a) == center(scene, b) && radius(scene, a) == radius(scene, b)
    };
    let hash = |index: SphereIndex| {
        let DVec3 { x, y, z } = center(scene, index);
        [x, y, z, radius(scene, index)].iter().fold(0u64, |hash, number| {
            // Both zeros are equal.
            let mixed = (hash ^ (number + 0.0).to_bits()).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            mixed ^ mixed >> 32
        })
    };
    // Spheres of some hashes, and the later ones of those that are the same.
    let repeated = |of: u64| {
        let hashes = (0..scene.len().div_ceil(PART)).into_par_iter().flat_map_iter(|part| {
            let end = scene.len().min((part + 1) * PART);
            // Nothing is made of what is left out: it was cancelled.
            let end = if control.is_cancelled() { part * PART } else { end };
            let indices = (part * PART..end).map(|index| SphereIndex(index as u32));
            indices.map(|index| (hash(index), index)).filter(|(hash, _)| hash % of == 0)
        });
        let mut hashes: Vec<(u64, SphereIndex)> = hashes.collect();
        control.check()?;
        hashes.par_sort_unstable();
        let later = hashes.par_chunk_by(|a, b| a.0 == b.0).flat_map_iter(|equal| {
            // Different spheres seldom have one hash: what is the same as the first of them is
            // enough.
            let first = equal[0].1;
            equal[1..].iter().map(|(_, index)| *index).filter(move |&index| same(first, index))
        });
        Ok::<_, DrawError>((later.collect::<Vec<SphereIndex>>(), hashes.len()))
    };
    let (some, of) = repeated(SAMPLE)?;
    if some.len() * 16 <= of {
        return Ok(made(scene.len(), control, |index| SphereIndex(index as u32))?.into());
    }
    let mut keep = vec![true; scene.len()];
    repeated(1)?.0.into_iter().for_each(|index| keep[index.at()] = false);
    let kept = (0..scene.len() as u32).map(SphereIndex).filter(|&index| keep[index.at()]);
    Ok(kept.collect::<Vec<_>>().into())
}

/// So many spheres in turn between two looks whether it was cancelled.
const STRIDE: usize = 1 << 16;

/// So many things of no meaning yet.
///
/// # Errors
/// When it was cancelled.
fn room<T: Copy + Default + Send + 'static>(
    count: usize,
    control: &Control,
) -> Result<Later<T>, DrawError> {
    let mut all = Later::from(Vec::with_capacity(count));
    while all.len() < count {
        control.check()?;
        let some = count.min(all.len() + STRIDE);
        all.resize(some, T::default());
    }
    Ok(all)
}

/// Some indices along a Morton curve through the cells of a grid, in their order inside of each;
/// and where groups begin.
fn along_a_curve(
    scene: &Scene,
    some: &[SphereIndex],
    part: usize,
    control: &Control,
) -> Result<(Vec<SphereIndex>, Vec<u32>), DrawError> {
    // About 32 spheres to a cell, at most 2^18 cells.
    let bits = ((some.len() / 32).max(1).ilog2() / 3).clamp(1, 6);
    let cells = 1usize << (3 * bits);
    let bounds = scene.bounds();
    let per_length = f64::from(1 << bits) / (bounds.max_center - bounds.min_center);
    // The bits of a coordinate with two zeros between each.
    let spread = |c: u32| (0..bits).map(|k| (c >> k & 1) << (3 * k)).sum::<u32>();
    let spread: Vec<u32> = (0..1 << bits).map(spread).collect();
    let mut indices: Later<SphereIndex> = room(some.len(), control)?;
    let mut starts =
        Vec::with_capacity(some.len() / GROUP + (some.len().div_ceil(part) << CLASSES) + 1);
    for (number, some) in some.chunks(part).enumerate() {
        let key = |at: usize| {
            let index = some[at];
            // A cast of what is NaN, on an axis without extent, gives 0.
            let cell = (center(scene, index) - bounds.min_center) * per_length;
            let [x, y, z] = cell.to_array().map(|c| spread[(c as usize).min(spread.len() - 1)]);
            class(bounds.max_radius, radius(scene, index)) << (3 * bits) | x | y << 1 | z << 2
        };
        let keys: Later<u32> = made(some.len(), control, key)?.into();
        let mut next = vec![0; cells << CLASSES];
        for keys in keys.chunks(STRIDE) {
            control.check()?;
            keys.iter().for_each(|&key| next[key as usize] += 1);
        }
        let end = add_up(&mut next, (number * part) as u32);
        for class in 0..1 << CLASSES {
            let after = next.get((class + 1) * cells).copied().unwrap_or(end);
            starts.extend((next[class * cells]..after).step_by(GROUP));
        }
        for (some, keys) in some.chunks(STRIDE).zip(keys.chunks(STRIDE)) {
            control.check()?;
            for (&index, &key) in some.iter().zip(keys) {
                let place = &mut next[key as usize];
                indices[*place as usize] = index;
                *place += 1;
            }
        }
    }
    starts.push(indices.len() as u32);
    Ok((indices.keep(), starts))
}

/// Some indices such that those of a group lie close together, and where groups begin. First by
/// cells, as this is soon done, and inside of each by halves of halves across the longest side.
fn arranged(
    scene: &Scene,
    some: &[SphereIndex],
    control: &Control,
) -> Result<(Vec<SphereIndex>, Vec<u32>), DrawError> {
    let bounds = scene.bounds();
    let per_length = ONE / (bounds.max_center - bounds.min_center).max_element();
    let item = |at: usize| {
        let index = some[at];
        // A cast of what is NaN, where the box is a point, gives 0.
        let mut at =
            ((center(scene, index) - bounds.min_center) * per_length).to_array().map(|c| c as u32);
        at[0] = at[0] & !((1 << CLASSES) - 1) | class(bounds.max_radius, radius(scene, index));
        Item { at, index }
    };
    let items: Later<Item> = made(some.len(), control, item)?.into();
    // At least a thousand spheres to a cell, or there would be many groups that are not full.
    let bits = (some.len() >> 10).max(1).ilog2() / 3;
    let mut ends = vec![0u32; 1 << (CLASSES + 3 * bits)];
    for items in items.chunks(STRIDE) {
        control.check()?;
        items.iter().for_each(|item| ends[item.cell(bits)] += 1);
    }
    let total = add_up(&mut ends, 0);
    let mut starts = Vec::with_capacity(some.len() / GROUP + ends.len());
    let nexts = ends[1..].iter().copied().chain([total]);
    ends.iter().zip(nexts).for_each(|(&start, next)| starts.extend((start..next).step_by(GROUP)));
    starts.push(total);
    let mut by_cell: Later<Item> = room(items.len(), control)?;
    for items in items.chunks(STRIDE) {
        control.check()?;
        for item in items {
            let place = &mut ends[item.cell(bits)];
            by_cell[*place as usize] = *item;
            *place += 1;
        }
    }
    drop(items);
    by_cell
        .par_chunk_by_mut(|a, b| a.cell(bits) == b.cell(bits))
        .try_for_each(|items| arrange(items, control))?;
    Ok((made(by_cell.len(), control, |at| by_cell[at].index)?, starts))
}

fn arrange(items: &mut [Item], control: &Control) -> Result<(), DrawError> {
    if items.len() <= GROUP {
        return Ok(());
    }
    control.check()?;
    let (mut low, mut high) = ([u32::MAX; 3], [0; 3]);
    for item in &*items {
        for k in 0..3 {
            (low[k], high[k]) = (low[k].min(item.at[k]), high[k].max(item.at[k]));
        }
    }
    let axis = (0..3).max_by_key(|&k| high[k] - low[k]).unwrap_or(0);
    let middle = items.len().div_ceil(GROUP) / 2 * GROUP;
    items.select_nth_unstable_by_key(middle, |item| item.at[axis]);
    let (front, back) = items.split_at_mut(middle);
    if back.len() < 1 << 12 {
        arrange(front, control)?;
        arrange(back, control)
    } else {
        let (front, back) = rayon::join(|| arrange(front, control), || arrange(back, control));
        front.and(back)
    }
}

/// What is found of a scene once, to draw it sooner: [`Scene::kept`] keeps it there, and all who
/// draw the scene share it.
#[derive(Default)]
pub struct Kept {
    /// How often it was drawn.
    drawn: AtomicU32,
    crowded: OnceLock<bool>,
    state: Mutex<State>,
}

/// The order of a scene.
#[derive(Default)]
enum State {
    #[default]
    None,
    /// Some thread makes it. Others draw without it meanwhile: they must not wait, see
    /// [`crate::pool`].
    Underway,
    /// It is made; none if it cannot be.
    Made(Option<Arc<Ordered>>),
}

impl Kept {
    /// How often the scene was drawn before, and once more from now on.
    pub fn count(&self) -> u32 {
        self.drawn.fetch_add(1, Ordering::Relaxed)
    }

    /// How often it was drawn, what is drawn now included.
    pub fn counted(&self) -> u32 {
        self.drawn.load(Ordering::Relaxed)
    }

    /// [`is_crowded`], found once.
    pub fn crowded(&self, scene: &Scene) -> bool {
        *self.crowded.get_or_init(|| is_crowded(scene))
    }

    /// The order, if it is made.
    pub fn ordered(&self) -> Option<Arc<Ordered>> {
        match &*self.state.lock().unwrap_or_else(PoisonError::into_inner) {
            State::Made(ordered) => ordered.clone(),
            State::None | State::Underway => None,
        }
    }

    /// Whether the order is made, or it is known that it cannot be.
    pub fn is_made(&self) -> bool {
        matches!(&*self.state.lock().unwrap_or_else(PoisonError::into_inner), State::Made(_))
    }

    /// Takes over an order, unless there is one.
    pub fn adopt(&self, ordered: &Arc<Ordered>) {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        if !matches!(*state, State::Made(Some(_))) {
            *state = State::Made(Some(Arc::clone(ordered)));
        }
    }

    /// The order; makes it if nobody does. None while another thread makes it.
    ///
    /// # Errors
    /// Those of `make`; then it is as if nobody had begun.
    pub fn order(
        &self,
        make: impl FnOnce() -> Result<Option<Ordered>, DrawError>,
    ) -> Result<Option<Arc<Ordered>>, DrawError> {
        {
            let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
            match &*state {
                State::Made(ordered) => return Ok(ordered.clone()),
                State::Underway => return Ok(None),
                State::None => *state = State::Underway,
            }
        }
        let begun = Begun(self);
        let made = make()?.map(Arc::new);
        let mut state = begun.0.state.lock().unwrap_or_else(PoisonError::into_inner);
        if let State::Underway = *state {
            *state = State::Made(made);
        }
        match &*state {
            State::Made(ordered) => Ok(ordered.clone()),
            State::None | State::Underway => Ok(None),
        }
    }

    /// Bytes that the order takes.
    pub fn memory(&self, scene: &Scene) -> u64 {
        self.ordered().map_or(0, |_| BYTES * scene.len() as u64)
    }
}

/// An order that was begun: one that comes to nothing, by an error or a panic, may be begun again.
struct Begun<'a>(&'a Kept);

impl Drop for Begun<'_> {
    fn drop(&mut self) {
        let mut state = self.0.state.lock().unwrap_or_else(PoisonError::into_inner);
        if let State::Underway = *state {
            *state = State::None;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Sphere;

    fn whole(scene: &Scene) -> Ordered {
        Ordered::new(scene, &Control::new()).unwrap().unwrap()
    }

    fn coarse(scene: &Scene, part: usize) -> Ordered {
        Ordered::coarse(scene, part, &Control::new()).unwrap().unwrap()
    }

    #[test]
    fn an_order_is_made_once_and_not_waited_for() {
        let scene = spheres(3000, DVec3::new);
        let kept = scene.clone().kept::<Kept>();
        assert!(Arc::ptr_eq(&kept, &scene.kept()) && !Arc::ptr_eq(&kept, &scene.fresh().kept()));
        assert_eq!((kept.count(), kept.count()), (0, 1));
        let cancelled = Control::new();
        cancelled.cancel();
        let failed = kept.order(|| Ordered::new(&scene, &cancelled));
        assert!(matches!(failed, Err(DrawError::Cancelled)) && kept.ordered().is_none());
        // Whoever comes meanwhile goes on without it.
        let made = kept.order(|| {
            assert!(kept.order(|| unreachable!()).unwrap().is_none());
            Ordered::new(&scene, &Control::new())
        });
        let made = made.unwrap().unwrap();
        let again = kept.order(|| unreachable!()).unwrap().unwrap();
        assert!(Arc::ptr_eq(&made, &again) && kept.memory(&scene) == 3000 * BYTES);
        kept.adopt(&Arc::new(coarse(&scene, 100)));
        assert!(Arc::ptr_eq(&made, &kept.ordered().unwrap()));
    }

    fn spheres(count: usize, place: impl Fn(f64, f64, f64) -> DVec3) -> Scene {
        let sphere = |k: usize| {
            let [x, y, z] = [3, 5, 7].map(|m| (k * 1_000_003 * m % 65_537) as f64 / 65_537.0);
            let radius = if k.is_multiple_of(100) { 30.0 } else { 1e-3 * (1.0 + x) };
            Sphere { center: place(x, y, z), radius, color: [0; 3] }
        };
        Scene::from_spheres(&(0..count).map(sphere).collect::<Vec<_>>()).unwrap()
    }

    #[test]
    fn groups_hold_their_spheres_and_lie_close_together() {
        let cube = spheres(20_000, DVec3::new);
        // All but eight in one heap, far smaller than a cell.
        let heap =
            spheres(20_000, |x, y, z| DVec3::new(x, y, z) * if x < 4e-4 { 1e9 } else { 1.0 });
        let point = spheres(500, |x, _, _| DVec3::ONE + 1e-12 * x);
        for (scene, close) in [(&cube, 0.5), (&heap, 0.5), (&point, 1e-9)] {
            assert!(loose(scene, &whole(scene), close) < scene.len() / 20);
        }
        // A few groups of a curve leap.
        for part in [7, 9000, 20_000, 1 << 20] {
            let ordered = coarse(&cube, part);
            assert!(part < GROUP || loose(&cube, &ordered, 0.5) < cube.len() / 5);
            for start in (0..cube.len()).step_by(part) {
                let spheres = start..cube.len().min(start + part);
                assert!(
                    ordered.indices[spheres.clone()]
                        .iter()
                        .all(|index| spheres.contains(&index.at()))
                );
                let groups = ordered.groups_of(spheres.clone());
                let ends = [groups.start, groups.end].map(|group| ordered.starts[group] as usize);
                assert_eq!(ends, [spheres.start, spheres.end]);
            }
        }
        loose(&heap, &coarse(&heap, 20_000), 0.5);
    }

    #[test]
    fn of_many_that_are_the_same_the_first_is_kept() {
        let once: Vec<Sphere> = (0..3000).map(|k| spheres(3000, DVec3::new).known(k)).collect();
        let mut several = once.clone();
        // Some as they are, some that differ by the sign of zero or by the radius alone.
        several.extend(once[..2000].iter().rev());
        several.extend(once[..500].iter().map(|s| Sphere { radius: 2.0 * s.radius, ..*s }));
        several.extend([0.0, -0.0].map(|x| Sphere {
            center: DVec3::new(x, 0.5, 0.5),
            radius: 0.1,
            color: [0; 3],
        }));
        let scene = Scene::from_spheres(&several).unwrap();
        let want: Vec<_> = (0..3000).chain(5000..5501).map(SphereIndex).collect();
        assert_eq!(*distinct(&scene, &Control::new()).unwrap(), want);
        for ordered in [whole(&scene), coarse(&scene, 1000)] {
            let mut kept = ordered.indices.clone();
            kept.sort_unstable();
            assert_eq!((kept, ordered.len(), ordered.block.len()), (want.clone(), 3501, 3501));
        }
        // A few are not worth the search.
        let few = Scene::from_spheres(&[&once[..], &once[..20]].concat()).unwrap();
        assert_eq!(distinct(&few, &Control::new()).unwrap().len(), 3020);
    }

    /// How many small spheres lie in groups that are not `close`; fails where an order is none.
    fn loose(scene: &Scene, ordered: &Ordered, close: f64) -> usize {
        let mut seen = ordered.indices.clone();
        seen.sort_unstable();
        let all = (0..scene.len() as u32).map(SphereIndex);
        assert!(seen.iter().copied().eq(all), "a permutation");
        let mut loose = 0;
        assert_eq!(ordered.starts.len(), ordered.groups.len() + 1);
        assert!(
            ordered.starts.windows(2).all(|ends| (1..=GROUP as u32).contains(&(ends[1] - ends[0])))
        );
        for (place, &index) in ordered.indices.iter().enumerate() {
            let sphere = scene.known(index.at());
            assert_eq!(
                (ordered.block.center(place), ordered.block.radius(place)),
                (sphere.center, sphere.radius)
            );
            let group = ordered
                .groups
                .known(ordered.starts.partition_point(|&start| start as usize <= place) - 1);
            assert!(group.center.distance(sphere.center) + sphere.radius <= group.radius);
            loose += usize::from(sphere.radius < 1.0 && group.radius > close + 2e-3);
        }
        loose
    }

    #[test]
    fn numbers_are_kept_in_their_kind() {
        let block = |centers: Vec<f32>, radii| Block {
            centers: Reals::F32(centers.into()),
            radii,
            colors: Colors::Same([0; 3]),
        };
        let same = whole(&Scene::new(vec![block(vec![0.1; 9], Radii::Same(0.3))]).unwrap());
        assert!(matches!(
            (&same.block.centers, &same.block.radii),
            (Reals::F32(_), Radii::Same(_))
        ));
        let blocks =
            vec![block(vec![0.1; 9], Radii::Same(0.3)), block(vec![0.7; 3], Radii::Same(0.1))];
        let ordered = whole(&Scene::new(blocks.clone()).unwrap());
        assert!(matches!(
            (&ordered.block.centers, &ordered.block.radii),
            (Reals::F32(_), Radii::Each(Reals::F64(_)))
        ));
        let tiny = Scene::new(vec![block(vec![0.1; 3], Radii::Same(1e-200))]).unwrap();
        assert!(Ordered::new(&tiny, &Control::new()).unwrap().is_none(), "squares vanish");
    }
}
