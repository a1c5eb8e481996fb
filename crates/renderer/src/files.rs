//! The way of a picture into files: PNG, ids, depths and what merging needs, band by band where the
//! picture is so large that not even its ids should lie in memory.
//!
//! Anything that gives ids, band by band, goes this way: a renderer, or parts that are merged.
//! Files get their names when all of them are whole ([`Staged::commit`]).

use std::{io::Write, sync::Arc, time::Instant};

use planisphere_core::{
    camera::Region,
    drawing::{Control, Counts, Times},
    part::{
        Part as CorePart,
        merge::{Merge, MergeError, Ties},
    },
};
use planisphere_image::look::LookError;
use planisphere_io::{
    npy,
    npy::Plane,
    output,
    output::{Shared, Sink},
    picture::{About, Encoder, Rows},
    png,
    png::{PaletteError, PngRows},
};
pub use planisphere_io::{output::Target, picture::Kind};

use crate::{
    Error, Job, Renderer, Request,
    bands::{PIECE, bands},
    engine::Engine,
    parts::{PartPlane, merged, of_request},
    picture::opaque,
    pixels::{self, Pixels},
    renderer::{drawn, sized},
    subject::{Indices, Subject},
};

/// Where the planes of a picture go; none is a plane that is not wanted.
///
/// ```no_run
/// # use planisphere_renderer as planisphere;
/// use planisphere::files::{Sinks, Target};
/// # fn main() -> Result<(), planisphere::Error> {
/// # let scene = planisphere::Scene::new(Default::default())?;
/// # let camera = planisphere::Camera::isometric();
///
/// // A picture that need not fit into memory.
/// let request = planisphere::Request::new(&scene, camera, [20_000, 20_000])?;
/// let mut sinks = Sinks::default();
/// sinks.picture = Some(Target::File("large.png".into()));
/// sinks.depth = Some(Target::File("large.npy".into()));
/// let (staged, report) = planisphere::Renderer::cpu().render(&request, &sinks, &mut |_| {})?;
/// println!("drawn in {:.0} ms", report.times.render);
/// staged.commit()?;
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub struct Sinks {
    /// The colours.
    pub picture: Option<Target>,
    /// Its format.
    pub kind: Kind,
    /// Whether that has a palette.
    pub palette: bool,
    /// The indices of the spheres, as `.npy`.
    pub ids: Option<Target>,
    /// The distances, as `.npy`.
    pub depth: Option<Target>,
    /// All that merging needs, as `.npz`.
    pub part: Option<Target>,
    /// Index, in the whole, of the first sphere of the scene: for [`Sinks::part`].
    pub first: u64,
}

/// What is being done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Step {
    /// Ids are found.
    Drawing,
    /// Parts are merged.
    Merging,
    /// Distances are worked out.
    Depths,
    /// Planes become bytes.
    Encoding,
}

/// Bytes that are whole, and wait for their names.
#[must_use = "files have no names until they are committed"]
#[derive(Debug)]
pub struct Staged(Vec<output::Staged>);

impl Staged {
    /// Gives every file its name: together or, short of a failing rename, not at all. What is worth
    /// saying comes back, a line each.
    ///
    /// # Errors
    /// When the system refuses.
    pub fn commit(self) -> Result<Vec<String>, Error> {
        output::commit(self.0).map_err(Error::from)
    }
}

/// What was done on the way.
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub struct Report {
    /// What drawing has met.
    pub counts: Counts,
    /// Milliseconds of drawing.
    pub times: Times,
    /// Milliseconds of samples to pixels.
    pub shade: f64,
    /// Milliseconds of distances.
    pub depth: f64,
    /// Milliseconds of planes to bytes.
    pub encode: f64,
    /// Whether any sphere is seen.
    pub seen: bool,
    /// What drew the picture, where that was not the renderer's own device, and why.
    pub drawn_by: Option<String>,
}

impl Renderer {
    /// Draws into files, band by band, so that a picture of any size takes little memory. `told`
    /// hears what is being done, in turn.
    ///
    /// # Errors
    /// As [`Renderer::draw`], and when a file cannot be written: then none of them is there.
    pub fn render(
        &self,
        request: &Request,
        sinks: &Sinks,
        told: &mut (dyn FnMut(Step) + Send),
    ) -> Result<(Staged, Report), Error> {
        self.with(request, &Control::new(), |engine, control| {
            rendered(engine, request, sinks, told, control)
        })
    }

