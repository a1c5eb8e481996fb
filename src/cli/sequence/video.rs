//! Pictures a second, and the command that makes a video of the files of a sequence.

use std::{fmt, path::Path};

use super::super::template::Template;
use planisphere_io::picture::Kind;

/// Pictures a second: a quotient of whole numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in super::super) struct Fps {
    pictures: u16,
    seconds: u16,
}

impl Fps {
    /// So many each second.
    pub const fn whole(pictures: u16) -> Self {
        Self { pictures, seconds: 1 }
    }

    /// How long each is shown: a fraction of a second.
    pub const fn delay(self) -> [u16; 2] {
        [self.seconds, self.pictures]
    }

    /// Whether there are more than so many a second.
    pub fn is_above(self, pictures: u16) -> bool {
        u32::from(self.pictures) > u32::from(pictures) * u32::from(self.seconds)
    }
}

impl fmt::Display for Fps {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.seconds {
            1 => self.pictures.fmt(f),
            seconds => write!(f, "{}/{seconds}", self.pictures),
        }
    }
}

/// A rate as it is typed: 30, 12.5 or 30000/1001.
pub(super) fn parse_fps(typed: &str) -> Result<Fps, String> {
    let fix = || {
        format!(
            "write pictures a second: a number from 1 on such as 30, 12.5 or 30000/1001, of whole \
             numbers up to {}",
            u16::MAX
        )
    };
    let digits = |text: &str| text.len() <= 9 && text.bytes().all(|byte| byte.is_ascii_digit());
    let number = |text: &str| text.parse::<u64>().ok().filter(|_| digits(text)).ok_or_else(fix);
    let (above, below) = match (typed.split_once('/'), typed.split_once('.')) {
        (Some((above, below)), _) => (number(above)?, number(below)?),
        (None, Some((whole, part))) => {
            let below = 10u64.pow(part.len().min(9) as u32);
            (number(whole)? * below + number(part)?, below)
        }
        (None, None) => (number(typed)?, 1),
    };
    let (mut common, mut rest) = (above, below);
    while rest > 0 {
        (common, rest) = (rest, common % rest);
    }
    let of = |number: u64| u16::try_from(number / common.max(1)).ok().filter(|found| *found > 0);
    match (of(above), of(below)) {
        (Some(pictures), Some(seconds)) => Ok(Fps { pictures, seconds }),
        _ => Err(fix()),
    }
}

/// The files of which a video can be made.
pub(super) struct Files<'a> {
    pub template: &'a Template,
    pub kind: Kind,
    pub size: [u32; 2],
    pub first: usize,
    pub last: usize,
    pub step: usize,
}

impl Files<'_> {
    /// The command line that makes a video of them, for a shell; none where ffmpeg reads no such
    /// files one after another.
    pub fn command(&self, fps: Fps) -> Option<String> {
        let Self { template, kind, size, first, last, step } = self;
        let (before, input) = match (step, kind) {
            (1, _) => {
                let start = match first {
                    0 => String::new(),
                    first => format!("-start_number {first} "),
                };
                (String::new(), format!("{start}-i {}", quoted(&template.pattern())))
            }
            // Numbers with gaps have no pattern: ffmpeg gets the files themselves. It finds where
            // each begins in these formats.
            (_, Kind::Png | Kind::Jpeg | Kind::Webp | Kind::Qoi) => {
                let format = quoted(&template.seq_format());
                let names = format!("seq -f {format} {first} {step} {last}");
                let files = format!("{names} | tr '\\n' '\\0' | xargs -0 cat | ");
                (files, "-f image2pipe -i -".into())
            }
            _ => return None,
        };
        // Four pixels share a colour: sides are even.
        let odd = size.iter().any(|side| side % 2 == 1);
        let pad = if odd { "-vf 'pad=ceil(iw/2)*2:ceil(ih/2)*2' " } else { "" };
        let video = quoted(&template.without_number("mp4").to_string_lossy());
        Some(format!(
            "{before}ffmpeg -framerate {fps} {input} {pad}-c:v libx264 -pix_fmt yuv420p -crf 18 \
             {video}"
        ))
    }
}

/// A word for a shell.
fn quoted(word: &str) -> String {
    let plain = |byte: u8| byte.is_ascii_alphanumeric() || b"%+,-./:=@_".contains(&byte);
    // What begins with a dash would be an option.
    let word = match Path::new(word) {
        path if word.starts_with('-') => Path::new(".").join(path).to_string_lossy().into_owned(),
        _ => word.to_owned(),
    };
    match word.bytes().all(plain) {
        true => word,
        false => format!("'{}'", word.replace('\'', r"'\''")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_are_quotients() {
        let rate = |pictures, seconds| Ok(Fps { pictures, seconds });
        assert_eq!(parse_fps("30"), rate(30, 1));
        assert_eq!(parse_fps("12.5"), rate(25, 2));
        assert_eq!(parse_fps("0.5"), rate(1, 2));
        assert_eq!(parse_fps("23.976"), rate(2997, 125));
        assert_eq!(parse_fps("30000/1001"), rate(30000, 1001));
        for bad in ["", "0", "-1", "1/0", "0/1", "x", "70000", "1e3", "+5", "0.00000001", "1.", "."]
        {
            assert!(parse_fps(bad).is_err(), "{bad}");
        }
        assert_eq!(parse_fps("60000/1001").unwrap().to_string(), "60000/1001");
        assert!(parse_fps("50.1").unwrap().is_above(50) && !Fps::whole(50).is_above(50));
    }

    fn command(name: &str, [first, last, step]: [usize; 3]) -> Option<String> {
        let template = Template::parse("-o", Path::new(name)).unwrap().expect("a template");
        let kind = Kind::of(Path::new(name)).unwrap();
        let size = [64, 48];
        Files { template: &template, kind, size, first, last, step }.command(Fps::whole(30))
    }

    #[test]
    fn the_command_is_right_for_names() {
        assert_eq!(
            command("turn-{frame:04}.png", [0, 119, 1]).unwrap(),
            "ffmpeg -framerate 30 -i turn-%04d.png -c:v libx264 -pix_fmt yuv420p -crf 18 turn.mp4"
        );
        assert_eq!(
            command("it's {frame}.jpg", [5, 9, 1]).unwrap(),
            format!(
                "ffmpeg -framerate 30 -start_number 5 -i {} -c:v libx264 -pix_fmt yuv420p -crf 18 \
                 {}",
                r"'it'\''s %d.jpg'", r"'it'\''s.mp4'"
            )
        );
        assert_eq!(
            command("-{frame:03}.png", [0, 90, 10]).unwrap(),
            "seq -f ./-%03.0f.png 0 10 90 | tr '\\n' '\\0' | xargs -0 cat | ffmpeg -framerate 30 \
             -f image2pipe -i - -c:v libx264 -pix_fmt yuv420p -crf 18 sequence.mp4"
        );
        assert_eq!(command("a-{frame}.tif", [0, 90, 10]), None);
    }
}
