//! What reaches the terminal: reports are short whatever is in a file or in a name, and nothing in
//! them moves the cursor.
//!
//! The program itself is run, so that what is tested is what a person sees.

use std::{
    ffi::{OsStr, OsString},
    fs,
    path::Path,
    process::{Command, Output},
};

use planisphere_core::text::unseen;

fn run<S: AsRef<OsStr>>(folder: &Path, args: &[S]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_planisphere"))
        .args(args)
        .current_dir(folder)
        .output()
        .expect("the program runs")
}

/// What was said, which must be fit for a terminal and short.
fn said(output: &Output, case: &str) -> String {
    let text = std::str::from_utf8(&output.stderr).unwrap_or_else(|_| panic!("{case}: not UTF-8"));
    let bad: Vec<char> = text.chars().filter(|c| unseen(*c) && *c != '\n').collect();
    assert!(bad.is_empty(), "{case}: {bad:?} in {text}");
    assert!(text.len() < 4000, "{case}: {} bytes", text.len());
    assert!(text.lines().all(|line| line.chars().count() < 1000), "{case}: {text}");
    text.to_owned()
}

/// Draws a scene file that must be refused, and gives the report.
fn refused(case: &str, scene: &[u8]) -> String {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("scene.toml"), scene).unwrap();
    let output = run(folder.path(), &["render", "scene.toml", "--device", "cpu"]);
    let text = said(&output, case);
    assert_eq!(output.status.code(), Some(2), "{case}: {text}");
    assert!(text.starts_with("error: ") && text.contains("fix: "), "{case}: {text}");
    assert!(!folder.path().join("scene.png").exists(), "{case}");
    text
}

/// A sphere that is drawn, on one line.
const BALL: &str = "{center=[0,0,0],radius=1}";

