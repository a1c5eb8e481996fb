//! The stress corpus: small scenes that have broken renderers, or are made to. Each is the same on
//! every machine: its numbers come from a seed, by integers, `+ - * /` and square roots only.

#[allow(dead_code, reason = "only the tests that judge whole scenes draw these")]
pub mod extreme;
pub mod fuzz;
pub mod random;

use std::ops::Range;

use glam::DVec3;
use planisphere_core::{
    camera::{Camera, ImageSize, Projection, ScreenSize, View},
    scene::{Block, Colors, Radii, Reals, Scene, Sphere},
};
use random::Random;

/// A scene, seen.
#[derive(Clone)]
pub struct Case {
    /// What it is, with the projection and the seed.
    pub name: String,
    /// The spheres.
    pub scene: Scene,
    /// From where, and how large.
    pub view: View,
}

/// The seeds that `PLANISPHERE_SEEDS` asks for, such as `1000..2000`; else the usual ones.
#[allow(dead_code, reason = "only the tests with seeds ask for them")]
pub fn seeds(usual: Range<u64>) -> Range<u64> {
    let Ok(words) = std::env::var("PLANISPHERE_SEEDS") else { return usual };
    words
        .split_once("..")
        .and_then(|(first, end)| Some(first.parse().ok()?..end.parse().ok()?))
        .filter(|seeds| !seeds.is_empty())
        .unwrap_or_else(|| {
            panic!("PLANISPHERE_SEEDS is {words:?}; give a range such as 1000..2000")
        })
}

/// Lengths at which something happens: depths of surfaces along the view, radii, and any.
#[allow(dead_code, reason = "only the tests of looks compare distances with lengths")]
pub fn lengths(case: &Case, random: &mut Random) -> Vec<f64> {
    let camera = &case.view.camera;
    let mut lengths = vec![0.0, camera.near];
    for _ in 0..4 {
        let k = random.below(case.scene.len() as u64) as usize;
        let sphere = case.scene.sphere(k).expect("it is there");
        let depth = (sphere.center - camera.origin).dot(camera.view) / camera.view.length();
        let part = random.between(-1.0, 1.0) * sphere.radius;
        lengths.extend([depth, depth - sphere.radius, depth + part, sphere.radius]);
    }
    lengths.retain(|length| length.is_finite() && *length >= 0.0);
    lengths
}

/// A sphere of some colour.
pub fn ball(center: impl Into<DVec3>, radius: f64) -> Sphere {
    let center = center.into();
    let mix = (center.x.to_bits()
        ^ center.y.to_bits().rotate_left(21)
        ^ center.z.to_bits().rotate_left(42))
    .wrapping_mul(0x9e37_79b9_7f4a_7c15);
    Sphere { center, radius, color: [(mix >> 40) as u8, (mix >> 48) as u8, (mix >> 56) as u8] }
}

/// A scene of single spheres. The corpus holds valid ones only.
pub fn scene(spheres: &[Sphere]) -> Scene {
    Scene::from_spheres(spheres).expect("the corpus holds valid scenes")
}

/// `2^power` for any power that f64 has, the subnormal ones included.
pub fn two_to(power: i32) -> f64 {
    if power >= -1022 {
        f64::from_bits(((1023 + power) as u64) << 52)
    } else {
        f64::from_bits(1 << (1074 + power))
    }
}

/// The two projections, and their names.
pub const BOTH: [(Projection, &str); 2] =
    [(Projection::Orthographic, "orthographic"), (Projection::Perspective, "perspective")];

/// An image size.
pub const fn pixels(width: u32, height: u32) -> ImageSize {
    ImageSize { width, height }
}

/// Looks at a point.
#[derive(Clone, Copy)]
pub struct Look {
    /// What is in the middle of the picture.
    pub at: DVec3,
    /// Along this.
    pub view: DVec3,
    /// From so far.
    pub distance: f64,
    /// Height of what is seen there.
    pub height: f64,
}

impl Look {
    /// The camera.
    pub fn camera(self, projection: Projection) -> Camera {
        let mut camera = Camera::orthographic(
            self.at - self.view * (self.distance / self.view.length()),
            self.view,
        );
        camera.projection = projection;
        camera.size = ScreenSize::Height(match projection {
            Projection::Orthographic => self.height,
            Projection::Perspective => self.height / self.distance,
        });
        camera
    }
}

/// View directions: along an axis, the report's, one with both roots irrational, along a diagonal,
/// and one of no pattern.
pub const VIEWS: [DVec3; 5] = [
    DVec3::X,
    DVec3::new(1.0, -0.5, 0.0),
    DVec3::new(1.0, 2.0, 3.0),
    DVec3::new(-1.0, 1.0, -1.0),
    DVec3::new(-0.7123, 0.33, -0.481),
];

/// Gathers cases.
struct Corpus(Vec<Case>);

impl Corpus {
    fn add(&mut self, name: String, scene: &Scene, camera: Camera, image: ImageSize) {
        camera.check().unwrap_or_else(|error| panic!("{name}: {error}"));
        assert!(self.0.iter().all(|case| case.name != name), "two cases are called {name}");
        self.0.push(Case { name, scene: scene.clone(), view: View::new(camera, image) });
    }

    /// With both projections.
    fn look(&mut self, name: &str, scene: &Scene, look: Look, image: ImageSize) {
        for (projection, word) in BOTH {
            self.add(format!("{name}, {word}"), scene, look.camera(projection), image);
        }
    }

    /// With both projections, looking along +x from `origin`, with whole numbers as sample points
    /// (odd sizes) and any clip planes.
    fn grid(&mut self, name: &str, scene: &Scene, grid: Grid) {
        for (projection, word) in BOTH {
            self.add(format!("{name}, {word}"), scene, grid.camera(projection), grid.image);
        }
    }
}

/// A camera along +x, z up, whose samples are `pitch` apart; those of a perspective camera at a
/// distance of `reach`.
#[derive(Clone, Copy)]
struct Grid {
    origin: DVec3,
    image: ImageSize,
    pitch: f64,
    reach: f64,
    near: f64,
    far: f64,
}

impl Grid {
    fn new(side: u32) -> Self {
        Self {
            origin: DVec3::ZERO,
            image: pixels(side, side),
            pitch: 1.0,
            reach: 4.0,
            near: 0.0,
            far: f64::INFINITY,
        }
    }

    fn camera(self, projection: Projection) -> Camera {
        let mut camera = Camera::orthographic(self.origin, DVec3::X);
        camera.projection = projection;
        let pitch = if projection == Projection::Perspective {
            self.pitch / self.reach
        } else {
            self.pitch
        };
        camera.size = ScreenSize::Both {
            width: pitch * f64::from(self.image.width),
            height: pitch * f64::from(self.image.height),
        };
        (camera.near, camera.far) = (self.near, self.far);
        camera
    }
}

