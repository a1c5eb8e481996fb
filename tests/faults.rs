//! What happens around a picture: signals, limits, full and closed outputs; and kills and faults at
//! random moments.
//!
//! [`kills_and_faults`] runs `render`, `merge`, `make`, `check`, `view` and `bench`, and ends them
//! or takes something away from them at random moments. Afterwards every file is the old one or the
//! new one, whole; nothing else is left; exit codes are those of `--help`.
//! `PLANISPHERE_FAULTS=500,200` sets how many kills and faults (60,40), `PLANISPHERE_SEED` repeats
//! a run.
#![cfg(target_os = "linux")]

use std::{
    collections::BTreeMap,
    fs::{self, File},
    io::{BufRead, BufReader, Read},
    os::unix::{fs::PermissionsExt, process::ExitStatusExt},
    path::Path,
    process::{Child, Command, ExitStatus, Output, Stdio},
    thread::sleep,
    time::{Duration, Instant},
};

use rustix::process::{Pid, Signal, kill_process};
use tempfile::TempDir;

const P: &str = env!("CARGO_BIN_EXE_planisphere");

const SCENE: &str = "
[camera]
view = [1, 0, 0]
width = 6
[image]
width = 32
height = 24
[[sphere]]
center = [5, 0, 0]
radius = 1.5
color = '#ff0000'
";

/// A second, and what a machine under load adds to it.
const AT_ONCE: Duration = Duration::from_millis(2500);

fn shell(folder: &Path, script: &str) -> Output {
    let mut command = Command::new("sh");
    command
        .args(["-c", script])
        .current_dir(folder)
        .env("P", P)
        .env("TMPDIR", folder)
        .env_remove("NO_COLOR");
    command.stdin(Stdio::null()).output().expect("there is a shell")
}

/// A folder with `s.toml`, and a cloud in `cloud` that takes a while to draw in a large picture.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("s.toml"), SCENE).unwrap();
    let made = shell(folder.path(), "$P make cloud cloud --count 3000 && chmod -R a+rX .");
    assert!(made.status.success());
    folder
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<_> =
        entries.map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// Names that no run may leave behind.
fn litter(folder: &Path) -> Vec<String> {
    names(folder).into_iter().filter(|name| name.contains("planisphere-")).collect()
}

fn is_root() -> bool {
    rustix::process::geteuid().is_root()
}

fn signal(child: &Child, signal: Signal) {
    kill_process(Pid::from_child(child), signal).expect("it has not been waited for");
}

fn wait(child: &mut Child, patience: Duration, what: &str) -> ExitStatus {
    let start = Instant::now();
    loop {
        if let Some(status) = child.try_wait().unwrap() {
            return status;
        }
        assert!(start.elapsed() < patience, "{what} still runs after {patience:?}");
        sleep(Duration::from_millis(2));
    }
}

/// Runs scripts, each of which must end with a code and these words, and leave no litter.
fn try_all(cases: &[(&str, i32, &[&str])]) {
    for (script, code, words) in cases {
        let folder = folder();
        let output = shell(folder.path(), script);
        let said = format!(
            "{}{}",
            String::from_utf8_lossy(&output.stderr),
            String::from_utf8_lossy(&output.stdout)
        );
        assert_eq!(output.status.code(), Some(*code), "{script}: {said}");
        for word in *words {
            assert!(said.contains(word), "{script}: lacks {word:?}: {said}");
        }
        assert!(litter(folder.path()).is_empty(), "{script}: {:?}", names(folder.path()));
    }
}

/// Commands that take longer than a second.
const LONG: [&str; 5] = [
    "exec $P render cloud/scene.toml -o out.png --ids ids.npy --size 20000x20000 --device cpu",
    "exec $P render cloud/scene.toml -o - --size 20000x20000 --device cpu > /dev/null",
    "exec $P render cloud/scene.toml -o none --depth - --size 20000x20000 --device cpu > /dev/null",
    "exec $P make cloud big --count 1e8",
    "exec $P bench speed --scene cloud/scene.toml --device cpu --frames 1000 --runs 1000 --size \
     2000x2000",
];

