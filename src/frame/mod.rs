//! Planes of a picture: what the ids of a drawing look like, and how planes become bytes.
//!
//! Everything follows from the ids and the scene, the same on every machine. This module knows no devices and no files:
//! it writes into any [`std::io::Write`].

mod depth;
mod npy;
mod png;

pub use depth::{depth_plane, depths, distance_bounds};
pub use npy::{Plane, header as npy_header, record_header as npy_record_header, write_f32, write_i32};
pub use png::{PngFile, PngRows, write_png};

use rayon::prelude::*;

use crate::scene::Scene;

/// Colours of ids: a sphere's own, the background's for -1.
#[derive(Clone, Copy)]
pub struct Paint<'a> {
    /// Where the ids come from.
    pub scene: &'a Scene,
    /// Colour where there is no sphere, sRGB.
    pub background: [u8; 3],
}

impl Paint<'_> {
    /// The colour of an id.
    pub fn color(&self, id: i32) -> [u8; 3] {
        usize::try_from(id).map_or(self.background, |index| self.scene.color(index))
    }

    /// Calls `each` with every id's place and colour, in order; neighbours of one id share one look-up.
    fn each(&self, ids: &[i32], mut each: impl FnMut(usize, [u8; 3])) {
        let (mut last, mut color) = (-1, self.background);
        for (at, &id) in ids.iter().enumerate() {
            if id != last {
                (last, color) = (id, self.color(id));
            }
            each(at, color);
        }
    }

    /// The colour plane: sRGB, one for each id, in their order.
    pub fn colors(&self, ids: &[i32]) -> Vec<[u8; 3]> {
        let mut colors = vec![[0; 3]; ids.len()];
        colors.par_chunks_mut(1 << 14).zip(ids.par_chunks(1 << 14)).for_each(|(colors, ids)| {
            self.each(ids, |at, color| colors[at] = color);
        });
        colors
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::scene::Sphere;

    #[test]
    fn ids_take_the_colours_of_their_spheres() {
        let ball = |color| Sphere { center: DVec3::ZERO, radius: 1.0, color };
        let scene = Scene::from_spheres(&[ball([1, 2, 3]), ball([4, 5, 6])]).unwrap();
        let paint = Paint { scene: &scene, background: [9, 9, 9] };
        assert_eq!(paint.colors(&[1, 1, -1, 0, 1]), [[4, 5, 6], [4, 5, 6], [9, 9, 9], [1, 2, 3], [4, 5, 6]]);
        let many: Vec<i32> = (0..100_000).map(|k| k % 3 - 1).collect();
        assert!(paint.colors(&many).iter().zip(&many).all(|(&color, &id)| color == paint.color(id)));
    }
}
