// Rays are parallel, and no plane cuts: then safe hits are those that begin before a depth that is
// the same at all pixels, the guard.
fn loses(range: Range, item: Item, c: Chord, low: vec4<u32>, best: vec4<u32>) -> vec4<bool> {
    return low > min(best, vec4<u32>(bitcast<u32>(item.guard)));
}

// See `after`.
fn told_after(item: Item, doubt: f32, ranges: Ranges) -> Item {
    var told = item;
    told.guard = after(item.guard, doubt, ranges);
    return told;
}
