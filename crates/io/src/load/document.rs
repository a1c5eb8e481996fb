//! Takes typed values out of a TOML document; every fault knows its place. This file knows TOML,
//! not scenes.

use std::ops::Range;

use glam::DVec3;
use toml::{
    Spanned,
    de::{DeString, DeTable, DeValue},
};

use crate::{colors, input::report::Fault};
use planisphere_core::text;

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
                    DeValue::Array(_) => {
                        (format!("there is one {name}: write it with single brackets"), "a list")
                    }
                    _ => (
                        format!(
                            "write {name} on a line of its own, and `key = value` lines below it"
                        ),
                        kind(other),
                    ),
                };
                Err(Fault::new(
                    format!("`{key}` is {shown}, but a table is needed"),
                    value.span(),
                    "not a table",
                    fix,
                ))
            }
        }
    }

    /// The same, of the table itself.
    pub fn of_table(
        name: &str,
        table: &'t DeTable<'i>,
        span: Range<usize>,
        known: &[&str],
    ) -> Result<Self, Fault> {
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
    pub fn read<T>(
        &self,
        key: &str,
        read: fn(&str, &Value) -> Result<T, Fault>,
    ) -> Result<Option<T>, Fault> {
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

/// What people call things whose key has another name: the section (none: any), their word, and the
/// keys that may be meant.
const SYNONYMS: &[(&str, &[&str], &[&str])] = &[
    (
        "[camera]",
        &[
            "eye",
            "position",
            "pos",
            "from",
            "location",
            "camera",
            "lookfrom",
            "viewpoint",
            "point",
            "center",
            "centre",
        ],
        &["origin"],
    ),
    (
        "[camera]",
        &["target", "at", "to", "lookat", "focus", "interest", "towards", "aim"],
        &["look_at"],
    ),
    (
        "[camera]",
        &["direction", "dir", "forward", "look", "lookdir", "gaze", "orientation", "viewdir"],
        &["view"],
    ),
    ("[camera]", &["vup", "upvector", "viewup", "sky", "updirection"], &["up"]),
    (
        "[camera]",
        &["fovy", "vfov", "angle", "yfov", "fieldofview", "viewangle", "degrees", "hfov", "fovx"],
        &["fov"],
    ),
    (
        "[camera]",
        &["type", "kind", "mode", "model", "perspective", "orthographic", "ortho"],
        &["projection"],
    ),
    (
        "[camera]",
        &["scale", "size", "zoom", "extent", "xsize", "w", "ysize", "h", "viewwidth"],
        &["width"],
    ),
    ("[camera]", &["znear", "nearplane", "nearclip", "clipnear", "hither", "front"], &["near"]),
    ("[camera]", &["zfar", "farplane", "farclip", "clipfar", "yon", "back"], &["far"]),
    (
        "[image]",
        &[
            "resolution",
            "size",
            "dimensions",
            "w",
            "xres",
            "resx",
            "columns",
            "cols",
            "nx",
            "xsize",
        ],
        &["width"],
    ),
    ("[image]", &["h", "yres", "resy", "rows", "ny", "ysize"], &["height"]),
    (
        "[image]",
        &[
            "bg",
            "colour",
            "color",
            "backgroundcolor",
            "backgroundcolour",
            "backdrop",
            "clear",
            "sky",
        ],
        &["background"],
    ),
    (
        "sphere",
        &[
            "pos",
            "position",
            "origin",
            "location",
            "at",
            "xyz",
            "coordinates",
            "coords",
            "point",
            "c",
            "p",
        ],
        &["center", "centers"],
    ),
    ("sphere", &["points", "positions", "centres", "centre"], &["centers", "center"]),
    ("sphere", &["r", "rad", "size", "scale", "diameter", "d", "width"], &["radius", "radii"]),
    ("sphere", &["radiuses", "sizes", "diameters"], &["radii", "radius"]),
    (
        "sphere",
        &["rgb", "tint", "material", "albedo", "diffuse", "fill", "paint", "colour"],
        &["color", "colors"],
    ),
    ("sphere", &["rgbs", "colours"], &["colors", "color"]),
    ("", &["cam", "eye", "view", "viewpoint"], &["camera"]),
    ("", &["picture", "output", "resolution", "canvas", "film", "screen", "render"], &["image"]),
    ("", &["ball", "object", "atom", "particle"], &["sphere"]),
    ("", &["balls", "objects", "atoms", "particles", "points", "cloud"], &["spheres"]),
];

/// The known key that somebody means by another word: a synonym, or a key with some letters wrong.
fn meant<'k>(section: &str, found: &str, known: &[&'k str]) -> Option<&'k str> {
    let plain: String = found
        .chars()
        .filter(|c| !matches!(c, '_' | '-' | ' '))
        .collect::<String>()
        .to_ascii_lowercase();
    let same = |key: &&&str| key.replace('_', "") == plain;
    if let Some(key) = known.iter().find(same) {
        return Some(key);
    }
    let here = |place: &str| {
        if place == "sphere" { section.starts_with("[[sphere") } else { section == place }
    };
    let rows =
        SYNONYMS.iter().filter(|(place, words, _)| here(place) && words.contains(&plain.as_str()));
    let keys = rows.flat_map(|(.., keys)| keys.iter());
    if let Some(key) = keys.filter_map(|key| known.iter().find(|known| *known == key)).next() {
        return Some(key);
    }
    // A key is no longer than this; comparing words takes their lengths multiplied.
    if found.len() > 40 {
        return None;
    }
    let (steps, like) = known.iter().map(|key| (text::distance(found, key), *key)).min()?;
    (steps <= 1 + like.len() / 3).then_some(like)
}

