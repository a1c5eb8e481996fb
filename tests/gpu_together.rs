//! Workspaces that share a GPU: they draw at once, each what the CPU draws; scenes are sent once;
//! memory, errors and cancelling keep to whom they belong. And a device that the caller has opened.

use std::{
    pin::pin,
    sync::{
        Arc, Barrier, OnceLock,
        atomic::{AtomicUsize, Ordering},
        mpsc,
    },
    task::{Context, Poll, Waker},
    thread,
    time::Duration,
};

use glam::DVec3;
use planisphere_core::{
    camera::{Camera, ImageSize, Projection, Region, ScreenSize, View},
    cpu::Cpu,
    drawing::{Control, DrawError},
    host::Host,
    scene::{Scene, Sphere},
};
use planisphere_gpu::{
    Answer, Effort, Gpu, SCENES,
    adapters::{self, AdapterChoice},
    plan::Limits,
    wgpu,
};
use planisphere_renderer::Hybrid;

const IMAGE: ImageSize = ImageSize { width: 203, height: 149 };

/// Workspaces go from thread to thread.
const _: fn() = || {
    fn sent_and_shared<T: Send + Sync>() {}
    sent_and_shared::<Gpu>();
};

fn gpu() -> Gpu {
    Gpu::open(&AdapterChoice::Any).unwrap_or_else(|error| panic!("{error}"))
}

/// Spheres of which one in a hundred is ten times as large as the others.
fn unlike(count: u32, seed: u32) -> Scene {
    let sphere = |k: u32| {
        let k = k.wrapping_add(seed.wrapping_mul(0x9e37));
        let at = |m: u32| f64::from(k.wrapping_mul(m) >> 16) / 655.36;
        let radius = if k.is_multiple_of(100) { 5.0 } else { 0.5 };
        let center = DVec3::new(at(2654435761), at(2246822519), at(3266489917));
        Sphere { center, radius, color: [200; 3] }
    };
    Scene::from_spheres(&(0..count).map(sphere).collect::<Vec<_>>()).unwrap()
}

/// Many spheres almost in one place: no f32 can tell which is seen.
fn hard() -> Scene {
    let sphere = |k: u32| {
        let at = |m: u32| f64::from(k.wrapping_mul(m) >> 16) * 1e-14;
        let center = DVec3::new(at(2654435761), at(2246822519), at(3266489917));
        Sphere { center, radius: 3.0, color: [0; 3] }
    };
    Scene::from_spheres(&(0..200).map(sphere).collect::<Vec<_>>()).unwrap()
}

/// From the front, in parallel or in perspective.
fn view(scene: &Scene, projection: Projection) -> View {
    let camera = Camera::framing(scene.bounds(), IMAGE);
    match projection {
        Projection::Orthographic => View::new(camera, IMAGE),
        Projection::Perspective => {
            let (origin, size) = (DVec3::new(-60.0, 40.0, 45.0), ScreenSize::Width(1.1));
            View::new(Camera { projection, origin, size, view: DVec3::X, ..camera }, IMAGE)
        }
    }
}

/// Fails when some work is not done in time: a deadlock would otherwise hold up the tests for ever.
fn within(limit: Duration, work: impl FnOnce() + Send + 'static) {
    let limit = if cfg!(debug_assertions) { 20 * limit } else { limit };
    let (done, waits) = mpsc::channel();
    let worker = thread::spawn(move || {
        work();
        let _ = done.send(());
    });
    match waits.recv_timeout(limit) {
        Err(mpsc::RecvTimeoutError::Timeout) => panic!("not done within {limit:?}"),
        _ => worker.join().unwrap(),
    }
}

/// A picture, and what the CPU draws.
struct Case {
    scene: Scene,
    view: View,
    want: Vec<i32>,
}

impl Case {
    fn new(scene: Scene, projection: Projection) -> Self {
        let view = view(&scene, projection);
        let want = Cpu::default().draw(&scene, &view, Region::whole(IMAGE)).unwrap().ids;
        assert!(want.iter().any(|&id| id >= 0), "something is seen");
        Self { scene, view, want }
    }

    /// The same spheres in a scene that nobody has drawn.
    fn fresh(&self) -> Scene {
        let spheres: Vec<_> =
            (0..self.scene.len()).map(|k| self.scene.sphere(k).unwrap()).collect();
        Scene::from_spheres(&spheres).unwrap()
    }

    fn check(&self, hybrid: &mut Hybrid, scene: &Scene, what: &str) {
        let ids = hybrid.draw(scene, &self.view, Region::whole(IMAGE)).unwrap().ids;
        assert!(ids == self.want, "{what}, {} spheres", scene.len());
    }
}

