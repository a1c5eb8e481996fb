//! Title, legend, scale bar and axes over pictures, and lines between groups: by the library, by
//! options, and by keys of scene files.

use std::{
    fs,
    path::Path,
    process::{Command, Stdio},
};

use planisphere::{
    Camera, Error, Legend, Look, Map, Overlay, Picture, Region, Renderer, Request, Scene, Sphere,
    Spheres,
};
use tempfile::TempDir;

/// Four spheres in two chains, whose residues are counted from 1 in each; seen along -z.
const TABLE: &str = "\
x,y,z,radius,type,chain,residue,q,name
-3,0,0,1.6,1,A,1,-1.5,one
-1,0,0.2,1.6,2,A,1,0,two
1,0,0,1.6,1,B,1,0.5,one
3,0,0.2,1.6,12,B,2,4,two
";

fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("table.csv"), TABLE).unwrap();
    folder
}

/// What the program has said, and its exit code.
fn run(folder: &Path, args: &[&str]) -> (Option<i32>, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_planisphere"));
    command.args(args).current_dir(folder).stdin(Stdio::null());
    let output = command.output().expect("the program runs");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code(), text(&output.stdout) + &text(&output.stderr))
}

/// Draws an input with options.
#[track_caller]
fn drawn(folder: &Path, input: &str, options: &[&str]) -> image::RgbaImage {
    let usual = ["render", input, "-o", "out.png", "--device", "cpu"];
    let (code, words) = run(folder, &[&usual, options].concat());
    assert_eq!(code, Some(0), "{options:?}: {words}");
    image::open(folder.join("out.png")).expect("a whole PNG").into_rgba8()
}

/// Refuses an input with options, with these words and exit code 2.
#[track_caller]
fn refused(folder: &Path, input: &str, options: &[&str], wanted: &[&str]) {
    let usual = ["render", input, "-o", "none.png", "--device", "cpu"];
    let (code, words) = run(folder, &[&usual, options].concat());
    assert_eq!(code, Some(2), "{options:?}: {words}");
    for word in wanted {
        assert!(words.contains(word), "{options:?} lacks {word:?}: {words}");
    }
    assert!(!folder.join("none.png").exists());
}

const SIZE: [u32; 2] = [320, 240];

fn scene() -> Scene {
    let sphere = |x: f64, color| Sphere { center: [x, 0.0, 0.0], radius: 2.6, color };
    let colors = [[200, 40, 40], [40, 200, 40], [40, 40, 200]];
    let spheres: Spheres = (0..3).map(|k| sphere(3.0 * k as f64 - 3.0, colors[k])).collect();
    Scene::new(spheres).unwrap()
}

fn request(scene: &Scene) -> Request {
    let camera = Camera::orthographic([0.0, 0.0, 50.0], [0.0, 0.0, -1.0], 12.0).unwrap();
    let camera = camera.up([0.0, 1.0, 0.0]).unwrap();
    Request::new(scene, camera, SIZE).unwrap()
}

/// One of each, and all of them.
fn overlays() -> [Overlay; 5] {
    let bar = Legend::Bar { map: Map::VIRIDIS, range: [-1.0, 2.5], label: "q (e)".into() };
    let new = Overlay::new;
    [
        new().title("Three of them"),
        new().legend(bar.clone()),
        new().scale_bar().unit("nm"),
        new().axes(),
        new().title("All").legend(bar).scale_bar_of(2.0).axes(),
    ]
}

/// Pixels that differ.
fn differing(one: &[[u8; 4]], other: &[[u8; 4]]) -> Vec<usize> {
    assert_eq!(one.len(), other.len());
    (0..one.len()).filter(|at| one[*at] != other[*at]).collect()
}

