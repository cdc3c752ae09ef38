//! The link options keep the library loaded.

fn main() {
    fmi_build::link();
}
