// From the running answer to the answer of a pixel, where one pass sees the whole list.
//
// The best has an upper bound only where its hit is safe. That settles all but a few pixels in ten thousand; to fetch the best's record again for a closer look would cost more, at every pixel, than to decide those on the host.
//
// Settled: no other sphere's lower bound is within the upper bound of the best, as keys, whose order is that of depths. Where nothing was
// seen the upper bound is no number, and not used.

fn settle(tile: Tile, column: u32, row: u32, low: u32, rest: u32, named: u32, width: f32) {
    let high = bitcast<u32>(bitcast<f32>(low) + 2.02 * width);
    let settled = (rest > high) & (named < AGAIN);
    let id = select(UNDECIDED, i32(named), settled);
    ids[(tile.slot & SLOT) * 64u + row * 8u + column] = select(id, NONE, low == MISS);
}
