// Perspective rays: spheres about a tile, and the chord of a pixel's ray in a sphere.
//
// The ray of a pixel is t (sx, sy, 1), t the depth. With n = Z sx - X and m = Y - Z sy the square of the centre's distance from it, times
// a = 1 + sx^2 + sy^2, is d^2 = m^2 + n^2 + (n sy + m sx)^2, and the roots are
//     t = Z + (m sy - n sx -+ sqrt(D)) / a,     D = a R^2 - d^2.
// n0, m0 of the tile's middle come from integers, as in orthographic.wgsl; then n = n0 + Z (sx - sx0), m = m0 - Z (sy - sy0).
// In steps; u = 2^-23; k = `spread` >= sqrt a; P = sqrt a R <= k R.
//
// Place. Z (from the camera) is good to delta_depth + 4 u |Z|: plan.rs adds 4 pitch delta_depth to delta; with the roundings of
// the offset and the sums the error of n, m is at most e = delta_p + 4 u |n|, delta_p = delta + 40 u pitch |Z|.
// sx is good to 2 u k, so n sy + m sx has an error of at most k (2 e + 7.2 u |(n, m)|), and as a vector of length d the error is
// eps <= k (1.42 delta_p + 13 u |(n, m)|).
//
// Square. For d* <= 1.2 P: |d2 - d2*| <= 3.41 k P delta_p + 37.5 u k P^2 + 4.1 k^2 delta_p^2, roundings (a: 11 u, R^2, products, sums) 23 u P^2:
// E = 3.6 k^2 R delta_p + 64 u k^3 R^2 + 4.3 k^2 delta_p^2. Certain hits need R >= 32 k^2 delta_p and k <= 8 (the host sees to it),
// which keep d* below 1.2 P.
//
// Depth. (m sy - n sx) / a is at most 1.2 R and, as (|sx| + |sy|) / a <= 0.71, good to 0.71 delta_p + (9.2 k + 21) u R; the half chord to 22 u R; the
// sums to 2 u |Z| + 3.5 u R, the conversion to u |Z|: slack = delta_depth + 0.71 delta_p + u (6 |Z| + 60 k R).

struct Eye {
    x: Split,
    y: Split,
    z: Split,
    offset: vec3<i32>,
    center: vec2<f32>,
}

struct Item {
    // n0, m0, lower end of the centre's depth, depth from the camera
    shape: vec4<f32>,
    // R^2, E
    size: vec2<f32>,
    // slack of the depth, bound E of D, or NEVER where no hit is certain
    bounds: vec2<f32>,
    // Above this square, at least 2.2 E, a hit is certain. Then root - sqrt(q*) <= 2 E / (root + sqrt(root^2 - 2 E)) <= 1.54 E / root, and its
    // depth is good to 2.02 `width`.
    safe: f32,
    // Not passed from lane to lane, as what follows: the greatest of a tile's list stands for all.
    width: f32,
    // Not more than the depth at which the sphere begins.
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

// The ray in the sphere. Not more than `square` is D, `root` its square root, `half` the half chord as depth, about `depth`.
struct Chord {
    square: vec4<f32>,
    root: vec4<f32>,
    half: vec4<f32>,
    depth: vec4<f32>,
}

fn eye_of(tile: Tile, at: u32) -> Eye {
    let fan = fans[at];
    return Eye(split(fan.n), split(fan.m), split(frame.forward), vec3<i32>(tile.x, tile.y, tile.z), vec2<f32>(fan.sx, fan.sy));
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
    let z = f32(along + eye.offset.z);
    let distance = f32(along + frame.base) + frame.base_far;
    let radius = bitcast<f32>(record.w) * frame.scale;
    if radius > GREATEST_RADIUS {
        return Item(vec4<f32>(0.0, 0.0, -1e30, 0.0), vec2<f32>(0.0, 1e30), vec2<f32>(1e30, NEVER), NEVER, 0.0, -1e30);
    }
    let k = frame.spread;
    let delta = frame.delta + 41.0 * U * max(frame.pitch_x, frame.pitch_y) * abs(distance);
    let slack = SURE * (frame.delta_depth + 0.71 * delta + U * (6.0 * abs(z) + 60.0 * k * radius));
    let error = SURE * k * k * (radius * (3.7 * delta + 65.0 * U * k * radius) + 4.4 * delta * delta);
    let certain = radius >= 32.0 * k * k * delta;
    let safe = max(radius * radius / (REACH * REACH), 2.2 * error);
    return Item(
        vec4<f32>(n, m, z - slack, distance),
        vec2<f32>(radius * radius, error),
        vec2<f32>(slack, select(NEVER, error, certain)),
        select(NEVER, safe, certain),
        select(0.0, slack + 0.8 * error / sqrt(max(safe, 1.0)), certain),
        z - slack - radius,
    );
}

fn chord(item: Item, pixels: Pixels) -> Chord {
    let n = item.shape.x + item.shape.w * pixels.dx;
    let m = item.shape.y - item.shape.w * pixels.dy;
    let across = n * pixels.y + m * pixels.x;
    let square = (item.size.x * pixels.a + item.size.y) - ((m * m + n * n) + across * across);
    let root = sqrt(bitcast<vec4<f32>>(max(bitcast<vec4<i32>>(square), vec4<i32>(0))));
    let depth = vec4<f32>(item.shape.z) + (m * pixels.y - n * pixels.x) * pixels.inverse;
    return Chord(square, root, root * pixels.inverse, depth);
}

// An item that no ray hits.
fn beyond(item: Item) -> Item {
    return Item(item.shape, vec2<f32>(0.0, -1e30), item.bounds, item.safe, item.width, item.front);
}
