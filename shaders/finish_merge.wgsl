// Merges what a pass found at a pixel with earlier passes, if several share a tile (rounds of a
// long list, buffers of spheres). The sphere with the lesser upper bound stays. The lower bound of
// the other, which holds for all of its pass, goes into `rest`.
fn finish(tile: Tile, place: u32, found: State) {
    let at = (tile.slot & SLOT) * 64u + place;
    var state = found;
    if (tile.slot & FRESH) == 0u {
        let old = states[at];
        let better = found.high < old.high || (found.high == old.high && found.low < old.low);
        state.id = select(old.id, found.id, better);
        state.low = select(old.low, found.low, better);
        state.high = select(old.high, found.high, better);
        state.rest = min(old.rest, select(found.low, old.low, better));
    }
    if (tile.slot & LAST) != 0u {
        ids[at / 4u][at % 4u] = answer(state);
    } else {
        states[at] = state;
    }
}
