//! PDB files: structures of molecules, as rows of fixed columns.
//!
//! The format: wwPDB, "Protein Data Bank Contents Guide", version 3.3. Lengths are in angstroms.
//! The particles are the lines ATOM and HETATM; names of columns are those of the guide. Models are
//! frames, and so are structures that follow one another behind END. Serials and numbers of
//! residues that have outgrown their columns are words, in whichever notation a program chose.

use std::{
    ops::Range,
    sync::atomic::{AtomicBool, Ordering},
};

use super::{
    Cell, Data, Particles, Reader, Role, atoms,
    data::Line,
    elements::symbol,
    number,
    rows::{self, Row, Store, Which},
};
use crate::input::report::Fault;
use planisphere_core::{drawing::Control, scene::Reals};

/// Names of records, any of which may come first.
const RECORDS: &[&[u8; 6]] = &[
    b"HEADER", b"OBSLTE", b"TITLE ", b"SPLIT ", b"CAVEAT", b"COMPND", b"SOURCE", b"KEYWDS",
    b"EXPDTA", b"NUMMDL", b"MDLTYP", b"AUTHOR", b"REVDAT", b"SPRSDE", b"JRNL  ", b"REMARK",
    b"DBREF ", b"DBREF1", b"DBREF2", b"SEQADV", b"SEQRES", b"MODRES", b"HET   ", b"HETNAM",
    b"HETSYN", b"FORMUL", b"HELIX ", b"SHEET ", b"SSBOND", b"LINK  ", b"CISPEP", b"SITE  ",
    b"CRYST1", b"ORIGX1", b"SCALE1", b"MTRIX1", b"MODEL ", b"USER  ", b"TER   ", b"END   ",
    b"ANISOU", b"ORIGX2", b"ORIGX3", b"SCALE2", b"SCALE3",
];

/// Whether bytes begin as a PDB file does: with its records, and not with a title that looks like
/// one before the number of atoms of another format.
pub(super) fn is(beginning: &[u8]) -> bool {
    let mut at = 0;
    let mut lines = std::iter::from_fn(|| {
        let line = Line::at(beginning, at)?;
        at = line.next;
        Some(line)
    });
    let mut is_record = |line: Line<'_>| {
        if is_atom(line) {
            return AXES.iter().all(|(columns, _)| atoms::short(field(line, columns)).is_some());
        }
        let mut name = [b' '; 6];
        let length = line.text.len().min(6);
        name[..length].copy_from_slice(&line.text[..length]);
        name.make_ascii_uppercase();
        // MODEL and its like may be followed by a number without a blank.
        RECORDS.contains(&&name)
    };
    let mut filled = lines.by_ref().filter(|line| !line.is_blank());
    let Some(first) = filled.next() else { return false };
    is_record(first) && filled.next().is_none_or(&mut is_record)
}

/// A reader.
pub(super) fn open(data: &Data) -> Result<Box<dyn Reader>, Fault> {
    let cell = cell_of(data, 0)?;
    Ok(Box::new(Pdb { cell }))
}

#[derive(Debug)]
struct Pdb {
    /// The box of the first frame, which those after it share unless they have their own.
    cell: Option<Cell>,
}

impl Reader for Pdb {
    fn frame(&self, data: &Data, at: usize) -> Result<Option<Range<usize>>, Fault> {
        let Some(first) = rows::find(data, at..data.len(), is_atom) else {
            if at > 0 {
                return Ok(None);
            }
            return Err(Fault::whole(
                "no line is ATOM or HETATM: there is no particle",
                "name a PDB file that has atoms",
            ));
        };
        let is_end = |line: Line<'_>| ends(line) || begins_model(line);
        if let Some(end) = rows::find(data, first..data.len(), is_end) {
            let line = data.line(end).filter(|line| ends(*line));
            return Ok(Some(at..line.map_or(end, |line| line.next)));
        }
        if let Some(model) = rows::find(data, at..first, begins_model)
            && let Some(line) = data.line(model)
        {
            return Err(Fault::new(
                "the file ends within this model: no ENDMDL follows",
                line.span(),
                "not ended",
                "wait until the file is written, or write it again",
            ));
        }
        let text = data.as_slice();
        let last = memchr::memrchr(b'\n', text).map_or(0, |at| at + 1);
        if let Some(line) = data.line(last).filter(|line| is_atom(*line))
            && line.text.len() < AXES[2].0.start + 1
        {
            return Err(too_short(line));
        }
        Ok(Some(at..data.len()))
    }

