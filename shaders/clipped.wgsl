// Depth of a hit where clip planes may cut spheres open: the near root if it is in range, else the far root if that is.
// Every comparison uses bounds; where they do not tell, the hit has a lower bound only.

struct Range {
    // below and above near, below and above far
    planes: vec4<f32>,
}

fn range_of(at: u32) -> Range {
    return Range(planes[at]);
}

// Bounds of both roots as depths.
struct Ends {
    near_low: vec4<f32>,
    near_high: vec4<f32>,
    far_low: vec4<f32>,
    far_high: vec4<f32>,
}

fn ends(item: Item, c: Chord) -> Ends {
    // What the half chord may be too long: 2 E / (root + sqrt(root^2 - 2 E)) where root^2 > 4 E; all of it where the hit is in doubt.
    let late = vec4<f32>(1.18 * item.bounds.y) / max(c.root, vec4<f32>(1.0));
    let least = select(vec4<f32>(0.0), max(c.half - late, vec4<f32>(0.0)), c.square > vec4<f32>(item.safe));
    let slack = vec4<f32>(SURE * item.bounds.x);
    let low = c.depth - slack;
    let high = c.depth + slack;
    return Ends(low - c.half, high - least, low + least, high + c.half);
}

// The key of a lower bound of the hit's depth; MISS for a certain miss.
fn lower(range: Range, item: Item, c: Chord) -> vec4<u32> {
    let e = ends(item, c);
    let cut = e.near_high < vec4<f32>(range.planes.x);
    let gone = (c.square <= vec4<f32>(0.0)) | (e.far_high < vec4<f32>(range.planes.x));
    let first = max(select(e.near_low, e.far_low, cut), vec4<f32>(range.planes.x));
    return select(key(first), vec4<u32>(MISS), gone | (first > vec4<f32>(range.planes.w)));
}

// The hit is certain, and its depth in no greater doubt above the key than in open.wgsl: the near root in range for certain, or before it for
// certain and the far root in range.
fn safe(range: Range, item: Item, c: Chord) -> vec4<bool> {
    let e = ends(item, c);
    let whole = (e.near_low >= vec4<f32>(range.planes.y)) & (e.near_high <= vec4<f32>(range.planes.z));
    let cut = (e.near_high < vec4<f32>(range.planes.x)) & (e.far_low >= vec4<f32>(range.planes.y))
        & (e.far_high <= vec4<f32>(range.planes.z));
    return (c.square > vec4<f32>(item.safe)) & (whole | cut);
}
