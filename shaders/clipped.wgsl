// Depth of a hit where clip planes may cut spheres open: the near root if it is in range, else the far root if that is.
// Every comparison uses bounds; where they do not tell, the hit has a lower bound only.

struct Range {
    // below and above near, below and above far
    planes: vec4<f32>,
}

fn range_of(at: u32) -> Range {
    return Range(planes[at]);
}

// 1.54 E / root (see `width`), which bounds what the half chord may be too long; large where the hit is in doubt.
fn doubt(item: Item, c: Chord) -> vec4<f32> {
    let error = item.bounds.y;
    let sure = vec4<bool>(error < NEVER) & (c.square > vec4<f32>(2.2 * error));
    return select(vec4<f32>(NEVER), vec4<f32>(1.56 * error) / max(c.root, vec4<f32>(1.0)), sure);
}

// The key of a lower bound of the hit's depth; MISS for a certain miss.
fn lower(range: Range, item: Item, c: Chord) -> vec4<u32> {
    let wide = 2.02 * item.bounds.x;
    let short = doubt(item, c);
    // The near root lies before the centre's foot, and not before low.
    let low = c.depth - c.half;
    let near_high = c.depth + vec4<f32>(wide) - max(c.half - short, vec4<f32>(0.0));
    let far_low = c.depth + max(c.half - short, vec4<f32>(0.0));
    let far_high = c.depth + vec4<f32>(wide) + c.half;
    let cut = near_high < vec4<f32>(range.planes.x);
    let gone = (c.square <= vec4<f32>(0.0)) | (far_high < vec4<f32>(range.planes.x));
    let first = max(select(low, far_low, cut), vec4<f32>(range.planes.x));
    return select(key(first), vec4<u32>(MISS), gone | (first > vec4<f32>(range.planes.w)));
}

// 0 where the hit is certain, and its depth at most the lower bound + 2.02 `width`, as in open.wgsl, else AGAIN: the near root in range for
// certain, or before it for certain and the far root in range.
fn unsafe_bit(range: Range, item: Item, c: Chord) -> vec4<u32> {
    let wide = vec4<f32>(2.02 * item.bounds.x);
    let short = doubt(item, c);
    let low = c.depth - c.half;
    let near_high = low + wide + short;
    let far_low = c.depth + max(c.half - short, vec4<f32>(0.0));
    let far_high = c.depth + wide + c.half;
    let whole = (low >= vec4<f32>(range.planes.y)) & (near_high <= vec4<f32>(range.planes.z));
    let cut = (near_high < vec4<f32>(range.planes.x)) & (far_low >= vec4<f32>(range.planes.y))
        & (far_high <= vec4<f32>(range.planes.z));
    return select(vec4<u32>(AGAIN), vec4<u32>(0u), (c.square > vec4<f32>(item.safe)) & (whole | cut));
}
