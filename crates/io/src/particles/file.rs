//! An open file of particles: its frames, found one after another as they are asked for.

use std::{fmt, ops::Range, sync::Mutex};

use super::{Data, Format, Particles, Reader};
use crate::load::{LoadError, report::Fault};
use planisphere_core::drawing::Control;

/// Which frame is meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Frame {
    /// Counted from the first, which is 0.
    FromFirst(usize),
    /// Counted from the last, which is 0.
    FromLast(usize),
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
    data: Data,
    reader: Box<dyn Reader>,
    /// What a trajectory lacks: the columns of another file's first frame.
    topology: Option<Particles>,
    found: Mutex<Found>,
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
    /// Opens bytes of a format; `name` is for messages.
    ///
    /// # Errors
    /// When they are no such file.
    pub(crate) fn open(name: String, format: Format, data: Data) -> Result<Self, LoadError> {
        match format.open(&data) {
            Ok(reader) => {
                let (topology, found) = (None, Mutex::default());
                Ok(Self { name, format, data, reader, topology, found })
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
            let fix = match frames {
                0 => "write the file again: it has no frame".into(),
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
            false => self.error(fault),
        })?;
        self.complete(particles)
    }

    /// Adds the columns of the topology.
    fn complete(&self, mut particles: Particles) -> Result<Particles, LoadError> {
        let Some(topology) = &self.topology else { return Ok(particles) };
        let (found, wanted) = (particles.len(), topology.len());
        if found != wanted {
            return Err(self.error(Fault::whole(
                format!("a frame has {found} particles, but the topology has {wanted}"),
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
                Ok(Some(frame)) => found.frames.push(frame),
                Ok(None) => found.all = true,
                Err(fault) => {
                    let whole = match found.frames.len() {
                        0 => return Err(fault),
                        1 => "; the frame before it is whole: --frame 0".into(),
                        n => format!(
                            "; the {n} frames before it are whole: --frame 0 to --frame {}",
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

    /// What is asked whether the file has changed, where it is used where it lies.
    pub(crate) fn data(&self) -> &Data {
        &self.data
    }
}

#[cfg(test)]
pub(super) mod tests {
    use bytes::Bytes;

    use super::*;

    /// Bytes as a file of a format, for the tests of readers.
    pub fn opened(format: Format, bytes: impl Into<Vec<u8>>) -> Result<File, LoadError> {
        File::open("it".into(), format, Data::from(Bytes::from(bytes.into())))
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
}