#[test]
fn signals_end_every_command_at_once_and_leave_nothing() {
    for (k, script) in LONG.iter().enumerate() {
        for (number, with) in
            [Signal::INT, Signal::TERM, Signal::HUP, Signal::QUIT].into_iter().enumerate()
        {
            let folder = folder();
            fs::write(folder.path().join("out.png"), "old").unwrap();
            let mut command = Command::new("sh");
            command
                .args(["-c", script])
                .current_dir(folder.path())
                .env("P", P)
                .env("TMPDIR", folder.path());
            let mut child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
            sleep(Duration::from_millis(60 + 170 * (k as u64 + number as u64)));
            signal(&child, with);
            let status = wait(&mut child, AT_ONCE, script);
            assert_eq!(status.signal(), Some(with.as_raw()), "{script}: {status}");
            let left: Vec<_> =
                names(folder.path()).into_iter().filter(|name| name != "big").collect();
            assert_eq!(left, ["cloud", "out.png", "s.toml"], "{script} after {with:?}");
            assert_eq!(fs::read(folder.path().join("out.png")).unwrap(), b"old", "{script}");
        }
    }
}

/// Whether a process of this number has ended; a zombie has.
fn has_ended(id: u32) -> bool {
    let status = fs::read_to_string(format!("/proc/{id}/stat")).unwrap_or_default();
    status.is_empty() || status.contains(") Z ")
}

#[test]
fn children_end_with_the_measurement() {
    let folder = folder();
    let mut bench = Command::new(P)
        .args(["bench", "time", "--", "sh", "-c", "echo $$ > id; exec sleep 100"])
        .current_dir(folder.path())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let start = Instant::now();
    let id = loop {
        let text = fs::read_to_string(folder.path().join("id")).unwrap_or_default();
        if let Ok(id) = text.trim().parse::<u32>() {
            break id;
        }
        assert!(start.elapsed() < Duration::from_secs(60), "the command was not run");
        sleep(Duration::from_millis(5));
    };
    assert!(!has_ended(id));
    signal(&bench, Signal::TERM);
    wait(&mut bench, AT_ONCE, "bench time");
    let start = Instant::now();
    while !has_ended(id) {
        assert!(start.elapsed() < AT_ONCE, "the child goes on");
        sleep(Duration::from_millis(5));
    }
}

/// `nohup` ignores SIGHUP for what it starts, and shells ignore SIGINT for what they start in the
/// background: so that the terminal's does not reach it. Who sends one to such a process means it.
#[test]
fn an_ignored_signal_stays_ignored_unless_an_interrupt_is_sent() {
    let folder = folder();
    let script =
        "trap '' HUP INT; exec $P render cloud/scene.toml -o out.png --size 3000x2000 --device cpu";
    let mut command = Command::new("sh");
    command.args(["-c", script]).current_dir(folder.path()).env("P", P).stderr(Stdio::null());
    let mut child = command.spawn().unwrap();
    sleep(Duration::from_millis(300));
    signal(&child, Signal::HUP);
    let status = wait(&mut child, Duration::from_secs(120), script);
    assert!(status.success(), "{status}");
    assert!(image::open(folder.path().join("out.png")).is_ok());

    let script = "$P render cloud/scene.toml -o none --ids i.npy --size 16000x12000 --device cpu & \
                  sleep 0.2; kill -INT $!; wait $!; test $? = 130";
    let start = Instant::now();
    let output = shell(folder.path(), script);
    assert!(output.status.success() && start.elapsed() < Duration::from_secs(4), "{output:?}");
    assert!(!folder.path().join("i.npy").exists() && litter(folder.path()).is_empty());
}

#[test]
fn what_a_killed_run_left_is_removed_and_nothing_else() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    // A name that no live run holds, as a kill between two system calls leaves it; one that a live
    // run holds.
    let boot = fs::read("/proc/sys/kernel/random/boot_id").unwrap();
    let tag = boot
        .iter()
        .fold(0x811c_9dc5, |hash: u32, &b| (hash ^ u32::from(b)).wrapping_mul(0x0100_0193));
    let (dead, live) =
        (format!(".planisphere-{tag:08x}-0.tmp"), format!(".planisphere-{tag:08x}-1.tmp"));
    for name in [&dead, &live, ".planisphere-notes.txt"] {
        fs::write(at(name), "x").unwrap();
    }
    let held = File::open(at(&live)).unwrap();
    rustix::fs::flock(&held, rustix::fs::FlockOperation::LockExclusive).unwrap();
    for script in ["$P render s.toml -o a.png", "$P render s.toml -o none --ids a.npy"] {
        assert!(shell(folder.path(), script).status.success());
        assert_eq!(litter(folder.path()), [live.as_str(), ".planisphere-notes.txt"]);
        fs::write(at(&dead), "x").unwrap();
    }
    drop(held);
    assert!(shell(folder.path(), "$P make cloud . --count 10").status.success());
    assert_eq!(litter(folder.path()), [".planisphere-notes.txt"]);
    // The folder of a measurement that was killed.
    let old = at(&format!(".planisphere-{tag:08x}-2.tmp"));
    fs::create_dir(&old).unwrap();
    fs::write(old.join("scene.toml"), "x").unwrap();
    let script = "$P bench speed --scene s.toml --device cpu --frames 1 --runs 1 --size 50x50 \
                  --no-baselines";
    assert!(shell(folder.path(), script).status.success());
    assert!(
        !old.exists() && litter(folder.path()) == [".planisphere-notes.txt"],
        "{:?}",
        litter(folder.path())
    );
}

