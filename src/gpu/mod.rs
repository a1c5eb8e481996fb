//! The GPU device: adapters, uploads and dispatches through wgpu. It executes what [`crate::plan`] lays out.
//!
//! * [`adapters`]: which devices there are, which one is taken, and what to install when there is none.
//! * [`memory`]: buffers that grow and are used again.

pub mod adapters;
mod memory;

use std::{
    collections::HashMap,
    num::NonZeroU64,
    ops::Range,
    sync::{Arc, Mutex},
    time::Instant,
};

use rayon::prelude::*;

use crate::{
    camera::{Region, View},
    plan::{self, Eye, Fixed, Limits, Lists, NONE, Pass, TILE, TILE_PIXELS, UNDECIDED},
    render::{DeviceChoice, DeviceError, DrawError},
    scene::Scene,
    shader::{FANS, Lanes, PLANES, STATES, Variant},
};
use memory::Growing;

/// What `draw_lists` gives.
#[derive(Clone, Debug, Default)]
pub struct Plane {
    /// Row by row from the top: index of the nearest sphere, [`NONE`], or [`UNDECIDED`].
    pub ids: Vec<i32>,
    /// Milliseconds for tables, uploads and the filter.
    pub render: f64,
    /// Milliseconds for bringing the ids back.
    pub read_back: f64,
    /// Bytes of spheres that were uploaded for this picture.
    pub uploaded: usize,
    /// Dispatches.
    pub dispatches: usize,
}

/// Spheres on the device: consecutive, as many as one binding holds.
struct Chunk {
    range: Range<usize>,
    buffer: wgpu::Buffer,
}

/// A scene on the device.
struct Uploaded {
    /// See `Gpu::ensure_uploaded`.
    identity: u64,
    /// None where the device cannot hold the scene's numbers.
    fixed: Option<Fixed>,
    chunks: Vec<Chunk>,
}

struct Pipeline {
    pipeline: wgpu::ComputePipeline,
    layout: wgpu::BindGroupLayout,
}

/// An opened GPU.
pub struct Gpu {
    device: wgpu::Device,
    queue: wgpu::Queue,
    info: wgpu::AdapterInfo,
    /// How the kernels fetch lists on this device.
    lanes: Lanes,
    limits: Limits,
    /// Spheres in one buffer.
    chunk: usize,
    /// Off only in benchmarks.
    certain: bool,
    pipelines: HashMap<Variant, Pipeline>,
    uploaded: Option<Uploaded>,
    buffers: Buffers,
    /// What went wrong outside of any call, such as a lost device.
    fault: Arc<Mutex<Option<String>>>,
}

/// Per frame buffers.
struct Buffers {
    frame: Growing,
    entries: Growing,
    tiles: Growing,
    fans: Growing,
    planes: Growing,
    ids: Growing,
    states: Growing,
    staging: Growing,
}

impl Buffers {
    fn new() -> Self {
        use wgpu::BufferUsages as U;
        let storage = U::STORAGE | U::COPY_DST;
        Self {
            frame: Growing::new("frame", U::UNIFORM | U::COPY_DST),
            entries: Growing::new("entries", storage),
            tiles: Growing::new("tiles", storage),
            fans: Growing::new("fans", storage),
            planes: Growing::new("planes", storage),
            ids: Growing::new("ids", U::STORAGE | U::COPY_SRC),
            states: Growing::new("states", U::STORAGE),
            staging: Growing::new("staging", U::MAP_READ | U::COPY_DST),
        }
    }
}

