//! The way of a picture into files: colours in any format, planes of numbers and what merging
//! needs, band by band where the picture is so large that not even its ids should lie in memory.
//!
//! Anything that gives ids, band by band, goes this way: a renderer, or parts that are merged.
//! Files get their names when all of them are whole ([`Staged::commit`]).

use std::{sync::Arc, time::Instant};

pub use crate::{about::Metadata, spent::Report};
use planisphere_core::{
    camera::Region,
    drawing::{Control, Counts, Times},
    part::{
        Part as CorePart,
        merge::{Merge, MergeError, Ties},
    },
};
use planisphere_image::{
    form::Form as OfPixels,
    look::{Look, LookError},
};
use planisphere_io::{
    npy::Plane,
    output,
    output::Sink,
    picture::{About, Encoder, Rows},
    png,
    png::{PaletteError, PngRows},
};
pub use planisphere_io::{output::Target, picture::Kind};

#[cfg(feature = "exr")]
use crate::planes::Exr;
use crate::{
    Error, Job, Renderer, Request,
    bands::{PIECE, bands},
    engine::Engine,
    parts::{PartPlane, merged, of_request},
    picture::opaque,
    pixels::{self, Pixels},
    planes::{All, Array, Data},
    renderer::{drawn, sized},
    subject::Subject,
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
    /// Unit vectors from the spheres' centres to the points that are seen, in the world, as `.npy`:
    /// float32 (height, width, 3). Zeros where nothing is seen.
    pub normals: Option<Target>,
    /// The points that are seen, in the world, as `.npy`: float32 (height, width, 3). NaN where
    /// nothing is seen.
    pub positions: Option<Target>,
    /// Ids, depths, normals and positions in one file, as `.npz`: `ids`, `depth`, `normals` and
    /// `positions`. The ids of all pixels wait in memory.
    pub planes: Option<Target>,
    /// All that merging needs, as `.npz`.
    pub part: Option<Target>,
    /// Index, in the whole, of the first sphere of the scene: for [`Sinks::part`].
    pub first: u64,
    /// Whether the picture has 16 bits a channel, in formats that hold them
    /// ([`Kind::holds_depth16`]); else 8.
    pub depth16: bool,
    /// Pixels per inch that the picture says it has, in formats that hold it ([`Kind::holds_dpi`]).
    pub dpi: Option<f64>,
    /// What the picture says of itself, in formats that hold texts; nothing without.
    pub metadata: Option<Metadata>,
}

impl Sinks {
    /// Begins the arrays that are wanted.
    fn arrays<'a>(&'a self, subject: &Subject) -> Result<Vec<Array<'a>>, Error> {
        let all = [
            (&self.ids, Data::Ids),
            (&self.depth, Data::Depth),
            (&self.normals, Data::Normals),
            (&self.positions, Data::Positions),
        ];
        let wanted = all.into_iter().filter_map(|(target, data)| Some((target.as_ref()?, data)));
        wanted.map(|(target, data)| Array::begin(target, data, subject)).collect()
    }

    /// Whether something beside colours is wanted.
    fn needs_ids(&self) -> bool {
        let Self { ids, depth, normals, positions, planes, part, .. } = self;
        let any = [ids, depth, normals, positions, planes, part].iter().any(|to| to.is_some());
        any || self.picture.is_some() && self.kind == Kind::Exr
    }

    /// What the picture's channels hold.
    fn channels(&self) -> Depth {
        match self.kind {
            Kind::Exr => Depth::Linear,
            _ if self.depth16 => Depth::Sixteen,
            _ => Depth::Eight,
        }
    }
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
    let deep = sinks.depth16 || sinks.kind == Kind::Exr;
    let shaded = sinks.picture.is_some() && (deep || !request.is_plain());
    if sinks.kind == Kind::Exr && request.look.is_encoded() {
        let words = "is encoded, and an OpenEXR picture holds linear light; leave it out";
        return Err(LookError { what: "aa_space", words: words.into() }.into());
    }
    #[cfg(feature = "overlay")]
    if deep && request.overlay.is_some() {
        let words = "is drawn over 8 bits a channel; leave it out, or write a .png without 16 bits";
        return Err(LookError { what: "what is over the picture", words: words.into() }.into());
    }
    if shaded && sinks.palette {
        let words = "holds flat colours without anything over them; write the picture as RGB";
        return Err(LookError { what: "a palette", words: words.into() }.into());
    }
    let pixels = shaded.then(|| Pixels::new(request)).transpose()?;
    let keeps = sinks.needs_ids();
    let mut source = Drawn { engine, request, pixels, keeps, ids: Vec::new() };
    let staged = of_request(request, sinks.first, control, |subject| {
        write(sinks, &request.look, subject, &mut report, told, &mut source)
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
        depth: Depth,
        control: &Control,
        report: &mut Report,
        told: &mut dyn FnMut(Step),
    ) -> Result<Deep, Error>;
}

/// What a picture's channels hold.
#[derive(Clone, Copy)]
enum Depth {
    Eight,
    Sixteen,
    Linear,
}

