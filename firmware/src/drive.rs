//! What the executor asks of the drives, whatever the bus: a group of N axes that is commanded and
//! read together.

pub use stillpoint_shared::status::DriveStatus;

/// Command to one axis for the coming tick, at the joint.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Setpoint {
    /// Position in rad.
    pub position_rad: f32,
    /// Velocity in rad/s, fed forward to the velocity loop.
    pub velocity_rad_per_s: f32,
    /// Torque in N·m, fed forward to the torque loop.
    pub torque_nm: f32,
}

/// What one axis reports.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Feedback {
    /// Measured position in rad.
    pub position_rad: f32,
    /// Measured velocity in rad/s.
    pub velocity_rad_per_s: f32,
    /// Drive ticks since the measurement; 0 is of this tick. A lost message makes it grow.
    pub age_ticks: u16,
    /// What the drive says about itself.
    pub status: DriveStatus,
}

/// The drives do not answer: there are none, or their bus fails.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NoAnswer;

/// N drives on one bus.
///
/// Once per tick the executor calls either `exchange`, followed by `safe` if it sees a fault, or
/// `safe` and then `observe`.
pub trait DriveGroup<const N: usize> {
    /// What can go wrong with the bus as a whole. A single late axis is no error but a growing
    /// [`Feedback::age_ticks`].
    type Error;

    /// Sends one set-point per axis and returns the newest feedback. Drives that are not enabled
    /// are brought towards it, over as many calls as they need; meanwhile the set-points are the
    /// measured positions, so that enabling is no jump.
    ///
    /// Set-points and feedback of age 0 belong to the same instant, the start of the tick: their
    /// difference is the following error.
    fn exchange(&mut self, setpoints: &[Setpoint; N]) -> Result<[Feedback; N], Self::Error>;

    /// Returns the newest feedback without commanding anything.
    fn observe(&mut self) -> Result<[Feedback; N], Self::Error>;

    /// Takes the torque away, by whatever means are left. Called every tick while the drives are to
    /// be off.
    fn safe(&mut self);

    /// Resets the faults that drives have latched; called once after each `clear`, between `safe`
    /// and `observe`. Drives that latch none have nothing to do.
    fn reset_faults(&mut self) {}
}
