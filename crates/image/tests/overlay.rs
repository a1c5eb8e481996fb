//! Overlays as they are drawn.
