//! `planisphere render`: load, draw, write, report.

use std::{path::Path, time::Instant};

use serde::Serialize;

use super::{
    Failure,
    args::{PictureArgs, RenderRequest, named},
    camera::CameraArgs,
    ends::Ends,
    print,
    progress::Progress,
    reading::ReadingArgs,
    say, sequence, unless_changed,
};
use planisphere_io::{
    load::{Control, Copied, Loaded},
    text,
};
#[cfg(feature = "gpu")]
use planisphere_renderer::PassedOver;
use planisphere_renderer::{
    Camera, Error, Look, Plan, Region, Renderer, Request, Scene,
    files::{Report, Step},
    report::Counts,
};

/// What `--stats` prints. Fields are added, never changed, while `version` is 1.
#[derive(Serialize)]
struct Stats<'a> {
    version: u32,
    scene: String,
    device: String,
    /// Why it was taken.
    device_why: &'a str,
    /// Adapters that were looked at before and not taken.
    passed_over: Vec<Passed<'a>>,
    /// What drew the picture, where that was not the device, and why.
    #[serde(skip_serializing_if = "Option::is_none")]
    drawn_by: Option<&'a str>,
    /// Columns and rows of the whole image.
    image: [u32; 2],
    /// Column, row, width and height of what was drawn.
    region: [u32; 4],
    counts: &'a Counts,
    /// Arrays that could not be used where they lie.
    copied: &'a [Copied],
    milliseconds: Milliseconds,
}

/// An adapter that was not taken.
#[derive(Serialize)]
struct Passed<'a> {
    /// Its name, driver and API.
    adapter: &'a str,
    hardware: bool,
    why: &'a str,
}

/// Wall-clock time of each step. A step that was not needed is 0.
#[derive(Serialize, Default)]
struct Milliseconds {
    /// Scene file and arrays.
    load: f64,
    /// Finding and starting the device.
    open: f64,
    prepare: f64,
    render: f64,
    read_back: f64,
    decide: f64,
    /// Samples to pixels, for looks that are more than colours of ids.
    shade: f64,
    /// The depth plane, and the bounds of the distances that merging needs.
    depth: f64,
    /// Ids to colours to PNG, arrays to bytes.
    encode: f64,
    /// Bytes to files.
    write: f64,
    /// From the start of the program.
    total: f64,
}

/// To the microsecond: more digits would only look precise.
pub(super) fn milliseconds(since: Instant) -> f64 {
    rounded(since.elapsed().as_secs_f64() * 1e3)
}

pub(super) fn rounded(milliseconds: f64) -> f64 {
    (milliseconds * 1e3).round() / 1e3
}

