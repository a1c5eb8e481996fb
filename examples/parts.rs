//! Two machines, each with half of the spheres, and the picture that one would have drawn.
use planisphere::{Camera, Error, Look, Part, Renderer, Request, Scene, Spheres};

fn main() -> Result<(), Error> {
    let point = |k: u32| [12.9898, 78.233, 37.719].map(|m: f32| (k as f32 * m).sin() * 40.0);
    let points: Vec<[f32; 3]> = (0..20_000).map(point).collect();
    // All parts have one camera, which does not depend on the part.
    let size = [640, 480];
    let camera = Camera::orthographic([90.0, 60.0, 45.0], [-4.0, -3.0, -2.0], 110.0)?;
    let request = |points: &[[f32; 3]]| {
        Request::new(&Scene::new(Spheres::points(points.to_vec(), 1.5))?, camera, size)
    };

    let machine = Renderer::cpu();
    let mut bytes = Vec::new();
    for (half, first) in [(&points[..10_000], 0), (&points[10_000..], 10_000)] {
        // The second half's spheres are 10,000 and up in the whole.
        let part = machine.draw_part(&request(half)?, first)?;
        let mut file = Vec::new();
        part.write(&mut file)?;
        bytes.push(file);
    }

    let parts = bytes.into_iter().map(Part::read).collect::<Result<Vec<_>, _>>()?;
    let merged = Part::merge(parts)?.picture(&Look::new())?;
    let whole = machine.draw(&request(&points)?)?;
    assert_eq!(merged.ids(), whole.ids());
    let difference = merged.compare(&whole);
    println!("{} pixels differ", difference.pixels);
    Ok(())
}
