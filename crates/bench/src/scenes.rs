//! The scenes that are measured: made in memory from a seed, the same on every machine.
//!
//! Nearly all lie in a unit cube, and are looked at from one oblique direction that shows the whole
//! cube. Coordinates and radii are f32, as simulations store them.

use std::{
    fs::File,
    io::{self, BufWriter, Write},
    path::{Path, PathBuf},
};

use glam::{DVec3, Vec3};
use rayon::prelude::*;
use serde::Serialize;

use planisphere_core::{
    camera::{Camera, ImageSize, Projection, ScreenSize, View},
    scene::{Block, Colors, Radii, Reals, Scene},
};
use planisphere_io::{
    make::{Cloud, Lattice, Random},
    npy::header as npy_header,
};

/// What spheres do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// There is none.
    Empty,
    /// At random places in the cube.
    Uniform,
    /// In 32 dense heaps.
    Clustered,
    /// Touching, on a face-centred cubic lattice.
    Lattice,
    /// A long folded chain of a few kinds of overlapping atoms.
    Molecule,
    /// All over one pixel.
    HotPixel,
    /// [`Kind::Uniform`] beside the view.
    OffScreen,
    /// 99 % of [`Kind::Uniform`] beside the view, 1 % in it.
    MostlyOffScreen,
    /// [`Kind::Uniform`] behind one large sphere.
    Hidden,
    /// 99 % of [`Kind::Uniform`] behind one large sphere, 1 % in front of it.
    MostlyHidden,
    /// Every sphere of [`Kind::Uniform`] twice.
    Twice,
    /// [`Kind::Uniform`] in groups of eight that differ by about a 10,000th of a radius.
    Coincident,
}

impl Kind {
    /// All kinds.
    pub const ALL: [Self; 12] = [
        Self::Empty,
        Self::Uniform,
        Self::Clustered,
        Self::Lattice,
        Self::Molecule,
        Self::HotPixel,
        Self::OffScreen,
        Self::MostlyOffScreen,
        Self::Hidden,
        Self::MostlyHidden,
        Self::Twice,
        Self::Coincident,
    ];

    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Empty => "empty",
            Self::Uniform => "uniform",
            Self::Clustered => "clustered",
            Self::Lattice => "fcc lattice",
            Self::Molecule => "molecule",
            Self::HotPixel => "one hot pixel",
            Self::OffScreen => "all off screen",
            Self::MostlyOffScreen => "99 % off screen",
            Self::Hidden => "all hidden",
            Self::MostlyHidden => "99 % hidden",
            Self::Twice => "every sphere twice",
            Self::Coincident => "near-coincident",
        }
    }
}

/// How large spheres are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Size {
    /// As large as 7 % of the cube's volume makes them.
    Volume,
    /// A radius in pixels of the picture.
    Pixels(f64),
}

/// What to make.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Recipe {
    /// What the spheres do.
    pub kind: Kind,
    /// How many.
    pub count: usize,
    /// How large; a lattice and a molecule have their own sizes.
    pub size: Size,
    /// How they are seen.
    pub projection: Projection,
}

/// A scene, and from where it is seen.
#[derive(Clone, Debug)]
pub struct Made {
    /// In words.
    pub name: String,
    /// The spheres.
    pub scene: Scene,
    /// Shows the whole cube.
    pub camera: Camera,
}

impl Made {
    /// The same with a scene of which nothing was found yet: a device that begins with it is not
    /// helped by what others found.
    #[must_use]
    pub fn fresh(&self) -> Self {
        Self { scene: self.scene.fresh(), ..self.clone() }
    }
}

/// Seen along this.
const DIRECTION: DVec3 = DVec3::new(-1.0, -1.0, -0.75);
/// Width of what is seen, in sides of the cube: its diagonal and a little more.
const WIDTH: f64 = 1.9;
/// From so far, in sides of the cube: there is room in front of it for what hides it.
const DISTANCE: f64 = 16.0;
/// Bonds and radii of atoms, in hundredths of a nanometre.
const BOND: f64 = 15.0;
const ATOMS: [f64; 4] = [17.0, 12.0, 15.5, 15.2];
/// Makes all that is random.
const RANDOM: Random = Random { seed: 1 };

impl Recipe {
    /// Of some kind and count at 7 % of the volume, orthographic.
    pub fn new(kind: Kind, count: usize) -> Self {
        Self { kind, count, size: Size::Volume, projection: Projection::Orthographic }
    }

