// The eight pixels of a column.
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
