//! What a frame needs of the GPU, as data: fixed point, bounds, tile tables and the order of
//! passes.
//!
//! Pure functions of scene extent, view, tile lists and limits; no device is named here. The
//! structs that the shaders share are here too, with the Rust twins of `shaders/rotate.wgsl`.
//!
//! Spaces. *Fixed point*: a centre relative to the middle of the data, in units of a power of two,
//! as integers of at most 2^28. *Steps*: the view's unit of length, a power of two of units; a
//! rotated centre plus a tile's offset is an `i32` in steps.

use std::ops::Range;

use bytemuck::{Pod, Zeroable};
use glam::DVec3;

use planisphere_core::{
    axes::Axes,
    camera::{MAX_SIDE, Projection, Region, View},
    cover,
    drawing::Workload,
    ids::{Slot, SortedIndex, TileIndex},
    scene::Bounds,
    simd::LANES,
};
use planisphere_shaders::{SUBGROUP, TILES_IN_TURN};

/// Side of a tile in pixels.
pub const TILE: u32 = 8;
// `decide` takes a row of a tile as one vector; its masks of rows and of columns, and those of
// `execute`, are `u8`.
const _: () = assert!(TILE as usize == LANES && TILE == u8::BITS);
// `lists::Uncovered` takes the blocks of a cover for tiles.
const _: () = assert!(TILE as usize == cover::BLOCK);
// `lists::Wave::collect` gives the side as its logarithm.
const _: () = assert!(TILE.is_power_of_two());
// In a subgroup, each invocation draws a column.
const _: () = assert!(TILE == SUBGROUP);
/// Pixels of a tile.
pub const TILE_PIXELS: usize = (TILE * TILE) as usize;
// `execute::Pixels` has a bit for each.
const _: () = assert!(TILE_PIXELS == u64::BITS as usize);

/// A sphere as the device has it, see [`Fixed::record`].
pub type Record = [i32; 4];

/// `Frame` of `shaders/types.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[expect(missing_docs, reason = "described in the WGSL, with which a test compares every field")]
pub struct Frame {
    pub right: [i32; 3],
    pub pitch_x: f32,
    pub up: [i32; 3],
    pub pitch_y: f32,
    pub forward: [i32; 3],
    pub delta: f32,
    pub delta_depth: f32,
    pub scale: f32,
    pub base: i32,
    pub base_far: f32,
    pub first: u32,
    pub tiles: u32,
    pub row: u32,
    pub disorder: f32,
}

/// `Tile` of `shaders/types.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[expect(missing_docs, reason = "described in the WGSL, with which a test compares every field")]
pub struct Tile {
    pub start: u32,
    pub count: u32,
    pub x: i32,
    pub y: i32,
    pub z: i32,
    pub slot: u32,
}

/// `Fan` of `shaders/types.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[expect(missing_docs, reason = "described in the WGSL, with which a test compares every field")]
pub struct Fan {
    pub n: [i32; 3],
    pub sx: f32,
    pub m: [i32; 3],
    pub sy: f32,
}

/// `State` of `shaders/types.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[expect(missing_docs, reason = "described in the WGSL, with which a test compares every field")]
pub struct State {
    pub id: i32,
    pub low: f32,
    pub high: f32,
    pub rest: f32,
}

/// `FRESH` of `shaders/types.wgsl`.
pub const FRESH: u32 = 1 << 31;
/// `LAST` of `shaders/types.wgsl`.
pub const LAST: u32 = 1 << 30;
/// `SLOT` of `shaders/types.wgsl`: what is left for a slot.
pub const SLOT: u32 = !(FRESH | LAST);
// No slot that a device has is one of those that stand for something else.
const _: () = assert!(Slot::BACKGROUND.0 > SLOT && Slot::HOST.0 > SLOT);
/// Tiles of a band, at most.
pub const TILES: usize = 1 << 16;
// Each may have a slot, and a band is at least a row of them.
const _: () = assert!(TILES <= SLOT as usize && MAX_SIDE.div_ceil(TILE) as usize <= TILES);
/// `NEVER` of `shaders/types.wgsl`.
pub const NEVER: f32 = 1e36;

