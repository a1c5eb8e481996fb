//! What the ids of a picture are, and the numbers that spheres, tiles and their pixels have: each
//! kind of number a type of its own, so that none is taken for another.
//!
//! A cluster of neighbours ([`crate::order`]) has a number too, a plain `u32`: lists are made of
//! spheres and of clusters by the same code, see [`crate::bins::Item`].

use bytemuck::{Pod, Zeroable};

/// The id where no sphere is seen; `NONE` of `shaders/types.wgsl`.
pub const NONE: i32 = -1;
/// The id of a pixel that is still to be decided; `UNDECIDED` of `shaders/types.wgsl`. No finished
/// picture has it.
pub const UNDECIDED: i32 = -2;
// An index is never negative. `cpu::paint` makes UNDECIDED of all that is less than NONE, by the
// greater of both.
const _: () = assert!(NONE < 0 && UNDECIDED == NONE - 1);

/// Index of a sphere in its scene: what ids are.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct SphereIndex(pub u32);

impl SphereIndex {
    /// To index with.
    #[inline(always)]
    pub const fn at(self) -> usize {
        self.0 as usize
    }

    /// The id of pixels that show this sphere.
    #[inline(always)]
    pub const fn id(self) -> i32 {
        self.0 as i32
    }

    /// The sphere that a pixel with an id shows; none where no sphere is seen, or where it is open
    /// which.
    #[inline(always)]
    pub const fn of(id: i32) -> Option<Self> {
        if id < 0 { None } else { Some(Self(id as u32)) }
    }
}

/// Place of a sphere in the order of [`crate::order::Ordered`], in which a device has the spheres;
/// where there is no order, its [`SphereIndex`].
#[repr(transparent)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct SortedIndex(pub u32);

impl SortedIndex {
    /// To index with.
    #[inline(always)]
    pub const fn at(self) -> usize {
        self.0 as usize
    }
}

// SAFETY: a `u32` and nothing else, which may be all zeros.
unsafe impl Zeroable for SortedIndex {}
// SAFETY: a `u32` and nothing else, as `repr(transparent)` says: any bits are one, and none is
// padding.
unsafe impl Pod for SortedIndex {}

/// Number of a tile of a band, row by row.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TileIndex(pub u32);

impl TileIndex {
    /// To index with.
    #[inline(always)]
    pub const fn at(self) -> usize {
        self.0 as usize
    }

    /// Its slot, where each tile of a band has one and they come in the order of the tiles.
    #[inline(always)]
    pub const fn slot(self) -> Slot {
        Slot(self.0)
    }
}

/// Number of a tile's pixels among those that a device gives back.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Slot(pub u32);

impl Slot {
    /// In place of a slot: the device did not draw the tile, which shows its background.
    pub const BACKGROUND: Self = Self(u32::MAX);
    /// In place of a slot: the host decides every pixel of the tile.
    pub const HOST: Self = Self(u32::MAX - 1);

    /// To index with.
    #[inline(always)]
    pub const fn at(self) -> usize {
        self.0 as usize
    }
}
