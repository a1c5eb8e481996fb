//! Screenshots: a new name for each, and the camera as text, so that `render` can draw the picture
//! again.

use std::{
    ffi::{OsStr, OsString},
    path::PathBuf,
};

use super::navigate;
use planisphere_core::{
    axes::split,
    camera::{Camera, ImageSize, Projection, Region, ScreenSize, View},
    fov::height_from_fov,
};
use planisphere_image::Paint;
use planisphere_io::{
    camera,
    output::{self, OutputError, Target},
    png,
};

/// Why a screenshot was not saved.
pub(super) enum Unsaved {
    /// An array changed meanwhile, so that its colours may be wrong; in words.
    Changed(String),
    /// The file could not be written.
    Output(OutputError),
}

impl From<OutputError> for Unsaved {
    fn from(error: OutputError) -> Self {
        Self::Output(error)
    }
}

/// Writes a picture into the current folder, under the first of `name-001.png`, `name-002.png`, ...
/// that is free. `changed` says, when all that is read has been, whether it was what it should be.
///
/// # Errors
/// When the file cannot be written, or something has changed.
pub(super) fn save(
    name: &OsStr,
    view: &View,
    ids: &[i32],
    paint: &Paint,
    changed: impl Fn() -> Option<String>,
) -> Result<PathBuf, Unsaved> {
    let names = (1u32..).map(|number| {
        let mut file = OsString::from(name);
        file.push(format!("-{number:03}.png"));
        PathBuf::from(file)
    });
    let mut free = names.filter(|path| path.symlink_metadata().is_err()).peekable();
    let first = free.peek().cloned().unwrap_or_default();
    let staged = Target::File(first)
        .stage(|out| png::write_png(out, Region::whole(view.image), ids, paint))?;
    if let Some(words) = changed() {
        return Err(Unsaved::Changed(words));
    }
    // Another program may take a name that was free a moment ago.
    Ok(output::commit_new(staged, free)?)
}

/// The `[camera]` table of a scene whose image has the size `scene`, that sees what `view` sees.
/// Every number is written so that it is read back unchanged; where both images have the same size,
/// the pictures are the same to the byte.
pub(super) fn table(view: &View, scene: ImageSize) -> String {
    let ImageSize { width, height } = view.image;
    let camera = navigate::resized(&view.camera, view.image, scene);
    let fov = fov(&camera, view.image, scene);
    format!("# as seen at {width} x {height} pixels\n{}", camera::table(&camera, fov))
}

/// The field of view that stands for exactly this screen, if there is one: in images of both sizes,
/// square pixels and the same height.
fn fov(camera: &Camera, window: ImageSize, scene: ImageSize) -> Option<f64> {
    if camera.projection != Projection::Perspective {
        return None;
    }
    // A screen that gives its width keeps that in another shape of image, one that gives its height
    // the other.
    let alike = u64::from(window.width) * u64::from(scene.height)
        == u64::from(scene.width) * u64::from(window.height);
    let height = match camera.size {
        ScreenSize::Height(height) => height,
        ScreenSize::Both { width, height } if alike && in_proportion([width, height], scene) => {
            height
        }
        ScreenSize::Width(width) if alike => {
            let height = width / f64::from(scene.width) * f64::from(scene.height);
            in_proportion([width, height], scene).then_some(height)?
        }
        ScreenSize::Both { .. } | ScreenSize::Width(_) => return None,
    };
    fov_of_height(height)
}

/// Whether `sides` are to each other exactly as those of an image.
fn in_proportion(sides: [f64; 2], image: ImageSize) -> bool {
    let [(a, i), (b, j)] = sides.map(split);
    // `a 2^i height = b 2^j width`, both without their powers of two.
    let odd = |mantissa: i64, exponent: i32, side: u32| {
        let product = i128::from(mantissa) * i128::from(side);
        let zeros = product.trailing_zeros();
        (product >> zeros, i64::from(exponent) + i64::from(zeros))
    };
    a > 0 && b > 0 && odd(a, i, image.height) == odd(b, j, image.width)
}

