//! `bench speed`: how long scenes of every kind and size take on every device, and whether the
//! pictures are right.
//!
//! Whole processes (`render --ids`, arrays in files) and frames inside this process (the first one
//! of a device, the camera moved a little each time, nothing changed), devices and baselines in
//! turn, so that what else the machine does meets all of them. Times are medians with their spread.
//! Every picture is compared with [`super::reference`].

use std::{
    fs, io,
    path::{Path, PathBuf},
    process::Command,
    time::Instant,
};

use serde::{Deserialize, Serialize};

use super::{
    naive,
    process::{self, Cost, cpu_time},
    reference::{self, Reference, Wrong},
    scenes::{Kind, Made, Recipe, moved},
    statistics::Summary,
    table::{Table, count, number},
};
use planisphere_core::{
    camera::{ImageSize, Region, View},
    drawing::{DrawError, Drawing},
    scene::Scene,
};
use planisphere_gpu as gpu;
use planisphere_gpu::naive::Naive;
use planisphere_io::litter;
use planisphere_renderer::{Device, DeviceError, Engine};

/// Why there is no measurement.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    /// No device.
    #[error("{0}")]
    Device(#[from] DeviceError),
    /// A device failed.
    #[error("{0}")]
    Draw(#[from] DrawError),
    /// Files for the processes could not be written, or a process could not be started.
    #[error("{0}")]
    Io(#[from] io::Error),
    /// A process did not do what it should.
    #[error("{command} failed: {errors}")]
    Process {
        /// What was run.
        command: String,
        /// What it said.
        errors: String,
    },
}

/// A device that takes part.
#[derive(Clone, Debug)]
pub struct Contender {
    /// As `--device` takes it.
    pub argument: String,
    /// The same, read.
    pub choice: Device,
    /// The device's own words.
    pub description: String,
}

/// What to measure.
pub struct Settings {
    /// Size of the pictures.
    pub image: ImageSize,
    /// Frames of each kind.
    pub frames: usize,
    /// Runs of a process; 0 for no processes.
    pub runs: usize,
    /// Scenes with more spheres are left out.
    pub most: usize,
    /// A small matrix.
    pub quick: bool,
    /// Whether baselines are measured too.
    pub baselines: bool,
    /// The devices.
    pub devices: Vec<Contender>,
    /// This program, to be run.
    pub program: PathBuf,
}

/// The devices that are there: the CPU, and a GPU if one opens.
pub fn devices() -> Vec<Contender> {
    let mut found: Vec<Contender> = Vec::new();
    for (argument, choice) in [("cpu", Device::Cpu), ("gpu", Device::Gpu)] {
        if let Ok(device) = contender(argument, choice) {
            // What is asked for twice is measured once.
            if found.iter().all(|other| other.description != device.description) {
                found.push(device);
            }
        }
    }
    found
}

/// One device.
///
/// # Errors
/// When it does not open.
pub fn contender(argument: &str, choice: Device) -> Result<Contender, BenchError> {
    let description = Engine::open(&choice)?.description();
    Ok(Contender { argument: argument.into(), choice, description })
}

/// Opens a device, and has it do next to nothing: the bare start-up.
///
/// # Errors
/// When it does not open, or fails.
pub fn open(choice: &Device) -> Result<(), BenchError> {
    if let Engine::Gpu(mut hybrid) = Engine::open(choice)? {
        let gpu = &mut hybrid.gpu;
        let image = ImageSize { width: 8, height: 8 };
        let made = Recipe::new(Kind::Uniform, 1).make(image);
        Naive::new(gpu).draw(gpu, &made.scene, &View::new(made.camera, image))?;
    }
    Ok(())
}

/// Wall time and processor time of several repetitions, in milliseconds.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Timing {
    /// Wall-clock time.
    pub wall: Summary,
    /// Of all threads together, where the system tells.
    pub cpu: Option<Summary>,
}

/// Whole processes.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Processes {
    /// Times.
    pub time: Timing,
    /// Most memory, bytes.
    pub peak: Option<u64>,
    /// Of this, beyond the mapped arrays.
    pub beyond_mapping: Option<u64>,
    /// Wrong pixels of the ids that were written.
    pub wrong: Wrong,
}

/// One scene on one device, or by one baseline.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// The scene in words.
    pub scene: String,
    /// Spheres.
    pub spheres: usize,
    /// Columns and rows.
    pub image: [u32; 2],
    /// `cpu`, `gpu` or the name of a baseline.
    pub device: String,
    /// Whole processes.
    pub process: Option<Processes>,
    /// Opening the device.
    pub open: Option<Timing>,
    /// The first picture of a device.
    pub cold: Option<Timing>,
    /// The camera a little aside each time.
    pub moved: Timing,
    /// The same picture again.
    pub unchanged: Option<Timing>,
    /// Processor time of a moved frame, nanoseconds per pixel.
    pub ns_per_pixel: Option<f64>,
    /// Per sphere of the scene.
    pub ns_per_sphere: Option<f64>,
    /// Per test of a sphere at a pixel.
    pub ns_per_test: Option<f64>,
    /// Tests per pixel of the picture.
    pub tests_per_pixel: Option<f64>,
    /// Spheres that cover a pixel of the picture, on average, hidden or not.
    pub covered_per_pixel: f64,
    /// Memory of the process beyond the mapped arrays and beyond that of an empty scene, per
    /// sphere.
    pub bytes_per_sphere: Option<f64>,
    /// Pixels of all compared frames.
    pub compared: usize,
    /// Wrong ones of them.
    pub wrong: Wrong,
}

