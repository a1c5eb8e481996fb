//! Reads NumPy arrays: `.npy` files, memory-mapped, as columns of numbers in place.
//!
//! Little-endian f4, f8 and u1 in C order are taken as they lie in the file; everything else is refused in words.
//! This file knows nothing of scenes. The format: NEP 1, "A simple file format for NumPy arrays".

use std::{fs::File, io, path::Path};

use bytes::Bytes;
use memmap2::Mmap;

use crate::scene::{Column, Reals};

#[cfg(target_endian = "big")]
compile_error!("arrays are used in place as little-endian numbers: this machine's are big-endian");

/// Types of numbers that are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// 32-bit floats, little-endian.
    F32,
    /// 64-bit floats, little-endian.
    F64,
    /// Bytes.
    U8,
}

impl Kind {
    fn size(self) -> usize {
        match self {
            Self::F32 => 4,
            Self::F64 => 8,
            Self::U8 => 1,
        }
    }

    /// NumPy's name.
    fn name(self) -> &'static str {
        match self {
            Self::F32 => "float32",
            Self::F64 => "float64",
            Self::U8 => "uint8",
        }
    }
}

/// Why a file is not an array that can be used. [`NpyError::fix`] says what to do.
#[derive(Debug, thiserror::Error)]
pub enum NpyError {
    /// It is not there.
    #[error("no such file")]
    Missing,
    /// It cannot be opened or mapped.
    #[error("cannot be read: {0}")]
    Io(io::Error),
    /// It is a folder or a device.
    #[error("is not a regular file")]
    NotAFile,
    /// Not this format.
    #[error("is not an .npy file: {0}")]
    Format(&'static str),
    /// The numbers are of another type.
    #[error("holds numbers of type '{found}', but {wanted} is needed")]
    Type {
        /// NumPy's type code.
        found: String,
        /// What is needed, in words.
        wanted: &'static str,
    },
    /// Bytes in the wrong order.
    #[error("holds big-endian numbers ('{0}')")]
    BigEndian(String),
    /// Columns first.
    #[error("is in Fortran order (columns first)")]
    Fortran,
    /// The file's length and the shape disagree.
    #[error("holds {found} bytes of numbers, but its shape {shape:?} needs {wanted}")]
    Length {
        /// Bytes after the header.
        found: usize,
        /// Bytes that the shape needs.
        wanted: usize,
        /// The shape.
        shape: Vec<usize>,
    },
}

impl NpyError {
    /// What to do about it, in Python's words where that is where such files come from.
    pub fn fix(&self) -> &'static str {
        match self {
            Self::Missing => {
                "write the file or correct the name, which is relative to the scene file's folder \
                 (`planisphere make` writes the arrays of the example scenes)"
            }
            Self::Io(_) => "make the file readable",
            Self::NotAFile => "name a regular .npy file",
            Self::Format(_) => "write the array with numpy.save(name, array)",
            Self::Type { wanted: "uint8", .. } => "save it as numpy.uint8: numpy.save(name, array.astype('u1'))",
            Self::Type { .. } => "save it as numpy.float32 or float64: numpy.save(name, array.astype('<f4'))",
            Self::BigEndian(_) => "save it as little-endian: numpy.save(name, array.astype('<f4'))",
            Self::Fortran => "save it in C order: numpy.save(name, numpy.ascontiguousarray(array))",
            Self::Length { .. } => "write the file again: it is cut short, or has something after the array",
        }
    }
}

impl From<io::Error> for NpyError {
    fn from(error: io::Error) -> Self {
        if error.kind() == io::ErrorKind::NotFound { Self::Missing } else { Self::Io(error) }
    }
}

/// A mapped array.
pub struct Array {
    bytes: Bytes,
    /// Byte at which the numbers begin.
    offset: usize,
    kind: Kind,
    /// Length of each axis.
    pub shape: Vec<usize>,
}

impl Array {
    /// Maps a file and reads its header; the numbers are not touched.
    ///
    /// # Errors
    /// When it is not a little-endian C-order array of f4, f8 or u1, whole.
    pub fn open(path: &Path) -> Result<Self, NpyError> {
        let file = File::open(path)?;
        if !file.metadata()?.is_file() {
            return Err(NpyError::NotAFile);
        }
        // SAFETY: the map is only read. As with every program that maps its input, the file must not be changed while
        // the program runs; the README says so. A file that is cut short meanwhile ends the program, it cannot
        // corrupt it.
        let map = unsafe { Mmap::map(&file)? };
        Self::from_bytes(Bytes::from_owner(map))
    }

