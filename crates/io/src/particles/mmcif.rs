//! mmCIF files: structures of molecules, as tables of words.
//!
//! The format: wwPDB, "PDBx/mmCIF Dictionary", category `atom_site`; the syntax is that of CIF.
//! Lengths are in angstroms. The rows of `_atom_site` are the particles, whichever columns they
//! have; `pdbx_PDB_model_num` parts frames. Rows that are a line each, as nearly all are, are read
//! in parallel; others word by word.

use std::{
    ops::Range,
    sync::atomic::{AtomicBool, Ordering},
};

use super::{
    Cell, Column, Data, Particles, Reader, Role, Values, atoms,
    cif::{self, Kind as Word, Token, Tokens},
    data::{Line, blanks, is_blank},
    elements::symbol,
    number,
    rows::{self, Row, Store, Which},
};
use crate::input::report::Fault;
use planisphere_core::{drawing::Control, scene::Reals, text};

/// Whether bytes begin as a CIF file does: with `data_`, and then a name, `loop_` or the like.
pub(super) fn is(beginning: &[u8]) -> bool {
    let mut tokens = Tokens { whole: beginning, at: 0 };
    let mut next = || tokens.next().ok().flatten().map(|token| token.kind);
    next() == Some(Word::Data)
        && matches!(next(), None | Some(Word::Data | Word::Loop | Word::Name | Word::Reserved))
}

/// A reader.
pub(super) fn open(data: &Data) -> Result<Box<dyn Reader>, Fault> {
    Ok(Box::new(Scan::of(data)?.finish(data)?))
}

/// Columns that are read; the dictionary has a tenth of them.
const MOST_COLUMNS: usize = 1000;

/// The atoms of a file.
#[derive(Debug)]
struct MmCif {
    /// The names of the columns, in their order, without that of the category.
    names: Vec<String>,
    /// Where the rows are.
    rows: Range<usize>,
    /// The values of the only row, where they stand beside their names: places, and whether they
    /// are in quotes.
    single: Option<Vec<(Range<usize>, bool)>>,
    /// Whether a row may be more or less than a line.
    is_free: AtomicBool,
    /// The box.
    cell: Option<Cell>,
    /// What was left out of the file.
    notes: Vec<String>,
}

/// What is found in a file before its rows are read.
#[derive(Default)]
struct Scan {
    found: Option<Found>,
    /// Names and values of a row that is in no loop.
    single: Vec<(String, Range<usize>, bool)>,
    /// Whether the block that is looked at is the one of the atoms, or may be.
    is_own: bool,
    /// The lengths and angles of the box.
    cell: [Option<f64>; 6],
    /// A name of fractional coordinates.
    fractional: Option<Range<usize>>,
    /// Blocks beside the own that have atoms.
    others: usize,
}

struct Found {
    names: Vec<String>,
    rows: Range<usize>,
    is_free: bool,
}

/// The name of a column of atoms; none of other categories.
fn column_name(name: &[u8]) -> Option<&[u8]> {
    const CATEGORY: &[u8] = b"_atom_site";
    let own = name.get(..CATEGORY.len())?;
    match &name[CATEGORY.len()..] {
        // In the CIF of small molecules a name has no dot.
        [b'.' | b'_', rest @ ..] if own.eq_ignore_ascii_case(CATEGORY) => Some(rest),
        _ => None,
    }
}

const CELL: [&[u8]; 6] = [
    b"_cell.length_a",
    b"_cell.length_b",
    b"_cell.length_c",
    b"_cell.angle_alpha",
    b"_cell.angle_beta",
    b"_cell.angle_gamma",
];

impl Scan {
    fn of(data: &Data) -> Result<Self, Fault> {
        let mut scan = Self { is_own: true, ..Self::default() };
        let mut tokens = Tokens { whole: data.as_slice(), at: 0 };
        let mut has_atoms = false;
        while let Some(token) = tokens.next()? {
            match token.kind {
                Word::Data => {
                    scan.is_own = scan.found.is_none() && scan.single.is_empty();
                    if scan.is_own {
                        scan.cell = [None; 6];
                    }
                    has_atoms = false;
                }
                Word::Loop => {
                    let is_atoms = scan.table(data, &mut tokens)?;
                    scan.others += usize::from(is_atoms && !scan.is_own && !has_atoms);
                    has_atoms |= is_atoms;
                }
                Word::Name => {
                    let mut after = tokens.clone();
                    if let Some(value) = after.next()?.filter(Token::is_value) {
                        tokens = after;
                        scan.item(token, value);
                    }
                }
                Word::Reserved | Word::Plain | Word::Quoted => {}
            }
        }
        Ok(scan)
    }

