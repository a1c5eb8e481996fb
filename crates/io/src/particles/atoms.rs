//! What formats of molecules share: elements by the names of atoms, positions that are alternates
//! of one another, boxes by lengths and angles.

use std::{cmp::Ordering, ops::Range};

use rayon::prelude::*;

use super::{
    Column, Role, Values, Words,
    elements::symbol,
    number,
    rows::{Lexicon, Row, Store},
};

/// How an element is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum How {
    /// By the name of the atom, as the format or its programs agree.
    Name = 1,
    /// By a letter of that name alone.
    Letter = 2,
    /// By nothing: there is none, or it is not known.
    Nothing = 3,
}

/// An element by a name: its symbol, or no word.
pub(super) type Found = (&'static str, How);

/// No element is found.
const NOTHING: Found = ("", How::Nothing);

/// Sets the element of a row that was found by its name, with a mark that [`settle`] takes off.
pub(super) fn set_found(row: &mut Row<'_, '_>, column: usize, (symbol, how): Found) {
    let mut marked = [how as u8, 0, 0];
    let length = symbol.len().min(2);
    marked[1..=length].copy_from_slice(&symbol.as_bytes()[..length]);
    row.set_word(column, &marked[..=length]);
}

/// Takes the marks off the elements; says how many were found in each way.
pub(super) fn settle(Words { mut codes, words }: Words) -> (Words, [usize; 3]) {
    let mut plain = Lexicon::default();
    let (mut numbers, mut ways) = (Vec::with_capacity(words.len()), Vec::new());
    for word in &words {
        let way = word.bytes().next().filter(|mark| (1..=3).contains(mark));
        let bytes = word.as_bytes();
        numbers.push(plain.number(if way.is_some() { &bytes[1..] } else { bytes }));
        ways.push(way.unwrap_or(0));
    }
    let mut counts = [0; 4];
    for code in &mut codes {
        counts[usize::from(ways[*code as usize])] += 1;
        *code = numbers[*code as usize];
    }
    let [_, name, letter, nothing] = counts;
    (Words { codes, words: plain.into_words() }, [name, letter, nothing])
}

/// The element by a name of which only the letters are known.
pub(super) fn element_of_name(name: &[u8], residue: &[u8]) -> Found {
    if let Some(found) = certain(name, residue) {
        return found;
    }
    let letters = without_digits(name);
    let two = letters.get(..2).unwrap_or(b"");
    if let Some(found) = capital_and_small(letters) {
        return (found, How::Name);
    }
    let number = letters.get(2..).unwrap_or(b"x").iter().all(u8::is_ascii_digit);
    if let Some(found @ ("Cl" | "Br" | "Fe")) = symbol(two)
        && number
    {
        return (found, How::Name);
    }
    let one = letters.get(..1).unwrap_or(b"");
    symbol(one).or_else(|| symbol(two)).map_or(NOTHING, |symbol| (symbol, How::Letter))
}

/// The element by the four columns of a name in a PDB file: a symbol ends in the second of them.
pub(super) fn element_of_columns(columns: &[u8], residue: &[u8]) -> Found {
    let name = columns.trim_ascii();
    if let Some(found) = certain(name, residue) {
        return found;
    }
    let letters = without_digits(name);
    let one = symbol(letters.get(..1).unwrap_or(b""));
    let two = letters.get(..2).and_then(symbol);
    let is_full = columns.get(3).is_some_and(|last| *last != b' ');
    let begins = columns.first().is_some_and(u8::is_ascii_alphabetic);
    if let Some(found) = capital_and_small(letters) {
        return (found, How::Name);
    }
    // Two columns of letters that name no other atom than one of this element, in what is neither
    // a protein nor a nucleic acid.
    let alone = letters.get(2..).is_none_or(|rest| rest.iter().all(u8::is_ascii_digit));
    // Names of four letters begin in the first column whatever their element is.
    let symbol = match (one, two) {
        (Some("H"), Some("Hg")) if begins && !is_full => two,
        (Some("D"), Some("Dy")) if begins && !is_full => two,
        (Some("H" | "D"), _) => one,
        (_, Some("Cl" | "Br" | "Si" | "Se")) if begins || alone => two,
        (_, Some("Fe")) if alone => two,
        (Some("C" | "N" | "O" | "P" | "S"), _) if is_full => one,
        _ if begins => two.or(one),
        _ => one.or(two),
    };
    symbol.map_or(NOTHING, |symbol| (symbol, How::Name))
}

/// Whether the element of a PDB file's own columns is none of a standard residue: programs that do
/// not know the columns of names take carbon alpha for calcium.
pub(super) fn is_mistaken(symbol: &str, name: &[u8], residue: &[u8]) -> bool {
    symbol.len() == 2 && certain(name, residue).is_some_and(|(other, _)| other.len() == 1)
}

/// The symbol that a name begins with as symbols are written: a capital letter and a small one.
fn capital_and_small(name: &[u8]) -> Option<&'static str> {
    match name {
        [first, second, ..] if first.is_ascii_uppercase() && second.is_ascii_lowercase() => {
            symbol(&name[..2])
        }
        _ => None,
    }
}

