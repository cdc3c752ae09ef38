//! Tests of the saved states of every FMU: they restore an instance bit for bit, and are refused if
//! anything is wrong with them. Their use in another process is tested with the packed archives
//! (tests/test_states.py).

use crate::prelude::*;
use conformance::interface::FATAL;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// Parameters with which an instance has states of other kinds: none, a table, surfaces and sensors,
/// an entry, and a delay, which works in co-simulation only.
fn preparations(fmu: &Fmu, fmu_type: i32) -> &'static [fn(&Instance)] {
    const ALL: [fn(&Instance); 5] = [
        |_| (),
        tabulate,
        |instance| {
            let reference = instance.fmu.reference("sensor.set");
            ok!(instance, fmi2SetInteger(&reference, 1, &2));
            instance.choose("actuation", "surfacesAndJets");
        },
        |instance| instance.choose("translation", "entry"),
        |instance| {
            let reference = instance.fmu.reference("actuation.delay");
            instance.ok(instance.set_real(reference, 0.1));
        },
    ];
    match (fmu.name(), fmu_type) {
        ("ReentryPlant", CO_SIMULATION) => &ALL,
        ("ReentryPlant", _) => &ALL[..4],
        _ => &ALL[..1],
    }
}

/// Returns an instance in the middle of a simulation.
fn running(fmu: &Fmu, fmu_type: i32, prepare: fn(&Instance)) -> Instance {
    let instance = fmu.instance(fmu_type);
    prepare(&instance);
    let instance = instance.initialized();
    driver(fmu_type)(&instance, 0..4);
    instance.forget();
    instance
}

#[test]
fn handles_and_bytes_bring_back_the_same_future() {
    for (fmu, fmu_type) in fmus_and_interfaces() {
        let (drive, mut futures) = (driver(fmu_type), Vec::new());
        for &prepare in preparations(&fmu, fmu_type) {
            let instance = running(&fmu, fmu_type, prepare);
            let (mut handle, bytes) = (instance.save(), instance.serialize());
            let expected = drive(&instance, 4..12);
            assert!(!futures.contains(&expected), "{}: the parameters act", fmu.name());
            instance.restore(handle);
            assert!(drive(&instance, 4..12) == expected, "{}", fmu.name());
            // The same handle is overwritten with the present state.
            let (before, present) = (handle, instance.serialize());
            ok!(instance, fmi2GetFMUstate(&mut handle));
            assert_eq!(handle, before);
            ok!(instance, fmi2Reset());
            assert!(instance.serialize() == fmu.instance(fmu_type).serialize(), "{}", fmu.name());
            instance.restore(handle);
            assert!(instance.serialize() == present, "{}", fmu.name());
            // A state from bytes works in an instance that was never initialized.
            let other = fmu.instance(fmu_type);
            let (status, state) = other.deserialize(&bytes);
            other.ok(status);
            other.restore(state);
            assert!(drive(&other, 4..12) == expected, "{}", fmu.name());
            // Freeing sets the handle to NULL, and freeing NULL is allowed.
            ok!(instance, fmi2FreeFMUstate(&mut handle));
            assert!(handle.is_null());
            ok!(instance, fmi2FreeFMUstate(&mut handle));
            let status = c!(instance, fmi2SetFMUstate(instance.component, before));
            instance.refused(status, ERROR, &["fmi2SetFMUstate", "was freed"]);
            futures.push(expected);
        }
    }
}

#[test]
fn every_truncation_and_every_damaged_byte_is_refused() {
    for (fmu, fmu_type) in fmus_and_interfaces() {
        let instance = running(&fmu, fmu_type, |_| ());
        let bytes = instance.serialize();
        let refuse = |bytes: &[u8], what: &str| {
            let (status, state) = instance.deserialize(bytes);
            assert_eq!(status, ERROR, "{}: {what}", fmu.name());
            assert!(state.is_null(), "{}: {what}", fmu.name());
        };
        for length in 0..bytes.len() {
            refuse(&bytes[..length], &format!("cut to {length} bytes"));
        }
        let mut damaged = bytes.clone();
        for i in 0..bytes.len() {
            // One bit of each byte is changed, another one from byte to byte.
            damaged[i] ^= 1 << (i % 8);
            refuse(&damaged, &format!("byte {i} damaged"));
            damaged[i] = bytes[i];
        }
        refuse(&[bytes.as_slice(), b"x"].concat(), "one byte more");
        for message in instance.messages() {
            assert!(message.text.starts_with("fmi2DeSerializeFMUstate: "), "{}", message.text);
        }
        // None of these attempts left a trace.
        assert!(instance.serialize() == bytes, "{}", fmu.name());
        driver(fmu_type)(&instance, 4..6);
    }
}

