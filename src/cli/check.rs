//! `planisphere check`: draws scenes, and compares each with its golden.

mod golden;
mod report;

use std::{
    collections::BTreeSet,
    ffi::OsString,
    fs,
    path::{Path, PathBuf},
    slice,
};

use self::{
    golden::{Finding, How, IdPixel, Pixel, State},
    report::{Outcome, Sums},
};
use super::{
    Failure,
    args::{CheckRequest, Checked},
    color_on_stderr, complain,
    ends::Ends,
    print,
    progress::Progress,
    render::{Input, say_device, say_read},
    say, unless_changed,
};
use planisphere_io::{
    npy,
    output::{OutputError, Staged, Target, commit},
    picture::png::Decoded,
    png, text,
};
use planisphere_renderer::{Compared, Error, Picture, Renderer, shown};

/// A number with marks between its thousands.
fn count(number: u64) -> String {
    let digits = number.to_string();
    let mut out = String::new();
    for (at, digit) in digits.char_indices() {
        if at > 0 && (digits.len() - at).is_multiple_of(3) {
            out.push(',');
        }
        out.push(digit);
    }
    out
}

/// Checks all scenes; the worst of them decides the exit code.
pub(super) fn run(asked: &CheckRequest) -> Result<(), Failure> {
    asked.folders()?;
    let outputs = asked.outputs()?;
    asked.ends(&outputs, &asked.scenes, &[]).check()?;
    let progress = Progress::step("starting the device");
    let renderer = Renderer::open(&asked.picture.device)?;
    drop(progress);
    say_device(&renderer);

    let mut outcomes = Vec::new();
    for scene in &asked.scenes {
        let (outcome, failure) = one(asked, scene, &renderer);
        asked.tell(&outcome.lines())?;
        if let Some(failure) = failure {
            complain(&failure.report(color_on_stderr()));
        }
        outcomes.push(outcome);
    }
    let unused = asked.unused();
    if !unused.is_empty() {
        say(&format!("note: goldens of no scene of this run: {}", unused.join(", ")));
    }
    if let Some(words) = asked.how().tolerance() {
        asked.tell(&format!("{words}\n"))?;
    }
    let sums = Sums::of(&outcomes);
    asked.tell(&format!("{}\n", sums.line(asked.bless)))?;
    if sums.failed > 0 && asked.out.is_none() {
        let words = "--out DIR writes the pictures as they are drawn, and where they differ;\n\
                     --bless accepts them as goldens\n";
        asked.tell(words)?;
    }
    if asked.json {
        print(&report::json(&outcomes, renderer.device(), asked.how(), &unused))?;
    }
    if let Some(target) = &asked.junit {
        let xml = report::junit(&outcomes);
        asked.ends(&outputs, &asked.scenes, &[]).check()?;
        let staged = target.clone().stage(|out| out.write_all(xml.as_bytes()))?;
        commit(vec![staged])?.iter().for_each(|note| say(&format!("note: {note}")));
    }
    match outcomes.iter().map(|outcome| outcome.code).max() {
        None | Some(0) => Ok(()),
        Some(code) => Err(Failure::Told(code)),
    }
}

