//! Bad scene files: each is refused with the file, line, column, a caret and the fix, exit code 2,
//! and nothing is written.
//!
//! The program itself is run, so that what is tested is what a person sees.

use std::{
    fs,
    path::Path,
    process::{Command, Output},
};

/// Runs `planisphere render scene.toml` in a folder.
fn render(folder: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_planisphere"))
        .args(["render", "scene.toml", "--device", "cpu"])
        .current_dir(folder)
        .output()
        .expect("the program runs")
}

/// A version 1.0 `.npy` file.
fn npy(descr: &str, fortran: &str, shape: &str, data: &[u8]) -> Vec<u8> {
    let header =
        format!("{{'descr': '{descr}', 'fortran_order': {fortran}, 'shape': {shape}, }}\n");
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.bytes());
    bytes.extend(data);
    bytes
}

fn floats(numbers: &[f32]) -> Vec<u8> {
    numbers.iter().flat_map(|n| n.to_le_bytes()).collect()
}

/// Arrays that the cases name: good ones of two spheres, and bad ones.
fn write_arrays(folder: &Path) {
    let c2 = floats(&[0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
    let files: [(&str, Vec<u8>); 12] = [
        ("c.npy", npy("<f4", "False", "(2, 3)", &c2)),
        ("r.npy", npy("<f4", "False", "(2,)", &floats(&[1.0, 2.0]))),
        ("rgb.npy", npy("|u1", "False", "(2, 3)", &[1, 2, 3, 4, 5, 6])),
        ("c-flat.npy", npy("<f4", "False", "(6,)", &c2)),
        ("c-wide.npy", npy("<f4", "False", "(3, 2)", &c2)),
        ("c-text.npy", npy("<U1", "False", "(2, 3)", &c2)),
        ("c-short.npy", npy("<f4", "False", "(2, 3)", &c2[..20])),
        ("c-nan.npy", npy("<f4", "False", "(2, 3)", &floats(&[0.0, 1.0, 2.0, 3.0, f32::NAN, 5.0]))),
        ("r-three.npy", npy("<f4", "False", "(3,)", &floats(&[1.0; 3]))),
        ("r-zero.npy", npy("<f4", "False", "(2,)", &floats(&[1.0, 0.0]))),
        ("rgb-unit.npy", npy("<f4", "False", "(2, 3)", &floats(&[0.0, 0.5, 1.0, 0.25, 0.0, 1.0]))),
        ("not.npy", b"hello".to_vec()),
    ];
    for (name, bytes) in files {
        fs::write(folder.join(name), bytes).unwrap();
    }
}

/// A case: the scene, the place `line:column`, and words that the message and its fix must have.
type Case = (&'static str, &'static str, &'static [&'static str]);

const CASES: &[Case] = &[
    // The TOML itself.
    ("[camera]\nview = [1, 0, 0\n", "2:16", &["not TOML"]),
    (
        "[camera]\nview = [1, 0, 0]\nview = [1, 0, 0]",
        "3:1",
        &["not TOML", "duplicate key", "remove one"],
    ),
    // Unknown keys, with the nearest known one.
    ("[camra]\n", "1:2", &["unknown key `camra`", "did you mean `camera`?"]),
    (
        "[camera]\nview = [1, 0, 0]\nfra = 3.0",
        "3:1",
        &["unknown key `fra` in [camera]", "did you mean `far`?"],
    ),
    ("[image]\nbackgroud = '#000000'", "2:1", &["unknown key `backgroud`", "`background`"]),
    ("[[sphere]]\ncentre = [0, 0, 0]", "2:1", &["in [[sphere]]", "did you mean `center`?"]),
    ("[[sphere]]\ncolour = '#ffffff'", "2:1", &["did you mean `color`?"]),
    ("[[sphere]]\nxyzzy = 1", "2:1", &["the keys here are center, radius, color"]),
    ("[[spheres]]\ncenter = 'c.npy'", "2:1", &["did you mean `centers`?"]),
    // Wrong types.
    ("camera = 3", "1:10", &["`camera` is an integer", "a table is needed"]),
    ("[[camera]]\nview = [1, 0, 0]", "1:1", &["single brackets"]),
    ("[sphere]\ncenter = [0, 0, 0]", "1:1", &["[[sphere]]"]),
    (
        "[[sphere]]\ncenter = 'here'\nradius = 1",
        "2:10",
        &["`center` is a string", "center = [1.0, 0.0, 0.0]"],
    ),
    ("[[sphere]]\ncenter = [0, 0]\nradius = 1", "2:10", &["2 numbers", "three are needed"]),
    ("[[sphere]]\ncenter = [0, 0, 'x']\nradius = 1", "2:17", &["`center` is a string"]),
    ("[[sphere]]\ncenter = [0, 0, 0]\nradius = true", "3:10", &["`radius` is a boolean"]),
    (
        "[[sphere]]\ncenter = [0, 0, 9007199254740993]\nradius = 1",
        "2:17",
        &["no 64-bit float equals", "1.0e20"],
    ),
    ("[image]\nwidth = 800.0", "2:9", &["`width` is a number", "an integer is needed"]),
    ("[camera]\nview = [1, 0, 0]\nprojection = 'fisheye'", "3:14", &["\"fisheye\"", "perspective"]),
    (
        "[camera]\nview = [1, 0, 0]\nprojection = 1",
        "3:14",
        &["`projection` is an integer", "with quotes"],
    ),
    // Numbers that are not finite.
    ("[[sphere]]\ncenter = [nan, 0, 0]\nradius = 1", "2:11", &["nan", "finite"]),
    ("[[sphere]]\ncenter = [0, -inf, 0]\nradius = 1", "2:14", &["-inf", "finite"]),
    ("[[sphere]]\ncenter = [0, 0, 0]\nradius = 1e999", "3:10", &["beyond the range"]),
    ("[camera]\nview = [1, 0, 0]\nfar = inf", "3:7", &["leave `far` out"]),
    // Spheres.
    ("[[sphere]]\ncenter = [0, 0, 0]\nradius = 0.0", "3:10", &["`radius` is 0", "greater than 0"]),
    ("[[sphere]]\ncenter = [0, 0, 0]\nradius = -2", "3:10", &["`radius` is -2"]),
    ("[[sphere]]\ncenter = [0, 0, 0]\nradius = 1e-400", "3:10", &["`radius` is 0"]),
    ("[[sphere]]\nradius = 1", "1:1", &["`center` is missing", "add center = "]),
    ("[[sphere]]\ncenter = [0, 0, 0]", "1:1", &["`radius` is missing", "add radius = "]),
    // Colours.
    (
        "[[sphere]]\ncenter = [0, 0, 0]\nradius = 1\ncolor = 'rod'",
        "4:9",
        &["\"rod\"", "not a colour"],
    ),
    (
        "[[sphere]]\ncenter = [0, 0, 0]\nradius = 1\ncolor = 'xyzzy'",
        "4:9",
        &["\"xyzzy\"", "six hexadecimal digits"],
    ),
    ("[[sphere]]\ncenter = [0, 0, 0]\nradius = 1\ncolor = '#12345'", "4:9", &["not a colour"]),
    ("[[sphere]]\ncenter = [0, 0, 0]\nradius = 1\ncolor = [1, 2, 256]", "4:16", &["0 to 255"]),
    ("[[sphere]]\ncenter = [0, 0, 0]\nradius = 1\ncolor = [1, 2]", "4:9", &["2 numbers"]),
    ("[image]\nbackground = 7", "2:14", &["`background` is an integer"]),
    // The camera.
    ("[camera]\nview = [0, 0, 0]", "2:8", &["view direction is zero", "any other vector"]),
    (
        "[camera]\norigin = [1, 2, 3]\nlook_at = [1, 2, 3]",
        "3:11",
        &["`look_at` is the camera's origin"],
    ),
    (
        "[camera]\norigin = [-1.7e308, 0, 0]\nlook_at = [1.7e308, 0, 0]",
        "3:11",
        &["beyond the range"],
    ),
    (
        "[camera]\nview = [1, 1, 0]\nup = [-0.5, -0.5, 0]",
        "3:6",
        &["up is parallel", "points another way"],
    ),
    ("[camera]\nview = [1, 1, 0]\nup = [0, 0, 0]", "3:6", &["up is zero", "leave `up` out"]),
    (
        "[camera]\nview = [0, 0, 2]\nup = [0, 0, 0]",
        "3:6",
        &["up is zero", "write up = [0.0, 1.0, 0.0]"],
    ),
    ("[camera]\nview = [0, 0, -2]", "2:8", &["parallel to the default up", "up = [0.0, 1.0, 0.0]"]),
    ("[camera]\norigin = [0, 0, 5]\nlook_at = [0, 0, 0]", "3:11", &["parallel to the default up"]),
    (
        "[camera]\nview = [1, 0, 0]\nnear = 5\nfar = 5",
        "3:8",
        &["near is 5 and far is 5", "less than far"],
    ),
    ("[camera]\nview = [1, 0, 0]\nfar = 0.0", "3:7", &["not beyond near"]),
    ("[camera]\nview = [1, 0, 0]\nnear = -1", "3:8", &["near is -1", "0 or more"]),
    (
        "[camera]\nview = [1, 0, 0]\nlook_at = [1, 0, 0]",
        "3:11",
        &["both `view` and `look_at`", "remove"],
    ),
    ("[camera]\nview = [1, 0, 0]\nwidth = 0", "3:9", &["width is 0", "positive"]),
    ("[camera]\nview = [1, 0, 0]\nheight = -4.5", "3:10", &["height is -4.5", "positive"]),
    (
        "[camera]\nview = [1, 0, 0]\nfov = 40",
        "3:7",
        &["orthographic", "projection = \"perspective\""],
    ),
    (
        "[camera]\nview = [1, 0, 0]\nprojection = 'perspective'\nfov = 0",
        "4:7",
        &["0 degrees", "less than 180"],
    ),
    (
        "[camera]\nview = [1, 0, 0]\nprojection = 'perspective'\nfov = 180.0",
        "4:7",
        &["180 degrees"],
    ),
    (
        "[camera]\nview = [1, 0, 0]\nprojection = 'perspective'\nfov = 40\nwidth = 2",
        "4:7",
        &["both `width` and `fov`"],
    ),
    (
        "[camera]\nview = [1, 0, 0]\nprojection = 'perspective'\nheight = 2\nfov = 4",
        "5:7",
        &["both `height` and `fov`"],
    ),
    // The image.
    ("[image]\nwidth = 0", "2:9", &["width is 0 pixels", "from 1 to 32768"]),
    ("[image]\nheight = 32769", "2:10", &["height is 32769 pixels", "from 1 to 32768"]),
    ("[image]\nheight = -1", "2:10", &["height is -1 pixels"]),
    // Arrays.
    ("[[spheres]]\nradius = 1", "1:1", &["`centers` is missing", "add centers"]),
    ("[[spheres]]\ncenters = 'c.npy'", "1:1", &["`radii` is missing", "radius = 0.5"]),
    (
        "[[spheres]]\ncenters = 'gone.npy'\nradius = 1",
        "2:11",
        &["gone.npy: no such file", "planisphere make"],
    ),
    ("[[spheres]]\ncenters = '.'\nradius = 1", "2:11", &["not a regular file"]),
    (
        "[[spheres]]\ncenters = 'not.npy'\nradius = 1",
        "2:11",
        &["not.npy: is not an .npy file", "numpy.save"],
    ),
    (
        "[[spheres]]\ncenters = 'c.npy'\nradii = 'r.npy'\nradius = 1",
        "4:10",
        &["both `radii` and `radius`"],
    ),
    (
        "[[spheres]]\ncenters = 'c.npy'\nradius = 1\ncolors = 'rgb.npy'\ncolor = '#ffffff'",
        "5:9",
        &["both `colors`"],
    ),
    ("[[spheres]]\ncenters = 'c.npy'\nradius = -1", "3:10", &["`radius` is -1"]),
    ("[[spheres]]\ncenters = 'c-flat.npy'\nradius = 1", "2:11", &["shape (6,)", "(N, 3)"]),
    ("[[spheres]]\ncenters = 'c-wide.npy'\nradius = 1", "2:11", &["shape (3, 2)", "(N, 3)"]),
    ("[[spheres]]\ncenters = 'c.npy'\nradii = 'r-three.npy'", "3:9", &["shape (3,)", "(2,)"]),
    (
        "[[spheres]]\ncenters = 'c.npy'\nradii = 'r.npy'\ncolors = 'c-wide.npy'",
        "4:10",
        &["shape (3, 2)", "(2, 3)"],
    ),
    (
        "[[spheres]]\ncenters = 'c-text.npy'\nradius = 1",
        "2:11",
        &["text", "numpy.array(rows, 'f8')"],
    ),
    (
        "[[spheres]]\ncenters = 'c.npy'\nradius = 1\ncolors = 'rgb-unit.npy'",
        "4:10",
        &["from 0 to 1", "uint8", "255 *"],
    ),
    ("[[spheres]]\ncenters = 'c-short.npy'\nradius = 1", "2:11", &["20 bytes", "needs 24"]),
    (
        "[[spheres]]\ncenters = 'c-nan.npy'\nradius = 1",
        "2:11",
        &["c-nan.npy: y of centre 1 is NaN", "element [1, 1]"],
    ),
    (
        "[[spheres]]\ncenters = 'c.npy'\nradii = 'r-zero.npy'",
        "3:9",
        &["r-zero.npy: radius 1 is 0", "element [1]"],
    ),
    // After good spheres: the block is found, whatever its number.
    (
        "[[sphere]]\ncenter = [0, 0, 0]\nradius = 1\n[[spheres]]\ncenters = 'c.npy'\nradius = 1\n\
         [[spheres]]\ncenters = 'c-nan.npy'\nradius = 1",
        "8:11",
        &["c-nan.npy: y of centre 1"],
    ),
];

#[test]
fn bad_scenes_are_refused_in_words() {
    let folder = tempfile::tempdir().unwrap();
    write_arrays(folder.path());
    let scene = folder.path().join("scene.toml");
    let before = fs::read_dir(folder.path()).unwrap().count() + 1;
    let mut wrong = Vec::new();
    for (text, place, words) in CASES {
        fs::write(&scene, text).unwrap();
        let output = render(folder.path());
        let message = String::from_utf8(output.stderr).unwrap();
        let mut missing: Vec<String> =
            words.iter().filter(|w| !message.contains(**w)).map(|w| format!("{w:?}")).collect();
        for needed in [format!("scene.toml:{place}\n"), "= fix: ".into(), "^".into()] {
            if !message.contains(&needed) {
                missing.push(format!("{needed:?}"));
            }
        }
        if !message.starts_with("error: ") || message.contains('\x1b') {
            missing.push("plain text that begins with error:".into());
        }
        if output.status.code() != Some(2) || !output.stdout.is_empty() {
            missing.push(format!("exit code 2 and no output, not {:?}", output.status));
        }
        if fs::read_dir(folder.path()).unwrap().count() != before {
            missing.push("no file written".into());
        }
        if !missing.is_empty() {
            wrong.push(format!("{text}\n-> {message}\nlacks {}\n", missing.join(", ")));
        }
    }
    assert!(wrong.is_empty(), "{} of {} cases:\n\n{}", wrong.len(), CASES.len(), wrong.join("\n"));
}

#[test]
fn a_scene_file_that_cannot_be_read_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |word: &str| {
        let output = render(folder.path());
        let message = String::from_utf8(output.stderr).unwrap();
        assert!(
            message.contains("scene.toml") && message.contains(word) && message.contains("fix: "),
            "{message}"
        );
        assert_eq!(output.status.code(), Some(2));
    };
    refused("no such file");
    fs::write(folder.path().join("scene.toml"), b"[image]\nwidth = 3 # \xff\n").unwrap();
    refused("scene.toml:2:13");
    fs::remove_file(folder.path().join("scene.toml")).unwrap();
    fs::create_dir(folder.path().join("scene.toml")).unwrap();
    refused("is a folder");
}

