//! Every scene of the stress corpus, on every device: each pixel equals the judge's, and pictures
//! that must be the same by the contract (moved, scaled, mirrored, permuted, in parts) are the
//! same, byte for byte. There is no tolerance.
//!
//! `PLANISPHERE_CASE=planet cargo test --release --test exactness` keeps to the scenes whose name
//! contains the word. `PLANISPHERE_SEEDS=1000..50000` chooses the seeds of the fuzz tests.

mod corpus;
mod judge;

use std::{
    fmt::Write,
    sync::{LazyLock, Mutex},
};

use corpus::{Case, random::Random};
use glam::{DVec3, IVec3};
use judge::Judge;
use planisphere_bench::{
    reference,
    scenes::{Kind, Recipe},
};
use planisphere_core::{
    camera::{Camera, ImageSize, Projection, Region, ScreenSize, View},
    cpu::{Cpu, Effort},
    depth::depth_plane,
    scene::{Block, Scene, Sphere},
};
use planisphere_gpu::Effort as GpuEffort;
use planisphere_renderer::{Device, Engine};
use rayon::prelude::*;

/// The corpus with the judge's answers, worked out once.
static TRUTH: LazyLock<Vec<(Case, Vec<i32>)>> = LazyLock::new(|| {
    let word = std::env::var("PLANISPHERE_CASE").unwrap_or_default();
    let cases: Vec<_> =
        corpus::corpus().into_iter().filter(|case| case.name.contains(&word)).collect();
    assert!(!cases.is_empty(), "no scene of the corpus has {word:?} in its name");
    cases
        .into_iter()
        .map(|case| {
            let ids = Judge::new(&case.scene, &case.view).ids(Region::whole(case.view.image));
            (case, ids)
        })
        .collect()
});

/// One test at a time draws, so that the machine is not asked for more than it has.
static TURN: Mutex<()> = Mutex::new(());

/// What draws.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Choice {
    /// The native device.
    Cpu,
    /// The same, and nothing is too small to be sampled, ordered, cut into waves and skipped;
    /// everything is drawn twice.
    Skipping,
    /// Any GPU.
    Gpu,
    /// The same, and no scene is too small to be ordered and skipped.
    GpuSkipping,
}

/// An opened device.
struct Drawer {
    device: Engine,
    twice: bool,
}

/// Opens a device that must be there.
fn open(choice: Choice) -> Drawer {
    let effort = Effort { order: 0, cover: 0, sample: 0, wave: 16, blocks: 0 };
    let device = match choice {
        Choice::Cpu => Engine::open(&Device::Cpu),
        Choice::Skipping => Ok(Engine::Cpu(Box::new(Cpu::with(effort)))),
        Choice::Gpu | Choice::GpuSkipping => Engine::open(&Device::Gpu),
    };
    let mut device = device.unwrap_or_else(|error| {
        panic!(
            "{choice:?}: {error}\nThese tests need both devices; on Debian: apt-get install \
                mesa-vulkan-drivers"
        )
    });
    let native = matches!(device, Engine::Cpu(_));
    assert_eq!(
        native,
        matches!(choice, Choice::Cpu | Choice::Skipping),
        "{choice:?} gave {}",
        device.description()
    );
    if let (Engine::Gpu(hybrid), Choice::GpuSkipping) = (&mut device, choice) {
        let small = GpuEffort { order: 0, cover: 0, few: 0 };
        hybrid.set_effort(small, effort, 0);
    }
    Drawer { device, twice: choice == Choice::Skipping }
}

fn draw(drawer: &mut Drawer, scene: &Scene, view: &View, region: Region, name: &str) -> Vec<i32> {
    // Others may have drawn the scene, and put it into order.
    let scene = &if drawer.twice { scene.fresh() } else { scene.clone() };
    let mut ids = || {
        let drawing = drawer
            .device
            .draw(scene, view, region)
            .unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!((drawing.region, drawing.ids.len()), (region, region.pixels()), "{name}");
        drawing.ids
    };
    let first = ids();
    if !drawer.twice {
        return first;
    }
    let second = ids();
    assert!(first == second, "{name}: the second time, in order, the picture is another");
    first
}

