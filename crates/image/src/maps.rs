//! Colour maps: a number between 0 and 1, or a category, becomes a colour.
//!
//! The tables are matplotlib's, byte for byte. `maps/README.md` says who made them, and
//! `maps/make.py` writes them.

use std::fmt;

/// A colour map: a table of sRGB colours, by its name.
///
/// A continuous map has 256 colours in the order of the numbers that they show. The colours of a
/// categorical map have no order: neighbours are easily told apart.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Map {
    name: &'static str,
    /// Whether the colours have no order.
    categorical: bool,
    /// At least one, sRGB.
    colors: &'static [[u8; 3]],
}

/// A map from the bytes of its table: red, green and blue of each colour, in order.
const fn map(name: &'static str, categorical: bool, bytes: &'static [u8]) -> Map {
    let (colors, rest) = bytes.as_chunks();
    assert!(!colors.is_empty() && rest.is_empty(), "a table is whole colours");
    Map { name, categorical, colors }
}

impl Map {
    /// All of them: the continuous ones, then the categorical ones.
    pub const ALL: [Self; 10] = [
        map("viridis", false, include_bytes!("maps/viridis.rgb")),
        map("magma", false, include_bytes!("maps/magma.rgb")),
        map("inferno", false, include_bytes!("maps/inferno.rgb")),
        map("plasma", false, include_bytes!("maps/plasma.rgb")),
        map("cividis", false, include_bytes!("maps/cividis.rgb")),
        map("turbo", false, include_bytes!("maps/turbo.rgb")),
        map("batlow", false, include_bytes!("maps/batlow.rgb")),
        map("coolwarm", false, include_bytes!("maps/coolwarm.rgb")),
        map("tab10", true, include_bytes!("maps/tab10.rgb")),
        map("tab20", true, include_bytes!("maps/tab20.rgb")),
    ];

    /// The map of numbers where none is asked for.
    pub const VIRIDIS: Self = Self::ALL[0];

    /// The map of categories where none is asked for.
    pub const TAB10: Self = Self::ALL[8];

    /// The map of a name, which is in lower case; none of other names.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|map| map.name == name)
    }

    /// Its name, in lower case.
    pub fn name(self) -> &'static str {
        self.name
    }

    /// Whether the colours have no order, and show categories rather than numbers.
    pub fn is_categorical(self) -> bool {
        self.categorical
    }

    /// The colour at a place between 0 and 1, sRGB; none of NaN.
    ///
    /// Of n colours, the place t has number floor(n t), as matplotlib's maps have it, and 1 has the
    /// last. A place below 0 has the first colour, one above 1 the last.
    pub fn color(self, t: f64) -> Option<[u8; 3]> {
        if t.is_nan() {
            return None;
        }
        let colors = self.colors.len();
        // The cast saturates: what is below 0 is at 0.
        let index = (t * colors as f64) as usize;
        Some(self.colors[index.min(colors - 1)])
    }

    /// The colour of a category, sRGB: the entry of its index, modulo the length of the table.
    ///
    /// A continuous map answers too, with one of its 256 colours.
    pub fn category(self, index: u64) -> [u8; 3] {
        self.colors[(index % self.colors.len() as u64) as usize]
    }
}

/// The place of a value in a range, for [`Map::color`]: 0 at the lower end, 1 at the upper one, and
/// beyond them outside of the two. NaN has none, and is NaN.
///
/// In a range of one number every place is 0.
pub fn place(value: f64, [low, high]: [f64; 2]) -> f64 {
    // Halves, whose differences are within the range of f64.
    let length = 0.5 * high - 0.5 * low;
    let place = if length > 0.0 { (0.5 * value - 0.5 * low) / length } else { 0.0 };
    if value.is_nan() { value } else { place }
}

