//! Passes of a plan, run: tables and entries to the device, dispatches, ids back.

use std::{
    mem::MaybeUninit,
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
};

use super::{
    kept::Chunk,
    lists::{Spheres, Wave},
    memory::Growing,
    shared::{Failure, Shared},
};
use crate::plan::{self, Band, Eye, FRESH, LAST, Pass, Segment, TILE, TILE_PIXELS};
use planisphere_core::{
    camera::Region,
    drawing::{Control, DrawError},
    ids::{NONE, Slot, SortedIndex, TileIndex, UNDECIDED},
    pool, simd,
};
use planisphere_shaders::{FANS, Lanes, PLANES, STATES, TILES_ALONE, TILES_TOGETHER, Variant};

const SIDE: usize = TILE as usize;

/// What is drawn, from what, and what ends it.
#[derive(Clone, Copy)]
pub struct Work<'a> {
    /// The view.
    pub eye: &'a Eye,
    /// The tiles.
    pub band: &'a Band,
    /// The spheres.
    pub chunk: &'a Chunk,
    /// Is looked at between dispatches.
    pub control: &'a Control,
}

/// Buffers of the frame, and how kernels are run: what a workspace has for itself.
pub struct Executor {
    shared: Arc<Shared>,
    /// How kernels fetch lists.
    pub lanes: Lanes,
    /// Off only in benchmarks.
    pub certain: bool,
    /// Workgroups in one dimension.
    pub workgroups: u32,
    /// What was submitted last.
    last: Option<wgpu::SubmissionIndex>,
    buffers: Buffers,
}

struct Buffers {
    frame: Growing,
    entries: Growing,
    tiles: Growing,
    fans: Growing,
    planes: Growing,
    ids: Growing,
    states: Growing,
    /// Where ids are copied for the host to read; none where it reads them in place.
    staging: Option<Growing>,
}

impl Buffers {
    /// Nothing is allocated yet.
    fn new(shared: &Shared) -> Self {
        use wgpu::BufferUsages as U;
        let storage = U::STORAGE | U::COPY_DST;
        // A device that is software has but one memory.
        let in_place = shared.info.device_type == wgpu::DeviceType::Cpu
            && shared.device.features().contains(wgpu::Features::MAPPABLE_PRIMARY_BUFFERS);
        Self {
            frame: Growing::new("frame", U::UNIFORM | U::COPY_DST),
            entries: Growing::new("entries", storage),
            tiles: Growing::new("tiles", storage),
            fans: Growing::new("fans", storage),
            planes: Growing::new("planes", storage),
            ids: Growing::new("ids", U::STORAGE | if in_place { U::MAP_READ } else { U::COPY_SRC }),
            states: Growing::new("states", U::STORAGE),
            staging: (!in_place).then(|| Growing::new("staging", U::MAP_READ | U::COPY_DST)),
        }
    }
}

/// A mapped buffer, which the device may not use. It is unmapped at the end of its view, whatever
/// ends that.
struct Mapped<'a>(&'a wgpu::Buffer);

impl Drop for Mapped<'_> {
    fn drop(&mut self) {
        self.0.unmap();
    }
}

impl Executor {
    /// Nothing is allocated yet.
    pub fn new(shared: &Arc<Shared>) -> Self {
        Self {
            lanes: shared.lanes,
            certain: true,
            workgroups: shared.device.limits().max_compute_workgroups_per_dimension,
            last: None,
            buffers: Buffers::new(shared),
            shared: Arc::clone(shared),
        }
    }

    /// Another one that runs kernels in the same way.
    pub fn beside(&self) -> Self {
        let Self { lanes, certain, workgroups, .. } = *self;
        Self { lanes, certain, workgroups, ..Self::new(&self.shared) }
    }

    /// Forgets all buffers, of which some may be invalid: what could not be had stays so.
    pub fn forget(&mut self) {
        self.buffers = Buffers::new(&self.shared);
    }

