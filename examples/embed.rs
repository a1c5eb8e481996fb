//! Into a texture of a program that has a wgpu device of its own.
use planisphere::{Camera, Renderer, Request, Scene, Spheres, wgpu};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let instance = wgpu::Instance::default();
    let adapter = pollster::block_on(instance.request_adapter(&Default::default()))?;
    // Asks for what planisphere needs; a program adds what it needs itself.
    let wanted = Renderer::wgpu_descriptor(&adapter)?;
    let (device, queue) = pollster::block_on(adapter.request_device(&wanted))?;

    let scene = Scene::new(Spheres::points(vec![[0.0; 3], [3.0, 0.0, 0.0]], 1.0))?;
    let size = [320, 240];
    let request = Request::new(&scene, Camera::isometric().fit(&scene, size), size)?;
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("spheres"),
        size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba8Unorm,
        usage: wgpu::TextureUsages::COPY_DST | wgpu::TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    });

    let renderer = Renderer::from_wgpu(&device, &queue)?;
    renderer.draw_to_texture(&request, &texture)?;
    println!("drawn by {}", renderer.device());
    Ok(())
}
