//! XYZ files, plain and extended.
//!
//! The format: github.com/libAtoms/extxyz, "Extended XYZ specification". A frame is a line with
//! the number of its rows, a line of comment, and the rows. In the extended format the comment
//! names the columns; in the plain one a row is a symbol or an atomic number, and then x, y and z.

use std::{
    ops::Range,
    sync::atomic::{AtomicBool, Ordering},
};

use super::{
    Column, Data, Particles, Reader, Role, Values, Words,
    data::Line,
    number,
    rows::{self, Kind, Layout, Place, Store, Which},
};
use crate::input::report::Fault;
use comment::{Comment, Property, PropertyKind};
use planisphere_core::{drawing::Control, scene::Reals, text};

mod comment;

/// What the comment of LAMMPS begins with, whose rows may begin with a type.
const LAMMPS: &[u8] = b"Atoms. Timestep:";

/// Bytes that rows may lack before memory is taken for them.
const SLACK: usize = 1 << 20;

/// Atomic numbers end here.
const LAST_ELEMENT: i64 = 118;

/// Whether bytes begin as an XYZ file does: with a number of rows, and, where there are any, with
/// a first row that is one.
pub(super) fn is(beginning: &[u8]) -> bool {
    let mut at = 0;
    let first = loop {
        let Some(line) = Line::at(beginning, at) else { return false };
        if !line.is_blank() {
            break line;
        }
        at = line.next;
    };
    let Some(count) = count(first) else { return false };
    let comment = Line::at(beginning, first.next);
    let row = comment.and_then(|line| Line::at(beginning, line.next));
    match (count, comment, row) {
        (0, _, None) => true,
        (0, _, Some(next)) => next.is_blank() || self::count(next).is_some(),
        (_, Some(comment), Some(row)) => {
            let cells: Vec<&[u8]> = row.cells().take(4).map(|cell| cell.text).collect();
            let are_numbers = |cells: &[&[u8]]| cells.iter().all(|c| number::real(c).is_some());
            match cells.len() {
                4 if are_numbers(&cells[1..]) => true,
                3 if are_numbers(&cells) => true,
                // What is wrong in it, its reader says.
                _ => Comment::read(comment).map_or(true, |found| found.properties.is_some()),
            }
        }
        _ => false,
    }
}

/// A reader.
pub(super) fn open(_: &Data) -> Result<Box<dyn Reader>, Fault> {
    Ok(Box::new(Xyz))
}

#[derive(Debug)]
struct Xyz;

impl Reader for Xyz {
    fn frame(&self, data: &Data, at: usize) -> Result<Option<Range<usize>>, Fault> {
        let Some(header) = Header::find(data, at)? else { return Ok(None) };
        let end = data.skip_lines(header.rows, header.count);
        let end = end.map_err(|found| header.cut_short(found))?;
        // A number that is too small leaves rows behind, one that is too large takes the next
        // frame's first lines.
        if let Some(next) = data.line_with_text(end)
            && count(next).is_none()
        {
            return Err(Fault::new(
                format!(
                    "`{}` stands where a frame ends or the next one begins, as the frame before it \
                     announces {}",
                    text::value(&String::from_utf8_lossy(start(next))),
                    rows(header.count)
                ),
                next.span(),
                "no number of rows",
                "correct the number on the first line of the frame before it",
            ));
        }
        Ok(Some(header.line.start..end))
    }

    fn read(
        &self,
        data: &Data,
        frame: Range<usize>,
        control: &Control,
    ) -> Result<Particles, Fault> {
        let Some(header) = Header::find(data, frame.start)? else {
            return Err(Fault::whole("there is no frame", "write the file again"));
        };
        let comment = header.comment.map(Comment::read).transpose()?.unwrap_or_default();
        let first = data.line(header.rows).filter(|_| header.count > 0);
        let table = match &comment.properties {
            Some(properties) => Table::named(properties, &comment.place, first)?,
            None => Table::plain(first, false)?,
        };
        let read = |table: &Table| header.read(data, frame.end, table, control);
        let result = match read(&table) {
            // What begins with a number may go on with a symbol.
            Err(_) if table.form == Form::Numbers && !control.is_cancelled() => {
                let table = Table::plain(first, true)?;
                read(&table).map(|found| (table, found))
            }
            result => result.map(|found| (table, found)),
        };
        let (table, (stores, more)) = result?;
        Ok(table.finish(stores, more, comment, &header))
    }
}

