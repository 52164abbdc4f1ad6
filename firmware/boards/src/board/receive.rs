//! The receive interrupt: from the port into the queue of the idle loop.

use core::sync::atomic::{AtomicU32, Ordering};

use heapless::spsc::Producer;

use super::uart::Receiver;

/// Bytes lost before the link, and not counted by it yet.
static LOST: AtomicU32 = AtomicU32::new(0);

/// Takes a byte. Lost are one that the port had no room for, and one that the queue has none for: it
/// was sent against the protocol. The check sum of its frame tells that one is missing, the count why.
#[inline]
pub fn receive(receiver: &mut Receiver, bytes: &mut Producer<'static, u8>) {
    let (byte, overrun) = receiver.take();
    let refused = byte.is_some_and(|byte| bytes.enqueue(byte).is_err());
    if overrun || refused {
        let lost = u32::from(overrun) + u32::from(refused);
        LOST.fetch_add(lost, Ordering::Relaxed);
    }
}

/// Bytes lost since the last call.
pub fn take_lost() -> u32 {
    LOST.swap(0, Ordering::Relaxed)
}
