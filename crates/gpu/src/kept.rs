//! Scenes on the device: the one that was drawn last, and others as long as they take little.
//!
//! All workspaces of a device share them. A drawing holds on to its scene, so that one that is
//! dropped here in the meantime stays until that drawing ends.

use std::{
    ops::Range,
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicU64, Ordering},
    },
};

use crate::plan::Fixed;
use planisphere_core::{ids::SortedIndex, order::Ordered, scene::Alive};

/// Device memory that all scenes together may take, bytes: with more, only the one that was drawn
/// last stays. That is 16 Mi spheres. A program that goes back and forth between a few scenes sends
/// each once; a device of 4 GiB has plenty left.
pub const KEPT: u64 = 256 << 20;

/// Scenes that stay, whatever they take. A program that makes a small scene for each picture never
/// draws the old ones again, and what they are by themselves (a buffer, an order) is not counted in
/// [`KEPT`].
pub const SCENES: usize = 32;

/// Spheres on the device: consecutive, as many as one binding holds.
#[derive(Debug)]
pub struct Chunk {
    /// Their places.
    pub range: Range<usize>,
    /// Their records.
    pub buffer: wgpu::Buffer,
}

/// How a scene is laid out on the device. Workspaces differ in it in tests only.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Layout {
    /// Spheres in one buffer.
    pub chunk: usize,
    /// From so many spheres on they are put in order.
    pub order: usize,
    /// From so many on it is found out what large ones hide.
    pub cover: usize,
}

/// A scene on the device.
pub struct Uploaded {
    /// [`planisphere_core::scene::Scene::identity`].
    pub identity: u64,
    /// Whether there is any use for it still.
    pub alive: Alive,
    /// How it lies there.
    pub layout: Layout,
    /// None where the device cannot hold the scene's numbers.
    pub fixed: Option<Fixed>,
    /// The spheres.
    pub chunks: Vec<Chunk>,
    /// Device memory that they take.
    pub bytes: u64,
    /// Neighbours in space lie together on the device, so that what a tile's list names shares
    /// cache lines. None for few spheres, which fit a cache anyway and lie there as in the scene.
    pub ordered: Option<Arc<Ordered>>,
    /// Places of the scene's large spheres, if any may hide much; none for those that are left out.
    pub large: Vec<Option<SortedIndex>>,
}

/// The scenes that stay on a device.
///
/// What is dropped is freed after the lock: no lock is held for longer than it takes to look
/// through the list.
pub struct Kept {
    /// The one that was drawn last comes first.
    scenes: Mutex<Vec<Arc<Uploaded>>>,
    /// See [`KEPT`].
    most: AtomicU64,
}

impl Kept {
    /// Nothing yet.
    pub fn new() -> Self {
        Self { scenes: Mutex::default(), most: AtomicU64::new(KEPT) }
    }

    fn scenes(&self) -> MutexGuard<'_, Vec<Arc<Uploaded>>> {
        self.scenes.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// How many scenes there are, and the device memory that they take.
    pub fn size(&self) -> (usize, u64) {
        let scenes = self.scenes();
        (scenes.len(), scenes.iter().map(|scene| scene.bytes).sum())
    }

    /// Other bytes in place of [`KEPT`].
    pub fn keep(&self, most: u64) {
        self.most.store(most, Ordering::Relaxed);
        let mut scenes = self.scenes();
        if let Some((first, others)) = scenes.split_first() {
            let rest = self.rest(others, first.bytes);
            let dropped = scenes.split_off(1 + rest);
            drop(scenes);
            drop(dropped);
        }
    }

    /// A scene that is there. It is the one that was drawn last from now on.
    pub fn find(&self, identity: u64, layout: Layout) -> Option<Arc<Uploaded>> {
        Self::find_in(&mut self.scenes(), identity, layout)
    }

    fn find_in(
        scenes: &mut [Arc<Uploaded>],
        identity: u64,
        layout: Layout,
    ) -> Option<Arc<Uploaded>> {
        let is = |scene: &Arc<Uploaded>| scene.identity == identity && scene.layout == layout;
        let at = scenes.iter().position(is)?;
        scenes[..=at].rotate_right(1);
        scenes.first().cloned()
    }

    /// Takes a scene in, as the one that was drawn last. One that another drawing took in meanwhile
    /// is used in its place.
    pub fn insert(&self, new: Uploaded) -> Arc<Uploaded> {
        let new = Arc::new(new);
        let mut scenes = self.scenes();
        if let Some(there) = Self::find_in(&mut scenes, new.identity, new.layout) {
            return there;
        }
        let unused = Self::unused_in(&mut scenes);
        let rest = self.rest(&scenes, new.bytes);
        let dropped = scenes.split_off(rest);
        scenes.insert(0, Arc::clone(&new));
        drop(scenes);
        drop((dropped, unused));
        new
    }

    /// Drops what would go if a scene of so many bytes were taken in: before memory is asked for.
    pub fn make_room(&self, bytes: u64) {
        let mut scenes = self.scenes();
        let unused = Self::unused_in(&mut scenes);
        let rest = self.rest(&scenes, bytes);
        let dropped = scenes.split_off(rest);
        drop(scenes);
        drop((dropped, unused));
    }

