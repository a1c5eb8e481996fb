//! The judge itself, against cases worked out by hand and against whole-number arithmetic on small
//! lattices.

mod judge;

use glam::DVec3;
use judge::Judge;
use planisphere_core::{
    camera::{Camera, ImageSize, Projection, Region, ScreenSize, View},
    scene::{Scene, Sphere},
};

fn ball(x: f64, y: f64, z: f64, radius: f64) -> Sphere {
    Sphere { center: DVec3::new(x, y, z), radius, color: [0; 3] }
}

fn scene(spheres: &[Sphere]) -> Scene {
    Scene::from_spheres(spheres).expect("a valid scene")
}

/// Looks along +x with z up, so that right is -y; samples are `1` apart.
fn camera(projection: Projection, side: u32) -> View {
    view(projection, DVec3::X, side)
}

fn view(projection: Projection, direction: DVec3, side: u32) -> View {
    let mut camera = Camera::orthographic(DVec3::ZERO, direction);
    camera.projection = projection;
    camera.size = ScreenSize::Both { width: side.into(), height: side.into() };
    View::new(camera, ImageSize { width: side, height: side })
}

/// The id in the middle of a picture of one pixel.
fn middle(spheres: &[Sphere], view: View) -> i32 {
    Judge::new(&scene(spheres), &view).id(0, 0)
}

const FLAT: Projection = Projection::Orthographic;
const POINT: Projection = Projection::Perspective;

#[test]
fn columns_run_right_and_rows_run_down() {
    // Samples at -1, 0, 1; a small sphere up (z = 1) and to the right (y = -1).
    for projection in [FLAT, POINT] {
        let judge = Judge::new(&scene(&[ball(1.0, -1.0, 1.0, 0.25)]), &camera(projection, 3));
        assert_eq!(
            judge.ids(Region { x: 0, y: 0, width: 3, height: 3 }),
            [-1, -1, 0, -1, -1, -1, -1, -1, -1]
        );
    }
}

#[test]
fn a_tangent_ray_hits() {
    // The sample (3, 4) of an 11 x 11 picture, 5 away from the centre.
    for scale in [1.0, 2f64.powi(100), 2f64.powi(-100), 2f64.powi(-500)] {
        let mut view = camera(FLAT, 11);
        view.camera.size = ScreenSize::Both { width: 11.0 * scale, height: 11.0 * scale };
        let view = View::new(view.camera, view.image);
        let r = 5.0 * scale;
        for (radius, id) in [(r.next_down(), -1), (r, 0), (r.next_up(), 0)] {
            let judge = Judge::new(&scene(&[ball(9.0 * scale, 0.0, 0.0, radius)]), &view);
            assert_eq!(judge.id(8, 1), id, "radius {radius:e}");
        }
    }
}

#[test]
fn a_tangent_ray_hits_when_the_axes_are_irrational() {
    // d = (1, -0.5, 0) has length sqrt 1.25. (-0.5, -1, 0) is to its right, as long.
    // Twice that and 2 up is 3 away from the axis: 4 * 1.25 + 4 = 9.
    let direction = DVec3::new(1.0, -0.5, 0.0);
    let center = 8.0 * direction + 2.0 * DVec3::new(-0.5, -1.0, 0.0) + 2.0 * DVec3::Z;
    for projection in [FLAT, POINT] {
        for (radius, id) in [(3f64.next_down(), -1), (3.0, 0), (3f64.next_up(), 0)] {
            let sphere = ball(center.x, center.y, center.z, radius);
            assert_eq!(middle(&[sphere], view(projection, direction, 1)), id, "radius {radius:e}");
        }
    }
    // Vectors of whole length, and view directions perpendicular to them with sqrt A and sqrt B
    // both irrational.
    let irrational = |n: i32| n.isqrt().pow(2) != n;
    let mut found = 0;
    for apart in [[1, 2, 2], [2, 3, 6], [4, -4, 7], [0, 3, 4]] {
        for (x, y) in (0..81).map(|k| (k / 9 - 4, k % 9 - 4)) {
            let rest: i32 = -(x * apart[0] + y * apart[1]);
            if rest % apart[2] != 0 {
                continue;
            }
            let z = rest / apart[2];
            let (a, b) = (x * x + y * y + z * z, x * x + y * y);
            if !(irrational(a) && irrational(b) && irrational(a * b)) {
                continue;
            }
            found += 1;
            let d = DVec3::new(x.into(), y.into(), z.into());
            let center = 400.0 * d + DVec3::from_array(apart.map(f64::from));
            let r = f64::from(apart.iter().map(|x| x * x).sum::<i32>().isqrt());
            for projection in [FLAT, POINT] {
                for (radius, id) in [(r.next_down(), -1), (r, 0), (r.next_up(), 0)] {
                    let sphere = ball(center.x, center.y, center.z, radius);
                    assert_eq!(
                        middle(&[sphere], view(projection, d, 1)),
                        id,
                        "{d}, {apart:?}, radius {radius:e}"
                    );
                }
            }
        }
    }
    assert!(found > 10, "{found} tangents");
}

