//! Keeps what goes wrong in the windowing crates from ending the process on its own: their panics
//! become words, and a lost X connection, of which Xlib's default is to exit with 1, becomes a
//! message.

use std::{
    any::Any,
    cell::{Cell, RefCell},
    panic::{self, AssertUnwindSafe, Location, PanicHookInfo},
    sync::{Mutex, Once, PoisonError},
};

/// The crates that open windows. They panic where a server has gone, or lacks something.
const CRATES: [&str; 10] = [
    "winit",
    "softbuffer",
    "calloop",
    "calloop-wayland-source",
    "smithay-client-toolkit",
    "wayland-backend",
    "wayland-client",
    "x11-dl",
    "x11rb",
    "xkbcommon-dl",
];

thread_local! {
    /// Whether this thread is inside [`catch`].
    static CATCHING: Cell<bool> = const { Cell::new(false) };
    /// What a windowing crate said when it panicked there.
    static SAID: RefCell<Option<String>> = const { RefCell::new(None) };
}

/// Says whether a panic has a cause that is reported in other words.
type Excuse = Box<dyn Fn() -> bool + Send + Sync>;

static EXCUSE: Mutex<Option<Excuse>> = Mutex::new(None);

/// A panic that was caught.
pub(super) enum Panic {
    /// One of a windowing crate, which was not reported; its words.
    Windowing(String),
    /// Another one, which the process's hook has reported.
    Other(Box<dyn Any + Send>),
}

/// Runs something that windowing crates take part in.
pub(super) fn catch<T>(run: impl FnOnce() -> T) -> Result<T, Panic> {
    watch();
    CATCHING.set(true);
    let result = panic::catch_unwind(AssertUnwindSafe(run));
    CATCHING.set(false);
    result.map_err(|payload| SAID.take().map_or(Panic::Other(payload), Panic::Windowing))
}

/// From now on a panic on any thread is not reported while `excuse` says so.
pub(super) fn excuse(excuse: impl Fn() -> bool + Send + Sync + 'static) {
    watch();
    *EXCUSE.lock().unwrap_or_else(PoisonError::into_inner) = Some(Box::new(excuse));
}

/// Puts this module before the process's panic hook, once and for good: a hook that is put back
/// later could be another one by then.
fn watch() {
    static WATCHING: Once = Once::new();
    WATCHING.call_once(|| {
        let report = panic::take_hook();
        panic::set_hook(Box::new(move |panic| {
            if !stays_silent(panic) {
                report(panic);
            }
        }));
    });
}

fn stays_silent(panic: &PanicHookInfo) -> bool {
    if CATCHING.get() && panic.location().is_some_and(of_windowing) {
        SAID.set(Some(words(panic.payload())));
        return true;
    }
    let excuse = EXCUSE.lock().unwrap_or_else(PoisonError::into_inner);
    excuse.as_ref().is_some_and(|excuse| excuse())
}

/// Whether a place in source code is in a windowing crate: below a folder that has its name, with
/// or without a version.
fn of_windowing(place: &Location) -> bool {
    place.file().split(['/', '\\']).any(|folder| {
        CRATES.iter().any(|name| {
            let version =
                folder.strip_prefix(name).map(|rest| rest.strip_prefix('-').unwrap_or(rest));
            version.is_some_and(|version| version.chars().all(|c| c.is_ascii_digit() || c == '.'))
        })
    })
}

/// What was said at a panic.
fn words(payload: &dyn Any) -> String {
    let text = payload.downcast_ref::<String>().map(String::as_str);
    text.or_else(|| payload.downcast_ref::<&str>().copied()).unwrap_or("no reason given").to_owned()
}

/// Xlib ends the process, with 1, when the connection to the server is lost. From now on, where
/// this thread uses Xlib, it calls `lost` instead, and the thread stops there for good.
#[cfg(all(unix, not(target_vendor = "apple")))]
pub(super) fn on_lost_connection(lost: impl FnOnce() + 'static) {
    use std::{ffi::c_int, sync::OnceLock, thread};

    use x11_dl::xlib::{Display, Xlib};

    thread_local! {
        static LOST: RefCell<Option<Box<dyn FnOnce()>>> = const { RefCell::new(None) };
    }
    static XLIB: OnceLock<Option<Xlib>> = OnceLock::new();

    unsafe extern "C" fn on_error(_: *mut Display) -> c_int {
        // Another thread's connection is none of this module's: Xlib goes on with what it does by
        // default.
        if let Some(lost) = LOST.with(RefCell::take) {
            lost();
            // To return would be to exit. The process ends by what `lost` has told.
            loop {
                thread::park();
            }
        }
        0
    }

    LOST.set(Some(Box::new(lost)));
    // Kept open for good, as winit keeps it. Where there is no Xlib, there is no connection that
    // could be lost.
    if let Some(xlib) = XLIB.get_or_init(|| Xlib::open().ok()) {
        // SAFETY: the function has the type that Xlib wants, and lives as long as the process.
        unsafe { (xlib.XSetIOErrorHandler)(Some(on_error)) };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn panics_of_others_stay_theirs() {
        let Err(Panic::Other(payload)) = catch(|| panic!("on purpose")) else {
            panic!("it was not caught")
        };
        assert_eq!(words(&*payload), "on purpose");
        assert!(catch(|| 5).is_ok_and(|five| five == 5));
        assert!(!of_windowing(Location::caller()));
    }
}