/// One of the goals: a figure and its limit.
#[derive(Clone, Debug, Serialize)]
pub struct Check {
    /// What is measured.
    pub what: String,
    /// On which device.
    pub device: String,
    /// The figure.
    pub figure: f64,
    /// What it should not exceed (or, with `at_least`, fall below).
    pub limit: f64,
    /// Whether the limit is from below.
    pub at_least: bool,
    /// Whether it is kept.
    pub kept: bool,
}

/// Everything measured.
#[derive(Debug, Serialize)]
pub struct Report {
    /// Fields are added, never changed, while this is 1.
    pub version: u32,
    /// Circumstances.
    pub conditions: Conditions,
    /// Measurements.
    pub rows: Vec<Row>,
    /// Goals.
    pub checks: Vec<Check>,
}

/// Under which circumstances.
#[derive(Clone, Debug, Serialize)]
pub struct Conditions {
    /// Version of this program.
    pub planisphere: &'static str,
    /// Operating system and processor kind.
    pub system: String,
    /// The processor's name, where the system tells.
    pub processor: Option<String>,
    /// Threads.
    pub threads: usize,
    /// The devices in words.
    pub devices: Vec<String>,
}

impl Conditions {
    /// Of this machine.
    pub fn here(devices: &[Contender]) -> Self {
        let info = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
        let name = info
            .lines()
            .find_map(|line| line.strip_prefix("model name"))
            .and_then(|rest| rest.split(':').nth(1));
        Self {
            planisphere: env!("CARGO_PKG_VERSION"),
            system: format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
            processor: name.map(|name| name.trim().to_owned()),
            threads: rayon::current_num_threads(),
            devices: devices.iter().map(|d| format!("{}: {}", d.argument, d.description)).collect(),
        }
    }

    /// For people.
    pub fn text(&self) -> String {
        let processor = self.processor.as_deref().unwrap_or("processor unknown");
        let first = format!(
            "planisphere {}, {}, {processor}, {} threads",
            self.planisphere, self.system, self.threads
        );
        std::iter::once(first).chain(self.devices.iter().cloned()).map(|line| line + "\n").collect()
    }
}

/// Milliseconds of wall and processor time.
#[derive(Default)]
pub(super) struct Samples {
    pub(super) wall: Vec<f64>,
    pub(super) cpu: Vec<f64>,
}

impl Samples {
    pub(super) fn add<T>(&mut self, work: impl FnOnce() -> T) -> T {
        let (cpu, wall) = (cpu_time(), Instant::now());
        let value = work();
        self.wall.push(wall.elapsed().as_secs_f64() * 1e3);
        if let (Some(before), Some(after)) = (cpu, cpu_time()) {
            self.cpu.push(after - before);
        }
        value
    }

    fn add_cost(&mut self, cost: Cost) {
        self.wall.push(cost.wall);
        self.cpu.extend(cost.cpu);
    }

    pub(super) fn timing(&self) -> Option<Timing> {
        Some(Timing { wall: Summary::of(&self.wall)?, cpu: Summary::of(&self.cpu) })
    }
}

/// What one run of `bench time --json` says.
#[derive(Debug, Serialize, Deserialize)]
pub struct TimedRun {
    /// The cost of the command.
    pub cost: Cost,
    /// Its exit code, if it was not killed.
    pub code: Option<i32>,
    /// What it wrote to standard error.
    pub errors: String,
}

/// Pixels times spheres up to which the naive loop is run: about ten seconds a frame.
const NAIVE: u64 = 11_000_000_000;
/// And in the small matrix.
const NAIVE_QUICK: u64 = 300_000_000;
/// Moved frames of a device are repeated until they take this long together, in milliseconds; see
/// [`MORE`].
const ENOUGH: f64 = 250.0;
/// At most so many times the frames that were asked for are taken.
const MORE: usize = 6;
/// First pictures are taken of so many devices.
const COLD: usize = 3;

/// Measures the matrix.
///
/// # Errors
/// When a device or a process fails.
pub fn matrix(settings: &Settings, say: &mut dyn FnMut(&str)) -> Result<Report, BenchError> {
    let mut bench =
        Bench { settings, empty: vec![None; settings.devices.len()], rows: Vec::new(), say };
    for (recipe, image) in recipes(settings) {
        bench.scene(&recipe.make(image), image)?;
    }
    let report_scenes = bench.report_scenes()?;
    let start_up = bench.start_up()?;
    let rows = bench.rows;
    let mut checks = checks(&rows, settings.image);
    checks.extend(report_scenes);
    checks.extend(start_up);
    Ok(Report { version: 1, conditions: Conditions::here(&settings.devices), rows, checks })
}

