// Perspective rays: spheres about a tile, and the chord of a pixel's ray in a sphere.
//
// The ray of a pixel is t d with d = (sx, sy, 1), t the depth; d0 is that of the tile's middle and
// d = d0 + (dx, dy, 0). With a = d . d a sphere about C = (X, Y, Z) has the roots
//     t = (C . d -+ sqrt(D)) / a,     D = a R^2 - W . W,     W = d x C = (m, n, n sy + m sx) but
// for signs, n = Z sx - X, m = Y - Z sy. W is linear in dx and dy, as its products cancel: W = W0 +
// dx (0, Z, Y) + dy (-Z, 0, -X). So D is a polynomial of second degree in dx and dy, of which
// prepare makes the coefficients, once for a sphere and tile; C . d is linear.
//
// Keys are not depths t but t a - (apart) (d0 . d) + lift, for `apart` the depth of the tile's
// middle, from which depths in the tile are counted: for a pixel that grows as t does, and with c =
// C - apart d0 a hit has the key (lift + c . d) - sqrt(D), without a division and in numbers as
// small as depths in the tile. In such depths the key is (t - apart) a + shift, shift = apart (d -
// d0) . d + lift, and lift is so large that shift >= 0.
//
// Bounds: docs/numerics.md, measured by tests/adversary.rs. u = 2^-23; n, m, W of the tile's
// middle; s is the length of (sx, sy), k >= |d| and g >= k^2 in the tile, h at least the greater
// half of a tile on the screen.
//
// The error of D is at most (lemmas V3, V4; the shader has it without roots, V5)
//     E = 2.2 g delta^2 + 2.9 g R delta + u R^2 (g (13 + 3 s + 3 s^2) + 48 h k)
//         + u (p1 |W|^2 + p2 h^2 |C|^2)
// with the numbers p1 and p2 of V4 and delta of plan.rs. square = D + E. square <= 0 is a certain
// miss, square > 4 E a certain hit, of which sqrt(square) is too great by 0.59 sqrt(E) at most
// (V6).
//
// A hit's true key is at least key - slack, and that of a certain one at most key + slack + 0.59
// sqrt(E) (V7). Two slacks and that are at most doubt, for k <= 8, which the host sees to (V8). So
// keys that are apart by more than the greatest doubt are in the order of depths (W4).
//     slack = g delta_depth + 1.42 s delta
//         + u (|z| (13 g + 12 h k) + (|n| + |m|) (10 s + 12 h) + 4 lift + 5.5 k R)
//     doubt = 2 g delta_depth + 2.84 s delta + 0.62 sqrt(E) + u (|z| (30 g + 24 h k) + 20 lift)
//
// Keys of hits are above 0, as depths in the tile are counted from far enough before the first hit:
// `margin` in plan.rs (V9).

// What all tiles of a frame have in common of the bounds.
struct Bounds {
    // E = g (error.x + R (error.y + R (error.z + error.w g)) + weight.x |W|^2 + weight.y g Z^2)
    error: vec4<f32>,
    weight: vec2<f32>,
    // What is in doubt of a depth, but for what hits are late: doubt.x g - doubt.y + doubt.z lift +
    // doubt.w g |z|
    doubt: vec4<f32>,
}

fn bounds_of(frame: Frame) -> Bounds {
    let h = 3.6 * greater(frame.pitch_x, frame.pitch_y);
    return Bounds(
        SURE * vec4<f32>(
            2.2 * frame.delta * frame.delta, 2.9 * frame.delta, U * (8.0 + 48.0 * h), 6.0 * U
        ),
        SURE * U * vec2<f32>(17.4 + h * (6.0 + h * (452.0 + 22.0 * h)), (h * h) * (44.0 + 2.2 * h)),
        SURE * vec4<f32>(4.84 * frame.delta, 2.13 * frame.delta, 20.0 * U, U * (30.0 + 24.0 * h)),
    );
}

