//! `planisphere render` of several pictures: a camera that turns about the scene, or the frames of
//! a trajectory; into files, or into one animation.

mod pictures;
mod video;

use std::{
    path::{Path, PathBuf},
    sync::{
        Arc,
        atomic::{AtomicUsize, Ordering::Relaxed},
    },
};

use clap::{Args as ClapArgs, ValueEnum};

use self::{
    pictures::Pictures,
    video::{Files, Fps, parse_fps},
};
use super::{
    Failure,
    args::{RenderRequest, named},
    ends::Ends,
    frames::{Frames, parse_frames},
    progress::Progress,
    reading::ReadingArgs,
    render::{check_memory, explain, say_device},
    say,
    template::Template,
    unless_changed,
};
use planisphere_io::{
    output::{Target, commit},
    particles::Frame,
    picture::{
        About, UnknownEnding,
        animation::{Animation, Moving},
    },
    text,
};
use planisphere_renderer::{Picture, Region, Renderer, Request, files::Sinks};

/// Several pictures, as typed.
#[derive(ClapArgs)]
#[command(next_help_heading = "Several pictures")]
pub(super) struct SequenceArgs {
    /// Draw N pictures from all around: the camera turns about the middle of the scene
    ///
    /// The first is seen by the camera as it is; between each and the next are equal angles. The
    /// size of what is seen and the clip distances stay. A camera that is chosen sees the whole
    /// scene in all of them. Names have a place for the number: -o 'turn-{frame:04}.png'; or one
    /// animation is written: -o turn.gif, or .apng.
    #[arg(
        long,
        value_name = "N",
        value_parser = clap::value_parser!(u32).range(1..=MOST),
        conflicts_with = "frames"
    )]
    turntable: Option<u32>,

    /// Line that the camera turns about: what is up in the picture, or an axis of the world;
    /// counterclockwise, seen from its tip
    #[arg(long, value_name = "AXIS", default_value = "up", requires = "turntable")]
    axis: Axis,

    /// Draw frames of a trajectory, each into a picture: A..B without B, A.. to the end; A..B:STEP
    ///
    /// A camera that is chosen is chosen once, to suit the first of them. Names have a place for
    /// the number of the frame, as those of --turntable.
    #[arg(long, value_name = "A..B[:STEP]", value_parser = parse_frames, conflicts_with = "frame")]
    frames: Option<Frames>,

    /// Pictures a second of an animation or video: 30, 12.5 or 30000/1001; without, 30, and of a
    /// GIF 25
    #[arg(long, value_name = "RATE", value_parser = parse_fps)]
    fps: Option<Fps>,

    /// Leave pictures that are there already, whatever they show: go on where a run has ended
    ///
    /// Files are written whole or not at all, so that one that is there is whole. Where a picture
    /// lacks one of its files (--ids, --depth), all of them are written.
    #[arg(long)]
    resume: bool,
}

/// Pictures of a turntable, at most.
const MOST: i64 = 1_000_000;

/// What a camera turns about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Axis {
    /// What is up in the picture
    Up,
    /// The x axis of the world
    X,
    /// Its y axis
    Y,
    /// Its z axis
    Z,
}

/// Which pictures.
#[derive(Clone, Copy, Debug)]
enum What {
    /// So many, about an axis.
    Turn(u32, Axis),
    /// One of each frame.
    Frames(Frames),
}

/// Several pictures, as they are to be drawn.
pub(super) struct Sequence {
    what: What,
    fps: Fps,
    resume: bool,
    /// Of each plane.
    names: [Option<Template>; PLANES],
    /// One file that has all pictures.
    moving: Option<(Target, Moving)>,
}

fn usage<T>(words: impl Into<String>) -> Result<T, Failure> {
    Err(Failure::Usage(words.into()))
}

/// A picture into a file whose ending stands for no format of one picture.
pub(super) fn unmoved(path: &Path, error: &UnknownEnding) -> Failure {
    Failure::Usage(match Moving::of(path) {
        Ok(_) => format!(
            "-o {}: one picture is no animation; add --turntable N or --frames A..B, or name it \
             .png",
            text::name(path)
        ),
        Err(_) => format!("-o: {error}"),
    })
}

