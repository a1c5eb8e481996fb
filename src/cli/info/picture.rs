//! What `planisphere info` says of a picture.

use std::path::Path;

use serde::Serialize;

use planisphere_io::{camera, picture::png::Header, text};

/// What is in a picture. Fields are added, never changed, while `version` is 1.
#[derive(Serialize)]
pub(super) struct Picture {
    version: u32,
    file: String,
    format: &'static str,
    /// Columns and rows.
    size: [u32; 2],
    /// Of a channel, or of an index of the palette.
    bits: u8,
    alpha: bool,
    /// Pixels per inch, across and down.
    #[serde(skip_serializing_if = "Option::is_none")]
    dpi: Option<[f64; 2]>,
    /// Keys and texts.
    texts: Vec<(String, String)>,
    /// The camera that it was drawn with, as a table of a scene file.
    #[serde(skip_serializing_if = "Option::is_none")]
    camera: Option<String>,
}

impl Picture {
    pub fn of(path: &Path, header: Header) -> Self {
        let Header { size, alpha, bits, dpi, text: texts } = header;
        let found = texts.iter().find(|(key, _)| key == camera::KEY);
        let camera = found.map(|(_, table)| table.clone());
        // A picture holds whole pixels per metre: 300 per inch are 11811, which are 299.9994.
        let dpi = dpi.map(|dpi| dpi.map(|dpi| (100.0 * dpi).round() / 100.0));
        Self {
            version: 1,
            file: text::name(path),
            format: "PNG",
            size,
            bits,
            alpha,
            dpi,
            texts,
            camera,
        }
    }

    pub fn text(&self) -> String {
        let [width, height] = self.size;
        let mut text = format!("{}: {}\n", self.file, self.format);
        text += &format!("size       {width} x {height}\n");
        let alpha = if self.alpha { ", with alpha" } else { "" };
        text += &format!("bits       {}{alpha}\n", self.bits);
        match self.dpi {
            Some([across, down]) if across == down => text += &format!("dpi        {across}\n"),
            Some([across, down]) => text += &format!("dpi        {across} across, {down} down\n"),
            None => {}
        }
        for (key, value) in self.texts.iter().filter(|(key, _)| key != camera::KEY) {
            text += &format!("{key}: {value}\n");
        }
        if let Some(camera) = &self.camera {
            text += camera;
        }
        text
    }
}
