//! What a program that uses the library may count on: many threads and scenes on one renderer,
//! errors in place of wrong pictures, an end within milliseconds, bounded memory.

use std::{
    fmt::Debug,
    fs,
    process::Command,
    sync::{
        Arc, Barrier, Mutex,
        atomic::{AtomicUsize, Ordering},
        mpsc,
    },
    thread,
    time::{Duration, Instant},
};

use planisphere::{
    Camera, Device, Difference, Error, Hit, Job, Look, Part, Picture, Region, Renderer, Request,
    Scene, Sphere, Spheres,
};

/// Spheres of which one in a hundred is ten times as large as the others.
fn unlike(count: u32) -> Spheres {
    let sphere = |k: u32| {
        let at = |m: u32| f64::from(k.wrapping_mul(m) >> 16) / 655.36;
        let radius = if k.is_multiple_of(100) { 2.0 } else { 0.2 };
        let center = [at(2654435761), at(2246822519), at(3266489917)];
        Sphere { center, radius, color: [k as u8, 200, 100] }
    };
    (0..count).map(sphere).collect()
}

/// Equal spheres in a cube, in `f32`.
fn many(count: u32, radius: f64) -> Scene {
    let at = |k: u32, m: u32| (k.wrapping_mul(m) >> 8) as f32 / 167_772.16;
    let center = |k: u32| [at(k, 2654435761), at(k, 2246822519), at(k, 3266489917)];
    Scene::new(Spheres::points((0..count).map(center).collect::<Vec<_>>(), radius)).unwrap()
}

fn seen_whole(scene: &Scene, size: [u32; 2]) -> Request {
    Request::new(scene, Camera::isometric().fit(scene, size), size).unwrap()
}

/// `PLANISPHERE_ROUNDS=300` draws as many fresh scenes in each way; the default is for every day.
fn rounds(usual: usize) -> usize {
    std::env::var("PLANISPHERE_ROUNDS")
        .map_or(usual, |rounds| rounds.parse().expect("a number of rounds"))
}

/// Fails when some work is not done in time: a deadlock would otherwise hold up the tests for ever.
fn within(limit: Duration, what: &str, work: impl FnOnce() + Send + 'static) {
    let limit = if cfg!(debug_assertions) { 20 * limit } else { limit };
    let (done, waits) = mpsc::channel();
    let worker = thread::spawn(move || {
        work();
        let _ = done.send(());
    });
    match waits.recv_timeout(limit) {
        Err(mpsc::RecvTimeoutError::Timeout) => panic!("{what}: not done within {limit:?}"),
        _ => worker.join().unwrap(),
    }
}

/// One renderer draws fresh scenes, several of each at once, from inside of pools, from threads,
/// and by jobs.
fn together(device: Device, rounds: usize) {
    let renderer = Renderer::open(&device).unwrap();
    for threads in [2, 4] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        for callers in [2, 8] {
            for round in 0..rounds {
                let scene = Scene::new(unlike(100_000)).unwrap();
                let request = seen_whole(&scene, [320, 180]);
                let start = Barrier::new(callers);
                let draw = |number: usize| {
                    start.wait();
                    match number % 4 {
                        0 => renderer.draw(&request).unwrap(),
                        1 => renderer.start(request.clone()).wait().unwrap(),
                        _ => pool.install(|| renderer.draw(&request).unwrap()),
                    }
                };
                let all: Vec<Picture> = thread::scope(|scope| {
                    let callers: Vec<_> =
                        (0..callers).map(|number| scope.spawn(move || draw(number))).collect();
                    callers.into_iter().map(|caller| caller.join().unwrap()).collect()
                });
                assert!(all[0].ids().iter().any(|&id| id >= 0));
                assert!(
                    all.iter().all(|one| one.ids() == all[0].ids() && one.rgba() == all[0].rgba()),
                    "round {round}, {threads} threads, {callers} callers"
                );
            }
        }
    }
}

#[test]
fn a_fresh_scene_is_drawn_by_many_at_once_on_the_cpu() {
    let rounds = rounds(25);
    let limit = Duration::from_secs(60 + 2 * rounds as u64);
    within(limit, "draws at once", move || together(Device::Cpu, rounds));
}

#[test]
fn a_fresh_scene_is_drawn_by_many_at_once_on_the_gpu() {
    let rounds = rounds(3);
    let limit = Duration::from_secs(120 + 4 * rounds as u64);
    within(limit, "draws at once", move || together(Device::Gpu, rounds));
}

#[test]
fn five_hundred_draws_at_once() {
    within(Duration::from_secs(120), "500 draws", || {
        for device in [Device::Cpu, Device::Gpu] {
            let renderer = Renderer::open(&device).unwrap();
            let scene = Scene::new(unlike(20_000)).unwrap();
            let request = seen_whole(&scene, [160, 120]);
            let first = renderer.draw(&request).unwrap();
            thread::scope(|scope| {
                for number in 0..500 {
                    let (renderer, request, first) = (&renderer, &request, &first);
                    scope.spawn(move || {
                        let picture = match number % 2 {
                            0 => renderer.draw(request),
                            _ => renderer.start(request.clone()).wait(),
                        };
                        assert!(picture.unwrap().ids() == first.ids());
                    });
                }
            });
        }
    });
}

