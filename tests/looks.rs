//! Looks and anti-aliasing, on every device: each byte of a picture equals the judge's. There is no
//! tolerance.
//!
//! Every kind of look is drawn from every kind of camera; looks of random numbers are drawn of each
//! scene of the corpus and of random scenes, of a part of the picture that is small enough for the
//! judge. `PLANISPHERE_CASE` keeps to the scenes whose name contains a word, and
//! `PLANISPHERE_SEEDS=1000..2000` chooses the seeds of the random ones.

mod corpus;
mod judge;

use corpus::{Case, ball, pixels, random::Random};
use glam::DVec3;
use judge::looks::{By, Outline, Samples, Shade, Wanted, along};
use planisphere_core::{
    camera::{Camera, Projection, Region, ScreenSize, View},
    cpu::{Cpu, Effort},
    exact::decide::Truth,
    scene::Scene,
};
use planisphere_image::{
    resolve::{Columns, Resolver},
    style::{self, Style},
};
use planisphere_renderer::{self as renderer, Device, Engine, Renderer};
use rayon::prelude::*;

/// The columns of a scene that looks go by.
struct Known {
    groups: Vec<u32>,
    openness: Vec<u8>,
}

impl Known {
    fn new(spheres: usize, random: &mut Random) -> Self {
        let groups = (0..spheres).map(|_| random.below(3) as u32).collect();
        let openness = (0..spheres).map(|_| random.below(256) as u8).collect();
        Self { groups, openness }
    }

    fn by_groups(&self) -> By {
        By::Groups(self.groups.iter().copied().map(i64::from).collect())
    }

    fn soft(&self, strength: u32) -> Shade {
        Shade::Soft { strength, openness: self.openness.clone() }
    }
}

/// Looks of a part of a scene's picture, and the judge's pictures.
struct Trial {
    case: Case,
    region: Region,
    known: Known,
    /// The depths between which the scene lies.
    along: Option<[f64; 2]>,
    looks: Vec<(Wanted, Vec<[u8; 4]>)>,
}

impl Trial {
    /// Asks the judge; looks with equally many samples share what is seen.
    fn new(case: Case, region: Region, known: Known, looks: Vec<Wanted>) -> Self {
        let mut judged = Vec::new();
        for alike in looks.chunk_by(|a, b| a.aa == b.aa) {
            let alike: Vec<&Wanted> = alike.iter().collect();
            let samples = Samples::new(&case.scene, &case.view, region, &alike);
            judged.extend(alike.into_iter().map(|wanted| samples.picture(wanted)));
        }
        let looks = looks.into_iter().zip(judged).collect();
        Self { along: scene_cue(&case), case, region, known, looks }
    }
}

// ---- What draws ----

/// A look as the library takes it, but for what it does not take yet.
fn facade(wanted: &Wanted, along: Option<[f64; 2]>) -> Option<renderer::Look> {
    let mut look = match wanted.shade {
        Shade::Flat => renderer::Look::flat(),
        Shade::Matte { ambient } => {
            renderer::Look::matte().ambient(f64::from(ambient) / 255.0).expect("a part")
        }
        Shade::Soft { .. } => return None,
    };
    look = look.background(wanted.background).aa(wanted.aa).expect("a number of samples");
    if wanted.encoded {
        look = look.encoded();
    }
    if wanted.transparent {
        look = look.transparent();
    }
    match wanted.cue {
        None => {}
        Some(depths) if Some(depths) == along => look = look.depth_cue(),
        Some(depths) => look = look.depth_cue_between(depths).expect("two depths"),
    }
    if let Some(outline) = &wanted.outline {
        look = look.outline(outline.width).expect("a width").outline_color(outline.color);
        if let Some(length) = outline.jump {
            look = look.outline_jump(length).expect("a length");
        }
        look = match outline.by {
            By::Jump => look,
            By::Sphere => look.outline_spheres(),
            By::Groups(_) => return None,
        };
    }
    Some(look)
}