    /// Reads the header of bytes that are already in memory.
    fn from_bytes(bytes: Bytes) -> Result<Self, NpyError> {
        let whole: &[u8] = &bytes;
        let (header, offset) = header_of(whole)?;
        let descr = value_of(header, "descr").and_then(quoted);
        let Some(descr) = descr else {
            return Err(match value_of(header, "descr") {
                Some(text) if text.starts_with('[') => {
                    NpyError::Type { found: "a record".into(), wanted: "one number" }
                }
                _ => NpyError::Format("its header has no 'descr'"),
            });
        };
        let kind = match descr {
            "<f4" => Kind::F32,
            "<f8" => Kind::F64,
            "|u1" | "u1" => Kind::U8,
            other if other.starts_with('>') => return Err(NpyError::BigEndian(other.into())),
            other => {
                return Err(NpyError::Type { found: other.into(), wanted: "little-endian float32, float64 or uint8" });
            }
        };
        let shape = value_of(header, "shape").and_then(tuple).ok_or(NpyError::Format("its header has no 'shape'"))?;
        match value_of(header, "fortran_order") {
            Some(text) if text.starts_with("False") => {}
            // One axis, or none of any length, has the same order both ways.
            Some(text) if text.starts_with("True") && shape.iter().filter(|&&n| n != 1).count() <= 1 => {}
            Some(text) if text.starts_with("True") => return Err(NpyError::Fortran),
            _ => return Err(NpyError::Format("its header has no 'fortran_order'")),
        }

        let found = whole.len() - offset;
        let wanted = shape.iter().try_fold(kind.size(), |bytes, &n| bytes.checked_mul(n)).unwrap_or(usize::MAX);
        if found != wanted {
            return Err(NpyError::Length { found, wanted, shape });
        }
        Ok(Self { bytes, offset, kind, shape })
    }

    /// The shape in NumPy's notation, such as `(100, 3)`.
    pub fn shape_text(&self) -> String {
        match self.shape.as_slice() {
            [one] => format!("({one},)"),
            axes => format!("({})", axes.iter().map(usize::to_string).collect::<Vec<_>>().join(", ")),
        }
    }

    /// The numbers as reals, in place when they are aligned.
    ///
    /// # Errors
    /// When they are bytes.
    pub fn reals(&self) -> Result<Reals, NpyError> {
        let count = self.shape.iter().product();
        match self.kind {
            Kind::F32 => Ok(Reals::F32(self.column(count, f32::from_le_bytes))),
            Kind::F64 => Ok(Reals::F64(self.column(count, f64::from_le_bytes))),
            Kind::U8 => Err(NpyError::Type { found: self.kind.name().into(), wanted: "float32 or float64" }),
        }
    }

    /// The numbers as bytes.
    ///
    /// # Errors
    /// When they are floats.
    pub fn bytes(&self) -> Result<Column<u8>, NpyError> {
        let count = self.shape.iter().product();
        match self.kind {
            Kind::U8 => Ok(self.column(count, |[byte]: [u8; 1]| byte)),
            Kind::F32 | Kind::F64 => Err(NpyError::Type { found: self.kind.name().into(), wanted: "uint8" }),
        }
    }

    /// In place, or copied when an old writer has not aligned the numbers.
    fn column<T: bytemuck::Pod + Send + Sync, const N: usize>(
        &self,
        count: usize,
        read: fn([u8; N]) -> T,
    ) -> Column<T> {
        Column::in_bytes(&self.bytes, self.offset, count).unwrap_or_else(|| {
            let numbers = self.bytes[self.offset..].as_chunks::<N>().0;
            numbers.iter().map(|&bytes| read(bytes)).collect::<Vec<_>>().into()
        })
    }
}

/// The header's text, and where the numbers begin.
pub(super) fn header_of(whole: &[u8]) -> Result<(&str, usize), NpyError> {
    let cut = NpyError::Format("the header is cut short");
    let Some(rest) = whole.strip_prefix(b"\x93NUMPY") else {
        return Err(NpyError::Format("it does not begin with \\x93NUMPY"));
    };
    let (header, offset) = match rest {
        [1, _, a, b, ..] => (usize::from(u16::from_le_bytes([*a, *b])), 10),
        [2 | 3, _, a, b, c, d, ..] => (u32::from_le_bytes([*a, *b, *c, *d]) as usize, 12),
        [1..=3, ..] | [] => return Err(cut),
        _ => return Err(NpyError::Format("its version is not 1, 2 or 3")),
    };
    let Some(header) = whole.get(offset..offset + header) else { return Err(cut) };
    let offset = offset + header.len();
    let header = std::str::from_utf8(header).map_err(|_| NpyError::Format("the header is not text"))?;
    Ok((header, offset))
}