/// Gathers differences, and says them at the end.
struct Report {
    device: String,
    scenes: usize,
    pixels: usize,
    wrong_scenes: usize,
    wrong_pixels: usize,
    text: String,
}

impl Report {
    fn new(Drawer { device, .. }: &Drawer) -> Self {
        Self {
            device: device.description(),
            scenes: 0,
            pixels: 0,
            wrong_scenes: 0,
            wrong_pixels: 0,
            text: String::new(),
        }
    }

    /// Compares two id images; `what` names the scene, its seed and the relation.
    fn compare(&mut self, what: &str, region: Region, want: &[i32], got: &[i32]) {
        assert_eq!((want.len(), got.len()), (region.pixels(), region.pixels()), "{what}");
        self.scenes += 1;
        self.pixels += want.len();
        let wrong: Vec<usize> = (0..want.len()).filter(|&k| want[k] != got[k]).collect();
        if wrong.is_empty() {
            return;
        }
        self.wrong_scenes += 1;
        self.wrong_pixels += wrong.len();
        if self.wrong_scenes > 30 {
            return;
        }
        let missed = wrong.iter().filter(|&&k| got[k] < 0).count();
        let extra = wrong.iter().filter(|&&k| want[k] < 0).count();
        let _ = writeln!(
            self.text,
            "{what}: {} of {} pixels wrong ({missed} missed, {extra} extra, {} swapped)",
            wrong.len(),
            want.len(),
            wrong.len() - missed - extra
        );
        for &k in wrong.iter().take(8) {
            let (column, row) = (
                region.x as usize + k % region.width as usize,
                region.y as usize + k / region.width as usize,
            );
            let _ = writeln!(
                self.text,
                "    column {column}, row {row}: want {}, got {}",
                want[k], got[k]
            );
        }
    }

    fn finish(self) {
        assert!(self.scenes > 0, "nothing was compared");
        println!(
            "{}: {} pictures, {} pixels, all right",
            self.device,
            self.scenes,
            self.pixels - self.wrong_pixels
        );
        assert!(
            self.wrong_pixels == 0,
            "on {}: {} wrong pixels in {} of {} pictures\n{}",
            self.device,
            self.wrong_pixels,
            self.wrong_scenes,
            self.scenes,
            self.text
        );
    }
}

/// Runs `check` over every scene (or every `step`-th) on a device.
fn over_corpus(
    choice: Choice,
    step: usize,
    mut check: impl FnMut(&mut Drawer, &mut Report, &Case, &[i32]),
) {
    let truth = &*TRUTH;
    let _turn = TURN.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    let mut device = open(choice);
    let mut report = Report::new(&device);
    for (case, ids) in truth.iter().step_by(step) {
        check(&mut device, &mut report, case, ids);
    }
    report.finish();
}

/// What the docs of `depth_plane` promise, in units in the last place of the depth.
const DEPTH_BOUND: f64 = 0.51;

/// Whether the depth that is said to be sphere `id`'s is within the bound of the exact one.
fn depth_is_good(judge: &Judge, column: u32, row: u32, id: i32, depth: f32) -> bool {
    match judge.distance(column, row, id) {
        Some(distance) => distance.has_depth(depth, DEPTH_BOUND),
        None => id < 0 && depth == f32::INFINITY,
    }
}

#[test]
fn depths_are_within_half_a_unit() {
    let faults: Vec<String> = TRUTH
        .par_iter()
        .filter_map(|(case, ids)| {
            let region = Region::whole(case.view.image);
            let judge = Judge::new(&case.scene, &case.view);
            let depths = depth_plane(&case.scene, &case.view, region, ids).unwrap();
            let place = |k: usize| (k as u32 % region.width, k as u32 / region.width);
            let wrong: Vec<usize> = (0..ids.len())
                .filter(|&k| !depth_is_good(&judge, place(k).0, place(k).1, ids[k], depths[k]))
                .collect();
            let &k = wrong.first()?;
            let (column, row) = place(k);
            let (name, count, id, depth) = (&case.name, wrong.len(), ids[k], depths[k]);
            Some(format!(
                "{name}: {count} wrong; column {column}, row {row}, sphere {id}: {depth:e}"
            ))
        })
        .collect();
    assert!(faults.is_empty(), "depths too far from the exact ones:\n{}", faults.join("\n"));
}

