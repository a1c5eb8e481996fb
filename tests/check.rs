//! `planisphere check`, run as a person and as a CI system run it: folders of goldens that are
//! right, wrong, missing, or something else.

use std::{
    fs,
    io::Write,
    path::Path,
    process::{Command, Output, Stdio},
};

use serde_json::{Value, json};
use tempfile::TempDir;

/// Two spheres that overlap, 40 x 30 pixels.
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

const SIZE: [u32; 2] = [40, 30];

fn command(folder: &Path, args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_planisphere"));
    command.args(args).current_dir(folder).stdin(Stdio::null()).env_remove("NO_COLOR");
    command
}

/// What a run has said, and its exit code.
struct Said {
    code: Option<i32>,
    out: String,
    err: String,
}

impl Said {
    fn of(output: &Output) -> Self {
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        Self { code: output.status.code(), out: text(&output.stdout), err: text(&output.stderr) }
    }

    /// Ends the test unless the code and these words are there.
    #[track_caller]
    fn must(self, code: i32, words: &[&str]) -> Self {
        let both = format!("{}{}", self.out, self.err);
        assert_eq!(self.code, Some(code), "{both}");
        for word in words {
            assert!(both.contains(word), "lacks {word:?}: {both}");
        }
        self
    }
}

/// `planisphere check` on the CPU.
fn check(folder: &Path, args: &[&str]) -> Said {
    let all = [&["check", "--device", "cpu"], args].concat();
    Said::of(&command(folder, &all).output().expect("the program runs"))
}

/// A folder with `scene.toml`, and its picture and ids in `golden.png` and `ids.npy`.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("scene.toml"), SCENE).unwrap();
    draw(folder.path(), "scene.toml", "golden.png");
    folder
}

fn draw(folder: &Path, scene: &str, golden: &str) {
    // Goldens hold nothing but their pixels.
    let args = ["render", scene, "-o", golden, "--ids", "ids.npy", "--device", "cpu"];
    let args = [&args[..], &["--no-metadata"]].concat();
    let output = command(folder, &args).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<_> =
        entries.map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

fn rgba(path: &Path) -> image::RgbaImage {
    image::load_from_memory(&fs::read(path).unwrap()).expect("a whole PNG").into_rgba8()
}

/// Changes pixels of a golden, one after the other from a place; by so much in red.
fn change(path: &Path, from: [u32; 2], count: u32, by: u8) {
    let mut picture = rgba(path);
    for k in 0..count {
        picture.get_pixel_mut(from[0] + k, from[1]).0[0] ^= by;
    }
    picture.save(path).unwrap();
}

/// A PNG of some kind, by an encoder that is not ours.
fn encode(
    color: png::ColorType,
    depth: png::BitDepth,
    palette: &[[u8; 3]],
    data: &[u8],
) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, SIZE[0], SIZE[1]);
    encoder.set_color(color);
    encoder.set_depth(depth);
    if !palette.is_empty() {
        encoder.set_palette(palette.concat());
    }
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(data).unwrap();
    writer.finish().unwrap();
    bytes
}

/// An id as the bytes of some type.
type Bytes = fn(i32) -> Vec<u8>;

/// An `.npy` file of the ids of `ids.npy` in another type.
fn ids_as(folder: &Path, descr: &str, bytes: Bytes) -> Vec<u8> {
    let whole = fs::read(folder.join("ids.npy")).unwrap();
    let start = 10 + usize::from(u16::from_le_bytes([whole[8], whole[9]]));
    let ids = whole[start..].as_chunks::<4>().0.iter().map(|&b| i32::from_le_bytes(b));
    npy(descr, "(30, 40)", &ids.flat_map(bytes).collect::<Vec<u8>>())
}

fn npy(descr: &str, shape: &str, numbers: &[u8]) -> Vec<u8> {
    let header = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}\n");
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.bytes());
    bytes.extend(numbers);
    bytes
}