#[test]
fn good_scenes_mean_what_they_say() {
    use glam::DVec3;
    use planisphere_core::camera::*;
    use planisphere_io::load::from_text;

    let folder = tempfile::tempdir().unwrap();
    write_arrays(folder.path());
    let text = "
        [camera]
        projection = 'perspective'
        origin = [1, 2.5, -3]
        look_at = [0.1, 0, 0]
        fov = 90
        near = 0.5
        far = 1_000
        [image]
        width = 0x40
        background = '#0a0B0c'
        [[spheres]]
        centers = 'c.npy'
        radii = 'r.npy'
        colors = 'rgb.npy'
        [[sphere]]
        center = [9007199254740992, 0.1, 1e-330]
        radius = 1
        [[sphere]]
        center = [0, 0, 0]
        radius = 2.5
        color = [1, 2, 3]
        [[spheres]]
        centers = 'c.npy'
        radius = 0.5
        color = '#ffffff'
    ";
    let loaded = from_text("test", text, folder.path()).unwrap();
    let camera = loaded.fixed_camera.unwrap();
    assert_eq!(camera.projection, Projection::Perspective);
    assert_eq!((camera.origin, camera.up), (DVec3::new(1.0, 2.5, -3.0), DVec3::Z));
    assert_eq!(camera.view, DVec3::new(0.1 - 1.0, -2.5, 3.0));
    assert_eq!((camera.size, camera.near, camera.far), (ScreenSize::Height(2.0), 0.5, 1000.0));
    assert_eq!(loaded.image, ImageSize { width: 64, height: 800 });
    assert_eq!(loaded.look.behind(), [10, 11, 12]);
    // All [[sphere]] first, then each [[spheres]] in turn.
    let spheres: Vec<_> =
        (0..loaded.scene.len()).map(|k| loaded.scene.sphere(k).unwrap()).collect();
    assert_eq!(spheres.len(), 6);
    assert_eq!(spheres[0].center, DVec3::new(9007199254740992.0, 0.1, 0.0));
    assert_eq!(
        (spheres[0].color, spheres[1].color),
        (planisphere_io::load::DEFAULT_COLOR, [1, 2, 3])
    );
    assert_eq!((spheres[3].center, spheres[3].radius), (DVec3::new(3.0, 4.0, 5.0), 2.0));
    assert_eq!((spheres[3].color, spheres[5].color), ([4, 5, 6], [255; 3]));
    assert_eq!(spheres[4].radius, 0.5);

    let plain = from_text(
        "test",
        "[camera]\norigin = [0, 0, 0]\nview = [1, 0, 0]\nwidth = 10",
        folder.path(),
    )
    .unwrap();
    let camera = plain.fixed_camera.unwrap();
    assert_eq!(
        (camera.projection, camera.size),
        (Projection::Orthographic, ScreenSize::Width(10.0))
    );
    assert_eq!((camera.near, camera.far, camera.up), (0.0, f64::INFINITY, DVec3::Z));
    assert!(plain.scene.is_empty());
    let empty = from_text("test", "", folder.path()).unwrap();
    assert!(empty.fixed_camera.is_none() && empty.camera(empty.image).check().is_ok());
    assert_eq!((empty.image, empty.look.behind()), (ImageSize { width: 800, height: 800 }, [0; 3]));
}

