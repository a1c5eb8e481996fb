//! Parts that fit together become the planes of the whole.
//!
//! At each pixel the nearest of what the parts found there wins. Most pixels are settled by bounds
//! of the distances; where those overlap, [`crate::exact::decide`] tells the order, and at equal
//! distance the lower index wins. That is the rule of a picture drawn at once, and it is a minimum:
//! the order of the parts does not matter.
//!
//! **What is read is not believed.** A part has the exact numbers of all spheres that are seen in
//! it, and from these everything that settles a pixel is worked out anew: for each sphere the box
//! of pixels and depths that it cannot leave (`Slot`), which is enough at most pixels; where the
//! boxes of two overlap, the filter's bounds of both at the pixel; and where these do, the exact
//! order. What a file says of a distance must agree with each of them, or the part is refused. So
//! no bound that is false, whichever program wrote it, can change a picture: it is found out, or it
//! does not matter. (That a part leaves out what it saw cannot be told from the part.)

use std::{cmp::Ordering, fmt, ops::Range};

use rayon::prelude::*;

use super::{Meta, Part, Pixel};
use crate::{
    camera::{MAX_SIDE, Region, ScreenSize},
    depth::{Lens, Shown},
    exact::decide::{Hit, Tally, Truth},
    project::{BATCH, Batch, Projector},
    scene::{Ball, Block, Bounds, Colors, Radii, Reals, Scene, SceneError},
};

/// Why parts cannot be merged.
#[derive(Debug, thiserror::Error)]
pub enum MergeError {
    /// There is nothing.
    #[error("there is no part to merge")]
    Nothing,
    /// They show different things.
    #[error(
        "{one} and {other} are not parts of one picture: {field} is {one_has} in the first, \
         {other_has} in the second; draw all parts with the same camera, size and background (a \
         camera that is fitted to the spheres of a part is that part's own)"
    )]
    View {
        /// A part.
        one: String,
        /// Another.
        other: String,
        /// What differs.
        field: &'static str,
        /// In the first.
        one_has: String,
        /// In the second.
        other_has: String,
    },
    /// Two parts hold the same spheres at the same place.
    #[error(
        "{one} and {other} both hold {} of {}; give each part of the spheres its own \
         first index, each part of the picture its own region, and name no part twice",
        Spheres(spheres),
        Place(region)
    )]
    Overlap {
        /// A part.
        one: String,
        /// Another.
        other: String,
        /// What they both hold.
        spheres: Range<u64>,
        /// Where.
        region: Region,
    },
    /// No part holds some spheres at some place.
    #[error(
        "no part holds {} of {}; add the part that does{hint}",
        Spheres(spheres),
        Place(region)
    )]
    Missing {
        /// What is missing; nothing if there are no spheres at all.
        spheres: Range<u64>,
        /// Where.
        region: Region,
        /// What else may help.
        hint: &'static str,
    },
    /// No part holds some spheres anywhere.
    #[error(
        "no part holds {}; add the part that does, or correct the first indices so that the \
         parts' spheres follow each other (a part again may have gaps)", Spheres(.0)
    )]
    Gap(Range<u64>),
    /// Two parts disagree on a sphere.
    #[error(
        "{one} and {other} have different numbers for sphere {index}: they are of different scenes"
    )]
    Different {
        /// A part.
        one: String,
        /// Another.
        other: String,
        /// The sphere.
        index: u64,
    },
    /// A part contradicts itself.
    #[error(
        "{name} is damaged: its sphere {index} {fault} at column {column}, row {row}; \
         draw it again"
    )]
    Damaged {
        /// The part.
        name: String,
        /// The sphere.
        index: i64,
        /// What is wrong with it.
        fault: &'static str,
        /// The pixel.
        column: u32,
        /// The pixel.
        row: u32,
    },
    /// Too much is seen.
    #[error(transparent)]
    Scene(#[from] SceneError),
}

struct Spheres<'a>(&'a Range<u64>);

impl fmt::Display for Spheres<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            range if range.is_empty() => write!(f, "the pixels"),
            range if range.end - range.start == 1 => write!(f, "sphere {}", range.start),
            range => write!(f, "spheres {} to {}", range.start, range.end - 1),
        }
    }
}

struct Place<'a>(&'a Region);

