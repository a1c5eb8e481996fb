// The running answer is the answer, where one pass sees the whole list.
fn settle_column(tile: Tile, column: u32, found: Column, doubt: f32) {
    let place = (tile.slot & SLOT) * 16u + column * 2u;
    ids[place] = bitcast<vec4<i32>>(found.top.entry);
    ids[place + 1u] = bitcast<vec4<i32>>(found.bottom.entry.wzyx);
}
