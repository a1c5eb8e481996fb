//! The window, for real: the program on an X server without a screen (Xvfb), keys and mouse by
//! xdotool, and what the server then holds in the window.
//!
//! Every test has a server of its own, because there is one pointer and one focus a server. What a
//! test needs and does not find, it names and fails; `tests/run.sh` installs it.
#![cfg(all(feature = "window", target_os = "linux"))]

mod display;

use std::{
    fs::{self, File},
    path::{Path, PathBuf},
    process::{Child, Command, Output, Stdio},
    thread::sleep,
    time::{Duration, Instant},
};

use display::{PATIENCE, XServer, planisphere, start, wait_for};

use image::RgbImage;
use tempfile::TempDir;
use x11rb::{
    connection::Connection,
    protocol::xproto::{ConnectionExt, ImageFormat, ImageOrder},
    rust_connection::RustConnection,
};

/// Arguments of the X server.
const SCREEN: [&str; 3] = ["-screen", "0", "1280x1024x24"];

/// A pixel is 1/64 wide, so that moves by whole pixels are exact. The camera sees neither all of
/// the scene nor its middle.
const CAMERA: &str = "
[camera]
view = [1.0, 0.0, 0.0]
width = 5.0
height = 4.0
";

/// The image of the scene.
const IMAGE: &str = "
[image]
width = 320
height = 256
background = \"#102030\"
";

/// In front of the camera at depths of 3 to 11; the blue one is out of the first picture.
const SPHERES: &str = "
[[sphere]]
center = [6.0, 0.25, 0.0]
radius = 1.0
color = \"#ff0000\"

[[sphere]]
center = [4.0, -0.5, 0.5]
radius = 0.75
color = \"#00ff00\"

[[sphere]]
center = [10.0, -8.0, 3.0]
radius = 1.0
color = \"#0000ff\"
";

/// Something that is done to a window.
type Gesture<'a> = &'a dyn Fn(&Viewer);

/// The program with its window.
struct Viewer {
    process: Child,
    window: String,
    folder: TempDir,
    server: XServer,
}

