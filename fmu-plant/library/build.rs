//! Links the library so that it stays loaded.

fn main() {
    fmi_build::link();
}
