// From the running answer to the result of each of eight pixels, with the filter off: no bounds are asked for.

fn settle(tile: Tile, column: u32, row: u32, low: u32, entry: u32) {
    finish(tile, row * 8u + column, State(select(i32(entry & ~AGAIN), NONE, low == MISS), depth_of(low), depth_of(low), NEVER));
}

fn settle_column(tile: Tile, column: u32, top: Nearest, bottom: Nearest, width: f32) {
    settle(tile, column, 0u, top.low.x, top.entry.x);
    settle(tile, column, 1u, top.low.y, top.entry.y);
    settle(tile, column, 2u, top.low.z, top.entry.z);
    settle(tile, column, 3u, top.low.w, top.entry.w);
    settle(tile, column, 4u, bottom.low.x, bottom.entry.x);
    settle(tile, column, 5u, bottom.low.y, bottom.entry.y);
    settle(tile, column, 6u, bottom.low.z, bottom.entry.z);
    settle(tile, column, 7u, bottom.low.w, bottom.entry.w);
}
