//! Files that are mapped while other programs may change them.
//!
//! A picture takes seconds, a window hours, and a file of numbers can be written to meanwhile.
//! Three things keep that from ending in a bus error or in a picture of half of each:
//!
//! * Only regular files are opened, and nothing here waits for one ([`open_regular`]).
//! * A mapping knows the file it is of ([`Mapped::changed`]): its length and the times of its last
//!   change, taken when it was opened. Whoever draws asks afterwards, before anything is given
//!   away, and throws the picture away when they differ.
//! * Where a file is cut short, reading its lost pages is a bus error (`SIGBUS`). A handler puts
//!   zeros in place of the whole mapping and notes it; the program goes on to the same question.
//!   Any other bus error goes where it went before.
//!
//! A name that leads elsewhere is no change: the mapping stays with the file it was opened from, so
//! that a file that is written beside and renamed over is never seen in part. Files of at most
//! [`SMALL`] bytes are read and not mapped.
//!
//! What the times of a file do not tell stays unseen: changes on another machine, for as long as a
//! network file system keeps what it knows (`actimeo` of NFS), and a program that had the file
//! mapped for writing, and had written to the same pages, before it was opened here. On systems
//! other than Unix a mapped file cannot be cut short, and there is no handler.

use std::{
    fmt,
    fs::{self, File, Metadata},
    io::{self, ErrorKind},
    path::{Path, PathBuf},
    sync::Arc,
};

use bytes::Bytes;
use memmap2::Mmap;

/// Files of at most so many bytes are read, not mapped: that is as fast, and they cannot change
/// afterwards. Measured, to open a file and add its numbers up: 13 us read and 18 us mapped at this
/// size, 48 us both ways at 1 MiB, 175 us and 61 us at 4 MiB.
pub(crate) const SMALL: u64 = 1 << 18;

/// A file that is in use has changed: nothing that was drawn meanwhile is right.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}: {}\nfix: {}", planisphere_core::text::name(.path), Self::PROBLEM, Self::FIX)]
pub struct ChangedFile {
    /// The file.
    pub path: PathBuf,
}

impl ChangedFile {
    /// What is wrong, to be read after the file's name.
    pub(crate) const PROBLEM: &str =
        "the file changed while it was in use, so that no picture of it is right";
    /// What to do about it.
    pub(crate) const FIX: &str = "draw again when it is finished; a file that is in use is best \
                                  replaced by writing another one and renaming that over it";
}

/// Why a file was not opened.
#[derive(Debug, thiserror::Error)]
pub(crate) enum OpenError {
    /// It is not there.
    #[error("no such file")]
    Missing,
    /// It is something else; says what.
    #[error("is {0}, not a regular file")]
    NotRegular(&'static str),
    /// The system's words.
    #[error("cannot be read: {0}")]
    Io(io::Error),
}

impl From<io::Error> for OpenError {
    fn from(error: io::Error) -> Self {
        if error.kind() == ErrorKind::NotFound { Self::Missing } else { Self::Io(error) }
    }
}

impl OpenError {
    /// What to do where it is not the name that is wrong.
    pub fn fix(error: &io::Error) -> &'static str {
        match error.kind() {
            ErrorKind::OutOfMemory => {
                "raise the limit of memory (`ulimit -v`), or draw fewer spheres at a time"
            }
            #[cfg(unix)]
            _ if matches!(error.raw_os_error(), Some(libc::EMFILE | libc::ENFILE)) => {
                "raise the limit of open files (`ulimit -n`), or join arrays"
            }
            _ => "make the file readable",
        }
    }
}

/// What a file is that is not regular; nothing of a regular one.
pub(crate) fn special(metadata: &Metadata) -> Option<&'static str> {
    let kind = metadata.file_type();
    if kind.is_file() {
        return None;
    }
    #[cfg(unix)]
    {
        use std::os::unix::fs::FileTypeExt;
        if kind.is_fifo() {
            return Some("a pipe");
        }
        if kind.is_socket() {
            return Some("a socket");
        }
        if kind.is_char_device() || kind.is_block_device() {
            return Some("a device");
        }
    }
    Some(if kind.is_dir() { "a folder" } else { "something else" })
}

