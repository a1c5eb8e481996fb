// The filter is off: plain f32, for comparison in benchmarks only. All bounds are zero.
const U = 0.0;
const SURE = 0.0;

// See certain.wgsl.
fn doubt_bit(range: Range, item: Item, c: Chord) -> vec4<u32> {
    return vec4<u32>(0u);
}
