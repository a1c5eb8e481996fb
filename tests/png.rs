//! The PNG files of the program: RGB unless a palette is asked for, with the same pixels either
//! way.

use std::{
    fmt::Write,
    fs,
    path::Path,
    process::{Command, Output, Stdio},
};

use image::DynamicImage;
use tempfile::TempDir;

fn run(folder: &Path, args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_planisphere"));
    command.current_dir(folder).args(args).stdin(Stdio::null()).output().expect("the program runs")
}

fn succeed(folder: &Path, args: &[&str]) -> Output {
    let output = run(folder, args);
    assert!(output.status.success(), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
    output
}

fn fail(folder: &Path, args: &[&str]) -> String {
    let output = run(folder, args);
    let words = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{args:?}: {words}");
    assert!(output.stdout.is_empty(), "{args:?} wrote to standard output");
    words
}

/// The colour of sphere `k`, all different.
fn color(k: usize) -> [u8; 3] {
    [(37 * k % 256) as u8, (k / 256) as u8, (255 - k % 256) as u8]
}

const BACKGROUND: [u8; 3] = [16, 32, 48];

/// A grid of spheres side by side, each of a colour of its own.
fn folder_with(spheres: usize) -> TempDir {
    let side = (spheres as f64).sqrt().ceil() as usize;
    let width = 2 * side;
    let mut scene = format!(
        "[camera]\nview = [1, 0, 0]\nwidth = {width}\n[image]\nwidth = {0}\nheight = {0}\n",
        16 * side
    );
    let _ = writeln!(scene, "background = \"#102030\"");
    for k in 0..spheres {
        let [y, z] = [k % side, k / side].map(|at| 2.0 * at as f64 + 1.0 - side as f64);
        let [red, green, blue] = color(k);
        let _ = writeln!(
            scene,
            "[[sphere]]\ncenter = [5, {y}, {z}]\nradius = 0.9\ncolor = \
             \"#{red:02x}{green:02x}{blue:02x}\""
        );
    }
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("scene.toml"), scene).expect("it can be written");
    folder
}

