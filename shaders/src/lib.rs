//! The WGSL: which parts make which variant, and from which file a line of the joined text comes.
//!
//! Plain parts are joined in a fixed order; nothing is preprocessed. This crate
//! knows no device.

#![cfg_attr(not(test), warn(clippy::print_stdout, clippy::print_stderr))]

use std::{fmt::Write, ops::Range};

use planisphere_core::camera::Projection;

/// How the lanes of a tile share the fetching of its list.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Lanes {
    /// Each fetches every entry: any device.
    Alone,
    /// Subgroups of exactly 8 invocations fetch eight entries at a time.
    Eight,
}

/// What a scene needs of the shader.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Variant {
    /// How rays run.
    pub projection: Projection,
    /// Whether clip planes may cut spheres of the tiles.
    pub clipped: bool,
    /// Whether several passes share a tile.
    pub merged: bool,
    /// Whether the filter is on; off only in benchmarks.
    pub certain: bool,
    /// How lists are fetched.
    pub lanes: Lanes,
    /// Whether lists have [`FEW`] entries at most; with [`Lanes::Eight`] and without clip planes
    /// only.
    pub few: bool,
}

/// Invocations of a workgroup, at most.
pub const WORKGROUP: u32 = 64;
/// Invocations of a subgroup, with [`Lanes::Eight`]: one for each column of a tile.
pub const SUBGROUP: u32 = 8;
/// Entries of lists that are short.
pub const FEW: u32 = 2;
/// So many tiles with short lists a subgroup draws at once.
pub const FEW_TILES: u32 = 4;
// Each lane fetches one entry of one of these tiles.
const _: () = assert!(FEW_TILES * FEW == SUBGROUP);
/// So many other tiles a subgroup draws in turn.
pub const TILES_IN_TURN: u32 = 8;
/// So many tiles are drawn by one workgroup, with [`Lanes::Eight`].
pub const TILES_TOGETHER: u32 = 32;
// Workgroups are of whole subgroups, with short lists and without.
const _: () = assert!(TILES_TOGETHER.is_multiple_of(TILES_IN_TURN));
const _: () = assert!(TILES_TOGETHER.is_multiple_of(FEW_TILES));
/// So many tiles are drawn by one workgroup, with [`Lanes::Alone`].
pub const TILES_ALONE: u32 = 8;
/// Columns and rows of a workgroup of [`NAIVE`].
pub const NAIVE_SIDE: u32 = 8;

/// Bindings of group 0 that are not in every variant.
pub const STATES: u32 = 5;
/// See [`STATES`].
pub const FANS: u32 = 6;
/// See [`STATES`].
pub const PLANES: u32 = 7;

macro_rules! part {
    ($name:literal) => {
        Part { name: concat!("shaders/", $name), text: include_str!(concat!("../", $name)) }
    };
}

/// One file of WGSL.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    /// Path from the root of the repository.
    pub name: &'static str,
    /// Its text.
    pub text: &'static str,
}

/// Every sphere at every pixel: a baseline for benchmarks, and the shader to read first.
pub const NAIVE: Part = part!("naive.wgsl");

/// Joined parts.
#[derive(Clone, Debug)]
pub struct Source {
    /// WGSL.
    pub text: String,
    /// Of each part, its lines in `text`, counted from 1.
    lines: Vec<(Range<usize>, &'static str)>,
}

impl Source {
    /// Joins parts in the order given.
    pub fn join(parts: &[Part]) -> Self {
        let mut source = Self { text: String::new(), lines: Vec::new() };
        let mut next = 1;
        for part in parts {
            let _ = writeln!(source.text, "{}", part.text.trim_end());
            let end = next + part.text.trim_end().lines().count();
            source.lines.push((next..end, part.name));
            next = end;
        }
        source
    }

    /// File and line, from 1, of a line of the joined text.
    pub fn locate(&self, line: usize) -> Option<(&'static str, usize)> {
        self.lines
            .iter()
            .find(|(range, _)| range.contains(&line))
            .map(|(range, name)| (*name, line - range.start + 1))
    }