#[test]
fn limits_are_told_in_words() {
    try_all(&[
        // Files that are too large: 512 or 1024 bytes a block, by shell.
        (
            "ulimit -f 8; \
             exec $P render s.toml -o a.npy.png --ids a.npy --size 900x900 --device cpu",
            4,
            &["too large"],
        ),
        (
            "ulimit -f 8; exec $P render s.toml -o none --ids - --size 900x900 --device cpu > a",
            4,
            &["too large"],
        ),
        ("ulimit -f 8; exec $P make cloud m --count 90000", 4, &["too large"]),
        (
            "echo old > a.npy; ulimit -f 8; $P render s.toml -o none --ids a.npy --size 900x900 \
--device cpu
            rc=$?; echo old | cmp - a.npy || rc=77; exit $rc",
            4,
            &["too large"],
        ),
        // No descriptors: the loader of programs needs a few before any word can be said.
        (
            "ulimit -n 4; $P render s.toml -o a.png --device cpu; rc=$?; test -e a.png && rc=77; \
             exit $rc",
            4,
            &["Too many open files"],
        ),
        (
            "for n in 4 5 6 7 8 9 10 11 12 14 16 20 24; do for d in cpu gpu; do (ulimit -n $n
            exec $P render cloud/scene.toml -o a.png --ids a.npy --device $d); rc=$?; test $rc -le \
4 || exit $rc
            test $rc = 0 || test ! -e a.png -a ! -e a.npy || exit 77; rm -f a.*; done; done",
            0,
            &["Too many open files"],
        ),
        // Full, closed.
        ("exec $P render s.toml -o /dev/full", 4, &["No space left"]),
        ("exec $P render s.toml -o none --ids - > /dev/full", 4, &["No space left"]),
        ("exec $P render s.toml -o none --depth - > /dev/full", 4, &["No space left"]),
        ("exec $P render s.toml -o none --visibility - > /dev/full", 4, &["No space left"]),
        ("exec $P info > /dev/full", 4, &["No space left"]),
        ("exec $P completions zsh > /dev/full", 4, &["No space left"]),
        ("exec $P bench time --runs 1 -- true > /dev/full", 4, &["No space left"]),
        ("exec $P bench time --runs 1 -- true >&-", 4, &["standard output is closed"]),
        ("exec $P bench speed --quick --device cpu >&-", 4, &["standard output is closed"]),
        ("exec $P bench accuracy --quick --device cpu >&-", 4, &["standard output is closed"]),
    ]);
}

#[test]
fn a_pipe_that_does_not_block_is_waited_for() {
    let folder = folder();
    let (mut reader, writer) = std::io::pipe().unwrap();
    rustix::fs::fcntl_setfl(&writer, rustix::fs::OFlags::NONBLOCK).unwrap();
    let args = ["render", "s.toml", "-o", "none", "--device", "cpu", "--size", "600x600", "--ids"];
    let mut child = Command::new(P)
        .args(args)
        .arg("-")
        .current_dir(folder.path())
        .stdout(writer)
        .spawn()
        .unwrap();
    // Many times what a pipe holds.
    sleep(Duration::from_millis(700));
    let mut bytes = Vec::new();
    reader.read_to_end(&mut bytes).unwrap();
    assert!(child.wait().unwrap().success());
    assert!(
        Command::new(P)
            .args(args)
            .arg("a.npy")
            .current_dir(folder.path())
            .status()
            .unwrap()
            .success()
    );
    assert!(bytes == fs::read(folder.path().join("a.npy")).unwrap(), "{} bytes", bytes.len());
}

