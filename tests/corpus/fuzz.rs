//! Any number of scenes, one for each seed: mixtures of what makes scenes hard, with any camera.

use glam::DVec3;
use planisphere_core::{
    camera::{Camera, Projection, ScreenSize, View},
    scene::Sphere,
};

use super::{Case, ball, pixels, random::Random, scene, two_to};

/// How the numbers of a scene are drawn.
#[derive(Clone, Copy)]
enum Numbers {
    /// Any between -1 and 1, times a size.
    Any(f64),
    /// Whole numbers of so many on each side, times a unit.
    Whole(i64, f64),
    /// As f32, times a size.
    Short(f64),
    /// Of all sizes.
    Wide,
    /// A few neighbours in f64.
    Neighbours(f64),
}

impl Numbers {
    fn choose(random: &mut Random) -> Self {
        let unit = match random.below(6) {
            0 => 0.1,
            1 => two_to(random.whole(-200, 200) as i32),
            2 => two_to(random.whole(-20, 20) as i32),
            3 => random.power(-6.0, 6.0),
            _ => 1.0,
        };
        match random.below(8) {
            0 | 1 => Self::Any(4.0 * unit),
            2..=4 => Self::Whole(random.whole(1, 12), unit),
            5 => Self::Short(4.0 * unit),
            6 => Self::Wide,
            _ => Self::Neighbours(3.0 * unit),
        }
    }

    fn size(self) -> f64 {
        match self {
            Self::Any(size) | Self::Short(size) | Self::Neighbours(size) => size,
            Self::Whole(most, unit) => most as f64 * unit,
            Self::Wide => 1.0,
        }
    }

    /// A number of this size.
    fn unit(self) -> f64 {
        match self {
            Self::Whole(_, unit) => unit,
            other => other.size(),
        }
    }

    fn one(self, random: &mut Random) -> f64 {
        match self {
            Self::Any(size) => random.between(-1.0, 1.0) * size,
            Self::Whole(most, unit) => random.whole(-most, most) as f64 * unit,
            Self::Short(size) => f64::from((random.between(-1.0, 1.0) as f32) * 0.5) * 2.0 * size,
            Self::Wide => random.between(-1.0, 1.0) * random.power(-6.0, 1.0),
            Self::Neighbours(size) => {
                let x = f64::from_bits(size.to_bits() + random.below(3));
                if random.below(2) == 0 { x } else { -x }
            }
        }
    }

    fn point(self, random: &mut Random) -> DVec3 {
        DVec3::new(self.one(random), self.one(random), self.one(random))
    }
}

/// A direction: along an axis, of small whole numbers, or any.
fn direction(random: &mut Random) -> DVec3 {
    loop {
        let v = match random.below(5) {
            0 => {
                [DVec3::X, DVec3::Y, DVec3::Z][random.below(3) as usize]
                    * [1.0, -1.0][random.below(2) as usize]
            }
            1 | 2 => Numbers::Whole(3, 1.0).point(random),
            3 => Numbers::Whole(4, 0.25).point(random),
            _ => random.ball(),
        };
        if v != DVec3::ZERO {
            return v;
        }
    }
}

/// The greatest power of two that is not above a normal number.
fn power_below(x: f64) -> f64 {
    f64::from_bits(x.to_bits() & (0x7ff << 52))
}

