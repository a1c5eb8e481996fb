//! Files in: a scene file (TOML) and the NumPy arrays it names become a scene, a camera and an
//! image size.
//!
//! Nothing is clamped, dropped or guessed: what has no picture is refused with the file, line,
//! column and the fix. Only this module and [`crate::part`] read files; the command line and the
//! window are their callers.

use std::{
    fmt,
    panic::{self, AssertUnwindSafe},
    path::{Path, PathBuf},
    sync::Arc,
};

pub use array::Copied;
pub use mapped::ChangedFile;
pub use report::LoadError;

use planisphere_core::{
    camera::{Camera, ImageSize},
    drawing::Control,
    framing::Wanted,
    scene::Scene,
    text,
};

mod array;
mod batches;
mod colors;
mod document;
mod input;
pub(crate) mod mapped;
mod refused;
pub(crate) mod report;
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
    /// The camera, checked, when nothing of it is left to be chosen: see [`Loaded::camera`].
    pub fixed_camera: Option<Camera>,
    /// What `[camera]` says; none when the file has none.
    pub wanted: Option<Wanted>,
    /// Size of the image.
    pub image: ImageSize,
    /// Colour where there is no sphere, sRGB.
    pub background: [u8; 3],
    /// The arrays that were read.
    pub files: Vec<PathBuf>,
    /// The arrays that stay in their files.
    pub watch: Watch,
    /// The arrays that were copied into memory.
    pub copied: Vec<Copied>,
    /// What a person should hear who asked for something unusual, each one line.
    pub notes: Vec<String>,
}

/// Files that are in use where they lie, and may be changed by others meanwhile.
#[derive(Clone, Debug, Default)]
pub struct Watch(pub(crate) Vec<Arc<mapped::Mapped>>);

impl Watch {
    /// The first of the files that may have changed since it was opened: whatever was made of its
    /// numbers since is not to be used. Some microseconds for each file.
    pub fn changed(&self) -> Option<ChangedFile> {
        self.0.iter().find_map(|file| file.changed())
    }

    /// Whether there is no such file.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Does work that reads the files' numbers, and throws its result away, a panic included, where
    /// a file changed meanwhile: numbers of any value were read then. It can last long with these,
    /// so that another thread may want to ask as well.
    ///
    /// # Errors
    /// The file that changed.
    pub fn guard<T>(&self, work: impl FnOnce() -> T) -> Result<T, ChangedFile> {
        let result = panic::catch_unwind(AssertUnwindSafe(work));
        match (self.changed(), result) {
            (Some(changed), _) => Err(changed),
            (None, Ok(result)) => Ok(result),
            (None, Err(panic)) => panic::resume_unwind(panic),
        }
    }
}

impl fmt::Debug for Loaded {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Loaded")
            .field("spheres", &self.scene.len())
            .field("fixed_camera", &self.fixed_camera)
            .field("wanted", &self.wanted)
            .field("image", &self.image)
            .field("background", &self.background)
            .field("files", &self.files)
            .field("watch", &self.watch)
            .field("copied", &self.copied)
            .field("notes", &self.notes)
            .finish()
    }
}

impl Loaded {
    /// The camera for an image of some size: the file's; what that leaves out is chosen so that the
    /// whole scene is seen.
    pub fn camera(&self, image: ImageSize) -> Camera {
        self.wanted.unwrap_or_default().camera(&self.scene.bounds(), image)
    }
}

/// Loads a scene file; `-` is standard input. Arrays are found relative to the file's folder (of
/// `-`, the current folder). Large ones stay mapped: whoever draws asks [`Watch::changed`] before
/// the picture is used.
///
/// # Errors
/// The first thing in the file, or in its arrays, that has no picture.
pub fn load(path: &Path) -> Result<Loaded, LoadError> {
    load_controlled(path, &Control::new())
}

