//! Parts of pictures, merged, are the whole, byte for byte: every scene of the stress corpus, and
//! some of no pattern, in parts of its spheres, of its picture, and of both, in any order; scenes
//! from all of the range of f64 against the judge, bounds and all; and the command line with its
//! messages.
//!
//! `PLANISPHERE_SEEDS=0..20000 cargo test --release --test merge extreme` chooses the seeds of the
//! latter.

mod corpus;
mod judge;

use std::{
    fmt::Write as _,
    fs,
    ops::Range,
    path::Path,
    process::{Command, Output, Stdio},
    sync::atomic::{AtomicU64, Ordering},
};

use corpus::{Case, extreme::extreme, fuzz::fuzz, random::Random};
use glam::DVec3;
use judge::Judge;
use planisphere_core::{
    camera::{Projection, Region, View},
    depth::{depth_plane, depths, distance_bounds},
    exact::decide::Truth,
    part::{
        Meta, Part, Pixel, Pixels, Seen,
        merge::{Merge, MergeError},
    },
    scene::{Scene, Sphere},
};
use planisphere_image::Paint;
use planisphere_io::{
    load,
    part::{self, PartWriter},
    png::write_png,
};
use planisphere_renderer::{Device, Engine};

const BACKGROUND: [u8; 3] = [1, 2, 3];

/// Draws some spheres of a scene in a region, as `render --visibility --first-index` does, and
/// reads the part back.
fn draw_part(
    folder: &Path,
    device: &mut Engine,
    scene: &Scene,
    view: &View,
    range: Range<usize>,
    region: Region,
) -> Part {
    let spheres: Vec<Sphere> = range.clone().map(|k| scene.sphere(k).unwrap()).collect();
    let own = Scene::from_spheres(&spheres).unwrap();
    let ids = device.draw(&own, view, region).unwrap().ids;
    let meta = Meta {
        view: *view,
        region,
        background: BACKGROUND,
        ranges: if range.is_empty() {
            vec![]
        } else {
            std::iter::once(range.start as u64..range.end as u64).collect()
        },
        bounds: (!range.is_empty()).then(|| own.bounds()),
    };
    let bounds = distance_bounds(&own, &Truth::new(view, own.bounds()), region, &ids).unwrap();
    let mut seen = Seen::new(own.len());
    seen.mark(&ids);
    let global = |id: i32| if id < 0 { -1 } else { i64::from(id) + range.start as i64 };
    let mut bytes = Vec::new();
    let mut writer = PartWriter::new(&mut bytes, &meta).unwrap();
    writer
        .pixels(ids.iter().zip(bounds).map(|(&id, bounds)| Pixel { id: global(id), bounds }))
        .unwrap();
    writer.finish(seen.iter().map(|k| ((range.start + k) as u64, own.sphere(k).unwrap()))).unwrap();
    read(folder, &bytes)
}

fn read(folder: &Path, bytes: &[u8]) -> Part {
    let path = folder.join("part.npz");
    // A new file each time: the last one stays mapped.
    let _ = fs::remove_file(&path);
    fs::write(&path, bytes).unwrap();
    part::part(&path).unwrap_or_else(|error| panic!("{error}"))
}

/// Merges parts into a part.
fn again(folder: &Path, parts: &[Part]) -> Part {
    let merge = Merge::new(parts, None).unwrap_or_else(|error| panic!("{error}"));
    let meta = merge.meta();
    let band = merge.band(meta.region).unwrap();
    let mut seen = Seen::new(merge.scene().len());
    seen.mark(&band.ids);
    let global = |id: i32| usize::try_from(id).map_or(-1, |k| merge.indices()[k] as i64);
    let mut bytes = Vec::new();
    let mut writer = PartWriter::new(&mut bytes, meta).unwrap();
    let bounds = distance_bounds(merge.scene(), merge.truth(), meta.region, &band.ids).unwrap();
    writer
        .pixels(band.ids.iter().zip(bounds).map(|(&id, bounds)| Pixel { id: global(id), bounds }))
        .unwrap();
    writer
        .finish(seen.iter().map(|k| (merge.indices()[k], merge.scene().sphere(k).unwrap())))
        .unwrap();
    read(folder, &bytes)
}

/// Cuts of `0..n` into `count` runs, some of them perhaps empty.
fn cuts(random: &mut Random, n: usize, count: usize) -> Vec<Range<usize>> {
    let mut ends: Vec<usize> =
        (1..count).map(|_| random.below(n as u64 + 1) as usize).chain([0, n]).collect();
    ends.sort_unstable();
    ends.windows(2).map(|pair| pair[0]..pair[1]).collect()
}

/// A region in up to four, cut across and down.
fn quarters(random: &mut Random, whole: Region) -> Vec<Region> {
    let mut parts = Vec::new();
    for down in cuts(random, whole.height as usize, 2) {
        for across in cuts(random, whole.width as usize, 2) {
            if !down.is_empty() && !across.is_empty() {
                parts.push(Region {
                    x: across.start as u32,
                    y: down.start as u32,
                    width: across.len() as u32,
                    height: down.len() as u32,
                });
            }
        }
    }
    parts
}

/// Draws a case in parts, of a kind that is told by `way`.
fn parts_of(
    folder: &Path,
    device: &mut Engine,
    case: &Case,
    way: usize,
    random: &mut Random,
) -> Vec<Part> {
    let Case { scene, view, .. } = case;
    let whole = Region::whole(view.image);
    let mut parts = Vec::new();
    match way {
        // Four parts of the spheres.
        0 => {
            for range in cuts(random, scene.len(), 4) {
                parts.push(draw_part(folder, device, scene, view, range, whole));
            }
        }
        // Four parts of the picture.
        1 => {
            for region in quarters(random, whole) {
                parts.push(draw_part(folder, device, scene, view, 0..scene.len(), region));
            }
        }
        // Both, the spheres cut in other places everywhere.
        2 => {
            for region in quarters(random, whole) {
                for range in cuts(random, scene.len(), 3) {
                    parts.push(draw_part(folder, device, scene, view, range, region));
                }
            }
        }
        // A tree: parts of the spheres, first each with one that is no neighbour.
        _ => {
            let mut leaves: Vec<Part> = cuts(random, scene.len(), 4)
                .into_iter()
                .map(|range| draw_part(folder, device, scene, view, range, whole))
                .collect();
            leaves.swap(1, 2);
            let last = leaves.split_off(2);
            parts.extend([again(folder, &leaves), again(folder, &last)]);
        }
    }
    for k in (1..parts.len()).rev() {
        parts.swap(k, random.below(k as u64 + 1) as usize);
    }
    parts
}