#[test]
fn colours_are_compared_not_bytes() {
    let folder = folder();
    let at = folder.path();
    let one = ["scene.toml", "--golden", "golden.png"];
    let said = check(at, &one).must(0, &["ok scene\n", "1 scene: 1 ok, 0 failed"]);
    assert!(said.err.is_empty(), "{}", said.err);

    let picture = rgba(&at.join("golden.png"));
    let palette: Vec<[u8; 3]> = vec![[0, 255, 0], [9, 9, 9], [255, 0, 0], [0x10, 0x20, 0x30]];
    let colour = |pixel: &image::Rgba<u8>| [pixel[0], pixel[1], pixel[2]];
    let index = |pixel| palette.iter().position(|&entry| entry == colour(pixel)).unwrap() as u8;
    let indices: Vec<u8> = picture.pixels().map(index).collect();
    let packed = indices.as_chunks::<4>().0.iter();
    let packed: Vec<u8> = packed.map(|i| i[0] << 6 | i[1] << 4 | i[2] << 2 | i[3]).collect();
    use png::{BitDepth, ColorType};
    for (kind, bytes) in [
        ("palette", encode(ColorType::Indexed, BitDepth::Eight, &palette, &indices)),
        ("palette of 2 bits", encode(ColorType::Indexed, BitDepth::Two, &palette, &packed)),
        ("RGBA", encode(ColorType::Rgba, BitDepth::Eight, &[], picture.as_raw())),
    ] {
        assert_ne!(bytes, fs::read(at.join("golden.png")).unwrap());
        fs::write(at.join("golden.png"), bytes).unwrap();
        check(at, &one).must(0, &["ok scene\n"]);
        assert_eq!(names(at), ["golden.png", "ids.npy", "scene.toml"], "{kind}");
    }
    // Alpha is compared as well.
    let mut clear = picture;
    clear.get_pixel_mut(3, 2).0[3] = 254;
    clear.save(at.join("golden.png")).unwrap();
    let words = ["1 of 1,200 pixels differs, by 1 at most", "#102030fe expected, #102030 drawn"];
    check(at, &one).must(1, &words);
}

#[test]
fn a_pixel_that_differs_is_told_and_nothing_is_written() {
    let folder = folder();
    let at = folder.path();
    change(&at.join("golden.png"), [3, 0], 1, 0x40);
    let golden = fs::read(at.join("golden.png")).unwrap();
    let one = ["scene.toml", "--golden", "golden.png"];
    let said = check(at, &one).must(
        1,
        &[
            "FAILED scene: 1 of 1,200 pixels differs, by 64 at most\n",
            "  pixel (3, 0): #502030 expected, #102030 drawn, no sphere\n",
            "1 scene: 0 ok, 1 failed",
            "--out DIR writes",
            "--bless accepts",
        ],
    );
    assert!(said.err.is_empty() && !said.out.contains("more"), "{}", said.out);
    assert_eq!(fs::read(at.join("golden.png")).unwrap(), golden);
    assert_eq!(names(at), ["golden.png", "ids.npy", "scene.toml"]);

    // Many: the first ten, from the left, at the sphere that is seen there.
    draw(at, "scene.toml", "golden.png");
    change(&at.join("golden.png"), [5, 15], 12, 0x01);
    let said = check(at, &one).must(1, &["12 of 1,200 pixels differ, by 1 at most"]);
    let told: Vec<&str> = said.out.lines().filter(|line| line.starts_with("  pixel")).collect();
    assert_eq!(told.len(), 10);
    for (k, line) in told.iter().enumerate() {
        assert!(line.contains(&format!("pixel ({}, 15): ", 5 + k)), "{line}");
        assert!(line.ends_with("#fe0000 expected, #ff0000 drawn, sphere 0"), "{line}");
    }
    assert!(said.out.contains("  and 2 more\n"), "{}", said.out);
}

#[test]
fn what_differs_is_written_where_it_is_asked_for() {
    let folder = folder();
    let at = folder.path();
    let drawn = rgba(&at.join("golden.png"));
    change(&at.join("golden.png"), [20, 15], 3, 0x80);
    let golden = fs::read(at.join("golden.png")).unwrap();
    let args = ["scene.toml", "--golden", "golden.png", "--out", "new/out"];
    let said = check(at, &args).must(1, &["written: new/out/scene.actual.png", "scene.diff.png"]);
    assert!(!said.out.contains("--bless"), "{}", said.out);
    assert_eq!(names(&at.join("new/out")), ["scene.actual.png", "scene.diff.png"]);
    assert_eq!(rgba(&at.join("new/out/scene.actual.png")), drawn);
    let (wanted, diff) = (rgba(&at.join("golden.png")), rgba(&at.join("new/out/scene.diff.png")));
    assert_eq!(diff.dimensions(), drawn.dimensions());
    for (x, y, pixel) in diff.enumerate_pixels() {
        if wanted.get_pixel(x, y) == drawn.get_pixel(x, y) {
            let [r, g, b, alpha] = pixel.0;
            assert!(r == g && g == b && r >= 191 && alpha == 255, "({x}, {y}): {pixel:?}");
        } else {
            assert_eq!(pixel.0, [255, 0, 0, 255], "({x}, {y})");
        }
    }
    assert_eq!(diff.pixels().filter(|pixel| pixel.0 == [255, 0, 0, 255]).count(), 3);
    assert_eq!(fs::read(at.join("golden.png")).unwrap(), golden);
    // What passes writes nothing, and makes no folder.
    draw(at, "scene.toml", "golden.png");
    check(at, &["scene.toml", "--golden", "golden.png", "--out", "none"]).must(0, &[]);
    assert!(!at.join("none").exists());
    // A file that is in the way is left as it is.
    change(&at.join("golden.png"), [0, 0], 1, 1);
    fs::write(at.join("file"), "mine").unwrap();
    check(at, &["scene.toml", "--golden", "golden.png", "--out", "file"])
        .must(2, &["--out file: it is a file; name a folder"]);
    fs::rename(at.join("golden.png"), at.join("scene.actual.png")).unwrap();
    let golden = fs::read(at.join("scene.actual.png")).unwrap();
    check(at, &["scene.toml", "--golden", "scene.actual.png", "--out", "."])
        .must(2, &["would replace", "an input of this command"]);
    assert_eq!(fs::read(at.join("scene.actual.png")).unwrap(), golden);
}

