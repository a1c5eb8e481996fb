//! Exact numbers of a sphere and a pixel, in 100 bits, and inputs to look for large errors at.

use glam::DVec3;
use planisphere_core::{
    axes::Axis,
    camera::{Camera, ImageSize, Projection, Region, ScreenSize, View},
    exact::{dd::Bounded, decide::Truth},
    project::Projector,
    scene::{Scene, Sphere},
};

use super::Random;

/// The ratio that a bound has to reach.
pub const LEAST: f64 = 1.0 / 8.0;

/// A f64 as it is.
pub fn exact(value: f64) -> Bounded {
    Bounded::exact(value)
}

/// A computed number less the exact one.
pub fn error(computed: f64, truth: Bounded) -> f64 {
    (exact(computed) - truth).value()
}

/// A camera and what the filter makes of it.
pub struct Stage {
    pub view: View,
    pub truth: Truth,
    pub projector: Projector,
    pub axes: [[Bounded; 3]; 3],
    pub perspective: bool,
}

/// An input of the search: a sphere and a pixel.
#[derive(Clone, Copy, Debug)]
pub struct Input {
    pub center: DVec3,
    pub radius: f64,
    pub column: u32,
    pub row: u32,
}

/// The exact numbers of an input.
pub struct Exact {
    pub x: Bounded,
    pub y: Bounded,
    pub z: Bounded,
    pub r: Bounded,
    pub sx: Bounded,
    pub sy: Bounded,
    pub a: Bounded,
    pub q: Bounded,
    pub b: Bounded,
}

impl Stage {
    /// For a checked camera.
    pub fn new(camera: Camera, image: ImageSize) -> Self {
        camera.check().expect("a camera");
        let view = View::new(camera, image);
        // Bounds that need no scaling.
        let ball = Sphere { center: DVec3::ONE, radius: 1.0, color: [0; 3] };
        let truth = Truth::new(&view, Scene::from_spheres(&[ball]).expect("a scene").bounds());
        assert_eq!(truth.scale(), 1.0);
        let mut projector = Projector::new(&truth, Region::whole(image));
        // Every sphere's own bounds; the short cut for most is compared with them where it is made.
        projector.screen.plain = f64::INFINITY;
        let pairs =
            |axis: Axis| [0, 1, 2].map(|k| Bounded::pair(axis.high[k], axis.low[k], Axis::ERROR));
        let axes = truth.axes();
        let axes = [axes.right, axes.up, axes.forward].map(pairs);
        Self {
            view,
            truth,
            projector,
            axes,
            perspective: camera.projection == Projection::Perspective,
        }
    }

    /// The exact numbers of an input.
    pub fn exact(&self, input: Input) -> Exact {
        let origin = self.view.camera.origin;
        let f = [0, 1, 2].map(|k| Bounded::difference(input.center[k], origin[k]));
        let [x, y, z] = self.axes.map(|axis| f[0] * axis[0] + f[1] * axis[1] + f[2] * axis[2]);
        let sample = |odd: i32, length: f64, divisor: u32| {
            Bounded::ratio(odd.into(), length, 2.0 * f64::from(divisor))
        };
        let View { pitch_x, pitch_y, .. } = self.view;
        let sx = sample(self.view.odd_x(input.column), pitch_x.length, pitch_x.divisor);
        let sy = sample(self.view.odd_y(input.row), pitch_y.length, pitch_y.divisor);
        let r = exact(input.radius);
        let (a, q, b);
        if self.perspective {
            a = exact(1.0) + sx.square() + sy.square();
            let (n, m) = (z * sx - x, y - z * sy);
            let k = n * sy + m * sx;
            (q, b) = (a * r.square() - (n.square() + m.square() + k.square()), x * sx + y * sy + z);
        } else {
            a = exact(1.0);
            (q, b) = (r.square() - (sx - x).square() - (sy - y).square(), z);
        }
        Exact { x, y, z, r, sx, sy, a, q, b }
    }

    /// A sphere whose middle is so far from a pixel's ray, at about this depth.
    pub fn near_ray(&self, random: &mut Random, [depth, radius, apart]: [f64; 3]) -> Input {
        let column = random.below(self.view.image.width.into()) as u32;
        let row = random.below(self.view.image.height.into()) as u32;
        let ray = self.view.ray(column, row);
        let off = ray.direction.cross(random.ball()).normalize() * apart;
        Input { center: ray.origin + depth * ray.direction + off, radius, column, row }
    }
}

/// Cameras on rational and on irrational axes, at the origin and far from it, with a narrow and a
/// wide view.
pub fn stages(random: &mut Random, projection: Projection) -> Vec<Stage> {
    let views = [
        DVec3::X,
        DVec3::new(3.0, 4.0, 0.0),
        DVec3::new(1.0, 1.3, -0.7),
        DVec3::new(-1.0, 2.0, 3.0),
    ];
    let mut stages = Vec::new();
    for view in views {
        for (origin, reach) in [(0.0, 0.3), (10.0, 3.0), (1e3, 30.0)] {
            let mut camera = Camera::orthographic(random.ball() * origin, view);
            camera.projection = projection;
            // Of a perspective camera: opening angles of 1 to 90 degrees each way.
            let side = if projection == Projection::Perspective {
                [0.02, 0.5, 2.0][stages.len() % 3]
            } else {
                reach
            };
            camera.size = ScreenSize::Both { width: side * random.between(0.5, 1.0), height: side };
            stages.push(Stage::new(camera, ImageSize { width: 97, height: 61 }));
        }
    }
    stages
}

/// A neighbour of an input: one number moved by a random part of itself, or another pixel.
pub fn neighbour(random: &mut Random, stage: &Stage, input: Input) -> Input {
    let mut next = input;
    let nudge = |random: &mut Random, value: f64| {
        let bits = random.below(53) as i32;
        value + value * random.between(-1.0, 1.0) * 2f64.powi(-bits)
    };
    for _ in 0..=random.below(2) {
        match random.below(8) {
            k @ 0..3 => next.center[k as usize] = nudge(random, next.center[k as usize]),
            3 => next.radius = nudge(random, next.radius).abs().max(1e-30),
            4 => {
                let step = random.ball() * next.radius * 2f64.powi(-(random.below(20) as i32));
                next.center += step;
            }
            5 => next.column = random.below(stage.view.image.width.into()) as u32,
            6 => next.row = random.below(stage.view.image.height.into()) as u32,
            _ => {
                let step = stage.view.ray(next.column, next.row).direction * next.radius;
                next.center += step * random.between(-2.0, 2.0);
            }
        }
    }
    if random.bits() & 1 == 0 {
        // The ray at the silhouette, as it may have been before.
        let ray = stage.view.ray(next.column, next.row);
        let apart = (next.center - ray.origin).reject_from(ray.direction).length();
        next.radius = (apart * (1.0 + random.power(-6.0, -2.0))).max(1e-30);
    }
    next
}
