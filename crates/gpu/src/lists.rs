//! Tile lists for the device: made on the host in f64, in waves where one would be too long.

use std::{fmt, ops::Range, sync::Arc};

use crate::plan::{Lists, TILE};
use planisphere_core::{
    bins::{self, Binner, Keep, Window, Workspace, split, split_groups},
    camera::Region,
    cover::Cover,
    drawing::Met,
    exact::decide::Truth,
    ids::{SortedIndex, SphereIndex, TileIndex},
    order::Ordered,
    project::Projector,
    scene::{Ball, Scene},
    simd,
};

/// Some tiles only.
#[derive(Debug)]
pub struct These<'a>(pub &'a [bool]);

impl Keep for These<'_> {
    #[inline(always)]
    fn depths(&self, tile: usize) -> [f64; 2] {
        if self.0[tile] {
            [f64::NEG_INFINITY, f64::INFINITY]
        } else {
            [f64::INFINITY, f64::NEG_INFINITY]
        }
    }

    #[inline(always)]
    fn keep(&self, tile: usize, _: f64, _: Window) -> bool {
        self.0[tile]
    }
}

/// Culls what begins behind the occluders' depths. A tile's occluder is listed only if more than
/// the occluder can be seen there.
pub struct Uncovered<'a> {
    /// The cover, whose blocks are tiles.
    pub cover: &'a Cover,
    /// Places of the scene's large spheres; none for those that are left out. Empty if these are
    /// listed as others are.
    pub places: &'a [Option<SortedIndex>],
    /// Whether earlier lists hold the cover.
    pub listed: bool,
}

impl fmt::Debug for Uncovered<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Uncovered")
            .field("farthest", &self.cover.farthest())
            .field("places", &self.places.len())
            .field("listed", &self.listed)
            .finish_non_exhaustive()
    }
}

impl Keep for Uncovered<'_> {
    #[inline(always)]
    fn depths(&self, tile: usize) -> [f64; 2] {
        [f64::NEG_INFINITY, self.cover.depths()[tile]]
    }

    fn farthest(&self) -> f64 {
        self.cover.farthest()
    }

    #[inline(always)]
    fn behind(&self, tile: usize) -> Option<(SortedIndex, f64)> {
        let (number, nearest) = self.cover.sphere(tile)?;
        Some((self.places.get(number).copied().flatten()?, nearest))
    }

    fn listed(&self) -> bool {
        self.listed
    }

    #[inline(always)]
    fn keep(&self, _: usize, _: f64, _: Window) -> bool {
        true
    }
}

/// Spheres, and what is known of them.
#[derive(Clone, Copy)]
pub struct Spheres<'a> {
    /// The spheres.
    pub scene: &'a Scene,
    /// What decides about them in this view.
    pub truth: &'a Truth,
    /// Their order on the device; that of the scene if there is none.
    pub ordered: Option<&'a Arc<Ordered>>,
}

impl fmt::Debug for Spheres<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Spheres")
            .field("spheres", &self.scene.len())
            .field("places", &self.places())
            .field("ordered", &self.ordered.is_some())
            .finish_non_exhaustive()
    }
}

impl Spheres<'_> {
    /// Index in the scene of what lies at a place.
    #[inline(always)]
    pub fn index(&self, place: SortedIndex) -> SphereIndex {
        self.ordered.map_or(SphereIndex(place.0), |ordered| ordered.indices[place.at()])
    }

    /// How many places there are; fewer than spheres where many are the same.
    pub fn places(&self) -> usize {
        self.ordered.map_or(self.scene.len(), |ordered| ordered.len())
    }

    /// What lies at a place.
    #[inline(always)]
    pub fn ball(&self, place: SortedIndex) -> Ball {
        let (block, at) = match self.ordered {
            Some(ordered) => (&ordered.block, place.at()),
            None => self.scene.locate(place.at()),
        };
        Ball { center: block.center(at), radius: block.radius(at) }
    }

    /// A hint that a place is soon to be looked at.
    #[inline(always)]
    pub fn prefetch(&self, place: SortedIndex) {
        let (block, at) = match self.ordered {
            Some(ordered) => {
                simd::prefetch(&ordered.indices, place.at());
                (&ordered.block, place.at())
            }
            None => self.scene.locate(place.at()),
        };
        block.prefetch(at);
    }

    /// What [`Wave::collect`] takes of some places, one part a thread: groups if there are any,
    /// else spheres.
    pub fn split(&self, places: Range<usize>) -> Vec<Range<usize>> {
        match self.ordered {
            Some(ordered) => split_groups(ordered.groups_of(places)),
            None => split(places),
        }
    }
}

/// The lists of one wave, in memory that is used again.
#[derive(Default)]
pub struct Wave {
    workspace: Workspace<SortedIndex>,
    columns: u32,
    rows: u32,
    disorder: f64,
    /// World length of a view length.
    unit: f64,
}

impl fmt::Debug for Wave {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Wave")
            .field("columns", &self.columns)
            .field("rows", &self.rows)
            .field("entries", &self.workspace.lists.entries.len())
            .field("disorder", &self.disorder)
            .finish_non_exhaustive()
    }
}

impl Wave {
    /// Lists for the tiles of `region`, of places on the device; takes as many spheres out of
    /// `left` as give about `limit` entries. Returns the projector, which decisions use too, and
    /// what was met.
    pub fn collect<K: Keep>(
        &mut self,
        spheres: Spheres<'_>,
        region: Region,
        left: &mut [Range<usize>],
        limit: usize,
        keep: &K,
    ) -> (Projector, Met) {
        let Spheres { scene, truth, ordered } = spheres;
        let binner = Binner::new(scene, truth, region, TILE.trailing_zeros())
            .by_groups(ordered.map(Arc::as_ref))
            .for_kept(keep);
        let grid = binner.grid;
        let lists = binner.lists(left, keep, limit, &mut self.workspace);
        (self.columns, self.rows) = (grid.columns, grid.rows);
        self.unit = 1.0 / truth.scale();
        // Slabs are equally thick, and nothing that is listed begins outside of them but for
        // roundings: lemma B3 of docs/numerics.md.
        self.disorder = match grid.slabs {
            0..3 => f64::INFINITY,
            slabs => {
                let (second, last) = (grid.slab_start(1), grid.slab_start(slabs - 1));
                let thick = (last - second) / f64::from(slabs - 2);
                (1.000_001 * thick + 1e-11 * (second.abs() + last.abs() + thick)) * self.unit
            }
        };
        (binner.projector, lists.met)
    }

    /// As the plan takes them.
    pub fn lists(&self) -> Lists<'_> {
        let bins::Lists { starts, entries, nearest, .. } = &self.workspace.lists;
        Lists {
            columns: self.columns,
            rows: self.rows,
            starts,
            entries,
            nearest,
            unit: self.unit,
            disorder: self.disorder,
        }
    }

    /// A hint that the first of a tile's list are soon to be looked at.
    pub fn prefetch(&self, tile: TileIndex) {
        let bins::Lists { starts, entries, .. } = &self.workspace.lists;
        let start = starts[tile.at()] as usize;
        for at in [0, 16, 32] {
            simd::prefetch(entries, start + at);
        }
    }

    /// The list of a tile.
    pub fn tile(&self, tile: TileIndex) -> &[SortedIndex] {
        let bins::Lists { starts, entries, .. } = &self.workspace.lists;
        &entries[starts[tile.at()] as usize..starts[tile.at() + 1] as usize]
    }
}
