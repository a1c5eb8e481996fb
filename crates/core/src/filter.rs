//! One ray against one sphere in f64, with bounds: the second half of the filter, after
//! [`crate::project`].
//!
//! The devices' loops and the tests of the bounds share these expressions, so that what is measured
//! is what runs.
//!
//! For a centre `C` in view space and a ray of direction `dir`, whose depth is 1: `a = |dir|^2`,
//! `b = C . dir`, and the discriminant `q = a r^2 - |dir x C|^2`. The walls lie at the depths `t`
//! with `y = t a = b -+ sqrt q`. Depths are compared as `y`, which spares a division. Parallel
//! rays: `a = 1`, `q = r^2 - dx^2 - dy^2`, `b = z`. Perspective: `dir = (sx, sy, 1)`, and `dir x C`
//! has, but for signs, the components `n = z sx - x`, `m = y - z sy` and `k = n sy + m sx`.
//!
//! **Bounds**, derived in docs/numerics.md and measured by tests/bounds.rs. With `u = 2^-53`, `P`
//! the position bound of [`crate::projected`], `K = 1 + max |s|` and `A = max a` over the screen
//! (both 1 for parallel rays), and `D = K P`:
//!
//! * `q` is within `E = 2.9 A r D` (lemmas F1, F2), and `q < -E` is a certain miss (F3).
//! * A sphere is *vague* if `1024 A D > r`. Then `E` is infinite: it is neither missed nor hit for
//!   certain anywhere (F4).
//! * A hit is *solid* if `q >= T`, and then it is certain. `T = max(4 E, 2^-16 r^2)`; where that
//!   leaves a hit open, `T = 4 E` (F5).
//! * The depths of a solid hit are within `W = 0.58 E / sqrt T` (parallel rays) or
//!   `W = 0.62 E / sqrt T`, the rounding of an end of the interval included (F5).
//! * A hit that is not solid is no nearer than `b - 1.14 sqrt T`, that of a vague sphere no nearer
//!   than `b - sqrt A r - 2.2 D` (F6).
//! * A clip plane's depth times `a` is within `10 u` of itself, and so is `y / a` (F7, F8).

use crate::{
    float::{FLOOR, U},
    projected::Projected,
    simd::{Beside, Number},
};

/// `E` over `A r D`; lemmas F1 and F2 need 2.887.
const DOUBT: f64 = 2.9;
/// A sphere is vague if `A D` times this is above its radius (lemma F4).
const VAGUE: f64 = 1024.0;
/// `T` over `E`, at least (lemma F5).
const SOLID: f64 = 4.0;
/// `W` over `E / sqrt T`; lemma F5 needs 0.573.
const WIDTH_PARALLEL: f64 = 0.58;
/// The same for perspective rays; lemma F5 needs 0.617.
const WIDTH_PERSPECTIVE: f64 = 0.62;
/// The radius over `sqrt T`, unless `T` is `4 E`.
const EDGE: f64 = 256.0;
/// How far before `b` a hit that is not solid may be, over `sqrt T`; lemma F6 needs 1.139.
const RIM: f64 = 1.14;
/// Bound of `b` over `D`, roundings of depths included (lemma F5).
const MIDDLE: f64 = 2.2;
/// Relative bound of a clip plane's depth in the units of `y`; lemma F7 needs 9 u.
pub const PLANE: f64 = 10.0 * U;
/// Relative bound of `y / a`; lemma F8 needs 9 u.
pub const BACK: f64 = 10.0 * U;

/// What the filter knows of the screen.
#[derive(Clone, Copy, Debug)]
pub struct Screen {
    /// `K`.
    pub kappa: f64,
    /// `A`.
    pub spread: f64,
    /// `D` of the sphere that lies farthest, if it had the greatest radius.
    pub delta: f64,
    /// Spheres of at least this radius have `T = 2^-16 r^2`, even with that `D`.
    pub plain: f64,
    /// Their `E`, over the radius.
    pub doubt: f64,
    /// Their `W`.
    pub width: f64,
}

impl Screen {
    /// For spheres whose position bound is at most `position`; of the screen coordinates at its
    /// sides, for perspective rays.
    pub fn new(sides: Option<[[f64; 2]; 2]>, position: f64) -> Self {
        let (kappa, spread) = sides.map_or((1.0, 1.0), |sides| {
            let [x, y] = sides.map(|[first, last]| first.abs().max(last.abs()));
            (1.0 + x.max(y), 1.0 + x * x + y * y)
        });
        let delta = kappa * position;
        let plain = (EDGE * EDGE * SOLID * DOUBT * (1.0 + 1e-6)) * (spread * delta);
        // Where squares come near to what underflows, or overflow, every sphere is looked at by
        // itself.
        let usable = plain > 1e-100 && plain < 1e100 && spread < 1e40;
        let per_quotient = if sides.is_some() { WIDTH_PERSPECTIVE } else { WIDTH_PARALLEL };
        let doubt = (DOUBT * (1.0 + 1e-6)) * (spread * delta);
        Self {
            kappa,
            spread,
            delta,
            plain: if usable { plain } else { f64::INFINITY },
            doubt,
            width: if usable { EDGE * per_quotient * doubt } else { 0.0 },
        }
    }