/// Largest component of a centre in fixed point, as a power of two.
const CENTER_BITS: i32 = 28;
/// Axes are integers times 2^-30.
const AXIS_BITS: i32 = 30;
/// Bits of the lower part of a number that [`split`] splits.
const LOW_BITS: i32 = 15;
// `rotate` leaves out the products of lower parts, and so divides by 2^AXIS_BITS.
const _: () = assert!(AXIS_BITS == 2 * LOW_BITS);
/// Greatest length of an axis, for `rotate`.
const LONGEST: f64 = 1.5;
/// Largest offset from the middle of the data to a tile, in steps: with a rotated centre (below 1.5
/// sqrt 3 * 2^28) it fits an `i32`.
const OFFSET_LIMIT: f64 = (1 << 30) as f64;
// 1.5 sqrt 3 is less than 3.
const _: () = assert!(OFFSET_LIMIT + 3.0 * (1u32 << CENTER_BITS) as f64 <= i32::MAX as f64);
/// From the middle of a tile to the middles of its outer pixels, and a little more, in pixels.
const HALF_TILE: f64 = 3.6;
const _: () = assert!((TILE - 1) as f64 / 2.0 < HALF_TILE);
/// Tiles reach beyond the screen, by less than so many pixels.
const BEYOND: f64 = 16.0;
const _: () = assert!(TILE as f64 <= BEYOND);
/// One WGSL rounding.
const ULP: f64 = 1.0 / (1 << 23) as f64;

/// Error of a rotated centre with its offset, in steps: lemma K3 of docs/numerics.md needs 2.991.
const ROTATION_ERROR: f64 = 3.125;
/// What is added for axes of up to the greatest length (lemma K3).
const LONGER: f64 = 0.4375;

/// `2^exponent`, for normal results.
fn power(exponent: i32) -> f64 {
    f64::from_bits(((exponent + 1023) as u64) << 52)
}

/// The least `e` with `value < 2^e`, for positive normal numbers.
fn above(value: f64) -> i32 {
    ((value.to_bits() >> 52) & 0x7ff) as i32 - 1022
}

/// The fixed point of a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fixed {
    /// What integers are relative to, in world units.
    pub middle: DVec3,
    /// The unit is two to this.
    pub exponent: i32,
}

impl Fixed {
    /// For centres inside `bounds`; none where exponents are so extreme that f64 products could
    /// leave their range.
    pub fn new(bounds: &Bounds) -> Option<Self> {
        let middle = 0.5 * bounds.min_center + 0.5 * bounds.max_center;
        let reach = (bounds.max_center - middle).max(middle - bounds.min_center).max_element();
        // All centres equal: any unit will do that is not coarse for the spheres.
        let size = if reach > 0.0 { reach } else { bounds.max_radius };
        let fits = |v: f64| v.is_finite() && (-400..400).contains(&above(v));
        let far = middle.abs().max_element();
        let usable = fits(size) && fits(bounds.max_radius) && (far == 0.0 || above(far) < 400);
        usable.then(|| Self { middle, exponent: above(size) - CENTER_BITS })
    }

    /// A sphere as the device has it: centre, and the bits of the radius in units as f32.
    /// Differences round monotonely, so a component is at most 2^28; a tiny radius may become 0,
    /// which `ROTATION_ERROR` dwarfs.
    pub fn record(&self, center: DVec3, radius: f64) -> Record {
        let unit = power(-self.exponent);
        let c = (center - self.middle) * unit;
        let r = ((radius * unit) as f32).min(f32::MAX);
        [
            c.x.round_ties_even() as i32,
            c.y.round_ties_even() as i32,
            c.z.round_ties_even() as i32,
            r.to_bits() as i32,
        ]
    }
}

/// `split` of `shaders/rotate.wgsl`: `v = high 2^15 + low` with `|low| <= 2^14`.
pub fn split(v: [i32; 3]) -> ([i32; 3], [i32; 3]) {
    let high = v.map(|c| c.wrapping_add(1 << (LOW_BITS - 1)) >> LOW_BITS);
    (high, std::array::from_fn(|k| v[k] - (high[k] << LOW_BITS)))
}

/// `rotate` of `shaders/rotate.wgsl`: close to `axis . v / 2^30`.
pub fn rotate(axis: [i32; 3], v: [i32; 3]) -> i32 {
    let dot = |a: [i32; 3], b: [i32; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let ((ah, al), (vh, vl)) = (split(axis), split(v));
    dot(ah, vh) + ((dot(ah, vl) + dot(al, vh) + (1 << (LOW_BITS - 1))) >> LOW_BITS)
}

/// A view as the device has it, but for what differs from tile to tile.
#[derive(Clone, Debug)]
pub struct Eye {
    /// All but the fields of a pass.
    pub frame: Frame,
    projection: Projection,
    right: DVec3,
    up: DVec3,
    forward: DVec3,
    /// The middle of the data in view space, in steps.
    middle: DVec3,
    /// Bound on its error and on that of a tile's place, in steps.
    middle_error: f64,
    /// Size of a pixel, in steps or on the screen at distance 1.
    pitch: [f64; 2],
    /// Axis component 1 as an integer.
    one: f64,
    image: [f64; 2],
    near: f64,
    far: f64,
    step: f64,
    /// How much before the first hit depths in a tile start, in steps.
    margin: f64,
    /// Whether a sphere can meet near, and far.
    crossed: [bool; 2],
    /// No hit of any sphere is nearer, in world units.
    least: f64,
}

/// What a tile adds.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// Offsets; the rest is of the pass.
    pub tile: Tile,
    /// Of perspective tiles.
    pub fan: Fan,
    /// Bounds below and above near, below and above far.
    pub planes: [f32; 4],
}

