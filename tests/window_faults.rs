//! The window where things go wrong: displays that are not there, do not answer, lack something or
//! go away; variables that make no sense; a window that is taken away; pictures that take too long.
//!
//! Whatever happens, the program ends with an exit code that is documented and with words, or the
//! window shows the picture. It never hangs and it never panics. That a machine under load is slow
//! is allowed for everywhere: a limit is there to tell waiting from hanging.
#![cfg(all(feature = "window", target_os = "linux"))]

mod display;

use std::{
    fs::{self, File},
    io::{Read, Write},
    net::Shutdown,
    os::{
        fd::{AsRawFd, OwnedFd},
        unix::{
            net::{UnixListener, UnixStream},
            process::CommandExt,
        },
    },
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
    sync::atomic::{AtomicU32, Ordering},
    thread::{self, sleep},
    time::{Duration, Instant},
};

use display::{PATIENCE, XServer, planisphere, start, wait_for};
use tempfile::TempDir;
use x11rb::{
    connection::Connection,
    protocol::xproto::{AtomEnum, ConnectionExt, ImageFormat, PropMode},
    rust_connection::RustConnection,
    wrapper::ConnectionExt as _,
};

/// Colours that are at the ends, in the middle and at odd places of the levels of every screen.
const SCENE: &str = "
[camera]
view = [1.0, 0.0, 0.0]
width = 5.0

[image]
width = 320
height = 256
background = \"#102030\"

[[sphere]]
center = [6.0, 0.25, 0.0]
radius = 1.0
color = \"#ff00a5\"

[[sphere]]
center = [4.0, -0.5, 0.5]
radius = 0.75
color = \"#7f80fe\"
";

const SCREEN: [&str; 3] = ["-screen", "0", "1280x1024x24"];

/// The program, with a folder of its own.
struct Program {
    process: Child,
    folder: TempDir,
}

/// Something that is set before the program starts.
type Setting<'a> = &'a dyn for<'c> Fn(&'c mut Command) -> &'c mut Command;

