// What the device is given and gives back. Every struct is compared with its twin in
// crates/gpu/src/plan.rs by tests/shaders.rs.
//
// Lengths are in steps, f32 lengths too. A step is a power of two of the scene's fixed-point unit,
// chosen per view (`Eye::new` in plan.rs).

// One per pass.
struct Frame {
    // The camera's axes times 2^30 over the size of a step in fixed-point units. Perspective tiles
    // bring their own x and y.
    right: vec3<i32>,
    // Width of a pixel: in steps, or on the screen at distance 1.
    pitch_x: f32,
    up: vec3<i32>,
    pitch_y: f32,
    forward: vec3<i32>,
    // Bound on the error of a centre's place across the view, in steps.
    delta: f32,
    // Bound on the error of a centre's depth, in steps.
    delta_depth: f32,
    // Steps per fixed-point unit.
    scale: f32,
    // Depth of the middle of the data, in steps, as the sum of both: perspective only.
    base: i32,
    base_far: f32,
    // Place of the first sphere of the chunk.
    first: u32,
    // Tiles of this pass.
    tiles: u32,
    // Workgroups in a row of the dispatch.
    row: u32,
    // No entry of a list begins nearer, by more than this, than any before it; NEVER if nothing is
    // promised. In steps.
    disorder: f32,
}

// One per tile and pass.
struct Tile {
    // Entries of the tile in this pass.
    start: u32,
    count: u32,
    // From the middle of the data to the tile: added to a rotated centre, in steps.
    x: i32,
    y: i32,
    z: i32,
    // Where its pixels lie in `ids` and `states`, and FRESH and LAST.
    slot: u32,
}

// Rays of a tile's middle, perspective only.
struct Fan {
    // Axis of n = Z sx - X, as those of Frame.
    n: vec3<i32>,
    // The middle's place on the screen at distance 1.
    sx: f32,
    // Axis of m = Y - Z sy.
    m: vec3<i32>,
    sy: f32,
}

// What is known of a pixel between two passes.
struct State {
    id: i32,
    // Lower bound of the depth of `id`.
    low: f32,
    // Upper bound of the depth of `id`.
    high: f32,
    // Least lower bound of what other passes saw.
    rest: f32,
}

// No earlier pass has written the state of this tile.
const FRESH = 0x80000000u;
// No later pass will read it: write ids.
const LAST = 0x40000000u;
const SLOT = 0x3fffffffu;

// Tiles of a workgroup, where subgroups of 8 draw several in turn.
const TOGETHER = 32u;

// A depth behind every other.
const NEVER = 1e36;
// Nothing seen, in `ids`.
const NONE = -1;
// The host must decide, in `ids`; as at all that is less.
const UNDECIDED = -2;
// Spheres above this radius (in steps) would overflow squares: every pixel of their tiles is left
// to the host.
const GREATEST_RADIUS = 0x1p40;

// The greater and the lesser of two numbers that are not negative: as bits, as software devices
// take several instructions for floats, for the sake of NaN, and one for integers.
fn greater(a: f32, b: f32) -> f32 {
    return bitcast<f32>(max(bitcast<i32>(a), bitcast<i32>(b)));
}

fn lesser(a: f32, b: f32) -> f32 {
    return bitcast<f32>(min(bitcast<i32>(a), bitcast<i32>(b)));
}

// At least the square root of a normal positive number, and at most 1.061 times it: half of its
// bits, and one for the bit that is dropped (lemma W2 of docs/numerics.md).
fn above_root(x: f32) -> f32 {
    return bitcast<f32>((bitcast<u32>(x) >> 1u) + 0x1fc00001u);
}

// Loaded whole, and before anything else: where some lanes have returned, software devices fetch
// numbers one lane at a time.
@group(0) @binding(0) var<uniform> uniforms: Frame;
// Centre in fixed point (x, y, z), bits of the radius in fixed-point units as f32.
@group(0) @binding(1) var<storage, read> records: array<vec4<i32>>;
// Places of spheres among all; `frame.first` is that of record 0.
@group(0) @binding(2) var<storage, read> entries: array<u32>;
// Binding 3, the tiles, is in tiles_*.wgsl.
// 64 per slot, column by column: software devices store four at little more than the price of one.
@group(0) @binding(4) var<storage, read_write> ids: array<vec4<i32>>;
