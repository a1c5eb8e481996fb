//! What `[camera]` leaves out is chosen so that the whole scene is seen, and a picture in which
//! nothing is seen says so, why, and what to do, which is done here word for word.

use std::{fs, path::Path, process::Command};

use glam::DVec3;
use planisphere_core::{
    camera::{Camera, ImageSize, Projection, Region, ScreenSize, View},
    framing::Wanted,
    scene::{Bounds, Scene, Sphere},
};
use planisphere_io::load::from_text;
use planisphere_renderer::{Device, Engine};

fn bounds(spheres: &[Sphere]) -> Bounds {
    Scene::from_spheres(spheres).unwrap().bounds()
}

/// Whether all of a sphere is in the picture: some pixel sees it, and none at the edge does.
fn whole(sphere: &Sphere, camera: Camera, image: ImageSize) -> bool {
    let scene = Scene::from_spheres(&[*sphere]).unwrap();
    let view = View::new(camera, image);
    let ids =
        Engine::open(&Device::Cpu).unwrap().draw(&scene, &view, Region::whole(image)).unwrap().ids;
    let (width, height) = (image.width as usize, image.height as usize);
    let seen = |k: usize| ids[k] >= 0;
    let edge = |k: usize| {
        k < width
            || k >= width * (height - 1)
            || matches!(k % width, column if column == 0 || column == width - 1)
    };
    (0..ids.len()).any(seen) && !(0..ids.len()).any(|k| edge(k) && seen(k))
}

fn ball(center: [f64; 3], radius: f64) -> Sphere {
    Sphere { center: center.into(), radius, color: [255; 3] }
}

const IMAGES: [ImageSize; 2] =
    [ImageSize { width: 60, height: 40 }, ImageSize { width: 40, height: 60 }];

/// All 2^9 sets of keys that go together, from nothing to everything, as text: what is given is
/// kept, and where no size is given all spheres are seen.
#[test]
fn any_keys_make_a_picture() {
    let spheres = [
        ball([3.0, -1.0, 2.0], 1.0),
        ball([-2.0, 4.0, 0.0], 0.5),
        ball([0.0, 0.0, -3.0], 1.5),
        ball([1.0, 2.0, 3.0], 0.75),
    ];
    let scene: String = spheres
        .iter()
        .map(|s| {
            format!("[[sphere]]\ncenter = {:?}\nradius = {:?}\n", s.center.to_array(), s.radius)
        })
        .collect();
    let keys = [
        "projection = 'perspective'",
        "origin = [24.0, -20.0, 9.0]",
        "view = [-24.0, 21.0, -9.0]",
        "look_at = [0.5, 1.0, 0.25]",
        "up = [0.25, 0.5, 2.0]",
        "width = 0.75",
        "height = 0.5",
        "near = 2.5",
        "far = 500.0",
    ];
    let mut drawn = 0;
    for set in 0..1 << keys.len() {
        let given = |key: &str| {
            keys.iter().enumerate().any(|(k, text)| set >> k & 1 == 1 && text.starts_with(key))
        };
        if given("view") && given("look_at") {
            continue;
        }
        let lines: Vec<&str> =
            (0..keys.len()).filter(|k| set >> k & 1 == 1).map(|k| keys[k]).collect();
        let text = format!("[camera]\n{}\n{scene}", lines.join("\n"));
        let loaded = from_text("test", &text, Path::new(""))
            .unwrap_or_else(|error| panic!("{lines:?}: {error}"));
        for image in IMAGES {
            let camera = loaded.camera(image);
            assert_eq!(camera.check(), Ok(()), "{lines:?}");
            // What is given is kept, bit for bit.
            assert_eq!(camera.projection == Projection::Perspective, given("projection"));
            assert!(!given("origin") || camera.origin == DVec3::new(24.0, -20.0, 9.0), "{lines:?}");
            assert!(!given("view") || camera.view == DVec3::new(-24.0, 21.0, -9.0), "{lines:?}");
            assert!(!given("up") || camera.up == DVec3::new(0.25, 0.5, 2.0), "{lines:?}");
            assert_eq!(camera.near, if given("near") { 2.5 } else { 0.0 }, "{lines:?}");
            assert_eq!(camera.far, if given("far") { 500.0 } else { f64::INFINITY }, "{lines:?}");
            let size = match (given("width"), given("height")) {
                (true, true) => Some(ScreenSize::Both { width: 0.75, height: 0.5 }),
                (true, false) => Some(ScreenSize::Width(0.75)),
                (false, true) => Some(ScreenSize::Height(0.5)),
                (false, false) => None,
            };
            assert!(size.is_none_or(|size| camera.size == size), "{lines:?}");
            if given("view") && size.is_some() && !given("projection") && !given("origin") {
                assert_eq!(camera.origin, DVec3::ZERO, "{lines:?}");
            }
            if given("look_at") {
                // The point is straight ahead.
                let (to, view) =
                    (DVec3::new(0.5, 1.0, 0.25) - camera.origin, camera.view.normalize());
                assert!(
                    to.dot(view) > 0.0 && to.cross(view).length() < 1e-12 * to.length(),
                    "{lines:?}"
                );
            }
            // A perspective camera that is left its origin stands as far back as its size needs.
            let seen = size.is_none()
                || (camera.projection == Projection::Perspective && !given("origin"));
            if seen {
                drawn += 1;
                for sphere in &spheres {
                    assert!(whole(sphere, camera, image), "{lines:?}: {sphere:?} by {camera:?}");
                }
            }
            if loaded.fixed_camera.is_some() {
                assert_eq!(loaded.fixed_camera, Some(camera));
            }
        }
    }
    assert!(drawn > 200, "{drawn}");
}

