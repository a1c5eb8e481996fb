//! Arrays as people have them: what holds the right numbers is read, a fix that is printed leads to
//! the right picture when it is obeyed word for word, and nothing that is no file, has no end, or
//! changes while it is in use ends in anything but words.
//!
//! The program itself is run. Where a fix is written in Python, [`python`] does what it says to the
//! array: it knows the expressions that are printed and no others.

use std::{
    fs,
    io::Write,
    path::Path,
    process::{Child, Command, Output, Stdio},
    thread::sleep,
    time::{Duration, Instant},
};

/// How long the program may take before a test fails.
const PATIENCE: Duration = Duration::from_secs(60);

fn planisphere(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_planisphere"));
    command
        .args(arguments)
        .current_dir(folder)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    command
}

/// Waits for a program that must end.
fn ended(mut child: Child, what: &str) -> Output {
    let start = Instant::now();
    while child.try_wait().unwrap().is_none() {
        if start.elapsed() > PATIENCE {
            child.kill().unwrap();
            panic!("{what}: still runs after {PATIENCE:?}");
        }
        sleep(Duration::from_millis(2));
    }
    child.wait_with_output().unwrap()
}

fn run(folder: &Path, arguments: &[&str]) -> Output {
    ended(planisphere(folder, arguments).spawn().unwrap(), &arguments.join(" "))
}

