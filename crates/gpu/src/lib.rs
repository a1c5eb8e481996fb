//! The GPU device: spheres stay on it from picture to picture; the host makes tile lists, the
//! device filters, the host decides what is left over. It executes what [`crate::plan`] lays out.
//!
//! A [`Gpu`] is a workspace on an opened device: it draws one picture at a time. [`Gpu::beside`]
//! gives another on the same device, for another thread.
//!
//! * [`adapters`]: which devices there are, which one is taken, and what to install when there is
//!   none.
//! * `shared`: the device itself, and what else all workspaces share; `kept`: the scenes that stay
//!   on it; `upload`: how they come there; `pipeline`: kernels.
//! * `lists`: tile lists, made on the host.
//! * `execute`: uploads, dispatches, ids back; `memory`: buffers that are used again.
//! * `decide`: what the filter leaves over.
//! * [`naive`]: a baseline for `bench`.

#![cfg_attr(not(test), warn(clippy::print_stdout, clippy::print_stderr))]
#![warn(missing_debug_implementations)]

pub mod adapters;
mod decide;
mod execute;
mod kept;
pub mod lists;
mod memory;
#[cfg(feature = "baselines")]
pub mod naive;
mod pipeline;
pub mod plan;
mod shared;
mod upload;

use std::{
    fmt,
    ops::Range,
    sync::{Arc, atomic::Ordering},
    time::Instant,
};

use crate::plan::{Band, Eye, Limits, TILE};
use adapters::{AdapterChoice, NoAdapter, PassedOver};
use decide::{Among, AtOnce, Done, LeftOver, Undecided};
use execute::{Answers, Executor, Pixels, Work};
use kept::{Chunk, Layout, Uploaded};
pub use kept::{KEPT, SCENES};
use lists::{Spheres, These, Uncovered, Wave};
use planisphere_core::{
    bins::{Keep, KeepAll},
    camera::{Region, View},
    cover::Cover,
    drawing::{Control, DrawError, Drawing, Met},
    exact::decide::{Tally, Truth},
    host::Host,
    ids::{NONE, Slot, SortedIndex, TileIndex, UNDECIDED},
    order::Ordered,
    pool,
    project::Projector,
    scene::Scene,
};
use planisphere_shaders::{FEW, Lanes};
use shared::{Failure, Shared};
use upload::Upload;
/// The wgpu whose devices [`Gpu::from_wgpu`] takes.
pub use wgpu;

/// If more than one pixel in this many is undecided, drawing the band on the CPU is faster than
/// resolving it pixel by pixel.
const HOPELESS: usize = 8;

/// Where the upload of a scene ends, of a drawing that begins with one: for progress alone.
const SENT: f32 = 0.3;
/// Where the filter ends, of a band.
const FILTERED: f32 = 0.7;
/// Where ids are back, of a band.
const BACK: f32 = 0.9;

/// A workspace on an opened GPU: draws one picture at a time. Its device, kernels and uploaded
/// scenes are shared with all workspaces [beside](Gpu::beside) it, which may draw at the same time.
pub struct Gpu {
    shared: Arc<Shared>,
    executor: Executor,
    /// Those of the device, or smaller ones.
    limits: Limits,
    /// Spheres in one buffer.
    chunk: usize,
    /// See [`Gpu::ordered`].
    ordered: Option<Arc<Ordered>>,
    wave: Wave,
    effort: Effort,
    control: Control,
    host: Host,
    /// Memory for the next ids.
    lent: Vec<i32>,
}

impl fmt::Debug for Gpu {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (sent, dispatches) = self.activity();
        let (scenes, bytes) = self.shared.kept.size();
        f.debug_struct("Gpu")
            .field("device", &self.description())
            .field("lanes", &self.executor.lanes)
            .field("chunk", &self.chunk)
            .field("limits", &self.limits)
            .field("effort", &self.effort)
            .field("scenes", &scenes)
            .field("bytes", &bytes)
            .field("sent", &sent)
            .field("dispatches", &dispatches)
            .field("fault", &self.shared.fault())
            .finish_non_exhaustive()
    }
}