/// Each case: its name, the file, and what the report must say.
fn cases() -> Vec<(&'static str, Vec<u8>, Vec<&'static str>)> {
    let many = format!("{BALL},").repeat(20_000);
    let ball = |key: &str, value: &str| {
        format!("[[sphere]]\ncenter=[0,0,0]\nradius=1\n{key} = {value}\n").into_bytes()
    };
    let wide = "球".repeat(3000);
    let deep = |n: usize, open: &str, close: &str| {
        format!("x = {}{}", open.repeat(n), close.repeat(n)).into_bytes()
    };
    let dotted = |n: usize| vec!["a"; n].join(".");
    let utf16 = |text: &str, mark: &[u8], bytes: fn(u16) -> [u8; 2]| {
        [mark, &text.encode_utf16().flat_map(bytes).collect::<Vec<_>>()].concat()
    };
    let text = "[camera]\nview = [1, 0, 0]\n";
    vec![
        // Long lines.
        (
            "end",
            format!("sphere=[{many}{{center=[1,2],radius=1}}]").into(),
            vec!["scene.toml:1:520017", "{center=[1,2]"],
        ),
        (
            "middle",
            format!("sphere=[{many}{{center=[1,2],radius=1}},{many}]").into(),
            vec!["scene.toml:1:520017", "^^^^^"],
        ),
        (
            "start",
            format!("sphere=[{{center=[1,2],radius=1}},{many}]").into(),
            vec!["scene.toml:1:17", "| sphere=[{center=[1,2]"],
        ),
        (
            "two places on one line",
            format!("spheres=[{{radii='{}',centers='c.npy',radius=1}}]", "x".repeat(5000)).into(),
            vec![
                "both `radii` and `radius`",
                "the other one",
                "radii='xxx",
                "xxx...xxx",
                "radius=1",
            ],
        ),
        (
            "two long lines",
            format!(
                "[camera]\n{}view=[1,0,0]\n\n\n{}up=[2,0,0]\n",
                "\t".repeat(900),
                " ".repeat(900)
            )
            .into(),
            vec!["up is parallel", "scene.toml:5:904", "the view direction"],
        ),
        (
            "a place longer than a line",
            format!("[[sphere]]\ncenter=[0,0,0]\nradius='{}'", "y".repeat(30_000)).into(),
            vec!["3:8", "y...y"],
        ),
        (
            "a value over many lines",
            format!("[[sphere]]\ncenter=[{}\n]", "\n1,".repeat(9000)).into(),
            vec!["9000 numbers", "2:8"],
        ),
        // Long names and values.
        (
            "a long key",
            format!("{} = 1", "k".repeat(50_000)).into(),
            vec!["unknown key `kkk", "kkk...kkk"],
        ),
        (
            "a long key in a table",
            format!("[camera]\n'{wide}' = 1").into(),
            vec!["unknown key `球球", "in [camera]"],
        ),
        (
            "a long colour",
            ball("color", &format!("'{}'", "z".repeat(20_000))),
            vec!["`color` is \"zzz", "not a colour"],
        ),
        (
            "a long duplicate key",
            format!("{0} = 1\n{0} = 1", "k".repeat(9000)).into(),
            vec!["duplicate key", "2:1"],
        ),
        (
            "wide characters",
            ball("color", &format!("'{wide}\u{1b}{wide}'")),
            vec!["control character 0x1b", "\\u001b", "球..."],
        ),
        ("emoji", ball("color", &format!("'{}'", "👩\u{200d}🔬".repeat(800))), vec!["\\u200d"]),
        (
            "accents",
            ball("color", &format!("'{}'", "e\u{301}".repeat(4000))),
            vec!["e\u{301}e\u{301}"],
        ),
        (
            "a long projection",
            format!("[camera]\nprojection='{}'", "p".repeat(9000)).into(),
            vec!["unknown projection \"ppp"],
        ),
        // Characters that are not seen.
        (
            "escape in a string",
            ball("color", "\"\u{1b}[31mred\""),
            vec!["control character 0x1b", "\"\\u001b[31mred\""],
        ),
        (
            "escaped escape",
            ball("color", "\"\\u001b[31mred\""),
            vec!["`color` is \"\\u001b[31mred\""],
        ),
        (
            "escape in a comment",
            b"[camera] # \x1b]0;title\x07\nview=[0,0,0]".to_vec(),
            vec!["control character 0x1b", "\\u0007"],
        ),
        ("escape in a key", ball("\"\\u001b[2J\"", "1"), vec!["unknown key `\\u001b[2J`"]),
        ("newline in a key", ball("\"a\\nerror: b\"", "1"), vec!["unknown key `a\\nerror: b`"]),
        (
            "carriage return in a key",
            ball("\"radius\\r\"", "1"),
            vec!["unknown key `radius\\r`", "did you mean `radius`"],
        ),
        ("C1 in a string", ball("color", "'\u{9b}31m'"), vec!["\\u009b31m"]),
        ("DEL", ball("color", "'\u{7f}'"), vec!["0x7f"]),
        ("bidi override", ball("color", "'\u{202e}der\u{202c}'"), vec!["\\u202eder\\u202c"]),
        (
            "bidi beside the fault",
            ball("color", "'rod' # \u{2066}'red'\u{2069}"),
            vec!["\\u2066'red'\\u2069"],
        ),
        ("zero width in a key", ball("co\u{200b}lor", "'red'"), vec!["not TOML"]),
        (
            "zero width in a quoted key",
            ball("'co\u{200b}lor'", "'red'"),
            vec!["unknown key `co\\u200blor`", "did you mean `color`"],
        ),
        ("a mark inside", ball("color", "'\u{feff}red'"), vec!["\\ufeffred"]),
        ("tags", ball("color", "'\u{e0041}'"), vec!["\\U000e0041"]),
        ("line separator", ball("color", "'a\u{2028}b'"), vec!["a\\u2028b"]),
        (
            "projection",
            b"[camera]\nprojection=\"a\\u0007b\"".to_vec(),
            vec!["unknown projection \"a\\u0007b\""],
        ),
        // Nesting.
        ("deep lists", deep(100_000, "[", "]"), vec!["nested more than 16 deep"]),
        ("deep lists that stay open", deep(100_000, "[", ""), vec!["nested more than 16 deep"]),
        ("deep lists, a small file", deep(1000, "[", "]"), vec!["nested more than 16 deep"]),
        ("deep tables", deep(100_000, "{a=", "}"), vec!["nested more than 16 deep"]),
        ("deep tables, a small file", deep(200, "{a=", "}"), vec!["nested more than 16 deep"]),
        ("a deep key", format!("{} = 1", dotted(100_000)).into(), vec!["more than 16 parts"]),
        (
            "a deep key, a small file",
            format!("{} = 1", dotted(20_000)).into(),
            vec!["more than 16 parts"],
        ),
        ("a deep header", format!("[{}]", dotted(100_000)).into(), vec!["more than 16 parts"]),
        (
            "a deep header, a small file",
            format!("[[{}]]", dotted(9000)).into(),
            vec!["more than 16 parts"],
        ),
        (
            "a deep key in a table",
            format!("sphere=[{{{}=1}}]", dotted(9000)).into(),
            vec!["more than 16 parts"],
        ),
        (
            "many open brackets",
            format!("view = [\n{}", "[camera\n".repeat(30)).into(),
            vec!["error: "],
        ),
        // Not text, or not this one.
        (
            "not UTF-8",
            [&b"[camera]\n# gr"[..], b"\xf6\xdfe\nview = [1, 0, 0]"].concat(),
            vec!["scene.toml:2:5", "0xf6", "Latin-1"],
        ),
        (
            "not UTF-8, on a long line",
            [&b"# "[..], &b"x".repeat(9000), b"\xff", &b"x".repeat(9000)].concat(),
            vec!["1:9003", "0xff"],
        ),
        (
            "UTF-16",
            utf16(text, b"\xff\xfe", u16::to_le_bytes),
            vec!["UTF-16", "Set-Content -Encoding utf8"],
        ),
        (
            "UTF-16, the other way",
            utf16(text, b"\xfe\xff", u16::to_be_bytes),
            vec!["UTF-16", "UTF-8"],
        ),
        (
            "UTF-16 without a mark",
            utf16(text, b"", u16::to_le_bytes),
            vec!["a byte of 0", "UTF-16", "1:2"],
        ),
        (
            "a byte of 0",
            b"[camera]\nview = [1, 0, 0] # \0".to_vec(),
            vec!["a byte of 0", "2:20", "\\u0000"],
        ),
        (
            "line ends of old",
            b"[camera]\rview = [1, 0, 0]\r".to_vec(),
            vec!["carriage return", "LF"],
        ),
        (
            "one line end of old",
            b"[camera]\nview = [1, 0, 0]\rup = [0, 0, 1]\n".to_vec(),
            vec!["carriage return", "2:17", "LF"],
        ),
        ("a picture", [&b"\x89PNG\r\n\x1a\n"[..], &[0; 99]].concat(), vec!["not UTF-8", "0x89"]),
        // The device, and the camera.
        ("up of zero", b"[camera]\nup = [0, 0, 0]".to_vec(), vec!["up is zero", "2:6"]),
    ]
}

