//! Files of particles, as simulations and structure databases have them: columns of numbers, one
//! row a particle, in one frame or several.
//!
//! A format is a `Reader` in a file of its own. It says where the frames of its bytes lie, and
//! turns one of them into [`Particles`]; it knows nothing of pictures. What of the columns is
//! drawn, how large and in which colour, is decided for all formats alike.

use std::{fmt, ops::Range};

use rayon::prelude::*;

use crate::input::report::Fault;
use planisphere_core::{
    drawing::Control,
    scene::{self, Reals},
};

#[cfg(any(feature = "gro", feature = "mmcif", feature = "pdb"))]
#[cfg_attr(
    not(all(feature = "gro", feature = "mmcif", feature = "pdb")),
    allow(dead_code, reason = "each of them uses a part")
)]
mod atoms;
#[cfg(any(feature = "dcd", feature = "gsd", feature = "xtc"))]
mod binary;
#[cfg(feature = "mmcif")]
mod cif;
#[cfg(feature = "csv")]
mod csv;
mod data;
#[cfg(feature = "dcd")]
mod dcd;
#[cfg(feature = "lammps")]
mod dump;
pub mod elements;
mod file;
mod format;
#[cfg(feature = "gro")]
mod gro;
pub(crate) mod groups;
#[cfg(feature = "gsd")]
mod gsd;
mod input;
mod kinds;
#[cfg(feature = "lammps")]
mod lammps_data;
#[cfg(feature = "mmcif")]
mod mmcif;
mod number;
#[cfg(feature = "npz")]
mod numpy;
mod packing;
#[cfg(feature = "pdb")]
mod pdb;
#[cfg(feature = "ply")]
mod ply;
#[cfg(any(feature = "npz", feature = "ply"))]
mod records;
mod rows;
mod spacing;
pub mod spheres;
pub(crate) mod understood;
#[cfg(feature = "compressed")]
mod unpack;
#[cfg(feature = "convert")]
pub mod write;
#[cfg(feature = "xtc")]
mod xtc;
#[cfg(feature = "xyz")]
mod xyz;

pub use file::{File, Frame};
pub use format::Format;
pub use planisphere_image::maps::Map;
pub use understood::{Options, Understood, understand};

pub(crate) use data::Data;
pub(crate) use input::{Beginning, Input};

/// One frame of a file.
#[derive(Clone, Debug)]
pub struct Particles {
    /// Positions, (N, 3), in the file's own unit.
    pub centers: Reals,
    /// Where they come from, in the file's own words, such as "x y z".
    pub centers_from: String,
    /// All other columns, in the order of the file.
    pub columns: Vec<Column>,
    /// The box that the particles are in, if the file has one.
    pub cell: Option<Cell>,
    /// What a person should hear of how it was read, each one line: what was left out, or guessed.
    pub notes: Vec<String>,
}

impl Particles {
    /// How many there are.
    pub fn len(&self) -> usize {
        self.centers.len() / 3
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The column of a name.
    pub fn column(&self, name: &str) -> Option<&Column> {
        self.columns.iter().find(|column| column.name == name)
    }

    /// The first column of a role.
    pub fn role(&self, role: Role) -> Option<&Column> {
        self.columns.iter().find(|column| column.role == role)
    }
}

/// Values of all particles.
#[derive(Clone, Debug)]
pub struct Column {
    /// Its name in the file, or what the format's definition calls it.
    pub name: String,
    /// What it says of a particle, as far as that is known.
    pub role: Role,
    /// Values a particle.
    pub width: usize,
    /// The values, those of one particle after another.
    pub values: Values,
}

impl Column {
    /// A column of one value a particle, whose role is that of its name.
    pub fn named(name: impl Into<String>, values: Values) -> Self {
        let name = name.into();
        Self { role: Role::of_name(&name), name, width: 1, values }
    }

    /// The same, of a role that the format gives it.
    #[must_use]
    pub fn with_role(mut self, role: Role) -> Self {
        self.role = role;
        self
    }