    /// The same as a job, in its turn.
    pub fn start_render(&self, request: Request, sinks: Sinks) -> Job<(Staged, Report)> {
        let renderer = self.clone();
        Job::begin(self.turns(), request, move |request, control| {
            renderer.in_turn(request, control, |engine, control| {
                rendered(engine, request, &sinks, &mut |_| {}, control)
            })
        })
    }
}

/// As [`Renderer::render`].
fn rendered(
    engine: &mut Engine,
    request: &Request,
    sinks: &Sinks,
    told: &mut dyn FnMut(Step),
    control: &Control,
) -> Result<(Staged, Report), Error> {
    pixels::check(request)?;
    let mut report = Report::default();
    let shaded = sinks.picture.is_some() && !request.is_plain();
    if shaded && sinks.palette {
        let words = "holds flat colours without anything over them; write the picture as RGB";
        return Err(LookError { what: "a palette", words: words.into() }.into());
    }
    let pixels = shaded.then(|| Pixels::new(request)).transpose()?;
    let mut source = Drawn { engine, request, pixels };
    let staged = of_request(request, sinks.first, control, |subject| {
        write(sinks, subject, &mut report, told, &mut source)
    })?;
    Ok((staged, report))
}

/// Gives what a picture is made of, band by band; it may be cancelled.
trait Source {
    /// The spheres of the scene that are seen, -1 for none.
    fn ids(
        &mut self,
        band: Region,
        control: &Control,
        report: &mut Report,
        told: &mut dyn FnMut(Step),
    ) -> Result<Vec<i32>, Error>;

    /// Whether pixels have alpha, where they are more than what ids tell.
    fn shaded(&self) -> Option<bool>;

    /// Pixels of a look, where they are more than what ids tell.
    fn pixels(
        &mut self,
        band: Region,
        control: &Control,
        report: &mut Report,
        told: &mut dyn FnMut(Step),
    ) -> Result<Vec<[u8; 4]>, Error>;
}

/// Drawn by an engine.
struct Drawn<'a> {
    engine: &'a mut Engine,
    request: &'a Request,
    pixels: Option<Pixels<'a>>,
}

impl Drawn<'_> {
    fn note(&self, counts: &Counts, times: &Times, report: &mut Report) {
        report.counts.add(counts);
        report.times.add(times);
        if let Some(by) = self.engine.stood_in() {
            report.drawn_by = Some(by.into());
        }
    }
}

impl Source for Drawn<'_> {
    fn ids(
        &mut self,
        band: Region,
        control: &Control,
        report: &mut Report,
        told: &mut dyn FnMut(Step),
    ) -> Result<Vec<i32>, Error> {
        told(Step::Drawing);
        let of_band = Request { region: band, ..self.request.clone() };
        let drawing = drawn(self.engine, &of_band, control)?;
        self.note(&drawing.counts, &drawing.times, report);
        // Ends at the first sphere.
        report.seen = report.seen || drawing.ids.iter().any(|id| *id >= 0);
        Ok(drawing.ids)
    }

    fn shaded(&self) -> Option<bool> {
        self.pixels.as_ref().map(|_| self.request.look.is_transparent())
    }

    fn pixels(
        &mut self,
        band: Region,
        control: &Control,
        report: &mut Report,
        told: &mut dyn FnMut(Step),
    ) -> Result<Vec<[u8; 4]>, Error> {
        let Some(of) = &mut self.pixels else { return Ok(Vec::new()) };
        told(Step::Drawing);
        let mut pixels = Vec::new();
        sized(&mut pixels, band.pixels(), "colors")?;
        let spent = of.draw(self.engine, band, control, &mut pixels, &mut [])?;
        self.note(&spent.counts, &spent.times, report);
        report.shade += spent.shade;
        report.seen |= spent.seen;
        Ok(pixels)
    }
}

fn timed<T>(total: &mut f64, work: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let result = work();
    *total += start.elapsed().as_secs_f64() * 1e3;
    result
}