/// The element by a name in a residue where all are known: of proteins, nucleic acids and water,
/// and ions, whose residues have their name.
fn certain(name: &[u8], residue: &[u8]) -> Option<Found> {
    let mut upper = [0; 5];
    let upper = upper.get_mut(..residue.len())?;
    upper.copy_from_slice(residue);
    upper.make_ascii_uppercase();
    let residue: &[u8] = upper;
    let letters = without_digits(name);
    let first = letters.first()?.to_ascii_uppercase();
    let is = |symbol| Some((symbol, How::Name));
    if is_water(residue) {
        return match first {
            b'O' => is("O"),
            b'H' => is("H"),
            b'D' => is("D"),
            // Sites of charge, which are no atoms.
            b'M' | b'L' | b'E' | b'V' => Some(NOTHING),
            _ => None,
        };
    }
    if is_standard(residue) {
        return match first {
            // Masses of virtual sites, which are no atoms.
            b'M' => Some(NOTHING),
            b'H' => is("H"),
            b'D' => is("D"),
            b'C' => is("C"),
            b'N' => is("N"),
            b'O' => is("O"),
            b'S' if letters.eq_ignore_ascii_case(b"SE") => is("Se"),
            b'S' => is("S"),
            b'P' => is("P"),
            _ => None,
        };
    }
    let (of_name, of_residue) = (without_charge(name), without_charge(residue));
    let ion = match of_residue {
        b"SOD" => "Na",
        b"CLA" => "Cl",
        b"POT" => "K",
        b"CAL" => "Ca",
        b"CES" => "Cs",
        b"LIT" => "Li",
        b"RUB" => "Rb",
        b"BAR" => "Ba",
        b"CAD" => "Cd",
        b"ION" => ion_of_name(of_name)?,
        b"CL" if of_name.eq_ignore_ascii_case(b"CLA") => "Cl",
        _ if of_name.eq_ignore_ascii_case(of_residue) => ion_of_name(of_name)?,
        _ => return None,
    };
    is(ion)
}

/// The element of an ion by its name.
fn ion_of_name(name: &[u8]) -> Option<&'static str> {
    symbol(name).or_else(|| match name.to_ascii_uppercase().as_slice() {
        b"SOD" => Some("Na"),
        b"CLA" => Some("Cl"),
        b"POT" => Some("K"),
        b"CAL" => Some("Ca"),
        b"CES" => Some("Cs"),
        _ => None,
    })
}

fn without_digits(name: &[u8]) -> &[u8] {
    let digits = name.iter().take_while(|byte| byte.is_ascii_digit()).count();
    &name[digits..]
}

/// The name of an ion without its charge, such as of `CL-`, `MG2+` and `ZN2`.
fn without_charge(name: &[u8]) -> &[u8] {
    let length = name.iter().take_while(|byte| byte.is_ascii_alphabetic()).count();
    &name[..length]
}

