//! GSD files of HOOMD-blue: what `hoomd` and `gsd.hoomd` write.
//!
//! The format: gsd.readthedocs.io, "File layer" and "HOOMD Schema". A file is a header, an index
//! whose entries say where each chunk of each frame lies, names of chunks, and the chunks, all with
//! the little end first. A chunk that a frame lacks is that of the first frame, where that has as
//! many particles, or else a default. A frame's place is its number.

use std::{collections::HashSet, ops::Range};

use super::{
    Cell, Column, Data, Particles, Reader, Role, Values, Words,
    binary::{all_finite, numbers, room, take},
};
use crate::input::report::Fault;
use planisphere_core::{drawing::Control, scene::Reals, text};

/// What a file begins with.
const MAGIC: [u8; 8] = 0x65DF_65DF_65DF_65DF_u64.to_le_bytes();

/// Bytes of an entry of the index.
const ENTRY: usize = 32;

/// Bytes of a name, before version 2; of a unit of names, since.
const NAME: usize = 64;

/// Positions without a chunk of their own take no more than this of memory, and the file's length.
const SLACK: usize = 1 << 25;

/// Whether bytes begin as a GSD file does.
pub(super) fn is(beginning: &[u8]) -> bool {
    beginning.starts_with(&MAGIC)
}

/// A reader.
pub(super) fn open(data: &Data) -> Result<Box<dyn Reader>, Fault> {
    Ok(Box::new(Gsd::open(data.as_slice())?))
}

#[derive(Debug)]
struct Gsd {
    /// The names of chunks, in the order of their numbers.
    names: Vec<Box<str>>,
    /// Where the index begins.
    index: usize,
    /// How many entries are in use.
    entries: usize,
    /// How many frames there are.
    frames: usize,
}

/// An entry of the index: where a chunk of a frame lies.
#[derive(Clone, Copy, Debug)]
struct Entry {
    frame: u64,
    rows: u64,
    location: i64,
    width: u32,
    name: u16,
    kind: u8,
}

/// A chunk that is there.
#[derive(Clone, Copy, Debug)]
struct Chunk<'a> {
    rows: usize,
    width: usize,
    kind: u8,
    bytes: &'a [u8],
}

impl Reader for Gsd {
    fn frame(&self, data: &Data, at: usize) -> Result<Option<Range<usize>>, Fault> {
        if at >= self.frames {
            return Ok(None);
        }
        for entry in self.of_frame(data.as_slice(), at) {
            self.name(&entry)?;
            entry.chunk(data.as_slice())?;
        }
        Ok(Some(at..at + 1))
    }

    fn read(
        &self,
        data: &Data,
        frame: Range<usize>,
        control: &Control,
    ) -> Result<Particles, Fault> {
        Fault::if_cancelled(control)?;
        Frame { gsd: self, whole: data.as_slice(), number: frame.start }.read(control)
    }
}

fn cut_short(what: &str, location: u64, end: u64, length: usize) -> Fault {
    Fault::whole(
        format!(
            "{what} lies at bytes {location} to {end}, but the file has {length} bytes: it is cut \
             short"
        ),
        "wait until the file is written, or copy it again",
    )
}

