//! The pixels of a tile, and one sphere against them in f64: the loop of both devices.
//!
//! A tile keeps, for every pixel, the nearest sphere so far and an interval that certainly holds
//! its depth. A sphere's test at a pixel ends in one of three ways: certainly behind or a miss;
//! certainly in front; or in doubt, and then [`crate::exact`] decides at once between it and the
//! holder. So the holder is exact at all times, in any order of spheres.
//!
//! The bounds are derived in [`crate::filter`]. Which spheres come, and in which order, is the
//! devices' matter.

use std::{marker::PhantomData, ops::Range};

use crate::{
    camera::Projection,
    cover::BLOCK,
    drawing::Control,
    exact::decide::{Hit, Root, Tally, Truth},
    filter::{BACK, Look, Margins, Row, length},
    ids::{NONE, SphereIndex},
    pair::Pair,
    project::Projector,
    projected::Projected,
    scene::{Ball, Scene},
    simd::{self, LANES, Lanes},
};

/// In the place of a holder: not a pixel to draw.
const CLOSED: i32 = NONE - 1;
/// A bit of a holder's index where it is one of several that may be nearest; closed pixels have it,
/// too.
const OPEN: i32 = i32::MIN;
// `cpu::paint` and the GPU's `decide` tell by the order that neither is a sphere or the background.
const _: () = assert!(CLOSED < NONE && OPEN < NONE && CLOSED & OPEN != 0);

/// What is done with bounds. Only [`Exact`] is used to draw; a benchmark that measures what
/// exactness costs brings modes of its own.
pub trait Mode: Copy + Send + Sync + 'static {
    /// Whether hits and depths have bounds; without, plain comparisons of rounded numbers.
    const BOUNDS: bool;
    /// Whether what the bounds leave open is decided; without, such pixels are
    /// [`crate::ids::UNDECIDED`].
    const DECIDES: bool;
}

/// As the devices draw.
#[derive(Clone, Copy)]
pub struct Exact;

impl Mode for Exact {
    const BOUNDS: bool = true;
    const DECIDES: bool = true;
}

/// No bounds at all, for `bench`.
const PLAIN: Margins = Margins { doubt: 0.0, solid: 0.0, width: 0.0, rim: 0.0 };

/// Work as [`simd::Work`] that is compiled for each projection, too.
pub trait Work {
    /// What comes out.
    type Output;

    /// Does it.
    fn run<L: Lanes, const PERSPECTIVE: bool>(self) -> Self::Output;
}

struct Projecting<W, const PERSPECTIVE: bool>(W);

impl<W: Work, const PERSPECTIVE: bool> simd::Work for Projecting<W, PERSPECTIVE> {
    type Output = W::Output;

    #[inline(always)]
    fn run<L: Lanes>(self) -> W::Output {
        self.0.run::<L, PERSPECTIVE>()
    }
}

/// Does the work.
pub fn dispatch<W: Work>(projection: Projection, work: W) -> W::Output {
    match projection {
        Projection::Orthographic => simd::dispatch(Projecting::<W, false>(work)),
        Projection::Perspective => simd::dispatch(Projecting::<W, true>(work)),
    }
}

/// Where a tile lies, and what tells about its spheres.
pub struct Place<'a, const SIDE: usize> {
    scene: &'a Scene,
    truth: &'a Truth,
    projector: &'a Projector,
    /// First column and row of the region.
    corner: [usize; 2],
    /// On the screen; infinite beyond the region.
    columns: [f64; SIDE],
    rows: [f64; SIDE],
    /// Decisions end when this is cancelled.
    control: Option<&'a Control>,
}

impl<'a, const SIDE: usize> Place<'a, SIDE> {
    /// Of the tile that begins at some column and row of the projector's region.
    #[inline(always)]
    pub fn new(
        scene: &'a Scene,
        truth: &'a Truth,
        projector: &'a Projector,
        corner: [usize; 2],
    ) -> Self {
        let some = |values: &[f64], from: usize| {
            std::array::from_fn(|k| values.get(from + k).copied().unwrap_or(f64::INFINITY))
        };
        let (columns, rows) =
            (some(&projector.columns, corner[0]), some(&projector.rows, corner[1]));
        Self { scene, truth, projector, corner, columns, rows, control: None }
    }

    /// Screen coordinates of its columns and its rows.
    pub fn samples(&self) -> [&[f64; SIDE]; 2] {
        [&self.columns, &self.rows]
    }

    /// A sphere of the scene.
    pub fn ball(&self, index: SphereIndex) -> Ball {
        Ball::from(self.scene.known(index.at()))
    }

