//! The WGSL, without a device: every variant that can be asked for is valid, and every struct
//! shared with Rust has Rust's layout.

use std::mem::{offset_of, size_of};

use planisphere_gpu::plan;
use planisphere_shaders::{
    FEW, FEW_TILES, Lanes, NAIVE, NAIVE_SIDE, SUBGROUP, Source, TILES_ALONE, TILES_IN_TURN,
    TILES_TOGETHER, Variant, WORKGROUP,
};

#[test]
fn every_variant_is_valid() {
    let mut count = 0;
    for variant in Variant::all() {
        variant.source().validate().unwrap_or_else(|message| panic!("{variant:?}\n{message}"));
        count += 1;
    }
    assert_eq!(count, 40);
}

#[test]
fn bindings_are_those_of_the_text() {
    for variant in Variant::all() {
        let (module, _) = variant.source().validate().unwrap();
        let mut found: Vec<(u32, bool)> = module
            .global_variables
            .iter()
            .filter_map(|(_, variable)| {
                let written = match variable.space {
                    naga::AddressSpace::Storage { access } => {
                        access.contains(naga::StorageAccess::STORE)
                    }
                    _ => false,
                };
                variable.binding.map(|binding| (binding.binding, written))
            })
            .collect();
        found.sort_unstable();
        assert_eq!(found, variant.bindings(), "{variant:?}");
    }
}

/// Name and byte offset of each field, and the size, as Rust has them.
macro_rules! layout {
    ($kind:ident: $($field:ident),*) => {
        (
            stringify!($kind),
            vec![$((stringify!($field), offset_of!(plan::$kind, $field))),*],
            size_of::<plan::$kind>(),
        )
    };
}

#[test]
fn shared_structs_have_the_layout_of_rust() {
    let layouts = [
        layout!(
            Frame: right, pitch_x, up, pitch_y, forward, delta, delta_depth, scale, base, base_far,
            first, tiles, row, disorder
        ),
        layout!(Tile: start, count, x, y, z, slot),
        layout!(Fan: n, sx, m, sy),
        layout!(State: id, low, high, rest),
    ];
    let mut seen = std::collections::BTreeSet::new();
    for variant in Variant::all() {
        let (module, info) = variant.source().validate().unwrap();
        let mut layouter = naga::proc::Layouter::default();
        layouter.update(module.to_ctx()).unwrap();
        for (handle, kind) in module.types.iter() {
            let naga::TypeInner::Struct { members, span } = &kind.inner else { continue };
            let Some((name, fields, size)) =
                layouts.iter().find(|(name, ..)| kind.name.as_deref() == Some(name))
            else {
                continue;
            };
            let found: Vec<_> = members
                .iter()
                .map(|m| (m.name.as_deref().unwrap_or(""), m.offset as usize))
                .collect();
            assert_eq!(&found, fields, "{name}");
            assert_eq!(*span as usize, *size, "size of {name}");
            // The stride in an array, which is what a buffer holds.
            assert_eq!(layouter[handle].to_stride() as usize, *size, "stride of {name}");
            seen.insert(*name);
        }
        assert!(
            info.get_entry_point(0).available_stages.contains(naga::valid::ShaderStages::COMPUTE)
        );
    }
    assert_eq!(seen.len(), layouts.len());
}

#[test]
fn shared_constants_are_those_of_rust() {
    let variant = Variant::all().next().unwrap();
    let text = variant.source().text;
    for line in [
        format!("const FRESH = {:#x}u;", plan::FRESH),
        format!("const LAST = {:#x}u;", plan::LAST),
        format!("const SLOT = {:#x}u;", plan::SLOT),
        format!("const NEVER = {:e};", plan::NEVER),
        format!("const NOTHING = {:#x}u;", plan::NEVER.to_bits()),
        format!("const TOGETHER = {TILES_TOGETHER}u;"),
        format!("const NONE = {};", planisphere_core::ids::NONE),
        format!("const UNDECIDED = {};", planisphere_core::ids::UNDECIDED),
    ] {
        assert!(text.contains(&line), "{line}");
    }
}

/// The host dispatches as many workgroups as tiles need, by how many of them one draws.
#[test]
fn workgroups_draw_as_many_tiles_as_are_dispatched_for_them() {
    let mut largest = 0;
    for variant in Variant::all() {
        let source = variant.source();
        let (module, _) = source.validate().unwrap();
        let [size, 1, 1] = module.entry_points[0].workgroup_size else { panic!("{variant:?}") };
        largest = largest.max(size);
        // Invocations of a column each draw a tile, or as a subgroup several.
        let (each, tiles, words) = match (variant.lanes, variant.few) {
            (Lanes::Alone, _) => (
                1,
                TILES_ALONE,
                vec![
                    format!("* {TILES_ALONE}u + local / {}u;", plan::TILE),
                    format!("let column = local % {}u;", plan::TILE),
                ],
            ),
            (Lanes::Eight, false) => (
                TILES_IN_TURN,
                TILES_TOGETHER,
                vec![
                    format!("* TOGETHER + part * {TILES_IN_TURN}u;"),
                    format!("let end = min(at + {TILES_IN_TURN}u, frame.tiles);"),
                    format!("i += {SUBGROUP}u;"),
                    format!("own, {}u, pixels);", SUBGROUP - 1),
                ],
            ),
            (Lanes::Eight, true) => (
                FEW_TILES,
                TILES_TOGETHER,
                vec![
                    format!("* TOGETHER + part * {FEW_TILES}u;"),
                    format!("first + lane / {FEW}u,"),
                    format!("first + {}u, lane,", FEW_TILES - 1),
                ],
            ),
        };
        assert_eq!(size / plan::TILE * each, tiles, "{variant:?}");
        // Ids are stored four at a time.
        let stored = if variant.merged { plan::TILE_PIXELS } else { plan::TILE_PIXELS / 4 };
        let place = format!("(tile.slot & SLOT) * {stored}u");
        for words in words.into_iter().chain([place]) {
            assert!(source.text.contains(&words), "{variant:?}: `{words}`");
        }
    }
    assert_eq!(largest, WORKGROUP);
    let (naive, _) = Source::join(&[NAIVE]).validate().unwrap();
    assert_eq!(naive.entry_points[0].workgroup_size, [NAIVE_SIDE, NAIVE_SIDE, 1]);
}
