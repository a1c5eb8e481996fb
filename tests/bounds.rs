//! Every bound of the f64 filter, measured: the same expressions that the devices run, against
//! 100-bit arithmetic, whose own error is nothing here (its bounds are measured in
//! crates/core/src/exact/dd.rs against integers).
//!
//! For each quantity a search looks for the input with the largest error over its bound: climbs
//! from random starts, with spheres near and far, small and large, on axes that are rational and on
//! such that are not. The largest ratio must be above 1/8 and at most 1. So a bound that does not
//! hold fails, and so does one that could be eight times smaller: no bound here can be divided by
//! eight without a test that says so.
//!
//! `cargo test --release --test bounds -- --nocapture` prints the ratios. Seeds are fixed; a
//! failure prints its input.

mod measure;
#[path = "corpus/random.rs"]
#[expect(dead_code, reason = "shared with the corpus, which uses the rest")]
mod random;

use glam::DVec3;
use measure::{Exact, Input, LEAST, Stage, error, exact, neighbour, stages};
use planisphere_core::{
    bins::{APART, Binner, EDGE},
    camera::{Camera, ImageSize, Projection, Region, ScreenSize, View},
    exact::{
        dd::Bounded,
        decide::{Root, Truth},
    },
    filter::{BACK, Margins, PLANE, Row, length},
    pair::Pair,
    project::{MARGIN, Projector, REACH, SLOPE, slopes},
    projected::Projected,
    scene::{Ball, Scene, Sphere},
    simd::{LANES, Lanes},
    tile::{self, Place, Tile},
};
use random::Random;

/// Climbs from each camera, and inputs of one.
const CLIMBS: usize = 6;
const STEPS: usize = 8000;

/// The largest value of `ratio` that climbs find; fails where it is above 1, or not above
/// [`LEAST`].
fn climb(
    name: &str,
    projection: Projection,
    seed: u64,
    ranges: impl Fn(&mut Random) -> [f64; 3],
    ratio: impl Fn(&Stage, Input, &Exact) -> Option<f64>,
) {
    let worst = largest(name, projection, seed, ranges, ratio);
    assert!(
        worst > LEAST,
        "{name}, {projection:?}: the largest error is {worst} of the bound (seed {seed}): too loose"
    );
}

/// The largest value of `ratio` that climbs find; fails where it is above 1.
fn largest(
    name: &str,
    projection: Projection,
    seed: u64,
    ranges: impl Fn(&mut Random) -> [f64; 3],
    ratio: impl Fn(&Stage, Input, &Exact) -> Option<f64>,
) -> f64 {
    let mut random = Random::new(seed);
    let (mut worst, mut measured) = (0.0, 0u64);
    for stage in stages(&mut random, projection) {
        let mut measure = |input: Input| {
            let value = ratio(&stage, input, &stage.exact(input))?;
            measured += 1;
            assert!(
                value <= 1.0,
                "{name}: {value} times the bound (seed {seed}) at {input:?}, camera {:?}",
                stage.view
            );
            Some(value)
        };
        for _ in 0..CLIMBS {
            let start = ranges(&mut random);
            let mut best = (0.0, stage.near_ray(&mut random, start));
            for step in 0..STEPS {
                // A third of it as random as it comes.
                let next = if step < STEPS / 3 {
                    let start = ranges(&mut random);
                    stage.near_ray(&mut random, start)
                } else {
                    neighbour(&mut random, &stage, best.1)
                };
                if let Some(value) = measure(next)
                    && value >= best.0
                {
                    best = (value, next);
                }
            }
            worst = f64::max(worst, best.0);
        }
    }
    println!("{name}, {projection:?}: {worst:.3} of the bound, {measured} inputs");
    assert!(measured > 1000, "{name}: only {measured} inputs were of use");
    worst
}

const BOTH: [Projection; 2] = [Projection::Orthographic, Projection::Perspective];

/// Depth, radius, distance from the ray: radii from 1e-9 to 1e3, depths of up to 10^`farthest` of
/// them, within `apart` of the ray.
fn wide(apart: f64, farthest: f64) -> impl Fn(&mut Random) -> [f64; 3] {
    move |random| {
        let radius = random.power(-9.0, 3.0);
        [radius * random.power(-2.0, farthest), radius, random.unit() * apart * radius]
    }
}

