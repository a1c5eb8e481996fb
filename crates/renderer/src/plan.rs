//! What a picture will take, before it is drawn: what runs, what is skipped and why, and how much
//! memory that needs.
//!
//! [`Renderer::plan`] knows all but the spheres, and [`survey`] looks at these. [`Plan::lines`]
//! puts it into words, and [`Plan::memory`] adds up what the devices say of their own.

use planisphere_core::{
    bins::Binner,
    camera::{ImageSize, Projection, Region},
    cpu,
    drawing::Workload,
    exact::decide::Truth,
    project::{BATCH, Batch},
    scene::Scene,
    text,
};

use crate::{
    Renderer, Request,
    bands::BAND,
    files::{Kind, Sinks},
    source::Means,
};

/// What a look at some or all spheres tells. Numbers of spheres and entries are of the whole scene,
/// by proportion where not all were looked at.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Survey {
    /// One batch of 64 spheres in so many was looked at; 1: all.
    pub step: usize,
    /// Spheres that no pixel's ray can meet: off the screen, outside the clip range, or between the
    /// rays.
    pub outside: u64,
    /// Spheres on the screen that a clip plane may cut.
    pub cut: u64,
    /// Entries of tile lists before anything hides anything: a sphere has one in each tile that its
    /// box touches.
    pub entries: u64,
    /// Tiles.
    pub tiles: u64,
    /// Tiles that no sphere that was looked at touches.
    pub empty: u64,
    /// Whether the box of the scene reaches near, and far: if not, no sphere does.
    pub reaches: [bool; 2],
}

/// Looks at the spheres of a scene (at about `most` of them) as the tiles of a region have them,
/// with sides of `1 << shift` pixels.
fn survey(scene: &Scene, truth: &Truth, region: Region, shift: u32, most: usize) -> Survey {
    let step = scene.len().div_ceil(most.max(BATCH));
    let step = step.max(1);
    let Binner { projector, grid, .. } = Binner::new(scene, truth, region, shift);
    let mut survey = Survey { step, tiles: grid.tiles() as u64, ..Survey::default() };
    let mut touched = vec![false; grid.tiles()];
    let mut batch = Batch::default();
    let mut looked = 0;
    for (_, block) in scene.blocks() {
        for first in (0..block.len()).step_by(step * BATCH) {
            projector.project_batch(block, first, &mut batch);
            projector.footprints(&mut batch);
            looked += batch.len as u64;
            for k in 0..batch.len {
                let (left, right, top, bottom) =
                    (batch.left[k], batch.right[k], batch.top[k], batch.bottom[k]);
                if left > right || top > bottom {
                    survey.outside += 1;
                    continue;
                }
                survey.cut += u64::from(projector.cuts(&batch.sphere(k)));
                let [left, right, top, bottom] =
                    [left, right, top, bottom].map(|at| at as usize >> shift);
                survey.entries += (right - left + 1) as u64 * (bottom - top + 1) as u64;
                for row in top..=bottom {
                    touched[row * grid.columns as usize..][left..=right].fill(true);
                }
            }
        }
    }
    survey.empty = touched.iter().filter(|touched| !**touched).count() as u64;
    let whole =
        |part: u64| (u128::from(part) * scene.len() as u128 / u128::from(looked.max(1))) as u64;
    (survey.outside, survey.cut, survey.entries) =
        (whole(survey.outside), whole(survey.cut), whole(survey.entries));
    if !scene.is_empty() {
        let bounds = scene.bounds();
        for corner in 0..8 {
            let pick = |k: usize| {
                if corner >> k & 1 == 0 { bounds.min_center[k] } else { bounds.max_center[k] }
            };
            let s = projector.project([0, 1, 2].map(pick).into(), bounds.max_radius);
            // What overflows may reach anything.
            survey.reaches[0] |= !(s.nearest() > projector.near);
            survey.reaches[1] |= !(s.z + s.r + s.bound() < projector.far);
        }
    }
    survey
}