#[test]
fn a_golden_is_written_only_when_it_is_asked_for() {
    let folder = folder();
    let at = folder.path();
    let picture = rgba(&at.join("golden.png"));
    fs::create_dir(at.join("goldens")).unwrap();
    let goldens = ["scene.toml", "--goldens", "goldens"];
    check(at, &goldens).must(
        1,
        &[
            "FAILED scene: there is no golden goldens/scene.png; --bless writes it",
            "0 ok, 1 failed",
        ],
    );
    assert!(names(&at.join("goldens")).is_empty());

    let bless = [&goldens[..], &["--bless"]].concat();
    check(at, &bless)
        .must(0, &["written scene: goldens/scene.png", "1 scene: 1 written, 0 unchanged"]);
    assert_eq!(rgba(&at.join("goldens/scene.png")), picture);
    check(at, &goldens).must(0, &["ok scene"]);

    // One that is right stays as it is, though its bytes are others.
    picture.save(at.join("goldens/scene.png")).unwrap();
    let (bytes, changed) = (
        fs::read(at.join("goldens/scene.png")).unwrap(),
        fs::metadata(at.join("goldens/scene.png")).unwrap().modified().unwrap(),
    );
    check(at, &bless).must(0, &["unchanged scene\n", "1 scene: 0 written, 1 unchanged"]);
    assert_eq!(fs::read(at.join("goldens/scene.png")).unwrap(), bytes);
    let now = fs::metadata(at.join("goldens/scene.png")).unwrap().modified().unwrap();
    assert_eq!(now, changed);

    change(&at.join("goldens/scene.png"), [1, 1], 1, 1);
    check(at, &goldens).must(1, &["1 of 1,200"]);
    check(at, &bless).must(0, &["written scene"]);
    assert_eq!(rgba(&at.join("goldens/scene.png")), picture);
    assert_eq!(names(&at.join("goldens")), ["scene.png"]);

    // A folder that is not there is made, but only to write into it.
    let other = ["scene.toml", "--goldens", "new/goldens"];
    check(at, &other).must(2, &["--goldens new/goldens: there is no such folder", "--bless"]);
    assert!(!at.join("new").exists());
    check(at, &[&other[..], &["--bless"]].concat()).must(0, &["written scene"]);
    check(at, &other).must(0, &["ok scene"]);
    // A name that stands for another format is not written.
    check(at, &["scene.toml", "--golden", "scene.jpg", "--bless"])
        .must(2, &["--golden scene.jpg: a picture is written as .png"]);
    check(at, &["scene.toml", "--golden", "x.png", "--bless", "--max-delta", "3"])
        .must(2, &["cannot be used with"]);
}

#[test]
fn other_sizes_are_told_with_the_way_to_the_golden() {
    let folder = folder();
    let at = folder.path();
    let args = ["scene.toml", "--golden", "golden.png", "--size", "80x60", "--out", "out"];
    let said = check(at, &args).must(
        1,
        &["golden.png has 40 x 30 pixels, and 80 x 60 are drawn; --size 40x30 draws the golden's"],
    );
    assert!(!said.out.contains("pixel ("), "{}", said.out);
    assert_eq!(names(&at.join("out")), ["scene.actual.png"]);
    check(at, &["scene.toml", "--golden", "golden.png", "--size", "40x30"]).must(0, &["ok"]);
    // A part of a picture, too; its pixels count from its own corner.
    let region = ["render", "scene.toml", "--region", "10,5,20,10", "-o", "part.png"];
    assert!(command(at, &region).output().unwrap().status.success());
    let part = ["scene.toml", "--golden", "part.png", "--region", "10,5,20,10"];
    check(at, &part).must(0, &["ok"]);
    change(&at.join("part.png"), [19, 9], 1, 1);
    check(at, &part).must(1, &["1 of 200 pixels", "pixel (19, 9)"]);
}

