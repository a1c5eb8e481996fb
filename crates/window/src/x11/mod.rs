//! The program's own connection to an X server, beside winit's: it finds out whether there is a
//! server that can show the window, without waiting for ever, and later carries the pictures
//! ([`present`]).
//!
//! It stays open while the window does. A server that starts anew when its last client leaves would
//! otherwise do so between the question whether it is there and winit's connection.

pub(super) mod format;
pub(super) mod present;

use std::{
    io,
    sync::{Arc, mpsc},
    thread,
    time::Duration,
};

use x11rb::{
    connection::{Connection, RequestConnection},
    errors::{ConnectError, ConnectionError, ReplyError},
    protocol::{
        shm::{self, ConnectionExt as _},
        xinput::{self, ConnectionExt as _},
        xproto::ConnectionExt as _,
    },
    reexports::x11rb_protocol::{
        parse_display::{ConnectAddress, ParsedDisplay, parse_display},
        xauth::get_auth,
    },
    rust_connection::{DefaultStream, RustConnection},
};

use format::Format;

/// How long a server may take to accept the connection.
const ACCEPT: Duration = Duration::from_millis(2500);
/// How long it may then take to answer what is asked about it.
const ANSWER: Duration = Duration::from_secs(5);
/// Pauses before further attempts where a server has closed the connection at once, as it does
/// while it starts anew.
const PAUSES: [Duration; 2] = [Duration::from_millis(100), Duration::from_millis(300)];

/// What winit cannot do without. It would not say so, it would panic.
const NEEDED: [&str; 3] = ["RANDR", xinput::X11_EXTENSION_NAME, "XKEYBOARD"];

/// A server that can show the window.
pub(super) struct Server {
    connection: RustConnection,
    format: Format,
    /// Whether memory can be shared with it.
    shares: bool,
}

/// Why a server cannot show the window.
pub(super) enum Refusal {
    /// There is none, or it does not answer; why.
    Nowhere(String),
    /// It is there, but it cannot; why, and what helps.
    Unable(String),
}

/// What has become of a window.
pub(super) enum Fate {
    /// It is there.
    There,
    /// It is not there any more, but the server is.
    Destroyed,
    /// The server does not answer.
    ServerGone,
}

impl Server {
    /// Connects to the server of this name, `DISPLAY`'s value, within a limit of time.
    pub fn connect(name: &str) -> Result<Arc<Self>, Refusal> {
        let (tell, told) = mpsc::channel();
        let display = name.to_owned();
        // Looking up a host and connecting to it cannot be called off: where they take too long,
        // the thread is left behind.
        let spawned = thread::Builder::new().name("connecting to X".into()).spawn(move || {
            let result = reach(&display).and_then(|reached| {
                let _ = tell.send(None);
                reached.ask()
            });
            let _ = tell.send(Some(result));
        });
        spawned.map_err(|error| Refusal::Nowhere(format!("no thread to connect with: {error}")))?;
        let silent = |limit: Duration| {
            Refusal::Nowhere(format!("no answer within {} seconds", limit.as_secs_f64()))
        };
        let first = told.recv_timeout(ACCEPT).map_err(|_| silent(ACCEPT))?;
        match first {
            Some(result) => result,
            None => told.recv_timeout(ANSWER).ok().flatten().unwrap_or_else(|| Err(silent(ANSWER))),
        }
        .map(Arc::new)
    }

    /// What has become of a window, as far as the server says so soon.
    pub fn fate(self: &Arc<Self>, window: u32) -> Fate {
        let (tell, told) = mpsc::channel();
        let server = Arc::clone(self);
        let ask = move || {
            let reply = server
                .connection
                .get_geometry(window)
                .map_err(ReplyError::from)
                .and_then(|asked| asked.reply());
            let _ = tell.send(match reply {
                Ok(_) => Fate::There,
                Err(ReplyError::X11Error(_)) => Fate::Destroyed,
                Err(ReplyError::ConnectionError(_)) => Fate::ServerGone,
            });
        };
        if thread::Builder::new().spawn(ask).is_err() {
            return Fate::There;
        }
        told.recv_timeout(Duration::from_secs(1)).unwrap_or(Fate::ServerGone)
    }
}

/// A connection of which nothing more is known.
struct Reached {
    connection: RustConnection,
    screen: usize,
    /// Whether it is a socket of this machine, through which descriptors can be passed.
    local: bool,
}