/// Which kernel a tile needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Class {
    /// No sphere of it meets a clip plane.
    Open,
    /// One may.
    Clipped,
    /// Its numbers do not fit the device's integers; the host decides every pixel.
    Host,
}

/// The f32 not above `x`, within the range in which the shaders compare depths.
fn down(x: f64) -> f32 {
    let y = x.clamp(-1e30, 1e30) as f32;
    if f64::from(y) > x { y.next_down() } else { y }
}

/// The f32 not below `x`.
fn up(x: f64) -> f32 {
    -down(-x)
}

/// The middle of the data in view space, and the difference that it was made from, rounded. The
/// difference is exact as high + low (two-sum), products and sums round.
fn middle_in_view(middle: DVec3, origin: DVec3, axes: [DVec3; 3]) -> (DVec3, DVec3) {
    let high = middle - origin;
    let back = high - middle;
    let low = (middle - (high - back)) - (origin + back);
    (DVec3::from_array(axes.map(|axis| axis.dot(high) + axis.dot(low))), high)
}

/// Half the screen and a tile more, at distance 1 or anywhere; and how long the axes of perspective
/// tiles are, at most.
fn reach(image: [f64; 2], pitch: [f64; 2], perspective: bool) -> ([f64; 2], f64) {
    let half = [0, 1].map(|k| (0.5 * image[k] + BEYOND) * pitch[k]);
    let length = 1.001 * (1.0 + half[0] * half[0] + half[1] * half[1]).sqrt();
    (half, if perspective { length } else { 1.0 })
}

/// Bound of the middle in view space (lemma K4 of docs/numerics.md): in units of 2^-53,
/// `6 distance + 3 |s|` is needed for parallel rays, and `8.5 distance (1 + s^2)` in perspective.
fn host_error(distance: f64, half: [f64; 2], tilt: Option<f64>) -> f64 {
    let ulps = match tilt {
        Some(spread) => 9.0 * spread * spread * distance,
        None => 6.5 * distance + 3.5 * (half[0] + half[1]),
    };
    power(-53) * ulps
}

/// What the device's arithmetic adds to the bound of a place; for perspective rays, of data as far
/// as `farthest`.
fn roundings(widest: f64, delta_depth: f64, farthest: Option<f64>) -> f64 {
    match farthest {
        Some(farthest) => LONGER + widest * (4.0 * delta_depth + 15.0 * ULP * farthest),
        None => 24.0 * ULP * widest,
    }
}

/// log2 of a step in units of fixed point: small against a pixel (`fine` and `coarse` are its sides
/// at the data), yet large enough that spheres, of at most `radius`, and tiles are not far beyond
/// 2^29 steps. `tilt` is how long the axes of perspective tiles are.
fn level(fixed: &Fixed, radius: f64, fine: f64, coarse: f64, tilt: Option<f64>) -> i32 {
    let levels = |length: f64, bits: i32| {
        if length > 0.0 { (above(length) - bits - fixed.exponent).max(0) } else { 0 }
    };
    let wish = levels(radius + 16.0 * coarse, 29);
    let limit = (above(fine) - 1 - 16 - fixed.exponent).max(levels(16.0 * coarse, 28)).max(0);
    wish.min(limit).max(tilt.map_or(0, |spread| above(spread / LONGEST)))
}

/// How far before the first hit depths in a perspective tile start, so that keys of hits are above
/// 0: lemma V9 of docs/numerics.md. Lengths are in steps.
fn key_margin(spread: f64, widest: f64, delta: f64, radius: f64, farthest: f64) -> f64 {
    let half = HALF_TILE * widest;
    let by_radius = (1.0 / 32.0 + half / 8.0) * radius;
    1.07 * spread * (1024.0 * delta + spread * (by_radius + half / 24.0 * farthest))
}