/// Scenes from all of the range of f64, on all that draws: ids and depths against the judge's.
#[test]
fn extreme_scenes_are_the_judges() {
    let _turn = TURN.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    let mut drawers = [Choice::Cpu, Choice::Skipping, Choice::Gpu, Choice::GpuSkipping].map(open);
    let mut reports = drawers.each_ref().map(Report::new);
    let (mut faults, mut wrong, mut hits) = (Vec::new(), 0, 0);
    for seed in corpus::seeds(0..400) {
        let case = corpus::extreme::extreme(seed);
        let region = Region::whole(case.view.image);
        let judge = Judge::new(&case.scene, &case.view).until_the_last_bit();
        let want = judge.ids(region);
        for (drawer, report) in drawers.iter_mut().zip(&mut reports) {
            let got = draw(drawer, &case.scene, &case.view, region, &case.name);
            report.compare(&case.name, region, &want, &got);
        }
        let depths = depth_plane(&case.scene, &case.view, region, &want).unwrap();
        for (k, (&id, &depth)) in want.iter().zip(&depths).enumerate() {
            let (column, row) = (k as u32 % region.width, k as u32 / region.width);
            hits += usize::from(id >= 0);
            if !depth_is_good(&judge, column, row, id, depth) {
                wrong += 1;
                let words = judge.distance(column, row, id).map(|distance| distance.words());
                faults.push(format!(
                    "{}: column {column}, row {row}, sphere {id}: {depth:e}, not {words:?}",
                    case.name
                ));
            }
        }
    }
    faults.truncate(20);
    println!("{hits} hits");
    assert!(
        faults.is_empty(),
        "{wrong} of {hits} depths are too far from the exact ones:\n{}",
        faults.join("\n")
    );
    reports.into_iter().for_each(Report::finish);
}

// ---- Relations: changes of a scene that leave its picture as it is, or change it in a known way
// ----

/// A changed scene and view, and what that does to the picture.
struct Changed {
    scene: Scene,
    view: View,
    /// Left and right are exchanged.
    mirrored: bool,
}

/// Applies a change to every sphere and the camera, or gives up where a number would be rounded.
fn change(
    case: &Case,
    sphere: impl Fn(Sphere) -> Option<Sphere>,
    camera: impl Fn(Camera) -> Option<Camera>,
    mirrored: bool,
) -> Option<Changed> {
    let spheres = (0..case.scene.len())
        .map(|k| sphere(case.scene.sphere(k).unwrap()))
        .collect::<Option<Vec<_>>>()?;
    let camera = camera(case.view.camera)?;
    camera.check().ok()?;
    let scene = Scene::from_spheres(&spheres).ok()?;
    Some(Changed { scene, view: View::new(camera, case.view.image), mirrored })
}

/// `a + b` when it is a f64.
fn exact_sum(a: f64, b: f64) -> Option<f64> {
    let sum = a + b;
    // The rounding error of a sum (Knuth); it is exact itself.
    let part = sum - a;
    let error = (a - (sum - part)) + (b - part);
    (sum.is_finite() && error == 0.0).then_some(sum)
}

/// `x 2^k` when it is a f64. Two steps, so that the factor is one as well.
fn exact_scale(x: f64, power: i32) -> Option<f64> {
    let (half, rest) = (corpus::two_to(power / 2), corpus::two_to(power - power / 2));
    let y = x * half * rest;
    (y.is_finite() && y / half / rest == x).then_some(y)
}

fn each(v: DVec3, f: impl Fn(f64) -> Option<f64>) -> Option<DVec3> {
    Some(DVec3::new(f(v.x)?, f(v.y)?, f(v.z)?))
}

