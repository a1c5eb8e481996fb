//! Particles become spheres: which of their columns is the radius, and which the colour.
//!
//! What is not asked for is chosen, in this order, and each choice is put into words:
//!
//! * **Radius**: a column of radii, or of diameters; else the element's van der Waals radius; else
//!   half the usual distance between neighbours (`spacing.rs`).
//! * **Colour**: a column of colours; else the element's (Jmol); else that of the type in a
//!   palette; else one colour for all. A type has its colour in each frame and file, whichever
//!   other types there are.

use rayon::prelude::*;

use super::{
    Column, Particles, Role, Values, elements::Element, first_unlike, kinds, spacing::spacing,
};
use crate::{
    colors::{DEFAULT_COLOR, parse},
    legend::Legend,
};
use planisphere_core::{
    scene::{self, Block, Colors, Radii, Reals},
    text,
};
use planisphere_image::maps::{self, Map};

/// How particles are to be drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct Appearance {
    /// Where their radii come from.
    pub radius: RadiusFrom,
    /// What each radius is multiplied by.
    pub radius_scale: f64,
    /// Where their colours come from.
    pub color: ColorFrom,
    /// The colour map of a column; the default is `viridis` for numbers and `tab10` for types.
    pub map: Option<Map>,
    /// The values of the map's ends; the default is the least and the greatest value of the frame.
    pub range: Option<[f64; 2]>,
}

impl Default for Appearance {
    fn default() -> Self {
        Self {
            radius: RadiusFrom::Chosen,
            radius_scale: 1.0,
            color: ColorFrom::Chosen,
            map: None,
            range: None,
        }
    }
}

/// Where radii come from.
#[derive(Clone, Debug, PartialEq)]
pub enum RadiusFrom {
    /// What is there decides.
    Chosen,
    /// All have this one, in the unit of the positions.
    Same(f64),
    /// A column, of which diameters are halved.
    Column(String),
    /// The elements' van der Waals radii.
    VanDerWaals,
    /// The elements' covalent radii.
    Covalent,
}

impl From<&str> for RadiusFrom {
    /// The elements' radii by their words, `vdw` and `covalent`; else a column by its name.
    fn from(word: &str) -> Self {
        match word.to_ascii_lowercase().as_str() {
            "vdw" => Self::VanDerWaals,
            "covalent" => Self::Covalent,
            _ => Self::Column(word.into()),
        }
    }
}

/// Where colours come from.
#[derive(Clone, Debug, PartialEq)]
pub enum ColorFrom {
    /// What is there decides.
    Chosen,
    /// All have this one, sRGB.
    Same([u8; 3]),
    /// A column, by a map.
    Column(String),
}

/// Spheres, and in words where they come from.
#[derive(Clone, Debug)]
pub struct Spheres {
    /// The spheres, in the order of the particles.
    pub block: Block,
    /// Where the radii come from, such as "column `radius`".
    pub radii_from: String,
    /// Where the colours come from.
    pub colors_from: String,
    /// What the colours mean; or why that has no legend.
    pub legend: Result<Legend, String>,
    /// What else should be known, each one line.
    pub notes: Vec<String>,
}

/// Why particles cannot be drawn as asked: what is wrong, and the fix.
#[derive(Clone, Debug)]
pub struct Unfit {
    /// What is wrong.
    pub words: String,
    /// What to do.
    pub fix: String,
}

impl Unfit {
    fn new(words: impl Into<String>, fix: impl Into<String>) -> Self {
        Self { words: words.into(), fix: fix.into() }
    }
}

/// The radius where an element has none, in angstrom.
const USUAL_RADIUS: f64 = 1.5;

/// The colour of what is no element: Jmol's of unknown atoms.
const NO_ELEMENT: [u8; 3] = [0xff, 0x14, 0x93];

/// The colour of values that are not a number, sRGB.
pub const NAN_COLOR: [u8; 3] = [128, 128, 128];

/// Makes spheres of particles. `unit` is the unit of the positions, in angstrom, for the radii of
/// elements.
///
/// # Errors
/// When a column is asked for that is not there, or holds something else.
pub fn spheres(
    particles: &Particles,
    unit: f64,
    appearance: &Appearance,
) -> Result<Spheres, Unfit> {
    let elements = Elements::of(particles);
    let mut notes = Vec::new();
    let (radii, radii_from) = radii(particles, elements.as_ref(), unit, appearance, &mut notes)?;
    let colored = colors(particles, elements.as_ref(), appearance, &mut notes)?;
    let Colored { colors, from: colors_from, legend } = colored;
    let block = Block { centers: particles.centers.clone(), radii, colors };
    Ok(Spheres { block, radii_from, colors_from, legend, notes })
}

