//! What a picture looks like, as it is asked for.

use planisphere_core::{axes::Axes, camera::View, scene::Bounds};

use crate::style::{Between, Outline, Shade, Space, Style};

/// A look cannot be what was asked for.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{what} {words}")]
pub struct LookError {
    /// What it is about, such as `aa`.
    pub what: &'static str,
    /// Why not, and the fix.
    pub words: String,
}

/// The part of the light that comes from everywhere, without another wish, of 255.
const AMBIENT: u8 = 51;
/// How much hidden spheres are darkened, without another wish, of 255.
const STRENGTH: u8 = 230;
/// Samples a side of a pixel of what is not flat, without another wish.
const SAMPLES: u32 = 4;
/// Pixels of a line, without another wish.
const LINE: f64 = 1.5;

/// What samples look like, and how they become pixels: flat colours on black without.
///
/// ```
/// # use planisphere_image::look::Look;
/// let look = Look::matte().background([255; 3]).depth_cue();
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Look {
    kind: Kind,
    background: [u8; 3],
    transparent: bool,
    aa: Option<u32>,
    space: Space,
    ambient: Option<u8>,
    strength: Option<u8>,
    /// Without a wish as the look has it.
    cue: Option<Cue>,
    lines: Option<bool>,
    line: Line,
}

/// The looks that have a name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Kind {
    #[default]
    Flat,
    Matte,
    Soft,
    Illustrative,
}

/// Where colours go over into the background's.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Cue {
    /// Nowhere.
    None,
    /// Along the scene.
    Scene,
    /// Between two depths.
    Between([f64; 2]),
}

/// Wishes about lines.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Line {
    width: Option<f64>,
    color: [u8; 3],
    between: Between,
    jump: Option<f64>,
}

/// A part from 0 to 1 as an integer of 255.
fn part(what: &'static str, part: f64) -> Result<u8, LookError> {
    if (0.0..=1.0).contains(&part) {
        return Ok((255.0 * part + 0.5) as u8);
    }
    Err(LookError { what, words: format!("is {part}; give 0 to 1") })
}

impl Look {
    /// Names of the looks.
    pub const NAMES: [&str; 4] = ["flat", "matte", "soft", "illustrative"];

    /// Flat colours on black.
    pub fn new() -> Self {
        Self::default()
    }

    /// The spheres' own colours, one sample a pixel.
    pub fn flat() -> Self {
        Self::default()
    }

    /// Shaded by a light at the eye.
    pub fn matte() -> Self {
        Self { kind: Kind::Matte, ..Self::default() }
    }

    /// Shaded by how open each sphere is to the space around, from every side.
    pub fn soft() -> Self {
        Self { kind: Kind::Soft, ..Self::default() }
    }

    /// Flat colours, with lines where what is seen changes, and a depth cue.
    pub fn illustrative() -> Self {
        Self { kind: Kind::Illustrative, ..Self::default() }
    }

    /// Another look, by its name: what else was asked for stays.
    ///
    /// # Errors
    /// When it is none of [`Look::NAMES`].
    pub fn named(self, name: &str) -> Result<Self, LookError> {
        let kind = match name {
            "flat" => Kind::Flat,
            "matte" => Kind::Matte,
            "soft" => Kind::Soft,
            "illustrative" => Kind::Illustrative,
            _ => {
                let words = format!("is \"{name}\"; give one of {}", Self::NAMES.join(", "));
                return Err(LookError { what: "look", words });
            }
        };
        Ok(Self { kind, ..self })
    }

