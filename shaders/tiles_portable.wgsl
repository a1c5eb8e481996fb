// A tile of 8 x 8 pixels is drawn by 8 invocations, a column of 8 pixels each; no subgroups are needed.
@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let at = (group.y * frame.row + group.x) * 8u + local / 8u;
    if at >= frame.tiles {
        return;
    }
    let column = local % 8u;
    let tile = tiles[at];
    let eye = eye_of(at);
    let range = range_of(at);
    let high = pixels_of(eye, column, vec4<f32>(0.0, 1.0, 2.0, 3.0));
    let deep = pixels_of(eye, column, vec4<f32>(4.0, 5.0, 6.0, 7.0));
    var top = nothing();
    var bottom = nothing();
    var loosest = 0.0;
    for (var i = 0u; i < tile.count; i += 8u) {
        var front = -NEVER;
        for (var k = i; k < min(i + 8u, tile.count); k += 1u) {
            let entry = entries[tile.start + k];
            let item = prepare(eye, records[entry - frame.first]);
            loosest = max(loosest, item.width);
            front = max(front, item.front);
            top = visit(top, range, item, entry, high);
            bottom = visit(bottom, range, item, entry, deep);
        }
        // All later entries begin beyond this; enough is known when that is beyond every pixel's best.
        front -= frame.disorder;
        if front > farthest(top, bottom) + 2.02 * loosest {
            top = cut_off(top, front);
            bottom = cut_off(bottom, front);
            break;
        }
    }
    settle_column(tile, loosest, column, top, bottom);
}
