//! The proof that the tests prove something: a list of small faults, each of which a test must
//! find.
//!
//! A fault is data: `tests/faults/*.toml` say which text of which file becomes which other text,
//! and which test must fail then. Bounds are divided by eight, terms of bounds dropped, tie rules
//! turned round, short cuts taken too early.

use std::{
    collections::HashSet,
    fs,
    path::{Path, PathBuf},
};

/// One fault.
#[derive(Clone, Debug, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fault {
    /// What is wrong with it; no other fault has this name.
    pub name: String,
    /// The file, from the root of the repository.
    pub file: PathBuf,
    /// Text that is in the file once. White space between its characters does not count, so that
    /// a fault outlives a change of form.
    pub old: String,
    /// What it becomes.
    pub new: String,
    /// Arguments of `cargo test`: the test that must fail.
    pub test: String,
    /// `PLANISPHERE_CASE` of that test: the scenes of the corpus with this word in their names.
    #[serde(default)]
    pub case: String,
    /// One of the few that stand for their kind (`--few`).
    #[serde(default)]
    pub few: bool,
}

#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    fault: Vec<Fault>,
}

/// All faults of a folder, file by file in the order of their names.
///
/// # Errors
/// When a file cannot be read, is no list of faults, or two faults have one name; says which.
pub fn read(folder: &Path) -> Result<Vec<Fault>, String> {
    let entries = fs::read_dir(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let mut paths: Vec<PathBuf> = entries
        .filter_map(|entry| entry.ok().map(|entry| entry.path()))
        .filter(|path| path.extension().is_some_and(|extension| extension == "toml"))
        .collect();
    paths.sort();
    let mut faults = Vec::new();
    for path in paths {
        let here = |error: &dyn std::fmt::Display| format!("{}: {error}", path.display());
        let text = fs::read_to_string(&path).map_err(|error| here(&error))?;
        let file: File = toml::from_str(&text).map_err(|error| here(&error))?;
        faults.extend(file.fault);
    }
    let mut names = HashSet::new();
    match faults.iter().find(|fault| !names.insert(&fault.name)) {
        Some(twice) => Err(format!("two faults have the name `{}`", twice.name)),
        None => Ok(faults),
    }
}

impl Fault {
    /// The text of the file with the fault in it.
    ///
    /// # Errors
    /// How often the old text is there, if it is not there once; or when nothing changes.
    pub fn plant(&self, text: &str) -> Result<String, String> {
        let found = places(text, &self.old);
        let [(start, end)] = found[..] else {
            return Err(format!("`old` is there {} times, not once", found.len()));
        };
        // White space at the ends of `old` and `new` belongs to the text around.
        let planted = [&text[..start], self.new.trim(), &text[end..]].concat();
        if bare(&planted).eq(bare(text)) {
            return Err("`new` is the same as `old`".into());
        }
        Ok(planted)
    }
}

fn bare(text: &str) -> impl Iterator<Item = char> {
    text.chars().filter(|c| !c.is_whitespace())
}

/// Where a text begins and ends within another, white space left out of account.
fn places(text: &str, wanted: &str) -> Vec<(usize, usize)> {
    let wanted: Vec<char> = bare(wanted).collect();
    let solid: Vec<(usize, char)> =
        text.char_indices().filter(|(_, c)| !c.is_whitespace()).collect();
    if wanted.is_empty() {
        return Vec::new();
    }
    let here = |run: &&[(usize, char)]| run.iter().map(|(_, c)| c).eq(wanted.iter());
    solid
        .windows(wanted.len())
        .filter(here)
        .map(|run| {
            let (last, c) = run[run.len() - 1];
            (run[0].0, last + c.len_utf8())
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fault(old: &str, new: &str) -> Fault {
        let text = |text: &str| text.to_owned();
        Fault {
            name: text("n"),
            file: "f".into(),
            old: text(old),
            new: text(new),
            test: text("t"),
            case: text(""),
            few: false,
        }
    }

    #[test]
    fn a_fault_is_planted_whatever_the_form() {
        let text = "let a = one(\n    two,\n);\nlet b = 3;\n";
        assert_eq!(
            fault("one(two,)", "one(-two)").plant(text).unwrap(),
            "let a = one(-two);\nlet b = 3;\n"
        );
        assert_eq!(
            fault("\n  let b = 3;\n", "").plant(text).unwrap(),
            "let a = one(\n    two,\n);\n\n"
        );
    }

    #[test]
    fn what_cannot_be_planted_is_refused() {
        let refused = |old, new| fault(old, new).plant("a = 1; b = 1;").unwrap_err();
        assert!(refused("= 1", "= 2").contains("2 times"));
        assert!(refused("= 3", "= 2").contains("0 times"));
        assert!(refused(" ", "x").contains("0 times"));
        assert!(refused("a = 1", "a=1").contains("same"));
    }
}
