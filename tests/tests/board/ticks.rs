//! How many instructions a tick takes and how much stack is used: the emulator counts exactly.

use std::time::Duration;

use stillpoint::device::qemu;
use stillpoint_firmware::State;
use stillpoint_firmware::bench::{Action, Record, TickRecord};
use stillpoint_shared::protocol::{Channels, Request, TelemetryConfig};
use stillpoint_tests::image::Image;

use super::bench::{Bench, PATIENCE, paper, start_request};

/// Instructions of a tick: of half of the ticks of a move, with a sample of telemetry every fourth tick; of a tick at full speed
/// with such a sample and one of the fault record; and of any under way. Without the drives' own work and the interrupts that take in the bytes of an order,
/// of some 130 instructions each.
const TYPICAL: u32 = 1_500;
const SAMPLED: u32 = 1_800;
const WORST: u32 = 2_500;

/// Instructions of half of the ticks that carry telemetry, which is more than those of half of all ticks may be. Some of
/// it is the fault record's, where both take their samples in the same ticks: that depends on when telemetry was asked for.
const WITH_TELEMETRY: u32 = 1_750;

/// Ticks from one sample of telemetry to the next.
const EVERY_TICKS: u32 = 4;

/// Counts of the core clock in 0.1 ms: the clock has 168 MHz, as on the controller.
const COUNTS_PER_S: f64 = 168e6;

fn instructions(counts: u16) -> u32 {
    (f64::from(counts) / COUNTS_PER_S / qemu::INSTRUCTION_S).round() as u32
}

/// A board with the paper's move, 11 support points, that sends everything it can a thousand times per second.
fn observed(percent: u8) -> Bench {
    let mut bench = Bench::loaded();
    let telemetry = TelemetryConfig {
        every_ticks: EVERY_TICKS as u16,
        channels: Channels::ALL,
    };
    let request = Request::SetTelemetry(telemetry);
    bench.session.order(&request).unwrap();
    let request = Request::Override { percent };
    bench.session.order(&request).unwrap();
    bench.session.order(&Request::Arm).unwrap();
    bench.start(&start_request());
    bench
}

/// Ticks that take samples of telemetry: those of the one residue, of the four, that take most.
fn with_telemetry(ticks: &[TickRecord]) -> Vec<TickRecord> {
    let of = |residue| {
        let ticks = ticks
            .iter()
            .filter(move |tick| tick.tick % EVERY_TICKS == residue);
        ticks.copied().collect::<Vec<_>>()
    };
    let most = (0..EVERY_TICKS).max_by_key(|&residue| {
        let [_, whole] = counted(&of(residue));
        whole.get(whole.len() / 2).copied()
    });
    of(most.unwrap_or_default())
}

/// Instructions of every tick of the move, fewest first: to the set-points, and of the whole tick.
fn counted(ticks: &[TickRecord]) -> [Vec<u32>; 2] {
    let moving = || ticks.iter().filter(|tick| tick.state.is_under_way());
    let mut counts = [
        moving()
            .map(|tick| instructions(tick.to_setpoint_counts))
            .collect::<Vec<_>>(),
        moving()
            .map(|tick| instructions(tick.whole_counts))
            .collect(),
    ];
    for counts in &mut counts {
        counts.sort_unstable();
    }
    counts
}

#[test]
fn a_tick_keeps_to_its_budget() {
    let mut bench = observed(100);
    bench.until_state(State::Done);
    let [to_setpoint, whole] = counted(&bench.seen);
    let half = whole.len() / 2;
    println!(
        "typical: {} to the set-points, {} in all",
        to_setpoint[half], whole[half]
    );
    println!("at full speed: {} at most", whole[whole.len() - 1]);
    assert!(whole.len() > 150 && whole[half] <= TYPICAL, "{whole:?}");
    assert!(whole[whole.len() - 1] <= SAMPLED, "{whole:?}");
    let [_, carrying] = counted(&with_telemetry(&bench.seen));
    let typical = carrying[carrying.len() / 2];
    println!("with telemetry: typical {typical}");
    assert!(
        carrying.len() > 40 && typical <= WITH_TELEMETRY,
        "{carrying:?}"
    );

    // Slow enough to interfere with it in time.
    let mut bench = observed(20);
    for (share, request) in [
        (0.1, Request::Hold),
        (0.1, Request::Resume),
        (0.3, Request::Override { percent: 60 }),
        (0.5, Request::Override { percent: 20 }),
    ] {
        bench.until_share(share);
        if request == Request::Resume {
            bench.until_state(State::Held);
        }
        bench.session.order(&request).unwrap();
    }
    bench.until_state(State::Done);
    let [to_setpoint, whole] = counted(&bench.seen);
    let (last_to_setpoint, last) = (to_setpoint.last(), whole.last());
    println!("worst: {last_to_setpoint:?} to the set-points, {last:?} in all");
    assert!(last.is_some_and(|&worst| worst <= WORST), "{whole:?}");
}

#[test]
fn a_tick_that_ends_in_a_fault_keeps_to_the_budget() {
    for percent in [100, 20] {
        let mut bench = observed(percent);
        bench.until_share(0.3);
        bench.act(Action::Fault { axis: 1 });
        let tick = bench.until_state(State::Fault);
        let whole = instructions(tick.whole_counts);
        println!("into a fault at {percent} %: {whole}");
        assert!(whole <= WORST, "{whole} at {percent} %");
    }
}

#[test]
fn the_stack_in_use_is_within_what_is_proved() {
    let mut bench = observed(100);
    bench.until_state(State::Done);
    for request in [Request::Disarm, Request::Store] {
        bench.session.order(&request).unwrap();
    }
    bench.session.fault_report().unwrap();
    let duration_s = f64::from(paper().1.duration_ticks()) * 1e-7;
    bench
        .session
        .wait(Duration::from_secs_f64(duration_s))
        .unwrap();
    bench.act(Action::MeasureStack);
    let used_bytes = loop {
        match bench.session.transport().records().recv_timeout(PATIENCE) {
            Ok(Record::Stack { used_bytes, .. }) => break used_bytes,
            Ok(_) => {}
            Err(error) => panic!("no measurement: {error}"),
        }
    };
    let bound = Image::of("qemu").stack_bound().unwrap();
    println!("stack: {used_bytes} of {bound} bytes");
    assert!(used_bytes <= bound, "{used_bytes} of {bound}");
}
