// The filter is off: plain f32, for comparison in benchmarks only. All bounds are zero.
const U = 0.0;
const SURE = 0.0;
