//! The GPU's filter on the software device: every pixel that it settles is right, few are left
//! over, and neither chunks, rounds, windows, bands, regions nor kernels show.

use std::ops::Range;

use glam::DVec3;
use planisphere_core::{
    axes::Axes,
    camera::{Camera, ImageSize, Projection, Region, ScreenSize, View},
    cpu::{self, Cpu},
    ids::{NONE, UNDECIDED},
    scene::{Scene, Sphere},
};
use planisphere_gpu as gpu;
use planisphere_gpu::{Gpu, adapters::AdapterChoice, plan::Limits};
use planisphere_renderer::{Hybrid, REST};
use planisphere_shaders::Lanes;

/// Numbers from a seed, the same everywhere.
struct Random(u64);

impl Random {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    fn vector(&mut self, low: f64, high: f64) -> DVec3 {
        DVec3::new(self.between(low, high), self.between(low, high), self.between(low, high))
    }
}

/// Nearest sphere at every pixel of the region in f64, which is good enough where the filter
/// settles generic scenes.
fn reference(scene: &Scene, view: &View, region: Region) -> Vec<i32> {
    let axes = Axes::new(view.camera.view, view.camera.up);
    let [right, up, forward] = [axes.right.high, axes.up.high, axes.forward.high];
    let camera = &view.camera;
    let spheres: Vec<Sphere> = (0..scene.len()).map(|k| scene.sphere(k).unwrap()).collect();
    let mut ids = Vec::new();
    for row in region.y..region.y + region.height {
        for column in region.x..region.x + region.width {
            let sx = 0.5 * f64::from(view.odd_x(column)) * view.pitch_x.to_f64();
            let sy = 0.5 * f64::from(view.odd_y(row)) * view.pitch_y.to_f64();
            let mut best = (f64::INFINITY, NONE);
            for (k, sphere) in spheres.iter().enumerate() {
                let f = sphere.center - camera.origin;
                let (x, y, z) = (f.dot(right), f.dot(up), f.dot(forward));
                let (foot, half_square) = match camera.projection {
                    Projection::Orthographic => (
                        z,
                        sphere.radius * sphere.radius - (x - sx) * (x - sx) - (y - sy) * (y - sy),
                    ),
                    Projection::Perspective => {
                        let (n, m) = (z * sx - x, y - z * sy);
                        let third = n * sy + m * sx;
                        let a = 1.0 + sx * sx + sy * sy;
                        let d = a * sphere.radius * sphere.radius - (n * n + m * m + third * third);
                        (z + (m * sy - n * sx) / a, d / (a * a))
                    }
                };
                if half_square < 0.0 {
                    continue;
                }
                let half = half_square.sqrt();
                let range = camera.near..=camera.far;
                let hit = [foot - half, foot + half].into_iter().find(|t| range.contains(t));
                if let Some(t) = hit.filter(|&t| t < best.0) {
                    best = (t, k as i32);
                }
            }
            ids.push(best.1);
        }
    }
    ids
}

/// The driver that `tests/run.sh` means, by the name in `PLANISPHERE_EXPECT_ADAPTER`: a loader that
/// cannot load one takes another without a word.
#[test]
fn the_adapter_is_the_expected_one() {
    let name = gpu().gpu.description();
    match std::env::var("PLANISPHERE_EXPECT_ADAPTER") {
        Ok(part) => assert!(name.contains(&part), "the GPU is {name}, not {part}"),
        Err(_) => assert!(!name.is_empty(), "every adapter has a name"),
    }
    println!("GPU tests run on {name}");
}

fn gpu() -> Hybrid {
    Hybrid::new(Gpu::open(&AdapterChoice::Any).unwrap_or_else(|error| panic!("{error}")))
}

