//! Reads the headers of NumPy arrays (`.npy` files).
//!
//! The format: NEP 1, "A simple file format for NumPy arrays". The header is a Python literal, and
//! is read as one. This file knows nothing of scenes, and of no file more than its bytes.

#[cfg(target_endian = "big")]
compile_error!("arrays are used in place as little-endian numbers: this machine's are big-endian");

/// Why bytes are no array. Its `Display` is to be read after a name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum NotNpy {
    #[error("is not an .npy file: it is a zip archive, as numpy.savez writes")]
    Zip,
    #[error("is not an .npy file: it is compressed")]
    Compressed,
    #[error("is not an .npy file: it is a pickle")]
    Pickle,
    #[error("is not an .npy file: it is an HDF5 file")]
    Hdf5,
    /// Says what is wrong with it.
    #[error("is not an .npy file: {0}")]
    Bad(&'static str),
}

/// Bytes of a header, at most: NumPy's own are some hundred.
const LONGEST: usize = 1 << 20;

/// A header that ends too early.
const CUT: NotNpy = NotNpy::Bad("the header is cut short");

/// What a header says.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Header {
    /// The type of an element.
    pub descr: Descr,
    /// Whether the first index runs fastest.
    pub fortran: bool,
    /// Length of each axis.
    pub shape: Vec<usize>,
}

/// The type of an element, as NumPy writes it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Descr {
    /// Such as `<f4`.
    One(String),
    /// Named fields.
    Record(Vec<Field>),
}

/// A field of a record.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Field {
    pub name: String,
    pub descr: Descr,
    /// Of arrays inside the record; empty for one value.
    pub shape: Vec<usize>,
}

/// What bytes are that are no array, by the first of them.
fn other_format(whole: &[u8]) -> NotNpy {
    match whole {
        [b'P', b'K', 3 | 5, ..] => NotNpy::Zip,
        [0x1f, 0x8b, ..] => NotNpy::Compressed,
        [0x80, 2..=5, ..] => NotNpy::Pickle,
        [0x89, b'H', b'D', b'F', ..] => NotNpy::Hdf5,
        _ => NotNpy::Bad("it does not begin with \\x93NUMPY"),
    }
}

/// Where the header's text begins and ends, from the first twelve bytes of an array, or all of a
/// shorter one.
pub(crate) fn extent(whole: &[u8]) -> Result<(usize, usize), NotNpy> {
    if whole.is_empty() {
        return Err(NotNpy::Bad("it is empty"));
    }
    let rest = whole.strip_prefix(b"\x93NUMPY").ok_or_else(|| other_format(whole))?;
    let (length, start) = match rest {
        [1, _, a, b, ..] => (usize::from(u16::from_le_bytes([*a, *b])), 10),
        [2 | 3, _, a, b, c, d, ..] => (u32::from_le_bytes([*a, *b, *c, *d]) as usize, 12),
        [1..=3, ..] | [] => return Err(CUT),
        _ => return Err(NotNpy::Bad("its version is not 1, 2 or 3")),
    };
    if length > LONGEST {
        return Err(NotNpy::Bad("its header is longer than 1 MiB"));
    }
    Ok((start, start + length))
}

/// Reads the header, and says where the numbers begin.
pub(crate) fn header(whole: &[u8]) -> Result<(Header, usize), NotNpy> {
    let bad = NotNpy::Bad;
    let (start, end) = extent(whole)?;
    let text = whole.get(start..end).ok_or(CUT)?;
    // Versions 1 and 2 are Latin-1, whose letters are the first of Unicode.
    let latin = || text.iter().map(|&byte| char::from(byte)).collect::<String>();
    let text = match whole[6] {
        3 => std::str::from_utf8(text).map_err(|_| bad("the header is not text"))?.to_owned(),
        _ => latin(),
    };
    let entries = match Literal::read(&text) {
        Some(Literal::Dict(entries)) => entries,
        _ => return Err(bad("its header is no Python dict")),
    };
    let get = |key: &str| {
        entries
            .iter()
            .find(|(k, _)| matches!(k, Literal::Text(text) if text == key))
            .map(|(_, v)| v)
    };
    let descr = get("descr").ok_or_else(|| bad("its header has no 'descr'"))?;
    let descr = descr.descr().ok_or_else(|| bad("its header has no 'descr' that is a type"))?;
    let shape =
        get("shape").and_then(Literal::lengths).ok_or_else(|| bad("its header has no 'shape'"))?;
    let Some(Literal::Truth(fortran)) = get("fortran_order") else {
        return Err(bad("its header has no 'fortran_order'"));
    };
    Ok((Header { descr, fortran: *fortran, shape }, end))
}

