//! The window: a scene that is looked at from all sides.
//!
//! Only this module names winit and softbuffer. Pictures come from the same [`Device::draw`] and [`crate::frame`] as files,
//! and are put into the window as they are: every device shows through the same code, no driver is needed, and a
//! screenshot is the file that `render` would write. Nothing here prints: what is to be said goes to the caller's function.

mod app;
mod draw;
mod keys;
pub mod navigate;
mod screenshot;

use std::{ffi::OsString, panic};

use winit::event_loop::{ControlFlow, EventLoop};

pub use keys::KEYS;

use crate::{
    camera::ImageSize,
    load::Loaded,
    render::{Device, DrawError},
};

/// What is left without a display.
const FIX: &str = "use `planisphere render`, which draws into a file and needs no display";

/// What winit and softbuffer load when they open a window under X.
const LIBRARIES: &str =
    "on Debian and Ubuntu, apt-get install libx11-6 libx11-xcb1 libxcursor1 libxi6 libxkbcommon-x11-0";

/// What a window is opened with.
pub struct Start {
    /// What is seen, and from where at first.
    pub loaded: Loaded,
    /// Name of the scene, without folder and ending: the title, and the beginning of the screenshots' names.
    pub name: OsString,
    /// Size of the picture, as [`crate::camera::View`] takes it: the window begins with it, or smaller if the screen is.
    pub image: ImageSize,
    /// Takes what is to be said to people.
    pub say: fn(&str),
}

/// Why there is no window, or no longer.
#[derive(Debug, thiserror::Error)]
pub enum ViewError {
    /// Nothing to open a window on; says what was tried.
    #[error("there is no display to open a window on: {0}\nfix: {FIX}")]
    NoDisplay(String),
    /// Libraries that talk to the display are missing; says what was tried.
    #[error("the libraries that open a window are missing: {0}\nfix: {LIBRARIES}; or {FIX}")]
    NoLibraries(String),
    /// There is a display, but the window could not be opened or filled.
    #[error("the window failed: {0}")]
    Window(String),
    /// The device failed.
    #[error("{0}")]
    Draw(#[from] DrawError),
}

/// A connection to a display: proof that there is one, before anything slow is begun.
pub struct Display(EventLoop<app::Message>);

impl Display {
    /// Connects.
    ///
    /// # Errors
    /// When there is no display, or the libraries to talk to it are missing.
    pub fn open() -> Result<Self, ViewError> {
        // winit panics when a library that it loads at run time is missing. Its words go into the error instead.
        let hook = panic::take_hook();
        panic::set_hook(Box::new(|_| {}));
        let opened = panic::catch_unwind(|| EventLoop::with_user_event().build());
        panic::set_hook(hook);
        let words = match opened {
            Ok(Ok(event_loop)) => return Ok(Self(event_loop)),
            Ok(Err(error)) => error.to_string(),
            Err(payload) => {
                let text = payload.downcast_ref::<String>().map(String::as_str);
                text.or_else(|| payload.downcast_ref::<&str>().copied()).unwrap_or("no reason given").into()
            }
        };
        // A system's error begins with the place in winit's source where it came up.
        let reason = words.split_once(".rs:").and_then(|(_, rest)| rest.split_once(": ")).map_or(&*words, |w| w.1);
        let said = format!("{} ({})", tried(), reason.trim_end_matches('.'));
        Err(if reason.to_lowercase().contains("librar") {
            ViewError::NoLibraries(said)
        } else {
            ViewError::NoDisplay(said)
        })
    }

    /// Shows the window until it is closed.
    ///
    /// # Errors
    /// When the window or the device fails.
    pub fn show(self, start: Start, device: Device) -> Result<(), ViewError> {
        let Self(event_loop) = self;
        event_loop.set_control_flow(ControlFlow::Wait);
        let mut app = app::App::new(start, device, event_loop.create_proxy());
        let ran = event_loop.run_app(&mut app);
        app.end()?;
        ran.map_err(|error| ViewError::Window(error.to_string()))
    }
}

/// The variables that say where the display is, as they are set.
fn tried() -> String {
    if !cfg!(all(unix, not(target_os = "macos"))) {
        return "the system was asked".into();
    }
    ["WAYLAND_DISPLAY", "DISPLAY"]
        .map(|name| match std::env::var_os(name).filter(|value| !value.is_empty()) {
            Some(value) => format!("{name} is {}", crate::text::name(value)),
            None => format!("{name} is not set"),
        })
        .join(", ")
}
