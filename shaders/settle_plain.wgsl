// From the running answer to the result of each of eight pixels, with the filter off, where several
// passes share a tile.

fn settle(tile: Tile, column: u32, row: u32, low: u32, entry: u32) {
    let depth = bitcast<f32>(low);
    finish(tile, column * 8u + row, State(bitcast<i32>(entry), depth, depth, NEVER));
}

fn settle_column(tile: Tile, column: u32, found: Column, doubt: f32) {
    settle(tile, column, 0u, found.top.low.x, found.top.entry.x);
    settle(tile, column, 1u, found.top.low.y, found.top.entry.y);
    settle(tile, column, 2u, found.top.low.z, found.top.entry.z);
    settle(tile, column, 3u, found.top.low.w, found.top.entry.w);
    settle(tile, column, 4u, found.bottom.low.w, found.bottom.entry.w);
    settle(tile, column, 5u, found.bottom.low.z, found.bottom.entry.z);
    settle(tile, column, 6u, found.bottom.low.y, found.bottom.entry.y);
    settle(tile, column, 7u, found.bottom.low.x, found.bottom.entry.x);
}
