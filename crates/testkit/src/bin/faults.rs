//! Plants faults into a copy of the sources, and runs the test that must find each.
//!
//! ```sh
//! cargo run --release -p planisphere-testkit --bin faults              # all: an hour on two cores
//! cargo run --release -p planisphere-testkit --bin faults -- --few     # one of each kind
//! cargo run --release -p planisphere-testkit --bin faults -- --sample 40
//! cargo run --release -p planisphere-testkit --bin faults -- WORD...   # by words of their names
//! cargo run --release -p planisphere-testkit --bin faults -- --check   # plants none: can they be?
//! ```
//!
//! The copy lies in `target/faults/tree` and has a target folder of its own, so that a fault costs
//! the build of the crates that it touches. A fault that no test finds fails this program; so does
//! one that cannot be planted, or whose test gives no answer.

use std::{
    fs,
    path::Path,
    process::{Command, ExitCode, Stdio},
    time::Duration,
};

use planisphere_testkit::faults::{self, Fault};

/// A test that takes longer than this gives no answer.
const LIMIT: Duration = Duration::from_secs(900);

/// Which faults are planted.
enum Choice {
    All,
    Few,
    /// So many, spread evenly over the list.
    Sample(usize),
    /// Those whose names have one of these words.
    Words(Vec<String>),
}

/// What became of a fault.
enum Outcome {
    Found(String),
    Survived,
    NoAnswer(String),
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let done = match words[..] {
        ["--check"] => check(),
        [] => choose(&Choice::All),
        ["--few"] => choose(&Choice::Few),
        ["--sample", count] => match count.parse() {
            Ok(count) if count > 0 => choose(&Choice::Sample(count)),
            _ => Err(format!("--sample {count}: a number from 1 is needed")),
        },
        [option, ..] if option.starts_with('-') => {
            Err(format!("{option}: there are --check, --few, --sample N and words of names"))
        }
        _ => choose(&Choice::Words(arguments)),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(words) => {
            eprintln!("faults: {words}");
            ExitCode::FAILURE
        }
    }
}

/// All faults, each of which was planted into a text: so it can be.
fn plantable() -> Result<Vec<Fault>, String> {
    let faults = faults::read(Path::new("tests/faults"))
        .map_err(|words| format!("{words}\nrun this from the root of the repository"))?;
    let mut wrong = Vec::new();
    for fault in &faults {
        let planted = fs::read_to_string(&fault.file).map_err(|error| error.to_string());
        if let Err(words) = planted.and_then(|text| fault.plant(&text)) {
            wrong.push(format!("{}: `{}`: {words}", fault.file.display(), fault.name));
        }
    }
    if wrong.is_empty() {
        Ok(faults)
    } else {
        Err(format!("not to be planted:\n{}", wrong.join("\n")))
    }
}

fn check() -> Result<(), String> {
    let count = plantable()?.len();
    println!("{count} faults can be planted");
    Ok(())
}

fn choose(choice: &Choice) -> Result<(), String> {
    let all = plantable()?;
    let many = all.len();
    let chosen: Vec<Fault> = all
        .into_iter()
        .enumerate()
        .filter(|(at, fault)| match choice {
            Choice::All => true,
            Choice::Few => fault.few,
            Choice::Sample(count) => at * count / many != (at + 1) * count / many,
            Choice::Words(words) => words.iter().any(|word| fault.name.contains(word)),
        })
        .map(|(_, fault)| fault)
        .collect();
    if chosen.is_empty() {
        return Err("no fault has such a name".into());
    }
    plant(&chosen)
}

