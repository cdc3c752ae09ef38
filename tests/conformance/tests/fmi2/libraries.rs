//! Tests of the libraries themselves.

use crate::prelude::*;
use std::process::Command;

#[test]
fn both_libraries_have_every_function_and_say_what_they_are() {
    for fmu in fmus() {
        let texts = [c!(fmu, fmi2GetVersion()), c!(fmu, fmi2GetTypesPlatform())];
        // SAFETY: both functions return static NUL-terminated texts of the library.
        #[allow(unsafe_code)]
        let texts = texts.map(|text| unsafe { CStr::from_ptr(text) });
        assert_eq!(texts, [c"2.0", c"default"]);
    }
}

#[test]
fn the_guid_selects_the_fmu() {
    let fmus = fmus();
    assert_eq!(fmus.len(), 13);
    for fmu in &fmus {
        let same = fmus.iter().filter(|other| other.guid() == fmu.guid()).count();
        assert_eq!(same, 1, "{}", fmu.name());
        // A saved state names the FMU to which it belongs.
        let state = fmu.instance(CO_SIMULATION).serialize();
        let guid = fmu.guid().to_bytes();
        assert!(state.windows(guid.len()).any(|part| part == guid), "{}", fmu.name());
    }
}

#[test]
fn nothing_is_printed() {
    let tour = Command::new(env!("CARGO_BIN_EXE_tour")).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    assert!(tour.status.success(), "{}", text(&tour.stderr));
    assert_eq!((text(&tour.stdout), text(&tour.stderr)), (String::new(), String::new()));
}
