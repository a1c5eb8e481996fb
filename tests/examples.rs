//! The examples, run as a newcomer would, and short enough to be read at once.

use std::{
    fs,
    io::{BufRead, BufReader, Read, Write},
    net::TcpStream,
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
    sync::Once,
};

/// Examples lie beside the program. `cargo test` builds them, `cargo test --test examples` does
/// not.
fn example(name: &str) -> Command {
    static BUILT: Once = Once::new();
    BUILT.call_once(|| {
        let mut cargo = Command::new(env!("CARGO"));
        cargo.args(["build", "--quiet", "--examples"]).current_dir(env!("CARGO_MANIFEST_DIR"));
        if !cfg!(debug_assertions) {
            cargo.arg("--release");
        }
        assert!(cargo.status().unwrap().success(), "the examples do not build");
    });
    let program = PathBuf::from(env!("CARGO_BIN_EXE_planisphere"));
    let mut command = Command::new(program.with_file_name("examples").join(name));
    command.env("NODEVICE_SELECT", "1");
    command
}

fn lines(name: &str, arguments: &[&Path]) -> Vec<String> {
    let output = example(name).args(arguments).output().unwrap();
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{name}: {errors}");
    String::from_utf8(output.stdout).unwrap().lines().map(str::to_owned).collect()
}

#[test]
fn each_is_short() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples");
    let mut names = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let text = fs::read_to_string(&path).unwrap();
        assert!(text.lines().count() < 40, "{}", path.display());
        names.push(path.file_stem().unwrap().to_string_lossy().into_owned());
    }
    names.sort();
    assert_eq!(names, ["cancel", "embed", "first", "parts", "server"]);
}

#[test]
fn first_saves_a_picture() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("spheres.png");
    let said = lines("first", &[&path]);
    assert!(said.len() == 1 && said[0].starts_with("sphere "), "{said:?}");
    let picture = image::open(&path).unwrap().into_rgb8();
    assert_eq!(picture.dimensions(), (640, 480));
    let seen = picture.pixels().filter(|pixel| pixel.0 != [0; 3]).count();
    assert!(seen > 150_000, "{seen} pixels show a sphere");
}

/// Ends with the test, whatever comes of that.
struct Server(Child);

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

#[test]
fn the_server_serves() {
    let mut child = Server(example("server").arg("3").stdout(Stdio::piped()).spawn().unwrap());
    let mut line = String::new();
    BufReader::new(child.0.stdout.take().unwrap()).read_line(&mut line).unwrap();
    let address = line.trim().trim_start_matches("http://").trim_end_matches('/').to_owned();
    let mut all = Vec::new();
    for _ in 0..3 {
        let mut stream = TcpStream::connect(&address).unwrap();
        stream.write_all(b"GET / HTTP/1.1\r\n\r\n").unwrap();
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer).unwrap();
        let end = answer.windows(4).position(|four| four == b"\r\n\r\n").unwrap();
        let picture = image::load_from_memory(&answer[end + 4..]).unwrap();
        assert_eq!((picture.width(), picture.height()), (320, 240));
        all.push(answer);
    }
    assert!(all[0] != all[1], "the camera turns");
    assert!(child.0.wait().unwrap().success());
}

#[test]
fn a_long_picture_is_cancelled() {
    let said = lines("cancel", &[]);
    assert_eq!(said.last().map(String::as_str), Some("cancelled"), "{said:?}");
    assert!(said.iter().any(|line| line.ends_with(" %")) && said.contains(&"enough".into()));
}

#[test]
fn a_texture_of_a_program_takes_the_picture() {
    let said = lines("embed", &[]);
    assert!(said.len() == 1 && said[0].starts_with("drawn by "), "{said:?}");
}

#[test]
fn parts_are_the_whole() {
    assert_eq!(lines("parts", &[]), ["0 pixels differ"]);
}
