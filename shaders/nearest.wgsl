// The running answer of four pixels: the sphere of least lower bound, and the least lower bound of all others.
// Minimum does not depend on order, so lists, rounds and chunks in any order give the same.
//
// Depths are compared as the bits of non-negative floats, whose order is that of unsigned integers: software devices take several
// instructions for a minimum of floats, for the sake of NaN, and one for integers.

// Keys of what is missed have this bit, and so lie behind every depth.
const MISS = 0x80000000u;
// The key of nothing seen, NEVER: behind every depth, and before what is missed.
const NOTHING = 0x7b4097ceu;
struct Nearest {
    low: vec4<u32>,
    rest: vec4<u32>,
    entry: vec4<u32>,
}

fn nothing() -> Nearest {
    return Nearest(vec4<u32>(NOTHING), vec4<u32>(~0u), bitcast<vec4<u32>>(vec4<i32>(NONE)));
}

// The key of a lower bound. What may lie before 0 gets 0, and nothing is settled against that: every upper bound is at least 0.
fn key(depth: vec4<f32>) -> vec4<u32> {
    return bitcast<vec4<u32>>(max(bitcast<vec4<i32>>(depth), vec4<i32>(0)));
}

fn depth_of(key: u32) -> f32 {
    return select(bitcast<f32>(key), NEVER, key >= MISS);
}

fn visit(old: Nearest, range: Range, item: Item, entry: u32, pixels: Pixels) -> Nearest {
    let c = chord(item, pixels);
    let low = lower(range, item, c);
    let lost = loses(range, item, c, low, old.low);
    return Nearest(
        min(old.low, low),
        others(old, low, lost),
        // Where the best did not win, it does not matter which is named.
        select(vec4<u32>(entry), old.entry, lost),
    );
}

// The greatest depth of a column's bests; NEVER where nothing is seen.
fn deepest(top: Nearest, bottom: Nearest) -> f32 {
    let low = max(top.low, bottom.low);
    return bitcast<f32>(max(max(low.x, low.y), max(low.z, low.w)));
}
