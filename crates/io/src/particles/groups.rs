//! Groups of particles, such as chains, residues and molecules: a number for each, by a column.
//!
//! * The name is that of a column, in any case; or one of three words: **chain**, **residue** and
//!   **molecule** mean the column that the format has for it.
//! * Particles of equal values are of one group. Numbers of residues are counted anew in each
//!   chain, and in files without chains often for each kind of residue: a column of them is taken
//!   together with those of chains and segments, of insertion codes and of residues' names.

use std::collections::HashMap;

use super::{
    Column, Particles, Values,
    spheres::{Unfit, named},
};
use planisphere_core::text;

/// What columns are called that hold chains.
const CHAINS: [&str; 7] =
    ["chainID", "auth_asym_id", "label_asym_id", "chain", "chain_id", "segID", "segment"];

/// What columns are called that hold numbers of residues.
const RESIDUES: [&str; 8] = [
    "resSeq",
    "auth_seq_id",
    "label_seq_id",
    "residue_number",
    "resid",
    "residue",
    "residue_id",
    "resnum",
];

/// What columns are called that hold molecules.
const MOLECULES: [&str; 4] = ["mol", "molecule", "molecule_id", "mol_id"];

/// Columns that tell residues of one number apart.
const WITH_RESIDUES: [&str; 10] = [
    "chainID",
    "segID",
    "auth_asym_id",
    "chain",
    "chain_id",
    "iCode",
    "pdbx_PDB_ins_code",
    "resName",
    "auth_comp_id",
    "residue_name",
];

/// The group of each particle.
///
/// # Errors
/// When there is no such column, or its values are of no groups.
pub fn groups(particles: &Particles, name: &str) -> Result<Vec<u32>, Unfit> {
    let find =
        |name: &str| particles.columns.iter().find(|column| column.name.eq_ignore_ascii_case(name));
    let meant: &[&str] = match name.to_ascii_lowercase().as_str() {
        "chain" => &CHAINS,
        "residue" => &RESIDUES,
        "molecule" => &MOLECULES,
        _ => &[],
    };
    // Some programs leave chains blank, and name segments.
    let is_blank = |column: &&Column| match &column.values {
        Values::Words(words) => words.words.iter().all(|word| word.trim().is_empty()),
        _ => false,
    };
    let mut known = meant.iter().filter_map(|name| find(name));
    let meant = known.clone().find(|column| !is_blank(column)).or_else(|| known.next());
    let axis = ["x", "y", "z"].iter().any(|axis| axis.eq_ignore_ascii_case(name));
    let column = match find(name).or(meant) {
        Some(column) => column,
        None if axis => return Err(real(name)),
        None => named(particles, name)?,
    };
    let mut groups = numbered(column)?;
    if RESIDUES.iter().any(|name| column.name.eq_ignore_ascii_case(name)) {
        let beside = WITH_RESIDUES.iter().filter_map(|name| find(name));
        for other in beside.filter(|other| !std::ptr::eq(*other, column)) {
            // What is not of single words or integers tells nothing apart.
            if let Ok(other) = numbered(other) {
                groups = joined(&groups, &other);
            }
        }
    }
    Ok(groups)
}

/// That a column holds real numbers.
fn real(name: &str) -> Unfit {
    Unfit {
        words: format!(
            "column `{}` holds real numbers, of which hardly two are equal: they make no groups",
            text::value(name)
        ),
        fix: "name a column of integers or of words, such as a chain, a molecule or a type".into(),
    }
}

/// A number for each value of a column, equal for equal values.
fn numbered(column: &Column) -> Result<Vec<u32>, Unfit> {
    if column.width != 1 {
        return Err(Unfit {
            words: format!(
                "column `{}` has {} values a particle: they make no groups",
                column.name, column.width
            ),
            fix: "name a column of one integer, or one word, a particle".into(),
        });
    }
    match &column.values {
        Values::Reals(_) => Err(real(&column.name)),
        Values::Integers(values) => Ok(counted(values.iter().copied())),
        Values::Bytes(values) => Ok(values.as_slice().iter().map(|&byte| byte.into()).collect()),
        Values::Words(words) => Ok(words.codes.clone()),
    }
}

