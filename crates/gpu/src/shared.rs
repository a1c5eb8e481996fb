//! What all workspaces of a device share: the device itself, its kernels, the scenes that stay on
//! it, and what went wrong. It knows no drawing.
//!
//! wgpu takes calls from several threads at once, waits included: a wait holds nothing that another
//! thread needs to submit or to wait. Its error scopes belong to the thread that opened them. A
//! thread that waits for others inside of rayon may draw another picture meanwhile, as a whole, so
//! that the scopes of that one close before it is back.
//!
//! No lock of this file, or of `kept`, is held while rayon works. One is held while a kernel is
//! compiled, which takes no thread of the pool: others wait for it rather than compile it, too.

use std::{
    collections::HashMap,
    panic::{AssertUnwindSafe, catch_unwind, resume_unwind},
    sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError, atomic::AtomicU64},
    time::Duration,
};

use crate::{
    adapters,
    kept::Kept,
    pipeline::Pipeline,
    plan::{self, Limits, ROUND, Record, TILE_PIXELS, TILES},
};
use planisphere_core::{drawing::DrawError, ids::SortedIndex};
use planisphere_shaders::{Lanes, Variant};

/// A device that does not answer for as long is lost.
const PATIENCE: Duration = Duration::from_secs(600);

/// How wgpu begins to say that a device was lost while it was waited for.
const LOST_IN_POLL: &str = "Error in Device::poll";

/// Why work on a device failed.
#[derive(Debug)]
pub enum Failure {
    /// As said.
    Drawing(DrawError),
    /// The device did not do as it was told. If no error scope says why, it is lost.
    Silent(String),
}

impl From<DrawError> for Failure {
    fn from(error: DrawError) -> Self {
        Self::Drawing(error)
    }
}

impl Failure {
    /// A device that did not do as it was told.
    pub fn silent(words: impl std::fmt::Display) -> Self {
        Self::Silent(words.to_string())
    }
}

/// Compiled, once somebody has.
type Slot = Arc<Mutex<Option<Arc<Pipeline>>>>;

/// A device, and what is the same for all of its workspaces.
pub struct Shared {
    pub device: wgpu::Device,
    pub queue: wgpu::Queue,
    pub info: wgpu::AdapterInfo,
    /// The kernels that it can run.
    pub lanes: Lanes,
    /// What one dispatch may hold.
    pub limits: Limits,
    /// Spheres in one buffer.
    pub chunk: usize,
    /// Scenes that stay on it.
    pub kept: Kept,
    /// Bytes of spheres that were sent.
    pub sent: AtomicU64,
    /// Dispatches.
    pub dispatches: AtomicU64,
    pipelines: Mutex<HashMap<Variant, Slot>>,
    /// What went wrong for good. Callbacks of the device hold it as well.
    fault: Arc<OnceLock<String>>,
}