/// The whole corpus.
pub fn corpus() -> Vec<Case> {
    let mut corpus = Corpus(Vec::new());
    distant(&mut corpus);
    offset(&mut corpus);
    huge(&mut corpus);
    coincident(&mut corpus);
    lattices(&mut corpus);
    ties(&mut corpus);
    tangents(&mut corpus);
    planes(&mut corpus);
    inside(&mut corpus);
    scales(&mut corpus);
    cancelling(&mut corpus);
    crowds(&mut corpus);
    shapes(&mut corpus);
    plain(&mut corpus);
    corpus.0
}

/// Small spheres far from the camera.
fn distant(corpus: &mut Corpus) {
    let mut random = Random::new(1);
    let mut spheres = vec![ball(DVec3::ZERO, 1.0)];
    spheres.extend((0..20).map(|_| ball(random.ball() * 1.2, random.between(0.05, 0.6))));
    let spheres = scene(&spheres);
    for distance in [100.0, 1e3, 1e4, 1e6, 1e9] {
        for (k, view) in VIEWS.into_iter().enumerate().skip(1) {
            if k == 1 || k == 4 {
                let look = Look { at: DVec3::ZERO, view, distance, height: 2.6 };
                corpus.look(
                    &format!("unit sphere {distance:e} away, view {k}, seed 1"),
                    &spheres,
                    look,
                    pixels(48, 48),
                );
            }
        }
    }
    // A small sphere, and a ray that passes 0.095 from its centre: hit or miss by 0.005.
    for distance in [400.0, 1e7] {
        for gap in [0.095, 0.1, 0.1f64.next_up(), 0.105] {
            let mut grid = Grid::new(1);
            grid.origin = DVec3::new(-distance, gap, 0.0);
            corpus.grid(
                &format!("radius 0.1, ray {gap} aside from {distance:e}"),
                &scene(&[ball(DVec3::ZERO, 0.1)]),
                grid,
            );
        }
    }
    // A dark ring at the limb: eye 796,800, sphere at 800,000, 4 degrees.
    let look =
        Look { at: DVec3::new(8e5, 0.0, 0.0), view: DVec3::X, distance: 3200.0, height: 223.5 };
    corpus.look(
        "limb at 800,000",
        &scene(&[ball(look.at, 110.0), ball(look.at, 110.001)]),
        look,
        pixels(64, 64),
    );
}

/// Small things far from the origin of the world.
fn offset(corpus: &mut Corpus) {
    let mut random = Random::new(2);
    for (name, at, size, count) in [
        ("1e-3 at 1e6", DVec3::splat(1e6), 1e-3, 200),
        ("1 at 1e3", DVec3::splat(1e3), 1.0, 300),
        ("1e-2 at 6e5", DVec3::new(6e5, -3e5, 1e5), 1e-2, 200),
        ("geographic", DVec3::new(730_200.9, 5_704_681.0, 40.195), 0.1, 200),
        ("1e-7 at 1e9", DVec3::new(1e9, -1e9, 5e8), 2e-7, 60),
    ] {
        let spheres: Vec<_> = (0..count)
            .map(|_| ball(at + random.ball() * (12.0 * size), size * random.between(0.3, 3.0)))
            .collect();
        let look = Look { at, view: VIEWS[4], distance: 40.0 * size, height: 20.0 * size };
        corpus.look(&format!("offset {name}, seed 2"), &scene(&spheres), look, pixels(64, 48));
    }
    // A step between numbers that not even f64 takes without rounding: 2^30 apart, with 53 bits
    // each.
    let spheres: Vec<_> = (0..40)
        .map(|_| {
            ball(
                DVec3::new(
                    random.between(0.5, 1.0),
                    random.between(-1.0, 1.0),
                    random.between(-1.0, 1.0),
                ) * 1e-3,
                2e-4,
            )
        })
        .collect();
    let look = Look { at: DVec3::ZERO, view: VIEWS[2], distance: 1_073_741_827.3, height: 2e-3 };
    corpus.look("tiny, from 2^30 away, seed 2", &scene(&spheres), look, pixels(24, 24));
}

/// Spheres so large that what is seen of them is nearly flat.
fn huge(corpus: &mut Corpus) {
    let mut random = Random::new(3);
    let ground = 6.4e6;
    let mut spheres = vec![
        ball(DVec3::new(0.0, 0.0, -ground), ground),
        ball(DVec3::new(0.0, 0.0, -6.36e6), 6.36e6 + 1.0),
    ];
    spheres.extend((0..60).map(|_| {
        let radius = random.between(0.1, 1.0);
        ball(DVec3::new(random.between(3.0, 60.0), random.between(-20.0, 20.0), radius), radius)
    }));
    for (name, height) in [("above", 2.0), ("inside the air", 0.5), ("on the ground", 0.0)] {
        let mut camera =
            Camera::orthographic(DVec3::new(0.0, 0.0, height), DVec3::new(1.0, 0.01, -0.05));
        camera.size = ScreenSize::Height(20.0);
        corpus.add(
            format!("planet, {name}, orthographic, seed 3"),
            &scene(&spheres),
            camera,
            pixels(64, 48),
        );
        camera.projection = Projection::Perspective;
        camera.size = ScreenSize::Height(0.7);
        corpus.add(
            format!("planet, {name}, perspective, seed 3"),
            &scene(&spheres),
            camera,
            pixels(64, 48),
        );
    }
    // Radius in pixels. All surfaces pass the middle of the picture within a fifth of a pixel, each
    // a little tilted.
    for radius in [1e5, 1e9] {
        for (k, view) in [VIEWS[0], VIEWS[2], VIEWS[4]].into_iter().enumerate() {
            for tilt in [0.02, 1e-6] {
                let spheres: Vec<_> = (0..60)
                    .map(|_| {
                        let normal = (view.normalize() + random.ball() * tilt).normalize();
                        ball(normal * radius + random.ball() * (5.0 * tilt), radius)
                    })
                    .collect();
                let look = Look { at: DVec3::ZERO, view, distance: 1000.0, height: 40.0 };
                let name = format!("radius {radius:e} px, tilted by {tilt:e}, view {k}, seed 3");
                corpus.look(&name, &scene(&spheres), look, pixels(40, 40));
            }
        }
    }
    // Larger than the world, and smaller than a millionth of a pixel, exactly at samples and just
    // beside.
    let mut spheres = vec![ball(DVec3::new(1e12, 0.0, 0.0), 1e12 - 50.0), ball(DVec3::ZERO, 1e15)];
    for k in 0..40 {
        let depth = 1.0 + f64::from(k % 8);
        let (y, z) = (random.whole(-7, 7) as f64, random.whole(-7, 7) as f64);
        let radius = [1e-7, 1e-12, 1e-300, 1e-7][k as usize % 4];
        let aside = if k % 4 == 3 { 1.0000001e-7 } else { 0.0 };
        spheres.push(ball(DVec3::new(depth, y * depth + aside, z * depth), radius));
        spheres.push(ball(DVec3::new(depth + 0.5, y, z + aside), radius));
    }
    corpus.grid(
        "under a millionth of a pixel, seed 3",
        &scene(&spheres),
        Grid { reach: 1.0, ..Grid::new(15) },
    );
}

