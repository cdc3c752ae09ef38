//! Test that instances and libraries that come and go leave nothing behind. It is alone in its
//! process, so that no other test's memory is counted.
#![cfg(all(target_os = "linux", target_env = "gnu"))]

use conformance::interface::CO_SIMULATION;
use conformance::{Instance, fmus, fmus_and_interfaces};

/// Bytes that the C library's allocator handed out and did not get back. Rust's allocations go
/// through it too. Resident memory would also count its free lists, which grow irregularly.
#[expect(unsafe_code, reason = "a call of the C library without arguments")]
fn in_use() -> usize {
    // SAFETY: mallinfo2 has no preconditions; it reads the allocator's own counters under its
    // locks.
    let info = unsafe { libc::mallinfo2() };
    info.uordblks + info.hblkhd
}

/// Bytes that may remain. The smallest block takes 32 bytes, so one lost per library would be 9600
/// and one per instance 96000. Without losses none or two blocks remain.
const ALLOWED: usize = 4 << 10;

/// Bytes that `cycles` repetitions leave in use after `warm_up` repetitions, which fill what is
/// allocated once and kept.
fn growth(warm_up: usize, cycles: usize, mut cycle: impl FnMut(usize)) -> usize {
    (0..warm_up).for_each(&mut cycle);
    let before = in_use();
    (0..cycles).for_each(&mut cycle);
    in_use().saturating_sub(before)
}

/// Runs an instance from instantiation to a first step with its outputs, and a saved state that the
/// importer does not free.
fn live(instance: Instance) {
    let instance = instance.initialized();
    instance.drive(0..1);
    instance.save();
}

#[test]
fn three_thousand_instances_and_three_hundred_libraries_leave_nothing_behind() {
    let fmus = fmus();
    let kinds: Vec<_> = fmus_and_interfaces().collect();
    let instances = growth(300, 3000, |i| {
        let &(ref fmu, fmu_type) = &kinds[i % kinds.len()];
        match fmu_type {
            CO_SIMULATION => live(fmu.instance(fmu_type)),
            _ => drop(fmu.instance(fmu_type).initialized().integrate(0..1)),
        }
    });
    assert!(instances < ALLOWED, "3000 instances have left {instances} bytes");
    let names: Vec<_> = fmus.iter().map(|fmu| fmu.name().to_owned()).collect();
    drop((fmus, kinds));
    let libraries = growth(60, 300, |i| {
        let name = names[i % names.len()].clone();
        // The thread ends after the libraries are closed, and releases their memory.
        std::thread::spawn(move || live(conformance::fmu(&name).instance(CO_SIMULATION)))
            .join()
            .unwrap();
    });
    assert!(libraries < ALLOWED, "300 libraries have left {libraries} bytes");
}
