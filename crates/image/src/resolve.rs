//! Samples become pixels: shading, lines, and the mean of a pixel's samples, by the rules of
//! docs/contract.md.
//!
//! A pixel whose samples are all of one sphere and not on a line is the usual case: runs of these
//! are shaded many at a time. Any other pixel is looked at sample by sample.

use std::fmt;

use rayon::prelude::*;

use planisphere_core::{
    camera::{Region, View},
    depth::PlaneError,
    exact::decide::Truth,
    ids::NONE,
    scene::Scene,
};

use crate::{
    Paint,
    form::{Form, Sum},
    linear::Encoder,
    outline::Lines,
    run,
    shaded::{Cache, Linear, Spheres, linear},
    style::{Space, Style},
};

pub use crate::shaded::Columns;

/// Makes pixels of the samples of a view.
pub struct Resolver<'a> {
    scene: &'a Scene,
    style: &'a Style,
    spheres: Spheres<'a>,
    view: View,
    encoder: Encoder,
    /// Samples of a pixel, the nearest to its middle first.
    order: Vec<[u32; 2]>,
    /// Linear values of lines.
    line: Linear,
}

impl fmt::Debug for Resolver<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Resolver").field("style", self.style).finish_non_exhaustive()
    }
}

/// Pixels whose spheres are fetched ahead.
const AHEAD: usize = 32;

/// Rows of pixels that a thread takes at a time, at least.
const ROWS: usize = 16;

impl<'a> Resolver<'a> {
    /// Of a scene's view of samples, which is [`Style::samples`] of the view of pixels.
    pub fn new(scene: &'a Scene, truth: &'a Truth, style: &'a Style, columns: Columns<'a>) -> Self {
        let n = style.aa;
        let mut order: Vec<[u32; 2]> = (0..n).flat_map(|y| (0..n).map(move |x| [x, y])).collect();
        let square = |k: u32| (2 * k + 1).abs_diff(n).pow(2);
        order.sort_by_key(|&[x, y]| (square(x) + square(y), y, x));
        let line = style.outline.map_or([0; 3], |outline| linear(outline.color));
        let (spheres, view) = (Spheres::new(scene, truth, style, columns), *truth.view());
        Self { scene, style, spheres, view, encoder: Encoder::default(), order, line }
    }

    /// The samples that some pixels need.
    pub fn samples(&self, pixels: Region) -> Region {
        let (n, around) = (self.view.per_pixel, 2 * self.view.margin);
        Region {
            x: pixels.x * n,
            y: pixels.y * n,
            width: pixels.width * n + around,
            height: pixels.height * n + around,
        }
    }

    /// The pixels of a region, in any form. `ids` are those of [`Self::samples`].
    ///
    /// # Errors
    /// When there are not as many ids, or pixels, or an id is none of the scene's spheres.
    pub fn pixels<P: Form>(
        &self,
        pixels: Region,
        ids: &[i32],
        to: &mut [P],
    ) -> Result<(), PlaneError> {
        let region = self.samples(pixels);
        if ids.len() != region.pixels() {
            return Err(PlaneError::Length { ids: ids.len(), region });
        }
        if to.len() != pixels.pixels() {
            return Err(PlaneError::Length { ids: to.len(), region: pixels });
        }
        Paint { scene: self.scene, background: self.style.background }.check(ids)?;
        let lines = self.style.outline.map(|outline| {
            let width = outline.width * f64::from(self.style.aa);
            Lines::new(&outline, width, &self.spheres, region, ids)
        });
        let width = pixels.width as usize;
        let tables = P::tables(&self.encoder);
        let begin = || Rows::<P>::new(self, tables, region, ids, lines.as_ref());
        let rows = to.par_chunks_mut(width).with_min_len(ROWS).enumerate();
        rows.for_each_init(begin, |rows, (row, to)| rows.row(row, to));
        Ok(())
    }

    /// A pixel of no sphere.
    fn empty<P: Form>(&self, tables: P::Tables<'_>) -> P {
        let color = self.spheres.background();
        if self.style.transparent { P::clear(tables, color) } else { P::whole(tables, color) }
    }
}

