//! The GPU's filter against the worst device that WGSL allows.
//!
//! The shaders run on the host (`emulator`), where every sum, difference and product is rounded up or down, fused or not, taken in
//! another order, every quotient and root is off by all that it may be, and subnormal numbers vanish or not. What the filter
//! settles there must be the judge's answer all the same.
//!
//! The bounds in the shaders are measured too: the largest error found over its bound must be above 1/8 and at most 1, so that a
//! constant in the WGSL that is eight times too large or too small fails here. Nothing of the WGSL is repeated in this file but
//! what each number means.

mod corpus;
mod emulator;
mod judge;

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
    Machine,
    float::{Habits, Rounding, Unfriendly},
};
use glam::DVec3;
use judge::Judge;
use planisphere::{
    bins::KeepAll,
    camera::{Camera, ImageSize, Projection, Region, ScreenSize, View},
    exact::decide::Truth,
    gpu::{Gpu, lists::Wave},
    plan::{self, Band, Eye, FRESH, Fixed, LAST, Limits, NONE, Segment, TILE, TILE_PIXELS, UNDECIDED},
    render::DeviceChoice,
    scene::{Scene, Sphere},
    shader::{FANS, Lanes, PLANES, STATES, Variant},
};
use rayon::prelude::*;

/// The shader of a variant, parsed.
fn module(variant: Variant) -> Arc<naga::Module> {
    Arc::new(variant.source().validate().unwrap_or_else(|message| panic!("{message}")).0)
}

/// What the filter settles on a device of such habits; [`UNDECIDED`] elsewhere. None where the host decides all.
fn emulated(scene: &Scene, view: &View, habits: Habits, seed: u64, limits: Limits) -> Option<Vec<i32>> {
    let region = Region::whole(view.image);
    let fixed = Fixed::new(&scene.bounds())?;
    let eye = Eye::new(&fixed, &scene.bounds(), view)?;
    let truth = Truth::new(view, scene.bounds());
    let mut wave = Wave::default();
    let mut all = [Range { start: 0, end: scene.len() }];
    wave.collect(scene, &truth, region, &mut all, usize::MAX, &KeepAll);
    assert!(all[0].is_empty());
    let mut band = Band::new(region);
    let (passes, single) = band.passes(&wave.lists(), &eye, limits);
    let records: Vec<[i32; 4]> =
        (0..scene.len()).map(|k| scene.sphere(k)).map(|s| fixed.record(s.center, s.radius)).collect();
    let disorder = eye.steps(wave.lists().disorder);

    let mut ids = vec![NONE; region.pixels()];
    let mut states = Vec::new();
    let mut modules = HashMap::new();
    let mut dispatch = |clipped: bool, disorder: f32, entries: &[u32], segments: &[Segment], tiles: &[plan::Tile]| {
        let projection = eye.projection();
        let variant = Variant { projection, clipped, merged: !single, certain: true, lanes: Lanes::Alone };
        let module = modules.entry(variant).or_insert_with(|| module(variant)).clone();
        let mut machine = Machine::new(module, Unfriendly::new(habits, seed));
        let places: Vec<_> = segments.iter().map(|segment| band.place(segment.tile)).collect();
        let groups = (tiles.len() as u32).div_ceil(TILE);
        let frame = plan::Frame { first: 0, tiles: tiles.len() as u32, row: groups, disorder, ..eye.frame };
        machine.bind(0, bytemuck::bytes_of(&frame));
        machine.bind(1, bytemuck::cast_slice(&records));
        machine.bind(2, bytemuck::cast_slice(entries));
        machine.bind(3, bytemuck::cast_slice(tiles));
        machine.bind(4, &vec![0; 4 * TILE_PIXELS * tiles.len().max(band.tiles())]);
        machine.bind(FANS, bytemuck::cast_slice(&places.iter().map(|p| p.fan).collect::<Vec<_>>()));
        machine.bind(PLANES, bytemuck::cast_slice(&places.iter().map(|p| p.planes).collect::<Vec<_>>()));
        if !single {
            if states.is_empty() {
                machine.bind(STATES, &vec![0; size_of::<plan::State>() * TILE_PIXELS * band.tiles()]);
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
                let at = (tile.slot & !(FRESH | LAST)) as usize * TILE_PIXELS;
                let pixels: Vec<i32> = machine.read(4)[at..at + TILE_PIXELS].iter().map(|v| v.int()).collect();
                fill(&mut ids, region, band.columns, segment.tile, &pixels);
            }
        }
    };
    let table = |segments: &[Segment], slot: &dyn Fn(usize, &Segment) -> u32| -> Vec<plan::Tile> {
        let made = |(k, s): (usize, &Segment)| plan::Tile {
            start: s.start,
            count: s.count,
            slot: slot(k, s),
            ..band.place(s.tile).tile
        };
        segments.iter().enumerate().map(made).collect()
    };
    for pass in &passes {
        let slot = |k: usize, s: &Segment| match single {
            true => k as u32 | FRESH | LAST,
            false => s.tile | if s.fresh { FRESH } else { 0 },
        };
        let tiles = table(&pass.segments, &slot);
        dispatch(pass.clipped, disorder, &wave.entries[pass.window.clone()], &pass.segments, &tiles);
    }
    if !single {
        let met: Vec<Segment> =
            band.met().into_iter().map(|tile| Segment { tile, start: 0, count: 0, fresh: false }).collect();
        dispatch(false, plan::NEVER, &[], &met, &table(&met, &|_, s| s.tile | LAST));
    }
    for &tile in &band.host {
        fill(&mut ids, region, band.columns, tile, &[UNDECIDED; TILE_PIXELS]);
    }
    Some(ids)
}