impl Gsd {
    fn open(whole: &[u8]) -> Result<Self, Fault> {
        let word = |at: usize| take(whole, 8 * at).map(u64::from_le_bytes);
        if !is(whole) {
            return Err(Fault::whole(
                "the file does not begin as GSD files do",
                "write it again with HOOMD-blue or gsd.hoomd, or name its format: --format",
            ));
        }
        let short = || cut_short("the header", 0, 256, whole.len());
        let [Some(index), Some(entries), Some(names), Some(units), Some(versions)] =
            [word(1), word(2), word(3), word(4), word(5)]
        else {
            return Err(short());
        };
        let schema = whole.get(112..176).ok_or_else(short)?;
        let schema = schema.split(|byte| *byte == 0).next().unwrap_or_default();
        if schema != b"hoomd" {
            let found = text::value(&String::from_utf8_lossy(schema));
            return Err(Fault::whole(
                format!("the file is of the schema `{found}`, which is not known"),
                "write it with HOOMD-blue or gsd.hoomd, whose schema is `hoomd`",
            ));
        }
        let major = versions >> 48;
        if major > 2 {
            return Err(Fault::whole(
                format!("the file is of version {major} of GSD, but 1 and 2 are known"),
                "write it again with an older version of gsd",
            ));
        }
        let block = |what: &str, location: u64, count: u64, size: usize| {
            let end = count.saturating_mul(size as u64).saturating_add(location);
            let range = usize::try_from(location).ok().zip(usize::try_from(end).ok());
            let bytes = range.and_then(|(start, end)| whole.get(start..end));
            bytes.ok_or_else(|| cut_short(what, location, end, whole.len()))
        };
        let names = block("the list of names", names, units, NAME)?;
        let index_bytes = block("the index", index, entries, ENTRY)?;
        let mut gsd = Self {
            names: read_names(names, major < 2),
            index: usize::try_from(index).unwrap_or(usize::MAX),
            entries: index_bytes.len() / ENTRY,
            frames: 0,
        };
        gsd.count_frames(whole)?;
        Ok(gsd)
    }

    /// Looks at all entries: those behind the first without a place are not in use, and the
    /// numbers of their frames never fall.
    fn count_frames(&mut self, whole: &[u8]) -> Result<(), Fault> {
        let allocated = self.entries as u64;
        let mut last = 0;
        for number in 0..self.entries {
            let Some(entry) = self.entry(whole, number).filter(|entry| entry.location != 0) else {
                self.entries = number;
                break;
            };
            if entry.frame < last || entry.frame >= allocated {
                return Err(Fault::whole(
                    format!(
                        "entry {number} of the index, at byte {}, is of frame {}, but those before \
                         it are of frames up to {last}",
                        self.index + ENTRY * number,
                        entry.frame
                    ),
                    "copy the file again, or write it again: its index is damaged",
                ));
            }
            last = entry.frame;
            // No more than there are bytes of entries.
            self.frames = usize::try_from(last).unwrap_or(usize::MAX).saturating_add(1);
        }
        Ok(())
    }

    fn entry(&self, whole: &[u8], number: usize) -> Option<Entry> {
        let at = number.checked_mul(ENTRY)?.checked_add(self.index)?;
        let bytes = take::<ENTRY>(whole, at)?;
        Some(Entry {
            frame: u64::from_le_bytes(take(&bytes, 0)?),
            rows: u64::from_le_bytes(take(&bytes, 8)?),
            location: i64::from_le_bytes(take(&bytes, 16)?),
            width: u32::from_le_bytes(take(&bytes, 24)?),
            name: u16::from_le_bytes(take(&bytes, 28)?),
            kind: bytes[30],
        })
    }

    /// The name of an entry's chunk.
    fn name(&self, entry: &Entry) -> Result<&str, Fault> {
        let name = self.names.get(usize::from(entry.name)).map(AsRef::as_ref);
        name.ok_or_else(|| {
            Fault::whole(
                format!(
                    "a chunk of frame {} has name {} of {}",
                    entry.frame,
                    entry.name,
                    self.names.len()
                ),
                "copy the file again, or write it again: its index is damaged",
            )
        })
    }

    /// The entries of a frame, by halving: they are in the order of the frames.
    fn of_frame(&self, whole: &[u8], frame: usize) -> impl Iterator<Item = Entry> {
        let (mut low, mut high) = (0, self.entries);
        while low < high {
            let middle = low + (high - low) / 2;
            match self.entry(whole, middle) {
                Some(entry) if entry.frame < frame as u64 => low = middle + 1,
                _ => high = middle,
            }
        }
        let entries = (low..self.entries).map_while(move |number| self.entry(whole, number));
        entries.take_while(move |entry| entry.frame == frame as u64)
    }
}

/// Names, each of 64 bytes, or each behind the zero that ends the one before it.
fn read_names(bytes: &[u8], fixed: bool) -> Vec<Box<str>> {
    let name = |bytes: &[u8]| -> Box<str> {
        let end = bytes.iter().position(|byte| *byte == 0).unwrap_or(bytes.len());
        String::from_utf8_lossy(&bytes[..end]).into()
    };
    let names: Box<dyn Iterator<Item = Box<str>>> = match fixed {
        true => Box::new(bytes.chunks(NAME).map(name)),
        false => Box::new(bytes.split(|byte| *byte == 0).map(name)),
    };
    // Numbers of names have 16 bits.
    names.take_while(|name| !name.is_empty()).take(1 << 16).collect()
}

