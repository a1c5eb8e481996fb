//! A picture of a hundred spheres, in a file.
use planisphere::{Camera, Error, Renderer, Request, Scene, Spheres};

fn main() -> Result<(), Error> {
    // Any owner of numbers will do: x, y, z and radius here, of a spiral.
    let turn = |k: f32| [k.cos() * (6.0 - 0.05 * k), k.sin() * (6.0 - 0.05 * k), 0.1 * k, 0.6];
    let records: Vec<[f32; 4]> = (0..100).map(|k| turn(0.4 * k as f32)).collect();
    let colors: Vec<[u8; 3]> = (0..100).map(|k| [80 + k, 140, 220 - k]).collect();
    let scene = Scene::new(Spheres::xyzr(records).colors(colors))?;

    let size = [640, 480];
    let camera = Camera::isometric().fit(&scene, size);
    let renderer = Renderer::cpu();
    let picture = renderer.draw(&Request::new(&scene, camera, size)?.with_depth())?;

    // Every pixel has the index of its sphere, and its distance.
    if let Some(hit) = picture.hit([320, 240]) {
        println!("sphere {} at {:.2?}, {:.2} away", hit.index, hit.point, hit.depth);
    }
    let path = std::env::args().nth(1).unwrap_or("spiral.png".into());
    picture.save(path)
}
