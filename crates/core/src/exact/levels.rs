//! What looks ask of a hit, decided exactly: how much it is turned to the eye, how far away it is
//! between two depths, and how far two hits lie apart that are seen at different samples.
//!
//! Notation is that of [`super::decide`]: `y = beta -+ sqrt q` and `t = P y / (a sqrt(A B))`, with
//! `a = P^2 |dir|^2`; for parallel rays `P = a = 1`.
//!
//! * The cosine between ray and normal is `c = sqrt(q / (A B a r^2))`, so that `c >= L / 256` is
//!   the sign of `65536 q - A B a r^2 L^2`: the hit test of a smaller sphere.
//! * `t >= e / 256` is the sign of `256 P y - e a sqrt(A B)`.
//! * `t_2 - t_1 > T` is the sign of `P a_1 y_2 - P a_2 y_1 - T a_1 a_2 sqrt(A B)`, of two square
//!   roots.
//!
//! Each is tried with 100 bits first, and told by integers of any size where these do not tell.

use dashu_int::IBig;

use super::{
    dd::Bounded,
    decide::{Hit, Pixel, Tally, Truth},
    field::Element,
};
use crate::{axes::least_exponent, scene::Ball};

/// Headlight levels: the cosine is at least `L / LEVELS`.
pub const LEVELS: u32 = 256;
/// The steps from the first of two depths to the second.
pub const CUES: u32 = 256;

