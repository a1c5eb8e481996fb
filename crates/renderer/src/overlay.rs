//! What is drawn over a picture: wishes, which the camera and the size of a request make lengths
//! and places.

use planisphere_core::{axes, camera::Projection};
use planisphere_image::overlay::{self, Laid, OverlayError};
pub use planisphere_image::{maps::Map, overlay::Legend};

use crate::{Error, Region, Request};

/// What is drawn over a picture: nothing without.
///
/// ```
/// # use planisphere_renderer as planisphere;
/// let overlay = planisphere::Overlay::new().title("t = 12.5 ps").scale_bar().unit("nm");
/// ```
///
/// It lies in the corners of the region that is drawn, and changes pixels there alone. All lengths
/// grow with the picture, but text has at least 12 pixels: what has no room is an error.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Overlay {
    title: Option<String>,
    legend: Option<Legend>,
    bar: Option<Bar>,
    axes: bool,
    unit: Option<String>,
}

/// The length of a scale bar.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Bar {
    /// One that suits the picture.
    Chosen,
    /// This one, in world units.
    Of(f64),
}

impl Overlay {
    /// Nothing.
    pub fn new() -> Self {
        Self::default()
    }

    /// A line at the top.
    #[must_use]
    pub fn title(self, words: impl Into<String>) -> Self {
        Self { title: Some(words.into()), ..self }
    }

    /// What the colours mean, at the right.
    #[must_use]
    pub fn legend(self, legend: Legend) -> Self {
        Self { legend: Some(legend), ..self }
    }

    /// A bar of a round length in the lower left corner. Its length is true for parallel rays
    /// alone: in perspective it is an error.
    #[must_use]
    pub fn scale_bar(self) -> Self {
        Self { bar: Some(Bar::Chosen), ..self }
    }

    /// The same, of a length in world units.
    #[must_use]
    pub fn scale_bar_of(self, length: f64) -> Self {
        Self { bar: Some(Bar::Of(length)), ..self }
    }

    /// The axes of the world, above the scale bar.
    #[must_use]
    pub fn axes(self) -> Self {
        Self { axes: true, ..self }
    }

    /// The unit behind the scale bar's number.
    #[must_use]
    pub fn unit(self, unit: impl Into<String>) -> Self {
        Self { unit: Some(unit.into()), ..self }
    }

    /// Whether it draws nothing.
    fn is_empty(&self) -> bool {
        let Self { title, legend, bar, axes, unit: _ } = self;
        title.is_none() && legend.is_none() && bar.is_none() && !axes
    }

    /// In the numbers of a request.
    fn of(&self, request: &Request) -> Result<overlay::Overlay, Error> {
        let view = request.view();
        let scale_bar = match self.bar {
            None => None,
            Some(_) if view.camera.projection == Projection::Perspective => {
                let words = "a scale bar is true for parallel rays alone, and in perspective what \
                             is farther is smaller; leave it out, or take an orthographic camera";
                return Err(Error::Overlay { words: words.into() });
            }
            Some(bar) => Some(overlay::ScaleBar {
                length: match bar {
                    Bar::Chosen => None,
                    Bar::Of(length) => Some(length),
                },
                pixels_per_unit: f64::from(view.pitch_x.divisor) / view.pitch_x.length,
                unit: self.unit.clone(),
            }),
        };
        let axes = self.axes.then(|| {
            let axes = axes::Axes::new(view.camera.view, view.camera.up);
            overlay::Axes {
                right: axes.right.nearest().to_array(),
                up: axes.up.nearest().to_array(),
                back: (-axes.forward.nearest()).to_array(),
            }
        });
        let (title, legend) = (self.title.clone(), self.legend.clone());
        Ok(overlay::Overlay { title, legend, scale_bar, axes, background: request.look.behind() })
    }
}

/// The overlay of a request, for the rows of the region that it is drawn over.
#[derive(Debug)]
pub(crate) struct Over {
    laid: Laid,
    region: Region,
}

impl Over {
    /// Of a request; none where nothing is asked for.
    ///
    /// # Errors
    /// When it has no meaning, or no room.
    pub fn of(request: &Request) -> Result<Option<Self>, Error> {
        let Some(overlay) = &request.overlay else { return Ok(None) };
        let region = request.whole.unwrap_or(request.region);
        let laid = overlay.of(request)?.lay([region.width, region.height])?;
        Ok(Some(Self { laid, region }))
    }

    /// Draws over the pixels of some whole rows.
    pub fn onto(&self, rows: Region, pixels: &mut [[u8; 4]]) -> Result<(), Error> {
        Ok(self.laid.onto(rows.y - self.region.y, pixels)?)
    }
}

impl Request {
    /// Something over the picture. Ids, depths and parts are what they are without.
    #[must_use]
    pub fn overlay(self, overlay: Overlay) -> Self {
        let overlay = Some(overlay).filter(|overlay| !overlay.is_empty());
        Self { overlay, ..self }
    }

    /// What its overlay may change, as that of [`Request::drawn_region`]: column and row of the
    /// first pixel, columns and rows. No two have a pixel in common.
    ///
    /// # Errors
    /// When the overlay has no meaning, or no room.
    pub fn overlaid(&self) -> Result<Vec<[u32; 4]>, Error> {
        Ok(Over::of(self)?.map_or(Vec::new(), |over| over.laid.regions()))
    }
}

impl From<OverlayError> for Error {
    fn from(error: OverlayError) -> Self {
        Self::Overlay { words: error.to_string() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Camera, Look, Renderer, Scene, Sphere, Spheres};

    /// Rows that are drawn by themselves have what lies over them in the whole.
    #[test]
    fn bands_are_parts_of_the_whole() {
        let sphere = Sphere { center: [0.0; 3], radius: 2.0, color: [255, 0, 0] };
        let scene = Scene::new(Spheres::from_iter([sphere])).unwrap();
        let size = [240, 180];
        let camera = Camera::isometric().fit(&scene, size);
        for look in [Look::flat(), Look::matte()] {
            let request = Request::new(&scene, camera, size).unwrap().look(look);
            let request = request.region(Region { x: 4, y: 6, width: 230, height: 170 }).unwrap();
            let request = request.overlay(Overlay::new().title("Bands").scale_bar().axes());
            let renderer = Renderer::cpu();
            let whole = renderer.draw(&request).unwrap();
            let mut rows = Vec::new();
            for (y, height) in [(6, 1), (7, 40), (47, 129)] {
                let band = request.band(Region { x: 4, y, width: 230, height });
                rows.extend_from_slice(renderer.draw(&band.band(band.region)).unwrap().rgba());
            }
            assert!(rows == whole.rgba());
        }
    }
}