    /// Takes out the scenes that nobody can draw any more.
    fn unused_in(scenes: &mut Vec<Arc<Uploaded>>) -> Vec<Arc<Uploaded>> {
        scenes.extract_if(.., |scene| !scene.alive.is_alive()).collect()
    }

    /// How many of some scenes may stay beside one of so many bytes.
    fn rest(&self, scenes: &[Arc<Uploaded>], bytes: u64) -> usize {
        let most = self.most.load(Ordering::Relaxed);
        let mut all = bytes;
        let fits = |scene: &&Arc<Uploaded>| {
            all = all.saturating_add(scene.bytes);
            all <= most
        };
        scenes.iter().take(SCENES - 1).take_while(fits).count()
    }

    /// Drops all but one scene, for memory that could not be had. Returns whether that freed any.
    pub fn drop_others(&self, identity: u64) -> bool {
        let mut scenes = self.scenes();
        let (own, others): (Vec<_>, Vec<_>) =
            scenes.drain(..).partition(|scene| scene.identity == identity);
        *scenes = own;
        drop(scenes);
        others.iter().any(|scene| scene.bytes > 0)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::OnceLock;

    use super::*;
    use planisphere_core::scene::Scene;

    const LAYOUT: Layout = Layout { chunk: 1, order: 2, cover: 3 };

    fn scene(identity: u64, bytes: u64) -> Uploaded {
        static STAYS: OnceLock<Scene> = OnceLock::new();
        of(STAYS.get_or_init(none), identity, bytes)
    }

    /// A scene of no spheres.
    fn none() -> Scene {
        Scene::from_spheres(&[]).unwrap()
    }

    fn of(scene: &Scene, identity: u64, bytes: u64) -> Uploaded {
        let (chunks, large) = (Vec::new(), Vec::new());
        let (layout, alive) = (LAYOUT, scene.alive());
        Uploaded { identity, alive, layout, fixed: None, chunks, bytes, ordered: None, large }
    }

    fn identities(kept: &Kept) -> Vec<u64> {
        kept.scenes().iter().map(|scene| scene.identity).collect()
    }

    #[test]
    fn what_was_drawn_last_comes_first_and_the_oldest_go() {
        let kept = Kept::new();
        kept.keep(100);
        for (identity, bytes, want) in [
            (1, 40, &[1][..]),
            (2, 40, &[2, 1]),
            (3, 20, &[3, 2, 1]),
            // One byte too many.
            (4, 1, &[4, 3, 2]),
            // It stays by itself, however large.
            (5, 1000, &[5]),
            (6, 0, &[6]),
            (7, 100, &[7, 6]),
        ] {
            assert!(kept.find(identity, LAYOUT).is_none());
            assert_eq!(kept.insert(scene(identity, bytes)).identity, identity);
            assert_eq!(identities(&kept), want);
        }
        assert_eq!(kept.size(), (2, 100));
        assert!(kept.find(6, LAYOUT).is_some());
        assert_eq!(identities(&kept), [6, 7]);
        assert!(kept.find(6, Layout { chunk: 2, ..LAYOUT }).is_none(), "laid out otherwise");
        kept.keep(99);
        assert_eq!(identities(&kept), [6], "7 is too much now");
    }

    #[test]
    fn many_small_scenes_do_not_pile_up() {
        let kept = Kept::new();
        for identity in 0..100 {
            kept.insert(scene(identity, 16));
        }
        let want: Vec<u64> = (0..100).rev().take(SCENES).collect();
        assert_eq!(identities(&kept), want);
    }

    #[test]
    fn scenes_that_are_gone_go_when_another_comes() {
        let kept = Kept::new();
        let [one, two] = [none(), none()];
        kept.insert(of(&one, 1, 10));
        kept.insert(of(&two, 2, 10));
        let clone = two.clone();
        drop((one, two));
        kept.insert(scene(3, 10));
        assert_eq!(identities(&kept), [3, 2], "a clone is left of the second");
        drop(clone);
        kept.make_room(10);
        assert_eq!(identities(&kept), [3]);
    }

    #[test]
    fn room_is_made_before_a_scene_comes() {
        let kept = Kept::new();
        kept.keep(100);
        for identity in [1, 2, 3] {
            kept.insert(scene(identity, 30));
        }
        kept.make_room(40);
        assert_eq!(identities(&kept), [3, 2]);
        kept.make_room(101);
        assert!(identities(&kept).is_empty());
    }

    #[test]
    fn the_second_of_two_uploads_takes_what_is_there() {
        let kept = Kept::new();
        let first = kept.insert(scene(1, 10));
        kept.insert(scene(2, 10));
        let second = kept.insert(scene(1, 10));
        assert!(Arc::ptr_eq(&first, &second));
        assert_eq!(identities(&kept), [1, 2]);
    }

    #[test]
    fn others_are_dropped_for_memory() {
        let kept = Kept::new();
        for identity in [1, 2, 3] {
            kept.insert(scene(identity, 10));
        }
        assert!(kept.drop_others(2));
        assert_eq!(identities(&kept), [2]);
        assert!(!kept.drop_others(2), "there is nothing more to drop");
        assert!(kept.drop_others(9));
        assert!(identities(&kept).is_empty());
    }
}