/// Connects, and tries again where the server closes the connection at once.
fn reach(name: &str) -> Result<Reached, Refusal> {
    // libxcb takes `unix:0` as `:0`; x11rb takes what follows `unix:` as a path.
    let parsed = parse_display(Some(name)).or_else(|error| match name.strip_prefix("unix:") {
        Some(rest) => parse_display(Some(&format!(":{rest}"))).map_err(|_| error),
        None => Err(error),
    });
    let nowhere = |words: &str| Refusal::Nowhere(words.to_owned());
    let display =
        parsed.map_err(|_| nowhere("not the name of a display that can be, such as :0"))?;
    let mut pauses = PAUSES.iter();
    loop {
        let error = match reach_once(&display) {
            Ok(reached) => return Ok(reached),
            Err(error) => error,
        };
        let pause = if closed_at_once(&error) { pauses.next() } else { None };
        let Some(pause) = pause else { return Err(nowhere(&in_words(&error))) };
        thread::sleep(*pause);
    }
}

/// As [`RustConnection::connect`], which does not tell which of its addresses answered.
fn reach_once(display: &ParsedDisplay) -> Result<Reached, ConnectError> {
    let mut failure = None;
    for address in display.connect_instruction() {
        match DefaultStream::connect(&address) {
            Ok((stream, (family, peer))) => {
                let known = get_auth(family, &peer, display.display).ok().flatten();
                let (name, data) = known.unwrap_or_default();
                let screen = display.screen.into();
                let connection =
                    RustConnection::connect_to_stream_with_auth_info(stream, screen, name, data)?;
                return Ok(Reached {
                    connection,
                    screen,
                    local: matches!(address, ConnectAddress::Socket(_)),
                });
            }
            // The first address is the one that was meant; others are tried after it.
            Err(error) => failure = failure.or(Some(error)),
        }
    }
    Err(failure.unwrap_or_else(|| io::Error::from(io::ErrorKind::NotFound)).into())
}

fn closed_at_once(error: &ConnectError) -> bool {
    use io::ErrorKind::{BrokenPipe, ConnectionAborted, ConnectionReset, UnexpectedEof};
    match error {
        ConnectError::IoError(error) => {
            [BrokenPipe, ConnectionAborted, ConnectionReset, UnexpectedEof].contains(&error.kind())
        }
        ConnectError::Incomplete { .. } => true,
        _ => false,
    }
}

fn in_words(error: &ConnectError) -> String {
    match error {
        error if closed_at_once(error) => "the server closes the connection at once".into(),
        ConnectError::InvalidScreen => "the server has no screen of this number".into(),
        ConnectError::SetupFailed(failed) => {
            let reason = String::from_utf8_lossy(&failed.reason);
            format!(
                "the server refuses the connection: {}",
                planisphere_core::text::visible(reason.trim())
            )
        }
        ConnectError::SetupAuthenticate(_) => "the server asks for more authorization".into(),
        ConnectError::ParseError(_) => "what answers is no X server".into(),
        other => other.to_string(),
    }
}

impl Reached {
    /// Asks the server whether it can show the window, and how.
    fn ask(self) -> Result<Server, Refusal> {
        let Self { connection, screen, local } = self;
        let lost =
            |error: ConnectionError| Refusal::Nowhere(format!("the server has gone: {error}"));
        for name in NEEDED.into_iter().chain([shm::X11_EXTENSION_NAME]) {
            connection.prefetch_extension_information(name).map_err(lost)?;
        }
        connection.prefetch_maximum_request_bytes();
        for name in NEEDED {
            if connection.extension_information(name).map_err(lost)?.is_none() {
                return Err(Refusal::Unable(format!(
                    "the X server has no extension {name}, which windows need\n\
                     fix: start it without `-extension {name}`"
                )));
            }
        }
        let version = connection.xinput_xi_query_version(2, 3).map_err(lost)?.reply();
        if let Err(ReplyError::X11Error(_))
        | Ok(xinput::XIQueryVersionReply { major_version: ..2, .. }) = version
        {
            return Err(Refusal::Unable(format!(
                "the X server's {} is older than version 2, which windows need\nfix: use a newer \
                 X server",
                xinput::X11_EXTENSION_NAME
            )));
        }
        let shares = local
            && connection.extension_information(shm::X11_EXTENSION_NAME).map_err(lost)?.is_some()
            && {
                let version = connection.shm_query_version().map_err(lost)?.reply();
                version
                    .is_ok_and(|version| (version.major_version, version.minor_version) >= (1, 2))
            };
        let setup = connection.setup();
        let screen = &setup.roots[screen];
        let Some(format) = Format::of(setup, screen) else {
            return Err(Refusal::Unable(format!(
                "the screen has {}, but pictures need red, green and blue in each\nfix: use a \
                 screen of TrueColor (without a real one: Xvfb -cc 4 -screen 0 1280x1024x24)",
                format::describe(screen)
            )));
        };
        Ok(Server { connection, format, shares })
    }
}