/// Measures one scene.
///
/// # Errors
/// When a device or a process fails.
pub fn one(
    settings: &Settings,
    made: &Made,
    say: &mut dyn FnMut(&str),
) -> Result<Report, BenchError> {
    let mut bench =
        Bench { settings, empty: vec![None; settings.devices.len()], rows: Vec::new(), say };
    if settings.runs > 0 {
        bench.scene(&Recipe::new(Kind::Empty, 0).make(settings.image), settings.image)?;
        bench.rows.clear();
    }
    bench.scene(made, settings.image)?;
    Ok(Report {
        version: 1,
        conditions: Conditions::here(&settings.devices),
        rows: bench.rows,
        checks: Vec::new(),
    })
}

/// The matrix: sizes, radii, depths, kinds.
fn recipes(settings: &Settings) -> Vec<(Recipe, ImageSize)> {
    let image = settings.image;
    let mut list = vec![(Recipe::new(Kind::Empty, 0), image)];
    let mut add = |recipe: Recipe| list.push((recipe, image));
    let uniform = |count| Recipe::new(Kind::Uniform, count);
    if settings.quick {
        add(uniform(1_000));
        add(uniform(10_000));
        add(uniform(10_000).of_pixels(4.0));
        add(uniform(10_000).in_perspective());
        for kind in
            Kind::ALL.into_iter().filter(|&kind| kind != Kind::Empty && kind != Kind::Uniform)
        {
            add(Recipe::new(kind, 10_000));
        }
    } else {
        for power in 3..=8 {
            add(uniform(10usize.pow(power)));
        }
        for radius in [0.5, 1.0, 2.0, 4.0, 8.0, 16.0] {
            add(uniform(100_000).of_pixels(radius));
        }
        add(uniform(1_000_000).of_pixels(1.0));
        for layers in [1.0, 4.0, 16.0, 64.0] {
            add(Recipe::layers(4.0, layers, image));
        }
        add(uniform(100_000).in_perspective());
        for kind in
            Kind::ALL.into_iter().filter(|&kind| kind != Kind::Empty && kind != Kind::Uniform)
        {
            for count in [100_000, 1_000_000] {
                // A million spheres over one pixel are decided one after another.
                if kind != Kind::HotPixel || count < 1_000_000 {
                    add(Recipe::new(kind, count));
                }
            }
        }
        list.push((
            uniform(100_000),
            ImageSize { width: 2 * image.width, height: 2 * image.height },
        ));
    }
    list.retain(|(recipe, _)| recipe.count <= settings.most);
    list
}

/// A picture of a scene, from so many steps aside: see [`moved`].
fn aside(made: &Made, image: ImageSize, step: usize) -> View {
    View::new(moved(&made.camera, image, step), image)
}

/// A scene that is measured, and the right ids of its first and last view.
struct Subject<'a> {
    made: &'a Made,
    image: ImageSize,
    region: Region,
    first: Reference,
    last: Reference,
}

impl<'a> Subject<'a> {
    /// A scene of which so many frames are drawn.
    fn new(made: &'a Made, image: ImageSize, frames: usize) -> Self {
        let region = Region::whole(image);
        let exact = |step| reference::exact(&made.scene, &aside(made, image, step), region);
        Self { made, image, region, first: exact(0), last: exact(frames) }
    }

    /// See [`aside`].
    fn view(&self, step: usize) -> View {
        aside(self.made, self.image, step)
    }

    /// Tests of a frame of the naive loop.
    fn naive_work(&self) -> u64 {
        self.made.scene.len() as u64 * self.image.pixels() as u64
    }

    /// Spheres that cover a pixel of the last picture, on average.
    fn covered_per_pixel(&self) -> f64 {
        self.last.covered as f64 / self.image.pixels() as f64
    }

    /// What a naive loop has taken; nothing without frames.
    fn baseline_row(&self, baseline: &Baseline, on: &str) -> Option<Row> {
        let moved = baseline.time.timing()?;
        let (spheres, pixels) = (self.made.scene.len(), self.image.pixels());
        let cpu = moved.cpu.map(|cpu| cpu.median * 1e6);
        Some(Row {
            scene: self.made.name.clone(),
            spheres,
            image: [self.image.width, self.image.height],
            device: format!("naive loop, {on}"),
            process: None,
            open: None,
            cold: None,
            moved,
            unchanged: None,
            ns_per_pixel: cpu.map(|cpu| cpu / pixels as f64),
            ns_per_sphere: cpu.map(|cpu| cpu / spheres as f64),
            ns_per_test: cpu.map(|cpu| cpu / self.naive_work() as f64),
            tests_per_pixel: Some(spheres as f64),
            covered_per_pixel: self.covered_per_pixel(),
            bytes_per_sphere: None,
            compared: pixels,
            wrong: baseline.wrong,
        })
    }
}

/// Who draws the frames of a scene.
struct Entrants {
    devices: Vec<Frames>,
    /// The naive loop on each of the devices.
    plain: Vec<Baseline>,
    /// And in this process.
    naive: Baseline,
}

struct Bench<'a> {
    settings: &'a Settings,
    /// Peak memory of a process that draws nothing, by device.
    empty: Vec<Option<u64>>,
    rows: Vec<Row>,
    say: &'a mut dyn FnMut(&str),
}

