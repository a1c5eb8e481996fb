//! `planisphere info`: which devices there are, what each lacks, and which one `auto` takes.

use super::{Failure, ends::stdout_is_open, print, render::device_words};
#[cfg(feature = "gpu")]
use planisphere_renderer::adapters;
use planisphere_renderer::{Device, Renderer};

/// Where software drivers come from.
const SOFTWARE: &str = "
Software drivers, for tests and CI without a GPU: llvmpipe (Debian's mesa-vulkan-drivers), and \
SwiftShader, which is in
Debian's chromium-common: `apt-get download chromium-common && dpkg-deb -x chromium-common_*.deb \
swiftshader`, then
VK_DRIVER_FILES=$PWD/swiftshader/usr/lib/chromium/vk_swiftshader_icd.json. The pictures are the \
same on both.
";

/// Lists the native device and every adapter, and opens what `auto` and `gpu` take.
pub(super) fn run() -> Result<(), Failure> {
    stdout_is_open()?;
    let threads = rayon::current_num_threads();
    let mut text = format!("cpu   native, {threads} threads; needs no driver\n");
    text += &gpus();
    text += "\n";
    match Renderer::open(&Device::Gpu) {
        Ok(gpu) if gpu.is_news() => {
            text += &format!("--device gpu   takes {} ({})\n", gpu.device(), gpu.why());
        }
        Ok(gpu) => text += &format!("--device gpu   takes {}\n", gpu.device()),
        Err(error) => text += &format!("--device gpu   {}\n", Failure::from(error)),
    }
    let auto = Renderer::open(&Device::Auto)?;
    text += &format!("--device auto  takes {}\n", device_words(&auto));
    if cfg!(target_os = "linux") {
        text += SOFTWARE;
    }
    print(&planisphere_io::text::lines(&text))
}

/// A line for each adapter, and more for what it has not.
#[cfg(feature = "gpu")]
fn gpus() -> String {
    let mut text = String::new();
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
    text
}

#[cfg(not(feature = "gpu"))]
fn gpus() -> String {
    String::new()
}
