//! Large example scenes, made from nothing but integers and IEEE sums, products and quotients: the
//! same bytes everywhere.

/// Deterministic random numbers: SplitMix64 (Steele, Lea and Flood, 2014), addressed by counter.
#[derive(Clone, Copy, Debug)]
pub struct Random {
    /// Where the sequence begins.
    pub seed: u64,
}

impl Random {
    /// Number `index` of the sequence.
    pub fn bits(self, index: u64) -> u64 {
        let mut z =
            self.seed.wrapping_add(index.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15));
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A multiple of 2^-24 in [0, 1).
    pub fn unit(self, index: u64) -> f32 {
        (self.bits(index) >> 40) as f32 * (1.0 / 16_777_216.0)
    }
}

/// Equal spheres at random places in the unit cube, which together have 7 % of its volume.
#[derive(Clone, Copy, Debug)]
pub struct Cloud {
    random: Random,
    count: u32,
}

impl Cloud {
    /// `count` spheres from a seed.
    pub fn new(count: u32, seed: u64) -> Self {
        Self { random: Random { seed }, count }
    }

    /// The radius of every sphere: the largest f32 for which the volumes sum to at most 0.07.
    pub fn radius(&self) -> f32 {
        // r^3 <= 0.07 * 3 / (4 pi N), by bisection over the bit patterns: a cube root would differ
        // between machines.
        let limit = 0.07 * 3.0 / (4.0 * std::f64::consts::PI * f64::from(self.count));
        let fits = |bits: u32| {
            let r = f64::from(f32::from_bits(bits));
            r * r * r <= limit
        };
        let (mut low, mut high) = (0, 1.0f32.to_bits());
        while high - low > 1 {
            let middle = low + (high - low) / 2;
            if fits(middle) { low = middle } else { high = middle }
        }
        f32::from_bits(low)
    }

    /// Centre and colour of sphere `index`: warm at one side of the cube, cool at the other,
    /// lighter towards the top.
    pub fn sphere(&self, index: u32) -> ([f32; 3], [u8; 3]) {
        let at = |k: u64| self.random.unit(3 * u64::from(index) + k);
        let center = [at(0), at(1), at(2)];
        let [x, y, z] = center;
        let light = 0.55 + 0.45 * z;
        let channel = |value: f32| (255.0 * light * value) as u8;
        (center, [channel(0.35 + 0.65 * x), channel(0.45 + 0.3 * y), channel(1.0 - 0.75 * x)])
    }
}

/// A face-centred cubic lattice of spheres that touch: integer points with an even sum, in cubes of
/// increasing order.
#[derive(Clone, Copy, Debug)]
pub struct Lattice {
    /// Cells along each side; a cell has four spheres.
    side: u32,
}

impl Lattice {
    /// The least cube of cells with at least `count` spheres. Its last spheres are left out by
    /// whoever wants fewer.
    pub fn new(count: u32) -> Self {
        let mut side = 1;
        while 4 * u64::from(side).pow(3) < u64::from(count) {
            side += 1;
        }
        Self { side }
    }

    /// Half of the distance of neighbours, the square root of 2, rounded down: touching, up to one
    /// unit in the last place.
    pub fn radius(&self) -> f32 {
        let root = std::f32::consts::FRAC_1_SQRT_2;
        if f64::from(root).powi(2) <= 0.5 { root } else { root.next_down() }
    }

    /// Centre and colour of sphere `index`: one colour for each of the four spheres of a cell.
    pub fn sphere(&self, index: u32) -> ([f32; 3], [u8; 3]) {
        let (cell, part) = (index / 4, index % 4);
        let cell = [cell % self.side, cell / self.side % self.side, cell / self.side / self.side];
        let (offset, color) = match part {
            0 => ([0, 0, 0], [0xe0, 0x7a, 0x5f]),
            1 => ([0, 1, 1], [0xf2, 0xcc, 0x8f]),
            2 => ([1, 0, 1], [0x81, 0xb2, 0x9a]),
            _ => ([1, 1, 0], [0x3d, 0x5a, 0x80]),
        };
        (std::array::from_fn(|k| (2 * cell[k] + offset[k]) as f32), color)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cloud_is_the_same_everywhere() {
        let cloud = Cloud::new(100_000, 1);
        // (0.07 * 3 / (4 pi 1e5))^(1/3)
        assert!((cloud.radius() - 0.005_508_1).abs() < 1e-6, "{}", cloud.radius());
        // The first numbers of SplitMix64 from seed 1, as its authors' C code has them.
        let first = [10451216379200822465, 13757245211066428519, 17911839290282890590];
        assert_eq!([0, 1, 2].map(|k| cloud.random.bits(k)), first);
        assert_eq!(
            cloud.sphere(0),
            (first.map(|bits| (bits >> 40) as f32 / 16_777_216.0), [180, 169, 144])
        );
        let (mut sum, n) = ([0.0f64; 3], 10_000);
        for k in 0..n {
            let (center, _) = cloud.sphere(k);
            assert!(center.iter().all(|c| (0.0..1.0).contains(c)));
            for (sum, c) in sum.iter_mut().zip(center) {
                *sum += f64::from(c) / f64::from(n);
            }
        }
        assert!(sum.iter().all(|mean| (mean - 0.5).abs() < 0.02), "{sum:?}");
    }

    #[test]
    fn the_lattice_touches() {
        let lattice = Lattice::new(256);
        assert_eq!(lattice.side, 4);
        let centers: Vec<[f32; 3]> = (0..256).map(|k| lattice.sphere(k).0).collect();
        let (mut least, mut neighbours) = (f32::INFINITY, 0);
        for (k, a) in centers.iter().enumerate() {
            for b in &centers[..k] {
                let square: f32 = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum();
                least = least.min(square);
                neighbours += u32::from(square == 2.0);
            }
        }
        assert_eq!(least, 2.0);
        assert!(neighbours > 3 * 256, "{neighbours}");
        assert!(
            f64::from(lattice.radius()).powi(2) <= 0.5
                && f64::from(lattice.radius().next_up()).powi(2) > 0.5
        );
    }
}
