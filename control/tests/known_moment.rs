//! Loops in which the air's static moments act, with and without these as inputs of the laws.

use crate::prelude::*;
use control::delay;
use vehicle::actuators::Command;
use vehicle::aerodynamics::{Aerodynamics, Flow};
use vehicle::plant::Config;

const PERIOD: f64 = 0.04;

/// Returns the static moment of the papers' vehicle at 2859 Pa times this size, trimmed at the
/// reference's angle of attack.
fn air(scenario: &Scenario, size: f64) -> impl Fn(f64, &Plant) -> Vector3<f64> {
    let vehicle = Aerodynamics::papers();
    move |time, plant| {
        let angles = plant.angles();
        let flow = Flow {
            dynamic_pressure: 2859.0,
            mach: 9.8,
            speed: 3172.5,
            alpha: angles.x,
            beta: angles.y,
        };
        let trim = scenario.reference.at(time).angles.x;
        vehicle.moment(&flow, &Vector3::zeros(), trim) * size
    }
}

/// Flies the scenario for as many ticks as it lasts, while the moment of `acting` acts, which the
/// law may be told. Calls `observe` with the memory, the command and the plant at each tick.
fn fly<C: Controller>(
    law: &mut C,
    (scenario, delay): (&Scenario, f64),
    acting: impl Fn(f64, &Plant) -> Vector3<f64>,
    is_told: bool,
    mut observe: impl FnMut(&C::Memory, f64, &Vector3<f64>, &Plant),
) {
    let mut memory = law.memory();
    let config = Config { moment_delay: delay, ..scenario.config(0.01) };
    let mut plant = Plant::new(&config, 0.0).unwrap();
    for tick in 0..(scenario.duration / PERIOD).round() as u64 {
        let time = tick as f64 * PERIOD;
        let (angles, rates) = (plant.angles(), plant.rates());
        let acting = acting(time, &plant);
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
/// while it is. The known moment is declared as large as it becomes, and with the change from one
/// optimisation to the next.
fn guaranteed(scenario: &Scenario, size: f64, is_told: bool) -> [f64; 3] {
    let published = Settings::new(Constraints::Robust);
    let settings = Settings {
        known_bound: 0.8 * size * published.limit_moment,
        known_change: 0.1 * size * published.limit_moment,
        disturbance_bound: scenario.disturbance.bound,
        ..published
    };
    let mut law = Crmpc::new(settings).unwrap();
    let (mut in_force, mut ticks) = (0_u32, 0_u32);
    let (mut rate, mut effort) = (0.0_f64, 0.0_f64);
    fly(&mut law, (scenario, 0.0), air(scenario, size), is_told, |memory, _, moment, plant| {
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
        let acting = air(&scenario, size);
        let observe = |(): &(), _, _: &Vector3<f64>, plant: &Plant| angles.push(plant.angles());
        fly(&mut law, (&scenario, 0.0), acting, is_told, observe);
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
fn oracle_static_moments_that_are_told_leave_the_guarantee_in_force() {
    for kind in [DisturbanceKind::None, DisturbanceKind::White] {
        for (size, bound) in [(0.25, 1.5), (0.5, 1.0), (0.8, 0.3)] {
            let mut scenario = Scenario::crmpc2022();
            scenario.disturbance.kind = kind;
            scenario.disturbance.bound = f64::to_radians(bound);
            let told = guaranteed(&scenario, size, true);
            assert!(told[0] == 1.0, "{kind:?} {size}: {told:?}");
            assert!(told[1] <= 1.0 && told[2] <= 1.0 + 1e-9, "{kind:?} {size}: {told:?}");
            let untold = guaranteed(&scenario, size, false);
            assert!(untold[0] < 1.0 || size < 0.5, "{kind:?} {size}: {untold:?}");
        }
    }
}

/// A constant known moment (N m) in a loop with this delay (s), and the bounds that are declared.
#[derive(Clone, Copy, Debug)]
struct Constant {
    moment: Vector3<f64>,
    delay: f64,
    disturbance_bound: f64,
    kind: DisturbanceKind,
}

impl Constant {
    fn settings(&self) -> Settings {
        Settings {
            known_bound: self.moment.norm(),
            delay: self.delay,
            disturbance_bound: self.disturbance_bound,
            ..Settings::new(Constraints::Robust)
        }
    }

    /// Returns the number of ticks at which the guarantee is not in force, and the largest moment
    /// of the actuators and rate over their limits.
    fn fly(&self, settings: &Settings) -> (u32, [f64; 2]) {
        let mut scenario = Scenario { duration: 40.0, ..Scenario::crmpc2022() };
        scenario.disturbance.kind = self.kind;
        scenario.disturbance.bound = self.disturbance_bound;
        let law = Crmpc::new(*settings).unwrap();
        let latency = Latency { measurement: 0.0, action: self.delay };
        let Settings { body, limit_moment, limit_rate, .. } = *settings;
        let mut law = Delayed::new(law, body, PERIOD, latency, limit_moment).unwrap();
        let (mut lost, mut largest) = (0, [0.0_f64; 2]);
        let acting = |_: f64, _: &Plant| self.moment;
        let begin = delay::ticks(self.delay, PERIOD) as f64 * PERIOD;
        fly(&mut law, (&scenario, self.delay), acting, true, |memory, time, moment, plant| {
            let in_force = memory.inner.supervision.status == GuaranteeStatus::InForce;
            lost += u32::from(time > begin - 1e-9 && !in_force);
            largest[0] = largest[0].max(moment.norm() / limit_moment);
            largest[1] = largest[1].max(plant.rates().norm() / limit_rate);
        });
        (lost, largest)
    }
}

#[test]
fn oracle_a_constant_known_moment_leaves_the_guarantee_in_force_where_there_is_room() {
    let limit = Scenario::crmpc2022().limit_moment;
    for delay in [0.0, 0.04, 0.117] {
        for (share, bound) in [(0.1, 1.8), (0.3, 1.3), (0.5, 0.8)] {
            for (i, direction) in
                [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.6, 0.5, -0.6]].iter().enumerate()
            {
                let kinds =
                    [DisturbanceKind::White, DisturbanceKind::Constant, DisturbanceKind::Square];
                let moment = Vector3::from(*direction).normalize() * (share * limit);
                let disturbance_bound = f64::to_radians(bound);
                let constant = Constant { moment, delay, disturbance_bound, kind: kinds[i] };
                let (lost, largest) = constant.fly(&constant.settings());
                assert!(
                    lost == 0 && largest[0] <= 1.0 + 1e-9 && largest[1] <= 1.0,
                    "{constant:?}: {lost}, {largest:?}"
                );
            }
        }
    }
}

#[test]
fn a_known_moment_beyond_its_bound_does_not_stop_the_vehicle() {
    let mut scenario = Scenario { duration: 60.0, ..Scenario::crmpc2022() };
    scenario.disturbance.kind = DisturbanceKind::None;
    scenario.reference = Profile::step(
        Vector3::new(20.0, 0.0, 0.0).map(f64::to_radians),
        Vector3::new(20.0, 0.0, 40.0).map(f64::to_radians),
        26.0,
    );
    scenario.initial_angles = scenario.reference.at(0.0).angles;
    let settings =
        Settings { known_bound: 1e4, known_change: 5e3, ..Settings::new(Constraints::Robust) };
    let mut law = Crmpc::new(settings).unwrap();
    // The plan that was certified without it must not be kept.
    let acting = |time: f64, _: &Plant| {
        let share = (0.05 * (time - 4.0)).clamp(0.0, 0.9);
        Vector3::y() * (share * settings.limit_moment)
    };
    let mut angles = Vector3::zeros();
    fly(&mut law, (&scenario, 0.0), acting, true, |memory, time, _, plant| {
        assert!(time < 8.0 || memory.supervision.status != GuaranteeStatus::InForce, "{time}");
        angles = plant.angles();
    });
    let error = (angles - scenario.reference.at(60.0).angles).norm().to_degrees();
    assert!(error < 2.0, "{error}");
}

#[test]
fn a_known_moment_is_refused_without_room_and_contradicts_its_bound() {
    let limit = Scenario::crmpc2022().limit_moment;
    let constant = Constant {
        moment: Vector3::x() * 0.5 * limit,
        delay: 0.04,
        disturbance_bound: f64::to_radians(2.0),
        kind: DisturbanceKind::None,
    };
    let refused = Crmpc::new(constant.settings()).err().unwrap().to_string();
    assert!(refused.contains("at most knownMoment.bound = "), "{refused}");
    let undeclared =
        Settings { known_bound: 0.49 * limit, disturbance_bound: 0.01, ..constant.settings() };
    assert_eq!(constant.fly(&undeclared).0, 1000 - 1);
}
