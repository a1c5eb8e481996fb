//! The scale bar, in the lower left corner: a line of a known length, and the length above it.

use super::{
    OverlayError,
    block::{At, Block, Style, text},
    layout::Problem,
    numbers,
};

const PART: &str = "scale bar";

/// A length in the picture. It has a meaning for parallel rays alone.
#[derive(Clone, Debug, PartialEq)]
pub struct ScaleBar {
    /// The length, in units of the world; by default a nice one of about a fifth of the width.
    pub length: Option<f64>,
    /// Columns that a unit of the world is wide.
    pub pixels_per_unit: f64,
    /// The name of the unit, behind the number.
    pub unit: Option<String>,
}

/// The least length that can be seen, in pixels.
const LEAST: f64 = 2.0;

impl ScaleBar {
    /// Its length in the world, and in pixels.
    ///
    /// # Errors
    /// Numbers that are no lengths; a length that is longer than the picture, or too short.
    pub fn length(&self, style: &Style) -> Result<[f64; 2], OverlayError> {
        let scale = self.pixels_per_unit;
        if !(scale.is_finite() && scale > 0.0) {
            return Err(OverlayError::Scale(scale));
        }
        let length =
            self.length.unwrap_or_else(|| numbers::nearest_nice(style.size[0] / 5.0 / scale));
        if !(length.is_finite() && length > 0.0) {
            return Err(OverlayError::Length(length));
        }
        let (pixels, room) = (length * scale, style.size[0] - 2.0 * style.margin);
        if !(LEAST <= pixels && pixels <= room) {
            let [least, most] = [LEAST / scale, room / scale];
            return Err(OverlayError::LengthInPixels { length, pixels, least, most });
        }
        Ok([length, pixels])
    }

    /// Its block, and the row above it that is free.
    pub fn block(&self, style: &Style) -> Result<(Block, f64), Problem> {
        let [length, pixels] = self.length(style)?;
        let number = numbers::short(length);
        let words = self.unit.as_ref().map_or(number.clone(), |unit| format!("{number} {unit}"));
        let line = text(PART, &words, style.text)?;
        let left = style.margin;
        let bottom = style.size[1] - style.margin;
        let top = bottom - (0.22 * style.text).round();
        let mut block = Block::new(PART);
        block.rectangle([left, top], [left + pixels, bottom], style.ink);
        let baseline = (top - 0.42 * style.text).round();
        // Over the middle, where it does not reach beyond the margin.
        let at =
            if line.width <= pixels { At::Middle(left + 0.5 * pixels) } else { At::Left(left) };
        block.line(line, at, baseline, style.ink);
        Ok((block, (baseline - 1.1 * style.text).floor()))
    }
}
