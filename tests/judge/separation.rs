//! How near to zero a number of the image contract can be without being zero.
//!
//! Every quantity that the judge asks the sign of is built from whole numbers by `+ - *`, a known
//! division and square roots. Multiplied by a known positive whole number `S` it is an algebraic
//! integer: a root of a polynomial with whole coefficients that begins with 1. The product of such
//! a number and its conjugates (the other roots of its minimal polynomial) is a whole number, and
//! not 0 unless the number is 0. The conjugates are found among the values that the same formula
//! takes when the signs of its roots are changed: flipped camera axes and the other root of a
//! sphere. So all of them stay below a bound `H` that does not look at signs, and with `n` such
//! values in all
//!
//! ```text
//!     |E| is 0, or at least 1 / (S max(1, S H)^(n - 1))
//! ```
//!
//! An interval around `E` that is narrower than this and holds 0 proves that `E` is 0. All sizes
//! here are exponents of two, rounded up.

use dashu_int::IBig;

use super::interval::{magnitude_bits, perfect_root, split};

/// Least `k` with `|value| <= 2^k`; very small for 0.
pub fn exponent(value: f64) -> i64 {
    match split(value) {
        (0, _) => -2000,
        (mantissa, exponent) => {
            64 - i64::from(mantissa.unsigned_abs().leading_zeros()) + i64::from(exponent)
        }
    }
}

/// Binary places that the number needs.
pub fn places(value: f64) -> i64 {
    i64::from(-split(value).1).max(0)
}

/// What the camera adds to every bound.
#[derive(Clone, Debug)]
pub struct Setting {
    /// Whether rays leave one point.
    pub perspective: bool,
    /// How many values the camera's roots `sqrt A` and `sqrt B` can take together: 1, 2 or 4.
    pub degree: i64,
    /// Denominator of the axes.
    axes: i64,
    /// Denominator of the sample points: the whole number, and the binary places.
    screen: (i64, i64),
    /// Bound on the coordinates of sample points.
    reach: i64,
    /// Binary places of the origin and the clip planes, and bounds on them.
    origin_places: i64,
    origin: i64,
    planes: i64,
}

/// A quantity with its denominator and a bound on its conjugates.
#[derive(Clone, Copy, Debug)]
pub struct Size {
    /// `S = 2^denominator` or less.
    pub denominator: i64,
    /// `H = 2^bound` or less.
    pub bound: i64,
}

impl Size {
    /// `k` such that the quantity is 0, or at least `2^-k`, when `values` signs of roots have to be
    /// thought of.
    pub fn separation(self, values: i64) -> i64 {
        self.denominator + (values - 1) * (self.denominator + self.bound).max(0)
    }

    /// Of whole multiples, and sums of them, that are up to `2^more` times as large.
    pub fn larger(self, more: i64) -> Self {
        Self { bound: self.bound + more, ..self }
    }
}

/// The numbers of one sphere that matter: binary places of centre and radius, and bounds on both.
#[derive(Clone, Copy, Debug)]
pub struct Body {
    places: i64,
    center: i64,
    radius: i64,
}

impl Body {
    /// From centre and radius.
    pub fn new(center: [f64; 3], radius: f64) -> Self {
        Self {
            places: center.iter().map(|&x| places(x)).max().unwrap_or(0).max(places(radius)),
            center: center.iter().map(|&x| exponent(x)).max().unwrap_or(-2000),
            radius: exponent(radius),
        }
    }
}

/// Everything the setting is made from: `square_view` is `A = |d|^2`, `square_side` is `B = |d x
/// up|^2`, for whole `d` and `up`.
pub struct Given<'a> {
    /// Whether rays leave one point.
    pub perspective: bool,
    /// `A`.
    pub square_view: &'a IBig,
    /// `B`.
    pub square_side: &'a IBig,
    /// Camera position.
    pub origin: [f64; 3],
    /// Clip planes, infinity left out, and other lengths that distances are compared with.
    pub planes: &'a [f64],
    /// Length, divisor and number of pixels, across and down.
    pub sides: [(f64, u32, u32); 2],
}

