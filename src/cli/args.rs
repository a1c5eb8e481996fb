//! The arguments as they are typed, their help, and how they become requests.

use std::{
    collections::HashMap,
    ffi::OsString,
    path::{Path, PathBuf},
};

use clap::{Args as ClapArgs, Parser, Subcommand, ValueEnum};

#[cfg(feature = "bench")]
use super::bench::BenchArgs;
use super::{
    Failure,
    about::AboutArgs,
    camera::CameraArgs,
    convert::ConvertArgs,
    info::InfoArgs,
    look::LookArgs,
    overlay::OverlayArgs,
    parse::{parse_device, parse_region, parse_size, parse_some},
    reading::ReadingArgs,
    sequence::{Sequence, SequenceArgs, unmoved},
};
use planisphere_io::{output::Target, particles::Format, picture::Kind};
use planisphere_renderer::{Device, Region, files::Sinks};

/// Draws spheres: every pixel exactly right, the same bytes on every device.
#[derive(Parser)]
#[command(name = "planisphere", version, arg_required_else_help = true, subcommand_required = true)]
#[command(after_long_help = EXIT_CODES)]
pub(super) struct Args {
    #[command(subcommand)]
    pub command: Command,
}

const EXIT_CODES: &str = "\
Exit codes:
  0  done (also when the reader of a pipe stopped reading)
  1  a check failed
  2  bad usage or bad input: the message says where, and the fix
  3  no usable device, or no display for the window
  4  output could not be written
  101  a fault of this program: the message asks to report it
  128 + n  ended by signal n, such as 130 for Ctrl-C

Data goes to standard output, talk to standard error. Colours follow NO_COLOR.";

// Lines of at most 80 columns: the help is not wrapped again, and an example can be copied as it
// stands.

const RENDER_EXAMPLES: &str = "\
Examples:
  planisphere render scenes/first.toml
      writes first.png into the current folder
  planisphere render scene.toml -o - --size 1920x1080 | display
      writes the PNG to standard output
  planisphere render scene.toml -o none --ids ids.npy --depth depth.npy --stats
      no picture; the index and the distance of the sphere at every pixel, and
      a report as JSON
  generate | planisphere render - -o out.png
      reads the scene from standard input
  planisphere render half.toml -o none --visibility half.npz --first-index 1000
      a part of a picture, for `planisphere merge`
  planisphere render run.dump --frame last --color-by q --map coolwarm
      the last frame of a trajectory, coloured by a column
  planisphere render protein.cif --radius covalent --view x --background white
      an atomic structure, smaller spheres, seen along the x axis
  planisphere render protein.cif --look illustrative --outline-by chain \\
          --legend --scale-bar --unit Å --axes
      lines around each chain; the elements' colours, a length and the axes
  planisphere render scene.toml --turntable 120 -o 'turn-{frame:04}.png'
      120 pictures from all around; the last line is the command that makes a
      video of them
  planisphere render run.dump --frames 0..500:5 -o run.gif
      every fifth frame of a trajectory, as an animation";

const CONVERT_EXAMPLES: &str = "\
Examples:
  planisphere convert run.dump --frame last last.npz
      centers (N, 3), radii and colors, and every other column under its name
  planisphere convert run.dump --frames 0..100:10 frame-{frame}.ply
      every tenth frame, each in a file of its own
  planisphere convert scene.toml spheres.npz
      the spheres of a scene file";

const MERGE_EXAMPLES: &str = "\
Each part holds some of the spheres (its own scene file, and --first-index: the
index of its first sphere in the whole), or some of the picture (--region), or
both. The merged picture, ids and depths are byte for byte those of one run that
draws everything: where two parts are too close to call, the exact numbers of
the spheres, which the parts carry, decide. All parts must have the same
[camera], with an origin, a view and a size (what is left out is chosen to suit
the spheres of each part), the same image size and the same background.

