//! Says on a terminal what takes long: nothing for the first half second, then one line with how
//! much of it is done, as far as that is known, and the seconds.

use std::{
    io::{self, IsTerminal, Write},
    sync::mpsc::{self, RecvTimeoutError, Sender},
    thread::{self, JoinHandle},
    time::{Duration, Instant},
};

use super::ends::notes_are_heard;
use planisphere_io::load::Control;

/// How often the line is written.
const EVERY: Duration = Duration::from_millis(500);

/// A step that is under way, until dropped.
pub(super) struct Progress {
    stop: Option<(Sender<()>, JoinHandle<()>)>,
}

impl Progress {
    /// Begins a step, named by what is being done, such as "drawing".
    pub fn step(doing: &'static str) -> Self {
        Self::of(doing, &Control::new())
    }

    /// The same, which says how much of it is done.
    pub fn of(doing: &'static str, control: &Control) -> Self {
        let control = control.clone();
        if !io::stderr().is_terminal() || !notes_are_heard() {
            return Self { stop: None };
        }
        let (sender, receiver) = mpsc::channel();
        let start = Instant::now();
        let thread = thread::Builder::new().spawn(move || {
            let mut shown = false;
            while let Err(RecvTimeoutError::Timeout) = receiver.recv_timeout(EVERY) {
                let (seconds, done) = (start.elapsed().as_secs(), control.progress());
                let done = match (100.0 * done) as u32 {
                    0 => String::new(),
                    percent => format!(" {percent} %,"),
                };
                let _ = write!(io::stderr(), "\r\x1b[K{doing} ...{done} {seconds} s");
                shown = true;
            }
            if shown {
                // Back to the start of the line, and clear it.
                let _ = write!(io::stderr(), "\r\x1b[K");
            }
        });
        // No thread to be had: the step goes on all the same, unseen.
        Self { stop: thread.ok().map(|thread| (sender, thread)) }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some((sender, thread)) = self.stop.take() {
            drop(sender);
            // Waited for, so that its line is gone before the next is written.
            let _ = thread.join();
        }
    }
}
