//! OpenEXR: planes of floats and of whole numbers, without loss.
//!
//! The file is of the plainest kind that every reader knows: one part, rows from the top, in chunks
//! of 16 that are compressed with ZIP. The format is that of the OpenEXR project ("OpenEXR File
//! Layout"). Its one Rust crate brings packages of which nothing else here is built; the tests read
//! with it what is written here.

use std::{
    collections::BTreeSet,
    io::{self, Write},
};

use flate2::{Compress, Compression, FlushCompress, Status};
use rayon::prelude::*;

use crate::png::invalid;
use planisphere_core::text;

/// The first four bytes, and the version.
const BEGIN: [u8; 8] = [0x76, 0x2f, 0x31, 0x01, 2, 0, 0, 0];
/// What is added to the version's second byte where a name has more than 31 bytes.
const LONG_NAMES: u8 = 4;
/// Most bytes of a name without and with that.
const NAME: [usize; 2] = [31, 255];
/// ZIP of 16 rows.
const ZIP: u8 = 3;
/// Rows of a chunk.
const ROWS: usize = 16;
/// As other programs that write the format do.
const LEVEL: u32 = 4;
/// Attributes that every file has.
const REQUIRED: [&str; 8] = [
    "channels",
    "compression",
    "dataWindow",
    "displayWindow",
    "lineOrder",
    "pixelAspectRatio",
    "screenWindowCenter",
    "screenWindowWidth",
];

