//! The types of NumPy's arrays: their sizes, and single numbers of every type that NumPy knows.

use half::f16;

use super::read::{Descr, Field};

impl Descr {
    /// Bytes of an element.
    pub fn size(&self) -> Option<usize> {
        match self {
            Self::One(code) => {
                let code = code.trim_start_matches(['<', '>', '|', '=']);
                let letter = code.chars().next()?;
                let digits = &code[letter.len_utf8()..];
                let digits = digits.split_once('[').map_or(digits, |(digits, _)| digits);
                match letter {
                    'O' => Some(8),
                    'U' => digits.parse::<usize>().ok()?.checked_mul(4),
                    _ => digits.parse().ok(),
                }
            }
            Self::Record(fields) => {
                fields.iter().try_fold(0usize, |sum, field| sum.checked_add(field.size()?))
            }
        }
    }
}

impl Field {
    /// Bytes in the record.
    pub fn size(&self) -> Option<usize> {
        self.shape.iter().try_fold(self.descr.size()?, |bytes, &n| bytes.checked_mul(n))
    }
}

/// What kind of numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Bool,
    Int,
    Uint,
    /// IEEE 754, of 2, 4 or 8 bytes.
    Float,
    /// Whatever C calls so where the file was written: of 12 or 16 bytes.
    LongDouble,
    /// Two floats, the real part first.
    Complex,
}

/// A type of numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Number {
    pub kind: Kind,
    /// Bytes.
    pub size: usize,
    /// Whether the greatest byte comes first.
    pub big: bool,
}

impl Number {
    /// Reads NumPy's code.
    ///
    /// # Errors
    /// What it is instead, when these are no numbers.
    pub fn of(code: &str) -> Result<Self, String> {
        let (big, rest) = match code.as_bytes().first() {
            Some(b'>') => (true, &code[1..]),
            Some(b'<' | b'|' | b'=') => (false, &code[1..]),
            _ => (false, code),
        };
        let kind = match rest.as_bytes() {
            b"b1" => Kind::Bool,
            b"i1" | b"i2" | b"i4" | b"i8" => Kind::Int,
            b"u1" | b"u2" | b"u4" | b"u8" => Kind::Uint,
            b"f2" | b"f4" | b"f8" => Kind::Float,
            b"f12" | b"f16" => Kind::LongDouble,
            b"c8" | b"c16" => Kind::Complex,
            _ => {
                return Err(match rest.as_bytes().first() {
                    Some(b'O') => "Python objects".into(),
                    Some(b'S' | b'a' | b'U') => "text".into(),
                    Some(b'M') => "dates".into(),
                    Some(b'm') => "durations".into(),
                    Some(b'V') => "bytes without a type".into(),
                    _ => format!("elements of type '{}'", code.escape_default()),
                });
            }
        };
        let size = rest[1..].parse().map_err(|_| String::from("elements of no size"))?;
        Ok(Self { kind, size, big: big && size > 1 })
    }

    /// NumPy's name.
    pub fn name(self) -> String {
        let bits = 8 * self.size;
        let name = match self.kind {
            Kind::Bool => "bool".into(),
            Kind::Int => format!("int{bits}"),
            Kind::Uint => format!("uint{bits}"),
            Kind::Float => format!("float{bits}"),
            Kind::LongDouble => "longdouble".into(),
            Kind::Complex => format!("complex{bits}"),
        };
        if self.big { format!("big-endian {name}") } else { name }
    }

    /// Whether each number is a 32-bit float.
    pub fn fits_f32(self) -> bool {
        match self.kind {
            Kind::Bool => true,
            Kind::Int | Kind::Uint => self.size <= 2,
            Kind::Float => self.size <= 4,
            Kind::LongDouble | Kind::Complex => false,
        }
    }

    /// Whether each number is a 64-bit float.
    pub fn fits_f64(self) -> bool {
        match self.kind {
            Kind::Int | Kind::Uint => self.size <= 4,
            Kind::Bool | Kind::Float => true,
            Kind::LongDouble | Kind::Complex => false,
        }
    }

