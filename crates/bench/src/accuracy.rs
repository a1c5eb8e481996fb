//! `bench accuracy`: how right every way of drawing is, and at what price, on scenes that are easy
//! and scenes that are not.
//!
//! The ways: three inexact formulas in f32 ([`super::methods`]), plain f64 (the CPU device with its
//! bounds switched off), plain f32 on a GPU likewise, each device's filter alone, each device as it
//! is, and exact decisions for everything. All in one run, in turn. Ids are compared with
//! [`super::reference`], depths with the exact distance.

use std::time::{Duration, Instant};

use rayon::prelude::*;
use serde::Serialize;

use super::{
    methods::{self, Formula},
    modes,
    reference::{self, Wrong},
    scenes::{Kind, Made, Recipe, moved},
    speed::{BenchError, Check, Conditions, Contender, Samples, Timing, check},
    statistics::Summary,
    table::{Table, count, number},
};
use glam::DVec3;
use planisphere_core::{
    bins::{Binner, Entry, KeepAll, Workspace, split},
    camera::{Camera, ImageSize, Projection, Region, ScreenSize, View},
    depth,
    drawing::{Counts, Drawing},
    exact::decide::{Tally, Truth},
    ids::{SphereIndex, UNDECIDED},
    project::Projector,
    scene::{Ball, Scene, Sphere},
};
use planisphere_renderer::Engine;

/// What to measure.
pub struct Settings {
    /// Size of the pictures.
    pub image: ImageSize,
    /// Timed pictures of each scene and method, after one that is not; three times as many pairs
    /// for the price, and more where that takes no four seconds.
    pub frames: usize,
    /// Few and small scenes.
    pub quick: bool,
    /// The devices.
    pub devices: Vec<Contender>,
    /// Whether scenes are measured by all methods.
    pub scenes: bool,
    /// Whether the price of exactness is measured too.
    pub price: bool,
}

/// A way of drawing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// The textbook quadratic in f32.
    Textbook,
    /// The report's geometric form in f32.
    Geometric,
    /// The shifted form of Ray Tracing Gems in f32.
    Shifted,
    /// The device without bounds: f64 on the CPU, f32 on a GPU.
    Uncertified,
    /// The device's bounds without decisions.
    FilterOnly,
    /// The device as it is.
    Full,
    /// Exact decisions for all spheres of some pixels.
    Exact,
}

impl Method {
    /// All of them, in the order of the tables.
    pub const ALL: [Self; 7] = [
        Self::Textbook,
        Self::Geometric,
        Self::Shifted,
        Self::Uncertified,
        Self::FilterOnly,
        Self::Full,
        Self::Exact,
    ];

    /// In words.
    pub fn words(self, on_cpu: bool) -> &'static str {
        match self {
            Self::Textbook => "textbook f32",
            Self::Geometric => "geometric f32",
            Self::Shifted => "shifted f32",
            Self::Uncertified if on_cpu => "f64 alone",
            Self::Uncertified => "f32 alone",
            Self::FilterOnly => "filter alone",
            Self::Full => "full chain",
            Self::Exact => "all exact",
        }
    }

    fn runs_on(self, device: &Engine) -> bool {
        matches!(device, Engine::Cpu(_))
            || matches!(self, Self::Uncertified | Self::FilterOnly | Self::Full)
    }
}

/// Where decisions were made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Decided {
    /// By 100 bits.
    pub bits100: usize,
    /// By 128-bit integers.
    pub bits128: usize,
    /// By integers of any size.
    pub big: usize,
}

/// One scene by one method.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// The scene in words.
    pub scene: String,
    /// Spheres.
    pub spheres: usize,
    /// `cpu` or `gpu`.
    pub device: String,
    /// How.
    pub method: Method,
    /// The same in words.
    pub words: &'static str,
    /// Of a picture, or of the pixels that were drawn.
    pub time: Timing,
    /// Pixels that were drawn.
    pub pixels: usize,
    /// Processor time (wall time where the system does not tell it) per pixel, nanoseconds.
    pub ns_per_pixel: f64,
    /// Per test of a sphere at a pixel.
    pub ns_per_test: Option<f64>,
    /// Pixels compared with exact ids.
    pub compared: usize,
    /// Wrong ones.
    pub wrong: Wrong,
    /// Pixels that were left open, by the filter alone; or had to be decided, on a GPU.
    pub open: Option<usize>,
    /// Decisions, by where they were made; on the CPU one is made for each sphere in doubt at a
    /// pixel.
    pub decided: Option<Decided>,
    /// Largest error of a depth at pixels with the right id, in units in the last place of f32.
    pub depth_ulp: Option<f64>,
    /// The same, relative to the depth.
    pub depth_relative: Option<f64>,
    /// Largest distance of a wrongly hit or missed pixel from the sphere's true outline, in pixels.
    pub silhouette: f64,
}

