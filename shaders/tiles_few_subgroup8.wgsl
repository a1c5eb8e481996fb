// Four tiles of 8 x 8 pixels whose lists have two entries at most are drawn by a subgroup of 8:
// each lane fetches one entry of one tile, then all eight draw the tiles in turn, a column of 8
// pixels each. What a tile costs besides its entries is most of what such tiles cost.
@group(0) @binding(3) var<storage, read> tiles: array<Tile>;

// The tile whose entries are those of a lane and the next; none from tile `end` on.
fn draw(
    end: u32, at: u32, lane: u32, eye: Eye, item: Item, entry: u32, doubt: f32, slot: u32, one: u32
) {
    let pixels = pixels_of(share_eye(eye, one), lane);
    let ranges = ranges_of(at, pixels);
    let two = one + 1u;
    var found = visit(nothing(), ranges, share(item, one), subgroupShuffle(entry, one), pixels);
    found = visit(found, ranges, share(item, two), subgroupShuffle(entry, two), pixels);
    let either = max(subgroupShuffle(doubt, one), subgroupShuffle(doubt, two));
    let there = subgroupShuffle(slot, one);
    if at < end {
        settle_column(Tile(0u, 0u, 0, 0, 0, there), lane, judge(found, either), either);
    }
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(subgroup_id) part: u32,
    @builtin(subgroup_invocation_id) lane: u32,
) {
    let frame = uniforms;
    let bounds = bounds_of(frame);
    let first = (group.y * frame.row + group.x) * TOGETHER + part * 4u;
    if first >= frame.tiles {
        return;
    }
    // Past the end the last tile is fetched again, and not drawn.
    let at = min(first + lane / 2u, frame.tiles - 1u);
    let tile = tiles[at];
    let eye = eye_of(frame, bounds, tile, at, lane);
    let own = entries[tile.start + min(lane % 2u, max(tile.count, 1u) - 1u)];
    var item = prepare(eye, records[own - frame.first]);
    if lane % 2u >= tile.count {
        item = beyond(item);
    }
    let doubt = doubtful(eye.doubt, item);
    draw(frame.tiles, first + 0u, lane, eye, item, own, doubt, tile.slot, 0u);
    draw(frame.tiles, first + 1u, lane, eye, item, own, doubt, tile.slot, 2u);
    draw(frame.tiles, first + 2u, lane, eye, item, own, doubt, tile.slot, 4u);
    draw(frame.tiles, first + 3u, lane, eye, item, own, doubt, tile.slot, 6u);
}