/// Opens a file that must be regular, and never waits: what is at the name is looked at before and
/// after.
pub(crate) fn open_regular(path: &Path) -> Result<(File, Metadata), OpenError> {
    let refuse = |metadata: Metadata| {
        special(&metadata).map_or(Ok(metadata), |what| Err(OpenError::NotRegular(what)))
    };
    // To open a pipe or a device can have effects of its own.
    refuse(fs::metadata(path)?)?;
    let file = match open_at_once(path) {
        #[cfg(unix)]
        Err(error) if error.raw_os_error() == Some(libc::EMFILE) && more_descriptors() => {
            open_at_once(path)?
        }
        other => other?,
    };
    let metadata = refuse(file.metadata()?)?;
    Ok((file, metadata))
}

/// Opens a file to read; a pipe without a writer is not waited for.
pub(crate) fn open_at_once(path: &Path) -> io::Result<File> {
    let mut options = fs::OpenOptions::new();
    options.read(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::custom_flags(
        &mut options,
        libc::O_NONBLOCK | libc::O_NOCTTY,
    );
    options.open(path)
}

/// Takes as many descriptors as the system lets this process have. Each mapped array keeps one, so
/// that a scene of some hundred large arrays can need more than the usual 1024.
#[cfg(unix)]
fn more_descriptors() -> bool {
    let mut limit = libc::rlimit { rlim_cur: 0, rlim_max: 0 };
    // SAFETY: the system fills in a structure of its own layout.
    let known = unsafe { libc::getrlimit(libc::RLIMIT_NOFILE, &raw mut limit) } == 0;
    if !known || limit.rlim_cur >= limit.rlim_max {
        return false;
    }
    limit.rlim_cur = limit.rlim_max;
    // SAFETY: the structure is only read.
    unsafe { libc::setrlimit(libc::RLIMIT_NOFILE, &raw const limit) == 0 }
}

/// Reads `length` bytes from a place of a file; fewer where it ends.
pub(crate) fn read_at(file: &File, length: usize, from: u64) -> io::Result<Vec<u8>> {
    use std::io::{Read, Seek, SeekFrom};
    let mut bytes = Vec::new();
    bytes.try_reserve_exact(length).map_err(|_| io::Error::from(ErrorKind::OutOfMemory))?;
    // There is no other reader of this descriptor.
    let mut file = file;
    file.seek(SeekFrom::Start(from))?;
    file.take(length as u64).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// What tells whether a file is as it was.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Identity {
    length: u64,
    /// When the contents changed last, as far as anyone lets on.
    modified: (i64, i64),
    /// When anything about it changed last, its names and permissions included: the system's,
    /// nobody sets it back.
    changed: (i64, i64),
    /// How many names it has.
    links: u64,
    /// Device and number.
    place: (u64, u64),
}

impl Identity {
    #[cfg(unix)]
    fn of(metadata: &Metadata) -> Self {
        use std::os::unix::fs::MetadataExt;
        Self {
            length: metadata.len(),
            modified: (metadata.mtime(), metadata.mtime_nsec()),
            changed: (metadata.ctime(), metadata.ctime_nsec()),
            links: metadata.nlink(),
            place: (metadata.dev(), metadata.ino()),
        }
    }

    #[cfg(not(unix))]
    fn of(metadata: &Metadata) -> Self {
        let since = |time: std::time::SystemTime| {
            time.duration_since(std::time::UNIX_EPOCH).unwrap_or_default()
        };
        let modified = metadata.modified().map_or((0, 0), |time| {
            let since = since(time);
            (since.as_secs() as i64, i64::from(since.subsec_nanos()))
        });
        Self { length: metadata.len(), modified, changed: modified, links: 1, place: (0, 0) }
    }

    /// Whether the file can have other contents now. A name that came, went or leads elsewhere
    /// changes a file's times and nothing in it.
    fn differs(&self, now: &Self, path: &Path) -> bool {
        if (self.length, self.modified) != (now.length, now.modified) {
            return true;
        }
        let renamed =
            || fs::metadata(path).map_or(true, |there| Self::of(&there).place != self.place);
        self.changed != now.changed && self.links == now.links && !renamed()
    }
}

/// Waits, some milliseconds at most, until a change would have another time than the last one had:
/// a file's times are those of a clock that moves in steps.
fn settle(file: &File) -> io::Result<Identity> {
    for _ in 0..25 {
        let identity = Identity::of(&file.metadata()?);
        let last = identity.modified.max(identity.changed);
        // A time far ahead, from another machine's clock, is not waited for.
        if clock().is_none_or(|now| now > last || last.0 > now.0 + 1) {
            return Ok(identity);
        }
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    Ok(Identity::of(&file.metadata()?))
}

/// The clock that files' times are taken from.
#[cfg(any(target_os = "linux", target_os = "android"))]
fn clock() -> Option<(i64, i64)> {
    let mut now = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: the system fills in a structure of its own layout.
    let answer = unsafe { libc::clock_gettime(libc::CLOCK_REALTIME_COARSE, &raw mut now) };
    #[allow(clippy::unnecessary_cast, reason = "narrower on 32-bit systems")]
    (answer == 0).then_some((now.tv_sec as i64, now.tv_nsec as i64))
}

#[cfg(not(any(target_os = "linux", target_os = "android")))]
fn clock() -> Option<(i64, i64)> {
    None
}

/// A file that is in use, as it was when that began.
#[derive(Debug)]
pub(crate) struct Used {
    file: File,
    identity: Identity,
    path: PathBuf,
}

impl Used {
    /// A file that was opened, from now on.
    pub fn new(path: &Path, file: File) -> io::Result<Self> {
        Ok(Self { identity: settle(&file)?, file, path: path.into() })
    }

    /// Whether the file may have changed since.
    pub fn changed(&self) -> Option<ChangedFile> {
        let now = self.file.metadata().ok().map(|metadata| Identity::of(&metadata));
        let changed = now.is_none_or(|now| self.identity.differs(&now, &self.path));
        changed.then(|| ChangedFile { path: self.path.clone() })
    }
}

/// A file's bytes, mapped.
pub(crate) struct Mapped {
    /// Before the mapping, so that it goes first.
    #[cfg(unix)]
    guard: guard::Guard,
    map: Mmap,
    used: Used,
}

impl fmt::Debug for Mapped {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (path, length) = (&self.used.path, self.map.len());
        f.debug_struct("Mapped")
            .field("path", path)
            .field("length", &length)
            .finish_non_exhaustive()
    }
}

impl AsRef<[u8]> for Mapped {
    fn as_ref(&self) -> &[u8] {
        &self.map
    }
}

/// Bytes whose owner is shared with whoever watches it.
struct Shared(Arc<Mapped>);

impl AsRef<[u8]> for Shared {
    fn as_ref(&self) -> &[u8] {
        self.0.as_ref().as_ref()
    }
}

impl Mapped {
    /// Maps a file that was opened by [`open_regular`] and is not empty.
    pub fn new(path: &Path, file: File) -> io::Result<Arc<Self>> {
        let used = Used::new(path, file)?;
        // SAFETY: the map is only read. Another program can change the file meanwhile: numbers of
        // any value are read then, as every reader of this type must bear; whether that happened is
        // asked before anything is made of them. Where the file is cut short, the guard puts zeros.
        let map = unsafe { Mmap::map(&used.file)? };
        Ok(Arc::new(Self {
            #[cfg(unix)]
            guard: guard::Guard::new(&map),
            map,
            used,
        }))
    }

    /// The bytes; they keep the mapping alive.
    pub fn bytes(self: &Arc<Self>) -> Bytes {
        Bytes::from_owner(Shared(Arc::clone(self)))
    }

    /// These bytes are read next, all of them: one call in place of a fault for every few pages.
    #[cfg(feature = "particles")]
    pub fn populate(&self, range: std::ops::Range<usize>) {
        #[cfg(target_os = "linux")]
        {
            // Where the system cannot, pages come one by one.
            let _ = self.map.advise_range(memmap2::Advice::PopulateRead, range.start, range.len());
        }
        #[cfg(not(target_os = "linux"))]
        let _ = range;
    }

    /// These bytes have been read: the memory that they take may be given back. They can be read
    /// again all the same.
    #[cfg(feature = "particles")]
    pub fn release(&self, range: std::ops::Range<usize>) {
        #[cfg(unix)]
        {
            let advice = memmap2::UncheckedAdvice::DontNeed;
            // SAFETY: the map is of a file, and only read: what is read again comes from the file.
            // Where the guard has put zeros, it is zeros again.
            let advised =
                unsafe { self.map.unchecked_advise_range(advice, range.start, range.len()) };
            // The memory then stays taken, and nothing else changes.
            drop(advised);
        }
        #[cfg(not(unix))]
        let _ = range;
    }

    /// Whether the file may have changed since it was opened.
    pub fn changed(&self) -> Option<ChangedFile> {
        #[cfg(unix)]
        if self.guard.lost() {
            return Some(ChangedFile { path: self.used.path.clone() });
        }
        self.used.changed()
    }
}

/// Reads a whole file that was opened by [`open_regular`], as it is at one moment.
pub(crate) fn read_whole(path: &Path, file: &File) -> Result<Vec<u8>, ReadError> {
    for _ in 0..3 {
        let before = settle(file)?;
        let length =
            usize::try_from(before.length).map_err(|_| io::Error::from(ErrorKind::OutOfMemory))?;
        let bytes = read_at(file, length, 0)?;
        let after = Identity::of(&file.metadata()?);
        if bytes.len() == length && !before.differs(&after, path) {
            return Ok(bytes);
        }
    }
    Err(ReadError::Changed)
}

/// Why a file was not read.
#[derive(Debug)]
pub(crate) enum ReadError {
    /// The system's words.
    Io(io::Error),
    /// Somebody is writing to it.
    Changed,
}

impl From<io::Error> for ReadError {
    fn from(error: io::Error) -> Self {
        Self::Io(error)
    }
}

/// Bus errors in mappings of ours.
#[cfg(unix)]
mod guard {
    use std::{
        ptr,
        sync::{
            Once, OnceLock,
            atomic::{AtomicBool, AtomicPtr, AtomicUsize, Ordering::SeqCst},
        },
    };

    use libc::{c_int, c_void, siginfo_t};

    /// Where a mapping lies. Slots are made as they are needed, used again, and never freed: the
    /// handler may walk over them at any time.
    struct Slot {
        /// Whether somebody has it.
        taken: AtomicBool,
        /// Odd while `start` and `length` mean nothing; another number after every change of them.
        version: AtomicUsize,
        start: AtomicUsize,
        length: AtomicUsize,
        /// Whether zeros lie there now.
        lost: AtomicBool,
        next: *const Slot,
    }

    // SAFETY: `next` is written before the slot is shared and leads to a slot that is never freed;
    // the rest is atomic.
    unsafe impl Sync for Slot {}

    /// The newest slot.
    static SLOTS: AtomicPtr<Slot> = AtomicPtr::new(ptr::null_mut());

    fn slots() -> impl Iterator<Item = &'static Slot> {
        let mut at: *const Slot = SLOTS.load(SeqCst);
        std::iter::from_fn(move || {
            // SAFETY: null, or a slot that is never freed.
            let slot = unsafe { at.as_ref() }?;
            at = slot.next;
            Some(slot)
        })
    }

    /// Watches over a mapping; to be dropped before it.
    pub struct Guard(&'static Slot);

    impl Guard {
        pub fn new(map: &memmap2::Mmap) -> Self {
            static HANDLER: Once = Once::new();
            HANDLER.call_once(install);
            let free =
                |slot: &&Slot| slot.taken.compare_exchange(false, true, SeqCst, SeqCst).is_ok();
            let slot = slots().find(free).unwrap_or_else(fresh);
            slot.lost.store(false, SeqCst);
            slot.start.store(map.as_ptr() as usize, SeqCst);
            slot.length.store(map.len(), SeqCst);
            slot.version.fetch_add(1, SeqCst);
            Self(slot)
        }

        /// Whether zeros lie there now.
        pub fn lost(&self) -> bool {
            self.0.lost.load(SeqCst)
        }
    }

    impl Drop for Guard {
        fn drop(&mut self) {
            self.0.version.fetch_add(1, SeqCst);
            self.0.taken.store(false, SeqCst);
        }
    }

    /// Another slot, taken.
    fn fresh() -> &'static Slot {
        let slot = Box::leak(Box::new(Slot {
            taken: AtomicBool::new(true),
            version: AtomicUsize::new(1),
            start: AtomicUsize::new(0),
            length: AtomicUsize::new(0),
            lost: AtomicBool::new(false),
            next: ptr::null(),
        }));
        let place: *mut Slot = slot;
        let mut head = SLOTS.load(SeqCst);
        loop {
            // SAFETY: nobody else knows the slot yet.
            unsafe { (*place).next = head };
            match SLOTS.compare_exchange(head, place, SeqCst, SeqCst) {
                // SAFETY: it was leaked, and is only read from now on.
                Ok(_) => return unsafe { &*place },
                Err(other) => head = other,
            }
        }
    }

    /// What was there for bus errors before.
    static FORMER: OnceLock<libc::sigaction> = OnceLock::new();

    fn install() {
        // SAFETY: both structures are the system's own, zeros are a value of each, and the handler
        // has the form that SA_SIGINFO asks for.
        unsafe {
            let mut former: libc::sigaction = std::mem::zeroed();
            if libc::sigaction(libc::SIGBUS, ptr::null(), &raw mut former) != 0 {
                return;
            }
            // Before the handler can run.
            let _ = FORMER.set(former);
            let mut action: libc::sigaction = std::mem::zeroed();
            let handler: extern "C" fn(c_int, *mut siginfo_t, *mut c_void) = on_bus_error;
            action.sa_sigaction = handler as usize;
            action.sa_flags = libc::SA_SIGINFO | libc::SA_ONSTACK | libc::SA_RESTART;
            libc::sigemptyset(&raw mut action.sa_mask);
            libc::sigaction(libc::SIGBUS, &raw const action, ptr::null_mut());
        }
    }

    /// Runs in the middle of anything: it reads and writes atomics and calls the system (`mmap`,
    /// `sigaction`, `raise`), and neither allocates nor locks.
    extern "C" fn on_bus_error(signal: c_int, info: *mut siginfo_t, context: *mut c_void) {
        let errno = errno();
        // SAFETY: the system gives a structure that is filled in; for codes above 0 it is that of a
        // fault, with an address.
        let address = unsafe { if (*info).si_code > 0 { (*info).si_addr() as usize } else { 0 } };
        let recovered = address != 0 && slots().any(|slot| recover(slot, address));
        if !recovered {
            pass_on(signal, info, context);
        }
        // SAFETY: the thread's own number.
        unsafe { *errno.0 = errno.1 };
    }

    /// Puts zeros in place of the mapping that an address lies in, if it is this one.
    fn recover(slot: &Slot, address: usize) -> bool {
        let version = slot.version.load(SeqCst);
        let (start, length) = (slot.start.load(SeqCst), slot.length.load(SeqCst));
        let ours = version.is_multiple_of(2) && slot.version.load(SeqCst) == version;
        // The last page is mapped as a whole, but zeros follow the file's end there.
        if !ours || address < start || address - start >= length {
            return false;
        }
        slot.lost.store(true, SeqCst);
        let flags = libc::MAP_PRIVATE | libc::MAP_ANONYMOUS | libc::MAP_FIXED | libc::MAP_NORESERVE;
        // SAFETY: exactly the pages of a mapping of ours, which the thread that stands at the fault
        // holds: nobody unmaps it. Others may read there at the same time, and find the file's
        // numbers or zeros.
        let zeros =
            unsafe { libc::mmap(start as *mut c_void, length, libc::PROT_READ, flags, -1, 0) };
        zeros as usize == start
    }

    /// Does what would have been done without this handler.
    fn pass_on(signal: c_int, info: *mut siginfo_t, context: *mut c_void) {
        let former = FORMER
            .get()
            .map_or((libc::SIG_DFL, 0), |former| (former.sa_sigaction, former.sa_flags));
        // SAFETY: an address that is neither of the two is a handler that somebody installed, of
        // the form its flags say.
        unsafe {
            match former {
                (libc::SIG_IGN, _) if (*info).si_code <= 0 => {}
                (libc::SIG_DFL | libc::SIG_IGN, _) => {
                    // Ends the program as soon as this handler returns.
                    libc::signal(signal, libc::SIG_DFL);
                    libc::raise(signal);
                }
                (handler, flags) if flags & libc::SA_SIGINFO != 0 => {
                    let handler: extern "C" fn(c_int, *mut siginfo_t, *mut c_void) =
                        std::mem::transmute(handler);
                    handler(signal, info, context);
                }
                (handler, _) => {
                    let handler: extern "C" fn(c_int) = std::mem::transmute(handler);
                    handler(signal);
                }
            }
        }
    }

    /// Where the thread's last error number lies, and the number.
    fn errno() -> (*mut c_int, c_int) {
        // SAFETY: the C library's own place for it.
        unsafe {
            #[cfg(any(
                target_os = "linux",
                target_os = "emscripten",
                target_os = "redox",
                target_os = "hurd"
            ))]
            let place = libc::__errno_location();
            #[cfg(any(target_os = "android", target_os = "netbsd", target_os = "openbsd"))]
            let place = libc::__errno();
            #[cfg(any(target_vendor = "apple", target_os = "freebsd", target_os = "dragonfly"))]
            let place = libc::__error();
            #[cfg(any(target_os = "solaris", target_os = "illumos"))]
            let place = libc::___errno();
            (place, *place)
        }
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    fn mapped(path: &Path) -> Arc<Mapped> {
        let (file, _) = open_regular(path).unwrap();
        Mapped::new(path, file).unwrap()
    }

    #[test]
    fn what_happens_to_a_file_is_seen() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        let fill = |byte: u8| fs::write(&path, vec![byte; 1 << 20]).unwrap();
        type Deed = fn(&Path);
        let deeds: [(&str, bool, Deed); 9] = [
            ("nothing", false, |_| {}),
            ("read", false, |path| drop(fs::read(path).unwrap())),
            ("one byte written", true, |path| {
                fs::OpenOptions::new().write(true).open(path).unwrap().write_all(b"x").unwrap()
            }),
            ("cut short", true, |path| {
                fs::OpenOptions::new().write(true).open(path).unwrap().set_len(5).unwrap()
            }),
            ("longer", true, |path| {
                fs::OpenOptions::new().append(true).open(path).unwrap().write_all(b"x").unwrap()
            }),
            ("written again", true, |path| fs::write(path, vec![7; 1 << 20]).unwrap()),
            ("renamed over", false, |path| {
                fs::write(path.with_extension("new"), vec![8; 1 << 20]).unwrap();
                fs::rename(path.with_extension("new"), path).unwrap();
            }),
            ("removed", false, |path| fs::remove_file(path).unwrap()),
            ("renamed", false, |path| fs::rename(path, path.with_extension("other")).unwrap()),
        ];
        for (name, wanted, deed) in deeds {
            fill(3);
            let map = mapped(&path);
            assert!(map.changed().is_none(), "{name}");
            deed(&path);
            assert_eq!(map.changed().is_some(), wanted, "{name}");
            if !wanted {
                assert!(map.bytes().iter().all(|&byte| byte == 3), "{name}");
            }
        }
    }

    /// Times that are set back do not hide a change.
    #[cfg(unix)]
    #[test]
    fn times_that_are_set_back_are_seen() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        fs::write(&path, vec![3; 1 << 20]).unwrap();
        let before = fs::metadata(&path).unwrap().modified().unwrap();
        let map = mapped(&path);
        fs::write(&path, vec![4; 1 << 20]).unwrap();
        let file = fs::OpenOptions::new().write(true).open(&path).unwrap();
        file.set_modified(before).unwrap();
        assert!(map.changed().is_some());
    }

    /// A change right after the opening has another time, however coarse the clock: 200 rounds.
    #[test]
    fn changes_in_the_same_moment_are_seen() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        for round in 0..200u8 {
            fs::write(&path, vec![round; 4096]).unwrap();
            let map = mapped(&path);
            fs::OpenOptions::new()
                .write(true)
                .open(&path)
                .unwrap()
                .write_all(&[round + 1])
                .unwrap();
            assert!(map.changed().is_some(), "round {round}");
        }
    }

    /// Pages that are gone read as zeros, in many threads at once, and mappings come and go
    /// meanwhile.
    #[cfg(unix)]
    #[test]
    fn a_file_that_is_cut_short_reads_as_zeros() {
        use rayon::prelude::*;
        let folder = tempfile::tempdir().unwrap();
        (0..64u32).into_par_iter().for_each(|number| {
            let path = folder.path().join(number.to_string());
            fs::write(&path, vec![9; 1 << 20]).unwrap();
            let (kept, map) = (mapped(&path), mapped(&path));
            drop(kept);
            let bytes = map.bytes();
            assert_eq!(bytes[1 << 19], 9);
            let cut = if number % 2 == 0 { 0 } else { 4096 * u64::from(number) };
            fs::OpenOptions::new().write(true).open(&path).unwrap().set_len(cut).unwrap();
            let sum: u64 = bytes.par_iter().map(|&byte| u64::from(byte)).sum();
            assert!(sum < 9 << 20 && bytes[(1 << 20) - 1] == 0);
            assert_eq!(map.changed(), Some(ChangedFile { path }));
        });
    }

    #[cfg(unix)]
    #[test]
    fn only_regular_files_are_opened() {
        let folder = tempfile::tempdir().unwrap();
        let _socket = std::os::unix::net::UnixListener::bind(folder.path().join("socket")).unwrap();
        for (path, wanted) in
            [("/dev/null", "a device"), ("/dev/zero", "a device"), ("/", "a folder")]
        {
            let error = open_regular(Path::new(path)).expect_err("not a regular file");
            assert_eq!(error.to_string(), format!("is {wanted}, not a regular file"));
        }
        let error = open_regular(&folder.path().join("socket")).expect_err("not a regular file");
        assert_eq!(error.to_string(), "is a socket, not a regular file");
        let error = open_regular(&folder.path().join("gone")).expect_err("no file");
        assert!(matches!(error, OpenError::Missing));
    }
}