impl Pixel<'_> {
    /// The headlight level of a sphere that the ray meets: the greatest `L` below [`LEVELS`] with
    /// `cos >= L / LEVELS`. Both walls have the same.
    pub fn headlight(&self, ball: Ball, tally: &mut Tally) -> u8 {
        let (a, (_, q)) = (self.sample_length(), self.bounded(ball));
        let r = self.truth().radius(ball);
        let about = q.value() / (a.value() * r.value() * r.value());
        let about = (f64::from(LEVELS) * about.max(0.0).sqrt()).min(f64::from(LEVELS - 1));
        // What is NaN begins at 0.
        let mut level = about as u32;
        while level > 0 && !self.turned(ball, level, tally) {
            level -= 1;
        }
        while level + 1 < LEVELS && self.turned(ball, level + 1, tally) {
            level += 1;
        }
        level as u8
    }

    /// Whether the cosine is at least `level / LEVELS`.
    fn turned(&self, ball: Ball, level: u32, tally: &mut Tally) -> bool {
        const WHOLE: u32 = LEVELS * LEVELS;
        let square = level * level;
        let sign = tally.ask(
            || None,
            || {
                let (_, q) = self.bounded(ball);
                let r = self.truth().radius(ball);
                let least = self.sample_length() * r.square() * Bounded::exact(square.into());
                (q * Bounded::exact(WHOLE.into()) - least).sign()
            },
            || {
                let truth = self.truth();
                let exponent = truth.exponent([ball]);
                let (site, r) = (self.site(ball, exponent), truth.length(ball.radius, exponent));
                let ab = &truth.axes().a * &truth.axes().b;
                let least = ab * &site.a * (&r * &r) * IBig::from(square);
                let q = site.q.times_integer(&IBig::from(WHOLE));
                truth.field().sign(&q.minus(&Element::integer(least)))
            },
        );
        sign >= 0
    }

    /// The cue level of a hit between the depths `near < far`: the greatest `D` up to [`CUES`] with
    /// `t >= near + (far - near) D / CUES`, and 0 before `near`.
    pub fn cue(&self, hit: &Hit, [near, far]: [f64; 2], tally: &mut Tally) -> u16 {
        let about = (self.distance(hit) - near) / (far - near) * f64::from(CUES);
        let mut level = about.clamp(0.0, f64::from(CUES)) as u32;
        while level > 0 && !self.beyond(hit, [near, far], level, tally) {
            level -= 1;
        }
        while level < CUES && self.beyond(hit, [near, far], level + 1, tally) {
            level += 1;
        }
        level as u16
    }

    /// Whether a hit is as far as `near + (far - near) step / CUES`.
    fn beyond(&self, hit: &Hit, [near, far]: [f64; 2], step: u32, tally: &mut Tally) -> bool {
        let weights = [CUES - step, step];
        let sign = tally.ask(
            || None,
            || {
                let [near, far] = [near, far].map(|plane| self.truth().scaled(plane));
                let [before, after] = weights.map(|weight| Bounded::exact(weight.into()));
                let edge = self.sample_length() * (near * before + far * after);
                (self.y(hit) * Bounded::exact(CUES.into()) - edge).sign()
            },
            || {
                let truth = self.truth();
                let exponent = truth.exponent([hit.ball()]).min(least_exponent([near, far]));
                let [near, far] = [near, far].map(|plane| truth.length(plane, exponent));
                let site = self.site(hit.ball(), exponent);
                let [before, after] = weights.map(IBig::from);
                let edge = (near * before + far * after) * &site.a;
                let factor = &site.p * IBig::from(CUES);
                let x = site.beta.times_integer(&factor).minus(&truth.times_scale(edge));
                let q = site.q.times_integer(&(&factor * &factor));
                truth.field().sign_with_root(&x, hit.root().sign(), &q)
            },
        );
        sign >= 0
    }

    /// The sign of `t_2 - t_1 - length`: of the distance of a hit at another sample of the view,
    /// less that of a hit here, less a length.
    pub fn farther(
        &self,
        hit: &Hit,
        (there, other): (&Self, &Hit),
        length: f64,
        tally: &mut Tally,
    ) -> i32 {
        tally.ask(
            || None,
            || {
                let (a, b) = (self.sample_length(), there.sample_length());
                let apart = there.y(other) * a - self.y(hit) * b;
                (apart - self.truth().scaled(length) * a * b).sign()
            },
            || {
                let truth = self.truth();
                let balls = [hit.ball(), other.ball()];
                let exponent = truth.exponent(balls).min(least_exponent([length]));
                let (one, two) = (self.site(balls[0], exponent), there.site(balls[1], exponent));
                let (by_one, by_two) = (&one.p * &two.a, &two.p * &one.a);
                let apart = truth.length(length, exponent) * &one.a * &two.a;
                let x = two.beta.times_integer(&by_two).minus(&one.beta.times_integer(&by_one));
                let x = x.minus(&truth.times_scale(apart));
                let q_two = two.q.times_integer(&(&by_two * &by_two));
                let q_one = one.q.times_integer(&(&by_one * &by_one));
                let (s, t) = (other.root().sign(), hit.root().sign());
                truth.field().sign_with_roots(&x, s, &q_two, t, &q_one)
            },
        )
    }
}

impl Truth {
    /// A radius in view lengths.
    fn radius(&self, ball: Ball) -> Bounded {
        self.scaled(ball.radius)
    }

