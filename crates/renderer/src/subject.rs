//! What a picture on its way out is of, whoever has found its ids.

use planisphere_core::{
    camera::Region, depth, depth::PlaneError, drawing::Control, exact::decide::Truth, part::Meta,
    part::merge::MergeError, scene::Scene,
};
#[cfg(feature = "files")]
use planisphere_image::Paint;

use crate::{
    Error,
    bands::{PIECE, bands},
};

/// What a picture is of.
pub(crate) struct Subject<'a> {
    /// View, region, background, and which spheres of the whole there are.
    pub meta: &'a Meta,
    /// The spheres that ids are of.
    pub scene: &'a Scene,
    /// The decisions of the view.
    pub truth: &'a Truth,
    /// What the spheres are called outside.
    pub indices: Indices<'a>,
    /// Pixels that are wanted at a time.
    #[cfg_attr(not(feature = "files"), expect(dead_code, reason = "files come in bands"))]
    pub band: usize,
    /// Ends it, and hears how far it is.
    pub control: &'a Control,
    /// What it means that a sphere is not hit where it was found: an id, a column and a row.
    pub not_seen: &'a (dyn Fn(i32, u32, u32) -> Option<MergeError> + Sync),
}

impl Subject<'_> {
    /// What gives ids their colours.
    #[cfg(feature = "files")]
    pub fn paint(&self) -> Paint<'_> {
        Paint { scene: self.scene, background: self.meta.background }
    }

    /// Distances of the ids of some rows.
    pub fn depths(&self, some: Region, ids: &[i32]) -> Result<Vec<f32>, Error> {
        self.plane(some, ids, |some, ids| depth::depths(self.scene, self.truth, some, ids))
    }

    /// Numbers of the ids of some rows, which are worked out some rows at a time.
    pub fn plane<T>(
        &self,
        some: Region,
        ids: &[i32],
        of: impl Fn(Region, &[i32]) -> Result<Vec<T>, PlaneError>,
    ) -> Result<Vec<T>, Error> {
        let mut all = Vec::with_capacity(ids.len());
        for piece in bands(some, PIECE) {
            self.control.check()?;
            let ids = &ids[all.len()..all.len() + piece.pixels()];
            all.extend(of(piece, ids).map_err(|error| self.refused(error))?);
        }
        Ok(all)
    }

    /// Why distances cannot be worked out.
    pub fn refused(&self, error: PlaneError) -> Error {
        let known = match error {
            PlaneError::NotSeen { id, column, row } => (self.not_seen)(id, column, row),
            _ => None,
        };
        known.map_or_else(|| error.into(), Error::from)
    }
}

/// Indices of the spheres in the whole.
pub(crate) enum Indices<'a> {
    /// In the scene's order, from the first on; arrays of ids are of the scene itself, from 0.
    From {
        /// In the whole.
        first: u64,
    },
    /// One each, rising.
    Each(&'a [u64]),
}

impl Indices<'_> {
    pub fn of(&self, place: usize) -> u64 {
        match self {
            Self::From { first } => first + place as u64,
            Self::Each(indices) => indices[place],
        }
    }

    /// Of an id of the scene; -1 is none.
    pub fn of_id(&self, id: i32) -> i64 {
        usize::try_from(id).map_or(-1, |place| self.of(place) as i64)
    }
}
