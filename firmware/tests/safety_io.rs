//! The safety wires fail to the safe side.

use core::cell::Cell;

use embedded_hal::digital::{ErrorKind, ErrorType, InputPin, OutputPin};
use stillpoint_firmware::safety_io::SafetyIo;

/// A wire that may be broken off its pin.
#[derive(Default)]
struct Wire {
    high: Cell<bool>,
    broken: Cell<bool>,
}

#[derive(Debug)]
struct Broken;

impl embedded_hal::digital::Error for Broken {
    fn kind(&self) -> ErrorKind {
        ErrorKind::Other
    }
}

struct Pin<'a>(&'a Wire);

impl ErrorType for Pin<'_> {
    type Error = Broken;
}

impl Pin<'_> {
    fn whole(&self) -> Result<&Wire, Broken> {
        if self.0.broken.get() {
            Err(Broken)
        } else {
            Ok(self.0)
        }
    }
}

impl InputPin for Pin<'_> {
    fn is_high(&mut self) -> Result<bool, Broken> {
        self.whole().map(|wire| wire.high.get())
    }

    fn is_low(&mut self) -> Result<bool, Broken> {
        self.is_high().map(|high| !high)
    }
}

impl OutputPin for Pin<'_> {
    fn set_low(&mut self) -> Result<(), Broken> {
        self.whole().map(|wire| wire.high.set(false))
    }

    fn set_high(&mut self) -> Result<(), Broken> {
        self.whole().map(|wire| wire.high.set(true))
    }
}

#[test]
fn drives_are_enabled_only_with_the_stop_released_and_both_wires_whole() {
    let (stop, enable) = (Wire::default(), Wire::default());
    let mut io = SafetyIo::new(Pin(&stop), Pin(&enable));
    for (contact_closed, stop_broken, wanted, well, enabled) in [
        (true, false, true, true, true),
        (true, false, false, true, false),
        (false, false, true, false, false),
        (true, true, true, false, false),
        (true, false, true, true, true),
        (false, false, false, false, false),
    ] {
        stop.high.set(contact_closed);
        stop.broken.set(stop_broken);
        assert_eq!(io.update(wanted), well);
        assert_eq!(enable.high.get(), enabled);
    }
    stop.high.set(true);
    enable.broken.set(true);
    assert!(
        !io.update(true),
        "an enable line that cannot be set is no all-clear"
    );
}
