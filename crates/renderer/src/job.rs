//! A picture under way.

use std::{
    any::Any,
    fmt,
    future::Future,
    panic,
    pin::Pin,
    sync::{Arc, Condvar, Mutex, PoisonError},
    task::{Context, Poll, Waker},
};

use planisphere_core::drawing::Control;

use crate::{Error, Picture, turns::Turns};

/// What came of it; a panic is handed on to whoever waits.
type Outcome<T> = Result<Result<T, Error>, Box<dyn Any + Send>>;

/// A picture under way, or what is made of it. It is a future of any runtime, and can be waited for
/// without one. Dropped, it is cancelled.
///
/// A panic while it is drawn goes on in whoever waits for it.
#[must_use = "a job that is dropped is cancelled"]
pub struct Job<T = Picture>(Arc<Shared<T>>);

pub(crate) struct Shared<T> {
    state: Mutex<State<T>>,
    done: Condvar,
    pub control: Control,
    turns: Arc<Turns>,
}

enum State<T> {
    /// It waits for its turn, by this number once it is known.
    Waiting(Option<u64>, Option<Waker>),
    Running(Option<Waker>),
    Done(Outcome<T>),
    /// The outcome was handed out.
    Taken,
}

impl<T> fmt::Debug for Job<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let state = match &*self.0.lock() {
            State::Waiting(..) => "waiting",
            State::Running(_) => "running",
            State::Done(_) | State::Taken => "done",
        };
        let done = self.0.control.progress();
        f.debug_struct("Job").field("state", &state).field("progress", &done).finish()
    }
}

impl<T: Send + 'static> Job<T> {
    /// Begins it when it is its turn. Whoever waits is woken before what was asked for is dropped:
    /// a scene that goes with it may be large.
    pub(crate) fn begin<A: Send + 'static>(
        turns: &Arc<Turns>,
        asked: A,
        work: impl FnOnce(&A, &Control) -> Result<T, Error> + Send + 'static,
    ) -> Self {
        let shared = Arc::new(Shared {
            state: Mutex::new(State::Waiting(None, None)),
            done: Condvar::new(),
            control: Control::new(),
            turns: Arc::clone(turns),
        });
        let theirs = Arc::clone(&shared);
        let number = turns.begin(move |turn| {
            if !theirs.run() {
                return;
            }
            let work = panic::AssertUnwindSafe(|| work(&asked, &theirs.control));
            let outcome = panic::catch_unwind(work);
            if let Ok(Ok(_)) = outcome {
                theirs.control.reach(1.0);
            }
            // The next begins before whoever waits for this one is woken.
            drop(turn);
            theirs.end(outcome);
        });
        if let State::Waiting(known, _) = &mut *shared.lock() {
            *known = Some(number);
        }
        Self(shared)
    }

    /// Blocks until it is there. Not from inside of a rayon pool that it is drawn on: it would wait
    /// for itself.
    ///
    /// # Errors
    /// Why there is no picture.
    pub fn wait(self) -> Result<T, Error> {
        let state = self.0.lock();
        let state = self.0.done.wait_while(state, |state| !matches!(state, State::Done(_)));
        let mut state = state.unwrap_or_else(PoisonError::into_inner);
        match std::mem::replace(&mut *state, State::Taken) {
            State::Done(Ok(result)) => result,
            State::Done(Err(payload)) => {
                drop(state);
                panic::resume_unwind(payload)
            }
            _ => unreachable!("it was waited for"),
        }
    }

    /// Gives a function that says how far it is, as an `f32` from 0 to 1, from any thread. It never
    /// falls, and is 1 at the end.
    pub fn progress(&self) -> impl Fn() -> f32 + Send + Sync + 'static + use<T> {
        let control = self.0.control.clone();
        move || control.progress()
    }

    /// Gives a function that ends it within milliseconds, from any thread: with
    /// [`Error::Cancelled`], unless it is done.
    pub fn canceller(&self) -> impl Fn() + Send + Sync + 'static + use<T> {
        let shared = Arc::clone(&self.0);
        move || shared.cancel()
    }
}

impl<T> Shared<T> {
    fn lock(&self) -> std::sync::MutexGuard<'_, State<T>> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether it is still wanted, now that it is its turn.
    fn run(&self) -> bool {
        let mut state = self.lock();
        if let State::Waiting(_, waker) = &mut *state {
            let waker = waker.take();
            *state = State::Running(waker);
            return true;
        }
        false
    }

    fn end(&self, outcome: Outcome<T>) {
        let mut state = self.lock();
        let waker = match &mut *state {
            State::Waiting(_, waker) | State::Running(waker) => waker.take(),
            State::Done(_) | State::Taken => return,
        };
        *state = State::Done(outcome);
        drop(state);
        self.done.notify_all();
        if let Some(waker) = waker {
            waker.wake();
        }
    }

    fn cancel(&self) {
        self.control.cancel();
        let mut state = self.lock();
        // One that is under way ends by itself.
        let State::Waiting(number, waker) = &mut *state else { return };
        let (number, waker) = (number.take(), waker.take());
        *state = State::Done(Ok(Err(Error::Cancelled)));
        drop(state);
        self.done.notify_all();
        if let Some(waker) = waker {
            waker.wake();
        }
        if let Some(number) = number {
            self.turns.forget(number);
        }
    }
}

impl<T: Send + 'static> Future for Job<T> {
    type Output = Result<T, Error>;

    fn poll(self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Self::Output> {
        let mut state = self.0.lock();
        match &mut *state {
            State::Waiting(_, waker) | State::Running(waker) => {
                *waker = Some(context.waker().clone());
                return Poll::Pending;
            }
            State::Taken => panic!("a job was asked again after its picture was handed out"),
            State::Done(_) => {}
        }
        match std::mem::replace(&mut *state, State::Taken) {
            State::Done(Ok(result)) => Poll::Ready(result),
            State::Done(Err(payload)) => {
                drop(state);
                panic::resume_unwind(payload)
            }
            _ => unreachable!("it was looked at"),
        }
    }
}

impl<T> Drop for Job<T> {
    fn drop(&mut self) {
        self.0.cancel();
    }
}
