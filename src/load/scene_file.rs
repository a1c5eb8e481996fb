//! What a scene file means: `[camera]`, `[image]`, `[[sphere]]` and `[[spheres]]`, each key checked at its place.

use std::{
    ops::Range,
    path::{Path, PathBuf},
    sync::Arc,
};

use rayon::prelude::*;
use toml::de::{DeTable, DeValue};

use super::{
    DEFAULT_COLOR, DEFAULT_IMAGE, Loaded, Watch,
    array::{Array, Copied, Key, Taken},
    batches::{Batches, cut},
    document::{Section, Value, color, integer, number, string, vector},
    mapped::Mapped,
    npy::Refused,
    report::Fault,
};
use crate::{
    camera::{Camera, CameraError, ImageSize, MAX_SIDE, Projection, ScreenSize},
    fov::height_from_fov,
    scene::{Block, Colors, Radii, Scene, SceneError, Sphere},
};

/// Reads the text of a scene file, and maps the arrays it names relative to `folder`.
pub(super) fn read(text: &str, folder: &Path) -> Result<Loaded, Fault> {
    if let Some((rest, singles)) = read_batches(text)
        && let Ok(document) = DeTable::parse(&rest)
        && !document.get_ref().contains_key("sphere")
    {
        return read_document(document.get_ref(), singles, folder);
    }
    let document = DeTable::parse(text).map_err(|error| syntax(&error, text))?;
    read_document(document.get_ref(), Vec::new(), folder)
}

/// The `[[sphere]]` tables of a large file, and the file without them; or nothing when there is any fault in them, which
/// is then found again, at its place, by reading the file as a whole.
fn read_batches(text: &str) -> Option<(String, Vec<Sphere>)> {
    let Batches { rest, pieces } = cut(text)?;
    let read = |piece: &&str| {
        let document = DeTable::parse(piece).ok()?;
        let root = Section::of_table("", document.get_ref(), 0..0, &["sphere"]).ok()?;
        tables(&root, "sphere").ok()?.iter().map(|table| read_sphere(table).ok()).collect::<Option<Vec<_>>>()
    };
    let spheres: Option<Vec<Vec<Sphere>>> = pieces.par_iter().map(read).collect();
    Some((rest, spheres?.concat()))
}

/// Reads a parsed document, whose first spheres may have been read before.
fn read_document(document: &DeTable, singles: Vec<Sphere>, folder: &Path) -> Result<Loaded, Fault> {
    let known = ["camera", "image", "sphere", "spheres"];
    let root = Section::of_table("", document, 0..0, &known)?;
    let (image, background) = root.get("image").map_or(Ok((DEFAULT_IMAGE, [0; 3])), read_image)?;
    let fixed_camera = root.get("camera").map(read_camera).transpose()?;
    let (scene, files) = read_spheres(&root, singles, folder)?;
    let Files { paths, watch, copied, .. } = files;
    Ok(Loaded { scene, fixed_camera, image, background, files: paths, watch, copied })
}

/// A fault of the TOML itself, in the parser's words.
fn syntax(error: &toml::de::Error, text: &str) -> Fault {
    let message = error.message().lines().collect::<Vec<_>>().join(", ");
    let fix = if message.contains("duplicate key") {
        "remove one of the two"
    } else {
        "write `key = value` lines under [camera], [image], [[sphere]] or [[spheres]], strings in quotes (https://toml.io)"
    };
    Fault::new(format!("not TOML: {message}"), error.span().unwrap_or(text.len()..text.len()), "here", fix)
}

fn read_image(value: &Value) -> Result<(ImageSize, [u8; 3]), Fault> {
    let section = Section::new("[image]", value, &["width", "height", "background"])?;
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
    let size = ImageSize { width: side("width", DEFAULT_IMAGE.width)?, height: side("height", DEFAULT_IMAGE.height)? };
    Ok((size, section.read("background", color)?.unwrap_or([0; 3])))
}