/// Spheres that all but agree.
fn coincident(corpus: &mut Corpus) {
    let mut random = Random::new(4);
    let spheres: Vec<_> = (0..200).map(|_| ball(random.ball() * 1e-3, 500.0)).collect();
    for (k, view) in VIEWS.into_iter().enumerate().take(3) {
        let side = view.cross(DVec3::Z).normalize();
        for (place, aside, height, side_pixels) in
            [("middle", 0.0, 32.0, 32), ("limb", 490.0, 32.0, 32), ("whole", 0.0, 1100.0, 80)]
        {
            let look = Look { at: side * aside, view, distance: 4000.0, height };
            let name = format!("200 near-coincident, {place}, view {k}, seed 4");
            corpus.look(&name, &scene(&spheres), look, pixels(side_pixels, side_pixels));
        }
    }
    for (name, gap) in [("4e-5", 4e-5), ("2^-50", two_to(-50)), ("2^-52", two_to(-52))] {
        for order in [0, 1] {
            for (k, view) in [VIEWS[0], VIEWS[1], VIEWS[2]].into_iter().enumerate() {
                let center = DVec3::new(0.25, -0.5, 3.0) * f64::from(k as u32);
                let mut shells =
                    vec![ball(center, 1.0), ball(center, 1.0 + gap), ball(center, 1.0 - gap)];
                shells.rotate_left(order);
                let look = Look { at: center, view, distance: 5.0, height: 2.5 };
                corpus.look(
                    &format!("shells 1 and 1 + {name}, order {order}, view {k}"),
                    &scene(&shells),
                    look,
                    pixels(32, 32),
                );
            }
        }
    }
    // Neighbours in f64, in every number, in no order.
    let near = |random: &mut Random, x: f64| f64::from_bits(x.to_bits() + random.below(3));
    let spheres: Vec<_> = (0..100)
        .map(|_| {
            let c = [3.1, 4.7, 5.3].map(|x| near(&mut random, x));
            ball(DVec3::from_array(c), near(&mut random, 0.9))
        })
        .collect();
    for (k, view) in VIEWS.into_iter().enumerate() {
        let look = Look { at: DVec3::new(3.1, 4.7, 5.3), view, distance: 7.0, height: 2.0 };
        corpus.look(
            &format!("neighbours in f64, view {k}, seed 4"),
            &scene(&spheres),
            look,
            pixels(16, 16),
        );
    }
    // Spheres that lie in one another by a few units in the last place, or by little, largest first
    // or last; many times over.
    for (name, gap) in [("1 ulp", two_to(-52)), ("2^-40", two_to(-40)), ("2^-8", two_to(-8))] {
        for (word, sign) in [("growing", 1.0), ("shrinking", -1.0)] {
            let shells: Vec<_> = (0..60)
                .map(|k| ball([0.1 * gap, 0.0, 0.0], 1.0 + sign * gap * f64::from(k / 2 * 2 % 40)))
                .collect();
            let look = Look { at: DVec3::ZERO, view: VIEWS[2], distance: 5.0, height: 2.2 };
            corpus.look(
                &format!("60 in one another, {word} by {name}"),
                &scene(&shells),
                look,
                pixels(48, 48),
            );
        }
    }
    // The same seen from inside, and cut by either plane: inner walls, and a plane through the
    // seam.
    let mut random = Random::new(14);
    for (name, apart) in [("2^-50", two_to(-50)), ("1e-9", 1e-9), ("0.01", 0.01)] {
        let heap: Vec<_> = (0..80)
            .map(|_| ball(random.ball() * apart, 1.0 + random.between(-1.0, 1.0) * apart))
            .collect();
        let heap = scene(&[&heap[..], &heap[..40]].concat());
        for (word, origin, near, far) in [
            ("inside", DVec3::new(0.25, 0.1, -0.125), 0.0, f64::INFINITY),
            ("a near plane", DVec3::new(-2.0, 0.25, 0.0), 1.5, f64::INFINITY),
            ("a near plane through it", DVec3::new(-1.5, 0.1, 0.2), 1.125, 2.25),
            ("a far plane", DVec3::new(-2.0, 0.0, 0.1), 0.5, 1.25),
        ] {
            for (projection, last) in BOTH {
                let mut camera =
                    Grid { origin, near, far, pitch: 0.05, reach: 1.0, ..Grid::new(33) }
                        .camera(projection);
                camera.view = VIEWS[0] + 0.1 * VIEWS[2];
                corpus.add(
                    format!("a heap of 120 within {name}, {word}, {last}, seed 14"),
                    &heap,
                    camera,
                    pixels(33, 33),
                );
            }
        }
    }
    // Apart by the least number of all, which no product leaves as it is, and far larger than that.
    for power in [126, 200, 280] {
        let s = two_to(power);
        let pair = scene(&[ball([s, 0.0, s], s), ball([s, two_to(-1074), s], s)]);
        for (projection, word) in BOTH {
            let mut camera =
                Grid { origin: DVec3::new(s, 0.0, 0.5 * s), ..Grid::new(6) }.camera(projection);
            (camera.view, camera.up) = (DVec3::new(2.0, 0.0, -1.0), DVec3::new(1.0, -1.0, 0.0));
            let size = if projection == Projection::Perspective { 1.0 } else { s };
            camera.size = ScreenSize::Both { width: 0.1 * size, height: 5.0 * size };
            corpus.add(
                format!("apart by 2^-1074 at 2^{power}, {word}"),
                &pair,
                camera,
                pixels(6, 5),
            );
        }
    }
    // Two bundles whose seam is a line in the picture.
    let spheres = [
        ball([-0.3, 0.0, 0.0], 1.0),
        ball([0.3, 0.0, 0.0], 1.0),
        ball([0.0, 0.3, 0.0], 1.0),
        ball([0.0, -0.3, 0.0], 1.0),
    ];
    for (k, view) in
        [DVec3::new(0.0, 1.0, -0.5), DVec3::new(0.0, 1e-3, -1.0)].into_iter().enumerate()
    {
        let look = Look { at: DVec3::ZERO, view, distance: 5.0, height: 2.6 };
        corpus.look(&format!("seams, view {k}"), &scene(&spheres), look, pixels(65, 65));
    }
}

