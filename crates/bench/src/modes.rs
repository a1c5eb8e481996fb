//! What the native device does without: its kernels with less of their bounds, for
//! [`crate::accuracy`]. They are compiled here and nowhere else.

use planisphere_core::{
    camera::{Region, View},
    cpu::Cpu,
    drawing::{DrawError, Drawing},
    ids::UNDECIDED,
    scene::Scene,
    tile::Mode,
};
use rayon::prelude::*;

/// Bounds without decisions.
#[derive(Clone, Copy)]
struct FilterOnly;

impl Mode for FilterOnly {
    const BOUNDS: bool = true;
    const DECIDES: bool = false;
}

/// Neither: wrong where rounding matters.
#[derive(Clone, Copy)]
struct Uncertified;

impl Mode for Uncertified {
    const BOUNDS: bool = false;
    const DECIDES: bool = false;
}

/// As [`Cpu::draw`], but pixels that the bounds leave open are [`UNDECIDED`], and counted.
///
/// # Errors
/// As [`Cpu::draw`].
pub fn draw_filter_only(
    cpu: &mut Cpu,
    scene: &Scene,
    view: &View,
    region: Region,
) -> Result<Drawing, DrawError> {
    let mut drawing = cpu.draw_as::<FilterOnly>(scene, view, region)?;
    drawing.counts.undecided = drawing.ids.par_iter().filter(|&&id| id == UNDECIDED).count();
    Ok(drawing)
}

/// As [`Cpu::draw`] without bounds and decisions. Ids are wrong where rounding matters.
///
/// # Errors
/// As [`Cpu::draw`].
pub fn draw_uncertified(
    cpu: &mut Cpu,
    scene: &Scene,
    view: &View,
    region: Region,
) -> Result<Drawing, DrawError> {
    cpu.draw_as::<Uncertified>(scene, view, region)
}
