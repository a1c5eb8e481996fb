//! How a camera moves: pure arithmetic from a view and a gesture to a new camera, in f64.
//!
//! Places in the window are in pixels from its top left corner, so that pixel (i, j) has its sample
//! at (i + 1/2, j + 1/2). Depths are distances along the view direction, as the contract's `t`. A
//! gesture is always applied to the camera that it began with, so that nothing adds up: moving the
//! mouse back brings back the camera. What comes out may not be a camera where numbers run out of
//! range; [`Camera::check`] tells.

use std::f64::consts::PI;

use glam::{DQuat, DVec2, DVec3};

use planisphere_core::{
    axes::{Axes, Axis},
    camera::{Camera, ImageSize, Projection, ScreenSize, View},
    fov::height_from_fov,
    scene::Bounds,
};

/// Turning stops this far from looking straight along `up`, in radians.
const POLE: f64 = PI / 180.0;

/// The vertical field of view that a camera gets when it becomes perspective, in degrees.
const FOV: f64 = 40.0;

/// A camera's axes, rounded to f64.
struct Frame {
    right: DVec3,
    up: DVec3,
    forward: DVec3,
}

impl Frame {
    fn of(camera: &Camera) -> Self {
        let axes = Axes::new(camera.view, camera.up);
        let [right, up, forward] = [axes.right, axes.up, axes.forward].map(Axis::nearest);
        Self { right, up, forward }
    }

    /// A vector of the screen in the world.
    fn in_world(&self, on_screen: DVec2) -> DVec3 {
        on_screen.x * self.right + on_screen.y * self.up
    }
}

/// Screen coordinates (contract: `sx`, `sy`) of a vector of pixels.
fn on_screen(view: &View, pixels: DVec2) -> DVec2 {
    DVec2::new(pixels.x * view.pitch_x.to_f64(), -pixels.y * view.pitch_y.to_f64())
}

/// The middle of the window.
fn middle(image: ImageSize) -> DVec2 {
    0.5 * DVec2::new(image.width.into(), image.height.into())
}

/// Depth of a point.
pub fn depth(camera: &Camera, point: DVec3) -> f64 {
    (point - camera.origin).dot(Frame::of(camera).forward)
}

/// The point in the world at a depth below a place in the window.
pub fn point(view: &View, cursor: DVec2, depth: f64) -> DVec3 {
    let frame = Frame::of(&view.camera);
    let lateral = frame.in_world(on_screen(view, cursor - middle(view.image)));
    let lateral = match view.camera.projection {
        Projection::Orthographic => lateral,
        Projection::Perspective => depth * lateral,
    };
    view.camera.origin + lateral + depth * frame.forward
}

/// The place in the window where a point is seen. In perspective it must be in front of the camera.
pub fn place(view: &View, point: DVec3) -> DVec2 {
    let frame = Frame::of(&view.camera);
    let offset = point - view.camera.origin;
    let depth = match view.camera.projection {
        Projection::Orthographic => 1.0,
        Projection::Perspective => offset.dot(frame.forward),
    };
    let (x, y) = (offset.dot(frame.right) / depth, offset.dot(frame.up) / depth);
    middle(view.image) + DVec2::new(x / view.pitch_x.to_f64(), -y / view.pitch_y.to_f64())
}

/// Turns the camera about a point, as if the scene stood on a turntable whose axis is the camera's
/// `up`: what is in front of the point follows the mouse, half a turn for the window's shorter
/// side. The point stays where it is on the screen and as far away as it is; `up` and the clip
/// planes stay what they are.
///
/// An orthographic camera without clip planes that has all of `bounds` in front of it keeps it so,
/// by stepping back along its rays, which changes nothing else.
pub fn orbit(view: &View, pivot: DVec3, pixels: DVec2, bounds: Bounds) -> Camera {
    let camera = view.camera;
    if pixels == DVec2::ZERO {
        return camera;
    }
    let frame = Frame::of(&camera);
    let angles = pixels * (PI / f64::from(view.image.width.min(view.image.height)));
    let axis = (camera.up / camera.up.abs().max_element()).normalize();
    // The scene turns by these angles about `up` and `right`, the camera by their opposites.
    let from_up = frame.up.dot(axis).atan2(frame.forward.dot(axis));
    let least = POLE.min(from_up).min(PI - from_up);
    let tilt = angles.y.clamp(least - from_up, PI - least - from_up);
    let turn = DQuat::from_axis_angle(axis, -angles.x) * DQuat::from_axis_angle(frame.right, -tilt);
    let mut turned = Camera {
        origin: pivot + turn * (camera.origin - pivot),
        view: turn * frame.forward,
        ..camera
    };
    let unclipped = camera.near == 0.0 && camera.far == f64::INFINITY;
    if camera.projection == Projection::Orthographic
        && unclipped
        && clearance(&camera, bounds) >= 0.0
    {
        let missing = (-clearance(&turned, bounds)).max(0.0);
        turned.origin -= missing * turned.view;
    }
    turned
}