/// Spheres of an FCC lattice of `cells` on each side of the middle, whose nearest neighbours are `2
/// sqrt 2 scale` apart.
fn fcc(cells: i32, scale: f64, radius: f64) -> Vec<Sphere> {
    let side = 2 * cells + 1;
    (0..side.pow(3))
        .map(|k| [k % side - cells, k / side % side - cells, k / side / side - cells])
        .filter(|at| at.iter().sum::<i32>() % 2 == 0)
        .map(|at| ball(DVec3::from_array(at.map(f64::from)) * (2.0 * scale), radius * scale))
        .collect()
}

/// Lattices, on which many pixels are true ties.
fn lattices(corpus: &mut Corpus) {
    let views = [DVec3::X, DVec3::new(0.0, 1.0, 1.0), DVec3::ONE, VIEWS[1], VIEWS[2], VIEWS[4]];
    for (k, view) in views.into_iter().enumerate() {
        // Touching in f64 (as nearly as it can), and overlapping: then whole rows of pixels lie on
        // a seam.
        for (name, scale, radius) in
            [("touching", 1.0, 2f64.sqrt()), ("overlapping", 1.0, 2.0), ("tenths", 0.1, 1.75)]
        {
            let look =
                Look { at: DVec3::ZERO, view, distance: 24.0 * scale, height: 12.25 * scale };
            let name = format!("FCC, {name}, view {k}");
            corpus.look(&name, &scene(&fcc(2, scale, radius)), look, pixels(51, 49));
        }
    }
    // Whole-number spheres under whole-number samples: ties in plenty, tangents too.
    let mut random = Random::new(5);
    for seed in 0..4 {
        let spheres: Vec<_> = (0..[120, 25][seed % 2])
            .map(|_| {
                let c = [random.whole(4, 12), random.whole(-8, 8), random.whole(-8, 8)];
                ball(c.map(|x| x as f64), random.whole(1, 5) as f64)
            })
            .collect();
        // From 0, and from so far that a perspective camera's rays pass whole numbers at depth 16.
        let grid =
            Grid { origin: DVec3::X * -(8.0 * (seed / 2) as f64), reach: 16.0, ..Grid::new(17) };
        corpus.grid(&format!("whole numbers {seed}, seed 5"), &scene(&spheres), grid);
    }
    // The same on turned axes: along (1, 1, 0), across (1, -1, 0) and z, with samples at multiples
    // of sqrt 2 for no f64.
    let turned: Vec<_> = (0..80)
        .map(|_| {
            let (k, j, h) =
                (random.whole(5, 9) as f64, random.whole(-2, 2) as f64, random.whole(-4, 4) as f64);
            ball([k + j, k - j, h], random.whole(1, 3) as f64)
        })
        .collect();
    for (k, view) in [DVec3::new(1.0, 1.0, 0.0), DVec3::new(1.0, 1.0, 1.0)].into_iter().enumerate()
    {
        let look = Look { at: DVec3::new(7.0, 7.0, 0.0), view, distance: 20.0, height: 9.0 };
        corpus.look(
            &format!("turned lattice, view {k}, seed 5"),
            &scene(&turned),
            look,
            pixels(27, 27),
        );
    }
}

/// The same depth on purpose.
fn ties(corpus: &mut Corpus) {
    let mut random = Random::new(6);
    let cloud: Vec<_> =
        (0..150).map(|_| ball(random.ball() * 4.0, random.between(0.2, 1.2))).collect();
    let look = |view| Look { at: DVec3::ZERO, view, distance: 9.0, height: 7.0 };
    // Every sphere twice: in a row, backwards, and in another block as f32.
    let mut backwards = cloud.clone();
    backwards.extend(cloud.iter().rev());
    corpus.look("every sphere twice, seed 6", &scene(&backwards), look(VIEWS[4]), pixels(48, 48));
    let short: Vec<_> = cloud
        .iter()
        .map(|s| ball(s.center.as_vec3().as_dvec3(), f64::from(s.radius as f32)))
        .collect();
    let f32s = |f: &dyn Fn(&Sphere) -> Vec<f32>| short.iter().rev().flat_map(f).collect::<Vec<_>>();
    let blocks = vec![
        Block::from_spheres(&short[..70]),
        Block {
            centers: Reals::F32(f32s(&|s| s.center.as_vec3().to_array().to_vec()).into()),
            radii: Radii::Each(Reals::F32(f32s(&|s| vec![s.radius as f32]).into())),
            colors: Colors::Same([200, 100, 50]),
        },
        Block::from_spheres(&[]),
        Block::from_spheres(&short[60..]),
    ];
    let blocks = Scene::new(blocks).expect("valid blocks");
    for (k, view) in VIEWS.into_iter().enumerate() {
        corpus.look(
            &format!("twice in other blocks, view {k}, seed 6"),
            &blocks,
            look(view),
            pixels(32, 32),
        );
    }
    // Mirror images about the plane that holds the view direction: ties along the middle column.
    for (k, view) in VIEWS.into_iter().enumerate().take(4) {
        let across = view.cross(DVec3::Z);
        let mut spheres = Vec::new();
        for _ in 0..40 {
            let (a, b, c) = (
                random.whole(2, 5) as f64,
                random.whole(0, 4) as f64 / 4.0,
                random.whole(-8, 8) as f64 / 4.0,
            );
            let radius = random.whole(4, 12) as f64 / 4.0;
            for side in [b, -b] {
                spheres.push(ball(view * (a * 2.0) + across * side + DVec3::Z * c, radius));
            }
        }
        let mut camera = Camera::orthographic(DVec3::ZERO, view);
        camera.size = ScreenSize::Width(7.0);
        corpus.add(
            format!("mirrored pairs, view {k}, orthographic, seed 6"),
            &scene(&spheres),
            camera,
            pixels(21, 32),
        );
        camera.projection = Projection::Perspective;
        camera.size = ScreenSize::Width(0.9);
        corpus.add(
            format!("mirrored pairs, view {k}, perspective, seed 6"),
            &scene(&spheres),
            camera,
            pixels(21, 32),
        );
    }
    // The front of different spheres at one depth: c - r the same, on the axis of a sample.
    let mut spheres = Vec::new();
    for k in 1..12 {
        for (y, z) in [(0.0, 0.0), (2.0, 1.0), (-3.0, 2.0)] {
            let r = f64::from(12 - k) / 4.0;
            spheres.push(ball([5.0 + r, y, z], r));
        }
    }
    let mut grid = Grid::new(9);
    grid.pitch = 1.0;
    corpus.grid("fronts at one depth", &scene(&spheres), grid);
    // Two spheres that touch in a point that a sample's ray passes, side by side and one behind the
    // other.
    for (name, axis) in [
        ("beside", DVec3::Y),
        ("above", DVec3::Z),
        ("behind", DVec3::X),
        ("askew", DVec3::new(0.6, 0.8, 0.0)),
    ] {
        for radius in [1.0, 2.0] {
            let at = DVec3::new(8.0, 0.0, 0.0);
            let spheres = [ball(at + axis * radius, radius), ball(at - axis * radius, radius)];
            corpus.grid(
                &format!("touching {name}, radius {radius}"),
                &scene(&spheres),
                Grid::new(5),
            );
            corpus.grid(
                &format!("touching {name}, radius {radius}, swapped"),
                &scene(&[spheres[1], spheres[0]]),
                Grid::new(5),
            );
        }
    }
}