/// With thresholds for the GPU, and the same for the CPU.
fn set_effort(hybrid: &mut Hybrid, order: usize, cover: usize) {
    let cpu = cpu::Effort { order, cover, ..cpu::Effort::default() };
    hybrid.set_effort(gpu::Effort { order, cover, few: 0 }, cpu, REST);
}

fn draw(gpu: &mut Hybrid, scene: &Scene, view: &View, region: Region) -> Vec<i32> {
    gpu.gpu.draw_filter(scene, view, region).unwrap().ids
}

/// Settled pixels are right; at most `share` of them are left over.
fn check(what: &str, ids: &[i32], reference: &[i32], width: u32, share: f64) {
    assert_eq!(ids.len(), reference.len());
    let mut left = 0;
    for (at, (&id, &want)) in ids.iter().zip(reference).enumerate() {
        if id == UNDECIDED {
            left += 1;
        } else {
            assert_eq!(
                id,
                want,
                "{what}: column {}, row {}",
                at % width as usize,
                at / width as usize
            );
        }
    }
    let found = f64::from(left) / ids.len() as f64;
    assert!(found <= share, "{what}: {left} of {} pixels undecided", ids.len());
    println!(
        "{what}: {left} of {} undecided, {} covered",
        ids.len(),
        reference.iter().filter(|&&id| id >= 0).count()
    );
}

/// On all kernels: what the filter settles is right, at most `share` is left over, and the whole
/// picture is right.
fn check_whole(gpu: &mut Hybrid, what: &str, scene: &Scene, view: &View, share: f64) {
    let region = Region::whole(view.image);
    let want = reference(scene, view, region);
    both_lanes(gpu, |gpu, lanes| {
        let what = format!("{what}, {lanes}");
        check(&what, &draw(gpu, scene, view, region), &want, region.width, share);
        assert_eq!(gpu.draw(scene, view, region).unwrap().ids, want, "{what}");
    });
}

fn cloud(seed: u64, count: usize, radius: Range<f64>, offset: f64) -> Scene {
    let mut random = Random(seed);
    let spheres: Vec<Sphere> = (0..count)
        .map(|_| Sphere {
            center: random.vector(-4.0, 4.0) + DVec3::splat(offset),
            radius: random.between(radius.start.ln(), radius.end.ln()).exp(),
            color: [0; 3],
        })
        .collect();
    Scene::from_spheres(&spheres).unwrap()
}

/// A camera 10 before the middle of a cloud, looking at it askew.
fn camera(offset: f64, projection: Projection) -> Camera {
    let view = DVec3::new(1.0, -0.5, 0.3);
    let origin = DVec3::splat(offset) - 10.0 * view.normalize();
    let size = match projection {
        Projection::Orthographic => ScreenSize::Width(9.0),
        Projection::Perspective => ScreenSize::Width(0.9),
    };
    Camera { projection, size, ..Camera::orthographic(origin, view) }
}

const IMAGE: ImageSize = ImageSize { width: 203, height: 149 };

fn both_lanes(gpu: &mut Hybrid, mut test: impl FnMut(&mut Hybrid, &str)) {
    test(gpu, "portable");
    if gpu.gpu.set_lanes(Lanes::Eight) {
        test(gpu, "subgroup8");
    }
}

fn portable() -> Hybrid {
    let mut gpu = gpu();
    assert!(gpu.gpu.set_lanes(Lanes::Alone));
    gpu
}

#[test]
fn orthographic_scenes() {
    for (seed, count, radius, offset) in [
        (1, 300, 0.1..1.0, 0.0),
        (2, 1000, 0.02..0.2, 1e6),
        (3, 1000, 0.05..0.05000001, -1e3),
        (4, 1, 3.0..3.1, 5.0),
    ] {
        let scene = cloud(seed, count, radius, offset);
        let view = View::new(camera(offset, Projection::Orthographic), IMAGE);
        let region = Region::whole(IMAGE);
        let want = reference(&scene, &view, region);
        both_lanes(&mut portable(), |gpu, lanes| {
            let ids = draw(gpu, &scene, &view, region);
            check(&format!("orthographic, seed {seed}, {lanes}"), &ids, &want, IMAGE.width, 4e-4);
        });
    }
}

