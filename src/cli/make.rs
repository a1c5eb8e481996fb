//! `planisphere make`: writes the arrays and the scene file of a large example scene.

use std::{
    fs,
    io::{self, Write},
};

use super::{
    Failure,
    args::{MakeArgs, MakeKind},
    progress::Progress,
    say,
};
use crate::{
    frame::npy_header,
    make::{Cloud, Lattice},
    output::{self, OutputError, Target},
};

/// Spheres that are written at a time.
const CHUNK: u32 = 1 << 16;

/// Writes `centers.npy`, `radii.npy`, `colors.npy` and `scene.toml`.
pub(super) fn run(args: &MakeArgs) -> Result<(), Failure> {
    let _progress = Progress::step("writing");
    let folder = &args.folder;
    let count = args.count;
    fs::create_dir_all(folder).map_err(|source| OutputError::Io { target: folder.display().to_string(), source })?;

    let cloud = Cloud::new(count, args.seed);
    let lattice = Lattice::new(count);
    let sphere = |index| match args.kind {
        MakeKind::Cloud => cloud.sphere(index),
        MakeKind::Lattice => lattice.sphere(index),
    };
    let (radius, words) = match args.kind {
        MakeKind::Cloud => {
            (cloud.radius(), format!("{count} equal spheres at random in a unit cube (seed {})", args.seed))
        }
        MakeKind::Lattice => (lattice.radius(), format!("{count} touching spheres on a face-centred cubic lattice")),
    };

    let n = count as usize;
    let array = |name: &str, descr, shape: &[usize], bytes: &dyn Fn(u32, &mut Vec<u8>)| {
        Target::File(folder.join(name)).stage(|out| {
            out.write_all(&npy_header(descr, shape))?;
            in_chunks(out, count, bytes)
        })
    };
    let staged = vec![
        array("centers.npy", "<f4", &[n, 3], &|k, bytes| {
            bytes.extend(sphere(k).0.iter().flat_map(|c| c.to_le_bytes()));
        })?,
        array("radii.npy", "<f4", &[n], &|_, bytes| bytes.extend(radius.to_le_bytes()))?,
        array("colors.npy", "|u1", &[n, 3], &|k, bytes| bytes.extend(sphere(k).1))?,
        Target::File(folder.join("scene.toml")).stage(|out| {
            write!(
                out,
                "# {words}, seen from a camera that frames them all.\n\n\
                 [image]\nwidth = 1024\nheight = 1024\n\n\
                 [[spheres]]\ncenters = \"centers.npy\"\nradii = \"radii.npy\"\ncolors = \"colors.npy\"\n"
            )
        })?,
    ];
    output::commit(staged)?;
    say(&format!("wrote {words}; draw them: planisphere render {}", folder.join("scene.toml").display()));
    Ok(())
}

fn in_chunks(out: &mut dyn Write, count: u32, bytes: &dyn Fn(u32, &mut Vec<u8>)) -> io::Result<()> {
    let mut chunk = Vec::new();
    for first in (0..count).step_by(CHUNK as usize) {
        chunk.clear();
        (first..count.min(first + CHUNK)).for_each(|k| bytes(k, &mut chunk));
        out.write_all(&chunk)?;
    }
    Ok(())
}
