//! Links the library so that it stays loaded.

fn main() {
    fmi2_build::link();
}
