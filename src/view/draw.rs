//! The thread that draws: the window stays responsive however long a picture takes.
//!
//! It takes one view at a time. Whoever asks keeps the newest view back until the last picture has come, so that views that
//! are overtaken are never drawn.

use std::{
    sync::mpsc::{self, RecvTimeoutError, Sender},
    thread::{self, JoinHandle},
    time::{Duration, Instant},
};

use rayon::prelude::*;

use crate::{
    camera::{Region, View},
    frame::Paint,
    load::{ChangedFile, Watch},
    render::{Device, DrawError},
    scene::Scene,
};

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

/// Why there is no picture.
#[derive(Debug, thiserror::Error)]
pub(super) enum NoFrame {
    /// The device failed.
    #[error("{0}")]
    Draw(#[from] DrawError),
    /// Numbers of the scene are others now. The window goes on with the picture that it has.
    #[error("{0}")]
    Changed(#[from] ChangedFile),
}

/// How often the files of a scene are looked at while it is drawn.
const LOOK: Duration = Duration::from_millis(100);

/// The drawing thread.
pub(super) struct Painter {
    jobs: Sender<View>,
    thread: JoinHandle<()>,
    watch: Watch,
}

impl Painter {
    /// Starts the thread; every view sent is answered by one call of `done`.
    pub fn start(
        mut device: Device,
        scene: Scene,
        background: [u8; 3],
        watch: Watch,
        done: impl Fn(Result<Frame, NoFrame>) + Clone + Send + 'static,
    ) -> Self {
        let (jobs, queue) = mpsc::channel();
        let (begin_or_end, begins_and_ends) = mpsc::channel();
        if !watch.is_empty() {
            let (watch, done) = (watch.clone(), done.clone());
            // A picture of changed numbers can take for ever: this says so without waiting for it.
            // Where there is no thread to be had, it is said when the picture is there.
            let _ = thread::Builder::new().spawn(move || {
                while let Ok(mut drawing) = begins_and_ends.recv() {
                    while drawing {
                        match begins_and_ends.recv_timeout(LOOK) {
                            Ok(now) => drawing = now,
                            Err(RecvTimeoutError::Disconnected) => return,
                            Err(RecvTimeoutError::Timeout) => {
                                if let Some(changed) = watch.changed() {
                                    return done(Err(changed.into()));
                                }
                            }
                        }
                    }
                }
            });
        }
        let watched = watch.clone();
        let thread = thread::spawn(move || {
            let last_words = LastWords(&done);
            while let Ok(view) = queue.recv() {
                // Whoever listened has said all there is to say.
                let _ = begin_or_end.send(true);
                // What has changed is not drawn, and what changes while it is drawn is not shown.
                let drawn = match watched.changed() {
                    Some(changed) => Err(changed),
                    None => watched.guard(|| draw(&mut device, &scene, background, view)),
                };
                let _ = begin_or_end.send(false);
                done(drawn.map_err(NoFrame::from).and_then(|frame| Ok(frame?)));
            }
            drop(last_words);
        });
        Self { jobs, thread, watch }
    }

    /// Begins a picture. One at a time: the next when this one is done.
    pub fn begin(&self, view: View) {
        // A thread that has ended has said so itself.
        let _ = self.jobs.send(view);
    }

    /// Ends the thread after the picture that is under way, unless that is one of changed numbers.
    pub fn end(self) {
        let Self { jobs, thread, watch } = self;
        drop(jobs);
        if watch.changed().is_some() {
            return;
        }
        // If it panicked it has reported that.
        let _ = thread.join();
    }
}

fn draw(device: &mut Device, scene: &Scene, background: [u8; 3], view: View) -> Result<Frame, DrawError> {
    let start = Instant::now();
    let ids = device.draw(scene, &view, Region::whole(view.image))?.ids;
    let paint = Paint { scene, background };
    let colors = paint.colors(&ids).map_err(|error| DrawError::Device(error.to_string()))?;
    let pixels = colors.par_iter().map(|&color| packed(color)).collect();
    Ok(Frame { view, ids, pixels, milliseconds: start.elapsed().as_secs_f64() * 1e3 })
}

/// A colour as the window takes it.
pub(super) fn packed([red, green, blue]: [u8; 3]) -> u32 {
    u32::from_be_bytes([0, red, green, blue])
}

/// Says so when the thread ends by a panic: otherwise the window would wait for ever for its picture.
struct LastWords<'a, F: Fn(Result<Frame, NoFrame>)>(&'a F);

impl<F: Fn(Result<Frame, NoFrame>)> Drop for LastWords<'_, F> {
    fn drop(&mut self) {
        if thread::panicking() {
            self.0(Err(DrawError::Device("the drawing thread panicked".into()).into()));
        }
    }
}
