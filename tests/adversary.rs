//! The GPU's filter against the worst device that WGSL allows.
//!
//! The shaders run on the host (`emulator`), where every sum, difference and product is rounded up
//! or down, fused or not, taken in another order, every quotient and root is off by all that it may
//! be, and subnormal numbers vanish or not. What the filter settles there must be the judge's
//! answer all the same.
//!
//! The bounds in the shaders are measured too: the largest error found over its bound must be above
//! 1/8 and at most 1, so that a constant in the WGSL that is eight times too large or too small
//! fails here. Nothing of the WGSL is repeated in this file but what each number means.

mod corpus;
mod emulator;
mod judge;
#[expect(dead_code, reason = "shared with tests/bounds.rs, which uses the rest")]
mod measure;

use std::{
    collections::HashMap,
    ops::Range,
    sync::{
        Arc,
        atomic::{AtomicUsize, Ordering},
    },
};

use corpus::{Case, random::Random};
use emulator::{
    Machine, Value,
    float::{Habits, Rounding, Unfriendly},
};
use glam::DVec3;
use judge::Judge;
use measure::{Exact, Input, LEAST, Stage, error, exact, neighbour, stages};
use planisphere_core::{
    bins::KeepAll,
    camera::{Camera, ImageSize, Projection, Region, ScreenSize, View},
    exact::{dd::Bounded, decide::Truth},
    ids::{NONE, Slot, SortedIndex, TileIndex, UNDECIDED},
    scene::{Bounds, Scene},
};
use planisphere_gpu::{
    Gpu,
    adapters::AdapterChoice,
    lists::{Spheres, Wave},
    plan::{self, Band, Class, Eye, FRESH, Fixed, LAST, Limits, Segment, TILE, TILE_PIXELS},
};
use planisphere_shaders::{FANS, Lanes, PLANES, STATES, TILES_ALONE, Variant};
use rayon::prelude::*;

/// The shader of a variant, parsed.
fn module(variant: Variant) -> Arc<naga::Module> {
    Arc::new(variant.source().validate().unwrap_or_else(|message| panic!("{message}")).0)
}

