//! Why nothing is seen in a picture, and what would show something, in words.
//!
//! Only looked at once a picture has turned out empty. Where a sphere lies is told in f64, which is
//! enough for words; of the advice it is checked that a picture drawn by it has a sphere in it.

use glam::DVec3;
use rayon::prelude::*;

use crate::{
    axes::{Axes, Axis},
    camera::{Camera, ImageSize, MAX_SIDE, Projection, Region, ScreenSize, View},
    framing::Wanted,
    scene::Scene,
};

/// Where a sphere lies that is not seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Place {
    Behind,
    BeforeNear,
    BeyondFar,
    Left,
    Right,
    Above,
    Below,
    /// Past two sides, which it does not touch.
    Aside,
    OutsideRegion,
    /// Its near side is before near, its far side beyond far.
    Around,
    Between,
}

/// All places, in the order of [`Place`].
const PLACES: [Place; 11] = [
    Place::Behind,
    Place::BeforeNear,
    Place::BeyondFar,
    Place::Left,
    Place::Right,
    Place::Above,
    Place::Below,
    Place::Aside,
    Place::OutsideRegion,
    Place::Around,
    Place::Between,
];

/// A camera's numbers, nearest f64.
struct Look {
    camera: Camera,
    /// Right, up, forward.
    axes: [DVec3; 3],
    /// Size of a pixel.
    pitch: [f64; 2],
    /// Left, right, bottom and top of the picture on the screen, and of what is drawn of it.
    picture: [f64; 4],
    drawn: [f64; 4],
}

impl Look {
    fn new(view: &View, region: Region) -> Self {
        let axes = Axes::new(view.camera.view, view.camera.up);
        let axes = [axes.right, axes.up, axes.forward].map(Axis::nearest);
        let pitch = [view.pitch_x.to_f64(), view.pitch_y.to_f64()];
        let ImageSize { width, height } = view.image;
        let across = |column: u32| (f64::from(column) - 0.5 * f64::from(width)) * pitch[0];
        let up = |row: u32| (0.5 * f64::from(height) - f64::from(row)) * pitch[1];
        let Region { x, y, width: wide, height: high } = region;
        Self {
            camera: view.camera,
            axes,
            pitch,
            picture: [across(0), across(width), up(height), up(0)],
            drawn: [across(x), across(x + wide), up(y + high), up(y)],
        }
    }

    /// A point in view space.
    fn at(&self, center: DVec3) -> DVec3 {
        let offset = center - self.camera.origin;
        DVec3::new(offset.dot(self.axes[0]), offset.dot(self.axes[1]), offset.dot(self.axes[2]))
    }

    /// How far a ball is outside of each side of a rectangle, less its radius: left, right, below,
    /// above.
    fn past(&self, c: DVec3, r: f64, [left, right, bottom, top]: [f64; 4]) -> [f64; 4] {
        match self.camera.projection {
            Projection::Orthographic => {
                [left - c.x - r, c.x - right - r, bottom - c.y - r, c.y - top - r]
            }
            Projection::Perspective => {
                // Planes through the eye.
                let plane = |at: f64, side: f64| (at - side * c.z) / side.hypot(1.0);
                [
                    -plane(c.x, left) - r,
                    plane(c.x, right) - r,
                    -plane(c.y, bottom) - r,
                    plane(c.y, top) - r,
                ]
            }
        }
    }

    /// Where a sphere lies.
    fn place(&self, center: DVec3, r: f64) -> Place {
        let c = self.at(center);
        let &Camera { near, far, projection, .. } = &self.camera;
        if c.z + r < 0.0 {
            return Place::Behind;
        }
        if c.z + r < near {
            return Place::BeforeNear;
        }
        if c.z - r > far {
            return Place::BeyondFar;
        }
        let past = self.past(c, r, self.picture);
        let sides = [Place::Left, Place::Right, Place::Below, Place::Above];
        let most = (0..4).max_by(|&a, &b| past[a].total_cmp(&past[b])).unwrap_or(0);
        if past[most] > 0.0 {
            return sides[most];
        }
        let outside = |[left, right, bottom, top]: [f64; 4]| {
            let over = |at: f64, low: f64, high: f64| (low - at).max(at - high).max(0.0);
            match projection {
                Projection::Orthographic => {
                    over(c.x, left, right).hypot(over(c.y, bottom, top)) > r
                }
                Projection::Perspective => false,
            }
        };
        if outside(self.picture) {
            return Place::Aside;
        }
        if self.past(c, r, self.drawn).iter().any(|past| *past > 0.0) || outside(self.drawn) {
            return Place::OutsideRegion;
        }
        if c.z - r < near && c.z + r > far { Place::Around } else { Place::Between }
    }

    /// Whether some pixel's ray meets a sphere for certain: it is all between the planes, its
    /// middle is in the picture, and a disc around that is wider than the pixels are apart.
    fn certain(&self, center: DVec3, r: f64) -> bool {
        let c = self.at(center);
        let &Camera { near, far, projection, .. } = &self.camera;
        let scale = match projection {
            Projection::Orthographic => 1.0,
            Projection::Perspective => c.z,
        };
        let [left, right, bottom, top] = self.picture;
        // A hundredth is for the rounding here, which is far less.
        let margin = 0.01 * r;
        c.z - r - margin > near
            && c.z + r + margin < far
            && (left * scale..=right * scale).contains(&c.x)
            && (bottom * scale..=top * scale).contains(&c.y)
            && 0.51 * self.pitch[0].hypot(self.pitch[1]) * scale < r
    }
}

