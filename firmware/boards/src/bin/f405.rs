//! The controller: an STM32F405 that commands servo drives on two CAN buses.
//!
//! Pins are in `board/pins.rs`. The log goes over RTT. What is stored is in the flash's last four
//! sectors.
#![no_std]
#![no_main]

#[path = "../board/mod.rs"]
mod board;

use board::pins;

/// The crystal's frequency: 8 MHz unless the variable `STILLPOINT_CRYSTAL_MHZ` says otherwise when
/// the image is built.
const CRYSTAL_MHZ: u32 = match option_env!("STILLPOINT_CRYSTAL_MHZ") {
    None => 8,
    Some(text) => match u32::from_str_radix(text, 10) {
        Ok(mhz) => mhz,
        Err(_) => panic!("STILLPOINT_CRYSTAL_MHZ is no number"),
    },
};

/// Rate of the protocol's port in bit/s.
const BAUD: u32 = 921_600;

/// The crystal has stopped: the core runs on at 16 MHz, and neither the buses nor the timing of
/// the drive loop hold.
#[cortex_m_rt::exception]
unsafe fn NonMaskableInt() -> ! {
    stop()
}

#[cortex_m_rt::exception]
unsafe fn HardFault(_: &cortex_m_rt::ExceptionFrame) -> ! {
    stop()
}

#[cortex_m_rt::exception]
unsafe fn DefaultHandler(_: i16) -> ! {
    stop()
}

/// Takes the torque away; the watchdog resets the board.
fn stop() -> ! {
    loop {
        pins::disable_drives();
    }
}

#[rtic::app(device = stm32f4::stm32f405, peripherals = true)]
mod app {
    use core::mem::MaybeUninit;

    use cortex_m::peripheral::{DWT, SCB};
    use heapless::spsc::{Producer, Queue};
    use stillpoint_firmware::TickInputs;
    use stillpoint_firmware::cia402::ConfiguredDrives;
    use stillpoint_firmware::link::{Access, BoardInfo, Link, Machine};
    use stillpoint_firmware::loop_time;
    use stillpoint_firmware::safety_io::SafetyIo;
    use stillpoint_firmware::stand_in::StandIn;
    use stillpoint_firmware::store::Store;
    use stillpoint_shared::time::DRIVE_PERIOD_TICKS;
    use stm32f4::stm32f405::{CAN1, CAN2};

    use super::board::flash::{self, Sectors};
    use super::board::pins::{DriveEnable, StopContact};
    use super::board::serve::{AXES, Diary, Place, RECEIVED, Reach, Server};
    use super::board::uart::{self, Receiver};
    use super::board::watchdog::{self, Feeder, Patience};
    use super::board::{build_id, can, clock, pins, receive, retained, timer};
    use super::{BAUD, CRYSTAL_MHZ};

    /// The drives on both buses.
    pub type Drives = ConfiguredDrives<AXES, (can::Bus<CAN1>, can::Bus<CAN2>)>;

    #[shared]
    struct Shared {
        machine: Place,
    }

    #[local]
    struct Local {
        drives: Drives,
        safety: SafetyIo<StopContact, DriveEnable>,
        watchdog: Feeder,
        receiver: Receiver,
        bytes: Producer<'static, u8>,
        server: Server<Sectors>,
    }

