//! A picture of spheres, in a file.
use planisphere::{Camera, Error, Renderer, Request, Scene, Spheres};

fn main() -> Result<(), Error> {
    // Any owner of numbers will do: x, y, z and radius here, each in the golden angle to the last.
    let record = |k: f32| {
        let (z, angle) = (1.0 - k / 200.0, 2.39996 * k);
        let across = (1.0 - z * z).sqrt();
        [across * angle.cos(), across * angle.sin(), z, 0.12]
    };
    let records: Vec<[f32; 4]> = (0..400).map(|k| record(k as f32)).collect();
    let colors: Vec<[u8; 3]> = (0..400).map(|k| [80, (k / 2) as u8, 230 - (k / 2) as u8]).collect();
    let scene = Scene::new(Spheres::xyzr(records).colors(colors))?;

    let size = [640, 480];
    let camera = Camera::isometric().fit(&scene, size);
    let renderer = Renderer::cpu();
    let picture = renderer.draw(&Request::new(&scene, camera, size)?.with_depth())?;

    // Every pixel has the index of its sphere, and its distance.
    if let Some(hit) = picture.hit([320, 240]) {
        println!("sphere {} at {:.2?}, {:.2} away", hit.index, hit.point, hit.depth);
    }
    let path = std::env::args().nth(1).unwrap_or("spheres.png".into());
    picture.save(path)
}
