//! Draws requests: which device, on which threads, how many at a time.

use std::{
    cell::Cell,
    fmt,
    ops::ControlFlow,
    sync::{Arc, Mutex, OnceLock, PoisonError},
    time::Instant,
};

use planisphere_core::{
    camera::Region,
    cpu::Cpu,
    depth,
    drawing::{Control, Counts, DrawError, Drawing},
    exact::decide::Truth,
    pool::Later,
    text,
};
use planisphere_image::Paint;

use crate::{
    Device, Error, Hit, Job, Picture, Request,
    bands::{BAND, PIECE, bands},
    engine::{AS_ASKED, Engine, PassedOver, device_error, host},
    picture::opaque,
    pixels::{self, Pixels},
    source::Source,
    turns::{Turn, Turns},
};

/// Draws. One for a whole program, however many threads and scenes: it draws with `&self`, and
/// clones are free and the same.
///
/// # What it does to its host
///
/// * **Threads.** Pictures are drawn on the rayon pool that [`Renderer::draw`] is called from: the
///   global one, which rayon starts when it is first needed, unless the call is inside of an
///   `install`. [`Renderer::threads`] asks for a pool of its own instead. A [`Job`] has a thread
///   while it runs. Where as many pictures are wanted at once as the pool has threads, each is
///   drawn on one thread, of up to as many pools of one thread; these go with the renderer.
///   [`Scene::new`](crate::Scene::new), [`Camera::fit`](crate::Camera::fit) and the writers of a
///   [`Picture`] know no renderer: they run on the pool that they are called from.
/// * **Memory.** At most [`Renderer::in_flight`] pictures are under way at a time, and what drawing
///   them takes is kept for the next ones.
/// * **Nothing else.** It sets no variable, prints nothing, installs no handler and no panic hook.
///   Drivers of GPUs may read variables and print: Mesa's complains on standard error where
///   `XDG_RUNTIME_DIR` is not set, unless `NODEVICE_SELECT=1`.
///
/// A call from inside of a rayon pool draws at once, on that pool, and waits for no turn: a thread
/// of a pool that waits may hold a piece of what it waits for.
#[derive(Clone)]
pub struct Renderer(Arc<Inner>);

struct Inner {
    source: Source,
    /// What draws, and is free.
    idle: Mutex<Vec<Engine>>,
    /// Memory of pictures that were looked at, for the next ones.
    spare: Mutex<Vec<Picture>>,
    pool: Option<Arc<rayon::ThreadPool>>,
    /// Pools of one thread, free.
    lanes: Mutex<Vec<rayon::ThreadPool>>,
    turns: Arc<Turns>,
}

impl fmt::Debug for Renderer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Source { description, why, .. } = &self.0.source;
        f.debug_struct("Renderer")
            .field("device", description)
            .field("why", why)
            .field("in_flight", &self.0.turns.limit())
            .finish_non_exhaustive()
    }
}

impl Renderer {
    /// Native code: needs no driver, and cannot fail.
    pub fn cpu() -> Self {
        Self::from_source(Source::cpu(), None, None)
    }

    /// Any device.
    ///
    /// # Errors
    /// When there is none; says what was tried, and what to install.
    pub fn open(device: &Device) -> Result<Self, Error> {
        Ok(Self::from_source(Source::open(device)?, None, None))
    }

    pub(crate) fn from_source(
        source: Source,
        pool: Option<Arc<rayon::ThreadPool>>,
        limit: Option<usize>,
    ) -> Self {
        let usual = || match &pool {
            Some(pool) => pool.current_num_threads(),
            None => std::thread::available_parallelism().map_or(1, usize::from),
        };
        let turns = Turns::new(limit.unwrap_or_else(usual));
        let (idle, spare, lanes) = (Mutex::default(), Mutex::default(), Mutex::default());
        Self(Arc::new(Inner { source, idle, spare, pool, lanes, turns }))
    }