#[test]
fn reports_are_short_and_plain() {
    let cases = cases();
    assert!(cases.len() > 50);
    for (case, scene, wanted) in cases {
        let text = refused(case, &scene);
        for words in wanted {
            assert!(text.contains(words), "{case} lacks {words}\n{text}");
        }
    }
}

/// Wherever a long line is cut, characters stay whole, and the caret is below what it speaks of.
#[test]
fn a_cut_never_splits_a_character() {
    for (filler, columns) in [("é", 1), ("球", 2), ("🙂", 2), ("\u{1b}", 0)] {
        for pad in 0..6 {
            let filler = if columns == 0 { "e\u{301}" } else { filler };
            let line = format!("# {}{}", "x".repeat(pad), filler.repeat(400));
            let scene = format!(
                "[[sphere]]\ncenter = [0, 0, 0]\n'{}' = 1 {line}\nradius = 1\n",
                filler.repeat(300 + pad)
            );
            let text = refused(filler, scene.as_bytes());
            assert!(text.contains("unknown key `") && !text.contains('\u{fffd}'), "{text}");
            assert!(text.contains("scene.toml:3:1\n"), "{text}");
            let report: Vec<&str> = text.lines().collect();
            let at =
                report.iter().position(|line| line.starts_with("3 | ")).expect("the line is shown");
            assert!(
                report[at].starts_with("3 | '") && report[at + 1].starts_with("  | ^^"),
                "{text}"
            );
        }
    }
}

#[test]
fn the_mark_of_utf8_is_read_over() {
    let folder = tempfile::tempdir().unwrap();
    let scene = format!("\u{feff}sphere = [{BALL}]\r\n[image]\r\nwidth = 16\r\nheight = 16\r\n");
    fs::write(folder.path().join("scene.toml"), &scene).unwrap();
    let output = run(folder.path(), &["render", "scene.toml", "--device", "cpu"]);
    assert_eq!((output.status.code(), said(&output, "mark").as_str()), (Some(0), ""));
    // Columns are counted behind it.
    fs::write(folder.path().join("scene.toml"), scene.replace("center", "centre")).unwrap();
    let text = said(&run(folder.path(), &["render", "scene.toml"]), "mark");
    assert!(text.contains("scene.toml:1:12\n"), "{text}");
}

