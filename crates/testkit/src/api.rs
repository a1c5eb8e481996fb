//! The public items of `planisphere` as its users see them, one a line, and how two lists of them
//! differ.
//!
//! The package passes on items of the crates below it, of which rustdoc's JSON says only where they
//! come from. So the lists of those crates are read as well, and each item that is passed on takes
//! the name that it is passed on by.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::Path,
};

use public_api::Builder;
use serde_json::Value;

/// What users name.
const FACADE: &str = "planisphere";

/// The crates whose items are looked up, by the names of their packages.
pub const PACKAGES: [&str; 4] =
    [FACADE, "planisphere-renderer", "planisphere-core", "planisphere-image"];

/// Traits of the compiler's own, which no stable program can name.
const UNSTABLE: [&str; 3] = ["Freeze", "StructuralPartialEq", "UnsafeUnpin"];

/// One crate, as rustdoc has written it down.
#[derive(Debug, Default)]
struct Crate {
    /// Its public items, grouped.
    lines: Vec<String>,
    /// Items of other crates at its root: their names there, and where they come from.
    passed_on: BTreeMap<String, String>,
}

impl Crate {
    fn read(path: &Path, name: &str) -> Result<Self, String> {
        let failed = |words: String| format!("{}: {words}", path.display());
        let api = Builder::from_rustdoc_json(path).omit_blanket_impls(true).build();
        let api = api.map_err(|error| failed(format!("{error}; is this Rust 1.95?")))?;
        let lines: Vec<_> = api.items().map(ToString::to_string).collect();
        let text = fs::read_to_string(path).map_err(|error| failed(error.to_string()))?;
        let json = serde_json::from_str(&text).map_err(|error| failed(error.to_string()))?;
        let mut passed_on = uses(&json).ok_or_else(|| failed("no root module".into()))?;
        // Those of its own modules are listed as items.
        passed_on.retain(|item, _| lines.contains(&format!("pub use {name}::{item}")));
        Ok(Self { lines, passed_on })
    }

    /// The lines of an item and of all that is in it, without what says nothing to users.
    fn lines_of(&self, name: &str, path: &str) -> Vec<String> {
        let inside = |line: &&String| {
            let own = own_path(line, name);
            own.strip_prefix(path).is_some_and(|rest| rest.is_empty() || rest.starts_with("::"))
        };
        let mut found: Vec<String> = Vec::new();
        // The type that has a trait, whose functions follow: they are known by the trait's name.
        let mut with_trait = None;
        for line in self.lines.iter().filter(inside) {
            let own = own_path(line, name);
            if line.starts_with("impl") {
                with_trait = line.contains(" for ").then_some(own);
            }
            let of_trait = line.starts_with("pub fn ")
                && with_trait.is_some_and(|of| own.strip_prefix(of).is_some());
            if !(of_trait || is_noise(line) || found.contains(line)) {
                found.push(line.clone());
            }
        }
        found
    }
}

/// What is passed on at the root of a crate: names, and their sources.
fn uses(json: &Value) -> Option<BTreeMap<String, String>> {
    let index = json.get("index")?;
    let item = |id: &Value| index.get(id.to_string());
    let root = item(json.get("root")?)?.pointer("/inner/module/items")?.as_array()?;
    let found = root.iter().filter_map(|id| {
        let used = item(id)?.pointer("/inner/use")?;
        let text = |key: &str| Some(used.get(key)?.as_str()?.to_owned());
        Some((text("name")?, text("source")?))
    });
    Some(found.collect())
}

/// The path of the item that a line is about: the type of an `impl`, or what is declared.
fn own_path<'a>(line: &'a str, name: &str) -> &'a str {
    let start = format!("{name}::");
    let subject = match line.split_once(" for ") {
        Some((_, subject)) if line.starts_with("impl") && subject.starts_with(&start) => subject,
        _ => &line[line.find(&start).unwrap_or(line.len())..],
    };
    let ends = |c: char| !(c.is_alphanumeric() || c == '_' || c == ':');
    subject[..subject.find(ends).unwrap_or(subject.len())].trim_end_matches(':')
}

