//! The second line of a frame of an XYZ file: pairs of a key and a value, if it is of the extended
//! format.
//!
//! The format: github.com/libAtoms/extxyz, "Extended XYZ specification". A value is a word, or it
//! is within quotes, brackets or braces. Keys are told without their case, as OVITO does.

use std::ops::Range;

use super::super::{
    Cell,
    data::{Line, is_blank},
    number,
};
use crate::input::report::Fault;

/// What a comment says of its frame.
#[derive(Debug, Default)]
pub(super) struct Comment {
    /// The columns of the rows; none in the plain format.
    pub properties: Option<Vec<Property>>,
    /// Where the columns are named.
    pub place: Range<usize>,
    /// The box.
    pub cell: Option<Cell>,
    /// What a person should hear.
    pub notes: Vec<String>,
}

/// A column of the rows, of one cell or several.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Property {
    /// Its name.
    pub name: String,
    /// What its cells are.
    pub kind: PropertyKind,
    /// How many cells it has.
    pub width: usize,
}

/// What the cells of a column are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum PropertyKind {
    /// `R`: real numbers.
    Real,
    /// `I`: integers.
    Integer,
    /// `S`: words.
    Word,
    /// `L`: `T` or `F`.
    Truth,
}

impl Comment {
    /// Reads a comment, of either format.
    ///
    /// # Errors
    /// When it names columns, but not as the format does.
    pub fn read(line: Line<'_>) -> Result<Self, Fault> {
        let mut comment = Self::default();
        let (mut edges, mut origin) = (None, None);
        for (key, value) in (Pairs { text: line.text, at: 0 }) {
            let text = &line.text[value.clone()];
            if key.eq_ignore_ascii_case(b"properties") && comment.properties.is_none() {
                comment.place = line.start + value.start..line.start + value.end;
                comment.properties = properties(text);
            } else if key.eq_ignore_ascii_case(b"lattice") {
                edges = Some(lattice(text));
            } else if key.eq_ignore_ascii_case(b"origin") {
                origin = numbers(text).and_then(|found| <[f64; 3]>::try_from(found).ok());
            }
        }
        let value = line.text.get(comment.place.start.saturating_sub(line.start)..);
        let value = value.and_then(|value| value.get(..comment.place.len())).unwrap_or_default();
        if comment.properties.is_none() && value.contains(&b':') {
            return Err(Fault::new(
                "`Properties=` names columns as name:type:number, and these are not all of that \
                 form; a type is R, I, S or L",
                comment.place,
                "not name:type:number",
                "correct it, such as Properties=species:S:1:pos:R:3, or leave `Properties=` out",
            ));
        }
        if comment.properties.is_none() && !comment.place.is_empty() {
            let note = "the comment has `Properties=`, but no name:type:number behind it: rows are \
                        read as of the plain format";
            comment.notes.push(note.into());
        }
        match edges {
            Some(Some(edges)) => {
                comment.cell = Some(Cell { origin: origin.unwrap_or([0.0; 3]), edges });
            }
            Some(None) => comment.notes.push(
                "`Lattice=` in the comment is not nine numbers, or three: there is no box".into(),
            ),
            None => {}
        }
        Ok(comment)
    }
}

/// The columns of `name:type:number` of each; none if that is not what stands there.
fn properties(value: &[u8]) -> Option<Vec<Property>> {
    let parts: Vec<&[u8]> = value.split(|byte| *byte == b':').collect();
    let (columns, rest) = parts.as_chunks::<3>();
    if columns.is_empty() || !rest.is_empty() {
        return None;
    }
    let column = |[name, kind, width]: &[&[u8]; 3]| {
        let kind = match kind {
            [b'R' | b'r'] => PropertyKind::Real,
            [b'I' | b'i'] => PropertyKind::Integer,
            [b'S' | b's'] => PropertyKind::Word,
            [b'L' | b'l'] => PropertyKind::Truth,
            _ => return None,
        };
        let width = usize::try_from(number::integer(width)?).ok()?;
        let name = String::from_utf8_lossy(name).into_owned();
        (width > 0 && !name.is_empty()).then_some(Property { name, kind, width })
    };
    columns.iter().map(column).collect()
}

/// The edges of a box: nine numbers, or three along the axes.
fn lattice(value: &[u8]) -> Option<[[f64; 3]; 3]> {
    match *numbers(value)? {
        [x, y, z] => Some([[x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, z]]),
        [a, b, c, d, e, f, g, h, i] => Some([[a, b, c], [d, e, f], [g, h, i]]),
        _ => None,
    }
}

/// Finite numbers between blanks, commas and brackets; nine at most.
fn numbers(value: &[u8]) -> Option<Vec<f64>> {
    let parts = |byte: &u8| is_blank(*byte) || matches!(byte, b',' | b'[' | b']' | b'{' | b'}');
    let cells = value.split(parts).filter(|cell| !cell.is_empty());
    cells.take(10).map(|cell| number::real(cell).filter(|number| number.is_finite())).collect()
}

