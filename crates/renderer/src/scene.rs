//! Spheres on their way into a scene, and the scene.

use std::{fmt, sync::Arc};

use planisphere_core::{
    cpu::Cpu,
    order::Kept,
    scene::{self, Block, Colors, Column, Radii, Reals},
};

use crate::{Error, engine::host};

/// A sphere: centre and radius in world units, colour in sRGB with 8 bits a channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// Centre, in world units.
    pub center: [f64; 3],
    /// Radius, in world units; positive and finite.
    pub radius: f64,
    /// sRGB colour.
    pub color: [u8; 3],
}

/// The colour of spheres that were given none.
const GREY: [u8; 3] = [176; 3];

/// Numbers on their way into a [`Scene`]: `f32` or `f64`, of any owner (`Vec`, `Arc<[_]>`, a mapped
/// file).
///
/// Centres in memory of their own ([`Spheres::points`]), radii and colours are kept and read in
/// place. Records of four numbers ([`Spheres::xyzr`]) are taken apart, which copies them once.
#[derive(Clone, Default)]
pub struct Spheres {
    blocks: Vec<Block>,
    /// The first thing that does not fit, for [`Scene::new`] to say.
    wrong: Option<(&'static str, usize, usize)>,
}

impl fmt::Debug for Spheres {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Spheres").field("spheres", &self.len()).finish_non_exhaustive()
    }
}

impl Spheres {
    fn of(centers: Reals, radii: Radii) -> Self {
        Self { blocks: vec![Block { centers, radii, colors: Colors::Same(GREY) }], wrong: None }
    }

    /// Records of x, y, z and radius.
    pub fn xyzr(records: impl AsRef<[[f32; 4]]>) -> Self {
        let (centers, radii) = apart(records.as_ref());
        Self::of(Reals::F32(Column::of_rows(centers)), Radii::Each(Reals::F32(radii.into())))
    }

    /// The same in `f64`.
    pub fn xyzr_f64(records: impl AsRef<[[f64; 4]]>) -> Self {
        let (centers, radii) = apart(records.as_ref());
        Self::of(Reals::F64(Column::of_rows(centers)), Radii::Each(Reals::F64(radii.into())))
    }

    /// Centres, all of one radius.
    pub fn points(centers: impl AsRef<[[f32; 3]]> + Send + Sync + 'static, radius: f64) -> Self {
        Self::of(Reals::F32(Column::of_owner(centers)), Radii::Same(radius))
    }

    /// The same in `f64`.
    pub fn points_f64(
        centers: impl AsRef<[[f64; 3]]> + Send + Sync + 'static,
        radius: f64,
    ) -> Self {
        Self::of(Reals::F64(Column::of_owner(centers)), Radii::Same(radius))
    }

    /// A radius each, in place of the one that they all had.
    #[must_use]
    pub fn radii(self, radii: impl AsRef<[f32]> + Send + Sync + 'static) -> Self {
        let radii = Column::<f32>::of_owner(radii);
        let found = radii.as_slice().len();
        self.each("radii", found, |block, range| {
            block.radii = Radii::Each(Reals::F32(radii.part(range)));
        })
    }

    /// The same in `f64`.
    #[must_use]
    pub fn radii_f64(self, radii: impl AsRef<[f64]> + Send + Sync + 'static) -> Self {
        let radii = Column::<f64>::of_owner(radii);
        let found = radii.as_slice().len();
        self.each("radii", found, |block, range| {
            block.radii = Radii::Each(Reals::F64(radii.part(range)));
        })
    }

    /// A colour each, sRGB; without, spheres are grey.
    #[must_use]
    pub fn colors(self, srgb: impl AsRef<[[u8; 3]]> + Send + Sync + 'static) -> Self {
        let colors = Column::<u8>::of_owner(srgb);
        let found = colors.as_slice().len() / 3;
        self.each("colors", found, |block, range| {
            block.colors = Colors::Each(colors.part(3 * range.start..3 * range.end));
        })
    }