/// Files that stand where a golden should be, and what is said of each.
fn no_goldens(png: &[u8]) -> Vec<(&'static str, Vec<u8>, &'static str)> {
    let pointer = b"version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 123\n";
    let unix: Vec<u8> = png.iter().copied().filter(|&byte| byte != b'\r').collect();
    let wide = encode(png::ColorType::Rgb, png::BitDepth::Sixteen, &[], &[0; 7200]);
    vec![
        ("lfs", pointer.to_vec(), "is a Git LFS pointer, not the picture itself; fetch that with"),
        ("empty", Vec::new(), "is empty"),
        ("jpeg", b"\xff\xd8\xff\xe0\x00\x10JFIF\x00".to_vec(), "is a JPEG, not a PNG"),
        ("gif", b"GIF89a\x01\x00".to_vec(), "is a GIF, not a PNG"),
        ("html", b"<!DOCTYPE html>\n<html>".to_vec(), "is a web page (HTML), not a PNG"),
        ("text", b"404: Not Found".to_vec(), "is not a PNG: it begins with \"404: Not\""),
        ("cut", png[..png.len() - 20].to_vec(), "is a PNG that is cut short"),
        ("unix", unix, "is a PNG whose line ends were changed"),
        ("wide", wide, "has 16 bits a channel"),
    ]
}

#[test]
fn what_is_no_golden_is_named_for_what_it_is() {
    let folder = folder();
    let at = folder.path();
    let png = fs::read(at.join("golden.png")).unwrap();
    for (name, bytes, words) in no_goldens(&png) {
        let golden = format!("{name}.png");
        fs::write(at.join(&golden), &bytes).unwrap();
        let args = ["scene.toml", "--golden", &golden, "--out", "out"];
        let words = format!("error: {golden} {words}");
        let lines = ["ERROR scene: nothing was compared", &words, "1 not compared"];
        check(at, &args).must(2, &lines);
        assert_eq!(fs::read(at.join(&golden)).unwrap(), bytes, "{name}");
        assert!(!at.join("out").exists());

        // What may be a golden of ours is replaced; what is somebody's is not.
        let blessed = check(at, &["scene.toml", "--golden", &golden, "--bless"]);
        if ["jpeg", "gif", "html", "text"].contains(&name) {
            blessed.must(2, &["--bless replaces goldens only: remove it first"]);
            assert_eq!(fs::read(at.join(&golden)).unwrap(), bytes, "{name}");
        } else {
            blessed.must(0, &["written scene"]);
            assert_eq!(fs::read(at.join(&golden)).unwrap(), png, "{name}");
        }
    }
    fs::create_dir(at.join("folder.png")).unwrap();
    check(at, &["scene.toml", "--golden", "folder.png"]).must(2, &["folder.png: is a folder"]);
    check(at, &["scene.toml", "--golden", "folder.png", "--bless"]).must(4, &["it is a folder"]);
    check(at, &["scene.toml", "--golden", "/dev/zero"]).must(2, &["is a device"]);
    check(at, &["scene.toml", "--golden", "-"]).must(2, &["a golden is a file"]);
}

#[test]
fn ids_are_compared_by_value() {
    let folder = folder();
    let at = folder.path();
    let one = ["scene.toml", "--ids", "wanted.npy"];
    let kinds: [(&str, Bytes); 4] = [
        ("<i4", |id| id.to_le_bytes().into()),
        ("<i8", |id| i64::from(id).to_le_bytes().into()),
        (">i8", |id| i64::from(id).to_be_bytes().into()),
        ("|i1", |id| vec![id as u8]),
    ];
    for (descr, bytes) in kinds {
        fs::write(at.join("wanted.npy"), ids_as(at, descr, bytes)).unwrap();
        check(at, &one).must(0, &["ok scene\n"]);
    }
    // Every id one more: -1 is 0, and nothing is right.
    let more: Bytes = |id| i64::from(id + 1).to_le_bytes().into();
    fs::write(at.join("wanted.npy"), ids_as(at, "<i8", more)).unwrap();
    let both = ["scene.toml", "--golden", "golden.png", "--ids", "wanted.npy", "--out", "out"];
    check(at, &both).must(
        1,
        &[
            "FAILED scene: 1,200 of 1,200 ids differ from wanted.npy\n",
            "  pixel (0, 0): sphere 0 expected, no sphere drawn\n",
            "  and 1,190 more\n",
            "written: out/scene.actual.npy",
        ],
    );
    assert_eq!(names(&at.join("out")), ["scene.actual.npy"]);
    let drawn = fs::read(at.join("ids.npy")).unwrap();
    assert_eq!(fs::read(at.join("out/scene.actual.npy")).unwrap(), drawn);

    for (bytes, code, words) in [
        (npy("<i4", "(40, 30)", &[0; 4800]), 1, "has the shape (40, 30), and (30, 40) is drawn"),
        (npy("<f4", "(30, 40)", &[0; 4800]), 2, "holds float32, not integers"),
        (npy("<i4", "(1200,)", &[0; 4800]), 2, "has the shape (1200,)"),
        (b"PK\x03\x04".to_vec(), 2, "zip archive"),
        (b"version https://git-lfs.github.com/spec/v1\n".to_vec(), 2, "Git LFS pointer"),
    ] {
        fs::write(at.join("wanted.npy"), &bytes).unwrap();
        check(at, &one).must(code, &[words]);
        assert_eq!(fs::read(at.join("wanted.npy")).unwrap(), bytes);
    }
    check(at, &["scene.toml", "--ids", "wanted.npy", "--bless"]).must(0, &["written scene"]);
    assert_eq!(fs::read(at.join("wanted.npy")).unwrap(), drawn);
    check(at, &["scene.toml", "--ids", "absent.npy"]).must(1, &["there is no golden absent.npy"]);
}