/// The number of rows that a line gives, if it does; a comment may follow it.
fn count(line: Line<'_>) -> Option<usize> {
    let mut cells = line.cells();
    let first = cells.next()?.text;
    let ended = cells.next().is_none_or(|cell| matches!(cell.text[0], b'#' | b'!'));
    number::integer(first).and_then(|count| usize::try_from(count).ok()).filter(|_| ended)
}

/// As much of a line as is shown.
fn start(line: Line<'_>) -> &[u8] {
    &line.text[..line.text.len().min(60)]
}

fn rows(count: usize) -> String {
    if count == 1 { "1 row".into() } else { format!("{count} rows") }
}

/// What stands before the rows of a frame.
struct Header<'a> {
    /// How many rows there are.
    count: usize,
    /// The line of that count.
    line: Line<'a>,
    comment: Option<Line<'a>>,
    /// Where the rows begin.
    rows: usize,
}

impl<'a> Header<'a> {
    /// That of the frame behind a place; none at the end.
    fn find(data: &'a Data, at: usize) -> Result<Option<Self>, Fault> {
        let Some(line) = data.line_with_text(at) else { return Ok(None) };
        let Some(count) = count(line) else {
            let found: Vec<&[u8]> = line.cells().map(|cell| cell.text).take(3).collect();
            if at == 0 && found.len() == 3 && found.iter().all(|cell| number::real(cell).is_some())
            {
                return Err(Fault::new(
                    "there is no number of atoms on the first line: these are points alone",
                    line.span(),
                    "of how many rows?",
                    "put a line with the names of the columns above, such as `x y z`, and read it \
                     with --format csv",
                ));
            }
            return Err(number::not_an_integer("the number of atoms", start(line), line.span()));
        };
        let comment = data.line(line.next);
        let rows = comment.map_or(line.next, |comment| comment.next);
        Ok(Some(Self { count, line, comment, rows }))
    }

    /// Reads the rows into the columns of a table; says whether any has more cells than that.
    fn read(
        &self,
        data: &Data,
        end: usize,
        table: &Table,
        control: &Control,
    ) -> Result<(Vec<Store>, bool), Fault> {
        // Rows that are too short for their cells are told where they are read, unless that took
        // far more memory than there is text.
        let bytes = end.saturating_sub(self.rows);
        let least = table.layout.least().saturating_mul(self.count);
        if least > bytes.saturating_add(SLACK) {
            return Err(self.cut_short(bytes / table.layout.least()));
        }
        let more = AtomicBool::new(false);
        let mut stores: Vec<Store> = table.columns.iter().map(Property::store).collect();
        let missing = |found| self.cut_short(found);
        let which = Which::First(self.count, &missing);
        rows::read(data, self.rows..end, &which, &mut stores, control, |line, row| {
            if table.layout.parse_start(line, row)? && !more.load(Ordering::Relaxed) {
                more.store(true, Ordering::Relaxed);
            }
            if table.form == Form::Words { symbol(line) } else { Ok(()) }
        })?;
        Ok((stores, more.into_inner()))
    }

    fn cut_short(&self, found: usize) -> Fault {
        Fault::new(
            format!("{} atoms are announced, but {found} rows follow", self.count),
            self.line.span(),
            "more than there are",
            "correct the number, wait until the file is written, or write it again",
        )
    }
}

/// That the first cell of a plain row is no coordinate.
fn symbol(line: Line<'_>) -> Result<(), Fault> {
    let Some(cell) = line.cells().next() else { return Ok(()) };
    let begins = matches!(cell.text.first(), Some(b'0'..=b'9' | b'+' | b'-' | b'.'));
    if begins && number::integer(cell.text).is_none() && number::real(cell.text).is_some() {
        return Err(Fault::new(
            format!("`{}` stands where a symbol or an atomic number is expected", cell.words()),
            cell.span(),
            "neither",
            "name the columns in the comment, such as `Properties=pos:R:3:radius:R:1`",
        ));
    }
    Ok(())
}