/// Everything measured.
#[derive(Debug, Serialize)]
pub struct Report {
    /// Fields are added, never changed, while this is 1.
    pub version: u32,
    /// Circumstances.
    pub conditions: Conditions,
    /// Columns and rows.
    pub image: [u32; 2],
    /// Measurements.
    pub rows: Vec<Row>,
    /// The devices as they are over the same without bounds, processor time.
    pub price: Vec<Price>,
    /// Goals.
    pub checks: Vec<Check>,
}

/// What exactness costs on a scene.
#[derive(Clone, Debug, Serialize)]
pub struct Price {
    /// The scene in words.
    pub scene: String,
    /// Spheres.
    pub spheres: usize,
    /// `cpu` or `gpu`.
    pub device: String,
    /// Milliseconds of processor time with everything.
    pub full: Summary,
    /// And with bounds and decisions switched off.
    pub uncertified: Summary,
    /// The quotients, picture by picture.
    pub ratio: Summary,
}

/// Pixels that are decided with everything exact.
const SAMPLES: usize = 2048;

/// Measures the built-in scenes.
///
/// # Errors
/// When a device fails.
pub fn all(settings: &Settings, say: &mut dyn FnMut(&str)) -> Result<Report, BenchError> {
    let mut rows = Vec::new();
    for made in subjects(settings).into_iter().filter(|_| settings.scenes) {
        rows.extend(one_scene(settings, &made, say)?);
    }
    let (price, checks) = if settings.price { price(settings, say)? } else { Default::default() };
    Ok(report(settings, rows, price, checks))
}

/// Measures one scene.
///
/// # Errors
/// When a device fails.
pub fn one(
    settings: &Settings,
    made: &Made,
    say: &mut dyn FnMut(&str),
) -> Result<Report, BenchError> {
    let rows = one_scene(settings, made, say)?;
    Ok(report(settings, rows, Vec::new(), Vec::new()))
}

fn report(settings: &Settings, rows: Vec<Row>, price: Vec<Price>, checks: Vec<Check>) -> Report {
    let image = [settings.image.width, settings.image.height];
    Report {
        version: 1,
        conditions: Conditions::here(&settings.devices),
        image,
        rows,
        price,
        checks,
    }
}

/// Spheres of a world and a camera that looks along `view` at `at` from `distance`, and sees
/// `width` there.
fn subject(
    name: &str,
    spheres: &[(DVec3, f64)],
    view: DVec3,
    at: DVec3,
    distance: f64,
    width: f64,
) -> Made {
    let spheres: Vec<Sphere> = spheres
        .iter()
        .map(|&(center, radius)| Sphere { center, radius, color: [200; 3] })
        .collect();
    let scene = Scene::from_spheres(&spheres).expect("what is made here is finite and positive");
    let mut camera = Camera::orthographic(at - distance / view.length() * view, view);
    camera.size = ScreenSize::Width(width);
    Made { name: name.into(), scene, camera }
}

/// A scene, moved along each axis with its camera, in f64.
fn shifted(made: &Made, by: f64, words: &str) -> Made {
    let by = DVec3::splat(by);
    let spheres: Vec<Sphere> = (0..made.scene.len())
        .map(|k| {
            let sphere = made.scene.known(k);
            Sphere { center: sphere.center + by, ..sphere }
        })
        .collect();
    let scene = Scene::from_spheres(&spheres).expect("moved a little");
    let camera = Camera { origin: made.camera.origin + by, ..made.camera };
    Made { name: format!("{}, {words}", made.name), scene, camera }
}

