//! GRO files: structures and trajectories of GROMACS, as rows of fixed columns.
//!
//! The format: GROMACS reference manual, "File formats", gro. Lengths are in nanometres. A frame is
//! a title, the number of atoms, a row for each and the box. Positions take the columns from 21 on;
//! how many, is told by the distance of their decimal points. The file has no elements: they are
//! derived from the names of atoms and residues.

use std::{
    ops::Range,
    sync::atomic::{AtomicBool, Ordering},
};

use super::{
    Cell, Column, Data, Particles, Reader, Role, Values, Words, atoms,
    data::{Cell as TextCell, Line},
    number,
    rows::{self, Row, Store, Which},
};
use crate::input::report::Fault;
use planisphere_core::{drawing::Control, scene::Reals};

/// Columns before the positions.
const BEFORE: usize = 20;

/// Whether bytes begin as a GRO file does: with a title, a number alone, and a row.
pub(super) fn is(beginning: &[u8]) -> bool {
    let lines = || {
        let title = Line::at(beginning, 0)?;
        let count = Line::at(beginning, title.next)?;
        Some((count, Line::at(beginning, count.next)?))
    };
    let Some((count, row)) = lines() else { return false };
    match number::integer(count.text.trim_ascii()) {
        Some(0) => cell(row).is_ok(),
        Some(1..) => Layout::of(row).is_ok_and(|layout| {
            atoms::digits(field(row, 0..5)).is_some()
                && !field(row, 5..15).is_empty()
                && (0..3).all(|axis| atoms::short(field(row, layout.position(axis))).is_some())
        }),
        _ => false,
    }
}

/// A reader.
pub(super) fn open(_: &Data) -> Result<Box<dyn Reader>, Fault> {
    Ok(Box::new(Gro))
}

#[derive(Debug)]
struct Gro;

impl Reader for Gro {
    fn frame(&self, data: &Data, at: usize) -> Result<Option<Range<usize>>, Fault> {
        let Some(header) = Header::read(data, at)? else { return Ok(None) };
        let rest = data.as_slice().get(header.rows..).unwrap_or(b"");
        let mut end = header.rows;
        if let Some(rows) = header.count.checked_sub(1) {
            let mut ends = memchr::memchr_iter(b'\n', rest);
            let Some(last) = ends.nth(rows) else {
                let found = memchr::memchr_iter(b'\n', rest).count();
                let open = rest.last().is_some_and(|byte| *byte != b'\n');
                return Err(header.cut_short(found + usize::from(open)));
            };
            end = header.rows + last + 1;
        }
        let Some(line) = data.line(end).filter(|line| !line.is_blank()) else {
            return Err(header.cut_short(header.count).but(", and no box"));
        };
        Ok(Some(header.start..line.next))
    }

    fn read(
        &self,
        data: &Data,
        frame: Range<usize>,
        control: &Control,
    ) -> Result<Particles, Fault> {
        let Some(header) = Header::read(data, frame.start)? else {
            return Err(Fault::whole("there is no frame", "write the file again"));
        };
        let first = data.line(header.rows);
        let mut plan = match first {
            Some(line) if header.count > 0 => Plan::of(line)?,
            _ => Plan::default(),
        };
        // What a number is believed to be is no more than there are bytes for.
        let least = header.count.checked_mul(plan.layout.least());
        if least.is_none_or(|least| least > frame.end.saturating_sub(header.rows)) {
            return Err(header.too_many());
        }
        loop {
            let misfit = Misfit::default();
            let mut stores = plan.stores();
            let missing = |found| header.cut_short(found);
            let which = Which::First(header.count, &missing);
            let text = header.rows..frame.end;
            let parse = |line: Line<'_>, row: &mut Row<'_, '_>| plan.parse(line, row, &misfit);
            let read = rows::read(data, text, &which, &mut stores, control, parse);
            if misfit.apply(&mut plan) {
                continue;
            }
            let (end, _) = read?;
            let line = data.line(end).ok_or_else(|| header.cut_short(header.count))?;
            return Ok(finish(stores, cell(line)?, &plan));
        }
    }
}