/// Draws band by band, from the top, and writes what is wanted. Files get their names when they are
/// committed.
fn write(
    sinks: &Sinks,
    subject: &Subject,
    report: &mut Report,
    told: &mut dyn FnMut(Step),
    source: &mut dyn Source,
) -> Result<Staged, Error> {
    let open = |target: &Option<Target>| target.clone().map(Target::open).transpose();
    let open = |target| open(target).map_err(Error::from);
    let ids = sinks.ids.as_ref().map(|target| Ids::begin(target, subject)).transpose()?;
    let depths = sinks.depth.as_ref().map(|target| Depths::begin(target, subject)).transpose()?;
    let mut part_sink = open(&sinks.part)?;
    let part = sinks.part.as_ref().zip(part_sink.as_mut());
    let part = part.map(|(target, sink)| Part::begin(target, sink, subject)).transpose()?;
    let mut png_sink = open(&sinks.picture)?;
    let colors = sinks.picture.as_ref().zip(png_sink.as_mut());
    let shaded = source.shaded();
    let colors = colors.map(|(target, sink)| match sinks.palette {
        true => Ok(Colors::palette(target, sink)),
        false => Colors::rows(target, sink, subject, sinks, shaded),
    });
    let colors = colors.transpose()?;
    let by_pixels = shaded.is_some() && colors.is_some();
    let by_ids = [&sinks.ids, &sinks.depth, &sinks.part].iter().any(|sink| sink.is_some());
    let by_ids = by_ids || !by_pixels;
    let mut planes = Planes { subject, depths, part, ids, colors };

    let whole = subject.meta.region;
    for band in bands(whole, subject.band) {
        let rows = [band.y - whole.y, band.y - whole.y + band.height];
        let control = subject.control.part(rows.map(|row| row as f32 / whole.height as f32));
        let half = if by_pixels && by_ids { 0.9 } else { f32::from(u8::from(by_pixels)) };
        let (first, rest) = (control.part([0.0, half]), control.part([half, 1.0]));
        if by_pixels {
            let pixels = source.pixels(band, &first, report, told)?;
            told(Step::Encoding);
            timed(&mut report.encode, || planes.take_pixels(pixels))?;
        }
        if by_ids {
            let ids = source.ids(band, &rest, report, told)?;
            planes.take(band, ids, report, told)?;
        }
        control.reach(1.0);
    }

    told(Step::Encoding);
    let start = Instant::now();
    let (ids_sink, depth_sink) = planes.finish()?;
    let mut staged = Vec::new();
    for sink in [png_sink, ids_sink, depth_sink, part_sink].into_iter().flatten() {
        staged.push(sink.finish().map_err(Error::from)?);
    }
    report.encode += start.elapsed().as_secs_f64() * 1e3;
    Ok(Staged(staged))
}

/// The planes that are wanted, on their way out.
struct Planes<'a> {
    subject: &'a Subject<'a>,
    depths: Option<Depths<'a>>,
    part: Option<Part<'a>>,
    ids: Option<Ids<'a>>,
    colors: Option<Colors<'a>>,
}

impl Planes<'_> {
    /// Takes the ids of the next band.
    fn take(
        &mut self,
        band: Region,
        ids: Vec<i32>,
        spent: &mut Report,
        told: &mut dyn FnMut(Step),
    ) -> Result<(), Error> {
        if let Some(depths) = &mut self.depths {
            told(Step::Depths);
            depths.take(self.subject, band, &ids, spent)?;
        }
        told(Step::Encoding);
        if let Some(part) = &mut self.part {
            part.take(self.subject, band, &ids, spent)?;
        }
        timed(&mut spent.encode, || {
            let ids = Arc::new(Plane(ids));
            if let Some(plane) = &mut self.ids {
                plane.take(&ids)?;
            }
            match &mut self.colors {
                Some(colors) => colors.take(ids, self.subject),
                None => Ok(()),
            }
        })
    }

    /// Takes the pixels of the next band.
    fn take_pixels(&mut self, pixels: Vec<[u8; 4]>) -> Result<(), Error> {
        match &mut self.colors {
            Some(colors) => colors.take_pixels(&pixels, self.subject),
            None => Ok(()),
        }
    }

    /// Ends the picture and the part, and gives back where ids and depths have gone.
    fn finish(self) -> Result<(Option<Sink>, Option<Sink>), Error> {
        if let Some(colors) = self.colors {
            colors.finish(self.subject)?;
        }
        if let Some(part) = self.part {
            part.finish(self.subject)?;
        }
        Ok((self.ids.map(|ids| ids.sink), self.depths.map(|depths| depths.sink)))
    }
}