/// What drawing a request takes, before any work: what runs, what is skipped and why, and how much
/// memory that needs.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    means: Means,
    /// The device in words, and why it was taken.
    device: String,
    spheres: usize,
    /// What it looks like.
    look: String,
    /// The whole image.
    image: ImageSize,
    /// What is drawn of it.
    region: Region,
    projection: Projection,
    /// Clip planes, world units.
    planes: [f64; 2],
    /// Side of a tile, pixels.
    tile: u32,
    /// Entries of tile lists in memory at a time.
    wave: usize,
    /// Pixels that the device draws at a time.
    band: usize,
    /// Pixels of the planes that lie in memory at a time: a larger picture is written as it is
    /// drawn.
    held: usize,
    /// Whether a PNG is asked for.
    picture: bool,
    /// Whether that has a palette: the ids of all pixels wait for the last.
    palette: bool,
    /// Whether ids are.
    ids: bool,
    /// Whether depths are.
    depth: bool,
    /// Whether what merging needs is.
    part: bool,
    /// Whether normals and positions are.
    vectors: [bool; 2],
    /// Whether all planes in one archive are: the ids of all pixels wait for the last.
    all: bool,
    /// Whether the picture is OpenEXR, of which all planes are in memory at once.
    exr: bool,
    /// What a look at the spheres told.
    survey: Survey,
}

impl Renderer {
    /// What drawing a request into some sinks takes, before any work. It does not look at the
    /// spheres: see [`Plan::lines`].
    pub fn plan(&self, request: &Request, sinks: &Sinks) -> Plan {
        let view = request.view();
        let region = request.region;
        let means = self.source().means(self.pool_threads());
        let (tile, wave, band) = match &means {
            Means::Cpu { .. } => (1 << cpu::shift(region), cpu::WAVE, cpu::BAND),
            #[cfg(feature = "gpu")]
            Means::Gpu(capacity) => (planisphere_gpu::plan::TILE, capacity.wave, capacity.band),
        };
        let spheres = request.scene.len();
        // Every sphere in every tile is the most there can be.
        let tiles =
            u64::from(region.width.div_ceil(tile)) * u64::from(region.height.div_ceil(tile));
        let survey = Survey { entries: tiles.saturating_mul(spheres as u64), ..Survey::default() };
        let device = format!("{} ({})", self.device(), self.why());
        Plan {
            means,
            device,
            spheres,
            image: view.image,
            look: request.look.words(),
            region,
            projection: view.camera.projection,
            planes: [view.camera.near, view.camera.far],
            tile,
            wave,
            band,
            held: BAND,
            picture: sinks.picture.is_some(),
            palette: sinks.palette,
            ids: sinks.ids.is_some(),
            depth: sinks.depth.is_some(),
            part: sinks.part.is_some(),
            vectors: [sinks.normals.is_some(), sinks.positions.is_some()],
            all: sinks.planes.is_some(),
            exr: sinks.picture.is_some() && sinks.kind == Kind::Exr,
            survey,
        }
    }
}

impl Plan {
    fn workload(&self) -> Workload {
        Workload { spheres: self.spheres, region: self.region, entries: self.survey.entries }
    }

    /// Bytes that [`Renderer::render`] needs, which holds a band at a time, beyond the scene itself
    /// (whose mapped files the system may drop and read again). On the safe side.
    pub fn memory(&self) -> u64 {
        let pixels = self.region.pixels().min(self.held) as u64;
        // The program, its threads, an encoder's buffers, and bytes that wait in memory to be
        // written.
        let base = 32 << 20;
        let waiting = if self.palette { self.region.pixels() as u64 - pixels } else { 0 };
        let ids = 4 * (pixels + waiting);
        let part = (16 << 20) + self.spheres as u64 / 8;
        let planes = ids + 4 * pixels * u64::from(self.depth) + part * u64::from(self.part);
        let vectors = self.vectors.iter().filter(|wanted| **wanted).count() as u64;
        let whole = self.region.pixels() as u64;
        let planes = planes + 12 * pixels * vectors + 4 * whole * u64::from(self.all);
        // Colours, ids, depths and two vectors; packed, they are hardly longer.
        let planes = planes + 2 * 48 * whole * u64::from(self.exr);
        let work = self.workload();
        let device = match &self.means {
            Means::Cpu { .. } => cpu::memory(&work),
            #[cfg(feature = "gpu")]
            Means::Gpu(capacity) => capacity.memory(&work),
        };
        base + planes + device
    }

