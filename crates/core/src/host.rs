//! What the machine tells: this crate asks no system itself.

/// A clock and a look at the memory, handed in by whoever knows the system.
#[derive(Clone, Copy, Debug)]
pub struct Host {
    /// Milliseconds since some moment in the past.
    pub milliseconds: fn() -> f64,
    /// Whether so many bytes can be had.
    pub has_room: fn(u64) -> bool,
}

impl Host {
    /// Milliseconds since then.
    #[must_use]
    pub fn since(&self, then: f64) -> f64 {
        (self.milliseconds)() - then
    }

    /// Milliseconds since some moment in the past.
    #[must_use]
    pub fn now(&self) -> f64 {
        (self.milliseconds)()
    }
}

impl Default for Host {
    /// No clock, so that all times are 0, and memory without end.
    fn default() -> Self {
        Self { milliseconds: || 0.0, has_room: |_| true }
    }
}
