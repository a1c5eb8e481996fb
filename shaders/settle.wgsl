// From the running answer to what is known of a pixel, where several passes share a tile; see settle_once.wgsl.

fn settle(tile: Tile, column: u32, row: u32, low_key: u32, rest_key: u32, named: u32, width: f32) {
    let low = depth_of(low_key);
    let none = low >= NEVER;
    let id = select(i32(named & ~AGAIN), NONE, none);
    let high = select(low + 2.02 * width, NEVER, named >= AGAIN || none);
    finish(tile, column * 8u + row, State(id, low, high, depth_of(rest_key)));
}
