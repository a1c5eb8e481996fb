//! How bytes come in, and what is said of those that are wrong: files that are mapped while others
//! may change them, streams that can be cancelled, and errors that point.
//!
//! This module knows no format.

pub(crate) mod mapped;
pub(crate) mod named;
pub(crate) mod refused;
pub(crate) mod report;
pub(crate) mod stream;
