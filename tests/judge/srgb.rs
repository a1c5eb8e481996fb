//! The judge's tables of sRGB, from the EOTF in whole numbers of any size: `x^2.4 >= y` if and only
//! if `x^12 >= y^5`. Nothing is rounded, so the tables are proved as they are made.

use std::sync::{LazyLock, OnceLock};

use dashu_int::UBig;

/// Whether `65535 k eotf(top / bottom) <= value / 2`, for `bottom` of 255 or 510.
fn reaches(value: u64, k: u64, top: u64, bottom: u64) -> bool {
    let big = |x: u64| UBig::from(x);
    // Up to 0.04045 a straight line, top / bottom / 12.92.
    if top * 100_000 <= 4045 * bottom {
        return big(value) * big(1292 * bottom) >= big(2 * 65535 * 100) * big(k * top);
    }
    // (top / bottom + 0.055) / 1.055.
    let (p, q) = (1000 * top + 55 * bottom, 1055 * bottom);
    big(value).pow(5) * big(q).pow(12) >= big(2 * 65535 * k).pow(5) * big(p).pow(12)
}

/// The least whole number of which something holds that holds of all above it, too. The guess only
/// makes it fast.
fn least(guess: f64, holds: impl Fn(u64) -> bool) -> u32 {
    let mut found = guess.round() as u64;
    while !holds(found) {
        found += 1;
    }
    while found > 0 && holds(found - 1) {
        found -= 1;
    }
    u32::try_from(found).expect("a sum of 65,536 samples at most")
}

/// The EOTF, nearly.
fn nearly(x: f64) -> f64 {
    if x <= 0.04045 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) }
}

/// `LIN[c] = round(65535 eotf(c / 255))`.
pub fn linear(byte: u8) -> u32 {
    static TABLE: LazyLock<[u32; 256]> = LazyLock::new(|| {
        std::array::from_fn(|c| {
            let exact = c as u64;
            // v is the rounded number where v + 1/2 is the first half above it.
            least(65535.0 * nearly(c as f64 / 255.0), |v| reaches(2 * v + 1, 1, exact, 255))
        })
    });
    TABLE[usize::from(byte)]
}

/// `T_b = ceil(65535 k eotf((b - 1/2) / 255))`, `T_0 = 0`, for k of 1 to 256.
pub fn thresholds(k: usize) -> &'static [u32; 256] {
    static TABLES: [OnceLock<[u32; 256]>; 257] = [const { OnceLock::new() }; 257];
    TABLES[k].get_or_init(|| {
        std::array::from_fn(|b| {
            if b == 0 {
                return 0;
            }
            let (top, bottom) = (2 * b as u64 - 1, 510);
            let guess = 65535.0 * k as f64 * nearly(top as f64 / bottom as f64);
            least(guess, |sum| reaches(2 * sum, k as u64, top, bottom))
        })
    })
}

/// The byte of a sum of k linear values: the largest b with `T_b <= sum`.
pub fn byte(sum: u32, k: usize) -> u8 {
    let above = thresholds(k).partition_point(|&threshold| threshold <= sum);
    u8::try_from(above - 1).expect("256 bytes, the first of them from 0 on")
}
