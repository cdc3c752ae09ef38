//! Loops in which the air's static moments act, of which the laws are told or not.

use control::Crmpc;
use control::controller::{Controller, Measurement};
use control::crmpc::{Constraints, Guarantee, GuaranteeStatus, Settings};
use control::lqr::{Lqr, LqrSettings};
use nalgebra::Vector3;
use vehicle::Scenario;
use vehicle::actuators::Command;
use vehicle::aerodynamics::{Aerodynamics, Flow};
use vehicle::disturbance::DisturbanceKind;
use vehicle::plant::{Input, Plant};

const PERIOD: f64 = 0.04;

/// Static moment of the papers' vehicle at 2859 Pa, trimmed at the reference's angle of attack.
fn air(vehicle: &Aerodynamics, angles: &Vector3<f64>, trim: f64, size: f64) -> Vector3<f64> {
    let flow = Flow {
        dynamic_pressure: 2859.0,
        mach: 9.8,
        speed: 3172.5,
        alpha: angles.x,
        beta: angles.y,
    };
    vehicle.moment(&flow, &Vector3::zeros(), trim) * size
}

/// Flies the scenario of Chai 2022 with static moments of this size. Calls `observe` with the
/// memory, the command and the plant at each tick.
fn fly<C: Controller>(
    law: &mut C,
    scenario: &Scenario,
    (size, is_told): (f64, bool),
    mut observe: impl FnMut(&C::Memory, f64, &Vector3<f64>, &Plant),
) {
    let vehicle = Aerodynamics::papers();
    let mut memory = law.memory();
    let mut plant = Plant::new(&scenario.config(0.01), 0.0).unwrap();
    for tick in 0..(scenario.duration / PERIOD).round() as u64 {
        let time = tick as f64 * PERIOD;
        let (angles, rates) = (plant.angles(), plant.rates());
        let trim = scenario.reference.at(time).angles.x;
        let acting = air(&vehicle, &angles, trim, size);
        let known_moment = if is_told { acting } else { Vector3::zeros() };
        let measured = Measurement { angles, rates, known_moment, ..Measurement::default() };
        let reference = |time: f64| scenario.reference.at(time);
        let moment = law.update(&mut memory, tick, time, &measured, &reference);
        let input = |_| Input { moment, disturbance_moment: acting, ..Input::default() };
        plant.advance_with(time, time + PERIOD, &Command::default(), input).unwrap();
        observe(&memory, time, &moment, &plant);
    }
}

/// Share of the ticks with the guarantee in force, and largest rate and moment over their limits
/// while it is.
fn guaranteed(scenario: &Scenario, size: f64, is_told: bool) -> [f64; 3] {
    let settings =
        Settings { guarantee: Guarantee::BestEffort, ..Settings::new(Constraints::Robust) };
    let mut law = Crmpc::new(settings).unwrap();
    let (mut in_force, mut ticks) = (0_u32, 0_u32);
    let (mut rate, mut effort) = (0.0_f64, 0.0_f64);
    fly(&mut law, scenario, (size, is_told), |memory, _, moment, plant| {
        ticks += 1;
        if memory.supervision.status == GuaranteeStatus::InForce {
            in_force += 1;
            rate = rate.max(plant.rates().norm() / scenario.limit_rate);
            effort = effort.max(moment.norm() / scenario.limit_moment);
        }
    });
    [f64::from(in_force) / f64::from(ticks), rate, effort]
}

#[test]
fn oracle_a_known_moment_leaves_no_error() {
    let mut scenario = Scenario::crmpc2022();
    scenario.disturbance.kind = DisturbanceKind::None;
    scenario.inertia_scale = 1.0;
    let path = |size, is_told| {
        let Settings { body, p, q, period_feedback: period, .. } =
            Settings::new(Constraints::Robust);
        let mut law = Lqr::new(LqrSettings { body, period, p, q }).unwrap();
        let mut angles = Vec::new();
        fly(&mut law, &scenario, (size, is_told), |(), _, _, plant| angles.push(plant.angles()));
        angles
    };
    let calm = path(0.0, true);
    let apart = |one: &[Vector3<f64>]| {
        one.iter().zip(&calm).map(|(a, b)| (a - b).norm().to_degrees()).fold(0.0, f64::max)
    };
    // It is held from tick to tick, in the plant as in the law.
    assert!(apart(&path(1.0, true)) < 1e-9, "{}", apart(&path(1.0, true)));
    assert!(apart(&path(1.0, false)) > 1.0);
}

#[test]
fn regress_what_crmpc_guarantees_under_static_moments() {
    for kind in [DisturbanceKind::None, DisturbanceKind::White] {
        let mut scenario = Scenario::crmpc2022();
        scenario.disturbance.kind = kind;
        for size in [0.25, 0.5, 1.0] {
            let (told, untold) =
                (guaranteed(&scenario, size, true), guaranteed(&scenario, size, false));
            eprintln!("{kind:?} {size}: told {told:?}, untold {untold:?}");
            assert!(told[0] >= untold[0], "{kind:?} {size}: {told:?} {untold:?}");
            assert!(told[1] <= 1.0 && told[2] <= 1.0 + 1e-9, "{kind:?} {size}: {told:?}");
        }
    }
}
