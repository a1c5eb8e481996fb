//! Golden pictures: every committed scene has one, which each device draws pixel by pixel, and
//! which is true to the judge.
//!
//! `PLANISPHERE_BLESS=1 cargo test --release --test golden` writes them (from the CPU device) and
//! removes the ones that belong to no scene; the same run then checks what it wrote. A failure
//! leaves, in `target/golden-failures`, the picture as drawn (`.actual.png`), where it differs
//! (`.diff.png`: wrong pixels in red over a faint copy) and the worst pixels (`.txt`).

mod judge;

use std::{
    collections::BTreeSet,
    fmt::Write,
    fs,
    path::{Path, PathBuf},
    sync::LazyLock,
};

use image::{Rgb, RgbImage};
use judge::Judge;
use planisphere_core::camera::{Region, View};
use planisphere_image::Paint;
use planisphere_io::{
    load::{Loaded, load},
    png::write_png,
};
use planisphere_renderer::{Device, Engine};
use rayon::prelude::*;

/// Up to so many pixels times spheres the judge looks at every pixel, beyond at [`SAMPLE`] of them.
const ALL_PIXELS: usize = 4_000_000_000;
/// Pixels that the judge looks at in a large scene, chosen by a seed that is the scene's number of
/// spheres.
const SAMPLE: usize = 1000;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Files below a folder that end so, as paths inside it, in order.
fn files(folder: &Path, ending: &str) -> BTreeSet<PathBuf> {
    let mut found = BTreeSet::new();
    let mut folders = vec![folder.to_path_buf()];
    while let Some(next) = folders.pop() {
        let Ok(entries) = fs::read_dir(&next) else { continue };
        for path in entries.map(|entry| entry.expect("a folder that can be read").path()) {
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == ending) {
                found.insert(path.strip_prefix(folder).expect("it is below").to_path_buf());
            }
        }
    }
    found
}

/// A committed scene. `name` is its path below `scenes`, without the ending.
struct Entry {
    name: PathBuf,
    loaded: Loaded,
    view: View,
}

impl Entry {
    fn golden(&self) -> PathBuf {
        root().join("tests/golden").join(self.name.with_extension("png"))
    }

    fn region(&self) -> Region {
        Region::whole(self.view.image)
    }

    fn paint(&self) -> Paint<'_> {
        Paint { scene: &self.loaded.scene, background: self.loaded.look.behind() }
    }

    /// The picture as a device draws it, as a file.
    fn draw(&self, device: &mut Engine) -> Vec<u8> {
        let drawing = device
            .draw(&self.loaded.scene, &self.view, self.region())
            .unwrap_or_else(|error| panic!("{}: {error}", self.name.display()));
        let mut bytes = Vec::new();
        write_png(&mut bytes, self.region(), &drawing.ids, &self.paint())
            .expect("memory can be written");
        bytes
    }

    /// The colour that a pixel has if this is the nearest sphere.
    fn color(&self, id: i32) -> [u8; 3] {
        match usize::try_from(id) {
            Ok(index) => self.loaded.scene.sphere(index).unwrap().color,
            Err(_) => self.loaded.look.behind(),
        }
    }
}

/// All committed scenes; on demand the goldens have been blessed.
static SCENES: LazyLock<Vec<Entry>> = LazyLock::new(|| {
    make_cloud();
    let mut scenes = files(&root().join("scenes"), "toml");
    // Not committed: what `planisphere make` has written.
    scenes.retain(|path| !path.starts_with("cloud"));
    assert!(scenes.len() >= 4, "the report's scenes are missing: {scenes:?}");
    let entries: Vec<Entry> = scenes
        .into_iter()
        .map(|path| {
            let loaded =
                load(&root().join("scenes").join(&path)).unwrap_or_else(|error| panic!("{error}"));
            let view = View::new(loaded.camera(loaded.image), loaded.image);
            Entry { name: path.with_extension(""), loaded, view }
        })
        .collect();
    if std::env::var_os("PLANISPHERE_BLESS").is_some_and(|value| value == "1") {
        bless(&entries);
    }
    entries
});