/// Planes of a picture, each of which has its own files.
const PLANES: usize = 7;

/// Where each of them goes, with its option; the picture itself comes first.
fn planes(sinks: &mut Sinks) -> [(&'static str, &mut Option<Target>); PLANES] {
    [
        ("-o", &mut sinks.picture),
        ("--ids", &mut sinks.ids),
        ("--depth", &mut sinks.depth),
        ("--normals", &mut sinks.normals),
        ("--positions", &mut sinks.positions),
        ("--planes", &mut sinks.planes),
        ("--visibility", &mut sinks.part),
    ]
}

impl SequenceArgs {
    /// The name of a picture that was given none.
    pub fn default_name(&self, name: PathBuf) -> PathBuf {
        match self.turntable.is_some() || self.frames.is_some() {
            true => Template::suggested(&name),
            false => name,
        }
    }

    /// Which pictures are wanted, if they are several. The sinks, whose names are templates, become
    /// those of the first one; an animation is taken out of them.
    pub fn request(&self, sinks: &mut Sinks, stats: bool) -> Result<Option<Sequence>, Failure> {
        let Self { turntable, axis, frames, fps, resume } = *self;
        let (what, first) = match (turntable, frames) {
            (Some(count), _) => (What::Turn(count, axis), 0),
            (None, Some(frames)) => (What::Frames(frames), frames.first),
            (None, None) => return self.refuse_alone(sinks).map(|()| None),
        };
        if stats {
            return usage("--stats is of one picture, and these are several; leave it out");
        }
        let moving = self.moving(sinks)?;
        let usual = match moving {
            Some((_, Moving::Gif)) => 25,
            _ => 30,
        };
        let fps = fps.unwrap_or(Fps::whole(usual));
        let mut names = [const { None }; PLANES];
        for ((option, target), name) in planes(sinks).into_iter().zip(&mut names) {
            let Some(typed) = target else { continue };
            let template = template(option, typed)?;
            *target = Some(Target::File(template.name(first)));
            *name = Some(template);
        }
        Ok(Some(Sequence { what, fps, resume, names, moving }))
    }

    /// Refuses what is for several pictures, where there is one.
    fn refuse_alone(&self, sinks: &mut Sinks) -> Result<(), Failure> {
        let mut alone: Vec<String> = Vec::new();
        alone.extend(self.resume.then(|| "--resume".into()));
        alone.extend(self.fps.map(|_| "--fps".into()));
        for (option, target) in planes(sinks) {
            if let Some(Target::File(path)) = target
                && text::name(&path).contains("{frame")
            {
                alone.push(format!("{{frame}} in {option} {}", text::name(path)));
            }
        }
        match alone.first() {
            None => Ok(()),
            Some(what) => usage(format!(
                "{what} is for several pictures; add --turntable N or --frames A..B, or leave it \
                 out"
            )),
        }
    }

    /// An animation, where that is what is wanted, in place of pictures.
    fn moving(&self, sinks: &mut Sinks) -> Result<Option<(Target, Moving)>, Failure> {
        let Some(Target::File(path)) = &sinks.picture else { return Ok(None) };
        let Ok(kind) = Moving::of(path) else { return Ok(None) };
        let name = text::name(path);
        if name.contains("{frame") {
            return usage(format!(
                "-o {name}: an animation is one file of all pictures; leave out the number, or \
                 name pictures .png"
            ));
        }
        if self.resume {
            return usage(format!(
                "--resume leaves pictures that are there, and {name} is one file of all of them; \
                 leave it out, or write pictures: -o {}",
                text::name(Template::suggested(path).with_extension("png"))
            ));
        }
        if sinks.palette {
            return usage("--palette is for PNG; leave it out, or name pictures .png");
        }
        if sinks.depth16 {
            return usage("--depth16 is for PNG and TIFF; leave it out, or name pictures .png");
        }
        const FASTEST: u16 = 50;
        if let Some(fps) = self.fps.filter(|fps| kind == Moving::Gif && fps.is_above(FASTEST)) {
            return usage(format!(
                "--fps {fps}: a GIF has at most {FASTEST} pictures a second, and programs show \
                 one that says more slowly; give {FASTEST} or less, or write an .apng"
            ));
        }
        Ok(sinks.picture.take().map(|target| (target, kind)))
    }
}

/// The template that a name is.
fn template(option: &str, typed: &Target) -> Result<Template, Failure> {
    let Target::File(path) = typed else {
        return usage(format!(
            "{option} -: standard output takes one file, and these are several; name files, such \
             as 'turn-{{frame:04}}.png', or an animation: turn.gif"
        ));
    };
    Template::parse(option, path)?.map_or_else(
        || {
            let (name, better) = (text::name(path), text::name(Template::suggested(path)));
            usage(format!(
                "{option} {name} is one name, and the pictures are several; put their number into \
                 it: {better}"
            ))
        },
        Ok,
    )
}

impl Sequence {
    /// Whether it is an animation.
    pub fn moves(&self) -> bool {
        self.moving.is_some()
    }

    /// Where the planes of a picture go, and what it says of itself.
    fn sinks(&self, asked: &RenderRequest, number: usize) -> Sinks {
        let mut sinks = asked.sinks.clone();
        if let (What::Frames(_), Some(metadata)) = (self.what, &mut sinks.metadata) {
            let frame = Some(Frame::FromFirst(number));
            metadata.options = ReadingArgs { frame, ..asked.reading.clone() }.words();
        }
        for ((_, target), template) in planes(&mut sinks).into_iter().zip(&self.names) {
            *target = template.as_ref().map(|template| Target::File(template.name(number)));
        }
        sinks
    }
}

/// What is written and read.
fn ends<'a>(
    asked: &RenderRequest,
    outputs: impl Iterator<Item = (&'static str, &'a Target)>,
    files: &[PathBuf],
) -> Ends<'a> {
    let mut ends = Ends::new(outputs.collect(), asked.explain.then_some("--explain"));
    ends.reads(&asked.scene);
    let others = asked.reading.others().chain(asked.camera.file());
    others.chain(files.iter().map(PathBuf::as_path)).for_each(|path| ends.reads(path));
    ends
}

