//! Says on a terminal what takes long: nothing for the first half second, then one line with how
//! much of it is done, as far as that is known, and the seconds. Of a sequence of pictures: a bar,
//! the rate, and the time that is left.

use std::{
    io::{self, IsTerminal, Write},
    sync::{
        Arc,
        atomic::{AtomicUsize, Ordering::Relaxed},
        mpsc::{self, RecvTimeoutError, Sender},
    },
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
        Self::shown(move |elapsed| {
            let (seconds, done) = (elapsed.as_secs(), control.progress());
            let done = match (100.0 * done) as u32 {
                0 => String::new(),
                percent => format!(" {percent} %,"),
            };
            format!("{doing} ...{done} {seconds} s")
        })
    }

    /// Pictures of a sequence: how many of them are done, and how long the others will take.
    pub fn pictures(done: &Arc<AtomicUsize>, of: usize) -> Self {
        let done = done.clone();
        Self::shown(move |elapsed| pictures(done.load(Relaxed), of, elapsed))
    }

    /// A line that is written again and again, from the time since it began.
    fn shown(words: impl Fn(Duration) -> String + Send + 'static) -> Self {
        if !io::stderr().is_terminal() || !notes_are_heard() {
            return Self { stop: None };
        }
        let (sender, receiver) = mpsc::channel();
        let start = Instant::now();
        let thread = thread::Builder::new().spawn(move || {
            let mut shown = false;
            while let Err(RecvTimeoutError::Timeout) = receiver.recv_timeout(EVERY) {
                let _ = write!(io::stderr(), "\r\x1b[K{}", words(start.elapsed()));
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

/// What is said of pictures of which some are done.
fn pictures(done: usize, of: usize, elapsed: Duration) -> String {
    const CELLS: usize = 20;
    let full = CELLS * done / of.max(1);
    let bar = format!("[{}{}]", "#".repeat(full), "-".repeat(CELLS - full));
    let seconds = elapsed.as_secs_f64();
    if done == 0 {
        return format!("{bar} 0 of {of} pictures, {seconds:.0} s");
    }
    let each = seconds / done as f64;
    let rate = match each {
        slow if slow > 1.0 => format!("{each:.1} s each"),
        _ => format!("{:.1} a second", 1.0 / each.max(1e-9)),
    };
    format!("{bar} {done} of {of} pictures, {rate}, {} left", left(each * (of - done) as f64))
}

/// A time that is to come, rounded up.
fn left(seconds: f64) -> String {
    let seconds = seconds.ceil() as u64;
    match (seconds / 3600, seconds / 60 % 60, seconds % 60) {
        (0, 0, seconds) => format!("{seconds} s"),
        (0, minutes, seconds) => format!("{minutes} min {seconds:02} s"),
        (hours, minutes, _) => format!("{hours} h {minutes:02} min"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_have_a_rate_and_a_time_left() {
        let said = |done, seconds| pictures(done, 120, Duration::from_secs_f64(seconds));
        assert_eq!(said(0, 2.0), "[--------------------] 0 of 120 pictures, 2 s");
        let words = "[#####---------------] 30 of 120 pictures, 3.0 a second, 30 s left";
        assert_eq!(said(30, 10.0), words);
        let words = "[###-----------------] 20 of 120 pictures, 4.0 s each, 6 min 40 s left";
        assert_eq!(said(20, 80.0), words);
        assert!(said(1, 90.0).ends_with("90.0 s each, 2 h 58 min left"), "{}", said(1, 90.0));
        assert!(said(120, 60.0).starts_with("[####################] 120 of 120"));
    }
}
