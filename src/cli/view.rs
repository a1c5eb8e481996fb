//! `planisphere view`: load, open a display and a device, show.

use std::path::Path;

use super::{Failure, args::ViewArgs, progress::Progress, render::say_device, say, silence};
use crate::{
    load,
    render::Device,
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
    let opened = Device::open_telling(&args.device)?;
    drop(progress);
    say_device(&opened, &args.device);
    silence(&loaded.watch);
    let stem = if args.scene == Path::new("-") { None } else { args.scene.file_stem() };
    let name = stem.map_or_else(|| "scene".into(), ToOwned::to_owned);
    let image = args.size.unwrap_or(loaded.image);
    Ok(display.show(Start { loaded, name, image, say }, opened.device)?)
}
