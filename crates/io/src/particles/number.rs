//! Numbers as text: each is read as the nearest 64-bit number, never by way of a shorter one.

use std::ops::Range;

use super::data::is_blank;
use crate::input::report::Fault;
use planisphere_core::text;

/// A real number at the beginning of some bytes, and how many bytes it takes; a blank, or the end,
/// follows it. `inf` and `nan` are numbers; `1.0D+00`, as Fortran writes, is as well.
#[inline]
pub(super) fn leading(bytes: &[u8]) -> Option<(f64, usize)> {
    let (value, length) = fast_float2::parse_partial::<f64, _>(bytes).ok()?;
    match bytes.get(length) {
        None => Some((value, length)),
        Some(&byte) if is_blank(byte) => Some((value, length)),
        Some(b'd' | b'D') => {
            let length = super::data::word(bytes);
            real(&bytes[..length]).map(|value| (value, length))
        }
        Some(_) => None,
    }
}

/// A real number that is all of a cell.
pub(super) fn real(cell: &[u8]) -> Option<f64> {
    if let Ok(value) = fast_float2::parse::<f64, _>(cell) {
        return Some(value);
    }
    // Fortran's letter, between the digits of a number.
    let at = cell.iter().position(|byte| matches!(byte, b'd' | b'D'))?;
    if at == 0 || cell.len() > 64 || !matches!(cell[at - 1], b'0'..=b'9' | b'.') {
        return None;
    }
    let mut copy = [0; 64];
    copy[..cell.len()].copy_from_slice(cell);
    copy[at] = b'e';
    fast_float2::parse::<f64, _>(&copy[..cell.len()]).ok()
}

/// An integer at the beginning of some bytes, and how many bytes it takes; a blank, or the end,
/// follows it.
#[inline]
pub(super) fn leading_integer(bytes: &[u8]) -> Option<(i64, usize)> {
    let sign = matches!(bytes.first(), Some(b'-' | b'+'));
    let digits = &bytes[usize::from(sign)..];
    // Up to 18 digits no sum overflows.
    let mut value = 0i64;
    let mut length = 0;
    while let Some(digit) = digits.get(length).map(|byte| byte.wrapping_sub(b'0'))
        && digit < 10
    {
        if length == 18 {
            let end = super::data::word(bytes);
            return integer(&bytes[..end]).map(|value| (value, end));
        }
        value = 10 * value + i64::from(digit);
        length += 1;
    }
    let ended = digits.get(length).is_none_or(|byte| is_blank(*byte));
    let value = if bytes.first() == Some(&b'-') { -value } else { value };
    (length > 0 && ended).then_some((value, length + usize::from(sign)))
}

/// An integer that is all of a cell.
pub(super) fn integer(cell: &[u8]) -> Option<i64> {
    str::from_utf8(cell).ok()?.parse().ok()
}

/// That a cell is no number.
pub(super) fn not_a_number(what: &str, cell: &[u8], span: Range<usize>) -> Fault {
    let found = text::value(&String::from_utf8_lossy(cell));
    Fault::new(
        format!("`{found}` stands where {what} is expected, which is a number"),
        span,
        format!("no number: {what}"),
        "correct the line, or write the file again",
    )
}

/// That a cell is no integer.
pub(super) fn not_an_integer(what: &str, cell: &[u8], span: Range<usize>) -> Fault {
    let found = text::value(&String::from_utf8_lossy(cell));
    Fault::new(
        format!("`{found}` stands where {what} is expected, which is an integer"),
        span,
        format!("no integer: {what}"),
        "correct the line, or write the file again",
    )
}

/// That a coordinate is not finite.
pub(super) fn not_finite(what: &str, cell: &[u8], span: Range<usize>) -> Fault {
    let found = text::value(&String::from_utf8_lossy(cell));
    let nan_or_inf = cell.iter().any(|byte| matches!(byte, b'n' | b'N'));
    let why = if nan_or_inf { "not finite" } else { "beyond the range of 64-bit floats" };
    Fault::new(
        format!("{what} is `{found}`, which is {why}: there is no such place"),
        span,
        why,
        "correct the number, or leave the particle out of the file",
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_to_the_end_of_their_cell() {
        assert_eq!(leading(b"1.5 2"), Some((1.5, 3)));
        assert_eq!(leading(b"-1.5D+01\t"), Some((-15.0, 8)));
        assert_eq!(leading(b"1d2"), Some((100.0, 3)));
        assert_eq!(leading(b"1.5x"), None);
        assert_eq!(leading(b"x"), None);
        assert_eq!(real(b"0.1"), Some(0.1));
        assert_eq!(real(b"D5"), None);
        assert_eq!(real(b"1D"), None);
        assert!(real(b"nan").is_some_and(f64::is_nan));
        assert_eq!(leading_integer(b"-42 "), Some((-42, 3)));
        assert_eq!(leading_integer(b"+7"), Some((7, 2)));
        assert_eq!(leading_integer(b"7.0"), None);
        assert_eq!(leading_integer(b"-"), None);
        let most = i64::MAX.to_string();
        assert_eq!(leading_integer(most.as_bytes()), Some((i64::MAX, 19)));
        assert_eq!(leading_integer(b"9223372036854775808"), None);
    }
}
