//! Where each part lies, and whether all have room: no two share a pixel, none leaves the picture.
//!
//! The title is at the top, the legend at the right below it, the scale bar in the lower left
//! corner and the axes above it.

use super::{
    Overlay, OverlayError,
    block::{At, Block, Style, text},
    font::DESCENT,
    light,
};

/// Why there is no layout.
#[derive(Debug)]
pub enum Problem {
    /// Whatever the size is.
    Hard(OverlayError),
    /// This part has no room.
    Unfit(&'static str),
}

impl From<OverlayError> for Problem {
    fn from(error: OverlayError) -> Self {
        Self::Hard(error)
    }
}

/// Blocks of a picture, and what they share.
#[derive(Debug)]
pub struct Layout {
    /// Sizes and colours.
    pub style: Style,
    /// Each with its pixels: the first column and row, and those after the last.
    pub blocks: Vec<(Block, [[i64; 2]; 2])>,
}

/// Height of the title, in heights of other text.
const TITLE: f64 = 1.25;

/// The shorter side from which on everything grows with the picture: a larger one has no more room.
const ALL_GROWS: u64 = 480;

/// The layout of a picture.
///
/// # Errors
/// Where the parts have no room, with the least size of this shape that has it.
pub fn layout(overlay: &Overlay, size: [u32; 2]) -> Result<Layout, OverlayError> {
    let part = match plan(overlay, size) {
        Ok(layout) => return Ok(layout),
        Err(Problem::Hard(error)) => return Err(error),
        Err(Problem::Unfit(part)) => part,
    };
    let shorter = u64::from(size[0].min(size[1]).max(1));
    let fits = |side| larger(overlay, size, shorter, side).filter(|(_, fits)| *fits);
    // What does not fit where all grows fits nowhere: then no other size is tried.
    let least = fits(ALL_GROWS).and_then(|_| (shorter + 1..=ALL_GROWS).find_map(fits));
    let none = OverlayError::NoRoom { part, size };
    Err(least.map_or(none, |(least, _)| OverlayError::TooSmall { part, size, least }))
}

/// The size of the same picture with a shorter side of so many pixels, and whether all have room;
/// none where the longer side is too long for any picture.
fn larger(overlay: &Overlay, size: [u32; 2], shorter: u64, side: u64) -> Option<([u32; 2], bool)> {
    let larger = size.map(|length| (u64::from(length) * side).div_ceil(shorter));
    let [Ok(width), Ok(height)] = larger.map(u32::try_from) else { return None };
    let mut grown = overlay.clone();
    if let Some(bar) = &mut grown.scale_bar {
        bar.pixels_per_unit *= f64::from(width) / f64::from(size[0].max(1));
    }
    Some(([width, height], plan(&grown, [width, height]).is_ok()))
}

/// The layout of a picture, if there is room.
fn plan(overlay: &Overlay, size: [u32; 2]) -> Result<Layout, Problem> {
    let style = Style::new(size, light::wants_white(overlay.background));
    let (unit, margin) = (style.text, style.margin);
    let mut blocks = Vec::new();
    let mut top = margin;
    if let Some(title) = &overlay.title {
        let mut block = Block::new("title");
        let line = text("title", title, TITLE * unit)?;
        let baseline = (margin + 0.76 * TITLE * unit).round();
        block.line(line, At::Middle(0.5 * style.size[0]), baseline, style.ink);
        blocks.push(block);
        top = (baseline + DESCENT * TITLE * unit + margin).ceil();
    }
    if let Some(legend) = &overlay.legend {
        blocks.extend(legend.blocks(&style, [top, style.size[1] - margin])?);
    }
    let mut bottom = style.size[1];
    if let Some(bar) = &overlay.scale_bar {
        let (block, above) = bar.block(&style)?;
        blocks.push(block);
        bottom = above;
    }
    if let Some(axes) = &overlay.axes {
        blocks.push(axes.block(&style, bottom)?);
    }
    let mut placed: Vec<(Block, [[i64; 2]; 2])> = Vec::new();
    for block in blocks {
        let Some(pixels) = block.bounds(&style) else { continue };
        let [[left, below], [right, above]] = pixels;
        let inside =
            left >= 0 && below >= 0 && right <= i64::from(size[0]) && above <= i64::from(size[1]);
        if !inside || placed.iter().any(|(_, other)| meet(pixels, *other)) {
            return Err(Problem::Unfit(block.part));
        }
        placed.push((block, pixels));
    }
    Ok(Layout { style, blocks: placed })
}

/// Whether two rectangles have a pixel in common.
fn meet(a: [[i64; 2]; 2], b: [[i64; 2]; 2]) -> bool {
    [0, 1].iter().all(|&axis| a[0][axis] < b[1][axis] && b[0][axis] < a[1][axis])
}