/// The pixels of a tile into their places.
fn fill(ids: &mut [i32], region: Region, columns: u32, tile: u32, pixels: &[i32]) {
    let (x, y) = (tile % columns * TILE, tile / columns * TILE);
    for row in 0..TILE.min(region.height - y) {
        for column in 0..TILE.min(region.width - x) {
            ids[((y + row) * region.width + x + column) as usize] = pixels[(row * TILE + column) as usize];
        }
    }
}

const ALL: Limits = Limits { wave: usize::MAX, entries: usize::MAX, tiles: usize::MAX, round: 60_000 };
/// So small that tiles take several passes.
const SMALL: Limits = Limits { round: 5, ..ALL };

/// On a friendly device the emulator gives what the software device gives, undecided pixels included: so it is the shaders
/// that it runs.
#[test]
fn the_emulator_is_the_device() {
    let mut gpu = Gpu::open(&DeviceChoice::Gpu).unwrap_or_else(|error| panic!("{error}"));
    assert!(gpu.set_lanes(Lanes::Alone));
    let mut compared = 0;
    for case in corpus::corpus().into_iter().step_by(9) {
        let region = Region::whole(case.view.image);
        if case.scene.len() * region.pixels() > 1 << 17 {
            continue;
        }
        let Some(got) = emulated(&case.scene, &case.view, Habits::FRIENDLY, 0, ALL) else { continue };
        let want = gpu.draw_filter(&case.scene, &case.view, region).unwrap_or_else(|error| panic!("{error}")).ids;
        assert!(got == want, "{}: {} pixels differ", case.name, got.iter().zip(&want).filter(|(a, b)| a != b).count());
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
        assert_eq!(got, want, "{}: column {column}, row {row}, device {seed}: {habits:?}", case.name);
    }
}

#[test]
fn settled_pixels_are_the_judges() {
    let (settled, undecided) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let light = |case: &Case| case.scene.len() * case.view.image.pixels() <= 1 << 15;
    let cases: Vec<Case> = corpus::corpus().into_iter().chain((0..200).map(corpus::fuzz::fuzz)).filter(light).collect();
    // Another device for each.
    cases.par_iter().enumerate().for_each(|(k, case)| {
        let limits = if k % 3 == 0 { SMALL } else { ALL };
        check(case, 1000 + k as u64, limits, &settled, &undecided);
    });
    let (settled, undecided) = (settled.into_inner(), undecided.into_inner());
    println!("{} scenes: {settled} pixels settled, all right; {undecided} left to the host", cases.len());
    assert!(settled > undecided, "{settled} of {undecided}");
}