fn words(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Draws `scene.toml` into `out.png`.
fn render(folder: &Path) -> Output {
    let _ = fs::remove_file(folder.join("out.png"));
    run(folder, &["render", "scene.toml", "-o", "out.png", "--device", "cpu"])
}

// ---- Arrays, as NumPy would save them ----

/// Numbers, in row order.
#[derive(Clone, Debug)]
struct Array {
    /// NumPy's code of the type.
    code: &'static str,
    shape: Vec<usize>,
    values: Vec<f64>,
    /// Whether it is saved column by column.
    fortran: bool,
}

/// What is saved.
#[derive(Clone, Debug)]
enum Saved {
    Numbers(Array),
    /// Fields, each with one row for every record.
    Records(Vec<(&'static str, Array)>),
    /// Something else.
    Bytes(Vec<u8>),
}

fn array(code: &'static str, shape: &[usize], values: &[f64]) -> Array {
    assert_eq!(shape.iter().product::<usize>(), values.len());
    Array { code, shape: shape.into(), values: values.into(), fortran: false }
}

impl Array {
    fn of(&self, code: &'static str) -> Self {
        Self { code, ..self.clone() }
    }

    fn shaped(&self, shape: &[usize]) -> Self {
        Self { fortran: self.fortran, ..array(self.code, shape, &self.values) }
    }

    fn in_columns(&self) -> Self {
        Self { fortran: true, ..self.clone() }
    }

    fn map(&self, change: impl Fn(f64) -> f64) -> Self {
        Self { values: self.values.iter().map(|&value| change(value)).collect(), ..self.clone() }
    }

    /// A table's columns as rows.
    fn turned(&self) -> Self {
        let &[rows, columns] = self.shape.as_slice() else { panic!("no table") };
        let values = (0..columns)
            .flat_map(|c| (0..rows).map(move |r| self.values[r * columns + c]))
            .collect();
        Self { shape: vec![columns, rows], values, ..self.clone() }
    }

    /// The first columns of a table.
    fn first(&self, columns: usize) -> Self {
        let values =
            self.values.chunks(self.shape[1]).flat_map(|row| row[..columns].to_vec()).collect();
        Self { shape: vec![self.shape[0], columns], values, ..self.clone() }
    }

    /// A table with another column.
    fn and(&self, column: f64) -> Self {
        let values =
            self.values.chunks(self.shape[1]).flat_map(|row| [row, &[column]].concat()).collect();
        Self { shape: vec![self.shape[0], self.shape[1] + 1], values, ..self.clone() }
    }

    /// The values in the order in which they are saved.
    fn saved(&self) -> Vec<f64> {
        if !self.fortran {
            return self.values.clone();
        }
        let shape = &self.shape;
        (0..self.values.len())
            .map(|mut at| {
                let (mut index, mut stride) = (0, self.values.len());
                let places: Vec<usize> = shape
                    .iter()
                    .map(|&n| {
                        let place = at % n;
                        at /= n;
                        place
                    })
                    .collect();
                for (&n, place) in shape.iter().zip(places) {
                    stride /= n;
                    index += place * stride;
                }
                self.values[index]
            })
            .collect()
    }
}

/// The 80 bits of an x87 number, in 16 bytes, with something in the others.
fn extended(value: f64, padding: u8) -> [u8; 16] {
    let bits = value.abs().to_bits();
    let (exponent, fraction) = ((bits >> 52) as i32, bits & ((1 << 52) - 1));
    let mut bytes = [padding; 16];
    let (fraction, exponent) = match exponent {
        0 => (0, 0),
        0x7ff => (1 << 63 | fraction << 11, 0x7fff),
        _ => ((fraction | 1 << 52) << 11, exponent - 1023 + 16383),
    };
    bytes[..8].copy_from_slice(&fraction.to_le_bytes());
    let sign = if value.is_sign_negative() { 0x8000 } else { 0 };
    bytes[8..10].copy_from_slice(&(exponent as u16 | sign).to_le_bytes());
    bytes
}

/// The bytes of a number.
fn bytes_of(code: &str, value: f64) -> Vec<u8> {
    let bare = code.trim_start_matches(['<', '>', '|', '=']);
    let mut bytes = match bare {
        "b1" => vec![u8::from(value != 0.0)],
        "i1" => (value as i8).to_le_bytes().to_vec(),
        "i2" => (value as i16).to_le_bytes().to_vec(),
        "i4" => (value as i32).to_le_bytes().to_vec(),
        "i8" => (value as i64).to_le_bytes().to_vec(),
        "u1" => vec![value as u8],
        "u2" => (value as u16).to_le_bytes().to_vec(),
        "u4" => (value as u32).to_le_bytes().to_vec(),
        "u8" => (value as u64).to_le_bytes().to_vec(),
        "f2" => half::f16::from_f64(value).to_le_bytes().to_vec(),
        "f4" => (value as f32).to_le_bytes().to_vec(),
        "f8" => value.to_le_bytes().to_vec(),
        "f16" => extended(value, 0).to_vec(),
        "c16" => [value.to_le_bytes(), 0f64.to_le_bytes()].concat(),
        other => panic!("no numbers of type {other}"),
    };
    if code.starts_with('>') {
        bytes.reverse();
    }
    bytes
}

/// A version 1.0 `.npy` file.
fn npy(descr: &str, fortran: bool, shape: &[usize], data: &[u8]) -> Vec<u8> {
    let fortran = if fortran { "True" } else { "False" };
    let shape = shape.iter().map(|n| format!("{n},")).collect::<String>();
    let mut header =
        format!("{{'descr': {descr}, 'fortran_order': {fortran}, 'shape': ({shape}), }}");
    // NumPy aligns the numbers.
    while (10 + header.len() + 1) % 64 != 0 {
        header.push(' ');
    }
    header.push('\n');
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.bytes());
    bytes.extend(data);
    bytes
}

fn file(saved: &Saved) -> Vec<u8> {
    match saved {
        Saved::Numbers(array) => {
            let data: Vec<u8> =
                array.saved().iter().flat_map(|&value| bytes_of(array.code, value)).collect();
            npy(&format!("'{}'", array.code), array.fortran, &array.shape, &data)
        }
        Saved::Records(fields) => {
            let descr = fields.iter().map(|(name, array)| {
                let inner = array.shape[1..].iter().map(|n| format!("{n},")).collect::<String>();
                if inner.is_empty() {
                    format!("('{name}', '{}')", array.code)
                } else {
                    format!("('{name}', '{}', ({inner}))", array.code)
                }
            });
            let descr = format!("[{}]", descr.collect::<Vec<_>>().join(", "));
            let records = fields[0].1.shape[0];
            let record = |at: usize| {
                let field = move |(_, array): &(&str, Array)| -> Vec<u8> {
                    let across = array.values.len() / records;
                    array.values[at * across..][..across]
                        .iter()
                        .flat_map(|&v| bytes_of(array.code, v))
                        .collect()
                };
                fields.iter().flat_map(field).collect::<Vec<_>>()
            };
            npy(&descr, false, &[records], &(0..records).flat_map(record).collect::<Vec<_>>())
        }
        Saved::Bytes(bytes) => bytes.clone(),
    }
}

/// What Python makes of an expression that a fix names.
fn python(code: &str, saved: &Saved) -> Array {
    if let Some(inner) =
        code.strip_prefix("(255 * ").and_then(|rest| rest.strip_suffix(" + 0.5).astype('u1')"))
    {
        return python(inner, saved).map(|value| (255.0 * value + 0.5).floor()).of("|u1");
    }
    let field = |name: &str| match saved {
        Saved::Records(fields) => {
            fields.iter().find(|(field, _)| *field == name).expect("a field").1.clone()
        }
        _ => panic!("no records: {code}"),
    };
    let quoted =
        |rest: &str| rest.split_once("']").map(|(name, rest)| (name.to_owned(), rest.to_owned()));
    let (mut array, mut rest) = if let Some(list) = code.strip_prefix("numpy.stack([") {
        let (names, rest) = list.split_once("], axis=-1)").expect("a list");
        let columns: Vec<Array> = names
            .split(", ")
            .map(|name| {
                field(
                    name.strip_prefix("array['")
                        .and_then(|name| name.strip_suffix("']"))
                        .expect("a field"),
                )
            })
            .collect();
        let values = (0..columns[0].values.len())
            .flat_map(|k| columns.iter().map(move |c| c.values[k]))
            .collect();
        // NumPy takes the wider type; numbers of these tests lie in either.
        let code =
            if columns.iter().any(|c| c.code.ends_with("f8")) { "<f8" } else { columns[0].code };
        let shape = vec![columns[0].values.len(), columns.len()];
        (Array { code, shape, values, fortran: false }, rest.to_owned())
    } else if let Some(rest) = code.strip_prefix("array['") {
        let (name, rest) = quoted(rest).expect("a name");
        (field(&name), rest)
    } else {
        let rest = code.strip_prefix("array").unwrap_or_else(|| panic!("unknown: {code}"));
        let Saved::Numbers(array) = saved else { panic!("no numbers: {code}") };
        (array.clone(), rest.to_owned())
    };
    while !rest.is_empty() {
        let take = |prefix: &str| rest.strip_prefix(prefix).map(ToOwned::to_owned);
        if let Some(after) = take(".T") {
            array = array.turned();
            rest = after;
        } else if let Some(after) = take("[:, :3]") {
            array = array.first(3);
            rest = after;
        } else if let Some(after) = take(".real") {
            array = array.of("<f8");
            rest = after;
        } else if let Some(after) = take(".astype('f8')") {
            array = array.of("<f8");
            rest = after;
        } else if let Some(after) = take(".reshape(") {
            let (lengths, after) = after.split_once(')').expect("a shape");
            let lengths: Vec<i64> =
                lengths.split(", ").map(|n| n.parse().expect("a length")).collect();
            let known: i64 = lengths.iter().filter(|&&n| n >= 0).product();
            let all = array.values.len() as i64;
            let shape: Vec<usize> =
                lengths.iter().map(|&n| if n < 0 { all / known } else { n } as usize).collect();
            array = Array { fortran: false, ..array.shaped(&shape) };
            rest = after.to_owned();
        } else {
            panic!("unknown: {code}");
        }
    }
    array
}

// ---- A printed fix, obeyed word for word, gives the right picture ----

const SCENE: &str = "
[camera]
origin = [0.0, 0.0, 0.0]
view = [1.0, 0.0, 0.0]
width = 6.0
[image]
width = 60
height = 60
[[spheres]]
centers = 'centers.npy'
radii = 'radii.npy'
colors = 'colors.npy'
";

fn centers() -> Array {
    array("<f8", &[4, 3], &[5., -1., 0., 6., 1., 0., 7., 0., 1.5, 8., 0.2, -1.5])
}

/// Integers, for types that have no others.
fn whole_centers() -> Array {
    array("<f8", &[4, 3], &[5., -1., 0., 6., 1., 0., 7., 0., 2., 8., 0., -2.])
}

fn radii() -> Array {
    array("<f8", &[4], &[1., 0.5, 2., 1.])
}

fn whole_radii() -> Array {
    array("<f8", &[4], &[1., 1., 2., 1.])
}

fn colors() -> Array {
    array("|u1", &[4, 3], &[255., 0., 0., 0., 255., 7., 3., 0., 255., 255., 254., 1.])
}

fn unit(array: &Array, code: &'static str) -> Array {
    array.of(code).map(|value| value / 255.0)
}

/// How a trial ends.
#[derive(Debug)]
enum End {
    /// The picture is right at once.
    Read,
    /// After this has been done.
    Fixed(&'static str),
    /// There is nothing that could be done without a decision: the message has these words.
    Words(&'static [&'static str]),
}

use End::{Fixed, Read as IsRead, Words};

/// A case: its name, the array that differs, what it is, what it is compared with, and how it ends.
type Case = (&'static str, &'static str, Saved, Option<Array>, End);

fn cases() -> Vec<Case> {
    let n = Saved::Numbers;
    let mut cases: Vec<Case> = Vec::new();
    // What holds the right numbers is read: every type, both orders of bytes, both orders of the
    // array.
    for code in ["<f8", ">f8", "=f8", "<f16"] {
        cases.push((code, "centers", n(centers().of(code)), None, IsRead));
        cases.push((code, "radii", n(radii().of(code)), None, IsRead));
        cases.push((code, "centers", n(centers().of(code).in_columns()), None, IsRead));
    }
    for code in ["<f2", ">f2", "<f4", ">f4", "|i1", "<i2", ">i2", "<i4", ">i4", "<i8", ">i8"] {
        cases.push((code, "centers", n(whole_centers().of(code)), Some(whole_centers()), IsRead));
        cases.push((code, "radii", n(whole_radii().of(code)), Some(whole_radii()), IsRead));
    }
    for code in ["|u1", "<u2", ">u2", "<u4", ">u4", "<u8", ">u8"] {
        cases.push((code, "radii", n(whole_radii().of(code)), Some(whole_radii()), IsRead));
        cases.push((code, "colors", n(colors().of(code)), None, IsRead));
    }
    for code in ["<i2", ">i2", "<i4", "<i8", ">i8", "<f4", ">f4", "<f8", "<f2", "<f16"] {
        cases.push((code, "colors", n(colors().of(code)), None, IsRead));
    }
    cases.push(("columns", "colors", n(colors().in_columns()), None, IsRead));
    cases.push(("columns of int64", "colors", n(colors().of("<i8").in_columns()), None, IsRead));
    for shape in [[4, 1], [1, 4]] {
        cases.push(("an axis of one", "radii", n(radii().shaped(&shape)), None, IsRead));
    }
    for shape in [[4, 3, 1], [1, 4, 3], [4, 1, 3]] {
        cases.push(("an axis of one", "centers", n(centers().shaped(&shape)), None, IsRead));
        cases.push(("an axis of one", "colors", n(colors().shaped(&shape)), None, IsRead));
    }

    // Colours from 0 to 1, alone and in wrong shapes: one fix for both.
    for code in ["<f2", "<f4", ">f4", "<f8", ">f8", "<f16"] {
        let wanted = Fixed("(255 * array + 0.5).astype('u1')");
        cases.push((code, "colors", n(unit(&colors(), code)), None, wanted));
    }
    let black_and_white =
        || array("|u1", &[4, 3], &[0., 0., 255., 255., 0., 0., 255., 255., 255., 0., 255., 0.]);
    let wanted = Fixed("(255 * array + 0.5).astype('u1')");
    cases.push((
        "only 0 and 1",
        "colors",
        n(unit(&black_and_white(), "<f8")),
        Some(black_and_white()),
        wanted,
    ));
    let wanted = Fixed("(255 * array[:, :3] + 0.5).astype('u1')");
    cases.push(("rgba 0..1", "colors", n(unit(&colors().and(255.), "<f4")), None, wanted));
    let wanted = Fixed("(255 * array.T + 0.5).astype('u1')");
    cases.push(("planes 0..1", "colors", n(unit(&colors().turned(), "<f4")), None, wanted));
    let wanted = Fixed("(255 * array.reshape(-1, 3) + 0.5).astype('u1')");
    cases.push((
        "a grid 0..1",
        "colors",
        n(unit(&colors().shaped(&[2, 2, 3]), "<f8")),
        None,
        wanted,
    ));
    let wanted = Fixed("(255 * array.reshape(-1, 4)[:, :3] + 0.5).astype('u1')");
    let grid = unit(&colors().and(255.).shaped(&[2, 2, 4]), "<f8").in_columns();
    cases.push(("a grid of rgba 0..1, in columns", "colors", n(grid), None, wanted));

    // Wrong shapes.
    cases.push(("rgba", "colors", n(colors().and(255.)), None, Fixed("array[:, :3]")));
    cases.push((
        "rgba of int64",
        "colors",
        n(colors().and(255.).of("<i8")),
        None,
        Fixed("array[:, :3]"),
    ));
    cases.push(("planes", "colors", n(colors().turned()), None, Fixed("array.T")));
    cases.push((
        "planes in columns",
        "colors",
        n(colors().turned().in_columns()),
        None,
        Fixed("array.T"),
    ));
    cases.push(("turned", "centers", n(centers().turned()), None, Fixed("array.T")));
    cases.push((
        "turned, big-endian",
        "centers",
        n(centers().of(">f8").turned()),
        None,
        Fixed("array.T"),
    ));
    cases.push((
        "a grid",
        "centers",
        n(centers().shaped(&[2, 2, 3])),
        None,
        Fixed("array.reshape(-1, 3)"),
    ));
    let grid = colors().and(255.).shaped(&[2, 2, 4]);
    cases.push(("a grid of rgba", "colors", n(grid), None, Fixed("array.reshape(-1, 4)[:, :3]")));
    cases.push(("a grid", "radii", n(radii().shaped(&[2, 2])), None, Fixed("array.reshape(-1)")));

    // Other types whose numbers are right.
    cases.push((
        "complex without imaginary parts",
        "centers",
        n(centers().of("<c16")),
        None,
        Fixed("array.real"),
    ));
    cases.push((
        "complex, turned",
        "centers",
        n(centers().of("<c16").turned()),
        None,
        Fixed("array.real.T"),
    ));
    let ones = || array("<f8", &[4], &[1.; 4]);
    cases.push(("bool", "radii", n(ones().of("|b1")), Some(ones()), Fixed("array.astype('f8')")));

    // Records.
    let column = |array: &Array, k: usize, code| {
        let values: Vec<f64> = array.values.chunks(array.shape[1]).map(|row| row[k]).collect();
        Array { code, shape: vec![array.shape[0]], values, fortran: false }
    };
    let xyz = |names: [&'static str; 3], codes: [&'static str; 3], array: &Array| {
        Saved::Records((0..3).map(|k| (names[k], column(array, k, codes[k]))).collect())
    };
    let wanted = Fixed("numpy.stack([array['x'], array['y'], array['z']], axis=-1)");
    cases.push((
        "x, y, z",
        "centers",
        xyz(["x", "y", "z"], ["<f8", ">f8", "<f8"], &centers()),
        None,
        wanted,
    ));
    let wanted = Fixed("numpy.stack([array['X'], array['Y'], array['Z']], axis=-1)");
    cases.push(("X, Y, Z", "centers", xyz(["X", "Y", "Z"], ["<f8"; 3], &centers()), None, wanted));
    let wanted = Fixed("numpy.stack([array['r'], array['g'], array['b']], axis=-1)");
    cases.push(("r, g, b", "colors", xyz(["r", "g", "b"], ["|u1"; 3], &colors()), None, wanted));
    let wanted = Fixed(
        "(255 * numpy.stack([array['red'], array['green'], array['blue']], axis=-1) + \
         0.5).astype('u1')",
    );
    let records = xyz(["red", "green", "blue"], ["<f4", "<f4", "<f8"], &unit(&colors(), "<f8"));
    cases.push(("red, green, blue 0..1", "colors", records, None, wanted));
    let particles = || {
        let (pos, rgba) = (centers(), unit(&colors().and(255.), "<f4"));
        Saved::Records(vec![
            ("id", array("<i4", &[4], &[9., 8., 7., 6.])),
            ("pos", pos),
            ("radius", radii()),
            ("rgba", rgba),
        ])
    };
    cases.push(("particles", "centers", particles(), None, Fixed("array['pos']")));
    cases.push(("particles", "radii", particles(), None, Fixed("array['radius']")));
    cases.push((
        "particles",
        "colors",
        particles(),
        None,
        Fixed("(255 * array['rgba'][:, :3] + 0.5).astype('u1')"),
    ));

    // Where only words are right: something would be rounded, cut or guessed.
    let big = array("<i8", &[4], &[1., 1., 9007199254740992., 1.]);
    let mut odd = file(&n(big));
    let end = odd.len();
    odd[end - 16] = 1;
    let wanted =
        Words(&["element [2] is 9007199254740993, which no 64-bit float equals", "decide"]);
    cases.push(("an integer that is no float", "radii", Saved::Bytes(odd), None, wanted));
    let mut long = file(&n(centers().of("<f16")));
    let end = long.len();
    long[end - 16] = 1;
    let wanted =
        Words(&["element [3, 2] is a long double next to -1.5, which no 64-bit float equals"]);
    cases.push(("a long double that is no float", "centers", Saved::Bytes(long), None, wanted));
    let quads = [[0u8, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0x40, 1, 0x40]; 12].concat();
    let wanted = Words(&["long doubles, which differ between machines"]);
    cases.push((
        "another machine's long doubles",
        "centers",
        Saved::Bytes(npy("'<f16'", false, &[4, 3], &quads)),
        None,
        wanted,
    ));
    let with = |at: usize, value: f64, array: Array| {
        let mut array = array;
        array.values[at] = value;
        n(array)
    };
    let floats = || unit(&colors(), "<f4");
    let wanted = Words(&["element [1, 1] is NaN, not a channel of a colour"]);
    cases.push(("NaN among colours", "colors", with(4, f64::NAN, floats()), None, wanted));
    let wanted = Words(&["element [1, 1] is -0.5, not a channel of a colour"]);
    cases.push(("negative colours", "colors", with(4, -0.5, floats()), None, wanted));
    let wanted =
        Words(&["element [2, 2] is 256, not a channel of a colour", "integers from 0 to 255"]);
    cases.push(("colours to 256", "colors", with(8, 256., colors().of("<i4")), None, wanted));
    let wanted = Words(&["element [2, 2] is -1, not a channel of a colour"]);
    cases.push((
        "colours from -1",
        "colors",
        with(8, -1., colors().of("|i1").map(|v| v.min(100.))),
        None,
        wanted,
    ));
    let wanted = Words(&["element [0, 0] is 254.5, not an integer from 0 to 255"]);
    cases.push((
        "colours between integers",
        "colors",
        n(colors().of("<f8").map(|v| (v - 0.5).max(0.0))),
        None,
        wanted,
    ));
    let wanted = Words(&["has the shape (4, 4)", "no transparency", "array[:, :3]"]);
    cases.push(("rgba that is seen through", "colors", n(colors().and(128.)), None, wanted));
    let wanted = Words(&["type bool", "255 * array where true is the brightest"]);
    cases.push(("bool", "colors", n(black_and_white().of("|b1")), None, wanted));
    let wanted = Words(&["has the shape (4, 4), but (N, 3) is needed", "radii: `array[:, 3]`"]);
    cases.push(("four columns", "centers", n(centers().and(1.)), None, wanted));
    let wanted = Words(&["has the shape (4, 2), but (N, 3) is needed"]);
    cases.push(("two columns", "centers", n(centers().first(2)), None, wanted));
    let wanted = Words(&["has the shape (12,)", "array.reshape(-1, 3)", "array.reshape(3, -1).T"]);
    cases.push(("one row of all", "centers", n(centers().shaped(&[12])), None, wanted));
    let wanted = Words(&["has the shape (12,)", "array.reshape(-1, 3)", "array.reshape(3, -1).T"]);
    cases.push(("one row of all", "colors", n(colors().shaped(&[12])), None, wanted));
    cases.push((
        "one colour",
        "colors",
        n(array("|u1", &[3], &[1., 2., 3.])),
        None,
        Words(&["`color = [217, 79, 61]`"]),
    ));
    let wanted = Words(&["has the shape (), but (4,)", "write `radius = 0.8` in place of `radii`"]);
    cases.push(("one radius", "radii", n(array("<f8", &[], &[0.8])), None, wanted));
    let wanted = Words(&["has the shape (3,), but (4,)"]);
    cases.push(("too few radii", "radii", n(array("<f8", &[3], &[1.; 3])), None, wanted));
    let five = array("|u1", &[5, 3], &[9.; 15]);
    cases.push((
        "too many colours",
        "colors",
        n(five),
        None,
        Words(&["has the shape (5, 3), but (4, 3)", "no more"]),
    ));
    let wanted = Words(&["imaginary part 2"]);
    let mut complex = file(&n(radii().of("<c16")));
    let end = complex.len();
    complex[end - 1] = 0x40;
    cases.push(("complex", "radii", Saved::Bytes(complex), None, wanted));
    for (descr, what) in [
        ("'|O'", "Python objects"),
        ("'<U2'", "text"),
        ("'<M8[s]'", "dates"),
        ("'|V8'", "bytes without a type"),
    ] {
        let saved = || Saved::Bytes(npy(descr, false, &[4], &[1; 32]));
        let wanted: End = match what {
            "Python objects" => Words(&["holds Python objects, not numbers"]),
            "text" => Words(&["holds text, not numbers"]),
            "dates" => Words(&["holds dates, not numbers"]),
            _ => Words(&["holds bytes without a type, not numbers"]),
        };
        cases.push((what, "radii", saved(), None, wanted));
    }
    let wanted = Words(&["none of their fields is named for `centers`: a, b"]);
    let records = Saved::Records(vec![("a", radii()), ("b", radii())]);
    cases.push(("records of something", "centers", records, None, wanted));

    // No arrays, or not all of one.
    let good = || file(&n(centers()));
    let cut = |less: usize| Saved::Bytes(good()[..good().len() - less].to_vec());
    cases.push((
        "cut short",
        "centers",
        cut(1),
        None,
        Words(&["holds 95 bytes", "needs 96", "cut short"]),
    ));
    cases.push((
        "cut in the header",
        "centers",
        cut(100),
        None,
        Words(&["the header is cut short"]),
    ));
    let more = Saved::Bytes([good(), vec![0; 7]].concat());
    cases.push((
        "with something behind",
        "centers",
        more,
        None,
        Words(&["holds 103 bytes", "something follows"]),
    ));
    let two = Saved::Bytes([good(), good()].concat());
    cases.push((
        "two in one file",
        "centers",
        two,
        None,
        Words(&["each array has a file of its own"]),
    ));
    cases.push(("empty", "centers", Saved::Bytes(vec![]), None, Words(&["it is empty"])));
    let zip = Saved::Bytes(b"PK\x03\x04and so on".to_vec());
    cases.push(("an archive", "centers", zip, None, Words(&["numpy.savez", "name an .npy file"])));
    let gz = Saved::Bytes(b"\x1f\x8b\x08and so on".to_vec());
    cases.push(("compressed", "centers", gz, None, Words(&["it is compressed", "gunzip"])));
    cases.push((
        "a table of text",
        "centers",
        Saved::Bytes(b"1,2,3\n".to_vec()),
        None,
        Words(&["does not begin with"]),
    ));
    cases
}

#[test]
fn a_printed_fix_gives_the_right_picture() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::write(folder.join("scene.toml"), SCENE).unwrap();
    let write = |name: &str, saved: &Saved| {
        fs::write(folder.join(format!("{name}.npy")), file(saved)).unwrap()
    };
    let mut wrong = Vec::new();
    let cases = cases();
    assert!(cases.len() > 100, "{}", cases.len());
    for (name, key, saved, compared, end) in &cases {
        for (key, array) in [("centers", centers()), ("radii", radii()), ("colors", colors())] {
            write(key, &Saved::Numbers(array));
        }
        if let Some(right) = compared {
            write(key, &Saved::Numbers(right.clone()));
        }
        assert!(render(folder).status.success());
        let wanted = fs::read(folder.join("out.png")).unwrap();
        write(key, saved);
        let mut output = render(folder);
        let mut said = words(&output);
        let mut fail =
            |why: String, said: &str| wrong.push(format!("{key}: {name}: {why}\n{said}"));
        match end {
            IsRead => {}
            Fixed(code) => {
                let Some(fix) =
                    said.lines().find_map(|line| line.split_once("fix: ")).map(|(_, fix)| fix)
                else {
                    fail("no fix".into(), &said);
                    continue;
                };
                let Some(found) = fix
                    .split_once("numpy.save(name, ")
                    .and_then(|(_, code)| code.strip_suffix(')'))
                else {
                    fail("no code".into(), &said);
                    continue;
                };
                if found != *code {
                    fail(format!("not {code}"), &said);
                    continue;
                }
                write(key, &Saved::Numbers(python(found, saved)));
                output = render(folder);
                said = words(&output);
            }
            Words(parts) => {
                let missing: Vec<_> = parts.iter().filter(|part| !said.contains(**part)).collect();
                let code = output.status.code();
                if !missing.is_empty() || code != Some(2) || folder.join("out.png").exists() {
                    fail(format!("{code:?}, lacks {missing:?}"), &said);
                }
                // A fix that a program could obey has to be right: there is none.
                let obeyed = said
                    .lines()
                    .any(|line| line.contains("numpy.save(name, ") && line.ends_with(')'));
                if obeyed && !said.contains("numpy.save(name, array)") {
                    fail("there is code".into(), &said);
                }
                continue;
            }
        }
        if !output.status.success() {
            fail("refused".into(), &said);
        } else if fs::read(folder.join("out.png")).unwrap() != wanted {
            fail("another picture".into(), &said);
        }
    }
    assert!(wrong.is_empty(), "{} of {} cases:\n\n{}", wrong.len(), cases.len(), wrong.join("\n"));
}

/// What leads to a fix depends on the key: the same array for each of the three.
#[test]
fn what_is_asked_for_depends_on_the_key() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::write(folder.join("scene.toml"), SCENE).unwrap();
    for key in ["centers", "radii", "colors"] {
        for (key, array) in [("centers", centers()), ("radii", radii()), ("colors", colors())] {
            fs::write(folder.join(format!("{key}.npy")), file(&Saved::Numbers(array))).unwrap();
        }
        let shape: &[usize] = if key == "radii" { &[4] } else { &[4, 3] };
        let ones = Array {
            code: "|b1",
            shape: shape.into(),
            values: vec![1.0; shape.iter().product()],
            fortran: false,
        };
        fs::write(folder.join(format!("{key}.npy")), file(&Saved::Numbers(ones))).unwrap();
        let said = words(&render(folder));
        let (asked, other) =
            ("float32, float64 or integers are needed", "uint8, or other integers from 0 to 255");
        let (asked, other) = if key == "colors" { (other, asked) } else { (asked, other) };
        assert!(said.contains(asked) && !said.contains(other), "{key}: {said}");
    }
}

