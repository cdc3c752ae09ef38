//! Tests of the program `fmu-pack` from outside: its exit codes and messages.

use std::process::{Command, Output};

fn fmu_pack(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_fmu-pack")).args(arguments).output().unwrap()
}

#[test]
fn the_exit_code_says_who_is_at_fault() {
    let cases: [(&[&str], i32, &str); 6] = [
        (&["--help"], 0, "--xml-snapshot"),
        (&[], 2, "Usage"),
        (&["lib.so"], 2, "--output"),
        (&["lib.so", "--output"], 2, "--output"),
        (&["lib.so", "--outptu", "x"], 2, "--outptu"),
        (&["/no/such/library.so", "--output", "."], 1, "/no/such/library.so"),
    ];
    for (arguments, code, text) in cases {
        let output = fmu_pack(arguments);
        assert_eq!(output.status.code(), Some(code), "{arguments:?}");
        let said = [output.stdout, output.stderr].concat();
        assert!(String::from_utf8_lossy(&said).contains(text), "{arguments:?}");
    }
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
