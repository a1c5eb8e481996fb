//! What is wrong with an input, where, and what to do: one error type that prints itself with the
//! line and a caret.

use std::{
    fmt, io,
    ops::Range,
    path::{Path, PathBuf},
};

use codespan_reporting::{
    diagnostic::{Diagnostic, Label, LabelStyle, Severity},
    files, term,
};

use planisphere_core::{drawing::Control, text};

/// The words for a reading that was ended from outside.
pub(crate) const CANCELLED: &str = "the reading was cancelled";

/// A fault at a place in a scene file, before the file's name and text are joined to it.
#[derive(Debug)]
pub(crate) struct Fault(Box<Parts>);

#[derive(Debug)]
struct Parts {
    message: String,
    /// Bytes of the file, and what is wrong with them in few words; none where the whole is meant.
    place: Option<(Range<usize>, String)>,
    /// Another place that matters.
    other: Option<(Range<usize>, String)>,
    fix: String,
}

impl Fault {
    /// What is wrong (one line that makes sense alone), where, in few words there, and what to do.
    pub fn new(
        message: impl Into<String>,
        span: Range<usize>,
        label: impl Into<String>,
        fix: impl Into<String>,
    ) -> Self {
        Self(Box::new(Parts {
            message: message.into(),
            place: Some((span, label.into())),
            other: None,
            fix: fix.into(),
        }))
    }

    /// A fault of the whole file, with no place to show.
    pub fn whole(message: impl Into<String>, fix: impl Into<String>) -> Self {
        let (message, fix) = (message.into(), fix.into());
        Self(Box::new(Parts { message, place: None, other: None, fix }))
    }

    /// Whether it is at a place that can be shown.
    pub fn has_place(&self) -> bool {
        self.0.place.is_some()
    }

    /// Puts words before what is wrong.
    pub fn of(mut self, what: &str) -> Self {
        self.0.message.insert_str(0, what);
        self
    }

    /// Adds to what is wrong.
    pub fn but(mut self, more: &str) -> Self {
        self.0.message += more;
        self
    }

    /// Ends what is read once it is cancelled; whoever loads then says so in place of this.
    pub fn if_cancelled(control: &Control) -> Result<(), Self> {
        if control.is_cancelled() { Err(Self::new(CANCELLED, 0..0, "", "")) } else { Ok(()) }
    }

    /// Adds a second place.
    pub fn and(mut self, span: Range<usize>, label: impl Into<String>) -> Self {
        self.0.other = Some((span, label.into()));
        self
    }

    /// Moves its places, which were found in a part of a file, to where that part stands.
    pub fn moved(mut self, place: impl Fn(Range<usize>) -> Range<usize>) -> Self {
        self.0.place = self.0.place.map(|(span, words)| (place(span), words));
        self.0.other = self.0.other.map(|(span, words)| (place(span), words));
        self
    }

    /// Joins the file's name and text, of which the lines around the places are kept.
    pub fn into_error(self, name: &str, text: &str) -> LoadError {
        self.after(0, name, text)
    }

    /// The same of any bytes, also of those that are no text; of two places only the first is
    /// shown.
    pub fn into_error_in(mut self, name: &str, whole: &[u8]) -> LoadError {
        /// Bytes of a line that are looked at, on either side of a place.
        const NEAR: usize = 1 << 12;
        self.0.other = None;
        let Some((span, _)) = &mut self.0.place else { return self.into_error(name, "") };
        let place = span.start.min(whole.len())..span.end.min(whole.len());
        let start = memchr::memrchr(b'\n', &whole[..place.start]).map_or(0, |at| at + 1);
        let lines_before = memchr::memchr_iter(b'\n', &whole[..start]).count();
        let start = start.max(place.start.saturating_sub(NEAR));
        let end = (place.start + NEAR).min(whole.len());
        let end = memchr::memchr(b'\n', &whole[place.start..end])
            .map_or(end, |length| place.start + length + 1);
        let before = String::from_utf8_lossy(&whole[start..place.start]);
        let inside = String::from_utf8_lossy(&whole[place.start..place.end.min(end)]);
        let behind = String::from_utf8_lossy(&whole[place.end.min(end)..end]);
        *span = before.len()..before.len() + inside.len();
        let text = [before, inside, behind].concat();
        self.after(lines_before, name, &text)
    }

