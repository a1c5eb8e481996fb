//! An input by its name: what is wrong with it is told under that.

use std::path::Path;

use crate::input::{
    refused::Refused,
    report::{Fault, LoadError},
};
use planisphere_core::{drawing::Control, text};

/// An input on its way in: its path, and its name in messages.
pub(crate) struct Named<'p> {
    /// As it was given.
    pub path: &'p Path,
    /// Whether it is standard input.
    pub from_stdin: bool,
    /// What it is called.
    pub name: String,
}

impl<'p> Named<'p> {
    /// Of a path, or `-`.
    pub fn of(path: &'p Path) -> Self {
        let from_stdin = path == Path::new("-");
        let name = if from_stdin { "<stdin>".into() } else { text::name(path) };
        Self { path, from_stdin, name }
    }

    /// Reads it; an error is in this file, or says that it was cancelled.
    pub fn finish<T>(
        &self,
        control: &Control,
        read: impl FnOnce(&Self) -> Result<T, LoadError>,
    ) -> Result<T, LoadError> {
        read(self).map_err(|error| match (control.is_cancelled(), self.from_stdin) {
            // What was looked at in part may have any fault.
            (true, _) => LoadError::cancelled(),
            (false, true) => error,
            (false, false) => error.in_file(self.path),
        })
    }

    /// Why it was refused, with its name.
    pub fn refused(&self, refused: &Refused) -> LoadError {
        LoadError::of_file(&self.name, &refused.words, &refused.fix)
    }

    /// Bytes as text.
    pub fn text(&self, bytes: Vec<u8>) -> Result<String, LoadError> {
        String::from_utf8(bytes).map_err(|error| {
            let at = error.utf8_error().valid_up_to();
            let byte = error.as_bytes().get(at).copied().unwrap_or_default();
            let message = format!(
                "the scene file is not UTF-8 text: it has the byte 0x{byte:02x} where a \
                         character begins"
            );
            let fault = Fault::new(
                message,
                at..at,
                "not UTF-8",
                "save it as UTF-8, not as Latin-1 or \
                    another encoding",
            );
            fault.into_error(&self.name, &String::from_utf8_lossy(error.as_bytes()))
        })
    }
}
