//! Square roots, by Newton's method: the board's processor has an instruction for them, which
//! `core` does not offer, and a library's are ten times as large. The same bits on host and board.

/// Square root of a number that is not negative, to two rounding errors; 0 for anything else and
/// for what is not a normal number.
pub(crate) fn square_root(value: f32) -> f32 {
    if !(f32::MIN_POSITIVE..=f32::MAX).contains(&value) {
        return 0.0;
    }
    // Half the exponent: at most 4 % wrong. Every step squares the error and halves it.
    let mut root = f32::from_bits((value.to_bits() >> 1) + 0x1fbd_1df5);
    for _ in 0..3 {
        root = 0.5 * (root + value / root);
    }
    root
}

#[cfg(test)]
mod tests {
    use super::square_root;

    #[test]
    fn the_root_of_any_number_is_within_two_rounding_errors() {
        for bits in (f32::MIN_POSITIVE.to_bits()..=f32::MAX.to_bits()).step_by(9_973) {
            let value = f32::from_bits(bits);
            let exact = f64::from(value).sqrt();
            let error = (f64::from(square_root(value)) / exact - 1.0).abs();
            assert!(
                error <= 2.0 * f64::from(f32::EPSILON) / 2.0,
                "{value}: {error}"
            );
        }
        for value in [0.0, -1.0, f32::NAN, f32::INFINITY] {
            assert_eq!(square_root(value), 0.0);
        }
    }
}
