//! Which display the window is opened on: Wayland if there is one, else X. What the environment
//! names is tried before winit sees it, because winit takes the first that is named, has one
//! attempt, and may wait for it without end.

use std::{
    env,
    ffi::{CStr, OsStr, OsString},
    fs::File,
    io::{self, Read, Write},
    os::{
        fd::{BorrowedFd, RawFd},
        unix::net::UnixStream,
    },
    path::PathBuf,
    sync::{Arc, mpsc},
    thread,
    time::{Duration, Instant},
};

use super::{
    ViewError,
    x11::{Refusal, Server},
};

/// A display that answers.
pub(super) enum Session {
    /// A Wayland compositor.
    Wayland,
    /// An X server.
    X(Arc<Server>),
}

/// How long a Wayland compositor may take to answer: less if there is an X server that may do
/// instead.
const PATIENCE: Duration = Duration::from_secs(3);
const PATIENCE_WITH_X: Duration = Duration::from_millis(1200);

/// Factors by which a screen may be said to scale.
const SCALES: std::ops::RangeInclusive<f64> = 0.1..=20.0;

/// What winit loads for Wayland, and for X.
const WAYLAND_LIBRARIES: [&CStr; 2] = [c"libwayland-client.so.0", c"libxkbcommon.so.0"];
const X_LIBRARIES: [&CStr; 7] = [
    c"libX11.so.6",
    c"libX11-xcb.so.1",
    c"libXcursor.so.1",
    c"libXi.so.6",
    c"libxcb.so.1",
    c"libxkbcommon.so.0",
    c"libxkbcommon-x11.so.0",
];

/// Finds the display, and puts right what winit would panic at or wait for. Says what has been
/// passed over.
///
/// # Safety
/// No other thread may use the environment meanwhile other than through [`std::env`].
pub(super) unsafe fn find(say: fn(&str)) -> Result<Session, ViewError> {
    // SAFETY: as the caller promises.
    unsafe { settle(say) };
    let x_name = set("DISPLAY");
    let patience = if x_name.is_some() { PATIENCE_WITH_X } else { PATIENCE };
    let deadline = Instant::now() + patience;
    let mut failures = Vec::new();
    let mut libraries = Vec::new();
    for (variable, stream) in [("WAYLAND_SOCKET", inherited as Connect), ("WAYLAND_DISPLAY", named)]
    {
        let Some(value) = set(variable) else { continue };
        let lacking = missing(&WAYLAND_LIBRARIES);
        let answered = if lacking.is_empty() {
            answers(&value, stream, deadline, patience)
        } else {
            libraries.extend(&lacking);
            Err(format!("{} is missing", lacking.join(", ")))
        };
        match answered {
            Ok(()) => {
                pass_over(&failures, variable, say);
                if variable != "WAYLAND_SOCKET" {
                    // SAFETY: as the caller promises. winit's crates would take the socket before
                    // the display, and an empty variable for one.
                    unsafe { env::remove_var("WAYLAND_SOCKET") };
                }
                return Ok(Session::Wayland);
            }
            Err(why) => failures.push(format!("{variable} is {}: {why}", shown(&value))),
        }
    }
    let unset = |name: &str| format!("{name} is not set");
    if failures.is_empty() {
        failures.push(unset("WAYLAND_DISPLAY"));
    }
    let Some(name) = x_name else {
        failures.push(unset("DISPLAY"));
        return Err(nowhere(&failures, libraries));
    };
    let refusal = match name.to_str() {
        Some(text) => match Server::connect(text) {
            Ok(server) => {
                let lacking = missing(&X_LIBRARIES);
                if lacking.is_empty() {
                    failures.retain(|failure| !failure.ends_with("is not set"));
                    pass_over(&failures, "DISPLAY", say);
                    return Ok(Session::X(server));
                }
                libraries.extend(&lacking);
                Refusal::Nowhere(format!("{} is missing", lacking.join(", ")))
            }
            Err(refusal) => refusal,
        },
        None => Refusal::Nowhere("not the name of a display that can be, such as :0".into()),
    };
    match refusal {
        Refusal::Unable(words) => {
            failures.retain(|failure| !failure.ends_with("is not set"));
            pass_over(&failures, "DISPLAY", say);
            Err(ViewError::Unable(format!("DISPLAY is {}: {words}", shown(&name))))
        }
        Refusal::Nowhere(why) => {
            failures.push(format!("DISPLAY is {}: {why}", shown(&name)));
            Err(nowhere(&failures, libraries))
        }
    }
}

fn nowhere(failures: &[String], mut libraries: Vec<&str>) -> ViewError {
    let words = failures.join("; ");
    libraries.dedup();
    if libraries.is_empty() { ViewError::NoDisplay(words) } else { ViewError::NoLibraries(words) }
}

/// Says which displays were passed over for another one.
fn pass_over(failures: &[String], instead: &str, say: fn(&str)) {
    for failure in failures {
        say(&format!("note: {failure}; the window is opened on {instead} instead"));
    }
}

/// A variable's value; none if it is empty.
fn set(name: &str) -> Option<OsString> {
    env::var_os(name).filter(|value| !value.is_empty())
}

/// A value as one can print it.
fn shown(value: &OsStr) -> String {
    planisphere_core::text::name(value)
}

