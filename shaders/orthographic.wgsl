// Orthographic rays: spheres about a tile, and the chord of a pixel's ray in a sphere.
//
// In steps, from the middle of the tile. A pixel's ray passes a centre (X, Y, Z) at dx, dy; then q
// = R^2 - dx^2 - dy^2, and a hit's key is Z - sqrt(q).
//
// Bounds: docs/numerics.md, measured by tests/adversary.rs. u = 2^-23, as WGSL may round any
// operation either way.
//
// The error of q is at most (lemmas O1, O2; delta of plan.rs)
//     E = 2.9 R delta + 20 u R^2 + 2.2 delta^2
// square = q + E. square <= 0 is a certain miss, square > 4 E a certain hit, of which sqrt(square)
// is too great by 0.59 sqrt(E) at most (O3).
//
// A hit's depth is at least key - slack, and that of a certain one at most key + slack + 0.59
// sqrt(E) (O4). Two slacks and that are at most doubt (O5). So keys that are apart by more than the
// greatest doubt are in the order of depths (W4).
//     slack = delta_depth + u (6 |Z| + 8 R)
//     doubt = 2 delta_depth + 0.61 sqrt(E) + 14 u |Z|

// What all tiles of a frame have in common of the bounds.
struct Bounds {
    // E = error.x + R (error.y + R error.z)
    error: vec3<f32>,
    // What is in doubt of every depth: 2 delta_depth.
    doubt: f32,
}

fn bounds_of(frame: Frame) -> Bounds {
    return Bounds(
        SURE * vec3<f32>(2.2 * frame.delta * frame.delta, 2.9 * frame.delta, 20.0 * U),
        SURE * 2.0 * frame.delta_depth,
    );
}

// What is the same for all spheres of a tile: asked for once, as a software device would do so
// again for each.
struct Eye {
    x: Split,
    y: Split,
    z: Split,
    offset: vec3<i32>,
    // Width and height of a pixel.
    pitch: vec2<f32>,
    // As in Frame.
    scale: f32,
    // Those of the frame, see Bounds.
    error: vec3<f32>,
    doubt: f32,
}

struct Item {
    // x, y, depth of the centre, reach
    shape: vec4<f32>,
    // slack of the depth, E
    bounds: vec2<f32>,
    // Hits of a greater square are safe: 4 E.
    safe: f32,
    // Of a hit that is not safe the key is greater (lemma O6): less than shape.z - sqrt(4 E), and
    // not negative. See guard.wgsl.
    guard: f32,
    // What is in doubt of the depth, both ends together. Not passed from lane to lane, as what
    // follows: the greatest of a tile's list stands for all.
    doubt: f32,
    // Not more than the key of any hit.
    front: f32,
}

// Offsets of four pixels of a column from the tile's middle.
struct Rays {
    y: vec4<f32>,
}

// A column of eight pixels: rows 0 to 3, and rows 7 to 4, which mirror them.
struct Pixels {
    x: f32,
    top: Rays,
    bottom: Rays,
}

// The rays in the sphere. Not more than `square` is q, `root` its square root, on both sides of
// depth `middle`; a hit's key is that of `near`.
struct Chord {
    square: vec4<f32>,
    root: vec4<f32>,
    middle: vec4<f32>,
    near: vec4<f32>,
}

struct Chords {
    top: Chord,
    bottom: Chord,
}

fn eye_of(frame: Frame, bounds: Bounds, tile: Tile, at: u32, lane: u32) -> Eye {
    let offset = vec3<i32>(tile.x, tile.y, tile.z);
    return Eye(
        split(frame.right),
        split(frame.up),
        split(frame.forward),
        offset,
        vec2<f32>(frame.pitch_x, frame.pitch_y),
        frame.scale,
        bounds.error,
        bounds.doubt,
    );
}

fn pixels_of(eye: Eye, column: u32) -> Pixels {
    let y = vec4<f32>(3.5, 2.5, 1.5, 0.5) * eye.pitch.y;
    return Pixels((f32(column) - 3.5) * eye.pitch.x, Rays(y), Rays(-y));
}

// Depths of keys are depths.
fn depths(rays: Rays, found: vec4<f32>) -> vec4<f32> {
    return found;
}

fn along_rays(rays: Rays, depth: f32) -> vec4<f32> {
    return vec4<f32>(depth);
}

fn plane_error(rays: Rays, depth: f32) -> vec4<f32> {
    return vec4<f32>(0.0);
}

fn prepare(eye: Eye, record: vec4<i32>) -> Item {
    let center = split(record.xyz);
    let x = f32(rotate(eye.x, center) + eye.offset.x);
    let y = f32(rotate(eye.y, center) + eye.offset.y);
    let any_z = f32(rotate(eye.z, center) + eye.offset.z);
    let any_radius = bitcast<f32>(record.w) * eye.scale;
    let huge = any_radius > GREATEST_RADIUS;
    let z = select(any_z, -1e30, huge);
    let radius = select(any_radius, 0.0, huge);
    let error = eye.error.x + radius * (eye.error.y + radius * eye.error.z);
    let root = above_root(error);
    let doubt = eye.doubt + (SURE * 0.61 * root + SURE * 14.0 * U * abs(any_z));
    let slack = 0.5 * eye.doubt + SURE * U * (6.0 * abs(any_z) + 8.0 * radius);
    return Item(
        vec4<f32>(x, y, z, select(radius * radius + error, 1e30, huge)),
        vec2<f32>(select(slack, 1e30, huge), error),
        4.0 * error,
        greater(z - (1.45 * root + doubt), 0.0),
        doubt,
        z - radius,
    );
}

fn chord(item: Item, x: f32, rays: Rays) -> Chord {
    let dy = rays.y - item.shape.y;
    let square = vec4<f32>(item.shape.w - x * x) - dy * dy;
    // Of a negative number it is some number or none: a miss, whose key is one by the square's
    // sign.
    let root = sqrt(square);
    let z = vec4<f32>(item.shape.z);
    return Chord(square, root, z, bitcast<vec4<f32>>(key(z - root)));
}

fn chords(item: Item, pixels: Pixels) -> Chords {
    let x = pixels.x - item.shape.x;
    return Chords(chord(item, x, pixels.top), chord(item, x, pixels.bottom));
}

// An item that no ray hits.
fn beyond(item: Item) -> Item {
    let shape = vec4<f32>(item.shape.xyz, -1e30);
    return Item(shape, item.bounds, item.safe, item.guard, item.doubt, item.front);
}
