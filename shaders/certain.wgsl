// The filter is on: bounds as derived.
const U = 0x1p-23;
// Room for the rounding of the bounds themselves.
const SURE = 1.01;

// What is added to the entry of a hit that would be the best.
fn doubt_bit(range: Range, item: Item, c: Chord) -> vec4<u32> {
    return unsafe_bit(range, item, c);
}
