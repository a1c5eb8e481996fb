//! LAMMPS dump files, as text: `dump atom`, `dump custom` and those of other programs.
//!
//! The format: LAMMPS documentation, "dump command" and "Howto triclinic". A frame is some
//! `ITEM:` lines, each with values below it; the last, `ITEM: ATOMS`, names the columns. Its rows
//! come in any order, which may differ from frame to frame: they stay in the order of the file, and
//! `id` says which particle a row is of.

use std::ops::Range;

use super::{
    Cell, Column, Data, Particles, Reader, Role,
    data::{Cell as TextCell, Line},
    number,
    rows::{self, Kind, Layout, Place, Store, Which},
};
use crate::input::report::Fault;
use planisphere_core::{drawing::Control, scene::Reals, text};

/// What each frame begins with.
const ITEM: &[u8] = b"ITEM: ";

/// Whether bytes begin as a dump does.
pub(super) fn is(beginning: &[u8]) -> bool {
    beginning.trim_ascii_start().starts_with(ITEM)
}

/// A reader.
pub(super) fn open(_: &Data) -> Result<Box<dyn Reader>, Fault> {
    Ok(Box::new(Dump))
}

#[derive(Debug)]
struct Dump;

impl Reader for Dump {
    fn frame(&self, data: &Data, at: usize) -> Result<Option<Range<usize>>, Fault> {
        let Some(start) = data.line_with_text(at).map(|line| line.start) else { return Ok(None) };
        let header = Header::read(data, start)?;
        let end = data.skip_lines(header.rows, header.count);
        let end = end.map_err(|found| header.cut_short(found))?;
        Ok(Some(start..end))
    }

    fn read(
        &self,
        data: &Data,
        frame: Range<usize>,
        control: &Control,
    ) -> Result<Particles, Fault> {
        let header = Header::read(data, frame.start)?;
        let columns = Columns::of(&header)?;
        let mut stores = columns.stores();
        let missing = |found| header.cut_short(found);
        let which = Which::First(header.count, &missing);
        let text = header.rows..frame.end;
        let parse = |line: Line<'_>, row: &mut rows::Row<'_, '_>| columns.layout.parse(line, row);
        rows::read(data, text, &which, &mut stores, control, parse)?;
        columns.finish(stores, &header)
    }
}

/// What stands before the rows of a frame.
struct Header<'a> {
    /// How many rows there are.
    count: usize,
    /// The line of that count.
    count_span: Range<usize>,
    /// The box.
    cell: Option<Cell>,
    /// The line that names the columns.
    names: Line<'a>,
    /// Where the rows begin.
    rows: usize,
}

impl<'a> Header<'a> {
    fn read(data: &'a Data, start: usize) -> Result<Self, Fault> {
        let (mut count, mut cell) = (None, None);
        let mut at = start;
        loop {
            let Some(line) = data.line(at) else { return Err(ends_early(data.len())) };
            let Some(item) = line.text.strip_prefix(ITEM) else {
                return Err(Fault::new(
                    "a line that begins with `ITEM:` is expected here",
                    line.span(),
                    "not an item",
                    "see whether ITEM: NUMBER OF ATOMS says how many rows there are",
                ));
            };
            at = line.next;
            if item.starts_with(b"ENTRIES") {
                return Err(Fault::new(
                    "this is a dump of local entries, such as bonds, and not of atoms",
                    line.span(),
                    "no atoms",
                    "write the atoms: `dump 1 all custom 100 run.dump id type x y z`",
                ));
            }
            if item.starts_with(b"ATOMS") {
                let missing = || {
                    Fault::new(
                        "ITEM: NUMBER OF ATOMS does not come before ITEM: ATOMS",
                        line.span(),
                        "of how many rows?",
                        "write the file again with LAMMPS, or add the two lines",
                    )
                };
                let (count, count_span) = count.ok_or_else(missing)?;
                return Ok(Self { count, count_span, cell, names: line, rows: at });
            }
            let value = |at: usize| data.line(at).ok_or_else(|| ends_early(data.len()));
            if item.starts_with(b"NUMBER OF ATOMS") {
                let line = value(at)?;
                count = Some((number_of_atoms(line)?, line.span()));
                at = line.next;
            } else if item.starts_with(b"BOX BOUNDS") {
                let lines = {
                    let first = value(at)?;
                    let second = value(first.next)?;
                    [first, second, value(second.next)?]
                };
                cell = Some(bounds(&item[b"BOX BOUNDS".len()..], lines)?);
                at = lines[2].next;
            } else {
                // Such as TIMESTEP, TIME and UNITS: one line each.
                while let Some(line) = data.line(at).filter(|line| !line.text.starts_with(ITEM)) {
                    at = line.next;
                }
            }
        }
    }

