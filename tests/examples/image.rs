//! What a linked board image takes, and along which calls its stack gets deepest:
//!
//!     cargo run --release -p stillpoint-tests --example image [BOARD]

use stillpoint_tests::image::{Image, StackError};

fn main() -> Result<(), StackError> {
    let board = std::env::args().nth(1).unwrap_or("f405".to_owned());
    let image = Image::of(&board);
    println!("{board}: {} bytes of flash", image.flash_bytes());
    let (ram, stack) = (image.static_ram_bytes(), image.stack_bound()?);
    println!("{ram} + {stack} = {} bytes of RAM", ram + stack);
    for handler in Image::LEVELS {
        let used = image.stack_of(handler)?;
        println!("\n{handler}: {} bytes of stack", used.bytes);
        for (function, bytes) in used.path {
            println!("{bytes:6}  {function}");
        }
    }
    Ok(())
}
