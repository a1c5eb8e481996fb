// Planes may cut: the nearest wins if its hit is safe.
fn loses(range: Range, item: Item, c: Chord, low: vec4<u32>, best: vec4<u32>) -> vec4<bool> {
    return !safe(range, item, c) | (low > best);
}

// Nothing waits for a doubt here.
fn told_after(item: Item, doubt: f32, ranges: Ranges) -> Item {
    return item;
}
