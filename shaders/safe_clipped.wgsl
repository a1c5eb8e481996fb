// Planes may cut: the nearest wins if its hit is safe.
fn loses(range: Range, item: Item, c: Chord, low: vec4<u32>, best: vec4<u32>) -> vec4<bool> {
    return !safe(range, item, c) | (low > best);
}

// Keys are looked at one by one, or not at all.
fn too_near(front: f32, room: f32) -> bool {
    return false;
}
