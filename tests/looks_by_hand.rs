//! The judge's looks, against cases worked out by hand and against whole-number arithmetic on
//! small lattices.

mod judge;

use glam::DVec3;
use judge::looks::{By, Outline, Shade, Wanted, picture};
use planisphere_core::{
    camera::{Camera, ImageSize, Projection, Region, ScreenSize, View},
    scene::{Scene, Sphere},
};

const FLAT: Projection = Projection::Orthographic;
const POINT: Projection = Projection::Perspective;
const WHITE: [u8; 3] = [255; 3];
const RED: [u8; 3] = [255, 0, 0];

fn ball(x: f64, y: f64, z: f64, radius: f64) -> Sphere {
    Sphere { center: DVec3::new(x, y, z), radius, color: WHITE }
}

/// Looks along +x with z up, so that right is -y; pixels are `pitch` apart.
fn camera(projection: Projection, side: u32, pitch: f64) -> View {
    let mut camera = Camera::orthographic(DVec3::ZERO, DVec3::X);
    camera.projection = projection;
    let length = f64::from(side) * pitch;
    camera.size = ScreenSize::Both { width: length, height: length };
    View::new(camera, ImageSize { width: side, height: side })
}

/// White spheres as they are, before black.
fn flat(aa: u32) -> Wanted {
    Wanted {
        aa,
        encoded: false,
        shade: Shade::Flat,
        cue: None,
        outline: None,
        background: [0; 3],
        transparent: false,
    }
}

/// The whole picture.
fn draw(spheres: &[Sphere], view: &View, wanted: &Wanted) -> Vec<[u8; 4]> {
    let scene = Scene::from_spheres(spheres).expect("a valid scene");
    picture(&scene, view, Region::whole(view.image), wanted)
}

/// The picture of one pixel.
fn middle(spheres: &[Sphere], view: &View, wanted: &Wanted) -> [u8; 4] {
    let mut view = *view;
    view.camera.size = match view.camera.size {
        ScreenSize::Both { width, height } => ScreenSize::Both {
            width: width / f64::from(view.image.width),
            height: height / f64::from(view.image.height),
        },
        other => other,
    };
    let view = View::new(view.camera, ImageSize { width: 1, height: 1 });
    draw(spheres, &view, wanted)[0]
}

/// The byte of a linear value between 0 and 65535, by floats: for values that are not near a
/// threshold.
fn byte(linear: f64) -> u8 {
    let y = linear / 65535.0;
    let x = if y <= 0.0031308 { 12.92 * y } else { 1.055 * y.powf(1.0 / 2.4) - 0.055 };
    let exact = 255.0 * x;
    assert!((exact.fract() - 0.5).abs() > 1e-6, "{exact} is too near a threshold");
    exact.round() as u8
}

/// `G` of a headlight level.
fn glow(level: u32) -> u32 {
    (level * level + 127) / 255
}

/// White at a headlight level, without ambient light.
fn lit(level: u32) -> u8 {
    byte(65535.0 * f64::from(255 * glow(level)) / 65025.0)
}

fn matte(aa: u32) -> Wanted {
    Wanted { shade: Shade::Matte { ambient: 0 }, ..flat(aa) }
}

fn gray(value: u8) -> [u8; 4] {
    [value, value, value, 255]
}