    fn read(
        &self,
        data: &Data,
        frame: Range<usize>,
        control: &Control,
    ) -> Result<Particles, Fault> {
        let mut plan = Plan { serials: true, numbers: true, blank: [true; 4] };
        loop {
            let misfit = Misfit::default();
            let mut stores = plan.stores();
            let which = Which::Those(&is_atom);
            let parse = |line: Line<'_>, row: &mut Row<'_, '_>| plan.parse(line, row, &misfit);
            let read = rows::read(data, frame.clone(), &which, &mut stores, control, parse);
            if misfit.apply(&mut plan) {
                continue;
            }
            read?;
            let cell = cell_of(data, frame.start)?.or(self.cell);
            return Ok(finish(stores, cell));
        }
    }
}

/// Whether a line is a particle.
#[inline]
fn is_atom(line: Line<'_>) -> bool {
    const NAMES: [u32; 2] = [u32::from_ne_bytes(*b"atom"), u32::from_ne_bytes(*b"heta")];
    match *line.text {
        // The bit that upper case lacks.
        [a, b, c, d, ..] => NAMES.contains(&(u32::from_ne_bytes([a, b, c, d]) | 0x2020_2020)),
        _ => false,
    }
}

/// Whether a line ends a frame.
fn ends(line: Line<'_>) -> bool {
    let is_near = matches!(line.text.first(), Some(b'E' | b'e'));
    is_near && {
        let word = line.text.trim_ascii_end();
        let word = &word[..super::data::word(word)];
        word.eq_ignore_ascii_case(b"END") || word.eq_ignore_ascii_case(b"ENDMDL")
    }
}

/// Whether a line begins a model.
fn begins_model(line: Line<'_>) -> bool {
    matches!(line.text, [b'M' | b'm', _, _, _, _, b' ' | b'\t', ..] | [b'M' | b'm', _, _, _, _])
        && line.text[..5].eq_ignore_ascii_case(b"MODEL")
}

/// Where the columns of a row go.
const CENTERS: usize = 0;
const RECORD: usize = 1;
const SERIAL: usize = 2;
const NAME: usize = 3;
const ALTERNATE: usize = 4;
const RESIDUE: usize = 5;
const CHAIN: usize = 6;
const NUMBER: usize = 7;
const INSERTION: usize = 8;
const OCCUPANCY: usize = 9;
const FACTOR: usize = 10;
const SEGMENT: usize = 11;
const ELEMENT: usize = 12;
const CHARGE: usize = 13;

/// Their names; the positions have none.
const NAMES: [(&str, Role); 13] = [
    ("record", Role::Other),
    ("serial", Role::Id),
    ("name", Role::Other),
    ("altLoc", Role::Other),
    ("resName", Role::Other),
    ("chainID", Role::Other),
    ("resSeq", Role::Other),
    ("iCode", Role::Other),
    ("occupancy", Role::Other),
    ("tempFactor", Role::Other),
    ("segID", Role::Other),
    ("element", Role::Element),
    ("charge", Role::Other),
];

/// The columns of the positions, counted from 0, and what they are.
const AXES: [(Range<usize>, &str); 3] = [(30..38, "`x`"), (38..46, "`y`"), (46..54, "`z`")];

/// Columns that are blank in most files.
const MOSTLY_BLANK: [usize; 4] = [ALTERNATE, INSERTION, SEGMENT, CHARGE];

