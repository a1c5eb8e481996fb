// The loop that anybody writes first, as a baseline for `bench`: one pixel per invocation, every
// sphere in turn, plain f32. It stands alone: none of the device's own parts is used, and its
// picture is wrong where rounding matters.

struct Frame {
    // Where the ray of column 0, row 0 begins (parallel rays), or the eye; and its direction.
    origin: vec3<f32>,
    count: u32,
    direction: vec3<f32>,
    perspective: u32,
    // One column to the right, one row down, on the screen.
    right: vec3<f32>,
    width: u32,
    down: vec3<f32>,
    height: u32,
    near: f32,
    far: f32,
}

@group(0) @binding(0) var<uniform> frame: Frame;
// Centre and radius.
@group(0) @binding(1) var<storage, read> spheres: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read_write> ids: array<i32>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) at: vec3<u32>) {
    if at.x >= frame.width || at.y >= frame.height {
        return;
    }
    let aside = f32(at.x) * frame.right + f32(at.y) * frame.down;
    let fan = frame.perspective != 0u;
    let origin = select(frame.origin + aside, frame.origin, fan);
    let direction = select(frame.direction, frame.direction + aside, fan);
    let a = dot(direction, direction);
    var best = frame.far;
    var id = -1;
    for (var k = 0u; k < frame.count; k++) {
        let sphere = spheres[k];
        let to_center = sphere.xyz - origin;
        let middle = dot(to_center, direction) / a;
        let apart = to_center - middle * direction;
        let square = sphere.w * sphere.w - dot(apart, apart);
        if square >= 0.0 {
            let half = sqrt(square / a);
            let first = middle - half;
            let depth = select(middle + half, first, first >= frame.near);
            if depth >= frame.near && depth < best {
                best = depth;
                id = i32(k);
            }
        }
    }
    ids[at.y * frame.width + at.x] = id;
}