fn is_water(residue: &[u8]) -> bool {
    matches!(
        residue,
        b"HOH"
            | b"SOL"
            | b"WAT"
            | b"H2O"
            | b"DOD"
            | b"TIP"
            | b"TIP3"
            | b"TIP4"
            | b"TIP5"
            | b"TP3"
            | b"TIP3P"
            | b"TIP4P"
            | b"TIP5P"
            | b"T3P"
            | b"T4P"
            | b"SPC"
            | b"SPCE"
            | b"OPC"
    )
}

/// Whether a residue is one of proteins or nucleic acids, in its protonation or at an end of a
/// chain as force fields name it.
fn is_standard(residue: &[u8]) -> bool {
    let is_acid = |residue: &[u8]| {
        matches!(
            residue,
            b"ALA"
                | b"ARG"
                | b"ASN"
                | b"ASP"
                | b"CYS"
                | b"GLN"
                | b"GLU"
                | b"GLY"
                | b"HIS"
                | b"ILE"
                | b"LEU"
                | b"LYS"
                | b"MET"
                | b"PHE"
                | b"PRO"
                | b"SER"
                | b"THR"
                | b"TRP"
                | b"TYR"
                | b"VAL"
                | b"ASX"
                | b"GLX"
                | b"SEC"
                | b"PYL"
                | b"MSE"
                | b"HID"
                | b"HIE"
                | b"HIP"
                | b"HSD"
                | b"HSE"
                | b"HSP"
                | b"CYX"
                | b"CYM"
                | b"CYN"
                | b"ASH"
                | b"GLH"
                | b"LYN"
                | b"LYP"
                | b"ACE"
                | b"NME"
                | b"NMA"
        )
    };
    match residue {
        [b'N' | b'C', acid @ ..] if acid.len() == 3 && is_acid(acid) => true,
        [b'D' | b'R', b'A' | b'C' | b'G' | b'U' | b'T' | b'I']
        | [b'D' | b'R', b'A' | b'C' | b'G' | b'U' | b'T' | b'I', b'3' | b'5' | b'N']
        | [b'A' | b'C' | b'G' | b'U' | b'T']
        | [b'A' | b'C' | b'G' | b'U' | b'T', b'3' | b'5'] => true,
        b"ADE" | b"CYT" | b"GUA" | b"THY" | b"URA" => true,
        acid => is_acid(acid),
    }
}

/// Which columns tell what an atom is, for its alternates.
pub(super) struct Sites<'a> {
    /// Those that tell the residue: chain, number, insertion code.
    pub residue: &'a [usize],
    /// The name of the residue.
    pub residue_name: Option<usize>,
    /// The name of the atom.
    pub name: usize,
    /// Which of the alternates it is; no word if there are none.
    pub alternate: usize,
    /// How much of it is there.
    pub occupancy: Option<usize>,
}

