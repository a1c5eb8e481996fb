//! Pictures of every format: decoders that are not ours read what was written.
#![cfg(all(feature = "pictures", feature = "exr"))]

use std::io::{self, Cursor};

use image::{AnimationDecoder, DynamicImage, ImageDecoder, ImageFormat};
use planisphere_io::picture::{
    About, Encoder, Kind, Rows,
    animation::{Animation, Moving},
    exr::{Channel, write_exr},
    png,
};

/// Sizes of all kinds: single pixels, rows, columns, more than one band, a row that is longer than
/// one.
const SIZES: [[u32; 2]; 9] = [
    [1, 1],
    [1, 77],
    [77, 1],
    [13, 7],
    [3, 30_000],
    [311, 500],
    [1000, 131],
    [70_000, 1],
    [70_000, 3],
];

/// Shaded discs on a flat background, with some noise: the fourth value is alpha.
fn pixels([width, height]: [u32; 2]) -> Vec<[u8; 4]> {
    let pixel = |k: u32| {
        let (x, y) = (k % width, k / width);
        let (cell, dx, dy) = (x / 40 + 7 * (y / 40), x % 40, y % 40);
        let far = dx.abs_diff(20).pow(2) + dy.abs_diff(20).pow(2);
        if far > 300 {
            return if far > 780 { [200, 100, 50, 0] } else { [200, 100, 50, (far % 256) as u8] };
        }
        let shade = 300 - far;
        let noise = if cell % 5 == 0 { k.wrapping_mul(0x9e37_79b1) >> 29 } else { 0 };
        [shade * 2 / 3, shade * cell % 256 / 2, shade / 2 + noise, 255].map(|value| value as u8)
    };
    (0..width * height).map(pixel).collect()
}

/// The same with 16 bits, the lower ones of which are not 0.
fn deep(size: [u32; 2]) -> Vec<[u16; 4]> {
    let deeper = |(k, pixel): (usize, [u8; 4])| {
        pixel.map(|value| u16::from(value) << 8 | (k as u16).wrapping_mul(77) & 255)
    };
    pixels(size).into_iter().enumerate().map(deeper).collect()
}

/// A whole file of 8 bits a channel.
fn encoded(kind: Kind, about: &About, pixels: &[[u8; 4]]) -> io::Result<Vec<u8>> {
    let mut out = Vec::new();
    let mut encoder = Encoder::new(&mut out, kind, about)?;
    encoder.push(Rows::Eight(pixels))?;
    encoder.finish()?;
    Ok(out)
}

fn encoded_deep(kind: Kind, about: &About, pixels: &[[u16; 4]]) -> Vec<u8> {
    let mut out = Vec::new();
    let mut encoder = Encoder::new(&mut out, kind, about).unwrap();
    encoder.push(Rows::Sixteen(pixels)).unwrap();
    encoder.finish().unwrap();
    out
}

fn format(kind: Kind) -> ImageFormat {
    match kind {
        Kind::Png => ImageFormat::Png,
        Kind::Jpeg => ImageFormat::Jpeg,
        Kind::Webp => ImageFormat::WebP,
        Kind::Qoi => ImageFormat::Qoi,
        Kind::Tiff => ImageFormat::Tiff,
        Kind::Exr => unreachable!("it has a test of its own"),
    }
}

/// What another program sees in a file.
fn decoded(kind: Kind, bytes: &[u8]) -> DynamicImage {
    let mut reader = image::ImageReader::with_format(Cursor::new(bytes), format(kind));
    reader.no_limits();
    reader.decode().unwrap()
}