impl Property {
    fn new(name: &str, kind: PropertyKind, width: usize) -> Self {
        Self { name: name.into(), kind, width }
    }

    fn store(&self) -> Store {
        match self.kind {
            PropertyKind::Real => Store::reals(self.width),
            PropertyKind::Integer => Store::Integers(Vec::new(), self.width),
            PropertyKind::Word | PropertyKind::Truth => Store::words(),
        }
    }

    fn cell_kind(&self) -> Kind {
        match self.kind {
            PropertyKind::Real => Kind::Real,
            PropertyKind::Integer => Kind::Integer,
            PropertyKind::Word | PropertyKind::Truth => Kind::Word,
        }
    }

    /// What it says, of values that are so.
    fn role(&self) -> Role {
        let is_z = self.name.eq_ignore_ascii_case("Z");
        let role = if is_z { Role::AtomicNumber } else { Role::of_name(&self.name) };
        let (kind, width) = (self.kind, self.width);
        let numbers = matches!(kind, PropertyKind::Real | PropertyKind::Integer);
        match role {
            Role::Radius | Role::Diameter | Role::Channel(_) if numbers && width == 1 => role,
            Role::Color if numbers && width == 3 => role,
            Role::Id | Role::AtomicNumber if kind == PropertyKind::Integer && width == 1 => role,
            Role::Element if kind == PropertyKind::Integer && width == 1 => Role::AtomicNumber,
            Role::Element if kind == PropertyKind::Word && width == 1 => role,
            Role::Type if kind != PropertyKind::Real && width == 1 => role,
            _ => Role::Other,
        }
    }
}

/// How the rows begin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Form {
    /// As the comment says.
    Named,
    /// With a word.
    Words,
    /// With an integer.
    Numbers,
    /// With a position.
    Positions,
}

/// The columns of a frame, of which the first is the positions.
struct Table {
    form: Form,
    columns: Vec<Property>,
    layout: Layout,
}

impl Table {
    /// Of columns with names.
    fn named(
        properties: &[Property],
        place: &Range<usize>,
        first: Option<Line<'_>>,
    ) -> Result<Self, Fault> {
        let is_pos = |property: &Property| {
            let name = property.name.to_ascii_lowercase();
            ["pos", "position", "positions"].contains(&name.as_str())
                && property.width == 3
                && matches!(property.kind, PropertyKind::Real | PropertyKind::Integer)
        };
        let Some(pos) = properties.iter().position(is_pos) else {
            return Err(Fault::new(
                "no column of the comment is the positions",
                place.clone(),
                "no pos:R:3",
                "call the column of the positions pos:R:3",
            ));
        };
        let wanted = properties.iter().fold(0usize, |sum, column| sum.saturating_add(column.width));
        let mut columns = vec![Property::new("pos", PropertyKind::Real, 3)];
        let mut places = Vec::new();
        if let Some(line) = first {
            let found = line.cells().count();
            if wanted > found {
                let end = line.span().end;
                return Err(Fault::new(
                    format!("the line has {found} cells, but the comment names {wanted}"),
                    end..end,
                    "too few",
                    "correct the line, or the names of the columns before it",
                ));
            }
        }
        for (number, property) in properties.iter().enumerate() {
            let words = matches!(property.kind, PropertyKind::Word | PropertyKind::Truth);
            let mut column = if number == pos { 0 } else { columns.len() };
            if number != pos && !(words && property.width > 1) {
                columns.push(property.clone());
            }
            // Without rows there are no cells, and no limit to how many are named.
            for component in 0..first.map_or(0, |_| property.width) {
                let mut name = property.name.clone();
                if property.width > 1 {
                    name = format!("{name}:{}", component + 1);
                }
                let kind = if number == pos { Kind::Finite } else { property.cell_kind() };
                if words && property.width > 1 {
                    column = columns.len();
                    columns.push(Property::new(&name, property.kind, 1));
                }
                let component = if words { 0 } else { component };
                places.push(Place { name: format!("`{name}`"), kind, column, component });
            }
        }
        Ok(Self { form: Form::Named, columns, layout: Layout { places, more: false } })
    }

