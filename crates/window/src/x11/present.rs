//! Pictures into a window of an X server, by a thread of its own: however slow the line is, the
//! window answers.
//!
//! Memory that is shared with the server is the quick way. Where it cannot be had (over a network
//! or ssh, in a container, without the extension) pictures go through the connection, in pieces
//! that every server takes.

use std::{
    fs::File,
    io,
    os::fd::OwnedFd,
    sync::{Arc, Condvar, Mutex, PoisonError},
    thread,
};

use memmap2::MmapMut;
use x11rb::{
    connection::{Connection, RequestConnection},
    errors::{ConnectionError, ReplyError, ReplyOrIdError},
    protocol::{
        ErrorKind, Event,
        shm::ConnectionExt as _,
        xproto::{ConnectionExt as _, CreateGCAux, ImageFormat},
    },
};

use super::{Fate, Server};
use crate::picture::Picture;

/// Bytes of a piece that goes through the connection, at most: half the time of pieces of 16 MiB,
/// as they stay in caches.
const PIECE: usize = 1 << 18;
/// Bytes of a request beside its pixels, at most.
const HEAD: usize = 32;

/// Why no more pictures can be shown; the fate of the window, or words.
pub(crate) enum Trouble {
    /// The window or its server is gone.
    Gone(Fate),
    /// Something else.
    Words(String),
}

impl From<ConnectionError> for Trouble {
    fn from(_: ConnectionError) -> Self {
        Self::Gone(Fate::ServerGone)
    }
}

impl From<ReplyError> for Trouble {
    fn from(error: ReplyError) -> Self {
        match error {
            ReplyError::ConnectionError(error) => error.into(),
            ReplyError::X11Error(error) => match error.error_kind {
                ErrorKind::Drawable | ErrorKind::Window => Self::Gone(Fate::Destroyed),
                kind => Self::Words(format!("the X server refuses a picture: {kind:?}")),
            },
        }
    }
}

impl From<ReplyOrIdError> for Trouble {
    fn from(error: ReplyOrIdError) -> Self {
        match error {
            ReplyOrIdError::ConnectionError(error) => error.into(),
            ReplyOrIdError::X11Error(error) => ReplyError::X11Error(error).into(),
            ReplyOrIdError::IdsExhausted => {
                Self::Words("the X server has no more names for resources".into())
            }
        }
    }
}

/// The picture that waits to be shown: a newer one takes its place.
#[derive(Default)]
struct Waiting {
    picture: Mutex<Option<Picture>>,
    there: Condvar,
}

/// Where pictures go. The thread lives as long as the process.
pub(crate) struct Presenter(Arc<Waiting>);

impl Presenter {
    /// Starts the thread; `failed` is called when no more can be shown.
    pub fn start(
        server: Arc<Server>,
        window: u32,
        failed: impl FnOnce(Trouble) + Send + 'static,
    ) -> io::Result<Self> {
        let waiting = Arc::<Waiting>::default();
        let queue = Arc::clone(&waiting);
        thread::Builder::new().name("presenting".into()).spawn(move || {
            let result = Easel::new(&server, window).and_then(|mut easel| {
                loop {
                    easel.put(&queue.next())?;
                }
            });
            let Err::<(), _>(trouble) = result else { return };
            failed(trouble);
        })?;
        Ok(Self(waiting))
    }

    /// Shows a picture, and no longer one that still waits.
    pub fn show(&self, picture: Picture) {
        *self.0.picture.lock().unwrap_or_else(PoisonError::into_inner) = Some(picture);
        self.0.there.notify_one();
    }
}

impl Waiting {
    fn next(&self) -> Picture {
        let mut picture = self.picture.lock().unwrap_or_else(PoisonError::into_inner);
        loop {
            match picture.take() {
                Some(picture) => return picture,
                None => picture = self.there.wait(picture).unwrap_or_else(PoisonError::into_inner),
            }
        }
    }
}

