//! The usual distance between neighbours, which decides how large particles without radii are.
//!
//! It is the median (of an even number the smaller of the two in the middle) of the distances from
//! some particles to the nearest that is not at the same place. These are particles
//! `floor(k N / m)` of N, k from 0 to m - 1, with m = min(N, 512); their neighbours are looked for
//! among all. The same positions have the same distance, on every machine.

use std::collections::HashMap;

use rayon::prelude::*;

use planisphere_core::scene::Reals;

/// Particles whose neighbours are looked for, at most.
const SAMPLE: usize = 512;

/// Bits of a table in which cells are looked up first.
const BITS: usize = 1 << 16;

/// The usual distance between neighbours; none where there are no two places.
pub(super) fn spacing(centers: &Reals) -> Option<f64> {
    let count = centers.len() / 3;
    let samples = count.min(SAMPLE);
    let point = |index: usize| [0, 1, 2].map(|axis| centers.get(3 * index + axis));
    let bounds = bounds(count, point)?;
    let longest = (0..3).map(|axis| bounds[1][axis] - bounds[0][axis]).fold(0.0, f64::max);
    if !(longest > 0.0 && longest.is_finite()) {
        return None;
    }
    let places: Vec<[f64; 3]> = (0..samples)
        .map(|k| point((k as u128 * count as u128 / samples as u128) as usize))
        .collect();
    let mut nearest = vec![f64::INFINITY; samples];
    // Distances a little shorter than a side are believed: rounding may put what is a side away
    // beyond the cells that are looked at. Cells of about two particles each, if these fill the space; doubled for those that find none.
    let sides = [0, 1, 2].map(|axis| (bounds[1][axis] - bounds[0][axis]).max(1e-6 * longest));
    let volume: f64 = sides.iter().map(|side| side / longest).product();
    let mut side = longest * (2.0 * volume / count as f64).cbrt();
    side = side.max(longest * 1e-6);
    loop {
        let open: Vec<usize> = (0..samples).filter(|k| nearest[*k] > 0.99 * side).collect();
        if open.is_empty() {
            break;
        }
        let grid = Grid::new(bounds[0], side, &places, &open);
        let found = grid.nearest(count, &point, &places);
        for (k, distance) in open.iter().zip(found) {
            nearest[*k] = distance;
        }
        if side > 2.0 * longest {
            break;
        }
        // What is farther than a side may have a nearer neighbour beyond the cells looked at.
        side *= 2.0;
    }
    nearest.retain(|distance| distance.is_finite());
    nearest.sort_unstable_by(f64::total_cmp);
    nearest.get(nearest.len().checked_sub(1)? / 2).copied()
}

/// The least and the greatest coordinates.
fn bounds(count: usize, point: impl Fn(usize) -> [f64; 3] + Sync) -> Option<[[f64; 3]; 2]> {
    let none = || [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    let with = |mut bounds: [[f64; 3]; 2], more: [[f64; 3]; 2]| {
        for axis in 0..3 {
            bounds[0][axis] = bounds[0][axis].min(more[0][axis]);
            bounds[1][axis] = bounds[1][axis].max(more[1][axis]);
        }
        bounds
    };
    let of = |index| [point(index), point(index)];
    (count > 0).then(|| (0..count).into_par_iter().map(of).reduce(none, with))
}

/// The cells around some of the samples.
struct Grid<'a> {
    least: [f64; 3],
    side: f64,
    open: &'a [usize],
    /// The places in `open` of the samples near a cell.
    near: HashMap<[i64; 3], Vec<u32>>,
    /// Whether there may be such a cell, by a hash.
    maybe: Vec<u64>,
}

impl<'a> Grid<'a> {
    fn new(least: [f64; 3], side: f64, places: &[[f64; 3]], open: &'a [usize]) -> Self {
        let (near, maybe) = (HashMap::new(), vec![0; BITS / 64]);
        let mut grid = Self { least, side, open, near, maybe };
        for (number, k) in open.iter().enumerate() {
            let [x, y, z] = grid.cell(places[*k]);
            for step in 0..27 {
                let cell = [x + step % 3 - 1, y + step / 3 % 3 - 1, z + step / 9 - 1];
                grid.near.entry(cell).or_default().push(number as u32);
                let bit = hash(cell);
                grid.maybe[bit / 64] |= 1 << (bit % 64);
            }
        }
        grid
    }

