//! Keeps the library loaded.

fn main() {
    fmi_build::link();
}