/// Makes rows of pixels.
struct Rows<'a, 'b, P: Form> {
    of: &'a Resolver<'b>,
    tables: P::Tables<'a>,
    region: Region,
    ids: &'a [i32],
    lines: Option<&'a Lines>,
    cache: Cache<'a>,
    levels: Vec<u8>,
    colors: Vec<Linear>,
    /// The first sample of each pixel of a row.
    first: Vec<i32>,
    /// Not 0 where a pixel's samples differ, or some are on a line.
    mixed: Vec<i32>,
    /// Spheres of a pixel.
    met: Vec<Met>,
}

impl<'a, 'b, P: Form> Rows<'a, 'b, P> {
    fn new(
        of: &'a Resolver<'b>,
        tables: P::Tables<'a>,
        region: Region,
        ids: &'a [i32],
        lines: Option<&'a Lines>,
    ) -> Self {
        let cache = of.spheres.cache();
        let (levels, colors, first) = (Vec::new(), Vec::new(), Vec::new());
        let (mixed, met) = (Vec::new(), Vec::new());
        Self { of, tables, region, ids, lines, cache, levels, colors, first, mixed, met }
    }

    /// A row of pixels, counted from the first of the region.
    fn row(&mut self, row: usize, to: &mut [P]) {
        match self.of.view.per_pixel {
            1 => return self.single(row, to),
            2 => self.compare::<2>(row, to.len()),
            4 => self.compare::<4>(row, to.len()),
            8 => self.compare::<8>(row, to.len()),
            _ => self.compare::<16>(row, to.len()),
        }
        let (mut start, mut soon) = (0, 0);
        while start < to.len() {
            // What comes some runs on is fetched meanwhile.
            while soon < (start + AHEAD).min(to.len()) {
                if soon == 0 || self.first[soon] != self.first[soon - 1] {
                    self.cache.prefetch(self.first[soon]);
                }
                soon += 1;
            }
            let (id, mixed) = (self.first[start], self.mixed[start] != 0);
            let alike = (start + 1..to.len())
                .take_while(|&k| !mixed && self.first[k] == id && self.mixed[k] == 0);
            let end = start + 1 + alike.count();
            let pixels = &mut to[start..end];
            if mixed {
                pixels[0] = self.sum([start, row]);
            } else if id != NONE {
                self.run(id, [start, row], pixels);
            } else {
                pixels.fill(self.of.empty(self.tables));
            }
            start = end;
        }
    }

    /// A row of pixels of one sample each.
    fn single(&mut self, row: usize, to: &mut [P]) {
        let [left, top] = self.corner([0, row]);
        let start = top * self.region.width as usize + left;
        let ids = &self.ids[start..start + to.len()];
        let (mut start, mut soon) = (0, 0);
        while start < to.len() {
            while soon < (start + AHEAD).min(to.len()) {
                self.cache.prefetch(ids[soon]);
                soon += run(ids[soon], &ids[soon..]);
            }
            let id = ids[start];
            let end = start + run(id, &ids[start..]);
            match id {
                NONE => to[start..end].fill(self.of.empty(self.tables)),
                _ => self.run(id, [start, row], &mut to[start..end]),
            }
            start = end;
        }
        let Some(lines) = self.lines else { return };
        let line = P::whole(self.tables, self.of.line);
        lines.each(top, left..left + to.len(), |column| to[column - left] = line);
    }

    /// Column and row, in the region, of the first sample of a pixel.
    #[inline(always)]
    fn corner(&self, [column, row]: [usize; 2]) -> [usize; 2] {
        let View { per_pixel, margin, .. } = self.of.view;
        [column, row].map(|at| at * per_pixel as usize + margin as usize)
    }

    /// Finds out which pixels of a row have samples of several kinds.
    fn compare<const N: usize>(&mut self, row: usize, pixels: usize) {
        let [left, top] = self.corner([0, row]);
        let width = self.region.width as usize;
        let samples = |row: usize| {
            let start = (top + row) * width + left;
            self.ids[start..start + N * pixels].as_chunks::<N>().0
        };
        self.first.clear();
        self.first.extend(samples(0).iter().map(|samples| samples[0]));
        self.mixed.clear();
        self.mixed.resize(pixels, 0);
        for row in 0..N {
            let all = samples(row).iter().zip(&self.first).zip(&mut self.mixed);
            for ((samples, first), mixed) in all {
                *mixed |= samples.iter().fold(0, |mixed, sample| mixed | (sample ^ first));
            }
        }
        let Some(lines) = self.lines else { return };
        let mixed = &mut self.mixed;
        for row in top..top + N {
            lines.each(row, left..left + N * pixels, |column| mixed[(column - left) / N] = 1);
        }
    }

