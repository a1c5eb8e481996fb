//! Colours as strings: `#rrggbb`, `#rgb`, and the names of CSS (Level 4, all 148) in any case.

use planisphere_core::text::{self, distance};

/// CSS Color Module Level 4, section 6.1, in alphabetical order.
#[rustfmt::skip]
const NAMED: [(&str, u32); 148] = [
    ("aliceblue", 0xf0f8ff), ("antiquewhite", 0xfaebd7), ("aqua", 0x00ffff),
    ("aquamarine", 0x7fffd4), ("azure", 0xf0ffff), ("beige", 0xf5f5dc), ("bisque", 0xffe4c4),
    ("black", 0x000000), ("blanchedalmond", 0xffebcd), ("blue", 0x0000ff), ("blueviolet", 0x8a2be2),
    ("brown", 0xa52a2a), ("burlywood", 0xdeb887), ("cadetblue", 0x5f9ea0), ("chartreuse", 0x7fff00),
    ("chocolate", 0xd2691e), ("coral", 0xff7f50), ("cornflowerblue", 0x6495ed),
    ("cornsilk", 0xfff8dc), ("crimson", 0xdc143c), ("cyan", 0x00ffff), ("darkblue", 0x00008b),
    ("darkcyan", 0x008b8b), ("darkgoldenrod", 0xb8860b), ("darkgray", 0xa9a9a9),
    ("darkgreen", 0x006400), ("darkgrey", 0xa9a9a9), ("darkkhaki", 0xbdb76b),
    ("darkmagenta", 0x8b008b), ("darkolivegreen", 0x556b2f), ("darkorange", 0xff8c00),
    ("darkorchid", 0x9932cc), ("darkred", 0x8b0000), ("darksalmon", 0xe9967a),
    ("darkseagreen", 0x8fbc8f), ("darkslateblue", 0x483d8b), ("darkslategray", 0x2f4f4f),
    ("darkslategrey", 0x2f4f4f), ("darkturquoise", 0x00ced1), ("darkviolet", 0x9400d3),
    ("deeppink", 0xff1493), ("deepskyblue", 0x00bfff), ("dimgray", 0x696969), ("dimgrey", 0x696969),
    ("dodgerblue", 0x1e90ff), ("firebrick", 0xb22222), ("floralwhite", 0xfffaf0),
    ("forestgreen", 0x228b22), ("fuchsia", 0xff00ff), ("gainsboro", 0xdcdcdc),
    ("ghostwhite", 0xf8f8ff), ("gold", 0xffd700), ("goldenrod", 0xdaa520), ("gray", 0x808080),
    ("green", 0x008000), ("greenyellow", 0xadff2f), ("grey", 0x808080), ("honeydew", 0xf0fff0),
    ("hotpink", 0xff69b4), ("indianred", 0xcd5c5c), ("indigo", 0x4b0082), ("ivory", 0xfffff0),
    ("khaki", 0xf0e68c), ("lavender", 0xe6e6fa), ("lavenderblush", 0xfff0f5),
    ("lawngreen", 0x7cfc00), ("lemonchiffon", 0xfffacd), ("lightblue", 0xadd8e6),
    ("lightcoral", 0xf08080), ("lightcyan", 0xe0ffff), ("lightgoldenrodyellow", 0xfafad2),
    ("lightgray", 0xd3d3d3), ("lightgreen", 0x90ee90), ("lightgrey", 0xd3d3d3),
    ("lightpink", 0xffb6c1), ("lightsalmon", 0xffa07a), ("lightseagreen", 0x20b2aa),
    ("lightskyblue", 0x87cefa), ("lightslategray", 0x778899), ("lightslategrey", 0x778899),
    ("lightsteelblue", 0xb0c4de), ("lightyellow", 0xffffe0), ("lime", 0x00ff00),
    ("limegreen", 0x32cd32), ("linen", 0xfaf0e6), ("magenta", 0xff00ff), ("maroon", 0x800000),
    ("mediumaquamarine", 0x66cdaa), ("mediumblue", 0x0000cd), ("mediumorchid", 0xba55d3),
    ("mediumpurple", 0x9370db), ("mediumseagreen", 0x3cb371), ("mediumslateblue", 0x7b68ee),
    ("mediumspringgreen", 0x00fa9a), ("mediumturquoise", 0x48d1cc), ("mediumvioletred", 0xc71585),
    ("midnightblue", 0x191970), ("mintcream", 0xf5fffa), ("mistyrose", 0xffe4e1),
    ("moccasin", 0xffe4b5), ("navajowhite", 0xffdead), ("navy", 0x000080), ("oldlace", 0xfdf5e6),
    ("olive", 0x808000), ("olivedrab", 0x6b8e23), ("orange", 0xffa500), ("orangered", 0xff4500),
    ("orchid", 0xda70d6), ("palegoldenrod", 0xeee8aa), ("palegreen", 0x98fb98),
    ("paleturquoise", 0xafeeee), ("palevioletred", 0xdb7093), ("papayawhip", 0xffefd5),
    ("peachpuff", 0xffdab9), ("peru", 0xcd853f), ("pink", 0xffc0cb), ("plum", 0xdda0dd),
    ("powderblue", 0xb0e0e6), ("purple", 0x800080), ("rebeccapurple", 0x663399), ("red", 0xff0000),
    ("rosybrown", 0xbc8f8f), ("royalblue", 0x4169e1), ("saddlebrown", 0x8b4513),
    ("salmon", 0xfa8072), ("sandybrown", 0xf4a460), ("seagreen", 0x2e8b57), ("seashell", 0xfff5ee),
    ("sienna", 0xa0522d), ("silver", 0xc0c0c0), ("skyblue", 0x87ceeb), ("slateblue", 0x6a5acd),
    ("slategray", 0x708090), ("slategrey", 0x708090), ("snow", 0xfffafa), ("springgreen", 0x00ff7f),
    ("steelblue", 0x4682b4), ("tan", 0xd2b48c), ("teal", 0x008080), ("thistle", 0xd8bfd8),
    ("tomato", 0xff6347), ("turquoise", 0x40e0d0), ("violet", 0xee82ee), ("wheat", 0xf5deb3),
    ("white", 0xffffff), ("whitesmoke", 0xf5f5f5), ("yellow", 0xffff00), ("yellowgreen", 0x9acd32),
];

