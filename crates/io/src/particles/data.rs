//! The bytes of an input, and the lines in them.

use std::{ops::Range, sync::Arc};

use bytes::Bytes;
use rayon::prelude::*;

use crate::input::mapped::Mapped;

/// What some programs write before UTF-8.
pub(super) const MARK: &[u8] = b"\xef\xbb\xbf";

/// The bytes of an input: mapped, or in memory.
#[derive(Clone, Debug)]
pub(crate) struct Data {
    bytes: Bytes,
    mapped: Option<Arc<Mapped>>,
}

impl From<Bytes> for Data {
    fn from(bytes: Bytes) -> Self {
        Self { bytes, mapped: None }
    }
}

impl From<Arc<Mapped>> for Data {
    fn from(mapped: Arc<Mapped>) -> Self {
        Self { bytes: mapped.bytes(), mapped: Some(mapped) }
    }
}

impl Data {
    /// The same text without the mark that may stand before it.
    pub fn without_mark(self) -> Self {
        if !self.bytes.starts_with(MARK) {
            return self;
        }
        Self { bytes: self.bytes.slice(MARK.len()..), mapped: self.mapped }
    }

    /// All of it.
    pub fn as_slice(&self) -> &[u8] {
        &self.bytes
    }

    /// How many bytes there are.
    pub fn len(&self) -> usize {
        self.bytes.len()
    }

    /// The same bytes, for numbers that are used where they lie.
    pub fn bytes(&self) -> &Bytes {
        &self.bytes
    }

    /// What is asked whether the file has changed.
    pub fn mapped(&self) -> Option<&Arc<Mapped>> {
        self.mapped.as_ref()
    }

    /// These bytes are read next, all of them.
    pub fn begin(&self, range: Range<usize>) {
        if let Some(mapped) = &self.mapped {
            mapped.populate(range);
        }
    }

    /// These bytes have been read, and the memory that holds them may be given back.
    pub fn done(&self, range: Range<usize>) {
        if let Some(mapped) = &self.mapped {
            mapped.release(range);
        }
    }

    /// Where the line begins that is so many lines behind a place, by the ends of lines alone. The
    /// last line may lack its end.
    ///
    /// # Errors
    /// How many lines there are, when there are fewer.
    pub fn skip_lines(&self, at: usize, lines: usize) -> Result<usize, usize> {
        /// Bytes whose lines are counted at a time, by one thread.
        const PIECE: usize = 1 << 18;
        if lines == 0 {
            return Ok(at);
        }
        let (mut at, mut found) = (at.min(self.len()), 0);
        'counted: loop {
            // No more than lines of 64 bytes would have, so that little is counted in vain.
            let likely = (lines - found).div_ceil(PIECE / 64);
            let there = (self.len() - at) / PIECE;
            let pieces = there.min(likely).min(4 * rayon::current_num_threads());
            if pieces == 0 {
                break;
            }
            let count = |piece: usize| {
                let range = at + piece * PIECE..at + (piece + 1) * PIECE;
                self.begin(range.clone());
                memchr::memchr_iter(b'\n', &self.bytes[range]).count()
            };
            let counts: Vec<usize> = (0..pieces).into_par_iter().map(count).collect();
            for count in counts {
                if found + count >= lines {
                    break 'counted;
                }
                (at, found) = (at + PIECE, found + count);
            }
        }
        let text = &self.bytes[at..];
        if let Some(end) = memchr::memchr_iter(b'\n', text).nth(lines - found - 1) {
            return Ok(at + end + 1);
        }
        let open = text.last().is_some_and(|byte| *byte != b'\n');
        let found = found + memchr::memchr_iter(b'\n', text).count() + usize::from(open);
        if found == lines { Ok(self.len()) } else { Err(found) }
    }

    /// The line that begins at a place; none at the end.
    pub fn line(&self, start: usize) -> Option<Line<'_>> {
        Line::at(&self.bytes, start)
    }

    /// The first line from a place that is not blank; none where all are.
    pub fn line_with_text(&self, mut start: usize) -> Option<Line<'_>> {
        loop {
            let line = self.line(start)?;
            if !line.is_blank() {
                return Some(line);
            }
            start = line.next;
        }
    }
}

