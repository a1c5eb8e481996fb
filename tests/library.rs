//! What the inner crates refuse, and that their drawings end when they are cancelled. What a
//! program that uses the library may count on is in `facade.rs`.

use std::{
    sync::mpsc,
    thread,
    time::{Duration, Instant},
};

use glam::DVec3;
use planisphere_core::{
    camera::{
        Camera, CameraError, ImageSize, MAX_SIDE, Projection, Region, ScreenSize, View, ViewError,
    },
    depth::{PlaneError, depth_plane},
    drawing::{Control, DrawError},
    scene::{Scene, Sphere},
};
use planisphere_image::Paint;
use planisphere_io::{
    npy::{write_f32, write_i32},
    png::write_png,
};
use planisphere_renderer::{Device, Engine};

const IMAGE: ImageSize = ImageSize { width: 8, height: 6 };

fn camera() -> Camera {
    Camera { size: ScreenSize::Width(4.0), ..Camera::orthographic(DVec3::ZERO, DVec3::X) }
}

fn scene() -> Scene {
    let ball = |x, color| Sphere { center: DVec3::new(x, 0.0, 0.0), radius: 1.0, color };
    Scene::from_spheres(&[ball(5.0, [1, 2, 3]), ball(7.0, [4, 5, 6])]).unwrap()
}

/// Everything of which there is no picture, with its name and what is said of it.
fn refused() -> Vec<(&'static str, View, Region, ViewError)> {
    let whole = Region::whole(IMAGE);
    let mut all = Vec::new();
    let mut add =
        |name, camera, error: CameraError| all.push((name, camera, ViewError::Camera(error)));
    let nan = DVec3::new(0.0, f64::NAN, 0.0);
    add("a NaN origin", Camera { origin: nan, ..camera() }, CameraError::NotFinite("origin"));
    add(
        "an infinite origin",
        Camera { origin: DVec3::INFINITY, ..camera() },
        CameraError::NotFinite("origin"),
    );
    add("a NaN view", Camera { view: nan, ..camera() }, CameraError::NotFinite("view"));
    add("a NaN up", Camera { up: nan, ..camera() }, CameraError::NotFinite("up"));
    add("no view direction", Camera { view: DVec3::ZERO, ..camera() }, CameraError::ZeroView);
    add(
        "an up along the view",
        Camera { up: -2.0 * DVec3::X, ..camera() },
        CameraError::UpParallel,
    );
    let planes = |near, far| (Camera { near, far, ..camera() }, CameraError::Planes { near, far });
    for (name, near, far) in [
        ("near beyond far", 3.0, 2.0),
        ("near at far", 2.0, 2.0),
        ("a negative near", -1.0, 2.0),
        ("a NaN near", f64::NAN, 2.0),
        ("an infinite near", f64::INFINITY, f64::INFINITY),
        ("a NaN far", 0.0, f64::NAN),
    ] {
        let (camera, error) = planes(near, far);
        add(name, camera, error);
    }
    for (name, value) in [
        ("a width of 0", 0.0),
        ("a negative width", -4.0),
        ("an infinite width", f64::INFINITY),
        ("a NaN width", f64::NAN),
    ] {
        let error = || CameraError::Size { what: "width", value };
        add(name, Camera { size: ScreenSize::Width(value), ..camera() }, error());
        add(
            name,
            Camera { size: ScreenSize::Both { width: value, height: 1.0 }, ..camera() },
            error(),
        );
        let fan = Camera {
            projection: Projection::Perspective,
            size: ScreenSize::Width(value),
            ..camera()
        };
        add(name, fan, error());
        let error = CameraError::Size { what: "height", value };
        add("such a height", Camera { size: ScreenSize::Height(value), ..camera() }, error);
    }
    let mut all: Vec<_> = all
        .into_iter()
        .map(|(name, camera, error)| (name, View::new(camera, IMAGE), whole, error))
        .collect();

    for (width, height) in
        [(0, 0), (0, 6), (8, 0), (MAX_SIDE + 1, 6), (8, MAX_SIDE + 1), (100_000, 2), (u32::MAX, 1)]
    {
        let image = ImageSize { width, height };
        let one = Region { x: 0, y: 0, width: 1, height: 1 };
        all.push((
            "an image out of limits",
            View::new(camera(), image),
            one,
            ViewError::Image(image),
        ));
    }
    let mut view = View::new(camera(), IMAGE);
    view.camera.size = ScreenSize::Width(1.0);
    all.push(("a camera changed inside of a view", view, whole, ViewError::Stale));
    let mut view = View::new(camera(), IMAGE);
    view.image.width = 4;
    all.push((
        "an image changed inside of a view",
        view,
        Region { width: 4, ..whole },
        ViewError::Stale,
    ));
    let view = View::new(camera(), IMAGE);
    for (width, height) in [(0, 0), (0, 6), (8, 0)] {
        let region = Region { width, height, ..whole };
        all.push(("a region without pixels", view, region, ViewError::Empty(region)));
    }
    for [x, y, width, height] in [
        [1, 0, 8, 6],
        [0, 1, 8, 6],
        [8, 0, 1, 1],
        [0, 0, 9, 6],
        [u32::MAX, 0, 8, 6],
        [0, 2, 8, u32::MAX],
    ] {
        let region = Region { x, y, width, height };
        all.push((
            "a region outside of the image",
            view,
            region,
            ViewError::Outside { region, image: IMAGE },
        ));
    }
    all
}