#[test]
fn a_tangent_ray_of_the_perspective_camera_hits() {
    // Ray (1, 0, 1) in (right, up, forward); (2, 1, -2) is perpendicular to it and 3 long. In the
    // world: (z, -x, y).
    let center = [2.0 + 10.0, 1.0, -2.0 + 10.0];
    let sphere = |radius| ball(center[2], -center[0], center[1], radius);
    for (radius, id) in [(3f64.next_down(), -1), (3.0, 0), (3f64.next_up(), 0)] {
        assert_eq!(Judge::new(&scene(&[sphere(radius)]), &camera(POINT, 3)).id(2, 1), id);
    }
    // It is touched at depth 10, where either plane may be.
    for (near, far, id) in
        [(10.0, 20.0, 0), (10f64.next_up(), 20.0, -1), (1.0, 10.0, 0), (1.0, 10f64.next_down(), -1)]
    {
        let mut view = camera(POINT, 3);
        (view.camera.near, view.camera.far) = (near, far);
        assert_eq!(
            Judge::new(&scene(&[sphere(3.0)]), &view).id(2, 1),
            id,
            "near {near:e} far {far:e}"
        );
    }
}

#[test]
fn from_inside_the_far_wall_is_seen() {
    for projection in [FLAT, POINT] {
        for center in [0.0, 0.5, -0.5, 1.0, -1.0] {
            // At -1 the camera is on the surface, at the far end of the sphere: the far crossing is
            // at 0, the near plane.
            assert_eq!(
                middle(&[ball(center, 0.0, 0.0, 1.0)], camera(projection, 1)),
                0,
                "{center}"
            );
        }
        assert_eq!(middle(&[ball((-1f64).next_down(), 0.0, 0.0, 1.0)], camera(projection, 1)), -1);
        // The inner wall at 1 is behind a small sphere, and before a far one.
        let room = ball(0.0, 0.0, 0.0, 1.0);
        assert_eq!(middle(&[room, ball(0.5, 0.0, 0.0, 0.25)], camera(projection, 1)), 1);
        assert_eq!(middle(&[ball(5.0, 0.0, 0.0, 0.25), room], camera(projection, 1)), 1);
    }
}

#[test]
fn both_planes_are_included() {
    // Crossings at 2 and 6.
    let sphere = ball(4.0, 0.0, 0.0, 2.0);
    for (near, far, id) in [
        (2.0, 9.0, 0),
        (2f64.next_up(), 9.0, 0),
        (2f64.next_up(), 6.0, 0),
        (2f64.next_up(), 6f64.next_down(), -1),
        (6.0, 9.0, 0),
        (6f64.next_up(), 9.0, -1),
        (0.0, 2.0, 0),
        (0.0, 2f64.next_down(), -1),
        (0.0, f64::INFINITY, 0),
    ] {
        for projection in [FLAT, POINT] {
            let mut view = camera(projection, 1);
            (view.camera.near, view.camera.far) = (near, far);
            assert_eq!(middle(&[sphere], view), id, "near {near:e} far {far:e}");
        }
    }
}

