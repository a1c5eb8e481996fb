// Rays are perspective, and no plane cuts: the nearest wins if its hit is safe.
fn safe(range: Range, item: Item, c: Chord) -> vec4<bool> {
    return c.square > vec4<f32>(item.safe);
}

// A sphere loses if its hit is not safe, or if its key is greater than the best. `range.zero` is a
// hidden 0: with a plain one the compiler keeps two masks a pixel, and runs out of registers.
fn loses(range: Range, item: Item, c: Chord, low: vec4<u32>, best: vec4<u32>) -> vec4<bool> {
    return low > select(vec4<u32>(range.zero), best, safe(range, item, c));
}

// See `after`.
fn told_after(item: Item, doubt: f32, ranges: Ranges) -> Item {
    var told = item;
    told.safe = after(item.safe, doubt, ranges);
    return told;
}