/// The scene of a seed.
pub fn fuzz(seed: u64) -> Case {
    // The seed's own bits are few; spread them.
    let mut random = Random::new(seed.wrapping_mul(0x2545_f491_4f6c_dd1d));
    let random = &mut random;
    let mut numbers = Numbers::choose(random);
    // Half of the scenes are whole numbers of units throughout, camera and samples included: full
    // of ties and tangents.
    let aligned = random.below(2) == 0;
    if aligned {
        numbers = Numbers::Whole(random.whole(1, 8), numbers.unit());
    }
    let size = numbers.size();
    let radii = if !aligned && random.below(3) == 0 { Numbers::choose(random) } else { numbers };
    let shrink = [1.0, 0.5, 0.25][random.below(3) as usize];
    let count = [1, 2, 3, 10, 40, 150][random.below(6) as usize];
    let middle = match random.below(4) {
        0 => Numbers::Whole(1000, numbers.unit()).point(random),
        1 if !aligned => random.ball() * (size * random.power(0.0, 6.0)),
        _ => DVec3::ZERO,
    };
    let mut spheres: Vec<Sphere> = Vec::new();
    while spheres.len() < count {
        let radius = radii.one(random).abs() * (shrink * size / radii.size());
        if !(radius > 0.0 && radius.is_finite()) {
            continue;
        }
        let mut sphere = ball(middle + numbers.point(random), radius);
        if let (0, Some(&other)) = (random.below(12), spheres.last()) {
            // The same again, or one that touches it, or one around the same centre.
            sphere = match random.below(4) {
                0 => other,
                1 => ball(other.center + DVec3::X * (radius + other.radius), radius),
                2 => ball(other.center, radius),
                _ => ball(other.center, other.radius.next_up()),
            };
        }
        spheres.push(sphere);
    }
    let target = spheres[random.below(count as u64) as usize];
    let mut view = direction(random);
    if aligned && random.below(2) == 0 {
        // One of the axes.
        view = DVec3::AXES[random.below(3) as usize] * [1.0, -2.0][random.below(2) as usize];
    }
    let up = loop {
        let up = if random.below(2) == 0 { DVec3::Z } else { direction(random) };
        // Not all of these are parallel in f64 only; leave out what is near.
        if view.cross(up).length_squared() > 1e-9 {
            break up;
        }
    };
    let distance = match random.below(6) {
        0 => 0.0,
        1 => target.radius,
        2 => target.radius.next_up(),
        3 => size * 3.0,
        _ => size * random.power(-1.0, 3.0),
    };
    // Backwards along the view: exactly where it is an axis.
    let mut origin = target.center - view / view.abs().max_element() * distance;
    if random.below(8) == 0 {
        origin = middle + numbers.point(random);
    }
    let projection =
        if random.below(2) == 0 { Projection::Orthographic } else { Projection::Perspective };
    let image = match random.below(8) {
        0 => pixels(1, 1),
        1 => pixels(1, random.whole(1, 60) as u32),
        2 => pixels(random.whole(1, 60) as u32, 1),
        3 => pixels(16, 16),
        4 => pixels(random.whole(1, 40) as u32, random.whole(1, 40) as u32),
        _ => pixels(2 * random.whole(1, 20) as u32 + 1, 2 * random.whole(1, 20) as u32 + 1),
    };
    let reach = match random.below(3) {
        0 => target.radius * 3.0,
        1 => size * random.power(-1.0, 1.0),
        _ => size * 2.0,
    };
    let mut side = |pixels: u32| -> f64 {
        let length = match projection {
            Projection::Orthographic => reach,
            Projection::Perspective => [1.0, 0.25, 0.1, 3.0][random.below(4) as usize],
        };
        // Samples at short numbers, or at any.
        match random.below(3) {
            0 => length,
            1 => power_below(length),
            _ => f64::from(pixels) * power_below(length / f64::from(pixels)),
        }
    };
    let (width, height) = (side(image.width), side(image.height));
    let mut screen = match random.below(4) {
        0 => ScreenSize::Width(width),
        1 => ScreenSize::Height(height),
        _ => ScreenSize::Both { width, height },
    };
    if aligned {
        origin = target.center - view * (random.whole(0, 9) as f64 * numbers.unit());
        let unit = if projection == Projection::Orthographic { numbers.unit() } else { 0.5 };
        let pitch = unit * [1.0, 0.5, 0.25][random.below(3) as usize];
        let tall = [1.0, 1.0, 2.0][random.below(3) as usize];
        screen = ScreenSize::Both {
            width: f64::from(image.width) * pitch,
            height: f64::from(image.height) * pitch * tall,
        };
    }
    let mut camera =
        Camera { projection, origin, view, up, size: screen, near: 0.0, far: f64::INFINITY };
    if random.below(3) == 0 {
        // Planes at surfaces, centres and anywhere.
        let mut plane = || {
            let sphere = spheres[random.below(count as u64) as usize];
            let depth = (sphere.center - origin).dot(view) / view.length();
            match random.below(4) {
                0 => depth,
                1 => depth - sphere.radius,
                2 => depth + sphere.radius,
                _ => depth + sphere.radius * random.between(-1.0, 1.0),
            }
            .abs()
        };
        let (a, b) = (plane(), plane());
        if a != b {
            (camera.near, camera.far) = (a.min(b), a.max(b));
        } else {
            camera.near = a;
        }
        if random.below(2) == 0 {
            camera.far = f64::INFINITY;
        }
    }
    camera.check().unwrap_or_else(|error| panic!("seed {seed}: {error}: {camera:?}"));
    Case {
        name: format!("fuzz, seed {seed}"),
        scene: scene(&spheres),
        view: View::new(camera, image),
    }
}
