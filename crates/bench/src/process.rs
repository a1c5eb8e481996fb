//! What a process costs: wall time, processor time summed over its threads, peak memory.
//!
//! Processor time and memory are the operating system's own account (`getrusage`, `wait4`), which
//! only Unix has; elsewhere they are left out.

use std::{
    io::{self, Read},
    process::{Command, ExitStatus, Stdio},
    time::Instant,
};

use serde::{Deserialize, Serialize};

use planisphere_io::litter::{Child, Shield};

/// What one run of a process has cost.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Cost {
    /// Milliseconds from just before its start until it has been waited for.
    pub wall: f64,
    /// Milliseconds of processor time, user and system, of all its threads.
    pub cpu: Option<f64>,
    /// Most bytes of memory that it held, mapped files included as far as they were read.
    pub peak: Option<u64>,
}

/// How a run ended.
pub struct Ended {
    /// Its cost.
    pub cost: Cost,
    /// Its exit.
    pub status: ExitStatus,
    /// What it wrote to standard output.
    pub output: String,
    /// What it wrote to standard error.
    pub errors: String,
}

/// Milliseconds of processor time that this process has taken so far, all threads together.
#[cfg(unix)]
pub fn cpu_time() -> Option<f64> {
    let mut usage = std::mem::MaybeUninit::<libc::rusage>::zeroed();
    // SAFETY: the pointer is to a whole `rusage`, which the call fills.
    let answer = unsafe { libc::getrusage(libc::RUSAGE_SELF, usage.as_mut_ptr()) };
    // SAFETY: all zero bytes are a valid `rusage`, filled or not.
    let usage = unsafe { usage.assume_init() };
    (answer == 0).then(|| cpu_of(&usage))
}

/// Not known here.
#[cfg(not(unix))]
pub fn cpu_time() -> Option<f64> {
    None
}

#[cfg(unix)]
fn cpu_of(usage: &libc::rusage) -> f64 {
    let milliseconds = |time: libc::timeval| time.tv_sec as f64 * 1e3 + time.tv_usec as f64 * 1e-3;
    milliseconds(usage.ru_utime) + milliseconds(usage.ru_stime)
}

/// Runs a command with nothing on standard input, and waits for it.
///
/// The peak of a process counts from before its `exec`: on Linux it is never less than what the
/// process that calls this has held. So call it from a small one, as `bench time` is.
///
/// # Errors
/// When it cannot be started.
pub fn run(command: &mut Command) -> io::Result<Ended> {
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let begun = Instant::now();
    let (mut child, _ended_with_us) = {
        let _shield = Shield::up();
        let child = command.spawn()?;
        let id = child.id();
        (child, Child::new(id))
    };
    // Errors are read aside, so that neither pipe can fill up and stop the child.
    let mut stderr = child.stderr.take();
    let errors = std::thread::Builder::new().spawn(move || {
        let mut errors = Vec::new();
        // What cannot be read is missing from a message, no more.
        let _ = stderr.as_mut().map(|pipe| pipe.read_to_end(&mut errors));
        String::from_utf8_lossy(&errors).into_owned()
    })?;
    let mut output = Vec::new();
    if let Some(pipe) = &mut child.stdout {
        pipe.read_to_end(&mut output)?;
    }
    let (status, cpu, peak) = wait(child)?;
    let wall = begun.elapsed().as_secs_f64() * 1e3;
    Ok(Ended {
        cost: Cost { wall, cpu, peak },
        status,
        output: String::from_utf8_lossy(&output).into_owned(),
        errors: errors.join().unwrap_or_default(),
    })
}

#[cfg(unix)]
fn wait(child: std::process::Child) -> io::Result<(ExitStatus, Option<f64>, Option<u64>)> {
    use std::os::unix::process::ExitStatusExt;
    let mut usage = std::mem::MaybeUninit::<libc::rusage>::zeroed();
    let mut status = 0;
    let id = child.id().cast_signed();
    // SAFETY: both pointers are to whole values; the child is ours and nobody else waits for it.
    while unsafe { libc::wait4(id, &raw mut status, 0, usage.as_mut_ptr()) } != id {
        let error = io::Error::last_os_error();
        if error.kind() != io::ErrorKind::Interrupted {
            return Err(error);
        }
    }
    // SAFETY: all zero bytes are a valid `rusage`, filled or not.
    let usage = unsafe { usage.assume_init() };
    // Apple counts bytes, the others kibibytes.
    let unit = if cfg!(target_vendor = "apple") { 1 } else { 1024 };
    Ok((ExitStatus::from_raw(status), Some(cpu_of(&usage)), Some(usage.ru_maxrss as u64 * unit)))
}

#[cfg(not(unix))]
fn wait(mut child: std::process::Child) -> io::Result<(ExitStatus, Option<f64>, Option<u64>)> {
    Ok((child.wait()?, None, None))
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn a_child_is_measured() {
        let ended = run(Command::new("sh").args(["-c", "echo out; echo err >&2; exit 3"])).unwrap();
        assert_eq!(
            (ended.output.as_str(), ended.errors.as_str(), ended.status.code()),
            ("out\n", "err\n", Some(3))
        );
        assert!(
            ended.cost.wall > 0.0 && ended.cost.cpu.unwrap() >= 0.0 && ended.cost.peak.unwrap() > 0
        );
        assert!(run(&mut Command::new("/nonexistent/program")).is_err());
    }

    #[test]
    fn own_time_goes_on() {
        let before = cpu_time().unwrap();
        let mut sum = 0u64;
        while cpu_time().unwrap() - before < 5.0 {
            sum = std::hint::black_box(sum + 1);
        }
    }
}
