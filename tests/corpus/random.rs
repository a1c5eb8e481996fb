//! A small source of numbers that is the same on every machine (splitmix64).

use glam::DVec3;

/// The state, which is the seed at first.
pub struct Random(u64);

impl Random {
    /// From a seed.
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// 64 bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// From 0 to 1, 1 left out.
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Between two numbers.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// A whole number below `n`.
    pub fn below(&mut self, n: u64) -> u64 {
        self.bits() % n
    }

    /// A whole number between two, both included.
    pub fn whole(&mut self, low: i64, high: i64) -> i64 {
        low + self.below((high - low + 1) as u64) as i64
    }

    /// Ten to a power between two: by a power of two and a linear step, since the platform's `exp`
    /// is not the same everywhere.
    pub fn power(&mut self, low: f64, high: f64) -> f64 {
        let exponent = self.between(low, high) * std::f64::consts::LOG2_10;
        let whole = exponent.floor();
        f64::from_bits(((1023 + whole as i64) as u64) << 52) * (1.0 + (exponent - whole))
    }

    /// A point in the unit ball, not the middle.
    pub fn ball(&mut self) -> DVec3 {
        loop {
            let p = DVec3::new(
                self.between(-1.0, 1.0),
                self.between(-1.0, 1.0),
                self.between(-1.0, 1.0),
            );
            if p.length_squared() <= 1.0 && p != DVec3::ZERO {
                return p;
            }
        }
    }
}
