//! NumPy's files alone: an array of positions, or an archive of arrays with names.
//!
//! The formats: NEP 1, and `numpy.savez`, a zip archive of such arrays. An array (N, 3) is
//! positions, one of (N, 4) positions and radii. Of an archive, the names are those that a scene
//! file's records have ([`Key`]): `centers`, `positions` and others, or `x`, `y` and `z`; `radii`;
//! `colors`. Every other array of N rows is a column. Stored numbers are used where they lie;
//! compressed ones are inflated, no more of them than their header tells. The sums that an archive
//! has of its members are not compared where these are stored: that would read all of them.

use std::{
    io::{Cursor, Read},
    ops::Range,
};

use bytes::Bytes;
use rayon::prelude::*;
use zip::{CompressionMethod, ZipArchive};

use super::{
    Column, Data, Particles, Reader, Role, Values, Words,
    records::{self, Form, Records, Target},
};
use crate::{
    input::{refused::Refused, report::Fault},
    npy::{
        array::{Array, Key},
        number::{Kind, Number},
        read::{self as npy, Descr, Header},
    },
};
use planisphere_core::{
    drawing::Control,
    scene::{self, Reals},
    text,
};
use planisphere_memory as memory;

/// Arrays in an archive, at most.
const MOST: usize = 10_000;

/// What to do about an archive that is damaged.
const WRITE_AGAIN: &str = "wait until the file is written, or write it again with numpy.savez";

/// Whether bytes begin as an array does.
pub(super) fn is_array(beginning: &[u8]) -> bool {
    beginning.starts_with(b"\x93NUMPY")
}

/// Whether bytes begin as an archive of arrays does: its first member is one.
pub(super) fn is_archive(beginning: &[u8]) -> bool {
    let Some(length) = beginning.get(26..28) else { return false };
    let name = 30..30 + usize::from(u16::from_le_bytes([length[0], length[1]]));
    beginning.starts_with(b"PK\x03\x04")
        && beginning.get(name).is_some_and(|name| name.ends_with(b".npy"))
}

/// A reader of an array.
pub(super) fn open_array(data: &Data) -> Result<Box<dyn Reader>, Fault> {
    let place = 0..data.len();
    let member = Member { name: String::new(), place, compressed: None };
    Ok(Box::new(Arrays { members: vec![member], alone: true, skipped: Vec::new() }))
}

/// A reader of an archive.
pub(super) fn open_archive(data: &Data) -> Result<Box<dyn Reader>, Fault> {
    Ok(Box::new(Arrays::of_archive(data.as_slice())?))
}

/// Arrays, each with its name.
#[derive(Debug)]
struct Arrays {
    members: Vec<Member>,
    /// Whether it is one, of a file of its own.
    alone: bool,
    /// What else the archive has, in words.
    skipped: Vec<String>,
}

/// Where an array lies.
#[derive(Debug)]
struct Member {
    name: String,
    place: Range<usize>,
    /// How long it is once it is inflated, and the sum that it has then.
    compressed: Option<(u64, u32)>,
}

impl Reader for Arrays {
    fn frame(&self, data: &Data, at: usize) -> Result<Option<Range<usize>>, Fault> {
        // One frame: all of it.
        Ok((at == 0 && data.len() > 0).then(|| 0..data.len()))
    }

    fn read(&self, data: &Data, _: Range<usize>, control: &Control) -> Result<Particles, Fault> {
        let mut reading = Reading { arrays: self, data, control, notes: self.skipped.clone() };
        if self.alone {
            return reading.alone();
        }
        let (centers, taken) = reading.centers()?;
        let count = centers.len() / 3;
        let mut columns = Vec::new();
        for (number, member) in self.members.iter().enumerate() {
            Fault::if_cancelled(control)?;
            if !taken.contains(&number) {
                columns.extend(reading.column(member, count)?);
            }
        }
        let has = |name: &str| columns.iter().any(|column: &Column| column.name == name);
        if has("r") && has("g") && has("b") {
            for column in &mut columns {
                if let Some(channel) = ["r", "g", "b"].iter().position(|name| column.name == *name)
                {
                    column.role = Role::Channel(channel as u8);
                }
            }
        }
        let names: Vec<_> = taken.iter().map(|k| text::value(&self.members[*k].name)).collect();
        let (centers_from, notes) = (names.join(" "), reading.notes);
        Ok(Particles { centers, centers_from, columns, cell: None, notes })
    }
}