#[test]
fn a_pool_that_draws_inside_of_a_loop_does_not_wait_for_itself() {
    use rayon::prelude::*;
    within(Duration::from_secs(60), "draws in a parallel loop", || {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(4).build().unwrap();
        for device in [Device::Cpu, Device::Gpu] {
            let renderer = Renderer::open(&device).unwrap().in_flight(1);
            // Fresh scenes are put into order, in pieces of pieces.
            for _ in 0..20 {
                let request = seen_whole(&Scene::new(unlike(50_000)).unwrap(), [160, 120]);
                let first = renderer.draw(&request).unwrap();
                let same = || renderer.draw(&request).unwrap().ids() == first.ids();
                assert!(pool.install(|| (0..16).into_par_iter().all(|_| same())));
            }
        }
    });
}

/// Numbers that are no camera, or that no picture has.
const STRANGE: [f64; 16] = [
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
    0.0,
    -0.0,
    -1.0,
    f64::MIN_POSITIVE,
    5e-324,
    f64::MAX,
    f64::MIN,
    1e300,
    1e-300,
    1.0,
    180.0,
    1e6,
    4503599627370497.5,
];

#[test]
fn a_camera_turns_about_a_line() {
    let camera = Camera::orthographic([5.0, 2.0, 1.0], [-1.0, 0.0, 0.0], 4.0).unwrap();
    let turned = |part| camera.turned([1.0, 2.0, 3.0], [0.0, 0.0, 0.5], part, 4).unwrap();
    assert_eq!((turned(1).eye(), turned(1).direction()), ([1.0, 6.0, 1.0], [0.0, -1.0, 0.0]));
    assert_eq!((turned(2).eye(), turned(2).direction()), ([-3.0, 2.0, 1.0], [1.0, 0.0, 0.0]));
    assert_eq!((turned(0), turned(4)), (camera, camera));
}

#[test]
fn what_has_no_picture_is_an_error() {
    let camera = Camera::orthographic([0.0; 3], [1.0, 0.0, 0.0], 4.0).unwrap();
    let nan = [0.0, f64::NAN, 0.0];
    let inf = [f64::INFINITY, 0.0, 0.0];
    let field = |result: Result<Camera, Error>| match result {
        Err(error @ Error::Camera { .. }) => {
            let Error::Camera { field, .. } = error else { unreachable!() };
            assert!(error.fix().is_some(), "{error}");
            field
        }
        other => panic!("{other:?}"),
    };
    let x = [1.0, 0.0, 0.0];
    assert_eq!(field(Camera::orthographic(nan, x, 1.0)), "origin");
    assert_eq!(field(Camera::orthographic(inf, x, 1.0)), "origin");
    assert_eq!(field(Camera::orthographic([0.0; 3], nan, 1.0)), "view");
    assert_eq!(field(Camera::orthographic([0.0; 3], [0.0; 3], 1.0)), "view");
    assert_eq!(field(camera.up(nan)), "up");
    assert_eq!(field(camera.up([0.0; 3])), "up");
    assert_eq!(field(camera.up([-2.0, 0.0, 0.0])), "up");
    // What is up gives way where it was not said.
    camera.look([0.0; 3], [0.0, 0.0, -1.0]).unwrap();
    let tilted = camera.up([0.0, 1.0, 1.0]).unwrap();
    assert_eq!(field(tilted.look([0.0; 3], [0.0, 1.0, 1.0])), "up");
    for (near, far) in [(3.0, 2.0), (2.0, 2.0), (-1.0, 2.0), (f64::NAN, 2.0), (0.0, f64::NAN)] {
        assert_eq!(field(camera.clip(near..far)), "clip", "{near} {far}");
    }
    assert_eq!(field(camera.turned(nan, x, 1, 4)), "about");
    assert_eq!(field(camera.turned([0.0; 3], [0.0; 3], 1, 4)), "axis");
    assert_eq!(field(camera.turned([0.0; 3], inf, 1, 4)), "axis");
    assert_eq!(field(camera.turned([0.0; 3], x, 1, 0)), "of");
    assert_eq!(field(camera.turned([f64::MAX, 0.0, 0.0], [0.0, 0.0, 1.0], 1, 2)), "origin");
    for height in [0.0, -4.0, f64::INFINITY, f64::NAN] {
        assert_eq!(field(Camera::orthographic([0.0; 3], x, height)), "height");
        assert_eq!(field(Camera::perspective([0.0; 3], x, height)), "fov");
    }
    assert_eq!(field(Camera::perspective([0.0; 3], x, 180.0)), "fov");

    let scene = Scene::new(unlike(10)).unwrap();
    for size in [[0, 0], [0, 6], [8, 0], [32_769, 6], [8, 32_769], [100_000, 2], [u32::MAX, 1]] {
        let refused = Request::new(&scene, camera, size);
        assert!(matches!(refused, Err(Error::Size { limit: 32_768, .. })), "{size:?}");
    }
    let request = Request::new(&scene, camera, [8, 6]).unwrap();
    let regions = [
        [0, 0, 0, 0],
        [0, 0, 8, 0],
        [1, 0, 8, 6],
        [8, 0, 1, 1],
        [u32::MAX, 0, 8, 6],
        [0, 2, 8, u32::MAX],
    ];
    for [x, y, width, height] in regions {
        let region = Region { x, y, width, height };
        let error = request.clone().region(region).unwrap_err();
        assert!(matches!(error, Error::Region { size: [8, 6], .. }) && error.fix().is_some());
        assert!(Renderer::cpu().pick(&request, [8, 0]).is_err());
    }
}

