//! An opened device: which one is taken, and who draws what it leaves.
//!
//! This crate is the only one that knows both devices: a GPU says what it leaves, and [`Hybrid`]
//! has the CPU draw it.

use std::{fmt, str::FromStr, sync::OnceLock, time::Instant};

use planisphere_core::{
    camera::{Region, View},
    cpu::{Cpu, Piece},
    drawing::{Control, DrawError, Drawing},
    host::Host,
    scene::Scene,
};
#[cfg(feature = "gpu")]
use planisphere_gpu::{
    Gpu,
    adapters::{self, AdapterChoice, NoAdapter},
};

use crate::Error;
#[cfg(feature = "gpu")]
use crate::hybrid::Hybrid;
#[cfg(feature = "gpu")]
pub use planisphere_gpu::adapters::PassedOver;

/// An adapter that was not taken: without the GPU device none is looked at.
#[cfg(not(feature = "gpu"))]
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum PassedOver {}

/// The clock and the memory of this machine.
pub fn host() -> Host {
    static BEGIN: OnceLock<Instant> = OnceLock::new();
    Host {
        milliseconds: || BEGIN.get_or_init(Instant::now).elapsed().as_secs_f64() * 1e3,
        has_room: |bytes| planisphere_memory::available().is_none_or(|left| left > bytes),
    }
}

/// Why a drawing failed.
pub(crate) fn device_error(engine: &Engine, error: DrawError) -> Error {
    match error {
        DrawError::Device(words) if engine.is_lost() => Error::DeviceLost { words },
        other => other.into(),
    }
}

/// Where to draw. The picture is the same on all devices.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Device {
    /// A hardware GPU if there is one, else the CPU; [`crate::Renderer::why`] says which and why.
    #[default]
    Auto,
    /// Any adapter, the software one included.
    Gpu,
    /// The native path; needs no driver.
    Cpu,
    /// The adapter whose name contains this, in any case.
    Named(String),
}

/// As people write it: `auto`, `gpu`, `cpu`, or part of an adapter's name.
impl fmt::Display for Device {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Auto => "auto",
            Self::Gpu => "gpu",
            Self::Cpu => "cpu",
            Self::Named(name) => name,
        })
    }
}

/// Read in any case; anything else is part of an adapter's name.
impl FromStr for Device {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        match text.trim().to_ascii_lowercase().as_str() {
            "auto" => Ok(Self::Auto),
            "gpu" => Ok(Self::Gpu),
            "cpu" => Ok(Self::Cpu),
            "" => Err("write auto, gpu, cpu, or part of an adapter's name"),
            _ => Ok(Self::Named(text.into())),
        }
    }
}

/// Why there is no device.
#[derive(Debug, thiserror::Error)]
pub enum DeviceError {
    /// No adapter fits; says what was tried and what to install.
    #[error("{0}")]
    NoAdapter(String),
}

#[cfg(feature = "gpu")]
impl From<NoAdapter> for DeviceError {
    fn from(NoAdapter(words): NoAdapter) -> Self {
        Self::NoAdapter(words)
    }
}

/// An opened device.
#[derive(Debug)]
pub enum Engine {
    /// The native path.
    Cpu(Box<Cpu>),
    /// wgpu on any adapter, and the native path for what it leaves.
    #[cfg(feature = "gpu")]
    Gpu(Box<Hybrid>),
}

/// A device that was opened, and why this one.
#[derive(Debug)]
pub struct Opened {
    /// The device.
    pub device: Engine,
    /// Why it was taken, in words: as asked for, or what `Auto` found, or which hardware could not
    /// be used.
    pub why: String,
    /// Adapters that were looked at before and not taken.
    pub passed_over: Vec<PassedOver>,
}

impl Opened {
    /// Whether people should be told: the choice was left to us, or hardware was passed over.
    #[must_use]
    pub fn is_news(&self, choice: &Device) -> bool {
        *choice == Device::Auto || self.why != AS_ASKED
    }
}

/// Why a device was taken that was asked for.
pub(crate) const AS_ASKED: &str = "as asked for";

/// Why there is no GPU where the feature was left out.
#[cfg(not(feature = "gpu"))]
const NOT_BUILT: &str = "this program was built without the GPU device";

impl Engine {
    /// Opens a device.
    ///
    /// # Errors
    /// When none fits.
    pub fn open(choice: &Device) -> Result<Self, DeviceError> {
        Self::open_telling(choice).map(|opened| opened.device)
    }

