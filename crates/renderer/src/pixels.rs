//! Pixels of a look that takes more than ids: samples are drawn piece by piece, and resolved.

use std::{sync::Arc, time::Instant};

use planisphere_core::{
    camera::{MAX_SIDE, Region, View},
    cpu::{self, Piece},
    drawing::{Control, Counts, Times},
    exact::decide::Truth,
};
use planisphere_image::{
    form::Form,
    look::LookError,
    resolve::{Columns, Resolver},
    style::Style,
};

#[cfg(feature = "overlay")]
use crate::overlay::Over;
use crate::{
    Error, Request,
    engine::{Engine, device_error},
    openness::openness,
};

/// Samples that are drawn at a time, about: few stay in the caches, and each time all spheres are
/// looked at.
const SAMPLES: [u32; 2] = [1 << 20, 4 << 20];
/// Samples for each sphere, between these.
const PER_SPHERE: usize = 8;
/// A piece is of so many rows of samples, or a multiple, where it is not more than that: tiles are
/// not cut.
const TILE: u32 = 64;

/// What drawing samples has met.
#[derive(Clone, Debug, Default)]
pub(crate) struct Spent {
    pub counts: Counts,
    pub times: Times,
    /// Milliseconds of samples to pixels.
    pub shade: f64,
    /// Whether any sphere is seen.
    pub seen: bool,
}

/// Makes the pixels of requests that differ in their regions alone.
pub(crate) struct Pixels<'a> {
    request: &'a Request,
    style: Style,
    view: View,
    truth: Truth,
    #[cfg(feature = "overlay")]
    over: Option<Over>,
    /// Bands of all that is drawn, and whether any was.
    bands: usize,
    begun: bool,
    openness: Option<Arc<[u8]>>,
}

impl<'a> Pixels<'a> {
    /// Of a request, whose region is the whole of what will be drawn.
    ///
    /// # Errors
    /// When its overlay has no meaning, or no room.
    pub fn new(request: &'a Request) -> Result<Self, Error> {
        let (core, of_pixels) = (request.scene.core(), request.view());
        let style = request.look.style(&of_pixels, &core.bounds());
        let view = style.samples(&of_pixels);
        let truth = Truth::new(&view, core.bounds());
        let mut all = Self {
            request,
            style,
            view,
            truth,
            #[cfg(feature = "overlay")]
            over: Over::of(request)?,
            bands: 0,
            begun: false,
            openness: None,
        };
        let resolver = all.resolver();
        let pieces = all.pieces(request.region);
        all.bands = pieces.iter().map(|piece| cpu::bands(resolver.samples(*piece))).sum();
        Ok(all)
    }