/// The groups of what two columns have, together.
fn joined(one: &[u32], other: &[u32]) -> Vec<u32> {
    counted(one.iter().zip(other).map(|(one, other)| (*one, *other)))
}

/// Numbers values in the order in which they first come.
fn counted<T: Copy + Eq + std::hash::Hash>(values: impl Iterator<Item = T>) -> Vec<u32> {
    let mut known: HashMap<T, u32> = HashMap::new();
    // Neighbours in a file are mostly of one group.
    let mut last = None;
    values
        .map(|value| match last {
            Some((before, group)) if before == value => group,
            _ => {
                let next = known.len() as u32;
                let group = *known.entry(value).or_insert(next);
                last = Some((value, group));
                group
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use planisphere_core::scene::Reals;

    fn particles(columns: Vec<Column>) -> Particles {
        let centers = Reals::F64(vec![0.0; 3 * columns[0].values.len()].into());
        let (centers_from, notes) = ("x y z".into(), Vec::new());
        Particles { centers, centers_from, columns, cell: None, notes }
    }

    fn words(name: &str, words: &[&str]) -> Column {
        Column::named(name, Values::Words(words.iter().collect()))
    }

    fn integers(name: &str, values: &[i64]) -> Column {
        Column::named(name, Values::Integers(values.to_vec()))
    }

    #[test]
    fn equal_values_are_one_group() {
        let mol = particles(vec![integers("mol", &[7, 7, -3, 7, i64::MAX])]);
        for name in ["mol", "MOL", "molecule"] {
            assert_eq!(groups(&mol, name).unwrap(), [0, 0, 1, 0, 2], "{name}");
        }
        let chains = particles(vec![words("chainID", &["A", "B", "A"])]);
        assert_eq!(groups(&chains, "chain").unwrap(), [0, 1, 0]);
        let segments = [words("chainID", &["", ""]), words("segID", &["A", "B"])];
        assert_eq!(groups(&particles(segments.into()), "chain").unwrap(), [0, 1]);
        // A column of that very name comes before what a word means.
        let both = particles(vec![words("chainID", &["A", "A"]), words("chain", &["A", "B"])]);
        assert_eq!(groups(&both, "chain").unwrap(), [0, 1]);
    }

    #[test]
    fn residues_of_two_chains_are_two() {
        let columns = vec![
            integers("resSeq", &[1, 1, 2, 1, 1]),
            words("chainID", &["A", "A", "A", "B", "B"]),
            words("iCode", &["", "", "", "", "A"]),
        ];
        let of = particles(columns);
        for name in ["residue", "resSeq", "resseq"] {
            assert_eq!(groups(&of, name).unwrap(), [0, 0, 1, 2, 3], "{name}");
        }
        // Without chains, by what it is.
        let gro = vec![
            integers("residue_number", &[1, 1, 1, 2]),
            words("residue_name", &["ALA", "ALA", "SOL", "SOL"]),
        ];
        assert_eq!(groups(&particles(gro), "residue").unwrap(), [0, 0, 1, 2]);
    }

    #[test]
    fn what_makes_no_groups_is_refused() {
        let reals = Values::Reals(Reals::F64(vec![0.5, 1.0].into()));
        let vector = integers("image", &[0, 0, 0, 1, 1, 1]).with_width(3);
        let of = Particles {
            columns: vec![Column::named("q", reals), vector, integers("type", &[1, 2])],
            ..particles(vec![integers("type", &[1, 2])])
        };
        for (name, wanted) in [
            ("q", "real numbers"),
            ("x", "real numbers"),
            ("image", "3 values"),
            ("chain", "there is no column `chain`"),
            ("spin", "there is no column `spin`"),
        ] {
            let unfit = groups(&of, name).expect_err(name);
            assert!(unfit.words.contains(wanted), "{name}: {unfit:?}");
        }
        let unfit = groups(&of, "spin").expect_err("no such column");
        assert!(unfit.fix.contains("x, y, z, q, image, type"), "{unfit:?}");
    }
}