fn plant(faults: &[Fault]) -> Result<(), String> {
    let folder = std::env::current_dir().map_err(|error| error.to_string())?.join("target/faults");
    let tree = folder.join("tree");
    copy_sources(&tree)?;
    let (mut survived, mut unanswered) = (Vec::new(), Vec::new());
    for fault in faults {
        let outcome =
            try_fault(fault, &folder).map_err(|error| format!("`{}`: {error}", fault.name))?;
        let words = match outcome {
            Outcome::Found(test) => format!("found: {test}"),
            Outcome::Survived => {
                survived.push(fault.name.as_str());
                "SURVIVED".into()
            }
            Outcome::NoAnswer(why) => {
                unanswered.push(fault.name.as_str());
                format!("NO ANSWER: {why}")
            }
        };
        println!("{:<58} {:<44} {words}", fault.name, fault.test);
    }
    println!("{} of {} found", faults.len() - survived.len() - unanswered.len(), faults.len());
    if survived.is_empty() && unanswered.is_empty() {
        return Ok(());
    }
    Err(format!("survived: {survived:?}; no answer: {unanswered:?}"))
}

/// Copies the sources as they are here, changes included. Files that are the same keep their age,
/// for cargo's sake, and files that are gone here go there too.
fn copy_sources(tree: &Path) -> Result<(), String> {
    let failed = |error: std::io::Error| error.to_string();
    let listed = Command::new("git")
        .args(["ls-files", "-z", "--cached", "--others", "--exclude-standard"])
        .output()
        .map_err(failed)?;
    let names = String::from_utf8(listed.stdout).map_err(|error| error.to_string())?;
    let here: Vec<&str> = names.split('\0').filter(|name| Path::new(name).is_file()).collect();
    fs::create_dir_all(tree).map_err(failed)?;
    let mut folders = vec![tree.to_path_buf()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).map_err(failed)? {
            let path = entry.map_err(failed)?.path();
            let name = path.strip_prefix(tree).map_err(|error| error.to_string())?;
            if path.is_dir() {
                folders.push(path);
            } else if !here.iter().any(|kept| Path::new(kept) == name) {
                fs::remove_file(&path).map_err(failed)?;
            }
        }
    }
    for name in here {
        let (from, to) = (Path::new(name), tree.join(name));
        let text = fs::read(from).map_err(failed)?;
        if fs::read(&to).is_ok_and(|there| there == text) {
            continue;
        }
        to.parent().map_or(Ok(()), fs::create_dir_all).map_err(failed)?;
        fs::copy(from, &to).map_err(failed)?;
    }
    Ok(())
}

/// Plants one, runs its test, and takes it out again.
fn try_fault(fault: &Fault, folder: &Path) -> std::io::Result<Outcome> {
    let path = folder.join("tree").join(&fault.file);
    let original = fs::read_to_string(&path)?;
    fs::write(&path, fault.plant(&original).map_err(std::io::Error::other)?)?;
    let outcome = run_test(fault, folder);
    fs::write(&path, original)?;
    outcome
}

fn run_test(fault: &Fault, folder: &Path) -> std::io::Result<Outcome> {
    let log = folder.join("log");
    let file = fs::File::create(&log)?;
    let mut child = Command::new("timeout")
        .arg(LIMIT.as_secs().to_string())
        .args(["cargo", "test", "--release", "--locked", "--all-features"])
        .args(fault.test.split_whitespace())
        .current_dir(folder.join("tree"))
        .env("CARGO_TARGET_DIR", folder.join("build"))
        .env("CARGO_INCREMENTAL", "1")
        .env("CARGO_PROFILE_RELEASE_DEBUG", "false")
        .env("PLANISPHERE_CASE", &fault.case)
        .stdin(Stdio::null())
        .stdout(file.try_clone()?)
        .stderr(file)
        .spawn()?;
    let passed = child.wait()?.success();
    let text = String::from_utf8_lossy(&fs::read(&log)?).into_owned();
    let line = |is: &dyn Fn(&str) -> bool| text.lines().find(|line| is(line)).map(str::to_owned);
    Ok(if passed {
        Outcome::Survived
    } else if line(&|line| line.starts_with("test result: FAILED")).is_some() {
        let failed = line(&|line| line.starts_with("test ") && line.ends_with("FAILED"));
        Outcome::Found(failed.unwrap_or_default())
    } else {
        let why = |line: &str| line.starts_with("error") || line.contains("panicked");
        Outcome::NoAnswer(line(&why).unwrap_or_else(|| format!("see {}", log.display())))
    })
}