impl Program {
    fn view(scene: &str, set: impl for<'c> FnOnce(&'c mut Command) -> &'c mut Command) -> Self {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("ball.toml"), scene).unwrap();
        let file = |name: &str| File::create(folder.path().join(name)).unwrap();
        let mut command = planisphere();
        command.args(["view", "ball.toml", "--device", "cpu"]).current_dir(folder.path());
        command.env("XDG_RUNTIME_DIR", folder.path()).env_remove("WINIT_X11_SCALE_FACTOR");
        command.stdin(Stdio::null()).stdout(file("stdout")).stderr(file("stderr"));
        set(&mut command);
        Self { process: command.spawn().unwrap(), folder }
    }

    fn on(server: &XServer, scene: &str) -> Self {
        Self::view(scene, |command| command.env("DISPLAY", &server.display))
    }

    fn read(&self, name: &str) -> String {
        fs::read_to_string(self.folder.path().join(name)).unwrap()
    }

    fn stderr(&self) -> String {
        self.read("stderr")
    }

    fn window(&self, server: &XServer) -> Option<String> {
        let pid = self.process.id().to_string();
        server
            .xdotool(&["search", "--onlyvisible", "--pid", &pid])
            .lines()
            .last()
            .map(str::to_owned)
    }

    /// Waits for its window.
    fn up(&mut self, server: &XServer) -> String {
        wait_for("a window", || {
            if let Some(status) = self.process.try_wait().unwrap() {
                panic!("it ended: {status}: {}", self.stderr());
            }
            self.window(server)
        })
    }

    /// Waits for its window to have the keys.
    fn focused(&mut self, server: &XServer) -> String {
        let window = self.up(server);
        wait_for("the focus", || {
            server.xdotool(&["windowfocus", &window]);
            (server.xdotool(&["getwindowfocus"]).trim() == window).then_some(())
        });
        window
    }

    /// Waits for its window, and closes it by a key.
    fn up_and_quit(&mut self, server: &XServer) -> String {
        self.focused(server);
        server.xdotool(&["key", "q"]);
        let (code, said) = self.end();
        assert_eq!(code, Some(0), "{said}");
        said
    }

    /// Waits for the end: its exit code, and what it said.
    fn end(&mut self) -> (Option<i32>, String) {
        let status = wait_for(&format!("the end; so far: {}", self.stderr()), || {
            self.process.try_wait().unwrap()
        });
        let said = self.stderr();
        assert!(!said.contains("panicked") && !said.contains(".rs:"), "{said}");
        (status.code(), said)
    }

    /// Waits for an end without a window: its words.
    fn refused(&mut self) -> String {
        let start = Instant::now();
        let (code, said) = self.end();
        assert_eq!(code, Some(3), "{said}");
        assert!(start.elapsed() < Duration::from_secs(30), "{:?}: {said}", start.elapsed());
        assert!(
            said.contains("error: ")
                && said.contains("\nfix: ")
                && said.contains("planisphere render"),
            "{said}"
        );
        said
    }

    /// Waits for an end after the window: its words.
    fn lost(&mut self, words: &str) {
        let said = self.refused();
        assert!(said.contains("error: the window is gone: ") && said.contains(words), "{said}");
    }

    /// Only what belongs there lies in its folder.
    fn no_litter(&self) {
        let mut names: Vec<_> =
            fs::read_dir(self.folder.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
        names.sort();
        assert_eq!(names, ["ball.toml", "stderr", "stdout"]);
    }

    /// What `render` draws of its scene in another size: red, green and blue.
    fn render(&self, size: [u32; 2]) -> Vec<[u8; 3]> {
        let out = self.folder.path().join("again.png");
        let ended = planisphere()
            .args([
                "render",
                "--device",
                "cpu",
                "--size",
                &format!("{}x{}", size[0], size[1]),
                "-o",
            ])
            .args([&out, &self.folder.path().join("ball.toml")])
            .output()
            .unwrap();
        assert!(ended.status.success(), "{}", String::from_utf8_lossy(&ended.stderr));
        let picture = image::open(&out).unwrap().to_rgb8();
        fs::remove_file(&out).unwrap();
        assert_eq!(picture.dimensions(), (size[0], size[1]));
        picture.pixels().map(|pixel| pixel.0).collect()
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// The size of a window.
fn size_of(server: &XServer, window: &str) -> [u32; 2] {
    let (connection, _) = RustConnection::connect(Some(&server.display)).unwrap();
    let size = connection.get_geometry(window.parse().unwrap()).unwrap().reply().unwrap();
    [size.width.into(), size.height.into()]
}

/// What the server holds in a window: its size; levels of red, green and blue; and how many levels
/// there are.
fn levels(server: &XServer, window: &str) -> ([u32; 2], Vec<[u32; 3]>, [u32; 3]) {
    let (connection, screen) = RustConnection::connect(Some(&server.display)).unwrap();
    let (setup, window) = (connection.setup(), window.parse().unwrap());
    let size = connection.get_geometry(window).unwrap().reply().unwrap();
    let (width, height) = (usize::from(size.width), usize::from(size.height));
    let root = &setup.roots[screen];
    let visuals = root.allowed_depths.iter().flat_map(|depth| &depth.visuals);
    let visual = visuals.into_iter().find(|visual| visual.visual_id == root.root_visual).unwrap();
    let masks = [visual.red_mask, visual.green_mask, visual.blue_mask];
    let format = setup.pixmap_formats.iter().find(|format| format.depth == size.depth).unwrap();
    let bytes = usize::from(format.bits_per_pixel / 8);
    let stride = (width * usize::from(format.bits_per_pixel))
        .next_multiple_of(format.scanline_pad.into())
        / 8;
    let reply = connection.get_image(
        ImageFormat::Z_PIXMAP,
        window,
        0,
        0,
        size.width,
        size.height,
        u32::MAX,
    );
    let data = reply.unwrap().reply().unwrap().data;
    let mut found = Vec::with_capacity(width * height);
    for row in data.chunks_exact(stride) {
        for pixel in row[..width * bytes].chunks_exact(bytes) {
            let mut whole = [0; 4];
            whole[..bytes].copy_from_slice(pixel);
            let value = u32::from_le_bytes(whole);
            found.push(masks.map(|mask| (value & mask) >> mask.trailing_zeros()));
        }
    }
    ([width as u32, height as u32], found, masks.map(|mask| mask >> mask.trailing_zeros()))
}

/// Waits until a window shows the picture that `render` draws, as near as the screen's levels come.
fn shows(program: &Program, server: &XServer, window: &str) {
    let size = size_of(server, window);
    let wanted = program.render(size);
    let start = Instant::now();
    loop {
        let (now, found, most) = levels(server, window);
        assert_eq!(now, size);
        let near = |level: u32, channel: u8, most: u32| {
            (f64::from(level) - f64::from(channel) * f64::from(most) / 255.0).abs() <= 0.5
        };
        let wrong = found
            .iter()
            .zip(&wanted)
            .filter(|(levels, color)| (0..3).any(|k| !near(levels[k], color[k], most[k])));
        match wrong.count() {
            0 => return,
            wrong => assert!(
                start.elapsed() < PATIENCE,
                "{wrong} wrong pixels of {size:?}: {}",
                program.stderr()
            ),
        }
        sleep(Duration::from_millis(100));
    }
}

/// What a server does that is none.
#[derive(Clone, Copy, Debug)]
enum Fake {
    /// It closes the connection at once.
    Closes,
    /// It reads a little first.
    ReadsAndCloses,
    /// It says nothing.
    Silent,
    /// It says something else.
    Babbles,
}

const FAKES: [Fake; 4] = [Fake::Closes, Fake::ReadsAndCloses, Fake::Silent, Fake::Babbles];

impl Fake {
    /// Listens, as long as the test runs.
    fn listen(self, path: &Path) {
        let listener = UnixListener::bind(path).unwrap();
        thread::spawn(move || {
            let mut kept = Vec::new();
            for stream in listener.incoming() {
                let mut stream = stream.unwrap();
                match self {
                    Self::Closes => {}
                    Self::ReadsAndCloses => drop(stream.read(&mut [0; 4])),
                    Self::Silent => kept.push(stream),
                    Self::Babbles => {
                        let _ = stream.write_all(&[0x5a; 4096]);
                        kept.push(stream);
                    }
                }
            }
        });
    }
}

/// The number of a display that no server has, and the name of its socket, which is removed in the
/// end.
struct Display(u32, PathBuf);

impl Display {
    fn unused() -> Self {
        static NEXT: AtomicU32 = AtomicU32::new(0);
        loop {
            let number = 1000 + std::process::id() % 50_000 + NEXT.fetch_add(1, Ordering::Relaxed);
            let path = PathBuf::from(format!("/tmp/.X11-unix/X{number}"));
            if path.symlink_metadata().is_err() {
                return Self(number, path);
            }
        }
    }

    fn name(&self) -> String {
        format!(":{}", self.0)
    }
}

impl Drop for Display {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.1);
    }
}