/// Rays in the outermost part of a sphere's disc, whose half chords are 0.002 to 0.1 radii; so far
/// that some hits are not solid.
fn silhouette(random: &mut Random) -> [f64; 3] {
    let (radius, chord) = (random.power(-9.0, 3.0), random.power(-2.7, -1.0));
    [radius * random.power(-2.0, 12.0), radius, radius * (1.0 - chord * chord).sqrt()]
}

/// Rays in the outermost part of a sphere's disc, about where hits are solid by the sharpest
/// bounds: their half chords are about 2 sqrt E.
fn outermost(random: &mut Random) -> [f64; 3] {
    let (radius, far) = (random.power(-9.0, 3.0), random.power(0.0, 9.0));
    let square = 1e-14 * far * random.power(0.0, 1.0);
    [radius * far, radius, radius * (1.0 - square).sqrt()]
}

fn projected(stage: &Stage, input: Input) -> Projected {
    stage.projector.project(input.center, input.radius)
}

/// Of a sphere: those that are used first, and those that make hits solid as near to its silhouette
/// as may be.
fn margins(stage: &Stage, s: &Projected) -> [Margins; 2] {
    let screen = stage.projector.screen;
    match stage.perspective {
        true => [Margins::new::<true>(s, screen), Margins::sharp::<true>(s, &screen)],
        false => [Margins::new::<false>(s, screen), Margins::sharp::<false>(s, &screen)],
    }
}

/// The margins, `q` and `b`.
fn meet(stage: &Stage, input: Input) -> ([Margins; 2], f64, f64) {
    let s = projected(stage, input);
    let (sx, sy) =
        (stage.projector.columns[input.column as usize], stage.projector.rows[input.row as usize]);
    let (q, b) = match stage.perspective {
        true => Row::new::<true>(&s, sy).meet::<f64, true>(sx),
        false => Row::new::<false>(&s, sy).meet::<f64, false>(sx),
    };
    (margins(stage, &s), q, b)
}

#[test]
fn position() {
    for projection in BOTH {
        climb("position", projection, 1, wide(3.0, 10.0), |stage, input, e| {
            let s = projected(stage, input);
            let off = [(s.x, e.x), (s.y, e.y), (s.z, e.z)].map(|(c, t)| error(c, t).abs());
            Some(off.into_iter().fold(0.0, f64::max) / s.bound())
        });
    }
}

/// `z - r - P` is not behind the sphere's nearest point, and `z + r + P` not before its farthest.
#[test]
fn nearest_and_farthest() {
    climb("nearest", Projection::Orthographic, 2, wide(3.0, 10.0), |stage, input, e| {
        let s = projected(stage, input);
        Some(1.0 + error(s.nearest(), e.z - e.r) / s.bound())
    });
    climb("farthest", Projection::Orthographic, 3, wide(3.0, 10.0), |stage, input, e| {
        let s = projected(stage, input);
        Some(1.0 - error(s.farthest(), e.z + e.r) / s.bound())
    });
}

/// `E`, as long as the ray passes within 1.02 radii; and farther out `q < -E` for certain. What is
/// too far away for that is vague.
#[test]
fn doubt() {
    for projection in BOTH {
        climb("doubt", projection, 4, wide(1.2, 16.0), |stage, input, e| {
            let ([m, _], q, _) = meet(stage, input);
            if m.doubt == f64::INFINITY {
                return None;
            }
            if (e.q + exact(0.04) * e.a * e.r.square()).value() > 0.0 {
                return Some(error(q, e.q).abs() / m.doubt);
            }
            assert!(q < -m.doubt, "farther out: {q:e} against {:e} at {input:?}", m.doubt);
            None
        });
    }
}

