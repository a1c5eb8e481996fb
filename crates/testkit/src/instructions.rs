//! Instructions that a program executes in its own code, counted by valgrind: a measure that no
//! noise of the machine reaches.
//!
//! Only instructions of the program's own file count. What libraries do, the driver's compiler
//! among them, differs from machine to machine; so does the choice of vector width, but valgrind
//! knows no AVX-512, so that all machines with AVX2 take one way.

use std::{
    collections::BTreeMap,
    fs,
    io::{self, BufRead, BufReader},
    path::Path,
    process::{Command, Stdio},
};

/// Counts of frames by name.
pub type Counts = BTreeMap<String, u64>;

/// How far a count may be from the committed one, as a part of it.
pub const TOLERANCE: f64 = 0.02;

/// Counts what a program executes of its own code, with one thread.
///
/// # Errors
/// When valgrind is not there, or the program fails; its words.
pub fn count(program: &Path, arguments: &[&str], folder: &Path) -> Result<u64, String> {
    let profile =
        folder.join(format!("callgrind.{}", arguments.join("-").replace(['/', '.'], "_")));
    let output = Command::new("valgrind")
        .args(["--tool=callgrind", "--quiet"])
        .arg(format!("--callgrind-out-file={}", profile.display()))
        .arg(program)
        .args(arguments)
        .current_dir(folder)
        .env("RAYON_NUM_THREADS", "1")
        .env("LP_NUM_THREADS", "1")
        .stdin(Stdio::null())
        .output()
        .map_err(|error| format!("valgrind: {error}; apt-get install valgrind libc6-dbg"))?;
    if !output.status.success() {
        return Err(format!("{arguments:?}: {}", String::from_utf8_lossy(&output.stderr)));
    }
    let failed = |error: io::Error| format!("{}: {error}", profile.display());
    let file = fs::File::open(&profile).map_err(failed)?;
    let own = own_cost(BufReader::new(file), &program.display().to_string()).map_err(failed)?;
    fs::remove_file(&profile).map_err(failed)?;
    if own == 0 { Err(format!("{arguments:?}: nothing was counted")) } else { Ok(own) }
}

/// The cost of an object file in a profile, what it calls left out. The format is that of
/// valgrind's manual, "Callgrind Format Specification".
fn own_cost(profile: impl BufRead, object: &str) -> io::Result<u64> {
    // Names are given once, with a number: "ob=(3) /usr/lib/libm.so", later "ob=(3)".
    let mut numbers = BTreeMap::new();
    let (mut inside, mut called, mut total) = (false, false, 0);
    for line in profile.lines() {
        let line = line?;
        if let Some(name) = line.strip_prefix("ob=") {
            let (number, name) = name.split_once(' ').unwrap_or((name, ""));
            if !name.is_empty() {
                numbers.insert(number.to_owned(), name == object);
            }
            inside = numbers.get(number).copied().unwrap_or(false);
        } else if let Some(name) = line.strip_prefix("cob=") {
            // The object of a function that is called: named here, it may be meant by number later.
            if let Some((number, name)) = name.split_once(' ') {
                numbers.insert(number.to_owned(), name == object);
            }
        } else if line.starts_with("calls=") {
            // The next line is what the call costs inside.
            called = true;
        } else if line.starts_with(|c: char| c.is_ascii_digit() || "+-*".contains(c)) {
            let cost = line.split(' ').nth(1).and_then(|cost| cost.parse::<u64>().ok());
            if inside && !std::mem::take(&mut called) {
                total += cost.unwrap_or(0);
            }
            called = false;
        }
    }
    Ok(total)
}

/// Reads committed counts: a line for each frame, its name and its count. Lines that begin with `#`
/// say how they were made.
///
/// # Errors
/// The line that is none.
pub fn parse(text: &str) -> Result<Counts, String> {
    let lines = text.lines().filter(|line| !line.is_empty() && !line.starts_with('#'));
    lines
        .map(|line| {
            let (name, count) = line.rsplit_once(' ').ok_or(line)?;
            Ok((name.trim().to_owned(), count.parse().map_err(|_| line)?))
        })
        .collect::<Result<_, &str>>()
        .map_err(|line| format!("`{line}` is not a name and a count"))
}

/// How counts differ from the committed ones: a line for each frame, and whether all are near.
#[must_use]
pub fn compare(committed: &Counts, counted: &Counts) -> (String, bool) {
    let (mut text, mut near) = (String::new(), true);
    for name in committed.keys().chain(counted.keys().filter(|name| !committed.contains_key(*name)))
    {
        let words = match (committed.get(name), counted.get(name)) {
            (Some(&before), Some(&now)) => {
                let ratio = now as f64 / before as f64;
                let far = !((ratio - 1.0).abs() <= TOLERANCE);
                near &= !far;
                format!("{before:>14} {now:>14} {ratio:.4}{}", if far { "  FAR" } else { "" })
            }
            (before, _) => {
                near = false;
                if before.is_some() { "not counted".into() } else { "not committed".to_owned() }
            }
        };
        text += &format!("{name:<28} {words}\n");
    }
    (text, near)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn calls_and_other_files_are_left_out() {
        let profile = "\
version: 1
events: Ir
ob=(1) /bin/planisphere
fl=(1) a.rs
fn=(1) draw
10 100
+2 30
cob=(2) /lib/libm.so
cfn=(2) sqrt
calls=3 5
* 7000
12 5
ob=(2)
fn=(2)
1 7000
ob=(1)
fn=(3) end
* 1
";
        assert_eq!(own_cost(profile.as_bytes(), "/bin/planisphere").unwrap(), 136);
        assert_eq!(own_cost(profile.as_bytes(), "/lib/libm.so").unwrap(), 7000);
    }

    #[test]
    fn counts_that_are_far_are_told() {
        let committed = parse("# how\n\ncpu 1e3 1000\ngpu 1e3 500\n").unwrap();
        let with = |cpu: u64| Counts::from([("cpu 1e3".into(), cpu), ("gpu 1e3".into(), 500)]);
        assert!(compare(&committed, &with(1019)).1 && compare(&committed, &with(981)).1);
        assert!(!compare(&committed, &with(1021)).1 && !compare(&committed, &with(979)).1);
        assert!(!compare(&committed, &Counts::from([("cpu 1e3".into(), 1000)])).1);
        assert!(!compare(&Counts::new(), &with(1000)).1);
        assert!(parse("cpu\n").is_err() && parse("cpu x\n").is_err());
    }
}