/// A sequence under way.
struct Work<'a> {
    asked: &'a RenderRequest,
    sequence: &'a Sequence,
    pictures: &'a Pictures<'a>,
    renderer: &'a Renderer,
    /// For each picture.
    sinks: &'a [Sinks],
    /// How many pictures are done.
    done: Arc<AtomicUsize>,
    /// What is said when all is done, each once.
    notes: Vec<String>,
    /// How many pictures show nothing, with the number of the first and why.
    unseen: Option<(usize, usize, String)>,
}

/// Draws all pictures.
pub(super) fn run(asked: &RenderRequest, sequence: &Sequence) -> Result<(), Failure> {
    // What can be known to be in the way before anything is read.
    let moving = sequence.moving.iter().map(|(target, _)| ("-o", target));
    ends(asked, moving.clone().chain(named(&asked.sinks)), &[]).check()?;
    let pictures = Pictures::open(asked, sequence)?;
    let of = |number: &usize| sequence.sinks(asked, *number);
    let sinks: Vec<Sinks> = pictures.numbers.iter().map(of).collect();
    ends(asked, moving.chain(sinks.iter().flat_map(named)), &pictures.files).check()?;

    let todo: Vec<usize> =
        (0..sinks.len()).filter(|place| !(sequence.resume && is_there(&sinks[*place]))).collect();
    let there = sinks.len() - todo.len();
    if there > 0 {
        let words = format!("{} there already, and left as they are", counted(there));
        say(&format!("note: {words}"));
    }
    if !todo.is_empty() {
        let progress = Progress::step("starting the device");
        let renderer = Renderer::open(&asked.picture.device)?;
        drop(progress);
        say_device(&renderer);
        if asked.explain {
            let plan = renderer.plan(&pictures.first, &asked.sinks);
            say(&format!("of the first of {}:", counted(sinks.len())));
            return explain(plan, &pictures.first, &renderer);
        }
        let (done, notes) = (Arc::default(), Vec::new());
        let (pictures, renderer, sinks) = (&pictures, &renderer, &sinks[..]);
        Work { asked, sequence, pictures, renderer, sinks, done, notes, unseen: None }
            .all(&todo)?;
    }
    say(&match (todo.len(), there) {
        (drawn, 0) => format!("{} drawn", counted(drawn)),
        (drawn, there) => format!("{} drawn, {there} left as they were", counted(drawn)),
    });
    if let Some(command) = video(asked, sequence, &pictures) {
        say(&command);
    }
    Ok(())
}