    /// Of the plain format, by the first row.
    fn plain(first: Option<Line<'_>>, words: bool) -> Result<Self, Fault> {
        let cells: Vec<&[u8]> =
            first.iter().flat_map(|line| line.cells()).take(4).map(|cell| cell.text).collect();
        let are_numbers = cells.iter().all(|cell| number::real(cell).is_some());
        let form = match cells.first() {
            Some(_) if cells.len() == 3 && are_numbers => Form::Positions,
            Some(cell) if !words && number::integer(cell).is_some() => Form::Numbers,
            _ => Form::Words,
        };
        let mut columns = vec![Property::new("pos", PropertyKind::Real, 3)];
        let mut places = Vec::new();
        let place = |name: &str, kind, column, component| Place {
            name: format!("`{name}`"),
            kind,
            column,
            component,
        };
        let kind = match form {
            Form::Numbers => Some((PropertyKind::Integer, Kind::Integer)),
            Form::Words => Some((PropertyKind::Word, Kind::Word)),
            Form::Named | Form::Positions => None,
        };
        if let Some((kind, cell_kind)) = kind {
            columns.push(Property::new("species", kind, 1));
            places.push(place("species", cell_kind, 1, 0));
        }
        for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
            places.push(place(name, Kind::Finite, 0, axis));
        }
        let layout = Layout { places, more: form != Form::Positions };
        Ok(Self { form, columns, layout })
    }

    /// What was read, as particles; `more` says that rows have cells that are not named.
    fn finish(
        self,
        stores: Vec<Store>,
        more: bool,
        comment: Comment,
        header: &Header<'_>,
    ) -> Particles {
        let mut notes = comment.notes;
        let mut stores = stores.into_iter();
        let centers = stores.next().map_or(Vec::new(), Store::into_reals);
        let mut columns = Vec::new();
        for (property, store) in self.columns.iter().skip(1).zip(stores) {
            let column = Column {
                name: property.name.clone(),
                role: property.role(),
                width: property.width,
                values: store.into_values(),
            };
            match (column.role, &column.values) {
                (Role::Element, Values::Words(words)) => {
                    let letters = elements(words, &mut notes);
                    let role = if letters.is_some() { Role::Other } else { Role::Element };
                    columns.push(column.with_role(role));
                    columns.extend(letters);
                }
                (Role::Color, Values::Integers(_)) => columns.push(bytes(column, &mut notes)),
                (Role::AtomicNumber, Values::Integers(_)) if self.form == Form::Numbers => {
                    columns.push(numbers(column, header, &mut notes));
                }
                (Role::AtomicNumber, _) if Role::of_name(&column.name) == Role::Element => {
                    let name = text::value(&column.name);
                    notes.push(format!("`{name}` has integers, which are taken as atomic numbers"));
                    columns.push(column);
                }
                _ => columns.push(column),
            }
        }
        if more {
            notes.push("cells behind z have no names, and were left out".into());
        }
        let centers_from = match self.form {
            Form::Named => self.columns[0].name.clone(),
            _ => "x y z".into(),
        };
        let centers = Reals::F64(centers.into());
        Particles { centers, centers_from, columns, cell: comment.cell, notes }
    }
}

/// The elements of words that are more than a symbol, such as `C1` and `Fe2+`, as another column:
/// the first letters of each. None where all words are letters.
fn elements(words: &Words, notes: &mut Vec<String>) -> Option<Column> {
    // Several labels may be of one element.
    let distinct: Words = words.words.iter().map(|word| letters(word)).collect();
    let pairs = || words.words.iter().enumerate().map(|(n, word)| (&**word, distinct.get(n)));
    let mut longer = pairs().filter(|(word, symbol)| word != symbol && !symbol.is_empty());
    let (word, symbol) = longer.next()?;
    notes.push(format!(
        "{} labels are more than a symbol, and their letters are taken, as of `{}`: `{symbol}`",
        1 + longer.count(),
        text::value(&text::within(word, 20))
    ));
    let codes = words.codes.iter().map(|code| distinct.codes[*code as usize]).collect();
    let values = Values::Words(Words { codes, words: distinct.words });
    Some(Column::named("element", values).with_role(Role::Element))
}

