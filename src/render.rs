//! A device draws a scene: the one entry for every caller.

use std::time::Instant;

use crate::{
    camera::{Region, View},
    cpu::{self, Cpu},
    drawing::{Cancel, DrawError, Drawing},
    gpu::{
        self, Answer, Gpu,
        adapters::{self, AdapterChoice, NoAdapter, PassedOver},
    },
    scene::Scene,
};

/// Which device to take.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum DeviceChoice {
    /// A hardware GPU if there is one, else the CPU.
    Auto,
    /// Any adapter, the software one included.
    Gpu,
    /// The native path; needs no driver.
    Cpu,
    /// The adapter whose name contains this, in any case.
    Named(String),
}

/// Why there is no device.
#[derive(Debug, thiserror::Error)]
pub enum DeviceError {
    /// No adapter fits; says what was tried and what to install.
    #[error("{0}")]
    NoAdapter(String),
}

impl From<NoAdapter> for DeviceError {
    fn from(NoAdapter(words): NoAdapter) -> Self {
        Self::NoAdapter(words)
    }
}

/// An opened device.
pub enum Device {
    /// The native path.
    Cpu(Box<Cpu>),
    /// wgpu on any adapter, and the native path for what it leaves.
    Gpu(Box<Hybrid>),
}

/// Frames of a scene that a GPU is not asked for after one of which it left all to the CPU.
pub const REST: usize = 15;

/// A GPU, and the CPU for what the GPU cannot draw or had better not: scenes whose numbers it cannot
/// hold, and pictures in which nearly every pixel is hard.
pub struct Hybrid {
    /// The GPU.
    pub gpu: Gpu,
    cpu: Cpu,
    cancel: Cancel,
    effort: cpu::Effort,
    /// How many frames the GPU rests after one that it left to the CPU.
    rest: usize,
    /// How many of them are left.
    resting: usize,
    /// [`Scene::identity`] of what was drawn last.
    drawn: Option<u64>,
}

impl Hybrid {
    /// With an opened GPU.
    pub fn new(gpu: Gpu) -> Self {
        let effort = cpu::Effort { order: gpu::Effort::default().order, ..cpu::Effort::default() };
        let cpu = Cpu::with(effort);
        Self { gpu, cpu, cancel: Cancel::new(), effort, rest: REST, resting: 0, drawn: None }
    }

    /// With other thresholds, to test that they do not show.
    pub fn set_effort(&mut self, gpu: gpu::Effort, cpu: cpu::Effort, rest: usize) {
        self.gpu.set_effort(gpu);
        (self.effort, self.rest, self.drawn) = (cpu, rest, None);
    }

    /// Drawings end when this is cancelled.
    pub fn cancel_on(&mut self, cancel: &Cancel) {
        self.cancel = cancel.clone();
        self.cpu.cancel_on(cancel);
        self.gpu.cancel_on(cancel);
    }

    /// Draws a region of a view of a scene. After a picture that the GPU left to the CPU as a whole,
    /// the next frames of the same scene are drawn by the CPU alone.
    ///
    /// # Errors
    /// As [`Device::draw`].
    pub fn draw(
        &mut self,
        scene: &Scene,
        view: &View,
        region: Region,
    ) -> Result<Drawing, DrawError> {
        if self.drawn != Some(scene.identity()) {
            (self.cpu, self.resting) = (Cpu::with(self.effort), 0);
            self.cpu.cancel_on(&self.cancel);
            self.drawn = Some(scene.identity());
        }
        if self.resting > 0 {
            self.resting -= 1;
            return self.draw_on_host(scene, view, region);
        }
        let (mut drawing, left) = match self.gpu.draw(scene, view, region)? {
            Answer::Drawn(drawing, left) => (drawing, left),
            Answer::Unfit => return self.draw_on_host(scene, view, region),
        };
        if left == [region] {
            self.resting = self.rest;
        }
        for band in left {
            let begin = Instant::now();
            let part = self.draw_on_host(scene, view, band)?;
            let first = (band.y - region.y) as usize * region.width as usize;
            drawing.ids[first..first + part.ids.len()].copy_from_slice(&part.ids);
            drawing.counts.exact += part.counts.exact;
            drawing.times.decide += begin.elapsed().as_secs_f64() * 1e3;
        }
        Ok(drawing)
    }

