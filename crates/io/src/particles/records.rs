//! Numbers of fixed size in bytes, read in parallel: records of one length go straight into
//! columns.
//!
//! A number keeps its value: 32-bit floats stay what they are, and nothing is rounded.

use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

use rayon::prelude::*;

use super::{Data, Role, Values};
use crate::{
    input::report::Fault,
    npy::number::{Kind, Number},
    zeros::zeros,
};
use planisphere_core::{drawing::Control, scene::Reals, text};
use planisphere_memory as memory;

/// Records that a thread reads at a time.
const SOME: usize = 1 << 14;

/// Where records lie.
#[derive(Clone, Debug)]
pub(super) struct Records {
    /// Where the first begins.
    pub start: usize,
    /// Bytes from one to the next.
    pub stride: usize,
    /// How many there are.
    pub count: usize,
}

/// What kind of values a column has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Form {
    /// 32-bit floats.
    F32,
    /// 64-bit floats.
    F64,
    /// Integers, of which each is a 64-bit float as well.
    Integers,
    /// Bytes.
    Bytes,
}

impl Form {
    /// Bytes of a value.
    fn size(self) -> usize {
        match self {
            Self::F32 => 4,
            Self::F64 | Self::Integers => 8,
            Self::Bytes => 1,
        }
    }

    /// That of a column. Bytes that are no types or ids take no more memory than in the file; of
    /// those with a sign, a 32-bit float has each value.
    pub fn of(number: Number, role: Role) -> Self {
        match (number.kind, number.size) {
            (Kind::Float, ..=4) => Self::F32,
            (Kind::Float, _) => Self::F64,
            (Kind::Uint, 1) if role == Role::Other => Self::Bytes,
            (_, 1) if role == Role::Other => Self::F32,
            _ => Self::Integers,
        }
    }

    /// That of real numbers of some types, the shortest that holds all of them.
    pub fn reals(numbers: impl IntoIterator<Item = Number>) -> Self {
        if numbers.into_iter().all(Number::fits_f32) { Self::F32 } else { Self::F64 }
    }
}

/// A column that is read: the numbers of a record that go to it.
#[derive(Clone, Debug)]
pub(super) struct Target {
    /// What its values become.
    pub form: Form,
    /// Where each number lies, from the beginning of the record, and its type.
    pub parts: Vec<(usize, Number)>,
}

/// Reads the columns of records.
///
/// # Errors
/// When they do not lie in the bytes, there is no memory for them, or it is cancelled.
pub(super) fn read(
    data: &Data,
    records: &Records,
    targets: &[Target],
    control: &Control,
) -> Result<Vec<Values>, Fault> {
    let bytes = data.as_slice();
    let &Records { start, stride, count } = records;
    check(bytes.len(), records, targets)?;
    let mut columns = rooms(targets, count)?;
    let mut pieces: Vec<Vec<Slot<'_>>> = (0..count.div_ceil(SOME)).map(|_| Vec::new()).collect();
    for column in &mut columns {
        pieces.iter_mut().zip(column.slots()).for_each(|(piece, slot)| piece.push(slot));
    }
    let (done, all) = (AtomicUsize::new(0), pieces.len().max(1));
    pieces.into_par_iter().enumerate().for_each(|(piece, slots)| {
        if control.is_cancelled() {
            return;
        }
        let first = start + stride * piece * SOME;
        let there = first..(first + stride * SOME).min(bytes.len());
        data.begin(there.clone());
        for (mut slot, target) in slots.into_iter().zip(targets) {
            for (component, (at, number)) in target.parts.iter().enumerate() {
                slot.fill(bytes, (first + at, stride), component, *number);
            }
        }
        data.done(there);
        control.reach((1 + done.fetch_add(1, Relaxed)) as f32 / all as f32);
    });
    Fault::if_cancelled(control)?;
    Ok(columns.into_iter().map(Room::into_values).collect())
}

/// Sees that all numbers lie in so many bytes.
fn check(length: usize, records: &Records, targets: &[Target]) -> Result<(), Fault> {
    let Some(last) = records.count.checked_sub(1) else { return Ok(()) };
    let end = |(at, number): &(usize, Number)| {
        let last = records.start.checked_add(records.stride.checked_mul(last)?)?;
        last.checked_add(*at)?.checked_add(number.size)
    };
    let inside = |part| end(part).is_some_and(|end| end <= length);
    if targets.iter().flat_map(|target| &target.parts).all(inside) {
        return Ok(());
    }
    Err(Fault::whole(
        format!("{} records do not fit into the {length} bytes that there are", records.count),
        "wait until the file is written, or write it again",
    ))
}