/// The element of each particle.
struct Elements<'a> {
    column: &'a Column,
    /// The elements that there may be: of each word, or of each atomic number from 0.
    known: Vec<Option<Element>>,
}

impl<'a> Elements<'a> {
    /// Those of the columns; none where there is no column of elements, or none of its words is an
    /// element's symbol: it then holds types.
    fn of(particles: &'a Particles) -> Option<Self> {
        let column =
            particles.role(Role::Element).or_else(|| particles.role(Role::AtomicNumber))?;
        let known: Vec<_> = match &column.values {
            Values::Words(words) => {
                words.words.iter().map(|word| Element::of_symbol(word.trim())).collect()
            }
            Values::Integers(_) => (0..=118).map(Element::of_number).collect(),
            Values::Reals(_) | Values::Bytes(_) => return None,
        };
        let any = match &column.values {
            Values::Integers(numbers) => numbers.par_iter().any(|n| (1..=118).contains(n)),
            _ => known.iter().any(Option::is_some),
        };
        any.then_some(Self { column, known })
    }

    /// The place in `known` of a particle's element.
    fn code(&self, index: usize) -> Option<usize> {
        match &self.column.values {
            Values::Words(words) => Some(words.codes[index] as usize),
            Values::Integers(numbers) => {
                usize::try_from(numbers[index]).ok().filter(|code| *code < self.known.len())
            }
            Values::Reals(_) | Values::Bytes(_) => None,
        }
    }

    /// What a particle's column says.
    fn word(&self, index: usize) -> String {
        match &self.column.values {
            Values::Words(words) => text::value(words.get(index)),
            Values::Integers(numbers) => numbers[index].to_string(),
            Values::Reals(_) | Values::Bytes(_) => String::new(),
        }
    }

    /// Says which of the elements have not what was looked for, such as "van der Waals radius".
    fn missing(&self, has: impl Fn(Element) -> bool + Sync, what: &str) -> Option<String> {
        let fine: Vec<bool> = self.known.iter().map(|known| known.is_some_and(&has)).collect();
        let count = self.column.values.len();
        let lacks = |index: &usize| !self.code(*index).is_some_and(|code| fine[code]);
        let number = (0..count).into_par_iter().filter(lacks).count();
        if number == 0 {
            return None;
        }
        let mut names: Vec<String> = Vec::new();
        for index in (0..count).filter(lacks) {
            let name = self.word(index);
            if !name.is_empty() && !names.contains(&name) {
                names.push(name);
            }
            if names.len() > 5 {
                names[5] = "...".into();
                break;
            }
        }
        let names = match names.as_slice() {
            [] => String::new(),
            names => format!(" ({})", names.join(", ")),
        };
        let particles = if number == 1 { "particle has" } else { "particles have" };
        Some(format!("{number} {particles} no {what}{names}"))
    }
}

fn radii(
    particles: &Particles,
    elements: Option<&Elements<'_>>,
    unit: f64,
    appearance: &Appearance,
    notes: &mut Vec<String>,
) -> Result<(Radii, String), Unfit> {
    let scale = appearance.radius_scale;
    let scaled = |words: String| match scale == 1.0 {
        true => words,
        false => format!("{words}, times {scale}"),
    };
    let mut of_elements = |elements: &Elements<'_>, covalent: bool| {
        let (table, radius): (_, fn(Element) -> Option<f64>) = match covalent {
            true => ("covalent", Element::covalent_radius),
            false => ("van der Waals", Element::vdw_radius),
        };
        let what = format!("{table} radius");
        if let Some(missing) = elements.missing(|element| radius(element).is_some(), &what) {
            let usual = USUAL_RADIUS / unit;
            notes.push(format!("{missing}: drawn with a radius of {usual}"));
        }
        let usual = USUAL_RADIUS;
        let of = |known: &Option<Element>| known.and_then(radius).unwrap_or(usual) / unit * scale;
        let of_code: Vec<f64> = elements.known.iter().map(of).collect();
        let radius = |index| elements.code(index).map_or(usual / unit * scale, |c| of_code[c]);
        let radii: Vec<f64> = (0..particles.len()).into_par_iter().map(radius).collect();
        let words = scaled(format!("{table}, by column `{}`", elements.column.name));
        (Radii::Each(Reals::F64(radii.into())), words)
    };
    match &appearance.radius {
        RadiusFrom::Same(radius) => {
            Ok((Radii::Same(radius * scale), scaled(format!("{radius} for all"))))
        }
        RadiusFrom::Column(name) => {
            let column = named(particles, name)?;
            Ok((column_radii(column, scale)?, scaled(radius_words(column))))
        }
        RadiusFrom::VanDerWaals | RadiusFrom::Covalent => {
            let elements = elements.ok_or_else(|| no_elements(particles))?;
            Ok(of_elements(elements, appearance.radius == RadiusFrom::Covalent))
        }
        RadiusFrom::Chosen => {
            let column = particles.role(Role::Radius).or_else(|| particles.role(Role::Diameter));
            if let Some(column) = column {
                return Ok((column_radii(column, scale)?, scaled(radius_words(column))));
            }
            if let Some(elements) = elements {
                return Ok(of_elements(elements, false));
            }
            let (radius, words) = match spacing(&particles.centers) {
                Some(distance) => (0.5 * distance, "half the usual distance of neighbours"),
                None => (0.5, "no two particles are apart"),
            };
            let words = format!("{} for all ({words})", short(radius * scale));
            Ok((Radii::Same(radius * scale), words))
        }
    }
}

