//! Files out: a whole file or none; standard output and other streams.
//!
//! What is written to a file goes to memory, and beyond a limit to a file without a name, and takes
//! the target's name only when everything is there: a run that fails or is killed leaves what was
//! there before. Streams are written to where they stand. A pipe whose reader has gone is success:
//! the reader had enough.

mod error;
mod place;
mod stream;
mod whole;

use std::{
    ffi::OsStr,
    fmt,
    io::{self, Write},
    path::{Path, PathBuf},
    sync::Arc,
};

pub use error::OutputError;
pub use stream::{identity as stream_identity, were_closed};

use self::{
    place::{Place, folder_of},
    stream::{Stream, flushed},
    whole::{Ready, Scratch},
};
use crate::{identity::Identity, litter};
use planisphere_core::text;

/// Bytes that wait in memory. Most outputs are smaller: their temporary file lives for a moment
/// only.
const IN_MEMORY: usize = 64 << 20;

/// Where output goes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Target {
    /// Standard output, written `-`.
    Stdout,
    /// A file.
    File(PathBuf),
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
            Self::File(path) => text::name(path),
        };
        OutputError::Io { target, source }
    }

    fn place(&self) -> Result<Place, OutputError> {
        match self {
            Self::Stdout => Ok(Place::Descriptor(1)),
            Self::File(path) => Place::of(path),
        }
    }

    /// Refuses, before any work is done, what could not be written later.
    ///
    /// # Errors
    /// When the target is a folder, its folder is not there, or it may not be written.
    pub fn check(&self) -> Result<(), OutputError> {
        let path = match self {
            Self::Stdout => Path::new("-"),
            Self::File(path) => path,
        };
        self.place()?.check(path)
    }

    /// Refuses a file whose ending stands for another format than what is to be written, such as
    /// `.png`. No ending is well; so is any on a stream or a device. `option` and `what` are for
    /// the message.
    ///
    /// # Errors
    /// When the ending is wrong, or the name leads nowhere.
    pub fn check_ending(
        &self,
        option: &str,
        what: &'static str,
        ending: &'static str,
    ) -> Result<(), OutputError> {
        let Some((target, found)) = self.ending()? else { return Ok(()) };
        if found.eq_ignore_ascii_case(ending) {
            return Ok(());
        }
        let better = with_ending(target, found, ending);
        Err(OutputError::Ending {
            option: option.into(),
            what,
            target: target.clone(),
            ending,
            better,
        })
    }

    /// The name of a file that has an ending, and this; none of streams and devices.
    ///
    /// # Errors
    /// When the name leads nowhere.
    pub fn ending(&self) -> Result<Option<(&PathBuf, &OsStr)>, OutputError> {
        let Self::File(target) = self else { return Ok(None) };
        let Some(found) = target.extension().filter(|found| !found.is_empty()) else {
            return Ok(None);
        };
        Ok(matches!(self.place()?, Place::File(_)).then_some((target, found)))
    }

    /// Which file this is.
    ///
    /// # Errors
    /// When the name leads nowhere.
    pub fn identity(&self) -> Result<Identity, OutputError> {
        self.place()?.identity().map_err(|error| self.io(error))
    }

    /// The number of the descriptor that this is, if it is one: 1 for standard output, by any name.
    pub fn descriptor(&self) -> Option<i32> {
        match self.place() {
            Ok(Place::Descriptor(number)) => Some(number),
            _ => None,
        }
    }

    /// Whether the file system that this new file is for takes `a` and `A` for one name.
    ///
    /// # Errors
    /// When a name cannot be tried out.
    pub fn ignores_case(&self) -> Result<bool, OutputError> {
        match self.place()? {
            Place::File(path) => {
                whole::ignores_case(folder_of(&path)).map_err(|error| self.io(error))
            }
            _ => Ok(false),
        }
    }

    /// Takes the bytes that `write` writes. Streams get them at once, a file when [`commit`] is
    /// called.
    ///
    /// # Errors
    /// When the system refuses.
    pub fn stage(
        self,
        write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> Result<Staged, OutputError> {
        let (body, path) = match self.opened()? {
            Opened::Stream(stream) => {
                through(stream, write).map_err(|error| self.io(error))?;
                (Body::Done, PathBuf::new())
            }
            Opened::Spool(mut spool) => {
                write(&mut spool).map_err(|error| self.io(error))?;
                (spool.body, spool.path)
            }
        };
        Ok(Staged { target: self, body, path })
    }

    /// Opens a target that is written little by little, as several are at a time.
    ///
    /// # Errors
    /// When the system refuses.
    pub fn open(self) -> Result<Sink, OutputError> {
        let way = match self.opened()? {
            Opened::Stream(stream) => Way::Through(io::BufWriter::with_capacity(1 << 16, stream)),
            Opened::Spool(spool) => Way::Spool(spool),
        };
        Ok(Sink { target: self, way, error: None, closed: false })
    }

    fn opened(&self) -> Result<Opened, OutputError> {
        self.check()?;
        let file = match self.place()? {
            Place::File(path) => {
                litter::sweep(folder_of(&path));
                return Ok(Opened::Spool(Spool { path, body: Body::Memory(Pieces::default()) }));
            }
            Place::Descriptor(number) => stream::duplicate(number),
            // Where it is a file after all, it keeps what it holds.
            Place::Device(path) => std::fs::OpenOptions::new().append(true).open(path),
        };
        file.map(|file| Opened::Stream(Stream(file))).map_err(|error| self.io(error))
    }
}

