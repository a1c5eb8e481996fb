//! One golden and what is drawn, held against each other: colours by colours, ids by ids.

use std::{io::Cursor, path::Path};

use serde::Serialize;

use super::{super::Failure, count};
use planisphere_io::{
    load,
    npy::Integers,
    picture::png::{self, Decoded, ReadError},
    text,
};
use planisphere_renderer::{Compared, Picture, compare};

/// Ids that differ and are told with their places.
const TOLD: usize = 10;

/// What becomes of a golden, and of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum State {
    /// It is right, and was to be written if it were not.
    Unchanged,
    /// It was written.
    Blessed,
    /// It is right, or what is tolerated.
    Passed,
    /// It is not there.
    Missing,
    /// Pixels differ, or sizes.
    Failed,
    /// Nothing was compared.
    Error,
}

impl State {
    /// Whether the check has failed.
    pub fn fails(self) -> bool {
        matches!(self, Self::Missing | Self::Failed)
    }
}

/// How goldens are held against pictures.
#[derive(Clone, Copy, Debug)]
pub(super) struct How {
    /// Whether they are to be replaced: what cannot be read fails, and is no error.
    pub bless: bool,
    /// Pixels that may differ.
    pub max_different: u64,
    /// How far a channel may be off.
    pub max_delta: u8,
    /// Whether the whole picture is drawn.
    pub whole: bool,
}

/// What was found of a golden.
pub(super) struct Finding<P> {
    /// Its name.
    pub golden: String,
    /// What becomes of it.
    pub state: State,
    /// Pixels that differ; none where nothing was compared pixel by pixel.
    pub different: Option<u64>,
    /// The greatest difference of a channel.
    pub greatest: Option<u8>,
    /// The first pixels that differ.
    pub first: Vec<P>,
    /// What is to be said of it, one line; empty where all is well.
    pub words: String,
}

/// A pixel that differs.
#[derive(Serialize)]
pub(super) struct Pixel {
    /// Column and row.
    pub pixel: [u32; 2],
    /// Red, green, blue, alpha of the golden.
    pub expected: [u8; 4],
    /// What is drawn.
    pub actual: [u8; 4],
    /// The spheres that are drawn there; null for none.
    pub spheres: [Option<i32>; 1],
}

/// A pixel at which another sphere is seen.
#[derive(Serialize)]
pub(super) struct IdPixel {
    /// Column and row.
    pub pixel: [u32; 2],
    /// The id of the golden, as it is there.
    pub expected: i128,
    /// What is drawn, -1 for none.
    pub actual: i32,
}

impl<P> Finding<P> {
    /// One of which no pixel was compared.
    fn unseen(golden: &Path, state: State, words: String) -> Self {
        let golden = text::name(golden);
        Self { golden, state, different: None, greatest: None, first: Vec::new(), words }
    }

    fn missing(golden: &Path) -> Self {
        let words = format!("there is no golden {}; --bless writes it", text::name(golden));
        Self::unseen(golden, State::Missing, words)
    }
}

/// Why a golden cannot be compared.
fn unread(golden: &Path, words: &str) -> Failure {
    Failure::Usage(format!("{} {words}", text::name(golden)))
}

/// What cannot be read, where it is to be replaced: a picture, or what stands for one, may be.
fn replaced<P>(golden: &Path, words: &str, own: bool) -> Result<Finding<P>, Failure> {
    if own {
        let words = format!("{} {words}", text::name(golden));
        return Ok(Finding::unseen(golden, State::Failed, words));
    }
    Err(Failure::Usage(format!(
        "{} {}; --bless replaces goldens only: remove it first, or give another name",
        text::name(golden),
        words.split(';').next().unwrap_or_default()
    )))
}

/// Compares colours. The golden comes back where it has the size of the picture.
pub(super) fn picture(
    path: &Path,
    drawn: &Picture,
    how: How,
) -> Result<(Finding<Pixel>, Option<Decoded>), Failure> {
    let Some(bytes) = load::whole(path)? else { return Ok((Finding::missing(path), None)) };
    // A picture of another size need not be unpacked.
    let most = 4 * drawn.ids().len() as u64;
    let golden = match png::size(Cursor::new(&bytes)) {
        Ok(size) if size != drawn.size() => {
            let words = other_size(path, size, drawn.size(), how.whole);
            return Ok((Finding::unseen(path, State::Failed, words), None));
        }
        size => size.and_then(|_| png::read(Cursor::new(&bytes), most)),
    };
    drop(bytes);
    match golden {
        Ok(golden) => Ok((colors(path, &golden, drawn, how), Some(golden))),
        Err(error) if how.bless => {
            use ReadError::{Io, Other, TooLarge, Unknown};
            let own = !matches!(error, Other(_) | Unknown(_) | TooLarge { .. } | Io(_));
            replaced(path, &error.to_string(), own).map(|finding| (finding, None))
        }
        Err(error) => Err(unread(path, &error.to_string())),
    }
}

