//! LAMMPS data files, as `read_data` reads and `write_data` writes them: the atoms.
//!
//! The format: LAMMPS documentation, "read_data command". The first line is any text; lines of
//! numbers and a keyword follow, then sections. What the columns of `Atoms` are depends on the
//! style of atoms, which a comment behind the word tells, or the rows do where they leave no doubt.
//! Positions stay where the file has them, also where flags say which image of the box is meant.

use std::{collections::HashMap, ops::Range};

use super::{
    Cell, Column, Data, Particles, Reader, Values, Words,
    data::{Cell as TextCell, Line},
    number,
    rows::{self, Kind, Layout, Place, Row, Store, Which},
};
use crate::input::report::Fault;
use planisphere_core::{drawing::Control, scene::Reals, text};

/// Rows that are looked at where the style is not told.
const SEEN: usize = 64;

/// Labels of types, at most.
const MOST_LABELS: usize = 100_000;

/// What to do about a file that ends too early.
const WRITE_AGAIN: &str = "wait until the file is written, or write it again";

/// The columns of each style of atoms ("Atoms section"). Of styles that the rows do not tell apart
/// the first is taken.
const STYLES: [(&str, &str); 24] = [
    ("atomic", "id type x y z"),
    ("charge", "id type q x y z"),
    ("molecular", "id mol type x y z"),
    ("bond", "id mol type x y z"),
    ("angle", "id mol type x y z"),
    ("full", "id mol type q x y z"),
    ("sphere", "id type diameter density x y z"),
    ("ellipsoid", "id type ellipsoidflag density x y z"),
    ("dipole", "id type q x y z mux muy muz"),
    ("body", "id type bodyflag mass x y z"),
    ("bpm/sphere", "id mol type diameter density x y z"),
    ("dielectric", "id mol type q x y z mux muy muz area ed em epsilon curvature"),
    ("dpd", "id type theta x y z"),
    ("edpd", "id type edpd_temp edpd_cv x y z"),
    ("electron", "id type q espin eradius x y z"),
    ("line", "id mol type lineflag density x y z"),
    ("mdpd", "id type rho x y z"),
    ("peri", "id type volume density x y z"),
    ("smd", "id type mol volume mass kradius cradius x0 y0 z0 x y z"),
    ("sph", "id type rho esph cv x y z"),
    ("spin", "id type x y z spx spy spz sp"),
    ("template", "id type mol template_index template_atom x y z"),
    ("tri", "id mol type triangleflag density x y z"),
    ("wavepacket", "id type q espin eradius etag cs_re cs_im x y z"),
];

/// Styles whose rows begin with these, and go on in ways that the file does not tell.
const OPEN_STYLES: [&str; 2] = ["hybrid", "tdpd"];
const OPEN_COLUMNS: &str = "id type x y z";

/// Which image of the box a position is in: may follow in all styles.
const FLAGS: [&str; 3] = ["ix", "iy", "iz"];

/// Whether bytes begin as such a file does: behind the first line, those of a header, up to that of
/// the number of atoms.
pub(super) fn is(beginning: &[u8]) -> bool {
    let Some(title) = Line::at(beginning, 0) else { return false };
    // The first line of an XYZ file.
    if number::integer(title.text.trim_ascii()).is_some() {
        return false;
    }
    let mut at = title.next;
    while let Some(line) = Line::at(beginning, at) {
        at = line.next;
        let line = uncommented(line);
        match Entry::of(line) {
            Some(entry) if entry.keyword == "atoms" => return entry.numbers.len() == 1,
            Some(entry) if !entry.keyword.is_empty() => {}
            _ if line.is_blank() => {}
            _ => return false,
        }
    }
    false
}

/// A reader.
pub(super) fn open(data: &Data) -> Result<Box<dyn Reader>, Fault> {
    Ok(Box::new(LammpsData::read_header(data)?))
}

