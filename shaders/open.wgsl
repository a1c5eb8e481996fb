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

// A number as it is, but not before another is known. What is needed last of all software devices
// put off to the end of a round, where all wait for it.
fn after(x: f32, other: f32, ranges: Ranges) -> f32 {
    return bitcast<f32>(bitcast<u32>(x) | (bitcast<u32>(other) & ranges.top.zero));
}

// A lane, as a number that compilers do not know. Where they know it, software devices take two
// instructions for each number that is passed from it, and else one.
fn opaque(lane: u32, ranges: Ranges) -> u32 {
    return lane | ranges.top.zero;
}

// The key of a lower bound of the hit's depth; MISS for a certain miss, which the sign of the
// square tells.
fn lower(range: Range, item: Item, c: Chord) -> vec4<u32> {
    return bitcast<vec4<u32>>(c.near) | (bitcast<vec4<u32>>(c.square) & vec4<u32>(MISS));
}