/// Does what was asked; `start` is when the program began.
pub(super) fn run(asked: &RenderRequest, start: Instant) -> Result<(), Failure> {
    if let Some(sequence) = &asked.sequence {
        return sequence::run(asked, sequence);
    }
    let text = if asked.explain { Some("--explain") } else { asked.stats.then_some("--stats") };
    let mut ends = Ends::new(named(&asked.sinks), text);
    ends.reads(&asked.scene);
    asked.reading.others().chain(asked.camera.file()).for_each(|path| ends.reads(path));
    ends.check()?;
    let mut times = Milliseconds::default();

    let step = Instant::now();
    let RenderRequest { scene, picture, reading, camera, .. } = asked;
    let (loaded, request) = Input { scene, picture, reading, camera }.load()?;
    loaded.files.iter().for_each(|path| ends.reads(path));
    ends.check()?;
    say_read(&loaded);
    if !loaded.understood.is_empty() && loaded.look == Look::matte() && picture.look.is_usual() {
        let words = request.drawn_look().words();
        say(&format!("look: {words} (--look and --aa choose another)"));
    }
    times.load = milliseconds(step);

    let (step, progress) = (Instant::now(), Progress::step("starting the device"));
    let renderer = Renderer::open(&asked.picture.device)?;
    drop(progress);
    times.open = milliseconds(step);
    say_device(&renderer);

    let plan = renderer.plan(&request, &asked.sinks);
    if asked.explain {
        return unless_changed(&loaded.watch, || explain(plan, &request, &renderer));
    }
    check_memory(&plan)?;
    let mut progress = None;
    let mut told = |step| {
        // The line of the step before goes first.
        drop(progress.take());
        progress = Some(Progress::step(doing(step)));
    };
    let drawn = || Ok(renderer.render(&request, &asked.sinks, &mut told)?);
    let (staged, report) = unless_changed(&loaded.watch, drawn)?;
    drop(progress);
    times.drew(&report);

    let (step, progress) = (Instant::now(), Progress::step("writing"));
    // Names may have come to lead elsewhere meanwhile.
    ends.check()?;
    staged.commit()?.iter().for_each(|note| say(&format!("note: {note}")));
    drop(progress);
    times.write = milliseconds(step);
    times.total = milliseconds(start);

    if let Some(by) = &report.drawn_by {
        say(&format!("note: drawn {by}"));
    }
    if !report.seen {
        say_unseen(asked, &loaded, &request);
    }
    if asked.stats {
        let [width, height] = request.size();
        let Region { x, y, width: across, height: down } = request.drawn_region();
        let stats = Stats {
            version: 1,
            scene: asked.scene.display().to_string(),
            device: renderer.device().into(),
            device_why: renderer.why(),
            passed_over: passed(&renderer),
            drawn_by: report.drawn_by.as_deref(),
            image: [width, height],
            region: [x, y, across, down],
            counts: &report.counts,
            copied: &loaded.copied,
            milliseconds: times,
        };
        let json = serde_json::to_string(&stats).expect("numbers and strings are always JSON");
        print(&format!("{}\n", text::json(&json)))?;
    }
    Ok(())
}

/// What is drawn, as typed.
pub(super) struct Input<'a> {
    /// Scene file, file of particles, or `-`.
    pub scene: &'a Path,
    /// Which picture of it.
    pub picture: &'a PictureArgs,
    /// How a file of particles is read.
    pub reading: &'a ReadingArgs,
    /// In place of its camera.
    pub camera: &'a CameraArgs,
}

impl Input<'_> {
    /// Reads it, and makes it a request.
    pub fn load(&self) -> Result<(Loaded, Request), Failure> {
        let control = Control::new();
        let progress = Progress::of("loading", &control);
        let by = self.picture.look.outline_by();
        let asked = self.request(self.reading.load(self.scene, by, &control)?, None)?;
        drop(progress);
        Ok(asked)
    }

    /// Makes a request of what was loaded, with its own camera unless one is given.
    pub fn request(
        &self,
        mut loaded: Loaded,
        camera: Option<Camera>,
    ) -> Result<(Loaded, Request), Failure> {
        self.camera.apply(&mut loaded)?;
        if let Some([width, height]) = self.picture.size {
            (loaded.image.width, loaded.image.height) = (width, height);
        }
        let size = [loaded.image.width, loaded.image.height];
        let own = || Camera::try_from(loaded.camera(loaded.image)).map_err(Error::from);
        let camera = camera.map_or_else(own, Ok)?;
        let look = self.picture.look.apply(loaded.look.clone()).map_err(Error::from)?;
        let overlay = self.picture.overlay.of(&loaded)?;
        let mut request = Request::new(&Scene::from(&loaded), camera, size)?;
        request = request.look(look).overlay(overlay);
        if let Some(region) = self.picture.region {
            request = request.region(region_inside(region, size)?)?;
        }
        Ok((loaded, request))
    }
}

/// Says what was understood of files, and what is unusual.
pub(super) fn say_read(loaded: &Loaded) {
    loaded.understood.iter().for_each(|line| say(line));
    loaded.notes.iter().for_each(|note| say(&format!("note: {note}")));
}

/// What a step of drawing is called.
pub(super) fn doing(step: Step) -> &'static str {
    match step {
        Step::Drawing => "drawing",
        Step::Merging => "merging",
        Step::Depths => "working out depths",
        _ => "encoding",
    }
}

impl Milliseconds {
    /// Notes what drawing has taken.
    fn drew(&mut self, Report { times, shade, depth, encode, .. }: &Report) {
        (self.prepare, self.render) = (rounded(times.prepare), rounded(times.render));
        (self.read_back, self.decide) = (rounded(times.read_back), rounded(times.decide));
        (self.depth, self.encode) = (rounded(*depth), rounded(*encode));
        self.shade = rounded(*shade);
    }
}