#[test]
fn pixels_need_not_be_square() {
    let scene = cloud(11, 300, 0.05..0.8, 0.0);
    for size in
        [ScreenSize::Both { width: 9.0, height: 2.0 }, ScreenSize::Both { width: 3.0, height: 9.0 }]
    {
        let view = View::new(Camera { size, ..camera(0.0, Projection::Orthographic) }, IMAGE);
        let want = reference(&scene, &view, Region::whole(IMAGE));
        let ids = draw(&mut gpu(), &scene, &view, Region::whole(IMAGE));
        check("not square", &ids, &want, IMAGE.width, 4e-4);
    }
}

#[test]
fn perspective_scenes() {
    for (seed, count, radius, offset) in [(21, 300, 0.1..1.0, 0.0), (22, 400, 0.02..0.2, 1e6)] {
        let scene = cloud(seed, count, radius, offset);
        for width in [0.9, 0.1, 4.0] {
            let camera = Camera {
                size: ScreenSize::Width(width),
                ..camera(offset, Projection::Perspective)
            };
            let view = View::new(camera, IMAGE);
            let region = Region::whole(IMAGE);
            let want = reference(&scene, &view, region);
            both_lanes(&mut portable(), |gpu, lanes| {
                let ids = draw(gpu, &scene, &view, region);
                check(
                    &format!("perspective {width}, seed {seed}, {lanes}"),
                    &ids,
                    &want,
                    IMAGE.width,
                    3e-3,
                );
            });
        }
    }
}

#[test]
fn clip_planes_and_cameras_inside() {
    for projection in [Projection::Orthographic, Projection::Perspective] {
        for (seed, near, far, back) in [
            (31, 0.0, f64::INFINITY, 0.0),
            (32, 9.5, f64::INFINITY, 10.0),
            (33, 8.0, 11.0, 10.0),
            (34, 0.0, 9.0, 10.0),
        ] {
            let scene = cloud(seed, 300, 0.2..2.0, 3.0);
            let from = camera(3.0, projection);
            let origin = DVec3::splat(3.0) - back * from.view.normalize();
            let view = View::new(Camera { origin, near, far, ..from }, IMAGE);
            let region = Region::whole(IMAGE);
            let want = reference(&scene, &view, region);
            both_lanes(&mut portable(), |gpu, lanes| {
                let ids = draw(gpu, &scene, &view, region);
                check(
                    &format!("{projection:?} clipped, seed {seed}, {lanes}"),
                    &ids,
                    &want,
                    IMAGE.width,
                    1.0,
                );
            });
        }
    }
}

#[test]
fn chunks_rounds_windows_batches_and_regions_do_not_show() {
    let scene = cloud(41, 400, 0.1..1.0, 0.0);
    for projection in [Projection::Orthographic, Projection::Perspective] {
        let camera = Camera { near: 9.0, ..camera(0.0, projection) };
        let view = View::new(camera, IMAGE);
        let region = Region { x: 5, y: 9, width: 150, height: 99 };
        let want = reference(&scene, &view, region);
        both_lanes(&mut portable(), |gpu, lanes| {
            for (chunk, limits) in [
                (
                    usize::MAX,
                    Limits {
                        wave: 1 << 24,
                        entries: 1 << 24,
                        tiles: 1 << 16,
                        few: 0,
                        worth: 0,
                        round: 1 << 15,
                    },
                ),
                (
                    330,
                    Limits {
                        wave: 1 << 24,
                        entries: 1 << 24,
                        tiles: 1 << 16,
                        few: 0,
                        worth: 0,
                        round: 1 << 15,
                    },
                ),
                (
                    330,
                    Limits { wave: 1 << 24, entries: 5_000, tiles: 50, few: 0, worth: 0, round: 9 },
                ),
                (77, Limits { wave: 300, entries: 777, tiles: 20, few: 0, worth: 0, round: 7 }),
            ] {
                gpu.gpu.shrink(chunk, 7, limits);
                set_effort(gpu, 0, 0);
                let ids = draw(gpu, &scene, &view, region);
                check(
                    &format!("{projection:?}, {lanes}, {limits:?}"),
                    &ids,
                    &want,
                    region.width,
                    5e-3,
                );
                assert_eq!(
                    gpu.draw(&scene, &view, region).unwrap().ids,
                    want,
                    "{projection:?}, {lanes}, {limits:?}"
                );
            }
        });
        // Limits only ever shrink, so each kernel got a device of its own.
    }
}