/// What the filter settles on a device of such habits; [`UNDECIDED`] elsewhere. None where the host
/// decides all.
fn emulated(
    scene: &Scene,
    view: &View,
    habits: Habits,
    seed: u64,
    limits: Limits,
) -> Option<Vec<i32>> {
    let region = Region::whole(view.image);
    let fixed = Fixed::new(&scene.bounds())?;
    let eye = Eye::new(&fixed, &scene.bounds(), view)?;
    let truth = Truth::new(view, scene.bounds());
    let mut wave = Wave::default();
    let mut all = [Range { start: 0, end: scene.len() }];
    // Places are indices.
    let spheres = Spheres { scene, truth: &truth, ordered: None };
    wave.collect(spheres, region, &mut all, usize::MAX, &KeepAll);
    assert!(all[0].is_empty());
    let mut band = Band::new(region);
    let (passes, single) = band.passes(&wave.lists(), &eye, limits, true);
    let records: Vec<[i32; 4]> = (0..scene.len())
        .map(|k| scene.sphere(k).unwrap())
        .map(|s| fixed.record(s.center, s.radius))
        .collect();
    let disorder = eye.steps(wave.lists().disorder);

    let mut ids = vec![NONE; region.pixels()];
    let mut states = Vec::new();
    let mut modules = HashMap::new();
    let mut dispatch = |clipped: bool,
                        disorder: f32,
                        entries: &[SortedIndex],
                        segments: &[Segment],
                        tiles: &[plan::Tile]| {
        let projection = eye.projection();
        let variant = Variant {
            projection,
            clipped,
            merged: !single,
            certain: true,
            lanes: Lanes::Alone,
            few: false,
        };
        let module = modules.entry(variant).or_insert_with(|| module(variant)).clone();
        let mut machine = Machine::new(module, Unfriendly::new(habits, seed));
        let places: Vec<_> = segments.iter().map(|segment| band.place(segment.tile)).collect();
        let groups = (tiles.len() as u32).div_ceil(TILES_ALONE);
        let frame =
            plan::Frame { first: 0, tiles: tiles.len() as u32, row: groups, disorder, ..eye.frame };
        machine.bind(0, bytemuck::bytes_of(&frame));
        machine.bind(1, bytemuck::cast_slice(&records));
        machine.bind(2, bytemuck::cast_slice(entries));
        machine.bind(3, bytemuck::cast_slice(tiles));
        machine.bind(4, &vec![0; 4 * TILE_PIXELS * tiles.len().max(band.tiles())]);
        machine.bind(FANS, bytemuck::cast_slice(&places.iter().map(|p| p.fan).collect::<Vec<_>>()));
        machine.bind(
            PLANES,
            bytemuck::cast_slice(&places.iter().map(|p| p.planes).collect::<Vec<_>>()),
        );
        if !single {
            if states.is_empty() {
                machine
                    .bind(STATES, &vec![0; size_of::<plan::State>() * TILE_PIXELS * band.tiles()]);
                states = machine.take(STATES);
            }
            machine.put(STATES, std::mem::take(&mut states));
        }
        for group in 0..groups {
            for local in 0..64 {
                machine.invoke([group, 0, 0], local);
            }
        }
        if !single {
            states = machine.take(STATES);
        }
        for (segment, tile) in segments.iter().zip(tiles) {
            if tile.slot & LAST != 0 {
                // Four in each.
                let at = (tile.slot & !(FRESH | LAST)) as usize * TILE_PIXELS / 4;
                let found = &machine.read(4)[at..at + TILE_PIXELS / 4];
                let pixels: Vec<i32> =
                    found.iter().flat_map(|v| [0, 1, 2, 3].map(|k| v.int(k))).collect();
                fill(&mut ids, region, band.columns, segment.tile, &pixels);
            }
        }
    };
    type Place<'a> = &'a dyn Fn(usize, &Segment) -> (Slot, u32);
    let table = |segments: &[Segment], place: Place<'_>| -> Vec<plan::Tile> {
        let made = |(k, s): (usize, &Segment)| {
            let (slot, flags) = place(k, s);
            plan::Tile {
                start: s.start,
                count: s.count,
                slot: slot.0 | flags,
                ..band.place(s.tile).tile
            }
        };
        segments.iter().enumerate().map(made).collect()
    };
    for pass in &passes {
        let slot = |k: usize, s: &Segment| match single {
            true => (Slot(k as u32), FRESH | LAST),
            false => (s.tile.slot(), if s.fresh { FRESH } else { 0 }),
        };
        let tiles = table(&pass.segments, &slot);
        dispatch(
            pass.clipped,
            disorder,
            &wave.lists().entries[pass.window.clone()],
            &pass.segments,
            &tiles,
        );
    }
    if !single {
        let met: Vec<Segment> = band
            .met()
            .into_iter()
            .map(|tile| Segment { tile, start: 0, count: 0, fresh: false })
            .collect();
        // An empty list reads an entry all the same.
        let entry = [SortedIndex(0)];
        let tiles = table(&met, &|_, s| (s.tile.slot(), LAST));
        dispatch(false, plan::NEVER, &entry, &met, &tiles);
    }
    for &tile in &band.host {
        fill(&mut ids, region, band.columns, tile, &[UNDECIDED; TILE_PIXELS]);
    }
    Some(ids)
}

/// The pixels of a tile, column by column, into their places.
fn fill(ids: &mut [i32], region: Region, columns: u32, tile: TileIndex, pixels: &[i32]) {
    let (x, y) = (tile.0 % columns * TILE, tile.0 / columns * TILE);
    for row in 0..TILE.min(region.height - y) {
        for column in 0..TILE.min(region.width - x) {
            ids[((y + row) * region.width + x + column) as usize] =
                pixels[(column * TILE + row) as usize];
        }
    }
}

const ALL: Limits = Limits {
    wave: usize::MAX,
    entries: usize::MAX,
    tiles: usize::MAX,
    few: 0,
    worth: 0,
    round: 60_000,
};
/// So small that tiles take several passes.
const SMALL: Limits = Limits { round: 1, ..ALL };