/// Takes out of the environment what has no meaning for this window, and harms.
///
/// # Safety
/// As [`find`].
unsafe fn settle(say: fn(&str)) {
    // The window is measured in pixels, so that no scale matters. Without this one winit works it
    // out from a resource or the screen's size in millimetres, and panics where they make no sense.
    const SCALE: &str = "WINIT_X11_SCALE_FACTOR";
    if let Some(value) = set(SCALE) {
        let text = value.to_string_lossy();
        let sensible = text.parse().is_ok_and(|scale: f64| SCALES.contains(&scale));
        if !sensible && !text.eq_ignore_ascii_case("randr") {
            say(&format!(
                "note: {SCALE} is {}, which is no scale from {} to {}, and is ignored: the window \
                 is measured in pixels",
                shown(&value),
                SCALES.start(),
                SCALES.end()
            ));
        }
    }
    // SAFETY: as the caller promises.
    unsafe { env::set_var(SCALE, "1") };
    // Keys are taken as they are; an input method, which may hang or keep them to itself, has no
    // part in it. SAFETY: as the caller promises.
    unsafe { env::set_var("XMODIFIERS", "@im=none") };
}

/// Which of these libraries cannot be loaded. Elsewhere than on Linux they have other names: winit
/// tells then.
fn missing<'l>(names: &[&'l CStr]) -> Vec<&'l str> {
    if !cfg!(target_os = "linux") {
        return Vec::new();
    }
    let lacks = |name: &CStr| {
        // SAFETY: the names are strings with an end. The libraries are winit's, which loads them
        // the same way; what they do when they are loaded, they do anyway. They are never unloaded.
        unsafe { libc::dlopen(name.as_ptr(), libc::RTLD_LAZY | libc::RTLD_LOCAL) }.is_null()
    };
    names.iter().filter(|name| lacks(name)).filter_map(|name| name.to_str().ok()).collect()
}

/// Makes a connection of a variable's value.
type Connect = fn(&OsStr) -> Result<UnixStream, String>;

/// The socket that a `WAYLAND_SOCKET` is the number of.
fn inherited(value: &OsStr) -> Result<UnixStream, String> {
    let number =
        value.to_str().and_then(|text| text.parse::<RawFd>().ok()).filter(|&number| number >= 0);
    let number = number.ok_or("not the number of a descriptor")?;
    // SAFETY: the call takes any number, and says whether it is that of an open descriptor.
    if unsafe { libc::fcntl(number, libc::F_GETFD) } < 0 {
        return Err("no descriptor of this number is open".into());
    }
    // SAFETY: the descriptor is open, and nobody in this process closes it: it is one that was
    // handed over.
    let descriptor = unsafe { BorrowedFd::borrow_raw(number) };
    let copy = descriptor.try_clone_to_owned().map_err(|error| error.to_string())?;
    let kind = File::from(copy.try_clone().map_err(|error| error.to_string())?).metadata();
    if !kind.is_ok_and(|kind| std::os::unix::fs::FileTypeExt::is_socket(&kind.file_type())) {
        return Err("the descriptor is no socket".into());
    }
    Ok(UnixStream::from(copy))
}

/// A connection to the socket that a `WAYLAND_DISPLAY` is the name of.
fn named(value: &OsStr) -> Result<UnixStream, String> {
    let mut path = PathBuf::from(value);
    if path.is_relative() {
        let folder =
            set("XDG_RUNTIME_DIR").map(PathBuf::from).filter(|folder| folder.is_absolute());
        path = folder.ok_or("XDG_RUNTIME_DIR, the folder of its socket, is not set")?.join(path);
    }
    UnixStream::connect(&path).map_err(|error| match path.as_os_str() {
        known if known == value => error.to_string(),
        path => format!("{}: {error}", shown(path)),
    })
}

/// Whether a Wayland compositor answers, before a point in time.
fn answers(
    value: &OsStr,
    connect: Connect,
    deadline: Instant,
    patience: Duration,
) -> Result<(), String> {
    let (tell, told) = mpsc::channel();
    let value = value.to_owned();
    let ask = move || {
        let result =
            connect(&value).and_then(|stream| ping(stream).map_err(|error| error.to_string()));
        let _ = tell.send(result);
    };
    thread::Builder::new()
        .spawn(ask)
        .map_err(|error| format!("no thread to connect with: {error}"))?;
    told.recv_timeout(deadline.saturating_duration_since(Instant::now()))
        .unwrap_or_else(|_| Err(format!("no answer within {} seconds", patience.as_secs_f64())))
}

/// Asks for a sign of life, `wl_display.sync`. The answer takes the number that the request used
/// out of use again, so that the connection is as it was before, for whoever uses it then. (The
/// protocol: wayland.freedesktop.org/docs/html, 4.)
fn ping(mut stream: UnixStream) -> io::Result<()> {
    /// The display is object 1; the callback is given the next number.
    const DISPLAY: u32 = 1;
    const CALLBACK: u32 = 2;
    stream.set_nonblocking(false)?;
    let head = |length: u32, what: u32| length << 16 | what;
    let words =
        |words: &[u32]| words.iter().flat_map(|word| word.to_ne_bytes()).collect::<Vec<u8>>();
    stream.write_all(&words(&[DISPLAY, head(12, 0), CALLBACK]))?;
    let mut answer = [0; 24];
    stream.read_exact(&mut answer).map_err(|error| match error.kind() {
        io::ErrorKind::UnexpectedEof => io::Error::other("it closes the connection"),
        _ => error,
    })?;
    // `done` with a serial number, and `delete_id`.
    let (done, deleted) = answer.split_at(12);
    if done[..8] == *words(&[CALLBACK, head(12, 0)])
        && *deleted == *words(&[DISPLAY, head(12, 1), CALLBACK])
    {
        Ok(())
    } else {
        Err(io::Error::other("what answers is no Wayland compositor"))
    }
}
