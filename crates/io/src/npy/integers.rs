//! Arrays of integers from files, whatever their width: ids that others compare with.

use super::{
    array::shape_text,
    number::{Kind, Number},
    read::{Descr, header},
};

/// An array of integers of two axes, such as the ids of a picture.
#[derive(Debug)]
pub struct Integers {
    /// All of the file.
    bytes: Vec<u8>,
    /// Where the numbers begin.
    offset: usize,
    number: Number,
    fortran: bool,
    shape: [usize; 2],
}

/// Why bytes are no such array. Its `Display` is to be read after a name, and ends with the fix.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct NotIntegers(String);

/// What to do about any of them.
const FIX: &str = "write it with `planisphere render SCENE --ids FILE.npy`";

impl Integers {
    /// Reads a whole file.
    ///
    /// # Errors
    /// When it is no array, not one of integers, or has not two axes.
    pub fn read(bytes: Vec<u8>) -> Result<Self, NotIntegers> {
        let not = |words: String| NotIntegers(format!("{words}; {FIX}"));
        if bytes.is_empty() {
            return Err(not("is empty".into()));
        }
        if bytes.starts_with(b"version https://git-lfs") {
            let words =
                "is a Git LFS pointer, not the array itself; fetch that with `git lfs pull`";
            return Err(NotIntegers(words.into()));
        }
        let (header, offset) = header(&bytes).map_err(|error| not(error.to_string()))?;
        let number = match &header.descr {
            Descr::One(code) => Number::of(code).map_err(|what| not(format!("holds {what}")))?,
            Descr::Record(_) => return Err(not("holds records, not integers".into())),
        };
        if !matches!(number.kind, Kind::Int | Kind::Uint) {
            return Err(not(format!("holds {}, not integers", number.name())));
        }
        let &[rows, columns] = header.shape.as_slice() else {
            let shape = shape_text(&header.shape);
            return Err(not(format!("has the shape {shape}, not one of rows and columns")));
        };
        let wanted = rows.checked_mul(columns).and_then(|numbers| numbers.checked_mul(number.size));
        let found = bytes.len() - offset;
        if wanted != Some(found) {
            let shape = shape_text(&header.shape);
            let wanted = wanted.map_or("more than there can be".into(), |n| n.to_string());
            return Err(not(format!(
                "holds {found} bytes of numbers, but its shape {shape} needs {wanted}"
            )));
        }
        Ok(Self { bytes, offset, number, fortran: header.fortran, shape: [rows, columns] })
    }

    /// Rows and columns.
    pub fn shape(&self) -> [usize; 2] {
        self.shape
    }

    /// The numbers, row by row.
    pub fn iter(&self) -> impl Iterator<Item = i128> + '_ {
        let [rows, columns] = self.shape;
        (0..rows * columns).map(move |at| {
            let at = if self.fortran { at % columns * rows + at / columns } else { at };
            let start = self.offset + at * self.number.size;
            self.number.integer(&self.bytes[start..start + self.number.size])
        })
    }
}

impl Number {
    /// Reads an integer, of exactly its number of bytes.
    fn integer(self, bytes: &[u8]) -> i128 {
        let mut little = [0; 8];
        little[..self.size].copy_from_slice(bytes);
        if self.big {
            little[..self.size].reverse();
        }
        let wide = u64::from_le_bytes(little);
        let unused = 64 - 8 * self.size as u32;
        match self.kind {
            Kind::Int => i128::from(((wide << unused) as i64) >> unused),
            _ => i128::from(wide),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(descr: &str, fortran: &str, shape: &str, numbers: &[u8]) -> Vec<u8> {
        let text = format!("{{'descr': '{descr}', 'fortran_order': {fortran}, 'shape': {shape}}}");
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((text.len() as u16).to_le_bytes());
        bytes.extend(text.bytes());
        bytes.extend(numbers);
        bytes
    }

    #[test]
    fn integers_of_every_width_are_read() {
        let wanted = [-1, 0, 5, 1, 2, 100];
        let all = |bytes: fn(i64) -> Vec<u8>| wanted.iter().flat_map(|n| bytes(*n)).collect();
        let cases: [(&str, Vec<u8>); 5] = [
            ("|i1", all(|n| vec![n as u8])),
            (">i2", all(|n| (n as i16).to_be_bytes().into())),
            ("<i4", all(|n| (n as i32).to_le_bytes().into())),
            ("<i8", all(|n| n.to_le_bytes().into())),
            (">i8", all(|n| n.to_be_bytes().into())),
        ];
        for (descr, numbers) in cases {
            let found = Integers::read(file(descr, "False", "(2, 3)", &numbers)).unwrap();
            assert_eq!(found.shape(), [2, 3]);
            assert_eq!(found.iter().collect::<Vec<_>>(), wanted.map(i128::from), "{descr}");
        }
        let found = Integers::read(file("|u1", "True", "(2, 3)", &[0, 3, 1, 4, 2, 255])).unwrap();
        assert_eq!(found.iter().collect::<Vec<_>>(), [0, 1, 2, 3, 4, 255]);
        let found = Integers::read(file("<u8", "False", "(1, 1)", &[255; 8])).unwrap();
        assert_eq!(found.iter().collect::<Vec<_>>(), [i128::from(u64::MAX)]);
    }

    #[test]
    fn what_is_no_array_of_ids_is_refused() {
        let cases = [
            (Vec::new(), "is empty"),
            (b"version https://git-lfs.github.com/spec/v1\n".to_vec(), "git lfs pull"),
            (b"PK\x03\x04".to_vec(), "zip archive"),
            (file("<f4", "False", "(1, 1)", &[0; 4]), "float32, not integers"),
            (file("|O", "False", "(1, 1)", &[0; 8]), "Python objects"),
            (file("<i4", "False", "(1,)", &[0; 4]), "shape (1,)"),
            (file("<i4", "False", "(1, 2)", &[0; 4]), "needs 8"),
            (file("<i4", "False", "(1, 18446744073709551615)", &[0; 4]), "than there can be"),
        ];
        for (bytes, words) in cases {
            let error = Integers::read(bytes).unwrap_err().to_string();
            assert!(error.contains(words), "{words}: {error}");
        }
    }
}