/// The built-in scenes.
fn subjects(settings: &Settings) -> Vec<Made> {
    let image = settings.image;
    let uniform = |count: usize| Recipe::new(Kind::Uniform, count).make(image);
    let of = |kind: Kind, count: usize| Recipe::new(kind, count).make(image);
    let oblique = DVec3::new(-1.0, -1.0, -0.75);
    let random = |index: u64| planisphere_io::make::Random { seed: 7 }.unit(index);
    let spread =
        |index: u64| DVec3::from_array([0, 1, 2].map(|k| f64::from(random(3 * index + k)) - 0.5));
    // Half a thousandth of a pixel either way, when 500 pixels are a radius.
    let close: Vec<_> = (0..200).map(|k| (spread(k) * 2e-6, 1.0)).collect();
    let mut ground = vec![(DVec3::new(0.0, 0.0, -6.4e6), 6.4e6)];
    ground.extend((0..300).map(|k| {
        let place = spread(1000 + k) * DVec3::new(40.0, 40.0, 0.0);
        (place, 0.3 + f64::from(random(k)))
    }));
    let shells: Vec<_> = (0..20)
        .map(|k| (DVec3::splat(1e-5) * spread(k), 1.0 + f64::from(20 - k as u32) * 4e-5))
        .collect();
    let far: Vec<_> = (0..300).map(|k| (spread(2000 + k) * 20.0, 1.0)).collect();
    let wide = 2.0 * f64::from(image.width) / 1000.0;
    let mut list = vec![uniform(1_000)];
    if !settings.quick {
        list.extend([uniform(10_000), uniform(100_000)]);
        list.push(Recipe::new(Kind::Uniform, 10_000).in_perspective().make(image));
    }
    list.push(shifted(&uniform(1_000), 1e3, "moved by 1e3"));
    list.push(shifted(&uniform(if settings.quick { 1_000 } else { 100_000 }), 1e6, "moved by 1e6"));
    list.push(subject("near-coincident, 500 px", &close, oblique, DVec3::ZERO, 10.0, wide));
    let mut lattice = of(Kind::Lattice, if settings.quick { 500 } else { 10_000 });
    let side = lattice.scene.bounds().max_center.x;
    list.push(Made {
        name: "fcc lattice, oblique".into(),
        ..of(Kind::Lattice, lattice.scene.len())
    });
    lattice.name = "fcc lattice along an axis".into();
    lattice.camera = Camera {
        size: ScreenSize::Width(1.25 * side),
        ..Camera::orthographic(DVec3::new(-2.0 * side, 0.5 * side, 0.5 * side), DVec3::X)
    };
    list.push(lattice);
    list.push(of(Kind::Twice, if settings.quick { 1_000 } else { 10_000 }));
    list.push(subject(
        "planet under foot",
        &ground,
        DVec3::new(1.0, 0.5, -0.4),
        DVec3::ZERO,
        60.0,
        50.0,
    ));
    list.push(subject("nested shells", &shells, oblique, DVec3::ZERO, 100.0, 2.2));
    list.push(subject("camera 1e4 radii away", &far, oblique, DVec3::ZERO, 1e4, 30.0));
    if !settings.quick {
        list.push(subject("camera 1e6 radii away", &far, oblique, DVec3::ZERO, 1e6, 30.0));
    }
    list
}

/// What a method has drawn.
struct Answer {
    ids: Vec<i32>,
    depths: Option<Vec<f32>>,
    tests: u64,
    counts: Counts,
}

/// A method on a device, with what it has taken.
struct Entrant {
    method: Method,
    samples: Samples,
}

fn draw(
    device: &mut Engine,
    method: Method,
    made: &Made,
    view: &View,
) -> Result<Answer, BenchError> {
    let (scene, region) = (&made.scene, Region::whole(view.image));
    let inexact = |formula| {
        let drawn = methods::draw(scene, view, formula);
        Answer {
            ids: drawn.ids,
            depths: Some(drawn.depths),
            tests: drawn.tests,
            counts: Counts::default(),
        }
    };
    let drawing: Drawing = match (method, device) {
        (Method::Textbook, _) => return Ok(inexact(Formula::Textbook)),
        (Method::Geometric, _) => return Ok(inexact(Formula::Geometric)),
        (Method::Shifted, _) => return Ok(inexact(Formula::Shifted)),
        (Method::Uncertified, Engine::Cpu(cpu)) => {
            modes::draw_uncertified(cpu, scene, view, region)?
        }
        (Method::FilterOnly, Engine::Cpu(cpu)) => {
            modes::draw_filter_only(cpu, scene, view, region)?
        }
        (Method::Uncertified, Engine::Gpu(hybrid)) => {
            hybrid.gpu.set_certain(false);
            let answer = hybrid.gpu.draw(scene, view, region);
            hybrid.gpu.set_certain(true);
            match answer?.drawing() {
                Some(drawing) => drawing,
                None => hybrid.draw(scene, view, region)?,
            }
        }
        (Method::FilterOnly, Engine::Gpu(hybrid)) => hybrid.gpu.draw_filter(scene, view, region)?,
        (_, device) => device.draw(scene, view, region)?,
    };
    let Drawing { ids, counts, .. } = drawing;
    Ok(Answer { ids, depths: None, tests: counts.tests, counts })
}

