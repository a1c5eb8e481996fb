// The filter is off: plain f32, for comparison in benchmarks only. All bounds are zero, and nothing is marked.
const U = 0.0;
const SURE = 0.0;

fn mark(range: Range, item: Item, c: Chord) -> vec4<u32> {
    return vec4<u32>(0u);
}

fn loser(old: vec4<u32>, low: vec4<u32>, item: Item) -> vec4<u32> {
    return max(old, low);
}
