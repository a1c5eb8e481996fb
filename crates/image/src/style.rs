//! What samples look like, in numbers: those of docs/contract.md, "Looks".

use planisphere_core::camera::{ImageSize, MAX_MARGIN, MAX_PER_PIXEL, View};

/// How the colours of spheres are shaded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Shade {
    /// As they are.
    #[default]
    Flat,
    /// By a light at the eye.
    Matte {
        /// The part of the light that comes from everywhere, of 255.
        ambient: u8,
    },
}

/// The space in which samples are averaged.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Space {
    /// Linear light, as light adds up.
    #[default]
    Linear,
    /// sRGB bytes, as many programs do it.
    Encoded,
}

/// Which neighbours a line is drawn between.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Between {
    /// Those that are far apart.
    #[default]
    Jumps,
    /// These, and spheres of different groups.
    Groups,
    /// All spheres.
    Spheres,
}

/// Lines where what is seen changes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outline {
    /// Width in pixels, above 0 and at most [`Outline::MAX_WIDTH`].
    pub width: f64,
    /// sRGB.
    pub color: [u8; 3],
    /// Where.
    pub between: Between,
    /// How far apart two distances must be, in world units; the nearer sphere's radius without.
    pub jump: Option<f64>,
}

impl Outline {
    /// The widest line, in pixels.
    pub const MAX_WIDTH: f64 = 1000.0;
    // With two samples more, see `Style::margin`.
    const _FITS: () = assert!(Self::MAX_WIDTH as u32 / 2 * MAX_PER_PIXEL + 2 <= MAX_MARGIN);
}

/// A look in numbers, for a view of a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Style {
    /// Colour where there is no sphere, sRGB.
    pub background: [u8; 3],
    /// Whether the background is seen through.
    pub transparent: bool,
    /// Samples a side of a pixel: 1, 2, 4, 8 or 16.
    pub aa: u32,
    /// Where they are averaged.
    pub space: Space,
    /// How spheres are shaded.
    pub shade: Shade,
    /// How much spheres are darkened that are not open to the space around, of 255.
    pub occlusion: Option<u8>,
    /// Two depths between which colours go over into the background's.
    pub cue: Option<[f64; 2]>,
    /// Lines.
    pub outline: Option<Outline>,
}

impl Style {
    /// Samples that are needed beyond each side of what is drawn.
    pub fn margin(&self) -> u32 {
        match &self.outline {
            Some(outline) => (0.5 * outline.width * f64::from(self.aa)).ceil() as u32 + 1,
            None => 0,
        }
    }

    /// The raster of samples of a view of pixels.
    pub fn samples(&self, view: &View) -> View {
        let ImageSize { width, height } = view.image;
        View::sampled(view.camera, ImageSize { width, height }, self.aa, self.margin())
    }
}