fn one_scene(
    settings: &Settings,
    made: &Made,
    say: &mut dyn FnMut(&str),
) -> Result<Vec<Row>, BenchError> {
    let image = settings.image;
    say(&format!("{} spheres, {}", count(made.scene.len()), made.name));
    let view = |step: usize| View::new(moved(&made.camera, image, step), image);
    let first = view(0);
    let region = Region::whole(image);
    let truth = Truth::new(&first, made.scene.bounds());
    let exact = reference::exact(&made.scene, &first, region).ids;
    let judge = Judge::new(made, &first, &truth, &exact);

    let mut devices = Vec::new();
    for contender in &settings.devices {
        let device = Engine::open(&contender.choice)?;
        let methods = Method::ALL
            .into_iter()
            .filter(|&method| method != Method::Exact && method.runs_on(&device));
        let entrants: Vec<Entrant> =
            methods.map(|method| Entrant { method, samples: Samples::default() }).collect();
        devices.push((device, contender, entrants));
    }
    // The first picture warms up, and is the one that is compared.
    let mut rows = Vec::new();
    for (device, contender, entrants) in &mut devices {
        for entrant in entrants.iter() {
            let answer = draw(device, entrant.method, made, &first)?;
            rows.push(judge.row(made, device, &contender.argument, entrant.method, &answer));
        }
    }
    for step in 1..=settings.frames {
        let view = view(step);
        for (device, _, entrants) in &mut devices {
            for entrant in entrants {
                entrant.samples.add(|| draw(device, entrant.method, made, &view))?;
            }
        }
    }
    let samples = devices
        .iter()
        .flat_map(|(_, _, entrants)| entrants)
        .map(|entrant| entrant.samples.timing());
    for (row, time) in rows.iter_mut().zip(samples) {
        let Some(time) = time else { continue };
        row.set_time(time);
    }
    if devices.iter().any(|(device, ..)| matches!(device, Engine::Cpu(_))) {
        let samples = if settings.quick { SAMPLES / 8 } else { SAMPLES };
        rows.push(everything_exact(made, &truth, region, &exact, samples, settings.frames.min(3)));
    }
    Ok(rows)
}

impl Row {
    fn set_time(&mut self, time: Timing) {
        let milliseconds = time.cpu.map_or(time.wall.median, |cpu| cpu.median);
        // What was put there is the number of tests.
        self.ns_per_test =
            self.ns_per_test.filter(|&tests| tests > 0.0).map(|tests| milliseconds * 1e6 / tests);
        self.ns_per_pixel = milliseconds * 1e6 / self.pixels as f64;
        self.time = time;
    }
}

/// Compares with the truth.
struct Judge<'a> {
    scene: &'a Scene,
    view: View,
    exact: &'a [i32],
    /// Exact distances of the exact ids.
    distances: Vec<f64>,
    projector: Projector,
}

impl<'a> Judge<'a> {
    fn new(made: &'a Made, view: &View, truth: &Truth, exact: &'a [i32]) -> Self {
        let region = Region::whole(view.image);
        let distance = |(at, &id): (usize, &i32)| {
            let Ok(index) = usize::try_from(id) else { return f64::INFINITY };
            let (column, row) = (at as u32 % region.width, at as u32 / region.width);
            let pixel = truth.pixel(column, row);
            let hit = pixel.hit(made.scene.known(index).into(), &mut Tally::default());
            hit.map_or(f64::INFINITY, |hit| pixel.distance(&hit))
        };
        let distances = exact.par_iter().enumerate().map(distance).collect();
        Self {
            scene: &made.scene,
            view: *view,
            exact,
            distances,
            projector: Projector::new(truth, region),
        }
    }

