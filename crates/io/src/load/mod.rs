//! Files in: a scene file (TOML) with the arrays and files of particles that it names, or a file of
//! particles alone, becomes a scene, a camera and an image size.
//!
//! Nothing is clamped: what has no picture is refused with the file, line, column and the fix, and
//! what is chosen for a file of particles is said. The command line and the window are the callers.

use std::{
    fmt,
    panic::{self, AssertUnwindSafe},
    path::{Path, PathBuf},
    sync::Arc,
};

pub use crate::{
    colors::DEFAULT_COLOR,
    input::{mapped::ChangedFile, report::LoadError},
    legend::Legend,
    npy::array::Copied,
};

pub use overlay::{Label, Length, Overlay};
pub use planisphere_core::{drawing::Control, framing::Wanted};

#[cfg(feature = "particles")]
use crate::particles::{
    File, Options, Understood,
    understood::{Begun, begin, changed, groups, scene_words, understand},
};
use crate::{
    colors,
    input::{
        mapped::{self, OpenError, ReadError, open_regular},
        named::Named,
        stream,
    },
};
use planisphere_core::{
    camera::{Camera, ImageSize},
    scene::Scene,
};
use planisphere_image::look::Look;

#[cfg(feature = "png")]
pub use self::picture::header;

mod batches;
mod document;
mod look;
mod overlay;
#[cfg(feature = "png")]
mod picture;
mod scene_file;

/// The size of an image that has none in its file, in pixels.
pub const DEFAULT_IMAGE: ImageSize = ImageSize { width: 800, height: 800 };

/// What a scene file, or a file of particles, says.
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
    /// What `[image]` says of the look; that of files of particles is chosen.
    pub look: Look,
    /// What `[image]` asks to be drawn over the picture.
    pub overlay: Overlay,
    /// What the colours mean; or why that has no legend.
    pub legend: Result<Legend, String>,
    /// The group of each sphere, if lines go by groups.
    pub groups: Option<Vec<u32>>,
    /// The arrays and files of particles that were read beside it.
    pub files: Vec<PathBuf>,
    /// The arrays that stay in their files.
    pub watch: Watch,
    /// The arrays that were copied into memory.
    pub copied: Vec<Copied>,
    /// What a person should hear who asked for something unusual, each one line.
    pub notes: Vec<String>,
    /// What was understood of each file of particles, in one line.
    pub understood: Vec<String>,
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
            .field("look", &self.look)
            .field("overlay", &self.overlay)
            .field("legend", &self.legend)
            .field("groups", &self.groups.as_ref().map(Vec::len))
            .field("files", &self.files)
            .field("watch", &self.watch)
            .field("copied", &self.copied)
            .field("notes", &self.notes)
            .field("understood", &self.understood)
            .finish()
    }
}

impl Loaded {
    /// The camera for an image of some size: the file's; what that leaves out is chosen so that the
    /// whole scene is seen.
    pub fn camera(&self, image: ImageSize) -> Camera {
        self.wanted.unwrap_or_default().camera(&self.scene.bounds(), image)
    }

    /// Takes another camera in place of the file's.
    pub fn set_camera(&mut self, wanted: Option<Wanted>) {
        self.fixed_camera = wanted.and_then(|wanted| wanted.fixed());
        self.wanted = wanted;
    }
}

/// Reads an sRGB colour: `#rrggbb`, `#rgb`, or a name of CSS.
///
/// # Errors
/// What is wrong with it and how colours are written, in one line.
pub fn color(text: &str) -> Result<[u8; 3], String> {
    colors::parse(text).map_err(|wrong| colors::words(&wrong))
}

/// Loads a scene file, or a file of particles; `-` is standard input. Arrays are found relative to
/// the file's folder (of `-`, the current folder). Large ones stay mapped: whoever draws asks
/// [`Watch::changed`] before the picture is used.
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
#[cfg(not(feature = "particles"))]
pub fn load_controlled(path: &Path, control: &Control) -> Result<Loaded, LoadError> {
    Named::of(path).finish(control, |named| {
        let bytes = stream::read(path, control).map_err(|refused| named.refused(&refused))?;
        control.reach(0.2);
        scene_of(named, bytes, None, control)
    })
}

/// The same, which another thread can cancel, and which tells how far it is. A reading that is
/// cancelled ends soon, also while nothing comes from a pipe or, on Unix, from standard input.
///
/// # Errors
/// As [`load`]; and one that [is cancelled](LoadError::is_cancelled).
#[cfg(feature = "particles")]
pub fn load_controlled(path: &Path, control: &Control) -> Result<Loaded, LoadError> {
    let options = Options::default();
    match open(path, &options, control)? {
        Opened::Scene(loaded) => Ok(*loaded),
        Opened::Particles(file) => of_frame(&file, &options, control),
    }
}

/// What an input is.
#[cfg(feature = "particles")]
#[derive(Debug)]
pub enum Opened {
    /// A file of particles.
    Particles(Box<File>),
    /// A scene file, read.
    Scene(Box<Loaded>),
}

/// Opens an input, and tells what it is by its content; by its name where that says nothing.
///
/// # Errors
/// When it cannot be read; when it is no file of its format; when it is cancelled.
#[cfg(feature = "particles")]
pub fn open(path: &Path, options: &Options, control: &Control) -> Result<Opened, LoadError> {
    Named::of(path).finish(control, |named| match begin(named, options, control)? {
        Begun::Particles(file) => Ok(Opened::Particles(file)),
        Begun::Text(beginning) => {
            let bytes = beginning.into_text().map_err(|refused| named.refused(&refused))?;
            control.reach(0.2);
            let outline_by = options.outline_by.as_deref();
            let loaded = scene_of(named, bytes, outline_by, control)?;
            Ok(Opened::Scene(Box::new(loaded)))
        }
    })
}