/// `E` where squares underflow: the same numbers 2^540 times smaller, whose exact `q` is 2^1080
/// times smaller.
#[test]
fn underflow() {
    let mut random = Random::new(16);
    let (small, large) = (f64::from_bits((1023 - 540) << 52), f64::from_bits((1023 + 540) << 52));
    let mut lost = 0;
    for stage in stages(&mut random, Projection::Orthographic) {
        for _ in 0..20_000 {
            let start = silhouette(&mut random);
            let input = stage.near_ray(&mut random, start);
            let (s, e) = (projected(&stage, input), stage.exact(input));
            let (sx, sy) = (
                stage.projector.columns[input.column as usize],
                stage.projector.rows[input.row as usize],
            );
            let tiny = Projected { x: s.x * small, y: s.y * small, z: s.z * small, r: s.r * small };
            let m = Margins::new::<false>(&tiny, stage.projector.screen);
            let (q, _) = Row::new::<false>(&tiny, sy * small).meet::<f64, false>(sx * small);
            let off = error(q * large * large, e.q).abs();
            assert!(
                off <= m.doubt * large * large,
                "{off:e} against {:e} at {input:?} (seed 16)",
                m.doubt
            );
            let (plain, _) = Row::new::<false>(&s, sy).meet::<f64, false>(sx);
            lost += usize::from(off > 2.0 * error(plain, e.q).abs());
        }
    }
    assert!(lost > 1000, "underflow cost only {lost} inputs anything");
}

/// `W`: depths of solid hits, with both margins.
#[test]
fn width() {
    for projection in BOTH {
        let rays = |random: &mut Random| {
            if random.unit() < 0.5 { silhouette(random) } else { outermost(random) }
        };
        climb("width", projection, 5, rays, |stage, input, e| {
            let (margins, q, b) = meet(stage, input);
            let ratio = |m: Margins| {
                assert!(e.q.value() > 0.0, "a solid hit that is none: {input:?}");
                let (root, y) = (q.sqrt(), [e.b - e.q.sqrt(), e.b + e.q.sqrt()]);
                let ends = [(b - root, y[0]), (b + root, y[1])].map(|(depth, y)| {
                    // Each end of the interval, as it is rounded.
                    (error(depth - m.width, y) / m.width + 1.0)
                        .max(1.0 - error(depth + m.width, y) / m.width)
                });
                ends[0].max(ends[1])
            };
            margins.into_iter().filter(|m| q > m.solid).map(ratio).reduce(f64::max)
        });
    }
}

/// How far the difference of two spheres that all but coincide is off, over its bound.
struct Apart<'a> {
    pair: &'a Pair,
    wall: Root,
    at: [f64; 2],
}

impl tile::Work for Apart<'_> {
    type Output = Option<[f64; 2]>;

    fn run<L: Lanes, const PERSPECTIVE: bool>(self) -> Option<[f64; 2]> {
        let [sx, sy] = self.at;
        let apart = self.pair.apart::<L, PERSPECTIVE>(self.wall, L::splat(sx), sy);
        let mut all = [0.0; LANES];
        apart.difference.store(&mut all);
        assert!(all.iter().all(|one| one.to_bits() == all[0].to_bits()), "{all:?}");
        (apart.solid == u8::MAX).then_some([all[0], apart.bound])
    }
}

/// `E` of two spheres that all but coincide: their order is told from `F = (y_1 - y_2) S`.
#[test]
fn pairs() {
    for projection in BOTH {
        for (k, wall) in [Root::Near, Root::Far].into_iter().enumerate() {
            // As for `W`: where hits begin to be solid, roots are least certain.
            let rays = |random: &mut Random| {
                if random.unit() < 0.5 { silhouette(random) } else { outermost(random) }
            };
            climb("pairs", projection, 18 + k as u64, rays, |stage, input, e| {
                // The other differs in a way that depends on the input alone.
                let Input { center, radius, column, row } = input;
                let mut random = Random::new(center.x.to_bits() ^ radius.to_bits());
                let by = radius * random.power(-10.0, -1.2);
                let along = if random.unit() < 0.9 {
                    stage.view.ray(column, row).direction.normalize()
                } else {
                    random.ball()
                };
                let rho = if random.unit() < 0.5 { 0.0 } else { by * random.between(-1.0, 1.0) };
                let other = Input { center: center + by * along, radius: radius + rho, ..input };
                let balls =
                    [input, other].map(|input| Ball { center: input.center, radius: input.radius });
                let pair = match projection {
                    Projection::Orthographic => {
                        Pair::new::<false>(balls[0], balls[1], &stage.projector)
                    }
                    Projection::Perspective => {
                        Pair::new::<true>(balls[0], balls[1], &stage.projector)
                    }
                }?;
                let at =
                    [stage.projector.columns[column as usize], stage.projector.rows[row as usize]];
                let [difference, bound] =
                    tile::dispatch(projection, Apart { pair: &pair, wall, at })?;
                let o = stage.exact(other);
                let (root, other_root) = (e.q.sqrt(), o.q.sqrt());
                // The difference of the middles by that of the centres: of the middles themselves
                // 100 bits tell less.
                let delta = [0, 1, 2].map(|k| Bounded::difference(center[k], other.center[k]));
                let [x, y, z] = stage
                    .axes
                    .map(|axis| delta[0] * axis[0] + delta[1] * axis[1] + delta[2] * axis[2]);
                let along = if stage.perspective { x * e.sx + y * e.sy + z } else { z };
                let apart = match wall {
                    Root::Near => along - (root - other_root),
                    Root::Far => along + (root - other_root),
                };
                Some(error(difference, apart * (root + other_root)).abs() / bound)
            });
        }
    }
}

