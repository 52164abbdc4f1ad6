//! Frames of a log: bytes between zeros, encoded by reverse zero-compressing COBS.
//!
//! Source: `rzcobs`, as `defmt` uses it. Read from its end, a frame is a row of codes, each followed by the bytes that it
//! counts:
//!
//! | code | stands for |
//! |---|---|
//! | 0xxxxxxx | seven bytes, for every set bit a zero; the highest bit of the seven is the last byte |
//! | 1nnnnnnn | a zero, before it n + 7 bytes |
//! | 11111111 | 134 bytes |

/// Longest frame that is waited for; no board writes one as long.
const MAX_BYTES: usize = 1024;

/// Takes bytes as they come, and gives frames.
#[derive(Default)]
pub(super) struct Frames {
    bytes: Vec<u8>,
}

impl Frames {
    /// Takes a byte; returns the frame that it ends, or `Err` where that is damaged.
    pub(super) fn feed(&mut self, byte: u8) -> Option<Result<Vec<u8>, Damaged>> {
        if byte != 0 {
            if self.bytes.len() < MAX_BYTES {
                self.bytes.push(byte);
            }
            return None;
        }
        let frame = std::mem::take(&mut self.bytes);
        let decoded = decode(&frame).filter(|_| frame.len() < MAX_BYTES);
        (!frame.is_empty()).then_some(decoded.ok_or(Damaged))
    }
}

/// A frame is damaged.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Damaged;

fn decode(frame: &[u8]) -> Option<Vec<u8>> {
    let mut rest = frame.iter().rev();
    let mut decoded = Vec::new();
    while let Some(&code) = rest.next() {
        let (zeros, count) = match code {
            0xff => (0, 134),
            0x80.. => (1, usize::from(code & 0x7f) + 7),
            _ => {
                for bit in (0..7).rev() {
                    let is_zero = code & 1 << bit != 0;
                    decoded.push(if is_zero { 0 } else { *rest.next()? });
                }
                continue;
            }
        };
        decoded.resize(decoded.len() + zeros, 0);
        for _ in 0..count {
            decoded.push(*rest.next()?);
        }
    }
    decoded.reverse();
    Some(decoded)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fed(bytes: &[u8]) -> Vec<Result<Vec<u8>, Damaged>> {
        let mut frames = Frames::default();
        bytes.iter().filter_map(|&b| frames.feed(b)).collect()
    }

    /// By the table above, by hand.
    #[test]
    fn frames_are_decoded() {
        for (encoded, decoded) in [
            (
                &[9, 8, 7, 6, 5, 4, 3, 0x80][..],
                Ok(vec![9, 8, 7, 6, 5, 4, 3, 0]),
            ),
            (&[0x7f], Ok(vec![0; 7])),
            // Zeros first and last: bits 0 and 6.
            (
                &[0x11, 0x22, 0x33, 0x44, 0x55, 0b100_0001],
                Ok(vec![0, 0x11, 0x22, 0x33, 0x44, 0x55, 0]),
            ),
            // A byte is missing.
            (&[0x11, 0x22, 0x33, 0x44, 0b100_0001], Err(Damaged)),
            (&[1, 2, 0x80], Err(Damaged)),
            (&[0x7f; MAX_BYTES], Err(Damaged)),
        ] {
            // Zeros between frames are none.
            let bytes = [&[0, 0], encoded, &[0]].concat();
            assert_eq!(fed(&bytes), [decoded], "{encoded:x?}");
        }
        let long: Vec<u8> = (0..134).map(|i| i % 100 + 1).collect();
        assert_eq!(fed(&[&long[..], &[0xff, 0]].concat()), [Ok(long)]);
    }
}
