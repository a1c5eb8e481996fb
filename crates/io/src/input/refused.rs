//! Why a file is refused, before it is told for which file and at which place.

use crate::input::report::CANCELLED;
use planisphere_core::drawing::Control;

/// Why a file is not what can be used, and what to do about it: one line each.
#[derive(Clone, Debug, thiserror::Error)]
#[error("{words}")]
pub(crate) struct Refused {
    /// What is wrong, to be read after the file's name.
    pub words: String,
    /// What to do. Where that is written in Python, `array` is what the file holds.
    pub fix: String,
}

impl Refused {
    pub fn new(words: impl Into<String>, fix: impl Into<String>) -> Self {
        Self { words: words.into(), fix: fix.into() }
    }

    /// Ends what is read once it is cancelled; whoever loads then says so in place of this.
    pub fn if_cancelled(control: &Control) -> Result<(), Self> {
        if control.is_cancelled() { Err(Self::new(CANCELLED, "")) } else { Ok(()) }
    }
}
