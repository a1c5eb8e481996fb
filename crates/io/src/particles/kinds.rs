//! Which kinds there are among particles: those that a legend names.

use rayon::prelude::*;

use super::{Words, elements::Element};
use crate::legend::{MOST_KINDS, too_many};

/// The elements that there are, by number, and at the end none where something is no element.
/// `code` is the place in `known` of each particle's element.
pub fn elements(
    count: usize,
    known: &[Option<Element>],
    code: impl Fn(usize) -> Option<usize> + Sync,
) -> Vec<Option<Element>> {
    let there = present(count, known.len(), &code);
    let mut found: Vec<_> =
        known.iter().zip(&there).filter(|(_, is)| **is).map(|(e, _)| *e).collect();
    if there[known.len()] {
        found.push(None);
    }
    found.sort_by_key(|element| element.map_or(u8::MAX, Element::number));
    found.dedup();
    found
}

/// Places of the words that there are, in the order of these.
pub fn words(words: &Words) -> Vec<usize> {
    let codes = &words.codes;
    let there = present(codes.len(), words.words.len(), &|index| Some(codes[index] as usize));
    let mut found: Vec<usize> = (0..words.words.len()).filter(|code| there[*code]).collect();
    found.sort_by_key(|code| &words.words[*code]);
    found
}

/// Which of so many codes there are; and at the end whether something has none.
fn present(
    count: usize,
    codes: usize,
    code: &(impl Fn(usize) -> Option<usize> + Sync),
) -> Vec<bool> {
    let none = || vec![false; codes + 1];
    let note = |mut there: Vec<bool>, index: usize| {
        there[code(index).unwrap_or(codes)] = true;
        there
    };
    let both =
        |one: Vec<bool>, other: Vec<bool>| one.into_iter().zip(other).map(|(a, b)| a | b).collect();
    (0..count).into_par_iter().with_min_len(PIECE).fold(none, note).reduce(none, both)
}

/// Particles that a thread looks at, at least.
const PIECE: usize = 1 << 16;

/// The numbers that there are, in rising order.
///
/// # Errors
/// When there are more than a legend has room for.
pub fn numbers(
    count: usize,
    number: impl Fn(usize) -> Option<i64> + Sync,
) -> Result<Vec<i64>, String> {
    /// Rising numbers; one more than the most that there may be stands for any more.
    fn insert(found: &mut Vec<i64>, number: i64) {
        if found.len() <= MOST_KINDS
            && let Err(at) = found.binary_search(&number)
        {
            found.insert(at, number);
        }
    }
    let note = |mut found: Vec<i64>, index: usize| {
        if let Some(number) = number(index) {
            insert(&mut found, number);
        }
        found
    };
    let both = |mut one: Vec<i64>, other: Vec<i64>| {
        other.into_iter().for_each(|number| insert(&mut one, number));
        one
    };
    let indices = (0..count).into_par_iter().with_min_len(PIECE);
    let found = indices.fold(Vec::new, note).reduce(Vec::new, both);
    if found.len() > MOST_KINDS { Err(too_many()) } else { Ok(found) }
}