    /// Pixels side by side, all of one sphere.
    fn run(&mut self, id: i32, at: [usize; 2], pixels: &mut [P]) {
        let (of, tables) = (self.of, self.tables);
        let count = if self.cache.is_even() { 1 } else { pixels.len() };
        self.colors.clear();
        self.colors.resize(count, [0; 3]);
        let [x, y] = self.sample(self.corner(at), of.order[0]);
        let stride = of.view.per_pixel;
        self.cache.colors(id, [x, y], stride, &mut self.levels, &mut self.colors);
        match *self.colors {
            [color] => pixels.fill(P::whole(tables, color)),
            _ => {
                for (to, &color) in pixels.iter_mut().zip(&self.colors) {
                    *to = P::whole(tables, color);
                }
            }
        }
    }

    /// Column and row, in the raster, of a sample of a pixel.
    fn sample(&self, corner: [usize; 2], [x, y]: [u32; 2]) -> [u32; 2] {
        [self.region.x + corner[0] as u32 + x, self.region.y + corner[1] as u32 + y]
    }

    /// A pixel of several kinds of samples.
    fn sum(&mut self, at: [usize; 2]) -> P {
        let (of, corner) = (self.of, self.corner(at));
        let (mut lines, mut none) = (0, 0);
        self.met.clear();
        for &place in &of.order {
            let [column, row] = [corner[0] + place[0] as usize, corner[1] + place[1] as usize];
            let seen = !self.lines.is_some_and(|lines| lines.has(column, row));
            let id = self.ids[row * self.region.width as usize + column];
            lines += u32::from(!seen);
            if id == NONE {
                none += u32::from(seen);
                continue;
            }
            match self.met.iter_mut().find(|met| met.id == id) {
                Some(met) => met.count += u32::from(seen),
                None => self.met.push(Met { id, count: seen.into(), nearest: place }),
            }
        }
        let (met, mut colors) = (std::mem::take(&mut self.met), std::mem::take(&mut self.colors));
        colors.clear();
        for &Met { id, count, nearest } in &met {
            let mut color = [[0; 3]];
            if count > 0 {
                let at = self.sample(corner, nearest);
                self.cache.colors(id, at, 1, &mut self.levels, &mut color);
            }
            colors.extend(color);
        }
        let covered = met.iter().map(|met| met.count).zip(colors.iter().copied());
        let pixel = of.mean(self.tables, covered.chain([(lines, of.line)]), none);
        (self.met, self.colors) = (met, colors);
        pixel
    }
}

/// A sphere that is seen in a pixel.
#[derive(Clone, Copy)]
struct Met {
    id: i32,
    /// Samples of it that are not on a line.
    count: u32,
    /// The sample of it that is nearest the pixel's middle.
    nearest: [u32; 2],
}

impl Resolver<'_> {
    /// The mean of so many samples of some colours, and of some that are of no sphere.
    fn mean<P: Form>(
        &self,
        tables: P::Tables<'_>,
        covered: impl Iterator<Item = (u32, Linear)>,
        none: u32,
    ) -> P {
        let Style { transparent, space, .. } = *self.style;
        let behind = (!transparent).then(|| (none, self.spheres.background()));
        let (mut count, mut sum) = (0, [0; 3]);
        for (samples, color) in covered.chain(behind) {
            count += samples;
            for (sum, value) in sum.iter_mut().zip(color) {
                *sum += samples
                    * match space {
                        Space::Linear => value,
                        Space::Encoded => P::encoded(tables, value),
                    };
            }
        }
        if count == 0 {
            return self.empty(tables);
        }
        let all = if transparent { count + none } else { count };
        let samples = Sum { sum, count, all };
        match space {
            Space::Linear => P::mean(tables, samples),
            Space::Encoded => P::mean_encoded(tables, samples),
        }
    }
}
