//! Numbers in binary files: little or big end first, at any place.

use rayon::prelude::*;

use crate::input::report::Fault;
use planisphere_core::{scene::Reals, text};
use planisphere_memory as memory;

/// Numbers that a thread turns at least.
const LEAST: usize = 1 << 14;

/// Some bytes at a place, if they are there.
pub(super) fn take<const N: usize>(bytes: &[u8], at: usize) -> Option<[u8; N]> {
    bytes.get(at..at.checked_add(N)?)?.try_into().ok()
}

/// Numbers of so many bytes that lie together; what is left at the end is none.
pub(super) fn numbers<const N: usize, T: Send>(
    bytes: &[u8],
    turn: impl Fn([u8; N]) -> T + Sync,
) -> Vec<T> {
    bytes.as_chunks::<N>().0.par_iter().with_min_len(LEAST).map(|bytes| turn(*bytes)).collect()
}

/// Whether there is memory for so many bytes.
///
/// # Errors
/// How much there is.
pub(super) fn room(needed: usize) -> Result<(), Fault> {
    memory::room(needed as u64).map_err(|available| {
        let [needed, available] = [needed as u64, available].map(text::bytes);
        Fault::whole(
            format!("a frame takes {needed} of memory, and {available} is available"),
            "free some memory, or draw fewer particles at a time",
        )
    })
}

/// Whether all positions are places.
///
/// # Errors
/// The first that is none.
pub(super) fn all_finite(centers: &Reals) -> Result<(), Fault> {
    super::first_unlike(centers, f64::is_finite).map_or(Ok(()), |at| {
        let axis = ["x", "y", "z"][at % 3];
        Err(Fault::whole(
            format!(
                "`{axis}` of particle {} (counted from 0) is {}: there is no such place",
                at / 3,
                centers.get(at)
            ),
            "write the frame again, or leave the particle out",
        ))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_there_is_not_read() {
        assert_eq!(take::<4>(b"abcdef", 2), Some(*b"cdef"));
        assert_eq!(take::<4>(b"abcdef", 3), None);
        assert_eq!(take::<4>(b"abcdef", usize::MAX), None);
        assert_eq!(numbers(&[0, 1, 1, 0, 7], u16::from_be_bytes), [1, 256]);
    }

    #[test]
    fn the_first_that_is_no_place_is_told() {
        let mut values = vec![0.0f32; 300_000];
        assert!(all_finite(&Reals::F32(values.clone().into())).is_ok());
        (values[100_000], values[200_000]) = (f32::NAN, f32::INFINITY);
        let fault = all_finite(&Reals::F32(values.into())).expect_err("no place");
        let error = fault.into_error("it", "");
        assert!(error.message().contains("`y` of particle 33333 "), "{error}");
    }
}