    /// The same, of several values a particle.
    #[must_use]
    pub fn with_width(mut self, width: usize) -> Self {
        self.width = width;
        self
    }
}

/// Values of a column.
#[derive(Clone, Debug)]
pub enum Values {
    /// Real numbers.
    Reals(Reals),
    /// Integers.
    Integers(Vec<i64>),
    /// Bytes, as of colours.
    Bytes(scene::Column<u8>),
    /// Words.
    Words(Words),
}

impl Values {
    /// How many there are.
    pub fn len(&self) -> usize {
        match self {
            Self::Reals(values) => values.len(),
            Self::Integers(values) => values.len(),
            Self::Bytes(values) => values.as_slice().len(),
            Self::Words(words) => words.codes.len(),
        }
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The least and the greatest that is a number; none of words, and where there is none.
    pub fn range(&self) -> Option<[f64; 2]> {
        let wider = |found: Option<[f64; 2]>, value: f64| match found {
            _ if value.is_nan() => found,
            Some([low, high]) => Some([low.min(value), high.max(value)]),
            None => Some([value; 2]),
        };
        (0..self.len()).filter_map(|index| self.get(index)).fold(None, wider)
    }

    /// A number of them; none of words.
    pub fn get(&self, index: usize) -> Option<f64> {
        match self {
            Self::Reals(values) => Some(values.get(index)),
            Self::Integers(values) => Some(values[index] as f64),
            Self::Bytes(values) => Some(f64::from(values.as_slice()[index])),
            Self::Words(_) => None,
        }
    }
}

/// The place of the first number that is not as it must be.
fn first_unlike(reals: &Reals, is_right: impl Fn(f64) -> bool + Sync) -> Option<usize> {
    fn first<T: Copy + Into<f64> + Sync>(
        values: &[T],
        is_right: impl Fn(f64) -> bool + Sync,
    ) -> Option<usize> {
        const PIECE: usize = 1 << 14;
        let piece = |(number, values): (usize, &[T])| {
            // All of them, without a way out in between: so they are looked at many at a time.
            let all = values.iter().fold(true, |all, value| all & is_right((*value).into()));
            let at = || values.iter().position(|value| !is_right((*value).into()));
            if all { None } else { at().map(|at| number * PIECE + at) }
        };
        values.par_chunks(PIECE).enumerate().find_map_first(piece)
    }
    match reals {
        Reals::F32(values) => first(values.as_slice(), is_right),
        Reals::F64(values) => first(values.as_slice(), is_right),
    }
}

/// Words, of which there are few that are told apart.
#[derive(Clone, Debug, Default)]
pub struct Words {
    /// The place of each one's word in `words`.
    pub codes: Vec<u32>,
    /// The words, each once, in the order in which they first come.
    pub words: Vec<Box<str>>,
}

impl Words {
    /// The word of a particle.
    pub fn get(&self, index: usize) -> &str {
        &self.words[self.codes[index] as usize]
    }
}

impl<S: AsRef<str>> FromIterator<S> for Words {
    fn from_iter<I: IntoIterator<Item = S>>(words: I) -> Self {
        let mut found = rows::Lexicon::default();
        let codes = words.into_iter().map(|word| found.number(word.as_ref().as_bytes())).collect();
        Self { codes, words: found.into_words() }
    }
}

/// What a column says of a particle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Its radius, in the unit of the positions.
    Radius,
    /// Twice its radius.
    Diameter,
    /// Its colour, sRGB: three bytes, or three reals from 0 to 1.
    Color,
    /// One channel of its colour: 0 is red, 1 green, 2 blue.
    Channel(u8),
    /// The symbol of its element.
    Element,
    /// The number of its element.
    AtomicNumber,
    /// Its type: particles of one type look alike.
    Type,
    /// What it is told by in all frames.
    Id,
    /// Anything else.
    Other,
}

impl Role {
    /// What a column of a name says, in formats that do not define it.
    pub fn of_name(name: &str) -> Self {
        match name.to_ascii_lowercase().as_str() {
            "radius" | "radii" => Self::Radius,
            "diameter" | "diameters" => Self::Diameter,
            "color" | "colors" | "colour" | "colours" | "rgb" => Self::Color,
            "red" => Self::Channel(0),
            "green" => Self::Channel(1),
            "blue" => Self::Channel(2),
            "element" | "elements" | "species" | "symbol" | "symbols" | "type_symbol" => {
                Self::Element
            }
            "atomic_number" | "atomic_numbers" | "z_number" | "numbers" => Self::AtomicNumber,
            "type" | "types" | "typeid" | "atom_type" | "particle_type" => Self::Type,
            "id" | "ids" | "serial" | "identifier" | "particle_identifier" => Self::Id,
            _ => Self::Other,
        }
    }
}

/// A box: a corner and the three edges that leave it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// The corner.
    pub origin: [f64; 3],
    /// The edges, in any directions.
    pub edges: [[f64; 3]; 3],
}

impl Cell {
    /// Turns rows of three parts of its edges into places: the corner, and then the parts of the
    /// first edge, the second and the third added, each product and each sum rounded once.
    pub fn unscale(&self, rows: &mut [f64]) {
        let [a, b, c] = self.edges;
        rows.par_chunks_mut(3 << 12).for_each(|rows| {
            for row in rows.chunks_exact_mut(3) {
                let [u, v, w] = [row[0], row[1], row[2]];
                for axis in 0..3 {
                    row[axis] = self.origin[axis] + u * a[axis] + v * b[axis] + w * c[axis];
                }
            }
        });
    }
}

/// Reads one format. It is made for the bytes of one input.
pub(crate) trait Reader: fmt::Debug + Send + Sync {
    /// Where the frame lies that begins at a place: at 0, or where another frame ends. None where
    /// there is no more. Nothing is parsed that is not needed to know it. What a place is, is the
    /// format's own affair: bytes of the input, or the number of a frame.
    ///
    /// # Errors
    /// When a frame begins there, but is no whole one.
    fn frame(&self, data: &Data, at: usize) -> Result<Option<Range<usize>>, Fault>;

    /// Reads a frame that was found. Places in a fault are bytes of the input.
    ///
    /// # Errors
    /// What is wrong with it; when it is cancelled.
    fn read(&self, data: &Data, frame: Range<usize>, control: &Control)
    -> Result<Particles, Fault>;
}