/// A Python literal, of the kinds that headers are made of.
#[derive(Clone, Debug, PartialEq)]
enum Literal {
    Text(String),
    Number(u64),
    Truth(bool),
    /// A list or a tuple.
    List(Vec<Literal>),
    Dict(Vec<(Literal, Literal)>),
}

/// Brackets inside brackets, at most.
const DEEPEST: usize = 16;

impl Literal {
    fn read(text: &str) -> Option<Self> {
        let (literal, rest) = Self::first(text.trim_start(), DEEPEST)?;
        rest.trim().is_empty().then_some(literal)
    }

    /// The literal at the start of a text, and what follows it.
    fn first(text: &str, depth: usize) -> Option<(Self, &str)> {
        let depth = depth.checked_sub(1)?;
        let mut chars = text.chars();
        match chars.next()? {
            '(' => Self::items(chars.as_str(), ')', depth)
                .map(|(items, rest)| (Self::List(items), rest)),
            '[' => Self::items(chars.as_str(), ']', depth)
                .map(|(items, rest)| (Self::List(items), rest)),
            '{' => Self::entries(chars.as_str(), depth),
            'b' | 'u' if text[1..].starts_with(['\'', '"']) => Self::text(&text[1..]),
            '\'' | '"' => Self::text(text),
            '0'..='9' => {
                let end = text.find(|c: char| !c.is_ascii_digit()).unwrap_or(text.len());
                let rest = &text[end..];
                // Python 2 wrote an L after long integers.
                Some((
                    Self::Number(text[..end].parse().ok()?),
                    rest.strip_prefix('L').unwrap_or(rest),
                ))
            }
            _ => [("True", true), ("False", false)]
                .into_iter()
                .find_map(|(word, truth)| Some((Self::Truth(truth), text.strip_prefix(word)?))),
        }
    }

    fn items(text: &str, close: char, depth: usize) -> Option<(Vec<Self>, &str)> {
        let (mut items, mut rest) = (Vec::new(), text.trim_start());
        loop {
            if let Some(rest) = rest.strip_prefix(close) {
                return Some((items, rest));
            }
            let (item, after) = Self::first(rest, depth)?;
            items.push(item);
            rest = after.trim_start();
            match rest.strip_prefix(',') {
                Some(after) => rest = after.trim_start(),
                None if rest.starts_with(close) => {}
                None => return None,
            }
        }
    }

    fn entries(text: &str, depth: usize) -> Option<(Self, &str)> {
        let (mut entries, mut rest) = (Vec::new(), text.trim_start());
        loop {
            if let Some(rest) = rest.strip_prefix('}') {
                return Some((Self::Dict(entries), rest));
            }
            let (key, after) = Self::first(rest, depth)?;
            let (value, after) =
                Self::first(after.trim_start().strip_prefix(':')?.trim_start(), depth)?;
            entries.push((key, value));
            rest = after.trim_start();
            match rest.strip_prefix(',') {
                Some(after) => rest = after.trim_start(),
                None if rest.starts_with('}') => {}
                None => return None,
            }
        }
    }

    fn text(text: &str) -> Option<(Self, &str)> {
        let mut chars = text.chars();
        let quote = chars.next()?;
        let mut found = String::new();
        loop {
            match chars.next()? {
                c if c == quote => return Some((Self::Text(found), chars.as_str())),
                '\\' => {
                    let digits = match chars.next()? {
                        c @ ('\\' | '\'' | '"') => {
                            found.push(c);
                            continue;
                        }
                        'n' => {
                            found.push('\n');
                            continue;
                        }
                        't' => {
                            found.push('\t');
                            continue;
                        }
                        'r' => {
                            found.push('\r');
                            continue;
                        }
                        'x' => 2,
                        'u' => 4,
                        'U' => 8,
                        _ => return None,
                    };
                    let code = chars.as_str().get(..digits)?;
                    found.push(char::from_u32(u32::from_str_radix(code, 16).ok()?)?);
                    chars = chars.as_str()[digits..].chars();
                }
                c => found.push(c),
            }
        }
    }