    fn row(
        &self,
        made: &Made,
        device: &Engine,
        argument: &str,
        method: Method,
        answer: &Answer,
    ) -> Row {
        let on_cpu = matches!(device, Engine::Cpu(_));
        let depths = match (method, &answer.depths) {
            (_, Some(depths)) => Some(depths.iter().map(|&depth| f64::from(depth)).collect()),
            (Method::Full, _) => {
                let region = Region::whole(self.view.image);
                let plane = depth::depth_plane(self.scene, &self.view, region, &answer.ids)
                    .expect("this view's ids");
                Some(plane.into_iter().map(f64::from).collect())
            }
            // A GPU's depths stay in it.
            _ if on_cpu => Some(self.plain_depths()),
            _ => None,
        };
        let errors = depths.map(|depths| self.depth_errors(&answer.ids, &depths));
        let open = answer.ids.iter().filter(|&&id| id == UNDECIDED).count();
        let Counts { undecided, small, exact, .. } = answer.counts;
        let full = method == Method::Full;
        Row {
            scene: made.name.clone(),
            spheres: self.scene.len(),
            device: argument.into(),
            method,
            words: method.words(on_cpu),
            time: Timing { wall: NONE, cpu: None },
            pixels: self.exact.len(),
            ns_per_pixel: 0.0,
            ns_per_test: Some(answer.tests as f64),
            compared: self.exact.len(),
            wrong: Wrong::count(&answer.ids, self.exact),
            open: match method {
                Method::FilterOnly => Some(open),
                Method::Full if !on_cpu => Some(undecided),
                _ => None,
            },
            decided: (full && on_cpu).then(|| Decided {
                bits100: undecided.saturating_sub(small + exact),
                bits128: small,
                big: exact,
            }),
            depth_ulp: errors.map(|errors| errors[0]),
            depth_relative: errors.map(|errors| errors[1]),
            silhouette: self.silhouette(&answer.ids),
        }
    }

    /// Depths of the exact ids in f64 with no bounds: what the CPU device's loop holds.
    fn plain_depths(&self) -> Vec<f64> {
        let width = self.view.image.width as usize;
        let depth = |(at, &id): (usize, &i32)| {
            let Ok(index) = usize::try_from(id) else { return f64::INFINITY };
            let sphere = self.scene.known(index);
            let s = self.projector.project(sphere.center, sphere.radius);
            let (sx, sy) = (self.projector.columns[at % width], self.projector.rows[at / width]);
            let (b, q, a) = match self.projector.projection {
                Projection::Orthographic => {
                    (s.z, s.r * s.r - (sx - s.x) * (sx - s.x) - (sy - s.y) * (sy - s.y), 1.0)
                }
                Projection::Perspective => {
                    let a = 1.0 + sx * sx + sy * sy;
                    let (n, m) = (s.z * sx - s.x, s.y - s.z * sy);
                    let k = n * sy + m * sx;
                    (s.x * sx + s.y * sy + s.z, a * s.r * s.r - n * n - m * m - k * k, a)
                }
            };
            let root = q.max(0.0).sqrt();
            let near = (b - root) / a;
            (if near >= self.projector.near { near } else { (b + root) / a }) / self.projector.scale
        };
        self.exact.par_iter().enumerate().map(depth).collect()
    }

    /// The largest errors of depths where the id is right: in units in the last place of f32, and
    /// relative.
    fn depth_errors(&self, ids: &[i32], depths: &[f64]) -> [f64; 2] {
        let errors = |at: usize| {
            let (id, truth) = (ids[at], self.distances[at]);
            if id < 0 || id != self.exact[at] || truth == 0.0 || !truth.is_finite() {
                return [0.0; 2];
            }
            let error = (depths[at] - truth).abs();
            let nearest = (truth as f32).abs();
            let unit = f64::from(nearest.next_up()) - f64::from(nearest);
            [error / unit, error / truth.abs()]
        };
        (0..ids.len())
            .into_par_iter()
            .map(errors)
            .reduce(|| [0.0; 2], |a, b| [a[0].max(b[0]), a[1].max(b[1])])
    }