    /// Threads that draw, of native code.
    pub fn threads(&self) -> Option<usize> {
        match self.means {
            Means::Cpu { threads } => Some(threads),
            #[cfg(feature = "gpu")]
            Means::Gpu(_) => None,
        }
    }

    /// Whether the memory that a picture needs is that of a software device, which keeps a copy of
    /// the spheres.
    pub fn copies_spheres(&self) -> bool {
        match &self.means {
            Means::Cpu { .. } => false,
            #[cfg(feature = "gpu")]
            Means::Gpu(capacity) => capacity.software,
        }
    }

    /// Bytes that are needed, and bytes that there are, where it does not fit.
    pub fn shortage(&self) -> Option<[u64; 2]> {
        let needed = self.memory();
        // What needs no more than this is not worth asking the system.
        const SMALL: u64 = 64 << 20;
        let available = (needed > SMALL).then(planisphere_memory::available).flatten()?;
        (needed > available).then_some([needed, available])
    }

    /// Looks at the spheres, and puts into words what would run: topics, and what there is to say
    /// of each.
    pub fn lines(mut self, request: &Request) -> Vec<(&'static str, String)> {
        let (scene, view) = (request.scene.core(), request.view());
        let truth = Truth::new(&view, scene.bounds());
        self.survey = survey(scene, &truth, self.region, self.tile.trailing_zeros(), LOOK);
        lines(&self)
    }
}

/// Spheres that are looked at for an explanation.
const LOOK: usize = 1 << 20;

/// What runs and what does not, in words: a topic, and what there is to say.
fn lines(facts: &Plan) -> Vec<(&'static str, String)> {
    let Plan { survey, region, image, spheres, .. } = facts;
    let all = survey.step == 1;
    let about = if all { "" } else { "about " };
    let mut lines = Vec::new();
    let part = match *region == Region::whole(*image) {
        true => String::new(),
        false => format!(
            ", of which {} x {} from {},{} are drawn",
            region.width, region.height, region.x, region.y
        ),
    };
    lines.push(("picture", format!("{} x {} pixels{part}", image.width, image.height)));
    lines.push(("look", facts.look.clone()));
    lines.push(("device", facts.device.clone()));
    if *spheres == 0 {
        lines.push((
            "spheres",
            "none: nothing is projected, listed, drawn or decided; everything is background".into(),
        ));
    } else {
        let looked = if all {
            "all were looked at".into()
        } else {
            format!("one in {} was looked at", survey.step)
        };
        let outside = match survey.outside {
            0 if all => "none is skipped at once".into(),
            outside => {
                format!(
                    "{about}{outside} are off screen, outside the clip range or between the rays: \
                     projected, then skipped"
                )
            }
        };
        lines.push(("spheres", format!("{spheres}; {outside} ({looked})")));
        drawing(facts, about, &mut lines);
    }
    lines.push(("planes", planes(facts)));
    if facts.exr {
        let words = "linear light, and all planes: they wait in memory until the last is known";
        lines.push(("OpenEXR", words.into()));
    } else if facts.picture {
        let kind = match facts.palette {
            true => {
                "a palette, if at most 256 colours are seen: all ids wait until the last is known"
            }
            false => "RGB, 8 bits a channel",
        };
        lines.push(("PNG", kind.into()));
    }
    lines.push((
        "memory",
        format!("about {} beyond the scene's own files", text::bytes(facts.memory())),
    ));
    lines
}

