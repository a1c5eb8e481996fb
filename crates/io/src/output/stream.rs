//! Descriptors that the process was started with: standard output, standard error, and those that a
//! shell opens (`3>file`). They are written to where they stand, and never closed.

use std::{
    fs::File,
    io,
    sync::atomic::{AtomicU8, Ordering::Relaxed},
};

use super::error::OutputError;
use crate::identity::Identity;

/// Bit k: descriptor k was closed when the process began. Rust's runtime then opens `/dev/null` in
/// its place, so that later nothing shows it.
static CLOSED: AtomicU8 = AtomicU8::new(0);

/// Tells which of standard input, output and error were closed when the process began. Only the
/// program's first lines, before Rust's own start, can know.
pub fn were_closed(streams: [bool; 3]) {
    let bits = (0..3).filter(|&k| streams[k]).map(|k| 1 << k).sum();
    CLOSED.store(bits, Relaxed);
}

fn was_closed(number: i32) -> bool {
    (0..3).contains(&number) && CLOSED.load(Relaxed) >> number & 1 == 1
}

/// Refuses a descriptor that is closed, or that nothing can be written to.
///
/// # Errors
/// When it is.
pub(super) fn check(number: i32) -> Result<(), OutputError> {
    if was_closed(number) || !is_open(number) {
        return Err(OutputError::Closed(number));
    }
    if !is_writable(number) { Err(OutputError::NotForWriting(number)) } else { Ok(()) }
}

#[cfg(unix)]
fn borrowed<T>(number: i32, use_it: impl FnOnce(std::os::fd::BorrowedFd) -> T) -> Option<T> {
    // SAFETY: the call fails for a number that is not open, and touches nothing.
    if number < 0 || unsafe { libc::fcntl(number, libc::F_GETFD) } == -1 {
        return None;
    }
    // SAFETY: it is open, as just seen, and closed nowhere in this program before its end: it came
    // from whoever started it.
    Some(use_it(unsafe { std::os::fd::BorrowedFd::borrow_raw(number) }))
}

#[cfg(unix)]
fn is_open(number: i32) -> bool {
    borrowed(number, |_| ()).is_some()
}

#[cfg(unix)]
fn is_writable(number: i32) -> bool {
    use rustix::fs::OFlags;
    let flags = borrowed(number, |fd| rustix::fs::fcntl_getfl(fd));
    // A path alone (`O_PATH`) is no open file.
    flags.is_some_and(|flags| {
        flags.is_ok_and(|flags| {
            !flags.contains(OFlags::PATH) && flags.intersects(OFlags::WRONLY | OFlags::RDWR)
        })
    })
}

/// The same open file under another number, which may be closed.
#[cfg(unix)]
pub(super) fn duplicate(number: i32) -> io::Result<File> {
    let closed = || io::Error::from_raw_os_error(libc::EBADF);
    if was_closed(number) {
        return Err(closed());
    }
    borrowed(number, |fd| fd.try_clone_to_owned().map(File::from)).ok_or_else(closed)?
}

#[cfg(not(unix))]
fn is_open(number: i32) -> bool {
    (1..3).contains(&number)
}

#[cfg(not(unix))]
fn is_writable(number: i32) -> bool {
    (1..3).contains(&number)
}

#[cfg(windows)]
pub(super) fn duplicate(number: i32) -> io::Result<File> {
    use std::os::windows::io::AsHandle;
    let handle = match number {
        1 => io::stdout().as_handle().try_clone_to_owned()?,
        2 => io::stderr().as_handle().try_clone_to_owned()?,
        _ => return Err(io::ErrorKind::NotFound.into()),
    };
    Ok(handle.into())
}

/// Which file a stream of this process leads to: 0, 1 and 2 are standard input, output and error.
///
/// # Errors
/// When it is closed.
pub fn identity(number: i32) -> io::Result<Identity> {
    Identity::of_file(&duplicate(number)?)
}

/// Writes, and waits for a reader of a pipe that was set not to block.
pub(super) struct Stream(pub File);

impl io::Write for Stream {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        loop {
            match self.0.write(bytes) {
                #[cfg(unix)]
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => {
                    use rustix::event::{PollFd, PollFlags, poll};
                    poll(&mut [PollFd::new(&self.0, PollFlags::OUT)], None)?;
                }
                result => return result,
            }
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        self.0.flush()
    }
}

/// Tells what the system has put off telling: some file systems say only when a file is closed that
/// there was no room.
///
/// # Errors
/// The system's.
#[cfg(unix)]
pub(super) fn flushed(file: &File) -> io::Result<()> {
    use std::os::fd::IntoRawFd;
    // A close of one descriptor of several tells as well; the others stay open.
    let copy = file.try_clone()?.into_raw_fd();
    // SAFETY: the descriptor is ours, and nobody else's.
    if unsafe { libc::close(copy) } == 0 { Ok(()) } else { Err(io::Error::last_os_error()) }
}

#[cfg(not(unix))]
pub(super) fn flushed(_: &File) -> io::Result<()> {
    Ok(())
}
