//! A device draws a scene: the one entry for every caller.

use crate::{
    camera::{Region, View},
    cpu::Cpu,
    drawing::{Cancel, DrawError, Drawing},
    gpu::{
        Gpu,
        adapters::{self, PassedOver},
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

/// An opened device.
pub enum Device {
    /// The native path.
    Cpu(Box<Cpu>),
    /// wgpu on any adapter.
    Gpu(Box<Gpu>),
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
                let (gpu, passed_over) = Gpu::open_telling(choice);
                let nodes = if gpu.is_none() { adapters::nodes() } else { Vec::new() };
                let why =
                    adapters::why_auto(gpu.is_some(), &passed_over, &nodes, drivers.as_deref());
                Ok(Opened {
                    device: gpu.map_or_else(cpu, |gpu| Self::Gpu(Box::new(gpu))),
                    why,
                    passed_over,
                })
            }
            DeviceChoice::Gpu | DeviceChoice::Named(_) => {
                let (gpu, passed_over) = Gpu::open_telling(choice);
                let Some(gpu) = gpu else {
                    return Err(adapters::none(choice, &passed_over, drivers.as_deref()));
                };
                let why = adapters::why_asked(&passed_over).unwrap_or_else(|| AS_ASKED.into());
                Ok(Opened { device: Self::Gpu(Box::new(gpu)), why, passed_over })
            }
        }
    }

    /// The device in words, for people.
    pub fn description(&self) -> String {
        match self {
            Self::Cpu(_) => "cpu".into(),
            Self::Gpu(gpu) => gpu.description(),
        }
    }

    /// Drawings on this device end when this is cancelled.
    pub fn cancel_on(&mut self, cancel: &Cancel) {
        match self {
            Self::Cpu(cpu) => cpu.cancel_on(cancel),
            Self::Gpu(gpu) => gpu.cancel_on(cancel),
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
            Self::Gpu(gpu) => gpu.draw(scene, view, region),
        }
    }
}
