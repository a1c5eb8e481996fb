//! An open file of particles: its frames, found one after another as they are asked for.

use std::{fmt, ops::Range, sync::Mutex};

use bytes::Bytes;

use super::{Data, Format, Particles, Reader, format::Content};
use crate::input::{
    mapped::ChangedFile,
    report::{Fault, LoadError},
};
use planisphere_core::{
    drawing::Control,
    scene::{Block, Colors, Radii, Reals},
};

/// Which frame is meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Frame {
    /// Counted from the first, which is 0.
    FromFirst(usize),
    /// Counted from the last, which is 0.
    FromLast(usize),
}

impl From<i64> for Frame {
    /// Counted from the first, which is 0; of a negative number from the last, which is -1.
    fn from(number: i64) -> Self {
        let places = usize::try_from(number.unsigned_abs()).unwrap_or(usize::MAX);
        if number < 0 { Self::FromLast(places - 1) } else { Self::FromFirst(places) }
    }
}

impl Default for Frame {
    fn default() -> Self {
        Self::FromFirst(0)
    }
}

/// An open file of particles.
pub struct File {
    name: String,
    format: Format,
    title: String,
    notes: Vec<String>,
    data: Data,
    reader: Box<dyn Reader>,
    /// What a trajectory lacks: the columns of another file's first frame.
    topology: Option<Particles>,
    found: Mutex<Found>,
}

/// Whether a text has carriage returns, and no line feed.
fn is_of_lone_returns(text: &[u8]) -> bool {
    let beginning = &text[..text.len().min(1 << 16)];
    beginning.contains(&b'\r') && !beginning.contains(&b'\n')
}

/// The frames that were found so far.
#[derive(Default)]
struct Found {
    frames: Vec<Range<usize>>,
    /// Whether there are no more.
    all: bool,
}

impl fmt::Debug for File {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("File")
            .field("name", &self.name)
            .field("format", &self.format)
            .finish_non_exhaustive()
    }
}

impl File {
    /// Opens bytes of a format that are in memory, as they are: nothing is unpacked. `name` is for
    /// messages.
    ///
    /// # Errors
    /// When they are no such file.
    pub fn of_bytes(
        name: impl Into<String>,
        format: Format,
        bytes: impl Into<Bytes>,
    ) -> Result<Self, LoadError> {
        Self::open(name.into(), format, Data::from(bytes.into()))
    }

    /// Opens bytes of a format; `name` is for messages.
    ///
    /// # Errors
    /// When they are no such file.
    pub(crate) fn open(name: String, format: Format, data: Data) -> Result<Self, LoadError> {
        let data = match format.content() {
            Content::Lines | Content::Text => data.without_mark(),
            Content::Bytes | Content::Trajectory => data,
        };
        if data.as_slice().trim_ascii().is_empty() {
            let fix = "see why what was to write it has written nothing, or name another file";
            return Err(LoadError::of_file(&name, "is empty", fix));
        }
        if format.content() == Content::Lines && is_of_lone_returns(data.as_slice()) {
            return Err(LoadError::of_file(
                &name,
                "its lines end with carriage returns alone, as on old Macintoshes",
                "write line feeds in their place: tr '\\r' '\\n' <OLD >NEW",
            ));
        }
        match format.open(&data) {
            Ok(reader) => {
                let (title, notes) = (format.title().into(), Vec::new());
                let (topology, found) = (None, Mutex::default());
                Ok(Self { name, format, title, notes, data, reader, topology, found })
            }
            Err(fault) => Err(fault.into_error_in(&name, data.as_slice())),
        }
    }

    /// The same file, whose particles are those of another one: they have its columns, beside
    /// their own.
    #[must_use]
    pub fn with_topology(mut self, topology: Particles) -> Self {
        self.topology = Some(topology);
        self
    }

    /// What it is called in messages.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The same file, of which more is to be said: how it is compressed, and what should be known
    /// of how it was opened, each one line.
    #[must_use]
    pub(crate) fn with_words(mut self, packed: Option<&str>, notes: Vec<String>) -> Self {
        self.title = match packed {
            Some(packed) => format!("{}, {packed}", self.format.title()),
            None => self.format.title().into(),
        };
        self.notes = notes;
        self
    }

    /// What its format is called, and how it is compressed.
    pub fn title(&self) -> &str {
        &self.title
    }