#[test]
fn every_format_keeps_every_pixel() {
    for kind in [Kind::Png, Kind::Webp, Kind::Qoi, Kind::Tiff] {
        for size in SIZES.into_iter().filter(|size| size[0] <= kind.longest_side()) {
            if kind == Kind::Webp && size[1] > kind.longest_side() {
                continue;
            }
            for alpha in [false, true] {
                let about = About { size, alpha, ..About::default() };
                let pixels = pixels(size);
                let bytes = encoded(kind, &about, &pixels).unwrap();
                let image = decoded(kind, &bytes);
                assert_eq!([image.width(), image.height()], size);
                assert_eq!(image.color().has_alpha(), alpha, "{kind:?}");
                assert_eq!(image.color().bytes_per_pixel(), 3 + u8::from(alpha));
                let image = image.into_rgba8();
                let want =
                    pixels.iter().map(|&[r, g, b, a]| [r, g, b, if alpha { a } else { 255 }]);
                assert!(image.pixels().map(|pixel| pixel.0).eq(want), "{kind:?} {size:?}");
            }
        }
    }
}

#[test]
fn sixteen_bits_are_kept() {
    for kind in [Kind::Png, Kind::Tiff] {
        for size in SIZES {
            for alpha in [false, true] {
                let about = About { size, alpha, depth16: true, ..About::default() };
                let pixels = deep(size);
                let image = decoded(kind, &encoded_deep(kind, &about, &pixels));
                assert_eq!(image.color().bytes_per_pixel(), 2 * (3 + u8::from(alpha)));
                let image = image.into_rgba16();
                let want =
                    pixels.iter().map(|&[r, g, b, a]| [r, g, b, if alpha { a } else { 65_535 }]);
                assert!(image.pixels().map(|pixel| pixel.0).eq(want), "{kind:?} {size:?}");
            }
        }
    }
}

#[test]
fn a_jpeg_is_near() {
    // The reader of these tests fails at few columns of many rows; libjpeg does not.
    for size in [[1, 1], [33, 77], [77, 1], [311, 500], [65_500, 1]] {
        let about = About { size, dpi: Some(300.0), ..About::default() };
        let pixels = pixels(size);
        let bytes = encoded(Kind::Jpeg, &about, &pixels).unwrap();
        // JFIF: inches, 300 and 300.
        assert_eq!(bytes[6..18], *b"JFIF\0\x01\x02\x01\x01\x2c\x01\x2c");
        // The first frame's header: 8 bits, three components, each 1 x 1.
        let frame = bytes.windows(2).position(|two| two == [0xff, 0xc0]).unwrap();
        let frame = &bytes[frame + 4..];
        assert_eq!((frame[0], frame[5]), (8, 3));
        assert!([7, 10, 13].iter().all(|&at| frame[at] == 0x11), "4:4:4");
        let image = decoded(Kind::Jpeg, &bytes).into_rgb8();
        assert_eq!([image.width(), image.height()], size);
        let off: u64 = image
            .pixels()
            .zip(&pixels)
            .flat_map(|(have, want)| have.0.into_iter().zip(*want))
            .map(|(have, want)| u64::from(have.abs_diff(want)).pow(2))
            .sum();
        let mean = off as f64 / (3 * pixels.len()) as f64;
        assert!(mean < 30.0, "{size:?}: mean square {mean}");
    }
}

/// Names and data of all chunks.
fn chunks(mut file: &[u8]) -> Vec<(String, Vec<u8>)> {
    let mut all = Vec::new();
    file = &file[8..];
    while let Some((length, rest)) = file.split_first_chunk::<4>() {
        let length = u32::from_be_bytes(*length) as usize;
        let name = String::from_utf8(rest[..4].to_vec()).unwrap();
        all.push((name, rest[4..4 + length].to_vec()));
        file = &rest[length + 8..];
    }
    all
}

fn texts() -> Vec<(String, String)> {
    let texts = [
        ("Title", "Sphères"),
        ("Software", "two\nlines"),
        ("Comment", "球 and €"),
        ("Größe der Welt", "tab\tis no Latin-1 of a PNG"),
        ("Empty", ""),
    ];
    texts.map(|(key, value)| (key.to_owned(), value.to_owned())).into()
}