/// A hit that is not solid begins no nearer than `b - rim`; vague spheres too.
#[test]
fn rim() {
    for projection in BOTH {
        let ratio = |which: usize, vague: bool| {
            move |stage: &Stage, input: Input, e: &Exact| {
                let (margins, q, b) = meet(stage, input);
                let m = margins[which];
                if q > m.solid || (m.doubt == f64::INFINITY) != vague || e.q.value() < 0.0 {
                    return None;
                }
                // As it is rounded: 1 where it touches the depth.
                Some(1.0 + error(b - m.rim, e.b - e.q.sqrt()) / m.rim)
            }
        };
        // Near the silhouette, where hits are not solid.
        let rim = |random: &mut Random| {
            let radius = random.power(-6.0, 0.0);
            [radius * random.power(8.0, 12.0), radius, radius * random.between(0.99, 1.0)]
        };
        climb("rim", projection, 6, rim, ratio(0, false));
        climb("sharp rim", projection, 17, rim, ratio(1, false));
        // So far away that nothing is certain.
        let vague = |random: &mut Random| {
            let radius = random.power(-9.0, -6.0);
            [radius * random.power(14.0, 17.0), radius, radius * random.unit()]
        };
        climb("rim of vague spheres", projection, 7, vague, ratio(0, true));
    }
}

/// How near a sphere may be at a pixel, as spheres are dropped by where one pixel is to be decided.
struct Front<'a> {
    place: Place<'a, LANES>,
    sphere: Projected,
    at: [usize; 2],
}

impl tile::Work for Front<'_> {
    type Output = f64;

    fn run<L: Lanes, const PERSPECTIVE: bool>(self) -> f64 {
        let Projected { x, y, z, r } = self.sphere;
        let mut fronts = [0.0; LANES];
        Tile::front::<L, PERSPECTIVE>(&self.place, [x, y, z, r].map(L::splat), 0, self.at)
            .store(&mut fronts);
        assert!(fronts.iter().all(|front| front.to_bits() == fronts[0].to_bits()), "{fronts:?}");
        fronts[0]
    }
}