/// An output, and the option that asked for it.
type Output = (&'static str, Target);

impl CheckRequest {
    fn how(&self) -> How {
        let Self { bless, max_different, max_delta, .. } = *self;
        How { bless, max_different, max_delta, whole: self.picture.region.is_none() }
    }

    /// To people: on standard output, unless data go there.
    fn tell(&self, words: &str) -> Result<(), Failure> {
        if self.text_goes_out() {
            return print(&text::lines(words));
        }
        say(words.trim_end_matches('\n'));
        Ok(())
    }

    /// Whether what is for people goes to standard output.
    fn text_goes_out(&self) -> bool {
        let report = self.junit.as_ref().and_then(Target::descriptor);
        !self.json && report != Some(1)
    }

    /// Refuses names that are no folders, and makes that of goldens that are to be written.
    fn folders(&self) -> Result<(), Failure> {
        let named = [("--goldens", &self.goldens), ("--out", &self.out)];
        for (option, folder) in named.into_iter().filter_map(|(o, f)| Some((o, f.as_ref()?))) {
            if folder.exists() && !folder.is_dir() {
                let name = text::name(folder);
                return Err(Failure::Usage(format!(
                    "{option} {name}: it is a file; name a folder"
                )));
            }
        }
        match &self.goldens {
            Some(folder) if self.bless => make(folder),
            Some(folder) if !folder.exists() => Err(Failure::Usage(format!(
                "--goldens {}: there is no such folder; correct the name, or write goldens into it \
                 with --bless",
                text::name(folder)
            ))),
            _ => Ok(()),
        }
    }

    /// All that may be written, as far as it can be looked at before anything is drawn.
    fn outputs(&self) -> Result<Vec<Output>, Failure> {
        if self.bless {
            for Checked { golden, ids, .. } in &self.scenes {
                let golden = golden.iter().map(|path| (path, "--golden", "a picture", "png"));
                let ids = ids.iter().map(|path| (path, "--ids", "an array", "npy"));
                for (path, option, what, ending) in golden.chain(ids) {
                    Target::File(path.clone()).check_ending(option, what, ending)?;
                }
            }
        }
        let report = self.junit.iter().map(|target| ("--junit", target.clone()));
        Ok(report.chain(self.scenes.iter().flat_map(|scene| self.outputs_of(scene))).collect())
    }

    /// What may be written for a scene: into `--out` only if that is there.
    fn outputs_of(&self, scene: &Checked) -> Vec<Output> {
        if self.bless {
            let both = [&scene.golden, &scene.ids].into_iter().flatten();
            return both.map(|path| ("--bless", Target::File(path.clone()))).collect();
        }
        let Some(folder) = self.out.as_ref().filter(|folder| folder.is_dir()) else {
            return Vec::new();
        };
        let picture = scene.golden.iter().flat_map(|_| [ACTUAL, DIFF]);
        let endings = picture.chain(scene.ids.iter().map(|_| ACTUAL_IDS));
        endings.map(|ending| ("--out", scene.beside(folder, ending))).collect()
    }

    /// What is written, and what is read for some scenes, with the files of these.
    fn ends<'a>(&self, outputs: &'a [Output], scenes: &[Checked], files: &[PathBuf]) -> Ends<'a> {
        let outputs = outputs.iter().map(|(option, target)| (*option, target)).collect();
        let text = if self.json { Some("--json") } else { None };
        let text = text.or(self.text_goes_out().then_some("the report"));
        let mut ends = Ends::new(outputs, text);
        for scene in scenes {
            ends.reads(&scene.scene);
            if !self.bless {
                [&scene.golden, &scene.ids].into_iter().flatten().for_each(|path| ends.reads(path));
            }
        }
        let others = self.reading.others().chain(self.camera.file());
        others.chain(files.iter().map(PathBuf::as_path)).for_each(|path| ends.reads(path));
        ends
    }

    /// Names of the goldens in `--goldens` that no scene has. What a run writes into `--out` is
    /// none.
    fn unused(&self) -> Vec<String> {
        let Some(folder) = &self.goldens else { return Vec::new() };
        let mut known: BTreeSet<OsString> = BTreeSet::new();
        for scene in &self.scenes {
            let names = [".png", ACTUAL, DIFF].map(|ending| scene.with(ending));
            known.extend(names);
        }
        let entries = fs::read_dir(folder).and_then(|entries| {
            entries.map(|entry| entry.map(|entry| entry.file_name())).collect::<Result<Vec<_>, _>>()
        });
        // Goldens in a folder that cannot be listed can be read all the same.
        let entries = entries.unwrap_or_else(|error| {
            let name = text::name(folder);
            say(&format!(
                "note: {name} cannot be listed, so that goldens of no scene are not told: \
                          {error}"
            ));
            Vec::new()
        });
        let is_png = |name: &OsString| {
            Path::new(name).extension().is_some_and(|ending| ending.eq_ignore_ascii_case("png"))
        };
        let unused: BTreeSet<String> = entries
            .iter()
            .filter(|name| is_png(name) && !known.contains(*name))
            .map(text::name)
            .collect();
        unused.into_iter().collect()
    }
}

