//! DCD trajectories of CHARMM, NAMD, X-PLOR, LAMMPS and OpenMM.
//!
//! The format: that of VMD's dcdplugin, as CHARMM and X-PLOR write it. A file is records of
//! Fortran, each between two marks that say how long it is: a header, titles, the number of atoms,
//! and of each frame its box, if there is one, and all x, all y and all z as 32-bit floats. A
//! frame's place is the byte at which it begins. How many frames there are is known from the
//! length of the file: the header's number is that of a run that may have been cut short.

use std::ops::Range;

use rayon::prelude::*;

use super::{
    Cell, Data, Particles, Reader,
    binary::{all_finite, numbers, room, take},
};
use crate::input::report::Fault;
use planisphere_core::{drawing::Control, scene::Reals};

/// Bytes of the header's record.
const HEADER: usize = 84;

/// Whether bytes begin as a DCD file does.
pub(super) fn is(beginning: &[u8]) -> bool {
    Marks::of(beginning).is_some()
}

/// A reader.
pub(super) fn open(data: &Data) -> Result<Box<dyn Reader>, Fault> {
    Ok(Box::new(Dcd::open(data.as_slice())?))
}

/// How the marks of records, and all numbers, are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Marks {
    /// Whether the big end is first.
    big: bool,
    /// Bytes of a mark.
    size: usize,
}

impl Marks {
    /// Those of a file, whose first record is known.
    fn of(beginning: &[u8]) -> Option<Self> {
        [(false, 4), (true, 4), (false, 8), (true, 8)].into_iter().find_map(|(big, size)| {
            let marks = Self { big, size };
            let word: [u8; 4] = take(beginning, size)?;
            let known = [*b"CORD", *b"VELD"].contains(&word);
            (known && marks.read(beginning, 0)? == HEADER as u64).then_some(marks)
        })
    }

    fn read(self, bytes: &[u8], at: usize) -> Option<u64> {
        if self.size == 4 {
            return self.integer(bytes, at).map(u64::from);
        }
        let found: [u8; 8] = take(bytes, at)?;
        Some(if self.big { u64::from_be_bytes(found) } else { u64::from_le_bytes(found) })
    }

    fn integer(self, bytes: &[u8], at: usize) -> Option<u32> {
        let found: [u8; 4] = take(bytes, at)?;
        Some(if self.big { u32::from_be_bytes(found) } else { u32::from_le_bytes(found) })
    }

    fn reals(self, bytes: &[u8]) -> Vec<f32> {
        numbers(bytes, if self.big { f32::from_be_bytes } else { f32::from_le_bytes })
    }

    /// The record that begins at a byte, and where the next one begins.
    fn record(self, whole: &[u8], at: usize, what: &str) -> Result<(Range<usize>, usize), Fault> {
        let short = |needed: u64| {
            Fault::whole(
                format!(
                    "the record of {what}, which begins at byte {at}, ends at byte {needed}, but \
                     the file has {} bytes: it is cut short",
                    whole.len()
                ),
                "wait until the file is written, or copy it again",
            )
        };
        let size = self.size as u64;
        let start = (at as u64).saturating_add(size);
        let length = self.read(whole, at).ok_or_else(|| short(start))?;
        let end = start.saturating_add(length);
        let next = end.saturating_add(size);
        let there = |at: u64| usize::try_from(at).ok().filter(|at| *at <= whole.len());
        let (Some(start), Some(end), Some(next)) = (there(start), there(end), there(next)) else {
            return Err(short(next));
        };
        match self.read(whole, end) {
            Some(behind) if behind == length => Ok((start..end, next)),
            behind => Err(Fault::whole(
                format!(
                    "the record of {what} has {length} bytes by the mark at byte {at}, but {} by \
                     the one behind it, at byte {end}",
                    behind.unwrap_or(0)
                ),
                "copy the file again, or write it again: it is damaged",
            )),
        }
    }

