//! What a scene file means: `[camera]`, `[image]`, `[[sphere]]` and `[[spheres]]`, each key checked
//! at its place.

use std::{
    ops::Range,
    path::{Path, PathBuf},
    sync::{
        Arc,
        atomic::{AtomicUsize, Ordering},
    },
};

use glam::DVec3;
use rayon::prelude::*;
use toml::de::{DeTable, DeValue};

use crate::{
    colors::DEFAULT_COLOR,
    input::{
        mapped::{ChangedFile, Mapped},
        refused::Refused,
        report::Fault,
    },
    legend::Legend,
    load::{
        DEFAULT_IMAGE, Loaded, Overlay, Watch,
        batches::{self, Batches, Piece},
        document::{Section, Value, color, integer, number, string, vector},
        look, overlay,
    },
    npy::array::{Array, Copied, Key, Taken},
};
use planisphere_core::{
    axes::parallel,
    camera::{Camera, CameraError, ImageSize, MAX_SIDE, Projection, ScreenSize},
    drawing::Control,
    fov::height_from_fov,
    framing::Wanted,
    scene::{Block, Colors, Radii, Scene, SceneError, Sphere},
    text,
};
use planisphere_image::look::Look;

/// Reads the text of a scene file, and maps the arrays it names relative to `folder`. `outline_by`:
/// in place of what the file says.
pub(super) fn read(
    text: &str,
    folder: &Path,
    outline_by: Option<&str>,
    control: &Control,
) -> Result<Loaded, Fault> {
    Fault::if_cancelled(control)?;
    let read_document = |document: &DeTable, spheres: Vec<Sphere>| {
        read_document(document, spheres, Files::new(folder, control), outline_by)
    };
    if let Some(at) = text.find('\0') {
        return Err(batches::stray(at..at + 1, 0));
    }
    // Before line ends are looked for: such a file is one line.
    if let (Some(at), None) = (text.find('\r'), text.find('\n')) {
        return Err(batches::stray(at..at + 1, b'\r'));
    }
    if !batches::large(text) {
        batches::check_keys(text)?;
        let document = DeTable::parse(text).map_err(|error| syntax(&error, text))?;
        return read_document(document.get_ref(), Vec::new());
    }
    if let Some(batches) = batches::quick(text, control)
        && let Some(spheres) = read_quickly(text, &batches, control)
        && let Ok(document) = DeTable::parse(&batches.rest.text(text))
        && !document.get_ref().contains_key("sphere")
    {
        return read_document(document.get_ref(), spheres)
            .map_err(|fault| fault.moved(|at| batches.rest.place(at)));
    }
    let batches = batches::exact(text, control)?;
    let rest = batches.rest.text(text);
    let moved = |fault: Fault| fault.moved(|at| batches.rest.place(at));
    let document = DeTable::parse(&rest).map_err(|error| moved(syntax(&error, &rest)))?;
    let root = Section::of_table("", document.get_ref(), 0..0, &KNOWN).map_err(moved)?;
    let parsed = Parsed::new(&batches, control);
    let read = |piece| parsed.read_piece(text, piece);
    let spheres = batches.pieces.par_iter().map(read).collect::<Vec<_>>();
    if let (Some(value), false) = (root.get("sphere"), spheres.is_empty()) {
        return Err(moved(Fault::new(
            "not TOML: duplicate key, `sphere` is a table and a list of tables",
            value.span(),
            "here",
            "write each sphere under [[sphere]], with two brackets on each side",
        )));
    }
    // In the order of the file, whichever was read first.
    let spheres = parsed.join(spheres.into_iter().collect::<Result<Vec<_>, _>>()?)?;
    read_document(document.get_ref(), spheres).map_err(moved)
}

/// The tables that a scene file has.
const KNOWN: [&str; 4] = ["camera", "image", "sphere", "spheres"];

/// The spheres of all pieces; or nothing when there is any fault in them, which may be that of the
/// cut. Nothing, too, once it is cancelled.
fn read_quickly(text: &str, batches: &Batches, control: &Control) -> Option<Vec<Sphere>> {
    let parsed = Parsed::new(batches, control);
    let spheres: Option<Vec<Vec<Sphere>>> =
        batches.pieces.par_iter().map(|piece| parsed.read_piece(text, piece).ok()).collect();
    parsed.join(spheres?).ok()
}

/// How many pieces of a file are parsed.
struct Parsed<'c> {
    control: &'c Control,
    /// Of all the pieces.
    share: Control,
    done: AtomicUsize,
    pieces: usize,
}

impl<'c> Parsed<'c> {
    /// None of them yet.
    fn new(batches: &Batches, control: &'c Control) -> Self {
        let share = control.part([0.2, 0.7]);
        Self { control, share, done: AtomicUsize::new(0), pieces: batches.pieces.len() }
    }