impl Shared {
    /// With whatever a device was created with.
    ///
    /// # Errors
    /// When it lacks something; says what.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue) -> Result<Self, String> {
        let (info, limits) = (device.adapter_info(), device.limits());
        let lanes = adapters::lanes_of(device)?;
        let binding = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        let binding = binding.min(i32::MAX as u64) as usize;
        Ok(Self {
            device: device.clone(),
            queue: queue.clone(),
            info,
            lanes,
            limits: Limits {
                wave: 1 << 22,
                entries: (binding / size_of::<SortedIndex>()).min(1 << 24),
                tiles: (binding / (TILE_PIXELS * size_of::<plan::State>())).min(TILES),
                few: 0,
                worth: 0,
                round: ROUND,
            },
            // 64 Mi spheres in a buffer are plenty.
            chunk: (binding / size_of::<Record>()).min(1 << 26),
            kept: Kept::new(),
            sent: AtomicU64::new(0),
            dispatches: AtomicU64::new(0),
            pipelines: Mutex::default(),
            fault: Arc::default(),
        })
    }

    /// Listens to what goes wrong outside of any call. Only for a device that nobody else has: it
    /// has one listener of each kind.
    pub fn listen(&self) {
        let fault = Arc::clone(&self.fault);
        self.device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            let _ = fault.set(format!(
                "an error outside of any drawing, after which a new renderer must be opened: \
                 {error}"
            ));
        }));
        let fault = Arc::clone(&self.fault);
        self.device.set_device_lost_callback(move |reason, message| {
            // Dropping the device is no fault.
            if reason != wgpu::DeviceLostReason::Destroyed {
                let _ = fault.set(lost(&message));
            }
        });
    }

    /// The device in words.
    pub fn description(&self) -> String {
        adapters::name(&self.info)
    }

    /// What went wrong for good, if something did: nothing can be drawn any more.
    pub fn fault(&self) -> Option<&str> {
        self.fault.get().map(String::as_str)
    }

    /// Runs something with errors of the device caught.
    pub fn guarded<T>(&self, work: impl FnOnce() -> Result<T, Failure>) -> Result<T, DrawError> {
        let memory = self.device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let validation = self.device.push_error_scope(wgpu::ErrorFilter::Validation);
        let internal = self.device.push_error_scope(wgpu::ErrorFilter::Internal);
        let result = work();
        let faults = [pollster::block_on(internal.pop()), pollster::block_on(validation.pop())];
        if let Some(error) = pollster::block_on(memory.pop()) {
            let words = format!("{} is out of memory: {error}", self.description());
            return Err(DrawError::Memory { needed: None, words });
        }
        let error = faults.into_iter().flatten().next().map(|error| error.to_string());
        match (&error, &result) {
            (Some(error), _) if self.fault().is_none() && self.is_silent() => self.lose(error),
            (None, Err(Failure::Silent(message))) => self.lose(message),
            _ => {}
        }
        let error = self.fault().map(str::to_owned).or(error);
        match (error, result) {
            (Some(words), _) | (None, Err(Failure::Silent(words))) => Err(DrawError::Device(words)),
            (None, Err(Failure::Drawing(error))) => Err(error),
            (None, Ok(done)) => Ok(done),
        }
    }

    fn lose(&self, message: &str) {
        let _ = self.fault.set(lost(message));
    }

    /// Whether the device is lost, where nobody tells: what is made on it is invalid without a
    /// word, until it is used.
    fn is_silent(&self) -> bool {
        let memory = self.device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let validation = self.device.push_error_scope(wgpu::ErrorFilter::Validation);
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("probe"),
            size: 4,
            usage: wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        self.queue.write_buffer(&buffer, 0, &[0; 4]);
        let invalid = pollster::block_on(validation.pop()).is_some();
        let no_room = pollster::block_on(memory.pop()).is_some();
        invalid && !no_room
    }

    /// Until a submission is done.
    pub fn wait(&self, submission: wgpu::SubmissionIndex) -> Result<(), Failure> {
        let poll =
            wgpu::PollType::Wait { submission_index: Some(submission), timeout: Some(PATIENCE) };
        self.poll(poll)
    }

    /// Lets the device free what it is done with.
    pub fn tidy(&self) -> Result<(), Failure> {
        self.poll(wgpu::PollType::Poll)
    }

    fn poll(&self, poll: wgpu::PollType) -> Result<(), Failure> {
        // wgpu panics where the device is lost just now. It holds nothing then.
        match catch_unwind(AssertUnwindSafe(|| self.device.poll(poll))) {
            Ok(polled) => polled.map(|_| ()).map_err(Failure::silent),
            Err(panic) => match panic.downcast_ref::<String>() {
                Some(words) if words.starts_with(LOST_IN_POLL) => Err(Failure::silent(words)),
                _ => resume_unwind(panic),
            },
        }
    }

    /// A kernel, compiled unless it is there.
    pub fn pipeline(&self, variant: Variant) -> Result<Arc<Pipeline>, DrawError> {
        let slot = Arc::clone(lock(&self.pipelines).entry(variant).or_default());
        let mut made = lock(&slot);
        if let Some(pipeline) = &*made {
            return Ok(Arc::clone(pipeline));
        }
        let pipeline = self.guarded(|| Ok(Arc::new(Pipeline::new(&self.device, variant))))?;
        *made = Some(Arc::clone(&pipeline));
        Ok(pipeline)
    }
}

/// That a device is lost.
fn lost(message: &str) -> String {
    format!("it is lost, and a new renderer must be opened: {message}")
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
