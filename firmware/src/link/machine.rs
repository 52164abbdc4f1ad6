//! What the link drives: the executor and the tap on its ticks, shared with the drive loop.

use heapless::Vec;
use stillpoint_shared::Limits;
use stillpoint_shared::assembly::Arrived;
use stillpoint_shared::config::Config;
use stillpoint_shared::protocol::{
    AxisStatus, Denial, FaultAxis, FaultHead, FaultSample, LinkCounters, MAX_FAULT_SAMPLES,
    Request, Response, Status,
};

use super::Tap;
use super::answers::gathered;
use crate::{ConfigError, DriveGroup, Executor, FaultRecord, Refusal, TickInputs, TickReport};

/// An executor with a tap for telemetry.
///
/// A static one that begins as [`Machine::unconfigured`] takes no flash and is never moved.
#[derive(Debug)]
pub struct Machine<const AXES: usize> {
    /// The executor.
    pub executor: Executor<AXES>,
    /// The tap on its ticks.
    pub tap: Tap,
}

/// A way to the machine that the drive loop uses, too.
///
/// On a board the drive loop interrupts the link, and what is done in `with` is what it has to wait
/// for; the link does as little there as it can. What takes longer than a fraction of a tick, or
/// writes flash, goes through `at_rest`: the commit of an upload, the store, and the configuration.
/// It is refused during a move.
pub trait Access<const AXES: usize> {
    /// Does something with the machine, undisturbed.
    fn with<R>(&mut self, act: impl FnOnce(&mut Machine<AXES>) -> R) -> R;

    /// Does something that takes many ticks, with the machine at rest. A board keeps its drive loop
    /// going meanwhile, with a [`StandIn`](crate::stand_in::StandIn).
    fn at_rest<R>(&mut self, act: impl FnOnce(&mut Machine<AXES>) -> R) -> R {
        self.with(act)
    }
}

impl<const AXES: usize> Access<AXES> for Machine<AXES> {
    fn with<R>(&mut self, act: impl FnOnce(&mut Self) -> R) -> R {
        act(self)
    }
}

impl<const AXES: usize> Machine<AXES> {
    /// A machine that waits for its configuration. All its bytes are zero.
    pub const fn unconfigured() -> Self {
        Self {
            executor: Executor::unconfigured(),
            tap: Tap::off(),
        }
    }

    /// A machine with these limits, which must be of AXES axes.
    pub fn new(limits: Limits, config: Config) -> Result<Self, ConfigError> {
        Ok(Self {
            executor: Executor::new(limits, config)?,
            tap: Tap::off(),
        })
    }

