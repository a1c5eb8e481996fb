//! What must not be left behind when the process ends before its time: temporary names, and
//! children.
//!
//! A signal's handler calls [`clear`], which takes away what is registered here; it therefore
//! allocates nothing and takes no lock. What no handler sees (SIGKILL, power) is found by the next
//! run: every temporary file or folder is locked (`flock`) for as long as its run lives, so that
//! one without a lock is litter.

use std::{
    fs,
    hash::{BuildHasher, Hasher, RandomState},
    io,
    path::{Path, PathBuf},
};

#[cfg(unix)]
pub use unix::hidden;
#[cfg(unix)]
pub use unix::{Child, Named, SIGNALS, Shield, clear, waits};

/// How the names of all temporary files and folders begin.
const PREFIX: &str = ".planisphere-";
/// How they end.
const SUFFIX: &str = ".tmp";

/// After this time a file of another machine is litter, if nobody holds its lock: not all network
/// file systems tell other machines of locks.
#[cfg(unix)]
const FOREIGN: std::time::Duration = std::time::Duration::from_secs(24 * 3600);

/// A name in a folder that no other run chooses.
pub fn name_in(folder: &Path) -> PathBuf {
    let random = RandomState::new().build_hasher().finish();
    folder.join(format!("{PREFIX}{:08x}-{random:016x}{SUFFIX}", kernel()))
}

/// Which kernel runs: locks are certain among its processes, containers included, and no other
/// kernel has its number.
fn kernel() -> u32 {
    let boot = fs::read("/proc/sys/kernel/random/boot_id").unwrap_or_default();
    // FNV-1a: the same in every version of the program.
    boot.iter()
        .fold(0x811c_9dc5, |hash: u32, &byte| (hash ^ u32::from(byte)).wrapping_mul(0x0100_0193))
}

/// Removes from a folder what runs that were killed have left there. What cannot be removed stays.
pub fn sweep(folder: &Path) {
    for name in names(folder) {
        let Some(tag) = name.strip_prefix(PREFIX).and_then(|name| name.strip_suffix(SUFFIX)) else {
            continue;
        };
        #[cfg(unix)]
        unix::remove_dead(&folder.join(&name), tag);
        #[cfg(not(unix))]
        let _ = tag;
    }
}

/// The names in a folder that begin with [`PREFIX`]. A folder may have very many others: they are
/// looked at, no more.
#[cfg(target_os = "linux")]
fn names(folder: &Path) -> Vec<String> {
    let mut buffer = Vec::with_capacity(1 << 16);
    let Ok(folder) = fs::File::open(folder) else { return Vec::new() };
    let mut entries = rustix::fs::RawDir::new(&folder, buffer.spare_capacity_mut());
    let mut names = Vec::new();
    while let Some(Ok(entry)) = entries.next() {
        let name = entry.file_name().to_bytes();
        if name.starts_with(PREFIX.as_bytes()) {
            names.extend(std::str::from_utf8(name).map(str::to_owned));
        }
    }
    names
}

/// The names in a folder that begin with [`PREFIX`].
#[cfg(not(target_os = "linux"))]
fn names(folder: &Path) -> Vec<String> {
    let Ok(entries) = fs::read_dir(folder) else { return Vec::new() };
    let names = entries.flatten().filter_map(|entry| entry.file_name().into_string().ok());
    names.filter(|name| name.starts_with(PREFIX)).collect()
}

/// A folder for files that other processes are to read. It is removed when dropped, and when the
/// process ends.
#[derive(Debug)]
pub struct Folder {
    path: PathBuf,
    /// Holds the lock, and the name in the list of what is to be removed.
    #[cfg(unix)]
    _held: (fs::File, Named),
}

impl Folder {
    /// Makes one among the system's temporary folders, and removes those that runs have left there.
    ///
    /// # Errors
    /// The system's.
    pub fn new() -> io::Result<Self> {
        let all = std::env::temp_dir();
        sweep(&all);
        #[cfg(unix)]
        {
            let (path, held) = unix::folder(&all)?;
            Ok(Self { path, _held: held })
        }
        #[cfg(not(unix))]
        {
            let path = name_in(&all);
            fs::create_dir(&path)?;
            Ok(Self { path })
        }
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        // What stays is swept by the next run.
        let _ = fs::remove_dir_all(&self.path);
    }
}

