//! Linear light to sRGB values of 16 bits, in integers: the rule of docs/contract.md.
//!
//! The edges between values are made once, by integers alone, so that every machine has the same.
//! They are within two parts of 2^40 of the real ones, and a test shows that no mean of up to 256
//! linear values lies between an edge and the real one.

use std::sync::OnceLock;

use crate::linear::WHITE;

/// Binary places of edges.
const PLACES: u32 = 40;

/// Binary places of numbers from 0 to 1 on the way.
const FINE: u32 = 62;

/// Twice the denominator of an edge's sRGB value: that of `b` is `(2 b - 1) / DOUBLE`.
const DOUBLE: u64 = 2 * 65535;

/// Linear values to sRGB of 16 bits.
pub struct Encoder16 {
    /// `2^40 65535 eotf((b - 1/2) / 65535)`, about, for each `b`; 0 for 0.
    edges: Box<[u64]>,
    /// The value of each linear value.
    values: Box<[u16]>,
}

impl std::fmt::Debug for Encoder16 {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Encoder16").finish_non_exhaustive()
    }
}

/// A product of numbers from 0 to 1.
fn times(a: u128, b: u128) -> u128 {
    (a * b) >> FINE
}

/// `w^(2/5)`, by Newton's method from a number that is not 0 on.
fn root(w: u128, mut y: u128) -> u128 {
    let square = times(w, w);
    loop {
        let fourth = times(times(y, y), times(y, y));
        let next = (4 * y + (square << FINE) / fourth) / 5;
        // The next step would be its square, about.
        let done = next.abs_diff(y) < 1 << (FINE / 2 - 6);
        y = next;
        if done {
            return y;
        }
    }
}

/// All edges.
fn edges() -> Box<[u64]> {
    let mut last = 1 << FINE;
    let edge = |b: u64| {
        let Some(odd) = (2 * b).checked_sub(1) else { return 0 };
        // 0.04045 and below: a part of 12.92.
        if odd * 100_000 <= DOUBLE * 4045 {
            return ((u128::from(odd) << PLACES) * 25 / 646) as u64;
        }
        let w = (u128::from(1000 * odd + 55 * DOUBLE) << FINE) / u128::from(1055 * DOUBLE);
        last = root(w, last);
        ((times(times(w, w), last) * u128::from(WHITE)) >> (FINE - PLACES)) as u64
    };
    (0..=u64::from(WHITE)).map(edge).collect()
}

impl Encoder16 {
    /// The tables, made when they are first asked for.
    pub fn get() -> &'static Self {
        static TABLES: OnceLock<Encoder16> = OnceLock::new();
        TABLES.get_or_init(|| {
            let edges = edges();
            let mut b = 0;
            let values = (0..=u64::from(WHITE)).map(|value| {
                while b < WHITE as usize && edges[b + 1] <= value << PLACES {
                    b += 1;
                }
                b as u16
            });
            let values = values.collect();
            Self { edges, values }
        })
    }

    /// The sRGB value of one linear value.
    #[inline(always)]
    pub fn value(&self, linear: u32) -> u16 {
        self.values[linear as usize]
    }

    /// The sRGB value of the mean of `count` linear values (1 to 256) with this sum.
    pub fn mean(&self, sum: u32, count: u32) -> u16 {
        let whole = sum / count;
        let first = usize::from(self.value(whole));
        let last = usize::from(self.value((whole + 1).min(WHITE)));
        let reached = |edge: &u64| edge * u64::from(count) <= u64::from(sum) << PLACES;
        (first + self.edges[first + 1..=last].partition_point(reached)) as u16
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear::{LIN, compare};

    /// Of every mean of up to 256 values: each edge decides as the real one does.
    #[test]
    fn edges_decide_as_the_real_ones() {
        let one = 1u64 << PLACES;
        let mut linear = 0;
        for (b, &edge) in (0u64..).zip(&Encoder16::get().edges).skip(1) {
            if (2 * b - 1) * 100_000 <= DOUBLE * 4045 {
                linear += 1;
                for count in 1..=256u64 {
                    let least = (edge * count).div_ceil(one);
                    let at = |sum: u64| compare(2 * b - 1, DOUBLE, sum, count);
                    assert!(at(least).is_le() && at(least - 1).is_gt(), "{b} of {count}");
                }
                continue;
            }
            let at = |value: u64| compare(2 * b - 1, DOUBLE, value, one);
            assert!(at(edge - 2).is_gt() && at(edge + 2).is_lt(), "{b}");
            for count in 1..=256 {
                let [low, high] = [(edge - 2) * count - 1, (edge + 2) * count];
                assert_eq!(low / one, high / one, "{b} of {count}");
            }
        }
        assert_eq!(linear, 2651);
    }

    #[test]
    fn means_are_found() {
        let all = Encoder16::get();
        let edges = &all.edges;
        for count in [1u32, 3, 4, 16, 38, 64, 255, 256] {
            for b in 1..=WHITE {
                let least = (edges[b as usize] * u64::from(count)).div_ceil(1 << PLACES) as u32;
                assert!(u32::from(all.mean(least, count)) >= b);
                assert!(u32::from(all.mean(least - 1, count)) < b);
            }
            assert_eq!([0, WHITE * count].map(|sum| all.mean(sum, count)), [0, 65535]);
        }
        // As near to the colours of 8 bits as their linear values are.
        for (c, &linear) in (0i32..).zip(&LIN) {
            let value = i32::from(all.value(linear.into()));
            assert!((value - 257 * c).abs() <= 7, "{c}: {value}");
        }
    }
}