/// Scenes of every size and place, seen by a camera of which one number is given.
#[test]
fn scenes_of_all_sizes_are_framed() {
    let mut scenes = vec![
        vec![ball([0.0; 3], 1.0)],
        vec![ball([0.0; 3], 1e-30)],
        vec![ball([1.0, 2.0, 3.0], 1e-6), ball([1.5, 2.0, 3.0], 0.1)],
        vec![ball([1e300, -1e300, 1e299], 1e299), ball([-1e300, 1e300, 0.0], 2e299)],
        vec![ball([1e17, 1e17, 0.0], 64.0), ball([1e17 + 512.0, 1e17, 0.0], 64.0)],
        vec![ball([1e-200, 0.0, 0.0], 3e-201), ball([-1e-200, 2e-200, 0.0], 3e-201)],
        vec![ball([-100.0, 0.0, 0.0], 20.0), ball([100.0, 5.0, 1.0], 20.0)],
        vec![ball([0.0, 0.0, -100.0], 20.0), ball([0.0, 1.0, 100.0], 20.0)],
    ];
    scenes.push(
        (0..8)
            .map(|k| ball([f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2)], 0.25))
            .collect(),
    );
    for spheres in scenes {
        let bounds = bounds(&spheres);
        let half = 0.5 * bounds.max_center - 0.5 * bounds.min_center;
        let reach = half.max_element() + bounds.max_radius;
        let perspective = Wanted { projection: Projection::Perspective, ..Wanted::default() };
        let given = [
            Wanted::default(),
            perspective,
            Wanted { view: Some(DVec3::X), ..Wanted::default() },
            Wanted { view: Some(DVec3::new(1e-3, 0.5, -1.0)), ..perspective },
            Wanted { look_at: Some(spheres[0].center), ..Wanted::default() },
            Wanted { look_at: Some(spheres[0].center), ..perspective },
            Wanted { up: Some(DVec3::new(1.0, 1.0, 0.75)), ..Wanted::default() },
            Wanted { up: Some(DVec3::Y), ..perspective },
            Wanted { near: 3.0 * bounds.max_radius, ..Wanted::default() },
            Wanted { near: 3.0 * bounds.max_radius, ..perspective },
        ];
        for (number, wanted) in given.into_iter().enumerate() {
            for image in IMAGES {
                let camera = wanted.camera(&bounds, image);
                assert_eq!(camera.check(), Ok(()), "{number} {spheres:?}");
                // A sphere of less than a pixel is inside all the same.
                for sphere in spheres.iter().filter(|sphere| sphere.radius > 0.15 * reach) {
                    let near = whole(sphere, camera, image);
                    assert!(near, "{number}: {sphere:?} by {camera:?}");
                }
            }
        }
    }
}