impl Arrays {
    fn of_archive(whole: &[u8]) -> Result<Self, Fault> {
        let damaged = |error: &dyn std::fmt::Display| {
            Fault::whole(format!("the archive is cut short or damaged: {error}"), WRITE_AGAIN)
        };
        // Its list is not made before it is known how long it is.
        if listed(whole).is_none_or(|count| count > MOST as u64) {
            return Err(damaged(&format!("it has no list of at most {MOST} arrays")));
        }
        let mut archive = ZipArchive::new(Cursor::new(whole)).map_err(|error| damaged(&error))?;
        let (mut members, mut skipped) = (Vec::new(), Vec::new());
        for number in 0..archive.len() {
            let file = archive.by_index_raw(number).map_err(|error| damaged(&error))?;
            let name = file.name().map_err(|error| damaged(&error))?.into_owned();
            let Some(name) = name.strip_suffix(".npy").map(str::to_owned) else {
                skipped.push(format!("`{}` was left out: it is no array", text::value(&name)));
                continue;
            };
            if file.encrypted() {
                return Err(Fault::whole(
                    format!("`{}` is encrypted", text::value(&name)),
                    "save it with numpy.savez, which encrypts nothing",
                ));
            }
            let place = file.data_start().and_then(|start| {
                let start = usize::try_from(start).ok()?;
                let end = start.checked_add(usize::try_from(file.compressed_size()).ok()?)?;
                (end <= whole.len()).then_some(start..end)
            });
            let place = place.ok_or_else(|| damaged(&format!("`{name}` is not all there")))?;
            let compressed = match file.compression() {
                CompressionMethod::Stored => None,
                CompressionMethod::DEFLATE => Some((file.size(), file.crc32())),
                other => {
                    return Err(Fault::whole(
                        format!("`{}` is compressed as {other:?}", text::value(&name)),
                        "save it with numpy.savez or numpy.savez_compressed",
                    ));
                }
            };
            members.push(Member { name, place, compressed });
        }
        let has = |name: &str| members.iter().any(|member: &Member| member.name == name);
        if has("pixels") && has("version") && has("indices") {
            return Err(Fault::whole(
                "this is a part of a picture, which holds no particles to draw",
                "put the parts of a picture together with `planisphere merge`",
            ));
        }
        Ok(Self { members, alone: false, skipped })
    }
}

/// How many members an archive says that it has.
fn listed(whole: &[u8]) -> Option<u64> {
    /// Bytes of the last record, and of the longest comment behind it.
    const LAST: usize = 22 + 0xffff;
    let tail = &whole[whole.len().saturating_sub(LAST + 96)..];
    let field = |at: usize| tail.get(at..);
    let last = memchr::memmem::rfind(tail, b"PK\x05\x06")?;
    let short = u16::from_le_bytes(*field(last + 10)?.first_chunk()?);
    match memchr::memmem::rfind(&tail[..last], b"PK\x06\x06") {
        Some(wide) => Some(u64::from_le_bytes(*field(wide + 32)?.first_chunk()?)),
        None => Some(u64::from(short)),
    }
}

/// Arrays that are being read.
struct Reading<'a> {
    arrays: &'a Arrays,
    data: &'a Data,
    control: &'a Control,
    notes: Vec<String>,
}

