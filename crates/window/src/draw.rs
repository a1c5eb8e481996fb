//! The thread that draws: the window stays responsive however long a picture takes.
//!
//! It takes one view at a time. Whoever asks keeps the newest view back until the last picture has
//! come, so that views that are overtaken are never drawn.

use std::{
    any::Any,
    io,
    panic::{self, AssertUnwindSafe},
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, Ordering},
        mpsc::{self, Sender},
    },
    thread::{self, JoinHandle},
    time::{Duration, Instant},
};

use rayon::prelude::*;

use planisphere_core::camera::View;
use planisphere_io::load::Loaded;
use planisphere_renderer::{Camera, Error, Job, Look, Renderer, Request, Scene};

/// How long a thread is waited for at the end; without a picture under way it ends at once.
const LEAVE: Duration = Duration::from_millis(300);

/// How often arrays are looked at while a picture is drawn.
const LOOK: Duration = Duration::from_millis(100);

/// A picture.
pub(super) struct Frame {
    /// What it shows.
    pub view: View,
    /// Index of the sphere at every pixel.
    pub ids: Vec<i32>,
    /// Colours as the window takes them: 0x00rrggbb.
    pub pixels: Vec<u32>,
    /// How long it took to draw.
    pub milliseconds: f64,
}

/// What becomes of a view that is to be drawn.
pub(super) enum Drawn {
    /// It is a picture.
    Frame(Frame),
    /// Arrays are not what they were when the scene was loaded, so that there is no picture of it;
    /// which, in words.
    Changed(String),
    /// The device has failed.
    Failed(Error),
    /// Drawing has panicked.
    Panicked(Box<dyn Any + Send>),
}

/// The drawing thread.
pub(super) struct Painter {
    jobs: Sender<View>,
    thread: JoinHandle<()>,
    stop: Arc<Stop>,
}

/// Ends the picture under way, and those to come.
#[derive(Default)]
struct Stop {
    stopped: AtomicBool,
    /// Ends the picture under way.
    now: Mutex<Option<Box<dyn Fn() + Send>>>,
}

impl Stop {
    fn now(&self) -> MutexGuard<'_, Option<Box<dyn Fn() + Send>>> {
        self.now.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn stop(&self) {
        self.stopped.store(true, Ordering::SeqCst);
        if let Some(cancel) = &*self.now() {
            cancel();
        }
    }

    /// Waits for a picture that can be stopped meanwhile.
    fn wait<T: Send + 'static>(&self, job: Job<T>) -> Result<T, Error> {
        *self.now() = Some(Box::new(job.canceller()));
        if self.stopped.load(Ordering::SeqCst) {
            return Err(Error::Cancelled);
        }
        let result = panic::catch_unwind(AssertUnwindSafe(|| job.wait()));
        *self.now() = None;
        result.unwrap_or_else(|payload| panic::resume_unwind(payload))
    }
}

impl Painter {
    /// Starts the thread; every view sent is answered by one call of `done`.
    ///
    /// # Errors
    /// When there is no thread to be had.
    pub fn start(
        renderer: Renderer,
        loaded: Loaded,
        done: impl Fn(Drawn) + Send + 'static,
    ) -> io::Result<Self> {
        let (jobs, queue) = mpsc::channel();
        let (stop, drawing) = (Arc::<Stop>::default(), Arc::<AtomicBool>::default());
        look(&loaded, &drawing, Arc::clone(&stop));
        let theirs = Arc::clone(&stop);
        let scene = Scene::from(&loaded);
        let thread = thread::Builder::new().name("drawing".into()).spawn(move || {
            while let Ok(view) = queue.recv() {
                drawing.store(true, Ordering::Relaxed);
                let drawn = draw_unless_changed(&loaded, || {
                    draw(&renderer, &scene, &theirs, &loaded, view)
                });
                drawing.store(false, Ordering::Relaxed);
                done(drawn);
            }
        })?;
        Ok(Self { jobs, thread, stop })
    }

    /// Begins a picture. One at a time: the next when this one is done.
    pub fn begin(&self, view: View) {
        // The thread ends only when this sender does.
        let _ = self.jobs.send(view);
    }

    /// Ends the thread, and the picture that is under way. Answers whether it still is after a
    /// moment: then it is not waited for.
    pub fn end(self) -> bool {
        let Self { jobs, thread, stop } = self;
        drop(jobs);
        stop.stop();
        let start = Instant::now();
        while !thread.is_finished() {
            if start.elapsed() > LEAVE {
                return true;
            }
            thread::sleep(Duration::from_millis(2));
        }
        // A panic has been reported.
        let _ = thread.join();
        false
    }
}

/// Arrays that are not what they were when the scene was loaded; none if all are.
pub(super) fn arrays_changed(loaded: &Loaded) -> Option<String> {
    loaded.watch.changed().map(|changed| changed.to_string())
}

/// Cancels, by another thread, the picture under way while which an array changes: one of changed
/// numbers can take for ever. Where there is no thread to be had, it is not cut short.
fn look(loaded: &Loaded, drawing: &Arc<AtomicBool>, stop: Arc<Stop>) {
    if loaded.watch.is_empty() {
        return;
    }
    let (loaded, drawing) = (loaded.clone(), Arc::downgrade(drawing));
    let _ = thread::Builder::new().name("looking at arrays".into()).spawn(move || {
        while let Some(drawing) = drawing.upgrade() {
            if drawing.load(Ordering::Relaxed) && arrays_changed(&loaded).is_some() {
                // No other picture can be drawn after it.
                return stop.stop();
            }
            drop(drawing);
            thread::sleep(LOOK);
        }
    });
}

/// Draws; whatever comes of it is worth nothing if an array has changed by then.
fn draw_unless_changed(loaded: &Loaded, draw: impl FnOnce() -> Result<Frame, Error>) -> Drawn {
    if let Some(words) = arrays_changed(loaded) {
        return Drawn::Changed(words);
    }
    let drawn = panic::catch_unwind(AssertUnwindSafe(draw));
    match (arrays_changed(loaded), drawn) {
        (Some(words), _) => Drawn::Changed(words),
        (None, Ok(Ok(frame))) => Drawn::Frame(frame),
        // Only a change, or the end of the window, cancels a picture; nobody is told of the latter.
        (None, Ok(Err(error))) => Drawn::Failed(error),
        (None, Err(payload)) => Drawn::Panicked(payload),
    }
}

fn draw(
    renderer: &Renderer,
    scene: &Scene,
    stop: &Stop,
    loaded: &Loaded,
    view: View,
) -> Result<Frame, Error> {
    let start = Instant::now();
    let camera = Camera::try_from(view.camera)?;
    let look = Look::new().background(loaded.look.behind());
    let request = Request::new(scene, camera, [view.image.width, view.image.height])?.look(look);
    let job = renderer.start_with(request, |picture| {
        let pixels = picture.rgba().par_iter().map(|&[r, g, b, _]| packed([r, g, b]));
        Ok((pixels.collect(), picture.ids().to_vec()))
    });
    let (pixels, ids) = stop.wait(job)?;
    Ok(Frame { view, ids, pixels, milliseconds: start.elapsed().as_secs_f64() * 1e3 })
}

/// A colour as the window takes it.
pub(super) fn packed([red, green, blue]: [u8; 3]) -> u32 {
    u32::from_be_bytes([0, red, green, blue])
}
