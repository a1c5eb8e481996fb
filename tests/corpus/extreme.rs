//! Any number of small scenes, one for each seed, from all of the range of f64: every exponent from
//! -1074 to 1023, whole scenes of one and mixtures in one scene; planets under the camera; numbers
//! that cancel but for a subnormal rest.

use glam::DVec3;
use planisphere_core::{
    camera::{Camera, Projection, ScreenSize, View},
    scene::Sphere,
};

use super::{Case, ball, pixels, random::Random, scene};

/// The least positive number.
const LEAST: f64 = f64::from_bits(1);

/// `value * 2^power`, rounded where that is subnormal, and the largest number where it is beyond.
fn times_two_to(value: f64, power: i64) -> f64 {
    let mut value = value;
    let mut left = power;
    while left != 0 {
        let step = left.clamp(-1000, 1000);
        value *= f64::from_bits(((1023 + step) as u64) << 52);
        left -= step;
    }
    value.clamp(-f64::MAX, f64::MAX)
}

/// Which exponents the numbers of a scene have.
struct Exponents(Vec<i64>);

impl Exponents {
    fn choose(random: &mut Random) -> Self {
        let any = |random: &mut Random| match random.below(8) {
            // At the ends, and where f32 ends, squares of f64 and the filter's own ranges.
            0 => random.whole(-1074, -1060),
            1 => random.whole(1010, 1023),
            2 => random.whole(-1030, -960),
            3 => [
                -1022, -970, -540, -512, -301, -300, -149, -127, 127, 128, 300, 301, 400, 511, 512,
                969,
            ][random.below(16) as usize],
            4 => random.whole(-60, 60),
            _ => random.whole(-1074, 1023),
        };
        let first = any(random);
        Self(match random.below(6) {
            0..=2 => vec![first],
            // Mixed.
            3 => vec![first, any(random)],
            4 => vec![first, any(random), any(random)],
            // One number and what is left of it where it cancels.
            _ => vec![first, (first - random.whole(20, 120)).max(-1074), -1074],
        })
    }

    fn one(&self, random: &mut Random) -> i64 {
        self.0[random.below(self.0.len() as u64) as usize]
    }

    /// The first, which is the usual size.
    fn main(&self) -> i64 {
        self.0[0]
    }

    /// A number that is not negative, at most about so many times two to one of the exponents.
    fn size(&self, random: &mut Random, at: i64) -> f64 {
        let mantissa = match random.below(4) {
            0 => 1.0,
            1 => random.whole(1, 8) as f64,
            2 => random.whole(1, 64) as f64 / 8.0,
            _ => random.between(0.5, 4.0),
        };
        times_two_to(mantissa, at)
    }

    /// Any number.
    fn number(&self, random: &mut Random) -> f64 {
        let at = self.one(random);
        match random.below(6) {
            0 => 0.0,
            k => self.size(random, at) * [1.0, -1.0][k as usize % 2],
        }
    }

    fn point(&self, random: &mut Random) -> DVec3 {
        DVec3::new(self.number(random), self.number(random), self.number(random))
    }
}

/// A sum that stays in range.
fn plus(a: DVec3, b: DVec3) -> DVec3 {
    DVec3::from_array([0, 1, 2].map(|k| (a[k] + b[k]).clamp(-f64::MAX, f64::MAX)))
}

fn some(x: f64) -> f64 {
    if x > 0.0 { x.min(f64::MAX) } else { LEAST }
}