fn unknown_key(name: &str, key: &Spanned<DeString>, known: &[&str]) -> Fault {
    let found = key.get_ref().as_ref();
    let fix = match meant(name, found, known) {
        // Both hold a number: the fix says what else to change.
        Some(like @ ("radius" | "radii"))
            if found.to_ascii_lowercase().starts_with("diam") || found == "d" =>
        {
            format!("did you mean `{like}`? It is half of the diameter")
        }
        Some("width")
            if matches!(found, "resolution" | "size" | "dimensions")
                && known.contains(&"height") =>
        {
            "did you mean `width` and `height`? Each is one number".into()
        }
        Some("fov") if matches!(found, "hfov" | "fovx") => {
            "did you mean `fov`? It is the vertical angle; or give `width`, that of the image \
             plane at distance 1"
                .into()
        }
        Some(like) => format!("did you mean `{like}`?"),
        None => format!("remove it; the keys here are {}", known.join(", ")),
    };
    let inside = if name.is_empty() { String::new() } else { format!(" in {name}") };
    Fault::new(format!("unknown key `{}`{inside}", text::value(found)), key.span(), "unknown", fix)
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
            exact.filter(|&n| (n as f64) as i128 == i128::from(n)).map(|n| n as f64).ok_or_else(
                || {
                    Fault::new(
                        format!("`{key}` is an integer that no 64-bit float equals"),
                        value.span(),
                        "not exact",
                        "write it with a decimal point, such as 1.0e20; it is then rounded to the \
                     nearest 64-bit float",
                    )
                },
            )
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
        DeValue::Integer(integer) => i64::from_str_radix(integer.as_str(), integer.radix())
            .map_err(|_| {
                Fault::new(
                    format!("`{key}` is beyond 64 bits"),
                    value.span(),
                    "too large",
                    "write a smaller integer",
                )
            }),
        _ => Err(wrong_type(key, value, "an integer", &format!("{key} = 800"))),
    }
}

/// An sRGB colour: `"#rrggbb"`, `"#rgb"`, a name of CSS, or three integers from 0 to 255.
pub(super) fn color(key: &str, value: &Value) -> Result<[u8; 3], Fault> {
    let fix = || colors::fix(key, None);
    match value.get_ref() {
        DeValue::String(text) => colors::parse(text).map_err(|wrong| {
            let message = format!("`{key}` is \"{}\", which {}", text::value(text), wrong.problem);
            Fault::new(message, value.span(), "not a colour", colors::fix(key, Some(&wrong)))
        }),
        DeValue::Array(items) => {
            let mut color = [0; 3];
            if items.len() != 3 {
                let message =
                    format!("`{key}` has {} numbers, but a colour has three", items.len());
                return Err(Fault::new(message, value.span(), "not a colour", fix()));
            }
            for (channel, item) in color.iter_mut().zip(items.iter()) {
                let found = match item.get_ref() {
                    DeValue::Integer(n) => i64::from_str_radix(n.as_str(), n.radix()).ok(),
                    _ => None,
                };
                *channel = found.and_then(|n| u8::try_from(n).ok()).ok_or_else(|| {
                    let message =
                        format!("`{key}` has a channel that is not an integer from 0 to 255");
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_of_others_are_understood() {
        let camera = [
            "projection",
            "origin",
            "view",
            "look_at",
            "up",
            "width",
            "height",
            "fov",
            "near",
            "far",
        ];
        let cases = [
            ("eye", "origin"),
            ("position", "origin"),
            ("from", "origin"),
            ("camera", "origin"),
            ("Location", "origin"),
            ("look_from", "origin"),
            ("lookAt", "look_at"),
            ("LOOK-AT", "look_at"),
            ("target", "look_at"),
            ("at", "look_at"),
            ("direction", "view"),
            ("dir", "view"),
            ("view_dir", "view"),
            ("fovy", "fov"),
            ("field_of_view", "fov"),
            ("z_near", "near"),
            ("farr", "far"),
            ("Width", "width"),
            ("type", "projection"),
        ];
        for (found, wanted) in cases {
            assert_eq!(meant("[camera]", found, &camera), Some(wanted), "{found}");
        }
        let (image, sphere) = (["width", "height", "background"], ["center", "radius", "color"]);
        let spheres = ["centers", "radii", "radius", "colors", "color"];
        for (section, known, found, wanted) in [
            ("[image]", &image[..], "resolution", "width"),
            ("[image]", &image, "rows", "height"),
            ("[image]", &image, "color", "background"),
            ("[[sphere]]", &sphere, "pos", "center"),
            ("[[sphere]]", &sphere, "centre", "center"),
            ("[[sphere]]", &sphere, "r", "radius"),
            ("[[sphere]]", &sphere, "diameter", "radius"),
            ("[[sphere]]", &sphere, "colour", "color"),
            ("[[spheres]]", &spheres, "positions", "centers"),
            ("[[spheres]]", &spheres, "r", "radius"),
            ("[[spheres]]", &spheres, "colours", "colors"),
            ("[[spheres]]", &spheres, "centre", "centers"),
            ("", &["camera", "image", "sphere", "spheres"], "atoms", "spheres"),
        ] {
            assert_eq!(meant(section, found, known), Some(wanted), "{section} {found}");
        }
        assert_eq!(meant("[camera]", "xyzzy", &camera), None);
        assert_eq!(meant("[camera]", &"view".repeat(100_000), &camera), None);
        // Every synonym leads to a key of its section.
        for (section, words, keys) in SYNONYMS {
            let known =
                [&camera[..], &image, &sphere, &spheres, &["camera", "image", "sphere", "spheres"]]
                    .concat();
            assert!(keys.iter().all(|key| known.contains(key)) && !words.is_empty(), "{section}");
        }
    }
}
