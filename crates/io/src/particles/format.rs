//! Which formats there are, what they are called, and how they are told apart.

use std::path::Path;

use super::{Data, Reader};
use crate::load::report::Fault;

/// A format of particles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Format {
    /// LAMMPS dump, as text.
    #[cfg(feature = "lammps")]
    Dump,
}

/// All that is known of a format before one of its files is opened.
struct About {
    format: Format,
    /// What it is called, for `--format`.
    name: &'static str,
    /// What it is called in sentences.
    title: &'static str,
    /// Endings of its files' names, in lower case.
    endings: &'static [&'static str],
    /// Whether bytes begin as its files do. Those of two formats do not begin alike.
    is: fn(&[u8]) -> bool,
    open: fn(&Data) -> Result<Box<dyn Reader>, Fault>,
}

/// A line for each format, in the order in which they are looked for.
const ALL: &[About] = &[
    #[cfg(feature = "lammps")]
    About {
        format: Format::Dump,
        name: "dump",
        title: "LAMMPS dump",
        endings: &["dump", "lammpstrj", "lammpsdump"],
        is: super::dump::is,
        open: super::dump::open,
    },
];

impl Format {
    /// All of them.
    pub fn all() -> impl Iterator<Item = Self> {
        ALL.iter().map(|about| about.format)
    }

    fn about(self) -> &'static About {
        ALL.iter().find(|about| about.format == self).expect("each format has its line")
    }

    /// What it is called, for `--format`.
    pub fn name(self) -> &'static str {
        self.about().name
    }

    /// What it is called in sentences.
    pub fn title(self) -> &'static str {
        self.about().title
    }

    /// The format of a name of `--format`.
    pub fn named(name: &str) -> Option<Self> {
        ALL.iter().find(|about| about.name.eq_ignore_ascii_case(name)).map(|about| about.format)
    }

    /// The format that a file's name speaks of; of what is compressed that of the name within.
    pub fn of_path(path: &Path) -> Option<Self> {
        let mut path = path.to_path_buf();
        let mut ending = path.extension()?.to_str()?.to_ascii_lowercase();
        if ["gz", "bz2", "xz", "zst"].contains(&ending.as_str()) {
            path.set_extension("");
            ending = path.extension()?.to_str()?.to_ascii_lowercase();
        }
        let has = |about: &&About| about.endings.contains(&ending.as_str());
        ALL.iter().find(has).map(|about| about.format)
    }

    /// The format that bytes are of, by their beginning.
    pub fn of_content(beginning: &[u8]) -> Option<Self> {
        ALL.iter().find(|about| (about.is)(beginning)).map(|about| about.format)
    }

    /// A reader for the bytes of one input.
    pub(crate) fn open(self, data: &Data) -> Result<Box<dyn Reader>, Fault> {
        (self.about().open)(data)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_endings_are_told_apart() {
        for (number, about) in ALL.iter().enumerate() {
            assert_eq!(Format::named(about.name), Some(about.format));
            for other in &ALL[number + 1..] {
                assert_ne!(about.name, other.name);
                let shared = about.endings.iter().find(|ending| other.endings.contains(ending));
                assert_eq!(shared, None, "{} and {}", about.name, other.name);
            }
        }
        #[cfg(feature = "lammps")]
        assert_eq!(Format::of_path(Path::new("a/run.DUMP.gz")), Some(Format::Dump));
        assert_eq!(Format::of_path(Path::new("run.gz")), None);
    }
}
