//! Files out: a whole file or none, and standard output.
//!
//! What is written goes to memory, and beyond a limit to a temporary file beside the target, and takes the target's name
//! only when everything is there: a run that fails or is killed leaves what was there before. A pipe whose reader has
//! gone is success: the reader had enough.

use std::{
    fs,
    io::{self, Write},
    path::{Path, PathBuf},
    sync::Arc,
};

use tempfile::NamedTempFile;

/// Bytes that wait in memory. Most outputs are smaller: their temporary file lives for a moment only.
const IN_MEMORY: usize = 64 << 20;

/// Where output goes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Target {
    /// Standard output, written `-`.
    Stdout,
    /// A file.
    File(PathBuf),
}

/// Why output could not be written.
#[derive(Debug, thiserror::Error)]
pub enum OutputError {
    /// The folder of the target is not there.
    #[error("cannot write {}: there is no folder {}; make it first", .target.display(), .folder.display())]
    NoFolder {
        /// The file.
        target: PathBuf,
        /// Its folder.
        folder: PathBuf,
    },
    /// The target is a folder.
    #[error("cannot write {}: it is a folder; name a file", .0.display())]
    IsFolder(PathBuf),
    /// The system refused.
    #[error("cannot write {target}: {source}")]
    Io {
        /// The file, or `standard output`.
        target: String,
        /// The system's words.
        source: io::Error,
    },
}

impl Target {
    /// Reads a command-line argument.
    pub fn from_arg(arg: &Path) -> Self {
        if arg == Path::new("-") { Self::Stdout } else { Self::File(arg.into()) }
    }

    /// An error of writing here.
    pub fn io(&self, source: io::Error) -> OutputError {
        let target = match self {
            Self::Stdout => "standard output".into(),
            Self::File(path) => path.display().to_string(),
        };
        OutputError::Io { target, source }
    }

    /// Refuses, before any work is done, what could not be written later.
    ///
    /// # Errors
    /// When the target is a folder, or its folder is not there.
    pub fn check(&self) -> Result<(), OutputError> {
        let Self::File(path) = self else { return Ok(()) };
        if path.is_dir() {
            return Err(OutputError::IsFolder(path.clone()));
        }
        let folder = folder_of(path);
        if !folder.is_dir() {
            return Err(OutputError::NoFolder { target: path.clone(), folder: folder.into() });
        }
        Ok(())
    }

    /// Takes the bytes that `write` writes. Standard output gets them at once, a file when [`commit`] is called.
    ///
    /// # Errors
    /// When the system refuses.
    pub fn stage(self, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<Staged, OutputError> {
        self.check()?;
        let body = match &self {
            Self::Stdout => {
                through(io::stdout().lock(), write).map_err(|error| self.io(error))?;
                Body::Done
            }
            Self::File(path) if is_special(path) => {
                let file = fs::OpenOptions::new().write(true).open(path).map_err(|error| self.io(error))?;
                through(file, write).map_err(|error| self.io(error))?;
                Body::Done
            }
            Self::File(path) => {
                let mut spool = Spool { path: resolved(path), body: Body::Memory(Pieces::default()) };
                write(&mut spool).map_err(|error| self.io(error))?;
                spool.body
            }
        };
        Ok(Staged { target: self, body })
    }

    /// Opens a target that is written little by little, as several are at a time.
    ///
    /// # Errors
    /// When the system refuses.
    pub fn open(self) -> Result<Sink, OutputError> {
        self.check()?;
        let way = match &self {
            Self::Stdout => Way::Through(Box::new(io::BufWriter::with_capacity(1 << 16, io::stdout()))),
            Self::File(path) if is_special(path) => {
                let file = fs::OpenOptions::new().write(true).open(path).map_err(|error| self.io(error))?;
                Way::Through(Box::new(io::BufWriter::with_capacity(1 << 16, file)))
            }
            Self::File(path) => Way::Spool(Spool { path: resolved(path), body: Body::Memory(Pieces::default()) }),
        };
        Ok(Sink { target: self, way, error: None, closed: false })
    }
}

/// A target that is being written. What its writer does not hear of is told by [`Sink::finish`].
pub struct Sink {
    target: Target,
    way: Way,
    /// The first thing that went wrong.
    error: Option<io::Error>,
    /// The reader has gone; the rest goes nowhere.
    closed: bool,
}

enum Way {
    Through(Box<dyn Write>),
    Spool(Spool),
}

impl Sink {
    fn guarded(&mut self, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
        if self.closed {
            return Ok(());
        }
        let result = match &mut self.way {
            Way::Through(out) => write(out),
            Way::Spool(spool) => write(spool),
        };
        match result {
            Err(error) if error.kind() == io::ErrorKind::BrokenPipe => {
                self.closed = true;
                // What is still buffered has no reader either.
                self.way = Way::Through(Box::new(io::sink()));
                Ok(())
            }
            Err(error) => {
                let copy = io::Error::new(error.kind(), error.to_string());
                self.error.get_or_insert(error);
                Err(copy)
            }
            Ok(()) => Ok(()),
        }
    }

