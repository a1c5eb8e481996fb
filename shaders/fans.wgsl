// Storage of the rays of perspective tiles.
@group(0) @binding(6) var<storage, read> fans: array<Fan>;

fn fan_at(at: u32, lane: u32) -> Fan {
    return fans[at];
}