impl Eye {
    /// Of a view of a scene with these bounds; none where the device's numbers cannot hold it, and
    /// the host must decide all.
    pub fn new(fixed: &Fixed, bounds: &Bounds, view: &View) -> Option<Self> {
        let camera = &view.camera;
        let axes = Axes::new(camera.view, camera.up);
        let [right, upward, forward] = [axes.right.high, axes.up.high, axes.forward.high];
        let pitch = [view.pitch_x.to_f64(), view.pitch_y.to_f64()];
        let image = [f64::from(view.image.width), f64::from(view.image.height)];
        let perspective = camera.projection == Projection::Perspective;
        let (half, spread) = reach(image, pitch, perspective);
        let tilt = perspective.then_some(spread);
        let (middle, high) = middle_in_view(fixed.middle, camera.origin, [right, upward, forward]);
        let distance = high.x.hypot(high.y).hypot(high.z);
        let error = host_error(distance, half, tilt);

        let extent = 0.5 * (bounds.max_center - bounds.min_center);
        let depth_reach = extent.dot(forward.abs()) + bounds.max_radius;
        let pixel = |p: f64| if perspective { p * (middle.z.abs() + depth_reach) } else { p };
        let (fine, coarse) = (pixel(pitch[0].min(pitch[1])), pixel(pitch[0].max(pitch[1])));
        let level = level(fixed, spread * bounds.max_radius, fine, coarse, tilt);
        let one = if level <= 32 { power(AXIS_BITS - level) } else { 0.0 };
        let step = power(fixed.exponent) * power(level.min(200));
        let axis = |a: DVec3| (a * one).to_array().map(|c| c.round_ties_even() as i32);

        let middle = middle / step;
        let middle_error = error / step;
        let base_fits = middle.z.abs() <= OFFSET_LIMIT;
        let scaled = if perspective { pitch } else { [pitch[0] / step, pitch[1] / step] };
        let delta_depth = ROTATION_ERROR + middle_error;
        let widest = scaled[0].max(scaled[1]);
        let farthest = middle.z.abs() + depth_reach / step;
        let roundings = roundings(widest, delta_depth, perspective.then_some(farthest));
        let delta = ROTATION_ERROR + middle_error + roundings;
        let radius = bounds.max_radius / step;
        let margin = tilt.map_or(0.0, |spread| key_margin(spread, widest, delta, radius, farthest));
        let frame = Frame {
            right: axis(right),
            pitch_x: scaled[0] as f32,
            up: axis(upward),
            pitch_y: scaled[1] as f32,
            forward: axis(forward),
            delta: up(delta),
            delta_depth: up(delta_depth),
            scale: power(-level.min(200)).max(power(-120)) as f32,
            base: if base_fits { middle.z.round_ties_even() as i32 } else { 0 },
            base_far: if base_fits { 0.0 } else { middle.z as f32 },
            ..Frame::zeroed()
        };
        let slop =
            power(-40) * (high.abs().element_sum() + half[0] + half[1] + depth_reach + camera.near);
        let center = middle.z * step;
        let crossed =
            [center - depth_reach - slop <= camera.near, center + depth_reach + slop >= camera.far];
        // Everything must stay where squares of f32 do, and steps must resolve something.
        let in_perspective =
            spread <= 8.0 && coarse / step < power(30) && spread * farthest < power(60);
        let sane = level <= 120
            && delta < power(60)
            && scaled.iter().all(|&p| p > power(-60) && p < power(40))
            && middle.is_finite()
            && middle.abs().max_element() < power(60)
            && (!perspective || in_perspective);
        sane.then_some(Self {
            frame,
            projection: camera.projection,
            right,
            up: upward,
            forward,
            middle,
            middle_error,
            pitch: scaled,
            one,
            image,
            near: camera.near,
            far: camera.far,
            step,
            margin,
            crossed,
            least: (center - depth_reach - slop).max(camera.near),
        })
    }

    /// How rays run.
    pub fn projection(&self) -> Projection {
        self.projection
    }

    /// A depth in world units as the kernels of a tile with offset `z` see it, in steps.
    pub fn depth_in_tile(&self, depth: f64, z: i32) -> f64 {
        depth / self.step - self.middle.z + f64::from(z)
    }

    /// A world length as steps, rounded up; at most what the shaders take for never.
    pub fn steps(&self, length: f64) -> f32 {
        if length.is_finite() { up((length / self.step).min(1e30)) } else { NEVER }
    }

    /// The kernel for a tile whose spheres lie at `nearest` (in world units) or beyond, were its
    /// numbers to fit.
    fn kernel(&self, nearest: f64) -> Class {
        let near = self.crossed[0] && (nearest.is_nan() || nearest <= self.near);
        if near || self.crossed[1] { Class::Clipped } else { Class::Open }
    }