    /// Parses and validates as a device with subgroups would.
    ///
    /// # Errors
    /// naga's message, with the file and line.
    #[cfg(feature = "validate")]
    pub fn validate(&self) -> Result<(naga::Module, naga::valid::ModuleInfo), String> {
        let at = |location: Option<naga::SourceLocation>, message: String| match location
            .and_then(|l| self.locate(l.line_number as usize).map(|place| (place, l.line_position)))
        {
            Some(((file, line), column)) => format!("{file}:{line}:{column}: {message}"),
            None => message,
        };
        let module = naga::front::wgsl::parse_str(&self.text)
            .map_err(|error| at(error.location(&self.text), error.message().to_owned()))?;
        let mut validator = naga::valid::Validator::new(
            naga::valid::ValidationFlags::all(),
            naga::valid::Capabilities::SUBGROUP,
        );
        validator.subgroup_stages(naga::valid::ShaderStages::COMPUTE);
        validator.subgroup_operations(
            naga::valid::SubgroupOperationSet::BALLOT | naga::valid::SubgroupOperationSet::SHUFFLE,
        );
        let info = validator.validate(&module).map_err(|error| {
            let location = error.location(&self.text);
            at(location, format!("{:?}", error.into_inner()))
        })?;
        Ok((module, info))
    }
}

impl Variant {
    /// Every variant that can be asked for.
    pub fn all() -> impl Iterator<Item = Self> {
        let pairs = [false, true];
        [Projection::Orthographic, Projection::Perspective].into_iter().flat_map(
            move |projection| {
                pairs.into_iter().flat_map(move |clipped| {
                    pairs.into_iter().flat_map(move |merged| {
                        pairs.into_iter().flat_map(move |certain| {
                            let kinds = [
                                (Lanes::Alone, false),
                                (Lanes::Eight, false),
                                (Lanes::Eight, true),
                            ];
                            kinds.into_iter().filter(move |&(_, few)| !(few && clipped)).map(
                                move |(lanes, few)| Self {
                                    projection,
                                    clipped,
                                    merged,
                                    certain,
                                    lanes,
                                    few,
                                },
                            )
                        })
                    })
                })
            },
        )
    }

    /// Its parts, in order.
    pub fn parts(self) -> Vec<Part> {
        let perspective = self.projection == Projection::Perspective;
        let mut parts = vec![part!("types.wgsl")];
        parts.extend(self.merged.then_some(part!("states.wgsl")));
        if perspective {
            let together = self.lanes == Lanes::Eight && !self.few;
            parts.push(if together { part!("fans_subgroup8.wgsl") } else { part!("fans.wgsl") });
        }
        parts.extend(self.clipped.then_some(part!("planes.wgsl")));
        parts.push(part!("rotate.wgsl"));
        parts.push(if self.certain { part!("certain.wgsl") } else { part!("plain.wgsl") });
        match (self.certain, self.clipped, perspective) {
            (false, ..) => {}
            (true, false, false) => parts.push(part!("guard.wgsl")),
            (true, false, true) => parts.push(part!("safe.wgsl")),
            (true, true, _) => parts.push(part!("safe_clipped.wgsl")),
        }
        parts.push(if perspective {
            part!("perspective.wgsl")
        } else {
            part!("orthographic.wgsl")
        });
        parts.push(if self.clipped { part!("clipped.wgsl") } else { part!("open.wgsl") });
        parts.push(part!("nearest.wgsl"));
        match (self.certain, self.merged) {
            (_, false) => parts.push(part!("settle_once.wgsl")),
            (true, true) => parts.extend([
                part!("answer.wgsl"),
                part!("finish_merge.wgsl"),
                part!("settle.wgsl"),
            ]),
            (false, true) => {
                parts.extend([
                    part!("answer_plain.wgsl"),
                    part!("finish_merge.wgsl"),
                    part!("settle_plain.wgsl"),
                ]);
            }
        }
        match self.lanes {
            Lanes::Alone => parts.push(part!("tiles_portable.wgsl")),
            Lanes::Eight => {
                parts.push(if perspective {
                    part!("share_perspective.wgsl")
                } else {
                    part!("share_orthographic.wgsl")
                });
                parts.push(if self.few {
                    part!("tiles_few_subgroup8.wgsl")
                } else {
                    part!("tiles_subgroup8.wgsl")
                });
            }
        }
        parts
    }

    /// Its text.
    pub fn source(self) -> Source {
        Source::join(&self.parts())
    }

    /// The bindings of group 0 that it uses, and whether each is written.
    pub fn bindings(self) -> Vec<(u32, bool)> {
        let mut bindings = vec![(0, false), (1, false), (2, false), (3, false), (4, true)];
        bindings.extend(self.merged.then_some((STATES, true)));
        bindings.extend((self.projection == Projection::Perspective).then_some((FANS, false)));
        bindings.extend(self.clipped.then_some((PLANES, false)));
        bindings
    }
}

#[cfg(all(test, feature = "validate"))]
mod tests {
    use super::*;

    #[test]
    fn the_naive_shader_is_valid() {
        Source::join(&[NAIVE]).validate().unwrap();
    }

    #[test]
    fn a_fault_is_reported_in_its_own_file() {
        let good = Part { name: "shaders/good.wgsl", text: "// fine\nconst A = 1;\n\n" };
        let bad = Part { name: "shaders/bad.wgsl", text: "// line 1\nconst B = A +;\n" };
        let message = Source::join(&[good, bad]).validate().unwrap_err();
        assert!(message.starts_with("shaders/bad.wgsl:2:"), "{message}");
        let late = Part {
            name: "shaders/late.wgsl",
            text: "// line 1\n\nfn f() -> i32 {\n  return 1u;\n}\n",
        };
        let message = Source::join(&[good, late]).validate().unwrap_err();
        assert!(message.starts_with("shaders/late.wgsl:"), "{message}");
    }
}