/// A ray touches a sphere, or passes by one unit in the last place.
fn tangents(corpus: &mut Corpus) {
    let triples = [(3, 4, 5), (5, 12, 13), (8, 15, 17), (7, 24, 25), (20, 21, 29), (0, 9, 9)];
    for power in [0, -30, 30, 100, -100, 63, -75] {
        let scale = two_to(power);
        for (name, step) in [("touched", 0i64), ("one unit in", 1), ("one unit out", -1)] {
            let mut spheres = Vec::new();
            for (k, &(a, b, c)) in triples.iter().enumerate() {
                for (sy, sz) in [(a, b), (b, -a), (-a, b)] {
                    // The sample (0, 0) touches it; others may as well. Each has a depth of its
                    // own.
                    let center =
                        DVec3::new(100.0 + 64.0 * k as f64, f64::from(sy), f64::from(sz)) * scale;
                    let radius =
                        f64::from_bits((f64::from(c) * scale).to_bits().wrapping_add_signed(step));
                    spheres.push(ball(center, radius));
                }
            }
            let mut camera =
                Grid { pitch: scale, ..Grid::new(11) }.camera(Projection::Orthographic);
            corpus.add(
                format!("triples times 2^{power}, {name}, orthographic"),
                &scene(&spheres),
                camera,
                pixels(11, 11),
            );
            // The middle ray of a perspective camera touches the same spheres.
            camera = Grid { pitch: 0.25, ..Grid::new(11) }.camera(Projection::Perspective);
            corpus.add(
                format!("triples times 2^{power}, {name}, perspective"),
                &scene(&spheres),
                camera,
                pixels(11, 11),
            );
        }
    }
    // Other rays of a perspective camera: p of whole length, perpendicular to the ray (1, 0, 1) or
    // (0, 1, 1).
    for (name, step) in [("touched", 0i64), ("one unit in", 1), ("one unit out", -1)] {
        let mut spheres = Vec::new();
        for (k, p) in
            [[2, 1, -2], [-2, 1, 2], [6, 7, -6], [4, 7, -4], [12, 1, -12]].into_iter().enumerate()
        {
            let whole = p.iter().map(|x| x * x).sum::<i32>();
            let radius =
                f64::from_bits(f64::from(whole).sqrt().to_bits().wrapping_add_signed(step));
            let far = 20 + 8 * k as i32;
            // (right, up, forward) is (-y, z, x).
            let [a, b, c] = [p[0] + far, p[1], p[2] + far].map(f64::from);
            spheres.push(ball([c, -a, b], radius));
            spheres.push(ball([c, -b, a], radius));
        }
        let camera = Grid { reach: 1.0, ..Grid::new(5) }.camera(Projection::Perspective);
        corpus.add(
            format!("oblique rays {name}, perspective"),
            &scene(&spheres),
            camera,
            pixels(5, 5),
        );
    }
    // On irrational axes: the view direction is perpendicular to a vector of whole length.
    for (name, step) in [("touched", 0i64), ("one unit in", 1), ("one unit out", -1)] {
        for (d, p) in [
            ([4.0, -1.0, -1.0], [1.0, 2.0, 2.0]),
            ([1.0, -0.5, 0.0], [-1.0, -2.0, 2.0]),
            ([-3.0, 4.0, -1.0], [2.0, 3.0, 6.0]),
        ] {
            let (d, p) = (DVec3::from_array(d), DVec3::from_array(p));
            let radius =
                f64::from_bits(p.length_squared().sqrt().to_bits().wrapping_add_signed(step));
            let spheres: Vec<_> = [20.0, 24.0, 32.0]
                .into_iter()
                .flat_map(|k| [ball(d * k + p, radius), ball(d * k - p, radius)])
                .collect();
            for (projection, word) in BOTH {
                let mut camera = Grid::new(3).camera(projection);
                camera.view = d;
                corpus.add(
                    format!("irrational axes {d}, {name}, {word}"),
                    &scene(&spheres),
                    camera,
                    pixels(3, 3),
                );
            }
        }
    }
}

/// Clip planes that touch, cut and end.
fn planes(corpus: &mut Corpus) {
    let spheres = scene(&[
        ball([6.0, 0.0, 0.0], 3.0),
        ball([6.5, 1.0, 1.0], 2.5),
        ball([9.0, -2.0, 0.0], 1.0),
        ball([20.0, 0.0, 0.0], 8.0),
    ]);
    let step = |x: f64, by: i64| f64::from_bits(x.to_bits().wrapping_add_signed(by));
    for (name, near, far) in [
        ("near touches a front", 3.0, f64::INFINITY),
        ("near touches a back", 9.0, f64::INFINITY),
        ("near through a centre", 6.0, 20.0),
        ("far touches a front", 0.0, 3.0),
        ("far touches a back", 4.0, 9.0),
        ("far through a centre", 0.0, 6.0),
        ("a thin slice", 6.0, step(6.0, 1)),
    ] {
        for by in [-1, 0, 1] {
            let near = if near > 0.0 { step(near, by) } else { near };
            let far = if far.is_finite() { step(far, by) } else { far };
            let grid = Grid { near, far, pitch: 0.5, ..Grid::new(21) };
            corpus.grid(&format!("{name}, step {by}"), &spheres, grid);
        }
    }
    let mut random = Random::new(7);
    let cloud: Vec<_> =
        (0..250).map(|_| ball(random.ball() * 5.0, random.between(0.1, 1.5))).collect();
    for (k, view) in VIEWS.into_iter().enumerate() {
        for (projection, word) in BOTH {
            let mut camera =
                Look { at: DVec3::ZERO, view, distance: 8.0, height: 9.0 }.camera(projection);
            (camera.near, camera.far) = (random.between(2.0, 7.0), random.between(7.5, 11.0));
            corpus.add(
                format!("a slice of a cloud, view {k}, {word}, seed 7"),
                &scene(&cloud),
                camera,
                pixels(48, 48),
            );
        }
    }
}

