//! Blocks of a tile that certainly show one sphere, found before any sample of them is tested.
//!
//! For parallel rays, where no clip plane cuts. A sphere covers a block if it is hit for certain at
//! the block's farthest sample from its middle: every other is nearer to that. It is nowhere in the
//! block nearer than where the block comes nearest to its middle. If the sphere that covers a block
//! with the least far end lies in front of where every other may begin, it is what all samples
//! show (lemma S1 of docs/numerics.md).

use super::BLOCKS;
use crate::{
    bins::Window,
    cover::BLOCK,
    filter::{Margins, Screen},
    ids::{NONE, SphereIndex},
    projected::Projected,
    simd::{LANES, Lanes},
};

// A row of blocks is one vector.
const _: () = assert!(BLOCKS == LANES);

/// What is known of the blocks of a tile.
pub(super) struct Alike {
    /// Ends of the columns and rows of samples of each block, on the screen.
    ends: [[[f64; BLOCKS]; 2]; 2],
    /// The least far end of a sphere that covers a block, and which.
    far: [[f64; BLOCKS]; BLOCKS],
    covered: [[i32; BLOCKS]; BLOCKS],
    /// Where the sphere begins that may begin nearest, and which; and where the next begins.
    near: [[f64; BLOCKS]; BLOCKS],
    nearest: [[i32; BLOCKS]; BLOCKS],
    next: [[f64; BLOCKS]; BLOCKS],
}

impl Alike {
    /// Of the screen coordinates of a tile's samples, which are infinite beyond the region.
    pub(super) fn new(columns: &[f64], rows: &[f64]) -> Self {
        let ends = |samples: &[f64]| {
            let end = |at: usize| std::array::from_fn(|block| samples[block * BLOCK + at]);
            [end(0), end(BLOCK - 1)]
        };
        Self {
            ends: [ends(columns), ends(rows)],
            far: [[f64::INFINITY; BLOCKS]; BLOCKS],
            covered: [[NONE; BLOCKS]; BLOCKS],
            near: [[f64::INFINITY; BLOCKS]; BLOCKS],
            nearest: [[NONE; BLOCKS]; BLOCKS],
            next: [[f64::INFINITY; BLOCKS]; BLOCKS],
        }
    }

    /// Takes a sphere that is seen in a window at most; one of which nothing is certain may begin
    /// anywhere in it.
    #[inline(always)]
    pub(super) fn add<L: Lanes>(
        &mut self,
        index: SphereIndex,
        sphere: &Projected,
        [left, right, top, bottom]: Window,
        screen: &Screen,
        certain: bool,
    ) {
        let [left, right] = [left, right].map(|at| at as usize / BLOCK);
        let window = (u8::MAX >> (BLOCKS - 1 - right)) & (u8::MAX << left);
        let Margins { solid, width, rim, .. } = Margins::shared(sphere.r, screen);
        let (x, zero) = (L::splat(sphere.x), L::splat(0.0));
        let [first, last] = self.ends[0].map(|ends| L::load(&ends));
        // How far the nearest and the farthest sample is aside.
        let (before, after) = (first.sub(x), x.sub(last));
        let near_x = before.max(after).max(zero);
        let far_x = x.sub(first).max(last.sub(x));
        let (near_x, far_x) = (near_x.mul(near_x), far_x.mul(far_x));
        let (square, z) = (sphere.r * sphere.r, L::splat(sphere.z));
        for row in top as usize / BLOCK..=bottom as usize / BLOCK {
            let [first, last] = [0, 1].map(|end| self.ends[1][end][row]);
            // Rows go down.
            let near_y = (last - sphere.y).max(sphere.y - first).max(0.0);
            let far_y = (first - sphere.y).abs().max((last - sphere.y).abs());
            let near_q = L::splat(square - near_y * near_y).sub(near_x);
            let root = near_q.max(zero).sqrt().add(L::splat(width));
            let front = z.sub(root.max(L::splat(rim)));
            let front = match certain {
                true => L::select(window, front, L::splat(f64::INFINITY)),
                false => L::select(window, L::splat(f64::NEG_INFINITY), L::splat(f64::INFINITY)),
            };
            let near = L::load(&self.near[row]);
            // What is second is the greater of the two, or what was second before.
            let nearer = front.less(near);
            let second = L::select(nearer, near, front);
            let next = L::load(&self.next[row]);
            L::select(second.less(next), second, next).store(&mut self.next[row]);
            L::select(nearer, front, near).store(&mut self.near[row]);
            L::mark(nearer, index.id(), &mut self.nearest[row]);
            if !certain {
                continue;
            }
            let far_q = L::splat(square - far_y * far_y).sub(far_x);
            let back = z.sub(far_q.max(zero).sqrt()).add(L::splat(width));
            // NaN, of what lies beyond the region, covers nothing.
            let covers = window & L::splat(solid).less(far_q) & back.less(L::load(&self.far[row]));
            L::select(covers, back, L::load(&self.far[row])).store(&mut self.far[row]);
            L::mark(covers, index.id(), &mut self.covered[row]);
        }
    }

    /// Blocks, by column and row, that show one sphere for certain, and which.
    pub(super) fn found(&self) -> impl Iterator<Item = ([usize; 2], i32)> {
        let all = (0..BLOCKS).flat_map(|row| (0..BLOCKS).map(move |column| [column, row]));
        all.filter_map(|[column, row]| {
            let covered = self.covered[row][column];
            let own = self.nearest[row][column] == covered;
            let others = if own { &self.next } else { &self.near }[row][column];
            let alone = covered != NONE && self.far[row][column] < others;
            alone.then_some(([column, row], covered))
        })
    }
}
