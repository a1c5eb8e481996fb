//! The window on X and Wayland: a thread of its own runs the events, and whoever opened the window
//! waits for what becomes of it. However the windowing crates, Xlib or the server end, they end
//! that thread and not the process.

use std::{
    any::Any,
    panic,
    sync::{
        Arc,
        atomic::{AtomicU32, Ordering},
        mpsc::{self, Receiver, Sender},
    },
    thread,
    time::Duration,
};

use winit::{
    event_loop::EventLoop,
    platform::{wayland::EventLoopBuilderExtWayland, x11::EventLoopBuilderExtX11},
};

use super::{
    Shown, Start, ViewError,
    app::{App, Message},
    guard::{self, Panic},
    session::{self, Session},
    x11::{Fate, Server, present::Trouble},
};
use planisphere_renderer::Renderer;

/// How long winit may take to connect to a display that has answered.
const PATIENCE: Duration = Duration::from_secs(30);

/// The kind of server that pictures go to by a thread of their own.
const X_SERVER: &str = "X server";

/// What the window's thread tells.
enum News {
    /// There is an event loop.
    Connected,
    /// The window is closed, or it failed.
    Ended(Shown),
    /// winit could not connect, or panicked; why.
    Broken(String),
    /// The connection to the X server is lost.
    Lost,
    /// Something else panicked.
    Panicked(Box<dyn Any + Send>),
}

/// A connection to a display.
pub(super) struct Desktop {
    orders: Sender<(Start, Renderer)>,
    news: Receiver<News>,
    /// The X server, and the window once there is one.
    server: Option<Arc<Server>>,
    window: Arc<AtomicU32>,
}

impl Desktop {
    /// Connects.
    ///
    /// # Safety
    /// As [`session::find`].
    pub unsafe fn open(say: fn(&str)) -> Result<Self, ViewError> {
        // SAFETY: as the caller promises.
        let server = match unsafe { session::find(say)? } {
            Session::Wayland => None,
            Session::X(server) => Some(server),
        };
        let (orders, work) = mpsc::channel();
        let (tell, news) = mpsc::channel();
        let window = Arc::<AtomicU32>::default();
        let thread = Thread { tell, work, server: server.clone(), window: Arc::clone(&window) };
        let spawned = thread::Builder::new().name("window".into()).spawn(move || thread.run());
        spawned.map_err(|error| ViewError::Window(format!("no thread for it: {error}")))?;
        let desktop = Self { orders, news, server, window };
        match desktop.news.recv_timeout(PATIENCE) {
            Ok(News::Connected) => Ok(desktop),
            Ok(other) => Err(desktop.end(other).result.err().unwrap_or_else(|| desktop.lost())),
            Err(_) => {
                let seconds = PATIENCE.as_secs();
                Err(ViewError::NoDisplay(format!(
                    "the display answers, but no connection came about in {seconds} seconds"
                )))
            }
        }
    }

    /// Shows the window until it is closed.
    pub fn show(self, start: Start, renderer: Renderer) -> Shown {
        let last = match self.orders.send((start, renderer)) {
            Ok(()) => self.news.recv().unwrap_or(News::Lost),
            // Lost while nobody listened.
            Err(_) => self.news.try_recv().unwrap_or(News::Lost),
        };
        self.end(last)
    }

    fn end(&self, news: News) -> Shown {
        let failed = |error| Shown { result: Err(error), drawing: true };
        match news {
            News::Ended(shown) => shown,
            News::Connected | News::Lost => failed(self.lost()),
            News::Broken(words) => failed(self.broken(words)),
            News::Panicked(payload) => panic::resume_unwind(payload),
        }
    }

    /// Why the connection is lost: a server that still answers has been told to cut it, as xkill
    /// tells it.
    fn lost(&self) -> ViewError {
        let window = self.window.load(Ordering::Relaxed);
        match &self.server {
            None => ViewError::Lost("Wayland compositor"),
            Some(server) => match server.fate(window) {
                Fate::ServerGone => ViewError::Lost(X_SERVER),
                Fate::Destroyed | Fate::There => ViewError::Destroyed,
            },
        }
    }

    /// Why winit has failed: its own words if the server and the window are still there.
    fn broken(&self, words: String) -> ViewError {
        let window = self.window.load(Ordering::Relaxed);
        match self.server.as_ref().filter(|_| window != 0).map(|server| server.fate(window)) {
            Some(Fate::ServerGone) => self.lost(),
            Some(Fate::Destroyed) => ViewError::Destroyed,
            Some(Fate::There) | None => ViewError::Window(words),
        }
    }
}

impl From<Trouble> for ViewError {
    fn from(trouble: Trouble) -> Self {
        match trouble {
            Trouble::Gone(Fate::Destroyed) => Self::Destroyed,
            Trouble::Gone(_) => Self::Lost(X_SERVER),
            Trouble::Words(words) => Self::Window(words),
        }
    }
}

/// What the window's thread begins with.
struct Thread {
    tell: Sender<News>,
    work: Receiver<(Start, Renderer)>,
    server: Option<Arc<Server>>,
    window: Arc<AtomicU32>,
}

impl Thread {
    fn run(self) {
        let lost = self.tell.clone();
        guard::on_lost_connection(move || drop(lost.send(News::Lost)));
        let news = guard::catch(|| self.connect_and_show()).unwrap_or_else(|panic| match panic {
            Panic::Windowing(words) => News::Broken(words),
            Panic::Other(payload) => News::Panicked(payload),
        });
        // Whoever is gone does not want to know.
        let _ = self.tell.send(news);
    }

    fn connect_and_show(&self) -> News {
        let mut builder = EventLoop::<Message>::with_user_event();
        if self.server.is_some() {
            EventLoopBuilderExtX11::with_any_thread(builder.with_x11(), true);
        } else {
            EventLoopBuilderExtWayland::with_any_thread(builder.with_wayland(), true);
        }
        let event_loop = match builder.build() {
            Ok(event_loop) => event_loop,
            Err(error) => return News::Broken(super::reason(&error.to_string()).to_owned()),
        };
        let _ = self.tell.send(News::Connected);
        let Ok((start, renderer)) = self.work.recv() else { return News::Lost };
        let server =
            self.server.as_ref().map(|server| (Arc::clone(server), Arc::clone(&self.window)));
        let app = match App::new(start, renderer, event_loop.create_proxy()) {
            Ok(app) => app.on_x(server),
            Err(error) => return News::Ended(Shown { result: Err(error), drawing: false }),
        };
        match super::run(event_loop, app) {
            super::Ended::Shown(shown) => News::Ended(shown),
            super::Ended::Broken(words) => News::Broken(words),
            super::Ended::Lost => News::Lost,
            super::Ended::Panicked(payload) => News::Panicked(payload),
        }
    }
}