/// Whether a line tells nothing: a block of functions that are listed, or a trait without a use.
fn is_noise(line: &str) -> bool {
    let Some(rest) = line.strip_prefix("impl ") else {
        return line.starts_with("impl<") && of_compiler(line);
    };
    !rest.contains(" for ") || of_compiler(line)
}

fn of_compiler(line: &str) -> bool {
    UNSTABLE.iter().any(|name| line.contains(&format!("core::marker::{name} for ")))
}

/// A path in other words, wherever a text has it as a whole.
fn renamed(text: &str, from: &str, to: &str) -> String {
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    let (mut done, mut rest) = (String::new(), text);
    while let Some(at) = rest.find(from) {
        let (before, behind) = (&rest[..at], &rest[at + from.len()..]);
        let whole = !before.ends_with(|c| is_word(c) || c == ':') && !behind.starts_with(is_word);
        done += before;
        done += if whole { to } else { from };
        rest = behind;
    }
    done + rest
}

/// All public items of the package, from the folder where rustdoc has written its JSON. `versions`
/// gives the version of a package that is passed on as a whole: it is part of what users see.
///
/// # Errors
/// When a file is missing or of another format, or an item is not where it is said to be.
pub fn list(
    folder: &Path,
    versions: impl Fn(&str) -> Option<String>,
) -> Result<Vec<String>, String> {
    let mut crates = BTreeMap::new();
    for package in PACKAGES {
        let name = package.replace('-', "_");
        crates.insert(name.clone(), Crate::read(&folder.join(format!("{name}.json")), &name)?);
    }
    let (mut all, mut names) = (vec![format!("pub mod {FACADE}")], Vec::new());
    for name in crates[FACADE].passed_on.keys() {
        let mut path = format!("{FACADE}::{name}");
        let home = loop {
            let Some((home, item)) = path.split_once("::") else { break None };
            match crates.get(home).map(|home| home.passed_on.get(item)) {
                Some(Some(source)) => path = source.clone(),
                Some(None) => break Some(home.to_owned()),
                None => break None,
            }
        };
        let lines = match home {
            Some(home) => crates[&home].lines_of(&home, &path),
            None => {
                let version = versions(name).map_or(String::new(), |version| format!(" {version}"));
                vec![format!("pub use {path}{version}")]
            }
        };
        if lines.is_empty() {
            return Err(format!("{FACADE}::{name}: there is no {path}"));
        }
        all.extend(lines);
        names.push((path, format!("{FACADE}::{name}")));
    }
    for line in &mut all {
        *line = names.iter().fold(line.clone(), |line, (from, to)| renamed(&line, from, to));
    }
    Ok(all)
}

/// How a list differs from an earlier one.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Changes {
    /// Lines that programs may break by, with `-` or `+`: what went or changed, and what was added
    /// to an enum or struct that users may list in full.
    pub breaking: Vec<String>,
    /// Lines that are new besides.
    pub additions: Vec<String>,
}

impl Changes {
    /// Of two lists; comments, which begin with `# `, are passed over.
    pub fn between(before: &[&str], after: &[&str]) -> Self {
        let set = |lines: &[&str]| -> BTreeSet<String> {
            let lines = lines.iter().filter(|line| !line.starts_with("# ") && !line.is_empty());
            lines.map(|line| (*line).to_owned()).collect()
        };
        let (before, after) = (set(before), set(after));
        let mut changes = Self::default();
        changes.breaking.extend(before.difference(&after).map(|line| format!("- {line}")));
        for line in after.difference(&before) {
            let added = format!("+ {line}");
            if extends(line, &before) {
                changes.breaking.push(added);
            } else {
                changes.additions.push(added);
            }
        }
        changes
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.breaking.is_empty() && self.additions.is_empty()
    }
}