    /// Decisions end when this is cancelled, and leave the tile as it is then.
    #[inline(always)]
    pub fn until(self, control: &'a Control) -> Self {
        Self { control: Some(control), ..self }
    }

    /// Whether what is under way is to end.
    #[inline(always)]
    fn is_cancelled(&self) -> bool {
        self.control.is_some_and(Control::is_cancelled)
    }
}

/// The pixels of a tile; `SIDE` is a multiple of [`BLOCK`], which is [`LANES`].
#[repr(align(64))]
#[derive(Clone)]
pub struct Tile<const SIDE: usize> {
    /// Upper bound of the holder's depth, times |dir|^2, in view lengths; infinite for none,
    /// negative infinite where closed.
    high: [[f64; SIDE]; SIDE],
    /// The holder: its [`SphereIndex::id`], or [`NONE`], [`CLOSED`], or with [`OPEN`].
    id: [[i32; SIDE]; SIDE],
    /// No holder's depth is less than its upper bound by more than this.
    slack: f64,
    /// Blocks whose depth may have become less.
    stale: u64,
    /// Rows in which something is to be decided about the sphere at hand; none in between.
    open: u64,
    /// What was decided.
    tally: Tally,
    /// Spheres were met that all but coincide with others.
    crowded: bool,
}

impl<const SIDE: usize> Default for Tile<SIDE> {
    fn default() -> Self {
        let (high, id) = ([[f64::NEG_INFINITY; SIDE]; SIDE], [[CLOSED; SIDE]; SIDE]);
        Self { high, id, slack: 0.0, stale: 0, open: 0, tally: Tally::default(), crowded: false }
    }
}

/// What certainly loses or wins against what is held: the bounds of one sphere, ready for vectors.
struct Test<L> {
    /// `W`; none of what is vague, which is never in front for certain.
    known: f64,
    /// How much larger `b` is in the second row of [`Test::lines`] than in the first: `2.1 W`. The
    /// tenth is for the roundings of the differences and of the square (lemmas T1, T2 of
    /// docs/numerics.md).
    between: f64,
    /// `-E`.
    miss: L,
    /// `rim^2`, the least value that is used for the discriminant: near the silhouette, where hits
    /// are uncertain, `rim` bounds the root and `W` together.
    square: L,
    /// A hit is certain if its root is greater than this. Equals the root of `square` exactly,
    /// because that is far from underflow. Infinite if no hit is certain.
    rim: L,
    /// How much is allowed for the bounds of what is held, and `between`.
    slack: L,
}

impl<L: Lanes> Test<L> {
    /// Nothing is allowed yet; what has `shared` bounds is not vague.
    #[inline(always)]
    fn new(&Margins { doubt, solid, width, rim }: &Margins, shared: bool) -> Self {
        let vague = !shared && solid == f64::INFINITY;
        let known = if vague { 0.0 } else { width };
        // A square that overflows has no root; those of shared bounds do not.
        let told = shared || !(vague || rim > 1e150);
        Self {
            known,
            between: 2.1 * known,
            miss: L::splat(-doubt),
            square: L::splat(rim * rim),
            rim: L::splat(if told { rim } else { f64::INFINITY }),
            slack: L::splat(0.0),
        }
    }

    /// Nothing that is held is nearer than its upper end by more than this.
    #[inline(always)]
    fn allow(&mut self, slack: f64) {
        self.slack = L::splat(slack + self.between);
    }

    /// A row with which `b` is less by `1.1 W`, and one with which it is more by `W`, so that `b -
    /// sqrt q` is an upper end.
    #[inline(always)]
    fn lines<const PERSPECTIVE: bool>(&self, sphere: &Projected, sy: f64) -> [Row; 2] {
        let line = Row::new::<PERSPECTIVE>(sphere, sy);
        [line.lifted(self.known - self.between), line.lifted(self.known)]
    }

    /// Behind what is held for certain: `b - sqrt q - W > high`, or squared, `q < (b - W -
    /// high)^2`, which needs no root. `above` is `b - 1.1 W - high`. Also answers with what to take
    /// the root of.
    #[inline(always)]
    fn loses(&self, q: L, above: L) -> (u8, L) {
        let (ahead, square) = (above.max(L::splat(0.0)), self.square.max(q));
        (q.less(self.miss) | square.less(ahead.mul(ahead)), square)
    }

    /// In front for certain: `b - sqrt q + W < high - slack`. What is NaN is in doubt, and so is
    /// what is hardly solid, whose root is not told here.
    #[inline(always)]
    fn wins(&self, above: L, root: L) -> u8 {
        // The second of a number and NaN.
        self.rim.max(above.add(self.slack)).less(root)
    }

