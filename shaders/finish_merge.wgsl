// The end of a pixel where several passes (rounds of a long list, chunks of spheres) share a tile:
// their findings are merged. The sphere of least upper bound stays; the other's lower bound, which
// is that of all of its pass, joins the rest of earlier passes.
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
