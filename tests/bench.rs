//! The benchmarks run, once and small, so that they never rot: their figures are there, and no
//! pixel is wrong.

use std::{
    path::Path,
    process::{Command, Output},
};

use serde_json::Value;

fn bench(args: &[&str]) -> Output {
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let program = env!("CARGO_BIN_EXE_planisphere");
    Command::new(program)
        .arg("bench")
        .args(args)
        .current_dir(scenes)
        .output()
        .expect("the program runs")
}

fn json(args: &[&str]) -> Value {
    let output = bench(args);
    assert!(output.status.success(), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("one JSON value")
}

/// A number that is there, finite and not negative.
fn figure(value: &Value, path: &str) -> f64 {
    let number = value.pointer(path).and_then(Value::as_f64);
    number
        .filter(|n| n.is_finite() && *n >= 0.0)
        .unwrap_or_else(|| panic!("no figure {path} in {value}"))
}

fn wrong(value: &Value, path: &str) -> f64 {
    ["missed", "extra", "swapped"].iter().map(|kind| figure(value, &format!("{path}/{kind}"))).sum()
}

#[test]
fn speed_of_the_small_matrix() {
    let report =
        json(&["speed", "--quick", "--json", "--size", "96x96", "--frames", "2", "--runs", "1"]);
    assert_eq!(report["version"], 1);
    let rows = report["rows"].as_array().expect("rows");
    let devices: Vec<&Value> = rows.iter().filter(|row| !row["cold"].is_null()).collect();
    assert!(
        devices.len() >= 30 && devices.len() < rows.len(),
        "{} of {} rows",
        devices.len(),
        rows.len()
    );
    for row in devices {
        for path in [
            "/process/time/wall/median",
            "/cold/wall/median",
            "/moved/wall/median",
            "/unchanged/wall/median",
        ] {
            assert!(figure(row, path) > 0.0);
        }
        assert_eq!((wrong(row, "/wrong"), wrong(row, "/process/wrong")), (0.0, 0.0), "{row}");
        assert!(figure(row, "/compared") > 0.0);
        if cfg!(unix) {
            assert!(figure(row, "/process/peak") > 1e6 && figure(row, "/ns_per_pixel") > 0.0);
        }
    }
    let goals = report["checks"].as_array().expect("goals");
    assert!(
        goals.iter().any(|goal| goal["what"].as_str().is_some_and(|what| what.contains("report")))
    );
}

#[test]
fn png_of_two_scenes() {
    let report = json(&["png", "perspective.toml", "first.toml", "--runs", "1", "--json"]);
    let rows = report["rows"].as_array().expect("rows");
    let of =
        |picture: &str| rows.iter().filter(|row| row["picture"] == picture).collect::<Vec<_>>();
    // Few colours have a palette; many have none, and are brought to fewer.
    for (picture, palette) in [
        ("perspective.toml", true),
        ("first.toml", false),
        ("first.toml, at most 256 colours", true),
    ] {
        let rows = of(picture);
        assert_eq!(rows.len(), if palette { 4 } else { 3 }, "{picture}");
        assert_eq!(rows.iter().any(|row| row["way"] == "palette"), palette, "{picture}");
        for row in rows {
            assert!(figure(row, "/bytes") > 0.0 && figure(row, "/wall/median") > 0.0, "{row}");
            assert!(!palette || figure(row, "/wall_over_palette/median") > 0.0, "{row}");
            // Beside the palette's file the RGB one is not much larger.
            assert!(
                !palette || row["way"] != "rgb" || figure(row, "/bytes_over_palette") < 1.5,
                "{row}"
            );
        }
    }
    assert_eq!(rows.len(), 11);
    let text = bench(&["png", "perspective.toml", "--runs", "1"]);
    assert!(String::from_utf8_lossy(&text.stdout).contains("RGB, png crate, level 1"));
}

#[test]
fn speed_of_one_scene() {
    let args = [
        "speed",
        "--scene",
        "perspective.toml",
        "--device",
        "cpu",
        "--size",
        "64x48",
        "--frames",
        "1",
        "--runs",
        "0",
    ];
    let report = json(&[&args[..], &["--json"]].concat());
    let rows = report["rows"].as_array().expect("rows");
    assert_eq!((rows[0]["image"][0].as_i64(), rows[0]["image"][1].as_i64()), (Some(64), Some(48)));
    assert!(rows[0]["process"].is_null());
    let table = String::from_utf8(bench(&args).stdout).unwrap();
    assert!(table.contains("perspective.toml") && table.contains("wrong pixels"), "{table}");
}

#[test]
fn accuracy_of_few_scenes() {
    let folder = tempfile::tempdir().unwrap();
    let plot = folder.path().join("plot.svg");
    let args = [
        "accuracy",
        "--quick",
        "--json",
        "--size",
        "64x64",
        "--frames",
        "1",
        "--plot",
        plot.to_str().unwrap(),
    ];
    let report = json(&args);
    assert_eq!(report["version"], 1);
    let rows = report["rows"].as_array().expect("rows");
    let methods = |device: &str| {
        let mut methods: Vec<&str> = rows
            .iter()
            .filter(|row| row["device"] == device)
            .filter_map(|row| row["method"].as_str())
            .collect();
        methods.sort_unstable();
        methods.dedup();
        methods.len()
    };
    assert_eq!((methods("cpu"), methods("gpu")), (7, 3));
    let mut inexact = 0.0;
    for row in rows {
        assert!(figure(row, "/time/wall/median") > 0.0 && figure(row, "/ns_per_pixel") > 0.0);
        let wrong = wrong(row, "/wrong");
        match row["method"].as_str().expect("a name") {
            "filter_only" | "full" | "exact" => assert_eq!(wrong, 0.0, "{row}"),
            "textbook" => inexact += wrong,
            _ => {}
        }
        if row["method"] == "full" {
            assert!(figure(row, "/depth_ulp") <= 0.51, "{row}");
        }
    }
    assert!(inexact > 100.0, "the textbook's quadratic is wrong at {inexact} pixels only");
    // Each device with and without bounds, on ten scenes.
    assert_eq!(report["price"].as_array().map(Vec::len), Some(20));
    let svg = std::fs::read_to_string(plot).unwrap();
    assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"));
    // One mark for each method and scene, each with its words.
    assert_eq!(svg.matches("<title>").count(), rows.len());
}

#[test]
fn accuracy_of_one_scene() {
    let args = [
        "accuracy",
        "--scene",
        "inside.toml",
        "--device",
        "cpu",
        "--size",
        "48x48",
        "--frames",
        "1",
    ];
    let table = String::from_utf8(bench(&args).stdout).unwrap();
    for words in [
        "inside.toml",
        "textbook f32",
        "shifted f32",
        "f64 alone",
        "filter alone",
        "full chain",
        "all exact",
    ] {
        assert!(table.contains(words), "{words}: {table}");
    }
}

#[cfg(unix)]
#[test]
fn processes_are_timed_in_turn() {
    let table = String::from_utf8(
        bench(&[
            "time",
            "--runs",
            "2",
            "--names",
            "first,second",
            "--",
            "true",
            ":::",
            "sleep",
            "0.05",
        ])
        .stdout,
    )
    .unwrap();
    let line = |name: &str| table.lines().find(|line| line.starts_with(name)).map(str::to_owned);
    let (first, second) = (line("first").expect("a line"), line("second").expect("a line"));
    assert!(first.contains(" 1.00"), "{first}");
    let wall: f64 = second.split_whitespace().nth(1).unwrap().parse().unwrap();
    assert!(wall >= 50.0, "{second}");
    for (args, code) in [
        (&["time", "--", "false"][..], 1),
        (&["time", "--", "true", ":::"], 2),
        (&["time", "--", "/none"], 2),
    ] {
        assert_eq!(bench(args).status.code(), Some(code), "{args:?}");
    }
}

#[test]
fn arguments_are_checked() {
    for args in [
        &["speed", "--frames", "0"][..],
        &["speed", "--max", "many"],
        &["speed", "--size", "20000x20000"],
        &["speed", "--scene", "none.toml"],
        &["accuracy", "--plot", "-"],
    ] {
        let output = bench(args);
        assert_eq!(
            output.status.code(),
            Some(2),
            "{args:?}: {}",
            String::from_utf8_lossy(&output.stderr)
        );
    }
}