    /// Whether depths tell what is hidden: where screens are so wide that `|dir|^2` overflows,
    /// there are none to go by.
    pub fn has_depths(&self) -> bool {
        self.kappa < 1e70
    }
}

/// A sphere's bounds on a screen; see the file's head.
#[derive(Clone, Copy, Debug)]
pub struct Margins {
    /// `E`.
    pub doubt: f64,
    /// `T`.
    pub solid: f64,
    /// `W`.
    pub width: f64,
    /// A hit that is not solid begins no nearer than `b` less this.
    pub rim: f64,
}

impl Margins {
    /// Of a sphere whose radius is at least [`Screen::plain`]: the bounds of the farthest are good
    /// enough, and cost a few products.
    #[inline(always)]
    pub fn shared(radius: f64, screen: &Screen) -> Self {
        let Screen { doubt, width, .. } = *screen;
        Self {
            doubt: doubt * radius,
            solid: radius * radius * (1.0 / (EDGE * EDGE)),
            width,
            rim: (RIM / EDGE) * radius,
        }
    }

    /// Of a sphere.
    #[inline(always)]
    pub fn new<const PERSPECTIVE: bool>(s: &Projected, screen: Screen) -> Self {
        if s.r >= screen.plain {
            return Self::shared(s.r, &screen);
        }
        Self::own::<PERSPECTIVE>(s, &screen, s.r * s.r * (1.0 / (EDGE * EDGE)))
    }

    /// Of a sphere whose hits are solid as near to its silhouette as may be: then depths are not
    /// told as well.
    #[inline(always)]
    pub fn sharp<const PERSPECTIVE: bool>(s: &Projected, screen: &Screen) -> Self {
        Self::own::<PERSPECTIVE>(s, screen, 0.0)
    }

    /// Of a sphere, with `T` at least as given.
    #[inline(always)]
    fn own<const PERSPECTIVE: bool>(
        s: &Projected,
        &Screen { kappa, spread, .. }: &Screen,
        least: f64,
    ) -> Self {
        let per_quotient = if PERSPECTIVE { WIDTH_PERSPECTIVE } else { WIDTH_PARALLEL };
        let delta = kappa * s.bound();
        // NaN is vague.
        if !(VAGUE * spread * delta <= s.r) {
            let rim = spread.sqrt() * s.r + MIDDLE * delta;
            return Self { doubt: f64::INFINITY, solid: f64::INFINITY, width: f64::INFINITY, rim };
        }
        let doubt = spread * (DOUBT * s.r * delta + FLOOR);
        let solid = if SOLID * doubt > least { SOLID * doubt } else { least };
        let edge = solid.sqrt();
        let width = per_quotient * doubt / edge;
        let rim = RIM * edge;
        Self { doubt, solid, width, rim }
    }
}

/// What one look at a sphere that planes may cut tells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Look {
    /// It is missed, cut away, or behind what is held.
    Gone,
    /// It is seen, at a depth `y` between these.
    Seen([f64; 2]),
    /// Undecided.
    Doubt,
}

/// `a` of the ray through a point of the screen.
#[inline(always)]
pub fn length<N: Number>(sx: N, sy: f64) -> N {
    N::splat(1.0 + sy * sy).add(sx.mul(sx))
}

/// A sphere, or one in each place of a vector, and a row of pixels: what does not change along it.
#[derive(Clone, Copy)]
pub struct Row<S = f64> {
    x: S,
    z: S,
    square: S,
    sy: f64,
    /// `m`.
    m: S,
    /// Of `b`.
    along: S,
    /// Of `q`.
    fixed: S,
}

impl<S: Number> Row<S> {
    /// Of a sphere's coordinates and radius, and screen coordinate `sy`.
    #[inline(always)]
    pub fn of<const PERSPECTIVE: bool>([x, y, z, r]: [S; 4], sy: f64) -> Self {
        let (square, at) = (r.mul(r), S::splat(sy));
        let (m, along) =
            if PERSPECTIVE { (y.sub(z.mul(at)), y.mul(at).add(z)) } else { (at.sub(y), z) };
        let fixed = if PERSPECTIVE { m.mul(m) } else { square.sub(m.mul(m)) };
        Self { x, z, square, sy, m, along, fixed }
    }