    /// With a radius in pixels.
    pub fn of_pixels(self, radius: f64) -> Self {
        Self { size: Size::Pixels(radius), ..self }
    }

    /// As many uniform spheres of a radius in pixels as cover the picture's middle with so many
    /// layers.
    pub fn layers(radius: f64, layers: f64, image: ImageSize) -> Self {
        // The cube fills about a third of the picture; its mean shadow in this direction is its
        // faces' share of the view.
        let side = f64::from(image.width) / WIDTH;
        let unit = DIRECTION / DIRECTION.length();
        let shadow = side * side * unit.abs().element_sum();
        let count =
            (layers * shadow / (std::f64::consts::PI * radius * radius)).round().max(1.0) as usize;
        Self::new(Kind::Uniform, count).of_pixels(radius)
    }

    /// In perspective.
    pub fn in_perspective(self) -> Self {
        Self { projection: Projection::Perspective, ..self }
    }

    /// What it is, in words; the count is told apart.
    pub fn name(&self) -> String {
        let mut name = self.kind.words().to_owned();
        if let Size::Pixels(radius) = self.size {
            name += &format!(", {radius} px");
        }
        if self.projection == Projection::Perspective {
            name += ", perspective";
        }
        name
    }

    /// Makes it for a picture of some size. The seed is fixed.
    pub fn make(&self, image: ImageSize) -> Made {
        let Cube { centers, radii, corner, side } = self.cube(image);
        let colors = Colors::Same([200; 3]);
        let block = Block { centers: Reals::F32(centers.into()), radii, colors };
        let scene = Scene::new(vec![block]).expect("what is made here is finite and positive");
        Made { name: self.name(), scene, camera: camera(corner, side, self.projection) }
    }

    /// The spheres, in a unit cube unless their kind has another.
    fn cube(&self, image: ImageSize) -> Cube {
        let count = self.count;
        let radius = self.radius(image);
        let same = Radii::Same(radius.into());
        let kind = if count == 0 { Kind::Empty } else { self.kind };
        match kind {
            Kind::Empty => Cube::unit(Vec::new(), same),
            Kind::Uniform => Cube::unit(fill(count, unit), same),
            Kind::Clustered => Cube::unit(fill(count, clustered), same),
            Kind::Lattice => lattice(count),
            Kind::Molecule => self.molecule(RANDOM),
            Kind::HotPixel => self.hot_pixel(image),
            Kind::OffScreen => Cube::unit(fill(count, |index| beside(unit(index))), same),
            Kind::MostlyOffScreen => {
                let place = |index: usize| {
                    if index.is_multiple_of(100) { unit(index) } else { beside(unit(index)) }
                };
                Cube::unit(fill(count, place), same)
            }
            Kind::Hidden | Kind::MostlyHidden => self.hidden(radius),
            Kind::Twice => Cube::unit(fill(count, |index| unit(index % count.div_ceil(2))), same),
            Kind::Coincident => {
                let place =
                    |index: usize| unit(index / 8) + 1e-4 * radius * (unit(count + index) - 0.5);
                Cube::unit(fill(count, place), same)
            }
        }
    }

    /// The radius of all spheres, where a kind has no other.
    fn radius(&self, image: ImageSize) -> f32 {
        match self.size {
            Size::Volume => Cloud::new(self.count.max(1) as u32, 1).radius(),
            Size::Pixels(radius) => (radius * WIDTH / f64::from(image.width)) as f32,
        }
    }

    /// Spheres whose centres all lie behind the pixel in the middle.
    fn hot_pixel(&self, image: ImageSize) -> Cube {
        let pixel = WIDTH / f64::from(image.width);
        let place = |index: usize| {
            let [x, y, z] = (unit(index) - 0.5).as_dvec3().to_array();
            let (right, up) = (DIRECTION.cross(DVec3::Z).normalize(), DVec3::Z);
            let aside = pixel * (x * right + y * up.reject_from(DIRECTION).normalize());
            (DVec3::splat(0.5) + z * DIRECTION / DIRECTION.length() + aside).as_vec3()
        };
        let radius = match self.size {
            Size::Volume => 4.0 * pixel,
            Size::Pixels(_) => self.radius(image).into(),
        };
        Cube::unit(fill(self.count, place), Radii::Same(f64::from(radius as f32)))
    }

