//! The chemical elements: their symbols, radii and colours.

/// A chemical element, by its atomic number: 1 to 118.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Element(u8);

impl Element {
    /// The element of a symbol, in any case: "CL", "Cl" and "cl" are chlorine.
    ///
    /// D and T are hydrogen. Nothing but a whole symbol has an element: blanks, charges and names
    /// of atoms ("CA1") are the caller's to take away.
    pub fn of_symbol(symbol: &str) -> Option<Self> {
        match NUMBERS[word(symbol.as_bytes())?] {
            0 => None,
            number => Some(Self(number)),
        }
    }

    /// The element of an atomic number; none of 0 and of what is above 118.
    pub fn of_number(number: u64) -> Option<Self> {
        let number = u8::try_from(number).ok()?;
        (1..=ELEMENTS.len()).contains(&usize::from(number)).then_some(Self(number))
    }

    /// The atomic number: 1 to 118.
    pub fn number(self) -> u8 {
        self.0
    }

    /// The symbol, as IUPAC writes it: "H", "Cl".
    pub fn symbol(self) -> &'static str {
        self.row().0
    }

    /// The van der Waals radius, in angstrom; none of Pm, nor of Fm (100) and what comes after it.
    ///
    /// The 44 elements of the main groups have the radii of table 12 of Mantina, Chamberlin,
    /// Valero, Cramer and Truhlar, "Consistent van der Waals Radii for the Whole Main Group",
    /// J. Phys. Chem. A 113, 5806 (2009), doi:10.1021/jp8111556. Most of them are Bondi's of 1964.
    /// Hydrogen has 1.10 there, not his 1.20.
    ///
    /// The others have those of Alvarez, "A cartography of the van der Waals territories", Dalton
    /// Trans. 42, 8617 (2013), doi:10.1039/c3dt50599e. They are larger than Bondi's: zinc has 2.39
    /// and not 1.39.
    pub fn vdw_radius(self) -> Option<f64> {
        some(self.row().1)
    }

    /// The covalent radius, in angstrom; none of Bk (97) and what comes after it.
    ///
    /// Cordero, Gómez, Platero-Prats, Revés, Echeverría, Cremades, Barragán and Alvarez, "Covalent
    /// radii revisited", Dalton Trans. 2832 (2008), doi:10.1039/b801115j. Four elements have
    /// several radii there: carbon has that of sp3 here, and Mn, Fe and Co have that of low spin.
    pub fn covalent_radius(self) -> Option<f64> {
        some(self.row().2)
    }

    /// The colour, sRGB: that of Jmol's table `argbsCpk`.
    ///
    /// The table ends at Mt (109), as Jmol's elements do. Those after it have the colour of Mt.
    pub fn color(self) -> [u8; 3] {
        let [_, color @ ..] = self.row().3.to_be_bytes();
        color
    }

    fn row(self) -> &'static Row {
        &ELEMENTS[usize::from(self.0) - 1]
    }
}

/// The symbol that a word is, in any case, as it is written; D and T stay as they are.
#[cfg(any(feature = "gro", feature = "mmcif", feature = "pdb"))]
pub(super) fn symbol(word: &[u8]) -> Option<&'static str> {
    match word {
        b"D" | b"d" => Some("D"),
        b"T" | b"t" => Some("T"),
        _ => Element::of_symbol(str::from_utf8(word).ok()?).map(Element::symbol),
    }
}

/// A radius of the table.
fn some(radius: f64) -> Option<f64> {
    (radius != NONE).then_some(radius)
}

/// Words of one letter, or two.
const WORDS: usize = 26 * 27;

/// The place of a word of one letter, or two, among all such words in any case; none of others.
const fn word(letters: &[u8]) -> Option<usize> {
    let (first, second) = match *letters {
        [first] if first.is_ascii_alphabetic() => (first, 0),
        [first, second] if first.is_ascii_alphabetic() && second.is_ascii_alphabetic() => {
            (first, second.to_ascii_lowercase() - b'a' + 1)
        }
        _ => return None,
    };
    Some((first.to_ascii_lowercase() - b'a') as usize * 27 + second as usize)
}