fn cases() -> Vec<Case> {
    use Projection::{Orthographic, Perspective};
    vec![
        // So many are put in order.
        Case::new(unlike(40_000, 1), Orthographic),
        Case::new(unlike(3_000, 2), Perspective),
        Case::new(hard(), Orthographic),
        Case::new(unlike(35_000, 3), Perspective),
    ]
}

/// Draws each case of all on each of some workspaces, each beginning with another one. `scenes` are
/// those of the cases.
fn rounds(hybrids: &mut [Hybrid], cases: &[Case], scenes: &[Scene], pool: Option<usize>) {
    let draw = |number: usize, hybrid: &mut Hybrid| {
        for turn in 0..2 * cases.len() {
            let at = (number / 2 + turn) % cases.len();
            cases[at].check(hybrid, &scenes[at], &format!("workspace {number}, turn {turn}"));
        }
    };
    match pool {
        None => {
            let start = Barrier::new(hybrids.len());
            thread::scope(|scope| {
                for (number, hybrid) in hybrids.iter_mut().enumerate() {
                    let (start, draw) = (&start, &draw);
                    scope.spawn(move || {
                        start.wait();
                        draw(number, hybrid);
                    });
                }
            });
        }
        Some(threads) => {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.scope(|scope| {
                for (number, hybrid) in hybrids.iter_mut().enumerate() {
                    let draw = &draw;
                    scope.spawn(move |_| draw(number, hybrid));
                }
            });
        }
    }
}

#[test]
fn workspaces_draw_at_once_what_the_cpu_draws() {
    within(Duration::from_secs(240), || {
        let (first, cases) = (gpu(), cases());
        let mut hybrids: Vec<_> = (0..4).map(|_| Hybrid::new(first.beside())).collect();
        // From plain threads, whose work lands in one pool; inside of pools, where a thread that
        // waits takes up another drawing.
        for pool in [None, Some(1), Some(2), Some(4), None, Some(3)] {
            // Each time all have to send scenes that others send, too.
            let scenes: Vec<_> = cases.iter().map(Case::fresh).collect();
            rounds(&mut hybrids, &cases, &scenes, pool);
        }
        assert!(!first.is_lost());
    });
}

#[test]
fn scenes_in_turn_are_sent_once() {
    let (first, scenes) = (gpu(), [unlike(1000, 1), unlike(2000, 2), unlike(40_000, 3)]);
    let mut workspaces = [first.beside(), first.beside(), first];
    for turn in 0..9 {
        let scene = &scenes[turn % scenes.len()];
        let gpu = &mut workspaces[turn / 2 % 3];
        gpu.draw(scene, &view(scene, Projection::Orthographic), Region::whole(IMAGE)).unwrap();
    }
    // 16 bytes a sphere.
    assert_eq!(workspaces[0].activity().0, 16 * 43_000);
    assert!(workspaces[1].activity() == workspaces[2].activity(), "that of the device");
}

/// Bytes that a picture of a scene sends.
fn sent(gpu: &mut Gpu, scene: &Scene) -> u64 {
    let before = gpu.activity().0;
    let view = view(scene, Projection::Orthographic);
    gpu.draw(scene, &view, Region::whole(IMAGE)).unwrap();
    gpu.activity().0 - before
}

#[test]
fn scenes_that_take_too_much_go_and_the_last_one_stays() {
    let mut gpu = gpu();
    let [a, b, c] = [1, 2, 3].map(|seed| unlike(1000, seed));
    // Two of them.
    gpu.keep(32_000);
    for (scene, bytes) in [
        (&a, 16_000),
        (&b, 16_000),
        (&a, 0),
        // In place of b, which was drawn longer ago.
        (&c, 16_000),
        (&a, 0),
        (&b, 16_000),
        (&a, 0),
        (&c, 16_000),
    ] {
        assert_eq!(sent(&mut gpu, scene), bytes);
    }
    // One that is larger than that by itself stays, as long as it is drawn, and nothing beside it.
    gpu.keep(1);
    for (scene, bytes) in [(&c, 0), (&a, 16_000), (&a, 0), (&c, 16_000), (&a, 16_000)] {
        assert_eq!(sent(&mut gpu, scene), bytes);
    }
    // However small they are, scenes do not pile up.
    gpu.keep(u64::MAX);
    let small: Vec<_> = (0..=SCENES as u32).map(|seed| unlike(10, seed)).collect();
    assert!(small.iter().all(|scene| sent(&mut gpu, scene) == 160));
    assert_eq!(sent(&mut gpu, &small[SCENES]), 0);
    assert_eq!(sent(&mut gpu, &small[0]), 160, "it was drawn longest ago");
}