    /// Hit for certain.
    #[inline(always)]
    fn sure(&self, root: L) -> u8 {
        self.rim.less(root)
    }
}

impl<const SIDE: usize> Tile<SIDE> {
    /// Blocks a side.
    pub const BLOCKS: usize = {
        assert!(SIDE.is_multiple_of(BLOCK), "a tile is made of whole blocks, and of whole vectors");
        assert!(SIDE <= u64::BITS as usize, "`open` has a bit for each row");
        let blocks = SIDE / BLOCK;
        assert!(blocks * blocks <= u64::BITS as usize, "`stale` has a bit for each block");
        blocks
    };

    /// Nothing is seen yet in the first columns and rows; beyond them there are no pixels.
    #[inline(always)]
    pub fn clear(&mut self, columns: usize, rows: usize) {
        (self.slack, self.stale) = (0.0, u64::MAX >> (64 - Self::BLOCKS * Self::BLOCKS));
        self.crowded = false;
        for (row, (high, id)) in self.high.iter_mut().zip(&mut self.id).enumerate() {
            let inside = if row < rows { columns } else { 0 };
            high[..inside].fill(f64::INFINITY);
            high[inside..].fill(f64::NEG_INFINITY);
            id[..inside].fill(NONE);
            id[inside..].fill(CLOSED);
        }
    }

    /// Nothing is seen yet at a pixel.
    pub fn open(&mut self, column: usize, row: usize) {
        (self.high[row][column], self.id[row][column]) = (f64::INFINITY, NONE);
    }

    /// All pixels of a block show a sphere, whatever else is drawn.
    pub fn settle_block(&mut self, [column, row]: [usize; 2], id: i32) {
        let columns = column * BLOCK..(column + 1) * BLOCK;
        for row in row * BLOCK..(row + 1) * BLOCK {
            self.high[row][columns.clone()].fill(f64::NEG_INFINITY);
            self.id[row][columns.clone()].fill(id);
        }
    }

    /// The holders of a row's pixels: [`NONE`] where there is none, and less where it is open
    /// which, or there is no pixel.
    pub fn ids(&self, row: usize) -> &[i32; SIDE] {
        &self.id[row]
    }

    /// Whether spheres were met here that all but coincide with others: then it pays to know what
    /// was drawn before.
    #[inline(always)]
    pub fn is_crowded(&self) -> bool {
        self.crowded
    }

    /// What was decided since this was asked last.
    pub fn take_tally(&mut self) -> Tally {
        std::mem::take(&mut self.tally)
    }

    /// Raises `slack` to cover an interval of this width, with the roundings here and in
    /// comparisons.
    ///
    /// The factor adds a tenth of `W`, as an interval is `2 W` wide; one rounding of a depth is
    /// less than an eightieth of it (lemma T3 of docs/numerics.md).
    #[inline(always)]
    fn widen(&mut self, width: f64) {
        let slack = 1.05 * width;
        self.slack = if slack > self.slack { slack } else { self.slack };
    }

    /// The sphere is the holder, at a depth between these.
    fn hold(&mut self, index: SphereIndex, [column, row]: [usize; 2], [low, high]: [f64; 2]) {
        self.widen(high - low + high.abs() * (8.0 * f64::EPSILON));
        self.high[row][column] = high;
        self.id[row][column] = index.id();
        self.stale |= Self::block(column, row);
    }

    /// The bit of a pixel's block in [`Tile::stale`].
    #[inline(always)]
    fn block(column: usize, row: usize) -> u64 {
        1 << (row / BLOCK * Self::BLOCKS + column / BLOCK)
    }

    /// Before spheres are drawn: for all whose bounds are those of the screen.
    #[inline(always)]
    pub fn begin<M: Mode>(&mut self, place: &Place<'_, SIDE>) {
        if M::BOUNDS {
            self.widen(2.0 * place.projector.screen.width);
        }
    }

    /// A block whose depth may have become less since it was told last, and the depth behind which
    /// nothing is seen in it.
    #[inline(always)]
    pub fn freshen<L: Lanes, const PERSPECTIVE: bool>(
        &mut self,
        place: &Place<'_, SIDE>,
    ) -> Option<(usize, f64)> {
        if self.stale == 0 {
            return None;
        }
        let block = self.stale.trailing_zeros() as usize % (Self::BLOCKS * Self::BLOCKS);
        self.stale &= self.stale - 1;
        let (x, y) = (block % Self::BLOCKS * BLOCK, block / Self::BLOCKS * BLOCK);
        let sx = L::load(&place.columns[x..]);
        let mut farthest = L::splat(f64::NEG_INFINITY);
        for row in y..y + BLOCK {
            let high = L::load(&self.high[row][x..]);
            // A pixel outside the region is NaN or negative infinite here and hides nothing.
            farthest = Self::depths::<L, PERSPECTIVE>(place, sx, row, high).max(farthest);
        }
        let farthest =
            if place.projector.screen.has_depths() { farthest.greatest() } else { f64::INFINITY };
        Some((block, farthest))
    }

