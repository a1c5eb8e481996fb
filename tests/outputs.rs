//! Outputs destroy nothing: every case is a shell's command line, run as a person runs it, in a
//! folder of its own.
//!
//! `$P` is the program. Each folder has `s.toml` (a scene), `n.toml` (one of the arrays `c.npy`,
//! `r.npy`, `k.npy`), `p.npz` and `q.npz` (parts of `s.toml`), `want.png` (its picture), `ids.npy`
//! (its ids), and nothing else.
#![cfg(unix)]

use std::{
    fs,
    path::Path,
    process::{Command, Output, Stdio},
    sync::OnceLock,
};

use tempfile::TempDir;

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
[[sphere]]
center = [4, -1.5, 0.5]
radius = 0.75
color = '#00ff00'
";

const ARRAYS: &str = "
[image]
width = 32
height = 24
[[spheres]]
centers = 'c.npy'
radii = 'r.npy'
colors = 'k.npy'
";

fn npy(descr: &str, shape: &str, data: &[u8]) -> Vec<u8> {
    let header = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}");
    let header = format!("{header:<117}\n");
    [b"\x93NUMPY\x01\x00", &(header.len() as u16).to_le_bytes()[..], header.as_bytes(), data]
        .concat()
}

/// What every folder begins with.
fn template() -> &'static Path {
    static FOLDER: OnceLock<TempDir> = OnceLock::new();
    let folder = FOLDER.get_or_init(|| {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, bytes: &[u8]| fs::write(folder.path().join(name), bytes).unwrap();
        write("s.toml", SCENE.as_bytes());
        write("n.toml", ARRAYS.as_bytes());
        let floats =
            |values: &[f32]| values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<_>>();
        write("c.npy", &npy("<f4", "(2, 3)", &floats(&[0.0, 0.0, 0.0, 1.0, 2.0, 3.0])));
        write("r.npy", &npy("<f4", "(2,)", &floats(&[1.0, 0.5])));
        write("k.npy", &npy("|u1", "(2, 3)", &[255, 0, 0, 0, 0, 255]));
        let output = shell(
            folder.path(),
            "$P render s.toml -o want.png --ids ids.npy --device cpu &&
            $P render s.toml -o none --visibility p.npz --region 0,0,32,10 --device cpu &&
            $P render s.toml -o none --visibility q.npz --region 0,10,32,14 --device cpu",
        );
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        folder
    });
    folder.path()
}

fn shell(folder: &Path, script: &str) -> Output {
    let mut command = Command::new("sh");
    command
        .args(["-c", script])
        .current_dir(folder)
        .env("P", env!("CARGO_BIN_EXE_planisphere"))
        .env_remove("NO_COLOR");
    command.stdin(Stdio::null()).output().expect("there is a shell")
}

