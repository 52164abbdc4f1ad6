//! Gives the linker the memory map and the scripts of a board image; does nothing for a library build.

use std::path::PathBuf;
use std::{env, fs, io};

fn main() -> io::Result<()> {
    println!("cargo::rerun-if-changed=build.rs");
    let board = env::var_os("CARGO_FEATURE_BOARD").is_some();
    let bare_metal = env::var("CARGO_CFG_TARGET_OS").is_ok_and(|os| os == "none");
    if !(board && bare_metal) {
        return Ok(());
    }
    let folder = PathBuf::from(env::var_os("OUT_DIR").unwrap_or_default());
    for (script, source) in [("memory.x", "../../memory.x"), ("image.x", "image.x")] {
        println!("cargo::rerun-if-changed={source}");
        fs::copy(source, folder.join(script))?;
    }
    println!("cargo::rustc-link-search={}", folder.display());
    for argument in [
        "-Tlink.x",
        "-Tdefmt.x",
        "-Timage.x",
        "--nmagic",
        "--build-id=fast",
        "--icf=all",
    ] {
        println!("cargo::rustc-link-arg-bins={argument}");
    }
    // defmt leaves out of the image what is below this level, and all but errors without it.
    println!("cargo::rerun-if-env-changed=DEFMT_LOG");
    if env::var_os("DEFMT_LOG").is_none() {
        println!("cargo::rustc-env=DEFMT_LOG=info");
    }
    println!("cargo::rerun-if-env-changed=STILLPOINT_ALLOW_PANIC");
    if env::var_os("STILLPOINT_ALLOW_PANIC").is_some() {
        println!("cargo::rustc-link-arg-bins=--defsym=allow_panic=1");
    }
    Ok(())
}