#[test]
fn what_large_spheres_hide_is_not_listed_and_not_missed() {
    let mut random = Random(61);
    let small = |random: &mut Random, k: usize| {
        // Before, behind, beside and inside the large ones; half of them half out of the first
        // one's surface.
        let center = match k % 2 {
            0 => random.vector(-4.0, 4.0),
            _ => DVec3::new(1.0, 0.0, 0.5) + 1.7 * random.vector(-1.0, 1.0).normalize(),
        };
        Sphere { center, radius: random.between(0.01, 0.05), color: [0; 3] }
    };
    let mut spheres: Vec<Sphere> = (0..6000).map(|k| small(&mut random, k)).collect();
    for (at, center, radius) in
        [(17, DVec3::new(1.0, 0.0, 0.5), 1.7), (5000, DVec3::new(-0.5, 2.0, -1.0), 0.9)]
    {
        spheres[at] = Sphere { center, radius, color: [0; 3] };
    }
    let scene = Scene::from_spheres(&spheres).unwrap();
    for projection in [Projection::Orthographic, Projection::Perspective] {
        let view = View::new(camera(0.0, projection), IMAGE);
        let region = Region::whole(IMAGE);
        let want = reference(&scene, &view, region);
        for large in [17, 5000] {
            assert!(want.iter().filter(|&&id| id == large).count() > 300, "both are seen");
        }
        let mut drawings = Vec::new();
        for order in [cpu::Effort::default().order, 0] {
            let mut gpu = portable();
            set_effort(&mut gpu, order, gpu::Effort::default().cover);
            both_lanes(&mut gpu, |gpu, lanes| {
                let drawing = gpu.draw(&scene, &view, region).unwrap();
                assert!(
                    drawing.counts.hidden.is_some_and(|hidden| hidden > 200),
                    "{projection:?}: {:?}",
                    drawing.counts
                );
                assert_eq!(drawing.ids, want, "{projection:?}, {lanes}, ordered from {order} on");
                drawings.push(drawing);
            });
            // In several waves nobody knows what a tile's last list will be.
            let (chunk, limits) = gpu.gpu.limits();
            gpu.gpu.shrink(chunk, u32::MAX, Limits { wave: 1000, ..limits });
            assert_eq!(
                gpu.draw(&scene, &view, region).unwrap().ids,
                want,
                "{projection:?}, in waves, ordered from {order} on"
            );
        }
        drawings.push(Cpu::default().draw(&scene, &view, region).unwrap());
        assert!(drawings.iter().all(|drawing| drawing.ids == want), "{projection:?}");
        assert!(drawings.iter().all(|drawing| drawing.counts.hidden > Some(200)));
    }
}

