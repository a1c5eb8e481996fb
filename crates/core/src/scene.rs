//! What is drawn: spheres, as plain validated numbers.
//!
//! A [`Scene`] is a list of [`Block`]s. The numbers of a block may lie in memory of their own or in
//! a mapped file; they are read in place and never copied per sphere. This file knows nothing of
//! files, cameras or devices.

use std::{
    any::Any,
    fmt,
    marker::PhantomData,
    sync::{
        Arc, Mutex, OnceLock, PoisonError, Weak,
        atomic::{AtomicU64, Ordering},
    },
};

use bytemuck::Pod;
use bytes::Bytes;
use glam::DVec3;
use rayon::prelude::*;

use crate::{ids::SphereIndex, simd};

/// The most spheres a scene may hold: indices are written as `int32`.
pub const MAX_SPHERES: usize = i32::MAX as usize;
// `SphereIndex::id` is an `i32`. The GPU's `decide` takes `u32::MAX` for no index.
const _: () = assert!(MAX_SPHERES <= i32::MAX as usize);

/// One sphere: centre and radius in world units, colour in sRGB with 8 bits a channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// Centre, in world units.
    pub center: DVec3,
    /// Radius, in world units; positive and finite.
    pub radius: f64,
    /// sRGB colour.
    pub color: [u8; 3],
}

/// A typed run of numbers inside shared bytes: a `Vec`, or part of a mapped file.
pub struct Column<T> {
    bytes: Bytes,
    kind: PhantomData<T>,
}

impl<T> Clone for Column<T> {
    fn clone(&self) -> Self {
        Self { bytes: self.bytes.clone(), kind: PhantomData }
    }
}

/// Bytes of an owned vector.
struct Owned<T>(Vec<T>);

impl<T: Pod> AsRef<[u8]> for Owned<T> {
    fn as_ref(&self) -> &[u8] {
        bytemuck::cast_slice(&self.0)
    }
}

impl<T: Pod + Send> Column<T> {
    /// Takes `count` numbers at byte `offset` of `bytes`, in place. They must lie inside and be
    /// aligned, or there is no column.
    pub fn in_bytes(bytes: &Bytes, offset: usize, count: usize) -> Option<Self> {
        let end = offset.checked_add(count.checked_mul(size_of::<T>())?)?;
        let part = bytes.get(offset..end)?;
        if part.is_empty() {
            // Bytes of which there are none may lie anywhere.
            return Some(Vec::new().into());
        }
        bytemuck::try_cast_slice::<u8, T>(part).ok()?;
        Some(Self { bytes: bytes.slice(offset..end), kind: PhantomData })
    }

    /// The numbers.
    #[inline]
    pub fn as_slice(&self) -> &[T] {
        bytemuck::cast_slice(&self.bytes)
    }

    /// Some of them, in place.
    ///
    /// # Panics
    /// When they reach beyond the end.
    #[must_use]
    pub fn part(&self, range: std::ops::Range<usize>) -> Self {
        let bytes = self.bytes.slice(range.start * size_of::<T>()..range.end * size_of::<T>());
        Self { bytes, kind: PhantomData }
    }
}

impl<T> fmt::Debug for Column<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "[{} x {}]", self.bytes.len() / size_of::<T>(), std::any::type_name::<T>())
    }
}

impl<T: Pod + Send> Column<T> {
    /// Takes numbers of any owner, in place: of what shares its memory, such as an `Arc`, or of a
    /// mapped file. Rows of them stand one after another.
    pub fn of_owner<R: Pod, O: AsRef<[R]> + Send + 'static>(owner: O) -> Self {
        struct Rows<O, R>(O, PhantomData<fn() -> R>);
        impl<R: Pod, O: AsRef<[R]>> AsRef<[u8]> for Rows<O, R> {
            fn as_ref(&self) -> &[u8] {
                bytemuck::cast_slice(self.0.as_ref())
            }
        }
        const { assert!(size_of::<R>().is_multiple_of(size_of::<T>())) };
        const { assert!(align_of::<R>() >= align_of::<T>()) };
        Self { bytes: Bytes::from_owner(Rows(owner, PhantomData)), kind: PhantomData }
    }

    /// Takes rows of numbers, one row after another.
    pub fn of_rows<const N: usize>(rows: Vec<[T; N]>) -> Self
    where
        [T; N]: Pod,
    {
        Self { bytes: Bytes::from_owner(Owned(rows)), kind: PhantomData }
    }
}

