// The end of a pixel where one pass sees the whole list.
fn finish(tile: Tile, place: u32, found: State) {
    ids[(tile.slot & SLOT) * 64u + place] = answer(found);
}