/// What the columns of a frame are, as far as is known: nothing is believed that a row does not
/// show to be otherwise.
#[derive(Clone, Copy, PartialEq, Eq)]
struct Plan {
    /// Whether serials are integers.
    serials: bool,
    /// Whether numbers of residues are integers.
    numbers: bool,
    /// Whether those of [`MOSTLY_BLANK`] are.
    blank: [bool; 4],
}

/// Where a row does not fit a plan.
#[derive(Default)]
struct Misfit {
    serials: AtomicBool,
    numbers: AtomicBool,
    filled: [AtomicBool; 4],
}

impl Misfit {
    /// Makes a plan that fits; false where it did fit.
    fn apply(&self, plan: &mut Plan) -> bool {
        let before = *plan;
        plan.serials &= !self.serials.load(Ordering::Relaxed);
        plan.numbers &= !self.numbers.load(Ordering::Relaxed);
        for (blank, filled) in plan.blank.iter_mut().zip(&self.filled) {
            *blank &= !filled.load(Ordering::Relaxed);
        }
        before != *plan
    }

    #[cold]
    fn found(column: &AtomicBool) -> Fault {
        column.store(true, Ordering::Relaxed);
        Fault::whole("a column is none of its plan", "")
    }
}

impl Plan {
    fn stores(self) -> Vec<Store> {
        let mut stores = vec![Store::reals(3)];
        for column in RECORD..=CHARGE {
            stores.push(match column {
                SERIAL if self.serials => Store::integers(),
                NUMBER if self.numbers => Store::integers(),
                OCCUPANCY | FACTOR => Store::reals(1),
                _ => Store::words(),
            });
        }
        stores
    }

    /// Reads a row.
    #[inline]
    fn parse(self, line: Line<'_>, row: &mut Row<'_, '_>, misfit: &Misfit) -> Result<(), Fault> {
        let text = line.text;
        for (axis, (columns, name)) in AXES.iter().enumerate() {
            if let Some(value) = text.get(columns.clone()).and_then(atoms::eight) {
                row.set_real(CENTERS, axis, value);
                continue;
            }
            let cell = field(line, columns);
            let value = atoms::short(cell).ok_or_else(|| misplaced(line, columns, name))?;
            if !value.is_finite() {
                return Err(number::not_finite(name, cell, span(line, columns)));
            }
            row.set_real(CENTERS, axis, value);
        }
        // The end of the file, in the middle of a number.
        if text.len() < 54 && line.next == line.span().end {
            return Err(Fault::new(
                "the file ends within the positions of an atom",
                line.span(),
                "cut short",
                "wait until the file is written, or write it again",
            ));
        }
        if memchr::memchr(b'\t', &text[..text.len().min(54)]).is_some() {
            return Err(has_tab(line));
        }
        if text.get(29).is_some_and(|before| *before != b' ') {
            return Err(misplaced(line, &(29..38), AXES[0].1));
        }
        let is_other = matches!(text.first(), Some(b'H' | b'h'));
        row.set_word(RECORD, if is_other { b"HETATM" } else { b"ATOM" });
        let serial = serial(text);
        match atoms::digits(serial) {
            _ if !self.serials => row.set_word(SERIAL, serial),
            Some(value) => row.set_integer(SERIAL, 0, value),
            None => return Err(Misfit::found(&misfit.serials)),
        }
        let (residue_number, insertion) = residue_number(line);
        match atoms::digits(residue_number) {
            _ if !self.numbers => row.set_word(NUMBER, residue_number),
            Some(value) => row.set_integer(NUMBER, 0, value),
            None => return Err(Misfit::found(&misfit.numbers)),
        }
        let (name, residue) = (field(line, &(12..16)), field(line, &(17..21)));
        row.set_word(NAME, name);
        row.set_word(RESIDUE, residue);
        row.set_word(CHAIN, field(line, &(21..22)));
        row.set_real(OCCUPANCY, 0, or_blank(line, 54..60, "`occupancy`")?);
        row.set_real(FACTOR, 0, or_blank(line, 60..66, "`tempFactor`")?);
        let [alternate, segment, charge] = [16..17, 72..76, 78..80].map(|of| field(line, &of));
        for (number, cell) in [alternate, insertion, segment, charge].into_iter().enumerate() {
            match (cell.is_empty(), self.blank[number]) {
                (true, true) => {}
                (false, true) => return Err(Misfit::found(&misfit.filled[number])),
                (_, false) => row.set_word(MOSTLY_BLANK[number], cell),
            }
        }
        match symbol(field(line, &(76..78))) {
            Some(symbol) if !atoms::is_mistaken(symbol, name, residue) => {
                row.set_word(ELEMENT, symbol.as_bytes());
            }
            _ => {
                let columns = text.get(12..16.min(text.len())).unwrap_or(b"");
                let found = atoms::element_of_columns(columns, residue);
                atoms::set_found(row, ELEMENT, found);
            }
        }
        Ok(())
    }
}