/// What stands before the rows of the atoms.
#[derive(Debug)]
struct LammpsData {
    /// How many atoms there are.
    count: usize,
    /// The line of that count.
    count_span: Range<usize>,
    /// How many types, if it is told.
    types: Option<i64>,
    bonds: f64,
    cell: Option<Cell>,
    /// What types are called, by their numbers.
    labels: HashMap<i64, Box<str>>,
    /// The style of the atoms, if it is told.
    style: Option<String>,
    /// The line `Atoms`.
    atoms_span: Range<usize>,
    /// Where the rows begin.
    rows: usize,
}

impl Reader for LammpsData {
    fn frame(&self, data: &Data, at: usize) -> Result<Option<Range<usize>>, Fault> {
        // One frame: the rows of the atoms.
        if at > 0 {
            return Ok(None);
        }
        let Some(last) = self.count.checked_sub(1) else { return Ok(Some(self.rows..self.rows)) };
        let rest = data.as_slice().get(self.rows..).unwrap_or_default();
        if let Some(end) = memchr::memchr_iter(b'\n', rest).nth(last) {
            return Ok(Some(self.rows..self.rows + end + 1));
        }
        // The last line may lack its end.
        let open = rest.last().is_some_and(|byte| *byte != b'\n');
        let found = memchr::memchr_iter(b'\n', rest).count() + usize::from(open);
        if found < self.count {
            Err(self.cut_short(found))
        } else {
            Ok(Some(self.rows..data.len()))
        }
    }

    fn read(
        &self,
        data: &Data,
        frame: Range<usize>,
        control: &Control,
    ) -> Result<Particles, Fault> {
        let mut notes = Vec::new();
        let columns = self.columns(data, &frame, &mut notes)?;
        let (layout, kinds) = columns.layout(!self.labels.is_empty());
        let others = kinds.iter().map(|kind| match kind {
            Kind::Integer => Store::integers(),
            Kind::Word => Store::words(),
            _ => Store::reals(1),
        });
        let mut stores: Vec<Store> = std::iter::once(Store::reals(3)).chain(others).collect();
        let parse = |line: Line<'_>, row: &mut Row<'_, '_>| layout.parse(uncommented(line), row);
        let missing = |found| self.cut_short(found);
        let which = Which::First(self.count, &missing);
        let (end, _) = rows::read(data, frame, &which, &mut stores, control, parse)?;
        self.ends(data, end)?;

        let mut stores = stores.into_iter();
        let centers = stores.next().map_or(Vec::new(), Store::into_reals);
        let names = columns.names.iter().filter(|name| axis(name).is_none());
        let columns = names.zip(stores).map(|(name, store)| {
            let values = match store.into_values() {
                Values::Words(words) if name == "type" => Values::Words(self.labelled(&words)),
                values => values,
            };
            Column::named(name.as_str(), values)
        });
        let columns = columns.collect();
        if self.bonds > 0.0 {
            notes.push(format!("{} bonds were left out: only atoms are drawn", self.bonds));
        }
        Ok(Particles {
            centers: Reals::F64(centers.into()),
            centers_from: "x y z".into(),
            columns,
            cell: self.cell,
            notes,
        })
    }
}