impl fmt::Display for Place<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Region { x, y, width, height } = self.0;
        write!(f, "region {x},{y},{width},{height}")
    }
}

/// Parts that fit together.
pub struct Merge<'a> {
    parts: &'a [Part],
    meta: Meta,
    truth: Truth,
    lens: Lens,
    /// The spheres that are seen in any part, by rising index in the whole scene.
    scene: Scene,
    indices: Vec<u64>,
    /// Of each sphere of each part.
    slots: Vec<Vec<Slot>>,
    /// How they are found.
    ranks: Vec<Ranks>,
}

/// Finds the position of an index in a sorted list: by a bitmap with counts if the list is dense,
/// else by search.
struct Ranks {
    /// The least.
    first: u64,
    /// For each 64 possible ones from there on: which there are, a bit each, and how many come
    /// before. None if that would be long.
    words: Vec<(u64, u32)>,
}

impl Ranks {
    fn new(indices: &[u64]) -> Self {
        let first = indices.first().copied().unwrap_or(0);
        let count = indices.last().map_or(0, |last| (last - first) / 64 + 1);
        let mut words = Vec::new();
        if count <= indices.len() as u64 {
            words.resize(count as usize, (0u64, 0u32));
            indices.iter().for_each(|index| {
                words[((index - first) / 64) as usize].0 |= 1 << ((index - first) % 64)
            });
            words.iter_mut().fold(0, |before, (bits, of)| {
                *of = before;
                before + bits.count_ones()
            });
        }
        Self { first, words }
    }

    /// The place of an index in the list that this was made of, if it is there.
    #[inline(always)]
    fn slot(&self, index: i64, indices: &[u64]) -> Option<usize> {
        let index = u64::try_from(index).ok()?;
        if self.words.is_empty() {
            return indices.binary_search(&index).ok();
        }
        let at = index.checked_sub(self.first)?;
        let &(bits, before) = self.words.get(usize::try_from(at / 64).ok()?)?;
        let bit = 1 << (at % 64);
        (bits & bit != 0).then(|| before as usize + (bits & (bit - 1)).count_ones() as usize)
    }
}

/// A sphere of a part: where it is kept, and the box that nothing of it leaves.
#[derive(Clone, Copy, Default)]
struct Slot {
    /// Distances from the camera's plane, world units.
    reach: [f64; 2],
    /// First and last column, first and last row; if the first is beyond the last it is seen
    /// nowhere.
    window: [u16; 4],
    /// Place in [`Merge::scene`].
    place: u32,
}

// Columns and rows of an image fit into a `Slot::window`.
const _: () = assert!(MAX_SIDE <= 1 << u16::BITS);

/// What is seen at the pixels of a region.
pub struct Band {
    /// Sphere of [`Merge::scene`] at each pixel, -1 for none.
    pub ids: Vec<i32>,
    /// Pairs of spheres whose order was decided exactly, and how.
    pub ties: Ties,
}

/// How often bounds did not tell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Ties {
    /// Pairs of hits at a pixel whose order was decided exactly.
    pub pairs: u64,
    /// Signs that took integers of any size.
    pub exact: u64,
}

