//! What `[image]` asks to be drawn over the picture: its keys, each checked at its place.

use toml::de::DeValue;

use super::{
    document::{Section, Value, number, string},
    look::truth,
};
use crate::input::report::Fault;

/// Keys of `[image]` that say what is drawn over it.
pub(super) const KEYS: [&str; 5] = ["title", "legend", "scale_bar", "axes", "unit"];

/// What is asked to be drawn over a picture.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Overlay {
    /// A line at the top.
    pub title: Option<String>,
    /// What the colours mean.
    pub legend: Option<Label>,
    /// A length.
    pub scale_bar: Option<Length>,
    /// The axes of the world.
    pub axes: bool,
    /// The unit of the scale bar, and of a legend that is named after its column.
    pub unit: Option<String>,
}

/// What stands above the legend of numbers.
#[derive(Clone, Debug, PartialEq)]
pub enum Label {
    /// The name of the column, and the unit.
    Column,
    /// These words.
    Words(String),
}

/// The length of a scale bar.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Length {
    /// One that suits the picture.
    Chosen,
    /// This one, in lengths of the scene.
    Of(f64),
}

impl Overlay {
    /// Whether nothing is asked for. A unit alone is nothing.
    pub fn is_empty(&self) -> bool {
        let Self { title, legend, scale_bar, axes, unit: _ } = self;
        title.is_none() && legend.is_none() && scale_bar.is_none() && !axes
    }
}

/// What the keys ask for.
pub(super) fn read(section: &Section) -> Result<Overlay, Fault> {
    Ok(Overlay {
        title: section.read("title", words)?,
        legend: section.read("legend", legend)?.flatten(),
        scale_bar: section.read("scale_bar", length)?.flatten(),
        axes: section.read("axes", truth)?.unwrap_or(false),
        unit: section.read("unit", words)?,
    })
}

/// Text in which something is seen.
fn words(key: &str, value: &Value) -> Result<String, Fault> {
    let text = string(key, value)?;
    if text.trim().is_empty() {
        let fix = format!("write {key} = \"some words\", or remove the line");
        return Err(Fault::new(format!("`{key}` is empty"), value.span(), "no letters", fix));
    }
    Ok(text)
}

fn legend(key: &str, value: &Value) -> Result<Option<Label>, Fault> {
    match value.get_ref() {
        DeValue::String(_) => words(key, value).map(|words| Some(Label::Words(words))),
        DeValue::Boolean(wanted) => Ok(wanted.then_some(Label::Column)),
        _ => Err(Fault::new(
            format!("`{key}` is neither true, false, nor words"),
            value.span(),
            "not a legend",
            "write legend = true, or what the numbers are: legend = \"charge (e)\"",
        )),
    }
}

fn length(key: &str, value: &Value) -> Result<Option<Length>, Fault> {
    let fix = "write scale_bar = true, or a length: scale_bar = 10.0";
    match value.get_ref() {
        DeValue::Boolean(wanted) => Ok(wanted.then_some(Length::Chosen)),
        DeValue::Float(_) | DeValue::Integer(_) => match number(key, value)? {
            length if length > 0.0 => Ok(Some(Length::Of(length))),
            length => {
                let message = format!("`{key}` is {length}, but a length is greater than 0");
                Err(Fault::new(message, value.span(), "not positive", fix))
            }
        },
        _ => Err(Fault::new(
            format!("`{key}` is neither true, false, nor a length"),
            value.span(),
            "not a length",
            fix,
        )),
    }
}