#[test]
fn states_of_other_fmus_and_interfaces_are_refused() {
    let fmus = fmus();
    let kinds = fmus.iter().flat_map(|fmu| fmu.interfaces().iter().map(move |&kind| (fmu, kind)));
    let instances: Vec<_> = kinds.map(|(fmu, kind)| running(fmu, kind, |_| ())).collect();
    for (i, instance) in instances.iter().enumerate() {
        let (component, before) = (instance.component, instance.serialize());
        for (_, other) in instances.iter().enumerate().filter(|&(j, _)| j != i) {
            let part = if instance.fmu.guid() == other.fmu.guid() {
                "other interface"
            } else {
                "with GUID"
            };
            instance.refused(instance.deserialize(&other.serialize()).0, ERROR, &[part]);
            // A handle of another instance is refused too, whatever its FMU.
            let mut foreign = other.save();
            let refused = |status| instance.refused(status, ERROR, &["not made by this instance"]);
            refused(c!(instance, fmi2SetFMUstate(component, foreign)));
            refused(c!(instance, fmi2FreeFMUstate(component, &mut { foreign })));
            refused(c!(instance, fmi2GetFMUstate(component, &mut { foreign })));
            refused(c!(instance, fmi2SerializedFMUstateSize(component, foreign, &mut 0)));
            ok!(other, fmi2FreeFMUstate(&mut foreign));
        }
        assert!(instance.serialize() == before, "{}", instance.fmu.name());
    }
}

#[test]
fn bytes_fill_the_room_that_was_asked_for_and_no_more() {
    for fmu in fmus() {
        let instance = running(&fmu, CO_SIMULATION, |_| ());
        let (state, component, bytes) = (instance.save(), instance.component, instance.serialize());
        let mut room = vec![0xaa_u8; bytes.len() + 16];
        let mut serialize = |size| {
            let status = c!(
                instance,
                fmi2SerializeFMUstate(component, state, room.as_mut_ptr().cast(), size)
            );
            (status, room.clone())
        };
        for size in [0, 1, bytes.len() - 1] {
            let (status, room) = serialize(size);
            instance.refused(
                status,
                ERROR,
                &["fmi2SerializeFMUstate", &format!("room for {size} bytes")],
            );
            assert!(room.iter().all(|&byte| byte == 0xaa));
        }
        let (status, room) = serialize(bytes.len() + 16);
        instance.ok(status);
        assert!(room == [bytes.as_slice(), &[0xaa; 16]].concat(), "{}", fmu.name());
    }
}

/// CRC-32 as used in zip files.
fn checksum(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc: u32, _| {
            (crc >> 1) ^ (0xedb8_8320 & (crc & 1).wrapping_neg())
        })
    })
}

/// Length of the header, whose last four bytes are the checksum of the rest.
const HEADER: usize = 61;