/// Columns of zeros, if there is memory for them.
pub(super) fn rooms(targets: &[Target], count: usize) -> Result<Vec<Room>, Fault> {
    let row: usize = targets.iter().map(|target| target.form.size() * target.parts.len()).sum();
    let needed = row.saturating_mul(count) as u64;
    let refused = |there: String| {
        let needed = text::bytes(needed);
        Fault::whole(
            format!("{count} particles take {needed} of memory, and {there}"),
            "free some memory, or draw fewer particles at a time",
        )
    };
    memory::room(needed)
        .map_err(|available| refused(format!("{} is available", text::bytes(available))))?;
    let rooms: Option<Vec<Room>> = targets.iter().map(|target| Room::new(target, count)).collect();
    rooms.ok_or_else(|| refused("it cannot be had".into()))
}

/// A column that is being filled, and how many values a record has.
#[derive(Debug)]
pub(super) enum Room {
    F32(Vec<f32>, usize),
    F64(Vec<f64>, usize),
    Integers(Vec<i64>, usize),
    Bytes(Vec<u8>, usize),
}

impl Room {
    /// Of zeros; none where the memory cannot be had.
    fn new(target: &Target, count: usize) -> Option<Self> {
        let width = target.parts.len();
        let length = width.checked_mul(count)?;
        Some(match target.form {
            Form::F32 => Self::F32(zeros(length)?, width),
            Form::F64 => Self::F64(zeros(length)?, width),
            Form::Integers => Self::Integers(zeros(length)?, width),
            Form::Bytes => Self::Bytes(zeros(length)?, width),
        })
    }

    /// The places of some records after another, [`SOME`] at a time.
    fn slots(&mut self) -> Vec<Slot<'_>> {
        fn cut<'a, T>(
            values: &'a mut [T],
            width: usize,
            slot: impl Fn(&'a mut [T], usize) -> Slot<'a>,
        ) -> Vec<Slot<'a>> {
            values.chunks_mut((width * SOME).max(1)).map(|values| slot(values, width)).collect()
        }
        match self {
            Self::F32(values, width) => cut(values, *width, Slot::F32),
            Self::F64(values, width) => cut(values, *width, Slot::F64),
            Self::Integers(values, width) => cut(values, *width, Slot::Integers),
            Self::Bytes(values, width) => cut(values, *width, Slot::Bytes),
        }
    }

    /// Sets one number of one record.
    pub fn set(&mut self, record: usize, component: usize, number: Number, cell: &[u8]) {
        match self {
            Self::F32(to, width) => to[record * *width + component] = number.read(cell).0 as f32,
            Self::F64(to, width) => to[record * *width + component] = number.read(cell).0,
            Self::Integers(to, width) => to[record * *width + component] = integer(number, cell),
            Self::Bytes(to, width) => to[record * *width + component] = cell[0],
        }
    }

    /// What was read.
    pub fn into_values(self) -> Values {
        match self {
            Self::F32(values, _) => Values::Reals(Reals::F32(values.into())),
            Self::F64(values, _) => Values::Reals(Reals::F64(values.into())),
            Self::Integers(values, _) => Values::Integers(values),
            Self::Bytes(values, _) => Values::Bytes(values.into()),
        }
    }
}

