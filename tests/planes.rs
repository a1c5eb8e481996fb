//! Planes of numbers: normals and positions against exact values, and the files that they go into.

use std::{
    fs,
    io::Read,
    path::Path,
    process::{Command, Stdio},
};

use dashu_int::{IBig, UBig, ops::SquareRoot};
use dashu_ratio::RBig;
use glam::DVec3;

use planisphere_core::{
    camera::{Camera, ImageSize, Projection, Region, ScreenSize, View},
    depth::{POINT_ERROR, normals, positions},
    exact::decide::{Root, Tally, Truth},
    scene::{Scene, Sphere},
};

/// A number, exactly.
fn exact(value: f64) -> RBig {
    RBig::try_from(value).expect("it is finite")
}

/// The root of a number that is not negative, to some 250 bits.
fn root(value: &RBig) -> RBig {
    let (numerator, denominator) = (value.numerator().clone(), value.denominator().clone());
    let numerator = UBig::try_from(numerator).expect("it is not negative");
    let scaled: UBig = (numerator * &denominator) << 1000;
    RBig::from_parts(IBig::from(scaled.sqrt()), denominator << 500)
}

type Vector = [RBig; 3];

fn vector(of: DVec3) -> Vector {
    of.to_array().map(exact)
}

fn dot(a: &Vector, b: &Vector) -> RBig {
    (0..3).map(|k| &a[k] * &b[k]).fold(RBig::ZERO, |sum, x| sum + x)
}

/// `a + s b`.
fn along(a: &Vector, s: &RBig, b: &Vector) -> Vector {
    std::array::from_fn(|k| &a[k] + s * &b[k])
}

fn f64_of(value: &RBig) -> f64 {
    value.to_f64().value()
}

fn random(state: &mut u64) -> f64 {
    *state = state.wrapping_mul(0x5851_f42d_4c95_7f2d).wrapping_add(0x1405_7b7e_f767_814f);
    ((*state ^ *state >> 31) >> 11) as f64 / (1u64 << 53) as f64
}

/// A camera along (3, 4, 0), whose axes are rational.
struct Case {
    camera: Camera,
    sphere: Sphere,
}

impl Case {
    fn new(state: &mut u64, round: usize) -> Self {
        let far_off = [0.0, 1e3, 1e7][round % 3];
        let mut point = || DVec3::from_array(std::array::from_fn(|_| random(state) - 0.5));
        let (origin, aside) = (point() * far_off, point());
        let reach = [3.0, 500.0, 2e4][round / 3 % 3];
        let radius = [1.0, 0.01, 1.5 * reach][round / 9 % 3] * (0.5 + random(state));
        let center = origin + reach * DVec3::new(0.6, 0.8, 0.0) + 0.3 * radius * aside;
        let perspective = round.is_multiple_of(2);
        let height = 2.4 * radius.min(reach) / if perspective { reach } else { 1.0 };
        let camera = Camera {
            projection: if perspective {
                Projection::Perspective
            } else {
                Projection::Orthographic
            },
            size: ScreenSize::Height(height),
            ..Camera::orthographic(origin, DVec3::new(3.0, 4.0, 0.0))
        };
        Self { camera, sphere: Sphere { center, radius, color: [0; 3] } }
    }

    /// The exact point and normal at a place of the screen.
    fn hit(&self, side: u32, [column, row]: [u32; 2], wall: Root) -> (Vector, Vector) {
        let ScreenSize::Height(height) = self.camera.size else { unreachable!("it has a height") };
        let place = |at: u32| {
            let odd = 2 * i64::from(at) + 1 - i64::from(side);
            RBig::from_parts(IBig::from(odd), UBig::from(2 * side))
        };
        let (sx, sy) = (place(column) * exact(height), -place(row) * exact(height));
        let fifths = |x: i32, y: i32, z: i32| {
            [x, y, z].map(|part| RBig::from_parts(IBig::from(part), UBig::from(5u8)))
        };
        let (right, up, forward) = (fifths(4, -3, 0), fifths(0, 0, 5), fifths(3, 4, 0));
        let on_screen = along(&[RBig::ZERO, RBig::ZERO, RBig::ZERO], &sx, &right);
        let on_screen = along(&on_screen, &sy, &up);
        let origin = vector(self.camera.origin);
        let one = RBig::ONE;
        let (origin, direction) = match self.camera.projection {
            Projection::Orthographic => (along(&origin, &one, &on_screen), forward),
            Projection::Perspective => (origin, along(&forward, &one, &on_screen)),
        };
        let (center, radius) = (vector(self.sphere.center), exact(self.sphere.radius));
        let e = along(&origin, &-one, &center);
        let (a, b) = (dot(&direction, &direction), dot(&e, &direction));
        let q = &b * &b - &a * (dot(&e, &e) - &radius * &radius);
        let root = root(&q);
        let t = (if wall == Root::Near { -b - root } else { root - b }) / a;
        let offset = along(&e, &t, &direction);
        let point = along(&origin, &t, &direction);
        (point, offset.map(|x| x / &radius))
    }
}

