//! Tables with a line of names: CSV, TSV, and columns between blanks.
//!
//! The format: RFC 4180, and what spreadsheets, pandas, ParaView, OVITO and `numpy.savetxt` write.
//! The names say which columns are positions, in any case of letters and with a unit in brackets
//! behind them: `x y z`, or one of [`PREFIXES`] and `x y z` or `0 1 2` behind `_`, `.`, `:` or a
//! blank, as in `Points:0`. What parts the cells is what parts these names. Where that is `;` or a
//! tab, `1,5` is 1.5. A quoted cell ends on its line.

use std::{
    borrow::Cow,
    ops::Range,
    sync::atomic::{AtomicBool, AtomicU8, Ordering::Relaxed},
};

use super::{
    Column, Data, Particles, Reader, Role,
    data::{Line, is_blank},
    number,
    rows::{self, Row, Store, Which},
};
use crate::input::report::Fault;
use planisphere_core::{drawing::Control, scene::Reals, text};

/// Columns, at most.
const MOST: usize = 10_000;

/// Rows, and bytes of them, from which it is seen what the columns are.
const SEEN: (usize, usize) = (256, 1 << 20);

/// What may stand before the axis in the name of a column of positions.
const PREFIXES: [&str; 8] =
    ["position", "positions", "pos", "points", "center", "centre", "coordinates", "coord"];

/// What to do about a table without names.
const NAME_THEM: &str = "put a line of names above the rows, such as x,y,z,radius";

/// Whether bytes begin as such a table does.
pub(super) fn is(beginning: &[u8]) -> bool {
    let Ok(table) = Table::read_names(beginning) else { return false };
    // Between blanks, words such as `x y z` may be prose: the next line must be a row of these.
    let mut at = table.rows;
    while let Some(line) = Line::at(beginning, at).filter(Line::is_blank) {
        at = line.next;
    }
    let fits = |line: Line<'_>| {
        split(line.text, table.by).len() == table.columns.len() && is_numbers(line, table.by)
    };
    table.by != By::Blanks || Line::at(beginning, at).is_some_and(fits)
}

/// A reader.
pub(super) fn open(data: &Data) -> Result<Box<dyn Reader>, Fault> {
    Ok(Box::new(Table::read_names(data.as_slice())?))
}

/// What parts the cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum By {
    /// This byte.
    Byte(u8),
    /// Any number of blanks.
    Blanks,
}

/// In the order in which they are tried.
const ALL: [By; 4] = [By::Byte(b','), By::Byte(b';'), By::Byte(b'\t'), By::Blanks];

impl By {
    /// Whether a comma can be in a number.
    fn has_decimal_commas(self) -> bool {
        matches!(self, By::Byte(b';' | b'\t'))
    }

    /// Whether a byte may stand around a cell, and is no part of it.
    #[inline]
    fn pads(self, byte: u8) -> bool {
        is_blank(byte) && self != By::Byte(byte)
    }
}

/// What the names say.
#[derive(Debug)]
struct Table {
    by: By,
    columns: Vec<Named>,
    /// Whether the line of names ends with what parts them.
    open: bool,
    /// Where the rows begin.
    rows: usize,
}

/// A column.
#[derive(Clone, Debug)]
struct Named {
    name: String,
    role: Role,
    /// Which axis it is, if it is one.
    axis: Option<usize>,
}

impl Reader for Table {
    fn frame(&self, data: &Data, at: usize) -> Result<Option<Range<usize>>, Fault> {
        // One frame: the rows.
        Ok((at == 0).then(|| self.rows..data.len()))
    }

    fn read(
        &self,
        data: &Data,
        frame: Range<usize>,
        control: &Control,
    ) -> Result<Particles, Fault> {
        let mut kinds = self.first_kinds(data.as_slice(), frame.start);
        let first = kinds.clone();
        loop {
            let rows = Rows::new(self, kinds);
            let mut stores = rows.stores();
            // Spreadsheets write separators alone where rows were.
            let nothing = |byte: &u8| is_blank(*byte) || matches!(byte, b',' | b';');
            let is_row = |line: Line<'_>| !line.text.iter().all(nothing);
            let parse = |line: Line<'_>, row: &mut Row<'_, '_>| rows.parse(line, row);
            let which = Which::Those(&is_row);
            rows::read(data, frame.clone(), &which, &mut stores, control, parse)?;
            let wanted: Vec<Kind> =
                rows.wanted.iter().map(|kind| Kind::of(kind.load(Relaxed))).collect();
            if wanted == rows.kinds {
                return Ok(rows.finish(stores, &first));
            }
            // Later rows disagree with the first: all of them are known now.
            kinds = wanted;
        }
    }
}

