//! On a wgpu device of the caller's.

use planisphere_gpu::{Gpu, adapters, wgpu};

use crate::{
    Error, Renderer, Request,
    source::{Host, Source},
};

impl Renderer {
    /// What to ask an adapter of yours for; add what you need yourself.
    ///
    /// # Errors
    /// [`Error::NoDevice`] when the adapter lacks something; says what.
    pub fn wgpu_descriptor(
        adapter: &wgpu::Adapter,
    ) -> Result<wgpu::DeviceDescriptor<'static>, Error> {
        adapters::descriptor(adapter).map_err(|words| Error::NoDevice { words })
    }

    /// On a device of yours, whose callbacks stay yours: what fails here is an error here.
    ///
    /// # Errors
    /// [`Error::NoDevice`] when the device was created with too little; says what it lacks.
    pub fn from_wgpu(device: &wgpu::Device, queue: &wgpu::Queue) -> Result<Self, Error> {
        let gpu = Gpu::from_wgpu(device, queue).map_err(|words| Error::NoDevice { words })?;
        let host = Host { device: device.clone(), queue: queue.clone() };
        Ok(Self::from_source(Source::of_host(gpu, host), None, None))
    }

    /// Into a texture of yours, on the device of [`Renderer::from_wgpu`]: colours into `Rgba8Unorm`
    /// and `Rgba8UnormSrgb`, ids into `R32Sint`, depths into `R32Float`. The texture has the size
    /// of the request's region, and the usage `COPY_DST`. The picture is exact, and is there for
    /// whatever is submitted to the queue after this has returned.
    ///
    /// # Errors
    /// [`Error::Texture`] when it is no such texture, and as [`Renderer::draw`].
    pub fn draw_to_texture(&self, request: &Request, texture: &wgpu::Texture) -> Result<(), Error> {
        use wgpu::TextureFormat as F;
        let refused = |words: String| Error::Texture { words };
        let host = self.source().host.as_ref().ok_or_else(|| {
            refused("the renderer has no device of yours; make it with Renderer::from_wgpu".into())
        })?;
        let region = request.drawn_region();
        let size =
            wgpu::Extent3d { width: region.width, height: region.height, depth_or_array_layers: 1 };
        if texture.size() != size || texture.dimension() != wgpu::TextureDimension::D2 {
            let wgpu::Extent3d { width, height, depth_or_array_layers: layers } = texture.size();
            return Err(refused(format!(
                "the texture is {width} x {height} x {layers}; make it {} x {} in one layer",
                size.width, size.height
            )));
        }
        if texture.sample_count() != 1 || !texture.usage().contains(wgpu::TextureUsages::COPY_DST) {
            return Err(refused(
                "the texture cannot be copied to; give it one sample, and the usage COPY_DST"
                    .into(),
            ));
        }
        let pixels = region.pixels();
        let (mut rgba, mut ids, mut depths) = (Vec::new(), Vec::new(), Vec::new());
        match texture.format() {
            F::Rgba8Unorm | F::Rgba8UnormSrgb => rgba.resize(pixels, [0u8; 4]),
            F::R32Sint => ids.resize(pixels, 0i32),
            F::R32Float => depths.resize(pixels, 0f32),
            other => {
                return Err(refused(format!(
                    "the texture has the format {other:?}; give it Rgba8Unorm for colours, \
                     R32Sint for ids, or R32Float for depths"
                )));
            }
        }
        self.draw_to(request, &mut rgba, &mut ids, &mut depths)?;
        let bytes: &[u8] = match (rgba.is_empty(), ids.is_empty()) {
            (false, _) => bytemuck::cast_slice(&rgba),
            (true, false) => bytemuck::cast_slice(&ids),
            (true, true) => bytemuck::cast_slice(&depths),
        };
        let row = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(4 * size.width),
            rows_per_image: None,
        };
        // A texture of another device is told by the device.
        let scope = host.device.push_error_scope(wgpu::ErrorFilter::Validation);
        host.queue.write_texture(texture.as_image_copy(), bytes, row, size);
        match pollster::block_on(scope.pop()) {
            Some(error) => Err(refused(error.to_string())),
            None => Ok(()),
        }
    }
}