impl<'a> Merge<'a> {
    /// Checks that parts fit together in a region: the whole image, or what is given; none for the
    /// least that holds all parts.
    ///
    /// # Errors
    /// When their views differ, when something is held twice or by none, or when they
    /// contradict each other.
    pub fn new(parts: &'a [Part], region: Option<Region>) -> Result<Self, MergeError> {
        let Some(first) = parts.first() else { return Err(MergeError::Nothing) };
        for part in &parts[1..] {
            compare(first, part)?;
        }
        let region = region.unwrap_or_else(|| around(parts));
        let ranges =
            union(parts.iter().flat_map(|part| part.meta.ranges.iter().cloned()).collect());
        check_overlap(parts)?;
        check_cover(parts, region, &ranges)?;

        let mut all: Vec<(u64, u32, u32)> = Vec::new();
        for (number, part) in parts.iter().enumerate() {
            all.extend(
                part.indices.iter().zip(0..).map(|(&index, slot)| (index, number as u32, slot)),
            );
        }
        all.par_sort_unstable();
        let mut slots: Vec<Vec<Slot>> =
            parts.iter().map(|part| vec![Slot::default(); part.indices.len()]).collect();
        let (mut indices, mut first_of, mut centers, mut radii, mut colors) =
            (vec![], None, vec![], vec![], vec![]);
        for (index, number, slot) in all {
            let (part, at) = (&parts[number as usize], slot as usize);
            let sphere = part.spheres.sphere(at);
            match first_of {
                Some((other, earlier, known)) if other == index => {
                    if known != sphere {
                        let [one, other] =
                            [earlier, number].map(|k: u32| parts[k as usize].name.clone());
                        return Err(MergeError::Different { one, other, index });
                    }
                }
                _ => {
                    first_of = Some((index, number, sphere));
                    indices.push(index);
                    centers.extend(sphere.center.to_array());
                    radii.push(sphere.radius);
                    colors.extend(sphere.color);
                }
            }
            slots[number as usize][at].place = indices.len() as u32 - 1;
        }
        let block = Block {
            centers: Reals::F64(centers.into()),
            radii: Radii::Each(Reals::F64(radii.into())),
            colors: Colors::Each(colors.into()),
        };
        let scene = Scene::new(vec![block])?;
        let bounds = parts.iter().filter_map(|part| part.meta.bounds).reduce(|a, b| Bounds {
            min_center: a.min_center.min(b.min_center),
            max_center: a.max_center.max(b.max_center),
            min_radius: a.min_radius.min(b.min_radius),
            max_radius: a.max_radius.max(b.max_radius),
        });
        let meta = Meta {
            view: first.meta.view,
            region,
            background: first.meta.background,
            ranges,
            bounds,
        };
        // The bounds of all spheres, seen or not, so that even what is rounded is as in a picture
        // drawn at once.
        let truth = Truth::new(&meta.view, bounds.unwrap_or_else(|| scene.bounds()));
        let lens = Lens::new(&truth);
        let projector = lens.projector();
        for (part, slots) in parts.iter().zip(&mut slots) {
            slots.par_chunks_mut(SOME).enumerate().for_each(|(number, slots)| {
                Slot::fill(slots, &part.spheres, number * SOME, projector);
            });
        }
        let ranks = parts.iter().map(|part| Ranks::new(&part.indices)).collect();
        Ok(Self { parts, meta, truth, lens, scene, indices, slots, ranks })
    }

    /// Whether the spheres of the parts are all from the first to the last.
    ///
    /// # Errors
    /// The first that are in no part.
    pub fn check_gaps(&self) -> Result<(), MergeError> {
        match self.meta.ranges.first() {
            Some(first) if first.start > 0 => Err(MergeError::Gap(0..first.start)),
            Some(first) if self.meta.ranges.len() > 1 => {
                Err(MergeError::Gap(first.end..self.meta.ranges[1].start))
            }
            _ => Ok(()),
        }
    }

    /// What the merged parts are together.
    pub fn meta(&self) -> &Meta {
        &self.meta
    }

    /// The decisions of the view.
    pub fn truth(&self) -> &Truth {
        &self.truth
    }

    /// The spheres that are seen in any part.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Indices of the spheres of [`Merge::scene`] in the whole scene, rising.
    pub fn indices(&self) -> &[u64] {
        &self.indices
    }

    /// Merges the pixels of a region.
    ///
    /// # Errors
    /// When a part contradicts itself.
    ///
    /// # Panics
    /// When the region reaches beyond that of the merge.
    pub fn band(&self, region: Region) -> Result<Band, MergeError> {
        assert_eq!(common(region, self.meta.region), Some(region), "bands are bands of the region");
        let width = region.width as usize;
        let mut ids = vec![-1; region.pixels()];
        let rows = ids.par_chunks_mut(width).zip(region.y..region.y + region.height);
        let ties = rows
            .map_init(|| Desk::new(width), |desk, (ids, row)| self.row(desk, row, region.x, ids))
            .try_reduce(Ties::default, |a, b| {
                Ok(Ties { pairs: a.pairs + b.pairs, exact: a.exact + b.exact })
            })?;
        Ok(Band { ids, ties })
    }