/// The first letters of a word.
fn letters(word: &str) -> &str {
    let word = word.trim_start_matches(|c: char| !c.is_ascii_alphabetic());
    let end = word.find(|c: char| !c.is_ascii_alphabetic());
    &word[..end.unwrap_or(word.len())]
}

/// Integers that rows of the plain format begin with: atomic numbers, or types.
fn numbers(mut column: Column, header: &Header<'_>, notes: &mut Vec<String>) -> Column {
    let by_lammps = header.comment.is_some_and(|line| line.text.starts_with(LAMMPS));
    let are_elements = match &column.values {
        Values::Integers(values) => values.iter().all(|z| (0..=LAST_ELEMENT).contains(z)),
        _ => false,
    };
    if by_lammps || !are_elements {
        let why = if by_lammps { "the file is by LAMMPS" } else { "not all are of elements" };
        notes.push(format!("rows begin with numbers, which are taken as types: {why}"));
        (column.name, column.role) = ("type".into(), Role::Type);
    } else {
        notes.push("rows begin with numbers, which are taken as atomic numbers".into());
        column.name = "Z".into();
    }
    column
}

/// Colours as bytes, where all are.
fn bytes(column: Column, notes: &mut Vec<String>) -> Column {
    let Values::Integers(values) = &column.values else { return column };
    let bytes: Option<Vec<u8>> = values.iter().map(|value| u8::try_from(*value).ok()).collect();
    match bytes {
        Some(bytes) => Column { values: Values::Bytes(bytes.into()), ..column },
        None => {
            let name = text::value(&column.name);
            notes.push(format!("`{name}` has integers beyond 0 to 255, and is taken as no colour"));
            column.with_role(Role::Other)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::particles::{
        Format,
        file::tests::{centers, frame, opened},
    };

    fn read(text: &str) -> Particles {
        frame(Format::Xyz, text, 0).unwrap()
    }

    fn words(particles: &Particles, role: Role) -> Vec<String> {
        let Values::Words(words) = &particles.role(role).expect("a column").values else {
            panic!("words")
        };
        (0..particles.len()).map(|row| words.get(row).to_string()).collect()
    }

    fn integers(particles: &Particles, role: Role) -> Vec<i64> {
        match &particles.role(role).expect("a column").values {
            Values::Integers(values) => values.clone(),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn plain_rows_are_a_symbol_and_a_position() {
        let found = read(" 3 \n\nO\t0 1d-1 -2\r\n H +.5 1.D0 1e0 \nXx 3 4 5");
        assert_eq!(centers(&found), [[0.0, 0.1, -2.0], [0.5, 1.0, 1.0], [3.0, 4.0, 5.0]]);
        assert_eq!(words(&found, Role::Element), ["O", "H", "Xx"]);
        assert_eq!((found.columns.len(), found.notes.len(), found.cell), (1, 0, None));
        // What is behind z, if only in some rows.
        let found = read("2\nLattice=\"1 2 3\"\nC 1 2 3\nC 1 2 3 0.5 junk\n");
        assert_eq!(found.notes, ["cells behind z have no names, and were left out"]);
        assert!(found.cell.is_some());
        // The word alone names no columns.
        let found = read("1\nProperties= are listed in the paper\nC 1 2 3 0.5 junk\n");
        assert_eq!((centers(&found), found.notes.len()), (vec![[1.0, 2.0, 3.0]], 2));
        let found = read("2\n\n1 2 3\n4 5 6\n");
        assert_eq!(centers(&found), [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]);
        assert!(found.columns.is_empty());
        assert!(read("0\n").is_empty() && read("0\n\n").is_empty());
    }

    #[test]
    fn numbers_are_elements_or_types() {
        let found = read("2\n\n6 0 0 0\n8 0 0 1.5\n");
        assert_eq!((integers(&found, Role::AtomicNumber), found.notes.len()), (vec![6, 8], 1));
        let found = read("2\nAtoms. Timestep: 0\n1 0 0 0\n2 0 0 1.5\n");
        assert_eq!((integers(&found, Role::Type), found.notes.len()), (vec![1, 2], 1));
        let found = read("2\n\n1 0 0 0\n2000 0 0 1.5\n");
        assert_eq!((integers(&found, Role::Type), found.notes.len()), (vec![1, 2000], 1));
        let found = read("2\n\n1 0 0 0\nHe 0 0 1.5\n");
        assert_eq!(words(&found, Role::Element), ["1", "He"]);
    }

    #[test]
    fn labels_are_of_the_element_of_their_letters() {
        let found = read("5\n\nC1 0 0 0\nFe2+ 1 0 0\n13C 2 0 0\nC1 3 0 0\n* 4 0 0\n");
        assert_eq!(words(&found, Role::Element), ["C", "Fe", "C", "C", ""]);
        assert_eq!(words(&found, Role::Other), ["C1", "Fe2+", "13C", "C1", "*"]);
        let note = "3 labels are more than a symbol, and their letters are taken, as of `C1`: `C`";
        assert_eq!(found.notes, [note]);
    }

    #[test]
    fn columns_are_those_that_are_named() {
        let found = read(
            "3\nLattice=\"10 0 0 0 10 0 0 0 10\" Properties=id:I:1:pos:R:3:species:S:1:radius:R:1:\
             v:R:2:w:S:2:fixed:L:1:color:I:3 note=\"a = b, \\\"c\\\"\" pbc=\"T T F\"\n\
             7 1.5 -2 3e0 O 0.5 1 nan a b T 1 2 3\n8\t0 0 0\tH 0.25 3 4 a c F 4 5 255\n\
             9 -1 -1 -1 Xx 0.1 5 6 d e T 7 8 9\n\n\n",
        );
        assert_eq!(centers(&found), [[1.5, -2.0, 3.0], [0.0; 3], [-1.0; 3]]);
        assert_eq!(integers(&found, Role::Id), [7, 8, 9]);
        assert_eq!(words(&found, Role::Element), ["O", "H", "Xx"]);
        let names: Vec<_> = found.columns.iter().map(|c| (&*c.name, c.width)).collect();
        let wanted = [("id", 1), ("species", 1), ("radius", 1), ("v", 2), ("w:1", 1), ("w:2", 1)];
        assert_eq!(names[..6], wanted);
        assert_eq!(names[6..], [("fixed", 1), ("color", 3)]);
        let value = |name: &str, at| found.column(name).unwrap().values.get(at).unwrap();
        assert_eq!((value("radius", 1), value("v", 4), value("color", 5)), (0.25, 5.0, 255.0));
        assert!(value("v", 1).is_nan(), "not a coordinate");
        let Values::Words(w) = &found.column("w:2").unwrap().values else { panic!("words") };
        assert_eq!([w.get(0), w.get(1), w.get(2)], ["b", "c", "e"]);
        assert_eq!(found.role(Role::Color).unwrap().width, 3);
        assert!(found.cell.is_some() && found.notes.is_empty(), "{:?}", found.notes);

        let found = read("1\nProperties=Z:I:1:pos:I:3:color:I:3:radius:R:2\n6 1 2 3 0 0 256 1 2\n");
        assert_eq!((integers(&found, Role::AtomicNumber), found.notes.len()), (vec![6], 1));
        assert!(found.role(Role::Color).is_none() && found.role(Role::Radius).is_none());
        assert!(read("0\nProperties=a:R:999999999999:pos:R:3\n").is_empty());
    }

    #[test]
    fn frames_have_their_own_columns_and_rows() {
        let text = "\u{feff}2\n2\nC 0 0 0\nC 1 1 1\n0\n\n1\nProperties=pos:R:3:species:S:1\n\
                    4 5 6 O\n\n1 # one\nno more\n7 8 9\n  \n\n";
        let file = opened(Format::Xyz, text).unwrap();
        let control = Control::new();
        assert_eq!(file.frames(&control).unwrap(), 4);
        let rows = [0, 1, 2, 3].map(|number| file.read(number, &control).unwrap());
        assert_eq!(rows.each_ref().map(Particles::len), [2, 0, 1, 1]);
        assert_eq!(centers(&rows[2]), [[4.0, 5.0, 6.0]]);
        assert_eq!(centers(&rows[3]), [[7.0, 8.0, 9.0]]);
    }

    #[test]
    fn what_is_wrong_is_pointed_at() {
        let named = "2\nProperties=species:S:1:pos:R:3\n";
        for (text, line, words) in [
            ("1\n\nC 0 0 0\nC 1 1 1\n", 4, "stands where a frame ends"),
            ("3\n\nC 0 0 0\nC 1 1 1\n", 1, "3 atoms are announced, but 2 rows follow"),
            ("3\n\nC 0 0 0\nC 1 1 1\n\n", 5, "the line is blank"),
            ("2\n\nC 0 0 0\n1\nnext\nC 1 1 1\n", 5, "stands where a frame ends"),
            ("4\n\nC 0 0 0\nC 1 1 1\n\n\n", 5, "the line is blank"),
            ("3\n\nC 0 0 0\nC 1 1 1\n       \n", 5, "the line is blank"),
            ("9999999999\n\nC 0 0 0\n", 1, "9999999999 atoms are announced"),
            ("2\n\nC 0 0 0\nC 1 1\n", 4, "has 3 cells, but 4 are needed"),
            ("1\n\nC 0 x 0\n", 3, "`x` stands where `y`"),
            ("1\n\nC 0 0 nan\n", 3, "not finite"),
            ("1\n\n1.0 2.0 3.0 0.5\n", 3, "`1.0` stands where a symbol"),
            ("2\n\n1 2 3 4\n.5 2 3 4\n", 4, "`.5` stands where a symbol"),
            ("2\n\n1 2 3\nC 1 2 3\n", 4, "`C` stands where `x`"),
            ("-1\n\n", 1, "the number of atoms"),
            ("1\nProperties=species:S:1:p:R:3\nC 1 2 3\n", 2, "is the positions"),
            ("1\nProperties=a:R:9999999999:pos:R:3\nC 1 2 3\n", 3, "names 10000000002"),
            (&format!("{named}C 0 0 0\nC 1 1 1 1\n"), 4, "has 5 cells, but there are 4"),
            (&format!("{named}C 0 0 0\nC 1 1 inf\n"), 4, "`pos:3` is `inf`"),
            (&format!("{named}C 0 0\nC 1 1 inf\n"), 3, "the comment names 4"),
        ] {
            let error = frame(Format::Xyz, text, 0).expect_err(text);
            assert_eq!(error.line(), Some(line), "{error}");
            assert!(error.message().contains(words), "{error}");
        }
    }

    #[test]
    fn short_rows_take_no_memory() {
        // A first row of many cells, and then as many rows as there are ends of lines.
        let cells = 20_000;
        let text = format!("100000\nProperties=pos:R:3:a:R:{cells}\n1 2 3");
        let text = text + &" 4".repeat(cells) + &"\n".repeat(100_000);
        let error = frame(Format::Xyz, text, 0).expect_err("no rows");
        assert!(error.message().contains("but 3 rows follow"), "{error}");
    }

    #[test]
    fn other_formats_begin_otherwise() {
        for (text, wanted) in [
            ("3\n\nC 0 0 0\n", true),
            ("\n 3 # rows\n\n0\t0\t0\n", true),
            ("1\nProperties=id:I:1:species:S:1:pos:R:3\n1 C 0 0 0\n", true),
            ("0\n\n", true),
            ("0\nx\n1\ny\nC 1 2 3", true),
            ("water\n 3\n    1SOL     OW    1   0.126   1.624   1.679\n", false),
            ("1\n 3\n    1SOL     OW    1   0.126   1.624   1.679\n", false),
            ("x,y,z\n1,2,3\n", false),
            ("1\n\n10 atoms\n", false),
            ("3\n", false),
            ("", false),
        ] {
            assert_eq!(is(text.as_bytes()), wanted, "{text}");
        }
    }
}
