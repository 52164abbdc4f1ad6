//! The linker's hash of the image.

unsafe extern "C" {
    /// An ELF note: sizes of name and content, type, "GNU\0", 8 bytes of hash. Placed by image.x.
    #[link_name = "__build_id"]
    static NOTE: [u32; 6];
}

/// Identifies this very image, as `hello` reports it; the first 16 digits of `readelf -n`.
pub fn build_id() -> u64 {
    // SAFETY: image.x puts the symbol at the start of a note of this size (`--build-id=fast`),
    // aligned to 4, in flash.
    let [.., high, low] = unsafe { NOTE };
    u64::from(high.swap_bytes()) << 32 | u64::from(low.swap_bytes())
}