/// What stands before the rows of a frame.
struct Header {
    /// Where the title begins.
    start: usize,
    /// How many rows there are.
    count: usize,
    /// The line of that count.
    count_span: Range<usize>,
    /// Where the rows begin.
    rows: usize,
}

impl Header {
    /// Reads what begins at a place; none if nothing but blank lines follow.
    fn read(data: &Data, at: usize) -> Result<Option<Self>, Fault> {
        let count = |line: Line<'_>| {
            let count = number::integer(line.text.trim_ascii())?;
            usize::try_from(count).ok()
        };
        let Some(mut title) = data.line(at) else { return Ok(None) };
        // A title may be blank, and so may lines between two frames.
        while title.is_blank() && data.line(title.next).and_then(count).is_none() {
            let Some(next) = data.line(title.next) else { return Ok(None) };
            title = next;
        }
        let Some(line) = data.line(title.next) else {
            return Err(Fault::new(
                "the file ends behind this title: the number of atoms is expected below it",
                title.span(),
                "the last line",
                "wait until the file is written, or write it again",
            ));
        };
        let not =
            || number::not_an_integer("the number of atoms", line.text.trim_ascii(), line.span());
        let count = count(line).ok_or_else(not)?;
        let (start, count_span) = (title.start, line.span());
        Ok(Some(Self { start, count, count_span, rows: line.next }))
    }

    fn cut_short(&self, found: usize) -> Fault {
        let found = found.min(self.count);
        Fault::new(
            format!("{} atoms and a box are announced, but {found} rows follow", self.count),
            self.count_span.clone(),
            "more than there are",
            "wait until the file is written, or write it again",
        )
    }

    fn too_many(&self) -> Fault {
        Fault::new(
            format!("{} atoms are announced, but the lines that follow are too short", self.count),
            self.count_span.clone(),
            "more than there are",
            "correct the number, or write the file again",
        )
    }
}

/// Where the numbers of a row are.
#[derive(Clone, Copy, Default, PartialEq, Eq)]
struct Layout {
    /// Columns of one coordinate.
    width: usize,
}

impl Layout {
    /// By the decimal points of a row.
    fn of(line: Line<'_>) -> Result<Self, Fault> {
        let numbers = line.text.get(BEFORE..).unwrap_or(b"");
        let mut points = memchr::memchr_iter(b'.', numbers);
        if let (Some(first), Some(second), Some(third)) =
            (points.next(), points.next(), points.next())
            && second - first == third - second
            && (6..64).contains(&(second - first))
        {
            return Ok(Self { width: second - first });
        }
        if line.text.contains(&b'\t') {
            return Err(has_tab(line));
        }
        Err(Fault::new(
            "three numbers with decimal points at equal distances are expected from column 21 on",
            line.start + BEFORE.min(line.text.len())..line.span().end,
            "not three positions",
            "write the file again with GROMACS, or give it the fixed columns of GRO",
        ))
    }

    /// The columns of a coordinate.
    fn position(self, axis: usize) -> Range<usize> {
        BEFORE + axis * self.width..BEFORE + (axis + 1) * self.width
    }

    /// The columns of a component of the velocity.
    fn velocity(self, axis: usize) -> Range<usize> {
        self.position(axis + 3)
    }

    /// Bytes of the shortest row.
    fn least(self) -> usize {
        BEFORE + 2 * self.width
    }
}

/// Where the columns of a row go.
const CENTERS: usize = 0;
const RESIDUE_NUMBER: usize = 1;
const RESIDUE: usize = 2;
const NAME: usize = 3;
const NUMBER: usize = 4;
const ELEMENT: usize = 5;
const VELOCITY: usize = 6;

/// Their names; the positions have none.
const NAMES: [(&str, Role); 6] = [
    ("residue_number", Role::Other),
    ("residue_name", Role::Other),
    ("atom_name", Role::Other),
    ("atom_number", Role::Id),
    ("element", Role::Element),
    ("velocity", Role::Other),
];

