//! Tests of the actuators against the published limits and moments.

use super::*;

/// The flight condition of the actuators.
const FIXED: Conditions = Conditions::Fixed(0.0);

/// Actuators at a multiple of the reference pressure.
fn biased(jet_mode: JetMode, pressure: f64, aerodynamics_scale: f64) -> Actuators {
    let effectors = Effectors::published();
    let dynamic_pressure = pressure * effectors.reference_pressure;
    let fault = EffectorFault::default();
    let config =
        Config { effectors, jet_mode, dynamic_pressure, mach: 9.8, aerodynamics_scale, fault };
    Actuators::new(&config).unwrap()
}

fn actuators(jet_mode: JetMode) -> Actuators {
    biased(jet_mode, 1.0, 1.0)
}

fn surfaces(deflections_deg: [f64; SURFACES]) -> Command {
    Command { surfaces: Surfaces::from(deflections_deg).map(f64::to_radians), jets: Jets::zeros() }
}

fn degrees(deflections: &Surfaces) -> Surfaces {
    deflections.map(f64::to_degrees)
}

const FAR: [f64; SURFACES] = [-90.0, -20.0, 5.0, -3.0, 90.0, -90.0, 90.0, -90.0];

/// Returns the exact motion from rest at zero until `end`, followed from one arrival to the
/// next.
fn moved(actuators: &Actuators, command: &Command, begin: f64, end: f64) -> Surfaces {
    let mut deflections = Surfaces::zeros();
    let mut time = begin;
    loop {
        let drive = actuators.commanded(time, command, &deflections);
        let arrival = time + actuators.time_left(&drive, &deflections).min();
        let next = arrival.min(end);
        deflections += actuators.rates(&drive) * (next - time);
        actuators.settle(next, &drive, &mut deflections);
        if arrival > end {
            return deflections;
        }
        time = next;
    }
}

#[test]
fn published_rate_and_position_limits_are_met_exactly() {
    // Wu 2015, (63): 10 deg/s; -25 to 0 deg, -10 to 30 deg, -30 to 30 deg
    let actuators = actuators(JetMode::OnOff);
    for (time, expected) in [
        (2.0, [0.0; SURFACES]),
        (2.2, [-2.0, -2.0, 0.0, -2.0, 2.0, -2.0, 2.0, -2.0]),
        (2.5, [-5.0, -5.0, 0.0, -3.0, 5.0, -5.0, 5.0, -5.0]),
        (3.5, [-15.0, -15.0, 0.0, -3.0, 15.0, -10.0, 15.0, -15.0]),
        (9.0, [-25.0, -20.0, 0.0, -3.0, 30.0, -10.0, 30.0, -30.0]),
    ] {
        let deflections = degrees(&moved(&actuators, &surfaces(FAR), 2.0, time));
        assert!((deflections - Surfaces::from(expected)).amax() < 1e-12, "{deflections} at {time}");
    }
    let effectors = Effectors::published();
    let rest = moved(&actuators, &surfaces(FAR), 2.0, 9.0);
    assert_eq!((rest[0], rest[4], rest[5]), (effectors.min[0], effectors.max[4], effectors.min[5]));
    assert_eq!(rest[3], (-3f64).to_radians(), "the command itself, without rounding");
}

#[test]
fn the_position_limit_acts_before_the_rate_limit() {
    // A command far beyond the limit does not wind up: the deflection turns back at once.
    let actuators = actuators(JetMode::OnOff);
    let away = moved(&actuators, &surfaces([-90.0; SURFACES]), 0.0, 10.0);
    let back = actuators.commanded(10.0, &surfaces([0.0; SURFACES]), &away);
    let deflections = degrees(&(away + actuators.rates(&back) * 0.1));
    assert!(
        (deflections[0] + 24.0).abs() < 1e-12 && (deflections[4] + 9.0).abs() < 1e-12,
        "{deflections}"
    );
}

