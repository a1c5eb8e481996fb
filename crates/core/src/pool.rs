//! Loops over threads whose pieces stay with a thread from one frame to the next.
//!
//! A frame writes what the frame before wrote: ids, tiles, lists. Where another core has these
//! lines changed in its cache, a write waits for them: measured on two cores, filling 4 MB took 65
//! us with the halves as they were, and 170 us with the halves exchanged. So each thread begins
//! with pieces of its own, the same ones each time, and helps others when it is through.
//!
//! **No rayon inside of a lock, a `OnceLock` or a borrow of a `thread_local`.** A thread that waits
//! there for others takes up whatever work there is meanwhile, another drawing included: that asks
//! for the same lock, and waits for itself for ever.

use std::{
    ops::{Deref, DerefMut, Range},
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicUsize, Ordering},
    },
};

use rayon::prelude::*;

/// Runs the work of a frame on a thread of the pool, so that it is not left and entered again for
/// each loop. Memory of a frame that is large, such as its ids, should be had before: threads of
/// the pool have heaps of their own, and frames run now on one of them, now on another.
pub fn enter<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    rayon::scope(|_| work())
}

/// The next piece of a thread, in a pair of cache lines of its own.
#[repr(align(128))]
struct Cursor(AtomicUsize);

/// Runs `work` for the pieces `0..pieces`, once each.
pub fn each(pieces: usize, work: impl Fn(usize) + Sync) {
    let threads = rayon::current_num_threads().min(pieces);
    if threads <= 1 {
        return (0..pieces).for_each(work);
    }
    let own = |thread: usize| -> Range<usize> {
        thread * pieces / threads..(thread + 1) * pieces / threads
    };
    let cursors: Vec<_> =
        (0..threads).map(|thread| Cursor(AtomicUsize::new(own(thread).start))).collect();
    (0..threads).into_par_iter().with_max_len(1).for_each(|task| {
        let first = rayon::current_thread_index().unwrap_or(task);
        for thread in (first..first + threads).map(|thread| thread % threads) {
            let end = own(thread).end;
            loop {
                let piece = cursors[thread].0.fetch_add(1, Ordering::Relaxed);
                if piece >= end {
                    break;
                }
                work(piece);
            }
        }
    });
}

/// [`each`] of a few things.
pub fn each_of<T: Send>(things: impl IntoIterator<Item = T>, work: impl Fn(T) + Sync) {
    let things: Vec<_> = things.into_iter().map(|thing| Mutex::new(Some(thing))).collect();
    each(things.len(), |number| {
        let thing = things[number].lock().unwrap_or_else(PoisonError::into_inner).take();
        thing.into_iter().for_each(&work);
    });
}

/// Memory that is given back by another thread of the pool, so that nobody waits for it: to unmap
/// takes the system about as long as to fill. It must be dropped inside of the pool ([`enter`]).
pub struct Later<T: Send + 'static>(Option<Vec<T>>);

/// Bytes that are given back at once.
const LITTLE: usize = 1 << 20;

impl<T: Send + 'static> Later<T> {
    /// The memory itself.
    pub fn keep(mut self) -> Vec<T> {
        self.0.take().unwrap_or_default()
    }
}

impl<T: Send + 'static> From<Vec<T>> for Later<T> {
    fn from(memory: Vec<T>) -> Self {
        Self(Some(memory))
    }
}

impl<T: Send + 'static> Deref for Later<T> {
    type Target = Vec<T>;

    fn deref(&self) -> &Vec<T> {
        self.0.as_ref().expect("it is there until it is kept or dropped")
    }
}

impl<T: Send + 'static> DerefMut for Later<T> {
    fn deref_mut(&mut self) -> &mut Vec<T> {
        self.0.as_mut().expect("it is there until it is kept or dropped")
    }
}

impl<T: Send + 'static> Drop for Later<T> {
    fn drop(&mut self) {
        if let Some(memory) = self.0.take()
            && memory.capacity() * size_of::<T>() > LITTLE
        {
            give_back(memory);
        }
    }
}

/// Gives memory back little by little, as tasks of the pool: a thread that waits takes up whatever
/// there is, and must soon be back.
fn give_back<T: Send + 'static>(mut memory: Vec<T>) {
    rayon::spawn(move || {
        let left = memory.capacity().saturating_sub(4 * LITTLE / size_of::<T>().max(1));
        if left > 0 {
            memory.truncate(left);
            memory.shrink_to(left);
            give_back(memory);
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_piece_is_done_once_on_any_pool() {
        for threads in [1, 2, 3, 16] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            for pieces in [0, 1, 2, 5, 1000] {
                let done: Vec<_> = (0..pieces).map(|_| AtomicUsize::new(0)).collect();
                // From outside of the pool, from inside, and from several threads of it at once.
                let all = || {
                    each(pieces, |piece| {
                        done[piece].fetch_add(1, Ordering::Relaxed);
                    });
                };
                pool.install(all);
                pool.install(|| enter(all));
                pool.install(|| rayon::join(all, all));
                assert!(
                    done.iter().all(|done| done.load(Ordering::Relaxed) == 4),
                    "{threads} threads, {pieces} pieces"
                );
                let mut things = vec![0; pieces];
                pool.install(|| {
                    each_of(things.iter_mut().enumerate(), |(number, thing)| *thing += number + 1)
                });
                assert!(
                    things.iter().enumerate().all(|(number, thing)| *thing == number + 1),
                    "{threads}, {pieces}"
                );
            }
        }
    }
}
