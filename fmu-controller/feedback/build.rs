//! The link options keep the library loaded.

fn main() {
    fmi2_build::link();
}