/// The same in the numbers that follow from it.
fn inner(wanted: &Wanted) -> Style {
    let byte = |x: u32| u8::try_from(x).expect("of 255");
    Style {
        background: wanted.background,
        transparent: wanted.transparent,
        aa: wanted.aa,
        space: if wanted.encoded { style::Space::Encoded } else { style::Space::Linear },
        shade: match wanted.shade {
            Shade::Flat | Shade::Soft { .. } => style::Shade::Flat,
            Shade::Matte { ambient } => style::Shade::Matte { ambient: byte(ambient) },
        },
        occlusion: match wanted.shade {
            Shade::Soft { strength, .. } => Some(byte(strength)),
            Shade::Flat | Shade::Matte { .. } => None,
        },
        cue: wanted.cue,
        outline: wanted.outline.as_ref().map(|outline| style::Outline {
            width: outline.width,
            color: outline.color,
            between: match outline.by {
                By::Jump => style::Between::Jumps,
                By::Sphere => style::Between::Spheres,
                By::Groups(_) => style::Between::Groups,
            },
            jump: outline.jump,
        }),
    }
}

/// Draws with an engine and resolves, without the library.
fn resolve(engine: &mut Engine, trial: &Trial, wanted: &Wanted) -> Vec<[u8; 4]> {
    let Trial { case: Case { scene, view, .. }, region, known, .. } = trial;
    let style = inner(wanted);
    let raster = style.samples(view);
    let truth = Truth::new(&raster, scene.bounds());
    let columns = Columns { groups: Some(&known.groups), openness: Some(&known.openness) };
    let resolver = Resolver::new(scene, &truth, &style, columns);
    let ids = engine.draw(scene, &raster, resolver.samples(*region)).expect("it is drawn").ids;
    let mut pixels = vec![[0; 4]; region.pixels()];
    resolver.pixels(*region, &ids, &mut pixels).expect("as many as asked for");
    pixels
}

/// What draws, opened.
struct Devices {
    cpu: Renderer,
    gpu: Renderer,
    /// Nothing is too small to be ordered and skipped.
    skipping: Engine,
    any_gpu: Engine,
}

impl Devices {
    fn open() -> Self {
        let effort = Effort { order: 0, cover: 0, sample: 0, wave: 16, blocks: 0 };
        let gpu =
            || "these tests need both devices; on Debian: apt-get install mesa-vulkan-drivers";
        let any_gpu = Engine::open(&Device::Gpu).unwrap_or_else(|e| panic!("{e}\n{}", gpu()));
        Self {
            cpu: Renderer::cpu(),
            gpu: Renderer::open(&Device::Gpu).unwrap_or_else(|e| panic!("{e}\n{}", gpu())),
            skipping: Engine::Cpu(Box::new(Cpu::with(effort))),
            any_gpu,
        }
    }

    /// The picture as each device draws it.
    fn draw(&mut self, trial: &Trial, wanted: &Wanted) -> Vec<(&'static str, Vec<[u8; 4]>)> {
        let Some(look) = facade(wanted, trial.along) else {
            let skipping = ("the CPU, skipping", resolve(&mut self.skipping, trial, wanted));
            return vec![skipping, ("a GPU", resolve(&mut self.any_gpu, trial, wanted))];
        };
        let Case { scene, view, name } = &trial.case;
        let camera = renderer::Camera::try_from(view.camera).expect("a camera");
        let (scene, size) = (renderer::Scene::from(scene.clone()), view.image);
        let request = renderer::Request::new(&scene, camera, [size.width, size.height])
            .and_then(|request| request.region(trial.region))
            .expect("a picture")
            .look(look);
        let draw = |renderer: &Renderer| {
            let picture = renderer.draw(&request);
            picture.unwrap_or_else(|error| panic!("{name}: {error}")).rgba().to_vec()
        };
        vec![("CPU", draw(&self.cpu)), ("GPU", draw(&self.gpu))]
    }
}

/// Compares what each device draws with the judge's pictures.
fn compare(trials: &[Trial]) {
    let mut devices = Devices::open();
    let (mut pictures, mut pixels, mut colors) = (0, 0, std::collections::HashSet::new());
    let mut wrong = Vec::new();
    for trial in trials {
        for (wanted, want) in &trial.looks {
            colors.extend(want.iter().copied());
            for (device, got) in devices.draw(trial, wanted) {
                pictures += 1;
                pixels += want.len();
                assert_eq!(got.len(), want.len(), "{}", trial.case.name);
                let Some(k) = (0..want.len()).find(|&k| got[k] != want[k]) else { continue };
                let (width, region) = (trial.region.width as usize, trial.region);
                let all = (0..want.len()).filter(|&k| got[k] != want[k]).count();
                wrong.push(format!(
                    "{}, {device}: {all} of {} pixels differ; column {}, row {}: want {:?}, got \
                     {:?}\n    {region:?} of {:?}\n    {wanted:?}",
                    trial.case.name,
                    want.len(),
                    region.x as usize + k % width,
                    region.y as usize + k / width,
                    want[k],
                    got[k],
                    trial.case.view,
                ));
            }
        }
    }
    println!("{pictures} pictures, {pixels} pixels, {} colours", colors.len());
    let count = wrong.len();
    wrong.truncate(8);
    assert!(wrong.is_empty(), "{count} of {pictures} are wrong:\n{}", wrong.join("\n"));
    assert!(colors.len() > 100, "all of one kind");
}

