//! Why not, in one type to match on.

use std::{fmt, io, path::PathBuf};

use planisphere_core::{
    camera::{CameraError, MAX_SIDE, Region, ViewError},
    depth::PlaneError,
    drawing::DrawError,
    part::merge::MergeError,
    scene::{MAX_SPHERES, SceneError},
};

use planisphere_image::look::LookError;

use crate::engine::DeviceError;

/// Why not. `Display` is one line, which ends with the fix (of [`Error::NoDevice`] one for each
/// device that was tried); [`Error::fix`] is the fix alone.
#[derive(Debug)]
#[non_exhaustive]
pub enum Error {
    /// A number of a sphere has no picture: a coordinate must be finite, a radius positive and
    /// finite.
    Sphere {
        /// Index of the sphere in the whole scene.
        index: usize,
        /// `x`, `y`, `z` or `radius`.
        field: &'static str,
        /// The number found.
        value: f64,
    },
    /// Something has another length than what it belongs to.
    Length {
        /// What it is, such as `radii`.
        what: &'static str,
        /// How many there are.
        found: usize,
        /// How many are needed.
        wanted: usize,
    },
    /// Numbers were others at a second look: something writes to memory that a scene keeps.
    Changing,
    /// Numbers are no camera.
    Camera {
        /// Which of them: `origin`, `view`, `up`, `width`, `height`, `fov` or `clip`; of a turn
        /// `about`, `axis` or `of`.
        field: &'static str,
        /// Why not, and the fix.
        words: String,
    },
    /// A look cannot be what was asked for.
    Look(LookError),
    /// What is to be drawn over a picture has no meaning, or no room.
    Overlay {
        /// Why not, and the fix.
        words: String,
    },
    /// A count is zero, or beyond a limit.
    Size {
        /// Of what, such as `image width` or `spheres`.
        what: &'static str,
        /// The count found.
        found: u64,
        /// The greatest that is allowed.
        limit: u64,
    },
    /// A region has no pixels, or reaches outside of its image.
    Region {
        /// The region.
        region: Region,
        /// Columns and rows of the image.
        size: [u32; 2],
    },
    /// Memory does not suffice.
    Memory {
        /// Bytes that are needed, if that is known.
        needed: Option<u64>,
        /// Bytes that there are, if that is known.
        available: Option<u64>,
        /// What they are needed for, and the fix.
        words: String,
    },
    /// No threads of its own can be had.
    Threads {
        /// The system's words.
        words: String,
    },
    /// There is no such device.
    NoDevice {
        /// What was tried, and what to install.
        words: String,
    },
    /// The device is gone for good: open a new [`crate::Renderer`].
    DeviceLost {
        /// The device's words.
        words: String,
    },
    /// The device failed at this picture.
    Device {
        /// The device's words.
        words: String,
    },
    /// It was cancelled.
    Cancelled,
    /// A plane was asked of a picture that was drawn without it.
    NoPlane {
        /// `ids`, `colors` or `depths`.
        plane: &'static str,
    },
    /// The picture has more than the 256 colours that a palette holds.
    Palette,
    /// A texture cannot take the picture.
    Texture {
        /// Why not, and the fix.
        words: String,
    },
    /// A file, or bytes, are not what they are read as.
    File {
        /// The file; none for bytes and standard input.
        path: Option<PathBuf>,
        /// The line, from 1 on, where there are lines.
        line: Option<u32>,
        /// The column, from 1 on, where there are lines.
        column: Option<u32>,
        /// What is wrong, and the fix.
        words: String,
    },
    /// A file that is in use where it lies was changed meanwhile: its pictures are worth nothing.
    Changed {
        /// Which, and the fix.
        words: String,
    },
    /// Parts do not fit together, or are damaged.
    Parts {
        /// Why not, and the fix.
        words: String,
    },
    /// A file cannot be written.
    Write {
        /// Why not, and the fix.
        words: String,
    },
    /// The reader or writer of the caller failed.
    Io(io::Error),
}

impl Error {
    /// What to do, in words, where anything can be done: the end of the line that `Display` gives.
    ///
    /// ```
    /// # use planisphere_renderer as planisphere;
    /// use planisphere::{Camera, Error};
    ///
    /// let error = Camera::orthographic([0.0; 3], [0.0; 3], 10.0).unwrap_err();
    /// assert!(matches!(error, Error::Camera { field: "view", .. }));
    /// assert_eq!(error.fix().unwrap(), "give any other vector, such as [1.0, 0.0, 0.0]");
    /// ```
    pub fn fix(&self) -> Option<String> {
        let words = self.to_string();
        let after = |mark: &str| words.split_once(mark).map(|(_, fix)| fix.trim().to_owned());
        after("\nfix:").or_else(|| after("; "))
    }
}