    /// The depth behind which nothing is seen at a pixel.
    #[inline(always)]
    pub fn farthest<L: Lanes, const PERSPECTIVE: bool>(
        &self,
        place: &Place<'_, SIDE>,
        [column, row]: [usize; 2],
    ) -> f64 {
        let [sx, high] = [place.columns[column], self.high[row][column]].map(L::splat);
        let depths = Self::depths::<L, PERSPECTIVE>(place, sx, row, high);
        if place.projector.screen.has_depths() { depths.greatest() } else { f64::INFINITY }
    }

    /// Upper ends of depths times `|dir|^2`, in a row, as depths.
    #[inline(always)]
    fn depths<L: Lanes, const PERSPECTIVE: bool>(
        place: &Place<'_, SIDE>,
        sx: L,
        row: usize,
        high: L,
    ) -> L {
        if !PERSPECTIVE {
            return high;
        }
        let depth = high.div(length(sx, place.rows[row]));
        depth.add(depth.max(L::splat(0.0).sub(depth)).mul(L::splat(BACK)))
    }

    /// Of spheres, one in each place of a vector, how near each may be at a pixel, times `|dir|^2`;
    /// infinite where it is missed for certain.
    ///
    /// Those that a plane may cut, or whose bounds are not those of the screen, are not looked at:
    /// nothing is known of them.
    #[inline(always)]
    pub fn front<L: Lanes, const PERSPECTIVE: bool>(
        place: &Place<'_, SIDE>,
        sphere: [L; 4],
        cut: u8,
        [column, row]: [usize; 2],
    ) -> L {
        let screen = &place.projector.screen;
        // Bounds are the radius times those of radius 1, but for `W`.
        let Margins { doubt, width, rim, .. } = Margins::shared(1.0, screen);
        let (sx, r) = (L::splat(place.columns[column]), sphere[3]);
        let (q, b) = Row::of::<PERSPECTIVE>(sphere, place.rows[row]).meet::<L, PERSPECTIVE>(sx);
        // As in `Row::look`.
        let root = q.max(L::splat(0.0)).sqrt();
        let front = b.sub(r.mul(L::splat(rim)).max(root.add(L::splat(width))));
        let front = L::select(q.less(r.mul(L::splat(-doubt))), L::splat(f64::INFINITY), front);
        L::select(cut | r.less(L::splat(screen.plain)), L::splat(f64::NEG_INFINITY), front)
    }

    /// Upper bound of the depth that is held at a pixel, times `|dir|^2`.
    #[inline(always)]
    pub fn high(&self, [column, row]: [usize; 2]) -> f64 {
        self.high[row][column]
    }

    /// A sphere, at pixels where it may be seen: from a first to a last column `across`, of the
    /// rows `down`. A plane may `cut` it.
    #[inline(always)]
    pub fn draw<L: Lanes, const PERSPECTIVE: bool, M: Mode>(
        &mut self,
        place: &Place<'_, SIDE>,
        index: SphereIndex,
        sphere: &Projected,
        cut: bool,
        across: [usize; 2],
        down: impl Iterator<Item = usize>,
    ) {
        let screen = &place.projector.screen;
        if cut {
            self.clipped::<PERSPECTIVE, M>(place, index, sphere, across, down);
        } else if !M::BOUNDS || sphere.r >= screen.plain {
            let margins = if M::BOUNDS { Margins::shared(sphere.r, screen) } else { PLAIN };
            self.whole::<L, PERSPECTIVE, true, M>(place, index, sphere, &margins, across, down);
        } else {
            self.unlike::<PERSPECTIVE, M>(place, index, sphere, across, down);
        }
    }

    /// A sphere that does not share its bounds; apart, so that what most spheres need is compiled
    /// well.
    #[cold]
    #[inline(never)]
    fn unlike<const PERSPECTIVE: bool, M: Mode>(
        &mut self,
        place: &Place<'_, SIDE>,
        index: SphereIndex,
        sphere: &Projected,
        across: [usize; 2],
        down: impl Iterator<Item = usize>,
    ) {
        simd::dispatch(Unlike::<SIDE, PERSPECTIVE, M, _> {
            tile: self,
            place,
            index,
            sphere,
            across,
            down,
            mode: PhantomData,
        });
    }

