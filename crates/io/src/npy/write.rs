//! Writes planes as NumPy arrays (`.npy`, version 1.0): little-endian, C order.

use std::io::{self, Write};

#[cfg(target_endian = "big")]
compile_error!(
    "planes are written as they lie in memory, as little-endian numbers: this machine's are \
     big-endian"
);

/// Numbers as the bytes that follow a header.
#[derive(Clone, Debug)]
pub struct Plane<T>(pub Vec<T>);

impl<T: bytemuck::Pod> AsRef<[u8]> for Plane<T> {
    fn as_ref(&self) -> &[u8] {
        bytemuck::cast_slice(&self.0)
    }
}

/// Writes numbers of a shape as int32.
///
/// # Errors
/// The writer's; of the kind `InvalidInput` when there are not as many numbers as the shape has.
pub fn write_i32(out: &mut dyn Write, shape: &[usize], numbers: &[i32]) -> io::Result<()> {
    write(out, "<i4", shape, numbers)
}

/// Writes numbers of a shape as float32.
///
/// # Errors
/// As [`write_i32`].
pub fn write_f32(out: &mut dyn Write, shape: &[usize], numbers: &[f32]) -> io::Result<()> {
    write(out, "<f4", shape, numbers)
}

fn write<T: bytemuck::Pod>(
    out: &mut dyn Write,
    descr: &str,
    shape: &[usize],
    numbers: &[T],
) -> io::Result<()> {
    if shape.iter().product::<usize>() != numbers.len() {
        let words = format!("{} numbers are not an array of shape {shape:?}", numbers.len());
        return Err(io::Error::new(io::ErrorKind::InvalidInput, words));
    }
    out.write_all(&header(descr, shape))?;
    out.write_all(bytemuck::cast_slice(numbers))
}

/// The header of an array: magic, version, and the dict that NumPy reads, filled up so that the
/// numbers begin at a multiple of 64 bytes.
pub fn header(descr: &str, shape: &[usize]) -> Vec<u8> {
    header_of(&format!("'{descr}'"), shape)
}

/// The header of an array of records, each of fields with a name and a type, one after the other.
pub fn record_header(fields: &[(&str, &str)], shape: &[usize]) -> Vec<u8> {
    let fields: Vec<String> =
        fields.iter().map(|(name, descr)| format!("('{name}', '{descr}')")).collect();
    header_of(&format!("[{}]", fields.join(", ")), shape)
}

fn header_of(descr: &str, shape: &[usize]) -> Vec<u8> {
    let axes: String = shape.iter().map(|n| format!("{n}, ")).collect();
    // NumPy itself writes (3,) and (2, 3).
    let axes = if shape.len() == 1 { axes.trim_end() } else { axes.trim_end_matches([',', ' ']) };
    let mut dict = format!("{{'descr': {descr}, 'fortran_order': False, 'shape': ({axes}), }}");
    let start = 10;
    let padding = 63 - (start + dict.len()) % 64;
    dict.extend(std::iter::repeat_n(' ', padding));
    dict.push('\n');
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((dict.len() as u16).to_le_bytes());
    bytes.extend(dict.bytes());
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headers_are_numpys() {
        let mut out = Vec::new();
        write_i32(&mut out, &[2, 3], &[1, -1, 0, 4, 5, 6]).unwrap();
        assert_eq!(out.len(), 128 + 24);
        assert_eq!(&out[..10], b"\x93NUMPY\x01\x00\x76\x00");
        assert!(
            out[10..].starts_with(b"{'descr': '<i4', 'fortran_order': False, 'shape': (2, 3), } ")
        );
        assert_eq!(out[127], b'\n');
        assert_eq!(out[128..136], [1, 0, 0, 0, 255, 255, 255, 255]);
        let wrong = write_f32(&mut Vec::new(), &[2, 2], &[0.0; 5]).unwrap_err();
        assert_eq!(
            (wrong.kind(), wrong.to_string().contains("[2, 2]")),
            (io::ErrorKind::InvalidInput, true)
        );
        assert!(
            header("<f4", &[7])[10..]
                .starts_with(b"{'descr': '<f4', 'fortran_order': False, 'shape': (7,), }")
        );
    }
}
