//! What the ids of a picture look like: samples become pixels.
//!
//! Everything follows from the ids and the scene, the same on every machine. This crate is pure: it
//! knows no device and no file.

#![cfg_attr(not(test), warn(clippy::print_stdout, clippy::print_stderr))]
#![warn(missing_debug_implementations)]

use std::{fmt, ops::Range};

use rayon::prelude::*;

use planisphere_core::{depth::PlaneError, scene::Scene};

pub mod compare;
pub mod form;
pub mod linear;
pub mod linear16;
pub mod look;
pub mod maps;
mod outline;
#[cfg(feature = "overlay")]
pub mod overlay;
pub mod resolve;
mod shaded;
pub mod style;

/// Colours of ids: a sphere's own, the background's for -1.
#[derive(Clone, Copy)]
pub struct Paint<'a> {
    /// Where the ids come from.
    pub scene: &'a Scene,
    /// Colour where there is no sphere, sRGB.
    pub background: [u8; 3],
}

impl fmt::Debug for Paint<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Paint")
            .field("spheres", &self.scene.len())
            .field("background", &self.background)
            .finish()
    }
}

impl Paint<'_> {
    /// The colour of an id; none of what is no sphere of the scene.
    pub fn color(&self, id: i32) -> Option<[u8; 3]> {
        usize::try_from(id).map_or(Some(self.background), |index| self.scene.color(index))
    }

    /// Refuses ids that are none of the scene's spheres.
    ///
    /// # Errors
    /// The first of them.
    pub fn check(&self, ids: &[i32]) -> Result<(), PlaneError> {
        const PART: usize = 1 << 16;
        let spheres = self.scene.len();
        let foreign = |id: i32| usize::try_from(id).is_ok_and(|index| index >= spheres);
        let greatest = ids
            .par_chunks(PART)
            .map(|ids| ids.iter().fold(i32::MIN, |most, &id| most.max(id)))
            .max();
        if !greatest.is_some_and(foreign) {
            return Ok(());
        }
        ids.iter()
            .find(|id| foreign(**id))
            .map_or(Ok(()), |&id| Err(PlaneError::NoSphere { id, spheres }))
    }

    /// Runs of one id, in order: their places and their colours.
    ///
    /// The ids are known to be the scene's.
    pub fn runs(&self, ids: &[i32]) -> impl Iterator<Item = (Range<usize>, [u8; 3])> {
        let mut start = 0;
        std::iter::from_fn(move || {
            let id = *ids.get(start)?;
            let run = start..start + run(id, &ids[start..]);
            start = run.end;
            Some((run, self.color(id).expect("the ids were checked")))
        })
    }

    /// The colour plane: sRGB, one for each id, in their order.
    ///
    /// # Errors
    /// When an id is none of the scene's spheres.
    pub fn colors(&self, ids: &[i32]) -> Result<Vec<[u8; 3]>, PlaneError> {
        let mut colors = vec![[0; 3]; ids.len()];
        self.fill(ids, &mut colors, |color| color)?;
        Ok(colors)
    }

    /// The same into memory that is there, as pixels of some form. Of the longer of the two slices
    /// the rest is left as it is.
    ///
    /// # Errors
    /// As [`Paint::colors`]; then nothing is written.
    pub fn fill<P: Copy + Send>(
        &self,
        ids: &[i32],
        pixels: &mut [P],
        pixel: impl Fn([u8; 3]) -> P + Sync,
    ) -> Result<(), PlaneError> {
        self.check(ids)?;
        pixels.par_chunks_mut(1 << 14).zip(ids.par_chunks(1 << 14)).for_each(|(pixels, ids)| {
            self.runs(ids).for_each(|(run, color)| pixels[run].fill(pixel(color)));
        });
        Ok(())
    }
}

/// How many ids at the beginning are this one.
fn run(id: i32, ids: &[i32]) -> usize {
    let short = ids.iter().take(LANES).take_while(|&&other| other == id).count();
    if short < LANES {
        return short;
    }
    // Many at a time, without a way out in between.
    let same = |ids: &&[i32; LANES]| ids.iter().fold(true, |same, &other| same & (other == id));
    let whole = LANES * ids.as_chunks::<LANES>().0.iter().take_while(same).count();
    whole + ids[whole..].iter().take_while(|&&other| other == id).count()
}

/// Ids that are compared at a time.
const LANES: usize = 16;

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use planisphere_core::scene::Sphere;

    #[test]
    fn ids_take_the_colours_of_their_spheres() {
        let ball = |color| Sphere { center: DVec3::ZERO, radius: 1.0, color };
        let scene = Scene::from_spheres(&[ball([1, 2, 3]), ball([4, 5, 6])]).unwrap();
        let paint = Paint { scene: &scene, background: [9, 9, 9] };
        let few = paint.colors(&[1, 1, -1, 0, 1]).unwrap();
        assert_eq!(few, [[4, 5, 6], [4, 5, 6], [9, 9, 9], [1, 2, 3], [4, 5, 6]]);
        assert_eq!(paint.colors(&[0, 2, 3]), Err(PlaneError::NoSphere { id: 2, spheres: 2 }));
        assert_eq!(
            (paint.color(2), paint.color(i32::MAX), paint.color(-1)),
            (None, None, Some([9, 9, 9]))
        );
        let many: Vec<i32> = (0..100_000).map(|k| k % 3 - 1).collect();
        let runs: Vec<i32> =
            (0..300).flat_map(|k| std::iter::repeat_n(k % 3 - 1, k as usize % 70)).collect();
        assert!(
            paint
                .colors(&runs)
                .unwrap()
                .iter()
                .zip(&runs)
                .all(|(&color, &id)| Some(color) == paint.color(id))
        );
        assert!(
            paint
                .runs(&runs)
                .all(|(run, _)| runs[run.clone()].iter().all(|&id| id == runs[run.start]))
        );
        assert_eq!(paint.runs(&[1; 40]).collect::<Vec<_>>(), [(0..40, [4, 5, 6])]);
        assert!(
            paint
                .colors(&many)
                .unwrap()
                .iter()
                .zip(&many)
                .all(|(&color, &id)| Some(color) == paint.color(id))
        );
    }
}