/// Leaves out all alternates of an atom but that of highest occupancy, the first among equals; says
/// how many were left out. Where residues of several names are at one place of a chain, those of
/// the name that has the highest occupancy stay.
pub(super) fn without_alternates(stores: &mut [Store], sites: &Sites<'_>) -> usize {
    let Some(Store::Words(alternates, lexicon)) = stores.get(sites.alternate) else { return 0 };
    // A column that was blank throughout was not set.
    if lexicon.words().is_empty() {
        return 0;
    }
    let blank = lexicon.words().iter().position(|word| word.is_empty());
    let blank = blank.map_or(u32::MAX, |at| at as u32);
    if alternates.par_iter().all(|code| *code == blank) {
        return 0;
    }
    let is_alternate = |row: usize| alternates[row] != blank;
    let key = |column: usize, row: usize| key(&stores[column], row);
    let residue = |a: usize, b: usize| {
        let mut keys = sites.residue.iter().map(|column| key(*column, a).cmp(&key(*column, b)));
        keys.find(|order| order.is_ne()).unwrap_or(Ordering::Equal)
    };
    let occupancy = |row: usize| match sites.occupancy.map(|column| &stores[column]) {
        Some(Store::Reals(values, _)) if !values[row].is_nan() => values[row],
        _ => f64::NEG_INFINITY,
    };
    let rows = alternates.len();
    let mut kept = vec![true; rows];
    // Those that may be alternates of one another: all of a residue that has some.
    let mut candidates: Vec<(u32, u32)> = Vec::new();
    let mut start = 0;
    while start < rows {
        let end = (start + 1..rows).find(|row| residue(start, *row).is_ne()).unwrap_or(rows);
        if (start..end).any(is_alternate) {
            if let Some(column) = sites.residue_name {
                one_residue(start..end, |row| key(column, row), is_alternate, occupancy, &mut kept);
            }
            let kept = (start..end).filter(|row| kept[*row]);
            candidates.extend(kept.map(|row| (row as u32, 0)));
        }
        start = end;
    }
    // The second of an atom's A is none of the first's alternates: residues are counted from 1
    // again where their numbers end.
    let atom = |a: usize, b: usize| residue(a, b).then(key(sites.name, a).cmp(&key(sites.name, b)));
    candidates.par_sort_unstable_by(|(a, _), (b, _)| {
        let (one, other) = (*a as usize, *b as usize);
        atom(one, other).then(alternates[one].cmp(&alternates[other])).then(a.cmp(b))
    });
    for at in 1..candidates.len() {
        let [(before, turn), (row, _)] = [candidates[at - 1], candidates[at]];
        let (before, row) = (before as usize, row as usize);
        if alternates[before] == alternates[row] && atom(before, row).is_eq() {
            candidates[at].1 = turn + 1;
        }
    }
    candidates.par_sort_unstable_by(|(a, turn_a), (b, turn_b)| {
        atom(*a as usize, *b as usize).then(turn_a.cmp(turn_b)).then(a.cmp(b))
    });
    let same =
        |a: &(u32, u32), b: &(u32, u32)| a.1 == b.1 && atom(a.0 as usize, b.0 as usize).is_eq();
    for group in candidates.chunk_by(same) {
        let mut best = group[0].0 as usize;
        for (row, _) in &group[1..] {
            let row = *row as usize;
            let left_out = if occupancy(row) > occupancy(best) { best } else { row };
            kept[left_out] = false;
            best = if left_out == best { row } else { best };
        }
    }
    stores.iter_mut().for_each(|store| keep(store, &kept));
    kept.iter().filter(|kept| !**kept).count()
}

/// Of alternates in a residue that has several names, keeps those of one name.
fn one_residue(
    rows: Range<usize>,
    name: impl Fn(usize) -> u64,
    is_alternate: impl Fn(usize) -> bool,
    occupancy: impl Fn(usize) -> f64,
    kept: &mut [bool],
) {
    let alternates = || rows.clone().filter(|row| is_alternate(*row));
    let Some(mut best) = alternates().next() else { return };
    for row in alternates() {
        if occupancy(row) > occupancy(best) {
            best = row;
        }
    }
    for row in alternates().filter(|row| name(*row) != name(best)) {
        kept[row] = false;
    }
}

/// What tells the value of a row from others of its column.
fn key(store: &Store, row: usize) -> u64 {
    match store {
        Store::Reals(values, width) => values[row * width].to_bits(),
        Store::Integers(values, width) => values[row * width] as u64,
        Store::Words(codes, _) => u64::from(codes[row]),
    }
}

/// Keeps some rows of a column.
fn keep(store: &mut Store, kept: &[bool]) {
    fn keep<T: Copy>(values: &mut Vec<T>, width: usize, kept: &[bool]) {
        let mut end = 0;
        for (row, _) in kept.iter().enumerate().filter(|(_, kept)| **kept) {
            values.copy_within(row * width..(row + 1) * width, end);
            end += width;
        }
        values.truncate(end);
    }
    match store {
        Store::Reals(values, width) => keep(values, *width, kept),
        Store::Integers(values, width) => keep(values, *width, kept),
        Store::Words(codes, _) => keep(codes, 1, kept),
    }
}

/// A column of a file; none if it is blank in all rows.
pub(super) fn column(name: &str, role: Role, store: Store) -> Option<Column> {
    let values = store.into_values();
    let blank = match &values {
        Values::Words(words) => words.words.iter().all(|word| word.is_empty()),
        Values::Reals(reals) => (0..reals.len()).all(|row| reals.get(row).is_nan()),
        Values::Integers(_) | Values::Bytes(_) => false,
    };
    (!blank).then(|| Column::named(name, values).with_role(role))
}