    /// The spheres of one piece, unless it is cancelled.
    fn read_piece(&self, text: &str, piece: &Piece) -> Result<Vec<Sphere>, Fault> {
        Fault::if_cancelled(self.control)?;
        let spheres = read_piece(text, piece)?;
        let done = 1 + self.done.fetch_add(1, Ordering::Relaxed);
        self.share.reach(done as f32 / self.pieces as f32);
        Ok(spheres)
    }

    /// The spheres of all pieces in a row.
    fn join(&self, pieces: Vec<Vec<Sphere>>) -> Result<Vec<Sphere>, Fault> {
        let mut spheres = Vec::with_capacity(pieces.iter().map(Vec::len).sum());
        for piece in pieces {
            Fault::if_cancelled(self.control)?;
            spheres.extend(piece);
        }
        Ok(spheres)
    }
}

/// The spheres of one piece.
fn read_piece(text: &str, piece: &Piece) -> Result<Vec<Sphere>, Fault> {
    let part = piece.text(text);
    let read = || {
        let document = DeTable::parse(&part).map_err(|error| syntax(&error, &part))?;
        let root = Section::of_table("", document.get_ref(), 0..0, &["sphere"])?;
        tables(&root, "sphere")?.iter().map(read_sphere).collect::<Result<Vec<_>, _>>()
    };
    read().map_err(|fault: Fault| fault.moved(|at| piece.place(at)))
}

/// Reads a parsed document, whose first spheres may have been read before.
fn read_document(
    document: &DeTable,
    singles: Vec<Sphere>,
    mut files: Files,
    outline_by: Option<&str>,
) -> Result<Loaded, Fault> {
    Fault::if_cancelled(files.control)?;
    files.control.reach(0.7);
    let root = Section::of_table("", document, 0..0, &KNOWN)?;
    let image = root.get("image").map_or_else(|| Ok(Image::default()), read_image)?;
    let camera = root.get("camera").map(read_camera).transpose()?;
    files.grouping.column = match outline_by {
        None => image.column.clone(),
        Some("jump" | "sphere") => None,
        Some(typed) => Some((typed.to_owned(), None)),
    };
    let (scene, files) = read_spheres(&root, singles, files)?;
    finish(scene, camera, image, files)
}

/// A fault of the TOML itself, in the parser's words.
fn syntax(error: &toml::de::Error, text: &str) -> Fault {
    let message = error.message().lines().collect::<Vec<_>>().join(", ");
    let span = error.span().unwrap_or(text.len()..text.len());
    if message.contains("recurs") {
        return batches::too_deep(span);
    }
    // The parser points behind a carriage return that is alone.
    for at in [span.start, span.start.saturating_sub(1)] {
        match text.as_bytes().get(at..) {
            Some([b'\r', b'\n', ..]) | Some([b'\n' | b'\t', ..]) => {}
            Some([byte, ..]) if byte.is_ascii_control() => {
                return batches::stray(at..at + 1, *byte);
            }
            _ => {}
        }
    }
    let fix = if message.contains("duplicate key") {
        "remove one of the two"
    } else {
        "write `key = value` lines under [camera], [image], [[sphere]] or [[spheres]], strings in \
         quotes (https://toml.io)"
    };
    Fault::new(format!("not TOML: {message}"), span, "here", fix)
}

/// What `[image]` says.
struct Image {
    size: ImageSize,
    look: Look,
    overlay: Overlay,
    /// The column of groups that lines go by, and where it stands.
    column: Option<Wish>,
    /// Where the legend is asked for.
    legend: Range<usize>,
}

/// A name, and its place in the file; none of one that was typed.
type Wish = (String, Option<Range<usize>>);

impl Default for Image {
    fn default() -> Self {
        let (look, overlay) = (Look::flat(), Overlay::default());
        Self { size: DEFAULT_IMAGE, look, overlay, column: None, legend: 0..0 }
    }
}

fn read_image(value: &Value) -> Result<Image, Fault> {
    let known = ["width", "height"].into_iter().chain(look::KEYS).chain(overlay::KEYS);
    let section = Section::new("[image]", value, &known.collect::<Vec<&str>>())?;
    let side = |key: &str, default: u32| -> Result<u32, Fault> {
        let Some(found) = section.read(key, integer)? else { return Ok(default) };
        u32::try_from(found).ok().filter(|side| (1..=MAX_SIDE).contains(side)).ok_or_else(|| {
            Fault::new(
                format!("the image's {key} is {found} pixels"),
                section.place(key),
                format!("not 1 to {MAX_SIDE}"),
                format!("write a {key} from 1 to {MAX_SIDE}"),
            )
        })
    };
    let size = ImageSize {
        width: side("width", DEFAULT_IMAGE.width)?,
        height: side("height", DEFAULT_IMAGE.height)?,
    };
    let (look, column) = look::read(&section)?;
    Ok(Image {
        size,
        look,
        overlay: overlay::read(&section)?,
        column: column.map(|column| (column, Some(section.place("outline_by")))),
        legend: section.place("legend"),
    })
}