/// How far in front of the camera everything in `bounds` is; negative if something may be behind
/// it.
fn clearance(camera: &Camera, bounds: Bounds) -> f64 {
    let forward = Frame::of(camera).forward;
    let center = 0.5 * bounds.min_center + 0.5 * bounds.max_center;
    let half = 0.5 * bounds.max_center - 0.5 * bounds.min_center;
    (center - camera.origin).dot(forward) - half.dot(forward.abs()) - bounds.max_radius
}

/// Moves the camera across its view direction, so that a point at a depth follows the mouse.
pub fn pan(view: &View, depth: f64, pixels: DVec2) -> Camera {
    let camera = view.camera;
    if pixels == DVec2::ZERO {
        return camera;
    }
    let lateral = Frame::of(&camera).in_world(on_screen(view, pixels));
    let scale = match camera.projection {
        Projection::Orthographic => 1.0,
        Projection::Perspective => depth,
    };
    Camera { origin: camera.origin - scale * lateral, ..camera }
}

/// Zooms towards what is under the cursor at a depth, which stays there. `factor` is what becomes
/// of the size of the screen (orthographic) or of the distance to the point (perspective): below 1
/// zooms in.
pub fn zoom(view: &View, cursor: DVec2, depth: f64, factor: f64) -> Camera {
    let camera = view.camera;
    let target = point(view, cursor, depth);
    match camera.projection {
        Projection::Orthographic => {
            let lateral = Frame::of(&camera).in_world(on_screen(view, cursor - middle(view.image)));
            let origin = camera.origin + (1.0 - factor) * lateral;
            Camera { origin, size: times(camera.size, factor), ..camera }
        }
        Projection::Perspective => {
            Camera { origin: camera.origin + (1.0 - factor) * (target - camera.origin), ..camera }
        }
    }
}

fn times(size: ScreenSize, factor: f64) -> ScreenSize {
    match size {
        ScreenSize::Width(width) => ScreenSize::Width(factor * width),
        ScreenSize::Height(height) => ScreenSize::Height(factor * height),
        ScreenSize::Both { width, height } => {
            ScreenSize::Both { width: factor * width, height: factor * height }
        }
    }
}

/// The other projection, with everything at a depth staying where it is on the screen.
///
/// Orthographic to perspective, the camera steps to where its field of view shows that much, and
/// clip planes that are set stay where they are in the world, as far as they are in front of it.
/// Perspective to orthographic, the camera stays.
pub fn switch(view: &View, depth: f64) -> Camera {
    let camera = view.camera;
    match camera.projection {
        Projection::Orthographic => {
            let height = view.pitch_y.to_f64() * f64::from(view.image.height);
            let tall = height_from_fov(FOV).expect("the usual angle is one");
            let distance = height / tall;
            let back = distance - depth;
            let near = if camera.near > 0.0 { (camera.near + back).max(0.0) } else { 0.0 };
            let origin = camera.origin - back * Frame::of(&camera).forward;
            // Exactly the height of that field of view, where the screen's shape follows from the
            // window's.
            let size = match camera.size {
                ScreenSize::Height(_) => ScreenSize::Height(tall),
                ScreenSize::Width(_) => ScreenSize::Width(
                    tall * (f64::from(view.image.width) / f64::from(view.image.height)),
                ),
                both @ ScreenSize::Both { .. } => times(both, 1.0 / distance),
            };
            Camera {
                projection: Projection::Perspective,
                origin,
                size,
                near,
                far: camera.far + back,
                ..camera
            }
        }
        Projection::Perspective => Camera {
            projection: Projection::Orthographic,
            size: times(camera.size, depth),
            ..camera
        },
    }
}

/// The camera for a window of another size: one that gives the screen's width or height keeps it,
/// and one that gives both keeps the height and the shape of the pixels.
pub fn resized(camera: &Camera, from: ImageSize, to: ImageSize) -> Camera {
    let ScreenSize::Both { width, height } = camera.size else { return *camera };
    if from == to {
        return *camera;
    }
    let aspect = |image: ImageSize| f64::from(image.width) / f64::from(image.height);
    let squeeze = width / height / aspect(from);
    let size = if (squeeze - 1.0).abs() < 1e-9 {
        ScreenSize::Height(height)
    } else {
        ScreenSize::Both { width: width * (aspect(to) / aspect(from)), height }
    };
    Camera { size, ..*camera }
}

#[cfg(test)]
mod tests {
    use super::*;

    const IMAGE: ImageSize = ImageSize { width: 640, height: 480 };

