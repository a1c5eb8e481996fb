//! Opens an input (a file, standard input, a pipe), and reads it piece by piece, with waits that
//! can be cancelled. Reads the text of a scene from it, never without end.

#[cfg(unix)]
use std::time::{Duration, Instant};
use std::{
    fs::{File, Metadata},
    io::{self, ErrorKind, Read},
    ops::Range,
    path::Path,
};

use crate::input::{
    mapped::{OpenError, open_at_once, special},
    refused::Refused,
};
use planisphere_core::{drawing::Control, text};
use planisphere_memory as memory;

/// Bytes of a scene's text, at most: some ten million spheres. Arrays are for more.
const LONGEST: usize = 1 << 30;

/// Bytes that are asked for at a time, once an input turns out to be long.
const STEP: usize = 1 << 20;

/// Bytes that are asked for at a time, at least. Standard input keeps bytes of its own when it is
/// asked for fewer than 8192, and it would not be seen that they are there.
const LEAST: usize = 1 << 16;

/// How long a pipe is waited for that nobody writes to.
#[cfg(unix)]
const PATIENCE: Duration = Duration::from_secs(1);

/// Milliseconds that are waited for bytes, before it is asked again whether they are still wanted.
#[cfg(unix)]
const WAIT: libc::c_int = 10;

/// An input that was opened.
pub(crate) enum Opened {
    /// A regular file.
    File(File, Metadata),
    /// Standard input, or a pipe, which can only be read once.
    Stream(Box<dyn Read>),
}

/// Opens a scene file, or one of particles; `-` is standard input.
///
/// # Errors
/// When it cannot be read; when it is cancelled.
pub(crate) fn open(path: &Path, control: &Control) -> Result<Opened, Refused> {
    Refused::if_cancelled(control)?;
    if path == Path::new("-") {
        #[cfg(unix)]
        return Ok(Opened::Stream(Box::new(Stdin(io::stdin().lock()))));
        #[cfg(not(unix))]
        return Ok(Opened::Stream(Box::new(io::stdin().lock())));
    }
    let unread = |error: io::Error| match OpenError::from(error) {
        error @ OpenError::Missing => {
            Refused::new(error.to_string(), "correct the name of the file")
        }
        OpenError::Io(error) => Refused::new(error.to_string(), OpenError::fix(&error)),
        error @ OpenError::NotRegular(_) => Refused::new(error.to_string(), "name a regular file"),
    };
    let refuse = |metadata: &Metadata| match special(metadata) {
        None | Some("a pipe") => Ok(()),
        Some("a folder") => Err(Refused::new("is a folder", "name a file instead of a folder")),
        Some(what) => {
            let fix = "name a file, or `-`, which is standard input";
            Err(Refused::new(format!("is {what}, not a file"), fix))
        }
    };
    // To open a device can have effects of its own.
    refuse(&std::fs::metadata(path).map_err(unread)?)?;
    let file = open_at_once(path).map_err(unread)?;
    let metadata = file.metadata().map_err(unread)?;
    refuse(&metadata)?;
    if special(&metadata).is_none() {
        return Ok(Opened::File(file, metadata));
    }
    #[cfg(unix)]
    let file = Pipe { file, written: false, opened: Instant::now() };
    Ok(Opened::Stream(Box::new(file)))
}

/// Reads a scene file; `-` is standard input.
///
/// # Errors
/// When it cannot be read, is no text, or has no end within [`LONGEST`]; when it is cancelled.
pub(crate) fn read(path: &Path, control: &Control) -> Result<Vec<u8>, Refused> {
    match open(path, control)? {
        Opened::File(file, metadata) => text(&mut Source::new(file, control), metadata.len()),
        Opened::Stream(from) => text(&mut Source::new(from, control), 0),
    }
}

/// Bytes that come one after another, and those of them that were read ahead.
pub(crate) struct Source<R> {
    from: R,
    control: Control,
    buffer: Vec<u8>,
    /// Where in the buffer the bytes lie that were read and not taken.
    ahead: Range<usize>,
    /// Bytes that were read so far.
    read: u64,
}

impl<R: Read> Source<R> {
    /// Nothing is read before it is asked for.
    pub fn new(from: R, control: &Control) -> Self {
        Self { from, control: control.clone(), buffer: Vec::new(), ahead: 0..0, read: 0 }
    }

