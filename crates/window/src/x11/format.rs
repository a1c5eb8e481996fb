//! How a screen takes pixels: bits, byte order, padding, and where each colour's bits lie. Pure
//! arithmetic, no connection.

use x11rb::protocol::xproto::{ImageOrder, Screen, Setup, VisualClass, Visualtype};

/// The layout of pictures for the windows of a screen.
#[derive(Clone)]
pub(crate) struct Format {
    /// Bits that count in a pixel.
    pub depth: u8,
    /// Bits of a pixel in memory: 8, 16, 24 or 32.
    bits: usize,
    /// Bits that a row is a multiple of.
    pad: usize,
    /// Whether the byte of the highest bits comes first.
    highest_first: bool,
    /// The pixel's bits for every red, green and blue.
    levels: Box<[[u32; 256]; 3]>,
    /// Bits that are set in every pixel: opacity, on screens that have it.
    always: u32,
    /// Whether a pixel is its 0x00rrggbb as this machine has it in memory.
    plain: bool,
}

impl Format {
    /// The format of a screen; none where its pixels do not hold red, green and blue, or not in
    /// whole bytes. Another visual than the screen's own is no way out: the screen's palette would
    /// colour it.
    pub fn of(setup: &Setup, screen: &Screen) -> Option<Self> {
        let there = setup.pixmap_formats.iter().find(|format| format.depth == screen.root_depth)?;
        let visual = visual(screen).filter(|visual| visual.class == VisualClass::TRUE_COLOR)?;
        let masks = [visual.red_mask, visual.green_mask, visual.blue_mask];
        let highest_first = setup.image_byte_order == ImageOrder::MSB_FIRST;
        Self::new(
            screen.root_depth,
            [there.bits_per_pixel, there.scanline_pad],
            highest_first,
            masks,
        )
    }

    fn new(depth: u8, [bits, pad]: [u8; 2], highest_first: bool, masks: [u32; 3]) -> Option<Self> {
        if ![8, 16, 24, 32].contains(&bits) || pad == 0 || pad % 8 != 0 || masks.contains(&0) {
            return None;
        }
        let levels = masks.map(|mask| {
            let (shift, most) = (mask.trailing_zeros(), u64::from(mask >> mask.trailing_zeros()));
            // The nearest of the levels that the screen has.
            std::array::from_fn(|channel| (((channel as u64 * most + 127) / 255) << shift) as u32)
        });
        let colors = masks[0] | masks[1] | masks[2];
        let always = if depth == 32 { !colors } else { 0 };
        let plain = bits == 32
            && highest_first == cfg!(target_endian = "big")
            && masks == [0x00ff_0000, 0xff00, 0xff]
            && always == 0;
        let (bits, pad) = (bits.into(), pad.into());
        Some(Self { depth, bits, pad, highest_first, levels: Box::new(levels), always, plain })
    }

    /// Bytes of a row.
    pub fn stride(&self, columns: usize) -> usize {
        (columns * self.bits).next_multiple_of(self.pad) / 8
    }

    /// Writes a row of 0x00rrggbb; what pads it stays as it is.
    pub fn encode(&self, pixels: &[u32], row: &mut [u8]) {
        if self.plain {
            row[..4 * pixels.len()].copy_from_slice(bytemuck::cast_slice(pixels));
            return;
        }
        let bytes = self.bits / 8;
        for (&pixel, place) in pixels.iter().zip(row.chunks_exact_mut(bytes)) {
            let [_, red, green, blue] = pixel.to_be_bytes().map(usize::from);
            let value =
                self.levels[0][red] | self.levels[1][green] | self.levels[2][blue] | self.always;
            if self.highest_first {
                place.copy_from_slice(&value.to_be_bytes()[4 - bytes..]);
            } else {
                place.copy_from_slice(&value.to_le_bytes()[..bytes]);
            }
        }
    }
}

/// What a screen's own pixels are, in words.
pub(crate) fn describe(screen: &Screen) -> String {
    let kind = match visual(screen).map(|visual| visual.class) {
        Some(VisualClass::PSEUDO_COLOR | VisualClass::STATIC_COLOR) => " of a palette",
        Some(VisualClass::GRAY_SCALE | VisualClass::STATIC_GRAY) => " of grey",
        Some(VisualClass::DIRECT_COLOR) => ", each colour by a table",
        _ => "",
    };
    format!("{} bits a pixel{kind}", screen.root_depth)
}

/// A screen's own visual.
fn visual(screen: &Screen) -> Option<&Visualtype> {
    screen
        .allowed_depths
        .iter()
        .flat_map(|depth| &depth.visuals)
        .find(|visual| visual.visual_id == screen.root_visual)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn encoded(format: &Format, pixels: &[u32]) -> Vec<u8> {
        let mut row = vec![0xee; format.stride(pixels.len())];
        format.encode(pixels, &mut row);
        row
    }

    #[test]
    fn pixels_of_every_layout() {
        const RGB: [u32; 3] = [0xff_0000, 0xff00, 0xff];
        let pixels = [0x00_0a_80_ff, 0x00_ff_00_01];
        let row = |depth, size, order, masks| {
            encoded(&Format::new(depth, size, order, masks).unwrap(), &pixels)
        };
        let little = [0xff, 0x80, 0x0a, 0, 0x01, 0, 0xff, 0];
        assert_eq!(row(24, [32, 32], false, RGB), little);
        assert_eq!(row(24, [32, 32], true, RGB), [0, 0x0a, 0x80, 0xff, 0, 0xff, 0, 0x01]);
        // Red and blue the other way round.
        let swapped = [0xff, 0xff00, 0xff_0000];
        assert_eq!(row(24, [32, 32], false, swapped), [0x0a, 0x80, 0xff, 0, 0xff, 0, 0x01, 0]);
        // Three bytes a pixel; six of eight bytes are used.
        assert_eq!(row(24, [24, 32], false, RGB), [0xff, 0x80, 0x0a, 0x01, 0, 0xff, 0xee, 0xee]);
        assert_eq!(row(24, [24, 32], true, RGB), [0x0a, 0x80, 0xff, 0xff, 0, 0x01, 0xee, 0xee]);
        // Opaque.
        assert_eq!(row(32, [32, 32], false, RGB), [0xff, 0x80, 0x0a, 0xff, 0x01, 0, 0xff, 0xff]);
        // Ten bits each: 0 and 255 are 0 and 1023, 10 of 255 are 40.1 of 1023, 128 are 513.5.
        let ten = [1023 << 20, 1023 << 10, 1023];
        let value = |r: u32, g: u32, b: u32| (r << 20 | g << 10 | b).to_le_bytes();
        assert_eq!(
            row(30, [32, 32], false, ten),
            [value(40, 514, 1023), value(1023, 0, 4)].concat()
        );
        // Five, six and five; one pixel pads the row.
        let sixteen = Format::new(16, [16, 32], false, [0xf800, 0x7e0, 0x1f]).unwrap();
        let value = |r: u16, g: u16, b: u16| (r << 11 | g << 5 | b).to_le_bytes();
        assert_eq!(
            encoded(&sixteen, &[0xff_ff_ff, 0, 0x0a_80_ff]),
            [value(31, 63, 31), [0, 0], value(1, 32, 31), [0xee; 2]].concat()
        );
        assert_eq!(
            encoded(&Format::new(8, [8, 32], false, [0xe0, 0x1c, 3]).unwrap(), &[0xff_00_ff])[0],
            0xe3
        );
        assert!(Format::new(4, [4, 32], false, [4, 2, 1]).is_none());
        assert!(Format::new(8, [8, 32], false, [0, 0, 0]).is_none());
    }
}