    /// A sphere that no plane can cut: the near root, in vector form. Nearly all have `SHARED`
    /// bounds, and a loop without what the others need.
    #[inline(always)]
    fn whole<L: Lanes, const PERSPECTIVE: bool, const SHARED: bool, M: Mode>(
        &mut self,
        place: &Place<'_, SIDE>,
        index: SphereIndex,
        sphere: &Projected,
        margins: &Margins,
        [left, right]: [usize; 2],
        down: impl Iterator<Item = usize>,
    ) {
        let mut test = Test::<L>::new(margins, SHARED);
        if !SHARED {
            self.widen(2.0 * test.known);
        }
        test.allow(self.slack);
        // Rows with undecided pixels are only noted here, and resolved after the loop: a call in it
        // would spill the loop's registers. They are noted in memory, because the compiler splits
        // the loop in two for a local variable that changes on some paths only. `s` is a copy, so
        // that it stays in registers although `sphere` is passed on.
        let s = *sphere;
        let vectors = left / LANES..(right / LANES + 1).min(SIDE / LANES);
        let columns = &place.columns.as_chunks::<LANES>().0[vectors.clone()];
        for row in down {
            let [before, after] = test.lines::<PERSPECTIVE>(&s, place.rows[row]);
            let highs = &mut self.high[row].as_chunks_mut::<LANES>().0[vectors.clone()];
            let ids = &mut self.id[row].as_chunks_mut::<LANES>().0[vectors.clone()];
            for (k, ((sx, of_high), of_id)) in columns.iter().zip(highs).zip(ids).enumerate() {
                let (sx, high) = (L::load(sx), L::load(of_high));
                let (q, b) = before.meet::<L, PERSPECTIVE>(sx);
                let above = b.sub(high);
                let (lose, square) = test.loses(q, above);
                if lose == u8::MAX {
                    continue;
                }
                let root = square.sqrt();
                let win = if M::BOUNDS { test.wins(above, root) } else { !lose & above.less(root) };
                if if M::BOUNDS { win | lose != u8::MAX } else { win == 0 } {
                    if M::BOUNDS {
                        self.open |= 1 << row;
                    }
                    continue;
                }
                let depth = after.meet::<L, PERSPECTIVE>(sx).1.sub(root);
                L::select(win, depth, high).store(of_high);
                L::mark(win, index.id(), of_id);
                self.stale |= Self::block((vectors.start + k) * LANES, row);
            }
        }
        if self.open != 0 {
            self.decide::<PERSPECTIVE, M>(place, index, sphere, vectors);
        }
    }

    /// Resolves the vectors of some rows, in each of which the sphere neither wins nor loses for
    /// certain at some pixel.
    ///
    /// Computes their discriminants again. That is rarely needed, and it keeps the main loop small.
    #[cold]
    #[inline(never)]
    fn decide<const PERSPECTIVE: bool, M: Mode>(
        &mut self,
        place: &Place<'_, SIDE>,
        index: SphereIndex,
        sphere: &Projected,
        vectors: Range<usize>,
    ) {
        let (rows, mode) = (std::mem::take(&mut self.open), PhantomData);
        simd::dispatch(Decide::<SIDE, PERSPECTIVE, M> {
            tile: self,
            place,
            index,
            sphere,
            vectors,
            rows,
            mode,
        });
    }

    /// A sphere that a plane may cut: either root, pixel by pixel.
    #[cold]
    #[inline(never)]
    fn clipped<const PERSPECTIVE: bool, M: Mode>(
        &mut self,
        place: &Place<'_, SIDE>,
        index: SphereIndex,
        sphere: &Projected,
        across: [usize; 2],
        down: impl Iterator<Item = usize>,
    ) {
        simd::dispatch(Clipped::<SIDE, PERSPECTIVE, M, _> {
            tile: self,
            place,
            index,
            sphere,
            across,
            down,
            mode: PhantomData,
        });
    }

    /// What a sphere is to a holder.
    fn meet<const PERSPECTIVE: bool>(
        &mut self,
        place: &Place<'_, SIDE>,
        index: SphereIndex,
        holder: i32,
    ) -> Rival {
        let Some(held) = SphereIndex::of(holder) else { return Rival::Other(holder) };
        let [ball, held] = [index, held].map(|index| place.ball(index));
        if ball == held {
            self.crowded = true;
            return Rival::Twin(holder);
        }
        match Pair::new::<PERSPECTIVE>(ball, held, place.projector) {
            Some(pair) => {
                self.crowded = true;
                Rival::Near(holder, pair)
            }
            None => Rival::Other(holder),
        }
    }