    /// As writing, but bytes that wait in memory are not copied.
    ///
    /// # Errors
    /// The system's.
    pub fn give(&mut self, bytes: Shared) -> io::Result<()> {
        match &mut self.way {
            Way::Spool(Spool { body: Body::Memory(pieces), .. }) if pieces.takes((*bytes).as_ref()) => {
                pieces.give(bytes);
                Ok(())
            }
            _ => self.write_all((*bytes).as_ref()),
        }
    }

    /// Everything is written; a file waits for [`commit`].
    ///
    /// # Errors
    /// When anything could not be written.
    pub fn finish(mut self) -> Result<Staged, OutputError> {
        // An error is remembered.
        let _ = self.flush();
        if let Some(error) = self.error {
            return Err(self.target.io(error));
        }
        let body = match self.way {
            Way::Through(_) => Body::Done,
            Way::Spool(spool) => spool.body,
        };
        Ok(Staged { target: self.target, body })
    }
}

impl Write for Sink {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.guarded(|out| out.write_all(bytes))?;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.guarded(|out| out.flush())
    }
}

/// Writes at once. A reader that has gone had enough: that is no error.
fn through(out: impl Write, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let mut out = io::BufWriter::with_capacity(1 << 16, Pipe { out, closed: false });
    let result = write(&mut out).and_then(|()| out.flush());
    // What is still buffered has no reader either: it is dropped, not written.
    let (pipe, _) = out.into_parts();
    if pipe.closed { Ok(()) } else { result }
}

/// Remembers that its reader has gone: encoders on top of it may give the error another kind.
struct Pipe<W> {
    out: W,
    closed: bool,
}

impl<W: Write> Pipe<W> {
    fn watch<T>(&mut self, result: io::Result<T>) -> io::Result<T> {
        if let Err(error) = &result {
            self.closed |= error.kind() == io::ErrorKind::BrokenPipe;
        }
        result
    }
}

impl<W: Write> Write for Pipe<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let result = self.out.write(bytes);
        self.watch(result)
    }

    fn flush(&mut self) -> io::Result<()> {
        let result = self.out.flush();
        self.watch(result)
    }
}

/// Bytes on their way to a target.
pub struct Staged {
    target: Target,
    body: Body,
}

enum Body {
    Memory(Pieces),
    Disk(NamedTempFile),
    Done,
}

/// Bytes that others may look at as well.
pub type Shared = Arc<dyn AsRef<[u8]> + Send + Sync>;

/// Bytes that wait in memory.
#[derive(Default)]
struct Pieces {
    /// One after the other.
    given: Vec<Shared>,
    /// What comes after these.
    written: Vec<u8>,
    /// Of all.
    length: usize,
}

impl Pieces {
    /// Whether more may wait.
    fn takes(&self, bytes: &[u8]) -> bool {
        self.length + bytes.len() <= IN_MEMORY
    }

    fn give(&mut self, bytes: Shared) {
        self.length += (*bytes).as_ref().len();
        if !self.written.is_empty() {
            self.given.push(Arc::new(std::mem::take(&mut self.written)));
        }
        self.given.push(bytes);
    }

    fn extend(&mut self, bytes: &[u8]) {
        self.length += bytes.len();
        self.written.extend_from_slice(bytes);
    }

    /// A temporary file with these bytes.
    fn beside(&self, path: &Path) -> io::Result<NamedTempFile> {
        let mut file = beside(path)?;
        self.given.iter().try_for_each(|bytes| file.write_all((**bytes).as_ref()))?;
        file.write_all(&self.written)?;
        Ok(file)
    }
}

/// Gives every file its name, after all of them lie on the disk: together or, short of a failing rename, not at all.
///
/// # Errors
/// When the system refuses.
pub fn commit(staged: Vec<Staged>) -> Result<(), OutputError> {
    let mut files = Vec::new();
    for Staged { target, body } in staged {
        let Target::File(path) = &target else { continue };
        let path = resolved(path);
        match body {
            Body::Memory(pieces) => {
                let file = pieces.beside(&path).map_err(|error| target.io(error))?;
                files.push((target, path, file));
            }
            Body::Disk(file) => files.push((target, path, file)),
            Body::Done => {}
        }
    }
    for (target, path, file) in files {
        file.persist(path).map_err(|error| target.io(error.error))?;
    }
    Ok(())
}

/// Gives a file the first of some names that no file has, all in the folder it was staged for, and returns it. Nothing is
/// replaced, also not what another program writes at the same time.
///
/// # Errors
/// When the system refuses, or no name is free.
pub fn commit_new(staged: Staged, names: impl IntoIterator<Item = PathBuf>) -> Result<PathBuf, OutputError> {
    let Staged { target, body } = staged;
    let Target::File(path) = &target else {
        return Err(target.io(io::Error::other("standard output has no name")));
    };
    let mut file = match body {
        Body::Memory(pieces) => pieces.beside(path).map_err(|error| target.io(error))?,
        Body::Disk(file) => file,
        Body::Done => return Err(target.io(io::ErrorKind::AlreadyExists.into())),
    };
    for name in names {
        match file.persist_noclobber(&name) {
            Ok(_) => return Ok(name),
            Err(error) if error.error.kind() == io::ErrorKind::AlreadyExists => file = error.file,
            Err(error) => return Err(Target::File(name).io(error.error)),
        }
    }
    Err(target.io(io::ErrorKind::AlreadyExists.into()))
}