#[test]
fn nothing_changes_but_inside_of_its_regions() {
    let (renderer, scene) = (Renderer::cpu(), scene());
    let part = Region { x: 20, y: 30, width: 280, height: 200 };
    for look in [Look::flat(), Look::matte().transparent(), Look::illustrative().aa(2).unwrap()] {
        for region in [None, Some(part)] {
            let plain = request(&scene).look(look.clone()).with_depth();
            let plain = region.map_or(Ok(plain.clone()), |region| plain.region(region)).unwrap();
            let without = renderer.draw(&plain).unwrap();
            for overlay in overlays() {
                let with = plain.clone().overlay(overlay.clone());
                let picture = renderer.draw(&with).unwrap();
                let regions = with.overlaid().unwrap();
                assert!(!regions.is_empty());
                let width = picture.size()[0];
                let inside = |at: usize| {
                    let [x, y] = [at as u32 % width, at as u32 / width];
                    regions.iter().any(|[left, top, w, h]| {
                        (*left..left + w).contains(&x) && (*top..top + h).contains(&y)
                    })
                };
                let changed = differing(picture.rgba(), without.rgba());
                assert!(changed.len() > 30, "{overlay:?} changes {} pixels", changed.len());
                assert!(changed.into_iter().all(inside), "{overlay:?}");
                assert_eq!((picture.ids(), picture.depth()), (without.ids(), without.depth()));
            }
        }
    }
}

/// All ways lead to the same pixels.
#[test]
fn all_ways_have_it() {
    let (renderer, scene, folder) = (Renderer::cpu(), scene(), tempfile::tempdir().unwrap());
    for look in [Look::flat(), Look::matte()] {
        let [.., all] = overlays();
        let request = request(&scene).look(look).overlay(all);
        let wanted = renderer.draw(&request).unwrap();
        let pixels = wanted.rgba().len();
        let mut to = vec![[0; 4]; pixels];
        renderer.draw_to(&request, &mut to, &mut [], &mut []).unwrap();
        assert_eq!(to, wanted.rgba());
        let mut reused = Picture::default();
        renderer.draw_into(&request, &mut reused).unwrap();
        assert_eq!(reused.rgba(), wanted.rgba());
        let mut bands = Vec::new();
        let sink = |band: &Picture| {
            bands.extend_from_slice(band.rgba());
            std::ops::ControlFlow::Continue(())
        };
        renderer.draw_bands(&request, sink).unwrap();
        assert_eq!(bands, wanted.rgba());
        let path = folder.path().join("saved.png");
        wanted.save(&path).unwrap();
        let saved = image::open(&path).unwrap().into_rgba8();
        assert_eq!(saved.as_raw(), wanted.rgba().as_flattened());
        let mut sinks = planisphere::files::Sinks::default();
        let path = folder.path().join("rendered.png");
        sinks.picture = Some(planisphere::files::Target::File(path.clone()));
        renderer.render(&request, &sinks, &mut |_| {}).unwrap().0.commit().unwrap();
        let rendered = image::open(&path).unwrap().into_rgba8();
        assert_eq!(rendered.as_raw(), wanted.rgba().as_flattened());
    }
}

/// A bar is as long as it says, wherever the picture's region lies, and axes turn with the camera.
#[test]
fn lengths_and_axes_are_those_of_the_camera() {
    let (renderer, scene) = (Renderer::cpu(), scene());
    // 20 pixels a unit; the bar of two is 40 wide, white, and lies on black.
    for region in [
        Region { x: 0, y: 0, width: 320, height: 240 },
        Region { x: 7, y: 3, width: 300, height: 234 },
    ] {
        let request = request(&scene).region(region).unwrap();
        let request = request.overlay(Overlay::new().scale_bar_of(2.0));
        let picture = renderer.draw(&request).unwrap();
        let rows = picture.rgba().chunks(region.width as usize);
        let white = |row: &[[u8; 4]]| row.iter().filter(|pixel| **pixel == [255; 4]).count();
        assert_eq!(rows.map(white).max(), Some(40));
    }
    let axes = |direction: [f64; 3], up: [f64; 3]| {
        let camera = Camera::orthographic([0.0; 3], direction, 12.0).unwrap().up(up).unwrap();
        let request = request(&scene).camera(camera).overlay(Overlay::new().axes());
        let picture = renderer.draw(&request).unwrap();
        // Where each axis' colour lies, on the average.
        [[229, 72, 77], [48, 164, 108], [62, 123, 250]].map(|[r, g, b]: [u8; 3]| {
            let at: Vec<_> = (0..picture.rgba().len())
                .filter(|at| picture.rgba()[*at] == [r, g, b, 255])
                .map(|at| [at % SIZE[0] as usize, at / SIZE[0] as usize])
                .collect();
            [0, 1].map(|k| at.iter().map(|at| at[k] as f64).sum::<f64>() / at.len() as f64)
        })
    };
    // Along -z, y up: x to the right of z, y above it.
    let [x, y, z] = axes([0.0, 0.0, -1.0], [0.0, 1.0, 0.0]);
    assert!(x[0] > z[0] + 5.0 && y[1] < z[1] - 5.0, "{x:?} {y:?} {z:?}");
    // Along -x, z up: y to the right, z above.
    let [x, y, z] = axes([-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]);
    assert!(y[0] > x[0] + 5.0 && z[1] < x[1] - 5.0, "{x:?} {y:?} {z:?}");
}

