//! `planisphere view`: load, open a display and a device, show.

use std::path::Path;

use super::{Failure, args::ViewArgs, progress::Progress, render::auto_words, say};
use crate::{
    load,
    render::{Device, DeviceChoice},
    view::{Display, Start},
};

/// Shows the window until it is closed.
pub(super) fn run(args: &ViewArgs) -> Result<(), Failure> {
    let progress = Progress::step("loading");
    let loaded = load::load(&args.scene)?;
    drop(progress);
    loaded.notes.iter().for_each(|note| say(&format!("note: {note}")));
    // Before the device: a display is missing more often, and looking for it takes no time.
    let display = Display::open()?;
    let progress = Progress::step("starting the device");
    let device = Device::open(&args.device)?;
    drop(progress);
    if args.device == DeviceChoice::Auto {
        say(&format!("device: {}", auto_words(&device)));
    }
    let stem = if args.scene == Path::new("-") { None } else { args.scene.file_stem() };
    let name = stem.map_or_else(|| "scene".into(), ToOwned::to_owned);
    let image = args.size.unwrap_or(loaded.image);
    Ok(display.show(Start { loaded, name, image, say }, device)?)
}