/// What `[camera]` says, with its places.
struct ReadCamera<'t, 'i> {
    section: Section<'t, 'i>,
    wanted: Wanted,
    notes: Vec<String>,
}

fn read_camera<'t, 'i>(value: &'t Value<'i>) -> Result<ReadCamera<'t, 'i>, Fault> {
    let known =
        ["projection", "origin", "view", "look_at", "up", "width", "height", "fov", "near", "far"];
    let section = Section::new("[camera]", value, &known)?;
    let projection = section.read("projection", projection)?.unwrap_or(Projection::Orthographic);
    section.not_both("view", "look_at")?;
    let (size, notes) = read_screen(&section, projection)?;
    let wanted = Wanted {
        projection,
        origin: section.read("origin", vector)?,
        view: section.read("view", vector)?,
        look_at: section.read("look_at", vector)?,
        up: section.read("up", vector)?,
        size,
        near: section.read("near", number)?.unwrap_or(0.0),
        far: section.read("far", number)?.unwrap_or(f64::INFINITY),
        zoom: 1.0,
    };
    // What is given must be right whatever is in the scene: other numbers stand for what is left
    // out.
    let up = wanted.up.unwrap_or(DVec3::Z);
    let given = wanted.view.or_else(|| Some(wanted.look_at? - wanted.origin?));
    let stand_in = Camera {
        projection,
        origin: wanted.origin.unwrap_or_default(),
        view: given.unwrap_or(if parallel(up, DVec3::X) { DVec3::Y } else { DVec3::X }),
        up,
        size: size.unwrap_or(ScreenSize::Width(1.0)),
        near: wanted.near,
        far: wanted.far,
    };
    stand_in.check().map_err(|error| camera_fault(&section, &error))?;
    Ok(ReadCamera { section, wanted, notes })
}

/// Puts together what has been read. The scene is looked at to choose what `[camera]` leaves out.
fn finish(
    scene: Scene,
    camera: Option<ReadCamera>,
    image: Image,
    files: Files,
) -> Result<Loaded, Fault> {
    let Image { size: image, look, overlay, legend: place, .. } = image;
    let wanted = camera.as_ref().map(|camera| camera.wanted);
    if let Err(error) = wanted.unwrap_or_default().camera(&scene.bounds(), image).check() {
        let too_large = |span| {
            Fault::new(
                "no camera can be framed around so large a scene: it would stand beyond the range \
                 of 64-bit floats",
                span,
                "left to be chosen",
                "give [camera] an origin, a view and a width, or divide all centres and radii by \
                 a power of ten",
            )
        };
        return Err(match &camera {
            Some(ReadCamera { section, wanted, .. }) => match error {
                CameraError::UpParallel if section.get("up").is_some() => Fault::new(
                    "up is parallel to the direction from the origin to the middle of the scene",
                    section.place("up"),
                    "parallel to where the camera looks",
                    "leave `up` out, or add a `view` that points another way",
                ),
                error if wanted.fixed().is_some() => camera_fault(section, &error),
                _ => too_large(section.span.clone()),
            },
            None => too_large(0..0),
        });
    }
    let notes = camera.map_or(Vec::new(), |camera| camera.notes);
    let fixed_camera = wanted.and_then(|wanted| wanted.fixed());
    let Files { paths, watch, copied, understood, grouping, legends, .. } = files;
    let legend = joined(legends);
    if let (Some(_), Err(words)) = (&overlay.legend, &legend) {
        return Err(Fault::new(
            format!("there is no legend: {words}"),
            place,
            "of what?",
            "write color_by = \"the name of a column\" below `file`, or remove the line",
        ));
    }
    Ok(Loaded {
        scene,
        fixed_camera,
        wanted,
        image,
        look,
        overlay,
        legend,
        groups: grouping.column.map(|_| grouping.groups),
        files: paths,
        watch,
        copied,
        notes,
        understood,
    })
}

/// The camera of a scene file, whatever else is in it.
pub(super) fn camera(text: &str) -> Result<Wanted, Fault> {
    let document = DeTable::parse(text).map_err(|error| syntax(&error, text))?;
    match document.get_ref().get("camera") {
        Some(value) => Ok(read_camera(value)?.wanted),
        None => Err(Fault::whole(
            "there is no [camera] in this file",
            "name a scene file that has one (in `planisphere view`, S prints the camera)",
        )),
    }
}

fn projection(_: &str, value: &Value) -> Result<Projection, Fault> {
    match string("projection", value)?.as_str() {
        "orthographic" => Ok(Projection::Orthographic),
        "perspective" => Ok(Projection::Perspective),
        other => Err(Fault::new(
            format!("unknown projection \"{}\"", text::value(other)),
            value.span(),
            "unknown",
            "write projection = \"orthographic\" or projection = \"perspective\"",
        )),
    }
}

