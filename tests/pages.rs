//! The pages on looks and on scene files: every command that they show is run.

#![cfg(unix)]

use std::{fs, path::Path, process::Command};

/// Lines of the blocks of a page that are of some language.
fn blocks(page: &str, language: &str) -> Vec<String> {
    let (mut inside, mut lines) = (false, Vec::new());
    for line in page.lines() {
        match line.strip_prefix("```") {
            Some(start) => inside = !inside && start == language,
            None if inside => lines.push(line.to_owned()),
            None => {}
        }
    }
    lines
}

/// Runs the commands of a page, in a folder with the examples and the samples; how many there were.
fn run(name: &str, folder: &Path, page: &str) -> usize {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    for beside in ["tests", "scenes"] {
        std::os::unix::fs::symlink(root.join(beside), folder.join(beside)).expect("a link");
    }
    let program = Path::new(env!("CARGO_BIN_EXE_planisphere")).parent().expect("a folder");
    let path = format!("{}:{}", program.display(), std::env::var("PATH").unwrap_or_default());
    let commands = blocks(page, "sh");
    for command in &commands {
        let mut shell = Command::new("sh");
        shell.args(["-c", &format!("set -e; {command}")]).current_dir(folder).env("PATH", &path);
        let output = shell.output().expect("a shell");
        let message = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{name}: {command}: {message}");
        if let Some((_, picture)) = command.rsplit_once(" -o ") {
            let bytes = fs::read(folder.join(picture)).expect("a picture");
            let image = image::load_from_memory(&bytes);
            // What the decoder here does not know is looked at by its beginning.
            let known = image.is_ok_and(|image| image.width() > 0)
                || bytes.starts_with(b"RIFF")
                || bytes.starts_with(b"II*\0");
            assert!(known, "{command}: no picture");
        }
    }
    commands.len()
}

#[test]
fn looks() {
    let page = include_str!("../docs/looks.md");
    let folder = tempfile::tempdir().expect("a folder");
    assert!(run("looks", folder.path(), page) >= 14);
    let at = |name: &str| fs::read(folder.path().join(name)).expect("a picture");
    // Each of these changes the picture.
    let names =
        ["flat", "matte", "soft", "illustrative", "smooth", "encoded", "lines", "all-lines"];
    let pictures = names.map(|name| at(&format!("{name}.png")));
    for (k, one) in pictures.iter().enumerate() {
        let same = pictures[..k].iter().position(|other| other == one);
        assert_eq!(same, None, "{}", names[k]);
    }
}

#[test]
fn scene_files() {
    let page = include_str!("../docs/scene-file.md");
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("scene.toml"), blocks(page, "toml").join("\n")).expect("a file");
    assert!(run("scene file", folder.path(), page) >= 4);
}
