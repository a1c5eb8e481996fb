//! Options of files of particles: which frame is read, how large particles are, in which colour.

use std::path::{Path, PathBuf};

use clap::Args as ClapArgs;

use super::Failure;
use planisphere_io::{
    load::{self, Control, Loaded, Opened},
    particles::{
        Format, Frame, Map, Options,
        spheres::{Appearance, ColorFrom, RadiusFrom},
    },
    text,
};

/// How a file of particles is read and drawn, as typed.
#[derive(ClapArgs, Clone, Debug, Default)]
#[command(next_help_heading = "Files of particles")]
pub(super) struct ReadingArgs {
    /// Format of the file, where its content does not tell it: docs/formats.md has all
    #[arg(long, value_name = "FORMAT", value_parser = parse_format)]
    pub format: Option<Format>,

    /// Frame of a trajectory: counted from 0, or backwards from -1, which is `last`
    #[arg(
        long,
        value_name = "K",
        value_parser = parse_frame,
        allow_hyphen_values = true
    )]
    pub frame: Option<Frame>,

    /// File with what a trajectory (XTC, DCD) lacks: its first frame's names, elements and radii
    #[arg(long, value_name = "FILE", value_hint = clap::ValueHint::FilePath)]
    pub topology: Option<PathBuf>,

    /// Radius: a number, `vdw` or `covalent` (of the elements), or the name of a column
    ///
    /// The default is a column of radii or diameters; else the van der Waals radius of the
    /// element; else half the usual distance between neighbours.
    #[arg(
        long,
        value_name = "R|vdw|covalent|COLUMN",
        value_parser = parse_radius,
        allow_negative_numbers = true
    )]
    pub radius: Option<RadiusFrom>,

    /// Number that every radius is multiplied by
    #[arg(
        long,
        value_name = "FACTOR",
        value_parser = parse_positive,
        allow_negative_numbers = true
    )]
    pub radius_scale: Option<f64>,

    /// One colour for all: #rrggbb, #rgb or a name of CSS
    #[arg(long, value_name = "COLOR", value_parser = parse_color, conflicts_with = "color_by")]
    pub color: Option<[u8; 3]>,

    /// Column whose values are the colours; also x, y or z, and velocity.x for a component
    ///
    /// The default is a column of colours; else that of the element (Jmol's); else of the type.
    #[arg(long, value_name = "COLUMN")]
    pub color_by: Option<String>,

    /// Colour map of --color-by: viridis, magma, inferno, plasma, cividis, turbo, batlow, coolwarm;
    /// tab10 and tab20 for types
    #[arg(long, value_name = "NAME", value_parser = parse_map, requires = "color_by")]
    pub map: Option<Map>,

    /// Values at the ends of the map, LO,HI; `auto` are the least and the greatest of the frame
    #[arg(
        long,
        value_name = "LO,HI|auto",
        value_parser = parse_range,
        requires = "color_by",
        allow_hyphen_values = true
    )]
    pub range: Option<Range>,
}

/// The ends of a map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Range(Option<[f64; 2]>);

impl ReadingArgs {
    /// The options, with their defaults.
    pub fn options(&self) -> Options {
        let color = match (&self.color, &self.color_by) {
            (Some(color), _) => ColorFrom::Same(*color),
            (None, Some(column)) => ColorFrom::Column(column.clone()),
            (None, None) => ColorFrom::Chosen,
        };
        let appearance = Appearance {
            radius: self.radius.clone().unwrap_or(RadiusFrom::Chosen),
            radius_scale: self.radius_scale.unwrap_or(1.0),
            color,
            map: self.map,
            range: self.range.and_then(|range| range.0),
        };
        let frame = self.frame.unwrap_or_default();
        let topology = self.topology.clone();
        Options { format: self.format, frame, topology, appearance, outline_by: None }
    }