/// A scene that takes far longer to draw than any test waits: at every pixel, which of thousands of
/// spheres comes first is a matter of their last bits.
fn endless() -> String {
    use std::fmt::Write;
    let mut scene =
        String::from("[camera]\nview = [1.0, 0.0, 0.0]\norigin = [-5.0, 0.0, 0.0]\nwidth = 3.0\n");
    scene += "[image]\nwidth = 800\nheight = 800\n";
    let mut bits = 1u64;
    let mut next = || {
        bits = bits.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (bits >> 40) as f64 / f64::from(1 << 24) * 2f64.powi(-48)
    };
    for _ in 0..4000 {
        let (x, y, z, more) = (next(), next(), next(), next());
        writeln!(scene, "[[sphere]]\ncenter = [{x:?}, {y:?}, {z:?}]\nradius = {:?}", 1.0 + more)
            .unwrap();
    }
    scene
}

#[test]
fn wayland_that_leads_nowhere_leaves_x() {
    let server = XServer::new(&SCREEN);
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    fs::write(at("file"), "").unwrap();
    for fake in FAKES {
        fake.listen(Path::new(&at(&format!("{fake:?}"))));
    }
    let x_socket = format!("/tmp/.X11-unix/X{}", &server.display[1..]);
    let long = "x".repeat(300);
    let mut displays =
        vec!["nonsense".to_owned(), at("none"), at("file"), x_socket, long, "a\u{7}b".to_owned()];
    displays.extend(FAKES.map(|fake| at(&format!("{fake:?}"))));
    let sockets = ["nonsense", "-1", "99", "0", "1", "3.5", "99999999999"].map(str::to_owned);
    let cases = displays.iter().map(|value| ("WAYLAND_DISPLAY", value));
    for (variable, value) in cases.chain(sockets.iter().map(|value| ("WAYLAND_SOCKET", value))) {
        let mut program = Program::view(SCENE, |command| {
            command.env("DISPLAY", &server.display).env(variable, value)
        });
        let said = program.up_and_quit(&server);
        let shown = planisphere_core::text::name(value);
        assert!(
            said.contains(&format!("note: {variable} is {shown}: ")),
            "{variable}={value}: {said}"
        );
        assert!(
            said.contains("; the window is opened on DISPLAY instead\n"),
            "{variable}={value}: {said}"
        );
    }
    // What is empty is not set, and needs no word.
    let mut program = Program::view(SCENE, |command| {
        command.env("DISPLAY", &server.display).env("WAYLAND_DISPLAY", "").env("WAYLAND_SOCKET", "")
    });
    let said = program.up_and_quit(&server);
    assert!(!said.contains("WAYLAND"), "{said}");
}