fn read_screen(
    section: &Section,
    projection: Projection,
) -> Result<(Option<ScreenSize>, Vec<String>), Fault> {
    section.not_both("width", "fov")?;
    section.not_both("height", "fov")?;
    let fov = section.read("fov", number)?;
    let screen = (section.read("width", number)?, section.read("height", number)?);
    match (projection, fov, screen) {
        (Projection::Orthographic, Some(_), _) => Err(Fault::new(
            "`fov` is given, but the camera is orthographic",
            section.place("fov"),
            "an orthographic camera has no field of view",
            "add projection = \"perspective\", or give `width` in world units instead of `fov`",
        )),
        (Projection::Perspective, Some(fov), _) => match height_from_fov(fov) {
            Ok(height) => Ok((Some(ScreenSize::Height(height)), Vec::new())),
            Err(error) => Err(camera_fault(section, &error)),
        },
        (_, None, (width, height)) => {
            let notes = match projection {
                Projection::Perspective => wide(width, height).into_iter().collect(),
                Projection::Orthographic => Vec::new(),
            };
            let size = match (width, height) {
                (Some(width), Some(height)) => Some(ScreenSize::Both { width, height }),
                (Some(width), None) => Some(ScreenSize::Width(width)),
                (None, Some(height)) => Some(ScreenSize::Height(height)),
                (None, None) => None,
            };
            Ok((size, notes))
        }
    }
}

/// A word on a perspective screen that is meant for an orthographic camera, as far as one can tell:
/// who wants a field of view of more than 150 degrees says so in degrees.
fn wide(width: Option<f64>, height: Option<f64>) -> Option<String> {
    let sides =
        [("width", width), ("height", height)].map(|(key, side)| (key, side.unwrap_or(0.0)));
    let (key, side) = if sides[1].1 > sides[0].1 { sides[1] } else { sides[0] };
    let degrees = 2.0 * (0.5 * side).atan().to_degrees();
    let instead = if width.is_some() && height.is_some() {
        "`width` and `height`".into()
    } else {
        format!("`{key}`")
    };
    (degrees > 150.0).then(|| {
        format!(
            "{key} {side} at distance 1 is a field of view of {degrees:.0} degrees; fov = 60.0 is \
             usual, in place of {instead}"
        )
    })
}

/// The camera's own words, split into what is wrong and the fix, at the place that they speak of.
fn camera_fault(section: &Section, error: &CameraError) -> Fault {
    let words = error.to_string();
    let (message, fix) = words.split_once("; ").unwrap_or((&words, "correct the camera"));
    let direction = if section.get("look_at").is_some() { "look_at" } else { "view" };
    match error {
        CameraError::NotFinite(_) => Fault::new(
            "look_at - origin is beyond the range of 64-bit floats",
            section.place(direction),
            "too far from the origin",
            "give a point nearer to the camera, or `view`, a direction, in its place",
        ),
        CameraError::ZeroView if direction == "look_at" => Fault::new(
            "`look_at` is the camera's origin: the view direction is zero",
            section.place("look_at"),
            "the same point as the origin",
            "give another point, or `view`, a direction, in its place",
        ),
        CameraError::ZeroView => Fault::new(message, section.place("view"), "zero", fix),
        CameraError::Fov(_) => {
            Fault::new(message, section.place("fov"), "not between 0 and 180", fix)
        }
        CameraError::UpZero => Fault::new(
            "up is zero, which points nowhere",
            section.place("up"),
            "zero",
            match section.read("view", vector) {
                Ok(Some(view)) if parallel(view, DVec3::Z) => "write up = [0.0, 1.0, 0.0]",
                _ => "leave `up` out: it is [0.0, 0.0, 1.0] then",
            },
        ),
        CameraError::UpParallel if section.get("up").is_none() => Fault::new(
            "the view direction is parallel to the default up, [0, 0, 1]",
            section.place(direction),
            "along the z axis",
            "add an `up` that points another way, such as up = [0.0, 1.0, 0.0]",
        ),
        CameraError::UpParallel => {
            Fault::new(message, section.place("up"), "parallel to the view direction", fix)
                .and(section.place(direction), "the view direction")
        }
        CameraError::Size { what, .. } => {
            let key = if section.get("fov").is_some() { "fov" } else { what };
            Fault::new(message, section.place(key), "not positive", fix)
        }
        CameraError::Planes { near, .. } if *near < 0.0 => Fault::new(
            format!("near is {near}, which is behind the camera"),
            section.place("near"),
            "negative",
            "write a near of 0 or more",
        ),
        CameraError::Planes { .. }
            if section.get("near").is_some() && section.get("far").is_some() =>
        {
            Fault::new(message, section.place("near"), "not less than far", fix)
                .and(section.place("far"), "far")
        }
        CameraError::Planes { .. } => {
            Fault::new(message, section.place("far"), "not beyond near", fix)
        }
    }
}

/// Where the numbers of a block come from, for faults that are found when the scene is put
/// together.
struct Source {
    /// Whether they are of a file of particles.
    particles: bool,
    span: Range<usize>,
    centers: (PathBuf, Range<usize>),
    radii: Option<(PathBuf, Range<usize>)>,
}

