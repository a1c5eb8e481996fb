// Depth of a hit where no sphere of the tile meets a clip plane: the near root.

struct Range {
    none: u32,
}

fn range_of(at: u32) -> Range {
    return Range(0u);
}

// The key of a lower bound of the hit's depth; MISS for a certain miss, which the sign of the square tells.
fn lower(range: Range, item: Item, c: Chord) -> vec4<u32> {
    return key(c.near) | (bitcast<vec4<u32>>(c.square) & vec4<u32>(MISS));
}

// 0 where the hit is certain, and its depth at most the lower bound + 2.02 `width`, else AGAIN. The slack counts twice, once for each end.
fn unsafe_bit(range: Range, item: Item, c: Chord) -> vec4<u32> {
    return bitcast<vec4<u32>>(c.square - vec4<f32>(item.safe)) & vec4<u32>(AGAIN);
}
