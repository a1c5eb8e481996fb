// From the running answer to what is known of each of eight pixels.
//
// The upper bound of the best is taken with the loosest width of the whole list, and only where its hit is safe. That settles all but about one
// pixel in ten thousand; to fetch the best's record again for its own bounds would cost more, at every pixel, than to decide those on the host.

fn settle(tile: Tile, loosest: f32, column: u32, row: u32, low_key: u32, rest_key: u32, named: u32) {
    let low = depth_of(low_key);
    let none = low >= NEVER;
    let id = select(i32(named & ~AGAIN), NONE, none);
    let high = select(low + 2.02 * loosest, NEVER, named >= AGAIN || none);
    finish(tile, row * 8u + column, State(id, low, high, depth_of(rest_key)));
}

fn settle_column(tile: Tile, loosest: f32, column: u32, top: Nearest, bottom: Nearest) {
    settle(tile, loosest, column, 0u, top.low.x, top.rest.x, top.entry.x);
    settle(tile, loosest, column, 1u, top.low.y, top.rest.y, top.entry.y);
    settle(tile, loosest, column, 2u, top.low.z, top.rest.z, top.entry.z);
    settle(tile, loosest, column, 3u, top.low.w, top.rest.w, top.entry.w);
    settle(tile, loosest, column, 4u, bottom.low.x, bottom.rest.x, bottom.entry.x);
    settle(tile, loosest, column, 5u, bottom.low.y, bottom.rest.y, bottom.entry.y);
    settle(tile, loosest, column, 6u, bottom.low.z, bottom.rest.z, bottom.entry.z);
    settle(tile, loosest, column, 7u, bottom.low.w, bottom.rest.w, bottom.entry.w);
}