#[test]
fn pictures_in_parts_are_the_whole() {
    let folder = tempfile::tempdir().unwrap();
    let mut cpu = Engine::open(&Device::Cpu).unwrap();
    let mut gpu = Engine::open(&Device::Gpu).unwrap_or_else(|error| panic!("{error}"));
    let mut random = Random::new(11);
    let (mut ties, mut exact, mut pixels) = (0, 0, 0);
    let cases = corpus::corpus().into_iter().chain((0..200).map(fuzz));
    for (number, case) in cases.enumerate() {
        let case = &case;
        let Case { name, scene, view } = case;
        let whole = Region::whole(view.image);
        let ids = cpu.draw(scene, view, whole).unwrap().ids;
        let depth = depth_plane(scene, view, whole, &ids).unwrap();
        let device = if number % 12 == 0 { &mut gpu } else { &mut cpu };
        let parts = parts_of(folder.path(), device, case, number % 4, &mut random);
        let merge =
            Merge::new(&parts, Some(whole)).unwrap_or_else(|error| panic!("{name}: {error}"));
        merge.check_gaps().unwrap_or_else(|error| panic!("{name}: {error}"));
        // In two bands, where there are two rows.
        let top = Region { height: whole.height.div_ceil(2), ..whole };
        let rest = Region { y: top.height, height: whole.height - top.height, ..whole };
        let mut local = merge.band(top).unwrap().ids;
        if rest.height > 0 {
            let band = merge.band(rest).unwrap();
            local.extend(band.ids);
            ties += band.ties.pairs;
            exact += band.ties.exact;
        }
        let merged: Vec<i32> = local
            .iter()
            .map(|&k| usize::try_from(k).map_or(-1, |k| merge.indices()[k] as i32))
            .collect();
        assert!(
            merged == ids,
            "{name}: {} wrong pixels",
            merged.iter().zip(&ids).filter(|(a, b)| a != b).count()
        );
        let again = depths(merge.scene(), merge.truth(), whole, &local).unwrap();
        let bits = |plane: &[f32]| plane.iter().map(|depth| depth.to_bits()).collect::<Vec<_>>();
        assert!(bits(&again) == bits(&depth), "{name}: other depths");
        let png = |scene: &Scene, ids: &[i32]| {
            let mut bytes = Vec::new();
            write_png(&mut bytes, whole, ids, &Paint { scene, background: BACKGROUND }).unwrap();
            bytes
        };
        assert!(png(scene, &ids) == png(merge.scene(), &local), "{name}: other pictures");
        pixels += ids.len();
    }
    println!(
        "{pixels} pixels; {ties} pairs were too close for their bounds, {exact} signs took long \
         integers"
    );
    assert!(ties > 1000, "the corpus has near ties");
}

/// How far apart bounds are at most, as a part of the distance, and where that is too little for
/// f64: as the docs of `distance_bounds` say.
const RATIO: f64 = 1.0 / (1 << 20) as f64;
const APART: f64 = 16.0 * f64::from_bits(1);

/// Whether a depth in f32 is as near as the docs say.
const DEPTH_BOUND: f64 = 0.51;

/// What is wrong with scenes, and what was looked at.
#[derive(Default)]
struct Findings {
    wrong: std::collections::BTreeMap<&'static str, (u64, u64, String)>,
    hits: u64,
    zero: u64,
    beyond_f32: u64,
    beyond_f64: u64,
    subnormal: u64,
    ties: u64,
}

impl Findings {
    /// Notes so many faults of a kind in a scene.
    fn note(&mut self, kind: &'static str, count: usize, words: impl FnOnce() -> String) {
        if count > 0 {
            let (scenes, all, text) = self.wrong.entry(kind).or_default();
            (*scenes, *all) = (*scenes + 1, *all + count as u64);
            if *scenes <= 5 {
                let _ = write!(text, "\n    {}", words());
            }
        }
    }

    fn add(&mut self, other: Self) {
        for (kind, (scenes, all, text)) in other.wrong {
            let of = self.wrong.entry(kind).or_default();
            (of.0, of.1) = (of.0 + scenes, of.1 + all);
            of.2 += &text;
        }
        self.hits += other.hits;
        self.zero += other.zero;
        self.beyond_f32 += other.beyond_f32;
        self.beyond_f64 += other.beyond_f64;
        self.subnormal += other.subnormal;
        self.ties += other.ties;
    }

