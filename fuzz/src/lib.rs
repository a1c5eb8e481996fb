//! What every target does with its bytes: it reads all frames, and makes spheres of them.

use planisphere_io::{
    load::Control,
    particles::{File, Format, Frame, spheres::Appearance, understand},
};

/// Reads bytes as a file of a format.
///
/// # Panics
/// When there is no format of that name; and when a reader does: that is what is looked for.
pub fn read(format: &str, bytes: &[u8]) {
    let format = Format::named(format).expect("a format");
    // What its content tells of any bytes is asked of all formats.
    let _ = Format::of_content(bytes);
    let Ok(file) = File::of_bytes("it", format, bytes.to_vec()) else { return };
    let control = Control::new();
    for number in 0..12 {
        let frame = Frame::FromFirst(number);
        if understand(&file, frame, &Appearance::default(), &control).is_err() {
            break;
        }
    }
    let _ = file.frames(&control);
}
