// A best whose hit is not safe is marked: AGAIN is added to its entry. The filter is on.
fn mark(range: Range, item: Item, c: Chord) -> vec4<u32> {
    return unsafe_bit(range, item, c);
}

// Which of two keys does not stay the least.
fn loser(old: vec4<u32>, low: vec4<u32>, item: Item) -> vec4<u32> {
    return max(old, low);
}
