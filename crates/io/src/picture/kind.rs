//! The formats of pictures: their endings, and what each can hold.

use std::{
    io,
    path::{Path, PathBuf},
};

use super::About;
use crate::png::invalid;
use planisphere_core::text;

/// A format of pictures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Kind {
    /// PNG: of any size, without loss.
    #[default]
    Png,
    /// JPEG: small, with loss.
    Jpeg,
    /// WebP, without loss.
    Webp,
    /// QOI: quickly written and read, without loss.
    Qoi,
    /// TIFF, without loss.
    Tiff,
    /// OpenEXR: channels of floats, which [`Encoder`](super::Encoder) does not write.
    Exr,
}

/// A name whose ending stands for no format of pictures.
#[derive(Debug, thiserror::Error)]
#[error(
    "{} has no ending of a picture; name it .png, .jpg or .jpeg, .webp, .qoi, .tif or .tiff, or \
     .exr", text::name(.0)
)]
pub struct UnknownEnding(
    /// The name.
    pub PathBuf,
);

/// Endings in small letters.
const ENDINGS: [(&str, Kind); 8] = [
    ("png", Kind::Png),
    ("jpg", Kind::Jpeg),
    ("jpeg", Kind::Jpeg),
    ("webp", Kind::Webp),
    ("qoi", Kind::Qoi),
    ("tif", Kind::Tiff),
    ("tiff", Kind::Tiff),
    ("exr", Kind::Exr),
];

impl Kind {
    /// The format that a name's ending stands for, in letters of any case.
    ///
    /// # Errors
    /// When it stands for none; all endings are listed.
    pub fn of(path: &Path) -> Result<Self, UnknownEnding> {
        let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or_default();
        let found = ENDINGS.iter().find(|(known, _)| ending.eq_ignore_ascii_case(known));
        found.map(|(_, kind)| *kind).ok_or_else(|| UnknownEnding(path.into()))
    }

    /// What the format is called.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Png => "PNG",
            Self::Jpeg => "JPEG",
            Self::Webp => "WebP",
            Self::Qoi => "QOI",
            Self::Tiff => "TIFF",
            Self::Exr => "OpenEXR",
        }
    }

    /// Whether a file of this format keeps its pixels as they are given.
    #[must_use]
    pub const fn is_lossless(self) -> bool {
        !matches!(self, Self::Jpeg)
    }

    /// Whether rows are written as they come; of others all pixels are in memory until the end.
    #[must_use]
    pub const fn is_streamed(self) -> bool {
        matches!(self, Self::Png)
    }

    /// Whether it holds alpha.
    #[must_use]
    pub const fn holds_alpha(self) -> bool {
        !matches!(self, Self::Jpeg)
    }

    /// Whether it holds 16 bits a channel.
    #[must_use]
    pub const fn holds_depth16(self) -> bool {
        matches!(self, Self::Png | Self::Tiff)
    }

    /// Whether it holds [`About::dpi`], which is left out of others.
    #[must_use]
    pub const fn holds_dpi(self) -> bool {
        matches!(self, Self::Png | Self::Jpeg | Self::Tiff)
    }

    /// Whether it holds [`About::text`], which is left out of others.
    #[must_use]
    pub const fn holds_text(self) -> bool {
        matches!(self, Self::Png)
    }

    /// Most pixels of a side. A JPEG could have 65535, but most programs read it with a library
    /// that refuses more than 65500.
    #[must_use]
    pub const fn longest_side(self) -> u32 {
        match self {
            Self::Jpeg => 65_500,
            Self::Webp => 16_383,
            _ => i32::MAX as u32,
        }
    }

    /// Refuses a picture that a file of this format cannot hold.
    pub(super) fn check(self, about: &About) -> io::Result<()> {
        /// Most pixels of a QOI, which its definition does not limit but its readers do.
        const OF_A_QOI: u64 = 400_000_000;
        let (name, [width, height]) = (self.name(), about.size);
        let most = self.longest_side();
        if width.max(height) > most {
            return Err(invalid(format!(
                "a {name} has at most {most} pixels a side, and the picture is {width} x {height}; \
                 make it smaller, or write a .png"
            )));
        }
        if self == Self::Qoi && u64::from(width) * u64::from(height) > OF_A_QOI {
            return Err(invalid(format!(
                "a {name} has at most {OF_A_QOI} pixels, and the picture is {width} x {height}; \
                 make it smaller, or write a .png"
            )));
        }
        if about.alpha && !self.holds_alpha() {
            return Err(invalid(format!(
                "a {name} holds no alpha, and the picture has a transparent background; give it a \
                 colour, or write a .png or .webp"
            )));
        }
        if about.depth16 && !self.holds_depth16() {
            return Err(invalid(format!(
                "a {name} has 8 bits a channel, and 16 are asked for; ask for 8, or write a .png \
                 or .tiff"
            )));
        }
        if about.dpi.is_some_and(|dpi| !(dpi.is_finite() && dpi > 0.0)) {
            return Err(invalid("the dots per inch are no positive number; give one such as 300"));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn endings_stand_for_formats() {
        for (name, kind) in [
            ("a.png", Kind::Png),
            ("a.b.JPG", Kind::Jpeg),
            ("/c.d/e.Jpeg", Kind::Jpeg),
            ("a.webp", Kind::Webp),
            ("a.qoi", Kind::Qoi),
            ("a.TIF", Kind::Tiff),
            ("a.tiff", Kind::Tiff),
            ("a.exr", Kind::Exr),
        ] {
            assert_eq!(Kind::of(Path::new(name)).unwrap(), kind);
        }
        for name in ["png", ".png", "a.pn", "a.png.gz", "a.gif", ""] {
            let error = Kind::of(Path::new(name)).unwrap_err().to_string();
            let listed = ENDINGS.iter().all(|(ending, _)| error.contains(&format!(".{ending}")));
            assert!(listed, "{error}");
        }
    }
}
