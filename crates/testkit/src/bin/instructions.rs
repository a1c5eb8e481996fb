//! Counts the instructions of a dozen frames, and holds them against `benches/instructions.txt`.
//!
//! ```sh
//! cargo build --release && cargo run --release -p planisphere-testkit --bin instructions
//! cargo run --release -p planisphere-testkit --bin instructions -- --bless    # a change is meant
//! ```
//!
//! Each frame is a whole process: a scene is read, drawn and written as PNG, on the CPU or on the
//! software GPU, of which the host's side counts. It needs valgrind. A count that is more than 2 %
//! away from the committed one, to either side, fails.

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, ExitCode},
    sync::{Mutex, PoisonError},
};

use planisphere_testkit::instructions::{self, Counts};

/// Where the committed counts are.
const COMMITTED: &str = "benches/instructions.txt";

/// A scene of equal spheres, and the size of its picture.
const SCENES: [(&str, &str); 3] = [("1e3", "512x512"), ("1e5", "512x512"), ("1e6", "512x512")];

fn main() -> ExitCode {
    let bless = match std::env::args().nth(1).as_deref() {
        None => false,
        Some("--bless") => true,
        Some(other) => {
            eprintln!("instructions: {other}: there is --bless only");
            return ExitCode::FAILURE;
        }
    };
    match run(bless) {
        Ok(()) => ExitCode::SUCCESS,
        Err(words) => {
            eprintln!("instructions: {words}");
            ExitCode::FAILURE
        }
    }
}

fn run(bless: bool) -> Result<(), String> {
    let target = std::env::var_os("CARGO_TARGET_DIR").map_or("target".into(), PathBuf::from);
    let program = target.join("release/planisphere");
    let program = fs::canonicalize(&program)
        .map_err(|error| format!("{}: {error}; cargo build --release", program.display()))?;
    let folder = target.join("instructions");
    make_scenes(&program, &folder)?;
    let folder = fs::canonicalize(&folder).map_err(|error| error.to_string())?;
    let counted = count_all(&program, &folder)?;
    if bless {
        let lines = counted.iter().map(|(name, count)| format!("{name} {count}\n"));
        let text = format!("{HEAD}{}", lines.collect::<String>());
        return fs::write(COMMITTED, text).map_err(|error| format!("{COMMITTED}: {error}"));
    }
    let text = fs::read_to_string(COMMITTED).map_err(|error| format!("{COMMITTED}: {error}"))?;
    let (words, near) = instructions::compare(&instructions::parse(&text)?, &counted);
    print!("{words}");
    if near { Ok(()) } else { Err(format!("{FIX} ({COMMITTED})")) }
}

const HEAD: &str = "\
# Instructions of whole processes in planisphere's own code, one thread, counted by valgrind.
# cargo run --release -p planisphere-testkit --bin instructions -- --bless
# They depend on the compiler: Rust 1.95.
";

const FIX: &str = "frames cost other than what was committed: find out why; if it is meant, \
                   --bless, and tell in the commit";

/// Scenes of each size, for both cameras.
fn make_scenes(program: &Path, folder: &Path) -> Result<(), String> {
    let failed = |error: std::io::Error| format!("{}: {error}", folder.display());
    fs::create_dir_all(folder).map_err(failed)?;
    for (count, _) in SCENES {
        let name = format!("cloud-{count}");
        let made = Command::new(program)
            .args(["make", "cloud", &name, "--count", count, "--force"])
            .current_dir(folder)
            .output()
            .map_err(failed)?;
        if !made.status.success() {
            return Err(String::from_utf8_lossy(&made.stderr).into_owned());
        }
        let scene = folder.join(&name).join("scene.toml");
        let text = fs::read_to_string(&scene).map_err(failed)?;
        let other = text + "\n[camera]\nprojection = \"perspective\"\n";
        fs::write(scene.with_file_name("perspective.toml"), other).map_err(failed)?;
    }
    Ok(())
}

/// All frames, two at a time.
fn count_all(program: &Path, folder: &Path) -> Result<Counts, String> {
    let mut frames = Vec::new();
    for device in ["gpu", "cpu"] {
        for (count, size) in SCENES.into_iter().rev() {
            for camera in ["scene", "perspective"] {
                frames.push((device, count, size, camera));
            }
        }
    }
    let (frames, counted) = (Mutex::new(frames.into_iter()), Mutex::new(Ok(Counts::new())));
    let lock = || frames.lock().unwrap_or_else(PoisonError::into_inner).next();
    let work = || {
        while let Some((device, count, size, camera)) = lock() {
            let scene = format!("cloud-{count}/{camera}.toml");
            let picture = format!("{device}-{count}-{camera}.png");
            let arguments = ["render", &scene, "-o", &picture, "--size", size, "--device", device];
            let found = instructions::count(program, &arguments, folder);
            let camera = if camera == "scene" { "orthographic" } else { camera };
            let mut counted = counted.lock().unwrap_or_else(PoisonError::into_inner);
            match (found, &mut *counted) {
                (Ok(found), Ok(counts)) => {
                    counts.insert(format!("{device} {camera} {count}"), found);
                }
                (Err(words), all) => *all = Err(words),
                _ => {}
            }
        }
    };
    std::thread::scope(|scope| {
        scope.spawn(work);
        work();
    });
    counted.into_inner().unwrap_or_else(PoisonError::into_inner)
}