    /// What should be known of how it was opened, each one line.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// How many frames there are, if all were found.
    pub fn known_frames(&self) -> Option<usize> {
        let found = self.found();
        found.all.then_some(found.frames.len())
    }

    /// Whether numbers of spheres lie in this file, and not in memory of their own.
    pub(crate) fn is_in_place(&self, block: &Block) -> bool {
        let file = self.data.as_slice().as_ptr_range();
        let inside = |start: *const u8| file.contains(&start);
        let reals = |reals: &Reals| match reals {
            Reals::F32(values) => inside(values.as_slice().as_ptr().cast()),
            Reals::F64(values) => inside(values.as_slice().as_ptr().cast()),
        };
        let radii = matches!(&block.radii, Radii::Each(radii) if reals(radii));
        let colors = match &block.colors {
            Colors::Each(colors) => inside(colors.as_slice().as_ptr()),
            Colors::Same(_) => false,
        };
        reals(&block.centers) || radii || colors
    }

    /// Its format.
    pub fn format(&self) -> Format {
        self.format
    }

    /// How many frames there are. All of the file is looked at, the first time.
    ///
    /// # Errors
    /// When a frame is cut short; it says how many are whole.
    pub fn frames(&self, control: &Control) -> Result<usize, LoadError> {
        self.find(usize::MAX, control).map_err(|fault| self.error(fault))?;
        Ok(self.found().frames.len())
    }

    /// Whether it is known that there are more frames than the first so many; looks no farther
    /// than needed.
    ///
    /// # Errors
    /// When a frame before that is cut short.
    pub fn has_more_than(&self, frames: usize, control: &Control) -> Result<bool, LoadError> {
        self.find(frames, control).map_err(|fault| self.error(fault))?;
        Ok(self.found().frames.len() > frames)
    }

    /// The number of a frame, counted from the first.
    ///
    /// # Errors
    /// When there is none.
    pub fn number(&self, frame: Frame, control: &Control) -> Result<usize, LoadError> {
        let none = |frames: usize, what: String| {
            if frames == 0 {
                return self.error(Fault::whole(
                    "there are no particles in it: it has no frame of atoms",
                    "write it again, or name another file",
                ));
            }
            let fix = match frames {
                1 => "leave out --frame: there is one frame".into(),
                _ => format!("write --frame 0 to --frame {}, or --frame last", frames - 1),
            };
            self.error(Fault::whole(format!("there is no frame {what}"), fix))
        };
        match frame {
            Frame::FromFirst(number) => match self.has_more_than(number, control)? {
                true => Ok(number),
                false => Err(none(self.found().frames.len(), number.to_string())),
            },
            Frame::FromLast(number) => {
                let frames = self.frames(control)?;
                let missing = || none(frames, format!("-{}", number.saturating_add(1)));
                frames.checked_sub(number.saturating_add(1)).ok_or_else(missing)
            }
        }
    }

    /// Reads a frame, counted from the first.
    ///
    /// # Errors
    /// When there is no such frame; what is wrong with it; when it is cancelled.
    pub fn read(&self, number: usize, control: &Control) -> Result<Particles, LoadError> {
        let number = self.number(Frame::FromFirst(number), control)?;
        let range = self.found().frames[number].clone();
        let read = self.reader.read(&self.data, range, control);
        let particles = read.map_err(|fault| match control.is_cancelled() {
            true => LoadError::cancelled(),
            false => self.error(self.in_frame(number, fault)),
        })?;
        self.complete(number, particles)
    }

    /// A fault in a frame, which is named where there is no line that is.
    fn in_frame(&self, number: usize, fault: Fault) -> Fault {
        match fault.has_place() || self.format.content() != Content::Trajectory {
            true => fault,
            false => fault.of(&format!("frame {number}: ")),
        }
    }

    /// Adds the columns of the topology.
    fn complete(&self, number: usize, mut particles: Particles) -> Result<Particles, LoadError> {
        let Some(topology) = &self.topology else { return Ok(particles) };
        let (found, wanted) = (particles.len(), topology.len());
        if found != wanted {
            return Err(self.error(Fault::whole(
                format!("frame {number} has {found} atoms, but the topology has {wanted}"),
                "name the topology that this file was written with",
            )));
        }
        let own: Vec<&str> = particles.columns.iter().map(|column| &*column.name).collect();
        let missing = topology.columns.iter().filter(|column| !own.contains(&&*column.name));
        let missing: Vec<_> = missing.cloned().collect();
        particles.columns.extend(missing);
        particles.cell = particles.cell.or(topology.cell);
        Ok(particles)
    }

