//! The command line, run as a person runs it: outputs, exit codes, pipes, kills.

use std::{
    fs,
    io::{Read, Write},
    path::Path,
    process::{Command, Output, Stdio},
    time::Duration,
};

use tempfile::TempDir;

const SCENES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes");
const GOLDEN: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/golden/first.png");

/// Two spheres that overlap in a picture small enough to look at every pixel; none is tangent to a
/// sample's ray.
const SCENE: &str = "
[camera]
view = [1, 0, 0]
width = 8
[image]
width = 40
height = 30
background = '#102030'
[[sphere]]
center = [5, 1, 0]
radius = 2
color = '#ff0000'
[[sphere]]
center = [4, -1, 0.5]
radius = 1.45
color = '#00ff00'
";

fn program(folder: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_planisphere"));
    command.current_dir(folder).env_remove("NO_COLOR");
    command
}

fn run(folder: &Path, args: &[&str]) -> Output {
    program(folder).args(args).stdin(Stdio::null()).output().expect("the program runs")
}

fn succeed(folder: &Path, args: &[&str]) -> Output {
    let output = run(folder, args);
    assert!(output.status.success(), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
    output
}

/// Exit code and words of a run that must fail.
fn fail(folder: &Path, args: &[&str], code: i32, words: &[&str]) {
    let output = run(folder, args);
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{args:?}: {message}");
    for word in words {
        assert!(message.contains(word), "{args:?} lacks {word:?}: {message}");
    }
    assert!(output.stdout.is_empty(), "{args:?} wrote to standard output");
}

fn folder_with(scene: &str) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("scene.toml"), scene).unwrap();
    folder
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> = fs::read_dir(folder)
        .unwrap()
        .map(|e| e.unwrap().file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

fn rgb(bytes: &[u8]) -> image::RgbImage {
    image::load_from_memory(bytes).expect("a whole PNG").into_rgb8()
}

/// The numbers of an `.npy` file of 4-byte numbers, after a check of its header.
fn npy<T>(path: &Path, descr: &str, shape: &str, read: fn([u8; 4]) -> T) -> Vec<T> {
    let bytes = fs::read(path).unwrap();
    assert!(bytes.starts_with(b"\x93NUMPY\x01\x00"));
    let start = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    let header = std::str::from_utf8(&bytes[10..start]).unwrap();
    assert_eq!(
        header.trim_end(),
        format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}")
    );
    assert_eq!(start % 64, 0);
    bytes[start..].as_chunks::<4>().0.iter().map(|&b| read(b)).collect()
}

#[test]
fn the_picture_the_ids_and_the_depths_agree() {
    let folder = folder_with(SCENE);
    let output =
        succeed(folder.path(), &["render", "scene.toml", "--ids", "i.npy", "--depth", "d.npy"]);
    assert!(output.stdout.is_empty());
    assert_eq!(names(folder.path()), ["d.npy", "i.npy", "scene.png", "scene.toml"]);
    let picture = rgb(&fs::read(folder.path().join("scene.png")).unwrap());
    let ids = npy(&folder.path().join("i.npy"), "<i4", "(30, 40)", i32::from_le_bytes);
    let depths = npy(&folder.path().join("d.npy"), "<f4", "(30, 40)", f32::from_le_bytes);
    let colors = |id: i32| match id {
        -1 => [0x10, 0x20, 0x30],
        0 => [255, 0, 0],
        _ => [0, 255, 0],
    };
    assert!(picture.pixels().zip(&ids).all(|(pixel, &id)| pixel.0 == colors(id)));
    assert_eq!((picture.width(), picture.height(), ids.len()), (40, 30, 1200));
    for wanted in [-1, 0, 1] {
        assert!(ids.contains(&wanted));
    }
    // +Y is to the left, +Z up; a pixel is 0.2 wide, its sample in its middle.
    for (k, (&id, &depth)) in ids.iter().zip(&depths).enumerate() {
        let (y, z) = ((20.0 - 0.5 - (k % 40) as f64) * 0.2, (15.0 - 0.5 - (k / 40) as f64) * 0.2);
        let hit = |x: f64, cy: f64, cz: f64, r: f64| {
            let q: f64 = r * r - (y - cy).powi(2) - (z - cz).powi(2);
            if q < 0.0 { f64::INFINITY } else { x - q.sqrt() }
        };
        let (red, green) = (hit(5.0, 1.0, 0.0, 2.0), hit(4.0, -1.0, 0.5, 1.45));
        let nearest = red.min(green);
        assert_eq!(
            id,
            if nearest == f64::INFINITY { -1 } else { i32::from(green < red) },
            "pixel {k}"
        );
        assert!(
            (f64::from(depth) - nearest).abs() < 1e-5 || f64::from(depth) == nearest,
            "pixel {k}: {depth}"
        );
    }
}

