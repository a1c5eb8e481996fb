//! Parts that fit together become the planes of the whole.
//!
//! At each pixel the nearest of what the parts found there wins. Most pixels are settled by the bounds of the distances;
//! where those overlap, [`crate::exact::decide`] tells the order, and at equal distance the lower index wins. That is the
//! rule of a picture drawn at once, and it is a minimum: the order of the parts does not matter.

use std::{cmp::Ordering, fmt, ops::Range};

use rayon::prelude::*;

use super::{Meta, Part, Pixel};
use crate::{
    camera::{Region, ScreenSize},
    exact::decide::{Ball, Tally, Truth},
    scene::{Block, Bounds, Colors, Radii, Reals, Scene, SceneError, Sphere},
};

/// Why parts cannot be merged.
#[derive(Debug, thiserror::Error)]
pub enum MergeError {
    /// There is nothing.
    #[error("there is no part to merge")]
    Nothing,
    /// They show different things.
    #[error(
        "{one} and {other} are not parts of one picture: {field} is {one_has} in the first, {other_has} in the second; \
         draw all parts with the same [camera], --size and background (a [camera] \
         without an origin, a view or a size is framed by the spheres of its own part)"
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
        "{one} and {other} both hold {} of {}; give each part of the spheres its own --first-index, each part of the \
         picture its own --region, and name no part twice",
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
    #[error("no part holds {} of {}; add the part that does{hint}", Spheres(spheres), Place(region))]
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
        "no part holds {}; add the part that does, or correct --first-index so that the parts' spheres follow each other \
         (-o none --visibility merges what there is)", Spheres(.0)
    )]
    Gap(Range<u64>),
    /// Two parts disagree on a sphere.
    #[error("{one} and {other} have different numbers for sphere {index}: they are of different scenes")]
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
        "{name} is damaged: its sphere {index} cannot be what is seen at column {column}, row {row}; \
         write it again with `planisphere render SCENE --visibility FILE.npz`"
    )]
    Damaged {
        /// The part.
        name: String,
        /// The sphere.
        index: i64,
        /// The pixel.
        column: u32,
        /// The pixel.
        row: u32,
    },
    /// Parts contradict themselves.
    #[error("a part is damaged: it names a sphere that is not seen where it says; write the parts again")]
    NotSeen,
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
    /// The spheres that are seen in any part, by rising index in the whole scene.
    scene: Scene,
    indices: Vec<u64>,
    /// Place in `scene` of each sphere of each part.
    places: Vec<Vec<u32>>,
}

