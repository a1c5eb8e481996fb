//! The naive baseline on the GPU is nearly right.

use planisphere_bench::{
    reference::{self, Wrong},
    scenes::{Kind, Recipe},
};
use planisphere_core::camera::{ImageSize, Region, View};
use planisphere_gpu::{Gpu, adapters::AdapterChoice, naive::Naive};

#[test]
fn it_is_nearly_right() {
    let image = ImageSize { width: 70, height: 50 };
    let mut gpu = Gpu::open(&AdapterChoice::Any).expect("the tests have a software device");
    let mut naive = Naive::new(&gpu);
    for recipe in
        [Recipe::new(Kind::Uniform, 200), Recipe::new(Kind::Uniform, 200).in_perspective()]
    {
        let made = recipe.make(image);
        let view = View::new(made.camera, image);
        let exact = reference::exact(&made.scene, &view, Region::whole(image)).ids;
        let wrong = Wrong::count(&naive.draw(&mut gpu, &made.scene, &view).unwrap(), &exact);
        assert!(wrong.total() < 10, "{wrong:?}");
    }
}