    /// Spheres behind a large one, the last; some in front of it, if that is the kind.
    fn hidden(&self, radius: f32) -> Cube {
        let count = self.count;
        let shown = |index: usize| self.kind == Kind::MostlyHidden && index.is_multiple_of(100);
        let big = count - 1;
        let place = |index: usize| match index {
            _ if index == big => away(Vec3::splat(0.5), -4.5),
            _ if shown(index) => away(unit(index), -9.5),
            _ => unit(index),
        };
        let mut radii = vec![radius; count];
        radii[big] = 3.0;
        Cube::unit(fill(count, place), Radii::Each(Reals::F32(radii.into())))
    }

    /// A random walk of one bond a step inside a box that it fills half; scaled to the unit cube.
    fn molecule(&self, random: Random) -> Cube {
        let volume = self.count.max(1) as f64 * 4.0 / 3.0 * std::f64::consts::PI * 15.0f64.powi(3);
        let side = cube_root(2.0 * volume);
        let (mut centers, mut radii) =
            (Vec::with_capacity(3 * self.count), Vec::with_capacity(self.count));
        let mut at = DVec3::splat(0.5 * side);
        for index in 0..self.count as u64 {
            centers.extend((at / side).as_vec3().to_array());
            radii.push((ATOMS[(random.bits(4 * index) >> 62) as usize] / side) as f32);
            let step =
                DVec3::from_array([1, 2, 3].map(|k| f64::from(random.unit(4 * index + k)) - 0.5));
            let step = if step == DVec3::ZERO { DVec3::X } else { step };
            at += BOND / step.length() * step;
            // Walls turn it back.
            at = at.abs();
            at = at.min(2.0 * DVec3::splat(side) - at);
        }
        Cube::unit(centers, Radii::Each(Reals::F32(radii.into())))
    }
}

/// Spheres in a cube.
struct Cube {
    centers: Vec<f32>,
    radii: Radii,
    corner: DVec3,
    side: f64,
}

impl Cube {
    /// The unit cube.
    fn unit(centers: Vec<f32>, radii: Radii) -> Self {
        Self { centers, radii, corner: DVec3::ZERO, side: 1.0 }
    }
}

/// A random place in the unit cube.
fn unit(index: usize) -> Vec3 {
    Vec3::from_array([0, 1, 2].map(|k| RANDOM.unit(3 * index as u64 + k)))
}

/// A random place in one of 32 heaps.
fn clustered(index: usize) -> Vec3 {
    let heap = RANDOM.bits(index as u64) % 32;
    let middle =
        Vec3::from_array([0, 1, 2].map(|k| 0.15 + 0.7 * RANDOM.unit(1_000_003 * (heap + 1) + k)));
    // The sum of three even numbers is close to a bell.
    let near = (unit(3 * index + 1) + unit(3 * index + 2) + unit(3 * index + 3) - 1.5) * 0.06;
    (middle + near).clamp(Vec3::ZERO, Vec3::ONE)
}

/// A point, further away from the eye by some sides of the cube.
fn away(point: Vec3, by: f64) -> Vec3 {
    (point.as_dvec3() + by * (DIRECTION / DIRECTION.length())).as_vec3()
}

/// A point, to the right in the picture by four sides of the cube.
fn beside(point: Vec3) -> Vec3 {
    point + 4.0 * DIRECTION.cross(DVec3::Z).normalize().as_vec3()
}

/// Touching spheres on a lattice, in a cube that holds their centres.
fn lattice(count: usize) -> Cube {
    let lattice = Lattice::new(count as u32);
    let centers = fill(count, |index| lattice.sphere(index as u32).0.into());
    let side = centers.iter().copied().fold(1.0, f32::max);
    Cube {
        centers,
        radii: Radii::Same(lattice.radius().into()),
        corner: DVec3::ZERO,
        side: side.into(),
    }
}

/// The centres of `count` spheres.
fn fill(count: usize, place: impl Fn(usize) -> Vec3 + Sync) -> Vec<f32> {
    const CHUNK: usize = 1 << 14;
    let mut centers = vec![0.0; 3 * count];
    centers.par_chunks_mut(3 * CHUNK).enumerate().for_each(|(chunk, centers)| {
        for (k, center) in centers.chunks_exact_mut(3).enumerate() {
            center.copy_from_slice(&place(chunk * CHUNK + k).to_array());
        }
    });
    centers
}