/// Three scenes: one that passes, one that fails, one that cannot be read.
fn several() -> TempDir {
    let folder = folder();
    let at = folder.path();
    for name in ["scenes", "goldens"] {
        fs::create_dir(at.join(name)).unwrap();
    }
    fs::rename(at.join("scene.toml"), at.join("scenes/good.toml")).unwrap();
    let other = SCENE.replace("#00ff00", "#00fe00");
    fs::write(at.join("scenes/differs.toml"), other).unwrap();
    fs::write(at.join("scenes/broken.toml"), SCENE.replace("radius = 2", "radius = -2")).unwrap();
    for name in ["good", "differs", "broken", "gone"] {
        fs::copy(at.join("golden.png"), at.join(format!("goldens/{name}.png"))).unwrap();
    }
    folder
}

const ALL: [&str; 5] =
    ["scenes/broken.toml", "scenes/differs.toml", "scenes/good.toml", "--goldens", "goldens"];

#[test]
fn several_scenes_are_checked_whatever_becomes_of_one() {
    let folder = several();
    let at = folder.path();
    let said = check(at, &ALL).must(
        2,
        &[
            "ERROR broken: nothing was compared\n",
            "scenes/broken.toml:11:10",
            "FAILED differs: ",
            "#00ff00 expected, #00fe00 drawn, sphere 1",
            "ok good\n",
            "3 scenes: 1 ok, 1 failed, 1 not compared\n",
        ],
    );
    assert!(said.err.starts_with("error: ") && !said.out.contains("error: "), "{}", said.err);
    assert!(said.err.ends_with("\nnote: goldens of no scene of this run: gone.png\n"));
    check(at, &ALL[1..]).must(1, &["2 scenes: 1 ok, 1 failed\n"]);
    check(at, &ALL[2..]).must(0, &["1 scene: 1 ok, 0 failed\n"]);
    // What is written beside the goldens is none.
    let said = check(at, &[&ALL[1..], &["--out", "goldens"]].concat()).must(1, &[]);
    assert_eq!(said.err, "note: goldens of no scene of this run: broken.png, gone.png\n");
    let said = check(at, &ALL[1..]).must(1, &[]);
    assert_eq!(said.err, "note: goldens of no scene of this run: broken.png, gone.png\n");
    // An error keeps the others from nothing when goldens are written.
    check(at, &[&ALL[..], &["--bless"]].concat())
        .must(2, &["written differs", "unchanged good", "1 written, 1 unchanged, 1 not compared"]);
    check(at, &ALL[1..]).must(0, &["2 scenes: 2 ok"]);
}

#[test]
fn what_checks_nothing_is_refused() {
    let folder = several();
    let at = folder.path();
    for (args, words) in [
        (&["--goldens", "goldens"][..], "nothing is checked: no scene is named"),
        (&["scenes/good.toml"], "nothing is checked: add --golden FILE.png or --ids FILE.npy"),
        (&["a.toml", "b.toml", "--golden", "golden.png"], "--golden is for one scene, and 2"),
        (&["a.toml", "b.toml", "--goldens", "goldens", "--ids", "i.npy"], "--ids is for one scene"),
        (&["scenes/*.toml", "--goldens", "goldens"], "scenes/*.toml: no such file"),
        (&["-", "--goldens", "goldens"], "a scene from standard input has no name"),
        (&["a.toml", "--goldens", "golden.png"], "--goldens golden.png: it is a file"),
        (
            &["a/x.toml", "b/x.toml", "--goldens", "goldens"],
            "a/x.toml and b/x.toml would both have the golden goldens/x.png",
        ),
        (&["x.toml", "x.dump.gz", "--goldens", "goldens"], "x.toml and x.dump.gz would both"),
        (&["a.toml", "--golden", "golden.png", "--max-delta", "255"], "0..=254"),
        (&["a.toml", "--golden", "golden.png", "--junit", "r.json"], "name it r.xml"),
    ] {
        check(at, args).must(2, &[words]);
    }
}