#[test]
fn a_png_says_what_it_is() {
    let texts = texts();
    let about =
        About { size: [20, 10], dpi: Some(300.0), text: &texts, alpha: true, ..About::default() };
    let bytes = encoded(Kind::Png, &about, &pixels(about.size)).unwrap();
    let chunks = chunks(&bytes);
    let names: Vec<&str> = chunks.iter().map(|(name, _)| name.as_str()).collect();
    let want = ["IHDR", "pHYs", "sRGB", "tEXt", "tEXt", "iTXt", "iTXt", "tEXt", "IDAT", "IEND"];
    let mut sorted = (names.clone(), want.to_vec());
    sorted.0.sort_unstable();
    sorted.1.sort_unstable();
    assert_eq!(sorted.0, sorted.1);
    let of = |name: &str| &chunks.iter().find(|(other, _)| other == name).unwrap().1;
    // Perceptual; 11811 pixels per metre.
    assert_eq!(*of("sRGB"), [0]);
    assert_eq!(*of("pHYs"), [0, 0, 0x2e, 0x23, 0, 0, 0x2e, 0x23, 1]);
    assert_eq!(of("IHDR")[8..], [8, 6, 0, 0, 0]);
    assert_eq!(*of("tEXt"), *b"Title\0Sph\xe8res");
    let read = png::read(Cursor::new(&bytes), 1 << 20).unwrap();
    assert_eq!((read.size, read.bits, read.alpha), (about.size, 8, true));
    assert_eq!(read.pixels, pixels(about.size));
    // Those in Latin-1 come first.
    let latin = |(_, value): &&(String, String)| !value.contains(['球', '\t']);
    let want = texts.iter().filter(latin).chain(texts.iter().filter(|text| !latin(text)));
    assert!(read.text.iter().eq(want), "{:?}", read.text);
    // Nothing that was not asked for.
    let bare = About { size: [20, 10], ..About::default() };
    let bytes = encoded(Kind::Png, &bare, &pixels(bare.size)).unwrap();
    let names: Vec<String> = self::chunks(&bytes).into_iter().map(|(name, _)| name).collect();
    assert_eq!(names, ["IHDR", "sRGB", "IDAT", "IEND"]);
}

#[test]
fn a_tiff_says_its_resolution_and_alpha() {
    let about = About { size: [20, 10], dpi: Some(72.5), alpha: true, ..About::default() };
    let bytes = encoded(Kind::Tiff, &about, &pixels(about.size)).unwrap();
    let at = u32::from_le_bytes(bytes[4..8].try_into().unwrap()) as usize;
    let count = usize::from(u16::from_le_bytes(bytes[at..at + 2].try_into().unwrap()));
    let entries = bytes[at + 2..].chunks(12).take(count);
    let value = |tag: u16| {
        let entry = entries.clone().find(|entry| entry[..2] == tag.to_le_bytes()).unwrap();
        u32::from_le_bytes(entry[8..].try_into().unwrap())
    };
    // Deflate, differences, RGB, four samples, of which one is straight alpha; inches.
    for (tag, want) in [(259, 8), (317, 2), (262, 2), (277, 4), (338, 2), (296, 2)] {
        assert_eq!(value(tag) & 0xffff, want, "tag {tag}");
    }
    for tag in [282, 283] {
        let at = value(tag) as usize;
        assert_eq!(bytes[at..at + 8], [72_500u32.to_le_bytes(), 1000u32.to_le_bytes()].concat());
    }
}

