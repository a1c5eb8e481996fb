// Depth of a hit where clip planes may cut spheres open: the near root if it is in range, else the far root if that is.
// Every comparison uses bounds; where they do not tell, the hit has a lower bound only.

struct Range {
    // below and above near, below and above far
    planes: vec4<f32>,
}

fn range_of(at: u32) -> Range {
    return Range(planes[at]);
}

// 2 E / sqrt q, which bounds what the half chord may be too long; large where the hit is in doubt.
fn doubt(item: Item, c: Chord) -> vec4<f32> {
    let error = item.bounds.y;
    let sure = vec4<bool>(error < NEVER) & (c.square > vec4<f32>(2.2 * error));
    return select(vec4<f32>(NEVER), vec4<f32>(2.02 * error) / max(c.root, vec4<f32>(1.0)), sure);
}

// Not more than the depth of the hit; NEVER for a certain miss.
fn lower(range: Range, item: Item, c: Chord) -> vec4<f32> {
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
    return select(first, vec4<f32>(NEVER), gone | (first > vec4<f32>(range.planes.w)));
}

// Not less than the depth of the hit; NEVER where the hit is in doubt.
fn upper(range: Range, item: Item, c: Chord) -> f32 {
    let wide = 2.02 * item.bounds.x;
    let short = doubt(item, c).x;
    let low = c.depth.x - c.half.x;
    let near_high = low + wide + short;
    let far_low = c.depth.x + max(c.half.x - short, 0.0);
    let far_high = c.depth.x + wide + c.half.x;
    let whole = low >= range.planes.y && near_high <= range.planes.z;
    let cut = near_high < range.planes.x && far_low >= range.planes.y && far_high <= range.planes.z;
    return select(select(NEVER, far_high, cut), near_high, whole && short < NEVER);
}

// Whether the depth is certain to be that of the near root, to twice the item's `width`.
fn safe(range: Range, item: Item, c: Chord) -> vec4<bool> {
    let low = c.depth - c.half;
    let high = low + vec4<f32>(2.02 * item.width);
    return (c.square > vec4<f32>(item.safe)) & (low >= vec4<f32>(range.planes.y)) & (high <= vec4<f32>(range.planes.z));
}
