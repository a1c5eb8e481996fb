//! PLY files, the Stanford polygon format: the vertices, as text or as numbers in either order of
//! bytes.
//!
//! The format: Greg Turk, "The PLY Polygon File Format" (1994). A header of lines names elements
//! and their properties; the rows of each element follow in that order. Only the rows of `vertex`
//! are read; what comes before them is walked over, and what comes after them is not looked at.
//!
//! `radius` is a radius (MeshLab and programs of surfels write it so), and so is `pscale`
//! (Houdini). `scale` means the factor of a copied shape to some and a logarithm to others: it
//! stays a column. CloudCompare writes `scalar_` before the names that a person has given.

use std::ops::Range;

use super::{
    Column, Data, Particles, Reader, Role, Values,
    data::Line,
    number,
    records::{self, Form, Records, Target},
    rows::{self, Kind, Layout, Place, Row, Store, Which},
};
use crate::{
    input::report::Fault,
    npy::number::{Kind as NumberKind, Number},
};
use planisphere_core::{drawing::Control, scene::Reals, text};

/// Bytes of a header, at most: those of real files are some hundred.
const LONGEST: usize = 1 << 20;

/// What to do about a file that ends too early.
const WRITE_AGAIN: &str = "wait until the file is written, or write it again";

/// Whether bytes begin as a PLY file does.
pub(super) fn is(beginning: &[u8]) -> bool {
    beginning.starts_with(b"ply\n") || beginning.starts_with(b"ply\r")
}

/// A reader.
pub(super) fn open(data: &Data) -> Result<Box<dyn Reader>, Fault> {
    Ok(Box::new(Ply::read_header(data)?))
}

/// What a header says.
#[derive(Debug)]
struct Ply {
    /// Whether the rows are text.
    ascii: bool,
    elements: Vec<Element>,
    /// Which of them has the vertices.
    vertex: usize,
    /// Where the rows of the first element begin.
    body: usize,
}

/// An element: a table.
#[derive(Debug)]
struct Element {
    name: String,
    count: usize,
    /// The line that names it.
    span: Range<usize>,
    properties: Vec<Property>,
}

/// A property: a column.
#[derive(Debug)]
struct Property {
    name: String,
    number: Number,
    /// The type of the count that comes before each list; none where it is no list.
    list: Option<Number>,
}

impl Reader for Ply {
    fn frame(&self, data: &Data, at: usize) -> Result<Option<Range<usize>>, Fault> {
        // One frame: the rows of the vertices.
        if at > 0 {
            return Ok(None);
        }
        let (mut start, mut end) = (self.body, self.body);
        for element in &self.elements[..=self.vertex] {
            start = end;
            end = match self.ascii {
                true => lines_end(data, start, element)?,
                false => element.end(data.as_slice(), start)?,
            };
        }
        if self.ascii {
            start = first_line(data, start);
        }
        Ok(Some(start..end.max(start)))
    }

    fn read(
        &self,
        data: &Data,
        frame: Range<usize>,
        control: &Control,
    ) -> Result<Particles, Fault> {
        let plan = Plan::of(self.vertices())?;
        let values = match self.ascii {
            true => plan.read_text(data, frame, control)?,
            false => plan.read_numbers(data, frame, control)?,
        };
        plan.finish(values, self)
    }
}

impl Ply {
    fn vertices(&self) -> &Element {
        &self.elements[self.vertex]
    }

