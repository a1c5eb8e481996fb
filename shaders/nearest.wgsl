// The running answer of four pixels: the sphere of least lower bound, and the least lower bound of all others.
// Minimum does not depend on order, so lists, rounds and chunks in any order give the same.

struct Nearest {
    low: vec4<f32>,
    rest: vec4<f32>,
    entry: vec4<u32>,
}

fn nothing() -> Nearest {
    return Nearest(vec4<f32>(NEVER), vec4<f32>(NEVER), vec4<u32>(0u));
}

fn visit(old: Nearest, range: Range, item: Item, entry: u32, pixels: Pixels) -> Nearest {
    let low = lower(range, item, chord(item, pixels));
    return Nearest(
        min(old.low, low),
        min(old.rest, max(old.low, low)),
        select(old.entry, vec4<u32>(entry), low < old.low),
    );
}