    /// What a file says of distances, pixel by pixel, against the judge.
    fn bounds(&mut self, name: &str, judge: &Judge, part: &Part, kinds: [&'static str; 3]) {
        let (mut wrong, mut wide, mut none) = (vec![], vec![], vec![]);
        let Region { x, y, width, .. } = part.meta.region;
        for (at, (id, [low, high])) in contents(part).into_iter().enumerate() {
            let (column, row) = (x + at as u32 % width, y + at as u32 / width);
            let words = |exact: &str| {
                format!("{name}: {column}, {row}, sphere {id}: {low:e} to {high:e}, not {exact}")
            };
            if id < 0 {
                if [low, high] != [f64::INFINITY; 2] {
                    none.push(words("infinite"));
                }
                continue;
            }
            let Some(distance) = judge.distance(column, row, id as i32) else {
                none.push(words("seen"));
                continue;
            };
            if !distance.has_bounds([low, high]) {
                wrong.push(words(&distance.words()));
            } else if high < f64::INFINITY && high - low > high * RATIO + APART
                || high == f64::INFINITY && low < f64::MAX * (1.0 - RATIO)
            {
                wide.push(words(&distance.words()));
            }
        }
        for (kind, found) in kinds.into_iter().zip([wrong, wide, none]) {
            self.note(kind, found.len(), || found[0].clone());
        }
    }

    /// Everything about one scene.
    fn look(&mut self, folder: &Path, device: &mut Engine, seed: u64) {
        let case = extreme(seed);
        let Case { name, scene, view } = &case;
        let mut random = Random::new(seed ^ 0x5eed);
        let whole = Region::whole(view.image);
        let judge = Judge::new(scene, view).until_the_last_bit();
        let want = judge.ids(whole);
        let ids = device.draw(scene, view, whole).unwrap().ids;
        let differ = |a: &[i32], b: &[i32]| a.iter().zip(b).filter(|(a, b)| a != b).count();
        self.note("ids of one run", differ(&ids, &want), || name.clone());
        let depth = depth_plane(scene, view, whole, &want).unwrap();
        let mut far = vec![];
        for (at, (&id, &depth)) in want.iter().zip(&depth).enumerate() {
            let (column, row) = (at as u32 % whole.width, at as u32 / whole.width);
            let Some(distance) = judge.distance(column, row, id) else {
                if depth != f32::INFINITY {
                    far.push(format!("{name}: {column}, {row}: {depth:e} at the background"));
                }
                continue;
            };
            self.hits += 1;
            self.zero += u64::from(distance.is_between(0.0, 0.0));
            self.subnormal += u64::from(!distance.is_between(f64::MIN_POSITIVE, f64::INFINITY));
            self.beyond_f32 += u64::from(distance.is_between(f32::MAX.into(), f64::INFINITY));
            self.beyond_f64 += u64::from(distance.is_between(f64::MAX, f64::INFINITY));
            if !distance.has_depth(depth, DEPTH_BOUND) {
                far.push(format!(
                    "{name}: {column}, {row}, sphere {id}: {depth:e}, not {}",
                    distance.words()
                ));
            }
        }
        let (infinite, far): (Vec<_>, Vec<_>) =
            far.into_iter().partition(|words| words.contains(": inf"));
        self.note("infinite depths of one run", infinite.len(), || infinite[0].clone());
        self.note("depths of one run", far.len(), || far[0].clone());
        if ids != want {
            return;
        }
        let one = draw_part(folder, device, scene, view, 0..scene.len(), whole);
        self.bounds(
            name,
            &judge,
            &one,
            ["false bounds of one run", "wide bounds of one run", "no hits in one run"],
        );

        // One to six parts: runs of spheres, regions, or both.
        let count = 1 + random.below(6) as usize;
        let (across, of_spheres) = match random.below(3) {
            0 => (1, count),
            1 => (count, 1),
            _ => (2, count.div_ceil(2)),
        };
        let mut parts = Vec::new();
        for region in strips(&mut random, whole, across) {
            for range in cuts(&mut random, scene.len(), of_spheres) {
                parts.push(draw_part(folder, device, scene, view, range, region));
            }
        }
        for part in &parts {
            self.bounds(
                name,
                &judge,
                part,
                ["false bounds of parts", "wide bounds of parts", "no hits in parts"],
            );
        }
        for k in (1..parts.len()).rev() {
            parts.swap(k, random.below(k as u64 + 1) as usize);
        }
        // In steps, where two fit together.
        for _ in 0..random.below(4) {
            if parts.len() < 2 {
                break;
            }
            let at = random.below(parts.len() as u64 - 1) as usize;
            let (one, other) = (parts.remove(at), parts.remove(at));
            let both = [one, other];
            match Merge::new(&both, None) {
                Ok(_) => {
                    let part = again(folder, &both);
                    let kinds = [
                        "false bounds of merged parts",
                        "wide bounds of merged parts",
                        "no hits in merged parts",
                    ];
                    self.bounds(name, &judge, &part, kinds);
                    parts.insert(at, part);
                }
                Err(MergeError::Missing { .. }) => {
                    both.into_iter().for_each(|part| parts.insert(at, part))
                }
                Err(error) => self.note("merges in steps", 1, || format!("{name}: {error}")),
            }
        }
        let merge =
            Merge::new(&parts, Some(whole)).unwrap_or_else(|error| panic!("{name}: {error}"));
        let band = match merge.check_gaps().and_then(|()| merge.band(whole)) {
            Ok(band) => band,
            Err(error) => return self.note("merges", 1, || format!("{name}: {error}")),
        };
        self.ties += band.ties.pairs;
        let index = |&k: &i32| usize::try_from(k).map_or(-1, |k| merge.indices()[k] as i32);
        let merged: Vec<i32> = band.ids.iter().map(index).collect();
        self.note("ids of merges", differ(&merged, &want), || name.clone());
        if merged != want {
            return;
        }
        let bits = |plane: &[f32]| plane.iter().map(|depth| depth.to_bits()).collect::<Vec<_>>();
        let other =
            depths(merge.scene(), merge.truth(), whole, &band.ids).map(|plane| bits(&plane));
        self.note("depths of merges", usize::from(other != Ok(bits(&depth))), || name.clone());
        let png = |scene: &Scene, ids: &[i32]| {
            let mut bytes = Vec::new();
            write_png(&mut bytes, whole, ids, &Paint { scene, background: BACKGROUND }).unwrap();
            bytes
        };
        let differ = png(scene, &ids) != png(merge.scene(), &band.ids);
        self.note("pictures of merges", usize::from(differ), || name.clone());
        let again = again(folder, &parts);
        let differ = contents(&again) != contents(&one);
        self.note("bounds of merges that are not those of one run", usize::from(differ), || {
            name.clone()
        });
    }
}

/// What a part says of each pixel.
fn contents(part: &Part) -> Vec<(i64, [f64; 2])> {
    let size = Pixels::record(part.pixels.wide);
    let of = |record: &[u8]| {
        let (id, bounds) = record.split_at(size - 16);
        let id = match part.pixels.wide {
            true => i64::from_le_bytes(id.try_into().unwrap()),
            false => i32::from_le_bytes(id.try_into().unwrap()).into(),
        };
        (id, [0, 8].map(|at| f64::from_le_bytes(bounds[at..at + 8].try_into().unwrap())))
    };
    part.pixels.bytes.chunks_exact(size).map(of).collect()
}

/// A region in so many strips or fewer, across or down.
fn strips(random: &mut Random, whole: Region, count: usize) -> Vec<Region> {
    let down = random.below(2) == 0;
    let length = if down { whole.height } else { whole.width };
    let strip = |cut: Range<usize>| {
        let (start, length) = (cut.start as u32, cut.len() as u32);
        if down {
            Region { y: start, height: length, ..whole }
        } else {
            Region { x: start, width: length, ..whole }
        }
    };
    cuts(random, length as usize, count)
        .into_iter()
        .filter(|cut| !cut.is_empty())
        .map(strip)
        .collect()
}

/// Bounds, depths, parts and merges of scenes from all of the range of f64, against the judge.
#[test]
fn extreme_scenes_in_parts_are_the_judges() {
    let seeds = corpus::seeds(0..400);
    let next = AtomicU64::new(seeds.start);
    let threads = std::thread::available_parallelism().unwrap().get();
    let work = || {
        let folder = tempfile::tempdir().unwrap();
        let mut device = Engine::open(&Device::Cpu).unwrap();
        let mut findings = Findings::default();
        loop {
            let seed = next.fetch_add(1, Ordering::Relaxed);
            if seed >= seeds.end {
                return findings;
            }
            // What panics is one more fault, and the next scene is looked at all the same.
            let look =
                std::panic::AssertUnwindSafe(|| findings.look(folder.path(), &mut device, seed));
            if std::panic::catch_unwind(look).is_err() {
                findings.note("panics", 1, || format!("extreme, seed {seed}"));
            }
        }
    };
    let mut findings = Findings::default();
    std::thread::scope(|scope| {
        let threads: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
        threads.into_iter().for_each(|thread| findings.add(thread.join().unwrap()));
    });
    let Findings { wrong, hits, zero, beyond_f32, beyond_f64, subnormal, ties } = &findings;
    println!(
        "{} scenes, {hits} hits: {zero} at distance 0, {subnormal} below normal f64, {beyond_f32} \
         beyond f32, {beyond_f64} beyond f64; {ties} pairs were too close for their bounds",
        seeds.end - seeds.start
    );
    let list: Vec<String> = wrong
        .iter()
        .map(|(kind, (scenes, all, text))| format!("{kind}: {all} wrong in {scenes} scenes{text}"))
        .collect();
    assert!(list.is_empty(), "{}", list.join("\n"));
    // What is not there is not tested.
    if seeds == (0..400) {
        let least = [*hits / 2000, *zero, *subnormal, *beyond_f32 / 10, *beyond_f64, *ties / 10];
        assert!(least.iter().all(|&count| count > 0), "{least:?}");
    }
}

/// A part with other contents: pixels and spheres pass through the given functions on the way.
fn altered(
    folder: &Path,
    part: &Part,
    pixel: impl Fn(usize, Pixel) -> Pixel,
    sphere: impl Fn(u64, Sphere) -> Sphere + Clone,
) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut writer = PartWriter::new(&mut bytes, &part.meta).unwrap();
    let pixels = contents(part).into_iter().enumerate();
    writer.pixels(pixels.map(|(at, (id, bounds))| pixel(at, Pixel { id, bounds }))).unwrap();
    let number = |at: usize| Sphere {
        center: part.spheres.center(at),
        radius: part.spheres.radius(at),
        color: part.spheres.color(at),
    };
    writer
        .finish(
            part.indices.iter().enumerate().map(|(at, &index)| (index, sphere(index, number(at)))),
        )
        .unwrap();
    fs::write(folder.join("altered.npz"), &bytes).unwrap();
    bytes
}