/// What the cells of a column are: each kind holds those before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Kind {
    Integer,
    Real,
    Word,
}

impl Kind {
    fn of(number: u8) -> Self {
        match number {
            0 => Self::Integer,
            1 => Self::Real,
            _ => Self::Word,
        }
    }
}

impl Table {
    /// Finds the line of names.
    fn read_names(whole: &[u8]) -> Result<Self, Fault> {
        if whole.starts_with(b"\xff\xfe") || whole.starts_with(b"\xfe\xff") {
            return Err(Fault::whole("the text is UTF-16", "save it as UTF-8"));
        }
        let mut at = 0;
        let mut tried: &[By] = &ALL;
        let mut commented = None;
        while let Some(line) = Line::at(whole, at) {
            at = line.next;
            let text = line.text.trim_ascii();
            if let Some(comment) = text.strip_prefix(b"#") {
                let names = tried.iter().find_map(|by| Self::named(comment, *by, at));
                commented = names.or(commented);
            } else if let Some(by) = text.strip_prefix(b"sep=") {
                // A spreadsheet's.
                let chosen =
                    ALL.iter().position(|all| by.first().is_some_and(|by| *all == By::Byte(*by)));
                tried = chosen.map_or(tried, |chosen| &ALL[chosen..=chosen]);
            } else if !text.is_empty() {
                if let Some(found) = tried.iter().find_map(|by| Self::named(line.text, *by, at)) {
                    return found.checked(line);
                }
                let Some(mut table) = commented else { return Err(no_names(line)) };
                // What parts the rows may be another thing than what parts these names.
                let fits = |by: &&By| split(line.text, **by).len() == table.columns.len();
                if !fits(&&table.by)
                    && let Some(by) = ALL.iter().find(fits)
                {
                    table.by = *by;
                }
                table.rows = line.start;
                return table.checked(line);
            }
        }
        let Some(table) = commented else {
            return Err(Fault::whole("there is no line of names, and no row", NAME_THEM));
        };
        Ok(table)
    }

    /// The columns of a line of names, if three of them are positions.
    fn named(names: &[u8], by: By, rows: usize) -> Option<Self> {
        let mut cells = split(names, by);
        let open = cells.len() > 1
            && cells.last().is_some_and(|last| last.text.is_empty() && last.next.is_none());
        if open {
            cells.pop();
        }
        let names: Vec<String> = cells
            .iter()
            .map(|cell| String::from_utf8_lossy(&cell.content()).into_owned())
            .collect();
        let plain: Vec<String> = names.iter().map(|name| plain(name)).collect();
        let axes = axes(&plain)?;
        let has = |name: &str| plain.iter().any(|plain| plain == name);
        let channels = has("r") && has("g") && has("b");
        let role = |plain: &str| match plain {
            "r" if channels => Role::Channel(0),
            "g" if channels => Role::Channel(1),
            "b" if channels => Role::Channel(2),
            "r" => Role::Radius,
            name => Role::of_name(name),
        };
        let column = |(at, name): (usize, String)| Named {
            role: role(&plain[at]),
            axis: axes.iter().position(|axis| *axis == at),
            name,
        };
        let columns = names.into_iter().enumerate().map(column).collect();
        Some(Self { by, columns, open, rows })
    }

    /// Refuses what cannot be read, however the rows are.
    fn checked(self, line: Line<'_>) -> Result<Self, Fault> {
        if line.text.contains(&b'\r') {
            return Err(lone_ends(line));
        }
        if self.columns.len() > MOST {
            return Err(Fault::new(
                format!("there are more than {MOST} columns"),
                line.start..line.start,
                "here",
                "leave out those that nothing is drawn of",
            ));
        }
        for (axis, name) in ["x", "y", "z"].iter().enumerate() {
            let of_axis: Vec<&Named> =
                self.columns.iter().filter(|column| plain(&column.name) == *name).collect();
            if of_axis.len() > 1 && of_axis.iter().any(|column| column.axis == Some(axis)) {
                return Err(Fault::new(
                    format!("{} columns are called `{name}`", of_axis.len()),
                    line.span(),
                    "in the names",
                    "give each column a name of its own",
                ));
            }
        }
        Ok(self)
    }

