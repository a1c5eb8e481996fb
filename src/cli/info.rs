//! `planisphere info`: which devices there are, and which one `auto` takes.

use super::{Failure, print, render::auto_words};
use crate::render::{Device, DeviceChoice};

/// Opens each kind of device in turn, and says what came of it.
pub(super) fn run() -> Result<(), Failure> {
    let mut text = String::new();
    for (name, choice) in [("cpu", DeviceChoice::Cpu), ("gpu", DeviceChoice::Gpu)] {
        let words = match Device::open(&choice) {
            Ok(device) => device.description(),
            Err(error) => format!("none: {error}"),
        };
        text += &format!("{name:<6}{words}\n");
    }
    let auto = Device::open(&DeviceChoice::Auto)?;
    text += &format!("{:<6}{}\n", "auto", auto_words(&auto));
    print(&text)
}