/// Begins an array of a picture's pixels, of a type.
fn array(target: &Target, descr: &str, subject: &Subject) -> Result<Sink, Error> {
    let Region { width, height, .. } = subject.meta.region;
    let mut sink = target.clone().open()?;
    let header = npy::header(descr, &[height as usize, width as usize]);
    sink.write_all(&header).map_err(|error| target.io(error))?;
    Ok(sink)
}

/// The array of ids.
struct Ids<'a> {
    target: &'a Target,
    sink: Sink,
    numbers: Numbers<'a>,
}

/// The ids that the reader knows.
enum Numbers<'a> {
    /// The scene's own.
    Own,
    /// Those of the whole, of 4 bytes.
    Four(&'a Indices<'a>),
    /// The same, of 8 bytes, which some take.
    Eight(&'a Indices<'a>),
}

impl<'a> Ids<'a> {
    /// Begins the array.
    fn begin(target: &'a Target, subject: &'a Subject) -> Result<Self, Error> {
        let indices = &subject.indices;
        let wide = subject.meta.last().is_some_and(|last| last > i32::MAX as u64);
        let (descr, numbers) = match indices {
            Indices::From { .. } => ("<i4", Numbers::Own),
            Indices::Each(_) if wide => ("<i8", Numbers::Eight(indices)),
            Indices::Each(_) => ("<i4", Numbers::Four(indices)),
        };
        Ok(Self { target, sink: array(target, descr, subject)?, numbers })
    }

    /// Takes the next ids.
    fn take(&mut self, ids: &Arc<Plane<i32>>) -> Result<(), Error> {
        let all = ids.0.iter();
        let bytes: Shared = match self.numbers {
            Numbers::Own => ids.clone(),
            Numbers::Four(indices) => {
                Arc::new(Plane::<i32>(all.map(|&id| indices.of_id(id) as i32).collect()))
            }
            Numbers::Eight(indices) => {
                Arc::new(Plane::<i64>(all.map(|&id| indices.of_id(id)).collect()))
            }
        };
        Ok(self.sink.give(bytes).map_err(|error| self.target.io(error))?)
    }
}

/// The array of distances.
struct Depths<'a> {
    target: &'a Target,
    sink: Sink,
}

impl<'a> Depths<'a> {
    /// Begins the array.
    fn begin(target: &'a Target, subject: &Subject) -> Result<Self, Error> {
        Ok(Self { target, sink: array(target, "<f4", subject)? })
    }

    /// Works out the next distances.
    fn take(
        &mut self,
        subject: &Subject,
        band: Region,
        ids: &[i32],
        spent: &mut Report,
    ) -> Result<(), Error> {
        let plane = timed(&mut spent.depth, || subject.depths(band, ids))?;
        let given = timed(&mut spent.encode, || self.sink.give(Arc::new(Plane(plane))));
        Ok(given.map_err(|error| self.target.io(error))?)
    }
}

/// What merging needs.
struct Part<'a> {
    target: &'a Target,
    plane: PartPlane<'a, &'a mut Sink>,
}

impl<'a> Part<'a> {
    /// Begins the archive.
    fn begin(target: &'a Target, sink: &'a mut Sink, subject: &'a Subject) -> Result<Self, Error> {
        let plane = PartPlane::begin(sink, subject).map_err(|error| target.io(error))?;
        Ok(Self { target, plane })
    }