fn read_camera(value: &Value) -> Result<Camera, Fault> {
    let known = ["projection", "origin", "view", "look_at", "up", "width", "height", "fov", "near", "far"];
    let section = Section::new("[camera]", value, &known)?;
    let projection = section.read("projection", projection)?.unwrap_or(Projection::Orthographic);
    let origin = section.read("origin", vector)?.unwrap_or_default();
    section.not_both("view", "look_at")?;
    let view = match (section.read("view", vector)?, section.read("look_at", vector)?) {
        (Some(view), _) => view,
        (None, Some(point)) => point - origin,
        (None, None) => {
            return Err(Fault::new(
                "the camera has neither `view` nor `look_at`",
                section.span,
                "no view direction",
                "add view = [1.0, 0.0, 0.0] (a direction) or look_at = [x, y, z] (a point)",
            ));
        }
    };
    let up = section.read("up", vector)?.unwrap_or(glam::DVec3::Z);
    let size = read_screen(&section, projection)?;
    let near = section.read("near", number)?.unwrap_or(0.0);
    let far = section.read("far", number)?.unwrap_or(f64::INFINITY);
    let camera = Camera { projection, origin, view, up, size, near, far };
    camera.check().map_err(|error| camera_fault(&section, &error))?;
    Ok(camera)
}

fn projection(_: &str, value: &Value) -> Result<Projection, Fault> {
    match string("projection", value)?.as_str() {
        "orthographic" => Ok(Projection::Orthographic),
        "perspective" => Ok(Projection::Perspective),
        other => Err(Fault::new(
            format!("unknown projection \"{other}\""),
            value.span(),
            "unknown",
            "write projection = \"orthographic\" or projection = \"perspective\"",
        )),
    }
}

fn read_screen(section: &Section, projection: Projection) -> Result<ScreenSize, Fault> {
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
        (Projection::Perspective, Some(fov), _) => {
            height_from_fov(fov).map(ScreenSize::Height).map_err(|error| camera_fault(section, &error))
        }
        (_, None, (Some(width), Some(height))) => Ok(ScreenSize::Both { width, height }),
        (_, None, (Some(width), None)) => Ok(ScreenSize::Width(width)),
        (_, None, (None, Some(height))) => Ok(ScreenSize::Height(height)),
        (Projection::Orthographic, None, (None, None)) => Ok(ScreenSize::Width(10.0)),
        (Projection::Perspective, None, (None, None)) => Err(Fault::new(
            "the perspective camera has no `fov`, `width` or `height`",
            section.span.clone(),
            "how wide it sees is missing",
            "add fov = 40.0 (vertical, degrees), or width or height (of the image plane at distance 1)",
        )),
    }
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
            "give a point nearer to the camera, or `view`",
        ),
        CameraError::ZeroView if direction == "look_at" => Fault::new(
            "`look_at` is the camera's origin: the view direction is zero",
            section.place("look_at"),
            "the same point as the origin",
            "give another point, or `view`, a direction",
        ),
        CameraError::ZeroView => Fault::new(message, section.place("view"), "zero", fix),
        CameraError::Fov(_) => Fault::new(message, section.place("fov"), "not between 0 and 180", fix),
        CameraError::UpParallel if section.get("up").is_none() => Fault::new(
            "the view direction is parallel to the default up, [0, 0, 1]",
            section.place(direction),
            "along the z axis",
            "add an `up` that points another way, such as up = [0.0, 1.0, 0.0]",
        ),
        CameraError::UpParallel => Fault::new(message, section.place("up"), "parallel to the view direction", fix)
            .and(section.place(direction), "the view direction"),
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
        CameraError::Planes { .. } if section.get("near").is_some() && section.get("far").is_some() => {
            Fault::new(message, section.place("near"), "not less than far", fix).and(section.place("far"), "far")
        }
        CameraError::Planes { .. } => Fault::new(message, section.place("far"), "not beyond near", fix),
    }
}

/// Where the numbers of a block come from, for faults that are found when the scene is put together.
struct Source {
    span: Range<usize>,
    centers: (PathBuf, Range<usize>),
    radii: Option<(PathBuf, Range<usize>)>,
}

/// The files of the arrays that were read.
#[derive(Default)]
struct Files {
    /// All of them.
    paths: Vec<PathBuf>,
    /// Those whose numbers are used where they lie.
    watch: Watch,
    /// The others.
    copied: Vec<Copied>,
    /// All that were mapped, each with its place in the scene file.
    mapped: Vec<(Arc<Mapped>, Range<usize>)>,
}

