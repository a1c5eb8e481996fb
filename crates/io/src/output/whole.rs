//! A file that takes its name when it is whole.
//!
//! Its bytes go into a file without a name where the system has such files (`O_TMPFILE`), else into
//! a hidden one that [`crate::litter`] removes should the process end. The name is then moved onto
//! it. An old file of that name gives it its permissions, owner, attributes; where it cannot, or
//! where the name cannot be moved (a file that is a mount point, a folder without write
//! permission), the old file itself is written, from bytes that are all there.

use std::{
    fs::{self, File},
    io::{self, Read, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
};

#[cfg(unix)]
use super::place::folder_is_writable;
use super::{place::folder_of, stream::flushed};
use crate::litter::{self, Shield};

/// A file on its way to a name.
pub(super) struct Scratch {
    file: File,
    name: Name,
}

enum Name {
    /// It has none, but can be given one in its folder.
    #[cfg(target_os = "linux")]
    None,
    /// A hidden one.
    #[cfg(unix)]
    Hidden { path: PathBuf, _held: litter::Named },
    /// A hidden one.
    #[cfg(not(unix))]
    Hidden { path: PathBuf },
    /// It has none, and lies elsewhere: its bytes are to be copied.
    #[cfg(unix)]
    Elsewhere,
}

impl Scratch {
    /// One that can become the file `path`.
    ///
    /// # Errors
    /// The system's.
    #[cfg(unix)]
    pub fn for_file(path: &Path) -> io::Result<Self> {
        let folder = folder_of(path);
        if !folder_is_writable(folder) && path.exists() {
            return Ok(Self { file: tempfile::tempfile()?, name: Name::Elsewhere });
        }
        #[cfg(target_os = "linux")]
        if let Some(file) = nameless(folder) {
            return Ok(Self { file, name: Name::None });
        }
        let (file, path, held) = litter::hidden(folder)?;
        Ok(Self { file, name: Name::Hidden { path, _held: held } })
    }

    /// One that can become the file `path`.
    ///
    /// # Errors
    /// The system's.
    #[cfg(not(unix))]
    pub fn for_file(path: &Path) -> io::Result<Self> {
        let path = litter::name_in(folder_of(path));
        let file = File::options().read(true).write(true).create_new(true).open(&path)?;
        Ok(Self { file, name: Name::Hidden { path } })
    }

    /// Takes more bytes.
    ///
    /// # Errors
    /// The system's.
    pub fn write_all(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.file.write_all(bytes)
    }

    /// Makes ready for [`Ready::publish_new`].
    ///
    /// # Errors
    /// The system's.
    pub fn ready_new(self) -> io::Result<Ready> {
        flushed(&self.file)?;
        Ok(Ready { scratch: self, path: PathBuf::new(), links: 1, in_place: None })
    }

    /// Makes ready for [`Ready::publish`] what may fail.
    ///
    /// # Errors
    /// The system's. The file of this name is as it was.
    pub fn ready(self, path: &Path) -> io::Result<Ready> {
        flushed(&self.file)?;
        let old = match fs::symlink_metadata(path) {
            Ok(data) => Some(data),
            Err(error) if error.kind() == io::ErrorKind::NotFound => None,
            Err(error) => return Err(error),
        };
        let mut in_place = None;
        if let Some(old) = &old {
            if old.permissions().readonly() {
                // It was not when the run began.
                return Err(io::ErrorKind::PermissionDenied.into());
            }
            if self.is_elsewhere() || is_mounted(path) || !dress(&self.file, old, path) {
                in_place = Some(Old::open(path, self.file.metadata()?.len())?);
            } else {
                // A crash of the machine must leave the old file or the new one, never an empty
                // one.
                self.file.sync_data()?;
            }
        }
        Ok(Ready {
            scratch: self,
            path: path.into(),
            links: old.as_ref().map_or(1, links),
            in_place,
        })
    }
}

/// A file that only lacks its name.
pub(super) struct Ready {
    scratch: Scratch,
    path: PathBuf,
    /// Names of the old file.
    links: u64,
    /// The old file, if it is to be written itself.
    in_place: Option<Old>,
}

impl Ready {
    /// Gives it its name. Returns what is worth saying.
    ///
    /// # Errors
    /// The system's. The old file of this name is then as it was, as far as the system lets it be.
    pub fn publish(self) -> io::Result<Option<String>> {
        let Self { mut scratch, path, links, in_place } = self;
        if let Some(old) = in_place {
            old.overwrite(&mut scratch.file)?;
            return Ok(None);
        }
        match scratch.rename(&path) {
            Ok(()) => Ok((links > 1).then(|| {
                format!(
                    "{} had {} more name{} (hard links), which keep{} the old file",
                    planisphere_core::text::name(path),
                    links - 1,
                    if links == 2 { "" } else { "s" },
                    if links == 2 { "s" } else { "" }
                )
            })),
            // A mount point, or a folder where names of other people's files cannot be moved.
            Err(error) if !not_nameable(&error) => Err(error),
            Err(error) => match Old::open(&path, scratch.file.metadata()?.len()) {
                Ok(old) => old.overwrite(&mut scratch.file).map(|()| None),
                // Why it can be neither renamed nor written: what is more of a reason.
                Err(second) if second.kind() == io::ErrorKind::PermissionDenied => Err(error),
                Err(second) => Err(second),
            },
        }
    }

    /// Gives it the first of some names that no file has.
    ///
    /// # Errors
    /// The system's; that all names are taken.
    pub fn publish_new(self, names: impl IntoIterator<Item = PathBuf>) -> io::Result<PathBuf> {
        for name in names {
            match self.scratch.link(&name) {
                Ok(()) => return Ok(name),
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                Err(error) => return Err(error),
            }
        }
        Err(io::ErrorKind::AlreadyExists.into())
    }
}

/// Errors of moving a name where writing into the file may still do.
fn not_nameable(error: &io::Error) -> bool {
    use io::ErrorKind::{CrossesDevices, PermissionDenied, ResourceBusy};
    matches!(error.kind(), CrossesDevices | PermissionDenied | ResourceBusy)
}

/// An open old file that is to be written itself.
struct Old {
    file: File,
    length: u64,
}

/// Bytes of an old file that are kept in memory while it is written, at most.
const KEPT: u64 = 1 << 28;

impl Old {
    /// Opens it, and sees that there is room for `length` bytes.
    fn open(path: &Path, length: u64) -> io::Result<Self> {
        let readable = File::options().read(true).write(true).open(path);
        let file = readable.or_else(|_| File::options().write(true).open(path))?;
        let old = Self { length: file.metadata()?.len(), file };
        #[cfg(target_os = "linux")]
        if length > old.length {
            use rustix::{
                fs::{FallocateFlags, fallocate},
                io::Errno,
            };
            // Room without a change of length: a failure, or a kill after it, changes nothing.
            match fallocate(&old.file, FallocateFlags::KEEP_SIZE, old.length, length - old.length) {
                Ok(()) | Err(Errno::OPNOTSUPP | Errno::NOSYS | Errno::INVAL) => {}
                Err(error) => return Err(error.into()),
            }
        }
        #[cfg(not(target_os = "linux"))]
        let _ = length;
        Ok(old)
    }

    /// Writes all bytes of `new` over it; should that fail, the old ones again.
    fn overwrite(mut self, new: &mut File) -> io::Result<()> {
        let length = new.metadata()?.len();
        let mut kept = Vec::new();
        let overlap = length.min(self.length);
        if overlap <= KEPT {
            // Not readable: then there is nothing to go back to.
            let _ = (&self.file).take(overlap).read_to_end(&mut kept);
        }
        let result = self.write(new, length);
        if result.is_err() && kept.len() as u64 == overlap {
            let back = self.file.rewind().and_then(|()| self.file.write_all(&kept));
            // The error that is told is the first one.
            let _ = back.and_then(|()| self.file.set_len(self.length));
        }
        result
    }

    fn write(&mut self, new: &mut File, length: u64) -> io::Result<()> {
        // What is beyond the old end first: it is what may find no room, and is cut off again
        // without a trace.
        let from = self.length.min(length);
        for (start, count) in [(from, length - from), (0, from)] {
            new.seek(SeekFrom::Start(start))?;
            self.file.seek(SeekFrom::Start(start))?;
            let copied = io::copy(&mut new.take(count), &mut self.file)?;
            if copied != count {
                return Err(io::ErrorKind::UnexpectedEof.into());
            }
        }
        self.file.set_len(length)?;
        flushed(&self.file)
    }
}

/// Whether a file is a mount point: its name cannot be moved.
#[cfg(target_os = "linux")]
fn is_mounted(path: &Path) -> bool {
    use rustix::fs::{AtFlags, CWD, StatxAttributes, StatxFlags, statx};
    // What an old kernel does not tell, it tells when the name is moved.
    statx(CWD, path, AtFlags::SYMLINK_NOFOLLOW, StatxFlags::TYPE)
        .is_ok_and(|found| found.stx_attributes.contains(StatxAttributes::MOUNT_ROOT))
}

#[cfg(not(target_os = "linux"))]
fn is_mounted(_: &Path) -> bool {
    false
}

#[cfg(unix)]
fn links(data: &fs::Metadata) -> u64 {
    std::os::unix::fs::MetadataExt::nlink(data)
}

#[cfg(not(unix))]
fn links(_: &fs::Metadata) -> u64 {
    1
}

/// Gives a new file the permissions, owner and attributes of an old one. False when that is not
/// allowed.
#[cfg(unix)]
fn dress(new: &File, old: &fs::Metadata, path: &Path) -> bool {
    use std::os::unix::fs::{MetadataExt, PermissionsExt, fchown};
    let Ok(own) = new.metadata() else { return false };
    let owner = (own.uid() != old.uid()).then(|| old.uid());
    let group = (own.gid() != old.gid()).then(|| old.gid());
    if (owner.is_some() || group.is_some()) && fchown(new, owner, group).is_err() {
        return false;
    }
    let mode = old.mode() & 0o7777;
    (own.mode() & 0o7777 == mode || new.set_permissions(fs::Permissions::from_mode(mode)).is_ok())
        && attributes(new, path).is_ok()
}

#[cfg(not(unix))]
fn dress(_: &File, _: &fs::Metadata, _: &Path) -> bool {
    true
}

/// Extended attributes, access control lists among them: those of the old file, and no others.
#[cfg(target_os = "linux")]
fn attributes(new: &File, old: &Path) -> io::Result<()> {
    use rustix::{
        fs::{XattrFlags, fgetxattr, flistxattr, fremovexattr, fsetxattr, lgetxattr, llistxattr},
        io::Errno,
    };
    /// The system's limit of a list, and of a value.
    const LONGEST: usize = 1 << 16;
    fn whole(ask: impl Fn(&mut [u8]) -> Result<usize, Errno>) -> Result<Vec<u8>, Errno> {
        let mut bytes = vec![0; LONGEST];
        let length = ask(&mut bytes)?;
        bytes.truncate(length);
        Ok(bytes)
    }
    let names = |list: Result<Vec<u8>, Errno>| match list {
        Ok(list) => Ok(list
            .split(|&byte| byte == 0)
            .filter(|name| !name.is_empty())
            .map(<[u8]>::to_vec)
            .collect()),
        // A file system without attributes.
        Err(Errno::OPNOTSUPP | Errno::NOSYS) => Ok(Vec::new()),
        Err(error) => Err(error),
    };
    let wanted: Vec<Vec<u8>> = names(whole(|bytes| llistxattr(old, bytes)))?;
    let found: Vec<Vec<u8>> = names(whole(|bytes| flistxattr(new, bytes)))?;
    for name in found.iter().filter(|name| !wanted.contains(name)) {
        // A list that a new file inherits from its folder would let others in.
        if name.starts_with(b"system.") {
            fremovexattr(new, &name[..])?;
        }
    }
    for name in &wanted {
        let value = whole(|bytes| lgetxattr(old, &name[..], bytes))?;
        if whole(|bytes| fgetxattr(new, &name[..], bytes)).is_ok_and(|own| own == value) {
            continue;
        }
        fsetxattr(new, &name[..], &value, XattrFlags::empty())?;
    }
    Ok(())
}

#[cfg(all(unix, not(target_os = "linux")))]
fn attributes(_: &File, _: &Path) -> io::Result<()> {
    Ok(())
}

/// A file of this folder without a name, if the system has such files and can name them later.
#[cfg(target_os = "linux")]
fn nameless(folder: &Path) -> Option<File> {
    use std::os::unix::fs::OpenOptionsExt;
    let mut options = File::options();
    // As any other new file: what the umask leaves of this.
    options.read(true).write(true).mode(0o666).custom_flags(libc::O_TMPFILE);
    let file = options.open(folder).ok()?;
    // Its name is given by way of /proc, which may be missing.
    descriptor_path(&file).exists().then_some(file)
}

#[cfg(target_os = "linux")]
fn descriptor_path(file: &File) -> PathBuf {
    format!("/proc/self/fd/{}", std::os::fd::AsRawFd::as_raw_fd(file)).into()
}

impl Scratch {
    #[cfg(unix)]
    fn is_elsewhere(&self) -> bool {
        matches!(self.name, Name::Elsewhere)
    }

    #[cfg(not(unix))]
    fn is_elsewhere(&self) -> bool {
        false
    }

    /// Moves the name `path` onto this file; the old file of this name, if any, loses it.
    fn rename(&self, path: &Path) -> io::Result<()> {
        match &self.name {
            #[cfg(target_os = "linux")]
            Name::None => {
                match self.link(path) {
                    Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                    result => return result,
                }
                // A name cannot be moved onto a file without one: it is hidden for a moment. It is
                // locked, so that another run does not take it for litter.
                let _ = rustix::fs::flock(
                    &self.file,
                    rustix::fs::FlockOperation::NonBlockingLockExclusive,
                );
                let hidden = litter::name_in(folder_of(path));
                self.link(&hidden)?;
                fs::rename(&hidden, path).inspect_err(|_| {
                    let _ = fs::remove_file(&hidden);
                })
            }
            Name::Hidden { path: hidden, .. } => fs::rename(hidden, path),
            #[cfg(unix)]
            Name::Elsewhere => Err(io::ErrorKind::CrossesDevices.into()),
        }
    }

    /// Gives this file the name `path`, which must be free.
    fn link(&self, path: &Path) -> io::Result<()> {
        match &self.name {
            #[cfg(target_os = "linux")]
            Name::None => {
                use rustix::fs::{AtFlags, CWD, linkat};
                Ok(linkat(CWD, descriptor_path(&self.file), CWD, path, AtFlags::SYMLINK_FOLLOW)?)
            }
            Name::Hidden { path: hidden, .. } => {
                // A second name first; file systems without hard links look, and move.
                match fs::hard_link(hidden, path) {
                    Err(error)
                        if error.kind() != io::ErrorKind::AlreadyExists && !path.exists() =>
                    {
                        fs::rename(hidden, path)
                    }
                    Err(error) => Err(error),
                    Ok(()) => {
                        let _ = fs::remove_file(hidden);
                        Ok(())
                    }
                }
            }
            #[cfg(unix)]
            Name::Elsewhere => Err(io::ErrorKind::CrossesDevices.into()),
        }
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        if let Name::Hidden { path, .. } = &self.name {
            // After it was given its name, there is nothing here. What cannot be removed is swept
            // by the next run.
            let _ = fs::remove_file(path);
        }
    }
}

/// Whether a folder takes `a` and `A` for one name: tried out with a hidden file.
///
/// # Errors
/// When none can be made.
#[cfg(unix)]
pub(super) fn ignores_case(folder: &Path) -> io::Result<bool> {
    let (file, path, held) = litter::hidden(folder)?;
    let scratch = Scratch { file, name: Name::Hidden { path: path.clone(), _held: held } };
    let name = path.file_name().unwrap_or_default().to_string_lossy().to_uppercase();
    let same = folder.join(name).symlink_metadata().is_ok();
    drop(scratch);
    Ok(same)
}

/// Whether a folder takes `a` and `A` for one name: where there is no telling, it may.
///
/// # Errors
/// None.
#[cfg(not(unix))]
pub(super) fn ignores_case(_: &Path) -> io::Result<bool> {
    Ok(true)
}

/// Publishes all of them; no signal ends the process in between.
///
/// # Errors
/// The first that failed, by its place, and the system's words. Those before it have their names.
pub(super) fn publish_all(all: Vec<Ready>) -> Result<Vec<String>, (usize, io::Error)> {
    let _shield = Shield::up();
    let mut said = Vec::new();
    for (place, ready) in all.into_iter().enumerate() {
        said.extend(ready.publish().map_err(|error| (place, error))?);
    }
    Ok(said)
}

/// Gives one the first free name; no signal ends the process in between.
///
/// # Errors
/// As [`Ready::publish_new`].
pub(super) fn publish_new(
    ready: Ready,
    names: impl IntoIterator<Item = PathBuf>,
) -> io::Result<PathBuf> {
    let _shield = Shield::up();
    ready.publish_new(names)
}
