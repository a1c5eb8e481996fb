// 0 where the hit is certain, and its depth at most the lower bound + 2.02 `width`, else AGAIN. The slack counts twice, once for each end.
fn unsafe_bit(range: Range, item: Item, c: Chord) -> vec4<u32> {
    return bitcast<vec4<u32>>(c.square - vec4<f32>(item.safe)) & vec4<u32>(AGAIN);
}