impl Entry {
    /// Its bytes.
    fn chunk<'a>(&self, whole: &'a [u8]) -> Result<Chunk<'a>, Fault> {
        let size = size(self.kind).ok_or_else(|| {
            Fault::whole(
                format!("a chunk of frame {} has numbers of kind {}", self.frame, self.kind),
                "copy the file again, or write it again: its index is damaged",
            )
        })?;
        let length = self.rows.checked_mul(self.width.into()).and_then(|n| n.checked_mul(size));
        let start = u64::try_from(self.location).ok();
        let end = length.zip(start).and_then(|(length, start)| start.checked_add(length));
        let range = start.zip(end).and_then(|(start, end)| {
            Some(usize::try_from(start).ok()?..usize::try_from(end).ok()?)
        });
        let bytes = range.and_then(|range| whole.get(range)).ok_or_else(|| {
            let what = format!("a chunk of frame {}", self.frame);
            let end = end.unwrap_or(u64::MAX);
            cut_short(&what, start.unwrap_or(u64::MAX), end, whole.len())
        })?;
        // A chunk of no width has any number of rows.
        let rows = if bytes.is_empty() { 0 } else { self.rows };
        let [rows, width] = [rows, self.width.into()].map(|n| usize::try_from(n).unwrap_or(0));
        Ok(Chunk { rows, width, kind: self.kind, bytes })
    }
}

/// Bytes of a number of a kind.
fn size(kind: u8) -> Option<u64> {
    match kind {
        1 | 5 | 11 => Some(1),
        2 | 6 => Some(2),
        3 | 7 | 9 => Some(4),
        4 | 8 | 10 => Some(8),
        _ => None,
    }
}

impl Chunk<'_> {
    /// Its numbers; none where they are no numbers, or none that are known.
    fn values(&self) -> Option<Values> {
        let bytes = self.bytes;
        Some(match self.kind {
            1 => Values::Bytes(bytes.to_vec().into()),
            2 => Values::Integers(numbers(bytes, |n| u16::from_le_bytes(n).into())),
            3 => Values::Integers(numbers(bytes, |n| u32::from_le_bytes(n).into())),
            4 => {
                let found = numbers(bytes, |n| i64::try_from(u64::from_le_bytes(n)).ok());
                Values::Integers(found.into_iter().collect::<Option<_>>()?)
            }
            // Exactly, and in no more than four times their memory.
            5 => {
                let found = numbers(bytes, |n| f32::from(i8::from_le_bytes(n)));
                Values::Reals(Reals::F32(found.into()))
            }
            6 => Values::Integers(numbers(bytes, |n| i16::from_le_bytes(n).into())),
            7 => Values::Integers(numbers(bytes, |n| i32::from_le_bytes(n).into())),
            8 => Values::Integers(numbers(bytes, i64::from_le_bytes)),
            9 => Values::Reals(Reals::F32(numbers(bytes, f32::from_le_bytes).into())),
            10 => Values::Reals(Reals::F64(numbers(bytes, f64::from_le_bytes).into())),
            _ => return None,
        })
    }

    /// Names that are filled up with zeros.
    fn texts(&self) -> Vec<String> {
        let name = |bytes: &[u8]| {
            let end = bytes.iter().position(|byte| *byte == 0).unwrap_or(bytes.len());
            String::from_utf8_lossy(&bytes[..end]).into_owned()
        };
        self.bytes.chunks(self.width.max(1)).map(name).collect()
    }
}

/// A frame that is read.
struct Frame<'a> {
    gsd: &'a Gsd,
    whole: &'a [u8],
    number: usize,
}

