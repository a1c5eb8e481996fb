// From the running answer to what is known of a pixel, where several passes share a tile. No depth
// of a sphere that was looked at is in greater doubt, both ends together; half of it is at least
// what a depth may lie before its key.

fn settle(tile: Tile, column: u32, row: u32, low_key: u32, named: u32, doubt: f32) {
    let key = depth_of(low_key);
    let none = key >= NEVER;
    let low = select(key - 0.5 * doubt, NEVER, none);
    let high = select(key + doubt, NEVER, none);
    finish(tile, column * 8u + row, State(i32(named), low, high, NEVER));
}

fn settle_column(tile: Tile, column: u32, found: Column, doubt: f32) {
    settle(tile, column, 0u, found.top.low.x, found.top.entry.x, doubt);
    settle(tile, column, 1u, found.top.low.y, found.top.entry.y, doubt);
    settle(tile, column, 2u, found.top.low.z, found.top.entry.z, doubt);
    settle(tile, column, 3u, found.top.low.w, found.top.entry.w, doubt);
    settle(tile, column, 4u, found.bottom.low.w, found.bottom.entry.w, doubt);
    settle(tile, column, 5u, found.bottom.low.z, found.bottom.entry.z, doubt);
    settle(tile, column, 6u, found.bottom.low.y, found.bottom.entry.y, doubt);
    settle(tile, column, 7u, found.bottom.low.x, found.bottom.entry.x, doubt);
}