#[test]
fn neither_threads_nor_groups_of_rows_change_a_byte() {
    let size = [311, 1000];
    let (eight, sixteen) = (pixels(size), deep(size));
    for kind in [Kind::Png, Kind::Jpeg, Kind::Webp, Kind::Qoi, Kind::Tiff] {
        for depth16 in [false, true].into_iter().filter(|deep| !deep || kind.holds_depth16()) {
            let about = About { size, depth16, alpha: kind.holds_alpha(), ..About::default() };
            let file = |rows: usize| {
                let mut out = Vec::new();
                let mut encoder = Encoder::new(&mut out, kind, &about).unwrap();
                let count = 311 * rows;
                if depth16 {
                    let mut rows = sixteen.chunks(count).map(Rows::Sixteen);
                    rows.try_for_each(|rows| encoder.push(rows)).unwrap();
                } else {
                    let mut rows = eight.chunks(count).map(Rows::Eight);
                    rows.try_for_each(|rows| encoder.push(rows)).unwrap();
                }
                encoder.push(if depth16 { Rows::Sixteen(&[]) } else { Rows::Eight(&[]) }).unwrap();
                encoder.finish().unwrap();
                out
            };
            let whole = file(1000);
            // A band has 210 rows.
            for rows in [1, 7, 209, 210, 211, 640, 999] {
                assert!(file(rows) == whole, "{kind:?}: {rows} rows at a time");
            }
            for threads in [1, 2, 16] {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                assert!(pool.install(|| file(123)) == whole, "{kind:?}: {threads} threads");
            }
        }
    }
}

/// The error of a picture that a format cannot hold.
fn refused(kind: Kind, about: &About) -> String {
    let error = Encoder::new(Vec::new(), kind, about).unwrap_err();
    let kinds = [io::ErrorKind::InvalidInput, io::ErrorKind::Unsupported];
    assert!(kinds.contains(&error.kind()), "{error:?}");
    error.to_string()
}

#[test]
fn what_a_format_cannot_hold_is_refused() {
    let about = About { size: [4, 3], ..About::default() };
    let clear = About { alpha: true, ..about };
    assert!(refused(Kind::Jpeg, &clear).contains("no alpha"));
    let deep = About { depth16: true, ..about };
    for kind in [Kind::Jpeg, Kind::Webp, Kind::Qoi] {
        assert!(refused(kind, &deep).contains("8 bits a channel"));
    }
    for (kind, side) in [(Kind::Jpeg, 65_501), (Kind::Webp, 16_384), (Kind::Png, 1 << 31)] {
        for size in [[1, side], [side, 1]] {
            let words = refused(kind, &About { size, ..about });
            assert!(words.contains(&format!("at most {} pixels a side", side - 1)), "{words}");
        }
    }
    let large = About { size: [20_001, 20_000], ..about };
    assert!(refused(Kind::Qoi, &large).contains("at most 400000000 pixels"));
    let large = About { size: [40_000, 40_000], ..about };
    assert!(refused(Kind::Tiff, &large).contains("a TIFF holds at most"));
    assert!(refused(Kind::Exr, &about).contains("planes of floats"));
    for kind in [Kind::Png, Kind::Jpeg, Kind::Webp, Kind::Qoi, Kind::Tiff] {
        for size in [[0, 3], [3, 0]] {
            assert!(refused(kind, &About { size, ..about }).contains("are no picture"));
        }
        for dpi in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(refused(kind, &About { dpi: Some(dpi), ..about }).contains("dots per inch"));
        }
    }
    for (kind, dpi) in [(Kind::Png, 1e-3), (Kind::Png, 1e9), (Kind::Jpeg, 0.4)] {
        let words = refused(kind, &About { dpi: Some(dpi), ..about });
        assert!(words.contains("are none that a"), "{words}");
    }
    for dpi in [1e-4, 1e7] {
        let words = refused(Kind::Tiff, &About { dpi: Some(dpi), ..about });
        assert!(words.contains("are none that a TIFF holds"), "{words}");
    }
    for (key, value) in [
        ("", "a"),
        (" a", "a"),
        ("a ", "a"),
        ("a  b", "a"),
        ("a\nb", "a"),
        ("球", "a"),
        (&"a".repeat(80), "a"),
        ("a", "a\0"),
    ] {
        let text = [(key.to_owned(), value.to_owned())];
        let words = refused(Kind::Png, &About { text: &text, ..about });
        assert!(words.contains("hold"), "{words}");
    }
}