/// The camera in, on and near spheres.
fn inside(corpus: &mut Corpus) {
    let around = |radius| {
        let others = [
            ball([4.0, 0.5, 0.25], 0.5),
            ball([-3.0, 0.0, 0.0], 1.0),
            ball([2.0, -1.0, 0.0], 0.5),
            ball([15.0, 0.0, 0.0], 2.0),
        ];
        let mut spheres = vec![ball(DVec3::ZERO, radius)];
        spheres.extend(others);
        scene(&spheres)
    };
    for (name, at) in [
        ("at the centre", DVec3::ZERO),
        ("on the front", DVec3::new(-3.0, 0.0, 0.0)),
        ("on the back", DVec3::new(3.0, 0.0, 0.0)),
        ("on the side", DVec3::new(0.0, 3.0, 0.0)),
        ("on the surface", DVec3::new(-2.0, 1.0, 2.0)),
        ("inside", DVec3::new(0.5, -0.7, 0.1)),
        ("behind", DVec3::new(8.0, 0.0, 0.0)),
    ] {
        for (word, radius) in
            [("just inside", 3f64.next_up()), ("exactly", 3.0), ("just outside", 3f64.next_down())]
        {
            for (k, view) in [VIEWS[0], VIEWS[2]].into_iter().enumerate() {
                for (projection, last) in BOTH {
                    let mut camera =
                        Grid { origin: at, pitch: 0.25, ..Grid::new(21) }.camera(projection);
                    camera.view = view;
                    corpus.add(
                        format!("camera {name}, {word}, view {k}, {last}"),
                        &around(radius),
                        camera,
                        pixels(21, 21),
                    );
                }
            }
        }
    }
    // Inside hundreds of spheres at once; half of them behind.
    let mut random = Random::new(8);
    let spheres: Vec<_> =
        (0..400).map(|_| ball(random.ball() * 3.0, random.between(0.5, 4.0))).collect();
    for (k, view) in VIEWS.into_iter().enumerate() {
        let look = Look { at: DVec3::ZERO, view, distance: 0.125, height: 0.2 };
        corpus.look(
            &format!("inside 400, view {k}, seed 8"),
            &scene(&spheres),
            look,
            pixels(32, 32),
        );
    }
    // The inner walls of rooms within rooms, concentric and equal.
    let rooms: Vec<_> =
        (0..40).map(|k| ball(DVec3::ZERO, 2.0 + f64::from(k / 2) * two_to(-51))).collect();
    corpus.grid("rooms within rooms", &scene(&rooms), Grid { pitch: 0.3, ..Grid::new(15) });
}

/// Numbers of all sizes.
fn scales(corpus: &mut Corpus) {
    let mut random = Random::new(9);
    // Radii from 2^-120 to 2^120, each seen from where it touches the axis.
    let mut spheres = Vec::new();
    for power in (-120..=120).step_by(5) {
        let r = two_to(power);
        spheres
            .push(ball([r * 2.0, random.between(-1.0, 1.0) * r, random.between(-1.0, 1.0) * r], r));
        spheres.push(ball([r * 1.5, r, 0.0], r));
    }
    let mixed = scene(&spheres);
    for pitch in [1.0, two_to(-100), two_to(100)] {
        for (projection, word) in BOTH {
            let mut camera = Grid { pitch, ..Grid::new(11) }.camera(projection);
            corpus.add(
                format!("radii 2^-120 to 2^120, pitch {pitch:e}, {word}, seed 9"),
                &mixed,
                camera,
                pixels(11, 11),
            );
            camera.view = VIEWS[2];
            corpus.add(
                format!("radii 2^-120 to 2^120, pitch {pitch:e}, tilted, {word}, seed 9"),
                &mixed,
                camera,
                pixels(11, 11),
            );
        }
    }
    // One cloud at many scales: squares overflow f32, then f64; subnormal at the other end.
    for power in [-1060, -1000, -540, -149, -127, -75, -63, 63, 64, 127, 500, 520, 1000] {
        let scale = two_to(power);
        let spheres: Vec<_> = (0..if power.abs() > 500 { 8 } else { 60 })
            .map(|_| ball(random.ball() * 3.0 * scale, random.between(0.3, 1.2) * scale))
            .collect();
        let side = if power.abs() > 500 { 8 } else { 24 };
        let camera = |projection, view: DVec3| {
            let mut camera = Camera::orthographic(view * (-8.0 * scale), view);
            camera.projection = projection;
            camera.size = match projection {
                Projection::Orthographic => ScreenSize::Height(6.0 * scale),
                Projection::Perspective => ScreenSize::Height(0.75),
            };
            camera
        };
        for (projection, word) in BOTH {
            for (k, view) in [VIEWS[0], VIEWS[1]].into_iter().enumerate() {
                let name = format!("a cloud times 2^{power}, view {k}, {word}, seed 9");
                corpus.add(name, &scene(&spheres), camera(projection, view), pixels(side, side));
            }
        }
    }
    // Coordinates that are subnormal among ordinary ones: they decide between spheres that are
    // otherwise equal.
    let least = f64::from_bits(1);
    let spheres: Vec<_> = (0..24u32)
        .map(|k| ball([5.0, 0.0, f64::from(k % 5) * least], 1.0))
        .chain((0..24u32).map(|k| ball([f64::from(7 - k % 7) * least, 0.5, 0.5], 0.125)))
        .collect();
    for (projection, word) in BOTH {
        for (k, view) in [VIEWS[0], DVec3::new(1.0, 0.0, 1e-310)].into_iter().enumerate() {
            let mut camera = Grid { pitch: 0.25, ..Grid::new(9) }.camera(projection);
            camera.view = view;
            corpus.add(
                format!("subnormal differences, view {k}, {word}"),
                &scene(&spheres),
                camera,
                pixels(9, 9),
            );
        }
    }
    // The length of view and up does not matter, however extreme.
    let cloud: Vec<_> =
        (0..40).map(|_| ball(random.ball() * 3.0, random.between(0.3, 1.2))).collect();
    for (name, view, up) in [
        ("long", VIEWS[2] * two_to(900), DVec3::Z),
        ("short", VIEWS[2] * two_to(-1020), DVec3::Z * two_to(1000)),
        ("subnormal", DVec3::new(least * 3.0, -least, least * 2.0), DVec3::new(0.0, least, least)),
        ("nearly parallel", DVec3::new(1.0, 0.0, 0.0), DVec3::new(1.0, 1e-16, 1e-17)),
        ("unequal", DVec3::new(1.0, 1e-200, 1e-300), DVec3::new(1.0, 1e-5, 1.0)),
    ] {
        for (projection, word) in BOTH {
            let mut camera = Look { at: DVec3::ZERO, view: DVec3::X, distance: 8.0, height: 6.0 }
                .camera(projection);
            if name != "unequal" && name != "nearly parallel" {
                camera.origin = DVec3::new(-3.0, 1.0, -2.0);
            }
            (camera.view, camera.up) = (view, up);
            corpus.add(
                format!("axes: {name}, {word}, seed 9"),
                &scene(&cloud),
                camera,
                pixels(24, 24),
            );
        }
    }
    // Coordinates from 1e-8 to 1e8.
    for seed in 100..124 {
        let mut random = Random::new(seed);
        let spheres: Vec<_> = (0..60)
            .map(|_| {
                let size = random.power(-8.0, 8.0);
                ball(random.ball() * size, size * random.power(-3.0, 0.5))
            })
            .collect();
        // Towards one of them, from near or far.
        let target = spheres[random.below(60) as usize];
        let look = Look {
            at: target.center,
            view: random.ball(),
            distance: target.radius * random.power(0.1, 4.0),
            height: target.radius * random.power(-1.0, 2.0),
        };
        corpus.look(&format!("1e-8 to 1e8, seed {seed}"), &scene(&spheres), look, pixels(24, 24));
    }
}