#[test]
fn the_headlight_has_levels() {
    // Samples at whole numbers; a sphere of radius 5 in the middle. cos is 1, 4/5, 3/5, 0.
    let view = camera(FLAT, 11, 1.0);
    let got = draw(&[ball(9.0, 0.0, 0.0, 5.0)], &view, &matte(1));
    let at = |x: i32, z: i32| got[((5 - z) * 11 + 5 + x) as usize];
    assert_eq!(at(0, 0), gray(255), "1 is level 255");
    for (x, z) in [(3, 0), (-3, 0), (0, 3), (0, -3)] {
        assert_eq!(at(x, z), gray(lit(204)), "4/5 of 256 is 204.8");
    }
    for (x, z) in [(4, 0), (0, -4)] {
        assert_eq!(at(x, z), gray(lit(153)), "3/5 of 256 is 153.6");
    }
    for (x, z) in [(5, 0), (3, 4), (-4, 3)] {
        assert_eq!(at(x, z), gray(0), "a tangent is level 0, and a hit");
    }
    assert_eq!(at(5, 1), gray(0));
    // Ambient light: 255 A + (255 - A) G.
    let wanted = Wanted { shade: Shade::Matte { ambient: 100 }, ..flat(1) };
    let got = draw(&[ball(9.0, 0.0, 0.0, 5.0)], &view, &wanted);
    let want = byte(65535.0 * f64::from(255 * 100 + 155 * glow(153)) / 65025.0);
    assert_eq!(got[5 * 11 + 9], gray(want));
    assert_eq!(got[5 * 11 + 10], gray(byte(65535.0 * 100.0 / 255.0)), "a tangent");
    // From inside, the normal is turned: the same levels.
    let got = draw(&[ball(-1.0, 0.0, 0.0, 5.0)], &view, &matte(1));
    assert_eq!(got[5 * 11 + 9], gray(lit(153)));
}

#[test]
fn a_headlight_level_is_reached_exactly() {
    // (1, 0, 1) in (right, up, forward) is perpendicular to (1, 1, -1), of length sqrt 3: with a
    // radius of 2, cos is 1/2, level 128. In the world: (z, -x, y).
    let mut view = camera(POINT, 3, 1.0);
    let center = [10.0 + 1.0, 1.0, 10.0 - 1.0];
    for (radius, level) in [(2f64.next_down(), 127), (2.0, 128), (2f64.next_up(), 128)] {
        let got = draw(&[ball(center[2], -center[0], center[1], radius)], &view, &matte(1));
        assert_eq!(got[3 + 2], gray(lit(level)), "radius {radius:e}");
    }
    // d = (1, 1, 0); (1, -1, 0) is to its right, sqrt 2 long. 1 of that and 1 up is sqrt 3 away.
    view.camera.view = DVec3::new(1.0, 1.0, 0.0);
    for projection in [FLAT, POINT] {
        view.camera.projection = projection;
        for (radius, level) in [(2f64.next_down(), 127), (2.0, 128), (2f64.next_up(), 128)] {
            let got = middle(&[ball(11.0, 9.0, 1.0, radius)], &view, &matte(1));
            assert_eq!(got, gray(lit(level)), "{projection:?}, radius {radius:e}");
        }
    }
}

#[test]
fn a_sphere_is_shaded_once_in_a_pixel() {
    // Two by two samples at +-1/2: the same distance, so the first row, then column, decides; that
    // is at -1/2, 1/2, 1/sqrt 2 from the middle, with cos sqrt (1/2) for a radius of 1.
    let view = camera(FLAT, 1, 2.0);
    assert_eq!(middle(&[ball(9.0, 0.0, 0.0, 1.0)], &view, &matte(2)), gray(lit(181)));
    // The same sphere moved by 1/2 up and left is met in its middle there, and at 1/2 down and
    // right not at all: three of four samples have level 255.
    let moved = ball(9.0, 0.5, 0.5, 1.0);
    assert_eq!(middle(&[moved], &view, &matte(2)), gray(byte(65535.0 * 0.75)));
    // Moved down and right, the first sample misses it. The next, up and right, is 1 away: a
    // tangent, of level 0.
    let moved = ball(9.0, -0.5, -0.5, 1.0);
    assert_eq!(middle(&[moved], &view, &matte(2)), gray(0));
    // Of upper right and lower left, at 0.75 and more than 1, the first row's: its cos is 0.7806.
    let moved = ball(9.0, -0.5, -0.25, 1.2);
    let upper = 0.75 * 257.0 * f64::from(glow(199));
    assert_eq!(middle(&[moved], &view, &matte(2)), gray(byte(upper)));
    let (upper_right, lower_left) = (ball(9.0, -0.5, 0.5, 0.5), ball(9.0, 0.5, -0.5, 0.5));
    let got = middle(&[upper_right, lower_left], &view, &matte(2));
    assert_eq!(got, gray(byte(65535.0 * 0.5)), "each sphere for itself");
    // Three by three: the middle one, whatever the others show.
    let view = camera(FLAT, 1, 3.0);
    let got = middle(&[ball(9.0, 0.0, 0.0, 1.25)], &view, &matte(3));
    assert_eq!(got, gray(byte(65535.0 * 5.0 / 9.0)), "five samples of level 255");
    // Not met in the middle: above it comes first, 1 from (0, 2) and so cos 3/5 for 5/4.
    let got = middle(&[ball(9.0, 0.0, 2.0, 1.25)], &view, &matte(3));
    let one = 65535.0 * f64::from(255 * glow(153)) / 65025.0;
    assert_eq!(got, gray(byte(one.round() / 9.0)));
}