/// Looks at the spheres, and says what would run.
pub(super) fn explain(plan: Plan, request: &Request, renderer: &Renderer) -> Result<(), Failure> {
    let threads = plan.threads().map_or(String::new(), |count| format!("; {count} threads"));
    let device = device_words(renderer) + &threads;
    let lines = plan.lines(request).into_iter().map(|(topic, words)| match topic {
        "device" => (topic, device.clone()),
        _ => (topic, words),
    });
    let words: String = lines.map(|(topic, words)| format!("{topic:<9}{words}\n")).collect();
    print(&text::lines(&words))
}

/// Refuses, before anything is drawn, what cannot fit.
pub(super) fn check_memory(plan: &Plan) -> Result<(), Failure> {
    match plan.shortage() {
        None => Ok(()),
        Some(shortage) => Err(too_much(shortage, plan.copies_spheres())),
    }
}

/// That a picture does not fit; `copies`: the device keeps a copy of the spheres.
fn too_much([needed, available]: [u64; 2], copies: bool) -> Failure {
    let other = match copies {
        true => "take --device cpu, which keeps no copy of the spheres",
        false => "draw it in parts (--region with --visibility, then `planisphere merge`)",
    };
    Failure::Memory(format!(
        "this picture needs about {} of memory beside the scene, and {} is available; {other}, or \
         free some memory",
        text::bytes(needed),
        text::bytes(available)
    ))
}

/// Says that no sphere is seen, why, and what would help.
fn say_unseen(asked: &RenderRequest, loaded: &Loaded, request: &Request) {
    // All parts of a picture have one camera: to change it for one of them would be no help.
    let advice = match asked.sinks.part {
        Some(_) => None,
        None => request.advice(loaded.wanted.is_some()),
    };
    let advice = advice.map_or(String::new(), |advice| format!("; {advice}"));
    say(&format!("note: nothing is seen: {}{advice}", request.why_empty()));
}

#[cfg(feature = "gpu")]
fn passed(renderer: &Renderer) -> Vec<Passed<'_>> {
    let mut passed = Vec::new();
    for PassedOver { adapter, hardware, why } in renderer.passed_over() {
        passed.push(Passed { adapter, hardware: *hardware, why });
    }
    passed
}

/// Without the GPU device no adapter is looked at.
#[cfg(not(feature = "gpu"))]
fn passed(_: &Renderer) -> Vec<Passed<'_>> {
    Vec::new()
}

/// Which device was taken, and why.
pub(super) fn device_words(renderer: &Renderer) -> String {
    let (device, why) = (renderer.device(), renderer.why());
    match renderer.is_news() {
        true => format!("{device} ({why}; --device chooses another)"),
        false => format!("{device}, {why}"),
    }
}

/// Says which device was taken, where that was not simply asked for.
pub(super) fn say_device(renderer: &Renderer) {
    if renderer.is_news() {
        say(&format!("device: {}", device_words(renderer)));
    }
}

/// The part of the image that was asked for, which must lie inside it.
pub(super) fn region_inside(region: Region, [across, down]: [u32; 2]) -> Result<Region, Failure> {
    let Region { x, y, width, height } = region;
    let inside =
        |from: u32, length: u32, side: u32| from.checked_add(length).is_some_and(|end| end <= side);
    if inside(x, width, across) && inside(y, height, down) {
        return Ok(region);
    }
    Err(Failure::Usage(format!(
        "--region {x},{y},{width},{height} reaches beyond the image of {across} x {down} pixels; \
         make it smaller or set --size"
    )))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_fit_is_refused_with_both_numbers() {
        let failure = too_much([3_200_000_000, 2_048_000_000], true);
        let words = failure.to_string();
        assert!(words.contains("3.2 GB") && words.contains("2.0 GB is available"), "{words}");
        assert!(words.contains("--device cpu") && failure.exit_code() == 2, "{words}");
        assert!(too_much([2, 1], false).to_string().contains("--region"));
    }
}
