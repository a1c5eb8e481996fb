//! Lines where what is seen changes: edges between samples side by side, and the samples within
//! half a line's width of one. The rules are those of docs/contract.md, "Outlines".

use std::ops::Range;

use rayon::prelude::*;

use planisphere_core::{
    camera::Region,
    ids::NONE,
    levels::{Lit, Sample},
};

use crate::{
    shaded::{Cache, Spheres},
    style::{Between, Outline},
};

/// A bit for each sample of a row.
type Bits = Vec<u64>;

/// The samples of a raster that are on a line.
#[derive(Debug)]
pub struct Lines {
    words: usize,
    rows: Vec<u64>,
}

impl Lines {
    /// Whether a sample, by column and row of the region, is on a line.
    #[inline(always)]
    pub fn has(&self, column: usize, row: usize) -> bool {
        self.rows[row * self.words + column / 64] >> (column % 64) & 1 == 1
    }

    /// The columns of a row, of some, that are on a line.
    #[inline(always)]
    pub fn each(&self, row: usize, columns: Range<usize>, mut take: impl FnMut(usize)) {
        let words = columns.start / 64..columns.end.div_ceil(64);
        let row = &self.rows[row * self.words..(row + 1) * self.words];
        for (word, &bits) in words.clone().zip(&row[words]) {
            let mut bits = bits;
            while bits != 0 {
                let column = 64 * word + bits.trailing_zeros() as usize;
                bits &= bits - 1;
                if columns.contains(&column) {
                    take(column);
                }
            }
        }
    }

    /// Of the ids of a region of a raster, for a line so many samples wide.
    pub fn new(
        outline: &Outline,
        width: f64,
        spheres: &Spheres,
        region: Region,
        ids: &[i32],
    ) -> Self {
        let (columns, rows) = (region.width as usize, region.height as usize);
        let words = columns.div_ceil(64);
        let brush = Brush::new(width);
        let found: Vec<Edges> = (0..rows)
            .into_par_iter()
            .with_min_len(8)
            .map_init(
                || Finder { outline, spheres: spheres.cache(), region, ids, sided: brush.sided },
                |finder, row| finder.row(row, words),
            )
            .collect();
        let mut marked = vec![0; words * rows];
        marked.par_chunks_mut(words).with_min_len(8).enumerate().for_each(|(row, to)| {
            brush.paint(&found, row, to);
        });
        Self { words, rows: marked }
    }
}

/// Edges that begin at the samples of a row: a bit for each.
#[derive(Default)]
struct Edges {
    /// To the next sample of the row; empty if there is none.
    across: Bits,
    /// Of these, those whose first sample is the nearer. Only where a line's width needs it.
    first_across: Bits,
    /// To the sample below.
    down: Bits,
    /// Of these, those whose upper sample is the nearer.
    first_down: Bits,
}

/// Finds edges.
struct Finder<'a> {
    outline: &'a Outline,
    spheres: Cache<'a>,
    region: Region,
    ids: &'a [i32],
    /// Whether it matters which of two samples is the nearer.
    sided: bool,
}

