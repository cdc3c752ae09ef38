//! Instances and libraries that come and go leave nothing behind. Alone in its process, so that nobody else's memory is counted.
#![cfg(target_os = "linux")]

use conformance::interface::CO_SIMULATION;
use conformance::{Instance, Unit, units};

/// Resident memory of this process, bytes.
fn resident() -> usize {
    let pages = std::fs::read_to_string("/proc/self/statm").unwrap();
    pages.split(' ').nth(1).unwrap().parse::<usize>().unwrap() * 4096
}

/// The smallest block that the allocator hands out takes 32 bytes: one lost per instance would be 96 kB. Of a library and its
/// thread it is the loss of 220 bytes that shows. Without losses it is a page or two.
const ALLOWED: usize = 64 << 10;

/// What `cycles` repetitions add to the resident memory, once as many as `warm_up` have filled the allocator's lists.
fn growth(warm_up: usize, cycles: usize, mut cycle: impl FnMut(usize)) -> usize {
    (0..warm_up).for_each(&mut cycle);
    let before = resident();
    (0..cycles).for_each(&mut cycle);
    resident().saturating_sub(before)
}

/// From instantiation to a first step with its outputs, and a saved state that the importer forgets.
fn live(instance: Instance) {
    let instance = instance.initialized();
    instance.drive(0..1);
    instance.save();
}

fn kinds(units: &[Unit]) -> Vec<(&Unit, i32)> {
    units.iter().flat_map(|unit| unit.interfaces().iter().map(move |&fmu_type| (unit, fmu_type))).collect()
}

#[test]
fn three_thousand_instances_and_three_hundred_libraries_leave_nothing_behind() {
    let units = units();
    let kinds = kinds(&units);
    let instances = growth(300, 3000, |i| {
        let (unit, fmu_type) = kinds[i % kinds.len()];
        match fmu_type {
            CO_SIMULATION => live(unit.instance(fmu_type)),
            _ => drop(unit.instance(fmu_type).initialized().integrate(0..1)),
        }
    });
    assert!(instances < ALLOWED, "3000 instances have left {instances} bytes");
    let names: Vec<_> = units.iter().map(|unit| unit.name().to_owned()).collect();
    drop(units);
    let libraries = growth(60, 300, |i| {
        let name = names[i % names.len()].clone();
        // The thread ends after the libraries were closed, and with it what the thread kept for them.
        std::thread::spawn(move || live(conformance::unit(&name).instance(CO_SIMULATION))).join().unwrap();
    });
    assert!(libraries < ALLOWED, "300 libraries have left {libraries} bytes");
}
