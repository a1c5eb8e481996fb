// From the running answer to what is known of each of eight pixels.
//
// The best has an upper bound only where its hit is safe. That settles all but a few pixels in ten thousand; to fetch the best's record again for a closer look would cost more, at every pixel, than to decide those on the host.

fn settle(tile: Tile, column: u32, row: u32, low_key: u32, rest_key: u32, named: u32, width: f32) {
    let low = depth_of(low_key);
    let none = low >= NEVER;
    let id = select(i32(named & ~AGAIN), NONE, none);
    let high = select(low + 2.02 * width, NEVER, named >= AGAIN || none);
    finish(tile, row * 8u + column, State(id, low, high, depth_of(rest_key)));
}

fn settle_column(tile: Tile, column: u32, top: Nearest, bottom: Nearest) {
    settle(tile, column, 0u, top.low.x, top.rest.x, top.entry.x, top.width.x);
    settle(tile, column, 1u, top.low.y, top.rest.y, top.entry.y, top.width.y);
    settle(tile, column, 2u, top.low.z, top.rest.z, top.entry.z, top.width.z);
    settle(tile, column, 3u, top.low.w, top.rest.w, top.entry.w, top.width.w);
    settle(tile, column, 4u, bottom.low.x, bottom.rest.x, bottom.entry.x, bottom.width.x);
    settle(tile, column, 5u, bottom.low.y, bottom.rest.y, bottom.entry.y, bottom.width.y);
    settle(tile, column, 6u, bottom.low.z, bottom.rest.z, bottom.entry.z, bottom.width.z);
    settle(tile, column, 7u, bottom.low.w, bottom.rest.w, bottom.entry.w, bottom.width.w);
}