/// How rows are read.
#[derive(Clone, Copy, Default, PartialEq, Eq)]
struct Plan {
    layout: Layout,
    /// Whether there are velocities.
    velocities: bool,
    /// Whether numbers of residues are words, as `*****` is.
    residue_words: bool,
    /// Whether numbers of atoms are words.
    number_words: bool,
}

/// Where a row does not fit a plan.
#[derive(Default)]
struct Misfit {
    residue_words: AtomicBool,
    number_words: AtomicBool,
    velocities: AtomicBool,
}

impl Misfit {
    /// Makes a plan that fits; false where it did fit.
    fn apply(&self, plan: &mut Plan) -> bool {
        let before = *plan;
        plan.residue_words |= self.residue_words.load(Ordering::Relaxed);
        plan.number_words |= self.number_words.load(Ordering::Relaxed);
        plan.velocities |= self.velocities.load(Ordering::Relaxed);
        before != *plan
    }
}

impl Plan {
    /// By the first row.
    fn of(line: Line<'_>) -> Result<Self, Fault> {
        let layout = Layout::of(line)?;
        let behind = line.text.get(layout.velocity(0).start..).unwrap_or(b"");
        let velocities = !behind.trim_ascii().is_empty();
        Ok(Self { layout, velocities, ..Self::default() })
    }

    fn stores(self) -> Vec<Store> {
        let number = |words| if words { Store::words() } else { Store::integers() };
        let mut stores = vec![
            Store::reals(3),
            number(self.residue_words),
            Store::words(),
            Store::words(),
            number(self.number_words),
            Store::words(),
        ];
        if self.velocities {
            stores.push(Store::reals(3));
        }
        stores
    }

    /// Reads a row.
    #[inline]
    fn parse(self, line: Line<'_>, row: &mut Row<'_, '_>, misfit: &Misfit) -> Result<(), Fault> {
        for (axis, name) in ["`x`", "`y`", "`z`"].into_iter().enumerate() {
            let value = real(line, self.layout.position(axis), name)?;
            if !value.is_finite() {
                let columns = self.layout.position(axis);
                let cell = field(line, columns.clone());
                return Err(number::not_finite(name, cell, span(line, columns)));
            }
            row.set_real(CENTERS, axis, value);
        }
        if self.velocities {
            for (axis, name) in ["`vx`", "`vy`", "`vz`"].into_iter().enumerate() {
                let columns = self.layout.velocity(axis);
                // Some particles of a file may lack theirs.
                let value = match field(line, columns.clone()) {
                    [] => f64::NAN,
                    _ => real(line, columns, name)?,
                };
                row.set_real(VELOCITY, axis, value);
            }
        }
        if memchr::memchr(b'\t', line.text).is_some() {
            return Err(has_tab(line));
        }
        let end = if self.velocities { 6 } else { 3 };
        let end = self.layout.position(end).start;
        if line.text.get(end..).is_some_and(|rest| rest.iter().any(|byte| *byte != b' ')) {
            misfit.velocities.store(true, Ordering::Relaxed);
            return Err(Fault::new(
                "the line goes on behind the velocity",
                line.start + end..line.span().end,
                "too much",
                "correct the line, or write the file again",
            ));
        }
        for (column, columns, is_words, misfits) in [
            (RESIDUE_NUMBER, 0..5, self.residue_words, &misfit.residue_words),
            (NUMBER, 15..20, self.number_words, &misfit.number_words),
        ] {
            let cell = field(line, columns);
            match atoms::digits(cell) {
                _ if is_words => row.set_word(column, cell),
                Some(value) => row.set_integer(column, 0, value),
                None => {
                    misfits.store(true, Ordering::Relaxed);
                    return Err(Fault::whole("a number is no integer", ""));
                }
            }
        }
        let (residue, name) = (field(line, 5..10), field(line, 10..15));
        row.set_word(RESIDUE, residue);
        row.set_word(NAME, name);
        atoms::set_found(row, ELEMENT, atoms::element_of_name(name, residue));
        Ok(())
    }
}

/// The bytes of some columns, without the blanks around them; fewer of a short line.
#[inline]
fn field(line: Line<'_>, columns: Range<usize>) -> &[u8] {
    atoms::field(line.text, columns)
}

