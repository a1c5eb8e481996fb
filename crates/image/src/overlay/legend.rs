//! The legend, at the right: a colour bar with ticks, or discs with names.

use super::{
    OverlayError,
    block::{At, Block, Rows, Style, text},
    font::{self, CAPITAL},
    layout::Problem,
    numbers::{self, Ticks},
    raster::Path,
};
use crate::maps::{self, Map};

const PART: &str = "legend";

/// What the colours of a picture mean.
#[derive(Clone, Debug, PartialEq)]
pub enum Legend {
    /// Numbers: a vertical bar of the colours of a map.
    Bar {
        /// The colours.
        map: Map,
        /// The values of its ends, the lower one first.
        range: [f64; 2],
        /// What the numbers are, with their unit; empty for none. It is above the bar.
        label: String,
    },
    /// Kinds, such as elements or types: a disc of each colour (sRGB), and its name.
    Keys(Vec<(String, [u8; 3])>),
}

/// The room of a legend: from this row to that one.
pub type Room = [f64; 2];

impl Legend {
    /// Its blocks.
    pub fn blocks(&self, style: &Style, room: Room) -> Result<Vec<Block>, Problem> {
        match self {
            Self::Bar { map, range, label } => bar(*map, *range, label, style, room),
            Self::Keys(keys) => Ok(vec![list(keys, style, room)?]),
        }
    }
}

/// The colours of a bar's rows, from the top: each that of the value at its middle.
pub fn colors(map: Map, range: [f64; 2], rows: usize) -> Vec<[u8; 3]> {
    let row = |row: usize| {
        let place = 1.0 - (row as f64 + 0.5) / rows as f64;
        // A range of one number has the colour of that number.
        let place = if range[0] == range[1] { maps::place(range[0], range) } else { place };
        map.color(place).expect("a place is a number")
    };
    (0..rows).map(row).collect()
}

/// Height of the bar at most, in heights of text: half of the picture's shorter side.
const BAR: f64 = 18.0;

/// The distance of two ticks that is better than more ticks, and the least at which their numbers
/// are apart, in heights of text.
const APART: [f64; 2] = [1.5, 0.82];

/// The ticks that a bar of this height has room for.
fn choose(range: [f64; 2], height: f64, style: &Style) -> Option<Ticks> {
    let choices = numbers::ticks(range);
    let is_apart = |ticks: &&Ticks, least: f64| {
        let mut pairs = ticks.marks.windows(2);
        pairs.all(|pair| (pair[1].0 - pair[0].0) * height >= least * style.text)
    };
    let airy = choices.iter().rev().find(|ticks| is_apart(ticks, APART[0]));
    airy.or_else(|| choices.iter().find(|ticks| is_apart(ticks, APART[1]))).cloned()
}

fn bar(
    map: Map,
    range: [f64; 2],
    label: &str,
    style: &Style,
    [top, bottom]: Room,
) -> Result<Vec<Block>, Problem> {
    let unit = style.text;
    if !(range[0] <= range[1] && range.iter().all(|end| end.is_finite())) {
        return Err(OverlayError::Range(range).into());
    }
    // First without a line for the power of ten; where the ticks have one, with it.
    let label = if label.is_empty() { None } else { Some(text(PART, label, unit)?) };
    let height = |lines: usize| {
        let head = match lines {
            0 => 0.0,
            lines => (above(unit) + 0.8 * unit + 1.3 * unit * (lines - 1) as f64).ceil(),
        };
        (head, (bottom - top - head).min(BAR * unit).floor())
    };
    let lines = usize::from(label.is_some());
    let chosen = [lines, lines + 1].into_iter().find_map(|all| {
        let (head, height) = height(all);
        let ticks = choose(range, height, style)?;
        (all > lines || ticks.power == 0).then_some((head, height, ticks))
    });
    let (head, height, ticks) = chosen.ok_or(Problem::Unfit(PART))?;
    let start = (top + 0.5 * (bottom - top - head - height)).floor() + head;
    let place = Bar { map, range, top: start, height };
    let (block, left) = place.block(&ticks, style)?;
    // Above the bar: the power of ten next to it, then the label.
    let power = (ticks.power != 0).then(|| text(PART, &numbers::power_of_ten(ticks.power), unit));
    let (mut words, mut baseline) = (Block::new(PART), start - above(unit));
    for line in [power.transpose()?, label].into_iter().flatten() {
        let right = style.size[0] - style.margin;
        let at = if left + line.width <= right { At::Left(left) } else { At::Right(right) };
        words.line(line, at, baseline, style.ink);
        baseline -= (1.3 * unit).round();
    }
    Ok(vec![block, words])
}