/// What is seen at the pixels of a region.
pub struct Band {
    /// Sphere of [`Merge::scene`] at each pixel, -1 for none.
    pub ids: Vec<i32>,
    /// Bounds of the distances.
    pub bounds: Vec<[f64; 2]>,
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
    /// Checks that parts fit together in a region: the whole image, or what is given; none for the least that holds all parts.
    ///
    /// # Errors
    /// When their views differ, when something is held twice or by none, or when they contradict each other.
    pub fn new(parts: &'a [Part], region: Option<Region>) -> Result<Self, MergeError> {
        let Some(first) = parts.first() else { return Err(MergeError::Nothing) };
        for part in &parts[1..] {
            compare(first, part)?;
        }
        let region = region.unwrap_or_else(|| around(parts));
        let ranges = union(parts.iter().flat_map(|part| part.meta.ranges.iter().cloned()).collect());
        check_overlap(parts)?;
        check_cover(parts, region, &ranges)?;

        let mut all: Vec<(u64, u32, u32)> = Vec::new();
        for (number, part) in parts.iter().enumerate() {
            all.extend(part.indices.iter().zip(0..).map(|(&index, slot)| (index, number as u32, slot)));
        }
        all.par_sort_unstable();
        let mut places: Vec<Vec<u32>> = parts.iter().map(|part| vec![0; part.indices.len()]).collect();
        let (mut indices, mut first_of, mut centers, mut radii, mut colors) = (vec![], None, vec![], vec![], vec![]);
        for (index, number, slot) in all {
            let (part, at) = (&parts[number as usize], slot as usize);
            let block = &part.spheres;
            let sphere = Sphere { center: block.center(at), radius: block.radius(at), color: block.color(at) };
            match first_of {
                Some((other, earlier, known)) if other == index => {
                    if known != sphere {
                        let [one, other] = [earlier, number].map(|k: u32| parts[k as usize].name.clone());
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
            places[number as usize][at] = indices.len() as u32 - 1;
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
        let meta = Meta { view: first.meta.view, region, background: first.meta.background, ranges, bounds };
        // The bounds of all spheres, seen or not, so that even what is rounded is as in a picture drawn at once.
        let truth = Truth::new(&meta.view, bounds.unwrap_or_else(|| scene.bounds()));
        Ok(Self { parts, meta, truth, scene, indices, places })
    }

    /// Whether the spheres of the parts are all from the first to the last.
    ///
    /// # Errors
    /// The first that are in no part.
    pub fn check_gaps(&self) -> Result<(), MergeError> {
        match self.meta.ranges.first() {
            Some(first) if first.start > 0 => Err(MergeError::Gap(0..first.start)),
            Some(first) if self.meta.ranges.len() > 1 => Err(MergeError::Gap(first.end..self.meta.ranges[1].start)),
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
        let mut band = Band {
            ids: vec![-1; region.pixels()],
            bounds: vec![[f64::INFINITY; 2]; region.pixels()],
            ties: Ties::default(),
        };
        let rows = band.ids.par_chunks_mut(width).zip(band.bounds.par_chunks_mut(width));
        band.ties = rows
            .zip(region.y..region.y + region.height)
            .map(|((ids, bounds), row)| self.row(row, region.x, ids, bounds))
            .try_reduce(Ties::default, |a, b| Ok(Ties { pairs: a.pairs + b.pairs, exact: a.exact + b.exact }))?;
        Ok(band)
    }

    fn row(&self, row: u32, x: u32, ids: &mut [i32], bounds: &mut [[f64; 2]]) -> Result<Ties, MergeError> {
        let (mut ties, mut tally) = (0, Tally::default());
        let this = Region { x, y: row, width: ids.len() as u32, height: 1 };
        for (part, places) in self.parts.iter().zip(&self.places) {
            let Some(Region { x: left, width, .. }) = common(part.meta.region, this) else { continue };
            let (mut last, mut place) = (-1, 0);
            for (column, Pixel { id, bounds: [low, high] }) in (left..).zip(part.row(row, left..left + width)) {
                if id == -1 {
                    continue;
                }
                let damaged = || MergeError::Damaged { name: part.name.clone(), index: id, column, row };
                if id != last {
                    let slot = u64::try_from(id).ok().and_then(|id| part.indices.binary_search(&id).ok());
                    (last, place) = (id, places[slot.ok_or_else(damaged)?] as i32);
                }
                if !(low <= high) {
                    return Err(damaged());
                }
                let at = (column - x) as usize;
                let (holder, [held_low, held_high]) = (ids[at], bounds[at]);
                let wins = if holder < 0 || high < held_low {
                    true
                } else if low > held_high {
                    false
                } else {
                    ties += 1;
                    let pixel = self.truth.pixel(column, row);
                    let mut hit = |place: i32| pixel.hit(Ball::from(self.scene.known(place as usize)), &mut tally);
                    // Which of the two files is damaged is not known; the one at hand is named.
                    let (one, other) = (hit(place).ok_or_else(damaged)?, hit(holder).ok_or_else(damaged)?);
                    // Places rise with indices.
                    pixel.order(&one, &other, &mut tally).then(place.cmp(&holder)) == Ordering::Less
                };
                if wins {
                    (ids[at], bounds[at]) = (place, [low, high]);
                }
            }
        }
        Ok(Ties { pairs: ties, exact: tally.big })
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
    let (right, bottom) = (regions().map(|r| r.x + r.width).max(), regions().map(|r| r.y + r.height).max());
    let (x, y) = (left.unwrap_or(0), top.unwrap_or(0));
    Region { x, y, width: right.unwrap_or(x) - x, height: bottom.unwrap_or(y) - y }
}

/// What two regions have in common.
fn common(a: Region, b: Region) -> Option<Region> {
    let (x, y) = (a.x.max(b.x), a.y.max(b.y));
    let (right, bottom) = ((a.x + a.width).min(b.x + b.width), (a.y + a.height).min(b.y + b.height));
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
    // By index: only neighbours in this order can share spheres with an earlier run that has not ended.
    let mut runs: Vec<(&Range<u64>, &Part)> =
        parts.iter().flat_map(|part| part.meta.ranges.iter().map(move |range| (range, part))).collect();
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
    let length = |ranges: &[Range<u64>]| ranges.iter().map(|range| range.end - range.start).sum::<u64>();
    let covered = |part: &Part| {
        let r = common(part.meta.region, region)?;
        let place = |cuts: &[u32], side: u32| cuts.partition_point(|&cut| cut < side);
        Some((place(&xs, r.x)..place(&xs, r.x + r.width), place(&ys, r.y)..place(&ys, r.y + r.height)))
    };
    for part in parts {
        let Some((across, down)) = covered(part) else { continue };
        let spheres = length(&part.meta.ranges);
        for row in down {
            for (held, any) in &mut cells[row * columns + across.start..row * columns + across.end] {
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
        let inside = |part: &&Part| covered(part).is_some_and(|(a, d)| a.contains(&column) && d.contains(&row));
        union(parts.iter().filter(inside).flat_map(|part| part.meta.ranges.clone()).collect())
    };
    let held = holds(column, row);
    let like = |c: usize, r: usize| lacking(cells[r * columns + c]) && holds(c, r) == held;
    let right = (column + 1..columns).find(|&c| !like(c, row)).unwrap_or(columns);
    let bottom = (row + 1..ys.len() - 1).find(|&r| !(column..right).all(|c| like(c, r))).unwrap_or(ys.len() - 1);
    let (x, y) = (xs[column], ys[row]);
    let missing = Region { x, y, width: xs[right] - x, height: ys[bottom] - y };
    // The first run of spheres that is not held there.
    let spheres = ranges.iter().find_map(|range| {
        let start = held.iter().find(|h| h.contains(&range.start)).map_or(range.start, |h| h.end.min(range.end));
        let end = held.iter().map(|h| h.start).find(|&s| s > start).map_or(range.end, |s| s.min(range.end));
        (start < end).then_some(start..end)
    });
    let hint = if held.is_empty() { ", or merge only the region that is drawn: --region x,y,width,height" } else { "" };
    // Nothing at all is held there: the spheres do not matter.
    let spheres = if held.is_empty() { 0..0 } else { spheres.unwrap_or(0..0) };
    Err(MergeError::Missing { spheres, region: missing, hint })
}
