//! From where it is seen: the camera, and a camera together with an image size.
//!
//! Everything here is the f64 numbers of the contract, unrounded; the orthonormal axes, which are
//! irrational in general, are made by [`crate::axes`]. The spaces: *world* is the scene's
//! own; *view* has its origin at the camera, x along `right`, y along `up`, z (the depth) along the
//! view direction, in world units.

use glam::DVec3;

/// The largest image, in pixels a side.
pub const MAX_SIDE: u32 = 32768;

/// How rays run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Projection {
    /// All rays along the view direction, from the image plane through the origin.
    Orthographic,
    /// All rays from the origin, through the image plane at distance 1.
    Perspective,
}

/// Size of the screen: in world units (orthographic), or at distance 1 (perspective).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ScreenSize {
    /// Width; the height follows from the aspect of the image, unrounded.
    Width(f64),
    /// Height; the width follows from the aspect of the image, unrounded.
    Height(f64),
    /// Both; pixels need not be square.
    Both {
        /// Width.
        width: f64,
        /// Height.
        height: f64,
    },
}

/// A camera as it is given: its numbers are exact, its axes follow from them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Orthographic or perspective.
    pub projection: Projection,
    /// Position, in world units.
    pub origin: DVec3,
    /// View direction, of any length but zero.
    pub view: DVec3,
    /// Which way is up, not parallel to `view`.
    pub up: DVec3,
    /// Size of the screen.
    pub size: ScreenSize,
    /// Nearest distance that is seen, included.
    pub near: f64,
    /// Farthest distance that is seen, included; infinity for none.
    pub far: f64,
}

/// Why numbers are not a camera.
#[derive(Clone, Debug, thiserror::Error, PartialEq)]
pub enum CameraError {
    /// A number is NaN or infinite.
    #[error("{0} is not finite; give finite numbers")]
    NotFinite(&'static str),
    /// The view direction is zero.
    #[error("the view direction is zero; give any other vector, such as [1.0, 0.0, 0.0]")]
    ZeroView,
    /// Up is zero.
    #[error(
        "up is zero; give a vector that is not parallel to the view direction, or none: then it \
         is [0.0, 0.0, 1.0]"
    )]
    UpZero,
    /// Up and view are parallel.
    #[error("up is parallel to the view direction; give an up that points another way")]
    UpParallel,
    /// The screen has no size.
    #[error("the screen's {what} is {value}; give a positive number")]
    Size {
        /// `width` or `height`.
        what: &'static str,
        /// The number found.
        value: f64,
    },
    /// The field of view is no angle of a screen.
    #[error("the field of view is {0} degrees; give an angle greater than 0 and less than 180")]
    Fov(f64),
    /// Clip planes out of order.
    #[error("near is {near} and far is {far}; near must be at least 0 and less than far")]
    Planes {
        /// Near.
        near: f64,
        /// Far.
        far: f64,
    },
}

/// Why there is no picture of a region of a view.
#[derive(Clone, Debug, thiserror::Error, PartialEq)]
pub enum ViewError {
    /// The camera's numbers are no camera.
    #[error("{0}")]
    Camera(#[from] CameraError),
    /// The image has no pixels, or more than the limit.
    #[error("the image is {} x {} pixels; give 1 to {MAX_SIDE} a side", .0.width, .0.height)]
    Image(ImageSize),
    /// The camera or the image size was changed after the view was made of them.
    #[error(
        "the view was changed after it was made; make it anew: View::new(view.camera, view.image)"
    )]
    Stale,
    /// The region has no pixels.
    #[error("the region is {} x {} pixels; give at least 1 x 1", .0.width, .0.height)]
    Empty(Region),
    /// The region has more columns or rows than are drawn at once.
    #[error(
        "the region is {} x {} samples; draw it in parts of at most {MAX_SIDE} a side",
        .0.width, .0.height
    )]
    Large(Region),
    /// The region is not a part of the image.
    #[error(
        "the region {},{},{},{} (x,y,w,h) reaches outside of the image of {} x {} pixels; keep it \
         inside",
        .region.x, .region.y, .region.width, .region.height, .image.width, .image.height
    )]
    Outside {
        /// The region.
        region: Region,
        /// The image.
        image: ImageSize,
    },
}