/// The atomic number of each word that is a symbol, and 0 of the others.
///
/// Files have a symbol for each of millions of particles: one look finds it.
static NUMBERS: [u8; WORDS] = {
    let mut numbers = [0; WORDS];
    let mut number = 1;
    while number <= ELEMENTS.len() {
        let place = word(ELEMENTS[number - 1].0.as_bytes()).expect("one letter, or two");
        numbers[place] = number as u8;
        number += 1;
    }
    numbers[word(b"D").expect("a letter")] = 1;
    numbers[word(b"T").expect("a letter")] = 1;
    numbers
};

/// Symbol, van der Waals radius, covalent radius, colour: [`Element`] says of whom they are.
type Row = (&'static str, f64, f64, u32);

/// What is no radius.
const NONE: f64 = 0.0;

/// The elements in the order of their numbers, from 1.
static ELEMENTS: [Row; 118] = [
    ("H", 1.10, 0.31, 0xFFFFFF),
    ("He", 1.40, 0.28, 0xD9FFFF),
    ("Li", 1.81, 1.28, 0xCC80FF),
    ("Be", 1.53, 0.96, 0xC2FF00),
    ("B", 1.92, 0.84, 0xFFB5B5),
    ("C", 1.70, 0.76, 0x909090),
    ("N", 1.55, 0.71, 0x3050F8),
    ("O", 1.52, 0.66, 0xFF0D0D),
    ("F", 1.47, 0.57, 0x90E050),
    ("Ne", 1.54, 0.58, 0xB3E3F5),
    ("Na", 2.27, 1.66, 0xAB5CF2),
    ("Mg", 1.73, 1.41, 0x8AFF00),
    ("Al", 1.84, 1.21, 0xBFA6A6),
    ("Si", 2.10, 1.11, 0xF0C8A0),
    ("P", 1.80, 1.07, 0xFF8000),
    ("S", 1.80, 1.05, 0xFFFF30),
    ("Cl", 1.75, 1.02, 0x1FF01F),
    ("Ar", 1.88, 1.06, 0x80D1E3),
    ("K", 2.75, 2.03, 0x8F40D4),
    ("Ca", 2.31, 1.76, 0x3DFF00),
    ("Sc", 2.58, 1.70, 0xE6E6E6),
    ("Ti", 2.46, 1.60, 0xBFC2C7),
    ("V", 2.42, 1.53, 0xA6A6AB),
    ("Cr", 2.45, 1.39, 0x8A99C7),
    ("Mn", 2.45, 1.39, 0x9C7AC7),
    ("Fe", 2.44, 1.32, 0xE06633),
    ("Co", 2.40, 1.26, 0xF090A0),
    ("Ni", 2.40, 1.24, 0x50D050),
    ("Cu", 2.38, 1.32, 0xC88033),
    ("Zn", 2.39, 1.22, 0x7D80B0),
    ("Ga", 1.87, 1.22, 0xC28F8F),
    ("Ge", 2.11, 1.20, 0x668F8F),
    ("As", 1.85, 1.19, 0xBD80E3),
    ("Se", 1.90, 1.20, 0xFFA100),
    ("Br", 1.83, 1.20, 0xA62929),
    ("Kr", 2.02, 1.16, 0x5CB8D1),
    ("Rb", 3.03, 2.20, 0x702EB0),
    ("Sr", 2.49, 1.95, 0x00FF00),
    ("Y", 2.75, 1.90, 0x94FFFF),
    ("Zr", 2.52, 1.75, 0x94E0E0),
    ("Nb", 2.56, 1.64, 0x73C2C9),
    ("Mo", 2.45, 1.54, 0x54B5B5),
    ("Tc", 2.44, 1.47, 0x3B9E9E),
    ("Ru", 2.46, 1.46, 0x248F8F),
    ("Rh", 2.44, 1.42, 0x0A7D8C),
    ("Pd", 2.15, 1.39, 0x006985),
    ("Ag", 2.53, 1.45, 0xC0C0C0),
    ("Cd", 2.49, 1.44, 0xFFD98F),
    ("In", 1.93, 1.42, 0xA67573),
    ("Sn", 2.17, 1.39, 0x668080),
    ("Sb", 2.06, 1.39, 0x9E63B5),
    ("Te", 2.06, 1.38, 0xD47A00),
    ("I", 1.98, 1.39, 0x940094),
    ("Xe", 2.16, 1.40, 0x429EB0),
    ("Cs", 3.43, 2.44, 0x57178F),
    ("Ba", 2.68, 2.15, 0x00C900),
    ("La", 2.98, 2.07, 0x70D4FF),
    ("Ce", 2.88, 2.04, 0xFFFFC7),
    ("Pr", 2.92, 2.03, 0xD9FFC7),
    ("Nd", 2.95, 2.01, 0xC7FFC7),
    ("Pm", NONE, 1.99, 0xA3FFC7),
    ("Sm", 2.90, 1.98, 0x8FFFC7),
    ("Eu", 2.87, 1.98, 0x61FFC7),
    ("Gd", 2.83, 1.96, 0x45FFC7),
    ("Tb", 2.79, 1.94, 0x30FFC7),
    ("Dy", 2.87, 1.92, 0x1FFFC7),
    ("Ho", 2.81, 1.92, 0x00FF9C),
    ("Er", 2.83, 1.89, 0x00E675),
    ("Tm", 2.79, 1.90, 0x00D452),
    ("Yb", 2.80, 1.87, 0x00BF38),
    ("Lu", 2.74, 1.87, 0x00AB24),
    ("Hf", 2.63, 1.75, 0x4DC2FF),
    ("Ta", 2.53, 1.70, 0x4DA6FF),
    ("W", 2.57, 1.62, 0x2194D6),
    ("Re", 2.49, 1.51, 0x267DAB),
    ("Os", 2.48, 1.44, 0x266696),
    ("Ir", 2.41, 1.41, 0x175487),
    ("Pt", 2.29, 1.36, 0xD0D0E0),
    ("Au", 2.32, 1.36, 0xFFD123),
    ("Hg", 2.45, 1.32, 0xB8B8D0),
    ("Tl", 1.96, 1.45, 0xA6544D),
    ("Pb", 2.02, 1.46, 0x575961),
    ("Bi", 2.07, 1.48, 0x9E4FB5),
    ("Po", 1.97, 1.40, 0xAB5C00),
    ("At", 2.02, 1.50, 0x754F45),
    ("Rn", 2.20, 1.50, 0x428296),
    ("Fr", 3.48, 2.60, 0x420066),
    ("Ra", 2.83, 2.21, 0x007D00),
    ("Ac", 2.80, 2.15, 0x70ABFA),
    ("Th", 2.93, 2.06, 0x00BAFF),
    ("Pa", 2.88, 2.00, 0x00A1FF),
    ("U", 2.71, 1.96, 0x008FFF),
    ("Np", 2.82, 1.90, 0x0080FF),
    ("Pu", 2.81, 1.87, 0x006BFF),
    ("Am", 2.83, 1.80, 0x545CF2),
    ("Cm", 3.05, 1.69, 0x785CE3),
    ("Bk", 3.40, NONE, 0x8A4FE3),
    ("Cf", 3.05, NONE, 0xA136D4),
    ("Es", 2.70, NONE, 0xB31FD4),
    ("Fm", NONE, NONE, 0xB31FBA),
    ("Md", NONE, NONE, 0xB30DA6),
    ("No", NONE, NONE, 0xBD0D87),
    ("Lr", NONE, NONE, 0xC70066),
    ("Rf", NONE, NONE, 0xCC0059),
    ("Db", NONE, NONE, 0xD1004F),
    ("Sg", NONE, NONE, 0xD90045),
    ("Bh", NONE, NONE, 0xE00038),
    ("Hs", NONE, NONE, 0xE6002E),
    ("Mt", NONE, NONE, 0xEB0026),
    ("Ds", NONE, NONE, 0xEB0026),
    ("Rg", NONE, NONE, 0xEB0026),
    ("Cn", NONE, NONE, 0xEB0026),
    ("Nh", NONE, NONE, 0xEB0026),
    ("Fl", NONE, NONE, 0xEB0026),
    ("Mc", NONE, NONE, 0xEB0026),
    ("Lv", NONE, NONE, 0xEB0026),
    ("Ts", NONE, NONE, 0xEB0026),
    ("Og", NONE, NONE, 0xEB0026),
];

#[cfg(test)]
mod tests {
    use super::*;

    fn of(symbol: &str) -> Element {
        Element::of_symbol(symbol).expect("an element")
    }

    #[test]
    fn symbols_are_found_in_any_case() {
        for number in 1..=118 {
            let element = Element::of_number(number).expect("an element");
            assert_eq!(u64::from(element.number()), number);
            let symbol = element.symbol();
            for word in [symbol.into(), symbol.to_lowercase(), symbol.to_uppercase()] {
                assert_eq!(Element::of_symbol(&word), Some(element), "{word}");
            }
            let (first, rest) = symbol.split_at(1);
            let word = first.to_lowercase() + &rest.to_uppercase();
            assert_eq!(Element::of_symbol(&word), Some(element), "{word}");
        }
        for word in ["D", "d", "T", "t"] {
            assert_eq!(of(word).symbol(), "H");
        }
        let found = NUMBERS.iter().filter(|&&number| number != 0).count();
        assert_eq!(found, 118 + 2, "no word twice");
        assert!(ELEMENTS.is_sorted_by_key(|row| of(row.0)));
    }

    #[test]
    fn what_is_no_element_is_refused() {
        let none = ["", "J", "X", "Xx", "A", "C1", "1", " C", "C ", "C-", "Uue", "CA1", "é", "鉄"];
        for word in none {
            assert_eq!(Element::of_symbol(word), None, "{word}");
        }
        for number in [0, 119, 255, 256, 257, u64::MAX] {
            assert_eq!(Element::of_number(number), None, "{number}");
        }
    }

    /// Symbol, number, van der Waals and covalent radius, colour.
    type Known = (&'static str, u8, Option<f64>, Option<f64>, [u8; 3]);

    #[test]
    fn some_elements_are_as_published() {
        const KNOWN: [Known; 16] = [
            ("H", 1, Some(1.10), Some(0.31), [0xFF, 0xFF, 0xFF]),
            ("Li", 3, Some(1.81), Some(1.28), [0xCC, 0x80, 0xFF]),
            ("B", 5, Some(1.92), Some(0.84), [0xFF, 0xB5, 0xB5]),
            ("C", 6, Some(1.70), Some(0.76), [0x90, 0x90, 0x90]),
            ("N", 7, Some(1.55), Some(0.71), [0x30, 0x50, 0xF8]),
            ("O", 8, Some(1.52), Some(0.66), [0xFF, 0x0D, 0x0D]),
            ("Cl", 17, Some(1.75), Some(1.02), [0x1F, 0xF0, 0x1F]),
            ("Ca", 20, Some(2.31), Some(1.76), [0x3D, 0xFF, 0x00]),
            ("Fe", 26, Some(2.44), Some(1.32), [0xE0, 0x66, 0x33]),
            ("Br", 35, Some(1.83), Some(1.20), [0xA6, 0x29, 0x29]),
            ("Pm", 61, None, Some(1.99), [0xA3, 0xFF, 0xC7]),
            ("Au", 79, Some(2.32), Some(1.36), [0xFF, 0xD1, 0x23]),
            ("Pa", 91, Some(2.88), Some(2.00), [0x00, 0xA1, 0xFF]),
            ("U", 92, Some(2.71), Some(1.96), [0x00, 0x8F, 0xFF]),
            ("Cf", 98, Some(3.05), None, [0xA1, 0x36, 0xD4]),
            ("Og", 118, None, None, [0xEB, 0x00, 0x26]),
        ];
        for (symbol, number, vdw, covalent, color) in KNOWN {
            let element = of(symbol);
            assert_eq!(element.number(), number, "{symbol}");
            assert_eq!(element.vdw_radius(), vdw, "{symbol}");
            assert_eq!(element.covalent_radius(), covalent, "{symbol}");
            assert_eq!(element.color(), color, "{symbol}");
        }
    }

    #[test]
    fn radii_end_where_the_tables_do() {
        for (index, &(symbol, vdw, covalent, _)) in ELEMENTS.iter().enumerate() {
            let number = index + 1;
            assert_eq!(vdw != NONE, number < 100 && symbol != "Pm", "{symbol}");
            assert_eq!(covalent != NONE, number <= 96, "{symbol}");
            assert!(vdw == NONE || (1.0..4.0).contains(&vdw), "{symbol}");
            assert!(covalent < 3.0 && (vdw == NONE || covalent < vdw), "{symbol}");
        }
    }
}