/// A column by its name.
pub(super) fn named<'a>(particles: &'a Particles, name: &str) -> Result<&'a Column, Unfit> {
    let same = |column: &&Column| column.name.eq_ignore_ascii_case(name);
    let found = particles.column(name).or_else(|| particles.columns.iter().find(same));
    found.ok_or_else(|| {
        let names: Vec<String> =
            particles.columns.iter().map(|column| text::value(&column.name)).collect();
        let fix = match names.as_slice() {
            [] => "the file has no columns beside the positions: x, y, z".into(),
            _ => format!("its columns are x, y, z, {}", names.join(", ")),
        };
        Unfit::new(format!("there is no column `{}`", text::value(name)), fix)
    })
}

fn no_elements(particles: &Particles) -> Unfit {
    let words = match particles.role(Role::Element) {
        Some(column) => format!("column `{}` holds no symbol of an element", column.name),
        None => "there is no column of elements".into(),
    };
    Unfit::new(words, "give a radius (--radius 0.5) or a column (--radius NAME) instead")
}

fn radius_words(column: &Column) -> String {
    match column.role {
        Role::Diameter => format!("half of column `{}`", column.name),
        _ => format!("column `{}`", column.name),
    }
}

/// The radii of a column.
fn column_radii(column: &Column, scale: f64) -> Result<Radii, Unfit> {
    let factor = if column.role == Role::Diameter { 0.5 * scale } else { scale };
    if column.width != 1 {
        return Err(Unfit::new(
            format!("column `{}` has {} values a particle", column.name, column.width),
            "name a column of one value",
        ));
    }
    let radii = match &column.values {
        Values::Words(_) => {
            return Err(Unfit::new(
                format!("column `{}` holds words, not radii", column.name),
                "name a column of numbers, or give a radius: --radius 0.5",
            ));
        }
        // In place.
        Values::Reals(radii) if factor == 1.0 => radii.clone(),
        values => {
            let radius = |index| values.get(index).map_or(f64::NAN, |value| value * factor);
            let radii: Vec<f64> = (0..values.len()).into_par_iter().map(radius).collect();
            Reals::F64(radii.into())
        }
    };
    if let Some(index) = first_unlike(&radii, |radius| radius > 0.0 && radius.is_finite()) {
        let value = column.values.get(index).unwrap_or(f64::NAN);
        return Err(Unfit::new(
            format!(
                "column `{}` is {value} for particle {index} (counted from 0), but a radius is \
                 greater than 0 and finite",
                column.name
            ),
            "correct the file, or give one radius for all: --radius 0.5",
        ));
    }
    Ok(Radii::Each(radii))
}

/// Colours of all particles.
struct Colored {
    colors: Colors,
    /// Where they come from.
    from: String,
    /// What they mean; or why that has no legend.
    legend: Result<Legend, String>,
}

impl Colored {
    /// One colour for all.
    fn same(color: [u8; 3]) -> Self {
        let from = format!("{} for all", hex(color));
        let legend = Err(format!("all have one colour, {}", hex(color)));
        Self { colors: Colors::Same(color), from, legend }
    }

    /// The file's own colours.
    fn own(colors: Colors, from: String) -> Self {
        let legend =
            Err(format!("the colours are those of the file ({from}), of no known meaning"));
        Self { colors, from, legend }
    }
}

fn colors(
    particles: &Particles,
    elements: Option<&Elements<'_>>,
    appearance: &Appearance,
    notes: &mut Vec<String>,
) -> Result<Colored, Unfit> {
    match &appearance.color {
        ColorFrom::Same(color) => Ok(Colored::same(*color)),
        ColorFrom::Column(name) => by_column(particles, elements, name, appearance, notes),
        ColorFrom::Chosen => {
            if let Some(found) = own_colors(particles)? {
                return Ok(found);
            }
            if let Some(elements) = elements {
                return Ok(element_colors(elements, notes));
            }
            // Symbols that are no elements are types.
            let types = particles.role(Role::Type).or_else(|| particles.role(Role::Element));
            if let Some(column) = types {
                return Ok(category_colors(column, appearance.map.unwrap_or(TYPES)));
            }
            Ok(Colored::same(DEFAULT_COLOR))
        }
    }
}

