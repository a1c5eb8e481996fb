//! What is drawn over a finished picture: title, legend, scale bar and axes.
//!
//! They lie in the corners and do not change the picture's size. All lengths grow with its shorter
//! side, so a picture of twice the size looks the same; text is at least 12 pixels high, and where
//! that leaves too little room, an error names the least size. Outlines are found with + - * / and
//! square roots, and colours are mixed in integers (`light.rs`): every machine gives the same
//! bytes.

mod axes;
mod block;
mod font;
mod layout;
mod legend;
mod light;
mod numbers;
mod paint;
mod raster;
mod scale_bar;
#[cfg(test)]
mod tests;

pub use axes::Axes;
pub use legend::Legend;
pub use scale_bar::ScaleBar;

/// What is drawn over a picture.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Overlay {
    /// A line at the top.
    pub title: Option<String>,
    /// What the colours mean, at the right.
    pub legend: Option<Legend>,
    /// A length, in the lower left corner.
    pub scale_bar: Option<ScaleBar>,
    /// The axes of the world, in the lower left corner, above the scale bar.
    pub axes: Option<Axes>,
    /// The colour that is behind most of it, sRGB: it decides whether text is white, with a dark
    /// halo, or black with a bright one.
    pub background: [u8; 3],
}

/// Why nothing can be drawn over a picture.
#[derive(Clone, Debug, thiserror::Error, PartialEq)]
pub enum OverlayError {
    /// There are other pixels than those of the picture.
    #[error(
        "there are {found} pixels, where whole rows of {width} in a picture of {height} rows \
             are asked for, beginning with row {first}"
    )]
    Pixels {
        /// How many there are.
        found: usize,
        /// Columns of the picture.
        width: u32,
        /// Rows of the picture.
        height: u32,
        /// The row of the first.
        first: u32,
    },
    /// A character that the font does not have.
    #[error(
        "the {part} {words:?} has the character {letter:?} (U+{:04X}), which the font does not \
         have; it has Latin, Greek and Cyrillic letters, digits, and signs of units",
        u32::from(*.letter)
    )]
    Letter {
        /// What it belongs to.
        part: &'static str,
        /// All of the text.
        words: String,
        /// The character.
        letter: char,
    },
    /// A text in which nothing is seen.
    #[error("the {part} has the text {words:?}, in which no letter is; give one, or leave it out")]
    NoWords {
        /// What it belongs to.
        part: &'static str,
        /// The text.
        words: String,
    },
    /// No range of numbers.
    #[error(
        "the legend has the range from {} to {}; give two finite numbers, the lower one first",
        .0[0], .0[1]
    )]
    Range([f64; 2]),
    /// A legend of nothing.
    #[error("the legend has no entries; give at least one, or leave it out")]
    NoKeys,
    /// No scale.
    #[error("the scale bar has {0} pixels a unit; give a positive number")]
    Scale(f64),
    /// No length.
    #[error("the scale bar has the length {0}; give a positive number")]
    Length(f64),
    /// A length that is too long or too short for the picture.
    #[error(
        "the scale bar of the length {length} is {pixels} pixels long; give a length from {least} \
         to {most}, for which there is room"
    )]
    LengthInPixels {
        /// In the world.
        length: f64,
        /// In the picture.
        pixels: f64,
        /// The shortest that can be seen, in the world.
        least: f64,
        /// The longest for which there is room, in the world.
        most: f64,
    },
    /// No axes of a camera.
    #[error(
        "the axes right {right:?}, up {up:?} and back {back:?} are not those of a camera; give \
         orthogonal vectors of length 1, of which right x up is back"
    )]
    Frame {
        /// To the right.
        right: [f64; 3],
        /// Up.
        up: [f64; 3],
        /// Towards the eye.
        back: [f64; 3],
    },
    /// The picture is too small for text that can be read.
    #[error(
        "the picture of {} x {} pixels has no room for the {part}; the least size of this shape \
         that has is {} x {}",
        .size[0], .size[1], .least[0], .least[1]
    )]
    TooSmall {
        /// What has no room.
        part: &'static str,
        /// Columns and rows.
        size: [u32; 2],
        /// The least columns and rows.
        least: [u32; 2],
    },
    /// No picture of this shape has room.
    #[error(
        "the picture of {} x {} pixels has no room for the {part}, nor has a larger one of this \
         shape; make its text shorter, or leave other parts out",
        .size[0], .size[1]
    )]
    NoRoom {
        /// What has no room.
        part: &'static str,
        /// Columns and rows.
        size: [u32; 2],
    },
}