/// On a friendly device the emulator gives what the software device gives, undecided pixels
/// included: so it is the shaders that it runs.
#[test]
fn the_emulator_is_the_device() {
    let mut gpu = Gpu::open(&AdapterChoice::Any).unwrap_or_else(|error| panic!("{error}"));
    assert!(gpu.set_lanes(Lanes::Alone));
    let mut compared = 0;
    for case in corpus::corpus().into_iter().step_by(9) {
        let region = Region::whole(case.view.image);
        if case.scene.len() * region.pixels() > 1 << 17 {
            continue;
        }
        let Some(got) = emulated(&case.scene, &case.view, Habits::FRIENDLY, 0, ALL) else {
            continue;
        };
        let want = gpu
            .draw_filter(&case.scene, &case.view, region)
            .unwrap_or_else(|error| panic!("{error}"))
            .ids;
        assert!(
            got == want,
            "{}: {} pixels differ",
            case.name,
            got.iter().zip(&want).filter(|(a, b)| a != b).count()
        );
        compared += 1;
    }
    assert!(compared > 10, "{compared}");
}

/// Compares what is settled with the judge.
fn check(case: &Case, seed: u64, limits: Limits, settled: &AtomicUsize, undecided: &AtomicUsize) {
    let habits = Habits::of_seed(seed);
    let Some(got) = emulated(&case.scene, &case.view, habits, seed, limits) else { return };
    let region = Region::whole(case.view.image);
    let want = Judge::new(&case.scene, &case.view).ids(region);
    for (k, (&got, &want)) in got.iter().zip(&want).enumerate() {
        if got == UNDECIDED {
            undecided.fetch_add(1, Ordering::Relaxed);
            continue;
        }
        settled.fetch_add(1, Ordering::Relaxed);
        let (column, row) = (k as u32 % region.width, k as u32 / region.width);
        assert_eq!(
            got, want,
            "{}: column {column}, row {row}, device {seed}: {habits:?}",
            case.name
        );
    }
}

#[test]
fn settled_pixels_are_the_judges() {
    let (settled, undecided) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let light = |case: &Case| case.scene.len() * case.view.image.pixels() <= 1 << 15;
    let cases: Vec<Case> = corpus::corpus()
        .into_iter()
        .chain((0..200).map(corpus::fuzz::fuzz))
        .filter(light)
        .collect();
    // Another device for each, in one pass a tile and in several.
    cases.par_iter().enumerate().for_each(|(k, case)| {
        check(case, 1000 + k as u64, ALL, &settled, &undecided);
        check(case, 5000 + k as u64, SMALL, &settled, &undecided);
    });
    let (settled, undecided) = (settled.into_inner(), undecided.into_inner());
    println!(
        "{} scenes: {settled} pixels settled, all right; {undecided} left to the host",
        cases.len()
    );
    assert!(settled > undecided, "{settled} of {undecided}");
}

// ---- The bounds, measured ----

/// A device with a view of some data, and a sphere among it.
struct Probe<'a> {
    stage: &'a Stage,
    machine: Machine,
    fixed: Fixed,
    eye: Eye,
    bounds: Bounds,
    /// A step in world units.
    step: f64,
    /// Depth of the middle of the data, exactly, in steps.
    middle: Bounded,
    clipped: bool,
}

/// What the shader finds for a sphere at a pixel, in steps.
struct Found {
    item: Value,
    chord: Value,
    /// Of the vectors in `chord`.
    lane: usize,
    /// Place of the centre along the tile's first axis, or `n`.
    place: f64,
    /// Lower bound of the depth, as that of a key; none for a certain miss.
    low: Option<f64>,
    /// What the shader takes for that as a depth.
    low_depth: f64,
    /// A depth in the tile, where the shader has it along the ray, as that of a key, and its bound
    /// on the error of that.
    plane: [f64; 3],
    /// Keys are so much greater than they would be of themselves; perspective only.
    lift: f64,
    safe: bool,
    /// What depths are less than those from the camera.
    base: Bounded,
    /// The tile's middle: on the screen at distance 1 if perspective, else in world units.
    middle: [Bounded; 2],
}