    /// What the first rows say that the columns are.
    fn first_kinds(&self, whole: &[u8], start: usize) -> Vec<Kind> {
        let mut kinds: Vec<Option<Kind>> = vec![None; self.columns.len()];
        let (mut at, mut rows) = (start, 0);
        while rows < SEEN.0
            && at - start < SEEN.1
            && let Some(line) = Line::at(whole, at)
        {
            at = line.next;
            if line.is_blank() {
                continue;
            }
            rows += 1;
            for (kind, cell) in kinds.iter_mut().zip(split(line.text, self.by)) {
                let content = cell.content();
                if !content.is_empty() {
                    *kind = (*kind).max(Some(kind_of(&content, self.by)));
                }
            }
        }
        let settled = |(column, kind): (&Named, Option<Kind>)| match kind {
            _ if column.axis.is_some() => Kind::Real,
            // Without any value there is nothing to miss.
            None if !column.is_number() => Kind::Word,
            Some(Kind::Word) | None if column.is_number() => Kind::Real,
            kind => kind.unwrap_or(Kind::Word),
        };
        self.columns.iter().zip(kinds).map(settled).collect()
    }
}

impl Named {
    /// Whether it must be a number.
    fn is_number(&self) -> bool {
        use Role::{AtomicNumber, Channel, Diameter, Radius};
        self.axis.is_some() || matches!(self.role, Radius | Diameter | Channel(_) | AtomicNumber)
    }
}

/// A name without its unit, in lower case.
fn plain(name: &str) -> String {
    let end = name.find(['(', '[']).filter(|at| *at > 0).unwrap_or(name.len());
    name[..end].trim().to_ascii_lowercase()
}

/// Which columns are x, y and z.
fn axes(plain: &[String]) -> Option<[usize; 3]> {
    let find = |name: &str| plain.iter().position(|found| found == name);
    let all = |names: [String; 3]| {
        let [x, y, z] = names.each_ref().map(|name| find(name));
        Some([x?, y?, z?])
    };
    if let Some(found) = all(["x", "y", "z"].map(String::from)) {
        return Some(found);
    }
    for prefix in PREFIXES {
        for between in ["_", ".", ":", " "] {
            for axes in [["x", "y", "z"], ["0", "1", "2"]] {
                if let Some(found) = all(axes.map(|axis| format!("{prefix}{between}{axis}"))) {
                    return Some(found);
                }
            }
        }
    }
    None
}

/// Whether a line has a number.
fn is_numbers(line: Line<'_>, by: By) -> bool {
    let cells = split(line.text, by);
    cells.iter().any(|cell| kind_of(&cell.content(), by) < Kind::Word)
}

fn lone_ends(line: Line<'_>) -> Fault {
    Fault::new(
        "the lines end with CR alone",
        line.start..line.start,
        "here",
        "convert the ends of lines: tr '\\r' '\\n'",
    )
}

fn no_names(line: Line<'_>) -> Fault {
    if line.text.contains(&b'\r') {
        return lone_ends(line);
    }
    if ALL.iter().any(|by| is_numbers(line, *by)) {
        return Fault::new(
            "the first line has numbers where the names of the columns are needed",
            line.span(),
            "not names",
            NAME_THEM,
        );
    }
    let found = text::within(&text::value(&line.words()), 200);
    Fault::new(
        format!("no three columns are called x, y and z: {found}"),
        line.span(),
        "no x y z, nor Points:0 Points:1 Points:2",
        "name the three columns of the positions x, y and z",
    )
}

/// What kind a cell is.
fn kind_of(content: &[u8], by: By) -> Kind {
    match real(content, by) {
        _ if number::integer(content).is_some() => Kind::Integer,
        Some(_) => Kind::Real,
        None => Kind::Word,
    }
}

/// A real number, which may have a comma where these can be.
fn real(content: &[u8], by: By) -> Option<f64> {
    let found = number::real(content);
    if found.is_some() || !by.has_decimal_commas() {
        return found;
    }
    let comma = memchr::memchr(b',', content)?;
    let mut copy = [0; 64];
    let copy = copy.get_mut(..content.len())?;
    copy.copy_from_slice(content);
    copy[comma] = b'.';
    number::real(copy)
}

