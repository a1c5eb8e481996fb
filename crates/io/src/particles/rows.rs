//! Tables as text, read in parallel: blocks of lines go straight into the columns.
//!
//! A batch of blocks is read at a time. First the rows of each block are counted, so that it is
//! known where in the columns they belong, and then each is parsed into its place. No more of the
//! text than a batch is in memory, and nothing is copied afterwards. Which thread reads what leaves
//! no trace: of several faults the first in the file is told, and words are numbered in the file's
//! order.

use std::{
    hash::{BuildHasher, RandomState},
    ops::Range,
    sync::OnceLock,
};

use rayon::prelude::*;

use super::{
    Values, Words,
    data::{Data, Line, blanks, is_blank, word},
    number,
};
use crate::input::report::Fault;
use planisphere_core::{drawing::Control, scene::Reals, text};
use planisphere_memory as memory;

/// Bytes of a block of lines.
const BLOCK: usize = 1 << 19;

/// Blocks of a batch, for each thread, and at most: threads wait for each other only between
/// batches.
const BLOCKS: [usize; 2] = [16, 128];

/// A column that is being read.
#[derive(Debug)]
pub(super) enum Store {
    /// Real numbers, so many a row.
    Reals(Vec<f64>, usize),
    /// Integers, so many a row.
    Integers(Vec<i64>, usize),
    /// One word a row.
    Words(Vec<u32>, Lexicon),
}

impl Store {
    /// Of real numbers, so many a row.
    pub fn reals(width: usize) -> Self {
        Self::Reals(Vec::new(), width)
    }

    /// Of one integer a row.
    pub fn integers() -> Self {
        Self::Integers(Vec::new(), 1)
    }

    /// Of one word a row.
    pub fn words() -> Self {
        Self::Words(Vec::new(), Lexicon::default())
    }

    /// Bytes of a row.
    fn row_bytes(&self) -> usize {
        match self {
            Self::Reals(_, width) | Self::Integers(_, width) => 8 * width,
            Self::Words(..) => 4,
        }
    }

    /// Sets the number of rows; none where the memory cannot be had.
    fn set_rows(&mut self, rows: usize) -> Option<()> {
        fn set<T: Copy + Default + bytemuck::Zeroable>(
            values: &mut Vec<T>,
            length: usize,
        ) -> Option<()> {
            if values.is_empty() {
                *values = bytemuck::allocation::try_zeroed_vec(length).ok()?;
            }
            values.try_reserve(length.saturating_sub(values.len())).ok()?;
            values.resize(length, T::default());
            Some(())
        }
        match self {
            Self::Reals(values, width) => set(values, rows * *width),
            Self::Integers(values, width) => set(values, rows * *width),
            Self::Words(codes, _) => set(codes, rows),
        }
    }

    /// The places of some rows, of which each block has some.
    fn slots(&mut self, first: usize, blocks: &[usize]) -> Vec<Slot<'_>> {
        fn cut<'a, T>(
            mut rest: &'a mut [T],
            blocks: &[usize],
            width: usize,
            slot: impl Fn(&'a mut [T]) -> Slot<'a>,
        ) -> Vec<Slot<'a>> {
            let mut slots = Vec::with_capacity(blocks.len());
            for rows in blocks {
                let (part, others) = rest.split_at_mut(rows * width);
                slots.push(slot(part));
                rest = others;
            }
            slots
        }
        match self {
            Self::Reals(values, width) => {
                let width = *width;
                cut(&mut values[first * width..], blocks, width, |part| Slot::Reals(part, width))
            }
            Self::Integers(values, width) => {
                let width = *width;
                cut(&mut values[first * width..], blocks, width, |part| Slot::Integers(part, width))
            }
            Self::Words(codes, _) => {
                cut(&mut codes[first..], blocks, 1, |part| Slot::Words(part, Lexicon::default()))
            }
        }
    }

    /// The real numbers; of a store of integers, these.
    pub fn into_reals(self) -> Vec<f64> {
        match self {
            Self::Reals(values, _) => values,
            Self::Integers(values, _) => values.into_iter().map(|value| value as f64).collect(),
            Self::Words(..) => Vec::new(),
        }
    }

    /// What was read.
    pub fn into_values(self) -> Values {
        match self {
            Self::Reals(values, _) => Values::Reals(Reals::F64(values.into())),
            Self::Integers(values, _) => Values::Integers(values),
            Self::Words(codes, lexicon) => Values::Words(Words { codes, words: lexicon.words }),
        }
    }
}