/// Names on the command line, in the scene and in the environment.
#[test]
fn names_are_shown_on_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let ball = "[[sphere]]\ncenter=[0,0,0]\nradius=1\n[image]\nwidth=8\nheight=8\n";
    fs::write(here.join("s.toml"), ball).unwrap();
    let evil = "a\u{1b}[31m\nerror: b\u{202e}";
    let shown = "a\\u001b[31m\\nerror: b\\u202e";
    let arg = |text: &str| OsString::from(text);
    let folder_of = format!("{evil}/x.png");
    let mut cases: Vec<(Vec<OsString>, i32)> = vec![
        (vec![arg("render"), arg(evil)], 2),
        (vec![arg("view"), arg(evil)], 2),
        (vec![arg("merge"), arg(evil)], 2),
        (vec![arg("render"), arg("s.toml"), arg("--size"), arg(evil)], 2),
        (vec![arg("render"), arg("s.toml"), arg("--region"), arg(evil)], 2),
        (vec![arg("render"), arg("s.toml"), arg(&format!("--{evil}"))], 2),
        (vec![arg("render"), arg("s.toml"), arg(evil)], 2),
        (vec![arg(evil)], 2),
        (vec![arg("make"), arg(evil), arg("x")], 2),
        (vec![arg("make"), arg("cloud"), arg("x"), arg("--count"), arg(evil)], 2),
        (vec![arg("render"), arg("s.toml"), arg("--device"), arg(evil)], 3),
        (
            vec![
                arg("render"),
                arg("s.toml"),
                arg("--device"),
                arg("cpu"),
                arg("-o"),
                arg(&folder_of),
            ],
            4,
        ),
        (
            vec![
                arg("render"),
                arg("s.toml"),
                arg("--device"),
                arg("cpu"),
                arg("--ids"),
                arg(&folder_of),
            ],
            4,
        ),
    ];
    if !cfg!(feature = "window") {
        cases.retain(|(args, _)| args[0] != "view");
    }
    for (args, code) in cases {
        let case = format!("{args:?}");
        let output = run(here, &args);
        let text = said(&output, &case);
        assert_eq!(output.status.code(), Some(code), "{case}: {text}");
        assert!(text.contains("\\u001b[31m") || text.contains("\\u001B"), "{case}: {text}");
        assert!(text.contains(shown) || args.iter().any(|arg| arg == "--device"), "{case}: {text}");
        // No line of it pretends to be an error of its own.
        assert_eq!(
            text.lines().filter(|line| line.starts_with("error: ")).count(),
            1,
            "{case}: {text}"
        );
    }
    // Of a device the name is shown, and what there is instead.
    let text = said(&run(here, &["render", "s.toml", "--device", "no such\u{7}"]), "device");
    assert!(text.contains("no such\\u0007") && text.contains("tried"), "{text}");

    // A folder that is there, with such a name, and a word about what was made.
    let output = run(here, &["make", "lattice", evil, "--count", "4"]);
    let text = said(&output, "make");
    assert!(
        output.status.success() && text.contains(&format!("render '{shown}/scene.toml'")),
        "{text}"
    );
    let output = run(here, &["render", "s.toml", "--device", "cpu", "-o", evil]);
    assert_eq!(output.status.code(), Some(4), "{}", said(&output, "a folder as output"));

    // Arrays that a scene names, there and not there.
    for (name, wanted) in [
        ("\\u001b[31mc\\nd.npy", "\\u001b[31mc\\nd.npy: no such file"),
        ("s.toml", "s.toml: is not an .npy file"),
    ] {
        fs::write(
            here.join("t.toml"),
            format!("[[spheres]]\ncenters = \"{name}\"\nradius = 1.0\n"),
        )
        .unwrap();
        let output = run(here, &["render", "t.toml"]);
        let text = said(&output, name);
        assert!(output.status.code() == Some(2) && text.contains(wanted), "{text}");
    }
    fs::write(
        here.join("t.toml"),
        format!("[[spheres]]\ncenters = '{}.npy'\nradius = 1.0\n", "n".repeat(4000)),
    )
    .unwrap();
    let text = said(&run(here, &["render", "t.toml"]), "a long name");
    assert!(text.contains("nnn...nnn"), "{text}");
    // A long name on the command line.
    let text = said(&run(here, &["render", &"n".repeat(100_000)]), "a long argument");
    assert!(text.contains("nnn...nnn"), "{text}");
    let text =
        said(&run(here, &["render", "s.toml", "--size", &"9".repeat(100_000)]), "a long size");
    assert!(text.contains("999...999"), "{text}");
}