/// Without other arrays a table of 3 rows is in doubt when it has few columns, and is not when it
/// has many.
#[test]
fn shapes_in_doubt_are_not_guessed() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::write(folder.join("scene.toml"), "[[spheres]]\ncenters = 'c.npy'\nradius = 1").unwrap();
    let said = |shape: &[usize]| {
        let values: Vec<f64> = (0..shape.iter().product()).map(|k: usize| k as f64).collect();
        fs::write(folder.join("c.npy"), file(&Saved::Numbers(array("<f8", shape, &values))))
            .unwrap();
        let output = render(folder);
        (output.status.code(), words(&output))
    };
    for shape in [[3, 4], [3, 2], [3, 7], [4, 4], [2, 2]] {
        let (code, said) = said(&shape);
        assert!(
            code == Some(2) && said.contains("fix: ") && !said.contains("numpy.save("),
            "{shape:?}: {said}"
        );
    }
    assert!(said(&[3, 100]).1.contains("fix: numpy.save(name, array.T)"));
    assert!(said(&[3]).1.contains("fix: numpy.save(name, array.reshape(1, 3))"));
    assert!(said(&[0]).1.contains("fix: numpy.save(name, array.reshape(0, 3))"));
    assert!(said(&[5, 4, 3]).1.contains("one of its 5 tables"));
    assert_eq!(said(&[3, 3]).0, Some(0));
    assert_eq!(said(&[0, 3]).0, Some(0));
}

