//! Hits and their order at one pixel, decided by the cheapest arithmetic that can tell.
//!
//! With the camera's integer vectors `d`, `e`, `g` and `A = |d|^2`, `B = |e|^2` ([`crate::axes`]),
//! a sphere's centre relative to the camera `f = c - o`, and a sample point `(sx, sy)`, the depths
//! of the two roots are `t = y / scale` with
//!
//! ```text
//!     y = beta -+ sqrt q
//!     orthographic: beta = (f.d) sqrt B                              scale = sqrt(A B)
//!                   q = A B (r^2 - sx^2 - sy^2 - |f|^2) + B (f.d)^2
//!                       + 2 sx (f.e) A sqrt B + 2 sy (f.g) sqrt(A B)
//!     perspective:  beta = (f.d) sqrt B + sx (f.e) sqrt A + sy (f.g)
//!                   scale = sqrt(A B) (1 + sx^2 + sy^2)
//!                   q = beta^2 - A B (1 + sx^2 + sy^2) (|f|^2 - r^2)
//! ```
//!
//! which follows from `|p + t dir - c|^2 = r^2` with the axes `e / sqrt B`, `g / sqrt(A B)`, `d /
//! sqrt A`. All spheres of one pixel share the scale, so depths compare as `beta_1 -+ sqrt q_1`
//! with `beta_2 -+ sqrt q_2`: a sign of `x + s sqrt q - t sqrt p` ([`super::field`]). Lengths
//! become integers by one power of two and the pixel counts.
//!
//! Three arithmetics are tried in turn: 128-bit integers where the numbers are short
//! ([`super::small`]), and the axes rational or the spheres symmetrical, as on lattices, where true
//! ties are common; 100 bits with a bound ([`super::dd`]); integers of any size.

use std::{cell::OnceCell, cmp::Ordering};

use dashu_int::{
    IBig, UBig,
    ops::{Abs, SquareRoot},
};

use super::{
    dd::Bounded,
    distance::{DISTANCE_ERROR, Distance},
    field::{Element, Field, sign_of},
    small,
};
use crate::{
    axes::{Axes, Axis, dot, integer, least_exponent},
    camera::{Pitch, Projection, View},
    ids::SphereIndex,
    scene::{Ball, Bounds},
};

/// Which of a ray's two meetings with a sphere is seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Root {
    /// The nearer: the outer wall.
    Near,
    /// The farther: the inner wall, where the nearer is out of the clip range.
    Far,
}

impl Root {
    /// The sign before the square root.
    pub(super) fn sign(self) -> i32 {
        match self {
            Self::Near => -1,
            Self::Far => 1,
        }
    }
}

/// How often each arithmetic was needed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Signs asked for.
    pub signs: u64,
    /// Of these, told by 128-bit integers.
    pub small: u64,
    /// Of these, told by integers of any size.
    pub big: u64,
}

impl std::ops::AddAssign for Tally {
    fn add_assign(&mut self, other: Self) {
        self.signs += other.signs;
        self.small += other.small;
        self.big += other.big;
    }
}

/// A sphere's hit at a pixel.
#[derive(Clone, Debug)]
pub struct Hit {
    ball: Ball,
    root: Root,
    /// `t` times a positive factor that all hits of the pixel share, to 100 bits, once it is
    /// needed.
    y: OnceCell<Bounded>,
}

impl Hit {
    /// A hit that is known for certain: at this root, inside the clip range.
    pub fn known(ball: Ball, root: Root) -> Self {
        Self { ball, root, y: OnceCell::new() }
    }

    /// Which wall is seen.
    pub fn root(&self) -> Root {
        self.root
    }

    /// Of which sphere.
    pub(super) fn ball(&self) -> Ball {
        self.ball
    }
}