/// What several passes found of a pixel, merged. Intervals of depths may be as wide as they like:
/// who stays is not always who may be nearest.
#[test]
fn passes_are_merged() {
    let variant = Variant::all()
        .find(|variant| variant.certain && variant.merged && !variant.clipped)
        .unwrap();
    let module = module(variant);
    // The lower and upper bounds of passes, and which of them is seen.
    let cases: [(&[[f32; 2]], i32); 8] = [
        (&[[5.0, 6.0]], 0),
        (&[[5.0, 6.0], [7.0, 8.0]], 0),
        (&[[7.0, 8.0], [5.0, 6.0]], 1),
        (&[[5.0, 6.0], [6.0, 8.0]], UNDECIDED),
        (&[[5.0, 10.0], [3.0, 12.0]], UNDECIDED),
        (&[[5.0, 10.0], [3.0, 12.0], [4.0, 4.5]], UNDECIDED),
        (&[[5.0, 10.0], [3.0, 12.0], [1.0, 2.0]], 2),
        (&[[plan::NEVER; 2], [plan::NEVER; 2]], NONE),
    ];
    for (passes, want) in cases {
        let mut machine = Machine::new(module.clone(), Unfriendly::new(Habits::FRIENDLY, 0));
        machine.bind(4, &[0; 4 * TILE_PIXELS]);
        machine.bind(STATES, &[0; size_of::<plan::State>() * TILE_PIXELS]);
        for (k, &[low, high]) in passes.iter().enumerate() {
            let slot =
                if k == 0 { FRESH } else { 0 } | if k + 1 == passes.len() { LAST } else { 0 };
            let tile = plan::Tile { slot, ..bytemuck::Zeroable::zeroed() };
            machine.bind(3, bytemuck::bytes_of(&tile));
            let tile = machine.call("tile_at", vec![Value::U32(std::iter::once(0).collect())]);
            let id = Value::I32(
                std::iter::once(if low == plan::NEVER { NONE } else { k as i32 }).collect(),
            );
            let [low, high, rest] = [low, high, plan::NEVER].map(|depth| Value::floats(&[depth]));
            let place = Value::U32(std::iter::once(0).collect());
            machine
                .perform("finish", vec![tile, place, Value::Struct([id, low, high, rest].into())]);
        }
        assert_eq!(machine.read(4)[0].int(0), want, "{passes:?}");
    }
}

/// Roots by their bits, for mantissas of two exponents; of others the bits are the same but for
/// their exponent.
#[test]
fn roots_are_above() {
    let variant = Variant::all().find(|variant| variant.certain).unwrap();
    let mut machine = Machine::new(module(variant), Unfriendly::new(Habits::FRIENDLY, 0));
    let mut above = |x: f32| machine.call("above_root", vec![Value::floats(&[x])]).float(0);
    let most = 1.061;
    let mut check = |x: f32| {
        let (square, x) = (f64::from(above(x)).powi(2), f64::from(x));
        assert!(square >= x && square <= most * most * x, "{x}: {square}");
    };
    // One in 64, and where the lesser of both means is the root itself.
    (1.0f32.to_bits()..4.0f32.to_bits()).step_by(64).map(f32::from_bits).for_each(&mut check);
    for x in [1.0, 2.0, 3.0] {
        (0..64).map(|k| f32::from_bits(f32::to_bits(x) + k)).for_each(&mut check);
    }
    [f32::MIN_POSITIVE, 1e-30, 1e30, f32::MAX].into_iter().for_each(check);
}

/// What binds the ratio.
#[derive(Clone, Copy)]
struct Scale {
    /// Size of the data against the height of the screen, powers of ten.
    data: [f64; 2],
    /// Distance of the data against its size.
    distance: [f64; 2],
    /// Radius against the screen, powers of ten.
    radius: [f64; 2],
    /// Radii against `delta` instead.
    of_delta: bool,
    /// By the kernel of tiles that planes cut, for the sake of spheres about the camera.
    clipped: bool,
}

impl Scale {
    const USUAL: Self = Self {
        data: [-1.0, 1.0],
        distance: [0.3, 2.0],
        radius: [-3.0, -1.0],
        of_delta: false,
        clipped: false,
    };
}