#[cfg(feature = "files")]
#[doc(hidden)]
impl From<planisphere_io::output::OutputError> for Error {
    fn from(error: planisphere_io::output::OutputError) -> Self {
        Self::Write { words: error.to_string() }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Sphere { index, field: "radius", value } => write!(
                f,
                "the radius of sphere {index} is {value}; give a positive finite number, or leave \
                 the sphere out"
            ),
            Self::Sphere { index, field, value } => write!(
                f,
                "{field} of the centre of sphere {index} is {value}; give a finite number, or \
                 leave the sphere out"
            ),
            Self::Length { what, found, wanted } => {
                write!(f, "there are {found} {what}; give {wanted}")
            }
            Self::Changing => write!(
                f,
                "the numbers change while they are read; give memory that nothing writes to"
            ),
            Self::Size { what, found, limit } => {
                write!(f, "the number of {what} is {found}; give 1 to {limit}")
            }
            Self::Region { region: Region { x, y, width, height }, size: [across, down] } => {
                write!(
                    f,
                    "the region {x},{y},{width},{height} (x,y,w,h) is empty or reaches outside of \
                 the image of {across} x {down} pixels; give at least 1 x 1 pixel inside of it"
                )
            }
            Self::Cancelled => write!(f, "the drawing was cancelled"),
            Self::NoPlane { plane } => {
                write!(f, "the picture has no {plane}; ask for them in its request")
            }
            Self::Look(error) => error.fmt(f),
            Self::Palette => write!(
                f,
                "the picture has more than 256 colours, and a palette holds no more; write it as \
                 RGB"
            ),
            Self::Threads { words } => write!(
                f,
                "no threads to draw with: {words}; raise the system's limit, or ask for fewer"
            ),
            Self::DeviceLost { words } => {
                write!(f, "the device is lost: {words}; open a new renderer")
            }
            Self::Device { words } => write!(f, "the device failed: {words}"),
            Self::Camera { words, .. }
            | Self::Memory { words, .. }
            | Self::NoDevice { words }
            | Self::File { words, .. }
            | Self::Changed { words }
            | Self::Overlay { words }
            | Self::Texture { words }
            | Self::Parts { words }
            | Self::Write { words } => f.write_str(words),
            Self::Io(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for Error {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Io(error) => Some(error),
            _ => None,
        }
    }
}

impl From<io::Error> for Error {
    fn from(error: io::Error) -> Self {
        Self::Io(error)
    }
}

#[doc(hidden)]
impl From<CameraError> for Error {
    fn from(error: CameraError) -> Self {
        let field = match error {
            CameraError::NotFinite(field) => field,
            CameraError::ZeroView => "view",
            CameraError::UpZero | CameraError::UpParallel => "up",
            CameraError::Size { what, .. } => what,
            CameraError::Fov(_) => "fov",
            CameraError::Planes { .. } => "clip",
        };
        Self::Camera { field, words: error.to_string() }
    }
}

impl From<LookError> for Error {
    fn from(error: LookError) -> Self {
        Self::Look(error)
    }
}

#[doc(hidden)]
impl From<ViewError> for Error {
    fn from(error: ViewError) -> Self {
        match error {
            ViewError::Camera(error) => error.into(),
            ViewError::Image(image) => {
                let fits = (1..=MAX_SIDE).contains(&image.width);
                let (what, found) = match fits {
                    true => ("rows of the image", image.height),
                    false => ("columns of the image", image.width),
                };
                Self::Size { what, found: found.into(), limit: MAX_SIDE.into() }
            }
            ViewError::Outside { region, image } => {
                Self::Region { region, size: [image.width, image.height] }
            }
            ViewError::Empty(region) | ViewError::Large(region) => {
                Self::Region { region, size: [0; 2] }
            }
            ViewError::Stale => Self::Device { words: error.to_string() },
        }
    }
}

#[doc(hidden)]
impl From<SceneError> for Error {
    fn from(error: SceneError) -> Self {
        match error {
            SceneError::Center { index, axis, value, .. } => {
                let field = match axis {
                    'x' => "x",
                    'y' => "y",
                    _ => "z",
                };
                Self::Sphere { index, field, value }
            }
            SceneError::Radius { index, value, .. } => {
                Self::Sphere { index, field: "radius", value }
            }
            SceneError::Shape { what, found, wanted, .. } => Self::Length { what, found, wanted },
            SceneError::Changing { .. } => Self::Changing,
            SceneError::TooMany(found) => {
                Self::Size { what: "spheres", found: found as u64, limit: MAX_SPHERES as u64 }
            }
        }
    }
}

#[doc(hidden)]
impl From<DrawError> for Error {
    fn from(error: DrawError) -> Self {
        match error {
            DrawError::View(error) => error.into(),
            DrawError::Device(words) => Self::Device { words },
            DrawError::Cancelled => Self::Cancelled,
            DrawError::Memory { needed, words } => Self::Memory { needed, available: None, words },
        }
    }
}

#[doc(hidden)]
impl From<DeviceError> for Error {
    fn from(DeviceError::NoAdapter(words): DeviceError) -> Self {
        Self::NoDevice { words }
    }
}

#[doc(hidden)]
impl From<PlaneError> for Error {
    fn from(error: PlaneError) -> Self {
        match error {
            PlaneError::View(error) => error.into(),
            other => Self::Parts { words: other.to_string() },
        }
    }
}

#[doc(hidden)]
impl From<MergeError> for Error {
    fn from(error: MergeError) -> Self {
        Self::Parts { words: error.to_string() }
    }
}

#[cfg(feature = "read")]
#[doc(hidden)]
impl From<planisphere_io::load::LoadError> for Error {
    fn from(error: planisphere_io::load::LoadError) -> Self {
        Self::File {
            path: error.path().map(Into::into),
            line: error.line(),
            column: error.column(),
            words: error.to_string(),
        }
    }
}

#[cfg(feature = "read")]
#[doc(hidden)]
impl From<planisphere_io::load::ChangedFile> for Error {
    fn from(error: planisphere_io::load::ChangedFile) -> Self {
        Self::Changed { words: error.to_string() }
    }
}

#[cfg(feature = "parts")]
#[doc(hidden)]
impl From<planisphere_io::part::PartError> for Error {
    fn from(error: planisphere_io::part::PartError) -> Self {
        Self::Parts { words: error.to_string() }
    }
}