/// Everything about a view that decisions need.
pub struct Truth {
    view: View,
    bounds: Bounds,
    axes: Axes,
    field: Field,
    /// The view in 128-bit integers, if its projection is orthographic and its numbers are short.
    small: Option<small::Frame>,
    /// Lengths are multiplied by this power of two before the 100-bit arithmetic.
    scale: f64,
    /// Added to differences if the scaling may underflow.
    slack: f64,
    /// Divisors of the two pitches in terms of their least common multiple: lcm, lcm / x, lcm / y.
    lcm: [u64; 3],
}

fn gcd(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { gcd(b, a % b) }
}

impl Truth {
    /// For a view of spheres inside `bounds`.
    pub fn new(view: &View, bounds: Bounds) -> Self {
        let axes = Axes::new(view.camera.view, view.camera.up);
        let field = Field::new(&axes.a, &axes.b);
        let extent = [bounds.min_center, bounds.max_center, view.camera.origin]
            .map(|v| v.abs().max_element());
        let mut largest =
            extent.into_iter().fold(bounds.max_radius, f64::max).max(view.camera.near);
        if view.camera.projection == Projection::Orthographic {
            largest = largest.max(view.pitch_x.length).max(view.pitch_y.length);
        }
        let exponent = (largest.max(f64::MIN_POSITIVE).to_bits() >> 52) as i32 - 1023;
        let (scale, slack) = match exponent {
            -300..=300 => (1.0, 0.0),
            // 2^-1020 to 2^1020: enough, as exponents run from -1022 to 1023.
            _ => (
                crate::axes::scaled(1.0, -exponent.clamp(-1020, 1020)),
                crate::axes::scaled(1.0, -1070),
            ),
        };
        let (x, y) = (u64::from(view.pitch_x.divisor), u64::from(view.pitch_y.divisor));
        let lcm = x / gcd(x, y) * y;
        let lcm = [lcm, lcm / x, lcm / y];
        let small = match view.camera.projection {
            Projection::Orthographic => {
                small::Frame::new(&axes, field.roots(), view, lcm, exponent)
            }
            Projection::Perspective => None,
        };
        Self { view: *view, bounds, axes, field, small, scale, slack, lcm }
    }

    /// The view.
    pub fn view(&self) -> &View {
        &self.view
    }

    /// The spheres' extent.
    pub fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// The camera's axes.
    pub fn axes(&self) -> &Axes {
        &self.axes
    }

    /// The numbers that decisions are made in.
    pub(super) fn field(&self) -> &Field {
        &self.field
    }

    /// A world length in view lengths.
    pub(super) fn scaled(&self, length: f64) -> Bounded {
        Bounded::exact(length * self.scale).widened(self.slack)
    }

    /// World lengths times this power of two are the lengths of view space; 1 unless the scene is
    /// extreme.
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// Which power of two [`Self::scale`] is.
    fn scale_exponent(&self) -> i64 {
        (self.scale.to_bits() >> 52) as i64 - 1023
    }

    /// The decisions of one pixel.
    pub fn pixel(&self, column: u32, row: u32) -> Pixel<'_> {
        let odd = [self.view.odd_x(column), self.view.odd_y(row)];
        Pixel { truth: self, odd, sample: OnceCell::new() }
    }

    fn sample(&self, odd: [i32; 2]) -> Sample {
        let coordinate = |odd: i32, pitch: Pitch| {
            let length = match self.view.camera.projection {
                Projection::Orthographic => pitch.length * self.scale,
                Projection::Perspective => pitch.length,
            };
            Bounded::ratio(f64::from(odd), length, 2.0 * f64::from(pitch.divisor))
        };
        let s = [coordinate(odd[0], self.view.pitch_x), coordinate(odd[1], self.view.pitch_y)];
        let a = match self.view.camera.projection {
            Projection::Orthographic => Bounded::exact(1.0),
            Projection::Perspective => Bounded::exact(1.0) + s[0].square() + s[1].square(),
        };
        Sample { s, a }
    }
}

/// One pixel of a view.
pub struct Pixel<'a> {
    truth: &'a Truth,
    /// The sample point is `odd * pitch / 2`.
    odd: [i32; 2],
    /// The same to 100 bits, once it is needed.
    sample: OnceCell<Sample>,
}

