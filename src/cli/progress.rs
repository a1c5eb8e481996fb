//! Says on a terminal what takes long: nothing for the first second, then one line that counts the
//! seconds.

use std::{
    io::{self, IsTerminal, Write},
    sync::mpsc::{self, RecvTimeoutError, Sender},
    thread::{self, JoinHandle},
    time::{Duration, Instant},
};

use super::ends::notes_are_heard;

/// A step that is under way, until dropped.
pub(super) struct Progress {
    stop: Option<(Sender<()>, JoinHandle<()>)>,
}

impl Progress {
    /// Begins a step, named by what is being done, such as "drawing".
    pub fn step(doing: &'static str) -> Self {
        if !io::stderr().is_terminal() || !notes_are_heard() {
            return Self { stop: None };
        }
        let (sender, receiver) = mpsc::channel();
        let start = Instant::now();
        let thread = thread::Builder::new().spawn(move || {
            let mut shown = false;
            while let Err(RecvTimeoutError::Timeout) = receiver.recv_timeout(Duration::from_secs(1))
            {
                let _ = write!(io::stderr(), "\r{doing} ... {} s", start.elapsed().as_secs());
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
