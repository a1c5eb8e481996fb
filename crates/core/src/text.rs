//! Text from outside (files, names, drivers, the environment) made fit to be shown: nothing in it
//! moves a terminal's cursor, hides, or turns its neighbours around, and none of it is longer than
//! a person reads. All that is printed goes through here.

use std::{borrow::Cow, ffi::OsStr};

/// Characters of a name or of a value that are shown; the middle of a longer one is left out.
const SHOWN: usize = 240;

/// Whether a character would not be seen, or would change how others are seen: control characters
/// (C0, DEL, C1), marks and overrides of the direction of writing, separators of lines, and what
/// has no width (Unicode's default ignorables).
pub fn unseen(c: char) -> bool {
    c.is_control()
        || matches!(
            u32::from(c),
            0xAD | 0x34F | 0x61C | 0x115F | 0x1160 | 0x17B4 | 0x17B5 | 0x180B..=0x180F
                | 0x200B..=0x200F | 0x2028..=0x202E | 0x2060..=0x206F | 0x3164
                | 0xFE00..=0xFE0F | 0xFEFF | 0xFFA0 | 0xFFF0..=0xFFFB | 0x1BCA0..=0x1BCA3
                | 0x1D173..=0x1D17A | 0xE0000..=0xE0FFF
        )
}

/// Adds a character, an unseen one as TOML and Python write it: `\n`, `\u001b`.
pub fn push(out: &mut String, c: char) {
    match c {
        '\n' => out.push_str("\\n"),
        '\r' => out.push_str("\\r"),
        '\t' => out.push_str("\\t"),
        c if unseen(c) && u32::from(c) > 0xFFFF => *out += &format!("\\U{:08x}", u32::from(c)),
        c if unseen(c) => *out += &format!("\\u{:04x}", u32::from(c)),
        c => out.push(c),
    }
}

fn escaped(text: &str, keep: impl Fn(char) -> bool) -> Cow<'_, str> {
    if !text.chars().any(|c| unseen(c) && !keep(c)) {
        return text.into();
    }
    let mut out = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        if keep(c) { out.push(c) } else { push(&mut out, c) }
    }
    out.into()
}

/// One line: what is unseen is escaped, line ends and tabs too.
pub fn visible(text: &str) -> Cow<'_, str> {
    escaped(text, |_| false)
}

/// Text of several lines: what is unseen is escaped, but for line ends and tabs.
pub fn lines(text: &str) -> Cow<'_, str> {
    escaped(text, |c| c == '\n' || c == '\t')
}

/// One line of at most so many characters, besides the mark of what is left out of its middle.
pub fn within(text: &str, most: usize) -> String {
    let count = text.chars().count();
    if count <= most {
        return visible(text).into_owned();
    }
    let (head, tail) = (most - most / 3, most / 3);
    let at = |n: usize| text.char_indices().nth(n).map_or(text.len(), |(at, _)| at);
    // Cut before escaping: half an escape is nothing.
    format!("{}...{}", visible(&text[..at(head)]), visible(&text[at(count - tail)..]))
}

/// A value that somebody wrote, such as a key or a string.
pub fn value(text: &str) -> String {
    within(text, 60)
}

/// The name of a file, of a folder or of a variable's value. Bytes that are not UTF-8 are shown as
/// `\xff`.
pub fn name(name: impl AsRef<OsStr>) -> String {
    let mut text = String::new();
    for chunk in name.as_ref().as_encoded_bytes().utf8_chunks() {
        text += chunk.valid();
        for byte in chunk.invalid() {
            text += &format!("\\x{byte:02x}");
        }
    }
    within(&text, SHOWN)
}

/// A name as one word of a shell: in quotes where it needs them.
pub fn word(path: impl AsRef<OsStr>) -> String {
    let name = name(path);
    let plain = |c: char| c.is_alphanumeric() || "/._-+,:@%".contains(c);
    if !name.is_empty() && name.chars().all(plain) {
        name
    } else {
        format!("'{}'", name.replace('\'', "'\\''"))
    }
}

/// JSON that may go to a terminal: what is unseen in its strings, and not ASCII, is escaped as JSON
/// has it. (The rest of what is unseen is escaped in all JSON.)
pub fn json(json: &str) -> Cow<'_, str> {
    if !json.chars().any(unseen) {
        return json.into();
    }
    let mut out = String::with_capacity(json.len() + 16);
    for c in json.chars() {
        if unseen(c) {
            c.encode_utf16(&mut [0; 2]).iter().for_each(|unit| out += &format!("\\u{unit:04x}"));
        } else {
            out.push(c);
        }
    }
    out.into()
}

