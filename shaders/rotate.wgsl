// Exact integers from a centre to the view: products of 30-bit numbers by their halves.
// Rust twin: `split` and `rotate` in crates/gpu/src/plan.rs.

struct Split {
    high: vec3<i32>,
    low: vec3<i32>,
}

// v = high 2^15 + low with |low| <= 2^14.
fn split(v: vec3<i32>) -> Split {
    let high = (v + vec3<i32>(16384)) >> vec3<u32>(15u);
    return Split(high, v - (high << vec3<u32>(15u)));
}

// Within 1.25 of (axis . v) / 2^30, for |axis| <= 1.5 * 2^30 as a vector and each |v_k| <= 2^28.
// The products of low parts are left out; no sum overflows (lemma K2 of docs/numerics.md).
fn rotate(axis: Split, v: Split) -> i32 {
    let cross = dot(axis.high, v.low) + dot(axis.low, v.high);
    return dot(axis.high, v.high) + ((cross + 16384) >> 15u);
}