/// From the bar up to the baseline of the text above it: half of a tick's number, what letters
/// reach below the baseline, and two halos.
fn above(unit: f64) -> f64 {
    (0.9 * unit + 2.0).ceil()
}

/// Where a bar lies, in whole pixels, and what it shows.
struct Bar {
    map: Map,
    range: [f64; 2],
    top: f64,
    height: f64,
}

impl Bar {
    /// The bar with its ticks and numbers, and its left border.
    fn block(&self, ticks: &Ticks, style: &Style) -> Result<(Block, f64), Problem> {
        let (unit, thin, ink) = (style.text, style.thin(), style.ink);
        let mut lines = Vec::new();
        for (place, label) in &ticks.marks {
            lines.push((*place, text(PART, label, unit)?));
        }
        let widest = lines.iter().fold(0.0_f64, |most, (_, line)| most.max(line.width));
        let far = style.size[0] - style.margin;
        let [mark, gap, width] = [0.3, 0.25, 0.85].map(|part| (part * unit).round());
        let right = (far - widest - gap - mark).floor();
        let (left, top, bottom) = (right - width, self.top, self.top + self.height);
        let mut block = Block::new(PART);
        let colors = colors(self.map, self.range, self.height as usize);
        block.rows = Some(Rows { at: [left as i64, top as i64], width: width as usize, colors });
        // The frame lies around the colours.
        block.rectangle([left - thin, top - thin], [right + thin, top], ink);
        block.rectangle([left - thin, bottom], [right + thin, bottom + thin], ink);
        block.rectangle([left - thin, top], [left, bottom], ink);
        block.rectangle([right, top], [right + thin, bottom], ink);
        for (place, line) in lines {
            let y = top + (1.0 - place) * self.height;
            let edge = (y - 0.5 * thin).round();
            block.rectangle([right + thin, edge], [right + mark, edge + thin], ink);
            let baseline = (y + 0.5 * font::CAPITAL * unit).round();
            block.line(line, At::Right(far), baseline, ink);
        }
        Ok((block, left - thin))
    }
}

/// Discs with names, in columns, in the upper right corner.
fn list(keys: &[(String, [u8; 3])], style: &Style, room: Room) -> Result<Block, Problem> {
    let unit = style.text;
    if keys.is_empty() {
        return Err(OverlayError::NoKeys.into());
    }
    let (pitch, radius, gap, between) = (1.35 * unit, 0.45 * unit, 0.4 * unit, unit);
    let rows = ((room[1] - room[0]) / pitch).floor() as usize;
    // Of so many columns no name is seen.
    let most = (style.size[0] / (2.0 * radius + between)) as usize;
    if rows == 0 || keys.len().div_ceil(rows) > most {
        return Err(Problem::Unfit(PART));
    }
    let columns = keys.len().div_ceil(rows);
    let rows = keys.len().div_ceil(columns);
    let mut block = Block::new(PART);
    let mut right = style.size[0] - style.margin;
    // From the last column, which is at the right, to the first.
    let starts: Vec<usize> = (0..keys.len()).step_by(rows).collect();
    for &start in starts.iter().rev() {
        let column = &keys[start..keys.len().min(start + rows)];
        let mut lines = Vec::new();
        for (name, color) in column {
            lines.push((text(PART, name, unit)?, *color));
        }
        let left = right - lines.iter().fold(0.0_f64, |most, (line, _)| most.max(line.width));
        for (row, (line, color)) in lines.into_iter().enumerate() {
            let middle = (room[0] + (row as f64 + 0.5) * pitch).round();
            // In a ring: the colour may be that of the background.
            for (less, color) in [(0.0, style.ink), (style.thin(), color)] {
                let mut disc = Path::default();
                disc.disc([left - gap - radius, middle], radius - less);
                block.add(disc, color);
            }
            block.line(line, At::Left(left), (middle + 0.5 * CAPITAL * unit).round(), style.ink);
        }
        right = left - gap - 2.0 * radius - between;
    }
    Ok(block)
}
