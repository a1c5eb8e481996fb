//! Parts of a picture: what one machine found of its spheres, in its region, with all that is
//! needed to merge it with others.
//!
//! A part holds, for each pixel of its region, the nearest of its spheres and certain bounds of the
//! distance, and for each sphere that is seen its exact numbers. Where the bounds of two parts
//! overlap, the order is decided from these numbers by [`crate::exact::decide`], as in a picture
//! that was drawn at once; so merging loses nothing, in any order.
//!
//! * `planisphere_io::part` writes and reads parts as `.npz` files; it describes the layout.
//! * [`merge`]: parts that fit together become planes of the whole.
//!
//! This module knows no devices and no files.

pub mod merge;

use std::ops::Range;

use bytes::Bytes;

use crate::{
    camera::{Region, View},
    scene::{Block, Bounds},
};

/// The version of the format that is written, and the newest that is read.
pub const VERSION: i64 = 1;

/// What a part is a part of.
#[derive(Clone, Debug, PartialEq)]
pub struct Meta {
    /// Camera and size of the whole image.
    pub view: View,
    /// The pixels that the part has.
    pub region: Region,
    /// Colour where there is no sphere, sRGB.
    pub background: [u8; 3],
    /// The spheres that were drawn, as runs of indices in the whole scene: not empty, apart, in
    /// order.
    pub ranges: Vec<Range<u64>>,
    /// The extent of these spheres; none if there are none.
    pub bounds: Option<Bounds>,
}

impl Meta {
    /// The greatest index, if there is any sphere.
    pub fn last(&self) -> Option<u64> {
        self.ranges.last().map(|range| range.end - 1)
    }
}

/// What a part says of a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pixel {
    /// Index of the nearest sphere in the whole scene; -1 for none.
    pub id: i64,
    /// The distance of its hit lies between these; infinite for none.
    pub bounds: [f64; 2],
}

/// The pixels of a part, as records in the bytes of its file.
#[derive(Clone, Debug)]
pub struct Pixels {
    /// The records.
    pub bytes: Bytes,
    /// Whether an index has 8 bytes, not 4.
    pub wide: bool,
}

impl Pixels {
    /// Bytes of a record.
    pub fn record(wide: bool) -> usize {
        if wide { 24 } else { 20 }
    }

    /// Records `range`, in order.
    fn records(&self, range: Range<usize>) -> impl Iterator<Item = Pixel> + '_ {
        let (size, wide) = (Self::record(self.wide), self.wide);
        let bytes = &self.bytes[range.start * size..range.end * size];
        bytes.chunks_exact(size).map(move |record| {
            let (id, bounds) = record.split_at(size - 16);
            let id = match wide {
                true => i64::from_le_bytes(id.try_into().expect("8 bytes")),
                false => i32::from_le_bytes(id.try_into().expect("4 bytes")).into(),
            };
            let [low, high] = [0, 8]
                .map(|at| f64::from_le_bytes(bounds[at..at + 8].try_into().expect("8 bytes")));
            Pixel { id, bounds: [low, high] }
        })
    }
}

/// A part that was read.
#[derive(Clone, Debug)]
pub struct Part {
    /// Its file, for messages.
    pub name: String,
    /// What it is a part of.
    pub meta: Meta,
    /// Its pixels, row by row.
    pub pixels: Pixels,
    /// Indices of the spheres that are seen, rising.
    pub indices: Vec<u64>,
    /// The same spheres' numbers.
    pub spheres: Block,
}

impl Part {
    /// The pixels of columns of a row of the image, which must lie in the region.
    pub fn row(&self, row: u32, columns: Range<u32>) -> impl Iterator<Item = Pixel> + '_ {
        let Region { x, y, width, .. } = self.meta.region;
        let start = (row - y) as usize * width as usize;
        self.pixels
            .records(start + (columns.start - x) as usize..start + (columns.end - x) as usize)
    }
}

/// Which of the spheres of a picture are seen: one bit each.
pub struct Seen(Vec<u64>);

impl Seen {
    /// None of `spheres` so far.
    pub fn new(spheres: usize) -> Self {
        Self(vec![0; spheres.div_ceil(64)])
    }

    /// These are; -1 is none.
    pub fn mark(&mut self, ids: &[i32]) {
        for &id in ids {
            if let Ok(index) = usize::try_from(id) {
                self.0[index / 64] |= 1 << (index % 64);
            }
        }
    }

    /// Those that are seen, rising.
    pub fn iter(&self) -> impl Iterator<Item = usize> + Clone + '_ {
        self.0.iter().enumerate().flat_map(|(word, &bits)| {
            (0..64).filter(move |bit| bits >> bit & 1 == 1).map(move |bit| 64 * word + bit)
        })
    }
}
