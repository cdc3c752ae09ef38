//! Tests of the libraries themselves.

use conformance::interface::CO_SIMULATION;
use conformance::{c, units};
use std::ffi::CStr;
use std::process::Command;

#[test]
fn both_libraries_have_every_function_and_say_what_they_are() {
    for unit in units() {
        let texts = [c!(unit, fmi2GetVersion()), c!(unit, fmi2GetTypesPlatform())];
        // SAFETY: both functions return static NUL-terminated texts of the library.
        #[allow(unsafe_code)]
        let texts = texts.map(|text| unsafe { CStr::from_ptr(text) });
        assert_eq!(texts, [c"2.0", c"default"]);
    }
}

#[test]
fn the_guid_picks_the_unit() {
    let units = units();
    assert_eq!(units.len(), 11);
    for unit in &units {
        assert_eq!(
            units.iter().filter(|other| other.guid() == unit.guid()).count(),
            1,
            "{}",
            unit.name()
        );
        // A saved state tells to which unit it belongs.
        let state = unit.instance(CO_SIMULATION).serialize();
        let guid = unit.guid().to_bytes();
        assert!(state.windows(guid.len()).any(|part| part == guid), "{}", unit.name());
    }
}

#[test]
fn nothing_is_printed() {
    let tour = Command::new(env!("CARGO_BIN_EXE_tour")).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    assert!(tour.status.success(), "{}", text(&tour.stderr));
    assert_eq!((text(&tour.stdout), text(&tour.stderr)), (String::new(), String::new()));
}
