//! A drive configuration can be used when it exists; its cycle and load are those of the formulas.

use proptest::prelude::*;
use stillpoint_shared::config::MonitorConfig;
use stillpoint_shared::drive_config::{
    AxisDrive, BIT_RATES_KBIT_PER_S, BusConfig, Cycle, DriveConfig, DriveConfigError,
    MAX_ENCODED_BYTES, MOST_BUS_LOAD_PERMILLE, Mapping, Problem, bus_load_permille, frame_bits,
    interpolation_time,
};
use stillpoint_shared::time::DRIVE_PERIOD_TICKS;

fn drive(bus: u8, node: u8) -> AxisDrive {
    AxisDrive {
        bus,
        node,
        counts_per_turn: 1_048_576.0 * 33.0,
        reversed: false,
        home_counts: -7_000_000,
        home_rad: 0.5,
        gear_ratio: 33.0,
        rated_torque_nm: 1.27,
        torque_limit_permille: 3_000,
        mapping: Mapping::Write,
        tells_following: true,
    }
}

fn every(period_us: u16) -> BusConfig {
    BusConfig {
        period_us,
        ..BusConfig::default()
    }
}

#[test]
fn the_longest_frames_are_as_long_as_the_literature_says() {
    // 8 bytes: 135 bits in Davis et al. 2007; 0 bytes: 55.
    assert_eq!([0, 1, 7, 8].map(frame_bits), [55, 65, 125, 135]);
}

#[test]
fn three_axes_fit_one_bus_at_500_hz_and_two_at_1_khz() {
    let load = |period_us, axes| bus_load_permille(&every(period_us), axes);
    assert_eq!((load(2_000, 3), load(1_000, 2)), (418, 575));
    assert_eq!((load(1_000, 1), load(1_000, 3)), (315, 835));

    let one_bus = [1, 2, 3].map(|node| drive(0, node));
    let config = DriveConfig::new(every(2_000), &one_bus).unwrap();
    let cycle = Cycle::new(&config, DRIVE_PERIOD_TICKS).unwrap();
    assert_eq!(
        (cycle.ticks, cycle.lead_ticks, cycle.reply_ticks),
        (8, 3, 3)
    );
    assert_eq!(cycle.feedback_age_ticks(0), 10);
    assert_eq!(cycle.feedback_age_ticks(2), 26);
    assert_eq!(cycle.following_lag_ticks(), 21);
    let one_lost = MonitorConfig {
        feedback_age_ticks: 1,
        ..MonitorConfig::default()
    };
    let monitor = cycle.monitor(&one_lost, DRIVE_PERIOD_TICKS);
    // 2 ms of the drives' own, 21 ticks of the bus and 8 for a lost message.
    assert!((monitor.following_lag_s - (2e-3 + 29.0 * 250e-6)).abs() < 1e-6);
    assert_eq!(monitor.feedback_age_ticks, 18);
    assert_eq!(
        monitor.following_at_rest_rad,
        MonitorConfig::default().following_at_rest_rad
    );

    let two_buses = [drive(0, 1), drive(1, 1), drive(0, 3)];
    let config = DriveConfig::new(every(1_000), &two_buses).unwrap();
    let cycle = Cycle::new(&config, DRIVE_PERIOD_TICKS).unwrap();
    assert_eq!(
        (cycle.ticks, cycle.lead_ticks, cycle.reply_ticks),
        (4, 2, 2)
    );
    assert_eq!(
        (config.buses(), config.axes_on(0), config.axes_on(1)),
        (2, 2, 1)
    );

    let refused = DriveConfig::new(every(1_000), &one_bus).unwrap_err();
    assert_eq!(
        refused,
        DriveConfigError::Overloaded {
            bus: 0,
            load_permille: 835,
            axes: 3,
            period_us: 1_000
        }
    );
    assert_eq!(
        refused.to_string(),
        "3 axes every 1000 µs would load bus 0 to 83.5 %, 70 % are allowed: use a longer period or a second bus"
    );
}

#[test]
fn a_period_is_told_in_a_byte_and_a_power_of_ten() {
    for (period_us, told) in [
        (2_000, Some((2, -3))),
        (1_000, Some((1, -3))),
        (500, Some((5, -4))),
        (250, Some((25, -5))),
        (25_500, Some((255, -4))),
        (10, Some((1, -5))),
        (1_001, None),
        (25_600, None),
    ] {
        assert_eq!(interpolation_time(period_us), told, "{period_us}");
    }
}

