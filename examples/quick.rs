use glam::DVec3;
use planisphere::{camera::*, cpu, exact::decide::*, scene::*};
fn rnd(s: &mut u64) -> f64 {
    *s = s.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mut z = *s;
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 * 2f64.powi(-53)
}
fn main() {
    let n: usize = std::env::args().nth(1).unwrap().parse().unwrap();
    let size: u32 = std::env::args().nth(2).unwrap().parse().unwrap();
    let persp = std::env::args().nth(3).is_some_and(|s| s == "p");
    let check: usize = std::env::args().nth(4).map_or(0, |s| s.parse().unwrap());
    let mut s = 1u64;
    let r = (0.07 * 3.0 / (4.0 * std::f64::consts::PI * n as f64)).cbrt() as f32;
    let c: Vec<f32> = (0..3 * n).map(|_| rnd(&mut s) as f32).collect();
    let scene = Scene::new(vec![Block {
        centers: Reals::F32(c.into()),
        radii: Radii::Same(r as f64),
        colors: Colors::Same([1, 2, 3]),
    }])
    .unwrap();
    let image = ImageSize { width: size, height: size };
    let mut camera = Camera::framing(scene.bounds(), image);
    camera.view = DVec3::new(-1.0, -0.7, -0.5);
    if persp {
        camera.projection = Projection::Perspective;
        camera.size = ScreenSize::Height(0.7);
    }
    camera.frame(scene.bounds(), image);
    let view = View::new(camera, image);
    let region = Region::whole(image);
    for k in 0..6 {
        let t = std::time::Instant::now();
        let d = cpu::draw(&scene, &view, region).unwrap();
        if k == 0 || k == 5 {
            println!(
                "{:.2} ms {:?} {:?} covered {}",
                t.elapsed().as_secs_f64() * 1e3,
                d.counts,
                d.times,
                d.ids.iter().filter(|&&i| i >= 0).count()
            );
        }
        if k == 0 && check > 0 {
            let truth = Truth::new(&view, scene.bounds());
            let mut bad = 0;
            let mut tally = Tally::default();
            for p in 0..check {
                let at = (rnd(&mut s) * (size * size) as f64) as usize;
                let px = truth.pixel((at % size as usize) as u32, (at / size as usize) as u32);
                let want = px
                    .nearest((0..n).map(|i| (i as u32, Ball::from(scene.sphere(i)))), &mut tally)
                    .map_or(-1, |i| i as i32);
                if want != d.ids[at] {
                    bad += 1;
                    if bad < 10 {
                        println!("{p} {at} want {want} got {}", d.ids[at]);
                    }
                }
            }
            println!("bad {bad} of {check} {tally:?}");
        }
    }
}
