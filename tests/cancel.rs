//! How soon a picture ends after it was cancelled. One test, in a program of its own: others beside
//! it would take the time that is measured.

use std::{
    thread,
    time::{Duration, Instant},
};

use planisphere::{Camera, Device, Error, Job, Renderer, Request, Scene, Spheres};

/// Equal spheres in a cube, in `f32`.
fn many(count: u32, radius: f64) -> Scene {
    let at = |k: u32, m: u32| (k.wrapping_mul(m) >> 8) as f32 / 167_772.16;
    let center = |k: u32| [at(k, 2654435761), at(k, 2246822519), at(k, 3266489917)];
    Scene::new(Spheres::points((0..count).map(center).collect::<Vec<_>>(), radius)).unwrap()
}

fn seen_whole(scene: &Scene, size: [u32; 2]) -> Request {
    Request::new(scene, Camera::isometric().fit(scene, size), size).unwrap()
}

/// The shortest time from the call to the error, of some tries: others use the machine as well.
fn cancelled_after(wait: Duration, begin: impl Fn() -> Job) -> Duration {
    let mut shortest = Duration::MAX;
    for _ in 0..3 {
        let job = begin();
        let (progress, cancel) = (job.progress(), job.canceller());
        let asked = thread::spawn(move || {
            let end = Instant::now() + wait;
            let mut last = 0.0;
            while Instant::now() < end {
                let now = progress();
                assert!((last..=1.0).contains(&now), "progress falls: {last} {now}");
                last = now;
                thread::sleep(Duration::from_millis(1));
            }
            let asked = Instant::now();
            cancel();
            asked
        });
        let result = job.wait();
        let ended = Instant::now();
        let asked = asked.join().unwrap();
        assert!(matches!(result, Err(Error::Cancelled)), "{result:?} after {wait:?}");
        shortest = shortest.min(ended.saturating_duration_since(asked));
    }
    shortest
}

/// What a picture may take to end, on a machine that has nothing else to do.
const SOON: Duration = Duration::from_millis(if cfg!(debug_assertions) { 2000 } else { 20 });

fn a_picture_ends_soon_after_it_is_cancelled() {
    let renderer = Renderer::cpu();
    let millis = Duration::from_millis;
    let look_at = |scene: &Scene| seen_whole(scene, [1920, 1080]).with_depth();
    // The first picture of a scene.
    for wait in [0, 20, 80] {
        let spent =
            cancelled_after(millis(wait), || renderer.start(look_at(&many(10_000_000, 0.05))));
        assert!(spent <= SOON, "the first picture, after {wait} ms: {spent:?}");
    }
    // The second, before which the scene is put into order.
    let scene = many(10_000_000, 0.05);
    renderer.draw(&look_at(&scene)).unwrap();
    for wait in [30, 150, 300, 500] {
        let spent = cancelled_after(millis(wait), || renderer.start(look_at(&scene)));
        assert!(spent <= SOON, "ordering, after {wait} ms: {spent:?}");
    }
    drop(scene);
    let scene = many(30_000_000, 0.05);
    let large = seen_whole(&scene, [8192, 8192]);
    for wait in [30, 200, 600] {
        let spent = cancelled_after(millis(wait), || renderer.start(large.clone()));
        assert!(spent <= SOON, "3e7 spheres at 8192 x 8192, after {wait} ms: {spent:?}");
    }
    drop((scene, large));
    // Planes that are large: while distances are worked out.
    let deep = seen_whole(&many(100_000, 0.4), [8192, 8192]).with_depth();
    for done in [0.5, 0.8, 0.85, 0.95] {
        let spent = (0..3)
            .map(|_| {
                let job = renderer.start(deep.clone());
                let progress = job.progress();
                while progress() < done {
                    thread::sleep(Duration::from_millis(1));
                }
                let asked = Instant::now();
                job.canceller()();
                assert!(matches!(job.wait(), Err(Error::Cancelled)));
                asked.elapsed()
            })
            .min()
            .unwrap();
        assert!(spent <= SOON, "large planes, at {done}: {spent:?}");
    }
}

fn a_picture_on_the_gpu_ends_soon_after_it_is_cancelled() {
    let renderer = Renderer::open(&Device::Gpu).unwrap();
    let scene = many(3_000_000, 0.05);
    // A software device cannot be interrupted while it runs a kernel.
    for wait in [0, 30, 100] {
        let begin = || renderer.start(seen_whole(&scene, [1920, 1080]));
        let spent = cancelled_after(Duration::from_millis(wait), begin);
        assert!(spent <= 25 * SOON, "after {wait} ms: {spent:?}");
    }
}

#[test]
fn pictures_end_soon_after_they_are_cancelled() {
    a_picture_ends_soon_after_it_is_cancelled();
    a_picture_on_the_gpu_ends_soon_after_it_is_cancelled();
}
