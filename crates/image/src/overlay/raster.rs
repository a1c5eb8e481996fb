//! Outlines become coverage: how much of each pixel lies inside, of 255.
//!
//! The area inside is summed exactly, edge by edge, in f64 with + - * / and comparisons alone: the
//! same on every machine. y points down; pixel (i, j) is the square from (i, j) to (i + 1, j + 1).

/// How far a chord may leave its curve, in pixels.
const TOLERANCE: f64 = 0.01;

/// Closed outlines; inside is where the signs of their turns do not add up to 0.
#[derive(Clone, Debug, Default)]
pub struct Path {
    edges: Vec<[[f64; 2]; 2]>,
}

/// Coverage of some pixels.
#[derive(Clone, Debug)]
pub struct Mask {
    /// Column and row of the first pixel.
    pub at: [i64; 2],
    /// Columns and rows.
    pub size: [usize; 2],
    /// Row by row, from 0 to 255.
    pub cover: Vec<u8>,
}

impl Path {
    /// A straight edge.
    pub fn line(&mut self, from: [f64; 2], to: [f64; 2]) {
        self.edges.push([from, to]);
    }

    /// A parabola with one control point.
    pub fn quadratic(&mut self, from: [f64; 2], control: [f64; 2], to: [f64; 2]) {
        // A chord of a part 1/n is off by |a - 2b + c| / (4 n^2).
        let bend = bend(from, control, to) / 4.0;
        let parts = (bend / TOLERANCE).sqrt().ceil().max(1.0);
        let mut last = from;
        for part in 1..=parts as usize {
            let (t, mut next) = (part as f64 / parts, to);
            for axis in 0..2 {
                let a = from[axis] + (control[axis] - from[axis]) * t;
                let b = control[axis] + (to[axis] - control[axis]) * t;
                next[axis] = a + (b - a) * t;
            }
            let next = if part as f64 == parts { to } else { next };
            self.line(last, next);
            last = next;
        }
    }

    /// A closed polygon. Its turn is made that of the others, so that what two of them cover is
    /// inside.
    pub fn polygon(&mut self, points: &[[f64; 2]]) {
        let next = |index: usize| points[(index + 1) % points.len()];
        let cross = |index: usize| {
            let ([ax, ay], [bx, by]) = (points[index], next(index));
            ax * by - ay * bx
        };
        let area: f64 = (0..points.len()).map(cross).sum();
        for index in 0..points.len() {
            let (from, to) = (points[index], next(index));
            if area < 0.0 { self.line(to, from) } else { self.line(from, to) }
        }
    }

    /// A rectangle from one corner to the other.
    pub fn rectangle(&mut self, [left, top]: [f64; 2], [right, bottom]: [f64; 2]) {
        self.polygon(&[[left, top], [right, top], [right, bottom], [left, bottom]]);
    }

    /// A disc.
    pub fn disc(&mut self, center: [f64; 2], radius: f64) {
        self.polygon(&circle(center, [radius, 0.0], [0.0, radius]));
    }

    /// Moved.
    pub fn moved(mut self, by: [f64; 2]) -> Self {
        for point in self.edges.iter_mut().flatten() {
            *point = [point[0] + by[0], point[1] + by[1]];
        }
        self
    }

    /// The least and the greatest corner; none of what has no edges.
    pub fn bounds(&self) -> Option<[[f64; 2]; 2]> {
        let mut points = self.edges.iter().flatten();
        let first = *points.next()?;
        Some(points.fold([first, first], |[least, most], point| {
            let each = |of: fn(f64, f64) -> f64, so_far: [f64; 2]| {
                [of(so_far[0], point[0]), of(so_far[1], point[1])]
            };
            [each(f64::min, least), each(f64::max, most)]
        }))
    }

