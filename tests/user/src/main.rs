//! Draws, picks and cancels, as a program does that knows planisphere by its documentation only.
//! `tests/user.rs` builds it and runs it; `benches/weight.sh` weighs it.

use planisphere::{Camera, Error, Region, Renderer, Request, Scene, Sphere, Spheres};

/// Equal spheres, and one that is larger than all of them together.
const SMALL: u32 = 100_000;

/// From where the scene is seen, in vectors of two crates.
#[cfg(feature = "vectors")]
fn cameras() -> Result<[Camera; 2], Error> {
    let (eye, to) = (glam::DVec3::new(50.0, -150.0, 50.0), glam::DVec3::Y);
    let first = Camera::perspective(eye, to, 45.0)?.up(glam::DVec3::Z)?;
    let (eye, to) = (nalgebra::Vector3::new(50.0, -150.0, 50.0), nalgebra::Vector3::y());
    Ok([first, Camera::perspective(eye, to, 45.0)?.up(nalgebra::Vector3::z())?])
}

/// The same in arrays.
#[cfg(not(feature = "vectors"))]
fn cameras() -> Result<[Camera; 2], Error> {
    let camera = Camera::perspective([50.0, -150.0, 50.0], [0.0, 1.0, 0.0], 45.0)?;
    Ok([camera, camera.up([0.0, 0.0, 1.0])?])
}

fn main() -> Result<(), Error> {
    let at = |k: u32, m: u32| f64::from(k.wrapping_mul(m) >> 8) / 167_772.16;
    let small = |k: u32| Sphere {
        center: [at(k, 2_654_435_761), at(k, 2_246_822_519), at(k, 3_266_489_917)],
        radius: 0.4,
        color: [k as u8, 160, 90],
    };
    // In front of all others, with its middle in the middle of the picture.
    let large = Sphere { center: [50.0, -60.0, 50.0], radius: 20.0, color: [250, 250, 240] };
    let spheres: Spheres = (0..SMALL).map(small).chain([large]).collect();
    let scene = Scene::new(spheres)?;
    assert_eq!(scene.len(), 100_001);

    let size = [640, 480];
    let [camera, other] = cameras()?;
    assert_eq!(camera, other);
    let renderer = Renderer::cpu();
    let request = Request::new(&scene, camera, size)?.with_depth();
    let picture = renderer.draw(&request)?;
    assert_eq!((picture.size(), picture.ids().len()), (size, 640 * 480));
    let seen = picture.ids().iter().filter(|id| **id >= 0).count();
    assert!(seen > 100_000, "{seen} pixels show a sphere");

    // What is picked is what was drawn, and the nearest point of the large one is 70 away.
    let hit = renderer.pick(&request, [320, 240])?.expect("the large one");
    assert_eq!(Some(hit.index), scene.len().checked_sub(1));
    assert!((hit.depth - 70.0).abs() < 1e-3 && (hit.point[1] + 80.0).abs() < 1e-3, "{hit:?}");
    for pixel in [[0, 0], [17, 400], [320, 20], [639, 479]] {
        let drawn = picture.ids()[(pixel[1] * size[0] + pixel[0]) as usize];
        let picked = renderer.pick(&request, pixel)?.map_or(-1, |hit| hit.index as i32);
        assert_eq!(picked, drawn, "{pixel:?}");
    }

    // The same from a job, and in parts.
    assert_eq!(renderer.start(request.clone()).wait()?.rgba(), picture.rgba());
    let lower = Region { x: 0, y: 240, width: 640, height: 240 };
    let half = renderer.draw(&request.clone().region(lower)?)?;
    assert_eq!(half.ids(), &picture.ids()[640 * 240..]);

    // A picture that nobody wants any more.
    let job = renderer.start(Request::new(&scene, camera, [16_384, 16_384])?);
    job.canceller()();
    assert!(matches!(job.wait(), Err(Error::Cancelled)));

    // What is wrong is said, with a fix.
    let error = Camera::perspective([0.0; 3], [0.0; 3], 45.0).expect_err("no direction");
    assert!(error.fix().is_some(), "{error}");

    println!("{seen} pixels show {} spheres, drawn by {}", scene.len(), renderer.device());
    Ok(())
}