/// The bytes of some columns, without the blanks around them; fewer of a short line.
#[inline]
fn field<'a>(line: Line<'a>, columns: &Range<usize>) -> &'a [u8] {
    atoms::field(line.text, columns.clone())
}

/// The place of some columns in the input.
fn span(line: Line<'_>, columns: &Range<usize>) -> Range<usize> {
    let end = line.span().end;
    (line.start + columns.start).min(end)..(line.start + columns.end).min(end)
}

/// The serial, which may take the columns beside its own.
#[inline]
fn serial(text: &[u8]) -> &[u8] {
    let is_digit = |at: usize| text.get(at).is_some_and(u8::is_ascii_digit);
    let start = if is_digit(5) && is_digit(6) { 5 } else { 6 };
    let end = if is_digit(10) && is_digit(11) { 12 } else { 11 };
    text.get(start..end.min(text.len())).unwrap_or(b"").trim_ascii()
}

/// The number of the residue, and its insertion code. A number of more than four digits runs into
/// the columns behind it, which are blank otherwise.
#[inline]
fn residue_number(line: Line<'_>) -> (&[u8], &[u8]) {
    let text = line.text;
    let own = text.get(22..26).unwrap_or(b"");
    if text.get(26).is_some_and(u8::is_ascii_digit) && own.iter().all(u8::is_ascii_digit) {
        let rest = text.get(22..29.min(text.len())).unwrap_or(b"");
        let length = rest.iter().take_while(|byte| byte.is_ascii_digit()).count();
        return (&rest[..length], b"");
    }
    (field(line, &(22..26)), field(line, &(26..27)))
}

/// A number that may be blank, or overflown; neither is a number then.
#[inline]
fn or_blank(line: Line<'_>, columns: Range<usize>, name: &str) -> Result<f64, Fault> {
    if let Some(value) = line.text.get(columns.clone()).and_then(atoms::six) {
        return Ok(value);
    }
    let cell = field(line, &columns);
    if cell.iter().all(|byte| *byte == b'*') {
        return Ok(f64::NAN);
    }
    atoms::short(cell).ok_or_else(|| number::not_a_number(name, cell, span(line, &columns)))
}

fn too_short(line: Line<'_>) -> Fault {
    let end = line.span().end;
    Fault::new(
        format!(
            "the line has {} columns, but the positions are in columns 31 to 54",
            line.text.len()
        ),
        end..end,
        "cut short",
        "wait until the file is written, or write it again",
    )
}

fn has_tab(line: Line<'_>) -> Fault {
    let at = memchr::memchr(b'\t', line.text).unwrap_or(0);
    Fault::new(
        "a tab stands in the line, whose columns are fixed",
        line.start + at..line.start + at + 1,
        "a tab",
        "write blanks in its place, so that the positions are in columns 31 to 54",
    )
}

