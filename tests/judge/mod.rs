//! The tests' own truth: the nearest sphere at a pixel, decided from the image contract and nothing
//! else.
//!
//! The judge shares no code with the devices. It reads the raw numbers of the spheres and of the
//! camera, and writes the contract's formulas down once, for any kind of interval. First the
//! intervals are f64. Where they leave a question open, they are big integers with 128, 256, 512,
//! ... binary places, until the sign is certain or the number is nearer to zero than a number of
//! its kind can be without being zero ([`separation`]). So ties and tangents are proved, not
//! believed.

#![allow(dead_code, reason = "each test crate that takes in the judge asks it other questions")]

pub mod interval;
pub mod levels;
pub mod looks;
pub mod separation;
mod srgb;

use std::{
    cmp::Ordering,
    collections::HashSet,
    sync::{
        OnceLock,
        atomic::{AtomicU64, Ordering as Order},
    },
};

use dashu_int::IBig;
use planisphere_core::{
    camera::{Projection, Region, ScreenSize, View},
    scene::Scene,
};
use rayon::prelude::*;

use interval::{Fixed, Real, Rough, split};
use separation::{Body, Given, Setting, Size};

/// Places of the first big intervals; each further step has twice as many.
const FIRST_PLACES: usize = 128;
/// So many steps: half a million places.
const STEPS: usize = 13;
/// A distance is known to so many bits.
const DISTANCE_BITS: usize = 80;
/// With irrational axes the contract lets numbers that agree this far count as equal.
const CONTRACT_BITS: i64 = 4000;

/// A sphere from where the camera is: centre along right, up and forward, and radius.
#[derive(Clone)]
struct Seen<R> {
    center: [R; 3],
    radius: R,
}

/// Right, up and forward.
type Axes<R> = [[R; 3]; 3];

fn dot<R: Real>(a: &[R; 3], b: &[R; 3]) -> R {
    a[0].times(&b[0]).plus(&a[1].times(&b[1])).plus(&a[2].times(&b[2]))
}

fn cross<R: Real>(a: &[R; 3], b: &[R; 3]) -> [R; 3] {
    let part = |i: usize, j: usize| a[i].times(&b[j]).minus(&a[j].times(&b[i]));
    [part(1, 2), part(2, 0), part(0, 1)]
}

/// Where the line of a ray crosses a sphere: at `(middle +- sqrt chord) / square`, if `chord >= 0`.
struct Crossing<R> {
    middle: R,
    chord: R,
}

impl<R: Real> Crossing<R> {
    /// The root on the camera's side, or the other, times `square`.
    fn at(&self, root: Root) -> R {
        match root {
            Root::Near => self.middle.minus(&self.chord.root()),
            Root::Far => self.middle.plus(&self.chord.root()),
        }
    }
}

/// Which of the two crossings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Root {
    Near,
    Far,
}

/// The ray of a sample: `square` is the squared length of its direction, whose part along the view
/// direction is 1.
struct Ray<R> {
    screen: [R; 2],
    square: R,
}

/// What quick intervals say of a sphere at a pixel.
enum Guess {
    /// It is not seen there.
    Never,
    /// It may be seen, not before `least`; surely by `most`, which is infinity when that is not
    /// certain. Both times `square`.
    Maybe { least: f64, most: f64 },
}

/// A sphere that is seen at a pixel.
#[derive(Clone, Copy, Debug)]
pub struct Hit {
    sphere: usize,
    root: Root,
}

/// The exact distance of a hit, as an interval of [`DISTANCE_BITS`] bits; exactly 0 where it is 0.
#[derive(Clone, Debug)]
pub struct Distance(Fixed);

impl Distance {
    /// Whether it certainly lies between two f64, both included; either may be infinite.
    pub fn is_between(&self, low: f64, high: f64) -> bool {
        self.0.against(low)[0] != Ordering::Less && self.0.against(high)[1] != Ordering::Greater
    }

