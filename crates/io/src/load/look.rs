//! The look of `[image]`: its keys, each checked at its place.

use toml::de::DeValue;

use super::document::{Section, Value, color, integer, number, string};
use crate::input::report::Fault;
use planisphere_core::text;
use planisphere_image::look::{Look, LookError};

/// Keys of `[image]` that say what it looks like.
pub(super) const KEYS: [&str; 12] = [
    "background",
    "transparent",
    "look",
    "aa",
    "aa_space",
    "ambient",
    "occlusion_strength",
    "depth_cue",
    "outline",
    "outline_color",
    "outline_by",
    "outline_jump",
];

/// The look that the keys describe, and the column of groups that lines go by.
pub(super) fn read(section: &Section) -> Result<(Look, Option<String>), Fault> {
    let mut look = Look::flat();
    let wrong = |key: &'static str| {
        move |error: LookError| {
            let message = format!("`{key}` {}", text::value(&error.words));
            Fault::new(message, section.place(key), "here", fix(key))
        }
    };
    if let Some(name) = section.read("look", string)? {
        look = look.named(&name).map_err(wrong("look"))?;
    }
    if let Some(background) = section.read("background", color)? {
        look = look.background(background);
    }
    if section.read("transparent", truth)? == Some(true) {
        look = look.transparent();
    }
    if let Some(aa) = section.read("aa", integer)? {
        look = look.aa(u32::try_from(aa).unwrap_or(0)).map_err(wrong("aa"))?;
    }
    if let Some(space) = section.read("aa_space", string)? {
        look = look.space(&space).map_err(wrong("aa_space"))?;
    }
    if let Some(ambient) = section.read("ambient", number)? {
        look = look.ambient(ambient).map_err(wrong("ambient"))?;
    }
    if let Some(strength) = section.read("occlusion_strength", number)? {
        look = look.occlusion_strength(strength).map_err(wrong("occlusion_strength"))?;
    }
    look = match section.read("depth_cue", cue)? {
        None => look,
        Some(Cue::Off) => look.no_depth_cue(),
        Some(Cue::Scene) => look.depth_cue(),
        Some(Cue::Between(depths)) => look.depth_cue_between(depths).map_err(wrong("depth_cue"))?,
    };
    if let Some(line) = section.read("outline_color", color)? {
        look = look.outline_color(line);
    }
    let by = section.read("outline_by", string)?;
    let column = by.as_ref().filter(|by| !matches!(by.as_str(), "jump" | "sphere")).cloned();
    if let Some(by) = by {
        let by = if column.is_some() { "group" } else { &by };
        look = look.outline_by(by).map_err(wrong("outline_by"))?;
    }
    if let Some(jump) = section.read("outline_jump", number)? {
        look = look.outline_jump(jump).map_err(wrong("outline_jump"))?;
    }
    // Last: 0 turns lines off, whatever else is said of them.
    look = match section.read("outline", number)? {
        None => look,
        Some(0.0) => look.no_outline(),
        Some(width) => look.outline(width).map_err(wrong("outline"))?,
    };
    Ok((look, column))
}

/// How a key is written right.
fn fix(key: &str) -> String {
    match key {
        "look" => format!("write look = one of \"{}\"", Look::NAMES.join("\", \"")),
        "aa" => "write aa = 1, 2, 4, 8 or 16".into(),
        "aa_space" => "write aa_space = \"linear\" or \"encoded\"".into(),
        "outline" => "write outline = 1.5, a width in pixels; 0 for none".into(),
        "outline_by" => "write outline_by = \"jump\", \"sphere\", or the name of a column".into(),
        "outline_jump" => "write outline_jump = 2.0, a length".into(),
        "depth_cue" => "write depth_cue = true, or depth_cue = [10.0, 50.0]".into(),
        _ => format!("write {key} = 0.5, a number from 0 to 1"),
    }
}

/// A depth cue as it is written.
enum Cue {
    Off,
    Scene,
    Between([f64; 2]),
}

pub(super) fn truth(key: &str, value: &Value) -> Result<bool, Fault> {
    match value.get_ref() {
        DeValue::Boolean(truth) => Ok(*truth),
        _ => Err(Fault::new(
            format!("`{key}` is neither true nor false"),
            value.span(),
            "not true or false",
            format!("write {key} = true"),
        )),
    }
}

fn cue(key: &str, value: &Value) -> Result<Cue, Fault> {
    match value.get_ref() {
        DeValue::Boolean(true) => Ok(Cue::Scene),
        DeValue::Boolean(false) => Ok(Cue::Off),
        DeValue::Array(items) => match &**items {
            [near, far] => Ok(Cue::Between([number(key, near)?, number(key, far)?])),
            _ => Err(not_a_cue(key, value)),
        },
        _ => Err(not_a_cue(key, value)),
    }
}

fn not_a_cue(key: &str, value: &Value) -> Fault {
    Fault::new(
        format!("`{key}` is neither true, false, nor two depths"),
        value.span(),
        "not a depth cue",
        fix(key),
    )
}