    /// One colour for all, sRGB.
    #[must_use]
    pub fn color(mut self, srgb: [u8; 3]) -> Self {
        self.blocks.iter_mut().for_each(|block| block.colors = Colors::Same(srgb));
        self
    }

    /// These, and then others, whose indices go on counting.
    #[must_use]
    pub fn and(mut self, more: Self) -> Self {
        self.blocks.extend(more.blocks);
        self.wrong = self.wrong.or(more.wrong);
        self
    }

    /// Number of spheres.
    pub fn len(&self) -> usize {
        self.blocks.iter().map(Block::len).sum()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Hands each block its range of something that there is one of for each sphere.
    fn each(
        mut self,
        what: &'static str,
        found: usize,
        mut set: impl FnMut(&mut Block, std::ops::Range<usize>),
    ) -> Self {
        let wanted = self.len();
        if found != wanted {
            self.wrong = self.wrong.or(Some((what, found, wanted)));
            return self;
        }
        let mut start = 0;
        for block in &mut self.blocks {
            let len = block.len();
            set(block, start..start + len);
            start += len;
        }
        self
    }
}

/// Centres and radii.
fn apart<T: Copy>(records: &[[T; 4]]) -> (Vec<[T; 3]>, Vec<T>) {
    records.iter().map(|&[x, y, z, radius]| ([x, y, z], radius)).unzip()
}

impl FromIterator<Sphere> for Spheres {
    fn from_iter<I: IntoIterator<Item = Sphere>>(spheres: I) -> Self {
        let (mut centers, mut radii, mut colors) = (Vec::new(), Vec::new(), Vec::new());
        for Sphere { center, radius, color } in spheres {
            centers.push(center);
            radii.push(radius);
            colors.push(color);
        }
        Self::points_f64(centers, 1.0).radii_f64(radii).colors(colors)
    }
}

/// Checked spheres, and all that is ever derived from them. Clones are free and share it: all
/// threads and all renderers that draw a scene find it once.
#[derive(Clone)]
pub struct Scene(Arc<Inner>);

struct Inner {
    core: scene::Scene,
    /// The group of each sphere.
    groups: Option<Arc<[u32]>>,
    #[cfg(feature = "read")]
    watch: planisphere_io::load::Watch,
}

impl fmt::Debug for Scene {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(inner) = self;
        inner.core.fmt(f)
    }
}

impl Scene {
    /// Checks every number once.
    ///
    /// # Errors
    /// The first sphere in order that has no picture, or what has another length than the spheres.
    pub fn new(spheres: Spheres) -> Result<Self, Error> {
        let Spheres { blocks, wrong } = spheres;
        if let Some((what, found, wanted)) = wrong {
            return Err(Error::Length { what, found, wanted });
        }
        let starts: Vec<usize> = blocks
            .iter()
            .scan(0, |next, block| {
                let start = *next;
                *next += block.len();
                Some(start)
            })
            .collect();
        scene::Scene::new(blocks).map(Self::from).map_err(|error| {
            let before = match error {
                scene::SceneError::Center { block, .. }
                | scene::SceneError::Radius { block, .. } => starts[block],
                _ => 0,
            };
            match Error::from(error) {
                Error::Sphere { index, field, value } => {
                    Error::Sphere { index: before + index, field, value }
                }
                other => other,
            }
        })
    }

    /// The same spheres in other colours, sRGB, one each. All that was derived stays, on devices as
    /// well.
    ///
    /// # Errors
    /// When there is another number of colours than of spheres.
    pub fn recolored(
        &self,
        srgb: impl AsRef<[[u8; 3]]> + Send + Sync + 'static,
    ) -> Result<Self, Error> {
        let colors = Column::<u8>::of_owner(srgb);
        let (found, wanted) = (colors.as_slice().len() / 3, self.len());
        if found != wanted {
            return Err(Error::Length { what: "colors", found, wanted });
        }
        let core = self.core().recolored(colors)?;
        Ok(Self(Arc::new(Inner {
            core,
            groups: self.0.groups.clone(),
            #[cfg(feature = "read")]
            watch: self.0.watch.clone(),
        })))
    }

