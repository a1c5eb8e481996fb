//! What lies on the picture, in outlines: the shapes of a block, and the style that all share.

use super::{
    OverlayError,
    font::{self, Line},
    raster::Path,
};

/// Parts of the shorter side that a line of text is high.
const LINES: f64 = 36.0;

/// The least height of text that is readable, in pixels.
const LEAST_TEXT: f64 = 12.0;

/// Sizes and colours that all blocks share.
#[derive(Clone, Copy, Debug)]
pub struct Style {
    /// Columns and rows of the picture.
    pub size: [f64; 2],
    /// Height of text, in pixels.
    pub text: f64,
    /// What is kept free at the borders, in whole pixels.
    pub margin: f64,
    /// Of text and lines, sRGB.
    pub ink: [u8; 3],
}

impl Style {
    /// That of a picture. `white` says whether the ink is white, rather than black.
    pub fn new([width, height]: [u32; 2], white: bool) -> Self {
        let text = (f64::from(width.min(height)) / LINES).max(LEAST_TEXT);
        let size = [width, height].map(f64::from);
        let margin = (0.6 * text).round();
        Self { size, text, margin, ink: if white { [255; 3] } else { [0; 3] } }
    }

    /// How far a halo reaches, in pixels.
    pub fn halo(&self) -> f64 {
        self.text / 8.0
    }

    /// The width of a thin line, in whole pixels.
    pub fn thin(&self) -> f64 {
        (self.text / 16.0).round().max(1.0)
    }
}

/// An outline and its colour.
#[derive(Clone, Debug)]
pub struct Shape {
    /// In pixels of the picture.
    pub path: Path,
    /// sRGB.
    pub color: [u8; 3],
    /// Whether it is text, rather than a length that must be right.
    pub letters: bool,
}

/// A rectangle of whole pixels, each row of one colour: that of a colour bar.
#[derive(Clone, Debug)]
pub struct Rows {
    /// Column and row of its first pixel.
    pub at: [i64; 2],
    /// Columns.
    pub width: usize,
    /// The colour of each row, sRGB.
    pub colors: Vec<[u8; 3]>,
}

/// Shapes that lie together and share a halo.
#[derive(Clone, Debug)]
pub struct Block {
    /// What it is, for errors.
    pub part: &'static str,
    /// What lies below the shapes.
    pub rows: Option<Rows>,
    /// In the order in which they are drawn.
    pub shapes: Vec<Shape>,
    /// Pixels that are its own whatever the shapes are: the least corner, and the greatest.
    pub kept: Option<[[f64; 2]; 2]>,
}

/// Where a line of text begins or ends.
#[derive(Clone, Copy, Debug)]
pub enum At {
    /// The pen starts here.
    Left(f64),
    /// The middle of its width.
    Middle(f64),
    /// The pen ends here.
    Right(f64),
}

impl Block {
    /// Without shapes.
    pub fn new(part: &'static str) -> Self {
        Self { part, rows: None, shapes: Vec::new(), kept: None }
    }

    /// Adds a shape.
    pub fn add(&mut self, path: Path, color: [u8; 3]) {
        self.shapes.push(Shape { path, color, letters: false });
    }

    /// Adds letters.
    pub fn letters(&mut self, path: Path, color: [u8; 3]) {
        self.shapes.push(Shape { path, color, letters: true });
    }

    /// Adds a rectangle, from one corner to the other.
    pub fn rectangle(&mut self, from: [f64; 2], to: [f64; 2], color: [u8; 3]) {
        let mut path = Path::default();
        path.rectangle(from, to);
        self.add(path, color);
    }

    /// Adds a line of text.
    pub fn line(&mut self, line: Line, at: At, baseline: f64, color: [u8; 3]) {
        let left = match at {
            At::Left(left) => left,
            At::Middle(middle) => middle - 0.5 * line.width,
            At::Right(right) => right - line.width,
        };
        self.letters(line.path.moved([left, baseline]), color);
    }

    /// Its pixels, with the halo: columns and rows of the first, and of what comes after the last;
    /// none where it has no shapes.
    pub fn bounds(&self, style: &Style) -> Option<[[i64; 2]; 2]> {
        let rows = self.rows.as_ref().map(|rows| {
            let end = [rows.at[0] + rows.width as i64, rows.at[1] + rows.colors.len() as i64];
            [rows.at, end].map(|corner| corner.map(|place| place as f64))
        });
        let shapes = self.shapes.iter().filter_map(|shape| shape.path.bounds());
        // One pixel more: a pixel that is covered in part spreads as a whole one.
        let reach = style.halo() + 1.0;
        let haloed = shapes.chain(rows).map(|[[left, top], [right, bottom]]| {
            let least = [left.floor() - reach, top.floor() - reach];
            [least.map(f64::ceil), [right.ceil() + reach, bottom.ceil() + reach].map(f64::floor)]
        });
        let all = haloed.chain(self.kept).reduce(|a, b| {
            let least = [a[0][0].min(b[0][0]), a[0][1].min(b[0][1])];
            [least, [a[1][0].max(b[1][0]), a[1][1].max(b[1][1])]]
        })?;
        let [least, most] = all;
        Some([least.map(|v| v.floor() as i64), most.map(|v| v.ceil() as i64)])
    }
}

/// A line of text, which has letters.
///
/// # Errors
/// A character that the font does not have; a text without letters.
pub fn text(part: &'static str, words: &str, height: f64) -> Result<Line, OverlayError> {
    let line = font::line(words, height).map_err(|letter| OverlayError::Letter {
        part,
        words: words.to_owned(),
        letter,
    })?;
    if line.path.bounds().is_none() {
        return Err(OverlayError::NoWords { part, words: words.to_owned() });
    }
    Ok(line)
}