impl Bench<'_> {
    fn scene(&mut self, made: &Made, image: ImageSize) -> Result<(), BenchError> {
        (self.say)(&format!(
            "{} spheres, {}, {} x {}",
            count(made.scene.len()),
            made.name,
            image.width,
            image.height
        ));
        let subject = Subject::new(made, image, self.settings.frames);
        let processes = if self.settings.runs > 0 {
            self.processes(made, image, &subject.first.ids)?
        } else {
            Vec::new()
        };

        // Frames, in turn.
        let mut entrants = self.entrants(&subject)?;
        self.moved_frames(&subject, &mut entrants)?;
        self.more_frames(&subject, &mut entrants)?;

        for (k, frames) in entrants.devices.iter().enumerate() {
            let process = processes.get(k).copied();
            if made.scene.is_empty() && frames.moved.timing().is_some() {
                self.empty[k] = process.and_then(|p| p.beyond_mapping);
            }
            self.rows.extend(self.device_row(&subject, k, frames, process));
        }
        let of_devices = entrants
            .plain
            .iter()
            .zip(&self.settings.devices)
            .map(|(baseline, on)| (baseline, on.argument.as_str()));
        let all = of_devices.chain([(&entrants.naive, "cpu")]);
        self.rows.extend(all.filter_map(|(baseline, on)| subject.baseline_row(baseline, on)));
        Ok(())
    }

    /// The devices, each opened some times, with their first pictures.
    fn entrants(&self, subject: &Subject) -> Result<Entrants, BenchError> {
        let &Subject { made, region, .. } = subject;
        let mut devices = Vec::new();
        for contender in &self.settings.devices {
            let mut frames = Frames::default();
            for _ in 0..COLD.min(self.settings.frames) {
                let mut device = frames.open.add(|| Engine::open(&contender.choice))?;
                let view = subject.view(0);
                let scene = made.scene.fresh();
                frames.draw_cold(&mut device, &scene, &view, region, &subject.first.ids)?;
                frames.device = Some((device, scene));
            }
            devices.push(frames);
        }
        let plain = devices.iter().map(|_| Baseline::default()).collect();
        Ok(Entrants { devices, plain, naive: Baseline::default() })
    }

    /// How many frames the naive loop draws: slow ones are not run as often.
    fn naive_frames(&self, subject: &Subject) -> usize {
        let settings = self.settings;
        let limit = if settings.quick { NAIVE_QUICK } else { NAIVE };
        match subject.naive_work() {
            0 => 0,
            _ if !settings.baselines => 0,
            work if work > limit => 0,
            work if work > limit / 5 => settings.frames.min(1),
            _ => settings.frames.min(3),
        }
    }

    /// Frames of the camera a little aside each time, of the devices and, at the end, the
    /// baselines.
    fn moved_frames(&self, subject: &Subject, entrants: &mut Entrants) -> Result<(), BenchError> {
        let &Subject { made, region, .. } = subject;
        let Entrants { devices, plain, naive } = entrants;
        let (asked, naive_frames) = (self.settings.frames, self.naive_frames(subject));
        for step in 1..=asked {
            let view = subject.view(step);
            let exact = (step == asked).then_some(&subject.last.ids[..]);
            for frames in &mut *devices {
                frames.draw_moved(&view, region, exact)?;
            }
            if step + naive_frames > asked {
                let ids = naive.time.add(|| naive::draw(&made.scene, &view, region));
                naive.compare(&ids, exact);
                // On a software device it takes ten times as long: only where a goal asks for it.
                if made.scene.len() > gpu::naive::MOST || made.name != Kind::Uniform.words() {
                    continue;
                }
                for (frames, baseline) in devices.iter_mut().zip(&mut *plain) {
                    baseline.draw(frames, made, &view, exact)?;
                }
            }
        }
        Ok(())
    }

    /// More moved frames of the devices where these are short, and the last one again.
    fn more_frames(&self, subject: &Subject, entrants: &mut Entrants) -> Result<(), BenchError> {
        let &Subject { region, .. } = subject;
        let devices = &mut entrants.devices;
        let asked = self.settings.frames;
        // Frames of about a millisecond scatter: their medians are taken of more.
        let medians = devices
            .iter()
            .filter_map(|frames| frames.moved.timing())
            .map(|moved| moved.wall.median);
        let more = (ENOUGH / medians.fold(0.0, f64::max)).min((MORE * asked) as f64) as usize;
        for step in asked + 1..=more {
            for frames in &mut *devices {
                frames.draw_moved(&subject.view(step), region, None)?;
            }
        }
        for _ in 0..asked {
            for frames in &mut *devices {
                frames.draw_unchanged(&subject.view(asked), region, &subject.last.ids)?;
            }
        }
        Ok(())
    }

    /// What a device has taken; nothing without frames.
    fn device_row(
        &self,
        subject: &Subject,
        k: usize,
        frames: &Frames,
        process: Option<Processes>,
    ) -> Option<Row> {
        let moved = frames.moved.timing()?;
        let (spheres, pixels) = (subject.made.scene.len(), subject.image.pixels() as f64);
        let cpu = moved.cpu.map(|cpu| cpu.median * 1e6);
        let per = |amount: f64| cpu.filter(|_| amount > 0.0).map(|cpu| cpu / amount);
        let beyond = process.and_then(|p| p.beyond_mapping);
        let above_empty =
            beyond.zip(self.empty[k]).map(|(beyond, empty)| beyond as f64 - empty as f64);
        Some(Row {
            scene: subject.made.name.clone(),
            spheres,
            image: [subject.image.width, subject.image.height],
            device: self.settings.devices[k].argument.clone(),
            process,
            open: frames.open.timing(),
            cold: frames.cold.timing(),
            moved,
            unchanged: frames.unchanged.timing(),
            ns_per_pixel: per(pixels),
            ns_per_sphere: per(spheres as f64),
            ns_per_test: per(frames.tests as f64),
            tests_per_pixel: (frames.tests > 0).then(|| frames.tests as f64 / pixels),
            covered_per_pixel: subject.covered_per_pixel(),
            bytes_per_sphere: above_empty
                .filter(|_| spheres >= 10_000)
                .map(|bytes| bytes / spheres as f64),
            compared: frames.compared,
            wrong: frames.wrong,
        })
    }

    /// Whole processes of each device, in turn, after one of each that does not count.
    fn processes(
        &self,
        made: &Made,
        image: ImageSize,
        exact: &[i32],
    ) -> Result<Vec<Processes>, BenchError> {
        let folder = litter::Folder::new()?;
        let (path, mapped) = made.write(folder.path(), image)?;
        let devices = &self.settings.devices;
        let ids = |k: usize| folder.path().join(format!("ids-{k}.npy"));
        let mut samples: Vec<(Samples, Option<u64>)> =
            devices.iter().map(|_| Default::default()).collect();
        for round in 0..=self.settings.runs {
            for (k, device) in devices.iter().enumerate() {
                let ids = ids(k);
                let arguments = [
                    "render".as_ref(),
                    path.as_os_str(),
                    "-o".as_ref(),
                    "none".as_ref(),
                    "--ids".as_ref(),
                    ids.as_os_str(),
                    "--device".as_ref(),
                    device.argument.as_ref(),
                ];
                // A new file: one that replaces another is waited for until it lies on the disk.
                let _ = fs::remove_file(&ids);
                let cost = timed(&self.settings.program, &arguments)?;
                if round > 0 {
                    samples[k].0.add_cost(cost);
                    samples[k].1 = samples[k].1.max(cost.peak);
                }
            }
        }
        let mut list = Vec::new();
        for (k, (samples, peak)) in samples.iter().enumerate() {
            let wrong = Wrong::count(&read_ids(&ids(k), exact.len())?, exact);
            let Some(time) = samples.timing() else { continue };
            list.push(Processes {
                time,
                peak: *peak,
                beyond_mapping: peak.map(|peak| peak.saturating_sub(mapped)),
                wrong,
            });
        }
        Ok(list)
    }

    /// An empty scene against a process that opens the device and has it do next to nothing, in
    /// turn.
    fn start_up(&mut self) -> Result<Vec<Check>, BenchError> {
        let settings = self.settings;
        let mut checks = Vec::new();
        if settings.runs == 0 {
            return Ok(checks);
        }
        let folder = litter::Folder::new()?;
        let (scene, _) = Recipe::new(Kind::Empty, 0)
            .make(settings.image)
            .write(folder.path(), settings.image)?;
        let picture = folder.path().join("out.png");
        for device in settings.devices.iter().filter(|device| device.choice != Device::Cpu) {
            (self.say)(&format!("start-up of {}", device.argument));
            let argument: &std::ffi::OsStr = device.argument.as_ref();
            let bare = ["bench".as_ref(), "open".as_ref(), "--device".as_ref(), argument];
            let full = [
                "render".as_ref(),
                scene.as_os_str(),
                "-o".as_ref(),
                picture.as_os_str(),
                "--device".as_ref(),
                argument,
            ];
            let (mut walls, mut bares) = (Vec::new(), Vec::new());
            for round in 0..=2 * settings.runs {
                let _ = fs::remove_file(&picture);
                let (bare, full) =
                    (timed(&settings.program, &bare)?, timed(&settings.program, &full)?);
                if round > 0 {
                    bares.push(bare.wall);
                    walls.push(full.wall);
                }
            }
            if let Some(ratio) = Summary::of_ratios(&walls, &bares) {
                let what = "empty scene with a PNG over the bare start-up, whole processes";
                checks.push(check(what, &device.argument, ratio.median, 1.15, false));
            }
        }
        Ok(checks)
    }

    /// The four scenes of the report, each as a whole process that writes a PNG on the CPU.
    fn report_scenes(&mut self) -> Result<Vec<Check>, BenchError> {
        let Some(cpu) = self.settings.devices.iter().find(|d| d.choice == Device::Cpu) else {
            return Ok(Vec::new());
        };
        if self.settings.runs == 0 {
            return Ok(Vec::new());
        }
        (self.say)("the report's scenes");
        let folder = litter::Folder::new()?;
        let mut slowest = 0.0f64;
        for text in [
            include_str!("../../../scenes/report/camera-origin.toml"),
            include_str!("../../../scenes/report/camera-moved.toml"),
            include_str!("../../../scenes/report/camera-turned.toml"),
            include_str!("../../../scenes/report/occlusion.toml"),
        ] {
            let (scene, picture) =
                (folder.path().join("scene.toml"), folder.path().join("out.png"));
            fs::write(&scene, text)?;
            let mut walls = Vec::new();
            for round in 0..=self.settings.runs {
                let arguments = [
                    "render".as_ref(),
                    scene.as_os_str(),
                    "-o".as_ref(),
                    picture.as_os_str(),
                    "--device".as_ref(),
                    "cpu".as_ref(),
                ];
                // A new file: one that replaces another is waited for until it lies on the disk.
                let _ = fs::remove_file(&picture);
                let cost = timed(&self.settings.program, &arguments)?;
                if round > 0 {
                    walls.push(cost.wall);
                }
            }
            slowest = slowest.max(Summary::of(&walls).map_or(0.0, |walls| walls.median));
        }
        let what = "the report's scenes, 800 x 800, whole process with a PNG, the slowest, ms";
        Ok(vec![check(what, &cpu.argument, slowest, 20.0, false)])
    }
}

