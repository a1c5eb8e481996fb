//! Reads the text of a scene: from a file, from standard input, from a pipe; never without end.

#[cfg(unix)]
use std::time::{Duration, Instant};
use std::{
    fs::File,
    io::{self, ErrorKind, Read},
    path::Path,
};

use crate::load::{
    mapped::{OpenError, open_at_once, special},
    refused::Refused,
};
use planisphere_core::{drawing::Control, text};
use planisphere_memory as memory;

/// Bytes of a scene's text, at most: some ten million spheres. Arrays are for more.
const LONGEST: usize = 1 << 30;

/// How long a pipe is waited for that nobody writes to.
#[cfg(unix)]
const PATIENCE: Duration = Duration::from_secs(1);

/// Milliseconds that are waited for bytes, before it is asked again whether they are still wanted.
#[cfg(unix)]
const WAIT: libc::c_int = 10;

/// Reads a scene file; `-` is standard input.
///
/// # Errors
/// When it cannot be read, is no text, or has no end within [`LONGEST`]; when it is cancelled.
pub(super) fn read(path: &Path, control: &Control) -> Result<Vec<u8>, Refused> {
    Refused::if_cancelled(control)?;
    if path == Path::new("-") {
        #[cfg(unix)]
        return read_all(Stdin(io::stdin().lock()), 0, control);
        #[cfg(not(unix))]
        return read_all(io::stdin().lock(), 0, control);
    }
    let unread = |error: io::Error| match OpenError::from(error) {
        error @ OpenError::Missing => {
            Refused::new(error.to_string(), "correct the name of the scene file")
        }
        OpenError::Io(error) => Refused::new(error.to_string(), OpenError::fix(&error)),
        error @ OpenError::NotRegular(_) => Refused::new(error.to_string(), "name a regular file"),
    };
    let refuse = |metadata: &std::fs::Metadata| match special(metadata) {
        None | Some("a pipe") => Ok(()),
        Some("a folder") => {
            Err(Refused::new("is a folder", "name a scene file (TOML) instead of a folder"))
        }
        Some(what) => {
            let fix = "name a scene file (TOML), or `-`, which is standard input";
            Err(Refused::new(format!("is {what}, not a file"), fix))
        }
    };
    // To open a device can have effects of its own.
    refuse(&std::fs::metadata(path).map_err(unread)?)?;
    let file = open_at_once(path).map_err(unread)?;
    let metadata = file.metadata().map_err(unread)?;
    refuse(&metadata)?;
    if special(&metadata).is_some() {
        #[cfg(unix)]
        return read_all(Pipe { file, written: false, opened: Instant::now() }, 0, control);
    }
    if metadata.len() > LONGEST as u64 {
        return Err(too_long());
    }
    read_all(file, metadata.len() as usize, control)
}

fn too_long() -> Refused {
    Refused::new(
        format!("is longer than {}", text::bytes(LONGEST as u64)),
        "put the spheres into arrays ([[spheres]], centers = \"centers.npy\"), which have no such \
         limit",
    )
}

/// Reads to the end, of about so many bytes where that is known. Bytes that no text has end it
/// early.
fn read_all(mut from: impl Read, expected: usize, control: &Control) -> Result<Vec<u8>, Refused> {
    const STEP: usize = 1 << 20;
    let mut text = Vec::new();
    let mut piece = vec![0; STEP.min(expected.max(1 << 16))];
    let mut room = expected;
    loop {
        Refused::if_cancelled(control)?;
        if text.len() + piece.len() > text.capacity() {
            // Twice as much each time, so that little is moved.
            room = room
                .max(text.len() + piece.len())
                .max(text.capacity().saturating_mul(2).min(LONGEST + STEP));
            let length = text.len() as u64;
            let no_room = |available: Option<u64>| {
                let there = available.map_or(String::new(), |bytes| {
                    format!(", and {} is available", text::bytes(bytes))
                });
                let words =
                    format!("takes more than {} of memory to read{there}", text::bytes(length));
                Refused::new(
                    words,
                    "free some memory, or put the spheres into arrays, which are not copied",
                )
            };
            let more = room - text.len();
            memory::room(more as u64).map_err(|available| no_room(Some(available)))?;
            text.try_reserve_exact(more).map_err(|_| no_room(None))?;
        }
        let read = match from.read(&mut piece) {
            Ok(0) => return Ok(text),
            Ok(read) => read,
            Err(error) if error.kind() == ErrorKind::Interrupted => continue,
            Err(error) if error.kind() == ErrorKind::TimedOut => {
                return Err(Refused::new(
                    "is a pipe that nothing writes to",
                    "start what writes to it first",
                ));
            }
            Err(error) => {
                return Err(Refused::new(error.to_string(), "make the scene file readable"));
            }
        };
        let start = if text.is_empty() { &piece[..read] } else { &text[..] };
        if let [0xff, 0xfe, ..] | [0xfe, 0xff, ..] = *start {
            let fix = "save it as UTF-8 (in PowerShell: `... | Set-Content -Encoding utf8 FILE`, \
                       not `> FILE`)";
            return Err(Refused::new("is UTF-16 text, but a scene file is UTF-8", fix));
        }
        if let Some(at) = piece[..read].iter().position(|&byte| byte == 0) {
            // No text goes on after it: what is read shows where it stands, and what has no end is
            // not read on.
            text.extend_from_slice(&piece[..=at]);
            return Ok(text);
        }
        text.extend_from_slice(&piece[..read]);
        if text.len() > LONGEST {
            return Err(too_long());
        }
    }
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

    #[test]
    fn what_has_no_end_is_ended() {
        assert_eq!(
            read_all(io::repeat(0), 0, &Control::new()).unwrap(),
            [0],
            "what shows that it is no text"
        );
        assert_eq!(read_all(&b"ab\0cd\0"[..], 6, &Control::new()).unwrap(), b"ab\0");
        let text = read_all(io::repeat(b'#'), 0, &Control::new()).expect_err("no end");
        assert!(text.words.contains("longer than 1.1 GB"), "{text:?}");
        assert_eq!(read_all(&b"words"[..], 0, &Control::new()).unwrap(), b"words");
        assert_eq!(read_all(&b"words"[..], 5, &Control::new()).unwrap(), b"words");
        let long = vec![b'x'; (3 << 20) + 7];
        assert_eq!(read_all(&long[..], 2, &Control::new()).unwrap(), long);
    }
}