#[test]
fn wrong_rows_are_refused() {
    for kind in [Kind::Png, Kind::Webp] {
        let about = About { size: [4, 3], ..About::default() };
        let encoder = || Encoder::new(Vec::new(), kind, &about).unwrap();
        for (count, words) in [(5, "no whole rows of 4"), (16, "4 rows come where 3 are missing")] {
            let error = encoder().push(Rows::Eight(&vec![[0; 4]; count])).unwrap_err();
            assert!(error.to_string().contains(words), "{error}");
        }
        let error = encoder().push(Rows::Sixteen(&[[0; 4]; 4])).unwrap_err();
        assert!(error.to_string().contains("16 bits a channel come for"), "{error}");
        let mut begun = encoder();
        begun.push(Rows::Eight(&[[0; 4]; 4])).unwrap();
        let error = begun.finish().unwrap_err();
        assert!(error.to_string().contains("2 rows are missing"), "{error}");
    }
}

#[test]
fn the_writers_error_keeps_its_kind() {
    struct Closed;
    impl io::Write for Closed {
        fn write(&mut self, _: &[u8]) -> io::Result<usize> {
            Err(io::ErrorKind::BrokenPipe.into())
        }
        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }
    let about = About { size: [4, 3], ..About::default() };
    for kind in [Kind::Png, Kind::Jpeg, Kind::Webp, Kind::Qoi, Kind::Tiff] {
        let error = Encoder::new(Closed, kind, &about).and_then(|mut encoder| {
            encoder.push(Rows::Eight(&[[0; 4]; 12]))?;
            encoder.finish()
        });
        assert_eq!(error.unwrap_err().kind(), io::ErrorKind::BrokenPipe, "{kind:?}");
    }
    for kind in [Moving::Gif, Moving::Apng] {
        let error = Animation::new(Closed, kind, &about, 1, [1, 10]).and_then(|mut animation| {
            animation.push_frame(&[[0; 4]; 12])?;
            animation.finish()
        });
        assert_eq!(error.unwrap_err().kind(), io::ErrorKind::BrokenPipe, "{kind:?}");
    }
}

/// Files of shaded spheres are no larger than those of the fast mode of a general encoder.
#[test]
fn a_png_is_small() {
    for size in [[640, 480], [1000, 1000]] {
        let pixels = pixels(size);
        let about = About { size, ..About::default() };
        let ours = encoded(Kind::Png, &about, &pixels).unwrap().len();
        let mut theirs = Vec::new();
        let mut encoder = ::png::Encoder::new(&mut theirs, size[0], size[1]);
        encoder.set_color(::png::ColorType::Rgb);
        encoder.set_compression(::png::Compression::Fast);
        let values: Vec<u8> = pixels.iter().flat_map(|[r, g, b, _]| [*r, *g, *b]).collect();
        let mut writer = encoder.write_header().unwrap();
        writer.write_image_data(&values).unwrap();
        writer.finish().unwrap();
        assert!(ours <= theirs.len(), "{size:?}: {ours} bytes, where {} do", theirs.len());
    }
}

mod moving {
    use super::*;

    fn animated(
        kind: Moving,
        about: &About,
        frames: &[Vec<[u8; 4]>],
        delay: [u16; 2],
    ) -> io::Result<Vec<u8>> {
        let mut out = Vec::new();
        let mut animation = Animation::new(&mut out, kind, about, frames.len() as u32, delay)?;
        frames.iter().try_for_each(|frame| animation.push_frame(frame))?;
        animation.finish()?;
        Ok(out)
    }