#[cfg(unix)]
mod unix {
    use std::{
        cell::Cell,
        ffi::CString,
        fs::{self, File, OpenOptions},
        io, mem,
        os::unix::{
            ffi::OsStrExt,
            fs::{DirBuilderExt, MetadataExt, OpenOptionsExt},
        },
        path::{Path, PathBuf},
        ptr,
        sync::atomic::{AtomicBool, AtomicI32, AtomicPtr, AtomicUsize, Ordering::SeqCst},
        time::Duration,
    };

    use rustix::fs::{FlockOperation, flock};

    use super::{FOREIGN, kernel, name_in};

    /// A name that is to be removed.
    struct Entry {
        path: CString,
        folder: bool,
    }

    /// Names at a time, at most: a run has a few outputs.
    static NAMES: [AtomicPtr<Entry>; 64] = [const { AtomicPtr::new(ptr::null_mut()) }; 64];
    /// Children at a time, at most: `bench` has one.
    static CHILDREN: [AtomicI32; 4] = [const { AtomicI32::new(0) }; 4];
    /// Threads that are making, renaming or writing what must not be cut in two.
    static SHIELDED: AtomicUsize = AtomicUsize::new(0);
    /// The process is ending: nothing new is begun.
    static ENDING: AtomicBool = AtomicBool::new(false);

    /// The signals that end the process by way of [`clear`].
    pub const SIGNALS: [libc::c_int; 5] =
        [libc::SIGINT, libc::SIGTERM, libc::SIGHUP, libc::SIGQUIT, libc::SIGXCPU];

    /// A signal that waits until the shield of the thread that it came to is down.
    static WAITING: AtomicI32 = AtomicI32::new(0);

    thread_local! {
        /// Whether this thread has put up a shield.
        static UP: Cell<bool> = const { Cell::new(false) };
    }

    /// While it lives, no signal ends the process: for what takes no time, and must be done as a
    /// whole. Not to be nested.
    ///
    /// Signals are not blocked, because children that are started meanwhile would inherit that.
    #[derive(Debug)]
    pub struct Shield(());

    impl Shield {
        /// Puts it up.
        pub fn up() -> Self {
            UP.set(true);
            SHIELDED.fetch_add(1, SeqCst);
            if ENDING.load(SeqCst) {
                SHIELDED.fetch_sub(1, SeqCst);
                wait_for_the_end();
            }
            Self(())
        }
    }

    impl Drop for Shield {
        fn drop(&mut self) {
            SHIELDED.fetch_sub(1, SeqCst);
            UP.set(false);
            let signal = WAITING.swap(0, SeqCst);
            if signal != 0 {
                // SAFETY: a signal to this thread, which came before and is now handled.
                unsafe { libc::raise(signal) };
            }
        }
    }

    /// For a signal's handler: whether the signal has to wait for a shield of the thread it came
    /// to, after which it comes again.
    pub fn waits(signal: libc::c_int) -> bool {
        let up = UP.get();
        if up {
            WAITING.store(signal, SeqCst);
        }
        up
    }

    fn wait_for_the_end() -> ! {
        loop {
            nap(Duration::from_secs(1));
        }
    }

    /// Sleeps; a signal handler may.
    fn nap(time: Duration) {
        let time =
            libc::timespec { tv_sec: time.as_secs() as _, tv_nsec: time.subsec_nanos() as _ };
        // SAFETY: the time is a whole value, and nothing is asked to be written back.
        unsafe { libc::nanosleep(&raw const time, ptr::null_mut()) };
    }

    /// A name that is removed when the process ends by a signal, until dropped. The file itself is
    /// its owner's.
    #[derive(Debug)]
    pub struct Named(usize);

    impl Named {
        fn new(path: &Path, folder: bool) -> io::Result<Self> {
            let path = CString::new(path.as_os_str().as_bytes())?;
            // Never freed: a handler may be reading it. There are few, and they are short.
            let entry = Box::into_raw(Box::new(Entry { path, folder }));
            let free = |slot: &AtomicPtr<Entry>| {
                slot.compare_exchange(ptr::null_mut(), entry, SeqCst, SeqCst).is_ok()
            };
            NAMES
                .iter()
                .position(free)
                .map(Self)
                .ok_or_else(|| io::Error::other("too many temporary files at a time"))
        }
    }