/// What a person should hear of alternates that were left out.
pub(super) fn note_of_alternates(left_out: usize) -> Option<String> {
    let what = match left_out {
        0 => return None,
        1 => "1 alternate position was".into(),
        more => format!("{more} alternate positions were"),
    };
    Some(format!("{what} left out: the ones of highest occupancy are drawn"))
}

/// What a person should hear of elements that were found by names, of so many atoms.
pub(super) fn note_of_elements([name, letter, nothing]: [usize; 3], atoms: usize) -> Vec<String> {
    let mut notes = Vec::new();
    if name + letter > 0 {
        let alone = match letter {
            0 => String::new(),
            letter => format!(", {letter} of them from the first letter alone"),
        };
        let found = name + letter;
        notes.push(format!(
            "elements were derived from the names of {found} of {atoms} atoms{alone}"
        ));
    }
    if nothing > 0 {
        notes.push(format!("{nothing} of {atoms} atoms have no element that is known"));
    }
    notes
}

/// The edges of a box by their lengths and the angles between them in degrees: the first along x,
/// the second in the plane of x and y. None if there is no such box.
pub(super) fn edges([a, b, c]: [f64; 3], angles: [f64; 3]) -> Option<[[f64; 3]; 3]> {
    let [alpha, beta, gamma] =
        angles.map(|angle| if angle == 90.0 { 0.0 } else { angle.to_radians().cos() });
    let sine = (1.0 - gamma * gamma).sqrt();
    let y = (alpha - beta * gamma) / sine;
    let z = (1.0 - beta * beta - y * y).sqrt();
    let edges = [[a, 0.0, 0.0], [b * gamma, b * sine, 0.0], [c * beta, c * y, c * z]];
    let is_one = edges.iter().flatten().all(|value| value.is_finite())
        && [a, b * sine, c * z].into_iter().all(|length| length > 0.0);
    is_one.then_some(edges)
}

/// The bytes of some columns of a line, without the blanks around them; fewer of a short line.
#[inline]
pub(super) fn field(text: &[u8], columns: Range<usize>) -> &[u8] {
    let mut cell = text.get(columns.start..).unwrap_or(b"");
    cell = cell.get(..columns.len()).unwrap_or(cell);
    while let [b' ', rest @ ..] = cell {
        cell = rest;
    }
    while let [rest @ .., b' '] = cell {
        cell = rest;
    }
    cell
}

/// An integer that is all of a cell.
#[inline]
pub(super) fn digits(cell: &[u8]) -> Option<i64> {
    let (value, length) = number::leading_integer(cell)?;
    (length == cell.len()).then_some(value)
}

/// A real number that is all of a cell, and mostly a short one such as `-12.345`.
#[inline]
pub(super) fn short(cell: &[u8]) -> Option<f64> {
    // Integers of 15 digits and such powers of ten are exact: one division gives the nearest.
    const POWERS: [f64; 16] =
        [1.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15];
    let negative = cell.first() == Some(&b'-');
    let digits = &cell[usize::from(negative)..];
    let (mut all, mut behind, mut point) = (0u64, 0, false);
    if digits.len() > 15 {
        return number::real(cell);
    }
    for byte in digits {
        let digit = byte.wrapping_sub(b'0');
        if digit < 10 {
            all = 10 * all + u64::from(digit);
            behind += usize::from(point);
        } else if *byte == b'.' && !point {
            point = true;
        } else {
            return number::real(cell);
        }
    }
    if digits.len() == usize::from(point) {
        return None;
    }
    let value = all as f64 / POWERS[behind];
    Some(if negative { -value } else { value })
}

/// A real number of eight columns, as `%8.3f` writes it; none if it is written in another way.
#[inline]
pub(super) fn eight(columns: &[u8]) -> Option<f64> {
    columns.try_into().ok().and_then(|columns| packed(u64::from_le_bytes(columns)))
}