    /// Reads one, of exactly its number of bytes: a 64-bit float next to it, and whether that is
    /// the number itself. Of a complex number it reads the real part.
    #[inline]
    pub fn read(self, bytes: &[u8]) -> (f64, bool) {
        let mut little = [0; 16];
        little[..self.size].copy_from_slice(bytes);
        if self.big {
            little[..self.size].reverse();
        }
        let wide = u64::from_le_bytes(little[..8].try_into().expect("8 bytes"));
        match (self.kind, self.size) {
            (Kind::Bool, _) => (f64::from(u8::from(wide != 0)), true),
            (Kind::Uint, _) => (wide as f64, fits(wide)),
            (Kind::Int, size) => {
                let unused = 64 - 8 * size as u32;
                let value = ((wide << unused) as i64) >> unused;
                (value as f64, fits(value.unsigned_abs()))
            }
            (Kind::Float, 2) => (f16::from_bits(wide as u16).to_f64(), true),
            (Kind::Float, 4) | (Kind::Complex, 8) => (f64::from(f32::from_bits(wide as u32)), true),
            (Kind::Float | Kind::Complex, _) => (f64::from_bits(wide), true),
            (Kind::LongDouble, _) => {
                extended(wide, u16::from_le_bytes([little[8], little[9]])).unwrap_or((0.0, false))
            }
        }
    }
}

/// Whether a 64-bit float is the same integer: from its first bit to its last there are at most 53.
fn fits(integer: u64) -> bool {
    integer >> 53 == 0 || 64 - integer.leading_zeros() - integer.trailing_zeros() <= 53
}

/// A number of the x87's 80 bits: a 64-bit float next to it, and whether that is the number itself.
/// Nothing where the bits are no number.
fn extended(fraction: u64, sign_and_exponent: u16) -> Option<(f64, bool)> {
    let exponent = i32::from(sign_and_exponent & 0x7fff);
    let sign = if sign_and_exponent >> 15 == 1 { -1.0 } else { 1.0 };
    if exponent == 0x7fff {
        return Some((if fraction << 1 == 0 { sign * f64::INFINITY } else { f64::NAN }, true));
    }
    if exponent > 0 && fraction >> 63 == 0 {
        // Every number but those next to zero has its first bit.
        return None;
    }
    if fraction == 0 {
        return Some((sign * 0.0, true));
    }
    let zeros = fraction.trailing_zeros();
    let (odd, power) = (fraction >> zeros, exponent.max(1) - 16383 - 63 + zeros as i32);
    let bits = (64 - odd.leading_zeros()) as i32;
    let exact = bits <= 53 && power >= -1074 && power + bits <= 1024;
    let power = power.clamp(-2200, 2200);
    // Of an exact one each step is exact: the first two stay among normal numbers.
    let third = power / 3;
    let scaled = [third, third, power - 2 * third]
        .iter()
        .fold(odd as f64, |value, &p| value * f64::powi(2.0, p));
    Some((sign * scaled, exact))
}