#[test]
fn spheres_that_have_no_picture_are_named() {
    let ball = |radius| Sphere { center: [0.0; 3], radius, color: [0; 3] };
    let refused = |spheres| Scene::new(spheres).unwrap_err();
    for value in [0.0, -1.0, f64::INFINITY, f64::NAN] {
        let more = [ball(1.0), ball(value)].into_iter().collect();
        let spheres = Spheres::points(vec![[0.0; 3]; 5], 1.0).and(more);
        match refused(spheres) {
            Error::Sphere { index: 6, field: "radius", value: found } => {
                assert!(found == value || found.is_nan() && value.is_nan());
            }
            other => panic!("{other:?}"),
        }
    }
    let error = refused(Spheres::xyzr(vec![[0.0, 0.0, f32::NAN, 1.0]]));
    assert!(matches!(error, Error::Sphere { index: 0, field: "z", .. }), "{error}");
    let points = || Spheres::points(vec![[0.0; 3]; 5], 1.0);
    let error = refused(points().radii(vec![1.0; 4]));
    assert!(matches!(error, Error::Length { what: "radii", found: 4, wanted: 5 }), "{error}");
    let error = refused(points().and(points()).colors(vec![[0; 3]; 11]));
    assert!(matches!(error, Error::Length { what: "colors", found: 11, wanted: 10 }), "{error}");
    let scene = Scene::new(points()).unwrap();
    let error = scene.recolored(vec![[1; 3]; 6]).unwrap_err();
    assert!(matches!(error, Error::Length { what: "colors", found: 6, wanted: 5 }), "{error}");
    assert_eq!((scene.get(4).map(|ball| ball.radius), scene.get(5)), (Some(1.0), None));
    // Colours of several blocks, each with its own.
    let colors: Vec<[u8; 3]> = (0..10).map(|k| [k; 3]).collect();
    let scene = Scene::new(points().and(points()).colors(colors)).unwrap();
    assert_eq!(scene.get(7).unwrap().color, [7; 3]);
}

/// Numbers of all kinds, some of them strange.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    fn real(&mut self) -> f64 {
        match self.next() % 4 {
            0 => STRANGE[(self.next() % 16) as usize],
            1 => f64::from_bits(self.next()),
            _ => (self.next() % 2000) as f64 / 100.0 - 10.0,
        }
    }

    fn vector(&mut self) -> [f64; 3] {
        [self.real(), self.real(), self.real()]
    }
}

#[test]
fn no_camera_and_no_request_panics() {
    let mut numbers = Numbers(1);
    let renderers = [Renderer::cpu(), Renderer::open(&Device::Gpu).unwrap()];
    let scene = Scene::new(unlike(50)).unwrap();
    let (mut drawn, mut refused) = (0, 0);
    for case in 0..2000 {
        let (eye, direction, size) = (numbers.vector(), numbers.vector(), numbers.real());
        let camera = match numbers.next() % 3 {
            0 => Camera::perspective(eye, direction, size),
            1 => Camera::orthographic(eye, direction, size),
            _ => Ok(Camera::isometric()),
        };
        let camera = camera
            .and_then(|camera| match numbers.next() % 3 {
                0 => camera.up(numbers.vector()),
                1 => camera.clip(numbers.real()..numbers.real()),
                _ => Ok(camera),
            })
            .map(|camera| match numbers.next() % 3 {
                0 => camera.orbit(numbers.vector(), numbers.real(), numbers.real()),
                1 => camera.fit(&scene, [numbers.next() as u32 % 9, 7]),
                _ => camera,
            });
        let Ok(camera) = camera else {
            refused += 1;
            continue;
        };
        let _ = (camera.ray([9, 9], [3, 4]), camera.project([9, 9], numbers.vector()));
        let size = [numbers.next() as u32 % 12, numbers.next() as u32 % 12];
        let Ok(request) = Request::new(&scene, camera, size) else {
            refused += 1;
            continue;
        };
        let mut side = || numbers.next() as u32 % 14;
        let region = Region { x: side(), y: side(), width: side(), height: side() };
        let request = request.clone().region(region).unwrap_or(request).with_depth();
        let pictures: Vec<_> =
            renderers.iter().map(|renderer| renderer.draw(&request).unwrap()).collect();
        let [cpu, gpu] = &pictures[..] else { unreachable!() };
        assert!(cpu.ids() == gpu.ids() && cpu.rgba() == gpu.rgba(), "case {case}: {camera:?}");
        let depths =
            |picture: &Picture| picture.depth().iter().map(|d| d.to_bits()).collect::<Vec<_>>();
        assert_eq!(depths(cpu), depths(gpu), "case {case}: {camera:?}");
        drawn += 1;
    }
    assert!(drawn > 300 && refused > 300, "{drawn} drawn, {refused} refused");
}

