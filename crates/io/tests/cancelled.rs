//! How soon the reading of a scene ends after it was cancelled, and that it tells how far it is.
//! One test, in a program of its own: others beside it would take the time that is measured.
#![cfg(feature = "read")]

use std::{
    fmt::Write as _,
    fs,
    path::Path,
    thread,
    time::{Duration, Instant},
};

use planisphere_core::drawing::Control;
use planisphere_io::load::{LoadError, Loaded, load, load_controlled};

/// What a reading may take to end.
const SOON: Duration = Duration::from_millis(if cfg!(debug_assertions) { 2000 } else { 30 });

/// Many spheres as text.
fn write_tables(path: &Path, count: usize, end: &str) {
    let mut text = String::from("[image]\nwidth = 64\n");
    for k in 0..count {
        writeln!(text, "[[sphere]]\ncenter = [{k}, {}.5, 1]\nradius = 0.25", k % 1000).unwrap();
    }
    fs::write(path, text + end).unwrap();
}

/// An array that must be copied, of three numbers for each sphere, and a scene that names it.
fn write_array(folder: &Path, name: &str, descr: &str, count: usize, number: &[u8]) {
    let header =
        format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': ({count}, 3), }}\n");
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.bytes());
    bytes.extend(number.repeat(3 * count));
    fs::write(folder.join(format!("{name}.npy")), bytes).unwrap();
    let scene = format!("[[spheres]]\ncenters = '{name}.npy'\nradius = 1\n");
    fs::write(folder.join(format!("{name}.toml")), scene).unwrap();
}

fn assert_cancelled(result: &Result<Loaded, LoadError>, what: &str) {
    let error = result.as_ref().expect_err(what);
    assert!(error.is_cancelled(), "{what}: {error}");
    assert_eq!(error.message(), "the reading was cancelled", "{what}");
}

/// Reads a scene while it is looked at, and cancels it when `when` says so, of the time and the
/// progress. The result, and how long it took after that; the progress that was seen.
fn watched(
    path: &Path,
    when: impl Fn(Duration, f32) -> bool + Sync,
) -> (Result<Loaded, LoadError>, Option<Duration>, f32) {
    let control = Control::new();
    thread::scope(|scope| {
        let reading = scope.spawn(|| (load_controlled(path, &control), Instant::now()));
        let (begun, mut last, mut asked) = (Instant::now(), 0.0, None);
        while !reading.is_finished() {
            let now = control.progress();
            assert!((last..=1.0).contains(&now), "progress falls: {last} {now}");
            last = now;
            if asked.is_none() && when(begun.elapsed(), now) {
                asked = Some(Instant::now());
                control.cancel();
            }
            thread::sleep(Duration::from_micros(500));
        }
        let (result, ended) = reading.join().unwrap();
        // One that had ended before was not cancelled.
        let spent = asked.and_then(|asked| ended.checked_duration_since(asked));
        (result, spent, control.progress())
    })
}

/// The shortest time that one takes to end, of some tries that are cancelled before their end.
fn ends_soon(path: &Path, when: impl Fn(Duration, f32) -> bool + Sync) {
    let mut shortest = Duration::MAX;
    for _ in 0..3 {
        let (result, spent, progress) = watched(path, &when);
        if let (Err(_), Some(spent)) = (&result, spent) {
            assert_cancelled(&result, &path.display().to_string());
            assert!(progress < 1.0, "{}: {progress}", path.display());
            shortest = shortest.min(spent);
        }
    }
    assert!(shortest <= SOON, "{}: {shortest:?}", path.display());
}

#[test]
fn readings_end_soon_after_they_are_cancelled() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(format!("{name}.toml"));
    write_tables(&file("tables"), 300_000, "");
    // The last sphere is wrong: the cut by lines is given up, and the tokens are gone through.
    write_tables(&file("tokens"), 300_000, "[[sphere]] # last\ncenter = '''\n[[sphere]]\n'''\n");
    write_array(folder.path(), "big", ">f8", 3_000_000, &1.5f64.to_be_bytes());
    write_array(folder.path(), "searched", "<i8", 3_000_000, &3i64.to_le_bytes());
    let names = ["tables", "tokens", "big", "searched"];

    for name in names {
        let control = Control::new();
        control.cancel();
        let begun = Instant::now();
        assert_cancelled(&load_controlled(&file(name), &control), name);
        assert!(begun.elapsed() <= SOON, "{name}, before it began: {:?}", begun.elapsed());
        assert_eq!(control.progress(), 0.0, "{name}");
    }
    let begun = Instant::now();
    load(&file("tokens")).expect_err("a centre that is a string");
    let late = begun.elapsed().mul_f64(0.6);
    let millis = Duration::from_millis;
    for name in names {
        ends_soon(&file(name), |time, _| time >= millis(2));
    }
    for reached in [0.2, 0.4, 0.6] {
        ends_soon(&file("tables"), |_, progress| progress >= reached);
        ends_soon(&file("tokens"), |_, progress| progress >= reached);
    }
    // Pieces are parsed once more when they are cut by tokens.
    ends_soon(&file("tokens"), |time, _| time >= late);
    for name in ["big", "searched"] {
        ends_soon(&file(name), |_, progress| progress >= 0.7);
    }

    // What nobody cancels is read as ever.
    for (name, spheres) in [("tables", 300_000), ("big", 3_000_000), ("searched", 3_000_000)] {
        let (result, _, progress) = watched(&file(name), |_, _| false);
        let (result, plain) = (result.unwrap(), load(&file(name)).unwrap());
        assert_eq!((result.scene.len(), progress), (spheres, 1.0), "{name}");
        assert_eq!(result.scene.bounds(), plain.scene.bounds(), "{name}");
    }
    let (result, ..) = watched(&file("tokens"), |_, _| false);
    let error = result.expect_err("a centre that is a string");
    assert!(!error.is_cancelled() && error.line().is_some(), "{error}");

    #[cfg(unix)]
    {
        // A pipe whose writer writes nothing.
        let pipe = file("pipe");
        let made = std::process::Command::new("mkfifo").arg(&pipe).status().unwrap();
        assert!(made.success());
        let writer = fs::OpenOptions::new().read(true).write(true).open(&pipe).unwrap();
        ends_soon(&pipe, |time, _| time >= millis(30));
        drop(writer);
    }
}