    /// With a pool of its own, of so many threads (1 to 1024; 0 is 1), in place of the caller's;
    /// and as many pictures in flight.
    ///
    /// # Errors
    /// When these are too many, or the system has no threads left.
    pub fn threads(self, threads: usize) -> Result<Self, Error> {
        const MOST: usize = 1024;
        if threads > MOST {
            return Err(Error::Size { what: "threads", found: threads as u64, limit: MOST as u64 });
        }
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads.max(1))
            .thread_name(|number| format!("planisphere {number}"))
            .build()
            .map_err(|error| Error::Threads { words: error.to_string() })?;
        Ok(Self::from_source(self.0.source.clone(), Some(Arc::new(pool)), None))
    }

    /// At most so many pictures at a time (0 is 1), first come first served: this bounds memory. As
    /// many as threads without.
    #[must_use]
    pub fn in_flight(self, pictures: usize) -> Self {
        Self::from_source(self.0.source.clone(), self.0.pool.clone(), Some(pictures))
    }

    /// What it was opened with.
    #[cfg(any(feature = "gpu", all(feature = "files", feature = "parts")))]
    pub(crate) fn source(&self) -> &Source {
        &self.0.source
    }

    /// Which device draws, in words.
    pub fn device(&self) -> &str {
        &self.0.source.description
    }

    /// Why this one: as asked for, or what was found and why it could not be used.
    pub fn why(&self) -> &str {
        &self.0.source.why
    }

    /// Its turns.
    #[cfg(all(feature = "files", feature = "parts"))]
    pub(crate) fn turns(&self) -> &Arc<Turns> {
        &self.0.turns
    }

    /// Whether people should be told why: the choice was left to the renderer, or hardware was
    /// passed over.
    pub fn is_news(&self) -> bool {
        self.0.source.device == Device::Auto || self.0.source.why != AS_ASKED
    }

    /// Threads that a picture is drawn on.
    pub(crate) fn pool_threads(&self) -> usize {
        match &self.0.pool {
            Some(pool) => pool.current_num_threads(),
            None => rayon::current_num_threads(),
        }
    }

    /// Adapters that were looked at and not taken.
    #[doc(hidden)]
    pub fn passed_over(&self) -> &[PassedOver] {
        &self.0.source.passed_over
    }

    /// Draws, and blocks until it is there.
    ///
    /// The second picture of a scene of 16,384 spheres or more puts these into an order first. That
    /// takes as long as some pictures, once, and 40 bytes a sphere for as long as the scene is
    /// there; [`Scene::prepare`](crate::Scene::prepare) does it sooner.
    ///
    /// # Errors
    /// When the device fails, memory does not suffice, or a file of the scene was changed.
    pub fn draw(&self, request: &Request) -> Result<Picture, Error> {
        let mut picture = Picture::default();
        self.draw_into(request, &mut picture)?;
        Ok(picture)
    }

    /// The same into a picture that is there already, whose memory is used again.
    ///
    /// # Errors
    /// As [`Renderer::draw`]; then the picture is empty.
    pub fn draw_into(&self, request: &Request, picture: &mut Picture) -> Result<(), Error> {
        self.with(request, &Control::new(), |engine, control| {
            fill(engine, request, picture, control)
        })
    }

    /// The same into memory of yours, such as a mapped buffer; an empty slice is a plane that is
    /// not wanted, whatever the request says.
    ///
    /// # Errors
    /// As [`Renderer::draw`], and when a slice is neither empty nor as long as the region has
    /// pixels.
    pub fn draw_to(
        &self,
        request: &Request,
        rgba: &mut [[u8; 4]],
        ids: &mut [i32],
        depth: &mut [f32],
    ) -> Result<(), Error> {
        let wanted = request.region.pixels();
        let lengths = [("colors", rgba.len()), ("ids", ids.len()), ("depths", depth.len())];
        for (what, found) in lengths {
            if found != 0 && found != wanted {
                return Err(Error::Length { what, found, wanted });
            }
        }
        self.with(request, &Control::new(), |engine, control| {
            pixels::check(request)?;
            let request = Request { ids: !ids.is_empty(), ..request.clone() };
            let (drawn, _) = planes(engine, &request, rgba, depth, control)?;
            if !ids.is_empty() {
                ids.copy_from_slice(&drawn);
            }
            engine.lend(drawn);
            Ok(())
        })
    }

    /// Bands of rows as they come, from the top, of some 33 million pixels each: of a picture that
    /// need not fit into memory as a whole. `Break` ends it after a band. The turn is held while
    /// `sink` works: it must not wait for jobs of the same renderer.
    ///
    /// # Errors
    /// As [`Renderer::draw`]; [`Error::Cancelled`] when `sink` has broken off.
    pub fn draw_bands(
        &self,
        request: &Request,
        mut sink: impl FnMut(&Picture) -> ControlFlow<()> + Send,
    ) -> Result<(), Error> {
        self.with(request, &Control::new(), |engine, control| {
            let mut picture = Picture::default();
            let whole = request.region;
            for band in bands(whole, BAND) {
                let rows = [band.y - whole.y, band.y - whole.y + band.height];
                let share = rows.map(|row| row as f32 / whole.height as f32);
                let of_band = request.band(band);
                fill(engine, &of_band, &mut picture, &control.part(share))?;
                if sink(&picture).is_break() {
                    return Err(Error::Cancelled);
                }
            }
            Ok(())
        })
    }

    /// Begins a picture, and does not block: it comes in its turn, first come first served.
    pub fn start(&self, request: Request) -> Job {
        let renderer = self.clone();
        Job::begin(&self.0.turns, request, move |request, control| {
            renderer.in_turn(request, control, |engine, control| {
                let mut picture = Picture::default();
                fill(engine, request, &mut picture, control).map(|()| picture)
            })
        })
    }

    /// The same, and makes something of the picture in the same turn, such as the bytes of a file.
    /// Then no more than [`Renderer::in_flight`] pictures are ever there at once, and each has the
    /// memory of an earlier one: what a server of many requests wants. The turn is held while
    /// `then` works: it must not wait for other jobs of the same renderer.
    pub fn start_with<T: Send + 'static>(
        &self,
        request: Request,
        then: impl FnOnce(&Picture) -> Result<T, Error> + Send + 'static,
    ) -> Job<T> {
        let renderer = self.clone();
        Job::begin(&self.0.turns, request, move |request, control| {
            renderer.in_turn(request, control, |engine, control| {
                let spare = || renderer.0.spare.lock().unwrap_or_else(PoisonError::into_inner);
                let mut picture = spare().pop().unwrap_or_default();
                fill(engine, request, &mut picture, &control.part([0.0, MADE]))?;
                picture.control = Some(control.part([MADE, 1.0]));
                let made = then(&picture);
                // The memory is kept, the scene is not.
                (picture.request, picture.control) = (None, None);
                let mut spare = spare();
                if spare.len() < renderer.0.turns.limit() {
                    spare.push(picture);
                }
                made
            })
        })
    }

    /// What is under a pixel of the whole picture, column and row from the top left, without a
    /// picture; none where nothing is. On the processor, whatever the device: the answer is the
    /// same. It waits for no turn, and counts as a picture of the scene: see [`Renderer::draw`].
    ///
    /// # Errors
    /// When the pixel is outside of the picture.
    pub fn pick(&self, request: &Request, pixel: [u32; 2]) -> Result<Option<Hit>, Error> {
        let [x, y] = pixel;
        let request = request.clone().region(Region { x, y, width: 1, height: 1 })?;
        let work = || {
            Cpu::default().on(host()).draw(request.scene.core(), &request.view(), request.region)
        };
        let drawing = match &self.0.pool {
            Some(pool) => pool.install(work),
            None => work(),
        }?;
        request.scene.check()?;
        let index = drawing.ids.first().and_then(|&id| usize::try_from(id).ok());
        Ok(index.and_then(|index| Hit::of(&request, pixel, index)))
    }

    /// Waits for a turn, and does some work with an engine.
    pub(crate) fn with<T: Send>(
        &self,
        request: &Request,
        control: &Control,
        work: impl FnOnce(&mut Engine, &Control) -> Result<T, Error> + Send,
    ) -> Result<T, Error> {
        // See `turns`: a thread of a pool does not wait, and one that holds a turn has it already.
        if rayon::current_thread_index().is_some() || HELD.get() > 0 {
            return self.on_pool(control, work);
        }
        let _turn: Turn = self.0.turns.wait();
        self.in_turn(request, control, work)
    }

    /// Work whose turn it is: on all threads, or on one of a pool of its own where enough others
    /// are wanted to keep the others busy. What all wait for, such as the order of a scene, is made
    /// by all threads.
    pub(crate) fn in_turn<T: Send>(
        &self,
        request: &Request,
        control: &Control,
        work: impl FnOnce(&mut Engine, &Control) -> Result<T, Error> + Send,
    ) -> Result<T, Error> {
        let Inner { lanes, turns, .. } = &*self.0;
        let (_held, wanted) = (Held::begin(), turns.wanted());
        let few = wanted < 2 || wanted < self.pool_threads() || turns.limit() < 2;
        if few || !request.scene.is_ready() {
            return self.on_pool(control, work);
        }
        let idle = lanes.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let lane = match idle.map_or_else(lane, Ok) {
            Ok(lane) => lane,
            // No thread to be had: the pool is there.
            Err(_) => return self.on_pool(control, work),
        };
        let result = lane.install(|| self.with_engine(control, work));
        lanes.lock().unwrap_or_else(PoisonError::into_inner).push(lane);
        result
    }

    fn on_pool<T: Send>(
        &self,
        control: &Control,
        work: impl FnOnce(&mut Engine, &Control) -> Result<T, Error> + Send,
    ) -> Result<T, Error> {
        match &self.0.pool {
            Some(pool) => pool.install(|| self.with_engine(control, work)),
            None => self.with_engine(control, work),
        }
    }

    fn with_engine<T>(
        &self,
        control: &Control,
        work: impl FnOnce(&mut Engine, &Control) -> Result<T, Error>,
    ) -> Result<T, Error> {
        let idle = || self.0.idle.lock().unwrap_or_else(PoisonError::into_inner);
        let known = idle().pop();
        let mut engine = known.unwrap_or_else(|| self.0.source.engine());
        let result = work(&mut engine, control);
        let mut idle = idle();
        // What has panicked is not used again, and more than can be under way is not kept.
        if idle.len() < self.0.turns.limit() {
            idle.push(engine);
        }
        result
    }
}