/// A file of particles as a scene.
///
/// # Errors
/// As [`understand`]; when a sphere has no picture; when the file has changed meanwhile.
#[cfg(feature = "particles")]
pub fn of_frame(file: &File, options: &Options, control: &Control) -> Result<Loaded, LoadError> {
    let understood = understand(file, options.frame, &options.appearance, control)?;
    let (line, legend) = (understood.line.clone(), understood.spheres.legend.clone());
    let groups = options.column().map(|column| groups(file, &understood.particles, column));
    let groups = groups.transpose()?;
    let (scene, watch) = scene_of_frame(file, understood)?;
    control.reach(1.0);
    Ok(Loaded {
        scene,
        fixed_camera: None,
        wanted: None,
        image: DEFAULT_IMAGE,
        look: Look::matte(),
        overlay: Overlay::default(),
        legend,
        groups,
        files: options.topology.iter().cloned().collect(),
        watch,
        copied: Vec::new(),
        notes: Vec::new(),
        understood: vec![line],
    })
}

/// The scene of a frame; its numbers may lie in the file.
///
/// # Errors
/// When a sphere has no picture; when the file has changed meanwhile.
#[cfg(feature = "particles")]
fn scene_of_frame(file: &File, understood: Understood) -> Result<(Scene, Watch), LoadError> {
    let Understood { spheres, particles, .. } = understood;
    let in_place = file.is_in_place(&spheres.block);
    // Columns that are not drawn take no memory any more.
    drop(particles);
    let scene = Scene::new(vec![spheres.block]);
    file.unchanged().map_err(|_| changed(file.name()))?;
    let scene = scene.map_err(|error| {
        let (words, fix) = scene_words(&error);
        LoadError::of_file(file.name(), words, fix)
    })?;
    let watch = file.data().mapped().filter(|_| in_place).into_iter().cloned().collect();
    Ok((scene, Watch(watch)))
}

/// Reads a whole file that is none of a scene, such as a picture to compare with; nothing where
/// there is none.
///
/// # Errors
/// When it is no regular file, cannot be read, or is longer than any picture.
pub fn whole(path: &Path) -> Result<Option<Vec<u8>>, LoadError> {
    /// A picture of the greatest size has 4 GiB, as has an array of its ids; some are of int64.
    const LONGEST: u64 = 9 << 30;
    let refused = |problem: String, fix: &str| {
        Err(LoadError::of_file(&crate::text::name(path), problem, fix).in_file(path))
    };
    let (file, metadata) = match open_regular(path) {
        Ok(opened) => opened,
        Err(OpenError::Missing) => return Ok(None),
        Err(OpenError::NotRegular(what)) => return refused(format!("is {what}"), "name a file"),
        Err(OpenError::Io(error)) => {
            return refused(format!("cannot be read: {error}"), OpenError::fix(&error));
        }
    };
    if metadata.len() > LONGEST {
        return refused("is longer than any picture".into(), "name a picture");
    }
    match mapped::read_whole(path, &file) {
        Ok(bytes) => Ok(Some(bytes)),
        Err(ReadError::Io(error)) => {
            refused(format!("cannot be read: {error}"), OpenError::fix(&error))
        }
        Err(ReadError::Changed) => refused("is being written".into(), "compare when it is done"),
    }
}

/// Reads the `[camera]` of a scene file, or of a picture that was drawn with one: a PNG.
///
/// # Errors
/// When there is none; what is wrong with it.
pub fn camera(path: &Path) -> Result<Wanted, LoadError> {
    let control = Control::new();
    Named::of(path).finish(&control, |named| {
        #[cfg(feature = "png")]
        if let Some(text) = picture::camera(path)? {
            let of = format!("{}, {}", named.name, crate::camera::KEY);
            return scene_file::camera(&text).map_err(|fault| fault.into_error(&of, &text));
        }
        let bytes = stream::read(path, &control).map_err(|refused| named.refused(&refused))?;
        let text = named.text(bytes)?;
        let text = text.trim_start_matches('\u{feff}');
        scene_file::camera(text).map_err(|fault| fault.into_error(&named.name, text))
    })
}

/// Bytes as a scene file. `outline_by`: in place of what the file says.
fn scene_of(
    named: &Named<'_>,
    bytes: Vec<u8>,
    outline_by: Option<&str>,
    control: &Control,
) -> Result<Loaded, LoadError> {
    let text = named.text(bytes)?;
    let text = text.trim_start_matches('\u{feff}');
    let comment = |line: &str| line.is_empty() || line.starts_with('#');
    if text.lines().all(|line| comment(line.trim_start())) {
        let (problem, fix) = match text.trim().is_empty() {
            true if named.from_stdin => {
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
        return Err(LoadError::of_file(&named.name, problem, fix));
    }
    let folder = match named.from_stdin {
        true => Path::new(""),
        false => named.path.parent().unwrap_or(Path::new("")),
    };
    text_controlled(&named.name, text, folder, outline_by, control)
}

/// Loads a scene from the text of a scene file. `name` is for messages; arrays are found relative
/// to `folder`.
///
/// # Errors
/// As [`load`].
pub fn from_text(name: &str, text: &str, folder: &Path) -> Result<Loaded, LoadError> {
    text_controlled(name, text, folder, None, &Control::new())
}

fn text_controlled(
    name: &str,
    text: &str,
    folder: &Path,
    outline_by: Option<&str>,
    control: &Control,
) -> Result<Loaded, LoadError> {
    // The mark that some editors write before UTF-8.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let loaded = scene_file::read(text, folder, outline_by, control);
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