    /// Runs passes. With `slots`, each tile has a single segment in the whole band: it is appended
    /// to `slots`, and its ids lie at that slot of the id buffer. Without, the device merges what a
    /// pass finds into the state of the tile, and [`Executor::finish`] makes ids of the states.
    pub fn run(
        &mut self,
        work: Work,
        wave: &Wave,
        passes: &[Pass],
        mut slots: Option<&mut Vec<TileIndex>>,
    ) -> Result<(), Failure> {
        let Work { eye, band, control, .. } = work;
        let pixels = match &slots {
            Some(_) => passes.iter().map(|pass| pass.segments.len()).sum::<usize>() * TILE_PIXELS,
            None => band.tiles() * TILE_PIXELS,
        };
        self.reserve(pixels, slots.is_none());
        // The host's own bound of where a sphere begins is far below `delta_depth`.
        let lists = wave.lists();
        let disorder = eye.steps(lists.disorder) + 4.0 * eye.frame.delta_depth;
        let mut present = None;
        for (number, pass) in passes.iter().enumerate() {
            control.check()?;
            if present.as_ref() != Some(&pass.window) {
                let Shared { device, queue, .. } = &*self.shared;
                self.buffers.entries.write(device, queue, &lists.entries[pass.window.clone()]);
                present = Some(pass.window.clone());
            }
            let first = slots.as_ref().map(|slots| slots.len() as u32);
            if let Some(slots) = &mut slots {
                slots.extend(pass.segments.iter().map(|segment| segment.tile));
            }
            let place = |k: usize, segment: &Segment| match first {
                Some(first) => (Slot(first + k as u32), FRESH | LAST),
                None => (segment.tile.slot(), if segment.fresh { FRESH } else { 0 }),
            };
            let tiles = tile_table(band, &pass.segments, place);
            let frame = plan::Frame { disorder, ..eye.frame };
            let (kind, merged) = ((pass.clipped, pass.few), first.is_none());
            let submission = self.dispatch(work, frame, kind, merged, &pass.segments, &tiles)?;
            // Uploads of later entries wait in memory until earlier ones are done.
            if passes.get(number + 1).is_none_or(|next| next.window != pass.window) {
                self.shared.wait(submission)?;
                control.check()?;
            }
        }
        Ok(())
    }

    /// Makes ids of what several passes found of some tiles.
    pub fn finish(&mut self, work: Work, met: &[TileIndex]) -> Result<(), Failure> {
        if met.is_empty() {
            return Ok(());
        }
        let Work { eye, band, control, .. } = work;
        control.check()?;
        // An empty list finds nothing new.
        let segments: Vec<Segment> =
            met.iter().map(|&tile| Segment { tile, start: 0, count: 0, fresh: false }).collect();
        let tiles = tile_table(band, &segments, |_, segment| (segment.tile.slot(), LAST));
        let submission = self.dispatch(work, eye.frame, (false, false), true, &segments, &tiles)?;
        self.shared.wait(submission)?;
        Ok(control.check()?)
    }

    fn reserve(&mut self, pixels: usize, states: bool) {
        let device = &self.shared.device;
        self.buffers.ids.reserve(device, (pixels * 4) as u64);
        if states {
            self.buffers.states.reserve(device, (pixels * size_of::<plan::State>()) as u64);
        }
    }