    fn cell(&self, point: [f64; 3]) -> [i64; 3] {
        [0, 1, 2].map(|axis| ((point[axis] - self.least[axis]) / self.side).floor() as i64)
    }

    /// The distance of each open sample to the nearest of all particles elsewhere, if that is within
    /// a side.
    fn nearest(
        &self,
        count: usize,
        point: &(impl Fn(usize) -> [f64; 3] + Sync),
        places: &[[f64; 3]],
    ) -> Vec<f64> {
        let none = || vec![f64::INFINITY; self.open.len()];
        let look = |mut nearest: Vec<f64>, index: usize| {
            let other = point(index);
            let cell = self.cell(other);
            let bit = hash(cell);
            if self.maybe[bit / 64] >> (bit % 64) & 1 == 0 {
                return nearest;
            }
            for number in self.near.get(&cell).into_iter().flatten() {
                let place = places[self.open[*number as usize]];
                let distance = distance(place, other);
                if distance > 0.0 {
                    let to = &mut nearest[*number as usize];
                    *to = to.min(distance);
                }
            }
            nearest
        };
        let less = |mut a: Vec<f64>, b: Vec<f64>| {
            a.iter_mut().zip(b).for_each(|(a, b)| *a = a.min(b));
            a
        };
        (0..count).into_par_iter().with_min_len(1 << 14).fold(none, look).reduce(none, less)
    }
}

fn hash([x, y, z]: [i64; 3]) -> usize {
    let mixed = (x as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15)
        ^ (y as u64).wrapping_mul(0xc2b2_ae3d_27d4_eb4f)
        ^ (z as u64).wrapping_mul(0x1656_67b1_9e37_79f9);
    (mixed >> 48) as usize % BITS
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    let [x, y, z] = [0, 1, 2].map(|axis| a[axis] - b[axis]);
    (x * x + y * y + z * z).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::make::Random;

    /// By the definition.
    fn brute(points: &[[f64; 3]]) -> Option<f64> {
        let samples = points.len().min(SAMPLE);
        let nearest = |k: usize| {
            let place = points[k * points.len() / samples];
            let others = points.iter().map(|other| distance(place, *other));
            others.filter(|distance| *distance > 0.0).fold(f64::INFINITY, f64::min)
        };
        let mut all: Vec<f64> = (0..samples).map(nearest).filter(|d| d.is_finite()).collect();
        all.sort_unstable_by(f64::total_cmp);
        all.get(all.len().checked_sub(1)? / 2).copied()
    }

    #[test]
    fn the_median_is_that_of_all_pairs() {
        for (seed, count, squeeze) in
            [(1, 3000, 1.0), (2, 700, 1e-9), (3, 5, 1.0), (4, 2, 0.0), (5, 4000, 0.01)]
        {
            let random = Random { seed };
            let unit = |index: usize, k: u64| f64::from(random.unit(3 * index as u64 + k));
            let point = |n| [unit(n, 0), unit(n, 1) * squeeze, unit(n, 2).powi(8)];
            let mut points: Vec<[f64; 3]> = (0..count).map(point).collect();
            // Some at one place, and one far away.
            points.extend_from_within(..count / 10);
            points.push([1000.0, 0.0, 0.0]);
            let centers = Reals::F64(scene_column(&points));
            assert_eq!(spacing(&centers), brute(&points), "seed {seed}");
        }
    }

    fn scene_column(points: &[[f64; 3]]) -> planisphere_core::scene::Column<f64> {
        planisphere_core::scene::Column::of_rows(points.to_vec())
    }

    #[test]
    fn without_two_places_there_is_none() {
        for points in [&[][..], &[[1.0; 3]], &[[1.0; 3], [1.0; 3]]] {
            assert_eq!(spacing(&Reals::F64(scene_column(points))), None);
        }
    }
}