/// A camera with an origin and nothing else looks at the scene, from wherever that is.
#[test]
fn an_origin_looks_at_the_scene() {
    let spheres = [ball([3.0, -1.0, 2.0], 1.0), ball([-2.0, 4.0, 0.0], 0.5)];
    let bounds = bounds(&spheres);
    for origin in [[50.0, 0.0, 0.0], [0.5, 1.5, 40.0], [0.5, 1.5, -60.0], [-20.0, -20.0, -20.0]] {
        for projection in [Projection::Orthographic, Projection::Perspective] {
            let wanted = Wanted { projection, origin: Some(origin.into()), ..Wanted::default() };
            for image in IMAGES {
                let camera = wanted.camera(&bounds, image);
                assert_eq!((camera.check(), camera.origin), (Ok(()), origin.into()));
                assert!(spheres.iter().all(|sphere| whole(sphere, camera, image)), "{camera:?}");
            }
        }
    }
    // In the middle of the scene there is no direction to take: it is the usual one.
    let wanted = Wanted { origin: Some(DVec3::new(0.5, 1.5, 1.0)), ..Wanted::default() };
    assert_eq!(wanted.camera(&bounds, IMAGES[0]).check(), Ok(()));
}

/// What the default camera has always drawn.
#[test]
fn a_scene_without_a_camera_is_framed_as_ever() {
    let bounds = bounds(&[ball([3.0, -1.0, 2.0], 1.0), ball([-2.0, 4.0, 0.5], 0.5)]);
    for (image, width) in [(IMAGES[0], false), (IMAGES[1], true)] {
        let camera = Camera::framing(bounds, image);
        let half = 0.5 * bounds.max_center - 0.5 * bounds.min_center;
        let reach = half.length() + 1.0;
        let side = 2.0 * reach * 1.05;
        let view = DVec3::new(-1.0, -1.0, -0.75);
        assert_eq!(
            camera.size,
            if width { ScreenSize::Width(side) } else { ScreenSize::Height(side) }
        );
        let center = 0.5 * bounds.min_center + 0.5 * bounds.max_center;
        assert_eq!((camera.view, camera.origin), (view, center - 2.0 * reach * view.normalize()));
    }
}

/// Draws a scene in a folder of its own; gives what was said, and whether anything is seen.
fn draw(scene: &str, args: &[&str]) -> (String, bool) {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    fs::write(here.join("scene.toml"), scene).unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_planisphere"))
        .args(["render", "scene.toml", "-o", "none", "--ids", "ids.npy", "--device", "cpu"])
        .args(args)
        .current_dir(here)
        .output()
        .expect("the program runs");
    let said = String::from_utf8(output.stderr).expect("text");
    assert!(output.status.success() && output.stdout.is_empty(), "{scene}\n{said}");
    let ids = fs::read(here.join("ids.npy")).unwrap();
    let header = 10 + usize::from(u16::from_le_bytes([ids[8], ids[9]]));
    (said, ids[header..].chunks_exact(4).any(|id| id != [255; 4]))
}

const IMAGE: &str = "[image]\nwidth = 64\nheight = 48\n";
/// Two spheres around (5, 0, 0).
const TWO: &str =
    "[[sphere]]\ncenter = [5, 1, 0]\nradius = 0.5\n[[sphere]]\ncenter = [5, -1, 0]\nradius = 0.5\n";

