//! The order of spheres on the device: neighbours in space lie together, so that what a tile's list names shares cache lines.
//!
//! Cells of a grid, in Morton order, and inside a cell the order of the scene. Few spheres stay as they are: they fit a cache anyway.

use std::ops::Range;

use rayon::prelude::*;

use crate::scene::{Bounds, Scene};

/// Below this many spheres the order is that of the scene.
const FEW: usize = 1 << 15;

/// Where each sphere lies on the device.
#[derive(Debug, Default)]
pub struct Order {
    /// Index in the scene of each place; empty if both are the same.
    indices: Vec<u32>,
    /// Place of each index; empty if both are the same.
    places: Vec<u32>,
}

/// The bits of `v` (of 8), two zeros between each.
fn spread(v: u32) -> u32 {
    (0..8).map(|k| (v >> k & 1) << (3 * k)).sum()
}

impl Order {
    /// Of a scene whose chunks are ordered each by itself: the spheres `range` of a chunk lie at the places `range`.
    pub fn new(scene: &Scene, chunks: impl Iterator<Item = Range<usize>>) -> Self {
        if scene.len() < FEW {
            return Self::default();
        }
        let mut order = Self { indices: vec![0; scene.len()], places: vec![0; scene.len()] };
        // About 32 spheres to a cell, at most 2^18 cells.
        let bits = ((scene.len() / 32).ilog2() / 3).clamp(1, 6);
        let side = 1u32 << bits;
        let Bounds { min_center, max_center, .. } = scene.bounds();
        let per_length = f64::from(side) / (0.5 * max_center - 0.5 * min_center) * 0.5;
        for chunk in chunks {
            let keys: Vec<u32> = chunk
                .clone()
                .into_par_iter()
                .with_min_len(1 << 12)
                .map(|index| {
                    let (block, at) = scene.locate(index);
                    // A cast of what is NaN, on an axis without extent, gives 0.
                    let cell = ((block.center(at) - min_center) * per_length)
                        .to_array()
                        .map(|c| spread((c as u32).min(side - 1)));
                    cell[0] | cell[1] << 1 | cell[2] << 2
                })
                .collect();
            let mut next = vec![0u32; 1 + (1 << (3 * bits))];
            keys.iter().for_each(|&key| next[key as usize + 1] += 1);
            let mut total = chunk.start as u32;
            for count in &mut next {
                total += *count;
                *count = total;
            }
            for (index, key) in chunk.zip(keys) {
                let place = &mut next[key as usize];
                order.indices[*place as usize] = index as u32;
                order.places[index] = *place;
                *place += 1;
            }
        }
        order
    }

    /// Index in the scene of what lies at a place.
    #[inline(always)]
    pub fn index(&self, place: u32) -> u32 {
        if self.indices.is_empty() { place } else { self.indices[place as usize] }
    }

    /// Place of a sphere.
    #[inline(always)]
    pub fn place(&self, index: u32) -> u32 {
        if self.places.is_empty() { index } else { self.places[index as usize] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Sphere;
    use glam::DVec3;

    #[test]
    fn an_order_is_a_permutation_inside_each_chunk() {
        for flat in [false, true] {
            let spheres: Vec<Sphere> = (0..FEW + 7)
                .map(|k| {
                    let [x, y, z] = [3, 5, 7].map(|m| (k * 1_000_003 * m % 65_537) as f64);
                    let center = if flat { DVec3::new(x, 1.0, 1.0) } else { DVec3::new(x, y, z) };
                    Sphere { center, radius: 1.0, color: [0; 3] }
                })
                .collect();
            let scene = Scene::from_spheres(&spheres).unwrap();
            let chunks = [0..20_000, 20_000..scene.len()];
            let order = Order::new(&scene, chunks.iter().cloned());
            for chunk in chunks {
                for place in chunk.clone() {
                    let index = order.index(place as u32);
                    assert!(chunk.contains(&(index as usize)));
                    assert_eq!(order.place(index), place as u32);
                }
            }
            let jumps = (1..20_000u32).map(|k| {
                let [a, b] = [k - 1, k].map(|p| spheres[order.index(p) as usize].center);
                a.distance(b)
            });
            assert!(jumps.sum::<f64>() / 20_000.0 < 10_000.0, "neighbours lie together");
        }
    }
}