#[test]
fn a_cue_plane_at_a_hit() {
    // The hit is at 4; N = 0 and F = 256 give level 4 from there on.
    let cue = |n: f64, f: f64| Wanted { cue: Some([n, f]), background: [10, 20, 30], ..flat(1) };
    let at = |depth: f64| ball(depth + 1.0, 0.0, 0.0, 1.0);
    // Y = (65535 (256 - D) + LIN[bg] D + 128) div 256, with LIN of 10, 20 and 30 from a table.
    let want = |level: u32| {
        let channel =
            |linear: u32| byte(f64::from((65535 * (256 - level) + linear * level + 128) / 256));
        [channel(199), channel(458), channel(847), 255]
    };
    for projection in [FLAT, POINT] {
        let view = camera(projection, 1, 1.0);
        let level = |sphere, n, f| middle(&[sphere], &view, &cue(n, f));
        assert_eq!(level(at(64.0), 0.0, 256.0), want(64));
        // One unit in the last place farther down: the plane is just behind the hit.
        assert_eq!(level(at(64.0), 0.0, 256f64.next_up()), want(63));
        assert_eq!(level(at(64.0), 0.0, 256f64.next_down()), want(64));
        assert_eq!(level(at(64.0), 64.0, 65.0), want(0));
        assert_eq!(level(at(64.0), 64f64.next_up(), 65.0), want(0));
        assert_eq!(level(at(64.0), 3.0, 64.0), [10, 20, 30, 255]);
        assert_eq!(level(at(64.0), 3.0, 64f64.next_up()), want(255));
        assert_eq!(level(at(64.0), 3.0, 5.0), [10, 20, 30, 255]);
        // N + (F - N) 128 / 256 = 64, and a hair more.
        assert_eq!(level(at(64.0), 32.0, 96.0), want(128));
        assert_eq!(level(at(64.0), 32f64.next_up(), 96.0), want(127));
    }
}

/// A red line of this width.
fn line(width: f64, jump: Option<f64>, by: By) -> Option<Outline> {
    Some(Outline { width, jump, by, color: RED })
}

/// Which pixels are red, as words of `#` and `.`, row by row.
fn red(picture: &[[u8; 4]], width: usize) -> Vec<String> {
    let mark = |pixel: &[u8; 4]| if pixel[..3] == RED { '#' } else { '.' };
    picture.chunks(width).map(|row| row.iter().map(mark).collect()).collect()
}

