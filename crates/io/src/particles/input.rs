//! Makes the bytes of an input of particles from a file, standard input or a pipe: mapped or in
//! memory, and unpacked where it is compressed.
//!
//! It goes in two steps, since what is read can be particles or a scene: the beginning is looked at
//! ([`Beginning::bytes`]), and then all of it is asked for. What has no file of its own lies in
//! memory up to [`IN_MEMORY`] bytes, and beyond that in a temporary file without a name, so that
//! little memory is taken however long it is.

use std::{
    fs::File,
    io::{self, ErrorKind, Read, Seek, Write},
    path::{Path, PathBuf},
};

use bytes::Bytes;

use super::{Data, packing::Packing};
use crate::input::{
    mapped::{Mapped, OpenError, ReadError, SMALL, read_at, read_whole},
    refused::Refused,
    stream::{self, Opened, Source},
};
use planisphere_core::{drawing::Control, text};
use planisphere_memory as memory;

/// Bytes that are looked at, to tell what an input is.
const BEGINNING: usize = 1 << 16;

/// Bytes that lie in memory, at most, of what has no file of its own.
const IN_MEMORY: usize = 64 << 20;

/// An input whose beginning was looked at.
pub(crate) struct Beginning {
    name: PathBuf,
    pub(super) packed: Option<&'static str>,
    rest: Rest,
}

/// Where the rest of it comes from.
enum Rest {
    /// A regular file, used as it is.
    File { beginning: Vec<u8>, file: File, length: u64, control: Control },
    /// What can only be read once.
    Stream(Source<Box<dyn Read>>),
    #[cfg(feature = "compressed")]
    Packed {
        source: Source<Box<super::unpack::Unpacker>>,
        left_out: std::rc::Rc<std::cell::Cell<u64>>,
        /// The file that is unpacked.
        used: Option<crate::input::mapped::Used>,
    },
}

/// All bytes of an input.
#[derive(Debug)]
pub(crate) struct Input {
    /// The bytes, unpacked.
    pub data: Data,
    /// What they were compressed with.
    pub packed: Option<&'static str>,
    /// What a person should hear of it, each one line.
    pub notes: Vec<String>,
}

impl Beginning {
    /// Opens a file, or standard input for `-`, and looks at its beginning.
    ///
    /// # Errors
    /// When it cannot be read or unpacked; when it is cancelled.
    pub fn open(path: &Path, control: &Control) -> Result<Self, Refused> {
        match stream::open(path, control)? {
            Opened::File(file, metadata) => {
                let beginning = read_at(&file, BEGINNING, 0).map_err(|error| unread(&error))?;
                let Some(packing) = Packing::of(&beginning) else {
                    let (length, control) = (metadata.len(), control.clone());
                    let rest = Rest::File { beginning, file, length, control };
                    return Ok(Self { name: path.into(), packed: None, rest });
                };
                let mut readable = file.try_clone().map_err(|error| unread(&error))?;
                readable.rewind().map_err(|error| unread(&error))?;
                let source = Source::new(Box::new(readable) as Box<dyn Read>, control);
                Self::packed(path, packing, source, Some(file), control)
            }
            Opened::Stream(from) => Self::of_stream(path, from, control),
        }
    }

    /// Looks at the beginning of what can be read once; `name` is for messages.
    pub(super) fn of_stream(
        name: &Path,
        from: Box<dyn Read>,
        control: &Control,
    ) -> Result<Self, Refused> {
        let mut source = Source::new(from, control);
        match Packing::of(source.peek(BEGINNING)?) {
            None => Ok(Self { name: name.into(), packed: None, rest: Rest::Stream(source) }),
            Some(packing) => Self::packed(name, packing, source, None, control),
        }
    }

    /// Unpacks the beginning.
    #[cfg(feature = "compressed")]
    fn packed(
        name: &Path,
        packing: Packing,
        mut source: Source<Box<dyn Read>>,
        file: Option<File>,
        control: &Control,
    ) -> Result<Self, Refused> {
        use super::unpack::Unpacker;
        use crate::input::mapped::Used;
        let used = match file {
            Some(mut file) => {
                // From its beginning again, so that no change of it is missed.
                let mut again = || {
                    io::Seek::rewind(&mut file)?;
                    let readable: Box<dyn Read> = Box::new(file.try_clone()?);
                    Ok((Source::new(readable, control), Used::new(name, file.try_clone()?)?))
                };
                let (from, used) = again().map_err(|error| unread(&error))?;
                source = from;
                Some(used)
            }
            None => None,
        };
        let unpacker = Unpacker::new(packing, source);
        let left_out = unpacker.left_out();
        let mut source = Source::new(Box::new(unpacker), control);
        if let Some(inner) = Packing::of(source.peek(BEGINNING)?) {
            return Err(Refused::new(
                format!("is compressed twice: {} within {}", inner.name(), packing.name()),
                format!("unpack it once with {}", packing.tool()),
            ));
        }
        let rest = Rest::Packed { source, left_out, used };
        Ok(Self { name: name.into(), packed: Some(packing.name()), rest })
    }

