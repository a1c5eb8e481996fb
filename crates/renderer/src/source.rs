//! Where engines come from: what a renderer opened once, and hands out to many pictures.

#[cfg(feature = "gpu")]
use std::sync::Arc;

#[cfg(feature = "gpu")]
use planisphere_gpu::{Gpu, wgpu};

use crate::{
    Device, Error,
    engine::{AS_ASKED, Engine, Opened, PassedOver},
};

/// What was opened, and why this.
#[derive(Clone)]
pub(crate) struct Source {
    pub device: Device,
    /// The device in words.
    pub description: String,
    pub why: String,
    /// Adapters that were looked at and not taken.
    pub passed_over: Vec<PassedOver>,
    /// The opened GPU; none for native code.
    #[cfg(feature = "gpu")]
    gpu: Option<Arc<Gpu>>,
    /// Where that is the caller's device.
    #[cfg(feature = "gpu")]
    pub host: Option<Host>,
}

/// A device that is the caller's, and its queue.
#[cfg(feature = "gpu")]
#[derive(Clone)]
pub(crate) struct Host {
    pub device: wgpu::Device,
    pub queue: wgpu::Queue,
}

/// What draws, as far as a plan depends on it.
#[derive(Clone, Debug, PartialEq)]
#[cfg(all(feature = "files", feature = "parts"))]
pub(crate) enum Means {
    /// Native code, on so many threads.
    Cpu {
        /// Threads.
        threads: usize,
    },
    /// wgpu.
    #[cfg(feature = "gpu")]
    Gpu(planisphere_gpu::plan::Capacity),
}

impl Source {
    /// Native code.
    pub fn cpu() -> Self {
        let (description, why) = ("cpu".into(), AS_ASKED.into());
        Self {
            device: Device::Cpu,
            description,
            why,
            passed_over: Vec::new(),
            #[cfg(feature = "gpu")]
            gpu: None,
            #[cfg(feature = "gpu")]
            host: None,
        }
    }

    /// Any device.
    pub fn open(device: &Device) -> Result<Self, Error> {
        let Opened { device: engine, why, passed_over } = Engine::open_telling(device)?;
        let (device, description) = (device.clone(), engine.description());
        Ok(Self {
            device,
            description,
            why,
            passed_over,
            #[cfg(feature = "gpu")]
            gpu: match engine {
                Engine::Cpu(_) => None,
                Engine::Gpu(hybrid) => Some(Arc::new(hybrid.gpu)),
            },
            #[cfg(feature = "gpu")]
            host: None,
        })
    }

    /// A device of the caller's.
    #[cfg(feature = "gpu")]
    pub fn of_host(gpu: Gpu, host: Host) -> Self {
        let (description, why) = (gpu.description(), "a device of the caller's".into());
        let (gpu, host) = (Some(Arc::new(gpu)), Some(host));
        Self { device: Device::Gpu, description, why, passed_over: Vec::new(), gpu, host }
    }

    /// One more engine: of a GPU, a workspace beside the others.
    pub fn engine(&self) -> Engine {
        #[cfg(feature = "gpu")]
        if let Some(gpu) = &self.gpu {
            return Engine::of(gpu.beside());
        }
        Engine::cpu()
    }

    /// What draws; native code does on so many threads.
    #[cfg(all(feature = "files", feature = "parts"))]
    pub fn means(&self, threads: usize) -> Means {
        #[cfg(feature = "gpu")]
        if let Some(gpu) = &self.gpu {
            return Means::Gpu(gpu.capacity());
        }
        Means::Cpu { threads }
    }
}