/// A cell: what stands between two separators, without the blanks around it.
#[derive(Clone, Copy, Debug)]
struct Cell<'a> {
    /// With its quotes.
    text: &'a [u8],
    /// Where it begins in the line.
    start: usize,
    /// Whether it is in quotes.
    quoted: bool,
    /// Where the next begins; none behind the last.
    next: Option<usize>,
}

impl<'a> Cell<'a> {
    /// The cell at a place of a line; none where quotes do not end.
    fn at(line: &'a [u8], at: usize, by: By) -> Option<Self> {
        let pad = line[at..].iter().take_while(|byte| by.pads(**byte)).count();
        let start = at + pad;
        let rest = &line[start..];
        let quoted = rest.first() == Some(&b'"');
        let mut end = start + if quoted { closing(rest)? } else { 0 };
        end += match by {
            By::Byte(byte) => memchr::memchr(byte, &line[end..]).unwrap_or(line.len() - end),
            By::Blanks => super::data::word(&line[end..]),
        };
        let behind = line[end..].iter().take_while(|byte| by.pads(**byte)).count();
        let next = match by {
            By::Byte(_) => line.get(end).map(|_| end + 1),
            By::Blanks => Some(end + behind).filter(|next| *next < line.len()),
        };
        let text = &line[start..end];
        let padded = text.iter().rev().take_while(|byte| by.pads(**byte)).count();
        Some(Self { text: &text[..text.len() - padded], start, quoted, next })
    }

    /// What it says.
    fn content(&self) -> Cow<'a, [u8]> {
        let inner = self.text.strip_prefix(b"\"").and_then(|text| text.strip_suffix(b"\""));
        let Some(inner) = inner.filter(|_| self.quoted) else { return Cow::Borrowed(self.text) };
        if memchr::memchr(b'"', inner).is_none() {
            return Cow::Borrowed(inner);
        }
        let mut content = Vec::with_capacity(inner.len());
        let mut doubled = false;
        for byte in inner {
            doubled = *byte == b'"' && !doubled;
            if !doubled {
                content.push(*byte);
            }
        }
        Cow::Owned(content)
    }
}

/// Bytes of a quoted cell, up to its closing quote; a doubled one is none.
fn closing(text: &[u8]) -> Option<usize> {
    let mut at = 1;
    loop {
        at += memchr::memchr(b'"', text.get(at..)?)? + 1;
        match text.get(at) {
            Some(b'"') => at += 1,
            _ => return Some(at),
        }
    }
}

/// The cells of a line; no more than there may be columns, and one.
fn split(line: &[u8], by: By) -> Vec<Cell<'_>> {
    let mut cells = Vec::new();
    let mut at = Some(0);
    while let Some(start) = at
        && cells.len() <= MOST
        && let Some(cell) = Cell::at(line, start, by)
    {
        at = cell.next;
        cells.push(cell);
    }
    cells
}

/// Rows that are read, the columns being of some kinds.
struct Rows<'a> {
    table: &'a Table,
    kinds: Vec<Kind>,
    /// Which store each column goes to, and which number of a row of it.
    places: Vec<(usize, usize)>,
    /// The kinds that the cells so far need.
    wanted: Vec<AtomicU8>,
    /// Whether a comma was in a number.
    commas: AtomicBool,
}

impl<'a> Rows<'a> {
    fn new(table: &'a Table, kinds: Vec<Kind>) -> Self {
        let mut stores = 0;
        let place = |column: &Named| match column.axis {
            Some(axis) => (0, axis),
            None => {
                stores += 1;
                (stores, 0)
            }
        };
        let places = table.columns.iter().map(place).collect();
        let wanted = kinds.iter().map(|kind| AtomicU8::new(*kind as u8)).collect();
        Self { table, kinds, places, wanted, commas: AtomicBool::new(false) }
    }

    fn stores(&self) -> Vec<Store> {
        let others = self.table.columns.iter().zip(&self.kinds);
        let others = others.filter(|(column, _)| column.axis.is_none());
        let others = others.map(|(_, kind)| match kind {
            Kind::Integer => Store::integers(),
            Kind::Real => Store::reals(1),
            Kind::Word => Store::words(),
        });
        std::iter::once(Store::reals(3)).chain(others).collect()
    }