/// Words, each with its number in the order in which they came.
#[derive(Debug, Default)]
pub(super) struct Lexicon {
    words: Vec<Box<str>>,
    /// What each word is looked for by.
    hashes: Vec<u32>,
    /// One more than the number of a word, at the place of its hash or the first free one behind
    /// it; 0 where there is none. At least half of them are 0, and there are 2^n.
    places: Vec<u32>,
    /// Short words that came last, each packed into one number that is not 0, and their numbers, at
    /// the places of a hash of their own. There are none before some words came.
    recent: Vec<(u64, u32)>,
    /// Words that were looked for among all.
    looked_for: usize,
}

/// A word of at most seven bytes as one number, with its length; none of a longer one.
#[inline]
fn packed(word: &[u8]) -> Option<u64> {
    (word.len() < 8)
        .then(|| word.iter().fold(word.len() as u64 + 1, |all, byte| all << 8 | u64::from(*byte)))
}

/// What a word is looked for by: no input can be made of words that have it in common.
fn hash(word: &[u8]) -> u32 {
    static STATE: OnceLock<RandomState> = OnceLock::new();
    STATE.get_or_init(RandomState::new).hash_one(word) as u32
}

impl Lexicon {
    /// The number of a word.
    #[inline]
    pub fn number(&mut self, found: &[u8]) -> u32 {
        let Some(packed) = packed(found) else { return self.long(found) };
        let place = (packed.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 58) as usize;
        match self.recent.get(place) {
            Some((recent, number)) if *recent == packed => return *number,
            _ => {}
        }
        let number = self.long(found);
        match self.recent.get_mut(place) {
            Some(recent) => *recent = (packed, number),
            // A column of few rows does without.
            None if self.looked_for > 16 => self.recent = vec![(0, 0); 64],
            None => {}
        }
        number
    }

    fn long(&mut self, found: &[u8]) -> u32 {
        self.looked_for += 1;
        let word = String::from_utf8_lossy(found);
        let hash = hash(word.as_bytes());
        match self.find(hash, word.as_bytes()) {
            Some(number) => number,
            None => self.add(word.into(), hash),
        }
    }

    /// The number of a word that is there.
    fn find(&self, hash: u32, word: &[u8]) -> Option<u32> {
        let last = self.places.len().checked_sub(1)?;
        let mut place = hash as usize & last;
        loop {
            let number = self.places[place].checked_sub(1)?;
            let is_same = self.hashes[number as usize] == hash
                && self.words[number as usize].as_bytes() == word;
            if is_same {
                return Some(number);
            }
            place = (place + 1) & last;
        }
    }

    /// Adds a word that is not there.
    fn add(&mut self, word: Box<str>, hash: u32) -> u32 {
        let number = u32::try_from(self.words.len()).expect("fewer words than spheres");
        self.words.push(word);
        self.hashes.push(hash);
        if 2 * self.words.len() > self.places.len() {
            self.places = vec![0; (2 * self.places.len()).max(8)];
            (0..=number).for_each(|number| self.place(number));
        } else {
            self.place(number);
        }
        number
    }

    /// Sets the place of a word.
    fn place(&mut self, number: u32) {
        let last = self.places.len() - 1;
        let mut place = self.hashes[number as usize] as usize & last;
        while self.places[place] != 0 {
            place = (place + 1) & last;
        }
        self.places[place] = number + 1;
    }

