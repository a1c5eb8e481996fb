//! Files of particles that are damaged at random: whatever they hold, reading them ends soon, takes
//! little memory, and panics nowhere.
//!
//! The samples of `tests/data` are changed by a fixed sequence of random numbers: the same 2,000
//! changed files a format on every machine. `fuzz/` looks further, for as long as it is let.

use std::{
    alloc::{GlobalAlloc, Layout, System},
    fs,
    panic::{self, AssertUnwindSafe},
    path::{Path, PathBuf},
    sync::atomic::{AtomicUsize, Ordering::Relaxed},
    time::{Duration, Instant},
};

use planisphere_io::{
    load::Control,
    make::Random,
    particles::{File, Format, Frame, spheres::Appearance, understand},
};

/// The system's allocator, which notes how much is taken at once.
struct Counting;

/// Bytes that are taken now, and the most that were.
static TAKEN: [AtomicUsize; 2] = [AtomicUsize::new(0), AtomicUsize::new(0)];

fn take(bytes: usize) {
    let now = TAKEN[0].fetch_add(bytes, Relaxed) + bytes;
    TAKEN[1].fetch_max(now, Relaxed);
}

// SAFETY: every call is the system's own; what is counted besides touches no memory of theirs.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        take(layout.size());
        // SAFETY: the caller's promise.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        take(layout.size());
        // SAFETY: the caller's promise.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn dealloc(&self, start: *mut u8, layout: Layout) {
        TAKEN[0].fetch_sub(layout.size(), Relaxed);
        // SAFETY: the caller's promise.
        unsafe { System.dealloc(start, layout) }
    }

    unsafe fn realloc(&self, start: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        TAKEN[0].fetch_sub(layout.size(), Relaxed);
        take(size);
        // SAFETY: the caller's promise.
        unsafe { System.realloc(start, layout, size) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

/// Changed files of each format.
const MUTATIONS: u64 = 2_000;

/// How long one of them may take.
const PATIENCE: Duration = Duration::from_secs(5);

/// Text that is wrong in most places.
const WORDS: [&[u8]; 22] = [
    b"-1",
    b"0",
    b"nan",
    b"inf",
    b"1e999",
    b"-1e-999",
    b"4294967296",
    b"9223372036854775807",
    b"18446744073709551615",
    b"\"",
    b"'",
    b";",
    b",",
    b"\n",
    b"\r\n",
    b"\r",
    b"\t",
    b" ",
    b"\0",
    b"\xff",
    b"?",
    b"loop_",
];

/// A sample with some changes.
fn mutated(sample: &[u8], random: &mut impl FnMut(usize) -> usize) -> Vec<u8> {
    let mut bytes = sample.to_vec();
    for _ in 0..=random(4) {
        let at = random(bytes.len() + 1);
        let length = random(33).min(bytes.len() - at);
        match random(8) {
            0 => drop(bytes.drain(at..at + length)),
            1 => bytes.truncate(at),
            2 => {
                let word = WORDS[random(WORDS.len())];
                bytes.splice(at..at, word.iter().copied());
            }
            3 => {
                let word = WORDS[random(WORDS.len())];
                bytes.splice(at..at + length, word.iter().copied());
            }
            4 => {
                let part = bytes[at..at + length].to_vec();
                let to = random(bytes.len() + 1);
                bytes.splice(to..to, part);
            }
            5 if at < bytes.len() => bytes[at] ^= 1 << random(8),
            6 if at < bytes.len() => bytes[at] = random(256) as u8,
            _ => {
                // A number of four or eight bytes.
                let number = [0, 1, u32::MAX as usize, i32::MAX as usize, 1 << 40][random(5)];
                let width = if random(2) == 0 { 4 } else { 8 };
                let end = (at + width).min(bytes.len());
                let mut raw = number.to_le_bytes();
                if random(2) == 0 {
                    raw.reverse();
                }
                bytes[at..end].copy_from_slice(&raw[..end - at]);
            }
        }
    }
    bytes
}

/// Reads all there is, and makes spheres of it.
fn read(format: Format, bytes: Vec<u8>) {
    let control = Control::new();
    let Ok(file) = File::of_bytes("it", format, bytes) else { return };
    for number in 0..12 {
        let frame = Frame::FromFirst(number);
        if understand(&file, frame, &Appearance::default(), &control).is_err() {
            break;
        }
    }
    let _ = file.frames(&control);
}

/// The samples of a format, those that are to be refused among them.
fn samples(format: Format) -> Vec<Vec<u8>> {
    let data = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data"));
    let folder = |name: &str| -> Vec<PathBuf> {
        let entries = fs::read_dir(data.join(name)).expect("a folder");
        entries.map(|entry| entry.expect("an entry").path()).filter(|path| path.is_file()).collect()
    };
    let own = if format.name() == "data" { "lammps-data" } else { format.name() };
    let mut paths = folder(own);
    paths.extend(folder("broken").into_iter().filter(|path| Format::of_path(path) == Some(format)));
    paths.sort();
    paths.iter().map(|path| fs::read(path).expect("a file")).collect()
}

#[test]
fn damaged_files_are_read_or_refused_soon() {
    let mut wrong = Vec::new();
    for (number, format) in Format::all().enumerate() {
        let samples = samples(format);
        assert!(samples.len() >= 3, "{} samples of {}", samples.len(), format.name());
        for mutation in 0..MUTATIONS {
            let sequence = Random { seed: 1_000 * number as u64 + 1 };
            let mut drawn = 1_000 * mutation;
            let mut random = |below: usize| {
                drawn += 1;
                (sequence.bits(drawn) % below as u64) as usize
            };
            let bytes = mutated(&samples[random(samples.len())], &mut random);
            let (length, start, before) = (bytes.len(), Instant::now(), TAKEN[0].load(Relaxed));
            TAKEN[1].store(before, Relaxed);
            let ended = panic::catch_unwind(AssertUnwindSafe(|| read(format, bytes)));
            let most = TAKEN[1].load(Relaxed) - before;
            let soon = start.elapsed() < PATIENCE;
            let little = most <= 4 * length + (64 << 20);
            if ended.is_err() || !soon || !little {
                wrong.push(format!(
                    "{} {mutation}: panicked: {}, {:?}, {most} bytes for {length}",
                    format.name(),
                    ended.is_err(),
                    start.elapsed()
                ));
            }
        }
    }
    assert!(wrong.is_empty(), "{} are wrong:\n{}", wrong.len(), wrong.join("\n"));
}
