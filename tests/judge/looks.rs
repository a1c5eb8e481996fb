//! The judge's picture of a look, from the contract's text and nothing else: samples, also those
//! beyond the border, their levels, the edges between them, and whole numbers from there on.

use std::{cmp::Ordering, collections::HashMap};

use dashu_int::IBig;
use planisphere_core::{
    camera::{Region, View},
    scene::Scene,
};
use rayon::prelude::*;

use super::{
    Hit, Judge,
    interval::{Fixed, split},
    levels::Place,
    srgb,
};

/// How a sphere's colour is shaded.
#[derive(Clone, Debug)]
pub enum Shade {
    /// As it is: flat, and illustrative.
    Flat,
    /// By the headlight.
    Matte {
        /// The ambient part, 0 to 255.
        ambient: u32,
    },
    /// By openness.
    Soft {
        /// 0 to 255.
        strength: u32,
        /// For each sphere.
        openness: Vec<u8>,
    },
}

/// Which spheres have an edge between them, beside those with a jump.
#[derive(Clone, Debug)]
pub enum By {
    /// No others.
    Jump,
    /// All that differ.
    Sphere,
    /// Those that differ in a column.
    Groups(Vec<i64>),
}

/// Lines around what is seen.
#[derive(Clone, Debug)]
pub struct Outline {
    /// In pixels.
    pub width: f64,
    /// A length; without one it is the radius of the nearer sphere.
    pub jump: Option<f64>,
    /// What else has an edge.
    pub by: By,
    /// Of the line.
    pub color: [u8; 3],
}

/// All that makes a picture of a scene and a view.
#[derive(Clone, Debug)]
pub struct Wanted {
    /// Samples on each side of a pixel.
    pub aa: u32,
    /// Whether bytes are averaged, and not light.
    pub encoded: bool,
    /// How a sphere is shaded.
    pub shade: Shade,
    /// The depths between which colours fade into the background's.
    pub cue: Option<[f64; 2]>,
    /// Lines.
    pub outline: Option<Outline>,
    /// Where no sphere is.
    pub background: [u8; 3],
    /// Whether the background is left out.
    pub transparent: bool,
}

/// The picture: red, green, blue and alpha of every pixel of a region, row by row from the top.
/// Alpha is 255 if the background is not transparent.
pub fn picture(scene: &Scene, view: &View, region: Region, wanted: &Wanted) -> Vec<[u8; 4]> {
    Samples::new(scene, view, region, &[wanted]).picture(wanted)
}

/// The depths of a cue without any given: from where the box of a scene begins, along the view.
/// None where the view direction's nearest f64 are not certain.
pub fn along(scene: &Scene, view: &View) -> Option<[f64; 2]> {
    let judge = Judge::new(scene, view);
    let [x, y, z] = judge.axes(2)[2].each_ref().map(Fixed::nearest);
    let forward = [x?, y?, z?];
    let of = |k: usize, better: fn(f64, f64) -> f64| {
        let all = judge.spheres.iter().map(|sphere| sphere.0[k]);
        all.reduce(better).unwrap_or(0.0)
    };
    let ends = [0, 1, 2].map(|k| [of(k, f64::min), of(k, f64::max)]);
    let radius = judge.spheres.iter().map(|sphere| sphere.1).fold(0.0, f64::max);
    let dot = |v: [f64; 3], w: [f64; 3]| v[0] * w[0] + v[1] * w[1] + v[2] * w[2];
    let away = [0, 1, 2].map(|k| 0.5 * ends[k][0] + 0.5 * ends[k][1] - judge.origin[k]);
    let half = ends.map(|[least, most]| 0.5 * most - 0.5 * least);
    let depth = dot(away, forward);
    let reach = dot(half, forward.map(f64::abs)) + radius;
    let [near, far] = [depth - reach, depth + 4.0 * reach];
    let finite = near.is_finite() && far.is_finite();
    Some(if finite { [near, far] } else { [0.0, f64::MAX] })
}

/// How many samples beyond the border an edge that matters may reach.
fn margin(wanted: &Wanted) -> u32 {
    wanted.outline.as_ref().map_or(0, |outline| {
        // Its middle is at most half the width away, its farther sample half a sample more.
        (outline.width * f64::from(wanted.aa) / 2.0).ceil() as u32 + 1
    })
}

/// What is seen at all samples of a region and around it: as much as several looks need.
pub struct Samples {
    judge: Judge,
    colors: Vec<[u8; 3]>,
    region: Region,
    /// Samples on each side of a pixel.
    aa: u32,
    /// Samples on each side of the region.
    margin: u32,
    columns: u32,
    rows: u32,
    hits: Vec<Option<Hit>>,
}

/// Two samples with an edge between them. The second is right of the first, or below it.
struct Edge {
    first: Place,
    second: Place,
    /// Whether the first is the nearer.
    first_nearer: bool,
}