    fn read_header(data: &Data) -> Result<Self, Fault> {
        let bytes = data.as_slice();
        let bytes = &bytes[..bytes.len().min(LONGEST)];
        // A lone CR ends the lines of old Mac files; a byte of LF behind the header is data there.
        let lone = bytes.starts_with(b"ply\r") && bytes.get(4) != Some(&b'\n');
        let (mut elements, mut encoding): (Vec<Element>, _) = (Vec::new(), None);
        let mut at = 0;
        loop {
            let Some(line) = header_line(bytes, at, lone) else {
                return Err(Fault::new(
                    "the header has no end: a line `end_header` is missing",
                    bytes.len()..bytes.len(),
                    "no `end_header` before here",
                    WRITE_AGAIN,
                ));
            };
            let words: Vec<String> = line.cells().take(6).map(|cell| cell.words()).collect();
            let words: Vec<&str> = words.iter().map(String::as_str).collect();
            let first = at == 0;
            at = line.next;
            match words[..] {
                ["ply"] if first => {}
                _ if first => return Err(bad_line(&line, "`ply` alone is the first line")),
                ["comment" | "obj_info", ..] | [] => {}
                ["format", name, _] => encoding = Some((Encoding::named(name, &line)?, line)),
                ["element", name, count] => elements.push(Element::new(name, count, &line)?),
                ["property", ref words @ ..] => {
                    let big = matches!(encoding, Some((Encoding::Big, _)));
                    let Some(element) = elements.last_mut() else {
                        return Err(bad_line(&line, "a property comes after its element"));
                    };
                    element.add(words, &line, big)?;
                }
                ["end_header"] => break,
                _ => return Err(bad_line(&line, "this is no line of a header")),
            }
        }
        let Some((encoding, line)) = encoding else {
            return Err(Fault::whole(
                "the header has no line `format`",
                "add it, such as `format ascii 1.0`",
            ));
        };
        let ascii = encoding == Encoding::Ascii;
        if ascii && lone {
            return Err(Fault::new(
                "the lines end with CR alone, which is not read as text",
                line.span(),
                "text",
                "convert the ends of lines: tr '\\r' '\\n'",
            ));
        }
        let vertex = vertices_of(&elements)?;
        Ok(Self { ascii, elements, vertex, body: at })
    }
}

/// How the rows are written.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Encoding {
    Ascii,
    Little,
    Big,
}

impl Encoding {
    fn named(name: &str, line: &Line<'_>) -> Result<Self, Fault> {
        match name {
            "ascii" => Ok(Self::Ascii),
            "binary_little_endian" => Ok(Self::Little),
            "binary_big_endian" => Ok(Self::Big),
            _ => {
                Err(bad_line(line, "formats are ascii, binary_little_endian and binary_big_endian"))
            }
        }
    }
}

/// A line of the header.
fn header_line(bytes: &[u8], at: usize, lone: bool) -> Option<Line<'_>> {
    let rest = bytes.get(at..)?;
    let length = memchr::memchr(if lone { b'\r' } else { b'\n' }, rest)?;
    let text = &rest[..length];
    let text = text.strip_suffix(b"\r").unwrap_or(text);
    Some(Line { text, start: at, next: at + length + 1 })
}

fn bad_line(line: &Line<'_>, why: &str) -> Fault {
    Fault::new(
        format!("`{}` stands in the header, but {why}", text::value(&line.words())),
        line.span(),
        "in the header",
        "write the file again with the program that made it",
    )
}

/// Which of the elements has the vertices.
fn vertices_of(elements: &[Element]) -> Result<usize, Fault> {
    let listed = || {
        let one = |element: &Element| {
            let names: Vec<&str> = element.properties.iter().map(|p| p.name.as_str()).collect();
            format!("{} ({})", text::value(&element.name), text::value(&names.join(" ")))
        };
        elements.iter().map(one).collect::<Vec<_>>().join(", ")
    };
    let fix = "write the particles as an element `vertex` with the properties x, y and z";
    let Some(vertex) = elements.iter().position(|element| element.name == "vertex") else {
        return Err(Fault::whole(
            format!("there is no element `vertex` among the elements: {}", listed()),
            fix,
        ));
    };
    let element = &elements[vertex];
    if ["x", "y", "z"].iter().any(|name| element.scalar(name).is_none()) {
        return Err(Fault::new(
            format!("the vertices have no properties x, y and z: {}", listed()),
            element.span.clone(),
            "without x, y and z",
            fix,
        ));
    }
    Ok(vertex)
}

/// The type of a name, in either way of naming it.
fn scalar(name: &str, big: bool) -> Option<Number> {
    let (kind, size) = match name {
        "char" | "int8" => (NumberKind::Int, 1),
        "uchar" | "uint8" => (NumberKind::Uint, 1),
        "short" | "int16" => (NumberKind::Int, 2),
        "ushort" | "uint16" => (NumberKind::Uint, 2),
        "int" | "int32" => (NumberKind::Int, 4),
        "uint" | "uint32" => (NumberKind::Uint, 4),
        "float" | "float32" => (NumberKind::Float, 4),
        "double" | "float64" => (NumberKind::Float, 8),
        _ => return None,
    };
    Some(Number { kind, size, big: big && size > 1 })
}