/// The scene of a seed.
pub fn extreme(seed: u64) -> Case {
    let mut random = Random::new(seed.wrapping_mul(0x9e6c_63d0_876a_68e5) ^ 0xe7);
    let random = &mut random;
    let exponents = Exponents::choose(random);
    let unit = times_two_to(1.0, exponents.main());
    // Mostly along an axis: then all is rational, and ties are soon proved.
    let along = DVec3::AXES[random.below(3) as usize] * [1.0, -1.0][random.below(2) as usize];
    let view = match random.below(8) {
        0 => DVec3::from_array([0; 3].map(|_| random.whole(-3, 3) as f64)),
        1 => random.ball(),
        2 => along * times_two_to(1.0, random.whole(-1074, 1023)),
        3 => plus(
            along,
            DVec3::from_array([0; 3].map(|_| times_two_to(random.whole(-1, 1) as f64, -60))),
        ),
        _ => along,
    };
    let view = if view == DVec3::ZERO { along } else { view };
    let ups = [DVec3::Z, DVec3::Y, DVec3::new(1.0, -1.0, 0.0), DVec3::new(0.25, 0.5, 1.0)];
    let first = random.below(4) as usize;
    let up = (0..4).map(|k| ups[(first + k) % 4]).find(|up| !parallel(view, *up));
    let up = up.expect("not all are parallel");
    let projection =
        if random.below(2) == 0 { Projection::Orthographic } else { Projection::Perspective };
    let image = match random.below(6) {
        0 => pixels(1, 1),
        1 => pixels(random.whole(1, 8) as u32, random.whole(1, 6) as u32),
        2 | 3 => pixels(5, 5),
        _ => pixels(6, 5),
    };
    let mut origin = match random.below(4) {
        0 => exponents.point(random),
        1 => DVec3::splat(1.0) * exponents.number(random),
        _ => DVec3::ZERO,
    };
    let count = [1, 2, 2, 3, 4, 6, 9][random.below(7) as usize];
    let planet = random.below(2) == 0;
    // So far from the camera that no f64 is the difference, nor the distance.
    let opposite = random.below(16) == 0;
    if opposite {
        origin = along * (-f64::MAX * [1.0, 0.75, 0.5][random.below(3) as usize]);
    }
    let mut spheres: Vec<Sphere> = Vec::new();
    while spheres.len() < count {
        let last = spheres.last().copied();
        let sphere = match (random.below(12), last) {
            // Under the camera, or around it, but for something small; and what lies in front.
            (0..=4, _) if planet && !opposite => {
                let radius = some(exponents.size(random, exponents.main()));
                let mut center = plus(origin, along * radius);
                let k = random.below(3) as usize;
                match random.below(5) {
                    0 => center[k] = plus(center, DVec3::splat(LEAST))[k],
                    1 => {
                        let next = f64::from_bits(center[k].to_bits() + random.below(3));
                        center[k] = if next.is_finite() { next } else { center[k] };
                    }
                    2 => {
                        center = plus(
                            center,
                            exponents.point(random) * two_below(20 + random.below(40) as i64),
                        )
                    }
                    3 if center[k] == 0.0 => {
                        center[k] = times_two_to(1.0, random.whole(-1074, 1000)).min(radius)
                    }
                    _ => {}
                }
                ball(center, radius)
            }
            (0..=10, _) if opposite => {
                let radius =
                    f64::MAX * [1.0, 0.5, two_below(30), two_below(900)][random.below(4) as usize];
                let center = along * (f64::MAX * [1.0, 0.5, 0.25, 1.0][random.below(4) as usize]);
                ball(
                    plus(center, exponents.point(random) * [0.0, 1.0][random.below(2) as usize]),
                    radius,
                )
            }
            (5, Some(other)) => other,
            // Concentric, touching, and the same but for the least.
            (6, Some(other)) => ball(other.center, some(exponents.size(random, exponents.main()))),
            (7, Some(other)) => {
                ball(other.center, f64::from_bits(other.radius.to_bits() + 1).min(f64::MAX))
            }
            (8, Some(other)) => {
                let radius = some(exponents.size(random, exponents.main()));
                ball(plus(other.center, DVec3::Y * (radius + other.radius).min(f64::MAX)), radius)
            }
            (9, Some(other)) => ball(plus(other.center, DVec3::splat(LEAST)), other.radius),
            _ => {
                let at =
                    if random.below(3) == 0 { exponents.one(random) } else { exponents.main() };
                let radius = some(exponents.size(random, at));
                let ahead = along * exponents.size(random, exponents.main());
                ball(
                    plus(
                        plus(origin, ahead),
                        exponents.point(random) * [0.0, 0.5, 1.0][random.below(3) as usize],
                    ),
                    radius,
                )
            }
        };
        spheres.push(sphere);
    }
    let target = spheres[random.below(count as u64) as usize];
    match random.below(8) {
        // Inside, on the surface, or all but.
        0 => origin = target.center,
        1 => origin = plus(target.center, along * -target.radius),
        2 => origin = plus(target.center, along * (-target.radius).next_down().max(-f64::MAX)),
        3 => origin = plus(target.center, along * (-0.5 * target.radius)),
        4 => origin = plus(target.center, along * (-3.0 * target.radius).max(-f64::MAX)),
        _ => {}
    }
    if opposite {
        origin = along * (-f64::MAX * [1.0, 0.75, 0.5][random.below(3) as usize]);
    }
    let side = |random: &mut Random| match (projection, random.below(6)) {
        (Projection::Perspective, 0) => some(times_two_to(1.0, random.whole(-1074, 1023))),
        (Projection::Perspective, 1) => some(times_two_to(1.0, random.whole(-40, 40))),
        (Projection::Perspective, _) => [1.0, 0.5, 5.0, 6.0, 0.1][random.below(5) as usize],
        (Projection::Orthographic, 0) => some(exponents.size(random, exponents.main())),
        (Projection::Orthographic, 1) => some(target.radius * two_below(random.below(64) as i64)),
        (Projection::Orthographic, 2) => some(2.5 * target.radius),
        (Projection::Orthographic, 3) => {
            let at = exponents.one(random);
            some(exponents.size(random, at))
        }
        (Projection::Orthographic, 4) => LEAST * random.whole(1, 9) as f64,
        // Samples at whole numbers of units.
        _ => some((unit * f64::from(image.width)).min(f64::MAX)),
    };
    let (width, height) = (side(random), side(random));
    let size = match random.below(4) {
        0 => ScreenSize::Width(width),
        1 => ScreenSize::Height(height),
        2 => ScreenSize::Both { width, height: width },
        _ => ScreenSize::Both { width, height },
    };
    let mut camera = Camera { projection, origin, view, up, size, near: 0.0, far: f64::INFINITY };
    if random.below(3) == 0 {
        let plane = |random: &mut Random| {
            let sphere = spheres[random.below(count as u64) as usize];
            let depth = [0, 1, 2].map(|k| (sphere.center[k] - origin[k]) * along[k]);
            let depth: f64 = depth.into_iter().find(|part| *part != 0.0).unwrap_or(0.0);
            let plane = match random.below(8) {
                0 => depth,
                1 => depth - sphere.radius,
                2 => depth + sphere.radius,
                3 => depth + sphere.radius * random.between(-1.0, 1.0),
                4 => LEAST,
                5 => f64::MAX,
                _ => {
                    let at = exponents.one(random);
                    exponents.size(random, at)
                }
            };
            plane.abs().min(f64::MAX)
        };
        let (a, b) = (plane(random), plane(random));
        if a != b {
            (camera.near, camera.far) = (a.min(b), a.max(b));
        }
        if random.below(2) == 0 {
            camera.far = f64::INFINITY;
        }
        if random.below(2) == 0 {
            camera.near = 0.0;
        }
    }
    camera.check().unwrap_or_else(|error| panic!("seed {seed}: {error}: {camera:?}"));
    Case {
        name: format!("extreme, seed {seed}"),
        scene: scene(&spheres),
        view: View::new(camera, image),
    }
}

/// `2^-power`.
fn two_below(power: i64) -> f64 {
    times_two_to(1.0, -power)
}

/// Whether two vectors may be parallel: certainly not where a component that one lacks is all but
/// the other.
fn parallel(view: DVec3, up: DVec3) -> bool {
    let scaled = view / view.abs().max_element();
    scaled.cross(up).abs().max_element() < 1e-12
}