impl Samples {
    /// For looks with equally many samples a pixel.
    pub fn new(scene: &Scene, view: &View, region: Region, looks: &[&Wanted]) -> Self {
        let aa = looks[0].aa;
        assert!(looks.iter().all(|wanted| wanted.aa == aa), "looks with other samples");
        let margin = looks.iter().map(|wanted| margin(wanted)).max().unwrap_or(0);
        let lengths: Vec<f64> = looks
            .iter()
            .flat_map(|wanted| {
                let jump = wanted.outline.as_ref().and_then(|outline| outline.jump);
                wanted.cue.into_iter().flatten().chain(jump)
            })
            .collect();
        let raster = View::sampled(view.camera, view.image, aa, margin);
        let judge = Judge::with_lengths(scene, &raster, &lengths);
        let (columns, rows) = (region.width * aa + 2 * margin, region.height * aa + 2 * margin);
        // The judge counts from the margin's corner, and so do we.
        let (x, y) = (region.x * aa, region.y * aa);
        let hits = judge.hits(x..x + columns, y..y + rows);
        let colors = (0..scene.len()).map(|k| scene.sphere(k).unwrap().color).collect();
        Self { judge, colors, region, aa, margin, columns, rows, hits }
    }

    /// What is seen at a sample; columns and rows begin in the margin.
    fn hit(&self, (column, row): Place) -> Option<Hit> {
        self.hits[(row * self.columns + column) as usize]
    }

    /// Where the judge has a sample.
    fn judged(&self, (column, row): Place) -> Place {
        (self.region.x * self.aa + column, self.region.y * self.aa + row)
    }

    /// The picture of a look.
    pub fn picture(&self, wanted: &Wanted) -> Vec<[u8; 4]> {
        assert!(wanted.aa == self.aa && margin(wanted) <= self.margin, "{wanted:?}");
        let lined = wanted.outline.as_ref().map(|outline| self.lined(outline));
        let order = order(self.aa);
        (0..self.region.height)
            .into_par_iter()
            .flat_map_iter(|row| {
                let pixel = |column| self.pixel((column, row), wanted, lined.as_deref(), &order);
                (0..self.region.width).map(pixel).collect::<Vec<_>>()
            })
            .collect()
    }

    /// One pixel, from its samples.
    fn pixel(
        &self,
        (column, row): Place,
        wanted: &Wanted,
        lined: Option<&[bool]>,
        order: &[Place],
    ) -> [u8; 4] {
        let corner = (column * self.aa + self.margin, row * self.aa + self.margin);
        // Of each sphere, its colour at the first of its samples in that order.
        let mut shaded: HashMap<usize, [u32; 3]> = HashMap::new();
        let mut covered = Vec::new();
        for &(i, j) in order {
            let place = (corner.0 + i, corner.1 + j);
            let color = self.hit(place).map(|hit| {
                *shaded.entry(hit.sphere).or_insert_with(|| self.shaded(place, hit, wanted))
            });
            let on_line = lined.is_some_and(|on| on[(place.1 * self.columns + place.0) as usize]);
            match &wanted.outline {
                Some(outline) if on_line => covered.push(outline.color.map(srgb::linear)),
                _ => covered.extend(color),
            }
        }
        let all = (self.aa * self.aa) as usize;
        let (k, background) = (covered.len(), wanted.background.map(srgb::linear));
        if wanted.transparent {
            let [red, green, blue] =
                if k == 0 { wanted.background } else { mean(&covered, wanted.encoded) };
            // floor(255 k / all + 1/2)
            return [red, green, blue, ((510 * k + all) / (2 * all)) as u8];
        }
        covered.resize(all, background);
        let [red, green, blue] = mean(&covered, wanted.encoded);
        [red, green, blue, 255]
    }

    /// The linear values of a sphere that is shaded at a sample.
    fn shaded(&self, place: Place, hit: Hit, wanted: &Wanted) -> [u32; 3] {
        let place = self.judged(place);
        let full = 255 * 255;
        let factor = match &wanted.shade {
            Shade::Flat => full,
            Shade::Matte { ambient } => {
                let level = self.judge.light(place, hit);
                255 * ambient + (255 - ambient) * ((level * level + 127) / 255)
            }
            Shade::Soft { strength, openness } => {
                full - strength * (255 - u32::from(openness[hit.sphere]))
            }
        };
        let level = wanted.cue.map_or(0, |planes| self.judge.cue(place, hit, planes));
        std::array::from_fn(|channel| {
            let base = srgb::linear(self.colors[hit.sphere][channel]);
            let x = (u64::from(base) * u64::from(factor) + 32512) / 65025;
            let background = u64::from(srgb::linear(wanted.background[channel]));
            let level = u64::from(level);
            ((x * (256 - level) + background * level + 128) / 256) as u32
        })
    }

    // ---- Outlines ----

