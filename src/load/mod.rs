//! Files in: a scene file (TOML) and the NumPy arrays it names become a scene, a camera and an image size.
//!
//! Nothing is clamped, dropped or guessed: what has no picture is refused with the file, line, column and the fix.
//! Only this module reads files, parts of pictures ([`part()`]) included; the command line and the window are its callers.

use std::{
    fs,
    io::{self, Read},
    path::{Path, PathBuf},
};

pub use part::part;
pub use report::LoadError;

use crate::{
    camera::{Camera, ImageSize},
    scene::Scene,
};

mod batches;
mod document;
mod npy;
mod part;
mod report;
mod scene_file;

/// The colour of a sphere that has none in its file, sRGB.
pub const DEFAULT_COLOR: [u8; 3] = [176, 176, 176];

/// The size of an image that has none in its file, in pixels.
pub const DEFAULT_IMAGE: ImageSize = ImageSize { width: 800, height: 800 };

/// What a scene file says.
#[derive(Clone)]
pub struct Loaded {
    /// The spheres.
    pub scene: Scene,
    /// The camera, checked; none when the file has no `[camera]`: see [`Loaded::camera`].
    pub fixed_camera: Option<Camera>,
    /// Size of the image.
    pub image: ImageSize,
    /// Colour where there is no sphere, sRGB.
    pub background: [u8; 3],
    /// The arrays that were read.
    pub files: Vec<PathBuf>,
}

impl Loaded {
    /// The camera for an image of some size: the file's, or one that sees the whole scene.
    pub fn camera(&self, image: ImageSize) -> Camera {
        self.fixed_camera.unwrap_or_else(|| Camera::framing(self.scene.bounds(), image))
    }
}

/// Loads a scene file; `-` is standard input. Arrays are found relative to the file's folder (of `-`, the current
/// folder) and stay mapped: they must not be changed while the scene is in use.
///
/// # Errors
/// The first thing in the file, or in its arrays, that has no picture.
pub fn load(path: &Path) -> Result<Loaded, LoadError> {
    let from_stdin = path == Path::new("-");
    let name = if from_stdin { "<stdin>".into() } else { path.display().to_string() };
    let bytes = if from_stdin {
        let mut bytes = Vec::new();
        io::stdin().lock().read_to_end(&mut bytes).map(|_| bytes)
    } else {
        fs::read(path)
    };
    let bytes = bytes.map_err(|error| match error.kind() {
        io::ErrorKind::NotFound => LoadError::of_file(&name, "no such file", "correct the name of the scene file"),
        io::ErrorKind::IsADirectory => {
            LoadError::of_file(&name, "is a folder", "name a scene file (TOML) instead of a folder")
        }
        _ => LoadError::of_file(&name, error, "make the scene file readable"),
    })?;
    let text = String::from_utf8(bytes).map_err(|error| {
        let at = error.utf8_error().valid_up_to();
        let fault = report::Fault::new("the scene file is not UTF-8 text", at..at, "not UTF-8", "save it as UTF-8");
        fault.into_error(&name, &String::from_utf8_lossy(error.as_bytes()))
    })?;
    if text.lines().all(|line| line.trim_start().is_empty() || line.trim_start().starts_with('#')) {
        let (problem, fix) = match text.trim().is_empty() {
            true if from_stdin => ("nothing came in", "see why what was to write the scene has written nothing"),
            true => ("is empty", "write a scene into it (see the files in scenes/), or name another file"),
            false => {
                ("holds nothing but comments", "write a scene into it: [[sphere]] tables, and [camera] if need be")
            }
        };
        return Err(LoadError::of_file(&name, problem, fix));
    }
    let folder = if from_stdin { Path::new("") } else { path.parent().unwrap_or(Path::new("")) };
    from_text(&name, &text, folder)
}

/// Loads a scene from the text of a scene file. `name` is for messages; arrays are found relative to `folder`.
///
/// # Errors
/// As [`load`].
pub fn from_text(name: &str, text: &str, folder: &Path) -> Result<Loaded, LoadError> {
    scene_file::read(text, folder).map_err(|fault| fault.into_error(name, text))
}