/// A sample point on the screen.
#[derive(Clone, Copy)]
struct Sample {
    /// Its coordinates.
    s: [Bounded; 2],
    /// `|dir|^2`.
    a: Bounded,
}

/// What the clip planes cut: the sign of `t - plane` for one root.
#[derive(Clone, Copy)]
enum Plane {
    Near,
    Far,
}

impl Pixel<'_> {
    /// The hit of a sphere, if it has one inside the clip range.
    pub fn hit(&self, ball: Ball, tally: &mut Tally) -> Option<Hit> {
        let numbers = Numbers::new(self, ball);
        let sign_q = tally.ask(
            || Some(numbers.small()?.q?.signum() as i32),
            || numbers.bounded().1.sign(),
            || self.truth.field.sign(&numbers.big().q),
        );
        if sign_q < 0 {
            return None;
        }
        let root = if self.side(&numbers, Root::Near, Plane::Near, tally) >= 0 {
            Root::Near
        } else if self.side(&numbers, Root::Far, Plane::Near, tally) >= 0 {
            Root::Far
        } else {
            return None;
        };
        (self.side(&numbers, root, Plane::Far, tally) <= 0).then(|| Hit::known(ball, root))
    }

    /// The order of two hits along the ray.
    pub fn order(&self, one: &Hit, other: &Hit, tally: &mut Tally) -> Ordering {
        if one.ball == other.ball && one.root == other.root {
            return Ordering::Equal;
        }
        let (s, t) = (one.root.sign(), other.root.sign());
        let sign = tally.ask(
            || {
                let frame = self.truth.small.as_ref()?;
                let same_radius = one.ball.radius == other.ball.radius;
                if same_radius && s == t && frame.symmetrical(self.odd, one.ball, other.ball)? {
                    return Some(0);
                }
                let (one, other) =
                    (frame.site(self.odd, one.ball)?, frame.site(self.odd, other.ball)?);
                small::order(&one, s, &other, t, same_radius)
            },
            || (self.y(one) - self.y(other)).sign(),
            || {
                let exponent = self.truth.exponent([one.ball, other.ball]);
                let one = self.truth.site(self.odd, one.ball, exponent);
                let other = self.truth.site(self.odd, other.ball, exponent);
                self.truth.field.sign_with_roots(
                    &one.beta.minus(&other.beta),
                    s,
                    &one.q,
                    t,
                    &other.q,
                )
            },
        );
        sign.cmp(&0)
    }

    /// Bounds of `t |dir|^2` of a hit in view lengths, where `dir` has depth 1 (`|dir| = 1` for
    /// parallel rays).
    pub fn interval(&self, hit: &Hit) -> [f64; 2] {
        self.y(hit).bounds()
    }

    /// What the pixel is of.
    pub(super) fn truth(&self) -> &Truth {
        self.truth
    }

    /// `|dir|^2`.
    pub(super) fn sample_length(&self) -> Bounded {
        self.sample().a
    }

    /// A sphere in exact numbers, of lengths in units of two to some exponent.
    pub(super) fn site(&self, ball: Ball, exponent: i32) -> Site {
        self.truth.site(self.odd, ball, exponent)
    }

    pub(super) fn y(&self, hit: &Hit) -> Bounded {
        *hit.y.get_or_init(|| {
            let (beta, q) = self.bounded(hit.ball);
            // The hit is there: where q is not certain, it is not negative.
            match hit.root {
                Root::Near => beta - q.sqrt(),
                Root::Far => beta + q.sqrt(),
            }
        })
    }

    fn sample(&self) -> &Sample {
        self.sample.get_or_init(|| self.truth.sample(self.odd))
    }

    /// The nearest of some spheres, by index; at equal depth the lowest index.
    pub fn nearest(
        &self,
        balls: impl IntoIterator<Item = (SphereIndex, Ball)>,
        tally: &mut Tally,
    ) -> Option<SphereIndex> {
        let mut best: Option<(SphereIndex, Hit)> = None;
        for (index, ball) in balls {
            let Some(hit) = self.hit(ball, tally) else { continue };
            let wins = match &best {
                None => true,
                Some((holder, held)) => match self.order(&hit, held, tally) {
                    Ordering::Less => true,
                    Ordering::Equal => index < *holder,
                    Ordering::Greater => false,
                },
            };
            if wins {
                best = Some((index, hit));
            }
        }
        best.map(|(index, _)| index)
    }

    /// The distance `t` of a hit, within [`DISTANCE_ERROR`] as a part of it, or as f64 are where
    /// that is subnormal; exactly 0 where it is 0, infinite where no f64 is as large.
    pub fn distance(&self, hit: &Hit) -> f64 {
        self.measure(hit).to_f64()
    }

    /// The distance `t` of a hit, within [`DISTANCE_ERROR`] as a part of it, whatever its exponent;
    /// exactly 0 where it is 0.
    pub fn measure(&self, hit: &Hit) -> Distance {
        let y = self.y(hit);
        if y.is_within(0.25 * DISTANCE_ERROR) {
            // What has overflowed is not within anything: both are finite, and `a` is at least 1.
            let [y, a] = [y, self.sample().a].map(|x| Distance::exact(x.value()));
            return y.over(a).times_two_to(-self.truth.scale_exponent());
        }
        // Nearly everything cancels: the camera is on the surface, or all but.
        let by_product = match self.truth.view.camera.projection {
            Projection::Perspective => self.distance_by_product(hit),
            Projection::Orthographic => None,
        };
        by_product.unwrap_or_else(|| self.distance_by_integers(hit))
    }

    /// Certain bounds of the distance `t` of a hit, from 100 bits: they cost little and are wide
    /// where nearly everything cancels. The upper one may be infinite.
    pub fn rough_bounds(&self, hit: &Hit) -> [f64; 2] {
        let (y, Sample { a, .. }) = (self.y(hit), self.sample());
        let ([low, high], [least, most]) = (y.bounds(), a.bounds());
        if !(low.is_finite() && high.is_finite() && least >= 0.5 && most.is_finite()) {
            return [0.0, f64::INFINITY];
        }
        // No hit lies before the camera. A quotient is rounded once, and then no end is off by more
        // than `bounds` takes off.
        let end = |y: f64, a: f64| {
            Distance::exact(y.max(0.0))
                .over(Distance::exact(a))
                .times_two_to(-self.truth.scale_exponent())
                .bounds()
        };
        [end(low, most)[0], end(high, least)[1]]
    }

    /// Perspective: the product of both roots is `(|f|^2 - r^2) / |dir|^2`, which is an exact
    /// number over `a`, so that the root that cancels follows from the one that does not. Nothing
    /// if neither is certain.
    fn distance_by_product(&self, hit: &Hit) -> Option<Distance> {
        let (truth, ball) = (self.truth, hit.ball);
        let origin = truth.view.camera.origin;
        let exponent = least_exponent(
            ball.center.to_array().into_iter().chain(origin.to_array()).chain([ball.radius]),
        );
        let f: [IBig; 3] = std::array::from_fn(|k| {
            integer(ball.center[k], exponent) - integer(origin[k], exponent)
        });
        let r = integer(ball.radius, exponent);
        let product = dot(&f, &f) - &r * &r;
        let (beta, q) = self.bounded(ball);
        if product.is_zero() {
            // The roots are 0 and 2 beta / |dir|^2.
            return match (beta.sign()?, hit.root) {
                (1, Root::Near) | (-1, Root::Far) => Some(Distance::ZERO),
                _ => None,
            };
        }
        let other = match hit.root {
            Root::Near => beta + q.sqrt(),
            Root::Far => beta - q.sqrt(),
        };
        if !other.is_within(0.25 * DISTANCE_ERROR) {
            return None;
        }
        // `other` is in scaled lengths, the product in units of `2^exponent`, squared.
        let power = 2 * i64::from(exponent) + truth.scale_exponent();
        Some(Distance::leading(&product).over(Distance::exact(other.value())).times_two_to(power))
    }

    /// By integers with more and more bits, until the distance is certain.
    fn distance_by_integers(&self, hit: &Hit) -> Distance {
        let truth = self.truth;
        let exponent = truth.exponent([hit.ball]);
        let site = truth.site(self.odd, hit.ball, exponent);
        let sign = hit.root.sign();
        if truth.field.sign_with_root(&site.beta, sign, &site.q) == 0 {
            return Distance::ZERO;
        }
        let Axes { a, b, .. } = &truth.axes;
        let ab = a * b;
        let mut bits = 256;
        loop {
            // Numbers times 2^bits, as intervals.
            let root = |square: &IBig| -> IBig { floor_root(&(square << (2 * bits))) };
            let (root_a, root_b, root_ab) = (root(a), root(b), root(&ab));
            let value = |x: &Element| {
                let [x0, x1, x2, x3] = &x.0;
                let middle = (x0 << bits) + x1 * &root_a + x2 * &root_b + x3 * &root_ab;
                let error = x1.clone().abs() + x2.clone().abs() + x3.clone().abs();
                (&middle - &error, middle + error)
            };
            let ((beta_low, beta_high), (q_low, q_high)) = (value(&site.beta), value(&site.q));
            let (root_low, root_high) =
                (floor_root(&(q_low << bits)), floor_root(&(q_high << bits)) + IBig::ONE);
            let (low, high) = match hit.root {
                Root::Near => (beta_low - root_high, beta_high - root_low),
                Root::Far => (beta_low + root_low, beta_high + root_high),
            };
            if sign_of(&low) > 0 && &high - &low <= (&low >> 48) {
                // t = y P / (a' sqrt(A B)), in units of 2^exponent / (2 lcm). Either of the two may
                // be thousands of bits the longer.
                let numerator = low * &site.p;
                let denominator = &site.a * root_ab * IBig::from(2 * truth.lcm[0]);
                return Distance::leading(&numerator)
                    .over(Distance::leading(&denominator))
                    .times_two_to(exponent.into());
            }
            bits *= 2;
        }
    }

    /// `beta` and `q` of the view space, over `sqrt(A B)` and its square: `t = (beta -+ sqrt q) /
    /// a`.
    pub(super) fn bounded(&self, ball: Ball) -> (Bounded, Bounded) {
        let truth = self.truth;
        let origin = truth.view.camera.origin;
        let f: [Bounded; 3] = std::array::from_fn(|k| {
            let exact = Bounded::difference(ball.center[k] * truth.scale, origin[k] * truth.scale);
            if truth.slack == 0.0 { exact } else { exact.widened(truth.slack) }
        });
        let along = |axis: Axis| {
            let part = |k: usize| f[k] * Bounded::pair(axis.high[k], axis.low[k], Axis::ERROR);
            part(0) + part(1) + part(2)
        };
        let (x, y, z) = (along(truth.axes.right), along(truth.axes.up), along(truth.axes.forward));
        let r = truth.scaled(ball.radius);
        let Sample { s: [sx, sy], a } = *self.sample();
        match truth.view.camera.projection {
            Projection::Orthographic => (z, r.square() - (sx - x).square() - (sy - y).square()),
            Projection::Perspective => {
                // |f|^2 |dir|^2 - (f.dir)^2 = |f x dir|^2, of which nothing cancels.
                let (n, m) = (z * sx - x, y - z * sy);
                let k = n * sy + m * sx;
                let beta = x * sx + y * sy + z;
                (beta, a * r.square() - (m.square() + n.square() + k.square()))
            }
        }
    }

    /// The sign of `t - plane` for a root of a sphere.
    fn side(&self, numbers: &Numbers, root: Root, plane: Plane, tally: &mut Tally) -> i32 {
        let camera = &self.truth.view.camera;
        let distance = match plane {
            Plane::Near => camera.near,
            Plane::Far if camera.far == f64::INFINITY => return -1,
            Plane::Far => camera.far,
        };
        tally.ask(
            || {
                let site = numbers.small()?;
                let plane = self.truth.small.as_ref()?.plane(distance)?;
                small::sign_with_root(site.beta.checked_sub(plane)?, root.sign(), site.q?)
            },
            || {
                let scaled = distance * self.truth.scale;
                // A far plane beyond the numbers of the scene may overflow when scaled: then 100
                // bits cannot tell.
                if !(scaled.is_finite() && scaled.abs() < 1e200) {
                    return None;
                }
                let (beta, q) = *numbers.bounded();
                let y = match root {
                    Root::Near => beta - q.sqrt(),
                    Root::Far => beta + q.sqrt(),
                };
                (y - self.sample().a * Bounded::exact(scaled).widened(self.truth.slack)).sign()
            },
            || {
                let exponent = self.truth.exponent([numbers.ball]);
                let site = numbers.big();
                let plane = self.truth.length(distance, exponent);
                // P y - plane a' sqrt(A B), see `Site`.
                let edge =
                    self.truth.field.element([IBig::ZERO, IBig::ZERO, IBig::ZERO, plane * &site.a]);
                let beta = site.beta.times_integer(&site.p).minus(&edge);
                let q = site.q.times_integer(&(&site.p * &site.p));
                self.truth.field.sign_with_root(&beta, root.sign(), &q)
            },
        )
    }
}