impl Reading<'_> {
    /// Joins the name of an array to what is wrong with it.
    fn fault(&self, name: &str, refused: Refused) -> Fault {
        let words = match self.arrays.alone {
            true => refused.words,
            false => format!("its array `{}` {}", text::value(name), refused.words),
        };
        Fault::whole(words, refused.fix)
    }

    /// The header of an array.
    fn header(&self, member: &Member) -> Result<(Header, usize), Fault> {
        let bytes = &self.data.as_slice()[member.place.clone()];
        let header = match member.compressed {
            None => npy::header(bytes),
            Some(_) => {
                // As much as a header needs, and no more.
                let mut inflated = Vec::new();
                let mut read = |length: usize| {
                    let mut packed = flate2::read::DeflateDecoder::new(bytes);
                    inflated.clear();
                    // What is damaged is a header that is cut short.
                    let _ = Read::take(&mut packed, length as u64).read_to_end(&mut inflated);
                    inflated.clone()
                };
                npy::extent(&read(12)).and_then(|(_, end)| npy::header(&read(end)))
            }
        };
        header.map_err(|error| self.fault(&member.name, error.into()))
    }

    /// The bytes of an array; inflated ones are as long as its header tells.
    fn bytes(&self, member: &Member) -> Result<Bytes, Fault> {
        let packed = self.data.bytes().slice(member.place.clone());
        let Some((size, sum)) = member.compressed else { return Ok(packed) };
        let refuse = |words: String| self.fault(&member.name, Refused::new(words, WRITE_AGAIN));
        let (header, offset) = self.header(member)?;
        let length = header.descr.size().and_then(|size| {
            let numbers = header.shape.iter().try_fold(size, |bytes, n| bytes.checked_mul(*n))?;
            numbers.checked_add(offset)
        });
        let length = length.filter(|length| *length as u64 == size);
        let length = length.ok_or_else(|| {
            refuse(format!("is {size} bytes long, which is not what its shape needs"))
        })?;
        memory::room(size).map_err(|available| {
            let [needed, available] = [size, available].map(text::bytes);
            refuse(format!("is inflated to {needed} of memory, and {available} is available"))
        })?;
        let mut inflated = Vec::new();
        // No byte of it is touched before it is written.
        let room = inflated.try_reserve_exact(length);
        room.map_err(|_| refuse(format!("is {length} bytes long, which cannot be had")))?;
        let mut reader = flate2::CrcReader::new(flate2::read::DeflateDecoder::new(&packed[..]));
        let read = Read::take(&mut reader, size).read_to_end(&mut inflated);
        if read.is_err() || inflated.len() != length || reader.crc().sum() != sum {
            return Err(refuse("is damaged: it does not inflate to what was written".into()));
        }
        Ok(inflated.into())
    }

    fn array(&self, member: &Member) -> Result<Array, Fault> {
        let array = Array::in_bytes(self.bytes(member)?, self.control);
        array.map_err(|refused| self.fault(&member.name, refused))
    }

    /// The one array of a file of its own.
    fn alone(mut self) -> Result<Particles, Fault> {
        let member = &self.arrays.members[0];
        let array = self.array(member)?;
        let header = array.header();
        let mut columns = Vec::new();
        let centers = match header.shape[..] {
            [count, 4] => {
                let number = self.number(&header.descr, member)?;
                let form = Form::reals([number]);
                let columns_of =
                    |components: Range<usize>| self.reals(&array, (count, 4), components, form);
                let (centers, radii) = (columns_of(0..3)?, columns_of(3..4)?);
                let radii = Column::named("radii", Values::Reals(radii));
                columns.push(radii.with_role(Role::Radius));
                centers
            }
            _ => array.centers(None).map_err(|refused| self.fault("", refused))?.0.numbers,
        };
        self.are_finite("", &centers)?;
        let notes = std::mem::take(&mut self.notes);
        let centers_from = match header.shape[..] {
            [_, 4] => "columns 0 1 2".into(),
            _ => "the array".into(),
        };
        Ok(Particles { centers, centers_from, columns, cell: None, notes })
    }

    /// The type of numbers that are no others than 64-bit floats.
    fn number(&self, descr: &Descr, member: &Member) -> Result<Number, Fault> {
        let number = match descr {
            Descr::One(code) => Number::of(code),
            Descr::Record(_) => Err("records".into()),
        };
        let fix = "save float32 or float64 numbers: array.astype('f8')";
        let number = number
            .map_err(|found| Refused::new(format!("holds {found}, not numbers"), fix))
            .and_then(|number| match number.fits_f64() {
                true => Ok(number),
                false => Err(Refused::new(format!("holds numbers of type {}", number.name()), fix)),
            });
        number.map_err(|refused| self.fault(&member.name, refused))
    }

    /// Some columns of a table, as real numbers.
    fn reals(
        &self,
        array: &Array,
        shape: (usize, usize),
        components: Range<usize>,
        form: Form,
    ) -> Result<Reals, Fault> {
        match self.table(array, shape, components, form)? {
            Values::Reals(reals) => Ok(reals),
            _ => Ok(Reals::F64(Vec::new().into())),
        }
    }

    /// Some columns of a table.
    fn table(
        &self,
        array: &Array,
        (count, width): (usize, usize),
        components: Range<usize>,
        form: Form,
    ) -> Result<Values, Fault> {
        let header = array.header();
        let number = match &header.descr {
            Descr::One(code) => Number::of(code),
            Descr::Record(_) => Err(String::new()),
        };
        let number = number.map_err(|found| Fault::whole(found, WRITE_AGAIN))?;
        let (bytes, start) = array.parts();
        // The shape was compared with the bytes that there are.
        let (stride, step) = match header.fortran {
            true => (number.size, number.size * count),
            false => (number.size * width, number.size),
        };
        let parts = components.map(|component| (component * step, number)).collect();
        let targets = [Target { form, parts }];
        let records = Records { start, stride, count };
        let data = Data::from(bytes.clone());
        let mut values = records::read(&data, &records, &targets, self.control)?;
        Ok(values.pop().unwrap_or(Values::Integers(Vec::new())))
    }

    /// The positions, and which arrays they are.
    fn centers(&mut self) -> Result<(Reals, Vec<usize>), Fault> {
        let members = &self.arrays.members;
        let of_name = |name: &str| members.iter().position(|member| member.name == name);
        let whole = members.iter().position(|member| Key::Centers.is_called(&member.name));
        if let Some(found) = whole {
            let member = &members[found];
            let centers = self.array(member)?.centers(None);
            let taken = centers.map_err(|refused| self.fault(&member.name, refused))?.0;
            if taken.copied.is_some() {
                self.data.done(member.place.clone());
            }
            let centers = taken.numbers;
            self.are_finite(&member.name, &centers)?;
            return Ok((centers, vec![found]));
        }
        let axes = ["x", "y", "z"].map(of_name);
        let [Some(x), Some(y), Some(z)] = axes else {
            let names: Vec<String> = members.iter().map(|m| text::value(&m.name)).collect();
            return Err(Fault::whole(
                format!("no array is called `centers`, or `x`, `y` and `z`: {}", names.join(", ")),
                "name the positions: numpy.savez(name, centers=positions)",
            ));
        };
        let mut columns = Vec::new();
        for at in [x, y, z] {
            let member = &members[at];
            let array = self.array(member)?;
            let shape = &array.header().shape;
            let count =
                shape.iter().try_fold(1usize, |count, n| count.checked_mul(*n)).unwrap_or(0);
            let reals = array.radii(count).map_err(|refused| self.fault(&member.name, refused))?;
            self.are_finite(&member.name, &reals.numbers)?;
            columns.push(reals.numbers);
        }
        let count = columns[0].len();
        if let Some(other) = columns.iter().find(|column| column.len() != count) {
            let other = other.len();
            return Err(Fault::whole(
                format!("`x` has {count} numbers, but another axis has {other}"),
                "save one number of each for each particle",
            ));
        }
        let at = |index: usize| columns[index % 3].get(index / 3);
        let centers: Vec<f64> = (0..3 * count).into_par_iter().map(at).collect();
        Ok((Reals::F64(centers.into()), vec![x, y, z]))
    }

    fn are_finite(&self, name: &str, positions: &Reals) -> Result<(), Fault> {
        let Some(at) = records::first_not_finite(positions) else { return Ok(()) };
        let value = positions.get(at);
        let place = match name {
            "x" | "y" | "z" => format!("[{at}]"),
            _ => format!("[{}, {}]", at / 3, at % 3),
        };
        Err(self.fault(
            name,
            Refused::new(
                format!("has {value} at {place}, which is not finite: there is no such place"),
                "correct the number, or leave the particle out of the file",
            ),
        ))
    }

    /// Notes why an array is no column.
    fn leave(&mut self, name: &str, why: String) -> Result<Option<Column>, Fault> {
        self.notes.push(format!("`{}` was left out: {why}", text::value(name)));
        Ok(None)
    }

    /// Any other array as a column, if it is one.
    fn column(&mut self, member: &Member, count: usize) -> Result<Option<Column>, Fault> {
        let name = &member.name;
        let (header, _) = self.header(member)?;
        let width = match header.shape[..] {
            [rows] if rows == count => 1,
            [rows, width] if rows == count && width > 0 => width,
            [] | [1] if Key::Radii.is_called(name) => {
                return self.one_radius(member, count).map(Some);
            }
            _ => {
                let shape: Vec<String> = header.shape.iter().map(usize::to_string).collect();
                let words = format!("its shape ({}) is not {count} rows", shape.join(", "));
                if [Key::Radii, Key::Colors].iter().any(|key| key.is_called(name)) {
                    return Err(Fault::whole(
                        format!("`{name}` is not of these particles: {words}"),
                        "save one for each of the positions",
                    ));
                }
                return self.leave(name, words);
            }
        };
        let code = match &header.descr {
            Descr::One(code) => code,
            Descr::Record(_) => return self.leave(name, "it holds records".into()),
        };
        if let Some(words) = self.words(member, code, width, count)? {
            return Ok(Some(Column::named(name, Values::Words(words))));
        }
        let number = match Number::of(code) {
            Ok(number) if matches!(number.kind, Kind::LongDouble | Kind::Complex) => {
                return self.leave(name, format!("it holds numbers of type {}", number.name()));
            }
            Ok(number) => number,
            Err(found) => return self.leave(name, format!("it holds {found}")),
        };
        let array = self.array(member)?;
        if Key::Radii.is_called(name) {
            let taken = array.radii(count).map_err(|refused| self.fault(name, refused))?;
            if taken.copied.is_some() {
                self.data.done(member.place.clone());
            }
            let radii = taken.numbers;
            return Ok(Some(Column::named(name, Values::Reals(radii)).with_role(Role::Radius)));
        }
        if Key::Colors.is_called(name) && width == 4 && records::is_byte(number) {
            // The fourth is how much of what is behind is seen, of which there is nothing.
            let colors = self.table(&array, (count, 4), 0..3, Form::Bytes)?;
            self.notes.push(format!("the fourth channel of `{}` was left out", text::value(name)));
            return Ok(Some(Column::named(name, colors).with_width(3).with_role(Role::Color)));
        }
        if Key::Colors.is_called(name) && number.kind != Kind::Float {
            let colors = array.colors(count).map_err(|refused| self.fault(name, refused))?.numbers;
            let colors = Column::named(name, Values::Bytes(colors)).with_width(3);
            return Ok(Some(colors.with_role(Role::Color)));
        }
        let mut role = Role::of_name(name);
        let mut values = match in_place(&array, number, count * width, role) {
            Some(values) => values,
            None => self.table(&array, (count, width), 0..width, Form::of(number, role))?,
        };
        if let Values::Integers(integers) = &values
            && number.kind == Kind::Uint
            && integers.iter().any(|integer| *integer < 0)
        {
            // Beyond what a signed integer holds.
            values = self.table(&array, (count, width), 0..width, Form::F64)?;
            self.notes.push(format!("integers of `{}` were rounded", text::value(name)));
        }
        if Key::Colors.is_called(name) && width == 3 {
            (role, values) = records::colors(values, false, &mut self.notes);
        }
        Ok(Some(Column::named(name, values).with_width(width).with_role(role)))
    }

    /// One radius that all have.
    fn one_radius(&self, member: &Member, count: usize) -> Result<Column, Fault> {
        let array = self.array(member)?;
        let radius = array.radii(1).map_err(|refused| self.fault(&member.name, refused))?.numbers;
        let needed = 8 * count as u64;
        memory::room(needed).map_err(|available| {
            let [needed, available] = [needed, available].map(text::bytes);
            let words = format!("takes {needed} of memory, and {available} is available");
            self.fault(&member.name, Refused::new(words, "free some memory"))
        })?;
        let radii = vec![radius.get(0); count];
        let radii = Values::Reals(Reals::F64(radii.into()));
        Ok(Column::named(&member.name, radii).with_role(Role::Radius))
    }

    /// Text of a fixed length, such as symbols of elements; none where it is no text.
    fn words(
        &self,
        member: &Member,
        code: &str,
        width: usize,
        count: usize,
    ) -> Result<Option<Words>, Fault> {
        let size = Descr::One(code.into()).size().unwrap_or(0);
        let code = code.trim_start_matches(['<', '>', '|', '=']);
        let wide = code.starts_with('U');
        if width != 1 || size == 0 || !(wide || code.starts_with(['S', 'a'])) {
            return Ok(None);
        }
        let array = self.array(member)?;
        let (bytes, start) = array.parts();
        let big = matches!(&array.header().descr, Descr::One(code) if code.starts_with('>'));
        let word = |cell: &[u8]| -> String {
            if !wide {
                return String::from_utf8_lossy(cell).trim_end_matches('\0').to_owned();
            }
            let letters = cell.as_chunks().0.iter().map(|letter: &[u8; 4]| {
                let letter =
                    if big { u32::from_be_bytes(*letter) } else { u32::from_le_bytes(*letter) };
                char::from_u32(letter).unwrap_or(char::REPLACEMENT_CHARACTER)
            });
            letters.collect::<String>().trim_end_matches('\0').to_owned()
        };
        Ok(Some(bytes[start..].chunks_exact(size).take(count).map(word).collect()))
    }
}

