//! Deflate (RFC 1951) of rows of runs of pixels, which is what a flat picture of spheres consists
//! of.
//!
//! A general compressor searches for repetitions byte by byte. Here they are known: a run repeats
//! its first pixel, and that pixel repeats the row above or the last run of its colour. The work is
//! a little for each run, and almost none for each pixel.
//!
//! Rows are compressed in bands. A band is one block with Huffman codes of its own. It ends on a
//! whole byte with an empty stored block, as zlib's `Z_SYNC_FLUSH` does, so that bands that were
//! compressed side by side follow one another in the stream. A stream is [`HEADER`], bands,
//! [`LAST`], and the checksum of all rows.
//!
//! This module knows rows of pixels, and neither ids nor files. What it writes is read back in the
//! tests by two decoders that are not ours.

/// Begins a zlib stream (RFC 1950).
pub(super) const HEADER: [u8; 2] = [0x78, 0x01];
/// The last block: an empty one with the fixed codes.
pub(super) const LAST: [u8; 2] = [3, 0];

/// What follows three zero bits on the next whole byte: the lengths of an empty stored block.
const FLUSH: [u8; 4] = [0, 0, 0xff, 0xff];
/// Bytes before the current one that a copy can begin at.
const WINDOW: usize = 1 << 15;
/// Most bytes of a copy, which are whole pixels.
const LONGEST: usize = 258;
/// Most pixels of a copy.
const MOST: usize = LONGEST / 3;
/// Symbols of bytes, of a block's end, and of lengths.
const SYMBOLS: usize = 286;
/// Symbols of distances.
const DISTANCES: usize = 30;
/// The symbol of a block's end.
const END: usize = 256;
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

/// Adler-32 (RFC 1950) of bytes, and how many they are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Adler {
    a: u64,
    b: u64,
    bytes: u64,
}

impl Adler {
    const MODULUS: u64 = 65_521;

    /// Of no bytes.
    pub(super) const fn new() -> Self {
        Self { a: 1, b: 0, bytes: 0 }
    }

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

    /// Of these bytes and the next ones.
    pub(super) fn then(self, next: Self) -> Self {
        // What the next bytes began with, 1, is replaced by what is there after these.
        let more = (self.a + Self::MODULUS - 1) % Self::MODULUS;
        Self {
            a: (next.a + more) % Self::MODULUS,
            b: (self.b + next.b + next.bytes % Self::MODULUS * more) % Self::MODULUS,
            bytes: self.bytes + next.bytes,
        }
    }

