//! Takes typed values out of a TOML document; every fault knows its place. This file knows TOML, not scenes.

use std::ops::Range;

use glam::DVec3;
use toml::{
    Spanned,
    de::{DeString, DeTable, DeValue},
};

use super::report::Fault;

/// A value with its place.
pub(super) type Value<'i> = Spanned<DeValue<'i>>;

/// A table of which every key is known.
pub(super) struct Section<'t, 'i> {
    /// Where it stands: its header, or its braces.
    pub span: Range<usize>,
    table: &'t DeTable<'i>,
}

impl<'t, 'i> Section<'t, 'i> {
    /// Takes a value that must be a table, and refuses keys that are not `known`.
    pub fn new(name: &str, value: &'t Value<'i>, known: &[&str]) -> Result<Self, Fault> {
        match value.get_ref() {
            DeValue::Table(table) => Self::of_table(name, table, value.span(), known),
            other => {
                let key = name.trim_matches(['[', ']']);
                let (fix, shown) = match other {
                    DeValue::Array(_) => (format!("there is one {name}: write it with single brackets"), "a list"),
                    _ => (format!("write {name} on a line of its own, and `key = value` lines below it"), kind(other)),
                };
                Err(Fault::new(format!("`{key}` is {shown}, but a table is needed"), value.span(), "not a table", fix))
            }
        }
    }

    /// The same, of the table itself.
    pub fn of_table(name: &str, table: &'t DeTable<'i>, span: Range<usize>, known: &[&str]) -> Result<Self, Fault> {
        let unknown = table.keys().filter(|key| !known.contains(&key.get_ref().as_ref()));
        if let Some(key) = unknown.min_by_key(|key| key.span().start) {
            return Err(unknown_key(name, key, known));
        }
        Ok(Self { span, table })
    }

    /// The value of a key.
    pub fn get(&self, key: &str) -> Option<&'t Value<'i>> {
        self.table.get(key)
    }

    /// The value of a key as something.
    pub fn read<T>(&self, key: &str, read: fn(&str, &Value) -> Result<T, Fault>) -> Result<Option<T>, Fault> {
        self.get(key).map(|value| read(key, value)).transpose()
    }

    /// Where a key's value stands, or the whole section where it has none.
    pub fn place(&self, key: &str) -> Range<usize> {
        self.get(key).map_or(self.span.clone(), Spanned::span)
    }

    /// Refuses two keys that say the same thing in two ways.
    pub fn not_both(&self, first: &str, second: &str) -> Result<(), Fault> {
        match (self.get(first), self.get(second)) {
            (Some(a), Some(b)) => Err(Fault::new(
                format!("both `{first}` and `{second}` are given"),
                b.span(),
                "one too many",
                format!("remove `{first}` or `{second}`"),
            )
            .and(a.span(), "the other one")),
            _ => Ok(()),
        }
    }
}

fn unknown_key(name: &str, key: &Spanned<DeString>, known: &[&str]) -> Fault {
    let found = key.get_ref().as_ref();
    let nearest = known.iter().map(|k| (distance(found, k), *k)).min();
    let fix = match nearest {
        Some((steps, like)) if steps <= 1 + like.len() / 3 => format!("did you mean `{like}`?"),
        _ => format!("remove it; the keys here are {}", known.join(", ")),
    };
    let inside = if name.is_empty() { String::new() } else { format!(" in {name}") };
    Fault::new(format!("unknown key `{found}`{inside}"), key.span(), "unknown", fix)
}

/// Number of letters to insert, remove, replace or swap with their neighbour to get from one word to the other.
fn distance(a: &str, b: &str) -> usize {
    let (a, b): (Vec<char>, Vec<char>) = (a.chars().collect(), b.chars().collect());
    // Row i holds the distances of a[..i] from every start of b; the last three rows are kept.
    let mut rows = [vec![0; b.len() + 1], vec![0; b.len() + 1], (0..=b.len()).collect::<Vec<_>>()];
    for i in 1..=a.len() {
        rows.rotate_left(1);
        rows[2][0] = i;
        for j in 1..=b.len() {
            let replaced = rows[1][j - 1] + usize::from(!a[i - 1].eq_ignore_ascii_case(&b[j - 1]));
            let mut least = replaced.min(rows[1][j] + 1).min(rows[2][j - 1] + 1);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                least = least.min(rows[0][j - 2] + 1);
            }
            rows[2][j] = least;
        }
    }
    rows[2][b.len()]
}

/// What a value is, for people.
fn kind(value: &DeValue) -> &'static str {
    match value {
        DeValue::String(_) => "a string",
        DeValue::Integer(_) => "an integer",
        DeValue::Float(_) => "a number",
        DeValue::Boolean(_) => "a boolean",
        DeValue::Datetime(_) => "a date",
        DeValue::Array(_) => "a list",
        DeValue::Table(_) => "a table",
    }
}

fn wrong_type(key: &str, value: &Value, wanted: &str, example: &str) -> Fault {
    Fault::new(
        format!("`{key}` is {}, but {wanted} is needed", kind(value.get_ref())),
        value.span(),
        format!("not {wanted}"),
        format!("write {example}"),
    )
}

