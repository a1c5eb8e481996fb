//! Names of the files of a sequence: `{frame}` stands for the number of a picture.

use std::path::{Path, PathBuf};

use super::Failure;
use planisphere_io::text;

/// A name with a place for a number.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Template {
    before: String,
    /// How many digits the number has at least; zeros come before it.
    digits: usize,
    after: String,
}

impl Template {
    /// Reads a name, which an option gives; none where it has no braces.
    ///
    /// # Errors
    /// When what is in braces is not the number, or comes twice.
    pub fn parse(option: &str, name: &Path) -> Result<Option<Self>, Failure> {
        let shown = text::name(name);
        let wrong = |what: String, fix: &str| {
            Err(Failure::Usage(format!("{option} {shown}: {what}; {fix}")))
        };
        const FIX: &str = "write {frame} for the number of the picture, or {frame:04} for one of \
                           four digits, and no other braces";
        let bytes = name.as_os_str().as_encoded_bytes();
        if !bytes.iter().any(|byte| matches!(byte, b'{' | b'}')) {
            return Ok(None);
        }
        let Some(typed) = name.to_str() else {
            return wrong("the name is not UTF-8".into(), "give one that is");
        };
        let Some((before, rest)) = typed.split_once('{').filter(|(b, _)| !b.contains('}')) else {
            return wrong("a } closes nothing".into(), FIX);
        };
        let Some((inside, after)) = rest.split_once('}') else {
            return wrong("a { is not closed".into(), FIX);
        };
        let Some(digits) = digits(inside) else {
            return wrong(format!("{{{inside}}} stands for nothing"), FIX);
        };
        if after.contains(['{', '}']) {
            return wrong("it has more braces than those of one number".into(), FIX);
        }
        Ok(Some(Self { before: before.into(), digits, after: after.into() }))
    }

    /// The name of a picture.
    pub fn name(&self, number: usize) -> PathBuf {
        let Self { before, digits, after } = self;
        format!("{before}{number:0digits$}{after}").into()
    }

    /// A name into which a number is put where it has none: before its ending.
    pub fn suggested(name: &Path) -> PathBuf {
        let mut file = name.file_stem().unwrap_or_default().to_owned();
        file.push("-{frame:04}");
        if let Some(ending) = name.extension() {
            file.push(".");
            file.push(ending);
        }
        name.with_file_name(file)
    }

    /// As ffmpeg has it.
    pub fn pattern(&self) -> String {
        let number = match self.digits {
            0 => "%d".into(),
            digits => format!("%0{digits}d"),
        };
        let plain = |text: &str| text.replace('%', "%%");
        format!("{}{number}{}", plain(&self.before), plain(&self.after))
    }

    /// As `seq -f` has it.
    pub fn seq_format(&self) -> String {
        let number = match self.digits {
            0 => "%.0f".into(),
            digits => format!("%0{digits}.0f"),
        };
        let plain = |text: &str| text.replace('%', "%%");
        format!("{}{number}{}", plain(&self.before), plain(&self.after))
    }

    /// The name without the number, with another ending.
    pub fn without_number(&self, ending: &str) -> PathBuf {
        let before = self.before.trim_end_matches(['-', '_', '.', ' ']);
        let whole = PathBuf::from(format!("{before}{}", self.after));
        let stem = match whole.file_stem().and_then(|stem| stem.to_str()) {
            // Of `{frame}.png` nothing is left but the ending.
            Some(stem) if !stem.starts_with('.') => stem.to_owned(),
            _ => "sequence".into(),
        };
        whole.with_file_name(format!("{stem}.{ending}"))
    }
}

/// How many digits a number in braces has at least: of `frame` 0, of `frame:04` 4.
fn digits(inside: &str) -> Option<usize> {
    let form = inside.strip_prefix("frame")?;
    if form.is_empty() {
        return Some(0);
    }
    let digits = form.strip_prefix(":0")?;
    let one = digits.len() == 1 && digits != "0";
    digits.parse().ok().filter(|_| one)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(name: &str) -> Result<Option<Template>, Failure> {
        Template::parse("-o", Path::new(name))
    }

    #[test]
    fn numbers_come_into_names() {
        let name = |template: &str, number| {
            let template = parse(template).unwrap().expect("a template");
            template.name(number).to_str().unwrap().to_owned()
        };
        assert_eq!(name("a-{frame}.png", 7), "a-7.png");
        assert_eq!(name("a-{frame:04}.png", 7), "a-0007.png");
        assert_eq!(name("b/{frame:02}", 123), "b/123");
        assert_eq!(parse("a.png").unwrap(), None);
    }

    #[test]
    fn other_braces_are_refused() {
        for (name, word) in [
            ("a-{n}.png", "{n} stands for nothing"),
            ("a-{frame:4}.png", "{frame:4} stands"),
            ("a-{frame:0}.png", "{frame:0} stands"),
            ("a-{frame:00}.png", "stands for nothing"),
            ("a-{frame:012}.png", "stands for nothing"),
            ("a-{}.png", "{} stands"),
            ("{frame}-{frame}.png", "more braces"),
            ("a-{frame.png", "not closed"),
            ("a-}{frame}.png", "closes nothing"),
        ] {
            let failure = parse(name).expect_err("refused").to_string();
            assert!(failure.contains(word) && failure.contains("{frame:04}"), "{failure}");
        }
    }

    #[test]
    fn other_programs_find_the_names() {
        let of = |name: &str| parse(name).unwrap().expect("a template");
        assert_eq!(of("turn-{frame:04}.png").pattern(), "turn-%04d.png");
        assert_eq!(of("5%-{frame}.png").pattern(), "5%%-%d.png");
        assert_eq!(of("turn-{frame:04}.png").seq_format(), "turn-%04.0f.png");
        for (name, video) in [
            ("turn-{frame:04}.png", "turn.mp4"),
            ("a/b_{frame}_c.png", "a/b_c.mp4"),
            ("{frame}.png", "sequence.mp4"),
            ("a/{frame}.png", "a/sequence.mp4"),
        ] {
            assert_eq!(of(name).without_number("mp4"), PathBuf::from(video), "{name}");
        }
        assert_eq!(Template::suggested(Path::new("a/b.png")), Path::new("a/b-{frame:04}.png"));
        assert_eq!(Template::suggested(Path::new("b")), Path::new("b-{frame:04}"));
    }
}