    /// Works out what is between the distances of the next pixels.
    fn take(
        &mut self,
        subject: &Subject,
        band: Region,
        ids: &[i32],
        spent: &mut Report,
    ) -> Result<(), Error> {
        // Bounds take four times the memory of ids: some rows at a time.
        for some in bands(band, PIECE) {
            subject.control.check()?;
            let start = (some.y - band.y) as usize * band.width as usize;
            let ids = &ids[start..start + some.pixels()];
            let bounds = timed(&mut spent.depth, || PartPlane::<Sink>::bounds(subject, some, ids))?;
            timed(&mut spent.encode, || self.plane.take(subject, ids, bounds))
                .map_err(|error| self.target.io(error))?;
        }
        Ok(())
    }

    /// Ends the archive, with the spheres that are seen.
    fn finish(self, subject: &Subject) -> Result<(), Error> {
        Ok(self.plane.finish(subject).map_err(|error| self.target.io(error))?)
    }
}

/// The colours.
struct Colors<'a> {
    target: &'a Target,
    form: Form<'a>,
}

/// How colours are written.
enum Form<'a> {
    /// Row by row, from ids.
    Flat(PngRows<'a, &'a mut Sink>),
    /// Row by row, as pixels; whether these come, or are ids.
    Pixels(Encoder<&'a mut Sink>, bool),
    /// With a palette, which takes all colours before the first row.
    Palette { sink: &'a mut Sink, all: Arc<Plane<i32>> },
}

impl<'a> Colors<'a> {
    /// Begins a picture whose rows come one after the other.
    fn rows(
        target: &'a Target,
        sink: &'a mut Sink,
        subject: &'a Subject,
        sinks: &Sinks,
        shaded: Option<bool>,
    ) -> Result<Self, Error> {
        let Region { width, height, .. } = subject.meta.region;
        let (size, alpha) = ([width, height], shaded.unwrap_or(false));
        let form = if sinks.kind == Kind::Png && shaded.is_none() {
            let rows = PngRows::new(sink, subject.meta.region, subject.paint());
            Form::Flat(rows.map_err(|error| target.io(error))?)
        } else {
            let about = About { size, alpha, ..About::default() };
            let encoder = Encoder::new(sink, sinks.kind, &about);
            Form::Pixels(encoder.map_err(|error| target.io(error))?, shaded.is_some())
        };
        Ok(Self { target, form })
    }

    /// A picture with a palette.
    fn palette(target: &'a Target, sink: &'a mut Sink) -> Self {
        let all = Arc::new(Plane(Vec::new()));
        Self { target, form: Form::Palette { sink, all } }
    }

    /// Takes the next ids.
    fn take(&mut self, ids: Arc<Plane<i32>>, subject: &Subject) -> Result<(), Error> {
        let width = subject.meta.region.width as usize;
        // Some at a time, so that it can be cancelled: the bytes are the same.
        let piece = (PIECE / width).max(1) * width;
        match &mut self.form {
            Form::Flat(rows) => {
                for some in ids.0.chunks(piece) {
                    subject.control.check()?;
                    rows.push(some).map_err(|error| self.target.io(error))?;
                }
            }
            Form::Pixels(_, true) => {}
            Form::Pixels(encoder, false) => {
                let mut pixels = Vec::new();
                for some in ids.0.chunks(piece) {
                    subject.control.check()?;
                    pixels.resize(some.len(), [0; 4]);
                    subject.paint().fill(some, &mut pixels, opaque)?;
                    let pushed = encoder.push(Rows::Eight(&pixels));
                    pushed.map_err(|error| self.target.io(error))?;
                }
            }
            // One band is the usual case, and is not copied.
            Form::Palette { all, .. } if all.0.is_empty() => *all = ids,
            Form::Palette { all, .. } => {
                let all = &mut Arc::make_mut(all).0;
                all.reserve_exact(subject.meta.region.pixels() - all.len());
                all.extend_from_slice(&ids.0);
            }
        }
        Ok(())
    }

    /// Takes the next pixels.
    fn take_pixels(&mut self, pixels: &[[u8; 4]], subject: &Subject) -> Result<(), Error> {
        let Form::Pixels(encoder, true) = &mut self.form else { return Ok(()) };
        let width = subject.meta.region.width as usize;
        for some in pixels.chunks((PIECE / width).max(1) * width) {
            subject.control.check()?;
            encoder.push(Rows::Eight(some)).map_err(|error| self.target.io(error))?;
        }
        Ok(())
    }

    /// Ends the picture.
    fn finish(self, subject: &Subject) -> Result<(), Error> {
        let Self { target, form } = self;
        match form {
            Form::Flat(rows) => Ok(rows.finish().map_err(|error| target.io(error))?),
            Form::Pixels(encoder, _) => Ok(encoder.finish().map_err(|error| target.io(error))?),
            Form::Palette { sink, all } => {
                let written =
                    png::write_palette_png(sink, subject.meta.region, &all.0, &subject.paint());
                written.map_err(|error| match error {
                    PaletteError::Io(error) => target.io(error).into(),
                    PaletteError::TooManyColors => Error::Palette,
                })
            }
        }
    }
}

/// Parts that fit together, on their way into files.
pub struct Merging<'a>(Merge<'a>);