    /// Joins the name and text of a file, which has some lines before the text.
    fn after(self, lines_before: usize, name: &str, text: &str) -> LoadError {
        let Parts { message, place, other, fix } = *self.0;
        let Some(place) = place else { return LoadError::of_file(name, message, &fix) };
        let clamp = |span: Range<usize>| {
            let start = text.floor_char_boundary(span.start.min(text.len()));
            start..text.ceil_char_boundary(span.end.min(text.len())).max(start)
        };
        let places: Vec<(Range<usize>, String)> =
            std::iter::once(place).chain(other).map(|(span, words)| (clamp(span), words)).collect();
        let spans: Vec<Range<usize>> = places.iter().map(|(span, _)| span.clone()).collect();
        let (excerpt, spans) = Excerpt::new(name, text, lines_before, &spans);
        let styles = [LabelStyle::Primary, LabelStyle::Secondary];
        let labels = styles.into_iter().zip(spans).zip(places);
        let labels = labels.map(|((style, span), (_, words))| {
            Label::new(style, (), span).with_message(text::within(&words, 100))
        });
        let diagnostic = Diagnostic::error()
            .with_message(text::within(&message, LONGEST))
            .with_labels(labels.collect())
            .with_notes(vec![format!("fix: {}", text::within(&fix, LONGEST))]);
        LoadError(Box::new(Report { excerpt, diagnostic, path: None, cancelled: false }))
    }
}

/// Characters of a message or a fix that are shown.
const LONGEST: usize = 700;
/// Characters of a line that are shown before a place, and behind it.
const AROUND: [usize; 2] = [48, 32];
/// Characters of a place itself that are shown at its beginning, and at its end.
const INSIDE: [usize; 2] = [48, 12];
/// A line up to so many characters is shown whole.
const WHOLE: usize = 120;

/// The lines of a file that have something to show, with what is unseen made visible, and without
/// what is far from it.
struct Excerpt {
    name: String,
    lines: Vec<Line>,
    /// The lines, each with a line end.
    source: String,
    /// Column, as people count, of places in the source.
    columns: Vec<(usize, usize)>,
}

/// A line of an excerpt.
struct Line {
    /// Its number in the file.
    number: usize,
    /// Where it stands in the source, without its line end.
    range: Range<usize>,
}

impl Excerpt {
    /// Takes the lines of some places out of a text, and says where the places are in them. Of a
    /// place over several lines only the first line is taken.
    fn new(
        name: &str,
        text: &str,
        lines_before: usize,
        places: &[Range<usize>],
    ) -> (Self, Vec<Range<usize>>) {
        let mut excerpt = Self {
            name: text::within(name, LONGEST),
            lines: Vec::new(),
            source: String::new(),
            columns: Vec::new(),
        };
        let starts: Vec<usize> = places
            .iter()
            .map(|span| text[..span.start].rfind('\n').map_or(0, |at| at + 1))
            .collect();
        let mut shown = places.to_vec();
        let mut order: Vec<usize> = starts.clone();
        order.sort_unstable();
        order.dedup();
        for &start in &order {
            // The writer of reports sees a gap where two numbers of lines are left out.
            if !excerpt.lines.is_empty() {
                for _ in 0..2 {
                    excerpt.lines.push(Line {
                        number: 0,
                        range: excerpt.source.len()..excerpt.source.len(),
                    });
                    excerpt.source.push('\n');
                }
            }
            let end = text[start..].find('\n').map_or(text.len(), |at| start + at);
            let end = if text[start..end].ends_with('\r') { end - 1 } else { end };
            let here: Vec<usize> = (0..places.len()).filter(|&k| starts[k] == start).collect();
            let spans: Vec<Range<usize>> = here
                .iter()
                .map(|&k| {
                    places[k].start.min(end)..places[k].end.min(end).max(places[k].start.min(end))
                })
                .collect();
            let earlier = memchr::memchr_iter(b'\n', &text.as_bytes()[..start]).count();
            let number = 1 + lines_before + earlier;
            for (k, found) in here.iter().zip(excerpt.line(number, text, start..end, &spans)) {
                shown[*k] = found;
            }
        }
        (excerpt, shown)
    }