/// A part that contradicts itself is refused, by its name and with the fix; and no false bound
/// changes what is seen.
#[test]
fn parts_that_lie_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let mut cpu = Engine::open(&Device::Cpu).unwrap();
    // One before the other, and in the second part one behind both that begins among them, and a
    // small one at the side.
    let spheres = [
        corpus::ball([5.0, 0.0, 0.0], 2.0),
        corpus::ball([3.5, 0.0, 0.0], 1.0),
        corpus::ball([23.4, 0.0, 0.0], 20.0),
        corpus::ball([4.0, 3.5, 3.5], 0.5),
    ];
    let scene = corpus::scene(&spheres);
    let mut lies = 0;
    for (projection, _) in corpus::BOTH {
        let look = corpus::Look { at: DVec3::X * 5.0, view: DVec3::X, distance: 5.0, height: 9.0 };
        let view = View::new(look.camera(projection), corpus::pixels(9, 9));
        let whole = Region::whole(view.image);
        let want = cpu.draw(&scene, &view, whole).unwrap().ids;
        let first = draw_part(folder, &mut cpu, &scene, &view, 0..2, whole);
        let mut second = draw_part(folder, &mut cpu, &scene, &view, 2..4, whole);
        second.name = "other.npz".into();
        let truth = contents(&first);
        // What comes of an altered first part, read again and merged before or after the second.
        let mut merged = |bytes: &[u8], last: bool| -> Result<Vec<i32>, String> {
            let path = folder.join("part.npz");
            let _ = fs::remove_file(&path);
            fs::write(&path, bytes).unwrap();
            let part = part::part(&path).map_err(|error| error.to_string())?;
            let mut second = draw_part(folder, &mut cpu, &scene, &view, 2..4, whole);
            second.name = "other.npz".into();
            let both = if last { [second, part] } else { [part, second] };
            let merge = Merge::new(&both, None).map_err(|error| error.to_string())?;
            let ids = merge.band(whole).map_err(|error| error.to_string())?.ids;
            Ok(ids
                .iter()
                .map(|&k| usize::try_from(k).map_or(-1, |k| merge.indices()[k] as i32))
                .collect())
        };
        let same = |_: u64, sphere: Sphere| sphere;
        for last in [false, true] {
            assert_eq!(
                merged(&altered(folder, &first, |_, pixel| pixel, same), last),
                Ok(want.clone())
            );
        }
        let middle = truth.iter().position(|&(id, _)| id == 1).unwrap();
        assert!(contents(&second)[middle].0 == 2, "the parts compete");
        let sky = truth.iter().position(|&(id, _)| id == -1).unwrap();
        let (nan, inf) = (f64::NAN, f64::INFINITY);
        let [low, high] = truth[middle].1;
        for (at, id, bounds, words) in [
            (middle, 1, [nan, high], "as far away"),
            (middle, 1, [low, nan], "as far away"),
            (middle, 1, [high, low.next_down()], "as far away"),
            (middle, 1, [-1.0, high], "as far away"),
            (middle, 1, [inf, inf], "as far away"),
            (middle, 1, [0.5 * f64::MAX, inf], "as far away"),
            (middle, 1, [0.0, low * 0.5], "as far away"),
            (middle, 1, [high + 10.0, inf], "as far away"),
            (middle, 7, [low, high], "not in its list"),
            (middle, 2, [low, high], "not in its list"),
            (middle, -2, [low, high], "not in its list"),
            (middle, i64::from(i32::MIN), [low, high], "not in its list"),
            (middle, -1, [low, high], "means none"),
            (middle, -1, [inf, low], "means none"),
            (sky, 1, [low, high], "cannot be what is seen"),
        ] {
            let to = Pixel { id, bounds };
            let bytes = altered(folder, &first, |k, pixel| if k == at { to } else { pixel }, same);
            for last in [false, true] {
                let error = merged(&bytes, last).unwrap_err();
                for word in ["part.npz", words, "draw it again"] {
                    assert!(error.contains(word), "{projection:?}, {to:?}: {error} lacks {word:?}");
                }
                lies += 1;
            }
        }
        // Where no other part competes the sphere's box tells.
        let to = Pixel { id: 1, bounds: [low, high] };
        let bytes = altered(folder, &first, |k, pixel| if k == sky { to } else { pixel }, same);
        let path = folder.join("alone.npz");
        fs::write(&path, bytes).unwrap();
        let alone = [part::part(&path).unwrap()];
        let merge = Merge::new(&alone, None).unwrap();
        let error = merge.band(whole).map(|band| band.ids).unwrap_err().to_string();
        let words = "alone.npz is damaged: its sphere 1 cannot be what is seen";
        assert!(error.contains(words), "{projection:?}: {error}");
        // A hair off where parts compete: it is found out when it is compared, and changes nothing
        // when it is not.
        for bounds in [
            [high * (1.0 + 1e-9), high * (1.0 + 2e-9)],
            [low * (1.0 - 2e-9), low * (1.0 - 1e-9)],
            [3.45, 3.46],
            [0.0, high],
            [low, f64::MAX],
        ] {
            let to = Pixel { id: 1, bounds };
            let bytes =
                altered(folder, &first, |k, pixel| if k == middle { to } else { pixel }, same);
            if let Ok(ids) = merged(&bytes, false) {
                assert!(ids == want, "{projection:?}, {bounds:?}");
            }
            let holds = bounds[0] <= low && high <= bounds[1];
            match merged(&bytes, true) {
                Ok(ids) => assert!(holds && ids == want, "{projection:?}, {bounds:?}"),
                Err(error) => assert!(
                    !holds && error.contains("as far away"),
                    "{projection:?}, {bounds:?}: {error}"
                ),
            }
            lies += 1;
        }
        // Numbers of spheres that are none, and others than what is seen.
        for (word, change) in [
            ("radius", (|s| Sphere { radius: 0.0, ..s }) as fn(Sphere) -> Sphere),
            ("radius", |s| Sphere { radius: -1.0, ..s }),
            ("radius", |s| Sphere { radius: f64::NAN, ..s }),
            ("radius", |s| Sphere { radius: f64::INFINITY, ..s }),
            ("centre", |s| Sphere { center: DVec3::new(f64::NAN, 0.0, 0.0), ..s }),
            ("centre", |s| Sphere { center: DVec3::new(0.0, f64::INFINITY, 0.0), ..s }),
            ("extent", |s| Sphere { radius: 100.0, ..s }),
            ("extent", |s| Sphere { radius: 1e-9, ..s }),
            ("extent", |s| Sphere { center: s.center * 2.0, ..s }),
            ("cannot be", |s| Sphere { center: DVec3::new(3.5, 0.0, 0.0), radius: 1.0, ..s }),
        ] {
            let sphere = |index: u64, s: Sphere| if index == 0 { change(s) } else { s };
            let error =
                merged(&altered(folder, &first, |_, pixel| pixel, sphere), false).unwrap_err();
            assert!(
                error.contains("part.npz") && error.contains(word),
                "{projection:?}: {error} lacks {word:?}"
            );
            lies += 1;
        }
    }
    println!("{lies} lies");
    assert!(lies >= 80, "{lies}");
}