impl std::fmt::Debug for Merging<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Merging").field("region", &self.region()).finish_non_exhaustive()
    }
}

impl<'a> Merging<'a> {
    /// Of parts, in a region: what is given or, without, the least that holds all parts. `whole`:
    /// their spheres must be all, from the first on.
    ///
    /// # Errors
    /// When they do not fit together, or something is missing.
    #[doc(hidden)]
    pub fn new(parts: &'a [CorePart], region: Option<Region>, whole: bool) -> Result<Self, Error> {
        let merge = Merge::new(parts, region)?;
        if whole {
            merge.check_gaps()?;
        }
        Ok(Self(merge))
    }

    /// Columns and rows of the picture that parts are of.
    ///
    /// # Errors
    /// When there is no part.
    #[doc(hidden)]
    pub fn size(parts: &[CorePart]) -> Result<[u32; 2], Error> {
        let first = parts.first().ok_or(MergeError::Nothing)?;
        let image = first.meta.view.image;
        Ok([image.width, image.height])
    }

    /// The pixels that are merged.
    pub fn region(&self) -> Region {
        self.0.meta().region
    }

    /// Spheres that were drawn in the parts, and of these the ones that any part shows.
    pub fn spheres(&self) -> [u64; 2] {
        let drawn = self.0.meta().ranges.iter().map(|range| range.end - range.start).sum();
        [drawn, self.0.scene().len() as u64]
    }

    /// Merges into files, band by band; as [`Renderer::render`]. Gives also how often bounds of
    /// distances did not tell which of two spheres is nearer: pairs, and signs of these that took
    /// integers of any size.
    ///
    /// # Errors
    /// When a part contradicts itself, or a file cannot be written: then none of them is there.
    pub fn render(
        &self,
        sinks: &Sinks,
        told: &mut dyn FnMut(Step),
    ) -> Result<(Staged, Report, [u64; 2]), Error> {
        let Self(merge) = self;
        let (mut report, mut ties) = (Report::default(), Ties::default());
        let mut source = Merged { merge, ties: &mut ties };
        let staged = merged(merge, &Control::new(), |subject| {
            write(sinks, subject, &mut report, told, &mut source)
        })?;
        Ok((staged, report, [ties.pairs, ties.exact]))
    }
}

/// Merged from parts.
struct Merged<'a, 'b> {
    merge: &'a Merge<'b>,
    ties: &'a mut Ties,
}

impl Source for Merged<'_, '_> {
    fn ids(
        &mut self,
        band: Region,
        _: &Control,
        report: &mut Report,
        told: &mut dyn FnMut(Step),
    ) -> Result<Vec<i32>, Error> {
        told(Step::Merging);
        let begin = Instant::now();
        let band = self.merge.band(band)?;
        report.times.render += begin.elapsed().as_secs_f64() * 1e3;
        self.ties.pairs += band.ties.pairs;
        self.ties.exact += band.ties.exact;
        report.seen = report.seen || band.ids.iter().any(|id| *id >= 0);
        Ok(band.ids)
    }

    fn shaded(&self) -> Option<bool> {
        None
    }

    fn pixels(
        &mut self,
        _: Region,
        _: &Control,
        _: &mut Report,
        _: &mut dyn FnMut(Step),
    ) -> Result<Vec<[u8; 4]>, Error> {
        Ok(Vec::new())
    }
}