/// Does what a note says, word for word.
fn obey(note: &str, scene: &str, args: &[&str]) -> (String, Vec<String>) {
    let advice = note
        .split_once("nothing is seen: ")
        .and_then(|(_, rest)| rest.split_once("; "))
        .expect("advice")
        .1;
    let mut args: Vec<String> = args.iter().map(|arg| arg.to_string()).collect();
    let mut scene = scene.to_owned();
    let leave_out = |scene: &mut String| {
        let start = scene.find("[camera]").expect("a camera");
        let end = scene[start + 1..].find("\n[").map_or(scene.len(), |at| start + 1 + at + 1);
        scene.replace_range(start..end, "");
    };
    let mut done = false;
    if advice.contains("leave out [camera]") {
        leave_out(&mut scene);
        done = true;
    }
    if let Some((_, keys)) = advice.split_once("a [camera] of ") {
        if scene.contains("[camera]") {
            leave_out(&mut scene);
        }
        let keys = keys.split_once(" alone").expect("alone").0.replace(" and ", "\n");
        scene = format!("[camera]\n{keys}\n{scene}");
        done = true;
    }
    if advice.contains("leave out --region")
        || advice.contains("and --region")
        || advice.contains("without --region")
    {
        let at = args.iter().position(|arg| arg == "--region").expect("a region");
        args.drain(at..at + 2);
        done = true;
    }
    if let Some((_, size)) = advice.split_once("--size ") {
        args.extend(["--size".into(), size.split([',', ' ', '\n']).next().unwrap().into()]);
        done = true;
    }
    assert!(done, "{note}");
    (scene, args)
}

