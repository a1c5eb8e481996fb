//! The `planisphere` program; everything is in the library's [`planisphere::cli`].

use std::process::ExitCode;

fn main() -> ExitCode {
    // Mesa's layer that sorts Vulkan devices looks for a Wayland display, and complains on standard error where there is no
    // session to have one. Devices are chosen by kind and name here, so that it is not missed.
    if std::env::var_os("XDG_RUNTIME_DIR").is_none() {
        // SAFETY: no other thread runs yet.
        unsafe { std::env::set_var("NODEVICE_SELECT", "1") };
    }
    planisphere::cli::main()
}