/// Where some records of a column go.
enum Slot<'a> {
    F32(&'a mut [f32], usize),
    F64(&'a mut [f64], usize),
    Integers(&'a mut [i64], usize),
    Bytes(&'a mut [u8], usize),
}

impl Slot<'_> {
    /// Reads one number of each record: `place` is where that of the first record lies, and the
    /// bytes from one to the next.
    fn fill(&mut self, bytes: &[u8], place: (usize, usize), component: usize, number: Number) {
        let size = number.size;
        let float = |wanted| number.kind == Kind::Float && size == wanted && !number.big;
        match self {
            Self::F32(to, width) if float(4) => {
                gather(to, (*width, component), bytes, place, 4, |cell| {
                    four(cell, f32::from_le_bytes)
                });
            }
            Self::F32(to, width) => {
                let read = |cell: &[u8]| number.read(cell).0 as f32;
                gather(to, (*width, component), bytes, place, size, read);
            }
            Self::F64(to, width) if float(8) => {
                gather(to, (*width, component), bytes, place, 8, |cell| {
                    cell.first_chunk().map_or(0.0, |cell| f64::from_le_bytes(*cell))
                });
            }
            Self::F64(to, width) => {
                let read = |cell: &[u8]| number.read(cell).0;
                gather(to, (*width, component), bytes, place, size, read);
            }
            Self::Integers(to, width) => {
                let read = |cell: &[u8]| integer(number, cell);
                gather(to, (*width, component), bytes, place, size, read);
            }
            Self::Bytes(to, width) => {
                gather(to, (*width, component), bytes, place, 1, |cell| cell[0]);
            }
        }
    }
}

/// A number of four bytes.
#[inline]
fn four<T: Default>(cell: &[u8], read: fn([u8; 4]) -> T) -> T {
    cell.first_chunk().map_or_else(T::default, |cell| read(*cell))
}

/// An integer; of 8 bytes, all of its bits.
#[inline]
fn integer(number: Number, cell: &[u8]) -> i64 {
    match <[u8; 8]>::try_from(cell) {
        Ok(cell) if number.big => i64::from_be_bytes(cell),
        Ok(cell) => i64::from_le_bytes(cell),
        Err(_) => number.read(cell).0 as i64,
    }
}

/// Reads one number of each record into every `width`th value.
#[inline]
fn gather<T>(
    to: &mut [T],
    (width, component): (usize, usize),
    bytes: &[u8],
    (mut at, stride): (usize, usize),
    size: usize,
    read: impl Fn(&[u8]) -> T,
) {
    for row in to.chunks_exact_mut(width) {
        row[component] = read(&bytes[at..at + size]);
        at += stride;
    }
}

/// Whether a number is a byte.
pub(super) fn is_byte(number: Number) -> bool {
    number.kind == Kind::Uint && number.size == 1
}

/// Channels as colours: bytes, or reals from 0 to 1. Whatever else they are is no colour, unless
/// each is a byte's number, which is said. `bytes`: the file has them as bytes.
pub(super) fn colors(values: Values, bytes: bool, notes: &mut Vec<String>) -> (Role, Values) {
    let all = |test: fn(f64) -> bool| {
        let holds = |at: usize| values.get(at).is_some_and(test);
        (0..values.len()).into_par_iter().all(holds)
    };
    if matches!(values, Values::Bytes(_)) {
        return (Role::Color, values);
    }
    if matches!(values, Values::Reals(_)) && all(|value| (0.0..=1.0).contains(&value)) {
        return (Role::Color, values);
    }
    if all(|value| (0.0..=255.0).contains(&value) && value.fract() == 0.0) {
        let byte = |at: usize| values.get(at).unwrap_or(0.0) as u8;
        let of_bytes: Vec<u8> = (0..values.len()).into_par_iter().map(byte).collect();
        if !bytes {
            notes.push("red, green and blue are no bytes: they are taken as 0 to 255".into());
        }
        return (Role::Color, Values::Bytes(of_bytes.into()));
    }
    notes.push(
        "red, green and blue are neither from 0 to 1 nor integers from 0 to 255: no colours".into(),
    );
    (Role::Other, values)
}

/// The first number that is not finite, by its place.
pub(super) fn first_not_finite(reals: &Reals) -> Option<usize> {
    super::first_unlike(reals, f64::is_finite)
}

#[cfg(test)]
mod tests {
    use bytes::Bytes;

    use super::*;

    #[test]
    fn numbers_go_to_their_places() {
        let count = 3 * SOME + 5;
        let record = |n: usize| {
            let (real, byte) = (n as f32, n as u8);
            let double = f64::from(real + 0.5).to_be_bytes();
            [&[7u8][..], &real.to_le_bytes(), &double, &[byte]].concat()
        };
        let mut bytes = vec![1, 2, 3];
        bytes.extend((0..count).flat_map(record));
        let number = |code| Number::of(code).unwrap();
        let targets = [
            Target { form: Form::F32, parts: vec![(1, number("<f4"))] },
            Target { form: Form::F64, parts: vec![(5, number(">f8")), (1, number("<f4"))] },
            Target { form: Form::Bytes, parts: vec![(13, number("|u1"))] },
            Target { form: Form::Integers, parts: vec![(0, number("|i1"))] },
        ];
        let data = Data::from(Bytes::from(bytes));
        let records = Records { start: 3, stride: 14, count };
        let columns = read(&data, &records, &targets, &Control::new()).unwrap();
        for row in [0, 1, SOME, count - 1] {
            let n = row as f64;
            let found = [(0, row), (1, 2 * row), (1, 2 * row + 1), (2, row), (3, row)];
            let found = found.map(|(column, at): (usize, usize)| columns[column].get(at).unwrap());
            assert_eq!(found, [n, n + 0.5, n, f64::from(row as u8), 7.0]);
        }
        let records = Records { count: count + 1, ..records };
        read(&data, &records, &targets, &Control::new()).expect_err("beyond the end");
        let records = Records { count: usize::MAX, ..records };
        read(&data, &records, &targets, &Control::new()).expect_err("beyond all ends");
    }
}