    /// What was read ahead.
    pub fn ahead(&self) -> &[u8] {
        &self.buffer[self.ahead.clone()]
    }

    /// The next bytes, at least one; none at the end only.
    ///
    /// # Errors
    /// When they cannot be read; when it is cancelled.
    pub fn next(&mut self) -> Result<&[u8], Refused> {
        if self.ahead.is_empty() {
            self.fill()?;
        }
        Ok(self.ahead())
    }

    /// The next so many bytes, or more of them; fewer where the end is near.
    ///
    /// # Errors
    /// As [`Source::next`].
    #[cfg(feature = "particles")]
    pub fn peek(&mut self, wanted: usize) -> Result<&[u8], Refused> {
        while self.ahead.len() < wanted && self.fill()? > 0 {}
        Ok(self.ahead())
    }

    /// Goes on behind so many of the bytes that were read ahead.
    pub fn take(&mut self, bytes: usize) {
        self.ahead.start = self.ahead.start.saturating_add(bytes).min(self.ahead.end);
    }

    /// Goes on behind so many bytes, or the last one; how many they were.
    ///
    /// # Errors
    /// As [`Source::next`].
    #[cfg(feature = "compressed")]
    pub fn pass(&mut self, bytes: u64) -> Result<u64, Refused> {
        let mut passed = 0;
        while passed < bytes {
            let there = self.next()?.len();
            if there == 0 {
                break;
            }
            let taken = usize::try_from(bytes - passed).map_or(there, |left| left.min(there));
            self.take(taken);
            passed += taken as u64;
        }
        Ok(passed)
    }

    /// Ends what is read once it is cancelled, where nothing is read for long.
    #[cfg(feature = "compressed")]
    pub fn check(&self) -> Result<(), Refused> {
        Refused::if_cancelled(&self.control)
    }

    /// Reads more ahead; how many bytes, none at the end.
    fn fill(&mut self) -> Result<usize, Refused> {
        self.buffer.copy_within(self.ahead.clone(), 0);
        self.ahead = 0..self.ahead.len();
        let step = if self.read < LEAST as u64 { LEAST } else { STEP };
        if self.buffer.len() < self.ahead.end + LEAST {
            self.buffer.resize(self.ahead.end + step, 0);
        } else if self.buffer.len() < step {
            self.buffer.resize(step, 0);
        }
        loop {
            Refused::if_cancelled(&self.control)?;
            match self.from.read(&mut self.buffer[self.ahead.end..]) {
                Ok(read) => {
                    self.ahead.end += read;
                    self.read += read as u64;
                    return Ok(read);
                }
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) if error.kind() == ErrorKind::TimedOut => {
                    let fix = "start what writes to it first";
                    return Err(Refused::new("is a pipe that nothing writes to", fix));
                }
                Err(error) => {
                    return Err(error.downcast().unwrap_or_else(|error| {
                        Refused::new(error.to_string(), "make the file readable")
                    }));
                }
            }
        }
    }
}

fn too_long() -> Refused {
    Refused::new(
        format!("is longer than {}", text::bytes(LONGEST as u64)),
        "put the spheres into arrays ([[spheres]], centers = \"centers.npy\"), which have no such \
         limit",
    )
}

/// Reads the text of a scene to its end, of about so many bytes where that is known. Bytes that no
/// text has end it early.
///
/// # Errors
/// When it cannot be read, is no text, or has no end within [`LONGEST`]; when it is cancelled.
pub(crate) fn text<R: Read>(from: &mut Source<R>, expected: u64) -> Result<Vec<u8>, Refused> {
    let expected = usize::try_from(expected).ok().filter(|&bytes| bytes <= LONGEST);
    let mut room = expected.ok_or_else(too_long)?;
    let mut text = Vec::new();
    loop {
        let piece = from.next()?;
        if piece.is_empty() {
            return Ok(text);
        }
        if text.len() + piece.len() > text.capacity() {
            // Twice as much each time, so that little is moved.
            room = room
                .max(text.len() + piece.len())
                .max(text.capacity().saturating_mul(2).min(LONGEST + STEP));
            make_room(&mut text, room)?;
        }
        let start = if text.is_empty() { piece } else { &text[..] };
        if let [0xff, 0xfe, ..] | [0xfe, 0xff, ..] = *start {
            let fix = "save it as UTF-8 (in PowerShell: `... | Set-Content -Encoding utf8 FILE`, \
                       not `> FILE`)";
            return Err(Refused::new("is UTF-16 text, but a scene file is UTF-8", fix));
        }
        if let Some(at) = piece.iter().position(|&byte| byte == 0) {
            // No text goes on after it: what is read shows where it stands, and what has no end is
            // not read on.
            text.extend_from_slice(&piece[..=at]);
            return Ok(text);
        }
        text.extend_from_slice(piece);
        if text.len() > LONGEST {
            return Err(too_long());
        }
        let taken = piece.len();
        from.take(taken);
    }
}