/// A number in at most six digits, for people.
fn short(value: f64) -> String {
    let rounded: f64 = format!("{value:.5e}").parse().unwrap_or(value);
    match rounded.abs() {
        0.0 | 1e-4..1e9 => format!("{rounded}"),
        _ => format!("{rounded:e}"),
    }
}

fn hex([red, green, blue]: [u8; 3]) -> String {
    format!("#{red:02x}{green:02x}{blue:02x}")
}

/// The palette of types.
const TYPES: Map = Map::TAB10;

/// Bytes of colours, one for each particle.
fn each(count: usize, color: impl Fn(usize) -> [u8; 3] + Sync) -> Colors {
    let mut bytes = vec![[0u8; 3]; count];
    bytes.par_chunks_mut(1 << 12).enumerate().for_each(|(part, colors)| {
        let first = part << 12;
        colors.iter_mut().enumerate().for_each(|(n, to)| *to = color(first + n));
    });
    Colors::Each(scene::Column::of_rows(bytes))
}

fn element_colors(elements: &Elements<'_>, notes: &mut Vec<String>) -> Colored {
    if let Some(missing) = elements.missing(|_| true, "element that is known") {
        notes.push(format!("{missing}: drawn in {}", hex(NO_ELEMENT)));
    }
    let colors: Vec<[u8; 3]> =
        elements.known.iter().map(|known| known.map_or(NO_ELEMENT, Element::color)).collect();
    let color = |index| elements.code(index).map_or(NO_ELEMENT, |code| colors[code]);
    let from = format!("Jmol's, by column `{}`", elements.column.name);
    let count = elements.column.values.len();
    let found = kinds::elements(count, &elements.known, |index| elements.code(index));
    let of = |element: Option<Element>| match element {
        Some(element) => (element.symbol().to_owned(), element.color()),
        None => ("no element".to_owned(), NO_ELEMENT),
    };
    let legend = Legend::of_kinds(found.into_iter().map(of).collect());
    Colored { colors: each(count, color), from, legend }
}

/// The colours of a column of colours, or of three columns of channels.
fn own_colors(particles: &Particles) -> Result<Option<Colored>, Unfit> {
    if let Some(column) = particles.role(Role::Color)
        && column.width >= 3
    {
        let channels = [0, 1, 2].map(|channel| Channel { column, channel });
        let words = format!("column `{}`", column.name);
        return channel_colors(channels, particles.len(), words).map(Some);
    }
    if let Some(column) = particles.role(Role::Color)
        && let Values::Words(found) = &column.values
        && let Some(colors) =
            found.words.iter().map(|word| parse(word.trim()).ok()).collect::<Option<Vec<_>>>()
    {
        let colors = each(particles.len(), |index| colors[found.codes[index] as usize]);
        return Ok(Some(Colored::own(colors, format!("column `{}`", column.name))));
    }
    let found = [0, 1, 2].map(|channel| particles.role(Role::Channel(channel)));
    if let [Some(red), Some(green), Some(blue)] = found {
        let channels = [red, green, blue].map(|column| Channel { column, channel: 0 });
        let words = format!("columns `{}` `{}` `{}`", red.name, green.name, blue.name);
        return channel_colors(channels, particles.len(), words).map(Some);
    }
    Ok(None)
}

/// One channel of colours.
#[derive(Clone, Copy)]
struct Channel<'a> {
    column: &'a Column,
    channel: usize,
}

impl Channel<'_> {
    fn get(&self, index: usize) -> f64 {
        let at = index * self.column.width + self.channel;
        self.column.values.get(at).unwrap_or(f64::NAN)
    }
}

