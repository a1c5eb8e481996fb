// From the running answer to what is known of each of eight pixels.
//
// The upper bound of the best is first taken with the loosest width of the whole list: that settles nearly all. For the others the best's
// record is fetched again for its own bounds, in a loop that few pixels enter: software devices run both sides of a branch, but leave loops.

// Finishes the pixel unless it must be looked at again, and says so by the bit of its row.
fn settle(tile: Tile, loosest: f32, column: u32, row: u32, low: f32, rest: f32, entry: u32) -> u32 {
    let high = low + 2.02 * loosest;
    let none = low >= NEVER;
    if none || (rest > high && entry < AGAIN) {
        finish(tile, row * 8u + column, State(select(i32(entry), NONE, none), low, select(high, NEVER, none), rest));
        return 0u;
    }
    return 1u << row;
}

fn settle_column(tile: Tile, eye: Eye, range: Range, loosest: f32, column: u32, top: Nearest, bottom: Nearest) {
    var again = settle(tile, loosest, column, 0u, top.low.x, top.rest.x, top.entry.x)
        | settle(tile, loosest, column, 1u, top.low.y, top.rest.y, top.entry.y)
        | settle(tile, loosest, column, 2u, top.low.z, top.rest.z, top.entry.z)
        | settle(tile, loosest, column, 3u, top.low.w, top.rest.w, top.entry.w)
        | settle(tile, loosest, column, 4u, bottom.low.x, bottom.rest.x, bottom.entry.x)
        | settle(tile, loosest, column, 5u, bottom.low.y, bottom.rest.y, bottom.entry.y)
        | settle(tile, loosest, column, 6u, bottom.low.z, bottom.rest.z, bottom.entry.z)
        | settle(tile, loosest, column, 7u, bottom.low.w, bottom.rest.w, bottom.entry.w);
    while again != 0u {
        let row = firstTrailingBit(again);
        again &= again - 1u;
        let below = row >= 4u;
        let low = select(top.low, bottom.low, below);
        let rest = select(top.rest, bottom.rest, below);
        let entry = select(top.entry, bottom.entry, below);
        let at = vec4<u32>(row & 3u) == vec4<u32>(0u, 1u, 2u, 3u);
        look_again(tile, eye, range, column, row, pick(low, at), pick(rest, at), entry_at(entry, at));
    }
}

fn pick(v: vec4<f32>, at: vec4<bool>) -> f32 {
    return select(select(v.x, v.y, at.y), select(v.z, v.w, at.w), at.z || at.w);
}

fn entry_at(v: vec4<u32>, at: vec4<bool>) -> u32 {
    return select(select(v.x, v.y, at.y), select(v.z, v.w, at.w), at.z || at.w);
}

// With the bounds of the best alone.
fn look_again(tile: Tile, eye: Eye, range: Range, column: u32, row: u32, low: f32, rest: f32, named: u32) {
    let entry = named & ~AGAIN;
    let pixels = pixels_of(eye, column, vec4<f32>(f32(row)));
    let item = prepare(eye, records[entry - frame.first]);
    let high = upper(range, item, chord(item, pixels));
    finish(tile, row * 8u + column, State(i32(entry), low, high, rest));
}
