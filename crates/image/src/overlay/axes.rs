//! The axes of the world, in the lower left corner: three arrows from a point.

use super::{
    OverlayError,
    block::{Block, Style, text},
    layout::Problem,
    raster::{Path, circle, hull},
};

const PART: &str = "axes";

/// The axes of the camera in the world: orthogonal unit vectors, `right` x `up` = `back`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axes {
    /// To the right in the picture.
    pub right: [f64; 3],
    /// Up in the picture.
    pub up: [f64; 3],
    /// Out of the picture, towards the eye.
    pub back: [f64; 3],
}

/// x, y and z, and the colours of their arrows: they are told apart on black and on white.
const AXES: [(&str, [u8; 3]); 3] =
    [("x", [229, 72, 77]), ("y", [48, 164, 108]), ("z", [62, 123, 250])];

/// Half of the square that arrows and letters need in every direction; lengths are in parts of the
/// size of the tripod, which is 12 pixels or more.
const HALF: f64 = 2.65;
/// From the point to the tips.
const ARM: f64 = 1.5;
/// From the point to the middles of the letters.
const LETTER: f64 = 2.0;
/// Length of an arrow's head, half of its width, and half of the width of its shaft.
const HEAD: [f64; 3] = [0.55, 0.23, 0.075];
/// An axis that is seen so much from its end that its letter lies elsewhere: by its length in the
/// picture.
const END_ON: f64 = 0.3;

impl Axes {
    /// Refuses what are no axes: lengths and angles may be off by a millionth.
    fn check(&self) -> Result<(), OverlayError> {
        let [a, b, c] = [self.right, self.up, self.back];
        let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let across =
            [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
        let errors =
            [dot(a, a) - 1.0, dot(b, b) - 1.0, dot(c, c) - 1.0, dot(a, b), dot(across, c) - 1.0];
        if errors.iter().all(|error| error.abs() <= 1e-6) {
            return Ok(());
        }
        Err(OverlayError::Frame { right: self.right, up: self.up, back: self.back })
    }

    /// Its block, above a row.
    pub fn block(&self, style: &Style, bottom: f64) -> Result<Block, Problem> {
        self.check()?;
        let unit = style.text.max(style.size[0].min(style.size[1]) / 28.0);
        let half = HALF * unit;
        let origin = [half, bottom - half];
        let mut block = Block::new(PART);
        block.kept = Some([[0.0, origin[1] - half], [origin[0] + half, bottom]]);
        let arrow = |axis: usize| Arrow {
            // y of the picture points down.
            flat: [self.right[axis], -self.up[axis]],
            back: self.back[axis],
        };
        let arrows = [0, 1, 2].map(arrow);
        let mut order = [0, 1, 2];
        // What is nearer to the eye comes later, and lies over the others.
        order.sort_by(|&a, &b| arrows[a].back.total_cmp(&arrows[b].back));
        for axis in order {
            let (name, color) = AXES[axis];
            block.add(arrows[axis].path(unit).moved(origin), color);
            let line = text(PART, name, 0.9 * style.text)?;
            let [least, most] = line.path.bounds().expect("a letter has an outline");
            let to = arrows[axis].letter(&arrows);
            let by = [0, 1].map(|side| {
                origin[side] + to[side] * LETTER * unit - 0.5 * (least[side] + most[side])
            });
            block.letters(line.path.moved(by), style.ink);
        }
        Ok(block)
    }
}

/// An axis as it is seen.
#[derive(Clone, Copy)]
struct Arrow {
    /// In the picture, to the right and down.
    flat: [f64; 2],
    /// Towards the eye.
    back: f64,
}

impl Arrow {
    /// Its length in the picture, and its direction there.
    fn direction(&self) -> (f64, [f64; 2]) {
        unit(self.flat)
    }

    /// A shaft, and a cone on it, as they look from where the eye is; around (0, 0).
    fn path(&self, size: f64) -> Path {
        let [length, wide, thin] = HEAD.map(|part| part * size);
        let (_, [x, y]) = self.direction();
        let at = |distance: f64| self.flat.map(|part| part * distance);
        let across = |radius: f64| [-y * radius, x * radius];
        // A disc across the axis is an ellipse in the picture.
        let disc = |distance: f64, radius: f64| {
            let short = radius * self.back.abs();
            circle(at(distance), across(radius), [x * short, y * short])
        };
        let base = ARM * size - length;
        let mut cone = disc(base, wide);
        cone.push(at(ARM * size));
        let mut shaft = disc(0.0, thin);
        shaft.extend(disc(base, thin));
        let mut path = Path::default();
        path.polygon(&hull(shaft));
        path.polygon(&hull(cone));
        path
    }

    /// Where its letter lies, as a part of the usual distance: at its tip, and where that is near
    /// the point from which all come, on the side that the other two leave free.
    fn letter(&self, all: &[Self; 3]) -> [f64; 2] {
        let (length, direction) = self.direction();
        if length >= END_ON {
            // A short arrow keeps its letter near, but out of its head.
            return direction.map(|part| part * (0.4 + 0.6 * length));
        }
        let sum = all.iter().fold([0.0; 2], |sum, arrow| {
            let is_other = arrow.direction().0 >= END_ON;
            let (_, other) = if is_other { arrow.direction() } else { (0.0, [0.0; 2]) };
            [sum[0] - other[0], sum[1] - other[1]]
        });
        unit(sum).1.map(|part| part * 0.45)
    }
}

/// The length of a vector, and its direction: to the right where it has none.
fn unit([x, y]: [f64; 2]) -> (f64, [f64; 2]) {
    let length = (x * x + y * y).sqrt();
    (length, if length > 0.0 { [x / length, y / length] } else { [1.0, 0.0] })
}