/// The scenes of the fault that was found first, by the command line: parts merge to the files of
/// one run, and no hit is infinitely far.
#[test]
fn surfaces_in_the_plane_of_the_camera_merge() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    for (name, camera, side, planet, front) in [
        (
            "planet",
            "width = 0.02",
            16,
            "[6.4e6, 5e-324, 0.0]\nradius = 6.4e6",
            "[0.02, 0.0, 0.0]\nradius = 0.008",
        ),
        (
            "large",
            "width = 8796093022208.0\nheight = 8796093022208.0",
            8,
            "[1267650600228229401496703205376.0, 5e-324, 0.0]\nradius = \
             1267650600228229401496703205376.0",
            "[35184372088832.0, 0.0, 0.0]\nradius = 4398046511104.0",
        ),
    ] {
        let scene = |file: &str, spheres: &[&str]| {
            let spheres: String =
                spheres.iter().map(|numbers| format!("[[sphere]]\ncenter = {numbers}\n")).collect();
            let head = format!(
                "[camera]\nview = [1.0, 0.0, 0.0]\n{camera}\n[image]\nwidth = {side}\nheight = \
                 {side}\n"
            );
            fs::write(folder.join(file), head + &spheres).unwrap();
        };
        scene("w.toml", &[planet, front]);
        scene("a.toml", &[planet]);
        scene("b.toml", &[front]);
        for device in ["cpu", "gpu"] {
            let draw = |scene: &str, more: &[&str]| {
                succeed(folder, &[&["render", scene, "--device", device, "-o"], more].concat());
            };
            draw(
                "w.toml",
                &["w.png", "--ids", "w.npy", "--depth", "wd.npy", "--visibility", "w.npz"],
            );
            draw("a.toml", &["none", "--visibility", "a.npz"]);
            draw("b.toml", &["none", "--visibility", "b.npz", "--first-index", "1"]);
            let outputs =
                ["-o", "m.png", "--ids", "m.npy", "--depth", "md.npy", "--visibility", "m.npz"];
            for parts in [["a.npz", "b.npz"], ["b.npz", "a.npz"]] {
                succeed(folder, &[&["merge"], &parts[..], &outputs].concat());
                for (one, merged) in [
                    ("w.png", "m.png"),
                    ("w.npy", "m.npy"),
                    ("wd.npy", "md.npy"),
                    ("w.npz", "m.npz"),
                ] {
                    let [one, merged] =
                        [one, merged].map(|file| fs::read(folder.join(file)).unwrap());
                    assert!(one == merged, "{name} on {device}: other bytes than one run's");
                }
            }
            let depths = fs::read(folder.join("wd.npy")).unwrap();
            let depths =
                depths[128..].as_chunks::<4>().0.iter().map(|&bytes| f32::from_le_bytes(bytes));
            assert!(depths.clone().all(f32::is_finite), "{name} on {device}: every pixel hits");
            assert_eq!(depths.count(), side * side);
        }
    }
}

/// Bounds hold the truth and are narrow: as wide as the docs say.
#[test]
fn bounds_are_narrow() {
    let folder = tempfile::tempdir().unwrap();
    let mut cpu = Engine::open(&Device::Cpu).unwrap();
    let spheres = [corpus::ball([5.0, 0.0, 0.0], 2.0), corpus::ball([6.0, 1.5, 0.0], 2.5)];
    let scene = corpus::scene(&spheres);
    let look = corpus::Look { at: DVec3::X * 5.0, view: DVec3::X, distance: 5.0, height: 5.0 };
    for (projection, _) in corpus::BOTH {
        let view = View::new(look.camera(projection), corpus::pixels(9, 9));
        let whole = Region::whole(view.image);
        let part = draw_part(folder.path(), &mut cpu, &scene, &view, 0..2, whole);
        let mut hits = 0;
        for (at, (id, [low, high])) in contents(&part).into_iter().enumerate() {
            if id < 0 {
                assert_eq!([low, high], [f64::INFINITY; 2]);
                continue;
            }
            hits += 1;
            let ray = view.ray(at as u32 % 9, at as u32 / 9);
            let sphere = spheres[id as usize];
            let f = sphere.center - ray.origin;
            let (a, b) = (ray.direction.length_squared(), ray.direction.dot(f));
            let t =
                (b - (b * b - a * (f.length_squared() - sphere.radius * sphere.radius)).sqrt()) / a;
            assert!(
                low < t && t < high && high - low < 1e-11 * t,
                "{projection:?}: {low} {t} {high}"
            );
        }
        assert!(hits > 30);
    }
}