/// Colours of channels, which are bytes or numbers from 0 to 1.
fn channel_colors(
    channels: [Channel<'_>; 3],
    count: usize,
    words: String,
) -> Result<Colored, Unfit> {
    let [first, ..] = channels;
    if let Values::Bytes(bytes) = &first.column.values
        && first.column.width == 3
        && channels[2].channel == 2
    {
        return Ok(Colored::own(Colors::Each(bytes.clone()), words));
    }
    let row = |index: usize| channels.map(|channel| channel.get(index));
    let within = |most: f64| {
        let fits = move |index: &usize| row(*index).iter().all(|v| (0.0..=most).contains(v));
        (0..count).into_par_iter().find_first(move |index| !fits(index))
    };
    let byte = |value: f64| (value + 0.5).floor() as u8;
    let bytes = matches!(first.column.values, Values::Bytes(_));
    if !bytes && within(1.0).is_none() {
        let colors = each(count, |index| row(index).map(|value| byte(255.0 * value)));
        return Ok(Colored::own(colors, format!("{words}, from 0 to 1")));
    }
    let Some(wrong) = within(255.0) else {
        let colors = each(count, |index| row(index).map(byte));
        return Ok(Colored::own(colors, format!("{words}, from 0 to 255")));
    };
    let [red, green, blue] = row(wrong);
    Err(Unfit::new(
        format!(
            "{words}: particle {wrong} (counted from 0) has {red}, {green}, {blue}, but a colour \
             has three numbers from 0 to 255, or from 0 to 1"
        ),
        "correct the file, or give one colour for all: --color \"#b0b0b0\"",
    ))
}

/// Colours of types, the same whichever others there are.
fn category_colors(column: &Column, map: Map) -> Colored {
    let from = format!("{}, by column `{}`", map.name(), column.name);
    // Types of programs that count them from 1 begin at the beginning of the palette.
    let first = if column.name.eq_ignore_ascii_case("typeid") { 0 } else { 1 };
    let count = column.values.len() / column.width.max(1);
    // Of a map that goes from one end to the other neighbours look alike: far steps, all different.
    let color = |index: u64| match map.is_categorical() {
        true => map.category(index),
        false => map.category(index % 256 * 97),
    };
    let of_number = |number: i64| color(place(number, first));
    let numbers = |found: Result<Vec<i64>, String>| {
        let name = |number: i64| format!("{} {number}", text::value(&column.name));
        let kinds = found?.into_iter().map(|number| (name(number), of_number(number)));
        Ok(Legend::Kinds(kinds.collect()))
    };
    let (colors, legend) = match &column.values {
        Values::Words(found) => {
            let colors: Vec<_> = found.words.iter().map(|word| color(category(word))).collect();
            let kinds = kinds::words(found).into_iter();
            let kinds = kinds.map(|code| (text::value(&found.words[code]), colors[code]));
            let legend = Legend::of_kinds(kinds.collect());
            (each(count, |index| colors[found.codes[index] as usize]), legend)
        }
        Values::Integers(types) => {
            let found = kinds::numbers(types.len(), |index| Some(types[index]));
            (each(count, |index| of_number(types[index])), numbers(found))
        }
        values => {
            let value = |index: usize| values.get(index).filter(|value| !value.is_nan());
            let found = kinds::numbers(count, |index| value(index).map(|value| value as i64));
            let color = |index| value(index).map_or(NAN_COLOR, |value| of_number(value as i64));
            (each(count, color), numbers(found))
        }
    };
    Colored { colors, from, legend }
}

/// The place of a type's number in a palette of any length, whose multiples are added to what is
/// negative.
fn place(number: i64, first: i64) -> u64 {
    /// A multiple of the lengths of all palettes.
    const CYCLE: i64 = 2560;
    number.wrapping_sub(first).rem_euclid(CYCLE).unsigned_abs()
}

/// The place of a type's name in a palette: of one letter its place in the alphabet; of a longer
/// one a hash (FNV-1a), so that it has its colour whichever others there are.
fn category(name: &str) -> u64 {
    match name.as_bytes() {
        [letter @ (b'a'..=b'z' | b'A'..=b'Z')] => u64::from(letter.to_ascii_lowercase() - b'a'),
        bytes => bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash: u64, byte| {
            (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3)
        }),
    }
}

/// Colours of a column that was asked for.
fn by_column(
    particles: &Particles,
    elements: Option<&Elements<'_>>,
    name: &str,
    appearance: &Appearance,
    notes: &mut Vec<String>,
) -> Result<Colored, Unfit> {
    let (column, component) = component_of(particles, name)?;
    let Some(column) = column else {
        let values = |index: usize| particles.centers.get(3 * index + component);
        return map_colors([name; 2], particles.len(), values, appearance, notes);
    };
    if let (None, Some(elements)) = (appearance.map, elements)
        && std::ptr::eq(column, elements.column)
    {
        return Ok(element_colors(elements, notes));
    }
    if column.role == Role::Color && column.width >= 3 && appearance.map.is_none() {
        let channels = [0, 1, 2].map(|channel| Channel { column, channel });
        return channel_colors(channels, particles.len(), format!("column `{}`", column.name));
    }
    let words = matches!(column.values, Values::Words(_));
    let categorical = appearance.map.is_some_and(Map::is_categorical);
    if words && appearance.range.is_some() {
        return Err(Unfit::new(
            format!("column `{}` holds words, of which there is no range", column.name),
            "leave out the range",
        ));
    }
    let chosen = appearance.map.is_none() && appearance.range.is_none();
    if words || categorical || (column.role == Role::Type && chosen) {
        return Ok(category_colors(column, appearance.map.unwrap_or(TYPES)));
    }
    let (width, values) = (column.width, &column.values);
    if component == MAGNITUDE {
        let length = move |index: usize| {
            let square = |at: usize| values.get(at).map_or(f64::NAN, |value| value * value);
            (width * index..width * (index + 1)).map(square).sum::<f64>().sqrt()
        };
        let name = format!("the length of {}", column.name);
        return map_colors([&name, &column.name], particles.len(), length, appearance, notes);
    }
    let value = move |index: usize| values.get(width * index + component).unwrap_or(f64::NAN);
    map_colors([name; 2], particles.len(), value, appearance, notes)
}

