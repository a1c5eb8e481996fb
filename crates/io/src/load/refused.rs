//! Why a file is refused, before it is told for which file and at which place.

use crate::{load::report::CANCELLED, npy::read::NotNpy};
use planisphere_core::drawing::Control;

/// Why a file is not what can be used, and what to do about it: one line each.
#[derive(Clone, Debug)]
pub(crate) struct Refused {
    /// What is wrong, to be read after the file's name.
    pub words: String,
    /// What to do. Where that is written in Python, `array` is what the file holds.
    pub fix: String,
}

impl Refused {
    pub fn new(words: impl Into<String>, fix: impl Into<String>) -> Self {
        Self { words: words.into(), fix: fix.into() }
    }

    /// Ends what is read once it is cancelled; whoever loads then says so in place of this.
    pub fn if_cancelled(control: &Control) -> Result<(), Self> {
        if control.is_cancelled() { Err(Self::new(CANCELLED, "")) } else { Ok(()) }
    }
}

impl From<NotNpy> for Refused {
    fn from(error: NotNpy) -> Self {
        let fix = match error {
            NotNpy::Zip => {
                "name an .npy file: load the archive with numpy.load, and give the one array of it \
                 that is meant here to numpy.save"
            }
            NotNpy::Compressed => "unpack it with gunzip",
            NotNpy::Pickle => "load it with pickle.load, and give the array to numpy.save",
            NotNpy::Hdf5 => "load the data set that is meant with h5py, and give it to numpy.save",
            NotNpy::Bad(_) => "write the array with numpy.save(name, array)",
        };
        Self::new(error.to_string(), fix)
    }
}
