// The running answer of four pixels: the sphere of least lower bound, and the least lower bound of
// all others. Minimum does not depend on order, so lists, rounds and chunks in any order give the
// same.
//
// Depths are compared as the bits of non-negative floats, whose order is that of unsigned integers:
// software devices take several instructions for a minimum of floats, for the sake of NaN, and one
// for integers.

// Keys of what is missed have this bit, and so lie behind every depth.
const MISS = 0x80000000u;
// The key of nothing seen, NEVER: behind every depth, and before what is missed.
const NOTHING = 0x7b4097ceu;

struct Nearest {
    low: vec4<u32>,
    rest: vec4<u32>,
    entry: vec4<u32>,
}

// Of a column of eight pixels: rows 0 to 3, and rows 7 to 4, which mirror them.
struct Column {
    top: Nearest,
    bottom: Nearest,
}

fn nothing() -> Column {
    let none = Nearest(vec4<u32>(NOTHING), vec4<u32>(~0u), bitcast<vec4<u32>>(vec4<i32>(NONE)));
    return Column(none, none);
}

// The key of a lower bound. What may lie before 0 gets the least normal number, and nothing is
// settled against that: every upper bound is more.
fn key(depth: vec4<f32>) -> vec4<u32> {
    return bitcast<vec4<u32>>(max(bitcast<vec4<i32>>(depth), vec4<i32>(0x00800000)));
}

fn depth_of(key: u32) -> f32 {
    return select(bitcast<f32>(key), NEVER, key >= MISS);
}

// One sphere more at four pixels.
fn see(old: Nearest, range: Range, item: Item, entry: u32, c: Chord) -> Nearest {
    let low = lower(range, item, c);
    let lost = loses(range, item, c, low, old.low);
    return Nearest(
        min(old.low, low),
        others(old, low, lost),
        // If the least key belongs to a sphere that lost, the pixel is undecided, and either entry
        // will do.
        select(vec4<u32>(entry), old.entry, lost),
    );
}

// One sphere more at a column.
fn visit(old: Column, ranges: Ranges, item: Item, entry: u32, pixels: Pixels) -> Column {
    let c = chords(item, pixels);
    return Column(
        see(old.top, ranges.top, item, entry, c.top),
        see(old.bottom, ranges.bottom, item, entry, c.bottom)
    );
}

// The greatest depth of a column's bests; as NEVER where nothing is seen.
fn deepest(found: Column, pixels: Pixels) -> f32 {
    let top = bitcast<vec4<i32>>(depths(pixels.top, bitcast<vec4<f32>>(found.top.low)));
    let bottom = bitcast<vec4<i32>>(depths(pixels.bottom, bitcast<vec4<f32>>(found.bottom.low)));
    // As integers, see `greater`; a depth below 0 is not the greatest.
    let both = max(top, bottom);
    return bitcast<f32>(max(max(both.x, both.y), max(both.z, both.w)));
}