impl Finder<'_> {
    fn row(&mut self, row: usize, words: usize) -> Edges {
        let width = self.region.width as usize;
        let ids = self.ids;
        let here = &ids[row * width..(row + 1) * width];
        let mut edges = Edges::default();
        let (across, first) = self.differing(here, &here[1..], row, [1, 0], words);
        (edges.across, edges.first_across) = (across, first);
        if let Some(below) = ids.get((row + 1) * width..(row + 2) * width) {
            let (down, first) = self.differing(here, below, row, [0, 1], words);
            (edges.down, edges.first_down) = (down, first);
        }
        edges
    }

    /// Edges from the samples of a row to others.
    fn differing(
        &mut self,
        here: &[i32],
        there: &[i32],
        row: usize,
        step: [u32; 2],
        words: usize,
    ) -> (Bits, Bits) {
        let (mut edges, mut firsts) = (Bits::new(), Bits::new());
        for (word, (here, there)) in here.chunks(64).zip(there.chunks(64)).enumerate() {
            let pairs = here.iter().zip(there).enumerate();
            let mut differ = pairs.fold(0u64, |bits, (k, (a, b))| bits | u64::from(a != b) << k);
            let mut soon = differ;
            while soon != 0 {
                let k = soon.trailing_zeros() as usize;
                soon &= soon - 1;
                self.spheres.prefetch(there[k]);
            }
            while differ != 0 {
                let k = differ.trailing_zeros() as usize;
                differ &= differ - 1;
                let column = self.region.x + (64 * word + k) as u32;
                let at = [column, self.region.y + row as u32];
                let to = [at[0] + step[0], at[1] + step[1]];
                if let Some(first) = self.edge((here[k], at), (there[k], to)) {
                    if edges.is_empty() {
                        (edges, firsts) = (vec![0; words], vec![0; words]);
                    }
                    edges[word] |= 1 << k;
                    firsts[word] |= u64::from(first) << k;
                }
            }
        }
        (edges, firsts)
    }

    /// Whether there is an edge between two samples of different spheres, and if it matters whether
    /// the first is the nearer.
    fn edge(&mut self, one: (i32, Sample), two: (i32, Sample)) -> Option<bool> {
        if one.0 == NONE || two.0 == NONE {
            return Some(two.0 == NONE);
        }
        let Outline { between, jump, .. } = *self.outline;
        let spheres = self.spheres.spheres();
        let always = match between {
            Between::Jumps => false,
            Between::Groups => spheres.group(one.0) != spheres.group(two.0),
            Between::Spheres => true,
        };
        if always && !self.sided {
            return Some(true);
        }
        let (a, b) = (self.spheres.lit(one.0), self.spheres.lit(two.0));
        let by = |near: &Lit| jump.unwrap_or(near.ball.radius);
        let (here, there) = ((&a, one.1), (&b, two.1));
        let (first, jumps) = spheres.levels().step(here, there, one.0 < two.0, by);
        (always || jumps).then_some(first)
    }
}

/// Offsets from an edge to the samples that are within half a line's width of it.
struct Brush {
    /// For edges along a row: of each row that is so far up or down, offsets of the columns.
    across: Vec<Span>,
    /// For edges down a column: of the row `k` below the edge's lower sample or above its upper.
    down: Vec<Span>,
    /// Whether any sample is just at half the width.
    sided: bool,
}

/// How far a line goes in a row: columns on each side, if any, and whether one more is just at half
/// its width.
#[derive(Clone, Copy)]
struct Span {
    columns: Option<u32>,
    tie: bool,
}

impl Brush {
    /// Of a line so many samples wide.
    fn new(width: f64) -> Self {
        // The sign of a square less that of the width: one rounding does not change it.
        let inside = |square: u64| {
            let rest = width.mul_add(width, -(square as f64));
            if rest > 0.0 {
                1
            } else if rest < 0.0 {
                -1
            } else {
                0
            }
        };
        // `first` is twice the least distance in the row: 1 beside an edge, 0 in line with one.
        let span = |first: u64, off: u64| {
            let square = |k: u64| (first + 2 * k) * (first + 2 * k) + off * off;
            let count = (0..).take_while(|&k| inside(square(k)) > 0).count() as u64;
            let columns = u32::try_from(count).ok().and_then(|count| count.checked_sub(1));
            Span { columns, tie: inside(square(count)) == 0 }
        };
        let some = |span: &Span| span.columns.is_some() || span.tie;
        let across: Vec<Span> = (0..).map(|k| span(1, 2 * k)).take_while(some).collect();
        let down: Vec<Span> = (0..).map(|k| span(0, 2 * k + 1)).take_while(some).collect();
        let sided = across.iter().chain(&down).any(|span| span.tie);
        Self { across, down, sided }
    }