/// A pool of one thread.
fn lane() -> Result<rayon::ThreadPool, rayon::ThreadPoolBuildError> {
    let named = rayon::ThreadPoolBuilder::new().num_threads(1);
    named.thread_name(|_| "planisphere lane".into()).build()
}

/// How much of a job is done when the picture is there of which something is made.
const MADE: f32 = 0.7;

/// How much of a picture is done when its ids are there.
const DRAWN: f32 = 0.8;

/// The ids of a request's region.
pub(crate) fn drawn(
    engine: &mut Engine,
    request: &Request,
    control: &Control,
) -> Result<Drawing, Error> {
    let Request { scene, region, .. } = request;
    scene.check()?;
    engine.controlled_by(&control.part([0.0, DRAWN]));
    let drawing = engine.draw(scene.core(), &request.view(), *region);
    // Whatever came of numbers that were changed is worth nothing.
    scene.check()?;
    drawing.map_err(|error| device_error(engine, error))
}

/// Colours and depths of ids, into memory that is there: of empty slices, none.
fn finish(
    request: &Request,
    ids: &[i32],
    rgba: &mut [[u8; 4]],
    depths: &mut [f32],
    control: &Control,
) -> Result<(), Error> {
    let Request { scene, region, look, .. } = request;
    let (core, view) = (scene.core(), request.view());
    let paint = Paint { scene: core, background: look.behind() };
    let control = control.part([DRAWN, 1.0]);
    let truth = (!depths.is_empty()).then(|| Truth::new(&view, core.bounds()));
    for some in bands(*region, PIECE) {
        control.check()?;
        let start = (some.y - region.y) as usize * region.width as usize;
        let range = start..start + some.pixels();
        if !rgba.is_empty() {
            paint.fill(&ids[range.clone()], &mut rgba[range.clone()], opaque)?;
        }
        if let Some(truth) = &truth {
            let of_some = depth::depths(core, truth, some, &ids[range.clone()])?;
            depths[range.clone()].copy_from_slice(&of_some);
        }
        control.reach(range.end as f32 / region.pixels() as f32);
    }
    scene.check()
}

