//! A long picture, told how far it is, and ended before its time.
use std::{thread, time::Duration};

use planisphere::{Camera, Error, Renderer, Request, Scene, Spheres};

fn main() -> Result<(), Error> {
    let point = |k: u32| [12.9898, 78.233, 37.719].map(|m: f32| (k as f32 * m).sin() * 40.0);
    let points: Vec<[f32; 3]> = (0..2_000_000).map(point).collect();
    let scene = Scene::new(Spheres::points(points, 0.05))?;
    let size = [16_384, 16_384];
    let camera = Camera::isometric().fit(&scene, size);
    let job = Renderer::cpu().start(Request::new(&scene, camera, size)?.with_depth());

    let (progress, cancel) = (job.progress(), job.canceller());
    thread::spawn(move || {
        while progress() < 0.05 {
            println!("{:.0} %", 100.0 * progress());
            thread::sleep(Duration::from_millis(100));
        }
        println!("enough");
        cancel();
    });
    // To drop the job would do as well.
    match job.wait() {
        Err(Error::Cancelled) => println!("cancelled"),
        Ok(picture) => println!("drawn in {:?}", picture.elapsed()),
        Err(error) => return Err(error),
    }
    Ok(())
}