impl Camera {
    /// An orthographic camera with a square 10 x 10 screen and no far plane.
    pub fn orthographic(origin: DVec3, view: DVec3) -> Self {
        Self {
            projection: Projection::Orthographic,
            origin,
            view,
            up: DVec3::Z,
            size: ScreenSize::Both { width: 10.0, height: 10.0 },
            near: 0.0,
            far: f64::INFINITY,
        }
    }

    /// Whether these numbers are a camera.
    ///
    /// # Errors
    /// The first rule that is broken.
    pub fn check(&self) -> Result<(), CameraError> {
        for (name, vector) in [("origin", self.origin), ("view", self.view), ("up", self.up)] {
            if !vector.is_finite() {
                return Err(CameraError::NotFinite(name));
            }
        }
        if self.view == DVec3::ZERO {
            return Err(CameraError::ZeroView);
        }
        if self.up == DVec3::ZERO {
            return Err(CameraError::UpZero);
        }
        if crate::axes::parallel(self.view, self.up) {
            return Err(CameraError::UpParallel);
        }
        let side = |what, value: f64| {
            if value.is_finite() && value > 0.0 {
                Ok(())
            } else {
                Err(CameraError::Size { what, value })
            }
        };
        match self.size {
            ScreenSize::Width(width) => side("width", width)?,
            ScreenSize::Height(height) => side("height", height)?,
            ScreenSize::Both { width, height } => {
                side("width", width)?;
                side("height", height)?;
            }
        }
        let (near, far) = (self.near, self.far);
        if !(near.is_finite() && near >= 0.0 && near < far) {
            return Err(CameraError::Planes { near, far });
        }
        Ok(())
    }
}

/// Image size in pixels, each side 1 to [`MAX_SIDE`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ImageSize {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

impl ImageSize {
    /// Columns times rows.
    pub fn pixels(self) -> usize {
        self.width as usize * self.height as usize
    }
}

/// A part of an image: the pixels `x .. x + width`, `y .. y + height` of the whole.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Region {
    /// First column.
    pub x: u32,
    /// First row.
    pub y: u32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

impl Region {
    /// The whole of an image.
    #[doc(hidden)]
    pub fn whole(image: ImageSize) -> Self {
        Self { x: 0, y: 0, width: image.width, height: image.height }
    }

    /// Columns times rows.
    pub fn pixels(self) -> usize {
        self.width as usize * self.height as usize
    }
}

/// Size of one pixel on the screen, exactly `length / divisor`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pitch {
    /// Length of a side of the screen.
    pub length: f64,
    /// Number of pixels on that side.
    pub divisor: u32,
}

impl Pitch {
    /// The nearest f64 (away from overflow and underflow).
    pub fn to_f64(self) -> f64 {
        self.length / f64::from(self.divisor)
    }
}

/// A camera and a raster: every sample point of the picture, exactly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// The camera.
    pub camera: Camera,
    /// The whole raster, also when only a region of it is drawn: columns and rows of samples.
    pub image: ImageSize,
    /// Width of a sample.
    pub pitch_x: Pitch,
    /// Height of a sample.
    pub pitch_y: Pitch,
    /// Samples a side of a pixel; 1 where samples are the middles of pixels.
    pub per_pixel: u32,
    /// Columns and rows of samples beyond each side of the picture.
    pub margin: u32,
}

/// A ray in world space, rounded to f64: `origin + t direction`, `t` the distance along the view
/// direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where `t` is 0.
    pub origin: DVec3,
    /// Unit vector (orthographic), or the vector whose depth is 1 (perspective).
    pub direction: DVec3,
}

/// Samples a side of a pixel, at most.
pub const MAX_PER_PIXEL: u32 = 16;
/// Samples beyond a side of a picture, at most.
pub const MAX_MARGIN: u32 = 1 << 14;
// Twice a column fits an `i32`, for `View::odd_x`.
const _: () = assert!(2 * (MAX_SIDE * MAX_PER_PIXEL + 2 * MAX_MARGIN) <= i32::MAX as u32);

