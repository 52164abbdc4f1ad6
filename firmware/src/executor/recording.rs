//! What goes into the fault record, and when: samples while the drives are on or a dry run plays.

use super::Executor;
use crate::path_time::FULL_SPEED;
use crate::record::{Moment, RawSample};
use crate::{FaultRecord, LimitFlags, State};

impl<const AXES: usize> Executor<AXES> {
    /// Keeps the last second before a fault in `record` from now on, under the id of this build.
    /// What it holds from before a reset stays until the drives are armed; call
    /// [`FaultRecord::recover`] before.
    pub fn record_into(&mut self, record: &'static mut FaultRecord<AXES>, build_id: u64) {
        self.record = Some(record);
        self.build_id = build_id;
    }

    /// The last fault with the drives on (or in a dry run), with the second before it; also from
    /// before a reset. `None` if no record is kept or there is no fault in it.
    pub fn fault_record(&self) -> Option<&FaultRecord<AXES>> {
        let record = self.record.as_deref()?;
        record.fault().is_some().then_some(record)
    }

    /// Begins with the drives on, goes on with the next trajectory.
    pub(super) fn begin_record(&mut self) {
        let trajectory_hash = self.trajectory().header().content_hash;
        if let Some(record) = self.record.as_deref_mut() {
            if self.recording {
                record.turn_to(trajectory_hash);
            } else {
                self.recording = true;
                self.record_in_ticks = 0;
                record.begin(self.build_id, trajectory_hash, self.config.period_ticks);
            }
        }
    }

    pub(super) fn end_record(&mut self) {
        self.recording = false;
        if let Some(record) = self.record.as_deref_mut() {
            record.end();
        }
    }

    /// Adds this tick if it is time, and in any case if it ended in a fault, which closes the
    /// record.
    #[inline]
    pub(super) fn record(&mut self) {
        if !self.recording {
            return;
        }
        let failed = self.state == State::Fault;
        if self.record_in_ticks > 0 && !failed {
            self.record_in_ticks -= 1;
            return;
        }
        self.record_in_ticks = self.record_every_ticks.saturating_sub(1);
        self.add_sample();
        if failed {
            self.close_record();
        }
    }

    /// After a command: ends the record at once if that was a fault, since whoever asks for it, or
    /// clears it, may do so before the next tick.
    #[inline(never)]
    pub(super) fn record_failure(&mut self) {
        if self.recording && self.state == State::Fault {
            self.add_sample();
            self.close_record();
        }
    }

    /// Closes the record, which is open, with the fault.
    #[inline(never)]
    fn close_record(&mut self) {
        if let (Some(record), Some(&fault)) = (self.record.as_deref_mut(), self.fault.get()) {
            record.close(fault);
        }
        self.recording = false;
    }

    #[inline(never)] // Once in the image.
    fn add_sample(&mut self) {
        let sample = self.record_sample();
        if let Some(record) = self.record.as_deref_mut() {
            record.push(&sample);
        }
    }

    fn record_sample(&self) -> RawSample<AXES> {
        let feedback = self.feedback.get();
        let oldest = feedback.map(|feedback| {
            let ages = feedback.iter().map(|feedback| feedback.age_ticks);
            ages.fold(0, |oldest, age| if age > oldest { age } else { oldest })
        });
        let moment = Moment {
            tick: self.tick as u32,
            path_ticks: self.sent_path_ticks,
            state: self.state,
            limited: self
                .limited
                .iter()
                .fold(LimitFlags::NONE, |all, &one| all | one),
            path_speed: (self.path_speed() >> (FULL_SPEED.ilog2() - 8)).min(255) as u8,
            age_ticks: oldest.map_or(255, |age| age.min(255) as u8),
        };
        let mut axes = [[f32::NAN; 3]; AXES];
        if let Some(feedback) = feedback {
            let measured = self.commanded.iter().zip(feedback);
            for (values, (commanded, feedback)) in axes.iter_mut().zip(measured) {
                *values = [
                    commanded.position_rad - feedback.position_rad,
                    feedback.velocity_rad_per_s,
                    commanded.torque_nm,
                ];
            }
        }
        RawSample::new(&moment, axes.into_iter())
    }
}
