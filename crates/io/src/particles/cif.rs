//! The words of CIF files.
//!
//! The syntax: "CIF syntax", version 1.1, of the International Union of Crystallography, in which
//! mmCIF is written.

use super::data::is_blank;
use crate::input::report::Fault;

/// What a word is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// `data_`, and the name of what begins.
    Data,
    /// `loop_`: names of columns follow, and rows.
    Loop,
    /// Any other word of the language.
    Reserved,
    /// A name, such as `_atom_site.id`.
    Name,
    /// A value without quotes.
    Plain,
    /// A value in quotes, or in a text field.
    Quoted,
}

/// A word.
#[derive(Clone, Copy, Debug)]
pub(super) struct Token<'a> {
    pub kind: Kind,
    /// What it says, without its quotes.
    pub text: &'a [u8],
    /// Where it begins in the input, quotes included.
    pub start: usize,
    /// Where it ends.
    pub end: usize,
}

impl Token<'_> {
    /// Whether it is a value.
    pub fn is_value(&self) -> bool {
        matches!(self.kind, Kind::Plain | Kind::Quoted)
    }

    /// Whether it stands for a value that is not there.
    pub fn is_unknown(&self) -> bool {
        self.kind == Kind::Plain && matches!(self.text, b"?" | b".")
    }
}

/// The words from a place on.
#[derive(Clone, Debug)]
pub(super) struct Tokens<'a> {
    pub whole: &'a [u8],
    pub at: usize,
}

impl<'a> Tokens<'a> {
    /// The next word; none at the end.
    pub fn next(&mut self) -> Result<Option<Token<'a>>, Fault> {
        let whole = self.whole;
        loop {
            match whole.get(self.at) {
                None => return Ok(None),
                Some(b'#') => self.at = line_end(whole, self.at),
                Some(byte) if is_blank(*byte) || *byte == b'\n' => self.at += 1,
                Some(b';') if self.at == 0 || whole[self.at - 1] == b'\n' => {
                    return self.text_field().map(Some);
                }
                Some(_) => break,
            }
        }
        let rest = &whole[self.at..line_end(whole, self.at)];
        let Some((text, length)) = cell(rest) else { return Err(self.open_quote(rest.len())) };
        let kind = match rest[0] {
            b'\'' | b'"' => Kind::Quoted,
            _ => kind(text),
        };
        let start = self.at;
        self.at += length;
        Ok(Some(Token { kind, text, start, end: self.at }))
    }

    fn text_field(&mut self) -> Result<Token<'a>, Fault> {
        let start = self.at;
        let rest = &self.whole[start + 1..];
        let Some(length) = memchr::memmem::find(rest, b"\n;") else {
            return Err(Fault::new(
                "a text begins here, but no line that begins with `;` ends it",
                start..start + 1,
                "not ended",
                "wait until the file is written, or write it again",
            ));
        };
        let text = rest[..length].strip_suffix(b"\r").unwrap_or(&rest[..length]);
        self.at = start + 1 + length + 2;
        Ok(Token { kind: Kind::Quoted, text, start, end: self.at })
    }

    fn open_quote(&self, length: usize) -> Fault {
        Fault::new(
            "the quote that begins here does not end in its line, before a blank",
            self.at..self.at + length,
            "not ended",
            "put a value that begins with a quote into the other kind of quotes",
        )
    }
}

/// The cell that a part of a line begins with, without its quotes, and how long it is with them;
/// none if a quote is not closed. A quote ends where a blank follows it.
#[inline]
pub(super) fn cell(line: &[u8]) -> Option<(&[u8], usize)> {
    let quote = match line.first() {
        Some(quote @ (b'\'' | b'"')) => *quote,
        _ => {
            let length = line.iter().take_while(|byte| **byte > b' ').count();
            // Control characters are no blanks, but come in no file that is whole.
            let length = match line.get(length) {
                None => length,
                Some(byte) if is_blank(*byte) => length,
                Some(_) => super::data::word(line),
            };
            return Some((&line[..length], length));
        }
    };
    let ends = |at: &usize| line.get(at + 1).is_none_or(|byte| is_blank(*byte));
    let end = memchr::memchr_iter(quote, line).skip(1).find(ends)?;
    Some((&line[1..end], end + 1))
}

/// Where the line of a place ends.
fn line_end(whole: &[u8], at: usize) -> usize {
    memchr::memchr(b'\n', &whole[at..]).map_or(whole.len(), |length| at + length)
}

/// What a word without quotes is.
pub(super) fn kind(word: &[u8]) -> Kind {
    let is = |whole: &[u8]| word.eq_ignore_ascii_case(whole);
    let begins =
        |start: &[u8]| word.get(..start.len()).is_some_and(|own| own.eq_ignore_ascii_case(start));
    match word.first() {
        Some(b'_') => Kind::Name,
        Some(b'l' | b'L') if is(b"loop_") => Kind::Loop,
        Some(b'd' | b'D') if begins(b"data_") => Kind::Data,
        Some(b's' | b'S') if begins(b"save_") || is(b"stop_") => Kind::Reserved,
        Some(b'g' | b'G') if is(b"global_") => Kind::Reserved,
        _ => Kind::Plain,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(text: &str) -> Vec<(Kind, String)> {
        let mut tokens = Tokens { whole: text.as_bytes(), at: 0 };
        let mut found = Vec::new();
        while let Some(token) = tokens.next().unwrap() {
            assert!(token.start < token.end && token.end <= text.len());
            found.push((token.kind, String::from_utf8_lossy(token.text).into_owned()));
        }
        found
    }

    #[test]
    fn words_and_their_quotes() {
        let text = "#c\nDATA_x LOOP_ _a.b # c\n'a' b' \"O5'\" 'C1\"' \"a\"b\" ''\t#\r\n\
            ;t\nloop_\r\n;;\n\
            save_ ? '?' a#b ;x";
        let wanted = [
            (Kind::Data, "DATA_x"),
            (Kind::Loop, "LOOP_"),
            (Kind::Name, "_a.b"),
            (Kind::Quoted, "a"),
            (Kind::Plain, "b'"),
            (Kind::Quoted, "O5'"),
            (Kind::Quoted, "C1\""),
            (Kind::Quoted, "a\"b"),
            (Kind::Quoted, ""),
            (Kind::Quoted, "t\nloop_"),
            (Kind::Plain, ";"),
            (Kind::Reserved, "save_"),
            (Kind::Plain, "?"),
            (Kind::Quoted, "?"),
            (Kind::Plain, "a#b"),
            (Kind::Plain, ";x"),
        ];
        let found = words(text);
        let found: Vec<_> = found.iter().map(|(kind, word)| (*kind, word.as_str())).collect();
        assert_eq!(found, wanted);
        for open in ["'a\n'", "\"a", "'", "\n;x\n x;"] {
            assert!(Tokens { whole: open.as_bytes(), at: 0 }.next().is_err(), "{open}");
        }
    }
}
