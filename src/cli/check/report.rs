//! What a check has found: lines for people, JSON, and JUnit XML.

use std::fmt::Write;

use serde::Serialize;

use super::{
    count,
    golden::{Finding, How, IdPixel, Pixel, State},
};
use planisphere_io::text;

/// What became of a scene.
pub(super) struct Outcome {
    /// What it is called.
    pub name: String,
    /// Its file.
    pub scene: String,
    /// What becomes of it: the worst of its goldens.
    pub state: State,
    /// Pixels that were drawn.
    pub pixels: Option<u64>,
    /// Of its colours.
    pub picture: Option<Finding<Pixel>>,
    /// Of its ids.
    pub ids: Option<Finding<IdPixel>>,
    /// Names of the files that were written.
    pub written: Vec<String>,
    /// Why nothing was compared: several lines.
    pub error: Option<String>,
    /// The exit code of a run of this scene alone.
    pub code: u8,
}

/// A colour as it is written in a scene, with the alpha of those that are not opaque.
fn color([r, g, b, alpha]: [u8; 4]) -> String {
    match alpha {
        255 => format!("#{r:02x}{g:02x}{b:02x}"),
        _ => format!("#{r:02x}{g:02x}{b:02x}{alpha:02x}"),
    }
}

fn sphere(id: i128) -> String {
    if id < 0 { "no sphere".into() } else { format!("sphere {id}") }
}

/// Says that there are more than those that are listed.
fn more(different: Option<u64>, told: usize) -> Option<String> {
    let rest = different?.checked_sub(told as u64).filter(|rest| *rest > 0 && told > 0)?;
    Some(format!("and {} more", count(rest)))
}

impl Outcome {
    /// What is said of its goldens, one line.
    pub fn words(&self) -> String {
        if let Some(error) = &self.error {
            return error.lines().next().unwrap_or_default().into();
        }
        let fails = self.state.fails();
        let ids = self.ids.as_ref().map(|found| (found.state, &found.words));
        let both = [self.picture.as_ref().map(|found| (found.state, &found.words)), ids];
        let told = both.into_iter().flatten().filter(|(state, words)| {
            // Beside what has failed, what has passed is no news.
            !words.is_empty() && (!fails || state.fails())
        });
        told.map(|(_, words)| words.as_str()).collect::<Vec<_>>().join("; ")
    }

    /// What is listed below: pixels that differ, or, in JUnit, all of an error.
    pub fn details(&self) -> Vec<String> {
        if let Some(error) = &self.error {
            return error.lines().map(Into::into).collect();
        }
        let mut lines = Vec::new();
        if let Some(found) = self.picture.as_ref().filter(|found| found.state.fails()) {
            lines.extend(found.first.iter().map(|told| {
                let Pixel { pixel: [column, row], expected, actual, spheres } = told;
                let there = sphere(spheres[0].map_or(-1, i128::from));
                let [expected, actual] = [*expected, *actual].map(color);
                format!("pixel ({column}, {row}): {expected} expected, {actual} drawn, {there}")
            }));
            lines.extend(more(found.different, found.first.len()));
        }
        if let Some(found) = self.ids.as_ref().filter(|found| found.state.fails()) {
            lines.extend(found.first.iter().map(|told| {
                let IdPixel { pixel: [column, row], expected, actual } = told;
                let [expected, actual] = [*expected, i128::from(*actual)].map(sphere);
                format!("pixel ({column}, {row}): {expected} expected, {actual} drawn")
            }));
            lines.extend(more(found.different, found.first.len()));
        }
        lines.extend(self.written.iter().map(|name| format!("written: {name}")));
        lines
    }