/// The square root, rounded down; of a negative number, 0.
fn floor_root(square: &IBig) -> IBig {
    UBig::try_from(square.clone()).map_or(IBig::ZERO, |square| IBig::from(square.sqrt()))
}

impl Tally {
    /// The first answer, from the cheapest arithmetic that gives one.
    pub(super) fn ask(
        &mut self,
        small: impl FnOnce() -> Option<i32>,
        bounded: impl FnOnce() -> Option<i32>,
        big: impl FnOnce() -> i32,
    ) -> i32 {
        self.signs += 1;
        if let Some(sign) = small() {
            self.small += 1;
            return sign;
        }
        bounded().unwrap_or_else(|| {
            self.big += 1;
            big()
        })
    }
}

/// `y = beta -+ sqrt q` of a sphere at a pixel in exact numbers.
///
/// Lengths are integers in units of `2^exponent / (2 lcm)`. The perspective ray is `dir' = P dir`,
/// so that its components are integers too; then `y / (a' sqrt(A B)) = t / P` with `a' = P^2
/// |dir|^2`. Orthographic: `P = a' = 1`.
pub(super) struct Site {
    pub(super) beta: Element,
    pub(super) q: Element,
    pub(super) a: IBig,
    pub(super) p: IBig,
}

/// A sphere's numbers at a pixel, each computed when it is first needed.
struct Numbers<'a> {
    pixel: &'a Pixel<'a>,
    ball: Ball,
    small: OnceCell<Option<small::Site>>,
    bounded: OnceCell<(Bounded, Bounded)>,
    big: OnceCell<Site>,
}