#[test]
fn a_sphere_behind_all_else_is_seen_wherever_nothing_else_is() {
    // Pixels one apart, with a sphere behind all of them whose nearest point is at depth 1000.
    let image = ImageSize { width: 96, height: 64 };
    let camera =
        Camera { size: ScreenSize::Width(96.0), ..Camera::orthographic(DVec3::ZERO, DVec3::X) };
    let view = View::new(camera, image);
    let sphere = |x: f64, y: f64, z: f64, radius: f64| Sphere {
        center: DVec3::new(x, y, z),
        radius,
        color: [0; 3],
    };
    let mut spheres = vec![sphere(10_000.0, 0.0, 0.0, 9_000.0)];
    for k in 0..40 {
        // Wholly in front of it, missed by a pixel's ray by so little that the device cannot tell.
        let (column, row) = (f64::from(k * 7 % 80) - 39.5, f64::from(k * 11 % 50) - 24.5);
        spheres.push(sphere(10.0 + f64::from(k), column + 3.0 * (1.0 + 1e-7), row, 3.0));
    }
    for k in 0..6 {
        // Half out of its surface: what is seen of these is nearer than 1000, and the rest is
        // hidden.
        spheres.push(sphere(1_002.0, f64::from(12 * k) - 33.3, f64::from(9 * k) - 25.2, 3.0));
    }
    let scene = Scene::from_spheres(&spheres).unwrap();
    let region = Region::whole(image);
    let want = reference(&scene, &view, region);
    assert!(want.contains(&0) && want.iter().all(|&id| id >= 0), "it is seen, and covers all");
    for order in [cpu::Effort::default().order, 0] {
        let mut gpu = portable();
        set_effort(&mut gpu, order, 0);
        both_lanes(&mut gpu, |gpu, lanes| {
            let left = gpu.gpu.draw_filter(&scene, &view, region).unwrap().ids;
            let open =
                left.iter().zip(&want).filter(|&(&id, &want)| id == UNDECIDED && want == 0).count();
            assert!(open > 20, "{lanes}: it is left to the host: {open}");
            let drawing = gpu.draw(&scene, &view, region).unwrap();
            assert!(drawing.ids == want, "{lanes}, ordered from {order} on");
            assert_eq!(drawing.counts.empty, 0, "{lanes}");
        });
    }
}

#[test]
fn a_device_that_leaves_most_over_is_not_asked_each_time() {
    // Many spheres almost in one place: no f32 can tell which is seen.
    let mut random = Random(71);
    let spheres: Vec<Sphere> = (0..200)
        .map(|_| Sphere { center: 1e-9 * random.vector(-1.0, 1.0), radius: 3.0, color: [0; 3] })
        .collect();
    let hard = Scene::from_spheres(&spheres).unwrap();
    let easy = cloud(72, 300, 0.1..0.5, 0.0);
    let view = View::new(camera(0.0, Projection::Orthographic), IMAGE);
    let region = Region::whole(IMAGE);
    let mut gpu = portable();
    let mut dispatches = |scene: &Scene| {
        let before = gpu.gpu.activity().1;
        let ids = gpu.draw(scene, &view, region).unwrap().ids;
        assert!(ids == Cpu::default().draw(scene, &view, region).unwrap().ids);
        gpu.gpu.activity().1 - before
    };
    assert!(dispatches(&hard) > 0, "the first time it is asked");
    let rest = REST;
    assert!((0..rest).all(|_| dispatches(&hard) == 0), "then the host draws alone");
    assert!(dispatches(&hard) > 0, "and after a while it is tried again");
    assert!(dispatches(&easy) > 0 && dispatches(&easy) > 0, "another scene is another matter");
}

