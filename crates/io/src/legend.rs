//! What the colours of spheres mean.

use planisphere_image::maps::Map;

/// What the colours of spheres mean: what a legend shows.
#[derive(Clone, Debug, PartialEq)]
pub enum Legend {
    /// Numbers, by a map.
    Numbers {
        /// The colours.
        map: Map,
        /// The values of its ends, as they were used.
        range: [f64; 2],
        /// What the numbers are: the name of a column.
        name: String,
    },
    /// Kinds, such as elements and types, each with its colour (sRGB): those that are there.
    Kinds(Vec<(String, [u8; 3])>),
}

/// Kinds that a legend shows, at most.
pub(crate) const MOST_KINDS: usize = 256;

impl Legend {
    /// Of kinds that may be too many.
    ///
    /// # Errors
    /// Why they have no legend.
    pub(crate) fn of_kinds(kinds: Vec<(String, [u8; 3])>) -> Result<Self, String> {
        match kinds.len() {
            0..=MOST_KINDS => Ok(Self::Kinds(kinds)),
            _ => Err(too_many()),
        }
    }

    /// The legend of these spheres and of others.
    ///
    /// # Errors
    /// Why these have none together.
    pub(crate) fn and(self, other: Self) -> Result<Self, String> {
        match (self, other) {
            (one, other) if one == other => Ok(one),
            (Self::Kinds(mut kinds), Self::Kinds(more)) => {
                for (name, color) in more {
                    match kinds.iter().find(|(known, _)| *known == name) {
                        None => kinds.push((name, color)),
                        Some((_, known)) if *known == color => {}
                        Some(_) => {
                            return Err(format!("`{name}` has two colours, in two of the files"));
                        }
                    }
                }
                Self::of_kinds(kinds)
            }
            _ => {
                Err("the files are coloured in different ways, each with a legend of its own"
                    .into())
            }
        }
    }
}

/// Why so many kinds have no legend.
pub(crate) fn too_many() -> String {
    format!("there are more than {MOST_KINDS} kinds, which have no room in it")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn legends_are_joined_where_they_agree() {
        let kinds = |names: &[(&str, u8)]| {
            Legend::Kinds(names.iter().map(|(n, c)| ((*n).to_owned(), [*c; 3])).collect())
        };
        let joined = kinds(&[("C", 1), ("O", 2)]).and(kinds(&[("O", 2), ("H", 3)]));
        assert_eq!(joined, Ok(kinds(&[("C", 1), ("O", 2), ("H", 3)])));
        let error = kinds(&[("C", 1)]).and(kinds(&[("C", 2)])).expect_err("two colours");
        assert!(error.contains("`C`"), "{error}");
        let numbers = |range| Legend::Numbers { map: Map::VIRIDIS, range, name: "q".into() };
        assert_eq!(numbers([0.0, 1.0]).and(numbers([0.0, 1.0])), Ok(numbers([0.0, 1.0])));
        assert!(numbers([0.0, 1.0]).and(numbers([0.0, 2.0])).is_err());
        assert!(numbers([0.0, 1.0]).and(kinds(&[("C", 1)])).is_err());
        let many = (0..300).map(|n| (n.to_string(), [0; 3])).collect();
        assert!(Legend::of_kinds(many).expect_err("too many").contains("256"));
    }
}