#[test]
fn a_jump_is_more_than_the_length() {
    // Two spheres side by side, one met left of the middle, the other right of it and 1 farther.
    // Each covers what is around its pixel.
    for (projection, spheres) in [
        // 2 beside the ray, and so met 3/2 before the centre.
        (FLAT, [ball(5.5, 2.5, 0.0, 2.5), ball(6.5, -2.5, 0.0, 2.5)]),
        // In (right, forward): 10 (-1/2, 1) + 4 (-1, -1/2) is (-9, 8), 4 sqrt (5/4) beside the
        // ray. With radius 10 = 4 sqrt 5 sqrt (5/4) it is met 8 before 10. The other has 11.
        (POINT, [ball(8.0, 9.0, 0.0, 10.0), ball(9.0, -9.5, 0.0, 10.0)]),
    ] {
        let mut view = camera(projection, 2, 1.0);
        view.image.height = 1;
        let ScreenSize::Both { width, .. } = view.camera.size else { unreachable!() };
        view.camera.size = ScreenSize::Both { width, height: 1.0 };
        let view = View::new(view.camera, view.image);
        for (jump, want) in [(1.0, ".."), (1f64.next_down(), "#."), (1f64.next_up(), "..")] {
            let wanted = Wanted { outline: line(1.0, Some(jump), By::Jump), ..flat(1) };
            let got = draw(&spheres, &view, &wanted);
            assert_eq!(red(&got, 2), [want], "{projection:?}, jump {jump:e}");
            let back = [spheres[1], spheres[0]];
            assert_eq!(red(&draw(&back, &view, &wanted), 2), [want], "{projection:?}, {jump:e}");
        }
    }
}

#[test]
fn a_jump_of_the_nearer_radius() {
    let mut view = camera(FLAT, 2, 1.0);
    view.image.height = 1;
    view.camera.size = ScreenSize::Both { width: 2.0, height: 1.0 };
    let view = View::new(view.camera, view.image);
    let wanted = Wanted { outline: line(1.0, None, By::Jump), ..flat(1) };
    // Radius 5/2, 2 beside the ray and so met 3/2 before its centre, at 10; and radius 13/2, 6
    // beside it and met 5/2 before its centre. The nearer's radius is the jump.
    let near = ball(11.5, 2.5, 0.0, 2.5);
    let far = |depth: f64| ball(depth + 2.5, -6.5, 0.0, 6.5);
    assert_eq!(red(&draw(&[near, far(12.5)], &view, &wanted), 2), [".."]);
    assert_eq!(red(&draw(&[near, far(12.5 + 1e-9)], &view, &wanted), 2), ["#."]);
    assert_eq!(red(&draw(&[near, far(3.5)], &view, &wanted), 2), [".."]);
    assert_eq!(red(&draw(&[near, far(3.5 - 1e-9)], &view, &wanted), 2), [".#"]);
    // Columns and all spheres, without a jump; equal distances are the lower index's.
    let groups = |a, b| Wanted { outline: line(1.0, None, By::Groups(vec![a, b])), ..flat(1) };
    assert_eq!(red(&draw(&[near, far(10.0)], &view, &groups(7, 7)), 2), [".."]);
    assert_eq!(red(&draw(&[near, far(10.0)], &view, &groups(7, -7)), 2), ["#."]);
    assert_eq!(red(&draw(&[far(10.0), near], &view, &groups(7, -7)), 2), [".#"]);
    let every = Wanted { outline: line(1.0, None, By::Sphere), ..flat(1) };
    assert_eq!(red(&draw(&[far(10.0), near], &view, &every), 2), [".#"]);
    let wall = ball(9.0, 0.0, 0.0, 5.0);
    assert_eq!(red(&draw(&[wall, wall], &view, &every), 2), [".."], "the same sphere twice");
}