    impl Drop for Named {
        fn drop(&mut self) {
            NAMES[self.0].store(ptr::null_mut(), SeqCst);
        }
    }

    /// A child that is ended with the process, until dropped.
    #[derive(Debug)]
    pub struct Child(Option<usize>);

    impl Child {
        /// By its number.
        pub fn new(id: u32) -> Self {
            let free = |slot: &AtomicI32| {
                slot.compare_exchange(0, id.cast_signed(), SeqCst, SeqCst).is_ok()
            };
            Self(CHILDREN.iter().position(free))
        }
    }

    impl Drop for Child {
        fn drop(&mut self) {
            if let Some(slot) = self.0 {
                CHILDREN[slot].store(0, SeqCst);
            }
        }
    }

    /// Ends children and removes all names, within a second, because the process is about to end. A
    /// signal handler may call it: it allocates nothing, takes no lock, and makes only system calls
    /// that POSIX allows there.
    pub fn clear() {
        if ENDING.swap(true, SeqCst) {
            // Another thread is at it, and ends the process.
            wait_for_the_end();
        }
        // What another thread is giving its name to, it may finish; a file system that hangs may
        // not keep us.
        for _ in 0..400 {
            if SHIELDED.load(SeqCst) == 0 {
                break;
            }
            nap(Duration::from_millis(1));
        }
        for slot in &CHILDREN {
            let id = slot.load(SeqCst);
            // SAFETY: signals to a child of ours, which nobody has waited for: its number is still
            // its own.
            if id > 0 && unsafe { libc::kill(id, libc::SIGTERM) } == 0 {
                for _ in 0..400 {
                    // SAFETY: as above; the status is not asked for.
                    if unsafe { libc::waitpid(id, ptr::null_mut(), libc::WNOHANG) } != 0 {
                        break;
                    }
                    nap(Duration::from_millis(1));
                }
            }
        }
        for slot in &NAMES {
            let entry = slot.load(SeqCst);
            if entry.is_null() {
                continue;
            }
            // SAFETY: entries are never freed.
            let entry = unsafe { &*entry };
            if entry.folder {
                empty(&entry.path);
            }
            // SAFETY: the path ends with a zero byte.
            unsafe {
                if entry.folder {
                    libc::rmdir(entry.path.as_ptr())
                } else {
                    libc::unlink(entry.path.as_ptr())
                };
            }
        }
    }

    /// Removes the files of a folder, by nothing but system calls.
    #[cfg(target_os = "linux")]
    fn empty(path: &std::ffi::CStr) {
        use rustix::fs::{AtFlags, CWD, Mode, OFlags, RawDir, openat, unlinkat};
        let mut buffer = [mem::MaybeUninit::uninit(); 4096];
        let flags = OFlags::RDONLY | OFlags::DIRECTORY | OFlags::NOFOLLOW | OFlags::CLOEXEC;
        let Ok(folder) = openat(CWD, path, flags, Mode::empty()) else { return };
        let mut entries = RawDir::new(&folder, &mut buffer);
        while let Some(Ok(entry)) = entries.next() {
            // `.` and `..` are folders, and stay.
            let _ = unlinkat(&folder, entry.file_name(), AtFlags::empty());
        }
    }

    /// Elsewhere the next run sweeps.
    #[cfg(not(target_os = "linux"))]
    fn empty(_: &std::ffi::CStr) {}

    /// Locks a new file, under a name of its own, so that everybody sees that its run is alive.
    pub fn hidden(folder: &Path) -> io::Result<(File, PathBuf, Named)> {
        loop {
            let path = name_in(folder);
            let _shield = Shield::up();
            let named = Named::new(&path, false)?;
            let file = OpenOptions::new()
                .read(true)
                .write(true)
                .create_new(true)
                .mode(0o666)
                .open(&path)?;
            // A file system without locks: the file is never taken for litter, since it cannot be
            // locked then either.
            let _ = flock(&file, FlockOperation::NonBlockingLockExclusive);
            // Between its making and its lock another run may have taken it for litter.
            if is_at(&file, &path) {
                return Ok((file, path, named));
            }
        }
    }