    /// The tile whose first pixel is (`column`, `row`) and whose spheres lie at `nearest` or
    /// beyond. If `all` is false more spheres are to come, which may be nearer.
    pub fn place(&self, column: u32, row: u32, nearest: f64, all: bool) -> (Class, Place) {
        let half = f64::from(TILE / 2);
        let sx = (f64::from(column) + half - 0.5 * self.image[0]) * self.pitch[0];
        let sy = (0.5 * self.image[1] - f64::from(row) - half) * self.pitch[1];
        let m = self.middle;
        let (x, y, fan) = match self.projection {
            Projection::Orthographic => (m.x - sx, m.y - sy, Fan::zeroed()),
            Projection::Perspective => {
                let axis = |a: DVec3| (a * self.one).to_array().map(|c| c.round_ties_even() as i32);
                let (n, across) = (sx * self.forward - self.right, self.up - sy * self.forward);
                (
                    m.z * sx - m.x,
                    m.y - m.z * sy,
                    Fan { n: axis(n), sx: sx as f32, m: axis(across), sy: sy as f32 },
                )
            }
        };
        // Depths are relative to where the first hit can be, for the sake of f32; what is nearer
        // counts as lying there.
        let first = if all { nearest.max(self.least) } else { self.least };
        let z = m.z - first / self.step + self.margin;
        // Perspective keys must be above 0.
        let begins = self.projection == Projection::Orthographic || z <= OFFSET_LIMIT;
        let z = z.clamp(-OFFSET_LIMIT, OFFSET_LIMIT).round_ties_even();
        let plane = |depth: f64| {
            if depth.is_infinite() {
                return [1e30; 2];
            }
            let t = self.depth_in_tile(depth, z as i32);
            let error = self.middle_error + power(-48) * (depth / self.step + m.z.abs() + z.abs());
            [down(t - error), up(t + error)]
        };
        let ([a, b], [c, d]) = (plane(self.near), plane(self.far));
        let fits = x.abs() <= OFFSET_LIMIT && y.abs() <= OFFSET_LIMIT;
        let class = if fits && begins { self.kernel(nearest) } else { Class::Host };
        let tile = Tile {
            x: x.round_ties_even() as i32,
            y: y.round_ties_even() as i32,
            z: z as i32,
            ..Tile::zeroed()
        };
        (class, Place { tile, fan, planes: [a, b, c, d] })
    }
}

/// Tile lists of some spheres: of tile `t`, row by row, the entries `starts[t]..starts[t + 1]`.
#[derive(Clone, Copy, Debug)]
pub struct Lists<'a> {
    /// Tiles in a row.
    pub columns: u32,
    /// Rows of tiles.
    pub rows: u32,
    /// One more than tiles.
    pub starts: &'a [u32],
    /// Places of spheres on the device, those of a tile roughly front to back.
    pub entries: &'a [SortedIndex],
    /// Of each tile with a list, a lower bound of the depth of all spheres in it, in `unit`; may be
    /// infinite.
    pub nearest: &'a [f64],
    /// In world units.
    pub unit: f64,
    /// No entry of a tile begins nearer, by more than this, than any entry before it in the list;
    /// world units, may be infinite.
    pub disorder: f64,
}

/// What one dispatch may hold.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// About how many entries the host's lists hold at a time.
    pub wave: usize,
    /// Entries uploaded at a time.
    pub entries: usize,
    /// Tiles drawn at a time.
    pub tiles: usize,
    /// Lists of at most so many entries have a kernel of their own; 0 if there is none.
    pub few: u32,
    /// Where fewer tiles have such lists, they are drawn with the others.
    pub worth: usize,
    /// Entries of one tile in one pass, for the sake of [`ITERATIONS`].
    pub round: u32,
}

/// How much a device takes at a time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Capacity {
    /// Whether its memory is the host's.
    pub software: bool,
    /// Spheres in one buffer.
    pub chunk: usize,
    /// Entries of the host's lists at a time.
    pub wave: usize,
    /// Pixels drawn at a time.
    pub band: usize,
}

/// Bytes of an entry of the host's lists, with its copy on the way to the device.
const ENTRY: u64 = 40;

