//! The command line: arguments to requests, requests to work, errors to words and exit codes.
//!
//! Only this module prints and only this module decides how the process ends. Data goes to standard
//! output, talk to standard error.

mod about;
mod args;
#[cfg(feature = "bench")]
mod bench;
mod camera;
mod check;
mod convert;
mod ends;
mod frames;
mod info;
mod look;
mod make;
mod merge;
mod overlay;
mod parse;
mod progress;
mod reading;
mod render;
mod sequence;
mod signals;
mod template;
#[cfg(feature = "window")]
mod view;

use std::{
    ffi::OsString,
    io::{self, IsTerminal, Write},
    panic,
    process::ExitCode,
    sync::{
        Arc, Mutex, Once, PoisonError,
        atomic::{AtomicBool, Ordering},
        mpsc::{self, RecvTimeoutError},
    },
    thread,
    time::{Duration, Instant},
};

use clap::{CommandFactory, Parser};

#[cfg(feature = "bench")]
use planisphere_bench::speed::BenchError;
use planisphere_io::{
    litter::Shield,
    load::{ChangedFile, LoadError, Watch},
    output::{OutputError, Target},
    text,
};
use planisphere_renderer::Error;

/// Why a command failed; each kind has its exit code.
#[derive(Debug, thiserror::Error)]
enum Failure {
    /// Arguments that make no sense together.
    #[error("{0}")]
    Usage(String),
    /// More memory than there is.
    #[error("{0}")]
    Memory(String),
    /// No threads to be had.
    #[error(
        "no threads to draw with: {0}; raise the limit (`ulimit -u`, or the container's of \
         processes), or ask for fewer: RAYON_NUM_THREADS=1"
    )]
    Threads(rayon::ThreadPoolBuildError),
    /// Bad input.
    #[error("{0}")]
    Load(#[from] LoadError),
    /// Input that was changed by somebody else while it was in use.
    #[error("{0}")]
    Changed(#[from] ChangedFile),
    /// What the library says.
    #[error("{}", words(.0))]
    Library(#[from] Error),
    /// A measurement that did not come out as it must.
    #[cfg(feature = "bench")]
    #[error("{0}")]
    Check(String),
    /// What was said already; the exit code.
    #[error("exit code {0}")]
    Told(u8),
    /// A measurement that could not be made.
    #[error("{0}")]
    #[cfg(feature = "bench")]
    Bench(#[from] BenchError),
    /// Output.
    #[error("{0}")]
    Output(#[from] OutputError),
    /// No window.
    #[cfg(feature = "window")]
    #[error("{0}")]
    View(#[from] planisphere_window::ViewError),
}

impl Failure {
    fn exit_code(&self) -> u8 {
        match self {
            Self::Usage(_) | Self::Memory(_) | Self::Load(_) | Self::Changed(_) => 2,
            Self::Library(error) => match error {
                Error::Write { .. } | Error::Io(_) => 4,
                Error::NoDevice { .. }
                | Error::Device { .. }
                | Error::DeviceLost { .. }
                | Error::Memory { .. }
                | Error::Threads { .. }
                | Error::Cancelled => 3,
                _ => 2,
            },
            Self::Threads(_) => 3,
            Self::Told(code) => *code,
            #[cfg(feature = "bench")]
            Self::Check(_) => 1,
            #[cfg(feature = "bench")]
            Self::Bench(error) => match error {
                BenchError::Device(_) | BenchError::Draw(_) => 3,
                BenchError::Process { .. } => 1,
                BenchError::Io(_) => 4,
            },
            Self::Output(OutputError::Ending { .. }) => 2,
            Self::Output(_) => 4,
            #[cfg(feature = "window")]
            Self::View(_) => 3,
        }
    }

    /// For standard error; a load error has its own form.
    fn report(&self, color: bool) -> String {
        match self {
            Self::Load(error) => error.render(color),
            other if color => {
                format!("\x1b[1;31merror\x1b[0m: {}", text::lines(&other.to_string()))
            }
            other => format!("error: {}", text::lines(&other.to_string())),
        }
    }
}

/// What the library says, with the options of this program in the place of its own words.
fn words(error: &Error) -> String {
    match error {
        Error::NoDevice { words } => words.replace("the CPU needs", "`--device cpu` needs"),
        Error::Parts { words } => [
            ("the same camera, size and background (a camera that is fitted to the spheres of a \
              part is that part's own)",
             "the same [camera], --size and background (a [camera] without an origin, a view or a \
              size is framed by the spheres of its own part)"),
            ("its own first index", "its own --first-index"),
            ("its own region", "its own --region"),
            ("correct the first indices", "correct --first-index"),
            ("a part again may have gaps", "-o none --visibility merges what there is"),
            ("; draw it again",
             "; write it again with `planisphere render SCENE --visibility FILE.npz`"),
            ("only the region that is drawn",
             "only the region that is drawn: --region x,y,width,height"),
        ]
        .iter()
        .fold(words.clone(), |words, (said, typed)| words.replace(said, typed)),
        Error::DeviceLost { words } => format!("the device failed: {words}"),
        Error::Palette => "--palette: the picture has more than 256 colours, and a palette holds \
                           no more; leave out --palette, and the same pixels are written as RGB"
            .into(),
        other => other.to_string(),
    }
}

/// Runs the program with the process's arguments.
pub fn main() -> ExitCode {
    let start = Instant::now();
    signals::install();
    match parse() {
        Ok(args) => ended(run(args.command, start)),
        Err(error) if error.use_stderr() => {
            // Nobody listening is no failure.
            let _ = error.print();
            ExitCode::from(2)
        }
        // What was asked for: help, or the version.
        Err(text) => ended(ends::stdout_is_open().and_then(|()| heard(text.print()))),
    }
}

fn run(command: args::Command, start: Instant) -> Result<(), Failure> {
    let draws = !matches!(command, args::Command::Make(_) | args::Command::Completions { .. });
    if draws {
        rayon::ThreadPoolBuilder::new().build_global().map_err(Failure::Threads)?;
    }
    match command {
        args::Command::Render(args) => {
            args.request().and_then(|request| render::run(&request, start))
        }
        args::Command::Check(args) => args.request().and_then(|request| check::run(&request)),
        #[cfg(feature = "window")]
        args::Command::View(args) => view::run(&args),
        args::Command::Merge(args) => {
            args.request().and_then(|request| merge::run(&request, start))
        }
        args::Command::Info(args) => info::run(&args),
        args::Command::Convert(args) => convert::run(&args),
        args::Command::Make(args) => make::run(&args),
        #[cfg(feature = "bench")]
        args::Command::Bench(args) => bench::run(args),
        args::Command::Completions { shell } => completions(shell),
    }
}

fn ended(result: Result<(), Failure>) -> ExitCode {
    ExitCode::from(conclude(&result))
}

/// Reports a failure; the exit code.
fn conclude(result: &Result<(), Failure>) -> u8 {
    // A signal that is at work on another thread ends the process; what fails because of that has
    // no words.
    std::mem::forget(Shield::up());
    match result {
        Ok(()) => 0,
        Err(Failure::Told(code)) => *code,
        Err(failure) => {
            complain(&failure.report(color_on_stderr()));
            failure.exit_code()
        }
    }
}

/// How often files that are in use are looked at.
const LOOK: Duration = Duration::from_millis(50);

/// How long work may go on with numbers that nobody meant: it can take for ever, where every sphere
/// has become the same.
const GRACE: Duration = Duration::from_millis(500);

/// Does work that reads numbers in files, unless one of these changes meanwhile: see
/// [`Watch::guard`]. Work that goes on after that is not waited for: the process ends.
fn unless_changed<T>(
    watch: &Watch,
    work: impl FnOnce() -> Result<T, Failure>,
) -> Result<T, Failure> {
    if watch.is_empty() {
        return work();
    }
    in_use(Some(watch.clone()));
    let (working, at_work) = mpsc::channel::<()>();
    let (others, speaks) = (watch.clone(), Arc::new(AtomicBool::new(false)));
    let first = Arc::clone(&speaks);
    let look = move || {
        while at_work.recv_timeout(LOOK) == Err(RecvTimeoutError::Timeout) {
            let Some(changed) = others.changed() else { continue };
            if at_work.recv_timeout(GRACE) == Err(RecvTimeoutError::Timeout)
                && !first.swap(true, Ordering::SeqCst)
            {
                let failure = Failure::from(changed);
                complain(&failure.report(color_on_stderr()));
                signals::end_now(failure.exit_code());
            }
            return;
        }
    };
    // Where there is no thread to be had, work without end is not ended; all else is as ever.
    let looking = thread::Builder::new().spawn(look);
    let result = watch.guard(work);
    drop(working);
    in_use(None);
    if looking.is_ok() && speaks.swap(true, Ordering::SeqCst) {
        // The other thread says it and ends the process.
        loop {
            thread::park();
        }
    }
    result?
}

/// Files that are in use where they lie: where one has changed, a panic comes from that.
static IN_USE: Mutex<Option<Watch>> = Mutex::new(None);

/// Says which files are in use. A panic is not reported where one of them has changed: it comes
/// from numbers that nobody meant, and what is to be said is said instead.
fn in_use(watch: Option<Watch>) {
    static HOOK: Once = Once::new();
    let found = || IN_USE.lock().unwrap_or_else(PoisonError::into_inner);
    *found() = watch;
    HOOK.call_once(|| {
        let former = panic::take_hook();
        panic::set_hook(Box::new(move |panic| {
            let watch = found().clone();
            if watch.is_none_or(|watch| watch.changed().is_none()) {
                former(panic);
            }
        }));
    });
}

/// The arguments; or what clap says of them, help and errors, with the words as they were typed.
/// What is unseen in these is made visible.
fn parse() -> Result<args::Args, clap::Error> {
    args::Args::try_parse().map_err(|error| {
        // The words repeat what was typed, or what another program has put there: again, with that
        // shown.
        let strange =
            |arg: &OsString| matches!(text::name(arg), shown if arg.to_str() != Some(&shown));
        if !error.use_stderr() || !std::env::args_os().skip(1).any(|arg| strange(&arg)) {
            return error;
        }
        let shown = std::env::args_os().skip(1).map(|arg| OsString::from(text::name(arg)));
        match args::Args::try_parse_from(std::env::args_os().take(1).chain(shown)) {
            Err(again) if again.use_stderr() => again,
            // It is only wrong as it was typed: not UTF-8, or of another length.
            _ => clap::Error::raw(error.kind(), text::lines(&format!("{}\n", error.kind()))),
        }
    })
}

/// An error to standard error; to standard output, if the one goes into a file that must stay as it
/// is. Nobody listening is no failure.
fn complain(text: &str) {
    let _ = match ends::errors_are_heard() {
        true => writeln!(io::stderr(), "{text}"),
        false => writeln!(io::stdout(), "{text}"),
    };
}

/// A note to standard error, one line or more, unless data go there. What is unseen is made
/// visible. Nobody listening is no failure.
fn say(text: &str) {
    if ends::notes_are_heard() {
        let _ = writeln!(io::stderr(), "{}", text::lines(text));
    }
}

/// Text to standard output; a reader that has gone had enough.
fn print(text: &str) -> Result<(), Failure> {
    ends::stdout_is_open()?;
    Ok(Target::Stdout.stage(|out| out.write_all(text.as_bytes())).map(|_| ())?)
}

/// The result of writing text to standard output; a reader that has gone had enough.
fn heard(written: io::Result<()>) -> Result<(), Failure> {
    match written.and_then(|()| io::stdout().flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(Target::Stdout.io(error).into())
        }
        _ => Ok(()),
    }
}

/// Whether standard error takes colours: a terminal, and `NO_COLOR` (no-color.org) not set.
fn color_on_stderr() -> bool {
    let wanted = std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty());
    let able = std::env::var_os("TERM").is_none_or(|term| term != "dumb");
    wanted && able && io::stderr().is_terminal()
}

fn completions(shell: clap_complete::Shell) -> Result<(), Failure> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut args::Args::command(), "planisphere", &mut script);
    print(&String::from_utf8_lossy(&script))
}
