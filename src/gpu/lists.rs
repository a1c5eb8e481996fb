//! Tile lists for the device: made on the host in f64, in waves where one would be too long.

use std::ops::Range;

use rayon::prelude::*;

use super::order::Order;
use crate::{
    bins::{Binner, Item, Keep, Met, Window, Workspace, towards_eye},
    camera::Region,
    exact::decide::Truth,
    plan::{Lists, TILE},
    project::{Projected, Projector},
    scene::Scene,
};

/// An index, and where the sphere begins.
#[derive(Clone, Copy, Debug, Default)]
struct Index {
    index: u32,
    /// In view lengths, rounded towards the eye.
    nearest: f32,
}

impl Item for Index {
    #[inline(always)]
    fn new(_: Projected, nearest: f64, index: u32, _: Window) -> Self {
        Self { index, nearest: towards_eye(nearest) }
    }
}

/// Some tiles only.
pub struct These<'a>(pub &'a [bool]);

impl Keep for These<'_> {
    #[inline(always)]
    fn depths(&self, tile: usize) -> [f64; 2] {
        if self.0[tile] { [f64::NEG_INFINITY, f64::INFINITY] } else { [f64::INFINITY, f64::NEG_INFINITY] }
    }

    #[inline(always)]
    fn keep(&self, tile: usize, _: f64, _: Window) -> bool {
        self.0[tile]
    }
}

/// Spheres, and what is known of them.
#[derive(Clone, Copy)]
pub struct Spheres<'a> {
    /// The spheres.
    pub scene: &'a Scene,
    /// What decides about them in this view.
    pub truth: &'a Truth,
    /// Where they lie on the device.
    pub order: &'a Order,
}

/// The lists of one wave, in memory that is used again.
#[derive(Default)]
pub struct Wave {
    workspace: Workspace<Index>,
    columns: u32,
    rows: u32,
    starts: Vec<u32>,
    /// Places on the device.
    pub entries: Vec<u32>,
    /// World units.
    nearest: Vec<f64>,
    disorder: f64,
    /// What was met on the way.
    pub met: Met,
}

impl Wave {
    /// Lists for the tiles of `region`, of places in `order`; takes as many spheres out of `left` as give about `limit` entries. Returns the
    /// projector, which decisions use too.
    pub fn collect<K: Keep>(
        &mut self,
        spheres: Spheres<'_>,
        region: Region,
        left: &mut [Range<usize>],
        limit: usize,
        keep: &K,
    ) -> Projector {
        let Spheres { scene, truth, order } = spheres;
        let binner = Binner::new(scene, truth, region, TILE.trailing_zeros());
        let grid = binner.grid;
        let lists = binner.lists(left, keep, limit, &mut self.workspace);
        (self.columns, self.rows) = (grid.columns, grid.rows);
        self.met = lists.met;
        self.starts.clear();
        self.starts.extend(lists.starts.iter().step_by(grid.slabs as usize));
        lists
            .entries
            .par_iter()
            .with_min_len(1 << 14)
            .map(|e| order.place(e.index))
            .collect_into_vec(&mut self.entries);
        let world = 1.0 / truth.scale();
        let starts = &self.starts;
        (0..grid.tiles())
            .into_par_iter()
            .with_min_len(1 << 8)
            .map(|tile| {
                let list = &lists.entries[starts[tile] as usize..starts[tile + 1] as usize];
                f64::from(list.iter().map(|e| e.nearest).fold(f32::INFINITY, f32::min)) * world
            })
            .collect_into_vec(&mut self.nearest);
        // Slabs are equally thick, and nothing that is listed begins outside of them but for roundings.
        self.disorder = match grid.slabs {
            0..3 => f64::INFINITY,
            slabs => {
                let (second, last) = (grid.slab_start(1), grid.slab_start(slabs - 1));
                let thick = (last - second) / f64::from(slabs - 2);
                (1.000_001 * thick + 1e-11 * (second.abs() + last.abs() + thick)) * world
            }
        };
        binner.projector
    }

    /// Takes out the lists of one entry of those tiles that `only` tells, and puts the tiles' spheres into `backgrounds`.
    pub fn take_single(&mut self, order: &Order, only: impl Fn(usize) -> bool, backgrounds: &mut [i32]) {
        let (mut first, mut kept) = (0, 0);
        for tile in 0..self.nearest.len() {
            let list = first..self.starts[tile + 1] as usize;
            first = list.end;
            self.starts[tile] = kept as u32;
            if list.len() == 1 && only(tile) {
                backgrounds[tile] = order.index(self.entries[list.start]) as i32;
                self.nearest[tile] = f64::INFINITY;
            } else {
                self.entries.copy_within(list.clone(), kept);
                kept += list.len();
            }
        }
        if let Some(end) = self.starts.last_mut() {
            *end = kept as u32;
        }
        self.entries.truncate(kept);
    }

    /// As the plan takes them.
    pub fn lists(&self) -> Lists<'_> {
        Lists {
            columns: self.columns,
            rows: self.rows,
            starts: &self.starts,
            entries: &self.entries,
            nearest: &self.nearest,
            disorder: self.disorder,
        }
    }

    /// The list of a tile.
    pub fn tile(&self, tile: usize) -> &[u32] {
        &self.entries[self.starts[tile] as usize..self.starts[tile + 1] as usize]
    }
}
