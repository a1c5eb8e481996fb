//! What pictures say of themselves, 16 bits a channel, and the camera of a picture.

use std::{
    fs,
    io::Cursor,
    path::Path,
    process::{Command, Output, Stdio},
};

use image::ImageReader;
use serde_json::Value;

use planisphere_image::{linear::LIN, linear16::Encoder16};

fn run(folder: &Path, args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_planisphere"));
    command.current_dir(folder).args(args).stdin(Stdio::null()).output().expect("the program runs")
}

fn succeed(folder: &Path, args: &[&str]) -> String {
    let output = run(folder, args);
    assert!(output.status.success(), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("it is text")
}

fn fail(folder: &Path, args: &[&str], words: &str) {
    let output = run(folder, args);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.code() == Some(2) && said.contains(words), "{args:?}: {said}");
}

const SPHERES: &str = "[[sphere]]\ncenter = [0, 0, 0]\nradius = 2\ncolor = \"#ff8000\"\n\
    [[sphere]]\ncenter = [1, 2, 2]\nradius = 1.5\ncolor = \"#0103ff\"\n";

/// Numbers that are no short decimals.
const CAMERA: &str = "[camera]\nprojection = \"perspective\"\n\
    origin = [-9.123456789012344, 0.1, 5e-324]\nview = [1, 0.30000000000000004, 0]\n\
    up = [0.1, 0, 3]\nfov = 33.3\nnear = 0.7\nfar = 1e3\n";

/// A folder with a scene, and one of the same spheres without a camera.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let image = "[image]\nwidth = 45\nheight = 37\nbackground = \"#102030\"\n";
    fs::write(folder.path().join("s.toml"), format!("{CAMERA}{image}{SPHERES}")).unwrap();
    fs::write(folder.path().join("bare.toml"), format!("{image}{SPHERES}")).unwrap();
    folder
}

fn info(folder: &Path, name: &str) -> Value {
    serde_json::from_str(&succeed(folder, &["info", "--json", name])).expect("it is JSON")
}

/// Names of a PNG's chunks, and their data.
fn chunks(mut file: &[u8]) -> Vec<(String, Vec<u8>)> {
    let mut all = Vec::new();
    file = &file[8..];
    while let Some((length, rest)) = file.split_first_chunk::<4>() {
        let length = u32::from_be_bytes(*length) as usize;
        all.push((String::from_utf8_lossy(&rest[..4]).into(), rest[4..4 + length].to_vec()));
        file = &rest[length + 8..];
    }
    all
}

fn names(file: &[u8]) -> Vec<String> {
    let mut names: Vec<String> = chunks(file).into_iter().map(|(name, _)| name).collect();
    names.dedup();
    names
}

#[test]
fn a_picture_gives_its_camera_back() {
    let folder = folder();
    let at = folder.path();
    succeed(at, &["render", "s.toml", "-o", "a.png"]);
    for (option, from) in [("--camera", "a.png"), ("--camera-from", "a.png")] {
        succeed(at, &["render", "bare.toml", option, from, "-o", "b.png"]);
        // The texts as well: the camera is the same, bit for bit.
        assert_eq!(fs::read(at.join("a.png")).unwrap(), fs::read(at.join("b.png")).unwrap());
    }
    let found = info(at, "a.png");
    let camera = found["camera"].as_str().unwrap();
    for number in ["-9.123456789012344", "5e-324", "0.30000000000000004", "far = 1000.0"] {
        assert!(camera.contains(number), "{camera}");
    }
    // The table is one of a scene file.
    fs::write(at.join("c.toml"), camera).unwrap();
    succeed(at, &["render", "bare.toml", "--camera", "c.toml", "-o", "c.png"]);
    assert_eq!(fs::read(at.join("a.png")).unwrap(), fs::read(at.join("c.png")).unwrap());
    // A camera that was chosen is told, too.
    succeed(at, &["render", "bare.toml", "-o", "d.png", "--view", "-x", "--zoom", "1.7"]);
    succeed(at, &["render", "s.toml", "-o", "e.png", "--camera", "d.png"]);
    assert_eq!(fs::read(at.join("d.png")).unwrap(), fs::read(at.join("e.png")).unwrap());

    succeed(at, &["render", "s.toml", "-o", "bare.png", "--no-metadata"]);
    fail(at, &["render", "s.toml", "--camera", "bare.png"], "does not say from where");
    fs::write(at.join("cut.png"), &fs::read(at.join("a.png")).unwrap()[..99]).unwrap();
    fail(at, &["render", "s.toml", "--camera", "cut.png"], "cut.png: is a PNG that is cut short");
    fail(at, &["info", "cut.png"], "cut short");
    fail(at, &["info", "a.png", "--frame", "1"], "is a picture");
}