/// That there is no number where a position is expected.
fn misplaced(line: Line<'_>, columns: &Range<usize>, name: &str) -> Fault {
    let cell = field(line, columns);
    if line.text.contains(&b'\t') {
        return has_tab(line);
    }
    if cell.is_empty() && line.text.len() <= columns.end {
        return too_short(line);
    }
    let fault = number::not_a_number(name, cell, span(line, columns));
    let [first, last] = [columns.start + 1, columns.end];
    let numbers = line.cells().skip(1).filter(|cell| {
        cell.text.contains(&b'.') && number::real(cell.text).is_some_and(f64::is_finite)
    });
    match numbers.count() {
        0..3 => fault.but(&format!(" in columns {first} to {last}")),
        _ => fault.but(&format!(
            " in columns {first} to {last}; it looks as if blanks part the cells of this file, as \
             in PQR files"
        )),
    }
}

/// The box that stands before the atoms of the frame that begins at a place.
fn cell_of(data: &Data, mut at: usize) -> Result<Option<Cell>, Fault> {
    while let Some(line) = data.line(at).filter(|line| !is_atom(*line)) {
        at = line.next;
        let name = line.text.get(..6).unwrap_or(b"");
        if name.eq_ignore_ascii_case(b"CRYST1") {
            return cell(line);
        }
    }
    Ok(None)
}

/// The box of CRYST1. That of a molecule in no crystal is none.
fn cell(line: Line<'_>) -> Result<Option<Cell>, Fault> {
    const COLUMNS: [Range<usize>; 6] = [6..15, 15..24, 24..33, 33..40, 40..47, 47..54];
    let mut numbers = [0.0; 6];
    for (number, columns) in numbers.iter_mut().zip(&COLUMNS) {
        let cell = field(line, columns);
        let not = || number::not_a_number("a number of the box", cell, span(line, columns));
        *number = atoms::short(cell).ok_or_else(not)?;
    }
    let [a, b, c, angles @ ..] = numbers;
    if [a, b, c].contains(&0.0) || numbers == [1.0, 1.0, 1.0, 90.0, 90.0, 90.0] {
        return Ok(None);
    }
    let none = || {
        Fault::new(
            "there is no box of these lengths and angles",
            span(line, &(6..54)),
            "no box",
            "correct CRYST1, or leave it out",
        )
    };
    let edges = atoms::edges([a, b, c], angles).ok_or_else(none)?;
    Ok(Some(Cell { origin: [0.0; 3], edges }))
}

