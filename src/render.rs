//! A device draws a scene: the one entry for every caller.

use std::sync::{
    Arc,
    atomic::{AtomicBool, Ordering},
};

use crate::{
    bins::Met,
    camera::{Region, View, ViewError},
    cpu::Cpu,
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

/// Ends drawings from outside: from another thread, or from what a person presses.
///
/// Clones are the same. A device that was given one ([`Device::cancel_on`]) looks at it between
/// tiles and between decisions, and `draw` then ends soon, with [`DrawError::Cancelled`].
#[derive(Clone, Debug, Default)]
pub struct Cancel(Arc<AtomicBool>);

impl Cancel {
    /// Not cancelled.
    pub fn new() -> Self {
        Self::default()
    }

    /// Ends what is drawn now, and all that is begun later.
    pub fn cancel(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Whether it was cancelled.
    #[inline]
    pub fn is_cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }

    /// An error once it was cancelled.
    ///
    /// # Errors
    /// [`DrawError::Cancelled`].
    pub fn check(&self) -> Result<(), DrawError> {
        if self.is_cancelled() { Err(DrawError::Cancelled) } else { Ok(()) }
    }
}

/// Why a picture could not be drawn on a device that was opened.
#[derive(Debug, thiserror::Error)]
pub enum DrawError {
    /// There is no such picture: what was asked for is wrong, on every device.
    #[error("{0}")]
    View(#[from] ViewError),
    /// The device failed; its own words.
    #[error("the device failed: {0}")]
    Device(String),
    /// It was cancelled from outside.
    #[error("the drawing was cancelled")]
    Cancelled,
    /// It cannot fit into memory; says what is needed.
    #[error("{0}")]
    Memory(String),
}

/// What was done for a picture, for `--stats`.
#[derive(Clone, Debug, Default, serde::Serialize)]
pub struct Counts {
    /// Spheres in the scene.
    pub spheres: usize,
    /// Pixels of the picture.
    pub pixels: usize,
    /// Spheres that were skipped because no pixel's ray can meet them: off the screen, outside the
    /// clip range, or small and between the rays; not counted where a picture is drawn in bands,
    /// each of which skips others.
    pub outside: Option<usize>,
    /// Spheres that were skipped, or at least this many, because what was drawn before hides them,
    /// or others that are the same; not counted in bands. (On the CPU a sphere over several tiles
    /// may be listed before and after, and then hides one of these. On a GPU a group of neighbours
    /// that is hidden counts in full, wherever its spheres lie.)
    pub hidden: Option<usize>,
    /// Tiles.
    pub tiles: usize,
    /// Tiles that were skipped because no sphere is listed there.
    pub empty: usize,
    /// Entries of tile lists.
    pub entries: usize,
    /// Pixels that spheres were tested at, summed over the spheres.
    pub tests: u64,
    /// Questions (the sign of a number) that the filter left to be decided.
    pub undecided: usize,
    /// Of these, decided by 128-bit integers.
    pub small: usize,
    /// Of these, decided by algebra in integers of any size, because neither 128-bit integers nor
    /// 100 bits could tell.
    pub exact: usize,
}

impl Counts {
    /// Adds those of another part of the same picture.
    pub fn add(&mut self, other: &Self) {
        let only = self.pixels == 0;
        self.outside = other.outside.filter(|_| only);
        self.hidden = other.hidden.filter(|_| only);
        self.spheres = self.spheres.max(other.spheres);
        self.pixels += other.pixels;
        self.tiles += other.tiles;
        self.empty += other.empty;
        self.entries += other.entries;
        self.tests += other.tests;
        self.undecided += other.undecided;
        self.small += other.small;
        self.exact += other.exact;
    }
}

impl Counts {
    /// Notes what was met, if it was met in all of the picture at once.
    pub fn note(&mut self, whole: bool, met: Met) {
        self.outside = whole.then(|| self.spheres.saturating_sub(met.on_screen));
        self.hidden = whole.then(|| met.on_screen.saturating_sub(met.listed));
    }
}

/// Milliseconds of the steps of a picture.
#[derive(Clone, Debug, Default, serde::Serialize)]
pub struct Times {
    /// Spheres into view space, culling, tile lists, uploads.
    pub prepare: f64,
    /// The filter: nearest sphere at every pixel, and on the CPU the decisions.
    pub render: f64,
    /// Ids back from the device; 0 on the CPU.
    pub read_back: f64,
    /// Decisions for the pixels that the GPU's filter left over, where they are made as ids come
    /// back the mean of all threads; on the CPU part of `render`.
    pub decide: f64,
}

impl Times {
    /// Adds those of another part of the same picture.
    pub fn add(&mut self, other: &Self) {
        self.prepare += other.prepare;
        self.render += other.render;
        self.read_back += other.read_back;
        self.decide += other.decide;
    }
}

/// The nearest sphere at every pixel of a region.
#[derive(Clone, Debug)]
pub struct Drawing {
    /// Which part of the image.
    pub region: Region,
    /// Row by row from the top: index of the nearest sphere, -1 for none.
    pub ids: Vec<i32>,
    /// What was done.
    pub counts: Counts,
    /// How long it took.
    pub times: Times,
}

impl Drawing {
    /// Of no pixels yet, with room for those of a region. Every device begins here, so that all
    /// refuse the same.
    ///
    /// # Errors
    /// When the region of this view has no picture ([`View::check`]), or the room cannot be had.
    pub fn new(scene: &Scene, view: &View, region: Region) -> Result<Self, DrawError> {
        view.check(region)?;
        let spheres = scene.len();
        let pixels = region.pixels();
        let mut ids = Vec::new();
        ids.try_reserve_exact(pixels).map_err(|_| {
            DrawError::Memory(format!(
                "{} bytes for the ids of {pixels} pixels cannot be had",
                4 * pixels
            ))
        })?;
        let counts = Counts { spheres, pixels, ..Counts::default() };
        Ok(Self { region, ids, counts, times: Times::default() })
    }
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