    /// Frames, each of other colours; alpha is full or nothing.
    fn frames(size: [u32; 2], count: u8, most: u8) -> Vec<Vec<[u8; 4]>> {
        let frame = |k: u8| {
            let pixel = |[r, g, b, a]: [u8; 4]| {
                [r / 32 * 32 + k, g.min(most), (b / 64) * 64, if a < 255 { 0 } else { 255 }]
            };
            pixels(size).into_iter().map(pixel).collect()
        };
        (0..count).map(frame).collect()
    }

    #[test]
    fn an_apng_keeps_every_pixel() {
        let size = [90, 61];
        let frames = frames(size, 5, 255);
        for alpha in [false, true] {
            let texts = texts();
            let about = About { size, alpha, text: &texts, ..About::default() };
            let bytes = animated(Moving::Apng, &about, &frames, [1, 24]).unwrap();
            let decoder = image::codecs::png::PngDecoder::new(Cursor::new(&bytes)).unwrap();
            assert!(decoder.is_apng().unwrap());
            let read = decoder.apng().unwrap().into_frames().collect_frames().unwrap();
            assert_eq!(read.len(), 5);
            for (read, want) in read.iter().zip(&frames) {
                assert_eq!(read.delay().numer_denom_ms(), (125, 3));
                let want = want.iter().map(|&[r, g, b, a]| [r, g, b, if alpha { a } else { 255 }]);
                // Of what is clear the decoder keeps no colour.
                assert!(
                    read.buffer()
                        .pixels()
                        .map(|pixel| pixel.0)
                        .zip(want)
                        .all(|(have, want)| have == want || have[3] == 0 && want[3] == 0)
                );
            }
            let control = chunks(&bytes).into_iter().find(|(name, _)| name == "acTL").unwrap().1;
            assert_eq!(control, [0, 0, 0, 5, 0, 0, 0, 0], "in an endless loop");
        }
    }

    #[test]
    fn a_gif_of_few_colours_keeps_them() {
        let size = [90, 61];
        let frames = frames(size, 6, 3);
        for alpha in [false, true] {
            let about = About { size, alpha, ..About::default() };
            let bytes = animated(Moving::Gif, &about, &frames, [1, 30]).unwrap();
            assert!(bytes.windows(11).any(|bytes| bytes == *b"NETSCAPE2.0"));
            let decoder = image::codecs::gif::GifDecoder::new(Cursor::new(&bytes)).unwrap();
            assert_eq!(decoder.dimensions(), (90, 61));
            let read = decoder.into_frames().collect_frames().unwrap();
            let delays: Vec<u32> =
                read.iter().map(|frame| frame.delay().numer_denom_ms().0 / 10).collect();
            assert_eq!(delays, [3, 4, 3, 3, 4, 3], "20 hundredths in all");
            for (read, want) in read.iter().zip(&frames) {
                for (read, &[r, g, b, a]) in read.buffer().pixels().zip(want) {
                    if alpha && a == 0 {
                        assert_eq!(read.0[3], 0);
                    } else {
                        assert_eq!(read.0, [r, g, b, 255]);
                    }
                }
            }
        }
    }

    #[test]
    fn a_gif_of_many_colours_is_near_and_the_same_each_time() {
        let size = [320, 240];
        let frames: Vec<_> = (0..2).map(|_| pixels(size)).collect();
        let about = About { size, ..About::default() };
        let bytes = animated(Moving::Gif, &about, &frames, [1, 10]).unwrap();
        assert!(bytes == animated(Moving::Gif, &about, &frames, [1, 10]).unwrap());
        let decoder = image::codecs::gif::GifDecoder::new(Cursor::new(&bytes)).unwrap();
        let read = decoder.into_frames().collect_frames().unwrap();
        for (read, want) in read.iter().zip(&frames) {
            let off: u64 = read
                .buffer()
                .pixels()
                .zip(want)
                .flat_map(|(have, want)| have.0.into_iter().zip(*want).take(3))
                .map(|(have, want)| u64::from(have.abs_diff(want)).pow(2))
                .sum();
            let mean = off as f64 / (3 * want.len()) as f64;
            assert!(mean > 0.0 && mean < 60.0, "mean square {mean}");
        }
    }