impl<'a> Numbers<'a> {
    fn new(pixel: &'a Pixel<'a>, ball: Ball) -> Self {
        Self { pixel, ball, small: OnceCell::new(), bounded: OnceCell::new(), big: OnceCell::new() }
    }

    fn small(&self) -> Option<&small::Site> {
        let frame = self.pixel.truth.small.as_ref()?;
        self.small.get_or_init(|| frame.site(self.pixel.odd, self.ball)).as_ref()
    }

    fn bounded(&self) -> &(Bounded, Bounded) {
        self.bounded.get_or_init(|| self.pixel.bounded(self.ball))
    }

    fn big(&self) -> &Site {
        let truth = self.pixel.truth;
        self.big.get_or_init(|| truth.site(self.pixel.odd, self.ball, truth.exponent([self.ball])))
    }
}

impl Truth {
    /// The exponent under which all lengths that meet at a pixel are integers.
    pub(super) fn exponent<const N: usize>(&self, balls: [Ball; N]) -> i32 {
        let View { camera, pitch_x, pitch_y, .. } = &self.view;
        let spheres = balls.iter().flat_map(|b| b.center.to_array().into_iter().chain([b.radius]));
        let far = if camera.far.is_finite() { camera.far } else { 0.0 };
        let mut least =
            least_exponent(spheres.chain(camera.origin.to_array()).chain([camera.near, far]));
        if camera.projection == Projection::Orthographic {
            least = least.min(least_exponent([pitch_x.length, pitch_y.length]));
        }
        least
    }

