//! Options of the camera: in place of what a scene file says, or of what is chosen.

use std::path::{Path, PathBuf};

use clap::Args as ClapArgs;

use super::{
    Failure,
    reading::{parse_color, parse_positive},
};
use planisphere_io::load::{self, Loaded, Wanted};

/// The camera, as typed.
#[derive(ClapArgs, Clone, Debug, Default)]
#[command(next_help_heading = "Camera")]
pub(super) struct CameraArgs {
    /// Look along an axis (x, -x, y, -y, z, -z), from a corner (iso), or along VX,VY,VZ
    ///
    /// The camera stands so that the whole scene is seen: an origin, a view and a size of the scene
    /// file are left aside. `-z` looks down onto the xy plane. Without this, and without a camera
    /// in the scene file, it looks from above the (1, 1) corner: along -1,-1,-0.75.
    #[arg(
        long,
        value_name = "DIRECTION",
        value_parser = parse_view,
        allow_hyphen_values = true
    )]
    view: Option<[f64; 3]>,

    /// Which way is up: an axis or X,Y,Z; the default is z, or y for a view along z
    #[arg(long, value_name = "DIRECTION", value_parser = parse_up, allow_hyphen_values = true)]
    up: Option<[f64; 3]>,

    /// How many times larger things are than the scene file, or the whole scene in view, has them
    #[arg(
        long,
        value_name = "FACTOR",
        value_parser = parse_positive,
        allow_negative_numbers = true
    )]
    zoom: Option<f64>,

    /// Parallel rays: things have one size at all distances
    #[arg(long, conflicts_with = "perspective")]
    orthographic: bool,

    /// Rays from one point, with a field of view of 40 degrees where none is given
    #[arg(long)]
    perspective: bool,

    /// Nearest distance from the camera, along the view, that is seen
    #[arg(
        long,
        value_name = "DISTANCE",
        value_parser = parse_distance,
        allow_negative_numbers = true
    )]
    near: Option<f64>,

    /// Farthest distance from the camera that is seen
    #[arg(
        long,
        value_name = "DISTANCE",
        value_parser = parse_distance,
        allow_negative_numbers = true
    )]
    far: Option<f64>,

    /// Colour where there is no sphere: #rrggbb, #rgb or a name of CSS; or transparent
    #[arg(long, value_name = "COLOR", value_parser = parse_background)]
    background: Option<Background>,

    /// Scene file whose [camera] is taken, or PNG that was drawn by this program: its camera
    #[arg(
        long,
        alias = "camera-from",
        value_name = "FILE",
        value_hint = clap::ValueHint::FilePath
    )]
    camera: Option<PathBuf>,
}

/// What is where there is no sphere, as typed.
#[derive(Clone, Copy, Debug)]
enum Background {
    Color([u8; 3]),
    Transparent,
}

fn parse_background(text: &str) -> Result<Background, String> {
    match text {
        "transparent" => Ok(Background::Transparent),
        _ => parse_color(text).map(Background::Color),
    }
}

impl CameraArgs {
    /// The file that is read.
    pub fn file(&self) -> Option<&Path> {
        self.camera.as_deref()
    }

    /// Puts what was typed in place of what was loaded.
    pub fn apply(&self, loaded: &mut Loaded) -> Result<(), Failure> {
        loaded.look = match self.background {
            None => loaded.look.clone(),
            Some(Background::Color(color)) => loaded.look.clone().background(color),
            Some(Background::Transparent) => loaded.look.clone().transparent(),
        };
        if let Some(path) = &self.camera {
            loaded.set_camera(Some(load::camera(path)?));
        }
        let mut wanted = loaded.wanted.unwrap_or_default();
        let before = wanted;
        if let Some(view) = self.view {
            // Which way is up stays, unless it is along the view.
            let projection = wanted.projection;
            wanted = Wanted { up: wanted.up, projection, ..Wanted::default() };
            wanted.view = Some(view.into());
            if wanted.up.is_none_or(|up| along(up.to_array(), view)) {
                let z = [0.0, 0.0, 1.0];
                wanted.up = Some(if along(z, view) { [0.0, 1.0, 0.0] } else { z }.into());
            }
        }
        if let Some(up) = self.up {
            wanted.up = Some(up.into());
        }
        let projection = match (self.orthographic, self.perspective) {
            (true, _) => Some(false),
            (_, true) => Some(true),
            _ => None,
        };
        if let Some(perspective) = projection {
            wanted.set_perspective(perspective);
        }
        if let Some(zoom) = self.zoom {
            wanted.zoom = zoom;
        }
        wanted.near = self.near.unwrap_or(wanted.near);
        wanted.far = self.far.unwrap_or(wanted.far);
        if wanted != before {
            loaded.set_camera(Some(wanted));
        }
        Ok(())
    }
}

/// Whether two directions are one, or opposite.
fn along(a: [f64; 3], b: [f64; 3]) -> bool {
    let cross = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    cross.iter().all(|part| *part == 0.0)
}

/// A direction: an axis, or three numbers.
fn direction(typed: &str) -> Option<[f64; 3]> {
    let (sign, axis) = match typed.strip_prefix('-') {
        Some(axis) => (-1.0, axis),
        None => (1.0, typed.strip_prefix('+').unwrap_or(typed)),
    };
    let mut found = [0.0; 3];
    if let Some(axis) = ["x", "y", "z"].iter().position(|name| name.eq_ignore_ascii_case(axis)) {
        found[axis] = sign;
        return Some(found);
    }
    let mut parts = typed.split(',');
    for number in &mut found {
        *number = parts.next()?.trim().parse().ok().filter(|n: &f64| n.is_finite())?;
    }
    (parts.next().is_none() && found != [0.0; 3]).then_some(found)
}

fn parse_view(typed: &str) -> Result<[f64; 3], String> {
    if typed.eq_ignore_ascii_case("iso") {
        return Ok([-1.0; 3]);
    }
    direction(typed).ok_or_else(|| {
        "write x, -x, y, -y, z, -z, iso, or three numbers that are not all 0: 1,0,-0.5".into()
    })
}

fn parse_up(typed: &str) -> Result<[f64; 3], String> {
    direction(typed).ok_or_else(|| {
        "write x, -x, y, -y, z, -z, or three numbers that are not all 0: 0,0,1".into()
    })
}

fn parse_distance(typed: &str) -> Result<f64, String> {
    let value = typed.parse().ok().filter(|value: &f64| *value >= 0.0);
    value.ok_or_else(|| "write a distance of 0 or more".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_are_axes_or_numbers() {
        assert_eq!(parse_view("-X"), Ok([-1.0, 0.0, 0.0]));
        assert_eq!(parse_view("1,-2,0.5"), Ok([1.0, -2.0, 0.5]));
        assert_eq!(parse_view("iso"), Ok([-1.0; 3]));
        for bad in ["", "w", "1,2", "1,2,3,4", "0,0,0", "nan,0,0", "--x"] {
            assert!(parse_view(bad).is_err(), "{bad}");
        }
        assert!(parse_up("iso").is_err());
        assert!(
            along([0.0, 0.0, 2.0], [0.0, 0.0, -1.0])
                && !along([0.0, 1.0, 2.0], [0.0; 3].map(|_| 1.0))
        );
    }
}