    pub(super) fn folder(all: &Path) -> io::Result<(PathBuf, (File, Named))> {
        loop {
            let path = name_in(all);
            let _shield = Shield::up();
            let named = Named::new(&path, true)?;
            fs::DirBuilder::new().mode(0o700).create(&path)?;
            let Ok(folder) = File::open(&path) else { continue };
            let _ = flock(&folder, FlockOperation::NonBlockingLockExclusive);
            if is_at(&folder, &path) {
                return Ok((path, (folder, named)));
            }
        }
    }

    fn is_at(file: &File, path: &Path) -> bool {
        let (Ok(own), Ok(there)) = (file.metadata(), path.symlink_metadata()) else { return false };
        (own.dev(), own.ino()) == (there.dev(), there.ino())
    }

    /// Removes a temporary file or folder if the run that made it is dead.
    pub(super) fn remove_dead(path: &Path, tag: &str) {
        let Ok(data) = path.symlink_metadata() else { return };
        let mut options = OpenOptions::new();
        // Some network file systems lock only what is open for writing.
        options.read(true).write(data.is_file()).custom_flags(libc::O_NOFOLLOW | libc::O_NONBLOCK);
        if !(data.is_file() || data.is_dir()) {
            return;
        }
        let Ok(file) = options.open(path) else { return };
        let own = tag.split('-').next().is_some_and(|tag| tag == format!("{:08x}", kernel()));
        let old =
            || data.modified().is_ok_and(|time| time.elapsed().is_ok_and(|age| age > FOREIGN));
        if !(own || old())
            || flock(&file, FlockOperation::NonBlockingLockExclusive).is_err()
            || !is_at(&file, path)
        {
            return;
        }
        let _ = if data.is_dir() { fs::remove_dir_all(path) } else { fs::remove_file(path) };
    }

    #[cfg(test)]
    mod tests {
        use super::*;
        use crate::litter::sweep;

        fn count(folder: &Path) -> usize {
            fs::read_dir(folder).unwrap().count()
        }

        #[test]
        fn only_what_no_run_holds_is_swept() {
            let folder = tempfile::tempdir().unwrap();
            let (file, path, named) = hidden(folder.path()).unwrap();
            let (inner, held) = super::folder(folder.path()).unwrap();
            fs::write(inner.join("x"), "x").unwrap();
            // Of another kernel, just written; and what only looks alike.
            for name in [
                ".planisphere-00000000-0123456789abcdef.tmp",
                ".planisphere-notes",
                "planisphere-1.tmp",
            ] {
                fs::write(folder.path().join(name), "x").unwrap();
            }
            sweep(folder.path());
            assert_eq!(count(folder.path()), 5);
            drop((file, named, held));
            assert_eq!(count(folder.path()), 5);
            sweep(folder.path());
            assert_eq!(count(folder.path()), 3);
            assert!(!path.exists() && !inner.exists());
            // A day and more later the stranger is litter, too.
            let stranger = folder.path().join(".planisphere-00000000-0123456789abcdef.tmp");
            let old = std::time::SystemTime::now() - FOREIGN - Duration::from_secs(60);
            File::options().write(true).open(&stranger).unwrap().set_modified(old).unwrap();
            sweep(folder.path());
            assert!(!stranger.exists() && count(folder.path()) == 2);
        }
    }
}

/// What a signal may cut in two is done as it is: there are no signals here.
#[cfg(not(unix))]
#[derive(Debug)]
pub struct Shield;

#[cfg(not(unix))]
impl Shield {
    /// Nothing to put up.
    pub fn up() -> Self {
        Self
    }
}

/// Nothing ends children here.
#[cfg(not(unix))]
#[derive(Debug)]
pub struct Child;

#[cfg(not(unix))]
impl Child {
    /// By its number.
    pub fn new(_: u32) -> Self {
        Self
    }
}

/// Nothing is registered here.
#[cfg(not(unix))]
pub fn clear() {}