    #[init(local = [
        machine: Machine<AXES> = Machine::unconfigured(),
        link: MaybeUninit<Link> = MaybeUninit::uninit(),
        store: MaybeUninit<Store<Sectors>> = MaybeUninit::uninit(),
        byte_queue: Queue<u8, RECEIVED> = Queue::new(),
    ])]
    fn init(cx: init::Context) -> (Shared, Local) {
        let (device, mut core) = (cx.device, cx.core);
        let rcc = device.RCC;
        let (contact, enable) = pins::start(&rcc, device.GPIOB, device.GPIOC);
        // From here on a start that does not succeed ends in a reset.
        let watchdog = watchdog::start(device.IWDG, &device.DBGMCU);
        let info = BoardInfo {
            board: "f405",
            firmware: env!("CARGO_PKG_VERSION"),
            build_id: build_id::build_id(),
            period_ticks: DRIVE_PERIOD_TICKS,
            start: retained::count_start(),
        };
        defmt::info!(
            "start {}, build {=u64:016x}, reset flags {=u8:#x}",
            info.start,
            info.build_id,
            clock::take_reset_flags(&rcc)
        );
        if let Err(error) = clock::start::<CRYSTAL_MHZ>(&rcc, &device.PWR, &device.FLASH) {
            defmt::error!("no clock: {}", error);
            super::stop();
        }
        rcc.apb1enr().modify(|_, w| w.usart3en().set_bit());
        let (transmitter, receiver) = uart::start(device.USART3, clock::APB1_HZ, BAUD);
        let (bytes, received) = cx.local.byte_queue.split();

        let machine = cx.local.machine;
        // SAFETY: called once.
        let record = unsafe { retained::fault_record() };
        record.recover();
        machine.executor.record_into(record, info.build_id);
        let sectors = Sectors::new(device.FLASH);
        let link = cx.local.link.write(Link::new(info));
        let store = cx.local.store.write(Store::mount(sectors, flash::LAYOUT));
        if link.restore(machine, store).is_err() {
            defmt::info!("not configured");
        }
        let (can1, can2) = (device.CAN1, device.CAN2);
        let drives = Drives::new(store.drives().as_ref(), DRIVE_PERIOD_TICKS, |kbit_per_s| {
            can::start(&rcc, can1, can2, kbit_per_s)
        });
        if let Err(reason) = drives.group() {
            defmt::warn!("no drives: {}", reason);
        }
        machine.executor.allow_for_bus(drives.cycle());

        core.DCB.enable_trace();
        core.DWT.enable_cycle_counter();
        // From here on the drive loop feeds it.
        watchdog::wait_for(Patience::Running);
        timer::start(core.SYST);
        (
            Shared {
                machine: Some(machine),
            },
            Local {
                drives,
                safety: SafetyIo::new(contact, enable),
                watchdog,
                receiver,
                bytes,
                server: Server {
                    link,
                    store,
                    received,
                    transmitter,
                },
            },
        )
    }

    /// The drive loop.
    #[task(
        binds = SysTick, priority = 2, shared = [machine], local = [
            drives, safety, watchdog,
            stand_in: StandIn<AXES> = StandIn::new(), wanted: bool = false, busy_ticks: u32 = 0, before: u32 = 0,
        ]
    )]
    fn tick(cx: tick::Context) {
        let tick::LocalResources {
            drives,
            safety,
            watchdog,
            stand_in,
            wanted,
            busy_ticks,
            before,
            ..
        } = cx.local;
        let now = DWT::cycle_count();
        let inputs = TickInputs {
            emergency_stop: !safety.update(*wanted),
            busy_ticks: *busy_ticks,
            missed_ticks: loop_time::missed_ticks(now.wrapping_sub(*before)),
        };
        *before = now;
        let mut machine = cx.shared.machine;
        machine.lock(|place| match place {
            Some(machine) => {
                let state = stillpoint_tick::tick(machine, drives, stand_in, inputs).state;
                *wanted = state.is_energised() && !machine.executor.is_dry_run();
            }
            None => stand_in.tick(drives, &inputs),
        });
        watchdog.feed();
        *busy_ticks = loop_time::time_ticks(timer::since_due_counts());
    }

    #[task(binds = USART3, priority = 3, local = [receiver, bytes])]
    fn take_byte(cx: take_byte::Context) {
        receive::receive(cx.local.receiver, cx.local.bytes);
    }

    #[idle(shared = [machine], local = [server, diary: Diary = Diary::NEW])]
    fn idle(cx: idle::Context) -> ! {
        let idle::LocalResources { server, diary, .. } = cx.local;
        let mut machine = Reach(cx.shared.machine);
        loop {
            let more = server.serve(&mut machine);
            diary.look(&mut machine);
            if server.link.wants_start() && server.transmitter.is_done() {
                // Other drives begin with a start, which is as good as at power-up.
                let is_off = machine.with(|m| !m.executor.state().is_energised());
                if is_off {
                    SCB::sys_reset();
                }
            }
            if more {
                continue;
            }
            cortex_m::asm::wfi();
        }
    }
}
