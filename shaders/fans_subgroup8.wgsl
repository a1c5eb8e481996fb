// Storage of the rays of perspective tiles, of which each lane fetches a word, see
// tiles_subgroup8.wgsl.
@group(0) @binding(6) var<storage, read> fans: array<array<u32, 8>>;

fn fan_at(at: u32, lane: u32) -> Fan {
    let own = bitcast<i32>(fans[at][lane]);
    return Fan(
        vec3<i32>(
            subgroupBroadcast(own, 0u),
            subgroupBroadcast(own, 1u),
            subgroupBroadcast(own, 2u)
        ),
        bitcast<f32>(subgroupBroadcast(own, 3u)),
        vec3<i32>(
            subgroupBroadcast(own, 4u),
            subgroupBroadcast(own, 5u),
            subgroupBroadcast(own, 6u)
        ),
        bitcast<f32>(subgroupBroadcast(own, 7u)),
    );
}
