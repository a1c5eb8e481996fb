//! What the tests of the window share: displays that show to nobody, and waiting.
//!
//! Every test has a server of its own, because there is one pointer and one focus a server. What a
//! test needs and does not find, it names and fails; `tests/run.sh` installs it.
#![allow(dead_code, reason = "each test uses a part of it")]

use std::{
    io::{BufRead, BufReader},
    process::{Child, Command, Stdio},
    thread::sleep,
    time::{Duration, Instant},
};

/// How long anything may take before the test fails; a machine under load is slow.
pub const PATIENCE: Duration = Duration::from_secs(60);

/// The program, without the displays of whoever runs the test.
pub fn planisphere() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_planisphere"));
    command.env_remove("WAYLAND_DISPLAY").env_remove("WAYLAND_SOCKET").env_remove("DISPLAY");
    command
}

/// Asks until there is an answer.
pub fn wait_for<T>(what: &str, mut ask: impl FnMut() -> Option<T>) -> T {
    let start = Instant::now();
    loop {
        if let Some(answer) = ask() {
            return answer;
        }
        assert!(start.elapsed() < PATIENCE, "waited in vain: {what}");
        sleep(Duration::from_millis(10));
    }
}

/// Starts a program that a Debian package has.
pub fn start(command: &mut Command, package: &str) -> Child {
    let program = command.get_program().to_string_lossy().into_owned();
    command.spawn().unwrap_or_else(|error| {
        panic!(
            "{program}: {error}\nThis test needs {program}; on Debian: apt-get install {package}, \
             or run tests/run.sh"
        )
    })
}

/// An X server that shows to nobody.
pub struct XServer {
    pub process: Child,
    pub display: String,
}

impl XServer {
    pub fn new(arguments: &[&str]) -> Self {
        let mut process = start(
            Command::new("Xvfb")
                .args(["-displayfd", "1", "-nolisten", "tcp", "-noreset"])
                .args(arguments)
                .stdout(Stdio::piped())
                .stderr(Stdio::null()),
            "xvfb",
        );
        // It writes its number when it is ready.
        let mut line = String::new();
        BufReader::new(process.stdout.take().unwrap()).read_line(&mut line).unwrap();
        assert!(!line.trim().is_empty(), "Xvfb did not start with {arguments:?}");
        Self { process, display: format!(":{}", line.trim()) }
    }

    /// Runs xdotool; what it prints.
    pub fn xdotool(&self, arguments: &[&str]) -> String {
        let child = start(
            Command::new("xdotool")
                .args(arguments)
                .env("DISPLAY", &self.display)
                .stdout(Stdio::piped())
                .stderr(Stdio::null()),
            "xdotool",
        );
        String::from_utf8(child.wait_with_output().unwrap().stdout).unwrap()
    }
}

impl Drop for XServer {
    fn drop(&mut self) {
        // Asked, not killed: it then takes its lock file away. `kill` is part of every shell; the
        // program may be missing.
        let asked =
            Command::new("sh").args(["-c", &format!("kill {}", self.process.id())]).status();
        if !asked.is_ok_and(|status| status.success()) {
            let _ = self.process.kill();
        }
        let _ = self.process.wait();
    }
}
