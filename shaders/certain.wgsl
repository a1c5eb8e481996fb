// The filter is on: bounds as derived in docs/numerics.md (groups W, O, V). U is 2^-23, one
// rounding of WGSL (lemma A3).
const U = 0x1p-23;
// Room for the rounding of the bounds themselves.
const SURE = 1.01;

// The greater of a doubt and a sphere's own, see `Item`.
fn doubtful(doubt: f32, item: Item) -> f32 {
    return greater(doubt, item.doubt);
}

// The least key of all spheres but the best, after a visit. A sphere that lost is one of them; if
// it won, the former best is. A loser whose hit is not safe may have the least key of all: the
// pixel then stays undecided until a safe hit with a smaller key wins.
fn others(old: Nearest, low: vec4<u32>, lost: vec4<bool>) -> vec4<u32> {
    return select(old.low, min(old.rest, low), lost);
}

// Judges four pixels after some visits. `doubt` is the widest depth interval of all spheres visited
// so far. If another key lies within the best's interval, the entry becomes UNDECIDED, until a
// nearer sphere wins; so the other keys can be forgotten. Keys compare as depths do. A pixel
// without a sphere is settled.
//
// The best has an upper bound only if its hit is safe. That settles all but a few pixels in ten
// thousand. To fetch the best's record again for a closer look at every pixel would cost more than
// to resolve those on the host.
fn judge_half(found: Nearest, doubt: f32) -> Nearest {
    let high = bitcast<vec4<u32>>(bitcast<vec4<f32>>(found.low) + vec4<f32>(doubt));
    let undecided = bitcast<vec4<u32>>(vec4<i32>(UNDECIDED));
    return Nearest(found.low, vec4<u32>(~0u), select(undecided, found.entry, found.rest > high));
}

fn judge(found: Column, doubt: f32) -> Column {
    return Column(judge_half(found.top, doubt), judge_half(found.bottom, doubt));
}
