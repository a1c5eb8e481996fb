//! Pictures that move: GIF and APNG, in an endless loop.

use std::{
    borrow::Cow,
    fmt,
    io::{self, Write},
    path::{Path, PathBuf},
};

use ::png::{BlendOp, Compression, DisposeOp, Writer};
use gif::{DisposalMethod, EncodingError, Frame, Repeat};

use super::About;
use crate::png::{head, into_io, invalid};
use planisphere_core::text;

/// A format of animations.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Moving {
    /// GIF: played everywhere, of at most 256 colours a frame.
    Gif,
    /// Animated PNG: without loss.
    Apng,
}

/// A name whose ending stands for no format of animations.
#[derive(Debug, thiserror::Error)]
#[error("{} has no ending of an animation; name it .gif or .apng", text::name(.0))]
pub struct UnknownEnding(
    /// The name.
    pub PathBuf,
);

impl Moving {
    /// The format that a name's ending stands for, in letters of any case.
    ///
    /// # Errors
    /// When it stands for none; all endings are listed.
    pub fn of(path: &Path) -> Result<Self, UnknownEnding> {
        let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or_default();
        match ending.to_ascii_lowercase().as_str() {
            "gif" => Ok(Self::Gif),
            "apng" => Ok(Self::Apng),
            _ => Err(UnknownEnding(path.into())),
        }
    }
}

/// How many colours a palette holds.
const PALETTE: usize = 256;

/// How thoroughly colours are chosen where there are too many: 1 is the best, 30 the fastest.
const SPEED: i32 = 10;

/// Hundredths of a second that a frame of a GIF is shown at least: programs show one of less for
/// ten of them.
const SHORTEST: u64 = 2;

/// An animation whose frames come one by one.
pub struct Animation<W: Write> {
    format: Format<W>,
    size: [u32; 2],
    alpha: bool,
    frames: u32,
    done: u32,
}

enum Format<W: Write> {
    Gif { encoder: gif::Encoder<W>, delay: [u64; 2] },
    Apng { writer: Writer<W>, values: Vec<u8> },
}

impl<W: Write> Animation<W> {
    /// Begins an animation of so many frames, each of which is shown for a fraction of a second.
    ///
    /// A GIF loses colours: a frame of more than 256 gets the 256 that are near to most of its
    /// pixels. It has no resolution and no texts, and its pixels are clear or not. Its frames last
    /// whole hundredths of a second, which come in such a mixture that no frame begins more than
    /// half a hundredth too early or late. An APNG keeps all.
    ///
    /// # Errors
    /// The writer's; of the kind `InvalidInput` when the format cannot hold such an animation.
    pub fn new(
        out: W,
        kind: Moving,
        about: &About,
        frames: u32,
        delay: [u16; 2],
    ) -> io::Result<Self> {
        let [width, height] = about.size;
        if frames == 0 || delay.contains(&0) || about.size.contains(&0) {
            let [part, of] = delay;
            return Err(invalid(format!(
                "{frames} frames of {width} x {height} pixels for {part}/{of} seconds each are no \
                 animation; none of these is 0"
            )));
        }
        if about.depth16 {
            return Err(invalid(
                "an animation has 8 bits a channel, and 16 are asked for; ask for 8",
            ));
        }
        let format = match kind {
            Moving::Gif => begin_gif(out, about, delay)?,
            Moving::Apng => begin_apng(out, about, frames, delay)?,
        };
        Ok(Self { format, size: about.size, alpha: about.alpha, frames, done: 0 })
    }

    /// Takes the next frame: red, green, blue and straight alpha, in sRGB.
    ///
    /// # Errors
    /// The writer's; of the kind `InvalidInput` when the pixels are no frame, one too many comes,
    /// or one for a GIF has a pixel that is partly clear.
    pub fn push_frame(&mut self, pixels: &[[u8; 4]]) -> io::Result<()> {
        let [width, height] = self.size;
        if self.done == self.frames {
            return Err(invalid(format!("a frame comes after all {}", self.frames)));
        }
        if pixels.len() as u64 != u64::from(width) * u64::from(height) {
            return Err(invalid(format!(
                "{} pixels are no frame of {width} x {height}",
                pixels.len()
            )));
        }
        match &mut self.format {
            Format::Gif { encoder, delay } => {
                let mut frame = frame(self.size.map(|side| side as u16), pixels, self.alpha)?;
                frame.delay = lasting(*delay, self.done.into());
                encoder.write_frame(&frame).map_err(of_gif)?;
            }
            Format::Apng { writer, values } => {
                values.clear();
                if self.alpha {
                    values.extend_from_slice(pixels.as_flattened());
                } else {
                    values.extend(pixels.iter().flat_map(|[r, g, b, _]| [*r, *g, *b]));
                }
                writer.write_image_data(values).map_err(into_io)?;
            }
        }
        self.done += 1;
        Ok(())
    }

    /// Ends the file, after all of its frames.
    ///
    /// # Errors
    /// The writer's; of the kind `InvalidInput` when frames are missing.
    pub fn finish(self) -> io::Result<()> {
        if self.done < self.frames {
            return Err(invalid(format!("{} frames are missing", self.frames - self.done)));
        }
        match self.format {
            Format::Gif { encoder, .. } => encoder.into_inner().map_err(of_gif)?.flush(),
            Format::Apng { writer, .. } => writer.finish().map_err(into_io),
        }
    }
}