impl<T: Pod + Send> From<Vec<T>> for Column<T> {
    fn from(values: Vec<T>) -> Self {
        Self { bytes: Bytes::from_owner(Owned(values)), kind: PhantomData }
    }
}

/// Real numbers as they are stored; both kinds stand for the same exact rationals.
#[derive(Clone, Debug)]
pub enum Reals {
    /// 32-bit floats.
    F32(Column<f32>),
    /// 64-bit floats.
    F64(Column<f64>),
}

impl Reals {
    /// How many numbers there are.
    pub fn len(&self) -> usize {
        match self {
            Self::F32(values) => values.as_slice().len(),
            Self::F64(values) => values.as_slice().len(),
        }
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Number `index`.
    #[inline]
    pub fn get(&self, index: usize) -> f64 {
        match self {
            Self::F32(values) => f64::from(values.as_slice()[index]),
            Self::F64(values) => values.as_slice()[index],
        }
    }
}

/// The radii of a block, in world units.
#[derive(Clone, Debug)]
pub enum Radii {
    /// One for all.
    Same(f64),
    /// One each.
    Each(Reals),
}

/// The sRGB colours of a block.
#[derive(Clone, Debug)]
pub enum Colors {
    /// One for all.
    Same([u8; 3]),
    /// Three bytes each.
    Each(Column<u8>),
}

/// Spheres that lie together: arrays of equal length.
#[derive(Clone, Debug)]
pub struct Block {
    /// Centres, (N, 3), x y z of one sphere after another, in world units.
    pub centers: Reals,
    /// Radii, (N,).
    pub radii: Radii,
    /// Colours, (N, 3).
    pub colors: Colors,
}

impl Block {
    /// A block of its own memory from single spheres.
    pub fn from_spheres(spheres: &[Sphere]) -> Self {
        Self {
            centers: Reals::F64(
                spheres.iter().flat_map(|s| s.center.to_array()).collect::<Vec<_>>().into(),
            ),
            radii: Radii::Each(Reals::F64(
                spheres.iter().map(|s| s.radius).collect::<Vec<_>>().into(),
            )),
            colors: Colors::Each(spheres.iter().flat_map(|s| s.color).collect::<Vec<_>>().into()),
        }
    }

    /// Number of spheres.
    pub fn len(&self) -> usize {
        self.centers.len() / 3
    }

    /// Whether there is no sphere.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Centre of sphere `index` of this block.
    #[inline(always)]
    pub fn center(&self, index: usize) -> DVec3 {
        match &self.centers {
            Reals::F32(c) => {
                let c = &c.as_slice()[3 * index..3 * index + 3];
                DVec3::new(c[0].into(), c[1].into(), c[2].into())
            }
            Reals::F64(c) => DVec3::from_slice(&c.as_slice()[3 * index..3 * index + 3]),
        }
    }

    /// Radius of sphere `index` of this block.
    #[inline(always)]
    pub fn radius(&self, index: usize) -> f64 {
        match &self.radii {
            Radii::Same(radius) => *radius,
            Radii::Each(radii) => radii.get(index),
        }
    }

    /// A hint that sphere `index` of this block is soon to be looked at.
    #[inline(always)]
    pub fn prefetch(&self, index: usize) {
        let numbers = |numbers: &Reals, first: usize, last: usize| match numbers {
            Reals::F32(c) => [first, last].map(|at| simd::prefetch(c.as_slice(), at)),
            Reals::F64(c) => [first, last].map(|at| simd::prefetch(c.as_slice(), at)),
        };
        numbers(&self.centers, 3 * index, 3 * index + 2);
        if let Radii::Each(radii) = &self.radii {
            numbers(radii, index, index);
        }
    }

