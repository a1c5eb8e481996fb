//! What a window shows: a frame, in the middle of the background while it has another size.

use std::sync::Arc;

use super::draw::Frame;
use planisphere_core::camera::ImageSize;

/// A picture for a window of some size.
pub(super) struct Picture {
    /// The last frame that was drawn.
    pub frame: Option<Arc<Frame>>,
    /// The size of the window.
    pub size: ImageSize,
    /// The colour around the frame: 0x00rrggbb.
    pub background: u32,
}

impl Picture {
    /// Width of the window.
    pub fn columns(&self) -> usize {
        self.size.width as usize
    }

    /// Height of the window.
    pub fn rows(&self) -> usize {
        self.size.height as usize
    }

    /// A row of the window, from the top, as 0x00rrggbb; `room` is where it is put together if need
    /// be.
    pub fn row<'p>(&'p self, y: usize, room: &'p mut Vec<u32>) -> &'p [u32] {
        let columns = self.columns();
        let frame = self.frame.as_deref();
        if let Some(frame) = frame.filter(|frame| frame.view.image == self.size) {
            return &frame.pixels[y * columns..][..columns];
        }
        room.clear();
        room.resize(columns, self.background);
        if let Some(frame) = frame {
            let there = frame.view.image;
            let (from_y, to_y, rows) = overlap(there.height, self.size.height);
            if (to_y..to_y + rows).contains(&y) {
                let (from_x, to_x, wide) = overlap(there.width, self.size.width);
                let from = (from_y + y - to_y) * there.width as usize + from_x;
                room[to_x..to_x + wide].copy_from_slice(&frame.pixels[from..from + wide]);
            }
        }
        room
    }
}

/// How many columns (or rows) of a picture go into a window when their middles fall together: the
/// first column there, the first here, and the number.
fn overlap(there: u32, here: u32) -> (usize, usize, usize) {
    let (there, here) = (there as usize, here as usize);
    (there.saturating_sub(here) / 2, here.saturating_sub(there) / 2, there.min(here))
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use planisphere_core::camera::{Camera, View};

    fn rows(frame: Option<[u32; 2]>, window: [u32; 2]) -> Vec<Vec<u32>> {
        let frame = frame.map(|[width, height]| {
            let view =
                View::new(Camera::orthographic(DVec3::ZERO, DVec3::X), ImageSize { width, height });
            let pixels = (0..width * height).collect();
            Arc::new(Frame { view, ids: Vec::new(), pixels, milliseconds: 0.0 })
        });
        let [width, height] = window;
        let picture = Picture { frame, size: ImageSize { width, height }, background: 99 };
        (0..picture.rows()).map(|y| picture.row(y, &mut vec![7; 9]).to_vec()).collect()
    }

    #[test]
    fn frames_lie_in_the_middle() {
        assert_eq!(rows(Some([2, 2]), [2, 2]), [[0, 1], [2, 3]]);
        assert_eq!(
            rows(Some([2, 1]), [4, 3]),
            [[99, 99, 99, 99], [99, 0, 1, 99], [99, 99, 99, 99]]
        );
        assert_eq!(rows(Some([4, 3]), [2, 1]), [[5, 6]]);
        assert_eq!(rows(Some([1, 4]), [3, 2]), [[99, 1, 99], [99, 2, 99]]);
        assert_eq!(rows(None, [2, 1]), [[99, 99]]);
    }
}
