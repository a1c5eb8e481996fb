//! Pictures some rows at a time.

use planisphere_core::camera::Region;

/// Pixels that are drawn at a time, at most, where a picture comes in bands: 8K is one.
pub(crate) const BAND: usize = 1 << 25;

/// A region in bands of whole rows, of at most so many pixels where a row is not more.
pub(crate) fn bands(region: Region, pixels: usize) -> impl Iterator<Item = Region> {
    // Tiles of 64 rows or less are not cut, so that none is drawn twice.
    let rows = (pixels / region.width as usize).max(1);
    let rows = if rows >= 64 { rows / 64 * 64 } else { rows } as u32;
    (region.y..region.y + region.height).step_by(rows as usize).map(move |y| Region {
        y,
        height: rows.min(region.y + region.height - y),
        ..region
    })
}

/// Pixels of which planes are made between two looks at the control.
pub(crate) const PIECE: usize = 1 << 20;