    /// Whether bounds hold it, neither of them infinite, but for the upper one of a distance that
    /// no f64 reaches, or all but.
    pub fn has_bounds(&self, [low, high]: [f64; 2]) -> bool {
        let reached =
            high < f64::INFINITY || self.is_between(f64::MAX * (1.0 - 2f64.powi(-37)), high);
        (0.0..f64::INFINITY).contains(&low) && self.is_between(low, high) && reached
    }

    /// Whether a depth in f32 is within so many units in the last place of it. What no f32 reaches
    /// is the largest f32.
    pub fn has_depth(&self, depth: f32, units: f64) -> bool {
        // No distance is negative, and none is the background's.
        if !(depth.is_sign_positive() && depth < f32::INFINITY) {
            return false;
        }
        let (value, largest) = (f64::from(depth), depth == f32::MAX);
        // The spacing above the depth; just below a power of two it is half as much.
        let unit = if largest {
            value - f64::from(depth.next_down())
        } else {
            f64::from(depth.next_up()) - value
        };
        self.is_between(
            value - units * unit,
            if largest { f64::INFINITY } else { value + units * unit },
        )
    }

    /// About how much it is, in words.
    pub fn words(&self) -> String {
        self.0.words()
    }
}

/// How much work there was.
#[derive(Debug, Default)]
pub struct Effort {
    /// Pixel and sphere pairs that were looked at.
    pub pairs: AtomicU64,
    /// Signs that needed big integers.
    pub signs: AtomicU64,
    /// Signs that were proved to be zero.
    pub zeros: AtomicU64,
}

/// The truth about one scene from one view.
pub struct Judge {
    perspective: bool,
    /// Centre and radius.
    spheres: Vec<([f64; 3], f64)>,
    /// Spheres without the later ones of equal numbers, which never win, and quick intervals for
    /// them.
    first: Vec<(usize, Seen<Rough>)>,
    origin: [f64; 3],
    /// View direction and up, scaled to whole numbers, which moves no axis.
    view: [IBig; 3],
    up: [IBig; 3],
    near: f64,
    far: f64,
    /// Length, divisor and number of pixels, across and down.
    sides: [(f64, u32, u32); 2],
    setting: Setting,
    /// See [`CONTRACT_BITS`].
    contract_bits: i64,
    axes: Vec<OnceLock<Axes<Fixed>>>,
    /// How much work there was.
    pub effort: Effort,
}

/// Three numbers times the power of two that makes them whole.
fn whole(vector: [f64; 3]) -> [IBig; 3] {
    let parts = vector.map(split);
    let least = parts.iter().filter(|p| p.0 != 0).map(|p| p.1).min().unwrap_or(0);
    parts.map(|(mantissa, exponent)| match mantissa {
        0 => IBig::ZERO,
        _ => IBig::from(mantissa) << (exponent - least) as usize,
    })
}

impl Judge {
    /// Reads the numbers of a scene and a view. Both must have been checked.
    pub fn new(scene: &Scene, view: &View) -> Self {
        Self::with_lengths(scene, view, &[])
    }