#[test]
fn where_nothing_answers_each_variable_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let not_there = Display::unused();
    let no_such = format!("{}.0", not_there.name());
    let mut cases: Vec<(String, &str)> = [
        ("", "DISPLAY is not set"),
        (":99999", "not the name of a display"),
        ("nonsense", "not the name of a display"),
        ("unix:/x", "not the name of a display"),
        (":-1", "not the name of a display"),
        (":0.x", "not the name of a display"),
        (no_such.as_str(), "No such file"),
        ("nohost.invalid:0", "nohost.invalid"),
        ("127.0.0.1:30000", "refused"),
    ]
    .map(|(name, words)| (name.to_owned(), words))
    .to_vec();
    let fakes: Vec<Display> = FAKES.iter().map(|_| Display::unused()).collect();
    for (fake, display) in FAKES.into_iter().zip(&fakes) {
        // The folder is there as soon as there has been a server.
        let _ = fs::create_dir(display.1.parent().unwrap());
        fake.listen(&display.1);
        let words = match fake {
            Fake::Closes | Fake::ReadsAndCloses => "the server closes the connection at once",
            Fake::Silent => "no answer within 2.5 seconds",
            Fake::Babbles => "DISPLAY is :",
        };
        cases.push((display.name(), words));
    }
    for (name, words) in &cases {
        let mut program = Program::view(SCENE, |command| command.env("DISPLAY", name));
        let said = program.refused();
        assert!(
            said.contains(words) && said.contains("WAYLAND_DISPLAY is not set"),
            "{name}: {said}"
        );
        assert!(
            name.is_empty() || said.contains(&format!("DISPLAY is {name}: ")),
            "{name}: {said}"
        );
    }
    // Both, where neither answers; and a socket that is handed over, and is silent.
    let silent = folder.path().join("silent");
    Fake::Silent.listen(&silent);
    let mut program = Program::view(SCENE, |command| {
        command.env("DISPLAY", fakes[2].name()).env("WAYLAND_DISPLAY", &silent)
    });
    let said = program.refused();
    assert!(
        said.contains("WAYLAND_DISPLAY is ") && said.contains("no answer within 1.2 seconds"),
        "{said}"
    );
    assert!(
        said.contains("DISPLAY is :") && said.contains("no answer within 2.5 seconds"),
        "{said}"
    );
    let (ours, _theirs) = UnixStream::pair().unwrap();
    let mut program = Program::view(SCENE, |command| hand_over(command, ours.into()));
    let said = program.refused();
    assert!(
        said.contains("WAYLAND_SOCKET is 60: no answer within 3 seconds; DISPLAY is not set"),
        "{said}"
    );
    // A screen that the server does not have.
    let server = XServer::new(&SCREEN);
    let mut program =
        Program::view(SCENE, |command| command.env("DISPLAY", format!("{}.7", server.display)));
    assert!(program.refused().contains("no screen of this number"));
    // `unix:` and a number are `:` and a number.
    let name = format!("unix{}", server.display);
    let mut program = Program::view(SCENE, |command| command.env("DISPLAY", name));
    program.up_and_quit(&server);
}

/// Lets the program inherit a descriptor, as number 60, and names it in `WAYLAND_SOCKET`.
fn hand_over(command: &mut Command, descriptor: OwnedFd) -> &mut Command {
    command.env("WAYLAND_SOCKET", "60");
    // SAFETY: between fork and exec only a system call is made.
    unsafe {
        command.pre_exec(move || match libc::dup2(descriptor.as_raw_fd(), 60) {
            60 => Ok(()),
            _ => Err(std::io::Error::last_os_error()),
        })
    }
}

#[test]
fn a_server_that_starts_anew_is_tried_again() {
    let server = XServer::new(&SCREEN);
    let display = Display::unused();
    let listener = UnixListener::bind(&display.1).unwrap();
    let behind = format!("/tmp/.X11-unix/X{}", &server.display[1..]);
    thread::spawn(move || {
        // The first connection is closed at once; the others lead to the server.
        for stream in listener.incoming().skip(1) {
            let (client, server) = (stream.unwrap(), UnixStream::connect(&behind).unwrap());
            for (mut from, mut to) in [
                (client.try_clone().unwrap(), server.try_clone().unwrap()),
                (server.try_clone().unwrap(), client.try_clone().unwrap()),
            ] {
                thread::spawn(move || {
                    let _ = std::io::copy(&mut from, &mut to);
                    let _ = to.shutdown(Shutdown::Both);
                });
            }
        }
    });
    let mut program = Program::view(SCENE, |command| command.env("DISPLAY", display.name()));
    // Descriptors do not go through this, so that memory cannot be shared: the picture comes all
    // the same.
    let window = program.focused(&server);
    shows(&program, &server, &window);
    program.up_and_quit(&server);
}