#[test]
fn tolerances_are_off_and_are_said() {
    let folder = folder();
    let at = folder.path();
    let with =
        |more: &[&str]| check(at, &[&["scene.toml", "--golden", "golden.png"], more].concat());
    change(&at.join("golden.png"), [0, 0], 3, 1);
    change(&at.join("golden.png"), [0, 1], 2, 4);
    let said = with(&[]).must(1, &["5 of 1,200 pixels differ, by 4 at most"]);
    assert!(!said.out.contains("tolerated"), "{}", said.out);
    with(&["--max-different", "4"])
        .must(1, &["tolerated: 4 pixels of a scene may differ (--max-different)\n"]);
    let allowed = "5 of 1,200 pixels differ, by 4 at most, which is tolerated\n";
    with(&["--max-different", "5"]).must(0, &["ok scene: ", allowed, "tolerated: 5 pixels"]);
    with(&["--max-delta", "3"]).must(
        1,
        &[
            "2 of 1,200 pixels differ by more than 3, by 4 at most",
            "pixel (0, 1)",
            "tolerated: channels may be off by 3 (--max-delta)\n",
        ],
    );
    with(&["--max-delta", "4"]).must(0, &[allowed]);
    with(&["--max-delta", "3", "--max-different", "2"])
        .must(0, &[allowed, "channels may be off by 3 (--max-delta), and 2 pixels"]);
    // Where nothing differs, nothing is tolerated, but what would be is said.
    draw(at, "scene.toml", "golden.png");
    with(&["--max-delta", "4"]).must(0, &["ok scene\n", "tolerated: channels"]);
}

#[test]
fn json_is_for_programs() {
    let folder = several();
    let at = folder.path();
    let said = check(at, &[&ALL[..], &["--json", "--out", "out"]].concat()).must(2, &[]);
    assert!(said.err.contains("FAILED differs") && said.err.contains("3 scenes"), "{}", said.err);
    let found: Value = serde_json::from_str(&said.out).expect("JSON");
    for (key, wanted) in [
        ("version", json!(1)),
        ("passed", json!(1)),
        ("failed", json!(1)),
        ("errors", json!(1)),
        ("device", json!("cpu")),
        ("max_different", json!(0)),
        ("unused", json!(["gone.png"])),
    ] {
        assert_eq!(found[key], wanted, "{key}");
    }
    let scenes = found["scenes"].as_array().unwrap();
    assert_eq!(scenes.len(), 3);
    let [broken, differs, good] = [&scenes[0], &scenes[1], &scenes[2]];
    assert_eq!((&broken["state"], &broken["different"]), (&json!("error"), &Value::Null));
    assert!(broken["error"].as_str().unwrap().contains("scenes/broken.toml:11:10"), "{broken}");
    let wanted = json!({
        "scene": "scenes/good.toml", "golden": "goldens/good.png", "state": "passed",
        "different": 0, "pixels": 1200, "greatest": 0, "first": [], "written": [], "error": null,
    });
    assert_eq!(*good, wanted);
    assert_eq!((&differs["state"], &differs["greatest"]), (&json!("failed"), &json!(1)));
    let first = differs["first"].as_array().unwrap();
    assert_eq!(first.len(), 10);
    assert_eq!(first[0]["expected"], json!([0, 255, 0, 255]));
    assert_eq!(first[0]["actual"], json!([0, 254, 0, 255]));
    assert_eq!(first[0]["spheres"], json!([1]));
    let written = json!(["out/differs.actual.png", "out/differs.diff.png"]);
    assert_eq!(differs["written"], written);

    // Ids, and a pixel without a sphere.
    change(&at.join("golden.png"), [0, 0], 1, 1);
    let args = ["scenes/good.toml", "--golden", "golden.png", "--ids", "ids.npy", "--json"];
    let said = check(at, &args).must(1, &[]);
    let found: Value = serde_json::from_str(&said.out).expect("JSON");
    let scene = &found["scenes"][0];
    assert_eq!(scene["first"][0]["spheres"], json!([null]));
    let ids = json!({"golden": "ids.npy", "state": "passed", "different": 0, "first": []});
    assert_eq!(scene["ids"], ids);
    let said = check(at, &[&args[..], &["--bless"]].concat()).must(0, &[]);
    let found: Value = serde_json::from_str(&said.out).expect("JSON");
    assert_eq!((&found["passed"], &found["scenes"][0]["state"]), (&json!(1), &json!("blessed")));
    assert_eq!(found["scenes"][0]["ids"]["state"], json!("unchanged"));
}

/// The elements of an XML text, with their depths: its tags must be closed in order, and its
/// attributes and text escaped.
fn elements(xml: &str) -> Vec<(usize, String)> {
    let (_, mut rest) = xml.split_once("?>").expect("a declaration");
    let (mut open, mut found) = (Vec::<String>::new(), Vec::new());
    while let Some((text, tag)) = rest.split_once('<') {
        assert!(!text.contains('>'), "{text}");
        let (tag, behind) = tag.split_once('>').expect("a tag that ends");
        rest = behind;
        for part in text.split('&').skip(1).chain(tag.split('&').skip(1)) {
            let entity = part.split(';').next().unwrap();
            assert!(["amp", "lt", "gt", "quot", "#10", "#9"].contains(&entity), "{part}");
        }
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(open.pop().as_deref(), Some(name));
            continue;
        }
        assert!(tag.matches('"').count().is_multiple_of(2), "{tag}");
        found.push((open.len(), tag.to_owned()));
        if !tag.ends_with('/') {
            open.push(tag.split(' ').next().unwrap().to_owned());
        }
    }
    assert!(open.is_empty() && rest.trim().is_empty(), "{open:?}");
    found
}