#[test]
fn texts_are_those_of_the_picture_alone() {
    let folder = folder();
    let at = folder.path();
    let look = ["--look", "matte", "--aa", "2", "--depth-cue", "--outline", "1.25"];
    let render = |name: &str, more: &[&str]| {
        succeed(at, &[&["render", "s.toml", "-o", name][..], more].concat());
        fs::read(at.join(name)).unwrap()
    };
    fs::create_dir(at.join("folder")).unwrap();
    let shaded = render("a.png", &look);
    assert!(shaded == render("folder/other.png", &look));
    let version = concat!("planisphere ", env!("CARGO_PKG_VERSION"));
    let found = info(at, "a.png");
    assert_eq!(found["texts"][0], serde_json::json!(["Software", version]));
    assert_eq!(found["texts"][1][0], "planisphere:camera");
    assert_eq!(
        found["texts"][2],
        serde_json::json!([
            "planisphere:options",
            "--size 45x37 --background '#102030' --look matte --aa 2 --outline 1.25 --depth-cue"
        ])
    );
    let said = succeed(at, &["info", "a.png"]);
    for words in ["size       45 x 37\n", "bits       8\n", "Software: planisphere", "[camera]\n"] {
        assert!(said.contains(words), "{said}");
    }

    // All kinds of PNG: texts, and what sRGB is, before the pixels; without, the same pixels.
    for more in [&look[..], &[], &["--palette"], &["--depth16"]] {
        let (with, without) = (
            render("with.png", more),
            render("without.png", &[more, &["--no-metadata", "--dpi", "300"]].concat()),
        );
        let before = |file: &[u8]| -> Vec<String> {
            let skipped = ["IHDR", "PLTE", "IDAT", "IEND", "gAMA", "cHRM"];
            names(file).into_iter().filter(|name| !skipped.contains(&name.as_str())).collect()
        };
        assert_eq!(before(&with), ["sRGB", "tEXt"], "{more:?}");
        let mut others = before(&without);
        others.sort();
        assert_eq!(others, ["pHYs", "sRGB"], "{more:?}");
        let dots = chunks(&without).into_iter().find(|(name, _)| name == "pHYs").unwrap().1;
        assert_eq!(dots, [&11_811u32.to_be_bytes()[..], &11_811u32.to_be_bytes(), &[1]].concat());
        let pixels = |file: &[u8]| image::load_from_memory(file).unwrap().to_rgba16();
        assert!(pixels(&with) == pixels(&without), "{more:?}");
        assert_eq!(info(at, "without.png")["dpi"], serde_json::json!([300.0, 300.0]));
    }
    // A part says which; what is merged is what was drawn at once.
    render("p.png", &["--region", "3,4,20,9", "--visibility", "p.npz"]);
    succeed(at, &["merge", "p.npz", "-o", "m.png", "--region", "3,4,20,9"]);
    assert_eq!(fs::read(at.join("p.png")).unwrap(), fs::read(at.join("m.png")).unwrap());
    let options = info(at, "m.png")["texts"][2][1].as_str().unwrap().to_owned();
    assert!(options.contains("--region 3,4,20,9"), "{options}");
}

#[test]
fn options_of_particles_are_told_without_folders() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    fs::write(at.join("a.xyz"), "2\n\nC 0 0 0\nO 0 0 2\n").unwrap();
    let args = ["--frame", "last", "--radius", "covalent", "--color", "tomato"];
    succeed(at, &[&["render", "a.xyz", "--size", "20x20"][..], &args].concat());
    let options = info(at, "a.png")["texts"][2][1].as_str().unwrap().to_owned();
    assert_eq!(
        options,
        "--size 20x20 --look matte --frame last --radius covalent --color '#ff6347'"
    );
}

/// Flat colours are what the tables say; means have 16 bits, and agree with those of 8.
#[test]
fn sixteen_bits_are_finer_than_eight() {
    let folder = folder();
    let at = folder.path();
    let pixels = |name: &str| {
        let file = fs::read(at.join(name)).unwrap();
        ImageReader::new(Cursor::new(file)).with_guessed_format().unwrap().decode().unwrap()
    };
    let render = |args: &[&str]| succeed(at, &[&["render", "s.toml"][..], args].concat());
    render(&["-o", "flat.png", "--depth16"]);
    render(&["-o", "flat8.png"]);
    assert_eq!(info(at, "flat.png")["bits"], 16);
    let [deep, plain] = ["flat.png", "flat8.png"].map(&pixels);
    for (deep, plain) in deep.to_rgb16().pixels().zip(plain.to_rgb8().pixels()) {
        let want = plain.0.map(|c| Encoder16::get().value(LIN[usize::from(c)].into()));
        assert_eq!(deep.0, want);
    }
    let look = ["--look", "matte", "--aa", "4", "--background", "transparent"];
    render(&[&["-o", "deep.png", "--depth16"][..], &look].concat());
    render(&[&["-o", "plain.png"][..], &look].concat());
    let [deep, plain] = ["deep.png", "plain.png"].map(&pixels);
    let (deep, plain) = (deep.to_rgba16(), plain.to_rgba8());
    let mut fine = 0;
    for (deep, plain) in deep.pixels().zip(plain.pixels()) {
        for (&deep, &plain) in deep.0.iter().zip(&plain.0) {
            // Both are the nearest, nearly: half a step of each, by the rule of their edges.
            assert!((f64::from(deep) / 257.0 - f64::from(plain)).abs() <= 0.51, "{deep} {plain}");
            fine += usize::from(deep % 257 != 0);
        }
    }
    assert!(fine > 1000, "{fine}");
}
