//! Which formats there are, what they are called, and how they are told apart.

use std::path::Path;

use super::{Data, Reader, data::MARK};
use crate::input::report::Fault;

/// A format of particles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Format {
    /// CSV, TSV, and tables between blanks.
    #[cfg(feature = "csv")]
    Csv,
    /// LAMMPS dump, as text.
    #[cfg(feature = "lammps")]
    Dump,
    /// DCD, of CHARMM, NAMD, LAMMPS and others.
    #[cfg(feature = "dcd")]
    Dcd,
    /// GSD, of HOOMD-blue.
    #[cfg(feature = "gsd")]
    Gsd,
    /// XTC, of GROMACS.
    #[cfg(feature = "xtc")]
    Xtc,
    /// XYZ, and extended XYZ.
    #[cfg(feature = "xyz")]
    Xyz,
    /// GRO, as GROMACS writes it.
    #[cfg(feature = "gro")]
    Gro,
    /// mmCIF, as the Protein Data Bank writes it.
    #[cfg(feature = "mmcif")]
    MmCif,
    /// PDB, as the Protein Data Bank and programs of molecules write it.
    #[cfg(feature = "pdb")]
    Pdb,
    /// LAMMPS data, as `read_data` reads it.
    #[cfg(feature = "lammps")]
    LammpsData,
    /// A NumPy array.
    #[cfg(feature = "npz")]
    Npy,
    /// A NumPy archive: arrays with names.
    #[cfg(feature = "npz")]
    Npz,
    /// PLY, as text or as numbers.
    #[cfg(feature = "ply")]
    Ply,
}

/// What the files of a format are made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Content {
    /// Text of lines, which end with line feeds.
    Lines,
    /// Text whose lines may end otherwise.
    Text,
    /// Numbers, or text before numbers.
    Bytes,
    /// Numbers, in many frames.
    Trajectory,
}

/// All that is known of a format before one of its files is opened.
struct About {
    format: Format,
    /// What it is called, for `--format`.
    name: &'static str,
    /// What it is called in sentences.
    title: &'static str,
    /// What its files are made of.
    content: Content,
    /// Endings of its files' names, in lower case.
    endings: &'static [&'static str],
    /// The unit of its positions, in angstrom; one where it has none.
    angstrom: f64,
    /// Whether bytes begin as its files do. Those of two formats do not begin alike.
    is: fn(&[u8]) -> bool,
    open: fn(&Data) -> Result<Box<dyn Reader>, Fault>,
}

/// All formats, in the order in which they are looked for.
const ALL: &[About] = &[
    #[cfg(feature = "lammps")]
    About {
        format: Format::Dump,
        name: "dump",
        title: "LAMMPS dump",
        content: Content::Lines,
        endings: &["dump", "lammpstrj", "lammpsdump"],
        angstrom: 1.0,
        is: super::dump::is,
        open: super::dump::open,
    },
    #[cfg(feature = "dcd")]
    About {
        format: Format::Dcd,
        name: "dcd",
        title: "DCD",
        content: Content::Trajectory,
        endings: &["dcd"],
        angstrom: 1.0,
        is: super::dcd::is,
        open: super::dcd::open,
    },
    #[cfg(feature = "gsd")]
    About {
        format: Format::Gsd,
        name: "gsd",
        title: "GSD",
        content: Content::Trajectory,
        endings: &["gsd"],
        angstrom: 1.0,
        is: super::gsd::is,
        open: super::gsd::open,
    },
    #[cfg(feature = "xtc")]
    About {
        format: Format::Xtc,
        name: "xtc",
        title: "XTC",
        content: Content::Trajectory,
        endings: &["xtc"],
        angstrom: 10.0,
        is: super::xtc::is,
        open: super::xtc::open,
    },
    #[cfg(feature = "ply")]
    About {
        format: Format::Ply,
        name: "ply",
        title: "PLY",
        content: Content::Bytes,
        endings: &["ply"],
        angstrom: 1.0,
        is: super::ply::is,
        open: super::ply::open,
    },
    #[cfg(feature = "npz")]
    About {
        format: Format::Npy,
        name: "npy",
        title: "NumPy array",
        content: Content::Bytes,
        endings: &["npy"],
        angstrom: 1.0,
        is: super::numpy::is_array,
        open: super::numpy::open_array,
    },
    #[cfg(feature = "npz")]
    About {
        format: Format::Npz,
        name: "npz",
        title: "NumPy archive",
        content: Content::Bytes,
        endings: &["npz"],
        angstrom: 1.0,
        is: super::numpy::is_archive,
        open: super::numpy::open_archive,
    },
    #[cfg(feature = "xyz")]
    About {
        format: Format::Xyz,
        name: "xyz",
        title: "XYZ",
        content: Content::Lines,
        endings: &["xyz", "extxyz", "exyz"],
        angstrom: 1.0,
        is: super::xyz::is,
        open: super::xyz::open,
    },
    #[cfg(feature = "gro")]
    About {
        format: Format::Gro,
        name: "gro",
        title: "GRO",
        content: Content::Lines,
        endings: &["gro"],
        angstrom: 10.0,
        is: super::gro::is,
        open: super::gro::open,
    },
    #[cfg(feature = "mmcif")]
    About {
        format: Format::MmCif,
        name: "mmcif",
        title: "mmCIF",
        content: Content::Text,
        endings: &["cif", "mmcif"],
        angstrom: 1.0,
        is: super::mmcif::is,
        open: super::mmcif::open,
    },
    #[cfg(feature = "pdb")]
    About {
        format: Format::Pdb,
        name: "pdb",
        title: "PDB",
        content: Content::Lines,
        endings: &["pdb", "ent"],
        angstrom: 1.0,
        is: super::pdb::is,
        open: super::pdb::open,
    },
    #[cfg(feature = "lammps")]
    About {
        format: Format::LammpsData,
        name: "data",
        title: "LAMMPS data",
        content: Content::Lines,
        endings: &["data", "lmp", "lammps"],
        angstrom: 1.0,
        is: super::lammps_data::is,
        open: super::lammps_data::open,
    },
    #[cfg(feature = "csv")]
    About {
        format: Format::Csv,
        name: "csv",
        title: "CSV",
        content: Content::Text,
        endings: &["csv", "tsv"],
        angstrom: 1.0,
        is: super::csv::is,
        open: super::csv::open,
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
        // What some programs write before UTF-8 tells nothing.
        let beginning = beginning.strip_prefix(MARK).unwrap_or(beginning);
        ALL.iter().find(|about| (about.is)(beginning)).map(|about| about.format)
    }

    /// The unit of its positions, in angstrom. Where the format has none, it is taken to be one.
    pub fn angstrom(self) -> f64 {
        self.about().angstrom
    }

    /// What its files are made of.
    pub(super) fn content(self) -> Content {
        self.about().content
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