#[test]
fn jets_switch_at_one_half_or_scale_their_thrust_by_the_duty_cycle() {
    let full = Vector3::new(0.0, -498.0, 19897.0);
    let on_off = [(0.0, 0.0), (0.4999, 0.0), (0.5, 1.0), (1.0, 1.0), (7.0, 1.0), (-7.0, 0.0)];
    let duty = [(0.0, 0.0), (0.25, 0.25), (1.0, 1.0), (1.5, 1.0), (-0.5, 0.0)];
    for (jet_mode, cases) in [(JetMode::OnOff, &on_off[..]), (JetMode::Duty, &duty)] {
        let actuators = actuators(jet_mode);
        for &(value, share) in cases {
            let mut command = Command::default();
            command.jets[0] = value;
            let drive = actuators.commanded(0.0, &command, &Surfaces::zeros());
            let moment = actuators.moment(&drive, &Surfaces::zeros(), &FIXED);
            assert_eq!(moment, full * share, "{jet_mode:?} {value}");
        }
    }
}

#[test]
fn a_surface_that_fails_stays_floats_or_is_slow_and_a_jet_stays_on_or_off() {
    use EffectorFaultKind::{Floating, JetOff, JetOn, Slow, Stuck};
    let command = Command { jets: Jets::repeat(0.6), ..surfaces([-20.0; SURFACES]) };
    let at = surfaces([-5.0; SURFACES]).surfaces;
    for (kind, rate, jet) in [
        (Stuck, 0.0, 0.6),
        (Floating, 10.0, 0.6),
        (Slow, -2.0, 0.6),
        (JetOn, -10.0, 1.0),
        (JetOff, -10.0, 0.0),
    ] {
        let fault = EffectorFault { kind, number: 3, start: 7.0, share: 0.2 };
        let actuators = Actuators { fault, ..actuators(JetMode::Duty) };
        let healthy = actuators.commanded(6.99, &command, &at);
        assert_eq!((degrees(&actuators.rates(&healthy))[2], healthy.thrust[2]), (-10.0, 0.6));
        assert_eq!((actuators.next_fault(6.99), actuators.next_fault(7.0)), (Some(7.0), None));
        let drive = actuators.directed(7.0, healthy, &at);
        assert!((degrees(&actuators.rates(&drive))[2] - rate).abs() < 1e-12, "{kind:?}");
        assert_eq!((drive.thrust[2], drive.thrust[1]), (jet, 0.6), "{kind:?}");
        assert_eq!(degrees(&actuators.rates(&drive))[0], -10.0);
        // It arrives when its rate has covered the way, and stays there.
        let left = actuators.time_left(&drive, &at)[2];
        let mut reached = at + actuators.rates(&drive) * left.min(1e3);
        actuators.settle(7.0 + left.min(1e3), &drive, &mut reached);
        let end = match kind {
            Stuck => -5.0,
            Floating => 0.0,
            _ => -20.0,
        };
        assert!((degrees(&reached)[2] - end).abs() < 1e-9, "{kind:?}: {}", degrees(&reached)[2]);
    }
}

#[test]
fn what_the_vehicle_lacks_cannot_fail() {
    use EffectorFaultKind::{JetOff, Stuck};
    let mut effectors = Effectors::published();
    assert_eq!((effectors.surfaces(), effectors.jets()), (SURFACES, JETS));
    (effectors.min[7], effectors.max[7]) = (0.0, 0.0);
    effectors.jet_moments.fill_column(9, 0.0);
    let check =
        |kind, number| EffectorFault { kind, number, ..EffectorFault::default() }.check(&effectors);
    for (kind, count, what) in [(Stuck, 7, "surfaces"), (JetOff, 9, "jets")] {
        assert!(check(kind, count).is_ok());
        let said = check(kind, count + 1).unwrap_err().to_string();
        let expected = format!("must be at most {count}: the vehicle has no more {what}");
        assert_eq!(said, format!("effector.fault.number = {} {expected}", count + 1));
    }
    assert!(check(EffectorFaultKind::None, 10).is_ok());
}