/// The particles of the columns.
fn finish(mut stores: Vec<Store>, cell: Option<Cell>) -> Particles {
    let sites = atoms::Sites {
        residue: &[CHAIN, NUMBER, INSERTION],
        residue_name: Some(RESIDUE),
        name: NAME,
        alternate: ALTERNATE,
        occupancy: Some(OCCUPANCY),
    };
    let left_out = atoms::without_alternates(&mut stores, &sites);
    let mut notes: Vec<String> = atoms::note_of_alternates(left_out).into_iter().collect();
    let mut stores = stores.into_iter();
    let centers = stores.next().map_or(Vec::new(), Store::into_reals);
    let mut columns = Vec::with_capacity(NAMES.len());
    for ((name, role), store) in NAMES.into_iter().zip(stores) {
        let store = match store {
            Store::Words(codes, lexicon) if role == Role::Element => {
                let words = super::Words { codes, words: lexicon.into_words() };
                let (words, counts) = atoms::settle(words);
                notes.extend(atoms::note_of_elements(counts, words.codes.len()));
                columns
                    .push(super::Column::named(name, super::Values::Words(words)).with_role(role));
                continue;
            }
            store => store,
        };
        columns.extend(atoms::column(name, role, store));
    }
    Particles {
        centers: Reals::F64(centers.into()),
        centers_from: "x y z".into(),
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
        file::tests::{centers, frame, opened, words, x},
    };

    const SERIALS: &str = "\
ATOM  99999  C   ALA A   1       1.000   2.000   3.000  1.00  0.00           C
ATOM  A0000  N   ALA A   1    -100.123-200.456-300.789  1.00  0.00           N
ATOM  186a0  O   ALA AA000       4.000   5.000   6.000  1.00  0.00           O
HETATM*****  S   ALA A   1       7.000   8.000   9.000  1.00  0.00           S
END
";

    const ALTERNATES: &str = "\
CRYST1   10.000   20.000   30.000  90.00  90.00  90.00 P 1           1
ATOM      1  N   SER A   5       1.000   0.000   0.000  1.00  5.00           N
ATOM      2  CA ASER A   5       2.000   0.000   0.000  0.40  5.00           C
ANISOU    2  CA ASER A   5     1000   1000   1000      0      0      0       C
ATOM      3  CA BSER A   5       3.000   0.000   0.000  0.60  5.00           C
ATOM      4  CB ASER A   5       4.000   0.000   0.000  0.50  5.00           C
ATOM      5  CB BSER A   5       5.000   0.000   0.000  0.50  5.00           C
ATOM      6  CA ASER A   5A      6.000   0.000   0.000  0.10  5.00           C
ATOM      7  CA ASER B   5       7.000   0.000   0.000  0.10  5.00           C
TER       8      SER B   5
ATOM      9  CA ALEU C   7       8.000   0.000   0.000  0.30  5.00           C
ATOM     10  CG ALEU C   7       9.000   0.000   0.000  0.30  5.00           C
ATOM     11  CA BALA C   7      10.000   0.000   0.000  0.70  5.00           C
ATOM     12  CB BALA C   7      11.000   0.000   0.000  0.70  5.00           C
END
";

    #[test]
    fn serials_in_any_notation_and_numbers_that_touch() {
        for text in [SERIALS.to_owned(), SERIALS.replace('\n', "\r\n"), SERIALS.to_lowercase()] {
            let particles = frame(Format::Pdb, text.as_str(), 0).unwrap();
            let wanted =
                [[1.0, 2.0, 3.0], [-100.123, -200.456, -300.789], [4.0, 5.0, 6.0], [7.0, 8.0, 9.0]];
            assert_eq!(centers(&particles), wanted);
            assert_eq!(words(&particles, "element"), ["C", "N", "O", "S"]);
            assert_eq!(particles.notes, [""; 0]);
            assert_eq!(words(&particles, "record"), ["ATOM", "ATOM", "ATOM", "HETATM"]);
        }
        let particles = frame(Format::Pdb, SERIALS, 0).unwrap();
        assert_eq!(words(&particles, "serial"), ["99999", "A0000", "186a0", "*****"]);
        assert_eq!(words(&particles, "resSeq"), ["1", "1", "A000", "1"]);
        for blank in ["altLoc", "iCode", "segID", "charge"] {
            assert!(particles.column(blank).is_none(), "{blank}");
        }
    }

    #[test]
    fn columns_are_read_where_they_are() {
        let text = "\
ATOM  100000 CA  GLY A1234A      1.000   2.000   3.000                  SEG1 C1-
HETATM999999 O   TIP3W99999      1.000   2.000  33.000******  1.50
ATOM 1000000 O   TIP3W100000     1.000   2.000   4\n";
        let particles = frame(Format::Pdb, text, 0).unwrap();
        assert_eq!(words(&particles, "serial"), ["100000", "999999", "1000000"]);
        assert_eq!(words(&particles, "resName"), ["GLY", "TIP3", "TIP3"]);
        assert_eq!(words(&particles, "resSeq"), ["1234", "99999", "100000"]);
        assert_eq!(words(&particles, "iCode"), ["A", "", ""]);
        assert_eq!(words(&particles, "segID"), ["SEG1", "", ""]);
        assert_eq!(words(&particles, "charge"), ["1-", "", ""]);
        assert_eq!(words(&particles, "tempFactor"), ["NaN", "1.5", "NaN"]);
        assert!(particles.column("occupancy").is_none(), "blank or overflown in all rows");
        assert_eq!(centers(&particles)[2], [1.0, 2.0, 4.0]);
        assert_eq!(particles.notes, ["elements were derived from the names of 2 of 3 atoms"]);
    }

    #[test]
    fn the_alternate_of_highest_occupancy_stays() {
        let particles = frame(Format::Pdb, ALTERNATES, 0).unwrap();
        assert_eq!(x(&particles), [1.0, 3.0, 4.0, 6.0, 7.0, 10.0, 11.0]);
        assert_eq!(words(&particles, "serial"), ["1", "3", "4", "6", "7", "11", "12"]);
        let notes =
            ["4 alternate positions were left out: the ones of highest occupancy are drawn"];
        assert_eq!(particles.notes, notes);
        let cell = particles.cell.unwrap();
        assert_eq!(cell.edges, [[10.0, 0.0, 0.0], [0.0, 20.0, 0.0], [0.0, 0.0, 30.0]]);
        // Numbers of residues that begin again are no alternates, and neither are blank ones.
        let row = |alternate: &str| {
            format!("HETATM    1  O  {alternate}HOH W   1       1.000   0.000   0.000  0.50\n")
        };
        for (alternates, count) in [("AB AB", 3), ("  ", 2), ("AA", 2), (" B", 1), ("BA", 1)] {
            let other = row(" ").replace("W   1", "W   2");
            let text: String = match alternates.split_once("AB ") {
                Some(_) => [row("A"), row("B"), other, row("A"), row("B")].concat(),
                None => alternates.chars().map(|c| row(&c.to_string())).collect(),
            };
            let particles = frame(Format::Pdb, text.as_str(), 0).unwrap();
            assert_eq!(particles.len(), count, "{alternates:?}");
        }
    }

    #[test]
    fn elements_come_from_their_columns_or_names() {
        let text = "\
ATOM      1  CA  ALA A   1       1.000   0.000   0.000  1.00  0.00           C
ATOM      2 CA   ALA A   1       1.000   0.000   0.000  1.00  0.00          CA
HETATM    3 CA    CA A   2       1.000   0.000   0.000  1.00  0.00
HETATM    4 CA    CA A   2       1.000   0.000   0.000  1.00  0.00          CA
ATOM      5 HG   SER A   3       1.000   0.000   0.000  1.00  0.00
HETATM    6 HG    HG A   4       1.000   0.000   0.000  1.00  0.00      1ABC
ATOM      7 1HB  ALA A   1       1.000   0.000   0.000
HETATM    8  X1  LIG A   1       1.000   0.000   0.000  1.00  0.00          ZN
HETATM    9  X1  LIG A   1       1.000   0.000   0.000  1.00  0.00           X
";
        let particles = frame(Format::Pdb, text, 0).unwrap();
        let wanted = ["C", "C", "Ca", "Ca", "H", "Hg", "H", "Zn", ""];
        assert_eq!(words(&particles, "element"), wanted);
        let notes = [
            "elements were derived from the names of 5 of 9 atoms",
            "1 of 9 atoms have no element that is known",
        ];
        assert_eq!(particles.notes, notes);
        assert_eq!(particles.role(Role::Element).map(|column| &*column.name), Some("element"));
    }

    #[test]
    fn models_and_structures_are_frames() {
        let atom = |x: usize| format!("ATOM      1  C   ALA A   1    {x:8}   2.000   3.000\n");
        let box_of = |a: u32| format!("CRYST1{a:9}   20.000   30.000  90.00  90.00  90.00\n");
        let models = [
            &box_of(10),
            "MODEL        1\n",
            &atom(1),
            "TER\nENDMDL\nMODEL        2\n",
            &atom(2),
            &atom(3),
            "ENDMDL\nCONECT    1    2\nEND\n",
        ];
        let models = models.concat();
        let after_end =
            [&atom(1), "END\nREMARK\n", &box_of(40), &atom(2), &atom(3), "END"].concat();
        for (text, second_box) in [
            (models.clone(), Some(10.0)),
            (models.replace("ENDMDL\nMODEL", "MODEL"), Some(10.0)),
            (models.to_lowercase(), Some(10.0)),
            (after_end, Some(40.0)),
        ] {
            let file = opened(Format::Pdb, text.as_str()).unwrap();
            assert_eq!(file.frames(&Control::new()).unwrap(), 2, "{text}");
            assert_eq!(x(&file.read(0, &Control::new()).unwrap()), [1.0]);
            let second = file.read(1, &Control::new()).unwrap();
            assert_eq!(x(&second), [2.0, 3.0]);
            assert_eq!(second.cell.map(|cell| cell.edges[0][0]), second_box);
        }
        let cut = models.split("CONECT").next().unwrap().trim_end().strip_suffix("ENDMDL").unwrap();
        let error = opened(Format::Pdb, cut).unwrap().frames(&Control::new()).expect_err("cut");
        assert!(error.message().contains("the frame before it is whole"), "{error}");
        assert_eq!(error.line(), Some(6), "{error}");
        assert_eq!(
            opened(Format::Pdb, atom(1).trim()).unwrap().read(0, &Control::new()).unwrap().len(),
            1
        );
    }

    #[test]
    fn what_is_wrong_is_pointed_at() {
        for (old, new, line, words) in [
            ("4.000   5.000", "4.000   x.000", 3, "`x.000` stands where `y` is expected"),
            ("4.000   5.000", "4.000        ", 3, "`` stands where `y` is expected"),
            ("4.000   5.000", "4.000   5 000", 3, "in columns 39 to 46"),
            ("4.000   5.000", "4.000     nan", 3, "not finite"),
            ("4.000   5.000", "4.000  -1e999", 3, "beyond the range"),
            ("A   1       1.000", "A\t1       1.000", 1, "a tab"),
            ("O   ALA AA000 ", "O   ALA A A000 1.0 ", 3, "blanks part the cells"),
            ("1    -100.123", "1   -1100.123", 2, "`-1100.123` stands where `x` is"),
            ("9.000  1.00  0.00", "9.000  1.00  0.0x", 4, "`tempFactor`"),
            ("   9.000  1.00  0.00           S\nEND\n", "", 4, "the line has 46 columns"),
        ] {
            let text = SERIALS.replacen(old, new, 1);
            let error = frame(Format::Pdb, text.as_str(), 0).expect_err(new);
            assert_eq!(error.line(), Some(line), "{error}");
            assert!(error.message().contains(words), "{error}");
        }
        let error = frame(Format::Pdb, "REMARK\nEND\n", 0).expect_err("none");
        assert!(error.message().contains("no particle"), "{error}");
        let wrong = ALTERNATES.replacen("90.00", "x0.00", 1);
        assert_eq!(opened(Format::Pdb, wrong.as_str()).expect_err("box").line(), Some(1));
        let wrong = ALTERNATES.replacen("90.00  90.00", "10.00 120.00", 1);
        assert!(opened(Format::Pdb, wrong.as_str()).is_err());
    }

    #[test]
    fn boxes_of_no_crystal_are_none() {
        for no_box in [
            "    1.000    1.000    1.000  90.00  90.00  90.00",
            "    0.000    0.000    0.000  90.00  90.00  90.00",
        ] {
            let old = "   10.000   20.000   30.000  90.00  90.00  90.00";
            let text = ALTERNATES.replacen(old, no_box, 1);
            assert_eq!(frame(Format::Pdb, text.as_str(), 0).unwrap().cell, None);
        }
    }

    #[test]
    fn files_are_known_by_their_records() {
        for text in [SERIALS, ALTERNATES, "HEADER    X", "\nREMARK\nTITLE     X\n", "MODEL 1\n"] {
            assert!(is(text.as_bytes()), "{text}");
        }
        for text in [
            "",
            "3\nATOM\nC 0 0 0\n",
            "TITLE     of GROMACS\n    3\n",
            "ITEM: TIMESTEP\n",
            "atom,x,y,z\n1,2,3,4\n",
            "atom x y z\n1 2 3 4\n",
            "MODEL,x\n",
            "data_1abc\n",
            "ply\nformat ascii 1.0\n",
            "REMARK of LAMMPS\n\n 5 atoms\n",
            "\u{1}\0\0\0CORD",
        ] {
            assert!(!is(text.as_bytes()), "{text}");
        }
    }
}
