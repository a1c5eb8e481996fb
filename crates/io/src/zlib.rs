//! What deflate (RFC 1951) and zlib streams (RFC 1950) are made of: symbols, Huffman codes, bits,
//! and the checksum.
//!
//! A stream is [`HEADER`], blocks, [`LAST`], and the checksum of all bytes. Blocks that were made
//! side by side follow one another, as each ends on a whole byte ([`Bits::flush`]).

/// Begins a zlib stream (RFC 1950).
pub(crate) const HEADER: [u8; 2] = [0x78, 0x01];
/// The last block: an empty one with the fixed codes.
pub(crate) const LAST: [u8; 2] = [3, 0];

/// What follows three zero bits on the next whole byte: the lengths of an empty stored block.
const FLUSH: [u8; 4] = [0, 0, 0xff, 0xff];
/// Bytes before the current one that a copy can begin at.
pub(crate) const WINDOW: usize = 1 << 15;
/// Most bytes of a copy.
pub(crate) const LONGEST: usize = 258;
/// Symbols of bytes, of a block's end, and of lengths.
pub(crate) const SYMBOLS: usize = 286;
/// Symbols of distances.
pub(crate) const DISTANCES: usize = 30;
/// The symbol of a block's end.
pub(crate) const END: usize = 256;

/// Adler-32 (RFC 1950) of bytes, and how many they are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Adler {
    pub(crate) a: u64,
    pub(crate) b: u64,
    pub(crate) bytes: u64,
}

impl Adler {
    pub(crate) const MODULUS: u64 = 65_521;

    /// Of no bytes.
    pub(crate) const fn new() -> Self {
        Self { a: 1, b: 0, bytes: 0 }
    }

    /// Of bytes.
    pub(crate) fn of(bytes: &[u8]) -> Self {
        let sum = simd_adler32::adler32(&bytes);
        Self { a: u64::from(sum & 0xffff), b: u64::from(sum >> 16), bytes: bytes.len() as u64 }
    }

    /// Of these bytes and the next ones.
    pub(crate) fn then(self, next: Self) -> Self {
        // What the next bytes began with, 1, is replaced by what is there after these.
        let more = (self.a + Self::MODULUS - 1) % Self::MODULUS;
        Self {
            a: (next.a + more) % Self::MODULUS,
            b: (self.b + next.b + next.bytes % Self::MODULUS * more) % Self::MODULUS,
            bytes: self.bytes + next.bytes,
        }
    }

    /// The checksum, as it ends a stream.
    pub(crate) fn bytes(self) -> [u8; 4] {
        ((self.b << 16 | self.a) as u32).to_be_bytes()
    }
}

/// A symbol and the bits after it.
pub(crate) struct Coded {
    pub(crate) symbol: usize,
    pub(crate) extra: u64,
    pub(crate) bits: u32,
}

/// A length from 3 to 258.
pub(crate) fn length_code(length: usize) -> Coded {
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
pub(crate) fn distance_code(distance: usize) -> Coded {
    let rest = distance - 1;
    if rest < 4 {
        return Coded { symbol: rest, extra: 0, bits: 0 };
    }
    let bits = rest.ilog2() - 1;
    let symbol = 2 * (bits as usize + 1) + (rest >> bits & 1);
    Coded { symbol, extra: (rest & ((1 << bits) - 1)) as u64, bits }
}

/// A canonical Huffman code.
pub(crate) struct Code {
    /// Bits of each symbol's code; 0 where it has none.
    pub(crate) lengths: Vec<u8>,
    /// With the first bit lowest.
    pub(crate) codes: Vec<u16>,
}

impl Code {
    /// For symbols that occur so often, of at most so many bits.
    pub(crate) fn new(times: &[u32], most: u8) -> Self {
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
    pub(crate) fn with(&self, coded: &Coded) -> (u64, u32) {
        let length = u32::from(self.lengths[coded.symbol]);
        (u64::from(self.codes[coded.symbol]) | coded.extra << length, length + coded.bits)
    }

    /// The codes of all bytes, and how many bits these are.
    pub(crate) fn literals(&self) -> [(u64, u32); 256] {
        std::array::from_fn(|byte| (self.codes[byte].into(), self.lengths[byte].into()))
    }

    /// Writes a symbol's code.
    pub(crate) fn put(&self, bits: &mut Bits, symbol: usize) {
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
pub(crate) fn write_codes(bits: &mut Bits, symbols: &[u8], distances: &[u8]) {
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
pub(crate) struct Bits {
    /// What is written, and room behind it.
    bytes: Vec<u8>,
    /// How many are written.
    at: usize,
    waiting: u64,
    /// How many wait: less than 8.
    count: u32,
}

impl Bits {
    /// Bytes that are stored at once.
    const WORD: usize = size_of::<u64>();

    pub(crate) fn with_capacity(bytes: usize) -> Self {
        Self { bytes: vec![0; bytes + Self::WORD], at: 0, waiting: 0, count: 0 }
    }

    /// Adds up to 56 bits.
    ///
    /// A whole word is stored each time, and what of it is no whole byte again the next time: to
    /// ask whether a word is full would be a branch that no processor foresees.
    pub(crate) fn put(&mut self, bits: u64, count: u32) {
        self.waiting |= bits << self.count;
        self.count += count;
        if self.bytes.len() - self.at < Self::WORD {
            self.bytes.resize(2 * self.bytes.len(), 0);
        }
        self.bytes[self.at..][..Self::WORD].copy_from_slice(&self.waiting.to_le_bytes());
        let whole = self.count / 8;
        self.at += whole as usize;
        self.waiting >>= 8 * whole;
        self.count %= 8;
    }

    /// Ends a band after its last block, on a whole byte: what follows may be made beside it.
    pub(crate) fn flush(mut self) -> Vec<u8> {
        self.put(0, 3);
        // Zeros fill the last byte.
        self.put(0, (8 - self.count) % 8);
        self.bytes.truncate(self.at);
        self.bytes.extend_from_slice(&FLUSH);
        self.bytes
    }
}

/// The bytes of blocks, for tests.
#[cfg(test)]
pub(crate) fn unpacked(packed: &[u8]) -> Vec<u8> {
    let (mut bytes, all) = (Vec::new(), [packed, &LAST].concat());
    let mut decoder = flate2::read::DeflateDecoder::new(all.as_slice());
    std::io::Read::read_to_end(&mut decoder, &mut bytes).unwrap();
    bytes
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

    #[test]
    fn bits_lie_one_behind_another() {
        let random = crate::make::Random { seed: 7 };
        let (mut bits, mut want) = (Bits::with_capacity(3), Vec::new());
        for k in 0..5000 {
            let count = (random.bits(2 * k) % 57) as u32;
            let value = random.bits(2 * k + 1) & ((1 << count) - 1);
            bits.put(value, count);
            want.extend((0..count).map(|bit| (value >> bit & 1) as u8));
        }
        want.extend([0; 3]);
        want.resize(want.len().next_multiple_of(8), 0);
        let mut bytes: Vec<u8> = want
            .chunks(8)
            .map(|byte| byte.iter().rev().fold(0, |byte, bit| byte << 1 | bit))
            .collect();
        bytes.extend(FLUSH);
        assert!(bits.flush() == bytes);
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
}