// ---- The command line ----

fn run(folder: &Path, args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_planisphere"));
    command.current_dir(folder).args(args).stdin(Stdio::null()).output().expect("the program runs")
}

fn succeed(folder: &Path, args: &[&str]) -> Output {
    let output = run(folder, args);
    assert!(output.status.success(), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
    output
}

fn fail(folder: &Path, args: &[&str], code: i32, words: &[&str]) {
    let output = run(folder, args);
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{args:?}: {message}");
    for word in words {
        assert!(message.contains(word), "{args:?} lacks {word:?}: {message}");
    }
    assert!(output.stdout.is_empty(), "{args:?} wrote to standard output");
}

/// Scene files of runs of spheres, with one camera, from inside a sphere or from before them.
fn scene_file(path: &Path, projection: Projection, origin: DVec3, spheres: &[Sphere]) {
    let mut text = format!(
        "[camera]\nprojection = '{}'\norigin = [{:?}, {:?}, {:?}]\nview = [1, -0.5, 0.25]\nheight \
         = {}\n[image]\nwidth = 96\nheight = 70\nbackground = '#0a141e'\n",
        if projection == Projection::Perspective { "perspective" } else { "orthographic" },
        origin.x,
        origin.y,
        origin.z,
        if projection == Projection::Perspective { 1.0 } else { 7.0 },
    );
    for Sphere { center, radius, color } in spheres {
        let _ = write!(
            text,
            "[[sphere]]\ncenter = [{:?}, {:?}, {:?}]\nradius = {radius:?}\ncolor = {color:?}\n",
            center.x, center.y, center.z
        );
    }
    fs::write(path, text).unwrap();
}

/// Spheres with near ties, exact ties and the same sphere again among those far apart in the list.
fn tricky() -> Vec<Sphere> {
    let mut random = Random::new(5);
    let mut spheres: Vec<Sphere> =
        (0..60).map(|_| corpus::ball(random.ball() * 3.0, random.between(0.2, 0.9))).collect();
    // The same under another index; the same but for one bit; mirrored about the plane that holds
    // the view's line.
    spheres.extend(spheres.clone().iter().rev().take(30));
    for k in 0..30 {
        let mut near = spheres[k];
        near.center.x = f64::from_bits(near.center.x.to_bits() + random.below(3));
        near.radius = f64::from_bits(near.radius.to_bits() + random.below(3));
        near.color[0] ^= 0xff;
        spheres.push(near);
    }
    spheres.push(corpus::ball([0.0, 0.0, 0.0], 40.0));
    spheres.insert(0, corpus::ball([0.0, 0.0, 0.0], 40.0));
    spheres
}

struct Setup {
    folder: tempfile::TempDir,
    spheres: usize,
}

fn setup(projection: Projection, origin: DVec3) -> Setup {
    let folder = tempfile::tempdir().unwrap();
    let spheres = tricky();
    scene_file(&folder.path().join("all.toml"), projection, origin, &spheres);
    for (k, some) in spheres.chunks(spheres.len().div_ceil(4)).enumerate() {
        scene_file(&folder.path().join(format!("part-{k}.toml")), projection, origin, some);
    }
    Setup { folder, spheres: spheres.len() }
}

fn read_all(folder: &Path, names: [&str; 3]) -> Vec<Vec<u8>> {
    names.iter().map(|name| fs::read(folder.join(name)).unwrap()).collect()
}

#[test]
fn four_machines_give_the_files_of_one() {
    let before = DVec3::new(-6.0, 3.0, -1.5);
    for (projection, origin) in [
        (Projection::Orthographic, before),
        (Projection::Perspective, before),
        // Inside the great spheres, and of one of the cloud.
        (Projection::Perspective, DVec3::new(0.1, 0.2, 0.3)),
    ] {
        let Setup { folder, spheres } = setup(projection, origin);
        let folder = folder.path();
        let step = spheres.div_ceil(4);
        succeed(
            folder,
            &["render", "all.toml", "-o", "w.png", "--ids", "wi.npy", "--depth", "wd.npy"],
        );
        let whole = read_all(folder, ["w.png", "wi.npy", "wd.npy"]);
        let regions = ["0,0,50,33", "50,0,46,33", "0,33,50,37", "50,33,46,37"];
        for k in 0..4 {
            let device = if k == 2 { "gpu" } else { "cpu" };
            let (name, first) = (format!("part-{k}.toml"), (k * step).to_string());
            let draw = |scene: &str, out: &str, more: &[&str]| {
                let args = ["render", scene, "-o", "none", "--device", device, "--visibility", out];
                succeed(folder, &[&args, more].concat());
            };
            draw(&name, &format!("s{k}.npz"), &["--first-index", &first]);
            draw("all.toml", &format!("r{k}.npz"), &["--region", regions[k]]);
            draw(&name, &format!("a{k}.npz"), &["--first-index", &first, "--region", "0,0,96,21"]);
        }
        succeed(
            folder,
            &[
                "render",
                "all.toml",
                "-o",
                "none",
                "--visibility",
                "rest.npz",
                "--region",
                "0,21,96,49",
            ],
        );
        let outputs = ["-o", "m.png", "--ids", "mi.npy", "--depth", "md.npy"];
        let check = |parts: &[&str], what: &str| {
            succeed(folder, &[&["merge"], parts, &outputs].concat());
            assert!(
                read_all(folder, ["m.png", "mi.npy", "md.npy"]) == whole,
                "{projection:?} {origin}: {what}"
            );
        };
        check(&["s2.npz", "s0.npz", "s3.npz", "s1.npz"], "parts of the spheres");
        check(&["r3.npz", "r1.npz", "r0.npz", "r2.npz"], "parts of the picture");
        check(&["a3.npz", "rest.npz", "a0.npz", "a1.npz", "a2.npz"], "both");
        for (out, parts) in [("t0.npz", ["s0.npz", "s3.npz"]), ("t1.npz", ["s2.npz", "s1.npz"])] {
            succeed(folder, &[&["merge", "-o", "none", "--visibility", out], &parts[..]].concat());
        }
        check(&["t1.npz", "t0.npz"], "a tree");
        succeed(
            folder,
            &[
                "merge",
                "s0.npz",
                "s1.npz",
                "s2.npz",
                "s3.npz",
                "-o",
                "none",
                "--visibility",
                "all.npz",
            ],
        );
        check(&["all.npz"], "one part that is all");
        // The part that one run writes is the part that is merged.
        succeed(folder, &["render", "all.toml", "-o", "none", "--visibility", "one.npz"]);
        let [one, merged] = ["one.npz", "all.npz"].map(|name| fs::read(folder.join(name)).unwrap());
        assert!(one == merged, "{projection:?} {origin}: merging loses nothing");
        // Part of the picture: as `render --region`.
        let region = ["--region", "40,20,30,40"];
        succeed(
            folder,
            &[
                &["render", "all.toml", "-o", "w.png", "--ids", "wi.npy", "--depth", "wd.npy"][..],
                &region,
            ]
            .concat(),
        );
        let part = read_all(folder, ["w.png", "wi.npy", "wd.npy"]);
        succeed(
            folder,
            &[&["merge", "s0.npz", "s1.npz", "s2.npz", "s3.npz"][..], &outputs, &region].concat(),
        );
        assert!(
            read_all(folder, ["m.png", "mi.npy", "md.npy"]) == part,
            "{projection:?} {origin}: a region"
        );
    }
}

#[test]
fn parts_that_do_not_fit_are_refused() {
    let Setup { folder, spheres } = setup(Projection::Orthographic, DVec3::new(-6.0, 3.0, -1.5));
    let folder = folder.path();
    let step = spheres.div_ceil(4);
    let render = |scene: &str, out: &str, more: &[&str]| {
        let args = ["render", scene, "-o", "none", "--device", "cpu", "--visibility", out];
        succeed(folder, &[&args, more].concat());
    };
    let names: Vec<String> = (0..4).map(|k| format!("s{k}.npz")).collect();
    for k in 0..4 {
        render(&format!("part-{k}.toml"), &names[k], &["--first-index", &(k * step).to_string()]);
    }
    let n: Vec<&str> = names.iter().map(String::as_str).collect();

    // Twice, overlapping, missing, in no part.
    fail(
        folder,
        &["merge", n[0], n[0]],
        2,
        &["s0.npz and s0.npz", &format!("spheres 0 to {}", step - 1), "--first-index"],
    );
    render("part-1.toml", "late.npz", &["--first-index", &(step - 3).to_string()]);
    fail(
        folder,
        &["merge", n[0], "late.npz"],
        2,
        &[&format!("both hold spheres {} to {}", step - 3, step - 1)],
    );
    fail(
        folder,
        &["merge", n[0], n[2], n[3]],
        2,
        &[&format!("no part holds spheres {step} to {}", 2 * step - 1)],
    );
    fail(
        folder,
        &["merge", n[1], n[2], n[3]],
        2,
        &[&format!("no part holds spheres 0 to {}", step - 1)],
    );
    render("all.toml", "top.npz", &["--region", "0,0,96,30"]);
    render("all.toml", "left.npz", &["--region", "0,30,40,40"]);
    fail(folder, &["merge", "top.npz", "left.npz"], 2, &["region 40,30,56,40", "--region"]);
    fail(
        folder,
        &["merge", "top.npz", "left.npz", "-o", "none", "--visibility", "x.npz"],
        2,
        &["region 40,30,56,40"],
    );
    succeed(folder, &["merge", "top.npz", "left.npz", "--region", "10,5,30,60"]);
    render("part-0.toml", "corner.npz", &["--region", "40,30,56,40"]);
    let words = [format!("spheres {step} to {}", spheres - 1), "region 40,30,56,40".into()];
    fail(
        folder,
        &["merge", "top.npz", "left.npz", "corner.npz"],
        2,
        &words.each_ref().map(String::as_str),
    );

    // Other views: each names what differs.
    for (name, more, field) in [
        (
            "size",
            &["--size", "96x71"][..],
            "the size of the image is 96 x 70 in the first, 96 x 71 in the second",
        ),
        ("origin", &[], "the camera's origin"),
        ("near", &[], "near is 0 in the first, 0.5"),
        ("far", &[], "far is inf in the first, 50"),
        ("up", &[], "up is [0, 0, 1]"),
        ("height", &[], "the height of the view is 7"),
        ("background", &[], "the background is #0a141e in the first, #0a141f"),
        ("projection", &[], "the projection is orthographic"),
    ] {
        let text = fs::read_to_string(folder.join("part-1.toml")).unwrap();
        let text = match name {
            "origin" => text.replacen("[-6.0", "[-6.000000000000001", 1),
            "near" => text.replacen("height = 7", "near = 0.5\nheight = 7", 1),
            "far" => text.replacen("height = 7", "far = 50\nheight = 7", 1),
            "up" => text.replacen("height = 7", "up = [0, 0.1, 1]\nheight = 7", 1),
            "height" => text.replacen("height = 7", "height = 7.5", 1),
            "background" => text.replacen("#0a141e", "#0a141f", 1),
            "projection" => text.replacen("orthographic", "perspective", 1),
            _ => text,
        };
        fs::write(folder.join("other.toml"), text).unwrap();
        render("other.toml", "other.npz", &[&["--first-index", "1000"], more].concat());
        fail(folder, &["merge", n[0], "other.npz"], 2, &[field, "s0.npz", "other.npz"]);
    }

    // Not parts, or no longer.
    fail(folder, &["merge"], 2, &["PART"]);
    fail(folder, &["merge", "nothing.npz"], 2, &["nothing.npz: no such file"]);
    fail(folder, &["merge", "all.toml"], 2, &["all.toml", "no part of a picture", "--visibility"]);
    let bytes = fs::read(folder.join("s0.npz")).unwrap();
    for (k, at) in
        [0, 200, bytes.len() / 3, bytes.len() / 2, bytes.len() - 300].into_iter().enumerate()
    {
        let mut flipped = bytes.clone();
        flipped[at] ^= 0x40;
        let name = format!("flipped-{k}.npz");
        fs::write(folder.join(&name), &flipped).unwrap();
        fail(folder, &["merge", &name, n[1], n[2], n[3]], 2, &[&name]);
        fs::write(folder.join("cut.npz"), &bytes[..at]).unwrap();
        fail(folder, &["merge", "cut.npz", n[1], n[2], n[3]], 2, &["cut.npz"]);
        fs::remove_file(folder.join("cut.npz")).unwrap();
    }
    assert!(
        !folder.join("merged.png").exists()
            || fs::metadata(folder.join("merged.png")).unwrap().len() > 0
    );
    fail(folder, &["render", "all.toml", "--first-index", "7"], 2, &["--visibility"]);
    fail(folder, &["merge", n[0], "-o", "x", "--visibility", "x"], 2, &["both write x"]);
    fail(folder, &["merge", n[0], "-o", "none"], 2, &["nothing to do"]);
    fail(folder, &["merge", n[0], "--region", "90,0,7,7"], 2, &["beyond the image of 96 x 70"]);
    fail(folder, &["merge", n[0], "-o", "no/where.png"], 4, &["no folder no"]);
}

#[test]
fn indices_beyond_32_bits_and_parts_of_nothing() {
    let Setup { folder, .. } = setup(Projection::Orthographic, DVec3::new(-6.0, 3.0, -1.5));
    let folder = folder.path();
    let text = fs::read_to_string(folder.join("part-0.toml")).unwrap();
    fs::write(folder.join("empty.toml"), text.split("[[sphere]]").next().unwrap()).unwrap();
    let first = (1u64 << 40).to_string();
    succeed(
        folder,
        &[
            "render",
            "part-0.toml",
            "-o",
            "none",
            "--ids",
            "i.npy",
            "--visibility",
            "far.npz",
            "--first-index",
            &first,
        ],
    );
    succeed(
        folder,
        &["render", "empty.toml", "-o", "none", "--visibility", "empty.npz", "--first-index", "5"],
    );
    // Indices below the first are in no part; the merged part is of what there is.
    fail(
        folder,
        &["merge", "far.npz", "empty.npz"],
        2,
        &["no part holds spheres 0 to 1099511627775"],
    );
    succeed(folder, &["merge", "empty.npz", "far.npz", "-o", "none", "--visibility", "both.npz"]);
    let part = |name: &str| part::part(&folder.join(name)).unwrap();
    let (far, both) = (part("far.npz"), part("both.npz"));
    assert_eq!((far.meta.last(), &far.indices), (both.meta.last(), &both.indices));
    assert!(far.pixels.wide && far.indices.iter().all(|&index| index >= 1 << 40));
    // Nothing but nothing is a picture too.
    succeed(folder, &["merge", "empty.npz", "-o", "m.png"]);
    succeed(folder, &["render", "empty.toml", "-o", "w.png"]);
    assert_eq!(fs::read(folder.join("m.png")).unwrap(), fs::read(folder.join("w.png")).unwrap());
    let parts = [part("empty.npz")];
    assert!(matches!(Merge::new(&[], None), Err(MergeError::Nothing)));
    assert!(
        Merge::new(&parts, None)
            .unwrap()
            .band(parts[0].meta.region)
            .unwrap()
            .ids
            .iter()
            .all(|&id| id == -1)
    );
}

/// The archive is what its description says, array by array, as NumPy writes headers.
#[test]
fn the_archive_is_as_described() {
    let Setup { folder, spheres } = setup(Projection::Perspective, DVec3::new(-6.0, 3.0, -1.5));
    let folder = folder.path();
    succeed(
        folder,
        &["render", "all.toml", "-o", "none", "--ids", "i.npy", "--visibility", "p.npz"],
    );
    let ids = fs::read(folder.join("i.npy")).unwrap();
    let ids: Vec<i32> =
        ids[128..].as_chunks::<4>().0.iter().map(|&b| i32::from_le_bytes(b)).collect();
    let seen: std::collections::BTreeSet<i32> = ids.iter().copied().filter(|&id| id >= 0).collect();
    let m = seen.len();
    let mut archive = zip::ZipArchive::new(fs::File::open(folder.join("p.npz")).unwrap()).unwrap();
    let mut array = |name: &str, descr: &str, shape: &str| {
        let mut file = archive.by_name(&format!("{name}.npy")).unwrap();
        assert_eq!(
            (file.compression(), file.last_modified()),
            (zip::CompressionMethod::Stored, Some(zip::DateTime::default()))
        );
        let mut bytes = Vec::new();
        std::io::Read::read_to_end(&mut file, &mut bytes).unwrap();
        assert!(bytes.starts_with(b"\x93NUMPY\x01\x00"));
        let start = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
        let header = std::str::from_utf8(&bytes[10..start]).unwrap().trim_end().to_owned();
        assert_eq!(
            header,
            format!("{{'descr': {descr}, 'fortran_order': False, 'shape': {shape}, }}"),
            "{name}"
        );
        bytes.split_off(start)
    };
    let pixels = array("pixels", "[('id', '<i4'), ('low', '<f8'), ('high', '<f8')]", "(70, 96)");
    let first: Vec<i32> = pixels
        .as_chunks::<20>()
        .0
        .iter()
        .map(|r| i32::from_le_bytes([r[0], r[1], r[2], r[3]]))
        .collect();
    assert_eq!((pixels.len(), &first), (70 * 96 * 20, &ids));
    let integers = |bytes: Vec<u8>| {
        bytes.as_chunks::<8>().0.iter().map(|&b| i64::from_le_bytes(b)).collect::<Vec<_>>()
    };
    let reals = |bytes: Vec<u8>| {
        bytes.as_chunks::<8>().0.iter().map(|&b| f64::from_le_bytes(b)).collect::<Vec<_>>()
    };
    assert!(
        integers(array("indices", "'<i8'", &format!("({m},)")))
            .into_iter()
            .eq(seen.iter().map(|&id| i64::from(id)))
    );
    let scene = load::load(&folder.join("all.toml")).unwrap().scene;
    let all = |f: &dyn Fn(Sphere) -> Vec<f64>| {
        seen.iter().flat_map(|&id| f(scene.sphere(id as usize).unwrap())).collect::<Vec<_>>()
    };
    assert_eq!(
        reals(array("centers", "'<f8'", &format!("({m}, 3)"))),
        all(&|s| s.center.to_array().to_vec())
    );
    assert_eq!(reals(array("radii", "'<f8'", &format!("({m},)"))), all(&|s| vec![s.radius]));
    assert_eq!(array("colors", "'|u1'", &format!("({m}, 3)")).len(), 3 * m);
    assert_eq!(integers(array("ranges", "'<i8'", "(1, 2)")), [0, spheres as i64]);
    assert_eq!(reals(array("extent", "'<f8'", "(2, 4)"))[7], 40.0);
    assert_eq!(integers(array("image", "'<i8'", "(2,)")), [96, 70]);
    assert_eq!(integers(array("region", "'<i8'", "(4,)")), [0, 0, 96, 70]);
    assert_eq!(array("projection", "'|u1'", "()"), [1]);
    assert_eq!(reals(array("origin", "'<f8'", "(3,)")), [-6.0, 3.0, -1.5]);
    assert_eq!(reals(array("view", "'<f8'", "(3,)")), [1.0, -0.5, 0.25]);
    assert_eq!(reals(array("up", "'<f8'", "(3,)")), [0.0, 0.0, 1.0]);
    let screen = reals(array("screen", "'<f8'", "(2,)"));
    assert!(screen[0].is_nan() && screen[1] == 1.0);
    assert_eq!(reals(array("clip", "'<f8'", "(2,)")), [0.0, f64::INFINITY]);
    assert_eq!(array("background", "'|u1'", "(3,)"), [10, 20, 30]);
    assert_eq!(integers(array("version", "'<i8'", "()")), [1]);
}
