//! Words become outlines: the embedded font, its widths and its kerning.
//!
//! The font's numbers are whole; they are scaled in f64 by + - * / alone.

use ttf_parser::{Face, GlyphId, OutlineBuilder};

use super::raster::Path;

/// DejaVu Sans, cut down. `fonts/README.md` says how, and its licence.
const FONT: &[u8] = include_bytes!("../../fonts/DejaVuSans.ttf");

/// Height of a capital letter or a digit, in parts of the text's height.
pub const CAPITAL: f64 = 1493.0 / 2048.0;

/// How far letters reach below the baseline, in parts of the text's height.
pub const DESCENT: f64 = 0.24;

/// One line of words. Its pen starts at (0, 0), on the baseline.
#[derive(Clone, Debug)]
pub struct Line {
    /// The outlines of its letters.
    pub path: Path,
    /// How far the pen goes.
    pub width: f64,
}

/// Words in one line, `height` pixels high from one line of a paragraph to the next, or nearly so.
///
/// # Errors
/// A character that the font does not have.
pub fn line(words: &str, height: f64) -> Result<Line, char> {
    let face = Face::parse(FONT, 0).expect("the embedded font is whole");
    let scale = height / f64::from(face.units_per_em());
    let mut pen = Pen { scale, x: 0.0, start: [0.0; 2], last: [0.0; 2], path: Path::default() };
    let mut before = None;
    for letter in words.chars() {
        let glyph = face.glyph_index(letter).ok_or(letter)?;
        let kerning = before.map_or(0, |before| kerning(&face, before, glyph));
        pen.x += f64::from(kerning) * scale;
        // A blank has no outline, and that is no error.
        let _box = face.outline_glyph(glyph, &mut pen);
        pen.x += f64::from(face.glyph_hor_advance(glyph).unwrap_or(0)) * scale;
        before = Some(glyph);
    }
    Ok(Line { path: pen.path, width: pen.x })
}

/// How much nearer two glyphs come, in units of the font.
fn kerning(face: &Face<'_>, left: GlyphId, right: GlyphId) -> i16 {
    let tables = face.tables().kern.into_iter().flat_map(|kern| kern.subtables);
    let mut across = tables.filter(|table| table.horizontal && !table.variable);
    across.find_map(|table| table.glyphs_kerning(left, right)).unwrap_or(0)
}

/// Takes the outline of a glyph, with y up and in units of the font.
struct Pen {
    /// Pixels of a unit.
    scale: f64,
    /// Where the glyph is, in pixels.
    x: f64,
    /// Where its outline began, and where it is.
    start: [f64; 2],
    last: [f64; 2],
    path: Path,
}

impl Pen {
    fn at(&self, x: f32, y: f32) -> [f64; 2] {
        [self.x + f64::from(x) * self.scale, -f64::from(y) * self.scale]
    }
}

impl OutlineBuilder for Pen {
    fn move_to(&mut self, x: f32, y: f32) {
        self.start = self.at(x, y);
        self.last = self.start;
    }

    fn line_to(&mut self, x: f32, y: f32) {
        let to = self.at(x, y);
        self.path.line(self.last, to);
        self.last = to;
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        let (control, to) = (self.at(x1, y1), self.at(x, y));
        self.path.quadratic(self.last, control, to);
        self.last = to;
    }

    fn curve_to(&mut self, _: f32, _: f32, _: f32, _: f32, _: f32, _: f32) {
        unreachable!("outlines of TrueType are parabolas");
    }

    fn close(&mut self) {
        self.path.line(self.last, self.start);
        self.last = self.start;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn widths_are_the_fonts() {
        let width = |words: &str| line(words, 2048.0).unwrap().width;
        // hmtx of DejaVu Sans: A 1401, V 1401, digits 1303, blank 651; kern: A V -131.
        assert_eq!(
            (width("A"), width("V"), width("0"), width(" ")),
            (1401.0, 1401.0, 1303.0, 651.0)
        );
        assert_eq!(width("AV"), 2.0 * 1401.0 - 131.0);
        assert_eq!(width("0123456789"), 13_030.0);
        assert_eq!(width("−"), width("+"), "signs have one width");
        assert_eq!(width(""), 0.0);
    }

    #[test]
    fn what_labels_need_is_there() {
        let needed = "×±·−⁰¹²³⁴⁵⁶⁷⁸⁹⁻⁺₀₁₂₃₄₅₆₇₈₉åÅÅµμ°ΩΩωσερτħℓ∂∞≤≥≈→…–—‰′″☉⊙ßéñŁčжЯЁ";
        for letter in needed.chars().chain(' '..='~') {
            let made = line(&letter.to_string(), 20.0).unwrap_or_else(|c| panic!("no {c:?}"));
            assert_eq!(made.path.bounds().is_none(), letter == ' ', "{letter:?}");
        }
        for missing in ['漢', '\n', '\t', '\u{301}', '😀', 'א'] {
            assert_eq!(line(&format!("a{missing}b"), 20.0).unwrap_err(), missing);
        }
    }

    #[test]
    fn every_letter_fills_its_outline() {
        // Contours turn the right way, and holes are holes.
        let mask = line("O", 100.0).unwrap().path.mask();
        let [width, height] = mask.size;
        assert_eq!(mask.cover[height / 2 * width + width / 2], 0);
        assert_eq!(mask.cover[height / 2 * width + 6], 255);
        let [[_, top], [_, bottom]] = line("H", 100.0).unwrap().path.bounds().unwrap();
        assert_eq!((top, bottom), (-100.0 * CAPITAL, 0.0));
    }
}