#[test]
fn progress_never_falls_and_is_one_at_the_end() {
    for device in [Device::Cpu, Device::Gpu] {
        let renderer = Renderer::open(&device).unwrap();
        for (count, size) in [(1_000_000, [4000, 3000]), (300, [64, 48]), (0, [10, 10])] {
            let job = renderer.start(seen_whole(&many(count, 0.2), size).with_depth());
            let progress = job.progress();
            let (mut last, mut between) = (0.0, 0);
            while last < 1.0 {
                let now = progress();
                assert!((last..=1.0).contains(&now), "{last} {now}");
                between += usize::from(now > last && now < 1.0);
                last = now;
                thread::yield_now();
            }
            job.wait().unwrap();
            assert_eq!(progress(), 1.0);
            assert!(count < 1_000_000 || between >= 10, "{device}: {between} values between");
        }
    }
}

#[test]
fn a_job_of_which_something_is_made_ends_at_one() {
    let renderer = Renderer::cpu();
    let job = renderer.start_with(seen_whole(&many(10, 1.0), [8, 8]), |_| Ok(()));
    let progress = job.progress();
    job.wait().unwrap();
    assert_eq!(progress(), 1.0);
}

#[test]
fn a_job_that_is_dropped_or_waits_is_cancelled() {
    let renderer = Renderer::cpu().in_flight(1);
    let scene = many(2_000_000, 0.05);
    let (long, short) = (seen_whole(&scene, [16_384, 16_384]), seen_whole(&scene, [10, 10]));
    let first = renderer.start(long.clone());
    let second = renderer.start(long.clone());
    let third = renderer.start(short);
    let begin = Instant::now();
    // One that waits for its turn ends at once.
    second.canceller()();
    assert!(matches!(second.wait(), Err(Error::Cancelled)));
    assert!(begin.elapsed() < Duration::from_secs(2), "{:?}", begin.elapsed());
    assert!(!format!("{first:?}").contains("done"), "it did not wait for the first: {first:?}");
    drop(first);
    assert_eq!(third.wait().unwrap().size(), [10, 10]);
}

#[test]
fn whoever_holds_a_turn_draws_in_it() {
    within(Duration::from_secs(60), "a picture inside of another's turn", || {
        let renderer = Renderer::cpu().in_flight(1);
        let request = seen_whole(&many(1000, 1.0), [80, 60]);
        let first = renderer.draw(&request).unwrap();
        let (inner, again) = (renderer.clone(), request.clone());
        let job = renderer.start_with(request.clone(), move |_| inner.draw(&again));
        assert!(job.wait().unwrap().ids() == first.ids());
        let mut bands = 0;
        let sink = |_: &Picture| {
            assert!(renderer.draw(&request).unwrap().ids() == first.ids());
            bands += 1;
            std::ops::ControlFlow::Continue(())
        };
        renderer.draw_bands(&request, sink).unwrap();
        assert_eq!(bands, 1);
    });
    let many = Renderer::cpu().threads(100_000);
    assert!(matches!(many, Err(Error::Size { what: "threads", limit: 1024, .. })));
}

#[test]
fn a_panic_in_a_job_goes_on_where_it_is_waited_for() {
    let renderer = Renderer::cpu();
    let request = seen_whole(&many(10, 1.0), [8, 8]);
    let job: Job<()> = renderer.start_with(request.clone(), |_| panic!("on purpose"));
    let panic = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| job.wait())).unwrap_err();
    assert_eq!(panic.downcast_ref(), Some(&"on purpose"));
    renderer.draw(&request).unwrap();
}

#[test]
fn a_job_is_a_future() {
    let renderer = Renderer::cpu();
    let scene = many(1000, 1.0);
    let request = seen_whole(&scene, [80, 60]);
    let jobs: Vec<Job> = (0..20).map(|_| renderer.start(request.clone())).collect();
    let first = renderer.draw(&request).unwrap();
    let all = async {
        for job in jobs {
            assert!(job.await.unwrap().ids() == first.ids());
        }
    };
    pollster::block_on(all);
}

