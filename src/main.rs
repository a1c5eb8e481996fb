//! The `planisphere` program; everything is in the library's [`planisphere::cli`].

use std::process::ExitCode;

fn main() -> ExitCode {
    let set = |name: &str, value: &str| {
        // SAFETY: no other thread runs yet.
        unsafe { std::env::set_var(name, value) };
    };
    // Mesa's layer that sorts Vulkan devices looks for a Wayland display, and complains on standard
    // error where there is no session to have one. Devices are chosen by kind and name here, so
    // that it is not missed.
    if std::env::var_os("XDG_RUNTIME_DIR").is_none() {
        set("NODEVICE_SELECT", "1");
    }
    // Mesa keeps compiled shaders in many files and an index, which it maps and writes to: on a
    // full disk that ends the process (SIGBUS). The database, its default from version 23 on, is
    // written as any other file.
    let own = [
        "MESA_SHADER_CACHE_DISABLE",
        "MESA_DISK_CACHE_SINGLE_FILE",
        "MESA_DISK_CACHE_DATABASE",
        "MESA_DISK_CACHE_MULTI_FILE",
    ];
    if own.iter().all(|name| std::env::var_os(name).is_none()) {
        set("MESA_DISK_CACHE_DATABASE", "true");
    }
    #[cfg(unix)]
    planisphere_io::output::were_closed(streams::closed());
    planisphere::cli::main()
}

/// Standard streams that were closed when the process began: Rust's runtime opens `/dev/null` in
/// their place before `main`, and data that go there would be lost without a word. So they are
/// looked at before that.
#[cfg(unix)]
mod streams {
    use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

    static CLOSED: [AtomicBool; 3] = [const { AtomicBool::new(false) }; 3];

    // Run by the loader before Rust's runtime.
    #[used]
    #[cfg_attr(target_vendor = "apple", unsafe(link_section = "__DATA,__mod_init_func"))]
    #[cfg_attr(not(target_vendor = "apple"), unsafe(link_section = ".init_array"))]
    static LOOK: extern "C" fn() = look;

    extern "C" fn look() {
        for (number, closed) in CLOSED.iter().enumerate() {
            // SAFETY: the call fails for a number that is not open, and touches nothing.
            closed
                .store(unsafe { libc::fcntl(number as libc::c_int, libc::F_GETFD) } == -1, Relaxed);
        }
    }

    pub(super) fn closed() -> [bool; 3] {
        [0, 1, 2].map(|number| CLOSED[number].load(Relaxed))
    }
}
