//! A scene on its way to the device: put in order, and sent a part at a time.

use std::{
    num::NonZeroU64,
    ops::Range,
    sync::{Arc, atomic::Ordering},
};

use rayon::prelude::*;

use crate::{
    kept::{Chunk, Layout, Uploaded},
    plan::{Fixed, Record},
    shared::{Failure, Shared},
};
use planisphere_core::{
    cover::Cover,
    drawing::{Control, DrawError},
    host::Host,
    ids::SortedIndex,
    order::{Ordered, has_room},
    scene::Scene,
};

/// Spheres that are sent at a time, so that the host never holds a second copy of a large scene.
const PART: usize = 1 << 16;

/// Device memory of some spheres.
pub fn bytes(spheres: usize) -> u64 {
    (spheres * size_of::<Record>()) as u64
}

/// What is sent, and how.
pub struct Upload<'a> {
    /// Where to.
    pub shared: &'a Shared,
    /// The scene.
    pub scene: &'a Scene,
    /// How it shall lie there.
    pub layout: Layout,
    /// A look at the machine's memory.
    pub host: &'a Host,
    /// Ends it, and is told how far it is.
    pub control: &'a Control,
}

impl Upload<'_> {
    /// Puts the scene on the device, in order if that is worth it. No lock may be held here: rayon
    /// works.
    pub fn run(&self) -> Result<Uploaded, DrawError> {
        let Self { scene, layout, .. } = *self;
        let fixed = Fixed::new(&scene.bounds());
        let mut chunks = Vec::new();
        let (mut ordered, mut taken) = (None, 0);
        if let Some(fixed) = &fixed {
            if scene.len() >= layout.order && has_room(scene, self.host) {
                ordered = Ordered::coarse(scene, layout.chunk, self.control)?.map(Arc::new);
            }
            let places = ordered.as_ref().map_or(scene.len(), |ordered| ordered.len());
            for start in (0..places).step_by(layout.chunk) {
                let range = start..places.min(start + layout.chunk);
                // If it cannot be had, nothing is sent.
                let buffer = self.shared.guarded(|| Ok(self.buffer(range.len())))?;
                let send = || self.send(fixed, ordered.as_deref(), range.clone(), places, &buffer);
                self.shared.guarded(send)?;
                taken += bytes(range.len());
                chunks.push(Chunk { range, buffer });
            }
        }
        let large = match &ordered {
            _ if scene.len() < layout.cover || !Cover::may_be(scene) => Vec::new(),
            Some(ordered) => ordered.places_of(scene.large()),
            // Where there is no order, a sphere's place is its index.
            None => scene.large().iter().map(|index| Some(SortedIndex(index.0))).collect(),
        };
        let (identity, alive) = (scene.identity(), scene.alive());
        Ok(Uploaded { identity, alive, layout, fixed, chunks, bytes: taken, ordered, large })
    }

    /// A buffer for some spheres.
    fn buffer(&self, spheres: usize) -> wgpu::Buffer {
        self.shared.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("spheres"),
            size: bytes(spheres),
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        })
    }

    /// Writes the records of a chunk, one of all `places`.
    fn send(
        &self,
        fixed: &Fixed,
        ordered: Option<&Ordered>,
        range: Range<usize>,
        places: usize,
        buffer: &wgpu::Buffer,
    ) -> Result<(), Failure> {
        let Self { shared, scene, control, .. } = *self;
        let mut records = Vec::new();
        for start in range.clone().step_by(PART) {
            control.check()?;
            let part = start..range.end.min(start + PART);
            let (at, end) = (bytes(start - range.start), part.end);
            let Some(size) = NonZeroU64::new(bytes(part.len())) else { continue };
            part.into_par_iter()
                .with_min_len(1 << 12)
                .map(|place| {
                    let (block, at) = ordered
                        .map_or_else(|| scene.locate(place), |ordered| (&ordered.block, place));
                    fixed.record(block.center(at), block.radius(at))
                })
                .collect_into_vec(&mut records);
            if let Some(mut view) = shared.queue.write_buffer_with(buffer, at, size) {
                view.copy_from_slice(bytemuck::cast_slice(&records));
            }
            shared.sent.fetch_add(size.get(), Ordering::Relaxed);
            // Staging memory is freed when the device is done with it.
            shared.queue.submit([]);
            shared.tidy()?;
            control.reach(end as f32 / places as f32);
        }
        Ok(())
    }
}