    /// Adds a line, and says where the places are in it.
    fn line(
        &mut self,
        number: usize,
        text: &str,
        line: Range<usize>,
        places: &[Range<usize>],
    ) -> Vec<Range<usize>> {
        let begin = self.source.len();
        let mut kept: Vec<Range<usize>> = Vec::new();
        if text[line.clone()].chars().take(WHOLE + 1).count() <= WHOLE {
            kept.push(line.clone());
        } else {
            let back = |from: usize, n: usize| {
                text[line.start..from]
                    .char_indices()
                    .rev()
                    .nth(n - 1)
                    .map_or(line.start, |(at, _)| line.start + at)
            };
            let forth = |from: usize, n: usize| {
                text[from..line.end].char_indices().nth(n).map_or(line.end, |(at, _)| from + at)
            };
            for span in places {
                let (head, tail) = (forth(span.start, INSIDE[0]), back(span.end, INSIDE[1]));
                let (first, last) = (back(span.start, AROUND[0]), forth(span.end, AROUND[1]));
                if head < tail {
                    kept.extend([first..head, tail..last]);
                } else {
                    kept.push(first..last);
                }
            }
            kept.sort_by_key(|part| part.start);
        }
        let mut edges: Vec<usize> = places.iter().flat_map(|span| [span.start, span.end]).collect();
        edges.sort_unstable();
        edges.dedup();
        // Edges, and where they have come to stand.
        let mut stand: Vec<(usize, usize)> = Vec::new();
        let mut at = line.start;
        for part in &kept {
            // Parts overlap; what is between two is left out, if it is longer than what says so.
            let from = if part.start > at + 3 { part.start } else { at };
            if from > at {
                self.source.push_str("...");
            }
            at = from.max(at);
            let upto = part.end.max(at);
            for (offset, c) in text[at..upto].char_indices() {
                if edges.binary_search(&(at + offset)).is_ok() {
                    stand.push((at + offset, self.source.len()));
                }
                if c == '\t' { self.source.push(c) } else { text::push(&mut self.source, c) }
            }
            at = upto;
        }
        stand.push((at, self.source.len()));
        if at < line.end {
            self.source.push_str("...");
        }
        let range = begin..self.source.len();
        self.source.push('\n');
        self.lines.push(Line { number, range: range.clone() });
        let find = |edge: usize| {
            stand.iter().find(|(from, _)| *from == edge).map_or(range.end, |(_, to)| *to)
        };
        places
            .iter()
            .map(|span| {
                let found = find(span.start)..find(span.end);
                self.columns.push((found.start, 1 + text[line.start..span.start].chars().count()));
                found
            })
            .collect()
    }
}

impl<'a> files::Files<'a> for Excerpt {
    type FileId = ();
    type Name = &'a str;
    type Source = &'a str;