#[test]
fn an_empty_picture_says_why_and_what_to_do() {
    let camera = |keys: &str| format!("[camera]\n{keys}\n{IMAGE}{TWO}");
    let perspective = |keys: &str| camera(&format!("projection = 'perspective'\n{keys}"));
    let tiny = |r: f64| {
        let ball = |y: f64| format!("[[sphere]]\ncenter = [0, {y:?}, 0.11]\nradius = {r:?}\n");
        format!("{IMAGE}{}{}", ball(-50.3), ball(50.0))
    };
    let cases: Vec<(String, &[&str], &str)> = vec![
        (
            camera("origin = [0, 0, 0]\nview = [-1, 0, 0]\nwidth = 6"),
            &[],
            "all 2 spheres lie behind the camera; leave out [camera] to frame them",
        ),
        (
            perspective("origin = [0, 0, 0]\nview = [-1, -1, -0.5]\nfov = 30"),
            &[],
            "all 2 spheres lie behind the camera",
        ),
        (
            perspective("origin = [9, 0, 0]\nview = [1, 0, 0]\nwidth = 2"),
            &[],
            "all 2 spheres lie behind the camera",
        ),
        (
            camera("origin = [0, 0, 0]\nview = [1, 0, 0]\nwidth = 6\nnear = 7.5"),
            &[],
            "all 2 spheres lie before near (7.5)",
        ),
        (
            camera("origin = [0, 0, 0]\nview = [1, 0, 0]\nwidth = 6\nfar = 2"),
            &[],
            "all 2 spheres lie beyond far (2.0)",
        ),
        (
            perspective("origin = [0, 0, 0]\nview = [1, 0, 0]\nfov = 60\nfar = 2"),
            &[],
            "all 2 spheres lie beyond far (2.0)",
        ),
        (
            camera("origin = [0, -9, 0]\nview = [1, 0, 0]\nwidth = 6"),
            &[],
            "all 2 spheres lie left of the picture",
        ),
        (
            camera("origin = [0, 9, 0]\nview = [1, 0, 0]\nwidth = 6"),
            &[],
            "all 2 spheres lie right of the picture",
        ),
        (
            camera("origin = [0, 0, 9]\nview = [1, 0, 0]\nwidth = 6"),
            &[],
            "all 2 spheres lie below the picture",
        ),
        (
            camera("origin = [0, 0, -9]\nview = [1, 0, 0]\nwidth = 6"),
            &[],
            "all 2 spheres lie above the picture",
        ),
        (
            perspective("origin = [0, -9, 0]\nview = [1, 0, 0]\nfov = 20"),
            &[],
            "all 2 spheres lie left of the picture",
        ),
        (
            perspective("origin = [0, 0, 0]\nview = [1, 0, -2]\nfov = 20"),
            &[],
            "all 2 spheres lie above the picture",
        ),
        (
            perspective("origin = [0, 0, 0]\nview = [1, 0, 2]\nfov = 20"),
            &[],
            "all 2 spheres lie below the picture",
        ),
        (
            camera("origin = [0, 0, 0]\nview = [1, 0, 0]\nwidth = 0.9"),
            &[],
            "of 2 spheres, 1 lies left of the picture, 1 right of the picture",
        ),
        (
            camera("origin = [5, 0, 0]\nview = [0, 1, 0]\nwidth = 1\nnear = 2"),
            &[],
            "of 2 spheres, 1 lies behind the camera, 1 before near (2.0)",
        ),
        (
            format!(
                "[camera]\norigin = [0, 0, 0]\nview = [0, 1, 0]\nwidth = 2\n\
                 {IMAGE}{TWO}[[sphere]]\ncenter = [0, -4, 0]\nradius = 1\n"
            ),
            &[],
            "of 3 spheres, 2 lie behind the camera, 1 right of the picture",
        ),
        (
            format!(
                "[camera]\norigin = [0, 0, 0]\nview = [-1, 0, 0]\nwidth = 6\n{IMAGE}[[sphere]]\n\
                 center = [5, 0, 0]\nradius = 1\n"
            ),
            &[],
            "the only sphere lies behind the camera; leave out [camera] to frame it",
        ),
        // A corner: past neither side alone.
        (
            format!(
                "[camera]\norigin = [0, 0, 0]\nview = [1, 0, 0]\nwidth = 2\nheight = 2\n\
                 {IMAGE}[[sphere]]\ncenter = [5, 1.8, 1.8]\nradius = 1\n"
            ),
            &[],
            "the only sphere lies outside of the picture, beyond a corner",
        ),
        // Around everything: no part of its wall is between the planes.
        (
            format!(
                "[camera]\norigin = [0, 0, 0]\nview = [1, 0, 0]\nwidth = 1\nnear = 1\nfar = 2\n\
                 {IMAGE}[[sphere]]\ncenter = [1, 0, 0]\nradius = 50\n"
            ),
            &[],
            "the only sphere lies around all that is between near (1.0) and far (2.0)",
        ),
        // Regions.
        (
            format!("{IMAGE}{TWO}"),
            &["--region", "0,0,4,4"],
            "all 2 spheres lie outside of the region 0,0,4,4; leave out --region to see them",
        ),
        (
            camera("origin = [0, 0, 0]\nview = [1, 0, 0]\nwidth = 6"),
            &["--region", "30,0,4,48"],
            "outside of the region 30,0,4,48",
        ),
        (
            camera("origin = [0, 0, 0]\nview = [-1, 0, 0]\nwidth = 6"),
            &["--region", "0,0,4,4"],
            "leave out [camera] and --region to frame them",
        ),
        (
            perspective("origin = [0, 0, 0]\nview = [1, 0, 0]\nfov = 60"),
            &["--region", "0,0,60,6"],
            "leave out --region",
        ),
        // Small ones.
        (
            tiny(0.4),
            &[],
            "all 2 spheres lie between the rays of the pixels; draw a larger picture: --size \
             256x192",
        ),
        (
            tiny(1e-3),
            &[],
            "sphere 0, the largest, is shown by a [camera] of look_at = [0.0, -50.3, 0.11] and \
             width = 0.004 alone",
        ),
        (tiny(1e-3), &["--region", "1,1,40,40"], "without --region"),
        (
            format!("[camera]\norigin = [200, 0, 0]\nview = [1, 0, 0]\nwidth = 6\n{}", tiny(0.4)),
            &[],
            "to frame them, and add --size",
        ),
        (
            format!("[camera]\norigin = [9, 0, 0]\nview = [1, 0, 0]\nwidth = 6\n{}", tiny(1e-3)),
            &[],
            "all 2 spheres lie behind the camera; sphere 0",
        ),
    ];
    assert!(cases.len() > 25);
    for (scene, args, wanted) in cases {
        let (said, seen) = draw(&scene, args);
        assert!(!seen, "{wanted}: something is seen\n{scene}");
        assert!(
            said.starts_with("note: nothing is seen: ") && said.contains(wanted),
            "{wanted}\n{said}\n{scene}"
        );
        assert_eq!(said.lines().count(), 1, "{said}");
        let (scene, args) = obey(&said, &scene, args);
        let args: Vec<&str> = args.iter().map(String::as_str).collect();
        let (then, seen) = draw(&scene, &args);
        assert!(seen && then.is_empty(), "{said}{then}{args:?}\n{scene}");
    }
}