#[test]
fn few_spheres_in_many_tiles_are_all_seen() {
    // Small spheres here and there, one in each fourth tile of the left edge; pixels are one apart.
    let image = ImageSize { width: 256, height: 256 };
    let region = Region::whole(image);
    let mut random = Random(81);
    let spheres: Vec<Sphere> = (0..40)
        .map(|k| {
            let place = |random: &mut Random| random.between(-126.0, 126.0);
            let (right, up) = if k < 8 {
                (-124.0, 124.0 - 32.0 * f64::from(k))
            } else {
                (place(&mut random), place(&mut random))
            };
            Sphere {
                center: DVec3::new(random.between(10.0, 20.0), -right, up),
                radius: 2.3,
                color: [0; 3],
            }
        })
        .collect();
    let scene = Scene::from_spheres(&spheres).unwrap();
    both_lanes(&mut portable(), |gpu, lanes| {
        // What one picture leaves in memory must not show in the next.
        for aside in [0.0, 0.4, 77.3, -50.6] {
            let origin = DVec3::new(0.0, aside, 0.5 * aside);
            let camera =
                Camera { size: ScreenSize::Width(256.0), ..Camera::orthographic(origin, DVec3::X) };
            let view = View::new(camera, image);
            let want = reference(&scene, &view, region);
            let drawing = gpu.draw(&scene, &view, region).unwrap();
            assert!(drawing.ids == want, "{lanes}, {aside}");
            assert!(
                drawing.counts.entries > 20 && drawing.counts.entries < 256,
                "{:?}",
                drawing.counts
            );
        }
    });
}

#[test]
fn seventy_thousand_spheres_over_one_pixel() {
    let mut random = Random(51);
    let spheres: Vec<Sphere> = (0..70_000)
        .map(|k| Sphere {
            center: DVec3::new(
                10.0 + 0.001 * f64::from(70_000 - k),
                random.between(-0.1, 0.1),
                random.between(-0.1, 0.1),
            ),
            radius: 1.0,
            color: [0; 3],
        })
        .collect();
    let scene = Scene::from_spheres(&spheres).unwrap();
    let image = ImageSize { width: 3, height: 2 };
    let camera =
        Camera { size: ScreenSize::Width(0.3), ..Camera::orthographic(DVec3::ZERO, DVec3::X) };
    let view = View::new(camera, image);
    let want = reference(&scene, &view, Region::whole(image));
    assert!(want.iter().all(|&id| id > 69_000), "the nearest come last: {want:?}");
    both_lanes(&mut portable(), |gpu, lanes| {
        let ids = draw(gpu, &scene, &view, Region::whole(image));
        check(&format!("70,000 spheres, {lanes}"), &ids, &want, image.width, 1.0);
        assert_eq!(gpu.draw(&scene, &view, Region::whole(image)).unwrap().ids, want, "{lanes}");
    });
}

#[test]
fn extreme_numbers_are_left_to_the_host_or_right() {
    let mut gpu = gpu();
    let image = ImageSize { width: 40, height: 40 };
    let ball =
        |x: f64, radius: f64| Sphere { center: DVec3::new(x, 0.1, 0.2), radius, color: [0; 3] };
    let camera = Camera::orthographic(DVec3::new(-20.0, 0.0, 0.0), DVec3::new(1.0, 0.01, 0.0));
    for spheres in [
        vec![ball(5.0, 1e-9), ball(6.0, 1.0)],
        vec![ball(5.0, 1e9), ball(6.0, 1.0)],
        vec![ball(5.0, 1e30), ball(6.0, 1.0)],
        vec![ball(5.0, 1e-30), ball(6.0, 1e30), ball(7.0, 1.0)],
        vec![ball(5.0, 1.0), ball(1e15, 1.0)],
        vec![ball(5.0, 1e-300), ball(6.0, 1.0)],
        vec![ball(1e300, 1e299), ball(6.0, 1.0)],
        vec![ball(5.0, 1.0), ball(5.0, 1.0 + 4e-5)],
        vec![ball(5.0, 1.0), ball(5.0, 1.0)],
    ] {
        let scene = Scene::from_spheres(&spheres).unwrap();
        for projection in [Projection::Orthographic, Projection::Perspective] {
            for width in [10.0, 0.01, 1e6] {
                let size = ScreenSize::Width(if projection == Projection::Perspective {
                    width / 20.0
                } else {
                    width
                });
                let view = View::new(Camera { projection, size, ..camera }, image);
                let region = Region::whole(image);
                let ids = draw(&mut gpu, &scene, &view, region);
                let what = format!("{spheres:?} {projection:?} {width}");
                check(&what, &ids, &reference(&scene, &view, region), image.width, 1.0);
            }
        }
    }
}

