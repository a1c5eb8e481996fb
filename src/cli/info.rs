//! `planisphere info`: what is in a file; without one, which devices there are, what each lacks,
//! and which one `auto` takes.

mod picture;

use std::path::{Path, PathBuf};

use clap::Args as ClapArgs;
use serde::Serialize;

use self::picture::Picture;
use super::{
    Failure,
    ends::{Ends, stdout_is_open},
    print,
    progress::Progress,
    reading::ReadingArgs,
    render::device_words,
};
use planisphere_io::{
    load::{Control, Loaded, Opened, header, open},
    particles::{Cell, Column, File, Understood, Values, understand},
};
#[cfg(feature = "gpu")]
use planisphere_renderer::adapters;
use planisphere_renderer::{Device, Renderer};

/// `info`, as typed.
#[derive(ClapArgs)]
pub(super) struct InfoArgs {
    /// File of particles, scene file, or picture (PNG); - for standard input
    #[arg(value_hint = clap::ValueHint::FilePath)]
    file: Option<PathBuf>,

    /// Print one JSON object
    #[arg(long, requires = "file")]
    json: bool,

    #[command(flatten)]
    reading: ReadingArgs,
}

/// What is in a file.
#[derive(Serialize)]
struct Contents {
    version: u32,
    file: String,
    format: String,
    /// How many frames there are, and the number of the one that the rest is of.
    #[serde(skip_serializing_if = "Option::is_none")]
    frames: Option<[usize; 2]>,
    particles: usize,
    columns: Vec<Described>,
    #[serde(rename = "box", skip_serializing_if = "Option::is_none")]
    cell: Option<Edges>,
    /// The least and the greatest centre.
    #[serde(skip_serializing_if = "Option::is_none")]
    bounds: Option<[[f64; 3]; 2]>,
    /// The least and the greatest radius that would be drawn.
    #[serde(skip_serializing_if = "Option::is_none")]
    radius: Option<[f64; 2]>,
    /// Where what would be drawn comes from.
    #[serde(skip_serializing_if = "Option::is_none")]
    drawn: Option<Drawn>,
    /// What should be known, each one line.
    notes: Vec<String>,
}

/// A column in few words.
#[derive(Serialize)]
struct Described {
    name: String,
    #[serde(rename = "type")]
    kind: &'static str,
    width: usize,
    /// The least and the greatest value that is a number.
    #[serde(skip_serializing_if = "Option::is_none")]
    range: Option<[f64; 2]>,
    /// Some of the words, and how many there are.
    #[serde(skip_serializing_if = "Option::is_none")]
    words: Option<(Vec<String>, usize)>,
}

/// A box.
#[derive(Serialize)]
struct Edges {
    origin: [f64; 3],
    edges: [[f64; 3]; 3],
}

/// Where what would be drawn comes from.
#[derive(Serialize)]
struct Drawn {
    centers: String,
    radii: String,
    colors: String,
}

impl Described {
    fn of(column: &Column) -> Self {
        /// Words that are listed.
        const MOST: usize = 8;
        let (kind, words) = match &column.values {
            Values::Words(words) => {
                let some = words.words.iter().take(MOST).map(|word| word.to_string());
                ("words", Some((some.collect(), words.words.len())))
            }
            Values::Integers(_) => ("integers", None),
            Values::Bytes(_) => ("bytes", None),
            Values::Reals(_) => ("reals", None),
        };
        let range = column.values.range();
        Self { name: column.name.clone(), kind, width: column.width, range, words }
    }

    fn line(&self) -> String {
        let Self { name, kind, width, range, words } = self;
        let across = if *width == 1 { String::new() } else { format!(" x {width}") };
        let values = match (range, words) {
            (_, Some((some, count))) => {
                let more = if *count > some.len() { ", ..." } else { "" };
                format!("{count}: {}{more}", some.join(", "))
            }
            (Some([low, high]), None) => format!("{low} to {high}"),
            (None, None) => String::new(),
        };
        format!("  {name:<12} {kind}{across}  {values}\n")
    }
}

impl Contents {
    fn of_particles(file: &File, found: &Understood, frames: usize) -> Self {
        let Understood { frame, particles, spheres, .. } = found;
        let block = &spheres.block;
        let radii = (0..block.len()).map(|index| block.radius(index));
        let centers = (0..block.len()).map(|index| block.center(index).to_array());
        let notes = [file.notes(), &particles.notes, &spheres.notes].concat();
        Self {
            version: 1,
            file: file.name().into(),
            format: file.title().into(),
            frames: Some([frames, *frame]),
            particles: particles.len(),
            columns: particles.columns.iter().map(Described::of).collect(),
            cell: particles.cell.map(|Cell { origin, edges }| Edges { origin, edges }),
            bounds: bounds(centers),
            radius: bounds(radii.map(|radius| [radius])).map(|[low, high]| [low[0], high[0]]),
            drawn: Some(Drawn {
                centers: particles.centers_from.clone(),
                radii: spheres.radii_from.clone(),
                colors: spheres.colors_from.clone(),
            }),
            notes,
        }
    }

    fn of_scene(path: &Path, loaded: &Loaded) -> Self {
        let bounds = (!loaded.scene.is_empty()).then(|| loaded.scene.bounds());
        Self {
            version: 1,
            file: planisphere_io::text::name(path),
            format: "scene file".into(),
            frames: None,
            particles: loaded.scene.len(),
            columns: Vec::new(),
            cell: None,
            bounds: bounds.map(|b| [b.min_center.to_array(), b.max_center.to_array()]),
            radius: bounds.map(|b| [b.min_radius, b.max_radius]),
            drawn: None,
            notes: [&loaded.understood[..], &loaded.notes].concat(),
        }
    }