/// From how many spheres on (or tiles) work is done that saves more of it later. Pictures do not
/// depend on it.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// A scene is put in order.
    pub order: usize,
    /// It is found out what large spheres hide.
    pub cover: usize,
    /// Tiles with short lists have a kernel of their own on a device that draws again.
    pub few: usize,
}

impl Default for Effort {
    fn default() -> Self {
        Self { order: 1 << 15, cover: 1 << 12, few: 512 }
    }
}

/// What came of a picture.
#[derive(Debug)]
#[expect(clippy::large_enum_variant, reason = "there is one for each picture")]
pub enum Answer {
    /// It was drawn, but for these regions, of which a good part was left over by the filter: their
    /// ids are not settled, and the native device draws them sooner than they could be decided.
    Drawn(Drawing, Vec<Region>),
    /// The device's numbers cannot hold the scene or the view.
    Unfit,
}

impl Answer {
    /// The drawing, if the device could draw one.
    pub fn drawing(self) -> Option<Drawing> {
        match self {
            Self::Drawn(drawing, _) => Some(drawing),
            Self::Unfit => None,
        }
    }
}

/// One picture, or a band of it.
#[derive(Clone, Copy)]
struct Job<'a> {
    spheres: Spheres<'a>,
    eye: &'a Eye,
    chunks: &'a [Chunk],
    /// See [`Uploaded::large`].
    large: &'a [Option<SortedIndex>],
    /// Ends it, and is told how far it is.
    control: &'a Control,
}

/// A band whose kernels have run.
struct Filtered {
    region: Region,
    band: Band,
    /// The tile of each slot of the id buffer. If tiles take several passes, slot n is that of tile
    /// n, and these are the tiles that were drawn.
    slots: Vec<TileIndex>,
    /// Whether each tile was drawn in one pass.
    single: bool,
    /// Batches of lists that were made.
    waves: usize,
    /// Of the last of them.
    projector: Option<Projector>,
    met: Met,
    /// For each tile, the id where nothing is found.
    backgrounds: Vec<i32>,
}

impl Filtered {
    /// Nothing has run yet.
    fn new(region: Region) -> Self {
        let band = Band::new(region);
        let backgrounds = vec![NONE; band.tiles()];
        let (slots, met) = (Vec::new(), Met::default());
        Self { region, band, slots, single: true, waves: 0, projector: None, met, backgrounds }
    }

    /// The projector of the lists, if they are still there: those of several waves are gone.
    fn lists_projector(&self) -> Option<&Projector> {
        self.projector.as_ref().filter(|_| self.waves == 1)
    }

    /// Slots of the id buffer that are in use.
    fn slots_in_use(&self) -> usize {
        match (self.single, self.slots.is_empty()) {
            (_, true) => 0,
            (true, false) => self.slots.len(),
            (false, false) => self.band.tiles(),
        }
    }

    /// For each tile its slot, or what stands for one.
    fn slot_of(&self) -> Vec<Slot> {
        let mut slot_of = vec![Slot::BACKGROUND; self.band.tiles()];
        for (slot, &tile) in self.slots.iter().enumerate() {
            slot_of[tile.at()] = if self.single { Slot(slot as u32) } else { tile.slot() };
        }
        self.band.host.iter().for_each(|tile| slot_of[tile.at()] = Slot::HOST);
        slot_of
    }
}

impl Gpu {
    /// Opens a device.
    ///
    /// # Errors
    /// When none fits; says what was tried and what to install.
    pub fn open(choice: &AdapterChoice) -> Result<Self, NoAdapter> {
        let (gpu, passed_over) = Self::open_telling(choice);
        gpu.ok_or_else(|| {
            adapters::none(choice, &passed_over, adapters::named_drivers().as_deref())
        })
    }

    /// As [`Gpu::open`], if one opens; and the adapters that were passed over.
    pub fn open_telling(choice: &AdapterChoice) -> (Option<Self>, Vec<PassedOver>) {
        adapters::open(choice, Self::start)
    }

