//! The controller: an STM32F405 with servo drives on two CAN buses.
#![no_std]
#![no_main]

#[path = "../board/mod.rs"]
mod board;

#[rtic::app(device = stm32f4::stm32f405, peripherals = true)]
mod app {
    use cortex_m::peripheral::SYST;
    use cortex_m::peripheral::syst::SystClkSource;
    use embedded_can::nb::Can;
    use nalgebra::SVector;
    use stillpoint_firmware::safety_io::SafetyIo;
    use stillpoint_firmware::{Config, Executor, IdealDrives};
    use stillpoint_shared::{AxisLimits, Limits};
    use stm32f4::stm32f405::{CAN1, CAN2};

    use super::board::can::Bus;
    use super::board::pins::{DriveEnable, StopContact};
    use super::board::uart::{Receiver, Transmitter};
    use super::board::watchdog::Watchdog;
    use super::board::{build_id, can, clock, pins, uart};

    const RELOAD: u32 = 168_000_000 / 4_000 - 1;

    #[shared]
    struct Shared {
        executor: Option<Executor<3>>,
    }

    #[local]
    struct Local {
        drives: IdealDrives<3>,
        receiver: Receiver,
        transmitter: Transmitter,
        can: (Bus<CAN1>, Bus<CAN2>),
        watchdog: Watchdog,
        safety: SafetyIo<StopContact, DriveEnable>,
    }

    #[init]
    fn init(cx: init::Context) -> (Shared, Local) {
        let mut core = cx.core;
        let device = cx.device;
        let (contact, enable) = pins::start(&device.RCC, device.GPIOB, device.GPIOC);
        let r = clock::start::<8>(&device.RCC, &device.PWR, &device.FLASH);
        let watchdog = Watchdog::start(device.IWDG, &device.DBGMCU);
        core.SYST.set_clock_source(SystClkSource::Core);
        core.SYST.set_reload(RELOAD);
        core.SYST.clear_current();
        core.SYST.enable_counter();
        core.SYST.enable_interrupt();
        let axis = AxisLimits {
            torque_nm: 150.0,
            torque_rate_nm_per_s: 2.0e4,
            speed_rad_per_s: 31.415_927,
            knee_speed_rad_per_s: 24.870_94,
            slope_nm_s_per_rad: 22.918_312,
        };
        let limits = Limits::new(&[axis; 3]).ok();
        let executor = limits.and_then(|limits| Executor::new(limits, Config::default()).ok());
        let (transmitter, receiver) = uart::start(device.USART3, clock::APB1_HZ, 1_000_000);
        let can = can::start(&device.RCC, device.CAN1, device.CAN2);
        defmt::info!("up, build {:x} {}", build_id::build_id(), r);
        (
            Shared { executor },
            Local {
                drives: IdealDrives::at(&SVector::zeros()),
                receiver,
                transmitter,
                can,
                watchdog,
                safety: SafetyIo::new(contact, enable),
            },
        )
    }

    #[task(binds = SysTick, priority = 2, shared = [executor], local = [drives, can, watchdog, safety])]
    fn tick(mut cx: tick::Context) {
        cx.shared.executor.lock(|executor| {
            if let Some(executor) = executor {
                if !cx.local.safety.update(executor.state().is_energised()) {
                    executor.emergency_stop();
                }
                let report = executor.tick(cx.local.drives);
                if let Ok(f) = cx.local.can.0.receive() {
                    let _ = cx.local.can.1.transmit(&f);
                }
            }
        });
        cx.local.watchdog.feed();
    }

    #[task(binds = USART3, priority = 3, local = [receiver])]
    fn receive(cx: receive::Context) {
        let _ = cx.local.receiver.take();
    }

    #[idle(local = [transmitter])]
    fn idle(cx: idle::Context) -> ! {
        loop {
            if cx.local.transmitter.ready() {
                cx.local.transmitter.send(7);
            }
            cortex_m::asm::wfi();
        }
    }
}
