//! `planisphere render`: load, draw, write, report.

use std::time::Instant;

use serde::Serialize;

use super::{
    Failure,
    args::RenderRequest,
    ends::Ends,
    explain,
    planes::{self, Indices, Picture, Spent},
    print,
    progress::Progress,
    say, unless_changed,
};
use planisphere_core::{
    camera::{ImageSize, Region, View},
    drawing::{Counts, Times},
    exact::decide::Truth,
    part::Meta,
    text, unseen,
};
use planisphere_io::{
    load::{self, Copied, Loaded},
    output::{self, Staged},
};
use planisphere_renderer::{Device, Engine, Opened, PassedOver};

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
pub(super) fn run(request: &RenderRequest, start: Instant) -> Result<(), Failure> {
    let text = if request.explain { Some("--explain") } else { request.stats.then_some("--stats") };
    let mut ends = Ends::new(request.outputs.named(), text);
    ends.reads(&request.scene);
    ends.check()?;
    let mut times = Milliseconds::default();

    let step = Instant::now();
    let subject = load(request, &mut ends)?;
    times.load = milliseconds(step);
    let Subject { loaded, view, region } = &subject;
    let scene = &loaded.scene;

    let (step, progress) = (Instant::now(), Progress::step("starting the device"));
    let opened = Engine::open_telling(&request.device)?;
    drop(progress);
    times.open = milliseconds(step);
    say_device(&opened, &request.device);
    let device_words = device_words(&opened, &request.device);
    let Opened { mut device, why, passed_over } = opened;

    let facts = explain::facts(request, scene, view, *region, &device, device_words);
    if request.explain {
        return unless_changed(&loaded.watch, || explain::print_lines(&facts, scene, view));
    }
    explain::check_memory(&facts)?;
    let (staged, drawn) = draw(request, &subject, &mut device)?;
    times.drew(&drawn);

    let (step, progress) = (Instant::now(), Progress::step("writing"));
    // Names may have come to lead elsewhere meanwhile.
    ends.check()?;
    output::commit(staged)?.iter().for_each(|note| say(&format!("note: {note}")));
    drop(progress);
    times.write = milliseconds(step);
    times.total = milliseconds(start);

    if !drawn.seen {
        say_unseen(request, &subject);
    }
    if request.stats {
        let stats = Stats {
            version: 1,
            scene: request.scene.display().to_string(),
            device: device.description(),
            device_why: &why,
            passed_over: passed(&passed_over),
            image: [view.image.width, view.image.height],
            region: [region.x, region.y, region.width, region.height],
            counts: &drawn.counts,
            copied: &loaded.copied,
            milliseconds: times,
        };
        let json = serde_json::to_string(&stats).expect("numbers and strings are always JSON");
        print(&format!("{}\n", text::json(&json)))?;
    }
    Ok(())
}

/// What is drawn.
struct Subject {
    loaded: Loaded,
    view: View,
    region: Region,
}

/// Reads the scene, and says what is unusual about it.
fn load(request: &RenderRequest, ends: &mut Ends) -> Result<Subject, Failure> {
    let progress = Progress::step("loading");
    let loaded = load::load(&request.scene)?;
    let image = request.size.unwrap_or(loaded.image);
    let region = region_inside(request.region, image)?;
    let view = View::new(loaded.camera(image), image);
    loaded.files.iter().for_each(|path| ends.reads(path));
    ends.check()?;
    drop(progress);
    loaded.notes.iter().for_each(|note| say(&format!("note: {note}")));
    Ok(Subject { loaded, view, region })
}

/// What drawing has found in all bands, and how long it took.
#[derive(Default)]
struct Drawn {
    counts: Counts,
    times: Times,
    spent: Spent,
    /// Whether any sphere is seen.
    seen: bool,
}

impl Milliseconds {
    /// Notes what drawing has taken.
    fn drew(&mut self, Drawn { times, spent, .. }: &Drawn) {
        (self.prepare, self.render) = (rounded(times.prepare), rounded(times.render));
        (self.read_back, self.decide) = (rounded(times.read_back), rounded(times.decide));
        (self.depth, self.encode) = (rounded(spent.depth), rounded(spent.encode));
    }
}