#[test]
fn every_wrong_number_is_refused_by_name() {
    let axis = |change: fn(&mut AxisDrive)| {
        let mut changed = drive(0, 2);
        change(&mut changed);
        DriveConfig::new(BusConfig::default(), &[drive(0, 1), changed]).unwrap_err()
    };
    let wrong = |problem| DriveConfigError::Axis { axis: 1, problem };
    assert_eq!(axis(|drive| drive.bus = 2), wrong(Problem::Bus(2)));
    assert_eq!(axis(|drive| drive.node = 0), wrong(Problem::Node(0)));
    assert_eq!(axis(|drive| drive.node = 128), wrong(Problem::Node(128)));
    for counts in [0.0, -1.0, 5e9, f64::INFINITY] {
        let mut changed = drive(0, 2);
        changed.counts_per_turn = counts;
        assert_eq!(
            DriveConfig::new(BusConfig::default(), &[drive(0, 1), changed]),
            Err(wrong(Problem::CountsPerTurn(counts)))
        );
    }
    assert!(matches!(
        axis(|drive| drive.counts_per_turn = f64::NAN),
        DriveConfigError::Axis {
            problem: Problem::CountsPerTurn(_),
            ..
        }
    ));
    assert_eq!(
        axis(|drive| drive.home_rad = f32::INFINITY),
        wrong(Problem::HomeRad(f32::INFINITY))
    );
    assert_eq!(
        axis(|drive| drive.gear_ratio = -33.0),
        wrong(Problem::GearRatio(-33.0))
    );
    assert_eq!(
        axis(|drive| drive.rated_torque_nm = 0.0),
        wrong(Problem::RatedTorque(0.0))
    );
    assert_eq!(
        axis(|drive| drive.torque_limit_permille = 0),
        wrong(Problem::TorqueLimit(0))
    );
    assert_eq!(
        axis(|drive| drive.torque_limit_permille = 32_768),
        wrong(Problem::TorqueLimit(32_768))
    );
    assert_eq!(
        axis(|drive| drive.node = 1),
        DriveConfigError::NodeTwice {
            axis: 0,
            bus: 0,
            node: 1
        }
    );
    assert_eq!(
        axis(|drive| drive.node = 127),
        DriveConfigError::NodeIsBoards { axis: 1, node: 127 }
    );
    // The same node id on another bus is another drive.
    DriveConfig::new(BusConfig::default(), &[drive(0, 1), drive(1, 1)]).unwrap();

    let bus = |change: fn(&mut BusConfig)| {
        let mut changed = BusConfig::default();
        change(&mut changed);
        DriveConfig::new(changed, &[drive(0, 1)]).unwrap_err()
    };
    assert_eq!(
        bus(|bus| bus.period_us = 0),
        DriveConfigError::Period { period_us: 0 }
    );
    assert_eq!(
        bus(|bus| bus.period_us = 1_001),
        DriveConfigError::Period { period_us: 1_001 }
    );
    for rate in [0, 1, 124, 126, 333, 800, 999, 1_001] {
        let changed = BusConfig {
            bit_rate_kbit_per_s: rate,
            ..BusConfig::default()
        };
        assert_eq!(
            DriveConfig::new(changed, &[drive(0, 1)]),
            Err(DriveConfigError::BitRate {
                bit_rate_kbit_per_s: rate
            })
        );
    }
    assert_eq!(
        bus(|bus| bus.heartbeat_timeout_ms = 99),
        DriveConfigError::Heartbeat {
            heartbeat_ms: 50,
            heartbeat_timeout_ms: 99
        }
    );
    assert_eq!(
        bus(|bus| bus.controller_node = 128),
        DriveConfigError::ControllerNode { node: 128 }
    );
    assert_eq!(
        DriveConfig::new(BusConfig::default(), &[]),
        Err(DriveConfigError::Axes { axes: 0 })
    );
    assert_eq!(
        DriveConfig::new(BusConfig::default(), &[drive(0, 1); 7]),
        Err(DriveConfigError::Axes { axes: 7 })
    );
}