    /// The largest distance, in pixels, of a pixel that was wrongly hit or missed from the outline
    /// of the sphere in question.
    fn silhouette(&self, ids: &[i32]) -> f64 {
        let width = self.view.image.width as usize;
        let pitch = self.view.pitch_x.to_f64()
            * if self.orthographic() { self.projector.scale } else { 1.0 };
        let shift = |at: usize| {
            let (id, truth) = (ids[at], self.exact[at]);
            if id == truth || id == UNDECIDED {
                return 0.0;
            }
            // From the outline outwards, in pixels.
            let beyond = |index: usize| {
                let sphere = self.scene.known(index);
                let s = self.projector.project(sphere.center, sphere.radius);
                let (sx, sy) =
                    (self.projector.columns[at % width], self.projector.rows[at / width]);
                if self.orthographic() {
                    ((sx - s.x).hypot(sy - s.y) - s.r) / pitch
                } else {
                    let (n, m) = (s.z * sx - s.x, s.y - s.z * sy);
                    let apart = ((n * n + m * m + (n * sy + m * sx).powi(2))
                        / (1.0 + sx * sx + sy * sy))
                        .sqrt();
                    (apart - s.r) / (pitch * s.z.abs())
                }
            };
            let extra = usize::try_from(id).map_or(0.0, |index| beyond(index).max(0.0));
            let missed = if id == -1 {
                usize::try_from(truth).map_or(0.0, |index| (-beyond(index)).max(0.0))
            } else {
                0.0
            };
            extra.max(missed)
        };
        (0..ids.len()).into_par_iter().map(shift).reduce(|| 0.0, f64::max)
    }

    fn orthographic(&self) -> bool {
        self.projector.projection == Projection::Orthographic
    }
}

/// Before anything is timed.
const NONE: Summary = Summary { median: 0.0, least: 0.0, greatest: 0.0, runs: 0 };

/// Some pixels, at each of which every sphere whose box holds it is decided exactly.
fn everything_exact(
    made: &Made,
    truth: &Truth,
    region: Region,
    exact: &[i32],
    samples: usize,
    runs: usize,
) -> Row {
    let binner = Binner::new(&made.scene, truth, region, 5);
    let grid = binner.grid;
    let mut workspace = Workspace::<Entry>::default();
    let lists = binner.lists(&mut split(0..made.scene.len()), &KeepAll, usize::MAX, &mut workspace);
    // A stride that shares no factor with the width meets all columns.
    let stride = (exact.len() / samples.min(exact.len())).max(1) | 1;
    let pixels: Vec<usize> = (0..exact.len()).step_by(stride).collect();
    let decide = |&at: &usize| {
        let (column, row) = (at % region.width as usize, at / region.width as usize);
        let tile = (row >> 5) * grid.columns as usize + (column >> 5);
        let (x, y) = ((column & 31) as u8, (row & 31) as u8);
        let inside = |entry: &&Entry| {
            let [left, right, top, bottom] = entry.window;
            (left..=right).contains(&x) && (top..=bottom).contains(&y)
        };
        let (mut tally, mut tests) = (Tally::default(), 0u64);
        let balls = lists.tile(&grid, tile).iter().filter(inside).map(|entry| {
            tests += 1;
            (entry.index, Ball::from(made.scene.known(entry.index.at())))
        });
        let pixel = truth.pixel(column as u32, row as u32);
        let id = pixel.nearest(balls, &mut tally).map_or(-1, SphereIndex::id);
        (id, tally, tests)
    };
    let mut samples = Samples::default();
    let mut answers = Vec::new();
    for _ in 0..runs.max(1) {
        answers = samples.add(|| pixels.par_iter().map(decide).collect());
    }
    let (mut tally, mut tests) = (Tally::default(), 0);
    for &(_, some, more) in &answers {
        tally += some;
        tests += more;
    }
    let ids: Vec<i32> = answers.iter().map(|answer| answer.0).collect();
    let truths: Vec<i32> = pixels.iter().map(|&at| exact[at]).collect();
    let mut row = Row {
        scene: made.name.clone(),
        spheres: made.scene.len(),
        device: "cpu".into(),
        method: Method::Exact,
        words: Method::Exact.words(true),
        time: Timing { wall: NONE, cpu: None },
        pixels: pixels.len(),
        ns_per_pixel: 0.0,
        ns_per_test: Some(tests as f64),
        compared: pixels.len(),
        wrong: Wrong::count(&ids, &truths),
        open: None,
        decided: Some(Decided {
            bits100: (tally.signs - tally.small - tally.big) as usize,
            bits128: tally.small as usize,
            big: tally.big as usize,
        }),
        depth_ulp: None,
        depth_relative: None,
        silhouette: 0.0,
    };
    if let Some(time) = samples.timing() {
        row.set_time(time);
    }
    row
}