    /// Opens a device, and tells why this one.
    ///
    /// # Errors
    /// When none fits.
    pub fn open_telling(choice: &Device) -> Result<Opened, DeviceError> {
        let asked = |device| Opened { device, why: AS_ASKED.into(), passed_over: Vec::new() };
        match choice {
            Device::Cpu => Ok(asked(Self::cpu())),
            #[cfg(feature = "gpu")]
            Device::Auto => Ok(Self::open_best()),
            #[cfg(feature = "gpu")]
            Device::Gpu => Self::open_adapter(&AdapterChoice::Any),
            #[cfg(feature = "gpu")]
            Device::Named(name) => Self::open_adapter(&AdapterChoice::Named(name.clone())),
            #[cfg(not(feature = "gpu"))]
            Device::Auto => Ok(Opened { why: NOT_BUILT.into(), ..asked(Self::cpu()) }),
            #[cfg(not(feature = "gpu"))]
            Device::Gpu | Device::Named(_) => Err(DeviceError::NoAdapter(format!(
                "{NOT_BUILT}; build it with the feature `gpu`, or take the CPU"
            ))),
        }
    }

    pub(crate) fn cpu() -> Self {
        Self::Cpu(Box::new(Cpu::default().on(host())))
    }

    /// A hardware GPU if there is one, else the CPU.
    #[cfg(feature = "gpu")]
    fn open_best() -> Opened {
        if !adapters::may_have_hardware() {
            let why = adapters::why_auto(false, &[], &[], None);
            return Opened { device: Self::cpu(), why, passed_over: Vec::new() };
        }
        let drivers = adapters::named_drivers();
        let (gpu, passed_over) = Gpu::open_telling(&AdapterChoice::Hardware);
        let nodes = if gpu.is_none() { adapters::nodes() } else { Vec::new() };
        let why = adapters::why_auto(gpu.is_some(), &passed_over, &nodes, drivers.as_deref());
        Opened { device: gpu.map_or_else(Self::cpu, Self::of), why, passed_over }
    }

    #[cfg(feature = "gpu")]
    fn open_adapter(choice: &AdapterChoice) -> Result<Opened, DeviceError> {
        let (gpu, passed_over) = Gpu::open_telling(choice);
        let drivers = adapters::named_drivers();
        let gpu = gpu.ok_or_else(|| adapters::none(choice, &passed_over, drivers.as_deref()))?;
        let why = adapters::why_asked(&passed_over).unwrap_or_else(|| AS_ASKED.into());
        Ok(Opened { device: Self::of(gpu), why, passed_over })
    }

    #[cfg(feature = "gpu")]
    pub(crate) fn of(gpu: Gpu) -> Self {
        Self::Gpu(Box::new(Hybrid::new(gpu)))
    }

    /// The device in words, for people.
    pub fn description(&self) -> String {
        match self {
            Self::Cpu(_) => "cpu".into(),
            #[cfg(feature = "gpu")]
            Self::Gpu(hybrid) => hybrid.gpu.description(),
        }
    }

    /// Lends memory for the next ids.
    pub fn lend(&mut self, ids: Vec<i32>) {
        match self {
            Self::Cpu(cpu) => cpu.lend(ids),
            #[cfg(feature = "gpu")]
            Self::Gpu(hybrid) => hybrid.lend(ids),
        }
    }

    /// Whether the device is gone for good.
    pub fn is_lost(&self) -> bool {
        match self {
            Self::Cpu(_) => false,
            #[cfg(feature = "gpu")]
            Self::Gpu(hybrid) => hybrid.gpu.is_lost(),
        }
    }

    /// Why the last drawing was left to the CPU as a whole, if it was.
    pub fn stood_in(&self) -> Option<&str> {
        match self {
            Self::Cpu(_) => None,
            #[cfg(feature = "gpu")]
            Self::Gpu(hybrid) => hybrid.stood_in(),
        }
    }

    /// Drawings on this device end when this is cancelled.
    pub fn controlled_by(&mut self, control: &Control) {
        match self {
            Self::Cpu(cpu) => cpu.controlled_by(control),
            #[cfg(feature = "gpu")]
            Self::Gpu(hybrid) => hybrid.controlled_by(control),
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
        self.draw_piece(scene, view, region, None)
    }

    /// The same, as a piece of a picture that is drawn in several.
    ///
    /// # Errors
    /// As [`Engine::draw`].
    pub fn draw_piece(
        &mut self,
        scene: &Scene,
        view: &View,
        region: Region,
        piece: Option<Piece>,
    ) -> Result<Drawing, DrawError> {
        match self {
            Self::Cpu(cpu) => cpu.draw_piece(scene, view, region, piece),
            #[cfg(feature = "gpu")]
            Self::Gpu(hybrid) => hybrid.draw_piece(scene, view, region, piece),
        }
    }
}