#[test]
fn a_line_lies_on_the_nearer_side() {
    let view = camera(FLAT, 7, 1.0);
    // Samples within 2 of the middle: a disc of 13.
    let disc = [ball(9.0, 0.0, 0.0, 2.0)];
    let wide = |width| Wanted { outline: line(width, None, By::Jump), ..flat(1) };
    let line = |width| red(&draw(&disc, &view, &wide(width)), 7);
    let one = ["...", "#", "#.#", "#...#", "#.#", "#", "..."];
    let one = one.map(|row| format!("{row:.^7}"));
    assert_eq!(line(1.0), one);
    assert_eq!(line(1f64.next_down()), vec!["......."; 7]);
    // A little more reaches both samples of an edge, and no other: 5 > 1.
    let both = ["#", "###", "##.##", "##...##", "##.##", "###", "#"];
    let both = both.map(|row| format!("{row:.^7}"));
    assert_eq!(line(1f64.next_up()), both);
}

#[test]
fn a_line_comes_from_beyond_the_border() {
    // A wall covers all but what is right of the picture: its border is 1 pixel beyond it, or just
    // at it.
    let view = camera(FLAT, 3, 1.0);
    let wall = |edge: f64| [ball(1e9, 1e6 - edge, 0.0, 1e6)];
    let red_at = |edge: f64, width: f64| {
        let wanted = Wanted { outline: line(width, None, By::Jump), ..flat(1) };
        red(&draw(&wall(edge), &view, &wanted), 3)
    };
    // The last sample is at 1, the next at 2.
    assert_eq!(red_at(1.5, 1.0), ["..#"; 3]);
    assert_eq!(red_at(2.5, 1.0), ["..."; 3]);
    assert_eq!(red_at(2.5, 3.0), ["..#"; 3]);
    assert_eq!(red_at(2.5, 3f64.next_down()), ["..."; 3]);
    assert_eq!(red_at(-2.5, 1.0), ["..."; 3]);
    // From the other side of the border the far sample of an edge is as near only with a wider one.
    assert_eq!(red_at(-1.5, 1.0), ["..."; 3]);
    assert_eq!(red_at(-1.5, 1f64.next_up()), ["#.."; 3]);
    // A region is that part of the picture.
    let scene = Scene::from_spheres(&wall(2.5)).expect("a valid scene");
    let wanted = Wanted { outline: line(3.0, None, By::Jump), ..flat(2) };
    let whole = picture(&scene, &view, Region::whole(view.image), &wanted);
    let part = picture(&scene, &view, Region { x: 1, y: 1, width: 2, height: 1 }, &wanted);
    assert_eq!(part, whole[4..6]);
}

#[test]
fn coverage_is_counted() {
    // Samples at +-1/2; small spheres at k of them.
    let view = camera(FLAT, 1, 2.0);
    let corners = [(0.5, 0.5), (-0.5, 0.5), (0.5, -0.5), (-0.5, -0.5)];
    let wanted = Wanted { transparent: true, background: [9, 8, 7], ..flat(2) };
    for (k, alpha) in [(1, 64), (2, 128), (3, 191), (4, 255)] {
        let spheres: Vec<_> = corners[..k].iter().map(|&(y, z)| ball(5.0, y, z, 0.25)).collect();
        assert_eq!(middle(&spheres, &view, &wanted), [255, 255, 255, alpha]);
        let opaque = Wanted { background: [0; 3], ..flat(2) };
        assert_eq!(
            middle(&spheres, &view, &opaque),
            gray(byte(65535.0 * k as f64 / 4.0)),
            "{k} of 4 in light"
        );
        let encoded = Wanted { encoded: true, ..opaque };
        // floor((2 255 k + 4) / 8).
        assert_eq!(middle(&spheres, &view, &encoded), gray([64, 128, 191, 255][k - 1]));
    }
    let nothing = [ball(5.0, 0.0, 0.0, 0.25)];
    assert_eq!(middle(&nothing, &view, &wanted), [9, 8, 7, 0]);
    assert_eq!(
        middle(&nothing, &view, &Wanted { background: [9, 8, 7], ..flat(2) }),
        [9, 8, 7, 255]
    );
    // A line is covered: around one covered sample it reaches the two beside it.
    let one = [ball(5.0, 0.5, 0.5, 0.25)];
    let wanted = Wanted { outline: line(0.75, None, By::Jump), ..wanted };
    assert_eq!(middle(&one, &view, &wanted), [255, 0, 0, 191]);
    // The mean of the covered samples: red and white, in light and in bytes.
    let colored = [Sphere { color: RED, ..one[0] }, ball(5.0, -0.5, 0.5, 0.25)];
    let wanted = Wanted { outline: None, ..wanted };
    assert_eq!(middle(&colored, &view, &wanted), [255, 188, 188, 128]);
    let wanted = Wanted { encoded: true, ..wanted };
    assert_eq!(middle(&colored, &view, &wanted), [255, 128, 128, 128]);
}