fn other_size(path: &Path, golden: [u32; 2], drawn: [u32; 2], whole: bool) -> String {
    let ([across, down], [width, height]) = (golden, drawn);
    let name = text::name(path);
    let fix = if whole {
        format!("; --size {across}x{down} draws the golden's size")
    } else {
        String::new()
    };
    format!("{name} has {across} x {down} pixels, and {width} x {height} are drawn{fix}")
}

/// Compares the colours of a picture of the golden's size.
fn colors(path: &Path, golden: &Decoded, drawn: &Picture, how: How) -> Finding<Pixel> {
    let wanted = Compared { size: golden.size, rgba: &golden.pixels };
    let all = compare(wanted, drawn.pixels(), 0);
    let counted = match how.max_delta {
        0 => all.clone(),
        delta => compare(wanted, drawn.pixels(), delta),
    };
    let pixels = golden.pixels.len() as u64;
    let differ = |pixels: u64| if pixels == 1 { "differs" } else { "differ" };
    let (state, words) = if all.is_none() {
        (State::Passed, String::new())
    } else if counted.pixels <= how.max_different {
        let found = all.pixels;
        let words = format!(
            "{} of {} pixels {}, by {} at most, which is tolerated",
            count(found),
            count(pixels),
            differ(found),
            all.greatest
        );
        (State::Passed, words)
    } else {
        let than = match how.max_delta {
            0 => String::new(),
            delta => format!(" by more than {delta}"),
        };
        let words = format!(
            "{} of {} pixels {}{than}, by {} at most",
            count(counted.pixels),
            count(pixels),
            differ(counted.pixels),
            all.greatest
        );
        (State::Failed, words)
    };
    let width = golden.size[0] as usize;
    let told = |&(pixel, expected, actual): &([u32; 2], _, _)| {
        let id = drawn.ids()[pixel[1] as usize * width + pixel[0] as usize];
        Pixel { pixel, expected, actual, spheres: [(id >= 0).then_some(id)] }
    };
    Finding {
        golden: text::name(path),
        state,
        different: Some(counted.pixels),
        greatest: Some(all.greatest),
        first: counted.first.iter().map(told).collect(),
        words,
    }
}

/// Compares ids, whatever the width of the golden's integers.
pub(super) fn ids(path: &Path, drawn: &Picture, how: How) -> Result<Finding<IdPixel>, Failure> {
    let Some(bytes) = load::whole(path)? else { return Ok(Finding::missing(path)) };
    let own = bytes.is_empty()
        || bytes.starts_with(b"\x93NUMPY")
        || bytes.starts_with(b"version https://git-lfs");
    let golden = match Integers::read(bytes) {
        Ok(golden) => golden,
        Err(error) if how.bless => return replaced(path, &error.to_string(), own),
        Err(error) => return Err(unread(path, &error.to_string())),
    };
    let [width, height] = drawn.size().map(|side| side as usize);
    let [rows, columns] = golden.shape();
    if [rows, columns] != [height, width] {
        let words = format!(
            "{} has the shape ({rows}, {columns}), and ({height}, {width}) is drawn",
            text::name(path)
        );
        return Ok(Finding::unseen(path, State::Failed, words));
    }
    let (mut different, mut first) = (0, Vec::new());
    for (at, (expected, &actual)) in golden.iter().zip(drawn.ids()).enumerate() {
        if expected == i128::from(actual) {
            continue;
        }
        different += 1;
        if first.len() < TOLD {
            let pixel = [(at % width) as u32, (at / width) as u32];
            first.push(IdPixel { pixel, expected, actual });
        }
    }
    let name = text::name(path);
    let pixels = drawn.ids().len() as u64;
    let words = || format!("{} of {} ids differ from {name}", count(different), count(pixels));
    let (state, words) = match different {
        0 => (State::Passed, String::new()),
        some if some <= how.max_different => {
            (State::Passed, format!("{}, which is tolerated", words()))
        }
        _ => (State::Failed, words()),
    };
    let golden = text::name(path);
    Ok(Finding { golden, state, different: Some(different), greatest: None, first, words })
}