/// Where a file must have a name from the beginning: without /proc none can be given one later.
/// Needs root.
#[test]
fn named_temporary_files_are_removed() {
    let without = "exec unshare -m sh -c 'mount -t tmpfs x /proc && exec $P";
    if !shell(Path::new("/"), "unshare -m true").status.success() {
        eprintln!("named temporary files were not tried: `unshare -m` is not allowed here");
        return;
    }
    let folder = folder();
    let long = format!(
        "{without} render cloud/scene.toml -o none --ids out.npy --size 20000x20000 --device cpu'"
    );
    for with in [Signal::INT, Signal::TERM, Signal::HUP, Signal::KILL] {
        let mut command = Command::new("sh");
        command.args(["-c", &long]).current_dir(folder.path()).env("P", P).stderr(Stdio::null());
        let mut child = command.spawn().unwrap();
        let start = Instant::now();
        while litter(folder.path()).is_empty() {
            assert!(start.elapsed() < Duration::from_secs(60), "no temporary file after a minute");
            sleep(Duration::from_millis(5));
        }
        // A run beside it leaves it alone.
        let beside = format!("{without} render s.toml -o none --ids a.npy'");
        assert!(shell(folder.path(), &beside).status.success());
        assert_eq!(litter(folder.path()).len(), 1);
        signal(&child, with);
        assert_eq!(wait(&mut child, AT_ONCE, &long).signal(), Some(with.as_raw()));
        assert_eq!(litter(folder.path()).len(), usize::from(with == Signal::KILL), "{with:?}");
        assert!(shell(folder.path(), &beside).status.success());
        assert!(litter(folder.path()).is_empty());
    }
    // Old files, new files, more than waits in memory, and no room.
    let script = format!(
        "echo old > b.png; chmod 640 b.png; ({without} render s.toml -o b.png --ids c.npy --size \
5000x4000 --device cpu') &&
        $P render s.toml -o d.png --ids e.npy --size 5000x4000 --device cpu && cmp b.png d.png && \
cmp c.npy e.npy &&
        test $(stat -c %a b.png) = 640"
    );
    let output = shell(folder.path(), &script);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(litter(folder.path()).is_empty());
}

/// Mesa's cache of shaders among the rest, which on a full disk can end the process. Needs root,
/// for the disk.
#[test]
fn a_full_disk_is_told_in_words() {
    if !shell(Path::new("/"), "unshare -m true").status.success() {
        eprintln!("a full disk was not tried: `unshare -m` is not allowed here");
        return;
    }
    let full = |command: &str| {
        format!(
            "mkdir t; exec unshare -m sh -c 'mount -t tmpfs -o size=64k x t && echo old > t/a.npy
             (head -c 1M /dev/zero > t/fill; true) 2>/dev/null; {command}; rc=$?
             ls -A t | grep planisphere- && rc=77; echo old | cmp - t/a.npy || rc=78; exit $rc'"
        )
    };
    let cases = [
        (
            "XDG_CACHE_HOME=$PWD/t HOME=$PWD/t $P render s.toml -o none --ids /dev/null --device \
             gpu",
            0,
            &[][..],
        ),
        ("$P render s.toml -o none --ids t/a.npy --device cpu", 4, &["No space left"]),
        ("$P render s.toml -o none --ids - --device cpu > t/b", 4, &["No space left"]),
        (
            "$P render s.toml -o t/b.png --ids t/a.npy --size 500x500 --device cpu; test ! -s \
             t/b.png",
            0,
            &["No space left"],
        ),
        ("$P make cloud t/m --count 9000", 4, &["No space left"]),
        (
            "TMPDIR=$PWD/t $P bench speed --scene cloud/scene.toml --device cpu --frames 1 --runs \
             1 --size 50x50",
            4,
            &["No space left"],
        ),
    ];
    for (command, code, words) in cases {
        try_all(&[(&full(command), code, words)]);
    }
}

