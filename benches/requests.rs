//! Many requests at once for a PNG of one new scene: the library's renderer against ways by hand.
//!
//! `cargo bench --bench requests` prints a table: requests a second, the median and the first time
//! to an answer, and the greatest memory, each of a process of its own, in turns. `-- 5e6 40` takes
//! other numbers of spheres and requests than 1e5 and 200.

use std::{
    process::Command,
    sync::{Arc, Condvar, Mutex, mpsc},
    thread,
    time::Instant,
};

use planisphere::{Camera, Renderer, Request, Scene, Spheres};
use planisphere_core::{
    camera::{ImageSize, Region, View},
    scene,
};
use planisphere_image::Paint;
use planisphere_io::png::write_png;
use planisphere_renderer::{Device, Engine};

const SIZE: [u32; 2] = [1920, 1080];
/// Rounds of all ways in turn.
const ROUNDS: usize = 5;

/// The ways, and what each is.
const WAYS: [(&str, &str); 5] = [
    ("library", "Renderer::cpu(), start_with"),
    ("mutex", "by hand: one device behind a mutex"),
    ("each", "by hand: a device for each request"),
    ("four", "by hand: 4 devices and a semaphore"),
    ("lanes", "by hand: 2 devices, each in a pool of one thread"),
];

fn points(count: u32) -> Vec<[f32; 3]> {
    let at = |k: u32, m: u32| (k.wrapping_mul(m) >> 8) as f32 / 167_772.16;
    (0..count).map(|k| [at(k, 2654435761), at(k, 2246822519), at(k, 3266489917)]).collect()
}

/// Milliseconds from the start to each answer.
type Answers = Vec<f64>;

fn by_library(count: u32, requests: usize) -> Answers {
    let scene = Scene::new(Spheres::points(points(count), radius(count))).expect("spheres");
    let camera = Camera::isometric().fit(&scene, SIZE);
    let request = Request::new(&scene, camera, SIZE).expect("a request");
    let renderer = Renderer::cpu();
    let begin = Instant::now();
    let jobs: Vec<_> = (0..requests)
        .map(|_| {
            renderer.start_with(request.clone(), move |picture| {
                let mut png = Vec::new();
                picture.write_png(&mut png)?;
                Ok((png.len(), begin.elapsed().as_secs_f64() * 1e3))
            })
        })
        .collect();
    jobs.into_iter().map(|job| job.wait().expect("a picture").1).collect()
}

/// A radius at which spheres take about a tenth of the volume.
fn radius(count: u32) -> f64 {
    100.0 * (0.1 / f64::from(count) / 4.19).cbrt()
}

/// So many at a time, as a semaphore has it.
struct Semaphore(Mutex<usize>, Condvar);