/// The same, which another thread can cancel, and which tells how far it is. A reading that is
/// cancelled ends soon, also while nothing comes from a pipe or, on Unix, from standard input.
///
/// # Errors
/// As [`load`]; and one that [is cancelled](LoadError::is_cancelled).
pub fn load_controlled(path: &Path, control: &Control) -> Result<Loaded, LoadError> {
    let from_stdin = path == Path::new("-");
    let loaded = read(path, from_stdin, control).map_err(|error| {
        // What was looked at in part may have any fault.
        if control.is_cancelled() { LoadError::cancelled() } else { error }
    });
    if from_stdin { loaded } else { loaded.map_err(|error| error.in_file(path)) }
}

fn read(path: &Path, from_stdin: bool, control: &Control) -> Result<Loaded, LoadError> {
    let name = if from_stdin { "<stdin>".into() } else { text::name(path) };
    let bytes = input::read(path, control)
        .map_err(|refused| LoadError::of_file(&name, refused.words, &refused.fix))?;
    control.reach(0.2);
    let text = String::from_utf8(bytes).map_err(|error| {
        let at = error.utf8_error().valid_up_to();
        let byte = error.as_bytes().get(at).copied().unwrap_or_default();
        let message = format!(
            "the scene file is not UTF-8 text: it has the byte 0x{byte:02x} where a \
                     character begins"
        );
        let fault = report::Fault::new(
            message,
            at..at,
            "not UTF-8",
            "save it as UTF-8, not as Latin-1 or \
                another encoding",
        );
        fault.into_error(&name, &String::from_utf8_lossy(error.as_bytes()))
    })?;
    let text = text.trim_start_matches('\u{feff}');
    if text.lines().all(|line| line.trim_start().is_empty() || line.trim_start().starts_with('#')) {
        let (problem, fix) = match text.trim().is_empty() {
            true if from_stdin => {
                ("nothing came in", "see why what was to write the scene has written nothing")
            }
            true => (
                "is empty",
                "write a scene into it (see the files in scenes/), or name another file",
            ),
            false => (
                "holds nothing but comments",
                "write a scene into it: [[sphere]] tables, and [camera] if need be",
            ),
        };
        return Err(LoadError::of_file(&name, problem, fix));
    }
    let folder = if from_stdin { Path::new("") } else { path.parent().unwrap_or(Path::new("")) };
    text_controlled(&name, text, folder, control)
}

/// Loads a scene from the text of a scene file. `name` is for messages; arrays are found relative
/// to `folder`.
///
/// # Errors
/// As [`load`].
pub fn from_text(name: &str, text: &str, folder: &Path) -> Result<Loaded, LoadError> {
    text_controlled(name, text, folder, &Control::new())
}

fn text_controlled(
    name: &str,
    text: &str,
    folder: &Path,
    control: &Control,
) -> Result<Loaded, LoadError> {
    // The mark that some editors write before UTF-8.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let loaded = scene_file::read(text, folder, control);
    let loaded = loaded.map_err(|fault| fault.into_error(name, text))?;
    control.reach(1.0);
    Ok(loaded)
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn errors_say_where() {
        let place = |error: &LoadError| (error.line(), error.column());
        let text = "# a comment\n[[sphere]]\ncenter = [0, 0, 0]\nradius = -1\n";
        let error = from_text("here", text, Path::new("")).expect_err("a radius below 0");
        assert_eq!((error.path(), place(&error)), (None, (Some(4), Some(10))));
        assert!(error.render(false).contains("here:4:10"), "{error}");

        let folder = tempfile::tempdir().unwrap();
        let scene = folder.path().join("scene.toml");
        let failed = |text: &str| {
            fs::write(&scene, text).unwrap();
            load(&scene).expect_err("no scene")
        };
        // An array that is not there, at the end of a line that is shown in part.
        let blanks = " ".repeat(300);
        let error =
            failed(&format!("[[spheres]]\nradius = 1\ncenters ={blanks}\"nowhere.npy\" # \u{e9}"));
        assert_eq!((error.path(), place(&error)), (Some(&*scene), (Some(3), Some(310))));
        assert!(error.message().contains("nowhere.npy"), "{error}");
        let error = failed("");
        assert_eq!((error.path(), place(&error)), (Some(&*scene), (None, None)));
        let nowhere = folder.path().join("nowhere.toml");
        let error = load(&nowhere).expect_err("no file");
        assert_eq!((error.path(), place(&error)), (Some(&*nowhere), (None, None)));
    }
}