    /// For people: one line, and what is listed below it.
    pub fn lines(&self) -> String {
        let name = &self.name;
        let words = self.words();
        let colon = if words.is_empty() { "" } else { ": " };
        let line = match self.state {
            State::Passed => format!("ok {name}{colon}{words}"),
            State::Unchanged => format!("unchanged {name}"),
            State::Blessed => return format!("written {name}: {}\n", self.written.join(", ")),
            State::Missing | State::Failed => format!("FAILED {name}{colon}{words}"),
            // Why not is said on standard error.
            State::Error => return format!("ERROR {name}: nothing was compared\n"),
        };
        let below = self.details().into_iter().map(|line| format!("  {line}\n"));
        format!("{line}\n{}", below.collect::<String>())
    }
}

/// Scenes by what became of them.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub(super) struct Sums {
    /// Right, or written.
    pub passed: usize,
    /// Missing or different.
    pub failed: usize,
    /// Of which nothing was compared.
    pub errors: usize,
    /// Those among `passed` that were written.
    #[serde(skip)]
    written: usize,
}

impl Sums {
    pub fn of(outcomes: &[Outcome]) -> Self {
        let mut sums = Self::default();
        for outcome in outcomes {
            match outcome.state {
                State::Error => sums.errors += 1,
                state if state.fails() => sums.failed += 1,
                _ => sums.passed += 1,
            }
            sums.written += usize::from(outcome.state == State::Blessed);
        }
        sums
    }

    /// One line; `bless` says what was asked for.
    pub fn line(&self, bless: bool) -> String {
        let Self { passed, failed, errors, written } = *self;
        let all = passed + failed + errors;
        let mut words = format!("{all} scene{}: ", if all == 1 { "" } else { "s" });
        words += &match bless {
            true => format!("{written} written, {} unchanged", passed - written),
            false => format!("{passed} ok, {failed} failed"),
        };
        if errors > 0 {
            let _ = write!(words, ", {errors} not compared");
        }
        words
    }
}

impl How {
    /// What is tolerated, if anything is: it is always said.
    pub fn tolerance(&self) -> Option<String> {
        let Self { max_different, max_delta, .. } = self;
        let mut words = Vec::new();
        if *max_delta > 0 {
            words.push(format!("channels may be off by {max_delta} (--max-delta)"));
        }
        if *max_different > 0 {
            let pixels = count(*max_different);
            words.push(format!("{pixels} pixels of a scene may differ (--max-different)"));
        }
        (!words.is_empty()).then(|| format!("tolerated: {}", words.join(", and ")))
    }
}

/// What `--json` prints. Fields are added, never changed, while `version` is 1.
#[derive(Serialize)]
struct Json<'a> {
    version: u32,
    #[serde(flatten)]
    sums: Sums,
    device: &'a str,
    /// What may differ.
    max_different: u64,
    max_delta: u8,
    /// Goldens of no scene.
    unused: &'a [String],
    scenes: Vec<Scene<'a>>,
}

#[derive(Serialize)]
struct Scene<'a> {
    scene: &'a str,
    golden: Option<&'a str>,
    state: State,
    different: Option<u64>,
    pixels: Option<u64>,
    greatest: Option<u8>,
    first: &'a [Pixel],
    #[serde(skip_serializing_if = "Option::is_none")]
    ids: Option<Ids<'a>>,
    written: &'a [String],
    error: Option<&'a str>,
}

#[derive(Serialize)]
struct Ids<'a> {
    golden: &'a str,
    state: State,
    different: Option<u64>,
    first: &'a [IdPixel],
}

/// The report as JSON, one line.
pub(super) fn json(outcomes: &[Outcome], device: &str, how: How, unused: &[String]) -> String {
    let scenes = outcomes.iter().map(|outcome| {
        let picture = outcome.picture.as_ref();
        Scene {
            scene: &outcome.scene,
            golden: picture.map(|found| found.golden.as_str()),
            state: outcome.state,
            different: picture.and_then(|found| found.different),
            pixels: outcome.pixels,
            greatest: picture.and_then(|found| found.greatest),
            first: picture.map_or(&[], |found| &found.first),
            ids: outcome.ids.as_ref().map(|found| Ids {
                golden: &found.golden,
                state: found.state,
                different: found.different,
                first: &found.first,
            }),
            written: &outcome.written,
            error: outcome.error.as_deref(),
        }
    });
    let How { max_different, max_delta, .. } = how;
    let sums = Sums::of(outcomes);
    let scenes = scenes.collect();
    let json = Json { version: 1, sums, device, max_different, max_delta, unused, scenes };
    let json = serde_json::to_string(&json).expect("numbers and strings are always JSON");
    format!("{}\n", text::json(&json))
}

