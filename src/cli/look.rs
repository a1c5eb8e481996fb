//! Options of the look: in place of what a scene file says, or of what is chosen.

use clap::Args as ClapArgs;

use super::reading::parse_color;
use planisphere_renderer::{Look, LookError};

/// The look, as typed.
#[derive(ClapArgs, Clone, Debug, Default)]
#[command(next_help_heading = "Look")]
pub(super) struct LookArgs {
    /// flat: the spheres' own colours. matte: shaded by a light at the eye. soft: shaded by how
    /// open each sphere is. illustrative: flat, with outlines and a depth cue
    ///
    /// Scene files are flat without, files of particles matte.
    #[arg(long, value_name = "NAME", value_parser = parse_look)]
    look: Option<String>,

    /// Samples a side of each pixel: 1, 2, 4, 8 or 16
    ///
    /// The picture is the mean of the exact picture of so many times the size. Without this, flat
    /// pictures have 1 and all others 4.
    #[arg(long, value_name = "N", value_parser = parse_aa)]
    aa: Option<u32>,

    /// Where samples are averaged: in linear light, or as encoded sRGB bytes, as many programs do
    #[arg(long, value_name = "linear|encoded", value_parser = parse_space)]
    aa_space: Option<String>,

    /// Light that comes from everywhere, 0 to 1, of matte: 0.2 without
    #[arg(long, value_name = "PART", value_parser = parse_ambient, allow_negative_numbers = true)]
    ambient: Option<f64>,

    /// How much spheres are darkened that are not open to the space around, 0 to 1, of any look;
    /// without, soft has 0.9 and all others 0
    #[arg(long, value_name = "PART", value_parser = parse_strength, allow_negative_numbers = true)]
    occlusion_strength: Option<f64>,

    /// Lines this many pixels wide where what is seen changes and lies apart; 0 for none
    #[arg(long, value_name = "WIDTH", value_parser = parse_outline, allow_negative_numbers = true)]
    outline: Option<f64>,

    /// Colour of these lines: #rrggbb, #rgb or a name of CSS; black without
    #[arg(long, value_name = "COLOR", value_parser = parse_color)]
    outline_color: Option<[u8; 3]>,

    /// Where lines are: jump, where distances jump; sphere, around every sphere too; or the name of
    /// a column, where its values differ too (chain, residue, molecule, cluster)
    #[arg(long, value_name = "jump|sphere|COLUMN")]
    outline_by: Option<String>,

    /// How far apart, in lengths of the scene, a jump is: the nearer sphere's radius without
    #[arg(long, value_name = "LENGTH", value_parser = parse_jump, allow_negative_numbers = true)]
    outline_jump: Option<f64>,

    /// Colours go over into the background's: along the scene, or between two distances
    #[arg(
        long,
        value_name = "NEAR,FAR",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = "scene",
        value_parser = parse_cue
    )]
    depth_cue: Option<Cue>,
}

/// A depth cue, as typed.
#[derive(Clone, Copy, Debug)]
enum Cue {
    Off,
    Scene,
    Between([f64; 2]),
}

impl LookArgs {
    /// Where lines are.
    pub fn outline_by(&self) -> Option<&str> {
        self.outline_by.as_deref()
    }

    /// The column by which lines are drawn, if it is one.
    fn column(&self) -> Option<&str> {
        self.outline_by.as_deref().filter(|by| !matches!(*by, "jump" | "sphere"))
    }

    /// Whether nothing was typed of what a look is at first.
    pub fn is_usual(&self) -> bool {
        self.look.is_none() && self.aa.is_none()
    }