/// Memory that the server shares.
struct Shared {
    memory: MmapMut,
    segment: u32,
}

/// What it takes to put pictures into a window.
struct Easel<'s> {
    server: &'s Server,
    window: u32,
    context: u32,
    /// Whether memory is to be shared.
    shares: bool,
    shared: Option<Shared>,
    /// Room for one row of the picture, and for one piece as the server takes it.
    row: Vec<u32>,
    piece: Vec<u8>,
}

impl<'s> Easel<'s> {
    fn new(server: &'s Server, window: u32) -> Result<Self, Trouble> {
        let connection = &server.connection;
        let context = connection.generate_id()?;
        connection
            .create_gc(context, window, &CreateGCAux::new().graphics_exposures(0))?
            .check()?;
        let shares = server.shares;
        Ok(Self {
            server,
            window,
            context,
            shares,
            shared: None,
            row: Vec::new(),
            piece: Vec::new(),
        })
    }

    /// Shows a picture; when this returns, the server has it.
    fn put(&mut self, picture: &Picture) -> Result<(), Trouble> {
        if self.shares {
            match self.put_by_memory(picture) {
                Err(Trouble::Words(_)) => {
                    // What cannot be shared now is not asked for again: the connection always
                    // serves.
                    self.shares = false;
                    self.let_go()?;
                }
                other => return other,
            }
        }
        self.put_by_wire(picture)?;
        self.finish()
    }

    fn put_by_memory(&mut self, picture: &Picture) -> Result<(), Trouble> {
        let (columns, rows) = (picture.columns(), picture.rows());
        let stride = self.server.format.stride(columns);
        self.share(stride * rows)?;
        let Some(Shared { memory, segment }) = &mut self.shared else { return Ok(()) };
        for (y, place) in memory.chunks_exact_mut(stride).take(rows).enumerate() {
            self.server.format.encode(picture.row(y, &mut self.row), place);
        }
        let [width, height] = [columns, rows].map(short);
        let depth = self.server.format.depth;
        let (window, context, format) = (self.window, self.context, ImageFormat::Z_PIXMAP.into());
        let connection = &self.server.connection;
        connection.shm_put_image(
            window, context, width, height, 0, 0, width, height, 0, 0, depth, format, false,
            *segment, 0,
        )?;
        self.finish()
    }

    /// Sees that so many bytes are shared.
    fn share(&mut self, bytes: usize) -> Result<(), Trouble> {
        if self.shared.as_ref().is_some_and(|shared| shared.memory.len() >= bytes) {
            return Ok(());
        }
        self.let_go()?;
        let (file, memory) = memory(bytes).map_err(|error| Trouble::Words(error.to_string()))?;
        let connection = &self.server.connection;
        let segment = connection.generate_id()?;
        let descriptor = OwnedFd::from(file);
        match connection.shm_attach_fd(segment, descriptor, true)?.check() {
            Ok(()) => self.shared = Some(Shared { memory, segment }),
            Err(ReplyError::ConnectionError(error)) => return Err(error.into()),
            Err(ReplyError::X11Error(_)) => {
                return Err(Trouble::Words("memory is not shared".into()));
            }
        }
        Ok(())
    }

    fn let_go(&mut self) -> Result<(), ConnectionError> {
        if let Some(Shared { segment, .. }) = self.shared.take() {
            self.server.connection.shm_detach(segment)?;
        }
        Ok(())
    }