    /// Where the record begins behind that of the titles. There are programs whose marks are of two
    /// titles, however many there are: then their number tells.
    fn skip_titles(self, whole: &[u8], at: usize) -> Result<usize, Fault> {
        let marked = self.record(whole, at, "the titles");
        marked.map(|(_, next)| next).or_else(|fault| {
            let counted = || {
                let titles = self.integer(whole, at.checked_add(self.size)?)?;
                let bytes = usize::try_from(titles).ok()?.checked_mul(80)?.checked_add(4)?;
                let next = at.checked_add(2 * self.size)?.checked_add(bytes)?;
                let (count, _) = self.record(whole, next, "the number of atoms").ok()?;
                (count.len() == 4).then_some(next)
            };
            counted().ok_or(fault)
        })
    }
}

/// What is known of a file.
#[derive(Debug)]
struct Dcd {
    marks: Marks,
    /// How many atoms there are.
    atoms: usize,
    /// Those that frames but the first have, counted from 0, where others are fixed.
    free: Option<Vec<u32>>,
    /// Whether frames begin with a box.
    boxed: bool,
    /// Whether frames end with a fourth number of each atom.
    fourth: bool,
    /// Where the first frame begins.
    first: usize,
}

/// Where the records of a frame lie.
struct Records {
    cell: Option<Range<usize>>,
    axes: [Range<usize>; 3],
    end: usize,
}

impl Reader for Dcd {
    fn frame(&self, data: &Data, at: usize) -> Result<Option<Range<usize>>, Fault> {
        let start = at.max(self.first);
        if start >= data.len() {
            return Ok(None);
        }
        Ok(Some(start..self.records(data.as_slice(), start)?.end))
    }

    fn read(
        &self,
        data: &Data,
        frame: Range<usize>,
        control: &Control,
    ) -> Result<Particles, Fault> {
        Fault::if_cancelled(control)?;
        let whole = data.as_slice();
        let records = self.records(whole, frame.start)?;
        room(self.atoms.saturating_mul(24))?;
        data.begin(frame.clone());
        let mut axes = Vec::with_capacity(3);
        for range in &records.axes {
            axes.push(self.marks.reals(whole.get(range.clone()).unwrap_or_default()));
        }
        if let Some(free) = self.free.as_ref().filter(|_| frame.start != self.first) {
            // What is fixed is where it was in the first frame.
            let first = self.records(whole, self.first)?;
            for (axis, range) in axes.iter_mut().zip(first.axes) {
                let mut all = self.marks.reals(whole.get(range).unwrap_or_default());
                for (number, value) in free.iter().zip(axis.iter()) {
                    if let Some(place) = all.get_mut(*number as usize) {
                        *place = *value;
                    }
                }
                *axis = all;
            }
        }
        data.done(frame);
        let centers = Reals::F32(interleaved(&axes).into());
        all_finite(&centers)?;
        let mut notes = Vec::new();
        let cell = records.cell.and_then(|range| self.cell(whole.get(range)?, &mut notes));
        Ok(Particles { centers, centers_from: "x y z".into(), columns: Vec::new(), cell, notes })
    }
}

/// Three arrays of one length as rows of three.
fn interleaved(axes: &[Vec<f32>]) -> Vec<f32> {
    let [x, y, z] = axes else { return Vec::new() };
    /// Rows of a part.
    const ROWS: usize = 1 << 14;
    let mut rows = bytemuck::allocation::zeroed_vec(3 * x.len());
    rows.par_chunks_mut(3 * ROWS).enumerate().for_each(|(part, rows)| {
        let [x, y, z] = [x, y, z].map(|axis| &axis[ROWS * part..]);
        for (row, ((x, y), z)) in rows.as_chunks_mut::<3>().0.iter_mut().zip(x.iter().zip(y).zip(z))
        {
            *row = [*x, *y, *z];
        }
    });
    rows
}