    /// Looks at a name and its value.
    fn item(&mut self, name: Token<'_>, value: Token<'_>) {
        if !self.is_own {
            return;
        }
        if let Some(column) = column_name(name.text) {
            let start = value.start + usize::from(value.kind == Word::Quoted);
            let place = start..start + value.text.len();
            let column = String::from_utf8_lossy(column).into_owned();
            self.single.push((column, place, value.kind == Word::Quoted));
        }
        for (number, own) in self.cell.iter_mut().zip(CELL) {
            // In the CIF of small molecules a name has no dot.
            let is = name.text.len() == own.len()
                && name
                    .text
                    .iter()
                    .zip(own)
                    .all(|(a, b)| a.eq_ignore_ascii_case(b) || (*a == b'_' && *b == b'.'));
            if is {
                *number = real(value.text);
            }
        }
    }

    /// Looks at what follows `loop_`; says whether it is a table of atoms.
    fn table(&mut self, data: &Data, tokens: &mut Tokens<'_>) -> Result<bool, Fault> {
        let mut names = Vec::new();
        let (mut has_atoms, mut fractional) = (false, None);
        let first = loop {
            let before = tokens.at;
            let Some(token) = tokens.next()? else { break None };
            if token.kind != Word::Name {
                tokens.at = before;
                break token.is_value().then_some(token);
            }
            let column = column_name(token.text).unwrap_or(b"");
            has_atoms |= column.eq_ignore_ascii_case(b"Cartn_x");
            if column.eq_ignore_ascii_case(b"fract_x") {
                fractional = Some(token.start..token.end);
            }
            names.push(
                String::from_utf8_lossy(if column.is_empty() { token.text } else { column })
                    .into_owned(),
            );
        };
        if !has_atoms {
            self.fractional = self.fractional.take().or(fractional);
            return Ok(false);
        }
        if self.is_own && self.found.is_none() {
            let rows = rows_of(data, first)?;
            tokens.at = rows.0.end;
            self.found = Some(Found { names, rows: rows.0, is_free: rows.1 });
        }
        Ok(true)
    }

    fn finish(self, data: &Data) -> Result<MmCif, Fault> {
        let has =
            |name: &str| self.single.iter().any(|(column, ..)| column.eq_ignore_ascii_case(name));
        let (found, single) = match self.found {
            Some(found) => (found, None),
            None if has("Cartn_x") => {
                let places = self.single.iter().map(|(_, place, quoted)| (place.clone(), *quoted));
                let single = places.collect();
                let names = self.single.iter().map(|(name, ..)| name.clone()).collect();
                (Found { names, rows: 0..data.len(), is_free: true }, Some(single))
            }
            None => return Err(no_atoms(self.fractional)),
        };
        if found.names.len() > MOST_COLUMNS {
            return Err(Fault::whole(
                format!(
                    "an atom has {} columns, but at most {MOST_COLUMNS} are read",
                    found.names.len()
                ),
                "write the file again with the columns that are needed",
            ));
        }
        let mut notes = Vec::new();
        if self.others > 0 {
            let atoms = match self.others {
                1 => "1 further data block are".into(),
                more => format!("{more} further data blocks are"),
            };
            notes.push(format!("atoms of {atoms} left out: those of the first are drawn"));
        }
        let cell = match self.cell {
            [Some(a), Some(b), Some(c), Some(alpha), Some(beta), Some(gamma)]
                if [a, b, c] != [1.0; 3] && ![a, b, c].contains(&0.0) =>
            {
                let edges = atoms::edges([a, b, c], [alpha, beta, gamma]);
                if edges.is_none() {
                    notes.push("the box was left out: its lengths and angles are of none".into());
                }
                edges.map(|edges| Cell { origin: [0.0; 3], edges })
            }
            _ => None,
        };
        let is_free = AtomicBool::new(found.is_free);
        Ok(MmCif { names: found.names, rows: found.rows, single, is_free, cell, notes })
    }
}

/// Where the rows of a table are that begin with a word, and whether they are anything but lines.
fn rows_of(data: &Data, first: Option<Token<'_>>) -> Result<(Range<usize>, bool), Fault> {
    let whole = data.as_slice();
    let Some(first) = first else { return Ok((whole.len()..whole.len(), false)) };
    let line_start = memchr::memrchr(b'\n', &whole[..first.start]).map_or(0, |at| at + 1);
    if whole[line_start..first.start].iter().all(|byte| is_blank(*byte)) {
        let end = rows::find(data, line_start..whole.len(), ends_rows).unwrap_or(whole.len());
        if whole.get(end) != Some(&b';') {
            return Ok((line_start..end, false));
        }
    }
    let mut tokens = Tokens { whole, at: first.start };
    while let Some(token) = tokens.next()? {
        if !token.is_value() {
            return Ok((first.start..token.start, true));
        }
    }
    Ok((first.start..whole.len(), true))
}

/// Whether a line ends the rows that are lines.
fn ends_rows(line: Line<'_>) -> bool {
    let text = &line.text[blanks(line.text)..];
    match text.first() {
        Some(b'_') => true,
        Some(b';') => line.text.first() == Some(&b';'),
        Some(b'l' | b'L' | b'd' | b'D' | b's' | b'S' | b'g' | b'G') => {
            let word = &text[..super::data::word(text)];
            !matches!(cif::kind(word), Word::Plain)
        }
        _ => false,
    }
}

