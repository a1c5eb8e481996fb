//! A program of somebody else's, `tests/user`, in a workspace of its own: it builds, runs, and
//! weighs little. `benches/weight.sh` tells the figures.

use std::{
    collections::BTreeSet,
    fs,
    path::{Path, PathBuf},
    process::Command,
};

/// Bytes of the program without symbols, at most.
const HEAVY: u64 = 2_500_000;

/// Packages that a library without features is built from, its own included, as in
/// `tests/layers.rs`.
const PACKAGES: usize = 25;

/// Runs cargo on the user's manifest. Gives what it wrote to standard output.
fn cargo(arguments: &[&str]) -> String {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/user");
    let output = Command::new(env!("CARGO"))
        .args(arguments)
        .arg("--locked")
        .current_dir(folder)
        .env("CARGO_TARGET_DIR", target())
        .output()
        .expect("cargo");
    assert!(
        output.status.success(),
        "{}\nwhere the lock file is old: cargo update --workspace, in tests/user",
        String::from_utf8_lossy(&output.stderr)
    );
    String::from_utf8(output.stdout).expect("UTF-8")
}

/// A target folder of the user's, in ours.
fn target() -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join("user")
}

#[test]
fn a_program_of_a_stranger_runs_and_is_small() {
    cargo(&["build", "--release"]);
    let name = format!("planisphere-user{}", std::env::consts::EXE_SUFFIX);
    let program = target().join("release").join(name);
    let output = Command::new(&program).output().expect("the program");
    let said = String::from_utf8_lossy(&output.stdout);
    let complaint = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && complaint.is_empty(), "{said}{complaint}");
    assert!(
        said.lines().count() == 1 && said.ends_with("100001 spheres, drawn by cpu\n"),
        "{said}"
    );
    let size = fs::metadata(&program).expect("the program").len();
    assert!(size <= HEAVY, "{size} bytes");
}

#[test]
fn a_stranger_builds_no_other_packages() {
    let tree = |more: &[&str]| {
        let arguments = ["tree", "--edges", "normal", "--prefix", "none", "--format", "{p}"];
        let text = cargo(&[&arguments[..], more].concat());
        let packages = text.lines().map(|line| line.trim_end_matches(" (*)").to_owned());
        packages.collect::<BTreeSet<_>>()
    };
    let without = tree(&["--no-default-features"]);
    // And the program itself.
    assert!(without.len() <= PACKAGES + 1, "{} packages: {without:?}", without.len());
    // With vectors of others there are more, so that packages are counted.
    let with = tree(&[]);
    let glams = with.iter().filter(|package| package.starts_with("glam ")).count();
    assert!(with.is_superset(&without) && glams == 2, "{with:?}");
}