    /// The same spheres in groups, such as molecules: a number each, equal for those of one group.
    /// [`Look::outline_groups`](crate::Look::outline_groups) draws lines between these. All that
    /// was derived stays, on devices as well.
    ///
    /// # Errors
    /// When there is another number of groups than of spheres.
    pub fn grouped(self, groups: impl Into<Arc<[u32]>>) -> Result<Self, Error> {
        let groups = groups.into();
        let (found, wanted) = (groups.len(), self.len());
        if found != wanted {
            return Err(Error::Length { what: "groups", found, wanted });
        }
        Ok(Self(Arc::new(Inner {
            core: self.core().clone(),
            groups: Some(groups),
            #[cfg(feature = "read")]
            watch: self.0.watch.clone(),
        })))
    }

    /// Does now what the second picture would wait for: puts the spheres into an order that all
    /// pictures share, of 40 bytes a sphere. Blocks until it is there; nothing is done twice.
    /// Scenes of up to 16,384 spheres need none.
    pub fn prepare(&self) {
        let core = self.core();
        if core.len() >= planisphere_core::cpu::ORDERED {
            // Without a control nothing cancels it.
            let _ = Cpu::default().on(host()).prepare(core);
        }
        core.large();
    }

    /// Number of spheres.
    pub fn len(&self) -> usize {
        self.core().len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.core().is_empty()
    }

    /// Sphere `index`, if there is one.
    pub fn get(&self, index: usize) -> Option<Sphere> {
        let scene::Sphere { center, radius, color } = self.core().sphere(index)?;
        Some(Sphere { center: center.to_array(), radius, color })
    }

    /// The least and the greatest corner of a box that holds every sphere whole, world units;
    /// infinite where it is beyond f64, none of an empty scene.
    pub fn bounds(&self) -> Option<[[f64; 3]; 2]> {
        let bounds = self.core().bounds();
        let reach = bounds.max_radius;
        (!self.is_empty())
            .then(|| [bounds.min_center - reach, bounds.max_center + reach].map(|at| at.to_array()))
    }

    /// Bytes held: the numbers, wherever they lie, and what was derived from them.
    pub fn memory(&self) -> u64 {
        let core = self.core();
        let groups = self.groups().map_or(0, size_of_val) as u64;
        core.bytes() + core.kept::<Kept>().memory(core) + groups
    }

    /// The scene of the core.
    pub(crate) fn core(&self) -> &scene::Scene {
        &self.0.core
    }

    /// The group of each sphere, if there are groups.
    pub(crate) fn groups(&self) -> Option<&[u32]> {
        self.0.groups.as_deref()
    }

    /// Whether nothing is left to be derived that takes long.
    pub(crate) fn is_ready(&self) -> bool {
        let core = self.core();
        core.len() < planisphere_core::cpu::ORDERED || core.kept::<Kept>().is_made()
    }

    /// Whether numbers of it lie in files, which may change.
    pub(crate) fn is_watched(&self) -> bool {
        #[cfg(feature = "read")]
        return !self.0.watch.is_empty();
        #[cfg(not(feature = "read"))]
        false
    }

    /// Refuses numbers that lie in files that were changed meanwhile.
    pub(crate) fn check(&self) -> Result<(), Error> {
        #[cfg(feature = "read")]
        if let Some(changed) = self.0.watch.changed() {
            return Err(changed.into());
        }
        Ok(())
    }

    /// What was read, with the files that its numbers lie in.
    #[cfg(feature = "read")]
    pub(crate) fn loaded(loaded: &planisphere_io::load::Loaded) -> Self {
        let groups = loaded.groups.as_deref().map(Arc::from);
        let (core, watch) = (loaded.scene.clone(), loaded.watch.clone());
        Self(Arc::new(Inner { core, groups, watch }))
    }
}

/// Of the inner crates, which promise nothing.
#[doc(hidden)]
impl From<scene::Scene> for Scene {
    fn from(core: scene::Scene) -> Self {
        Self(Arc::new(Inner {
            core,
            groups: None,
            #[cfg(feature = "read")]
            watch: Default::default(),
        }))
    }
}
