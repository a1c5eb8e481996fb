fn safe(range: Range, item: Item, c: Chord) -> vec4<bool> {
    return c.square > vec4<f32>(item.safe);
}