impl Capacity {
    /// Bytes of the host that drawing needs at most, beyond the scene and the ids. On the safe
    /// side.
    pub fn memory(&self, work: &Workload) -> u64 {
        let entries = work.entries.min(self.wave as u64) * ENTRY;
        let spheres = work.spheres as u64;
        let band = work.region.pixels().min(self.band) as u64;
        let driver = if self.software { 96 << 20 } else { 160 << 20 };
        // A part of the order of the spheres (which is made only where twice as much as all of it
        // is free, see `order`, and nothing is refused for its sake); on a software device their
        // copy, and all that is known of pixels.
        let copy = u64::from(self.software) * (16 * spheres + 20 * band);
        entries + spheres * 12 + driver + 8 * band + copy
    }
}

/// Mesa's software device ends the loops of an invocation after so many iterations in all, without
/// a word.
pub const ITERATIONS: u32 = 65_535;
/// [`Limits::round`] of a device.
pub const ROUND: u32 = 32_768;
// `tiles_portable.wgsl` takes an iteration for each entry, and one more for each eight.
const _: () = assert!(ROUND + ROUND.div_ceil(8) < ITERATIONS);
// `tiles_subgroup8.wgsl` draws several tiles in turn: an iteration for each, and one for as many
// entries of its list as there are lanes.
const _: () = assert!(TILES_IN_TURN * (1 + ROUND.div_ceil(SUBGROUP)) < ITERATIONS);

/// Part of a tile's list in one pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Segment {
    /// The tile.
    pub tile: TileIndex,
    /// First entry, inside the window.
    pub start: u32,
    /// Entries.
    pub count: u32,
    /// First segment of its tile.
    pub fresh: bool,
}

/// One dispatch.
#[derive(Clone, Debug)]
pub struct Pass {
    /// Which kernel.
    pub clipped: bool,
    /// Whether no segment has more than [`Limits::few`] entries.
    pub few: bool,
    /// Which entries of the lists must be on the device.
    pub window: Range<usize>,
    /// Tiles.
    pub segments: Vec<Segment>,
}

/// What is known of the tiles of a band while its lists come in.
#[derive(Clone, Debug)]
pub struct Band {
    /// Its pixels.
    pub region: Region,
    /// Tiles in a row.
    pub columns: u32,
    /// Of each tile, where in `places` its own is, once it was met.
    numbers: Vec<u32>,
    places: Vec<Place>,
    /// Tiles whose every pixel the host decides.
    pub host: Vec<TileIndex>,
    left_out: Vec<bool>,
}

impl Band {
    /// In the place of a number.
    const UNMET: u32 = u32::MAX;

    /// Nothing is known.
    pub fn new(region: Region) -> Self {
        let (columns, rows) = (region.width.div_ceil(TILE), region.height.div_ceil(TILE));
        let tiles = (columns * rows) as usize;
        let (places, host) = (Vec::new(), Vec::new());
        Self {
            region,
            columns,
            numbers: vec![Self::UNMET; tiles],
            places,
            host,
            left_out: vec![false; tiles],
        }
    }

    /// Number of tiles.
    pub fn tiles(&self) -> usize {
        self.numbers.len()
    }

    /// What a tile adds to the view.
    ///
    /// # Panics
    /// When no pass had the tile.
    pub fn place(&self, tile: TileIndex) -> &Place {
        self.places.get(self.numbers[tile.at()] as usize).expect("tiles of passes have a place")
    }

    /// Tiles that were met and are not the host's.
    pub fn met(&self) -> Vec<TileIndex> {
        let tiles = (0..self.numbers.len() as u32).map(TileIndex);
        tiles.filter(|tile| self.numbers[tile.at()] != Self::UNMET).collect()
    }

    /// The dispatches that some lists need, and whether each tile has only one segment among them.
    /// `all` says that no more lists will come.
    pub fn passes(
        &mut self,
        lists: &Lists<'_>,
        eye: &Eye,
        limits: Limits,
        all: bool,
    ) -> (Vec<Pass>, bool) {
        let kernels = self.kernels(lists, eye, limits, all);
        let mut passes = Vec::new();
        let mut single = true;
        for window in (0..lists.entries.len()).step_by(limits.entries) {
            let window = window as u32..lists.entries.len().min(window + limits.entries) as u32;
            for ((clipped, few), tiles) in
                [(false, false), (false, true), (true, false)].into_iter().zip(&kernels)
            {
                for round in 0.. {
                    let mut segments = Vec::new();
                    for &(tile, fresh) in tiles {
                        let (first, last) = (lists.starts[tile.at()], lists.starts[tile.at() + 1]);
                        let start = first.max(window.start).saturating_add(round * limits.round);
                        let stop = last.min(window.end);
                        if start < stop {
                            let count = (stop - start).min(limits.round);
                            single &= count == last - first;
                            let fresh = fresh && start == first;
                            segments.push(Segment {
                                tile,
                                start: start - window.start,
                                count,
                                fresh,
                            });
                        }
                    }
                    if segments.is_empty() {
                        break;
                    }
                    passes.push(Pass {
                        clipped,
                        few,
                        window: window.start as usize..window.end as usize,
                        segments,
                    });
                }
            }
        }
        (passes, single)
    }