#[cfg(unix)]
#[test]
fn names_that_are_not_utf8_show_their_bytes() {
    use std::os::unix::ffi::OsStrExt;
    let folder = tempfile::tempdir().unwrap();
    let name = OsStr::from_bytes(b"a\xff\x1bb.toml");
    let output = run(folder.path(), &[OsStr::new("render"), name]);
    let text = said(&output, "bytes");
    assert!(
        output.status.code() == Some(2) && text.contains("a\\xff\\u001bb.toml: no such file"),
        "{text}"
    );
    fs::write(folder.path().join(name), "[camra]").unwrap();
    let text = said(&run(folder.path(), &[OsStr::new("render"), name]), "bytes");
    assert!(text.contains("--> a\\xff\\u001bb.toml:1:2"), "{text}");
}

#[cfg(all(unix, feature = "window"))]
#[test]
fn the_environment_is_shown_on_one_line() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("s.toml"), "[[sphere]]\ncenter=[0,0,0]\nradius=1\n").unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_planisphere"))
        .args(["view", "s.toml"])
        .env_remove("WAYLAND_DISPLAY")
        .env_remove("WAYLAND_SOCKET")
        .env("DISPLAY", "\u{1b}[2J:nowhere\n")
        .current_dir(folder.path())
        .output()
        .expect("the program runs");
    let text = said(&output, "DISPLAY");
    assert_eq!(output.status.code(), Some(3), "{text}");
    assert!(text.contains("\\u001b[2J"), "{text}");
}

/// Faults in large files of every shape: they are found at their places, and in the time that
/// reading takes.
#[test]
fn faults_of_large_files_have_their_places() {
    let table = "[[sphere]]\ncenter = [1, 2, 3]\nradius = 1\n";
    let tables = table.repeat(4000);
    let list = format!("{BALL},\n").repeat(6000);
    let cases: Vec<(&str, String, &str)> = vec![
        ("a duplicate key at the end", format!("{tables}radius = 1"), "scene.toml:12001:1\n"),
        ("an unknown key at the end", format!("{tables}radios = 1"), "scene.toml:12001:1\n"),
        (
            "a fault behind the spheres",
            format!("{tables}[camera]\nview = [0, 0, 0]"),
            "scene.toml:12002:8\n",
        ),
        (
            "a fault before them",
            format!("[camera]\nview = [0, 0, 0]\n{tables}"),
            "scene.toml:2:8\n",
        ),
        ("the camera twice", format!("[camera]\n{tables}[camera]\n"), "scene.toml:12002:2\n"),
        (
            "a fault between",
            format!("{tables}[image]\nwidth = 'x'\n{tables}"),
            "scene.toml:12002:9\n",
        ),
        (
            "a bad number in the middle",
            format!("{tables}[[sphere]]\ncenter = [1, 2, x]\nradius = 1\n{tables}"),
            "scene.toml:12002:17\n",
        ),
        (
            "a missing key in the middle",
            format!("{tables}[[sphere]]\nradius = 1\n{tables}"),
            "scene.toml:12001:1\n",
        ),
        (
            "a string that stays open",
            format!("{tables}color = \"red\n{tables}"),
            "scene.toml:12001:",
        ),
        (
            "a list that stays open",
            format!("{tables}[camera]\nview = [1, 0\n{tables}"),
            "scene.toml:12002:",
        ),
        (
            "a list of tables",
            format!("sphere = [\n{list}{{center=[0,0],radius=1}}\n]"),
            "scene.toml:6002:9\n",
        ),
        ("a list without its end", format!("sphere = [\n{list}"), "scene.toml:"),
        ("a comma too many", format!("sphere = [\n{list},\n{list}]"), "scene.toml:6002:1\n"),
        ("something behind the list", format!("sphere = [\n{list}] x"), "scene.toml:6002:"),
        ("a list and tables", format!("sphere = [\n{list}]\n{table}"), "scene.toml:6003:3\n"),
        ("a table of a sphere", format!("{tables}[sphere.center]\nx = 1\n"), "scene.toml:12001:"),
        (
            "unknown tables",
            format!(
                "{tables}{}",
                (0..20_000).map(|k| format!("[a{k}]\nb = 1\n")).collect::<String>()
            ),
            "scene.toml:12001:2\n",
        ),
        (
            "one table again and again",
            format!("{tables}{}", "[a]\nb = 1\n".repeat(20_000)),
            "scene.toml:12003:2\n",
        ),
        ("unknown lists of tables", "[[atoms]]\nx = 1\n".repeat(20_000), "scene.toml:1:3\n"),
        ("unknown keys", (0..30_000).map(|k| format!("k{k} = 1\n")).collect(), "scene.toml:1:1\n"),
        (
            "a fault behind a long comment",
            format!("# {}\n{}[camera]\nview=[0,0,0]", "x".repeat(200_000), "#\n".repeat(50_000)),
            "scene.toml:50003:6\n",
        ),
        (
            "a key with a long comment",
            format!("{}\n{tables}radios = 1", "# x\n".repeat(50_000)),
            "scene.toml:62002:1\n",
        ),
        (
            "spheres that are one",
            format!("[sphere]\ncenter=[0,0,0]\n{}", "# x\n".repeat(20_000)),
            "scene.toml:1:1\n",
        ),
        ("not a header", format!("{tables}[[sphere]\ncenter=[0,0,0]\n"), "scene.toml:12001:"),
    ];
    for (case, scene, wanted) in cases {
        let text = refused(case, scene.as_bytes());
        assert!(text.contains(wanted), "{case} lacks {wanted}\n{text}");
    }
}