    /// Decides between a sphere and the holder of some open pixels, as far as what is known of both
    /// tells. Returns where it did.
    #[inline(always)]
    fn against<L: Lanes, const PERSPECTIVE: bool>(
        &mut self,
        place: &Place<'_, SIDE>,
        index: SphereIndex,
        rival: &Rival,
        [first, row]: [usize; 2],
        open: u8,
    ) -> u8 {
        let open = open & L::same(rival.id(), &self.id[row][first..]);
        match rival {
            Rival::Twin(holder) => {
                L::mark(open, index.id().min(*holder), &mut self.id[row][first..]);
                open
            }
            Rival::Near(_, pair) => {
                let (sx, sy) = (L::load(&place.columns[first..]), place.rows[row]);
                let mut told = 0;
                let [near, far] = pair.walls::<L, PERSPECTIVE>(place.projector, sx, sy);
                for (wall, seen) in [(Root::Near, near & open), (Root::Far, far & open)] {
                    if seen == 0 {
                        continue;
                    }
                    let order = pair.order::<L, PERSPECTIVE>(wall, sx, sy);
                    let nearer = order.nearer & seen;
                    if nearer != 0 {
                        let (high, width) = pair.depth::<L, PERSPECTIVE>(wall, sx, sy);
                        self.widen(2.0 * width);
                        L::select(nearer, high, L::load(&self.high[row][first..]))
                            .store(&mut self.high[row][first..]);
                        L::mark(nearer, index.id(), &mut self.id[row][first..]);
                        self.stale |= Self::block(first, row);
                    }
                    told |= (order.nearer | order.farther) & seen;
                }
                told
            }
            Rival::None | Rival::Other(_) => 0,
        }
    }

    /// For `bench`: the sphere may or may not be the nearest, and begins and ends at these depths
    /// at the latest.
    fn leave_open(&mut self, index: SphereIndex, [column, row]: [usize; 2], least: f64, most: f64) {
        let (holder, high) = (self.id[row][column], self.high[row][column]);
        self.id[row][column] = OPEN | if holder == NONE { index.id() } else { holder };
        self.widen(high - least);
        if most < high {
            self.high[row][column] = most;
            self.stale |= Self::block(column, row);
        }
    }

    /// Decides exactly between a sphere and the holder of a pixel.
    ///
    /// `depth` bounds the depth of a sphere that no plane cuts and that is hit for certain.
    #[cold]
    #[inline(never)]
    fn settle(
        &mut self,
        &Place { scene, truth, projector, corner: [x, y], .. }: &Place<'_, SIDE>,
        index: SphereIndex,
        [column, row]: [usize; 2],
        depth: Option<[f64; 2]>,
    ) {
        let holder = self.id[row][column];
        if holder == CLOSED {
            return;
        }
        let ball = Ball::from(scene.known(index.at()));
        let held = SphereIndex::of(holder).map(|held| Ball::from(scene.known(held.at())));
        if held == Some(ball) {
            self.id[row][column] = holder.min(index.id());
            return;
        }
        let pixel = truth
            .pixel(projector.region.x + (x + column) as u32, projector.region.y + (y + row) as u32);
        let hit = match depth {
            Some(_) => Hit::known(ball, Root::Near),
            None => match pixel.hit(ball, &mut self.tally) {
                Some(hit) => hit,
                None => return,
            },
        };
        if let Some(held) = held {
            // The holder was seen when it became the holder; which wall is plain where no plane
            // cuts it.
            let whole = !projector.cuts(&projector.project(held.center, held.radius));
            let held = match whole {
                true => Hit::known(held, Root::Near),
                false => {
                    pixel.hit(held, &mut self.tally).expect("the holder of a pixel is hit there")
                }
            };
            let order = pixel.order(&hit, &held, &mut self.tally);
            if order.then(index.id().cmp(&holder)).is_gt() {
                return;
            }
        }
        self.hold(index, [column, row], depth.unwrap_or_else(|| pixel.interval(&hit)));
    }
}

/// A sphere that does not share its bounds, and where it is drawn.
struct Unlike<'a, const SIDE: usize, const PERSPECTIVE: bool, M, D> {
    tile: &'a mut Tile<SIDE>,
    place: &'a Place<'a, SIDE>,
    index: SphereIndex,
    sphere: &'a Projected,
    across: [usize; 2],
    down: D,
    mode: PhantomData<M>,
}