/// Makes the arrays of `scenes/cloud.toml`, as that file says, where they are missing.
fn make_cloud() {
    let folder = root().join("scenes/cloud");
    if !folder.join("colors.npy").exists() {
        let made = std::process::Command::new(env!("CARGO_BIN_EXE_planisphere"))
            .args(["make", "cloud"])
            .arg(&folder)
            .status()
            .expect("the program runs");
        assert!(made.success(), "planisphere make cloud {}", folder.display());
    }
}

fn bless(entries: &[Entry]) {
    let mut device = Engine::open(&Device::Cpu).expect("the CPU is always there");
    for entry in entries {
        let path = entry.golden();
        fs::create_dir_all(path.parent().expect("it is in a folder"))
            .expect("tests/golden can be written");
        fs::write(&path, entry.draw(&mut device)).expect("tests/golden can be written");
    }
    for path in unused(entries) {
        fs::remove_file(&path).expect("tests/golden can be written");
    }
}

/// Goldens of no scene.
fn unused(entries: &[Entry]) -> Vec<PathBuf> {
    let used: BTreeSet<PathBuf> = entries.iter().map(Entry::golden).collect();
    let folder = root().join("tests/golden");
    files(&folder, "png")
        .into_iter()
        .map(|path| folder.join(path))
        .filter(|path| !used.contains(path))
        .collect()
}

fn decode(bytes: &[u8], path: &Path) -> RgbImage {
    image::load_from_memory(bytes)
        .unwrap_or_else(|error| panic!("{}: {error}", path.display()))
        .to_rgb8()
}

/// The golden's bytes, if there is one.
fn read(entry: &Entry) -> Result<Vec<u8>, String> {
    let path = entry.golden();
    fs::read(&path).map_err(|error| {
        format!(
            "{}: {error}\n    bless it with PLANISPHERE_BLESS=1 cargo test --release --test \
             golden\n",
            path.display()
        )
    })
}

/// How far two colours are apart.
fn apart(a: Rgb<u8>, b: Rgb<u8>) -> u32 {
    (0..3).map(|k| u32::from(a[k].abs_diff(b[k]))).sum()
}

/// Writes what helps to see a failure; says where.
fn leave(entry: &Entry, device: &str, want: Option<&RgbImage>, actual: &[u8]) -> String {
    let target = Path::new(env!("CARGO_TARGET_TMPDIR")).parent().expect("target/tmp is in target");
    let base = target.join("golden-failures").join(&entry.name);
    let file = |ending: &str| {
        let mut name = base.clone().into_os_string();
        name.push(format!(".{device}.{ending}"));
        PathBuf::from(name)
    };
    fs::create_dir_all(base.parent().expect("it is in a folder")).expect("target can be written");
    fs::write(file("actual.png"), actual).expect("target can be written");
    let got = decode(actual, &file("actual.png"));
    let mut text = String::new();
    match want {
        Some(want) if want.dimensions() == got.dimensions() => {
            let mut diff = RgbImage::from_fn(got.width(), got.height(), |x, y| {
                Rgb(want.get_pixel(x, y).0.map(|channel| channel / 4))
            });
            let mut wrong: Vec<(u32, u32, u32)> = got
                .enumerate_pixels()
                .map(|(x, y, &pixel)| (apart(pixel, *want.get_pixel(x, y)), x, y))
                .filter(|&(distance, ..)| distance > 0)
                .collect();
            for &(_, x, y) in &wrong {
                diff.put_pixel(x, y, Rgb([255, 0, 0]));
            }
            wrong.sort_by_key(|&(distance, x, y)| (std::cmp::Reverse(distance), y, x));
            let _ =
                writeln!(text, "{} of {} pixels differ", wrong.len(), got.width() * got.height());
            if wrong.is_empty() {
                let _ = writeln!(text, "only the encoding of the file differs");
            }
            for &(_, x, y) in wrong.iter().take(16) {
                let (want, got) = (want.get_pixel(x, y).0, got.get_pixel(x, y).0);
                let _ = writeln!(text, "column {x}, row {y}: want {want:?}, got {got:?}");
            }
            diff.save(file("diff.png")).expect("target can be written");
        }
        Some(want) => {
            let _ =
                writeln!(text, "want {:?} pixels, got {:?}", want.dimensions(), got.dimensions());
        }
        None => {
            let _ = writeln!(text, "there is no golden");
        }
    }
    fs::write(file("txt"), &text).expect("target can be written");
    format!(
        "{} on {device}: {text}    see {}\n",
        entry.name.display(),
        file("actual.png").display()
    )
}

