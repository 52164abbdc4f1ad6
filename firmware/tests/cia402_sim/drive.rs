//! A simulated CiA 402 drive on CANopen: network state, object dictionary, process data, heartbeat,
//! emergencies, and the state machine with a motor that follows exactly.
//!
//! Written from the profiles, not from the code under test. Times are in µs.

use std::collections::VecDeque;

use super::dictionary::Dictionary;
use super::wire::Raw;

/// State of the power drive system; the discriminants are the bits of the statusword.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Pds {
    NotReady = 0x00,
    SwitchOnDisabled = 0x40,
    ReadyToSwitchOn = 0x21,
    SwitchedOn = 0x23,
    OperationEnabled = 0x27,
    QuickStopActive = 0x07,
    FaultReaction = 0x0f,
    Fault = 0x08,
}

/// State of the node.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Nmt {
    Off,
    Booting,
    PreOperational = 0x7f,
    Operational = 0x05,
    Stopped = 0x04,
}

/// What can be different about a drive.
#[derive(Debug, Clone)]
pub(crate) struct Traits {
    pub(crate) boot_us: u64,
    pub(crate) self_test_us: u64,
    pub(crate) fault_reaction_us: u64,
    pub(crate) quick_stop_us: u64,
    /// Whether it stays in Quick stop active when it stands (605Ah 5 to 8).
    pub(crate) stays_in_quick_stop: bool,
    /// Whether it can go from Quick stop active back to Operation enabled.
    pub(crate) resumes: bool,
    /// Time from Operation enabled to following: the brake.
    pub(crate) brake_us: u64,
    /// Whether bit 12 tells that it follows.
    pub(crate) tells_following: bool,
    /// The mode it shows whatever it is told, if any.
    pub(crate) stubborn_mode: Option<i8>,
    /// Whether a fault's cause is still there, so that a reset does nothing.
    pub(crate) cause_persists: bool,
    /// Whether it comes up with this fault.
    pub(crate) fault_at_boot: Option<u16>,
    /// Largest step of the target from one SYNC to the next, in increments, before it faults with
    /// 8611h.
    pub(crate) largest_step: i64,
    pub(crate) sends_heartbeats: bool,
    pub(crate) sends_feedback: bool,
    pub(crate) answers_sdo: bool,
}

impl Default for Traits {
    fn default() -> Self {
        Self {
            boot_us: 20_000,
            self_test_us: 5_000,
            fault_reaction_us: 3_000,
            quick_stop_us: 4_000,
            stays_in_quick_stop: false,
            resumes: false,
            brake_us: 10_000,
            tells_following: true,
            stubborn_mode: None,
            cause_persists: false,
            fault_at_boot: None,
            largest_step: 2_000,
            sends_heartbeats: true,
            sends_feedback: true,
            answers_sdo: true,
        }
    }
}

#[derive(Debug)]
pub(crate) struct Drive {
    pub(crate) node: u8,
    pub(crate) traits: Traits,
    pub(crate) dictionary: Dictionary,
    pub(crate) nmt: Nmt,
    pub(crate) state: Pds,
    /// Numbers of the transitions gone through.
    pub(crate) transitions: Vec<u8>,
    /// Position in increments.
    pub(crate) position: f64,
    /// Targets it moved to, with the time of SYNC.
    pub(crate) executed: Vec<(u64, i32)>,
    /// Torque offset in force, in thousandths.
    pub(crate) torque_offset: i16,
    pub(crate) outgoing: VecDeque<Raw>,
    rated_torque_mnm: u32,
    since_us: u64,
    enabled_us: u64,
    controlword: u16,
    waiting_process_data: Option<Vec<u8>>,
    /// Start and end of the motion between two SYNCs, and the time of the first.
    motion: (f64, f64, u64),
    next_heartbeat_us: u64,
    guarded_until_us: Option<u64>,
    now_us: u64,
}

impl Drive {
    pub(crate) fn new(node: u8, rated_torque_mnm: u32, position: i32) -> Self {
        Self {
            node,
            traits: Traits::default(),
            dictionary: Dictionary::power_on(node, rated_torque_mnm),
            nmt: Nmt::Off,
            state: Pds::NotReady,
            transitions: Vec::new(),
            position: f64::from(position),
            executed: Vec::new(),
            torque_offset: 0,
            outgoing: VecDeque::new(),
            rated_torque_mnm,
            since_us: 0,
            enabled_us: 0,
            controlword: 0,
            waiting_process_data: None,
            motion: (f64::from(position), f64::from(position), 0),
            next_heartbeat_us: u64::MAX,
            guarded_until_us: None,
            now_us: 0,
        }
    }