impl fmt::Debug for Map {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Map").field(&self.name).finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of each map: its length, and the colours at 0, a quarter, a half and the end.
    ///
    /// Matplotlib 3.11.2 and cmcrameri 1.10 gave them: `cmap(index, bytes=True)`.
    const KNOWN: [(&str, usize, [[u8; 3]; 4]); 10] = [
        ("viridis", 256, [[68, 1, 84], [58, 82, 139], [32, 144, 140], [253, 231, 36]]),
        ("magma", 256, [[0, 0, 3], [80, 18, 123], [182, 54, 121], [251, 252, 191]]),
        ("inferno", 256, [[0, 0, 3], [87, 15, 109], [187, 55, 84], [252, 254, 164]]),
        ("plasma", 256, [[12, 7, 134], [126, 3, 167], [203, 71, 119], [239, 248, 33]]),
        ("cividis", 256, [[0, 34, 77], [67, 78, 107], [124, 123, 120], [253, 231, 55]]),
        ("turbo", 256, [[48, 18, 59], [40, 187, 235], [164, 252, 59], [122, 4, 2]]),
        ("batlow", 256, [[1, 25, 89], [33, 95, 96], [130, 130, 49], [250, 204, 250]]),
        ("coolwarm", 256, [[58, 76, 192], [141, 175, 253], [221, 220, 219], [179, 3, 38]]),
        ("tab10", 10, [[31, 119, 180], [44, 160, 44], [140, 86, 75], [23, 190, 207]]),
        ("tab20", 20, [[31, 119, 180], [152, 223, 138], [140, 86, 75], [158, 218, 229]]),
    ];

    #[test]
    fn tables_are_matplotlibs() {
        assert_eq!(KNOWN.map(|(name, ..)| name), Map::ALL.map(Map::name));
        for (name, length, known) in KNOWN {
            let map = Map::named(name).expect("a map");
            assert_eq!(map.colors.len(), length, "{name}");
            let places = [0.0, 0.25, 0.5, 1.0];
            assert_eq!(places.map(|t| map.color(t).expect("a colour")), known, "{name}");
        }
    }

    #[test]
    fn names_are_exact() {
        for map in Map::ALL {
            assert_eq!(Map::named(map.name()), Some(map));
            assert_eq!(Map::named(&map.name().to_uppercase()), None);
            assert_eq!(map.is_categorical(), map.name().starts_with("tab"));
        }
        for name in ["", "viridi", "viridis ", "viridis_r", "jet"] {
            assert_eq!(Map::named(name), None, "{name}");
        }
        assert_eq!(format!("{:?}", Map::ALL[0]), "Map(\"viridis\")");
    }

    #[test]
    fn every_colour_has_its_part_of_the_range() {
        for map in Map::ALL {
            let colors = map.colors.len();
            for (index, &color) in map.colors.iter().enumerate() {
                // The middle of the part: it is far from rounding.
                let t = (index as f64 + 0.5) / colors as f64;
                assert_eq!(map.color(t), Some(color), "{map:?} at {t}");
                assert_eq!(map.category(index as u64), color);
                assert_eq!(map.category((index + 7 * colors) as u64), color);
            }
            map.category(u64::MAX);
        }
        // A multiple of 1/256 is exact, and has the colour above it.
        let map = Map::ALL[0];
        for index in 0..256 {
            let t = index as f64 / 256.0;
            assert_eq!(map.color(t), Some(map.colors[index]));
            assert_eq!(map.color(t.next_down()), Some(map.colors[index.saturating_sub(1)]));
        }
    }

    #[test]
    fn places_are_from_the_lower_end_to_the_upper() {
        assert_eq!([-2.0, 0.0, 3.0, 8.0].map(|v| place(v, [-2.0, 3.0])), [0.0, 0.4, 1.0, 2.0]);
        assert_eq!(
            [f64::MIN, 0.0, f64::MAX].map(|v| place(v, [f64::MIN, f64::MAX])),
            [0.0, 0.5, 1.0]
        );
        assert_eq!([6.0, 7.0, 8.0].map(|v| place(v, [7.0, 7.0])), [0.0; 3]);
        assert!(place(f64::NAN, [0.0, 1.0]).is_nan() && place(f64::NAN, [1.0, 1.0]).is_nan());
    }

    #[test]
    fn ends_hold_what_is_outside() {
        for map in Map::ALL {
            let [first, last] = [map.colors[0], map.colors[map.colors.len() - 1]];
            for t in [0.0, -0.0, -1e-300, -0.5, -7.0, f64::MIN, f64::NEG_INFINITY] {
                assert_eq!(map.color(t), Some(first), "{map:?} at {t}");
            }
            for t in [1.0, 1.0_f64.next_down(), 1.0_f64.next_up(), 9.0, f64::MAX, f64::INFINITY] {
                assert_eq!(map.color(t), Some(last), "{map:?} at {t}");
            }
            assert_eq!(map.color(f64::NAN), None);
            assert_eq!(map.color(-f64::NAN), None);
        }
    }
}
