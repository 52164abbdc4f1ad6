//! Size, panics and stack of the linked images.

use stillpoint_tests::image::Image;

/// The drive loop at priority 2 interrupts the idle loop, and the receiver at priority 3 both.
const LEVELS: [&str; 3] = ["main", "SysTick", "USART3"];

/// An exception's frame with the registers of the floating-point unit, and 4 bytes to align it: ARMv7-M Architecture
/// Reference Manual, DDI 0403E, B1.5.7.
const EXCEPTION_BYTES: u32 = 26 * 4 + 4;

/// Most stack that is ever in use: the deepest path of every level at once.
fn stack_bytes(image: &Image) -> u32 {
    let levels = LEVELS.map(|handler| {
        let deepest = image
            .stack_of(handler)
            .unwrap_or_else(|error| panic!("{handler}: {error}"));
        println!("{handler}: {} bytes, {:?}", deepest.bytes, deepest.path);
        deepest.bytes
    });
    // One more for a fault that comes on top of all.
    levels.iter().sum::<u32>() + EXCEPTION_BYTES * LEVELS.len() as u32
}

#[test]
fn no_panic_can_be_reached() {
    for board in ["f405", "qemu"] {
        assert_eq!(Image::of(board).panics(), [""; 0], "{board}");
    }
}

#[test]
fn the_controllers_image_fits_its_budget() {
    let image = Image::of("f405");
    let (flash, ram) = (image.flash_bytes(), image.static_ram_bytes());
    let stack = stack_bytes(&image);
    println!("f405: {flash} bytes of flash, {ram} + {stack} bytes of RAM");
    assert!(flash <= 64 * 1024, "{flash} bytes of flash");
    assert!(ram + stack <= 48 * 1024, "{ram} + {stack} bytes of RAM");
}

#[test]
fn the_stack_has_the_room_it_needs() {
    for board in ["f405", "qemu"] {
        let image = Image::of(board);
        let stack = stack_bytes(&image);
        let room = Image::RAM_BYTES - image.static_ram_bytes();
        assert!(stack <= room, "{board}: {stack} bytes, there are {room}");
    }
}
