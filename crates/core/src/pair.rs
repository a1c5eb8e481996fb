//! Two spheres that all but coincide: which is nearer, eight pixels at a time.
//!
//! Where centres and radii differ by a few units in the last place, the bounds of [`crate::filter`]
//! overlap at every pixel: they are those of each sphere's place. The difference of two such
//! spheres is known far better than either place: a difference of two f64 rounds by `u` of itself,
//! however much cancels. So the order is told from the difference:
//!
//! With `delta = c_1 - c_2`, `rho = r_1 - r_2`, `R = r_1 + r_2`, and `b`, `q`, `a` as in
//! [`crate::filter`],
//!
//! ```text
//!     y_1 - y_2 = delta.dir -+ (q_1 - q_2) / S        S = sqrt q_1 + sqrt q_2
//!     (- between near roots, + between far ones)
//!     q_1 - q_2 = a rho R - (delta x dir) . ((c_1 + c_2) x dir)
//! ```
//!
//! so that the sign is that of `F = (delta.dir) S -+ (q_1 - q_2)`, in which nothing large cancels
//! (lemma N1 of docs/numerics.md).
//!
//! **Bound.** Where both hits are solid, with `N = |delta|` and `A`, `W` and the greater `D` of
//! [`crate::filter`], `F` is within
//!
//! ```text
//!     E = 96 u A sqrt A N R + N (sqrt A (W_1 + W_2) + 3 A D) + 20 u A |rho| R
//! ```
//!
//! (lemma N2; 79, 2.83 and 15 are needed). Centres are apart by `LEAST` or not at all, so that no
//! underflow counts but that of the last products, for which `FLOOR` is added.

use glam::DVec3;

use crate::{
    exact::decide::Root,
    filter::{Margins, PLANE, Row, length},
    float::{FLOOR, U},
    project::Projector,
    projected::Projected,
    scene::Ball,
    simd::{Lanes, Number},
};

/// Spheres whose centres and radii together differ by more than this part of `R` are told apart by
/// their places.
const NEAR: f64 = 0.125;

/// Centres that are less apart than this, and not the same, are told apart by their places: below
/// it, products are subnormal.
const LEAST: f64 = f64::from_bits((1023 - 900) << 52);

/// A sphere of a pair.
#[derive(Clone, Copy, Debug)]
struct One {
    sphere: Projected,
    margins: Margins,
}

/// Two spheres that all but coincide.
#[derive(Clone, Copy, Debug)]
pub struct Pair {
    /// The first, and the second.
    both: [One; 2],
    /// The first's centre less the second's, in view space.
    delta: [f64; 3],
    /// `rho R`.
    radii: f64,
    /// `E`.
    bound: f64,
    /// A clip plane may cut one of them.
    cut: bool,
}

/// What a pair's order tells at eight pixels: a bit for each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Order {
    /// The first is nearer for certain.
    pub nearer: u8,
    /// The first is farther for certain.
    pub farther: u8,
}

/// How far two walls are apart at eight pixels.
#[derive(Clone, Copy)]
pub struct Apart<L> {
    /// `F`: the difference of their depths, times `S`.
    pub difference: L,
    /// `E`.
    pub bound: f64,
    /// Where both are solid hits, so that these hold: a bit for each.
    pub solid: u8,
}