/// The statistics name what was copied, and why.
#[test]
fn copies_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let n = 30_000;
    let values: Vec<f64> = (0..3 * n).map(|k| (k % 100) as f64).collect();
    let big = array("<f8", &[n, 3], &values);
    for (code, why) in [
        ("<f8", None),
        ("<f4", None),
        (">f8", Some("big-endian float64")),
        ("<i8", Some("int64")),
        ("<i4", Some("int32")),
        ("<f16", Some("longdouble")),
    ] {
        for columns in [false, true] {
            let saved = if columns { big.of(code).in_columns() } else { big.of(code) };
            fs::write(folder.join("c.npy"), file(&Saved::Numbers(saved))).unwrap();
            fs::write(folder.join("scene.toml"), "[[spheres]]\ncenters = 'c.npy'\nradius = 1")
                .unwrap();
            let arguments = [
                "render",
                "scene.toml",
                "--stats",
                "--size",
                "8x8",
                "-o",
                "o.png",
                "--device",
                "cpu",
            ];
            let output = run(folder, &arguments);
            let said = words(&output);
            let stats: serde_json::Value =
                serde_json::from_slice(&output.stdout).unwrap_or_else(|e| panic!("{e}: {said}"));
            let wanted = match (why, columns) {
                (None, false) => serde_json::json!([]),
                (why, columns) => {
                    let name = why.unwrap_or(if code == "<f8" { "float64" } else { "float32" });
                    let why = if columns { format!("{name} in column order") } else { name.into() };
                    let size = if code == "<f4" { 4 } else { 8 };
                    serde_json::json!([{ "array": "c.npy", "why": why, "bytes": 3 * n * size }])
                }
            };
            assert_eq!(stats["copied"], wanted, "{code} {columns}");
        }
    }
}