/// As somebody who may start no thread. Root may always.
#[test]
fn no_thread_to_be_had_is_told_in_words() {
    if !is_root() {
        eprintln!("a lack of threads was not tried: this needs root, to become somebody else");
        return;
    }
    // A user of its own for each: limits count all processes of a user. A copy of the program:
    // other users may not get to where it is built.
    let mut user = 61300;
    let mut nobody = |before: &str, limit: usize| {
        user += 1;
        format!(
            "cp $P p; chmod 755 . p; {before} exec setpriv --reuid {user} --regid {user} \
             --clear-groups prlimit --nproc={limit} ./p"
        )
    };
    for command in ["render s.toml -o -", "info", "merge s.toml"] {
        let words = &["no threads", "RAYON_NUM_THREADS=1"];
        try_all(&[(&format!("{} {command}", nobody("export RAYON_NUM_THREADS=2;", 2)), 3, words)]);
        try_all(&[(&format!("{} {command}", nobody("", 1)), 3, words)]);
    }
    // The fix, obeyed.
    let script = format!(
        "{} render s.toml -o - --device cpu | wc -c",
        nobody("export RAYON_NUM_THREADS=1;", 2)
    );
    try_all(&[(&script, 0, &["1"])]);
    try_all(&[(&format!("{} make cloud m 2>&1 | grep -q denied", nobody("", 1)), 0, &[])]);
}

// -------------------------------------------------------------------------------------------------

/// SplitMix64.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }

    fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// A command, and the files that it writes.
struct Job {
    name: &'static str,
    args: Vec<String>,
    /// Each target as it is after a whole run.
    new: BTreeMap<String, Vec<u8>>,
    /// Each target as another run left it.
    old: BTreeMap<String, Vec<u8>>,
    /// How long a whole run takes.
    time: Duration,
}

impl Job {
    /// Runs it twice: with `before` for the old files, with `args` for the new ones.
    fn new(folder: &Path, name: &'static str, args: &str, before: &str, targets: &[&str]) -> Self {
        let run = |args: &str| -> BTreeMap<String, Vec<u8>> {
            let output = shell(folder, &format!("exec $P {args}"));
            assert!(output.status.success(), "{args}: {}", String::from_utf8_lossy(&output.stderr));
            let read = |target: &&str| (target.to_string(), fs::read(folder.join(target)).unwrap());
            targets.iter().map(read).collect()
        };
        let old = run(before);
        let start = Instant::now();
        let new = run(args);
        let time = start.elapsed();
        Self { name, args: args.split(' ').map(Into::into).collect(), new, old, time }
    }

    /// Puts the old files into place, or none.
    fn prepare(&self, folder: &Path, old: bool) {
        // Whoever's they are after the last run.
        for (name, bytes) in &self.old {
            let _ = fs::remove_file(folder.join(name));
            if old {
                fs::write(folder.join(name), bytes).unwrap();
            }
        }
        for folder in [folder, &folder.join("made")] {
            fs::set_permissions(folder, fs::Permissions::from_mode(0o755)).unwrap();
        }
    }

    /// Every file is the old one or the new one; all are new after success. How many are new.
    fn check(&self, folder: &Path, old: bool, success: bool, what: &str) -> usize {
        let mut count = 0;
        for (name, new) in &self.new {
            match fs::read(folder.join(name)) {
                Ok(bytes) if bytes == *new => count += 1,
                Ok(bytes) => {
                    assert!(
                        old && bytes == self.old[name] && !success,
                        "{what}: {name} is {} bytes",
                        bytes.len()
                    );
                }
                Err(error) => assert!(!old && !success, "{what}: {name}: {error}"),
            }
        }
        count
    }
}

/// An X server that shows to nobody, for `view`.
struct Server(Child, String);

impl Server {
    fn new() -> Self {
        let mut server = Command::new("Xvfb")
            .args(["-displayfd", "1", "-screen", "0", "640x480x24", "-nolisten", "tcp", "-noreset"])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("this test needs Xvfb; on Debian: apt-get install xvfb, or run tests/run.sh");
        let mut line = String::new();
        BufReader::new(server.stdout.take().unwrap()).read_line(&mut line).unwrap();
        Self(server, format!(":{}", line.trim()))
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        signal(&self.0, Signal::TERM);
        let _ = self.0.wait();
    }
}

/// Everything that is ended and starved, and the counts.
struct Trial {
    folder: TempDir,
    jobs: Vec<Job>,
    server: Server,
    random: Random,
    counts: BTreeMap<String, usize>,
    slowest: Duration,
}

