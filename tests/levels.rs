//! Headlight levels, cue levels and differences of distances, on rasters with several samples a
//! pixel and beyond the border: what the core decides is what the judge does, on every scene of the
//! corpus, on random ones and on extreme ones. There is no tolerance.

mod corpus;
mod judge;

use std::{
    cmp::Ordering,
    sync::atomic::{AtomicU64, Ordering as Order},
};

use corpus::{Case, random::Random};
use judge::{Hit, Judge, levels::Place};
use planisphere_core::{
    camera::View,
    exact::decide::{Hit as CoreHit, Pixel, Tally, Truth},
    scene::Ball,
};
use rayon::prelude::*;

/// Samples beyond the border.
const MARGIN: u32 = 2;
/// Samples of a scene that are looked at, with their neighbours.
const SAMPLES: usize = 8;

/// What was compared.
#[derive(Default)]
struct Count {
    lights: AtomicU64,
    cues: AtomicU64,
    gaps: AtomicU64,
    zeros: AtomicU64,
}

/// A case with the lengths that its distances are compared with.
struct Trial<'a> {
    case: &'a Case,
    judge: Judge,
    truth: Truth,
    raster: View,
    cues: Vec<[f64; 2]>,
    jumps: Vec<f64>,
    count: &'a Count,
}

impl<'a> Trial<'a> {
    fn new(case: &'a Case, random: &mut Random, count: &'a Count) -> Self {
        let lengths = corpus::lengths(case, random);
        let pick = |random: &mut Random| lengths[random.below(lengths.len() as u64) as usize];
        let cues = (0..4)
            .map(|_| [pick(random), pick(random)])
            .filter(|[a, b]| a != b)
            .map(|[a, b]| [a.min(b), a.max(b)])
            .collect();
        let jumps = vec![0.0, pick(random), pick(random)];
        let aa = [1, 2, 4, 8][random.below(4) as usize];
        let raster = View::sampled(case.view.camera, case.view.image, aa, MARGIN);
        let judge = Judge::with_lengths(&case.scene, &raster, &lengths).until_the_last_bit();
        let truth = Truth::new(&raster, case.scene.bounds());
        Self { case, judge, truth, raster, cues, jumps, count }
    }

    fn ball(&self, hit: Hit) -> Ball {
        Ball::from(self.case.scene.sphere(hit.sphere()).expect("it is there"))
    }

    fn core(&self, place: Place, hit: Hit) -> (Pixel<'_>, CoreHit) {
        let pixel = self.truth.pixel(place.0, place.1);
        let core = pixel.hit(self.ball(hit), &mut Tally::default());
        (pixel, core.expect("the judge sees it"))
    }

    /// Compares the levels at a sample.
    fn levels(&self, place: Place, hit: Hit) {
        let (pixel, core) = self.core(place, hit);
        let what = || format!("{}, {:?}, sample {place:?}, {hit:?}", self.case.name, self.raster);
        let want = self.judge.light(place, hit);
        let got = pixel.headlight(self.ball(hit), &mut Tally::default());
        assert_eq!(u32::from(got), want, "headlight: {}", what());
        self.count.lights.fetch_add(1, Order::Relaxed);
        for &planes in &self.cues {
            let want = self.judge.cue(place, hit, planes);
            let got = pixel.cue(&core, planes, &mut Tally::default());
            assert_eq!(u32::from(got), want, "cue {planes:?}: {}", what());
            self.count.cues.fetch_add(1, Order::Relaxed);
        }
    }

    /// Compares the differences of distances at two samples.
    fn gaps(&self, one: (Place, Hit), two: (Place, Hit)) {
        let ((a, core_a), (b, core_b)) = (self.core(one.0, one.1), self.core(two.0, two.1));
        let radius = self.ball(one.1).radius;
        for length in self.jumps.iter().copied().chain([radius]) {
            let want = self.judge.gap(one, two, length);
            let got = a.farther(&core_a, (&b, &core_b), length, &mut Tally::default());
            assert_eq!(
                got.cmp(&0),
                want,
                "gap {length:e}: {}, {:?}, {one:?}, {two:?}",
                self.case.name,
                self.raster
            );
            self.count.gaps.fetch_add(1, Order::Relaxed);
            self.count.zeros.fetch_add(u64::from(want == Ordering::Equal), Order::Relaxed);
        }
    }

    /// Looks at some samples, and at those right of them and below.
    fn run(&self, random: &mut Random) {
        let [width, height] = [self.raster.image.width, self.raster.image.height].map(u64::from);
        for _ in 0..SAMPLES {
            let place = (random.below(width) as u32, random.below(height) as u32);
            let Some(hit) = self.judge.seen_at(place) else { continue };
            self.levels(place, hit);
            for there in [(place.0 + 1, place.1), (place.0, place.1 + 1)] {
                if u64::from(there.0) >= width || u64::from(there.1) >= height {
                    continue;
                }
                if let Some(other) = self.judge.seen_at(there) {
                    self.gaps((place, hit), (there, other));
                    self.gaps((there, other), (place, hit));
                }
            }
        }
    }
}

/// Compares a few samples of each case.
fn over(cases: &[Case]) {
    let count = Count::default();
    cases.par_iter().enumerate().for_each(|(k, case)| {
        if !case.scene.is_empty() {
            let mut random = Random::new(k as u64);
            Trial::new(case, &mut random, &count).run(&mut random);
        }
    });
    let [lights, cues, gaps, zeros] = [&count.lights, &count.cues, &count.gaps, &count.zeros]
        .map(|count| count.load(Order::Relaxed));
    println!("{lights} headlight levels, {cues} cue levels, {gaps} gaps, {zeros} of them 0");
    assert!(lights > 200 && cues > 200 && gaps > 200, "too few");
}

#[test]
fn levels_of_the_corpus_are_the_judges() {
    over(&corpus::corpus());
}

#[test]
fn levels_of_random_scenes_are_the_judges() {
    over(&corpus::seeds(0..600).map(corpus::fuzz::fuzz).collect::<Vec<_>>());
}

#[test]
fn levels_of_extreme_scenes_are_the_judges() {
    over(&corpus::seeds(0..400).map(corpus::extreme::extreme).collect::<Vec<_>>());
}