#[test]
fn scales_without_sense_change_nothing() {
    let server = XServer::new(&SCREEN);
    let cases = ["0", "-1", "nan", "inf", "1e9", "text", "1e-300", "", "randr", "2"];
    for value in cases {
        let mut program = Program::view(SCENE, |command| {
            command.env("DISPLAY", &server.display).env("WINIT_X11_SCALE_FACTOR", value)
        });
        let window = program.focused(&server);
        assert_eq!(size_of(&server, &window), [320, 256], "{value}");
        let said = program.up_and_quit(&server);
        let noted =
            said.contains(&format!("note: WINIT_X11_SCALE_FACTOR is {value}, which is no scale"));
        assert_eq!(noted, !["", "randr", "2"].contains(&value), "{value}: {said}");
    }
    // The resource that desktops set.
    let (connection, screen) = RustConnection::connect(Some(&server.display)).unwrap();
    let root = connection.setup().roots[screen].root;
    for value in ["0", "-5", "1e300", "nan", "inf", "text", ""] {
        let resource = format!("Xft.dpi:\t{value}\n");
        let (name, kind) = (AtomEnum::RESOURCE_MANAGER, AtomEnum::STRING);
        connection
            .change_property8(PropMode::REPLACE, root, name, kind, resource.as_bytes())
            .unwrap()
            .check()
            .unwrap();
        let mut program = Program::on(&server, SCENE);
        let window = program.focused(&server);
        assert_eq!(size_of(&server, &window), [320, 256], "{value}");
        program.up_and_quit(&server);
    }
}

#[test]
fn screens_of_every_depth_show_it_or_say_what_they_lack() {
    for depth in ["15", "16", "24", "30"] {
        let server = XServer::new(&["-screen", "0", &format!("800x600x{depth}")]);
        let mut program = Program::on(&server, SCENE);
        let window = program.focused(&server);
        shows(&program, &server, &window);
        // An odd width, so that rows are padded.
        server.xdotool(&["windowsize", &window, "333", "211"]);
        wait_for("the size", || (size_of(&server, &window) == [333, 211]).then_some(()));
        shows(&program, &server, &window);
        program.up_and_quit(&server);
    }
    let server = XServer::new(&["-cc", "4", "-screen", "0", "800x600x8"]);
    let mut program = Program::on(&server, SCENE);
    let window = program.focused(&server);
    shows(&program, &server, &window);
    program.up_and_quit(&server);

    let screens = [
        ("3", "8", "8 bits a pixel of a palette"),
        ("1", "8", "8 bits a pixel of grey"),
        ("5", "24", "by a table"),
    ];
    for (class, depth, words) in screens {
        let server = XServer::new(&["-cc", class, "-screen", "0", &format!("800x600x{depth}")]);
        let said = Program::on(&server, SCENE).refused();
        assert!(said.contains(words) && said.contains("fix: use a screen of TrueColor"), "{said}");
    }
    let server = XServer::new(&["-screen", "0", "800x600x24", "-extension", "RANDR"]);
    let said = Program::on(&server, SCENE).refused();
    assert!(
        said.contains("no extension RANDR")
            && said.contains("fix: start it without `-extension RANDR`"),
        "{said}"
    );
}

#[test]
fn pictures_of_any_size_go_through_every_connection() {
    // From more than 16 MiB and 8K down, and back. Both extensions are what large pictures go by.
    let cases: [(&[&str], &[[&str; 2]]); 4] = [
        (&[], &[["3441", "1440"], ["320", "256"]]),
        (&["-extension", "MIT-SHM"], &[["3441", "1440"], ["1", "1"], ["7680", "4320"]]),
        (&["-extension", "BIG-REQUESTS"], &[["3441", "1440"]]),
        (
            &["-extension", "MIT-SHM", "-extension", "BIG-REQUESTS"],
            &[["3441", "1440"], ["320", "256"]],
        ),
    ];
    for (extensions, sizes) in cases {
        let server = XServer::new(&[&["-screen", "0", "7680x4320x24"], extensions].concat());
        let mut program = Program::on(&server, SCENE);
        let window = program.focused(&server);
        for size in sizes {
            server.xdotool(&["windowsize", &window, size[0], size[1]]);
            let numbers = size.map(|side| side.parse::<u32>().unwrap());
            wait_for("the size", || (size_of(&server, &window) == numbers).then_some(()));
            shows(&program, &server, &window);
        }
        program.up_and_quit(&server);
    }
}