impl<const SIDE: usize, const PERSPECTIVE: bool, M: Mode, D: Iterator<Item = usize>> simd::Work
    for Unlike<'_, SIDE, PERSPECTIVE, M, D>
{
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { tile, place, index, sphere, across, down, .. } = self;
        let margins = Margins::new::<PERSPECTIVE>(sphere, place.projector.screen);
        tile.whole::<L, PERSPECTIVE, false, M>(place, index, sphere, &margins, across, down);
    }
}

/// A sphere that a plane may cut, and where it is drawn.
struct Clipped<'a, const SIDE: usize, const PERSPECTIVE: bool, M, D> {
    tile: &'a mut Tile<SIDE>,
    place: &'a Place<'a, SIDE>,
    index: SphereIndex,
    sphere: &'a Projected,
    across: [usize; 2],
    down: D,
    mode: PhantomData<M>,
}

impl<const SIDE: usize, const PERSPECTIVE: bool, M: Mode, D: Iterator<Item = usize>> simd::Work
    for Clipped<'_, SIDE, PERSPECTIVE, M, D>
{
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { tile, place, index, sphere, across: [left, right], down, .. } = self;
        let margins = if M::BOUNDS {
            Margins::new::<PERSPECTIVE>(sphere, place.projector.screen)
        } else {
            PLAIN
        };
        let planes = [place.projector.near, place.projector.far];
        let mut rival = Rival::None;
        for row in down {
            if place.is_cancelled() {
                return;
            }
            let line = Row::new::<PERSPECTIVE>(sphere, place.rows[row]);
            for first in (left / LANES * LANES..=right).step_by(LANES) {
                let mut open = 0u8;
                // What all but coincides with the last holder is told apart at once, where it is
                // still the holder.
                let mut done = 0;
                if M::DECIDES && matches!(rival, Rival::Near(..)) {
                    let across =
                        left.saturating_sub(first).min(LANES)..(right + 1 - first).min(LANES);
                    let window = across.fold(0, |window, k| window | 1 << k);
                    done =
                        tile.against::<L, PERSPECTIVE>(place, index, &rival, [first, row], window);
                }
                for column in left.max(first)..=right.min(first + LANES - 1) {
                    if done >> (column - first) & 1 == 1 {
                        continue;
                    }
                    let (at, high) = ([column, row], tile.high[row][column]);
                    match line.look::<PERSPECTIVE>(&margins, planes, high, place.columns[column]) {
                        Look::Gone => {}
                        Look::Seen(depth) if depth[1] < high - tile.slack => {
                            tile.hold(index, at, depth)
                        }
                        _ if !M::BOUNDS => {}
                        _ if !M::DECIDES => {
                            tile.leave_open(index, at, f64::NEG_INFINITY, f64::INFINITY)
                        }
                        _ => open |= 1 << (column - first),
                    }
                }
                while open != 0 {
                    let k = open.trailing_zeros() as usize;
                    let holder = tile.id[row][first + k];
                    if holder != rival.id() {
                        rival = tile.meet::<PERSPECTIVE>(place, index, holder);
                    }
                    open &=
                        !tile.against::<L, PERSPECTIVE>(place, index, &rival, [first, row], open);
                    if open >> k & 1 == 1 {
                        open &= !(1 << k);
                        tile.settle(place, index, [first + k, row], None);
                    }
                }
            }
        }
    }
}

/// A sphere, and vectors of some rows of a tile, in each of which something is to be decided about
/// it.
struct Decide<'a, const SIDE: usize, const PERSPECTIVE: bool, M> {
    tile: &'a mut Tile<SIDE>,
    place: &'a Place<'a, SIDE>,
    index: SphereIndex,
    sphere: &'a Projected,
    vectors: Range<usize>,
    rows: u64,
    mode: PhantomData<M>,
}

impl<const SIDE: usize, const PERSPECTIVE: bool, M: Mode> simd::Work
    for Decide<'_, SIDE, PERSPECTIVE, M>
{
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(mut self) {
        let screen = self.place.projector.screen;
        let margins = [
            Margins::new::<PERSPECTIVE>(self.sphere, screen),
            Margins::sharp::<PERSPECTIVE>(self.sphere, &screen),
        ];
        // A holder that turned out to be the same sphere.
        let mut rival = Rival::None;
        while self.rows != 0 && !self.place.is_cancelled() {
            let row = self.rows.trailing_zeros() as usize;
            self.rows &= self.rows - 1;
            for vector in self.vectors.clone() {
                rival = self.eight::<L>(&margins, [vector * LANES, row], rival);
            }
        }
    }
}

/// What is known of the holder that a sphere was held against last.
#[derive(Clone, Copy)]
enum Rival {
    /// Nothing was held against it yet.
    None,
    /// It is the same sphere.
    Twin(i32),
    /// It all but coincides.
    Near(i32, Pair),
    /// It is told apart by its place, or not at all but exactly.
    Other(i32),
}

