//! Deflate (RFC 1951) of rows of runs of pixels, which is what a flat picture of spheres consists
//! of.
//!
//! A general compressor searches for repetitions byte by byte. Here they are known: a run repeats
//! its first pixel, and that pixel repeats the row above or the last run of its colour. The work is
//! a little for each run, and almost none for each pixel.
//!
//! Rows are compressed in bands. A band is one block with Huffman codes of its own. It ends on a
//! whole byte with an empty stored block, as zlib's `Z_SYNC_FLUSH` does, so that bands that were
//! compressed side by side follow one another in the stream (`zlib.rs`).
//!
//! This module knows rows of pixels, and neither ids nor files. What it writes is read back in the
//! tests by two decoders that are not ours.

use crate::zlib::{
    Adler, Bits, Code, DISTANCES, END, LONGEST, SYMBOLS, WINDOW, distance_code, length_code,
    write_codes,
};

/// Most pixels of a copy.
const MOST: usize = LONGEST / 3;
/// Places of [`Seen`] colours.
const PLACES: usize = 1 << 11;

/// Pixels of one colour, side by side in a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Run {
    /// The column after its last.
    pub end: u32,
    /// `0x00rrggbb`.
    pub color: u32,
}

impl Adler {
    /// Adds a row: a zero, which names its filter (none), and its runs.
    fn row(&mut self, runs: &[Run]) {
        // A row of 2^15 pixels adds less than 2^42, so that one remainder a row is enough.
        let (mut a, mut b, mut start) = (self.a, self.b + self.a, 0);
        for run in runs {
            let n = u64::from(run.end - start);
            start = run.end;
            let [_, red, green, blue] = run.color.to_be_bytes().map(u64::from);
            let sum = red + green + blue;
            // After each byte `b` grows by `a`, and `a` is what it was before the pixel and its
            // bytes.
            b += n * (3 * a + 3 * red + 2 * green + blue) + 3 * sum * (n * n.saturating_sub(1) / 2);
            a += n * sum;
        }
        self.bytes += 1 + 3 * u64::from(start);
        (self.a, self.b) = (a % Self::MODULUS, b % Self::MODULUS);
    }
}

/// The last run of a colour.
#[derive(Clone, Copy)]
struct Seen {
    color: u32,
    /// Its first, counted in the band.
    byte: u32,
    pixels: u32,
}

/// What is written, before there are codes for it.
///
/// A pixel as three bytes is its colour. A copy is [`Step::COPY`], 15 bits for its pixels, and 16
/// for its distance in bytes less 1.
#[derive(Clone, Copy)]
struct Step(u32);

impl Step {
    const COPY: u32 = 1 << 31;
    /// The zero that begins a row.
    const ROW: u32 = 1 << 30;
}

/// Rows that are compressed together.
pub(super) struct Band {
    /// Bytes of a row, with the one that names its filter.
    row_bytes: usize,
    /// Bytes before the current row; a row above the band counts.
    at: usize,
    above: Vec<Run>,
    steps: Vec<Step>,
    /// How often each symbol occurs.
    symbols: [u32; SYMBOLS],
    distances: [u32; DISTANCES],
    /// By a hash of the colour.
    seen: Box<[Seen; PLACES]>,
    adler: Adler,
}

impl Band {
    /// No rows yet, below a row of the picture if it has one there.
    pub(super) fn new(width: usize, above: Vec<Run>) -> Self {
        let row_bytes = 3 * width + 1;
        Self {
            row_bytes,
            at: row_bytes,
            above,
            steps: Vec::new(),
            symbols: [0; SYMBOLS],
            distances: [0; DISTANCES],
            // No colour has the highest bits.
            seen: Box::new([Seen { color: u32::MAX, byte: 0, pixels: 0 }; PLACES]),
            adler: Adler::new(),
        }
    }

    /// Adds a row, whose neighbouring runs differ; gives back the memory of an earlier one.
    pub(super) fn row(&mut self, runs: Vec<Run>) -> Vec<Run> {
        self.adler.row(&runs);
        self.steps.push(Step(Step::ROW));
        self.symbols[0] += 1;
        let above = std::mem::take(&mut self.above);
        let reached = self.row_bytes <= WINDOW;
        // The current run, the column where what is left of it begins, and the run above that.
        let (mut place, mut x, mut over) = (0, 0, 0);
        while let Some(&run) = runs.get(place) {
            let pixels = (run.end - x) as usize;
            if reached {
                while above.get(over).is_some_and(|above| above.end <= x) {
                    over += 1;
                }
                let alike = Alike::of(x, &runs[place..], &above[over..]);
                if alike.runs > 0 && alike.pixels.div_ceil(MOST) <= alike.runs {
                    self.copy(alike.pixels, self.row_bytes);
                    for run in &runs[place..place + alike.runs] {
                        self.remember(*run, x);
                        x = run.end;
                    }
                    place += alike.runs;
                    // A run that goes on where the one above has ended repeats its own pixel.
                    if alike.rest > 0 {
                        self.copy(alike.rest, 3);
                        x = runs[place].end;
                        place += 1;
                    }
                    continue;
                }
            }
            let seen = self.remember(run, x);
            let distance = self.byte(x) - seen.byte as usize;
            let first = if seen.color == run.color && distance <= WINDOW {
                pixels.min(seen.pixels as usize).min(MOST)
            } else {
                0
            };
            if first > 0 {
                self.copy(first, distance);
                self.copy(pixels - first, 3);
            } else {
                self.pixel(run.color);
                self.copy(pixels - 1, 3);
            }
            x = run.end;
            place += 1;
        }
        self.at += self.row_bytes;
        self.above = runs;
        above
    }