impl Pair {
    /// Of a sphere and another; none unless they all but coincide, and differ.
    #[inline(always)]
    pub fn new<const PERSPECTIVE: bool>(
        one: Ball,
        other: Ball,
        projector: &Projector,
    ) -> Option<Self> {
        let scale = projector.scale;
        let difference = one.center - other.center;
        let delta = difference * scale;
        let (rho, sum) =
            ((one.radius - other.radius) * scale, one.radius * scale + other.radius * scale);
        // A length whose squares do not underflow, or more than it.
        let sides = delta.x.abs() + delta.y.abs() + delta.z.abs();
        let apart = if sides > 1e-100 { delta.length() } else { sides };
        // What turning and scaling makes subnormal is not known to a part of itself any more.
        if difference != DVec3::ZERO && !(sides >= LEAST) {
            return None;
        }
        if !near(&one, &other) || one == other {
            return None;
        }
        let both = [one, other].map(|ball| {
            let sphere = projector.project(ball.center, ball.radius);
            One { sphere, margins: Margins::new::<PERSPECTIVE>(&sphere, projector.screen) }
        });
        let cut = both.iter().any(|one| projector.cuts(&one.sphere));
        let spread = projector.screen.spread;
        let root = spread.sqrt();
        let position = projector.screen.kappa * both[0].sphere.bound().max(both[1].sphere.bound());
        let width = both[0].margins.width + both[1].margins.width;
        let bound = 96.0 * U * spread * root * apart * sum
            + apart * (root * width + 3.0 * spread * position)
            + 20.0 * U * spread * rho.abs() * sum
            + FLOOR;
        Some(Self { both, delta: projector.rotate(delta).to_array(), radii: rho * sum, bound, cut })
    }

    /// The order of two walls, at pixels of a row at screen coordinates `sx`, where both are
    /// certainly met. No clip plane may cut these walls.
    #[inline(always)]
    pub fn order<L: Lanes, const PERSPECTIVE: bool>(&self, wall: Root, sx: L, sy: f64) -> Order {
        let Apart { difference, bound, solid } = self.apart::<L, PERSPECTIVE>(wall, sx, sy);
        let (bound, least) = (L::splat(bound), L::splat(-bound));
        Order { nearer: solid & difference.less(least), farther: solid & bound.less(difference) }
    }

    /// `F` and its bound, at pixels of a row.
    #[inline(always)]
    pub fn apart<L: Lanes, const PERSPECTIVE: bool>(&self, wall: Root, sx: L, sy: f64) -> Apart<L> {
        let [one, other] = &self.both;
        let q = one.meet::<L, PERSPECTIVE>(sx, sy).0;
        let p = other.meet::<L, PERSPECTIVE>(sx, sy).0;
        let solid = L::splat(one.margins.solid).less(q) & L::splat(other.margins.solid).less(p);
        let zero = L::splat(0.0);
        let roots = q.max(zero).sqrt().add(p.max(zero).sqrt());
        let (along, squares) = self.differences::<L, PERSPECTIVE>(sx, sy);
        let along = along.mul(roots);
        let difference = match wall {
            Root::Near => along.sub(squares),
            Root::Far => along.add(squares),
        };
        Apart { difference, bound: self.bound, solid }
    }

    /// `delta.dir` and `q_1 - q_2`.
    #[inline(always)]
    fn differences<N: Number, const PERSPECTIVE: bool>(&self, sx: N, sy: f64) -> (N, N) {
        let [x, y, z] = self.delta;
        let [one, other] = self.both.map(|one| one.sphere);
        let (down, radii) = (N::splat(sy), N::splat(self.radii));
        if PERSPECTIVE {
            let along = sx.mul(N::splat(x)).add(N::splat(y * sy + z));
            let (n, m) = (sx.mul(N::splat(z)).sub(N::splat(x)), N::splat(y - z * sy));
            let k = n.mul(down).add(sx.mul(m));
            let [n1, m1, k1] = cross(&one, sx, sy);
            let [n2, m2, k2] = cross(&other, sx, sy);
            let crossed = n.mul(n1.add(n2)).add(m.mul(m1.add(m2))).add(k.mul(k1.add(k2)));
            (along, length(sx, sy).mul(radii).sub(crossed))
        } else {
            let across = sx.sub(N::splat(one.x)).add(sx.sub(N::splat(other.x)));
            let upward = N::splat((sy - one.y) + (sy - other.y));
            let squares = radii.add(across.mul(N::splat(x))).add(upward.mul(N::splat(y)));
            (N::splat(z), squares)
        }
    }

