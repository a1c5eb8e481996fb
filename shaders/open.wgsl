// Depth of a hit where no sphere of the tile meets a clip plane: the near root.

struct Range {
    // 0, as a number that compilers do not know.
    zero: u32,
}

struct Ranges {
    top: Range,
    bottom: Range,
}

fn ranges_of(at: u32, pixels: Pixels) -> Ranges {
    // There are fewer tiles than 2^31.
    return Ranges(Range(at >> 31u), Range(at >> 31u));
}

// The key of a lower bound of the hit's depth; MISS for a certain miss, which the sign of the square tells.
fn lower(range: Range, item: Item, c: Chord) -> vec4<u32> {
    return bitcast<vec4<u32>>(c.near) | (bitcast<vec4<u32>>(c.square) & vec4<u32>(MISS));
}