/// A copy that there is no memory for is an error with the fix that needs none.
#[cfg(target_os = "linux")]
#[test]
fn memory_that_is_not_there_is_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    // 3 GB of zeros that take no room on the disk.
    let n = 128_000_000;
    let header = npy("'<i8'", false, &[n, 3], &[]);
    let mut c = fs::File::create(folder.join("c.npy")).unwrap();
    c.write_all(&header).unwrap();
    c.set_len((header.len() + 24 * n) as u64).unwrap();
    fs::write(folder.join("scene.toml"), "[[spheres]]\ncenters = 'c.npy'\nradius = 1").unwrap();
    for limits in ["ulimit -v 5000000", "ulimit -d 1000000", "ulimit -v 2000000"] {
        let command = format!(
            "{limits} && exec '{}' render scene.toml -o o.png --device cpu",
            env!("CARGO_BIN_EXE_planisphere")
        );
        let mut shell = Command::new("sh");
        // Every thread takes some addresses.
        shell
            .args(["-c", &command])
            .current_dir(folder)
            .env("RAYON_NUM_THREADS", "2")
            .stdin(Stdio::null());
        let output =
            ended(shell.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap(), limits);
        let said = words(&output);
        assert_eq!(output.status.code(), Some(2), "{limits}: {said}");
        assert!(
            said.contains("c.npy: ") && said.contains("memory") && said.contains("fix: "),
            "{limits}: {said}"
        );
        assert!(!folder.join("o.png").exists());
    }
}