impl Element {
    fn new(name: &str, count: &str, line: &Line<'_>) -> Result<Self, Fault> {
        let not = || number::not_an_integer("the number of rows", count.as_bytes(), line.span());
        let count: usize = count.parse().map_err(|_| not())?;
        Ok(Self { name: name.into(), count, span: line.span(), properties: Vec::new() })
    }

    /// Adds a property, of the words that stand behind `property`.
    fn add(&mut self, words: &[&str], line: &Line<'_>, big: bool) -> Result<(), Fault> {
        let known = |name| scalar(name, big).ok_or_else(|| bad_line(line, "no such type is known"));
        let (list, number, name) = match *words {
            ["list", count, item, name] => {
                let count = known(count)?;
                if count.kind == NumberKind::Float {
                    return Err(bad_line(line, "the count of a list is an integer"));
                }
                (Some(count), known(item)?, name)
            }
            [number, name] => (None, known(number)?, name),
            _ => return Err(bad_line(line, "a property has a type and a name")),
        };
        self.properties.push(Property { name: name.into(), number, list });
        Ok(())
    }

    /// Which property has a name, and is no list.
    fn scalar(&self, name: &str) -> Option<usize> {
        self.properties.iter().position(|found| found.name == name && found.list.is_none())
    }

    /// The parts of a row that have a fixed length: its bytes, and what is known of the list that
    /// follows, which is its count's type and the bytes of an item.
    fn parts(&self) -> Vec<(usize, Option<(Number, usize)>)> {
        let (mut parts, mut fixed) = (Vec::new(), 0);
        for property in &self.properties {
            match property.list {
                None => fixed += property.number.size,
                Some(count) => {
                    parts.push((fixed, Some((count, property.number.size))));
                    fixed = 0;
                }
            }
        }
        parts.push((fixed, None));
        parts
    }

    /// Where the rows end that begin at a place.
    fn end(&self, bytes: &[u8], start: usize) -> Result<usize, Fault> {
        let parts = self.parts();
        if let [(stride, None)] = parts[..] {
            let end = stride.checked_mul(self.count).and_then(|length| start.checked_add(length));
            return end.filter(|end| *end <= bytes.len()).ok_or_else(|| {
                let there = bytes.len().saturating_sub(start);
                let fit = there.checked_div(stride).unwrap_or(0);
                self.cut_short(fit)
            });
        }
        let mut at = start;
        for row in 0..self.count {
            at = self.walk(bytes, at, &parts, row, |_, _| {})?;
        }
        Ok(at)
    }

    /// Walks over a row, and tells where each part of it begins.
    fn walk(
        &self,
        bytes: &[u8],
        mut at: usize,
        parts: &[(usize, Option<(Number, usize)>)],
        row: usize,
        mut begins: impl FnMut(usize, usize),
    ) -> Result<usize, Fault> {
        let cut = || self.cut_short(row);
        for (part, (fixed, list)) in parts.iter().enumerate() {
            begins(part, at);
            at += fixed;
            if let Some((count, item)) = list {
                let cell = bytes.get(at..at + count.size).ok_or_else(cut)?;
                let items = count.read(cell).0;
                if items < 0.0 {
                    return Err(Fault::whole(
                        format!(
                            "row {row} of `{}`, at byte {at}, has a list of {items} items",
                            text::value(&self.name)
                        ),
                        "write the file again",
                    ));
                }
                // At most 32 bits of items, of at most 8 bytes.
                let length = (items as usize).checked_mul(*item).ok_or_else(cut)?;
                at = (at + count.size).checked_add(length).ok_or_else(cut)?;
            }
            if at > bytes.len() {
                return Err(cut());
            }
        }
        Ok(at)
    }

    fn cut_short(&self, whole: usize) -> Fault {
        Fault::new(
            format!(
                "{} rows of `{}` are announced, but the file ends after {whole} of them",
                self.count,
                text::value(&self.name)
            ),
            self.span.clone(),
            "more than there are",
            WRITE_AGAIN,
        )
    }
}

