//! The packed positions of XTC files.
//!
//! The packing is that of `xdrfile`, "3dfcoord". An atom is three integers as one number, whose
//! range is known. A bit behind it says whether a number follows that tells how many of the next
//! atoms lie near: each of these is three small steps from the one before it. How large a step may
//! be changes from one group to the next.

use super::Packing;
use crate::input::report::Fault;
use planisphere_core::drawing::Control;

/// The sizes of small steps: powers of 2^(1/3).
const SIZES: [u32; 73] = [
    0, 0, 0, 0, 0, 0, 0, 0, 0, 8, 10, 12, 16, 20, 25, 32, 40, 50, 64, 80, 101, 128, 161, 203, 256,
    322, 406, 512, 645, 812, 1024, 1290, 1625, 2048, 2580, 3250, 4096, 5060, 6501, 8192, 10321,
    13003, 16384, 20642, 26007, 32768, 41285, 52015, 65536, 82570, 104_031, 131_072, 165_140,
    208_063, 262_144, 330_280, 416_127, 524_287, 660_561, 832_255, 1_048_576, 1_321_122, 1_664_510,
    2_097_152, 2_642_245, 3_329_021, 4_194_304, 5_284_491, 6_658_042, 8_388_607, 10_568_983,
    13_316_085, 16_777_216,
];

/// From this size on, the three numbers of an atom are not one.
const LARGE: u32 = 1 << 24;

/// Atoms that are read before it is asked whether to go on.
const BLOCK: usize = 1 << 18;

/// Positions of so many atoms; none where the bytes are not such, or too few.
pub(super) fn positions(
    bytes: &[u8],
    atoms: usize,
    packing: &Packing,
    control: &Control,
) -> Result<Option<Vec<f32>>, Fault> {
    let Some(mut state) = State::new(bytes, packing) else { return Ok(None) };
    let mut rows: Vec<f32> = bytemuck::allocation::zeroed_vec(3 * atoms);
    let mut places = rows.as_chunks_mut::<3>().0.iter_mut();
    let mut asked = atoms;
    while places.len() > 0 {
        if asked - places.len() > BLOCK {
            asked = places.len();
            control.reach(1.0 - asked as f32 / atoms as f32);
            Fault::if_cancelled(control)?;
        }
        if state.group(&mut places).is_none() {
            return Ok(None);
        }
    }
    Ok(Some(rows))
}

/// What is known while numbers are read.
struct State<'a> {
    bits: Bits<'a>,
    /// What an integer is by, as the format's own library has it: rounded to 32 bits.
    inverse: f32,
    least: [i32; 3],
    /// How many values each integer has, less what the least is.
    sizes: [u32; 3],
    /// Bits of the three as one; none where each has its own.
    together: Option<u32>,
    /// Which size small steps have.
    small: u32,
    /// Atoms of small steps in a group, until another number is told.
    run: u32,
}

impl<'a> State<'a> {
    fn new(bytes: &'a [u8], packing: &Packing) -> Option<Self> {
        let Packing { precision, least, most, small } = *packing;
        let mut sizes = [0; 3];
        for axis in 0..3 {
            let size = i64::from(most[axis]) - i64::from(least[axis]) + 1;
            sizes[axis] = u32::try_from(size).ok().filter(|size| *size > 0)?;
        }
        let bits = || {
            let product: u128 = sizes.iter().map(|size| u128::from(*size)).product();
            u128::BITS - product.leading_zeros()
        };
        let together = sizes.iter().all(|size| *size < LARGE).then(bits);
        let bits = Bits { bytes, at: 0, end: bytes.len().checked_mul(8)? };
        let state = Self { bits, inverse: 1.0 / precision, least, sizes, together, small, run: 0 };
        state.size().map(|_| state)
    }

    /// How large small steps may be.
    fn size(&self) -> Option<u32> {
        SIZES.get(self.small as usize).copied().filter(|size| *size > 0)
    }

    /// Reads one atom, and those near to it, of which the first comes before it.
    fn group<'r>(&mut self, places: &mut impl Iterator<Item = &'r mut [f32; 3]>) -> Option<()> {
        let found = match self.together {
            Some(bits) => self.bits.three(bits, self.sizes)?,
            None => {
                let mut own = |size: u32| self.bits.number(u32::BITS - size.leading_zeros());
                [own(self.sizes[0])?, own(self.sizes[1])?, own(self.sizes[2])?].map(|n| n as u32)
            }
        };
        let first = add(found, self.least);
        // 0 is smaller steps after this group, 1 the same, 2 larger ones.
        let mut change = 1;
        if self.bits.number(1)? == 1 {
            let told = self.bits.number(5)? as u32;
            (self.run, change) = (told / 3, told % 3);
        }
        let inverse = self.inverse;
        let mut put = |at: [i32; 3]| -> Option<()> {
            *places.next()? = at.map(|n| n as f32 * inverse);
            Some(())
        };
        if self.run == 0 {
            put(first)?;
        }
        let size = self.size()?;
        let middle = (size / 2).cast_signed();
        let mut last = first;
        for number in 0..self.run {
            // The index of a size is also how many bits three of it have.
            let step = self.bits.three(self.small, [size; 3])?;
            last = add(step, last.map(|n| n.wrapping_sub(middle)));
            put(last)?;
            if number == 0 {
                put(first)?;
            }
        }
        self.small = (self.small + change).checked_sub(1)?;
        self.size().map(|_| ())
    }
}

