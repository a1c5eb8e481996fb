//! Spheres and their columns as files: NumPy archives, PLY and extended XYZ.
//!
//! An archive holds `centers`, `radii` and `colors`, as they are drawn, and every other column
//! under its own name. A column whose name is one of those, or that comes twice, has `_` behind it.
//! The other two formats hold what they can, and say what they leave out.

use std::io::{self, Write};

use super::{Cell, Column, Role, Values, Words};
use crate::npy::{archive::Archive, header};
use planisphere_core::scene::Block;

/// What is written.
#[derive(Clone, Copy, Debug)]
pub struct Output<'a> {
    /// The spheres, those of one block after another.
    pub blocks: &'a [Block],
    /// Other columns, of as many rows.
    pub columns: &'a [Column],
    /// The box.
    pub cell: Option<Cell>,
}

/// Bytes that are handed on at a time.
const CHUNK: usize = 1 << 18;

impl<'a> Output<'a> {
    /// Number of spheres.
    fn len(&self) -> usize {
        self.blocks.iter().map(Block::len).sum()
    }

    /// Each block and the place of a sphere in it, in order.
    fn rows(&self) -> impl Iterator<Item = (&'a Block, usize)> + use<'a> {
        self.blocks.iter().flat_map(|block| (0..block.len()).map(move |index| (block, index)))
    }

    /// Whether a column is what is drawn, and so is written already.
    fn is_drawn(&self, column: &Column) -> bool {
        let value = |at| column.values.get(at);
        match (column.role, column.width) {
            (Role::Radius, 1) => {
                let mut rows = self.rows().enumerate();
                rows.all(|(row, (block, index))| value(row) == Some(block.radius(index)))
            }
            (Role::Color, 3) => self.rows().enumerate().all(|(row, (block, index))| {
                let color = block.color(index).map(f64::from);
                color.iter().enumerate().all(|(k, part)| value(3 * row + k) == Some(*part))
            }),
            _ => false,
        }
    }

    /// The columns that are written, under names that nothing else has; `bad` says what is in no
    /// name.
    fn named(&self, taken: &[&str], bad: fn(char) -> bool) -> Vec<(String, &'a Column)> {
        let mut names: Vec<String> = taken.iter().map(|name| (*name).to_owned()).collect();
        let mut found = Vec::new();
        for column in self.columns.iter().filter(|column| !self.is_drawn(column)) {
            let mut name = column.name.replace(bad, "_");
            while name.is_empty() || names.contains(&name) {
                name.push('_');
            }
            names.push(name.clone());
            found.push((name, column));
        }
        found
    }

    /// Writes a NumPy archive.
    ///
    /// # Errors
    /// The writer's.
    pub fn write_npz(&self, out: impl Write) -> io::Result<()> {
        let count = self.len();
        let mut archive = Archive::aligned(out);
        let centers = self.rows().map(|(block, index)| {
            let [x, y, z] = block.center(index).to_array().map(f64::to_le_bytes);
            let mut row = [0; 24];
            row[..8].copy_from_slice(&x);
            row[8..16].copy_from_slice(&y);
            row[16..].copy_from_slice(&z);
            row
        });
        archive.array("centers", "<f8", &[count, 3], centers)?;
        let radii = self.rows().map(|(block, index)| block.radius(index).to_le_bytes());
        archive.array("radii", "<f8", &[count], radii)?;
        let colors = self.rows().map(|(block, index)| block.color(index));
        archive.array("colors", "|u1", &[count, 3], colors)?;
        for (name, column) in self.named(&["centers", "radii", "colors"], no_file) {
            write_column(&mut archive, &name, column)?;
        }
        archive.finish()
    }

    /// Writes PLY, binary and little-endian, and says what it has no place for.
    ///
    /// # Errors
    /// The writer's.
    pub fn write_ply(&self, mut out: impl Write) -> io::Result<Vec<String>> {
        let own = ["x", "y", "z", "radius", "red", "green", "blue"];
        let columns = self.named(&own, |c| !c.is_ascii_graphic());
        let mut text = "ply\nformat binary_little_endian 1.0\ncomment planisphere\n".to_owned();
        text += &format!("element vertex {}\n", self.len());
        for name in &own[..4] {
            text += &format!("property double {name}\n");
        }
        for name in &own[4..] {
            text += &format!("property uchar {name}\n");
        }
        let (mut kept, mut left_out) = (Vec::new(), Vec::new());
        for (name, column) in columns {
            let kind = match &column.values {
                Values::Words(_) => {
                    left_out
                        .push(format!("PLY has no words: column `{}` is left out", column.name));
                    continue;
                }
                Values::Bytes(_) => "uchar",
                Values::Integers(all) if all.iter().all(|n| i32::try_from(*n).is_ok()) => "int",
                Values::Integers(_) | Values::Reals(_) => "double",
            };
            for component in 0..column.width {
                text += &match column.width {
                    1 => format!("property {kind} {name}\n"),
                    _ => format!("property {kind} {name}_{component}\n"),
                };
            }
            kept.push((kind, column));
        }
        out.write_all((text + "end_header\n").as_bytes())?;
        let mut bytes = Vec::with_capacity(2 * CHUNK);
        for (row, (block, index)) in self.rows().enumerate() {
            let [x, y, z] = block.center(index).to_array();
            for value in [x, y, z, block.radius(index)] {
                bytes.extend(value.to_le_bytes());
            }
            bytes.extend(block.color(index));
            for (kind, column) in &kept {
                for at in row * column.width..(row + 1) * column.width {
                    push_number(&mut bytes, kind, &column.values, at);
                }
            }
            if bytes.len() >= CHUNK {
                out.write_all(&bytes)?;
                bytes.clear();
            }
        }
        out.write_all(&bytes)?;
        Ok(left_out)
    }

    /// Writes extended XYZ: every number in the fewest digits that are read as the same number.
    ///
    /// # Errors
    /// The writer's.
    pub fn write_xyz(&self, mut out: impl Write) -> io::Result<()> {
        let element = self.columns.iter().find_map(|column| match &column.values {
            Values::Words(words) if column.role == Role::Element => Some(words),
            _ => None,
        });
        let own = ["species", "pos", "radius", "color"];
        let columns: Vec<_> = self
            .named(&own, no_cell)
            .into_iter()
            .filter(|(_, column)| !is_words(column, element))
            .collect();
        let mut header = format!("{}\n", self.len());
        if let Some(Cell { origin, edges }) = self.cell {
            let list = |values: &[f64]| {
                values.iter().map(|value| format!("{value:?}")).collect::<Vec<_>>().join(" ")
            };
            header += &format!(
                "Lattice=\"{}\" Origin=\"{}\" ",
                list(edges.as_flattened()),
                list(&origin)
            );
        }
        header += "Properties=";
        if element.is_some() {
            header += "species:S:1:";
        }
        header += "pos:R:3:radius:R:1:color:R:3";
        for (name, column) in &columns {
            let kind = match column.values {
                Values::Words(_) => 'S',
                Values::Integers(_) | Values::Bytes(_) => 'I',
                Values::Reals(_) => 'R',
            };
            // A colon ends a name.
            header += &format!(":{}:{kind}:{}", name, column.width);
        }
        let mut text = header + "\n";
        for (row, (block, index)) in self.rows().enumerate() {
            if let Some(words) = element {
                text += &word(words.get(row));
                text.push(' ');
            }
            let [x, y, z] = block.center(index).to_array();
            // From 0 to 1, as OVITO has them.
            let [red, green, blue] = block.color(index).map(|part| f64::from(part) / 255.0);
            text += &format!("{x:?} {y:?} {z:?} {:?} {red} {green} {blue}", block.radius(index));
            for (_, column) in &columns {
                for at in row * column.width..(row + 1) * column.width {
                    push_text(&mut text, &column.values, at);
                }
            }
            text.push('\n');
            if text.len() >= CHUNK {
                out.write_all(text.as_bytes())?;
                text.clear();
            }
        }
        out.write_all(text.as_bytes())
    }
}

/// Whether a character is in no name of a member of an archive.
fn no_file(c: char) -> bool {
    c == '/' || c == '\\' || c.is_control()
}

/// Whether a character is in no name of a column of extended XYZ: a colon ends one.
fn no_cell(c: char) -> bool {
    c.is_control() || c.is_whitespace() || [':', '"', '\'', '='].contains(&c)
}

/// Whether a column is the one of these words.
fn is_words(column: &Column, words: Option<&Words>) -> bool {
    let Values::Words(found) = &column.values else { return false };
    words.is_some_and(|words| std::ptr::eq(found, words))
}

/// A word that is one cell of a line.
fn word(word: &str) -> String {
    let word = word.trim().replace(|c: char| c.is_whitespace() || c.is_control(), "_");
    if word.is_empty() { "X".into() } else { word }
}

fn push_text(text: &mut String, values: &Values, at: usize) {
    *text += &match values {
        Values::Reals(reals) => format!(" {:?}", reals.get(at)),
        Values::Integers(integers) => format!(" {}", integers[at]),
        Values::Bytes(bytes) => format!(" {}", bytes.as_slice()[at]),
        Values::Words(words) => format!(" {}", word(words.get(at))),
    };
}

/// A number as a property of PLY.
fn push_number(bytes: &mut Vec<u8>, kind: &str, values: &Values, at: usize) {
    match (kind, values) {
        ("uchar", Values::Bytes(values)) => bytes.push(values.as_slice()[at]),
        ("int", Values::Integers(values)) => bytes.extend((values[at] as i32).to_le_bytes()),
        (_, values) => bytes.extend(values.get(at).unwrap_or(f64::NAN).to_le_bytes()),
    }
}

/// Writes a column as an array of an archive.
fn write_column<W: Write>(archive: &mut Archive<W>, name: &str, column: &Column) -> io::Result<()> {
    let width = column.width;
    let rows = column.values.len() / width.max(1);
    let shape = if width == 1 { vec![rows] } else { vec![rows, width] };
    match &column.values {
        Values::Reals(reals) => {
            let numbers = (0..reals.len()).map(|at| reals.get(at).to_le_bytes());
            archive.array(name, "<f8", &shape, numbers)
        }
        Values::Integers(integers) => {
            archive.array(name, "<i8", &shape, integers.iter().map(|n| n.to_le_bytes()))
        }
        Values::Bytes(bytes) => {
            archive.array(name, "|u1", &shape, bytes.as_slice().iter().map(|byte| [*byte]))
        }
        Values::Words(words) => write_words(archive, name, words, &shape),
    }
}

/// Writes words as NumPy's text of a fixed length: four bytes a character, and zeros behind them.
fn write_words<W: Write>(
    archive: &mut Archive<W>,
    name: &str,
    words: &Words,
    shape: &[usize],
) -> io::Result<()> {
    let length = words.words.iter().map(|word| word.chars().count()).max().unwrap_or(0).max(1);
    let padded = |word: &str| {
        let mut bytes: Vec<u8> = word.chars().flat_map(|c| u32::from(c).to_le_bytes()).collect();
        bytes.resize(4 * length, 0);
        bytes
    };
    let all: Vec<Vec<u8>> = words.words.iter().map(|word| padded(word)).collect();
    let header = header(&format!("<U{length}"), shape);
    archive.start(name, &header, 4 * length * words.codes.len())?;
    let mut bytes = Vec::with_capacity(CHUNK + 4 * length);
    for code in &words.codes {
        bytes.extend(&all[*code as usize]);
        if bytes.len() >= CHUNK {
            archive.write_all(&bytes)?;
            bytes.clear();
        }
    }
    archive.write_all(&bytes)
}