/// Draws a request into a picture.
fn fill(
    engine: &mut Engine,
    request: &Request,
    picture: &mut Picture,
    control: &Control,
) -> Result<(), Error> {
    let begin = Instant::now();
    pixels::check(request)?;
    check_memory(request, picture)?;
    let Picture { ids, rgba, mut depth, .. } = std::mem::take(picture);
    // Colours that follow from ids are made when they are asked for: now, where the picture before
    // was asked, or where they might be others later.
    let known = rgba.into_inner();
    let now = request.color && (known.is_some() || colors_now(request));
    let mut rgba = known.unwrap_or_default();
    let pixels = request.region.pixels();
    sized(&mut rgba, if now { pixels } else { 0 }, "colors")?;
    sized(&mut depth, if request.depth { pixels } else { 0 }, "depths")?;
    engine.lend(ids);
    let planes = planes(engine, request, &mut rgba, &mut depth, control);
    let (ids, counts) = match planes {
        Ok(planes) => planes,
        Err(error) => {
            // To give large planes back takes long: nobody waits for it.
            drop((Later::from(rgba), Later::from(depth)));
            return Err(error);
        }
    };
    let rgba = if now { rgba.into() } else { OnceLock::new() };
    let by = engine.stood_in().map(ToOwned::to_owned);
    let (request, elapsed) = (Some(request.clone()), begin.elapsed());
    let (control, indices) = (None, None);
    *picture = Picture { request, ids, rgba, depth, counts, elapsed, by, control, indices };
    Ok(())
}