#[test]
fn a_cycle_has_whole_ticks_and_time_for_all_messages() {
    let config = DriveConfig::new(every(2_000), &[drive(0, 1)]).unwrap();
    for tick_ticks in [0, 3_000, 40_000] {
        assert_eq!(
            Cycle::new(&config, tick_ticks),
            Err(DriveConfigError::NotTicks {
                period_us: 2_000,
                tick_ticks
            })
        );
    }
    let config = DriveConfig::new(every(500), &[drive(0, 1)]).unwrap();
    assert_eq!(
        Cycle::new(&config, DRIVE_PERIOD_TICKS),
        Err(DriveConfigError::NoTime {
            ticks: 2,
            lead_ticks: 2,
            reply_ticks: 2
        })
    );
}

#[test]
fn postcard_and_json_carry_it_and_read_it_strictly() {
    let mut widest = drive(1, 1);
    widest.counts_per_turn = f64::from(u32::MAX);
    widest.home_counts = i32::MIN;
    widest.torque_limit_permille = 32_767;
    let bus = BusConfig {
        period_us: 60_000,
        heartbeat_ms: 30_000,
        heartbeat_timeout_ms: u16::MAX,
        ..BusConfig::default()
    };
    let axes: Vec<AxisDrive> = (1..=6).map(|node| AxisDrive { node, ..widest }).collect();
    let bus = BusConfig {
        period_us: 25_000,
        ..bus
    };
    let config = DriveConfig::new(bus, &axes).unwrap();
    let mut buffer = [0; MAX_ENCODED_BYTES];
    let bytes = postcard::to_slice(&config, &mut buffer).unwrap();
    assert_eq!(postcard::from_bytes::<DriveConfig>(bytes).unwrap(), config);

    let json = serde_json::to_string(&config).unwrap();
    assert_eq!(serde_json::from_str::<DriveConfig>(&json).unwrap(), config);
    let wrong = json.replace("\"node\":3", "\"node\":200");
    let error = serde_json::from_str::<DriveConfig>(&wrong).unwrap_err();
    assert!(
        error
            .to_string()
            .contains("axis 3: node is 200: give 1 to 127"),
        "{error}"
    );

    let other = DriveConfig::new(bus, &axes[..5]).unwrap();
    assert_ne!(config.hash(), other.hash());
}

proptest! {
    /// Whatever is read, is either refused or can be used: the load is below the limit, and where
    /// there is a cycle, set-points and feedback have their time in it and the tick after SYNC is
    /// not that of the set-points.
    #[test]
    fn what_exists_can_be_used(
        period_us in 1u16..=10_000,
        bit_rate_kbit_per_s in prop::sample::select(&BIT_RATES_KBIT_PER_S),
        places in prop::collection::vec((0u8..3, 1u8..=127), 1..=6),
        tick_us in 1u32..=2_000,
    ) {
        let bus = BusConfig { period_us, bit_rate_kbit_per_s, ..BusConfig::default() };
        let axes: Vec<AxisDrive> = places.iter().map(|&(bus, node)| drive(bus, node)).collect();
        let Ok(config) = DriveConfig::new(bus, &axes) else { return Ok(()); };
        for line in 0..config.buses() {
            let bits = 55 + 260 * config.axes_on(line) as u64;
            // bits per cycle / (bits per µs · µs) = load
            let capacity = u64::from(bit_rate_kbit_per_s) * u64::from(period_us);
            prop_assert!(bits * 1_000_000 <= u64::from(MOST_BUS_LOAD_PERMILLE) * capacity);
        }
        let Ok(cycle) = Cycle::new(&config, tick_us * 10) else { return Ok(()); };
        prop_assert_eq!(u32::from(cycle.ticks) * tick_us, u32::from(period_us));
        prop_assert!(cycle.lead_ticks + cycle.reply_ticks <= cycle.ticks);
        prop_assert!(cycle.lead_ticks >= 1 && cycle.ticks - cycle.lead_ticks >= 2);
    }

    /// Arbitrary bytes are refused or are a configuration that can be used.
    #[test]
    fn arbitrary_bytes_do_no_harm(bytes in prop::collection::vec(any::<u8>(), 0..250)) {
        if let Ok(config) = postcard::from_bytes::<DriveConfig>(&bytes) {
            prop_assert!(DriveConfig::new(*config.bus(), config.axes()).is_ok());
        }
    }
}
