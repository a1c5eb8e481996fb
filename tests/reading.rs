//! Options of files of particles, and of the camera: as they are typed, and as keys of a scene
//! file.

use std::{
    fs,
    io::Write,
    path::Path,
    process::{Command, Output, Stdio},
};

use tempfile::TempDir;

/// Two frames of four atoms, one of which has no element.
const XYZ: &str = "4
Properties=species:S:1:pos:R:3:charge:R:1:velo:R:3
O 0 0 0 -0.8 1 0 0
H 1 0 0 0.4 0 2 0
H 0 1 0 0.4 0 0 3
Xx 0 0 2 nan 0 0 0
2
Properties=species:S:1:pos:R:3
C 0 0 0
C 0 3 0
";

fn folder() -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("run.xyz"), XYZ).expect("a file");
    folder
}

fn run(folder: &Path, args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_planisphere"));
    command.args(args).current_dir(folder).stdin(Stdio::null()).output().expect("the program runs")
}

/// What a run says; it must succeed.
fn said(folder: &Path, args: &[&str]) -> String {
    let output = run(folder, args);
    let words = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{args:?}: {words}");
    words
}

/// A picture of 120 pixels a side.
fn picture(folder: &Path, args: &[&str]) -> Vec<u8> {
    // Scene files are flat without, and files of particles are not; the options differ.
    let flat = ["--look", "flat", "--no-metadata"];
    let common = ["-o", "out.png", "--size", "120x120", "--device", "cpu"];
    let common = [&common[..], &flat].concat();
    said(folder, &[&["render"], args, &common[..]].concat());
    fs::read(folder.join("out.png")).expect("a picture")
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

#[test]
fn one_line_says_what_was_understood() {
    let folder = folder();
    let words = said(folder.path(), &["render", "run.xyz", "--device", "cpu"]);
    let lines: Vec<&str> = words.lines().collect();
    // What was understood, and the look that was chosen.
    assert_eq!(lines.len(), 2, "{words}");
    assert!(lines[1].starts_with("look: matte, 4 x 4 samples a pixel ("), "{words}");
    for word in [
        "run.xyz: XYZ, frame 0 of several, 4 particles",
        "centres: pos",
        "radii: van der Waals, by column `species`",
        "colours: Jmol's, by column `species`",
        "1 particle has no van der Waals radius (Xx): drawn with a radius of 1.5",
    ] {
        assert!(words.contains(word), "lacks {word:?}: {words}");
    }
    let words = said(folder.path(), &["convert", "run.xyz", "--to", "none", "--frame", "last"]);
    assert!(words.contains("frame 1 of 2, 2 particles"), "{words}");
    let args =
        ["convert", "run.xyz", "--to", "none", "--color-by", "charge", "--range", "-0.5,0.5"];
    let words = said(folder.path(), &args);
    assert!(words.contains("`charge` is NaN for 1: their colour is #808080"), "{words}");
    assert!(words.contains("outside of the range for 1"), "{words}");
}

#[test]
fn frames_are_counted_from_both_ends() {
    let folder = folder();
    let ids = |frame: &str| {
        let args = ["convert", "run.xyz", "out.npz", "--frame", frame];
        said(folder.path(), &args)
    };
    assert_eq!(ids("1"), ids("last"));
    assert_eq!(ids("1"), ids("-1"));
    assert!(ids("-2").contains("frame 0 of 2"));
    let frame = |frame| ["convert", "run.xyz", "out.npz", "--frame", frame];
    refused(folder.path(), &frame("2"), &["there is no frame 2", "--frame 0 to --frame 1"]);
    refused(folder.path(), &frame("-3"), &["there is no frame -3"]);
    refused(folder.path(), &frame("first"), &["`last`"]);
    said(folder.path(), &["convert", "run.xyz", "f{frame}.ply", "--frames", "0.."]);
    assert!(["f0.ply", "f1.ply"].iter().all(|name| folder.path().join(name).is_file()));
    let args = ["convert", "run.xyz", "f.ply", "--frames", "0.."];
    refused(folder.path(), &args, &["{frame}"]);
}

#[test]
fn wrong_names_list_the_right_ones() {
    let folder = folder();
    let render = |more: &[&'static str]| [&["render", "run.xyz"], more].concat();
    let path = folder.path();
    refused(path, &render(&["--color-by", "mass"]), &["no column `mass`", "charge", "velo"]);
    refused(path, &render(&["--color-by", "velo.w"]), &["velo.x"]);
    refused(path, &render(&["--radius", "size"]), &["no column `size`"]);
    refused(path, &render(&["--radius", "-1"]), &["greater than 0"]);
    refused(path, &render(&["--radius", "species"]), &["holds words"]);
    refused(path, &render(&["--map", "jet", "--color-by", "charge"]), &["viridis", "tab20"]);
    refused(path, &render(&["--color", "redd"]), &["red"]);
    refused(path, &render(&["--view", "up"]), &["iso"]);
    refused(path, &render(&["--format", "pdf"]), &["pdb", "xyz"]);
    refused(path, &render(&["--range", "1,0", "--color-by", "charge"]), &["-1,1"]);
    fs::write(path.join("s.toml"), "[[sphere]]\ncenter = [0, 0, 0]\nradius = 1\n").unwrap();
    refused(path, &["render", "s.toml", "--radius", "1"], &["--radius", "[[spheres]]"]);
    refused(path, &["convert", "s.toml", "x.npz", "--frames", "0.."], &["--frames"]);
    fs::write(path.join("f.toml"), "[[spheres]]\nfile = 'run.xyz'\n").unwrap();
    refused(path, &["render", "f.toml", "--color", "red"], &["--color", "[[spheres]]"]);
    refused(path, &["info", "--radius", "1"], &["--radius is for a file"]);
    fs::write(path.join("points.asc"), "1 2 3\n4 5 6\n").unwrap();
    refused(path, &["render", "points.asc"], &["no scene file, and no file of particles"]);
    fs::rename(path.join("points.asc"), path.join("points.xyz")).unwrap();
    refused(path, &["render", "points.xyz"], &["points alone", "--format csv"]);
}

/// No output is an input, whatever it is read for.
#[test]
fn inputs_are_not_replaced() {
    let folder = folder();
    let path = folder.path();
    said(path, &["convert", "run.xyz", "top.xyz", "--frame", "1"]);
    fs::write(path.join("s.toml"), "[[spheres]]\nfile = 'top.xyz'\n").unwrap();
    fs::write(path.join("c.png"), "[camera]\nview = [1, 0, 0]\n").unwrap();
    fs::copy(path.join("top.xyz"), path.join("1.xyz")).unwrap();
    let before = |name: &str| fs::read(path.join(name)).unwrap();
    let (top, camera) = (before("top.xyz"), before("c.png"));
    let topology = ["--topology", "top.xyz", "--frame", "1"];
    for args in [
        &[&["convert", "run.xyz", "top.xyz"], &topology[..]].concat()[..],
        &["convert", "s.toml", "top.xyz"],
        &["convert", "run.xyz", "run.xyz"],
        &["convert", "1.xyz", "{frame}.xyz", "--topology", "1.xyz", "--frames", "0..1"],
        &["render", "run.xyz", "--camera", "c.png", "-o", "c.png"],
    ] {
        let output = run(path, args);
        let ok = args.contains(&"{frame}.xyz");
        assert_eq!(output.status.code(), Some(if ok { 0 } else { 2 }), "{args:?}");
    }
    assert_eq!((before("top.xyz"), before("c.png")), (top, camera));
    // A name with {frame} is of the frame that is drawn.
    said(path, &["convert", "run.xyz", "f{frame}.npz", "--frame", "last"]);
    assert!(path.join("f1.npz").is_file());
}

#[test]
fn names_of_pictures_keep_what_is_no_format() {
    let folder = folder();
    for (name, picture) in
        [("run.1000", "run.1000.png"), ("b.extxyz", "b.png"), ("c.d.xyz", "c.d.png")]
    {
        fs::write(folder.path().join(name), XYZ).unwrap();
        said(folder.path(), &["render", name, "--device", "cpu"]);
        assert!(folder.path().join(picture).is_file(), "{picture}");
    }
}

/// Colours may be words of CSS; a map without an order of its own tells words apart.
#[test]
fn words_are_colours() {
    let folder = folder();
    let text = "x,y,z,color,name\n0,0,0,#ff0000,A\n2,0,0,lime,B\n,,,,\n";
    fs::write(folder.path().join("c.csv"), text).unwrap();
    let words = said(folder.path(), &["convert", "c.csv", "c.xyz"]);
    assert!(words.contains("2 particles") && words.contains("colours: column `color`"), "{words}");
    let text = fs::read_to_string(folder.path().join("c.xyz")).unwrap();
    assert!(text.contains(" 1 0 0 ") && text.contains(" 0 1 0 "), "{text}");
    let args = ["convert", "c.csv", "c.xyz", "--color-by", "name", "--range", "0,1"];
    refused(folder.path(), &args, &["holds words"]);
}

#[test]
fn content_decides_before_the_name() {
    let folder = folder();
    fs::rename(folder.path().join("run.xyz"), folder.path().join("run.pdb")).unwrap();
    let words = said(folder.path(), &["info", "run.pdb"]);
    assert!(words.is_empty(), "{words}");
    let output = run(folder.path(), &["info", "run.pdb"]);
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(text.contains("its name says PDB, and its content XYZ"), "{text}");
    refused(folder.path(), &["info", "run.pdb", "--format", "gro"], &["run.pdb:"]);
    fs::write(folder.path().join("x.bin"), [1, 0, 2, 0]).unwrap();
    refused(folder.path(), &["render", "x.bin"], &["--format", "xyz"]);
}

#[test]
fn standard_input_is_a_file_of_any_format() {
    let folder = folder();
    let from_file = picture(folder.path(), &["run.xyz"]);
    let mut child = Command::new(env!("CARGO_BIN_EXE_planisphere"))
        .args(["render", "-", "-o", "in.png", "--size", "120x120", "--device", "cpu"])
        .args(["--look", "flat", "--no-metadata"])
        .current_dir(folder.path())
        .stdin(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .expect("the program runs");
    child.stdin.take().unwrap().write_all(XYZ.as_bytes()).unwrap();
    assert!(child.wait().unwrap().success());
    assert_eq!(fs::read(folder.path().join("in.png")).unwrap(), from_file);
}

/// A file that a scene file names is drawn as it is alone.
#[test]
fn scene_files_name_files() {
    let folder = folder();
    let scene = |keys: &str| {
        // Particles alone are matte.
        let text = format!("[image]\nlook = 'matte'\n[[spheres]]\nfile = 'run.xyz'\n{keys}\n");
        fs::write(folder.path().join("s.toml"), text).unwrap();
        picture(folder.path(), &["s.toml"])
    };
    for (keys, args) in [
        ("", &[][..]),
        ("frame = -1\nradius = 0.5", &["--frame", "last", "--radius", "0.5"]),
        ("radius = 'covalent'\nradius_scale = 2", &["--radius", "covalent", "--radius-scale", "2"]),
        (
            "color_by = 'velo'\nmap = 'turbo'\nrange = [0, 2]",
            &["--color-by", "velo", "--map", "turbo", "--range", "0,2"],
        ),
        ("color = 'tomato'\nformat = 'xyz'", &["--color", "tomato", "--format", "xyz"]),
    ] {
        let alone = picture(folder.path(), &[&["run.xyz"], args].concat());
        assert_eq!(scene(keys), alone, "{keys}");
    }
    for (keys, words) in [
        ("frame = 7", &["s.toml:2:8", "there is no frame 7"][..]),
        ("color_by = 'charge'\nmap = 'jet'", &["s.toml:4:7", "viridis"]),
        ("radii = 'r.npy'", &["both `radii` and `file`"]),
        ("map = 'turbo'", &["s.toml:3:7", "no `color_by`"]),
        ("topology = '-'", &["./-", "no such file"]),
        ("colour_by = 'q'", &["color_by"]),
    ] {
        let text = format!("[[spheres]]\nfile = 'run.xyz'\n{keys}\n");
        fs::write(folder.path().join("s.toml"), text).unwrap();
        refused(folder.path(), &["render", "s.toml"], words);
    }
    let text = "[[spheres]]\ncenters = 'c.npy'\nframe = 1\n";
    fs::write(folder.path().join("s.toml"), text).unwrap();
    refused(folder.path(), &["render", "s.toml"], &["there is no `file`"]);
}

#[test]
fn a_camera_that_is_typed_is_that_of_a_scene_file() {
    let folder = folder();
    let scene = |camera: &str| {
        // Particles alone are matte.
        let image = "[image]\nlook = 'matte'\n";
        let text = format!("[camera]\n{camera}\n{image}[[spheres]]\nfile = 'run.xyz'\n");
        fs::write(folder.path().join("c.toml"), text).unwrap();
        picture(folder.path(), &["c.toml"])
    };
    for (camera, args) in [
        ("view = [1, 0, 0]", &["--view", "x"][..]),
        ("view = [0, 0, -1]\nup = [0, 1, 0]", &["--view", "-z"]),
        ("view = [-1, -1, -1]", &["--view", "iso"]),
        ("view = [0, 1, 0.5]\nup = [1, 0, 0]", &["--view", "0,1,0.5", "--up", "x"]),
        ("projection = 'perspective'", &["--perspective"]),
        ("near = 3", &["--near", "3"]),
        ("far = 2.5", &["--far", "2.5"]),
    ] {
        let typed = picture(folder.path(), &[&["run.xyz"], args].concat());
        assert_eq!(scene(camera), typed, "{camera}");
    }
    // Of a scene file, too: what is typed decides, and `[camera]` of another file can be taken.
    let framed = scene("view = [1, 0, 0]\nwidth = 3\norigin = [-10, 0, 0]");
    assert_eq!(picture(folder.path(), &["run.xyz", "--camera", "c.toml"]), framed);
    let looked = picture(folder.path(), &["c.toml", "--view", "y"]);
    assert_eq!(picture(folder.path(), &["run.xyz", "--view", "y"]), looked);
    let near = picture(folder.path(), &["c.toml", "--zoom", "2"]);
    assert_eq!(scene("view = [1, 0, 0]\nwidth = 1.5\norigin = [-10, 0, 0]"), near);
    let white = picture(folder.path(), &["run.xyz", "--background", "white"]);
    assert_ne!(white, picture(folder.path(), &["run.xyz"]));
    refused(folder.path(), &["render", "run.xyz", "--near", "3", "--far", "2"], &["near"]);
    refused(folder.path(), &["render", "run.xyz", "--view", "z", "--up", "z"], &["up"]);
    fs::write(folder.path().join("n.toml"), "[image]\nwidth = 3\n").unwrap();
    refused(folder.path(), &["render", "run.xyz", "--camera", "n.toml"], &["no [camera]"]);
}

#[test]
fn info_is_text_or_one_object() {
    let folder = folder();
    let output = run(folder.path(), &["info", "run.xyz", "--json"]);
    let text = String::from_utf8(output.stdout).expect("UTF-8");
    let found: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!(found["version"], 1);
    assert_eq!(found["format"], "XYZ");
    assert_eq!(found["frames"], serde_json::json!([2, 0]));
    assert_eq!(found["particles"], 4);
    assert_eq!(found["bounds"], serde_json::json!([[0.0, 0.0, 0.0], [1.0, 1.0, 2.0]]));
    assert_eq!(found["columns"][1]["range"], serde_json::json!([-0.8, 0.4]));
    assert_eq!(found["columns"][0]["words"], serde_json::json!([["O", "H", "Xx"], 3]));
    let output = run(folder.path(), &["info", "run.xyz", "--frame", "1"]);
    let text = String::from_utf8(output.stdout).expect("UTF-8");
    assert!(text.contains("frames     2; what follows is of frame 1"), "{text}");
    fs::write(folder.path().join("s.toml"), "[[spheres]]\nfile = 'run.xyz'\n").unwrap();
    let output = run(folder.path(), &["info", "s.toml"]);
    let text = String::from_utf8(output.stdout).expect("UTF-8");
    assert!(text.contains("scene file") && text.contains("particles  4"), "{text}");
}