    fn dispatch(
        &mut self,
        work: Work,
        frame: plan::Frame,
        (clipped, few): (bool, bool),
        merged: bool,
        segments: &[Segment],
        tiles: &[plan::Tile],
    ) -> Result<wgpu::SubmissionIndex, DrawError> {
        let Work { eye, band, chunk, .. } = work;
        let variant = Variant {
            projection: eye.projection(),
            clipped,
            merged,
            certain: self.certain,
            lanes: self.lanes,
            few,
        };
        let compiled = self.shared.pipeline(variant)?;
        let Shared { device, queue, dispatches, .. } = &*self.shared;
        let buffers = &mut self.buffers;
        buffers.tiles.write(device, queue, tiles);
        let bindings = variant.bindings();
        let has = |number| bindings.iter().any(|b| b.0 == number);
        let places = segments.iter().map(|segment| band.place(segment.tile));
        if has(FANS) {
            let fans: Vec<_> = places.clone().map(|place| place.fan).collect();
            buffers.fans.write(device, queue, &fans);
        }
        if has(PLANES) {
            let planes: Vec<_> = places.map(|place| place.planes).collect();
            buffers.planes.write(device, queue, &planes);
        }
        let together = if self.lanes == Lanes::Eight { TILES_TOGETHER } else { TILES_ALONE };
        let groups = (tiles.len() as u32).div_ceil(together);
        let row = groups.min(self.workgroups);
        let frame = plan::Frame {
            first: chunk.range.start as u32,
            tiles: tiles.len() as u32,
            row,
            ..frame
        };
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
        let entries: Vec<_> = bindings
            .iter()
            .map(|&(binding, _)| wgpu::BindGroupEntry { binding, resource: resource(binding) })
            .collect();
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &compiled.layout,
            entries: &entries,
        });
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        {
            let mut compute = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            compute.set_pipeline(&compiled.pipeline);
            compute.set_bind_group(0, &group, &[]);
            compute.dispatch_workgroups(row, groups.div_ceil(row), 1);
        }
        dispatches.fetch_add(1, Ordering::Relaxed);
        let submission = queue.submit([encoder.finish()]);
        self.last = Some(submission.clone());
        Ok(submission)
    }

    /// Brings the ids of the first slots back, 64 a slot.
    pub fn read_back<T>(
        &mut self,
        slots: usize,
        take: impl FnOnce(&[i32]) -> Result<T, DrawError>,
    ) -> Result<T, Failure> {
        let size = (slots * TILE_PIXELS * 4) as u64;
        if size == 0 {
            return Ok(take(&[])?);
        }
        let Shared { device, queue, .. } = &*self.shared;
        let (Some(ids), Some(mut submission)) = (self.buffers.ids.get(), self.last.clone()) else {
            return Err(DrawError::Device("there are no ids to bring back".into()).into());
        };
        let readable = match &mut self.buffers.staging {
            None => ids.clone(),
            Some(staging) => {
                let staging = staging.reserve(device, size);
                let mut encoder =
                    device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
                encoder.copy_buffer_to_buffer(ids, 0, staging, 0, size);
                submission = queue.submit([encoder.finish()]);
                staging.clone()
            }
        };
        let slice = readable.slice(..size);
        let (sender, receiver) = std::sync::mpsc::channel();
        slice.map_async(wgpu::MapMode::Read, move |result| {
            let _ = sender.send(result);
        });
        // Only for what this workspace submitted: others may have much in the queue.
        self.shared.wait(submission)?;
        // If another thread came first to what is mapped now, it is about to tell.
        receiver.recv().map_err(Failure::silent)?.map_err(Failure::silent)?;
        let _mapped = Mapped(&readable);
        let view =
            slice.get_mapped_range().map_err(|error| DrawError::Device(format!("{error:?}")))?;
        Ok(take(bytemuck::cast_slice(&view))?)
    }
}

/// The tiles of some segments as the device has them: each at the slot, and with the flags, that
/// `place` gives.
fn tile_table(
    band: &Band,
    segments: &[Segment],
    place: impl Fn(usize, &Segment) -> (Slot, u32),
) -> Vec<plan::Tile> {
    let tile = |(k, segment): (usize, &Segment)| {
        let (slot, flags) = place(k, segment);
        plan::Tile {
            start: segment.start,
            count: segment.count,
            slot: slot.0 | flags,
            ..band.place(segment.tile).tile
        }
    };
    segments.iter().enumerate().map(tile).collect()
}

/// The most rows of tiles that a thread copies at a time. Their undecided pixels are resolved
/// together.
const ROWS: usize = 8;

/// What is known of a band when the device is done.
#[derive(Clone, Copy)]
pub struct Answers<'a> {
    /// The band.
    pub region: Region,
    /// Tiles in a row.
    pub columns: u32,
    /// Where the pixels of each tile lie among those brought back, or what stands for a slot.
    pub slots: &'a [Slot],
    /// What is seen of each tile where nothing was found.
    pub backgrounds: &'a [i32],
    /// What is drawn.
    pub spheres: Spheres<'a>,
    /// Is looked at now and then.
    pub control: &'a Control,
}