    /// Upper bound of the first's depth, times `|dir|^2`, where its hit is solid; and its `W`.
    #[inline(always)]
    pub fn depth<L: Lanes, const PERSPECTIVE: bool>(&self, wall: Root, sx: L, sy: f64) -> (L, f64) {
        let One { sphere, margins } = &self.both[0];
        let (q, b) =
            Row::new::<PERSPECTIVE>(sphere, sy).lifted(margins.width).meet::<L, PERSPECTIVE>(sx);
        let root = q.max(L::splat(0.0)).sqrt();
        let depth = match wall {
            Root::Near => b.sub(root),
            Root::Far => b.add(root),
        };
        (depth, margins.width)
    }

    /// Where the near walls of both are seen for certain, and where both far ones are, as far as
    /// clip planes go: a bit for each pixel.
    #[inline(always)]
    pub fn walls<L: Lanes, const PERSPECTIVE: bool>(
        &self,
        projector: &Projector,
        sx: L,
        sy: f64,
    ) -> [u8; 2] {
        if !self.cut {
            return [u8::MAX, 0];
        }
        let a = if PERSPECTIVE { length(sx, sy) } else { L::splat(1.0) };
        // The planes in the units of the depths, with the bounds of their own roundings.
        let near = a.mul(L::splat(projector.near));
        let near = [near.mul(L::splat(1.0 - PLANE)), near.mul(L::splat(1.0 + PLANE))];
        let far = if projector.far == f64::INFINITY {
            L::splat(f64::INFINITY)
        } else {
            a.mul(L::splat(projector.far)).mul(L::splat(1.0 - PLANE))
        };
        let [near_one, far_one] = self.both[0].seen::<L, PERSPECTIVE>(sx, sy, near, far);
        let [near_other, far_other] = self.both[1].seen::<L, PERSPECTIVE>(sx, sy, near, far);
        [near_one & near_other, far_one & far_other]
    }
}

impl One {
    /// `q` and `b`.
    #[inline(always)]
    fn meet<L: Lanes, const PERSPECTIVE: bool>(&self, sx: L, sy: f64) -> (L, L) {
        Row::new::<PERSPECTIVE>(&self.sphere, sy).meet::<L, PERSPECTIVE>(sx)
    }

    /// Where the near wall is in the clip range for certain, and where the far one is and the near
    /// one is not.
    #[inline(always)]
    fn seen<L: Lanes, const PERSPECTIVE: bool>(
        &self,
        sx: L,
        sy: f64,
        near: [L; 2],
        far: L,
    ) -> [u8; 2] {
        let (q, b) = self.meet::<L, PERSPECTIVE>(sx, sy);
        let (root, width) = (q.max(L::splat(0.0)).sqrt(), L::splat(self.margins.width));
        let (first, second) = (b.sub(root), b.add(root));
        let first_inside = near[1].less(first.sub(width)) & first.add(width).less(far);
        let second_inside = near[1].less(second.sub(width)) & second.add(width).less(far);
        [first_inside, first.add(width).less(near[0]) & second_inside]
    }
}

/// `c x dir` of a sphere's centre: `n`, `m` and `k`.
#[inline(always)]
fn cross<N: Number>(s: &Projected, sx: N, sy: f64) -> [N; 3] {
    let (n, m) = (sx.mul(N::splat(s.z)).sub(N::splat(s.x)), N::splat(s.y - s.z * sy));
    [n, m, n.mul(N::splat(sy)).add(sx.mul(m))]
}

/// Whether two balls all but coincide, for the purposes here.
#[inline(always)]
pub fn near(one: &Ball, other: &Ball) -> bool {
    let delta = one.center - other.center;
    let apart = delta.x.abs() + delta.y.abs() + delta.z.abs();
    // What is NaN or infinite is not near.
    apart + (one.radius - other.radius).abs() <= NEAR * (one.radius + other.radius)
}

/// Whether a ball certainly lies inside another, strictly: the other then hides it wherever no clip
/// plane cuts the other.
///
/// `|delta| < r_2 - r_1`, squared: within `10 u` and what underflows (lemma N3).
#[inline(always)]
pub fn inside(inner: &Ball, outer: &Ball) -> bool {
    let (delta, rho) = (inner.center - outer.center, outer.radius - inner.radius);
    rho > 0.0
        && (delta == DVec3::ZERO || delta.length_squared() * (1.0 + 16.0 * U) + FLOOR < rho * rho)
}
