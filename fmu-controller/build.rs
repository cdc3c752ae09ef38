//! Keeps the library loaded.

fn main() {
    fmi2_build::link();
}