impl Trial {
    fn new(seed: u64) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let at = folder.path();
        fs::create_dir(at.join("tmp")).unwrap();
        fs::write(at.join("s.toml"), SCENE).unwrap();
        let prepared = shell(
            at,
            "$P make cloud cloud --count 3000 && $P make cloud other --count 2000 &&
            $P render cloud/scene.toml -o none --visibility a.npz --size 240x200 --region \
0,0,240,90 --device cpu &&
            $P render cloud/scene.toml -o none --visibility b.npz --size 240x200 --region \
0,90,240,110 --device cpu &&
            $P render other/scene.toml -o none --visibility c.npz --size 240x200 --device cpu && \
chmod -R a+rX .",
        );
        assert!(prepared.status.success(), "{}", String::from_utf8_lossy(&prepared.stderr));
        let render = |scene: &str| {
            format!(
                "render {scene}/scene.toml -o o.png --ids o.npy --visibility o.npz --size 300x200 \
                 --device cpu"
            )
        };
        let bless = |scene: &str| {
            format!("check {scene}/scene.toml --golden k.png --size 300x200 --device cpu --bless")
        };
        let jobs = vec![
            Job::new(
                at,
                "render",
                &render("cloud"),
                &render("other"),
                &["o.png", "o.npy", "o.npz"],
            ),
            Job::new(
                at,
                "merge",
                "merge a.npz b.npz -o m.png --depth m.npy --visibility m.npz",
                "merge c.npz -o m.png --depth m.npy --visibility m.npz",
                &["m.png", "m.npy", "m.npz"],
            ),
            Job::new(
                at,
                "make",
                "make lattice made --count 40000",
                "make cloud made --count 30000",
                &["made/centers.npy", "made/radii.npy", "made/colors.npy", "made/scene.toml"],
            ),
            Job::new(at, "check", &bless("cloud"), &bless("other"), &["k.png"]),
        ];
        let random = Random(seed);
        Self {
            folder,
            jobs,
            server: Server::new(),
            random,
            counts: BTreeMap::new(),
            slowest: Duration::ZERO,
        }
    }

    fn at(&self) -> &Path {
        self.folder.path()
    }

    fn count(&mut self, what: String) {
        *self.counts.entry(what).or_default() += 1;
    }

    fn no_litter(&self, what: &str) {
        for folder in ["", "made", "tmp"] {
            let left = litter(&self.at().join(folder));
            assert!(left.is_empty(), "{what} left {left:?} in ./{folder}");
        }
    }

    fn start(&self, args: &[String]) -> Child {
        let mut command = Command::new(P);
        command
            .args(args)
            .current_dir(self.at())
            .env("TMPDIR", self.at().join("tmp"))
            .env("DISPLAY", &self.server.1);
        command.env_remove("WAYLAND_DISPLAY").env_remove("WAYLAND_SOCKET").stdin(Stdio::null());
        command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
    }

    /// Ends a command at a random moment.
    fn kill(&mut self, round: usize) {
        let signals = [
            ("KILL", Signal::KILL),
            ("TERM", Signal::TERM),
            ("INT", Signal::INT),
            ("HUP", Signal::HUP),
        ];
        let (name, with) = signals[self.random.below(signals.len())];
        let old = self.random.below(2) == 0;
        let place = round % 6;
        let job = self.jobs.get(place);
        let (command, args, time) = match job {
            Some(job) => (job.name, job.args.clone(), job.time),
            None if place == 4 => {
                ("view", vec!["view".into(), "cloud/scene.toml".into()], Duration::from_secs(1))
            }
            None => {
                let args = "bench speed --scene s.toml --device cpu --frames 1 --runs 1 --size \
                            60x60 --no-baselines";
                ("bench", args.split(' ').map(Into::into).collect(), Duration::from_millis(300))
            }
        };
        if let Some(job) = job {
            job.prepare(self.at(), old);
        }
        // Half of the moments lie near the end, where files are written.
        let part = 1.15 * self.random.unit();
        let delay = time.mul_f64(if self.random.below(2) == 0 { 0.85 + 0.3 * part } else { part });
        let what = format!("{command} ended by {name} after {delay:?} (round {round})");
        let mut child = self.start(&args);
        if command == "view" && self.random.below(3) > 0 {
            // Screenshots, as soon as there is a window; then the end, while they are drawn and
            // written.
            let press = "w=$(xdotool search --sync --onlyvisible --name '^scene') && xdotool \
                         windowfocus --sync $w key s key s";
            let pressed = Command::new("timeout")
                .args(["20", "sh", "-c", press])
                .env("DISPLAY", &self.server.1)
                .output();
            let pressed = pressed.expect("there is a shell");
            assert!(
                pressed.status.success(),
                "xdotool: {}",
                String::from_utf8_lossy(&pressed.stderr)
            );
            sleep(delay / 3);
        } else {
            sleep(delay);
        }
        let running = child.try_wait().unwrap().is_none();
        let start = Instant::now();
        signal_or_ended(&child, with);
        let status = wait(&mut child, AT_ONCE, &what);
        if running {
            self.slowest = self.slowest.max(start.elapsed());
        }
        let killed = status.signal() == Some(with.as_raw());
        assert!(killed || status.code() == Some(0), "{what}: {status}");
        let new =
            self.jobs.get(place).map(|job| job.check(self.at(), old, status.success(), &what));
        if with != Signal::KILL {
            self.no_litter(&what);
        }
        for picture in names(self.at()).into_iter().filter(|name| name.starts_with("scene-")) {
            let path = self.at().join(picture);
            image::open(&path)
                .unwrap_or_else(|error| panic!("{what}: {}: {error}", path.display()));
            fs::remove_file(path).unwrap();
            self.count("screenshots, whole".into());
        }
        self.follow_up(command, &what);
        let state = match (killed, new) {
            (false, _) => "was done",
            (true, None) => "ended",
            (true, Some(0)) => "nothing new",
            (true, Some(n)) if n == self.jobs[place].new.len() => "all new",
            (true, Some(_)) => "some new",
        };
        self.count(format!("{command} {name}: {state}"));
    }

    /// What a kill has left is removed by the next run that writes there.
    fn follow_up(&mut self, command: &str, what: &str) {
        if litter(self.at()).len()
            + litter(&self.at().join("made")).len()
            + litter(&self.at().join("tmp")).len()
            == 0
        {
            return;
        }
        let next = match command {
            "make" => "render s.toml -o made/next.png --device cpu",
            "bench" => {
                "bench speed --scene s.toml --device cpu --frames 1 --runs 1 --size 20x20 \
                 --no-baselines"
            }
            _ => "render s.toml -o next.png --device cpu",
        };
        let args: Vec<String> = next.split(' ').map(Into::into).collect();
        let status = wait(&mut self.start(&args), Duration::from_secs(60), next);
        assert!(status.success(), "{next} after {what}: {status}");
        self.no_litter(&format!("the run after {what}"));
        self.count("litter removed by the next run".into());
    }

    /// Takes something away from a command.
    fn fault(&mut self, round: usize, root: bool) {
        let place = self.random.below(self.jobs.len());
        let old = self.random.below(2) == 0;
        let unit = self.random.unit();
        let job = &self.jobs[place];
        job.prepare(self.at(), old);
        let args = job.args.join(" ");
        let total: usize = job.new.values().map(Vec::len).sum();
        let nobody = "exec setpriv --reuid 61234 --regid 61234 --clear-groups";
        let (fault, script) = match self.random.below(if root { 9 } else { 6 }) {
            0 => (
                "ulimit -f",
                format!("ulimit -f {}; exec $P {args}", (unit * total as f64 / 512.0) as usize),
            ),
            1 => ("ulimit -n", format!("ulimit -n {}; exec $P {args}", 4 + (unit * 8.0) as usize)),
            2 => (
                "no folder",
                format!(
                    "exec $P {}",
                    args.replace(" m.", " no/m.")
                        .replace(" o.", " no/o.")
                        .replace(" k.", " no/k.")
                        .replace(" made", " s.toml/made")
                ),
            ),
            3 => ("closed", format!("exec $P {args} <&- >&- 2>err")),
            4 => ("read-only", {
                let name = job.new.keys().nth((unit * job.new.len() as f64) as usize).unwrap();
                format!(
                    "test -e {name} || touch {name}.none; chmod a-w {name} 2>/dev/null; $P {args}; \
rc=$?
                    chmod u+w {name} 2>/dev/null; rm -f {name}.none; exit $rc"
                )
            }),
            5 => ("cut inputs", self.cut(&args, unit)),
            6 => ("not permitted", format!("{nobody} $P {args}")),
            7 => ("no threads", {
                let names = job.new.keys().cloned().collect::<Vec<_>>().join(" ");
                let limit = 1 + (unit * 4.0) as usize;
                format!(
                    "chmod 777 . made; chmod 666 {names} 2>/dev/null; {nobody} prlimit \
                     --nproc={limit} $P {args}"
                )
            }),
            _ => ("full disk", {
                // A file system of its own on which everything is done, and which is looked at
                // before it goes.
                let size = (self.jobs[place].old.values().map(Vec::len).sum::<usize>() as f64
                    * 2.0
                    * unit) as usize
                    / 1024;
                format!(
                    "rm -rf disk back; mkdir disk back; exec unshare -m sh -c 'mount -t tmpfs -o \
size=256m x disk &&
                    cp -r s.toml cloud a.npz b.npz disk; mkdir disk/made
                    for f in {}; do test -e $f && cp $f disk/$f; done; cd disk
                    head -c {size}k /dev/zero > room; used=$(du -sk . | cut -f1)
                    mount -o remount,size=${{used}}k . && rm room; $P {args}; rc=$?; rm -rf cloud \
a.npz b.npz
                    cp -r . ../back; exit $rc'",
                    self.jobs[place].new.keys().cloned().collect::<Vec<_>>().join(" ")
                )
            }),
        };
        let what = format!("{args} with {fault}, {unit} (round {round})");
        let output = shell(self.at(), &script);
        let code = output.status.code();
        let words = String::from_utf8_lossy(&output.stderr);
        // 127 is the system's: too few descriptors to load the program.
        let documented =
            matches!(code, Some(0 | 2 | 3 | 4)) || (fault == "ulimit -n" && code == Some(127));
        assert!(documented, "{what}: {}: {words}", output.status);
        assert!(
            code == Some(0) || words.contains("rror") || fault == "closed",
            "{what}: exit {code:?} without words: {words}"
        );
        assert!(!words.contains("panicked"), "{what}: {words}");
        let folder =
            if fault == "full disk" { self.at().join("back") } else { self.at().to_owned() };
        let left = litter(&folder);
        assert!(left.is_empty(), "{what} left {left:?}");
        let success = code == Some(0) && fault != "cut inputs";
        self.jobs[place].check(&folder, old, success, &what);
        self.no_litter(&what);
        let name = self.jobs[place].name;
        self.count(format!("{fault}: {name} ended with {}", code.unwrap_or(-1)));
    }

    /// The command with inputs that are cut short. `make` has none: its folder is a file.
    fn cut(&self, args: &str, unit: f64) -> String {
        let (input, copy) = match args.split(' ').next() {
            Some("render" | "check") => ("cloud/centers.npy", "cp -r cloud cut; f=cut/centers.npy"),
            Some("merge") => ("b.npz", "cp b.npz cut; f=cut"),
            _ => return "touch cut; $P make cloud cut; rc=$?; rm -f cut; exit $rc".into(),
        };
        let length = (fs::metadata(self.at().join(input)).unwrap().len() as f64 * unit) as u64;
        let args = args.replace("cloud/", "cut/").replace("b.npz", "cut");
        format!(
            "rm -rf cut; {copy}; truncate -s {length} $f; $P {args}; rc=$?; rm -rf cut; exit $rc"
        )
    }
}