/// The files of the arrays that were read.
struct Files<'c> {
    /// What their names are relative to.
    folder: &'c Path,
    control: &'c Control,
    /// All of them.
    paths: Vec<PathBuf>,
    /// Those whose numbers are used where they lie.
    watch: Watch,
    /// The others.
    copied: Vec<Copied>,
    /// What was understood of the files of particles among them.
    understood: Vec<String>,
    /// What the colours of each file of particles mean; or why that has no legend.
    legends: Vec<Result<Legend, String>>,
    grouping: Grouping,
    /// All that were mapped, each with its place in the scene file.
    mapped: Vec<(Arc<Mapped>, Range<usize>)>,
}

impl<'c> Files<'c> {
    /// None yet.
    fn new(folder: &'c Path, control: &'c Control) -> Self {
        let (paths, watch, copied, mapped) = Default::default();
        let (understood, legends, grouping) = Default::default();
        Self { folder, control, paths, watch, copied, understood, legends, grouping, mapped }
    }

    /// Takes note of an array's file, and hands its numbers on.
    fn keep<T>(&mut self, array: Named, taken: Taken<T>) -> T {
        let in_place = taken.copied.is_none();
        self.copied.extend(taken.copied);
        if let Some(file) = array.array.mapped {
            if in_place {
                self.watch.0.push(Arc::clone(&file));
            }
            self.mapped.push((file, array.span));
        }
        taken.numbers
    }

    /// A file that changed while its numbers were looked at: whatever was found in them is not to
    /// be believed.
    fn changed(&self) -> Option<Fault> {
        self.mapped.iter().find_map(|(file, span)| {
            let ChangedFile { path } = file.changed()?;
            let message = format!("{}: {}", text::name(path), ChangedFile::PROBLEM);
            Some(Fault::new(message, span.clone(), "this array", ChangedFile::FIX))
        })
    }
}

/// Groups of spheres, where these are wanted.
#[derive(Default)]
struct Grouping {
    /// The column that makes them.
    column: Option<Wish>,
    /// Those of the spheres so far.
    groups: Vec<u32>,
    /// How many groups there are so far.
    count: u32,
    /// Whether any file had the column.
    found: bool,
}

impl Grouping {
    /// Takes spheres that have no columns: they are one group.
    fn take_one(&mut self, spheres: usize) {
        if self.column.is_some() && spheres > 0 {
            self.groups.resize(self.groups.len() + spheres, self.count);
            self.count += 1;
        }
    }

    /// Takes the groups of a file's particles: no other file has the same.
    #[cfg(feature = "particles")]
    fn take(&mut self, groups: &[u32]) {
        let most = groups.iter().max().map_or(0, |most| most + 1);
        self.groups.extend(groups.iter().map(|group| group + self.count));
        self.count += most;
        self.found = true;
    }

    /// Refuses a column where there is no file that could have it.
    fn check(&self) -> Result<(), Fault> {
        let Some((name, place)) = self.column.as_ref().filter(|_| !self.found) else {
            return Ok(());
        };
        let name = text::value(name);
        let why = "is a column of a file of particles, and no [[spheres]] here has a `file`";
        Err(match place {
            Some(place) => Fault::new(
                format!("`outline_by` = \"{name}\" {why}"),
                place.clone(),
                "of which file?",
                "write outline_by = \"jump\" or \"sphere\"",
            ),
            None => Fault::whole(
                format!("the {name} of --outline-by {why}"),
                "give jump or sphere, or name a file of particles",
            ),
        })
    }
}

/// What the colours of all files mean; or why that has no legend.
fn joined(legends: Vec<Result<Legend, String>>) -> Result<Legend, String> {
    let (mut joined, mut why) = (None, None);
    for legend in legends {
        match (joined.take(), legend) {
            (None, Ok(legend)) => joined = Some(legend),
            (Some(one), Ok(other)) => joined = Some(Legend::and(one, other)?),
            (one, Err(words)) => (joined, why) = (one, why.or(Some(words))),
        }
    }
    let none = || "no colours here are those of a file of particles".into();
    joined.ok_or_else(|| why.unwrap_or_else(none))
}

/// All `[[sphere]]` first, then each `[[spheres]]` in turn.
fn read_spheres<'c>(
    root: &Section,
    mut singles: Vec<Sphere>,
    mut files: Files<'c>,
) -> Result<(Scene, Files<'c>), Fault> {
    let (mut blocks, mut sources) = (Vec::new(), Vec::new());
    let control = files.control;
    for table in tables(root, "sphere")? {
        singles.push(read_sphere(table)?);
    }
    if !singles.is_empty() {
        files.grouping.take_one(singles.len());
        blocks.push(Block::from_spheres(&singles));
        sources.push(None);
    }
    let (tables, share) = (tables(root, "spheres")?, control.part([0.7, 0.9]));
    for (number, value) in tables.iter().enumerate() {
        let (block, source) = read_block(value, &mut files)?;
        if !source.particles {
            files.grouping.take_one(block.len());
        }
        blocks.push(block);
        sources.push(Some(source));
        share.reach((number + 1) as f32 / tables.len() as f32);
    }
    files.grouping.check()?;
    Fault::if_cancelled(control)?;
    control.reach(0.9);
    let scene = Scene::new(blocks);
    Fault::if_cancelled(control)?;
    if let Some(fault) = files.changed() {
        return Err(fault);
    }
    Ok((scene.map_err(|error| scene_fault(&error, &sources))?, files))
}