    /// One tick of the drive loop.
    #[inline]
    pub fn tick<D: DriveGroup<AXES> + ?Sized>(
        &mut self,
        drives: &mut D,
        inputs: &TickInputs,
    ) -> TickReport<'_, AXES> {
        let report = self.executor.tick(drives, inputs);
        self.tap.record(&report);
        report
    }

    /// The limits and the configuration, if there are any.
    pub(super) fn configuration(&self) -> Result<(Limits, Config), Refusal> {
        let limits = self.executor.limits().ok_or(Refusal::NotConfigured)?;
        Ok((limits.clone(), *self.executor.config()))
    }

    /// Whether these are a configuration.
    pub(super) fn may_configure(&self, limits: &Limits, config: &Config) -> Result<(), Refusal> {
        config.check()?;
        let axes = limits.axes().len();
        if axes != AXES {
            return Err(ConfigError::Axes {
                limits: axes as u8,
                executor: AXES as u8,
            }
            .into());
        }
        Ok(())
    }

    /// Obeys an order that neither takes long nor needs anything else.
    pub(super) fn command(&mut self, request: &Request<'_>) -> Result<(), Denial> {
        let executor = &mut self.executor;
        match *request {
            Request::UploadAbort => executor.abort_load(),
            Request::Arm => executor.arm()?,
            Request::Disarm => executor.disarm()?,
            Request::Start(ref start) => executor.start(start)?,
            Request::Hold => executor.hold()?,
            Request::Resume => executor.resume()?,
            Request::Override { percent } => executor.set_override(percent)?,
            Request::QuickStop => executor.quick_stop(),
            Request::Clear => executor.clear()?,
            Request::SetTelemetry(config) => self.tap.set(config),
            // The others, which do not come here.
            _ => return Err(Denial::NotUnderstood { bytes: 0 }),
        }
        Ok(())
    }

    /// Answers a request about the machine, or takes a block of an upload.
    pub(super) fn answer(
        &mut self,
        request: &Request<'_>,
        counters: LinkCounters,
    ) -> Result<Response, Denial> {
        Ok(match *request {
            Request::Status => Response::Status(self.status(counters)),
            Request::UploadBlock(block) => {
                self.executor
                    .load_block(block.tag, block.block, block.values)?;
                Response::Upload(self.arrived())
            }
            Request::UploadProgress => Response::Upload(self.arrived()),
            Request::GetLimits => Response::Limits(self.configuration()?.0),
            Request::GetConfig => Response::Config(self.configuration()?.1),
            Request::GetFault => Response::Fault(self.fault_head()),
            Request::GetFaultSamples { first } => self.fault_samples(first)?,
            // The others, which do not come here.
            _ => return Err(Denial::NotUnderstood { bytes: 0 }),
        })
    }

    /// Content hash of what is loaded.
    pub(super) fn loaded(&self) -> Option<u64> {
        let trajectory = self.executor.trajectory();
        (trajectory.intervals().len() > 0).then_some(trajectory.header().content_hash)
    }

    /// Hash of the limits; 0 without any.
    pub(super) fn limits_hash(&self) -> u64 {
        self.executor.limits().map_or(0, Limits::hash)
    }

    pub(super) fn status(&self, link: LinkCounters) -> Status {
        let executor = &self.executor;
        let feedback = executor.report().feedback;
        let oldest_ticks = executor.allowed().feedback_age_ticks;
        let peaks = executor.monitor().peak_following_error_rad();
        let mut axes = Vec::new();
        for (axis, (limited, peak)) in executor.limited().iter().zip(&peaks).enumerate() {
            let feedback = feedback.and_then(|feedback| feedback.get(axis));
            let fresh = feedback.filter(|feedback| feedback.age_ticks <= oldest_ticks);
            // There is room for all axes.
            let _ = axes.push(AxisStatus {
                drive: feedback.map(|feedback| feedback.status),
                measured_rad: fresh.map(|feedback| feedback.position_rad),
                following_peak_rad: *peak,
                limited: *limited,
            });
        }
        Status {
            state: executor.state(),
            held_by: executor.hold_reason(),
            fault: executor.fault(),
            tick: executor.ticks(),
            path_ticks: executor.path_ticks(),
            duration_ticks: executor.trajectory().duration_ticks(),
            loaded: self.loaded(),
            limits_hash: self.limits_hash(),
            override_percent: executor.override_percent(),
            dry_run: executor.is_dry_run(),
            axes,
            upload: executor.arrived(),
            link: LinkCounters {
                dropped: self.tap.dropped(),
                ..link
            },
        }
    }

    pub(super) fn arrived(&self) -> Arrived {
        self.executor.arrived()
    }

    fn fault_head(&self) -> Option<FaultHead> {
        let record = self.executor.fault_record()?;
        let head = record.head()?;
        Some(FaultHead {
            fault: head.fault?,
            build_id: head.build_id,
            trajectory_hash: head.trajectory_hash,
            period_ticks: head.period_ticks,
            samples: record.samples().count() as u16,
        })
    }

    /// Samples of the fault record from the `first` on.
    #[inline(never)] // They are large, and no other answer should have them on its stack.
    fn fault_samples(&self, first: u16) -> Result<Response, Denial> {
        let record = self.executor.fault_record();
        let kept = record.into_iter().flat_map(FaultRecord::samples);
        let mut samples = Vec::<FaultSample, MAX_FAULT_SAMPLES>::new();
        for sample in kept.skip(usize::from(first)).take(MAX_FAULT_SAMPLES) {
            let values = sample
                .following_error_rad
                .into_iter()
                .zip(sample.velocity_rad_per_s)
                .zip(sample.torque_nm);
            let axes =
                values.map(
                    |((following_error_rad, velocity_rad_per_s), torque_nm)| FaultAxis {
                        following_error_rad,
                        velocity_rad_per_s,
                        torque_nm,
                    },
                );
            // There is room: as many are taken.
            let _ = samples.push(FaultSample {
                tick: sample.tick,
                path_ticks: sample.path_ticks,
                state: sample.state,
                limited: sample.limited,
                path_speed: sample.path_speed,
                age_ticks: sample.age_ticks,
                axes: gathered(axes),
            });
        }
        if samples.is_empty() {
            let samples = self.fault_head().map_or(0, |head| head.samples);
            return Err(Denial::FaultSample { first, samples });
        }
        Ok(Response::FaultSamples(samples))
    }
}