/// No hit begins before its sphere's front, and what is said to be missed is.
#[test]
fn fronts() {
    for projection in BOTH {
        // Silhouettes, and about where hits begin to be solid: there depths are least certain.
        let rays = |random: &mut Random| {
            if random.unit() < 0.5 {
                return outermost(random);
            }
            let (radius, chord) = (random.power(-9.0, 3.0), random.power(-2.6, -2.3));
            [radius * random.power(0.0, 8.0), radius, radius * (1.0 - chord * chord).sqrt()]
        };
        let ratio = |solid: bool| {
            move |stage: &Stage, input: Input, e: &Exact| {
                // Bounds that spheres share are those of the farthest.
                let Input { center, radius, column, row } = input;
                let scene =
                    Scene::from_spheres(&[Sphere { center, radius, color: [0; 3] }]).ok()?;
                let truth = Truth::new(&stage.view, scene.bounds());
                let projector = Projector::new(&truth, Region::whole(stage.view.image));
                let sphere = projector.project(center, radius);
                let margins = Margins::shared(sphere.r, &projector.screen);
                if truth.scale() != 1.0 || sphere.r < projector.screen.plain || e.q.value() < 0.0 {
                    return None;
                }
                let [column, row] = [column, row].map(|at| at as usize);
                let corner = [column, row].map(|at| at / LANES * LANES);
                let place = Place::new(&scene, &truth, &projector, corner);
                let front = tile::dispatch(
                    projection,
                    Front { place, sphere, at: [column - corner[0], row - corner[1]] },
                );
                assert!(front < f64::INFINITY, "a hit is said to be missed: {input:?}");
                let near = e.b - e.q.sqrt();
                // By so much a hit may begin before its sphere's front as it is computed: `W`, and
                // near the silhouette the rim.
                let bound = if solid { margins.width } else { margins.rim };
                (solid == (e.q.value() > margins.solid)).then(|| 1.0 + error(front, near) / bound)
            }
        };
        // The bounds that spheres share are of the farthest anywhere on the screen, and not as
        // sharp as their own.
        let worst = largest("fronts", projection, 18, rays, ratio(true));
        assert!(
            worst > LEAST / 2.0,
            "fronts, {projection:?}: the largest error is {worst} of the bound (seed 18): too loose"
        );
        climb("fronts near silhouettes", projection, 19, rays, ratio(false));
    }
}

/// Depths times `a`, and back.
#[test]
fn depths_of_the_screen() {
    climb("a plane's depth", Projection::Perspective, 8, wide(1.0, 10.0), |stage, input, e| {
        let (sx, sy) = (
            stage.projector.columns[input.column as usize],
            stage.projector.rows[input.row as usize],
        );
        let plane = input.radius;
        let y = plane * length(sx, sy);
        let low = -error(y * (1.0 - PLANE), exact(plane) * e.a);
        let high = error(y * (1.0 + PLANE), exact(plane) * e.a);
        Some(1.0 - low.min(high) / (y * PLANE))
    });
    climb("y back to t", Projection::Perspective, 9, wide(1.0, 10.0), |stage, input, e| {
        let (sx, sy) = (
            stage.projector.columns[input.column as usize],
            stage.projector.rows[input.row as usize],
        );
        let y = input.radius;
        // As in `Tile::freshen`.
        let depth = y / length(sx, sy);
        let t = depth + depth.abs() * BACK;
        // t >= y / a, times a.
        Some(1.0 - (exact(t) * e.a - exact(y)).value() / (y * BACK))
    });
}

/// Tangents through the eye.
#[test]
fn tangents() {
    let mut random = Random::new(10);
    let mut worst = [0.0f64; 2];
    for _ in 0..400_000 {
        let z = random.power(-3.0, 3.0);
        let r = z * random.power(-6.0, 0.0).min(1.0 - random.power(-12.0, -0.1));
        let x = random.power(-3.0, 3.0) * if random.bits() & 1 == 0 { 1.0 } else { -1.0 };
        if !(z > r) {
            continue;
        }
        let [low, high] = slopes(x, z, r);
        let (bx, bz, br) = (exact(x), exact(z), exact(r));
        let square = (bz - br) * (bz + br);
        let across = br * (bx.square() + square).sqrt();
        // Both sides times z^2 - r^2.
        let size = SLOPE * ((x * z).abs() + across.value());
        let ratios = [
            1.0 + (exact(low) * square - (bx * bz - across)).value() / size,
            1.0 - (exact(high) * square - (bx * bz + across)).value() / size,
        ];
        for (worst, ratio) in worst.iter_mut().zip(ratios) {
            assert!(
                ratio <= 1.0,
                "tangent of {x:e} {z:e} {r:e}: {ratio} times the bound (seed 10)"
            );
            *worst = worst.max(ratio);
        }
    }
    println!("tangents: {worst:.3?} of the bound");
    assert!(worst.iter().all(|&w| w > LEAST), "{worst:?}");
}

