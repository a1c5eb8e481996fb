// Perspective rays: spheres about a tile, and the chord of a pixel's ray in a sphere.
//
// The ray of a pixel is t (sx, sy, 1), t the depth. With n = Z sx - X and m = Y - Z sy the square of the centre's distance from it, times
// a = 1 + sx^2 + sy^2, is d^2 = m^2 + n^2 + (n sy + m sx)^2, and the roots are
//     t = Z + (m sy - n sx -+ sqrt(D)) / a,     D = a R^2 - d^2.
// n0, m0 of the tile's middle come from integers, as in orthographic.wgsl; then n = n0 + Z (sx - sx0), m = m0 - Z (sy - sy0).
// In steps; u = 2^-23; k = `spread` >= sqrt a in the tile; P = sqrt a R <= k R.
//
// Place. Z (from the camera) is good to delta_depth + 4 u |Z|, and the roundings of the offset and the sums are 40 u pitch |Z|: plan.rs adds
// both to delta, for the farthest sphere. So the error of n, m is at most delta + 4 u |n|.
// sx is good to 2 u k, so n sy + m sx has an error of at most k (2 delta + 15.2 u |(n, m)|), and as a vector of length d the error is
// eps <= k (1.42 delta + 13 u |(n, m)|).
//
// Square. If d or d* is at most P: |d2 - d2*| <= 2 P eps + eps^2 <= 2.85 k P delta + 26.1 u k P^2 + 2.1 k^2 delta^2, roundings (a: 11 u, R^2 and
// its reach, products, sums) 23 u P^2. As P^2 = a R^2 and a >= 1, that is at most a e for e = 2.9 k R delta + 50 u k R^2 + 2.2 k^2 delta^2: with
// square = a (R^2 + e) - d2, D* lies in [square - 2 a e, square] if D* >= 0 or square >= a e. So square < 0 is a certain miss. k <= 8: the host
// sees to it.
//
// Safe. Where square > 4 E for E = k^2 e >= a e the hit is certain, and (root - sqrt(D*)) / a <= 2 e / (sqrt(4 a e) + sqrt(2 a e)) <= 0.59 sqrt(e).
//
// Depth. (m sy - n sx) / a is at most 1.2 R and, as (|sx| + |sy|) / a <= 0.71, good to 0.71 delta + (9.2 k + 21) u R; the half chord to 22 u R; the
// sums to u |Z| + 4.5 u R, the conversion to u |Z|. So the depth of a hit is above key - slack with slack = delta_depth + 0.71 delta +
// u (6 |Z| + 60 k R), and that of a safe one below key + slack + 0.59 sqrt(e). As sqrt(e) >= sqrt(50 u k) R, two slacks and that are at most
// doubt = 2 delta_depth + 1.42 delta + 0.61 sqrt(e) + 14 u |Z|, with room for the roundings of keys compared.

// What is the same for all spheres of a tile: asked for once, as a software device would do so again for each.
struct Eye {
    x: Split,
    y: Split,
    z: Split,
    offset: vec3<i32>,
    center: vec2<f32>,
    // As in Frame.
    scale: f32,
    base: i32,
    base_far: f32,
    // At least the length of the direction of any ray of the tile.
    spread: f32,
    // e = error.x + R (error.y + R error.z)
    error: vec3<f32>,
    // What is in doubt of every depth: 2 delta_depth + 1.42 delta.
    doubt: f32,
}

struct Item {
    // n0, m0, depth of the centre, depth from the camera
    shape: vec4<f32>,
    // R^2 + e
    reach: f32,
    // slack of the depth, E
    bounds: vec2<f32>,
    // Hits of a greater square are safe: 4 E.
    safe: f32,
    // What is in doubt of the depth, both ends together. Not passed from lane to lane, as what follows: the greatest of a tile's list stands for all.
    doubt: f32,
    // Not more than the key of any hit.
    front: f32,
}