/// A number with its unit of a thousand, a million or a thousand million bytes.
pub fn bytes(bytes: u64) -> String {
    match bytes {
        0..10_000_000 => format!("{:.1} MB", bytes as f64 / 1e6),
        10_000_000..1_000_000_000 => format!("{} MB", bytes / 1_000_000),
        _ => format!("{:.1} GB", bytes as f64 / 1e9),
    }
}

/// Number of letters to insert, remove, replace or swap with their neighbour to get from one word
/// to the other.
pub fn distance(a: &str, b: &str) -> usize {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_of_words() {
        let cases =
            [("colour", "color", 1), ("centre", "center", 1), ("fra", "far", 1), ("", "far", 3)];
        for (a, b, wanted) in cases {
            assert_eq!((distance(a, b), distance(b, a)), (wanted, wanted), "{a} {b}");
        }
        assert_eq!(distance("radius", "radius"), 0);
    }

    #[test]
    fn nothing_unseen_is_left() {
        let bad = "\0\u{1}\u{7}\u{8}\u{1b}[31m\u{7f}\u{85}\u{9b}2J\u{ad}\u{200b}\u{200d}\u{200e}\
                   \u{2028}\u{202e}\u{2066}\u{feff}\u{e0041}";
        for text in [visible(bad), lines(bad), name(bad).into(), value(bad).into()] {
            assert!(!text.chars().any(unseen), "{text}");
            for wanted in [
                "\\u0000",
                "\\u001b[31m",
                "\\u007f",
                "\\u0085",
                "\\u009b",
                "\\u202e",
                "\\ufeff",
                "\\U000e0041",
            ] {
                assert!(text.contains(wanted), "{text}");
            }
        }
        assert_eq!(visible("a\r\n\tb"), "a\\r\\n\\tb");
        assert_eq!(lines("a\r\n\tb"), "a\\r\n\tb");
        // What people write is left alone, combining marks and right-to-left letters too.
        for good in ["größe.toml", "e\u{301}", "球.npy", "שלום", "a b\\c", "🙂", "\u{fffd}", ""]
        {
            assert!(matches!(visible(good), Cow::Borrowed(text) if text == good), "{good}");
            assert_eq!(name(good), good);
        }
    }

    #[test]
    fn words_and_json_are_read_back() {
        for (name, wanted) in [
            ("a/b-1.toml", "a/b-1.toml"),
            ("größe", "größe"),
            ("my folder", "'my folder'"),
            ("it's", "'it'\\''s'"),
            ("$x", "'$x'"),
            ("", "''"),
        ] {
            assert_eq!(word(name), wanted);
        }
        for text in ["plain", "\u{9b}31m\u{7f}\u{202e}\u{e0041}\n\u{1b}"] {
            let written = serde_json::to_string(text).unwrap();
            let shown = json(&written);
            assert!(!shown.chars().any(unseen), "{shown}");
            assert_eq!(serde_json::from_str::<String>(&shown).unwrap(), text);
        }
    }

    #[test]
    fn long_text_is_cut_in_the_middle() {
        let long = format!("{}\u{1b}{}", "球".repeat(50_000), "é".repeat(50_000));
        for text in [value(&long), name(&long)] {
            assert!(
                text.starts_with('球') && text.ends_with('é') && text.contains("..."),
                "{text}"
            );
            assert!(text.chars().count() <= SHOWN + 3, "{text}");
        }
        assert_eq!(within("abcdefghi", 9), "abcdefghi");
        assert_eq!(within("abcdefghij", 9), "abcdef...hij");
        assert_eq!(
            within(&"\u{1b}".repeat(9), 6),
            format!("{}...{}", "\\u001b".repeat(4), "\\u001b".repeat(2))
        );
    }

    #[cfg(unix)]
    #[test]
    fn names_that_are_not_utf8_show_their_bytes() {
        use std::os::unix::ffi::OsStrExt;
        assert_eq!(name(OsStr::from_bytes(b"a\xff\xfeb\nc")), "a\\xff\\xfeb\\nc");
    }
}
