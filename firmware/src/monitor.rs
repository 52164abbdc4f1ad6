//! Looks at the feedback of every tick: is it alive, is it a number, is the axis where it was told
//! to be; and at the drive loop itself: is it in time.

use nalgebra::SVector;

use crate::{DriveStatus, FaultCause, Feedback, Setpoint};

pub use stillpoint_shared::config::MonitorConfig;

/// Peaks of AXES axes and of the loop since the move was started.
#[derive(Debug, Clone, PartialEq)]
pub struct Monitor<const AXES: usize> {
    peak_following_error_rad: [f32; AXES],
    peak_busy_ticks: u32,
}

impl<const AXES: usize> Default for Monitor<AXES> {
    fn default() -> Self {
        Self::NEW
    }
}

impl<const AXES: usize> Monitor<AXES> {
    /// Nothing has been seen yet. All bytes are zero.
    pub(crate) const NEW: Self = Self {
        peak_following_error_rad: [0.0; AXES],
        peak_busy_ticks: 0,
    };

    /// Largest |set-point − measured position| of each axis in rad.
    pub fn peak_following_error_rad(&self) -> SVector<f32, AXES> {
        SVector::from(self.peak_following_error_rad)
    }

    /// Longest tick, in time ticks of 0.1 µs.
    pub fn peak_busy_ticks(&self) -> u32 {
        self.peak_busy_ticks
    }

    /// Judges the drive loop itself, by what the previous tick took and the ticks left out since.
    pub fn check_loop(
        &mut self,
        config: &MonitorConfig,
        busy_ticks: u32,
        missed_ticks: u16,
    ) -> Result<(), FaultCause> {
        if busy_ticks > self.peak_busy_ticks {
            self.peak_busy_ticks = busy_ticks;
        }
        if missed_ticks > 0 {
            return Err(FaultCause::TicksMissed {
                missed: missed_ticks,
            });
        }
        if busy_ticks > config.busy_limit_ticks {
            return Err(FaultCause::LoopOverrun {
                duration_ticks: busy_ticks,
                limit_ticks: config.busy_limit_ticks,
            });
        }
        Ok(())
    }

    /// Judges one tick. Set-points and feedback belong to the same instant.
    ///
    /// The following error of an axis is judged while its drive is enabled; `enabled` says which
    /// have to be.
    pub fn check(
        &mut self,
        config: &MonitorConfig,
        setpoints: &[Setpoint; AXES],
        feedback: &[Feedback; AXES],
        enabled: &[bool; AXES],
    ) -> Result<(), FaultCause> {
        let axes = setpoints
            .iter()
            .zip(feedback)
            .zip(enabled)
            .zip(&mut self.peak_following_error_rad);
        for (axis, (((setpoint, feedback), &enabled), peak_rad)) in (0u8..).zip(axes) {
            alive(config, axis, feedback)?;
            match feedback.status {
                DriveStatus::Enabled => {}
                DriveStatus::Disabled if enabled => return Err(FaultCause::DriveDisabled { axis }),
                _ => continue,
            }
            let error_rad = setpoint.position_rad - feedback.position_rad;
            let limit_rad = config.following_at_rest_rad
                + config.following_lag_s * setpoint.velocity_rad_per_s.abs();
            if error_rad.abs() > *peak_rad {
                *peak_rad = error_rad.abs();
            }
            if error_rad.abs() > limit_rad {
                return Err(FaultCause::FollowingError {
                    axis,
                    error_rad,
                    limit_rad,
                });
            }
        }
        Ok(())
    }
}

/// Whether an axis' feedback can be believed, and its drive is in no fault.
#[inline]
pub fn alive(config: &MonitorConfig, axis: u8, feedback: &Feedback) -> Result<(), FaultCause> {
    if let DriveStatus::Fault { code } = feedback.status {
        return Err(FaultCause::DriveFault { axis, code });
    }
    fresh(config, axis, feedback)
}

/// Whether what an axis measured can be believed. The age comes first: what the numbers say that
/// came too long ago no longer counts.
#[inline]
pub(crate) fn fresh(
    config: &MonitorConfig,
    axis: u8,
    feedback: &Feedback,
) -> Result<(), FaultCause> {
    let limit_ticks = config.feedback_age_ticks;
    match *feedback {
        Feedback { age_ticks, .. } if age_ticks > limit_ticks => Err(FaultCause::FeedbackStale {
            axis,
            age_ticks,
            limit_ticks,
        }),
        Feedback {
            position_rad,
            velocity_rad_per_s,
            ..
        } if !(position_rad.is_finite() && velocity_rad_per_s.is_finite()) => {
            Err(FaultCause::FeedbackNotFinite { axis })
        }
        _ => Ok(()),
    }
}