    /// The same, of its colour.
    #[inline(always)]
    pub fn prefetch_color(&self, index: usize) {
        if let Colors::Each(colors) = &self.colors {
            simd::prefetch(colors.as_slice(), 3 * index);
        }
    }

    /// Sphere `index` of this block.
    pub fn sphere(&self, index: usize) -> Sphere {
        Sphere { center: self.center(index), radius: self.radius(index), color: self.color(index) }
    }

    /// Colour of sphere `index` of this block.
    pub fn color(&self, index: usize) -> [u8; 3] {
        match &self.colors {
            Colors::Same(color) => *color,
            Colors::Each(colors) => {
                let c = &colors.as_slice()[3 * index..3 * index + 3];
                [c[0], c[1], c[2]]
            }
        }
    }
}

/// Centre and radius of a sphere, world units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ball {
    /// Centre.
    pub center: DVec3,
    /// Radius.
    pub radius: f64,
}

impl From<Sphere> for Ball {
    fn from(sphere: Sphere) -> Self {
        Self { center: sphere.center, radius: sphere.radius }
    }
}

/// Why numbers are not a scene. `block` counts from 0 in the order given; `index` counts inside the
/// block.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum SceneError {
    /// A coordinate is NaN or infinite.
    #[error(
        "sphere {index} of block {block}: {axis} of the centre is {value}, not a finite number"
    )]
    Center {
        /// Block.
        block: usize,
        /// Sphere in the block.
        index: usize,
        /// `x`, `y` or `z`.
        axis: char,
        /// The number found.
        value: f64,
    },
    /// A radius is not positive and finite.
    #[error("sphere {index} of block {block}: the radius is {value}, not a positive finite number")]
    Radius {
        /// Block.
        block: usize,
        /// Sphere in the block.
        index: usize,
        /// The number found.
        value: f64,
    },
    /// Arrays of one block disagree in length.
    #[error(
        "block {block}: {what} holds {found} numbers for {spheres} spheres, {wanted} are needed"
    )]
    Shape {
        /// Block.
        block: usize,
        /// Which array.
        what: &'static str,
        /// Numbers in it.
        found: usize,
        /// Numbers needed.
        wanted: usize,
        /// Spheres in the block.
        spheres: usize,
    },
    /// The numbers were others at a second look: something writes to them.
    #[error("block {block}: the numbers change while they are read")]
    Changing {
        /// Block.
        block: usize,
    },
    /// More spheres than indices.
    #[error("{0} spheres are more than the limit of 2147483647")]
    TooMany(usize),
}

/// The extent of a scene, of finite numbers; of an empty scene, all zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Least coordinate of any centre, on each axis.
    pub min_center: DVec3,
    /// Greatest coordinate of any centre, on each axis.
    pub max_center: DVec3,
    /// Least radius.
    pub min_radius: f64,
    /// Greatest radius.
    pub max_radius: f64,
}

impl Bounds {
    /// The corners of the box of the centres.
    pub fn corners(&self) -> [DVec3; 8] {
        std::array::from_fn(|corner| {
            let side = |k: usize| {
                if corner >> k & 1 == 0 { self.min_center[k] } else { self.max_center[k] }
            };
            DVec3::new(side(0), side(1), side(2))
        })
    }
}

/// The first radii of a block that are at least so large, numbered from `start` on.
fn search<T: Copy + Into<f64> + Sync>(radii: &[T], least: f64, start: usize) -> Vec<SphereIndex> {
    const PART: usize = 1 << 14;
    let parts = radii.par_chunks(PART).enumerate().map(|(part, radii)| {
        let found = radii.iter().enumerate().filter(|(_, radius)| (**radius).into() >= least);
        let index = |at: usize| SphereIndex((start + part * PART + at) as u32);
        found.take(LARGE).map(|(at, _)| index(at)).collect::<Vec<_>>()
    });
    parts.flatten_iter().collect()
}

/// Spheres `0..len`, in the order of their blocks.
#[derive(Clone)]
pub struct Scene {
    blocks: Vec<Block>,
    /// Index of the first sphere of each block, and `len` at the end.
    starts: Vec<usize>,
    bounds: Bounds,
    derived: Arc<Derived>,
}