/// Sides of footprints hold the sphere's, each within its widening.
#[test]
fn footprints() {
    let sides = |stage: &Stage, input: Input, e: &Exact| {
        let s = projected(stage, input);
        let [x, y] = match stage.perspective {
            true => stage.projector.extent::<true>(&s),
            false => stage.projector.extent::<false>(&s),
        };
        let View { pitch_x, pitch_y, image, .. } = stage.view;
        // From pixels to lengths.
        let screen = |at: f64, count: u32, length: f64, divisor: u32| {
            (exact(at) - exact(0.5 * (f64::from(count) - 1.0)))
                * Bounded::ratio(1.0, length, divisor.into())
        };
        let column = |at: f64| screen(at, image.width, pitch_x.length, pitch_x.divisor);
        let row = |at: f64| -screen(at, image.height, pitch_y.length, pitch_y.divisor);
        let widening = [pitch_x, pitch_y].map(|p| REACH * s.bound() + MARGIN * p.to_f64());
        // How far each side lies outside the sphere's.
        [
            ((column(x[0]), -1.0, e.x, x[0]), widening[0]),
            ((column(x[1]), 1.0, e.x, x[1]), widening[0]),
            ((row(y[0]), 1.0, e.y, y[0]), widening[1]),
            ((row(y[1]), -1.0, e.y, y[1]), widening[1]),
        ]
    };
    let seen = |at: f64| (-1.0..32768.0).contains(&at);
    climb("footprint", Projection::Orthographic, 11, wide(2.0, 10.0), |stage, input, e| {
        let mut worst = None;
        for ((side, sign, middle, at), widening) in sides(stage, input, e) {
            if seen(at) {
                let outside = exact(sign) * (side - (middle + exact(sign) * e.r));
                let ratio = 1.0 - outside.value() / widening;
                worst = Some(ratio.max(worst.unwrap_or(0.0)));
            }
        }
        worst
    });
    // Perspective: the lines through the sides pass the sphere. Its own error is in `tangents`.
    climb("footprint", Projection::Perspective, 12, wide(2.0, 10.0), |stage, input, e| {
        let mut worst = None;
        let pitch = stage.view.pitch_x.to_f64();
        for ((slope, sign, middle, at), _) in sides(stage, input, e) {
            if seen(at) {
                let length = (exact(1.0) + slope.square()).sqrt();
                let outside = exact(sign) * (slope * e.z - middle) - e.r * length;
                // The widening of the sphere, and that in pixels at the depth of the middle.
                let widening = length.value() * REACH * projected(stage, input).bound()
                    + MARGIN * pitch * e.z.value();
                let ratio = 1.0 - outside.value() / widening;
                worst = Some(ratio.max(worst.unwrap_or(0.0)));
            }
        }
        worst
    });
    // Pixels whose place rounds: large pictures, small spheres about the camera's axis.
    let mut random = Random::new(13);
    let mut worst = 0.0f64;
    for _ in 0..200 {
        let mut camera = Camera::orthographic(DVec3::ZERO, DVec3::X);
        camera.size = ScreenSize::Width(random.between(1.0, 2.0));
        let stage = Stage::new(camera, ImageSize { width: 32768, height: 1 });
        for _ in 0..1000 {
            let center = DVec3::new(0.0, random.between(-1.0, 1.0), 0.0) * 1e-3;
            let input = Input { center, radius: random.between(1e-5, 1e-3), column: 0, row: 0 };
            let e = stage.exact(input);
            for ((side, sign, middle, at), widening) in &sides(&stage, input, &e)[..2] {
                let outside = exact(*sign) * (*side - (*middle + exact(*sign) * e.r));
                let ratio = 1.0 - outside.value() / widening;
                assert!(
                    ratio <= 1.0,
                    "footprint in a large picture: {ratio} at {at}, {input:?} (seed 13)"
                );
                worst = worst.max(ratio);
            }
        }
    }
    println!("footprint in a large picture: {worst:.3} of the bound");
    assert!(worst > LEAST, "{worst}");
}

