//! Options of what is drawn over a picture: in place of what a scene file says.

use clap::Args as ClapArgs;

use super::{Failure, reading::parse_positive};
use planisphere_io::load::{Label, Length, Loaded, Overlay};
use planisphere_renderer::overlay;

/// What is drawn over a picture, as typed.
#[derive(ClapArgs, Clone, Debug, Default)]
#[command(next_help_heading = "Over the picture")]
pub(super) struct OverlayArgs {
    /// A line of text at the top
    #[arg(long, value_name = "TEXT", value_parser = parse_words)]
    title: Option<String>,

    /// What the colours of a file of particles mean: of numbers (--color-by) a bar with its range,
    /// of elements and types their names
    ///
    /// Above the bar stands the column's name with --unit, or LABEL: --legend="charge (e)".
    #[arg(
        long,
        value_name = "LABEL",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = "",
        value_parser = parse_label
    )]
    legend: Option<Label>,

    /// A bar with its length, in the lower left corner: of a round length, or of LENGTH
    ///
    /// The length is in units of the scene. In perspective there is none: what is farther is
    /// smaller there.
    #[arg(
        long,
        value_name = "LENGTH",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = "auto",
        value_parser = parse_length
    )]
    scale_bar: Option<Length>,

    /// The axes of the scene, in the lower left corner
    #[arg(long)]
    axes: bool,

    /// Unit of the scale bar and of a legend of numbers, such as nm: text behind the number, and
    /// behind the column's name
    #[arg(long, value_name = "TEXT", value_parser = parse_words)]
    unit: Option<String>,
}

impl OverlayArgs {
    /// What was typed in place of what was loaded.
    pub fn of(&self, loaded: &Loaded) -> Result<planisphere_renderer::Overlay, Failure> {
        let of_file = &loaded.overlay;
        let wanted = Overlay {
            title: self.title.clone().or_else(|| of_file.title.clone()),
            legend: self.legend.clone().or_else(|| of_file.legend.clone()),
            scale_bar: self.scale_bar.or(of_file.scale_bar),
            axes: self.axes || of_file.axes,
            unit: self.unit.clone().or_else(|| of_file.unit.clone()),
        };
        if self.unit.is_some() && wanted.scale_bar.is_none() && wanted.legend.is_none() {
            return Err(Failure::Usage(
                "--unit is of a scale bar and of a legend; add --scale-bar or --legend, or leave \
                 it out"
                    .into(),
            ));
        }
        match (&wanted.legend, &loaded.legend) {
            (Some(_), Err(words)) => Err(Failure::Usage(format!(
                "--legend: there is none: {words}; leave it out, or colour a file of particles by \
                 a column (--color-by)"
            ))),
            _ => Ok(overlay(&wanted, loaded.legend.as_ref().ok())),
        }
    }
}

/// Text in which something is seen.
fn parse_words(typed: &str) -> Result<String, String> {
    match typed.trim().is_empty() {
        true => Err("it is empty; write some words, or leave the option out".into()),
        false => Ok(typed.into()),
    }
}

fn parse_label(typed: &str) -> Result<Label, String> {
    match typed {
        "" => Ok(Label::Column),
        words => parse_words(words).map(Label::Words),
    }
}

fn parse_length(typed: &str) -> Result<Length, String> {
    if typed == "auto" {
        return Ok(Length::Chosen);
    }
    let length = parse_positive(typed);
    length.map(Length::Of).map_err(|_| "write a length greater than 0, such as 10, or auto".into())
}