#[test]
fn pictures_go_into_memory_of_the_caller() {
    for device in [Device::Cpu, Device::Gpu] {
        let renderer = Renderer::open(&device).unwrap();
        let request = seen_whole(&Scene::new(unlike(3000)).unwrap(), [200, 100]).with_depth();
        let whole = renderer.draw(&request).unwrap();
        let pixels = 20_000;
        let (mut rgba, mut ids, mut depth) =
            (vec![[9; 4]; pixels], vec![9; pixels], vec![9.0; pixels]);
        renderer.draw_to(&request, &mut rgba, &mut ids, &mut depth).unwrap();
        assert!(rgba == whole.rgba() && ids == whole.ids() && depth == whole.depth());
        ids.fill(9);
        renderer.draw_to(&request, &mut [], &mut ids, &mut []).unwrap();
        assert!(ids == whole.ids());
        let short = renderer.draw_to(&request, &mut [], &mut ids[1..], &mut []);
        assert!(matches!(short, Err(Error::Length { what: "ids", found: 19_999, wanted: 20_000 })));
        // Memory of one picture is that of the next, also of another size.
        let mut picture = Picture::default();
        for size in [[200, 100], [100, 50], [200, 100]] {
            let request = seen_whole(request.scene(), size);
            renderer.draw_into(&request, &mut picture).unwrap();
            assert_eq!((picture.size(), picture.depth().len()), (size, 0));
            assert!(picture.compare(&renderer.draw(&request).unwrap()).is_none());
        }
        let mut rows = Vec::new();
        let mut sink = |band: &Picture| {
            rows.extend_from_slice(band.ids());
            std::ops::ControlFlow::Continue(())
        };
        renderer.draw_bands(&request, &mut sink).unwrap();
        assert!(rows == whole.ids());
        let ended = renderer.draw_bands(&request, |_| std::ops::ControlFlow::Break(()));
        assert!(matches!(ended, Err(Error::Cancelled)));
    }
}

#[test]
fn a_pixel_is_picked_as_it_is_drawn() {
    let scene = Scene::new(unlike(3000)).unwrap();
    let camera = Camera::perspective([-4.0, 50.0, 50.0], [1.0, 0.1, 0.0], 50.0).unwrap();
    let request = Request::new(&scene, camera, [200, 100]).unwrap();
    let renderer = Renderer::cpu();
    let picture = renderer.draw(&request.clone().with_depth()).unwrap();
    let (mut hits, mut misses) = (0, 0);
    for (column, row) in (0..200).step_by(7).flat_map(|x| (0..100).step_by(5).map(move |y| (x, y)))
    {
        let picked = renderer.pick(&request, [column, row]).unwrap();
        assert_eq!(picked, picture.hit([column, row]));
        let at = (row * 200 + column) as usize;
        let Some(Hit { index, depth, point, normal, inside, .. }) = picked else {
            assert_eq!(picture.ids()[at], -1);
            misses += 1;
            continue;
        };
        hits += 1;
        assert_eq!((index as i32, depth as f32), (picture.ids()[at], picture.depth()[at]));
        assert!(!inside);
        let Sphere { center, radius, .. } = scene.get(index).unwrap();
        let off: Vec<f64> = (0..3).map(|k| point[k] - center[k]).collect();
        let length = off.iter().map(|x| x * x).sum::<f64>().sqrt();
        assert!((length / radius - 1.0).abs() < 1e-9, "{length} {radius}");
        assert!((0..3).all(|k| (off[k] / length - normal[k]).abs() < 1e-9));
        let [x, y, away] = camera.project([200, 100], point).unwrap();
        assert!((x - f64::from(column)).abs() < 1e-6 && (y - f64::from(row)).abs() < 1e-6);
        assert!((away / depth - 1.0).abs() < 1e-9);
    }
    assert!(hits > 20 && misses > 50, "{hits} hits, {misses} misses");
    // A region's pixels count from its own corner.
    let region = Region { x: 60, y: 30, width: 100, height: 50 };
    let part = renderer.draw(&request.region(region).unwrap()).unwrap();
    for (column, row) in (0..100).step_by(3).flat_map(|x| (0..50).step_by(3).map(move |y| (x, y))) {
        assert_eq!(part.hit([column, row]), picture.hit([60 + column, 30 + row]));
    }
    assert_eq!(part.hit([100, 0]), None);
    // Numbers whose squares are beyond f64.
    let far = Sphere { center: [2e200, 0.0, 0.0], radius: 1e200, color: [0; 3] };
    let far = Scene::new([far].into_iter().collect()).unwrap();
    let camera = Camera::orthographic([0.0; 3], [1.0, 0.0, 0.0], 1.0).unwrap();
    let hit = renderer.pick(&Request::new(&far, camera, [1, 1]).unwrap(), [0, 0]);
    assert_eq!(hit.unwrap().unwrap().normal, [-1.0, 0.0, 0.0]);
    // From inside of a sphere its far wall is seen.
    let ball = Scene::new(Spheres::points(vec![[0.0; 3]], 2.0)).unwrap();
    let inside = Camera::orthographic([0.0; 3], [1.0, 0.0, 0.0], 1.0).unwrap();
    let request = Request::new(&ball, inside, [1, 1]).unwrap();
    let hit = renderer.pick(&request, [0, 0]).unwrap().unwrap();
    assert_eq!((hit.point, hit.normal, hit.inside), ([2.0, 0.0, 0.0], [1.0, 0.0, 0.0], true));
}