/// Whether a line is a row, if rows are lines.
#[inline]
fn is_row(line: Line<'_>) -> bool {
    match line.text.first() {
        Some(b' ' | b'\t' | b'#') | None => {
            !matches!(line.text.get(blanks(line.text)), None | Some(b'#'))
        }
        Some(_) => true,
    }
}

fn no_atoms(fractional: Option<Range<usize>>) -> Fault {
    match fractional {
        Some(span) => Fault::new(
            "the atoms have fractional coordinates only: their places follow from the cell and \
             the symmetry of the crystal",
            span,
            "no Cartn_x",
            "expand the crystal with ASE, OVITO or gemmi, and write it as XYZ",
        ),
        None => Fault::whole(
            "there is no _atom_site.Cartn_x: there is no particle",
            "name an mmCIF file that has the coordinates of atoms",
        ),
    }
}

impl Reader for MmCif {
    fn frame(&self, data: &Data, at: usize) -> Result<Option<Range<usize>>, Fault> {
        if self.single.is_some() {
            return Ok((at == 0).then_some(0..data.len().max(1)));
        }
        let start = at.max(self.rows.start);
        if !self.is_free.load(Ordering::Relaxed) {
            if let Some(frame) = self.frame_of_lines(data, start) {
                return Ok(frame);
            }
            self.is_free.store(true, Ordering::Relaxed);
        }
        self.frame_of_words(data, start)
    }

    fn read(
        &self,
        data: &Data,
        frame: Range<usize>,
        control: &Control,
    ) -> Result<Particles, Fault> {
        let mut plan = Plan::of(self, data, &frame)?;
        loop {
            let misfit = Misfit::of(&plan);
            let mut stores = plan.stores();
            let read = self.read_rows(data, &frame, control, (&plan, &misfit), &mut stores);
            if misfit.is_free.load(Ordering::Relaxed) {
                self.is_free.store(true, Ordering::Relaxed);
                continue;
            }
            if misfit.apply(&mut plan) {
                continue;
            }
            read?;
            return Ok(self.finish(stores, &plan));
        }
    }
}

impl MmCif {
    /// The place of a column.
    fn find(&self, names: &[&str]) -> Option<usize> {
        names
            .iter()
            .find_map(|name| self.names.iter().position(|own| own.eq_ignore_ascii_case(name)))
    }