    /// The options that were typed.
    fn typed(&self) -> Vec<&'static str> {
        let all = [
            ("--format", self.format.is_some()),
            ("--frame", self.frame.is_some()),
            ("--topology", self.topology.is_some()),
            ("--radius", self.radius.is_some()),
            ("--radius-scale", self.radius_scale.is_some()),
            ("--color", self.color.is_some()),
            ("--color-by", self.color_by.is_some()),
            ("--map", self.map.is_some()),
            ("--range", self.range.is_some()),
        ];
        all.into_iter().filter_map(|(name, typed)| typed.then_some(name)).collect()
    }

    /// The options that were typed, with their values, each word for itself. Of a file's name no
    /// folders.
    pub fn words(&self) -> Vec<String> {
        let hex = |[red, green, blue]: [u8; 3]| format!("#{red:02x}{green:02x}{blue:02x}");
        let topology = self.topology.as_deref().and_then(Path::file_name).map(text::name);
        let all = [
            ("--format", self.format.map(|format| format.name().to_owned())),
            ("--frame", self.frame.map(frame_word)),
            ("--topology", topology),
            ("--radius", self.radius.as_ref().and_then(radius_word)),
            ("--radius-scale", self.radius_scale.map(|scale| scale.to_string())),
            ("--color", self.color.map(hex)),
            ("--color-by", self.color_by.clone()),
            ("--map", self.map.map(|map| map.name().to_owned())),
            ("--range", self.range.map(range_word)),
        ];
        let typed = all.into_iter().filter_map(|(option, word)| Some([option.to_owned(), word?]));
        typed.flatten().collect()
    }

    /// Reads a scene file, or a file of particles. `outline_by`: where lines are drawn, if that was
    /// typed.
    pub fn load(
        &self,
        path: &Path,
        outline_by: Option<&str>,
        control: &Control,
    ) -> Result<Loaded, Failure> {
        let options = Options { outline_by: outline_by.map(Into::into), ..self.options() };
        match load::open(path, &options, control)? {
            Opened::Scene(loaded) => self.refuse_for_scene(path).map(|()| *loaded),
            Opened::Particles(file) => Ok(load::of_frame(&file, &options, control)?),
        }
    }

    /// The files that are read beside the one that is drawn.
    pub fn others(&self) -> impl Iterator<Item = &Path> {
        self.topology.as_deref().into_iter()
    }

    /// Refuses options where there is no file that they could be for.
    pub fn refuse_alone(&self) -> Result<(), Failure> {
        match self.typed().first() {
            None => Ok(()),
            Some(option) => Err(Failure::Usage(format!("{option} is for a file; name one"))),
        }
    }

    /// Refuses options that say nothing of a picture.
    pub fn refuse_for_picture(&self, path: &Path) -> Result<(), Failure> {
        match self.typed().first() {
            None => Ok(()),
            Some(option) => Err(Failure::Usage(format!(
                "{option} is for files of particles, and {} is a picture; leave it out",
                text::name(path)
            ))),
        }
    }

    /// Refuses options that say nothing of a scene file.
    pub fn refuse_for_scene(&self, path: &Path) -> Result<(), Failure> {
        match self.typed().first() {
            None => Ok(()),
            Some(option) => Err(Failure::Usage(format!(
                "{option} is for files of particles, and {} is a scene file; write it as a key of \
                 [[spheres]] there, or leave it out",
                text::name(path)
            ))),
        }
    }
}

fn frame_word(frame: Frame) -> String {
    match frame {
        Frame::FromFirst(number) => number.to_string(),
        Frame::FromLast(0) => "last".into(),
        Frame::FromLast(number) => format!("-{}", number + 1),
    }
}

fn radius_word(radius: &RadiusFrom) -> Option<String> {
    Some(match radius {
        RadiusFrom::Same(radius) => radius.to_string(),
        RadiusFrom::Column(name) => name.clone(),
        RadiusFrom::VanDerWaals => "vdw".into(),
        RadiusFrom::Covalent => "covalent".into(),
        RadiusFrom::Chosen => return None,
    })
}

fn range_word(Range(range): Range) -> String {
    range.map_or("auto".into(), |[low, high]| format!("{low},{high}"))
}

pub(super) fn parse_format(typed: &str) -> Result<Format, String> {
    Format::named(typed).ok_or_else(|| {
        let names: Vec<&str> = Format::all().map(Format::name).collect();
        format!("the formats are {}", names.join(", "))
    })
}

pub(super) fn parse_frame(typed: &str) -> Result<Frame, String> {
    if typed.eq_ignore_ascii_case("last") {
        return Ok(Frame::FromLast(0));
    }
    let fix = || "write a number from 0 on, a negative one (-1 is the last), or `last`".to_owned();
    typed.parse::<i64>().map(Frame::from).map_err(|_| fix())
}

fn parse_radius(typed: &str) -> Result<RadiusFrom, String> {
    if typed.is_empty() {
        return Err("write a number, vdw, covalent, or the name of a column".into());
    }
    match typed.parse::<f64>() {
        Ok(radius) if radius > 0.0 && radius.is_finite() => Ok(RadiusFrom::Same(radius)),
        Ok(_) => Err("a radius is greater than 0 and finite".into()),
        Err(_) => Ok(RadiusFrom::from(typed)),
    }
}

pub(super) fn parse_positive(typed: &str) -> Result<f64, String> {
    let value = typed.parse().ok().filter(|value: &f64| *value > 0.0 && value.is_finite());
    value.ok_or_else(|| "write a number greater than 0, such as 0.8".into())
}

pub(super) fn parse_color(typed: &str) -> Result<[u8; 3], String> {
    load::color(typed)
}

fn parse_map(typed: &str) -> Result<Map, String> {
    Map::named(&typed.to_ascii_lowercase()).ok_or_else(|| {
        let names: Vec<&str> = Map::ALL.iter().map(|map| map.name()).collect();
        format!("the maps are {}", names.join(", "))
    })
}

fn parse_range(typed: &str) -> Result<Range, String> {
    if typed.eq_ignore_ascii_case("auto") {
        return Ok(Range(None));
    }
    let fix = || "write two numbers, the less one first, such as -1,1; or auto".to_owned();
    let (low, high) = typed.split_once(',').ok_or_else(fix)?;
    let end = |text: &str| text.trim().parse().ok().filter(|value: &f64| value.is_finite());
    match (end(low), end(high)) {
        (Some(low), Some(high)) if low <= high => Ok(Range(Some([low, high]))),
        _ => Err(fix()),
    }
}