/// The place of some columns in the input.
fn span(line: Line<'_>, columns: Range<usize>) -> Range<usize> {
    let end = line.span().end;
    (line.start + columns.start).min(end)..(line.start + columns.end).min(end)
}

/// The number of some columns.
#[inline]
fn real(line: Line<'_>, columns: Range<usize>, name: &str) -> Result<f64, Fault> {
    if let Some(value) = line.text.get(columns.clone()).and_then(atoms::eight) {
        return Ok(value);
    }
    let cell = field(line, columns.clone());
    if let Some(value) = atoms::short(cell) {
        return Ok(value);
    }
    if line.text.contains(&b'\t') {
        return Err(has_tab(line));
    }
    if cell.is_empty() && line.text.len() < columns.end {
        let end = line.span().end;
        return Err(Fault::new(
            format!("the line ends before {name}"),
            end..end,
            "cut short",
            "see whether the number of atoms is right, or write the file again",
        ));
    }
    let [first, last] = [columns.start + 1, columns.end];
    let fault = number::not_a_number(name, cell, span(line, columns));
    Err(fault.but(&format!(" in columns {first} to {last}")))
}

fn has_tab(line: Line<'_>) -> Fault {
    let at = memchr::memchr(b'\t', line.text).unwrap_or(0);
    Fault::new(
        "a tab stands in the line, whose columns are fixed",
        line.start + at..line.start + at + 1,
        "a tab",
        "write blanks in its place, so that the positions begin in column 21",
    )
}

/// The box of a line: three lengths, or three edges. No lengths are no box.
fn cell(line: Line<'_>) -> Result<Option<Cell>, Fault> {
    let (mut numbers, mut count) = ([0.0; 9], 0);
    for cell in box_cells(line) {
        let not = || number::not_a_number("a number of the box", cell.text, cell.span());
        let value = number::real(cell.text).ok_or_else(not)?;
        if !value.is_finite() {
            return Err(number::not_finite("a number of the box", cell.text, cell.span()));
        }
        if let Some(number) = numbers.get_mut(count) {
            *number = value;
        }
        count += 1;
    }
    if count != 3 && count != 9 {
        return Err(Fault::new(
            format!("the box is three or nine numbers, but there are {count}"),
            line.span(),
            "the box",
            "see whether the number of atoms is right, or write the file again",
        ));
    }
    let [xx, yy, zz, xy, xz, yx, yz, zx, zy] = numbers;
    let edges = [[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]];
    let is_none = edges.iter().flatten().all(|value| *value == 0.0);
    Ok((!is_none).then_some(Cell { origin: [0.0; 3], edges }))
}

