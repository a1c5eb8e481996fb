//! The form of the sources: lines of at most 100 columns.

use std::{fs, path::Path};

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