/// A line of text, without its end.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Line<'a> {
    /// What it says.
    pub text: &'a [u8],
    /// Where it begins in the input.
    pub start: usize,
    /// Where the next one begins.
    pub next: usize,
}

impl<'a> Line<'a> {
    /// The line that begins at a place of a whole input; none at its end.
    pub fn at(whole: &'a [u8], start: usize) -> Option<Self> {
        let rest = whole.get(start..).filter(|rest| !rest.is_empty())?;
        let found = memchr::memchr(b'\n', rest);
        let (end, next) = found.map_or((rest.len(), rest.len()), |end| (end, end + 1));
        let text = rest[..end].strip_suffix(b"\r").unwrap_or(&rest[..end]);
        Some(Self { text, start, next: start + next })
    }

    /// Where it lies in the input.
    pub fn span(&self) -> Range<usize> {
        self.start..self.start + self.text.len()
    }

    /// Whether it holds nothing but blanks.
    pub fn is_blank(&self) -> bool {
        self.text.trim_ascii().is_empty()
    }

    /// What it says, for messages and names: bytes that are no UTF-8 are replaced.
    pub fn words(&self) -> String {
        String::from_utf8_lossy(self.text).into_owned()
    }

    /// The cells between blanks, each with its place in the line.
    pub fn cells(&self) -> impl Iterator<Item = Cell<'a>> + use<'a> {
        let (text, line_start) = (self.text, self.start);
        let mut at = 0;
        std::iter::from_fn(move || {
            at += blanks(&text[at..]);
            let length = word(&text[at..]);
            let cell = Cell { text: &text[at..at + length], start: line_start + at };
            at += length;
            (length > 0).then_some(cell)
        })
    }
}

/// How many bytes at the beginning are blanks.
#[inline]
pub(super) fn blanks(text: &[u8]) -> usize {
    text.iter().take_while(|byte| is_blank(**byte)).count()
}

/// How many bytes at the beginning are not blanks.
#[inline]
pub(super) fn word(text: &[u8]) -> usize {
    text.iter().take_while(|byte| !is_blank(**byte)).count()
}

/// Whether a byte parts two cells.
#[inline]
pub(super) fn is_blank(byte: u8) -> bool {
    matches!(byte, b' ' | b'\t' | b'\r' | 0x0b | 0x0c)
}

/// One cell of a line.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cell<'a> {
    /// What it says.
    pub text: &'a [u8],
    /// Where it begins in the input.
    pub start: usize,
}

impl Cell<'_> {
    /// Where it lies in the input.
    pub fn span(&self) -> Range<usize> {
        self.start..self.start + self.text.len()
    }

    /// What it says, for messages and names.
    pub fn words(&self) -> String {
        String::from_utf8_lossy(self.text).into_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_skipped_by_their_ends() {
        let line = |n: usize| format!("{}\n", "x".repeat(n * n % 97));
        let mut text = (0..60_000).map(line).collect::<String>();
        for end in ["", "open"] {
            text += end;
            let data = Data::from(Bytes::from(text.clone()));
            let ends: Vec<usize> = text.match_indices('\n').map(|(at, _)| at + 1).collect();
            for (from, lines) in [(0, 1), (0, 59_999), (0, 60_000), (30_000, 25_000), (59_999, 1)] {
                let start = if from == 0 { 0 } else { ends[from - 1] };
                let wanted = ends[from + lines - 1];
                assert_eq!(data.skip_lines(start, lines), Ok(wanted), "{from} {lines}");
            }
            // As many as end within a piece that is counted.
            let within = ends.iter().filter(|end| **end <= 1 << 18).count();
            assert_eq!(data.skip_lines(0, within), Ok(ends[within - 1]));
            let all = 60_000 + usize::from(!end.is_empty());
            assert_eq!(data.skip_lines(0, all), Ok(text.len()));
            assert_eq!(data.skip_lines(0, all + 1), Err(all));
            assert_eq!(data.skip_lines(text.len(), 0), Ok(text.len()));
        }
    }
}