/// The numbers of a box. Large ones touch, all with as many decimals as the last.
fn box_cells(line: Line<'_>) -> Vec<TextCell<'_>> {
    let points = |text: &[u8]| memchr::memchr_iter(b'.', text).count();
    let mut cells: Vec<TextCell<'_>> = line.cells().take(10).collect();
    let behind = |cell: &TextCell<'_>| Some(cell.text.len() - memchr::memrchr(b'.', cell.text)?);
    let Some(behind) = cells.last().and_then(behind) else { return cells };
    if cells.iter().all(|cell| points(cell.text) < 2) {
        return cells;
    }
    let mut parted = Vec::with_capacity(9);
    for TextCell { mut text, mut start } in cells.drain(..) {
        while let Some(point) = memchr::memchr(b'.', text).filter(|_| parted.len() < 10) {
            let (own, rest) = text.split_at((point + behind).min(text.len()));
            parted.push(TextCell { text: own, start });
            (text, start) = (rest, start + own.len());
        }
        if !text.is_empty() {
            parted.push(TextCell { text, start });
        }
    }
    parted
}

/// The particles of the columns.
fn finish(stores: Vec<Store>, cell: Option<Cell>, plan: &Plan) -> Particles {
    let mut stores = stores.into_iter();
    let centers = stores.next().map_or(Vec::new(), Store::into_reals);
    let (mut columns, mut notes) = (Vec::with_capacity(NAMES.len()), Vec::new());
    for ((name, role), store) in NAMES.into_iter().zip(stores) {
        let mut values = store.into_values();
        if let (Role::Element, Values::Words(words)) = (role, &mut values) {
            let (settled, counts) = atoms::settle(std::mem::take::<Words>(words));
            notes.extend(atoms::note_of_elements(counts, settled.codes.len()));
            *words = settled;
        }
        columns.push(Column::named(name, values).with_role(role));
    }
    if plan.velocities
        && let Some(velocity) = columns.pop()
    {
        columns.push(velocity.with_width(3));
    }
    Particles {
        centers: Reals::F64(centers.into()),
        centers_from: "x y z, in nm".into(),
        columns,
        cell,
        notes,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::particles::{
        Format,
        file::tests::{centers, frame, opened},
    };

    const WATER: &str = "\
MD of 2 waters, t= 0.0
    6
    1SOL     OW    1   0.126   1.624   1.679  0.1227 -0.0580  0.0434
    1SOL    HW1    2   0.190   1.661   1.747  0.8085  0.3191 -0.7791
    1SOL     MW    3   0.177   1.568   1.613 -0.9045 -2.6469  1.3180
    2ALA     CA99999-100.123-200.456-300.789  0.1000  0.2000  0.3000
    3CA      CA    0   4.000   5.000   6.000  0.0000  0.0000  0.0000
    4LIG     C1    1   7.000   8.000   9.000  0.0000  0.0000 -0.0000
   1.82060   2.82060   3.82060
";

    #[test]
    fn rows_and_boxes() {
        for text in [WATER.to_owned(), WATER.replace('\n', "\r\n"), WATER.trim_end().to_owned()] {
            let particles = frame(Format::Gro, text.as_str(), 0).unwrap();
            let wanted = [[0.126, 1.624, 1.679], [-100.123, -200.456, -300.789]];
            assert_eq!([centers(&particles)[0], centers(&particles)[3]], wanted);
            let velocity = particles.column("velocity").unwrap();
            assert_eq!((velocity.width, velocity.values.get(7)), (3, Some(-2.6469)));
            let Values::Words(elements) = &particles.role(Role::Element).unwrap().values else {
                panic!("words")
            };
            let elements: Vec<&str> = (0..6).map(|row| elements.get(row)).collect();
            assert_eq!(elements, ["O", "H", "", "C", "Ca", "C"]);
            let notes = [
                "elements were derived from the names of 5 of 6 atoms, 1 of them from the first \
                 letter alone",
                "1 of 6 atoms have no element that is known",
            ];
            assert_eq!(particles.notes, notes);
            let cell = particles.cell.unwrap();
            assert_eq!(cell.edges, [[1.8206, 0.0, 0.0], [0.0, 2.8206, 0.0], [0.0, 0.0, 3.8206]]);
        }
    }

    #[test]
    fn the_decimal_points_tell_the_columns() {
        let text = "\n1\n\
            \x20   1ALA     CA    1   0.12345  -1.62412-123.67900  0.122712  0.000000  1.5\n\
            1 2 3 4 5 6 7 8 9\n\n";
        let particles = frame(Format::Gro, text, 0).unwrap();
        assert_eq!(centers(&particles), [[0.12345, -1.62412, -123.679]]);
        let velocity = &particles.column("velocity").unwrap().values;
        assert_eq!([0, 1, 2].map(|axis| velocity.get(axis)), [0.122712, 0.0, 1.5].map(Some));
        let cell = particles.cell.unwrap();
        assert_eq!(cell.edges, [[1.0, 4.0, 5.0], [6.0, 2.0, 7.0], [8.0, 9.0, 3.0]]);
        // No velocities, no box, and numbers that have overflown.
        let text = "t\n1\n*****ALA     CA*****   0.123  -1.624-123.679\n0 0 0\n";
        let particles = frame(Format::Gro, text, 0).unwrap();
        assert!(particles.column("velocity").is_none() && particles.cell.is_none());
        let Values::Words(numbers) = &particles.column("atom_number").unwrap().values else {
            panic!("words")
        };
        assert_eq!(numbers.get(0), "*****");
        assert_eq!(frame(Format::Gro, "t\n0\n1 1 1\n", 0).unwrap().len(), 0);
        // Lengths that touch, and velocities that the first row lacks.
        let text = WATER.replacen("  0.1227 -0.0580  0.0434", "", 1);
        let text =
            text.replace("   1.82060   2.82060   3.82060", "40000.0000050000.00000   1.82060");
        let particles = frame(Format::Gro, text.as_str(), 0).unwrap();
        assert_eq!(particles.cell.unwrap().edges[1], [0.0, 50000.0, 0.0]);
        let velocity = &particles.column("velocity").unwrap().values;
        assert!(velocity.get(2).is_some_and(f64::is_nan));
        assert_eq!(velocity.get(7), Some(-2.6469));
    }

    #[test]
    fn frames_follow_one_another() {
        let two = [WATER, "\n", &WATER.replacen("0.126", "0.226", 1), "\n \n"].concat();
        let file = opened(Format::Gro, two.as_str()).unwrap();
        assert_eq!(file.frames(&Control::new()).unwrap(), 2);
        assert_eq!(centers(&file.read(1, &Control::new()).unwrap())[0][0], 0.226);
        // Cut in a row, before the box, and behind the title.
        for (cut, line) in [("    3CA      CA", 12), ("   1.82060", 12), ("    6", 11)] {
            let at = two.rfind(cut).unwrap();
            let file = opened(Format::Gro, &two[..at]).unwrap();
            let error = file.frames(&Control::new()).expect_err(cut);
            assert_eq!(error.line(), Some(line), "{error}");
            assert!(error.message().contains("the frame before it is whole"), "{error}");
        }
    }

    #[test]
    fn what_is_wrong_is_pointed_at() {
        for (old, new, line, words) in [
            ("   1.661", "   x.661", 4, "`x.661` stands where `y` is expected"),
            ("   1.661", "     nan", 4, "not finite"),
            ("   1.661", "\t 1.661 ", 4, "a tab"),
            ("  0.3191", "  0.3 91", 4, "`0.3 91` stands where `vy` is expected"),
            ("   1.624", "  1.624 ", 3, "equal distances"),
            (
                "1SOL    HW1    2   0.190   1.661   1.747  0.8085  0.3191 -0.7791",
                "",
                4,
                "ends before",
            ),
            (" -0.0000\n", " -0.0000  1.0\n", 8, "goes on behind the velocity"),
            ("\n    6\n", "\n   -6\n", 2, "the number of atoms"),
            ("\n    6\n", "\n    5\n", 8, "`4LIG` stands where a number of the box"),
            ("   1.82060", "", 9, "but there are 2"),
            ("\n    6\n", "\n99999999999\n", 2, "99999999999 atoms"),
        ] {
            let error = frame(Format::Gro, WATER.replacen(old, new, 1), 0).expect_err(new);
            assert_eq!(error.line(), Some(line), "{error}");
            assert!(error.message().contains(words), "{error}");
        }
        // Many empty lines are not believed to be rows.
        let many =
            [&WATER[..WATER.find("    1SOL    HW1").unwrap()], &"\n".repeat(9999), "1 1 1\n"]
                .concat()
                .replacen("    6", "10000", 1);
        let error = frame(Format::Gro, many.as_str(), 0).expect_err("too short");
        assert!(error.message().contains("too short"), "{error}");
    }

    #[test]
    fn files_are_known_by_their_first_lines() {
        for text in [WATER, "TITLE\n0\n1 1 1\n"] {
            assert!(is(text.as_bytes()), "{text}");
        }
        for text in [
            "",
            "3\n5\nC 0.0 0.0 0.0\n",
            "1\n\nC 0.0 0.0 0.0\n",
            "ITEM: TIMESTEP\n0\nITEM: X\n",
            "1\n1\n6                   0.000   0.000   0.000\n",
            "REMARK\nATOM\n",
        ] {
            assert!(!is(text.as_bytes()), "{text}");
        }
    }
}
