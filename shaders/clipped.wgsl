// Depth of a hit where clip planes may cut spheres open: the near root if it is in range, else the
// far root if that is. Every comparison uses bounds; where they do not tell, the hit has a lower
// bound only.

struct Range {
    // As depths of keys: below and above near, below and above far.
    near_below: vec4<f32>,
    near_above: vec4<f32>,
    far_below: vec4<f32>,
    far_above: vec4<f32>,
}

struct Ranges {
    top: Range,
    bottom: Range,
}

fn range_for(rays: Rays, p: vec4<f32>) -> Range {
    return Range(
        along_rays(rays, p.x) - plane_error(rays, p.x),
        along_rays(rays, p.y) + plane_error(rays, p.y),
        along_rays(rays, p.z) - plane_error(rays, p.z),
        along_rays(rays, p.w) + plane_error(rays, p.w),
    );
}

fn ranges_of(at: u32, pixels: Pixels) -> Ranges {
    let p = planes[at];
    return Ranges(range_for(pixels.top, p), range_for(pixels.bottom, p));
}

// See open.wgsl.
fn opaque(lane: u32, ranges: Ranges) -> u32 {
    return lane;
}

// Bounds of both roots, as depths of keys.
struct Ends {
    near_low: vec4<f32>,
    near_high: vec4<f32>,
    far_low: vec4<f32>,
    far_high: vec4<f32>,
}

fn ends(item: Item, c: Chord) -> Ends {
    // What the half chord may be too long where root^2 > 4 E (lemma W7 of docs/numerics.md); all of
    // it where the hit is in doubt.
    let late = vec4<f32>(1.18 * item.bounds.y) / max(c.root, vec4<f32>(1.0));
    let least = select(
        vec4<f32>(0.0),
        max(c.root - late, vec4<f32>(0.0)),
        c.square > vec4<f32>(item.safe)
    );
    let slack = vec4<f32>(SURE * item.bounds.x);
    let low = c.middle - slack;
    let high = c.middle + slack;
    return Ends(low - c.root, high - least, low + least, high + c.root);
}

// The key of a lower bound of the hit's depth; MISS for a certain miss.
fn lower(range: Range, item: Item, c: Chord) -> vec4<u32> {
    let e = ends(item, c);
    let cut = e.near_high < range.near_below;
    let gone = (c.square <= vec4<f32>(0.0)) | (e.far_high < range.near_below);
    let first = max(select(e.near_low, e.far_low, cut), range.near_below);
    return select(key(first), vec4<u32>(MISS), gone | (first > range.far_above));
}

// Whether a hit is certain, with a depth interval no wider than in open.wgsl. Either the near root
// is certainly in range, or it is certainly before the near plane and the far root certainly in
// range.
fn safe(range: Range, item: Item, c: Chord) -> vec4<bool> {
    let e = ends(item, c);
    let whole = (e.near_low >= range.near_above) & (e.near_high <= range.far_below);
    let cut = (e.near_high < range.near_below) & (e.far_low >= range.near_above)
        & (e.far_high <= range.far_below);
    return (c.square > vec4<f32>(item.safe)) & (whole | cut);
}