#[test]
fn a_scene_without_spheres_says_so_and_one_with_something_to_see_is_silent() {
    let (said, seen) = draw(&format!("[camera]\nview = [1, 0, 0]\n{IMAGE}"), &[]);
    assert!(
        !seen
            && said.starts_with("note: nothing is seen: the scene has no spheres; add [[sphere]]"),
        "{said}"
    );
    // One pixel is enough.
    let one = format!(
        "[camera]\norigin = [0, 0, 0]\nview = [1, 0, 0]\nwidth = 6.4\nheight = 4.8\n\
         {IMAGE}[[sphere]]\ncenter = [3, -0.05, 0.05]\nradius = 0.01\n"
    );
    for (scene, args) in
        [(format!("{IMAGE}{TWO}"), &[][..]), (one.clone(), &[]), (one, &["--region", "32,23,1,1"])]
    {
        let (said, seen) = draw(&scene, args);
        assert!(seen && said.is_empty(), "{said}\n{scene}");
    }
}

/// Parts have one camera: none of them is told to change it. What merges to nothing says so.
#[test]
fn parts_say_why_they_are_empty() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let planisphere = |args: &[&str]| {
        let output = Command::new(env!("CARGO_BIN_EXE_planisphere"))
            .args(args)
            .current_dir(here)
            .output()
            .unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.success(), "{said}");
        said
    };
    fs::write(
        here.join("s.toml"),
        format!("[camera]\norigin = [0, 0, 0]\nview = [-1, 0, 0]\nwidth = 6\n{IMAGE}{TWO}"),
    )
    .unwrap();
    let said = planisphere(&[
        "render",
        "s.toml",
        "-o",
        "none",
        "--visibility",
        "s.npz",
        "--device",
        "cpu",
    ]);
    assert_eq!(said, "note: nothing is seen: all 2 spheres lie behind the camera\n");
    assert_eq!(
        planisphere(&["merge", "s.npz"]),
        "note: nothing is seen: no part shows a sphere here\n"
    );
}

#[test]
fn wide_perspectives_get_a_note() {
    let scene = |keys: &str| {
        format!(
            "[camera]\nprojection = 'perspective'\norigin = [0, 0, 0]\nview = [1, 0, 0]\n{keys}\n\
             {IMAGE}{TWO}"
        )
    };
    for (keys, wanted) in [
        (
            "width = 10.0",
            "note: width 10 at distance 1 is a field of view of 157 degrees; fov = 60.0 is usual, \
             in place of `width`",
        ),
        (
            "height = 8",
            "note: height 8 at distance 1 is a field of view of 152 degrees; fov = 60.0 is usual, \
             in place of `height`",
        ),
        (
            "width = 10\nheight = 20",
            "note: height 20 at distance 1 is a field of view of 169 degrees; fov = 60.0 is \
             usual, in place of `width` and `height`",
        ),
    ] {
        let (said, seen) = draw(&scene(keys), &[]);
        assert!(said.lines().next() == Some(wanted), "{said}");
        assert!(seen != said.contains("nothing is seen"), "{said}");
    }
    for keys in ["width = 7.4", "fov = 170", "fov = 60.0", ""] {
        assert!(!draw(&scene(keys), &[]).0.contains("field of view"), "{keys}");
    }
    let wide = "[camera]\norigin = [0, 0, 0]\nview = [1, 0, 0]\nwidth = 10.0\n";
    assert_eq!(draw(&format!("{wide}{IMAGE}{TWO}"), &[]).0, "");
}