impl Viewer {
    /// Opens `ball.toml` with this camera and waits for its picture.
    fn open(camera: &str, arguments: &[&str]) -> Self {
        let server = XServer::new(&SCREEN);
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("ball.toml"), format!("{camera}{IMAGE}{SPHERES}")).unwrap();
        let process = planisphere()
            .args(["view", "ball.toml"])
            .args(arguments)
            .current_dir(folder.path())
            .env("DISPLAY", &server.display)
            .stdout(File::create(folder.path().join("stdout")).unwrap())
            .stderr(File::create(folder.path().join("stderr")).unwrap())
            .spawn()
            .unwrap();
        let mut viewer = Self { process, window: String::new(), folder, server };
        viewer.window = wait_for("a window", || {
            assert!(viewer.process.try_wait().unwrap().is_none(), "it ended: {}", viewer.stderr());
            viewer
                .xdotool(&["search", "--onlyvisible", "--name", "^ball"])
                .lines()
                .next()
                .map(str::to_owned)
        });
        wait_for("the first picture", || (viewer.drawn()? > 0).then_some(()));
        // There is no window manager that would give it the keys.
        wait_for("the focus", || {
            viewer.xdotool(&["windowfocus", &viewer.window]);
            (viewer.xdotool(&["getwindowfocus"]).trim() == viewer.window).then_some(())
        });
        viewer
    }

    fn xdotool(&self, arguments: &[&str]) -> String {
        let child = start(
            Command::new("xdotool")
                .args(arguments)
                .env("DISPLAY", &self.server.display)
                .stdout(Stdio::piped())
                .stderr(Stdio::null()),
            "xdotool",
        );
        String::from_utf8(child.wait_with_output().unwrap().stdout).unwrap()
    }

    fn title(&self) -> String {
        self.xdotool(&["getwindowname", &self.window])
    }

    /// How many pictures have been drawn, by the title.
    fn drawn(&self) -> Option<u64> {
        self.title().split_once("picture ")?.1.split_once(' ')?.0.parse().ok()
    }

    fn stderr(&self) -> String {
        fs::read_to_string(self.folder.path().join("stderr")).unwrap()
    }

    fn stdout(&self) -> String {
        fs::read_to_string(self.folder.path().join("stdout")).unwrap()
    }

    fn key(&self, key: &str) {
        self.xdotool(&["key", key]);
    }

    /// Holds a button down from one place to another.
    fn drag(&self, button: &str, from: [i32; 2], to: [i32; 2]) {
        let ([a, b], [c, d]) = (from.map(|n| n.to_string()), to.map(|n| n.to_string()));
        let w = self.window.as_str();
        self.xdotool(&["mousemove", "--window", w, &a, &b, "mousedown", button]);
        self.xdotool(&["mousemove", "--window", w, &c, &d, "mouseup", button]);
    }

    /// Waits until something more has been drawn, and then nothing for a while.
    fn redrawn(&self, before: u64) {
        let mut last = wait_for("another picture", || self.drawn().filter(|&drawn| drawn > before));
        loop {
            sleep(Duration::from_millis(200));
            match self.drawn() {
                Some(drawn) if drawn == last => return,
                drawn => last = drawn.unwrap_or(last),
            }
        }
    }

    /// Does something that changes the picture.
    fn change(&self, act: impl FnOnce(&Self)) {
        let before = self.drawn().unwrap();
        act(self);
        self.redrawn(before);
    }

    /// What the X server holds in the window.
    fn pixels(&self) -> RgbImage {
        let (connection, _) = RustConnection::connect(Some(&self.server.display)).unwrap();
        let window = self.window.parse().unwrap();
        let size = connection.get_geometry(window).unwrap().reply().unwrap();
        let reply = connection
            .get_image(ImageFormat::Z_PIXMAP, window, 0, 0, size.width, size.height, u32::MAX)
            .unwrap()
            .reply()
            .unwrap();
        assert_eq!(
            reply.data.len(),
            4 * usize::from(size.width) * usize::from(size.height),
            "32 bits a pixel"
        );
        let least_first = connection.setup().image_byte_order == ImageOrder::LSB_FIRST;
        let bytes = reply.data.chunks_exact(4).flat_map(|pixel| {
            if least_first {
                [pixel[2], pixel[1], pixel[0]]
            } else {
                [pixel[1], pixel[2], pixel[3]]
            }
        });
        RgbImage::from_vec(size.width.into(), size.height.into(), bytes.collect()).unwrap()
    }

    /// Waits until the window shows a picture, and only then fails.
    fn shows(&self, picture: &RgbImage) {
        let start = Instant::now();
        while self.pixels() != *picture {
            if start.elapsed() > PATIENCE {
                let kept = Path::new(env!("CARGO_TARGET_TMPDIR")).join("window.actual.png");
                self.pixels().save(&kept).unwrap();
                panic!("the window shows something else: see {}", kept.display());
            }
            sleep(Duration::from_millis(50));
        }
    }

    /// Presses S; the new file, and the camera that goes to standard output.
    fn screenshot(&self) -> (PathBuf, String) {
        let (before, printed) = (self.stderr().len(), self.stdout().len());
        self.key("s");
        let table = wait_for("a screenshot", || {
            let table = self.stdout()[printed..].to_owned();
            table.contains("\nnear = ").then_some(table)
        });
        let said = self.stderr()[before..].to_owned();
        let name =
            said.strip_prefix("saved ").and_then(|rest| rest.strip_suffix('\n')).expect(&said);
        (self.folder.path().join(name), table)
    }

    /// What `render` writes for the scene with another camera.
    fn render(&self, camera: &str, arguments: &[&str]) -> Vec<u8> {
        let (scene, out) =
            (self.folder.path().join("again.toml"), self.folder.path().join("again.png"));
        fs::write(&scene, format!("{camera}{IMAGE}{SPHERES}")).unwrap();
        let ended = planisphere()
            .args(["render", "--device", "cpu", "--no-metadata"])
            .args([&scene, Path::new("-o"), &out])
            .args(arguments)
            .output()
            .unwrap();
        assert!(ended.status.success(), "{}", String::from_utf8_lossy(&ended.stderr));
        fs::read(&out).unwrap()
    }

    /// That a screenshot now is what `render` writes, and what the window shows; its camera.
    fn check(&self) -> (RgbImage, toml::Table) {
        let (path, table) = self.screenshot();
        let bytes = fs::read(&path).unwrap();
        let picture = decode(&bytes);
        let size = format!("{}x{}", picture.width(), picture.height());
        let again = self.render(&table, &["--size", &size]);
        assert!(bytes == again, "{} is not what render writes for\n{table}", path.display());
        self.shows(&picture);
        (picture, table.parse::<toml::Table>().unwrap()["camera"].as_table().unwrap().clone())
    }

    /// Presses a key that ends it; how it ended.
    fn quit(mut self, key: &str) -> Option<i32> {
        self.key(key);
        wait_for("the end", || self.process.try_wait().unwrap()).code()
    }
}