/// A file is read the same in pieces as whole, whatever its shape.
#[test]
fn large_files_of_every_shape_are_read() {
    let load = |text: &str| {
        planisphere_io::load::from_text("test", text, Path::new(""))
            .unwrap_or_else(|error| panic!("{error}"))
    };
    let ball = |k: usize| {
        format!("{{center = [{k}, 2.5, -1e-3], radius = 0.5, color = [1, 2, {}]}}", k % 256)
    };
    let keys = |k: usize| {
        ball(k)
            .trim_matches(['{', '}'])
            .replace(", radius", "\nradius")
            .replace(", color", "\ncolor")
    };
    let n = 4000;
    let list: Vec<String> = (0..n).map(ball).collect();
    let tables: Vec<String> = (0..n).map(|k| format!("{}\n", keys(k))).collect();
    let head = "[camera]\nview = [1, 0.5, 0.25]\n[image]\nwidth = 7\n";
    let note = "# '''\" [[sphere]] ]]]\n".repeat(9);
    let shapes = [
        format!("sphere = [{}]\n{head}", list.join(",")),
        format!("sphere = [\n{note}{},\n# last\n]\n{head}", list.join(&format!(", {note}"))),
        format!("\"sphere\"=[{}]#\n{head}", list.join("\n,\n")),
        format!("{head}[[sphere]]\n{}", tables.join("[[sphere]]\n")),
        format!("[[sphere]]\n{}{head}", tables.join("\n\t[[ sphere ]] # [\n")),
        format!(
            "{note}[[sphere]]\n{}{note}{head}",
            tables.join(&format!("{note}[[\"sphere\"]]\n"))
        ),
        format!(
            "[[sphere]]\r\n{}{head}",
            tables.join("[[sphere]]\r\n").replace('\n', "\r\n").replace("\r\r", "\r")
        ),
        format!(
            "[[sphere]]\n{}",
            tables
                .join("[[sphere]]\n")
                .replacen("[[sphere]]\n", &format!("{head}[[sphere]]\n"), 50)
                .replacen(head, "", 49)
        ),
        format!(
            "camera.view = [1, 0.5, 0.25]\nimage.width = 7\n[[sphere]]\n{}",
            tables.join("[[sphere]]\n")
        ),
        format!(
            "image = {{width = 7}}\ncamera = {{view = [\n1, 0.5,\n0.25]}}\nsphere = [{}]",
            list.join(",")
        ),
    ];
    for (shape, text) in shapes.iter().enumerate() {
        assert!(text.len() > 1 << 16);
        let loaded = load(text);
        assert_eq!((loaded.scene.len(), loaded.image.width), (n, 7), "shape {shape}");
        assert_eq!(
            loaded.wanted.unwrap().view.unwrap().to_array(),
            [1.0, 0.5, 0.25],
            "shape {shape}"
        );
        for k in 0..n {
            let sphere = loaded.scene.sphere(k).unwrap();
            let center = [k as f64, 2.5, -1e-3];
            assert_eq!(
                (sphere.center.to_array(), sphere.radius, sphere.color),
                (center, 0.5, [1, 2, (k % 256) as u8]),
                "shape {shape}"
            );
        }
    }
}

