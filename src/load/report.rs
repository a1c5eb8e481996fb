//! What is wrong with an input, where, and what to do: one error type that prints itself with the line and a caret.

use std::{fmt, io, ops::Range};

use codespan_reporting::{
    diagnostic::{Diagnostic, Label, LabelStyle, Severity},
    files::SimpleFile,
    term,
};

/// A fault at a place in a scene file, before the file's name and text are joined to it.
#[derive(Debug)]
pub(super) struct Fault(Box<Parts>);

#[derive(Debug)]
struct Parts {
    message: String,
    /// Bytes of the file, and what is wrong with them in few words.
    place: (Range<usize>, String),
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
        Self(Box::new(Parts { message: message.into(), place: (span, label.into()), other: None, fix: fix.into() }))
    }

    /// Adds a second place.
    pub fn and(mut self, span: Range<usize>, label: impl Into<String>) -> Self {
        self.0.other = Some((span, label.into()));
        self
    }

    /// Joins the file's name and text.
    pub fn into_error(self, name: &str, text: &str) -> LoadError {
        let Parts { message, place, other, fix } = *self.0;
        let clamp = |span: Range<usize>| {
            let start = text.floor_char_boundary(span.start);
            start..text.ceil_char_boundary(span.end).max(start)
        };
        let mut labels = vec![Label::primary((), clamp(place.0)).with_message(place.1)];
        labels.extend(other.map(|(span, words)| Label::secondary((), clamp(span)).with_message(words)));
        let diagnostic =
            Diagnostic::error().with_message(message).with_labels(labels).with_notes(vec![format!("fix: {fix}")]);
        LoadError(Box::new((SimpleFile::new(name.into(), text.into()), diagnostic)))
    }
}

/// Why a scene could not be loaded. Its `Display` is the whole report as plain text, several lines: the message, the
/// file with line and column, the line with a caret, and the fix.
pub struct LoadError(Box<(SimpleFile<String, String>, Diagnostic<()>)>);

impl LoadError {
    /// An error of the whole file, which has no line to show.
    pub(super) fn of_file(name: &str, problem: impl fmt::Display, fix: &str) -> Self {
        let diagnostic =
            Diagnostic::error().with_message(format!("{name}: {problem}")).with_notes(vec![format!("fix: {fix}")]);
        Self(Box::new((SimpleFile::new(name.into(), String::new()), diagnostic)))
    }

    /// An error whose message names the file itself.
    pub(super) fn of_message(message: &str, fix: &str) -> Self {
        let diagnostic = Diagnostic::error().with_message(message).with_notes(vec![format!("fix: {fix}")]);
        Self(Box::new((SimpleFile::new(String::new(), String::new()), diagnostic)))
    }

    /// The report, with the colours of a terminal if asked for.
    pub fn render(&self, color: bool) -> String {
        let (file, diagnostic) = &*self.0;
        let config = term::Config { chars: term::Chars::ascii(), ..term::Config::default() };
        let mut writer = Ansi { bytes: Vec::new(), color };
        match term::emit_to_write_style(&mut writer, &config, file, diagnostic) {
            Ok(()) => String::from_utf8_lossy(&writer.bytes).trim_end().to_owned(),
            // The place is inside the file by construction; should it ever not be, the message still gets out.
            Err(_) => format!("error: {}", diagnostic.message),
        }
    }

    /// The message alone, one line.
    pub fn message(&self) -> &str {
        &self.0.1.message
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
