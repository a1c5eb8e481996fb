//! Spheres into view space in f64, with bounds: the first half of the filter that both devices
//! share.
//!
//! View space and the position bound `P` are told in [`crate::projected`].
//!
//! **Footprints.** A sphere is seen at no pixel outside of its footprint: that of a sphere that is
//! larger by [`REACH`] position bounds, and [`MARGIN`] more on each side. Lemmas P4 (parallel rays)
//! and P6 (perspective) of docs/numerics.md.

use glam::DVec3;

use crate::{
    camera::{MAX_SIDE, Projection, Region, View},
    exact::decide::Truth,
    filter::Screen,
    float::U,
    projected::Projected,
    scene::{Block, Radii, Reals},
    simd::LANES,
};

/// A footprint is wider than a sphere by this many position bounds (lemmas P4, P6).
pub const REACH: f64 = 1.5;
/// And by this many pixels: a unit in the last place of 2^14, for the roundings of a pixel's place.
pub const MARGIN: f64 = f64::from_bits((1023 - 38) << 52);
// Lemma P4 of docs/numerics.md: places on the screen are below 2^15.
const _: () = assert!(MAX_SIDE <= 1 << 15);
/// Bound of the slopes of tangents, see [`slopes`].
pub const SLOPE: f64 = 12.0 * U;

/// The camera of a region, rounded to f64.
pub struct Projector {
    /// Orthographic or perspective.
    pub projection: Projection,
    /// World lengths times this are view lengths.
    pub scale: f64,
    /// Nearest plane, in view lengths.
    pub near: f64,
    /// Farthest plane, in view lengths.
    pub far: f64,
    /// Screen coordinate of each column of the region, and infinity up to a multiple of 64.
    pub columns: Vec<f64>,
    /// Screen coordinate of each row of the region, and infinity up to a multiple of 64.
    pub rows: Vec<f64>,
    /// How far the screen reaches.
    pub screen: Screen,
    /// The region.
    pub region: Region,
    origin: DVec3,
    right: DVec3,
    up: DVec3,
    forward: DVec3,
    /// Column `= x * column[0] + column[1]`; rows likewise.
    column: [f64; 2],
    row: [f64; 2],
}

/// How many spheres are projected at once: arrays of this length stay in the first cache.
pub const BATCH: usize = 64;
// Masks of a batch are `u64` here, in `bins` and in `cpu::paint`, which shifts out what it lacks.
const _: () = assert!(BATCH == u64::BITS as usize);
// Loops over a batch are whole vectors.
const _: () = assert!(BATCH.is_multiple_of(LANES));

/// A batch of spheres in view space, one array a coordinate, and the pixels of the region that each
/// may be seen at: columns `left ..= right`, rows `top ..= bottom`; none if `left > right` or `top
/// > bottom`.
pub struct Batch {
    /// To the right.
    pub x: [f64; BATCH],
    /// Up.
    pub y: [f64; BATCH],
    /// Depth.
    pub z: [f64; BATCH],
    /// Radius.
    pub r: [f64; BATCH],
    /// Nothing of the sphere is nearer.
    pub nearest: [f64; BATCH],
    /// First column.
    pub left: [i32; BATCH],
    /// Last column.
    pub right: [i32; BATCH],
    /// First row.
    pub top: [i32; BATCH],
    /// Last row.
    pub bottom: [i32; BATCH],
    /// How many are filled.
    pub len: usize,
}

impl Default for Batch {
    fn default() -> Self {
        let (zeros, none) = ([0.0; BATCH], [0; BATCH]);
        Self {
            x: zeros,
            y: zeros,
            z: zeros,
            r: zeros,
            nearest: zeros,
            left: none,
            right: none,
            top: none,
            bottom: none,
            len: 0,
        }
    }
}

impl Batch {
    /// Sphere `k` of the batch.
    #[inline(always)]
    pub fn sphere(&self, k: usize) -> Projected {
        Projected { x: self.x[k], y: self.y[k], z: self.z[k], r: self.r[k] }
    }

    /// A bit for each of the first `len` that may be seen at a pixel.
    #[inline(always)]
    pub fn on_screen(&self, len: usize) -> u64 {
        let mut on_screen = 0u64;
        for k in 0..BATCH {
            let inside = (self.left[k] <= self.right[k]) & (self.top[k] <= self.bottom[k]);
            on_screen |= u64::from(inside) << k;
        }
        if len < BATCH { on_screen & ((1 << len) - 1) } else { on_screen }
    }
}

/// The greater; of NaN and a number, the number.
#[inline(always)]
fn greater(a: f64, number: f64) -> f64 {
    if a > number { a } else { number }
}

/// The lesser; of NaN and a number, the number.
#[inline(always)]
fn lesser(a: f64, number: f64) -> f64 {
    if a < number { a } else { number }
}