/// Runs this program by way of a small process, whose own memory does not show in the peak.
fn timed(program: &Path, arguments: &[&std::ffi::OsStr]) -> Result<Cost, BenchError> {
    let mut helper = Command::new(program);
    helper.args(["bench", "time", "--json", "--"]).arg(program).args(arguments);
    let ended = process::run(&mut helper)?;
    let failed = |errors: String| BenchError::Process {
        command: format!(
            "{} {}",
            program.display(),
            arguments.join(" ".as_ref()).to_string_lossy()
        ),
        errors,
    };
    if !ended.status.success() {
        return Err(failed(ended.errors));
    }
    let run: TimedRun =
        serde_json::from_str(&ended.output).map_err(|error| failed(error.to_string()))?;
    if run.code == Some(0) { Ok(run.cost) } else { Err(failed(run.errors)) }
}

/// The ids of a file that `render --ids` wrote.
fn read_ids(path: &Path, count: usize) -> io::Result<Vec<i32>> {
    let bytes = fs::read(path)?;
    let start = bytes
        .len()
        .checked_sub(4 * count)
        .ok_or_else(|| io::Error::other("the ids file is too short"))?;
    Ok(bytes[start..].as_chunks::<4>().0.iter().map(|&bytes| i32::from_le_bytes(bytes)).collect())
}

