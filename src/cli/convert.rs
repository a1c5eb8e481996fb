//! `planisphere convert`: particles and scenes into files that other programs read.

use std::{
    io::{self, Write},
    path::{Path, PathBuf},
};

use clap::{Args as ClapArgs, ValueEnum};

use super::{
    Failure,
    ends::Ends,
    frames::{Frames, parse_frames},
    progress::Progress,
    reading::ReadingArgs,
    render::say_read,
    say,
    template::Template,
};
use planisphere_io::{
    load::{Control, Opened, open},
    output::{Staged, Target, commit},
    particles::{File, Frame, Understood, understand, write::Output},
    text,
};

/// `convert`, as typed.
#[derive(ClapArgs)]
pub(super) struct ConvertArgs {
    /// File of particles, or scene file; - for standard input
    #[arg(value_hint = clap::ValueHint::FilePath)]
    input: PathBuf,

    /// File to write: .npz, .ply or .xyz; - for standard output (with --to)
    ///
    /// In the place of {frame} in its name comes the number of the frame, as --frames needs it; of
    /// {frame:04}, with four digits.
    #[arg(required_unless_present = "to", value_hint = clap::ValueHint::FilePath)]
    output: Option<PathBuf>,

    /// Format to write, instead of that of the name; `none` reads all and writes nothing
    #[arg(long, value_name = "FORMAT")]
    to: Option<To>,

    /// Frames, each into a file of its own: A..B without B, A.. to the end; A..B:STEP
    #[arg(long, value_name = "A..B[:STEP]", value_parser = parse_frames, conflicts_with = "frame")]
    frames: Option<Frames>,

    #[command(flatten)]
    reading: ReadingArgs,
}

/// What can be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum To {
    /// NumPy archive: centers, radii, colors, and every other column
    Npz,
    /// PLY, binary
    Ply,
    /// Extended XYZ
    Xyz,
    /// Nothing
    None,
}

/// Reads, and writes what was asked for.
pub(super) fn run(args: &ConvertArgs) -> Result<(), Failure> {
    let to = args.format()?;
    let name = args.output.as_deref().filter(|_| to != To::None);
    // Other names may have any braces.
    let numbered = |name: &Path| args.frames.is_some() || text::name(name).contains("{frame");
    let template = name.filter(|name| numbered(name)).map(|name| Template::parse("OUT", name));
    let template = template.transpose()?.flatten();
    match (args.frames, name, template) {
        (None, name, template) => args.one(to, name, template),
        (Some(frames), None, _) => args.several(to, None, frames),
        (Some(frames), Some(_), Some(template)) => args.several(to, Some(&template), frames),
        (Some(_), Some(_), None) => Err(Failure::Usage(format!(
            "--frames writes a file for each frame; put {{frame}} into the name, such as \
             out-{{frame}}.{}",
            to.ending()
        ))),
    }
}

impl To {
    fn ending(self) -> &'static str {
        match self {
            Self::Npz => "npz",
            Self::Ply => "ply",
            Self::Xyz => "xyz",
            Self::None => "none",
        }
    }
}

impl ConvertArgs {
    /// What is to be written: as it was typed, or by the name.
    fn format(&self) -> Result<To, Failure> {
        if let Some(to) = self.to {
            if to != To::None && self.output.is_none() {
                let words = format!("--to {} needs a file to write, or -", to.ending());
                return Err(Failure::Usage(words));
            }
            return Ok(to);
        }
        let name = self.output.as_deref().unwrap_or(Path::new(""));
        if name == Path::new("none") {
            return Ok(To::None);
        }
        let ending = name.extension().and_then(|ending| ending.to_str()).unwrap_or_default();
        let all = [To::Npz, To::Ply, To::Xyz];
        let found = all.into_iter().find(|to| to.ending().eq_ignore_ascii_case(ending));
        found.ok_or_else(|| {
            Failure::Usage(format!(
                "{} names no format that is written; name it .npz, .ply or .xyz, or say --to npz",
                text::name(name)
            ))
        })
    }

