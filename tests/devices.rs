//! Which device is taken and what is said about the others, as a person meets it: drivers that are
//! not there, that do not load, names that nobody has. The choice among all kinds of adapters is
//! tested where it is made (`crates/gpu/src/adapters.rs`).
//!
//! A driver that crashes while it is asked for its adapters takes the process with it: that is not
//! tried here.

use std::{
    fs,
    path::Path,
    process::{Command, Output, Stdio},
};

use serde_json::Value;
use tempfile::TempDir;

const SCENE: &str =
    "[image]\nwidth = 16\nheight = 16\n[[sphere]]\ncenter = [5, 0, 0]\nradius = 1\n";

fn folder() -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("scene.toml"), SCENE).expect("it can be written");
    folder
}

fn run(folder: &Path, drivers: Option<&str>, args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_planisphere"));
    command.current_dir(folder).args(args).stdin(Stdio::null());
    if let Some(drivers) = drivers {
        command.env_remove("VK_ICD_FILENAMES").env("VK_DRIVER_FILES", drivers);
    }
    command.output().expect("the program runs")
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// What `render --stats` says.
fn stats(folder: &Path, device: &str) -> (Value, String) {
    let output =
        run(folder, None, &["render", "scene.toml", "-o", "none", "--stats", "--device", device]);
    assert!(output.status.success(), "{}", said(&output));
    (serde_json::from_slice(&output.stdout).expect("JSON"), said(&output))
}

#[test]
fn statistics_say_why_a_device_was_taken() {
    let folder = folder();
    for device in ["cpu", "gpu", "auto"] {
        let (stats, said) = stats(folder.path(), device);
        let why = stats["device_why"].as_str().expect("words");
        let passed = stats["passed_over"].as_array().expect("a list");
        for other in passed {
            for key in ["adapter", "why"] {
                assert!(other[key].as_str().is_some_and(|words| !words.is_empty()), "{stats}");
            }
        }
        let hardware = passed.iter().any(|other| other["hardware"] == true);
        if device == "auto" {
            assert!(why.contains("hardware GPU"), "{stats}");
            assert!(said.contains(why), "what is in the statistics is said: {said}");
            assert!(!hardware || !why.contains("was found"), "{stats}");
        } else if !hardware {
            assert_eq!((why, said.contains("device:")), ("as asked for", false), "{said}");
        }
    }
}

#[cfg(target_os = "linux")]
#[test]
fn drivers_that_do_not_load_are_named_with_the_variable() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name).display().to_string();
    let icd = |library: &str| {
        format!(
            "{{\"file_format_version\": \"1.0.0\", \"ICD\": {{\"library_path\": \"{library}\", \
             \"api_version\": \"1.3.0\"}}}}"
        )
    };
    for (name, text) in [
        ("empty.json", String::new()),
        ("text.json", "no JSON".into()),
        ("other.json", "{\"layer\": 1}".into()),
        ("gone.json", icd("/no/such/libvulkan_driver.so")),
        ("text-library.json", icd(&at("text.json"))),
        ("no-driver.json", icd("libm.so.6")),
    ] {
        fs::write(at(name), text).expect("it can be written");
    }
    let absent = at("absent.json");
    let mut files: Vec<String> = ["empty", "text", "other", "gone", "text-library", "no-driver"]
        .map(|name| at(&format!("{name}.json")))
        .into();
    files.extend([
        absent.clone(),
        format!("{}:{absent}", at("text.json")),
        "relative.json".into(),
        "::".into(),
    ]);
    for drivers in &files {
        let output = run(
            folder.path(),
            Some(drivers),
            &["render", "scene.toml", "-o", "none", "--stats", "--device", "gpu"],
        );
        let said = said(&output);
        assert_eq!(output.status.code(), Some(3), "{drivers}: {said}");
        for words in
            ["no adapter answered", &format!("VK_DRIVER_FILES={drivers} is set"), "--device cpu"]
        {
            assert!(said.contains(words), "{drivers} lacks {words:?}: {said}");
        }
        assert_eq!(
            said.contains(&format!("{absent} is not there")),
            drivers.contains("absent"),
            "{said}"
        );
        assert!(!said.contains("panicked"), "{said}");
        // `info` lists what there is, and says the same; `auto` draws.
        let info = run(folder.path(), Some(drivers), &["info"]);
        let text = String::from_utf8_lossy(&info.stdout).into_owned();
        assert!(
            info.status.success() && text.contains(&format!("VK_DRIVER_FILES={drivers} is set")),
            "{text}"
        );
        let auto = run(folder.path(), Some(drivers), &["render", "scene.toml", "-o", "auto.png"]);
        assert!(
            auto.status.success() && folder.path().join("auto.png").exists(),
            "{}",
            self::said(&auto)
        );
    }
}

#[test]
fn names_that_nobody_has_list_who_is_there() {
    let folder = folder();
    for name in ["no such adapter", "GeForce GTX 0", "llvmpipe 0"] {
        let output = run(
            folder.path(),
            None,
            &["render", "scene.toml", "-o", "none", "--stats", "--device", name],
        );
        let said = said(&output);
        assert_eq!(output.status.code(), Some(3), "{said}");
        assert!(said.contains(&format!("no GPU whose name contains \"{name}\"")), "{said}");
        assert!(said.contains(": another name") || said.contains("no adapter answered"), "{said}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn info_names_software_drivers_for_tests() {
    let folder = folder();
    let text = String::from_utf8(run(folder.path(), None, &["info"]).stdout).expect("text");
    for words in ["SwiftShader", "chromium-common", "VK_DRIVER_FILES", "mesa-vulkan-drivers"] {
        assert!(text.contains(words), "{text}");
    }
}
