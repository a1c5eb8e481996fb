// Depth of a hit where no sphere of the tile meets a clip plane: the near root.

struct Range {
    // Always 0, but the compiler does not know it. See `after` and `opaque`.
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

// Scheduling barrier: returns `x`, but the compiler has to compute `other` first. llvmpipe (Mesa
// 22.3) otherwise moves what is needed last to the end of a round of visits, where all lanes wait
// for it.
fn after(x: f32, other: f32, ranges: Ranges) -> f32 {
    return bitcast<f32>(bitcast<u32>(x) | (bitcast<u32>(other) & ranges.top.zero));
}

// The number of a lane, hidden from the compiler. For a lane that is a constant, llvmpipe (Mesa
// 22.3) takes two instructions for each value passed from it; for one that is not, one.
fn opaque(lane: u32, ranges: Ranges) -> u32 {
    return lane | ranges.top.zero;
}

// The key of a lower bound of the hit's depth; MISS for a certain miss, which the sign of the
// square tells.
fn lower(range: Range, item: Item, c: Chord) -> vec4<u32> {
    return bitcast<vec4<u32>>(c.near) | (bitcast<vec4<u32>>(c.square) & vec4<u32>(MISS));
}