// ---- Every look from every camera ----

/// A heap of spheres, some of them alike, in a ball of 4 around the middle.
fn heap() -> Scene {
    let mut random = Random::new(61);
    let mut spheres: Vec<_> =
        (0..40).map(|_| ball(random.ball() * 4.0, random.between(0.2, 1.4))).collect();
    spheres.push(ball(DVec3::ZERO, 2.0));
    spheres.push(ball(DVec3::new(0.0, 6.5, 0.0), 2.5));
    spheres.push(spheres[40]);
    corpus::scene(&spheres)
}

/// Orthographic, perspective, from inside of a sphere, cut by the near plane, along axes and not.
fn cameras() -> Vec<(&'static str, Camera)> {
    let mut cameras = Vec::new();
    let along = |projection, origin, view, size: f64| {
        let size = ScreenSize::Both { width: size, height: 0.75 * size };
        Camera { projection, size, ..Camera::orthographic(origin, view) }
    };
    let (flat, point) = (Projection::Orthographic, Projection::Perspective);
    let (x, oblique) = (DVec3::X, DVec3::new(1.0, 2.0, 3.0));
    cameras.push(("parallel", along(flat, -16.0 * x, x, 12.0)));
    cameras.push(("perspective", along(point, -16.0 * x, x, 0.75)));
    cameras.push(("oblique, parallel", along(flat, -4.0 * oblique, oblique, 12.0)));
    cameras.push(("oblique, perspective", along(point, -4.0 * oblique, oblique, 0.75)));
    cameras.push(("inside", along(point, DVec3::new(0.25, 0.5, 0.0), oblique, 3.0)));
    let mut cut = along(flat, -16.0 * x, x, 12.0);
    (cut.near, cut.far) = (15.0, 19.0);
    cameras.push(("cut", cut));
    let mut cut = along(point, -4.0 * oblique, oblique, 0.75);
    cut.near = 14.5;
    cameras.push(("oblique, cut", cut));
    cameras
}

/// Every kind of look, as it is and transparent.
fn kinds(aa: u32, known: &Known) -> Vec<Wanted> {
    let line = |width, jump, by| Some(Outline { width, jump, by, color: [200, 30, 60] });
    let flat = Wanted {
        aa,
        encoded: false,
        shade: Shade::Flat,
        cue: None,
        outline: None,
        background: [250, 240, 90],
        transparent: false,
    };
    let matte = Wanted { shade: Shade::Matte { ambient: 51 }, ..flat.clone() };
    let soft = Wanted { shade: known.soft(230), ..flat.clone() };
    let cue = Some([12.0, 20.0]);
    let opaque = [
        flat.clone(),
        Wanted { encoded: true, ..flat.clone() },
        matte.clone(),
        soft.clone(),
        Wanted { cue, outline: line(1.5, None, By::Jump), ..flat.clone() },
        Wanted { outline: line(1.0, Some(1.0), By::Sphere), ..flat },
        Wanted { outline: line(2.0, Some(2.0), By::Jump), ..matte.clone() },
        Wanted { cue, encoded: true, outline: line(1.0, None, known.by_groups()), ..matte },
        Wanted { cue, ..soft },
    ];
    opaque
        .into_iter()
        .flat_map(|wanted| [Wanted { transparent: true, ..wanted.clone() }, wanted])
        .collect()
}

#[test]
fn every_look_from_every_camera_is_the_judges() {
    let scene = heap();
    let trials: Vec<Trial> = cameras()
        .into_par_iter()
        .map(|(name, camera)| {
            let known = Known::new(scene.len(), &mut Random::new(5));
            let mut looks = kinds(1, &known);
            looks.extend(kinds(4, &known));
            let view = View::new(camera, pixels(24, 18));
            let case = Case { name: name.into(), scene: scene.clone(), view };
            let region = Region::whole(view.image);
            Trial::new(case, region, known, looks)
        })
        .collect();
    compare(&trials);
}