#[test]
fn many_single_spheres_load_fast() {
    let sphere = |k: usize| {
        format!("[[sphere]]\ncenter = [{k}.5, {}, 0.25]\nradius = 0.5\ncolor = '#123456'\n", k % 97)
    };
    let text: String = (0..100_000).map(sphere).collect();
    let load = |text: &str| planisphere_io::load::from_text("test", text, Path::new(""));
    let start = std::time::Instant::now();
    let loaded = load(&text).unwrap();
    println!("{:?}", start.elapsed());
    assert_eq!(loaded.scene.len(), 100_000);
    // Some 0.15 s on two cores; a quadratic step would take minutes.
    assert!(start.elapsed().as_secs() < 10, "{:?}", start.elapsed());
    assert!(
        (0..100_000)
            .step_by(997)
            .all(|k| loaded.scene.sphere(k).unwrap().center.x == k as f64 + 0.5)
    );

    // Faults are found at their places, wherever they are: in a sphere, in another table, in the
    // TOML.
    let place = |text: &str, wanted: &str| {
        let message = load(text).expect_err("refused").to_string();
        assert!(message.contains(wanted), "{message}");
    };
    place(&text.replacen("center = [77777.5", "center = [nan", 1), "test:311110:11\n");
    place(&text.replacen("center = [77777.5", "centre = [1", 1), "test:311110:1\n");
    place(&format!("{text}[camera]\nview = [0, 0, 0]"), "test:400002:8\n");
    place(&format!("[image]\nwidth = 0\n{text}"), "test:2:9\n");
    place(&text.replacen("radius = 0.5\n", "radius = 0.5\nradius = 0.5\n", 1), "test:4:1\n");
    place(&format!("sphere = []\n{text}"), "test:2:3\n");
    // A string over several lines may hold what looks like a table.
    let comment = "color = \"\"\"\n[[sphere]]\n[image]\n\"\"\"\n";
    place(&text.replacen("color = '#123456'\n", comment, 1), "test:4:9\n");
    // Tables of other kinds in between.
    let mixed = text.replacen(
        "[[sphere]]\ncenter = [5000.5",
        "[image]\nwidth = 7\n[[sphere]]\ncenter = [5000.5",
        1,
    );
    let mixed = load(&mixed).unwrap();
    assert_eq!((mixed.scene.len(), mixed.image.width), (100_000, 7));
    assert_eq!(mixed.scene.sphere(5001).unwrap().center.x, 5001.5);
}