impl Drop for Viewer {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

fn decode(bytes: &[u8]) -> RgbImage {
    image::load_from_memory(bytes).unwrap().to_rgb8()
}

fn number(camera: &toml::Table, key: &str) -> f64 {
    camera[key].as_float().unwrap()
}

#[test]
fn screenshots_are_what_render_writes_and_what_is_seen() {
    let viewer = Viewer::open(CAMERA, &["--device", "cpu"]);
    let title = viewer.title();
    for part in ["ball | 3 spheres | 320 x 256 | cpu | ", " ms, picture 1 "] {
        assert!(title.contains(part), "{title}");
    }
    // The second name is taken: it stays what it is.
    let taken = viewer.folder.path().join("ball-002.png");
    fs::write(&taken, "mine").unwrap();

    let (first, table) = viewer.screenshot();
    assert_eq!(first, viewer.folder.path().join("ball-001.png"));
    let bytes = fs::read(&first).unwrap();
    assert!(bytes == viewer.render(CAMERA, &[]), "what the scene's own camera sees");
    assert!(bytes == viewer.render(&table, &[]), "what the camera that is printed sees:\n{table}");
    assert!(
        table.starts_with("# as seen at 320 x 256 pixels\n[camera]\n")
            && !table.contains("[image]"),
        "{table}"
    );
    let home = decode(&bytes);
    viewer.shows(&home);

    viewer.change(|v| v.drag("1", [170, 130], [230, 100]));
    let (turned, camera) = viewer.check();
    assert_ne!(turned, home);
    assert_eq!((number(&camera, "width"), number(&camera, "near")), (5.0, 0.0));
    assert!(!camera.contains_key("far"));
    assert_eq!(fs::read(&taken).unwrap(), b"mine");
    assert!(viewer.folder.path().join("ball-003.png").is_file());

    viewer.change(|v| v.key("r"));
    viewer.shows(&home);
    assert_eq!(viewer.quit("q"), Some(0));
}

#[test]
fn nothing_is_drawn_when_nothing_changes() {
    let viewer = Viewer::open(CAMERA, &["--device", "cpu"]);
    let picture = viewer.pixels();
    // The mouse without a button, a click, keys that change nothing here, a screenshot, another
    // window over this one.
    for x in (0..300).step_by(20) {
        viewer.xdotool(&["mousemove", "--window", &viewer.window, &x.to_string(), "100"]);
    }
    viewer.xdotool(&[
        "click", "1", "click", "2", "click", "3", "key", "r", "key", "x", "key", "ctrl+o",
    ]);
    viewer.screenshot();
    viewer.xdotool(&["windowunmap", "--sync", &viewer.window]);
    viewer.xdotool(&["windowmap", "--sync", &viewer.window]);
    viewer.shows(&picture);
    sleep(Duration::from_millis(500));
    assert_eq!(viewer.drawn(), Some(1));
}

#[test]
fn what_is_overtaken_is_not_drawn() {
    const MOVES: i32 = 400;
    let viewer = Viewer::open(CAMERA, &["--device", "cpu", "--size", "1000x800"]);
    let before = viewer.drawn().unwrap();
    // In one breath: the moves come faster than pictures can be drawn.
    let mut arguments: Vec<String> = Vec::new();
    for k in 0..=MOVES {
        let (x, y) = (300 + k, 300 + k / 2);
        arguments.extend(
            format!("mousemove --window {} {x} {y}", viewer.window).split(' ').map(str::to_owned),
        );
        if k == 0 {
            arguments.extend(["mousedown".into(), "1".into()]);
        }
    }
    arguments.extend(["mouseup".into(), "1".into()]);
    viewer.xdotool(&arguments.iter().map(String::as_str).collect::<Vec<_>>());
    viewer.redrawn(before);
    let drawn = viewer.drawn().unwrap() - before;
    assert!(drawn < MOVES as u64 / 2, "{drawn} pictures for {MOVES} moves");
    // The last move counts: the same drag in one move leads to the same picture.
    let (end, _) = viewer.check();
    viewer.change(|v| v.key("r"));
    viewer.change(|v| v.drag("1", [300, 300], [300 + MOVES, 300 + MOVES / 2]));
    viewer.shows(&end);
}

#[test]
fn the_mouse_moves_and_zooms() {
    let viewer = Viewer::open(CAMERA, &["--device", "cpu"]);
    let home = viewer.pixels();
    // A move by whole pixels moves the picture by whole pixels.
    let pans: [(&str, Gesture); 2] = [
        ("middle", &|v| v.drag("2", [100, 100], [132, 80])),
        ("shift", &|v| {
            v.xdotool(&["keydown", "shift"]);
            v.drag("1", [100, 100], [132, 80]);
            v.xdotool(&["keyup", "shift"]);
        }),
    ];
    for (name, pan) in pans {
        viewer.change(pan);
        let (moved, _) = viewer.check();
        for (x, y, pixel) in home.enumerate_pixels().filter(|&(x, y, _)| x + 32 < 320 && y >= 20) {
            assert_eq!(moved.get_pixel(x + 32, y - 20), pixel, "{name}: column {x}, row {y}");
        }
        viewer.change(|v| v.key("r"));
        viewer.shows(&home);
    }

    // The wheel zooms, and what is below the cursor stays there. winit 0.30 counts a notch of a
    // wheel that has no smooth scrolling, such as xdotool's, when it goes down and again when it
    // comes up; four notches halve the height.
    let zoomed = |clicks: i32, notch: &str| {
        viewer.xdotool(&["mousemove", "--window", &viewer.window, "200", "100"]);
        viewer.change(|v| {
            drop(v.xdotool(&["click", "--repeat", &clicks.to_string(), "--delay", "20", notch]))
        });
        let (picture, camera) = viewer.check();
        (picture, number(&camera, "height"))
    };
    let (near, height) = zoomed(2, "4");
    let [once, twice] = [0.5, 1.0].map(|halvings: f64| 4.0 * (-halvings).exp2());
    assert!((height - once).abs() < 1e-9 || (height - twice).abs() < 1e-9, "{height}");
    let before =
        |at: u32, cursor: f64| cursor + (f64::from(at) + 0.5 - cursor) * (height / 4.0) - 0.5;
    let mut compared = 0;
    for (x, y, pixel) in near.enumerate_pixels() {
        // A sample that lies between four samples of one colour has that colour too.
        let [left, top] = [before(x, 200.0), before(y, 100.0)].map(|at| at.floor() as u32);
        let around =
            [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(dx, dy)| home.get_pixel(left + dx, top + dy));
        if around.iter().all(|other| *other == around[0]) {
            assert_eq!(pixel, around[0], "column {x}, row {y}");
            compared += 1;
        }
    }
    assert!(compared > 70_000, "{compared} pixels compared");
    let (_, far) = zoomed(4, "5");
    assert!((far * height - 16.0).abs() < 1e-9, "{far}");
}

#[test]
fn keys_frame_switch_list_and_quit() {
    let viewer = Viewer::open(CAMERA, &["--device", "cpu"]);
    let blue = |picture: &RgbImage| picture.pixels().filter(|pixel| pixel.0 == [0, 0, 255]).count();
    let home = viewer.pixels();
    assert_eq!(blue(&home), 0);
    viewer.change(|v| v.key("f"));
    let (all, _) = viewer.check();
    assert!(blue(&all) > 50, "{} pixels", blue(&all));

    viewer.change(|v| v.key("o"));
    let (perspective, camera) = viewer.check();
    assert_eq!(camera["projection"].as_str(), Some("perspective"));
    assert_eq!(camera.get("fov").and_then(toml::Value::as_float), Some(40.0), "{camera}");
    assert!(blue(&perspective) > 50 && perspective != all);
    viewer.change(|v| v.drag("1", [10, 200], [60, 190]));
    viewer.change(|v| drop(v.xdotool(&["click", "4"])));
    viewer.change(|v| v.drag("2", [10, 200], [30, 190]));
    viewer.check();
    viewer.change(|v| v.key("o"));
    let (_, camera) = viewer.check();
    assert_eq!(camera["projection"].as_str(), Some("orthographic"));
    viewer.change(|v| v.key("r"));
    viewer.shows(&home);
    // There and back is exact.
    viewer.change(|v| v.key("o"));
    viewer.change(|v| v.key("o"));
    viewer.shows(&home);

    viewer.key("h");
    wait_for("the keys in the title", || viewer.title().contains("F: frame all").then_some(()));
    let said = viewer.stderr();
    for word in ["drag", "wheel", "F ", "R ", "O ", "S ", "H ", "Esc, Q"] {
        assert!(said.contains(&format!("\n  {word}")), "{word}: {said}");
    }
    viewer.key("h");
    wait_for("the title", || viewer.drawn());
    assert_eq!(viewer.quit("Escape"), Some(0));
}

#[test]
fn resizing_keeps_the_view() {
    let viewer = Viewer::open(CAMERA, &["--device", "cpu", "--size", "400x320"]);
    assert!(viewer.title().contains("400 x 320"), "{}", viewer.title());
    let (path, _) = viewer.screenshot();
    assert!(fs::read(&path).unwrap() == viewer.render(CAMERA, &["--size", "400x320"]));

    viewer.change(|v| drop(v.xdotool(&["windowsize", &v.window, "601", "200"])));
    assert!(viewer.title().contains("601 x 200"), "{}", viewer.title());
    let (picture, camera) = viewer.check();
    assert_eq!(picture.dimensions(), (601, 200));
    assert_eq!(number(&camera, "height"), 4.0);
    assert!(!camera.contains_key("width"), "pixels stay square: {camera}");
    // Back at the first size it is the first picture: nothing has been rounded away.
    viewer.change(|v| drop(v.xdotool(&["windowsize", &v.window, "400", "320"])));
    viewer.shows(&decode(&fs::read(&path).unwrap()));
}

#[test]
fn clip_planes_stay_with_a_drag() {
    let clipped = CAMERA.replace("width = 5.0", "near = 3.75\nfar = 5.5\nwidth = 5.0");
    let viewer = Viewer::open(&clipped, &["--device", "cpu"]);
    viewer.change(|v| v.drag("1", [10, 10], [40, 30]));
    viewer.change(|v| v.drag("2", [100, 10], [110, 30]));
    let (_, camera) = viewer.check();
    assert_eq!((number(&camera, "near"), number(&camera, "far")), (3.75, 5.5));
}

#[test]
fn the_gpu_shows_the_same() {
    let viewer = Viewer::open(CAMERA, &["--device", "gpu"]);
    assert!(!viewer.title().contains("| cpu |"), "{}", viewer.title());
    viewer.check();
    viewer.change(|v| v.drag("1", [170, 130], [230, 100]));
    viewer.check();
    assert_eq!(viewer.quit("q"), Some(0));
}

#[test]
fn without_a_display_there_is_a_message() {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("ball.toml");
    fs::write(&scene, format!("{CAMERA}{IMAGE}{SPHERES}")).unwrap();
    let view = |scene: &Path, display: Option<&str>| -> (Option<i32>, String) {
        let Output { status, stderr, .. } = planisphere()
            .arg("view")
            .arg(scene)
            .envs(display.map(|d| ("DISPLAY", d)))
            .output()
            .unwrap();
        (status.code(), String::from_utf8(stderr).unwrap())
    };
    let (code, said) = view(&scene, None);
    assert_eq!(code, Some(3), "{said}");
    for word in ["WAYLAND_DISPLAY is not set", "DISPLAY is not set", "planisphere render"] {
        assert!(said.contains(word), "{said}");
    }
    let (code, said) = view(&scene, Some(":98765"));
    assert_eq!(code, Some(3), "{said}");
    assert!(said.contains("DISPLAY is :98765") && !said.contains(".rs"), "{said}");
    let (code, said) = view(&folder.path().join("none.toml"), None);
    assert_eq!(code, Some(2), "{said}");
}
