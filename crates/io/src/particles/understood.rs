//! A file of particles is opened, and a frame of it becomes spheres and a line that says what was
//! understood.

use std::path::{Path, PathBuf};

use super::{
    Beginning, File, Format, Frame, Input, Particles,
    data::MARK,
    groups,
    spheres::{Appearance, Spheres, Unfit, spheres},
};
use crate::input::{mapped::ChangedFile, named::Named, report::LoadError};
use planisphere_core::{drawing::Control, scene::SceneError};

/// How a file of particles is to be read and drawn. What is not given, the file decides.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Options {
    /// Its format; by default that of its content.
    pub format: Option<Format>,
    /// Which frame.
    pub frame: Frame,
    /// Another file with what a trajectory lacks.
    pub topology: Option<PathBuf>,
    /// How the particles are drawn.
    pub appearance: Appearance,
    /// Where lines are drawn, also in a scene file: `jump`, `sphere`, or a column of groups.
    pub outline_by: Option<String>,
}

impl Options {
    /// The column of groups, if that is what lines go by.
    pub fn column(&self) -> Option<&str> {
        self.outline_by.as_deref().filter(|by| !matches!(*by, "jump" | "sphere"))
    }
}

/// A frame that was read, and what is drawn of it.
#[derive(Debug)]
pub struct Understood {
    /// The number of the frame, counted from the first.
    pub frame: usize,
    /// The frame.
    pub particles: Particles,
    /// The spheres.
    pub spheres: Spheres,
    /// What was understood, in one line.
    pub line: String,
}

/// Reads the frame that is asked for, and decides how it is drawn.
///
/// # Errors
/// What is wrong with the file, or with what is asked of it.
pub fn understand(
    file: &File,
    frame: Frame,
    appearance: &Appearance,
    control: &Control,
) -> Result<Understood, LoadError> {
    let frame = file.number(frame, control)?;
    let particles = file.read(frame, &control.part([0.0, 0.9]))?;
    let unfit = |unfit: Unfit| refused(file, unfit);
    let spheres = spheres(&particles, file.format().angstrom(), appearance).map_err(unfit)?;
    let line = line(file, frame, &particles, &spheres, control)?;
    Ok(Understood { frame, particles, spheres, line })
}

/// The groups of a frame's particles, by a column.
///
/// # Errors
/// When there is no such column, or its values are of no groups.
pub(crate) fn groups(
    file: &File,
    particles: &Particles,
    column: &str,
) -> Result<Vec<u32>, LoadError> {
    groups::groups(particles, column).map_err(|unfit| refused(file, unfit))
}

fn refused(file: &File, unfit: Unfit) -> LoadError {
    LoadError::of_file(file.name(), unfit.words, &unfit.fix)
}

/// What was understood of a file.
fn line(
    file: &File,
    frame: usize,
    particles: &Particles,
    spheres: &Spheres,
    control: &Control,
) -> Result<String, LoadError> {
    // Only as far as it takes: of a long file it is not known how many more frames there are.
    let frames = match (file.has_more_than(frame + 1, control), frame) {
        (Ok(false), frame) => format!("frame {frame} of {}", frame + 1),
        (Ok(true), _) => match file.known_frames() {
            Some(frames) => format!("frame {frame} of {frames}"),
            None => format!("frame {frame} of several"),
        },
        // What comes after it is cut short, or still being written.
        (Err(error), _) if error.is_cancelled() => return Err(error),
        (Err(_), _) => format!("frame {frame}, the last that is whole"),
    };
    let count = match particles.len() {
        1 => "1 particle".to_owned(),
        count => format!("{count} particles"),
    };
    let Spheres { radii_from, colors_from, notes, .. } = spheres;
    let mut parts = vec![
        format!("{}, {frames}, {count}", file.title()),
        format!("centres: {}", particles.centers_from),
        format!("radii: {radii_from}"),
        format!("colours: {colors_from}"),
    ];
    parts.extend(file.notes().iter().chain(&particles.notes).chain(notes).cloned());
    Ok(format!("{}: {}", file.name(), parts.join("; ")))
}

/// An input whose beginning was looked at.
pub(crate) enum Begun {
    /// A file of particles.
    Particles(Box<File>),
    /// What may be text.
    Text(Box<Beginning>),
}