#[test]
fn a_workspace_has_its_own_order_and_settings() {
    let mut one = gpu();
    let few = Effort { order: 0, cover: 0, few: 0 };
    one.set_effort(few);
    let mut two = one.beside();
    let (small, large) = (unlike(500, 1), unlike(900, 2));
    assert!(one.ordered().is_none() && two.ordered().is_none());
    sent(&mut one, &small);
    sent(&mut two, &large);
    assert_eq!(one.ordered().map(|ordered| ordered.len()), Some(500));
    assert_eq!(two.ordered().map(|ordered| ordered.len()), Some(900));
    assert_eq!(sent(&mut one, &large), 0, "the other one has sent it");
    assert!(Arc::ptr_eq(one.ordered().unwrap(), two.ordered().unwrap()));
    // With another effort it lies otherwise on the device, beside the first.
    two.set_effort(Effort::default());
    assert_eq!(sent(&mut two, &large), 900 * 16);
    assert!(two.ordered().is_none());
    assert_eq!(sent(&mut one, &large), 0);
    assert_eq!(one.ordered().map(|ordered| ordered.len()), Some(900));
    sent(&mut one, &Scene::from_spheres(&[]).unwrap());
    assert!(one.ordered().is_none(), "that of what was drawn last");
}

/// What a future gives that has nothing to wait for.
fn now<T>(future: impl Future<Output = T>) -> T {
    match pin!(future).poll(&mut Context::from_waker(Waker::noop())) {
        Poll::Ready(value) => value,
        Poll::Pending => panic!("it has to wait"),
    }
}

/// An adapter that fits, as a program finds it that has nothing to do with us.
fn adapter() -> wgpu::Adapter {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let backends = wgpu::Backends::VULKAN | wgpu::Backends::METAL | wgpu::Backends::DX12;
    let mut all = now(instance.enumerate_adapters(backends)).into_iter();
    all.find(|adapter| adapters::descriptor(adapter).is_ok()).expect("an adapter that fits")
}

#[test]
fn a_device_of_the_caller_draws_the_same_and_keeps_its_callbacks() {
    let adapter = adapter();
    let (device, queue) =
        now(adapter.request_device(&adapters::descriptor(&adapter).unwrap())).unwrap();
    let (errors, losses) = (Arc::new(AtomicUsize::new(0)), Arc::new(AtomicUsize::new(0)));
    let count = Arc::clone(&errors);
    device.on_uncaptured_error(Arc::new(move |_| {
        count.fetch_add(1, Ordering::Relaxed);
    }));
    let count = Arc::clone(&losses);
    device.set_device_lost_callback(move |_, _| {
        count.fetch_add(1, Ordering::Relaxed);
    });
    let mut given = Gpu::from_wgpu(&device, &queue).unwrap();
    let mut opened = gpu();
    for case in cases() {
        let ids = |gpu: &mut Gpu| {
            gpu.draw_filter(&case.scene, &case.view, Region::whole(IMAGE)).unwrap().ids
        };
        assert!(ids(&mut given) == ids(&mut opened));
        case.check(&mut Hybrid::new(given.beside()), &case.scene, "on the caller's device");
    }
    assert_eq!(errors.load(Ordering::Relaxed), 0);
    // An error of the caller's comes to the caller, and is none of ours.
    let _ = device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: 16,
        usage: wgpu::BufferUsages::empty(),
        mapped_at_creation: false,
    });
    assert_eq!(errors.load(Ordering::Relaxed), 1);
    let scene = unlike(1000, 5);
    sent(&mut given, &scene);
    assert!(!given.is_lost());
    // The caller gives the device up.
    device.destroy();
    let _ = device.poll(wgpu::PollType::wait_indefinitely());
    assert_eq!(losses.load(Ordering::Relaxed), 1, "the caller is told");
    for gpu in [&mut given.beside(), &mut given] {
        let view = view(&scene, Projection::Orthographic);
        let words = match gpu.draw(&scene, &view, Region::whole(IMAGE)) {
            Err(DrawError::Device(words)) => words,
            other => panic!("{other:?}"),
        };
        assert!(words.starts_with("it is lost, and a new renderer must be opened: "), "{words}");
        assert!(gpu.is_lost());
    }
    assert_eq!(errors.load(Ordering::Relaxed), 1, "nobody but the caller of `draw` is told");
}