impl<'a> Probe<'a> {
    fn new(
        stage: &'a Stage,
        random: &mut Random,
        scale: Scale,
        module: &Arc<naga::Module>,
        seed: u64,
    ) -> Option<Self> {
        let View { camera, pitch_y, image, .. } = stage.view;
        let screen = pitch_y.to_f64() * f64::from(image.height);
        let size = random.power(scale.data[0], scale.data[1])
            * if stage.perspective { 1.0 } else { screen };
        let distance = size * random.power(scale.distance[0], scale.distance[1]);
        let ray = stage.view.ray(image.width / 2, image.height / 2);
        let middle = ray.origin + ray.direction * distance;
        let screen = if stage.perspective { screen * distance } else { screen };
        let max_radius = screen * random.power(scale.radius[0], scale.radius[1]);
        let half = DVec3::splat(size);
        let (min_center, max_center) = (middle - half, middle + half);
        let mut bounds =
            Bounds { min_center, max_center, min_radius: max_radius * 1e-6, max_radius };
        let fixed = Fixed::new(&bounds)?;
        let mut eye = Eye::new(&fixed, &bounds, &stage.view)?;
        if scale.of_delta {
            let unit = corpus::two_to(fixed.exponent) / f64::from(eye.frame.scale);
            bounds.max_radius =
                unit * f64::from(eye.frame.delta) * random.power(scale.radius[0], scale.radius[1]);
            eye = Eye::new(&fixed, &bounds, &stage.view)?;
        }
        // Signs of the errors that go with a place in the program, or with chance.
        let habits = Habits {
            rounding: [
                Rounding::Fixed,
                Rounding::Fixed,
                Rounding::Random,
                Rounding::Up,
                Rounding::Down,
            ][(seed % 5) as usize],
            ..Habits::of_seed(seed)
        };
        let machine = Machine::new(module.clone(), Unfriendly::new(habits, seed));
        let step = corpus::two_to(fixed.exponent) / f64::from(eye.frame.scale);
        let f = [0, 1, 2].map(|k| Bounded::difference(fixed.middle[k], camera.origin[k]));
        let along = f[0] * stage.axes[2][0] + f[1] * stage.axes[2][1] + f[2] * stage.axes[2][2];
        let middle = along * exact(1.0 / step);
        Some(Self { stage, machine, fixed, eye, bounds, step, middle, clipped: scale.clipped })
    }

    /// A sphere among the data, so near to a pixel's ray; none if there is none.
    fn input(&self, random: &mut Random, apart: [f64; 2]) -> Option<Input> {
        let Bounds { min_center, max_center, max_radius, .. } = self.bounds;
        let middle = 0.5 * (min_center + max_center);
        let origin = self.stage.view.camera.origin;
        let depth =
            (middle - origin).length() + (max_center - middle).x * random.between(-1.0, 1.0);
        let radius = max_radius * random.power(-2.0, 0.0);
        // Half of them near the silhouette: half chords of 1/160 to 1/3 of the radius.
        let chord = random.power(-2.2, -0.5);
        let near = if random.bits() & 1 == 0 {
            (1.0 - chord * chord).sqrt()
        } else {
            random.between(apart[0], apart[1])
        };
        let apart = radius * near;
        let input = self.stage.near_ray(random, [depth, radius, apart]);
        self.inside(input).then_some(input)
    }

    fn inside(&self, input: Input) -> bool {
        input.center.cmpge(self.bounds.min_center).all()
            && input.center.cmple(self.bounds.max_center).all()
            && input.radius <= self.bounds.max_radius
    }

