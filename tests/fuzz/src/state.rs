//! Saved states that were changed.

use crate::bytes::{Bytes, fmu};
use conformance::c;
use conformance::interface::{CO_SIMULATION, DISCARD, ERROR, OK};

/// Bytes of a saved state before its content, the last of which are its length and checksum.
const HEADER: usize = 61;

/// Gives an instance a saved state that was changed, with a checksum that fits. The instance must
/// either refuse it or continue from it as from any other.
pub fn state(data: &[u8]) {
    let mut bytes = Bytes(data);
    let fmu = fmu(&mut bytes);
    let instance = fmu.instance(CO_SIMULATION).initialized();
    let step = fmu.description.default_experiment.step;
    for tick in 0..bytes.byte() % 4 {
        instance.ok(instance.step(f64::from(tick) * step, step));
    }
    let mut header = instance.serialize();
    let mut content = header.split_off(HEADER);
    let saved = content.clone();
    while !bytes.0.is_empty() {
        let place = bytes.below(content.len());
        match bytes.byte() % 8 {
            0 => drop(content.remove(place)),
            1 => content.insert(place, bytes.byte()),
            2 => content.truncate(place.max(1)),
            3 => {
                let value = bytes.real().to_le_bytes();
                content.splice(place..(place + 8).min(content.len()), value);
            }
            _ => content[place] = bytes.byte(),
        }
        if content.is_empty() {
            return;
        }
    }
    let length = (content.len() as u64).to_le_bytes();
    let checksum = crc32fast::hash(&content).to_le_bytes();
    let whole = [&header[..HEADER - 12], &length, &checksum, &content].concat();
    let (status, handle) = instance.deserialize(&whole);
    instance.ok(status);
    let component = instance.component;
    let restored = c!(instance, fmi2SetFMUstate(component, handle));
    assert!([OK, ERROR].contains(&restored), "{}: {restored}", fmu.name());
    assert!(restored == OK || content != saved, "{}: an unchanged state is refused", fmu.name());
    if restored == ERROR {
        // The instance is as it was.
        let wrong = instance.wrong_value();
        assert!(wrong.is_none(), "{}: {wrong:?}", fmu.name());
        return;
    }
    let mut time = 0.0;
    if c!(instance, fmi2GetRealStatus(component, 2, &raw mut time)) != OK {
        return;
    }
    for tick in 0..3 {
        let status = instance.step(time + f64::from(tick) * step, step);
        assert!([OK, ERROR, DISCARD].contains(&status), "{}: {status}", fmu.name());
        if status != OK {
            return;
        }
        let wrong = instance.wrong_value();
        assert!(wrong.is_none(), "{}: {wrong:?}", fmu.name());
    }
}