/// A case: what is done, the exit code of its last command, words that must be said (on either
/// stream), and what must hold afterwards.
struct Case(&'static str, i32, &'static [&'static str], &'static str);

/// Whether the inputs are as they were, and no temporary file is left.
const KEPT: &str =
    "for f in s.toml n.toml c.npy r.npy k.npy p.npz q.npz; do cmp $f $T/$f || exit 1; done
    ! ls -A | grep planisphere-";

fn try_all(cases: &[Case]) {
    for Case(script, code, words, then) in cases {
        let folder = tempfile::tempdir().unwrap();
        let copy = format!("cp -p {}/* .", template().display());
        assert!(shell(folder.path(), &copy).status.success());
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
        for then in [KEPT, then] {
            let held = shell(folder.path(), &format!("T={}; {then}", template().display()));
            assert!(
                held.status.success(),
                "{script}\nthen not: {then}\n{}{}\nsaid: {said}",
                String::from_utf8_lossy(&held.stdout),
                String::from_utf8_lossy(&held.stderr)
            );
        }
    }
}

#[test]
fn one_file_under_two_names_is_refused() {
    try_all(&[
        Case("$P render s.toml -o a.png --ids ./a.png", 2, &["name it"], "! test -e a.png"),
        Case("$P render s.toml -o a --ids ./a", 2, &["both write", "two names"], "! test -e a"),
        Case(
            "touch a; ln -s a l; $P render s.toml -o a --ids l",
            2,
            &["both write one file, a and l"],
            "! test -s a",
        ),
        Case(
            "ln -s nowhere l; $P render s.toml -o nowhere --ids l",
            2,
            &["both write one file"],
            "! test -e nowhere",
        ),
        Case(
            "touch a; ln a h; $P render s.toml -o a --depth h",
            2,
            &["both write one file"],
            "! test -s a",
        ),
        Case(
            "mkdir d; ln -s d e; $P render s.toml --ids d/x.npy --depth e/x.npy",
            2,
            &["one file"],
            "! test -e s.png",
        ),
        Case(
            "$P render s.toml --ids x.npy --depth $PWD/x.npy",
            2,
            &["one file"],
            "! test -e s.png",
        ),
        Case("$P render s.toml -o a --stats > a", 2, &["-o", "--stats", "one file"], "! test -s a"),
        Case("$P render s.toml -o - --stats", 2, &["both want standard output"], "true"),
        Case("$P render s.toml -o /dev/stdout --ids -", 2, &["both want standard output"], "true"),
        Case(
            "$P render s.toml -o /dev/fd/3 --ids /proc/self/fd/3 3>a",
            2,
            &["both want"],
            "! test -s a",
        ),
        Case(
            "$P render s.toml -o /dev/fd/3 --ids /dev/fd/4 3>a 4>>a",
            2,
            &["one file"],
            "! test -s a",
        ),
        Case("$P render s.toml -o /dev/fd/3 --ids a 3>a", 2, &["one file"], "! test -s a"),
        Case("$P merge p.npz q.npz -o a --ids ./a", 2, &["both write one file"], "! test -e a"),
        Case("$P merge p.npz q.npz -o a --stats > a", 2, &["one file"], "! test -s a"),
        Case(
            "mkdir m; touch m/r; ln -s r m/centers.npy; ln -s r m/radii.npy; $P make cloud m \
             --force",
            2,
            &["centers.npy and radii.npy both write one file"],
            "! test -s m/r",
        ),
        // Where nothing is kept, nothing is lost.
        Case("$P render s.toml -o /dev/null --ids /dev/null --stats > /dev/null", 0, &[], "true"),
    ]);
}

#[test]
fn no_input_is_replaced() {
    try_all(&[
        Case("$P render s.toml -o s.toml", 2, &["s.toml"], "true"),
        Case("cp s.toml s; $P render s -o s", 2, &["would replace s, an input"], "cmp s s.toml"),
        Case("cp s.toml s; ln -s s l; $P render l -o s", 2, &["an input"], "cmp s s.toml"),
        Case("cp s.toml s; ln s h; $P render s -o h", 2, &["an input"], "cmp s s.toml"),
        Case("cp s.toml s; $P render - -o s < s", 2, &["standard input"], "cmp s s.toml"),
        Case("cp s.toml s; $P render /dev/fd/4 -o s 4<s", 2, &["an input"], "cmp s s.toml"),
        Case(
            "for a in c r k; do $P render n.toml -o none --depth $a.npy; done",
            2,
            &["would replace c.npy", "r.npy", "k.npy"],
            "true",
        ),
        Case(
            "ln -s c.npy l.npy; $P render n.toml -o none --ids l.npy",
            2,
            &["c.npy, an input"],
            "true",
        ),
        Case("ln c.npy h; $P render n.toml -o h", 2, &["c.npy, an input"], "true"),
        Case("$P merge p.npz q.npz -o none --visibility p.npz", 2, &["p.npz, an input"], "true"),
        Case("ln -s q.npz l; $P merge p.npz q.npz -o l", 2, &["q.npz, an input"], "true"),
        Case(
            "cp s.toml s; $P render s -o none --stats >> s",
            2,
            &["sent into s, an input"],
            "cmp s s.toml",
        ),
        Case(
            "cp s.toml s; $P render s --explain >> s",
            2,
            &["sent into s, an input"],
            "cmp s s.toml",
        ),
        Case(
            "cp s.toml s; $P render s -o a.png 2>> s",
            2,
            &["standard error goes into s"],
            "cmp s s.toml",
        ),
        Case(
            "cp c.npy C; sed s/c.npy/C/ n.toml > m.toml; $P render m.toml -o none --stats >> C",
            2,
            &["an input"],
            "cmp C c.npy",
        ),
        Case("cp p.npz p; $P merge p q.npz -o none --stats >> p", 2, &["an input"], "cmp p p.npz"),
        Case(
            "cp s.toml s; $P bench speed --scene s --quick --runs 0 --device cpu >> s",
            2,
            &["an input"],
            "cmp s s.toml",
        ),
        Case(
            "cp s.toml s; ln s h.svg; $P bench accuracy --scene s --quick --plot h.svg",
            2,
            &["an input"],
            "cmp s s.toml",
        ),
    ]);
}

#[test]
fn streams_are_written_to_where_they_stand() {
    try_all(&[
        Case(
            "echo before > log; $P render s.toml -o /dev/stdout >> log",
            0,
            &[],
            "(echo before; cat want.png) | cmp - log",
        ),
        Case(
            "echo before > log; $P render s.toml -o /dev/fd/1 >> log",
            0,
            &[],
            "(echo before; cat want.png) | cmp - log",
        ),
        Case(
            "echo before > log; $P render s.toml -o /proc/self/fd/3 3>> log",
            0,
            &[],
            "(echo before; cat want.png) | cmp - log",
        ),
        Case(
            "echo before > log; $P render s.toml -o /proc/thread-self/fd/3 3>> log",
            0,
            &[],
            "(echo before; cat want.png) | cmp - log",
        ),
        Case(
            "(echo before; $P render s.toml -o /dev/fd/3 3>&1; echo after) > log",
            0,
            &[],
            "(echo before; cat want.png; echo after) | cmp - log",
        ),
        Case(
            "echo before > log; $P render s.toml -o /dev/stderr 2>> log",
            0,
            &[],
            "(echo before; cat want.png) | cmp - log",
        ),
        Case(
            "ln -s /dev/stdout out.png; echo before > log; $P render s.toml -o out.png >> log",
            0,
            &[],
            "test -h out.png && (echo before; cat want.png) | cmp - log",
        ),
        // Talk does not get between data.
        Case("$P render s.toml -o - > log 2>&1", 0, &[], "cmp log want.png"),
        Case("$P render s.toml -o - 2>&1 | cat > log", 0, &[], "cmp log want.png"),
        Case(
            "mkfifo f; cat f > a & $P render s.toml -o f && wait",
            0,
            &[],
            "test -p f && cmp a want.png",
        ),
        Case("$P render s.toml -o none --ids /dev/stdout > a", 0, &[], "cmp a ids.npy"),
        // What a stream holds is not replaced, either.
        Case(
            "echo before > log; $P render s.toml -o log 2>> log",
            2,
            &[],
            "echo before | cmp - log",
        ),
        Case(
            "echo before > log; $P render s.toml -o log >> log",
            2,
            &["standard output is sent into log"],
            "echo before | cmp - log",
        ),
        // Closed, or not for writing.
        Case("$P render s.toml -o - >&-", 4, &["standard output is closed"], "true"),
        Case("$P render s.toml -o /dev/stdout >&-", 4, &["standard output is closed"], "true"),
        Case("$P render s.toml -o none --stats >&-", 4, &["standard output is closed"], "true"),
        Case("$P render s.toml -o /dev/fd/9", 4, &["descriptor 9 is closed", "9>FILE"], "true"),
        Case("$P render s.toml -o /dev/fd/3 3< s.toml", 4, &["reading only"], "true"),
        Case(
            "for c in --help --version info 'completions bash' 'render s.toml --explain'; do
            $P $c >&-; test $? = 4 || exit 1; done",
            0,
            &["standard output is closed"],
            "true",
        ),
        Case("$P render s.toml -o none --stats > /dev/full", 4, &["standard output"], "true"),
        Case("$P --help > /dev/full", 4, &["standard output"], "true"),
        // Standard output that nothing goes to may be closed; words go nowhere when standard error
        // is.
        Case("$P render s.toml -o a.png >&-", 0, &[], "cmp a.png want.png"),
        Case("$P render s.toml -o a.png 2>&-", 0, &[], "cmp a.png want.png"),
        Case("$P render s.toml -o a.png <&- >&- 2>&-", 0, &[], "cmp a.png want.png"),
        Case("$P render nowhere.toml -o a.png 2>&-", 2, &[], "! test -e a.png"),
    ]);
}

#[test]
fn a_file_stays_what_it_is() {
    try_all(&[
        Case(
            "touch a.png; chmod 640 a.png; $P render s.toml -o a.png",
            0,
            &[],
            "cmp a.png want.png && test $(stat -c %a a.png) = 640",
        ),
        Case(
            "touch a.png; chmod 606 a.png; umask 077; $P merge p.npz q.npz -o a.png",
            0,
            &[],
            "cmp a.png want.png && test $(stat -c %a a.png) = 606",
        ),
        Case("umask 027; $P render s.toml -o a.png", 0, &[], "test $(stat -c %a a.png) = 640"),
        Case(
            "echo old > a.png; chmod 444 a.png; $P render s.toml -o a.png",
            4,
            &["read-only", "chmod u+w"],
            "echo old | cmp - a.png && test $(stat -c %a a.png) = 444",
        ),
        Case(
            "echo old > a.png; chmod 444 a.png; chmod u+w a.png; $P render s.toml -o a.png",
            0,
            &[],
            "cmp a.png want.png && test $(stat -c %a a.png) = 644",
        ),
        // Links.
        Case(
            "ln -s to.png l.png; $P render s.toml -o l.png",
            0,
            &[],
            "test -h l.png && cmp to.png want.png",
        ),
        Case(
            "mkdir d; ln -s ../to.png d/m.png; ln -s d/m.png l.png; $P render s.toml -o l.png",
            0,
            &[],
            "test -h l.png && test -h d/m.png && test ! -h to.png && cmp to.png want.png",
        ),
        Case(
            "ln -s no/where.png l.png; $P render s.toml -o l.png",
            4,
            &["there is no folder no"],
            "test -h l.png",
        ),
        Case("ln -s l.png l.png; $P render s.toml -o l.png", 4, &["l.png"], "test -h l.png"),
        Case(
            "echo old > a.png; ln a.png b.png; $P render s.toml -o a.png",
            0,
            &["a.png had 1 more name", "keeps the old"],
            "cmp a.png want.png && echo old | cmp - b.png",
        ),
        // Folders, disks, and names that are none.
        Case("mkdir d; $P render s.toml -o d", 4, &["it is a folder"], "true"),
        Case("$P render s.toml -o d/", 4, &["folder"], "! test -e d"),
        Case("$P render s.toml -o ''", 2, &["a value is required"], "true"),
        Case("$P render s.toml -o no/a.png", 4, &["there is no folder no"], "true"),
        Case("$P render s.toml -o s.toml/a.png", 4, &["no folder s.toml"], "true"),
    ]);
    // Of somebody else: only root can try that.
    if rustix::process::geteuid().is_root() {
        let as_nobody = "N='setpriv --reuid 65534 --regid 65534 --clear-groups'; chmod 755 .;";
        let cases = [
            (
                "touch a.png; chown 65534:65534 a.png; chmod 664 a.png; $P render s.toml -o a.png",
                0,
                "cmp a.png want.png && test $(stat -c %u:%g:%a a.png) = 65534:65534:664",
            ),
            // Written where it is, because its folder is not theirs.
            (
                "echo old > a.png; chmod 666 a.png; $N $P render s.toml -o a.png",
                0,
                "cmp a.png want.png && test $(stat -c %u:%a a.png) = 0:666",
            ),
            (
                "head -c 9999 /dev/zero > a.png; chmod 666 a.png; $N $P render s.toml -o a.png",
                0,
                "cmp a.png want.png",
            ),
            ("echo old > a.png; $N $P render s.toml -o a.png", 4, "echo old | cmp - a.png"),
            ("$N $P render s.toml -o a.png", 4, "! test -e a.png"),
            // Theirs to write in, not theirs to own: the owner stays.
            (
                "mkdir d; chmod 777 d; touch d/a.png; chmod 666 d/a.png; $N $P render s.toml -o \
                 d/a.png",
                0,
                "cmp d/a.png want.png && test $(stat -c %u:%a d/a.png) = 0:666 && test $(ls -A d \
                 | wc -l) = 1",
            ),
            (
                "mkdir d; chmod 1777 d; touch d/a.png; chmod 666 d/a.png; $N $P render s.toml -o \
                 d/a.png",
                0,
                "cmp d/a.png want.png && test $(stat -c %u:%a d/a.png) = 0:666 && test $(ls -A d \
                 | wc -l) = 1",
            ),
        ];
        for (script, code, then) in cases {
            let script: &'static str = Box::leak(format!("{as_nobody}{script}").into_boxed_str());
            try_all(&[Case(script, code, &[], then)]);
        }
    } else {
        eprintln!("files of other people were not tried: this needs root");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn attributes_stay() {
    use rustix::fs::{XattrFlags, getxattr, setxattr};
    // Beside the build: /tmp may be a file system without attributes.
    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::copy(template().join("s.toml"), at("s.toml")).unwrap();
    fs::write(at("a.png"), "old").unwrap();
    let get = |name: &str| {
        let mut value = [0; 64];
        getxattr(at("a.png"), name, &mut value).map(|length| value[..length].to_vec())
    };
    if let Err(error) = setxattr(at("a.png"), "user.note", b"mine", XattrFlags::empty()) {
        eprintln!("attributes were not tried: {error}");
        return;
    }
    // Access for the user 61234: version 2, then tag, permissions and user of each entry.
    let entries: [(u16, u16, u32); 5] =
        [(1, 6, !0), (2, 4, 61234), (4, 0, !0), (16, 4, !0), (32, 0, !0)];
    let entry = |(tag, what, user): (u16, u16, u32)| {
        [&tag.to_le_bytes()[..], &what.to_le_bytes(), &user.to_le_bytes()].concat()
    };
    let list = [2u32.to_le_bytes().to_vec(), entries.map(entry).concat()].concat();
    let lists =
        setxattr(at("a.png"), "system.posix_acl_access", &list, XattrFlags::empty()).is_ok();
    let output = shell(folder.path(), "$P render s.toml -o a.png");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(fs::read(at("a.png")).unwrap(), fs::read(template().join("want.png")).unwrap());
    assert_eq!(get("user.note").unwrap(), b"mine");
    if lists {
        assert_eq!(get("system.posix_acl_access").unwrap(), list);
    }
}

/// Files that are mounted, which only root can try, and not in every container.
#[test]
fn mount_points_are_written() {
    let tried = Command::new("unshare").args(["-m", "true"]).output();
    if !tried.is_ok_and(|output| output.status.success()) {
        eprintln!("mount points were not tried: `unshare -m` is not allowed here");
        return;
    }
    try_all(&[
        Case(
            "touch m.png src.png; unshare -m sh -c 'mount --bind src.png m.png && $P render \
             s.toml -o m.png'",
            0,
            &[],
            "cmp src.png want.png",
        ),
        Case(
            "echo longer than the picture is, by far, so that it must be cut > src.png; seq 999 >> \
src.png; touch m.png
            unshare -m sh -c 'mount --bind src.png m.png && $P render s.toml -o m.png'",
            0,
            &[],
            "cmp src.png want.png",
        ),
        // Two mounts of one file.
        Case(
            "touch m a; unshare -m sh -c 'mount --bind a m && $P render s.toml -o a --ids m'",
            2,
            &["one file"],
            "! test -s a",
        ),
        Case(
            "mkdir d; unshare -m sh -c 'mount --bind . d && $P render s.toml --ids x.npy --depth \
             d/x.npy'",
            2,
            &["one file"],
            "! test -e x.npy",
        ),
        Case(
            "touch m; unshare -m sh -c 'mount --bind c.npy m && $P render n.toml -o m'",
            2,
            &["an input"],
            "true",
        ),
        Case(
            "echo old > a.png; unshare -m sh -c 'mount --bind . . && mount -o remount,ro,bind . &&
            cd . && $P render s.toml -o $PWD/a.png'",
            4,
            &["a.png"],
            "echo old | cmp - a.png",
        ),
        // Neither a name nor a byte of the old file is lost where there is no room.
        Case(
            "mkdir t; unshare -m sh -c 'mount -t tmpfs -o size=64k x t && head -c 40000 /dev/zero \
> t/a.npy &&
            (head -c 1M /dev/zero > t/fill; true) 2>&- && sha256sum t/a.npy > before &&
            $P render s.toml -o none --ids t/a.npy --size 300x300 --device cpu; rc=$?; sha256sum \
-c before || rc=77
            ls -A t | grep planisphere- && rc=78; exit $rc'",
            4,
            &["No space"],
            "true",
        ),
        Case(
            "mkdir t; unshare -m sh -c 'mount -t tmpfs -o size=64k x t && head -c 40000 /dev/zero \
> t/a.npy &&
            touch m.npy && mount --bind t/a.npy m.npy && (head -c 1M /dev/zero > t/fill; true) \
2>&- &&
            sha256sum t/a.npy > before && $P render s.toml -o none --ids m.npy --size 300x300 \
--device cpu
            rc=$?; sha256sum -c before || rc=77; exit $rc'",
            4,
            &["No space"],
            "true",
        ),
    ]);
}

#[test]
fn endings_that_are_not_written_are_refused() {
    try_all(&[
        Case("$P render s.toml -o a.bmp", 2, &["name it .png"], "! test -e a.bmp"),
        Case("$P render s.toml -o a.npy", 2, &["name it .png"], "true"),
        Case("$P render s.toml --ids a.png", 2, &["name it a.npy"], "! test -e s.png"),
        Case("$P render s.toml --depth a.npz", 2, &["name it a.npy"], "true"),
        Case("$P render s.toml --visibility a.npy", 2, &["name it a.npz"], "true"),
        Case("$P merge p.npz q.npz -o a.tga", 2, &["name it .png"], "true"),
        Case("$P merge p.npz q.npz -o a.exr", 2, &["is merged from ids"], "! test -e a.exr"),
        Case("$P bench accuracy --quick --plot a.png", 2, &["name it a.svg"], "true"),
        Case("$P render s.toml -o frame.0001", 2, &["name it .png"], "true"),
        Case("$P render s.toml -o A.PNG && cmp A.PNG want.png", 0, &[], "true"),
        Case("$P render s.toml -o a && cmp a want.png", 0, &[], "true"),
    ]);
}

#[test]
fn nothing_is_no_scene() {
    try_all(&[
        Case("false | $P render - -o a.png", 2, &["<stdin>: nothing came in"], "! test -e a.png"),
        Case(
            "printf '\\n  \\n' | $P render - -o a.png",
            2,
            &["nothing came in"],
            "! test -e a.png",
        ),
        Case(
            "echo '# all' | $P render - -o a.png",
            2,
            &["nothing but comments"],
            "! test -e a.png",
        ),
        Case("$P render - -o a.png <&-", 2, &["nothing came in"], "! test -e a.png"),
        Case("touch e.toml; $P render e.toml", 2, &["e.toml: is empty"], "! test -e e.png"),
        Case("$P render /dev/null -o a.png", 2, &["is a device, not a file"], "! test -e a.png"),
    ]);
}

#[test]
fn make_replaces_what_it_made() {
    try_all(&[
        Case(
            "$P make cloud m --count 500 && $P make lattice m --count 700 && $P render \
             m/scene.toml",
            0,
            &[],
            "grep -q 700 m/scene.toml && ls m | wc -l | grep -q 4",
        ),
        Case(
            "$P make cloud m --count 500 && echo '# mine' >> m/scene.toml; $P make cloud m \
             --count 500",
            2,
            &["scene.toml in m would be replaced", "--force"],
            "grep -q mine m/scene.toml",
        ),
        Case(
            "$P make cloud m --count 500 && cp c.npy m/centers.npy; $P make cloud m --count 600",
            2,
            &["centers.npy in m"],
            "cmp c.npy m/centers.npy && grep -q 500 m/scene.toml",
        ),
        Case(
            "mkdir m; cp s.toml m/scene.toml; $P make cloud m",
            2,
            &["scene.toml in m"],
            "cmp s.toml m/scene.toml && ls m | wc -l | grep -q 1",
        ),
        Case(
            "mkdir m; cp s.toml m/scene.toml; $P make cloud m --count 500 --force",
            0,
            &[],
            "grep -q 500 m/scene.toml",
        ),
        Case(
            "mkdir m; mkfifo m/scene.toml; $P make cloud m",
            2,
            &["scene.toml in m"],
            "test -p m/scene.toml",
        ),
        Case(
            "mkdir m; cp s.toml other; ln -s ../other m/scene.toml; $P make cloud m",
            2,
            &["scene.toml in m"],
            "cmp other s.toml",
        ),
        Case(
            "$P make cloud m --count 500 && rm m/scene.toml && $P make cloud m --count 500",
            0,
            &[],
            "true",
        ),
        Case(
            "$P make cloud m --count 500 && rm m/scene.toml && $P make cloud m --count 501",
            2,
            &["centers.npy"],
            "true",
        ),
        Case("$P make cloud s.toml", 4, &["s.toml"], "true"),
    ]);
}