/// The most memory that one of the tests' own files may take beyond the file, in a process of its
/// own.
#[cfg(target_os = "linux")]
#[test]
fn a_fault_takes_no_more_memory_than_a_right_file() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    // Kilobytes of the process's peak, as it says itself from time to time.
    let peak = |scene: &str| {
        fs::write(here.join("scene.toml"), scene).unwrap();
        let mut child = Command::new(env!("CARGO_BIN_EXE_planisphere"))
            .args(["render", "scene.toml", "-o", "none", "--stats", "--device", "cpu"])
            .current_dir(here)
            .stdout(std::process::Stdio::null())
            .stderr(std::process::Stdio::null())
            .spawn()
            .expect("the program runs");
        let process = format!("/proc/{}", child.id());
        let mut most = 0;
        loop {
            // Until the program runs, the process is a copy of this one and has its memory.
            let program = fs::read_link(format!("{process}/exe")).unwrap_or_default();
            let text = match program.file_name() {
                Some(name) if name == "planisphere" => {
                    fs::read_to_string(format!("{process}/status"))
                }
                _ => Ok(String::new()),
            };
            let text = text.unwrap_or_default();
            let high = text.lines().find_map(|line| {
                line.strip_prefix("VmHWM:")?.trim().strip_suffix(" kB")?.parse().ok()
            });
            most = most.max(high.unwrap_or(0));
            if let Some(status) = child.try_wait().expect("a child") {
                return (status.code(), most);
            }
            std::thread::sleep(std::time::Duration::from_millis(1));
        }
    };
    let sphere = "[[sphere]]\ncenter = [1.250, -2.500, 0.125]\nradius = 0.125\n";
    let right = sphere.repeat(60_000);
    let (code, most): (_, u64) = peak(&format!("[image]\nwidth = 4\nheight = 4\n{right}"));
    assert!(code == Some(0) && most > 10_000, "{code:?} {most}");
    let n = right.len();
    let deep = |k: usize| format!("[a{k}.{}]\n", vec!["b"; 14].join("."));
    let faults = [
        ("one key too many", format!("{right}radius = 1")),
        ("a fault in the camera", format!("{right}[camera]\nview = [0, 0, 0]")),
        ("deep headers", (0..n / 36).map(deep).collect()),
        ("unknown tables", (0..n / 16).map(|k| format!("[t{k}]\nx = 1\n")).collect()),
        ("unknown keys", (0..n / 12).map(|k| format!("k{k} = 1\n")).collect()),
        ("brackets", "[".repeat(n)),
        ("lines of words", "hello there\n".repeat(n / 12)),
        ("comments", format!("{}[camera]\nview = [0, 0, 0]", "#\n".repeat(n / 2))),
        (
            "one list",
            format!(
                "sphere = [{}{{radius=1}}]",
                "{center=[1.250,-2.500,0.125],radius=0.125},".repeat(n / 43)
            ),
        ),
        ("a long vector", format!("[camera]\nview = [{}]", "1,".repeat(n / 2))),
        ("an item that never ends", format!("sphere = [{{center=[{}]}}]", "1,".repeat(n / 2))),
        ("empty arrays", format!("sphere = [{}]", "[],".repeat(n / 3))),
        ("blocks", "[[spheres]]\nx = 1\n".repeat(n / 18)),
    ];
    for (case, text) in faults {
        let (code, memory) = peak(&text);
        assert_eq!(code, Some(2), "{case}");
        assert!(memory < most + most / 4, "{case}: {memory} kB, a right file takes {most} kB");
    }
}
