//! What looks ask of hits, as integers: f64 with bounds first, and where these leave it open,
//! [`crate::exact::levels`].
//!
//! Ids come from a picture of the view, so that every sphere that is asked for is hit at its
//! sample.
//!
//! **Bounds of the headlight level.** `v = 65536 q / (a r^2)` is the square of 256 times the
//! cosine. With `q` within `E` (lemma F1 of docs/numerics.md) it is within
//! `65536 E / (a r^2) + 8 u v`: `r` is exact, its square, `a` within `3 u`, the quotients and the
//! product round once each. `E` is taken a thousandth larger, and `16 u` for `8 u`. `a >= 1`.

use crate::{
    camera::Projection,
    depth::{Lens, Line, Shown},
    exact::decide::{Hit, Tally, Truth},
    exact::levels::{CUES, LEVELS},
    filter::length,
    float::U,
    scene::{Ball, Scene},
    simd::{self, LANES, Lanes},
};

/// Squares are used inside of these, where nothing is subnormal and nothing overflows.
const USED: [f64; 2] = [1e-250, 1e250];

/// Levels of the hits of a view.
pub struct Levels<'a> {
    scene: &'a Scene,
    truth: &'a Truth,
    lens: Lens,
}

/// A sphere that is shaded.
#[derive(Clone, Copy)]
pub struct Lit {
    /// Its centre and radius.
    pub ball: Ball,
    shown: Shown,
    /// `65536 / r^2`.
    unit: f64,
    /// `65536 E / r^2`; infinite where nothing is certain.
    doubt: f64,
}

/// A sample of the raster: column and row.
pub type Sample = [u32; 2];

impl<'a> Levels<'a> {
    /// Of a view of a scene.
    pub fn new(scene: &'a Scene, truth: &'a Truth) -> Self {
        Self { scene, truth, lens: Lens::new(truth) }
    }

    /// A hint that a sphere is soon to be asked for.
    #[inline(always)]
    pub fn prefetch(&self, index: usize) {
        let (block, at) = self.scene.locate(index);
        block.prefetch(at);
        block.prefetch_color(at);
    }

    /// A sphere of the scene; none of what is no index.
    pub fn sphere(&self, index: usize) -> Option<Lit> {
        let ball = Ball::from(self.scene.sphere(index)?);
        let shown = self.lens.sphere(ball);
        let (r, whole) = (shown.sphere.r, f64::from(LEVELS * LEVELS));
        let (square, unit) = (r * r, whole / (r * r));
        let usable = square > USED[0] && square < USED[1];
        let doubt = if usable { 1.001 * shown.margins.doubt * unit } else { f64::INFINITY };
        Some(Lit { ball, shown, unit, doubt })
    }

    /// The headlight levels of a sphere at samples of a row: at the first column, and every
    /// `stride` columns on.
    pub fn headlights(&self, lit: &Lit, [first, row]: Sample, stride: u32, levels: &mut [u8]) {
        let line = self.lens.line(&lit.shown, row);
        let work = Headlights { of: self, lit, line, first, row, stride, levels };
        match self.lens.projector().projection {
            Projection::Orthographic => simd::dispatch(Along::<false>(work)),
            Projection::Perspective => simd::dispatch(Along::<true>(work)),
        }
    }

    /// The cue level of a sphere's hit at a sample, between two depths.
    pub fn cue(&self, lit: &Lit, at: Sample, [near, far]: [f64; 2]) -> u16 {
        let whole = far - near;
        let steps = |distance: f64| (distance - near) / whole * f64::from(CUES);
        let sure = self.bounds(lit, at).and_then(|[low, high]| {
            let [low, high] = [low, high].map(steps);
            let [low, high] = [low - 8.0 * U * low.abs(), high + 8.0 * U * high.abs()];
            let [low, high] = [low, high].map(|steps| steps.floor().clamp(0.0, CUES.into()));
            // NaN is not the same.
            (low == high && whole < f64::MAX && whole > f64::MIN_POSITIVE).then_some(low as u16)
        });
        sure.unwrap_or_else(|| {
            let pixel = self.truth.pixel(at[0], at[1]);
            pixel.cue(&self.hit(lit, at), [near, far], &mut Tally::default())
        })
    }