/// A real number of six columns, as `%6.2f` writes it; none if it is written in another way.
#[inline]
pub(super) fn six(columns: &[u8]) -> Option<f64> {
    let [a, b, c, d, e, f] = *columns else { return None };
    packed(u64::from_le_bytes([b' ', a, b, c, d, e, f, b'0']))
}

/// A real number of eight bytes, of which the fifth is the point: all digits are looked at, and
/// added up, at once.
#[inline]
fn packed(bytes: u64) -> Option<f64> {
    const ONES: u64 = 0x0101_0101_0101_0101;
    const HIGH: u64 = 0xf0 * ONES;
    let mut head = bytes as u32;
    // Blanks before the number, and its sign, become zeros.
    let blanks = (head ^ 0x2020_2020).trailing_zeros() & !7;
    head |= 0x1010_1010 & !u32::MAX.checked_shl(blanks).unwrap_or(0);
    let sign = (bytes >> blanks) as u8 == b'-';
    head = head.wrapping_add(u32::from(sign) * 3u32.checked_shl(blanks).unwrap_or(0));
    let tail = bytes & (0x00ff_ffff << 40);
    let digits = u64::from(b'0') | u64::from(head) << 8 | tail;
    let is_number = (bytes >> 32) as u8 == b'.'
        && digits & HIGH == u64::from(b'0') * ONES
        && digits.wrapping_add(6 * ONES) & HIGH == u64::from(b'0') * ONES;
    // Pairs of digits, then all four of them.
    let ones = digits & (0x0f * ONES);
    let pairs = ones.wrapping_mul(10).wrapping_add(ones >> 8);
    let (even, odd) = (pairs & 0x00ff_0000_00ff, pairs >> 16 & 0x00ff_0000_00ff);
    let all = even
        .wrapping_mul(100 + (1_000_000 << 32))
        .wrapping_add(odd.wrapping_mul(1 + (10_000 << 32)));
    let value = (all >> 32) as f64 / 1000.0;
    // Signs follow no pattern: no branch is taken for them.
    is_number.then_some(f64::from_bits(value.to_bits() | u64::from(sign) << 63))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_eight_columns_are_the_nearest() {
        for columns in [
            "   0.000",
            "  -0.001",
            "-999.999",
            "9999.999",
            " -12.345",
            "    .500",
            "   -.500",
            "   1.2e1",
            "  1 .000",
            "-   .000",
            " - 1.000",
            "  --.000",
            "   x.000",
            "   1.0 0",
            "  +1.000",
            "        ",
            "1234.-00",
            "1\u{7f}34.000",
        ] {
            let wanted: Option<f64> = columns.trim_start().parse().ok();
            let found = eight(columns.as_bytes());
            let read = wanted.filter(|_| !columns.contains(['e', '+']));
            assert_eq!(found.map(f64::to_bits), read.map(f64::to_bits), "{columns}");
        }
        assert_eq!([six(b"  0.29"), six(b"-12.34")], [Some(0.29), Some(-12.34)]);
        assert_eq!([six(b" 1.0  "), six(b"      "), six(b"****.*")], [None; 3]);
    }

    #[test]
    fn elements_are_those_of_their_residues() {
        for (columns, residue, wanted) in [
            // Carbon alpha and calcium.
            (" CA ", "ALA", "C"),
            ("CA  ", "ALA", "C"),
            ("CA  ", " CA", "Ca"),
            (" CA ", "LIG", "C"),
            ("CA  ", "LIG", "Ca"),
            ("HG  ", "SER", "H"),
            ("HG  ", " HG", "Hg"),
            ("HG11", "VAL", "H"),
            ("HG21", "LIG", "H"),
            ("HO1 ", "LIG", "H"),
            ("1HB ", "LIG", "H"),
            ("1HB ", "ALA", "H"),
            ("2CL ", "LIG", "Cl"),
            (" Si ", "X", "Si"),
            (" CL ", "UNK", "Cl"),
            (" CL ", "ALA", "C"),
            (" FE ", "HEM", "Fe"),
            (" CLA", "CL", "Cl"),
            (" CA ", "UNK", "C"),
            (" MN1", "ALA", ""),
            ("SE  ", "MSE", "Se"),
            (" SD ", "MET", "S"),
            ("CL12", "LIG", "Cl"),
            ("CD12", "LIG", "C"),
            ("FE  ", "HEM", "Fe"),
            ("FE12", "CLU", "Fe"),
            (" ZN ", "LIG", "Zn"),
            (" NA ", " NA", "Na"),
            ("NA  ", "HEM", "Na"),
            (" NA ", "HEM", "N"),
            ("CL  ", "CL-", "Cl"),
            ("SOD ", "SOD", "Na"),
            ("POT ", "POT", "K"),
            (" P  ", "DA5", "P"),
            (" MW ", "SOL", ""),
            (" X1 ", "LIG", ""),
            ("    ", "LIG", ""),
            (" CA ", "LONGER", "C"),
        ] {
            let found = element_of_columns(columns.as_bytes(), residue.trim().as_bytes());
            assert_eq!(found.0, wanted, "{columns} {residue}");
        }
    }

    #[test]
    fn elements_of_names_without_columns() {
        for (name, residue, wanted, how) in [
            ("CA", "GLY", "C", How::Name),
            ("CA", "CA", "Ca", How::Name),
            ("CAL", "CAL", "Ca", How::Name),
            ("SOD", "ION", "Na", How::Name),
            ("NA", "NA+", "Na", How::Name),
            ("CL-", "CL", "Cl", How::Name),
            ("K", "K", "K", How::Name),
            ("ZN", "ZN2", "Zn", How::Name),
            ("OW", "SOL", "O", How::Name),
            ("HW2", "SOL", "H", How::Name),
            ("MW", "SOL", "", How::Nothing),
            ("1HB2", "NALA", "H", How::Name),
            ("CL1", "LIG", "Cl", How::Name),
            ("Na1", "LIG", "Na", How::Name),
            ("C12", "LIG", "C", How::Letter),
            ("MG", "LIG", "Mg", How::Letter),
            ("FE", "HEM", "Fe", How::Name),
            ("CL", "UNK", "Cl", How::Name),
            ("Cu", "UNK", "Cu", How::Name),
            ("MCB1", "ALA", "", How::Nothing),
            ("X", "LIG", "", How::Nothing),
        ] {
            let found = element_of_name(name.as_bytes(), residue.as_bytes());
            assert_eq!(found, (wanted, how), "{name} {residue}");
        }
    }

    #[test]
    fn short_numbers_are_the_nearest() {
        for cell in [
            "0",
            "-0.000",
            "-12.345",
            "0.1",
            ".5",
            "5.",
            "123456789.12345",
            "999999999999999",
            "1e5",
            "+1.5",
            "0.3",
            "1234567890123456.7",
            "-999.999",
        ] {
            let wanted: f64 = cell.parse().unwrap();
            assert_eq!(short(cell.as_bytes()).map(f64::to_bits), Some(wanted.to_bits()), "{cell}");
        }
        for cell in ["", "-", ".", "-.", "1.2.3", "1 2", "--1", "x"] {
            assert_eq!(short(cell.as_bytes()), None, "{cell}");
        }
    }

    #[test]
    fn boxes_by_lengths_and_angles() {
        let wanted = [[2.0, 0.0, 0.0], [0.0, 3.0, 0.0], [0.0, 0.0, 4.0]];
        assert_eq!(edges([2.0, 3.0, 4.0], [90.0; 3]), Some(wanted));
        let [_, b, c] = edges([1.0; 3], [60.0; 3]).unwrap();
        assert!((b[0] - 0.5).abs() < 1e-15 && (b[1] - 0.75f64.sqrt()).abs() < 1e-15);
        assert!((c[2] - (2.0f64 / 3.0).sqrt()).abs() < 1e-15, "{c:?}");
        assert_eq!(edges([0.0, 1.0, 1.0], [90.0; 3]), None);
        assert_eq!(edges([1.0; 3], [150.0; 3]), None);
        assert_eq!(edges([1.0; 3], [90.0, 90.0, 180.0]), None);
    }
}