    fn bounds() -> Bounds {
        Bounds {
            min_center: DVec3::new(-3.0, -1.0, -2.0),
            max_center: DVec3::new(4.0, 5.0, 1.0),
            min_radius: 0.5,
            max_radius: 2.0,
        }
    }

    /// Both projections, oblique and along an axis, near the origin of the world and a million
    /// away, every kind of size.
    fn views() -> Vec<View> {
        let mut views = Vec::new();
        let sizes = [
            ScreenSize::Width(3.0),
            ScreenSize::Height(0.7),
            ScreenSize::Both { width: 4.0, height: 5.0 },
        ];
        for projection in [Projection::Orthographic, Projection::Perspective] {
            for (direction, up) in [
                (DVec3::X, DVec3::Z),
                (DVec3::new(1.0, -2.0, 3.0), DVec3::new(0.1, 0.2, 3.0)),
                (DVec3::new(-1e200, 3e199, 1e199), DVec3::new(0.0, -1e-200, 1e-201)),
            ] {
                for origin in [DVec3::new(-20.0, 1.0, 2.0), DVec3::splat(1e6)] {
                    for size in sizes {
                        let camera = Camera {
                            projection,
                            origin,
                            view: direction,
                            up,
                            size,
                            near: 1.0,
                            far: 1e3,
                        };
                        camera.check().unwrap();
                        views.push(View::new(camera, IMAGE));
                    }
                }
            }
        }
        views
    }

    /// Within a hundredth of a pixel.
    fn same_place(a: DVec2, b: DVec2) {
        assert!((a - b).length() < 1e-2, "{a} {b}");
    }

    #[test]
    fn points_and_places_agree_with_rays() {
        for view in views() {
            for (column, row) in [(0, 0), (639, 0), (17, 333)] {
                let cursor = DVec2::new(f64::from(column) + 0.5, f64::from(row) + 0.5);
                let found = point(&view, cursor, 7.0);
                let ray = view.ray(column, row);
                assert!(
                    (found - (ray.origin + 7.0 * ray.direction)).length() < 1e-9 * found.length()
                );
                same_place(place(&view, found), cursor);
                assert!((depth(&view.camera, found) - 7.0).abs() < 1e-8);
            }
        }
    }

    #[test]
    fn turning_keeps_the_pivot_where_it_is() {
        for view in views() {
            for cursor in [DVec2::new(320.0, 240.0), DVec2::new(20.5, 400.0)] {
                for pixels in
                    [DVec2::new(1.0, 0.0), DVec2::new(-300.0, 20.0), DVec2::new(90.0, -1000.0)]
                {
                    let pivot = point(&view, cursor, 7.0);
                    let camera = orbit(&view, pivot, pixels, bounds());
                    camera.check().unwrap();
                    let turned = View::new(camera, IMAGE);
                    same_place(place(&turned, pivot), cursor);
                    assert!((depth(&camera, pivot) - 7.0).abs() < 1e-8);
                    assert_eq!((camera.up, camera.near, camera.far), (view.camera.up, 1.0, 1e3));
                    assert_eq!(camera.size, view.camera.size);
                }
            }
            assert_eq!(orbit(&view, DVec3::ONE, DVec2::ZERO, bounds()), view.camera);
        }
    }

    #[test]
    fn what_is_in_front_follows_the_mouse() {
        for view in views() {
            let center = DVec2::new(320.0, 240.0);
            let (pivot, front) = (point(&view, center, 7.0), point(&view, center, 6.5));
            for pixels in [DVec2::new(30.0, 0.0), DVec2::new(0.0, 20.0), DVec2::new(-10.0, -30.0)] {
                let turned = View::new(orbit(&view, pivot, pixels, bounds()), IMAGE);
                let moved = place(&turned, front) - center;
                assert!(moved.dot(pixels) > 0.0, "{moved} for {pixels}");
            }
        }
    }

    #[test]
    fn turning_stops_at_the_poles() {
        for view in views() {
            let pivot = point(&view, DVec2::ZERO, 7.0);
            for rows in [1e4, -1e4] {
                let camera = orbit(&view, pivot, DVec2::new(33.0, rows), bounds());
                let angle = (camera.up / camera.up.abs().max_element()).angle_between(camera.view);
                let want = if rows > 0.0 { PI - POLE } else { POLE };
                assert!((angle - want).abs() < 1e-6, "{angle} {want}");
            }
        }
        // A camera that is nearer to a pole stays as near.
        let camera = Camera::orthographic(DVec3::ZERO, DVec3::new(1e-3, 0.0, -1.0));
        let turned = orbit(&View::new(camera, IMAGE), DVec3::ZERO, DVec2::new(0.0, 50.0), bounds());
        assert!((turned.view.x - 1e-3).abs() < 1e-8, "{}", turned.view);
    }