/// What clones of a scene share: what was found of its spheres, once.
struct Derived {
    identity: u64,
    large: OnceLock<Vec<SphereIndex>>,
    /// One of each type, see [`Scene::kept`].
    kept: Mutex<Vec<Arc<dyn Any + Send + Sync>>>,
}

impl Derived {
    /// Of a scene that no other is a clone of.
    fn new() -> Arc<Self> {
        static NEXT: AtomicU64 = AtomicU64::new(0);
        let identity = NEXT.fetch_add(1, Ordering::Relaxed);
        Arc::new(Self { identity, large: OnceLock::new(), kept: Mutex::default() })
    }
}

/// Tells whether a scene, or any clone of it, is still there.
#[derive(Clone, Debug)]
pub struct Alive(Weak<Derived>);

impl Alive {
    /// Whether it is.
    pub fn is_alive(&self) -> bool {
        self.0.strong_count() > 0
    }
}

impl fmt::Debug for Derived {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Derived").field("identity", &self.identity).finish_non_exhaustive()
    }
}

impl fmt::Debug for Scene {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { bounds, .. } = self;
        f.debug_struct("Scene").field("spheres", &self.len()).field("bounds", bounds).finish()
    }
}

/// At most this many occluder candidates.
const LARGE: usize = 512;

impl Scene {
    /// Checks every number once and keeps the blocks as they are.
    ///
    /// # Errors
    /// The first thing in order that is not finite, not positive, or of the wrong length.
    pub fn new(blocks: Vec<Block>) -> Result<Self, SceneError> {
        let mut starts = vec![0];
        let mut total = Survey::EMPTY;
        for (number, block) in blocks.iter().enumerate() {
            let spheres = block.len();
            let shape = |what, found, per_sphere: usize| {
                let wanted = spheres * per_sphere;
                if found == wanted {
                    Ok(())
                } else {
                    Err(SceneError::Shape { block: number, what, found, wanted, spheres })
                }
            };
            shape("centers", block.centers.len(), 3)?;
            if let Radii::Each(radii) = &block.radii {
                shape("radii", radii.len(), 1)?;
            }
            if let Colors::Each(colors) = &block.colors {
                shape("colors", colors.as_slice().len(), 3)?;
            }
            let survey = Survey::of(block);
            if !survey.valid {
                return Err(first_fault(number, block));
            }
            total = total.and(survey);
            starts.push(starts[number] + spheres);
        }
        let len = starts[blocks.len()];
        if len > MAX_SPHERES {
            return Err(SceneError::TooMany(len));
        }
        let bounds = if len == 0 {
            Bounds {
                min_center: DVec3::ZERO,
                max_center: DVec3::ZERO,
                min_radius: 0.0,
                max_radius: 0.0,
            }
        } else {
            Bounds {
                min_center: DVec3::from_array(total.min),
                max_center: DVec3::from_array(total.max),
                min_radius: total.min_radius,
                max_radius: total.max_radius,
            }
        };
        Ok(Self { blocks, starts, bounds, derived: Derived::new() })
    }

    /// A scene of single spheres.
    ///
    /// # Errors
    /// As [`Scene::new`].
    pub fn from_spheres(spheres: &[Sphere]) -> Result<Self, SceneError> {
        Self::new(vec![Block::from_spheres(spheres)])
    }

    /// The first spheres, a few hundred at most, of at least a quarter of the greatest radius;
    /// found when they are first asked for.
    ///
    /// They are found outside of the `OnceLock`: a thread that waits for rayon inside of it may
    /// take up another draw of this scene, which would wait for the same lock, and so for itself.
    /// Draws that begin at once may find them twice; the answer is the same.
    pub fn large(&self) -> &[SphereIndex] {
        let Derived { large, .. } = &*self.derived;
        if let Some(known) = large.get() {
            return known;
        }
        let found = self.find_large();
        large.get_or_init(|| found)
    }

