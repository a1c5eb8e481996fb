//! A camera as the text of a scene file's `[camera]`, which gives it back bit for bit.

use std::fmt::Write;

use planisphere_core::camera::{Camera, Projection, ScreenSize};

/// The key under which a picture holds the camera that it was drawn with.
pub const KEY: &str = "planisphere:camera";

/// The `[camera]` table of a camera. Where `fov` is given it stands for the size of the screen.
#[must_use]
pub fn table(camera: &Camera, fov: Option<f64>) -> String {
    let projection = match camera.projection {
        Projection::Orthographic => "orthographic",
        Projection::Perspective => "perspective",
    };
    let mut text = format!("[camera]\nprojection = \"{projection}\"\n");
    // Writing into a string does not fail. The debug form of an f64 is the shortest one that is
    // read back as the same.
    for (key, vector) in [("origin", camera.origin), ("view", camera.view), ("up", camera.up)] {
        let _ = writeln!(text, "{key} = [{:?}, {:?}, {:?}]", vector.x, vector.y, vector.z);
    }
    let (width, height) = match (fov, camera.size) {
        (Some(_), _) => (None, None),
        (None, ScreenSize::Width(width)) => (Some(width), None),
        (None, ScreenSize::Height(height)) => (None, Some(height)),
        (None, ScreenSize::Both { width, height }) => (Some(width), Some(height)),
    };
    let far = camera.far.is_finite().then_some(camera.far);
    let near = Some(camera.near);
    for (key, value) in
        [("fov", fov), ("width", width), ("height", height), ("near", near), ("far", far)]
    {
        if let Some(value) = value {
            let _ = writeln!(text, "{key} = {value:?}");
        }
    }
    text
}