    /// `q` and `b` at screen coordinates `sx`.
    #[inline(always)]
    pub fn meet<N: Number, const PERSPECTIVE: bool>(&self, sx: N) -> (N, N)
    where
        S: Beside<N>,
    {
        let (x, fixed, along) = (self.x.beside(), self.fixed.beside(), self.along.beside());
        if PERSPECTIVE {
            let n = self.z.beside().mul(sx).sub(x);
            let cross = n.mul(N::splat(self.sy)).add(self.m.beside().mul(sx));
            let apart = fixed.add(n.mul(n)).add(cross.mul(cross));
            let q = length(sx, self.sy).mul(self.square.beside()).sub(apart);
            (q, x.mul(sx).add(along))
        } else {
            let dx = sx.sub(x);
            (fixed.sub(dx.mul(dx)), along)
        }
    }
}

impl Row {
    /// Of screen coordinate `sy`.
    #[inline(always)]
    pub fn new<const PERSPECTIVE: bool>(s: &Projected, sy: f64) -> Self {
        Self::of::<PERSPECTIVE>([s.x, s.y, s.z, s.r], sy)
    }

    /// The same with `by` added to `b`: where that is `W`, `b - sqrt q` is the upper end of the
    /// depth's interval, with no more roundings than if it were added last.
    #[inline(always)]
    pub fn lifted(self, by: f64) -> Self {
        Self { along: self.along + by, ..self }
    }

    /// Either root of one pixel, between the planes `near` and `far`; `held` is an upper bound of
    /// the depth that is held there.
    #[inline(always)]
    pub fn look<const PERSPECTIVE: bool>(
        &self,
        margins: &Margins,
        [near, far]: [f64; 2],
        held: f64,
        sx: f64,
    ) -> Look {
        let Margins { doubt, solid, width, rim } = *margins;
        let (q, b) = self.meet::<f64, PERSPECTIVE>(sx);
        let root = q.max(0.0).sqrt();
        if q < -doubt || b - rim.max(root + width) > held {
            return Look::Gone;
        }
        // The planes in the units of the depths, with the bounds of their own roundings.
        let a = if PERSPECTIVE { length(sx, self.sy) } else { 1.0 };
        let [near, far] = [near, far].map(|plane| {
            let plane = plane * a;
            if plane == f64::INFINITY {
                [plane; 2]
            } else {
                [plane * (1.0 - PLANE), plane * (1.0 + PLANE)]
            }
        });
        let inside = |depth: f64| depth - width >= near[1] && depth + width <= far[0];
        let outside = |depth: f64| depth + width < near[0] || depth - width > far[1];
        let (first, second) = (b - root, b + root);
        let depth = if q < solid {
            return Look::Doubt;
        } else if inside(first) {
            first
        } else if first - width > far[1] || (outside(first) && outside(second)) {
            return Look::Gone;
        } else if first + width < near[0] && inside(second) {
            second
        } else {
            return Look::Doubt;
        };
        if depth - width > held { Look::Gone } else { Look::Seen([depth - width, depth + width]) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn compare<const PERSPECTIVE: bool>(sides: Option<[[f64; 2]; 2]>) {
        let mut short = 0;
        for k in 0..400 {
            let far = 1.5f64.powi(k / 10 - 20);
            let s = Projected { x: 0.3 * far, y: -0.1 * far, z: far, r: 1.7f64.powi(k % 60 - 50) };
            let screen = Screen::new(sides, s.bound());
            let own = Margins::new::<PERSPECTIVE>(&s, Screen { plain: f64::INFINITY, ..screen });
            let shared = Margins::new::<PERSPECTIVE>(&s, screen);
            assert!(screen.plain < f64::INFINITY);
            if s.r < screen.plain {
                assert_eq!(shared.doubt, own.doubt);
                continue;
            }
            short += 1;
            assert_eq!(shared.solid, own.solid);
            let pairs = [
                (shared.doubt, own.doubt),
                (shared.width, own.width),
                (shared.rim * (1.0 + 1e-14), own.rim),
            ];
            for (shared, own) in pairs {
                assert!(shared >= own && shared <= own * (1.0 + 1e-5), "{s:?}: {shared} {own}");
            }
        }
        assert!(short > 50, "{short}");
    }

    /// The bounds that most spheres share are at least their own, and hardly more for the farthest.
    #[test]
    fn shared_bounds_are_those_of_the_farthest() {
        compare::<false>(None);
        compare::<true>(Some([[-0.4, 0.4], [-0.3, 0.3]]));
        compare::<true>(Some([[-30.0, 20.0], [-3.0, 3.0]]));
    }
}