#[test]
fn pictures_come_where_memory_cannot_be_shared() {
    // A limit to the size of files holds for shared memory too, and beyond it a signal ends the
    // process.
    let limited: Setting = &|command| {
        let limit = libc::rlimit { rlim_cur: 100_000, rlim_max: 100_000 };
        // SAFETY: between fork and exec only a system call is made.
        unsafe {
            command.pre_exec(move || match libc::setrlimit(libc::RLIMIT_FSIZE, &raw const limit) {
                0 => Ok(()),
                _ => Err(std::io::Error::last_os_error()),
            })
        }
    };
    // A network's connection, such as that of ssh, passes no descriptors.
    for (host, set) in [("", limited), ("127.0.0.1", &|command| command)] {
        let server = XServer::new(&[&SCREEN[..], &["-listen", "tcp", "-ac"]].concat());
        let name = format!("{host}{}", server.display);
        let mut program = Program::view(SCENE, |command| set(command.env("DISPLAY", &name)));
        let window = program.focused(&server);
        server.xdotool(&["windowsize", &window, "1200", "1000"]);
        wait_for("the size", || (size_of(&server, &window) == [1200, 1000]).then_some(()));
        shows(&program, &server, &window);
        program.up_and_quit(&server);
    }
}

#[test]
fn a_window_that_is_taken_away_is_the_end() {
    let server = XServer::new(&SCREEN);
    let (connection, _) = RustConnection::connect(Some(&server.display)).unwrap();
    let ways: [&dyn Fn(u32); 2] = [
        // As xdotool windowclose, and as xkill.
        &|window| connection.destroy_window(window).unwrap().check().unwrap(),
        &|window| connection.kill_client(window).unwrap().check().unwrap(),
    ];
    for take_away in ways {
        for drawing in [false, true] {
            let mut program =
                Program::on(&server, &if drawing { endless() } else { SCENE.to_owned() });
            let window = program.focused(&server);
            if !drawing {
                shows(&program, &server, &window);
            }
            take_away(window.parse().unwrap());
            program.lost("another program has destroyed it");
            program.no_litter();
        }
    }
}

#[test]
fn a_server_that_dies_is_the_end() {
    for round in 0..6 {
        let mut server = XServer::new(&SCREEN);
        let mut program =
            Program::on(&server, &if round % 3 == 1 { endless() } else { SCENE.to_owned() });
        let window = program.focused(&server);
        match round % 3 {
            0 => shows(&program, &server, &window),
            1 => sleep(Duration::from_millis(300)),
            _ => {
                // While it is dragged: xdotool ends when the server does.
                let mut moves =
                    vec!["mousemove", "--window", &window, "100", "100", "mousedown", "1"];
                let places: Vec<String> = (0..3000).map(|k| (10 + k % 300).to_string()).collect();
                for place in &places {
                    moves.extend(["mousemove", "--window", &window, place, place]);
                }
                let mut command = Command::new("xdotool");
                let mut dragging = start(
                    command.args(moves).env("DISPLAY", &server.display).stderr(Stdio::null()),
                    "xdotool",
                );
                sleep(Duration::from_millis(150 + 40 * round));
                server.process.kill().unwrap();
                let _ = dragging.wait();
            }
        }
        server.process.kill().unwrap();
        program.lost("the X server does not answer any more");
        program.no_litter();
    }
}

#[test]
fn a_long_picture_does_not_keep_the_window_open() {
    let server = XServer::new(&SCREEN);
    let scene = endless();
    for key in ["q", "Escape"] {
        let mut program = Program::on(&server, &scene);
        let window = program.focused(&server);
        sleep(Duration::from_millis(500));
        let title = server.xdotool(&["getwindowname", &window]);
        assert!(
            title.contains("picture 0 "),
            "this scene is no longer slow enough for this test: {title}"
        );
        // A picture that is wanted, and never comes.
        server.xdotool(&["key", "s"]);
        let start = Instant::now();
        server.xdotool(&["key", key]);
        let (code, said) = program.end();
        assert_eq!(code, Some(0), "{said}");
        // A second is promised; the rest is for machines under load.
        assert!(start.elapsed() < Duration::from_secs(5), "{:?}", start.elapsed());
        assert!(said.contains("screenshot was drawn; it was not saved"), "{said}");
        program.no_litter();
    }
}

