//! Sequences: turntables, frames of trajectories, and animations, drawn by the program.

use std::{
    fs,
    io::Cursor,
    path::Path,
    process::{Command, Output, Stdio},
    thread,
    time::{Duration, Instant},
};

use image::{
    AnimationDecoder,
    codecs::{gif::GifDecoder, png::PngDecoder},
};
use tempfile::TempDir;

/// Three spheres, the middle of which is (1, 2, 3), and a camera that sees them from aside.
const SCENE: &str = "
[camera]
origin = [11, 2, 4]
view = [-1, 0, -0.125]
width = 9
far = 40
[image]
width = 61
height = 48
[[sphere]]
center = [0, 2, 3]
radius = 1
color = '#ff0000'
[[sphere]]
center = [2, 1, 2.5]
radius = 0.75
color = '#00ff00'
[[sphere]]
center = [1, 3, 3.5]
radius = 0.5
color = '#0000ff'
";

/// The same without a camera.
fn bare() -> String {
    format!("[image]{}", SCENE.split_once("[image]").expect("a table").1)
}

fn folder() -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("s.toml"), SCENE).expect("a file");
    fs::write(folder.path().join("bare.toml"), bare()).expect("a file");
    folder
}

fn run(folder: &Path, args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_planisphere"));
    command.arg("render").args(args).args(["--device", "cpu"]).current_dir(folder);
    command.stdin(Stdio::null()).output().expect("the program runs")
}

/// What a run says; it must succeed.
fn said(folder: &Path, args: &[&str]) -> String {
    let output = run(folder, args);
    let words = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{args:?}: {words}");
    words
}

/// What a run that must fail says.
fn refused(folder: &Path, args: &[&str], words: &[&str]) {
    let output = run(folder, args);
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{args:?}: {message}");
    for word in words {
        assert!(message.contains(word), "{args:?} lacks {word:?}: {message}");
    }
}

/// Names in a folder that begin with a word.
fn names(folder: &Path, word: &str) -> Vec<String> {
    let entries = fs::read_dir(folder).expect("a folder");
    let names = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let mut names: Vec<String> = names.filter(|name| name.starts_with(word)).collect();
    names.sort();
    names
}