/// Planets one in another, looked at through telescopes: their first hits lie farther before the
/// middle of the data than offsets of tiles reach.
#[test]
fn planets_fill_telescopes() {
    let mut gpu = gpu();
    let image = ImageSize { width: 64, height: 64 };
    let mut random = Random(29);
    for projection in [Projection::Orthographic, Projection::Perspective] {
        for bits in 6..27 {
            // The radius of the planets is about 1, and so is their distance.
            let pixel = 2f64.powi(-bits);
            let planets: Vec<Sphere> = (0..4)
                .map(|shell| Sphere {
                    center: DVec3::new(2.0, 0.0, 0.0) + random.vector(-1e-3, 1e-3),
                    radius: 1.0 - 0.05 * f64::from(shell),
                    color: [0; 3],
                })
                .collect();
            let scene = Scene::from_spheres(&planets).unwrap();
            let size = ScreenSize::Width(64.0 * pixel);
            let camera = Camera::orthographic(DVec3::ZERO, DVec3::X);
            let view = View::new(Camera { projection, size, ..camera }, image);
            // Of smaller pixels steps are so fine that offsets do not reach, and all is left to the
            // host.
            let share = if bits < 15 { 0.0 } else { 1.0 };
            check_whole(
                &mut gpu,
                &format!("{projection:?}, radii of 2^{bits} pixels"),
                &scene,
                &view,
                share,
            );
        }
    }
}

/// Balls side by side, from near by to so far away that squares of their distance would be beyond
/// f32.
#[test]
fn balls_far_away_are_seen() {
    let mut gpu = gpu();
    let image = ImageSize { width: 64, height: 64 };
    let balls: Vec<Sphere> = (0..9)
        .map(|k| Sphere {
            center: DVec3::new(0.0, f64::from(k % 3 - 1) * 4.0, f64::from(k / 3 - 1) * 4.1),
            radius: 1.0 + 0.1 * f64::from(k),
            color: [0; 3],
        })
        .collect();
    let scene = Scene::from_spheres(&balls).unwrap();
    for projection in [Projection::Orthographic, Projection::Perspective] {
        for bits in 4..100 {
            let distance = 2f64.powi(bits);
            let width = if projection == Projection::Perspective { 14.0 / distance } else { 14.0 };
            let camera = Camera::orthographic(DVec3::new(-distance, 0.0, 0.0), DVec3::X);
            let view =
                View::new(Camera { projection, size: ScreenSize::Width(width), ..camera }, image);
            let share = if bits < 34 { 0.01 } else { 1.0 };
            check_whole(&mut gpu, &format!("{projection:?}, 2^{bits} away"), &scene, &view, share);
        }
    }
}

#[test]
fn an_empty_scene_or_list_is_background() {
    let mut gpu = gpu();
    let scene = Scene::from_spheres(&[]).unwrap();
    let view = View::new(camera(0.0, Projection::Orthographic), IMAGE);
    let ids = draw(&mut gpu, &scene, &view, Region::whole(IMAGE));
    assert!(ids.iter().all(|&id| id == NONE));
}

#[test]
fn spheres_are_sent_once() {
    let mut gpu = gpu();
    let scene = cloud(61, 1000, 0.1..0.2, 0.0);
    for step in 0..3 {
        let camera = Camera {
            origin: DVec3::splat(-0.1 * f64::from(step)),
            ..camera(0.0, Projection::Orthographic)
        };
        gpu.draw(&scene, &View::new(camera, IMAGE), Region::whole(IMAGE)).unwrap();
        assert_eq!(gpu.gpu.activity().0, 16_000, "bytes sent by picture {step}");
    }
}