// What is the same for all spheres of a tile: asked for once, as a software device would do so
// again for each.
struct Eye {
    x: Split,
    y: Split,
    z: Split,
    offset: vec3<i32>,
    center: vec2<f32>,
    // Width and height of a pixel on the screen.
    pitch: vec2<f32>,
    // As in Frame.
    scale: f32,
    base: i32,
    base_far: f32,
    // |d0|^2
    a: f32,
    // Depth of the tile's middle from the camera.
    apart: f32,
    lift: f32,
    bounds: Bounds,
    // g
    spread: f32,
    // E = spread (bounds.error.x + radius (bounds.error.y + radius steep) + weight.y Z^2) +
    // weight.x |W|^2
    steep: f32,
    weight: vec2<f32>,
    // What is in doubt of every depth, and besides of each |z|.
    doubt: f32,
    doubt_of_depth: f32,
}

struct Item {
    // D + E without terms of odd order in dy: coefficients of 1, dx, dx^2 and dy^2; and the others,
    // of dy and dx dy.
    even: vec4<f32>,
    odd: vec2<f32>,
    // lift + c . d: coefficients of 1, dx, dy
    along: vec3<f32>,
    // slack of the depth, E
    bounds: vec2<f32>,
    // Hits of a greater square are safe: 4 E.
    safe: f32,
    // What is in doubt of the depth, both ends together. Not passed from lane to lane, as what
    // follows: the greatest of a tile's list stands for all.
    doubt: f32,
    // Not more than the depth of any hit.
    front: f32,
}

// Four rays of a column. Depths of keys less `shift`, times `inverse`, are depths, rounded up.
struct Rays {
    a: vec4<f32>,
    shift: vec4<f32>,
    inverse: vec4<f32>,
    lift: f32,
}

// A column of eight pixels: rows 0 to 3, and rows 7 to 4, which mirror them. Offsets from the
// tile's middle and their squares.
struct Pixels {
    dx: f32,
    dx2: f32,
    dy: vec4<f32>,
    dy2: vec4<f32>,
    top: Rays,
    bottom: Rays,
}

// The rays in the sphere. Not more than `square` is D, `root` its square root, on both sides of
// `middle`; a hit's key is that of `near`.
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
    let fan = fan_at(at, lane);
    // As far as a tile's rays run to the sides; the roundings are within the factors.
    let pitch = vec2<f32>(frame.pitch_x, frame.pitch_y);
    let size = 3.6 * pitch;
    let far = abs(vec2<f32>(fan.sx, fan.sy)) + size;
    let along = far.x * size.x + far.y * size.y;
    let a = (1.0 + fan.sx * fan.sx) + fan.sy * fan.sy;
    // |d| is less than |d0| and half a tile together, and this above its square.
    let g = 1.001 * (a + 2.0 * along);
    let apart = f32(frame.base - tile.z) + frame.base_far;
    let lift = 1.01 * abs(apart) * along;
    return Eye(
        split(fan.n),
        split(fan.m),
        split(frame.forward),
        vec3<i32>(tile.x, tile.y, tile.z),
        vec2<f32>(fan.sx, fan.sy),
        pitch,
        frame.scale,
        frame.base,
        frame.base_far,
        a,
        apart,
        lift,
        bounds,
        g,
        bounds.error.z + bounds.error.w * g,
        bounds.weight * g,
        (bounds.doubt.x * g - bounds.doubt.y) + bounds.doubt.z * lift,
        bounds.doubt.w * g,
    );
}

fn rays_of(eye: Eye, dx: f32, dy: vec4<f32>) -> Rays {
    let x = eye.center.x + dx;
    let y = vec4<f32>(eye.center.y) + dy;
    let a = vec4<f32>(1.0 + x * x) + y * y;
    let shift = vec4<f32>(eye.lift) + eye.apart * (vec4<f32>(dx * x) + dy * y);
    return Rays(a, shift, 1.00001 / a, eye.lift);
}

fn pixels_of(eye: Eye, column: u32) -> Pixels {
    let dx = (f32(column) - 3.5) * eye.pitch.x;
    let dy = vec4<f32>(3.5, 2.5, 1.5, 0.5) * eye.pitch.y;
    return Pixels(dx, dx * dx, dy, dy * dy, rays_of(eye, dx, dy), rays_of(eye, dx, -dy));
}

// Depths of depths of keys, rounded up.
fn depths(rays: Rays, found: vec4<f32>) -> vec4<f32> {
    return (found - rays.shift) * rays.inverse;
}