    /// Refuses what is compressed.
    #[cfg(not(feature = "compressed"))]
    fn packed(
        _: &Path,
        packing: Packing,
        _: Source<Box<dyn Read>>,
        _: Option<File>,
        _: &Control,
    ) -> Result<Self, Refused> {
        Err(Refused::new(
            format!("is compressed with {}, which was left out of this program", packing.name()),
            format!("unpack it with {}", packing.tool()),
        ))
    }

    /// The beginning, unpacked: 64 KiB, or all of what is shorter.
    pub fn bytes(&self) -> &[u8] {
        match &self.rest {
            Rest::File { beginning, .. } => beginning,
            Rest::Stream(source) => source.ahead(),
            #[cfg(feature = "compressed")]
            Rest::Packed { source, .. } => source.ahead(),
        }
    }

    /// All of it, as particles are read.
    ///
    /// # Errors
    /// When it cannot be read or unpacked, or changes meanwhile; when it is cancelled.
    pub fn into_data(self) -> Result<Input, Refused> {
        let (name, packed) = (self.name, self.packed);
        let input = |data| Input { data, packed, notes: Vec::new() };
        match self.rest {
            Rest::File { file, length, .. } if length > SMALL => {
                let mapped = Mapped::new(&name, file).map_err(|error| unread(&error))?;
                Ok(input(Data::from(mapped)))
            }
            // Files that the system makes up have no length, and can be read all the same.
            Rest::File { file, length, .. } if length > 0 => match read_whole(&name, &file) {
                Ok(bytes) => Ok(input(Data::from(Bytes::from(bytes)))),
                Err(ReadError::Io(error)) => Err(unread(&error)),
                Err(ReadError::Changed) => Err(changed()),
            },
            Rest::File { mut file, control, .. } => {
                file.rewind().map_err(|error| unread(&error))?;
                Ok(input(Spool::all(&mut Source::new(file, &control), &name)?))
            }
            Rest::Stream(mut source) => Ok(input(Spool::all(&mut source, &name)?)),
            #[cfg(feature = "compressed")]
            Rest::Packed { mut source, left_out, used } => {
                let data = Spool::all(&mut source, &name);
                if used.is_some_and(|used| used.changed().is_some()) {
                    return Err(changed());
                }
                let mut input = input(data?);
                if let bytes @ 1.. = left_out.get() {
                    let packed = packed.unwrap_or_default();
                    let note = format!("{bytes} bytes behind the {packed} data were left out");
                    input.notes.push(note);
                }
                Ok(input)
            }
        }
    }

    /// All of it, as the text of a scene.
    ///
    /// # Errors
    /// When it cannot be read, is no text or has no end; when it is cancelled.
    pub fn into_text(self) -> Result<Vec<u8>, Refused> {
        match self.rest {
            Rest::File { mut file, length, control, .. } => {
                file.rewind().map_err(|error| unread(&error))?;
                stream::text(&mut Source::new(file, &control), length)
            }
            Rest::Stream(mut source) => stream::text(&mut source, 0),
            #[cfg(feature = "compressed")]
            Rest::Packed { mut source, .. } => stream::text(&mut source, 0),
        }
    }
}

/// The words for a file that cannot be read.
fn unread(error: &io::Error) -> Refused {
    Refused::new(format!("cannot be read: {error}"), OpenError::fix(error))
}

/// The words for a file that somebody writes to.
fn changed() -> Refused {
    use crate::input::mapped::ChangedFile;
    Refused::new(ChangedFile::PROBLEM, ChangedFile::FIX)
}

/// Bytes that come one after another: in memory, and when they are many in a temporary file.
struct Spool {
    memory: Vec<u8>,
    file: Option<File>,
    length: u64,
}

impl Spool {
    /// Reads to the end; `name` is for messages.
    fn all<R: Read>(source: &mut Source<R>, name: &Path) -> Result<Data, Refused> {
        let mut spool = Self { memory: Vec::new(), file: None, length: 0 };
        loop {
            let piece = source.next()?;
            if piece.is_empty() {
                return spool.into_data(name);
            }
            spool.push(piece)?;
            let taken = piece.len();
            source.take(taken);
        }
    }

    fn push(&mut self, piece: &[u8]) -> Result<(), Refused> {
        self.length += piece.len() as u64;
        if self.file.is_none() && self.memory.len() + piece.len() <= IN_MEMORY {
            return self.remember(piece);
        }
        let kept = match &mut self.file {
            Some(file) => file.write_all(piece),
            None => tempfile::tempfile_in(std::env::temp_dir()).and_then(|mut file| {
                let first = std::mem::take(&mut self.memory);
                file.write_all(&first)?;
                file.write_all(piece)?;
                self.file = Some(file);
                Ok(())
            }),
        };
        kept.map_err(|error| not_kept(self.length, &error))
    }

