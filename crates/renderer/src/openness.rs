//! How open each sphere is to the space around: from 64 directions, the part of its disc that is
//! seen. The rules are those of docs/contract.md, "Openness".
//!
//! It follows from exact pictures of ids and is the same on every device, from every camera; so it
//! is kept with the scene.

use std::sync::{
    Arc, Mutex, PoisonError,
    atomic::{AtomicU32, Ordering},
};

use glam::DVec3;
use rayon::prelude::*;

use planisphere_core::{
    camera::{Camera, ImageSize, Projection, Region, ScreenSize, View},
    cpu::Piece,
    drawing::Control,
    scene,
};

use crate::{
    Error, Scene,
    engine::{Engine, device_error},
};

/// Where it is looked from, times 1024: points of a spiral on the sphere.
#[rustfmt::skip]
const DIRECTIONS: [[i16; 3]; 64] = [
    [180, 0, 1008], [-228, 209, 976], [35, -395, 944], [283, 370, 912], [-516, -91, 880],
    [484, -308, 848], [-161, 597, 816], [-304, -585, 784], [653, 238, 752], [-673, 278, 720],
    [321, -687, 688], [235, 750, 656], [-702, -407, 624], [816, -179, 592], [-493, 701, 560],
    [-113, -870, 528], [685, 577, 496], [-912, 38, 464], [658, -655, 432], [-44, 942, 400],
    [-612, -734, 368], [959, 129, 336], [-803, 558, 304], [217, -963, 272], [495, 864, 240],
    [-955, -305, 208], [916, -423, 176], [-391, 935, 144], [-344, -958, 112], [904, 475, 80],
    [-989, 261, 48], [554, -861, 16], [173, 1009, -16], [-809, -626, -48], [1017, -84, -80],
    [-691, 747, -112], [5, -1014, -144], [678, 747, -176], [-998, -93, -208], [793, -602, -240],
    [-177, 971, -272], [-521, -828, -304], [933, 256, -336], [-850, 436, -368], [328, -884, -400],
    [350, 860, -432], [-825, -391, -464], [856, -264, -496], [-444, 757, -528], [-180, -838, -560],
    [681, 484, -592], [-806, 100, -624], [510, -599, -656], [28, 758, -688], [-511, -519, -720],
    [694, 35, -752], [-508, 420, -784], [85, -613, -816], [326, 473, -848], [-510, -117, -880],
    [405, -230, -912], [-122, 377, -944], [-129, -282, -976], [166, 70, -1008],
];

/// Sides of the pictures, pixels: the first at which a usual sphere has a radius of a pixel.
const SIDES: [u32; 3] = [256, 512, 1024];
/// Spheres with fewer pixels than this, from all directions, are taken for more alike.
const FEW: u64 = 32 * PARTS;
/// Pixels are counted in so many parts.
const PARTS: u64 = 256;

/// What was found of a scene.
#[derive(Default)]
struct Kept(Mutex<Option<Arc<[u8]>>>);

/// How open each sphere of a scene is, of 255; found once, and kept.
pub(crate) fn openness(
    engine: &mut Engine,
    scene: &Scene,
    control: &Control,
) -> Result<Arc<[u8]>, Error> {
    let kept = scene.core().kept::<Kept>();
    // Not held while it is found, as rayon works then: two may find the same.
    let known = || kept.0.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(known) = known().clone() {
        return Ok(known);
    }
    let found = found(engine, scene, control)?;
    Ok(Arc::clone(known().get_or_insert(found)))
}

fn found(engine: &mut Engine, scene: &Scene, control: &Control) -> Result<Arc<[u8]>, Error> {
    let core = scene.core();
    if core.is_empty() {
        return Ok(Arc::new([]));
    }
    let around = Around::new(core);
    let mut seen = Vec::new();
    seen.resize_with(core.len(), AtomicU32::default);
    for (k, direction) in DIRECTIONS.iter().enumerate() {
        let share = [k, k + 1].map(|k| k as f32 / DIRECTIONS.len() as f32);
        engine.controlled_by(&control.part(share));
        scene.check()?;
        let (view, piece) = (around.view(*direction), Piece { bands: 64, first: k == 0 });
        let whole = Region::whole(view.image);
        let drawn = engine.draw_piece(core, &view, whole, Some(piece));
        let drawing = drawn.map_err(|error| device_error(engine, error))?;
        scene.check()?;
        drawing.ids.par_chunks(1 << 14).for_each(|ids| {
            for alike in ids.chunk_by(|a, b| a == b) {
                if let Ok(index) = usize::try_from(alike[0]) {
                    seen[index].fetch_add(alike.len() as u32, Ordering::Relaxed);
                }
            }
        });
        engine.lend(drawing.ids);
    }
    let parts = seen.par_iter().enumerate().map(|(index, seen)| {
        let seen = u64::from(seen.load(Ordering::Relaxed)) * PARTS;
        part(seen, around.area(core.known(index).radius))
    });
    Ok(levels(parts.collect()))
}