/// A tile is left out for a sphere only if it lies outside the disc.
#[test]
fn misses() {
    let mut random = Random::new(14);
    let mut worst = 0.0f64;
    for stage in stages(&mut random, Projection::Orthographic) {
        let scene =
            Scene::from_spheres(&[Sphere { center: DVec3::ONE, radius: 1.0, color: [0; 3] }])
                .expect("a scene");
        let binner = Binner::new(&scene, &stage.truth, Region::whole(stage.view.image), 4);
        for _ in 0..4000 {
            let radius = random.power(-9.0, 1.0);
            let depth = radius * random.power(-2.0, 10.0);
            let apart = radius * random.between(0.0, 3.0);
            let mut input = stage.near_ray(&mut random, [depth, radius, apart]);
            let (column, row) = (input.column >> 4, input.row >> 4);
            // The greatest radius at which the tile is left out.
            let misses = |radius: f64| {
                let s = projected(&stage, Input { radius, ..input });
                binner.misses(&s, column as i32, row as i32)
            };
            if !misses(1e-300) {
                continue;
            }
            let (mut low, mut high) = (1e-300f64.to_bits(), 1e300f64.to_bits());
            while high - low > 1 {
                let middle = low + (high - low) / 2;
                if misses(f64::from_bits(middle)) { low = middle } else { high = middle }
            }
            input.radius = f64::from_bits(low);
            // The exact distance of the tile's nearest sample.
            let apart = |k: usize, first: u32, count: u32| {
                let last = (first * 16 + 15).min(count - 1);
                [first * 16, last].map(|at| {
                    let e = stage.exact(if k == 0 {
                        Input { column: at, ..input }
                    } else {
                        Input { row: at, ..input }
                    });
                    if k == 0 { e.sx - e.x } else { e.sy - e.y }
                })
            };
            let nearest = |[first, last]: [Bounded; 2]| {
                if first.value() * last.value() <= 0.0 {
                    Bounded::ZERO
                } else if first.value().abs() < last.value().abs() {
                    first
                } else {
                    last
                }
            };
            let dx = nearest(apart(0, column, stage.view.image.width));
            let dy = nearest(apart(1, row, stage.view.image.height));
            let distance = (dx.square() + dy.square()).sqrt();
            let room = APART * projected(&stage, input).bound();
            let ratio = 1.0 - (distance - exact(input.radius)).value() / room;
            assert!(
                ratio <= 1.0,
                "tile {column} {row}: {ratio} times the bound (seed 14) at {input:?}"
            );
            worst = worst.max(ratio);
        }
    }
    println!("misses: {worst:.3} of the bound");
    assert!(worst > LEAST, "{worst}");
}

/// Nothing in a slab begins before its start.
#[test]
fn slabs() {
    let mut random = Random::new(15);
    let mut worst = 0.0f64;
    for _ in 0..40 {
        // Many spheres, so that there are many slabs.
        let (near, deep) = (random.power(-3.0, 3.0), random.power(-3.0, 3.0));
        let spheres: Vec<Sphere> = (0..16_384)
            .map(|k| {
                let center = DVec3::new(near + deep * f64::from(k) / 16_384.0, 0.0, 0.0);
                Sphere { center, radius: deep * 1e-3, color: [0; 3] }
            })
            .collect();
        let scene = Scene::from_spheres(&spheres).expect("a scene");
        let view = View::new(
            Camera::orthographic(DVec3::ZERO, DVec3::X),
            ImageSize { width: 64, height: 64 },
        );
        let truth = Truth::new(&view, scene.bounds());
        let grid = Binner::new(&scene, &truth, Region::whole(view.image), 5).grid;
        assert!(grid.slabs > 8);
        for slab in 1..grid.slabs {
            // The least depth that goes there; all are positive here.
            let (mut low, mut high) = (0u64, f64::MAX.to_bits());
            while high - low > 1 {
                let middle = low + (high - low) / 2;
                if grid.slab(f64::from_bits(middle)) < slab { low = middle } else { high = middle }
            }
            let least = f64::from_bits(high);
            let start = grid.slab_start(slab);
            assert!(
                start <= least,
                "slab {slab} of {grid:?} starts at {start:e}, after {least:e} (seed 15)"
            );
            // As in `slab_start`.
            let margin = EDGE * (start - grid.start + start);
            worst = worst.max(1.0 - (least - start) / margin);
        }
    }
    println!("slabs: {worst:.3} of the bound");
    assert!(worst > LEAST, "{worst}");
}