#[test]
fn a_fitted_camera_sees_every_sphere_and_little_else() {
    let scene = many(3000, 5.0);
    let renderer = Renderer::cpu();
    for size in [[300, 200], [100, 300], [64, 64]] {
        let direction = [-1.0, -0.3, -0.4];
        for (camera, least) in [
            (Camera::isometric(), 0.85),
            (Camera::orthographic([1e9, 0.0, 0.0], direction, 1e-3).unwrap(), 0.85),
            (Camera::perspective([1.0; 3], direction, 40.0).unwrap(), 0.7),
            // The corner that is nearest takes most of a wide view.
            (Camera::perspective([1.0; 3], direction, 120.0).unwrap(), 0.5),
        ] {
            let fitted = camera.fit(&scene, size);
            let picture = renderer.draw(&Request::new(&scene, fitted, size).unwrap()).unwrap();
            let [width, height] = size.map(|side| side as usize);
            let seen = |at: usize| picture.ids()[at] >= 0;
            let column = |x: usize| (0..height).any(|y| seen(y * width + x));
            let row = |y: usize| (0..width).any(|x| seen(y * width + x));
            let edge = [column(0), column(width - 1), row(0), row(height - 1)];
            assert_eq!(edge, [false; 4], "{fitted:?}");
            // Along one of the two sides little is left.
            let columns = (0..width).filter(|&x| column(x)).count() as f64 / width as f64;
            let rows = (0..height).filter(|&y| row(y)).count() as f64 / height as f64;
            assert!(columns.max(rows) > least, "{columns} {rows} {fitted:?}");
        }
    }
    // What cannot be framed leaves the camera as it is, or finds one; nothing panics.
    let far = |x: f64| [Sphere { center: [x, 0.0, 0.0], radius: 1.0, color: [0; 3] }];
    for x in [0.0, 1e300, f64::MAX, 5e-324] {
        let scene = Scene::new(far(x).into_iter().collect()).unwrap();
        let _ = Camera::isometric().fit(&scene, [64, 64]);
    }
    let none = Scene::new(Spheres::default()).unwrap();
    let request = Request::new(&none, Camera::isometric().fit(&none, [4, 4]), [4, 4]).unwrap();
    assert_eq!(renderer.draw(&request).unwrap().ids(), [-1; 16]);
    assert_eq!(request.why_empty(), "the scene has no spheres");
}

#[test]
fn requests_come_in_turn_and_few_at_a_time() {
    let renderer = Renderer::cpu().in_flight(2);
    let scene = many(100_000, 0.4);
    let (now, most) = (Arc::new(AtomicUsize::new(0)), Arc::new(AtomicUsize::new(0)));
    let order = Arc::new(Mutex::new(Vec::new()));
    let before = peak();
    let jobs: Vec<Job<usize>> = (0..200)
        .map(|number| {
            let (now, most, order) = (Arc::clone(&now), Arc::clone(&most), Arc::clone(&order));
            renderer.start_with(seen_whole(&scene, [1920, 1080]), move |picture| {
                most.fetch_max(now.fetch_add(1, Ordering::SeqCst) + 1, Ordering::SeqCst);
                order.lock().unwrap().push(number);
                let mut png = Vec::new();
                picture.write_png(&mut png)?;
                now.fetch_sub(1, Ordering::SeqCst);
                Ok(png.len())
            })
        })
        .collect();
    let sizes: Vec<usize> = jobs.into_iter().map(|job| job.wait().unwrap()).collect();
    assert!(sizes.iter().all(|&size| size == sizes[0]));
    assert!(most.load(Ordering::SeqCst) <= 2, "pictures are only held in their turn");
    let order = order.lock().unwrap();
    // Two under way may end the other way round.
    assert!(order.iter().enumerate().all(|(at, number)| at.abs_diff(*number) <= 3), "{order:?}");
    if let (Some(before), Some(after)) = (before, peak()) {
        // Ids, colours and PNG of two pictures, their workspaces, the order of the scene.
        let grown = after - before;
        assert!(grown < 150 << 20, "{} MB for two pictures at a time", grown >> 20);
    }
}

/// The greatest memory of this process so far, where the system tells.
fn peak() -> Option<u64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(line.trim().strip_suffix(" kB")?.parse::<u64>().ok()? << 10)
}

#[test]
fn two_scenes_on_one_renderer_are_each_put_into_order_once() {
    let renderer = Renderer::cpu();
    let scenes = [many(200_000, 0.2), many(200_000, 0.3)];
    let bytes = scenes.iter().map(Scene::memory).sum::<u64>();
    for _ in 0..3 {
        scenes.iter().for_each(|scene| drop(renderer.draw(&seen_whole(scene, [64, 64])).unwrap()));
    }
    assert!(scenes.iter().map(Scene::memory).sum::<u64>() > bytes, "both are in order");
    let scene = many(200_000, 0.2);
    let before = scene.memory();
    scene.prepare();
    assert!(scene.memory() > before);
    let other = scene.recolored(vec![[1, 2, 3]; 200_000]).unwrap();
    assert!(other.memory() > before + 600_000, "the order stays");
    let request = seen_whole(&other, [64, 64]);
    let (a, b) = (renderer.draw(&request).unwrap(), renderer.draw(&seen_whole(&scene, [64, 64])));
    assert!(a.ids() == b.unwrap().ids() && a.rgba().contains(&[1, 2, 3, 255]));
}