    fn put_by_wire(&mut self, picture: &Picture) -> Result<(), Trouble> {
        let Server { connection, format, .. } = self.server;
        let most = connection.maximum_request_bytes().min(PIECE) - HEAD;
        let (columns, rows) = (picture.columns(), picture.rows());
        // A row that is too long for one request is cut too.
        let mut broad = columns;
        while broad > 1 && format.stride(broad) > most {
            broad = broad.div_ceil(2);
        }
        let stride = format.stride(broad);
        let high = (most / stride).max(1);
        for top in (0..rows).step_by(high) {
            for left in (0..columns).step_by(broad) {
                let (wide, tall) = (broad.min(columns - left), high.min(rows - top));
                let stride = format.stride(wide);
                self.piece.resize(stride * tall, 0);
                for (y, place) in (top..top + tall).zip(self.piece.chunks_exact_mut(stride)) {
                    format.encode(&picture.row(y, &mut self.row)[left..left + wide], place);
                }
                let [x, y] = [left, top].map(|at| i16::try_from(at).unwrap_or(i16::MAX));
                let (kind, depth) = (ImageFormat::Z_PIXMAP, format.depth);
                let (wide, tall) = (short(wide), short(tall));
                connection.put_image(
                    kind,
                    self.window,
                    self.context,
                    wide,
                    tall,
                    x,
                    y,
                    0,
                    depth,
                    &self.piece,
                )?;
            }
        }
        Ok(())
    }

    /// Waits until the server has done what it was asked, and hears what went wrong.
    fn finish(&self) -> Result<(), Trouble> {
        let connection = &self.server.connection;
        connection.get_input_focus()?.reply()?;
        let mut trouble = Ok(());
        while let Some(event) = connection.poll_for_event()? {
            if let Event::Error(error) = event {
                trouble = Err(ReplyError::X11Error(error).into());
            }
        }
        trouble
    }
}

/// A side of a picture. None is longer than [`planisphere_core::camera::MAX_SIDE`].
fn short(side: usize) -> u16 {
    u16::try_from(side).unwrap_or(u16::MAX)
}

/// Memory with a descriptor that can be passed on. It is had now, or not at all: memory that is
/// missing only when it is written to ends a process.
fn memory(bytes: usize) -> io::Result<(File, MmapMut)> {
    let length = bytes as u64;
    // A file beyond this limit ends a process too.
    if length > file_limit() {
        return Err(io::Error::from(io::ErrorKind::FileTooLarge));
    }
    let file = anonymous()?;
    loop {
        // SAFETY: the descriptor is open as long as `file` is; the call touches no memory of this
        // process.
        let code = unsafe {
            libc::posix_fallocate(std::os::fd::AsRawFd::as_raw_fd(&file), 0, bytes as libc::off_t)
        };
        match code {
            0 => break,
            libc::EINTR => {}
            code => return Err(io::Error::from_raw_os_error(code)),
        }
    }
    // SAFETY: the file has no name and its descriptor goes to the X server alone, which attaches it
    // for reading. Nobody makes it shorter, and nobody else writes to it.
    let map = unsafe { MmapMut::map_mut(&file)? };
    Ok((file, map))
}

/// Bytes that a file of this process may have.
fn file_limit() -> u64 {
    let mut limit = libc::rlimit { rlim_cur: 0, rlim_max: 0 };
    // SAFETY: the structure is this function's own, and of the type that the call fills.
    match unsafe { libc::getrlimit(libc::RLIMIT_FSIZE, &raw mut limit) } {
        #[allow(clippy::useless_conversion, reason = "its type is another on some systems")]
        0 if limit.rlim_cur != libc::RLIM_INFINITY => limit.rlim_cur.into(),
        _ => u64::MAX,
    }
}

/// A file without a name, in memory: /dev/shm, where names would be, is small in containers.
#[cfg(target_os = "linux")]
fn anonymous() -> io::Result<File> {
    // SAFETY: the name is a string with an end; the call does nothing else with memory.
    let descriptor = unsafe { libc::memfd_create(c"planisphere".as_ptr(), libc::MFD_CLOEXEC) };
    if descriptor < 0 {
        return Err(io::Error::last_os_error());
    }
    // SAFETY: the descriptor is new, and nobody else has it.
    Ok(File::from(unsafe { <OwnedFd as std::os::fd::FromRawFd>::from_raw_fd(descriptor) }))
}

/// A file without a name.
#[cfg(not(target_os = "linux"))]
fn anonymous() -> io::Result<File> {
    tempfile::tempfile()
}