impl Setting {
    /// Gathers the bounds of a camera.
    pub fn new(given: &Given) -> Self {
        let (root_a, root_b) = (perfect_root(given.square_view), perfect_root(given.square_side));
        let both = perfect_root(&(given.square_view * given.square_side));
        let degree = match (&root_a, &root_b, &both) {
            (Some(_), Some(_), _) => 1,
            (Some(_), None, _) | (None, Some(_), _) | (None, None, Some(_)) => 2,
            (None, None, None) => 4,
        };
        // forward = d / sqrt A = d sqrt A / A, right = g sqrt B / B, up = h sqrt A sqrt B / (A B),
        // with whole d, g, h.
        let denominator = |square: &IBig, root: &Option<IBig>| {
            magnitude_bits(root.as_ref().unwrap_or(square)) as i64
        };
        let bits = |n: u32| i64::from(32 - n.leading_zeros());
        let [(across, across_divisor, columns), (down, down_divisor, rows)] = given.sides;
        let whole = bits(across_divisor)
            + 1
            + if across_divisor == down_divisor { 0 } else { bits(down_divisor) + 1 };
        let reach = |length: f64, divisor: u32, pixels: u32| {
            exponent(length) + bits(pixels) - bits(divisor) + 1
        };
        Self {
            perspective: given.perspective,
            degree,
            axes: denominator(given.square_view, &root_a) + denominator(given.square_side, &root_b),
            screen: (whole, places(across).max(places(down))),
            // Both coordinates together are at most twice the larger, so `reach + 1` bounds their
            // sum.
            reach: reach(across, across_divisor, columns).max(reach(down, down_divisor, rows)) + 1,
            origin_places: given
                .origin
                .iter()
                .chain(given.planes)
                .map(|&x| places(x))
                .max()
                .unwrap_or(0),
            origin: given.origin.iter().map(|&x| exponent(x)).max().unwrap_or(-2000),
            planes: given.planes.iter().map(|&x| exponent(x)).max().unwrap_or(-2000),
        }
    }

    /// Size of a depth times the square of the ray's direction, of these spheres or of a clip
    /// plane.
    pub fn depth(&self, bodies: &[Body]) -> Size {
        let world_places = bodies.iter().map(|b| b.places).fold(self.origin_places, i64::max);
        let (whole, screen_places) = self.screen;
        // |m|, the centre from the camera: six terms, at most 8 times the largest.
        let away = bodies.iter().map(|b| b.center).fold(self.origin, i64::max) + 3;
        let radius = bodies.iter().map(|b| b.radius).max().unwrap_or(-2000);
        let (denominator, one) = if self.perspective {
            // b = s X + ..., a near = (1 + s^2) near: two factors of the screen, one of the world.
            // |dir| <= 1 + |sx| + |sy| <= 2^(max(reach, 0) + 1); |b| + sqrt q <= |dir| (2 |m| + r).
            let direction = self.reach.max(0) + 1;
            let depth = direction + away.max(radius) + 2;
            (
                self.axes + world_places + 2 * (whole + screen_places),
                depth.max(self.planes + 2 * direction),
            )
        } else {
            // |Z| + sqrt q <= 2 |m| + r + |s|.
            (
                self.axes + whole + world_places.max(screen_places),
                (away.max(radius).max(self.reach) + 2).max(self.planes),
            )
        };
        // The sum of two.
        Size { denominator, bound: one + 1 }
    }

    /// Size of the square of half the chord, times the fourth power of the direction: what tells
    /// hit from miss.
    pub fn chord(&self, body: Body) -> Size {
        let depth = self.depth(&[body]);
        // q is an algebraic integer over S^2, and so below the square of the bound on depths, signs
        // apart.
        Size { denominator: 2 * depth.denominator, bound: 2 * depth.bound }
    }

    /// Size of the difference of two distances along different rays, and one more length, times
    /// the squares of both rays' directions.
    pub fn gap(&self, bodies: &[Body]) -> Size {
        let Size { denominator, bound } = self.depth(bodies);
        if !self.perspective {
            // The sum of three where it was that of two.
            return Size { denominator, bound: bound + 1 };
        }
        // A distance times one square is what `depth` bounds, and times the other square below. A
        // length that is a radius comes with both squares.
        let (whole, screen_places) = self.screen;
        let square = 2 * (self.reach.max(0) + 1);
        let radius = bodies.iter().map(|b| b.radius).max().unwrap_or(-2000);
        Size {
            denominator: denominator + 2 * (whole + screen_places),
            bound: bound.max(radius + square) + square + 2,
        }
    }
}