/// The numbers of an array as they lie, if a column can have them so.
fn in_place(array: &Array, number: Number, count: usize, role: Role) -> Option<Values> {
    let header = array.header();
    let table = header.shape.iter().filter(|length| **length != 1).count() > 1;
    if number.big || (header.fortran && table) {
        return None;
    }
    let (bytes, start) = array.parts();
    match Form::of(number, role) {
        Form::F32 if number.kind == Kind::Float && number.size == 4 => {
            Some(Values::Reals(Reals::F32(scene::Column::in_bytes(bytes, start, count)?)))
        }
        Form::F64 if number.size == 8 => {
            Some(Values::Reals(Reals::F64(scene::Column::in_bytes(bytes, start, count)?)))
        }
        Form::Bytes => Some(Values::Bytes(scene::Column::in_bytes(bytes, start, count)?)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use zip::{ZipWriter, write::SimpleFileOptions};

    use super::*;
    use crate::particles::{
        Format,
        file::tests::{centers, frame, opened},
    };

    fn npy(code: &str, fortran: &str, shape: &str, numbers: &[u8]) -> Vec<u8> {
        let text =
            format!("{{'descr': '{code}', 'fortran_order': {fortran}, 'shape': {shape}, }}\n");
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((text.len() as u16).to_le_bytes());
        [&bytes, text.as_bytes(), numbers].concat()
    }

    fn reals(numbers: &[f64]) -> Vec<u8> {
        numbers.iter().flat_map(|number| number.to_le_bytes()).collect()
    }

    /// An archive, of which every second array is compressed.
    fn npz(members: &[(&str, Vec<u8>)]) -> Vec<u8> {
        let mut bytes = Cursor::new(Vec::new());
        let mut archive = ZipWriter::new(&mut bytes);
        for (name, array) in members {
            let stored = SimpleFileOptions::default().compression_method(CompressionMethod::Stored);
            archive.start_file(format!("{name}.npy"), stored).unwrap();
            archive.write_all(array).unwrap();
        }
        archive.finish().unwrap();
        bytes.into_inner()
    }

    /// An archive of one array `centers` that is compressed, and says that it is so long.
    fn deflated(array: &[u8], says: u32) -> Vec<u8> {
        let mut packed = flate2::write::DeflateEncoder::new(Vec::new(), Default::default());
        packed.write_all(array).unwrap();
        let packed = packed.finish().unwrap();
        let mut sum = flate2::Crc::new();
        sum.update(array);
        let mut fields = vec![20, 0, 0, 0, 8, 0, 0, 0, 0, 0];
        fields.extend(sum.sum().to_le_bytes());
        fields.extend((packed.len() as u32).to_le_bytes());
        fields.extend(says.to_le_bytes());
        fields.extend([11, 0, 0, 0]);
        let local = [b"PK\x03\x04", &fields[..], b"centers.npy", &packed].concat();
        let list = [b"PK\x01\x02\x14\x00", &fields[..], &[0; 14], b"centers.npy"].concat();
        let mut last = b"PK\x05\x06\0\0\0\0\x01\0\x01\0".to_vec();
        last.extend((list.len() as u32).to_le_bytes());
        last.extend((local.len() as u32).to_le_bytes());
        [local, list, last, vec![0, 0]].concat()
    }

    const SIX: [f64; 6] = [1.0, 2.0, 3.0, 4.0, 5.0, 6.1];

    #[test]
    fn an_array_is_positions_or_positions_and_radii() {
        let wanted = [[1.0, 2.0, 3.0], [4.0, 5.0, 6.1]];
        let file = npy("<f8", "False", "(2, 3)", &reals(&SIX));
        assert!(is_array(&file));
        assert_eq!(centers(&frame(Format::Npy, file, 0).unwrap()), wanted);
        let columns = [1.0, 4.0, 2.0, 5.0, 3.0, 6.1, 0.5, 0.25];
        let rows = [1.0, 2.0, 3.0, 0.5, 4.0, 5.0, 6.1, 0.25];
        for (fortran, numbers) in [("False", rows), ("True", columns)] {
            let particles =
                frame(Format::Npy, npy("<f8", fortran, "(2, 4)", &reals(&numbers)), 0).unwrap();
            assert_eq!(centers(&particles), wanted);
            let radii = particles.role(Role::Radius).unwrap();
            assert_eq!([0, 1].map(|n| radii.values.get(n)), [Some(0.5), Some(0.25)]);
        }
        let cut = npy("<f8", "False", "(2, 3)", &reals(&SIX[1..]));
        let error = frame(Format::Npy, cut, 0).expect_err("cut");
        assert!(error.message().contains("holds 40 bytes of numbers"), "{error}");
        let infinite = npy("<f8", "False", "(1, 3)", &reals(&[0.0, f64::INFINITY, 0.0]));
        let error = frame(Format::Npy, infinite, 0).expect_err("infinite");
        assert!(error.message().contains("has inf at [0, 1]"), "{error}");
        let error = frame(Format::Npy, npy("|O", "False", "(2, 4)", &[0; 64]), 0).expect_err("O");
        assert!(error.message().contains("Python objects"), "{error}");
    }

    #[test]
    fn arrays_of_an_archive_are_columns() {
        let file = npz(&[
            ("mass", npy(">i2", "False", "(2,)", &[0, 1, 255, 254])),
            ("Positions", npy("<f8", "False", "(2, 3)", &reals(&SIX))),
            ("radius", npy("<f8", "False", "()", &reals(&[0.5]))),
            ("colors", npy("|u1", "False", "(2, 3)", &[1, 2, 3, 4, 5, 6])),
            ("velocity", npy("<f8", "True", "(2, 3)", &reals(&SIX))),
            ("element", npy("<U2", "False", "(2,)", b"C\0\0\0a\0\0\0O\0\0\0\0\0\0\0")),
            ("anything", npy("|O", "False", "(2,)", &[0; 16])),
            ("box", npy("<f8", "False", "(3,)", &reals(&SIX[..3]))),
            ("big", npy("<u8", "False", "(2,)", &[255; 16])),
        ]);
        assert!(is_archive(&file));
        let particles = frame(Format::Npz, file.clone(), 0).unwrap();
        assert_eq!(centers(&particles), [[1.0, 2.0, 3.0], [4.0, 5.0, 6.1]]);
        let get = |name: &str, at| particles.column(name).unwrap().values.get(at);
        assert_eq!([get("mass", 0), get("mass", 1)], [Some(1.0), Some(-2.0)]);
        assert_eq!(get("radius", 1), Some(0.5));
        assert_eq!([get("velocity", 0), get("velocity", 1)], [Some(1.0), Some(3.0)]);
        assert_eq!(get("big", 0), Some(u64::MAX as f64));
        let Values::Words(words) = &particles.role(Role::Element).unwrap().values else { panic!() };
        assert_eq!([words.get(0), words.get(1)], ["Ca", "O"]);
        let Values::Bytes(colors) = &particles.role(Role::Color).unwrap().values else { panic!() };
        assert_eq!(colors.as_slice(), [1, 2, 3, 4, 5, 6]);
        assert_eq!(
            particles.notes,
            [
                "`anything` was left out: it holds Python objects",
                "`box` was left out: its shape (3) is not 2 rows",
                "integers of `big` were rounded",
            ]
        );
        let one = |number: f64| npy("<f8", "False", "(1,)", &reals(&[number]));
        let axes = npz(&[("x", one(1.0)), ("y", one(2.0)), ("z", one(3.0)), ("r", one(0.5))]);
        let particles = frame(Format::Npz, axes, 0).unwrap();
        assert_eq!(centers(&particles), [[1.0, 2.0, 3.0]]);
        assert!(particles.role(Role::Radius).is_some());
        // Cut anywhere, it is refused.
        for length in (0..file.len()).step_by(7) {
            frame(Format::Npz, &file[..length], 0).expect_err("cut");
        }
    }

    /// No more is inflated than a header tells, and that is what the archive tells as well.
    #[test]
    fn what_is_compressed_is_inflated_as_far_as_told() {
        let array = npy("<f8", "False", "(2, 3)", &reals(&SIX));
        let file = deflated(&array, array.len() as u32);
        assert_eq!(frame(Format::Npz, file.clone(), 0).unwrap().len(), 2);
        let long = [&array[..], &[0; 1 << 20]].concat();
        for says in [array.len(), long.len()] {
            let error = frame(Format::Npz, deflated(&long, says as u32), 0).expect_err("long");
            assert!(error.message().contains("`centers` is"), "{error}");
        }
        let huge = npy("<f8", "False", "(999999999999, 3)", &[]);
        frame(Format::Npz, deflated(&huge, huge.len() as u32), 0).expect_err("huge");
        let mut damaged = file;
        damaged[14] ^= 1;
        let at = damaged.len() - 22 - 11 - 46 + 16;
        damaged[at] ^= 1;
        let error = frame(Format::Npz, damaged, 0).expect_err("damaged");
        assert!(error.message().contains("is damaged"), "{error}");
    }

    #[test]
    fn what_holds_no_particles_is_refused() {
        let one = npy("<f8", "False", "(1,)", &reals(&[1.0]));
        let part = ["version", "pixels", "indices", "centers"].map(|name| (name, one.clone()));
        let error = opened(Format::Npz, npz(&part)).expect_err("a part");
        assert!(error.to_string().contains("planisphere merge"), "{error}");
        let error = frame(Format::Npz, npz(&[("a", one.clone())]), 0).expect_err("no positions");
        assert!(error.message().contains("no array is called `centers`"), "{error}");
        let error = frame(Format::Npz, npz(&[("centers", one)]), 0).expect_err("one number");
        assert!(error.message().contains("its array `centers` has the shape (1,)"), "{error}");
    }
}