    /// Supply on; the dictionary is as it left the factory, but for what the test took away.
    pub(crate) fn power_on(&mut self) {
        self.nmt = Nmt::Booting;
        self.since_us = self.now_us;
        self.transitions.push(0);
        self.state = Pds::NotReady;
        self.controlword = 0;
        self.next_heartbeat_us = u64::MAX;
        self.guarded_until_us = None;
        self.waiting_process_data = None;
    }

    pub(crate) fn power_off(&mut self) {
        let refused = self.dictionary.refused.clone();
        self.dictionary = Dictionary::power_on(self.node, self.rated_torque_mnm);
        self.dictionary.refused = refused;
        self.nmt = Nmt::Off;
        self.state = Pds::NotReady;
        self.outgoing.clear();
    }

    pub(crate) fn is_powered(&self) -> bool {
        self.nmt != Nmt::Off
    }

    pub(crate) fn counts(&self) -> i32 {
        self.position.round() as i32
    }

    /// Pushes the axis by hand; does nothing against a motor that holds.
    pub(crate) fn push(&mut self, counts: i32) {
        if self.state != Pds::OperationEnabled {
            self.position += f64::from(counts);
        }
    }

    /// A fault happens: transition 13, with an emergency message.
    pub(crate) fn fail(&mut self, code: u16) {
        if matches!(self.state, Pds::FaultReaction | Pds::Fault) || !self.is_powered() {
            return;
        }
        self.go(13, Pds::FaultReaction);
        self.dictionary.set(0x603f, 0, u32::from(code));
        self.dictionary.set(0x1001, 0, 1);
        self.emergency(code);
    }

    fn emergency(&mut self, code: u16) {
        let [low, high] = code.to_le_bytes();
        let register = u8::from(code != 0);
        self.send(0x080, &[low, high, register, 0, 0, 0, 0, 0]);
    }

    fn send(&mut self, service: u16, data: &[u8]) {
        if matches!(self.nmt, Nmt::Off | Nmt::Booting) {
            return;
        }
        self.outgoing
            .push_back(Raw::new(service + u16::from(self.node), data));
    }

    fn go(&mut self, transition: u8, state: Pds) {
        self.transitions.push(transition);
        self.state = state;
        self.since_us = self.now_us;
        if state == Pds::OperationEnabled {
            self.enabled_us = self.now_us;
            self.motion = (self.position, self.position, self.now_us);
        }
    }

    /// Whether it follows its set-points now.
    pub(crate) fn follows(&self) -> bool {
        self.state == Pds::OperationEnabled
            && self.dictionary.get(0x6061, 0) == 8
            && self.now_us >= self.enabled_us + self.traits.brake_us
    }

    /// Time of the next thing it does by itself.
    pub(crate) fn next_us(&self) -> u64 {
        let waited = match (self.nmt, self.state) {
            (Nmt::Off, _) => return u64::MAX,
            (Nmt::Booting, _) => self.since_us + self.traits.boot_us,
            (_, Pds::NotReady) => self.since_us + self.traits.self_test_us,
            (_, Pds::FaultReaction) => self.since_us + self.traits.fault_reaction_us,
            (_, Pds::QuickStopActive) if !self.traits.stays_in_quick_stop => {
                self.since_us + self.traits.quick_stop_us
            }
            _ => u64::MAX,
        };
        waited
            .min(self.next_heartbeat_us)
            .min(self.guarded_until_us.unwrap_or(u64::MAX))
            .max(self.now_us + 1)
    }

