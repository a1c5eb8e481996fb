// Exact integers from a centre to the view: products of 30-bit numbers by their halves.
// Rust twin: `split` and `rotate` in src/plan.rs.

struct Split {
    high: vec3<i32>,
    low: vec3<i32>,
}

// v = high 2^15 + low with |low| <= 2^14.
fn split(v: vec3<i32>) -> Split {
    let high = (v + vec3<i32>(16384)) >> vec3<u32>(15u);
    return Split(high, v - (high << vec3<u32>(15u)));
}

// Close to (axis . v) / 2^30, for |axis| <= 1.5 * 2^30 as a vector and each |v_k| <= 2^28. The
// three products of low parts are left out: at most 3 * 2^28 / 2^30 = 0.75. The shift rounds: at
// most 0.5. Middle sum: sum |axis.high| <= 1.5 sqrt(3) 2^15 + 2 times 2^14, and 3 * 2^14 (2^13 +
// 1), is below 2^31.
fn rotate(axis: Split, v: Split) -> i32 {
    let cross = dot(axis.high, v.low) + dot(axis.low, v.high);
    return dot(axis.high, v.high) + ((cross + 16384) >> 15u);
}
