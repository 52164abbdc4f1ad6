//! The emulated controller: QEMU's `netduinoplus2`, an STM32F405 without its surroundings.
//!
//! The protocol is on USART3 as on the real board. The drives are simulated, and a test bench at
//! UART4 disturbs them and sees what they are told. Flash is simulated in RAM that a reset leaves
//! alone. Clocks, pins and watchdog, which the emulator lacks, are left alone, too.
#![no_std]
#![no_main]

#[path = "../board/mod.rs"]
mod board;

#[cortex_m_rt::exception]
unsafe fn HardFault(_: &cortex_m_rt::ExceptionFrame) -> ! {
    board::sink::fail()
}

#[cortex_m_rt::exception]
unsafe fn DefaultHandler(_: i16) -> ! {
    board::sink::fail()
}

#[rtic::app(device = stm32f4::stm32f405, peripherals = true)]
mod app {
    use core::mem::MaybeUninit;

    use cortex_m::peripheral::SCB;
    use heapless::spsc::{Consumer, Producer, Queue};
    use nalgebra::SVector;
    use stillpoint_firmware::bench::{Action, BenchDrives, Record, TickRecord, rows};
    use stillpoint_firmware::link::{BoardInfo, Link, Machine};
    use stillpoint_firmware::loop_time;
    use stillpoint_firmware::stand_in::StandIn;
    use stillpoint_firmware::store::Store;
    use stillpoint_firmware::{State, TickInputs};
    use stillpoint_shared::time::DRIVE_PERIOD_TICKS;

    use super::board::bench_port::{self, BenchReceiver, BenchTransmitter};
    use super::board::ram_flash::{self, Sectors};
    use super::board::serve::{AXES, Diary, Place, RECEIVED, Reach, Server};
    use super::board::stopwatch::{self, Stopwatch, Timed};
    use super::board::uart::{self, Receiver};
    use super::board::{build_id, receive, retained, stack, timer};

    #[shared]
    struct Shared {
        machine: Place,
        bench: BenchTransmitter,
    }

    #[local]
    struct Local {
        drives: Timed<BenchDrives<AXES>>,
        actions: Consumer<'static, Action>,
        act: Producer<'static, Action>,
        bench_receiver: BenchReceiver,
        receiver: Receiver,
        bytes: Producer<'static, u8>,
        server: Server<Sectors>,
    }