    fn lengths(&self) -> Option<Vec<usize>> {
        let Self::List(items) = self else { return None };
        let length =
            |item: &Self| if let Self::Number(n) = item { usize::try_from(*n).ok() } else { None };
        items.iter().map(length).collect()
    }

    fn descr(&self) -> Option<Descr> {
        match self {
            Self::Text(code) => Some(Descr::One(code.clone())),
            Self::List(items) => {
                items.iter().map(Self::field).collect::<Option<_>>().map(Descr::Record)
            }
            _ => None,
        }
    }

    /// `(name, type)` or `(name, type, shape)`; a name may be `(title, name)`.
    fn field(&self) -> Option<Field> {
        let Self::List(items) = self else { return None };
        let (name, descr, shape) = match items.as_slice() {
            [name, descr] => (name, descr, Vec::new()),
            [name, descr, Self::Number(n)] => (name, descr, vec![usize::try_from(*n).ok()?]),
            [name, descr, shape] => (name, descr, shape.lengths()?),
            _ => return None,
        };
        let name = match name {
            Self::List(both) => both.get(1)?,
            name => name,
        };
        let Self::Text(name) = name else { return None };
        Some(Field { name: name.clone(), descr: descr.descr()?, shape })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(header: &str, version: u8) -> Vec<u8> {
        let mut bytes = b"\x93NUMPY".to_vec();
        bytes.extend([version, 0]);
        match version {
            1 => bytes.extend((header.len() as u16).to_le_bytes()),
            _ => bytes.extend((header.len() as u32).to_le_bytes()),
        }
        bytes.extend(header.bytes());
        bytes
    }

    #[test]
    fn headers_are_python() {
        let one = |code: &str| Descr::One(code.into());
        let field = |name: &str, code: &str, shape: &[usize]| Field {
            name: name.into(),
            descr: one(code),
            shape: shape.into(),
        };
        let cases = [
            (
                "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }   \n",
                one("<f4"),
                false,
                vec![2, 3],
            ),
            ("{\"shape\":(3L,),'fortran_order':True,'descr':'|u1'}", one("|u1"), true, vec![3]),
            ("{'descr': '<f8', 'fortran_order': False, 'shape': (), }", one("<f8"), false, vec![]),
            (
                "{'descr': [('shape', '<f4'), (('a title', 'descr'), '>i2', (3,)), ('it\\'s', \
                 '|V4')], 'fortran_order': False, 'shape': (7,), }",
                Descr::Record(vec![
                    field("shape", "<f4", &[]),
                    field("descr", ">i2", &[3]),
                    field("it's", "|V4", &[]),
                ]),
                false,
                vec![7],
            ),
        ];
        for (text, descr, fortran, shape) in cases {
            for version in [1, 2, 3] {
                let bytes = file(text, version);
                let (found, end) = header(&bytes).unwrap();
                assert_eq!(
                    found,
                    Header { descr: descr.clone(), fortran, shape: shape.clone() },
                    "{text}"
                );
                assert_eq!(end, bytes.len());
            }
        }
    }

    #[test]
    fn what_is_no_header_is_refused_in_words() {
        let cases = [
            ("{}", "'descr'"),
            ("", "no Python dict"),
            ("{'descr': '<f4'", "no Python dict"),
            ("{'descr': '<f4', 'fortran_order': False, 'shape': (-1,)}", "no Python dict"),
            ("{'descr': '<f4', 'fortran_order': False, 'shape': 3}", "'shape'"),
            ("{'descr': '<f4', 'fortran_order': 0, 'shape': (3,)}", "'fortran_order'"),
            ("{'descr': 4, 'fortran_order': False, 'shape': (3,)}", "'descr'"),
            ("[[[[[[[[[[[[[[[[[[[[[[", "no Python dict"),
        ];
        for (text, wanted) in cases {
            let refused = header(&file(text, 1)).expect_err("no header");
            assert!(refused.to_string().contains(wanted), "{text}: {refused:?}");
        }
        for bytes in [
            &b""[..],
            b"PK\x03\x04",
            b"\x93NUMPY",
            b"\x93NUMPY\x01\x00",
            b"\x93NUMPY\x01\x00\xff\xff",
            b"\x93NUMPY\x02\x00\xff\xff\xff\xff",
            b"\x93NUMPY\x09\x00\x00\x00",
        ] {
            let words = header(bytes).expect_err("no header").to_string();
            assert!(words.starts_with("is not an .npy file: "), "{words}");
        }
    }
}