/// The colour of a sphere that has none in its file, sRGB.
pub const DEFAULT_COLOR: [u8; 3] = [176, 176, 176];

/// Why a string is not a colour.
#[derive(Debug, PartialEq)]
pub(crate) struct NotAColor {
    /// What is wrong, to follow "which".
    pub problem: &'static str,
    /// A string to write instead, where one is certain or likely.
    pub instead: Option<String>,
}

fn bytes(rgb: u32) -> [u8; 3] {
    [(rgb >> 16) as u8, (rgb >> 8) as u8, rgb as u8]
}

/// Reads a colour.
pub(crate) fn parse(text: &str) -> Result<[u8; 3], NotAColor> {
    let wrong = |problem, instead| Err(NotAColor { problem, instead });
    if let Some(digits) = text.strip_prefix('#') {
        if !digits.bytes().all(|b| b.is_ascii_hexdigit()) {
            return wrong("is not a colour", None);
        }
        let twice =
            |digits: &str| digits.chars().flat_map(|digit| [digit, digit]).collect::<String>();
        let opaque = |six: String, alpha: &str| {
            alpha.bytes().all(|b| b | 0x20 == b'f').then(|| format!("#{six}"))
        };
        return match digits.len() {
            3 => Ok(bytes(u32::from_str_radix(&twice(digits), 16).unwrap_or_default())),
            6 => Ok(bytes(u32::from_str_radix(digits, 16).unwrap_or_default())),
            4 => wrong(
                "has an alpha channel, but spheres and background are opaque",
                opaque(twice(&digits[..3]), &digits[3..]),
            ),
            8 => wrong(
                "has an alpha channel, but spheres and background are opaque",
                opaque(digits[..6].into(), &digits[6..]),
            ),
            _ => wrong("is not a colour", None),
        };
    }
    let lower = text.to_ascii_lowercase();
    if let Ok(at) = NAMED.binary_search_by_key(&lower.as_str(), |(name, _)| name) {
        return Ok(bytes(NAMED[at].1));
    }
    if lower == "transparent" {
        return wrong("has an alpha channel, but spheres and background are opaque", None);
    }
    if matches!(lower.len(), 3 | 6) && lower.bytes().all(|b| b.is_ascii_hexdigit()) {
        return wrong("is not a colour", Some(format!("#{text}")));
    }
    // Words with spaces or signs between, such as "light grey", and words with a letter wrong.
    let plain: String = lower.chars().filter(|c| !matches!(c, ' ' | '-' | '_')).collect();
    let near = NAMED
        .iter()
        .filter(|_| plain.len() <= 24)
        .map(|(name, _)| (distance(&plain, name), *name))
        .min();
    let near =
        near.filter(|(steps, name)| *steps <= name.len() / 4).map(|(_, name)| name.to_owned());
    wrong("is not a colour", near)
}

