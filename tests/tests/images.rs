//! Size, panics and stack of the linked images, which `cargo image-qemu` and `cargo image-f405` build.

use stillpoint_tests::image::Image;

/// What the controller's image may take.
const FLASH_BYTES: u32 = 64 * 1024;
const RAM_BYTES: u32 = 48 * 1024;

fn stack_bytes(image: &Image) -> u32 {
    image
        .stack_bound()
        .unwrap_or_else(|error| panic!("no bound of the stack: {error}"))
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
    assert!(flash <= FLASH_BYTES, "{flash} bytes of flash");
    assert!(ram + stack <= RAM_BYTES, "{ram} + {stack} bytes of RAM");
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
