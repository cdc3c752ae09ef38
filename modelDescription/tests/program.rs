//! Tests of the program `fmu-pack` from outside: its exit codes and messages.

use std::process::{Command, Output};

fn fmu_pack(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_fmu-pack")).args(arguments).output().unwrap()
}

#[test]
fn help_is_no_error() {
    let output = fmu_pack(&["--help"]);
    assert_eq!(output.status.code(), Some(0));
    assert!(String::from_utf8_lossy(&output.stdout).contains("--xml-snapshot"));
}

#[test]
fn a_wrong_command_line_ends_with_2() {
    for arguments in [&[][..], &["lib.so"], &["lib.so", "--output"], &["lib.so", "--outptu", "x"]] {
        assert_eq!(fmu_pack(arguments).status.code(), Some(2), "{arguments:?}");
    }
}

#[test]
fn a_wrong_library_ends_with_1_and_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().to_str().unwrap();
    let missing = fmu_pack(&["/no/such/library.so", "--output", output]);
    assert_eq!(missing.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&missing.stderr).contains("/no/such/library.so"));
}

#[test]
#[cfg(target_os = "linux")]
fn a_library_without_fmus_is_refused_with_instructions() {
    let folder = tempfile::tempdir().unwrap();
    // The library is certain to exist, because this test itself runs with it.
    let maps = std::fs::read_to_string("/proc/self/maps").unwrap();
    let Some(library) = maps.split_whitespace().find(|path| path.contains("libc.so")) else {
        return;
    };
    let output = fmu_pack(&[library, "--output", folder.path().to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&output.stderr).contains("export_fmus!"));
}