/// The world and the camera moved by a vector.
fn moved(case: &Case, by: DVec3) -> Option<Changed> {
    let shift = |v: DVec3| {
        Some(DVec3::new(exact_sum(v.x, by.x)?, exact_sum(v.y, by.y)?, exact_sum(v.z, by.z)?))
    };
    change(
        case,
        |s| Some(Sphere { center: shift(s.center)?, ..s }),
        |c| Some(Camera { origin: shift(c.origin)?, ..c }),
        false,
    )
}

/// Everything `2^power` times as large.
fn scaled(case: &Case, power: i32) -> Option<Changed> {
    let f = |x| exact_scale(x, power);
    change(
        case,
        |s| Some(Sphere { center: each(s.center, f)?, radius: f(s.radius)?, ..s }),
        |c| {
            let size = match (c.projection, c.size) {
                // At distance 1: an angle, which stays.
                (Projection::Perspective, size) => size,
                (_, ScreenSize::Width(width)) => ScreenSize::Width(f(width)?),
                (_, ScreenSize::Height(height)) => ScreenSize::Height(f(height)?),
                (_, ScreenSize::Both { width, height }) => {
                    ScreenSize::Both { width: f(width)?, height: f(height)? }
                }
            };
            let far = if c.far.is_finite() { f(c.far)? } else { c.far };
            Some(Camera { origin: each(c.origin, f)?, size, near: f(c.near)?, far, ..c })
        },
        false,
    )
}

/// Axes exchanged and turned round: exact, and a mirror image if the determinant is -1.
fn turned(case: &Case, order: [usize; 3], signs: IVec3) -> Option<Changed> {
    let turn = |v: DVec3| DVec3::new(v[order[0]], v[order[1]], v[order[2]]) * signs.as_dvec3();
    let even = order == [0, 1, 2] || order == [1, 2, 0] || order == [2, 0, 1];
    let mirrored = even != (signs.element_product() > 0);
    change(
        case,
        |s| Some(Sphere { center: turn(s.center), ..s }),
        |c| Some(Camera { origin: turn(c.origin), view: turn(c.view), up: turn(c.up), ..c }),
        mirrored,
    )
}

/// View and up of other lengths.
fn relengthened(case: &Case, view: i32, up: i32) -> Option<Changed> {
    change(
        case,
        Some,
        |c| {
            Some(Camera {
                view: each(c.view, |x| exact_scale(x, view))?,
                up: each(c.up, |x| exact_scale(x, up))?,
                ..c
            })
        },
        false,
    )
}

/// Left and right exchanged.
fn flipped(ids: &[i32], width: u32) -> Vec<i32> {
    ids.chunks(width as usize).flat_map(|row| row.iter().rev().copied()).collect()
}

/// Draws changed scenes and compares them with the judge's answer for the unchanged one.
fn relation(
    choice: Choice,
    step: usize,
    least: usize,
    name: &str,
    changes: impl Fn(&Case) -> Vec<(String, Changed)>,
) {
    let mut compared = 0;
    over_corpus(choice, step, |device, report, case, ids| {
        for (how, changed) in changes(case) {
            let what = format!("{}, {name} {how}", case.name);
            let region = Region::whole(case.view.image);
            let got = draw(device, &changed.scene, &changed.view, region, &what);
            let want = if changed.mirrored { flipped(ids, region.width) } else { ids.to_vec() };
            report.compare(&what, region, &want, &got);
            compared += 1;
        }
    });
    // A relation that no scene can be put to says nothing.
    let all = std::env::var_os("PLANISPHERE_CASE").is_none();
    assert!(!all || compared >= least, "only {compared} pictures could be {name} without rounding");
}