    /// Lets time pass up to `now_us`.
    pub(crate) fn advance(&mut self, now_us: u64) {
        self.now_us = now_us;
        if !self.is_powered() {
            return;
        }
        self.follow();
        let waited_us = now_us - self.since_us;
        match (self.nmt, self.state) {
            (Nmt::Booting, _) if waited_us >= self.traits.boot_us => {
                self.nmt = Nmt::PreOperational;
                self.since_us = now_us;
                self.send(0x700, &[0]);
                if let Some(code) = self.traits.fault_at_boot {
                    self.fail(code);
                }
            }
            (Nmt::Booting, _) => {}
            (_, Pds::NotReady) if waited_us >= self.traits.self_test_us => {
                self.go(1, Pds::SwitchOnDisabled);
            }
            (_, Pds::FaultReaction) if waited_us >= self.traits.fault_reaction_us => {
                self.go(14, Pds::Fault);
            }
            (_, Pds::QuickStopActive)
                if !self.traits.stays_in_quick_stop && waited_us >= self.traits.quick_stop_us =>
            {
                self.go(12, Pds::SwitchOnDisabled);
            }
            _ => {}
        }
        if now_us >= self.next_heartbeat_us {
            if self.traits.sends_heartbeats {
                self.send(0x700, &[self.nmt as u8]);
            }
            self.next_heartbeat_us = now_us + u64::from(self.dictionary.get(0x1017, 0)) * 1_000;
        }
        if self.guarded_until_us.is_some_and(|until| now_us >= until) {
            self.guarded_until_us = None;
            self.fail(0x8130);
        }
    }

    /// Moves towards the target in a straight line, to be there one period after SYNC.
    fn follow(&mut self) {
        if !self.follows() {
            self.motion = (self.position, self.position, self.now_us);
            return;
        }
        let exponent = self.dictionary.get(0x60c2, 2) as u8 as i8;
        let unit_us = 10f64.powi(i32::from(exponent) + 6);
        let period_us = f64::from(self.dictionary.get(0x60c2, 1)) * unit_us;
        let (start, end, since_us) = self.motion;
        let part = ((self.now_us - since_us) as f64 / period_us).min(1.0);
        self.position = start + (end - start) * part;
    }

    /// A frame on the bus.
    pub(crate) fn receive(&mut self, frame: &Raw) {
        if matches!(self.nmt, Nmt::Off | Nmt::Booting) {
            return;
        }
        let node = u16::from(self.node);
        let guard = self.dictionary.get(0x1016, 1);
        if frame.id == 0x000 {
            self.network(frame.data());
        } else if frame.id == 0x080 {
            self.sync();
        } else if frame.id == 0x600 + node && self.nmt != Nmt::Stopped && self.traits.answers_sdo {
            let (answer, written) = self.dictionary.serve(frame.data());
            self.send(0x580, &answer);
            if let Some((index, sub)) = written {
                self.written(index, sub);
            }
        } else if u32::from(frame.id) == self.dictionary.get(0x1400, 1)
            && self.nmt == Nmt::Operational
        {
            self.waiting_process_data = Some(frame.data().to_vec());
            if self.dictionary.get(0x1400, 2) >= 254 {
                self.take_process_data();
            }
        } else if guard != 0 && u32::from(frame.id) == 0x700 + (guard >> 16 & 0x7f) {
            self.guarded_until_us = Some(self.now_us + u64::from(guard & 0xffff) * 1_000);
        }
    }

    fn network(&mut self, data: &[u8]) {
        let &[command, node] = data else { return };
        if node != 0 && node != self.node {
            return;
        }
        let was = self.nmt;
        match command {
            0x01 => self.nmt = Nmt::Operational,
            0x02 => self.nmt = Nmt::Stopped,
            0x80 => self.nmt = Nmt::PreOperational,
            _ => {}
        }
        let left = was == Nmt::Operational && self.nmt != Nmt::Operational;
        if left && self.state == Pds::OperationEnabled {
            // Abort connection option code 1.
            self.fail(0x8130);
        }
    }

    fn written(&mut self, index: u16, sub: u8) {
        match (index, sub) {
            (0x6040, 0) => self.command(self.dictionary.get(0x6040, 0) as u16),
            (0x6060, 0) => {
                let mode = self.dictionary.get(0x6060, 0);
                let shown = self
                    .traits
                    .stubborn_mode
                    .map_or(mode, |mode| mode as u8 as u32);
                self.dictionary.set(0x6061, 0, shown);
            }
            (0x1017, 0) => {
                let period_us = u64::from(self.dictionary.get(0x1017, 0)) * 1_000;
                self.next_heartbeat_us = self.now_us + period_us;
            }
            _ => {}
        }
    }

