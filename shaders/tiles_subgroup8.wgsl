// A tile of 8 x 8 pixels is drawn by a subgroup of 8, a column of 8 pixels each. Each lane fetches
// one entry of the list, and all see all eight: on software devices a load costs far more than
// arithmetic.
@group(0) @binding(3) var<storage, read> tiles: array<array<u32, 6>>;

// Each lane fetches a word of a tile, too.
fn tile_at(at: u32, lane: u32) -> Tile {
    let own = tiles[at][min(lane, 5u)];
    return Tile(
        subgroupBroadcast(own, 0u),
        subgroupBroadcast(own, 1u),
        bitcast<i32>(subgroupBroadcast(own, 2u)),
        bitcast<i32>(subgroupBroadcast(own, 3u)),
        bitcast<i32>(subgroupBroadcast(own, 4u)),
        subgroupBroadcast(own, 5u),
    );
}

// The greatest of all lanes; 0 if all are less.
fn greatest(x: f32) -> f32 {
    let a = greater(x, 0.0);
    let b = greater(a, subgroupShuffleXor(a, 4u));
    let c = greater(b, subgroupShuffleXor(b, 2u));
    return greater(c, subgroupShuffleXor(c, 1u));
}

// The item and entry of a lane.
fn visit_of(
    found: Column, ranges: Ranges, item: Item, entry: u32, lane: u32, pixels: Pixels
) -> Column {
    let there = opaque(lane, ranges);
    return visit(found, ranges, share(item, there), subgroupShuffle(entry, there), pixels);
}

fn draw(frame: Frame, bounds: Bounds, at: u32, lane: u32) {
    let tile = tile_at(at, lane);
    let eye = eye_of(frame, bounds, tile, at, lane);
    let pixels = pixels_of(eye, lane);
    let ranges = ranges_of(at, pixels);
    var found = nothing();
    // The depth of what is best is in no greater doubt than the greatest of all entries: each one's
    // own would have to be carried along at every pixel.
    var doubt = eye.doubt;
    // The condition stands at the end: if it stands at the beginning, llvmpipe runs the body once
    // more with all lanes switched off. So an empty list has one round too, with items that no ray
    // hits.
    var i = 0u;
    loop {
        // Past the end the last entry is seen again, out of reach.
        let own = entries[tile.start + min(i + lane, max(tile.count, 1u) - 1u)];
        var item = prepare(eye, records[own - frame.first]);
        if i + lane >= tile.count {
            item = beyond(item);
        }
        // `doubt` and `front` are computed before the visits. No visit needs them, so the driver
        // would put them off to the end (see `told_after`). All later entries begin behind `front`:
        // the loop ends when that is behind the best of every pixel.
        doubt = greatest(doubtful(doubt, item));
        let front = (greatest(item.front) - frame.disorder) - doubt;
        item = told_after(item, doubt, ranges);
        found = visit_of(found, ranges, item, own, 0u, pixels);
        found = visit_of(found, ranges, item, own, 1u, pixels);
        found = visit_of(found, ranges, item, own, 2u, pixels);
        found = visit_of(found, ranges, item, own, 3u, pixels);
        found = visit_of(found, ranges, item, own, 4u, pixels);
        found = visit_of(found, ranges, item, own, 5u, pixels);
        found = visit_of(found, ranges, item, own, 6u, pixels);
        found = visit_of(found, ranges, item, own, 7u, pixels);
        found = judge(found, doubt);
        if front > greatest(deepest(found, pixels)) {
            break;
        }
        i += 8u;
        if i >= tile.count {
            break;
        }
    }
    settle_column(tile, lane, found, doubt);
}

// What is the same for all tiles of a subgroup is found once for eight.
@compute @workgroup_size(32)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(subgroup_id) part: u32,
    @builtin(subgroup_invocation_id) lane: u32,
) {
    let frame = uniforms;
    let bounds = bounds_of(frame);
    var at = (group.y * frame.row + group.x) * TOGETHER + part * 8u;
    let end = min(at + 8u, frame.tiles);
    if at >= end {
        return;
    }
    loop {
        draw(frame, bounds, at, lane);
        at += 1u;
        if at >= end {
            break;
        }
    }
}