    /// Adds to what lies in memory.
    fn remember(&mut self, piece: &[u8]) -> Result<(), Refused> {
        let memory = &mut self.memory;
        if memory.len() + piece.len() > memory.capacity() {
            // Twice as much each time, so that little is moved.
            let room = memory.capacity().saturating_mul(2).min(IN_MEMORY);
            let more = room.max(memory.len() + piece.len()) - memory.len();
            let fits = memory::room(more as u64).is_ok() && memory.try_reserve_exact(more).is_ok();
            if !fits {
                let words = format!("takes more than {} of memory", text::bytes(self.length));
                return Err(Refused::new(words, "free some memory"));
            }
        }
        memory.extend_from_slice(piece);
        Ok(())
    }

    fn into_data(self, name: &Path) -> Result<Data, Refused> {
        let Self { memory, file, length } = self;
        let Some(file) = file else { return Ok(Data::from(Bytes::from(memory))) };
        let mapped = Mapped::new(name, file).map_err(|error| not_kept(length, &error))?;
        Ok(Data::from(mapped))
    }
}

/// The words for a temporary file that cannot be used.
fn not_kept(length: u64, error: &io::Error) -> Refused {
    let folder = text::name(std::env::temp_dir());
    let length = text::bytes(length);
    match error.kind() {
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded | ErrorKind::FileTooLarge => {
            Refused::new(
                format!("has more than {length}, for which {folder} has no room"),
                "set TMPDIR to a folder with more room, or name a file that is not compressed",
            )
        }
        _ => Refused::new(
            format!("has more than {length}, which cannot be kept in {folder}: {error}"),
            "set TMPDIR to a folder for temporary files that can be written to",
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stream(bytes: &[u8]) -> Beginning {
        let from = Box::new(io::Cursor::new(bytes.to_vec()));
        Beginning::of_stream(Path::new("it"), from, &Control::new()).unwrap()
    }

    /// The same bytes in all ways: first looked at, and then asked for as particles or as text.
    #[test]
    fn inputs_are_looked_at_and_then_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        let long: Vec<u8> = (0..3 << 20).map(|at: u32| b' ' + (at % 91) as u8).collect();
        for length in [0, 1, 9000, 1 << 16, (1 << 16) + 1, 1 << 18, (1 << 18) + 1, 3 << 20] {
            let bytes = &long[..length];
            std::fs::write(&path, bytes).unwrap();
            let open = || Beginning::open(&path, &Control::new()).unwrap();
            for begin in [&open as &dyn Fn() -> Beginning, &|| stream(bytes)] {
                assert!(begin().bytes() == &bytes[..length.min(BEGINNING)], "{length}");
                assert_eq!(begin().packed, None);
                assert!(begin().into_data().unwrap().data.as_slice() == bytes, "{length}");
                assert!(begin().into_text().unwrap() == bytes, "{length}");
            }
            let mapped = open().into_data().unwrap().data.mapped().is_some();
            assert_eq!(mapped, length as u64 > SMALL, "{length}");
        }
    }

    /// Such files have no length that is known.
    #[cfg(target_os = "linux")]
    #[test]
    fn files_that_the_system_makes_up_are_read() {
        let status = Path::new("/proc/self/status");
        let read = Beginning::open(status, &Control::new()).unwrap().into_data().unwrap();
        assert!(read.data.as_slice().starts_with(b"Name:"));
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_full_disk_is_told() {
        let file = File::options().write(true).open("/dev/full").unwrap();
        let mut spool = Spool { memory: Vec::new(), file: Some(file), length: 99 << 20 };
        let error = spool.push(b"more").expect_err("it is full");
        let folder = std::env::temp_dir();
        let wanted = format!("has more than 103 MB, for which {} has no room", folder.display());
        assert_eq!(error.words, wanted);
        assert!(error.fix.starts_with("set TMPDIR"), "{error:?}");
    }

    #[test]
    fn what_cannot_be_read_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let refused = |path: &Path| Beginning::open(path, &Control::new()).err().unwrap().words;
        assert_eq!(refused(folder.path()), "is a folder");
        assert_eq!(refused(&folder.path().join("gone")), "no such file");
        let control = Control::new();
        control.cancel();
        let error = Beginning::open(Path::new("-"), &control).err().unwrap();
        assert_eq!(error.words, crate::input::report::CANCELLED);
    }

    #[cfg(not(feature = "compressed"))]
    #[test]
    fn what_is_compressed_is_refused_with_the_tool() {
        let from = Box::new(&b"BZh9\x31\x41\x59\x26\x53\x59"[..]);
        let error = Beginning::of_stream(Path::new("it"), from, &Control::new()).err().unwrap();
        assert_eq!(error.words, "is compressed with bzip2, which was left out of this program");
        assert_eq!(error.fix, "unpack it with bunzip2");
    }
}