    /// The samples of a row that are on lines of the edges around.
    fn paint(&self, edges: &[Edges], row: usize, to: &mut [u64]) {
        for (k, span) in self.across.iter().enumerate() {
            let above = row.checked_sub(k).filter(|_| k > 0).map(|row| &edges[row]);
            for edges in edges.get(row + k).into_iter().chain(above) {
                if let Some(columns) = span.columns {
                    spread(&edges.across, columns, columns + 1, to);
                }
                if span.tie {
                    // One beyond the columns, on the side of the nearer.
                    let beyond = span.columns.map_or(0, |columns| columns + 1) as i64;
                    let second = difference(&edges.across, &edges.first_across);
                    shifted(&edges.first_across, -beyond, to);
                    shifted(&second, beyond + 1, to);
                }
            }
        }
        for (k, span) in self.down.iter().enumerate() {
            // Below the edge's lower sample, and above its upper one.
            let below = row.checked_sub(k + 1).map(|row| (&edges[row], false));
            let above = edges.get(row + k).map(|edges| (edges, true));
            for (edges, upper) in below.into_iter().chain(above) {
                if let Some(columns) = span.columns {
                    spread(&edges.down, columns, columns, to);
                }
                if span.tie {
                    let beyond = span.columns.map_or(0, |columns| columns + 1) as i64;
                    let near = match upper {
                        true => edges.first_down.clone(),
                        false => difference(&edges.down, &edges.first_down),
                    };
                    shifted(&near, -beyond, to);
                    shifted(&near, beyond, to);
                }
            }
        }
    }
}

/// The bits of one that are not in another.
fn difference(one: &[u64], other: &[u64]) -> Bits {
    one.iter().zip(other).map(|(one, other)| one & !other).collect()
}

/// Adds bits moved to higher places, or to lower ones.
fn shifted(bits: &[u64], by: i64, to: &mut [u64]) {
    let (words, bit) = (by.div_euclid(64), by.rem_euclid(64) as u32);
    for (at, &word) in (words..).zip(bits).filter(|(_, word)| **word != 0) {
        let mut add = |at: i64, word: u64| {
            if let Some(to) = usize::try_from(at).ok().and_then(|at| to.get_mut(at)) {
                *to |= word;
            }
        };
        add(at, word << bit);
        if bit > 0 {
            add(at + 1, word >> (64 - bit));
        }
    }
}

/// Adds bits at all places from `left` lower to `right` higher.
fn spread(bits: &[u64], left: u32, right: u32, to: &mut [u64]) {
    if bits.is_empty() {
        return;
    }
    // Runs double: after each step a bit stands at `have` places.
    let (mut run, want) = (bits.to_vec(), left + right + 1);
    // Room for what moves beyond the last word and comes back.
    run.resize(bits.len() + want.div_ceil(64) as usize, 0);
    let mut have = 1;
    while have < want {
        let by = have.min(want - have);
        let before = run.clone();
        shifted(&before, by.into(), &mut run);
        have += by;
    }
    shifted(&run, -i64::from(left), to);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_are_spread() {
        for (left, right) in [(0, 0), (0, 1), (3, 4), (63, 0), (0, 64), (70, 129)] {
            for at in [0usize, 1, 5, 63, 64, 100, 255] {
                let mut bits = vec![0; 4];
                bits[at / 64] |= 1 << (at % 64);
                let mut to = vec![0; 4];
                spread(&bits, left, right, &mut to);
                for k in 0..256usize {
                    let want = k + left as usize >= at && k <= at + right as usize;
                    assert_eq!(to[k / 64] >> (k % 64) & 1 == 1, want, "{at} {left} {right} {k}");
                }
            }
        }
    }

    /// Offsets against the contract's words, for widths that are met just and that are not.
    #[test]
    fn brushes_are_discs() {
        for width in [0.4, 1.0, 1.5, 2.0, 3.0, 5.0, 6.5, 13.0, 25.0] {
            let brush = Brush::new(width);
            let mut tie = false;
            for (dy, dx) in (-15i64..=15).flat_map(|dy| (-15i64..=15).map(move |dx| (dy, dx))) {
                // The edge lies between columns 0 and 1 of row 0.
                let square = ((2 * dx - 1).pow(2) + (2 * dy).pow(2)) as f64;
                let span = brush.across.get(dy.unsigned_abs() as usize);
                let off = if dx > 0 { dx - 1 } else { -dx };
                let inside = span.is_some_and(|span| {
                    span.columns.is_some_and(|columns| off <= i64::from(columns))
                });
                assert_eq!(inside, square < width * width, "{width} {dx} {dy}");
                let just = span.is_some_and(|span| {
                    span.tie && off == span.columns.map_or(0, |columns| i64::from(columns) + 1)
                });
                assert_eq!(just, square == width * width, "{width} {dx} {dy}");
                tie |= just;
            }
            assert_eq!(brush.sided, tie, "{width}");
        }
    }
}