    /// Opens an adapter.
    fn start(adapter: &wgpu::Adapter) -> Result<Self, String> {
        let descriptor = adapters::descriptor(adapter)?;
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor))
            .map_err(|error| error.to_string())?;
        let shared = Shared::new(&device, &queue)?;
        shared.listen();
        Ok(Self::on_shared(Arc::new(shared)))
    }

    /// On a device that another program part has opened and goes on using, with whatever limits and
    /// features it was created with: [`adapters::descriptor`] tells what to create it with.
    ///
    /// The callbacks of the device for errors and for its loss are left as they are. Errors of
    /// drawings come to the caller of [`Gpu::draw`] and to nobody else.
    ///
    /// # Errors
    /// When the device was created with too little; says what it lacks.
    pub fn from_wgpu(device: &wgpu::Device, queue: &wgpu::Queue) -> Result<Self, String> {
        Ok(Self::on_shared(Arc::new(Shared::new(device, queue)?)))
    }

    /// The first workspace of a device.
    fn on_shared(shared: Arc<Shared>) -> Self {
        let effort = Effort::default();
        Self {
            executor: Executor::new(&shared),
            limits: Limits { worth: effort.few, ..shared.limits },
            chunk: shared.chunk,
            ordered: None,
            wave: Wave::default(),
            effort,
            control: Control::new(),
            host: Host::default(),
            lent: Vec::new(),
            shared,
        }
    }

    /// Another workspace on the same device, with the same settings, and a control of its own. It
    /// opens nothing and allocates nothing before it draws; kernels that are compiled and scenes
    /// that are on the device are used by all workspaces. All may draw at once, from threads of one
    /// pool of rayon as well.
    #[must_use]
    pub fn beside(&self) -> Self {
        Self {
            shared: Arc::clone(&self.shared),
            executor: self.executor.beside(),
            limits: self.limits,
            chunk: self.chunk,
            ordered: None,
            wave: Wave::default(),
            effort: self.effort,
            control: Control::new(),
            host: self.host,
            lent: Vec::new(),
        }
    }

    /// Whether the device failed for good, for all of its workspaces: nothing can be drawn until
    /// another one is opened. Drawings then end with [`DrawError::Device`].
    pub fn is_lost(&self) -> bool {
        self.shared.fault().is_some()
    }

    /// The device in words, for people.
    pub fn description(&self) -> String {
        self.shared.description()
    }

    /// Whether it is a software device.
    pub fn is_software(&self) -> bool {
        self.shared.info.device_type == wgpu::DeviceType::Cpu
    }

    /// How much it takes at a time.
    pub fn capacity(&self) -> plan::Capacity {
        let Self { chunk, limits, .. } = *self;
        let band = limits.tiles * plan::TILE_PIXELS;
        plan::Capacity { software: self.is_software(), chunk, wave: limits.wave, band }
    }

    /// Spheres in one buffer, and what one dispatch may hold.
    pub fn limits(&self) -> (usize, Limits) {
        (self.chunk, self.limits)
    }

    /// Lends memory, such as ids of a picture that is no longer needed, for the next ids.
    pub fn lend(&mut self, ids: Vec<i32>) {
        self.lent = ids;
    }

    /// Bytes of spheres that were sent, and dispatches, since the device was opened, by all
    /// workspaces.
    pub fn activity(&self) -> (u64, u64) {
        let Shared { sent, dispatches, .. } = &*self.shared;
        (sent.load(Ordering::Relaxed), dispatches.load(Ordering::Relaxed))
    }

    /// Switches the filter off or on. Off, every pixel is the nearest sphere in plain f32, right or
    /// wrong: for benchmarks only.
    #[cfg(feature = "baselines")]
    pub fn set_certain(&mut self, certain: bool) {
        self.executor.certain = certain;
    }

    /// Chooses how lists are fetched; [`Lanes::Alone`] works everywhere. Returns whether the device
    /// has it.
    pub fn set_lanes(&mut self, lanes: Lanes) -> bool {
        let fits = lanes == Lanes::Alone || self.shared.lanes == lanes;
        if fits {
            self.executor.lanes = lanes;
            self.limits.few = 0;
        }
        fits
    }

    /// Makes chunks, waves, rounds, windows, bands and rows of workgroups smaller than they need
    /// be, to test that it does not show.
    pub fn shrink(&mut self, chunk: usize, workgroups: u32, limits: Limits) {
        let own = self.limits;
        self.chunk = self.chunk.min(chunk.max(1));
        self.executor.workgroups = self.executor.workgroups.min(workgroups.max(1));
        self.limits = Limits {
            wave: own.wave.min(limits.wave.max(1)),
            entries: own.entries.min(limits.entries.max(1)),
            tiles: own.tiles.min(limits.tiles.max(1)),
            few: own.few,
            worth: own.worth,
            round: own.round.min(limits.round.max(1)),
        };
        self.ordered = None;
    }

    /// Sets from how many spheres on they are ordered, and searched for what large ones hide, to
    /// test that it does not show.
    pub fn set_effort(&mut self, effort: Effort) {
        (self.effort, self.limits.worth, self.ordered) = (effort, effort.few, None);
    }

    /// Sets the device memory that scenes may take together, in place of [`KEPT`], for all
    /// workspaces.
    pub fn keep(&mut self, bytes: u64) {
        self.shared.kept.keep(bytes);
    }

    /// Takes a look at the machine's memory, which this crate does not have.
    pub fn on(&mut self, host: Host) {
        self.host = host;
    }

    /// Drawings end when this is cancelled.
    pub fn controlled_by(&mut self, control: &Control) {
        self.control = control.clone();
    }

    /// Draws a region: lists on the host, the filter on the device, and what it leaves over on the
    /// host again, where that is not a good part of the pixels.
    ///
    /// # Errors
    /// When there is no such picture, it was cancelled, the device fails, or memory does not
    /// suffice there or here.
    pub fn draw(
        &mut self,
        scene: &Scene,
        view: &View,
        region: Region,
    ) -> Result<Answer, DrawError> {
        let mut answer = self.filter(scene, view, region, true)?;
        if let Answer::Drawn(drawing, _) = &mut answer {
            drawing.counts.undecided = drawing.counts.undecided.min(region.pixels());
        }
        Ok(answer)
    }

    /// What the filter alone settles: other pixels are [`UNDECIDED`]. For tests and benchmarks.
    ///
    /// # Errors
    /// As [`Gpu::draw`].
    pub fn draw_filter(
        &mut self,
        scene: &Scene,
        view: &View,
        region: Region,
    ) -> Result<Drawing, DrawError> {
        match self.filter(scene, view, region, false)? {
            Answer::Drawn(drawing, _) => Ok(drawing),
            Answer::Unfit => {
                let mut drawing = Drawing::new(scene, view, region, Vec::new())?;
                drawing.ids.resize(region.pixels(), UNDECIDED);
                Ok(drawing)
            }
        }
    }

    /// The scene that this workspace drew last, in order, if it was put into one: the native device
    /// can take it over.
    pub fn ordered(&self) -> Option<&Arc<Ordered>> {
        self.ordered.as_ref()
    }

    /// Draws; if memory does not suffice, once more without other scenes on the device.
    fn filter(
        &mut self,
        scene: &Scene,
        view: &View,
        region: Region,
        decide: bool,
    ) -> Result<Answer, DrawError> {
        let mut drawing = Drawing::new(scene, view, region, std::mem::take(&mut self.lent))?;
        let mut left = pool::enter(|| self.filter_into(scene, view, decide, &mut drawing));
        let no_room = matches!(left, Err(DrawError::Memory { .. }));
        if no_room && self.shared.kept.drop_others(scene.identity()) {
            self.guarded(|gpu| gpu.shared.tidy())?;
            drop(drawing);
            drawing = Drawing::new(scene, view, region, Vec::new())?;
            left = pool::enter(|| self.filter_into(scene, view, decide, &mut drawing));
        }
        Ok(left?.map_or(Answer::Unfit, |left| Answer::Drawn(drawing, left)))
    }

    /// Into a drawing that has no ids yet; gives the bands that are left to the native device, or
    /// nothing if the device's numbers cannot hold the picture.
    fn filter_into(
        &mut self,
        scene: &Scene,
        view: &View,
        decide: bool,
        drawing: &mut Drawing,
    ) -> Result<Option<Vec<Region>>, DrawError> {
        let begin = Instant::now();
        let region = drawing.region;
        self.ordered = None;
        if scene.is_empty() {
            drawing.ids.resize(region.pixels(), NONE);
            self.control.reach(1.0);
            return Ok(Some(Vec::new()));
        }
        let (uploaded, control) = self.on_device(scene)?;
        self.ordered.clone_from(&uploaded.ordered);
        let eye = uploaded.fixed.and_then(|fixed| Eye::new(&fixed, &scene.bounds(), view));
        let Some(eye) = &eye else { return Ok(None) };
        let truth = Truth::new(view, scene.bounds());
        let spheres = Spheres { scene, truth: &truth, ordered: uploaded.ordered.as_ref() };
        let (chunks, large) = (&uploaded.chunks, &uploaded.large);
        let job = Job { spheres, eye, chunks, large, control: &control };
        drawing.times.prepare += since(begin);
        let left = self.draw_bands(job, drawing, decide)?;
        if self.executor.lanes == Lanes::Eight {
            // One kernel more is worth compiling for a device that draws again.
            self.limits.few = FEW;
        }
        Ok(Some(left))
    }

    /// A scene on the device, sent unless it is there; and the control of what is left to do.
    fn on_device(&self, scene: &Scene) -> Result<(Arc<Uploaded>, Control), DrawError> {
        let Effort { order, cover, .. } = self.effort;
        let layout = Layout { chunk: self.chunk, order, cover };
        let Shared { kept, .. } = &*self.shared;
        if let Some(uploaded) = kept.find(scene.identity(), layout) {
            return Ok((uploaded, self.control.clone()));
        }
        kept.make_room(upload::bytes(scene.len()));
        let control = &self.control.part([0.0, SENT]);
        let (shared, host) = (&*self.shared, &self.host);
        let uploaded = Upload { shared, scene, layout, host, control }.run()?;
        Ok((kept.insert(uploaded), self.control.part([SENT, 1.0])))
    }

    /// Draws all bands; gives those that are left to the native device.
    fn draw_bands(
        &mut self,
        job: Job,
        drawing: &mut Drawing,
        decide: bool,
    ) -> Result<Vec<Region>, DrawError> {
        let region = drawing.region;
        let across = region.width.div_ceil(TILE);
        let rows = (self.limits.tiles as u32 / across).max(1) * TILE;
        let mut left = Vec::new();
        for top in (0..region.height).step_by(rows as usize) {
            let height = rows.min(region.height - top);
            let band = Region { y: region.y + top, height, ..region };
            let part = [top, top + height].map(|row| row as f32 / region.height as f32);
            let control = job.control.part(part);
            if self.draw_band(Job { control: &control, ..job }, band, drawing, decide)? {
                control.reach(1.0);
            } else {
                left.push(band);
            }
        }
        Ok(left)
    }

    /// Appends the ids of a band. Gives false if so many are left over that the native device had
    /// better draw it.
    fn draw_band(
        &mut self,
        job: Job,
        region: Region,
        drawing: &mut Drawing,
        decide: bool,
    ) -> Result<bool, DrawError> {
        let decide = decide && self.executor.certain;
        let filtered = self.filter_band(job, region, drawing)?;
        let (left_over, mut done) = self.collect_ids(job, &filtered, drawing, decide)?;
        job.control.reach(BACK);
        let settled = self.resolve(job, &filtered, &left_over, drawing, &mut done)?;
        job.control.check()?;
        drawing.counts.undecided += done.pixels;
        if settled {
            drawing.counts.exact += done.tally.big as usize;
        }
        Ok(settled)
    }

    /// Makes the lists of a band, wave by wave, and runs the kernels on them.
    fn filter_band(
        &mut self,
        job: Job,
        region: Region,
        drawing: &mut Drawing,
    ) -> Result<Filtered, DrawError> {
        let Job { spheres, eye, chunks, large, control } = job;
        let mut filtered = Filtered::new(region);
        let Filtered { band, slots, single, waves, projector, met, backgrounds, .. } =
            &mut filtered;
        let search = spheres.scene.len() >= self.effort.cover;
        let cover = search
            .then(|| Cover::new(spheres.scene, &Projector::new(spheres.truth, region)))
            .flatten();
        for (number, chunk) in chunks.iter().enumerate() {
            let mut left = spheres.split(chunk.range.clone());
            let mut progress = Progress::new(control, [number, chunks.len()], &left);
            while !left.iter().all(Range::is_empty) {
                control.check()?;
                let begin = Instant::now();
                let (wave, limit) = (&mut self.wave, self.limits.wave);
                let (of_wave, met_now) = match &cover {
                    Some(cover) => {
                        // A list may only name spheres of the buffer that it is drawn from. With
                        // several buffers the occluder may be in another: it is then listed as
                        // other spheres are.
                        let places = if chunks.len() == 1 { large } else { &[] };
                        let keep = Uncovered { cover, places, listed: *waves > 0 };
                        wave.collect(spheres, region, &mut left, limit, &keep)
                    }
                    None => wave.collect(spheres, region, &mut left, limit, &KeepAll),
                };
                *projector = Some(of_wave);
                *waves += 1;
                *met += met_now;
                drawing.counts.entries += wave.lists().entries.len();
                let all = *waves == 1 && chunks.len() == 1 && left.iter().all(Range::is_empty);
                if all && let Some(cover) = &cover {
                    let keep = Uncovered { cover, places: large, listed: false };
                    for (tile, background) in backgrounds.iter_mut().enumerate() {
                        if let Some((place, _)) = keep.behind(tile) {
                            *background = spheres.index(place).id();
                        }
                    }
                }
                let (passes, whole) = band.passes(&self.wave.lists(), eye, self.limits, all);
                *single = all && whole;
                progress.listed(&left);
                drawing.times.prepare += since(begin);
                let begin = Instant::now();
                let slots = single.then_some(&mut *slots);
                let work = Work { eye, band, chunk, control };
                self.guarded(|gpu| gpu.executor.run(work, &gpu.wave, &passes, slots))?;
                progress.drawn();
                drawing.times.render += since(begin);
            }
        }
        if !*single && let Some(chunk) = chunks.first() {
            let begin = Instant::now();
            *slots = band.met();
            let work = Work { eye, band, chunk, control };
            self.guarded(|gpu| gpu.executor.finish(work, slots))?;
            drawing.times.render += since(begin);
        }
        control.reach(FILTERED);
        Ok(filtered)
    }

    /// Appends the ids of a band as they come back, with what few tiles leave over decided at once.
    /// Gives what is left over still, and what was decided.
    fn collect_ids(
        &mut self,
        job: Job,
        filtered: &Filtered,
        drawing: &mut Drawing,
        decide: bool,
    ) -> Result<(Vec<(TileIndex, Pixels)>, Done), DrawError> {
        let begin = Instant::now();
        let Job { spheres, control, .. } = job;
        let Filtered { region, band, backgrounds, .. } = filtered;
        let slot_of = filtered.slot_of();
        drawing.counts.tiles += band.tiles();
        let empty = slot_of
            .iter()
            .zip(backgrounds)
            .filter(|&(&slot, &id)| slot == Slot::BACKGROUND && id == NONE);
        drawing.counts.empty += empty.count();
        // What is the same as another sphere is hidden by it.
        let repeated = spheres.scene.len() - spheres.places();
        let met = Met { on_screen: filtered.met.on_screen + repeated, ..filtered.met };
        drawing.counts.note(*region == drawing.region, met);
        let start = drawing.ids.len();
        drawing.ids.reserve(region.pixels());
        let ids = &mut drawing.ids.spare_capacity_mut()[..region.pixels()];
        let (columns, slots) = (band.columns, &slot_of[..]);
        let answers = Answers { region: *region, columns, slots, backgrounds, spheres, control };
        let (mut left_over, done) = self.guarded(|gpu| {
            control.check()?;
            let projector = filtered.lists_projector().filter(|_| decide);
            let at_once = projector.map(|projector| {
                let among = Among { spheres, projector, wave: &gpu.wave, control };
                let left_over = LeftOver { among, columns, backgrounds };
                AtOnce::new(left_over, region.pixels() / HOPELESS)
            });
            let left_over = gpu.executor.read_back(filtered.slots_in_use(), |found| {
                answers.fill(ids, found, |tiles, first_row, ids| {
                    at_once.as_ref().is_some_and(|at_once| at_once.decide(tiles, first_row, ids))
                })
            })?;
            Ok((left_over, at_once.map_or(Done::default(), |at_once| at_once.done())))
        })?;
        // SAFETY: reserved above, and `fill` wrote all: it did not fail.
        unsafe { drawing.ids.set_len(start + region.pixels()) };
        let decided = done.spent.as_secs_f64() * 1e3 / rayon::current_num_threads() as f64;
        drawing.times.read_back += since(begin) - decided;
        drawing.times.decide += decided;
        if !decide {
            left_over.clear();
        }
        Ok((left_over, done))
    }

    /// Decides what is left over in the band that was appended last. Gives false, and decides
    /// nothing, where that is a good part of the pixels.
    fn resolve(
        &mut self,
        job: Job,
        filtered: &Filtered,
        left_over: &[(TileIndex, Pixels)],
        drawing: &mut Drawing,
        done: &mut Done,
    ) -> Result<bool, DrawError> {
        if left_over.is_empty() {
            return Ok(true);
        }
        let begin = Instant::now();
        let Job { spheres, control, .. } = job;
        let Filtered { region, band, backgrounds, .. } = filtered;
        done.pixels += decide::count(left_over);
        if done.pixels > region.pixels() / HOPELESS {
            return Ok(false);
        }
        let start = drawing.ids.len() - region.pixels();
        let ids = &mut drawing.ids[start..];
        done.tally += match filtered.lists_projector() {
            Some(projector) => {
                let among = Among { spheres, projector, wave: &self.wave, control };
                LeftOver { among, columns: band.columns, backgrounds }.decide(left_over, ids)
            }
            None => self.decide_again(job, left_over, *region, band, ids)?,
        };
        drawing.times.decide += since(begin);
        Ok(true)
    }

    /// Decides what the filter left over in some tiles, whose lists are made again.
    fn decide_again(
        &mut self,
        job: Job,
        tiles: &[(TileIndex, Pixels)],
        region: Region,
        band: &Band,
        ids: &mut [i32],
    ) -> Result<Tally, DrawError> {
        let Job { spheres, control, .. } = job;
        let mut undecided = Undecided::new(tiles, band.columns);
        let mut tally = Tally::default();
        let mask = undecided.mask(band.tiles());
        let mut left = spheres.split(0..spheres.places());
        while !left.iter().all(Range::is_empty) {
            control.check()?;
            let (projector, _) =
                &self.wave.collect(spheres, region, &mut left, self.limits.wave, &These(&mask));
            tally += undecided.look(Among { spheres, projector, wave: &self.wave, control });
        }
        undecided.write(ids, region);
        Ok(tally)
    }

    /// Runs something with errors of the device caught.
    fn guarded<T>(
        &mut self,
        work: impl FnOnce(&mut Self) -> Result<T, Failure>,
    ) -> Result<T, DrawError> {
        let shared = Arc::clone(&self.shared);
        let result = shared.guarded(|| work(self));
        if matches!(result, Err(DrawError::Memory { .. } | DrawError::Device(_))) {
            self.executor.forget();
        }
        result
    }
}

