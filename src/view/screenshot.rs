//! Screenshots: a new name for each, and the camera as text, so that `render` can draw the picture again.

use std::{
    ffi::{OsStr, OsString},
    fmt::Write,
    path::PathBuf,
};

use crate::{
    camera::{Camera, ImageSize, Projection, Region, ScreenSize, View},
    frame::{self, Paint},
    load::{ChangedFile, Watch},
    output::{self, OutputError, Target},
};

/// Why there is no screenshot.
#[derive(Debug, thiserror::Error)]
pub(super) enum NoScreenshot {
    /// It cannot be written.
    #[error("{0}")]
    Output(#[from] OutputError),
    /// The colours of the scene are others now.
    #[error("{0}")]
    Changed(#[from] ChangedFile),
}

/// Writes a picture into the current folder, under the first of `name-001.png`, `name-002.png`, ... that is free.
///
/// # Errors
/// When the file cannot be written, or a file of the scene has changed.
pub(super) fn save(
    name: &OsStr,
    view: &View,
    ids: &[i32],
    paint: &Paint,
    watch: &Watch,
) -> Result<PathBuf, NoScreenshot> {
    let names = (1u32..).map(|number| {
        let mut file = OsString::from(name);
        file.push(format!("-{number:03}.png"));
        PathBuf::from(file)
    });
    let mut free = names.filter(|path| path.symlink_metadata().is_err()).peekable();
    let first = free.peek().cloned().unwrap_or_default();
    let write = || Target::File(first).stage(|out| frame::write_png(out, Region::whole(view.image), ids, paint));
    let staged = watch.guard(write)??;
    // Another program may take a name that was free a moment ago.
    Ok(output::commit_new(staged, free)?)
}

/// The `[camera]` and `[image]` tables of a scene file: every number is written so that it is read back unchanged.
pub(super) fn tables(camera: &Camera, image: ImageSize, background: [u8; 3]) -> String {
    let mut text = String::from("[camera]\n");
    let projection = match camera.projection {
        Projection::Orthographic => "orthographic",
        Projection::Perspective => "perspective",
    };
    // Writing into a string does not fail. The debug form of an f64 is the shortest one that is read back as the same.
    let _ = writeln!(text, "projection = \"{projection}\"");
    for (key, vector) in [("origin", camera.origin), ("view", camera.view), ("up", camera.up)] {
        let _ = writeln!(text, "{key} = [{:?}, {:?}, {:?}]", vector.x, vector.y, vector.z);
    }
    let (width, height) = match camera.size {
        ScreenSize::Width(width) => (Some(width), None),
        ScreenSize::Height(height) => (None, Some(height)),
        ScreenSize::Both { width, height } => (Some(width), Some(height)),
    };
    let far = camera.far.is_finite().then_some(camera.far);
    for (key, value) in [("width", width), ("height", height), ("near", Some(camera.near)), ("far", far)] {
        if let Some(value) = value {
            let _ = writeln!(text, "{key} = {value:?}");
        }
    }
    let [red, green, blue] = background;
    let ImageSize { width, height } = image;
    let _ = write!(
        text,
        "\n[image]\nwidth = {width}\nheight = {height}\nbackground = \"#{red:02x}{green:02x}{blue:02x}\"\n"
    );
    text
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use glam::DVec3;

    use super::*;

    #[test]
    fn the_tables_are_read_back_unchanged() {
        let image = ImageSize { width: 640, height: 481 };
        let third = 1.0 / 3.0;
        let plain = Camera::orthographic(DVec3::new(1e-7, -1e300, 5e-324), DVec3::new(third, 0.1, -2.0));
        let sizes = [ScreenSize::Width(third), ScreenSize::Height(1e17), ScreenSize::Both { width: 0.1, height: 7.0 }];
        for size in sizes {
            for projection in [Projection::Orthographic, Projection::Perspective] {
                for (near, far) in [(0.0, f64::INFINITY), (third, 1e9)] {
                    let camera = Camera { projection, size, near, far, up: DVec3::new(third, 1e-9, 1.0), ..plain };
                    let text = tables(&camera, image, [1, 35, 255]);
                    let loaded = crate::load::from_text("test", &text, Path::new("")).unwrap();
                    assert_eq!(loaded.fixed_camera, Some(camera), "{text}");
                    assert_eq!((loaded.image, loaded.background), (image, [1, 35, 255]));
                }
            }
        }
    }
}