/// By bisection: the platforms' own differ in the last place.
fn cube_root(value: f64) -> f64 {
    let (mut low, mut high) = (0.0, value.max(1.0));
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if middle * middle * middle <= value { low = middle } else { high = middle }
    }
    low
}

/// Shows a cube whole, its middle in the middle.
fn camera(corner: DVec3, side: f64, projection: Projection) -> Camera {
    let middle = corner + 0.5 * DVec3::splat(side);
    let unit = DIRECTION / DIRECTION.length();
    let (distance, width) = match projection {
        Projection::Orthographic => (DISTANCE * side, WIDTH * side),
        // Near enough for rays that differ, at the width of the middle.
        Projection::Perspective => (2.5 * side, WIDTH / 2.5 * 1.25),
    };
    let mut camera = Camera::orthographic(middle - distance * unit, DIRECTION);
    camera.projection = projection;
    camera.size = ScreenSize::Width(width);
    camera
}

/// A camera a little aside of another, by `step` times 1.37 pixels in the middle of the picture: as
/// in a slow turn of the mouse.
pub fn moved(camera: &Camera, image: ImageSize, step: usize) -> Camera {
    let view = View::new(*camera, image);
    let right = camera.view.cross(camera.up).normalize();
    let pixels = 1.37 * step as f64;
    let mut moved = *camera;
    match camera.projection {
        Projection::Orthographic => moved.origin += pixels * view.pitch_x.to_f64() * right,
        Projection::Perspective => {
            moved.view =
                camera.view + pixels * view.pitch_x.to_f64() * camera.view.length() * right;
        }
    }
    moved
}

impl Made {
    /// Writes `centers.npy`, `radii.npy` where radii differ, and `scene.toml` into a folder, and
    /// gives the bytes that a render maps.
    ///
    /// # Errors
    /// The system's.
    pub fn write(&self, folder: &Path, image: ImageSize) -> io::Result<(PathBuf, u64)> {
        let mut text = String::new();
        let Camera { projection, origin, view, up, size, near, far } = self.camera;
        let projection = match projection {
            Projection::Orthographic => "orthographic",
            Projection::Perspective => "perspective",
        };
        let vector = |v: DVec3| format!("[{:?}, {:?}, {:?}]", v.x, v.y, v.z);
        text += &format!("[camera]\nprojection = \"{projection}\"\norigin = {}\n", vector(origin));
        text += &format!("view = {}\nup = {}\n", vector(view), vector(up));
        text += &match size {
            ScreenSize::Width(width) => format!("width = {width:?}\n"),
            ScreenSize::Height(height) => format!("height = {height:?}\n"),
            ScreenSize::Both { width, height } => {
                format!("width = {width:?}\nheight = {height:?}\n")
            }
        };
        text += &format!("near = {near:?}\n");
        if far.is_finite() {
            text += &format!("far = {far:?}\n");
        }
        text += &format!("\n[image]\nwidth = {}\nheight = {}\n", image.width, image.height);
        let mut mapped = 0;
        for (number, (_, block)) in self.scene.blocks().enumerate() {
            if block.is_empty() {
                continue;
            }
            let name = |what: &str| {
                if number == 0 { format!("{what}.npy") } else { format!("{what}-{number}.npy") }
            };
            let n = block.len();
            mapped += reals(&folder.join(name("centers")), &block.centers, &[n, 3])?;
            text += &format!("\n[[spheres]]\ncenters = \"{}\"\n", name("centers"));
            match &block.radii {
                Radii::Same(radius) => text += &format!("radius = {radius:?}\n"),
                Radii::Each(radii) => {
                    mapped += reals(&folder.join(name("radii")), radii, &[n])?;
                    text += &format!("radii = \"{}\"\n", name("radii"));
                }
            }
        }
        let path = folder.join("scene.toml");
        std::fs::write(&path, text)?;
        Ok((path, mapped))
    }
}