/// Words that other programs use lead to the key, and the key makes the picture.
#[test]
fn other_words_suggest_the_key() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |scene: &str| match from_text("scene", scene, folder.path()) {
        Err(error) => error.to_string(),
        Ok(_) => panic!("{scene} is read"),
    };
    for (section, word, key, value) in [
        ("camera", "eye", "origin", "[1, 2, 3]"),
        ("camera", "position", "origin", "[1, 2, 3]"),
        ("camera", "from", "origin", "[1, 2, 3]"),
        ("camera", "camera", "origin", "[1, 2, 3]"),
        ("camera", "pos", "origin", "[1, 2, 3]"),
        ("camera", "target", "look_at", "[1, 2, 3]"),
        ("camera", "at", "look_at", "[1, 2, 3]"),
        ("camera", "lookat", "look_at", "[1, 2, 3]"),
        ("camera", "direction", "view", "[1, 2, 3]"),
        ("camera", "dir", "view", "[1, 2, 3]"),
        ("camera", "fovy", "fov", "30.0\nprojection = 'perspective'"),
        ("image", "resolution", "width", "10"),
        ("image", "bg", "background", "'white'"),
        ("image", "colour", "background", "'white'"),
    ] {
        let text = refused(&format!("[{section}]\n{word} = {value}"));
        assert!(text.contains(&format!("did you mean `{key}`")), "{word}: {text}");
        assert!(
            from_text("scene", &format!("[{section}]\n{key} = {value}"), folder.path()).is_ok(),
            "{key}"
        );
    }
    for (word, key) in [
        ("pos", "center"),
        ("position", "center"),
        ("centre", "center"),
        ("r", "radius"),
        ("diameter", "radius"),
        ("colour", "color"),
    ] {
        let text = refused(&format!("[[sphere]]\n{word} = 1"));
        assert!(text.contains(&format!("did you mean `{key}`")), "{word}: {text}");
    }
}

#[test]
fn colours_have_names_and_short_forms() {
    let read = |color: &str| {
        let text = format!(
            "[image]\nbackground = {color}\n[[sphere]]\ncenter = [0, 0, 0]\nradius = 1\ncolor = \
             {color}\n"
        );
        from_text("scene", &text, Path::new(""))
            .map(|loaded| (loaded.look.behind(), loaded.scene.sphere(0).unwrap().color))
    };
    for (color, wanted) in [
        ("'white'", [255; 3]),
        ("'Black'", [0; 3]),
        ("'RED'", [255, 0, 0]),
        ("'rebeccapurple'", [102, 51, 153]),
        ("'lightGoldenrodYellow'", [250, 250, 210]),
        ("'#fff'", [255; 3]),
        ("'#1aF'", [17, 170, 255]),
        ("'#1a2B3c'", [26, 43, 60]),
        ("[1, 2, 3]", [1, 2, 3]),
    ] {
        assert_eq!(read(color).ok(), Some((wanted, wanted)), "{color}");
    }
    for (color, wanted) in [
        ("'transparent'", "alpha"),
        ("'#ff0000ff'", "write background = \"#ff0000\""),
        ("'#f00f'", "write background = \"#ff0000\""),
        ("'#ff000080'", "alpha"),
        ("'ff0000'", "write background = \"#ff0000\""),
        ("'light grey'", "write background = \"lightgrey\""),
        ("'rgb(1,2,3)'", "a name of CSS"),
        ("'#ff00'", "alpha"),
        ("'#ff00f'", "six hexadecimal digits"),
    ] {
        let error = read(color).expect_err(color).to_string();
        assert!(error.contains(wanted), "{color}: {error}");
    }
}