impl Gpu {
    /// Opens a device: `Auto` takes hardware only, `Gpu` any adapter but hardware first, a name the first adapter whose name has it.
    ///
    /// # Errors
    /// When none fits; says what was tried and what to install.
    pub fn open(choice: &DeviceChoice) -> Result<Self, DeviceError> {
        let (adapter, suitability) = adapters::choose(choice)?;
        let info = adapter.get_info();
        let failed = |error: &dyn std::fmt::Display| {
            DeviceError::NoAdapter(format!("{} could not be opened: {error}", adapters::name(&info)))
        };
        let wanted = adapter.limits();
        let binding = wanted.max_storage_buffer_binding_size.min(i32::MAX as u64).min(wanted.max_buffer_size);
        let limits = wgpu::Limits {
            max_storage_buffer_binding_size: binding,
            max_buffer_size: wanted.max_buffer_size,
            max_storage_buffers_per_shader_stage: wanted.max_storage_buffers_per_shader_stage.min(8),
            ..wgpu::Limits::downlevel_defaults()
        };
        let features =
            if suitability.lanes == Lanes::Eight { wgpu::Features::SUBGROUP } else { wgpu::Features::empty() };
        let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
            label: Some("planisphere"),
            required_features: features,
            required_limits: limits,
            ..Default::default()
        }))
        .map_err(|error| failed(&error))?;
        let fault = Arc::new(Mutex::new(None));
        let note = Arc::clone(&fault);
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| remember(&note, error.to_string())));
        let note = Arc::clone(&fault);
        device.set_device_lost_callback(move |reason, message| {
            // Dropping the device is no fault.
            if reason != wgpu::DeviceLostReason::Destroyed {
                remember(&note, format!("device lost: {message}"));
            }
        });
        // Buffers of the frame stay well below any binding limit; chunks use what there is, but not more than 64 Mi spheres.
        let binding = binding as usize;
        let limits = Limits {
            entries: (binding / 4).min(1 << 24),
            tiles: (binding / (TILE_PIXELS * size_of::<plan::State>())).min(1 << 16),
            round: 32_768,
            workgroups: device.limits().max_compute_workgroups_per_dimension,
        };
        Ok(Self {
            chunk: (binding / 16).min(1 << 26),
            lanes: suitability.lanes,
            device,
            queue,
            info,
            limits,
            certain: true,
            pipelines: HashMap::new(),
            uploaded: None,
            buffers: Buffers::new(),
            fault,
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

    /// Switches the filter off or on. Off, every pixel is the nearest sphere in plain f32, right or wrong: for benchmarks only.
    pub fn set_certain(&mut self, certain: bool) {
        self.certain = certain;
    }

    /// Chooses how lists are fetched; [`Lanes::Alone`] works everywhere. Returns whether the device has it.
    pub fn set_lanes(&mut self, lanes: Lanes) -> bool {
        let fits = lanes == Lanes::Alone || self.device.features().contains(wgpu::Features::SUBGROUP);
        if fits {
            self.lanes = lanes;
        }
        fits
    }

    /// Makes chunks, rounds, windows and batches smaller than they need be, to test that they do not show.
    pub fn set_limits(&mut self, chunk: usize, limits: Limits) {
        self.chunk = chunk.clamp(1, self.chunk);
        self.limits = Limits {
            entries: limits.entries.clamp(1, self.limits.entries),
            tiles: limits.tiles.clamp(1, self.limits.tiles),
            round: limits.round.clamp(1, self.limits.round),
            workgroups: limits.workgroups.clamp(1, self.limits.workgroups),
        };
        self.uploaded = None;
    }

    /// Forgets the scene on the device.
    pub fn forget(&mut self) {
        self.uploaded = None;
    }

    /// Puts a scene on the device unless it is there. `identity` tells scenes apart. Returns the bytes sent.
    ///
    /// # Errors
    /// When the device fails or is out of memory.
    pub fn ensure_uploaded(&mut self, scene: &Scene, identity: u64) -> Result<usize, DrawError> {
        if self.uploaded.as_ref().is_some_and(|u| u.identity == identity) {
            return Ok(0);
        }
        self.uploaded = None;
        let fixed = Fixed::new(&scene.bounds());
        let mut chunks = Vec::new();
        let mut sent = 0;
        if let Some(fixed) = &fixed {
            for start in (0..scene.len()).step_by(self.chunk) {
                let range = start..scene.len().min(start + self.chunk);
                let bytes = range.len() * 16;
                let buffer = self.guarded(|gpu| {
                    let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
                        label: Some("spheres"),
                        size: bytes as u64,
                        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
                        mapped_at_creation: false,
                    });
                    gpu.send_spheres(scene, fixed, range.clone(), &buffer);
                    buffer
                })?;
                sent += bytes;
                chunks.push(Chunk { range, buffer });
            }
        }
        self.uploaded = Some(Uploaded { identity, fixed, chunks });
        Ok(sent)
    }

    /// Writes the records of a chunk, a part at a time, so that the host never holds a second copy of a large scene.
    fn send_spheres(&self, scene: &Scene, fixed: &Fixed, range: Range<usize>, buffer: &wgpu::Buffer) {
        const PART: usize = 1 << 20;
        for start in range.clone().step_by(PART) {
            let part = start..range.end.min(start + PART);
            let at = ((start - range.start) * 16) as u64;
            let Some(size) = NonZeroU64::new((part.len() * 16) as u64) else { continue };
            if let Some(mut view) = self.queue.write_buffer_with(buffer, at, size) {
                let records: Vec<[i32; 4]> = part
                    .into_par_iter()
                    .with_min_len(1 << 12)
                    .map(|k| {
                        let (block, at) = scene.locate(k);
                        fixed.record(block.center(at), block.radius(at))
                    })
                    .collect();
                view.copy_from_slice(bytemuck::cast_slice(&records));
            }
            // Staging memory is freed when the device is done with it.
            self.queue.submit([]);
            let _ = self.device.poll(wgpu::PollType::Poll);
        }
    }

    /// The chunks of the uploaded scene: `draw_lists` wants tile lists of each.
    pub fn chunks(&self) -> Vec<Range<usize>> {
        self.uploaded.iter().flat_map(|u| u.chunks.iter().map(|c| c.range.clone())).collect()
    }

    /// Runs the filter on the uploaded scene: one set of tile lists for each of [`Gpu::chunks`], of the tiles of `region` in rows.
    ///
    /// # Errors
    /// When the device fails or is out of memory.
    ///
    /// # Panics
    /// Without an uploaded scene, or with lists of another shape.
    pub fn draw_lists(
        &mut self,
        scene: &Scene,
        view: &View,
        region: Region,
        lists: &[Lists<'_>],
    ) -> Result<Plane, DrawError> {
        let uploaded = self.uploaded.take().expect("ensure_uploaded comes first");
        let plane = self.draw_uploaded(&uploaded, scene, view, region, lists);
        self.uploaded = Some(uploaded);
        plane
    }

    fn draw_uploaded(
        &mut self,
        uploaded: &Uploaded,
        scene: &Scene,
        view: &View,
        region: Region,
        lists: &[Lists<'_>],
    ) -> Result<Plane, DrawError> {
        let begin = Instant::now();
        let mut plane = Plane { ids: vec![NONE; region.pixels()], ..Plane::default() };
        if scene.is_empty() {
            return Ok(plane);
        }
        let eye = uploaded.fixed.and_then(|fixed| Eye::new(&fixed, &scene.bounds(), view));
        let Some(eye) = eye else {
            // Nothing is known of the lists either where the scene has no chunks: the host decides every pixel.
            plane.ids.fill(UNDECIDED);
            return Ok(plane);
        };
        assert_eq!(lists.len(), uploaded.chunks.len(), "one set of lists for each chunk");
        let Some(first) = lists.first() else { return Ok(plane) };
        let columns = first.columns;
        let schedule = plan::schedule(lists, &eye, region, self.limits);
        for &tile in &schedule.host {
            fill_tile(&mut plane.ids, region, columns, tile, &[UNDECIDED; TILE_PIXELS]);
        }
        plane.render += since(begin);
        for batch in &schedule.batches {
            let begin = Instant::now();
            self.guarded(|gpu| gpu.run_batch(uploaded, &eye, batch, lists))??;
            plane.dispatches += batch.passes.len();
            plane.render += since(begin);
            let begin = Instant::now();
            let size = (batch.slots.len() * TILE_PIXELS * 4) as u64;
            self.read_back(size, |ids| {
                for (&tile, ids) in batch.slots.iter().zip(ids.chunks_exact(TILE_PIXELS)) {
                    fill_tile(&mut plane.ids, region, columns, tile, ids);
                }
            })?;
            plane.read_back += since(begin);
        }
        Ok(plane)
    }

    /// Uploads the tables of each pass and dispatches it; waits for the last.
    fn run_batch(
        &mut self,
        uploaded: &Uploaded,
        eye: &Eye,
        batch: &plan::Batch,
        lists: &[Lists<'_>],
    ) -> Result<(), DrawError> {
        let pixels = batch.slots.len() * TILE_PIXELS;
        self.buffers.ids.reserve(&self.device, (pixels * 4) as u64);
        if batch.merged {
            self.buffers.states.reserve(&self.device, (pixels * size_of::<plan::State>()) as u64);
        }
        let mut present = None;
        let mut last = None;
        for pass in &batch.passes {
            let variant = Variant {
                projection: eye.projection(),
                clipped: pass.clipped,
                merged: batch.merged,
                certain: self.certain,
                lanes: self.lanes,
            };
            self.prepare_pipeline(variant)?;
            if present != Some((pass.chunk, pass.window.clone())) {
                let entries = &lists[pass.chunk].entries[pass.window.clone()];
                self.buffers.entries.write(&self.device, &self.queue, entries);
                present = Some((pass.chunk, pass.window.clone()));
            }
            last = Some(self.dispatch(uploaded, eye, batch, pass, variant));
        }
        if let Some(submission_index) = last {
            self.wait(submission_index)?;
        }
        Ok(())
    }

    fn wait(&self, submission: wgpu::SubmissionIndex) -> Result<(), DrawError> {
        self.device
            .poll(wgpu::PollType::Wait { submission_index: Some(submission), timeout: None })
            .map(|_| ())
            .map_err(|error| DrawError::Device(error.to_string()))
    }

    fn dispatch(
        &mut self,
        uploaded: &Uploaded,
        eye: &Eye,
        batch: &plan::Batch,
        pass: &Pass,
        variant: Variant,
    ) -> wgpu::SubmissionIndex {
        let segments = &pass.segments;
        let tables = segments.iter().map(|s| batch.places[s.slot as usize]);
        let flag = |set: bool, bit: u32| if set { bit } else { 0 };
        let tiles: Vec<plan::Tile> = segments
            .iter()
            .zip(tables.clone())
            .map(|(s, place)| plan::Tile {
                start: s.start,
                count: s.count,
                slot: s.slot | flag(s.fresh, plan::FRESH) | flag(s.last, plan::LAST),
                ..place.tile
            })
            .collect();
        let (device, queue) = (&self.device, &self.queue);
        let buffers = &mut self.buffers;
        buffers.tiles.write(device, queue, &tiles);
        let bindings = variant.bindings();
        let has = |number| bindings.iter().any(|b| b.0 == number);
        if has(FANS) {
            buffers.fans.write(device, queue, &tables.clone().map(|place| place.fan).collect::<Vec<_>>());
        }
        if has(PLANES) {
            buffers.planes.write(device, queue, &tables.map(|place| place.planes).collect::<Vec<_>>());
        }
        let groups = (segments.len() as u32).div_ceil(TILE);
        let row = groups.min(self.limits.workgroups);
        let chunk = &uploaded.chunks[pass.chunk];
        let frame = plan::Frame { first: chunk.range.start as u32, tiles: segments.len() as u32, row, ..eye.frame };
        buffers.frame.write(device, queue, &[frame]);
        let resource = |number| match number {
            0 => buffers.frame.binding(),
            1 => chunk.buffer.as_entire_binding(),
            2 => buffers.entries.binding(),
            3 => buffers.tiles.binding(),
            4 => buffers.ids.binding(),
            STATES => buffers.states.binding(),
            FANS => buffers.fans.binding(),
            _ => buffers.planes.binding(),
        };
        let pipeline = &self.pipelines[&variant];
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &pipeline.layout,
            entries: &bindings
                .iter()
                .map(|&(binding, _)| wgpu::BindGroupEntry { binding, resource: resource(binding) })
                .collect::<Vec<_>>(),
        });
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        {
            let mut compute = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            compute.set_pipeline(&pipeline.pipeline);
            compute.set_bind_group(0, &group, &[]);
            compute.dispatch_workgroups(row, groups.div_ceil(row), 1);
        }
        queue.submit([encoder.finish()])
    }

    /// Brings the first `size` bytes of the ids back.
    fn read_back(&mut self, size: u64, take: impl FnOnce(&[i32])) -> Result<(), DrawError> {
        self.guarded(|gpu| {
            gpu.buffers.staging.reserve(&gpu.device, size);
            let (Some(ids), Some(staging)) = (gpu.buffers.ids.get(), gpu.buffers.staging.get()) else { return Ok(()) };
            let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            encoder.copy_buffer_to_buffer(ids, 0, staging, 0, size);
            let submission = gpu.queue.submit([encoder.finish()]);
            let slice = staging.slice(..size);
            let (sender, receiver) = std::sync::mpsc::channel();
            slice.map_async(wgpu::MapMode::Read, move |result| {
                let _ = sender.send(result);
            });
            gpu.wait(submission)?;
            match receiver.recv() {
                Ok(Ok(())) => {
                    let view = slice.get_mapped_range().map_err(|error| DrawError::Device(format!("{error:?}")))?;
                    take(bytemuck::cast_slice(&view));
                    drop(view);
                    staging.unmap();
                    Ok(())
                }
                Ok(Err(error)) => Err(DrawError::Device(error.to_string())),
                Err(error) => Err(DrawError::Device(error.to_string())),
            }
        })?
    }

    /// Makes a pipeline unless it is there.
    fn prepare_pipeline(&mut self, variant: Variant) -> Result<(), DrawError> {
        if self.pipelines.contains_key(&variant) {
            return Ok(());
        }
        let source = variant.source();
        let module = self.device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("tiles"),
            source: wgpu::ShaderSource::Wgsl(source.text.into()),
        });
        let entries: Vec<_> = variant
            .bindings()
            .into_iter()
            .map(|(binding, written)| wgpu::BindGroupLayoutEntry {
                binding,
                visibility: wgpu::ShaderStages::COMPUTE,
                ty: wgpu::BindingType::Buffer {
                    ty: match binding {
                        0 => wgpu::BufferBindingType::Uniform,
                        _ => wgpu::BufferBindingType::Storage { read_only: !written },
                    },
                    has_dynamic_offset: false,
                    min_binding_size: None,
                },
                count: None,
            })
            .collect();
        let layout = self
            .device
            .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some("tiles"), entries: &entries });
        let pipeline_layout = self.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("tiles"),
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        let pipeline = self.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some("tiles"),
            layout: Some(&pipeline_layout),
            module: &module,
            entry_point: Some("main"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            cache: None,
        });
        self.pipelines.insert(variant, Pipeline { pipeline, layout });
        Ok(())
    }

    /// Runs something with errors of the device caught.
    fn guarded<T>(&mut self, work: impl FnOnce(&mut Self) -> T) -> Result<T, DrawError> {
        let memory = self.device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let validation = self.device.push_error_scope(wgpu::ErrorFilter::Validation);
        let internal = self.device.push_error_scope(wgpu::ErrorFilter::Internal);
        let result = work(self);
        let faults = [pollster::block_on(internal.pop()), pollster::block_on(validation.pop())];
        if let Some(error) = pollster::block_on(memory.pop()) {
            return Err(DrawError::Memory(format!("{} is out of memory: {error}", self.description())));
        }
        let lost = self.fault.lock().map_or(None, |fault| fault.clone());
        match faults.into_iter().flatten().map(|error| error.to_string()).next().or(lost) {
            Some(message) => Err(DrawError::Device(message)),
            None => Ok(result),
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

/// Puts the pixels of a tile, row by row, into their places, as far as they are in the region.
fn fill_tile(ids: &mut [i32], region: Region, columns: u32, tile: u32, pixels: &[i32]) {
    let (x, y) = (tile % columns * TILE, tile / columns * TILE);
    let width = TILE.min(region.width - x) as usize;
    for row in 0..TILE.min(region.height - y) {
        let at = (y + row) as usize * region.width as usize + x as usize;
        let from = (row * TILE) as usize;
        ids[at..at + width].copy_from_slice(&pixels[from..from + width]);
    }
}