#[test]
fn a_cut_open_sphere_shows_its_inner_wall() {
    // The near plane 3 cuts the first sphere (crossings 2 and 6): its wall is at 6, behind the
    // second (crossings 4 and 5).
    let mut view = camera(FLAT, 1);
    view.camera.near = 3.0;
    assert_eq!(middle(&[ball(4.0, 0.0, 0.0, 2.0), ball(4.5, 0.0, 0.0, 0.5)], view), 1);
    // With 6 for both, the lower index.
    let walls = [ball(4.0, 0.0, 0.0, 2.0), ball(7.0, 0.0, 0.0, 1.0)];
    assert_eq!(middle(&walls, view), 0);
    assert_eq!(middle(&[walls[1], walls[0]], view), 0);
    assert_eq!(middle(&[walls[0], ball(7f64.next_down(), 0.0, 0.0, 1.0)], view), 1);
}

#[test]
fn equal_depths_go_to_the_lower_index() {
    for projection in [FLAT, POINT] {
        for direction in [
            DVec3::X,
            DVec3::new(1.0, -0.5, 0.0),
            DVec3::new(1.0, 2.0, 3.0),
            DVec3::new(0.1, 0.7, -0.3),
        ] {
            let view = view(projection, direction, 1);
            // Mirrored in the plane of the view direction and z, and in the one across: the same
            // depth at the middle.
            let across = direction.cross(DVec3::Z);
            let ahead = 16.0 * direction;
            for offset in [across * 0.25, DVec3::ZERO] {
                let spheres = [ahead + offset, ahead - offset].map(|c| ball(c.x, c.y, c.z, 1.0));
                // The coordinates are not rounded for the first three directions.
                if direction.x == 1.0 || offset == DVec3::ZERO {
                    assert_eq!(middle(&spheres, view), 0, "{direction}");
                    assert_eq!(middle(&[spheres[1], spheres[0]], view), 0, "{direction}");
                    let nearer = Sphere { radius: 1f64.next_up(), ..spheres[1] };
                    assert_eq!(middle(&[spheres[0], nearer], view), 1, "{direction}");
                }
            }
        }
    }
}

#[test]
fn different_spheres_tie_on_irrational_axes() {
    // On the axis of d = (1, 2, 2), of length 3, surfaces at 6 - 1 and 9 - 4: a rational tie.
    let d = DVec3::new(1.0, 2.0, 2.0);
    let at = |k: f64, radius: f64| ball(k * d.x, k * d.y, k * d.z, radius);
    for projection in [FLAT, POINT] {
        assert_eq!(middle(&[at(2.0, 1.0), at(3.0, 4.0)], view(projection, d, 1)), 0);
        assert_eq!(middle(&[at(3.0, 4.0), at(2.0, 1.0)], view(projection, d, 1)), 0);
        assert_eq!(middle(&[at(3.0, 4.0), at(2.0, 1f64.next_up())], view(projection, d, 1)), 1);
    }
    // d = (1, 1, 0), across = (1, -1, 0): centres 8 d and 8 d + across + ... whose chords differ by
    // the same irrational step. Depth of k d + j across + h z with radius r at the middle: k sqrt 2
    // - sqrt (r^2 - 2 j^2 - h^2). k = 10, chord sqrt 8 = 2 sqrt 2 and k = 9, chord sqrt 2: both 8
    // sqrt 2.
    let d = DVec3::new(1.0, 1.0, 0.0);
    let place = |k: f64, j: f64, h: f64, radius: f64| ball(k + j, k - j, h, radius);
    let far = place(10.0, 0.0, 1.0, 3.0); // 9 - 1 = 8
    let close = place(9.0, 1.0, 0.0, 2.0); // 4 - 2 = 2
    for projection in [FLAT, POINT] {
        assert_eq!(middle(&[far, close], view(projection, d, 1)), 0);
        assert_eq!(middle(&[close, far], view(projection, d, 1)), 0);
        let mut nearer = far;
        nearer.radius = 3f64.next_up();
        assert_eq!(middle(&[close, nearer], view(projection, d, 1)), 1);
    }
}

