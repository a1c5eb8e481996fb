// Orthographic rays: spheres about a tile, and the chord of a pixel's ray in a sphere.
//
// In steps, from the middle of the tile. u = 2^-23: WGSL may round any operation either way.
//
// Place. The integer offset is off by at most `delta` less its last part (plan.rs). Its conversion, the pixel's offset
// (one factor rounded by the host, one product) and their difference add at most u (|X| + 1.6 |p| + |dx|) with
// |X| <= |dx| + |p| and |p| <= 3.5 pitches; with room for another order of the terms `delta` has 24 u pitches, and e = delta + 4 u |dx|
// bounds the error of each of dx, dy. As a vector: eps = sqrt 2 (delta + 4 u d).
//
// Square. For true d <= 1.2 R: |d2 - d2*| <= 2 d eps + eps^2 <= 3.4 R delta + 16.3 u R^2 + 4.1 delta^2, and the roundings of the
// products, sums and of R^2 add 8 u R^2. So E = 4 R delta + 5 delta^2 + 32 u R^2 bounds the error of q = R^2 - d2, and with
// reach = R^2 + E:   reach - d2 <= 0 is a certain miss (for d* <= R the first bound holds for any delta);
// and q* lies in [square - 2 E, square] when R >= 32 delta, since then d* <= 1.2 R.

// What is the same for all spheres of a tile: asked for once, as a software device would do so again for each.
struct Eye {
    x: Split,
    y: Split,
    z: Split,
    offset: vec3<i32>,
    // As in Frame.
    scale: f32,
    delta: f32,
    delta_depth: f32,
}

struct Item {
    // x, y, lower end of the centre's depth, reach
    shape: vec4<f32>,
    // slack of the depth (below), bound E of q, or NEVER where no hit is certain
    bounds: vec2<f32>,
    // Above this square, at least 2.2 E, a hit is certain. Then root - sqrt(q*) <= 2 E / (root + sqrt(root^2 - 2 E)) <= 1.54 E / root, and its
    // depth is good to 2.02 `width`, which is at least slack + 0.77 E / root of this: of both its terms the lesser.
    safe: f32,
    // See guard.wgsl: at most shape.z + `width` less the root of `safe`, and not negative; 0 where no hit is certain.
    guard: f32,
    // Not passed from lane to lane, as what follows: the greatest of a tile's list stands for all.
    width: f32,
    // Not more than the depth at which the sphere begins.
    front: f32,
}

// A column of four pixels: offsets from the tile's middle.
struct Pixels {
    x: f32,
    y: vec4<f32>,
}

// The ray in the sphere. Not more than `square` is q, `root` its square root, `half` the half chord as depth, about `depth`; it begins at `near`.
struct Chord {
    square: vec4<f32>,
    root: vec4<f32>,
    half: vec4<f32>,
    depth: vec4<f32>,
    near: vec4<f32>,
}

fn eye_of(tile: Tile, at: u32) -> Eye {
    let offset = vec3<i32>(tile.x, tile.y, tile.z);
    return Eye(split(frame.right), split(frame.up), split(frame.forward), offset, frame.scale, frame.delta, frame.delta_depth);
}

fn pixels_of(eye: Eye, column: u32, rows: vec4<f32>) -> Pixels {
    return Pixels((f32(column) - 3.5) * frame.pitch_x, (vec4<f32>(3.5) - rows) * frame.pitch_y);
}

// Depth: Z* - s* > depth - root, where the slack covers the integer's error, its conversion (u |Z|), the square root (4.5 u, R)
// and the differences (2 u |Z| + u R).
fn prepare(eye: Eye, record: vec4<i32>) -> Item {
    let center = split(record.xyz);
    let x = f32(rotate(eye.x, center) + eye.offset.x);
    let y = f32(rotate(eye.y, center) + eye.offset.y);
    let z = f32(rotate(eye.z, center) + eye.offset.z);
    let any_radius = bitcast<f32>(record.w) * eye.scale;
    let huge = any_radius > GREATEST_RADIUS;
    let radius = select(any_radius, 0.0, huge);
    let slack = SURE * (eye.delta_depth + U * (6.0 * abs(z) + 8.0 * radius));
    let part = SURE * (4.1 * eye.delta + 33.0 * U * radius);
    let error = radius * part + SURE * 5.1 * eye.delta * eye.delta;
    let certain = (radius >= 32.0 * eye.delta) & !huge;
    let safe = greater(radius * radius / (REACH * REACH), 2.2 * error);
    let root = sqrt(error);
    let width = slack + lesser(0.84 * REACH * part, 0.54 * root);
    let guard = greater(z - slack + width - greater(radius / REACH, 1.49 * root), 0.0);
    return Item(
        vec4<f32>(x, y, select(z - slack, -1e30, huge), select(radius * radius + error, 1e30, huge)),
        vec2<f32>(select(slack, 1e30, huge), select(NEVER, error, certain)),
        select(NEVER, safe, certain),
        select(0.0, guard, certain),
        select(0.0, width, certain),
        select(z - slack - radius, -1e30, huge),
    );
}

fn chord(item: Item, pixels: Pixels) -> Chord {
    let dx = pixels.x - item.shape.x;
    let dy = pixels.y - item.shape.y;
    let square = (item.shape.w - dx * dx) - dy * dy;
    let root = sqrt(bitcast<vec4<f32>>(max(bitcast<vec4<i32>>(square), vec4<i32>(0))));
    let z = vec4<f32>(item.shape.z);
    return Chord(square, root, root, z, z - root);
}

// An item that no ray hits.
fn beyond(item: Item) -> Item {
    return Item(vec4<f32>(item.shape.xyz, -1e30), item.bounds, item.safe, item.guard, item.width, item.front);
}