/// What is wrong with a colour that was typed, and how colours are written.
pub(crate) fn words(wrong: &NotAColor) -> String {
    let fix = match wrong.instead.as_deref() {
        Some(instead) => format!("write \"{}\"", text::value(instead)),
        None => "write \"#d94f3d\" (six hexadecimal digits, or three), or a name of CSS such as \
                 tomato"
            .into(),
    };
    format!("it {}; {fix}", wrong.problem)
}

/// What to write for a key whose value is not a colour.
pub(crate) fn fix(key: &str, wrong: Option<&NotAColor>) -> String {
    match wrong.and_then(|wrong| wrong.instead.as_deref()) {
        Some(instead) => format!("write {key} = \"{}\"", text::value(instead)),
        None => format!(
            "write {key} = \"#d94f3d\" (six hexadecimal digits, or three), {key} = [217, 79, 61], \
             or a name of CSS such as {key} = \"tomato\""
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_digits() {
        assert!(NAMED.is_sorted_by(|a, b| a.0 < b.0));
        let cases = [
            ("#d94f3d", [0xd9, 0x4f, 0x3d]),
            ("#D94F3D", [0xd9, 0x4f, 0x3d]),
            ("#f80", [0xff, 0x88, 0]),
            ("#FFF", [255; 3]),
            ("#000", [0; 3]),
            ("red", [255, 0, 0]),
            ("White", [255; 3]),
            ("RebeccaPurple", [0x66, 0x33, 0x99]),
            ("aliceblue", [0xf0, 0xf8, 0xff]),
            ("yellowgreen", [0x9a, 0xcd, 0x32]),
            ("grey", [128; 3]),
            ("gray", [128; 3]),
            ("lightgoldenrodyellow", [0xfa, 0xfa, 0xd2]),
        ];
        for (text, wanted) in cases {
            assert_eq!(parse(text), Ok(wanted), "{text}");
        }
        // American and British names are the same colours.
        for (name, rgb) in NAMED.iter().filter(|(name, _)| name.contains("gray")) {
            assert_eq!(parse(&name.replace("gray", "grey")), Ok(bytes(*rgb)), "{name}");
        }
    }

    #[test]
    fn what_is_not_a_colour_is_refused_with_the_fix() {
        let cases = [
            ("d94f3d", Some("#d94f3d")),
            ("fff", Some("#fff")),
            ("#ff0000ff", Some("#ff0000")),
            ("#F80F", Some("#FF8800")),
            ("#ff000080", None),
            ("#f008", None),
            ("transparent", None),
            ("light grey", Some("lightgrey")),
            ("dark-red", Some("darkred")),
            ("tomatoe", Some("tomato")),
            ("rgb(1, 2, 3)", None),
            ("#12345", None),
            ("#é4f3d", None),
            ("#+94f3d", None),
            ("#", None),
            ("", None),
            ("xyzzy", None),
        ];
        for (text, instead) in cases {
            let wrong = parse(text).expect_err(text);
            assert_eq!(wrong.instead.as_deref(), instead, "{text}");
            // What the fix says can be read.
            assert!(wrong.instead.is_none_or(|instead| parse(&instead).is_ok()), "{text}");
        }
        assert!(parse("transparent").expect_err("alpha").problem.contains("alpha"));
    }
}