impl Files {
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
            let words = file.changed()?.to_string();
            let (message, fix) = words.split_once("\nfix: ").unwrap_or((&words, "draw again"));
            Some(Fault::new(message, span.clone(), "this array", fix))
        })
    }
}

/// All `[[sphere]]` first, then each `[[spheres]]` in turn.
fn read_spheres(root: &Section, mut singles: Vec<Sphere>, folder: &Path) -> Result<(Scene, Files), Fault> {
    let (mut blocks, mut sources) = (Vec::new(), Vec::new());
    let mut files = Files::default();
    for table in tables(root, "sphere")? {
        singles.push(read_sphere(table)?);
    }
    if !singles.is_empty() {
        blocks.push(Block::from_spheres(&singles));
        sources.push(None);
    }
    for value in tables(root, "spheres")? {
        let (block, source) = read_block(value, folder, &mut files)?;
        blocks.push(block);
        sources.push(Some(source));
    }
    let scene = Scene::new(blocks);
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
    Fault::new(format!("`{key}` is missing"), section.span.clone(), format!("no `{key}`"), format!("add {example}"))
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

fn read_block(value: &Value, folder: &Path, files: &mut Files) -> Result<(Block, Source), Fault> {
    let section = Section::new("[[spheres]]", value, &["centers", "radii", "radius", "colors", "color"])?;
    section.not_both("radii", "radius")?;
    section.not_both("colors", "color")?;

    let Some(centers) = open(&section, "centers", folder, files)? else {
        return Err(missing(&section, "centers", "centers = \"centers.npy\", an array of shape (N, 3)"));
    };
    // The others are needed to understand centres of a wrong shape; what is wrong with them is told
    // after that.
    let radii = open(&section, "radii", folder, files);
    let colors = open(&section, "colors", folder, files);
    let says = |array: &Result<Option<Named>, Fault>, key| array.as_ref().ok()?.as_ref()?.array.count(key);
    let count = match (says(&radii, Key::Radii), says(&colors, Key::Colors)) {
        (Some(a), Some(b)) if a != b => None,
        (a, b) => a.or(b),
    };
    let (taken, count) = centers.array.centers(count).map_err(|refused| centers.fault(&refused))?;
    let mut source = Source { span: section.span.clone(), centers: centers.place(), radii: None };
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
        return Err(missing(&section, "radii", "radii = \"radii.npy\" (shape (N,)), or radius = 0.5 for all"));
    }

    if let Some(colors) = colors? {
        let taken = colors.array.colors(count).map_err(|refused| colors.fault(&refused))?;
        block.colors = Colors::Each(files.keep(colors, taken));
    }
    Ok((block, source))
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

fn open(section: &Section, key: &str, folder: &Path, files: &mut Files) -> Result<Option<Named>, Fault> {
    let Some(name) = section.read(key, string)? else { return Ok(None) };
    let (path, span) = (folder.join(name), section.place(key));
    files.paths.push(path.clone());
    match Array::open(path.clone()) {
        Ok(array) => Ok(Some(Named { path, span, array })),
        Err(refused) => Err(array_fault(&path, span, &refused)),
    }
}

/// Names the array, and the place in it, of a number that is not one.
fn scene_fault(error: &SceneError, sources: &[Option<Source>]) -> Fault {
    let source = |block: usize| sources.get(block).and_then(Option::as_ref);
    match *error {
        SceneError::Center { block, index, axis, value } => {
            if let Some(Source { centers: (path, span), .. }) = source(block) {
                let column = axis as u32 - 'x' as u32;
                return Fault::new(
                    format!("{}: {axis} of centre {index} is {value}, not a finite number", path.display()),
                    span.clone(),
                    format!("element [{index}, {column}] of this array"),
                    "write finite numbers into the array, or leave the sphere out",
                );
            }
        }
        SceneError::Radius { block, index, value } => {
            if let Some(Source { radii: Some((path, span)), .. }) = source(block) {
                return Fault::new(
                    format!("{}: radius {index} is {value}, not a positive finite number", path.display()),
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