    /// A frame of rows that are lines; none if they turn out to be no lines.
    fn frame_of_lines(&self, data: &Data, start: usize) -> Option<Option<Range<usize>>> {
        let columns = self.names.len();
        let Some(first) = rows::find(data, start..self.rows.end, is_row) else { return Some(None) };
        let is_line = |line: Line<'_>| count(line) == Some(columns);
        if self.rows.end == data.len() {
            // A file that is cut in a row has a last line that is none.
            let text = data.as_slice()[first..].trim_ascii_end();
            let last = memchr::memrchr(b'\n', text).map_or(first, |at| first + at + 1);
            data.line(last).filter(|line| !is_row(*line) || is_line(*line))?;
        }
        let Some(model) = self.find(&["pdbx_PDB_model_num"]) else {
            return Some(Some(start..self.rows.end));
        };
        let line = data.line(first).filter(|line| is_line(*line))?;
        let own = cells(line).nth(model).flatten()?;
        let mut from = first;
        loop {
            let is_other = |line: Line<'_>| {
                let is_last = model + 1 == columns;
                let cell = || cells(line).nth(model).flatten().unwrap_or(b"");
                is_row(line) && own != if is_last { last_cell(line.text) } else { cell() }
            };
            let Some(other) = rows::find(data, from..self.rows.end, is_other) else {
                return Some(Some(start..self.rows.end));
            };
            // A comment may be the last word of a line.
            let line = data.line(other).filter(|line| is_line(*line))?;
            if cells(line).nth(model).flatten()? != own {
                return Some(Some(start..other));
            }
            from = line.next;
        }
    }

    /// A frame, word by word.
    fn frame_of_words(&self, data: &Data, start: usize) -> Result<Option<Range<usize>>, Fault> {
        let model = self.find(&["pdbx_PDB_model_num"]);
        let mut tokens = self.tokens(data, start..self.rows.end);
        let mut own: Option<&[u8]> = None;
        loop {
            let mut row_start = None;
            for column in 0..self.names.len() {
                let Some(token) = tokens.next()?.filter(Token::is_value) else {
                    return match column {
                        0 if row_start.is_none() && own.is_none() => Ok(None),
                        0 => Ok(Some(start..self.rows.end)),
                        _ => Err(self.cut_row(column, self.rows.end)),
                    };
                };
                let row_start = *row_start.get_or_insert(token.start);
                if model.unwrap_or(0) == column {
                    let value = if model.is_some() { token.text } else { b"" };
                    if *own.get_or_insert(value) != value {
                        return Ok(Some(start..row_start));
                    }
                }
            }
        }
    }

    fn tokens<'a>(&self, data: &'a Data, range: Range<usize>) -> Tokens<'a> {
        Tokens { whole: data.as_slice().get(..range.end).unwrap_or(b""), at: range.start }
    }

    fn cut_row(&self, found: usize, end: usize) -> Fault {
        Fault::new(
            format!("the last row has {found} values, but there are {} columns", self.names.len()),
            end..end,
            format!("no `{}`", self.names.get(found).map_or("", String::as_str)),
            "wait until the file is written, or write it again",
        )
    }

    fn read_rows(
        &self,
        data: &Data,
        frame: &Range<usize>,
        control: &Control,
        (plan, misfit): (&Plan, &Misfit),
        stores: &mut [Store],
    ) -> Result<(), Fault> {
        if let Some(single) = &self.single {
            let mut values = single.iter().map(|(place, quoted)| Token {
                kind: if *quoted { Word::Quoted } else { Word::Plain },
                text: data.as_slice().get(place.clone()).unwrap_or(b""),
                start: place.start,
                end: place.end,
            });
            let mut next = |row: &mut Row<'_, '_>| {
                plan.parse(row, misfit, || Ok(values.next())).map(|found| found.is_none())
            };
            return rows::read_in_turn(stores, control, &mut next).map(|_| ());
        }
        if self.is_free.load(Ordering::Relaxed) {
            let mut tokens = self.tokens(data, frame.clone());
            let mut next = |row: &mut Row<'_, '_>| match plan
                .parse(row, misfit, || Ok(tokens.next()?.filter(Token::is_value)))?
            {
                None => Ok(true),
                Some(0) => Ok(false),
                Some(found) => Err(self.cut_row(found, frame.end)),
            };
            return rows::read_in_turn(stores, control, &mut next).map(|_| ());
        }
        let parse = |line: Line<'_>, row: &mut Row<'_, '_>| {
            if plan.parse_line(line, row, misfit)? {
                return Ok(());
            }
            misfit.is_free.store(true, Ordering::Relaxed);
            Err(Fault::whole("a row is no line", ""))
        };
        let which = Which::Those(&is_row);
        rows::read(data, frame.clone(), &which, stores, control, parse).map(|_| ())
    }

    /// The particles of the columns.
    fn finish(&self, mut stores: Vec<Store>, plan: &Plan) -> Particles {
        let store = |names: &[&str]| self.find(names).and_then(|column| plan.columns[column].store);
        let mut notes = Vec::new();
        if let (Some(alternate), Some(name)) =
            (store(&["label_alt_id"]), store(&["label_atom_id", "auth_atom_id"]))
        {
            let residue = [
                store(&["auth_asym_id", "label_asym_id"]),
                store(&["auth_seq_id", "label_seq_id"]),
                store(&["pdbx_PDB_ins_code"]),
            ];
            let residue: Vec<usize> = residue.into_iter().flatten().collect();
            let sites = atoms::Sites {
                residue: &residue,
                residue_name: store(&["label_comp_id", "auth_comp_id"]),
                name,
                alternate,
                occupancy: store(&["occupancy"]),
            };
            let left_out = atoms::without_alternates(&mut stores, &sites);
            notes.extend(atoms::note_of_alternates(left_out));
        }
        let mut stores = stores.into_iter();
        let centers = stores.next().map_or(Vec::new(), Store::into_reals);
        let names = self.names.iter().zip(&plan.columns);
        let names = names.filter(|(_, column)| column.store.is_some());
        let names = names.map(|(name, _)| name.as_str()).chain(std::iter::once("element"));
        let mut columns = Vec::new();
        for (number, (name, store)) in names.zip(stores).enumerate() {
            if number + 1 != plan.element {
                columns.push(Column::named(name, store.into_values()));
                continue;
            }
            if let Values::Words(words) = store.into_values() {
                let (words, counts) = atoms::settle(words);
                notes.extend(atoms::note_of_elements(counts, words.codes.len()));
                columns.push(Column::named(name, Values::Words(words)).with_role(Role::Element));
            }
        }
        notes.extend(self.notes.iter().cloned());
        Particles {
            centers: Reals::F64(centers.into()),
            centers_from: "Cartn_x Cartn_y Cartn_z".into(),
            columns,
            cell: self.cell,
            notes,
        }
    }
}

/// The last word of a line.
#[inline]
fn last_cell(line: &[u8]) -> &[u8] {
    let mut end = line.len();
    while end > 0 && is_blank(line[end - 1]) {
        end -= 1;
    }
    let mut start = end;
    while start > 0 && !is_blank(line[start - 1]) {
        start -= 1;
    }
    &line[start..end]
}

/// What the values of a line say, up to a comment; none in place of a quote that does not end.
fn cells(line: Line<'_>) -> impl Iterator<Item = Option<&[u8]>> {
    let mut rest = line.text;
    std::iter::from_fn(move || {
        rest = &rest[blanks(rest)..];
        rest.first().filter(|first| **first != b'#')?;
        let cell = cif::cell(rest);
        rest = cell.map_or(b"", |(_, length)| &rest[length..]);
        Some(cell.map(|(text, _)| text))
    })
}