impl Rival {
    /// The id of the holder.
    fn id(&self) -> i32 {
        match *self {
            Self::None => NONE,
            Self::Twin(id) | Self::Near(id, _) | Self::Other(id) => id,
        }
    }
}

/// What bounds tell of a sphere at eight pixels.
struct Told<L> {
    /// Where it is certainly behind or missed, certainly in front, and certainly hit.
    lose: u8,
    win: u8,
    sure: u8,
    /// Ends of the depth where it is hit.
    least: L,
    most: L,
}

impl<const SIDE: usize, const PERSPECTIVE: bool, M: Mode> Decide<'_, SIDE, PERSPECTIVE, M> {
    #[inline(always)]
    fn tell<L: Lanes>(&self, margins: &Margins, [first, row]: [usize; 2]) -> Told<L> {
        let Self { tile, place, sphere, .. } = self;
        let mut test = Test::<L>::new(margins, false);
        test.allow(tile.slack);
        let [before, after] = test.lines::<PERSPECTIVE>(sphere, place.rows[row]);
        let (sx, high) = (L::load(&place.columns[first..]), L::load(&tile.high[row][first..]));
        let (q, b) = before.meet::<L, PERSPECTIVE>(sx);
        let above = b.sub(high);
        let (lose, square) = test.loses(q, above);
        let root = square.sqrt();
        let middle = Row::new::<PERSPECTIVE>(sphere, place.rows[row]).meet::<L, PERSPECTIVE>(sx).1;
        Told {
            lose,
            win: test.wins(above, root),
            sure: test.sure(root),
            least: middle.sub(root).sub(L::splat(margins.width)),
            most: after.meet::<L, PERSPECTIVE>(sx).1.sub(root),
        }
    }

    /// Eight pixels from some column and row on, by the bounds that serve depths best, by those
    /// that serve silhouettes best, by what tells spheres apart that all but coincide, and then
    /// exactly. Takes and answers with the last holder that was looked at.
    #[inline(always)]
    fn eight<L: Lanes>(
        &mut self,
        [depths, silhouettes]: &[Margins; 2],
        [first, row]: [usize; 2],
        mut rival: Rival,
    ) -> Rival {
        let index = self.index;
        let mut told = self.tell::<L>(depths, [first, row]);
        // Where the sphere has won before, nothing is to be decided.
        let mut open = !(told.lose | L::same(index.id(), &self.tile.id[row][first..]));
        let hardly = open & !(told.win | told.sure);
        if hardly != 0 {
            let sharp = self.tell::<L>(silhouettes, [first, row]);
            open &= !(sharp.lose & hardly);
            told.win |= sharp.win & hardly;
            told.sure |= sharp.sure & hardly;
            told.least = L::select(hardly, sharp.least, told.least);
            told.most = L::select(hardly, sharp.most, told.most);
            if sharp.win & hardly != 0 {
                self.tile.widen(2.0 * silhouettes.width);
            }
        }
        let win = open & told.win;
        let tile = &mut *self.tile;
        if win != 0 {
            L::select(win, told.most, L::load(&tile.high[row][first..]))
                .store(&mut tile.high[row][first..]);
            L::mark(win, index.id(), &mut tile.id[row][first..]);
            tile.stale |= Tile::<SIDE>::block(first, row);
            open &= !win;
        }
        if open == 0 {
            return rival;
        }
        let (mut leasts, mut mosts) = ([0.0; LANES], [0.0; LANES]);
        told.least.store(&mut leasts);
        told.most.store(&mut mosts);
        while open != 0 {
            let k = open.trailing_zeros() as usize;
            let at = [first + k, row];
            if M::DECIDES {
                let holder = self.tile.id[row][first + k];
                if holder != rival.id() {
                    rival = self.tile.meet::<PERSPECTIVE>(self.place, index, holder);
                }
                // All pixels of this holder at once.
                open &= !self.tile.against::<L, PERSPECTIVE>(
                    self.place,
                    index,
                    &rival,
                    [first, row],
                    open,
                );
                if open >> k & 1 == 0 {
                    continue;
                }
            }
            open &= !(1 << k);
            let sure = told.sure >> k & 1 == 1;
            if M::DECIDES {
                self.tile.settle(self.place, index, at, sure.then_some([leasts[k], mosts[k]]));
            } else {
                self.tile.leave_open(
                    index,
                    at,
                    leasts[k],
                    if sure { mosts[k] } else { f64::INFINITY },
                );
            }
        }
        rival
    }
}