    fn text(&self) -> String {
        let mut text = format!("{}: {}\n", self.file, self.format);
        if let Some([frames, frame]) = self.frames {
            text += &format!("frames     {frames}; what follows is of frame {frame}\n");
        }
        text += &format!("particles  {}\n", self.particles);
        if let Some(Edges { origin, edges }) = &self.cell {
            let list = |v: &[f64; 3]| format!("({}, {}, {})", v[0], v[1], v[2]);
            let edges: Vec<String> = edges.iter().map(list).collect();
            text += &format!("box        from {}, edges {}\n", list(origin), edges.join(" "));
        }
        if let Some([least, most]) = &self.bounds {
            let axis = |k: usize| format!("{} {} to {}", ["x", "y", "z"][k], least[k], most[k]);
            text += &format!("bounds     {}, {}, {}\n", axis(0), axis(1), axis(2));
        }
        if let Some([low, high]) = self.radius {
            text += &format!("radius     {low} to {high}\n");
        }
        if let Some(Drawn { centers, radii, colors }) = &self.drawn {
            text += &format!("drawn      centres: {centers}; radii: {radii}; colours: {colors}\n");
        }
        if !self.columns.is_empty() {
            text += "columns\n";
        }
        self.columns.iter().for_each(|column| text += &column.line());
        self.notes.iter().for_each(|note| text += &format!("note: {note}\n"));
        text
    }
}

/// The least and the greatest of each component; none of nothing.
fn bounds<const N: usize>(rows: impl Iterator<Item = [f64; N]>) -> Option<[[f64; N]; 2]> {
    rows.fold(None, |found: Option<[[f64; N]; 2]>, row| {
        let [mut low, mut high] = found.unwrap_or([row, row]);
        for axis in 0..N {
            low[axis] = low[axis].min(row[axis]);
            high[axis] = high[axis].max(row[axis]);
        }
        Some([low, high])
    })
}

/// Says what is in a file; without one, lists devices.
pub(super) fn run(args: &InfoArgs) -> Result<(), Failure> {
    stdout_is_open()?;
    let Some(path) = &args.file else {
        return args.reading.refuse_alone().and_then(|()| devices());
    };
    let mut ends = Ends::new(Vec::new(), Some("info"));
    ends.reads(path);
    args.reading.others().for_each(|path| ends.reads(path));
    ends.check()?;
    if let Some(header) = header(path)? {
        args.reading.refuse_for_picture(path)?;
        let picture = Picture::of(path, header);
        return say_contents(args, &picture, &picture.text());
    }
    let control = Control::new();
    let progress = Progress::of("reading", &control);
    let options = args.reading.options();
    let contents = match open(path, &options, &control)? {
        Opened::Particles(file) => {
            let found = understand(&file, options.frame, &options.appearance, &control)?;
            let frames = file.frames(&control)?;
            file.unchanged()?;
            Contents::of_particles(&file, &found, frames)
        }
        Opened::Scene(loaded) => {
            args.reading.refuse_for_scene(path)?;
            super::unless_changed(&loaded.watch, || Ok(Contents::of_scene(path, &loaded)))?
        }
    };
    drop(progress);
    say_contents(args, &contents, &contents.text())
}

/// Prints what is in a file, as text or as JSON.
fn say_contents(args: &InfoArgs, contents: &impl Serialize, text: &str) -> Result<(), Failure> {
    if !args.json {
        return print(&planisphere_io::text::lines(text));
    }
    let json = serde_json::to_string(contents).expect("numbers and strings are always JSON");
    print(&format!("{}\n", planisphere_io::text::json(&json)))
}

/// Where software drivers come from.
const SOFTWARE: &str = "
Software drivers, for tests and CI without a GPU: llvmpipe (Debian's mesa-vulkan-drivers), and \
SwiftShader, which is in
Debian's chromium-common: `apt-get download chromium-common && dpkg-deb -x chromium-common_*.deb \
swiftshader`, then
VK_DRIVER_FILES=$PWD/swiftshader/usr/lib/chromium/vk_swiftshader_icd.json. The pictures are the \
same on both.
";

/// Lists the native device and every adapter, and opens what `auto` and `gpu` take.
fn devices() -> Result<(), Failure> {
    let threads = rayon::current_num_threads();
    let mut text = format!("cpu   native, {threads} threads; needs no driver\n");
    text += &gpus();
    text += "\n";
    match Renderer::open(&Device::Gpu) {
        Ok(gpu) if gpu.is_news() => {
            text += &format!("--device gpu   takes {} ({})\n", gpu.device(), gpu.why());
        }
        Ok(gpu) => text += &format!("--device gpu   takes {}\n", gpu.device()),
        Err(error) => text += &format!("--device gpu   {}\n", Failure::from(error)),
    }
    let auto = Renderer::open(&Device::Auto)?;
    text += &format!("--device auto  takes {}\n", device_words(&auto));
    if cfg!(target_os = "linux") {
        text += SOFTWARE;
    }
    print(&planisphere_io::text::lines(&text))
}

/// A line for each adapter, and more for what it has not.
#[cfg(feature = "gpu")]
fn gpus() -> String {
    let mut text = String::new();
    for found in adapters() {
        let state = match found.lacks.as_slice() {
            [] => "usable".to_owned(),
            lacks => format!("not usable: lacks {}", lacks.join(", ")),
        };
        text += &format!("gpu   {}: {}, {state}\n", found.name, found.kind);
        for remark in found.remarks {
            text += &format!("        {remark}\n");
        }
    }
    text
}

#[cfg(not(feature = "gpu"))]
fn gpus() -> String {
    String::new()
}
