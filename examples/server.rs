//! A server of pictures: one renderer, as many requests at once as come.
use std::io::{Read, Write};
use std::{net::TcpListener, thread};

use planisphere::{Camera, Error, Renderer, Request, Scene, Spheres};

fn main() -> Result<(), Error> {
    let point = |k: u32| [12.9898, 78.233, 37.719].map(|m: f32| (k as f32 * m).sin() * 40.0);
    let points: Vec<[f32; 3]> = (0..20_000).map(point).collect();
    let scene = Scene::new(Spheres::points(points, 0.8))?;
    let camera = Camera::isometric().fit(&scene, [320, 240]);
    let request = Request::new(&scene, camera, [320, 240])?;
    // No more pictures than this are ever in memory; others wait their turn.
    let renderer = Renderer::cpu().in_flight(2);

    let listener = TcpListener::bind("127.0.0.1:0")?;
    println!("http://{}/", listener.local_addr()?);
    // How many to serve; without end if nothing is said.
    let count = std::env::args().nth(1).and_then(|count| count.parse().ok());
    thread::scope(|scope| {
        for (k, stream) in listener.incoming().take(count.unwrap_or(usize::MAX)).enumerate() {
            let mut stream = stream?;
            let turned = request.clone().camera(camera.orbit([0.0; 3], 10.0 * k as f64, 0.0));
            // Drawn and encoded in one turn. A job is also a future, for `await`.
            let job = renderer.start_with(turned, |picture| {
                let mut png = Vec::new();
                picture.write_png(&mut png).map(|()| png)
            });
            scope.spawn(move || {
                let _asked = stream.read(&mut [0; 1024])?;
                let png = job.wait()?;
                write!(stream, "HTTP/1.1 200 OK\r\nContent-Length: {}\r\n\r\n", png.len())?;
                Ok::<_, Error>(stream.write_all(&png)?)
            });
        }
        Ok(())
    })
}
