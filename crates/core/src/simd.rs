//! Loops compiled for the widest vectors that this processor has: eight f64 at a time.
//!
//! [`Lanes`] is implemented with AVX-512, with AVX2, and plainly; [`dispatch`] picks one at run
//! time. Only the instructions differ, never a result: each operation is one rounding of IEEE 754,
//! and nothing is contracted or reordered.

use std::mem::MaybeUninit;

/// How many numbers are in a vector.
pub const LANES: usize = 8;
// Masks of lanes are `u8` here, in `tile`, and where a GPU's leftovers are decided.
const _: () = assert!(LANES == u8::BITS as usize);

/// A hint that an element of a slice is soon to be read; none of one beyond its end, nor where the
/// processor's are not in Rust's library.
#[inline(always)]
pub fn prefetch<T>(slice: &[T], index: usize) {
    #[cfg(target_arch = "x86_64")]
    if let Some(element) = slice.get(index) {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: reads nothing; SSE, which it needs, every x86-64 has.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(std::ptr::from_ref(element).cast()) };
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (slice, index);
}

/// One f64 or several: what the formulas of [`crate::filter`] are written in.
pub trait Number: Copy {
    /// The same number in every place.
    fn splat(value: f64) -> Self;
    /// Sum.
    fn add(self, other: Self) -> Self;
    /// Difference.
    fn sub(self, other: Self) -> Self;
    /// Product.
    fn mul(self, other: Self) -> Self;
}

impl Number for f64 {
    #[inline(always)]
    fn splat(value: f64) -> Self {
        value
    }

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self + other
    }

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self - other
    }

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self * other
    }
}

/// What stands beside numbers of some kind in a formula: one f64 is the same in every place, and
/// eight are as they are.
pub trait Beside<N>: Copy {
    /// As such numbers.
    fn beside(self) -> N;
}

impl<N: Number> Beside<N> for f64 {
    #[inline(always)]
    fn beside(self) -> N {
        N::splat(self)
    }
}

macro_rules! beside_its_own {
    ($($vector:ty),*) => {
        $(impl Beside<Self> for $vector {
            #[inline(always)]
            fn beside(self) -> Self {
                self
            }
        })*
    };
}

beside_its_own!(Plain);
#[cfg(target_arch = "x86_64")]
beside_its_own!(x86::Avx512, x86::Avx2);

/// Eight f64, and masks of eight bits for comparisons (false where an operand is NaN).
pub trait Lanes: Number + Beside<Self> {
    /// The first eight of a slice.
    fn load(from: &[f64]) -> Self;
    /// Into the first eight of a slice.
    fn store(self, to: &mut [f64]);
    /// Quotient.
    fn div(self, other: Self) -> Self;
    /// Square root, correctly rounded.
    fn sqrt(self) -> Self;
    /// The greater; the second of NaN and a number.
    fn max(self, other: Self) -> Self;
    /// A bit for each lane where this is less.
    fn less(self, other: Self) -> u8;
    /// This where the bit is set, else the other.
    fn select(mask: u8, this: Self, other: Self) -> Self;
    /// Writes a value to those of the first eight of a slice whose bit is set.
    fn mark(mask: u8, value: i32, to: &mut [i32]);
    /// A bit for each of the first eight of a slice that is a value.
    #[inline(always)]
    fn same(value: i32, of: &[i32]) -> u8 {
        of[..LANES].iter().enumerate().fold(0, |bits, (k, of)| bits | u8::from(*of == value) << k)
    }

    /// The greatest lane that is a number.
    fn greatest(self) -> f64 {
        let mut lanes = [0.0; LANES];
        self.store(&mut lanes);
        lanes
            .into_iter()
            .fold(f64::NEG_INFINITY, |most, lane| if lane > most { lane } else { most })
    }
}

/// Work to be compiled once for each kind of processor. `run` must be `#[inline(always)]`, as must
/// all that it calls.
pub trait Work {
    /// What comes out.
    type Output;

    /// Does it.
    fn run<L: Lanes>(self) -> Self::Output;
}