    /// Runs the shader's functions for a sphere and a pixel.
    fn look(&mut self, input: Input) -> Option<Found> {
        let (left, top) = (input.column / TILE * TILE, input.row / TILE * TILE);
        let nearest = self.stage.exact(input).z.value() - 1.000001 * input.radius;
        let (class, place) = self.eye.place(left, top, nearest, true);
        if class == Class::Host
            || (self.stage.perspective && class == Class::Clipped && !self.clipped)
        {
            return None;
        }
        let offset = place.tile.z;
        let record = self.fixed.record(input.center, input.radius);
        let machine = &mut self.machine;
        machine.bind(0, bytemuck::bytes_of(&self.eye.frame));
        machine.bind(3, bytemuck::bytes_of(&place.tile));
        machine.bind(FANS, bytemuck::bytes_of(&place.fan));
        machine.bind(PLANES, bytemuck::bytes_of(&place.planes));
        let at = || Value::U32(std::iter::once(0).collect());
        let tile = machine.call("tile_at", vec![at()]);
        let frame = machine.read(0)[0].clone();
        let bounds = machine.call("bounds_of", vec![frame.clone()]);
        let eye = machine.call("eye_of", vec![frame, bounds, tile, at(), at()]);
        let record = Value::I32(record.into_iter().collect());
        let perspective = self.stage.perspective;
        let (place, lift) = if perspective {
            let center = Value::I32(
                self.fixed.record(input.center, input.radius)[..3].iter().copied().collect(),
            );
            let lift = machine.field(&eye, "Eye", "lift").float(0);
            (machine.call("place_of", vec![eye.clone(), center]).float(0), lift)
        } else {
            (f32::NAN, 0.0)
        };
        let item = machine.call("prepare", vec![eye.clone(), record]);
        let column = Value::U32(std::iter::once(input.column - left).collect());
        let pixels = machine.call("pixels_of", vec![eye, column]);
        let row = (input.row - top) as usize;
        // The lower rows mirror the upper ones.
        let (half, lane) = if row < 4 { ("top", row) } else { ("bottom", 7 - row) };
        let ranges = machine.call("ranges_of", vec![at(), pixels.clone()]);
        let range = machine.field(&ranges, "Ranges", half);
        let rays = machine.field(&pixels, "Pixels", half);
        let chords = machine.call("chords", vec![item.clone(), pixels]);
        let chord = machine.field(&chords, "Chords", half);
        let key =
            machine.call("lower", vec![range.clone(), item.clone(), chord.clone()]).uint(lane);
        let safe = if perspective {
            machine.call("safe", vec![range, item.clone(), chord.clone()]).holds(lane)
        } else {
            machine.field(&item, "Item", "guard").float(0) > f32::from_bits(key)
        };
        let low = (key <= i32::MAX as u32).then(|| f64::from(f32::from_bits(key)));
        let front = machine.field(&item, "Item", "front");
        let [along, error] = ["along_rays", "plane_error"]
            .map(|name| machine.call(name, vec![rays.clone(), front.clone()]).float(lane));
        let plane = [front.float(0), along, error].map(f64::from);
        let low_depth = machine
            .call("depths", vec![rays, Value::floats(&[f32::from_bits(key); 4])])
            .float(lane)
            .into();
        let place =
            if perspective { place } else { machine.field(&item, "Item", "shape").float(0) }.into();
        let View { image, pitch_x, pitch_y, .. } = self.stage.view;
        let middle = [
            (2 * left as i32 + TILE as i32 - image.width as i32, pitch_x),
            (image.height as i32 - 2 * top as i32 - TILE as i32, pitch_y),
        ]
        .map(|(odd, pitch)| {
            Bounded::ratio(odd.into(), pitch.length, 2.0 * f64::from(pitch.divisor))
        });
        let base = self.middle - exact(offset.into());
        Some(Found {
            item,
            chord,
            lane,
            place,
            low,
            low_depth,
            plane,
            lift: lift.into(),
            safe,
            base,
            middle,
        })
    }
}