    fn find_large(&self) -> Vec<SphereIndex> {
        let least = 0.25 * self.bounds.max_radius;
        let mut found = Vec::new();
        for (start, block) in self.blocks() {
            match &block.radii {
                Radii::Same(radius) if *radius < least => {}
                Radii::Same(_) => {
                    let first = start..start + block.len().min(LARGE);
                    found.extend(first.map(|at| SphereIndex(at as u32)))
                }
                Radii::Each(Reals::F32(radii)) => {
                    found.extend(search(radii.as_slice(), least, start))
                }
                Radii::Each(Reals::F64(radii)) => {
                    found.extend(search(radii.as_slice(), least, start))
                }
            }
        }
        found.truncate(LARGE);
        found
    }

    /// A number that only clones of this scene share: what is made from it once, such as a copy on
    /// a device, can be kept.
    pub fn identity(&self) -> u64 {
        self.derived.identity
    }

    /// Tells, later, whether this scene or any clone of it is still there.
    pub fn alive(&self) -> Alive {
        Alive(Arc::downgrade(&self.derived))
    }

    /// What others have found of this scene, one of each type: all clones share it, and it goes
    /// when the last of them does.
    pub fn kept<T: Any + Default + Send + Sync>(&self) -> Arc<T> {
        let mut kept = self.derived.kept.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = kept.iter().find_map(|one| Arc::clone(one).downcast().ok()) {
            return known;
        }
        let new = Arc::<T>::default();
        kept.push(Arc::clone(&new) as Arc<dyn Any + Send + Sync>);
        new
    }

    /// The same spheres as a scene of which nothing was found yet.
    #[must_use]
    pub fn fresh(&self) -> Self {
        Self { derived: Derived::new(), ..self.clone() }
    }

    /// The same spheres in other colours, one each: what was found of them stays.
    ///
    /// # Errors
    /// When there is another number of colours than of spheres.
    pub fn recolored(&self, colors: Column<u8>) -> Result<Self, SceneError> {
        let (spheres, found) = (self.len(), colors.as_slice().len());
        let wanted = 3 * spheres;
        if found != wanted {
            return Err(SceneError::Shape { block: 0, what: "colors", found, wanted, spheres });
        }
        let blocks = self.blocks().map(|(start, block)| {
            let colors = colors.part(3 * start..3 * (start + block.len()));
            Block { colors: Colors::Each(colors), ..block.clone() }
        });
        Ok(Self { blocks: blocks.collect(), ..self.clone() })
    }

    /// Number of spheres.
    pub fn len(&self) -> usize {
        self.starts[self.blocks.len()]
    }

    /// Whether there is no sphere.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Bytes that the numbers take, wherever they lie.
    pub fn bytes(&self) -> u64 {
        let reals = |reals: &Reals| match reals {
            Reals::F32(numbers) => numbers.bytes.len(),
            Reals::F64(numbers) => numbers.bytes.len(),
        };
        let block = |block: &Block| {
            let radii = match &block.radii {
                Radii::Same(_) => 0,
                Radii::Each(each) => reals(each),
            };
            let colors = match &block.colors {
                Colors::Same(_) => 0,
                Colors::Each(each) => each.bytes.len(),
            };
            (reals(&block.centers) + radii + colors) as u64
        };
        self.blocks.iter().map(block).sum()
    }

    /// The blocks, each with the index of its first sphere.
    pub fn blocks(&self) -> impl Iterator<Item = (usize, &Block)> {
        self.starts.iter().copied().zip(&self.blocks)
    }

    /// Block and place in it of sphere `index`.
    pub fn locate(&self, index: usize) -> (&Block, usize) {
        let block = if self.blocks.len() == 1 {
            0
        } else {
            self.starts.partition_point(|&start| start <= index) - 1
        };
        (&self.blocks[block], index - self.starts[block])
    }

    /// Sphere `index`; none beyond the last.
    pub fn sphere(&self, index: usize) -> Option<Sphere> {
        (index < self.len()).then(|| self.known(index))
    }

    /// Sphere `index` of those that the scene is known to have.
    #[inline]
    pub fn known(&self, index: usize) -> Sphere {
        let (block, at) = self.locate(index);
        Sphere { center: block.center(at), radius: block.radius(at), color: block.color(at) }
    }