    /// The coverage of all pixels that the outlines touch.
    pub fn mask(&self) -> Mask {
        let Some([least, most]) = self.bounds() else {
            return Mask { at: [0; 2], size: [0; 2], cover: Vec::new() };
        };
        let at = least.map(|value| value.floor() as i64);
        let size = [0, 1].map(|axis| (most[axis].ceil() as i64 - at[axis]) as usize);
        // Of each row two more: an edge on the right border counts for what is behind it.
        let stride = size[0] + 2;
        let mut sums = vec![0.0; stride * size[1]];
        for edge in &self.edges {
            let local = edge.map(|[x, y]| [x - at[0] as f64, y - at[1] as f64]);
            add(&mut sums, stride, local);
        }
        let mut cover = Vec::with_capacity(size[0] * size[1]);
        for row in sums.chunks_exact(stride) {
            let mut sum = 0.0_f64;
            cover.extend(row[..size[0]].iter().map(|part| {
                sum += part;
                (sum.abs().min(1.0) * 255.0 + 0.5) as u8
            }));
        }
        Mask { at, size, cover }
    }
}

/// Adds what an edge, inside of the pixels, has to its right: of each row the height that it
/// crosses there, in the pixels that it meets weighted by the area behind it. A sum along the row
/// is the area inside.
fn add(sums: &mut [f64], stride: usize, [from, to]: [[f64; 2]; 2]) {
    if from[1] == to[1] {
        return;
    }
    let (turn, [[x0, y0], [x1, y1]]) =
        if from[1] < to[1] { (1.0, [from, to]) } else { (-1.0, [to, from]) };
    let slope = (x1 - x0) / (y1 - y0);
    // Rounding must not lead out of the edge's own columns.
    let x_at = |y: f64| (x0 + (y - y0) * slope).clamp(x0.min(x1), x0.max(x1));
    for row in y0.floor() as usize..y1.ceil() as usize {
        let [top, bottom] = [y0.max(row as f64), y1.min(row as f64 + 1.0)];
        let (a, b) = (x_at(top), x_at(bottom));
        let (height, [left, right]) = (turn * (bottom - top), [a.min(b), a.max(b)]);
        let sums = &mut sums[row * stride..(row + 1) * stride];
        let [first, last] = [left.floor(), right.ceil()];
        let mut column = first as usize;
        if last <= first + 1.0 {
            let before = 0.5 * (left + right) - first;
            sums[column] += height * (1.0 - before);
            sums[column + 1] += height * before;
            continue;
        }
        // The mean, over the edge, of what lies behind it in each column: 1 where the edge passed
        // before, and the trapezium of the part that is in the column.
        let (width, mut counted) = (right - left, 0.0);
        while (column as f64) < last {
            let end_of_column = column as f64 + 1.0;
            let [begin, end] = [left.max(column as f64), right.min(end_of_column)];
            let behind = (end - begin) * (end_of_column - 0.5 * (begin + end));
            let mean = (begin - left + behind) / width;
            sums[column] += height * (mean - counted);
            counted = mean;
            column += 1;
        }
        sums[column] += height * (1.0 - counted);
    }
}

/// How far the middle of a curve's control points is from straight, in pixels: |a - 2b + c|.
fn bend(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    let [x, y] = [0, 1].map(|axis| a[axis] - 2.0 * b[axis] + c[axis]);
    (x * x + y * y).sqrt()
}

/// Points of an ellipse, by two conjugate half axes.
pub fn circle(center: [f64; 2], a: [f64; 2], b: [f64; 2]) -> Vec<[f64; 2]> {
    let longest = a.iter().chain(&b).fold(0.0_f64, |most, part| most.max(part.abs()));
    // The tangent t of half the angle gives rational points: no sine is needed. An n-th of t turns
    // by 2 / n at most, and a chord of the angle h is off by r h^2 / 8.
    let parts = (2.0 * (longest / (8.0 * TOLERANCE)).sqrt()).ceil().max(2.0);
    let mut points = Vec::with_capacity(4 * parts as usize);
    for [[ax, ay], [bx, by]] in
        [[a, b], [b, a.map(|v| -v)], [a.map(|v| -v), b.map(|v| -v)], [b.map(|v| -v), a]]
    {
        for part in 0..parts as usize {
            let t = part as f64 / parts;
            let square = t * t;
            let [cosine, sine] = [(1.0 - square) / (1.0 + square), 2.0 * t / (1.0 + square)];
            points.push([center[0] + ax * cosine + bx * sine, center[1] + ay * cosine + by * sine]);
        }
    }
    points
}