/// Distances of which next to nothing is left, beside numbers of other exponents: a surface in the
/// camera's plane whose centre has a subnormal coordinate, and the same as far apart as exponents
/// go.
fn cancelling(corpus: &mut Corpus) {
    let least = f64::from_bits(1);
    // (Radius, subnormal coordinate, width, pixels, what lies in front: depth and radius.)
    for (name, radius, aside, width, side, front) in [
        ("planet", 6.4e6, least, 0.02, 16, (0.02, 0.008)),
        ("planet without it", 6.4e6, 0.0, 0.02, 16, (0.02, 0.008)),
        ("2^100", two_to(100), least, two_to(43), 8, (two_to(45), two_to(42))),
        ("2^100 without it", two_to(100), 0.0, two_to(43), 8, (two_to(45), two_to(42))),
        ("2^900", two_to(900), least, two_to(800), 8, (two_to(720), two_to(719))),
        ("2^1023", two_to(1023), least * 3.0, two_to(970), 8, (two_to(940), two_to(938))),
        ("2^-500", two_to(-500), least, two_to(-530), 8, (two_to(-560), two_to(-562))),
        ("2^-1040", two_to(-1040), least, two_to(-1050), 8, (two_to(-1060), two_to(-1062))),
        ("pixels of 1e-323", 1.0, 0.0, least * 9.0, 5, (two_to(-1070), two_to(-1072))),
        (
            "pixels of 1e-323, large",
            two_to(1000),
            0.0,
            least * 9.0,
            5,
            (two_to(-1070), two_to(-1072)),
        ),
    ] {
        let spheres =
            scene(&[ball([radius, aside, 0.0], radius), ball([front.0, 0.0, 0.0], front.1)]);
        let mut camera = Camera::orthographic(DVec3::ZERO, DVec3::X);
        camera.size = ScreenSize::Width(width);
        corpus.add(
            format!("cancelling, {name}, orthographic"),
            &spheres,
            camera,
            pixels(side, side),
        );
        // On irrational axes numbers must not agree in thousands of bits: the contract would leave
        // their order open.
        if (two_to(-600)..two_to(600)).contains(&radius) && width > two_to(-600) {
            camera.view = DVec3::new(1.0, -0.5, 0.25);
            corpus.add(
                format!("cancelling, {name}, tilted, orthographic"),
                &spheres,
                camera,
                pixels(side, side),
            );
        }
        // On the surface with a point for an eye, and a hair before it.
        camera.projection = Projection::Perspective;
        camera.size = ScreenSize::Width(0.75);
        corpus.add(
            format!("cancelling, {name}, perspective"),
            &spheres,
            camera,
            pixels(side, side),
        );
        camera.origin.x = -radius * two_to(-50);
        corpus.add(
            format!("cancelling, {name}, just before, perspective"),
            &spheres,
            camera,
            pixels(side, side),
        );
    }
    // One scene of exponents from -900 to 900, seen by wide and narrow eyes.
    let spheres: Vec<_> = (-9..=9)
        .flat_map(|k| {
            let r = two_to(100 * k);
            [ball([r, 0.0, two_to(-900)], r), ball([2.0 * r, r, 0.0], r)]
        })
        .collect();
    for width in [least, two_to(-900), two_to(-60), 1.0, two_to(60), two_to(900), f64::MAX] {
        for (projection, word) in BOTH {
            let mut camera = Camera::orthographic(DVec3::ZERO, DVec3::X);
            (camera.projection, camera.size) = (projection, ScreenSize::Width(width));
            corpus.add(
                format!("cancelling, 2^-900 to 2^900, {width:e} wide, {word}"),
                &scene(&spheres),
                camera,
                pixels(5, 5),
            );
        }
    }
    // Differences that no f64 reaches.
    let most = f64::MAX;
    let spheres = [
        ball([most, 0.0, 0.0], most),
        ball([most, most, 0.0], most),
        ball([most, 0.0, 0.0], 0.5 * most),
    ];
    for (projection, word) in BOTH {
        let mut camera = Camera::orthographic(DVec3::new(-most, 0.0, 0.0), DVec3::X);
        (camera.projection, camera.size) = (projection, ScreenSize::Width(1.0));
        corpus.add(
            format!("cancelling, beyond f64, {word}"),
            &scene(&spheres),
            camera,
            pixels(5, 5),
        );
        camera.near = most;
        corpus.add(
            format!("cancelling, beyond f64, near, {word}"),
            &scene(&spheres),
            camera,
            pixels(5, 5),
        );
    }
}