/// How many values a line has; none if there is something else in it.
fn count(line: Line<'_>) -> Option<usize> {
    cells(line).try_fold(0, |count, cell| cell.map(|_| count + 1))
}

/// How a column is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    /// A coordinate of the position.
    Axis(usize),
    /// A real number, or nothing.
    Real,
    /// The same, which other values show to be a column of words.
    PerhapsReal,
    /// An integer, of which the same is true.
    PerhapsInteger,
    /// A word.
    Word,
    /// The symbol of the element.
    Symbol,
}

struct PlanColumn {
    /// What it is called in messages.
    name: String,
    kind: Kind,
    /// Where it goes; the positions go to the first.
    store: Option<usize>,
}

/// How rows are read.
struct Plan {
    columns: Vec<PlanColumn>,
    /// The columns of the names of atoms and residues, by which elements are derived.
    atom: Option<usize>,
    residue: Option<usize>,
    /// The store of elements.
    element: usize,
}

/// What the element of a row follows from.
#[derive(Clone, Copy, Default)]
struct Names<'a> {
    symbol: &'a [u8],
    atom: &'a [u8],
    residue: &'a [u8],
}

/// Where a row does not fit a plan.
struct Misfit {
    /// Columns that are of words.
    words: Vec<AtomicBool>,
    /// Whether a row is no line.
    is_free: AtomicBool,
}

impl Misfit {
    fn of(plan: &Plan) -> Self {
        let words = plan.columns.iter().map(|_| AtomicBool::new(false)).collect();
        Self { words, is_free: AtomicBool::new(false) }
    }

    /// Makes a plan that fits; false where it did fit.
    fn apply(&self, plan: &mut Plan) -> bool {
        let mut changed = false;
        for (column, is_words) in plan.columns.iter_mut().zip(&self.words) {
            if is_words.load(Ordering::Relaxed) {
                column.kind = Kind::Word;
                changed = true;
            }
        }
        changed
    }
}

impl Plan {
    /// By the names of the columns, and by the first row where they say nothing.
    fn of(cif: &MmCif, data: &Data, frame: &Range<usize>) -> Result<Self, Fault> {
        let mut tokens = cif.tokens(data, frame.clone());
        let (mut columns, mut stores) = (Vec::with_capacity(cif.names.len()), 1);
        let axes = ["Cartn_x", "Cartn_y", "Cartn_z"].map(|name| cif.find(&[name]));
        if let Some(missing) = axes.iter().position(Option::is_none) {
            let axis = ["x", "y", "z"][missing];
            return Err(Fault::whole(
                format!("there is no _atom_site.Cartn_{axis}"),
                "write the file again",
            ));
        }
        let symbol = cif.find(&["type_symbol"]);
        for (number, name) in cif.names.iter().enumerate() {
            let first = match cif.single {
                Some(_) => None,
                None => tokens.next()?,
            };
            let kind = match axes.iter().position(|axis| *axis == Some(number)) {
                Some(axis) => Kind::Axis(axis),
                None if symbol == Some(number) => Kind::Symbol,
                None => kind(name, first),
            };
            let store = (!matches!(kind, Kind::Axis(_))).then_some(stores);
            stores += usize::from(store.is_some());
            columns.push(PlanColumn { name: format!("`{name}`"), kind, store });
        }
        let element = symbol.and_then(|symbol| columns[symbol].store).unwrap_or(stores);
        let atom = cif.find(&["label_atom_id", "auth_atom_id", "label"]);
        let residue = cif.find(&["label_comp_id", "auth_comp_id"]);
        Ok(Self { columns, atom, residue, element })
    }

    fn stores(&self) -> Vec<Store> {
        let mut stores = vec![Store::reals(3)];
        for column in &self.columns {
            match column.kind {
                Kind::Axis(_) => {}
                Kind::Real | Kind::PerhapsReal => stores.push(Store::reals(1)),
                Kind::PerhapsInteger => stores.push(Store::integers()),
                Kind::Word | Kind::Symbol => stores.push(Store::words()),
            }
        }
        if self.element == stores.len() {
            stores.push(Store::words());
        }
        stores
    }

