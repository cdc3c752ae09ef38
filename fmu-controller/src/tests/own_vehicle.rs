//! Guidance and allocator with a vehicle from a file.

use super::{Held, ready, refusal};
use crate::allocator::ControlAllocator;
use crate::guidance::EntryGuidance;
use fmi_export::{LastEvent, Model};
use nalgebra::Vector3;
use vehicle::Vehicle;

/// Path of the example that docs/vehicle.md explains.
const EXAMPLE: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../orchestrator/experiments/entry/vehicles/lifting-body.toml"
);

fn allocator(change: impl FnOnce(&mut ControlAllocator)) -> ControlAllocator {
    ready(|allocator: &mut ControlAllocator| {
        allocator.own.file = EXAMPLE.into();
        allocator.command.mach = 5.0;
        allocator.command.alpha = 0.4;
        change(allocator);
    })
}

#[test]
fn the_guidance_flies_the_vehicle_of_the_file() {
    let command = |file: &str| {
        let mut guidance = ready(|guidance: &mut EntryGuidance| guidance.own.file = file.into());
        guidance.calculate(0.0, LastEvent::InputSet).unwrap();
        guidance.output.command.bank
    };
    let (built_in, own) = (command(""), command(EXAMPLE));
    assert!(built_in != own && (built_in - own).abs() < 0.2, "{built_in} {own}");
}

#[test]
fn oracle_the_allocator_gives_the_moment_by_the_tables_of_the_surfaces() {
    let moment = Vector3::new(2e3, -8e3, 0.0);
    let mut allocator = allocator(|allocator| allocator.command.moment = moment);
    for tick in 0..100 {
        let (from, to) = (0.01 * f64::from(tick), 0.01 * f64::from(tick + 1));
        allocator.step(from, to, &Held, &mut |_| {}).unwrap();
        allocator.calculate(to, LastEvent::Step).unwrap();
    }
    assert!(allocator.output.residual.norm() < 1.0, "{}", allocator.output.residual);
    // The same moment by the data of the file.
    let vehicle = Vehicle::from_toml(EXAMPLE, &std::fs::read_to_string(EXAMPLE).unwrap()).unwrap();
    let effectors = vehicle.effectors.unwrap();
    let flow = allocator.command.flow();
    let surfaces = allocator.output.surfaces;
    let by_surfaces = effectors.effectiveness_at(flow.dynamic_pressure) * surfaces
        + effectors.moment_of_tables(&flow, &surfaces);
    assert!((by_surfaces - allocator.output.by_surfaces).amax() < 1e-9);
    assert!(surfaces[2].abs() > 0.01, "the flap has a table only");
    assert!((by_surfaces + effectors.moment_of_jets(&allocator.output.duty) - moment).norm() < 1.0);
}

#[test]
fn what_a_file_leaves_without_effect_is_refused() {
    let set = |change: fn(&mut ControlAllocator)| {
        refusal(|allocator: &mut ControlAllocator| {
            allocator.own.file = EXAMPLE.into();
            change(allocator);
        })
    };
    assert_eq!(set(|_| {}), "");
    let text = set(|allocator| allocator.own.file = "no-such.toml".into());
    assert!(text.starts_with("vehicle.file: no-such.toml: "), "{text}");
    let mut blind = allocator(|allocator| allocator.command.mach = 0.0);
    blind.calculate(0.0, LastEvent::Initialization).unwrap();
    let text = blind.step(0.0, 0.1, &Held, &mut |_| {}).unwrap_err().to_string();
    assert!(text.contains("connect flow.mach"), "{text}");
}
