//! Ends before their time: signals and panics. What must not be left behind is taken away first.

/// Installs the handlers. Signals that whoever started the program has ignored (`nohup`) stay
/// ignored, but for an interrupt that a process sends: shells ignore interrupts for what they start
/// in the background, so that those of the terminal do not reach it.
pub(super) fn install() {
    #[cfg(unix)]
    unix::install();
    let words = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        words(panic);
        super::complain(
            "error: this is a fault of planisphere. No file was half written.\n\
             fix: please report it, with the command, the scene and the lines above",
        );
        end_now(PANIC);
    }));
}

/// Ends the process while other threads are at work, and leaves nothing behind.
pub(super) fn end_now(code: u8) -> ! {
    planisphere_io::litter::clear();
    end(code.into())
}

/// The exit code after a panic, as Rust's own.
const PANIC: u8 = 101;

/// Ends the process at once: other threads may be anywhere, and nothing of theirs is waited for.
pub(super) fn end(code: i32) -> ! {
    #[cfg(unix)]
    // SAFETY: a call that does not come back, and touches nothing.
    unsafe {
        libc::_exit(code)
    }
    #[cfg(not(unix))]
    std::process::exit(code)
}

#[cfg(unix)]
mod unix {
    use std::{mem, ptr};

    use planisphere_io::litter::{self, SIGNALS};

    pub(super) fn install() {
        for signal in SIGNALS {
            let handled = handle(signal, end as *const () as usize);
            if !handled && matches!(signal, libc::SIGINT | libc::SIGQUIT) {
                set(signal, end_if_sent as *const () as usize, libc::SA_SIGINFO);
            }
        }
        // A file beyond the limit (`ulimit -f`) is then an error of writing, in words. Ignored
        // would do as well, but children would inherit that.
        handle(libc::SIGXFSZ, nothing as *const () as usize);
    }

    /// Sets a handler, unless the signal is ignored. Whether it did.
    fn handle(signal: libc::c_int, handler: usize) -> bool {
        // SAFETY: all zero bytes are a valid `sigaction`; the pointer is to a whole value.
        let ignored = unsafe {
            let mut old: libc::sigaction = mem::zeroed();
            libc::sigaction(signal, ptr::null(), &raw mut old) != 0
                || old.sa_sigaction == libc::SIG_IGN
        };
        if !ignored {
            set(signal, handler, 0);
        }
        !ignored
    }

    fn set(signal: libc::c_int, handler: usize, flags: libc::c_int) {
        // SAFETY: all zero bytes are a valid `sigaction`; the pointers are to whole values; the
        // handlers below make only system calls that POSIX allows in one. (They run on the thread's
        // own stack: Rust's stack for signals is short.)
        unsafe {
            let mut new: libc::sigaction = mem::zeroed();
            new.sa_sigaction = handler;
            new.sa_flags = libc::SA_RESTART | flags;
            libc::sigemptyset(&raw mut new.sa_mask);
            libc::sigaction(signal, &raw const new, ptr::null_mut());
        }
    }

    /// Ends the process if another one asks for it, and not the terminal.
    extern "C" fn end_if_sent(
        signal: libc::c_int,
        from: *const libc::siginfo_t,
        _: *const libc::c_void,
    ) {
        // SAFETY: the system gives a whole value to handlers that are set with `SA_SIGINFO`.
        let code = unsafe { (*from).si_code };
        // What processes send has a code of 0 or less, what the system sends more.
        if code <= 0 {
            end(signal);
        }
    }

    extern "C" fn nothing(_: libc::c_int) {}

    /// Ends the process by the signal, as if it had not been handled, so that whoever waits for it
    /// sees which it was.
    extern "C" fn end(signal: libc::c_int) {
        if litter::waits(signal) {
            return;
        }
        litter::clear();
        // SAFETY: system calls that POSIX allows in a handler, with whole values.
        unsafe {
            libc::signal(signal, libc::SIG_DFL);
            let mut set: libc::sigset_t = mem::zeroed();
            libc::sigemptyset(&raw mut set);
            libc::sigaddset(&raw mut set, signal);
            libc::pthread_sigmask(libc::SIG_UNBLOCK, &raw const set, ptr::null_mut());
            libc::raise(signal);
        }
        // The first process of a container is not ended by a signal's default.
        super::end(128 + signal);
    }

    #[cfg(test)]
    mod tests {
        use std::process::Command;

        /// Runs in a process of its own, for the test below.
        #[test]
        #[ignore = "panics, in a process of its own"]
        fn panics() {
            crate::cli::signals::install();
            std::thread::scope(|scope| scope.spawn(|| panic!("on purpose")).join().unwrap_err());
        }

        #[test]
        fn a_panic_of_any_thread_has_words_and_an_exit_code() {
            let program = std::env::current_exe().unwrap();
            let name = "cli::signals::unix::tests::panics";
            let output = Command::new(program)
                .args([name, "--exact", "--ignored", "--nocapture"])
                .output()
                .unwrap();
            let words = String::from_utf8_lossy(&output.stderr);
            assert_eq!(output.status.code(), Some(101), "{words}");
            assert!(words.contains("on purpose") && words.contains("please report it"), "{words}");
        }
    }
}
