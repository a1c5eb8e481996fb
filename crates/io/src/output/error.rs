//! Why output could not be written, in words that name the fix.

use std::{io, path::PathBuf};

use planisphere_core::text;

/// Why output could not be written.
#[derive(Debug, thiserror::Error)]
pub enum OutputError {
    /// The folder of the target is not there.
    #[error(
        "cannot write {}: there is no folder {}; make it first",
        text::name(.target), text::name(.folder)
    )]
    NoFolder {
        /// The file.
        target: PathBuf,
        /// Its folder.
        folder: PathBuf,
    },
    /// The target is a folder.
    #[error("cannot write {}: it is a folder; name a file", text::name(.0))]
    IsFolder(PathBuf),
    /// The target has no name.
    #[error("cannot write a file whose name is empty; name a file")]
    NoName,
    /// The target is a disk.
    #[error("cannot write {}: it is a disk (a block device), which would lose what it holds; name \
             a file", text::name(.0))]
    IsDisk(PathBuf),
    /// Nobody may write the file.
    #[error("cannot write {}: it is read-only; `chmod u+w` it if it may be replaced, or name \
             another file", text::name(.0))]
    ReadOnly(PathBuf),
    /// No file can be made in the folder.
    #[error(
        "cannot write {}: you may not make files in the folder {}; name a file in a folder of \
         your own",
        text::name(.target), text::name(.folder)
    )]
    FolderReadOnly {
        /// The file.
        target: PathBuf,
        /// Its folder.
        folder: PathBuf,
    },
    /// A stream that nobody has opened.
    #[error(
        "cannot write: {} is closed; open it ({}), or name a file",
        words(*.0), opened(*.0)
    )]
    Closed(i32),
    /// A stream that is an input.
    #[error("cannot write: {} is open for reading only; open it for writing ({}), or name a file",
        words(*.0), opened(*.0))]
    NotForWriting(i32),
    /// An ending that stands for another format.
    #[error(
        "{option} {}: {what} is written as .{ending}; name it {}",
        text::name(.target), text::name(.better)
    )]
    Ending {
        /// What the name was given for.
        option: String,
        /// What is to be written.
        what: &'static str,
        /// The name.
        target: PathBuf,
        /// The ending of what is written.
        ending: &'static str,
        /// A name that has it.
        better: PathBuf,
    },
    /// The system refused.
    #[error("cannot write {target}: {source}")]
    Io {
        /// The file, or `standard output`.
        target: String,
        /// The system's words.
        source: io::Error,
    },
}

/// A descriptor in words.
fn words(number: i32) -> String {
    match number {
        0 => "standard input".into(),
        1 => "standard output".into(),
        2 => "standard error".into(),
        other => format!("descriptor {other}"),
    }
}

/// What in a shell opens it.
fn opened(number: i32) -> String {
    match number {
        1 => "leave out >&-, or add >FILE".into(),
        other => format!("add {other}>FILE"),
    }
}