/// Many spheres in few pixels.
fn crowds(corpus: &mut Corpus) {
    let mut random = Random::new(10);
    let heap: Vec<_> =
        (0..100_000).map(|_| ball(random.ball() * 1e-3 + DVec3::X * 5.0, 1.0)).collect();
    corpus.grid(
        "100,000 on one pixel, seed 10",
        &scene(&heap),
        Grid { pitch: 0.2, ..Grid::new(1) },
    );
    corpus.grid(
        "100,000 on 4 x 4, seed 10",
        &scene(&heap),
        Grid { pitch: 0.08, image: pixels(4, 4), ..Grid::new(1) },
    );
    // The nearest is the last of 70,000: a loop that ends early misses it.
    let queue: Vec<_> =
        (0..70_000).map(|k| ball([80.0 - f64::from(k) * 1e-3, 0.0, 0.0], 2.0)).collect();
    corpus.grid(
        "70,000 in a queue",
        &scene(&queue),
        Grid { pitch: 0.1, image: pixels(4, 4), ..Grid::new(1) },
    );
    let same = vec![ball([5.0, 0.0, 0.0], 1.0); 70_000];
    corpus.grid(
        "70,000 times the same",
        &scene(&same),
        Grid { pitch: 0.08, image: pixels(4, 4), ..Grid::new(1) },
    );
    // Fewer than a pixel each.
    for count in [300, 3000] {
        let dust: Vec<_> =
            (0..count).map(|_| ball(random.ball() * 4.0, random.between(0.01, 0.1))).collect();
        let look = Look { at: DVec3::ZERO, view: VIEWS[4], distance: 10.0, height: 8.0 };
        corpus.look(&format!("dust of {count}, seed 10"), &scene(&dust), look, pixels(64, 64));
    }
    // A hot pixel: nearly all in one, some elsewhere; sizes from a tenth of a pixel to the whole
    // picture.
    let hot: Vec<_> = (0..3000)
        .map(|k| {
            if k % 10 == 0 {
                ball(random.ball() * 4.0, random.power(-2.0, 0.5))
            } else {
                ball(random.ball() * 0.05 + DVec3::Y, random.between(0.01, 0.1))
            }
        })
        .collect();
    let look = Look { at: DVec3::ZERO, view: VIEWS[4], distance: 10.0, height: 8.0 };
    corpus.look("a hot pixel, seed 10", &scene(&hot), look, pixels(70, 50));
}

/// Images of odd shapes, and nothing to see.
fn shapes(corpus: &mut Corpus) {
    let mut random = Random::new(11);
    let cloud: Vec<_> =
        (0..80).map(|_| ball(random.ball() * 4.0, random.between(0.2, 1.2))).collect();
    let cloud = scene(&cloud);
    for (width, height) in [(1, 1), (1, 4000), (4000, 1), (7, 5), (33, 31), (128, 3)] {
        for (k, view) in [VIEWS[0], VIEWS[1], VIEWS[4]].into_iter().enumerate() {
            let look = Look { at: DVec3::ZERO, view, distance: 9.0, height: 7.0 };
            let look = if width > height {
                Look { height: 7.0 * f64::from(height) / f64::from(width), ..look }
            } else {
                look
            };
            corpus.look(
                &format!("{width} x {height}, view {k}, seed 11"),
                &cloud,
                look,
                pixels(width, height),
            );
        }
    }
    for (name, size) in [
        ("wide pixels", ScreenSize::Both { width: 10.0, height: 1.3 }),
        ("tall pixels", ScreenSize::Both { width: 0.7, height: 9.1 }),
        ("width only", ScreenSize::Width(6.1)),
        ("height only", ScreenSize::Height(6.1)),
    ] {
        for (projection, word) in BOTH {
            let mut camera = Look { at: DVec3::ZERO, view: VIEWS[4], distance: 9.0, height: 7.0 }
                .camera(projection);
            camera.size = size;
            corpus.add(format!("{name}, {word}, seed 11"), &cloud, camera, pixels(37, 23));
        }
    }
    let look = Look { at: DVec3::ZERO, view: VIEWS[2], distance: 9.0, height: 7.0 };
    corpus.look("nothing", &scene(&[]), look, pixels(9, 9));
    let far_aside = scene(&[ball([0.0, 1e4, 0.0], 3.0), ball([0.0, 0.0, -1e4], 3.0)]);
    corpus.look("all off screen", &far_aside, look, pixels(9, 9));
    let behind = scene(&[ball(VIEWS[2] * -20.0, 3.0), ball(VIEWS[2] * -30.0, 3.0)]);
    corpus.look("all behind", &behind, look, pixels(9, 9));
    let mut hidden: Vec<_> =
        (0..500).map(|_| ball(random.ball() * 2.0 + VIEWS[2] * 4.0, 0.1)).collect();
    hidden.push(ball(DVec3::ZERO, 4.0));
    corpus.look("all hidden, seed 11", &scene(&hidden), look, pixels(32, 32));
}

/// Scenes of no malice.
fn plain(corpus: &mut Corpus) {
    for seed in 20..28 {
        let mut random = Random::new(seed);
        let count = [50, 300, 1000, 10_000][seed as usize % 4];
        let size = 2.0 / f64::from(count).cbrt();
        let spheres: Vec<_> = (0..count)
            .map(|_| {
                let c = DVec3::new(
                    random.between(-1.0, 1.0),
                    random.between(-1.0, 1.0),
                    random.between(-1.0, 1.0),
                );
                ball(c, size * random.between(0.2, 0.7))
            })
            .collect();
        let look = Look {
            at: DVec3::ZERO,
            view: random.ball(),
            distance: random.between(1.0, 6.0),
            height: 2.5,
        };
        corpus.look(
            &format!("{count} in a cube, seed {seed}"),
            &scene(&spheres),
            look,
            pixels(150, 101),
        );
    }
    let report = [ball([5.0, 2.0, 0.0], 2.0), ball([5.0, -2.0, 0.0], 1.0)];
    let occlusion =
        [ball([5.0, 2.0, 0.0], 3.0), ball([4.0, 1.0, 0.0], 2.0), ball([3.0, 0.0, 0.0], 1.0)];
    for (name, spheres, origin, view) in [
        ("camera-origin", &report[..], DVec3::ZERO, VIEWS[0]),
        ("camera-moved", &report, DVec3::Y * 2.0, VIEWS[0]),
        ("camera-turned", &report, DVec3::Y * 2.0, VIEWS[1]),
        ("occlusion", &occlusion, DVec3::ZERO, VIEWS[0]),
    ] {
        for side in [100, 101] {
            corpus.add(
                format!("report: {name}, {side}"),
                &scene(spheres),
                Camera::orthographic(origin, view),
                pixels(side, side),
            );
        }
    }
}