/// The beginning of the first line that is not blank, or the end.
fn first_line(data: &Data, mut at: usize) -> usize {
    while let Some(line) = data.line(at).filter(Line::is_blank) {
        at = line.next;
    }
    at
}

/// Where the lines of an element end; blank ones before them do not count.
fn lines_end(data: &Data, start: usize, element: &Element) -> Result<usize, Fault> {
    // An element without properties has no lines.
    let Some(last) = element.count.checked_sub(1).filter(|_| !element.properties.is_empty()) else {
        return Ok(start);
    };
    let start = first_line(data, start);
    let rest = data.as_slice().get(start..).unwrap_or_default();
    if let Some(end) = memchr::memchr_iter(b'\n', rest).nth(last) {
        return Ok(start + end + 1);
    }
    // The last line may lack its end.
    let open = rest.last().is_some_and(|byte| *byte != b'\n');
    let found = memchr::memchr_iter(b'\n', rest).count() + usize::from(open);
    if found < element.count { Err(element.cut_short(found)) } else { Ok(data.len()) }
}

/// Names of three properties that are a colour.
const COLORS: [[&str; 3]; 3] =
    [["red", "green", "blue"], ["diffuse_red", "diffuse_green", "diffuse_blue"], ["r", "g", "b"]];

/// Which columns are read; the first is that of the positions.
struct Plan<'a> {
    vertices: &'a Element,
    columns: Vec<Planned>,
}

/// A column, and the properties that are its components.
struct Planned {
    name: String,
    role: Role,
    form: Form,
    properties: Vec<usize>,
}

impl<'a> Plan<'a> {
    fn of(vertices: &'a Element) -> Result<Self, Fault> {
        let properties = &vertices.properties;
        let find = |names: [&str; 3]| {
            let [a, b, c] = names.map(|name| vertices.scalar(name));
            Some([a?, b?, c?])
        };
        let numbers = |of: &[usize]| of.iter().map(|at| properties[*at].number).collect::<Vec<_>>();
        let axes = find(["x", "y", "z"]).unwrap_or_default().to_vec();
        let positions = Form::reals(numbers(&axes));
        let mut columns = vec![Planned {
            name: "positions".into(),
            role: Role::Other,
            form: positions,
            properties: axes.clone(),
        }];
        let channels = COLORS.iter().find_map(|names| find(*names)).map(Vec::from);
        let channels = channels.filter(|channels| {
            let float = |at: &usize| properties[*at].number.kind == NumberKind::Float;
            channels.iter().all(float) || !channels.iter().any(float)
        });
        for (at, property) in properties.iter().enumerate() {
            let name = &property.name;
            if properties[..at].iter().any(|before| before.name == *name) {
                return Err(Fault::new(
                    format!("two properties of the vertices are called `{}`", text::value(name)),
                    vertices.span.clone(),
                    "the vertices",
                    "write the file again, with a name for each property",
                ));
            }
            let channel = channels.as_ref().is_some_and(|channels| channels.contains(&at));
            if property.list.is_some() || axes.contains(&at) || channel {
                continue;
            }
            let role = match name.as_str() {
                "pscale" => Role::Radius,
                name => Role::of_name(name.strip_prefix("scalar_").unwrap_or(name)),
            };
            let form = Form::of(property.number, role);
            columns.push(Planned { name: name.clone(), role, form, properties: vec![at] });
        }
        if let Some(channels) = channels {
            let numbers = numbers(&channels);
            let form = match numbers[0].kind {
                NumberKind::Float => Form::reals(numbers),
                _ if numbers.iter().copied().all(records::is_byte) => Form::Bytes,
                _ => Form::Integers,
            };
            let (name, role) = ("colors".into(), Role::Color);
            columns.push(Planned { name, role, form, properties: channels });
        }
        Ok(Self { vertices, columns })
    }

    /// Reads rows of text.
    fn read_text(
        &self,
        data: &Data,
        frame: Range<usize>,
        control: &Control,
    ) -> Result<Vec<Values>, Fault> {
        let store = |column: &Planned| match column.form {
            Form::F32 | Form::F64 => Store::reals(column.properties.len()),
            Form::Integers | Form::Bytes => Store::Integers(Vec::new(), column.properties.len()),
        };
        let mut stores: Vec<Store> = self.columns.iter().map(store).collect();
        let pieces = self.pieces();
        let parse = |line: Line<'_>, row: &mut Row<'_, '_>| parse_pieces(&pieces, line, row);
        let missing = |found| self.vertices.cut_short(found);
        let which = Which::First(self.vertices.count, &missing);
        rows::read(data, frame, &which, &mut stores, control, parse)?;
        Ok(stores.into_iter().map(Store::into_values).collect())
    }