// A column of four pixels: offsets from the tile's middle, places on the screen, a and its inverse.
struct Pixels {
    dx: f32,
    dy: vec4<f32>,
    x: f32,
    y: vec4<f32>,
    a: vec4<f32>,
    inverse: vec4<f32>,
}

// The ray in the sphere. Not more than `square` is D, `root` its square root, `half` the half chord as depth, about `depth`; it begins at `near`.
struct Chord {
    square: vec4<f32>,
    root: vec4<f32>,
    half: vec4<f32>,
    depth: vec4<f32>,
    near: vec4<f32>,
}

fn eye_of(tile: Tile, at: u32) -> Eye {
    let fan = fans[at];
    // As far as a tile's rays run to the sides; the roundings are within the factor.
    let far = abs(vec2<f32>(fan.sx, fan.sy)) + 3.6 * vec2<f32>(frame.pitch_x, frame.pitch_y);
    let k = 1.001 * sqrt(1.0 + far.x * far.x + far.y * far.y);
    let delta = k * frame.delta;
    return Eye(
        split(fan.n),
        split(fan.m),
        split(frame.forward),
        vec3<i32>(tile.x, tile.y, tile.z),
        vec2<f32>(fan.sx, fan.sy),
        frame.scale,
        frame.base,
        frame.base_far,
        k,
        SURE * vec3<f32>(2.2 * delta * delta, 2.9 * delta, 50.0 * U * k),
        SURE * (2.0 * frame.delta_depth + 1.42 * frame.delta),
    );
}

fn pixels_of(eye: Eye, column: u32, rows: vec4<f32>) -> Pixels {
    let dx = (f32(column) - 3.5) * frame.pitch_x;
    let dy = (vec4<f32>(3.5) - rows) * frame.pitch_y;
    let x = eye.center.x + dx;
    let y = vec4<f32>(eye.center.y) + dy;
    let a = (1.0 + x * x) + y * y;
    return Pixels(dx, dy, x, y, a, 1.0 / a);
}

fn prepare(eye: Eye, record: vec4<i32>) -> Item {
    let center = split(record.xyz);
    let n = f32(rotate(eye.x, center) + eye.offset.x);
    let m = f32(rotate(eye.y, center) + eye.offset.y);
    let along = rotate(eye.z, center);
    let any_z = f32(along + eye.offset.z);
    let distance = f32(along + eye.base) + eye.base_far;
    let any_radius = bitcast<f32>(record.w) * eye.scale;
    let huge = any_radius > GREATEST_RADIUS;
    let z = select(any_z, -1e30, huge);
    let radius = select(any_radius, 0.0, huge);
    let error = eye.error.x + radius * (eye.error.y + radius * eye.error.z);
    let slack = 0.5 * eye.doubt + SURE * U * (6.0 * abs(any_z) + 60.0 * eye.spread * radius);
    let most = eye.spread * eye.spread * error;
    return Item(
        vec4<f32>(n, m, z, distance),
        select(radius * radius + error, 1e30, huge),
        vec2<f32>(select(slack, 1e30, huge), most),
        4.0 * most,
        eye.doubt + (SURE * 0.61 * above_root(error) + SURE * 14.0 * U * abs(any_z)),
        z - radius,
    );
}

fn chord(item: Item, pixels: Pixels) -> Chord {
    let n = item.shape.x + item.shape.w * pixels.dx;
    let m = item.shape.y - item.shape.w * pixels.dy;
    let across = n * pixels.y + m * pixels.x;
    let square = item.reach * pixels.a - ((m * m + n * n) + across * across);
    let root = sqrt(bitcast<vec4<f32>>(max(bitcast<vec4<i32>>(square), vec4<i32>(0))));
    let along = m * pixels.y - n * pixels.x;
    let z = vec4<f32>(item.shape.z);
    return Chord(square, root, root * pixels.inverse, z + along * pixels.inverse, z + (along - root) * pixels.inverse);
}

// An item that no ray hits.
fn beyond(item: Item) -> Item {
    return Item(item.shape, -1e30, item.bounds, item.safe, item.doubt, item.front);
}