/// Makes a folder, and those above it.
fn make(folder: &Path) -> Result<(), Failure> {
    fs::create_dir_all(folder)
        .map_err(|source| OutputError::Io { target: text::name(folder), source }.into())
}

/// Endings of files in `--out`.
const ACTUAL: &str = ".actual.png";
const DIFF: &str = ".diff.png";
const ACTUAL_IDS: &str = ".actual.npy";

impl Checked {
    /// Its name with an ending.
    fn with(&self, ending: &str) -> OsString {
        let mut name = self.name.clone();
        name.push(ending);
        name
    }

    /// Its file with an ending in a folder.
    fn beside(&self, folder: &Path, ending: &str) -> Target {
        Target::File(folder.join(self.with(ending)))
    }
}

/// Checks a scene; why that could not be done comes as well.
fn one(asked: &CheckRequest, scene: &Checked, renderer: &Renderer) -> (Outcome, Option<Failure>) {
    let mut outcome = Outcome {
        name: text::name(&scene.name),
        scene: text::name(&scene.scene),
        state: State::Error,
        pixels: None,
        picture: None,
        ids: None,
        written: Vec::new(),
        error: None,
        code: 0,
    };
    match compared(asked, scene, renderer) {
        Ok(found) => {
            outcome.pixels = Some(found.pixels);
            outcome.picture = found.picture.map(|(finding, _)| finding);
            outcome.ids = found.ids;
            outcome.written = found.written;
            let states = [
                outcome.picture.as_ref().map(|found| found.state),
                outcome.ids.as_ref().map(|found| found.state),
            ];
            outcome.state = states.into_iter().flatten().max().unwrap_or(State::Error);
            outcome.code = u8::from(outcome.state.fails());
            (outcome, None)
        }
        Err(failure) => {
            outcome.error = Some(failure.report(false));
            outcome.code = failure.exit_code();
            (outcome, Some(failure))
        }
    }
}

/// What comparing a scene has given.
struct Found {
    pixels: u64,
    /// With the golden, where it has the size of the picture.
    picture: Option<(Finding<Pixel>, Option<Decoded>)>,
    ids: Option<Finding<IdPixel>>,
    written: Vec<String>,
}

/// Draws a scene, compares it, and writes what was asked for.
fn compared(asked: &CheckRequest, scene: &Checked, renderer: &Renderer) -> Result<Found, Failure> {
    let CheckRequest { picture, reading, camera, .. } = asked;
    let input = Input { scene: &scene.scene, picture, reading, camera };
    let (loaded, request) = input.load()?;
    let clear =
        || asked.ends(&asked.outputs_of(scene), slice::from_ref(scene), &loaded.files).check();
    clear()?;
    say_read(&loaded);
    let (mut found, staged) = unless_changed(&loaded.watch, || {
        let progress = Progress::step("drawing");
        let request = if scene.golden.is_none() { request.without_color() } else { request };
        let drawn = renderer.draw(&request)?;
        drop(progress);
        if drawn.ids().iter().all(|id| *id < 0) {
            let name = text::name(&scene.name);
            say(&format!("note: {name}: nothing is seen: {}", request.why_empty()));
        }
        let found = Found::of(asked, scene, &drawn)?;
        let staged = found.staged(asked, scene, &drawn)?;
        Ok((found, staged))
    })?;
    let (names, files): (Vec<String>, Vec<Staged>) = staged.into_iter().unzip();
    if !files.is_empty() {
        // Names may have come to lead elsewhere meanwhile.
        clear()?;
        commit(files)?.iter().for_each(|note| say(&format!("note: {note}")));
    }
    found.written = names;
    if asked.bless {
        let blessed = |state: &mut State| {
            *state = if state.fails() { State::Blessed } else { State::Unchanged };
        };
        found.picture.iter_mut().for_each(|(finding, _)| blessed(&mut finding.state));
        found.ids.iter_mut().for_each(|finding| blessed(&mut finding.state));
    }
    Ok(found)
}

