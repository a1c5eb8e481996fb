//! Buffers that grow and are used again, so that a frame like the last allocates nothing.

use std::num::NonZeroU64;

use bytemuck::Pod;

/// A buffer of at least the size that was asked for last.
pub struct Growing {
    label: &'static str,
    usage: wgpu::BufferUsages,
    buffer: Option<wgpu::Buffer>,
    /// Bytes in use.
    used: u64,
}

impl Growing {
    /// Nothing is allocated yet.
    pub fn new(label: &'static str, usage: wgpu::BufferUsages) -> Self {
        Self { label, usage, buffer: None, used: 0 }
    }

    /// The buffer with room for `size` bytes; what was there is lost when it grows.
    pub fn reserve(&mut self, device: &wgpu::Device, size: u64) -> &wgpu::Buffer {
        let size = size.max(256).next_multiple_of(4);
        self.used = size;
        // One that is too small goes before the next is made.
        self.buffer.take_if(|buffer| buffer.size() < size);
        self.buffer.get_or_insert_with(|| {
            // A quarter more, so that a turning camera does not allocate every frame.
            let roomy =
                (size + size / 4).next_multiple_of(256).min(device.limits().max_buffer_size);
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(self.label),
                size: roomy.max(size),
                usage: self.usage,
                mapped_at_creation: false,
            })
        })
    }

    /// Replaces the content.
    pub fn write<T: Pod>(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, values: &[T]) {
        let bytes: &[u8] = bytemuck::cast_slice(values);
        let buffer = self.reserve(device, bytes.len() as u64);
        queue.write_buffer(buffer, 0, bytes);
    }

    /// The buffer, once something was asked for.
    pub fn get(&self) -> Option<&wgpu::Buffer> {
        self.buffer.as_ref()
    }

    /// The part in use.
    ///
    /// # Panics
    /// Before anything was asked for.
    pub fn binding(&self) -> wgpu::BindingResource<'_> {
        let buffer = self.buffer.as_ref().expect("reserved before it is bound");
        wgpu::BindingResource::Buffer(wgpu::BufferBinding {
            buffer,
            offset: 0,
            size: NonZeroU64::new(self.used),
        })
    }
}
