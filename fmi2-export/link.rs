//! Build script of every crate that makes an FMU library: `build = "../fmi2-export/link.rs"` in its manifest.

fn main() {
    println!("cargo::rerun-if-changed=../fmi2-export/link.rs");
    if std::env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("linux") {
        // Thread-local destructors of a Rust library crash a host that unloads it before the thread ends.
        println!("cargo::rustc-link-arg-cdylib=-Wl,-z,nodelete");
    }
}