/// Does the work.
pub fn dispatch<W: Work>(work: W) -> W::Output {
    #[cfg(target_arch = "x86_64")]
    {
        if is_x86_feature_detected!("avx512f")
            && is_x86_feature_detected!("avx512dq")
            && is_x86_feature_detected!("avx512vl")
        {
            // SAFETY: the features were just found.
            return unsafe { x86::with_avx512(work) };
        }
        if is_x86_feature_detected!("avx2") {
            // SAFETY: the feature was just found.
            return unsafe { x86::with_avx2(work) };
        }
    }
    work.run::<Plain>()
}

/// Fills memory with a number.
pub struct Fill<'a> {
    /// What is filled.
    pub to: &'a mut [MaybeUninit<i32>],
    /// With what.
    pub value: i32,
}

impl Work for Fill<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let value = MaybeUninit::new(self.value);
        let (head, rest) = self.to.split_at_mut(lines(self.to));
        let (lines, tail) = rest.as_chunks_mut::<LINE>();
        head.fill(value);
        lines.iter_mut().for_each(|line| *line = [value; LINE]);
        tail.fill(value);
    }
}

/// Numbers in a cache line.
const LINE: usize = 16;

/// How many numbers precede the first whole cache line.
#[inline(always)]
fn lines(of: &[MaybeUninit<i32>]) -> usize {
    of.as_ptr().align_offset(LINE * size_of::<i32>()).min(of.len())
}

/// Eight numbers without vector instructions, or with those that the compiler finds.
#[derive(Clone, Copy)]
pub struct Plain([f64; LANES]);

impl Plain {
    #[inline(always)]
    fn both(self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        Self(std::array::from_fn(|k| f(self.0[k], other.0[k])))
    }
}

impl Number for Plain {
    #[inline(always)]
    fn splat(value: f64) -> Self {
        Self([value; LANES])
    }

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.both(other, |a, b| a + b)
    }

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.both(other, |a, b| a - b)
    }

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.both(other, |a, b| a * b)
    }
}

impl Lanes for Plain {
    #[inline(always)]
    fn load(from: &[f64]) -> Self {
        Self(std::array::from_fn(|k| from[k]))
    }

    #[inline(always)]
    fn store(self, to: &mut [f64]) {
        to[..LANES].copy_from_slice(&self.0);
    }