    fn found(&self) -> std::sync::MutexGuard<'_, Found> {
        self.found.lock().expect("no thread panics while it looks for frames")
    }

    /// Finds more frames, up to one of a number or the end.
    fn find(&self, number: usize, control: &Control) -> Result<(), Fault> {
        let mut found = self.found();
        while !found.all && found.frames.len() <= number {
            Fault::if_cancelled(control)?;
            let at = found.frames.last().map_or(0, |frame| frame.end);
            match self.reader.frame(&self.data, at) {
                Ok(Some(frame)) => {
                    // Of what is passed over no memory stays taken.
                    if found.frames.len() < number {
                        self.data.done(frame.clone());
                    }
                    found.frames.push(frame);
                }
                Ok(None) => found.all = true,
                Err(fault) => {
                    let whole = match found.frames.len() {
                        0 => return Err(fault),
                        1 => {
                            "; this is frame 1, and the frame before it is whole: --frame 0".into()
                        }
                        n => format!(
                            "; this is frame {n}, and the frames before it are whole: --frame 0 to \
                             --frame {}",
                            n - 1
                        ),
                    };
                    return Err(fault.but(&whole));
                }
            }
        }
        Ok(())
    }

    fn error(&self, fault: Fault) -> LoadError {
        fault.into_error_in(&self.name, self.data.as_slice())
    }

    /// Whether the file is what it was when it was opened; to be asked when something was read.
    ///
    /// # Errors
    /// When it may have changed.
    pub fn unchanged(&self) -> Result<(), ChangedFile> {
        self.data.mapped().and_then(|mapped| mapped.changed()).map_or(Ok(()), Err)
    }

    /// The bytes.
    pub(crate) fn data(&self) -> &Data {
        &self.data
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::particles::Values;

    /// Bytes as a file of a format, for the tests of readers.
    pub fn opened(format: Format, bytes: impl Into<Vec<u8>>) -> Result<File, LoadError> {
        File::of_bytes("it", format, bytes.into())
    }

    /// A frame of them.
    pub fn frame(
        format: Format,
        bytes: impl Into<Vec<u8>>,
        number: usize,
    ) -> Result<Particles, LoadError> {
        opened(format, bytes)?.read(number, &Control::new())
    }

    /// The positions of particles.
    pub fn centers(particles: &Particles) -> Vec<[f64; 3]> {
        let at = |row: usize| [0, 1, 2].map(|axis| particles.centers.get(3 * row + axis));
        (0..particles.len()).map(at).collect()
    }

    /// A column's values as text.
    pub fn words(particles: &Particles, name: &str) -> Vec<String> {
        let column = particles.column(name).unwrap_or_else(|| panic!("no {name}"));
        match &column.values {
            Values::Words(words) => {
                (0..words.codes.len()).map(|row| words.get(row).into()).collect()
            }
            values => (0..values.len()).map(|row| values.get(row).unwrap().to_string()).collect(),
        }
    }

    /// The first coordinate of each position.
    pub fn x(particles: &Particles) -> Vec<f64> {
        centers(particles).iter().map(|center| center[0]).collect()
    }

    #[cfg(all(feature = "lammps", feature = "pdb"))]
    #[test]
    fn a_mark_is_no_text() {
        let row =
            "ATOM      1  N   ALA A   1       1.000   2.000   3.000  1.00  0.00           N\n";
        let text = format!("\u{feff}{row}{row}");
        assert_eq!(Format::of_content(text.as_bytes()), Some(Format::Pdb));
        assert_eq!(frame(Format::Pdb, text, 0).unwrap().len(), 2);
        let error = opened(Format::Pdb, row.replace('\n', "\r").repeat(2)).expect_err("one line");
        assert!(error.to_string().contains("carriage returns alone"), "{error}");
        let cut = format!("{row}{}", &row[..52]);
        let error = frame(Format::Pdb, cut, 0).expect_err("cut");
        assert_eq!(error.line(), Some(2), "{error}");
    }
}
