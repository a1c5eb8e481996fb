//! Blocks become pixels: first the halo of each, then its rows of colour, then its shapes.

use super::{
    block::{Block, Rows, Shape, Style},
    light,
    raster::Mask,
};

/// Coverage of a halo next to its shape, of 255: what is behind is still seen.
const HALO: u32 = 185;

/// A block, ready to be laid over the rows of a picture.
#[derive(Clone, Debug)]
pub struct Painted {
    halo: (Mask, [u8; 3]),
    rows: Option<Rows>,
    shapes: Vec<(Mask, [u8; 3])>,
}

impl Painted {
    /// Of a block that lies at these pixels.
    pub fn new(block: &Block, pixels: [[i64; 2]; 2], style: &Style) -> Self {
        let made = |shape: &Shape| {
            let mut mask = shape.path.mask();
            if shape.letters && shape.color == [0; 3] {
                mask.cover.iter_mut().for_each(|cover| *cover = light::darker(*cover));
            }
            (mask, shape.color)
        };
        let shapes: Vec<_> = block.shapes.iter().map(made).collect();
        let mut all = empty(pixels);
        shapes.iter().for_each(|(mask, _)| join(&mut all, mask));
        if let Some(rows) = &block.rows {
            let size = [rows.width, rows.colors.len()];
            let cover = vec![255; size[0] * size[1]];
            join(&mut all, &Mask { at: rows.at, size, cover });
        }
        let halo = style.ink.map(|channel| 255 - channel);
        let halo = (spread(&all, style.halo()), halo);
        Self { halo, rows: block.rows.clone(), shapes }
    }

    /// Lays it over a row of the picture.
    pub fn row(&self, y: i64, pixels: &mut [[u8; 4]]) {
        let cover = |pixels: &mut [[u8; 4]], (mask, color): &(Mask, [u8; 3])| {
            let row = y - mask.at[1];
            if (0..mask.size[1] as i64).contains(&row) {
                let [left, width] = [mask.at[0] as usize, mask.size[0]];
                let covers = &mask.cover[row as usize * width..][..width];
                let pixels = pixels[left..left + width].iter_mut();
                pixels.zip(covers).for_each(|(pixel, &cover)| light::over(pixel, *color, cover));
            }
        };
        cover(pixels, &self.halo);
        if let Some(rows) = &self.rows
            && let Ok(row) = usize::try_from(y - rows.at[1])
            && let Some([red, green, blue]) = rows.colors.get(row)
        {
            let left = rows.at[0] as usize;
            pixels[left..left + rows.width].fill([*red, *green, *blue, 255]);
        }
        self.shapes.iter().for_each(|shape| cover(pixels, shape));
    }
}

/// No coverage of some pixels.
fn empty([[left, top], [right, bottom]]: [[i64; 2]; 2]) -> Mask {
    let size = [(right - left) as usize, (bottom - top) as usize];
    Mask { at: [left, top], size, cover: vec![0; size[0] * size[1]] }
}

/// Takes the larger coverage of both. The other lies inside.
fn join(all: &mut Mask, other: &Mask) {
    let [left, top] = [0, 1].map(|axis| (other.at[axis] - all.at[axis]) as usize);
    for row in 0..other.size[1] {
        let from = &other.cover[row * other.size[0]..][..other.size[0]];
        let to = &mut all.cover[(top + row) * all.size[0] + left..][..other.size[0]];
        to.iter_mut().zip(from).for_each(|(to, &from)| *to = (*to).max(from));
    }
}

/// What is around covered pixels: the largest coverage within a radius, which grows less towards
/// its end. The pixels of the mask reach that far beyond those that are covered.
fn spread(mask: &Mask, radius: f64) -> Mask {
    let [width, height] = mask.size;
    let reach = radius.ceil() as usize;
    let brushes = brushes(radius, reach);
    let side = 2 * reach + 1;
    let mut made = vec![0_u8; mask.cover.len()];
    for y in 0..height {
        for x in 0..width {
            let cover = mask.cover[y * width + x];
            if cover == 0 {
                continue;
            }
            if is_inside(mask, x, y) {
                // What it reaches, its neighbours reach as well.
                made[y * width + x] = HALO as u8;
                continue;
            }
            let brush = &brushes[usize::from(cover) * side * side..][..side * side];
            for (row, brush) in brush.chunks_exact(side).enumerate() {
                let start = (y + row - reach) * width + x - reach;
                let to = made[start..start + side].iter_mut();
                to.zip(brush).for_each(|(to, &from)| *to = (*to).max(from));
            }
        }
    }
    Mask { cover: made, ..*mask }
}

/// Of each coverage from 0 to 255 what it gives to a square of pixels around it.
fn brushes(radius: f64, reach: usize) -> Vec<u8> {
    let mut strengths = Vec::new();
    for (dy, dx) in (0..=2 * reach).flat_map(|dy| (0..=2 * reach).map(move |dx| (dy, dx))) {
        let [dx, dy] = [dx, dy].map(|place| place as f64 - reach as f64);
        let distance = (dx * dx + dy * dy).sqrt();
        // From a whole at half of the radius to nothing beyond it.
        let part = ((radius + 1.0 - distance) / (0.5 * radius + 1.0)).clamp(0.0, 1.0);
        strengths.push((part * f64::from(HALO) + 0.5) as u32);
    }
    let scaled = |cover: u32| strengths.iter().map(move |by| ((by * cover + 127) / 255) as u8);
    (0..=255).flat_map(scaled).collect()
}

/// Whether a pixel and all around it are covered as a whole.
fn is_inside(mask: &Mask, x: usize, y: usize) -> bool {
    let [width, height] = mask.size;
    if x == 0 || y == 0 || x + 1 >= width || y + 1 >= height {
        return false;
    }
    let whole = |row: usize| mask.cover[row * width + x - 1..][..3] == [255; 3];
    (y - 1..=y + 1).all(whole)
}