/// `View` holds NaN, which equals nothing: errors are compared by what they say.
fn same(found: &ViewError, wanted: &ViewError) -> bool {
    format!("{found:?}") == format!("{wanted:?}")
}

/// Every device refuses the same things in the same words, and draws as before afterwards.
fn refuses(choice: Device) {
    let scene = scene();
    let mut device = Engine::open(&choice).unwrap();
    let view = View::new(camera(), IMAGE);
    let before = device.draw(&scene, &view, Region::whole(IMAGE)).unwrap().ids;
    assert!(before.contains(&0) && before.contains(&-1));
    for (name, view, region, wanted) in refused() {
        for scene in [&scene, &Scene::new(Vec::new()).unwrap()] {
            match device.draw(scene, &view, region) {
                Err(DrawError::View(error)) => {
                    assert!(same(&error, &wanted), "{name}: {error:?}, not {wanted:?}")
                }
                other => panic!("{name}: {other:?}, not an error of the view"),
            }
        }
        let words = wanted.to_string();
        assert!(words.contains("; "), "the fix is named: {words}");
    }
    assert_eq!(device.draw(&scene, &view, Region::whole(IMAGE)).unwrap().ids, before);
}

#[test]
fn what_has_no_picture_is_refused_by_the_cpu() {
    refuses(Device::Cpu);
}

#[test]
fn what_has_no_picture_is_refused_by_the_gpu() {
    refuses(Device::Gpu);
}