/// Opens an input, and tells what it is by its content; by its name where that says nothing.
///
/// # Errors
/// When it cannot be read; when it is no file of its format; when it is cancelled.
pub(crate) fn begin(
    named: &Named<'_>,
    options: &Options,
    control: &Control,
) -> Result<Begun, LoadError> {
    let refused = |refused| named.refused(&refused);
    let beginning = Beginning::open(named.path, control).map_err(refused)?;
    let found = format(named.path, options, beginning.bytes());
    let Some((format, note)) = found else {
        // Zeros are in no text but UTF-16, of which the reader of scenes has its own words.
        let utf_16 = matches!(beginning.bytes(), [0xff, 0xfe, ..] | [0xfe, 0xff, ..]);
        let is_text = !beginning.bytes().contains(&0) && is_like_toml(beginning.bytes());
        if !is_text && !utf_16 && !is_scene(named.path) {
            return Err(unknown(&named.name));
        }
        return Ok(Begun::Text(Box::new(beginning)));
    };
    let Input { data, packed, notes } = beginning.into_data().map_err(refused)?;
    let notes = notes.into_iter().chain(note).collect();
    let file = File::open(named.name.clone(), format, data)?.with_words(packed, notes);
    let Some(topology) = &options.topology else { return Ok(Begun::Particles(Box::new(file))) };
    let other = Named::of(topology);
    let particles = other.finish(control, |other| {
        let Begun::Particles(file) = begin(other, &Options::default(), control)? else {
            return Err(LoadError::of_file(
                &other.name,
                "is a scene file, but a topology is a file of particles",
                "name the PDB, GRO or data file that the trajectory belongs to",
            ));
        };
        let particles = file.read(0, control)?;
        file.unchanged().map_err(|_| changed(&other.name))?;
        Ok(particles)
    })?;
    Ok(Begun::Particles(Box::new(file.with_topology(particles))))
}

/// Whether a file's name is that of a scene file.
fn is_scene(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("toml"))
}

/// Whether bytes begin as TOML does: with a table, or a key and a value. What is empty, and what
/// holds nothing but comments, the reader of scenes has its own words for.
fn is_like_toml(beginning: &[u8]) -> bool {
    let text = beginning.strip_prefix(MARK).unwrap_or(beginning);
    let mut lines = text.split(|byte| *byte == b'\n').map(<[u8]>::trim_ascii);
    let first = lines.find(|line| !line.is_empty() && !line.starts_with(b"#"));
    let is_key = |byte: &u8| byte.is_ascii_alphanumeric() || b"_-.\"'".contains(byte);
    first.is_none_or(|line| {
        let key = line.iter().take_while(|byte| is_key(byte)).count();
        let rest = line[key..].trim_ascii_start();
        line.starts_with(b"[") || (key > 0 && rest.starts_with(b"="))
    })
}

/// The format of an input that holds particles, and what is to be said of how it was told.
fn format(path: &Path, options: &Options, beginning: &[u8]) -> Option<(Format, Option<String>)> {
    if let Some(format) = options.format {
        return Some((format, None));
    }
    if is_scene(path) {
        return None;
    }
    let named = Format::of_path(path);
    let Some(found) = Format::of_content(beginning) else {
        let scene = !beginning.trim_ascii().is_empty() && is_like_toml(beginning);
        return named.filter(|_| !scene).map(|format| (format, None));
    };
    let differ = named.filter(|named| *named != found);
    let note = differ
        .map(|named| format!("its name says {}, and its content {}", named.title(), found.title()));
    Some((found, note))
}

/// What is wrong with a sphere of a file, and the fix.
pub(crate) fn scene_words(error: &SceneError) -> (String, &'static str) {
    match error {
        SceneError::Center { index, axis, value, .. } => (
            format!("{axis} of particle {index} (counted from 0) is {value}, not finite"),
            "correct the file, or leave the particle out",
        ),
        SceneError::Radius { index, value, .. } => (
            format!("the radius of particle {index} (counted from 0) is {value}, not positive"),
            "correct the file, or give one radius for all: --radius 0.5",
        ),
        other => (other.to_string(), "draw fewer spheres at a time"),
    }
}

/// That a file has changed.
pub(crate) fn changed(name: &str) -> LoadError {
    LoadError::of_file(name, ChangedFile::PROBLEM, ChangedFile::FIX)
}

/// That bytes are neither text nor a file of particles.
fn unknown(name: &str) -> LoadError {
    let formats: Vec<&str> = Format::all().map(Format::name).collect();
    LoadError::of_file(
        name,
        "is no scene file, and no file of particles of a format that is read",
        &format!(
            "write it as one of {}; where the content does not tell which it is, add --format",
            formats.join(", ")
        ),
    )
}