    /// The same, and distances will be compared with these lengths.
    pub fn with_lengths(scene: &Scene, view: &View, lengths: &[f64]) -> Self {
        let camera = &view.camera;
        let spheres: Vec<_> = (0..scene.len())
            .map(|i| scene.sphere(i).unwrap())
            .map(|s| (s.center.to_array(), s.radius))
            .collect();
        // Samples beyond the border on both sides leave the middle, and so all others, where it is.
        let (pixels, margin) = ([view.image.width, view.image.height], view.margin);
        let [columns, rows] = pixels.map(|side| side - 2 * margin);
        let [across, down] = match camera.size {
            ScreenSize::Both { width, height } => [(width, columns), (height, rows)],
            // Square pixels: the other side follows from the aspect, without rounding.
            ScreenSize::Width(width) => [(width, columns); 2],
            ScreenSize::Height(height) => [(height, rows); 2],
        };
        let sides =
            [(across, pixels[0]), (down, pixels[1])].map(|(side, all)| (side.0, side.1, all));
        let perspective = camera.projection == Projection::Perspective;
        let origin = camera.origin.to_array();
        let (d, up) = (whole(camera.view.to_array()), whole(camera.up.to_array()));
        let planes: Vec<f64> = [camera.near, camera.far]
            .into_iter()
            .filter(|x| x.is_finite())
            .chain(lengths.iter().copied())
            .collect();
        let integer_cross = |a: &[IBig; 3], b: &[IBig; 3]| {
            [(1, 2), (2, 0), (0, 1)].map(|(i, j): (usize, usize)| &a[i] * &b[j] - &a[j] * &b[i])
        };
        let square = |v: &[IBig; 3]| v.iter().map(|x| x * x).fold(IBig::ZERO, |sum, x| sum + x);
        let setting = Setting::new(&Given {
            perspective,
            square_view: &square(&d),
            square_side: &square(&integer_cross(&d, &up)),
            origin,
            planes: &planes,
            sides,
        });
        let mut judge = Self {
            perspective,
            spheres,
            first: Vec::new(),
            origin,
            view: d,
            up,
            near: camera.near,
            far: camera.far,
            sides,
            setting,
            contract_bits: CONTRACT_BITS,
            axes: (0..STEPS).map(|_| OnceLock::new()).collect(),
            effort: Effort::default(),
        };
        // 512 places: more than any f64 of ordinary size can tell.
        let axes = judge.axes(2).clone().map(|axis| axis.map(|x| x.rough()));
        let mut known = HashSet::new();
        for (index, (center, radius)) in judge.spheres.iter().enumerate() {
            // Adding 0 turns -0 into 0.
            let numbers = [center[0], center[1], center[2], *radius].map(|x| (x + 0.0).to_bits());
            if known.insert(numbers) {
                judge.first.push((index, judge.seen(index, &axes, ())));
            }
        }
        judge
    }

    /// The nearest sphere at a pixel, or -1.
    pub fn id(&self, column: u32, row: u32) -> i32 {
        self.nearest(column, row, &self.in_row(row))
    }

    /// The same for a part of the image, row by row from the top.
    pub fn ids(&self, region: Region) -> Vec<i32> {
        (region.y..region.y + region.height)
            .into_par_iter()
            .flat_map_iter(|row| {
                let candidates = self.in_row(row);
                (region.x..region.x + region.width)
                    .map(|column| self.nearest(column, row, &candidates))
                    .collect::<Vec<_>>()
            })
            .collect()
    }

    /// The exact distance at which a sphere is seen at a pixel, whatever hides it; none if its ray
    /// does not meet it in the clip range.
    pub fn distance(&self, column: u32, row: u32, id: i32) -> Option<Distance> {
        let sphere = self.original(usize::try_from(id).ok()?);
        let hit = self.hit(column, row, sphere)?;
        let separation =
            self.setting.depth(&[self.body(sphere)]).separation(2 * self.setting.degree);
        for step in 0..STEPS {
            let ray: Ray<Fixed> = self.ray(column, row, FIRST_PLACES << step);
            let times_square = self.crossing_at(&ray, sphere, step).at(hit.root);
            if times_square.sign() == Some(Ordering::Equal) || times_square.within(-separation) {
                return Some(Distance(Fixed::exact(0.0, 0)));
            }
            let distance = times_square.over(&ray.square);
            if distance.is_known_to(DISTANCE_BITS) {
                return Some(Distance(distance));
            }
        }
        panic!(
            "pixel ({column}, {row}): {} places do not tell the distance",
            FIRST_PLACES << (STEPS - 1)
        );
    }

    /// Decides whatever the contract leaves open: where numbers on irrational axes agree in
    /// thousands of bits and differ, by what they are.
    pub fn until_the_last_bit(mut self) -> Self {
        self.contract_bits = i64::MAX / 2;
        self
    }

