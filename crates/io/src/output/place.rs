//! Where a name leads: links followed to their end, descriptors of this process told from files,
//! and what cannot be written found out before anything is drawn.

use std::{
    fs, io,
    path::{Path, PathBuf},
};

use super::error::OutputError;
use crate::identity::Identity;

/// What a target's name leads to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Place {
    /// A descriptor of this process: it is written to where it stands.
    Descriptor(i32),
    /// A pipe, a terminal or another device: it is opened and written to.
    Device(PathBuf),
    /// A regular file, or none yet: no link, and its folder is there.
    File(PathBuf),
}

/// Links from one name to another, at most; the system's own limit is 40.
const LINKS: usize = 40;

impl Place {
    /// Follows a name.
    ///
    /// # Errors
    /// When it leads to a folder, a disk, or nowhere.
    pub fn of(target: &Path) -> Result<Self, OutputError> {
        let named =
            |source| OutputError::Io { target: planisphere_core::text::name(target), source };
        if target.as_os_str().is_empty() {
            return Err(OutputError::NoName);
        }
        let mut path = target.to_owned();
        for _ in 0..LINKS {
            let Some(name) = path.file_name().filter(|_| !ends_in_slash(&path)) else {
                return Err(OutputError::IsFolder(target.into()));
            };
            let folder = folder_of(&path);
            if !folder.is_dir() {
                return Err(OutputError::NoFolder { target: target.into(), folder: folder.into() });
            }
            // A folder above may not be readable: then this is no descriptor's.
            let canonical = fs::canonicalize(folder).unwrap_or_else(|_| folder.into());
            if is_descriptors(&canonical)
                && let Some(number) = name.to_str().and_then(|name| name.parse().ok())
            {
                return Ok(Self::Descriptor(number));
            }
            let data = match path.symlink_metadata() {
                Ok(data) => data,
                Err(error) if error.kind() == io::ErrorKind::NotFound => {
                    return Ok(Self::File(path));
                }
                Err(error) => return Err(named(error)),
            };
            if data.is_dir() {
                return Err(OutputError::IsFolder(target.into()));
            }
            if !data.is_symlink() {
                return if data.is_file() { Ok(Self::File(path)) } else { device(path, &data) };
            }
            if canonical.starts_with("/proc") {
                // Another process's descriptor: its link has no name that could be followed as
                // text.
                return Ok(Self::Device(path));
            }
            let link = fs::read_link(&path).map_err(named)?;
            path = if folder == Path::new(".") { link } else { folder.join(link) };
        }
        Err(named(io::Error::other("its links lead in a circle")))
    }

    /// Which file it is.
    ///
    /// # Errors
    /// The system's.
    pub fn identity(&self) -> io::Result<Identity> {
        match self {
            Self::Descriptor(number) => super::stream::identity(*number),
            Self::Device(path) => Identity::of(path),
            Self::File(path) => match Identity::of(path) {
                Err(error) if error.kind() == io::ErrorKind::NotFound => {
                    let name = path.file_name().unwrap_or_default().to_owned();
                    Identity::of_new(folder_of(path), name)
                }
                found => found,
            },
        }
    }

    /// Refuses what the system would refuse later.
    ///
    /// # Errors
    /// When it cannot be written, as far as can be known.
    pub fn check(&self, target: &Path) -> Result<(), OutputError> {
        match self {
            Self::Descriptor(number) => super::stream::check(*number),
            Self::Device(_) => Ok(()),
            Self::File(path) => check_file(path, target),
        }
    }
}

fn ends_in_slash(path: &Path) -> bool {
    path.as_os_str().as_encoded_bytes().ends_with(b"/")
}

/// The folder that a name is in.
pub(super) fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// Whether the names in this folder are the numbers of descriptors of this process.
fn is_descriptors(folder: &Path) -> bool {
    if !(folder.starts_with("/proc") || folder.starts_with("/dev")) {
        return false;
    }
    let is = |own: &str| fs::canonicalize(own).is_ok_and(|own| own == folder);
    let tasks = || fs::canonicalize("/proc/self/task").is_ok_and(|tasks| folder.starts_with(tasks));
    is("/proc/self/fd") || is("/dev/fd") || (folder.ends_with("fd") && tasks())
}

#[cfg(unix)]
fn device(path: PathBuf, data: &fs::Metadata) -> Result<Place, OutputError> {
    use std::os::unix::fs::FileTypeExt;
    if data.file_type().is_block_device() {
        Err(OutputError::IsDisk(path))
    } else {
        Ok(Place::Device(path))
    }
}

#[cfg(not(unix))]
fn device(path: PathBuf, _: &fs::Metadata) -> Result<Place, OutputError> {
    Ok(Place::Device(path))
}

/// A file that is there must be writable, also where it could be replaced: who made it read-only
/// wants to keep it. For a new one the folder must be writable.
fn check_file(path: &Path, target: &Path) -> Result<(), OutputError> {
    match fs::metadata(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            let folder = folder_of(path);
            if folder_is_writable(folder) {
                return Ok(());
            }
            Err(OutputError::FolderReadOnly { target: target.into(), folder: folder.into() })
        }
        Err(source) => {
            Err(OutputError::Io { target: planisphere_core::text::name(target), source })
        }
        // Root may write it all the same; the mode says what was wanted.
        Ok(data) if data.permissions().readonly() => Err(OutputError::ReadOnly(target.into())),
        Ok(_) => match fs::OpenOptions::new().write(true).open(path) {
            Err(error) if error.kind() == io::ErrorKind::PermissionDenied => {
                Err(OutputError::ReadOnly(target.into()))
            }
            // A program that runs: it can be replaced.
            Err(error) if error.kind() == io::ErrorKind::ExecutableFileBusy => Ok(()),
            Err(source) => {
                Err(OutputError::Io { target: planisphere_core::text::name(target), source })
            }
            Ok(_) => Ok(()),
        },
    }
}

#[cfg(unix)]
pub(super) fn folder_is_writable(folder: &Path) -> bool {
    use rustix::fs::{Access, AtFlags, CWD, accessat};
    accessat(CWD, folder, Access::WRITE_OK | Access::EXEC_OK, AtFlags::EACCESS).is_ok()
}

#[cfg(not(unix))]
pub(super) fn folder_is_writable(_: &Path) -> bool {
    true
}
