// The running answer of four pixels: the sphere of least lower bound, and the least lower bound of all others.
// Minimum does not depend on order, so lists, rounds and chunks in any order give the same.

// Added to the entry of a best whose hit is not safe: it must be looked at again.
const AGAIN = 0x80000000u;

struct Nearest {
    low: vec4<f32>,
    rest: vec4<f32>,
    entry: vec4<u32>,
}

fn nothing() -> Nearest {
    return Nearest(vec4<f32>(NEVER), vec4<f32>(NEVER), vec4<u32>(0u));
}

fn visit(old: Nearest, range: Range, item: Item, entry: u32, pixels: Pixels) -> Nearest {
    let c = chord(item, pixels);
    let low = lower(range, item, c);
    let named = select(vec4<u32>(entry | AGAIN), vec4<u32>(entry), safe(range, item, c));
    return Nearest(min(old.low, low), min(old.rest, max(old.low, low)), select(old.entry, named, low < old.low));
}

// The farthest lower bound of a column.
fn farthest(top: Nearest, bottom: Nearest) -> f32 {
    let four = max(top.low, bottom.low);
    return max(max(four.x, four.y), max(four.z, four.w));
}

// What begins beyond `front` was not looked at.
fn cut_off(found: Nearest, front: f32) -> Nearest {
    return Nearest(found.low, min(found.rest, vec4<f32>(front)), found.entry);
}