#[test]
fn extreme_numbers_are_numbers() {
    let tiny = f64::from_bits(1);
    // Subnormal distances.
    for projection in [FLAT, POINT] {
        assert_eq!(middle(&[ball(1.0, 0.0, 0.0, tiny)], camera(projection, 1)), 0);
        assert_eq!(middle(&[ball(1.0, tiny, 0.0, tiny)], camera(projection, 1)), 0);
        assert_eq!(middle(&[ball(1.0, 2.0 * tiny, 0.0, tiny)], camera(projection, 1)), -1);
        // The second is nearer by the least number there is.
        assert_eq!(
            middle(
                &[ball(2.0 * tiny, 0.0, 0.0, tiny), ball(tiny, 0.0, 0.0, tiny)],
                camera(projection, 1)
            ),
            1
        );
        // The largest number: far wall and near wall.
        assert_eq!(middle(&[ball(f64::MAX, 0.0, 0.0, f64::MAX)], camera(projection, 1)), 0);
        assert_eq!(
            middle(
                &[ball(f64::MAX, 0.0, 0.0, 1.0), ball(0.0, 0.0, 0.0, 1.0)],
                camera(projection, 1)
            ),
            1
        );
        let planets = [
            ball(2f64.powi(120), 0.0, 0.0, 2f64.powi(120)),
            ball(2f64.powi(-120), 0.0, 0.0, 2f64.powi(-120)),
        ];
        assert_eq!(middle(&planets, camera(projection, 1)), 0);
        assert_eq!(middle(&[planets[1], planets[0]], camera(projection, 1)), 0);
    }
}

#[test]
fn one_side_of_the_screen_gives_the_other() {
    // 7 x 3 pixels, width 7 and height left out: samples 1 apart.
    let mut camera = Camera::orthographic(DVec3::ZERO, DVec3::X);
    let image = ImageSize { width: 7, height: 3 };
    for size in [
        ScreenSize::Width(7.0),
        ScreenSize::Height(3.0),
        ScreenSize::Both { width: 7.0, height: 3.0 },
    ] {
        camera.size = size;
        let judge = Judge::new(
            &scene(&[ball(4.0, -3.0, 1.0, 0.25), ball(4.0, 2.0, -1.0, 0.25)]),
            &View::new(camera, image),
        );
        assert_eq!(judge.ids(Region::whole(image)).iter().position(|&id| id == 0), Some(6));
        assert_eq!(judge.ids(Region::whole(image)).iter().position(|&id| id == 1), Some(15));
    }
}

/// The sign of `b + sqrt p - sqrt q` in whole numbers, by squaring: the school's way, for the
/// lattices below.
fn sign_of_roots(b: i128, p: i128, q: i128) -> i128 {
    // sqrt p - sqrt q against -b.
    let inner = (p - q).signum();
    if b.signum() * inner >= 0 {
        return if b == 0 { inner } else { b.signum() };
    }
    // |b| against |sqrt p - sqrt q|: b^2 against p + q - 2 sqrt(p q), so 2 sqrt(p q) against
    // p + q - b^2.
    let rest = p + q - b * b;
    let larger_b = if rest <= 0 {
        if rest == 0 && p * q == 0 { 0 } else { 1 }
    } else {
        (4 * p * q - rest * rest).signum()
    };
    larger_b * b.signum()
}

/// What is seen of whole-number spheres `[right, up, forward, radius]` along a whole-number ray.
fn whole_id(
    spheres: &[[i128; 4]],
    start: [i128; 2],
    direction: [i128; 3],
    near: i128,
    far: i128,
) -> i32 {
    let square: i128 = direction.iter().map(|x| x * x).sum();
    let mut best: Option<(i32, i128, i128, i128)> = None;
    for (index, &[x, y, z, r]) in spheres.iter().enumerate() {
        let m = [x - start[0], y - start[1], z];
        let b: i128 = (0..3).map(|k| m[k] * direction[k]).sum();
        let q = b * b - square * (m.iter().map(|x| x * x).sum::<i128>() - r * r);
        if q < 0 {
            continue;
        }
        // The root of side -1 or 1 against a plane: b - plane + side sqrt q.
        let against = |side: i128, plane: i128| {
            let d = b - plane * square;
            if side > 0 { sign_of_roots(d, q, 0) } else { sign_of_roots(d, 0, q) }
        };
        let side = if against(-1, near) >= 0 { -1 } else { 1 };
        if against(side, near) < 0 || against(side, far) > 0 {
            continue;
        }
        let nearer = match best {
            None => true,
            Some((_, other_b, other_q, other_side)) => {
                // b + side sqrt q - other_b - other_side sqrt other_q.
                let d = b - other_b;
                match (side, other_side) {
                    (1, 1) => sign_of_roots(d, q, other_q) < 0,
                    (-1, -1) => sign_of_roots(d, other_q, q) < 0,
                    // A sum of roots S: d + S < 0, or d - S < 0.
                    (1, _) => {
                        d < 0
                            && d * d > q + other_q
                            && (d * d - q - other_q).pow(2) > 4 * q * other_q
                    }
                    _ => {
                        d < 0
                            || d * d < q + other_q
                            || (d * d - q - other_q).pow(2) < 4 * q * other_q
                    }
                }
            }
        };
        if nearer {
            best = Some((index as i32, b, q, side));
        }
    }
    best.map_or(-1, |found| found.0)
}