impl View {
    /// Joins a camera and an image size, of any numbers: what draws asks [`View::check`] first.
    pub fn new(camera: Camera, image: ImageSize) -> Self {
        Self::sampled(camera, image, 1, 0)
    }

    /// The raster with so many samples a side of each pixel of an image, and more samples around
    /// it: the picture of the same view at a multiple of the size.
    pub fn sampled(camera: Camera, image: ImageSize, per_pixel: u32, margin: u32) -> Self {
        let [across, down] = [image.width, image.height].map(|side| side.saturating_mul(per_pixel));
        let (pitch_x, pitch_y) = match camera.size {
            ScreenSize::Width(length) => {
                (Pitch { length, divisor: across }, Pitch { length, divisor: across })
            }
            ScreenSize::Height(length) => {
                (Pitch { length, divisor: down }, Pitch { length, divisor: down })
            }
            ScreenSize::Both { width, height } => {
                (Pitch { length: width, divisor: across }, Pitch { length: height, divisor: down })
            }
        };
        let [width, height] = [across, down].map(|side| side.saturating_add(2 * margin));
        Self { camera, image: ImageSize { width, height }, pitch_x, pitch_y, per_pixel, margin }
    }

    /// The image that the samples are of.
    pub fn pixels(&self) -> ImageSize {
        let per_pixel = self.per_pixel.max(1);
        let side = |side: u32| side.saturating_sub(2 * self.margin) / per_pixel;
        ImageSize { width: side(self.image.width), height: side(self.image.height) }
    }

    /// Whether a region of this view has a picture. Every device, and every plane, asks this before
    /// any work.
    ///
    /// # Errors
    /// The first rule that is broken: of the camera, the image size, the view, the region.
    pub fn check(&self, region: Region) -> Result<(), ViewError> {
        self.camera.check()?;
        let pixels = self.pixels();
        let in_limits = [pixels.width, pixels.height].iter().all(|s| (1..=MAX_SIDE).contains(s));
        if !in_limits {
            return Err(ViewError::Image(pixels));
        }
        let usual = self.per_pixel <= MAX_PER_PIXEL && self.margin <= MAX_MARGIN;
        if !usual || *self != Self::sampled(self.camera, pixels, self.per_pixel, self.margin) {
            return Err(ViewError::Stale);
        }
        if region.width == 0 || region.height == 0 {
            return Err(ViewError::Empty(region));
        }
        let ImageSize { width, height } = self.image;
        let inside = |first: u32, count: u32, side: u32| {
            first.checked_add(count).is_some_and(|end| end <= side)
        };
        if !(inside(region.x, region.width, width) && inside(region.y, region.height, height)) {
            return Err(ViewError::Outside { region, image: self.image });
        }
        if region.width.max(region.height) > MAX_SIDE {
            return Err(ViewError::Large(region));
        }
        Ok(())
    }

    /// `2 i + 1 - width`: the sample of column `i` lies at exactly `odd_x(i) * pitch_x / 2` on the
    /// screen.
    pub fn odd_x(&self, column: u32) -> i32 {
        2 * column as i32 + 1 - self.image.width as i32
    }

    /// `height - 1 - 2 j`: the sample of row `j` lies at exactly `odd_y(j) * pitch_y / 2` on the
    /// screen.
    pub fn odd_y(&self, row: u32) -> i32 {
        self.image.height as i32 - 1 - 2 * row as i32
    }

    /// The ray of pixel (`column`, `row`) in world space, each number within a few units in the
    /// last place.
    pub fn ray(&self, column: u32, row: u32) -> Ray {
        let axes = crate::axes::Axes::new(self.camera.view, self.camera.up);
        let [right, up, forward] =
            [axes.right, axes.up, axes.forward].map(crate::axes::Axis::nearest);
        let x = 0.5 * f64::from(self.odd_x(column)) * self.pitch_x.to_f64();
        let y = 0.5 * f64::from(self.odd_y(row)) * self.pitch_y.to_f64();
        let on_screen = x * right + y * up;
        match self.camera.projection {
            Projection::Orthographic => {
                Ray { origin: self.camera.origin + on_screen, direction: forward }
            }
            Projection::Perspective => {
                Ray { origin: self.camera.origin, direction: forward + on_screen }
            }
        }
    }
}