#[test]
fn what_cannot_be_is_refused_by_the_library() {
    let (renderer, scene) = (Renderer::cpu(), scene());
    let refused = |request: Request, word: &str| match renderer.draw(&request) {
        Err(error @ Error::Overlay { .. }) => {
            assert!(error.to_string().contains(word) && error.fix().is_some(), "{error}");
            assert!(request.overlaid().is_err());
        }
        other => panic!("{word}: {other:?}"),
    };
    let perspective = Camera::perspective([0.0, 0.0, 50.0], [0.0, 1.0, -9.0], 30.0).unwrap();
    let near = request(&scene).camera(perspective);
    refused(near.clone().overlay(Overlay::new().scale_bar()), "parallel rays");
    // Axes are true there.
    renderer.draw(&near.overlay(Overlay::new().axes())).unwrap();
    refused(request(&scene).overlay(Overlay::new().scale_bar_of(-1.0)), "positive");
    refused(request(&scene).overlay(Overlay::new().scale_bar_of(99.0)), "for which there is room");
    refused(request(&scene).overlay(Overlay::new().legend(Legend::Keys(Vec::new()))), "no entries");
    let error = scene.clone().grouped(vec![1, 2]).unwrap_err();
    assert!(matches!(error, Error::Length { what: "groups", found: 2, wanted: 3 }), "{error}");
    let lines = request(&scene).look(Look::flat().outline_groups());
    let error = renderer.draw(&lines).unwrap_err();
    assert!(matches!(error, Error::Look(_)) && error.to_string().contains("grouped"), "{error}");
}

/// Colours of a legend are those of the spheres that are drawn.
#[test]
fn a_legend_shows_the_colours_of_spheres() {
    let folder = folder();
    let document = planisphere::read(folder.path().join("table.csv")).unwrap();
    let color = |index| document.scene.get(index).unwrap().color;
    let Some(Legend::Keys(keys)) = &document.legend else { panic!("{:?}", document.legend) };
    let wanted = [("type 1", 0), ("type 2", 1), ("type 12", 3)];
    let wanted = wanted.map(|(name, index)| (name.to_owned(), color(index)));
    assert_eq!(*keys, wanted);

    let options = ["--look", "flat", "--size", "320x240", "--view=-z"];
    let count = |picture: &image::RgbaImage, [r, g, b]: [u8; 3]| {
        let at_the_right = picture.enumerate_pixels().filter(|(x, ..)| *x > 250);
        at_the_right.filter(|(.., pixel)| pixel.0 == [r, g, b, 255]).count()
    };
    let zoomed = [&options[..], &["--zoom", "0.5", "--legend"]].concat();
    let picture = drawn(folder.path(), "table.csv", &zoomed);
    for (name, color) in &wanted {
        assert!(count(&picture, *color) > 20, "{name}");
    }
    // Numbers: the ends of the range that was used have the colours of the ends of the map.
    for (range, above) in [("auto", [-1.5, 4.0]), ("-9,9", [-9.0, 9.0])] {
        let range = format!("--range={range}");
        let by = ["--color-by", "q", &range];
        let picture = drawn(folder.path(), "table.csv", &[&zoomed[..], &by].concat());
        let mut column = Vec::new();
        for x in 250..320 {
            let colors = (0..240).map(|y| picture.get_pixel(x, y).0);
            let colors: Vec<_> =
                colors.skip_while(|c| c[..3] != Map::VIRIDIS.color(1.0).unwrap()).collect();
            if colors.len() > column.len() {
                column = colors;
            }
        }
        let last = Map::VIRIDIS.color(0.0).unwrap();
        let height = 1 + column.iter().rposition(|c| c[..3] == last).expect("the lower end");
        // Where the sphere's value lies in the bar, its colour is the sphere's.
        let place = (4.0 - above[0]) / (above[1] - above[0]);
        let row = ((1.0 - place) * height as f64) as usize;
        let sphere = Map::VIRIDIS.color(place).unwrap();
        let near = row.saturating_sub(2)..(row + 3).min(height);
        assert!(column[near].iter().any(|c| c[..3] == sphere), "{range}");
        assert!(picture.enumerate_pixels().any(|(x, _, p)| x < 250 && p.0[..3] == sphere));
    }
}