#[test]
fn cameras_are_not_lost_where_standard_output_takes_none() {
    let server = XServer::new(&SCREEN);
    let full: Setting =
        &|command| command.stdout(File::options().write(true).open("/dev/full").unwrap());
    let left: Setting = &|command| command.stdout(Stdio::piped());
    let closed: Setting = &|command| {
        // SAFETY: between fork and exec only a system call is made.
        unsafe {
            command.pre_exec(|| match libc::close(1) {
                0 => Ok(()),
                _ => Err(std::io::Error::last_os_error()),
            })
        }
    };
    for (set, words) in [(full, "No space left"), (left, "Broken pipe"), (closed, "closed")] {
        let mut program =
            Program::view(SCENE, |command| set(command.env("DISPLAY", &server.display)));
        drop(program.process.stdout.take());
        let window = program.focused(&server);
        shows(&program, &server, &window);
        for number in 1..=2 {
            server.xdotool(&["key", "s"]);
            wait_for("a screenshot", || {
                (program.stderr().matches("\nnear = ").count() == number).then_some(())
            });
        }
        let said = program.up_and_quit(&server);
        for part in [
            "saved ball-001.png\n",
            "saved ball-002.png\n",
            "standard output does not take the camera: ",
            words,
        ] {
            assert!(said.contains(part), "{part}: {said}");
        }
        assert!(said.contains("[camera]\nprojection = \"orthographic\"\n"), "{said}");
    }
}

/// A Wayland compositor that shows to nobody, with a folder for its socket.
struct Weston {
    process: Child,
    folder: TempDir,
}

impl Weston {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let log = File::create(folder.path().join("log")).unwrap();
        let process = start(
            Command::new("weston")
                .args([
                    "--backend=headless-backend.so",
                    "--socket=test",
                    "--idle-time=0",
                    "--no-config",
                ])
                .env("XDG_RUNTIME_DIR", folder.path())
                .env_remove("DISPLAY")
                .env_remove("WAYLAND_DISPLAY")
                .stdout(log.try_clone().unwrap())
                .stderr(log),
            "weston",
        );
        let mut weston = Self { process, folder };
        wait_for("weston", || {
            let ended = weston.process.try_wait().unwrap();
            assert!(
                ended.is_none(),
                "{}",
                fs::read_to_string(weston.folder.path().join("log")).unwrap()
            );
            UnixStream::connect(weston.socket()).ok()
        });
        weston
    }

    fn socket(&self) -> PathBuf {
        self.folder.path().join("test")
    }

    /// Waits until the program has a window there: what it says of itself stands in the
    /// compositor's list of clients.
    fn shows(&self, program: &mut Program) {
        wait_for("a window", || {
            assert!(
                program.process.try_wait().unwrap().is_none(),
                "it ended: {}",
                program.stderr()
            );
            // Memory for pictures is shared only when there is a window, and something to show in
            // it.
            let maps = fs::read_to_string(format!("/proc/{}/maps", program.process.id())).ok()?;
            maps.contains("memfd:softbuffer").then_some(())
        });
    }
}

