//! What drawing gives, and what ends it: the words that all devices share.

use std::sync::{
    Arc,
    atomic::{AtomicBool, AtomicU32, Ordering},
};

use crate::{
    camera::{Region, View, ViewError},
    scene::Scene,
};

/// Ends drawings from outside, and tells how far they are: from another thread, or for what a
/// person sees and presses.
///
/// Clones are the same. A device that was given one (`controlled_by`) looks at it between tiles,
/// between decisions and between pieces of all that takes long, and `draw` then ends soon, with
/// [`DrawError::Cancelled`].
#[derive(Clone, Debug)]
pub struct Control {
    told: Arc<Told>,
    /// What part of the whole is the work that this one is handed to.
    share: [f32; 2],
}

#[derive(Debug, Default)]
struct Told {
    cancelled: AtomicBool,
    /// Bits of an `f32` that is not negative: these are in the order of the numbers.
    done: AtomicU32,
}

impl Default for Control {
    fn default() -> Self {
        Self { told: Arc::default(), share: [0.0, 1.0] }
    }
}

impl Control {
    /// Not cancelled, and not begun.
    pub fn new() -> Self {
        Self::default()
    }

    /// Ends what is drawn now, and all that is begun later.
    pub fn cancel(&self) {
        self.told.cancelled.store(true, Ordering::Relaxed);
    }

    /// Whether it was cancelled.
    #[inline]
    pub fn is_cancelled(&self) -> bool {
        self.told.cancelled.load(Ordering::Relaxed)
    }

    /// An error once it was cancelled.
    ///
    /// # Errors
    /// [`DrawError::Cancelled`].
    pub fn check(&self) -> Result<(), DrawError> {
        if self.is_cancelled() { Err(DrawError::Cancelled) } else { Ok(()) }
    }

    /// The same for work that is a part of this one, from one fraction of it to another.
    #[must_use]
    pub fn part(&self, [from, to]: [f32; 2]) -> Self {
        Self { told: Arc::clone(&self.told), share: [self.at(from), self.at(to)] }
    }

    /// Notes that this fraction of the work is done. What was noted never falls.
    pub fn reach(&self, fraction: f32) {
        self.told.done.fetch_max(self.at(fraction).max(0.0).to_bits(), Ordering::Relaxed);
    }

    /// How much of the whole is done, from 0 to 1.
    pub fn progress(&self) -> f32 {
        f32::from_bits(self.told.done.load(Ordering::Relaxed))
    }

    fn at(&self, fraction: f32) -> f32 {
        let [from, to] = self.share;
        from + fraction.clamp(0.0, 1.0) * (to - from)
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
    /// It cannot fit into memory.
    #[error("{words}")]
    Memory {
        /// Bytes that could not be had, if that is known.
        needed: Option<u64>,
        /// What is needed, in words.
        words: String,
    },
}

impl DrawError {
    /// When so many bytes a pixel cannot be had for a plane.
    pub fn no_room(plane: &str, bytes: usize, pixels: usize) -> Self {
        let needed = bytes * pixels;
        let words = format!("{needed} bytes for the {plane} of {pixels} pixels cannot be had");
        Self::Memory { needed: Some(needed as u64), words }
    }
}

/// What was done for a picture, for `--stats`.
#[derive(Clone, Debug, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
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
    /// Pixels, or samples, that were not tested because their block certainly shows one sphere.
    pub alike: usize,
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
        self.alike += other.alike;
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
#[derive(Clone, Debug, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
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
    /// refuse the same. `ids` is memory that is used again; none of what it holds is kept.
    ///
    /// # Errors
    /// When the region of this view has no picture ([`View::check`]), or the room cannot be had.
    pub fn new(
        scene: &Scene,
        view: &View,
        region: Region,
        mut ids: Vec<i32>,
    ) -> Result<Self, DrawError> {
        view.check(region)?;
        let spheres = scene.len();
        let pixels = region.pixels();
        ids.clear();
        if ids.capacity() / 4 > pixels {
            // Memory of a far larger picture is not held.
            ids = Vec::new();
        }
        ids.try_reserve_exact(pixels).map_err(|_| DrawError::no_room("ids", 4, pixels))?;
        let counts = Counts { spheres, pixels, ..Counts::default() };
        Ok(Self { region, ids, counts, times: Times::default() })
    }
}

/// What is to be drawn, as far as memory depends on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Workload {
    /// Spheres of the scene.
    pub spheres: usize,
    /// What is drawn.
    pub region: Region,
    /// Entries of tile lists if nothing were hidden, or a bound of them.
    pub entries: u64,
}

/// What a pass over spheres met.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Met {
    /// Spheres that may be hit at some pixel within the clip range. Of a cluster that is culled as
    /// hidden, all spheres count.
    pub on_screen: usize,
    /// Spheres that are in a list, or in several.
    pub listed: usize,
}

impl std::ops::AddAssign for Met {
    fn add_assign(&mut self, other: Self) {
        self.on_screen += other.on_screen;
        self.listed += other.listed;
    }
}