/// The price on a scene is measured for as long at least.
const LONG_ENOUGH: Duration = Duration::from_secs(4);

/// What the price is measured on.
struct Subject {
    made: Made,
    image: ImageSize,
    /// The camera moves by multiples of this many steps of [`moved`].
    stride: usize,
    /// Greatest quotient.
    limit: f64,
}

/// Spheres on the integers about the origin. Pixels are a 32nd of a cell: true ties where rays lie
/// in planes of symmetry.
fn cubic(name: &str, side: i32, radius: f64, view: DVec3, image: ImageSize) -> Made {
    let side_of = |k: i32| f64::from(k - side / 2);
    let place = |k: i32| {
        DVec3::new(side_of(k % side), side_of(k / side % side), side_of(k / (side * side)))
    };
    let spheres: Vec<_> = (0..side * side * side).map(|k| (place(k), radius)).collect();
    subject(name, &spheres, view, DVec3::ZERO, 64.0 * view.length(), f64::from(image.width) / 32.0)
}

/// Generic and hard scenes.
fn priced(settings: &Settings) -> Vec<Subject> {
    let image =
        if settings.quick { settings.image } else { ImageSize { width: 1024, height: 1024 } };
    let counts: &[usize] =
        if settings.quick { &[1_000] } else { &[1_000, 10_000, 100_000, 1_000_000] };
    let hard = if settings.quick { 1_000 } else { 100_000 };
    let mut subjects = Vec::new();
    for projection in [Projection::Orthographic, Projection::Perspective] {
        let uniform = counts.iter().map(|&count| (Kind::Uniform, count, 1.05));
        let hard = [Kind::Coincident, Kind::Lattice, Kind::Twice].map(|kind| (kind, hard, 2.0));
        subjects.extend(uniform.chain(hard).map(|(kind, count, limit)| {
            let made = Recipe { projection, ..Recipe::new(kind, count) }.make(image);
            Subject { made, image, stride: 1, limit }
        }));
    }
    // The middles of pixels lie in planes of symmetry, which a camera that moves would leave.
    let odd = ImageSize { width: image.width - 1, height: image.height - 1 };
    let side = if settings.quick { 10 } else { 40 };
    let along = cubic("cubic lattice along an axis", side, 0.7, DVec3::X, odd);
    let oblique = cubic("cubic lattice, oblique", side, 0.7, DVec3::new(2.0, 1.0, 0.0), odd);
    subjects.extend([along, oblique].map(|made| Subject {
        made,
        image: odd,
        stride: 0,
        limit: 2.0,
    }));
    subjects
}

/// The devices as they are against the same without bounds, in turn, on generic and on hard scenes.
fn price(
    settings: &Settings,
    say: &mut dyn FnMut(&str),
) -> Result<(Vec<Price>, Vec<Check>), BenchError> {
    let (mut prices, mut checks) = (Vec::new(), Vec::new());
    for Subject { made, image, stride, limit } in priced(settings) {
        let spheres = made.scene.len();
        say(&format!("price of exactness: {} spheres, {}", count(spheres), made.name));
        for contender in &settings.devices {
            let (mut device, made) = (Engine::open(&contender.choice)?, made.fresh());
            let (mut full, mut plain) = (Samples::default(), Samples::default());
            // The difference is small, so many pairs are measured, and more where pictures are
            // drawn fast. The order within a pair alternates. After the first pairs the same views
            // come again.
            let (least, begin) = (3 * settings.frames, Instant::now());
            let enough =
                |step: usize| step > least && (settings.quick || begin.elapsed() >= LONG_ENOUGH);
            for step in (0..).take_while(|&step| !enough(step)) {
                let view =
                    View::new(moved(&made.camera, image, stride * (step % (least + 1))), image);
                let mut warm = (Samples::default(), Samples::default());
                let (full, plain) =
                    if step == 0 { (&mut warm.0, &mut warm.1) } else { (&mut full, &mut plain) };
                for turn in 0..2 {
                    let (method, samples) = if (step + turn) % 2 == 0 {
                        (Method::Full, &mut *full)
                    } else {
                        (Method::Uncertified, &mut *plain)
                    };
                    samples.add(|| draw(&mut device, method, &made, &view))?;
                }
            }
            let [full, plain] = [full, plain]
                .map(|samples| if samples.cpu.is_empty() { samples.wall } else { samples.cpu });
            let (Some(ratio), Some(of_full), Some(of_plain)) =
                (Summary::of_ratios(&full, &plain), Summary::of(&full), Summary::of(&plain))
            else {
                continue;
            };
            let what = format!(
                "{} spheres, {}: full chain over bounds switched off",
                count(spheres),
                made.name
            );
            // The goals are for full size.
            if !settings.quick {
                checks.push(check(&what, &contender.argument, ratio.median, limit, false));
            }
            prices.push(Price {
                scene: made.name.clone(),
                spheres,
                device: contender.argument.clone(),
                full: of_full,
                uncertified: of_plain,
                ratio,
            });
        }
    }
    Ok((prices, checks))
}

