//! Two pictures held against each other, pixel by pixel, as colours: how many pixels differ, by how
//! much, which come first; and a picture of where.

/// Pixels that differ and are told with their places.
const TOLD: usize = 10;

/// Where the pictures differ: red on grey.
const WRONG: [u8; 3] = [255, 0, 0];

/// A picture as it is compared: sRGB and straight alpha, row by row from the top.
#[derive(Clone, Copy, Debug)]
pub struct Pixels<'a> {
    /// Columns and rows.
    pub size: [u32; 2],
    /// Four channels each.
    pub rgba: &'a [[u8; 4]],
}

impl Pixels<'_> {
    /// Where a pixel is, column and row.
    fn place(&self, at: usize) -> [u32; 2] {
        let width = self.size[0].max(1) as usize;
        [(at % width) as u32, (at / width) as u32]
    }
}

/// How two pictures differ.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Difference {
    /// Pixels that differ; all, if sizes do.
    pub pixels: u64,
    /// The greatest difference of a channel.
    pub greatest: u8,
    /// The first ten, from the top left: column and row, this, and the other.
    pub first: Vec<([u32; 2], [u8; 4], [u8; 4])>,
}

impl Difference {
    /// Whether there is none.
    pub fn is_none(&self) -> bool {
        self.pixels == 0
    }
}

/// The greatest difference of a channel of two colours; 0 of equal ones.
fn apart(one: [u8; 4], two: [u8; 4]) -> u8 {
    one.iter().zip(two).map(|(one, two)| one.abs_diff(two)).fold(0, u8::max)
}

/// How two pictures differ. A pixel counts where a channel differs by more than `delta`: by 0 where
/// pictures are to be equal.
pub fn compare(one: Pixels, two: Pixels, delta: u8) -> Difference {
    let mut difference = Difference::default();
    if one.size != two.size || one.rgba.len() != two.rgba.len() {
        let [width, height] = one.size.map(u64::from);
        return Difference { pixels: (width * height).max(1), greatest: 255, ..difference };
    }
    for (at, (&a, &b)) in one.rgba.iter().zip(two.rgba).enumerate() {
        if a == b {
            continue;
        }
        let apart = apart(a, b);
        difference.greatest = difference.greatest.max(apart);
        if apart <= delta {
            continue;
        }
        difference.pixels += 1;
        if difference.first.len() < TOLD {
            difference.first.push((one.place(at), a, b));
        }
    }
    difference
}

/// A picture of where two pictures of one size differ: pixels that do in red, all others as a faded
/// grey of the first.
pub fn shown(one: Pixels, two: Pixels) -> Vec<[u8; 3]> {
    let both = one.rgba.iter().zip(two.rgba);
    both.map(|(&a, &b)| if a == b { faded(a) } else { WRONG }).collect()
}

/// A light grey, as bright as the colour on white, in a quarter of the range.
fn faded([r, g, b, alpha]: [u8; 4]) -> [u8; 3] {
    // The luma of BT.601, in parts of 256; what is transparent is white.
    let luma = (77 * u32::from(r) + 150 * u32::from(g) + 29 * u32::from(b)) >> 8;
    let dark = (255 - luma) * u32::from(alpha) / 255;
    [(255 - dark / 4) as u8; 3]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pixels(size: [u32; 2], rgba: &[[u8; 4]]) -> Pixels<'_> {
        Pixels { size, rgba }
    }

    #[test]
    fn what_differs_is_counted_and_told() {
        let one: Vec<[u8; 4]> = (0..60).map(|k| [k, 0, 0, 255]).collect();
        let mut two = one.clone();
        let size = [12, 5];
        assert!(compare(pixels(size, &one), pixels(size, &two), 0).is_none());
        two[13] = [13, 3, 0, 255];
        two[59] = [59, 0, 0, 250];
        let found = compare(pixels(size, &one), pixels(size, &two), 0);
        assert_eq!((found.pixels, found.greatest), (2, 5));
        let told = [([1, 1], one[13], two[13]), ([11, 4], one[59], two[59])];
        assert_eq!(found.first, told);
        // Within what is tolerated only the greater one counts; the greatest is of all.
        let found = compare(pixels(size, &one), pixels(size, &two), 3);
        assert_eq!((found.pixels, found.greatest, &found.first[..]), (1, 5, &told[1..]));
        assert!(compare(pixels(size, &one), pixels(size, &two), 5).is_none());

        let all: Vec<[u8; 4]> = one.iter().map(|[r, ..]| [*r, 9, 9, 255]).collect();
        let found = compare(pixels(size, &one), pixels(size, &all), 0);
        let places: Vec<_> = found.first.iter().map(|(place, ..)| *place).collect();
        assert_eq!((found.pixels, places), (60, (0..10).map(|x| [x, 0]).collect()));
    }

    #[test]
    fn other_sizes_differ_everywhere() {
        let one = vec![[0; 4]; 12];
        for (size, rgba) in [([4, 3], &one[..]), ([3, 4], &one[..9]), ([3, 4], &[])] {
            let found = compare(pixels([3, 4], &one), pixels(size, rgba), 255);
            assert_eq!((found.pixels, found.greatest), (12, 255), "{size:?}");
        }
        let none = pixels([0, 0], &[]);
        assert!(compare(none, none, 0).is_none());
        assert_eq!(compare(none, pixels([1, 1], &one[..1]), 0).pixels, 1);
    }

    #[test]
    fn what_differs_is_red_on_grey() {
        let one = [[0, 0, 0, 255], [255; 4], [0, 0, 0, 0], [10, 20, 30, 255]];
        let two = [[0, 0, 0, 255], [255; 4], [0, 0, 0, 0], [10, 20, 31, 255]];
        let size = [2, 2];
        let picture = shown(pixels(size, &one), pixels(size, &two));
        assert_eq!(picture, [[192; 3], [255; 3], [255; 3], WRONG]);
    }
}