    /// Takes over the words of another; gives the number of each here.
    fn take(&mut self, other: Self) -> Vec<u32> {
        let words = other.words.into_iter().zip(other.hashes);
        let number = |(word, hash): (Box<str>, u32)| {
            self.find(hash, word.as_bytes()).unwrap_or_else(|| self.add(word, hash))
        };
        words.map(number).collect()
    }

    /// The words so far, in the order of their numbers.
    pub fn words(&self) -> &[Box<str>] {
        &self.words
    }

    /// The words, in the order of their numbers.
    pub fn into_words(self) -> Vec<Box<str>> {
        self.words
    }
}

/// Where the rows of a block go.
#[derive(Debug)]
enum Slot<'a> {
    Reals(&'a mut [f64], usize),
    Integers(&'a mut [i64], usize),
    Words(&'a mut [u32], Lexicon),
}

/// Where one row goes.
#[derive(Debug)]
pub(super) struct Row<'r, 's> {
    slots: &'r mut [Slot<'s>],
    row: usize,
}

impl Row<'_, '_> {
    /// Sets a real number of a column.
    #[inline]
    pub fn set_real(&mut self, column: usize, component: usize, value: f64) {
        match &mut self.slots[column] {
            Slot::Reals(values, width) => values[self.row * *width + component] = value,
            Slot::Integers(..) | Slot::Words(..) => unreachable!("a column of other values"),
        }
    }

    /// Sets an integer of a column.
    #[inline]
    pub fn set_integer(&mut self, column: usize, component: usize, value: i64) {
        match &mut self.slots[column] {
            Slot::Integers(values, width) => values[self.row * *width + component] = value,
            Slot::Reals(..) | Slot::Words(..) => unreachable!("a column of other values"),
        }
    }

    /// Sets the word of a column.
    #[inline]
    pub fn set_word(&mut self, column: usize, value: &[u8]) {
        match &mut self.slots[column] {
            Slot::Words(codes, lexicon) => codes[self.row] = lexicon.number(value),
            Slot::Reals(..) | Slot::Integers(..) => unreachable!("a column of other values"),
        }
    }
}

/// Which lines of a text are rows.
pub(super) enum Which<'f> {
    /// So many lines, all of them. Fewer are a fault, which says what the rows are of.
    First(usize, &'f (dyn Fn(usize) -> Fault + Sync)),
    /// Those up to the end that are rows. The others are handed to nobody.
    Those(&'f (dyn Fn(Line<'_>) -> bool + Sync)),
}