#[test]
fn soft_colours_follow_openness() {
    let view = camera(FLAT, 1, 1.0);
    for (strength, open) in [(0, 17), (255, 255), (255, 0), (200, 100)] {
        let shade = Shade::Soft { strength, openness: vec![open] };
        let factor = 65025 - strength * (255 - u32::from(open));
        assert_eq!(
            middle(&[ball(5.0, 0.0, 0.0, 1.0)], &view, &Wanted { shade, ..flat(1) }),
            gray(byte(65535.0 * f64::from(factor) / 65025.0))
        );
    }
}

#[test]
fn every_colour_survives() {
    let view = camera(FLAT, 1, 1.0);
    for c in 0..=255 {
        let color = [c, 255 - c, c / 2];
        let sphere = Sphere { color, ..ball(5.0, 0.0, 0.0, 9.0) };
        for wanted in [flat(1), flat(4), flat(16), Wanted { encoded: true, ..flat(2) }] {
            assert_eq!(middle(&[sphere], &view, &wanted)[..3], color);
        }
    }
}

// ---- Whole numbers ----

/// A random number below `n`.
fn below(state: &mut u64, n: u64) -> i128 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mut z = *state;
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    i128::from((z ^ (z >> 31)) % n)
}

fn dot(a: [i128; 3], b: [i128; 3]) -> i128 {
    (0..3).map(|k| a[k] * b[k]).sum()
}

/// A line of whole numbers and a whole-number sphere: `(b +- sqrt q) / square` are the distances.
struct Line {
    b: i128,
    q: i128,
    square: i128,
    radius: i128,
}

impl Line {
    /// Along `direction` from `start`, for a sphere `[right, up, forward, radius]`.
    fn new(start: [i128; 2], direction: [i128; 3], [x, y, z, radius]: [i128; 4]) -> Self {
        let m = [x - start[0], y - start[1], z];
        let (b, square) = (dot(m, direction), dot(direction, direction));
        Self { b, q: b * b - square * (dot(m, m) - radius * radius), square, radius }
    }

    /// Whether it is hit, all of it before the camera.
    fn hits(&self) -> bool {
        self.q >= 0 && self.b > 0 && self.b * self.b >= self.q
    }

    /// `floor(256 cos)`, and whether it is exact: cos^2 = q / (square radius^2).
    fn light(&self) -> (i128, bool) {
        let whole = self.square * self.radius * self.radius;
        let level = (65536 * self.q / whole).isqrt();
        (level.min(255), level > 0 && level < 256 && level * level * whole == 65536 * self.q)
    }

    /// The greatest `D` with `256 t >= (256 - D) near + D far`, up to 256, and whether it is exact.
    fn cue(&self, near: i128, far: i128) -> (i128, bool) {
        // 256 b - square (...) against 256 sqrt q.
        let order = |level: i128| {
            let rest = 256 * self.b - self.square * ((256 - level) * near + level * far);
            if rest < 0 { -1 } else { (rest * rest - 65536 * self.q).signum() }
        };
        let level = (0..=256).rev().find(|&level| order(level) >= 0).unwrap_or(0);
        (level, order(level) == 0)
    }