/// What follows `'key':` in the header, a Python dict of literals.
pub(super) fn value_of<'a>(header: &'a str, key: &str) -> Option<&'a str> {
    ['\'', '"'].into_iter().find_map(|quote| {
        let (_, rest) = header.split_once(&format!("{quote}{key}{quote}"))?;
        Some(rest.trim_start().strip_prefix(':')?.trim_start())
    })
}

/// The string literal at the start of a text.
fn quoted(text: &str) -> Option<&str> {
    let quote = text.chars().next().filter(|&c| c == '\'' || c == '"')?;
    text[1..].split_once(quote).map(|(inside, _)| inside)
}

/// The tuple of lengths at the start of a text; Python 2 wrote an L after each.
pub(super) fn tuple(text: &str) -> Option<Vec<usize>> {
    let (inside, _) = text.strip_prefix('(')?.split_once(')')?;
    let items = inside.split(',').map(|item| item.trim().trim_end_matches('L'));
    items.filter(|item| !item.is_empty()).map(|item| item.parse().ok()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(header: &str, data: &[u8]) -> Result<Array, NpyError> {
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((header.len() as u16).to_le_bytes());
        bytes.extend(header.bytes());
        bytes.extend(data);
        Array::from_bytes(bytes.into())
    }

    #[test]
    fn numbers_come_back_whatever_their_alignment() {
        let data: Vec<u8> = [1.5f32, -2.0, 3.25].iter().flat_map(|v| v.to_le_bytes()).collect();
        for padding in 0..9 {
            let header =
                format!("{{'descr': '<f4', 'fortran_order': False, 'shape': (1, 3), }}{}", " ".repeat(padding));
            let array = file(&header, &data).unwrap();
            assert_eq!((array.shape.as_slice(), array.shape_text().as_str()), (&[1, 3][..], "(1, 3)"));
            let reals = array.reals().unwrap();
            assert_eq!([reals.get(0), reals.get(1), reals.get(2)], [1.5, -2.0, 3.25]);
            assert!(array.bytes().is_err());
        }
        let array = file("{'descr':'|u1','fortran_order':False,'shape':(3L,)}", &[7, 8, 9]).unwrap();
        assert_eq!(array.bytes().unwrap().as_slice(), [7, 8, 9]);
        assert_eq!(array.shape_text(), "(3,)");
    }

    #[test]
    fn everything_else_is_refused_in_words() {
        let header = |descr: &str, fortran: &str, shape: &str| {
            format!("{{'descr': {descr}, 'fortran_order': {fortran}, 'shape': {shape}, }}")
        };
        let cases = [
            (header("'>f4'", "False", "(1,)"), "big-endian"),
            (header("'<i4'", "False", "(1,)"), "'<i4'"),
            (header("[('x', '<f4')]", "False", "(1,)"), "a record"),
            (header("'<f4'", "True", "(2, 2)"), "Fortran"),
            (header("'<f4'", "False", "(2,)"), "needs 8"),
            (header("'<f4'", "False", "(0,)"), "needs 0"),
            (header("'<f4'", "False", "(99999999999, 99999999999)"), "needs"),
            (header("'<f4'", "False", "(-1,)"), "'shape'"),
            ("{}".into(), "'descr'"),
        ];
        for (header, wanted) in cases {
            let error = file(&header, &[0; 4]).err().expect("not an array that can be used");
            assert!(error.to_string().contains(wanted), "{error}");
            assert!(!error.fix().is_empty());
        }
        for bytes in [
            &b""[..],
            b"PK\x03\x04",
            b"\x93NUMPY",
            b"\x93NUMPY\x01\x00",
            b"\x93NUMPY\x01\x00\xff\xff",
            b"\x93NUMPY\x09\x00\x00\x00",
        ] {
            assert!(matches!(Array::from_bytes(bytes.into()), Err(NpyError::Format(_))));
        }
    }

    #[test]
    fn fortran_order_of_one_axis_is_no_order() {
        assert!(file("{'descr': '<f4', 'fortran_order': True, 'shape': (1,), }", &[0; 4]).is_ok());
    }
}