    /// One frame.
    fn one(&self, to: To, name: Option<&Path>, template: Option<Template>) -> Result<(), Failure> {
        let control = Control::new();
        let options = self.reading.options();
        let progress = Progress::of("reading", &control);
        match open(&self.input, &options, &control)? {
            Opened::Scene(loaded) => {
                drop(progress);
                self.reading.refuse_for_scene(&self.input)?;
                let target = name.map(Target::from_arg);
                self.check(&target, &loaded.files)?;
                say_read(&loaded);
                let blocks: Vec<_> =
                    loaded.scene.blocks().map(|(_, block)| block.clone()).collect();
                let output = Output { blocks: &blocks, columns: &[], cell: None };
                super::unless_changed(&loaded.watch, || stage(&output, to, target))?.commit()
            }
            Opened::Particles(file) => {
                let found = understand(&file, options.frame, &options.appearance, &control)?;
                drop(progress);
                let target = match template {
                    Some(template) => Some(Target::File(template.name(found.frame))),
                    None => name.map(Target::from_arg),
                };
                self.check(&target, &[])?;
                say(&found.line);
                write_frame(&file, &found, to, target)
            }
        }
    }

    /// Several frames, each into a file of its own. All names are looked at before any is written.
    fn several(&self, to: To, name: Option<&Template>, frames: Frames) -> Result<(), Failure> {
        let control = Control::new();
        let options = self.reading.options();
        let Opened::Particles(file) = open(&self.input, &options, &control)? else {
            return Err(Failure::Usage("--frames is for files of particles".into()));
        };
        let numbers = frames.numbers(&file, &control)?;
        let targets: Option<Vec<Target>> =
            name.map(|name| numbers.iter().map(|frame| Target::File(name.name(*frame))).collect());
        self.check(targets.as_deref().unwrap_or_default(), &[])?;
        for (place, frame) in numbers.iter().enumerate() {
            let asked = Frame::FromFirst(*frame);
            let found = understand(&file, asked, &options.appearance, &Control::new())?;
            if place == 0 {
                say(&found.line);
            }
            let target = targets.as_ref().map(|targets| targets[place].clone());
            write_frame(&file, &found, to, target)?;
        }
        say(&format!("{} frame{}", numbers.len(), if numbers.len() == 1 { "" } else { "s" }));
        Ok(())
    }

    /// Refuses outputs that are read, or that get in each other's way.
    fn check<'t>(
        &self,
        targets: impl IntoIterator<Item = &'t Target>,
        files: &[PathBuf],
    ) -> Result<(), Failure> {
        let outputs = targets.into_iter().map(|target| ("OUT", target)).collect();
        let mut ends = Ends::new(outputs, None);
        ends.reads(&self.input);
        let others = self.reading.others().chain(files.iter().map(PathBuf::as_path));
        others.for_each(|path| ends.reads(path));
        ends.check()
    }
}

/// Writes a frame, unless its file has changed meanwhile: numbers may lie in it.
fn write_frame(
    file: &File,
    found: &Understood,
    to: To,
    target: Option<Target>,
) -> Result<(), Failure> {
    let Understood { particles, spheres, .. } = found;
    let blocks = std::slice::from_ref(&spheres.block);
    let output = Output { blocks, columns: &particles.columns, cell: particles.cell };
    let written = stage(&output, to, target)?;
    file.unchanged()?;
    written.commit()
}

/// A file that is written, and has no name yet.
struct Written {
    staged: Vec<Staged>,
    /// What it has no place for, each one line.
    left_out: Vec<String>,
}

/// Writes one file.
fn stage(output: &Output<'_>, to: To, target: Option<Target>) -> Result<Written, Failure> {
    let mut written = Written { staged: Vec::new(), left_out: Vec::new() };
    let Some(target) = target else { return Ok(written) };
    let progress = Progress::step("writing");
    written.staged.push(target.stage(|out: &mut dyn Write| -> io::Result<()> {
        match to {
            To::Npz => output.write_npz(out),
            To::Ply => output.write_ply(out).map(|words| written.left_out = words),
            To::Xyz => output.write_xyz(out),
            To::None => Ok(()),
        }
    })?);
    drop(progress);
    Ok(written)
}

impl Written {
    /// Gives it its name.
    fn commit(self) -> Result<(), Failure> {
        let notes = commit(self.staged)?;
        self.left_out.iter().chain(&notes).for_each(|note| say(&format!("note: {note}")));
        Ok(())
    }
}