/// The frames of one device.
#[derive(Default)]
struct Frames {
    /// With a scene of its own, of which only this device has found anything.
    device: Option<(Engine, Scene)>,
    open: Samples,
    cold: Samples,
    moved: Samples,
    unchanged: Samples,
    tests: u64,
    wrong: Wrong,
    compared: usize,
}

impl Frames {
    fn compare(&mut self, drawing: &Drawing, exact: &[i32]) {
        let wrong = Wrong::count(&drawing.ids, exact);
        self.wrong.missed += wrong.missed;
        self.wrong.extra += wrong.extra;
        self.wrong.swapped += wrong.swapped;
        self.compared += exact.len();
    }

    fn draw_cold(
        &mut self,
        device: &mut Engine,
        scene: &Scene,
        view: &View,
        region: Region,
        exact: &[i32],
    ) -> Result<(), BenchError> {
        let drawing = self.cold.add(|| device.draw(scene, view, region))?;
        self.compare(&drawing, exact);
        Ok(())
    }

    fn draw_moved(
        &mut self,
        view: &View,
        region: Region,
        exact: Option<&[i32]>,
    ) -> Result<(), BenchError> {
        let Some((device, scene)) = &mut self.device else { return Ok(()) };
        let drawing = self.moved.add(|| device.draw(scene, view, region))?;
        self.tests = drawing.counts.tests;
        if let Some(exact) = exact {
            self.compare(&drawing, exact);
        }
        Ok(())
    }

    fn draw_unchanged(
        &mut self,
        view: &View,
        region: Region,
        exact: &[i32],
    ) -> Result<(), BenchError> {
        let Some((device, scene)) = &mut self.device else { return Ok(()) };
        let drawing = self.unchanged.add(|| device.draw(scene, view, region))?;
        self.compare(&drawing, exact);
        Ok(())
    }
}

/// The frames of a naive loop.
#[derive(Default)]
struct Baseline {
    time: Samples,
    wrong: Wrong,
    plain: Option<Naive>,
}

impl Baseline {
    fn compare(&mut self, ids: &[i32], exact: Option<&[i32]>) {
        if let Some(exact) = exact {
            self.wrong = Wrong::count(ids, exact);
        }
    }

    /// On the same GPU as a device's frames.
    fn draw(
        &mut self,
        frames: &mut Frames,
        made: &Made,
        view: &View,
        exact: Option<&[i32]>,
    ) -> Result<(), BenchError> {
        let Some((Engine::Gpu(hybrid), _)) = &mut frames.device else { return Ok(()) };
        let gpu = &mut hybrid.gpu;
        if self.plain.is_none() {
            let mut naive = Naive::new(gpu);
            // Compiles, and sends the spheres; a small picture, as the loop is slow.
            let small = View::new(view.camera, ImageSize { width: 8, height: 8 });
            naive.draw(gpu, &made.scene, &small)?;
            self.plain = Some(naive);
        }
        let Some(naive) = &mut self.plain else { return Ok(()) };
        let ids = self.time.add(|| naive.draw(gpu, &made.scene, view))?;
        self.compare(&ids, exact);
        Ok(())
    }
}