impl Projector {
    /// Of a region of the view that `truth` decides.
    pub fn new(truth: &Truth, region: Region) -> Self {
        let View { camera, pitch_x, pitch_y, image, .. } = *truth.view();
        let scale = truth.scale();
        let unit = match camera.projection {
            Projection::Orthographic => scale,
            Projection::Perspective => 1.0,
        };
        let (width, height) = (pitch_x.length * unit, pitch_y.length * unit);
        let (across, down) = (f64::from(pitch_x.divisor), f64::from(pitch_y.divisor));
        // The product and the quotient each round once: within 2 u.
        let sample =
            |odd: i32, length: f64, divisor: f64| f64::from(odd) * length / (2.0 * divisor);
        let padded = |count: u32, value: &dyn Fn(u32) -> f64| {
            let mut values: Vec<f64> = (0..count).map(value).collect();
            values.resize((count as usize).next_multiple_of(64), f64::INFINITY);
            values
        };
        let columns =
            padded(region.width, &|i| sample(truth.view().odd_x(region.x + i), width, across));
        let rows =
            padded(region.height, &|j| sample(truth.view().odd_y(region.y + j), height, down));
        let axes = truth.axes();
        let mut projector = Self {
            projection: camera.projection,
            scale,
            near: camera.near * scale,
            far: camera.far * scale,
            columns,
            rows,
            screen: Screen::new(None, 0.0),
            region,
            origin: camera.origin * scale,
            right: axes.right.nearest(),
            up: axes.up.nearest(),
            forward: axes.forward.nearest(),
            column: [across / width, 0.5 * (f64::from(image.width) - 1.0) - f64::from(region.x)],
            row: [-down / height, 0.5 * (f64::from(image.height) - 1.0) - f64::from(region.y)],
        };
        let ends = |values: &[f64], count: u32| [values[0], values[count as usize - 1]];
        let sides = match camera.projection {
            Projection::Orthographic => None,
            Projection::Perspective => {
                Some([ends(&projector.columns, region.width), ends(&projector.rows, region.height)])
            }
        };
        // `|x| + |y| + |z|` is greatest at a corner of the box; the factor covers the roundings of
        // the corners themselves.
        let bounds = truth.bounds();
        let corners =
            bounds.corners().map(|corner| projector.project(corner, bounds.max_radius).bound());
        projector.screen =
            Screen::new(sides, corners.into_iter().fold(0.0, f64::max) * (1.0 + 1e-9));
        projector
    }

    /// Whether a clip plane may cut a sphere; if not, and it is in the clip range, its near root is
    /// what is seen.
    #[inline(always)]
    pub fn cuts(&self, s: &Projected) -> bool {
        let bound = s.bound();
        !((s.z - s.r - bound > self.near) & (s.z + s.r + bound < self.far))
    }

    /// Spheres, one array a coordinate, into view space in place.
    #[inline(always)]
    pub fn turn<const COUNT: usize>(&self, [x, y, z]: [&mut [f64; COUNT]; 3]) {
        for k in 0..COUNT {
            let fx = x[k] * self.scale - self.origin.x;
            let fy = y[k] * self.scale - self.origin.y;
            let fz = z[k] * self.scale - self.origin.z;
            x[k] = fx * self.right.x + fy * self.right.y + fz * self.right.z;
            y[k] = fx * self.up.x + fy * self.up.y + fz * self.up.z;
            z[k] = fx * self.forward.x + fy * self.forward.y + fz * self.forward.z;
        }
    }

    /// One sphere.
    #[inline(always)]
    pub fn project(&self, center: DVec3, radius: f64) -> Projected {
        let f = center * self.scale - self.origin;
        Projected {
            x: f.dot(self.right),
            y: f.dot(self.up),
            z: f.dot(self.forward),
            r: radius * self.scale,
        }
    }

    /// A difference of two places, from world axes to those of view space; lengths stay as they
    /// are.
    #[inline(always)]
    pub fn rotate(&self, difference: DVec3) -> DVec3 {
        DVec3::new(
            difference.dot(self.right),
            difference.dot(self.up),
            difference.dot(self.forward),
        )
    }

    /// Spheres `first ..` of a block, as many as fit.
    #[inline(always)]
    pub fn project_batch(&self, block: &Block, first: usize, batch: &mut Batch) {
        batch.len = BATCH.min(block.len() - first);
        match &block.centers {
            Reals::F32(c) => self.centers(&c.as_slice()[3 * first..3 * (first + batch.len)], batch),
            Reals::F64(c) => self.centers(&c.as_slice()[3 * first..3 * (first + batch.len)], batch),
        }
        match &block.radii {
            Radii::Same(radius) => batch.r = [radius * self.scale; BATCH],
            Radii::Each(Reals::F32(r)) => {
                for (to, &from) in batch.r.iter_mut().zip(&r.as_slice()[first..first + batch.len]) {
                    *to = f64::from(from) * self.scale;
                }
            }
            Radii::Each(Reals::F64(r)) => {
                for (to, &from) in batch.r.iter_mut().zip(&r.as_slice()[first..first + batch.len]) {
                    *to = from * self.scale;
                }
            }
        }
    }