    fn sync(&mut self) {
        self.follow();
        if self.nmt != Nmt::Operational {
            return;
        }
        self.take_process_data();
        self.update_objects();
        let identifier = self.dictionary.get(0x1800, 1);
        if identifier >> 31 == 0
            && self.dictionary.get(0x1800, 2) == 1
            && self.traits.sends_feedback
        {
            let mut data = Vec::new();
            for (index, sub, bytes) in self.dictionary.mapping(0x1a00) {
                data.extend(&self.dictionary.get(index, sub).to_le_bytes()[..bytes]);
            }
            self.outgoing
                .push_back(Raw::new((identifier & 0x7ff) as u16, &data));
        }
        // The second PDO, if it was left on, chatters.
        let second = self.dictionary.get(0x1801, 1);
        if second >> 31 == 0 && second != 0 {
            self.outgoing
                .push_back(Raw::new((second & 0x7ff) as u16, &[0; 8]));
        }
    }

    fn update_objects(&mut self) {
        let voltage = u32::from(self.state as u16 & 1) << 4;
        let following = self.traits.tells_following && self.follows();
        let statusword = self.state as u32 | voltage | 1 << 9 | u32::from(following) << 12;
        self.dictionary.set(0x6041, 0, statusword);
        self.dictionary.set(0x6064, 0, self.counts() as u32);
    }

    fn take_process_data(&mut self) {
        let Some(data) = self.waiting_process_data.take() else {
            return;
        };
        let mapping = self.dictionary.mapping(0x1600);
        let length: usize = mapping.iter().map(|(_, _, bytes)| bytes).sum();
        if data.len() < length {
            return self.emergency(0x8210);
        }
        let mut rest = data.as_slice();
        for (index, sub, bytes) in mapping {
            let (head, tail) = rest.split_at(bytes);
            let mut value = [0; 4];
            value[..bytes].copy_from_slice(head);
            self.dictionary.set(index, sub, u32::from_le_bytes(value));
            rest = tail;
        }
        self.command(self.dictionary.get(0x6040, 0) as u16);
        self.torque_offset = if self.state == Pds::OperationEnabled {
            self.dictionary.get(0x60b2, 0) as u16 as i16
        } else {
            0
        };
        if !self.follows() {
            return;
        }
        let target = self.dictionary.get(0x607a, 0) as i32;
        let step = i64::from(target) - self.position.round() as i64;
        if step.abs() > self.traits.largest_step {
            return self.fail(0x8611);
        }
        self.motion = (self.position, f64::from(target), self.now_us);
        self.executed.push((self.now_us, target));
    }

    /// The controlword: bits 0 switch on, 1 enable voltage, 2 quick stop (low), 3 enable operation,
    /// 7 fault reset (rising edge).
    pub(crate) fn command(&mut self, controlword: u16) {
        let rising = controlword & !self.controlword;
        self.controlword = controlword;
        let bit = |number: u16| controlword & 1 << number != 0;
        let (switch_on, voltage, running, operation) = (bit(0), bit(1), bit(2), bit(3));
        match self.state {
            Pds::SwitchOnDisabled if voltage && running && !switch_on => {
                self.go(2, Pds::ReadyToSwitchOn);
            }
            Pds::ReadyToSwitchOn if !voltage || !running => self.go(7, Pds::SwitchOnDisabled),
            Pds::ReadyToSwitchOn if switch_on => self.go(3, Pds::SwitchedOn),
            Pds::SwitchedOn if !voltage || !running => self.go(10, Pds::SwitchOnDisabled),
            Pds::SwitchedOn if !switch_on => self.go(6, Pds::ReadyToSwitchOn),
            Pds::SwitchedOn if operation => self.go(4, Pds::OperationEnabled),
            Pds::OperationEnabled if !voltage => self.go(9, Pds::SwitchOnDisabled),
            Pds::OperationEnabled if !running => self.go(11, Pds::QuickStopActive),
            Pds::OperationEnabled if !switch_on => self.go(8, Pds::ReadyToSwitchOn),
            Pds::OperationEnabled if !operation => self.go(5, Pds::SwitchedOn),
            Pds::QuickStopActive if !voltage => self.go(12, Pds::SwitchOnDisabled),
            Pds::QuickStopActive if self.traits.resumes && running && operation && switch_on => {
                self.go(16, Pds::OperationEnabled);
            }
            Pds::Fault if rising & 0x80 != 0 && !self.traits.cause_persists => {
                self.go(15, Pds::SwitchOnDisabled);
                self.dictionary.set(0x603f, 0, 0);
                self.emergency(0);
            }
            _ => {}
        }
    }
}