/// The shortest field of view whose screen has exactly this height.
fn fov_of_height(height: f64) -> Option<f64> {
    let guess = 2.0 * (0.5 * height).atan().to_degrees();
    let fits = |degrees: f64| height_from_fov(degrees) == Ok(height);
    let near = (1..=4)
        .flat_map(|step| [step, -step])
        .map(|step: i64| f64::from_bits(guess.to_bits().wrapping_add_signed(step)));
    let rounded = (0..17).filter_map(|digits| format!("{guess:.digits$}").parse().ok());
    // Fields below a degree have more digits than that behind the point; they are as many in front
    // of an exponent.
    let scientific = (0..17).filter_map(|digits| format!("{guess:.digits$e}").parse().ok());
    rounded.chain(scientific).chain([guess]).chain(near).find(|&degrees| fits(degrees))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use glam::DVec3;

    use super::*;

    fn read(text: &str) -> Camera {
        planisphere_io::load::from_text("test", text, Path::new("")).unwrap().fixed_camera.unwrap()
    }

    #[test]
    fn tables_are_read_back_unchanged() {
        let image = ImageSize { width: 640, height: 481 };
        let third = 1.0 / 3.0;
        let plain =
            Camera::orthographic(DVec3::new(1e-7, -1e300, 5e-324), DVec3::new(third, 0.1, -2.0));
        let sizes = [
            ScreenSize::Width(third),
            ScreenSize::Height(1e17),
            ScreenSize::Both { width: 0.1, height: 7.0 },
        ];
        for size in sizes {
            for projection in [Projection::Orthographic, Projection::Perspective] {
                for (near, far) in [(0.0, f64::INFINITY), (third, 1e9)] {
                    let camera = Camera {
                        projection,
                        size,
                        near,
                        far,
                        up: DVec3::new(third, 1e-9, 1.0),
                        ..plain
                    };
                    let text = table(&View::new(camera, image), image);
                    assert_eq!(read(&text), camera, "{text}");
                    assert!(
                        text.starts_with("# as seen at 640 x 481 pixels\n[camera]\n"),
                        "{text}"
                    );
                    assert!(!text.contains("[image]"), "{text}");
                }
            }
        }
    }

    /// The line of a table that begins with this key.
    fn line<'t>(text: &'t str, key: &str) -> Option<&'t str> {
        text.lines().find(|line| line.starts_with(key))
    }

    #[test]
    fn fields_of_view_stand_for_exactly_their_height() {
        let image = ImageSize { width: 640, height: 480 };
        let perspective = |size| Camera {
            projection: Projection::Perspective,
            size,
            ..Camera::orthographic(DVec3::ZERO, DVec3::X)
        };
        for fov in [40.0, 0.1, 1e-9, 33.3, 90.0, 179.0, 60.00000000000001] {
            let height = height_from_fov(fov).unwrap();
            let text = table(&View::new(perspective(ScreenSize::Height(height)), image), image);
            assert_eq!(line(&text, "fov"), Some(&*format!("fov = {fov:?}")), "{text}");
            assert_eq!(read(&text).size, ScreenSize::Height(height), "{text}");
        }
        // Both sides with square pixels, and a width, where the height that goes with it is a
        // number.
        let (width, height) = (2.0 * 640.0 / 480.0, 2.0);
        assert!(!in_proportion([width, height], image), "a third");
        let square = ImageSize { width: 64, height: 64 };
        let forty = height_from_fov(40.0).unwrap();
        for size in [ScreenSize::Both { width: forty, height: forty }, ScreenSize::Width(forty)] {
            let text = table(&View::new(perspective(size), square), square);
            assert_eq!(line(&text, "fov"), Some("fov = 40.0"), "{text}");
            // In an image of another shape it stays what it is.
            let text = table(&View::new(perspective(size), square), image);
            assert!(
                line(&text, "fov").is_none() || matches!(size, ScreenSize::Both { .. }),
                "{text}"
            );
        }
        let oblong = ScreenSize::Both { width: 4.0, height: 2.0 };
        assert_eq!(line(&table(&View::new(perspective(oblong), image), image), "fov"), None);
        // Some heights have no field of view that is a number; none is made up.
        let mut without = 0;
        for step in 0..200u64 {
            let height = f64::from_bits(1.9f64.to_bits() + 977 * step * step);
            match fov_of_height(height) {
                Some(fov) => assert_eq!(height_from_fov(fov), Ok(height)),
                None => without += 1,
            }
        }
        assert!((1..200).contains(&without), "{without}");
    }

    #[test]
    fn another_shape_of_window_keeps_the_shape_of_pixels() {
        let (window, scene) =
            (ImageSize { width: 600, height: 200 }, ImageSize { width: 300, height: 200 });
        let both = Camera {
            size: ScreenSize::Both { width: 8.0, height: 1.0 },
            ..Camera::orthographic(DVec3::ZERO, DVec3::X)
        };
        let text = table(&View::new(both, window), scene);
        assert_eq!(read(&text).size, ScreenSize::Both { width: 4.0, height: 1.0 }, "{text}");
    }
}