    fn cut_short(&self, found: usize) -> Fault {
        Fault::new(
            format!("{} atoms are announced, but {found} lines follow", self.count),
            self.count_span.clone(),
            "more than there are",
            "wait until the file is written, or write it again",
        )
    }
}

fn ends_early(length: usize) -> Fault {
    Fault::new(
        "the file ends before ITEM: ATOMS",
        length..length,
        "the end",
        "wait until the file is written, or write it again",
    )
}

fn number_of_atoms(line: Line<'_>) -> Result<usize, Fault> {
    let cell = line.text.trim_ascii();
    let count = number::integer(cell).and_then(|count| usize::try_from(count).ok());
    count.ok_or_else(|| number::not_an_integer("the number of atoms", cell, line.span()))
}

/// The box of three lines: its corner and its edges. The bounds of a tilted one are those of the
/// box around it ("Howto triclinic").
fn bounds(item: &[u8], lines: [Line<'_>; 3]) -> Result<Cell, Fault> {
    let named: Vec<&[u8]> = item.split(|byte| byte.is_ascii_whitespace()).collect();
    let tilted = named.contains(&&b"xy"[..]);
    if named.contains(&&b"abc"[..]) {
        return general(lines);
    }
    let mut numbers = [[0.0; 3]; 3];
    for (numbers, line) in numbers.iter_mut().zip(lines) {
        let count = if tilted { 3 } else { 2 };
        read_numbers(line, &mut numbers[..count])?;
    }
    let [[x_low, x_high, xy], [y_low, y_high, xz], [z_low, z_high, yz]] = numbers;
    let sums = [0.0, xy, xz, xy + xz];
    let least = sums.into_iter().fold(0.0, f64::min);
    let most = sums.into_iter().fold(0.0, f64::max);
    let origin = [x_low - least, y_low - yz.min(0.0), z_low];
    let [x_high, y_high] = [x_high - most, y_high - yz.max(0.0)];
    let edges = [
        [x_high - origin[0], 0.0, 0.0],
        [xy, y_high - origin[1], 0.0],
        [xz, yz, z_high - origin[2]],
    ];
    Ok(Cell { origin, edges })
}

/// A box whose edges point anywhere: each line is an edge and one number of the corner.
fn general(lines: [Line<'_>; 3]) -> Result<Cell, Fault> {
    let (mut origin, mut edges) = ([0.0; 3], [[0.0; 3]; 3]);
    for (axis, line) in lines.into_iter().enumerate() {
        let mut numbers = [0.0; 4];
        read_numbers(line, &mut numbers)?;
        (edges[axis], origin[axis]) = ([numbers[0], numbers[1], numbers[2]], numbers[3]);
    }
    Ok(Cell { origin, edges })
}

/// The numbers that a line begins with.
fn read_numbers(line: Line<'_>, numbers: &mut [f64]) -> Result<(), Fault> {
    let wanted = numbers.len();
    let mut cells = line.cells();
    for number in numbers {
        let Some(cell) = cells.next() else {
            return Err(Fault::new(
                format!("{wanted} numbers of the box are expected on this line"),
                line.span(),
                "too few",
                "write the file again",
            ));
        };
        let not = || number::not_a_number("a bound of the box", cell.text, cell.span());
        *number = number::real(cell.text).ok_or_else(not)?;
        if !number.is_finite() {
            return Err(number::not_finite("a bound of the box", cell.text, cell.span()));
        }
    }
    Ok(())
}

/// How the positions are written, and the names of their columns: what is best is first.
const FORMS: [([&str; 3], Form); 4] = [
    (["x", "y", "z"], Form::Plain),
    (["xu", "yu", "zu"], Form::Plain),
    (["xs", "ys", "zs"], Form::Scaled),
    (["xsu", "ysu", "zsu"], Form::Scaled),
];

/// What a position is.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Form {
    /// A place.
    Plain,
    /// A part of each edge of the box.
    Scaled,
}

/// The columns of a frame, and where each cell of a row goes.
struct Columns {
    form: Form,
    /// The names of the positions.
    centers_from: String,
    layout: Layout,
    /// Those beside the positions: names and kinds.
    others: Vec<(String, Kind)>,
}

impl Columns {
    fn of(header: &Header<'_>) -> Result<Self, Fault> {
        let names: Vec<TextCell<'_>> = header.names.cells().skip(2).collect();
        if names.is_empty() {
            return Err(Fault::new(
                "ITEM: ATOMS names no columns",
                header.names.span(),
                "no names",
                "write the file again with a newer LAMMPS, or add the names: ITEM: ATOMS id type \
                 xs ys zs",
            ));
        }
        let find = |name: &str| names.iter().position(|cell| cell.text == name.as_bytes());
        let found = FORMS.iter().find_map(|(names, form)| {
            let [x, y, z] = names.map(find);
            Some(([x?, y?, z?], *form, names.join(" ")))
        });
        let Some((axes, form, centers_from)) = found else {
            return Err(no_positions(header, &names));
        };
        if form == Form::Scaled && header.cell.is_none() {
            return Err(Fault::new(
                "the positions are scaled by the box, but there is no ITEM: BOX BOUNDS",
                names[axes[0]].span(),
                "scaled",
                "write the file again with the box, or dump x y z",
            ));
        }
        let (mut others, mut places) = (Vec::new(), Vec::new());
        for (at, cell) in names.iter().enumerate() {
            let name = cell.words();
            let axis = axes.iter().position(|axis| *axis == at);
            let (kind, column, component) = match axis {
                Some(axis) => (Kind::Finite, 0, axis),
                None => {
                    let kind = kind(&name);
                    others.push((name.clone(), kind));
                    (kind, others.len(), 0)
                }
            };
            places.push(Place { name: format!("`{name}`"), kind, column, component });
        }
        let layout = Layout { places, more: false };
        Ok(Self { form, centers_from, layout, others })
    }

    fn stores(&self) -> Vec<Store> {
        let others = self.others.iter().map(|(_, kind)| match kind {
            Kind::Integer => Store::integers(),
            Kind::Word => Store::words(),
            _ => Store::reals(1),
        });
        std::iter::once(Store::reals(3)).chain(others).collect()
    }

    fn finish(self, stores: Vec<Store>, header: &Header<'_>) -> Result<Particles, Fault> {
        let mut stores = stores.into_iter();
        let mut centers = stores.next().map_or(Vec::new(), Store::into_reals);
        if let (Form::Scaled, Some(cell)) = (self.form, &header.cell) {
            cell.unscale(&mut centers);
        }
        let centers_from = match self.form {
            Form::Plain => self.centers_from,
            Form::Scaled => self.centers_from + ", by the box",
        };
        let columns = self.others.into_iter().zip(stores);
        let columns = columns.map(|((name, _), store)| {
            let column = Column::named(name, store.into_values());
            // Charge, and the c_ and v_ of computes and variables, mean what their author says.
            match column.name.as_str() {
                "element" => column.with_role(Role::Element),
                _ => column,
            }
        });
        Ok(Particles {
            centers: Reals::F64(centers.into()),
            centers_from,
            columns: columns.collect(),
            cell: header.cell,
            notes: Vec::new(),
        })
    }
}

/// How a column other than a position is read; LAMMPS writes these as integers.
fn kind(name: &str) -> Kind {
    match name {
        "id" | "mol" | "proc" | "procp1" | "type" | "ix" | "iy" | "iz" => Kind::Integer,
        "element" | "typelabel" => Kind::Word,
        name if name.starts_with("i_") => Kind::Integer,
        _ => Kind::Real,
    }
}

fn no_positions(header: &Header<'_>, names: &[TextCell<'_>]) -> Fault {
    let shown: Vec<String> = names.iter().map(|cell| text::value(&cell.words())).collect();
    Fault::new(
        format!("no three columns are positions: {}", shown.join(" ")),
        header.names.span(),
        "no x y z, xu yu zu, xs ys zs or xsu ysu zsu",
        "add them to the dump command, such as `dump 1 all custom 100 run.dump id type x y z`",
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::particles::{
        Format, Values,
        file::tests::{centers, frame, opened},
    };

    const TILTED: &str = "ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n3\n\
        ITEM: BOX BOUNDS xy xz yz pp pp pp\n-1 12 2\n0 9.5 -1\n0 6 1.5\n\
        ITEM: ATOMS zs type id ys xs\n0.5 1 3 0.5 0.5\n0 1 1 0 0\n0.125 1 2 0.75 0.25\n";

    #[test]
    fn tilted_boxes_are_those_within_their_bounds() {
        let particles = frame(Format::Dump, TILTED, 0).unwrap();
        let wanted = [[5.5, 4.75, 3.0], [0.0; 3], [3.875, 6.1875, 0.75]];
        assert_eq!(centers(&particles), wanted);
        let Values::Integers(ids) = &particles.column("id").unwrap().values else { panic!() };
        assert_eq!(*ids, [3, 1, 2]);
        let cell = particles.cell.unwrap();
        assert_eq!(cell.edges, [[10.0, 0.0, 0.0], [2.0, 8.0, 0.0], [-1.0, 1.5, 6.0]]);
    }

    #[test]
    fn frames_are_found_by_their_counts() {
        let two = [TILTED, &TILTED.replacen("3\n", "2\n", 1).replace("0 1 1 0 0\n", "")].concat();
        let file = opened(Format::Dump, two.as_str()).unwrap();
        assert_eq!(file.frames(&Control::new()).unwrap(), 2);
        assert_eq!(frame(Format::Dump, two.as_str(), 1).unwrap().len(), 2);
        // Without the end of the last line, and cut within it.
        let open = two.trim_end();
        assert_eq!(frame(Format::Dump, open, 1).unwrap().len(), 2);
        let cut = &two[..two.len() - 20];
        let error = opened(Format::Dump, cut).unwrap().frames(&Control::new()).expect_err("cut");
        assert!(error.message().contains("the frame before it is whole"), "{error}");
        assert_eq!(error.line(), Some(16), "{error}");
        assert_eq!(frame(Format::Dump, cut, 0).unwrap().len(), 3);
    }

    #[test]
    fn what_is_wrong_is_pointed_at() {
        for (old, new, line, words) in [
            ("0.75 0.25", "0.75 x", 12, "`x` stands where `xs` is expected"),
            ("0.75 0.25", "0.75", 12, "has 4 cells, but 5 are needed"),
            ("0.75 0.25", "0.75 1 1", 12, "has 6 cells, but there are 5 columns"),
            ("0.75 0.25", "0.75 nan", 12, "not finite"),
            ("0.75 0.25", "0.75 1e999", 12, "beyond the range"),
            ("ATOMS zs", "ATOMS q", 9, "no three columns are positions"),
            ("ATOMS\n3", "ATOMS\n-3", 4, "the number of atoms"),
            ("-1 12 2", "-1 12", 6, "3 numbers of the box"),
        ] {
            let error = frame(Format::Dump, TILTED.replace(old, new), 0).expect_err(new);
            assert_eq!(error.line(), Some(line), "{error}");
            assert!(error.message().contains(words), "{error}");
        }
    }
}