#[test]
fn no_text_makes_it_panic() {
    let folder = tempfile::tempdir().unwrap();
    write_arrays(folder.path());
    let mut state = 1u64;
    let mut random = |below: usize| {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 33) as usize % below
    };
    let pieces = [
        "[camera]\n",
        "[image]\n",
        "[[sphere]]\n",
        "[[spheres]]\n",
        "view = ",
        "up = ",
        "look_at = ",
        "fov = ",
        "near = ",
        "far = ",
        "width = ",
        "height = ",
        "center = ",
        "radius = ",
        "color = ",
        "centers = ",
        "radii = ",
        "colors = ",
        "[0, 0, 1]\n",
        "[1e308, -1e308, 5e-324]\n",
        "1\n",
        "0.0\n",
        "-0.0\n",
        "1e-320\n",
        "89.9\n",
        "'c.npy'\n",
        "'r.npy'\n",
        "'rgb.npy'\n",
        "'c-nan.npy'\n",
        "'#123456'\n",
        "nan\n",
        "[\n",
        "]\n",
        "'''",
        "\"",
        "\u{feff}",
        "é",
        "\r\n",
        "{",
        "}",
        "projection = 'perspective'\n",
        "view = [1, 0, 0]\n",
        "center = [1, 2, 3]\nradius = 1\n",
    ];
    let mut loaded = 0;
    for round in 0..20_000 {
        let text: String = (0..1 + random(12)).map(|_| pieces[random(pieces.len())]).collect();
        let result = std::panic::catch_unwind(|| {
            planisphere_io::load::from_text("test", &text, folder.path())
                .map(|l| l.camera(l.image))
                .map_err(|e| e.to_string())
        });
        match result {
            Ok(Ok(camera)) => {
                camera.check().unwrap();
                loaded += 1;
            }
            Ok(Err(message)) => assert!(message.contains("fix: "), "{message}"),
            Err(_) => panic!("round {round}: {text:?}"),
        }
    }
    assert!(loaded > 50, "only {loaded} of these are scenes");
}
