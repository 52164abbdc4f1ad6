//! What the board tells the executor with every tick.

/// What the board measured since the previous tick; by default all is well.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct TickInputs {
    /// Whether the emergency stop is pressed, or its wire is broken.
    pub emergency_stop: bool,
    /// How long the previous tick took, from interrupt to return, in time ticks of 0.1 µs; 0 if it
    /// is not measured.
    pub busy_ticks: u32,
    /// Ticks left out since the previous one.
    pub missed_ticks: u16,
}