/// A search over views, data, devices and spheres for the largest of some ratios; each must lie
/// between 1/8 and 1.
fn measure<const N: usize>(
    names: [&str; N],
    projection: Projection,
    seed: u64,
    scale: Scale,
    apart: [f64; 2],
    ratios: impl Fn(&Probe, &Found, &Exact) -> [Option<f64>; N],
) {
    let clipped = scale.clipped;
    let variant = Variant {
        projection,
        clipped,
        merged: false,
        certain: true,
        lanes: Lanes::Alone,
        few: false,
    };
    let module = module(variant);
    let mut random = Random::new(seed);
    let mut worst = [0.0f64; N];
    let mut measured = [0; N];
    let far = scale.distance[0] > 3.0 && projection == Projection::Perspective;
    let stages = match projection {
        Projection::Perspective if far => telescopes(&mut random, [-8.0, -6.0]),
        // So narrow that a place is not known to much less than a pixel: else that is nothing to
        // what roundings are at the size of a tile.
        Projection::Perspective if scale.of_delta => telescopes(&mut random, [-13.0, -11.5]),
        _ => stages(&mut random, projection),
    };
    for stage in stages {
        for device in 0..40 {
            let Some(mut probe) =
                Probe::new(&stage, &mut random, scale, &module, seed * 1000 + device)
            else {
                continue;
            };
            let mut best: [Option<(f64, Input)>; N] = [None; N];
            for round in 0..120 {
                let next = match best[round % N] {
                    Some((_, input)) if round > 40 => neighbour(&mut random, &stage, input),
                    _ => match probe.input(&mut random, apart) {
                        Some(input) => input,
                        None => continue,
                    },
                };
                if !probe.inside(next) {
                    continue;
                }
                let Some(found) = probe.look(next) else { continue };
                let e = stage.exact(next);
                for (k, ratio) in ratios(&probe, &found, &e).into_iter().enumerate() {
                    let Some(ratio) = ratio else { continue };
                    assert!(
                        ratio <= 1.0,
                        "{} is {ratio} of its bound: {projection:?}, seed {seed}, device \
                         {device}, {next:?}, {:?}\n{:?}",
                        names[k],
                        stage.view,
                        probe.eye.frame
                    );
                    measured[k] += 1;
                    if best[k].is_none_or(|(most, _)| ratio > most) {
                        best[k] = Some((ratio, next));
                        worst[k] = worst[k].max(ratio);
                    }
                }
            }
        }
    }
    for k in 0..N {
        println!(
            "{}, {projection:?}: {:.3} of the bound, {} inputs",
            names[k], worst[k], measured[k]
        );
    }
    for k in 0..N {
        assert!(
            measured[k] > 200 && worst[k] > LEAST,
            "{}, {projection:?}: {} of the bound: too loose",
            names[k],
            worst[k]
        );
    }
}

/// Perspective cameras that see far.
fn telescopes(random: &mut Random, [least, most]: [f64; 2]) -> Vec<Stage> {
    let stage = |_| {
        let mut camera = Camera::orthographic(random.ball(), random.ball());
        camera.projection = Projection::Perspective;
        camera.size = ScreenSize::Height(random.power(least, most));
        Stage::new(camera, ImageSize { width: 97, height: 61 })
    };
    (0..12).map(stage).collect()
}

const BOTH: [Projection; 2] = [Projection::Orthographic, Projection::Perspective];

/// A field of an item or a chord.
fn number(probe: &Probe, of: &Value, kind: &str, name: &str, lane: usize) -> f64 {
    probe.machine.field(of, kind, name).float(lane).into()
}

/// The square against the exact one, over `E`: where there is a hit, and where there seems to be
/// one.
fn square(probe: &Probe, found: &Found, e: &Exact) -> Option<f64> {
    let per_step = exact(1.0 / probe.step);
    let square = number(probe, &found.chord, "Chord", "square", found.lane);
    let bound = number(probe, &found.item, "Item", "bounds", 1);
    let claimed = e.q.value() >= 0.0 || square >= bound;
    claimed.then(|| error(square - bound, e.q * per_step * per_step).abs() / bound)
}

#[test]
fn squares() {
    for projection in BOTH {
        // Spheres of some steps, where the place counts; of about a tile, and of very many, where
        // roundings do.
        let sizes = [
            ("square of small spheres", [-7.0, -4.0]),
            ("square of spheres of pixels", [-2.5, -1.0]),
            ("square of large spheres", [-1.0, 3.0]),
        ];
        for (name, radius) in sizes {
            let scale = Scale { radius, clipped: true, ..Scale::USUAL };
            measure([name], projection, 21, scale, [0.0, 1.04], |p, f, e| [square(p, f, e)]);
        }
        let scale = Scale {
            data: [1.0, 2.5],
            radius: [-0.5, 1.5],
            of_delta: true,
            clipped: true,
            ..Scale::USUAL
        };
        measure(["square of vague spheres"], projection, 22, scale, [0.0, 1.0], |p, f, e| {
            [square(p, f, e)]
        });
    }
}

