//! What the library does to the program that it is part of: nothing but what [`Renderer`] tells.
//!
//! Each test runs this file again, as a process whose environment is empty but for the name of a
//! way to draw. That process looks at itself before and after, and at what it has printed between.

use std::{
    env,
    ffi::OsString,
    fs,
    hint::black_box,
    panic,
    path::PathBuf,
    process::Command,
    sync::{
        Arc,
        atomic::{AtomicUsize, Ordering},
    },
    thread,
    time::{Duration, Instant},
};

use planisphere::{Camera, Device, Error, Picture, Renderer, Request, Scene, Spheres};

/// The one variable of a child: how it draws.
const WAY: &str = "PLANISPHERE_TEST_WAY";

/// Lines that a child prints before and after, each on both streams.
const BEGIN: &str = "== it draws";
const END: &str = "== it has drawn";

/// How lines begin that drivers write to standard error, and nobody else. Mesa's layer that selects
/// devices looks for a display; lavapipe before version 21.1 warned.
const OF_DRIVERS: [&str; 3] = [
    "error: XDG_RUNTIME_DIR is invalid or not set in the environment.",
    "MESA",
    "WARNING: lavapipe is not a conformant vulkan implementation",
];

/// What a process is like, as far as others in it depend on it.
#[derive(Debug, PartialEq)]
struct State {
    variables: Vec<(OsString, OsString)>,
    folder: PathBuf,
    /// Signals that are caught, ignored or blocked, and the mask of new files: lines of Linux's
    /// `status`; none elsewhere.
    of_system: Vec<String>,
    /// Whether numbers below the least normal one are still told from zero on this thread.
    has_subnormals: bool,
}

impl State {
    fn now() -> Self {
        let mut variables: Vec<_> = env::vars_os().collect();
        variables.sort();
        let status = fs::read_to_string("/proc/thread-self/status").unwrap_or_default();
        let wanted = ["SigBlk", "SigIgn", "SigCgt", "Umask"];
        let wanted = |line: &&str| wanted.iter().any(|name| line.starts_with(name));
        let of_system: Vec<_> = status.lines().filter(wanted).map(str::to_owned).collect();
        assert!(of_system.len() == 4 || !cfg!(target_os = "linux"), "{status}");
        Self {
            variables,
            folder: env::current_dir().expect("a folder"),
            of_system,
            has_subnormals: black_box(f64::MIN_POSITIVE) / black_box(2.0) > 0.0,
        }
    }
}

/// The names of a list that Linux keeps of this process, sorted; none elsewhere.
fn listed(folder: &str, name: impl Fn(PathBuf) -> Option<String>) -> Vec<String> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let mut names: Vec<_> = entries.filter_map(|entry| name(entry.path())).collect();
    names.sort();
    names
}

/// The names of all threads, at most 15 letters of each.
fn threads() -> Vec<String> {
    let name = |task: PathBuf| fs::read_to_string(task.join("comm")).ok();
    let mut names = listed("/proc/self/task", name);
    names.iter_mut().for_each(|name| *name = name.trim_end().to_owned());
    names
}

/// What open descriptors lead to.
fn descriptors() -> Vec<String> {
    let target = |path: PathBuf| Some(fs::read_link(path).ok()?.display().to_string());
    // The list itself is open while it is read.
    let names = listed("/proc/self/fd", target).into_iter();
    names.filter(|name| !name.starts_with("/proc/")).collect()
}

/// Names that are in `after` more often than in `before`; both are sorted.
fn more(before: &[String], after: &[String]) -> Vec<String> {
    let mut before = before.to_vec();
    let is_new = |name: &&String| match before.iter().position(|other| other == *name) {
        Some(at) => {
            before.remove(at);
            false
        }
        None => true,
    };
    after.iter().filter(is_new).cloned().collect()
}

/// What a child has seen.
struct Seen {
    /// Threads that are new while the renderer is there.
    with: Vec<String>,
    /// Threads that are new once it is dropped, and were given time to end.
    without: Vec<String>,
    picture: Picture,
}

/// A pool of the child's, whose threads are all there.
fn pool() -> rayon::ThreadPool {
    let named = rayon::ThreadPoolBuilder::new().num_threads(2);
    let pool = named.thread_name(|number| format!("mine {number}")).build().expect("threads");
    pool.broadcast(|_| ());
    pool
}

/// Whether a way is one on rayon's global pool.
fn is_global(way: &str) -> bool {
    ["plain", "job"].contains(&way)
}