    /// The tiles of each kernel (the whole, the short, the clipped), and whether they were never
    /// met before.
    fn kernels(
        &mut self,
        lists: &Lists<'_>,
        eye: &Eye,
        limits: Limits,
        all: bool,
    ) -> [Vec<(TileIndex, bool)>; 3] {
        let mut kernels = [Vec::new(), Vec::new(), Vec::new()];
        let mut meet = |tile: TileIndex| {
            let count = lists.starts[tile.at() + 1] - lists.starts[tile.at()];
            if count == 0 || self.left_out[tile.at()] {
                return;
            }
            let nearest = lists.nearest[tile.at()] * lists.unit;
            let fresh = self.numbers[tile.at()] == Self::UNMET;
            let class = if fresh {
                let (x, y) = (tile.0 % self.columns * TILE, tile.0 / self.columns * TILE);
                let (class, place) = eye.place(self.region.x + x, self.region.y + y, nearest, all);
                if class == Class::Host {
                    self.left_out[tile.at()] = true;
                    self.host.push(tile);
                    return;
                }
                self.numbers[tile.at()] = self.places.len() as u32;
                self.places.push(place);
                class
            } else {
                eye.kernel(nearest)
            };
            let kernel = match class {
                Class::Clipped => 2,
                _ => usize::from(count <= limits.few),
            };
            kernels[kernel].push((tile, fresh));
        };
        for_tiles_in_order(lists.columns, lists.rows, |tiles| {
            if lists.starts[tiles.start as usize] < lists.starts[tiles.end as usize] {
                tiles.map(TileIndex).for_each(&mut meet);
            }
        });
        if kernels[1].len() < limits.worth {
            let few = std::mem::take(&mut kernels[1]);
            kernels[0].extend(few);
        }
        kernels
    }
}

/// Side of the blocks in which tiles are drawn, in tiles.
const BLOCK: u32 = 8;

/// An order of tiles, given by rows of neighbours: blocks of neighbours, whose lists share spheres,
/// come together, so that caches see them together; blocks that follow each other are distant, so
/// that devices that split a dispatch into contiguous parts are loaded evenly.
fn for_tiles_in_order(columns: u32, rows: u32, mut visit: impl FnMut(Range<u32>)) {
    let across = columns.div_ceil(BLOCK);
    let blocks = (across * rows.div_ceil(BLOCK)) as usize;
    let mut stride = (blocks as f64 * 0.618) as usize | 1;
    while gcd(stride, blocks.max(1)) != 1 {
        stride += 2;
    }
    for k in 0..blocks {
        let block = (k * stride % blocks) as u32;
        let (left, top) = (block % across * BLOCK, block / across * BLOCK);
        for row in top..rows.min(top + BLOCK) {
            visit(row * columns + left..row * columns + columns.min(left + BLOCK));
        }
    }
}

