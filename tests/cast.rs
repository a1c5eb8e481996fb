//! The exercise of `docs/ray-sphere.md`: the caster in NumPy is right on the scenes of the report.
//!
//! It needs a Python 3.11 with NumPy: `PYTHON` names one, else the first of `python3` and
//! `/usr/bin/python3` that has it is taken. `tests/run.sh` installs it on Debian and Ubuntu.

use std::{
    fs,
    path::Path,
    process::{Command, Output},
};

const REPORT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/report");

fn python() -> String {
    let named = std::env::var("PYTHON").ok();
    let has_numpy = |python: &String| {
        let output = Command::new(python).args(["-c", "import numpy, tomllib"]).output();
        output.is_ok_and(|output| output.status.success())
    };
    named
        .into_iter()
        .chain(["python3", "/usr/bin/python3"].map(str::to_owned))
        .find(has_numpy)
        .expect("a Python 3.11 with NumPy: apt-get install python3-numpy, or set PYTHON")
}

fn run(command: &mut Command) -> Output {
    let output = command.output().expect("it starts");
    assert!(output.status.success(), "{command:?}: {}", String::from_utf8_lossy(&output.stderr));
    output
}

/// The ids that the program gives, and those of the caster.
fn both(python: &str, scene: &Path, folder: &Path, option: &[&str]) -> [Vec<u8>; 2] {
    let [ours, theirs] = ["ours.npy", "theirs.npy"].map(|name| folder.join(name));
    let program = env!("CARGO_BIN_EXE_planisphere");
    run(Command::new(program).arg("render").arg(scene).args(["-o", "none", "--ids"]).arg(&ours));
    run(Command::new(python)
        .arg(Path::new(REPORT).join("cast.py"))
        .args(option)
        .arg(scene)
        .arg(&theirs));
    [ours, theirs].map(|path| fs::read(path).expect("an array"))
}

#[test]
fn thirty_lines_of_numpy_give_the_report() {
    let (python, folder) = (python(), tempfile::tempdir().unwrap());
    let mut scenes = 0;
    for entry in fs::read_dir(REPORT).expect("scenes") {
        let scene = entry.expect("an entry").path();
        if scene.extension().is_none_or(|kind| kind != "toml") {
            continue;
        }
        let [ours, theirs] = both(&python, &scene, folder.path(), &[]);
        assert!(ours == theirs, "{}", scene.display());
        scenes += 1;
    }
    assert_eq!(scenes, 4);
}

/// The page's example of what f32 gets wrong: a scene far from the origin.
#[test]
fn f32_is_wrong_far_away() {
    let (python, folder) = (python(), tempfile::tempdir().unwrap());
    let text = fs::read_to_string(Path::new(REPORT).join("occlusion.toml")).unwrap();
    let far = folder.path().join("far.toml");
    fs::write(&far, moved(&text)).unwrap();
    let wrong = |[ours, theirs]: [Vec<u8>; 2]| {
        let pixels = ours[128..].chunks(4).zip(theirs[128..].chunks(4));
        pixels.filter(|(a, b)| a != b).count()
    };
    assert_eq!(wrong(both(&python, &far, folder.path(), &[])), 0);
    let found = wrong(both(&python, &far, folder.path(), &["--f32"]));
    assert!((1000..5000).contains(&found), "{found} pixels are wrong in f32");
}

/// The scene moved by 1e6 along y.
fn moved(text: &str) -> String {
    let line = |line: &str| {
        let Some((key, list)) =
            line.split_once(" = [").filter(|(key, _)| ["center", "origin"].contains(key))
        else {
            return line.to_owned();
        };
        let numbers: Vec<f64> = list
            .split(']')
            .next()
            .unwrap_or_default()
            .split(',')
            .map(|number| number.trim().parse().expect("a number"))
            .collect();
        format!("{key} = [{:?}, {:?}, {:?}]", numbers[0], numbers[1] + 1e6, numbers[2])
    };
    text.lines().map(line).collect::<Vec<_>>().join("\n")
}
