//! N drives on their buses, as the executor sees them: one call per tick, none of which waits.

use core::fmt;

use stillpoint_shared::drive_config::{Cycle, MAX_BUSES};
use stillpoint_shared::{AxisDrive, DriveConfig, DriveConfigError};

use super::axis::Axis;
use super::bus::{Buses, Received};
use super::frame;
use super::report::{AxisReport, Traffic};
use super::send::{self, Line, Round};
use crate::{DriveGroup, Feedback, Setpoint};

/// Most frames fetched from a bus in a tick. At 1 Mbit/s and 4 kHz two or three can have come.
pub const MOST_RECEIVED: usize = 8;

/// Bus cycles for which a controller may take no frame before the bus counts as broken.
const STUCK_CYCLES: u16 = 2;

/// N drives on the buses B. See the [parent module](super) for what is sent when.
#[derive(Debug)]
pub struct Cia402Group<const N: usize, B> {
    buses: B,
    axes: [Axis; N],
    /// Axes in the order of falling node ids: the order in which a bus takes their frames.
    by_urgency: [usize; N],
    lines: [Line; MAX_BUSES],
    cycle: Cycle,
    controller_node: u8,
    heartbeat_ticks: u32,
    since_heartbeat_ticks: u32,
    tick: u32,
    /// Tick of the bus cycle: 0 at SYNC.
    phase: u16,
    /// Ticks since the phase was 0.
    since_sync_ticks: u16,
    energised: bool,
}

impl<const N: usize, B: Buses> Cia402Group<N, B> {
    /// The drives of a configuration on buses that are running; `tick_ticks` is the executor's tick
    /// in time ticks of 0.1 µs.
    ///
    /// Nothing is sent before the first call. Setting up takes about 30 bus cycles per drive and
    /// begins by itself, again and again until the drive answers.
    pub fn new(config: &DriveConfig, buses: B, tick_ticks: u32) -> Result<Self, GroupError> {
        let drives = <&[AxisDrive; N]>::try_from(config.axes()).map_err(|_| GroupError::Axes {
            config: config.axes().len(),
            group: N,
        })?;
        if config.buses() > B::COUNT {
            return Err(GroupError::Buses {
                config: config.buses(),
                group: B::COUNT,
            });
        }
        let cycle = Cycle::new(config, tick_ticks).map_err(GroupError::Config)?;
        let bus = *config.bus();
        Ok(Self {
            buses,
            axes: drives.map(|drive| Axis::new(drive, bus, &cycle, tick_ticks)),
            by_urgency: send::by_urgency(drives.map(|drive| drive.node)),
            lines: [Line::default(); MAX_BUSES],
            cycle,
            controller_node: bus.controller_node,
            heartbeat_ticks: u32::from(bus.heartbeat_ms) * 10_000 / tick_ticks.max(1),
            since_heartbeat_ticks: 0,
            tick: 0,
            phase: 0,
            since_sync_ticks: 0,
            energised: false,
        })
    }

    /// Resets the faults of the drives and ends what else keeps them from being used: drives with
    /// such a trouble are set up anew. Only for drives that are off; has no effect on others.
    pub fn request_fault_reset(&mut self) {
        if !self.energised {
            for axis in &mut self.axes {
                axis.request_reset();
            }
        }
    }

    /// What is known about an axis.
    pub fn report(&self, axis: usize) -> Option<AxisReport> {
        self.axes.get(axis).map(Axis::report)
    }

    /// What has gone over a bus.
    pub fn traffic(&self, bus: usize) -> Option<Traffic> {
        let line = self.lines.get(bus).filter(|_| bus < B::COUNT);
        line.map(|line| line.traffic)
    }

    /// The bus cycle in ticks.
    pub fn cycle(&self) -> Cycle {
        self.cycle
    }

    /// Gives the buses back. Call it only after [`DriveGroup::safe`].
    pub fn into_buses(self) -> B {
        self.buses
    }

    /// One tick; the set-points are none while the drives are to be off.
    fn turn(&mut self, wanted: Option<&[Setpoint; N]>) -> Result<[Feedback; N], BusStuck> {
        self.energised = wanted.is_some();
        self.tick = self.tick.wrapping_add(1);
        self.phase = if self.phase + 1 < self.cycle.ticks {
            self.phase + 1
        } else {
            0
        };
        for line in &mut self.lines {
            if let Some((_, ago_ticks)) = &mut line.last_sync {
                *ago_ticks = ago_ticks.saturating_add(1);
            }
        }
        for axis in &mut self.axes {
            axis.tick();
        }
        for bus in 0..B::COUNT {
            self.receive(bus);
        }

        self.since_heartbeat_ticks = self.since_heartbeat_ticks.saturating_add(1);
        if self.since_heartbeat_ticks >= self.heartbeat_ticks && self.controller_node != 0 {
            self.since_heartbeat_ticks = 0;
            for line in &mut self.lines {
                line.heartbeat_waits = true;
            }
        }
        if self.phase == self.cycle.ticks - self.cycle.lead_ticks {
            self.latch(wanted);
        }
        self.since_sync_ticks = self.since_sync_ticks.saturating_add(1);
        if self.phase == 0 {
            self.since_sync_ticks = 0;
            for line in &mut self.lines {
                line.sync_waits = true;
            }
        }
        for bus in 0..B::COUNT {
            self.transmit(bus);
        }
        self.stuck()?;
        Ok(self.axes.each_ref().map(Axis::feedback))
    }

