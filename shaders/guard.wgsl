// The filter is on, rays are parallel, and no plane cuts: then safe hits are those that begin before a depth that is the same at all
// pixels, `guard`. It stands for a loser, so that a best is settled only if its upper bound lies before it: then
// root > root of `safe` + 1.02 width - roundings (u (4 |z| + 6 R)), and those are less than a width. A hit behind it loses against itself. No best
// is marked.
fn mark(range: Range, item: Item, c: Chord) -> vec4<u32> {
    return vec4<u32>(0u);
}

// Which of two keys does not stay the least, or the guard before it.
fn loser(old: vec4<u32>, low: vec4<u32>, item: Item) -> vec4<u32> {
    return max(min(old, vec4<u32>(bitcast<u32>(item.guard))), low);
}