/// A figure and its limit.
pub(super) fn check(what: &str, device: &str, figure: f64, limit: f64, at_least: bool) -> Check {
    let kept = if at_least { figure >= limit } else { figure <= limit };
    Check { what: what.into(), device: device.into(), figure, limit, at_least, kept }
}

/// The goals that the measured rows tell about.
fn checks(rows: &[Row], image: ImageSize) -> Vec<Check> {
    let mut devices: Vec<&str> =
        rows.iter().filter(|row| row.cold.is_some()).map(|row| row.device.as_str()).collect();
    devices.dedup();
    devices.sort_unstable();
    devices.dedup();
    let size = [image.width, image.height];
    let mut checks = Vec::new();
    for device in devices {
        let goals = Goals { rows, device, size };
        checks.extend(goals.per_sphere());
        checks.extend(goals.per_pixel());
        checks.extend(goals.unseen());
        if device == "cpu" {
            checks.extend(goals.large());
        } else {
            checks.extend(goals.baselines());
            checks.extend(goals.small());
        }
    }
    checks
}

/// What the goals of a device are held against.
struct Goals<'a> {
    rows: &'a [Row],
    device: &'a str,
    /// Columns and rows of the pictures.
    size: [u32; 2],
}

/// Processor time of a moved frame, or wall time where the system does not tell that.
fn frame(row: &Row) -> f64 {
    row.moved.cpu.map_or(row.moved.wall.median, |cpu| cpu.median)
}

/// The same of a whole process.
fn process(row: &Row) -> Option<f64> {
    row.process.map(|p| p.time.cpu.map_or(p.time.wall.median, |cpu| cpu.median))
}

impl<'a> Goals<'a> {
    /// The row of a scene, if it was measured.
    fn find(&self, scene: &str, spheres: usize) -> Option<&'a Row> {
        self.find_on(self.device, scene, spheres, self.size)
    }

    /// The same on another device, or of another size.
    fn find_on(
        &self,
        device: &str,
        scene: &str,
        spheres: usize,
        image: [u32; 2],
    ) -> Option<&'a Row> {
        self.rows.iter().find(|r| {
            r.device == device && r.scene == scene && r.spheres == spheres && r.image == image
        })
    }

    /// Uniform spheres.
    fn uniform(&self, spheres: usize) -> Option<&'a Row> {
        self.find(Kind::Uniform.words(), spheres)
    }

    /// A figure that should not exceed its limit.
    fn at_most(&self, what: &str, figure: f64, limit: f64) -> Check {
        check(what, self.device, figure, limit, false)
    }

    /// A sphere of many takes about as long as one of few.
    fn per_sphere(&self) -> Vec<Check> {
        let mut checks = Vec::new();
        let Some(base) = self.uniform(100_000) else { return checks };
        for power in [6, 7, 8] {
            let count = 10usize.pow(power);
            let Some(row) = self.uniform(count) else { continue };
            let times = count as f64 / 1e5;
            let words = |what| format!("{what}, processor time per sphere: 1e{power} over 1e5");
            let figure = frame(row) / frame(base) / times;
            checks.push(self.at_most(&words("moved frame"), figure, 1.5));
            if let (Some(base), Some(row)) = (process(base), process(row)) {
                checks.push(self.at_most(&words("whole process"), row / base / times, 1.5));
            }
        }
        checks
    }

    /// A pixel of many takes about as long as one of few.
    fn per_pixel(&self) -> Option<Check> {
        let base = self.uniform(100_000)?;
        let large = self.size.map(|side| 2 * side);
        let row = self.find_on(self.device, Kind::Uniform.words(), 100_000, large)?;
        let what = "moved frame, four times the pixels over one, 1e5 spheres";
        Some(self.at_most(what, frame(row) / frame(base), 4.2))
    }

    /// Spheres that are not seen take little time.
    fn unseen(&self) -> Vec<Check> {
        let mut checks = Vec::new();
        for kind in [Kind::MostlyOffScreen, Kind::OffScreen, Kind::MostlyHidden, Kind::Hidden] {
            for count in [100_000, 1_000_000] {
                if let (Some(row), Some(full)) =
                    (self.find(kind.words(), count), self.uniform(count))
                {
                    let what = format!(
                        "moved frame, {} over uniform, {} spheres",
                        kind.words(),
                        self::count(count)
                    );
                    checks.push(self.at_most(&what, frame(row) / frame(full), 0.15));
                }
            }
        }
        checks
    }

    /// Time and memory of processes that draw large scenes.
    fn large(&self) -> Vec<Check> {
        let mut checks = Vec::new();
        for (count, seconds, bytes) in [(10_000_000, 1.0, 600e6), (100_000_000, 10.0, 8e9)] {
            let Some(process) = self.uniform(count).and_then(|row| row.process) else { continue };
            let what = format!("{} spheres, whole process, s", self::count(count));
            checks.push(self.at_most(&what, process.time.wall.median * 1e-3, seconds));
            let memory = if count == 10_000_000 { process.beyond_mapping } else { process.peak };
            if let Some(memory) = memory {
                let what = format!(
                    "{} spheres, memory beyond the mapping (1e8: all of it), MB",
                    self::count(count)
                );
                checks.push(self.at_most(&what, memory as f64 * 1e-6, bytes * 1e-6));
            }
        }
        checks
    }

    /// A GPU is far faster than the naive loop on it.
    fn baselines(&self) -> Vec<Check> {
        let mut checks = Vec::new();
        let baseline = format!("naive loop, {}", self.device);
        for count in [1_000, 10_000] {
            let plain = self.find_on(&baseline, Kind::Uniform.words(), count, self.size);
            if let (Some(row), Some(plain)) = (self.uniform(count), plain) {
                let what =
                    format!("{} spheres, the plain loop over a moved frame", self::count(count));
                checks.push(check(&what, self.device, frame(plain) / frame(row), 10.0, true));
            }
        }
        checks
    }

    /// Processor time of a GPU's frames of many small spheres.
    fn small(&self) -> Vec<Check> {
        let mut checks = Vec::new();
        for (scene, count, limit) in
            [("uniform, 4 px", 100_000, 60.0), ("uniform, 1 px", 1_000_000, 120.0)]
        {
            if let Some(row) = self.find(scene, count) {
                let what =
                    format!("{} spheres, {scene}, moved frame, processor ms", self::count(count));
                checks.push(self.at_most(&what, frame(row), limit));
            }
        }
        checks
    }
}

