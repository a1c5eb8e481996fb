// A tile of 8 x 8 pixels is drawn by 8 invocations, a column of 8 pixels each; no subgroups are
// needed.
@group(0) @binding(3) var<storage, read> tiles: array<Tile>;

fn tile_at(at: u32) -> Tile {
    return tiles[at];
}

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let frame = uniforms;
    let bounds = bounds_of(frame);
    let at = (group.y * frame.row + group.x) * 8u + local / 8u;
    if at >= frame.tiles {
        return;
    }
    let column = local % 8u;
    let tile = tile_at(at);
    let eye = eye_of(frame, bounds, tile, at, column);
    let pixels = pixels_of(eye, column);
    let ranges = ranges_of(at, pixels);
    var found = nothing();
    // See tiles_subgroup8.wgsl.
    var doubt = eye.doubt;
    // Conditions come last, see tiles_subgroup8.wgsl; an empty list reads what is not used.
    var i = 0u;
    loop {
        var front = -NEVER;
        let end = min(i + 8u, max(tile.count, 1u));
        loop {
            let entry = entries[tile.start + i];
            var item = prepare(eye, records[entry - frame.first]);
            if tile.count == 0u {
                item = beyond(item);
            }
            front = max(front, item.front);
            doubt = doubtful(doubt, item);
            found = visit(found, ranges, item, entry, pixels);
            i += 1u;
            if i >= end {
                break;
            }
        }
        found = judge(found, doubt);
        // All later entries begin beyond this; enough is known when that is beyond every pixel's
        // best.
        if (front - frame.disorder) - doubt > deepest(found, pixels) {
            break;
        }
        if i >= tile.count {
            break;
        }
    }
    settle_column(tile, column, found, doubt);
}
