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
/// its end.
fn spread(mask: &Mask, radius: f64) -> Mask {
    let [width, height] = mask.size;
    let reach = radius.ceil() as i64;
    let mut brush = Vec::new();
    for (dy, dx) in (-reach..=reach).flat_map(|dy| (-reach..=reach).map(move |dx| (dy, dx))) {
        let distance = ((dx * dx + dy * dy) as f64).sqrt();
        // From a whole at half of the radius to nothing beyond it.
        let part = ((radius + 1.0 - distance) / (0.5 * radius + 1.0)).clamp(0.0, 1.0);
        let strength = (part * f64::from(HALO) + 0.5) as u32;
        if strength > 0 {
            brush.push((dx, dy, strength));
        }
    }
    let at = |x: i64, y: i64| -> Option<usize> {
        let inside = (0..width as i64).contains(&x) && (0..height as i64).contains(&y);
        inside.then(|| y as usize * width + x as usize)
    };
    let mut made = vec![0_u8; mask.cover.len()];
    for (place, &cover) in mask.cover.iter().enumerate().filter(|(_, cover)| **cover > 0) {
        let (x, y) = ((place % width) as i64, (place / width) as i64);
        let whole = |(dx, dy): (i64, i64)| at(x + dx, y + dy).is_some_and(|p| mask.cover[p] == 255);
        let near = [(-1, 0), (1, 0), (0, -1), (0, 1), (-1, -1), (1, 1), (-1, 1), (1, -1)];
        if cover == 255 && near.into_iter().all(whole) {
            // What it reaches, its neighbours reach as well.
            made[place] = HALO as u8;
            continue;
        }
        for &(dx, dy, strength) in &brush {
            let Some(place) = at(x + dx, y + dy) else { continue };
            let value = ((strength * u32::from(cover) + 127) / 255) as u8;
            made[place] = made[place].max(value);
        }
    }
    Mask { cover: made, ..*mask }
}