/// Each test for all that draws.
macro_rules! on_all {
    ($($(#[$doc:meta])* $name:ident($choice:ident) $body:block)*) => {
        $($(#[$doc])* fn $name($choice: Choice) $body)*
        mod cpu {
            $(#[test] fn $name() { super::$name(super::Choice::Cpu); })*
        }
        mod skipping {
            $(#[test] fn $name() { super::$name(super::Choice::Skipping); })*
        }
        mod gpu {
            $(#[test] fn $name() { super::$name(super::Choice::Gpu); })*
        }
        mod gpu_skipping {
            $(#[test] fn $name() { super::$name(super::Choice::GpuSkipping); })*
        }
    };
}

on_all! {
    every_pixel_is_the_judges(choice) {
        over_corpus(choice, 1, |device, report, case, ids| {
            let region = Region::whole(case.view.image);
            let got = draw(device, &case.scene, &case.view, region, &case.name);
            report.compare(&case.name, region, ids, &got);
        });
    }

    fuzzed_scenes_are_the_judges(choice) {
        let _turn = TURN.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let mut device = open(choice);
        let mut report = Report::new(&device);
        for seed in corpus::seeds(0..1500) {
            let case = corpus::fuzz::fuzz(seed);
            let region = Region::whole(case.view.image);
            let want = Judge::new(&case.scene, &case.view).ids(region);
            let got = draw(&mut device, &case.scene, &case.view, region, &case.name);
            report.compare(&case.name, region, &want, &got);
        }
        report.finish();
    }

    deep_tiles_are_drawn_to_the_end(choice) {
        // Lists of many slabs, most of them hidden; the reference has no early stop.
        let _turn = TURN.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let mut drawer = open(choice);
        let image = ImageSize { width: 70, height: 70 };
        let region = Region::whole(image);
        for count in [20_000, 200_000] {
            for projection in [Projection::Orthographic, Projection::Perspective] {
                let made = Recipe { projection, ..Recipe::new(Kind::Uniform, count) }.make(image);
                // So near that no background is seen, which would let no tile stop.
                let near = Camera { size: ScreenSize::Width(0.15), ..made.camera };
                let view = View::new(near, image);
                let got = draw(&mut drawer, &made.scene, &view, region, &made.name);
                assert!(count < 100_000 || got.iter().all(|&id| id >= 0), "all is covered");
                let exact = reference::exact(&made.scene, &view, region);
                assert!(got == exact.ids, "{count}, {projection:?}");
                // A large sphere that begins before all others and slopes through them: tiles are
                // covered soon, and what is nearer comes late.
                let bounds = made.scene.bounds();
                let middle = 0.5 * (bounds.min_center + bounds.max_center);
                let aside = DVec3::new(0.3, 1.0, -0.5).cross(made.camera.view).normalize();
                let center = middle + 2.0 * made.camera.view.normalize() + 1.8 * aside;
                let large = Sphere { center, radius: 2.7, color: [0; 3] };
                let blocks = made.scene.blocks().map(|(_, block)| block.clone());
                let blocks = blocks.chain([Block::from_spheres(&[large])]);
                let scene = Scene::new(blocks.collect()).unwrap();
                let view = View::new(made.camera, image);
                let got = draw(&mut drawer, &scene, &view, region, &made.name);
                let seen = got.iter().filter(|&&id| id == count as i32).count();
                assert!((200..4000).contains(&seen), "of the large sphere {seen} pixels are seen");
                assert!(got == reference::exact(&scene, &view, region).ids, "{count}, \
                    {projection:?}, with a large sphere");
            }
        }
    }

    a_region_is_a_part_of_the_whole(choice) {
        let mut random = Random::new(31);
        over_corpus(choice, 2, |device, report, case, ids| {
            let (width, height) = (case.view.image.width, case.view.image.height);
            let mut side = |length: u32| {
                let start = random.below(length.into()) as u32;
                (start, 1 + random.below(u64::from(length - start)) as u32)
            };
            for _ in 0..2 {
                let ((x, w), (y, h)) = (side(width), side(height));
                let region = Region { x, y, width: w, height: h };
                let what = format!("{}, region {x},{y},{w},{h} (seed 31)", case.name);
                let got = draw(device, &case.scene, &case.view, region, &what);
                let want: Vec<i32> = (y..y + h)
                    .flat_map(|row| (x..x + w).map(move |column| (row * width + column) as usize))
                    .map(|k| ids[k])
                    .collect();
                report.compare(&what, region, &want, &got);
            }
        });
    }

    the_same_again_is_the_same(choice) {
        // Other scenes between the two: nothing may be left over from one to the next.
        let mut first = Vec::new();
        over_corpus(choice, 5, |device, report, case, ids| {
            let region = Region::whole(case.view.image);
            first.push(draw(device, &case.scene, &case.view, region, &case.name));
            report.compare(&case.name, region, ids, &first[first.len() - 1]);
        });
        first.reverse();
        over_corpus(choice, 5, |device, report, case, _| {
            let region = Region::whole(case.view.image);
            let want = first.pop().expect("as many again");
            let got = draw(device, &case.scene, &case.view, region, &case.name);
            report.compare(&format!("{}, again", case.name), region, &want, &got);
        });
    }

    moving_the_world_changes_nothing(choice) {
        relation(choice, 1, 60, "moved", |case| {
            // Where the numbers are short, far; where they are long, no farther than is exact.
            [40, 20, 8, 3]
                .into_iter()
                .flat_map(|power| {
                    let by = corpus::two_to(power);
                    [DVec3::new(by, -by, by), DVec3::new(0.0, by, 0.0)].map(move |by| (power, by))
                })
                .filter_map(|(power, by)| {
                    moved(case, by).map(|changed| (format!("by 2^{power}"), changed))
                })
                .take(1)
                .collect()
        });
    }

    scaling_everything_changes_nothing(choice) {
        relation(choice, 3, 200, "scaled", |case| {
            [-400, -70, -1, 1, 64, 400]
                .into_iter()
                .filter_map(|power| {
                    scaled(case, power).map(|changed| (format!("by 2^{power}"), changed))
                })
                .collect()
        });
    }

    turning_the_axes_turns_the_picture(choice) {
        relation(choice, 3, 400, "turned", |case| {
            [([0, 1, 2], [1, -1, 1]), ([1, 2, 0], [1, 1, 1]), ([0, 2, 1], [-1, 1, -1])]
                .into_iter()
                .filter_map(|(order, signs)| {
                    turned(case, order, IVec3::from_array(signs))
                        .map(|changed| (format!("{order:?} {signs:?}"), changed))
                })
                .collect()
        });
    }

    the_length_of_view_and_up_is_nothing(choice) {
        relation(choice, 3, 200, "with axes", |case| {
            [(1, 0), (-300, 300), (500, -3)]
                .into_iter()
                .filter_map(|(view, up)| {
                    relengthened(case, view, up)
                        .map(|changed| (format!("times 2^{view}, 2^{up}"), changed))
                })
                .collect()
        });
    }

    the_order_of_spheres_only_names_them(choice) {
        let mut random = Random::new(37);
        over_corpus(choice, 3, |device, report, case, ids| {
            let len = case.scene.len();
            if len < 2 {
                return;
            }
            // Place k of the new scene holds sphere order[k].
            let mut order: Vec<usize> = (0..len).collect();
            for k in (1..len).rev() {
                order.swap(k, random.below(k as u64 + 1) as usize);
            }
            let spheres: Vec<_> = order.iter().map(|&k| case.scene.sphere(k).unwrap()).collect();
            let permuted = Scene::from_spheres(&spheres).expect("the same spheres");
            let region = Region::whole(case.view.image);
            let what = format!("{}, permuted (seed 37)", case.name);
            let got = draw(device, &permuted, &case.view, region, &what);
            // Where the named sphere differs it must be a tie, which went to the lower index of the
            // new order: the judge knows.
            let mut judge = None;
            let want: Vec<i32> = got
                .iter()
                .zip(ids)
                .enumerate()
                .map(|(k, (&got, &id))| {
                    let back = if got < 0 { -1 } else { order[got as usize] as i32 };
                    if back == id {
                        return got;
                    }
                    let judge = judge.get_or_insert_with(|| Judge::new(&permuted, &case.view));
                    judge.id(k as u32 % region.width, k as u32 / region.width)
                })
                .collect();
            report.compare(&what, region, &want, &got);
        });
    }
}
