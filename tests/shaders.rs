//! The WGSL, without a device: every variant that can be asked for is valid, and every struct
//! shared with Rust has Rust's layout.

use std::mem::{offset_of, size_of};

use planisphere_gpu::plan;
use planisphere_shaders::{TILES_TOGETHER, Variant};

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
        format!("const NEVER = {:e};", plan::NEVER),
        format!("const NOTHING = {:#x}u;", plan::NEVER.to_bits()),
        format!("const TOGETHER = {TILES_TOGETHER}u;"),
        format!("const NONE = {};", planisphere_core::ids::NONE),
        format!("const UNDECIDED = {};", planisphere_core::ids::UNDECIDED),
    ] {
        assert!(text.contains(&line), "{line}");
    }
}