#[test]
fn pictures_go_where_they_are_told() {
    let folder = folder_with(SCENE);
    let elsewhere = tempfile::tempdir().unwrap();
    let scene = folder.path().join("scene.toml");
    let scene = scene.to_str().unwrap();
    // By default into the current folder, not the scene's.
    succeed(elsewhere.path(), &["render", scene, "--device", "cpu"]);
    assert_eq!(names(elsewhere.path()), ["scene.png"]);
    assert_eq!(names(folder.path()), ["scene.toml"]);
    let file = fs::read(elsewhere.path().join("scene.png")).unwrap();

    let stdout = succeed(folder.path(), &["render", "scene.toml", "-o", "-"]).stdout;
    assert_eq!(stdout, file);
    assert_eq!(names(folder.path()), ["scene.toml"]);
    succeed(folder.path(), &["render", "scene.toml", "-o", "none", "--ids", "i.npy"]);
    assert_eq!(names(folder.path()), ["i.npy", "scene.toml"]);

    // A scene from standard input.
    let mut child = program(folder.path())
        .args(["render", "-", "-o", "-"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    child.stdin.take().unwrap().write_all(SCENE.as_bytes()).unwrap();
    assert_eq!(child.wait_with_output().unwrap().stdout, file);
    fail(folder.path(), &["render", "-"], 2, &["-o OUT.png"]);
}

#[test]
fn statistics_are_one_json_object() {
    let folder = folder_with(SCENE);
    let output = succeed(
        folder.path(),
        &["render", "scene.toml", "-o", "none", "--stats", "--device", "cpu"],
    );
    let text = String::from_utf8(output.stdout).unwrap();
    assert_eq!(text.lines().count(), 1);
    let stats: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(stats["version"], 1);
    assert_eq!(
        (&stats["counts"]["spheres"], &stats["counts"]["pixels"]),
        (&2.into(), &1200.into())
    );
    assert!(stats["device"].as_str().unwrap().contains("cpu"));
    let times = &stats["milliseconds"];
    for step in ["load", "prepare", "render", "read_back", "decide", "encode", "write", "total"] {
        assert!(times[step].as_f64().is_some_and(|ms| ms >= 0.0), "{step} in {text}");
    }
    assert!(times["total"].as_f64() >= times["load"].as_f64());
    assert_eq!(names(folder.path()), ["scene.toml"]);
    for args in [&["-o", "-"][..], &["--ids", "-"], &["--depth", "-"]] {
        fail(
            folder.path(),
            &[&["render", "scene.toml", "--stats"], args].concat(),
            2,
            &["standard output"],
        );
    }
}

#[test]
fn a_region_is_a_part_of_the_whole() {
    let folder = folder_with(SCENE);
    let whole = rgb(&succeed(folder.path(), &["render", "scene.toml", "-o", "-"]).stdout);
    let args = ["render", "scene.toml", "-o", "-", "--region", "13,9,20,7"];
    let part = rgb(&succeed(folder.path(), &args).stdout);
    assert_eq!((part.width(), part.height()), (20, 7));
    assert!(part.enumerate_pixels().all(|(x, y, pixel)| pixel == whole.get_pixel(x + 13, y + 9)));
    fail(
        folder.path(),
        &["render", "scene.toml", "--region", "30,0,11,5"],
        2,
        &["beyond the image of 40 x 30"],
    );
    fail(
        folder.path(),
        &["render", "scene.toml", "--region", "4294967295,0,2,5"],
        2,
        &["beyond the image"],
    );
    fail(
        folder.path(),
        &["render", "scene.toml", "--region", "1,2,3"],
        2,
        &["column,row,width,height"],
    );
}

#[test]
fn the_size_changes_the_pixels_not_the_view() {
    let folder = folder_with(SCENE);
    // Three times as many pixels each way: every third one has the same sample.
    let small = rgb(&succeed(folder.path(), &["render", "scene.toml", "-o", "-"]).stdout);
    let large =
        rgb(&succeed(folder.path(), &["render", "scene.toml", "-o", "-", "--size", "120x90"])
            .stdout);
    assert_eq!((large.width(), large.height()), (120, 90));
    assert!(
        small
            .enumerate_pixels()
            .all(|(x, y, pixel)| pixel == large.get_pixel(3 * x + 1, 3 * y + 1))
    );
    fail(folder.path(), &["render", "scene.toml", "--size", "0x4"], 2, &["1920x1080"]);
    fail(folder.path(), &["render", "scene.toml", "--size", "40000x4"], 2, &["32768"]);
    // Without a camera the whole scene is framed at every aspect.
    fs::write(
        folder.path().join("free.toml"),
        SCENE.split("[image]").nth(1).map(|s| format!("[image]{s}")).unwrap(),
    )
    .unwrap();
    for size in ["30x60", "60x30"] {
        let picture = rgb(&succeed(
            folder.path(),
            &["render", "free.toml", "-o", "-", "--size", size],
        )
        .stdout);
        let background = image::Rgb([0x10, 0x20, 0x30]);
        let (w, h) = picture.dimensions();
        let border = |x, y| x == 0 || y == 0 || x + 1 == w || y + 1 == h;
        assert!(
            picture.enumerate_pixels().all(|(x, y, p)| !border(x, y) || *p == background),
            "{size}"
        );
        assert!(picture.pixels().any(|p| *p != background));
    }
}

#[test]
fn what_cannot_be_written_is_exit_4() {
    let folder = folder_with(SCENE);
    for option in ["-o", "--ids", "--depth"] {
        fail(
            folder.path(),
            &["render", "scene.toml", option, "no/where/x"],
            4,
            &["no folder no/where"],
        );
        fail(folder.path(), &["render", "scene.toml", option, "."], 4, &["folder"]);
    }
    // Neither is any other output there then.
    assert_eq!(names(folder.path()), ["scene.toml"]);
    fail(
        folder.path(),
        &["render", "scene.toml", "--ids", "x", "--depth", "x"],
        2,
        &["both write x"],
    );
    fail(folder.path(), &["render", "scene.toml", "-o", "none"], 2, &["nothing to do"]);
    fail(folder.path(), &["render", "scene.toml", "--sise", "4x4"], 2, &["--size"]);
    if Path::new("/dev/full").exists() {
        fail(folder.path(), &["render", "scene.toml", "-o", "/dev/full"], 4, &["/dev/full"]);
    }
}

#[test]
fn a_killed_run_leaves_no_half_file() {
    let folder = tempfile::tempdir().unwrap();
    let scene = format!("{SCENES}/first.toml");
    let out = folder.path().join("out.png");
    let mut delay = Duration::from_millis(1);
    for round in 0.. {
        let old = round % 2 == 1;
        if old {
            fs::write(&out, "old").unwrap();
        }
        let mut child = program(folder.path())
            .args(["render", &scene, "-o", "out.png", "--size", "3000x2000", "--device", "cpu"])
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        std::thread::sleep(delay);
        let done = child.try_wait().unwrap().is_some();
        child.kill().unwrap();
        child.wait().unwrap();
        match fs::read(&out) {
            Ok(bytes) if bytes == b"old" => assert!(old && !done),
            Ok(bytes) => assert_eq!(rgb(&bytes).dimensions(), (3000, 2000)),
            Err(_) => assert!(!old && !done),
        }
        let _ = fs::remove_file(&out);
        if done {
            break;
        }
        delay = delay * 3 / 2;
    }
    assert!(
        names(folder.path()).iter().all(|name| name.ends_with(".tmp")),
        "{:?}",
        names(folder.path())
    );
}

#[test]
fn a_closed_pipe_is_success() {
    let folder = tempfile::tempdir().unwrap();
    let scene = format!("{SCENES}/first.toml");
    for args in [
        &["render", &scene, "-o", "-", "--size", "2000x2000", "--device", "cpu"][..],
        &["render", &scene, "-o", "none", "--depth", "-", "--device", "cpu"],
        &["render", &scene, "-o", "none", "--stats", "--device", "cpu"],
        &["check", &scene, "--golden", GOLDEN, "--device", "cpu"],
        &["completions", "zsh"],
        &["render", "--help"],
    ] {
        let mut child = program(folder.path())
            .args(args)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut pipe = child.stdout.take().unwrap();
        if args.contains(&"-") {
            pipe.read_exact(&mut [0; 8]).unwrap();
        }
        drop(pipe);
        let output = child.wait_with_output().unwrap();
        let message = String::from_utf8_lossy(&output.stderr);
        assert!(
            output.status.success() && message.is_empty(),
            "{args:?}: {:?} {message}",
            output.status
        );
    }
}

#[test]
fn info_and_completions_tell() {
    let folder = tempfile::tempdir().unwrap();
    let info = String::from_utf8(succeed(folder.path(), &["info"]).stdout).unwrap();
    for word in ["cpu", "gpu", "--device auto"] {
        assert!(info.lines().any(|line| line.starts_with(word)), "{info}");
    }
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let script = succeed(folder.path(), &["completions", shell]).stdout;
        assert!(String::from_utf8(script).unwrap().contains("depth"), "{shell}");
    }
    fail(folder.path(), &["completions", "tcsh"], 2, &["bash"]);
    fail(folder.path(), &[], 2, &["Usage"]);
    let help = String::from_utf8(succeed(folder.path(), &["--help"]).stdout).unwrap();
    assert!(help.contains("Exit codes"));
    let version = String::from_utf8(succeed(folder.path(), &["--version"]).stdout).unwrap();
    assert_eq!(version, concat!("planisphere ", env!("CARGO_PKG_VERSION"), "\n"));
}

#[test]
fn auto_says_what_it_took() {
    let folder = folder_with(SCENE);
    let auto = succeed(folder.path(), &["render", "scene.toml", "-o", "none", "--stats"]);
    let message = String::from_utf8(auto.stderr).unwrap();
    assert!(message.starts_with("device: ") && message.contains("hardware GPU"), "{message}");
    let chosen = succeed(
        folder.path(),
        &["render", "scene.toml", "-o", "none", "--stats", "--device", "cpu"],
    );
    assert!(chosen.stderr.is_empty());
}

#[test]
fn made_scenes_are_the_same_bytes_and_draw() {
    let folder = tempfile::tempdir().unwrap();
    for kind in ["cloud", "lattice"] {
        let read = |name: &str, file: &str| fs::read(folder.path().join(name).join(file)).unwrap();
        succeed(folder.path(), &["make", kind, "a/deep", "--count", "3000"]);
        succeed(folder.path(), &["make", kind, "b", "--count", "3000", "--seed", "1"]);
        succeed(folder.path(), &["make", kind, "c", "--count", "3000", "--seed", "2"]);
        for file in ["centers.npy", "radii.npy", "colors.npy", "scene.toml"] {
            assert_eq!(read("a/deep", file), read("b", file));
        }
        assert_eq!(read("b", "centers.npy") == read("c", "centers.npy"), kind == "lattice");
        assert_eq!(read("b", "centers.npy").len(), 128 + 36_000);
        let stats =
            succeed(folder.path(), &["render", "b/scene.toml", "--stats", "--size", "200x200"])
                .stdout;
        let stats: serde_json::Value = serde_json::from_slice(&stats).unwrap();
        assert_eq!(stats["counts"]["spheres"], 3000);
    }
    fs::write(folder.path().join("file"), "").unwrap();
    fail(folder.path(), &["make", "cloud", "file"], 4, &["file"]);
    fail(folder.path(), &["make", "cloud", "d", "--count", "0"], 2, &["--count"]);
    fail(folder.path(), &["make", "fog", "d"], 2, &["cloud", "lattice"]);
}

#[test]
fn the_committed_cloud_says_how_to_make_its_arrays() {
    let folder = tempfile::tempdir().unwrap();
    fs::copy(format!("{SCENES}/cloud.toml"), folder.path().join("cloud.toml")).unwrap();
    let words = ["cloud.toml:18:11", "cloud/centers.npy: no such file", "planisphere make cloud"];
    fail(folder.path(), &["render", "cloud.toml"], 2, &words);
    succeed(folder.path(), &["make", "cloud", "cloud"]);
    succeed(folder.path(), &["render", "cloud.toml", "--size", "300x300"]);
    assert!(folder.path().join("cloud.png").exists());
}

#[test]
fn every_committed_scene_draws() {
    let folder = tempfile::tempdir().unwrap();
    let report = ["camera-origin", "camera-moved", "camera-turned", "occlusion"]
        .map(|name| format!("report/{name}"));
    for name in report.iter().map(String::as_str).chain(["first", "perspective", "inside", "cut"]) {
        let path = format!("{SCENES}/{name}.toml");
        let text = fs::read_to_string(&path).unwrap();
        assert!(
            text.starts_with("# ") && text.len() < 200_000,
            "{name} says what it shows, and is small"
        );
        let picture = rgb(&succeed(folder.path(), &["render", &path, "-o", "-"]).stdout);
        let colors: std::collections::HashSet<_> = picture.pixels().map(|p| p.0).collect();
        assert!(colors.len() >= 3, "{name} shows {} colours", colors.len());
    }
}

#[test]
fn explain_says_what_would_run_and_draws_nothing() {
    let folder = folder_with(SCENE);
    let explain = |args: &[&str]| {
        let output =
            succeed(folder.path(), &[&["render", "scene.toml", "--explain"], args].concat());
        String::from_utf8(output.stdout).unwrap()
    };
    let text = explain(&["--device", "cpu"]);
    for words in [
        "40 x 30 pixels",
        "cpu, as asked for",
        "no tests: no sphere reaches near (0)",
        "not asked for: ids",
        "RGB, 8 bits",
    ] {
        assert!(text.contains(words), "{text}");
    }
    assert!(explain(&["--palette"]).contains("a palette, if at most 256"));
    assert!(explain(&["--device", "gpu", "--ids", "i.npy"]).contains("one buffer"));
    assert!(
        explain(&["--region", "1,2,30,20", "-o", "none", "--ids", "i.npy"])
            .contains("30 x 20 from 1,2")
    );
    assert!(explain(&[]).contains("--device chooses another"));
    assert_eq!(names(folder.path()), ["scene.toml"]);
}

#[test]
fn stats_count_what_was_skipped() {
    let folder = tempfile::tempdir().unwrap();
    // Off the screen, behind, beyond far; one behind another in one tile; nothing in most tiles.
    let ball = |x: f64, y: f64| format!("[[sphere]]\ncenter = [{x:?}, {y:?}, 0.0]\nradius = 0.4\n");
    let spheres = [(5.0, 0.5), (7.0, 0.5), (5.0, 90.0), (-5.0, 0.5), (500.0, 0.5)]
        .map(|(x, y)| ball(x, y))
        .concat();
    let scene = format!(
        "[camera]\nview = [1, 0, 0]\nwidth = 10\nfar = 100\n[image]\nwidth = 320\nheight = 320\n\
         {spheres}"
    );
    fs::write(folder.path().join("scene.toml"), scene).unwrap();
    // The native device's tiles are smaller where there are many threads.
    for (device, tiles) in [("cpu", &[25, 100][..]), ("gpu", &[1600])] {
        let args = ["render", "scene.toml", "-o", "none", "--stats", "--device", device];
        let stats: serde_json::Value =
            serde_json::from_slice(&succeed(folder.path(), &args).stdout).unwrap();
        let counts = &stats["counts"];
        assert_eq!((&counts["outside"], &counts["hidden"]), (&3.into(), &0.into()), "{counts}");
        let [all, empty, entries] =
            ["tiles", "empty", "entries"].map(|name| counts[name].as_u64().unwrap());
        assert!(tiles.contains(&all), "{counts}");
        let tiles = all;
        assert!(
            empty > tiles * 8 / 10 && empty < tiles && entries >= 2 * (tiles - empty),
            "{counts}"
        );
    }
    // Enough spheres, and a wall before them: most are never looked at closely.
    succeed(folder.path(), &["make", "cloud", "cloud", "--count", "2e5"]);
    let file = "[camera]\n\
                origin = [3, 3, 3]\n\
                view = [-1, -1, -1]\n\
                width = 0.8\n\
                [image]\n\
                width = 256\n\
                height = 256\n\
                [[sphere]]\n\
                center = [2, 2, 2]\n\
                radius = 0.75\n\
                [[spheres]]\n\
                centers = 'cloud/centers.npy'\n\
                radii = 'cloud/radii.npy'\n";
    fs::write(folder.path().join("wall.toml"), file).unwrap();
    let args = ["render", "wall.toml", "-o", "none", "--stats", "--device", "cpu"];
    let stats: serde_json::Value =
        serde_json::from_slice(&succeed(folder.path(), &args).stdout).unwrap();
    let counts = &stats["counts"];
    let (outside, hidden) =
        (counts["outside"].as_u64().unwrap(), counts["hidden"].as_u64().unwrap());
    assert!(
        outside > 10_000 && outside < 200_000 && hidden > 10_000 && outside + hidden <= 200_001,
        "{counts}"
    );
}
