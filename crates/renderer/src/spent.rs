//! What was done on the way of a picture into files.

use planisphere_core::drawing::{Counts, Times};

/// What was done on the way.
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub struct Report {
    /// What drawing has met.
    pub counts: Counts,
    /// Milliseconds of drawing.
    pub times: Times,
    /// Milliseconds of samples to pixels.
    pub shade: f64,
    /// Milliseconds of distances.
    pub depth: f64,
    /// Milliseconds of planes to bytes.
    pub encode: f64,
    /// Whether any sphere is seen.
    pub seen: bool,
    /// What drew the picture, where that was not the renderer's own device, and why.
    pub drawn_by: Option<String>,
}
