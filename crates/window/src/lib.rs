//! The window: a scene that is looked at from all sides.
//!
//! Only this module names winit and softbuffer. Pictures come from the same [`Renderer`] and
//! `planisphere_io::png` as files, and are put into the window as they are: every device shows
//! through the same code, no driver is needed, and a screenshot is the file that `render` would
//! write. Nothing here prints: what is to be said goes to the caller's functions.
//!
//! Drawing, presenting and events have a thread each, so that input never waits for a picture. A
//! server that goes away, and a windowing crate that panics about it, end as a [`ViewError`].

#![cfg_attr(not(test), warn(clippy::print_stdout, clippy::print_stderr))]

mod app;
mod draw;
mod guard;
mod keys;
pub mod navigate;
mod picture;
mod screenshot;
#[cfg(all(unix, not(target_vendor = "apple")))]
mod session;
#[cfg(all(unix, not(target_vendor = "apple")))]
mod unix;
#[cfg(all(unix, not(target_vendor = "apple")))]
mod x11;

use std::{any::Any, ffi::OsString, io};

use winit::{
    error::EventLoopError,
    event_loop::{ControlFlow, EventLoop},
};

pub use keys::KEYS;

use planisphere_core::camera::ImageSize;
use planisphere_io::load::Loaded;
use planisphere_renderer::{Error, Renderer};

/// What is left without a display.
const FIX: &str = "use `planisphere render`, which draws into a file and needs no display";

/// What leads to a display.
const DISPLAY_FIX: &str = "set one of these variables to a display that is there, and unset those \
                           of displays that are not";

/// What winit loads when it opens a window.
const LIBRARIES: &str = "on Debian and Ubuntu, apt-get install libx11-6 libx11-xcb1 libxcursor1 \
                         libxi6 libxkbcommon0 libxkbcommon-x11-0 libwayland-client0";

/// What a window is opened with.
pub struct Start {
    /// What is seen, and from where at first.
    pub loaded: Loaded,
    /// Name of the scene, without folder and ending: the title, and the beginning of the
    /// screenshots' names.
    pub name: OsString,
    /// Columns and rows of the picture: the window begins with it, or smaller if the screen is.
    pub size: [u32; 2],
    /// Takes what is to be said to people.
    pub say: fn(&str),
    /// Takes cameras, which are data.
    pub print: fn(&str) -> io::Result<()>,
}

impl Start {
    fn image(&self) -> ImageSize {
        let [width, height] = self.size;
        ImageSize { width, height }
    }
}

/// How a window ended.
pub struct Shown {
    /// Whether it was closed, or failed.
    pub result: Result<(), ViewError>,
    /// Whether a picture may still be under way, on a thread that nobody waits for. The process
    /// must then end without what is done on the way out of a process: a driver would be taken
    /// apart while it draws.
    pub drawing: bool,
}