/// The tables of a `[[name]]`.
fn tables<'t, 'i>(root: &Section<'t, 'i>, name: &str) -> Result<&'t [Value<'i>], Fault> {
    match root.get(name).map(|value| (value, value.get_ref())) {
        None => Ok(&[]),
        Some((_, DeValue::Array(items))) => Ok(items),
        Some((value, _)) => Err(Fault::new(
            format!("`{name}` is not a list of tables"),
            value.span(),
            "only one",
            format!("write [[{name}]], with two brackets on each side"),
        )),
    }
}

fn read_sphere(value: &Value) -> Result<Sphere, Fault> {
    let section = Section::new("[[sphere]]", value, &["center", "radius", "color"])?;
    let Some(center) = section.read("center", vector)? else {
        return Err(missing(&section, "center", "center = [0.0, 0.0, 0.0]"));
    };
    let Some(radius) = section.read("radius", positive)? else {
        return Err(missing(&section, "radius", "radius = 1.0"));
    };
    Ok(Sphere { center, radius, color: section.read("color", color)?.unwrap_or(DEFAULT_COLOR) })
}

fn missing(section: &Section, key: &str, example: &str) -> Fault {
    Fault::new(
        format!("`{key}` is missing"),
        section.span.clone(),
        format!("no `{key}`"),
        format!("add {example}"),
    )
}

fn positive(key: &str, value: &Value) -> Result<f64, Fault> {
    let number = number(key, value)?;
    if number > 0.0 {
        return Ok(number);
    }
    // Text such as 1e-400 is nearest to zero.
    Err(Fault::new(
        format!("`{key}` is {number}, but a radius is greater than 0"),
        value.span(),
        "not positive",
        "write a number greater than 0, or remove the sphere",
    ))
}

/// The keys of `[[spheres]]`.
const OF_SPHERES: [&str; 13] = [
    "centers",
    "radii",
    "radius",
    "colors",
    "color",
    "file",
    "format",
    "frame",
    "topology",
    "radius_scale",
    "color_by",
    "map",
    "range",
];

/// Those of them that are for a `file` of particles alone.
const OF_FILES: [&str; 7] =
    ["format", "frame", "topology", "radius_scale", "color_by", "map", "range"];

fn read_block(value: &Value, files: &mut Files) -> Result<(Block, Source), Fault> {
    let section = Section::new("[[spheres]]", value, &OF_SPHERES)?;
    section.not_both("radii", "radius")?;
    section.not_both("colors", "color")?;
    if section.get("file").is_some() {
        return particles::read_block(&section, files);
    }
    if let Some(key) = OF_FILES.iter().find(|key| section.get(key).is_some()) {
        return Err(Fault::new(
            format!("`{key}` says how a file of particles is drawn, but there is no `file`"),
            section.place(key),
            "of which file?",
            "add file = \"run.dump\", or remove the line",
        ));
    }

    let Some(centers) = open(&section, "centers", files)? else {
        return Err(missing(
            &section,
            "centers",
            "centers = \"centers.npy\", an array of shape (N, 3)",
        ));
    };
    // The others are needed to understand centres of a wrong shape; what is wrong with them is told
    // after that.
    let radii = open(&section, "radii", files);
    let colors = open(&section, "colors", files);
    let says =
        |array: &Result<Option<Named>, Fault>, key| array.as_ref().ok()?.as_ref()?.array.count(key);
    let count = match (says(&radii, Key::Radii), says(&colors, Key::Colors)) {
        (Some(a), Some(b)) if a != b => None,
        (a, b) => a.or(b),
    };
    let (taken, count) = centers.array.centers(count).map_err(|refused| centers.fault(&refused))?;
    let (span, place) = (section.span.clone(), centers.place());
    let mut source = Source { particles: false, span, centers: place, radii: None };
    let mut block = Block {
        centers: files.keep(centers, taken),
        radii: Radii::Same(0.0),
        colors: Colors::Same(section.read("color", color)?.unwrap_or(DEFAULT_COLOR)),
    };

    if let Some(radii) = radii? {
        let taken = radii.array.radii(count).map_err(|refused| radii.fault(&refused))?;
        source.radii = Some(radii.place());
        block.radii = Radii::Each(files.keep(radii, taken));
    } else if let Some(radius) = section.read("radius", positive)? {
        block.radii = Radii::Same(radius);
    } else {
        return Err(missing(
            &section,
            "radii",
            "radii = \"radii.npy\" (shape (N,)), or radius = 0.5 for all",
        ));
    }

    if let Some(colors) = colors? {
        let taken = colors.array.colors(count).map_err(|refused| colors.fault(&refused))?;
        block.colors = Colors::Each(files.keep(colors, taken));
    }
    Ok((block, source))
}