    /// The cells of a line, up to each list, and behind the last.
    fn pieces(&self) -> Vec<Layout> {
        let mut pieces = vec![Layout { places: Vec::new(), more: false }];
        for (at, property) in self.vertices.properties.iter().enumerate() {
            if property.list.is_some() {
                pieces.push(Layout { places: Vec::new(), more: false });
                continue;
            }
            let component = |column: &Planned| column.properties.iter().position(|p| *p == at);
            let columns = self.columns.iter().enumerate();
            let found = columns.filter_map(|(n, column)| Some((n, component(column)?))).next();
            let (column, component) = found.unwrap_or_default();
            let kind = match self.columns[column].form {
                _ if column == 0 => Kind::Finite,
                Form::F32 | Form::F64 => Kind::Real,
                Form::Integers | Form::Bytes => Kind::Integer,
            };
            let name = format!("`{}`", property.name);
            if let Some(last) = pieces.last_mut() {
                last.places.push(Place { name, kind, column, component });
            }
        }
        pieces
    }

    /// Reads rows of numbers.
    fn read_numbers(
        &self,
        data: &Data,
        frame: Range<usize>,
        control: &Control,
    ) -> Result<Vec<Values>, Fault> {
        let parts = self.vertices.parts();
        // Where each property lies: the part of a row, and the place in it.
        let (mut part, mut at) = (0, 0);
        let mut places = Vec::new();
        for property in &self.vertices.properties {
            places.push((part, at));
            match property.list {
                None => at += property.number.size,
                Some(_) => (part, at) = (part + 1, 0),
            }
        }
        let target = |column: &Planned| {
            let part = |p: &usize| (places[*p].1, self.vertices.properties[*p].number);
            Target { form: column.form, parts: column.properties.iter().map(part).collect() }
        };
        let targets: Vec<Target> = self.columns.iter().map(target).collect();
        let count = self.vertices.count;
        let values = if let [(stride, None)] = parts[..] {
            let records = Records { start: frame.start, stride, count };
            records::read(data, &records, &targets, control)?
        } else {
            let bytes = data.as_slice();
            let mut rooms = records::rooms(&targets, count)?;
            let mut starts = vec![0; parts.len()];
            let mut at = frame.start;
            for row in 0..count {
                if row % (1 << 16) == 0 {
                    Fault::if_cancelled(control)?;
                }
                at = self.vertices.walk(bytes, at, &parts, row, |part, at| starts[part] = at)?;
                for (room, column) in rooms.iter_mut().zip(&self.columns) {
                    for (component, property) in column.properties.iter().enumerate() {
                        let (part, within) = places[*property];
                        let number = self.vertices.properties[*property].number;
                        let from = starts[part] + within;
                        room.set(row, component, number, &bytes[from..from + number.size]);
                    }
                }
            }
            rooms.into_iter().map(records::Room::into_values).collect()
        };
        if let Some(Values::Reals(positions)) = values.first()
            && let Some(place) = records::first_not_finite(positions)
        {
            let (row, axis) = (place / 3, ["x", "y", "z"][place % 3]);
            return Err(Fault::whole(
                format!(
                    "`{axis}` of vertex {row} is {}, which is not finite: there is no such place",
                    positions.get(place)
                ),
                "correct the number, or leave the vertex out of the file",
            ));
        }
        Ok(values)
    }