/// How far vectors are off at most, as a part of their bounds.
#[test]
fn vectors_are_within_their_bounds() {
    const SIDE: u32 = 12;
    let (mut state, mut worst, mut seen, mut inner) = (1, [0.0f64; 2], 0, 0);
    for round in 0..108 {
        let case = Case::new(&mut state, round);
        let scene = Scene::from_spheres(&[case.sphere]).unwrap();
        let view = View::new(case.camera, ImageSize { width: SIDE, height: SIDE });
        let truth = Truth::new(&view, scene.bounds());
        let places: Vec<[u32; 2]> = (0..SIDE * SIDE).map(|at| [at % SIDE, at / SIDE]).collect();
        let hits: Vec<_> = places
            .iter()
            .map(|&[column, row]| {
                truth.pixel(column, row).hit(case.sphere.into(), &mut Tally::default())
            })
            .collect();
        let ids: Vec<i32> = hits.iter().map(|hit| if hit.is_some() { 0 } else { -1 }).collect();
        let region = Region::whole(view.image);
        let points = positions(&scene, &truth, region, &ids).unwrap();
        let outward = normals(&scene, &truth, region, &ids).unwrap();
        for (((place, hit), point), normal) in places.iter().zip(&hits).zip(&points).zip(&outward) {
            let Some(hit) = hit else {
                assert!(point.iter().all(|x| x.is_nan()) && *normal == [0.0; 3]);
                continue;
            };
            seen += 1;
            inner += i32::from(hit.root() == Root::Far);
            let (want_point, want_normal) = case.hit(SIDE, *place, hit.root());
            let length = |v: &Vector| f64_of(&dot(v, v)).sqrt();
            let origin = case.camera.origin;
            let to_hit = length(&along(&want_point, &-RBig::ONE, &vector(origin)));
            let way = to_hit.max(origin.length());
            for (got, want) in point.iter().zip(&want_point) {
                let off = f64_of(&(exact(f64::from(*got)) - want)).abs();
                let bound = f64::from(got.abs()) * 2f64.powi(-24) + POINT_ERROR * way;
                worst[0] = worst[0].max(off / bound);
            }
            let way = to_hit.max((origin - case.sphere.center).length());
            let off: Vector =
                std::array::from_fn(|k| exact(f64::from(normal[k])) - &want_normal[k]);
            let bound = 2f64.powi(-22) + 2.0 * POINT_ERROR * way / case.sphere.radius;
            worst[1] = worst[1].max(length(&off) / bound);
        }
    }
    println!("{seen} hits, {inner} of inner walls: {worst:?} of the bounds");
    assert!(seen > 5000 && inner > 500, "{seen} hits, {inner} of inner walls");
    assert!(worst.iter().all(|worst| (0.05..=1.0).contains(worst)), "{worst:?}");
}

fn succeed(folder: &Path, args: &[&str]) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_planisphere"));
    let output = command.current_dir(folder).args(args).stdin(Stdio::null()).output().unwrap();
    assert!(output.status.success(), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
}

const SCENE: &str = "[camera]\nprojection = \"perspective\"\norigin = [-9, 1, 2]\n\
    view = [1, 0, 0]\nfov = 30\n[image]\nwidth = 45\nheight = 37\nbackground = \"#102030\"\n\
    [[sphere]]\ncenter = [0, 0, 0]\nradius = 2\ncolor = \"#ff8000\"\n\
    [[sphere]]\ncenter = [1, 2, 2]\nradius = 1.5\ncolor = \"#0080ff\"\n";

/// The numbers of an array, after its header.
fn numbers(bytes: &[u8]) -> (String, Vec<f32>) {
    let end = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    let words = String::from_utf8_lossy(&bytes[10..end]).into_owned();
    (words, bytes[end..].as_chunks::<4>().0.iter().map(|&four| f32::from_le_bytes(four)).collect())
}