/// Blocks of spheres from files of particles.
#[cfg(feature = "particles")]
mod particles {
    use super::*;
    use crate::{
        input::{named::Named as Input, report::LoadError},
        particles::{
            Format, Frame, Map, Options,
            spheres::{Appearance, ColorFrom, RadiusFrom},
            understood::{Begun, begin, groups, understand},
        },
    };

    /// Reads the block of a file.
    pub fn read_block(
        section: &Section,
        files: &mut super::Files,
    ) -> Result<(Block, Source), Fault> {
        for key in ["centers", "radii", "colors"] {
            section.not_both(key, "file")?;
        }
        let options = read_options(section, files)?;
        let name = section.read("file", string)?.unwrap_or_default();
        let (path, span) = (beside(files, &name), section.place("file"));
        let failed = |error: &LoadError| {
            let place = match (error.line(), error.column()) {
                (Some(line), Some(column)) => format!("{}:{line}:{column}: ", text::name(&path)),
                _ => String::new(),
            };
            let (message, fix) = (format!("{place}{}", error.message()), error.fix());
            Fault::new(message, span.clone(), "this file", fix)
        };
        files.paths.push(path.clone());
        files.paths.extend(options.topology.clone());
        let begun = begin(&Input::of(&path), &options, files.control);
        let Begun::Particles(file) = begun.map_err(|error| failed(&error))? else {
            return Err(Fault::new(
                format!("{} is no file of particles", text::name(&path)),
                span,
                "no format is known by its content or its name",
                "name another file, or add format = \"xyz\"; arrays are `centers`, not `file`",
            ));
        };
        let found = understand(&file, options.frame, &options.appearance, files.control);
        let found = found.map_err(|error| failed(&error))?;
        files.understood.push(found.line.clone());
        files.legends.push(found.spheres.legend.clone());
        if let Some((column, _)) = &files.grouping.column {
            let groups = groups(&file, &found.particles, column).map_err(|error| failed(&error))?;
            files.grouping.take(&groups);
        }
        let block = found.spheres.block;
        if let Some(mapped) = file.data().mapped() {
            if file.is_in_place(&block) {
                files.watch.0.push(Arc::clone(mapped));
            }
            files.mapped.push((Arc::clone(mapped), span.clone()));
        }
        let source = Source {
            particles: true,
            span: section.span.clone(),
            centers: (path, span),
            radii: None,
        };
        Ok((block, source))
    }

    /// A file by its name in a scene file: `-` is no standard input there.
    fn beside(files: &super::Files, name: &str) -> PathBuf {
        files.folder.join(if name == "-" { "./-" } else { name })
    }

    /// The keys beside `file`.
    fn read_options(section: &Section, files: &super::Files) -> Result<Options, Fault> {
        section.not_both("color", "color_by")?;
        if let Some(key) = ["map", "range"].into_iter().find(|key| section.get(key).is_some())
            && section.get("color_by").is_none()
        {
            return Err(Fault::new(
                format!("`{key}` is for the colours of a column, but there is no `color_by`"),
                section.place(key),
                "of which column?",
                "add color_by = \"type\", or the name of another column, or remove the line",
            ));
        }
        let color = match (section.read("color", color)?, section.read("color_by", string)?) {
            (Some(color), _) => ColorFrom::Same(color),
            (None, Some(column)) => ColorFrom::Column(column),
            (None, None) => ColorFrom::Chosen,
        };
        let appearance = Appearance {
            radius: section.read("radius", radius)?.unwrap_or(RadiusFrom::Chosen),
            radius_scale: section.read("radius_scale", positive)?.unwrap_or(1.0),
            color,
            map: section.read("map", map)?,
            range: section.read("range", range)?.flatten(),
        };
        let topology = section.read("topology", string)?.map(|name| beside(files, &name));
        Ok(Options {
            format: section.read("format", format)?,
            frame: section.read("frame", frame)?.unwrap_or_default(),
            topology,
            appearance,
            outline_by: None,
        })
    }

    /// A value that is one of some names.
    fn named<T>(
        key: &str,
        value: &Value,
        find: impl Fn(&str) -> Option<T>,
        names: &[&str],
    ) -> Result<T, Fault> {
        let found = string(key, value)?;
        find(&found).ok_or_else(|| {
            let message = format!("unknown {key} \"{}\"", text::value(&found));
            Fault::new(message, value.span(), "unknown", format!("write {}", names.join(", ")))
        })
    }