    /// The sign of the near distance of `other` less that of this one, less a jump.
    fn gap(&self, other: &Self, jump: i128) -> i128 {
        let b = self.square * other.b - other.square * self.b - jump * self.square * other.square;
        let p = other.square * other.square * self.q;
        let q = self.square * self.square * other.q;
        // b + sqrt p - sqrt q, by squaring twice.
        let inner = (p - q).signum();
        if b.signum() * inner >= 0 {
            return if b == 0 { inner } else { b.signum() };
        }
        let rest = p + q - b * b;
        let larger = if rest < 0 { 1 } else { (4 * p * q - rest * rest).signum() };
        larger * b.signum()
    }
}

/// Axes that are whole numbers over their common length: right, up, forward.
const FRAMES: [([[i128; 3]; 3], i128); 3] = [
    ([[0, -1, 0], [0, 0, 1], [1, 0, 0]], 1),
    ([[4, -3, 0], [0, 0, 5], [3, 4, 0]], 5),
    ([[-2, 2, -1], [1, 2, 2], [-2, -1, 2]], 3),
];

#[test]
fn lattices_agree_with_whole_numbers() {
    const SIDE: u32 = 5;
    let (mut shown, mut exact_cues, mut exact_gaps) = (0, 0, 0);
    for seed in 0..1500u64 {
        let mut state = seed;
        let projection = if seed % 2 == 1 { POINT } else { FLAT };
        let ([right, up, forward], length) = FRAMES[(seed / 2 % 3) as usize];
        let mut sphere = || {
            let [x, y, r] = [9, 9, 9].map(|n| below(&mut state, n));
            [x - 4, y - 4, 12 + below(&mut state, 8), r + 1]
        };
        let (one, mut two) = (sphere(), sphere());
        let jump = below(&mut state, 4) - 1;
        if seed % 5 == 0 {
            // What column 1 shows of it is what column 0 shows of the other, and a jump farther.
            two = [1 - one[0], one[1], one[2] + if jump < 0 { one[3] } else { jump }, one[3]];
        }
        let near = below(&mut state, 8);
        let far = near + 1 + below(&mut state, 16);
        let world = |[x, y, z, r]: [i128; 4]| {
            let c = [0, 1, 2].map(|k| (x * right[k] + y * up[k] + z * forward[k]) as f64);
            ball(c[0] + 5.0, c[1] - 7.0, c[2] + 11.0, (r * length) as f64)
        };
        let vector = |v: [i128; 3]| DVec3::from_array(v.map(|x| x as f64));
        let mut view = camera(projection, SIDE, 1.0);
        let side = f64::from(SIDE) * if projection == FLAT { length as f64 } else { 1.0 };
        view.camera.origin = DVec3::new(5.0, -7.0, 11.0);
        (view.camera.view, view.camera.up) = (vector(forward), vector(up));
        view.camera.size = ScreenSize::Both { width: side, height: side };
        let view = View::new(view.camera, view.image);
        let line = |column: u32, row: u32, sphere| {
            let s = [i128::from(column) - 2, 2 - i128::from(row)];
            match projection {
                FLAT => Line::new(s, [0, 0, 1], sphere),
                POINT => Line::new([0, 0], [s[0], s[1], 1], sphere),
            }
        };
        let length = length as f64;
        let cue = [near as f64 * length, far as f64 * length];
        let lights = draw(&[world(one)], &view, &matte(1));
        let fade = Wanted { cue: Some(cue), ..flat(1) };
        let fades = draw(&[world(one)], &view, &fade);
        for (row, column) in (0..SIDE * SIDE).map(|k| (k / SIDE, k % SIDE)) {
            let line = line(column, row, one);
            if line.q >= 0 && !line.hits() {
                // The camera is inside.
                continue;
            }
            let k = (row * SIDE + column) as usize;
            if line.q < 0 {
                assert_eq!((lights[k], fades[k]), (gray(0), gray(0)), "seed {seed}, pixel {k}");
                continue;
            }
            let (light, _) = line.light();
            let (level, exact_cue) = line.cue(near, far);
            shown += 1;
            exact_cues += usize::from(exact_cue);
            let faded = byte(f64::from((65535 * (256 - level as u32) + 128) / 256));
            assert_eq!(lights[k], gray(lit(light as u32)), "seed {seed}, pixel {k}");
            assert_eq!(fades[k], gray(faded), "seed {seed}, pixel {k}");
        }
        // Two spheres, where one is alone at one sample and the other at the next.
        let outline = line_of(jump, length);
        let lines = draw(&[world(one), world(two)], &view, &Wanted { outline, ..flat(1) });
        let seen = |column, row| {
            let lines = [line(column, row, one), line(column, row, two)];
            lines.iter().all(|line| line.q < 0 || line.hits()).then_some(())?;
            match (lines[0].hits(), lines[1].hits()) {
                (true, true) => Some(if lines[0].gap(&lines[1], 0) >= 0 { 0 } else { 1 }),
                (true, false) => Some(0),
                (false, true) => Some(1),
                (false, false) => None,
            }
        };
        for (row, column) in (1..SIDE - 1).flat_map(|r| (1..SIDE - 1).map(move |c| (r, c))) {
            let Some(here) = seen(column, row) else { continue };
            let at = line(column, row, [one, two][here]);
            let neighbours =
                [(column - 1, row), (column + 1, row), (column, row - 1), (column, row + 1)];
            let Some(edges) = neighbours
                .map(|(c, r)| {
                    let there = seen(c, r)?;
                    let other = line(c, r, [one, two][there]);
                    let order = at.gap(&other, 0);
                    let nearer = order > 0 || order == 0 && here < there;
                    let limit = if jump < 0 { at.radius } else { jump };
                    let sign = at.gap(&other, limit);
                    exact_gaps += usize::from(here != there && sign == 0 && nearer);
                    Some(here != there && nearer && sign > 0)
                })
                .into_iter()
                .collect::<Option<Vec<_>>>()
            else {
                continue;
            };
            let k = (row * SIDE + column) as usize;
            let want = edges.contains(&true);
            assert_eq!(lines[k][..3] == RED, want, "seed {seed}, column {column}, row {row}");
        }
    }
    println!("{shown} hits; exact: {exact_cues} cues, {exact_gaps} jumps");
    assert!(exact_cues > 100 && exact_gaps > 100, "too easy");
}