    /// The particles of what was read.
    fn finish(self, values: Vec<Values>, ply: &Ply) -> Result<Particles, Fault> {
        let mut notes = Vec::new();
        let named = |element: &&Element| element.name != "vertex" && element.count > 0;
        for element in ply.elements.iter().filter(named) {
            let (count, name) = (element.count, text::value(&element.name));
            notes.push(format!("{count} rows of `{name}` were left out: only vertices are drawn"));
        }
        for property in self.vertices.properties.iter().filter(|p| p.list.is_some()) {
            let name = text::value(&property.name);
            notes.push(format!("the lists `{name}` of the vertices were left out"));
        }
        let mut planned = self.columns.into_iter().zip(values);
        let centers = match planned.next() {
            Some((_, Values::Reals(positions))) => positions,
            _ => Reals::F64(Vec::new().into()),
        };
        let mut columns = Vec::new();
        for (Planned { name, role, properties, .. }, values) in planned {
            let bytes =
                properties.iter().all(|p| records::is_byte(self.vertices.properties[*p].number));
            let (role, values) = match role {
                Role::Color if properties.len() == 3 => records::colors(values, bytes, &mut notes),
                role => (role, values),
            };
            columns.push(Column { name, role, width: properties.len(), values });
        }
        let radius = columns.iter().any(|c| matches!(c.role, Role::Radius | Role::Diameter));
        if !radius && columns.iter().any(|column| column.name == "scale") {
            notes.push("`scale` is not taken as a radius: its meaning differs by program".into());
        }
        Ok(Particles { centers, centers_from: "x y z".into(), columns, cell: None, notes })
    }
}