fn reals(path: &Path, numbers: &Reals, shape: &[usize]) -> io::Result<u64> {
    let mut file = BufWriter::with_capacity(1 << 20, File::create(path)?);
    let bytes = match numbers {
        Reals::F32(values) => {
            file.write_all(&npy_header("<f4", shape))?;
            values.as_slice().chunks(1 << 16).try_for_each(|part| {
                file.write_all(&part.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>())
            })?;
            4 * values.as_slice().len()
        }
        Reals::F64(values) => {
            file.write_all(&npy_header("<f8", shape))?;
            values.as_slice().chunks(1 << 16).try_for_each(|part| {
                file.write_all(&part.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>())
            })?;
            8 * values.as_slice().len()
        }
    };
    file.flush()?;
    Ok(bytes as u64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use planisphere_core::camera::Region;
    use planisphere_io::load;
    use planisphere_renderer::{Device, Engine};

    const IMAGE: ImageSize = ImageSize { width: 96, height: 96 };

    fn seen(made: &Made) -> Vec<i32> {
        let view = View::new(made.camera, IMAGE);
        let mut device = Engine::open(&Device::Cpu).unwrap();
        device.draw(&made.scene, &view, Region::whole(IMAGE)).unwrap().ids
    }

    #[test]
    fn scenes_are_what_they_are_called() {
        for kind in Kind::ALL {
            for projection in [Projection::Orthographic, Projection::Perspective] {
                let recipe = Recipe { projection, ..Recipe::new(kind, 2000) };
                let made = recipe.make(IMAGE);
                made.camera.check().unwrap();
                assert_eq!(made.scene.len(), if kind == Kind::Empty { 0 } else { 2000 });
                if projection == Projection::Perspective
                    && matches!(kind, Kind::Hidden | Kind::MostlyHidden)
                {
                    // The camera is inside the large sphere: another scene.
                    continue;
                }
                let ids = seen(&made);
                let share = ids.iter().filter(|&&id| id >= 0).count() as f64 / ids.len() as f64;
                let wanted = match kind {
                    Kind::Empty | Kind::OffScreen => 0.0..=0.0,
                    Kind::Hidden | Kind::MostlyHidden => 1.0..=1.0,
                    Kind::HotPixel | Kind::MostlyOffScreen => 0.001..=0.2,
                    _ => 0.04..=0.9,
                };
                assert!(wanted.contains(&share), "{}: {share} of the picture", made.name);
                match kind {
                    Kind::Hidden => assert!(ids.iter().all(|&id| id == 1999)),
                    Kind::MostlyHidden => {
                        assert!(ids.iter().all(|&id| id == 1999 || id % 100 == 0))
                    }
                    Kind::Twice => assert!(ids.iter().all(|&id| id < 1000)),
                    _ => {}
                }
            }
        }
    }

    #[test]
    fn layers_are_as_many_as_asked_for() {
        let made = Recipe::layers(2.0, 3.0, IMAGE).make(IMAGE);
        let area = made.scene.len() as f64 * std::f64::consts::PI * 4.0;
        let covered = seen(&made).iter().filter(|&&id| id >= 0).count() as f64;
        // Of a shadow under three layers at random, 95 % is covered; the cube's is not covered
        // evenly.
        assert!((2.5..5.0).contains(&(area / covered)), "{}", area / covered);
    }

    #[test]
    fn files_say_the_same() {
        for kind in [Kind::Uniform, Kind::Molecule, Kind::Empty] {
            let made = Recipe::new(kind, 500).in_perspective().make(IMAGE);
            let folder = tempfile::tempdir().unwrap();
            let (path, mapped) = made.write(folder.path(), IMAGE).unwrap();
            let loaded = load::load(&path).unwrap();
            assert_eq!((loaded.fixed_camera, loaded.image), (Some(made.camera), IMAGE));
            assert_eq!(loaded.scene.len(), made.scene.len());
            assert!((0..made.scene.len()).all(|k| {
                let (a, b) = (loaded.scene.known(k), made.scene.known(k));
                (a.center, a.radius) == (b.center, b.radius)
            }));
            let each = if kind == Kind::Uniform { 12 } else { 16 };
            assert_eq!(mapped, each * made.scene.len() as u64);
        }
    }

    #[test]
    fn the_camera_moves_a_little() {
        for recipe in
            [Recipe::new(Kind::Uniform, 10), Recipe::new(Kind::Uniform, 10).in_perspective()]
        {
            let camera = recipe.make(IMAGE).camera;
            assert_eq!(moved(&camera, IMAGE, 0), camera);
            let next = moved(&camera, IMAGE, 1);
            next.check().unwrap();
            assert_ne!(next, camera);
        }
    }
}