/// Memory first, a temporary file when it gets long.
struct Spool {
    path: PathBuf,
    body: Body,
}

impl Write for Spool {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.write_all(bytes)?;
        Ok(bytes.len())
    }

    fn write_all(&mut self, bytes: &[u8]) -> io::Result<()> {
        if let Body::Memory(pieces) = &mut self.body {
            if pieces.takes(bytes) {
                pieces.extend(bytes);
                return Ok(());
            }
            self.body = Body::Disk(pieces.beside(&self.path)?);
        }
        match &mut self.body {
            Body::Disk(file) => file.write_all(bytes),
            Body::Memory(_) | Body::Done => unreachable!("turned into a file above"),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// A hidden temporary file in the target's folder, so that the rename stays within one file system.
fn beside(path: &Path) -> io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".planisphere-").suffix(".tmp");
    #[cfg(unix)]
    {
        // As any other new file: what the umask leaves of this. The default is for secrets.
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    builder.tempfile_in(folder_of(path))
}

fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// A link's file is written, and the link stays.
fn resolved(path: &Path) -> PathBuf {
    if path.is_symlink() { fs::canonicalize(path).unwrap_or_else(|_| path.into()) } else { path.into() }
}

/// A pipe or a device such as `/dev/null`: it is written to, never replaced.
fn is_special(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|data| !data.is_file() && !data.is_dir())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<_> =
            fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    #[test]
    fn a_file_is_whole_or_not_there() {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("a.png");
        fs::write(&target, "old").unwrap();
        let staged = Target::File(target.clone()).stage(|out| out.write_all(b"new")).unwrap();
        assert_eq!(fs::read(&target).unwrap(), b"old");
        commit(vec![staged]).unwrap();
        assert_eq!(fs::read(&target).unwrap(), b"new");

        let long = vec![7; IN_MEMORY + 1];
        let failing = Target::File(target.clone()).stage(|out| {
            out.write_all(&long)?;
            Err(io::Error::other("stop"))
        });
        assert!(matches!(failing, Err(OutputError::Io { .. })));
        assert_eq!((fs::read(&target).unwrap(), names(folder.path())), (b"new".to_vec(), vec!["a.png".to_owned()]));

        let staged = Target::File(target.clone()).stage(|out| out.write_all(&long)).unwrap();
        commit(vec![staged]).unwrap();
        assert_eq!(fs::read(&target).unwrap(), long);
        assert_eq!(names(folder.path()), ["a.png"]);
    }

    #[test]
    fn new_names_replace_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let all: Vec<PathBuf> = ["a", "b", "c"].map(|name| folder.path().join(name)).into();
        fs::write(&all[1], "old").unwrap();
        let save = |text: &str| {
            let staged = Target::File(all[2].clone()).stage(|out| out.write_all(text.as_bytes())).unwrap();
            commit_new(staged, all.clone())
        };
        assert_eq!((save("first").unwrap(), save("second").unwrap()), (all[0].clone(), all[2].clone()));
        assert!(matches!(save("third"), Err(OutputError::Io { .. })));
        assert_eq!(all.iter().map(|path| fs::read(path).unwrap()).collect::<Vec<_>>().concat(), b"firstoldsecond");
        assert_eq!(names(folder.path()), ["a", "b", "c"]);
    }

    #[test]
    fn what_cannot_be_written_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let inside = folder.path().join("nowhere");
        let error = Target::File(inside.join("a.png")).check().unwrap_err();
        assert!(error.to_string().contains(&inside.display().to_string()), "{error}");
        assert!(matches!(Target::File(folder.path().into()).check(), Err(OutputError::IsFolder(_))));
        assert!(Target::File("a.png".into()).check().is_ok());
    }

    #[cfg(unix)]
    #[test]
    fn links_and_devices_stay() {
        let folder = tempfile::tempdir().unwrap();
        let (file, link) = (folder.path().join("file"), folder.path().join("link"));
        fs::write(&file, "old").unwrap();
        std::os::unix::fs::symlink(&file, &link).unwrap();
        commit(vec![Target::File(link.clone()).stage(|out| out.write_all(b"new")).unwrap()]).unwrap();
        assert!(link.is_symlink());
        assert_eq!(fs::read(&file).unwrap(), b"new");
        commit(vec![Target::File("/dev/null".into()).stage(|out| out.write_all(b"new")).unwrap()]).unwrap();
        assert!(is_special(Path::new("/dev/null")));
    }
}