/// Of 1024, the part that shows `seen` of `area` pixels, both in parts; 0 where nothing is seen.
fn part(seen: u64, area: u64) -> u32 {
    let lacking = FEW.saturating_sub(area);
    let part = 1024 * (seen + lacking / 2) / (area + lacking).max(1);
    if seen == 0 { 0 } else { part.clamp(1, 1024) as u32 }
}

/// How open spheres are that show these parts: against one that is more open than nine tenths of
/// all that show any.
fn levels(parts: Vec<u32>) -> Arc<[u8]> {
    let mut counts = [0usize; 1025];
    parts.iter().for_each(|part| counts[*part as usize] += 1);
    let shown: usize = counts[1..].iter().sum();
    let mut left = 9 * shown / 10;
    let open = counts[1..].iter().position(|&count| {
        let found = left < count;
        left = left.saturating_sub(count);
        found
    });
    let open = open.map_or(1024, |below| below as u32 + 1);
    let level = |part: &u32| (255 * 255 * (*part).min(open) / open).isqrt() as u8;
    parts.par_iter().map(level).collect::<Vec<u8>>().into()
}

/// What the pictures have in common.
struct Around {
    middle: DVec3,
    /// Half a side of a picture, world units.
    reach: f64,
    side: u32,
}

impl Around {
    fn new(scene: &scene::Scene) -> Self {
        let bounds = scene.bounds();
        let middle = 0.5 * bounds.min_center + 0.5 * bounds.max_center;
        let half = 0.5 * bounds.max_center - 0.5 * bounds.min_center;
        let reach = half.length() + bounds.max_radius;
        let sum: f64 = (0..scene.len()).map(|index| scene.known(index).radius).sum();
        let usual = sum / scene.len() as f64;
        let enough = |side: &&u32| usual * f64::from(**side) >= 2.0 * reach;
        let side = SIDES.iter().find(enough).copied().unwrap_or(SIDES[SIDES.len() - 1]);
        Self { middle, reach, side }
    }

    /// The picture from a direction.
    fn view(&self, direction: [i16; 3]) -> View {
        let towards = DVec3::from_array(direction.map(|part| -f64::from(part) / 1024.0));
        let flat = direction[2].unsigned_abs() < 900;
        let camera = Camera {
            projection: Projection::Orthographic,
            origin: self.middle - 2.0 * self.reach * towards,
            view: towards,
            up: if flat { DVec3::Z } else { DVec3::X },
            size: ScreenSize::Width(2.0 * self.reach),
            near: 0.0,
            far: f64::INFINITY,
        };
        View::new(camera, ImageSize { width: self.side, height: self.side })
    }

    /// Pixels of a sphere's disc in all pictures, in parts.
    fn area(&self, radius: f64) -> u64 {
        let radius = radius * f64::from(self.side) / (2.0 * self.reach);
        (std::f64::consts::PI * radius * radius * (DIRECTIONS.len() as u64 * PARTS) as f64) as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Spheres;

    #[test]
    fn directions_are_spread() {
        let vectors = DIRECTIONS.map(|d| DVec3::from_array(d.map(f64::from)) / 1024.0);
        let sum: DVec3 = vectors.iter().sum();
        assert!(sum.length() < 1.0, "{sum}");
        for (k, one) in vectors.iter().enumerate() {
            assert!((one.length() - 1.0).abs() < 2e-3, "{one}");
            let nearest = vectors[..k].iter().map(|other| one.distance(*other));
            assert!(nearest.fold(2.0, f64::min) > 0.3, "{k}");
        }
    }

    /// A sphere alone is open, one in the middle of a dense heap is not, and the order of spheres
    /// does not matter.
    #[test]
    fn what_is_surrounded_is_closed() {
        let lattice = (0..1331).map(|k: i32| [k % 11 - 5, k / 11 % 11 - 5, k / 121 - 5]);
        let mut centers: Vec<[f64; 3]> = lattice.map(|c| c.map(f64::from)).collect();
        centers.push([30.0, 0.0, 0.0]);
        let open = |centers: &[[f64; 3]]| {
            let scene = Scene::new(Spheres::points_f64(centers.to_vec(), 0.5)).unwrap();
            openness(&mut Engine::cpu(), &scene, &Control::new()).unwrap()
        };
        let open_there = open(&centers);
        // Corner, face, middle, alone.
        let at = |center: [f64; 3]| open_there[centers.iter().position(|c| *c == center).unwrap()];
        let (corner, face) = (at([5.0; 3]), at([5.0, 0.0, 0.0]));
        let (middle, alone) = (at([0.0; 3]), at([30.0, 0.0, 0.0]));
        assert!(alone == 255 && corner > 200, "{corner} {alone}");
        assert!((120..250).contains(&face) && face < corner, "{face} {corner}");
        assert!(middle < 90, "{middle}");
        assert_eq!(*levels(vec![0, 256, 512, 1024, 1024]), [0, 127, 180, 255, 255]);
        assert_eq!(*levels(vec![0, 0]), [0, 0]);
        centers.reverse();
        let mut reversed = open(&centers).to_vec();
        reversed.reverse();
        assert_eq!(*reversed, *open_there);
    }
}
