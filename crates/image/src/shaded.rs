//! The spheres of a scene as a look shades them: their linear colours, and what their levels are
//! found from.

use planisphere_core::{
    exact::decide::Truth,
    ids::NONE,
    levels::{Levels, Lit, Sample},
    scene::Scene,
};

use crate::{
    linear::LIN,
    style::{Shade, Style},
};

/// What is known of spheres beside their places, radii and colours: one number for each.
#[derive(Clone, Copy, Debug, Default)]
pub struct Columns<'a> {
    /// The group of each.
    pub groups: Option<&'a [u32]>,
    /// How open each is, of 255.
    pub openness: Option<&'a [u8]>,
}

/// A linear colour.
pub type Linear = [u32; 3];

/// `F` of a sphere in its own colour.
const FULL: u32 = 255 * 255;

/// The linear values of an sRGB colour.
pub fn linear(color: [u8; 3]) -> Linear {
    color.map(|c| LIN[usize::from(c)].into())
}

/// Spheres of a view.
pub struct Spheres<'a> {
    scene: &'a Scene,
    style: &'a Style,
    columns: Columns<'a>,
    levels: Levels<'a>,
    background: Linear,
}

impl<'a> Spheres<'a> {
    /// Of a view of a scene.
    pub fn new(scene: &'a Scene, truth: &'a Truth, style: &'a Style, columns: Columns<'a>) -> Self {
        let (levels, background) = (Levels::new(scene, truth), linear(style.background));
        Self { scene, style, columns, levels, background }
    }

    /// Levels of their hits.
    pub fn levels(&self) -> &Levels<'a> {
        &self.levels
    }

    /// The group of a sphere.
    pub fn group(&self, id: i32) -> u32 {
        self.columns.groups.map_or(0, |groups| groups[id as usize])
    }

    /// The background's linear values.
    pub fn background(&self) -> Linear {
        self.background
    }

    /// Memory for the spheres that a thread meets.
    pub fn cache(&self) -> Cache<'_> {
        Cache { spheres: self, known: vec![None; Cache::PLACES] }
    }

    fn find(&self, id: i32) -> Known {
        let index = id as usize;
        let lit = self.levels.sphere(index).expect("the ids were checked");
        let color = self.scene.color(index).expect("the ids were checked");
        let factor = match (self.style.occlusion, self.columns.openness) {
            (Some(strength), Some(openness)) => {
                FULL - u32::from(strength) * u32::from(255 - openness[index])
            }
            _ => FULL,
        };
        Known { id, lit, color: linear(color), factor }
    }
}

/// A sphere that was met.
#[derive(Clone, Copy)]
struct Known {
    id: i32,
    lit: Lit,
    color: Linear,
    /// The part of `F` that openness makes.
    factor: u32,
}

/// `X` of the contract: a linear colour, shaded.
#[inline(always)]
fn shaded(color: Linear, factor: u32) -> Linear {
    color.map(|value| (value * factor + FULL / 2) / FULL)
}
// Products fit.
const _: () = assert!(FULL as u64 * FULL as u64 + (FULL / 2) as u64 <= u32::MAX as u64);
const _: () = assert!(65535 * FULL as u64 + (FULL / 2) as u64 <= u32::MAX as u64);

/// The spheres that a thread has met lately.
pub struct Cache<'a> {
    spheres: &'a Spheres<'a>,
    known: Vec<Option<Known>>,
}

impl<'a> Cache<'a> {
    const PLACES: usize = 1024;

    /// Where they are from.
    pub fn spheres(&self) -> &'a Spheres<'a> {
        self.spheres
    }

    #[inline]
    fn known(&mut self, id: i32) -> &Known {
        let place = &mut self.known[id as usize % Self::PLACES];
        match place {
            Some(known) if known.id == id => {}
            _ => *place = Some(self.spheres.find(id)),
        }
        place.as_ref().expect("just found")
    }

    /// A hint that a sphere is soon to be asked for.
    #[inline(always)]
    pub fn prefetch(&self, id: i32) {
        if id != NONE {
            self.spheres.levels.prefetch(id as usize);
        }
    }

    /// What a sphere's levels are found from.
    pub fn lit(&mut self, id: i32) -> Lit {
        self.known(id).lit
    }

    /// The linear colours of a sphere's hits at samples of a row: the first, and every `stride`
    /// columns on. `levels` is memory.
    pub fn colors(
        &mut self,
        id: i32,
        at: Sample,
        stride: u32,
        levels: &mut Vec<u8>,
        colors: &mut [Linear],
    ) {
        let Spheres { style, levels: of, background, .. } = self.spheres;
        let Known { lit, color, factor, .. } = *self.known(id);
        match style.shade {
            Shade::Matte { ambient } => {
                levels.clear();
                levels.resize(colors.len(), 0);
                of.headlights(&lit, at, stride, levels);
                let [whole, rest] = [255 * u32::from(ambient), 255 - u32::from(ambient)];
                for (to, &level) in colors.iter_mut().zip(&*levels) {
                    let level = u32::from(level);
                    let light = whole + rest * ((level * level + 127) / 255);
                    *to = shaded(color, (light * factor + FULL / 2) / FULL);
                }
            }
            Shade::Flat => colors.fill(shaded(color, factor)),
        }
        let Some(planes) = style.cue else { return };
        for (k, to) in (0..).zip(colors) {
            let cue = u32::from(of.cue(&lit, [at[0] + k * stride, at[1]], planes));
            let over = |value: u32, behind: u32| (value * (256 - cue) + behind * cue + 128) / 256;
            *to = std::array::from_fn(|c| over(to[c], background[c]));
        }
    }

    /// Whether all hits of a sphere have one colour.
    pub fn is_even(&self) -> bool {
        let Style { shade, cue, .. } = self.spheres.style;
        !matches!(shade, Shade::Matte { .. }) && cue.is_none()
    }
}
