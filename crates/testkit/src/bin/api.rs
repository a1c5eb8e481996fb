//! Holds the public items of `planisphere` against `docs/api.txt`.
//!
//! ```sh
//! cargo run --release -p planisphere-testkit --bin api
//! cargo run --release -p planisphere-testkit --bin api -- --bless         # a change is meant
//! cargo run --release -p planisphere-testkit --bin api -- --since v0.1.0  # since a release
//! ```
//!
//! Rustdoc of Rust 1.95 writes them down as JSON, whose format is not yet stable: the compiler is
//! told to let it, in a target folder of its own. Any difference fails, and is told in two lists:
//! what programs may break by, and what is new besides. `--since` tells the same of a commit's list
//! and does not fail: what breaks needs another version.
//!
//! `cargo semver-checks` is of no use here. It reads one crate's JSON only, and what this package
//! passes on comes from others: <https://github.com/obi1kenobi/cargo-semver-checks/issues/638>.

use std::{
    fs,
    path::PathBuf,
    process::{Command, ExitCode},
};

use planisphere_testkit::api::{self, Changes};

/// Where the committed list is.
const COMMITTED: &str = "docs/api.txt";

/// The features of the library, without those of the program.
const FEATURES: &str = "planisphere/files,planisphere/gpu,planisphere/parts,planisphere/png,\
                        planisphere/read";

const HEAD: &str = "\
# The public items of planisphere, with the features files, gpu, parts, png and read (Rust 1.95).
# cargo run --release -p planisphere-testkit --bin api -- --bless
# Functions of a trait are known by its name, and not listed.
";

const FIX: &str = "is not what the sources say: if a change is meant, --bless, and tell it in \
                   CHANGELOG.md";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let result = match words[..] {
        [] | ["--check"] => check(),
        ["--bless"] => bless(),
        ["--since", revision] => since(revision),
        _ => Err("there are --check, --bless, and --since REVISION".into()),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(words) => {
            eprintln!("api: {words}");
            ExitCode::FAILURE
        }
    }
}

/// What the sources say.
fn listed() -> Result<Vec<String>, String> {
    let target = std::env::var_os("CARGO_TARGET_DIR").map_or("target".into(), PathBuf::from);
    let target = target.join("api");
    let cargo = std::env::var_os("CARGO").unwrap_or("cargo".into());
    let mut command = Command::new(cargo);
    command.args(["doc", "--quiet", "--locked", "--no-deps", "--lib", "--no-default-features"]);
    command.args(["--features", FEATURES]).arg("--target-dir").arg(&target);
    command.args(api::PACKAGES.iter().flat_map(|package| ["--package", package]));
    command.env("RUSTC_BOOTSTRAP", "1");
    command.env("RUSTDOCFLAGS", "-Z unstable-options --output-format json");
    let status = command.status().map_err(|error| format!("cargo: {error}"))?;
    if !status.success() {
        return Err("cargo doc failed".into());
    }
    let manifest = fs::read_to_string("Cargo.toml").map_err(|error| error.to_string())?;
    let manifest: toml::Table = manifest.parse().map_err(|error| format!("{error}"))?;
    api::list(&target.join("doc"), |package| version(&manifest, package))
}

/// The version of a package that the workspace asks for.
fn version(manifest: &toml::Table, package: &str) -> Option<String> {
    let package = manifest.get("workspace")?.get("dependencies")?.get(package)?;
    package.get("version").unwrap_or(package).as_str().map(str::to_owned)
}

fn committed() -> Result<String, String> {
    fs::read_to_string(COMMITTED).map_err(|error| format!("{COMMITTED}: {error}; --bless"))
}

fn check() -> Result<(), String> {
    let (committed, listed) = (committed()?, listed()?);
    if tell(&committed, &listed) {
        println!("{} public items", listed.len());
        return Ok(());
    }
    Err(format!("{COMMITTED} {FIX}"))
}

fn bless() -> Result<(), String> {
    let listed = listed()?;
    let lines: String = listed.iter().map(|line| format!("{line}\n")).collect();
    if let Ok(before) = committed() {
        tell(&before, &listed);
    }
    fs::write(COMMITTED, format!("{HEAD}{lines}")).map_err(|error| format!("{COMMITTED}: {error}"))
}

fn since(revision: &str) -> Result<(), String> {
    let before = Command::new("git")
        .args(["show", &format!("{revision}:{COMMITTED}")])
        .output()
        .map_err(|error| format!("git: {error}"))?;
    if !before.status.success() {
        return Err(String::from_utf8_lossy(&before.stderr).trim_end().to_owned());
    }
    if tell(&String::from_utf8_lossy(&before.stdout), &listed()?) {
        println!("the same items as in {revision}");
    }
    Ok(())
}

/// Prints how what is listed differs; whether it is the same.
fn tell(before: &str, listed: &[String]) -> bool {
    let before: Vec<&str> = before.lines().collect();
    let listed: Vec<&str> = listed.iter().map(String::as_str).collect();
    let changes = Changes::between(&before, &listed);
    for (title, lines) in [
        ("programs may break by these:", &changes.breaking),
        ("these are new:", &changes.additions),
    ] {
        if !lines.is_empty() {
            println!("{title}\n{}", lines.join("\n"));
        }
    }
    changes.is_empty()
}