#[test]
fn parts_make_the_whole() {
    let renderer = Renderer::cpu();
    let all: Vec<[f32; 4]> = {
        let scene = Scene::new(unlike(9000)).unwrap();
        let record = |k: usize| {
            let ball = scene.get(k).unwrap();
            let [x, y, z] = ball.center.map(|x| x as f32);
            [x, y, z, ball.radius as f32]
        };
        (0..9000).map(record).collect()
    };
    let colors: Vec<[u8; 3]> = (0..9000).map(|k| [k as u8, 7, 200]).collect();
    let scene = |range: std::ops::Range<usize>| {
        let colors = colors[range.clone()].to_vec();
        Scene::new(Spheres::xyzr(&all[range]).colors(colors)).unwrap()
    };
    let size = [160, 120];
    let camera = Camera::isometric().fit(&scene(0..9000), size);
    let look = Look::new().background([1, 2, 3]);
    let request =
        |scene: &Scene| Request::new(scene, camera, size).unwrap().look(look.clone()).with_depth();
    let whole = renderer.draw(&request(&scene(0..9000))).unwrap();
    let half = |x| Region { x, y: 0, width: 80, height: 120 };
    let mut parts = Vec::new();
    for (first, end) in [(0, 4000), (4000, 9000)] {
        for x in [0, 80] {
            let request = request(&scene(first..end)).region(half(x)).unwrap();
            parts.push(renderer.draw_part(&request, first as u64).unwrap());
        }
    }
    assert_eq!(parts[0].missing(), Some((0..4000, half(80))));
    assert_eq!(parts[2].missing(), Some((0..4000, Region { x: 0, y: 0, width: 160, height: 120 })));
    let left = Part::merge([parts[0].clone(), parts[2].clone()]).unwrap();
    assert_eq!(left.missing(), Some((0..9000, half(80))));
    let right = Part::merge([parts[3].clone(), parts[1].clone()]).unwrap();
    let mut bytes = Vec::new();
    right.write(&mut bytes).unwrap();
    let merged = Part::merge([Part::read(bytes.clone()).unwrap(), left]).unwrap();
    assert_eq!(merged.missing(), None);
    let picture = merged.picture(&look).unwrap();
    assert!(picture.ids() == whole.ids() && picture.rgba() == whole.rgba());
    assert!(picture.depth() == whole.depth());
    for pixel in [[80, 60], [40, 30], [0, 0]] {
        assert_eq!(picture.hit(pixel), whole.hit(pixel));
    }
    let [mut one, mut other] = [Vec::new(), Vec::new()];
    picture.write_png(&mut one).unwrap();
    whole.write_png(&mut other).unwrap();
    assert!(one == other, "the same bytes");
    bytes.truncate(1000);
    assert!(matches!(Part::read(bytes), Err(Error::Parts { .. })));
    let twice = Part::merge([parts[0].clone(), parts[0].clone()]);
    assert!(matches!(twice, Err(Error::Parts { .. })));
}

#[test]
fn pictures_are_saved_whole_and_compared() {
    let folder = tempfile::tempdir().unwrap();
    let renderer = Renderer::cpu();
    let scene = Scene::new(unlike(500)).unwrap();
    let request = seen_whole(&scene, [64, 48]);
    let picture = renderer.draw(&request).unwrap();
    let path = folder.path().join("a.png");
    picture.save(&path).unwrap();
    let mut bytes = Vec::new();
    picture.write_png(&mut bytes).unwrap();
    assert!(fs::read(&path).unwrap() == bytes);
    let error = picture.save(folder.path().join("a.jpg")).unwrap_err();
    assert!(matches!(error, Error::Write { .. }) && error.fix().is_some(), "{error}");
    let error = picture.save(folder.path().join("none/a.png")).unwrap_err();
    assert!(error.to_string().contains("there is no folder"), "{error}");
    let ids = renderer.draw(&request.clone().without_color()).unwrap();
    assert!(matches!(ids.save(&path), Err(Error::NoPlane { plane: "colors" })));
    assert!(fs::read(&path).unwrap() == bytes);

    assert_eq!(picture.compare(&picture), Difference::default());
    let other = renderer.draw(&request.look(Look::new().background([0, 0, 9]))).unwrap();
    let difference = picture.compare(&other);
    let background = picture.ids().iter().filter(|&&id| id < 0).count() as u64;
    assert_eq!((difference.pixels, difference.greatest), (background, 9));
    assert_eq!(difference.first[0], ([0, 0], [0, 0, 0, 255], [0, 0, 9, 255]));
    let small = renderer.draw(&seen_whole(&scene, [8, 8])).unwrap();
    assert_eq!(picture.compare(&small).pixels, 64 * 48);
}

