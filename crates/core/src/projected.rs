//! A sphere in view space, in f64, and how far it is off.
//!
//! View space has its origin at the camera, x to the right, y up, z along the view direction;
//! lengths are world units times a power of two that keeps squares in range (1 unless the scene is
//! extreme).
//!
//! **Position bound.** With `u = 2^-53` and `L = |x| + |y| + |z|`, each coordinate is within
//! `5 u L` (docs/numerics.md, lemma P1). [`Projected::bound`] is `P = 8 u (L + r)`: what is done
//! next may round by `3 u L + 8 u r`. So `z - r - P` and `z + r + P` bound the depths of a sphere
//! (lemma P2).

use crate::float::{FLOOR, U};

/// Relative bound of view-space coordinates; see the file's head.
const POSITION: f64 = 8.0 * U;

/// A sphere in view space, rounded.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
pub struct Projected {
    /// To the right.
    pub x: f64,
    /// Up.
    pub y: f64,
    /// Depth of the centre.
    pub z: f64,
    /// Radius.
    pub r: f64,
}

impl Projected {
    /// Bound of the error of each coordinate.
    #[inline(always)]
    pub fn bound(&self) -> f64 {
        (self.x.abs() + self.y.abs() + self.z.abs() + self.r) * POSITION + FLOOR
    }

    /// Nothing of the sphere is nearer.
    #[inline(always)]
    pub fn nearest(&self) -> f64 {
        self.z - self.r - self.bound()
    }

    /// Nothing of the sphere is farther.
    #[inline(always)]
    pub fn farthest(&self) -> f64 {
        self.z + self.r + self.bound()
    }
}