/// Stands for the length of a vector among its components.
const MAGNITUDE: usize = usize::MAX;

/// A column, and which of its components: `vx`, `velocity.x`, `velocity` for its length. None where
/// it is the positions that are meant: `x`, `y` and `z`.
fn component_of<'a>(
    particles: &'a Particles,
    name: &str,
) -> Result<(Option<&'a Column>, usize), Unfit> {
    if particles.column(name).is_none() {
        let same = |axis: &&str| axis.eq_ignore_ascii_case(name);
        if let Some(axis) = ["x", "y", "z"].iter().position(same) {
            return Ok((None, axis));
        }
        if let Some((stem, last)) = name.rsplit_once('.')
            && let Ok(column) = named(particles, stem)
            && column.width > 1
        {
            let number = ["x", "y", "z"].iter().position(|axis| *axis == last);
            let component = number.or_else(|| last.parse().ok()).filter(|n| *n < column.width);
            let unknown = || {
                let fix = match column.width {
                    3 => format!("write {stem}.x, {stem}.y or {stem}.z; {stem} is the length"),
                    width => format!("write {stem}.0 to {stem}.{}", width - 1),
                };
                Unfit::new(format!("column `{stem}` has no `{last}`"), fix)
            };
            return Ok((Some(column), component.ok_or_else(unknown)?));
        }
    }
    let column = named(particles, name)?;
    let component = if column.width == 1 { 0 } else { MAGNITUDE };
    Ok((Some(column), component))
}

