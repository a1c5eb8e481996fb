//! What a picture says of itself: which program has drawn it, from where, and with which options.

use planisphere_core::camera::Region;
use planisphere_image::look::Look;
use planisphere_io::camera;

use crate::subject::Subject;

/// What pictures say of themselves in formats that hold texts (PNG and OpenEXR), beside the
/// program, the camera and the options of the size, the region and the look. No names of files and
/// no dates: the same picture has the same bytes everywhere.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Metadata {
    /// What the picture is called.
    pub title: Option<String>,
    /// Words of options that belong to the scene, each after the one before it: such as `--frame`
    /// and its number.
    pub options: Vec<String>,
}

impl Metadata {
    /// Keys and texts, for the picture of a subject.
    pub(crate) fn texts(&self, subject: &Subject, look: &Look) -> Vec<(String, String)> {
        let view = &subject.meta.view;
        let mut words =
            vec!["--size".into(), format!("{}x{}", view.image.width, view.image.height)];
        let Region { x, y, width, height } = subject.meta.region;
        if subject.meta.region != Region::whole(view.image) {
            words.extend(["--region".into(), format!("{x},{y},{width},{height}")]);
        }
        words.extend(look.options());
        words.extend_from_slice(&self.options);
        let words: Vec<String> = words.iter().map(|word| quoted(word)).collect();
        let title = self.title.iter().map(|title| ("Title", title.clone()));
        let others = [
            ("Software", concat!("planisphere ", env!("CARGO_PKG_VERSION")).into()),
            (camera::KEY, camera::table(&view.camera, None)),
            ("planisphere:options", words.join(" ")),
        ];
        title.chain(others).map(|(key, text)| (key.into(), text)).collect()
    }
}

/// A word as a shell takes it.
fn quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_.,:/+=%@".contains(c);
    if !word.is_empty() && word.chars().all(is_plain) {
        return word.into();
    }
    format!("'{}'", word.replace('\'', r"'\''"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_quoted_for_a_shell() {
        for (word, wanted) in [
            ("--size", "--size"),
            ("-1,2.5", "-1,2.5"),
            ("#00ff00", "'#00ff00'"),
            ("", "''"),
            ("a b", "'a b'"),
            ("it's", r"'it'\''s'"),
        ] {
            assert_eq!(quoted(word), wanted);
        }
    }
}