    /// The first sphere of the same numbers.
    fn original(&self, sphere: usize) -> usize {
        if self.first.binary_search_by_key(&sphere, |f| f.0).is_ok() {
            return sphere;
        }
        let numbers = self.spheres[sphere];
        self.first
            .iter()
            .map(|f| f.0)
            .find(|&k| self.spheres[k] == numbers)
            .expect("it is kept once")
    }

    // ---- The contract's formulas, for any interval ----

    /// Right, up and forward with so many places (step 0 has the fewest).
    fn axes(&self, step: usize) -> &Axes<Fixed> {
        self.axes[step].get_or_init(|| {
            let places = FIRST_PLACES << step;
            let unit = |v: &[Fixed; 3]| -> [Fixed; 3] {
                let length = dot(v, v).root();
                [&v[0], &v[1], &v[2]].map(|x| x.over(&length))
            };
            // Whole vectors are exact at any number of places, and at least 1 long; so are their
            // products.
            let d = self.view.each_ref().map(|x| Fixed::whole(x, places));
            let up = self.up.each_ref().map(|x| Fixed::whole(x, places));
            let back = unit(&d).map(|x| Fixed::exact(0.0, places).minus(&x));
            // up x w points as up x (-d) = d x up does.
            let right = unit(&cross(&d, &up));
            let upwards = cross(&back, &right);
            [right, upwards, unit(&d)]
        })
    }

    /// A sphere from where the camera is.
    fn seen<R: Real>(&self, sphere: usize, axes: &Axes<R>, places: R::Places) -> Seen<R> {
        let (center, radius) = self.spheres[sphere];
        let away =
            [0, 1, 2].map(|k| R::exact(center[k], places).minus(&R::exact(self.origin[k], places)));
        Seen {
            center: axes.each_ref().map(|axis| dot(axis, &away)),
            radius: R::exact(radius, places),
        }
    }

    /// The screen point of a column (side 0) or row (side 1).
    fn screen<R: Real>(&self, side: usize, index: u32, places: R::Places) -> R {
        let (length, divisor, pixels) = self.sides[side];
        // ((i + 1/2) / n - 1/2) length = (2 i + 1 - n) length / (2 n); rows run downwards.
        let odd = 2 * i64::from(index) + 1 - i64::from(pixels);
        R::offset(if side == 0 { odd } else { -odd }, length, divisor, places)
    }

    fn ray<R: Real>(&self, column: u32, row: u32, places: R::Places) -> Ray<R> {
        let screen: [R; 2] = [self.screen(0, column, places), self.screen(1, row, places)];
        let one = R::exact(1.0, places);
        let square = if self.perspective {
            one.plus(&screen[0].square()).plus(&screen[1].square())
        } else {
            one
        };
        Ray { screen, square }
    }

    /// `|p + t dir - c|^2 = r^2` for a direction whose depth is 1: the middle of the crossings and
    /// half the chord squared. The chord is `|dir|^2 r^2 - |dir x (c - p)|^2`, where the second
    /// part is the squared distance of centre and line.
    fn crossing<R: Real>(&self, ray: &Ray<R>, seen: &Seen<R>) -> Crossing<R> {
        let [x, y, z] = &seen.center;
        let [sx, sy] = &ray.screen;
        if self.perspective {
            let a = sy.times(z).minus(y);
            let b = x.minus(&sx.times(z));
            let c = sx.times(y).minus(&sy.times(x));
            let apart = a.square().plus(&b.square()).plus(&c.square());
            Crossing {
                middle: sx.times(x).plus(&sy.times(y)).plus(z),
                chord: ray.square.times(&seen.radius.square()).minus(&apart),
            }
        } else {
            let apart = x.minus(sx).square().plus(&y.minus(sy).square());
            Crossing { middle: z.clone(), chord: seen.radius.square().minus(&apart) }
        }
    }