    /// Puts the messages of this bus cycle into the outboxes.
    fn latch(&mut self, wanted: Option<&[Setpoint; N]>) {
        match wanted {
            Some(setpoints) => {
                for (axis, setpoint) in self.axes.iter_mut().zip(setpoints) {
                    axis.outbox.setpoint = axis.message(Some(setpoint));
                }
            }
            None => {
                for axis in &mut self.axes {
                    axis.outbox.setpoint = axis.message(None);
                }
            }
        }
    }

    fn transmit(&mut self, bus: usize) {
        let Some(line) = self.lines.get_mut(bus) else {
            return;
        };
        let round = Round {
            buses: &mut self.buses,
            bus,
            line,
            axes: &mut self.axes,
            by_urgency: &self.by_urgency,
            controller_node: self.controller_node,
            tick: self.tick,
        };
        // The tick after SYNC is never that of the set-points.
        round.run(self.phase == 1);
    }

    fn stuck(&self) -> Result<(), BusStuck> {
        let most_ticks = self.cycle.ticks.saturating_mul(STUCK_CYCLES);
        for (bus, line) in (0u8..).zip(&self.lines) {
            let ticks = line.traffic.blocked_ticks;
            if ticks > most_ticks {
                return Err(BusStuck { bus, ticks });
            }
        }
        Ok(())
    }

    fn receive(&mut self, bus: usize) {
        let Some(line) = self.lines.get_mut(bus) else {
            return;
        };
        for _ in 0..MOST_RECEIVED {
            match self.buses.receive(bus) {
                Received::Frame(frame) => {
                    let service = frame.service();
                    let addressed = self.axes.iter_mut().find_map(|axis| {
                        let (service, node) = service?;
                        let hit = (usize::from(axis.drive.bus), axis.drive.node) == (bus, node);
                        hit.then_some((axis, service))
                    });
                    if let Some((axis, service)) = addressed {
                        axis.receive(service, frame.data(), line.last_sync);
                        line.traffic.received = line.traffic.received.wrapping_add(1);
                    } else {
                        line.traffic.foreign = line.traffic.foreign.wrapping_add(1);
                    }
                }
                Received::Foreign => line.traffic.foreign = line.traffic.foreign.wrapping_add(1),
                Received::Overrun => line.traffic.overruns = line.traffic.overruns.wrapping_add(1),
                Received::Failed => line.traffic.errors = line.traffic.errors.wrapping_add(1),
                Received::Nothing => return,
            }
        }
    }
}

impl<const N: usize, B: Buses> DriveGroup<N> for Cia402Group<N, B> {
    type Error = BusStuck;

    fn exchange(&mut self, setpoints: &[Setpoint; N]) -> Result<[Feedback; N], BusStuck> {
        self.turn(Some(setpoints))
    }

    fn observe(&mut self) -> Result<[Feedback; N], BusStuck> {
        self.turn(None)
    }

    /// On the first call set-points that wait in a mailbox are taken back, the next frame of every
    /// axis asks for no voltage, and SYNC is moved to the
    /// earliest tick by which these frames have certainly come: L ticks from now, and R or L more
    /// while feedback or set-points that were sent already are still on their way. It is left where
    /// it is if it would not come for two cycles then, as when drives are switched on and off in
    /// turns.
    fn safe(&mut self) {
        if !self.energised {
            return;
        }
        self.energised = false;
        self.latch(None);
        // A set-point that still waits for the wire would hold up the frame that takes its place.
        for axis in &self.axes {
            let id = frame::RPDO1 + u16::from(axis.drive.node);
            self.buses.take_back(usize::from(axis.drive.bus), id);
        }
        let Cycle {
            ticks,
            lead_ticks,
            reply_ticks,
        } = self.cycle;
        let busy_ticks = if self.phase < reply_ticks {
            reply_ticks
        } else if self.phase + lead_ticks >= ticks {
            lead_ticks
        } else {
            0
        };
        let to_sync_ticks = lead_ticks + busy_ticks;
        if self.since_sync_ticks.saturating_add(to_sync_ticks) <= ticks.saturating_mul(2) {
            self.phase = ticks.saturating_sub(to_sync_ticks);
        }
        for bus in 0..B::COUNT {
            self.transmit(bus);
        }
    }

    fn reset_faults(&mut self) {
        self.request_fault_reset();
    }
}

/// A controller has taken no frame for too long.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct BusStuck {
    /// Bus, from 0.
    pub bus: u8,
    /// For so many ticks.
    pub ticks: u16,
}

impl fmt::Display for BusStuck {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { bus, ticks } = self;
        write!(
            f,
            "nothing can be sent on CAN bus {bus} for {ticks} ticks: check cabling, termination, bit rate \
             and the drives' supply"
        )
    }
}

impl core::error::Error for BusStuck {}

/// Why a group cannot be made.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum GroupError {
    /// The configuration is of another number of axes.
    Axes {
        /// Axes of the configuration.
        config: usize,
        /// Axes of the group.
        group: usize,
    },
    /// The configuration needs more buses.
    Buses {
        /// Buses of the configuration.
        config: usize,
        /// Buses of the group.
        group: usize,
    },
    /// The bus cycle does not go with the tick.
    Config(DriveConfigError),
}

impl fmt::Display for GroupError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Axes { config, group } => write!(
                f,
                "the drive configuration is of {config} axes, the board of {group}: give one drive per axis"
            ),
            Self::Buses { config, group } => write!(
                f,
                "the drive configuration uses {config} buses, the board has {group}: put the drives on fewer"
            ),
            Self::Config(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for GroupError {}