/// A plane of numbers, row by row.
#[derive(Clone, Copy, Debug)]
pub enum Channel<'a> {
    /// Floats.
    F32(&'a [f32]),
    /// Whole numbers, such as ids; `u32::MAX` stands for none.
    U32(&'a [u32]),
    /// Whole numbers, of which -1 is written as `u32::MAX`.
    Ids(&'a [i32]),
    /// One float of each three.
    Of3(&'a [[f32; 3]], usize),
    /// One float of each four.
    Of4(&'a [[f32; 4]], usize),
}

impl Channel<'_> {
    fn len(self) -> usize {
        match self {
            Self::F32(values) => values.len(),
            Self::U32(values) => values.len(),
            Self::Ids(values) => values.len(),
            Self::Of3(values, _) => values.len(),
            Self::Of4(values, _) => values.len(),
        }
    }

    /// The number of its type in a file.
    fn number(self) -> u32 {
        match self {
            Self::F32(_) | Self::Of3(..) | Self::Of4(..) => 2,
            Self::U32(_) | Self::Ids(_) => 0,
        }
    }

    /// Adds some of its values as they lie in a file.
    fn bytes(self, place: std::ops::Range<usize>, out: &mut Vec<u8>) {
        match self {
            Self::F32(values) => out.extend(values[place].iter().flat_map(|v| v.to_le_bytes())),
            Self::U32(values) => out.extend(values[place].iter().flat_map(|v| v.to_le_bytes())),
            Self::Ids(values) => out.extend(values[place].iter().flat_map(|v| v.to_le_bytes())),
            Self::Of3(values, at) => {
                out.extend(values[place].iter().flat_map(|v| v[at].to_le_bytes()));
            }
            Self::Of4(values, at) => {
                out.extend(values[place].iter().flat_map(|v| v[at].to_le_bytes()));
            }
        }
    }
}

/// Writes planes as OpenEXR, with texts as attributes.
///
/// Colours are the channels `R`, `G`, `B`, in linear light, with the primaries of sRGB, and `A`;
/// colours are multiplied by alpha, as the format has it. Others are named by what they are, such
/// as `depth.Z`, `normal.X` or `id`. They may come in any order.
///
/// # Errors
/// The writer's; of the kind `InvalidInput` when there is no channel or no pixel, a plane has
/// another size, or a name is given twice or is none that the format holds.
pub fn write_exr(
    mut out: impl Write,
    size: [u32; 2],
    channels: &[(&str, Channel)],
    text: &[(String, String)],
) -> io::Result<()> {
    check(size, channels, text)?;
    let mut sorted = channels.to_vec();
    sorted.sort_unstable_by_key(|(name, _)| *name);
    let header = header(size, &sorted, text);
    let [width, height] = size.map(|side| side as usize);
    let chunks: Vec<Vec<u8>> = (0..height.div_ceil(ROWS))
        .into_par_iter()
        .map(|chunk| {
            let mut bytes = Vec::new();
            for y in ROWS * chunk..height.min(ROWS * (chunk + 1)) {
                for (_, channel) in &sorted {
                    channel.bytes(y * width..(y + 1) * width, &mut bytes);
                }
            }
            zipped(bytes)
        })
        .collect::<io::Result<_>>()?;
    out.write_all(&header)?;
    let mut at = (header.len() + 8 * chunks.len()) as u64;
    for chunk in &chunks {
        out.write_all(&at.to_le_bytes())?;
        at += 8 + chunk.len() as u64;
    }
    for (k, chunk) in chunks.iter().enumerate() {
        out.write_all(&((ROWS * k) as u32).to_le_bytes())?;
        out.write_all(&(chunk.len() as u32).to_le_bytes())?;
        out.write_all(chunk)?;
    }
    out.flush()
}

/// Refuses what a file cannot hold.
fn check(
    [width, height]: [u32; 2],
    channels: &[(&str, Channel)],
    texts: &[(String, String)],
) -> io::Result<()> {
    let chunk = u64::from(width) * (4 * ROWS * channels.len()) as u64;
    if [width, height, 1].contains(&0) || height > i32::MAX as u32 || chunk > i32::MAX as u64 {
        return Err(invalid(format!(
            "{} channels of {width} x {height} pixels are none that an OpenEXR picture holds",
            channels.len()
        )));
    }
    if channels.is_empty() {
        return Err(invalid("an OpenEXR picture has no channel; give it one such as R"));
    }
    let pixels = u64::from(width) * u64::from(height);
    let mut names = BTreeSet::new();
    for (name, channel) in channels {
        check_name("channel", name, names.insert(*name))?;
        if channel.len() as u64 != pixels {
            return Err(invalid(format!(
                "the channel `{}` has {} values where the picture has {width} x {height}",
                text::value(name),
                channel.len()
            )));
        }
    }
    let mut names = BTreeSet::from(REQUIRED);
    for (name, value) in texts {
        check_name("text", name, names.insert(name))?;
        if i32::try_from(value.len()).is_err() {
            return Err(invalid(format!("the text `{}` is too long", text::value(name))));
        }
    }
    Ok(())
}

/// Refuses a name that a file cannot hold, or that is there already.
fn check_name(what: &str, name: &str, is_new: bool) -> io::Result<()> {
    let shown = format!("`{}`", text::value(name));
    if !is_new {
        return Err(invalid(format!(
            "an OpenEXR picture has one {shown} alone; name the {what} \
                                    otherwise"
        )));
    }
    if !(1..=NAME[1]).contains(&name.len()) || !name.chars().all(|c| matches!(c, ' '..='~')) {
        return Err(invalid(format!(
            "{shown} is no name of a {what} in an OpenEXR picture; give it 1 to {} characters of \
             ASCII",
            NAME[1]
        )));
    }
    Ok(())
}

/// All that comes before the places of the chunks.
fn header(size: [u32; 2], channels: &[(&str, Channel)], text: &[(String, String)]) -> Vec<u8> {
    let names = channels.iter().map(|(name, _)| *name).chain(text.iter().map(|(key, _)| &**key));
    let mut out = BEGIN.to_vec();
    if names.map(str::len).any(|length| length > NAME[0]) {
        out[5] |= LONG_NAMES;
    }
    let mut attribute = |name: &str, kind: &str, value: &[u8]| {
        out.extend([name.as_bytes(), &[0], kind.as_bytes(), &[0]].concat());
        out.extend((value.len() as u32).to_le_bytes());
        out.extend(value);
    };
    let mut list = Vec::new();
    for (name, channel) in channels {
        list.extend([name.as_bytes(), &[0]].concat());
        // Its values are not for an eye that sees logarithms; a value for each pixel.
        for number in [channel.number(), 0, 1, 1] {
            list.extend(number.to_le_bytes());
        }
    }
    list.push(0);
    let window: Vec<u8> =
        [0, 0, size[0] - 1, size[1] - 1].iter().flat_map(|v| v.to_le_bytes()).collect();
    attribute("channels", "chlist", &list);
    attribute("compression", "compression", &[ZIP]);
    attribute("dataWindow", "box2i", &window);
    attribute("displayWindow", "box2i", &window);
    attribute("lineOrder", "lineOrder", &[0]);
    attribute("pixelAspectRatio", "float", &1f32.to_le_bytes());
    attribute("screenWindowCenter", "v2f", &[0; 8]);
    attribute("screenWindowWidth", "float", &1f32.to_le_bytes());
    for (key, value) in text {
        attribute(key, "string", value.as_bytes());
    }
    out.push(0);
    out
}

/// A chunk as it lies in a file: compressed, unless that is no shorter.
fn zipped(bytes: Vec<u8>) -> io::Result<Vec<u8>> {
    // First bytes of even places, then those of odd ones, each as the difference to the one before.
    let halves = bytes.iter().step_by(2).chain(bytes.iter().skip(1).step_by(2));
    let mut laid: Vec<u8> = halves.copied().collect();
    for k in (1..laid.len()).rev() {
        laid[k] = laid[k].wrapping_sub(laid[k - 1]).wrapping_add(128);
    }
    // What has no room here is not shorter.
    let mut zipped = Vec::with_capacity(bytes.len());
    let mut zip = Compress::new(Compression::new(LEVEL), true);
    let status = zip.compress_vec(&laid, &mut zipped, FlushCompress::Finish)?;
    Ok(if status == Status::StreamEnd && zipped.len() < bytes.len() { zipped } else { bytes })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_of_vectors_are_channels() {
        let size = [5, 40];
        let number = |k: usize| (k * k % 997) as f32 / 7.0;
        let threes: Vec<[f32; 3]> = (0..200).map(|k| [k, k + 1, k + 2].map(number)).collect();
        let fours: Vec<[f32; 4]> = (0..200).map(|k| [k, 2 * k, 3 * k, 1].map(number)).collect();
        let ids: Vec<i32> = (0..200).map(|k| k % 7 - 1).collect();
        let whole = |at: usize| threes.iter().map(|three| three[at]).collect::<Vec<f32>>();
        let (z, g) = (whole(2), fours.iter().map(|four| four[1]).collect::<Vec<f32>>());
        let numbers: Vec<u32> = ids.iter().map(|&id| id as u32).collect();
        let write = |channels: &[(&str, Channel)]| {
            let mut out = Vec::new();
            write_exr(&mut out, size, channels, &[]).unwrap();
            out
        };
        let parts = write(&[
            ("G", Channel::Of4(&fours, 1)),
            ("normal.Z", Channel::Of3(&threes, 2)),
            ("id", Channel::Ids(&ids)),
        ]);
        let alone = write(&[
            ("G", Channel::F32(&g)),
            ("normal.Z", Channel::F32(&z)),
            ("id", Channel::U32(&numbers)),
        ]);
        assert!(parts == alone && numbers.contains(&u32::MAX));
    }
}