    /// Colour of sphere `index`; none beyond the last.
    pub fn color(&self, index: usize) -> Option<[u8; 3]> {
        (index < self.len()).then(|| {
            let (block, at) = self.locate(index);
            block.color(at)
        })
    }

    /// The extent of the centres and radii.
    pub fn bounds(&self) -> Bounds {
        self.bounds
    }
}

/// What one pass over a block finds.
#[derive(Clone, Copy)]
struct Survey {
    valid: bool,
    min: [f64; 3],
    max: [f64; 3],
    min_radius: f64,
    max_radius: f64,
}

impl Survey {
    const EMPTY: Self = Self {
        valid: true,
        min: [f64::INFINITY; 3],
        max: [f64::NEG_INFINITY; 3],
        min_radius: f64::INFINITY,
        max_radius: f64::NEG_INFINITY,
    };

    fn and(self, other: Self) -> Self {
        Self {
            valid: self.valid && other.valid,
            min: std::array::from_fn(|k| self.min[k].min(other.min[k])),
            max: std::array::from_fn(|k| self.max[k].max(other.max[k])),
            min_radius: self.min_radius.min(other.min_radius),
            max_radius: self.max_radius.max(other.max_radius),
        }
    }

    fn of(block: &Block) -> Self {
        let centers = match &block.centers {
            Reals::F32(c) => Self::of_centers(c.as_slice()),
            Reals::F64(c) => Self::of_centers(c.as_slice()),
        };
        let radii = match &block.radii {
            Radii::Same(radius) => Self::of_radii(&[*radius]),
            Radii::Each(Reals::F32(r)) => Self::of_radii(r.as_slice()),
            Radii::Each(Reals::F64(r)) => Self::of_radii(r.as_slice()),
        };
        // A block of no spheres still has its one radius checked, but adds nothing to the bounds.
        if block.is_empty() {
            Self { valid: centers.valid && radii.valid, ..Self::EMPTY }
        } else {
            centers.and(radii)
        }
    }

    /// Runs over whole arrays in vector form: lanes of 12 are four centres.
    fn of_centers<T: Copy + Into<f64> + PartialOrd + Sync + Extremes>(values: &[T]) -> Self {
        values
            .par_chunks(12 << 12)
            .map(|chunk| {
                let (mut low, mut high, mut finite) = ([T::GREATEST; 12], [T::LEAST; 12], true);
                let mut lanes = chunk.chunks_exact(12);
                for twelve in &mut lanes {
                    let mut inside = true;
                    for k in 0..12 {
                        let v = twelve[k];
                        inside &= (v >= T::LEAST) & (v <= T::GREATEST);
                        low[k] = if v < low[k] { v } else { low[k] };
                        high[k] = if v > high[k] { v } else { high[k] };
                    }
                    finite &= inside;
                }
                for (k, &v) in lanes.remainder().iter().enumerate() {
                    finite &= (v >= T::LEAST) & (v <= T::GREATEST);
                    low[k] = if v < low[k] { v } else { low[k] };
                    high[k] = if v > high[k] { v } else { high[k] };
                }
                let mut survey = Self { valid: finite, ..Self::EMPTY };
                for k in 0..12 {
                    survey.min[k % 3] = survey.min[k % 3].min(low[k].into());
                    survey.max[k % 3] = survey.max[k % 3].max(high[k].into());
                }
                survey
            })
            .reduce(|| Self::EMPTY, Self::and)
    }

