//! What a file is by its first bytes, when it is not the picture that it should be.

/// How many of a file's first bytes are looked at.
pub(super) const FIRST: usize = 512;

/// Formats that begin with fixed bytes.
const BEGIN: [(&[u8], &str); 21] = [
    (b"\xff\xd8\xff", "a JPEG"),
    (b"GIF87a", "a GIF"),
    (b"GIF89a", "a GIF"),
    (b"qoif", "a QOI picture"),
    (b"II*\0", "a TIFF"),
    (b"MM\0*", "a TIFF"),
    (b"II+\0", "a TIFF"),
    (b"MM\0+", "a TIFF"),
    (b"v/1\x01", "an OpenEXR picture"),
    (b"BM", "a BMP"),
    (b"\0\0\x01\0", "an icon (ICO)"),
    (b"%PDF", "a PDF"),
    (b"\x93NUMPY", "an array of NumPy"),
    (b"PK\x03\x04", "a zip file"),
    (b"\x1f\x8b", "a gzip file"),
    (b"\x28\xb5\x2f\xfd", "a zstd file"),
    (b"\xfd7zXZ\0", "an xz file"),
    (b"\xff\x0a", "a JPEG XL picture"),
    (b"\0\0\0\x0cJXL ", "a JPEG XL picture"),
    (b"#?RADIANCE", "a Radiance HDR picture"),
    (b"version https://git-lfs", LFS),
];

/// A file that stands for another one.
pub(super) const LFS: &str = "a Git LFS pointer";

/// What a file is that begins with these bytes, if that is known.
pub(super) fn sniff(first: &[u8]) -> Option<&'static str> {
    if let Some((_, name)) = BEGIN.iter().find(|(begin, _)| first.starts_with(begin)) {
        return Some(name);
    }
    match first {
        [b'R', b'I', b'F', b'F', _, _, _, _, b'W', b'E', b'B', b'P', ..] => return Some("a WebP"),
        [_, _, _, _, b'f', b't', b'y', b'p', b'a', b'v', b'i', _, ..] => return Some("an AVIF"),
        [_, _, _, _, b'f', b't', b'y', b'p', b'h', b'e', b'i', _, ..] => return Some("a HEIF"),
        [b'P', b'1'..=b'7', b' ' | b'\n' | b'\r' | b'\t', ..] => return Some("a Netpbm picture"),
        _ => {}
    }
    let text = first.strip_prefix(b"\xef\xbb\xbf").unwrap_or(first).trim_ascii_start();
    let starts = |word: &str| {
        text.get(..word.len()).is_some_and(|text| text.eq_ignore_ascii_case(word.as_bytes()))
    };
    if starts("<!doctype html") || starts("<html") {
        Some("a web page (HTML)")
    } else if starts("<svg") || (starts("<?xml") && first.windows(4).any(|part| part == b"<svg")) {
        Some("an SVG")
    } else if starts("<?xml") {
        Some("an XML file")
    } else if starts("{") {
        Some("a JSON file")
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formats_are_told_by_their_first_bytes() {
        for (bytes, name) in [
            (&b"\xff\xd8\xff\xe0"[..], "a JPEG"),
            (b"GIF89a\x01\0", "a GIF"),
            (b"RIFF\x24\0\0\0WEBPVP8L", "a WebP"),
            (b"\0\0\0\x1cftypavif", "an AVIF"),
            (b"version https://git-lfs.github.com/spec/v1\noid", LFS),
            (b"\xef\xbb\xbf\r\n <!DOCTYPE HTML>", "a web page (HTML)"),
            (b"<html lang=en>", "a web page (HTML)"),
            (b"P6\n1 1\n255\n", "a Netpbm picture"),
            (b"<?xml version", "an XML file"),
            (b"<?xml version='1.0'?>\n<svg xmlns=''>", "an SVG"),
        ] {
            assert_eq!(sniff(bytes), Some(name));
        }
        for bytes in [&b""[..], b"RIFF\0\0\0\0WAVE", b"hello", b"P8\n", b"\x89PNG\r\n\x1a\n"] {
            assert_eq!(sniff(bytes), None);
        }
    }
}