/// Whether colours are made with the picture: they are more than what ids tell, or might be others
/// later.
fn colors_now(request: &Request) -> bool {
    request.color && (!request.is_plain() || request.scene.is_watched())
}

/// Draws: ids, what was met, and into memory that is there colours and depths; of empty slices,
/// none.
fn planes(
    engine: &mut Engine,
    request: &Request,
    rgba: &mut [[u8; 4]],
    depths: &mut [f32],
    control: &Control,
) -> Result<(Vec<i32>, Counts), Error> {
    let shaded = !rgba.is_empty() && !request.is_plain();
    if !shaded {
        let Drawing { ids, counts, .. } = drawn(engine, request, control)?;
        return finished(request, ids, rgba, depths, control).map(|ids| (ids, counts));
    }
    let (samples, rest) = (control.part([0.0, SAMPLED]), control.part([SAMPLED, 1.0]));
    let (mut of, mut ids) = (Pixels::new(request)?, Vec::new());
    let wanted = request.ids || !depths.is_empty();
    let with_samples = wanted && of.has_ids();
    sized(&mut ids, if with_samples { request.region.pixels() } else { 0 }, "ids")?;
    let met = of.draw(engine, request.region, &samples, rgba, &mut ids)?.counts;
    if !wanted || with_samples {
        return finished(request, ids, &mut [], depths, &rest).map(|ids| (ids, met));
    }
    let Drawing { ids, mut counts, .. } = drawn(engine, request, &rest)?;
    counts.undecided += met.undecided;
    counts.small += met.small;
    counts.exact += met.exact;
    finished(request, ids, &mut [], depths, &rest).map(|ids| (ids, counts))
}

/// Makes planes of ids, and gives these back.
fn finished(
    request: &Request,
    ids: Vec<i32>,
    rgba: &mut [[u8; 4]],
    depths: &mut [f32],
    control: &Control,
) -> Result<Vec<i32>, Error> {
    match finish(request, &ids, rgba, depths, control) {
        Ok(()) => Ok(ids),
        Err(error) => {
            // To give large planes back takes long: nobody waits for it.
            drop(Later::from(ids));
            Err(error)
        }
    }
}

/// How much of a picture is done when its samples are resolved.
const SAMPLED: f32 = 0.9;

/// Makes a plane as long as the region has pixels. Fresh memory is not touched: that takes long for
/// large planes, and is done where they are filled, by all threads.
pub(crate) fn sized<T: Copy + Default + Send + 'static>(
    plane: &mut Vec<T>,
    pixels: usize,
    name: &str,
) -> Result<(), Error> {
    if plane.capacity() < pixels {
        drop(std::mem::take(plane));
        Vec::<T>::new()
            .try_reserve_exact(pixels)
            .map_err(|_| DrawError::no_room(name, size_of::<T>(), pixels))?;
        *plane = vec![T::default(); pixels];
    }
    plane.resize(pixels, T::default());
    Ok(())
}

/// Refuses planes for which there is no memory: systems that promise more than they have end the
/// process when it is used.
fn check_memory(request: &Request, picture: &Picture) -> Result<(), Error> {
    let pixels = request.region.pixels() as u64;
    let rgba = request.color && (picture.rgba.get().is_some() || colors_now(request));
    let planes = 1 + u64::from(rgba) + u64::from(request.depth);
    let Picture { ids, depth, rgba, .. } = picture;
    let held = ids.capacity() + depth.capacity() + rgba.get().map_or(0, Vec::capacity);
    let needed = (4 * planes * pixels).saturating_sub(4 * held as u64);
    if needed < ASKED {
        return Ok(());
    }
    match planisphere_memory::available() {
        Some(available) if needed > available => {
            let words = format!(
                "the planes of the picture take {} of memory, and {} is available; draw it in \
                 regions or bands, or free some memory",
                text::bytes(needed),
                text::bytes(available)
            );
            Err(Error::Memory { needed: Some(needed), available: Some(available), words })
        }
        _ => Ok(()),
    }
}

/// Bytes from which on the system is asked whether it has them.
const ASKED: u64 = 64 << 20;

thread_local! {
    /// Turns that this thread holds.
    static HELD: Cell<usize> = const { Cell::new(0) };
}

/// A turn that this thread holds, until dropped.
struct Held;

impl Held {
    fn begin() -> Self {
        HELD.set(HELD.get() + 1);
        Self
    }
}

impl Drop for Held {
    fn drop(&mut self) {
        HELD.set(HELD.get() - 1);
    }
}