    #[inline(always)]
    fn centers<T: Copy + Into<f64>>(&self, centers: &[T], batch: &mut Batch) {
        if let Ok(centers) = <&[T; 3 * BATCH]>::try_from(centers) {
            // A length that is known lets the compiler shuffle whole vectors.
            for k in 0..BATCH {
                batch.x[k] = centers[3 * k].into();
                batch.y[k] = centers[3 * k + 1].into();
                batch.z[k] = centers[3 * k + 2].into();
            }
        } else {
            for (k, c) in centers.chunks_exact(3).take(BATCH).enumerate() {
                batch.x[k] = c[0].into();
                batch.y[k] = c[1].into();
                batch.z[k] = c[2].into();
            }
        }
        self.turn([&mut batch.x, &mut batch.y, &mut batch.z]);
    }

    /// Fills in the pixels of the region that each sphere of a batch may be seen at; conservative.
    ///
    /// Out of the clip range: none. What is NaN reaches the region's side.
    #[inline(always)]
    pub fn footprints(&self, batch: &mut Batch) {
        match self.projection {
            Projection::Orthographic => self.footprints_by::<false>(batch),
            Projection::Perspective => self.footprints_by::<true>(batch),
        }
    }

    /// First and last column, first and last row of a sphere, as fractions of pixels of the region;
    /// conservative.
    #[inline(always)]
    pub fn extent<const PERSPECTIVE: bool>(&self, s: &Projected) -> [[f64; 2]; 2] {
        let reach = s.r + REACH * s.bound();
        let sides =
            |at: f64| if PERSPECTIVE { slopes(at, s.z, reach) } else { [at - reach, at + reach] };
        let ([x, y], at) = ([sides(s.x), sides(s.y)], |value: f64, [slope, offset]: [f64; 2]| {
            value * slope + offset
        });
        [
            [at(x[0], self.column) - MARGIN, at(x[1], self.column) + MARGIN],
            [at(y[1], self.row) - MARGIN, at(y[0], self.row) + MARGIN],
        ]
    }

    #[inline(always)]
    fn footprints_by<const PERSPECTIVE: bool>(&self, batch: &mut Batch) {
        let last = [f64::from(self.region.width) - 1.0, f64::from(self.region.height) - 1.0];
        for k in 0..BATCH {
            let s = batch.sphere(k);
            let reach = s.r + s.bound();
            batch.nearest[k] = s.nearest();
            let hidden = (s.z + reach < self.near) | (s.z - reach > self.far);
            let first = |value: f64, last: f64| lesser(greater(value.ceil(), 0.0), last + 1.0);
            let until = |value: f64, last: f64| greater(lesser(value.floor(), last), -1.0);
            let [x, y] = self.extent::<PERSPECTIVE>(&s);
            let left = first(x[0], last[0]);
            let right = until(x[1], last[0]);
            let top = first(y[0], last[1]);
            let bottom = until(y[1], last[1]);
            let right = if hidden { -1.0 } else { right };
            // SAFETY: all four lie between -1 and an image side, by the bounds just taken, and are
            // never NaN.
            unsafe {
                batch.left[k] = left.to_int_unchecked();
                batch.right[k] = right.to_int_unchecked();
                batch.top[k] = top.to_int_unchecked();
                batch.bottom[k] = bottom.to_int_unchecked();
            }
        }
    }
}

/// The least and greatest slope `x / z` of rays through the eye that meet a circle of radius `r`
/// about `(x, z)`, widened by the error; infinite where the circle reaches the eye's plane.
///
/// The tangents are `(x z -+ r sqrt(x^2 + z^2 - r^2)) / (z^2 - r^2)`. Nothing cancels but their own
/// difference; each is within `11 u (|x z| + r sqrt(..)) / (z^2 - r^2)` (lemma P5).
#[inline(always)]
pub fn slopes(x: f64, z: f64, r: f64) -> [f64; 2] {
    // NaN wraps.
    let wraps = !(z - r > 0.0);
    let square = (z - r) * (z + r);
    let across = r * (x * x + square).sqrt();
    let over = 1.0 / square;
    let wide = SLOPE * ((x * z).abs() + across) * over;
    let (low, high) = ((x * z - across) * over - wide, (x * z + across) * over + wide);
    if wraps { [f64::NEG_INFINITY, f64::INFINITY] } else { [low, high] }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_are_tangent() {
        for (x, z, r) in [(0.0, 2.0, 1.0), (3.0, 2.0, 1.0), (-1e3, 5.0, 4.9), (1.0, 1e6, 1e-3)] {
            let [low, high] = slopes(x, z, r);
            for (slope, inward) in [(low, 1.0), (high, -1.0)] {
                // Distance of the centre from the line through the eye: r, or a little more for the
                // widening.
                let distance = |s: f64| (x - s * z).abs() / (1.0 + s * s).sqrt();
                assert!(
                    distance(slope) >= r
                        && distance(slope) <= r + 1e-5 * (1.0 + x.abs() + z) * (1.0 + x.abs() / z)
                );
                assert!(distance(slope + inward * 0.1 * (high - low)) < distance(slope));
            }
        }
        assert_eq!(slopes(0.0, 1.0, 1.0), [f64::NEG_INFINITY, f64::INFINITY]);
        assert_eq!(slopes(5.0, -1.0, 0.5), [f64::NEG_INFINITY, f64::INFINITY]);
    }
}