// ---- What is no file, or has no end ----

#[cfg(unix)]
fn pipe(path: &Path) {
    let name = std::ffi::CString::new(path.as_os_str().as_encoded_bytes()).unwrap();
    // SAFETY: the name ends with a zero, and is only read.
    assert_eq!(unsafe { libc::mkfifo(name.as_ptr(), 0o600) }, 0);
}

/// Each of these at each place where a file is read: refused at once, with the name and a fix, and
/// nothing is written.
#[cfg(target_os = "linux")]
#[test]
fn what_is_no_file_is_refused_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    pipe(&folder.join("pipe"));
    let _socket = std::os::unix::net::UnixListener::bind(folder.join("socket")).unwrap();
    fs::create_dir(folder.join("folder")).unwrap();
    fs::write(folder.join("empty"), "").unwrap();
    for (link, to) in [
        ("to-pipe", "pipe"),
        ("to-nothing", "nothing"),
        ("to-itself", "to-itself"),
        ("to-zero", "/dev/zero"),
    ] {
        std::os::unix::fs::symlink(to, folder.join(link)).unwrap();
    }
    let things = [
        ("pipe", "is a pipe"),
        ("to-pipe", "is a pipe"),
        ("socket", "is a socket"),
        ("folder", "is a folder"),
        ("/dev/zero", "is a device"),
        ("/dev/null", "is a device"),
        ("/dev/urandom", "is a device"),
        ("/dev/full", "is a device"),
        ("to-zero", "is a device"),
        ("to-nothing", "no such file"),
        ("to-itself", "too many"),
        ("empty", "empty"),
        ("/proc/self/environ", ""),
        ("/proc/self/mem", ""),
        ("/proc/kmsg", ""),
    ];
    for (key, array) in [("centers", centers()), ("radii", radii()), ("colors", colors())] {
        fs::write(folder.join(format!("{key}.npy")), file(&Saved::Numbers(array))).unwrap();
    }
    let before = fs::read_dir(folder).unwrap().count();
    let mut tried = 0;
    for (thing, word) in things {
        let mut refused = |place: &str, arguments: &[&str]| {
            let start = Instant::now();
            let output = run(folder, arguments);
            let said = words(&output);
            assert_eq!(output.status.code(), Some(2), "{thing} as {place}: {said}");
            assert!(said.to_lowercase().contains(word), "{thing} as {place}: {said}");
            assert!(said.contains("fix: ") && said.contains(thing), "{thing} as {place}: {said}");
            // A pipe as a scene is waited for, a second.
            assert!(
                start.elapsed() < Duration::from_secs(20),
                "{thing} as {place}: {:?}",
                start.elapsed()
            );
            tried += 1;
        };
        for key in ["centers", "radii", "colors"] {
            let scene = folder.join("scene.toml");
            fs::write(&scene, SCENE.replace(&format!("{key}.npy"), thing)).unwrap();
            refused(key, &["render", "scene.toml", "-o", "out.png", "--device", "cpu"]);
            fs::remove_file(scene).unwrap();
        }
        refused("a part", &["merge", thing, "-o", "out.png"]);
        // Text of no length is a scene for this test's purposes elsewhere.
        if !matches!(thing, "empty" | "/proc/kmsg" | "/proc/self/mem") {
            refused("a scene", &["render", thing, "-o", "out.png", "--device", "cpu"]);
        }
        assert_eq!(fs::read_dir(folder).unwrap().count(), before, "{thing}: something was written");
    }
    assert!(tried >= 60, "{tried}");
}

