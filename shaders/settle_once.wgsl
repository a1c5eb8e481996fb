// From the running answer to the answers of a column, where one pass sees the whole list.
//
// The best has an upper bound only where its hit is safe. That settles all but a few pixels in ten thousand; to fetch the best's record again for
// a closer look would cost more, at every pixel, than to decide those on the host.
//
// Settled: no other sphere's lower bound is within the upper bound of the best, as keys, whose order is that of depths. So is a pixel where
// nothing was seen, whose entry is NONE. Entries with AGAIN are less than UNDECIDED, and mean the same.
fn answers(found: Nearest, width: f32) -> vec4<i32> {
    let high = bitcast<vec4<u32>>(bitcast<vec4<f32>>(found.low) + vec4<f32>(2.02 * width));
    return select(vec4<i32>(UNDECIDED), bitcast<vec4<i32>>(found.entry), found.rest > high);
}

// No sphere that was looked at has a depth of greater half width than `width`.
fn settle_column(tile: Tile, column: u32, top: Nearest, bottom: Nearest, width: f32) {
    let place = (tile.slot & SLOT) * 16u + column * 2u;
    ids[place] = answers(top, width);
    ids[place + 1u] = answers(bottom, width);
}
