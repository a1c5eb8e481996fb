//! Files of particles: every sample of `tests/data` is read as other programs read it, and every
//! broken one of `tests/broken.toml` is refused with its place and the fix.
//!
//! `tests/data/README.md` says where the samples come from, `tests/data/expected.py` what read
//! them.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
    process::{Command, Output, Stdio},
};

use planisphere_io::{
    load::{Control, Opened, open},
    particles::{
        Column, File, Options, Role, Values, elements::Element, spheres::Appearance, understand,
    },
};
use serde_json::Value;

const DATA: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data");

fn data(name: &str) -> PathBuf {
    Path::new(DATA).join(name)
}

/// Samples that may be refused in so many words, and why that is as good as reading them.
const REFUSED: [(&str, &str); 4] = [
    // The rows are as well of the styles edpd and peri.
    ("lammps-data/sphere-without-hint.data", "of which style"),
    // A model that does not end cannot be told from one that is cut short.
    ("pdb/models-not-ended.pdb", "no ENDMDL"),
    // Nothing says which column is x.
    ("csv/no-names.csv", "names of the columns"),
    ("csv/notes.csv", "several lines"),
];

/// What other programs read: a list of files.
fn expected() -> Vec<Value> {
    let text = fs::read_to_string(data("expected.json")).expect("expected.json");
    serde_json::from_str(&text).expect("JSON")
}

/// The centres of an array of f64.
fn centers(name: &str) -> Vec<f64> {
    let bytes = fs::read(data(name)).expect(name);
    let header = usize::from(u16::from_le_bytes([bytes[8], bytes[9]])) + 10;
    assert!(bytes.starts_with(b"\x93NUMPY\x01") && (bytes.len() - header).is_multiple_of(24));
    let numbers = bytes[header..].as_chunks::<8>().0;
    numbers.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect()
}

fn refused(name: &str) -> Option<&'static (&'static str, &'static str)> {
    REFUSED.iter().find(|(listed, _)| *listed == name)
}

fn opened(entry: &Value) -> Result<Box<File>, String> {
    let topology = entry["topology"].as_str().map(data);
    let options = Options { topology, ..Options::default() };
    let path = data(entry["file"].as_str().expect("a file"));
    match open(&path, &options, &Control::new()) {
        Ok(Opened::Particles(file)) => Ok(file),
        Ok(Opened::Scene(_)) => Err("is taken for a scene file".into()),
        Err(error) => Err(error.to_string()),
    }
}

/// What a column says of a particle, as text.
fn word(column: &Column, index: usize) -> String {
    match &column.values {
        Values::Words(words) => words.get(index).trim().to_owned(),
        values => values.get(index).map_or(String::new(), |value| value.to_string()),
    }
}

/// The symbol of a particle's element.
fn element(column: &Column, index: usize) -> String {
    let word = word(column, index);
    let number = word.parse().ok().and_then(Element::of_number);
    number.map_or(word, |element| element.symbol().to_owned())
}

/// How a frame differs from what is expected of it.
fn difference(file: &File, wanted: &Value) -> Option<String> {
    let number = wanted["index"].as_u64().expect("a number") as usize;
    let frame = planisphere_io::particles::Frame::FromFirst(number);
    let found = match understand(file, frame, &Appearance::default(), &Control::new()) {
        Ok(found) => found,
        Err(error) => return Some(error.to_string()),
    };
    let (particles, block) = (&found.particles, &found.spheres.block);
    let count = wanted["count"].as_u64().expect("a count") as usize;
    if particles.len() != count {
        return Some(format!("{} particles, not {count}", particles.len()));
    }
    let tolerance = wanted["tolerance"].as_f64().expect("a tolerance");
    for (at, wanted) in centers(wanted["centers"].as_str().expect("centres")).iter().enumerate() {
        let found = particles.centers.get(at);
        let near = (found - wanted).abs() <= tolerance;
        if !near && found.to_bits() != wanted.to_bits() {
            return Some(format!("coordinate {at} is {found:?}, not {wanted:?}"));
        }
    }
    let list = |key: &str| wanted[key].as_array().cloned().unwrap_or_default();
    let by_element = particles.role(Role::Element).or(particles.role(Role::AtomicNumber));
    for (index, wanted) in list("elements").iter().enumerate() {
        let Some(wanted) = wanted.as_str() else { continue };
        let found = by_element.map(|column| element(column, index)).unwrap_or_default();
        if !found.eq_ignore_ascii_case(wanted) {
            return Some(format!("element {index} is {found}, not {wanted}"));
        }
    }
    for (key, role) in [("types", Role::Type), ("ids", Role::Id)] {
        let wanted = list(key);
        let column = particles.role(role);
        // What the format's definition says where a file says nothing needs no column.
        if column.is_none() && wanted.iter().all(|value| *value == 0) {
            continue;
        }
        for (index, wanted) in wanted.iter().enumerate() {
            let found = column.map(|column| word(column, index)).unwrap_or_default();
            let wanted = wanted.as_str().map_or(wanted.to_string(), str::to_owned);
            if found != wanted {
                return Some(format!("{key} {index} is {found}, not {wanted}"));
            }
        }
    }
    for (index, wanted) in list("radii").iter().enumerate() {
        if Some(block.radius(index)) != wanted.as_f64() {
            return Some(format!("radius {index} is {}, not {wanted}", block.radius(index)));
        }
    }
    let colors = list("colors");
    let parts = colors.iter().flat_map(|row| row.as_array().expect("three numbers"));
    let parts: Vec<f64> = parts.map(|value| value.as_f64().expect("a number")).collect();
    let scale = if parts.iter().all(|part| *part <= 1.0) { 255.0 } else { 1.0 };
    for (index, wanted) in parts.as_chunks::<3>().0.iter().enumerate() {
        let wanted = wanted.map(|part| (scale * part).round() as u8);
        if block.color(index) != wanted {
            return Some(format!("colour {index} is {:?}, not {wanted:?}", block.color(index)));
        }
    }
    let left_out = wanted["left_out"].as_u64().filter(|left_out| *left_out > 0)?;
    let said = particles.notes.iter().any(|note| note.contains(&left_out.to_string()));
    (!said).then(|| format!("{left_out} were left out, and nothing says so"))
}