impl<W: Write> fmt::Debug for Animation<W> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { size, frames, done, .. } = self;
        f.debug_struct("Animation")
            .field("size", size)
            .field("frames", frames)
            .field("done", done)
            .finish_non_exhaustive()
    }
}

fn begin_gif<W: Write>(out: W, about: &About, delay: [u16; 2]) -> io::Result<Format<W>> {
    let [width, height] = about.size;
    let (Ok(wide), Ok(high)) = (u16::try_from(width), u16::try_from(height)) else {
        return Err(invalid(format!(
            "a GIF has at most {} pixels a side, and a frame is {width} x {height}; make it \
             smaller, or write an .apng",
            u16::MAX
        )));
    };
    let [part, of] = delay.map(u64::from);
    if 100 * part < SHORTEST * of {
        return Err(invalid(format!(
            "{part}/{of} seconds are too short for a frame of a GIF: programs would show it for a \
             tenth; give it 1/50 or more, or write an .apng"
        )));
    }
    if 100 * part > u64::from(u16::MAX) * of {
        return Err(invalid(format!(
            "{part}/{of} seconds are too long for a frame of a GIF; give it 655 or less"
        )));
    }
    let mut encoder = gif::Encoder::new(out, wide, high, &[]).map_err(of_gif)?;
    encoder.set_repeat(Repeat::Infinite).map_err(of_gif)?;
    Ok(Format::Gif { encoder, delay: [part, of] })
}

fn begin_apng<W: Write>(
    out: W,
    about: &About,
    frames: u32,
    [part, of]: [u16; 2],
) -> io::Result<Format<W>> {
    let mut encoder = head::encoder(out, about)?;
    encoder.set_compression(Compression::Fast);
    encoder.set_animated(frames, 0).map_err(into_io)?;
    encoder.set_frame_delay(part, of).map_err(into_io)?;
    // A frame replaces the one before it, with its alpha.
    encoder.set_blend_op(BlendOp::Source).map_err(into_io)?;
    encoder.set_dispose_op(DisposeOp::None).map_err(into_io)?;
    let mut writer = encoder.write_header().map_err(into_io)?;
    head::write_texts(&mut writer, about)?;
    Ok(Format::Apng { writer, values: Vec::new() })
}

/// How many hundredths of a second a frame is shown: until the next one is due, rounded.
fn lasting([part, of]: [u64; 2], frame: u64) -> u16 {
    let due = |frame: u64| (200 * part * frame + of) / (2 * of);
    (due(frame + 1) - due(frame)) as u16
}

/// A frame of a GIF, with a palette of its own.
fn frame(size: [u16; 2], pixels: &[[u8; 4]], alpha: bool) -> io::Result<Frame<'static>> {
    let full = |[red, green, blue, _]: [u8; 4]| [red, green, blue, u8::MAX];
    let mut laid: Vec<[u8; 4]> = Vec::with_capacity(pixels.len());
    for &pixel in pixels {
        laid.push(match pixel[3] {
            _ if !alpha => full(pixel),
            u8::MAX => pixel,
            // The colour of what is clear is not seen.
            0 => [0; 4],
            partly => {
                return Err(invalid(format!(
                    "a pixel of a GIF is clear or not, and one has an alpha of {partly}; give the \
                     picture a background colour, or write an .apng"
                )));
            }
        });
    }
    let mut frame = exact(size, &laid).unwrap_or_else(|| {
        Frame::from_rgba_speed(size[0], size[1], laid.as_flattened_mut(), SPEED)
    });
    // What was clear must not show the frame before.
    frame.dispose = if alpha { DisposalMethod::Background } else { DisposalMethod::Keep };
    Ok(frame)
}

/// A frame with exactly its colours, unless there are too many.
fn exact([width, height]: [u16; 2], pixels: &[[u8; 4]]) -> Option<Frame<'static>> {
    let mut colors: Vec<[u8; 4]> = Vec::with_capacity(PALETTE + 1);
    for alike in pixels.chunk_by(|a, b| a == b) {
        if let Err(at) = colors.binary_search(&alike[0]) {
            colors.insert(at, alike[0]);
            if colors.len() > PALETTE {
                return None;
            }
        }
    }
    let mut indices = Vec::with_capacity(pixels.len());
    for alike in pixels.chunk_by(|a, b| a == b) {
        let index = colors.binary_search(&alike[0]).ok()? as u8;
        indices.resize(indices.len() + alike.len(), index);
    }
    let clear = colors.iter().position(|color| color[3] == 0);
    Some(Frame {
        width,
        height,
        buffer: Cow::Owned(indices),
        palette: Some(colors.iter().flat_map(|[r, g, b, _]| [*r, *g, *b]).collect()),
        transparent: clear.map(|index| index as u8),
        ..Frame::default()
    })
}

/// The writer's own errors as they are.
fn of_gif(error: EncodingError) -> io::Error {
    match error {
        EncodingError::Io(error) => error,
        other => io::Error::other(other),
    }
}
