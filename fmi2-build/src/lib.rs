//! What the build script of a crate must say whose library is exported as FMI 2.0 units. Its `main`
//! calls [`link`].

/// Tells the linker to keep the library loaded once it is: thread-local destructors of a Rust
/// library crash a host that unloads it before the thread ends.
pub fn link() {
    println!("cargo::rerun-if-changed=build.rs");
    if std::env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("linux") {
        println!("cargo::rustc-link-arg-cdylib=-Wl,-z,nodelete");
    }
}
