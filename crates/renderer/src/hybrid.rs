//! A GPU, and the CPU for what the GPU leaves.

use std::time::Instant;

use planisphere_core::{
    camera::{Region, View},
    cpu::{self, Cpu},
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
}

impl Hybrid {
    /// With an opened GPU.
    pub fn new(mut gpu: Gpu) -> Self {
        gpu.on(host());
        let effort = cpu::Effort { order: gpu::Effort::default().order, ..cpu::Effort::default() };
        let cpu = Cpu::with(effort).on(host());
        Self { gpu, cpu, control: Control::new(), effort, rest: REST, resting: 0, drawn: None }
    }

    /// With other thresholds, to test that they do not show.
    pub fn set_effort(&mut self, gpu: gpu::Effort, cpu: cpu::Effort, rest: usize) {
        self.gpu.set_effort(gpu);
        (self.effort, self.rest, self.drawn) = (cpu, rest, None);
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
        if self.drawn != Some(scene.identity()) {
            (self.cpu, self.resting) = (Cpu::with(self.effort).on(host()), 0);
            self.cpu.controlled_by(&self.control);
            self.drawn = Some(scene.identity());
        }
        if self.resting > 0 {
            self.resting -= 1;
            return self.draw_on_host(scene, view, region);
        }
        let (mut drawing, left) = match self.gpu.draw(scene, view, region)? {
            Answer::Drawn(drawing, left) => (drawing, left),
            Answer::Unfit => return self.draw_on_host(scene, view, region),
        };
        if left == [region] {
            self.resting = self.rest;
        }
        for band in left {
            let begin = Instant::now();
            let part = self.draw_on_host(scene, view, band)?;
            let first = (band.y - region.y) as usize * region.width as usize;
            drawing.ids[first..first + part.ids.len()].copy_from_slice(&part.ids);
            drawing.counts.exact += part.counts.exact;
            drawing.times.decide += begin.elapsed().as_secs_f64() * 1e3;
        }
        Ok(drawing)
    }

    /// All pixels of a region by the CPU.
    fn draw_on_host(
        &mut self,
        scene: &Scene,
        view: &View,
        region: Region,
    ) -> Result<Drawing, DrawError> {
        if let Some(ordered) = self.gpu.ordered() {
            scene.kept::<Kept>().adopt(ordered);
        }
        let mut drawing = self.cpu.draw(scene, view, region)?;
        drawing.counts.undecided = region.pixels();
        Ok(drawing)
    }
}
