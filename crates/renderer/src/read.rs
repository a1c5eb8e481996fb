//! Scene files, and files of particles.

use std::path::{Path, PathBuf};

use planisphere_core::drawing::Control;
use planisphere_io::load::{self, Loaded};

#[cfg(feature = "overlay")]
use crate::overlay::{Legend, Overlay};
use crate::{Camera, Error, Job, Look, Scene, turns::Turns};

/// What a scene file, or a file of particles, says.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Document {
    /// The spheres. Large arrays stay in their files, which are watched: a picture of files that
    /// were changed meanwhile is an error.
    pub scene: Scene,
    /// Columns and rows of the picture.
    pub size: [u32; 2],
    /// What `[image]` says of the look: flat colours without. Of a file of particles it is
    /// [`Look::matte`].
    pub look: Look,
    /// What `[image]` asks to be drawn over the picture.
    #[cfg(feature = "overlay")]
    pub overlay: Overlay,
    /// What the colours of files of particles mean, where that has a legend.
    #[cfg(feature = "overlay")]
    pub legend: Option<Legend>,
    /// What a person should hear who asked for something unusual, each one line.
    pub notes: Vec<String>,
    /// What was understood of each file of particles, in one line: its format, the frame, and where
    /// centres, radii and colours come from.
    pub understood: Vec<String>,
    loaded: Loaded,
}

impl Document {
    /// The camera for a picture of some columns and rows: the file's; what that leaves out is
    /// chosen so that the whole scene is seen.
    ///
    /// # Errors
    /// When the file's numbers and what is chosen are no camera together, as of a scene so far away
    /// that no f64 is as large.
    pub fn camera(&self, size: [u32; 2]) -> Result<Camera, Error> {
        let [width, height] = size;
        let image = planisphere_core::camera::ImageSize { width, height };
        Ok(Camera::try_from(self.loaded.camera(image))?)
    }
}

/// Reads a scene file; with the feature `formats` also a file of particles (XYZ, LAMMPS, PDB,
/// mmCIF, GRO, PLY, CSV, NumPy, GSD, XTC, DCD), of which the first frame is drawn. Arrays are found
/// relative to the file's folder.
///
/// # Errors
/// The first thing in the file, or in its arrays, that has no picture: [`Error::File`].
pub fn read(path: impl AsRef<Path>) -> Result<Document, Error> {
    read_controlled(path.as_ref(), &Control::new())
}

/// The same as a job, on a thread of its own.
pub fn start_read(path: impl Into<PathBuf>) -> Job<Document> {
    Job::begin(&Turns::new(1), path.into(), |path, control| read_controlled(path, control))
}

fn read_controlled(path: &Path, control: &Control) -> Result<Document, Error> {
    // To the loader that would be standard input.
    let path = if path == Path::new("-") { Path::new("./-") } else { path };
    let loaded = load::load_controlled(path, control).map_err(|error| match error {
        error if error.is_cancelled() => Error::Cancelled,
        error => error.into(),
    })?;
    let Loaded { image, look, notes, understood, .. } = &loaded;
    #[cfg(not(feature = "overlay"))]
    if !loaded.overlay.is_empty() {
        let words = "[image] asks for a title, legend, scale bar or axes, without which this \
                     library was built; build it with the feature `overlay`, or leave these out";
        return Err(Error::Overlay { words: words.into() });
    }
    Ok(Document {
        scene: Scene::from(&loaded),
        size: [image.width, image.height],
        look: look.clone(),
        #[cfg(feature = "overlay")]
        overlay: overlay(&loaded.overlay, loaded.legend.as_ref().ok()),
        #[cfg(feature = "overlay")]
        legend: loaded.legend.as_ref().ok().map(|found| legend(found, &load::Label::Column, None)),
        notes: notes.clone(),
        understood: understood.clone(),
        loaded,
    })
}

/// What a file, or a person, asks for; `found` is what the colours mean, and must be there if a
/// legend is asked for.
#[cfg(feature = "overlay")]
#[doc(hidden)]
pub fn overlay(wanted: &load::Overlay, found: Option<&planisphere_io::legend::Legend>) -> Overlay {
    let load::Overlay { title, legend: label, scale_bar, axes, unit } = wanted;
    let mut overlay = Overlay::new();
    if let Some(title) = title {
        overlay = overlay.title(title);
    }
    if let (Some(label), Some(found)) = (label, found) {
        overlay = overlay.legend(legend(found, label, unit.as_deref()));
    }
    overlay = match scale_bar {
        None => overlay,
        Some(load::Length::Chosen) => overlay.scale_bar(),
        Some(load::Length::Of(length)) => overlay.scale_bar_of(*length),
    };
    if *axes {
        overlay = overlay.axes();
    }
    match unit {
        Some(unit) => overlay.unit(unit),
        None => overlay,
    }
}

/// What the colours mean, as it is drawn.
#[cfg(feature = "overlay")]
fn legend(
    found: &planisphere_io::legend::Legend,
    label: &load::Label,
    unit: Option<&str>,
) -> Legend {
    use planisphere_io::legend::Legend as Found;
    match found {
        Found::Kinds(kinds) => Legend::Keys(kinds.clone()),
        Found::Numbers { map, range, name } => {
            let label = match (label, unit) {
                (load::Label::Words(words), _) => words.clone(),
                (load::Label::Column, Some(unit)) => format!("{name} ({unit})"),
                (load::Label::Column, None) => name.clone(),
            };
            Legend::Bar { map: *map, range: *range, label }
        }
    }
}

/// Of the inner crates, which promise nothing.
#[doc(hidden)]
impl From<&Loaded> for Scene {
    fn from(loaded: &Loaded) -> Self {
        Self::loaded(loaded)
    }
}