    fn format(key: &str, value: &Value) -> Result<Format, Fault> {
        named(key, value, Format::named, &Format::all().map(Format::name).collect::<Vec<_>>())
    }

    fn map(key: &str, value: &Value) -> Result<Map, Fault> {
        named(key, value, Map::named, &Map::ALL.map(Map::name))
    }

    fn frame(key: &str, value: &Value) -> Result<Frame, Fault> {
        if let DeValue::String(_) = value.get_ref() {
            let last = |found: &str| (found == "last").then_some(Frame::FromLast(0));
            return named(key, value, last, &["a number, or \"last\""]);
        }
        integer(key, value).map(Frame::from)
    }

    fn radius(key: &str, value: &Value) -> Result<RadiusFrom, Fault> {
        let DeValue::String(_) = value.get_ref() else {
            return positive(key, value).map(RadiusFrom::Same);
        };
        string(key, value).map(|word| RadiusFrom::from(word.as_str()))
    }

    /// The ends of a map; none for those of the frame.
    fn range(key: &str, value: &Value) -> Result<Option<[f64; 2]>, Fault> {
        let wrong = || {
            let fix = "write range = [-1.0, 1.0], the less one first, or range = \"auto\"";
            Fault::new("`range` is not two numbers", value.span(), "not a range", fix)
        };
        match value.get_ref() {
            DeValue::String(text) if text.as_ref() == "auto" => Ok(None),
            DeValue::Array(items) => match &**items {
                [low, high] => match [number(key, low)?, number(key, high)?] {
                    range if range[0] <= range[1] => Ok(Some(range)),
                    _ => Err(wrong()),
                },
                _ => Err(wrong()),
            },
            _ => Err(wrong()),
        }
    }
}

/// Files of particles are not read without the feature.
#[cfg(not(feature = "particles"))]
mod particles {
    use super::*;

    pub fn read_block(section: &Section, _: &mut super::Files) -> Result<(Block, Source), Fault> {
        Err(Fault::new(
            "this library was built without readers for files of particles",
            section.place("file"),
            "not read",
            "build it with the feature `formats`, or convert the file to arrays",
        ))
    }
}

/// An array that a key names.
struct Named {
    path: PathBuf,
    span: Range<usize>,
    array: Array,
}

impl Named {
    fn place(&self) -> (PathBuf, Range<usize>) {
        (self.path.clone(), self.span.clone())
    }

    fn fault(&self, refused: &Refused) -> Fault {
        array_fault(&self.path, self.span.clone(), refused)
    }
}

fn array_fault(path: &Path, span: Range<usize>, refused: &Refused) -> Fault {
    let Refused { words, fix } = refused;
    Fault::new(format!("{}: {words}", path.display()), span, "this array", fix)
}

fn open(section: &Section, key: &str, files: &mut Files) -> Result<Option<Named>, Fault> {
    let Some(name) = section.read(key, string)? else { return Ok(None) };
    let (path, span) = (files.folder.join(name), section.place(key));
    files.paths.push(path.clone());
    match Array::open(path.clone(), files.control) {
        Ok(array) => Ok(Some(Named { path, span, array })),
        Err(refused) => Err(array_fault(&path, span, &refused)),
    }
}

/// Names the array, and the place in it, of a number that is not one.
fn scene_fault(error: &SceneError, sources: &[Option<Source>]) -> Fault {
    let source = |block: usize| sources.get(block).and_then(Option::as_ref);
    #[cfg(feature = "particles")]
    if let SceneError::Center { block, .. } | SceneError::Radius { block, .. } = *error
        && let Some(Source { particles: true, centers: (path, span), .. }) = source(block)
    {
        let (words, fix) = crate::particles::understood::scene_words(error);
        return Fault::new(format!("{}: {words}", text::name(path)), span.clone(), "here", fix);
    }
    match *error {
        SceneError::Center { block, index, axis, value } => {
            if let Some(Source { centers: (path, span), .. }) = source(block) {
                let column = axis as u32 - 'x' as u32;
                return Fault::new(
                    format!(
                        "{}: {axis} of centre {index} is {value}, not a finite number",
                        path.display()
                    ),
                    span.clone(),
                    format!("element [{index}, {column}] of this array"),
                    "write finite numbers into the array, or leave the sphere out",
                );
            }
        }
        SceneError::Radius { block, index, value } => {
            if let Some(Source { radii: Some((path, span)), .. }) = source(block) {
                return Fault::new(
                    format!(
                        "{}: radius {index} is {value}, not a positive finite number",
                        path.display()
                    ),
                    span.clone(),
                    format!("element [{index}] of this array"),
                    "write radii greater than 0 into the array, or leave the sphere out",
                );
            }
        }
        SceneError::Shape { .. } | SceneError::Changing { .. } | SceneError::TooMany(_) => {}
    }
    let last = sources.iter().flatten().next_back().map_or(0..0, |source| source.span.clone());
    Fault::new(error.to_string(), last, "here", "draw fewer spheres at a time")
}