/// As [`signal`], of a child that may have ended but has not been waited for.
fn signal_or_ended(child: &Child, with: Signal) {
    let _ = kill_process(Pid::from_child(child), with);
}

fn numbers() -> [usize; 2] {
    let text = std::env::var("PLANISPHERE_FAULTS").unwrap_or_else(|_| "60,40".into());
    let read = text
        .split_once(',')
        .and_then(|(a, b)| Some([a.trim().parse().ok()?, b.trim().parse().ok()?]));
    read.unwrap_or_else(|| {
        panic!("PLANISPHERE_FAULTS is {text:?}; write kills,faults such as 500,200")
    })
}

#[test]
fn kills_and_faults() {
    let [kills, faults] = numbers();
    let clock =
        std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap().as_nanos()
            as u64;
    let seed = std::env::var("PLANISPHERE_SEED")
        .map_or(clock, |text| text.parse().expect("PLANISPHERE_SEED is a number"));
    println!("PLANISPHERE_SEED={seed} PLANISPHERE_FAULTS={kills},{faults}");
    let start = Instant::now();
    let mut trial = Trial::new(seed);
    for round in 0..kills {
        trial.kill(round);
    }
    let mounts = is_root() && shell(Path::new("/"), "unshare -m true").status.success();
    if !mounts {
        println!(
            "without full disks, other users and lacks of threads: this needs root and `unshare -m`"
        );
    }
    for round in 0..faults {
        trial.fault(round, mounts);
    }
    for (what, count) in &trial.counts {
        println!("{count:5}  {what}");
    }
    println!(
        "{kills} kills and {faults} faults in {:.0} s; the slowest end took {:.3} s",
        start.elapsed().as_secs_f64(),
        trial.slowest.as_secs_f64()
    );
    assert!(trial.slowest < AT_ONCE);
}