/// Gives a text room for so many bytes in all.
fn make_room(text: &mut Vec<u8>, room: usize) -> Result<(), Refused> {
    let length = text.len() as u64;
    let no_room = |available: Option<u64>| {
        let there = available
            .map_or(String::new(), |bytes| format!(", and {} is available", text::bytes(bytes)));
        let words = format!("takes more than {} of memory to read{there}", text::bytes(length));
        Refused::new(
            words,
            "free some memory, or put the spheres into arrays, which are not copied",
        )
    };
    let more = room.saturating_sub(text.len());
    memory::room(more as u64).map_err(|available| no_room(Some(available)))?;
    text.try_reserve_exact(more).map_err(|_| no_room(None))
}

/// Whether bytes, an end or an error can be read at once; waits a moment for them.
#[cfg(unix)]
fn ready(from: &impl std::os::fd::AsRawFd) -> io::Result<bool> {
    let mut poll = libc::pollfd { fd: from.as_raw_fd(), events: libc::POLLIN, revents: 0 };
    // SAFETY: one structure of the system's own layout, for a descriptor that is open.
    match unsafe { libc::poll(&raw mut poll, 1, WAIT) } {
        found if found < 0 => Err(io::Error::last_os_error()),
        found => Ok(found > 0),
    }
}

/// Standard input, which is interrupted again and again while nothing comes.
#[cfg(unix)]
struct Stdin(io::StdinLock<'static>);

#[cfg(unix)]
impl Read for Stdin {
    fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
        if ready(&self.0)? { self.0.read(to) } else { Err(ErrorKind::Interrupted.into()) }
    }
}

/// A pipe that was opened without waiting for its writer: this waits, a moment for one to come, and
/// then for what it writes, and is interrupted again and again meanwhile.
#[cfg(unix)]
struct Pipe {
    file: File,
    /// Whether there is, or was, a writer.
    written: bool,
    opened: Instant,
}

#[cfg(unix)]
impl Read for Pipe {
    fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
        match self.file.read(to) {
            Ok(0) if !self.written && self.opened.elapsed() < PATIENCE => {
                std::thread::sleep(Duration::from_millis(2));
                Err(ErrorKind::Interrupted.into())
            }
            Ok(0) if !self.written => Err(ErrorKind::TimedOut.into()),
            Err(error) if error.kind() == ErrorKind::WouldBlock => {
                self.written = true;
                ready(&self.file)?;
                Err(ErrorKind::Interrupted.into())
            }
            other => {
                self.written |= other.is_ok();
                other
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read_all(from: impl Read, expected: u64) -> Result<Vec<u8>, Refused> {
        text(&mut Source::new(from, &Control::new()), expected)
    }

    #[test]
    fn what_has_no_end_is_ended() {
        assert_eq!(read_all(io::repeat(0), 0).unwrap(), [0], "what shows that it is no text");
        assert_eq!(read_all(&b"ab\0cd\0"[..], 6).unwrap(), b"ab\0");
        let text = read_all(io::repeat(b'#'), 0).expect_err("no end");
        assert!(text.words.contains("longer than 1.1 GB"), "{text:?}");
        assert_eq!(read_all(&b"words"[..], 0).unwrap(), b"words");
        assert_eq!(read_all(&b"words"[..], 5).unwrap(), b"words");
        let long = vec![b'x'; (3 << 20) + 7];
        assert_eq!(read_all(&long[..], 2).unwrap(), long);
    }
}