    /// Puts what was typed in place of what a look is.
    pub fn apply(&self, mut look: Look) -> Result<Look, LookError> {
        if let Some(name) = &self.look {
            look = look.named(name)?;
        }
        if let Some(aa) = self.aa {
            look = look.aa(aa)?;
        }
        if let Some(space) = &self.aa_space {
            look = look.space(space)?;
        }
        if let Some(ambient) = self.ambient {
            look = look.ambient(ambient)?;
        }
        if let Some(strength) = self.occlusion_strength {
            look = look.occlusion_strength(strength)?;
        }
        look = match self.depth_cue {
            None => look,
            Some(Cue::Off) => look.no_depth_cue(),
            Some(Cue::Scene) => look.depth_cue(),
            Some(Cue::Between(depths)) => look.depth_cue_between(depths)?,
        };
        if let Some(color) = self.outline_color {
            look = look.outline_color(color);
        }
        if let Some(by) = &self.outline_by {
            look = look.outline_by(if self.column().is_some() { "group" } else { by })?;
        }
        if let Some(jump) = self.outline_jump {
            look = look.outline_jump(jump)?;
        }
        match self.outline {
            None => Ok(look),
            Some(0.0) => Ok(look.no_outline()),
            Some(width) => look.outline(width),
        }
    }
}

/// What a look says of a wish, about an option.
fn checked<T: Clone>(
    value: T,
    wish: impl FnOnce(T) -> Result<Look, LookError>,
) -> Result<T, String> {
    wish(value.clone()).map(|_| value).map_err(|error| error.words)
}

fn number(text: &str) -> Result<f64, String> {
    text.parse().map_err(|_| "is not a number; write one, such as 0.5".into())
}

fn parse_look(text: &str) -> Result<String, String> {
    checked(text.to_owned(), |name| Look::flat().named(&name))
}

fn parse_aa(text: &str) -> Result<u32, String> {
    let samples = text.parse().map_err(|_| "is none of 1, 2, 4, 8 and 16".to_owned())?;
    checked(samples, |samples| Look::flat().aa(samples))
}

fn parse_space(text: &str) -> Result<String, String> {
    checked(text.to_owned(), |space| Look::flat().space(&space))
}

fn parse_ambient(text: &str) -> Result<f64, String> {
    checked(number(text)?, |part| Look::flat().ambient(part))
}

fn parse_strength(text: &str) -> Result<f64, String> {
    checked(number(text)?, |part| Look::flat().occlusion_strength(part))
}

fn parse_outline(text: &str) -> Result<f64, String> {
    let width = number(text)?;
    if width == 0.0 { Ok(width) } else { checked(width, |width| Look::flat().outline(width)) }
}

fn parse_jump(text: &str) -> Result<f64, String> {
    checked(number(text)?, |length| Look::flat().outline_jump(length))
}

fn parse_cue(text: &str) -> Result<Cue, String> {
    match text {
        "off" => return Ok(Cue::Off),
        "scene" => return Ok(Cue::Scene),
        _ => {}
    }
    let depths = text.split_once(',').and_then(|(near, far)| {
        Some([near.trim().parse::<f64>().ok()?, far.trim().parse::<f64>().ok()?])
    });
    let depths = depths.ok_or("is not NEAR,FAR; write two distances, such as 10,50, or off")?;
    checked(depths, |depths| Look::flat().depth_cue_between(depths)).map(Cue::Between)
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;

    #[derive(Parser)]
    struct Typed {
        #[command(flatten)]
        look: LookArgs,
    }

    /// The options that a look says it is made by make it, but for its background.
    #[test]
    fn options_of_a_look_give_it_back() {
        let cases: [&[&str]; 7] = [
            &[],
            &["--look", "matte", "--ambient", "0.3", "--aa", "1"],
            &["--look", "soft", "--occlusion-strength", "0.123", "--aa-space", "encoded"],
            &["--look", "illustrative", "--outline", "0", "--depth-cue=off"],
            &["--outline", "2.5", "--outline-by", "sphere", "--outline-jump", "0.1"],
            &["--outline-color", "#010203", "--depth-cue"],
            &["--depth-cue=-1.5,1e300"],
        ];
        let look = |words: &[String]| {
            let words = ["test".to_owned()].iter().chain(words).cloned().collect::<Vec<_>>();
            Typed::try_parse_from(words).unwrap().look.apply(Look::flat()).unwrap()
        };
        for case in cases {
            let typed = look(&case.iter().map(|word| (*word).to_owned()).collect::<Vec<_>>());
            let words = typed.options();
            assert_eq!(look(&words), typed, "{case:?}: {words:?}");
        }
    }
}