/// Some pictures, in words.
fn counted(pictures: usize) -> String {
    format!("{pictures} picture{}", if pictures == 1 { "" } else { "s" })
}

/// Whether all files of a picture are there.
fn is_there(sinks: &Sinks) -> bool {
    named(sinks).iter().all(|(_, target)| match target {
        Target::File(path) => path.is_file(),
        Target::Stdout => false,
    })
}

/// The command that makes a video of the files, where there are several pictures.
fn video(asked: &RenderRequest, sequence: &Sequence, pictures: &Pictures<'_>) -> Option<String> {
    let template = sequence.names[0].as_ref()?;
    let Region { width, height, .. } = pictures.first.drawn_region();
    let (first, last) = (*pictures.numbers.first()?, *pictures.numbers.last()?);
    let step = pictures.numbers.get(1)? - first;
    let (kind, size) = (asked.sinks.kind, [width, height]);
    Files { template, kind, size, first, last, step }.command(sequence.fps)
}

impl Work<'_> {
    /// Draws the pictures of some places.
    fn all(mut self, todo: &[usize]) -> Result<(), Failure> {
        self.check_memory()?;
        let progress = Progress::pictures(&self.done, todo.len());
        let result = match &self.sequence.moving {
            Some((target, kind)) => self.animation(target, *kind),
            None => todo.iter().try_for_each(|&place| {
                let (request, watch) = self.pictures.picture(place)?;
                unless_changed(&watch, || self.files(place, &request))?;
                self.done.fetch_add(1, Relaxed);
                Ok(())
            }),
        };
        drop(progress);
        for note in &self.notes {
            say(&format!("note: {note}"));
        }
        if let Some((count, number, why)) = &self.unseen {
            let of = todo.len();
            say(&format!(
                "note: nothing is seen in {count} of {}, such as {number}: {why}",
                counted(of)
            ));
        }
        let done = self.done.load(Relaxed);
        if result.is_err() && !self.sequence.moves() && done > 0 {
            say(&format!("note: {} written; --resume leaves them and goes on", counted(done)));
        }
        result
    }

    /// Refuses what cannot fit: a picture is as large as any other.
    fn check_memory(&self) -> Result<(), Failure> {
        let mut sinks = self.asked.sinks.clone();
        if let Some((target, _)) = &self.sequence.moving {
            // A whole picture is in memory, as for a palette.
            (sinks.picture, sinks.palette) = (Some(target.clone()), true);
        }
        check_memory(&self.renderer.plan(&self.pictures.first, &sinks))
    }

    fn note(&mut self, note: String) {
        if !self.notes.contains(&note) {
            self.notes.push(note);
        }
    }

    fn saw_nothing(&mut self, place: usize, request: &Request) {
        let numbers = &self.pictures.numbers;
        match &mut self.unseen {
            Some((count, _, _)) => *count += 1,
            none => *none = Some((1, numbers[place], request.why_empty())),
        }
    }

    /// Draws a picture into its files; none without any.
    fn files(&mut self, place: usize, request: &Request) -> Result<(), Failure> {
        let sinks = &self.sinks[place];
        if named(sinks).is_empty() {
            return Ok(());
        }
        let (staged, report) = self.renderer.render(request, sinks, &mut |_| {})?;
        // Names may have come to lead elsewhere meanwhile.
        ends(self.asked, named(sinks).into_iter(), &self.pictures.files).check()?;
        staged.commit()?.into_iter().for_each(|note| self.note(note));
        if let Some(by) = &report.drawn_by {
            self.note(format!("drawn {by}"));
        }
        if !report.seen && !self.sequence.moves() {
            self.saw_nothing(place, request);
        }
        Ok(())
    }

    /// Draws all pictures into one file, and what else is wanted into files.
    fn animation(&mut self, target: &Target, kind: Moving) -> Result<(), Failure> {
        let failed = |error: std::io::Error| match error.kind() {
            std::io::ErrorKind::InvalidInput => Failure::Usage(format!("-o: {error}")),
            _ => target.io(error).into(),
        };
        let pictures = self.pictures;
        let Region { width, height, .. } = pictures.first.drawn_region();
        let alpha = pictures.transparent;
        let about = About { size: [width, height], alpha, ..About::default() };
        let (count, delay) = (pictures.numbers.len() as u32, self.sequence.fps.delay());
        let mut sink = target.clone().open()?;
        let mut animation =
            Animation::new(&mut sink, kind, &about, count, delay).map_err(failed)?;
        let mut picture = Picture::default();
        for place in 0..pictures.numbers.len() {
            let (request, watch) = pictures.picture(place)?;
            unless_changed(&watch, || {
                self.renderer.draw_into(&request, &mut picture)?;
                if picture.ids().iter().all(|id| *id < 0) {
                    self.saw_nothing(place, &request);
                }
                if let Some(by) = picture.drawn_by() {
                    self.note(format!("drawn {by}"));
                }
                animation.push_frame(picture.rgba()).map_err(failed)?;
                self.files(place, &request)
            })?;
            self.done.fetch_add(1, Relaxed);
        }
        animation.finish().map_err(failed)?;
        let staged = sink.finish()?;
        ends(self.asked, [("-o", target)].into_iter(), &pictures.files).check()?;
        commit(vec![staged])?.into_iter().for_each(|note| self.note(note));
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn request(args: &SequenceArgs, name: &str) -> Result<(Option<Sequence>, Sinks), Failure> {
        let mut sinks = Sinks::default();
        sinks.picture = Some(Target::from_arg(Path::new(name)));
        args.request(&mut sinks, false).map(|sequence| (sequence, sinks))
    }

    #[test]
    fn names_have_a_place_for_the_number() {
        let turn = || SequenceArgs {
            turntable: Some(4),
            axis: Axis::Up,
            frames: None,
            fps: None,
            resume: false,
        };
        let (sequence, sinks) = request(&turn(), "a-{frame:02}.png").unwrap();
        assert_eq!(sinks.picture, Some(Target::File("a-00.png".into())));
        let names = sequence.expect("several").names;
        let name = names[0].as_ref().map(|template| template.name(3));
        assert_eq!(name, Some(PathBuf::from("a-03.png")));
        let (sequence, sinks) = request(&turn(), "a.GIF").unwrap();
        assert!(sequence.expect("several").moves() && sinks.picture.is_none());
        let resumed = SequenceArgs { resume: true, ..turn() };
        let fast = SequenceArgs { fps: Some(Fps::whole(60)), ..turn() };
        for (args, name, word) in [
            (turn(), "a.png", "a-{frame:04}.png"),
            (turn(), "-", "name files"),
            (turn(), "a-{n}.png", "{n} stands for nothing"),
            (turn(), "a-{frame}.gif", "leave out the number"),
            (resumed, "a.apng", "a-{frame:04}.png"),
            (fast, "a.gif", ".apng"),
            (SequenceArgs { resume: true, turntable: None, ..turn() }, "a.png", "--turntable"),
        ] {
            let failure = request(&args, name).err().expect("refused").to_string();
            assert!(failure.contains(word), "{failure}");
        }
    }
}
