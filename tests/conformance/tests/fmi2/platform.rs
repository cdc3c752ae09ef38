//! Tests that the FMUs give the same bits on every platform.

use conformance::library;
use object::{File, Object};
use std::collections::BTreeSet;
use std::fs;
use std::process::Command;

/// Functions of C whose last digit differs between libraries.
const ELEMENTARY: &str = "acos acosh asin asinh atan atan2 atanh cbrt cos cosh exp exp10 exp2 expm1 fma \
                          hypot log log10 log1p log2 pow sin sincos sincos_stret sinh tan tanh";

/// Elementary functions that a built library takes from the platform.
fn taken_from_the_platform(krate: &str) -> BTreeSet<&'static str> {
    let bytes = fs::read(library(krate)).unwrap();
    let file = File::parse(&*bytes).unwrap();
    let imports: Vec<_> = file.imports().unwrap();
    assert!(!imports.is_empty(), "{krate} imports nothing at all");
    let plain = |name: &[u8]| {
        // Mach-O puts underscores in front.
        String::from_utf8_lossy(name).trim_start_matches('_').to_owned()
    };
    let names: BTreeSet<_> = imports.iter().map(|import| plain(import.name())).collect();
    let is_taken =
        |function: &str| names.contains(function) || names.contains(&format!("{function}f"));
    ELEMENTARY.split(' ').filter(|function| is_taken(function)).collect()
}

#[test]
fn fmus_without_a_solver_take_no_elementary_function_from_the_platform() {
    for library in ["fmu_plant_library", "fmu_feedback"] {
        assert_eq!(taken_from_the_platform(library), BTreeSet::new(), "{library}");
    }
}

/// Clarabel's cones of exponentials and powers call these three. No optimisation here has such
/// cones (control/tests/platform_functions.rs).
#[test]
fn fmus_with_a_solver_take_no_other_elementary_function_from_the_platform() {
    let of_clarabel = BTreeSet::from(["exp", "log", "pow"]);
    let taken = taken_from_the_platform("fmu_optimising");
    assert!(taken.is_subset(&of_clarabel), "{taken:?}");
}

/// `matrixmultiply`, which nalgebra brings by default, picks its kernels by the processor.
#[test]
fn no_library_has_kernels_that_are_chosen_by_the_processor() {
    let mut cargo = Command::new(env!("CARGO"));
    cargo.args(["tree", "--locked", "--offline", "--edges", "normal", "--prefix", "none"]);
    for library in ["plant-library", "optimising", "feedback"] {
        cargo.arg("--package").arg(format!("reentry-fmu-{library}"));
    }
    let tree = cargo.output().unwrap();
    assert!(tree.status.success(), "{}", String::from_utf8_lossy(&tree.stderr));
    let tree = String::from_utf8(tree.stdout).unwrap();
    assert!(tree.lines().any(|line| line.starts_with("nalgebra v")), "{tree}");
    assert!(!tree.contains("matrixmultiply"), "{tree}");
}