/// Colours of numbers by a map. `name` says what they are in words, `label` in short.
fn map_colors(
    [name, label]: [&str; 2],
    count: usize,
    value: impl Fn(usize) -> f64 + Sync,
    appearance: &Appearance,
    notes: &mut Vec<String>,
) -> Result<Colored, Unfit> {
    let map = appearance.map.unwrap_or(Map::VIRIDIS);
    let ends = || {
        let of = |index: usize| {
            let value = value(index);
            if value.is_finite() { [value, value] } else { [f64::INFINITY, f64::NEG_INFINITY] }
        };
        let none = || [f64::INFINITY, f64::NEG_INFINITY];
        let wider = |a: [f64; 2], b: [f64; 2]| [a[0].min(b[0]), a[1].max(b[1])];
        (0..count).into_par_iter().map(of).reduce(none, wider)
    };
    let [low, high] = appearance.range.unwrap_or_else(ends);
    if low > high {
        notes.push(format!("`{name}` has no finite value: all are {}", hex(NAN_COLOR)));
        let legend = Err(format!("`{name}` has no finite value"));
        return Ok(Colored { colors: Colors::Same(NAN_COLOR), from: format!("`{name}`"), legend });
    }
    let range = [low, high];
    let color = |index: usize| map.color(maps::place(value(index), range));
    let outside = |index: &usize| value(*index) < low || value(*index) > high;
    let counted = |is: &(dyn Fn(&usize) -> bool + Sync)| {
        (0..count).into_par_iter().filter(|index| is(index)).count()
    };
    let not_numbers = counted(&|index| value(*index).is_nan());
    if not_numbers > 0 {
        notes
            .push(format!("`{name}` is NaN for {not_numbers}: their colour is {}", hex(NAN_COLOR)));
    }
    let beyond = counted(&outside);
    if beyond > 0 {
        notes.push(format!(
            "`{name}` is outside of the range for {beyond}: they have the colour of \
                            its end"
        ));
    }
    let colors = each(count, |index| color(index).unwrap_or(NAN_COLOR));
    let [low, high] = range.map(short);
    let from = format!("{}, by `{name}` from {low} to {high}", map.name());
    let legend = Ok(Legend::Numbers { map, range, name: text::value(label) });
    Ok(Colored { colors, from, legend })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn particles(columns: Vec<Column>, count: usize) -> Particles {
        let centers: Vec<f64> = (0..3 * count).map(|n| n as f64).collect();
        let (cell, notes, centers_from) = (None, Vec::new(), "x y z".into());
        Particles { centers: Reals::F64(centers.into()), centers_from, columns, cell, notes }
    }

    fn reals(values: &[f64]) -> Values {
        Values::Reals(Reals::F64(values.to_vec().into()))
    }

    fn words(words: &[&str]) -> Values {
        Values::Words(words.iter().collect())
    }

    fn made(columns: Vec<Column>, appearance: &Appearance) -> Result<Spheres, Unfit> {
        let count = columns.first().map_or(2, |column| column.values.len() / column.width);
        spheres(&particles(columns, count), 1.0, appearance)
    }

    fn shown(spheres: &Spheres) -> Vec<(f64, [u8; 3])> {
        let block = &spheres.block;
        (0..block.len()).map(|n| (block.radius(n), block.color(n))).collect()
    }

    #[test]
    fn what_is_there_is_chosen_in_order() {
        let usual = Appearance::default();
        let element = || Column::named("element", words(&["C", "Xx", "o"]));
        let radius = || Column::named("radius", reals(&[0.5, 0.25, 1.0]));
        let diameter = || Column::named("diameter", reals(&[3.0, 2.0, 1.0]));
        let kind = || Column::named("type", Values::Integers(vec![1, 2, 11]));

        let found = made(vec![element(), diameter(), radius(), kind()], &usual).unwrap();
        let [c, o] = [[0x90; 3], [0xff, 0x0d, 0x0d]];
        assert_eq!(shown(&found), [(0.5, c), (0.25, NO_ELEMENT), (1.0, o)]);
        assert!(found.notes.iter().any(|note| note.contains("(Xx)")), "{:?}", found.notes);

        let found = made(vec![diameter(), kind()], &usual).unwrap();
        let [blue, orange] = [[31, 119, 180], [255, 127, 14]];
        assert_eq!(shown(&found), [(1.5, blue), (1.0, orange), (0.5, blue)]);

        let found = made(vec![element()], &usual).unwrap();
        let radii: Vec<f64> = shown(&found).iter().map(|sphere| sphere.0).collect();
        assert_eq!(radii, [1.7, 1.5, 1.52]);
        let found = spheres(&particles(vec![element()], 3), 10.0, &usual).unwrap();
        assert_eq!(found.block.radius(0), 1.7 / 10.0, "in nanometres");

        // Neighbours are at 3 sqrt 3.
        let found = spheres(&particles(Vec::new(), 3), 1.0, &usual).unwrap();
        assert_eq!(shown(&found)[0], (0.5 * 27.0f64.sqrt(), DEFAULT_COLOR));
    }

    /// Names that are no elements are types, and have their colours whichever others there are.
    #[test]
    fn types_keep_their_colours() {
        let usual = Appearance::default();
        let color = |names: &[&str], index: usize| {
            let column = Column::named("species", words(names));
            made(vec![column], &usual).unwrap().block.color(index)
        };
        assert_eq!(color(&["A", "A2"], 1), color(&["A2", "Q"], 0));
        assert_ne!(color(&["A", "D2"], 0), color(&["A", "D2"], 1));
        let one = made(vec![Column::named("type", Values::Integers(vec![3, 2]))], &usual).unwrap();
        let two = made(vec![Column::named("type", Values::Integers(vec![1, 3]))], &usual).unwrap();
        assert_eq!(one.block.color(0), two.block.color(1));
    }

    #[test]
    fn colours_are_bytes_or_parts() {
        let usual = Appearance::default();
        let columns = |values: [Values; 3]| {
            let names = ["red", "green", "blue"];
            names.into_iter().zip(values).map(|(n, v)| Column::named(n, v)).collect()
        };
        let parts = [[0.0, 1.0], [0.5, 1.0], [1.0, 0.0]].map(|v| reals(&v));
        let found = made(columns(parts), &usual).unwrap();
        assert_eq!(shown(&found)[0].1, [0, 128, 255]);
        assert!(found.colors_from.contains("from 0 to 1"), "{}", found.colors_from);
        let bytes = [[0, 255], [128, 2], [1, 0]].map(|v| Values::Integers(v.to_vec()));
        let found = made(columns(bytes), &usual).unwrap();
        assert_eq!((shown(&found)[0].1, shown(&found)[1].1), ([0, 128, 1], [255, 2, 0]));
        let wrong = [[0, 256], [128, 2], [1, 0]].map(|v| Values::Integers(v.to_vec()));
        let unfit = made(columns(wrong), &usual).expect_err("no colour");
        assert!(unfit.words.contains("particle 1") && unfit.words.contains("256"), "{unfit:?}");
        let row = [0, 1, 2, 3, 4, 5].map(|byte: u8| byte).to_vec();
        let column = Column::named("colors", Values::Bytes(row.into())).with_width(3);
        assert_eq!(shown(&made(vec![column], &usual).unwrap())[1].1, [3, 4, 5]);
    }

    #[test]
    fn numbers_become_colours_by_a_map() {
        let column = || Column::named("q", reals(&[-1.0, 0.0, 1.0, 9.0, f64::NAN]));
        let by = |name: &str, range| {
            let color = ColorFrom::Column(name.into());
            made(vec![column()], &Appearance { color, range, ..Appearance::default() })
        };
        let found = by("q", Some([0.0, 1.0])).unwrap();
        let colors: Vec<[u8; 3]> = shown(&found).iter().map(|sphere| sphere.1).collect();
        let [low, high] = [[68, 1, 84], [253, 231, 36]];
        assert_eq!(colors, [low, low, high, high, NAN_COLOR]);
        let notes = found.notes.join("; ");
        assert!(notes.contains("NaN for 1") && notes.contains("outside of the range for 2"));
        let found = by("q", None).unwrap();
        assert!(found.colors_from.contains("from -1 to 9"), "{}", found.colors_from);
        let found = by("z", None).unwrap();
        assert_eq!((shown(&found)[0].1, shown(&found)[4].1), (low, high));
        let unfit = by("charge", None).expect_err("no such column");
        assert!(unfit.fix.contains("x, y, z, q"), "{unfit:?}");

        let vector = Column::named("v", reals(&[3.0, 4.0, 0.0, 0.0, 0.0, 1.0])).with_width(3);
        let by = |name: &str| {
            let color = ColorFrom::Column(name.into());
            let appearance = Appearance { color, ..Appearance::default() };
            spheres(&particles(vec![vector.clone()], 2), 1.0, &appearance)
        };
        assert!(by("v").unwrap().colors_from.contains("from 1 to 5"));
        assert!(by("v.y").unwrap().colors_from.contains("from 0 to 4"));
        assert!(by("v.w").expect_err("three components").fix.contains("v.x"));
    }

    /// Names and colours of a legend are those of the spheres, and only of what is there.
    #[test]
    fn legends_tell_the_colours() {
        let by = |column: Column, name: Option<&str>, range| {
            let color = name.map_or(ColorFrom::Chosen, |name| ColorFrom::Column(name.into()));
            made(vec![column], &Appearance { color, range, ..Appearance::default() }).unwrap()
        };
        let kinds = |found: &Spheres| match &found.legend {
            Ok(Legend::Kinds(kinds)) => kinds.clone(),
            other => panic!("{other:?}"),
        };
        let found = by(Column::named("element", words(&["o", "Xx", "C", "O"])), None, None);
        let colors: Vec<_> = shown(&found).iter().map(|sphere| sphere.1).collect();
        let named = |name: &str, index: usize| (name.to_owned(), colors[index]);
        assert_eq!(kinds(&found), [named("C", 2), named("O", 0), named("no element", 1)]);

        let found = by(Column::named("type", Values::Integers(vec![12, 2, 12])), None, None);
        let of = |index: usize| found.block.color(index);
        assert_eq!(kinds(&found), [("type 2".to_owned(), of(1)), ("type 12".to_owned(), of(0))]);

        let found = by(Column::named("chain", words(&["B", "A"])), Some("chain"), None);
        let of = |index: usize| found.block.color(index);
        assert_eq!(kinds(&found), [("A".to_owned(), of(1)), ("B".to_owned(), of(0))]);

        let q = || Column::named("q", reals(&[-1.5, 4.0]));
        let map = Map::VIRIDIS;
        let numbers = |range| Ok(Legend::Numbers { map, range, name: "q".into() });
        assert_eq!(by(q(), Some("q"), None).legend, numbers([-1.5, 4.0]));
        assert_eq!(by(q(), Some("q"), Some([0.0, 1.0])).legend, numbers([0.0, 1.0]));
        let none = by(q(), None, None).legend.expect_err("one colour");
        assert!(none.contains("one colour"), "{none}");
        let many = Column::named("type", Values::Integers((0..1000).collect()));
        let none = by(many, None, None).legend.expect_err("too many");
        assert!(none.contains("256"), "{none}");
    }

    #[test]
    fn radii_must_be_positive() {
        let columns = vec![Column::named("radius", reals(&[0.5, 0.0]))];
        let unfit = made(columns.clone(), &Appearance::default()).expect_err("no radius");
        assert!(unfit.words.contains("particle 1"), "{unfit:?}");
        let radius = RadiusFrom::Same(2.0);
        let found = Appearance { radius, radius_scale: 0.5, ..Appearance::default() };
        assert_eq!(made(columns, &found).unwrap().block.radius(1), 1.0);
    }
}