    /// The first byte of a column of the current row.
    fn byte(&self, x: u32) -> usize {
        self.at + 1 + 3 * x as usize
    }

    /// Notes where a run begins; gives what was noted there before, which may be another colour's.
    fn remember(&mut self, run: Run, x: u32) -> Seen {
        let seen = Seen { color: run.color, byte: self.byte(x) as u32, pixels: run.end - x };
        let place = run.color.wrapping_mul(0x9e37_79b1) >> (u32::BITS - PLACES.ilog2());
        std::mem::replace(&mut self.seen[place as usize], seen)
    }

    /// A pixel as three bytes.
    fn pixel(&mut self, color: u32) {
        self.steps.push(Step(color));
        for byte in channels(color) {
            self.symbols[byte] += 1;
        }
    }

    /// Pixels as they are at a distance before.
    fn copy(&mut self, mut pixels: usize, distance: usize) {
        let symbol = distance_code(distance).symbol;
        while pixels > 0 {
            let now = pixels.min(MOST);
            pixels -= now;
            self.steps.push(Step(Step::COPY | (now as u32) << 16 | (distance as u32 - 1)));
            self.symbols[length_code(3 * now).symbol] += 1;
            self.distances[symbol] += 1;
        }
    }

    /// The band's bytes, and the checksum of its rows.
    pub(super) fn finish(mut self) -> (Vec<u8>, Adler) {
        self.symbols[END] = 1;
        // There must be a code for distances, whether it is used or not.
        if self.distances.iter().all(|&times| times == 0) {
            self.distances[0] = 1;
        }
        let (symbols, distances) = (Code::new(&self.symbols, 15), Code::new(&self.distances, 15));
        let mut bits = Bits::with_capacity(2 * self.steps.len() + 512);
        // Not the last block, with codes of its own.
        bits.put(0b100, 3);
        write_codes(&mut bits, &symbols.lengths, &distances.lengths);
        let literals = symbols.literals();
        // Of all numbers of pixels (there is none of 0), and of the usual distances.
        let lengths: [_; MOST + 1] =
            std::array::from_fn(|pixels| symbols.with(&length_code(3 * pixels.max(1))));
        let [left, above] = [3, self.row_bytes.min(WINDOW)]
            .map(|distance| distances.with(&distance_code(distance)));
        for Step(step) in self.steps {
            if step & Step::COPY != 0 {
                let (length, count) = lengths[(step >> 16 & 0x7fff) as usize];
                let distance = (step & 0xffff) as usize + 1;
                let (code, more) = if distance == 3 {
                    left
                } else if distance == self.row_bytes {
                    above
                } else {
                    distances.with(&distance_code(distance))
                };
                bits.put(length | code << count, count + more);
            } else if step == Step::ROW {
                symbols.put(&mut bits, 0);
            } else {
                let [red, green, blue] = channels(step).map(|byte| literals[byte]);
                let (green, both) = (green.0 << red.1, red.1 + green.1);
                bits.put(red.0 | green | blue.0 << both, both + blue.1);
            }
        }
        symbols.put(&mut bits, END);
        (bits.flush(), self.adler)
    }
}

/// Red, green and blue.
fn channels(color: u32) -> [usize; 3] {
    [16, 8, 0].map(|shift| (color >> shift & 0xff) as usize)
}

/// How far a row is as the one above it.
struct Alike {
    /// Whole runs.
    runs: usize,
    /// Pixels, of these runs and of the next one.
    pixels: usize,
    /// Pixels that are left of that next run, if any is alike.
    rest: usize,
}

impl Alike {
    /// From a column on, in which the first runs of both lie.
    fn of(x: u32, runs: &[Run], above: &[Run]) -> Self {
        let (mut whole, mut end, mut rest) = (0, x, 0);
        for (run, above) in
            runs.iter().zip(above).take_while(|(run, above)| run.color == above.color)
        {
            end = run.end.min(above.end);
            rest = run.end - end;
            whole += usize::from(rest == 0);
            if run.end != above.end {
                break;
            }
        }
        Self { runs: whole, pixels: (end - x) as usize, rest: rest as usize }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_of_runs_are_sums_of_bytes() {
        let runs = [
            Run { end: 1, color: 0xff_ffff },
            Run { end: 30_000, color: 0x00_ff01 },
            Run { end: 32_768, color: 7 },
        ];
        let mut bytes = vec![0];
        let mut start = 0;
        for run in runs {
            (start..run.end).for_each(|_| bytes.extend(channels(run.color).map(|byte| byte as u8)));
            start = run.end;
        }
        let of = |bytes: &[u8]| {
            bytes.iter().fold((1u32, 0u32), |(a, b), &byte| {
                let a = (a + u32::from(byte)) % 65_521;
                (a, (b + a) % 65_521)
            })
        };
        let mut one = Adler::new();
        one.row(&runs);
        let mut two = one;
        two.row(&runs);
        let twice = [bytes.clone(), bytes.clone()].concat();
        for (adler, bytes) in [
            (one, &bytes),
            (two, &twice),
            (one.then(one), &twice),
            (Adler::new().then(one), &bytes),
        ] {
            let (a, b) = of(bytes);
            assert_eq!(adler.bytes(), (b << 16 | a).to_be_bytes());
        }
    }
}