#[test]
fn planes_are_the_same_in_every_file() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    fs::write(at.join("s.toml"), SCENE).unwrap();
    let outputs = ["--ids", "ids.npy", "--depth", "depth.npy", "--normals", "normals.npy"];
    let more = ["--positions", "positions.npy", "--planes", "all.npz", "-o", "s.exr"];
    succeed(at, &[&["render", "s.toml", "--device", "cpu"][..], &outputs, &more].concat());
    let mut archive = zip::ZipArchive::new(fs::File::open(at.join("all.npz")).unwrap()).unwrap();
    let names = ["ids", "depth", "normals", "positions"];
    let files = names.map(|name| fs::read(at.join(format!("{name}.npy"))).unwrap());
    assert_eq!(archive.len(), 4);
    for (name, file) in names.iter().zip(&files) {
        let mut entry = Vec::new();
        archive.by_name(&format!("{name}.npy")).unwrap().read_to_end(&mut entry).unwrap();
        assert!(entry == *file, "{name}");
    }
    let [_, depth, normals, positions] = files.map(|file| numbers(&file));
    assert!(normals.0.contains("'<f4'") && normals.0.contains("(37, 45, 3)"), "{}", normals.0);
    let ids = fs::read(at.join("ids.npy")).unwrap();
    let ids: Vec<i32> = ids[ids.len() - 4 * 45 * 37..]
        .as_chunks::<4>()
        .0
        .iter()
        .map(|&four| i32::from_le_bytes(four))
        .collect();
    let centers = [[0.0, 0.0, 0.0], [1.0, 2.0, 2.0f32]];
    for (at, &id) in ids.iter().enumerate() {
        let [normal, point] = [&normals, &positions].map(|plane| &plane.1[3 * at..3 * at + 3]);
        let Ok(index) = usize::try_from(id) else {
            assert!(normal == [0.0; 3] && point.iter().all(|x| x.is_nan()));
            continue;
        };
        assert!((point[0] + 9.0 - depth.1[at]).abs() < 1e-5);
        for k in 0..3 {
            let off = point[k] - centers[index][k] - [2.0, 1.5][index] * normal[k];
            assert!(off.abs() < 1e-5, "pixel {at}, axis {k}: {off}");
        }
    }
    // They are those of the middles of pixels whatever the look, whose samples may be the same.
    for look in [&["--look", "matte", "--aa", "1"][..], &["--outline", "2"], &["--aa", "2"]] {
        let planes = ["render", "s.toml", "-o", "s.png", "--ids", "i.npy", "--depth", "d.npy"];
        succeed(at, &[&planes[..], look].concat());
        for (name, same) in [("i.npy", "ids.npy"), ("d.npy", "depth.npy")] {
            let [found, wanted] = [name, same].map(|name| fs::read(at.join(name)).unwrap());
            assert!(found == wanted, "{look:?}: {name}");
        }
    }
    // A part of the picture has the numbers of the whole.
    let part = ["render", "s.toml", "-o", "none", "--region", "10,9,20,7", "--normals", "n.npy"];
    succeed(at, &[&part[..], &["--positions", "p.npy"]].concat());
    for (name, whole) in [("n.npy", &normals), ("p.npy", &positions)] {
        let part = numbers(&fs::read(at.join(name)).unwrap()).1;
        for (row, part) in part.chunks(3 * 20).enumerate() {
            let start = 3 * (45 * (9 + row) + 10);
            let same = part.iter().zip(&whole.1[start..start + 60]);
            assert!(same.into_iter().all(|(a, b)| a.to_bits() == b.to_bits()), "{name}");
        }
    }
}

#[test]
fn outputs_are_refused_before_any_work() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    fs::write(at.join("s.toml"), SCENE).unwrap();
    let cases: [(&[&str], &str); 9] = [
        (&["--normals", "n.npz"], "name it n.npy"),
        (&["--planes", "n.npy"], "name it n.npz"),
        (&["--normals", "a.npy", "--positions", "a.npy"], "both write"),
        (&["--planes", "s.npz", "--visibility", "s.npz"], "both write"),
        (&["-o", "a.webp", "--depth16"], "WebP has 8 bits a channel; name the picture .png"),
        (&["-o", "a.exr", "--depth16"], "OpenEXR has 32 bits"),
        (&["-o", "none", "--depth16", "--stats"], "-o none writes none"),
        (&["-o", "a.exr", "--aa-space", "encoded"], "holds linear light"),
        (&["-o", "a.qoi", "--dpi", "300"], "QOI does not hold it"),
    ];
    for (args, words) in cases {
        let mut command = Command::new(env!("CARGO_BIN_EXE_planisphere"));
        command.current_dir(at).args(["render", "s.toml", "--device", "cpu"]).args(args);
        let output = command.stdin(Stdio::null()).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.code() == Some(2) && said.contains(words), "{args:?}: {said}");
        assert_eq!(fs::read_dir(at).unwrap().count(), 1, "{args:?}");
    }
}