fn bytes(folder: &Path, name: &str) -> Vec<u8> {
    fs::read(folder.join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

/// Pixels of a picture, with alpha.
fn pixels(folder: &Path, name: &str) -> Vec<u8> {
    image::load_from_memory(&bytes(folder, name)).expect("a picture").to_rgba8().into_raw()
}

#[test]
fn a_turntable_turns_the_camera() {
    let (folder, other) = (folder(), SCENE.replace("[11, 2, 4]", "[-9, 2, 4]"));
    let path = folder.path();
    let words =
        said(path, &["s.toml", "--turntable", "4", "--axis", "z", "-o", "t-{frame:04}.png"]);
    assert_eq!(names(path, "t-"), ["t-0000.png", "t-0001.png", "t-0002.png", "t-0003.png"]);
    assert!(words.contains("4 pictures drawn"), "{words}");
    // The width is odd.
    let command = "ffmpeg -framerate 30 -i t-%04d.png -vf 'pad=ceil(iw/2)*2:ceil(ih/2)*2' -c:v \
                   libx264 -pix_fmt yuv420p -crf 18 t.mp4";
    assert_eq!(words.lines().last(), Some(command), "{words}");

    said(path, &["s.toml", "-o", "plain.png"]);
    assert!(bytes(path, "plain.png") == bytes(path, "t-0000.png"), "the first is as it is");
    // Half a turn about (1, 2): 10 in front of it becomes 10 behind it.
    fs::write(path.join("half.toml"), other.replace("[-1, 0, -0.125]", "[1, 0, -0.125]")).unwrap();
    said(path, &["half.toml", "-o", "half.png"]);
    assert!(bytes(path, "half.png") == bytes(path, "t-0002.png"), "the third is from behind");
    // A quarter, counterclockwise from above: x becomes y.
    let quarter = SCENE.replace("[11, 2, 4]", "[1, 12, 4]");
    fs::write(path.join("quarter.toml"), quarter.replace("[-1, 0, -0.125]", "[0, -1, -0.125]"))
        .unwrap();
    said(path, &["quarter.toml", "-o", "quarter.png"]);
    assert!(bytes(path, "quarter.png") == bytes(path, "t-0001.png"), "the second is from y");
    // What is up without a word is z, too.
    said(path, &["s.toml", "--turntable", "4", "-o", "up-{frame}.png"]);
    for place in 0..4 {
        let [up, z] = [format!("up-{place}.png"), format!("t-000{place}.png")];
        assert!(bytes(path, &up) == bytes(path, &z), "{place}");
    }
    let all: Vec<_> = names(path, "t-").iter().map(|name| bytes(path, name)).collect();
    assert!((0..4).all(|a| (0..a).all(|b| all[a] != all[b])), "they differ");
}

/// Whether a sphere is seen at the border of a picture.
fn touches_the_border(folder: &Path, name: &str, [width, height]: [usize; 2]) -> bool {
    let pixels = pixels(folder, name);
    let border = |x: usize, y: usize| x == 0 || y == 0 || x == width - 1 || y == height - 1;
    let corner = pixels[..4].to_vec();
    (0..width * height)
        .any(|at| border(at % width, at / width) && pixels[4 * at..4 * at + 4] != corner[..])
}

#[test]
fn a_chosen_camera_sees_all_from_all_sides() {
    let folder = folder();
    let path = folder.path();
    for projection in ["--orthographic", "--perspective"] {
        for axis in ["up", "x", "y", "z"] {
            for size in [[64, 40], [30, 50]] {
                let [width, height] = size.map(|side: usize| side);
                let size = format!("{width}x{height}");
                let args = ["bare.toml", "--turntable", "7", "--axis", axis, projection];
                let rest = ["--size", &size, "-o", "c{frame}.png"];
                said(path, &[&args[..], &rest[..]].concat());
                for place in 0..7 {
                    let name = format!("c{place}.png");
                    assert!(
                        !touches_the_border(path, &name, [width, height]),
                        "{projection} {axis} {place}"
                    );
                }
            }
        }
    }
}

#[test]
fn other_planes_and_names() {
    let folder = folder();
    let path = folder.path();
    let args = ["s.toml", "--turntable", "3", "--ids", "i{frame}.npy", "--depth"];
    said(path, &[&args[..], &["d{frame:02}.npy", "--visibility", "p{frame}.npz"]].concat());
    // The default is of the scene's name.
    assert_eq!(names(path, "s-"), ["s-0000.png", "s-0001.png", "s-0002.png"]);
    assert_eq!(names(path, "i"), ["i0.npy", "i1.npy", "i2.npy"]);
    assert_eq!(names(path, "d"), ["d00.npy", "d01.npy", "d02.npy"]);
    assert_eq!(names(path, "p"), ["p0.npz", "p1.npz", "p2.npz"]);
    let words = said(path, &["s.toml", "--turntable", "2", "-o", "none", "--ids", "j{frame}.npy"]);
    assert!(!words.contains("ffmpeg"), "{words}");
    assert!(bytes(path, "j0.npy") == bytes(path, "i0.npy"));
    let text = run(path, &["s.toml", "--turntable", "2", "--explain"]);
    assert!(String::from_utf8_lossy(&text.stdout).contains("device"));
    assert!(String::from_utf8_lossy(&text.stderr).contains("of the first of 2 pictures"));
}

#[test]
fn what_makes_no_sense_is_refused() {
    let folder = folder();
    let path = folder.path();
    let turn = |more: &[&'static str]| [&["s.toml", "--turntable", "3"], more].concat();
    for (args, words) in [
        (turn(&["-o", "a.png"]), &["a-{frame:04}.png"][..]),
        (turn(&["-o", "-"]), &["standard output takes one file"]),
        (turn(&["-o", "a-{n}.png"]), &["{n} stands for nothing", "{frame:04}"]),
        (turn(&["-o", "a-{frame:4}.png"]), &["{frame:4} stands for nothing"]),
        (turn(&["-o", "a-{frame}.jpx"]), &[".png"]),
        (turn(&["-o", "a-{frame}.gif"]), &["leave out the number"]),
        (turn(&["--ids", "i.npy"]), &["--ids i.npy is one name", "i-{frame:04}.npy"]),
        (turn(&["--stats"]), &["--stats is of one picture"]),
        (turn(&["-o", "a.gif", "--resume"]), &["a-{frame:04}.png"]),
        (turn(&["-o", "a.gif", "--palette"]), &["--palette is for PNG"]),
        (turn(&["-o", "a.gif", "--dpi", "300"]), &["--dpi is for print"]),
        (turn(&["-o", "a.apng", "--depth16"]), &["--depth16 is for PNG"]),
        (turn(&["--normals", "n.npy"]), &["n-{frame:04}.npy"]),
        (turn(&["-o", "a.gif", "--fps", "60"]), &["at most 50", ".apng"]),
        (turn(&["-o", "x{frame}.png", "--ids", "x{frame}.png"]), &["x0.npy"]),
        (turn(&["--frames", "0..2"]), &["cannot be used with"]),
        (vec!["s.toml", "-o", "a.gif"], &["one picture is no animation", "--turntable N"]),
        (vec!["s.toml", "-o", "a-{frame}.png"], &["{frame} in -o a-{frame}.png is for several"]),
        (vec!["s.toml", "--resume"], &["--resume is for several pictures"]),
        (vec!["s.toml", "--fps", "5"], &["--fps is for several pictures"]),
        (vec!["s.toml", "--axis", "x"], &["--turntable"]),
        (vec!["s.toml", "--turntable", "0"], &["--turntable"]),
        (vec!["s.toml", "--frames", "0..2"], &["files of particles"]),
    ] {
        refused(path, &args, words);
    }
    assert_eq!(names(path, ""), ["bare.toml", "s.toml"], "nothing was written");
}

#[cfg(unix)]
#[test]
fn names_that_get_in_the_way_are_refused() {
    use std::os::unix::fs::symlink;

    let folder = folder();
    let path = folder.path();
    // A name of the sequence is an input.
    fs::rename(path.join("s.toml"), path.join("t-2.png")).unwrap();
    let args = ["t-2.png", "--turntable", "3", "-o", "t-{frame}.png"];
    refused(path, &args, &["would replace t-2.png", "another name"]);
    fs::rename(path.join("t-2.png"), path.join("s.toml")).unwrap();
    // Two names of the sequence are one file.
    symlink("u-1.png", path.join("u-2.png")).unwrap();
    let args = ["s.toml", "--turntable", "3", "-o", "u-{frame}.png"];
    refused(path, &args, &["one file", "u-1.png"]);
    // One is a folder.
    fs::create_dir(path.join("v-1.png")).unwrap();
    let output = run(path, &["s.toml", "--turntable", "3", "-o", "v-{frame}.png"]);
    assert_eq!(output.status.code(), Some(4), "{output:?}");
    assert_eq!(names(path, ""), ["bare.toml", "s.toml", "u-2.png", "v-1.png"]);
}

#[test]
fn resume_leaves_what_is_there() {
    let folder = folder();
    let path = folder.path();
    let args = ["s.toml", "--turntable", "5", "-o", "r{frame}.png", "--ids", "i{frame}.npy"];
    said(path, &args);
    let whole: Vec<_> = names(path, "r").iter().map(|name| bytes(path, name)).collect();
    fs::write(path.join("r1.png"), "whatever").unwrap();
    fs::remove_file(path.join("r3.png")).unwrap();
    fs::remove_file(path.join("i4.npy")).unwrap();
    let words = said(path, &[&args[..], &["--resume"]].concat());
    assert!(words.contains("2 pictures drawn, 3 left as they were"), "{words}");
    assert!(words.contains("ffmpeg"), "{words}");
    assert_eq!(bytes(path, "r1.png"), b"whatever");
    assert!(bytes(path, "r3.png") == whole[3] && bytes(path, "r4.png") == whole[4]);
    let words = said(path, &[&args[..], &["--resume"]].concat());
    assert!(words.contains("5 pictures there already"), "{words}");
    // Without it all are written anew.
    said(path, &args);
    assert!((0..5).all(|place| bytes(path, &format!("r{place}.png")) == whole[place]));
}

/// The pictures that are drawn for an animation.
fn drawn(path: &Path, args: &[&str], numbers: &[usize]) -> Vec<Vec<u8>> {
    said(path, &[args, &["-o", "f{frame}.png"]].concat());
    numbers.iter().map(|number| pixels(path, &format!("f{number}.png"))).collect()
}

/// Frames, and how long each is shown, in milliseconds.
fn shown(frames: image::Frames<'_>) -> Vec<(Vec<u8>, f64)> {
    let frame = |frame: image::Frame| {
        let (above, below) = frame.delay().numer_denom_ms();
        (frame.into_buffer().into_raw(), f64::from(above) / f64::from(below))
    };
    frames.map(|found| frame(found.expect("a frame"))).collect()
}

fn apng(path: &Path, name: &str) -> Vec<(Vec<u8>, f64)> {
    let decoder = PngDecoder::new(Cursor::new(bytes(path, name))).expect("a PNG");
    shown(decoder.apng().expect("an animation").into_frames())
}

fn gif(path: &Path, name: &str) -> Vec<(Vec<u8>, f64)> {
    let decoder = GifDecoder::new(Cursor::new(bytes(path, name))).expect("a GIF");
    shown(decoder.into_frames())
}

#[test]
fn animations_have_the_pixels_of_pictures() {
    let folder = folder();
    let path = folder.path();
    let args = ["s.toml", "--turntable", "6"];
    let wanted = drawn(path, &args, &[0, 1, 2, 3, 4, 5]);
    let words = said(path, &[&args[..], &["-o", "a.apng", "--ids", "i{frame}.npy"]].concat());
    assert!(words.contains("6 pictures drawn") && !words.contains("ffmpeg"), "{words}");
    let found = apng(path, "a.apng");
    assert!(found.iter().map(|(pixels, _)| pixels).eq(&wanted));
    assert!(found.iter().all(|(_, shown)| (shown - 1000.0 / 30.0).abs() < 1.0), "{:?}", found[0].1);
    assert_eq!(names(path, "i").len(), 6);
    said(path, &[&args[..], &["-o", "a.gif"]].concat());
    let found = gif(path, "a.gif");
    // Flat pictures have few colours: a GIF holds them all.
    assert!(found.iter().map(|(pixels, _)| pixels).eq(&wanted));
    assert!(found.iter().all(|(_, shown)| *shown == 40.0));
    said(path, &[&args[..], &["-o", "a.gif", "--fps", "12.5"]].concat());
    assert!(gif(path, "a.gif").iter().all(|(_, shown)| *shown == 80.0));
    // Several samples: clear pixels in part, which an APNG holds.
    let soft = ["--aa", "2", "--background", "transparent"];
    let args = [&args[..], &soft[..]].concat();
    let wanted = drawn(path, &args, &[0, 1, 2, 3, 4, 5]);
    said(path, &[&args[..], &["-o", "b.apng"]].concat());
    assert!(apng(path, "b.apng").iter().map(|(pixels, _)| pixels).eq(&wanted));
    refused(path, &[&args[..], &["-o", "b.gif"]].concat(), &["clear or not", ".apng"]);
    assert!(!path.join("b.gif").exists());
}

/// Three frames of two atoms; the second frame is farther apart.
const XYZ: &str = "2
Properties=species:S:1:pos:R:3
C 0 0 0
O 2 0 0
2
Properties=species:S:1:pos:R:3
C 0 -4 0
O 2 5 0
2
Properties=species:S:1:pos:R:3
C 0 0 1
O 2 0 0
";

#[test]
fn frames_of_a_trajectory_have_one_camera() {
    let folder = folder();
    let path = folder.path();
    fs::write(path.join("run.xyz"), XYZ).unwrap();
    let size = ["--size", "80x60"];
    let all = [&["run.xyz", "--frames", "0..", "-o", "f{frame}.png"][..], &size].concat();
    let words = said(path, &all);
    assert!(words.contains("the camera is chosen once, to suit frame 0"), "{words}");
    assert_eq!(names(path, "f"), ["f0.png", "f1.png", "f2.png"]);
    let one = |frame: &str, more: &[&str]| {
        said(path, &[&["run.xyz", "--frame", frame, "-o", "one.png"][..], &size, more].concat());
        bytes(path, "one.png")
    };
    assert!(one("0", &[]) == bytes(path, "f0.png"));
    assert!(one("1", &[]) != bytes(path, "f1.png"), "a camera of its own");
    // A camera that is given is that of all.
    fs::write(
        path.join("camera.toml"),
        "[camera]\norigin = [9, 0, 0]\nview = [-1, 0, 0]\nwidth = 20",
    )
    .unwrap();
    let given = ["--camera", "camera.toml"];
    let words = said(path, &[&all[..], &given].concat());
    assert!(!words.contains("chosen once"), "{words}");
    for frame in ["0", "1", "2"] {
        assert!(one(frame, &given) == bytes(path, &format!("f{frame}.png")), "{frame}");
    }
    // Some of them, and as an animation.
    let some = [&["run.xyz", "--frames", "0..3:2", "-o", "g{frame:03}.png"][..], &size].concat();
    let words = said(path, &some);
    assert_eq!(names(path, "g"), ["g000.png", "g002.png"]);
    assert!(words.contains("seq -f g%03.0f.png 0 2 2 |"), "{words}");
    let args = [&["run.xyz", "--frames", "0..3:2"][..], &size].concat();
    let wanted = drawn(path, &args, &[0, 2]);
    said(path, &[&args[..], &["-o", "h.apng"]].concat());
    assert!(apng(path, "h.apng").iter().map(|(pixels, _)| pixels).eq(&wanted));
    refused(path, &["run.xyz", "--frames", "1..9", "-o", "f{frame}.png"], &["no frame 8"]);
}

#[test]
fn frames_of_the_data() {
    let folder = folder();
    let path = folder.path();
    let data = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/xtc/water.xtc");
    let topology = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/xtc/water.gro");
    let args = [data, "--topology", topology, "--size", "64x64", "--view", "z"];
    said(path, &[&args[..], &["--frames", "1..3", "-o", "w{frame:02}.png"]].concat());
    assert_eq!(names(path, "w"), ["w01.png", "w02.png"]);
    said(path, &[&args[..], &["--frame", "1", "-o", "one.png"]].concat());
    assert!(bytes(path, "one.png") == bytes(path, "w01.png"));
}

/// What fails in the middle leaves what was written before, and says how to go on.
#[test]
fn a_broken_frame_ends_it() {
    let folder = folder();
    let path = folder.path();
    fs::write(path.join("run.xyz"), XYZ.replace("C 0 0 1", "C 0 0 x")).unwrap();
    let args = ["run.xyz", "--size", "40x40", "--frames", "0..3", "-o"];
    let words = ["2 pictures written; --resume"];
    refused(path, &[&args[..], &["f{frame}.png"]].concat(), &words);
    assert_eq!(names(path, "f"), ["f0.png", "f1.png"]);
    refused(path, &[&args[..], &["f.gif"]].concat(), &["run.xyz"]);
    assert!(!path.join("f.gif").exists());
}

#[test]
fn a_killed_run_leaves_whole_pictures() {
    let folder = folder();
    let path = folder.path();
    let args = ["s.toml", "--size", "700x700", "--aa", "4", "--turntable", "400"];
    let mut command = Command::new(env!("CARGO_BIN_EXE_planisphere"));
    command.arg("render").args(args).args(["-o", "k{frame:03}.png", "--device", "cpu"]);
    let mut child =
        command.current_dir(path).stderr(Stdio::null()).spawn().expect("the program runs");
    let begin = Instant::now();
    while names(path, "k").len() < 3 && begin.elapsed() < Duration::from_secs(100) {
        thread::sleep(Duration::from_millis(5));
    }
    child.kill().unwrap();
    let status = child.wait().unwrap();
    assert!(!status.success(), "it was killed in the middle");
    let found = names(path, "k");
    assert!((3..400).contains(&found.len()), "{} pictures", found.len());
    for name in &found {
        let picture = image::load_from_memory(&bytes(path, name)).expect("a whole picture");
        assert_eq!([picture.width(), picture.height()], [700, 700]);
    }
    // An animation is there when it is whole.
    command = Command::new(env!("CARGO_BIN_EXE_planisphere"));
    command.arg("render").args(args).args(["-o", "m.gif", "--device", "cpu"]);
    let mut child =
        command.current_dir(path).stderr(Stdio::null()).spawn().expect("the program runs");
    thread::sleep(Duration::from_millis(700));
    child.kill().unwrap();
    assert!(!child.wait().unwrap().success());
    assert_eq!(names(path, "m").len(), 0);
}
