//! The usual distance between neighbours, which decides how large particles without radii are.
//!
//! It is the median (of an even number the smaller of the two in the middle) of the distances from
//! some particles to the nearest that is not at the same place. These are particles
//! `floor(k N / m)` of N, k from 0 to m - 1, with m = min(N, 512); their neighbours are looked for
//! among all. The same positions have the same distance, on every machine.
//!
//! Cells of a grid tell which particles are near. They begin small: only the closest tenth of the
//! samples is as close to another sample, so that few pairs are looked at wherever most particles
//! are. They grow until half of the samples have found a neighbour: the others are farther from
//! theirs.

use std::collections::HashMap;

use rayon::prelude::*;

use planisphere_core::scene::Reals;

/// Particles whose neighbours are looked for, at most.
const SAMPLE: usize = 512;

/// Cells along each axis of the table that is looked at first, in which places come again.
const TABLE: usize = 64;

/// Particles that a thread takes at a time.
const PIECE: usize = 1 << 14;

/// The usual distance between neighbours; none where there are no two places.
pub(super) fn spacing(centers: &Reals) -> Option<f64> {
    match centers {
        Reals::F32(centers) => of_points(centers.as_slice()),
        Reals::F64(centers) => of_points(centers.as_slice()),
    }
}

fn of_points<T: Copy + Into<f64> + Sync>(numbers: &[T]) -> Option<f64> {
    let (points, _) = numbers.as_chunks::<3>();
    let point = |index: usize| points[index].map(Into::into);
    let (count, samples) = (points.len(), points.len().min(SAMPLE));
    let sampled = |k| point((k as u128 * count as u128 / samples as u128) as usize);
    let places: Vec<[f64; 3]> = (0..samples).map(sampled).collect();
    let mut nearest: Vec<f64> = places.iter().map(|place| nearest_of(*place, &places)).collect();
    let mut sorted = nearest.clone();
    sorted.sort_unstable_by(f64::total_cmp);
    let middle = samples.checked_sub(1)? / 2;
    if count == samples {
        return sorted.get(middle).copied().filter(|distance| distance.is_finite());
    }
    // As if all were spread like the samples, in space.
    let closer = (samples as f64 / count as f64).cbrt();
    let mut side = 2.0 * sorted[samples / 10] * closer;
    if !(side > 0.0 && side.is_finite()) {
        side = 1e-6 * extent(points)?;
    }
    // A grid that no f64 can have, or that never ends, has no neighbours to find.
    for _ in 0..64 {
        Grid::new(side, &places).look(points, &places, &mut nearest);
        let mut found: Vec<f64> = nearest.clone();
        found.sort_unstable_by(f64::total_cmp);
        // Rounding may put what is a side away beyond the cells that are looked at.
        if found[middle] <= 0.99 * side {
            return Some(found[middle]);
        }
        side *= 3.0;
    }
    None
}

/// The longest side of a box around all; none where it has no length.
fn extent<T: Copy + Into<f64> + Sync>(points: &[[T; 3]]) -> Option<f64> {
    let along = |axis: usize| {
        let values = points.par_iter().map(|point| point[axis].into());
        let least = values.clone().reduce(|| f64::INFINITY, f64::min);
        values.reduce(|| f64::NEG_INFINITY, f64::max) - least
    };
    let longest = (0..3).map(along).fold(0.0, f64::max);
    (longest > 0.0 && longest.is_finite()).then_some(longest)
}

/// The distance to the nearest of some places that is another one.
fn nearest_of(place: [f64; 3], places: &[[f64; 3]]) -> f64 {
    let others = places.iter().map(|other| distance(place, *other));
    others.filter(|distance| *distance > 0.0).fold(f64::INFINITY, f64::min)
}

/// The cells around the samples.
struct Grid {
    origin: [f64; 3],
    a_side: f64,
    /// The samples near a cell.
    near: HashMap<[i64; 3], Vec<u32>>,
    /// Whether there may be such a cell.
    maybe: Vec<u64>,
}

impl Grid {
    fn new(side: f64, places: &[[f64; 3]]) -> Self {
        let (near, maybe) = (HashMap::new(), vec![0; TABLE * TABLE * TABLE / 64]);
        let mut grid = Self { origin: places[0], a_side: 1.0 / side, near, maybe };
        for (number, place) in places.iter().enumerate() {
            let [x, y, z] = grid.cell(*place);
            for step in 0..27 {
                let cell = [
                    x.saturating_add(step % 3 - 1),
                    y.saturating_add(step / 3 % 3 - 1),
                    z.saturating_add(step / 9 - 1),
                ];
                grid.near.entry(cell).or_default().push(number as u32);
                let bit = bit(cell);
                grid.maybe[bit / 64] |= 1 << (bit % 64);
            }
        }
        grid
    }

    /// The cell of a place.
    #[inline]
    fn cell(&self, point: [f64; 3]) -> [i64; 3] {
        [0, 1, 2].map(|axis| {
            let at = (point[axis] - self.origin[axis]) * self.a_side;
            // The floor, of which some processors know nothing.
            let whole = at as i64;
            whole.saturating_sub(i64::from(at < whole as f64))
        })
    }

    /// Brings each sample nearer to its neighbour, if there is one within a side.
    fn look<T: Copy + Into<f64> + Sync>(
        &self,
        points: &[[T; 3]],
        places: &[[f64; 3]],
        nearest: &mut [f64],
    ) {
        let none = || vec![f64::INFINITY; places.len()];
        let piece = |mut nearest: Vec<f64>, points: &[[T; 3]]| {
            for point in points {
                let other = point.map(Into::into);
                let cell = self.cell(other);
                let bit = bit(cell);
                if self.maybe[bit / 64] >> (bit % 64) & 1 == 0 {
                    continue;
                }
                for number in self.near.get(&cell).into_iter().flatten() {
                    let distance = distance(places[*number as usize], other);
                    let to = &mut nearest[*number as usize];
                    if distance > 0.0 && distance < *to {
                        *to = distance;
                    }
                }
            }
            nearest
        };
        let less = |mut a: Vec<f64>, b: Vec<f64>| {
            a.iter_mut().zip(b).for_each(|(a, b)| *a = a.min(b));
            a
        };
        let found = points.par_chunks(PIECE).fold(none, piece).reduce(none, less);
        nearest.iter_mut().zip(found).for_each(|(to, found)| *to = to.min(found));
    }
}

/// The place of a cell in a table in which cells come again and again.
#[inline]
fn bit(cell: [i64; 3]) -> usize {
    let [x, y, z] = cell.map(|at| at as usize % TABLE);
    (z * TABLE + y) * TABLE + x
}

#[inline]
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
            [(1, 3000, 1.0), (2, 700, 1e-9), (3, 5, 1.0), (4, 2, 0.0), (5, 40_000, 0.01)]
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
        for points in [&[][..], &[[1.0; 3]], &[[1.0; 3]; 2], &[[1.0; 3]; 700]] {
            assert_eq!(spacing(&Reals::F64(scene_column(points))), None);
        }
        // Two places, of which the samples see one.
        let mut points = vec![[1.0; 3]; 700];
        points[699] = [2.0, 1.0, 1.0];
        assert_eq!(spacing(&Reals::F64(scene_column(&points))), Some(1.0));
    }
}
