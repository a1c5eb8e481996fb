// From the running answer to the result of each of eight pixels, with the filter off, where several passes share a tile.

fn settle(tile: Tile, column: u32, row: u32, low: u32, entry: u32) {
    finish(tile, column * 8u + row, State(bitcast<i32>(entry), bitcast<f32>(low), bitcast<f32>(low), NEVER));
}

fn settle_column(tile: Tile, column: u32, top: Nearest, bottom: Nearest, doubt: f32) {
    settle(tile, column, 0u, top.low.x, top.entry.x);
    settle(tile, column, 1u, top.low.y, top.entry.y);
    settle(tile, column, 2u, top.low.z, top.entry.z);
    settle(tile, column, 3u, top.low.w, top.entry.w);
    settle(tile, column, 4u, bottom.low.x, bottom.entry.x);
    settle(tile, column, 5u, bottom.low.y, bottom.entry.y);
    settle(tile, column, 6u, bottom.low.z, bottom.entry.z);
    settle(tile, column, 7u, bottom.low.w, bottom.entry.w);
}