/// Integers above the least.
fn add(found: [u32; 3], least: [i32; 3]) -> [i32; 3] {
    let [x, y, z] = found.map(u32::cast_signed);
    [least[0].wrapping_add(x), least[1].wrapping_add(y), least[2].wrapping_add(z)]
}

/// Bits, of each byte the highest first.
struct Bits<'a> {
    bytes: &'a [u8],
    /// The next bit.
    at: usize,
    /// How many there are.
    end: usize,
}

impl Bits<'_> {
    /// The next so many bits, 56 at most.
    #[inline]
    fn number(&mut self, count: u32) -> Option<u64> {
        let next = self.at + count as usize;
        if next > self.end || count == 0 {
            return (count == 0).then_some(0);
        }
        let first = self.at / 8;
        let word = match self.bytes.get(first..first + 8).and_then(|eight| eight.try_into().ok()) {
            Some(eight) => u64::from_be_bytes(eight),
            None => {
                let mut eight = [0; 8];
                let rest = self.bytes.get(first..)?;
                eight.get_mut(..rest.len())?.copy_from_slice(rest);
                u64::from_be_bytes(eight)
            }
        };
        let found = word << (self.at % 8) >> (64 - count);
        self.at = next;
        Some(found)
    }

    /// Three integers below their sizes, as one number of so many bits, 72 at most: whole bytes
    /// first, the lowest before the others, and then the highest bits.
    #[inline]
    fn three(&mut self, bits: u32, sizes: [u32; 3]) -> Option<[u32; 3]> {
        let whole = 8 * (bits.checked_sub(1)? / 8);
        let turned = |number: u64, bits: u32| match bits {
            0 => 0,
            bits => (number << (64 - bits)).swap_bytes(),
        };
        if bits <= 56 {
            let found = self.number(bits)?;
            let rest = bits - whole;
            let highest = found & ((1 << rest) - 1);
            return Some(parts(turned(found >> rest, whole) | highest << whole, sizes));
        }
        let low = turned(self.number(56)?, 56);
        let middle = turned(self.number(whole - 56)?, whole - 56);
        let highest = self.number(bits - whole)?;
        let found = u128::from(low) | u128::from(middle) << 56 | u128::from(highest) << whole;
        if let Ok(found) = u64::try_from(found) {
            return Some(parts(found, sizes));
        }
        let [_, y, z] = sizes.map(u128::from);
        Some([(found / z / y) as u32, (found / z % y) as u32, (found % z) as u32])
    }
}

/// The three integers of one number. No size is 0.
#[inline]
fn parts(found: u64, sizes: [u32; 3]) -> [u32; 3] {
    let [_, y, z] = sizes.map(u64::from);
    let rest = found / z;
    [(rest / y) as u32, (rest % y) as u32, (found % z) as u32]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_are_read_in_their_order() {
        let bytes = [0b1010_0101, 0xff, 0x00, 1, 2, 3, 4, 5, 6, 0x80];
        let mut bits = Bits { bytes: &bytes, at: 0, end: 80 };
        assert_eq!([1, 3, 0, 8].map(|count| bits.number(count)), [1, 2, 0, 0x5f].map(Some));
        assert_eq!(bits.number(56), Some(0xf0_0010_2030_4050), "of eight bytes");
        assert_eq!((bits.number(12), bits.number(8), bits.number(1)), (Some(0x680), None, None));
    }

    #[test]
    fn three_integers_are_one_number() {
        for sizes in [[3, 5, 7], [300, 7, 90_000], [1 << 20; 3], [(1 << 24) - 1; 3], [1; 3]] {
            let wanted = sizes.map(|size: u32| size - 1 - size / 3);
            let [x, y, z] = wanted.map(u128::from);
            let found = (x * u128::from(sizes[1]) + y) * u128::from(sizes[2]) + z;
            let product: u128 = sizes.iter().map(|size| u128::from(*size)).product();
            let bits = u128::BITS - product.leading_zeros();
            // As it is written: whole bytes, and the rest at the upper end of the last one.
            let mut bytes = found.to_le_bytes();
            let rest = (bits - 1) / 8;
            bytes[rest as usize] <<= 8 - (bits - 8 * rest);
            let mut read = Bits { bytes: &bytes, at: 0, end: 128 };
            assert_eq!(read.three(bits, sizes), Some(wanted), "{sizes:?}");
            assert_eq!(read.at, bits as usize);
        }
    }
}