fn gcd(a: usize, b: usize) -> usize {
    if b == 0 { a } else { gcd(b, a % b) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A small generator, so that a seed gives the same numbers everywhere.
    fn random(state: &mut u64) -> u64 {
        *state ^= *state << 13;
        *state ^= *state >> 7;
        *state ^= *state << 17;
        *state
    }

    #[test]
    fn rotation_is_within_its_bound_of_the_true_product() {
        let mut state = 0x9e37_79b9_7f4a_7c15;
        let mut worst = 0.0f64;
        for round in 0..200_000 {
            let mut v: [i32; 3] =
                std::array::from_fn(|_| (random(&mut state) % (1 << 29) + 1) as i32 - (1 << 28));
            if round % 3 == 0 {
                v = v.map(|c| if c < 0 { -(1 << 28) } else { 1 << 28 });
            }
            let axis = DVec3::from_array(std::array::from_fn(|_| {
                (random(&mut state) >> 40) as f64 - 8388607.5
            }));
            let axis = if round % 7 == 0 {
                [DVec3::X, -DVec3::Y, DVec3::Z][round % 3]
            } else {
                axis.normalize()
            };
            let length = if round % 2 == 0 { LONGEST } else { 1.0 };
            let m =
                (axis * length * f64::from(1 << 30)).to_array().map(|c| c.round_ties_even() as i32);
            let exact: i64 = (0..3).map(|k| i64::from(m[k]) * i64::from(v[k])).sum();
            let error = (exact as f64 / f64::from(1 << 30) - f64::from(rotate(m, v))).abs();
            worst = worst.max(error);
        }
        assert!(worst <= 1.25, "{worst}");
        assert!(worst > 0.8, "the test should come near the bound: {worst}");
    }

    /// Cameras far away, where the roundings of f64 are many steps.
    #[test]
    fn the_middle_is_within_its_bound_of_the_true_one() {
        use planisphere_core::{
            camera::{Camera, ImageSize, ScreenSize},
            exact::dd::Bounded,
            scene::{Scene, Sphere},
        };
        let mut state = 0x2545_f491_4f6c_dd1d;
        let mut number = || (random(&mut state) >> 11) as f64 / (1u64 << 52) as f64 - 1.0;
        for projection in [Projection::Orthographic, Projection::Perspective] {
            let mut worst = 0.0f64;
            for _ in 0..20_000 {
                let mut vector = || DVec3::new(number(), number(), number());
                let ball = |center| Sphere { center, radius: 0.01, color: [0; 3] };
                let bounds =
                    Scene::from_spheres(&[ball(vector()), ball(vector())]).unwrap().bounds();
                let fixed = Fixed::new(&bounds).unwrap();
                let mut camera = Camera::orthographic(1e5 * vector(), vector());
                camera.projection = projection;
                camera.size = ScreenSize::Both { width: 0.25, height: 0.25 };
                let view = View::new(camera, ImageSize { width: 64, height: 64 });
                let Some(eye) = Eye::new(&fixed, &bounds, &view) else { continue };
                let away =
                    [0, 1, 2].map(|k| Bounded::difference(fixed.middle[k], camera.origin[k]));
                let axes = Axes::new(camera.view, camera.up);
                for (axis, found) in [
                    (axes.right, eye.middle.x),
                    (axes.up, eye.middle.y),
                    (axes.forward, eye.middle.z),
                ] {
                    let part = |k: usize| {
                        Bounded::pair(
                            axis.high[k],
                            axis.low[k],
                            planisphere_core::axes::Axis::ERROR,
                        ) * away[k]
                    };
                    let off = part(0) + part(1) + part(2) - Bounded::exact(found * eye.step);
                    worst = worst.max(off.value().abs() / (eye.middle_error * eye.step));
                }
            }
            assert!(worst <= 1.0 && worst > 0.125, "{projection:?}: {worst} of the bound");
        }
    }

    /// The axes of perspective tiles are as long as rays are; the shader's multiplication takes
    /// them up to a length.
    #[test]
    fn axes_of_wide_views_keep_to_their_bits() {
        use planisphere_core::{
            camera::{Camera, ImageSize, ScreenSize},
            scene::{Scene, Sphere},
        };
        let ball = |x: f64| Sphere {
            center: DVec3::new(x, 0.3 * x, -0.2 * x),
            radius: 0.5,
            color: [0; 3],
        };
        let bounds = Scene::from_spheres(&[ball(4.0), ball(9.0)]).unwrap().bounds();
        let fixed = Fixed::new(&bounds).unwrap();
        for width in [0.1, 0.9, 2.0, 3.4, 3.6, 6.9, 11.0] {
            let mut camera = Camera::orthographic(DVec3::ZERO, DVec3::new(1.0, 0.2, -0.3));
            camera.projection = Projection::Perspective;
            camera.size = ScreenSize::Both { width, height: width };
            let view = View::new(camera, ImageSize { width: 64, height: 64 });
            // Wider views may be left to the host, but not these.
            let Some(eye) = Eye::new(&fixed, &bounds, &view) else {
                assert!(width > 3.0, "{width}");
                continue;
            };
            for (column, row) in [(0, 0), (56, 0), (0, 56), (56, 56), (32, 32)] {
                let (_, place) = eye.place(column, row, 1.0, true);
                for axis in [place.fan.n, place.fan.m, eye.frame.forward] {
                    let length = axis.map(|c| f64::from(c).powi(2)).iter().sum::<f64>().sqrt();
                    assert!(
                        length <= (LONGEST + 1e-9) * f64::from(1 << 30),
                        "width {width}: {axis:?}"
                    );
                }
            }
        }
    }

    #[test]
    fn split_gives_the_number_back() {
        for v in [i32::MIN / 2, -16385, -16384, -1, 0, 1, 16383, 16384, 1 << 30, -(1 << 28)] {
            let (high, low) = split([v; 3]);
            assert_eq!((high[0] << 15) + low[0], v);
            assert!(low[0].abs() <= 1 << 14);
        }
    }
}