    /// Reads a row; where there are too few values, says how many there are.
    fn parse<'a>(
        &self,
        row: &mut Row<'_, '_>,
        misfit: &Misfit,
        mut next: impl FnMut() -> Result<Option<Token<'a>>, Fault>,
    ) -> Result<Option<usize>, Fault> {
        let mut names = Names::default();
        for number in 0..self.columns.len() {
            let Some(token) = next()? else { return Ok(Some(number)) };
            self.set(row, misfit, number, token, &mut names)?;
        }
        self.set_element(row, names);
        Ok(None)
    }

    /// Reads a row that is a line; says whether it is one.
    #[inline]
    fn parse_line(
        &self,
        line: Line<'_>,
        row: &mut Row<'_, '_>,
        misfit: &Misfit,
    ) -> Result<bool, Fault> {
        let mut names = Names::default();
        let mut rest = line.text;
        for number in 0..self.columns.len() {
            rest = &rest[blanks(rest)..];
            let start = line.start + line.text.len() - rest.len();
            let (kind, text, length) = match rest.first() {
                None | Some(b'#') => return Ok(false),
                Some(b'\'' | b'"') => match cif::cell(rest) {
                    Some((text, length)) => (Word::Quoted, text, length),
                    None => return Ok(false),
                },
                Some(_) => {
                    let length = super::data::word(rest);
                    (Word::Plain, &rest[..length], length)
                }
            };
            rest = &rest[length..];
            let token = Token { kind, text, start, end: start + length };
            self.set(row, misfit, number, token, &mut names)?;
        }
        self.set_element(row, names);
        Ok(matches!(rest.get(blanks(rest)), None | Some(b'#')))
    }

    /// Sets the value of a column.
    #[inline(always)]
    fn set<'a>(
        &self,
        row: &mut Row<'_, '_>,
        misfit: &Misfit,
        number: usize,
        token: Token<'a>,
        names: &mut Names<'a>,
    ) -> Result<(), Fault> {
        let column = &self.columns[number];
        let text = if token.is_unknown() { b"" } else { token.text };
        if self.atom == Some(number) {
            names.atom = text;
        }
        if self.residue == Some(number) {
            names.residue = text;
        }
        match (column.kind, column.store) {
            (Kind::Axis(axis), _) => row.set_real(0, axis, coordinate(&column.name, token)?),
            (_, None) => {}
            (Kind::Symbol, _) => names.symbol = text,
            (Kind::Word, Some(store)) => row.set_word(store, text),
            (Kind::PerhapsInteger, Some(store)) => match atoms::digits(text) {
                Some(value) => row.set_integer(store, 0, value),
                None => return Err(misfit.is_words(number)),
            },
            (kind, Some(store)) => match real(text) {
                Some(value) => row.set_real(store, 0, value),
                None if text.is_empty() => row.set_real(store, 0, f64::NAN),
                None if kind == Kind::PerhapsReal => return Err(misfit.is_words(number)),
                None => {
                    let span = token.start..token.end;
                    return Err(number::not_a_number(&column.name, text, span));
                }
            },
        }
        Ok(())
    }

    /// Sets the element by its symbol, which may have a charge, or by names.
    #[inline]
    fn set_element(&self, row: &mut Row<'_, '_>, names: Names<'_>) {
        let Names { symbol, atom, residue } = names;
        let letters = symbol.iter().take_while(|byte| byte.is_ascii_alphabetic()).count();
        let (letters, charge) = symbol.split_at(letters);
        let is_charge = charge.iter().all(|byte| matches!(byte, b'0'..=b'9' | b'+' | b'-'));
        match self::symbol(letters).filter(|_| is_charge) {
            Some(symbol) => row.set_word(self.element, symbol.as_bytes()),
            None if symbol.is_empty() => {
                atoms::set_found(row, self.element, atoms::element_of_name(atom, residue));
            }
            None => row.set_word(self.element, symbol),
        }
    }
}

impl Misfit {
    #[cold]
    fn is_words(&self, column: usize) -> Fault {
        self.words[column].store(true, Ordering::Relaxed);
        Fault::whole("a value is no number", "")
    }
}

/// How a column of a name is read, of which a first value is known.
fn kind(name: &str, first: Option<Token<'_>>) -> Kind {
    match name.to_ascii_lowercase().as_str() {
        "id" | "auth_seq_id" | "pdbx_pdb_model_num" => Kind::PerhapsInteger,
        "occupancy" | "b_iso_or_equiv" | "u_iso_or_equiv" => Kind::Real,
        "label_seq_id" | "pdbx_formal_charge" | "attached_hydrogens" => Kind::PerhapsReal,
        name if name.ends_with("_esd") => Kind::Real,
        "group_pdb" | "label_atom_id" | "label_alt_id" | "label_comp_id" | "label_asym_id"
        | "label_entity_id" | "pdbx_pdb_ins_code" | "auth_comp_id" | "auth_asym_id"
        | "auth_atom_id" => Kind::Word,
        _ => match first {
            Some(token) if token.kind == Word::Plain && real(token.text).is_some() => {
                Kind::PerhapsReal
            }
            _ => Kind::Word,
        },
    }
}

/// A coordinate.
#[inline]
fn coordinate(name: &str, token: Token<'_>) -> Result<f64, Fault> {
    match real(token.text) {
        Some(value) if value.is_finite() => Ok(value),
        value => Err(no_coordinate(name, token, value.is_some())),
    }
}

