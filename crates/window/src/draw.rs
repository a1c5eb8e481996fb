//! The thread that draws: the window stays responsive however long a picture takes.
//!
//! It takes one view at a time. Whoever asks keeps the newest view back until the last picture has
//! come, so that views that are overtaken are never drawn.

use std::{
    any::Any,
    io,
    panic::{self, AssertUnwindSafe},
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
        mpsc::{self, Sender},
    },
    thread::{self, JoinHandle},
    time::{Duration, Instant},
};

use rayon::prelude::*;

use planisphere_core::{
    camera::{Region, View},
    drawing::{Control, DrawError},
};
use planisphere_image::Paint;
use planisphere_io::load::Loaded;
use planisphere_renderer::Engine;

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
    Failed(DrawError),
    /// Drawing has panicked.
    Panicked(Box<dyn Any + Send>),
}

/// The drawing thread.
pub(super) struct Painter {
    jobs: Sender<View>,
    thread: JoinHandle<()>,
    control: Control,
}

impl Painter {
    /// Starts the thread; every view sent is answered by one call of `done`.
    ///
    /// # Errors
    /// When there is no thread to be had.
    pub fn start(
        mut device: Engine,
        loaded: Loaded,
        done: impl Fn(Drawn) + Send + 'static,
    ) -> io::Result<Self> {
        let (jobs, queue) = mpsc::channel();
        let control = Control::new();
        device.controlled_by(&control);
        let drawing = Arc::<AtomicBool>::default();
        look(&loaded, &drawing, control.clone());
        let thread = thread::Builder::new().name("drawing".into()).spawn(move || {
            while let Ok(view) = queue.recv() {
                drawing.store(true, Ordering::Relaxed);
                let drawn = draw_unless_changed(&mut device, &loaded, view);
                drawing.store(false, Ordering::Relaxed);
                done(drawn);
            }
        })?;
        Ok(Self { jobs, thread, control })
    }

    /// Begins a picture. One at a time: the next when this one is done.
    pub fn begin(&self, view: View) {
        // The thread ends only when this sender does.
        let _ = self.jobs.send(view);
    }

    /// Ends the thread, and the picture that is under way. Answers whether it still is after a
    /// moment: then it is not waited for.
    pub fn end(self) -> bool {
        let Self { jobs, thread, control } = self;
        drop(jobs);
        control.cancel();
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
fn look(loaded: &Loaded, drawing: &Arc<AtomicBool>, control: Control) {
    if loaded.watch.is_empty() {
        return;
    }
    let (loaded, drawing) = (loaded.clone(), Arc::downgrade(drawing));
    let _ = thread::Builder::new().name("looking at arrays".into()).spawn(move || {
        while let Some(drawing) = drawing.upgrade() {
            if drawing.load(Ordering::Relaxed) && arrays_changed(&loaded).is_some() {
                // No other picture can be drawn after it.
                return control.cancel();
            }
            drop(drawing);
            thread::sleep(LOOK);
        }
    });
}

/// Draws; whatever comes of it is worth nothing if an array has changed by then.
fn draw_unless_changed(device: &mut Engine, loaded: &Loaded, view: View) -> Drawn {
    if let Some(words) = arrays_changed(loaded) {
        return Drawn::Changed(words);
    }
    let drawn = panic::catch_unwind(AssertUnwindSafe(|| draw(device, loaded, view)));
    match (arrays_changed(loaded), drawn) {
        (Some(words), _) => Drawn::Changed(words),
        (None, Ok(Ok(frame))) => Drawn::Frame(frame),
        // Only a change, or the end of the window, cancels a picture; nobody is told of the latter.
        (None, Ok(Err(error))) => Drawn::Failed(error),
        (None, Err(payload)) => Drawn::Panicked(payload),
    }
}

fn draw(device: &mut Engine, loaded: &Loaded, view: View) -> Result<Frame, DrawError> {
    let start = Instant::now();
    let Loaded { scene, background, .. } = loaded;
    let ids = device.draw(scene, &view, Region::whole(view.image))?.ids;
    let paint = Paint { scene, background: *background };
    let colors = paint.colors(&ids).map_err(|error| DrawError::Device(error.to_string()))?;
    let pixels = colors.par_iter().map(|&color| packed(color)).collect();
    Ok(Frame { view, ids, pixels, milliseconds: start.elapsed().as_secs_f64() * 1e3 })
}

/// A colour as the window takes it.
pub(super) fn packed([red, green, blue]: [u8; 3]) -> u32 {
    u32::from_be_bytes([0, red, green, blue])
}