    fn resolver(&self) -> Resolver<'_> {
        let scene = &self.request.scene;
        let columns = Columns { groups: scene.groups(), openness: self.openness.as_deref() };
        Resolver::new(scene.core(), &self.truth, &self.style, columns)
    }

    /// Pieces of a region, of about as many samples each as [`SAMPLES`] has.
    fn pieces(&self, region: Region) -> Vec<Region> {
        let (n, around) = (self.view.per_pixel, 2 * self.view.margin);
        let across = region.width.min((MAX_SIDE - around) / n);
        let [least, most] = SAMPLES;
        let wanted = PER_SPHERE.saturating_mul(self.request.scene.core().len());
        let samples = (wanted.min(most as usize) as u32).max(least);
        let rows = (samples / (across * n + around)).saturating_sub(around).max(1);
        let rows = if rows >= TILE { rows / TILE * TILE } else { rows };
        let down = (rows / n).max(1);
        let mut pieces = Vec::new();
        for y in (region.y..region.y + region.height).step_by(down as usize) {
            for x in (region.x..region.x + region.width).step_by(across as usize) {
                let width = across.min(region.x + region.width - x);
                let height = down.min(region.y + region.height - y);
                pieces.push(Region { x, y, width, height });
            }
        }
        pieces
    }

    /// Whether samples are the middles of pixels, so that their ids are those of the picture.
    pub fn has_ids(&self) -> bool {
        self.view.per_pixel == 1
    }

    /// Draws the pixels of some whole rows, in any form, with what is over them. And their ids,
    /// unless `ids` is empty: only where [`Pixels::has_ids`].
    pub fn draw<P: Form>(
        &mut self,
        engine: &mut Engine,
        region: Region,
        control: &Control,
        to: &mut [P],
        ids: &mut [i32],
    ) -> Result<Spent, Error> {
        let spent = self.draw_under(engine, region, control, to, ids)?;
        #[cfg(feature = "overlay")]
        if let (Some(over), Some(to)) = (&self.over, P::bytes(to)) {
            over.onto(region, to)?;
        }
        Ok(spent)
    }

    /// The same without what is over them.
    fn draw_under<P: Form>(
        &mut self,
        engine: &mut Engine,
        region: Region,
        control: &Control,
        to: &mut [P],
        ids: &mut [i32],
    ) -> Result<Spent, Error> {
        let (mut spent, scene) = (Spent::default(), &self.request.scene);
        let mut control = control.clone();
        if self.request.look.needs_openness() && self.openness.is_none() {
            self.openness = Some(openness(engine, scene, &control.part([0.0, 0.5]))?);
            control = control.part([0.5, 1.0]);
        }
        let resolver = self.resolver();
        let (pieces, mut first) = (self.pieces(region), !self.begun);
        let mut part = Vec::new();
        let mut done = 0;
        for piece in pieces {
            scene.check()?;
            let share = [done, done + piece.pixels()].map(|n| n as f32 / region.pixels() as f32);
            engine.controlled_by(&control.part(share));
            let samples = resolver.samples(piece);
            let of = Piece { bands: self.bands, first };
            first = false;
            let drawn = engine.draw_piece(scene.core(), &self.view, samples, Some(of));
            let drawing = drawn.map_err(|error| device_error(engine, error))?;
            scene.check()?;
            control.check()?;
            spent.seen = spent.seen || drawing.ids.iter().any(|id| *id >= 0);
            let begin = Instant::now();
            let start = (piece.y - region.y) as usize * region.width as usize;
            debug_assert!(ids.is_empty() || self.has_ids());
            if piece.width == region.width {
                let to = &mut to[start..start + piece.pixels()];
                resolver.pixels(piece, &drawing.ids, to)?;
            } else {
                part.resize(piece.pixels(), P::default());
                resolver.pixels(piece, &drawing.ids, &mut part)?;
                let (aside, width) = ((piece.x - region.x) as usize, piece.width as usize);
                let rows = to[start..].chunks_mut(region.width as usize);
                for (to, from) in rows.zip(part.chunks(width)) {
                    to[aside..aside + width].copy_from_slice(from);
                }
            }
            spent.shade += begin.elapsed().as_secs_f64() * 1e3;
            if !ids.is_empty() {
                let rows = drawing.ids.chunks(samples.width as usize);
                let (margin, aside) = (self.view.margin as usize, (piece.x - region.x) as usize);
                let rows = rows.skip(margin).take(piece.height as usize);
                for (to, from) in ids[start..].chunks_mut(region.width as usize).zip(rows) {
                    let width = piece.width as usize;
                    to[aside..aside + width].copy_from_slice(&from[margin..margin + width]);
                }
            }
            spent.counts.add(&drawing.counts);
            spent.times.add(&drawing.times);
            engine.lend(drawing.ids);
            done += piece.pixels();
        }
        self.begun = true;
        Ok(spent)
    }
}

/// Refuses a look for which something is missing.
///
/// # Errors
/// When lines go by groups, and the scene has none.
pub(crate) fn check(request: &Request) -> Result<(), Error> {
    if request.look.needs_groups() && request.scene.groups().is_none() {
        let words =
            "goes by groups, and the scene has none; give each sphere one (Scene::grouped)".into();
        return Err(LookError { what: "outline", words }.into());
    }
    Ok(())
}