/// Scenes may come through pipes, from programs that are slow to begin and slow to end, but not
/// without end.
#[cfg(unix)]
#[test]
fn scenes_come_through_pipes() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    pipe(&folder.join("pipe"));
    let scene = "[camera]\nview = [1, 0, 0]\n[[sphere]]\ncenter = [5, 0, 0]\nradius = 1\n";
    fs::write(folder.join("scene.toml"), scene).unwrap();
    assert!(render(folder).status.success());
    let wanted = fs::read(folder.join("out.png")).unwrap();
    let arguments = ["render", "pipe", "-o", "pipe.png", "--device", "cpu"];
    for (wait, pause) in [(0, 0), (200, 0), (0, 300), (300, 300)] {
        let child = planisphere(folder, &arguments).spawn().unwrap();
        sleep(Duration::from_millis(wait));
        // Waits until the program has opened it.
        let mut writer = fs::OpenOptions::new().write(true).open(folder.join("pipe")).unwrap();
        for half in scene.as_bytes().chunks(scene.len() / 2 + 1) {
            sleep(Duration::from_millis(pause));
            writer.write_all(half).unwrap();
        }
        drop(writer);
        let output = ended(child, "a scene from a pipe");
        assert!(output.status.success(), "{}", words(&output));
        assert_eq!(fs::read(folder.join("pipe.png")).unwrap(), wanted);
        fs::remove_file(folder.join("pipe.png")).unwrap();
    }
    // As a shell's <(program) and `program |` do.
    for script in [
        "printf %s \"$1\" | exec \"$0\" render - -o pipe.png",
        "printf %s \"$1\" | exec \"$0\" render /dev/stdin -o pipe.png",
    ] {
        let mut shell = Command::new("sh");
        shell
            .args([
                "-c",
                &format!("{script} --device cpu"),
                env!("CARGO_BIN_EXE_planisphere"),
                scene,
            ])
            .current_dir(folder);
        assert!(shell.status().unwrap().success(), "{script}");
        assert_eq!(fs::read(folder.join("pipe.png")).unwrap(), wanted);
        fs::remove_file(folder.join("pipe.png")).unwrap();
    }
    // Zeros without end are no text.
    let mut endless = planisphere(folder, &["render", "-", "-o", "pipe.png"]);
    let output =
        ended(endless.stdin(fs::File::open("/dev/zero").unwrap()).spawn().unwrap(), "zeros");
    assert_eq!(output.status.code(), Some(2));
    assert!(words(&output).contains("no file of particles"), "{}", words(&output));
    assert!(!folder.join("pipe.png").exists());
}

// ---- What changes while it is in use ----

/// So many that their arrays are mapped.
const MANY: usize = 40_000;

/// Writes arrays of spheres at random, and a scene of them; returns the folder.
fn many(seed: u64) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    write_many(folder.path(), "", seed);
    let scene = "[camera]\norigin = [-2, 0.5, 0.5]\nview = [1, 0, 0]\nwidth = 1.2\n[image]\nwidth \
                 = 700\nheight = 700\n[[spheres]]\ncenters = 'c.npy'\nradii = 'r.npy'\n";
    fs::write(folder.path().join("scene.toml"), scene).unwrap();
    folder
}

fn write_many(folder: &Path, suffix: &str, seed: u64) {
    let mut random = random(seed);
    let mut unit = move || (random() >> 40) as f64 / f64::from(1 << 24);
    let centers: Vec<f64> = (0..3 * MANY).map(|_| unit()).collect();
    let radii: Vec<f64> = (0..MANY).map(|_| 0.002 + 0.01 * unit()).collect();
    let save = |name: String, array: Array| {
        fs::write(folder.join(name), file(&Saved::Numbers(array))).unwrap()
    };
    save(format!("c.npy{suffix}"), array("<f4", &[MANY, 3], &centers));
    save(format!("r.npy{suffix}"), array("<f8", &[MANY], &radii));
}

/// How long the program takes when nothing happens.
fn duration(arguments: &[&str]) -> Duration {
    let folder = many(1);
    let start = Instant::now();
    let arguments = [&["render", "scene.toml", "--device", "cpu"], arguments].concat();
    assert!(run(folder.path(), &arguments).status.success());
    start.elapsed()
}

fn random(seed: u64) -> impl FnMut() -> u64 {
    let mut state = seed;
    move || {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }
}