/// What draws the spheres.
fn drawing(facts: &Plan, about: &str, lines: &mut Vec<(&'static str, String)>) {
    let Plan { survey, spheres, region, .. } = facts;
    let rays = match facts.projection {
        Projection::Orthographic => "parallel rays; the code for perspective is not used",
        Projection::Perspective => "perspective rays; the code for parallel ones is not used",
    };
    lines.push(("rays", rays.into()));
    let [near, far] = facts.planes;
    let clip = match survey.reaches {
        [false, false] if far == f64::INFINITY => {
            format!("no tests: no sphere reaches near ({near}), and there is no far plane")
        }
        [false, false] => format!("no tests: no sphere reaches near ({near}) or far ({far})"),
        reaches => {
            let which = match reaches {
                [true, true] => format!("near ({near}) and far ({far})"),
                [true, false] => format!("near ({near})"),
                _ => format!("far ({far})"),
            };
            format!(
                "spheres may reach {which}: {about}{} that may be cut are tested, the others are \
                 not",
                survey.cut
            )
        }
    };
    lines.push(("clip", clip));
    let empty = match survey.step {
        1 => format!("{} of them with no sphere: skipped", survey.empty),
        _ => "those with no sphere are skipped".into(),
    };
    lines.push((
        "tiles",
        format!("{} of {} x {} pixels, {empty}", survey.tiles, facts.tile, facts.tile),
    ));
    let waves = survey.entries.div_ceil(facts.wave.max(1) as u64).max(1);
    let bands = region.pixels().div_ceil(facts.band.max(1));
    let mut lists = format!("{about}{} entries if nothing were hidden, ", survey.entries);
    lists += &match waves {
        1 => "all at once".to_owned(),
        waves => format!("in up to {waves} waves"),
    };
    if bands > 1 {
        lists += &format!(", the picture in {bands} bands");
    }
    lines.push(("lists", lists));
    let order = match &facts.means {
        Means::Cpu { .. } if cpu::in_order(&facts.workload()) => {
            "in groups of neighbours, for all bands; groups off the screen or hidden are skipped \
             whole"
                .to_owned()
        }
        Means::Cpu { .. } if *spheres >= cpu::SAMPLED => {
            "front spheres first, by a sample; what they hide is not looked at again".to_owned()
        }
        Means::Cpu { .. } => {
            format!("front to back in each tile; no sample first, below {} spheres", cpu::SAMPLED)
        }
        #[cfg(feature = "gpu")]
        Means::Gpu(capacity) => {
            let buffers = spheres.div_ceil(capacity.chunk.max(1));
            let words =
                if buffers == 1 { "one buffer".into() } else { format!("{buffers} buffers") };
            format!(
                "front to back in each tile; the spheres are sent to the device once, in \
                     {words}"
            )
        }
    };
    lines.push(("order", order));
    lines.push((
        "exact",
        "only for what the bounds of the filter leave open; none of it runs where they do not"
            .into(),
    ));
}

/// Which planes are made.
fn planes(facts: &Plan) -> String {
    let all = [
        (facts.picture, "picture"),
        (facts.ids, "ids"),
        (facts.depth, "depths"),
        (facts.part, "what merging needs"),
    ];
    // These are said where they are made.
    let more = [
        (facts.vectors[0], "normals"),
        (facts.vectors[1], "positions"),
        (facts.all, "all planes in one file"),
    ];
    let all: Vec<_> = all.into_iter().chain(more.into_iter().filter(|(is, _)| *is)).collect();
    let of = |wanted: bool| {
        let names: Vec<&str> =
            all.iter().filter(|(is, _)| *is == wanted).map(|(_, name)| *name).collect();
        names.join(", ")
    };
    match (of(true), of(false)) {
        (made, left) if made.is_empty() => format!("none; not asked for: {left}"),
        (made, left) if left.is_empty() => made,
        (made, left) => format!("{made}; not asked for: {left}"),
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use planisphere_core::{
        camera::{Camera, ScreenSize, View},
        scene::Sphere,
    };

    #[cfg(feature = "gpu")]
    fn facts() -> Plan {
        let image = ImageSize { width: 1000, height: 500 };
        Plan {
            means: Means::Cpu { threads: 2 },
            device: "cpu".into(),
            spheres: 100,
            image,
            look: "flat, one sample a pixel".into(),
            region: Region::whole(image),
            projection: Projection::Orthographic,
            planes: [0.0, f64::INFINITY],
            tile: 32,
            wave: 1 << 20,
            band: 1 << 22,
            held: 1 << 25,
            picture: true,
            palette: false,
            ids: false,
            depth: false,
            part: false,
            vectors: [false; 2],
            all: false,
            exr: false,
            survey: Survey { step: 1, entries: 150, tiles: 512, empty: 12, ..Survey::default() },
        }
    }

    #[cfg(feature = "gpu")]
    fn gpu(chunk: usize) -> Means {
        let (software, wave, band) = (true, 1 << 22, 1 << 22);
        Means::Gpu(planisphere_gpu::plan::Capacity { software, chunk, wave, band })
    }

    /// Each change of the facts, and what it must, and must not, put into words.
    #[test]
    #[cfg(feature = "gpu")]
    fn words_follow_the_facts() {
        type Change = fn(&mut Plan);
        let table: &[(Change, &[&str], &[&str])] = &[
            (
                |_| {},
                &[
                    "1000 x 500 pixels\n",
                    "none is skipped",
                    "all were looked at",
                    "parallel rays",
                    "no tests",
                    "near (0)",
                ],
                &["about 150", "bands", "waves", "of which"],
            ),
            (
                |_| {},
                &[
                    "12 of them with no sphere",
                    "150 entries",
                    "all at once",
                    "RGB, 8 bits",
                    "no sample first",
                ],
                &[],
            ),
            (|_| {}, &["picture; not asked for: ids, depths, what merging needs"], &[]),
            (
                |f| f.spheres = 0,
                &["none: nothing is projected"],
                &["rays", "clip", "tiles", "lists"],
            ),
            (|f| f.survey.outside = 40, &["40 are off screen"], &["about 40", "none is skipped"]),
            (
                |f| (f.survey.step, f.survey.outside, f.spheres) = (16, 40, 200_000),
                &[
                    "about 40 are off screen",
                    "one in 16",
                    "about 150 entries",
                    "front spheres first",
                ],
                &["12 of them"],
            ),
            (
                |f| f.projection = Projection::Perspective,
                &["perspective rays"],
                &["parallel rays;"],
            ),
            (|f| f.planes = [0.5, 9.0], &["no sphere reaches near (0.5) or far (9)"], &[]),
            (
                |f| (f.planes, f.survey.reaches, f.survey.cut) = ([0.5, 9.0], [true, false], 3),
                &["may reach near (0.5): 3 that"],
                &["far", "no tests"],
            ),
            (|f| f.survey.reaches = [false, true], &["may reach far (inf)"], &[]),
            (|f| f.survey.entries = 3 << 20, &["in up to 3 waves"], &["all at once"]),
            (|f| f.band = 100_000, &["in 5 bands"], &[]),
            (|f| f.palette = true, &["a palette, if at most 256"], &["RGB"]),
            (|f| f.picture = false, &["none; not asked for: picture, ids"], &["PNG"]),
            (
                |f| (f.ids, f.depth, f.part) = (true, true, true),
                &["picture, ids, depths, what merging needs\n"],
                &["not asked for"],
            ),
            (|f| f.means = gpu(30), &["in 4 buffers"], &["sample first"]),
            (|f| f.means = gpu(100), &["one buffer"], &[]),
            (
                |f| f.region = Region { x: 3, y: 4, width: 50, height: 60 },
                &["1000 x 500 pixels, of which 50 x 60 from 3,4"],
                &[],
            ),
        ];
        for (k, (change, present, absent)) in table.iter().enumerate() {
            let mut facts = facts();
            change(&mut facts);
            let text: String =
                lines(&facts).iter().map(|(topic, words)| format!("{topic}: {words}\n")).collect();
            present
                .iter()
                .for_each(|word| assert!(text.contains(word), "row {k} lacks {word:?}:\n{text}"));
            absent
                .iter()
                .for_each(|word| assert!(!text.contains(word), "row {k} has {word:?}:\n{text}"));
        }
    }

    #[test]
    #[cfg(feature = "gpu")]
    fn memory_grows_with_what_is_held() {
        let small = facts().memory();
        let with = |change: fn(&mut Plan)| {
            let mut facts = facts();
            change(&mut facts);
            facts.memory()
        };
        assert!(with(|f| f.depth = true) == small + 4 * 500_000);
        // Beyond what is held at a time, a picture takes no more.
        let side = |side: u32| {
            let mut facts = facts();
            facts.region = Region { x: 0, y: 0, width: side, height: side };
            facts.memory()
        };
        assert!(side(32768) == side(8192) && side(4096) < side(8192));
        let banded = |spheres: usize| {
            let mut facts = facts();
            (facts.spheres, facts.region) =
                (spheres, Region { x: 0, y: 0, width: 8192, height: 8192 });
            facts.memory()
        };
        assert!(
            banded(1_000_000) - banded(500_000) == 500_000 * planisphere_core::order::BYTES,
            "in order"
        );
        // Mapped spheres cost the native device nothing but a bit where they may be seen, a
        // software device its copy.
        assert!(with(|f| f.spheres = 999) == small);
        assert!(with(|f| f.means = gpu(1 << 23)) > small);
        let many = with(|f| (f.spheres, f.means) = (100_000_000, gpu(1 << 23)));
        assert!(many > 2_800_000_000 && many < 4_000_000_000);
        assert_eq!(text::bytes(1_234_567), "1.2 MB");
        assert_eq!(text::bytes(123_456_789), "123 MB");
        assert_eq!(text::bytes(12_345_678_901), "12.3 GB");
    }

    #[test]
    fn a_survey_counts_what_a_scene_shows() {
        let ball =
            |x: f64, y: f64| Sphere { center: DVec3::new(x, y, 0.0), radius: 0.25, color: [0; 3] };
        // On screen, cut by near, behind, beside, beyond far.
        let spheres =
            [ball(5.0, 0.6), ball(1.1, -0.6), ball(-5.0, 0.0), ball(5.0, 50.0), ball(99.0, 0.0)];
        let scene = Scene::from_spheres(&spheres).unwrap();
        let camera = Camera {
            size: ScreenSize::Width(4.0),
            near: 1.0,
            far: 50.0,
            ..Camera::orthographic(DVec3::ZERO, DVec3::X)
        };
        let view = View::new(camera, ImageSize { width: 64, height: 64 });
        let truth = Truth::new(&view, scene.bounds());
        let found = survey(&scene, &truth, Region::whole(view.image), 4, 1000);
        assert_eq!((found.outside, found.cut, found.tiles, found.step), (3, 1, 16, 1));
        assert_eq!(found.reaches, [true, true]);
        // Eight pixels about each of two points, each in the middle of four tiles' sides or so.
        assert!(
            found.entries >= 2 && found.entries <= 8 && found.empty == 16 - found.entries,
            "{found:?}"
        );
        let many = Scene::from_spheres(&vec![ball(5.0, 0.6); 10_000]).unwrap();
        let part =
            survey(&many, &Truth::new(&view, many.bounds()), Region::whole(view.image), 4, 1000);
        assert!(
            part.step == 10
                && part.entries.is_multiple_of(10_000)
                && part.reaches == [false, false],
            "{part:?}"
        );
        let none = Scene::from_spheres(&[]).unwrap();
        let none =
            survey(&none, &Truth::new(&view, none.bounds()), Region::whole(view.image), 4, 1000);
        assert_eq!((none.entries, none.empty, none.reaches), (0, 16, [false, false]));
    }
}