/// A finite number, the nearest f64; an integer must be one exactly.
pub(super) fn number(key: &str, value: &Value) -> Result<f64, Fault> {
    match value.get_ref() {
        DeValue::Float(float) => match float.as_str().parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(number),
            _ if float.as_str().contains(['n', 'N']) => {
                let fix = match key {
                    "far" => "leave `far` out: then there is no far plane",
                    _ => "write a finite number",
                };
                Err(Fault::new(
                    format!("`{key}` is {}, not a finite number", float.as_str()),
                    value.span(),
                    "not finite",
                    fix,
                ))
            }
            _ => Err(Fault::new(
                format!("`{key}` is beyond the range of 64-bit floats"),
                value.span(),
                "too large",
                "write a number below 1.797e308",
            )),
        },
        DeValue::Integer(integer) => {
            let exact = i64::from_str_radix(integer.as_str(), integer.radix()).ok();
            exact.filter(|&n| (n as f64) as i128 == i128::from(n)).map(|n| n as f64).ok_or_else(|| {
                Fault::new(
                    format!("`{key}` is an integer that no 64-bit float equals"),
                    value.span(),
                    "not exact",
                    "write it with a decimal point, such as 1.0e20; it is then rounded to the nearest 64-bit float",
                )
            })
        }
        _ => Err(wrong_type(key, value, "a number", &format!("{key} = 1.0"))),
    }
}

/// Three finite numbers.
pub(super) fn vector(key: &str, value: &Value) -> Result<DVec3, Fault> {
    let example = || format!("{key} = [1.0, 0.0, 0.0]");
    let DeValue::Array(items) = value.get_ref() else {
        return Err(wrong_type(key, value, "a list of three numbers", &example()));
    };
    let [x, y, z] = &**items else {
        return Err(Fault::new(
            format!("`{key}` has {} numbers, but three are needed", items.len()),
            value.span(),
            "not three numbers",
            format!("write {}", example()),
        ));
    };
    Ok(DVec3::new(number(key, x)?, number(key, y)?, number(key, z)?))
}

/// A string.
pub(super) fn string(key: &str, value: &Value) -> Result<String, Fault> {
    match value.get_ref() {
        DeValue::String(text) => Ok(text.as_ref().to_owned()),
        _ => Err(wrong_type(key, value, "a string", &format!("{key} = \"...\", with quotes"))),
    }
}

/// An integer of 64 bits.
pub(super) fn integer(key: &str, value: &Value) -> Result<i64, Fault> {
    match value.get_ref() {
        DeValue::Integer(integer) => i64::from_str_radix(integer.as_str(), integer.radix()).map_err(|_| {
            Fault::new(format!("`{key}` is beyond 64 bits"), value.span(), "too large", "write a smaller integer")
        }),
        _ => Err(wrong_type(key, value, "an integer", &format!("{key} = 800"))),
    }
}

/// An sRGB colour: `"#rrggbb"`, or three integers from 0 to 255.
pub(super) fn color(key: &str, value: &Value) -> Result<[u8; 3], Fault> {
    let fix = || format!("write {key} = \"#d94f3d\" (six hexadecimal digits) or {key} = [217, 79, 61]");
    match value.get_ref() {
        DeValue::String(text) => hex_color(text).ok_or_else(|| {
            Fault::new(format!("`{key}` is \"{text}\", which is not a colour"), value.span(), "not a colour", fix())
        }),
        DeValue::Array(items) => {
            let mut color = [0; 3];
            if items.len() != 3 {
                let message = format!("`{key}` has {} numbers, but a colour has three", items.len());
                return Err(Fault::new(message, value.span(), "not a colour", fix()));
            }
            for (channel, item) in color.iter_mut().zip(items.iter()) {
                let found = match item.get_ref() {
                    DeValue::Integer(n) => i64::from_str_radix(n.as_str(), n.radix()).ok(),
                    _ => None,
                };
                *channel = found.and_then(|n| u8::try_from(n).ok()).ok_or_else(|| {
                    let message = format!("`{key}` has a channel that is not an integer from 0 to 255");
                    Fault::new(message, item.span(), "not 0 to 255", fix())
                })?;
            }
            Ok(color)
        }
        _ => Err(Fault::new(
            format!("`{key}` is {}, but a colour is needed", kind(value.get_ref())),
            value.span(),
            "not a colour",
            fix(),
        )),
    }
}

/// `#rrggbb`.
fn hex_color(text: &str) -> Option<[u8; 3]> {
    let digits = text.strip_prefix('#')?;
    if digits.len() != 6 || !digits.bytes().all(|b| b.is_ascii_hexdigit()) {
        return None;
    }
    let n = u32::from_str_radix(digits, 16).ok()?;
    Some([(n >> 16) as u8, (n >> 8) as u8, n as u8])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_of_words() {
        let cases = [("colour", "color", 1), ("centre", "center", 1), ("fra", "far", 1), ("", "far", 3)];
        for (a, b, wanted) in cases {
            assert_eq!((distance(a, b), distance(b, a)), (wanted, wanted), "{a} {b}");
        }
        assert_eq!(distance("radius", "radius"), 0);
    }

    #[test]
    fn colours() {
        assert_eq!(hex_color("#d94F3d"), Some([217, 79, 61]));
        for bad in ["d94f3d", "#d94f3", "#d94f3dd", "#+94f3d", "#é4f3d", "", "#"] {
            assert_eq!(hex_color(bad), None, "{bad}");
        }
    }
}
