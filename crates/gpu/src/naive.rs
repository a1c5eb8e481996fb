//! A baseline for `bench`: `shaders/naive.wgsl`, every sphere at every pixel, on the device of a
//! [`Gpu`]. No picture that anybody is given comes from here.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use super::{
    Gpu,
    memory::Growing,
    shared::{Failure, Shared},
};
use crate::plan::ITERATIONS;
use planisphere_core::{
    camera::{Projection, Region, View},
    drawing::DrawError,
    scene::Scene,
};
use planisphere_shaders::{NAIVE, NAIVE_SIDE};

/// Software devices end loops after [`ITERATIONS`]; more spheres than this would give a wrong
/// picture in no time.
pub const MOST: usize = 60_000;
// One for each sphere.
const _: () = assert!(MOST < ITERATIONS as usize);

/// `Frame` of the shader.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Frame {
    origin: Vec3,
    count: u32,
    direction: Vec3,
    perspective: u32,
    right: Vec3,
    width: u32,
    down: Vec3,
    height: u32,
    near: f32,
    far: f32,
    rest: [u32; 2],
}

/// The pipeline and buffers; spheres stay on the device.
pub struct Naive {
    pipeline: wgpu::ComputePipeline,
    frame: Growing,
    spheres: Growing,
    ids: Growing,
    staging: Growing,
    /// [`Scene::identity`] of what is on the device.
    uploaded: Option<u64>,
}

impl std::fmt::Debug for Naive {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Naive").field("uploaded", &self.uploaded).finish_non_exhaustive()
    }
}

impl Naive {
    /// On the device of a GPU.
    pub fn new(gpu: &Gpu) -> Self {
        use wgpu::BufferUsages as U;
        let device = &gpu.shared.device;
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("naive"),
            source: wgpu::ShaderSource::Wgsl(NAIVE.text.into()),
        });
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some("naive"),
            layout: None,
            module: &module,
            entry_point: Some("main"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            cache: None,
        });
        Self {
            pipeline,
            frame: Growing::new("naive frame", U::UNIFORM | U::COPY_DST),
            spheres: Growing::new("naive spheres", U::STORAGE | U::COPY_DST),
            ids: Growing::new("naive ids", U::STORAGE | U::COPY_SRC),
            staging: Growing::new("naive staging", U::MAP_READ | U::COPY_DST),
            uploaded: None,
        }
    }

    /// Ids of a whole picture of at most [`MOST`] spheres; pixels may be wrong.
    ///
    /// # Errors
    /// When the device fails.
    pub fn draw(
        &mut self,
        gpu: &mut Gpu,
        scene: &Scene,
        view: &View,
    ) -> Result<Vec<i32>, DrawError> {
        view.check(Region::whole(view.image))?;
        gpu.guarded(|gpu| self.run(gpu, scene, view))
    }

    fn run(&mut self, gpu: &Gpu, scene: &Scene, view: &View) -> Result<Vec<i32>, Failure> {
        let Shared { device, queue, .. } = &*gpu.shared;
        if self.uploaded != Some(scene.identity()) {
            let spheres: Vec<[f32; 4]> = (0..scene.len())
                .map(|index| {
                    let sphere = scene.known(index);
                    let [x, y, z] = sphere.center.as_vec3().to_array();
                    [x, y, z, sphere.radius as f32]
                })
                .collect();
            self.spheres.write(device, queue, &spheres);
            self.uploaded = Some(scene.identity());
        }
        let image = view.image;
        let (first, across, down) = (view.ray(0, 0), view.ray(1, 0), view.ray(0, 1));
        let camera = &view.camera;
        let fan = camera.projection == Projection::Perspective;
        let step = |to: planisphere_core::camera::Ray| {
            if fan { to.direction - first.direction } else { to.origin - first.origin }.as_vec3()
        };
        let frame = Frame {
            origin: first.origin.as_vec3(),
            count: scene.len().min(MOST) as u32,
            direction: first.direction.as_vec3(),
            perspective: u32::from(fan),
            right: step(across),
            width: image.width,
            down: step(down),
            height: image.height,
            near: camera.near as f32,
            // WGSL has no infinity.
            far: camera.far.min(f64::from(f32::MAX)) as f32,
            rest: [0; 2],
        };
        self.frame.write(device, queue, &[frame]);
        let pixels = Region::whole(image).pixels();
        let size = 4 * pixels as u64;
        self.ids.reserve(device, size);
        self.staging.reserve(device, size);
        let entries = [self.frame.binding(), self.spheres.binding(), self.ids.binding()];
        let entries: Vec<_> = (0..)
            .zip(entries)
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
            .collect();
        let layout = self.pipeline.get_bind_group_layout(0);
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &layout,
            entries: &entries,
        });
        let (Some(ids), Some(staging)) = (self.ids.get(), self.staging.get()) else {
            return Ok(Vec::new());
        };
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        {
            let mut compute = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            compute.set_pipeline(&self.pipeline);
            compute.set_bind_group(0, &group, &[]);
            let [across, down] = [image.width, image.height].map(|side| side.div_ceil(NAIVE_SIDE));
            compute.dispatch_workgroups(across, down, 1);
        }
        encoder.copy_buffer_to_buffer(ids, 0, staging, 0, size);
        let submission = queue.submit([encoder.finish()]);
        let slice = staging.slice(..size);
        let (sender, receiver) = std::sync::mpsc::channel();
        slice.map_async(wgpu::MapMode::Read, move |result| {
            let _ = sender.send(result);
        });
        gpu.shared.wait(submission)?;
        receiver.recv().map_err(Failure::silent)?.map_err(Failure::silent)?;
        let mapped =
            slice.get_mapped_range().map_err(|error| DrawError::Device(format!("{error:?}")))?;
        let found = bytemuck::cast_slice(&mapped).to_vec();
        drop(mapped);
        staging.unmap();
        Ok(found)
    }
}