/// What is written.
#[derive(Clone, Copy)]
enum Plane<'a> {
    /// As it is drawn.
    Picture,
    /// Where it differs from a golden.
    Diff(&'a Decoded),
    /// As they are drawn.
    Ids,
}

impl Found {
    fn of(asked: &CheckRequest, scene: &Checked, drawn: &Picture) -> Result<Self, Failure> {
        let how = asked.how();
        let picture = scene.golden.as_ref().map(|path| golden::picture(path, drawn, how));
        let ids = scene.ids.as_ref().map(|path| golden::ids(path, drawn, how));
        let pixels = drawn.ids().len() as u64;
        Ok(Self {
            pixels,
            picture: picture.transpose()?,
            ids: ids.transpose()?,
            written: Vec::new(),
        })
    }

    /// The files of what fails, complete but for their names; with these.
    fn staged(
        &self,
        asked: &CheckRequest,
        scene: &Checked,
        drawn: &Picture,
    ) -> Result<Vec<(String, Staged)>, Failure> {
        let picture = self.picture.as_ref().filter(|(finding, _)| finding.state.fails());
        let ids = self.ids.as_ref().filter(|finding| finding.state.fails());
        let mut wanted: Vec<(Target, Plane)> = Vec::new();
        if asked.bless {
            let own = |path: &Option<PathBuf>| path.clone().map(Target::File);
            let golden = own(&scene.golden).filter(|_| picture.is_some());
            wanted.extend(golden.map(|target| (target, Plane::Picture)));
            let golden = own(&scene.ids).filter(|_| ids.is_some());
            wanted.extend(golden.map(|target| (target, Plane::Ids)));
        } else if let Some(folder) = &asked.out {
            if let Some((_, golden)) = picture {
                wanted.push((scene.beside(folder, ACTUAL), Plane::Picture));
                let diff = golden.as_ref().map(Plane::Diff);
                wanted.extend(diff.map(|diff| (scene.beside(folder, DIFF), diff)));
            }
            wanted.extend(ids.map(|_| (scene.beside(folder, ACTUAL_IDS), Plane::Ids)));
            if !wanted.is_empty() {
                make(folder)?;
            }
        }
        wanted.into_iter().map(|(target, plane)| stage(target, plane, drawn)).collect()
    }
}

/// Writes a plane, and gives it no name yet; with the name that it is to have.
fn stage(target: Target, plane: Plane, drawn: &Picture) -> Result<(String, Staged), Failure> {
    let name = match &target {
        Target::File(path) => text::name(path),
        Target::Stdout => "standard output".into(),
    };
    let mut sink = target.clone().open()?;
    let [width, height] = drawn.size();
    let result = match plane {
        Plane::Picture => drawn.write_png(&mut sink),
        Plane::Ids => {
            let shape = [height as usize, width as usize];
            npy::write_i32(&mut sink, &shape, drawn.ids()).map_err(Error::Io)
        }
        Plane::Diff(golden) => {
            let wanted = Compared { size: golden.size, rgba: &golden.pixels };
            let shown = shown(wanted, drawn.pixels());
            png::write_rgb(&mut sink, golden.size, &shown).map_err(Error::Io)
        }
    };
    result.map_err(|error| match error {
        Error::Io(error) => Failure::Output(target.io(error)),
        other => other.into(),
    })?;
    Ok((name, sink.finish()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thousands_are_marked() {
        let cases = [(0, "0"), (999, "999"), (1000, "1,000"), (1_048_576, "1,048,576")];
        for (number, words) in cases {
            assert_eq!(count(number), words);
        }
    }
}
