//! Log frames over SEGGER's real-time transfer: a ring in RAM that the debug probe reads by itself.
//!
//! A frame that does not fit is dropped as a whole. Nothing waits for the probe.

use core::cell::UnsafeCell;
use core::sync::atomic::{AtomicU32, Ordering};

/// Bytes of the ring, one of which stays free.
const CAPACITY: u32 = 256;

/// Control block as the probe's software expects it: it searches RAM for `id`.
#[repr(C)]
struct Control {
    id: [u8; 16],
    up_channels: u32,
    down_channels: u32,
    up: Channel,
}

#[repr(C)]
struct Channel {
    name: &'static [u8; 6],
    ring: &'static Ring,
    capacity: u32,
    written: AtomicU32,
    /// Moved by the probe.
    read: AtomicU32,
    /// 0: skip what does not fit.
    mode: AtomicU32,
}

struct Ring(UnsafeCell<[u8; CAPACITY as usize]>);

// SAFETY: written in thread mode only (see log.rs), read by the probe.
unsafe impl Sync for Ring {}

static RING: Ring = Ring(UnsafeCell::new([0; CAPACITY as usize]));

#[unsafe(no_mangle)]
static _SEGGER_RTT: Control = Control {
    id: *b"SEGGER RTT\0\0\0\0\0\0",
    up_channels: 1,
    down_channels: 0,
    up: Channel {
        name: b"defmt\0",
        ring: &RING,
        capacity: CAPACITY,
        written: AtomicU32::new(0),
        read: AtomicU32::new(0),
        mode: AtomicU32::new(0),
    },
};

/// Where the frame at hand ends so far; `CAPACITY` if it did not fit. Moved in thread mode only.
static END: AtomicU32 = AtomicU32::new(0);

const fn after(index: u32) -> u32 {
    if index + 1 < CAPACITY { index + 1 } else { 0 }
}

/// Adds bytes to the frame at hand.
pub fn write(bytes: &[u8]) {
    let read = _SEGGER_RTT.up.read.load(Ordering::Acquire);
    let mut end = END.load(Ordering::Relaxed);
    for &byte in bytes {
        let next = after(end);
        if end >= CAPACITY || next == read {
            end = CAPACITY;
            break;
        }
        // SAFETY: thread mode is the only writer, and the probe does not read what is not published
        // yet.
        if let Some(free) = unsafe { &mut *RING.0.get() }.get_mut(end as usize) {
            *free = byte;
        }
        end = next;
    }
    END.store(end, Ordering::Relaxed);
}

/// Publishes the frame, or drops it if it did not fit.
pub fn end_of_frame() {
    let written = &_SEGGER_RTT.up.written;
    let end = END.load(Ordering::Relaxed);
    if end < CAPACITY {
        written.store(end, Ordering::Release);
    } else {
        END.store(written.load(Ordering::Relaxed), Ordering::Relaxed);
    }
}