// Where a depth in the tile lies along the rays, as the depth of a key.
fn along_rays(rays: Rays, depth: f32) -> vec4<f32> {
    return rays.shift + depth * rays.a;
}

// Bound on its error (lemma V10 of docs/numerics.md).
fn plane_error(rays: Rays, depth: f32) -> vec4<f32> {
    return SURE * U * (16.0 * abs(depth) * rays.a + vec4<f32>(14.0 * rays.lift));
}

// A sphere's place: n, m of the tile's middle, depth in the tile, depth from the camera.
fn place_of(eye: Eye, center: vec3<i32>) -> vec4<f32> {
    let parts = split(center);
    let along = rotate(eye.z, parts);
    return vec4<f32>(
        f32(rotate(eye.x, parts) + eye.offset.x),
        f32(rotate(eye.y, parts) + eye.offset.y),
        f32(along + eye.offset.z),
        f32(along + eye.base) + eye.base_far,
    );
}

fn prepare(eye: Eye, record: vec4<i32>) -> Item {
    let place = place_of(eye, record.xyz);
    let n = place.x;
    let m = place.y;
    let z = place.z;
    let depth = place.w;
    let any_radius = bitcast<f32>(record.w) * eye.scale;
    let huge = any_radius > GREATEST_RADIUS;
    let radius = select(any_radius, 0.0, huge);
    let sx = eye.center.x;
    let sy = eye.center.y;
    let x = depth * sx - n;
    let y = depth * sy + m;
    let w = n * sy + m * sx;
    let away = (m * m + n * n) + w * w;
    let steep = depth * depth + y * y;
    let square = radius * radius;
    // |W|^2 is known last, and the rest of E before it: software devices wait for the square as
    // little as they can.
    let bounds = eye.bounds;
    let early = eye.spread * (
        (bounds.error.x + eye.weight.y * (depth * depth)) +
        radius * (bounds.error.y + radius * eye.steep)
    );
    let late = eye.weight.x * away;
    let error = early + late;
    let root = above_root(error);
    let doubt = eye.doubt + (SURE * 0.62 * root + eye.doubt_of_depth * abs(z));
    let slack = 0.5 * (eye.doubt + eye.doubt_of_depth * abs(z))
        + SURE * U * eye.spread * (22.0 * (abs(n) + abs(m)) + 5.5 * radius);
    let even = vec4<f32>(
        (square * eye.a + early) - (away - late),
        2.0 * (square * sx - (n * depth + w * y)),
        square - steep,
        square - (depth * depth + x * x),
    );
    let odd = 2.0 * vec2<f32>(square * sy + (m * depth + w * x), x * y);
    let along = vec3<f32>(eye.lift + (z * eye.a + (m * sy - n * sx)), z * sx - n, z * sy + m);
    // Of what is huge nothing is known but that there may be a hit, at every pixel.
    return Item(
        select(even, vec4<f32>(1.0, 0.0, 0.0, 0.0), huge),
        select(odd, vec2<f32>(0.0), huge),
        select(along, vec3<f32>(2.0, 0.0, 0.0), huge),
        vec2<f32>(select(slack, 1e30, huge), error),
        4.0 * error,
        doubt,
        select(z - radius, -1e30, huge),
    );
}

fn chord(square: vec4<f32>, middle: vec4<f32>) -> Chord {
    // Of a negative number it is some number or none: a miss, whose key is one by the square's
    // sign.
    let root = sqrt(square);
    return Chord(square, root, middle, middle - root);
}

fn chords(item: Item, pixels: Pixels) -> Chords {
    let even =
        vec4<f32>(item.even.x + (item.even.y * pixels.dx + item.even.z * pixels.dx2)) +
        item.even.w * pixels.dy2;
    let odd = (item.odd.x + item.odd.y * pixels.dx) * pixels.dy;
    let middle = vec4<f32>(item.along.x + item.along.y * pixels.dx);
    let tilt = item.along.z * pixels.dy;
    return Chords(chord(even + odd, middle + tilt), chord(even - odd, middle - tilt));
}

// An item that no ray hits.
fn beyond(item: Item) -> Item {
    let even = vec4<f32>(-1e30, 0.0, 0.0, 0.0);
    let odd = vec2<f32>(0.0);
    return Item(even, odd, item.along, item.bounds, item.safe, item.doubt, item.front);
}