#[test]
fn files_of_a_job_are_whole_or_none() {
    use planisphere::files::{Sinks, Target};

    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name);
    let renderer = Renderer::cpu();
    let scene = many(200_000, 0.3);
    let request = seen_whole(&scene, [3000, 2000]);
    let mut sinks = Sinks::default();
    sinks.picture = Some(Target::File(file("a.png")));
    sinks.ids = Some(Target::File(file("a.npy")));
    sinks.depth = Some(Target::File(file("d.npy")));
    sinks.part = Some(Target::File(file("a.npz")));
    let job = renderer.start_render(request.clone(), sinks.clone());
    let progress = job.progress();
    let (staged, report) = job.wait().unwrap();
    assert!(progress() == 1.0 && report.seen && report.depth > 0.0);
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0, "none before it is committed");
    assert!(staged.commit().unwrap().is_empty());
    let picture = renderer.draw(&request).unwrap();
    let mut bytes = Vec::new();
    picture.write_png(&mut bytes).unwrap();
    assert!(fs::read(file("a.png")).unwrap() == bytes);
    let part = Part::read(fs::read(file("a.npz")).unwrap()).unwrap();
    assert!(part.picture(&Look::new()).unwrap().ids() == picture.ids());
    // What is cancelled leaves what was there before.
    let large = seen_whole(&scene, [12_000, 12_000]);
    for wait in [0, 100, 500, 1500] {
        let job = renderer.start_render(large.clone(), sinks.clone());
        thread::sleep(Duration::from_millis(wait));
        drop(job);
    }
    assert!(fs::read(file("a.png")).unwrap() == bytes);
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 4);
    // So is what is made of a picture in its turn.
    let job = renderer.start_with(large, |picture| picture.write_png(&mut Vec::new()));
    let (progress, cancel) = (job.progress(), job.canceller());
    while progress() < 0.72 {
        thread::yield_now();
    }
    cancel();
    assert!(matches!(job.wait(), Err(Error::Cancelled)));
}

#[test]
fn a_scene_whose_files_change_has_no_picture() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name);
    let made = Command::new(env!("CARGO_BIN_EXE_planisphere"))
        .args(["make", "cloud", "cloud", "--count", "300000"])
        .current_dir(folder.path())
        .status();
    assert!(made.unwrap().success());
    let document = planisphere::read(file("cloud/scene.toml")).unwrap();
    let camera = document.camera([64, 64]).unwrap();
    let request = Request::new(&document.scene, camera, [64, 64]).unwrap();
    let renderer = Renderer::cpu();
    assert!(renderer.draw(&request).unwrap().ids().iter().any(|&id| id >= 0));
    let numbers = fs::read(file("cloud/centers.npy")).unwrap();
    fs::write(file("cloud/centers.npy"), numbers).unwrap();
    assert!(matches!(renderer.draw(&request), Err(Error::Changed { .. })));
    let job = planisphere::start_read(file("cloud/scene.toml"));
    let progress = job.progress();
    assert_eq!((job.wait().unwrap().scene.len(), progress()), (300_000, 1.0));
    // One that is dropped ends; one that was cancelled before it began is an error.
    drop(planisphere::start_read(file("cloud/scene.toml")));
    let job = planisphere::start_read(file("cloud/scene.toml"));
    job.canceller()();
    assert!(matches!(job.wait(), Err(Error::Cancelled) | Ok(_)));
    match planisphere::read(file("none.toml")) {
        Err(Error::File { path: Some(path), line: None, .. }) => {
            assert_eq!(path, file("none.toml"));
        }
        other => panic!("{other:?}"),
    }
    fs::write(file("bad.toml"), "[camera]\nwidth = \"four\"\n").unwrap();
    match planisphere::read(file("bad.toml")) {
        Err(Error::File { line: Some(2), column: Some(_), .. }) => {}
        other => panic!("{other:?}"),
    }
}

#[test]
fn everything_goes_anywhere() {
    fn is<T: Debug + Send + Sync + 'static>() {}
    fn is_cloned<T: Clone + Debug + Send + Sync + 'static>() {}
    is_cloned::<Sphere>();
    is_cloned::<Spheres>();
    is_cloned::<Scene>();
    is_cloned::<Camera>();
    is_cloned::<Region>();
    is_cloned::<Look>();
    is_cloned::<Request>();
    is_cloned::<Device>();
    is_cloned::<Renderer>();
    is_cloned::<Picture>();
    is_cloned::<Hit>();
    is_cloned::<Part>();
    is_cloned::<Difference>();
    is_cloned::<planisphere::Document>();
    is_cloned::<planisphere::Plan>();
    is_cloned::<planisphere::files::Sinks>();
    is::<Job>();
    is::<Error>();
    is::<planisphere::files::Staged>();
    is::<planisphere::files::Report>();
    assert!(format!("{:?}", Renderer::cpu()).contains("cpu"));
}

#[test]
fn errors_name_the_fix() {
    let errors = [
        Error::Sphere { index: 3, field: "x", value: f64::NAN },
        Error::Sphere { index: 3, field: "radius", value: 0.0 },
        Error::Length { what: "radii", found: 3, wanted: 4 },
        Error::Changing,
        Error::Size { what: "spheres", found: 0, limit: 4 },
        Error::Region { region: Region { x: 0, y: 0, width: 0, height: 1 }, size: [4, 4] },
        Error::Threads { words: "none".into() },
        Error::DeviceLost { words: "gone".into() },
        Error::NoPlane { plane: "depths" },
        Error::Palette,
    ];
    for error in errors {
        let words = error.to_string();
        assert!(!words.contains('\n') && error.fix().is_some_and(|fix| words.ends_with(&fix)));
        assert!(!words.contains("--"), "no words of a command line: {words}");
    }
}