/// Restores each forgery and, where the instance accepts it, continues with steps. `doing` holds a
/// description of the last attempt. Returns the number of forgeries accepted.
fn survive_forgeries(
    fmu: &Fmu,
    fmu_type: i32,
    prepare: fn(&Instance),
    doing: &Mutex<String>,
) -> usize {
    let instance = fmu.instance(fmu_type);
    prepare(&instance);
    let instance = instance.initialized();
    let drive = driver(fmu_type);
    drive(&instance, 0..7);
    let (genuine, component) = (instance.serialize(), instance.component);
    let results =
        fmu.references(|v| v.is_calculated() && matches!(v.kind, VariableKind::Real { .. }));
    let h = fmu.description.default_experiment.step;
    let (mut values, mut taken) = (vec![0.0; results.len()], 0);
    let replacements: [[u8; 8]; 9] = [
        f64::NAN.to_le_bytes(),
        f64::INFINITY.to_le_bytes(),
        1e308_f64.to_le_bytes(),
        (-1e308_f64).to_le_bytes(),
        1e15_f64.to_le_bytes(),
        (-1.0_f64).to_le_bytes(),
        1e-300_f64.to_le_bytes(),
        [0; 8],
        [0xff; 8],
    ];
    let length = genuine.len() - HEADER;
    let stride = length.div_ceil(FORGERIES / (replacements.len() + 2)).max(1);
    for offset in (0..length).step_by(stride) {
        let at = HEADER + offset;
        let overwritten = replacements.iter().map(|replacement| {
            let mut bytes = genuine.clone();
            let end = (at + 8).min(bytes.len());
            bytes[at..end].copy_from_slice(&replacement[..end - at]);
            bytes
        });
        let flipped = [0x01, 0x80].into_iter().map(|bit| {
            let mut bytes = genuine.clone();
            bytes[at] ^= bit;
            bytes
        });
        for (kind, mut bytes) in overwritten.chain(flipped).enumerate() {
            *doing.lock().unwrap() =
                format!("{}: byte {offset} of {length}, forgery {kind}", fmu.name());
            let sum = checksum(&bytes[HEADER..]).to_le_bytes();
            bytes[HEADER - 4..HEADER].copy_from_slice(&sum);
            let (status, mut state) = instance.deserialize(&bytes);
            instance.ok(status);
            let status = c!(instance, fmi2SetFMUstate(component, state));
            assert!(status == OK || status == ERROR, "{}", doing.lock().unwrap());
            ok!(instance, fmi2FreeFMUstate(&mut state));
            if status == OK {
                taken += 1;
                let mut time = 7.0 * h;
                for _ in 0..3 {
                    let (pointer, n) = (results.as_ptr(), results.len());
                    let got = c!(instance, fmi2GetReal(component, pointer, n, values.as_mut_ptr()));
                    let stepped = c!(instance, fmi2DoStep(component, time, h, 1));
                    assert!(got != FATAL && stepped != FATAL, "{}", doing.lock().unwrap());
                    time += h;
                }
            }
            ok!(instance, fmi2Reset());
            instance.forget();
        }
    }
    taken
}

/// Sets a table of the disturbance that repeats and jumps between the communication points.
fn tabulate(instance: &Instance) {
    let reference = |name: &str| instance.fmu.reference(&format!("disturbance.{name}"));
    instance.choose("disturbance.kind", "table");
    ok!(instance, fmi2SetInteger(&reference("table.rows"), 1, &3));
    for (name, value) in [
        ("start", 0.05),
        ("table.period", 0.21),
        ("table.time[1]", 0.013),
        ("table.alpha[1]", 1.0),
        ("table.sigma[1]", -0.3),
        ("table.time[2]", 0.1),
        ("table.beta[2]", -1.0),
        ("table.time[3]", 0.17),
        ("table.alpha[3]", -0.6),
    ] {
        instance.ok(instance.set_real(reference(name), value));
    }
}

/// Approximate number of forgeries for each FMU.
const FORGERIES: usize = 6000;

#[test]
fn forged_states_neither_hang_nor_panic() {
    for fmu in fmus() {
        for &prepare in preparations(&fmu, CO_SIMULATION) {
            let doing = Arc::new(Mutex::new(String::new()));
            let (done, finished) = channel();
            let (name, fmu, shared) = (fmu.name().to_owned(), fmu.clone(), doing.clone());
            let thread = std::thread::spawn(move || {
                let taken = survive_forgeries(&fmu, CO_SIMULATION, prepare, &shared);
                let _ = done.send(taken);
            });
            let mut last = String::new();
            let taken = loop {
                match finished.recv_timeout(Duration::from_secs(20)) {
                    Ok(taken) => break taken,
                    Err(RecvTimeoutError::Disconnected) => {
                        thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
                        panic!("{name} ended without a word");
                    }
                    Err(RecvTimeoutError::Timeout) => {
                        let now = doing.lock().unwrap().clone();
                        assert_ne!(now, last, "it hangs");
                        last = now;
                    }
                }
            };
            println!("{name}: {taken} forgeries were taken");
        }
    }
}
