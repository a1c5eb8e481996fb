//! Memory for many numbers, in large pages where the system has them: it is first written to in a
//! fraction of the time. Numbers that are parsed come slowly enough for pages of the usual size.

use bytemuck::{Zeroable, allocation::try_zeroed_vec};

/// Bytes from which large pages are asked for.
const LARGE: usize = 4 << 20;

/// Zeros, which take no memory until they are written over; none where it cannot be had.
pub(crate) fn zeros<T: Zeroable>(count: usize) -> Option<Vec<T>> {
    let zeros = try_zeroed_vec::<T>(count).ok()?;
    if size_of_val(zeros.as_slice()) >= LARGE {
        in_large_pages(&zeros);
    }
    Some(zeros)
}

/// Asks for large pages.
#[cfg(target_os = "linux")]
fn in_large_pages<T>(memory: &[T]) {
    /// Of all systems that there are.
    const PAGE: usize = 1 << 16;
    let range = memory.as_ptr_range();
    let start = (range.start as usize).next_multiple_of(PAGE);
    let length = (range.end as usize).saturating_sub(start) / PAGE * PAGE;
    // SAFETY: whole pages within memory of ours. The advice changes none of its bytes, and a system
    // that does not follow it is as good.
    unsafe { libc::madvise(start as *mut libc::c_void, length, libc::MADV_HUGEPAGE) };
}

/// Other systems decide it themselves.
#[cfg(not(target_os = "linux"))]
fn in_large_pages<T>(_: &[T]) {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zeros_are_zeros() {
        for count in [0, 1, LARGE / 8, LARGE] {
            let zeros = zeros::<u64>(count).expect("memory");
            assert_eq!((zeros.len(), zeros.iter().all(|zero| *zero == 0)), (count, true));
        }
        assert!(zeros::<u64>(usize::MAX / 8).is_none());
    }
}
