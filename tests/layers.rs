//! The walls of the house: which crate may know which, no circles of imports, and what the core is
//! built from. `docs/architecture.md` tells the rule in words.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::{Path, PathBuf},
    process::Command,
};

/// Each crate, and the crates of this workspace that it may depend on.
const MAY_KNOW: [(&str, &[&str]); 11] = [
    ("core", &[]),
    ("memory", &[]),
    ("shaders", &["core"]),
    ("image", &["core"]),
    ("gpu", &["core", "shaders"]),
    ("io", &["core", "image", "memory"]),
    ("renderer", &["core", "gpu", "image", "io", "memory"]),
    ("window", &["core", "image", "io", "renderer"]),
    ("bench", &["core", "gpu", "image", "io", "renderer"]),
    ("testkit", &[]),
    ("", &["bench", "io", "renderer", "window"]),
];

/// Packages that few crates may depend on, and those crates. The root package, which is the command
/// line, is the empty name.
const FEW_MAY_KNOW: [(&str, &[&str]); 22] = [
    ("bzip2", &["io"]),
    ("clap", &[""]),
    ("flate2", &["io"]),
    ("gif", &["io"]),
    ("image-webp", &["io"]),
    ("jpeg-encoder", &["io"]),
    ("libc", &["", "bench", "io", "window"]),
    ("lzma-rust2", &["io"]),
    ("memmap2", &["io", "window"]),
    ("naga", &["shaders"]),
    ("pollster", &["gpu", "renderer"]),
    ("qoi", &["io"]),
    ("ruzstd", &["io"]),
    ("simd-adler32", &["io"]),
    ("softbuffer", &["window"]),
    ("tempfile", &["bench", "io"]),
    ("tiff", &["io"]),
    ("toml", &["io", "testkit"]),
    ("wgpu", &["gpu"]),
    ("winit", &["window"]),
    ("x11rb", &["window"]),
    ("zip", &["io"]),
];

/// What the core is built from, on the way to a library: names of packages.
const OF_THE_CORE: [&str; 21] = [
    "bytemuck",
    "bytes",
    "cfg-if",
    "crossbeam-deque",
    "crossbeam-epoch",
    "crossbeam-utils",
    "dashu-base",
    "dashu-int",
    "either",
    "glam",
    "num-modular",
    "planisphere-core",
    "proc-macro2",
    "quote",
    "rayon",
    "rayon-core",
    "static_assertions",
    "syn",
    "thiserror",
    "thiserror-impl",
    "unicode-ident",
];

/// What a library without the default features is never built from.
const NEVER: [&str; 6] = ["clap", "naga", "softbuffer", "wgpu", "winit", "zip"];

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The folder of each crate.
fn crates() -> BTreeMap<String, PathBuf> {
    let folders = fs::read_dir(root().join("crates")).expect("crates/");
    let folders = folders.map(|entry| entry.expect("an entry").path());
    let named = |path: PathBuf| {
        (path.file_name().expect("a name").to_string_lossy().into_owned(), path.clone())
    };
    let mut all: BTreeMap<_, _> = folders.map(named).collect();
    all.insert("shaders".into(), root().join("shaders"));
    all.insert(String::new(), root().to_path_buf());
    all
}

/// The packages that a manifest names, in any table but that of tests.
fn known(manifest: &toml::Table) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    for (key, value) in manifest {
        let Some(table) = value.as_table() else { continue };
        match key.as_str() {
            "dependencies" | "build-dependencies" => {
                found.extend(table.keys().cloned());
            }
            "target" => table
                .values()
                .filter_map(toml::Value::as_table)
                .for_each(|target| found.extend(known(target))),
            _ => {}
        }
    }
    found
}

#[test]
fn a_crate_knows_only_those_below_it() {
    let crates = crates();
    let listed: BTreeSet<&str> = MAY_KNOW.iter().map(|(name, _)| *name).collect();
    let there: BTreeSet<&str> = crates.keys().map(String::as_str).collect();
    assert_eq!(listed, there, "each crate has a line in MAY_KNOW");
    let mut edges = 0;
    for (name, may) in MAY_KNOW {
        let text = fs::read_to_string(crates[name].join("Cargo.toml")).expect("a manifest");
        for package in known(&text.parse().expect("TOML")) {
            edges += 1;
            if let Some(other) = package.strip_prefix("planisphere-") {
                assert!(may.contains(&other), "`{name}` must not know {other}");
            }
            if let Some((_, few)) = FEW_MAY_KNOW.iter().find(|(other, _)| *other == package) {
                assert!(few.contains(&name), "`{name}` must not know {package}");
            }
        }
    }
    assert!(edges > 60, "{edges} dependencies were read");
}

/// The packages that cargo builds for a package, tests left out.
fn closure(arguments: &[&str]) -> BTreeSet<String> {
    let output = Command::new(env!("CARGO"))
        .args(["tree", "--locked", "--edges", "normal", "--prefix", "none"])
        .args(arguments)
        .current_dir(root())
        .output()
        .expect("cargo");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).expect("UTF-8");
    text.lines().filter_map(|line| line.split(' ').next().map(str::to_owned)).collect()
}

#[test]
fn the_core_is_built_from_little() {
    let packages = closure(&["--package", "planisphere-core"]);
    let list: BTreeSet<String> = OF_THE_CORE.map(str::to_owned).into();
    assert_eq!(packages, list, "a new package of the core needs a reason, and a line here");
}

