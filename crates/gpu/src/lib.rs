//! The GPU device: spheres stay on it from picture to picture; the host makes tile lists, the
//! device filters, the host decides what is left over. It executes what [`crate::plan`] lays out.
//!
//! * [`adapters`]: which devices there are, which one is taken, and what to install when there is
//!   none.
//! * `lists`: tile lists, made on the host.
//! * `execute`: uploads, dispatches, ids back; `memory`: buffers that are used again.
//! * `decide`: what the filter leaves over.
//! * [`naive`]: a baseline for `bench`.

#![cfg_attr(not(test), warn(clippy::print_stdout, clippy::print_stderr))]

pub mod adapters;
mod decide;
mod execute;
pub mod lists;
mod memory;
#[cfg(feature = "baselines")]
pub mod naive;
pub mod plan;

use std::{
    num::NonZeroU64,
    ops::Range,
    sync::{Arc, Mutex},
    time::Instant,
};

use rayon::prelude::*;

use crate::plan::{Band, Eye, Fixed, Limits, ROUND, Record, TILE, TILE_PIXELS, TILES};
use adapters::{AdapterChoice, NoAdapter, PassedOver, Suitability};
use decide::{Among, AtOnce, Done, LeftOver, Undecided};
use execute::{Answers, Executor, Pixels};
use lists::{Spheres, These, Uncovered, Wave};
use planisphere_core::{
    bins::{Keep, KeepAll},
    camera::{Region, View},
    cover::Cover,
    drawing::{Control, DrawError, Drawing, Met},
    exact::decide::{Tally, Truth},
    host::Host,
    ids::{NONE, Slot, SortedIndex, TileIndex, UNDECIDED},
    order::{Ordered, has_room},
    pool,
    project::Projector,
    scene::Scene,
};
use planisphere_shaders::{FEW, Lanes};

/// If more than one pixel in this many is undecided, drawing the band on the CPU is faster than
/// resolving it pixel by pixel.
const HOPELESS: usize = 8;

/// Spheres on the device: consecutive, as many as one binding holds.
struct Chunk {
    range: Range<usize>,
    buffer: wgpu::Buffer,
}

/// A scene on the device.
struct Uploaded {
    /// [`Scene::identity`].
    identity: u64,
    /// None where the device cannot hold the scene's numbers.
    fixed: Option<Fixed>,
    chunks: Vec<Chunk>,
    /// Neighbours in space lie together on the device, so that what a tile's list names shares
    /// cache lines. None for few spheres, which fit a cache anyway and lie there as in the scene.
    ordered: Option<Arc<Ordered>>,
    /// Places of the scene's large spheres, if any may hide much; none for those that are left out.
    large: Vec<Option<SortedIndex>>,
}

