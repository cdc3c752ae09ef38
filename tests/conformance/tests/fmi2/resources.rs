//! Tests of the resource location in every form that importers pass.
#![cfg(unix)]

use crate::prelude::*;
use conformance::fmu;
use std::ffi::CString;
use std::path::Path;

const TABLE: &str = "time_s,alpha_deg,beta_deg,sigma_deg\n0,40,0,0\n10,30,1,2\n";

/// Returns an instance in initialization mode that must read a file found only in its resources.
fn reading(fmu: &Fmu, uri: Option<&str>, file: &str) -> Instance {
    let uri = uri.map(|uri| CString::new(uri).unwrap());
    let instance = fmu.instantiate(Some(c"it"), CO_SIMULATION, Some(fmu.guid()), uri.as_deref());
    assert!(!instance.component.is_null(), "{uri:?}: {:?}", instance.messages());
    instance.choose("reference.profile", "table");
    instance.ok(instance.set_string("reference.file", &CString::new(file).unwrap()));
    instance.enter_initialization();
    instance
}

/// Returns an absolute path as seen from the working directory.
fn relative(path: &str) -> String {
    let (from, path) = (std::env::current_dir().unwrap(), Path::new(path));
    let common = from.components().zip(path.components()).take_while(|(a, b)| a == b).count();
    let up = from.components().skip(common).map(|_| "..");
    let down = path.components().skip(common).map(|part| part.as_os_str().to_str().unwrap());
    up.chain(down).collect::<Vec<_>>().join("/")
}

/// Returns a path in which every character that may be encoded is encoded.
fn percent(path: &str) -> String {
    let encode = |byte: u8| {
        if byte.is_ascii_alphanumeric() || b"/.-_".contains(&byte) {
            char::from(byte).to_string()
        } else {
            format!("%{byte:02X}")
        }
    };
    path.bytes().map(encode).collect()
}

#[test]
fn a_file_in_the_resources_is_found_whatever_the_form_of_the_location() {
    let fmu = fmu("LQR");
    let temporary = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    for name in ["plain", "with space", "Größe 100%", "再突入"] {
        let folder = temporary.path().join(name);
        std::fs::create_dir(&folder).unwrap();
        std::fs::write(folder.join("reference.csv"), TABLE).unwrap();
        let path = folder.to_str().unwrap();
        let encoded = percent(path);
        for uri in [
            format!("file://{encoded}"),
            format!("file://{encoded}/"),
            format!("file:{encoded}"),
            format!("file:///{encoded}"),
            format!("file:////{}/", &encoded[1..]),
            format!("file://localhost{encoded}"),
            format!("FILE://{encoded}"),
            format!("file:{}", percent(&relative(path))),
            path.to_string(),
            format!("{path}/"),
            relative(path),
        ] {
            let instance = reading(&fmu, Some(&uri), "reference.csv");
            let status = c!(instance, fmi2ExitInitializationMode(instance.component));
            assert_eq!(status, 0, "{uri}: {:?}", instance.messages());
            assert_eq!(
                instance.real(fmu.reference("reference.alpha")),
                40f64.to_radians(),
                "{uri}"
            );
        }
    }
}

#[test]
fn without_resources_the_missing_file_is_named() {
    let fmu = fmu("LQR");
    for uri in [None, Some("file:///nowhere"), Some("file:///"), Some("")] {
        let instance = reading(&fmu, uri, "reference.csv");
        let status = c!(instance, fmi2ExitInitializationMode(instance.component));
        instance.refused(status, ERROR, &["reference.file", "reference.csv"]);
    }
}

#[test]
fn every_fmu_takes_every_form_and_refuses_what_it_cannot_read() {
    let cases = [
        (None, None),
        (Some(c"file:///"), None),
        (Some(c"file:/nowhere"), None),
        (Some(c"file:///nowhere/"), None),
        (Some(c"file:////nowhere"), None),
        (Some(c"file:///no%20where/Gr%C3%B6%C3%9Fe"), None),
        (Some(c"nowhere/at/all"), None),
        (Some(c""), None),
        (Some(c"http://example.org/resources"), Some("'http'")),
        (Some(c"file://server/share"), Some("another machine")),
        (Some(c"file:///%FF"), Some("UTF-8")),
        (Some(c"file:///\xff"), Some("UTF-8")),
    ];
    for fmu in fmus() {
        for (uri, refusal) in cases {
            let instance = fmu.instantiate(Some(c"it"), CO_SIMULATION, Some(fmu.guid()), uri);
            match refusal {
                None => {
                    assert!(!instance.component.is_null(), "{uri:?}: {:?}", instance.messages());
                    instance.initialized().drive(0..1);
                }
                Some(part) => {
                    assert!(instance.component.is_null(), "{uri:?}");
                    instance.refused(
                        instance.messages()[0].status,
                        ERROR,
                        &["fmi2Instantiate", part],
                    );
                }
            }
        }
    }
}