    /// Reads a line into a row.
    fn parse(&self, line: Line<'_>, row: &mut Row<'_, '_>) -> Result<(), Fault> {
        let mut at = Some(0);
        for column in 0..self.table.columns.len() {
            let Some(start) = at else { return Err(self.too_few(line, column)) };
            if let Some(next) = self.quick(line.text, start, column, row) {
                at = next;
                continue;
            }
            let open = || {
                let fix = "close the quotes on the line; a cell of several lines is not read";
                let span = line.start + start..line.span().end;
                Fault::new("a quoted cell does not end on its line", span, "no end", fix)
            };
            let cell = Cell::at(line.text, start, self.table.by).ok_or_else(open)?;
            self.cell(cell, line.start, column, row)?;
            at = cell.next;
        }
        match at {
            Some(at) if !self.table.open || !line.text[at..].trim_ascii().is_empty() => {
                Err(self.too_many(line, at))
            }
            _ => Ok(()),
        }
    }

    /// Reads a number without quotes, and says where the next cell begins; nothing where a longer
    /// look is needed.
    #[inline]
    fn quick(
        &self,
        line: &[u8],
        start: usize,
        column: usize,
        row: &mut Row<'_, '_>,
    ) -> Option<Option<usize>> {
        let at = self.padded(line, start);
        let (store, component) = self.places[column];
        match self.kinds[column] {
            Kind::Real => {
                let (value, length) = fast_float2::parse_partial::<f64, _>(&line[at..]).ok()?;
                let next = self.behind(line, at + length)?;
                // A store of three is that of the positions, which are finite.
                (value.is_finite() || store > 0).then(|| row.set_real(store, component, value))?;
                Some(next)
            }
            Kind::Integer => {
                let digits = line[at..].iter().take(18).take_while(|byte| byte.is_ascii_digit());
                let (length, value) = digits.fold((0, 0), |(length, value), digit| {
                    (length + 1, 10 * value + i64::from(digit - b'0'))
                });
                let next = self.behind(line, at + length).filter(|_| length > 0)?;
                row.set_integer(store, component, value);
                Some(next)
            }
            Kind::Word => None,
        }
    }

    /// The first byte that is no blank around a cell.
    #[inline]
    fn padded(&self, line: &[u8], at: usize) -> usize {
        at + line[at..].iter().take_while(|byte| self.table.by.pads(**byte)).count()
    }

    /// Where the next cell begins, if a cell ends here.
    #[inline]
    fn behind(&self, line: &[u8], end: usize) -> Option<Option<usize>> {
        match (line.get(end), self.table.by) {
            (None, _) => Some(None),
            (Some(byte), By::Byte(wanted)) if *byte == wanted => Some(Some(end + 1)),
            (Some(byte), by) if by.pads(*byte) => {
                let next = self.padded(line, end);
                match (line.get(next), by) {
                    (None, _) => Some(None),
                    (_, By::Blanks) => Some(Some(next)),
                    (Some(byte), By::Byte(wanted)) => (*byte == wanted).then_some(Some(next + 1)),
                }
            }
            _ => None,
        }
    }

    /// Reads a cell into its column, or says that the column is of another kind.
    fn cell(
        &self,
        cell: Cell<'_>,
        line_start: usize,
        column: usize,
        row: &mut Row<'_, '_>,
    ) -> Result<(), Fault> {
        let (store, component) = self.places[column];
        let named = &self.table.columns[column];
        let content = cell.content();
        let kind = self.kinds[column];
        if kind == Kind::Word {
            row.set_word(store, &content);
            return Ok(());
        }
        let name = || format!("`{}`", text::value(&named.name));
        let from = line_start + cell.start;
        let span = from..from + cell.text.len();
        if content.is_empty() {
            return Err(Fault::new(
                format!("{} has a gap: a number is expected here", name()),
                span,
                "nothing",
                "write the number, or leave the row out",
            ));
        }
        if kind == Kind::Integer
            && let Some(value) = number::integer(&content)
        {
            row.set_integer(store, component, value);
            return Ok(());
        }
        let Some(value) = real(&content, self.table.by) else {
            if named.is_number() {
                return Err(number::not_a_number(&name(), &content, span));
            }
            self.wanted[column].fetch_max(Kind::Word as u8, Relaxed);
            return Ok(());
        };
        if named.axis.is_some() && !value.is_finite() {
            return Err(number::not_finite(&name(), &content, span));
        }
        if memchr::memchr(b',', &content).is_some() {
            self.commas.store(true, Relaxed);
        }
        match kind {
            Kind::Real => row.set_real(store, component, value),
            _ => _ = self.wanted[column].fetch_max(Kind::Real as u8, Relaxed),
        }
        Ok(())
    }

