//! Deflate (RFC 1951) of rows of pixels whose bytes were filtered, so that most are near zero.
//!
//! What a filter leaves has few repetitions but runs of zeros: where the picture is flat or has an
//! even slope. So only these runs are copies, each at a distance of one byte, and all that is to be
//! gained beside them is a Huffman code of the band's own. On shaded spheres this is smaller and
//! faster than a search for repetitions with zlib's lowest level.
//!
//! The speed lies in three loops: runs are looked for eight bytes at a time, bytes are counted in
//! four tables, as one counter would wait for itself, and four codes are written at once.

use std::ops::Range;

use crate::zlib::{Bits, Code, END, LONGEST, SYMBOLS, length_code, write_codes};

/// Most bytes of a block, whose counts fit into 32 bits.
const BLOCK: usize = 1 << 24;

/// Most bits of a code: four are written at once.
const LONGEST_CODE: u8 = 14;

/// Bytes that are looked at together: of each run of zeros of twice as many, some.
const WORD: usize = 8;

/// Bytes as blocks, the last of which ends on a whole byte.
pub(super) fn pack(bytes: &[u8]) -> Vec<u8> {
    let mut packed = Vec::new();
    for block in bytes.chunks(BLOCK) {
        let block = Block { bytes: block, zeros: zeros(block) };
        if packed.is_empty() {
            packed = block.pack();
        } else {
            packed.extend(block.pack());
        }
    }
    packed
}

/// Bytes, and where long runs of zeros are among them.
struct Block<'a> {
    bytes: &'a [u8],
    zeros: Vec<Range<usize>>,
}

impl Block<'_> {
    /// What lies between the runs, with the zero that begins the next one, and how many zeros are
    /// left of that one; of the last, 0.
    fn parts(&self) -> impl Iterator<Item = (&[u8], usize)> {
        let last = self.bytes.len()..self.bytes.len();
        let mut from = 0;
        self.zeros.iter().cloned().chain([last]).map(move |run| {
            let begin = self.bytes.len().min(run.start + 1);
            let part = (&self.bytes[from..begin], run.end - begin);
            from = run.end;
            part
        })
    }

    fn pack(&self) -> Vec<u8> {
        let symbols = Code::new(&self.counts(), LONGEST_CODE);
        let mut bits = Bits::with_capacity(self.bytes.len() + 512);
        // Not the last block, with codes of its own; the code of the only distance is one bit.
        bits.put(0b100, 3);
        write_codes(&mut bits, &symbols.lengths, &[1]);
        let literals = symbols.literals();
        for (bytes, zeros) in self.parts() {
            let (fours, rest) = bytes.as_chunks::<4>();
            for four in fours {
                let (mut all, mut bits_of_all) = (0, 0);
                for &byte in four {
                    let (code, length) = literals[usize::from(byte)];
                    all |= code << bits_of_all;
                    bits_of_all += length;
                }
                bits.put(all, bits_of_all);
            }
            for &byte in rest {
                let (code, length) = literals[usize::from(byte)];
                bits.put(code, length);
            }
            for length in lengths(zeros) {
                let (code, count) = symbols.with(&length_code(length));
                bits.put(code, count + 1);
            }
        }
        symbols.put(&mut bits, END);
        bits.flush()
    }

    /// How often each symbol occurs.
    fn counts(&self) -> [u32; SYMBOLS] {
        let (mut counts, mut literals) = ([0; SYMBOLS], [[0u32; 256]; 4]);
        for (bytes, zeros) in self.parts() {
            let (fours, rest) = bytes.as_chunks::<4>();
            for four in fours {
                for (table, &byte) in literals.iter_mut().zip(four) {
                    table[usize::from(byte)] += 1;
                }
            }
            for &byte in rest {
                literals[0][usize::from(byte)] += 1;
            }
            for length in lengths(zeros) {
                counts[length_code(length).symbol] += 1;
            }
        }
        for (byte, count) in counts[..256].iter_mut().enumerate() {
            *count = literals.iter().map(|table| table[byte]).sum();
        }
        counts[END] = 1;
        counts
    }
}

/// The lengths of copies, of 3 bytes at least, that make up a number of bytes, which is 0 or from
/// 3 on.
fn lengths(mut bytes: usize) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let now = match bytes {
            0 => return None,
            // What is left after the longest would be too short.
            259 | 260 => 255,
            _ => bytes.min(LONGEST),
        };
        bytes -= now;
        Some(now)
    })
}

/// Runs of zeros of at least a word's length: all of two words, and of shorter ones those in which
/// a word lies.
fn zeros(bytes: &[u8]) -> Vec<Range<usize>> {
    let words = bytes.as_chunks::<WORD>().0;
    let is_zero = |word: &[u8; WORD]| u64::from_ne_bytes(*word) == 0;
    let (mut runs, mut at, mut behind) = (Vec::new(), 0, 0);
    while let Some(next) = words[at..].iter().position(is_zero) {
        let first = at + next;
        let count = words[first..].iter().take_while(|word| is_zero(word)).count();
        at = first + count;
        let before = bytes[behind..first * WORD].iter().rev().take_while(|&&byte| byte == 0);
        let after = bytes[at * WORD..].iter().take(WORD).take_while(|&&byte| byte == 0);
        let run = first * WORD - before.count()..at * WORD + after.count();
        behind = run.end;
        runs.push(run);
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{make::Random, zlib::unpacked};

    #[test]
    fn bytes_come_back() {
        for seed in 0..2000u64 {
            let random = Random { seed };
            let count = (random.bits(0) % [10, 70, 1000, 60_000][seed as usize % 4]) as usize;
            let (few, longest) = (1 + random.bits(1) % 256, 1 + random.bits(2) % 700);
            let mut bytes = Vec::new();
            let mut k = 3;
            while bytes.len() < count {
                let zeros = random.bits(k) % longest;
                bytes.extend((0..zeros).map(|_| 0));
                bytes.extend(
                    (0..1 + random.bits(k + 1) % 9).map(|i| (random.bits(k + 2 + i) % few) as u8),
                );
                k += 20;
            }
            bytes.truncate(count);
            assert!(unpacked(&pack(&bytes)) == bytes, "seed {seed}");
        }
    }

    #[test]
    fn every_length_of_a_run_comes_back() {
        for zeros in 0..1200 {
            for before in [0, 1, 7, 8] {
                let bytes = [vec![1; before], vec![0; zeros], vec![2; zeros % 3]].concat();
                assert!(unpacked(&pack(&bytes)) == bytes, "{zeros} zeros after {before}");
            }
        }
        for bytes in 3..2000 {
            let all: Vec<usize> = lengths(bytes).collect();
            assert_eq!(all.iter().sum::<usize>(), bytes);
            assert!(all.iter().all(|length| (3..=258).contains(length)), "{all:?}");
        }
    }

    #[test]
    fn many_bytes_come_in_blocks() {
        let bytes: Vec<u8> = (0..BLOCK + 5).map(|k| (k % 251 * (k / 5000 % 2)) as u8).collect();
        assert!(unpacked(&pack(&bytes)) == bytes);
    }
}
