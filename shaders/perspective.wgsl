// Perspective rays: spheres about a tile, and the chord of a pixel's ray in a sphere.
//
// The ray of a pixel is t (sx, sy, 1), t the depth. With n = Z sx - X and m = Y - Z sy the square of the centre's distance from it, times
// a = 1 + sx^2 + sy^2, is d^2 = m^2 + n^2 + (n sy + m sx)^2, and the roots are
//     t = Z + (m sy - n sx -+ sqrt(D)) / a,     D = a R^2 - d^2.
// n0, m0 of the tile's middle come from integers, as in orthographic.wgsl; then n = n0 + Z (sx - sx0), m = m0 - Z (sy - sy0).
// In steps; u = 2^-23; k = `spread` >= sqrt a in the tile; P = sqrt a R <= k R.
//
// Place. Z (from the camera) is good to delta_depth + 4 u |Z|: plan.rs adds 4 pitch delta_depth to delta; with the roundings of
// the offset and the sums the error of n, m is at most e = delta_p + 4 u |n|, delta_p = delta + 40 u pitch |Z|.
// sx is good to 2 u k, so n sy + m sx has an error of at most k (2 e + 7.2 u |(n, m)|), and as a vector of length d the error is
// eps <= k (1.42 delta_p + 13 u |(n, m)|).
//
// Square. For d* <= 1.2 P: |d2 - d2*| <= 3.41 k P delta_p + 37.5 u k P^2 + 4.1 k^2 delta_p^2, roundings (a: 11 u, R^2 and its reach, products,
// sums) 24 u P^2. As P^2 = a R^2 and a >= 1, that is at most a e for e = 3.6 k R delta_p + 62 u k R^2 + 4.3 k^2 delta_p^2: with
// square = a (R^2 + e) - d2, q* lies in [square - 2 E, square] for E = k^2 e. Certain hits need R >= 32 k^2 delta_p and k <= 8 (the host sees to
// it), which keep d* below 1.2 P.
//
// Depth. (m sy - n sx) / a is at most 1.2 R and, as (|sx| + |sy|) / a <= 0.71, good to 0.71 delta_p + (9.2 k + 21) u R; the half chord to 22 u R; the
// sums to u |Z| + 4.5 u R, the conversion to u |Z|: slack = delta_depth + 0.71 delta_p + u (6 |Z| + 60 k R).

// What is the same for all spheres of a tile: asked for once, as a software device would do so again for each.
struct Eye {
    x: Split,
    y: Split,
    z: Split,
    offset: vec3<i32>,
    center: vec2<f32>,
    // As in Frame.
    scale: f32,
    delta: f32,
    delta_depth: f32,
    base: i32,
    base_far: f32,
    // At least the length of the direction of any ray of the tile.
    spread: f32,
    // The greater of both.
    pitch: f32,
}

struct Item {
    // n0, m0, lower end of the centre's depth, depth from the camera
    shape: vec4<f32>,
    // R^2 + e
    reach: f32,
    // slack of the depth, bound E of D, or NEVER where no hit is certain
    bounds: vec2<f32>,
    // Above this square, at least 2.2 E, a hit is certain. Then root - sqrt(q*) <= 2 E / (root + sqrt(root^2 - 2 E)) <= 1.54 E / root, and its
    // depth is good to 2.02 `width`, which is at least slack + 0.77 E / root of this: of both its terms the lesser.
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
    return Eye(
        split(fan.n),
        split(fan.m),
        split(frame.forward),
        vec3<i32>(tile.x, tile.y, tile.z),
        vec2<f32>(fan.sx, fan.sy),
        frame.scale,
        frame.delta,
        frame.delta_depth,
        frame.base,
        frame.base_far,
        1.001 * sqrt(1.0 + far.x * far.x + far.y * far.y),
        greater(frame.pitch_x, frame.pitch_y),
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
    let z = f32(along + eye.offset.z);
    let distance = f32(along + eye.base) + eye.base_far;
    let any_radius = bitcast<f32>(record.w) * eye.scale;
    let huge = any_radius > GREATEST_RADIUS;
    let radius = select(any_radius, 0.0, huge);
    let k = eye.spread;
    let delta = eye.delta + 41.0 * U * eye.pitch * abs(distance);
    let slack = SURE * (eye.delta_depth + 0.71 * delta + U * (6.0 * abs(z) + 60.0 * k * radius));
    let part = SURE * k * (3.7 * delta + 63.0 * U * radius);
    let error = radius * part + SURE * 4.4 * k * k * delta * delta;
    let most = k * k * error;
    let certain = (radius >= 32.0 * k * k * delta) & !huge;
    let safe = greater(radius * radius / (REACH * REACH), 2.2 * most);
    let width = slack + lesser(0.84 * REACH * k * k * part, 0.54 * sqrt(most));
    return Item(
        vec4<f32>(n, m, select(z - slack, -1e30, huge), distance),
        select(radius * radius + error, 1e30, huge),
        vec2<f32>(select(slack, 1e30, huge), select(NEVER, most, certain)),
        select(NEVER, safe, certain),
        select(0.0, width, certain),
        select(z - slack - radius, -1e30, huge),
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
    return Item(item.shape, -1e30, item.bounds, item.safe, item.width, item.front);
}