    /// All pixels of a region by the CPU.
    fn draw_on_host(
        &mut self,
        scene: &Scene,
        view: &View,
        region: Region,
    ) -> Result<Drawing, DrawError> {
        if let Some(ordered) = self.gpu.ordered() {
            self.cpu.adopt(scene, ordered);
        }
        let mut drawing = self.cpu.draw(scene, view, region)?;
        drawing.counts.undecided = region.pixels();
        Ok(drawing)
    }
}

/// A device that was opened, and why this one.
pub struct Opened {
    /// The device.
    pub device: Device,
    /// Why it was taken, in words: as asked for, or what `Auto` found, or which hardware could not
    /// be used.
    pub why: String,
    /// Adapters that were looked at before and not taken.
    pub passed_over: Vec<PassedOver>,
}

impl Opened {
    /// Whether people should be told: the choice was left to us, or hardware was passed over.
    #[must_use]
    pub fn is_news(&self, choice: &DeviceChoice) -> bool {
        *choice == DeviceChoice::Auto || self.why != AS_ASKED
    }
}

/// Why a device was taken that was asked for.
const AS_ASKED: &str = "as asked for";

impl Device {
    /// Opens a device.
    ///
    /// # Errors
    /// When none fits.
    pub fn open(choice: &DeviceChoice) -> Result<Self, DeviceError> {
        Self::open_telling(choice).map(|opened| opened.device)
    }

    /// Opens a device, and tells why this one.
    ///
    /// # Errors
    /// When none fits.
    pub fn open_telling(choice: &DeviceChoice) -> Result<Opened, DeviceError> {
        let cpu = || Self::Cpu(Box::default());
        let drivers = adapters::named_drivers();
        match choice {
            DeviceChoice::Cpu => {
                Ok(Opened { device: cpu(), why: AS_ASKED.into(), passed_over: Vec::new() })
            }
            DeviceChoice::Auto if !adapters::may_have_hardware() => Ok(Opened {
                device: cpu(),
                why: adapters::why_auto(false, &[], &[], None),
                passed_over: Vec::new(),
            }),
            DeviceChoice::Auto => {
                let (gpu, passed_over) = Gpu::open_telling(&AdapterChoice::Hardware);
                let nodes = if gpu.is_none() { adapters::nodes() } else { Vec::new() };
                let why =
                    adapters::why_auto(gpu.is_some(), &passed_over, &nodes, drivers.as_deref());
                Ok(Opened { device: gpu.map_or_else(cpu, Self::of), why, passed_over })
            }
            DeviceChoice::Gpu => Self::open_adapter(&AdapterChoice::Any),
            DeviceChoice::Named(name) => Self::open_adapter(&AdapterChoice::Named(name.clone())),
        }
    }

    fn open_adapter(choice: &AdapterChoice) -> Result<Opened, DeviceError> {
        let (gpu, passed_over) = Gpu::open_telling(choice);
        let drivers = adapters::named_drivers();
        let gpu = gpu.ok_or_else(|| adapters::none(choice, &passed_over, drivers.as_deref()))?;
        let why = adapters::why_asked(&passed_over).unwrap_or_else(|| AS_ASKED.into());
        Ok(Opened { device: Self::of(gpu), why, passed_over })
    }

    fn of(gpu: Gpu) -> Self {
        Self::Gpu(Box::new(Hybrid::new(gpu)))
    }

    /// The device in words, for people.
    pub fn description(&self) -> String {
        match self {
            Self::Cpu(_) => "cpu".into(),
            Self::Gpu(hybrid) => hybrid.gpu.description(),
        }
    }

    /// Drawings on this device end when this is cancelled.
    pub fn cancel_on(&mut self, cancel: &Cancel) {
        match self {
            Self::Cpu(cpu) => cpu.cancel_on(cancel),
            Self::Gpu(hybrid) => hybrid.cancel_on(cancel),
        }
    }

    /// Draws a region of a view of a scene.
    ///
    /// # Errors
    /// When there is no such picture, it was cancelled, the device fails, or memory does
    /// not suffice.
    pub fn draw(
        &mut self,
        scene: &Scene,
        view: &View,
        region: Region,
    ) -> Result<Drawing, DrawError> {
        match self {
            Self::Cpu(cpu) => cpu.draw(scene, view, region),
            Self::Gpu(hybrid) => hybrid.draw(scene, view, region),
        }
    }
}