/// Why there is no window, or no longer.
#[derive(Debug, thiserror::Error)]
pub enum ViewError {
    /// Nothing to open a window on; says what was tried.
    #[error("there is no display to open a window on: {0}\nfix: {DISPLAY_FIX}; or {FIX}")]
    NoDisplay(String),
    /// Libraries that talk to the display are missing; says what was tried.
    #[error("the libraries that open a window are missing: {0}\nfix: {LIBRARIES}; or {FIX}")]
    NoLibraries(String),
    /// There is a display, but it cannot show the window; says why, and what helps.
    #[error("the display cannot show the window: {0}; or {FIX}")]
    Unable(String),
    /// There is a display, but the window could not be opened or filled.
    #[error("the window failed: {0}\nfix: {FIX}")]
    Window(String),
    /// The server has ended, or the way to it is cut: which kind of server.
    #[error(
        "the window is gone: the {0} does not answer any more\nfix: open the window again when it \
         does; or {FIX}"
    )]
    Lost(&'static str),
    /// The window, or its connection, was taken away.
    #[error("the window is gone: another program has destroyed it\nfix: open it again; or {FIX}")]
    Destroyed,
    /// The device failed.
    #[error("{0}")]
    Draw(#[from] Error),
}

/// A connection to a display: proof that there is one, before anything slow is begun.
pub struct Display(Desktop);

#[cfg(all(unix, not(target_vendor = "apple")))]
use unix::Desktop;

impl Display {
    /// Connects, within limits of time. `say` takes what people should know of the way there.
    ///
    /// # Errors
    /// When there is no display, it cannot show the window, or the libraries to talk to it are
    /// missing.
    ///
    /// # Safety
    /// No other thread may use the environment meanwhile other than through `std::env`: variables
    /// that lead astray are taken out of it.
    pub unsafe fn open(say: fn(&str)) -> Result<Self, ViewError> {
        // SAFETY: as the caller promises.
        unsafe { Desktop::open(say).map(Self) }
    }

    /// Shows the window until it is closed.
    pub fn show(self, start: Start, renderer: Renderer) -> Shown {
        self.0.show(start, renderer)
    }
}

/// The window on systems whose events belong to the main thread.
#[cfg(not(all(unix, not(target_vendor = "apple"))))]
struct Desktop(EventLoop<app::Message>);

#[cfg(not(all(unix, not(target_vendor = "apple"))))]
impl Desktop {
    /// Connects.
    ///
    /// # Safety
    /// None is needed here.
    unsafe fn open(_: fn(&str)) -> Result<Self, ViewError> {
        let words = match guard::catch(|| EventLoop::with_user_event().build()) {
            Ok(Ok(event_loop)) => return Ok(Self(event_loop)),
            Ok(Err(error)) => reason(&error.to_string()).to_owned(),
            Err(guard::Panic::Windowing(words)) => words,
            Err(guard::Panic::Other(payload)) => std::panic::resume_unwind(payload),
        };
        Err(ViewError::NoDisplay(format!("the system was asked: {words}")))
    }

    fn show(self, start: Start, renderer: Renderer) -> Shown {
        let Self(event_loop) = self;
        let app = match app::App::new(start, renderer, event_loop.create_proxy()) {
            Ok(app) => app,
            Err(error) => return Shown { result: Err(error), drawing: false },
        };
        let failed = |words| Shown { result: Err(ViewError::Window(words)), drawing: true };
        match guard::catch(|| run(event_loop, app)) {
            Ok(Ended::Shown(shown)) => shown,
            Ok(Ended::Broken(words)) | Err(guard::Panic::Windowing(words)) => failed(words),
            Ok(Ended::Lost) => Shown { result: Err(ViewError::Lost("display")), drawing: true },
            Ok(Ended::Panicked(payload)) | Err(guard::Panic::Other(payload)) => {
                std::panic::resume_unwind(payload)
            }
        }
    }
}

/// How the events ended.
enum Ended {
    /// As wanted, or by an error that is known.
    Shown(Shown),
    /// winit gave up; why.
    Broken(String),
    /// winit gave up, because the display does not answer.
    Lost,
    /// The drawing thread panicked.
    Panicked(Box<dyn Any + Send>),
}

fn run(event_loop: EventLoop<app::Message>, mut app: app::App) -> Ended {
    event_loop.set_control_flow(ControlFlow::Wait);
    let ran = event_loop.run_app(&mut app);
    match (app.end(), ran) {
        (Ended::Shown(Shown { result: Ok(()), .. }), Err(EventLoopError::ExitFailure(_))) => {
            Ended::Lost
        }
        (Ended::Shown(Shown { result: Ok(()), .. }), Err(error)) => {
            Ended::Broken(reason(&error.to_string()).to_owned())
        }
        (ended, _) => ended,
    }
}

/// What a windowing crate says, without the place in its source where it came up.
fn reason(words: &str) -> &str {
    words
        .split_once(".rs:")
        .and_then(|(_, rest)| rest.split_once(": "))
        .map_or(words, |w| w.1)
        .trim_end_matches('.')
}