    #[test]
    fn an_orthographic_camera_outside_stays_outside() {
        let outside = Camera::orthographic(DVec3::new(-6.0, 2.0, 0.0), DVec3::X);
        assert!(clearance(&outside, bounds()) >= 0.0);
        let pivot = DVec3::new(0.5, 2.0, -0.5);
        for pixels in [DVec2::new(240.0, 0.0), DVec2::new(120.0, 100.0)] {
            let view = View::new(outside, IMAGE);
            let camera = orbit(&view, pivot, pixels, bounds());
            assert!(clearance(&camera, bounds()) >= -1e-9);
            same_place(place(&View::new(camera, IMAGE), pivot), place(&view, pivot));
            // Inside, or with planes set, nothing but the turn happens.
            for near in [0.0, 1.0] {
                let inside = View::new(
                    Camera { origin: DVec3::new(-1.0 - near, 2.0, 0.0), near, ..outside },
                    IMAGE,
                );
                let turned = orbit(&inside, pivot, pixels, bounds());
                assert!((depth(&turned, pivot) - depth(&inside.camera, pivot)).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn panning_keeps_the_grabbed_point_under_the_mouse() {
        for view in views() {
            let (from, by) = (DVec2::new(100.0, 50.0), DVec2::new(33.0, -71.5));
            let grabbed = point(&view, from, 7.0);
            let camera = pan(&view, 7.0, by);
            same_place(place(&View::new(camera, IMAGE), grabbed), from + by);
            assert_eq!(Camera { origin: view.camera.origin, ..camera }, view.camera);
        }
    }

    #[test]
    fn zooming_keeps_the_point_under_the_cursor() {
        for view in views() {
            let cursor = DVec2::new(500.0, 77.0);
            let target = point(&view, cursor, 7.0);
            for factor in [0.5, 0.9, 2.0] {
                let camera = zoom(&view, cursor, 7.0, factor);
                let zoomed = View::new(camera, IMAGE);
                same_place(place(&zoomed, target), cursor);
                // Two points one pixel apart are 1 / factor pixels apart.
                let beside = point(&view, cursor + DVec2::X, 7.0);
                assert!(((place(&zoomed, beside) - cursor).x * factor - 1.0).abs() < 1e-3);
                assert_eq!((camera.near, camera.far), (1.0, 1e3));
                // And back.
                let depth = depth(&camera, target);
                let back = View::new(zoom(&zoomed, cursor, depth, 1.0 / factor), IMAGE);
                same_place(place(&back, beside), cursor + DVec2::X);
            }
        }
    }

    #[test]
    fn switching_keeps_sizes_at_the_depth() {
        for view in views() {
            let at = 7.0;
            let camera = switch(&view, at);
            camera.check().unwrap();
            assert_ne!(camera.projection, view.camera.projection);
            let switched = View::new(camera, IMAGE);
            for cursor in [DVec2::new(0.0, 0.0), DVec2::new(400.0, 13.0)] {
                same_place(place(&switched, point(&view, cursor, at)), cursor);
            }
            // What the planes cut is what they cut before, at the far side at least.
            let far = point(&view, DVec2::new(320.0, 240.0), view.camera.far);
            assert!((depth(&camera, far) - camera.far).abs() < 1e-6);
            let back =
                switch(&switched, depth(&camera, point(&view, DVec2::new(320.0, 240.0), at)));
            same_place(
                place(&View::new(back, IMAGE), point(&view, DVec2::new(9.0, 9.0), at)),
                DVec2::new(9.0, 9.0),
            );
        }
        let plain = Camera::orthographic(DVec3::ZERO, DVec3::X);
        let camera = switch(&View::new(plain, IMAGE), 5.0);
        assert_eq!((camera.near, camera.far), (0.0, f64::INFINITY));
    }

    #[test]
    fn another_window_shows_the_same_shapes() {
        let to = ImageSize { width: 1000, height: 300 };
        for view in views() {
            let camera = resized(&view.camera, IMAGE, to);
            let (before, after) = (view, View::new(camera, to));
            let shape = |view: &View| view.pitch_x.to_f64() / view.pitch_y.to_f64();
            assert!((shape(&before) / shape(&after) - 1.0).abs() < 1e-9);
            assert_eq!(resized(&view.camera, IMAGE, IMAGE), view.camera);
        }
        let square =
            Camera { size: ScreenSize::Both { width: 8.0, height: 6.0 }, ..views()[0].camera };
        assert_eq!(resized(&square, IMAGE, to).size, ScreenSize::Height(6.0));
        let both = ScreenSize::Both { width: 8.0, height: 8.0 };
        let ScreenSize::Both { width, height } =
            resized(&Camera { size: both, ..square }, IMAGE, to).size
        else {
            panic!("both stay")
        };
        assert!(
            (height, (width - 8.0 * 2.5).abs()) < (8.0 + f64::MIN_POSITIVE, 1e-9),
            "{width} {height}"
        );
    }
}
