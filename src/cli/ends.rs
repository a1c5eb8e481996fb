//! All that a command reads and writes, held against each other before any work: no output may be
//! an input, another output, or what a stream already holds. Files are told by what they are
//! ([`Identity`]), not by what they are called.

use std::{
    collections::HashMap,
    path::Path,
    sync::atomic::{AtomicU8, Ordering::Relaxed},
};

use super::Failure;
use planisphere_io::{
    identity::{Identity, Kind},
    output::{Target, stream_identity},
};

/// What standard error takes.
static TALK: AtomicU8 = AtomicU8::new(ALL);
/// Notes and errors.
const ALL: u8 = 0;
/// Errors only: data go to where standard error goes.
const ERRORS: u8 = 1;
/// Nothing: standard error goes into a file that must stay as it is.
const NOTHING: u8 = 2;

/// Whether a note may be said.
pub(super) fn notes_are_heard() -> bool {
    TALK.load(Relaxed) == ALL
}

/// Whether an error may be said on standard error.
pub(super) fn errors_are_heard() -> bool {
    TALK.load(Relaxed) != NOTHING
}

/// What a command reads and writes.
#[derive(Default)]
pub(super) struct Ends<'a> {
    /// With the option that asked for each; `-o`.
    outputs: Vec<(&'a str, &'a Target)>,
    /// Text on standard output, and what asked for it.
    text: Option<&'a str>,
    /// Inputs that are kept somewhere, and their names.
    inputs: HashMap<Identity, String>,
}

/// Standard output.
const STDOUT: Target = Target::Stdout;

impl<'a> Ends<'a> {
    /// Of outputs, and text that goes to standard output as well.
    pub fn new(outputs: Vec<(&'a str, &'a Target)>, text: Option<&'a str>) -> Self {
        Self { outputs, text, inputs: HashMap::new() }
    }

    /// Adds an input: a file, or `-` for standard input. One that is not there is for the loader to
    /// report.
    pub fn reads(&mut self, path: &Path) {
        if path == Path::new("-") {
            if let Ok(found) = stream_identity(0) {
                self.adds(found, "standard input".into());
            }
        } else if let Ok(found) = Identity::of(path) {
            self.adds(found, planisphere_io::text::name(path));
        }
    }

    fn adds(&mut self, found: Identity, name: String) {
        // What comes from a pipe or a terminal is not kept there.
        if found.kind == Kind::Storage {
            self.inputs.entry(found).or_insert(name);
        }
    }

    /// Refuses outputs that cannot be written, and any two ends that get in each other's way.
    ///
    /// # Errors
    /// The first that is found, with the fix.
    pub fn check(&self) -> Result<(), Failure> {
        let text = self.text.map(|what| (what, &STDOUT));
        let all: Vec<(&str, &Target)> = self.outputs.iter().copied().chain(text).collect();
        let talk = stream_identity(2).ok();
        if let Some(name) = talk.as_ref().and_then(|talk| self.inputs.get(talk)) {
            TALK.store(NOTHING, Relaxed);
            return Err(Failure::Usage(format!(
                "standard error goes into {name}, which is an input; send it elsewhere (2>FILE)"
            )));
        }
        let mut found: Vec<(&str, &Target, Identity)> = Vec::new();
        // Places in `found`: a sequence has very many names.
        let mut alike: HashMap<Identity, Vec<usize>> = HashMap::new();
        for (option, target) in all {
            target.check()?;
            let own = target.identity()?;
            if let Some(name) = self.inputs.get(&own) {
                return Err(Failure::Usage(match target.descriptor() {
                    Some(_) => format!(
                        "{option} goes to {}, which is sent into {name}, an input; send it \
                         elsewhere (>FILE)",
                        stream_words(target)
                    ),
                    None => format!(
                        "{option} {} would replace {name}, an input of this command; give it \
                         another name",
                        words(target)
                    ),
                }));
            }
            let places = alike.entry(own.in_small_letters().unwrap_or(own.clone())).or_default();
            for (other, earlier, theirs) in places.iter().map(|place| &found[*place]) {
                self.apart((other, earlier, theirs), (option, target, &own))?;
            }
            places.push(found.len());
            found.push((option, target, own));
        }
        for (option, target, own) in
            found.iter().filter(|(_, target, _)| target.descriptor().is_none())
        {
            for number in [1, 2] {
                let stream = stream_identity(number).ok();
                if stream.is_some_and(|stream| stream.kind == Kind::Storage && stream == *own) {
                    let name = stream_words(if number == 1 { &STDOUT } else { target });
                    let name = if number == 1 { name } else { "standard error".into() };
                    if number == 2 {
                        TALK.store(NOTHING, Relaxed);
                    }
                    return Err(Failure::Usage(format!(
                        "{name} is sent into {}, which {option} writes; send it elsewhere, or \
                         give {option} another name",
                        words(target)
                    )));
                }
            }
        }
        // Where data go to the stream that people read, nothing may come between them.
        let mixed = found.iter().any(|(option, target, own)| {
            let data = self.text != Some(option);
            data && own.kind != Kind::Null
                && target.descriptor().is_some()
                && talk.as_ref() == Some(own)
        });
        if mixed {
            TALK.store(ERRORS, Relaxed);
        }
        Ok(())
    }

    /// Refuses two outputs that are one.
    fn apart(
        &self,
        (other, earlier, theirs): (&str, &Target, &Identity),
        (option, target, own): (&str, &Target, &Identity),
    ) -> Result<(), Failure> {
        let stream = target.descriptor().filter(|_| earlier.descriptor() == target.descriptor());
        if stream.is_some() {
            return Err(Failure::Usage(format!(
                "{other} and {option} both want {}; give {other} a file or leave one out",
                stream_words(target)
            )));
        }
        let one = theirs == own && own.kind != Kind::Null;
        if one || (theirs.differs_in_case(own) && target.ignores_case()?) {
            let (a, b) = (words(earlier), words(target));
            return Err(Failure::Usage(if a == b {
                format!("{other} and {option} both write {a}; give them two names")
            } else {
                format!(
                    "{other} and {option} both write one file, {a} and {b}; give them two names \
                     that are two files"
                )
            }));
        }
        Ok(())
    }
}

/// A target's name.
fn words(target: &Target) -> String {
    match target {
        Target::Stdout => "standard output".into(),
        Target::File(path) => planisphere_io::text::name(path),
    }
}

/// The name of a target that is a stream.
fn stream_words(target: &Target) -> String {
    match target.descriptor() {
        Some(1) => "standard output".into(),
        Some(2) => "standard error".into(),
        _ => words(target),
    }
}

/// Refuses, before any work, text that would go to a standard output that is closed.
///
/// # Errors
/// When it is.
pub(super) fn stdout_is_open() -> Result<(), Failure> {
    Ok(STDOUT.check()?)
}
