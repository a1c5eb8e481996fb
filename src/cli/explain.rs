//! `planisphere render --explain`, and the refusal of what cannot fit into memory: facts from the
//! request, the device and the system.

use super::{Failure, args::RenderRequest, planes, print};
use crate::explain::{self, Facts, Means, Survey};
use planisphere_core::{
    camera::{Region, View},
    cpu,
    exact::decide::Truth,
    scene::Scene,
    text,
};
#[cfg(feature = "gpu")]
use planisphere_gpu::plan;
use planisphere_memory as memory;
use planisphere_renderer::Engine;

/// Spheres that are looked at for an explanation.
const LOOK: usize = 1 << 20;
/// Bytes of an entry of the native device's lists while they are made and sorted.
const CPU_ENTRY: usize = 124;
/// The same of a GPU's lists, with their copy on the way to the device.
#[cfg(feature = "gpu")]
const GPU_ENTRY: usize = 40;
/// What needs no more memory than this is not worth asking the system.
const SMALL: u64 = 64 << 20;

/// All that is known without looking at the spheres.
pub(super) fn facts(
    request: &RenderRequest,
    scene: &Scene,
    view: &View,
    region: Region,
    device: &Engine,
    words: String,
) -> Facts {
    let (engine, tile, wave, band) = match device {
        Engine::Cpu(_) => {
            let engine = Means::Cpu {
                threads: rayon::current_num_threads(),
                sampled: cpu::SAMPLED,
                ordered: cpu::ORDERED,
            };
            (engine, 1 << cpu::shift(region), [cpu::WAVE, CPU_ENTRY], cpu::BAND)
        }
        #[cfg(feature = "gpu")]
        Engine::Gpu(hybrid) => {
            let gpu = &hybrid.gpu;
            let (chunk, limits) = gpu.capacity();
            let engine = Means::Gpu { software: gpu.is_software(), chunk };
            (engine, plan::TILE, [limits.wave, GPU_ENTRY], limits.tiles * plan::TILE_PIXELS)
        }
    };
    let words = match engine {
        Means::Cpu { threads, .. } => format!("{words}; {threads} threads"),
        Means::Gpu { .. } => words,
    };
    // Every sphere in every tile is the most there can be.
    let tiles = u64::from(region.width.div_ceil(tile)) * u64::from(region.height.div_ceil(tile));
    let survey = Survey { entries: tiles.saturating_mul(scene.len() as u64), ..Survey::default() };
    let outputs = &request.outputs;
    Facts {
        engine,
        device: words,
        spheres: scene.len(),
        image: view.image,
        region,
        projection: view.camera.projection,
        planes: [view.camera.near, view.camera.far],
        tile,
        wave,
        band,
        held: planes::BAND,
        picture: outputs.picture.is_some(),
        palette: outputs.palette,
        ids: outputs.ids.is_some(),
        depth: outputs.depth.is_some(),
        visibility: outputs.visibility.is_some(),
        survey,
    }
}

/// Looks at the spheres, and says what would run.
pub(super) fn print_lines(facts: &Facts, scene: &Scene, view: &View) -> Result<(), Failure> {
    let truth = Truth::new(view, scene.bounds());
    let survey = explain::survey(scene, &truth, facts.region, facts.tile.trailing_zeros(), LOOK);
    let lines = explain::lines(&Facts { survey, ..facts.clone() });
    let words: String = lines.iter().map(|(topic, words)| format!("{topic:<9}{words}\n")).collect();
    print(&text::lines(&words))
}

/// Refuses, before anything is drawn, what cannot fit.
pub(super) fn check_memory(facts: &Facts) -> Result<(), Failure> {
    let needed = explain::memory(facts);
    match memory::available() {
        Some(available) if needed > SMALL => fits(facts, needed, available),
        _ => Ok(()),
    }
}

fn fits(facts: &Facts, needed: u64, available: u64) -> Result<(), Failure> {
    if needed <= available {
        return Ok(());
    }
    let other = match facts.engine {
        Means::Gpu { software: true, .. } => {
            "take --device cpu, which keeps no copy of the spheres"
        }
        _ => "draw it in parts (--region with --visibility, then `planisphere merge`)",
    };
    Err(Failure::Memory(format!(
        "this picture needs about {} of memory beside the scene, and {} is available; {other}, or \
         free some memory",
        text::bytes(needed),
        text::bytes(available)
    )))
}

#[cfg(test)]
mod tests {
    use super::*;
    use planisphere_core::camera::{ImageSize, Projection};

    #[test]
    fn what_cannot_fit_is_refused_with_both_numbers() {
        let image = ImageSize { width: 1024, height: 1024 };
        let mut facts = Facts {
            engine: Means::Gpu { software: true, chunk: 1 << 23 },
            device: String::new(),
            spheres: 100_000_000,
            image,
            region: Region::whole(image),
            projection: Projection::Orthographic,
            planes: [0.0, 1.0],
            tile: 8,
            wave: [1 << 22, GPU_ENTRY],
            band: 1 << 22,
            held: planes::BAND,
            picture: true,
            palette: false,
            ids: false,
            depth: false,
            visibility: false,
            survey: Survey { entries: 1 << 40, ..Survey::default() },
        };
        let needed = explain::memory(&facts);
        let failure = fits(&facts, needed, 2_048_000_000).expect_err("does not fit");
        let words = failure.to_string();
        assert!(words.contains("3.") && words.contains("2.0 GB is available"), "{words}");
        assert!(words.contains("--device cpu") && failure.exit_code() == 2, "{words}");
        facts.engine = Means::Cpu { threads: 2, sampled: cpu::SAMPLED, ordered: cpu::ORDERED };
        facts.wave = [cpu::WAVE, CPU_ENTRY];
        let needed = explain::memory(&facts);
        assert!(needed < 500_000_000 && fits(&facts, needed, 2_048_000_000).is_ok());
        let words = fits(&facts, needed, 1 << 20).expect_err("does not fit").to_string();
        assert!(words.contains("--region"), "{words}");
    }
}