/// Everything by the inner crates, on a thread for each request.
fn by_hand(way: &str, count: u32, requests: usize) -> Answers {
    let request = Scene::new(Spheres::points(points(count), radius(count))).expect("spheres");
    let camera = Camera::isometric().fit(&request, SIZE);
    // The same camera, as the inner crates have it.
    let picture = Renderer::cpu()
        .draw(&Request::new(&request, camera, [1, 1]).expect("a request"))
        .expect("a pixel");
    let image = ImageSize { width: SIZE[0], height: SIZE[1] };
    let view = View::new(picture.view().expect("of a picture").camera, image);
    let block = scene::Block {
        centers: scene::Reals::F32(scene::Column::of_rows(points(count))),
        radii: scene::Radii::Same(radius(count)),
        colors: scene::Colors::Same([176; 3]),
    };
    drop((request, picture));
    let scene = scene::Scene::new(vec![block]).expect("spheres");
    let engine = || Engine::open(&Device::Cpu).expect("the CPU");
    let shared = match way {
        "mutex" => 1,
        "four" => 4,
        "lanes" => 2,
        _ => 0,
    };
    let engines: Vec<_> = (0..shared).map(|_| engine()).collect();
    let lane = || rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    let lanes: Vec<_> = (0..shared).map(|_| (way == "lanes").then(lane)).collect();
    let idle = Mutex::new(engines.into_iter().zip(lanes).collect::<Vec<_>>());
    let left = Semaphore(Mutex::new(shared), Condvar::new());
    let (sender, answers) = mpsc::channel();
    let begin = Instant::now();
    thread::scope(|scope| {
        for _ in 0..requests {
            let (idle, left, scene, sender) = (&idle, &left, &scene, sender.clone());
            scope.spawn(move || {
                if shared > 0 {
                    let count = left.0.lock().expect("no panic");
                    *left.1.wait_while(count, |count| *count == 0).expect("no panic") -= 1;
                }
                let known = idle.lock().expect("no panic").pop();
                let (mut engine, lane) = known.unwrap_or_else(|| (engine(), None));
                let mut draw = || {
                    let region = Region::whole(image);
                    let ids = engine.draw(scene, &view, region).expect("a picture").ids;
                    let paint = Paint { scene, background: [0; 3] };
                    let mut png = Vec::new();
                    write_png(&mut png, region, &ids, &paint).expect("memory");
                    png.len()
                };
                let _ = match &lane {
                    Some(lane) => lane.install(draw),
                    None => draw(),
                };
                if shared > 0 {
                    idle.lock().expect("no panic").push((engine, lane));
                    *left.0.lock().expect("no panic") += 1;
                    left.1.notify_one();
                }
                let _ = sender.send(begin.elapsed().as_secs_f64() * 1e3);
            });
        }
    });
    drop(sender);
    answers.iter().collect()
}

/// The greatest memory of this process, MB.
fn peak() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kilobytes = line.and_then(|line| line.trim().strip_suffix(" kB")?.parse::<f64>().ok());
    kilobytes.unwrap_or(f64::NAN) / 1e3
}

fn median(mut numbers: Vec<f64>) -> f64 {
    numbers.sort_by(f64::total_cmp);
    numbers[numbers.len() / 2]
}

fn main() {
    let arguments: Vec<String> =
        std::env::args().skip(1).filter(|argument| argument != "--bench").collect();
    let number = |at: usize, usual: f64| {
        arguments.get(at).map_or(usual, |text| text.parse().expect("a number"))
    };
    let (count, requests) = (number(0, 1e5) as u32, number(1, 200.0) as usize);
    if let Some(way) = arguments.get(2) {
        let mut answers = match way.as_str() {
            "library" => by_library(count, requests),
            way => by_hand(way, count, requests),
        };
        answers.sort_by(f64::total_cmp);
        let last = answers[answers.len() - 1];
        let rate = requests as f64 / last * 1e3;
        println!("{rate} {} {} {}", answers[0], answers[answers.len() / 2], peak());
        return;
    }
    let program = Arc::new(std::env::current_exe().expect("this program"));
    let mut rows = vec![Vec::new(); WAYS.len()];
    for _ in 0..ROUNDS {
        for ((way, _), row) in WAYS.iter().zip(&mut rows) {
            let arguments = [count.to_string(), requests.to_string(), (*way).to_owned()];
            let output = Command::new(&*program).args(arguments).output().expect("a process");
            assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
            let text = String::from_utf8(output.stdout).expect("numbers");
            let numbers = text.split_whitespace().map(|text| text.parse().expect("a number"));
            row.push(numbers.collect::<Vec<f64>>());
        }
    }
    println!("{requests} requests at once, {count} spheres, {} x {}", SIZE[0], SIZE[1]);
    println!("requests/s  first ms  median ms  peak MB  library/this");
    for ((_, what), row) in WAYS.iter().zip(&rows) {
        let of = |at: usize| median(row.iter().map(|round| round[at]).collect());
        // Round by round, so that what drifts slowly cancels.
        let ratio = rows[0].iter().zip(row).map(|(library, this)| library[0] / this[0]).collect();
        let [rate, first, middle, memory] = [0, 1, 2, 3].map(of);
        let ratio = median(ratio);
        println!("{rate:10.1}  {first:8.0}  {middle:9.0}  {memory:7.0}  {ratio:12.2}  {what}");
    }
}