/// The convex hull of points, for a polygon.
pub fn hull(mut points: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    points.dedup();
    let turns_left = |a: [f64; 2], b: [f64; 2], c: [f64; 2]| {
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) > 0.0
    };
    let half = |points: &mut dyn Iterator<Item = [f64; 2]>| {
        let mut chain: Vec<[f64; 2]> = Vec::new();
        for point in points {
            while let [.., a, b] = chain[..]
                && !turns_left(a, b, point)
            {
                chain.pop();
            }
            chain.push(point);
        }
        chain.pop();
        chain
    };
    let mut all = half(&mut points.iter().copied());
    all.extend(half(&mut points.iter().rev().copied()));
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The area that a mask covers, in pixels.
    fn area(mask: &Mask) -> f64 {
        mask.cover.iter().map(|&cover| f64::from(cover)).sum::<f64>() / 255.0
    }

    #[test]
    fn rectangles_cover_what_is_inside() {
        let mut path = Path::default();
        path.rectangle([1.25, 2.0], [4.5, 3.5]);
        let mask = path.mask();
        assert_eq!((mask.at, mask.size), ([1, 2], [4, 2]));
        // 3/4, 1, 1, 1/2 of 255, and half of them.
        assert_eq!(mask.cover, [191, 255, 255, 128, 96, 128, 128, 64]);
        let moved = path.moved([-3.0, -3.0]).mask();
        assert_eq!((moved.at, moved.cover), ([-2, -1], mask.cover));
    }

    #[test]
    fn areas_of_shapes_are_right() {
        for radius in [0.3, 1.0, 7.7, 50.0, 300.0] {
            let mut path = Path::default();
            path.disc([400.3, 400.7], radius);
            let expected = std::f64::consts::PI * radius * radius;
            let found = area(&path.mask());
            // Each pixel of the border is rounded to a 255th, and chords cut a little off.
            let most = 0.02 * (radius + 1.0) + 0.02 * radius;
            assert!((found - expected).abs() < most + 0.02, "{found} for {expected}");
        }
        // Flat, steep and one that no pixel row is crossed by.
        for corners in [
            [[0.0, 0.0], [90.5, 3.2], [41.0, 7.0]],
            [[5.5, 0.5], [7.0, 80.0], [5.2, 60.1]],
            [[0.1, 0.2], [30.9, 0.3], [11.0, 0.9]],
        ] {
            let mut path = Path::default();
            path.polygon(&corners);
            let [a, b, c]: [[f64; 2]; 3] = corners;
            let cross = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
            let found = area(&path.mask());
            assert!((found - cross.abs() / 2.0).abs() < 0.15, "{found} for {cross}/2");
        }
    }

    #[test]
    fn what_two_cover_is_covered_once() {
        let mut path = Path::default();
        path.rectangle([0.0, 0.0], [4.0, 2.0]);
        // The other way around.
        path.polygon(&[[2.0, 0.0], [2.0, 2.0], [6.0, 2.0], [6.0, 0.0]]);
        assert_eq!(path.mask().cover, [255; 12]);
    }

    #[test]
    fn a_hull_is_convex() {
        let square = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]];
        let mut points = square.to_vec();
        points.extend([[1.0, 1.0], [1.0, 0.0], [0.5, 1.5], [2.0, 2.0]]);
        assert_eq!(hull(points), square);
    }

    #[test]
    fn nothing_has_no_pixels() {
        assert_eq!(Path::default().mask().size, [0, 0]);
        assert_eq!(Path::default().bounds(), None);
    }
}
