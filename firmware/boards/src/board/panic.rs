//! The panic handler, which the linker proves to be unreachable.

use core::panic::PanicInfo;
use core::ptr;

/// In the image exactly if the handler is: unused functions and statics are dropped when linking.
///
/// `image.x` asserts that section `.panic` is empty, so an image with a reachable panic does not
/// link. A marker survives inlining, which a search for symbol names does not.
#[unsafe(link_section = ".panic")]
static REACHABLE: u8 = 1;

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    loop {
        // SAFETY: reads a static. Volatile, so that it counts as used.
        unsafe { ptr::read_volatile(&raw const REACHABLE) };
    }
}