#[test]
fn every_sample_is_read_as_other_programs_read_it() {
    let (mut wrong, mut read) = (Vec::new(), 0);
    let all = expected();
    for entry in &all {
        let name = entry["file"].as_str().expect("a file").to_owned();
        // Of what is compressed it is what it is compressed from.
        let same = |other: &&Value| other["file"] == entry["same_as"];
        let wanted = all.iter().find(same).unwrap_or(entry);
        match (opened(entry), entry["refused"].as_bool() == Some(true)) {
            (Err(_), true) => {}
            (Ok(file), true) => {
                // What is wrong may be further in than the beginning.
                let control = Control::new();
                let all = |frames| (0..frames).try_for_each(|k| file.read(k, &control).map(|_| ()));
                let frames = file.frames(&control).unwrap_or(0);
                if frames > 0 && all(frames).is_ok() {
                    wrong.push(format!("{name}: is read, and must be refused"));
                }
            }
            (Err(error), false) => {
                if !refused(&name).is_some_and(|(_, words)| error.contains(words)) {
                    wrong.push(format!("{name}: {error}"));
                }
            }
            (Ok(file), false) if let Some((_, words)) = refused(&name) => {
                let error =
                    file.frames(&Control::new()).and_then(|_| file.read(0, &Control::new()));
                if !error.is_err_and(|error| error.to_string().contains(words)) {
                    wrong.push(format!("{name}: is read, but REFUSED lists it"));
                }
            }
            (Ok(file), false) => {
                let frames = file.frames(&Control::new()).map(|frames| frames as u64);
                if frames.as_ref().ok() != wanted["frames"].as_u64().as_ref() {
                    wrong.push(format!("{name}: {frames:?} frames, not {}", wanted["frames"]));
                }
                for wanted in wanted["read"].as_array().expect("frames") {
                    read += 1;
                    let differs = difference(&file, wanted);
                    wrong.extend(differs.map(|words| format!("{name}: {words}")));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{} are wrong:\n{}", wrong.len(), wrong.join("\n"));
    assert!(read > 250, "{read} frames were read");
}

fn program(folder: &Path, args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_planisphere"));
    command.args(args).current_dir(folder).stdin(Stdio::null());
    command.output().expect("the program runs")
}

/// `broken.toml`.
fn broken() -> Vec<toml::Table> {
    let path = Path::new(DATA).with_file_name("broken.toml");
    let text = fs::read_to_string(path).expect("broken.toml");
    let table: toml::Table = text.parse().expect("TOML");
    let list = table["broken"].as_array().expect("a list");
    list.iter().map(|entry| entry.as_table().expect("a table").clone()).collect()
}

/// Writes a broken file into a folder; its name.
fn write_broken(entry: &toml::Table, folder: &Path) -> String {
    let text = |key: &str| entry.get(key).and_then(|value| value.as_str());
    if let Some(name) = text("file") {
        return data("broken").join(name).to_string_lossy().into_owned();
    }
    let (name, mut bytes) = match text("from") {
        Some(name) => (name.to_owned(), fs::read(data(name)).expect(name)),
        None => {
            let suffix = text("suffix").expect("a suffix");
            (format!("broken{suffix}"), text("text").expect("a text").into())
        }
    };
    if let Some(cut) = entry.get("cut").and_then(|value| value.as_integer()) {
        bytes.truncate(cut as usize);
    }
    if let Some(pair) = entry.get("replace").and_then(|value| value.as_array()) {
        let [old, new] = [0, 1].map(|k| pair[k].as_str().expect("text").as_bytes());
        let at = bytes.windows(old.len()).position(|part| part == old).expect("what is replaced");
        bytes.splice(at..at + old.len(), new.iter().copied());
    }
    let name = Path::new(&name).file_name().expect("a name").to_string_lossy().into_owned();
    fs::write(folder.join(&name), bytes).expect("a file");
    name
}

#[test]
fn broken_files_are_refused_where_they_are_broken() {
    let mut wrong = Vec::new();
    let entries = broken();
    for entry in &entries {
        let name = entry["name"].as_str().expect("a name");
        let folder = tempfile::tempdir().expect("a folder");
        let file = write_broken(entry, folder.path());
        let mut args = vec!["convert", &file, "out-{frame}.npz", "--frames", "0.."];
        let topology = entry.get("topology").and_then(|value| value.as_str()).map(data);
        let topology = topology.map(|path| path.to_string_lossy().into_owned());
        if let Some(topology) = &topology {
            args.extend(["--topology", topology]);
        }
        let output = program(folder.path(), &args);
        let message = String::from_utf8_lossy(&output.stderr).to_lowercase();
        let words = entry["words"].as_array().expect("words").iter();
        let lacking: Vec<&str> = words
            .map(|word| word.as_str().expect("a word"))
            .filter(|word| !message.contains(word))
            .collect();
        if output.status.code() != Some(2) || !lacking.is_empty() || !message.contains("fix: ") {
            let code = output.status.code();
            wrong.push(format!("{name}: {code:?}, lacks {lacking:?}: {message}"));
        }
    }
    assert!(wrong.is_empty(), "{} are wrong:\n{}", wrong.len(), wrong.join("\n"));
    assert!(entries.len() >= 60);
}

/// A file that ends in no frame leaves nothing behind.
#[test]
fn a_refused_file_leaves_nothing() {
    for entry in broken().iter().step_by(7) {
        let folder = tempfile::tempdir().expect("a folder");
        let file = write_broken(entry, folder.path());
        let before = fs::read_dir(folder.path()).expect("a folder").count();
        for args in [&["convert", &file, "out.npz"][..], &["render", &file, "-o", "out.png"]] {
            if program(folder.path(), args).status.code() == Some(2) {
                assert_eq!(fs::read_dir(folder.path()).expect("a folder").count(), before);
            }
        }
    }
}

/// What `convert` writes is read again as the same numbers.
#[test]
fn what_is_converted_is_read_again() {
    let control = Control::new();
    let mut formats = BTreeMap::new();
    for entry in expected() {
        let Ok(file) = opened(&entry) else { continue };
        if entry["refused"].as_bool() == Some(true) || formats.len() > 40 {
            continue;
        }
        let name = entry["file"].as_str().expect("a file").to_owned();
        let kind = name.split('/').next().expect("a folder").to_owned();
        let seen: &mut usize = formats.entry(kind).or_default();
        *seen += 1;
        if *seen > 3 {
            continue;
        }
        let source = data(&name);
        let Ok(first) = file.read(0, &control) else { panic!("{name}") };
        for ending in ["npz", "ply", "xyz"] {
            let folder = tempfile::tempdir().expect("a folder");
            let out = folder.path().join("out").with_extension(ending);
            let args = ["convert", source.to_str().unwrap(), out.to_str().unwrap()];
            let output = program(folder.path(), &args);
            let message = String::from_utf8_lossy(&output.stderr);
            assert!(output.status.success(), "{name} {ending}: {message}");
            let again = match open(&out, &Options::default(), &control) {
                Ok(Opened::Particles(again)) => again,
                other => panic!("{name} {ending}: {other:?}"),
            };
            let again = again.read(0, &control).unwrap_or_else(|e| panic!("{name} {ending}: {e}"));
            assert_eq!(again.len(), first.len(), "{name} {ending}");
            for at in 0..3 * first.len() {
                let [a, b] = [&first, &again].map(|found| found.centers.get(at));
                assert!(a == b, "{name} {ending}: coordinate {at} is {b:?}, not {a:?}");
            }
        }
    }
    assert!(formats.len() >= 12, "{formats:?}");
}

/// Every command of the page on formats, in its order, in a folder that has the samples.
#[cfg(unix)]
#[test]
fn documented_commands_run() {
    let page = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/formats.md");
    let page = fs::read_to_string(page).expect("the page");
    let folder = tempfile::tempdir().expect("a folder");
    let tests = concat!(env!("CARGO_MANIFEST_DIR"), "/tests");
    std::os::unix::fs::symlink(tests, folder.path().join("tests")).expect("a link");
    let (mut commands, mut inside) = (0, false);
    for line in page.lines() {
        match line {
            "```sh" => inside = true,
            "```" => inside = false,
            command if inside => {
                let command = command.replace("planisphere ", "$P ");
                let output = Command::new("sh")
                    .args(["-c", &format!("set -e; {command}")])
                    .env("P", env!("CARGO_BIN_EXE_planisphere"))
                    .current_dir(folder.path())
                    .output()
                    .expect("a shell");
                let message = String::from_utf8_lossy(&output.stderr);
                assert!(output.status.success(), "{command}: {message}");
                commands += 1;
            }
            _ => {}
        }
    }
    assert!(commands >= 20, "{commands} commands were run");
}