/// Reads a line into a row; a list stands between two pieces.
fn parse_pieces(pieces: &[Layout], mut line: Line<'_>, row: &mut Row<'_, '_>) -> Result<(), Fault> {
    let Some((last, others)) = pieces.split_last() else { return Ok(()) };
    for layout in others {
        let mut cells = line.cells();
        let piece_end = match layout.places.len() {
            0 => line.start,
            count => cells.nth(count - 1).map_or(line.span().end, |cell| cell.span().end),
        };
        let piece = Line { text: &line.text[..piece_end - line.start], ..line };
        layout.parse(piece, row)?;
        let few = || {
            let end = line.span().end;
            let fix = "correct the line, or write the file again";
            Fault::new("the line ends within a list", end..end, "the end", fix)
        };
        let cell = cells.next().ok_or_else(few)?;
        let count = number::integer(cell.text).and_then(|count| usize::try_from(count).ok());
        let not = || number::not_an_integer("the length of a list", cell.text, cell.span());
        let mut end = cell.span().end;
        // Each is looked for: a count beyond the line's end ends there.
        for _ in 0..count.ok_or_else(not)? {
            end = cells.next().ok_or_else(few)?.span().end;
        }
        line = Line { text: &line.text[end - line.start..], start: end, next: line.next };
    }
    if last.places.is_empty() && line.is_blank() {
        return Ok(());
    }
    last.parse(line, row)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::particles::{
        Format,
        file::tests::{centers, frame, opened},
    };

    const XYZ: &str = "property float x\nproperty float y\nproperty float z\n";

    fn ply(format: &str, elements: &str, body: &[u8]) -> Vec<u8> {
        let header = format!("ply\nformat {format} 1.0\ncomment a\n{elements}end_header\n");
        [header.as_bytes(), body].concat()
    }

    fn bytes(column: &Column) -> &[u8] {
        let Values::Bytes(bytes) = &column.values else { panic!("{column:?}") };
        bytes.as_slice()
    }

    /// The byte behind the end of the header is data, also where it is a line's end.
    #[test]
    fn the_end_of_the_header_is_one_line_end() {
        let elements = "element vertex 1\nproperty uchar q\nproperty uchar x\nproperty short z\n\
                        property uchar y\nobj_info anything\n";
        for end in ["\n", "\r\n", "\r"] {
            let header = ply("binary_little_endian", elements, b"");
            let header = String::from_utf8(header).unwrap().replace('\n', end);
            let file = [header.as_bytes(), b"\n\r\x05\xff\x07"].concat();
            let particles = frame(Format::Ply, file, 0).unwrap();
            assert_eq!(centers(&particles), [[13.0, 7.0, -251.0]], "{end:?}");
            assert_eq!(bytes(particles.column("q").unwrap()), [10], "{end:?}");
        }
    }

    #[test]
    fn numbers_of_either_order_keep_their_type() {
        let elements = "element vertex 2\nproperty float64 radius\nproperty float32 x\n\
                        property float y\nproperty float z\nproperty uint8 red\n\
                        property uint8 green\nproperty uint8 blue\nproperty int type\n";
        for big in [false, true] {
            let order = |mut bytes: Vec<u8>| {
                if !big {
                    bytes.reverse();
                }
                bytes
            };
            let row = |n: u8| {
                let n32 = |k: f32| order((f32::from(n) + k).to_be_bytes().to_vec());
                let radius = order((f64::from(n) + 0.1).to_be_bytes().to_vec());
                let kind = order((-i32::from(n)).to_be_bytes().to_vec());
                [radius, n32(0.0), n32(1.0), n32(2.0), vec![n, 10, 13], kind].concat()
            };
            let format = ["binary_little_endian", "binary_big_endian"][usize::from(big)];
            let file = ply(format, elements, &[row(1), row(200)].concat());
            let particles = frame(Format::Ply, file.clone(), 0).unwrap();
            assert!(matches!(particles.centers, Reals::F32(_)));
            assert_eq!(centers(&particles), [[1.0, 2.0, 3.0], [200.0, 201.0, 202.0]]);
            assert_eq!(particles.role(Role::Radius).unwrap().values.get(0), Some(1.1));
            assert_eq!(bytes(particles.role(Role::Color).unwrap()), [1, 10, 13, 200, 10, 13]);
            assert_eq!(particles.role(Role::Type).unwrap().values.get(1), Some(-200.0));
            // One byte less is cut short.
            let error = frame(Format::Ply, &file[..file.len() - 1], 0).expect_err("cut");
            assert!(error.message().contains("ends after 1 of them"), "{error}");
            assert_eq!(error.line(), Some(4), "{error}");
        }
    }

    /// Lists before the vertices and among their properties are walked over, in both forms.
    #[test]
    fn lists_are_walked_over() {
        let elements = format!(
            "element face 2\nproperty list uchar short vertex_indices\nproperty uchar f\n\
             element vertex 2\nproperty uchar a\nproperty list ushort double l\n{XYZ}\
             element edge 7\nproperty int v\n"
        );
        let mut body = vec![2, 9, 9, 9, 9, 5, 0, 5];
        for (row, items) in [(1u8, 0u16), (2, 3)] {
            body.push(row);
            body.extend(items.to_le_bytes());
            body.extend(vec![1; 8 * usize::from(items)]);
            (0..3u8).for_each(|k| body.extend(f32::from(row + k).to_le_bytes()));
        }
        let text = b"\n2 9 9 5\n0 5\n\n1 0 1 2 3\n2 3 .1 .1 .1 2 3 4\n";
        let binary = ply("binary_little_endian", &elements, &body);
        let notes = [
            "2 rows of `face` were left out: only vertices are drawn",
            "7 rows of `edge` were left out: only vertices are drawn",
            "the lists `l` of the vertices were left out",
        ];
        for file in [ply("ascii", &elements, text), binary.clone()] {
            let particles = frame(Format::Ply, file, 0).unwrap();
            assert_eq!(centers(&particles), [[1.0, 2.0, 3.0], [2.0, 3.0, 4.0]]);
            assert_eq!(particles.column("a").unwrap().values.get(1), Some(2.0));
            assert_eq!(particles.notes, notes);
        }
        // Cut anywhere, it is refused.
        for length in binary.len() - body.len()..binary.len() {
            frame(Format::Ply, &binary[..length], 0).expect_err("cut");
        }
        let cut: &[u8] = b"2 9 9 5\n0 5\n1 9 1 2 3\n2 3 .1 .1 .1 2 3 4\n";
        let error = frame(Format::Ply, ply("ascii", &elements, cut), 0).expect_err("short");
        assert!(error.message().contains("within a list"), "{error}");
        let negative = elements.replace("uchar short", "char short");
        body[0] = 0x80;
        let file = ply("binary_little_endian", &negative, &body);
        let error = frame(Format::Ply, file, 0).expect_err("negative");
        assert!(error.message().contains("a list of -128 items"), "{error}");
    }

    #[test]
    fn colors_are_what_they_can_be() {
        let rows = |kind: &str, names: [&str; 3], cells: &str| {
            let properties = names.map(|name| format!("property {kind} {name}\n")).concat();
            let elements = format!("element vertex 1\n{XYZ}{properties}");
            let body = format!("0.1 0 0 {cells}\n");
            frame(Format::Ply, ply("ascii", &elements, body.as_bytes()), 0).unwrap()
        };
        let red = ["red", "green", "blue"];
        let particles = rows("uchar", red, "1 2 255");
        assert_eq!(bytes(particles.column("colors").unwrap()), [1, 2, 255]);
        assert_eq!(centers(&particles), [[0.1, 0.0, 0.0]]);
        assert!(particles.notes.is_empty());
        let particles = rows("float", ["r", "g", "b"], "0 0.5 1");
        let color = particles.role(Role::Color).unwrap();
        assert_eq!((color.width, color.values.get(1)), (3, Some(0.5)));
        let particles = rows("float", ["diffuse_red", "diffuse_green", "diffuse_blue"], "0 9 255");
        assert_eq!(bytes(particles.role(Role::Color).unwrap()), [0, 9, 255]);
        assert_eq!(particles.notes.len(), 1);
        let particles = rows("ushort", red, "1 2 65535");
        assert!(particles.role(Role::Color).is_none() && particles.notes.len() == 1);
        let particles = rows("float", ["radius", "pscale", "scalar_id"], "1 2 3");
        assert_eq!(particles.column("pscale").unwrap().role, Role::Radius);
        assert_eq!(particles.column("scalar_id").unwrap().role, Role::Id);
        let particles = rows("float", ["scale", "scale_0", "nx"], "1 2 3");
        assert!(particles.role(Role::Radius).is_none() && particles.notes.len() == 1);
    }

    /// What a header says is compared with what is there before it is believed.
    #[test]
    fn what_is_wrong_is_pointed_at() {
        let vertex = format!("element vertex 1\n{XYZ}");
        let replaced = |old: &str, new: &str| vertex.replace(old, new);
        let most = u64::MAX.to_string();
        for (format, elements, body, line, words) in [
            ("ascii", vertex.clone(), "1 2 x\n", Some(9), "`x` stands where `z` is expected"),
            ("ascii", vertex.clone(), "1 2\n", Some(9), "2 cells"),
            ("ascii", vertex.clone(), "1 2 3 4\n", Some(9), "4 cells"),
            ("ascii", vertex.clone(), "1 2 nan\n", Some(9), "not finite"),
            ("ascii", replaced("vertex 1", "vertex 3"), "1 2 3\n1 2 3\n", Some(4), "after 2 of"),
            ("ascii", replaced("vertex 1", &format!("vertex {most}")), "", Some(4), "after 0 of"),
            ("ascii", replaced("vertex 1", "vertex -1"), "", Some(4), "the number of rows"),
            ("ascii", replaced("float x", "half x"), "", Some(5), "no such type"),
            ("ascii", replaced("float x", "list float int x"), "", Some(5), "is an integer"),
            ("ascii", replaced("float x", "list int int x"), "", Some(4), "no properties x"),
            ("ascii", replaced("float x", "float z"), "", Some(4), "no properties x"),
            ("ascii", vertex.clone() + "property int x\n", "", Some(4), "are called `x`"),
            ("ascii", replaced("vertex 1", "point 1"), "", None, "elements: point (x y z)"),
            ("binary_big_endian", vertex.clone(), "\u{7f}\0\0\0", Some(4), "after 0 of"),
            ("binary_middle_endian", vertex.clone(), "", Some(2), "formats are ascii"),
        ] {
            let body = body.as_bytes();
            let body = if words.contains("called") { b"1 2 3 4\n" } else { body };
            let error = frame(Format::Ply, ply(format, &elements, body), 0).expect_err(words);
            assert_eq!(error.line(), line, "{error}");
            assert!(error.message().contains(words), "{error}");
        }
        let nan = [&[0; 8][..], &f32::NAN.to_le_bytes()].concat();
        let file = ply("binary_little_endian", &vertex, &nan);
        let error = frame(Format::Ply, file, 0).expect_err("NaN");
        assert!(error.message().contains("`z` of vertex 0 is NaN"), "{error}");
        for huge in ["uint", "double"] {
            let elements = format!("element a {most}\nproperty {huge} b\n{vertex}");
            frame(Format::Ply, ply("binary_little_endian", &elements, b"1"), 0).expect_err("huge");
        }
        opened(Format::Ply, "ply\nformat ascii 1.0\n").expect_err("no end");
    }
}
