// The filter is off: plain f32, for comparison in benchmarks only. All bounds are zero, and only
// the nearest is known.
const U = 0.0;
const SURE = 0.0;

fn doubtful(doubt: f32, item: Item) -> f32 {
    return 0.0;
}

fn loses(range: Range, item: Item, c: Chord, low: vec4<u32>, best: vec4<u32>) -> vec4<bool> {
    return low > best;
}

fn others(old: Nearest, low: vec4<u32>, lost: vec4<bool>) -> vec4<u32> {
    return old.rest;
}

fn judge(found: Column, doubt: f32) -> Column {
    return found;
}

// Nothing waits for a doubt here.
fn told_after(item: Item, doubt: f32, ranges: Ranges) -> Item {
    return item;
}