/// A line for a jump of so many lengths; below 0 for that of the radius.
fn line_of(jump: i128, length: f64) -> Option<Outline> {
    let jump = (jump >= 0).then_some(jump as f64 * length);
    line(1.0, jump, By::Jump)
}

#[test]
fn levels_that_are_reached_exactly_agree_with_whole_numbers() {
    let view = camera(POINT, 5, 1.0);
    let mut found = 0;
    for (column, row) in (0..25).map(|k| (k % 5, k / 5)) {
        let direction = [i128::from(column) - 2, 2 - i128::from(row), 1];
        for k in 0..9 * 9 * 8 {
            let (x, y, r) = (k % 9 - 4, k / 9 % 9 - 4, k / 81 + 1);
            let line = Line::new([0, 0], direction, [x, y, 9, r]);
            if line.q < 0 || !line.hits() {
                continue;
            }
            let (level, exact) = line.light();
            if !exact {
                continue;
            }
            found += 1;
            for (radius, level) in [(r as f64, level), ((r as f64).next_down(), level - 1)] {
                let sphere = ball(9.0, -x as f64, y as f64, radius);
                let scene = Scene::from_spheres(&[sphere]).expect("a valid scene");
                let pixel = Region { x: column, y: row, width: 1, height: 1 };
                let got = picture(&scene, &view, pixel, &matte(1));
                let what = format!("{direction:?}, [{x}, {y}, 9, {radius}]");
                assert_eq!(got[0], gray(lit(level as u32)), "{what}");
            }
        }
    }
    assert!(found > 10, "{found} levels");
}