/// A table of goals; nothing if there are none.
pub(super) fn goals(checks: &[Check]) -> String {
    if checks.is_empty() {
        return String::new();
    }
    let mut table = Table::new(&["figure", "on", "is", "goal", ""]);
    for check in checks {
        table.row(vec![
            check.what.clone(),
            check.device.clone(),
            number(Some(check.figure)),
            format!("{} {}", if check.at_least { ">=" } else { "<=" }, number(Some(check.limit))),
            if check.kept { "kept" } else { "NOT KEPT" }.into(),
        ]);
    }
    format!("\nGoals\n{}", table.text())
}

impl Report {
    /// For people.
    pub fn text(&self) -> String {
        let mut text = self.conditions.text();
        text += "\n\
                 Milliseconds are medians, with the least and the greatest in brackets; cpu is \
                 processor time of all threads.\n\
                 ns are of a moved frame's cpu. Pixels are compared with exact decisions; the \
                 baselines may be wrong, the devices not.\n\
                 \n";
        text += &self.times().text();
        text.push('\n');
        text += &self.costs().text();
        text + &goals(&self.checks)
    }

    /// How long pictures take.
    fn times(&self) -> Table {
        let median = |timing: Option<Timing>| number(timing.map(|t| t.wall.median));
        let cpu = |timing: Option<Timing>| number(timing.and_then(|t| t.cpu).map(|cpu| cpu.median));
        let spread = |timing: Option<Timing>| match timing {
            Some(t) => {
                let [least, greatest] = [t.wall.least, t.wall.greatest].map(|v| number(Some(v)));
                format!("{} ({least}-{greatest})", number(Some(t.wall.median)))
            }
            None => "-".into(),
        };
        let mut table = Table::new(&[
            "scene",
            "spheres",
            "image",
            "on",
            "process ms",
            "cpu",
            "peak MB",
            "first ms",
            "moved ms",
            "cpu",
            "again ms",
        ]);
        for row in &self.rows {
            let process = row.process.map(|p| p.time);
            table.row(vec![
                row.scene.clone(),
                count(row.spheres),
                format!("{}x{}", row.image[0], row.image[1]),
                row.device.clone(),
                spread(process),
                cpu(process),
                number(row.process.and_then(|p| p.peak).map(|peak| peak as f64 * 1e-6)),
                median(row.cold),
                spread(Some(row.moved)),
                cpu(Some(row.moved)),
                median(row.unchanged),
            ]);
        }
        table
    }

    /// What a pixel, a sphere, and a test cost, and how many pixels are wrong.
    fn costs(&self) -> Table {
        let mut table = Table::new(&[
            "scene",
            "spheres",
            "image",
            "on",
            "ns/pixel",
            "ns/sphere",
            "ns/test",
            "tests/pixel",
            "covered/pixel",
            "B/sphere",
            "wrong pixels",
            "of",
        ]);
        for row in &self.rows {
            let wrong = row.wrong.total() + row.process.map_or(0, |p| p.wrong.total());
            table.row(vec![
                row.scene.clone(),
                count(row.spheres),
                format!("{}x{}", row.image[0], row.image[1]),
                row.device.clone(),
                number(row.ns_per_pixel),
                number(row.ns_per_sphere),
                number(row.ns_per_test),
                number(row.tests_per_pixel),
                number(Some(row.covered_per_pixel)),
                number(row.bytes_per_sphere),
                wrong.to_string(),
                row.compared.to_string(),
            ]);
        }
        table
    }

    /// Whether a device (not a baseline) was wrong anywhere.
    pub fn devices_wrong(&self) -> usize {
        let devices = self.rows.iter().filter(|row| row.cold.is_some());
        devices.map(|row| row.wrong.total() + row.process.map_or(0, |p| p.wrong.total())).sum()
    }
}