#[test]
fn keys_of_a_scene_file_are_the_options() {
    let folder = folder();
    let path = folder.path();
    let scene = |image: &str, spheres: &str| {
        let text = format!(
            "[camera]\nview = [0, 0, -1]\nup = [0, 1, 0]\n[image]\nwidth = 320\nheight = 240\n\
             {image}\n[[spheres]]\nfile = \"table.csv\"\n{spheres}\n"
        );
        fs::write(path.join("scene.toml"), text).unwrap();
    };
    let by_q = "color_by = \"q\"";
    let plain = |spheres: &str, options: &[&str]| {
        scene("", spheres);
        drawn(path, "scene.toml", options)
    };
    for (keys, spheres, options) in [
        ("title = \"A title\"", "", &["--title", "A title"][..]),
        ("scale_bar = true\nunit = \"nm\"", "", &["--scale-bar", "--unit", "nm"]),
        ("scale_bar = 2", "", &["--scale-bar=2"]),
        ("axes = true", "", &["--axes"]),
        ("legend = true", "", &["--legend"]),
        ("legend = true\nunit = \"e\"", by_q, &["--legend", "--unit", "e"]),
        ("legend = \"charge (e)\"", by_q, &["--legend=charge (e)"]),
        ("outline_by = \"chain\"", "", &["--outline-by", "chain"]),
        ("outline_by = \"residue\"", "", &["--outline-by", "residue"]),
        ("axes = false\nscale_bar = false\nlegend = false", "", &[]),
    ] {
        let wanted = plain(spheres, options);
        assert_eq!(options.is_empty(), wanted == plain(spheres, &[]), "{keys} changes nothing");
        scene(keys, spheres);
        assert!(wanted == drawn(path, "scene.toml", &[]), "{keys}");
    }
    // What is typed comes first.
    let wanted = plain("", &["--scale-bar=2", "--outline-by", "residue"]);
    scene("scale_bar = 3.0\noutline_by = \"no such column\"", "");
    let typed = ["--scale-bar=2", "--outline-by", "residue"];
    assert!(wanted == drawn(path, "scene.toml", &typed));

    for (keys, spheres, words) in [
        ("title = \"\"", "", &["scene.toml:7:9", "`title` is empty"][..]),
        ("scale_bar = 0", "", &["scene.toml:7:13", "greater than 0"]),
        ("scale_bar = \"long\"", "", &["neither true, false, nor a length"]),
        ("legend = 1", "", &["neither true, false, nor words"]),
        ("axes = 1", "", &["neither true nor false"]),
        ("legend = true", "color = \"red\"", &["scene.toml:7:10", "one colour", "color_by"]),
        ("outline_by = \"spin\"", "", &["no column `spin`", "type, chain, residue, q, name"]),
        ("outline_by = \"q\"", "", &["`q` holds real numbers"]),
        ("titel = \"x\"", "", &["did you mean `title`?"]),
    ] {
        scene(keys, spheres);
        refused(path, "scene.toml", &[], words);
    }
    fs::write(path.join("one.toml"), "[[sphere]]\ncenter = [0, 0, 0]\nradius = 1\n").unwrap();
    refused(path, "one.toml", &["--legend"], &["--legend", "no colours here"]);
    refused(path, "one.toml", &["--outline-by", "chain"], &["--outline-by", "no [[spheres]]"]);
    let text = "[image]\nlegend = true\n[[sphere]]\ncenter = [0, 0, 0]\nradius = 1\n";
    fs::write(path.join("two.toml"), text).unwrap();
    refused(path, "two.toml", &[], &["two.toml:2:10", "there is no legend"]);
    let text = "[image]\noutline_by = \"chain\"\n[[sphere]]\ncenter = [0, 0, 0]\nradius = 1\n";
    fs::write(path.join("two.toml"), text).unwrap();
    refused(path, "two.toml", &[], &["two.toml:2:14", "no [[spheres]]"]);
}