    fn name(&'a self, (): ()) -> Result<&'a str, files::Error> {
        Ok(&self.name)
    }

    fn source(&'a self, (): ()) -> Result<&'a str, files::Error> {
        Ok(&self.source)
    }

    fn line_index(&'a self, (): (), byte: usize) -> Result<usize, files::Error> {
        Ok(self.lines.partition_point(|line| line.range.start <= byte).saturating_sub(1))
    }

    fn line_number(&'a self, (): (), index: usize) -> Result<usize, files::Error> {
        Ok(self.lines.get(index).map_or(index + 1, |line| line.number))
    }

    fn column_number(&'a self, (): (), index: usize, byte: usize) -> Result<usize, files::Error> {
        let known = self.columns.iter().find(|(at, _)| *at == byte).map(|(_, column)| *column);
        let range = files::Files::line_range(self, (), index)?;
        Ok(known.unwrap_or_else(|| {
            1 + self.source[range.start..byte.clamp(range.start, range.end)].chars().count()
        }))
    }

    fn line_range(&'a self, (): (), index: usize) -> Result<Range<usize>, files::Error> {
        let max = self.lines.len().saturating_sub(1);
        let line = self.lines.get(index).ok_or(files::Error::LineTooLarge { given: index, max })?;
        Ok(line.range.start..line.range.end + 1)
    }
}

/// Why a scene could not be loaded. Its `Display` is the whole report as plain text, several lines:
/// the message, the file with line and column, the line (of a long one what is near) with a caret,
/// and the fix. Control characters of the file and of names are shown as escapes.
pub struct LoadError(Box<Report>);

struct Report {
    excerpt: Excerpt,
    diagnostic: Diagnostic<()>,
    /// The file, if it is one.
    path: Option<PathBuf>,
    /// Whether nothing is wrong, but the reading was ended.
    cancelled: bool,
}

impl LoadError {
    /// Of a reading that was ended from outside.
    pub(crate) fn cancelled() -> Self {
        let diagnostic = Diagnostic::error().with_message(CANCELLED);
        let excerpt = Excerpt::new("", "", 0, &[]).0;
        Self(Box::new(Report { excerpt, diagnostic, path: None, cancelled: true }))
    }

    /// An error of the whole file, which has no line to show.
    pub(crate) fn of_file(name: &str, problem: impl fmt::Display, fix: &str) -> Self {
        let diagnostic = Diagnostic::error()
            .with_message(format!(
                "{}: {}",
                text::within(name, LONGEST),
                text::within(&problem.to_string(), LONGEST)
            ))
            .with_notes(vec![format!("fix: {fix}")]);
        let excerpt = Excerpt::new(name, "", 0, &[]).0;
        Self(Box::new(Report { excerpt, diagnostic, path: None, cancelled: false }))
    }

    /// The same error, in a file.
    pub(crate) fn in_file(mut self, path: &Path) -> Self {
        self.0.path = Some(path.into());
        self
    }

    /// The report, with the colours of a terminal if asked for.
    pub fn render(&self, color: bool) -> String {
        let Report { excerpt: file, diagnostic, .. } = &*self.0;
        let config = term::Config { chars: term::Chars::ascii(), ..term::Config::default() };
        let mut writer = Ansi { bytes: Vec::new(), color };
        match term::emit_to_write_style(&mut writer, &config, file, diagnostic) {
            Ok(()) => String::from_utf8_lossy(&writer.bytes).trim_end().to_owned(),
            // The place is inside the file by construction; should it ever not be, the message
            // still gets out.
            Err(_) => format!("error: {}", diagnostic.message),
        }
    }

    /// The message alone, one line.
    pub fn message(&self) -> &str {
        &self.0.diagnostic.message
    }

    /// What to do about it, one line.
    pub(crate) fn fix(&self) -> &str {
        let notes = self.0.diagnostic.notes.first().map_or("", String::as_str);
        notes.strip_prefix("fix: ").unwrap_or(notes)
    }

    /// The file that was to be read: the scene file, whose line and column these are, also where
    /// an array that it names is wrong; or the part. None where the text came from elsewhere.
    pub fn path(&self) -> Option<&Path> {
        self.0.path.as_deref()
    }

    /// Whether the reading was cancelled (`load_controlled`): then it is
    /// not known whether anything is wrong.
    pub fn is_cancelled(&self) -> bool {
        self.0.cancelled
    }

    /// The line of the scene file, from 1; none where the whole file is meant.
    pub fn line(&self) -> Option<u32> {
        self.place().map(|place| place[0])
    }

    /// The column, in characters from 1; none where the whole file is meant.
    pub fn column(&self) -> Option<u32> {
        self.place().map(|place| place[1])
    }

    /// Line and column, as the report has them.
    fn place(&self) -> Option<[u32; 2]> {
        let Report { excerpt, diagnostic, .. } = &*self.0;
        let start = diagnostic.labels.first()?.range.start;
        let place = files::Files::location(excerpt, (), start).ok()?;
        let number = |n| u32::try_from(n).unwrap_or(u32::MAX);
        Some([number(place.line_number), number(place.column_number)])
    }
}

impl fmt::Display for LoadError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.render(false))
    }
}

impl fmt::Debug for LoadError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.render(false))
    }
}

impl std::error::Error for LoadError {}

/// Text with, or without, the escape codes of a terminal.
struct Ansi {
    bytes: Vec<u8>,
    color: bool,
}

impl Ansi {
    fn set(&mut self, code: &str) -> io::Result<()> {
        if self.color {
            self.bytes.extend_from_slice(code.as_bytes());
        }
        Ok(())
    }
}

impl io::Write for Ansi {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.bytes.extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl term::WriteStyle for Ansi {
    fn set_header(&mut self, _: Severity) -> io::Result<()> {
        self.set("\x1b[1;31m")
    }

    fn set_header_message(&mut self) -> io::Result<()> {
        self.set("\x1b[1m")
    }

    fn set_line_number(&mut self) -> io::Result<()> {
        self.set("\x1b[34m")
    }

    fn set_note_bullet(&mut self) -> io::Result<()> {
        self.set("\x1b[34m")
    }

    fn set_source_border(&mut self) -> io::Result<()> {
        self.set("\x1b[34m")
    }

    fn set_label(&mut self, _: Severity, style: LabelStyle) -> io::Result<()> {
        self.set(if style == LabelStyle::Primary { "\x1b[31m" } else { "\x1b[36m" })
    }

    fn reset(&mut self) -> io::Result<()> {
        self.set("\x1b[0m")
    }
}