    /// A length times `sqrt(A B)`.
    fn times_scale(&self, length: IBig) -> Element {
        self.field().element([IBig::ZERO, IBig::ZERO, IBig::ZERO, length])
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::{
        camera::{Camera, ImageSize, Projection, ScreenSize, View},
        exact::decide::Root,
        scene::Bounds,
    };

    /// A camera at the origin that looks along x, with samples at multiples of a quarter.
    fn truth(projection: Projection, ball: Ball) -> Truth {
        let camera = Camera::orthographic(DVec3::ZERO, DVec3::X);
        let camera = Camera { projection, size: ScreenSize::Width(8.25), ..camera };
        let [min_center, max_center] = [ball.center; 2];
        let (min_radius, max_radius) = (ball.radius, ball.radius);
        let bounds = Bounds { min_center, max_center, min_radius, max_radius };
        Truth::new(&View::new(camera, ImageSize { width: 33, height: 33 }), bounds)
    }

    /// At a distance of 3 from the axis of a sphere of radius 5 the cosine is 4 / 5; where it is
    /// just a level, that level is reached.
    #[test]
    fn levels_are_those_of_triangles() {
        let ball = Ball { center: DVec3::new(20.0, 0.0, 0.0), radius: 5.0 };
        let truth = truth(Projection::Orthographic, ball);
        let level = |quarters: i32| {
            truth.pixel((16 + quarters) as u32, 16).headlight(ball, &mut Tally::default())
        };
        for quarters in -16..=16 {
            let sine = f64::from(quarters) / 20.0;
            let want = (256.0 * (1.0 - sine * sine).sqrt() + 1e-9).floor().min(255.0);
            assert_eq!(f64::from(level(quarters)), want, "{quarters}");
        }
        // cos = 240 / 256 where the distance is r sqrt(31 / 256): not rational. 0.6 and 0.8 are.
        assert_eq!((level(12), level(0), level(-12)), (204, 255, 204));
        // A sphere that is just met.
        let touched = Ball { center: DVec3::new(20.0, 0.0, 0.0), radius: 4.0 };
        assert_eq!(truth.pixel(32, 16).headlight(touched, &mut Tally::default()), 0);
    }

    /// Depths that lie just in a plane, and beside it.
    #[test]
    fn cues_are_counted_at_their_planes() {
        for projection in [Projection::Orthographic, Projection::Perspective] {
            let ball = Ball { center: DVec3::new(20.0, 0.0, 0.0), radius: 4.0 };
            let truth = truth(projection, ball);
            let pixel = truth.pixel(16, 16);
            for (root, distance) in [(Root::Near, 16.0), (Root::Far, 24.0)] {
                let hit = Hit::known(ball, root);
                let level =
                    |near: f64, far: f64| pixel.cue(&hit, [near, far], &mut Tally::default());
                assert_eq!(level(0.0, 2.0 * distance), 128, "{projection:?}");
                assert_eq!(level(distance, 100.0), 0);
                assert_eq!(level(0.0, distance), 256);
                assert_eq!(level(0.0, distance.next_up()), 255);
                assert_eq!(level(0.0, 2.0 * distance.next_up()), 127);
                assert_eq!(level(distance.next_up(), 100.0), 0);
                assert_eq!(level(0.0, 1.0), 256);
            }
        }
    }

    #[test]
    fn hits_at_two_samples_are_told_apart() {
        for projection in [Projection::Orthographic, Projection::Perspective] {
            let ball = Ball { center: DVec3::new(20.0, 0.0, 0.0), radius: 5.0 };
            let truth = truth(projection, ball);
            let (here, there) = (truth.pixel(16, 16), truth.pixel(28, 16));
            let (near, far) = (Root::Near, Root::Far);
            // A hit is of one sample.
            let of = |pixel: &Pixel, one: Root, two: Root, length: f64| {
                let (one, two) = (Hit::known(ball, one), Hit::known(ball, two));
                here.farther(&one, (pixel, &two), length, &mut Tally::default())
            };
            match projection {
                // 20 - 4 less 20 - 5.
                Projection::Orthographic => {
                    let sign = |one, two, length| of(&there, one, two, length);
                    assert_eq!(sign(near, near, 1.0), 0);
                    assert_eq!(sign(near, near, 1f64.next_up()), -1);
                    assert_eq!(sign(near, near, 1f64.next_down()), 1);
                    assert_eq!(sign(near, far, 9.0), 0);
                    assert_eq!(sign(far, near, 0.0), -1);
                }
                // The ray of slope 3 misses the sphere; the one in the middle meets it twice.
                Projection::Perspective => {
                    let sign = |one, two, length| of(&here, one, two, length);
                    assert_eq!(sign(near, far, 10.0), 0);
                    assert_eq!(sign(near, far, 10f64.next_up()), -1);
                    assert_eq!(sign(far, near, -10.0), 0);
                }
            }
        }
    }
}