fn draws_the_goldens(choice: &Device, name: &str) {
    let entries = &*SCENES;
    let mut device = Engine::open(choice).unwrap_or_else(|error| {
        panic!(
            "{error}\nThis test needs a software Vulkan device; on Debian: apt-get install \
                mesa-vulkan-drivers"
        )
    });
    assert_eq!(
        matches!(device, Engine::Cpu(_)),
        *choice == Device::Cpu,
        "{name} gave {}",
        device.description()
    );
    let mut failures = String::new();
    for entry in entries {
        let actual = entry.draw(&mut device);
        match read(entry) {
            Ok(golden) => {
                let want = decode(&golden, &entry.golden());
                // The pixels: what else a file holds is no part of the promise.
                if want != decode(&actual, &entry.golden()) {
                    failures += &leave(entry, name, Some(&want), &actual);
                }
            }
            Err(missing) => failures += &format!("{missing}{}", leave(entry, name, None, &actual)),
        }
    }
    assert!(failures.is_empty(), "\n{failures}");
}

#[test]
fn the_cpu_draws_the_goldens() {
    draws_the_goldens(&Device::Cpu, "cpu");
}

#[test]
fn the_gpu_draws_the_goldens() {
    draws_the_goldens(&Device::Gpu, "gpu");
}

#[test]
fn goldens_show_the_truth() {
    let mut failures = String::new();
    for entry in &*SCENES {
        let golden = match read(entry) {
            Ok(bytes) => decode(&bytes, &entry.golden()),
            Err(missing) => {
                failures += &missing;
                continue;
            }
        };
        let size = entry.view.image;
        if golden.dimensions() != (size.width, size.height) {
            let _ = writeln!(
                failures,
                "{}: {:?} pixels for {size:?}",
                entry.name.display(),
                golden.dimensions()
            );
            continue;
        }
        let judge = Judge::new(&entry.loaded.scene, &entry.view);
        let spheres = entry.loaded.scene.len();
        let judged: Vec<(u32, u32, i32)> = if spheres * size.pixels() <= ALL_PIXELS {
            let ids = judge.ids(entry.region());
            (0..size.height)
                .flat_map(|row| (0..size.width).map(move |column| (column, row)))
                .zip(ids)
                .map(|((column, row), id)| (column, row, id))
                .collect()
        } else {
            println!(
                "{}: the judge looks at {SAMPLE} pixels, seed {spheres}",
                entry.name.display()
            );
            // A multiplicative walk visits the pixels in no order that a tile or a row would have.
            (0..SAMPLE as u64)
                .into_par_iter()
                .map(|k| {
                    let mix =
                        (k + 1).wrapping_add(spheres as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
                    let pixel = ((u128::from(mix) * size.pixels() as u128) >> 64) as u64;
                    let (column, row) = (
                        (pixel % u64::from(size.width)) as u32,
                        (pixel / u64::from(size.width)) as u32,
                    );
                    (column, row, judge.id(column, row))
                })
                .collect()
        };
        let wrong: Vec<_> = judged
            .into_iter()
            .filter(|&(column, row, id)| golden.get_pixel(column, row).0 != entry.color(id))
            .collect();
        if let Some(&(column, row, id)) = wrong.first() {
            let _ = writeln!(
                failures,
                "{}: {} pixels are not what is there; column {column}, row {row} shows {:?}, \
                 sphere {id} is {:?}",
                entry.name.display(),
                wrong.len(),
                golden.get_pixel(column, row).0,
                entry.color(id)
            );
        }
    }
    assert!(failures.is_empty(), "\n{failures}");
}

#[test]
fn no_golden_is_unused() {
    let unused = unused(&SCENES);
    assert!(
        unused.is_empty(),
        "these belong to no scene: {unused:#?}\nPLANISPHERE_BLESS=1 cargo test --release --test \
         golden removes them"
    );
}
