//! Which frames of a trajectory: `A..B:STEP`, and the numbers of those that are there.

use super::Failure;
use planisphere_io::{
    load::Control,
    particles::{File, Frame},
};

/// Numbers of frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Frames {
    pub first: usize,
    /// One past the last, if it is given.
    end: Option<usize>,
    pub step: usize,
}

pub(super) fn parse_frames(typed: &str) -> Result<Frames, String> {
    let fix = || "write A..B, A.. or A..B:STEP, such as 0..100:10; B is not among them".to_owned();
    let number = |text: &str| text.trim().parse::<usize>().map_err(|_| fix());
    let (range, step) = match typed.split_once(':') {
        Some((range, step)) => (range, number(step)?),
        None => (typed, 1),
    };
    let (first, end) = range.split_once("..").ok_or_else(fix)?;
    let first = if first.trim().is_empty() { 0 } else { number(first)? };
    let end = if end.trim().is_empty() { None } else { Some(number(end)?) };
    if step == 0 || end.is_some_and(|end| end <= first) {
        return Err(fix());
    }
    Ok(Frames { first, end, step })
}

impl Frames {
    /// The numbers of these frames of a file, one at least.
    ///
    /// # Errors
    /// When the first or the last of them is not there.
    pub fn numbers(self, file: &File, control: &Control) -> Result<Vec<usize>, Failure> {
        let end = match self.end {
            Some(end) => {
                file.number(Frame::FromFirst(end - 1), control)?;
                end
            }
            // The first must be there.
            None => {
                file.number(Frame::FromFirst(self.first), control)?;
                file.frames(control)?
            }
        };
        Ok((self.first..end).step_by(self.step).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_of_frames() {
        let frames = |first, end, step| Ok(Frames { first, end, step });
        assert_eq!(parse_frames("0..10"), frames(0, Some(10), 1));
        assert_eq!(parse_frames("5.."), frames(5, None, 1));
        assert_eq!(parse_frames("..4:2"), frames(0, Some(4), 2));
        for bad in ["", "5", "5..5", "5..2", "0..5:0", "a..b", "0..5:-1"] {
            assert!(parse_frames(bad).is_err(), "{bad}");
        }
    }
}