    /// The checksum, as it ends a stream.
    pub(super) fn bytes(self) -> [u8; 4] {
        ((self.b << 16 | self.a) as u32).to_be_bytes()
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
        // Of all numbers of pixels (there is none of 0), and of the usual distances.
        let lengths: [_; MOST + 1] =
            std::array::from_fn(|pixels| symbols.with(&length_code(3 * pixels.max(1))));
        let [left, above] = [3, self.row_bytes.min(WINDOW)]
            .map(|distance| distances.with(&distance_code(distance)));
        for Step(step) in self.steps {
            if step & Step::COPY != 0 {
                let (length, count) = lengths[(step >> 16 & 0x7fff) as usize];
                bits.put(length, count);
                let distance = (step & 0xffff) as usize + 1;
                let (code, count) = if distance == 3 {
                    left
                } else if distance == self.row_bytes {
                    above
                } else {
                    distances.with(&distance_code(distance))
                };
                bits.put(code, count);
            } else if step == Step::ROW {
                symbols.put(&mut bits, 0);
            } else {
                for byte in channels(step) {
                    symbols.put(&mut bits, byte);
                }
            }
        }
        symbols.put(&mut bits, END);
        bits.put(0, 3);
        bits.align();
        bits.bytes.extend_from_slice(&FLUSH);
        (bits.bytes, self.adler)
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

/// A symbol and the bits after it.
struct Coded {
    symbol: usize,
    extra: u64,
    bits: u32,
}

/// A length from 3 to 258.
fn length_code(length: usize) -> Coded {
    let rest = length - 3;
    if length == LONGEST {
        Coded { symbol: 285, extra: 0, bits: 0 }
    } else if rest < 8 {
        Coded { symbol: 257 + rest, extra: 0, bits: 0 }
    } else {
        let bits = rest.ilog2() - 2;
        let symbol = 257 + 4 * (bits as usize + 1) + (rest >> bits & 3);
        Coded { symbol, extra: (rest & ((1 << bits) - 1)) as u64, bits }
    }
}

/// A distance from 1 to 32768.
fn distance_code(distance: usize) -> Coded {
    let rest = distance - 1;
    if rest < 4 {
        return Coded { symbol: rest, extra: 0, bits: 0 };
    }
    let bits = rest.ilog2() - 1;
    let symbol = 2 * (bits as usize + 1) + (rest >> bits & 1);
    Coded { symbol, extra: (rest & ((1 << bits) - 1)) as u64, bits }
}

/// A canonical Huffman code.
struct Code {
    /// Bits of each symbol's code; 0 where it has none.
    lengths: Vec<u8>,
    /// With the first bit lowest.
    codes: Vec<u16>,
}

impl Code {
    /// For symbols that occur so often, of at most so many bits.
    fn new(times: &[u32], most: u8) -> Self {
        let lengths = code_lengths(times, most);
        let mut count = [0; 16];
        for &length in lengths.iter().filter(|&&length| length > 0) {
            count[usize::from(length)] += 1;
        }
        let (mut next, mut code) = ([0u16; 16], 0);
        for length in 1..16 {
            code = (code + count[length - 1]) << 1;
            next[length] = code;
        }
        let code = |&length: &u8| match length {
            0 => 0,
            _ => {
                let code = next[usize::from(length)];
                next[usize::from(length)] += 1;
                code.reverse_bits() >> (16 - length)
            }
        };
        Self { codes: lengths.iter().map(code).collect(), lengths }
    }

    /// The code of a symbol with the bits after it, and how many bits these are.
    fn with(&self, coded: &Coded) -> (u64, u32) {
        let length = u32::from(self.lengths[coded.symbol]);
        (u64::from(self.codes[coded.symbol]) | coded.extra << length, length + coded.bits)
    }

    /// Writes a symbol's code.
    fn put(&self, bits: &mut Bits, symbol: usize) {
        bits.put(self.codes[symbol].into(), self.lengths[symbol].into());
    }
}

/// The lengths of Huffman's code. Where one is too long, all numbers are made more alike until none
/// is.
fn code_lengths(times: &[u32], most: u8) -> Vec<u8> {
    let mut lengths = vec![0; times.len()];
    let used = times.iter().zip(0..).filter(|(times, _)| **times > 0);
    let mut leaves: Vec<(u64, usize)> =
        used.map(|(&times, symbol)| (u64::from(times), symbol)).collect();
    if leaves.len() <= 2 {
        leaves.iter().for_each(|&(_, symbol)| lengths[symbol] = 1);
        return lengths;
    }
    loop {
        leaves.sort_unstable();
        // The leaves, and then the nodes above them in the order in which they are made: both rise.
        let n = leaves.len();
        let mut weights: Vec<u64> = leaves.iter().map(|&(times, _)| times).collect();
        let mut parents = vec![0; 2 * n - 1];
        let (mut leaf, mut node) = (0, n);
        for new in n..2 * n - 1 {
            let mut sum = 0;
            for _ in 0..2 {
                let leaf_next = leaf < n && (node == new || weights[leaf] <= weights[node]);
                let next = if leaf_next { &mut leaf } else { &mut node };
                sum += weights[*next];
                parents[*next] = new;
                *next += 1;
            }
            weights.push(sum);
        }
        let mut depths = vec![0u8; 2 * n - 1];
        for node in (0..2 * n - 2).rev() {
            depths[node] = depths[parents[node]] + 1;
        }
        if depths[..n].iter().all(|&depth| depth <= most) {
            leaves.iter().zip(depths).for_each(|(&(_, symbol), depth)| lengths[symbol] = depth);
            return lengths;
        }
        leaves.iter_mut().for_each(|(times, _)| *times = *times / 2 + 1);
    }
}

/// Writes the lengths of both codes, which are coded themselves.
fn write_codes(bits: &mut Bits, symbols: &[u8], distances: &[u8]) {
    /// In this order the lengths of that third code are written.
    const ORDER: [usize; 19] = [16, 17, 18, 0, 8, 7, 9, 6, 10, 5, 11, 4, 12, 3, 13, 2, 14, 1, 15];
    let used =
        |lengths: &[u8]| lengths.iter().rposition(|&length| length > 0).map_or(1, |last| last + 1);
    let (symbols, distances) =
        (&symbols[..used(symbols).max(END + 1)], &distances[..used(distances)]);
    let all = [symbols, distances].concat();
    // A length is its own symbol; 16 is the one before again, 17 and 18 are zeros.
    let mut steps = Vec::new();
    for same in all.chunk_by(|a, b| a == b) {
        let (length, mut left) = (usize::from(same[0]), same.len());
        if length > 0 {
            steps.push(Coded { symbol: length, extra: 0, bits: 0 });
            left -= 1;
        }
        while left >= 3 {
            let (symbol, least, most, bits) = match (length, left) {
                (0, 11..) => (18, 11, 138, 7),
                (0, _) => (17, 3, 10, 3),
                _ => (16, 3, 6, 2),
            };
            let now = left.min(most);
            left -= now;
            steps.push(Coded { symbol, extra: (now - least) as u64, bits });
        }
        steps.extend((0..left).map(|_| Coded { symbol: length, extra: 0, bits: 0 }));
    }
    let mut times = [0; ORDER.len()];
    steps.iter().for_each(|step| times[step.symbol] += 1);
    let code = Code::new(&times, 7);
    let count = ORDER
        .iter()
        .rposition(|&symbol| code.lengths[symbol] > 0)
        .map_or(4, |last| 4.max(last + 1));
    bits.put((symbols.len() - END - 1) as u64, 5);
    bits.put((distances.len() - 1) as u64, 5);
    bits.put((count - 4) as u64, 4);
    ORDER[..count].iter().for_each(|&symbol| bits.put(code.lengths[symbol].into(), 3));
    for step in &steps {
        let (all, count) = code.with(step);
        bits.put(all, count);
    }
}

/// Bits in bytes, the first lowest.
struct Bits {
    bytes: Vec<u8>,
    waiting: u64,
    /// How many wait: less than 32.
    count: u32,
}

impl Bits {
    fn with_capacity(bytes: usize) -> Self {
        Self { bytes: Vec::with_capacity(bytes), waiting: 0, count: 0 }
    }

    /// Adds up to 32 bits: a code of 15 and the 13 after it are 28.
    fn put(&mut self, bits: u64, count: u32) {
        self.waiting |= bits << self.count;
        self.count += count;
        if self.count >= 32 {
            self.bytes.extend_from_slice(&(self.waiting as u32).to_le_bytes());
            self.waiting >>= 32;
            self.count -= 32;
        }
    }

    /// Fills the last byte with zeros.
    fn align(&mut self) {
        let whole = self.count.div_ceil(8) as usize;
        self.bytes.extend_from_slice(&self.waiting.to_le_bytes()[..whole]);
        (self.waiting, self.count) = (0, 0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The lengths that RFC 1951 (3.2.5) lists: symbol, bits after it, least length.
    #[test]
    fn lengths_and_distances_have_the_symbols_of_the_standard() {
        let lengths =
            [(257, 0, 3), (264, 0, 10), (265, 1, 11), (268, 1, 17), (269, 2, 19), (273, 3, 35)];
        let more = [(277, 4, 67), (281, 5, 131), (284, 5, 227), (285, 0, 258)];
        for (symbol, bits, least) in lengths.into_iter().chain(more) {
            let coded = length_code(least);
            assert_eq!((coded.symbol, coded.bits, coded.extra), (symbol, bits, 0), "{least}");
        }
        assert_eq!((length_code(257).symbol, length_code(257).extra), (284, 30));
        let distances =
            [(0, 0, 1), (3, 0, 4), (4, 1, 5), (5, 1, 7), (6, 2, 9), (16, 7, 257), (29, 13, 24_577)];
        for (symbol, bits, least) in distances {
            let coded = distance_code(least);
            assert_eq!((coded.symbol, coded.bits, coded.extra), (symbol, bits, 0), "{least}");
        }
        assert_eq!(
            (distance_code(WINDOW).symbol, distance_code(WINDOW).extra),
            (29, (1 << 13) - 1)
        );
    }

    /// Numbers as Fibonacci's give the longest codes.
    #[test]
    fn codes_are_full_and_short_enough() {
        let fibonacci =
            std::iter::successors(Some((1u32, 1u32)), |&(a, b)| Some((b, a + b))).map(|(a, _)| a);
        for (symbols, most) in [(30, 15), (19, 7), (40, 15), (3, 7), (286, 15)] {
            let times: Vec<u32> =
                fibonacci.clone().take(40).chain(std::iter::repeat(1)).take(symbols).collect();
            let lengths = code_lengths(&times, most);
            assert!(lengths.iter().all(|length| (1..=most).contains(length)), "{lengths:?}");
            let room: u32 = lengths.iter().map(|length| 1 << (15 - length)).sum();
            assert_eq!(room, 1 << 15, "{symbols} symbols: Kraft's sum is 1");
        }
        assert_eq!(code_lengths(&[0, 9, 0], 15), [0, 1, 0]);
        assert_eq!(code_lengths(&[4, 9, 0], 15), [1, 1, 0]);
    }

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