#[test]
fn a_library_without_features_draws_on_the_cpu_alone() {
    let packages = closure(&["--package", "planisphere", "--no-default-features"]);
    for name in NEVER {
        assert!(!packages.contains(name), "{name} is in {packages:?}");
    }
    // With them each is there, so that the names are right.
    let all = closure(&["--package", "planisphere", "--all-features"]);
    let missing: Vec<_> = NEVER.iter().filter(|name| !all.contains(**name)).collect();
    assert!(missing.is_empty(), "{missing:?}");
}

#[test]
fn a_library_builds_little() {
    let library = |features| {
        closure(&["--package", "planisphere", "--no-default-features", "--features", features])
    };
    for (features, most) in [("", 25), ("png", 35)] {
        let packages = library(features);
        assert!(
            packages.len() <= most,
            "`{features}` builds {} packages: {packages:?}",
            packages.len()
        );
    }
    // Each feature of the files has packages of its own, which the others do without.
    let own = ["tempfile", "zip", "png", "toml"];
    for (own, features) in own.iter().zip(["files", "parts", "png", "read"]) {
        let packages = library(features);
        assert!(packages.contains(*own), "`{features}` builds {packages:?}");
    }
    for (feature, others) in [
        // A picture that is saved is a PNG.
        ("files", &["zip", "toml"][..]),
        ("parts", &["tempfile", "png", "toml"]),
        ("png", &["tempfile", "zip", "toml"]),
        ("read", &["tempfile", "zip", "png"]),
    ] {
        let packages = library(feature);
        assert!(others.iter().all(|other| !packages.contains(*other)), "{feature}: {packages:?}");
    }
}

/// Files of Rust under a folder.
fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|kind| kind == "rs") {
            found.push(path);
        }
    }
}

/// The modules of a crate that each of its modules imports: words after `crate::`, in braces too,
/// outside of comments and of unit tests, which come last in a file.
fn imports(source: &Path) -> BTreeMap<String, BTreeSet<String>> {
    let mut files = Vec::new();
    sources(source, &mut files);
    let mut graph: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for path in files {
        let inside = path.strip_prefix(source).expect("inside");
        let first = inside.components().next().expect("a name").as_os_str().to_string_lossy();
        let module = first.trim_end_matches(".rs").to_owned();
        let text = fs::read_to_string(&path).expect("text");
        let text = text.split("#[cfg(test)]\nmod tests").next().unwrap_or_default();
        let text: String = text
            .lines()
            .map(|line| line.split("//").next().unwrap_or_default())
            .collect::<Vec<_>>()
            .join("\n");
        let words = graph.entry(module).or_default();
        for after in text.split("crate::").skip(1) {
            words.extend(heads(after));
        }
    }
    let modules: BTreeSet<String> = graph.keys().cloned().collect();
    for (module, words) in &mut graph {
        words.retain(|word| modules.contains(word) && word != module);
    }
    graph
}

/// The first words of a path, or of each path in braces.
fn heads(path: &str) -> Vec<String> {
    let word = |text: &str| text.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
    let Some(list) = path.strip_prefix('{') else { return vec![word(path)] };
    let (mut depth, mut begins, mut found) = (1, true, Vec::new());
    for (at, c) in list.char_indices() {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 1 => begins = true,
            c if begins && !c.is_whitespace() => {
                found.push(word(&list[at..]));
                begins = false;
            }
            _ => {}
        }
        if depth == 0 {
            break;
        }
    }
    found
}

/// A circle of imports, if there is one.
fn circle(graph: &BTreeMap<String, BTreeSet<String>>) -> Option<Vec<String>> {
    fn visit<'a>(
        module: &'a str,
        graph: &'a BTreeMap<String, BTreeSet<String>>,
        way: &mut Vec<&'a str>,
        done: &mut BTreeSet<&'a str>,
    ) -> Option<Vec<String>> {
        if let Some(at) = way.iter().position(|other| *other == module) {
            return Some(way[at..].iter().map(|&name| name.to_owned()).collect());
        }
        if !done.insert(module) {
            return None;
        }
        way.push(module);
        let found = graph.get(module)?.iter().find_map(|next| visit(next, graph, way, done));
        way.pop();
        found
    }
    let mut done = BTreeSet::new();
    graph.keys().find_map(|module| visit(module, graph, &mut Vec::new(), &mut done))
}

#[test]
fn no_modules_import_each_other() {
    let mut imported = 0;
    for (name, folder) in crates() {
        let graph = imports(&folder.join("src"));
        imported += graph.values().map(BTreeSet::len).sum::<usize>();
        let circle = circle(&graph);
        assert!(circle.is_none(), "in `{name}` these import each other: {circle:?}");
    }
    assert!(imported > 80, "{imported} imports were read");
}

#[test]
fn a_circle_is_found() {
    let graph = |edges: &[(&str, &[&str])]| {
        edges
            .iter()
            .map(|(from, to)| ((*from).to_owned(), to.iter().map(|to| (*to).to_owned()).collect()))
            .collect::<BTreeMap<String, BTreeSet<String>>>()
    };
    assert_eq!(circle(&graph(&[("a", &["b", "c"]), ("b", &["c"]), ("c", &[])])), None);
    let found = circle(&graph(&[("a", &["b"]), ("b", &["c"]), ("c", &["b"])]));
    assert_eq!(found, Some(vec!["b".to_owned(), "c".to_owned()]));
    assert_eq!(heads("{\n    a::{b, c},\n    d,\n};"), ["a", "d"]);
    assert_eq!(heads("a::b::c;"), ["a"]);
}