/// At a moment of a drawing that goes with the round, something is done to an array: the picture is
/// the one of before, or the one of after, or there are words and nothing is written.
#[test]
fn arrays_that_change_give_words_or_a_whole_picture() {
    use std::io::{Seek, SeekFrom};
    type Deed = fn(&Path);
    fn fill(path: &Path, number: &[u8]) {
        let mut file = fs::OpenOptions::new().write(true).open(path).unwrap();
        file.seek(SeekFrom::Start(128)).unwrap();
        let length = fs::metadata(path).unwrap().len() as usize - 128;
        file.write_all(&number.repeat(length / number.len())).unwrap();
    }
    fn cut(path: &Path, length: u64) {
        fs::OpenOptions::new().write(true).open(path).unwrap().set_len(length).unwrap();
    }
    let deeds: [(&str, Deed); 10] = [
        ("cut to nothing", |path| cut(path, 0)),
        ("cut to the header", |path| cut(path, 128)),
        ("cut to a page", |path| cut(path, 4096)),
        ("cut by one byte", |path| cut(path, fs::metadata(path).unwrap().len() - 1)),
        ("longer", |path| {
            fs::OpenOptions::new().append(true).open(path).unwrap().write_all(b"x").unwrap()
        }),
        ("NaN", |path| fill(path, &f64::NAN.to_le_bytes())),
        ("other numbers", |path| fill(path, &0.25f32.to_le_bytes())),
        ("written again", |path| {
            let bytes = fs::read(path).unwrap();
            fs::write(path, bytes).unwrap();
        }),
        ("renamed over", |path| {
            let mut new = path.as_os_str().to_owned();
            new.push(".new");
            fs::rename(new, path).unwrap();
        }),
        ("removed", |path| fs::remove_file(path).unwrap()),
    ];
    let pictures = |seed: u64, other: Option<&str>| {
        let folder = many(seed);
        if let Some(name) = other {
            write_many(folder.path(), ".new", seed + 100);
            fs::rename(folder.path().join(format!("{name}.new")), folder.path().join(name))
                .unwrap();
        }
        assert!(render(folder.path()).status.success());
        fs::read(folder.path().join("out.png")).unwrap()
    };
    let old = pictures(1, None);
    let whole = duration(&["-o", "out.png"]);
    let (mut told, mut drawn) = (0, 0);
    for name in ["c.npy", "r.npy"] {
        let new = pictures(1, Some(name));
        assert_ne!(old, new);
        for (round, (what, deed)) in deeds.into_iter().enumerate() {
            for part in [0.3, 0.6, 0.9] {
                let wait = whole.mul_f64(part + 0.01 * round as f64);
                let folder = many(1);
                write_many(folder.path(), ".new", 101);
                let arguments = ["render", "scene.toml", "-o", "out.png", "--device", "cpu"];
                let child = planisphere(folder.path(), &arguments).spawn().unwrap();
                sleep(wait);
                deed(&folder.path().join(name));
                let output = ended(child, what);
                let said = words(&output);
                let picture = fs::read(folder.path().join("out.png")).ok();
                match output.status.code() {
                    Some(0) => {
                        let picture = picture.expect("a picture");
                        // Numbers that were there before the program looked are numbers like
                        // others.
                        let known = picture == old
                            || what == "renamed over" && picture == new
                            || what == "other numbers";
                        assert!(known, "{name} {what} after {wait:?}: a mixture");
                        drawn += 1;
                    }
                    Some(2) => {
                        assert!(
                            said.contains(name) && said.contains("fix: "),
                            "{name} {what}: {said}"
                        );
                        assert!(
                            picture.is_none() && !said.contains("panicked"),
                            "{name} {what}: {said}"
                        );
                        told += usize::from(said.contains("changed while it was in use"));
                    }
                    code => panic!("{name} {what} after {wait:?}: {code:?}\n{said}"),
                }
                let left = fs::read_dir(folder.path()).unwrap().count();
                assert!(left <= 6, "{name} {what}: {left} files");
            }
        }
    }
    println!("{told} told, {drawn} drawn");
    assert!(told > 0, "no change fell into a drawing");
}

/// Whatever is written into arrays while they are drawn, the program ends soon, with words, without
/// a panic, and writes nothing: numbers of every kind, at random moments of a drawing that takes a
/// second and more.
#[test]
fn a_drawing_survives_any_numbers() {
    use std::io::{Seek, SeekFrom};
    type Number = fn(u64) -> u64;
    let kinds: [(&str, Number); 12] = [
        ("NaN", |_| f64::NAN.to_bits()),
        ("infinity", |_| f64::INFINITY.to_bits()),
        ("the greatest", |_| f64::MAX.to_bits()),
        ("the least", |_| 1),
        ("zero", |_| 0),
        ("minus one", |_| (-1.0f64).to_bits()),
        ("all bits", |_| u64::MAX),
        ("infinite f32", |_| 0x7f80_0000_7f80_0000),
        ("the greatest f32", |_| 0x7f7f_ffff_7f7f_ffff),
        ("any bits", |random| random),
        ("any exponent", |random| random & !(1 << 63)),
        (
            "some NaN",
            |random| if random % 8 == 0 { u64::MAX } else { (random % 1000) as f64 as u64 },
        ),
    ];
    let mut random = random(3);
    let (mut told, mut slowest) = (0, Duration::ZERO);
    let size = ["--size", "2500x2500", "--depth", "d.npy", "-o", "out.png"];
    let whole = duration(&size);
    for round in 0..48 {
        let folder = many(2);
        let (what, number) = kinds[round / 2 % kinds.len()];
        let name = if round % 2 == 0 { "c.npy" } else { "r.npy" };
        let path = folder.path().join(name);
        let length = fs::metadata(&path).unwrap().len() as usize - 128;
        let garbage: Vec<u8> =
            (0..length / 8).flat_map(|_| number(random()).to_le_bytes()).collect();
        let arguments = [&["render", "scene.toml", "--device", "cpu"], &size[..]].concat();
        let child = planisphere(folder.path(), &arguments).spawn().unwrap();
        sleep(whole.mul_f64((random() % 100) as f64 / 100.0));
        let start = Instant::now();
        let mut file = fs::OpenOptions::new().write(true).open(&path).unwrap();
        file.seek(SeekFrom::Start(128)).unwrap();
        for piece in garbage.chunks(1 << 14) {
            file.write_all(piece).unwrap();
        }
        let output = ended(child, what);
        slowest = slowest.max(start.elapsed());
        let said = words(&output);
        match output.status.code() {
            Some(0) => {}
            Some(2) => {
                assert!(
                    said.contains(name) && said.contains("fix: ") && !said.contains("panicked"),
                    "{what}: {said}"
                );
                assert!(
                    !folder.path().join("out.png").exists()
                        && !folder.path().join("d.npy").exists()
                );
                told += usize::from(said.contains("changed while it was in use"));
            }
            code => panic!("{name} {what}: {code:?}\n{said}"),
        }
    }
    println!("{told} told; at most {slowest:?} after the change");
    assert!(told > 10, "{told}");
}

/// Parts that change while they are merged.
#[test]
fn parts_that_change_give_words() {
    let folder = many(5);
    let folder = folder.path();
    let part =
        ["render", "scene.toml", "--visibility", "a.npz", "--size", "1500x1500", "--device", "cpu"];
    assert!(run(folder, &part).status.success());
    let whole = fs::read(folder.join("a.npz")).unwrap();
    let mut told = 0;
    for wait in [20, 60, 100, 160, 240, 400] {
        for deed in 0..2 {
            fs::write(folder.join("a.npz"), &whole).unwrap();
            let child = planisphere(folder, &["merge", "a.npz", "-o", "out.png"]).spawn().unwrap();
            sleep(Duration::from_millis(wait));
            let file = fs::OpenOptions::new().write(true).open(folder.join("a.npz")).unwrap();
            match deed {
                0 => file.set_len(4096).unwrap(),
                _ => (&file).write_all(&vec![0xff; whole.len()]).unwrap(),
            }
            let output = ended(child, "merge");
            let said = words(&output);
            match output.status.code() {
                Some(0) => {}
                Some(2) => {
                    assert!(
                        said.contains("a.npz")
                            && said.contains("fix: ")
                            && !said.contains("panicked"),
                        "{said}"
                    );
                    assert!(!folder.join("out.png").exists());
                    told += usize::from(said.contains("changed while it was in use"));
                }
                code => panic!("{code:?}: {said}"),
            }
            let _ = fs::remove_file(folder.join("out.png"));
        }
    }
    println!("{told} told");
}