    fn too_few(&self, line: Line<'_>, found: usize) -> Fault {
        let end = line.span().end;
        let (wanted, name) = (self.table.columns.len(), &self.table.columns[found].name);
        Fault::new(
            format!("the row has {found} cells, but there are {wanted} columns"),
            end..end,
            format!("no `{}`", text::value(name)),
            "correct the row, or write the file again",
        )
    }

    fn too_many(&self, line: Line<'_>, at: usize) -> Fault {
        let found = split(line.text, self.table.by).len();
        let comma = self.table.by == By::Byte(b',');
        Fault::new(
            format!(
                "the row has {found} cells, but there are {} columns",
                self.table.columns.len()
            ),
            line.start + at..line.span().end.max(line.start + at),
            "too many",
            match comma {
                true => "correct the row; where commas are in numbers, part the cells with `;`",
                false => "correct the row, or the names above it",
            },
        )
    }

    /// The particles; `first` are the kinds of the first rows.
    fn finish(self, stores: Vec<Store>, first: &[Kind]) -> Particles {
        let mut notes = Vec::new();
        if self.commas.load(Relaxed) {
            notes.push("commas in numbers are read as decimal points".into());
        }
        for (column, (first, kind)) in first.iter().zip(&self.kinds).enumerate() {
            if *kind == Kind::Word && first < kind {
                let name = text::value(&self.table.columns[column].name);
                notes.push(format!("`{name}` is kept as words: not all of it is numbers"));
            }
        }
        let mut stores = stores.into_iter();
        let centers = stores.next().map_or(Vec::new(), Store::into_reals);
        let others = self.table.columns.iter().filter(|column| column.axis.is_none());
        let columns = others.zip(stores).map(|(named, store)| {
            Column::named(named.name.clone(), store.into_values()).with_role(named.role)
        });
        let columns = columns.collect();
        let names = [0, 1, 2].map(|axis| {
            let named = self.table.columns.iter().find(|column| column.axis == Some(axis));
            named.map_or(String::new(), |column| text::value(&column.name))
        });
        let centers = Reals::F64(centers.into());
        Particles { centers, centers_from: names.join(" "), columns, cell: None, notes }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::particles::{
        Format, Values,
        file::tests::{centers, frame},
    };

    fn read(text: &str) -> Particles {
        frame(Format::Csv, text, 0).unwrap_or_else(|error| panic!("{text:?}: {error}"))
    }

    #[test]
    fn names_say_what_parts_the_cells() {
        for text in [
            "x,y,z,radius\n1.5,-2,3e0,.5\n",
            "\u{feff}X;Y;Z;Radius\r\n1,5;-2;3;0,5\r\n\r\n",
            "radius\ty\tx\tz\n0,5\t-2\t1,5\t3\n",
            "  x  y z   radius\n\n  1.5 -2\t3 0.5  \n",
            "# by hand\n# x y z radius\n1.5 -2 3 0.5\n",
            "#x y z radius\n1.5,-2,3,0.5\n",
            "sep=;\nx;y;z;r\n1.5;-2;3;0.5",
            "\"x\",\"y\" , \"z\",\"a, \"\"b\"\"\",\"radius [nm]\"\n\"1.5\",-2 , 3,\"q,\",\"0.5\"\n",
            "radius,Points:0,Points:1,Points:2\n0.5,1.5,-2,3\n",
            "Position.X Position.Y Position.Z Radius\n1.5 -2 3 0.5\n",
            "x (nm),y (nm),z (nm),r,\n1.5,-2,3,0.5,\n",
            "x,y,z,diameter,type\n1.5,-2,3,0.5,A\n",
        ] {
            assert!(Format::of_content(text.as_bytes()) == Some(Format::Csv), "{text:?}");
            let particles = read(text);
            assert_eq!(centers(&particles), [[1.5, -2.0, 3.0]], "{text:?}");
            let size = particles.role(Role::Radius).or(particles.role(Role::Diameter));
            let values = &size.unwrap_or_else(|| panic!("{text:?}")).values;
            assert_eq!(values.get(0), Some(0.5), "{text:?}");
            assert_eq!(particles.notes.len(), usize::from(text.contains("1,5")), "{text:?}");
        }
        let quoted = read("x,y,z,\"a \"\"b\"\"\"\n1,2,3,\"say \"\"no, no\"\"\"\n");
        let Values::Words(words) = &quoted.column("a \"b\"").unwrap().values else { panic!() };
        assert_eq!(words.get(0), "say \"no, no\"");
        for other in ["3\nx y z\nH 1 2 3\n", "x y z of a run\n\n3 atoms\n", "x = 1\n", "ply\n"] {
            assert!(!is(other.as_bytes()), "{other:?}");
        }
    }

    #[test]
    fn channels_are_three() {
        let particles = read("r,g,b,x,y,z\n1,2,3,4,5,6\n");
        assert_eq!(particles.column("g").unwrap().role, Role::Channel(1));
        assert!(particles.role(Role::Radius).is_none());
        assert_eq!(read("r,b,x,y,z\n1,2,3,4,5\n").column("r").unwrap().role, Role::Radius);
    }

    /// A column is what its last rows are as well.
    #[test]
    fn later_rows_widen_a_column() {
        let mut text = String::from("x,y,z,n,q,w,empty,#c\n");
        for row in 0..5000 {
            text += &format!("{row},0,0.1,{row},{row},{row},,#ff0000\n");
        }
        let same = read(&text);
        for name in ["n", "q", "w"] {
            assert!(matches!(same.column(name).unwrap().values, Values::Integers(_)), "{name}");
        }
        text += "0,0,0,9007199254740993,0.5,word,,#00ff00\n";
        let particles = read(&text);
        let Values::Integers(n) = &particles.column("n").unwrap().values else { panic!() };
        assert_eq!((n[7], n[5000]), (7, 9007199254740993));
        let Values::Reals(q) = &particles.column("q").unwrap().values else { panic!() };
        assert_eq!((q.get(7), q.get(5000)), (7.0, 0.5));
        let Values::Words(w) = &particles.column("w").unwrap().values else { panic!() };
        assert_eq!((w.get(7), w.get(5000)), ("7", "word"));
        let Values::Words(c) = &particles.column("#c").unwrap().values else { panic!() };
        assert_eq!((c.get(0), c.get(5000), particles.len()), ("#ff0000", "#00ff00", 5001));
        assert_eq!(particles.notes, ["`w` is kept as words: not all of it is numbers"]);
    }

    #[test]
    fn what_is_wrong_is_pointed_at() {
        for (text, at, words) in [
            ("x,y,z,r\n1,2,3,4\n1,,3,4\n", Some((3, 3)), "`y` has a gap"),
            ("x,y,z,r\n1,2,3,4\n1,2,3, \n", Some((3, 8)), "`r` has a gap"),
            ("x,y,z,q\n1,2,3,4\n1,2,3,\n", Some((3, 7)), "`q` has a gap"),
            ("x,y,z,r\n1,2,3\n", Some((2, 6)), "the row has 3 cells, but there are 4 columns"),
            ("x,y,z\n1,5,2,3\n", Some((2, 7)), "the row has 4 cells, but there are 3 columns"),
            ("x y z\n1 2 3 4\n", Some((2, 7)), "the row has 4 cells"),
            ("x,y,z\n1,2,x\n", Some((2, 5)), "`x` stands where `z` is expected"),
            ("x;y;z\n1.234,5;2;3\n", Some((2, 1)), "`1.234,5` stands"),
            ("x,y,z\n1,2,nan\n", Some((2, 5)), "not finite"),
            ("x,y,z,r\n1,2,3,0.5cm\n", Some((2, 7)), "`0.5cm` stands where `r` is expected"),
            ("x,y,z,w\n1,2,3,\"a\nb\"\n", Some((2, 7)), "does not end on its line"),
            ("1,2,3\n4,5,6\n", Some((1, 1)), "has numbers where the names"),
            ("a,b,c\n4,5,6\n", Some((1, 1)), "no three columns are called"),
            ("x,X,y,z\n1,2,3,4\n", Some((1, 1)), "2 columns are called `x`"),
            ("x,y,z\r1,2,3\r", None, "CR alone"),
            ("\u{feff}\n# \n", None, "no line of names"),
        ] {
            let error = frame(Format::Csv, text, 0).expect_err(text);
            let place = error.line().zip(error.column());
            assert!(at.is_none() || place == at, "{error}");
            assert!(error.message().contains(words), "{error}");
        }
        let wide = "x,y,z".to_owned() + &",".repeat(20_000) + "a\n";
        let error = frame(Format::Csv, wide, 0).expect_err("wide");
        assert!(error.message().contains("10000 columns"), "{error}");
    }
}