Examples:
  planisphere render left.toml -o none --visibility left.npz
  planisphere render right.toml -o none --visibility right.npz \\
          --first-index 1000
  planisphere merge left.npz right.npz -o picture.png --ids ids.npy
      two halves of the spheres; left.toml has 1000
  planisphere render scene.toml --region 0,512,1024,512 \\
          -o none --visibility lower.npz
      one half of the picture; the other is --region 0,0,1024,512
  planisphere merge part-1?.npz -o none --visibility tens.npz
      a part again, of what these parts hold: merges may be merged
  srun sh -c 'planisphere render part-$SLURM_PROCID.toml -o none \\
          --visibility part-$SLURM_PROCID.npz \\
          --first-index $((SLURM_PROCID * 1000))' &&
          planisphere merge part-*.npz -o picture.png
      a job of many tasks, each with a thousand spheres

In Python: numpy.load('part.npz')['pixels'] has the fields id, low and high
(between which the distance lies); indices, centers, radii and colors are the
spheres that are seen.";

const CHECK_EXAMPLES: &str = "\
Examples:
  planisphere check scene.toml --golden golden.png
      exit code 0 if all pixels are equal, 1 if one is not
  planisphere check scenes/*.toml --goldens goldens --out out --junit report.xml
      goldens/NAME.png for scenes/NAME.toml; of each that fails, out/NAME.actual.png
      and out/NAME.diff.png
  planisphere check scenes/*.toml --goldens goldens --bless
      writes the goldens that are missing or differ
  planisphere check run.dump --frame last --golden last.png --ids last.npy
      a file of particles; the sphere at every pixel, too
docs/golden-images.md has what is promised, and workflows of CI systems.";

#[derive(Subcommand)]
pub(super) enum Command {
    /// Draw a scene, or a file of particles, into a PNG and, if asked, into arrays of sphere
    /// indices and depths
    #[command(after_long_help = RENDER_EXAMPLES)]
    Render(RenderArgs),
    /// Merge parts of a picture, drawn by several runs or machines, into the picture of one
    #[command(after_long_help = MERGE_EXAMPLES)]
    Merge(MergeArgs),
    /// Draw scenes and compare each with a golden picture, pixel by pixel
    #[command(after_long_help = CHECK_EXAMPLES)]
    Check(CheckArgs),
    /// Look at a scene in a window, from all sides
    #[cfg(feature = "window")]
    #[command(after_long_help = format!("Keys and mouse:\n{}", planisphere_window::KEYS))]
    View(ViewArgs),
    /// Say what is in a file; without one, list the devices found, what each lacks, and which one
    /// `--device auto` takes
    Info(InfoArgs),
    /// Write particles, or a scene, as a NumPy archive, PLY or extended XYZ
    #[command(after_long_help = CONVERT_EXAMPLES)]
    Convert(ConvertArgs),
    /// Write the arrays and the scene file of a large example scene
    Make(MakeArgs),
    /// Measure how fast pictures are drawn, and how right they are
    #[cfg(feature = "bench")]
    Bench(BenchArgs),
    /// Print the completion script of a shell
    #[command(long_about = "Print the completion script of a shell, such as:\n  \
        planisphere completions bash > ~/.local/share/bash-completion/completions/planisphere")]
    Completions {
        /// The shell
        shell: clap_complete::Shell,
    },
}

/// `render`, as typed.
#[derive(ClapArgs)]
pub(super) struct RenderArgs {
    /// Scene file (TOML), or a file of particles: XYZ, LAMMPS, PDB, mmCIF, GRO, PLY, CSV, npz, GSD,
    /// XTC, DCD; - for standard input
    ///
    /// The format is told by the content, also of what is compressed (gzip, zstd, xz, bzip2).
    #[arg(value_hint = clap::ValueHint::FilePath)]
    scene: PathBuf,

    /// PNG to write: a file, - for standard output, or none for no picture
    ///
    /// The default is the scene's name with .png, in the current folder. It is RGB, 8 bits a
    /// channel. The file appears when it is complete: a run that fails or is killed leaves what was
    /// there before. A file that is there keeps its permissions and its owner. Names such as
    /// /dev/stdout and /dev/fd/3 are written to where they stand.
    #[arg(short, long, value_name = "OUT", value_hint = clap::ValueHint::FilePath)]
    output: Option<PathBuf>,

    #[command(flatten)]
    about: AboutArgs,

    /// Write the PNG with a palette, of 1, 2, 4 or 8 bits a pixel, instead of as RGB
    ///
    /// The pixels are the same. A picture of more than 256 colours is refused. Some programs read
    /// the indices of a palette as if they were the picture: the default is RGB, 8 bits a channel,
    /// which all read alike.
    #[arg(long)]
    palette: bool,

    /// Write 16 bits a channel instead of 8: PNG and TIFF
    ///
    /// Shades and means of samples have finer steps; a picture that is named .exr has still finer
    /// ones.
    #[arg(long, conflicts_with = "palette")]
    depth16: bool,

    #[command(flatten)]
    picture: PictureArgs,

    /// Also write the index of the sphere at every pixel: .npy, int32 (height, width), -1 for the
    /// background
    #[arg(long, value_name = "FILE", value_hint = clap::ValueHint::FilePath)]
    ids: Option<PathBuf>,

    /// Also write the distance of every hit along the view direction: .npy, float32 (height,
    /// width), inf for the background
    #[arg(long, value_name = "FILE", value_hint = clap::ValueHint::FilePath)]
    depth: Option<PathBuf>,

    /// Also write the unit vector from the sphere's centre to the point that every pixel shows, in
    /// the world: .npy, float32 (height, width, 3), zeros for the background
    #[arg(long, value_name = "FILE", value_hint = clap::ValueHint::FilePath)]
    normals: Option<PathBuf>,

    /// Also write the point that every pixel shows, in the world: .npy, float32 (height, width, 3),
    /// NaN for the background
    #[arg(long, value_name = "FILE", value_hint = clap::ValueHint::FilePath)]
    positions: Option<PathBuf>,

    /// Also write all of these into one file: .npz with ids, depth, normals and positions
    ///
    /// A picture that is named .exr has them as channels, beside its colours in linear light:
    /// depth.Z, normal.X, normal.Y, normal.Z, position.X, position.Y, position.Z, and id, which is
    /// 4294967295 for the background.
    #[arg(long, value_name = "FILE", value_hint = clap::ValueHint::FilePath)]
    planes: Option<PathBuf>,

    /// Also write what `planisphere merge` needs to merge this picture with others: .npz, see
    /// `planisphere merge --help`
    #[arg(long, value_name = "FILE", value_hint = clap::ValueHint::FilePath)]
    visibility: Option<PathBuf>,

    /// Index, in the whole, of the first sphere of this scene: for --visibility, when other runs
    /// draw the other spheres
    #[arg(
        long,
        value_name = "K",
        default_value_t = 0,
        requires = "visibility",
        value_parser = clap::value_parser!(u64).range(..=MAX_FIRST)
    )]
    first_index: u64,

    /// Draw nothing: print what would run, what would be skipped and why, and how much memory that
    /// would need
    #[arg(long)]
    explain: bool,

    /// Print one JSON object on standard output: device, counts, milliseconds of every step
    #[arg(long)]
    stats: bool,

    #[command(flatten)]
    sequence: SequenceArgs,

    #[command(flatten)]
    reading: ReadingArgs,

    #[command(flatten)]
    camera: CameraArgs,
}

/// Which picture of an input is drawn, and where, as typed: what `render` and `check` share.
#[derive(ClapArgs)]
pub(super) struct PictureArgs {
    /// Size of the image in pixels, instead of the scene file's
    ///
    /// The size never changes what is seen: when the scene gives both width and height of the view,
    /// another aspect makes pixels that are not square. When it gives one of them, or fov, the
    /// other follows the aspect; what [camera] leaves out is chosen anew.
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    pub size: Option<[u32; 2]>,

    /// Draw only a part of the image: column and row of its top left pixel, and its size
    ///
    /// The output has the size of the part, and equals that part of the whole image pixel for
    /// pixel.
    #[arg(long, value_name = "x,y,w,h", value_parser = parse_region)]
    pub region: Option<Region>,

    /// Device that draws: auto, gpu, cpu, or part of an adapter's name
    ///
    /// gpu is any wgpu adapter, the software one included; cpu is native code that needs no driver;
    /// auto takes a hardware GPU if there is one, else the cpu, and says so. The picture is the
    /// same on all of them. `planisphere info` lists the adapters.
    #[arg(long, value_name = "DEVICE", default_value = "auto", value_parser = parse_device)]
    pub device: Device,

    #[command(flatten)]
    pub look: LookArgs,

    #[command(flatten)]
    pub overlay: OverlayArgs,
}

/// The largest first index: indices are written as int64.
const MAX_FIRST: u64 = 1 << 62;

/// Refuses names that stand for formats that are not written, and a request for nothing.
fn checked(mut sinks: Sinks, text: bool) -> Result<Sinks, Failure> {
    if let Some((path, _)) = sinks.picture.as_ref().map(Target::ending).transpose()?.flatten() {
        sinks.kind = Kind::of(path).map_err(|error| unmoved(path, &error))?;
    }
    for (option, target) in named(&sinks) {
        let (what, ending) = match option {
            "-o" => continue,
            "--visibility" => ("a part", "npz"),
            "--planes" => ("an archive", "npz"),
            _ => ("an array", "npy"),
        };
        target.check_ending(option, what, ending)?;
    }
    if sinks.palette && sinks.picture.is_none() {
        return Err(Failure::Usage(
            "--palette says how the picture is written, and -o none writes none; leave out one of \
             them"
                .into(),
        ));
    }
    if sinks.palette && sinks.kind != Kind::Png {
        return Err(Failure::Usage(
            "--palette is for PNG; leave it out, or name the picture .png".into(),
        ));
    }
    if sinks.depth16 && !(sinks.picture.is_some() && sinks.kind.holds_depth16()) {
        let words = match &sinks.picture {
            None => "--depth16 is of the picture, and -o none writes none; leave one out".into(),
            Some(_) if sinks.kind == Kind::Exr => {
                "--depth16 is for PNG and TIFF; OpenEXR has 32 bits a channel: leave it out".into()
            }
            Some(_) => format!(
                "--depth16: {} has 8 bits a channel; name the picture .png or .tif, or leave it \
                 out",
                sinks.kind.name()
            ),
        };
        return Err(Failure::Usage(words));
    }
    if named(&sinks).is_empty() && !text {
        return Err(Failure::Usage(
            "-o none leaves nothing to do; add --ids, --depth, --normals, --positions, --planes, \
             --visibility or --stats, or name a picture"
                .into(),
        ));
    }
    Ok(sinks)
}

/// The outputs that are wanted, each with its option.
pub(super) fn named(sinks: &Sinks) -> Vec<(&'static str, &Target)> {
    let all = [
        ("-o", &sinks.picture),
        ("--ids", &sinks.ids),
        ("--depth", &sinks.depth),
        ("--normals", &sinks.normals),
        ("--positions", &sinks.positions),
        ("--planes", &sinks.planes),
        ("--visibility", &sinks.part),
    ];
    all.into_iter().filter_map(|(option, target)| Some((option, target.as_ref()?))).collect()
}

/// The outputs as they are typed.
fn sinks(
    picture: Option<Target>,
    palette: bool,
    [ids, depth, part]: [Option<PathBuf>; 3],
    first: u64,
) -> Sinks {
    let [ids, depth, part] = [ids, depth, part].map(|path| path.as_deref().map(Target::from_arg));
    let mut sinks = Sinks::default();
    (sinks.picture, sinks.palette, sinks.first) = (picture, palette, first);
    (sinks.ids, sinks.depth, sinks.part) = (ids, depth, part);
    sinks
}

/// `merge`, as typed.
#[derive(ClapArgs)]
pub(super) struct MergeArgs {
    /// Parts, written by `planisphere render --visibility` or by this command, in any order
    #[arg(required = true, value_name = "PART", value_hint = clap::ValueHint::FilePath)]
    parts: Vec<PathBuf>,

    /// PNG to write: a file, - for standard output, or none for no picture
    #[arg(
        short,
        long,
        value_name = "OUT",
        default_value = "merged.png",
        value_hint = clap::ValueHint::FilePath
    )]
    output: PathBuf,

    #[command(flatten)]
    about: AboutArgs,

    /// Write the PNG with a palette, of 1, 2, 4 or 8 bits a pixel, instead of as RGB
    ///
    /// The pixels are the same. A picture of more than 256 colours is refused. Some programs read
    /// the indices of a palette as if they were the picture: the default is RGB, 8 bits a channel,
    /// which all read alike.
    #[arg(long)]
    palette: bool,

    /// Merge only a part of the image, which the parts must cover: column and row of its top left
    /// pixel, and its size
    ///
    /// The default is the whole image or, when only --visibility is written, the least region that
    /// holds all parts.
    #[arg(long, value_name = "x,y,w,h", value_parser = parse_region)]
    region: Option<Region>,

    /// Also write the index of the sphere at every pixel: .npy (height, width), int32 or, where
    /// that is too short, int64; -1 for the background
    #[arg(long, value_name = "FILE", value_hint = clap::ValueHint::FilePath)]
    ids: Option<PathBuf>,

    /// Also write the distance of every hit along the view direction: .npy, float32 (height,
    /// width), inf for the background
    #[arg(long, value_name = "FILE", value_hint = clap::ValueHint::FilePath)]
    depth: Option<PathBuf>,

    /// Also write what was merged as a part, to be merged again
    #[arg(long, value_name = "FILE", value_hint = clap::ValueHint::FilePath)]
    visibility: Option<PathBuf>,

    /// Print one JSON object on standard output: counts, milliseconds of every step
    #[arg(long)]
    stats: bool,
}

/// `merge`, as it is to be done.
pub(super) struct MergeRequest {
    /// Parts.
    pub parts: Vec<PathBuf>,
    /// What to write.
    pub sinks: Sinks,
    /// Which part of the image.
    pub region: Option<Region>,
    /// Whether to print statistics.
    pub stats: bool,
}

impl MergeArgs {
    /// Refuses what cannot be written as it is named.
    pub fn request(self) -> Result<MergeRequest, Failure> {
        let picture = (self.output != Path::new("none")).then(|| Target::from_arg(&self.output));
        let arrays = [self.ids, self.depth, self.visibility];
        let mut sinks = checked(sinks(picture, self.palette, arrays, 0), self.stats)?;
        self.about.apply(&mut sinks, Vec::new())?;
        Ok(MergeRequest { parts: self.parts, sinks, region: self.region, stats: self.stats })
    }
}

/// `render`, as it is to be done.
pub(super) struct RenderRequest {
    /// Scene file, or `-`.
    pub scene: PathBuf,
    /// What to write.
    pub sinks: Sinks,
    /// Whether to explain instead of drawing.
    pub explain: bool,
    /// Which picture.
    pub picture: PictureArgs,
    /// Whether to print statistics.
    pub stats: bool,
    /// How a file of particles is read.
    pub reading: ReadingArgs,
    /// In place of the scene's camera.
    pub camera: CameraArgs,
    /// Which pictures, if there are several; `sinks` are then those of the first.
    pub sequence: Option<Sequence>,
}

impl RenderArgs {
    /// Gives defaults their values, and refuses what cannot be written as it is named.
    pub fn request(self) -> Result<RenderRequest, Failure> {
        let output = match &self.output {
            Some(name) if name == Path::new("none") => None,
            Some(name) => Some(Target::from_arg(name)),
            None => Some(Target::File(self.sequence.default_name(default_output(&self.scene)?))),
        };
        let arrays = [self.ids, self.depth, self.visibility];
        let mut sinks = sinks(output, self.palette, arrays, self.first_index);
        sinks.depth16 = self.depth16;
        let planes = [self.normals, self.positions, self.planes];
        [sinks.normals, sinks.positions, sinks.planes] =
            planes.map(|path| path.as_deref().map(Target::from_arg));
        let sequence = self.sequence.request(&mut sinks, self.stats)?;
        let moves = sequence.as_ref().is_some_and(Sequence::moves);
        let mut sinks = checked(sinks, self.stats || moves)?;
        match moves {
            true => self.about.refuse_for_animation()?,
            false => self.about.apply(&mut sinks, self.reading.words())?,
        }
        let Self { scene, explain, picture, stats, reading, camera, .. } = self;
        Ok(RenderRequest { scene, sinks, explain, picture, stats, reading, camera, sequence })
    }
}

/// The scene's name with `.png`, in the current folder.
fn default_output(scene: &Path) -> Result<PathBuf, Failure> {
    let stem = stem(scene).ok_or_else(|| {
        Failure::Usage(
            "a scene from standard input has no name to give its picture; add -o OUT.png".into(),
        )
    })?;
    Ok(with_png(stem))
}

/// A name with `.png` behind it.
fn with_png(mut name: OsString) -> PathBuf {
    name.push(".png");
    name.into()
}

/// The scene's name without its ending; none of standard input. An ending that is no format's
/// stays, as in `dump.1000`.
fn stem(scene: &Path) -> Option<OsString> {
    let known = Format::of_path(scene).is_some();
    let mut stem = PathBuf::from(scene.file_name().filter(|_| scene != Path::new("-"))?);
    if known && ["gz", "bz2", "xz", "zst"].iter().any(|ending| is_ending(&stem, ending)) {
        stem.set_extension("");
    }
    if known || is_ending(&stem, "toml") {
        stem.set_extension("");
    }
    stem.file_name().map(OsString::from)
}

fn is_ending(name: &Path, ending: &str) -> bool {
    name.extension().is_some_and(|found| found.eq_ignore_ascii_case(ending))
}

/// `check`, as typed.
#[derive(ClapArgs)]
pub(super) struct CheckArgs {
    /// Scene files (TOML), or files of particles, as `planisphere render` takes them; - for
    /// standard input, with --golden or --ids
    #[arg(value_name = "SCENE", value_hint = clap::ValueHint::FilePath)]
    scenes: Vec<PathBuf>,

    /// PNG whose pixels the picture must have: of one scene
    ///
    /// Any PNG of 8 bits a channel or fewer, also one with a palette: colours are compared, not the
    /// bytes of files.
    #[arg(long, value_name = "FILE.png", value_hint = clap::ValueHint::FilePath)]
    golden: Option<PathBuf>,

    /// Folder of the goldens of several scenes: NAME.png for NAME.toml
    #[arg(
        long,
        value_name = "DIR",
        value_hint = clap::ValueHint::DirPath,
        conflicts_with = "golden"
    )]
    goldens: Option<PathBuf>,

    /// Array of the spheres that the pixels must show: of one scene
    ///
    /// As `planisphere render --ids` writes it, or of integers of any other width.
    #[arg(long, value_name = "FILE.npy", value_hint = clap::ValueHint::FilePath)]
    ids: Option<PathBuf>,

    /// Write the goldens that are missing, and replace those that differ
    ///
    /// One that has the right pixels stays as it is, to the byte.
    #[arg(long, conflicts_with_all = ["max_different", "max_delta"])]
    bless: bool,

    /// Folder for what fails, made if missing: NAME.actual.png is the picture as it is drawn now,
    /// NAME.diff.png where it differs, in red
    #[arg(long, value_name = "DIR", value_hint = clap::ValueHint::DirPath)]
    out: Option<PathBuf>,

    /// Print one JSON object on standard output; what is for people goes to standard error
    #[arg(long)]
    json: bool,

    /// Also write a report as JUnit XML, which CI systems read
    #[arg(long, value_name = "FILE.xml", value_hint = clap::ValueHint::FilePath)]
    junit: Option<PathBuf>,

    /// Pixels that may differ: for goldens that other programs have made
    #[arg(long, value_name = "N", default_value_t = 0, hide_default_value = true)]
    max_different: u64,

    /// How far a channel may be off before its pixel differs, 0 to 254: for goldens that other
    /// programs have made
    #[arg(
        long,
        value_name = "D",
        default_value_t = 0,
        hide_default_value = true,
        value_parser = clap::value_parser!(u8).range(..=254)
    )]
    max_delta: u8,

    #[command(flatten)]
    picture: PictureArgs,

    #[command(flatten)]
    reading: ReadingArgs,

    #[command(flatten)]
    camera: CameraArgs,
}

/// A scene that is checked.
pub(super) struct Checked {
    /// Scene file, or `-`.
    pub scene: PathBuf,
    /// What it is called, and its files in `--out`.
    pub name: OsString,
    /// Picture to compare with.
    pub golden: Option<PathBuf>,
    /// Ids to compare with.
    pub ids: Option<PathBuf>,
}

/// `check`, as it is to be done.
pub(super) struct CheckRequest {
    /// One at least.
    pub scenes: Vec<Checked>,
    /// The folder of the goldens, if they share one.
    pub goldens: Option<PathBuf>,
    /// Whether goldens are written.
    pub bless: bool,
    /// Where pictures that differ are written.
    pub out: Option<PathBuf>,
    /// Whether to print JSON.
    pub json: bool,
    /// Where a report is written.
    pub junit: Option<Target>,
    /// Pixels that may differ.
    pub max_different: u64,
    /// How far a channel may be off.
    pub max_delta: u8,
    /// Which pictures.
    pub picture: PictureArgs,
    /// How files of particles are read.
    pub reading: ReadingArgs,
    /// In place of the scenes' cameras.
    pub camera: CameraArgs,
}

impl CheckArgs {
    /// Gives each scene its golden, and refuses what would check nothing, or one golden twice.
    pub fn request(self) -> Result<CheckRequest, Failure> {
        let usage = |words: &str| Err(Failure::Usage(words.into()));
        if self.scenes.is_empty() {
            return usage(
                "nothing is checked: no scene is named; name one, or correct the pattern",
            );
        }
        if self.golden.is_none() && self.goldens.is_none() && self.ids.is_none() {
            return usage(
                "nothing is checked: add --golden FILE.png or --ids FILE.npy, or, for several \
                 scenes, --goldens DIR",
            );
        }
        let alone = [("--golden", &self.golden), ("--ids", &self.ids)];
        for (option, path) in alone.into_iter().filter_map(|(o, path)| Some((o, path.as_ref()?))) {
            if self.scenes.len() > 1 {
                return Err(Failure::Usage(format!(
                    "{option} is for one scene, and {} are named; give --goldens DIR, or name one",
                    self.scenes.len()
                )));
            }
            if path == Path::new("-") {
                return Err(Failure::Usage(format!("{option} -: a golden is a file; name one")));
            }
        }
        let junit = self.junit.as_deref().map(Target::from_arg);
        if let Some(junit) = &junit {
            junit.check_ending("--junit", "a report", "xml")?;
        }
        let scenes = self.checked()?;
        let Self { goldens, bless, out, json, max_different, max_delta, .. } = self;
        let Self { picture, reading, camera, .. } = self;
        Ok(CheckRequest {
            scenes,
            goldens,
            bless,
            out,
            json,
            junit,
            max_different,
            max_delta,
            picture,
            reading,
            camera,
        })
    }

    /// The scenes with their names and goldens.
    fn checked(&self) -> Result<Vec<Checked>, Failure> {
        let mut named: HashMap<OsString, &Path> = HashMap::new();
        let mut scenes = Vec::new();
        for scene in &self.scenes {
            let of_golden = || {
                let golden = self.golden.as_ref().or(self.ids.as_ref())?;
                golden.file_stem().map(OsString::from)
            };
            let name = match (stem(scene), &self.goldens) {
                (Some(name), _) => Some(name),
                (None, None) => of_golden(),
                (None, Some(_)) => {
                    return Err(Failure::Usage(format!(
                        "{} has no name, and so no golden in --goldens; give --golden FILE.png",
                        if scene == Path::new("-") {
                            "a scene from standard input".into()
                        } else {
                            planisphere_io::text::name(scene)
                        }
                    )));
                }
            };
            let name = name.unwrap_or_else(|| "scene".into());
            let own = self.goldens.as_ref().map(|folder| folder.join(with_png(name.clone())));
            if let (Some(golden), Some(other)) = (&own, named.insert(name.clone(), scene)) {
                let [one, two, golden] = [other, scene, golden].map(planisphere_io::text::name);
                return Err(Failure::Usage(format!(
                    "{one} and {two} would both have the golden {golden}; name one of them \
                     otherwise, or check them in two runs"
                )));
            }
            let golden = own.or_else(|| self.golden.clone());
            scenes.push(Checked { scene: scene.clone(), name, golden, ids: self.ids.clone() });
        }
        Ok(scenes)
    }
}

/// `view`, as typed.
#[cfg(feature = "window")]
#[derive(ClapArgs)]
pub(super) struct ViewArgs {
    /// Scene file (TOML), or a file of particles: XYZ, LAMMPS, PDB, mmCIF, GRO, PLY, CSV, npz, GSD,
    /// XTC, DCD; - for standard input
    #[arg(value_hint = clap::ValueHint::FilePath)]
    pub scene: PathBuf,

    /// Size of the picture in pixels at first, instead of the scene file's
    ///
    /// The window begins with it, or smaller if the screen is. Resizing the window keeps the width
    /// or height of the view that the scene gives (if it gives both, the height and the shape of
    /// the pixels) and shows more or less on the other side.
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    pub size: Option<[u32; 2]>,

    /// Device that draws: auto, gpu, cpu, or part of an adapter's name
    ///
    /// As for `render`; the window itself needs no GPU and no driver.
    #[arg(long, value_name = "DEVICE", default_value = "auto", value_parser = parse_device)]
    pub device: Device,

    #[command(flatten)]
    pub reading: ReadingArgs,

    #[command(flatten)]
    pub camera: CameraArgs,
}

/// `make`, as typed.
#[derive(ClapArgs)]
pub(super) struct MakeArgs {
    /// Kind of scene
    pub kind: MakeKind,

    /// Folder to write into, made if missing: centers.npy, radii.npy, colors.npy and scene.toml
    #[arg(value_hint = clap::ValueHint::DirPath)]
    pub folder: PathBuf,

    /// Number of spheres, such as 250000 or 1e6
    #[arg(long, default_value = "1e5", value_parser = parse_some)]
    pub count: u32,

    /// Seed of the random numbers: the same seed gives the same bytes on every machine
    #[arg(long, default_value_t = 1)]
    pub seed: u64,

    /// Replace files of these names that this command has not made, or that have been changed since
    #[arg(long)]
    pub force: bool,
}

/// Kinds of large example scenes.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum MakeKind {
    /// Equal spheres at random places in a unit cube, 7 % of its volume
    Cloud,
    /// A face-centred cubic lattice of touching spheres
    Lattice,
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    fn request(args: &[&str]) -> Result<RenderRequest, Failure> {
        match Args::try_parse_from([&["planisphere", "render"], args].concat()).unwrap().command {
            Command::Render(args) => args.request(),
            _ => unreachable!("render was asked for"),
        }
    }

    #[test]
    fn the_definition_is_sound() {
        Args::command().debug_assert();
    }

    #[test]
    fn outputs_have_defaults_and_endings() {
        assert_eq!(
            request(&["a/b.toml"]).unwrap().sinks.picture,
            Some(Target::File("b.png".into()))
        );
        assert_eq!(request(&["b.toml", "-o", "-"]).unwrap().sinks.picture, Some(Target::Stdout));
        assert_eq!(request(&["b.toml", "-o", "none", "--stats"]).unwrap().sinks.picture, None);
        for name in ["x.PNG", "x", "-", "/dev/null", "x.", ".png", "a.b.png"] {
            assert!(request(&["b.toml", "-o", name]).is_ok(), "{name}");
        }
        for (args, word) in [
            (&["b.toml", "-o", "none"][..], "nothing to do"),
            (&["b.toml", "-o", "b.bmp"], "name it .png"),
            (&["b.toml", "-o", "frame.0001"], "name it .png"),
            (&["b.toml", "--planes", "b.npy"], "name it b.npz"),
            (&["b.toml", "-o", "b.jpg", "--depth16"], "name the picture .png or .tif"),
            (&["b.toml", "--ids", "b.png"], "name it b.npy"),
            (&["b.toml", "--visibility", "b.npy"], "name it b.npz"),
            (&["-"], "-o OUT.png"),
        ] {
            let failure = request(args).err().expect("refused");
            assert!(failure.to_string().contains(word) && failure.exit_code() == 2, "{failure}");
        }
    }

    #[test]
    fn devices_have_names_in_any_case() {
        for (text, wanted) in [
            ("cpu", Device::Cpu),
            ("CPU", Device::Cpu),
            ("Auto", Device::Auto),
            ("GPU", Device::Gpu),
            ("Gpu", Device::Gpu),
            ("GeForce", Device::Named("GeForce".into())),
        ] {
            assert_eq!(parse_device(text), Ok(wanted), "{text}");
        }
        assert!(parse_device("").is_err() && parse_device("  ").is_err());
    }

    #[test]
    fn sizes_and_regions() {
        assert_eq!(parse_size("640x480"), Ok([640, 480]));
        for bad in ["640", "0x4", "4x0", "40000x1", "1x40000", "axb", "-1x5", "1x1x1"] {
            assert!(parse_size(bad).is_err(), "{bad}");
        }
        assert_eq!(parse_region("1,2, 3,4"), Ok(Region { x: 1, y: 2, width: 3, height: 4 }));
        for bad in ["1,2,3", "1,2,0,4", "1,2,3,4,5", "a,b,c,d", "-1,0,1,1"] {
            assert!(parse_region(bad).is_err(), "{bad}");
        }
    }
}
