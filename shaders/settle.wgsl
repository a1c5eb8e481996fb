// From the running answer to what is known of each of eight pixels: the best's upper bound is found once, from its record.

fn settle(tile: Tile, eye: Eye, range: Range, column: u32, row: u32, low: f32, rest: f32, entry: u32) {
    var found = State(NONE, low, NEVER, rest);
    if low < NEVER {
        let pixels = pixels_of(eye, column, vec4<f32>(f32(row)));
        let item = prepare(eye, records[entry]);
        found.id = i32(frame.first + entry);
        found.high = upper(range, item, chord(item, pixels));
    }
    finish(tile, row * 8u + column, found);
}

fn settle_column(tile: Tile, eye: Eye, range: Range, column: u32, top: Nearest, bottom: Nearest) {
    settle(tile, eye, range, column, 0u, top.low.x, top.rest.x, top.entry.x);
    settle(tile, eye, range, column, 1u, top.low.y, top.rest.y, top.entry.y);
    settle(tile, eye, range, column, 2u, top.low.z, top.rest.z, top.entry.z);
    settle(tile, eye, range, column, 3u, top.low.w, top.rest.w, top.entry.w);
    settle(tile, eye, range, column, 4u, bottom.low.x, bottom.rest.x, bottom.entry.x);
    settle(tile, eye, range, column, 5u, bottom.low.y, bottom.rest.y, bottom.entry.y);
    settle(tile, eye, range, column, 6u, bottom.low.z, bottom.rest.z, bottom.entry.z);
    settle(tile, eye, range, column, 7u, bottom.low.w, bottom.rest.w, bottom.entry.w);
}
