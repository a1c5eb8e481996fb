//! A quick way through scene files with very many `[[sphere]]` tables: they are cut out and parsed in small pieces, in
//! parallel. A parser of whole files keeps every token of a file in memory, which for 1e5 spheres costs most of the time.
//!
//! The cut is by lines, so that it can be wrong inside a string of several lines. Then the piece that has the string's
//! beginning does not parse, and the whole file is read the plain way: this one only ever gives up, it reports nothing.

use std::ops::Range;

/// Bytes of a piece, about.
const PIECE: usize = 1 << 15;

/// Below this many bytes there is nothing to gain.
const WORTH: usize = 1 << 16;

/// A scene file in pieces.
pub(super) struct Batches<'t> {
    /// The file with its `[[sphere]]` tables blanked out: places in it are places in the file.
    pub rest: String,
    /// The tables, in order, some hundred in each piece.
    pub pieces: Vec<&'t str>,
}

/// Cuts a scene file, if that is worth while.
pub(super) fn cut(text: &str) -> Option<Batches<'_>> {
    if text.len() < WORTH {
        return None;
    }
    let mut runs: Vec<Range<usize>> = Vec::new();
    let (mut at, mut inside) = (0, false);
    for line in text.split_inclusive('\n') {
        let start = line.trim_start_matches([' ', '\t']);
        if start.starts_with('[') {
            let header = start.trim_end().strip_prefix("[[sphere]]");
            inside = header.is_some_and(|rest| rest.is_empty() || rest.trim_start().starts_with('#'));
            // A piece ends at a header, when it is long enough or the table is of another kind.
            if inside && runs.last().is_none_or(|run| run.end != at || run.len() > PIECE) {
                runs.push(at..at);
            }
        }
        at += line.len();
        if let (true, Some(run)) = (inside, runs.last_mut()) {
            run.end = at;
        }
    }
    let mut rest = String::with_capacity(text.len());
    for run in &runs {
        rest.push_str(&text[rest.len()..run.start]);
        rest.extend(std::iter::repeat_n(' ', run.len()));
    }
    rest.push_str(&text[rest.len()..]);
    (!runs.is_empty()).then(|| Batches { rest, pieces: runs.into_iter().map(|run| &text[run]).collect() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_and_rest_are_the_file() {
        let table = "[[sphere]]\ncenter = [1, 2, 3] # [[sphere]]\nradius = 1\n\n";
        let camera = "[camera]\nview = [1, 0, 0]\n";
        let spheres = format!("  {}[[sphere]] # last\n", table.repeat(2000));
        let text = format!("{camera}{spheres}[image]\nwidth = 4\n{}", table.repeat(3));
        let Batches { rest, pieces } = cut(&text).unwrap();
        assert_eq!(pieces.concat(), format!("{spheres}{}", table.repeat(3)));
        assert!(pieces.len() > 3 && pieces.iter().all(|piece| piece.trim_start().starts_with("[[sphere]]")));
        assert_eq!(rest.len(), text.len());
        assert_eq!(
            rest.split_whitespace().collect::<Vec<_>>().join(" "),
            "[camera] view = [1, 0, 0] [image] width = 4"
        );
        assert_eq!(rest.find("[image]"), text.find("[image]"));
        assert!(cut(camera).is_none());
        assert!(cut(&"# nothing but words\n".repeat(5000)).is_none());
        // Other tables whose names begin the same way are left alone.
        let text = "[[spheres]]\nradius = 1\n[sphere.x]\n[[sphere]].x\n".repeat(5000);
        assert!(cut(&text).is_none());
    }
}