    /// A length in units of `2^exponent / (2 lcm)`.
    pub(super) fn length(&self, value: f64, exponent: i32) -> IBig {
        integer(value, exponent) * IBig::from(2 * self.lcm[0])
    }

    fn site(&self, odd: [i32; 2], ball: Ball, exponent: i32) -> Site {
        let Axes { d, e, g, a, b, .. } = &self.axes;
        let View { camera, pitch_x, pitch_y, .. } = &self.view;
        let f: [IBig; 3] = std::array::from_fn(|k| {
            (integer(ball.center[k], exponent) - integer(camera.origin[k], exponent))
                * IBig::from(2 * self.lcm[0])
        });
        let r = self.length(ball.radius, exponent);
        let (fd, fe, fg) = (dot(&f, d), dot(&f, e), dot(&f, g));
        let ab = a * b;
        let two = IBig::from(2);
        let sample = |k: usize, pitch: &Pitch, exponent: i32| {
            integer(pitch.length, exponent)
                * IBig::from(i128::from(odd[k]) * i128::from(self.lcm[k + 1]))
        };
        match camera.projection {
            Projection::Orthographic => {
                let (sx, sy) = (sample(0, pitch_x, exponent), sample(1, pitch_y, exponent));
                let rest = &r * &r - &sx * &sx - &sy * &sy - dot(&f, &f);
                let q =
                    [rest * &ab + b * (&fd * &fd), IBig::ZERO, &two * sx * fe * a, two * sy * fg];
                let beta = [IBig::ZERO, IBig::ZERO, fd, IBig::ZERO];
                let one = IBig::ONE;
                Site {
                    beta: self.field.element(beta),
                    q: self.field.element(q),
                    a: one.clone(),
                    p: one,
                }
            }
            Projection::Perspective => {
                let exponent = least_exponent([pitch_x.length, pitch_y.length]).min(0);
                let (nx, ny) = (sample(0, pitch_x, exponent), sample(1, pitch_y, exponent));
                let p = IBig::from(2 * self.lcm[0]) << exponent.unsigned_abs() as usize;
                let length = &p * &p + &nx * &nx + &ny * &ny;
                let beta = self.field.element([ny * fg, nx * fe, &p * fd, IBig::ZERO]);
                let apart = (dot(&f, &f) - &r * &r) * &ab * &length;
                let q = self.field.product(&beta, &beta).minus(&Element::integer(apart));
                Site { beta, q, a: length, p }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::camera::{Camera, ImageSize, ScreenSize};

    /// A camera that all but touches a sphere: `7 - sqrt(49 - h^2)` is `h^2 / 14 (1 + h^2 / 196)`
    /// but for less than its last bit, and hundreds of bits cancel in it. 7 divides nothing of the
    /// view: no number of the way is a short one.
    #[test]
    fn distances_of_which_nearly_all_cancels() {
        let image = ImageSize { width: 33, height: 33 };
        for power in 20..400 {
            let h = 0.5f64.powi(power);
            let want = h * h / 14.0 * (1.0 + h * h / 196.0);
            let ball = Ball { center: DVec3::new(7.0, h, 0.0), radius: 7.0 };
            for projection in [Projection::Orthographic, Projection::Perspective] {
                let camera = Camera::orthographic(DVec3::ZERO, DVec3::X);
                let size = ScreenSize::Width(1.0);
                let view = View::new(Camera { projection, size, ..camera }, image);
                let [min_center, max_center] = [ball.center; 2];
                let bounds = Bounds { min_center, max_center, min_radius: 7.0, max_radius: 7.0 };
                let truth = Truth::new(&view, bounds);
                let pixel = truth.pixel(16, 16);
                let hit = pixel.hit(ball, &mut Tally::default()).expect("it is before the camera");
                let product = match projection {
                    Projection::Perspective => pixel.distance_by_product(&hit),
                    Projection::Orthographic => None,
                };
                let integers = pixel.distance_by_integers(&hit);
                for found in product.into_iter().chain([integers, pixel.measure(&hit)]) {
                    let off = (found.to_f64() - want).abs();
                    assert!(off <= DISTANCE_ERROR * want, "{off:e} of {want:e}, {projection:?}");
                }
                assert_eq!(product.is_some(), projection == Projection::Perspective);
            }
        }
    }

    /// Orders of a lattice's spheres against integers of any size, for axes of every kind; ties by
    /// symmetry need none.
    #[test]
    fn orders_on_lattices() {
        let image = ImageSize { width: 33, height: 33 };
        let (mut all_ties, mut tally) = (0, Tally::default());
        for view in [
            [1, 0, 0],
            [3, 4, 0],
            [1, 1, 0],
            [2, 1, 0],
            [1, 1, 1],
            [4, 0, 3],
            [2, 1, 2],
            [1, 2, 5],
            [0, 1, 2],
        ] {
            let d = DVec3::from_array(view.map(f64::from));
            // From far away, and from inside spheres that are symmetrical about the camera's plane.
            for origin in [-16.0 * d, 0.5 * d] {
                let mut camera = Camera::orthographic(origin, d);
                camera.size = ScreenSize::Width(33.0 / 8.0);
                let view = View::new(camera, image);
                let bounds = Bounds {
                    min_center: DVec3::splat(-2.0),
                    max_center: DVec3::splat(2.0),
                    min_radius: 0.75,
                    max_radius: 0.75,
                };
                let truth = Truth::new(&view, bounds);
                let (mut ties, mut signs) = (0u64, 0u64);
                let centers: Vec<DVec3> = (0..125)
                    .map(|k| {
                        DVec3::new(k as f64 % 5.0, (k / 5) as f64 % 5.0, (k / 25) as f64) - 2.0
                    })
                    .collect();
                for row in (0..33).step_by(2) {
                    for column in (0..33).step_by(2) {
                        let pixel = truth.pixel(column, row);
                        let hits: Vec<Hit> = centers
                            .iter()
                            .filter_map(|&center| {
                                pixel.hit(Ball { center, radius: 0.75 }, &mut Tally::default())
                            })
                            .collect();
                        let pairs = (0..hits.len()).flat_map(|k| (0..k).map(move |l| [k, l]));
                        for pair in pairs.map(|pair| pair.map(|k| &hits[k])) {
                            let exponent = truth.exponent([pair[0].ball, pair[1].ball]);
                            let [one, other] =
                                [0, 1].map(|k| truth.site(pixel.odd, pair[k].ball, exponent));
                            let [s, t] = pair.map(|hit| hit.root.sign());
                            let want = truth.field.sign_with_roots(
                                &one.beta.minus(&other.beta),
                                s,
                                &one.q,
                                t,
                                &other.q,
                            );
                            let got = pixel.order(pair[0], pair[1], &mut tally);
                            assert_eq!(
                                got,
                                want.cmp(&0),
                                "{:?} {:?} at {column}, {row} along {d}",
                                pair[0].ball,
                                pair[1].ball
                            );
                            ties += u64::from(want == 0);
                            signs += 1;
                        }
                    }
                }
                println!(
                    "along {d}: {signs} orders, {ties} ties, {} by big integers so far",
                    tally.big
                );
                all_ties += ties;
            }
        }
        // Without symmetry, axes without rational lengths have few ties.
        assert!(all_ties > 2000 && tally.big * 8 < all_ties, "{all_ties}, {tally:?}");
    }
}