/// Reads rows of a text, from a place to another one at most, into columns. Each row is a line.
/// Gives the place behind the last of them, and how many there are.
pub(super) fn read(
    data: &Data,
    range: Range<usize>,
    which: &Which<'_>,
    stores: &mut [Store],
    control: &Control,
    parse: impl Fn(Line<'_>, &mut Row<'_, '_>) -> Result<(), Fault> + Sync,
) -> Result<(usize, usize), Fault> {
    let whole = &data.as_slice()[..range.end];
    let (mut at, mut rows) = (range.start, 0);
    if let Which::First(count, _) = which {
        set_rows(stores, *count)?;
    }
    loop {
        let done = (at - range.start) as f32 / range.len().max(1) as f32;
        control.reach(done);
        Fault::if_cancelled(control)?;
        let left = match which {
            Which::First(count, _) => count - rows,
            Which::Those(_) => usize::MAX,
        };
        if at == whole.len() || left == 0 {
            break;
        }
        let counted_block = |block: Range<usize>| {
            data.begin(block.clone());
            (block.clone(), count(whole, block, which))
        };
        let blocks = cut(whole, at, blocks_at_once()).into_par_iter();
        let mut counted: Vec<(Range<usize>, usize)> = blocks.map(counted_block).collect();
        keep(whole, &mut counted, left);
        let of_blocks: Vec<usize> = counted.iter().map(|(_, rows)| *rows).collect();
        let more: usize = of_blocks.iter().sum();
        if let Which::Those(_) = which {
            room_for(stores, rows, more, (at, counted.last().map_or(at, |(b, _)| b.end)), &range)?;
        }
        fill(whole, &counted, stores, rows, which, &parse)?;
        let end = counted.last().map_or(at, |(block, _)| block.end);
        data.done(at..end);
        (at, rows) = (end, rows + more);
    }
    match which {
        Which::First(count, fault) if rows < *count => return Err(fault(rows)),
        _ => set_rows(stores, rows)?,
    }
    Ok((at, rows))
}

/// Makes room for rows of which more come: about as many as the text that is left has, at once, so
/// that nothing is moved.
fn room_for(
    stores: &mut [Store],
    rows: usize,
    more: usize,
    (at, end): (usize, usize),
    range: &Range<usize>,
) -> Result<(), Fault> {
    let length = |store: &Store| match store {
        Store::Reals(values, width) => values.len() / width,
        Store::Integers(values, width) => values.len() / width,
        Store::Words(codes, _) => codes.len(),
    };
    let there = stores.first().map_or(usize::MAX, length);
    if rows + more <= there {
        return Ok(());
    }
    let bytes_a_row = (end - at) as f64 / more.max(1) as f64;
    let expected = (range.end - at) as f64 / bytes_a_row * 1.02;
    set_rows(stores, rows + more.max(expected as usize + 64))
}

/// Sets the number of rows of all columns, if there is memory for them.
fn set_rows(stores: &mut [Store], rows: usize) -> Result<(), Fault> {
    let row_bytes: usize = stores.iter().map(Store::row_bytes).sum();
    let needed = row_bytes.saturating_mul(rows);
    let refused = |there: String| {
        let needed = text::bytes(needed as u64);
        Fault::whole(
            format!("{rows} rows take {needed} of memory, and {there}"),
            "free some memory, or draw fewer particles at a time",
        )
    };
    memory::room(needed as u64)
        .map_err(|available| refused(format!("{} is available", text::bytes(available))))?;
    let set = stores.iter_mut().try_for_each(|store| store.set_rows(rows));
    set.ok_or_else(|| refused("it cannot be had".into()))
}

/// The next blocks of a text, each of whole lines.
fn cut(whole: &[u8], mut at: usize, blocks: usize) -> Vec<Range<usize>> {
    let mut found = Vec::with_capacity(blocks);
    while at < whole.len() && found.len() < blocks {
        let least = (at + BLOCK).min(whole.len());
        let end = memchr::memchr(b'\n', &whole[least - 1..]).map_or(whole.len(), |n| least + n);
        found.push(at..end);
        at = end;
    }
    found
}

/// How many rows a block has.
fn count(whole: &[u8], block: Range<usize>, which: &Which<'_>) -> usize {
    match which {
        Which::First(..) => {
            let bytes = &whole[block];
            let cut_short = bytes.last().is_some_and(|byte| *byte != b'\n');
            memchr::memchr_iter(b'\n', bytes).count() + usize::from(cut_short)
        }
        Which::Those(is_row) => lines(whole, block).filter(|line| is_row(*line)).count(),
    }
}

/// Where the first line begins, from a place to another one at most, that is looked for. After a
/// first block all threads look.
pub(super) fn find(
    data: &Data,
    range: Range<usize>,
    is: impl Fn(Line<'_>) -> bool + Sync,
) -> Option<usize> {
    let whole = data.as_slice().get(..range.end)?;
    let (mut at, mut some) = (range.start, 1);
    while at < whole.len() {
        let blocks = cut(whole, at, some);
        at = blocks.last()?.end;
        let found = blocks.into_par_iter().find_map_first(|block| {
            lines(whole, block).find(|line| is(*line)).map(|line| line.start)
        });
        if found.is_some() {
            return found;
        }
        some = blocks_at_once();
    }
    None
}

/// Blocks of a batch.
fn blocks_at_once() -> usize {
    (BLOCKS[0] * rayon::current_num_threads()).min(BLOCKS[1])
}

/// The lines of a block.
fn lines(whole: &[u8], block: Range<usize>) -> impl Iterator<Item = Line<'_>> {
    let mut at = block.start;
    std::iter::from_fn(move || {
        let line = Line::at(&whole[..block.end], at)?;
        at = line.next;
        Some(line)
    })
}

/// Keeps the blocks of so many rows, of which the last may be cut behind one of its lines.
fn keep(whole: &[u8], blocks: &mut Vec<(Range<usize>, usize)>, mut left: usize) {
    for number in 0..blocks.len() {
        let (block, rows) = &mut blocks[number];
        if *rows >= left {
            if *rows > left {
                let mut ends = memchr::memchr_iter(b'\n', &whole[block.clone()]);
                let end = ends.nth(left - 1).expect("as many lines were counted");
                (block.end, *rows) = (block.start + end + 1, left);
            }
            blocks.truncate(number + 1);
            return;
        }
        left -= *rows;
    }
}

/// Parses blocks into the rows that begin at `first`.
fn fill(
    whole: &[u8],
    blocks: &[(Range<usize>, usize)],
    stores: &mut [Store],
    first: usize,
    which: &Which<'_>,
    parse: &(impl Fn(Line<'_>, &mut Row<'_, '_>) -> Result<(), Fault> + Sync),
) -> Result<(), Fault> {
    let of_blocks: Vec<usize> = blocks.iter().map(|(_, rows)| *rows).collect();
    let mut places: Vec<Vec<Slot<'_>>> = blocks.iter().map(|_| Vec::new()).collect();
    for store in stores.iter_mut() {
        for (places, slot) in places.iter_mut().zip(store.slots(first, &of_blocks)) {
            places.push(slot);
        }
    }
    let read = |(slots, (block, _)): (&mut Vec<Slot<'_>>, &(Range<usize>, usize))| {
        let is_row = |line: &Line<'_>| match which {
            Which::First(..) => true,
            Which::Those(is_row) => is_row(*line),
        };
        let found = lines(whole, block.clone()).filter(is_row).enumerate();
        for (row, line) in found {
            parse(line, &mut Row { slots, row })?;
        }
        Ok(())
    };
    let results: Vec<Result<(), Fault>> = places.par_iter_mut().zip(blocks).map(read).collect();
    results.into_iter().collect::<Result<(), Fault>>()?;

    let lexicons = lexicons(places);
    take_words(stores, lexicons, first, &of_blocks);
    Ok(())
}

/// The words of each block, in the order of the file: column, words, block.
fn lexicons(places: Vec<Vec<Slot<'_>>>) -> Vec<(usize, Lexicon, usize)> {
    let mut lexicons = Vec::new();
    for (block, slots) in places.into_iter().enumerate() {
        for (column, slot) in slots.into_iter().enumerate() {
            if let Slot::Words(_, lexicon) = slot {
                lexicons.push((column, lexicon, block));
            }
        }
    }
    lexicons
}

/// Numbers the words of blocks as those of their columns.
fn take_words(
    stores: &mut [Store],
    lexicons: Vec<(usize, Lexicon, usize)>,
    first: usize,
    of_blocks: &[usize],
) {
    for (column, lexicon, block) in lexicons {
        let Store::Words(codes, all) = &mut stores[column] else { continue };
        let numbers = all.take(lexicon);
        if numbers.iter().enumerate().any(|(from, to)| from != *to as usize) {
            let start = first + of_blocks[..block].iter().sum::<usize>();
            let codes = &mut codes[start..start + of_blocks[block]];
            codes.iter_mut().for_each(|code| *code = numbers[*code as usize]);
        }
    }
}

/// Reads rows that are no lines: each call sets one, or says that there is none. Gives how many
/// there are.
pub(super) fn read_in_turn(
    stores: &mut [Store],
    control: &Control,
    mut next: impl FnMut(&mut Row<'_, '_>) -> Result<bool, Fault>,
) -> Result<usize, Fault> {
    const ROWS: usize = 1 << 14;
    let mut first = 0;
    loop {
        Fault::if_cancelled(control)?;
        set_rows(stores, first + ROWS)?;
        let mut slots: Vec<Slot<'_>> =
            stores.iter_mut().flat_map(|store| store.slots(first, &[ROWS])).collect();
        let mut rows = 0;
        while rows < ROWS && next(&mut Row { slots: &mut slots, row: rows })? {
            rows += 1;
        }
        let lexicons = lexicons(vec![slots]);
        take_words(stores, lexicons, first, &[rows]);
        first += rows;
        if rows < ROWS {
            set_rows(stores, first)?;
            return Ok(first);
        }
    }
}

/// What a cell of a line is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// A coordinate: a finite real number.
    Finite,
    /// A real number.
    Real,
    /// An integer.
    Integer,
    /// A word.
    Word,
}

/// One cell of a line: its name in the file, and the column and component that it goes to.
#[derive(Clone, Debug)]
pub(super) struct Place {
    /// What it is called in messages, such as "`x`".
    pub name: String,
    /// How it is read.
    pub kind: Kind,
    /// Which store it goes to.
    pub column: usize,
    /// Which number of a row of that store.
    pub component: usize,
}

/// The cells of a line, parted by blanks.
#[derive(Clone, Debug)]
pub(super) struct Layout {
    /// The cells, in the order of the line.
    pub places: Vec<Place>,
    /// Whether more cells may follow, which are not read.
    pub more: bool,
}

impl Layout {
    /// Bytes of the shortest row: a digit and what parts it from the next.
    pub fn least(&self) -> usize {
        (2 * self.places.len()).max(1)
    }

    /// Reads a line into a row.
    pub fn parse(&self, line: Line<'_>, row: &mut Row<'_, '_>) -> Result<(), Fault> {
        self.parse_start(line, row).map(|_| ())
    }

    /// The same, and says whether more cells follow that are not read.
    pub fn parse_start(&self, line: Line<'_>, row: &mut Row<'_, '_>) -> Result<bool, Fault> {
        let text = line.text;
        let mut at = 0;
        for (number, place) in self.places.iter().enumerate() {
            at += blanks(&text[at..]);
            let rest = &text[at..];
            if rest.is_empty() {
                return Err(self.too_few(line, number));
            }
            let cell = || {
                let length = word(rest);
                (&rest[..length], line.start + at..line.start + at + length)
            };
            let Place { kind, column, component, name } = place;
            at += match kind {
                Kind::Finite | Kind::Real => {
                    let Some((value, length)) = number::leading(rest) else {
                        let (cell, span) = cell();
                        return Err(number::not_a_number(name, cell, span));
                    };
                    if *kind == Kind::Finite && !value.is_finite() {
                        let (cell, span) = cell();
                        return Err(number::not_finite(name, cell, span));
                    }
                    row.set_real(*column, *component, value);
                    length
                }
                Kind::Integer => {
                    let Some((value, length)) = number::leading_integer(rest) else {
                        let (cell, span) = cell();
                        return Err(number::not_an_integer(name, cell, span));
                    };
                    row.set_integer(*column, *component, value);
                    length
                }
                Kind::Word => {
                    let length = word(rest);
                    row.set_word(*column, &rest[..length]);
                    length
                }
            };
        }
        let rest = &text[at..];
        let more = rest.iter().any(|byte| !is_blank(*byte));
        if more && !self.more {
            let from = line.start + at + blanks(rest);
            return Err(Fault::new(
                format!(
                    "the line has {} cells, but there are {} columns",
                    line.cells().count(),
                    self.places.len()
                ),
                from..line.span().end,
                "too many",
                "correct the line, or the names of the columns before it",
            ));
        }
        Ok(more)
    }

    fn too_few(&self, line: Line<'_>, found: usize) -> Fault {
        let end = line.span().end;
        let names: Vec<&str> = self.places.iter().map(|place| place.name.as_str()).collect();
        let what = if found == 0 { "is blank".into() } else { format!("has {found} cells") };
        Fault::new(
            format!("the line {what}, but {} are needed: {}", names.len(), names.join(" ")),
            end..end,
            format!("no {}", names[found]),
            "correct the line, or write the file again",
        )
    }
}

#[cfg(test)]
mod tests {
    use bytes::Bytes;

    use super::*;

    /// A number and a word a line, of which the words repeat in a way that no block does.
    fn text(rows: usize) -> Vec<u8> {
        let line = |row: usize| format!("{}.5 w{}\n", row, row * row % 1013);
        (0..rows).map(line).collect::<String>().into_bytes()
    }

    fn layout() -> Layout {
        let place =
            |name: &str, kind, column| Place { name: name.into(), kind, column, component: 0 };
        Layout { places: vec![place("x", Kind::Finite, 0), place("w", Kind::Word, 1)], more: false }
    }

    fn check(stores: Vec<Store>, rows: usize) {
        let [x, w] = <[Store; 2]>::try_from(stores).unwrap();
        let wanted: Vec<f64> = (0..rows).map(|row| row as f64 + 0.5).collect();
        assert_eq!(x.into_reals(), wanted);
        let Values::Words(Words { codes, words }) = w.into_values() else { panic!("words") };
        assert_eq!(codes.len(), rows);
        for (row, code) in codes.iter().enumerate() {
            assert_eq!(*words[*code as usize], format!("w{}", row * row % 1013));
        }
        assert_eq!(&*words[0], "w0", "in the order of the file");
    }

    #[test]
    fn rows_go_to_their_places() {
        let rows = 400_000;
        let mut whole = text(rows);
        whole.extend(b"something else\n");
        let (data, layout) = (Data::from(Bytes::from(whole)), layout());
        let control = Control::new();
        let parse = |line: Line<'_>, row: &mut Row<'_, '_>| layout.parse(line, row);

        let mut stores = vec![Store::reals(1), Store::words()];
        let missing = |_| Fault::whole("cut short", "");
        let which = Which::First(rows, &missing);
        let (end, read_rows) =
            read(&data, 0..data.len(), &which, &mut stores, &control, parse).unwrap();
        assert_eq!((end, read_rows), (data.len() - 15, rows));
        check(stores, rows);

        let mut stores = vec![Store::reals(1), Store::words()];
        let is_row = |line: Line<'_>| line.text[0] != b's';
        let which = Which::Those(&is_row);
        let (end, read_rows) =
            read(&data, 0..data.len(), &which, &mut stores, &control, parse).unwrap();
        assert_eq!((end, read_rows), (data.len(), rows));
        check(stores, rows);

        let mut stores = vec![Store::reals(1), Store::words()];
        let which = Which::First(rows + 1, &missing);
        let fault = read(&data, 0..data.len(), &which, &mut stores, &control, parse);
        let error = fault.expect_err("no number").into_error_in("it", data.as_slice());
        assert_eq!((error.line(), error.column()), (Some(400_001), Some(1)), "{error}");
        let which = Which::First(rows + 2, &missing);
        let layout = Layout { more: true, places: vec![layout.places[1].clone()] };
        let parse = |line: Line<'_>, row: &mut Row<'_, '_>| layout.parse(line, row);
        let mut stores = vec![Store::reals(1), Store::words()];
        let fault = read(&data, 0..data.len(), &which, &mut stores, &control, parse);
        let error = fault.expect_err("too few").into_error_in("it", data.as_slice());
        assert!(error.message().contains("cut short"), "{error}");
    }
}