#[test]
fn junit_is_well_formed_and_always_the_same() {
    let folder = several();
    let at = folder.path();
    fs::rename(at.join("scenes/good.toml"), at.join("scenes/a & b <c> \"d\".toml")).unwrap();
    let strange = "scenes/a & b <c> \"d\".toml";
    let args = [&[strange], &ALL[..2], &ALL[3..], &["--junit", "report.xml"]].concat();
    fs::rename(at.join("goldens/good.png"), at.join("goldens/a & b <c> \"d\".png")).unwrap();
    check(at, &args).must(2, &["3 scenes: 1 ok, 1 failed, 1 not compared"]);
    let xml = fs::read_to_string(at.join("report.xml")).unwrap();
    let found = elements(&xml);
    let of = |name: &str| -> Vec<&str> {
        let is = |tag: &&str| tag.split([' ', '/']).next() == Some(name);
        found.iter().map(|(_, tag)| tag.as_str()).filter(is).collect()
    };
    assert_eq!(of("testcase").len(), 3);
    assert!(of("testcase")[0].contains("name=\"a &amp; b &lt;c&gt; &quot;d&quot;\""), "{xml}");
    assert!(of("failure").len() == 1 && of("failure")[0].contains("pixels differ, by 1"), "{xml}");
    assert!(of("error").len() == 1 && of("error")[0].contains("message=\"error: "), "{xml}");
    let suite = of("testsuite");
    assert!(suite[0].contains("tests=\"3\" failures=\"1\" errors=\"1\""), "{xml}");
    assert!(!xml.contains("time"), "{xml}");
    check(at, &args).must(2, &[]);
    assert_eq!(fs::read_to_string(at.join("report.xml")).unwrap(), xml);
    // To standard output: then what is for people goes to standard error.
    let said = check(at, &[&args[..args.len() - 1], &["-"]].concat()).must(2, &["FAILED differs"]);
    assert_eq!(said.out, xml);
    let twice = [&args[..args.len() - 1], &["-", "--json"]].concat();
    check(at, &twice).must(2, &["both want standard output"]);
    check(at, &[&args[..args.len() - 1], &["goldens/differs.png"]].concat())
        .must(2, &["a report is written as .xml"]);
    check(at, &[&args[..args.len() - 1], &["no/report.xml"]].concat())
        .must(4, &["there is no folder no"]);
}

#[test]
fn standard_input_and_particles_are_checked() {
    let folder = folder();
    let at = folder.path();
    let args = ["check", "-", "--golden", "golden.png", "--device", "cpu"];
    let mut child = command(at, &args)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    child.stdin.take().unwrap().write_all(SCENE.as_bytes()).unwrap();
    Said::of(&child.wait_with_output().unwrap()).must(0, &["ok golden\n"]);

    fs::write(at.join("two.xyz"), "2\n\nH 0 0 0\nO 0 0 1\n").unwrap();
    let drawn = ["render", "two.xyz", "--radius", "covalent", "--size", "40x40", "--view", "x"];
    assert!(command(at, &drawn).output().unwrap().status.success());
    let options = |radius| ["two.xyz", "--radius", radius, "--size", "40x40", "--view", "x"];
    let golden = ["--golden", "two.png"];
    let said = check(at, &[&options("covalent")[..], &golden].concat()).must(0, &["ok two\n"]);
    assert!(said.err.contains("two.xyz: XYZ"), "{}", said.err);
    check(at, &[&options("vdw")[..], &golden].concat()).must(1, &["FAILED two"]);
    // Options of particles say nothing of a scene.
    check(at, &["scene.toml", "--golden", "golden.png", "--radius", "1"])
        .must(2, &["ERROR scene", "--radius is for files of particles"]);
    // An empty picture passes where it is the golden, and says that it is empty.
    fs::write(at.join("empty.toml"), "[camera]\nview = [1, 0, 0]\nwidth = 8\n").unwrap();
    check(at, &["empty.toml", "--golden", "empty.png", "--bless"]).must(0, &[]);
    check(at, &["empty.toml", "--golden", "empty.png"])
        .must(0, &["ok empty", "note: empty: nothing is seen"]);
}