    #[test]
    fn what_an_animation_cannot_hold_is_refused() {
        let about = About { size: [4, 3], ..About::default() };
        let new = |kind, about: &About, frames, delay| {
            Animation::new(Vec::new(), kind, about, frames, delay).map(|_| ())
        };
        let words = |result: io::Result<()>| {
            let error = result.unwrap_err();
            assert_eq!(error.kind(), io::ErrorKind::InvalidInput);
            error.to_string()
        };
        for kind in [Moving::Gif, Moving::Apng] {
            for (frames, delay) in [(0, [1, 2]), (1, [0, 2]), (1, [1, 0])] {
                assert!(words(new(kind, &about, frames, delay)).contains("none of these is 0"));
            }
            let deep = About { depth16: true, ..about };
            assert!(words(new(kind, &deep, 1, [1, 2])).contains("ask for 8"));
            let begun = || Animation::new(Vec::new(), kind, &about, 1, [1, 2]).unwrap();
            assert!(words(begun().finish()).contains("1 frames are missing"));
            let mut done = begun();
            assert!(words(done.push_frame(&[[0; 4]; 11])).contains("no frame of 4 x 3"));
            done.push_frame(&[[0; 4]; 12]).unwrap();
            assert!(words(done.push_frame(&[[0; 4]; 12])).contains("after all 1"));
        }
        assert!(words(new(Moving::Gif, &about, 1, [1, 51])).contains("too short"));
        assert!(words(new(Moving::Gif, &about, 1, [656, 1])).contains("too long"));
        new(Moving::Gif, &about, 1, [1, 50]).unwrap();
        let wide = About { size: [65_536, 1], ..about };
        assert!(words(new(Moving::Gif, &wide, 1, [1, 2])).contains("at most 65535"));
        let clear = About { alpha: true, ..about };
        let mut gif = Animation::new(Vec::new(), Moving::Gif, &clear, 1, [1, 2]).unwrap();
        assert!(words(gif.push_frame(&[[9, 9, 9, 77]; 12])).contains("an alpha of 77"));
        for (name, kind) in [("a.GIF", Moving::Gif), ("a.b.apng", Moving::Apng)] {
            assert_eq!(Moving::of(name.as_ref()).unwrap(), kind);
        }
        let error = Moving::of("a.mp4".as_ref()).unwrap_err().to_string();
        assert!(error.contains(".gif or .apng"), "{error}");
    }
}

mod planes {
    use super::*;
    use ::exr::{
        meta::attribute::AttributeValue,
        prelude::{FlatSamples, ReadChannels, ReadLayers, Text, read},
    };