/// How far the filter is with a buffer of spheres, in a band.
struct Progress {
    /// Of the buffer.
    control: Control,
    /// Spheres of it, or groups.
    all: usize,
    /// What fraction is drawn.
    drawn: f32,
    /// What fraction is listed.
    listed: f32,
}

impl Progress {
    /// Nothing is listed yet of one of some buffers.
    fn new(band: &Control, [number, buffers]: [usize; 2], left: &[Range<usize>]) -> Self {
        let at = |number: usize| FILTERED * number as f32 / buffers as f32;
        let control = band.part([at(number), at(number + 1)]);
        Self { control, all: count(left), drawn: 0.0, listed: 0.0 }
    }

    /// This is left to be listed.
    fn listed(&mut self, left: &[Range<usize>]) {
        self.listed = 1.0 - count(left) as f32 / self.all.max(1) as f32;
        // Lists take about as long as kernels.
        self.control.reach(0.5 * (self.drawn + self.listed));
    }

    /// What is listed is drawn.
    fn drawn(&mut self) {
        self.drawn = self.listed;
        self.control.reach(self.drawn);
    }
}

/// How many there are in some ranges.
fn count(ranges: &[Range<usize>]) -> usize {
    ranges.iter().map(Range::len).sum()
}

/// Milliseconds since.
fn since(begin: Instant) -> f64 {
    begin.elapsed().as_secs_f64() * 1e3
}