/// Pixels of one of these.
enum Deep {
    Eight(Vec<[u8; 4]>),
    Sixteen(Vec<[u16; 4]>),
    Linear(Vec<[f32; 4]>),
}

impl Deep {
    /// So many pixels at a time, at most, as encoders take them; none of linear light.
    fn rows(&self, piece: usize) -> Box<dyn Iterator<Item = Rows<'_>> + '_> {
        match self {
            Self::Eight(pixels) => Box::new(pixels.chunks(piece).map(Rows::Eight)),
            Self::Sixteen(pixels) => Box::new(pixels.chunks(piece).map(Rows::Sixteen)),
            Self::Linear(_) => Box::new(std::iter::empty()),
        }
    }
}

/// Drawn by an engine.
struct Drawn<'a> {
    engine: &'a mut Engine,
    request: &'a Request,
    pixels: Option<Pixels<'a>>,
    /// Whether ids are wanted, too: those of pixels of one sample are kept until they are asked
    /// for.
    keeps: bool,
    ids: Vec<i32>,
}

impl Drawn<'_> {
    /// Pixels of one form.
    fn of_form<P: OfPixels + 'static>(
        &mut self,
        band: Region,
        control: &Control,
        report: &mut Report,
    ) -> Result<Vec<P>, Error> {
        let Some(of) = &mut self.pixels else { return Ok(Vec::new()) };
        let mut pixels = Vec::new();
        sized(&mut pixels, band.pixels(), "colors")?;
        let keeps = self.keeps && of.has_ids();
        sized(&mut self.ids, if keeps { band.pixels() } else { 0 }, "ids")?;
        let spent = of.draw(self.engine, band, control, &mut pixels, &mut self.ids)?;
        self.note(&spent.counts, &spent.times, report);
        report.shade += spent.shade;
        report.seen |= spent.seen;
        Ok(pixels)
    }

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
        if !self.ids.is_empty() {
            return Ok(std::mem::take(&mut self.ids));
        }
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
        depth: Depth,
        control: &Control,
        report: &mut Report,
        told: &mut dyn FnMut(Step),
    ) -> Result<Deep, Error> {
        told(Step::Drawing);
        Ok(match depth {
            Depth::Eight => Deep::Eight(self.of_form(band, control, report)?),
            Depth::Sixteen => Deep::Sixteen(self.of_form(band, control, report)?),
            Depth::Linear => Deep::Linear(self.of_form(band, control, report)?),
        })
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
    look: &Look,
    subject: &Subject,
    report: &mut Report,
    told: &mut dyn FnMut(Step),
    source: &mut dyn Source,
) -> Result<Staged, Error> {
    let open = |target: &Option<Target>| target.clone().map(Target::open).transpose();
    let open = |target| open(target).map_err(Error::from);
    let arrays = sinks.arrays(subject)?;
    let all = sinks.planes.as_ref().map(|target| All::begin(target, subject)).transpose()?;
    let mut part_sink = open(&sinks.part)?;
    let part = sinks.part.as_ref().zip(part_sink.as_mut());
    let part = part.map(|(target, sink)| Part::begin(target, sink, subject)).transpose()?;
    let mut png_sink = open(&sinks.picture)?;
    let colors = sinks.picture.as_ref().zip(png_sink.as_mut());
    let shaded = source.shaded();
    let metadata = sinks.metadata.as_ref().filter(|_| sinks.picture.is_some());
    let text = metadata.map_or(Vec::new(), |metadata| metadata.texts(subject, look));
    let Region { width, height, .. } = subject.meta.region;
    let (size, alpha, dpi) = ([width, height], shaded.unwrap_or(false), sinks.dpi);
    let about = About { size, alpha, depth16: sinks.depth16, dpi, text: &text };
    let colors = colors.map(|(target, sink)| match sinks.palette {
        true => Ok(Colors::palette(target, sink, about)),
        false => Colors::rows(target, sink, subject, sinks.kind, about, shaded.is_some()),
    });
    let colors = colors.transpose()?;
    let depth = sinks.channels();
    let by_pixels = shaded.is_some() && colors.is_some();
    let by_ids = sinks.needs_ids() || !by_pixels;
    let mut planes = Planes { subject, part, arrays, all, colors };

    let whole = subject.meta.region;
    for band in bands(whole, subject.band) {
        let rows = [band.y - whole.y, band.y - whole.y + band.height];
        let control = subject.control.part(rows.map(|row| row as f32 / whole.height as f32));
        let half = if by_pixels && by_ids { 0.9 } else { f32::from(u8::from(by_pixels)) };
        let (first, rest) = (control.part([0.0, half]), control.part([half, 1.0]));
        if by_pixels {
            let pixels = source.pixels(band, depth, &first, report, told)?;
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
    let sinks = planes.finish(report)?;
    let mut staged = Vec::new();
    for sink in png_sink.into_iter().chain(sinks).chain(part_sink) {
        staged.push(sink.finish().map_err(Error::from)?);
    }
    report.encode += start.elapsed().as_secs_f64() * 1e3;
    Ok(Staged(staged))
}

/// The planes that are wanted, on their way out.
struct Planes<'a> {
    subject: &'a Subject<'a>,
    part: Option<Part<'a>>,
    arrays: Vec<Array<'a>>,
    all: Option<All<'a>>,
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
        if self.arrays.iter().any(|array| array.data != Data::Ids) {
            told(Step::Depths);
        }
        let ids = Arc::new(Plane(ids));
        for array in &mut self.arrays {
            array.take(self.subject, band, &ids, spent)?;
        }
        told(Step::Encoding);
        if let Some(part) = &mut self.part {
            part.take(self.subject, band, &ids.0, spent)?;
        }
        timed(&mut spent.encode, || {
            if let Some(all) = &mut self.all {
                all.take(&ids.0);
            }
            match &mut self.colors {
                Some(colors) => colors.take(ids, self.subject),
                None => Ok(()),
            }
        })
    }

    /// Takes the pixels of the next band.
    fn take_pixels(&mut self, pixels: Deep) -> Result<(), Error> {
        match &mut self.colors {
            Some(colors) => colors.take_pixels(&pixels, self.subject),
            None => Ok(()),
        }
    }

    /// Ends the picture and the part, and gives back where the planes have gone.
    fn finish(self, spent: &mut Report) -> Result<Vec<Sink>, Error> {
        if let Some(colors) = self.colors {
            colors.finish(self.subject)?;
        }
        if let Some(part) = self.part {
            part.finish(self.subject)?;
        }
        let mut sinks: Vec<Sink> = self.arrays.into_iter().map(|array| array.sink).collect();
        if let Some(all) = self.all {
            sinks.push(all.finish(self.subject, spent)?);
        }
        Ok(sinks)
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
    /// In linear light, with all planes.
    #[cfg(feature = "exr")]
    Exr(Exr<'a>),
    /// With a palette, which takes all colours before the first row.
    Palette { sink: &'a mut Sink, about: About<'a>, all: Arc<Plane<i32>> },
}

impl<'a> Colors<'a> {
    /// Begins a picture whose rows come one after the other.
    fn rows(
        target: &'a Target,
        sink: &'a mut Sink,
        subject: &'a Subject,
        kind: Kind,
        about: About<'a>,
        shaded: bool,
    ) -> Result<Self, Error> {
        if !shaded && (about.depth16 || kind == Kind::Exr) {
            let words = "is merged from ids, which have colours of 8 bits; name it .png, .tif, \
                         .webp, .qoi or .jpg, of 8 bits";
            return Err(LookError { what: "the picture", words: words.into() }.into());
        }
        #[cfg(feature = "exr")]
        if kind == Kind::Exr {
            return Ok(Self { target, form: Form::Exr(Exr::begin(target, sink, &about)) });
        }
        let form = if kind == Kind::Png && !shaded {
            let rows = PngRows::new(sink, &about, subject.paint());
            Form::Flat(rows.map_err(|error| target.io(error))?)
        } else {
            let encoder = Encoder::new(sink, kind, &about);
            Form::Pixels(encoder.map_err(|error| target.io(error))?, shaded)
        };
        Ok(Self { target, form })
    }

    /// A picture with a palette.
    fn palette(target: &'a Target, sink: &'a mut Sink, about: About<'a>) -> Self {
        let all = Arc::new(Plane(Vec::new()));
        Self { target, form: Form::Palette { sink, about, all } }
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
            #[cfg(feature = "exr")]
            Form::Exr(exr) => exr.take(&ids.0),
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
    fn take_pixels(&mut self, pixels: &Deep, subject: &Subject) -> Result<(), Error> {
        let width = subject.meta.region.width as usize;
        let piece = (PIECE / width).max(1) * width;
        match (&mut self.form, pixels) {
            (Form::Pixels(encoder, true), pixels) => {
                for some in pixels.rows(piece) {
                    subject.control.check()?;
                    encoder.push(some).map_err(|error| self.target.io(error))?;
                }
            }
            #[cfg(feature = "exr")]
            (Form::Exr(exr), Deep::Linear(pixels)) => exr.take_pixels(pixels),
            _ => {}
        }
        Ok(())
    }

    /// Ends the picture.
    fn finish(self, subject: &Subject) -> Result<(), Error> {
        let Self { target, form } = self;
        match form {
            Form::Flat(rows) => Ok(rows.finish().map_err(|error| target.io(error))?),
            Form::Pixels(encoder, _) => Ok(encoder.finish().map_err(|error| target.io(error))?),
            #[cfg(feature = "exr")]
            Form::Exr(exr) => exr.finish(subject),
            Form::Palette { sink, about, all } => {
                let written = png::write_palette_png(sink, &about, &all.0, &subject.paint());
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
        let look = Look::flat().background(merge.meta().background);
        let staged = merged(merge, &Control::new(), |subject| {
            write(sinks, &look, subject, &mut report, told, &mut source)
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
        _: Depth,
        _: &Control,
        _: &mut Report,
        _: &mut dyn FnMut(Step),
    ) -> Result<Deep, Error> {
        Ok(Deep::Eight(Vec::new()))
    }
}
