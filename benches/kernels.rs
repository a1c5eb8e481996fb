//! Micro-benchmarks of the hot loops: `cargo bench`. Whole pictures and processes are `planisphere
//! bench`.

use divan::{Bencher, counter::ItemsCount};
use planisphere_bench::scenes::{Kind, Made, Recipe};
use planisphere_core::{
    bins::{Binner, Entry, KeepAll, Workspace, split},
    camera::{Camera, ImageSize, Projection, Region, ScreenSize, View},
    cpu::Cpu,
    exact::decide::{Tally, Truth},
    ids::SphereIndex,
    project::{BATCH, Batch, Projector},
    scene::{Ball, Block, Scene},
    simd,
};
use planisphere_image::Paint;
use planisphere_io::png::write_png;

fn main() {
    divan::main();
}

const IMAGE: ImageSize = ImageSize { width: 256, height: 256 };

fn made(kind: Kind, count: usize, projection: Projection) -> (Made, View) {
    let made = Recipe { projection, ..Recipe::new(kind, count) }.make(IMAGE);
    let view = View::new(made.camera, IMAGE);
    (made, view)
}

const PROJECTIONS: [Projection; 2] = [Projection::Orthographic, Projection::Perspective];

/// One batch, compiled as the device's loops are.
struct Project<'a> {
    projector: &'a Projector,
    block: &'a Block,
    batch: &'a mut Batch,
}

impl simd::Work for Project<'_> {
    type Output = i32;

    #[inline(always)]
    fn run<L: simd::Lanes>(self) -> i32 {
        self.projector.project_batch(self.block, 0, self.batch);
        self.projector.footprints(self.batch);
        self.batch.left[0]
    }
}

/// Spheres into view space with their boxes of pixels; per sphere.
#[divan::bench(args = PROJECTIONS)]
fn project(bencher: Bencher, projection: Projection) {
    let (made, view) = made(Kind::Uniform, BATCH, projection);
    let projector = Projector::new(&Truth::new(&view, made.scene.bounds()), Region::whole(IMAGE));
    let (_, block) = made.scene.blocks().next().expect("one block");
    let mut batch = Batch::default();
    bencher.counter(ItemsCount::new(BATCH)).bench_local(|| {
        let block = divan::black_box(block);
        simd::dispatch(Project { projector: &projector, block, batch: &mut batch })
    });
}

/// Tile lists; per sphere.
#[divan::bench(args = [10_000, 100_000])]
fn lists(bencher: Bencher, count: usize) {
    let (made, view) = made(Kind::Uniform, count, Projection::Orthographic);
    let truth = Truth::new(&view, made.scene.bounds());
    let binner = Binner::new(&made.scene, &truth, Region::whole(IMAGE), 5);
    let mut workspace = Workspace::<Entry>::default();
    bencher.counter(ItemsCount::new(count)).bench_local(|| {
        binner.lists(&mut split(0..count), &KeepAll, usize::MAX, &mut workspace).entries.len()
    });
}

/// A whole picture on the CPU; per test of a sphere at a pixel.
#[divan::bench(args = [
    Kind::Uniform, Kind::Lattice, Kind::Twice, Kind::Coincident, Kind::HotPixel,
])]
fn picture(bencher: Bencher, kind: Kind) {
    let (made, view) = made(kind, 10_000, Projection::Orthographic);
    let mut cpu = Cpu::default();
    let draw = |cpu: &mut Cpu| {
        cpu.draw(&made.scene, &view, Region::whole(IMAGE)).expect("memory suffices")
    };
    let tests = draw(&mut cpu).counts.tests;
    bencher.counter(ItemsCount::new(tests)).bench_local(|| draw(&mut cpu).ids.len());
}

/// Which arithmetic has to decide.
#[derive(Clone, Copy, Debug)]
enum Hardness {
    /// Told by 100 bits.
    Clear,
    /// Two spheres that touch where the ray meets them: 128-bit integers.
    TieAlongAnAxis,
    /// The same with axes of no pattern: integers of any size.
    TieAskew,
}

/// One decision between two spheres.
#[divan::bench(args = [Hardness::Clear, Hardness::TieAlongAnAxis, Hardness::TieAskew])]
fn decide(bencher: Bencher, hardness: Hardness) {
    let direction = match hardness {
        Hardness::TieAskew => glam::DVec3::new(1.0, -0.5, 0.25),
        _ => glam::DVec3::X,
    };
    let mut camera = Camera::orthographic(-64.0 * direction, direction);
    camera.size = ScreenSize::Width(8.0);
    let view = View::new(camera, ImageSize { width: 9, height: 9 });
    // Mirror images in the plane of the middle column (or row): equal depths there.
    let side = direction.cross(glam::DVec3::Z);
    let aside = if matches!(hardness, Hardness::Clear) { 0.75 } else { 1.0 };
    let balls = [side, -aside * side].map(|center| Ball { center, radius: 2.0 });
    let bounds = Scene::from_spheres(&[]).expect("an empty scene").bounds();
    let truth = Truth::new(&view, bounds);
    bencher.bench_local(|| {
        let spheres = (0..).map(SphereIndex).zip(divan::black_box(balls));
        truth.pixel(4, 4).nearest(spheres, &mut Tally::default())
    });
}

/// Ids to a PNG; per pixel.
#[divan::bench]
fn png(bencher: Bencher) {
    let (made, view) = made(Kind::Uniform, 1_000, Projection::Orthographic);
    let region = Region::whole(IMAGE);
    let ids = Cpu::default().draw(&made.scene, &view, region).expect("memory suffices").ids;
    let paint = Paint { scene: &made.scene, background: [0; 3] };
    bencher.counter(ItemsCount::new(ids.len())).bench_local(|| {
        let mut bytes = Vec::new();
        write_png(&mut bytes, region, &ids, &paint).expect("memory takes any bytes");
        bytes.len()
    });
}