/// An overlay of a picture of a known size, ready to be laid over its rows.
#[derive(Clone, Debug)]
pub struct Laid {
    size: [u32; 2],
    /// Each with its pixels: the first column and row, and those after the last.
    blocks: Vec<(paint::Painted, [[i64; 2]; 2])>,
}

impl Overlay {
    /// Draws it over a whole picture: row by row from the top, sRGB with straight alpha.
    ///
    /// # Errors
    /// Where a part has no meaning or no room; then nothing is drawn.
    pub fn draw(&self, size: [u32; 2], pixels: &mut [[u8; 4]]) -> Result<(), OverlayError> {
        let laid = self.lay(size)?;
        let whole = u64::from(size[0]) * u64::from(size[1]);
        if pixels.len() as u64 != whole {
            return Err(laid.unfit(0, pixels));
        }
        laid.onto(0, pixels)
    }

    /// What it may change in a picture of this size: the column and the row of the first pixel,
    /// columns and rows. No two have a pixel in common.
    ///
    /// # Errors
    /// As [`Overlay::draw`].
    pub fn regions(&self, size: [u32; 2]) -> Result<Vec<[u32; 4]>, OverlayError> {
        let layout = layout::layout(self, size)?;
        Ok(layout.blocks.iter().map(|(_, pixels)| region(*pixels)).collect())
    }

    /// Makes everything that is to be drawn over a picture of this size.
    ///
    /// # Errors
    /// As [`Overlay::draw`].
    pub fn lay(&self, size: [u32; 2]) -> Result<Laid, OverlayError> {
        let layout = layout::layout(self, size)?;
        let painted = layout
            .blocks
            .iter()
            .map(|(block, pixels)| (paint::Painted::new(block, *pixels, &layout.style), *pixels));
        Ok(Laid { size, blocks: painted.collect() })
    }
}

impl Laid {
    /// What it may change, as [`Overlay::regions`].
    pub fn regions(&self) -> Vec<[u32; 4]> {
        self.blocks.iter().map(|(_, pixels)| region(*pixels)).collect()
    }

    /// Draws over some whole rows of the picture, of which the first has this number. Rows that
    /// come in pieces have the bytes of the whole picture.
    ///
    /// # Errors
    /// When these are not whole rows of the picture; then nothing is drawn.
    pub fn onto(&self, first: u32, pixels: &mut [[u8; 4]]) -> Result<(), OverlayError> {
        let width = self.size[0] as usize;
        let rows = pixels.len() / width.max(1);
        let inside = u64::from(first) + rows as u64 <= u64::from(self.size[1]);
        if rows * width != pixels.len() || !inside {
            return Err(self.unfit(first, pixels));
        }
        for (row, pixels) in pixels.chunks_exact_mut(width.max(1)).enumerate() {
            let y = i64::from(first) + row as i64;
            for (block, [[_, top], [_, bottom]]) in &self.blocks {
                if (*top..*bottom).contains(&y) {
                    block.row(y, pixels);
                }
            }
        }
        Ok(())
    }

    fn unfit(&self, first: u32, pixels: &[[u8; 4]]) -> OverlayError {
        let [width, height] = self.size;
        OverlayError::Pixels { found: pixels.len(), width, height, first }
    }
}

/// The column and the row of the first pixel, columns and rows. They are inside of a picture.
fn region([[left, top], [right, bottom]]: [[i64; 2]; 2]) -> [u32; 4] {
    [left, top, right - left, bottom - top].map(|number| number as u32)
}