// ---- Random looks of many scenes ----

/// The depths between which a scene lies, unless it is a large one.
fn scene_cue(case: &Case) -> Option<[f64; 2]> {
    let found = (case.scene.len() <= 1000).then(|| along(&case.scene, &case.view));
    // Where all is at one depth, or beyond f64, they are no two depths.
    found.flatten().filter(|[near, far]| near < far)
}

/// A look of random numbers.
fn random_look(
    aa: u32,
    known: &Known,
    lengths: &[f64],
    along: Option<[f64; 2]>,
    random: &mut Random,
) -> Wanted {
    let color = |random: &mut Random| [(); 3].map(|()| random.below(256) as u8);
    let length = |random: &mut Random| lengths[random.below(lengths.len() as u64) as usize];
    let shade = match random.below(4) {
        0 => Shade::Flat,
        1 => known.soft(random.below(256) as u32),
        2 => Shade::Matte { ambient: [0, 51, 255][random.below(3) as usize] },
        _ => Shade::Matte { ambient: random.below(256) as u32 },
    };
    let mut cue = None;
    if random.below(2) == 0 {
        let (a, b) = (length(random), length(random));
        let a = if random.below(6) == 0 { -a } else { a };
        cue = (a != b).then_some([a.min(b), a.max(b)]);
        if random.below(3) == 0 {
            cue = along;
        }
    }
    let mut outline = None;
    if random.below(2) == 0 {
        // Squares of distances from an edge are whole numbers of a kind: 1, 5, 13 and so on.
        let root = f64::from([5, 13, 17][random.below(3) as usize]).sqrt() / f64::from(aa);
        let width = [0.25, 0.5, 1.0, 1.0, 1.5, 2.0, root, random.between(0.1, 3.0)];
        let width = width[random.below(8) as usize];
        // Just what reaches a sample, or just not.
        let width = [width, width, width.next_up(), width.next_down()][random.below(4) as usize];
        outline = Some(Outline {
            width,
            jump: (random.below(2) == 0).then(|| length(random)),
            by: match random.below(4) {
                0 => By::Sphere,
                1 => known.by_groups(),
                _ => By::Jump,
            },
            color: color(random),
        });
    }
    Wanted {
        aa,
        encoded: random.below(4) == 0,
        shade,
        cue,
        outline,
        background: color(random),
        transparent: random.below(2) == 0,
    }
}

/// A part of a picture, in the middle of it or anywhere.
fn part(view: &View, [width, height]: [u32; 2], random: &mut Random) -> Region {
    let [width, height] = [width.min(view.image.width), height.min(view.image.height)];
    let (aside, above) = (view.image.width - width, view.image.height - height);
    let (x, y) = match random.below(3) {
        0 => (random.whole(0, aside.into()) as u32, random.whole(0, above.into()) as u32),
        _ => (aside / 2, above / 2),
    };
    Region { x, y, width, height }
}

/// Draws a few random looks of each scene.
fn random_looks(cases: Vec<Case>) {
    let trials: Vec<Trial> = cases
        .into_par_iter()
        .enumerate()
        .flat_map_iter(|(k, case)| {
            let mut random = Random::new(k as u64 ^ 0x100c);
            let random = &mut random;
            let lengths = match case.scene.len() {
                0 => vec![0.0, 1.0],
                _ => corpus::lengths(&case, random),
            };
            let few = case.scene.len() > 1000;
            let scene_cue = scene_cue(&case);
            [1, [4, 4, 2, 8][random.below(4) as usize]].map(|aa: u32| {
                let size = match (aa, few) {
                    (1, false) => [20, 15],
                    (8, _) | (_, true) => [3, 2],
                    _ => [6, 5],
                };
                let known = Known::new(case.scene.len(), random);
                let region = part(&case.view, size, random);
                let looks =
                    (0..2).map(|_| random_look(aa, &known, &lengths, scene_cue, random)).collect();
                Trial::new(case.clone(), region, known, looks)
            })
        })
        .collect();
    compare(&trials);
}

#[test]
fn looks_of_the_corpus_are_the_judges() {
    let word = std::env::var("PLANISPHERE_CASE").unwrap_or_default();
    random_looks(corpus::corpus().into_iter().filter(|case| case.name.contains(&word)).collect());
}

#[test]
fn looks_of_random_scenes_are_the_judges() {
    random_looks(corpus::seeds(0..300).map(corpus::fuzz::fuzz).collect());
}