#[cfg(target_os = "linux")]
#[test]
fn a_folder_that_nobody_may_write_is_enough_to_check_and_not_to_bless() {
    use std::os::unix::fs::PermissionsExt;
    let folder = several();
    let at = folder.path();
    let mode = |mode| fs::set_permissions(at.join("goldens"), PermissionsExt::from_mode(mode));
    // Root may write into any folder; another user may not.
    let run = |args: &[&str]| {
        let mut all = vec!["--reuid=65534", "--regid=65534", "--clear-groups"];
        all.extend([env!("CARGO_BIN_EXE_planisphere"), "check", "--device", "cpu"]);
        all.extend(args);
        let root = rustix::process::geteuid().is_root();
        let mut command = Command::new(if root { "setpriv" } else { all[3] });
        command.args(&all[if root { 0 } else { 4 }..]).current_dir(at).stdin(Stdio::null());
        Said::of(&command.output().unwrap())
    };
    fs::set_permissions(at, PermissionsExt::from_mode(0o755)).unwrap();
    mode(0o555).unwrap();
    run(&ALL[1..]).must(1, &["2 scenes: 1 ok, 1 failed"]);
    fs::remove_file(at.join("goldens/good.png")).unwrap();
    let said = run(&[&ALL[2..], &["--bless"]].concat());
    mode(0o755).unwrap();
    said.must(4, &["cannot write goldens/good.png: you may not make files in the folder goldens"]);
    assert!(!at.join("goldens/good.png").exists());
    // A golden that is read-only is kept.
    let differs = at.join("goldens/differs.png");
    fs::set_permissions(&differs, PermissionsExt::from_mode(0o444)).unwrap();
    check(at, &["scenes/differs.toml", "--goldens", "goldens", "--bless"]).must(4, &["read-only"]);
    check(at, &["scenes/differs.toml", "--goldens", "goldens"]).must(1, &["FAILED differs"]);
}

#[test]
fn one_run_says_the_same_on_a_gpu() {
    let folder = several();
    let at = folder.path();
    let run = |device: &str| {
        let args = [&["check", "--json", "--device", device], &ALL[1..]].concat();
        let said = Said::of(&command(at, &args).output().unwrap()).must(1, &[]);
        let mut found: Value = serde_json::from_str(&said.out).unwrap();
        found["device"] = Value::Null;
        found
    };
    assert_eq!(run("cpu"), run("gpu"));
}

/// What is in the blocks of a page that are marked with a word, line by line.
#[cfg(unix)]
fn blocks<'a>(page: &'a str, mark: &str) -> Vec<&'a str> {
    let (mut inside, mut found) = (false, Vec::new());
    for line in page.lines() {
        match line.strip_prefix("```") {
            Some(kind) => inside = kind == mark,
            None if inside => found.push(line),
            None => {}
        }
    }
    found
}

/// Every command of the page on golden images, in its order, those of its workflows, and its
/// script.
#[cfg(unix)]
#[test]
fn documented_commands_run() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let page = fs::read_to_string(root.join("docs/golden-images.md")).expect("the page");
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    fs::create_dir(at.join("scenes")).unwrap();
    for name in ["cut", "first", "inside"] {
        let scene = format!("scenes/{name}.toml");
        fs::copy(root.join(&scene), at.join(&scene)).unwrap();
    }
    std::os::unix::fs::symlink(root.join("tests"), at.join("tests")).unwrap();
    let program = Path::new(env!("CARGO_BIN_EXE_planisphere")).parent().unwrap();
    let path = format!("{}:{}", program.display(), std::env::var("PATH").unwrap_or_default());
    let run = |command: &str| {
        let mut shell = Command::new("sh");
        shell.args(["-c", &format!("set -e; {command}")]).current_dir(at).env("PATH", &path);
        let output = shell.stdin(Stdio::null()).output().expect("a shell");
        Said::of(&output).must(0, &[]).out
    };
    let typed = blocks(&page, "sh");
    for command in &typed {
        run(command);
    }
    let yaml = blocks(&page, "yaml");
    let start = |line: &str| line.find("planisphere check ");
    let in_workflows: Vec<&str> = yaml.iter().filter_map(|l| Some(&l[start(l)?..])).collect();
    for command in &in_workflows {
        run(command.trim_end_matches('\''));
    }
    assert!(typed.len() >= 11 && in_workflows.len() == 3, "{typed:?}, {in_workflows:?}");
    // What was written, and what was not: nothing had failed.
    let written = ["first.npy", "goldens", "moved.toml", "particles", "report.json", "report.xml"];
    fs::write(at.join("move.py"), blocks(&page, "python").join("\n")).unwrap();
    let python = std::env::var("PYTHON").unwrap_or_else(|_| "python3".into());
    for (distance, pixels) in [("0.1", "1223"), ("0.01", "115"), ("0.001", "9")] {
        assert_eq!(run(&format!("{python} move.py 349 {distance}")).trim(), pixels, "{distance}");
    }
    let names = names(at);
    let made = names.iter().filter(|name| !["move.py", "scenes", "tests"].contains(&name.as_str()));
    assert_eq!(made.collect::<Vec<_>>(), written);
}