    /// Merges the pixels of a row from column `x` on.
    fn row(&self, desk: &mut Desk, row: u32, x: u32, ids: &mut [i32]) -> Result<Ties, MergeError> {
        (desk.pairs, desk.tally) = (0, Tally::default());
        let this = Region { x, y: row, width: ids.len() as u32, height: 1 };
        for (part, (slots, ranks)) in self.parts.iter().zip(self.slots.iter().zip(&self.ranks)) {
            let Some(Region { x: left, width, .. }) = common(part.meta.region, this) else {
                continue;
            };
            let (mut last, mut slot) = (-1, &Slot::default());
            for (column, Pixel { id, bounds }) in (left..).zip(part.row(row, left..left + width)) {
                let damaged = |fault| MergeError::Damaged {
                    name: part.name.clone(),
                    index: id,
                    fault,
                    column,
                    row,
                };
                if id == -1 {
                    if bounds != [f64::INFINITY; 2] {
                        return Err(damaged(SOMEWHERE));
                    }
                    continue;
                }
                if id != last {
                    let found = ranks.slot(id, &part.indices);
                    (last, slot) = (id, &slots[found.ok_or_else(|| damaged(UNLISTED))?]);
                }
                let [first_column, last_column, first_row, last_row] = slot.window.map(u32::from);
                if !((first_column..=last_column).contains(&column)
                    && (first_row..=last_row).contains(&row))
                {
                    return Err(damaged(ELSEWHERE));
                }
                // False for NaN.
                let [low, high] = bounds;
                let sound = (0.0 <= low) & (low <= high) & (low < f64::INFINITY);
                if !(sound & (low <= slot.reach[1]) & (slot.reach[0] <= high)) {
                    return Err(damaged(TOO_FAR));
                }
                let at = (column - x) as usize;
                let (holder, [least, most]) = (ids[at], desk.reach[at]);
                if holder < 0 || slot.reach[1] < least {
                    (ids[at], desk.reach[at], desk.close[at]) =
                        (slot.place as i32, slot.reach, false);
                } else if slot.reach[0] <= most {
                    let first = self
                        .settle(desk, [column, row, at as u32], [slot.place, holder as u32], bounds)
                        .map_err(|wrong| self.damaged(wrong, column, row))?;
                    ids[at] = if first { slot.place as i32 } else { holder };
                }
            }
        }
        Ok(Ties { pairs: desk.pairs, exact: desk.tally.big })
    }

    /// Whether one sphere is seen before another at a pixel, where both are seen; `at` is its
    /// column, its row, and its place in the row at hand. `said` bounds the distance of the first.
    fn settle(
        &self,
        desk: &mut Desk,
        [column, row, at]: [u32; 3],
        [one, other]: [u32; 2],
        said: [f64; 2],
    ) -> Result<bool, Wrong> {
        let at = at as usize;
        let found = self.bounds(desk, [column, row], one)?;
        // Both hold the exact distance, so that they have it in common.
        if !(said[0] <= found[1] && found[0] <= said[1]) {
            return Err((one, TOO_FAR));
        }
        if !desk.close[at] {
            (desk.reach[at], desk.close[at]) = (self.bounds(desk, [column, row], other)?, true);
        }
        let held = desk.reach[at];
        let first = if found[1] < held[0] || found[0] > held[1] {
            found[1] < held[0]
        } else {
            desk.pairs += 1;
            let pixel = self.truth.pixel(column, row);
            let mut hit =
                |place: u32| pixel.hit(self.ball(place), &mut desk.tally).ok_or((place, ELSEWHERE));
            let (a, b) = (hit(one)?, hit(other)?);
            // Places rise with indices.
            pixel.order(&a, &b, &mut desk.tally).then(one.cmp(&other)) == Ordering::Less
        };
        if first {
            desk.reach[at] = found;
        }
        Ok(first)
    }

    /// What is wrong if a sphere of [`Merge::scene`] that was found at a pixel turns out not to be
    /// hit there.
    pub fn not_seen(&self, id: i32, column: u32, row: u32) -> MergeError {
        self.damaged((id as u32, ELSEWHERE), column, row)
    }

    /// Which part says what is wrong of a sphere at a pixel.
    #[cold]
    fn damaged(&self, (place, fault): Wrong, column: u32, row: u32) -> MergeError {
        let index = self.indices[place as usize] as i64;
        let this = Region { x: column, y: row, width: 1, height: 1 };
        let says = |part: &&Part| {
            common(part.meta.region, this).is_some()
                && part.row(row, column..column + 1).any(|pixel| pixel.id == index)
        };
        let name = self.parts.iter().find(says).map_or_else(String::new, |part| part.name.clone());
        MergeError::Damaged { name, index, fault, column, row }
    }