/// An opened GPU.
pub struct Gpu {
    executor: Executor,
    info: wgpu::AdapterInfo,
    limits: Limits,
    /// Spheres in one buffer.
    chunk: usize,
    uploaded: Option<Uploaded>,
    uploads: u64,
    wave: Wave,
    effort: Effort,
    /// What went wrong outside of any call, such as a lost device.
    fault: Arc<Mutex<Option<String>>>,
    control: Control,
    host: Host,
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

/// One picture.
struct Job<'a> {
    spheres: Spheres<'a>,
    eye: &'a Eye,
    chunks: &'a [Chunk],
    /// See [`Uploaded::large`].
    large: &'a [Option<SortedIndex>],
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
    fn start(adapter: &wgpu::Adapter, suitability: &Suitability) -> Result<Self, String> {
        let info = adapter.get_info();
        let offered = adapter.limits();
        let binding = offered
            .max_storage_buffer_binding_size
            .min(i32::MAX as u64)
            .min(offered.max_buffer_size);
        let limits = wgpu::Limits {
            max_storage_buffer_binding_size: binding,
            max_buffer_size: offered.max_buffer_size,
            max_storage_buffers_per_shader_stage: offered
                .max_storage_buffers_per_shader_stage
                .min(8),
            max_compute_workgroups_per_dimension: offered.max_compute_workgroups_per_dimension,
            ..wgpu::Limits::downlevel_defaults()
        };
        let mut features = match suitability.lanes {
            Lanes::Eight => wgpu::Features::SUBGROUP,
            Lanes::Alone => wgpu::Features::empty(),
        };
        if info.device_type == wgpu::DeviceType::Cpu {
            features |= adapter.features() & wgpu::Features::MAPPABLE_PRIMARY_BUFFERS;
        }
        let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
            label: Some("planisphere"),
            required_features: features,
            required_limits: limits,
            ..Default::default()
        }))
        .map_err(|error| error.to_string())?;
        let fault = Arc::new(Mutex::new(None));
        let note = Arc::clone(&fault);
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            remember(&note, error.to_string())
        }));
        let note = Arc::clone(&fault);
        device.set_device_lost_callback(move |reason, message| {
            // Dropping the device is no fault.
            if reason != wgpu::DeviceLostReason::Destroyed {
                remember(&note, format!("device lost: {message}"));
            }
        });
        let binding = binding as usize;
        let effort = Effort::default();
        let limits = Limits {
            wave: 1 << 22,
            entries: (binding / size_of::<SortedIndex>()).min(1 << 24),
            tiles: (binding / (TILE_PIXELS * size_of::<plan::State>())).min(TILES),
            few: 0,
            worth: effort.few,
            round: ROUND,
        };
        Ok(Self {
            // 64 Mi spheres in a buffer are plenty.
            chunk: (binding / size_of::<Record>()).min(1 << 26),
            executor: Executor::new(device, queue, suitability.lanes),
            info,
            limits,
            uploaded: None,
            uploads: 0,
            wave: Wave::default(),
            effort,
            fault,
            control: Control::new(),
            host: Host::default(),
        })
    }

    /// The device in words, for people.
    pub fn description(&self) -> String {
        adapters::name(&self.info)
    }

    /// Whether it is a software device.
    pub fn is_software(&self) -> bool {
        self.info.device_type == wgpu::DeviceType::Cpu
    }

    /// Spheres in one buffer, and what one dispatch may hold.
    pub fn capacity(&self) -> (usize, Limits) {
        (self.chunk, self.limits)
    }

    /// Bytes of spheres that were sent, and dispatches, since the device was opened.
    pub fn activity(&self) -> (u64, u64) {
        (self.uploads, self.executor.dispatches)
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
        let fits = lanes == Lanes::Alone
            || self.executor.device.features().contains(wgpu::Features::SUBGROUP);
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
        self.uploaded = None;
    }

    /// Sets from how many spheres on they are ordered, and searched for what large ones hide, to
    /// test that it does not show.
    pub fn set_effort(&mut self, effort: Effort) {
        (self.effort, self.limits.worth, self.uploaded) = (effort, effort.few, None);
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
                let mut drawing = Drawing::new(scene, view, region)?;
                drawing.ids.resize(region.pixels(), UNDECIDED);
                Ok(drawing)
            }
        }
    }

    /// The scene that was drawn last, in order, if it was put into one: the native device can take
    /// it over.
    pub fn ordered(&self) -> Option<&Arc<Ordered>> {
        self.uploaded.as_ref()?.ordered.as_ref()
    }

    fn filter(
        &mut self,
        scene: &Scene,
        view: &View,
        region: Region,
        decide: bool,
    ) -> Result<Answer, DrawError> {
        let mut drawing = Drawing::new(scene, view, region)?;
        let left = pool::enter(|| self.filter_into(scene, view, decide, &mut drawing))?;
        Ok(left.map_or(Answer::Unfit, |left| Answer::Drawn(drawing, left)))
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
        if scene.is_empty() {
            drawing.ids.resize(region.pixels(), NONE);
            return Ok(Some(Vec::new()));
        }
        self.ensure_uploaded(scene)?;
        // The device's copy leaves `self` while it is drawn from.
        let Some(uploaded) = self.uploaded.take() else {
            return Err(DrawError::Device("the scene is not on the device".into()));
        };
        let eye = uploaded.fixed.and_then(|fixed| Eye::new(&fixed, &scene.bounds(), view));
        let mut result = Ok(None);
        if let Some(eye) = &eye {
            let truth = Truth::new(view, scene.bounds());
            let spheres = Spheres { scene, truth: &truth, ordered: uploaded.ordered.as_ref() };
            let (chunks, large) = (&uploaded.chunks, &uploaded.large);
            let job = Job { spheres, eye, chunks, large };
            drawing.times.prepare += since(begin);
            result = self.draw_bands(&job, drawing, decide).map(Some);
        }
        self.uploaded = Some(uploaded);
        if self.executor.lanes == Lanes::Eight {
            // One kernel more is worth compiling for a device that draws again.
            self.limits.few = FEW;
        }
        result
    }

    /// Draws all bands; gives those that are left to the native device.
    fn draw_bands(
        &mut self,
        job: &Job,
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
            if !self.draw_band(job, band, drawing, decide)? {
                left.push(band);
            }
        }
        Ok(left)
    }

    /// Appends the ids of a band. Gives false if so many are left over that the native device had
    /// better draw it.
    fn draw_band(
        &mut self,
        job: &Job,
        region: Region,
        drawing: &mut Drawing,
        decide: bool,
    ) -> Result<bool, DrawError> {
        let decide = decide && self.executor.certain;
        let filtered = self.filter_band(job, region, drawing)?;
        let (left_over, mut done) = self.collect_ids(job.spheres, &filtered, drawing, decide)?;
        let settled = self.resolve(job.spheres, &filtered, &left_over, drawing, &mut done);
        self.control.check()?;
        drawing.counts.undecided += done.pixels;
        if settled {
            drawing.counts.exact += done.tally.big as usize;
        }
        Ok(settled)
    }

    /// Makes the lists of a band, wave by wave, and runs the kernels on them.
    fn filter_band(
        &mut self,
        job: &Job,
        region: Region,
        drawing: &mut Drawing,
    ) -> Result<Filtered, DrawError> {
        let Job { spheres, eye, chunks, large } = *job;
        let mut filtered = Filtered::new(region);
        let Filtered { band, slots, single, waves, projector, met, backgrounds, .. } =
            &mut filtered;
        let search = spheres.scene.len() >= self.effort.cover;
        let cover = search
            .then(|| Cover::new(spheres.scene, &Projector::new(spheres.truth, region)))
            .flatten();
        for chunk in chunks {
            let mut left = spheres.split(chunk.range.clone());
            while !left.iter().all(Range::is_empty) {
                self.control.check()?;
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
                drawing.times.prepare += since(begin);
                let begin = Instant::now();
                let (band, slots) = (&*band, single.then_some(&mut *slots));
                self.guarded(|gpu| gpu.executor.run(eye, band, chunk, &gpu.wave, &passes, slots))?;
                drawing.times.render += since(begin);
            }
        }
        if !*single && let Some(chunk) = chunks.first() {
            let begin = Instant::now();
            *slots = band.met();
            self.guarded(|gpu| gpu.executor.finish(eye, band, chunk, slots))?;
            drawing.times.render += since(begin);
        }
        Ok(filtered)
    }

    /// Appends the ids of a band as they come back, with what few tiles leave over decided at once.
    /// Gives what is left over still, and what was decided.
    fn collect_ids(
        &mut self,
        spheres: Spheres<'_>,
        filtered: &Filtered,
        drawing: &mut Drawing,
        decide: bool,
    ) -> Result<(Vec<(TileIndex, Pixels)>, Done), DrawError> {
        let begin = Instant::now();
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
        let answers = Answers { region: *region, columns, slots, backgrounds, spheres };
        let mut left_over = Vec::new();
        let mut done = Done::default();
        self.guarded(|gpu| {
            let projector = filtered.lists_projector().filter(|_| decide);
            let at_once = projector.map(|projector| {
                let among = Among { spheres, projector, wave: &gpu.wave, control: &gpu.control };
                let left_over = LeftOver { among, columns, backgrounds };
                AtOnce::new(left_over, region.pixels() / HOPELESS)
            });
            gpu.executor.read_back(filtered.slots_in_use(), |found| {
                left_over = answers.fill(ids, found, |tiles, first_row, ids| {
                    at_once.as_ref().is_some_and(|at_once| at_once.decide(tiles, first_row, ids))
                });
            })?;
            done = at_once.map_or(done, |at_once| at_once.done());
            Ok(())
        })?;
        // SAFETY: reserved above, and `fill` wrote all; `read_back` calls it unless it fails.
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
        spheres: Spheres<'_>,
        filtered: &Filtered,
        left_over: &[(TileIndex, Pixels)],
        drawing: &mut Drawing,
        done: &mut Done,
    ) -> bool {
        if left_over.is_empty() {
            return true;
        }
        let begin = Instant::now();
        let Filtered { region, band, backgrounds, .. } = filtered;
        done.pixels += decide::count(left_over);
        if done.pixels > region.pixels() / HOPELESS {
            return false;
        }
        let start = drawing.ids.len() - region.pixels();
        let ids = &mut drawing.ids[start..];
        done.tally += match filtered.lists_projector() {
            Some(projector) => {
                let among = Among { spheres, projector, wave: &self.wave, control: &self.control };
                LeftOver { among, columns: band.columns, backgrounds }.decide(left_over, ids)
            }
            None => self.decide_again(spheres, left_over, *region, band, ids),
        };
        drawing.times.decide += since(begin);
        true
    }

    /// Decides what the filter left over in some tiles, whose lists are made again.
    fn decide_again(
        &mut self,
        spheres: Spheres<'_>,
        tiles: &[(TileIndex, Pixels)],
        region: Region,
        band: &Band,
        ids: &mut [i32],
    ) -> Tally {
        let mut undecided = Undecided::new(tiles, band.columns);
        let mut tally = Tally::default();
        let mask = undecided.mask(band.tiles());
        let mut left = spheres.split(0..spheres.places());
        while !left.iter().all(Range::is_empty) {
            let (projector, _) =
                &self.wave.collect(spheres, region, &mut left, self.limits.wave, &These(&mask));
            tally += undecided.look(Among {
                spheres,
                projector,
                wave: &self.wave,
                control: &self.control,
            });
        }
        undecided.write(ids, region);
        tally
    }

    /// Puts a scene on the device unless it is there.
    fn ensure_uploaded(&mut self, scene: &Scene) -> Result<(), DrawError> {
        if self.uploaded.as_ref().is_some_and(|uploaded| uploaded.identity == scene.identity()) {
            return Ok(());
        }
        // What is kept of another scene.
        self.uploaded = None;
        let fixed = Fixed::new(&scene.bounds());
        let mut chunks = Vec::new();
        let mut ordered = None;
        if let Some(fixed) = &fixed {
            if scene.len() >= self.effort.order && has_room(scene, &self.host) {
                ordered = Ordered::coarse(scene, self.chunk, &self.control)?.map(Arc::new);
            }
            let places = ordered.as_ref().map_or(scene.len(), |ordered| ordered.len());
            let part = self.chunk;
            for range in (0..places).step_by(part).map(|start| start..places.min(start + part)) {
                let buffer = self.guarded(|gpu| {
                    let buffer = gpu.executor.device.create_buffer(&wgpu::BufferDescriptor {
                        label: Some("spheres"),
                        size: (range.len() * size_of::<Record>()) as u64,
                        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
                        mapped_at_creation: false,
                    });
                    gpu.send_spheres(scene, fixed, ordered.as_deref(), range.clone(), &buffer);
                    Ok(buffer)
                })?;
                self.uploads += (range.len() * size_of::<Record>()) as u64;
                chunks.push(Chunk { range, buffer });
            }
        }
        let large = match &ordered {
            _ if scene.len() < self.effort.cover || !Cover::may_be(scene) => Vec::new(),
            Some(ordered) => ordered.places_of(scene.large()),
            // Where there is no order, a sphere's place is its index.
            None => scene.large().iter().map(|index| Some(SortedIndex(index.0))).collect(),
        };
        self.uploaded =
            Some(Uploaded { identity: scene.identity(), fixed, chunks, ordered, large });
        Ok(())
    }

    /// Writes the records of a chunk, a part at a time, so that the host never holds a second copy
    /// of a large scene.
    fn send_spheres(
        &self,
        scene: &Scene,
        fixed: &Fixed,
        ordered: Option<&Ordered>,
        range: Range<usize>,
        buffer: &wgpu::Buffer,
    ) {
        const PART: usize = 1 << 16;
        let Executor { device, queue, .. } = &self.executor;
        let mut records = Vec::new();
        for start in range.clone().step_by(PART) {
            let part = start..range.end.min(start + PART);
            let bytes = |spheres: usize| (spheres * size_of::<Record>()) as u64;
            let at = bytes(start - range.start);
            let Some(size) = NonZeroU64::new(bytes(part.len())) else { continue };
            part.into_par_iter()
                .with_min_len(1 << 12)
                .map(|place| {
                    let (block, at) = ordered
                        .map_or_else(|| scene.locate(place), |ordered| (&ordered.block, place));
                    fixed.record(block.center(at), block.radius(at))
                })
                .collect_into_vec(&mut records);
            if let Some(mut view) = queue.write_buffer_with(buffer, at, size) {
                view.copy_from_slice(bytemuck::cast_slice(&records));
            }
            // Staging memory is freed when the device is done with it.
            queue.submit([]);
            let _ = device.poll(wgpu::PollType::Poll);
        }
    }

    /// Runs something with errors of the device caught.
    fn guarded<T>(
        &mut self,
        work: impl FnOnce(&mut Self) -> Result<T, DrawError>,
    ) -> Result<T, DrawError> {
        let device = self.executor.device.clone();
        let memory = device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let validation = device.push_error_scope(wgpu::ErrorFilter::Validation);
        let internal = device.push_error_scope(wgpu::ErrorFilter::Internal);
        let result = work(self);
        let faults = [pollster::block_on(internal.pop()), pollster::block_on(validation.pop())];
        if let Some(error) = pollster::block_on(memory.pop()) {
            let words = format!("{} is out of memory: {error}", self.description());
            return Err(DrawError::Memory { needed: None, words });
        }
        let lost = self.fault.lock().map_or(None, |fault| fault.clone());
        match faults.into_iter().flatten().map(|error| error.to_string()).next().or(lost) {
            Some(message) => Err(DrawError::Device(message)),
            None => result,
        }
    }
}

/// Milliseconds since.
fn since(begin: Instant) -> f64 {
    begin.elapsed().as_secs_f64() * 1e3
}

/// Keeps the first fault.
fn remember(fault: &Mutex<Option<String>>, message: String) {
    if let Ok(mut fault) = fault.lock() {
        fault.get_or_insert(message);
    }
}