impl Dcd {
    fn open(whole: &[u8]) -> Result<Self, Fault> {
        let Some(marks) = Marks::of(whole) else {
            return Err(Fault::whole(
                "the file does not begin with the header of a DCD file: 84, then `CORD`",
                "name the format of the file with --format",
            ));
        };
        let (header, at) = marks.record(whole, 0, "the header")?;
        let start = header.start;
        if whole.get(start..).is_some_and(|rest| rest.starts_with(b"VELD")) {
            return Err(Fault::whole(
                "the file has velocities, and no positions",
                "name the file of the positions",
            ));
        }
        let number = |place: usize| marks.integer(whole, start + 4 + 4 * place).unwrap_or(0);
        // The last number is CHARMM's version. X-PLOR leaves it 0, and has other numbers where
        // CHARMM says what else is in the file.
        let by_charmm = number(19) != 0;
        let at = marks.skip_titles(whole, at)?;
        let (count, at) = marks.record(whole, at, "the number of atoms")?;
        let found = marks.integer(whole, count.start).filter(|_| count.len() >= 4);
        let atoms = found.and_then(|atoms| usize::try_from(atoms).ok());
        let atoms = atoms.ok_or_else(|| wrong_length("the number of atoms", &count, 4))?;
        let mut dcd = Self {
            marks,
            atoms,
            free: None,
            boxed: by_charmm && number(10) != 0,
            fourth: by_charmm && number(11) == 1,
            first: at,
        };
        if let fixed @ 1.. = usize::try_from(number(8)).unwrap_or(usize::MAX) {
            dcd.read_free(whole, fixed)?;
        }
        Ok(dcd)
    }

    /// Which atoms are not fixed.
    fn read_free(&mut self, whole: &[u8], fixed: usize) -> Result<(), Fault> {
        let Some(count) = self.atoms.checked_sub(fixed) else {
            return Err(Fault::whole(
                format!("{fixed} atoms are fixed, but there are {}", self.atoms),
                "copy the file again, or write it again: its header is damaged",
            ));
        };
        let (range, next) = self.marks.record(whole, self.first, "the free atoms")?;
        if Some(range.len()) != count.checked_mul(4) {
            return Err(wrong_length("the free atoms", &range, count.saturating_mul(4)));
        }
        let bytes = whole.get(range).unwrap_or_default();
        let turn = if self.marks.big { u32::from_be_bytes } else { u32::from_le_bytes };
        let free: Option<Vec<u32>> = numbers(bytes, |bytes| turn(bytes).checked_sub(1))
            .into_iter()
            .map(|number| number.filter(|number| (*number as usize) < self.atoms))
            .collect();
        let wrong = || {
            Fault::whole(
                format!("a free atom has a number that is not 1 to {}", self.atoms),
                "copy the file again, or write it again: its header is damaged",
            )
        };
        self.free = Some(free.ok_or_else(wrong)?);
        self.first = next;
        Ok(())
    }

    /// Where the records of a frame lie that begins at a byte.
    fn records(&self, whole: &[u8], start: usize) -> Result<Records, Fault> {
        let mut at = start;
        let mut next = |what: &str| -> Result<Range<usize>, Fault> {
            let (range, next) = self.marks.record(whole, at, what)?;
            at = next;
            Ok(range)
        };
        let cell = if self.boxed { Some(next("a box")?) } else { None };
        let own = self.free.as_ref().filter(|_| start != self.first).map(Vec::len);
        let bytes = own.unwrap_or(self.atoms).saturating_mul(4);
        let mut axis = |what: &str| match next(what)? {
            range if range.len() == bytes => Ok(range),
            range => Err(wrong_length(what, &range, bytes)),
        };
        let axes = [axis("all x")?, axis("all y")?, axis("all z")?];
        if self.fourth {
            next("a fourth dimension")?;
        }
        Ok(Records { cell, axes, end: at })
    }

