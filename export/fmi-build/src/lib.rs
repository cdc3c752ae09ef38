//! Build script of a crate whose library exports FMUs. The script's `main` calls [`link`].

mod exports;
mod sources;

use std::env;
use std::path::PathBuf;

/// Sets the options of the compiler and the linker for the library of an FMU:
///
/// - On Linux the library is never unloaded, because thread-local destructors of a Rust library
///   crash a host that unloads it before the thread ends.
/// - On Windows the linker gets the list of exported functions as a separate file, because cross
///   linkers lose the list of rustc and then export everything.
/// - The digest of all sources of the library goes into it, so that `fmu-pack` can tell whether
///   libraries for several platforms belong together.
///
/// # Panics
/// Panics if cargo does not run this, or if the export list cannot be written.
pub fn link() {
    println!("cargo::rerun-if-changed=build.rs");
    let target = |part| env::var(format!("CARGO_CFG_TARGET_{part}")).unwrap_or_default();
    match (target("OS").as_str(), target("ENV").as_str()) {
        ("linux", _) => println!("cargo::rustc-link-arg-cdylib=-Wl,-z,nodelete"),
        ("windows", "gnu") => {
            let folder = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
            let file = folder.join("fmi.def");
            exports::write(&file).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
            println!("cargo::rustc-link-arg-cdylib={}", file.display());
        }
        _ => {}
    }
    match sources::digest() {
        Ok(digest) => println!("cargo::rustc-env=FMI2_SOURCES={digest}"),
        Err(problem) => {
            // Cargo regards a file that does not exist as changed, so the next build tries again.
            println!("cargo::rerun-if-changed=no-digest-of-the-sources");
            println!("cargo::warning=the library contains no digest of its sources: {problem}");
        }
    }
}
