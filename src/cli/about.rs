//! Options of what a picture says of itself.

use clap::Args as ClapArgs;

use super::Failure;
use planisphere_renderer::files::{Metadata, Sinks};

/// What a picture says of itself, as typed.
#[derive(ClapArgs, Clone, Debug, Default)]
pub(super) struct AboutArgs {
    /// Pixels per inch that the picture says it has, for print: PNG, TIFF and JPEG hold it
    ///
    /// The pixels are the same; --size says how many there are.
    #[arg(long, value_name = "N", value_parser = parse_dpi, allow_negative_numbers = true)]
    dpi: Option<f64>,

    /// Write nothing but the picture: without the program, the camera and the options that made it
    ///
    /// PNG and OpenEXR hold them as texts: `planisphere info picture.png` prints them, and
    /// --camera picture.png draws another scene from there. They have no names of files and no
    /// dates.
    #[arg(long)]
    no_metadata: bool,
}

impl AboutArgs {
    /// Puts it into outputs; `options` are words of the command that belong to the scene.
    ///
    /// # Errors
    /// When the picture cannot hold it.
    pub fn apply(&self, sinks: &mut Sinks, options: Vec<String>) -> Result<(), Failure> {
        if self.dpi.is_some() {
            let name = sinks.kind.name();
            let words = match sinks.picture {
                None => {
                    "--dpi is said in the picture, and -o none writes none; leave one out".into()
                }
                Some(_) if !sinks.kind.holds_dpi() => format!(
                    "--dpi: {name} does not hold it; name the picture .png, .tif or .jpg, or leave \
                     it out"
                ),
                Some(_) => String::new(),
            };
            if !words.is_empty() {
                return Err(Failure::Usage(words));
            }
        }
        sinks.dpi = self.dpi;
        if !self.no_metadata {
            let mut metadata = Metadata::default();
            metadata.options = options;
            sinks.metadata = Some(metadata);
        }
        Ok(())
    }
}

impl AboutArgs {
    /// Refuses what an animation does not hold.
    pub fn refuse_for_animation(&self) -> Result<(), Failure> {
        match self.dpi {
            None => Ok(()),
            Some(_) => Err(Failure::Usage(
                "--dpi is for print, and an animation for screens; leave it out, or write pictures"
                    .into(),
            )),
        }
    }
}

fn parse_dpi(typed: &str) -> Result<f64, String> {
    let value = typed.parse().ok().filter(|dpi: &f64| (1.0..=65535.0).contains(dpi));
    value.ok_or_else(|| "write a number from 1 to 65535, such as 300".into())
}