    /// The box of a record: a, gamma, b, beta, alpha and c, where angles are degrees or their
    /// cosines; or, by newer CHARMM, the lower half of a symmetric matrix. What it is, is known
    /// from the numbers alone: as MDAnalysis does.
    fn cell(&self, record: &[u8], notes: &mut Vec<String>) -> Option<Cell> {
        if record.len() != 48 {
            notes.push(format!("the box is {} bytes, and not 48: it was left out", record.len()));
            return None;
        }
        let turn = if self.marks.big { f64::from_be_bytes } else { f64::from_le_bytes };
        let found: [f64; 6] = numbers(record, turn).try_into().ok()?;
        let [a, gamma, b, beta, alpha, c] = found;
        if [a, b, c] == [0.0; 3] {
            return None;
        }
        let angles = [alpha, beta, gamma];
        let (kind, edges) = if angles.iter().all(|angle| (-1.0..=1.0).contains(angle)) {
            ("cosines of angles", from_cosines([a, b, c], angles))
        } else if found.iter().any(|n| *n < 0.0) || angles.iter().any(|angle| *angle > 180.0) {
            // Here what stands where angles would is no angle.
            let (xx, xy, yy, xz, yz, zz) = (a, gamma, b, beta, alpha, c);
            ("a symmetric matrix", Some([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))
        } else {
            // Right angles are exact.
            let cosine = |angle: f64| if angle == 90.0 { 0.0 } else { angle.to_radians().cos() };
            ("angles in degrees", from_cosines([a, b, c], angles.map(cosine)))
        };
        let Some(edges) = edges.filter(|edges| edges.as_flattened().iter().all(|n| n.is_finite()))
        else {
            notes.push("the numbers of the box are those of none: it was left out".into());
            return None;
        };
        let across = [edges[1][0], edges[2][0], edges[2][1]];
        if across != [0.0; 3] {
            notes.push(format!("the box is not upright: its numbers are taken as {kind}"));
        }
        notes.push("the file does not say where the box lies: its corner is taken as 0 0 0".into());
        Some(Cell { origin: [0.0; 3], edges })
    }
}

/// The edges of lengths and cosines: the first along x, the second in the plane of x and y.
fn from_cosines([a, b, c]: [f64; 3], [alpha, beta, gamma]: [f64; 3]) -> Option<[[f64; 3]; 3]> {
    let sine = (1.0 - gamma * gamma).sqrt();
    let y = (alpha - beta * gamma) / sine;
    let z = (1.0 - beta * beta - y * y).sqrt();
    (sine > 0.0 && z > 0.0).then_some([
        [a, 0.0, 0.0],
        [b * gamma, b * sine, 0.0],
        [c * beta, c * y, c * z],
    ])
}

fn wrong_length(what: &str, record: &Range<usize>, wanted: usize) -> Fault {
    Fault::whole(
        format!(
            "the record of {what} at byte {} has {} bytes, but {wanted} are needed",
            record.start,
            record.len()
        ),
        "copy the file again, or write it again: it is damaged",
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::particles::{
        Format,
        file::tests::{centers, frame, opened},
    };

    /// How a file is made.
    #[derive(Clone, Default)]
    struct Made {
        big: bool,
        wide: bool,
        fixed: Vec<u32>,
        cell: Option<[f64; 6]>,
        fourth: bool,
        xplor: bool,
    }

    impl Made {
        fn int(&self, value: u32) -> [u8; 4] {
            if self.big { value.to_be_bytes() } else { value.to_le_bytes() }
        }

        fn record(&self, out: &mut Vec<u8>, content: &[u8]) {
            let length = content.len() as u64;
            let mark = match (self.big, self.wide) {
                (true, true) => length.to_be_bytes().to_vec(),
                (false, true) => length.to_le_bytes().to_vec(),
                _ => self.int(length as u32).to_vec(),
            };
            [&mark, content, &mark].iter().for_each(|part| out.extend(*part));
        }

        /// A file of three atoms, whose `x` in frame `f` is `f + 0.5`, `y` 10 and `z` 20 more.
        fn bytes(&self, frames: u32) -> Vec<u8> {
            let mut out = Vec::new();
            let mut header = b"CORD".to_vec();
            let mut numbers = [0u32; 20];
            numbers[8] = self.fixed.len() as u32;
            if self.xplor {
                // The lower half of a 64-bit number.
                numbers[10] = 7;
            } else {
                numbers[10] = u32::from(self.cell.is_some());
                (numbers[11], numbers[19]) = (u32::from(self.fourth), 24);
            }
            numbers.iter().for_each(|number| header.extend(self.int(*number)));
            self.record(&mut out, &header);
            self.record(&mut out, &[&self.int(1)[..], &[b' '; 80]].concat());
            self.record(&mut out, &self.int(3));
            let free: Vec<u32> = (1..=3).filter(|atom| !self.fixed.contains(atom)).collect();
            if !self.fixed.is_empty() {
                let free: Vec<u8> = free.iter().flat_map(|atom| self.int(*atom)).collect();
                self.record(&mut out, &free);
            }
            for f in 0..frames {
                if let Some(cell) = self.cell {
                    let turn = |n: f64| if self.big { n.to_be_bytes() } else { n.to_le_bytes() };
                    self.record(&mut out, &cell.map(turn).concat());
                }
                let atoms = if f == 0 { &[1, 2, 3][..] } else { &free };
                for axis in 0..3 + u32::from(self.fourth) {
                    let value = |atom: &u32| (f * 100 + atom * 1000 + axis * 10) as f32 + 0.5;
                    let values = atoms.iter().flat_map(|atom| self.int(value(atom).to_bits()));
                    self.record(&mut out, &values.collect::<Vec<u8>>());
                }
            }
            out
        }
    }

    #[test]
    fn frames_are_read_in_all_kinds_of_files() {
        let cell = Some([4.0, 0.0, 5.0, 0.0, 0.0, 6.0]);
        let plain = Made::default();
        for made in [
            plain.clone(),
            Made { big: true, cell, ..plain.clone() },
            Made { wide: true, cell, ..plain.clone() },
            Made { big: true, wide: true, fourth: true, ..plain.clone() },
            Made { xplor: true, ..plain.clone() },
            Made { fourth: true, cell, ..plain.clone() },
        ] {
            let bytes = made.bytes(4);
            assert!(is(&bytes));
            let file = opened(Format::Dcd, bytes).unwrap();
            assert_eq!(file.frames(&Control::new()).unwrap(), 4, "whatever the header says");
            for number in [3, 0, 2] {
                let found = file.read(number, &Control::new()).unwrap();
                let at = |atom: f64| [0.5, 10.5, 20.5].map(|n| 1000.0 * atom + n);
                let moved = |[x, y, z]: [f64; 3]| [x, y, z].map(|n| n + 100.0 * number as f64);
                let wanted = [1.0, 2.0, 3.0].map(|atom| moved(at(atom)));
                assert_eq!(centers(&found), wanted);
                assert_eq!(found.cell.is_some(), made.cell.is_some());
            }
        }
        assert_eq!(
            opened(Format::Dcd, plain.bytes(0)).unwrap().frames(&Control::new()).ok(),
            Some(0)
        );
    }

    #[test]
    fn marks_of_titles_may_be_wrong() {
        let mut bytes = Made::default().bytes(2);
        bytes[96] = 3;
        bytes.splice(180..180, [b' '; 160]);
        let file = opened(Format::Dcd, bytes).unwrap();
        assert_eq!(file.frames(&Control::new()).unwrap(), 2);
    }

    #[test]
    fn what_is_fixed_stays() {
        let made = Made { fixed: vec![2], cell: Some([0.0; 6]), ..Made::default() };
        let found = frame(Format::Dcd, made.bytes(3), 2).unwrap();
        let x: Vec<f64> = centers(&found).iter().map(|at| at[0]).collect();
        assert_eq!((x, found.cell), (vec![1200.5, 2000.5, 3200.5], None));
        let mut bytes = made.bytes(3);
        let list = 92 + 92 + 12 + 4;
        bytes[list..list + 4].copy_from_slice(&4u32.to_le_bytes());
        let error = frame(Format::Dcd, bytes, 0).expect_err("no such atom");
        assert!(error.message().contains("not 1 to 3"), "{error}");
        let made = Made { fixed: vec![2; 4], ..made };
        let error = frame(Format::Dcd, made.bytes(1), 0).expect_err("too many");
        assert!(error.message().contains("4 atoms are fixed"), "{error}");
    }

    #[test]
    fn boxes_are_degrees_cosines_or_a_matrix() {
        let (third, root) = (f64::from(0.5f32), 0.75f64.sqrt());
        let upright = [[4.0, 0.0, 0.0], [0.0, 5.0, 0.0], [0.0, 0.0, 6.0]];
        for (numbers, wanted, notes) in [
            ([4.0, 0.0, 5.0, 0.0, 0.0, 6.0], Some(upright), 1),
            ([4.0, 90.0, 5.0, 90.0, 90.0, 6.0], Some(upright), 1),
            (
                [4.0, third, 2.0, 0.0, 0.0, 6.0],
                Some([[4.0, 0.0, 0.0], [1.0, 2.0 * root, 0.0], [0.0, 0.0, 6.0]]),
                2,
            ),
            (
                [4.0, -1.5, 5.0, 2.0, 3.0, 6.0],
                Some([[4.0, -1.5, 2.0], [-1.5, 5.0, 3.0], [2.0, 3.0, 6.0]]),
                2,
            ),
            ([0.0; 6], None, 0),
            ([4.0, f64::NAN, 5.0, 90.0, 90.0, 6.0], None, 1),
            ([4.0, 1.0, 5.0, 0.0, 0.0, 6.0], None, 1),
        ] {
            let made = Made { cell: Some(numbers), ..Made::default() };
            let found = frame(Format::Dcd, made.bytes(1), 0).unwrap();
            assert_eq!((found.cell.map(|cell| cell.edges), found.notes.len()), (wanted, notes));
        }
        let made = Made { cell: Some([4.0, 60.0, 2.0, 90.0, 90.0, 6.0]), ..Made::default() };
        let edges = frame(Format::Dcd, made.bytes(1), 0).unwrap().cell.unwrap().edges;
        assert!((edges[1][0] - 1.0).abs() < 1e-15 && edges[2] == [0.0, 0.0, 6.0]);
    }

    #[test]
    fn what_is_wrong_is_told() {
        let whole = Made::default().bytes(3);
        let file = opened(Format::Dcd, &whole[..whole.len() - 1]).unwrap();
        let error = file.frames(&Control::new()).expect_err("cut");
        assert!(error.message().contains("the frames before it are whole"), "{error}");
        let first = 92 + 92 + 12;
        for (at, value, words) in [
            (first + 16, 11, "has 12 bytes by the mark at byte 196, but 11 by the one behind it"),
            (first, 0xff, "is cut short"),
            (192, 5, "the number of atoms has 4 bytes by the mark at byte 184, but 5 by"),
            (188, 9, "the record of all x at byte 200 has 12 bytes, but 36 are needed"),
            (4, b'V', "does not begin with the header"),
        ] {
            let mut bytes = whole.clone();
            bytes[at] = value;
            let error = frame(Format::Dcd, bytes, 0).expect_err(words);
            assert!(error.message().contains(words), "{error}");
        }
        let mut bytes = whole.clone();
        bytes[first + 4..first + 8].copy_from_slice(&f32::NAN.to_le_bytes());
        let error = frame(Format::Dcd, bytes, 0).expect_err("no place");
        assert!(error.message().contains("`x` of particle 0 (counted from 0) is NaN"), "{error}");
        let mut bytes = whole.clone();
        bytes[4..8].copy_from_slice(b"VELD");
        let error = frame(Format::Dcd, bytes, 0).expect_err("velocities");
        assert!(error.message().contains("velocities"), "{error}");
    }

    #[test]
    fn no_bytes_make_it_panic() {
        let made = Made { fixed: vec![2], cell: Some([1.0; 6]), fourth: true, ..Made::default() };
        let whole = made.bytes(2);
        for at in 0..whole.len() {
            for value in [0, 1, 0x7f, 0x80, 0xff] {
                let mut bytes = whole.clone();
                bytes[at] = value;
                let Ok(file) = opened(Format::Dcd, bytes) else { continue };
                (0..2).for_each(|number| drop(file.read(number, &Control::new())));
            }
        }
    }
}
