// The filter is on: bounds as derived.
const U = 0x1p-23;
// Room for the rounding of the bounds themselves.
const SURE = 1.01;

// The greater of a doubt and a sphere's own, see `Item`.
fn doubtful(doubt: f32, item: Item) -> f32 {
    return greater(doubt, item.doubt);
}

// The least key of all but the best, after a visit. What lost may be nearer still, as a hit that is
// not safe: then it is among the others, its key is the least of all, and the pixel is not settled
// before something nearer wins.
fn others(old: Nearest, low: vec4<u32>, lost: vec4<bool>) -> vec4<u32> {
    return select(old.low, min(old.rest, low), lost);
}

// What is known after some visits, no depth of which is in greater doubt than this, both ends
// together. What is named is undecided if another key is not beyond the best's upper bound, until
// something nearer wins: so the others can be forgotten. Order of keys is that of depths. Nothing
// seen is settled.
//
// The best has an upper bound only where its hit is safe. That settles all but a few pixels in ten
// thousand; to fetch the best's record again for a closer look would cost more, at every pixel,
// than to decide those on the host.
fn judge_half(found: Nearest, doubt: f32) -> Nearest {
    let high = bitcast<vec4<u32>>(bitcast<vec4<f32>>(found.low) + vec4<f32>(doubt));
    let undecided = bitcast<vec4<u32>>(vec4<i32>(UNDECIDED));
    return Nearest(found.low, vec4<u32>(~0u), select(undecided, found.entry, found.rest > high));
}

fn judge(found: Column, doubt: f32) -> Column {
    return Column(judge_half(found.top, doubt), judge_half(found.bottom, doubt));
}
