//! Which file is meant, whatever it is called: two names of one file are equal here, two files
//! never are.
//!
//! A file that is there is its device and inode, links followed: hard links, symbolic links, mounts
//! and `/dev/fd/N` all lead to it. One that is not there yet is its folder's device and inode, and
//! its name. (Where the system has no inodes, the canonical path takes their place.)

use std::{
    ffi::OsString,
    fs::{self, File, Metadata},
    io,
    path::Path,
};

/// A file, or a place for one.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Identity {
    place: Place,
    /// What kind of file it is.
    pub kind: Kind,
}

#[derive(Clone, Debug, PartialEq, Eq, Hash)]
enum Place {
    #[cfg(unix)]
    Inode {
        device: u64,
        inode: u64,
    },
    #[cfg(not(unix))]
    Path(std::path::PathBuf),
    New {
        folder: Box<Place>,
        name: OsString,
    },
}

/// What happens to what is written into it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Kind {
    /// It is kept: a regular file, a new one, a disk.
    Storage,
    /// It is thrown away: `/dev/null`.
    Null,
    /// It goes on to somebody: a pipe, a socket.
    Pipe,
    /// Somebody sees it: a terminal, or another device.
    Device,
}

impl Identity {
    /// The file of this name, which must be there.
    ///
    /// # Errors
    /// The system's.
    pub fn of(path: &Path) -> io::Result<Self> {
        Self::of_data(&fs::metadata(path)?, path)
    }

    /// An open file.
    ///
    /// # Errors
    /// The system's.
    pub fn of_file(file: &File) -> io::Result<Self> {
        Self::of_data(&file.metadata()?, Path::new(""))
    }

    /// A file that is not there yet: its folder must be.
    ///
    /// # Errors
    /// The system's.
    pub fn of_new(folder: &Path, name: OsString) -> io::Result<Self> {
        let folder = Box::new(Self::of(folder)?.place);
        Ok(Self { place: Place::New { folder, name }, kind: Kind::Storage })
    }

    #[cfg(unix)]
    fn of_data(data: &Metadata, _: &Path) -> io::Result<Self> {
        use std::os::unix::fs::{FileTypeExt, MetadataExt};
        let what = data.file_type();
        let null = || fs::metadata("/dev/null").is_ok_and(|null| null.rdev() == data.rdev());
        let kind = match what {
            _ if what.is_char_device() && null() => Kind::Null,
            _ if what.is_char_device() => Kind::Device,
            _ if what.is_fifo() || what.is_socket() => Kind::Pipe,
            _ => Kind::Storage,
        };
        Ok(Self { place: Place::Inode { device: data.dev(), inode: data.ino() }, kind })
    }

    #[cfg(not(unix))]
    fn of_data(_: &Metadata, path: &Path) -> io::Result<Self> {
        Ok(Self { place: Place::Path(fs::canonicalize(path)?), kind: Kind::Storage })
    }

    /// A new file with its name in small letters; none of a file that is there. Two of which these
    /// are equal may be one file: see [`Identity::differs_in_case`].
    #[must_use]
    pub fn in_small_letters(&self) -> Option<Self> {
        let Place::New { folder, name } = &self.place else { return None };
        let name = name.to_string_lossy().to_lowercase().into();
        Some(Self { place: Place::New { folder: folder.clone(), name }, kind: self.kind })
    }

    /// Whether both are new files of one folder, whose names differ in case only: where the file
    /// system takes no notice of case, these are one file.
    pub fn differs_in_case(&self, other: &Self) -> bool {
        let small = self.in_small_letters();
        self != other && small.is_some() && small == other.in_small_letters()
    }
}

#[cfg(all(test, unix))]
mod tests {
    use std::os::unix::fs::symlink;

    use super::*;

    #[test]
    fn names_of_one_file_are_equal() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        for name in ["a", "b"] {
            fs::write(at(name), "x").unwrap();
        }
        symlink("a", at("link")).unwrap();
        fs::hard_link(at("a"), at("hard")).unwrap();
        let of = |name: &str| Identity::of(&at(name)).unwrap();
        assert!(["link", "hard", "./a"].iter().all(|name| of(name) == of("a")));
        assert!(of("a") != of("b") && of("a").kind == Kind::Storage);
        assert_eq!(Identity::of_file(&File::open(at("a")).unwrap()).unwrap(), of("a"));
        let new = |folder: &Path, name: &str| Identity::of_new(folder, name.into()).unwrap();
        assert_eq!(new(folder.path(), "c"), new(&folder.path().join("."), "c"));
        assert!(new(folder.path(), "c") != new(folder.path(), "d"));
        assert!(new(folder.path(), "c").differs_in_case(&new(folder.path(), "C")));
        assert!(!new(folder.path(), "c").differs_in_case(&new(Path::new("/"), "C")));
        assert_eq!(Identity::of(Path::new("/dev/null")).unwrap().kind, Kind::Null);
        assert!(Identity::of(&at("nowhere")).is_err());
    }
}