impl Report {
    /// For people.
    pub fn text(&self) -> String {
        let mut text = self.conditions.text();
        if !self.rows.is_empty() {
            text += &format!(
                "{} x {} pixels. Milliseconds are of a picture (all exact: of the pixels told in \
                 brackets); cpu is processor time of all threads,\n\
                 and what ns are of. Depths: the largest error at pixels with the right id, in \
                 f32 units in the last place (ulp) and relative.\n\
                 Outline: the largest distance of a wrong hit or miss from the true outline. \
                 Open: pixels that the filter leaves to be decided.\n\
                 Decided: by 100 bits / 128-bit integers / integers of any size.\n",
                self.image[0], self.image[1]
            );
        }
        let mut rows = &self.rows[..];
        while let Some(first) = rows.first() {
            let same = rows
                .iter()
                .take_while(|row| row.scene == first.scene && row.spheres == first.spheres)
                .count();
            text += &format!("\n{} spheres, {}\n", count(first.spheres), first.scene);
            text += &self.methods(&rows[..same]).text();
            rows = &rows[same..];
        }
        if !self.price.is_empty() {
            text += "\nThe price of exactness, 1024 x 1024 pixels (--quick: the size above; cubic \
                     lattices: one less): processor ms with everything, and\nwith bounds and \
                     decisions switched off, in turn\n";
            text += &self.prices().text();
        }
        text + &super::speed::goals(&self.checks)
    }

    /// The methods on one scene.
    fn methods(&self, rows: &[Row]) -> Table {
        let mut table = Table::new(&[
            "method",
            "on",
            "ms",
            "cpu",
            "ns/pixel",
            "ns/test",
            "missed",
            "extra",
            "swapped",
            "depth ulp",
            "relative",
            "outline px",
            "open",
            "decided",
        ]);
        for row in rows {
            let all = row.pixels == self.image[0] as usize * self.image[1] as usize;
            let [low, high] =
                [row.time.wall.least, row.time.wall.greatest].map(|v| number(Some(v)));
            table.row(vec![
                if all { row.words.into() } else { format!("{} ({} px)", row.words, row.pixels) },
                row.device.clone(),
                format!("{} ({low}-{high})", number(Some(row.time.wall.median))),
                number(row.time.cpu.map(|cpu| cpu.median)),
                number(Some(row.ns_per_pixel)),
                number(row.ns_per_test),
                row.wrong.missed.to_string(),
                row.wrong.extra.to_string(),
                row.wrong.swapped.to_string(),
                number(row.depth_ulp),
                number(row.depth_relative),
                number(Some(row.silhouette)),
                row.open.map_or("-".into(), |open| open.to_string()),
                row.decided
                    .map_or("-".into(), |d| format!("{} / {} / {}", d.bits100, d.bits128, d.big)),
            ]);
        }
        table
    }

    /// What exactness costs.
    fn prices(&self) -> Table {
        let mut table = Table::new(&[
            "scene", "spheres", "on", "full", "off", "ratio", "least", "greatest", "runs",
        ]);
        for price in &self.price {
            table.row(vec![
                price.scene.clone(),
                count(price.spheres),
                price.device.clone(),
                number(Some(price.full.median)),
                number(Some(price.uncertified.median)),
                number(Some(price.ratio.median)),
                number(Some(price.ratio.least)),
                number(Some(price.ratio.greatest)),
                price.ratio.runs.to_string(),
            ]);
        }
        table
    }

    /// Wrong pixels where none may be: by the filter alone, the full chain and exact decisions.
    pub fn certain_wrong(&self) -> usize {
        let certain =
            |row: &&Row| matches!(row.method, Method::FilterOnly | Method::Full | Method::Exact);
        self.rows.iter().filter(certain).map(|row| row.wrong.total()).sum()
    }
}