impl Answers<'_> {
    /// Writes the ids of the whole band: the device's answers, `found`, over the tiles'
    /// backgrounds.
    ///
    /// Each thread copies a few rows of tiles. If pixels of these are undecided, it calls `at_once`
    /// with their tiles in ascending order, the first row of tiles, and the ids of all the rows;
    /// `at_once` returns whether it resolved them. Returns the tiles that are still undecided, in
    /// ascending order, each with a mask of its undecided pixels. Unless it fails, all ids are
    /// written.
    pub fn fill(
        &self,
        ids: &mut [MaybeUninit<i32>],
        found: &[i32],
        at_once: impl Fn(&[(TileIndex, Pixels)], u32, &mut [i32]) -> bool + Sync,
    ) -> Result<Vec<(TileIndex, Pixels)>, DrawError> {
        let (width, columns) = (self.region.width as usize, self.columns as usize);
        let left_over = Mutex::new(Vec::new());
        let skipped = AtomicBool::new(false);
        // Four pieces a thread, as some are sooner done than others.
        let rows = (self.slots.len() / columns / (4 * rayon::current_num_threads())).clamp(1, ROWS);
        pool::each_of(ids.chunks_mut(width * SIDE * rows).enumerate(), |(piece, ids)| {
            if self.control.is_cancelled() {
                return skipped.store(true, Ordering::Relaxed);
            }
            let mut open = Vec::new();
            for (row, ids) in ids.chunks_mut(width * SIDE).enumerate() {
                self.fill_row(piece * rows + row, ids, found, &mut open);
            }
            if open.is_empty() {
                return;
            }
            // SAFETY: `fill_row` wrote all of each row.
            let ids = unsafe { ids.assume_init_mut() };
            if !at_once(&open, (piece * rows) as u32, ids) {
                left_over.lock().unwrap_or_else(PoisonError::into_inner).append(&mut open);
            }
        });
        if skipped.into_inner() {
            return Err(DrawError::Cancelled);
        }
        let mut left_over = left_over.into_inner().unwrap_or_else(PoisonError::into_inner);
        left_over.sort_unstable();
        Ok(left_over)
    }

    /// Writes all pixels of a row of tiles, and appends what is left over there.
    fn fill_row(
        &self,
        row: usize,
        ids: &mut [MaybeUninit<i32>],
        found: &[i32],
        open: &mut Vec<(TileIndex, Pixels)>,
    ) {
        let (width, columns) = (self.region.width as usize, self.columns as usize);
        let of_row = row * columns..(row + 1) * columns;
        let (slots, backgrounds) = (&self.slots[of_row.clone()], &self.backgrounds[of_row]);
        // Backgrounds first, one row of pixels after the other, because memory is written fastest
        // in order. The device's ids follow while these rows are still in the cache.
        let mut runs: Vec<(usize, i32)> = Vec::new();
        for (column, (&slot, &background)) in slots.iter().zip(backgrounds).enumerate() {
            let id = if slot == Slot::HOST { UNDECIDED } else { background };
            let end = ((column + 1) * SIDE).min(width);
            match runs.last_mut() {
                Some(last) if last.1 == id => last.0 = end,
                _ => runs.push((end, id)),
            }
        }
        for ids in ids.chunks_mut(width) {
            let mut first = 0;
            for &(end, id) in &runs {
                simd::dispatch(simd::Fill { to: &mut ids[first..end], value: id });
                first = end;
            }
        }
        let height = ids.len() / width;
        let drawn = |(_, slot): &(usize, &Slot)| **slot != Slot::BACKGROUND;
        for (column, &slot) in slots.iter().enumerate().filter(drawn) {
            let first = column * SIDE;
            let across = SIDE.min(width - first);
            let mut pixels = Pixels::MAX;
            if slot != Slot::HOST {
                let found = &found[slot.at() * TILE_PIXELS..][..TILE_PIXELS];
                for (row, ids) in ids.chunks_mut(width).enumerate() {
                    for (id, column) in
                        ids[first..first + across].iter_mut().zip(found.chunks_exact(SIDE))
                    {
                        let place = column[row];
                        if place != NONE {
                            id.write(if place < 0 {
                                UNDECIDED
                            } else {
                                self.spheres.index(SortedIndex(place as u32)).id()
                            });
                        }
                    }
                }
                if found.iter().all(|&place| place >= NONE) {
                    continue;
                }
                pixels = found
                    .iter()
                    .rev()
                    .fold(0, |open, &place| open << 1 | Pixels::from(place < NONE));
            }
            let tile = TileIndex((row * columns + column) as u32);
            open.push((tile, pixels & inside(across, height)));
        }
    }
}

/// Some pixels of a tile, column by column, a bit for each.
pub type Pixels = u64;

/// The pixels of a tile in its first columns and rows.
fn inside(across: usize, height: usize) -> Pixels {
    let column = 0xff >> (SIDE - height);
    (0..across).fold(0, |pixels, k| pixels | column << (k * SIDE))
}