impl Drop for Weston {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

#[test]
fn wayland_shows_it_and_may_go_away() {
    let mut weston = Weston::new();
    let socket = weston.socket();
    let by_path: Setting = &|command| command.env("WAYLAND_DISPLAY", &socket);
    let by_name: Setting = &|command| {
        command.env("WAYLAND_DISPLAY", "test").env("XDG_RUNTIME_DIR", socket.parent().unwrap())
    };
    let by_descriptor: Setting =
        &|command| hand_over(command, UnixStream::connect(&socket).unwrap().into());
    // The compositor first, whatever else there is.
    let with_x: Setting =
        &|command| command.env("WAYLAND_DISPLAY", &socket).env("DISPLAY", ":99999");
    let dead_descriptor: Setting =
        &|command| command.env("WAYLAND_SOCKET", "61").env("WAYLAND_DISPLAY", &socket);
    let scaled: Setting = &|command| {
        command
            .env("WAYLAND_DISPLAY", &socket)
            .env("WINIT_X11_SCALE_FACTOR", "nan")
            .env("WAYLAND_SOCKET", "")
    };
    for (k, set) in
        [by_path, by_name, by_descriptor, with_x, dead_descriptor, scaled].into_iter().enumerate()
    {
        let mut program = Program::view(SCENE, set);
        weston.shows(&mut program);
        let said = program.stderr();
        assert!(!said.contains("error") && !said.contains("panicked"), "{k}: {said}");
        let passed = "note: WAYLAND_SOCKET is 61: no descriptor of this number is open; \
            the window is opened on WAYLAND_DISPLAY instead\n";
        assert_eq!(said.contains(passed), k == 4, "{k}: {said}");
    }
    let mut program = Program::view(SCENE, by_path);
    weston.shows(&mut program);
    weston.process.kill().unwrap();
    program.lost("the Wayland compositor does not answer any more");
    program.no_litter();
}

/// A NumPy array of points within a cube of side 1, large enough to be mapped.
fn points(count: usize, seed: u64) -> Vec<u8> {
    let header = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': ({count}, 3), }}");
    let mut bytes = b"\x93NUMPY\x01\x00\x76\x00".to_vec();
    bytes.extend(format!("{header:<117}\n").bytes());
    let mut bits = seed;
    for _ in 0..3 * count {
        bits = bits.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        bytes.extend(((bits >> 11) as f64 / (1u64 << 53) as f64).to_le_bytes());
    }
    bytes
}

#[test]
fn arrays_that_change_leave_the_last_picture() {
    let server = XServer::new(&SCREEN);
    let scene =
        "[image]\nwidth = 300\nheight = 200\n[[spheres]]\ncenters = \"c.npy\"\nradius = 0.01\n";
    type Change = fn(&Path);
    let changes: [Change; 4] = [
        |path| fs::write(path, points(100, 2)).unwrap(),
        |path| fs::write(path, points(50_000, 3)).unwrap(),
        |path| File::options().write(true).open(path).unwrap().set_len(4096).unwrap(),
        |path| {
            // One number in the middle.
            let mut bytes = fs::read(path).unwrap();
            bytes[700_000..700_008].copy_from_slice(&f64::NAN.to_le_bytes());
            fs::write(path, bytes).unwrap();
        },
    ];
    for change in changes {
        let array = tempfile::tempdir().unwrap();
        let path = array.path().join("c.npy");
        fs::write(&path, points(50_000, 1)).unwrap();
        let scene = scene.replace("c.npy", path.to_str().unwrap());
        let mut program = Program::on(&server, &scene);
        let window = program.focused(&server);
        let first = program.render([300, 200]);
        shows(&program, &server, &window);
        change(&path);
        server.xdotool(&["key", "o"]);
        let title = wait_for("the title", || {
            assert!(
                program.process.try_wait().unwrap().is_none(),
                "it ended: {}",
                program.stderr()
            );
            let title = server.xdotool(&["getwindowname", &window]);
            title.contains("has changed on the disk").then_some(title)
        });
        assert!(!title.contains("picture 2"), "{title}");
        for key in ["f", "o", "s", "r"] {
            server.xdotool(&["key", key]);
        }
        wait_for("the screenshot's refusal", || {
            program.stderr().contains("no screenshot was saved").then_some(())
        });
        let (_, found, most) = levels(&server, &window);
        assert_eq!(most, [255; 3]);
        assert!(
            found
                .iter()
                .zip(&first)
                .all(|(levels, color)| levels.map(|level| level as u8) == *color)
        );
        let said = program.up_and_quit(&server);
        assert_eq!(said.matches("c.npy").count(), 1, "{said}");
        assert!(said.contains("the window keeps its last picture"), "{said}");
        program.no_litter();
    }
    // A file that is written beside and renamed over is none that changes.
    let array = tempfile::tempdir().unwrap();
    let [path, beside] = ["c.npy", "d.npy"].map(|name| array.path().join(name));
    fs::write(&path, points(50_000, 1)).unwrap();
    let mut program = Program::on(&server, &scene.replace("c.npy", path.to_str().unwrap()));
    let window = program.focused(&server);
    shows(&program, &server, &window);
    fs::write(&beside, points(50_000, 2)).unwrap();
    fs::rename(&beside, &path).unwrap();
    server.xdotool(&["key", "o"]);
    wait_for("a second picture", || {
        server.xdotool(&["getwindowname", &window]).contains("picture 2").then_some(())
    });
    let said = program.up_and_quit(&server);
    assert!(!said.contains("error"), "{said}");
}

#[test]
fn an_array_that_changes_cuts_a_long_picture_short() {
    let server = XServer::new(&SCREEN);
    let array = tempfile::tempdir().unwrap();
    let path = array.path().join("c.npy");
    fs::write(&path, points(50_000, 1)).unwrap();
    let block = format!("[[spheres]]\ncenters = \"{}\"\nradius = 0.01\n", path.display());
    let mut program = Program::on(&server, &(endless() + &block));
    let window = program.focused(&server);
    sleep(Duration::from_millis(500));
    let title = || server.xdotool(&["getwindowname", &window]);
    assert!(
        title().contains("picture 0 "),
        "this scene is no longer slow enough for this test: {}",
        title()
    );
    fs::write(&path, points(50_000, 2)).unwrap();
    let start = Instant::now();
    wait_for("the title", || title().contains("has changed on the disk").then_some(()));
    assert!(start.elapsed() < Duration::from_secs(20), "{:?}", start.elapsed());
    let said = program.up_and_quit(&server);
    assert!(said.contains("c.npy") && said.contains("the window keeps its last picture"), "{said}");
}