    /// Which samples are on an outline.
    fn lined(&self, outline: &Outline) -> Vec<bool> {
        let across = |(column, row)| ((column, row), (column + 1, row));
        let down = |(column, row)| ((column, row), (column, row + 1));
        let edges: Vec<Edge> = (0..self.rows)
            .into_par_iter()
            .flat_map_iter(|row| {
                (0..self.columns)
                    .flat_map(|column| [across((column, row)), down((column, row))])
                    .filter(|&(_, (column, row))| column < self.columns && row < self.rows)
                    .filter_map(|(first, second)| self.edge(first, second, outline))
                    .collect::<Vec<_>>()
            })
            .collect();
        let width = Width::new(outline.width, self.aa);
        let mut on = vec![false; self.hits.len()];
        for edge in &edges {
            self.draw(edge, &width, &mut on);
        }
        on
    }

    /// The edge between two samples side by side, if there is one.
    fn edge(&self, first: Place, second: Place, outline: &Outline) -> Option<Edge> {
        let edge = |first_nearer| Some(Edge { first, second, first_nearer });
        let (a, b) = match (self.hit(first), self.hit(second)) {
            (None, None) => return None,
            (Some(_), None) => return edge(true),
            (None, Some(_)) => return edge(false),
            (Some(a), Some(b)) => (a, b),
        };
        if a.sphere == b.sphere {
            return None;
        }
        let (a, b) = ((self.judged(first), a), (self.judged(second), b));
        let first_nearer = match self.judge.gap(a, b, 0.0) {
            Ordering::Greater => true,
            Ordering::Less => false,
            Ordering::Equal => a.1.sphere < b.1.sphere,
        };
        let asked = match &outline.by {
            By::Jump => false,
            By::Sphere => true,
            By::Groups(groups) => groups[a.1.sphere] != groups[b.1.sphere],
        };
        let (nearer, farther) = if first_nearer { (a, b) } else { (b, a) };
        let jump = outline.jump.unwrap_or(self.judge.spheres[nearer.1.sphere].1);
        if asked || self.judge.gap(nearer, farther, jump) == Ordering::Greater {
            edge(first_nearer)
        } else {
            None
        }
    }

    /// Puts the samples near an edge on the outline.
    fn draw(&self, edge: &Edge, width: &Width, on: &mut [bool]) {
        let (first, second) = (edge.first, edge.second);
        let across = first.1 == second.1;
        let near = |from: u32, to: u32, end: u32| {
            from.saturating_sub(self.margin)..(to + self.margin + 1).min(end)
        };
        for row in near(first.1, second.1, self.rows) {
            for column in near(first.0, second.0, self.columns) {
                // From the middle, in halves of a sample.
                let apart = |at: u32, a: u32, b: u32| 2 * i64::from(at) - i64::from(a + b);
                let [x, y] = [apart(column, first.0, second.0), apart(row, first.1, second.1)];
                // How far on the second's side, which an odd number decides.
                let on_first = if across { x < 0 } else { y < 0 };
                let order = width.order((x * x + y * y).unsigned_abs());
                if order == Ordering::Less
                    || order == Ordering::Equal && on_first == edge.first_nearer
                {
                    on[(row * self.columns + column) as usize] = true;
                }
            }
        }
    }
}

/// The square of a line's width in samples, `top 2^power`.
struct Width {
    top: IBig,
    power: i32,
}

impl Width {
    fn new(width: f64, aa: u32) -> Self {
        let (mantissa, exponent) = split(width);
        let top = IBig::from(mantissa) * IBig::from(aa);
        Self { top: &top * &top, power: 2 * exponent }
    }

    /// How a whole number compares with it.
    fn order(&self, value: u64) -> Ordering {
        let value = IBig::from(value);
        let shift = self.power.unsigned_abs() as usize;
        if self.power < 0 {
            (value << shift).cmp(&self.top)
        } else {
            value.cmp(&(&self.top << shift))
        }
    }
}

/// The samples of a pixel from its middle outwards; of several as near the lowest row, then column.
fn order(n: u32) -> Vec<Place> {
    let mut order: Vec<Place> = (0..n * n).map(|k| (k % n, k / n)).collect();
    order.sort_by_key(|&(i, j)| {
        let apart = |i: u32| (2 * i64::from(i) + 1 - i64::from(n)).pow(2);
        (apart(i) + apart(j), j, i)
    });
    order
}

/// The mean of samples in bytes.
fn mean(samples: &[[u32; 3]], encoded: bool) -> [u8; 3] {
    let k = samples.len();
    std::array::from_fn(|channel| {
        let values = samples.iter().map(|sample| sample[channel]);
        if encoded {
            let sum: usize = values.map(|value| usize::from(srgb::byte(value, 1))).sum();
            ((2 * sum + k) / (2 * k)) as u8
        } else {
            srgb::byte(values.sum(), k)
        }
    })
}
