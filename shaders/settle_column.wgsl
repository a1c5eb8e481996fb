// The eight pixels of a column. No sphere that was looked at has a depth of greater half width than `width`.
fn settle_column(tile: Tile, column: u32, top: Nearest, bottom: Nearest, width: f32) {
    settle(tile, column, 0u, top.low.x, top.rest.x, top.entry.x, width);
    settle(tile, column, 1u, top.low.y, top.rest.y, top.entry.y, width);
    settle(tile, column, 2u, top.low.z, top.rest.z, top.entry.z, width);
    settle(tile, column, 3u, top.low.w, top.rest.w, top.entry.w, width);
    settle(tile, column, 4u, bottom.low.x, bottom.rest.x, bottom.entry.x, width);
    settle(tile, column, 5u, bottom.low.y, bottom.rest.y, bottom.entry.y, width);
    settle(tile, column, 6u, bottom.low.z, bottom.rest.z, bottom.entry.z, width);
    settle(tile, column, 7u, bottom.low.w, bottom.rest.w, bottom.entry.w, width);
}