/// A line without the comment at its end.
fn uncommented(line: Line<'_>) -> Line<'_> {
    let end = memchr::memchr(b'#', line.text).unwrap_or(line.text.len());
    Line { text: &line.text[..end], ..line }
}

/// A line of the header: some numbers, and what they are.
struct Entry {
    numbers: Vec<f64>,
    keyword: String,
}

impl Entry {
    /// None where a line does not begin with a number.
    fn of(line: Line<'_>) -> Option<Self> {
        let cells: Vec<TextCell<'_>> = line.cells().take(12).collect();
        let numbers: Vec<f64> = cells.iter().map_while(|cell| number::real(cell.text)).collect();
        let words: Vec<String> = cells[numbers.len()..].iter().map(TextCell::words).collect();
        (!numbers.is_empty()).then(|| Self { numbers, keyword: words.join(" ") })
    }
}

/// The bounds and edges of the box, as far as they were read.
#[derive(Default)]
struct Box3 {
    bounds: [Option<[f64; 2]>; 3],
    tilt: [f64; 3],
    edges: [Option<[f64; 3]>; 3],
    origin: Option<[f64; 3]>,
}

impl Box3 {
    /// Takes a line, if it is of the box.
    fn take(&mut self, entry: &Entry, line: &Line<'_>) -> Result<(), Fault> {
        let wrong = |count: usize| {
            Fault::new(
                format!("{count} finite numbers of the box are expected on this line"),
                line.span(),
                "other numbers",
                "write the file again",
            )
        };
        let numbers = &entry.numbers;
        let finite = numbers.iter().all(|number| number.is_finite());
        let two =
            || <[f64; 2]>::try_from(&numbers[..]).ok().filter(|_| finite).ok_or_else(|| wrong(2));
        let three =
            || <[f64; 3]>::try_from(&numbers[..]).ok().filter(|_| finite).ok_or_else(|| wrong(3));
        match entry.keyword.as_str() {
            "xlo xhi" => self.bounds[0] = Some(two()?),
            "ylo yhi" => self.bounds[1] = Some(two()?),
            "zlo zhi" => self.bounds[2] = Some(two()?),
            "xy xz yz" => self.tilt = three()?,
            "avec" => self.edges[0] = Some(three()?),
            "bvec" => self.edges[1] = Some(three()?),
            "cvec" => self.edges[2] = Some(three()?),
            "abc origin" => self.origin = Some(three()?),
            _ => {}
        }
        Ok(())
    }

    /// The box, what is not told being LAMMPS's own; none where nothing is.
    fn cell(&self) -> Option<Cell> {
        if self.edges.iter().any(Option::is_some) {
            let unit = |axis: usize| std::array::from_fn(|k| f64::from(u8::from(k == axis)));
            let edges = std::array::from_fn(|axis| self.edges[axis].unwrap_or_else(|| unit(axis)));
            return Some(Cell { origin: self.origin.unwrap_or_default(), edges });
        }
        if self.bounds.iter().all(Option::is_none) {
            return None;
        }
        let bounds = self.bounds.map(|bounds| bounds.unwrap_or([-0.5, 0.5]));
        let [x, y, z] = bounds.map(|[low, high]| high - low);
        let [xy, xz, yz] = self.tilt;
        let edges = [[x, 0.0, 0.0], [xy, y, 0.0], [xz, yz, z]];
        Some(Cell { origin: bounds.map(|[low, _]| low), edges })
    }
}

impl LammpsData {
    fn read_header(data: &Data) -> Result<Self, Fault> {
        let mut found = Self {
            count: 0,
            count_span: 0..0,
            types: None,
            bonds: 0.0,
            cell: None,
            labels: HashMap::new(),
            style: None,
            atoms_span: 0..0,
            rows: data.len(),
        };
        // The first line is skipped, whatever it is.
        let mut at = data.line(0).map_or(0, |line| line.next);
        let mut edges = Box3::default();
        let mut counted = false;
        while let Some(whole) = data.line(at) {
            let line = uncommented(whole);
            if let Some(entry) = Entry::of(line) {
                match entry.keyword.as_str() {
                    "atoms" => {
                        let cell = line.cells().next().map_or(&b""[..], |cell| cell.text);
                        let count = number::integer(cell).and_then(|n| usize::try_from(n).ok());
                        let what = "the number of atoms";
                        let not = || number::not_an_integer(what, cell, line.span());
                        (found.count, found.count_span) = (count.ok_or_else(not)?, line.span());
                        counted = true;
                    }
                    "atom types" => found.types = entry.numbers.first().map(|n| *n as i64),
                    "bonds" => found.bonds = entry.numbers.first().copied().unwrap_or(0.0),
                    _ => edges.take(&entry, &line)?,
                }
            } else if !line.is_blank() {
                break;
            }
            at = whole.next;
        }
        if !counted {
            return Err(Fault::whole(
                "the header has no line with the number of atoms, such as `1000 atoms`",
                "add it below the first line, which is skipped",
            ));
        }
        found.cell = edges.cell();
        found.find_atoms(data, at)?;
        Ok(found)
    }

    /// Finds the section of the atoms.
    fn find_atoms(&mut self, data: &Data, mut at: usize) -> Result<(), Fault> {
        while let Some(whole) = data.line(at) {
            at = whole.next;
            let line = uncommented(whole);
            match line.text.trim_ascii() {
                b"Atoms" => {
                    let comment = &whole.text[line.text.len()..];
                    let hint =
                        Line { text: comment.strip_prefix(b"#").unwrap_or(comment), ..whole };
                    self.style = hint.cells().next().map(|cell| cell.words());
                    self.atoms_span = whole.span();
                    let blank = data.line(at).filter(|line| !uncommented(*line).is_blank());
                    if let Some(line) = blank {
                        return Err(Fault::new(
                            "the line below `Atoms` is skipped by LAMMPS, but it is not blank",
                            line.span(),
                            "not blank",
                            "put a blank line above it",
                        ));
                    }
                    self.rows = data.line(at).map_or(data.len(), |line| line.next);
                    return Ok(());
                }
                b"Atom Type Labels" => at = self.read_labels(data, at)?,
                _ => {}
            }
        }
        if self.count == 0 {
            return Ok(());
        }
        Err(Fault::new(
            format!("{} atoms are announced, but there is no section `Atoms`", self.count),
            self.count_span.clone(),
            "none of them",
            WRITE_AGAIN,
        ))
    }

    /// Reads the labels below a line that is skipped, and says where they end.
    fn read_labels(&mut self, data: &Data, mut at: usize) -> Result<usize, Fault> {
        at = data.line(at).map_or(at, |line| line.next);
        while let Some(line) = data.line(at).filter(|line| !line.is_blank()) {
            at = line.next;
            let mut cells = line.cells();
            let (kind, label) = (cells.next(), cells.next());
            let kind = kind.and_then(|cell| number::integer(cell.text));
            let (Some(kind), Some(label)) = (kind, label) else {
                return Err(Fault::new(
                    "the number of a type and its label are expected here",
                    line.span(),
                    "no label",
                    "correct the line, or write the file again",
                ));
            };
            if self.labels.len() >= MOST_LABELS {
                return Err(Fault::new(
                    format!("there are more than {MOST_LABELS} labels of types"),
                    line.span(),
                    "one more",
                    "write the types as numbers",
                ));
            }
            self.labels.insert(kind, label.words().into());
        }
        Ok(at)
    }

    /// Refuses more rows of atoms than are announced.
    fn ends(&self, data: &Data, at: usize) -> Result<(), Fault> {
        let Some(line) = data.line(at).filter(|line| !line.is_blank()) else { return Ok(()) };
        let is_row = uncommented(line).cells().next().and_then(|cell| number::integer(cell.text));
        match is_row {
            None => Ok(()),
            Some(_) => Err(Fault::new(
                format!("{} atoms are announced, but more rows follow", self.count),
                line.span(),
                "one more",
                "correct the number in the header, or write the file again",
            )
            .and(self.count_span.clone(), "announced here")),
        }
    }

    fn cut_short(&self, found: usize) -> Fault {
        Fault::new(
            format!("{} atoms are announced, but {found} lines follow `Atoms`", self.count),
            self.count_span.clone(),
            "more than there are",
            WRITE_AGAIN,
        )
    }

    /// Labels in place of the numbers of types.
    fn labelled(&self, words: &Words) -> Words {
        let label = |word: &str| {
            let kind = number::integer(word.as_bytes());
            kind.and_then(|kind| self.labels.get(&kind)).map_or(word, |label| label).to_owned()
        };
        let labels: Vec<String> = words.words.iter().map(|word| label(word)).collect();
        words.codes.iter().map(|code| labels[*code as usize].as_str()).collect()
    }

    /// What the columns of the rows are.
    fn columns(
        &self,
        data: &Data,
        frame: &Range<usize>,
        notes: &mut Vec<String>,
    ) -> Result<Columns, Fault> {
        let mut rows = Vec::new();
        let mut at = frame.start;
        while rows.len() < SEEN.min(self.count)
            && let Some(line) = data.line(at)
        {
            at = line.next;
            rows.push(uncommented(line));
        }
        let Some(first) = rows.first() else { return Ok(Columns::of("atomic", 5)) };
        let cells = first.cells().count();
        let Some(style) = &self.style else { return self.by_rows(&rows, cells, notes) };
        if OPEN_STYLES.contains(&style.as_str()) {
            notes
                .push(format!("what follows x, y and z in rows of the style {style} was left out"));
            let names = OPEN_COLUMNS.split(' ').map(String::from).collect();
            return Ok(Columns { names, more: true });
        }
        let Some((_, names)) = STYLES.iter().find(|(name, _)| name == style) else {
            // A comment like any other.
            notes.push(format!("`{}` behind `Atoms` is no style of atoms", text::value(style)));
            return self.by_rows(&rows, cells, notes);
        };
        let wanted = names.split(' ').count();
        if cells != wanted && cells != wanted + 3 {
            return Err(Fault::new(
                format!(
                    "rows of the style {style} have {wanted} cells, or {} with image flags, but \
                     this one has {cells}",
                    wanted + 3
                ),
                first.span(),
                names.to_string(),
                "correct the style behind `Atoms #`, or the rows",
            ));
        }
        Ok(Columns::of(style, cells))
    }

    /// The columns of the one style that the rows are of.
    fn by_rows(
        &self,
        rows: &[Line<'_>],
        cells: usize,
        notes: &mut Vec<String>,
    ) -> Result<Columns, Fault> {
        let counted = STYLES.iter().filter(|(_, names)| {
            let wanted = names.split(' ').count();
            cells == wanted || cells == wanted + 3
        });
        let candidates: Vec<(&str, Columns)> = counted
            .map(|(style, _)| (*style, Columns::of(style, cells)))
            .filter(|(_, columns)| rows.iter().all(|row| self.fits(*row, columns)))
            .collect();
        // Positions that are all integers are none, where those of another style are not.
        let whole = |columns: &Columns| {
            let at = |cell: (usize, TextCell<'_>)| {
                columns.names.get(cell.0).is_none_or(|name| axis(name).is_none())
                    || number::integer(cell.1.text).is_some()
            };
            rows.iter().all(|row| row.cells().enumerate().all(at))
        };
        let any = candidates.iter().any(|(_, columns)| !whole(columns));
        let left: Vec<&(&str, Columns)> = candidates
            .iter()
            .filter(|(_, columns)| (!any || !whole(columns)) && !counts(rows, columns))
            .collect();
        let known: Vec<&str> = left.iter().map(|(style, _)| *style).collect();
        let Some((style, columns)) = left.first() else {
            return Err(self.no_style(rows, format!("rows of {cells} cells are of no style")));
        };
        if left.iter().any(|(_, other)| other.matters() != columns.matters()) {
            let why = format!("rows of {cells} cells can be of the styles {}", known.join(", "));
            return Err(self.no_style(rows, why));
        }
        let others = known[1..].join(", ");
        notes.push(match left.iter().any(|(_, other)| other.names != columns.names) {
            true => format!("the style of atoms is not told: taken as {style}, not as {others}"),
            false => format!("the style of atoms is not told: taken as {style}"),
        });
        Ok(Columns { names: columns.names.clone(), more: false })
    }

    fn no_style(&self, rows: &[Line<'_>], why: String) -> Fault {
        Fault::new(
            format!("the style of atoms is not told, and {why}"),
            rows.first().map_or(self.atoms_span.clone(), Line::span),
            "of which style?",
            "write the style behind the word `Atoms`, such as `Atoms # full`",
        )
    }

    /// Whether a row can be one of these columns.
    fn fits(&self, row: Line<'_>, columns: &Columns) -> bool {
        let mut cells = row.cells();
        let all = columns.names.iter().all(|name| {
            let Some(cell) = cells.next() else { return false };
            let integer = number::integer(cell.text);
            match name.as_str() {
                "type" => match integer {
                    Some(kind) => kind >= 1 && self.types.is_none_or(|types| kind <= types),
                    None => self.labels.values().any(|label| label.as_bytes() == cell.text),
                },
                name if kind(name) == Kind::Integer => integer.is_some(),
                "diameter" | "density" | "volume" | "mass" | "edpd_temp" | "edpd_cv" | "rho" => {
                    number::real(cell.text).is_some_and(|value| value >= 0.0)
                }
                _ => number::real(cell.text).is_some(),
            }
        });
        // Bonds are between atoms of molecules.
        let bonded = self.bonds == 0.0 || columns.names.iter().any(|name| name == "mol");
        all && bonded && cells.next().is_none()
    }
}

/// Whether z is a whole number from 1 on in all rows, beside x and y that are none in any: it is
/// then no axis, but counts something, as in rows of a hybrid of styles.
fn counts(rows: &[Line<'_>], columns: &Columns) -> bool {
    let integers = |name: &str| {
        let at = columns.names.iter().position(|column| column == name);
        rows.iter().map(move |row| {
            let cell = at.and_then(|at| row.cells().nth(at));
            cell.and_then(|cell| number::integer(cell.text))
        })
    };
    let whole = integers("z").all(|value| value.is_some_and(|value| value >= 1));
    rows.len() > 1 && whole && integers("x").chain(integers("y")).all(|value| value.is_none())
}

/// The names of the columns of a row.
struct Columns {
    names: Vec<String>,
    /// Whether others follow that are not read.
    more: bool,
}

impl Columns {
    /// Those of a style, in rows of so many cells: flags may follow.
    fn of(style: &str, cells: usize) -> Self {
        let names = STYLES.iter().find(|(name, _)| *name == style).map_or("", |(_, names)| names);
        let mut names: Vec<String> = names.split(' ').map(String::from).collect();
        if cells > names.len() {
            names.extend(FLAGS.map(String::from));
        }
        Self { names, more: false }
    }

    /// Which columns change the picture: two styles with the same draw the same.
    fn matters(&self) -> Vec<Option<usize>> {
        let find = |name: &str| self.names.iter().position(|found| found == name);
        ["id", "type", "x", "y", "z", "diameter"].map(find).to_vec()
    }

    /// Where each cell goes, and the kinds of the columns beside the positions.
    fn layout(&self, labels: bool) -> (Layout, Vec<Kind>) {
        let (mut places, mut kinds) = (Vec::new(), Vec::new());
        for name in &self.names {
            let (kind, column, component) = match axis(name) {
                Some(axis) => (Kind::Finite, 0, axis),
                None => {
                    let kind = if name == "type" && labels { Kind::Word } else { kind(name) };
                    kinds.push(kind);
                    (kind, kinds.len(), 0)
                }
            };
            places.push(Place { name: format!("`{name}`"), kind, column, component });
        }
        (Layout { places, more: self.more }, kinds)
    }
}

/// Which axis a column is.
fn axis(name: &str) -> Option<usize> {
    ["x", "y", "z"].iter().position(|axis| *axis == name)
}

/// How a column other than a position is read.
fn kind(name: &str) -> Kind {
    match name {
        "id" | "mol" | "type" | "ix" | "iy" | "iz" | "etag" | "template_index"
        | "template_atom" => Kind::Integer,
        name if name.ends_with("flag") => Kind::Integer,
        _ => Kind::Real,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::particles::{
        Format, Role,
        file::tests::{centers, frame},
    };

    fn file(atoms: &str, rows: &str) -> String {
        let count = rows.lines().count();
        format!(
            "any 7 atoms # line\n\n{count} atoms\n3 bonds\n2  atom types # two\n-1 9 xlo xhi\n\
             0 8 ylo yhi\n0 6 zlo zhi\n2 -1 1.5 xy xz yz\n\nMasses\n\n1 12.011 # C\n2 1\n\n\
             {atoms}\n\n{rows}\n\nVelocities\n\n1 0 0 0\n"
        )
    }

    fn read(atoms: &str, rows: &str) -> Particles {
        // Bonds are of the styles of molecules.
        let bonds = ["# full", "# molecular"].iter().any(|style| atoms.ends_with(style));
        let file = file(atoms, rows);
        let file = if bonds { file } else { file.replace("3 bonds", "0 bonds") };
        assert!(is(file.as_bytes()));
        frame(Format::LammpsData, file, 0).unwrap_or_else(|error| panic!("{rows}: {error}"))
    }

    #[test]
    fn rows_of_a_style_are_its_columns() {
        let full = "7 1 2 -0.5 1 2.5 3 0 -1 2 # ion\n3 1 1 0.5 4 5 6 0 0 0";
        let particles = read("Atoms  # full", full);
        assert_eq!(centers(&particles), [[1.0, 2.5, 3.0], [4.0, 5.0, 6.0]]);
        let Values::Integers(ids) = &particles.role(Role::Id).unwrap().values else { panic!() };
        assert_eq!(*ids, [7, 3]);
        let get = |name: &str| particles.column(name).unwrap().values.get(0);
        assert_eq!(
            ["type", "q", "iy", "iz", "mol"].map(get),
            [Some(2.0), Some(-0.5), Some(-1.0), Some(2.0), Some(1.0)]
        );
        let cell = particles.cell.unwrap();
        assert_eq!(cell.origin, [-1.0, 0.0, 0.0]);
        assert_eq!(cell.edges, [[10.0, 0.0, 0.0], [2.0, 8.0, 0.0], [-1.0, 1.5, 6.0]]);
        assert_eq!(particles.notes, ["3 bonds were left out: only atoms are drawn"]);
        let sphere = read("Atoms # sphere", "1 1 0.5 1 1 2 3");
        assert_eq!(sphere.role(Role::Diameter).unwrap().values.get(0), Some(0.5));
        let hybrid = read("Atoms # hybrid sphere charge", "1 1 1 2 3 0.5 1 0.1");
        assert_eq!((centers(&hybrid), hybrid.notes.len()), (vec![[1.0, 2.0, 3.0]], 1));
    }

    /// Without the name of a style, one is taken where nothing that is drawn depends on it.
    #[test]
    fn styles_are_known_by_their_rows() {
        for (rows, style) in [
            ("1 1 1 2 3", "atomic"),
            ("1 1 0.5 2.5 3 0 0 0", "atomic"),
            ("1 1 -0.5 1 2 3", "charge"),
            ("1 9 2 1 2 3", "molecular"),
            ("1 2 1 1 2.5 3\n2 3 1 1 2.5 3", "molecular"),
            ("1 9 2 0.1 1 2 3", "full"),
            ("1 3 2 0.5 1.5 2 3 0 1 0", "full"),
        ] {
            let particles = read("Atoms", rows);
            assert!(particles.notes[0].contains(&format!("taken as {style}")), "{rows}");
        }
        for (rows, styles) in [
            ("1 1 1 1 2 3", "charge, molecular, bond, angle, dpd, mdpd"),
            ("1 1 0.5 0.5 1 2 3", "sphere, edpd, peri"),
            ("1 1 1 0.5 1 2 3", "full, sphere, ellipsoid, body, edpd, peri"),
        ] {
            let text = file("Atoms", rows).replace("3 bonds", "0 bonds");
            let error = frame(Format::LammpsData, text, 0).expect_err(rows);
            assert!(error.message().contains(&format!("the styles {styles}")), "{error}");
            assert!(error.to_string().contains("Atoms # full"), "{error}");
        }
        // Bonds, what is negative, and what is no axis tell.
        let bonded = frame(Format::LammpsData, file("Atoms", "1 1 1 0.5 1 2 3"), 0).unwrap();
        assert!(bonded.notes[0].contains("taken as full"), "{:?}", bonded.notes);
        let negative = read("Atoms", "1 1 1 -0.5 1 2 3");
        assert!(negative.notes[0].contains("taken as full"), "{:?}", negative.notes);
        let comment = read("Atoms # I like comments", "1 1 0.5 2.5 3");
        assert_eq!(comment.notes.len(), 2, "{:?}", comment.notes);
        let hybrid = file("Atoms", "1 1 1.5 2.5 3.5 1\n2 1 1.5 2.5 3.5 2");
        let hybrid = frame(Format::LammpsData, hybrid.replace("3 bonds", "0 bonds"), 0);
        assert!(hybrid.expect_err("no z").message().contains("of no style"));
    }

    #[test]
    fn labels_are_types() {
        let labels = "Atom Type Labels\n\n1 C\n2 Hc\n\nAtoms # atomic";
        let particles = read(labels, "1 Hc 1 2 3\n2 1 1 2 3\n3 2 1 2 3");
        let Values::Words(words) = &particles.role(Role::Type).unwrap().values else { panic!() };
        assert_eq!([0, 1, 2].map(|at| words.get(at)), ["Hc", "C", "Hc"]);
    }

    #[test]
    fn boxes_can_point_anywhere() {
        let text = "\n1 atoms\n1 2 0 avec\n0 3 0 bvec\n0 1 4 cvec\n1 1 1 abc origin\n\
                    Atoms # atomic\n\n1 1 0 0 0";
        let cell = frame(Format::LammpsData, text, 0).unwrap().cell.unwrap();
        let edges = [[1.0, 2.0, 0.0], [0.0, 3.0, 0.0], [0.0, 1.0, 4.0]];
        assert_eq!(cell, Cell { origin: [1.0; 3], edges });
        let none = frame(Format::LammpsData, "\n0 atoms\n", 0).unwrap();
        assert!(none.is_empty() && none.cell.is_none());
    }

    #[test]
    fn what_is_wrong_is_pointed_at() {
        let whole = file("Atoms # atomic", "1 1 1 2 3\n2 1 1 2 3");
        for (old, new, line, words) in [
            ("2 1 1 2 3", "2 1 1 2 x", Some(19), "`x` stands where `z` is expected"),
            ("2 1 1 2 3", "2 1 1 2 inf", Some(19), "not finite"),
            ("2 1 1 2 3", "2 1 1 2", Some(19), "has 4 cells, but 5"),
            ("2 1 1 2 3", "2 H 1 2 3", Some(19), "`H` stands where `type` is expected"),
            ("\n2 1 1 2 3", "", Some(19), "the line is blank"),
            ("\n2 atoms", "\n99 atoms", Some(3), "99 atoms are announced, but 6 lines follow"),
            ("\n2 atoms", "\n-2 atoms", Some(3), "the number of atoms"),
            ("\n2 atoms", "\n", None, "no line with the number of atoms"),
            ("# atomic\n\n", "# atomic\n", Some(17), "is not blank"),
            ("# atomic", "# charge", Some(18), "have 6 cells, or 9 with image flags"),
            ("Atoms", "Atom", Some(3), "no section `Atoms`"),
            ("-1 9 xlo", "9 xlo", Some(6), "2 finite numbers"),
        ] {
            let text = whole.replacen(old, new, 1);
            assert_ne!(text, whole, "{old}");
            let error = frame(Format::LammpsData, text, 0).expect_err(new);
            assert_eq!(error.line(), line, "{error}");
            assert!(error.message().contains(words), "{error}");
        }
        for other in ["5\n5 atoms\nC 0 0 0\n", "title\n5\n", "a\n1 2 3\n", "", "# x y z\n1 2 3\n"] {
            assert!(!is(other.as_bytes()), "{other:?}");
        }
    }
}
