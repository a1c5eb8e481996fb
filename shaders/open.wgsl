// Depth of a hit where no sphere of the tile meets a clip plane: the near root.

struct Range {
    none: u32,
}

fn range_of(at: u32) -> Range {
    return Range(0u);
}

// Not more than the depth of the hit; NEVER for a certain miss.
fn lower(range: Range, item: Item, c: Chord) -> vec4<f32> {
    return select(vec4<f32>(NEVER), c.depth - c.half, c.square > vec4<f32>(0.0));
}

// Not less than the depth of the hit; NEVER where the hit is in doubt.
// A hit that is certain has a root of at least 10 steps.
// sqrt(q*) >= sqrt(q - 2 E) >= sqrt q - 2 E / sqrt q, and the slack counts twice: once for each end.
fn upper(range: Range, item: Item, c: Chord) -> f32 {
    let error = item.bounds.y;
    let width = 2.02 * (item.bounds.x + error / max(c.root.x, 1.0));
    return select(NEVER, c.depth.x - c.half.x + width, error < NEVER && c.square.x > 2.2 * error);
}

// Whether the depth is certain to be that of the near root, to twice the item's `width`.
fn safe(range: Range, item: Item, c: Chord) -> vec4<bool> {
    return c.square > vec4<f32>(item.safe);
}