#[test]
fn planes_refuse_what_is_not_of_the_picture() {
    let (scene, view) = (scene(), View::new(camera(), IMAGE));
    let whole = Region::whole(IMAGE);
    let ids = Engine::open(&Device::Cpu).unwrap().draw(&scene, &view, whole).unwrap().ids;
    for (name, view, region, wanted) in refused() {
        match depth_plane(&scene, &view, region, &ids) {
            Err(PlaneError::View(error)) => assert!(same(&error, &wanted), "{name}: {error:?}"),
            other => panic!("{name}: {other:?}"),
        }
    }
    let depth = |ids: &[i32]| depth_plane(&scene, &view, whole, ids);
    assert_eq!(depth(&ids).unwrap().len(), 48);
    assert_eq!(depth(&ids[1..]), Err(PlaneError::Length { ids: 47, region: whole }));
    let foreign: Vec<i32> = ids.iter().map(|&id| if id == 0 { 99 } else { id }).collect();
    assert_eq!(depth(&foreign), Err(PlaneError::NoSphere { id: 99, spheres: 2 }));
    assert_eq!(depth(&[0; 48]), Err(PlaneError::NotSeen { id: 0, column: 0, row: 0 }));

    let paint = Paint { scene: &scene, background: [0; 3] };
    assert_eq!(paint.colors(&ids).unwrap().len(), 48);
    assert_eq!(paint.colors(&foreign), Err(PlaneError::NoSphere { id: 99, spheres: 2 }));
    assert_eq!((paint.color(99), scene.sphere(99), scene.color(99)), (None, None, None));
    let invalid = std::io::ErrorKind::InvalidInput;
    let out = &mut Vec::new();
    assert_eq!(write_png(out, whole, &ids[1..], &paint).unwrap_err().kind(), invalid);
    assert_eq!(write_png(out, whole, &foreign, &paint).unwrap_err().kind(), invalid);
    assert_eq!(write_i32(out, &[6, 8], &ids[1..]).unwrap_err().kind(), invalid);
    assert_eq!(write_f32(out, &[6, 8], &[0.0; 49]).unwrap_err().kind(), invalid);
}

/// Spheres that all but coincide in no order: many decisions at every pixel.
fn heap(count: u32) -> Scene {
    let sphere = |k: u32| {
        let at = |m: u32| 1.0 + f64::from(k.wrapping_mul(m) >> 27) * f64::EPSILON;
        let center = DVec3::new(at(2654435761), at(2246822519), at(3266489917));
        Sphere { center, radius: 1.0 + f64::from(k % 7) * f64::EPSILON, color: [200; 3] }
    };
    Scene::from_spheres(&(0..count).map(sphere).collect::<Vec<_>>()).unwrap()
}

/// A long drawing ends soon after it was cancelled, as an error; and the device draws again, right,
/// when it is given another token.
fn cancels(choice: Device) {
    let image = ImageSize { width: 1500, height: 1500 };
    let scene = heap(16_000);
    let view = View::new(Camera::framing(scene.bounds(), image), image);
    let mut device = Engine::open(&choice).unwrap();
    for wait in [0, 30, 300, 1000] {
        let control = Control::new();
        device.controlled_by(&control);
        let (sender, begun) = mpsc::channel();
        let spent = thread::scope(|scope| {
            let (device, scene, view) = (&mut device, &scene, &view);
            let drawing = scope.spawn(move || {
                sender.send(()).unwrap();
                let result = device.draw(scene, view, Region::whole(image));
                (result.map(|_| ()), Instant::now())
            });
            begun.recv().unwrap();
            thread::sleep(Duration::from_millis(wait));
            let asked = Instant::now();
            control.cancel();
            let (result, ended) = drawing.join().unwrap();
            assert!(matches!(result, Err(DrawError::Cancelled)), "{result:?} after {wait} ms");
            ended.duration_since(asked)
        });
        // A quarter of a second on a machine that has nothing else to do.
        let limit = Duration::from_secs(if cfg!(debug_assertions) { 60 } else { 3 });
        assert!(spent < limit, "ended {spent:?} after it was cancelled");
    }
    let cancelled = Control::new();
    cancelled.cancel();
    device.controlled_by(&cancelled);
    let small = ImageSize { width: 40, height: 30 };
    let view = View::new(Camera::framing(scene.bounds(), small), small);
    let again = |device: &mut Engine| {
        device.draw(&scene, &view, Region::whole(small)).map(|drawing| drawing.ids)
    };
    assert!(matches!(again(&mut device), Err(DrawError::Cancelled)));
    device.controlled_by(&Control::new());
    let fresh = again(&mut Engine::open(&Device::Cpu).unwrap()).unwrap();
    assert_eq!(again(&mut device).unwrap(), fresh);
}

#[test]
fn drawing_on_the_cpu_ends_when_it_is_cancelled() {
    cancels(Device::Cpu);
}

#[test]
fn drawing_on_the_gpu_ends_when_it_is_cancelled() {
    cancels(Device::Gpu);
}