fn draw(way: &str) -> Result<Seen, Error> {
    let points = (0..2_000_u32).map(|k| [k % 10, k / 10 % 10, k / 100].map(|at| at as f32));
    let spheres = Spheres::points(points.collect::<Vec<_>>(), 0.4);
    let mine = (!is_global(way)).then(pool);
    let before = threads();
    // Numbers are checked on the pool that this is asked from, not on the renderer's.
    let scene = match &mine {
        Some(mine) => mine.install(|| Scene::new(spheres)),
        None => Scene::new(spheres),
    }?;
    let size = [320, 240];
    let request = Request::new(&scene, Camera::isometric().fit(&scene, size), size)?.with_depth();
    let renderer = match way {
        "pool" | "plain" | "job" => Renderer::cpu(),
        "threads" | "threads job" => Renderer::cpu().threads(2)?,
        "gpu pool" => Renderer::open(&Device::Gpu)?,
        "gpu" => Renderer::open(&Device::Gpu)?.threads(2)?,
        other => panic!("{other}: there is no such way"),
    };
    let both = || Ok::<_, Error>((renderer.draw(&request)?, renderer.pick(&request, [160, 120])?));
    let (picture, hit) = match &mine {
        Some(mine) if way.ends_with("pool") => mine.install(both)?,
        _ if way.ends_with("job") => {
            let picture = renderer.start(request.clone()).wait()?;
            (picture, renderer.pick(&request, [160, 120])?)
        }
        _ => both()?,
    };
    assert_eq!(hit.map(|hit| hit.index), picture.hit([160, 120]).map(|hit| hit.index));
    let with = more(&before, &threads());
    drop(renderer);
    // A thread that ends is there for a moment; the global pool stays.
    let staying = if is_global(way) { rayon::current_num_threads() } else { 0 };
    let until = Instant::now() + Duration::from_secs(10);
    let without = loop {
        let without = more(&before, &threads());
        if without.len() == staying || Instant::now() > until {
            break without;
        }
        thread::sleep(Duration::from_millis(5));
    };
    Ok(Seen { with, without, picture })
}

/// What children do; where no way is named, nothing.
#[test]
fn a_child_looks_at_itself() {
    let Ok(way) = env::var(WAY) else { return };
    let calls = Arc::new(AtomicUsize::new(0));
    let counted = Arc::clone(&calls);
    panic::set_hook(Box::new(move |_| {
        counted.fetch_add(1, Ordering::SeqCst);
    }));
    let (before, opened) = (State::now(), descriptors());
    println!("{BEGIN}");
    eprintln!("{BEGIN}");
    let seen = panic::catch_unwind(|| draw(&way));
    println!("{END}");
    eprintln!("{END}");
    let (after, left) = (State::now(), more(&opened, &descriptors()));
    let panics = calls.load(Ordering::SeqCst);
    let _ = panic::catch_unwind(|| panic!("of the child's own"));
    let heard = calls.load(Ordering::SeqCst) - panics;
    drop(panic::take_hook());

    let seen = seen.expect("no panic").expect("a picture");
    assert_eq!(panics, 0, "nothing panics");
    assert_eq!(heard, 1, "the hook is still the child's");
    assert_eq!(before, after);
    assert_eq!(left, [""; 0], "nothing stays open");
    assert!(seen.picture.ids().iter().filter(|id| **id >= 0).count() > 10_000);
    if cfg!(target_os = "linux") {
        look_at_threads(&way, &seen);
    }
}

/// Holds the threads against what [`Renderer`] tells. Those of a pool are counted: they may still
/// be on the way to their names.
fn look_at_threads(way: &str, seen: &Seen) {
    let Seen { with, without, .. } = seen;
    let all = rayon::current_num_threads();
    // The thread of a job may still be about to end.
    let may = match way {
        "pool" => 0..=0,
        "threads" => 2..=2,
        "threads job" => 2..=3,
        "plain" => all..=all,
        "job" => all..=all + 1,
        // A driver has as many as it likes.
        _ => 0..=usize::MAX,
    };
    assert!(may.contains(&with.len()), "{way}: {with:?}");
    // Had rayon's global pool been started, it would be there for good.
    let staying = if is_global(way) { all } else { 0 };
    assert_eq!(without.len(), staying, "{way}: these outlive the renderer: {without:?}");
}

/// What a stream says between the two lines.
fn between(text: &[u8]) -> String {
    let text = String::from_utf8_lossy(text);
    let (_, behind) = text.split_once(&format!("{BEGIN}\n")).expect("a first line");
    behind.split_once(&format!("{END}\n")).expect("a last line").0.to_owned()
}

/// Draws in one way, in a process of its own. Gives what it wrote to standard error.
fn child(way: &str) -> String {
    let output = Command::new(env::current_exe().expect("this program"))
        .args(["--exact", "a_child_looks_at_itself", "--nocapture", "--test-threads", "1"])
        .env_clear()
        .env(WAY, way)
        .output()
        .expect("a process");
    let words = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let (out, err) = (words(&output.stdout), words(&output.stderr));
    assert!(output.status.success(), "{way}: {}\n{out}{err}", output.status);
    assert!(out.contains("1 passed"), "{way}: {out}");
    assert_eq!(between(&output.stdout), "", "{way}: nothing goes to standard output");
    between(&output.stderr)
}

/// Asserts that nothing was written.
fn silent(said: String) {
    assert_eq!(said, "", "nothing goes to standard error");
}

#[test]
fn inside_of_a_pool_no_thread_is_started() {
    silent(child("pool"));
}

#[test]
fn a_pool_of_its_own_is_the_only_one_and_goes_with_the_renderer() {
    silent(child("threads"));
    silent(child("threads job"));
}

#[test]
fn elsewhere_the_global_pool_draws() {
    silent(child("plain"));
    silent(child("job"));
}

#[test]
fn a_gpu_leaves_nothing_but_what_its_driver_says() {
    for way in ["gpu", "gpu pool"] {
        for line in child(way).lines().filter(|line| !line.is_empty()) {
            let known = OF_DRIVERS.iter().any(|words| line.starts_with(words));
            assert!(known, "{way}: {line}");
        }
    }
}