    /// How far a sphere's centre is from the plane of a row's (or column's) rays, against its
    /// radius: certainly farther?
    fn clear_of<R: Real>(&self, side: usize, at: &R, seen: &Seen<R>, places: R::Places) -> bool {
        let one = R::exact(1.0, places);
        let (apart, square) = if self.perspective {
            (seen.center[side].minus(&at.times(&seen.center[2])), one.plus(&at.square()))
        } else {
            (seen.center[side].minus(at), one)
        };
        square.times(&seen.radius.square()).minus(&apart.square()).negative()
    }

    // ---- Quick ----

    /// The spheres that the rays of a row may meet, as places in `first`.
    fn in_row(&self, row: u32) -> Vec<usize> {
        let at: Rough = self.screen(1, row, ());
        (0..self.first.len()).filter(|&k| !self.clear_of(1, &at, &self.first[k].1, ())).collect()
    }

    /// What quick intervals say.
    fn guess(&self, ray: &Ray<Rough>, near: &Rough, far: &Rough, seen: &Seen<Rough>) -> Guess {
        let crossing = self.crossing(ray, seen);
        if crossing.chord.negative() {
            return Guess::Never;
        }
        let (first, second) = (crossing.at(Root::Near), crossing.at(Root::Far));
        let before = |t: &Rough, plane: &Rough| t.high < plane.low;
        let within = |t: &Rough| t.low >= near.high && t.high <= far.low;
        if before(&second, near) || before(far, &first) {
            return Guess::Never;
        }
        let cut = before(&first, near);
        if cut && before(far, &second) {
            return Guess::Never;
        }
        let least = if cut { second.low } else { first.low };
        let certain = crossing.chord.low >= 0.0;
        let most = if certain && within(&first) {
            first.high
        } else if certain && cut && within(&second) {
            second.high
        } else {
            f64::INFINITY
        };
        Guess::Maybe { least, most }
    }

    fn nearest(&self, column: u32, row: u32, candidates: &[usize]) -> i32 {
        let ray: Ray<Rough> = self.ray(column, row, ());
        let near = Rough::exact(self.near, ()).times(&ray.square);
        let far = if self.far.is_finite() {
            Rough::exact(self.far, ()).times(&ray.square)
        } else {
            // No finite number is beyond it.
            Rough { low: f64::INFINITY, high: f64::INFINITY }
        };
        let mut most = f64::INFINITY;
        let mut possible = Vec::new();
        for &k in candidates {
            let (sphere, seen) = &self.first[k];
            if self.clear_of(0, &ray.screen[0], seen, ()) {
                continue;
            }
            if let Guess::Maybe { least, most: by } = self.guess(&ray, &near, &far, seen) {
                possible.push((*sphere, least));
                most = most.min(by);
            }
        }
        self.effort.pairs.fetch_add(candidates.len() as u64, Order::Relaxed);
        // In the order of indices: a later sphere has to be strictly nearer.
        let mut best: Option<Hit> = None;
        possible.retain(|&(_, least)| least <= most);
        let alone = possible.len() == 1 && most < f64::INFINITY;
        if alone {
            return possible[0].0 as i32;
        }
        for (sphere, _) in possible {
            let Some(hit) = self.hit(column, row, sphere) else { continue };
            if best.is_none_or(|best| self.compare(column, row, hit, best) == Ordering::Less) {
                best = Some(hit);
            }
        }
        best.map_or(-1, |hit| hit.sphere as i32)
    }

    // ---- Certain ----