impl<'a> Frame<'a> {
    /// The chunks of a frame, with their names; the first of each name.
    fn chunks(&self, number: usize) -> Result<Vec<(&'a str, Chunk<'a>)>, Fault> {
        let mut chunks = Vec::new();
        let mut seen = HashSet::new();
        for entry in self.gsd.of_frame(self.whole, number) {
            if seen.insert(entry.name) {
                chunks.push((self.gsd.name(&entry)?, entry.chunk(self.whole)?));
            }
        }
        Ok(chunks)
    }

    fn read(&self, control: &Control) -> Result<Particles, Fault> {
        let own = self.chunks(self.number)?;
        let first = if self.number == 0 { Vec::new() } else { self.chunks(0)? };
        let find = |chunks: &[(&str, Chunk<'a>)], name: &str| {
            chunks.iter().find(|(found, _)| *found == name).map(|(_, chunk)| *chunk)
        };
        let either = |name: &str| find(&own, name).or_else(|| find(&first, name));
        let count_of = |chunk: Option<Chunk<'_>>| count(chunk.as_ref());
        let count = count_of(either("particles/N"))?;
        // What the first frame has of each particle is that of these too, if they are as many.
        let inherits = count_of(find(&first, "particles/N"))? == count;
        let mut chunks: Vec<(&str, Chunk<'_>)> = Vec::new();
        let mut seen = HashSet::new();
        let inherited = first.iter().filter(|_| inherits);
        for (name, chunk) in own.iter().chain(inherited) {
            let of_particles = name.starts_with("particles/") || name.starts_with("log/particles/");
            if of_particles && seen.insert(*name) {
                chunks.push((name, *chunk));
            }
        }
        self.check_memory(&chunks, count)?;

        let mut notes = Vec::new();
        let centers = match find(&chunks, "particles/position") {
            Some(chunk) => self.positions(&chunk, count)?,
            None => self.no_positions(count, &mut notes)?,
        };
        let mut columns = Vec::new();
        for (name, chunk) in &chunks {
            Fault::if_cancelled(control)?;
            let name = name.strip_prefix("particles/").unwrap_or(name);
            if ["N", "position", "types", "type_shapes"].contains(&name) {
                continue;
            }
            match (chunk.rows == count).then(|| chunk.values()).flatten() {
                Some(values) => columns.push(column(name, chunk.width, values)),
                None if count == 0 => {}
                None => {
                    let name = text::value(name);
                    notes.push(format!("`{name}` is not {count} numbers, and was left out"));
                }
            }
        }
        if let Some(types) = either("particles/types") {
            columns.extend(type_names(&columns, &types.texts(), &mut notes));
        }
        let cell = either("configuration/box").and_then(|chunk| cell(&chunk, &mut notes));
        Ok(Particles { centers, centers_from: "particles/position".into(), columns, cell, notes })
    }

    /// Chunks that overlap would take more memory than the file is large.
    fn check_memory(&self, chunks: &[(&str, Chunk<'_>)], count: usize) -> Result<(), Fault> {
        let total = chunks.iter().fold(0usize, |sum, (_, c)| sum.saturating_add(c.bytes.len()));
        if total > self.whole.len() {
            return Err(Fault::whole(
                format!("the chunks of frame {} are larger than the file", self.number),
                "copy the file again, or write it again: its index is damaged",
            ));
        }
        room(total.saturating_mul(2).saturating_add(count.saturating_mul(4)))
    }

    fn positions(&self, chunk: &Chunk<'_>, count: usize) -> Result<Reals, Fault> {
        let (rows, width) = (chunk.rows, chunk.width);
        if rows != count || (width != 3 && count > 0) {
            return Err(Fault::whole(
                format!(
                    "frame {} has {count} particles, but {rows} positions of {width} numbers",
                    self.number
                ),
                "write the file again",
            ));
        }
        match chunk.values() {
            Some(Values::Reals(centers)) => all_finite(&centers).map(|()| centers),
            _ => Err(Fault::whole(
                format!("the positions of frame {} are no real numbers", self.number),
                "write them as 32-bit or 64-bit floats",
            )),
        }
    }

    /// Where particles are by default.
    fn no_positions(&self, count: usize, notes: &mut Vec<String>) -> Result<Reals, Fault> {
        let bytes = count.saturating_mul(12);
        if bytes > self.whole.len().saturating_add(SLACK) {
            return Err(Fault::whole(
                format!("frame {} has {count} particles, but no positions", self.number),
                "write them: particles.position",
            ));
        }
        if count > 0 {
            notes.push("there are no positions: all particles are at 0, 0, 0".into());
        }
        Ok(Reals::F32(vec![0f32; 3 * count].into()))
    }
}

/// How many particles there are.
fn count(chunk: Option<&Chunk<'_>>) -> Result<usize, Fault> {
    let Some(chunk) = chunk else { return Ok(0) };
    let found = match chunk.values() {
        Some(Values::Integers(values)) => values.first().and_then(|n| usize::try_from(*n).ok()),
        _ => None,
    };
    let wrong = || Fault::whole("the number of particles is no integer", "write the file again");
    found.ok_or_else(wrong)
}

fn column(name: &str, width: usize, values: Values) -> Column {
    let is_one = |role| if width == 1 { role } else { Role::Other };
    let role = match (name, &values) {
        ("diameter", _) => is_one(Role::Diameter),
        ("typeid", Values::Integers(_)) => is_one(Role::Type),
        _ => Role::Other,
    };
    Column { name: name.into(), role, width, values }
}

/// The names of the types of all particles.
fn type_names(columns: &[Column], names: &[String], notes: &mut Vec<String>) -> Option<Column> {
    let column = columns.iter().find(|column| column.role == Role::Type)?;
    let Values::Integers(types) = &column.values else { return None };
    let words: Words = names.iter().collect();
    let code = |number: &i64| words.codes.get(usize::try_from(*number).ok()?).copied();
    let Some(codes) = types.iter().map(code).collect() else {
        notes.push(format!("there are particles of types that have no name among {}", names.len()));
        return None;
    };
    let values = Values::Words(Words { codes, words: words.words });
    Some(Column::named("type", values).with_role(Role::Other))
}

/// The box of lengths and tilts, whose middle is 0.
fn cell(chunk: &Chunk<'_>, notes: &mut Vec<String>) -> Option<Cell> {
    let Some(Values::Reals(numbers)) = chunk.values() else { return None };
    if numbers.len() != 6 || (0..6).any(|at| !numbers.get(at).is_finite()) {
        notes.push("the box is not six finite numbers, and was left out".into());
        return None;
    }
    let [x, y, z, xy, xz, yz] = [0, 1, 2, 3, 4, 5].map(|at| numbers.get(at));
    let edges = [[x, 0.0, 0.0], [xy * y, y, 0.0], [xz * z, yz * z, z]];
    let origin = [0, 1, 2].map(|axis| -0.5 * (edges[0][axis] + edges[1][axis] + edges[2][axis]));
    Some(Cell { origin, edges })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::particles::{
        Format,
        file::tests::{centers, frame, opened},
    };

    /// A chunk: frame, name, kind, rows, width, bytes.
    type Made<'a> = (u64, &'a str, u8, u64, u32, Vec<u8>);

    fn floats(values: &[f32]) -> Vec<u8> {
        values.iter().flat_map(|value| value.to_le_bytes()).collect()
    }

    fn ints(values: &[u32]) -> Vec<u8> {
        values.iter().flat_map(|value| value.to_le_bytes()).collect()
    }

    /// A file of chunks, of a version; names are in the order in which they first come.
    fn made(version: u64, chunks: &[Made<'_>]) -> Vec<u8> {
        let mut names: Vec<&str> = Vec::new();
        for (_, name, ..) in chunks {
            if !names.contains(name) {
                names.push(name);
            }
        }
        let list: Vec<u8> = match version {
            1 => names.iter().flat_map(|name| format!("{name:\0<64}").into_bytes()).collect(),
            _ => names.iter().flat_map(|name| format!("{name}\0").into_bytes()).collect(),
        };
        let units = list.len() / NAME + 1;
        let entries = chunks.len() + 3;
        let (index, list_at) = (256, 256 + ENTRY * entries);
        let mut at = list_at + NAME * units;
        let mut out = MAGIC.to_vec();
        for word in [index, entries, list_at, units] {
            out.extend((word as u64).to_le_bytes());
        }
        out.extend((0x1_0000 | version << 48).to_le_bytes());
        out.resize(112, 0);
        out.extend(b"hoomd");
        out.resize(256, 0);
        for (frame, name, kind, rows, width, bytes) in chunks {
            let number = names.iter().position(|found| found == name).unwrap() as u16;
            [*frame, *rows, at as u64].iter().for_each(|word| out.extend(word.to_le_bytes()));
            out.extend(width.to_le_bytes());
            out.extend(number.to_le_bytes());
            out.extend([*kind, 0]);
            at += bytes.len();
        }
        out.resize(list_at, 0);
        out.extend(list);
        out.resize(list_at + NAME * units, 0);
        chunks.iter().for_each(|chunk| out.extend(&chunk.5));
        out
    }

    fn two(count: u32) -> Vec<Made<'static>> {
        vec![
            (0, "configuration/box", 9, 6, 1, floats(&[4.0, 2.0, 8.0, 0.5, 0.25, 1.0])),
            (0, "particles/N", 3, 1, 1, ints(&[2])),
            (0, "particles/types", 5, 2, 3, b"A\0\0Bee".to_vec()),
            (0, "particles/typeid", 3, 2, 1, ints(&[1, 0])),
            (0, "particles/diameter", 9, 2, 1, floats(&[0.5, 1.5])),
            (0, "particles/velocity", 9, 2, 3, floats(&[1.0; 6])),
            (0, "particles/position", 9, 2, 3, floats(&[0.1, 2.0, 3.0, 4.0, 5.0, 6.0])),
            (0, "bonds/N", 3, 1, 1, ints(&[7])),
            (2, "particles/N", 3, 1, 1, ints(&[count])),
            (2, "particles/position", 9, count.into(), 3, floats(&vec![9.0; 3 * count as usize])),
        ]
    }

    #[test]
    fn what_a_frame_lacks_is_that_of_the_first() {
        for version in [1, 2] {
            let bytes = made(version, &two(2));
            let file = opened(Format::Gsd, bytes.as_slice()).unwrap();
            assert!(is(&bytes));
            assert_eq!(file.frames(&Control::new()).unwrap(), 3);
            for (number, x) in [f64::from(0.1f32), f64::from(0.1f32), 9.0].into_iter().enumerate() {
                let found = file.read(number, &Control::new()).unwrap();
                assert_eq!(centers(&found)[0][0], x);
                let names: Vec<&str> = found.columns.iter().map(|column| &*column.name).collect();
                assert_eq!(names, ["typeid", "diameter", "velocity", "type"]);
                assert_eq!(found.role(Role::Diameter).unwrap().values.get(1), Some(1.5));
                let Values::Words(words) = &found.column("type").unwrap().values else { panic!() };
                assert_eq!([words.get(0), words.get(1)], ["Bee", "A"]);
                let cell = found.cell.unwrap();
                assert_eq!(cell.edges, [[4.0, 0.0, 0.0], [1.0, 2.0, 0.0], [2.0, 8.0, 8.0]]);
                assert_eq!(cell.origin, [-3.5, -5.0, -4.0]);
                assert!(found.notes.is_empty());
            }
        }
        // Of other particles only what is no column.
        let found = frame(Format::Gsd, made(2, &two(3)), 2).unwrap();
        assert_eq!((found.len(), found.columns.len(), found.cell.is_some()), (3, 0, true));
        assert!(frame(Format::Gsd, made(2, &two(0)), 2).unwrap().is_empty());
    }

    #[test]
    fn positions_may_lack_or_be_64_bit() {
        let mut chunks = two(2);
        chunks[6] = (0, "particles/position", 10, 2, 3, vec![]);
        chunks[6].5 =
            [0.1, 0.2, 0.3, 0.4, 0.5, 0.6].iter().flat_map(|x: &f64| x.to_le_bytes()).collect();
        let found = frame(Format::Gsd, made(2, &chunks), 0).unwrap();
        assert_eq!(centers(&found), [[0.1, 0.2, 0.3], [0.4, 0.5, 0.6]]);
        chunks[6].1 = "log/particles/energy";
        let found = frame(Format::Gsd, made(2, &chunks), 0).unwrap();
        assert_eq!((centers(&found), found.notes.len()), (vec![[0.0; 3]; 2], 1));
        assert_eq!(found.column("log/particles/energy").unwrap().width, 3);
        // More than the file could hold.
        chunks[1].5 = ints(&[u32::MAX]);
        let error = frame(Format::Gsd, made(2, &chunks), 0).expect_err("no positions");
        assert!(error.message().contains("4294967295 particles, but no positions"), "{error}");
    }

    #[test]
    fn what_does_not_fit_is_told() {
        let mut chunks = two(2);
        chunks[3].5 = ints(&[1, 2]);
        chunks[4] = (0, "particles/diameter", 9, 1, 1, floats(&[0.5]));
        chunks[0] = (0, "configuration/box", 9, 6, 1, floats(&[f32::NAN; 6]));
        let found = frame(Format::Gsd, made(2, &chunks), 0).unwrap();
        assert_eq!(found.notes.len(), 3, "{:?}", found.notes);
        assert!(found.column("type").is_none() && found.cell.is_none());
    }

    #[test]
    fn what_is_wrong_is_told() {
        type Change = fn(&mut Vec<u8>, &mut Vec<Made<'static>>);
        let cases: [(Change, usize, &str); 10] = [
            (|b, _| b[256 + 28] = 99, 0, "a chunk of frame 0 has name 99 of 8"),
            (|b, _| b.truncate(300), 0, "the list of names lies at bytes"),
            (|b, _| b.truncate(100), 0, "the header"),
            (|b, _| b.truncate(b.len() - 1), 2, "a chunk of frame 2 lies at bytes"),
            (|b, _| b[112] = b'H', 0, "the schema `Hoomd`"),
            (|b, _| b[46] = 3, 0, "version 3"),
            (|b, _| b[256 + 32] = 9, 0, "entry 2 of the index, at byte 320, is of frame 0"),
            (|b, _| b[256 + 7] = 9, 0, "entry 0 of the index, at byte 256"),
            (
                |b, c| {
                    c[6].5[5] = 0xff;
                    c[6].5[6] = 0xff;
                    c[6].5[7] = 0x7f;
                    *b = made(2, c);
                },
                0,
                "`y` of particle 0 (counted from 0) is NaN",
            ),
            (
                |b, c| {
                    c[6].3 = 1;
                    *b = made(2, c);
                },
                0,
                "2 particles, but 1 positions",
            ),
        ];
        for (change, number, words) in cases {
            let mut chunks = two(2);
            let mut bytes = made(2, &chunks);
            change(&mut bytes, &mut chunks);
            let error = frame(Format::Gsd, bytes, number).expect_err(words);
            assert!(error.message().contains(words), "{error}");
        }
        // Chunks that are the same bytes again and again.
        let names: Vec<String> = (0..100).map(|n| format!("particles/{n}")).collect();
        let mut chunks = two(2);
        chunks.truncate(7);
        chunks.extend(names.iter().map(|name| (0, name.as_str(), 9, 2, 3, vec![])));
        let mut bytes = made(2, &chunks);
        let start = bytes.len() as u64 - 24;
        for entry in 7..107 {
            bytes[256 + 32 * entry + 16..][..8].copy_from_slice(&start.to_le_bytes());
        }
        assert!(frame(Format::Gsd, bytes.as_slice(), 0).is_ok());
        for entry in 7..107 {
            bytes[256 + 32 * entry + 8..][..8].copy_from_slice(&100u64.to_le_bytes());
            bytes[256 + 32 * entry + 16..][..8].copy_from_slice(&256u64.to_le_bytes());
        }
        let error = frame(Format::Gsd, bytes, 0).expect_err("overlap");
        assert!(error.message().contains("larger than the file"), "{error}");
    }

    #[test]
    fn no_bytes_make_it_panic() {
        let whole = made(2, &two(2));
        for at in 0..whole.len() {
            for value in [0, 1, 0x7f, 0x80, 0xff] {
                let mut bytes = whole.clone();
                bytes[at] = value;
                let Ok(file) = opened(Format::Gsd, bytes) else { continue };
                let frames = file.frames(&Control::new()).unwrap_or(1);
                (0..frames.min(4)).for_each(|n| drop(file.read(n, &Control::new())));
            }
        }
    }
}