#[test]
fn a_device_that_was_created_with_too_little_is_refused() {
    let adapter = adapter();
    let mut least = adapters::descriptor(&adapter).unwrap();
    least.required_features = wgpu::Features::empty();
    let (device, queue) = now(adapter.request_device(&least)).unwrap();
    // Without any feature other kernels draw, and ids are copied.
    let mut gpu = Gpu::from_wgpu(&device, &queue).unwrap();
    assert!(!gpu.set_lanes(planisphere_shaders::Lanes::Eight));
    for case in cases() {
        let drawing = gpu.draw_filter(&case.scene, &case.view, Region::whole(IMAGE)).unwrap();
        let settled = drawing.ids.iter().zip(&case.want).filter(|&(id, want)| id == want);
        assert!(case.scene.len() < 1000 || settled.count() > case.want.len() * 9 / 10);
        case.check(&mut Hybrid::new(gpu.beside()), &case.scene, "without features");
    }
    least.required_limits.max_storage_buffers_per_shader_stage = 4;
    least.required_limits.max_storage_buffer_binding_size = 1 << 20;
    let (device, queue) = now(adapter.request_device(&least)).unwrap();
    let why = Gpu::from_wgpu(&device, &queue).unwrap_err();
    assert!(why.contains(" was created without 7 storage buffers in a shader (it has 4)"), "{why}");
    assert!(why.ends_with("storage bindings of 16 MiB (it has 1)"), "{why}");
}

#[test]
fn an_upload_ends_when_it_is_cancelled() {
    static CONTROL: OnceLock<Control> = OnceLock::new();
    let control = CONTROL.get_or_init(Control::new);
    let scene = unlike(40_000, 7);
    let mut first = gpu();
    // Memory is asked for before a scene is put in order: then it is cancelled.
    let cancels = |_| {
        CONTROL.get().unwrap().cancel();
        false
    };
    let mut gpu = first.beside();
    gpu.on(Host { has_room: cancels, ..Host::default() });
    gpu.controlled_by(control);
    let view = view(&scene, Projection::Orthographic);
    let result = gpu.draw(&scene, &view, Region::whole(IMAGE));
    assert!(matches!(result, Err(DrawError::Cancelled)), "{result:?}");
    assert_eq!(gpu.activity(), (0, 0), "nothing is sent any more, and nothing drawn");
    assert_eq!(control.progress(), 0.0);
    assert!(gpu.ordered().is_none());
    // Others do not share the control.
    assert_eq!(sent(&mut first, &scene), 640_000);
    gpu.controlled_by(&Control::new());
    assert_eq!(sent(&mut gpu, &scene), 0);
}

#[test]
fn an_upload_ends_in_the_middle() {
    within(Duration::from_secs(120), || {
        let scene = unlike(4_000_000, 8);
        let mut gpu = gpu();
        gpu.set_effort(Effort { order: usize::MAX, ..Effort::default() });
        let control = Control::new();
        gpu.controlled_by(&control);
        let view = view(&scene, Projection::Orthographic);
        let (result, reached) = thread::scope(|scope| {
            let drawing = scope.spawn(|| gpu.draw(&scene, &view, Region::whole(IMAGE)).map(|_| ()));
            // A part is sent.
            while control.progress() == 0.0 && !drawing.is_finished() {
                thread::yield_now();
            }
            control.cancel();
            let reached = control.progress();
            (drawing.join().unwrap(), reached)
        });
        let sent = gpu.activity().0;
        assert!(matches!(result, Err(DrawError::Cancelled)), "{result:?} at {reached}");
        assert!(sent > 0);
        // On a machine that is busy this thread may come late.
        assert!(reached > 0.15 || sent < 64_000_000, "{sent} bytes at {reached}");
    });
}

#[test]
fn progress_rises_to_the_end() {
    let mut gpu = gpu();
    let (chunk, limits) = gpu.limits();
    // In several buffers, waves and bands.
    gpu.shrink(chunk.min(700), u32::MAX, Limits { wave: 2000, tiles: 100, ..limits });
    let scene = unlike(2000, 9);
    for view in [Projection::Orthographic, Projection::Perspective].map(|it| view(&scene, it)) {
        let control = Control::new();
        gpu.controlled_by(&control);
        let seen = thread::scope(|scope| {
            let drawing = scope.spawn(|| gpu.draw(&scene, &view, Region::whole(IMAGE)).unwrap());
            let mut seen = vec![0.0];
            while !drawing.is_finished() {
                let progress = control.progress();
                if seen.last() != Some(&progress) {
                    seen.push(progress);
                }
                thread::yield_now();
            }
            assert!(matches!(drawing.join(), Ok(Answer::Drawn(_, left)) if left.is_empty()));
            seen
        });
        assert!(seen.is_sorted() && seen.iter().all(|&part| part <= 1.0), "{seen:?}");
        assert_eq!(control.progress(), 1.0);
    }
}

#[test]
fn public_things_can_be_printed() {
    let mut gpu = gpu();
    sent(&mut gpu, &unlike(1000, 1));
    let words = format!("{gpu:?}");
    for part in ["device: ", "lanes: ", "scenes: 1", "sent: 16000", "fault: None"] {
        assert!(words.contains(part), "{part} in {words}");
    }
}