/// A target whose way is known.
enum Opened {
    Stream(Stream),
    Spool(Spool),
}

/// A name like this one, with the ending of what is written: in place of a format's, else after
/// what is there.
fn with_ending(target: &Path, found: &OsStr, ending: &str) -> PathBuf {
    const FORMATS: [&str; 30] = [
        "png", "npy", "npz", "svg", "jpg", "jpeg", "gif", "bmp", "tif", "tiff", "webp", "exr",
        "hdr", "ppm", "pgm", "pbm", "pnm", "pdf", "eps", "ps", "avif", "tga", "qoi", "csv", "txt",
        "json", "toml", "raw", "bin", "dat",
    ];
    if FORMATS.iter().any(|format| found.eq_ignore_ascii_case(format)) {
        return target.with_extension(ending);
    }
    let mut name = target.as_os_str().to_owned();
    name.push(".");
    name.push(ending);
    name.into()
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

impl fmt::Debug for Sink {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Sink")
            .field("target", &self.target)
            .field("error", &self.error)
            .field("closed", &self.closed)
            .finish_non_exhaustive()
    }
}

enum Way {
    Through(io::BufWriter<Stream>),
    Spool(Spool),
    /// Nobody reads it.
    Nowhere,
}

impl Sink {
    fn guarded(&mut self, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
        if self.closed {
            return Ok(());
        }
        let result = match &mut self.way {
            Way::Through(out) => write(out),
            Way::Spool(spool) => write(spool),
            Way::Nowhere => return Ok(()),
        };
        match result {
            Err(error) if error.kind() == io::ErrorKind::BrokenPipe => {
                self.closed = true;
                // What is still buffered has no reader either: it is dropped, not written.
                if let Way::Through(out) = std::mem::replace(&mut self.way, Way::Nowhere) {
                    drop(out.into_parts());
                }
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
            Way::Spool(Spool { body: Body::Memory(pieces), .. })
                if pieces.takes((*bytes).as_ref()) =>
            {
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
        let (body, path) = match self.way {
            Way::Through(out) => {
                flushed(&out.get_ref().0).map_err(|error| self.target.io(error))?;
                (Body::Done, PathBuf::new())
            }
            Way::Nowhere => (Body::Done, PathBuf::new()),
            Way::Spool(spool) => (spool.body, spool.path),
        };
        Ok(Staged { target: self.target, body, path })
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
fn through(stream: Stream, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let mut out = io::BufWriter::with_capacity(1 << 16, Pipe { out: stream, closed: false });
    let result = write(&mut out).and_then(|()| out.flush());
    // What is still buffered has no reader either: it is dropped, not written.
    let (pipe, _) = out.into_parts();
    if pipe.closed { Ok(()) } else { result.and_then(|()| flushed(&pipe.out.0)) }
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
    /// Where a file's name led when its bytes began to come.
    path: PathBuf,
}

impl fmt::Debug for Staged {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Staged")
            .field("target", &self.target)
            .field("path", &self.path)
            .finish_non_exhaustive()
    }
}

enum Body {
    Memory(Pieces),
    Disk(Scratch),
    Done,
}

impl Staged {
    /// The file, whole but for its name.
    fn ready(self) -> Result<Option<(Target, Ready)>, OutputError> {
        let Self { target, body, path } = self;
        let scratch = match body {
            Body::Memory(pieces) => pieces.written(&path),
            Body::Disk(scratch) => Ok(scratch),
            Body::Done => return Ok(None),
        };
        let ready =
            scratch.and_then(|scratch| scratch.ready(&path)).map_err(|error| target.io(error))?;
        Ok(Some((target, ready)))
    }
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

    /// A file with these bytes, for this name.
    fn written(&self, path: &Path) -> io::Result<Scratch> {
        let mut file = Scratch::for_file(path)?;
        self.given.iter().try_for_each(|bytes| file.write_all((**bytes).as_ref()))?;
        file.write_all(&self.written)?;
        Ok(file)
    }
}

/// Gives every file its name, after all of them are whole: together or, short of a failing rename,
/// not at all. What is worth saying comes back.
///
/// A file that replaces another lies on the disk before it takes the name, so that a crash of the
/// machine leaves the one or the other. A new one is left to the system, which writes it out within
/// seconds.
///
/// # Errors
/// When the system refuses.
pub fn commit(staged: Vec<Staged>) -> Result<Vec<String>, OutputError> {
    let (mut targets, mut files) = (Vec::new(), Vec::new());
    for staged in staged {
        if let Some((target, ready)) = staged.ready()? {
            targets.push(target);
            files.push(ready);
        }
    }
    whole::publish_all(files).map_err(|(place, error)| targets[place].io(error))
}

/// Gives a file the first of some names that no file has, all in the folder it was staged for, and
/// returns it. Nothing is replaced, also not what another program writes at the same time.
///
/// # Errors
/// When the system refuses, or no name is free.
pub fn commit_new(
    staged: Staged,
    names: impl IntoIterator<Item = PathBuf>,
) -> Result<PathBuf, OutputError> {
    let Staged { target, body, path } = staged;
    let scratch = match body {
        Body::Memory(pieces) => pieces.written(&path),
        Body::Disk(scratch) => Ok(scratch),
        Body::Done => Err(io::Error::other("it is a stream, which has no name to give")),
    };
    let named = scratch.and_then(|scratch| whole::publish_new(scratch.ready_new()?, names));
    named.map_err(|error| target.io(error))
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
            self.body = Body::Disk(pieces.written(&self.path)?);
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

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<_> = fs::read_dir(folder)
            .unwrap()
            .map(|e| e.unwrap().file_name().to_string_lossy().into_owned())
            .collect();
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
        assert_eq!(
            (fs::read(&target).unwrap(), names(folder.path())),
            (b"new".to_vec(), vec!["a.png".to_owned()])
        );

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
            let staged =
                Target::File(all[2].clone()).stage(|out| out.write_all(text.as_bytes())).unwrap();
            commit_new(staged, all.clone())
        };
        assert_eq!(
            (save("first").unwrap(), save("second").unwrap()),
            (all[0].clone(), all[2].clone())
        );
        assert!(matches!(save("third"), Err(OutputError::Io { .. })));
        assert_eq!(
            all.iter().map(|path| fs::read(path).unwrap()).collect::<Vec<_>>().concat(),
            b"firstoldsecond"
        );
        assert_eq!(names(folder.path()), ["a", "b", "c"]);
    }

    #[test]
    fn what_cannot_be_written_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let inside = folder.path().join("nowhere");
        let error = Target::File(inside.join("a.png")).check().unwrap_err();
        assert!(error.to_string().contains(&inside.display().to_string()), "{error}");
        assert!(matches!(
            Target::File(folder.path().into()).check(),
            Err(OutputError::IsFolder(_))
        ));
        assert!(Target::File("a.png".into()).check().is_ok());
    }

    #[cfg(unix)]
    #[test]
    fn links_and_devices_stay() {
        let folder = tempfile::tempdir().unwrap();
        let (file, link) = (folder.path().join("file"), folder.path().join("link"));
        fs::write(&file, "old").unwrap();
        std::os::unix::fs::symlink(&file, &link).unwrap();
        commit(vec![Target::File(link.clone()).stage(|out| out.write_all(b"new")).unwrap()])
            .unwrap();
        assert!(link.is_symlink());
        assert_eq!(fs::read(&file).unwrap(), b"new");
        commit(vec![Target::File("/dev/null".into()).stage(|out| out.write_all(b"new")).unwrap()])
            .unwrap();
        assert!(!fs::metadata("/dev/null").unwrap().is_file());
    }
}