/// The bits of a channel or of an index, and the colour type (2 is RGB, 3 a palette), as the file
/// says.
fn header(bytes: &[u8]) -> (u8, u8) {
    assert_eq!(&bytes[..16], b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR");
    (bytes[24], bytes[25])
}

/// The pixels that must be there: the colours of the ids.
fn wanted(folder: &Path, ids: &str) -> Vec<u8> {
    let bytes = fs::read(folder.join(ids)).expect("ids");
    let start = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    let ids = bytes[start..].as_chunks::<4>().0.iter().map(|&id| i32::from_le_bytes(id));
    ids.flat_map(|id| usize::try_from(id).map_or(BACKGROUND, color)).collect()
}

/// A picture as the `image` crate has it, unchanged.
fn decoded(bytes: &[u8]) -> DynamicImage {
    image::load_from_memory(bytes).expect("a whole PNG")
}

fn read(folder: &Path, name: &str) -> Vec<u8> {
    fs::read(folder.join(name)).expect("a file")
}

#[test]
fn pictures_are_rgb_and_palettes_are_asked_for() {
    for (spheres, bits) in [(1, 1), (2, 2), (4, 4), (15, 4), (16, 8), (255, 8)] {
        let folder = folder_with(spheres);
        let folder = folder.path();
        succeed(folder, &["render", "scene.toml", "-o", "rgb.png", "--ids", "ids.npy"]);
        succeed(folder, &["render", "scene.toml", "-o", "palette.png", "--palette"]);
        let (rgb, palette) = (read(folder, "rgb.png"), read(folder, "palette.png"));
        assert_eq!((header(&rgb), header(&palette)), ((8, 2), (bits, 3)), "{spheres} spheres");
        let want = wanted(folder, "ids.npy");
        let DynamicImage::ImageRgb8(image) = decoded(&rgb) else {
            panic!("{:?}", decoded(&rgb).color())
        };
        assert!(*image.as_raw() == want, "{spheres} spheres");
        assert!(*decoded(&palette).into_rgb8().as_raw() == want, "{spheres} spheres");
        // The way to standard output is the same.
        for args in [
            &["render", "scene.toml", "-o", "-"][..],
            &["render", "scene.toml", "-o", "-", "--palette"],
        ] {
            let want = if args.len() == 4 { &rgb } else { &palette };
            assert!(succeed(folder, args).stdout == *want, "{args:?}");
        }
    }
}

#[test]
fn regions_and_merged_pictures_are_written_alike() {
    let folder = folder_with(12);
    let folder = folder.path();
    succeed(folder, &["render", "scene.toml", "-o", "whole.png", "--visibility", "whole.npz"]);
    succeed(folder, &["render", "scene.toml", "-o", "whole-palette.png", "--palette"]);
    for (file, region) in [("upper.npz", "0,0,64,20"), ("lower.npz", "0,20,64,44")] {
        succeed(
            folder,
            &["render", "scene.toml", "-o", "none", "--region", region, "--visibility", file],
        );
    }
    succeed(folder, &["merge", "upper.npz", "lower.npz", "-o", "merged.png"]);
    succeed(folder, &["merge", "upper.npz", "lower.npz", "-o", "merged-palette.png", "--palette"]);
    assert!(read(folder, "merged.png") == read(folder, "whole.png"));
    assert!(read(folder, "merged-palette.png") == read(folder, "whole-palette.png"));
    assert_eq!(header(&read(folder, "merged-palette.png")).1, 3);
    succeed(folder, &["render", "scene.toml", "-o", "part.png", "--region", "9,10,30,21"]);
    let part = decoded(&read(folder, "part.png"));
    assert!(
        part == decoded(&read(folder, "whole.png")).crop_imm(9, 10, 30, 21),
        "{:?}",
        part.color()
    );
}

#[test]
fn too_many_colours_for_a_palette_are_refused_with_the_fix() {
    let folder = folder_with(256);
    let folder = folder.path();
    fs::write(folder.join("out.png"), "what was there").expect("it can be written");
    let render = [
        "render",
        "scene.toml",
        "-o",
        "out.png",
        "--palette",
        "--ids",
        "ids.npy",
        "--visibility",
        "all.npz",
    ];
    let words = fail(folder, &render);
    assert!(
        words.contains("more than 256 colours") && words.contains("leave out --palette"),
        "{words}"
    );
    // Nothing is written, and nothing is left.
    let mut names: Vec<_> =
        fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    names.sort();
    assert_eq!(names, ["out.png", "scene.toml"]);
    assert_eq!(read(folder, "out.png"), b"what was there");
    assert!(fail(folder, &["render", "scene.toml", "-o", "-", "--palette"]).contains("256"));
    // The fix, obeyed.
    succeed(
        folder,
        &["render", "scene.toml", "-o", "out.png", "--ids", "ids.npy", "--visibility", "all.npz"],
    );
    assert!(*decoded(&read(folder, "out.png")).into_rgb8().as_raw() == wanted(folder, "ids.npy"));
    let words = fail(folder, &["merge", "all.npz", "-o", "merged.png", "--palette"]);
    assert!(
        words.contains("leave out --palette") && !folder.join("merged.png").exists(),
        "{words}"
    );
    // A part of the picture with fewer colours has a palette.
    succeed(
        folder,
        &["render", "scene.toml", "-o", "part.png", "--region", "0,0,64,64", "--palette"],
    );
    assert_eq!(header(&read(folder, "part.png")), (8, 3));
}

#[test]
fn a_palette_of_no_picture_is_refused() {
    let folder = folder_with(1);
    for args in [
        &["render", "scene.toml", "-o", "none", "--ids", "ids.npy", "--palette"][..],
        &["merge", "a.npz", "-o", "none", "--ids", "ids.npy", "--palette"],
    ] {
        let words = fail(folder.path(), args);
        assert!(words.contains("--palette") && words.contains("-o none"), "{words}");
    }
}

/// What golden tests elsewhere compare: the samples of the file, whatever they mean.
#[test]
fn pictures_that_differ_in_colour_differ_in_their_samples() {
    let folder = folder_with(1);
    let folder = folder.path();
    let scene = String::from_utf8(read(folder, "scene.toml")).expect("text");
    fs::write(folder.join("other.toml"), scene.replace("#0000ff", "#ff0000"))
        .expect("it can be written");
    succeed(folder, &["render", "scene.toml"]);
    succeed(folder, &["render", "other.toml"]);
    let (one, other) = (decoded(&read(folder, "scene.png")), decoded(&read(folder, "other.png")));
    assert_eq!((one.color(), one.width()), (other.color(), other.width()));
    assert!(one.as_bytes() != other.as_bytes());
}