    fn ball(&self, place: u32) -> Ball {
        self.scene.known(place as usize).into()
    }

    /// Certain bounds of the distance of a hit.
    fn bounds(
        &self,
        desk: &mut Desk,
        [column, row]: [u32; 2],
        place: u32,
    ) -> Result<[f64; 2], Wrong> {
        let kept = &mut desk.shown[place as usize % SHOWN];
        if kept.is_none_or(|(of, _)| of != place) {
            *kept = Some((place, self.lens.sphere(self.ball(place))));
        }
        let shown = kept.map(|(_, shown)| self.lens.line(&shown, row));
        if let Some(bounds) = shown.and_then(|line| self.lens.bounds(&line, column, row)) {
            return Ok(bounds);
        }
        let pixel = self.truth.pixel(column, row);
        let hit: Hit = pixel.hit(self.ball(place), &mut desk.tally).ok_or((place, ELSEWHERE))?;
        Ok(pixel.rough_bounds(&hit))
    }
}

/// A sphere by its place, and what is wrong with it.
type Wrong = (u32, &'static str);

/// What can be wrong with a sphere at a pixel.
const UNLISTED: &str = "is not in its list and yet is seen";
const ELSEWHERE: &str = "cannot be what is seen";
const TOO_FAR: &str = "cannot be as far away as it says";
const SOMEWHERE: &str = "(which means none) has a distance";

/// So many spheres are put into their boxes by one thread at a time.
const SOME: usize = 64 * BATCH;
/// Entries of the cache [`Desk::shown`].
const SHOWN: usize = 256;

/// What is at hand while rows are merged.
struct Desk {
    /// Of what is found at each pixel of a row: the distance lies between these.
    reach: Vec<[f64; 2]>,
    /// Whether `reach` holds bounds at this pixel; if not, those of the whole sphere.
    close: Vec<bool>,
    /// A cache of spheres that are ready for the filter, by place modulo [`SHOWN`]; a later one
    /// replaces an earlier one.
    shown: Vec<Option<(u32, Shown)>>,
    pairs: u64,
    tally: Tally,
}

impl Desk {
    fn new(width: usize) -> Self {
        let (reach, close) = (vec![[f64::INFINITY; 2]; width], vec![false; width]);
        Self { reach, close, shown: vec![None; SHOWN], pairs: 0, tally: Tally::default() }
    }
}

impl Slot {
    /// The boxes of spheres of a block from `first` on; the projector's region is the whole image.
    fn fill(slots: &mut [Self], spheres: &Block, first: usize, projector: &Projector) {
        let mut batch = Batch::default();
        for (slots, first) in slots.chunks_mut(BATCH).zip((first..).step_by(BATCH)) {
            projector.project_batch(spheres, first, &mut batch);
            projector.footprints(&mut batch);
            for (k, slot) in slots.iter_mut().enumerate() {
                let sides = [batch.left[k], batch.right[k], batch.top[k], batch.bottom[k]];
                let seen = sides[0] <= sides[1] && sides[2] <= sides[3];
                // Columns and rows of an image fit, see `Slot::window`.
                slot.window = if seen { sides.map(|side| side as u16) } else { [1, 0, 1, 0] };
                // To world units by a power of two, which rounds where that is subnormal.
                let sphere = batch.sphere(k);
                let [near, far] =
                    [sphere.nearest(), sphere.farthest()].map(|depth| depth / projector.scale);
                slot.reach = if near <= far {
                    [near.next_down(), far.next_up()]
                } else {
                    [f64::NEG_INFINITY, f64::INFINITY]
                };
            }
        }
    }
}

/// Whether two parts are of one picture.
fn compare(one: &Part, other: &Part) -> Result<(), MergeError> {
    let (a, b) = (&one.meta.view.camera, &other.meta.view.camera);
    let (p, q) = (one.meta.view.image, other.meta.view.image);
    let side = |size: ScreenSize| match size {
        ScreenSize::Width(width) => [width.to_string(), "left out".into()],
        ScreenSize::Height(height) => ["left out".into(), height.to_string()],
        ScreenSize::Both { width, height } => [width.to_string(), height.to_string()],
    };
    let [width, height] = side(a.size);
    let [other_width, other_height] = side(b.size);
    // Rust writes floats so that other numbers are other words; 0 and -0 are one number.
    let number = |x: f64| (x + 0.0).to_string();
    let vector = |v: glam::DVec3| format!("[{}, {}, {}]", number(v.x), number(v.y), number(v.z));
    let projection = |p| format!("{p:?}").to_lowercase();
    let color = |[r, g, b]: [u8; 3]| format!("#{r:02x}{g:02x}{b:02x}");
    let image = |p: crate::camera::ImageSize| format!("{} x {}", p.width, p.height);
    let fields = [
        ("the projection", projection(a.projection), projection(b.projection)),
        ("the camera's origin", vector(a.origin), vector(b.origin)),
        ("the view direction", vector(a.view), vector(b.view)),
        ("up", vector(a.up), vector(b.up)),
        ("the width of the view", width, other_width),
        ("the height of the view", height, other_height),
        ("near", number(a.near), number(b.near)),
        ("far", number(a.far), number(b.far)),
        ("the size of the image", image(p), image(q)),
        ("the background", color(one.meta.background), color(other.meta.background)),
    ];
    match fields.into_iter().find(|(_, a, b)| a != b) {
        None => Ok(()),
        Some((field, one_has, other_has)) => {
            let (one, other) = (one.name.clone(), other.name.clone());
            Err(MergeError::View { one, other, field, one_has, other_has })
        }
    }
}

/// The least region that holds all parts.
fn around(parts: &[Part]) -> Region {
    let regions = || parts.iter().map(|part| part.meta.region);
    let (left, top) = (regions().map(|r| r.x).min(), regions().map(|r| r.y).min());
    let (right, bottom) =
        (regions().map(|r| r.x + r.width).max(), regions().map(|r| r.y + r.height).max());
    let (x, y) = (left.unwrap_or(0), top.unwrap_or(0));
    Region { x, y, width: right.unwrap_or(x) - x, height: bottom.unwrap_or(y) - y }
}

/// What two regions have in common.
fn common(a: Region, b: Region) -> Option<Region> {
    let (x, y) = (a.x.max(b.x), a.y.max(b.y));
    let (right, bottom) =
        ((a.x + a.width).min(b.x + b.width), (a.y + a.height).min(b.y + b.height));
    (x < right && y < bottom).then(|| Region { x, y, width: right - x, height: bottom - y })
}

/// Runs of indices, joined where they meet.
fn union(mut ranges: Vec<Range<u64>>) -> Vec<Range<u64>> {
    ranges.sort_unstable_by_key(|range| range.start);
    let mut joined: Vec<Range<u64>> = Vec::new();
    for range in ranges {
        match joined.last_mut() {
            Some(last) if range.start <= last.end => last.end = last.end.max(range.end),
            _ => joined.push(range),
        }
    }
    joined
}

/// No pixel has a sphere from two parts.
fn check_overlap(parts: &[Part]) -> Result<(), MergeError> {
    // By index: only neighbours in this order can share spheres with an earlier run that has not
    // ended.
    let mut runs: Vec<(&Range<u64>, &Part)> = parts
        .iter()
        .flat_map(|part| part.meta.ranges.iter().map(move |range| (range, part)))
        .collect();
    runs.sort_by_key(|(range, _)| range.start);
    let mut open: Vec<(&Range<u64>, &Part)> = Vec::new();
    for (range, part) in runs {
        open.retain(|(earlier, _)| earlier.end > range.start);
        for (earlier, other) in &open {
            if let Some(region) = common(part.meta.region, other.meta.region) {
                let (one, other) = (other.name.clone(), part.name.clone());
                let spheres = range.start..range.end.min(earlier.end);
                return Err(MergeError::Overlap { one, other, spheres, region });
            }
        }
        open.push((range, part));
    }
    Ok(())
}

/// Every pixel has every sphere, and at least a part; no pixel has a sphere twice.
fn check_cover(parts: &[Part], region: Region, ranges: &[Range<u64>]) -> Result<(), MergeError> {
    // The region is cut along the sides of all parts: inside a cell nothing changes.
    let cuts = |from: u32, to: u32, sides: &dyn Fn(Region) -> [u32; 2]| {
        let mut cuts: Vec<u32> = parts.iter().flat_map(|part| sides(part.meta.region)).collect();
        cuts.extend([from, to]);
        cuts.retain(|cut| (from..=to).contains(cut));
        cuts.sort_unstable();
        cuts.dedup();
        cuts
    };
    let xs = cuts(region.x, region.x + region.width, &|r| [r.x, r.x + r.width]);
    let ys = cuts(region.y, region.y + region.height, &|r| [r.y, r.y + r.height]);
    let columns = xs.len() - 1;
    let mut cells = vec![(0u64, false); columns * (ys.len() - 1)];
    let length =
        |ranges: &[Range<u64>]| ranges.iter().map(|range| range.end - range.start).sum::<u64>();
    let covered = |part: &Part| {
        let r = common(part.meta.region, region)?;
        let place = |cuts: &[u32], side: u32| cuts.partition_point(|&cut| cut < side);
        Some((
            place(&xs, r.x)..place(&xs, r.x + r.width),
            place(&ys, r.y)..place(&ys, r.y + r.height),
        ))
    };
    for part in parts {
        let Some((across, down)) = covered(part) else { continue };
        let spheres = length(&part.meta.ranges);
        for row in down {
            for (held, any) in &mut cells[row * columns + across.start..row * columns + across.end]
            {
                (*held, *any) = (*held + spheres, true);
            }
        }
    }
    let all = length(ranges);
    let lacking = |cell: (u64, bool)| cell.0 != all || !cell.1;
    let Some(at) = cells.iter().position(|&cell| lacking(cell)) else { return Ok(()) };
    // As far right, and then as far down, as the same is missing.
    let (column, row) = (at % columns, at / columns);
    let holds = |column: usize, row: usize| {
        let inside = |part: &&Part| {
            covered(part).is_some_and(|(a, d)| a.contains(&column) && d.contains(&row))
        };
        union(parts.iter().filter(inside).flat_map(|part| part.meta.ranges.clone()).collect())
    };
    let held = holds(column, row);
    let like = |c: usize, r: usize| lacking(cells[r * columns + c]) && holds(c, r) == held;
    let right = (column + 1..columns).find(|&c| !like(c, row)).unwrap_or(columns);
    let bottom = (row + 1..ys.len() - 1)
        .find(|&r| !(column..right).all(|c| like(c, r)))
        .unwrap_or(ys.len() - 1);
    let (x, y) = (xs[column], ys[row]);
    let missing = Region { x, y, width: xs[right] - x, height: ys[bottom] - y };
    // The first run of spheres that is not held there.
    let spheres = ranges.iter().find_map(|range| {
        let start = held
            .iter()
            .find(|h| h.contains(&range.start))
            .map_or(range.start, |h| h.end.min(range.end));
        let end = held
            .iter()
            .map(|h| h.start)
            .find(|&s| s > start)
            .map_or(range.end, |s| s.min(range.end));
        (start < end).then_some(start..end)
    });
    let hint = if held.is_empty() { ", or merge only the region that is drawn" } else { "" };
    // Nothing at all is held there: the spheres do not matter.
    let spheres = if held.is_empty() { 0..0 } else { spheres.unwrap_or(0..0) };
    Err(MergeError::Missing { spheres, region: missing, hint })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranks_are_those_of_a_search() {
        let near: Vec<u64> = (0..500).map(|k| (1 << 40) + k * 3 + k % 2).collect();
        let far: Vec<u64> = (0..500).map(|k| k * k * 1000).collect();
        for indices in [near, far, vec![7], vec![]] {
            let ranks = Ranks::new(&indices);
            let some = indices
                .iter()
                .flat_map(|&index| [index as i64, index as i64 + 1, index as i64 - 1]);
            for index in some.chain([0, -1, i64::MAX, 1 << 40]) {
                let want =
                    u64::try_from(index).ok().and_then(|index| indices.binary_search(&index).ok());
                assert_eq!(ranks.slot(index, &indices), want, "{index}");
            }
            assert_eq!(
                ranks.words.is_empty(),
                indices.last().is_none_or(|last| *last == 499 * 499 * 1000)
            );
        }
    }
}
