// Four tiles of 8 x 8 pixels whose lists have two entries at most are drawn by a subgroup of 8: each lane fetches one entry of one tile, then all
// eight draw the tiles in turn, a column of 8 pixels each. What a tile costs besides its entries is most of what such tiles cost.
@group(0) @binding(3) var<storage, read> tiles: array<Tile>;

fn draw(
    frame: Frame,
    at: u32,
    lane: u32,
    eye: Eye,
    one: Item,
    entry_one: u32,
    two: Item,
    entry_two: u32,
    doubt: f32,
    slot: u32,
) {
    let pixels = pixels_of(eye, lane);
    let ranges = ranges_of(at, pixels);
    var found = visit(nothing(), ranges, one, entry_one, pixels);
    found = visit(found, ranges, two, entry_two, pixels);
    if at < frame.tiles {
        settle_column(Tile(0u, 0u, 0, 0, 0, slot), lane, judge(found, doubt), doubt);
    }
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(subgroup_id) part: u32,
    @builtin(subgroup_invocation_id) lane: u32,
) {
    let frame = uniforms;
    let first = ((group.y * frame.row + group.x) * 8u + part) * 4u;
    if first >= frame.tiles {
        return;
    }
    // Past the end the last tile is fetched again, and not drawn.
    let at = min(first + lane / 2u, frame.tiles - 1u);
    let tile = tiles[at];
    let eye = eye_of(frame, tile, at, lane);
    let own = entries[tile.start + min(lane % 2u, max(tile.count, 1u) - 1u)];
    var item = prepare(eye, records[own - frame.first]);
    if lane % 2u >= tile.count {
        item = beyond(item);
    }
    let doubt = doubtful(eye.doubt, item);
    draw(frame, first + 0u, lane, eye0(eye), share0(item), subgroupBroadcast(own, 0u), share1(item), subgroupBroadcast(own, 1u),
        max(subgroupBroadcast(doubt, 0u), subgroupBroadcast(doubt, 1u)), subgroupBroadcast(tile.slot, 0u));
    draw(frame, first + 1u, lane, eye2(eye), share2(item), subgroupBroadcast(own, 2u), share3(item), subgroupBroadcast(own, 3u),
        max(subgroupBroadcast(doubt, 2u), subgroupBroadcast(doubt, 3u)), subgroupBroadcast(tile.slot, 2u));
    draw(frame, first + 2u, lane, eye4(eye), share4(item), subgroupBroadcast(own, 4u), share5(item), subgroupBroadcast(own, 5u),
        max(subgroupBroadcast(doubt, 4u), subgroupBroadcast(doubt, 5u)), subgroupBroadcast(tile.slot, 4u));
    draw(frame, first + 3u, lane, eye6(eye), share6(item), subgroupBroadcast(own, 6u), share7(item), subgroupBroadcast(own, 7u),
        max(subgroupBroadcast(doubt, 6u), subgroupBroadcast(doubt, 7u)), subgroupBroadcast(tile.slot, 6u));
}