    /// The sign of what `quantity` computes: first by quick intervals, then with more and more
    /// places. `size` bounds it, and `values` is how many values it takes when the signs of roots
    /// change.
    fn sign(
        &self,
        column: u32,
        row: u32,
        size: Size,
        values: i64,
        rough: Option<Ordering>,
        quantity: impl Fn(&Ray<Fixed>, usize) -> Fixed,
    ) -> Ordering {
        if let Some(sign) = rough {
            return sign;
        }
        self.effort.signs.fetch_add(1, Order::Relaxed);
        let separation = size.separation(values);
        for step in 0..STEPS {
            let places = FIRST_PLACES << step;
            let value = quantity(&self.ray(column, row, places), step);
            match value.sign() {
                Some(Ordering::Equal) => {
                    self.effort.zeros.fetch_add(1, Order::Relaxed);
                    return Ordering::Equal;
                }
                Some(sign) => {
                    assert!(
                        self.setting.degree == 1 || !value.within(size.bound - self.contract_bits),
                        "pixel ({column}, {row}): two quantities agree in {CONTRACT_BITS} bits \
                         and differ; the contract does not say which is less, so this scene is no \
                         test"
                    );
                    return sign;
                }
                None if value.within(-separation) => {
                    self.effort.zeros.fetch_add(1, Order::Relaxed);
                    return Ordering::Equal;
                }
                None => {}
            }
        }
        panic!(
            "pixel ({column}, {row}): {} places do not decide, {separation} would",
            FIRST_PLACES << (STEPS - 1)
        );
    }

    fn crossing_at(&self, ray: &Ray<Fixed>, sphere: usize, step: usize) -> Crossing<Fixed> {
        self.crossing(ray, &self.seen(sphere, self.axes(step), FIRST_PLACES << step))
    }

    fn body(&self, sphere: usize) -> Body {
        let (center, radius) = self.spheres[sphere];
        Body::new(center, radius)
    }

    /// Quick intervals of a sphere's crossing.
    fn rough_crossing(&self, ray: &Ray<Rough>, sphere: usize) -> Crossing<Rough> {
        let k = self
            .first
            .binary_search_by_key(&sphere, |f| f.0)
            .expect("only first ones are asked for");
        self.crossing(ray, &self.first[k].1)
    }

    /// Where a sphere is seen at a pixel, if it is.
    fn hit(&self, column: u32, row: u32, sphere: usize) -> Option<Hit> {
        let ray: Ray<Rough> = self.ray(column, row, ());
        let rough = self.rough_crossing(&ray, sphere);
        let body = self.body(sphere);
        let (degree, depth) = (self.setting.degree, self.setting.depth(&[body]));
        let chord = self.sign(
            column,
            row,
            self.setting.chord(body),
            degree,
            rough.chord.sign(),
            |ray, step| self.crossing_at(ray, sphere, step).chord,
        );
        if chord == Ordering::Less {
            return None;
        }
        // A crossing against a clip plane.
        let against = |root: Root, plane: f64| {
            if plane == f64::INFINITY {
                return Ordering::Less;
            }
            let quick = rough.at(root).minus(&Rough::exact(plane, ()).times(&ray.square)).sign();
            self.sign(column, row, depth, 2 * degree, quick, |ray, step| {
                let plane = Fixed::exact(plane, FIRST_PLACES << step).times(&ray.square);
                self.crossing_at(ray, sphere, step).at(root).minus(&plane)
            })
        };
        let root =
            if against(Root::Near, self.near) == Ordering::Less { Root::Far } else { Root::Near };
        let seen = (root == Root::Near || against(root, self.near) != Ordering::Less)
            && against(root, self.far) != Ordering::Greater;
        seen.then_some(Hit { sphere, root })
    }

    /// The order of two hits along a ray.
    fn compare(&self, column: u32, row: u32, a: Hit, b: Hit) -> Ordering {
        let ray: Ray<Rough> = self.ray(column, row, ());
        let quick = self
            .rough_crossing(&ray, a.sphere)
            .at(a.root)
            .minus(&self.rough_crossing(&ray, b.sphere).at(b.root));
        let size = self.setting.depth(&[self.body(a.sphere), self.body(b.sphere)]);
        self.sign(column, row, size, 4 * self.setting.degree, quick.sign(), |ray, step| {
            self.crossing_at(ray, a.sphere, step)
                .at(a.root)
                .minus(&self.crossing_at(ray, b.sphere, step).at(b.root))
        })
    }
}