/// The pairs of a comment: keys, and where the values lie in it, without what encloses them. Words
/// that are no pair are passed over.
struct Pairs<'a> {
    text: &'a [u8],
    at: usize,
}

impl<'a> Iterator for Pairs<'a> {
    type Item = (&'a [u8], Range<usize>);

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            self.skip_blanks();
            let first = self.peek()?;
            let key = match first {
                b'"' => self.enclosed(),
                _ => self.until(|byte| is_blank(byte) || byte == b'='),
            };
            self.skip_blanks();
            if self.peek() != Some(b'=') {
                // A word alone.
                continue;
            }
            self.at += 1;
            self.skip_blanks();
            let value = match self.peek() {
                Some(b'"' | b'\'' | b'{' | b'[') => self.enclosed(),
                _ => self.until(is_blank),
            };
            return Some((&self.text[key], value));
        }
    }
}

impl Pairs<'_> {
    fn peek(&self) -> Option<u8> {
        self.text.get(self.at).copied()
    }

    fn skip_blanks(&mut self) {
        self.until(|byte| !is_blank(byte));
    }

    /// All up to a byte that ends it, or the end.
    fn until(&mut self, ends: impl Fn(u8) -> bool) -> Range<usize> {
        let start = self.at;
        let length = self.text[start..].iter().position(|byte| ends(*byte));
        self.at = length.map_or(self.text.len(), |length| start + length);
        start..self.at
    }

    /// What is within quotes, where a backslash hides the byte behind it, or within brackets of
    /// one kind, which may be nested. What is not closed goes to the end.
    fn enclosed(&mut self) -> Range<usize> {
        let opens = self.text[self.at];
        let closes = match opens {
            b'{' => b'}',
            b'[' => b']',
            quote => quote,
        };
        let start = self.at + 1;
        let (mut at, mut depth) = (start, 1usize);
        while let Some(byte) = self.text.get(at) {
            if *byte == closes {
                depth -= 1;
            } else if *byte == opens {
                depth += 1;
            } else if *byte == b'\\' {
                at += 1;
            }
            if depth == 0 {
                self.at = at + 1;
                return start..at;
            }
            at += 1;
        }
        self.at = self.text.len();
        start..self.at
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Comment {
        let line = Line { text: text.as_bytes(), start: 0, next: text.len() };
        Comment::read(line).expect("a comment")
    }

    #[test]
    fn columns_are_those_of_a_key_alone() {
        let two = Some(vec![
            Property { name: "species".into(), kind: PropertyKind::Word, width: 1 },
            Property { name: "pos".into(), kind: PropertyKind::Real, width: 3 },
        ]);
        for (text, wanted, notes) in [
            ("Properties=species:S:1:pos:R:3", &two, 0),
            ("a b=c  PROPERTIES = species:S:1:pos:R:3", &two, 0),
            (r#"Properties="species:S:1:pos:R:3" x"#, &two, 0),
            (r#"n="Properties=x:R:1 \"" d={1 2} properties=species:S:1:pos:R:3"#, &two, 0),
            (r#"'a' "k=" v=[[1, 2],[3 4]] Properties=species:S:1:pos:R:3"#, &two, 0),
            (r#"note="Properties=species:S:1:pos:R:3""#, &None, 0),
            ("Properties are listed", &None, 0),
            ("Properties= are listed in the paper", &None, 1),
            ("a=\"open", &None, 0),
            ("\"", &None, 0),
            ("a={\\", &None, 0),
            ("\\ = [ \" = =", &None, 0),
            ("", &None, 0),
        ] {
            let found = read(text);
            assert_eq!((&found.properties, found.notes.len()), (wanted, notes), "{text}");
        }
        for text in ["species:S:1:pos:R", "species:S:1:pos:R:-3", "species:S:1:pos:Q:3"] {
            let text = format!("Properties={text}");
            let line = Line { text: text.as_bytes(), start: 0, next: text.len() };
            assert!(Comment::read(line).is_err(), "{text}");
        }
    }

    #[test]
    fn boxes_are_nine_numbers_or_three() {
        let edges = [[4.0, 0.0, 0.5], [0.0, 5.0, 0.0], [0.0, 0.0, 60.0]];
        for text in [
            r#"Lattice="4 0 0.5 0 5 0 0 0 6D1""#,
            "lattice=[[4,0,.5],[0, 5,0],[0,0,60]]",
            "x Lattice={4\t0 .5 0 5 0 0 0 60} y",
        ] {
            assert_eq!(read(text).cell, Some(Cell { origin: [0.0; 3], edges }), "{text}");
        }
        let cell = read(r#"Origin="-1 -2 -3" Lattice="1 2 3""#).cell.unwrap();
        assert_eq!(cell.origin, [-1.0, -2.0, -3.0]);
        assert_eq!(cell.edges, [[1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 3.0]]);
        for text in ["Lattice=5.4", "Lattice=\"1 2 inf\"", "Lattice=\"1 2 3 4 5 6 7 8 9 10\""] {
            let found = read(text);
            assert_eq!((found.cell, found.notes.len()), (None, 1), "{text}");
        }
    }
}
