//! What to draw.

use planisphere_core::{
    camera::{Region, View},
    unseen,
};

#[cfg(feature = "overlay")]
use crate::overlay::Overlay;
use crate::{Camera, Error, Look, Scene};

/// One picture to draw: owned, and cheap to clone. Made once; then only the camera changes.
#[derive(Clone, Debug)]
pub struct Request {
    pub(crate) scene: Scene,
    pub(crate) camera: Camera,
    pub(crate) size: [u32; 2],
    pub(crate) region: Region,
    pub(crate) look: Look,
    pub(crate) color: bool,
    pub(crate) ids: bool,
    pub(crate) depth: bool,
    #[cfg(feature = "overlay")]
    pub(crate) overlay: Option<Overlay>,
    /// What the overlay is drawn over, where that is more than what is drawn.
    #[cfg(feature = "overlay")]
    pub(crate) whole: Option<Region>,
}

impl Request {
    /// Colours and ids of a whole picture, of some columns and rows.
    ///
    /// # Errors
    /// When there is no picture of that size: sides are 1 to 32,768 pixels.
    pub fn new(scene: &Scene, camera: Camera, size: [u32; 2]) -> Result<Self, Error> {
        let view = camera.view(size);
        let region = Region::whole(view.image);
        view.check(region)?;
        let (scene, look) = (scene.clone(), Look::default());
        Ok(Self {
            scene,
            camera,
            size,
            region,
            look,
            color: true,
            ids: true,
            depth: false,
            #[cfg(feature = "overlay")]
            overlay: None,
            #[cfg(feature = "overlay")]
            whole: None,
        })
    }

    /// The same from elsewhere.
    #[must_use]
    pub fn camera(self, camera: Camera) -> Self {
        Self { camera, ..self }
    }

    /// A part of the picture only: its pixels are those of the whole.
    ///
    /// # Errors
    /// When it has no pixels, or reaches outside of the picture.
    pub fn region(self, region: Region) -> Result<Self, Error> {
        let view = self.view();
        view.check(region).map_err(|_| Error::Region { region, size: self.size })?;
        Ok(Self { region, ..self })
    }

    /// How it looks.
    #[must_use]
    pub fn look(self, look: Look) -> Self {
        Self { look, ..self }
    }

    /// Depths too: they are not made unasked, and take longer than ids.
    #[must_use]
    pub fn with_depth(self) -> Self {
        Self { depth: true, ..self }
    }

    /// Without colours: ids, and depths if they are asked for.
    #[must_use]
    pub fn without_color(self) -> Self {
        Self { color: false, ..self }
    }

    /// Without ids, where colours are made without them: those of several samples a pixel are. It
    /// saves the time of a picture of one sample; [`crate::Picture::hit`] finds nothing then.
    #[must_use]
    pub fn without_ids(self) -> Self {
        Self { ids: false, ..self }
    }

    /// The scene.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Columns and rows of the whole picture.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// What it looks like.
    pub fn drawn_look(&self) -> &Look {
        &self.look
    }

    /// The part of it that is drawn.
    pub fn drawn_region(&self) -> Region {
        self.region
    }

    /// Why a picture of it shows no sphere, if it shows none, in one line. It looks at all spheres.
    pub fn why_empty(&self) -> String {
        unseen::why(self.scene.core(), &self.view(), self.region)
    }

    /// What shows a sphere for certain, in words of a scene file. `camera`: whether that has one.
    #[doc(hidden)]
    pub fn advice(&self, camera: bool) -> Option<String> {
        unseen::advice(self.scene.core(), &self.view(), self.region, camera)
    }

    /// Some rows of what is drawn.
    pub(crate) fn band(&self, band: Region) -> Self {
        Self {
            region: band,
            #[cfg(feature = "overlay")]
            whole: Some(self.whole.unwrap_or(self.region)),
            ..self.clone()
        }
    }

    /// Whether colours follow from the ids of pixels alone.
    pub(crate) fn is_plain(&self) -> bool {
        #[cfg(feature = "overlay")]
        if self.overlay.is_some() {
            return false;
        }
        self.look.is_plain()
    }

    pub(crate) fn view(&self) -> View {
        self.camera.view(self.size)
    }
}