    /// Whether a hit here is nearer than one at another sample (of equal distances if `first`),
    /// and whether the two distances differ by more than a length, which depends on the nearer.
    pub fn step(
        &self,
        here: (&Lit, Sample),
        there: (&Lit, Sample),
        first: bool,
        by: impl FnOnce(&Lit) -> f64,
    ) -> (bool, bool) {
        let apart = self.apart(here, there);
        let nearer = match apart {
            Some([least, _]) if least > 0.0 => true,
            Some([_, most]) if most < 0.0 => false,
            _ => match self.farther(here, there, 0.0) {
                0 => first,
                sign => sign > 0,
            },
        };
        let (near, far) = if nearer { (here, there) } else { (there, here) };
        let by = by(near.0);
        let jumps =
            match apart.map(|[least, most]| if nearer { [least, most] } else { [-most, -least] }) {
                Some([least, _]) if least > by => true,
                Some([_, most]) if most <= by => false,
                _ => self.farther(near, far, by) > 0,
            };
        (nearer, jumps)
    }

    /// Bounds of the difference of two distances.
    fn apart(&self, one: (&Lit, Sample), two: (&Lit, Sample)) -> Option<[f64; 2]> {
        let (one, two) = (self.bounds(one.0, one.1)?, self.bounds(two.0, two.1)?);
        let (least, most) = (two[0] - one[1], two[1] - one[0]);
        Some([least - 4.0 * U * least.abs(), most + 4.0 * U * most.abs()])
    }

    /// The sign of the difference of two distances less a length, exactly.
    #[cold]
    fn farther(&self, (lit, at): (&Lit, Sample), (to, there): (&Lit, Sample), by: f64) -> i32 {
        let (hit, other) = (self.hit(lit, at), self.hit(to, there));
        let here = self.truth.pixel(at[0], at[1]);
        let there = self.truth.pixel(there[0], there[1]);
        here.farther(&hit, (&there, &other), by, &mut Tally::default())
    }

    /// Bounds of the distance of a hit, in world units, where the filter has any.
    fn bounds(&self, lit: &Lit, [column, row]: Sample) -> Option<[f64; 2]> {
        self.lens.bounds(&self.lens.line(&lit.shown, row), column, row)
    }

    /// The hit of a sphere that is seen at a sample.
    fn hit(&self, lit: &Lit, [column, row]: Sample) -> Hit {
        let hit = self.truth.pixel(column, row).hit(lit.ball, &mut Tally::default());
        hit.expect("the ids are of this view of this scene")
    }

    /// A headlight level that the filter leaves open.
    #[cold]
    #[inline(never)]
    fn settle(&self, lit: &Lit, [column, row]: Sample) -> u8 {
        self.truth.pixel(column, row).headlight(lit.ball, &mut Tally::default())
    }
}

/// Headlight levels along a row.
struct Headlights<'a, 'b> {
    of: &'b Levels<'a>,
    lit: &'b Lit,
    line: Line,
    first: u32,
    row: u32,
    stride: u32,
    levels: &'b mut [u8],
}

/// The same for one projection.
struct Along<'a, 'b, const PERSPECTIVE: bool>(Headlights<'a, 'b>);

impl<const PERSPECTIVE: bool> simd::Work for Along<'_, '_, PERSPECTIVE> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Headlights { of, lit, line, first, row, stride, levels } = self.0;
        let columns = &of.lens.projector().columns;
        let sy = of.lens.projector().rows[row as usize];
        let mut from = first;
        for levels in levels.chunks_mut(LANES) {
            let mut sx = [0.0; LANES];
            for (k, sx) in (0..).zip(sx.iter_mut().take(levels.len())) {
                *sx = columns[(from + k * stride) as usize];
            }
            let sx = L::load(&sx);
            let q = line.row.meet::<L, PERSPECTIVE>(sx).0.mul(L::splat(lit.unit));
            let v = if PERSPECTIVE { q.div(length(sx, sy)) } else { q };
            let root = v.max(L::splat(0.0)).sqrt();
            let (mut squares, mut roots) = ([0.0; LANES], [0.0; LANES]);
            v.store(&mut squares);
            root.store(&mut roots);
            // Of fixed length, for the compiler to make vectors of.
            let (mut found, mut sure) = ([0.0; LANES], [false; LANES]);
            let most = f64::from(LEVELS - 1);
            for k in 0..LANES {
                let (v, level) = (squares[k], roots[k].min(most).floor());
                let doubt = lit.doubt + 16.0 * U * v.abs();
                let reached = (level == 0.0) | (v - doubt >= level * level);
                let no_more = (level == most) | (v + doubt < (level + 1.0) * (level + 1.0));
                // NaN is neither, unless it became 0 above, and then it is not below 1.
                (found[k], sure[k]) = (level, reached & no_more);
            }
            let mut open = 0u32;
            for (k, level) in levels.iter_mut().enumerate() {
                *level = found[k] as u8;
                open |= u32::from(!sure[k]) << k;
            }
            while open != 0 {
                let k = open.trailing_zeros();
                open &= open - 1;
                levels[k as usize] = of.settle(lit, [from + k * stride, row]);
            }
            from += levels.len() as u32 * stride;
        }
    }
}
