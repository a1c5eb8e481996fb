//! `planisphere make`: writes the arrays and the scene file of a large example scene.
//!
//! Files of these names that are there are replaced only if they hold, to the byte, what this
//! command writes: the scene file says with which arguments it was made, and making it again tells
//! whether anything has been changed since.

use std::{
    fmt,
    fs::{self, File},
    io::{self, BufReader, Read, Write},
    path::Path,
};

use super::{
    Failure,
    args::{MakeArgs, MakeKind},
    ends::Ends,
    progress::Progress,
    say,
};
use planisphere_io::text;
use planisphere_io::{
    make::{Cloud, Lattice},
    npy::header as npy_header,
    output::{self, OutputError, Target},
};

/// Spheres that are written at a time.
const CHUNK: u32 = 1 << 16;

/// The files, in the order in which they get their names.
const FILES: [&str; 4] = ["centers.npy", "radii.npy", "colors.npy", "scene.toml"];

/// How the line of the scene file begins that says how it was made.
const MADE_BY: &str = "# planisphere make ";

/// What is made.
#[derive(Clone, Copy, PartialEq, Eq)]
struct Recipe {
    kind: MakeKind,
    count: u32,
    seed: u64,
}

impl fmt::Display for Recipe {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { kind, count, seed } = self;
        let kind = match kind {
            MakeKind::Cloud => "cloud",
            MakeKind::Lattice => "lattice",
        };
        write!(f, "{kind} --count {count} --seed {seed}")
    }
}

impl Recipe {
    /// The recipe of a scene file that says one.
    fn of(scene: &Path) -> Option<Self> {
        if !is_file(scene) {
            return None;
        }
        let mut start = Vec::new();
        File::open(scene).ok()?.take(4096).read_to_end(&mut start).ok()?;
        let text = String::from_utf8(start).ok()?;
        let line = text.lines().find_map(|line| line.strip_prefix(MADE_BY))?;
        let [kind, "--count", count, "--seed", seed] = line.split(' ').collect::<Vec<_>>()[..]
        else {
            return None;
        };
        let kind = match kind {
            "cloud" => MakeKind::Cloud,
            "lattice" => MakeKind::Lattice,
            _ => return None,
        };
        Some(Self {
            kind,
            count: count.parse().ok().filter(|&count| count > 0)?,
            seed: seed.parse().ok()?,
        })
    }

    fn words(&self) -> String {
        let Self { kind, count, seed } = self;
        match kind {
            MakeKind::Cloud => {
                format!("{count} equal spheres at random in a unit cube (seed {seed})")
            }
            MakeKind::Lattice => {
                format!("{count} touching spheres on a face-centred cubic lattice")
            }
        }
    }

    /// Writes one of [`FILES`].
    fn write(&self, file: &str, out: &mut dyn Write) -> io::Result<()> {
        let &Self { kind, count, seed } = self;
        let cloud = Cloud::new(count, seed);
        let lattice = Lattice::new(count);
        let sphere = |index| match kind {
            MakeKind::Cloud => cloud.sphere(index),
            MakeKind::Lattice => lattice.sphere(index),
        };
        let radius = match kind {
            MakeKind::Cloud => cloud.radius(),
            MakeKind::Lattice => lattice.radius(),
        };
        let n = count as usize;
        match file {
            "centers.npy" => {
                out.write_all(&npy_header("<f4", &[n, 3]))?;
                in_chunks(out, count, |k, bytes| {
                    bytes.extend(sphere(k).0.iter().flat_map(|c| c.to_le_bytes()))
                })
            }
            "radii.npy" => {
                out.write_all(&npy_header("<f4", &[n]))?;
                in_chunks(out, count, |_, bytes| bytes.extend(radius.to_le_bytes()))
            }
            "colors.npy" => {
                out.write_all(&npy_header("|u1", &[n, 3]))?;
                in_chunks(out, count, |k, bytes| bytes.extend(sphere(k).1))
            }
            _ => write!(
                out,
                "# {}, seen from a camera that frames them all.\n{MADE_BY}{self}\n\n[image]\nwidth \
                 = 1024\nheight = 1024\n\n[[spheres]]\ncenters = \"centers.npy\"\nradii = \
                 \"radii.npy\"\ncolors = \"colors.npy\"\n",
                self.words()
            ),
        }
    }

    /// Whether this is what a file holds.
    fn made(&self, file: &str, path: &Path) -> bool {
        if !is_file(path) {
            return false;
        }
        let Ok(found) = File::open(path) else { return false };
        let mut found = Compared(BufReader::with_capacity(1 << 20, found));
        self.write(file, &mut found).is_ok() && matches!(found.0.read(&mut [0]), Ok(0))
    }
}

fn is_file(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|data| data.is_file())
}

/// Takes the bytes that a file holds, and no others.
struct Compared(BufReader<File>);

impl Write for Compared {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let mut found = vec![0; bytes.len()];
        self.0.read_exact(&mut found)?;
        if found == bytes { Ok(bytes.len()) } else { Err(io::ErrorKind::InvalidData.into()) }
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Writes `centers.npy`, `radii.npy`, `colors.npy` and `scene.toml`.
pub(super) fn run(args: &MakeArgs) -> Result<(), Failure> {
    let progress = Progress::step("writing");
    let folder = &args.folder;
    let recipe = Recipe { kind: args.kind, count: args.count, seed: args.seed };
    fs::create_dir_all(folder)
        .map_err(|source| OutputError::Io { target: text::name(folder), source })?;

    let targets = FILES.map(|file| Target::File(folder.join(file)));
    let ends = Ends::new(FILES.iter().copied().zip(&targets).collect(), None);
    ends.check()?;
    if !args.force {
        refuse_others(&recipe, folder)?;
    }
    let mut staged = Vec::new();
    for (file, target) in FILES.iter().zip(&targets) {
        staged.push(target.clone().stage(|out| recipe.write(file, out))?);
    }
    ends.check()?;
    output::commit(staged)?.iter().for_each(|note| say(&format!("note: {note}")));
    drop(progress);
    say(&format!(
        "wrote {}; draw them: planisphere render {}",
        recipe.words(),
        text::word(folder.join("scene.toml"))
    ));
    Ok(())
}

/// Refuses to replace what this command has not made.
fn refuse_others(recipe: &Recipe, folder: &Path) -> Result<(), Failure> {
    let earlier = Recipe::of(&folder.join("scene.toml"));
    let ours = |file: &str| {
        let path = folder.join(file);
        fs::metadata(&path).is_err_and(|error| error.kind() == io::ErrorKind::NotFound)
            || recipe.made(file, &path)
            || earlier.is_some_and(|earlier| earlier != *recipe && earlier.made(file, &path))
    };
    let others: Vec<&str> = FILES.into_iter().filter(|file| !ours(file)).collect();
    if others.is_empty() {
        return Ok(());
    }
    Err(Failure::Usage(format!(
        "{} in {} would be replaced, which `planisphere make` has not written, or which has been \
         changed since; name another folder, or add --force",
        others.join(", "),
        text::name(folder)
    )))
}

fn in_chunks(out: &mut dyn Write, count: u32, bytes: impl Fn(u32, &mut Vec<u8>)) -> io::Result<()> {
    let mut chunk = Vec::new();
    for first in (0..count).step_by(CHUNK as usize) {
        chunk.clear();
        (first..count.min(first.saturating_add(CHUNK))).for_each(|k| bytes(k, &mut chunk));
        out.write_all(&chunk)?;
    }
    Ok(())
}