/// The examples of `merge --help`, copied from a terminal of some width.
#[cfg(unix)]
#[test]
fn examples_of_the_help_run_as_they_stand() {
    use std::os::unix::fs::PermissionsExt;
    let program = Path::new(env!("CARGO_BIN_EXE_planisphere"));
    let ball = |k: usize| {
        format!("[[sphere]]\ncenter = [{}, {}, {}]\nradius = 0.4\n", k % 10, k / 10 % 10, k / 100)
    };
    let spheres = |from: usize, to: usize| {
        let spheres: String = (from..to).map(ball).collect();
        format!(
            "[camera]\norigin = [30, 20, 15]\nlook_at = [4.5, 4.5, 4.5]\nwidth = 20\n[image]\n\
             width = 1024\nheight = 1024\n{spheres}"
        )
    };
    for columns in ["80", "100"] {
        let output = Command::new(program)
            .args(["merge", "--help"])
            .env("COLUMNS", columns)
            .output()
            .unwrap();
        let help = String::from_utf8(output.stdout).unwrap();
        let examples = help
            .split_once("Examples:\n")
            .expect("examples")
            .1
            .split_once("\n\n")
            .expect("an end")
            .0;
        assert!(examples.lines().all(|line| line.chars().count() <= 80), "{examples}");
        // What is indented by two is typed; what goes on is indented more, behind a backslash or an
        // operator.
        let mut commands: Vec<Vec<String>> = vec![Vec::new()];
        let mut going_on = false;
        for line in examples.lines() {
            if line.starts_with("  ") && (going_on || !line.starts_with("   ")) {
                let group = commands.last_mut().expect("one");
                if going_on {
                    *group.last_mut().expect("a beginning") += &format!("\n{line}");
                } else {
                    group.push(line.to_owned());
                }
                going_on = line.ends_with('\\') || line.ends_with("&&");
            } else if !commands.last().expect("one").is_empty() {
                commands.push(Vec::new());
            }
        }
        commands.retain(|group| !group.is_empty());
        assert_eq!(commands.iter().map(Vec::len).sum::<usize>(), 6, "{commands:?}");
        for group in commands {
            let folder = tempfile::tempdir().unwrap();
            let here = folder.path();
            fs::create_dir(here.join("bin")).unwrap();
            std::os::unix::fs::symlink(program, here.join("bin/planisphere")).unwrap();
            let srun = here.join("bin/srun");
            fs::write(
                &srun,
                "#!/bin/sh\nfor task in 0 1 2; do SLURM_PROCID=$task \"$@\" || exit; done\n",
            )
            .unwrap();
            fs::set_permissions(&srun, fs::Permissions::from_mode(0o755)).unwrap();
            let text = group.join("\n");
            let mut files =
                vec![("left.toml", 0, 1000), ("right.toml", 1000, 1100), ("scene.toml", 0, 50)];
            files.extend([
                ("part-0.toml", 0, 1000),
                ("part-1.toml", 1000, 2000),
                ("part-2.toml", 2000, 2010),
            ]);
            for (name, from, to) in files {
                fs::write(here.join(name), spheres(from, to)).unwrap();
            }
            let path = format!(
                "{}:{}",
                here.join("bin").display(),
                std::env::var("PATH").unwrap_or_default()
            );
            let sh = |script: &str| {
                let output = Command::new("sh")
                    .args(["-e", "-c", script])
                    .env("PATH", &path)
                    .current_dir(here)
                    .output()
                    .unwrap();
                let said = String::from_utf8_lossy(&output.stderr).into_owned();
                assert!(output.status.success(), "{columns}: {script}\n{said}");
            };
            if text.contains("part-1?.npz") {
                for k in 0..2 {
                    sh(&format!(
                        "planisphere render part-{k}.toml -o none --visibility part-1{k}.npz \
                         --first-index {}",
                        k * 1000
                    ));
                }
            }
            sh(&text);
            let made = |name: &str| here.join(name).exists();
            assert!(made("picture.png") || made("lower.npz") || made("tens.npz"), "{text}");
        }
    }
}
