// From the running answer to what is known of a pixel, where several passes share a tile. No depth of a sphere that was looked at is in greater
// doubt, both ends together; half of it is at least what a depth may lie before its key.

fn settle(tile: Tile, column: u32, row: u32, low_key: u32, named: u32, doubt: f32) {
    let key = depth_of(low_key);
    let none = key >= NEVER;
    finish(tile, column * 8u + row, State(i32(named), select(key - 0.5 * doubt, NEVER, none), select(key + doubt, NEVER, none), NEVER));
}

fn settle_column(tile: Tile, column: u32, top: Nearest, bottom: Nearest, doubt: f32) {
    settle(tile, column, 0u, top.low.x, top.entry.x, doubt);
    settle(tile, column, 1u, top.low.y, top.entry.y, doubt);
    settle(tile, column, 2u, top.low.z, top.entry.z, doubt);
    settle(tile, column, 3u, top.low.w, top.entry.w, doubt);
    settle(tile, column, 4u, bottom.low.x, bottom.entry.x, doubt);
    settle(tile, column, 5u, bottom.low.y, bottom.entry.y, doubt);
    settle(tile, column, 6u, bottom.low.z, bottom.entry.z, doubt);
    settle(tile, column, 7u, bottom.low.w, bottom.entry.w, doubt);
}
