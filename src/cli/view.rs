//! `planisphere view`: load, open a display and a device, show.

use std::{
    io::{self, Write},
    path::Path,
};

use super::{
    Failure,
    args::ViewArgs,
    progress::Progress,
    render::{say_device, say_read},
    say,
};
use planisphere_io::load::Control;
use planisphere_renderer::Renderer;
use planisphere_window::{Display, Shown, Start};

/// Shows the window until it is closed.
pub(super) fn run(args: &ViewArgs) -> Result<(), Failure> {
    let control = Control::new();
    let progress = Progress::of("loading", &control);
    let mut loaded = args.reading.load(&args.scene, None, &control)?;
    args.camera.apply(&mut loaded)?;
    drop(progress);
    say_read(&loaded);
    // Before the device: a display is missing more often, and looking for it takes no time.
    // SAFETY: the threads that run by now (those of the pool and of progress) use the environment
    // through `std::env` if at all. No driver is loaded yet.
    let display = unsafe { Display::open(say)? };
    let progress = Progress::step("starting the device");
    let renderer = Renderer::open(&args.device)?;
    drop(progress);
    say_device(&renderer);
    let stem = if args.scene == Path::new("-") { None } else { args.scene.file_stem() };
    let name = stem.map_or_else(|| "scene".into(), ToOwned::to_owned);
    let size = args.size.unwrap_or([loaded.image.width, loaded.image.height]);
    let Shown { result, drawing } =
        display.show(Start { loaded, name, size, say, print }, renderer);
    let result = result.map_err(Failure::from);
    if drawing {
        leave(&result);
    }
    result
}

/// A camera to standard output, at once: whoever reads it may be waiting for it. What could not be
/// written is not kept for later.
fn print(text: &str) -> io::Result<()> {
    super::ends::stdout_is_open().map_err(io::Error::other)?;
    #[cfg(unix)]
    let mut out = {
        use std::os::fd::AsFd;
        std::fs::File::from(io::stdout().as_fd().try_clone_to_owned()?)
    };
    #[cfg(not(unix))]
    let mut out = io::stdout().lock();
    out.write_all(text.as_bytes())?;
    out.flush()
}

/// Ends the process while a picture is under way, without waiting for it: what libraries have
/// arranged for the way out of a process would take a driver apart under the thread that draws.
fn leave(result: &Result<(), Failure>) -> ! {
    super::signals::end(super::conclude(result).into())
}