/// Whether a sphere is seen for certain.
fn shows(scene: &Scene, camera: Camera, image: ImageSize) -> bool {
    if camera.check().is_err() {
        return false;
    }
    let look = Look::new(&View::new(camera, image), Region::whole(image));
    scene.blocks().any(|(_, block)| {
        (0..block.len()).into_par_iter().any(|k| look.certain(block.center(k), block.radius(k)))
    })
}

/// Counts the spheres at each of [`PLACES`].
fn count(scene: &Scene, view: &View, region: Region) -> [usize; PLACES.len()] {
    let look = Look::new(view, region);
    let add = |mut a: [usize; PLACES.len()], b: [usize; PLACES.len()]| {
        a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
        a
    };
    let zero = || [0; PLACES.len()];
    let of_block = |block: &crate::scene::Block| {
        let one = |mut counts: [usize; PLACES.len()], k: usize| {
            counts[look.place(block.center(k), block.radius(k)) as usize] += 1;
            counts
        };
        (0..block.len()).into_par_iter().fold(zero, one).reduce(zero, add)
    };
    scene.blocks().map(|(_, block)| of_block(block)).fold(zero(), add)
}

/// Why nothing is seen, in one line.
pub fn why(scene: &Scene, view: &View, region: Region) -> String {
    let spheres = scene.len();
    if spheres == 0 {
        return "the scene has no spheres".into();
    }
    let counts = count(scene, view, region);
    let Camera { near, far, .. } = view.camera;
    let Region { x, y, width, height } = region;
    let words = |place: Place| match place {
        Place::Behind => "behind the camera".to_owned(),
        Place::BeforeNear => format!("before near ({near:?})"),
        Place::BeyondFar => format!("beyond far ({far:?})"),
        Place::Left => "left of the picture".into(),
        Place::Right => "right of the picture".into(),
        Place::Above => "above the picture".into(),
        Place::Below => "below the picture".into(),
        Place::Aside => "outside of the picture, beyond a corner".into(),
        Place::OutsideRegion => format!("outside of the region {x},{y},{width},{height}"),
        Place::Around => format!("around all that is between near ({near:?}) and far ({far:?})"),
        Place::Between => "between the rays of the pixels".into(),
    };
    let found: Vec<(usize, String)> = PLACES
        .into_iter()
        .zip(counts)
        .filter(|(_, n)| *n > 0)
        .map(|(place, n)| (n, words(place)))
        .collect();
    match found.as_slice() {
        [(_, place)] if spheres == 1 => format!("the only sphere lies {place}"),
        [(_, place)] => format!("all {spheres} spheres lie {place}"),
        many => {
            let mut verb = true;
            let parts = many.iter().map(|(n, place)| {
                let word = if !std::mem::take(&mut verb) {
                    ""
                } else if *n == 1 {
                    "lies "
                } else {
                    "lie "
                };
                format!("{n} {word}{place}")
            });
            format!("of {spheres} spheres, {}", parts.collect::<Vec<_>>().join(", "))
        }
    }
}

/// What shows a sphere for certain, in one line, if anything does. `camera`: whether the scene file
/// has one.
pub fn advice(scene: &Scene, view: &View, region: Region, camera: bool) -> Option<String> {
    if scene.is_empty() {
        return Some(
            "add [[sphere]] tables, each with center and radius, or [[spheres]] with arrays".into(),
        );
    }
    let (image, present) = (view.image, view.camera);
    let them = if scene.len() == 1 { "it" } else { "them" };
    let part = region != Region::whole(image);
    if part && shows(scene, present, image) {
        return Some(format!("leave out --region to see {them}"));
    }
    let without_region = if part { " and --region" } else { "" };
    let larger = |camera: Camera| {
        let sizes = (1..=8).map(|k| [image.width, image.height].map(|side| u64::from(side) << k));
        let sizes = sizes
            .take_while(|sides| sides.iter().all(|side| *side <= u64::from(MAX_SIDE.min(8192))));
        sizes
            .map(|[width, height]| ImageSize { width: width as u32, height: height as u32 })
            .find(|size| shows(scene, camera, *size))
    };
    let framed = Wanted::default().camera(&scene.bounds(), image);
    if count(scene, view, region)[Place::Between as usize] > 0
        && let Some(ImageSize { width, height }) = larger(present)
    {
        let and = if part { ", without --region" } else { "" };
        return Some(format!("draw a larger picture: --size {width}x{height}{and}"));
    }
    if camera && shows(scene, framed, image) {
        return Some(format!("leave out [camera]{without_region} to frame {them}"));
    }
    if camera && let Some(ImageSize { width, height }) = larger(framed) {
        return Some(format!(
            "leave out [camera]{without_region} to frame {them}, and add --size {width}x{height}"
        ));
    }
    // One alone, the largest.
    let largest = (0..scene.len()).into_par_iter().max_by(|&a, &b| {
        let radius = |k| scene.known(k).radius;
        radius(a).total_cmp(&radius(b)).then(b.cmp(&a))
    })?;
    let sphere = scene.known(largest);
    let (center, width) = (sphere.center, 4.0 * sphere.radius);
    let wanted =
        Wanted { look_at: Some(center), size: Some(ScreenSize::Width(width)), ..Wanted::default() };
    shows(scene, wanted.camera(&scene.bounds(), image), image).then(|| {
        let [x, y, z] = center.to_array();
        let and = if part { ", without --region" } else { "" };
        format!(
            "sphere {largest}, the largest, is shown by a [camera] of look_at = [{x:?}, {y:?}, \
             {z:?}] and width = {width:?} alone{and}"
        )
    })
}
