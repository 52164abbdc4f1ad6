//! What the drive loop has to wait for, and what it goes on beside: a board on which it is watched
//! who has the machine while the flash is written.

use std::cell::Cell;
use std::rc::Rc;

use stillpoint_firmware::State;
use stillpoint_firmware::link::{Access, Machine};
use stillpoint_firmware::store::Store;
use stillpoint_firmware::store::flash::{Flash, FlashError};
use stillpoint_shared::protocol::{FrameDecoder, Message, Request, Response, frame};

use crate::common::{AXES, trajectory};
use crate::requests::{all, bring_to};
use crate::rig::{LAYOUT, Rig, TestFlash, framed};

/// Who has the machine.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Holder {
    /// The drive loop could have it.
    Free,
    /// The link, and the drive loop waits.
    Link,
    /// The link, and the drive loop goes on with the stand-in.
    AtRest,
}

/// The machine of a rig, watched.
struct Watched<'m> {
    machine: &'m mut Machine<AXES>,
    holder: Rc<Cell<Holder>>,
    /// Times the link lets go of the machine until the emergency stop is pressed.
    until_stop: Option<u32>,
    rests: Vec<State>,
}

impl Watched<'_> {
    fn hold<R>(&mut self, holder: Holder, act: impl FnOnce(&mut Machine<AXES>) -> R) -> R {
        assert_eq!(self.holder.replace(holder), Holder::Free);
        let result = act(self.machine);
        self.holder.set(Holder::Free);
        self.until_stop = match self.until_stop {
            Some(1) => {
                self.machine.executor.emergency_stop();
                None
            }
            until_stop => until_stop.map(|times| times - 1),
        };
        result
    }
}

impl Access<AXES> for Watched<'_> {
    fn with<R>(&mut self, act: impl FnOnce(&mut Machine<AXES>) -> R) -> R {
        self.hold(Holder::Link, act)
    }

    fn at_rest<R>(&mut self, act: impl FnOnce(&mut Machine<AXES>) -> R) -> R {
        self.rests.push(self.machine.executor.state());
        self.hold(Holder::AtRest, act)
    }
}

/// A flash that may be written only while the drive loop need not wait.
struct WatchedFlash {
    flash: TestFlash,
    holder: Rc<Cell<Holder>>,
    writes: Rc<Cell<u32>>,
}

impl WatchedFlash {
    fn write(&self) {
        assert_eq!(self.holder.get(), Holder::AtRest);
        self.writes.set(self.writes.get() + 1);
    }
}

impl Flash for WatchedFlash {
    fn sector_bytes(&self) -> usize {
        self.flash.sector_bytes()
    }

    fn sector(&self, sector: u8) -> &[u8] {
        self.flash.sector(sector)
    }

    fn erase(&mut self, sector: u8) -> Result<(), FlashError> {
        self.write();
        self.flash.erase(sector)
    }

    fn program(&mut self, sector: u8, offset: usize, word: u32) -> Result<(), FlashError> {
        self.write();
        self.flash.program(sector, offset, word)
    }
}

/// What a request did.
struct Seen {
    /// States in which the machine was taken away from the drive loop.
    rests: Vec<State>,
    flash_writes: u32,
    before: Vec<u8>,
    after: Vec<u8>,
    /// Whether what was loaded still is.
    kept: bool,
    denied: bool,
}

fn content(flash: &TestFlash) -> Vec<u8> {
    (0..4)
        .flat_map(|sector| flash.sector(sector).to_vec())
        .collect()
}

/// Sends a request to a board in a state; the emergency stop is pressed after the link has let go of
/// the machine so many times.
fn watched(
    state: State,
    request: impl Fn(&Rig) -> Request<'static>,
    until_stop: Option<u32>,
) -> Seen {
    let mut rig = Rig::new();
    bring_to(&mut rig, state);
    let request = request(&rig);
    rig.sequence = rig.sequence.wrapping_add(1);
    let bytes = framed(rig.envelope(), &request);
    let Rig {
        mut link,
        mut machine,
        store,
        ..
    } = rig;
    let flash = store.into_flash();
    let before = content(&flash);
    let (holder, writes) = (Rc::new(Cell::new(Holder::Free)), Rc::new(Cell::new(0)));
    let flash = WatchedFlash {
        flash,
        holder: Rc::clone(&holder),
        writes: Rc::clone(&writes),
    };
    let mut store = Store::mount(flash, LAYOUT);
    let loaded = machine.executor.trajectory().header().content_hash;
    let mut access = Watched {
        machine: &mut machine,
        holder,
        until_stop,
        rests: Vec::new(),
    };
    for byte in bytes {
        link.receive(byte);
    }
    while link.poll(&mut access, &mut store) {}
    let rests = access.rests;
    let mut decoder = FrameDecoder::new();
    let mut sent = link.transmit().iter();
    let denied = sent.any(|&byte| {
        let payload = decoder.feed(byte).map(|payload| payload.unwrap());
        payload.is_some_and(|payload| {
            let (_, body) = frame::open(payload).unwrap();
            matches!(
                frame::read(body),
                Ok(Message::Response(Response::Denied(_)))
            )
        })
    });
    Seen {
        rests,
        flash_writes: writes.get(),
        before,
        after: content(&store.flash().flash),
        denied,
        kept: machine.executor.trajectory().header().content_hash == loaded,
    }
}

#[test]
fn nothing_long_is_done_while_the_drive_loop_waits_or_a_move_is_under_way() {
    let count = all(&Rig::new()).len();
    let (mut writes, mut rests) = (0, 0);
    for state in State::ALL {
        for index in 0..count {
            let seen = watched(state, |rig| all(rig).remove(index), None);
            assert!(seen.rests.iter().all(|state| !state.is_under_way()));
            if state.is_energised() {
                assert_eq!(seen.flash_writes, 0, "request {index} in {state:?}");
            }
            writes += seen.flash_writes;
            rests += seen.rests.len();
        }
    }
    assert!(writes > 0 && rests > 0);
}

#[test]
fn a_commit_leaves_the_drive_loop_free_with_the_drives_on() {
    let content_hash = trajectory().header().content_hash;
    for state in [State::Armed, State::Done] {
        let commit = |_: &Rig| Request::UploadCommit { content_hash };
        assert_eq!(watched(state, commit, None).rests, [state]);
    }
}

#[test]
fn what_is_refused_because_of_a_stop_in_between_has_changed_nothing() {
    let count = all(&Rig::new()).len();
    let mut denials = 0;
    for until_stop in 1..=5 {
        for index in 0..count {
            let request = |rig: &Rig| all(rig).remove(index);
            let seen = watched(State::Ready, request, Some(until_stop));
            if seen.denied {
                denials += 1;
                let case = format!("request {index}, stop {until_stop}");
                assert!(seen.before == seen.after && seen.kept, "{case}");
            }
        }
    }
    assert!(denials > 5, "{denials}");
}