/// Whether long doubles can be told to be the x87's: one machine's file does not say how another
/// one's are meant. These have 10 bytes and nothing in the others, or bits that only a number of 80
/// bits has, all of them numbers.
pub(crate) fn are_extended<'a>(numbers: impl Iterator<Item = &'a [u8]>) -> bool {
    let (mut padded, mut round) = (true, true);
    for bytes in numbers {
        let fraction = u64::from_le_bytes(bytes[..8].try_into().expect("at least 10 bytes"));
        if extended(fraction, u16::from_le_bytes([bytes[8], bytes[9]])).is_none() {
            return false;
        }
        padded &= bytes[10..].iter().all(|&byte| byte == 0);
        // The last 60 of a 128-bit float that is a 64-bit float as well.
        round &= fraction << 4 == 0;
    }
    padded || !round
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn types_have_sizes() {
        let sizes = [
            ("<f4", Some(4)),
            ("|U7", Some(28)),
            ("|O", Some(8)),
            ("<M8[ns]", Some(8)),
            ("x", None),
        ];
        for (code, size) in sizes {
            assert_eq!(Descr::One(code.into()).size(), size, "{code}");
        }
    }

    #[test]
    fn numbers_of_every_type() {
        let cases: [(&str, &[u8], (f64, bool)); 16] = [
            ("|b1", &[1], (1.0, true)),
            ("|i1", &[0xfe], (-2.0, true)),
            (">i2", &[0xff, 0x00], (-256.0, true)),
            ("<u2", &[0x01, 0x80], (32769.0, true)),
            ("<i4", &[0, 0, 0, 0x80], (-2147483648.0, true)),
            (">u4", &[0xff; 4], (4294967295.0, true)),
            ("<i8", &[1, 0, 0, 0, 0, 0, 0x20, 0], (9007199254740992.0, false)),
            ("<i8", &[0, 0, 0, 0, 0, 0, 0, 0x80], (-9223372036854775808.0, true)),
            ("<u8", &[0xff; 8], (18446744073709551616.0, false)),
            ("<f2", &[0x00, 0xbc], (-1.0, true)),
            (">f2", &[0x00, 0x01], (2f64.powi(-24), true)),
            ("=f4", &[0, 0, 0xc0, 0x3f], (1.5, true)),
            (">f8", &[0x3f, 0xb9, 0x99, 0x99, 0x99, 0x99, 0x99, 0x9a], (0.1, true)),
            ("<c8", &[0, 0, 0xc0, 0x3f, 9, 9, 9, 9], (1.5, true)),
            ("<f12", &[0, 0, 0, 0, 0, 0, 0, 0xc0, 0xff, 0xbf, 7, 7], (-1.5, true)),
            ("<f16", &[1, 0, 0, 0, 0, 0, 0, 0x80, 0xff, 0x3f, 0, 0, 0, 0, 0, 0], (1.0, false)),
        ];
        for (code, bytes, wanted) in cases {
            assert_eq!(Number::of(code).unwrap().read(bytes), wanted, "{code}");
        }
        for code in ["|O", "<U4", "|S3", "<M8[ns]", "<m8", "|V3", "<q4", "", "<", "<f3", ">é"] {
            assert!(Number::of(code).is_err(), "{code}");
        }
    }

    #[test]
    fn extended_numbers() {
        let one = 0x8000_0000_0000_0000;
        assert_eq!(extended(one, 0x3fff), Some((1.0, true)));
        assert_eq!(
            extended(0, 0x8000).map(|(zero, exact)| (zero.is_sign_negative(), exact)),
            Some((true, true))
        );
        assert_eq!(extended(one, 0x7fff), Some((f64::INFINITY, true)));
        assert!(extended(one | 5, 0x7fff).unwrap().0.is_nan());
        // The least and the greatest 64-bit float, and what is beyond.
        assert_eq!(extended(one, (16383 - 1074) as u16), Some((5e-324, true)));
        assert!(!extended(one, (16383 - 1075) as u16).unwrap().1);
        assert_eq!(extended(0xffff_ffff_ffff_f800, (16383 + 1023) as u16), Some((f64::MAX, true)));
        assert!(!extended(one, (16383 + 1024) as u16).unwrap().1);
        assert!(!extended(1, 0).unwrap().1);
        // Not numbers: the first bit is missing.
        assert_eq!(extended(1, 0x3fff), None);
        assert_eq!(extended(0, 0x3fff), None);
        for value in [0.1, -1e300, 1e-310, 3.0f64] {
            let bits = value.abs().to_bits();
            let (exponent, fraction) = ((bits >> 52) as i32, bits & ((1 << 52) - 1));
            let fraction = if exponent == 0 { fraction } else { fraction | 1 << 52 };
            let shift = fraction.leading_zeros();
            let exponent = exponent.max(1) - 1023 + 16383 - (shift as i32 - 11);
            let sign = if value < 0.0 { 0x8000 } else { 0 };
            assert_eq!(extended(fraction << shift, exponent as u16 | sign), Some((value, true)));
        }
        // Of another machine: the bytes of 128-bit floats.
        let quad = |low: u64, high: u64| [low.to_le_bytes(), high.to_le_bytes()].concat();
        let five = quad(0, 0x4001_4000_0000_0000);
        let tenth = quad(0xa000_0000_0000_0000, 0x3ffb_9999_9999_9999);
        assert!(!are_extended([&five[..], &tenth].into_iter()));
        assert!(are_extended([&quad(one, 0x3fff)[..], &quad(0, 0)].into_iter()));
        assert!(are_extended([&quad(0xcccc_cccc_cccc_d000, 0x77_3ffb)[..]].into_iter()));
        assert!(!are_extended([&quad(one, 0x77_3fff)[..]].into_iter()));
    }
}