#[cold]
fn no_coordinate(name: &str, token: Token<'_>, is_number: bool) -> Fault {
    let span = token.start..token.end;
    if is_number {
        return number::not_finite(name, token.text, span);
    }
    if token.is_unknown() {
        return Fault::new(
            format!("{name} is not known: `{}`", text::value(&String::from_utf8_lossy(token.text))),
            span,
            "no place",
            "leave the atom out of the file",
        );
    }
    number::not_a_number(name, token.text, span)
}

/// A number, which may have its uncertainty behind it, such as `1.234(5)`.
#[inline]
fn real(value: &[u8]) -> Option<f64> {
    atoms::short(value).or_else(|| {
        let (number, uncertainty) = value.split_at(memchr::memchr(b'(', value)?);
        let digits = uncertainty.strip_prefix(b"(")?.strip_suffix(b")")?;
        let is = !digits.is_empty() && digits.iter().all(|byte| matches!(byte, b'0'..=b'9' | b'.'));
        atoms::short(number).filter(|_| is)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::particles::{
        Format,
        file::tests::{centers, frame, opened, words, x},
    };

    const QUOTED: &str = "data_t
#
_struct.title
;a text that holds
loop_
_atom_site.id
;
#
loop_
_atom_site.Cartn_z
_atom_site.label_atom_id
_atom_site.id
_atom_site.type_symbol
_atom_site.Cartn_x
_atom_site.Cartn_y
3.0 \"O5'\" 1 O 1.0 2.0
6.0 'C1\"' 2 C 4.0 5.0
9.0 CA
3 CA 7.0 8.0
#
";

    const MODELS: &str = "\
#
DATA_1abc
_cell.length_a 10.0(3)
_cell.length_b 20
_cell.length_c 30
_cell.angle_alpha 90
_CELL.angle_beta 90
_cell.angle_gamma 90
loop_
_atom_site.group_PDB
_atom_site.id
_atom_site.label_atom_id
_atom_site.label_alt_id
_atom_site.label_comp_id
_atom_site.label_seq_id
_atom_site.auth_seq_id
_atom_site.auth_asym_id
_ATOM_SITE.CARTN_X
_atom_site.Cartn_y
_atom_site.Cartn_z
_atom_site.occupancy
_atom_site.type_symbol
_atom_site.my_number
_atom_site.pdbx_PDB_model_num
ATOM   1 N  . SER 5 5 A 1.5(2) 0 0 1.00 N    1.5 1
ATOM   2 CA A SER 5 5 A 2 0 0 0.40 C    ?   1
ATOM   3 CA B SER 5 5 A 3 0 0 0.60 C    2.5 1
HETATM 4 ZN . ZN  . 9 A 4 0 0 ?    ZN2+ x   1 # a comment
HETATM 5 CA . CA  . 9 A 5 0 0 .    ?    1.5 2

# another
ATOM   6 CA . GLY 6 6 A 6 0 0 1.00 ?    1.5 2
loop_
_other.id
1 2
data_2
loop_
_atom_site.id
_atom_site.Cartn_x
1 2
";

    #[test]
    fn few_columns_in_any_order_and_rows_that_wrap() {
        for text in [QUOTED.to_owned(), QUOTED.replace('\n', "\r\n"), QUOTED.trim_end().to_owned()]
        {
            let particles = frame(Format::MmCif, text.as_str(), 0).unwrap();
            let wanted = [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [7.0, 8.0, 9.0]];
            assert_eq!(centers(&particles), wanted);
            assert_eq!(words(&particles, "type_symbol"), ["O", "C", "Ca"]);
            assert_eq!(words(&particles, "label_atom_id"), ["O5'", "C1\"", "CA"]);
            assert_eq!(words(&particles, "id"), ["1", "2", "3"]);
            assert!(particles.notes.is_empty() && particles.cell.is_none());
        }
    }

    #[test]
    fn models_alternates_and_values_that_are_not_there() {
        // The same rows as lines, wrapped, and with a text field among them.
        let wrapped = MODELS.replace(" SER 5 5", "\nSER\n5 5").replace("SER\n", "\n;SER\n;\n");
        let wrapped = wrapped.replace("ATOM   6 CA", "ATOM   6\nCA");
        for text in [MODELS.to_owned(), MODELS.replace('\n', "\r\n"), wrapped] {
            let file = opened(Format::MmCif, text.as_str()).unwrap();
            assert_eq!(file.frames(&Control::new()).unwrap(), 2, "{text}");
            let first = file.read(0, &Control::new()).unwrap();
            assert_eq!(x(&first), [1.5, 3.0, 4.0]);
            assert_eq!(words(&first, "type_symbol"), ["N", "C", "Zn"]);
            assert_eq!(words(&first, "label_seq_id"), ["5", "5", "NaN"]);
            assert_eq!(words(&first, "auth_seq_id"), ["5", "5", "9"]);
            assert_eq!(words(&first, "occupancy"), ["1", "0.6", "NaN"]);
            assert_eq!(words(&first, "my_number"), ["1.5", "2.5", "x"]);
            assert_eq!(words(&first, "label_comp_id"), ["SER", "SER", "ZN"]);
            let notes = [
                "1 alternate position was left out: the ones of highest occupancy are drawn",
                "atoms of 1 further data block are left out: those of the first are drawn",
            ];
            assert_eq!(first.notes, notes);
            let edges = first.cell.unwrap().edges;
            assert_eq!(edges, [[10.0, 0.0, 0.0], [0.0, 20.0, 0.0], [0.0, 0.0, 30.0]]);
            let second = file.read(1, &Control::new()).unwrap();
            assert_eq!(x(&second), [5.0, 6.0]);
            assert_eq!(words(&second, "type_symbol"), ["Ca", "C"]);
            assert_eq!(second.notes[0], "elements were derived from the names of 2 of 2 atoms");
        }
    }

    #[test]
    fn tables_of_other_shapes() {
        for (text, wanted, element) in [
            // One atom needs no loop.
            (
                "data_x _atom_site.id 1 _atom_site.Cartn_x 1.5 _atom_site.label_atom_id 'C A'\n\
                 _atom_site.Cartn_y\n;2\n;\n_atom_site.Cartn_z 3(1)\n",
                vec![[1.5, 2.0, 3.0]],
                "C",
            ),
            // A line for all.
            (
                "data_x loop_ _atom_site.Cartn_x _atom_site.Cartn_y _atom_site.Cartn_z 1 2 3 4 5 6 \
                 loop_ _b.c 1",
                vec![[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]],
                "",
            ),
            // The names of small molecules, and other tables of like names.
            (
                "data_x\nloop_\n_atom_site_aniso_label\n_atom_site_aniso_U_11\nC1 0.5\nloop_\n\
                 _atom_site_label\n_atom_site_Cartn_x\n_atom_site_Cartn_y\n_atom_site_Cartn_z\n\
                 Cl1 1 2 3\n",
                vec![[1.0, 2.0, 3.0]],
                "Cl",
            ),
        ] {
            let particles = frame(Format::MmCif, text, 0).unwrap();
            assert_eq!(centers(&particles), wanted);
            assert_eq!(words(&particles, "element")[0], element);
            assert_eq!(opened(Format::MmCif, text).unwrap().frames(&Control::new()).unwrap(), 1);
        }
        let fractional = "data_x\nloop_\n_atom_site_label\n_atom_site_fract_x\nC1 0.5\n";
        let error = opened(Format::MmCif, fractional).expect_err("fractional");
        assert!(error.message().contains("symmetry of the crystal"), "{error}");
        assert_eq!(error.line(), Some(4));
        let names: String = (0..1000).map(|name| format!("_atom_site.a{name}\n")).collect();
        let wide = format!("data_x\nloop_\n_atom_site.Cartn_x\n{names}1\n");
        let error = opened(Format::MmCif, wide).expect_err("wide");
        assert!(error.message().contains("1001 columns"), "{error}");
    }

    #[test]
    fn files_that_are_cut() {
        for (cut, line) in [("6 A 6 0 0", 32), ("1.00 ?    1.5 2\nloop_", 32)] {
            let at = MODELS.rfind(cut).unwrap();
            let file = opened(Format::MmCif, &MODELS[..at]).unwrap();
            let error = file.frames(&Control::new()).expect_err(cut);
            assert!(error.message().contains("the frame before it is whole"), "{error}");
            assert_eq!(error.line(), Some(line), "{error}");
        }
        assert!(opened(Format::MmCif, &QUOTED[..QUOTED.find("_atom").unwrap()]).is_err());
    }

    #[test]
    fn what_is_wrong_is_pointed_at() {
        for (old, new, line, words) in [
            ("A 3 0 0", "A x 0 0", 27, "`x` stands where `CARTN_X` is expected"),
            ("A 3 0 0", "A 3 ? 0", 27, "`Cartn_y` is not known"),
            ("A 3 0 0", "A 3 0 nan", 27, "not finite"),
            ("A 3 0 0", "A 3(x) 0 0", 27, "`3(x)`"),
            ("0.60", "much", 27, "`much` stands where `occupancy`"),
            ("_atom_site.Cartn_y", "_atom_site.q", 0, "there is no _atom_site.Cartn_y"),
            ("ATOM   3", "'ATOM  3", 27, "quote"),
        ] {
            let error = opened(Format::MmCif, MODELS.replacen(old, new, 1))
                .and_then(|file| file.read(0, &Control::new()))
                .expect_err(new);
            assert_eq!(error.line().unwrap_or(0), line, "{error}");
            assert!(error.message().contains(words), "{error}");
        }
    }

    #[test]
    fn files_are_known_by_their_first_words() {
        for text in [QUOTED, MODELS, "# x\n\ndata_\n", "data_x _a 1"] {
            assert!(is(text.as_bytes()), "{text}");
        }
        for text in ["", "data_x = 1\n", "data_x,y\n1,2\n", "# x\n[scene]\n", "3\ndata_x\n"] {
            assert!(!is(text.as_bytes()), "{text}");
        }
    }
}