/// Whether a line adds a variant or a field to something that was there and open to users.
fn extends(line: &str, before: &BTreeSet<String>) -> bool {
    // `pub planisphere::Sphere::radius: f64`: no word between.
    let Some((parent, _)) = own_path(line, FACADE).rsplit_once("::") else { return false };
    let open = ["enum ", "struct ", ""].map(|kind| format!("pub {kind}{parent}"));
    line.starts_with(&format!("pub {FACADE}::")) && open.iter().any(|open| before.contains(open))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_about_one_item() {
        for (line, path) in [
            ("pub fn a::b::C::d(&self, &a::E) -> a::F", "a::b::C::d"),
            ("#[non_exhaustive] pub struct a::C", "a::C"),
            ("pub a::C::d: a::E", "a::C::d"),
            ("impl<'a> core::marker::Send for a::C<'a>", "a::C"),
            ("impl core::iter::FromIterator<a::B> for a::C", "a::C"),
            ("impl core::convert::From<a::B> for std::io::Error", "a::B"),
            ("impl<T: core::marker::Send> a::C<T>", "a::C"),
            ("pub fn other(u8)", ""),
        ] {
            assert_eq!(own_path(line, "a"), path, "{line}");
        }
    }

    #[test]
    fn only_whole_paths_are_renamed() {
        let text = "a::Part a::Parts b::a::Part (&a::Part) a::Part::new a::Part: u8";
        let text = renamed(text, "a::Part", "c::Part");
        assert_eq!(text, "c::Part a::Parts b::a::Part (&c::Part) c::Part::new c::Part: u8");
    }

    #[test]
    fn what_is_passed_on_is_read() {
        let json = r#"{"root": 0, "index": {
            "0": {"inner": {"module": {"items": [1, 2, 7]}}},
            "1": {"inner": {"use": {"name": "A", "source": "b::A"}}},
            "2": {"inner": {"struct": {}}}
        }}"#;
        let found = uses(&serde_json::from_str(json).unwrap()).unwrap();
        assert_eq!(found, BTreeMap::from([("A".into(), "b::A".into())]));
        assert_eq!(uses(&Value::Null), None);
    }

    #[test]
    fn functions_of_traits_are_left_out() {
        let lines = [
            "pub struct a::C",
            "impl a::C",
            "pub fn a::C::new() -> Self",
            "impl core::clone::Clone for a::C",
            "pub fn a::C::clone(&self) -> a::C",
            "impl core::str::FromStr for a::C",
            "pub type a::C::Err = u8",
            "impl<T> core::ops::drop::Drop for a::C<T>",
            "pub fn a::C<T>::drop(&mut self)",
            "impl core::marker::Freeze for a::C",
            "pub struct a::Cc",
        ];
        let of = Crate { lines: lines.map(str::to_owned).into(), ..Crate::default() };
        let kept = [0, 2, 3, 5, 6, 7].map(|line| lines[line]);
        assert_eq!(of.lines_of("a", "a::C"), kept);
        assert_eq!(of.lines_of("a", "a::D"), [""; 0]);
    }

    #[test]
    fn changes_that_break_are_told_from_others() {
        let before = [
            "# how it is made",
            "pub struct planisphere::Sphere",
            "pub planisphere::Sphere::radius: f64",
            "#[non_exhaustive] pub enum planisphere::Device",
            "pub enum planisphere::Kind",
            "pub fn planisphere::read(u8)",
        ];
        let same = Changes::between(&before, &before[1..]);
        assert!(same.is_empty(), "{same:?}");
        let mut after = before.to_vec();
        after[5] = "pub fn planisphere::read(u16)";
        after.extend([
            "pub planisphere::Sphere::color: u8",
            "pub planisphere::Kind::Other",
            "pub planisphere::Device::Other",
            "pub fn planisphere::Sphere::new() -> Self",
        ]);
        let changes = Changes::between(&before, &after);
        let breaking = [
            "- pub fn planisphere::read(u8)",
            "+ pub planisphere::Kind::Other",
            "+ pub planisphere::Sphere::color: u8",
        ];
        let additions = [
            "+ pub fn planisphere::Sphere::new() -> Self",
            "+ pub fn planisphere::read(u16)",
            "+ pub planisphere::Device::Other",
        ];
        assert_eq!(changes.breaking, breaking);
        assert_eq!(changes.additions, additions);
    }
}