/// Text as XML has it in an attribute or between tags.
fn escaped(words: &str) -> String {
    let mut out = String::new();
    for c in text::lines(words).chars() {
        match c {
            '&' => out += "&amp;",
            '<' => out += "&lt;",
            '>' => out += "&gt;",
            '"' => out += "&quot;",
            // In an attribute they would be read as blanks.
            '\n' => out += "&#10;",
            '\t' => out += "&#9;",
            c => out.push(c),
        }
    }
    out
}

/// The report as JUnit XML: a case for each scene, without times, so that equal runs give equal
/// files.
pub(super) fn junit(outcomes: &[Outcome]) -> String {
    let Sums { failed, errors, .. } = Sums::of(outcomes);
    let sums = format!(
        "name=\"planisphere check\" tests=\"{}\" failures=\"{failed}\" errors=\"{errors}\"",
        outcomes.len()
    );
    let mut xml = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
    let _ = writeln!(xml, "<testsuites {sums}>\n  <testsuite {sums} skipped=\"0\">");
    for outcome in outcomes {
        let [name, scene] = [&outcome.name, &outcome.scene].map(|words| escaped(words));
        let case = format!("    <testcase name=\"{name}\" classname=\"{scene}\" file=\"{scene}\"");
        let tag = match outcome.state {
            State::Error => "error",
            state if state.fails() => "failure",
            _ => {
                let _ = writeln!(xml, "{case}/>");
                continue;
            }
        };
        let (words, below) = (escaped(&outcome.words()), outcome.details().join("\n"));
        let _ = writeln!(
            xml,
            "{case}>\n      <{tag} message=\"{words}\">{}</{tag}>\n    </testcase>",
            escaped(&below)
        );
    }
    xml + "  </testsuite>\n</testsuites>\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    fn failed(name: &str) -> Outcome {
        let pixel = Pixel {
            pixel: [3, 4],
            expected: [1, 2, 3, 255],
            actual: [1, 2, 3, 16],
            spheres: [None],
        };
        let picture = Finding {
            golden: "g/a.png".into(),
            state: State::Failed,
            different: Some(1_048_576),
            greatest: Some(239),
            first: vec![pixel],
            words: "they differ".into(),
        };
        Outcome {
            name: name.into(),
            scene: format!("{name}.toml"),
            state: State::Failed,
            pixels: Some(2_000_000),
            picture: Some(picture),
            ids: None,
            written: Vec::new(),
            error: None,
            code: 1,
        }
    }

    #[test]
    fn what_differs_is_listed() {
        let lines = failed("a").lines();
        let wanted = "FAILED a: they differ\n  pixel (3, 4): #010203 expected, #01020310 drawn, no \
                      sphere\n  and 1,048,575 more\n";
        assert_eq!(lines, wanted);
        let sums = Sums::of(&[failed("a"), failed("b")]);
        assert_eq!(sums.line(false), "2 scenes: 0 ok, 2 failed");
        assert_eq!(Sums::of(&[]).line(true), "0 scenes: 0 written, 0 unchanged");
    }

    #[test]
    fn xml_is_escaped() {
        let xml = junit(&[failed("a<b>&\"c\u{1}\u{202e}")]);
        assert!(xml.contains("name=\"a&lt;b&gt;&amp;&quot;c\\u0001\\u202e\""), "{xml}");
        assert!(xml.contains("sphere&#10;and 1,048,575 more</failure>"), "{xml}");
    }
}