    #[init(local = [
        machine: Machine<AXES> = Machine::unconfigured(),
        link: MaybeUninit<Link> = MaybeUninit::uninit(),
        store: MaybeUninit<Store<Sectors>> = MaybeUninit::uninit(),
        byte_queue: Queue<u8, RECEIVED> = Queue::new(),
        action_queue: Queue<Action, 16> = Queue::new(),
    ])]
    fn init(cx: init::Context) -> (Shared, Local) {
        stack::paint();
        cx.device.RCC.apb1enr().modify(|_, w| {
            w.usart3en().set_bit();
            w.uart4en().set_bit()
        });
        let (transmitter, receiver) =
            uart::start(cx.device.USART3, loop_time::CORE_HZ / 4, 921_600);
        let (mut bench, bench_receiver) = bench_port::start(cx.device.UART4);
        let (bytes, received) = cx.local.byte_queue.split();
        let (act, actions) = cx.local.action_queue.split();

        let info = BoardInfo {
            board: "qemu",
            firmware: env!("CARGO_PKG_VERSION"),
            build_id: build_id::build_id(),
            period_ticks: DRIVE_PERIOD_TICKS,
            start: retained::count_start(),
        };
        defmt::info!("start {}, build {=u64:016x}", info.start, info.build_id);
        let machine = cx.local.machine;
        // SAFETY: called once.
        let (record, flash) = unsafe { (retained::fault_record(), ram_flash::sectors()) };
        record.recover();
        machine.executor.record_into(record, info.build_id);
        let link = cx.local.link.write(Link::new(info));
        let store = cx.local.store.write(Store::mount(flash, ram_flash::LAYOUT));
        if link.restore(machine, store).is_err() {
            defmt::info!("not configured");
        }

        bench.send(&Record::Up);
        timer::start(cx.core.SYST);
        let drives = BenchDrives::at(&SVector::zeros());
        (
            Shared {
                machine: Some(machine),
                bench,
            },
            Local {
                drives: Timed::new(drives),
                actions,
                act,
                bench_receiver,
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
        binds = SysTick, priority = 2, shared = [machine, bench],
        local = [
            drives, actions,
            stand_in: StandIn<AXES> = StandIn::new(), stopped: bool = false, busy_ticks: u32 = 0, last: Option<State> = None,
        ]
    )]
    fn tick(cx: tick::Context) {
        let tick::LocalResources {
            drives,
            actions,
            stand_in,
            stopped,
            busy_ticks,
            last,
            ..
        } = cx.local;
        let stopwatch = Stopwatch::start();
        let mut overrun = false;
        while let Some(action) = actions.dequeue() {
            match action {
                Action::Stop => *stopped = true,
                Action::Repair => *stopped = false,
                Action::Overrun => overrun = true,
                _ => {}
            }
            drives.group.act(action);
        }
        let inputs = TickInputs {
            emergency_stop: *stopped,
            busy_ticks: *busy_ticks,
            missed_ticks: 0,
        };
        let mut done = None;
        let mut machine = cx.shared.machine;
        machine.lock(|place| match place {
            Some(machine) => {
                let report = stillpoint_tick::tick(machine, drives, stand_in, inputs);
                done = Some((report.tick, report.state, report.path_ticks));
            }
            None => stand_in.tick(drives, &inputs),
        });
        let whole_counts = stopwatch.counts();
        if overrun {
            // More than the monitor allows, and less than a period, beyond which the stopwatch is
            // wrong if the tick began late.
            cortex_m::asm::delay(loop_time::PERIOD_COUNTS * 2 / 3);
        }
        *busy_ticks = loop_time::time_ticks(stopwatch.counts());

        let sent = drives.group.take_sent();
        let Some((tick, state, path_ticks)) = done else {
            return;
        };
        if sent.is_some() || *last != Some(state) {
            *last = Some(state);
            let record = Record::Tick(TickRecord {
                tick: tick as u32,
                state,
                path_ticks,
                sent: sent.map(rows),
                to_setpoint_counts: stopwatch.until(drives),
                whole_counts: whole_counts.saturating_sub(drives.answer_counts) as u16,
            });
            let mut bench = cx.shared.bench;
            bench.lock(|bench| bench.send(&record));
        }
    }

    #[task(binds = USART3, priority = 3, local = [receiver, bytes])]
    fn take_byte(cx: take_byte::Context) {
        stopwatch::away(|| receive::receive(cx.local.receiver, cx.local.bytes));
    }

    /// The bench.
    #[task(binds = UART4, priority = 1, shared = [bench], local = [bench_receiver, act])]
    fn disturb(mut cx: disturb::Context) {
        match cx.local.bench_receiver.take() {
            None => {}
            Some(Action::Reset) => SCB::sys_reset(),
            Some(Action::MeasureStack) => {
                let (used_bytes, available_bytes) = stack::usage();
                let record = Record::Stack {
                    used_bytes,
                    available_bytes,
                };
                cx.shared.bench.lock(|bench| bench.send(&record));
            }
            Some(action) => {
                let _ = cx.local.act.enqueue(action);
            }
        }
    }

    #[idle(shared = [machine], local = [server, diary: Diary = Diary::NEW])]
    fn idle(cx: idle::Context) -> ! {
        let mut machine = Reach(cx.shared.machine);
        loop {
            let more = cx.local.server.serve(&mut machine);
            cx.local.diary.look(&mut machine);
            if cx.local.server.link.wants_start() {
                SCB::sys_reset();
            }
            if !more {
                cortex_m::asm::wfi();
            }
        }
    }
}
