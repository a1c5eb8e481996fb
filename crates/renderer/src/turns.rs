//! Few pictures at a time, first come first served.
//!
//! Each picture holds memory of its own while it is drawn. With no limit, many requests at once
//! would all be under way together, end together, and hold the memory of all.
//!
//! A thread of a rayon pool never waits here. It may hold a piece of the very picture that it would
//! wait for: see `planisphere_core::pool`.

use std::{
    cell::{Cell, RefCell},
    collections::VecDeque,
    sync::{Arc, Condvar, Mutex, PoisonError},
};

/// What is done in a turn.
type Task = Box<dyn FnOnce(Turn) + Send>;

/// Who waits for a turn.
enum Waiting {
    /// A thread that sleeps.
    Thread(Arc<Bell>),
    /// What a thread is begun for.
    Task(u64, Task),
}

/// Wakes a thread once.
#[derive(Default)]
struct Bell {
    rung: Mutex<bool>,
    wakes: Condvar,
}

impl Bell {
    fn ring(&self) {
        *self.rung.lock().unwrap_or_else(PoisonError::into_inner) = true;
        self.wakes.notify_one();
    }

    fn wait(&self) {
        let rung = self.rung.lock().unwrap_or_else(PoisonError::into_inner);
        drop(self.wakes.wait_while(rung, |rung| !*rung));
    }
}

struct Queue {
    /// Turns at a time, at most.
    limit: usize,
    running: usize,
    waiting: VecDeque<Waiting>,
    next: u64,
}

/// The turns of a renderer.
pub(crate) struct Turns(Mutex<Queue>);

/// A turn, until dropped.
pub(crate) struct Turn(Arc<Turns>);

impl Turns {
    /// So many at a time, at least one.
    pub fn new(limit: usize) -> Arc<Self> {
        let limit = limit.max(1);
        let (running, waiting, next) = (0, VecDeque::new(), 0);
        Arc::new(Self(Mutex::new(Queue { limit, running, waiting, next })))
    }

    fn queue(&self) -> std::sync::MutexGuard<'_, Queue> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Turns at a time, at most.
    pub fn limit(&self) -> usize {
        self.queue().limit
    }

    /// Turns that are taken or wanted.
    pub fn wanted(&self) -> usize {
        let queue = self.queue();
        queue.running + queue.waiting.len()
    }

    /// Sleeps until it is this thread's turn.
    pub fn wait(self: &Arc<Self>) -> Turn {
        let mut queue = self.queue();
        if queue.running < queue.limit {
            queue.running += 1;
        } else {
            let bell = Arc::<Bell>::default();
            queue.waiting.push_back(Waiting::Thread(Arc::clone(&bell)));
            drop(queue);
            bell.wait();
        }
        Turn(Arc::clone(self))
    }

    /// Begins a task, on a thread of its own, when it is its turn. The number is for
    /// [`Turns::forget`].
    pub fn begin(self: &Arc<Self>, task: impl FnOnce(Turn) + Send + 'static) -> u64 {
        let mut queue = self.queue();
        let number = queue.next;
        queue.next += 1;
        if queue.running < queue.limit {
            queue.running += 1;
            drop(queue);
            start(Box::new(task), Turn(Arc::clone(self)));
        } else {
            queue.waiting.push_back(Waiting::Task(number, Box::new(task)));
        }
        number
    }

    /// Takes a task that still waits out of the queue.
    pub fn forget(&self, number: u64) {
        let mut queue = self.queue();
        let at =
            queue.waiting.iter().position(|one| matches!(one, Waiting::Task(n, _) if *n == number));
        // It is dropped outside of the lock.
        let task = at.and_then(|at| queue.waiting.remove(at));
        drop(queue);
        drop(task);
    }
}

impl Drop for Turn {
    fn drop(&mut self) {
        let mut queue = self.0.queue();
        match queue.waiting.pop_front() {
            // The turn is handed on.
            Some(next) => {
                drop(queue);
                match next {
                    Waiting::Thread(bell) => bell.ring(),
                    Waiting::Task(_, task) => go_on(task, Turn(Arc::clone(&self.0))),
                }
            }
            None => queue.running -= 1,
        }
    }
}

thread_local! {
    /// Whether this thread runs tasks, one after the other.
    static RUNS: Cell<bool> = const { Cell::new(false) };
    /// What it runs next.
    static NEXT: RefCell<Option<(Task, Turn)>> = const { RefCell::new(None) };
}

/// Runs a task whose turn was handed on: on this thread, if it runs tasks and is through with one.
fn go_on(task: Task, turn: Turn) {
    if RUNS.get() && NEXT.with_borrow(Option::is_none) {
        NEXT.set(Some((task, turn)));
    } else {
        start(task, turn);
    }
}

/// Runs a task on a thread of its own; where none can be had, on this one.
fn start(task: Task, turn: Turn) {
    let both = Arc::new(Mutex::new(Some((task, turn))));
    let run = |both: &Mutex<Option<(Task, Turn)>>| {
        RUNS.set(true);
        let mut next = both.lock().unwrap_or_else(PoisonError::into_inner).take();
        while let Some((task, turn)) = next {
            task(turn);
            next = NEXT.take();
        }
        RUNS.set(false);
    };
    let theirs = Arc::clone(&both);
    let named = std::thread::Builder::new().name("planisphere".into());
    if named.spawn(move || run(&theirs)).is_err() {
        run(&both);
    }
}

#[cfg(test)]
mod tests {
    use std::{
        sync::atomic::{AtomicUsize, Ordering},
        sync::mpsc,
        time::Duration,
    };

    use super::*;

    #[test]
    fn tasks_come_in_turn_and_few_at_a_time() {
        let turns = Turns::new(2);
        let (now, most) = (Arc::new(AtomicUsize::new(0)), Arc::new(AtomicUsize::new(0)));
        let (sender, order) = mpsc::channel();
        for number in 0..50 {
            let (now, most, sender) = (Arc::clone(&now), Arc::clone(&most), sender.clone());
            turns.begin(move |turn| {
                most.fetch_max(now.fetch_add(1, Ordering::SeqCst) + 1, Ordering::SeqCst);
                sender.send(number).unwrap();
                std::thread::sleep(Duration::from_millis(1));
                now.fetch_sub(1, Ordering::SeqCst);
                drop(turn);
            });
        }
        let order: Vec<usize> = (0..50).map(|_| order.recv().unwrap()).collect();
        // Two that begin at once may tell it the other way round.
        assert!(
            order.iter().enumerate().all(|(at, &number)| at.abs_diff(number) <= 1),
            "{order:?}"
        );
        assert_eq!(most.load(Ordering::SeqCst), 2);
        drop(turns.wait());
        while turns.wanted() > 0 {
            std::thread::yield_now();
        }
    }

    #[test]
    fn a_task_that_waits_can_be_forgotten() {
        let turns = Turns::new(1);
        let turn = turns.wait();
        let (sender, ran) = mpsc::channel();
        let [one, two] = [1, 2].map(|number| {
            let sender = sender.clone();
            turns.begin(move |_turn| sender.send(number).unwrap())
        });
        turns.forget(one);
        drop(turn);
        assert_eq!(ran.recv().unwrap(), 2);
        turns.forget(two);
        drop(sender);
        assert!(ran.recv().is_err());
    }
}
