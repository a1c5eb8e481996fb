//! What a picture says of itself, and the camera that it was drawn with.

use std::{
    fs::File,
    io::{BufReader, Read, Seek, SeekFrom},
    path::Path,
};

use super::LoadError;
use crate::{
    camera::KEY,
    input::mapped::open_regular,
    picture::png::{self, Header, ReadError},
    text,
};

/// The first bytes of a PNG.
const SIGNATURE: [u8; 8] = *b"\x89PNG\r\n\x1a\n";

/// What a file says of itself that begins as a PNG; none of any other, and of what is no file.
///
/// # Errors
/// When the PNG is damaged, or cannot be read.
pub fn header(path: &Path) -> Result<Option<Header>, LoadError> {
    if path == Path::new("-") {
        return Ok(None);
    }
    // What cannot be opened is told by whoever reads it as something else.
    let Ok((file, _)) = open_regular(path) else { return Ok(None) };
    let read = || {
        read(file).map_err(|error| {
            let words = error.to_string();
            let (problem, fix) = words.split_once("; ").unwrap_or((&words, "name another file"));
            LoadError::of_file(&text::name(path), problem, fix)
        })
    };
    read().map_err(|error| error.in_file(path))
}

fn read(mut file: File) -> Result<Option<Header>, ReadError> {
    let mut first = Vec::new();
    Read::by_ref(&mut file).take(SIGNATURE.len() as u64).read_to_end(&mut first)?;
    if first != SIGNATURE {
        return Ok(None);
    }
    file.seek(SeekFrom::Start(0))?;
    png::header(BufReader::new(file)).map(Some)
}

/// The text of the camera that a picture was drawn with; none of what is no picture.
///
/// # Errors
/// When a picture has none, or cannot be read.
pub(super) fn camera(path: &Path) -> Result<Option<String>, LoadError> {
    let Some(header) = header(path)? else { return Ok(None) };
    let found = header.text.into_iter().find(|(key, _)| key == KEY);
    found.map(|(_, table)| Some(table)).ok_or_else(|| {
        LoadError::of_file(
            &text::name(path),
            "is a picture that does not say from where it was drawn",
            "name one that `planisphere render` has written without --no-metadata, or a scene",
        )
    })
}