/// Draws all bands, and encodes what is wanted of them.
fn draw(
    request: &RenderRequest,
    Subject { loaded, view, region }: &Subject,
    device: &mut Engine,
) -> Result<(Vec<Staged>, Drawn), Failure> {
    let scene = &loaded.scene;
    let first = request.first_index;
    let ranges = if scene.is_empty() {
        Vec::new()
    } else {
        std::iter::once(first..first + scene.len() as u64).collect()
    };
    let meta = Meta {
        view: *view,
        region: *region,
        background: loaded.background,
        ranges,
        bounds: (!scene.is_empty()).then(|| scene.bounds()),
    };
    let truth = Truth::new(view, scene.bounds());
    let indices = Indices::From { first };
    let picture = Picture { meta: &meta, scene, truth: &truth, indices, band: planes::BAND };
    let mut drawn = Drawn::default();
    let staged = unless_changed(&loaded.watch, || {
        planes::write(&request.outputs, &picture, &mut drawn.spent, |band| {
            let _progress = Progress::step("drawing");
            let drawing = device.draw(scene, view, band)?;
            if let Some(changed) = loaded.watch.changed() {
                return Err(changed.into());
            }
            // Ends at the first sphere of the first band that has one.
            drawn.seen = drawn.seen || drawing.ids.iter().any(|id| *id >= 0);
            drawn.counts.add(&drawing.counts);
            drawn.times.add(&drawing.times);
            Ok(drawing.ids)
        })
    })?;
    Ok((staged, drawn))
}

/// Says that no sphere is seen, why, and what would help.
fn say_unseen(request: &RenderRequest, Subject { loaded, view, region }: &Subject) {
    let scene = &loaded.scene;
    // All parts of a picture have one camera: to change it for one of them would be no help.
    let advice = match request.outputs.visibility {
        Some(_) => None,
        None => unseen::advice(scene, view, *region, loaded.wanted.is_some()),
    };
    let advice = advice.map_or(String::new(), |advice| format!("; {advice}"));
    say(&format!("note: nothing is seen: {}{advice}", unseen::why(scene, view, *region)));
}

#[cfg(feature = "gpu")]
fn passed<'a>(passed_over: &'a [PassedOver]) -> Vec<Passed<'a>> {
    let passed = |other: &'a PassedOver| {
        let PassedOver { adapter, hardware, why } = other;
        Passed { adapter, hardware: *hardware, why }
    };
    passed_over.iter().map(passed).collect()
}

/// Without the GPU device no adapter is looked at.
#[cfg(not(feature = "gpu"))]
fn passed(_: &[PassedOver]) -> Vec<Passed<'_>> {
    Vec::new()
}

/// Which device was taken, and why.
pub(super) fn device_words(opened: &Opened, choice: &Device) -> String {
    let (device, why) = (opened.device.description(), &opened.why);
    if opened.is_news(choice) {
        format!("{device} ({why}; --device chooses another)")
    } else {
        format!("{device}, {why}")
    }
}

/// Says which device was taken, where that was not simply asked for.
pub(super) fn say_device(opened: &Opened, choice: &Device) {
    if opened.is_news(choice) {
        say(&format!("device: {}", device_words(opened, choice)));
    }
}

/// The part of the image that was asked for, which must lie inside it.
pub(super) fn region_inside(region: Option<Region>, image: ImageSize) -> Result<Region, Failure> {
    let Some(region) = region else { return Ok(Region::whole(image)) };
    let inside =
        |from: u32, length: u32, side: u32| from.checked_add(length).is_some_and(|end| end <= side);
    if inside(region.x, region.width, image.width) && inside(region.y, region.height, image.height)
    {
        return Ok(region);
    }
    let Region { x, y, width, height } = region;
    Err(Failure::Usage(format!(
        "--region {x},{y},{width},{height} reaches beyond the image of {} x {} pixels; make it \
         smaller or set --size",
        image.width, image.height
    )))
}