    #[test]
    fn an_exr_keeps_every_number() {
        for [width, height] in [[1, 1], [1, 77], [77, 1], [311, 50], [70_000, 1], [40, 16]] {
            let count = width * height;
            let mut floats: Vec<f32> = (0..count).map(|k| k as f32 / 3.0 - 5.0).collect();
            floats[0] = f32::INFINITY;
            let nothing = vec![0.0; count];
            let noise: Vec<f32> =
                (0..count).map(|k| f32::from_bits((k as u32).wrapping_mul(0x9e37_79b1))).collect();
            let mut ids: Vec<u32> = (0..count).map(|k| k as u32 / 9).collect();
            ids[count - 1] = u32::MAX;
            let channels = [
                ("R", Channel::F32(&floats)),
                ("id", Channel::U32(&ids)),
                ("G", Channel::F32(&nothing)),
                ("depth.Z", Channel::F32(&noise)),
            ];
            let texts = [("scene".to_owned(), "a 球".to_owned()), ("empty".into(), "".into())];
            let mut out = Vec::new();
            let size = [width, height].map(|side| side as u32);
            write_exr(&mut out, size, &channels, &texts).unwrap();
            for threads in [1, 16] {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                let mut again = Vec::new();
                pool.install(|| write_exr(&mut again, size, &channels, &texts)).unwrap();
                assert!(again == out, "{threads} threads");
            }
            let image = read()
                .no_deep_data()
                .largest_resolution_level()
                .all_channels()
                .all_layers()
                .all_attributes()
                .from_buffered(Cursor::new(&out))
                .unwrap();
            let [layer] = &image.layer_data[..] else { panic!("one layer") };
            assert_eq!((layer.size.0, layer.size.1), (width, height));
            for (name, value) in &texts {
                let same = |key: &Text| key.bytes() == name.as_bytes();
                let mut all = layer.attributes.other.iter().chain(&image.attributes.other);
                let found = all.find(|(key, _)| same(key)).expect("the text").1;
                let AttributeValue::Text(found) = found else { panic!("a text: {found:?}") };
                assert_eq!(found.bytes(), value.as_bytes());
            }
            let read = &layer.channel_data.list;
            let names: Vec<String> = read.iter().map(|channel| channel.name.to_string()).collect();
            assert_eq!(names, ["G", "R", "depth.Z", "id"]);
            let bits = |k: usize| match &read[k].sample_data {
                FlatSamples::F32(values) => values.iter().map(|v| v.to_bits()).collect(),
                FlatSamples::U32(values) => values.clone(),
                FlatSamples::F16(_) => panic!("no halves were written"),
            };
            let of = |floats: &[f32]| floats.iter().map(|v| v.to_bits()).collect::<Vec<u32>>();
            assert!(bits(0) == of(&nothing) && bits(1) == of(&floats));
            assert!(bits(2) == of(&noise) && bits(3) == ids);
        }
    }

    #[test]
    fn long_names_are_read() {
        let name = "position.of.the.sphere.that.is.seen.X";
        let mut out = Vec::new();
        write_exr(&mut out, [2, 1], &[(name, Channel::F32(&[1.0, 2.0]))], &[]).unwrap();
        let image = read()
            .no_deep_data()
            .largest_resolution_level()
            .all_channels()
            .all_layers()
            .all_attributes()
            .from_buffered(Cursor::new(&out))
            .unwrap();
        assert_eq!(image.layer_data[0].channel_data.list[0].name.to_string(), name);
    }

    #[test]
    fn what_an_exr_cannot_hold_is_refused() {
        let values = [0.0; 6];
        let six = Channel::F32(&values);
        let refused = |size, channels: &[(&str, Channel)], texts: &[(&str, &str)]| {
            let texts: Vec<_> =
                texts.iter().map(|(a, b)| ((*a).to_owned(), (*b).to_owned())).collect();
            let error = write_exr(Vec::new(), size, channels, &texts).unwrap_err();
            assert_eq!(error.kind(), io::ErrorKind::InvalidInput);
            error.to_string()
        };
        assert!(refused([2, 3], &[], &[]).contains("no channel"));
        assert!(refused([0, 3], &[("R", six)], &[]).contains("0 x 3"));
        assert!(refused([2, 4], &[("R", six)], &[]).contains("has 6 values"));
        assert!(refused([2, 3], &[("R", six), ("R", six)], &[]).contains("one `R` alone"));
        assert!(refused([2, 3], &[("", six)], &[]).contains("no name of a channel"));
        assert!(refused([2, 3], &[("R\0", six)], &[]).contains("no name of a channel"));
        let words = refused([2, 3], &[("R", six)], &[("channels", "")]);
        assert!(words.contains("`channels` alone"), "{words}");
        let words = refused([2, 3], &[("R", six)], &[("a", ""), ("a", "")]);
        assert!(words.contains("`a` alone"), "{words}");
    }
}