#[test]
fn what_cannot_be_is_refused_by_the_program() {
    let folder = folder();
    let table = |options: &[&str], words: &[&str]| {
        refused(folder.path(), "table.csv", options, words);
    };
    table(&["--title", " "], &["--title", "is empty"]);
    table(&["--title", "\u{6f22}"], &["U+6F22", "the font does not have"]);
    table(&["--title", "far too long a title", "--size", "60x60"], &["no room", "least size"]);
    table(&["--scale-bar=0"], &["--scale-bar", "greater than 0"]);
    table(&["--scale-bar=1e9"], &["for which there is room"]);
    table(&["--scale-bar", "--perspective"], &["parallel rays", "orthographic"]);
    table(&["--unit", "nm"], &["--unit", "add --scale-bar or --legend"]);
    table(&["--legend", "--color", "red"], &["--legend", "one colour", "--color-by"]);
    table(&["--axes", "--palette"], &["palette", "RGB"]);
    table(&["--outline-by", "q"], &["`q` holds real numbers", "integers"]);
    table(&["--outline-by", "x"], &["`x` holds real numbers"]);
    table(&["--outline-by", "spin"], &["no column `spin`", "type, chain, residue, q, name"]);
    table(&["--outline-by", "molecule"], &["no column `molecule`"]);
}

/// Lines are between groups: those of a column are those that the library is given.
#[test]
fn lines_go_by_groups() {
    let (folder, renderer) = (folder(), Renderer::cpu());
    let document = planisphere::read(folder.path().join("table.csv")).unwrap();
    let camera = document.camera(SIZE).unwrap();
    let by_hand = |groups: [u32; 4]| {
        let scene = document.scene.clone().grouped(groups.to_vec()).unwrap();
        let look = document.look.clone().outline_groups();
        renderer.draw(&Request::new(&scene, camera, SIZE).unwrap().look(look)).unwrap()
    };
    let by = |column: &str| {
        drawn(folder.path(), "table.csv", &["--size", "320x240", "--outline-by", column])
    };
    for (column, groups) in [
        ("chain", [0, 0, 1, 1]),
        ("CHAIN", [7, 7, 3, 3]),
        // Residue 1 of one chain is not residue 1 of the other.
        ("residue", [0, 0, 1, 2]),
        ("type", [0, 1, 0, 2]),
        ("name", [0, 1, 0, 1]),
    ] {
        assert!(by(column).as_raw() == by_hand(groups).rgba().as_flattened(), "{column}");
    }
    assert!(by("chain") != by("residue") && by("chain") != by("jump"));

    // Two files that reach into one another, and a sphere: no group of one is one of the other.
    fs::write(folder.path().join("moved.csv"), TABLE.replace(",0,", ",1,")).unwrap();
    let scene = "[image]\noutline_by = \"chain\"\n[[sphere]]\ncenter = [0, 2, 0]\nradius = 2\n\
                 [[spheres]]\nfile = \"table.csv\"\n[[spheres]]\nfile = \"moved.csv\"\n";
    fs::write(folder.path().join("three.toml"), scene).unwrap();
    let document = planisphere::read(folder.path().join("three.toml")).unwrap();
    let camera = document.camera(SIZE).unwrap();
    let grouped = document.scene.clone().grouped(vec![0, 1, 1, 2, 2, 3, 3, 4, 4]).unwrap();
    let draw = |scene: &Scene| {
        let request = Request::new(scene, camera, SIZE).unwrap().look(document.look.clone());
        renderer.draw(&request).unwrap().rgba().to_vec()
    };
    assert!(draw(&document.scene) == draw(&grouped));
    let shared = grouped.grouped(vec![0, 1, 1, 2, 2, 1, 1, 2, 2]).unwrap();
    assert!(draw(&document.scene) != draw(&shared));
}

/// `check` draws what `render` does.
#[test]
fn a_check_has_the_same_options() {
    let folder = folder();
    let options =
        ["--size", "320x240", "--legend", "--axes", "--scale-bar", "--outline-by", "chain"];
    drawn(folder.path(), "table.csv", &options);
    let check = ["check", "table.csv", "--golden", "out.png", "--device", "cpu"];
    assert_eq!(run(folder.path(), &[&check[..], &options].concat()).0, Some(0));
    assert_eq!(run(folder.path(), &[&check[..], &options[..5]].concat()).0, Some(1));
}