/// Where a centre is put, over `delta`: near, where integers round, and far away, where the f64 of
/// the host does.
#[test]
fn places() {
    for projection in BOTH {
        let away = [("place near by", [0.3, 1.0]), ("place far away", [7.0, 9.0])];
        for (name, distance) in away {
            let scale = Scale { distance, ..Scale::USUAL };
            measure([name], projection, 23, scale, [0.0, 1.0], |p, f, e| {
                let per_step = exact(1.0 / p.step);
                let truth =
                    if p.stage.perspective { e.z * f.middle[0] - e.x } else { e.x - f.middle[0] }
                        * per_step;
                // The conversion to f32 is not part of it.
                let off = error(f.place, truth).abs() - f.place.abs() * f64::from(f32::EPSILON);
                [Some(off / f64::from(p.eye.frame.delta))]
            });
        }
    }
}

/// Depths: the slack, the doubt of what is safe, and where a sphere begins.
#[test]
fn depths() {
    for projection in BOTH {
        for (size, radius) in [("small", [-6.0, -3.0]), ("large", [-1.0, 3.0])] {
            let scale = Scale { radius, ..Scale::USUAL };
            let names = ["slack", "doubt", "front"].map(|name| format!("{name} of {size} spheres"));
            let names = [&names[0], &names[1], &names[2]].map(String::as_str);
            measure(names, projection, 24, scale, [0.0, 1.0], |p, f, e| {
                let per_step = exact(1.0 / p.step);
                let slack = number(p, &f.item, "Item", "bounds", 0);
                let doubt = number(p, &f.item, "Item", "doubt", 0);
                let front = number(p, &f.item, "Item", "front", 0);
                let square = number(p, &f.chord, "Chord", "square", f.lane);
                let near = number(p, &f.chord, "Chord", "near", f.lane);
                assert!(square < 0.0 || near > 0.0, "a key that is not above 0: {near}");
                let (Some(low), true) = (f.low, square > 0.0) else { return [None; 3] };
                // As keys have them: perspective depths times a, less what is the same for all
                // spheres at a pixel.
                let perspective = p.stage.perspective;
                let common = if perspective { common(f, e) } else { f.base };
                let depth = |root: Bounded| (e.b - root) * per_step - common;
                // Clamped at the eye's plane of depths.
                let clamped = !perspective && low < 1e-30;
                let off = (exact(low) - depth(exact(p.step) * exact(square).sqrt())).value().abs();
                let above = (depth(e.q.sqrt()) - exact(low)).value();
                assert!(
                    !f.safe || clamped || above >= -slack,
                    "a lower bound above the depth by {}",
                    -above - slack
                );
                let below = ((exact(low) + common) - (exact(f.low_depth) + f.base) * e.a).value();
                assert!(
                    clamped || below <= 20.0 * f64::from(f32::EPSILON) * f.lift,
                    "a key's depth {below} too small"
                );
                let begins = (e.z - e.r) * per_step - f.base;
                // A depth; perspective slack is of keys.
                let rounding =
                    2.0 * f64::from(f32::EPSILON) * (front.abs() + 2.0 * e.r.value() / p.step);
                let start =
                    if perspective { f64::from(p.eye.frame.delta_depth) + rounding } else { slack };
                [
                    (!clamped).then_some(off / slack),
                    (f.safe && !clamped).then_some((above + slack) / doubt),
                    Some((begins - exact(front)).value().abs() / start),
                ]
            });
        }
    }
}

/// What perspective keys are less than depths from the camera times `a`, at a pixel.
fn common(found: &Found, e: &Exact) -> Bounded {
    found.base * (exact(1.0) + found.middle[0] * e.sx + found.middle[1] * e.sy) - exact(found.lift)
}

/// Where clip planes lie along perspective rays.
#[test]
fn planes() {
    measure(["plane"], Projection::Perspective, 25, Scale::USUAL, [0.0, 1.0], |_, f, e| {
        let [depth, along, bound] = f.plane;
        [Some(error(along, (exact(depth) + f.base) * e.a - common(f, e)).abs() / bound)]
    });
}