    /// Its name.
    pub fn name(&self) -> &'static str {
        Self::NAMES[self.kind as usize]
    }

    /// Another background, sRGB.
    #[must_use]
    pub fn background(self, srgb: [u8; 3]) -> Self {
        Self { background: srgb, ..self }
    }

    /// A background that is seen through: alpha is the part of a pixel's samples that show spheres
    /// or lines.
    #[must_use]
    pub fn transparent(self) -> Self {
        Self { transparent: true, ..self }
    }

    /// So many samples a side of each pixel, of which the mean is taken. Flat colours have 1
    /// without, all other looks 4.
    ///
    /// # Errors
    /// When it is none of 1, 2, 4, 8 and 16.
    pub fn aa(self, samples: u32) -> Result<Self, LookError> {
        if matches!(samples, 1 | 2 | 4 | 8 | 16) {
            return Ok(Self { aa: Some(samples), ..self });
        }
        let words = format!("is {samples}; give 1, 2, 4, 8 or 16");
        Err(LookError { what: "aa", words })
    }

    /// Means of sRGB bytes instead of linear light.
    #[must_use]
    pub fn encoded(self) -> Self {
        Self { space: Space::Encoded, ..self }
    }

    /// Where samples are averaged, by its name: `linear` or `encoded`.
    ///
    /// # Errors
    /// When it is neither.
    pub fn space(self, name: &str) -> Result<Self, LookError> {
        let space = match name {
            "linear" => Space::Linear,
            "encoded" => Space::Encoded,
            _ => {
                let words = format!("is \"{name}\"; give linear or encoded");
                return Err(LookError { what: "aa_space", words });
            }
        };
        Ok(Self { space, ..self })
    }

    /// The part of the light, 0 to 1, that comes from everywhere: of [`Look::matte`].
    ///
    /// # Errors
    /// When it is none.
    pub fn ambient(self, light: f64) -> Result<Self, LookError> {
        Ok(Self { ambient: Some(part("ambient", light)?), ..self })
    }

    /// How much spheres are darkened that are not open to the space around, 0 to 1: of any look.
    /// [`Look::soft`] has 0.9 without, all others 0.
    ///
    /// # Errors
    /// When it is none.
    pub fn occlusion_strength(self, strength: f64) -> Result<Self, LookError> {
        Ok(Self { strength: Some(part("occlusion_strength", strength)?), ..self })
    }

    /// Colours go over into the background's along the scene.
    #[must_use]
    pub fn depth_cue(self) -> Self {
        Self { cue: Some(Cue::Scene), ..self }
    }

    /// Colours go over into the background's between two depths, in world units along the view.
    ///
    /// # Errors
    /// When these are not two finite numbers of which the first is less.
    pub fn depth_cue_between(self, depths: [f64; 2]) -> Result<Self, LookError> {
        let [near, far] = depths;
        if near.is_finite() && far.is_finite() && near < far {
            return Ok(Self { cue: Some(Cue::Between(depths)), ..self });
        }
        let words = format!("is {near} to {far}; give two numbers, the nearer depth first");
        Err(LookError { what: "depth_cue", words })
    }

    /// Without one.
    #[must_use]
    pub fn no_depth_cue(self) -> Self {
        Self { cue: Some(Cue::None), ..self }
    }

    fn line(mut self, change: impl FnOnce(&mut Line)) -> Self {
        change(&mut self.line);
        Self { lines: Some(true), ..self }
    }

    /// Lines so many pixels wide where what is seen changes and lies apart.
    ///
    /// # Errors
    /// When the width is not above 0, or above 1000.
    pub fn outline(self, width: f64) -> Result<Self, LookError> {
        if width > 0.0 && width <= Outline::MAX_WIDTH {
            return Ok(self.line(|line| line.width = Some(width)));
        }
        let words =
            format!("is {width} pixels; give a width above 0, up to {}", Outline::MAX_WIDTH);
        Err(LookError { what: "outline", words })
    }

    /// Without lines.
    #[must_use]
    pub fn no_outline(self) -> Self {
        Self { lines: Some(false), ..self }
    }

    /// Lines of another colour than black, sRGB.
    #[must_use]
    pub fn outline_color(self, srgb: [u8; 3]) -> Self {
        self.line(|line| line.color = srgb)
    }

    /// Lines between all spheres.
    #[must_use]
    pub fn outline_spheres(self) -> Self {
        self.line(|line| line.between = Between::Spheres)
    }

    /// Lines also between spheres of different groups.
    #[must_use]
    pub fn outline_groups(self) -> Self {
        self.line(|line| line.between = Between::Groups)
    }

    /// Where lines are, by its name: `jump`, `sphere` or `group`.
    ///
    /// # Errors
    /// When it is none of these.
    pub fn outline_by(self, name: &str) -> Result<Self, LookError> {
        match name {
            "jump" => Ok(self.line(|line| line.between = Between::Jumps)),
            "sphere" => Ok(self.outline_spheres()),
            "group" => Ok(self.outline_groups()),
            _ => {
                let words = format!("is \"{name}\"; give jump, sphere or group");
                Err(LookError { what: "outline_by", words })
            }
        }
    }

    /// How far apart, in world units, what is seen must lie for a line; the radius of the nearer
    /// sphere without.
    ///
    /// # Errors
    /// When it is no finite number, or below 0.
    pub fn outline_jump(self, length: f64) -> Result<Self, LookError> {
        if length.is_finite() && length >= 0.0 {
            return Ok(self.line(|line| line.jump = Some(length)));
        }
        let words = format!("is {length}; give a length of 0 or more");
        Err(LookError { what: "outline_jump", words })
    }

    /// Whether the background is seen through.
    pub fn is_transparent(&self) -> bool {
        self.transparent
    }

    /// Samples a side of a pixel.
    pub fn samples(&self) -> u32 {
        self.aa.unwrap_or(if self.kind == Kind::Flat { 1 } else { SAMPLES })
    }

    /// The lines, if there are any.
    fn lines(&self) -> Option<Line> {
        self.lines.unwrap_or(self.kind == Kind::Illustrative).then_some(self.line)
    }

    /// The depth cue, if there is one.
    fn cue(&self) -> Option<Cue> {
        let usual = if self.kind == Kind::Illustrative { Cue::Scene } else { Cue::None };
        Some(self.cue.unwrap_or(usual)).filter(|cue| *cue != Cue::None)
    }

    /// Whether samples are averaged as sRGB bytes.
    pub fn is_encoded(&self) -> bool {
        self.space == Space::Encoded
    }

    /// Whether lines go by groups.
    pub fn needs_groups(&self) -> bool {
        self.lines().is_some_and(|line| line.between == Between::Groups)
    }

    /// How much spheres that are not open are darkened, if they are.
    fn occlusion(&self) -> Option<u8> {
        let usual = (self.kind == Kind::Soft).then_some(STRENGTH);
        self.strength.or(usual).filter(|strength| *strength > 0)
    }

    /// Whether openness is shaded.
    pub fn needs_openness(&self) -> bool {
        self.occlusion().is_some()
    }

    /// Whether colours follow from the ids of pixels alone.
    pub fn is_plain(&self) -> bool {
        let shaded = self.kind == Kind::Matte || self.needs_openness();
        let more = self.transparent || self.cue().is_some() || self.lines().is_some();
        !shaded && !more && self.samples() == 1
    }

    /// What is done, in words: the look, its samples, and what it adds.
    pub fn words(&self) -> String {
        let mut words = match self.samples() {
            1 => format!("{}, one sample a pixel", self.name()),
            n => format!("{}, {n} x {n} samples a pixel", self.name()),
        };
        let cue = self.cue().map(|_| "a depth cue");
        let lines = self.lines().map(|_| "lines");
        let open = self.needs_openness().then_some("openness of spheres");
        let clear = self.transparent.then_some("a transparent background");
        for more in [open, lines, cue, clear].into_iter().flatten() {
            words += ", ";
            words += more;
        }
        words
    }

    /// The colour where there is no sphere, sRGB.
    pub fn behind(&self) -> [u8; 3] {
        self.background
    }

    /// The options of the command line that make this look of the usual one, which is flat on
    /// black: each word for itself.
    pub fn options(&self) -> Vec<String> {
        let mut words = Vec::new();
        let mut add = |option: &str, value: String| words.extend([option.to_owned(), value]);
        if self.transparent {
            add("--background", "transparent".into());
        } else if self.background != [0; 3] {
            add("--background", hex(self.background));
        }
        if self.kind != Kind::Flat {
            add("--look", self.name().into());
        }
        if let Some(aa) = self.aa {
            add("--aa", aa.to_string());
        }
        if self.space == Space::Encoded {
            add("--aa-space", "encoded".into());
        }
        // What is read back is the nearest part of 255.
        let part = |part: u8| (f64::from(part) / 255.0).to_string();
        if let Some(ambient) = self.ambient {
            add("--ambient", part(ambient));
        }
        if let Some(strength) = self.strength {
            add("--occlusion-strength", part(strength));
        }
        let Line { width, color, between, jump } = self.line;
        match (self.lines, width) {
            (Some(false), _) => add("--outline", "0".into()),
            (Some(true), Some(width)) => add("--outline", width.to_string()),
            _ => {}
        }
        if self.lines == Some(true) {
            if width.is_none() || color != [0; 3] {
                add("--outline-color", hex(color));
            }
            match between {
                Between::Jumps => {}
                Between::Groups => add("--outline-by", "group".into()),
                Between::Spheres => add("--outline-by", "sphere".into()),
            }
            if let Some(jump) = jump {
                add("--outline-jump", jump.to_string());
            }
        }
        match self.cue {
            None => {}
            Some(Cue::None) => words.push("--depth-cue=off".into()),
            Some(Cue::Scene) => words.push("--depth-cue".into()),
            Some(Cue::Between([near, far])) => words.push(format!("--depth-cue={near},{far}")),
        }
        words
    }

    /// In numbers, for a view of a scene.
    pub fn style(&self, view: &View, bounds: &Bounds) -> Style {
        let cue = match self.cue() {
            Some(Cue::Between(depths)) => Some(depths),
            Some(Cue::Scene) => Some(along(view, bounds)),
            Some(Cue::None) | None => None,
        };
        let outline = self.lines().map(|line| Outline {
            width: line.width.unwrap_or(LINE),
            color: line.color,
            between: line.between,
            jump: line.jump,
        });
        Style {
            background: self.background,
            transparent: self.transparent,
            aa: self.samples(),
            space: self.space,
            shade: match self.kind {
                Kind::Flat | Kind::Soft | Kind::Illustrative => Shade::Flat,
                Kind::Matte => Shade::Matte { ambient: self.ambient.unwrap_or(AMBIENT) },
            },
            occlusion: self.occlusion(),
            cue,
            outline,
        }
    }
}

/// A colour as it is typed.
fn hex([red, green, blue]: [u8; 3]) -> String {
    format!("#{red:02x}{green:02x}{blue:02x}")
}

/// Depths between which a scene goes over into the background: from where its box begins, to four
/// times as far behind its middle. At the box's end it has gone over by two fifths.
fn along(view: &View, bounds: &Bounds) -> [f64; 2] {
    let forward = Axes::new(view.camera.view, view.camera.up).forward.nearest();
    let middle = 0.5 * bounds.min_center + 0.5 * bounds.max_center;
    let half = 0.5 * bounds.max_center - 0.5 * bounds.min_center;
    let depth = (middle - view.camera.origin).dot(forward);
    let reach = half.dot(forward.abs()) + bounds.max_radius;
    let [near, far] = [depth - reach, depth + 4.0 * reach];
    // Beyond what f64 hold: all of it.
    if near.is_finite() && far.is_finite() && near < far { [near, far] } else { [0.0, f64::MAX] }
}
