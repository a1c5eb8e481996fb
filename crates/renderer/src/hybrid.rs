//! A GPU, and the CPU for what the GPU leaves.

use std::time::Instant;

use planisphere_core::{
    camera::{Region, View},
    cpu::{self, Cpu, Piece},
    drawing::{Control, DrawError, Drawing},
    order::Kept,
    scene::Scene,
};
use planisphere_gpu as gpu;
use planisphere_gpu::{Answer, Gpu};

use crate::host;

/// Frames of a scene that a GPU is not asked for after one of which it left all to the CPU.
pub const REST: usize = 15;

/// A GPU, and the CPU for what the GPU cannot draw or had better not: scenes whose numbers it
/// cannot hold, and pictures in which nearly every pixel is hard.
#[derive(Debug)]
pub struct Hybrid {
    /// The GPU.
    pub gpu: Gpu,
    cpu: Cpu,
    control: Control,
    effort: cpu::Effort,
    /// How many frames the GPU rests after one that it left to the CPU.
    rest: usize,
    /// How many of them are left.
    resting: usize,
    /// [`Scene::identity`] of what was drawn last.
    drawn: Option<u64>,
    /// Why the last drawing was left to the CPU as a whole, if it was.
    stood_in: Option<&'static str>,
}

/// Why the CPU draws what a GPU cannot.
const UNFIT: &str = "by the CPU: the GPU's numbers cannot hold this scene from this camera";
/// Why the CPU draws what a GPU had better not.
const HARD: &str = "by the CPU: most pixels are too close to call for the GPU's numbers";

impl Hybrid {
    /// With an opened GPU.
    pub fn new(mut gpu: Gpu) -> Self {
        gpu.on(host());
        let effort = cpu::Effort { order: gpu::Effort::default().order, ..cpu::Effort::default() };
        let cpu = Cpu::with(effort).on(host());
        let control = Control::new();
        Self { gpu, cpu, control, effort, rest: REST, resting: 0, drawn: None, stood_in: None }
    }

    /// With other thresholds, to test that they do not show.
    pub fn set_effort(&mut self, gpu: gpu::Effort, cpu: cpu::Effort, rest: usize) {
        self.gpu.set_effort(gpu);
        (self.effort, self.rest, self.drawn) = (cpu, rest, None);
    }

    /// Lends memory for the next ids.
    pub fn lend(&mut self, ids: Vec<i32>) {
        self.gpu.lend(ids);
    }

    /// Why the last drawing was left to the CPU as a whole, if it was.
    pub fn stood_in(&self) -> Option<&'static str> {
        self.stood_in
    }

    /// Drawings end when this is cancelled.
    pub fn controlled_by(&mut self, control: &Control) {
        self.control = control.clone();
        self.cpu.controlled_by(control);
        self.gpu.controlled_by(control);
    }

    /// Draws a region of a view of a scene. After a picture that the GPU left to the CPU as a
    /// whole, the next frames of the same scene are drawn by the CPU alone.
    ///
    /// # Errors
    /// As [`crate::Engine::draw`].
    pub fn draw(
        &mut self,
        scene: &Scene,
        view: &View,
        region: Region,
    ) -> Result<Drawing, DrawError> {
        self.draw_piece(scene, view, region, None)
    }

    /// The same, as a piece of a picture that is drawn in several.
    ///
    /// # Errors
    /// As [`crate::Engine::draw`].
    pub fn draw_piece(
        &mut self,
        scene: &Scene,
        view: &View,
        region: Region,
        piece: Option<Piece>,
    ) -> Result<Drawing, DrawError> {
        if self.drawn != Some(scene.identity()) {
            (self.cpu, self.resting) = (Cpu::with(self.effort).on(host()), 0);
            self.cpu.controlled_by(&self.control);
            self.drawn = Some(scene.identity());
        }
        self.stood_in = None;
        if self.resting > 0 {
            self.resting -= 1;
            self.stood_in = Some(HARD);
            return self.draw_on_host(scene, view, region, piece);
        }
        let (mut drawing, left) = match self.gpu.draw(scene, view, region)? {
            Answer::Drawn(drawing, left) => (drawing, left),
            Answer::Unfit => {
                self.stood_in = Some(UNFIT);
                return self.draw_on_host(scene, view, region, piece);
            }
        };
        if left == [region] {
            self.stood_in = Some(HARD);
            self.resting = self.rest;
        }
        let whole = self.control.clone();
        for band in left {
            let begin = Instant::now();
            // The GPU has told of the bands before, and of most of this one.
            let share = [band.y - region.y, band.y - region.y + band.height];
            let share = share.map(|row| row as f32 / region.height as f32);
            self.cpu.controlled_by(&whole.part(share));
            let part = self.draw_on_host(scene, view, band, piece)?;
            let first = (band.y - region.y) as usize * region.width as usize;
            drawing.ids[first..first + part.ids.len()].copy_from_slice(&part.ids);
            drawing.counts.exact += part.counts.exact;
            drawing.times.decide += begin.elapsed().as_secs_f64() * 1e3;
        }
        self.cpu.controlled_by(&whole);
        Ok(drawing)
    }

    /// All pixels of a region by the CPU.
    fn draw_on_host(
        &mut self,
        scene: &Scene,
        view: &View,
        region: Region,
        piece: Option<Piece>,
    ) -> Result<Drawing, DrawError> {
        if let Some(ordered) = self.gpu.ordered() {
            scene.kept::<Kept>().adopt(ordered);
        }
        let mut drawing = self.cpu.draw_piece(scene, view, region, piece)?;
        drawing.counts.undecided = region.pixels();
        Ok(drawing)
    }
}