    #[inline(always)]
    fn div(self, other: Self) -> Self {
        self.both(other, |a, b| a / b)
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.map(f64::sqrt))
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.both(other, |a, b| if a > b { a } else { b })
    }

    #[inline(always)]
    fn less(self, other: Self) -> u8 {
        (0..LANES).fold(0, |bits, k| bits | u8::from(self.0[k] < other.0[k]) << k)
    }

    #[inline(always)]
    fn select(mask: u8, this: Self, other: Self) -> Self {
        Self(std::array::from_fn(|k| if mask >> k & 1 == 1 { this.0[k] } else { other.0[k] }))
    }

    #[inline(always)]
    fn mark(mask: u8, value: i32, to: &mut [i32]) {
        to[..LANES]
            .iter_mut()
            .enumerate()
            .filter(|(k, _)| mask >> k & 1 == 1)
            .for_each(|(_, to)| *to = value);
    }
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    //! The x86 vectors. Values of these types exist only inside `with_avx512` and `with_avx2`,
    //! which run after their features were found; that is what makes the intrinsics' use sound.

    use std::arch::x86_64::{
        __m256d, __m512d, _CMP_LT_OQ, _mm256_add_pd, _mm256_and_si256, _mm256_blendv_pd,
        _mm256_castsi256_pd, _mm256_cmp_pd, _mm256_cmpeq_epi32, _mm256_div_pd, _mm256_loadu_pd,
        _mm256_mask_storeu_epi32, _mm256_maskstore_epi32, _mm256_max_pd, _mm256_movemask_pd,
        _mm256_mul_pd, _mm256_set_epi64x, _mm256_set1_epi32, _mm256_set1_pd, _mm256_setr_epi32,
        _mm256_sqrt_pd, _mm256_storeu_pd, _mm256_sub_pd, _mm512_add_pd, _mm512_cmp_pd_mask,
        _mm512_div_pd, _mm512_loadu_pd, _mm512_mask_blend_pd, _mm512_max_pd, _mm512_mul_pd,
        _mm512_set1_pd, _mm512_sqrt_pd, _mm512_storeu_pd, _mm512_sub_pd,
    };

    use super::{LANES, Lanes, Number, Work};

    #[target_feature(enable = "avx512f,avx512dq,avx512vl,avx2")]
    pub fn with_avx512<W: Work>(work: W) -> W::Output {
        work.run::<Avx512>()
    }

    #[target_feature(enable = "avx2")]
    pub fn with_avx2<W: Work>(work: W) -> W::Output {
        work.run::<Avx2>()
    }

    /// One vector of AVX-512.
    #[derive(Clone, Copy)]
    pub struct Avx512(__m512d);

    /// Two vectors of AVX2.
    #[derive(Clone, Copy)]
    pub struct Avx2(__m256d, __m256d);

    // `load` and `store` of each move so many numbers, unchecked.
    const _: () = assert!(size_of::<Avx512>() == LANES * size_of::<f64>());
    const _: () = assert!(size_of::<Avx2>() == LANES * size_of::<f64>());

    /// An expression of intrinsics.
    macro_rules! vector {
        ($e:expr) => {
            // SAFETY: the processor has the feature, as the module's head says; memory is checked
            // where it is touched.
            unsafe { $e }
        };
    }

    impl Number for Avx512 {
        #[inline(always)]
        fn splat(value: f64) -> Self {
            vector!(Self(_mm512_set1_pd(value)))
        }

        #[inline(always)]
        fn add(self, other: Self) -> Self {
            vector!(Self(_mm512_add_pd(self.0, other.0)))
        }

        #[inline(always)]
        fn sub(self, other: Self) -> Self {
            vector!(Self(_mm512_sub_pd(self.0, other.0)))
        }

        #[inline(always)]
        fn mul(self, other: Self) -> Self {
            vector!(Self(_mm512_mul_pd(self.0, other.0)))
        }
    }

    impl Lanes for Avx512 {
        #[inline(always)]
        fn load(from: &[f64]) -> Self {
            let from = &from[..LANES];
            vector!(Self(_mm512_loadu_pd(from.as_ptr())))
        }

        #[inline(always)]
        fn store(self, to: &mut [f64]) {
            let to = &mut to[..LANES];
            vector!(_mm512_storeu_pd(to.as_mut_ptr(), self.0));
        }

        #[inline(always)]
        fn div(self, other: Self) -> Self {
            vector!(Self(_mm512_div_pd(self.0, other.0)))
        }

        #[inline(always)]
        fn sqrt(self) -> Self {
            vector!(Self(_mm512_sqrt_pd(self.0)))
        }

        #[inline(always)]
        fn max(self, other: Self) -> Self {
            vector!(Self(_mm512_max_pd(self.0, other.0)))
        }

        #[inline(always)]
        fn less(self, other: Self) -> u8 {
            vector!(_mm512_cmp_pd_mask::<_CMP_LT_OQ>(self.0, other.0))
        }

        #[inline(always)]
        fn select(mask: u8, this: Self, other: Self) -> Self {
            vector!(Self(_mm512_mask_blend_pd(mask, other.0, this.0)))
        }

        #[inline(always)]
        fn mark(mask: u8, value: i32, to: &mut [i32]) {
            let to = &mut to[..LANES];
            vector!(_mm256_mask_storeu_epi32(to.as_mut_ptr(), mask, _mm256_set1_epi32(value)));
        }
    }

    impl Number for Avx2 {
        #[inline(always)]
        fn splat(value: f64) -> Self {
            vector!(Self(_mm256_set1_pd(value), _mm256_set1_pd(value)))
        }

        #[inline(always)]
        fn add(self, other: Self) -> Self {
            vector!(Self(_mm256_add_pd(self.0, other.0), _mm256_add_pd(self.1, other.1)))
        }

        #[inline(always)]
        fn sub(self, other: Self) -> Self {
            vector!(Self(_mm256_sub_pd(self.0, other.0), _mm256_sub_pd(self.1, other.1)))
        }

        #[inline(always)]
        fn mul(self, other: Self) -> Self {
            vector!(Self(_mm256_mul_pd(self.0, other.0), _mm256_mul_pd(self.1, other.1)))
        }
    }

    impl Lanes for Avx2 {
        #[inline(always)]
        fn load(from: &[f64]) -> Self {
            let from = &from[..LANES];
            vector!(Self(_mm256_loadu_pd(from.as_ptr()), _mm256_loadu_pd(from[4..].as_ptr())))
        }

        #[inline(always)]
        fn store(self, to: &mut [f64]) {
            let to = &mut to[..LANES];
            vector!({
                _mm256_storeu_pd(to.as_mut_ptr(), self.0);
                _mm256_storeu_pd(to[4..].as_mut_ptr(), self.1);
            });
        }

        #[inline(always)]
        fn div(self, other: Self) -> Self {
            vector!(Self(_mm256_div_pd(self.0, other.0), _mm256_div_pd(self.1, other.1)))
        }

        #[inline(always)]
        fn sqrt(self) -> Self {
            vector!(Self(_mm256_sqrt_pd(self.0), _mm256_sqrt_pd(self.1)))
        }

        #[inline(always)]
        fn max(self, other: Self) -> Self {
            vector!(Self(_mm256_max_pd(self.0, other.0), _mm256_max_pd(self.1, other.1)))
        }

        #[inline(always)]
        fn less(self, other: Self) -> u8 {
            vector!({
                let low = _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_LT_OQ>(self.0, other.0));
                let high = _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_LT_OQ>(self.1, other.1));
                (low | high << 4) as u8
            })
        }

        #[inline(always)]
        fn select(mask: u8, this: Self, other: Self) -> Self {
            // The sign bit of each lane chooses.
            let bit = |k: u32| i64::from(mask >> k) << 63;
            vector!({
                let low = _mm256_castsi256_pd(_mm256_set_epi64x(bit(3), bit(2), bit(1), bit(0)));
                let high = _mm256_castsi256_pd(_mm256_set_epi64x(bit(7), bit(6), bit(5), bit(4)));
                Self(
                    _mm256_blendv_pd(other.0, this.0, low),
                    _mm256_blendv_pd(other.1, this.1, high),
                )
            })
        }

        #[inline(always)]
        fn mark(mask: u8, value: i32, to: &mut [i32]) {
            let to = &mut to[..LANES];
            vector!({
                let bits = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
                let chosen = _mm256_cmpeq_epi32(
                    _mm256_and_si256(_mm256_set1_epi32(mask.into()), bits),
                    bits,
                );
                _mm256_maskstore_epi32(to.as_mut_ptr(), chosen, _mm256_set1_epi32(value));
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every operation on awkward numbers, as bits.
    struct Everything([f64; LANES], [f64; LANES]);

    impl Work for Everything {
        type Output = Vec<u64>;

        #[inline(always)]
        fn run<L: Lanes>(self) -> Vec<u64> {
            let (a, b) = (L::load(&self.0), L::load(&self.1));
            let less = a.less(b);
            let mut out = vec![u64::from(less)];
            for lanes in [
                a.add(b),
                a.sub(b),
                a.mul(b),
                a.div(b),
                b.mul(b).sqrt(),
                a.max(b),
                L::select(less, a, b),
                L::splat(self.0[0]),
            ] {
                let mut to = [0.0; LANES];
                lanes.store(&mut to);
                // NaN has many bit patterns; one is enough.
                out.extend(to.map(|v| if v.is_nan() { 1 } else { v.to_bits() }));
            }
            out.push(a.greatest().to_bits());
            let mut marked = [-1; LANES + 1];
            L::mark(less, 7, &mut marked);
            out.extend(marked.map(|v| v as u64));
            out.push(u64::from(L::same(7, &marked)));
            out
        }
    }

    #[test]
    fn vectors_compute_what_plain_numbers_do() {
        let numbers = [0.1, -3.0, 1e300, f64::INFINITY, f64::NAN, -0.0, 5e-324, 7.5];
        for turn in 0..LANES {
            let turned = std::array::from_fn(|k| numbers[(k + turn) % LANES]);
            let plain = Everything(numbers, turned).run::<Plain>();
            assert_eq!(dispatch(Everything(numbers, turned)), plain);
            #[cfg(target_arch = "x86_64")]
            if is_x86_feature_detected!("avx2") {
                // SAFETY: the feature was just found.
                assert_eq!(unsafe { x86::with_avx2(Everything(numbers, turned)) }, plain);
            }
        }
    }
}
