//! Last line of defence in the drive loop: whatever is asked for, what leaves is within the axis'
//! limits.
//!
//! Pure functions of the previous command, the configuration and the wanted command. An accepted
//! trajectory passes unchanged; a change raises a flag, which is no fault. With p, v, τ wanted and
//! p⁻, τ⁻ sent one period h before:
//!
//! 1. a value that is not finite: p = p⁻, v = 0, τ = 0,
//! 2. |v| ≤ v_max and |p − p⁻| ≤ v_max h,
//! 3. |τ| ≤ τ_max(v), the torque–speed curve,
//! 4. |τ − τ⁻| ≤ u_max h, and 3 again: where the curve has fallen below τ⁻ faster than the rate allows, the curve wins.
//!
//! All limits carry the relative tolerance of acceptance, [`LIMIT_TOLERANCE`], and steps one
//! rounding error of f32.

use stillpoint_shared::status::LimitFlags;
use stillpoint_shared::{AxisLimits, LIMIT_TOLERANCE};

use crate::Setpoint;

/// Limits of one axis prepared for the tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LimiterConfig {
    limits: AxisLimits,
    speed_rad_per_s: f32,
    position_step_rad: f32,
    torque_step_nm: f32,
}

impl LimiterConfig {
    /// No limits are known: nothing may move. All bytes are zero.
    pub(crate) const NONE: Self = Self {
        limits: AxisLimits {
            torque_nm: 0.0,
            torque_rate_nm_per_s: 0.0,
            speed_rad_per_s: 0.0,
            knee_speed_rad_per_s: 0.0,
            slope_nm_s_per_rad: 0.0,
        },
        speed_rad_per_s: 0.0,
        position_step_rad: 0.0,
        torque_step_nm: 0.0,
    };

    /// For a tick of `period_s` seconds.
    pub fn new(limits: &AxisLimits, period_s: f32) -> Self {
        let speed_rad_per_s = limits.speed_rad_per_s * (1.0 + LIMIT_TOLERANCE);
        Self {
            limits: *limits,
            speed_rad_per_s,
            position_step_rad: speed_rad_per_s * period_s,
            torque_step_nm: limits.torque_rate_nm_per_s * (1.0 + LIMIT_TOLERANCE) * period_s,
        }
    }
}

/// Torque in N·m available at a speed in rad/s, with the tolerance of acceptance on both
/// coordinates of the curve.
#[inline]
pub fn available_torque_nm(limits: &AxisLimits, speed_rad_per_s: f32) -> f32 {
    limits.available_torque_nm(speed_rad_per_s * (1.0 - LIMIT_TOLERANCE)) * (1.0 + LIMIT_TOLERANCE)
}

/// Least and greatest torque in N·m that [`limit`] surely lets through at a speed in rad/s, one
/// period after `previous_nm` was sent: half of the tolerance is left for rounding.
pub fn torque_window(config: &LimiterConfig, previous_nm: f32, speed_rad_per_s: f32) -> (f32, f32) {
    const HALF: f32 = 0.5 * LIMIT_TOLERANCE;
    let available_nm = config.limits.available_torque_nm(speed_rad_per_s) * (1.0 + HALF);
    let step_nm = config.torque_step_nm * (1.0 - HALF);
    let (mut least, mut most) = (previous_nm - step_nm, previous_nm + step_nm);
    clamp(&mut least, 0.0, available_nm);
    clamp(&mut most, 0.0, available_nm);
    (least, most)
}

/// `wanted` brought within the limits, one period after `previous` was sent (which must be finite),
/// and the limits in force.
#[inline]
pub fn limit(
    config: &LimiterConfig,
    previous: &Setpoint,
    wanted: &Setpoint,
) -> (Setpoint, LimitFlags) {
    if is_within(config, previous, wanted) {
        (*wanted, LimitFlags::NONE)
    } else {
        brought_within(config, previous, wanted)
    }
}

/// Whether nothing has to be limited, which is nearly always so; not if a value is no number.
#[inline]
fn is_within(config: &LimiterConfig, previous: &Setpoint, wanted: &Setpoint) -> bool {
    let reaches = |value: f32, centre: f32, reach: f32| {
        let reach = reach + centre.abs() * f32::EPSILON;
        value >= centre - reach && value <= centre + reach
    };
    let speed_rad_per_s = wanted.velocity_rad_per_s.abs();
    let torque_nm = wanted.torque_nm.abs();
    speed_rad_per_s <= config.speed_rad_per_s
        && reaches(
            wanted.position_rad,
            previous.position_rad,
            config.position_step_rad,
        )
        && torque_nm <= available_torque_nm(&config.limits, speed_rad_per_s)
        && reaches(wanted.torque_nm, previous.torque_nm, config.torque_step_nm)
}

#[cold]
#[inline(never)]
fn brought_within(
    config: &LimiterConfig,
    previous: &Setpoint,
    wanted: &Setpoint,
) -> (Setpoint, LimitFlags) {
    let mut flags = LimitFlags::NONE;
    let mut setpoint = *wanted;
    let finite = wanted.position_rad.is_finite()
        && wanted.velocity_rad_per_s.is_finite()
        && wanted.torque_nm.is_finite();
    if !finite {
        flags |= LimitFlags::NOT_FINITE;
        setpoint = Setpoint {
            position_rad: previous.position_rad,
            ..Setpoint::default()
        };
    }

    let limited = clamp(
        &mut setpoint.velocity_rad_per_s,
        0.0,
        config.speed_rad_per_s,
    );
    flags.raise_if(limited, LimitFlags::SPEED);
    let limited = step(
        &mut setpoint.position_rad,
        previous.position_rad,
        config.position_step_rad,
    );
    flags.raise_if(limited, LimitFlags::SPEED);

    let available_nm = available_torque_nm(&config.limits, setpoint.velocity_rad_per_s);
    let beyond_peak = setpoint.torque_nm.abs() > config.limits.torque_nm * (1.0 + LIMIT_TOLERANCE);
    let limited = clamp(&mut setpoint.torque_nm, 0.0, available_nm);
    flags.raise_if(beyond_peak, LimitFlags::TORQUE);
    flags.raise_if(limited && !beyond_peak, LimitFlags::TORQUE_SPEED);

    let limited = step(
        &mut setpoint.torque_nm,
        previous.torque_nm,
        config.torque_step_nm,
    );
    flags.raise_if(limited, LimitFlags::TORQUE_RATE);
    let limited = clamp(&mut setpoint.torque_nm, 0.0, available_nm);
    flags.raise_if(limited, LimitFlags::TORQUE_SPEED);
    (setpoint, flags)
}

/// Limits `value` to `centre` ± (`reach` + one rounding error of the centre).
fn step(value: &mut f32, centre: f32, reach: f32) -> bool {
    clamp(value, centre, reach + centre.abs() * f32::EPSILON)
}

/// Limits `value` to `centre` ± `reach` and says whether it had to. Comparisons only: `f32::clamp`
/// may panic, and `f32::min` is a library call on a Cortex-M4F.
fn clamp(value: &mut f32, centre: f32, reach: f32) -> bool {
    let (least, most) = (centre - reach, centre + reach);
    if *value > most {
        *value = most;
        true
    } else if *value < least {
        *value = least;
        true
    } else {
        false
    }
}