/// A random number below `n`.
fn below(state: &mut u64, n: u64) -> i128 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mut z = *state;
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    i128::from((z ^ (z >> 31)) % n)
}

#[test]
fn lattices_agree_with_whole_numbers() {
    const SIDE: u32 = 7;
    // Axes that are whole numbers over their common length: (right, up, forward), with `up` given
    // as a hint to the camera.
    let frames = [
        ([0, -1, 0], [0, 0, 1], [1, 0, 0], 1),
        ([4, -3, 0], [0, 0, 5], [3, 4, 0], 5),
        ([-2, 2, -1], [1, 2, 2], [-2, -1, 2], 3),
    ];
    let (mut zeros, mut signs) = (0, 0);
    for seed in 0..600u64 {
        let mut state = seed;
        let perspective = seed % 2 == 1;
        let (right, up, forward, length) = frames[(seed / 2 % 3) as usize];
        let spheres: Vec<[i128; 4]> = (0..12)
            .map(|_| {
                let near_end = if seed % 5 == 0 { 0 } else { 6 };
                [
                    below(&mut state, 9) - 4,
                    below(&mut state, 9) - 4,
                    below(&mut state, 12) + near_end - 3,
                    below(&mut state, 5) + 1,
                ]
            })
            .collect();
        let near = below(&mut state, 4);
        let far = if seed % 3 == 0 { 1 << 20 } else { near + 1 + below(&mut state, 12) };
        let world: Vec<Sphere> = spheres
            .iter()
            .map(|&[x, y, z, r]| {
                let c = [0, 1, 2].map(|k| (x * right[k] + y * up[k] + z * forward[k]) as f64);
                ball(c[0] + 5.0, c[1] - 7.0, c[2] + 11.0, (r * length) as f64)
            })
            .collect();
        let vector = |v: [i128; 3]| DVec3::from_array(v.map(|x| x as f64));
        let side = if perspective { f64::from(SIDE) } else { f64::from(SIDE) * length as f64 };
        let camera = Camera {
            projection: if perspective { POINT } else { FLAT },
            origin: DVec3::new(5.0, -7.0, 11.0),
            view: vector(forward) * 3.0,
            // Any up between the two will do.
            up: vector(up) + vector(forward),
            size: ScreenSize::Both { width: side, height: side },
            near: (near * length) as f64,
            far: (far * length) as f64,
        };
        let image = ImageSize { width: SIDE, height: SIDE };
        let judge = Judge::new(&scene(&world), &View::new(camera, image));
        for row in 0..SIDE {
            for column in 0..SIDE {
                let s = [
                    i128::from(column) - i128::from(SIDE / 2),
                    i128::from(SIDE / 2) - i128::from(row),
                ];
                let (start, direction) =
                    if perspective { ([0, 0], [s[0], s[1], 1]) } else { (s, [0, 0, 1]) };
                let want = whole_id(&spheres, start, direction, near, far);
                assert_eq!(
                    judge.id(column, row),
                    want,
                    "seed {seed}, pixel ({column}, {row}), spheres {spheres:?}"
                );
            }
        }
        zeros += judge.effort.zeros.load(std::sync::atomic::Ordering::Relaxed);
        signs += judge.effort.signs.load(std::sync::atomic::Ordering::Relaxed);
    }
    assert!(zeros > 1000, "only {zeros} ties and tangents of {signs} signs: too easy");
}
