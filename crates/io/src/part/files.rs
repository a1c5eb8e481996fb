//! Reads parts of pictures from files, which are mapped.

use std::{
    io,
    path::{Path, PathBuf},
    sync::Arc,
};

use rayon::prelude::*;

use super::read::{PartProblem, read};
use crate::{
    input::{
        mapped::{Mapped, OpenError, open_regular},
        report::LoadError,
    },
    load::{ChangedFile, Watch},
};
use planisphere_core::{part::Part, text};

/// What to do about a file that is no part, or no longer one.
const FIX: &str =
    "write it with `planisphere render SCENE --visibility FILE.npz`, and copy it whole";

/// Reads a part. The file stays mapped: it must not be changed while the part is in use. [`parts`]
/// lets one know.
///
/// # Errors
/// When it cannot be read, is not a part, or not as it was written.
pub fn part(path: &Path) -> Result<Part, LoadError> {
    watched(path).map(|(part, _)| part)
}

/// Reads parts, and watches their files, which stay mapped: before a picture that was merged of
/// them is used, [`Watch::changed`] is asked.
///
/// # Errors
/// As [`part`].
pub fn parts(paths: &[PathBuf]) -> Result<(Vec<Part>, Watch), LoadError> {
    let read: Vec<_> =
        paths.par_iter().map(|path| watched(path)).collect::<Result<_, LoadError>>()?;
    let (parts, files) = read.into_iter().unzip();
    Ok((parts, Watch(files)))
}

fn watched(path: &Path) -> Result<(Part, Arc<Mapped>), LoadError> {
    let name = text::name(path);
    let refused =
        |problem: String, fix: &str| LoadError::of_file(&name, problem, fix).in_file(path);
    let unread =
        |error: io::Error| refused(format!("cannot be read: {error}"), OpenError::fix(&error));
    let (file, metadata) = open_regular(path).map_err(|error| match error {
        OpenError::Missing => refused(error.to_string(), "correct the name of the part"),
        OpenError::NotRegular(_) => refused(error.to_string(), FIX),
        OpenError::Io(error) => unread(error),
    })?;
    if metadata.len() == 0 {
        return Err(refused("is empty".into(), FIX));
    }
    let file = Mapped::new(path, file).map_err(unread)?;
    let part = read(&name, file.bytes());
    if file.changed().is_some() {
        return Err(refused(ChangedFile::PROBLEM.into(), ChangedFile::FIX));
    }
    let part = part.map_err(|error| {
        let fix = match error.problem {
            PartProblem::Damaged(_) => FIX,
            ref other => other.fix(),
        };
        refused(error.problem.to_string(), fix)
    })?;
    Ok((part, file))
}