    /// The same of radii, sixteen at a time.
    fn of_radii<T: Copy + Into<f64> + PartialOrd + Sync + Extremes>(values: &[T]) -> Self {
        values
            .par_chunks(1 << 15)
            .map(|chunk| {
                let (mut low, mut high, mut positive) = ([T::GREATEST; 16], [T::ZERO; 16], true);
                let mut lanes = chunk.chunks_exact(16);
                for sixteen in &mut lanes {
                    let mut inside = true;
                    for k in 0..16 {
                        let v = sixteen[k];
                        inside &= (v > T::ZERO) & (v <= T::GREATEST);
                        low[k] = if v < low[k] { v } else { low[k] };
                        high[k] = if v > high[k] { v } else { high[k] };
                    }
                    positive &= inside;
                }
                for (k, &v) in lanes.remainder().iter().enumerate() {
                    positive &= (v > T::ZERO) & (v <= T::GREATEST);
                    low[k] = if v < low[k] { v } else { low[k] };
                    high[k] = if v > high[k] { v } else { high[k] };
                }
                let low = low.into_iter().fold(T::GREATEST, |a, b| if b < a { b } else { a });
                let high = high.into_iter().fold(T::ZERO, |a, b| if b > a { b } else { a });
                Self {
                    valid: positive,
                    min_radius: low.into(),
                    max_radius: high.into(),
                    ..Self::EMPTY
                }
            })
            .reduce(|| Self::EMPTY, Self::and)
    }
}

/// The ends of a float type, as constants for generic loops.
trait Extremes {
    const LEAST: Self;
    const GREATEST: Self;
    const ZERO: Self;
}

impl Extremes for f32 {
    const LEAST: Self = f32::MIN;
    const GREATEST: Self = f32::MAX;
    const ZERO: Self = 0.0;
}

impl Extremes for f64 {
    const LEAST: Self = f64::MIN;
    const GREATEST: Self = f64::MAX;
    const ZERO: Self = 0.0;
}

/// Looks again, slowly, for what a survey only counted.
fn first_fault(number: usize, block: &Block) -> SceneError {
    for index in 0..block.len().max(1) {
        if index < block.len() {
            for (axis, value) in ['x', 'y', 'z'].into_iter().zip(block.center(index).to_array()) {
                if !value.is_finite() {
                    return SceneError::Center { block: number, index, axis, value };
                }
            }
        }
        let value = block.radius(index);
        if !(value.is_finite() && value > 0.0) {
            return SceneError::Radius { block: number, index, value };
        }
    }
    // The survey and this search apply the same tests.
    SceneError::Changing { block: number }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ball(x: f64, radius: f64) -> Sphere {
        Sphere { center: DVec3::new(x, 1.0, -2.0), radius, color: [1, 2, 3] }
    }

    #[test]
    fn bounds_cover_every_block() {
        let mut spheres: Vec<_> =
            (0..100).map(|k| ball(f64::from(k), 1.0 + f64::from(k))).collect();
        spheres.push(ball(-7.0, 0.25));
        let scene = Scene::new(vec![
            Block::from_spheres(&spheres[..50]),
            Block::from_spheres(&spheres[50..]),
        ])
        .unwrap();
        assert_eq!(scene.len(), 101);
        let bounds = scene.bounds();
        assert_eq!((bounds.min_center.x, bounds.max_center.x), (-7.0, 99.0));
        assert_eq!((bounds.min_center.z, bounds.max_center.y), (-2.0, 1.0));
        assert_eq!((bounds.min_radius, bounds.max_radius), (0.25, 100.0));
        for (k, sphere) in spheres.iter().enumerate() {
            assert_eq!(scene.sphere(k), Some(*sphere));
        }
    }

    #[test]
    fn the_first_fault_is_named() {
        for at in [0, 11, 12, 13, 49] {
            let mut spheres = vec![ball(0.0, 1.0); 50];
            spheres[at].center.y = f64::NAN;
            match Scene::from_spheres(&spheres).err() {
                Some(SceneError::Center { block: 0, index, axis: 'y', .. }) if index == at => {}
                other => panic!("{other:?}"),
            }
            spheres[at] = ball(0.0, 0.0);
            assert_eq!(
                Scene::from_spheres(&spheres).err(),
                Some(SceneError::Radius { block: 0, index: at, value: 0.0 })
            );
            for radius in [-1.0, f64::INFINITY, f64::NAN] {
                spheres[at] = ball(0.0, radius);
                assert!(matches!(Scene::from_spheres(&spheres), Err(SceneError::Radius { .. })));
            }
        }
    }

    #[test]
    fn an_empty_scene_is_a_scene() {
        assert!(Scene::new(vec![]).unwrap().is_empty());
        assert!(Scene::from_spheres(&[]).unwrap().is_empty());
    }
}
