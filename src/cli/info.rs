//! `planisphere info`: which devices there are, what each lacks, and which one `auto` takes.

use super::{Failure, ends::stdout_is_open, print, render::auto_words};
use crate::{
    gpu::adapters::adapters,
    render::{Device, DeviceChoice},
};

/// Lists the native device and every adapter, and opens what `auto` and `gpu` take.
pub(super) fn run() -> Result<(), Failure> {
    stdout_is_open()?;
    let threads = rayon::current_num_threads();
    let mut text = format!("cpu   native, {threads} threads; needs no driver\n");
    for found in adapters() {
        let state = match found.lacks.as_slice() {
            [] => "usable".to_owned(),
            lacks => format!("not usable: lacks {}", lacks.join(", ")),
        };
        text += &format!("gpu   {}: {}, {state}\n", found.name, found.kind);
        for remark in found.remarks {
            text += &format!("        {remark}\n");
        }
    }
    text += "\n";
    match Device::open(&DeviceChoice::Gpu) {
        Ok(device) => text += &format!("--device gpu   takes {}\n", device.description()),
        Err(error) => text += &format!("--device gpu   {error}\n"),
    }
    let auto = Device::open(&DeviceChoice::Auto)?;
    text += &format!("--device auto  takes {}\n", auto_words(&auto));
    print(&crate::text::lines(&text))
}
