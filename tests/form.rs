//! The form of the sources: lines of at most 100 columns, functions of at most 80 lines.

use std::{
    fs,
    path::{Path, PathBuf},
};

/// Kinds of files whose lines are counted.
const KINDS: [&str; 6] = ["rs", "wgsl", "sh", "py", "toml", "cpp"];

/// Files that programs write.
const MADE: [&str; 1] = ["Cargo.lock"];

/// Every line of a kind of file under a folder that is longer than it should be.
fn long_lines(folder: &Path, most: usize, found: &mut Vec<String>) {
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        if path.is_dir() {
            if !["target", ".git"].contains(&name) {
                long_lines(&path, most, found);
            }
            continue;
        }
        let kind = path.extension().and_then(|kind| kind.to_str()).unwrap_or_default();
        let in_ci = path.parent().and_then(Path::file_name).is_some_and(|name| name == ".ci");
        if MADE.contains(&name) || !(KINDS.contains(&kind) || in_ci) {
            continue;
        }
        let text = fs::read_to_string(&path).expect("text");
        for (number, line) in text.lines().enumerate() {
            let length = line.chars().count();
            if length > most {
                found.push(format!("{}:{}: {length} columns", path.display(), number + 1));
            }
        }
    }
}

#[test]
fn lines_have_at_most_100_columns() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut found = Vec::new();
    long_lines(root, 100, &mut found);
    assert!(found.is_empty(), "break these lines:\n{}", found.join("\n"));
    // That lines are counted at all: of the line above many would be found.
    long_lines(&root.join("tests"), 60, &mut found);
    assert!(found.len() > 1000, "{} lines", found.len());
}

/// Lines of a function, from the one with its name to the one that closes it.
const MOST: usize = 80;

/// Functions that may be longer, and why: file, name.
const LONGER: [(&str, &str); 0] = [];

/// Every Rust file under a folder.
fn rust_files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            rust_files(&path, found);
        } else if path.extension().is_some_and(|kind| kind == "rs") {
            found.push(path);
        }
    }
}

/// The blanks before a line.
fn indentation(line: &str) -> usize {
    line.len() - line.trim_start().len()
}

/// The line that closes what begins at `start`, by its indentation: rustfmt keeps it.
fn end(lines: &[&str], start: usize) -> usize {
    let depth = indentation(lines[start]);
    let code = |line: &str| line.split(" //").next().unwrap_or_default().trim_end().to_owned();
    let opens = lines[start..].iter().position(|line| code(line).ends_with(['{', '}', ';']));
    let opens = start + opens.expect("a body, or none");
    if !code(lines[opens]).ends_with('{') {
        return opens;
    }
    let closes = |line: &&str| indentation(line) == depth && line.trim_start().starts_with('}');
    let closes = lines[opens + 1..].iter().position(closes);
    opens + 1 + closes.expect("a closing brace")
}

/// The name of the function that begins on a line, if one does.
fn function(line: &str) -> Option<&str> {
    let (before, behind) = line.trim_start().split_once("fn ")?;
    let is_before = |word: &str| {
        ["const", "async", "unsafe", "extern"].contains(&word)
            || word.starts_with("pub")
            || word.starts_with('"')
    };
    if !before.split_whitespace().all(is_before) {
        return None;
    }
    behind.split(|c: char| !c.is_alphanumeric() && c != '_').next().filter(|name| !name.is_empty())
}

/// The functions of a file, but for its tests, with their lengths in lines.
fn functions(text: &str) -> Vec<(&str, usize)> {
    let lines: Vec<&str> = text.lines().collect();
    let mut found = Vec::new();
    let mut at = 0;
    while at < lines.len() {
        let conditional = at > 0 && lines[at - 1].trim_start().starts_with("#[cfg(");
        if conditional && lines[at].trim_start() == "mod tests {" {
            at = end(&lines, at);
        } else if let Some(name) = function(lines[at]) {
            found.push((name, end(&lines, at) + 1 - at));
        }
        at += 1;
    }
    found
}

#[test]
fn functions_have_at_most_80_lines() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut files = Vec::new();
    rust_files(&root.join("src"), &mut files);
    rust_files(&root.join("shaders/src"), &mut files);
    for entry in fs::read_dir(root.join("crates")).expect("a folder") {
        rust_files(&entry.expect("an entry").path().join("src"), &mut files);
    }
    files.sort();
    let (mut long, mut counted) = (Vec::new(), 0);
    let mut needed = [false; LONGER.len()];
    for path in files {
        let text = fs::read_to_string(&path).expect("text");
        let file = path.strip_prefix(root).expect("inside").to_string_lossy().replace('\\', "/");
        for (name, length) in functions(&text) {
            counted += 1;
            if length <= MOST {
                continue;
            }
            match LONGER.iter().position(|longer| *longer == (file.as_str(), name)) {
                Some(place) => needed[place] = true,
                None => long.push(format!("{file}: {name}: {length} lines")),
            }
        }
    }
    assert!(counted > 1000, "{counted} functions");
    assert!(long.is_empty(), "split these functions:\n{}", long.join("\n"));
    for (longer, needed) in LONGER.iter().zip(needed) {
        assert!(needed, "take {longer:?} off the list: it is not longer than others");
    }
}

/// A file of which everything is known; `@` stands for lines.
const KNOWN: &str = r#"
/// Not fn this.
fn one() {}

pub(crate) const unsafe fn some(
    a: [u8; 3],
) -> [u8; 3] {
    a
}

trait Some {
    fn none(
        &self,
    ) -> u8;

    fn most(&self) {
        @78
    }

    async fn many(&self) { // as it is
        @79
    }
}

mod inner {
    extern "C" fn inside(f: fn(u8)) {
    }

    #[cfg(all(test, unix))]
    mod tests {
        fn hidden() {
            @99
        }
    }
}

fn behind() {
    fn within() {
    }
}

#[cfg(test)]
mod tests {
    fn hidden() {
        @99
    }
}
"#;

#[test]
fn lines_of_functions_are_counted() {
    let mut text = KNOWN.to_owned();
    for lines in [78, 79, 99] {
        text = text.replace(&format!("@{lines}\n"), &"work();\n".repeat(lines));
    }
    let lengths = [
        ("one", 1),
        ("some", 5),
        ("none", 3),
        ("most", 80),
        ("many", 81),
        ("inside", 2),
        ("behind", 4),
        ("within", 2),
    ];
    assert_eq!(functions(&text), lengths);
}
