//! Tests of the actuators against the published limits and moments.

use super::*;

/// The flight condition of the actuators.
const FIXED: Conditions = Conditions::Fixed(0.0);

fn actuators(jet_mode: JetMode) -> Actuators {
    let effectors = Effectors::published();
    let dynamic_pressure = effectors.reference_pressure;
    Actuators::new(&Config {
        effectors,
        jet_mode,
        dynamic_pressure,
        mach: 9.8,
        aerodynamics_scale: 1.0,
    })
    .unwrap()
}

fn surfaces(deflections_deg: [f64; SURFACES]) -> Command {
    Command { surfaces: Surfaces::from(deflections_deg).map(f64::to_radians), jets: Jets::zeros() }
}

fn degrees(deflections: &Surfaces) -> Surfaces {
    deflections.map(f64::to_degrees)
}

const FAR: [f64; SURFACES] = [-90.0, -20.0, 5.0, -3.0, 90.0, -90.0, 90.0, -90.0];

/// Returns the exact motion from rest at zero until `end`, followed from one arrival to the
/// next, and the times of the arrivals.
fn moved(actuators: &Actuators, command: &Command, begin: f64, end: f64) -> (Surfaces, Vec<f64>) {
    let mut deflections = Surfaces::zeros();
    let (mut time, mut arrivals) = (begin, Vec::new());
    loop {
        let drive = actuators.commanded(time, command, &deflections);
        let arrival = time + actuators.time_left(&drive, &deflections).min();
        let next = arrival.min(end);
        deflections += actuators.rates(&drive) * (next - time);
        actuators.settle(next, &drive, &mut deflections);
        if arrival > end {
            return (deflections, arrivals);
        }
        arrivals.push(arrival);
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
        let deflections = degrees(&moved(&actuators, &surfaces(FAR), 2.0, time).0);
        assert!((deflections - Surfaces::from(expected)).amax() < 1e-12, "{deflections} at {time}");
    }
    let effectors = Effectors::published();
    let rest = moved(&actuators, &surfaces(FAR), 2.0, 9.0).0;
    assert_eq!((rest[0], rest[4], rest[5]), (effectors.min[0], effectors.max[4], effectors.min[5]));
    assert_eq!(rest[3], (-3f64).to_radians(), "the command itself, without rounding");
}

#[test]
fn the_position_limit_acts_before_the_rate_limit() {
    // A command far beyond the limit does not wind up: the deflection turns back at once.
    let actuators = actuators(JetMode::OnOff);
    let away = moved(&actuators, &surfaces([-90.0; SURFACES]), 0.0, 10.0).0;
    let back = actuators.commanded(10.0, &surfaces([0.0; SURFACES]), &away);
    let deflections = degrees(&(away + actuators.rates(&back) * 0.1));
    assert!(
        (deflections[0] + 24.0).abs() < 1e-12 && (deflections[4] + 9.0).abs() < 1e-12,
        "{deflections}"
    );
}

#[test]
fn arrivals_come_when_deflections_come_to_rest() {
    let actuators = actuators(JetMode::OnOff);
    let arrivals = moved(&actuators, &surfaces(FAR), 2.0, 9.0).1;
    let expected = [2.3, 3.0, 4.0, 4.5, 5.0];
    assert_eq!(arrivals.len(), expected.len(), "{arrivals:?}");
    assert!(arrivals.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{arrivals:?}");
}

#[test]
fn a_deflection_behind_its_target_is_put_on_it_and_one_before_it_is_not() {
    let actuators = actuators(JetMode::OnOff);
    let drive = actuators.commanded(0.0, &surfaces(FAR), &Surfaces::zeros());
    for (left, arrives) in [(1e-6, false), (1e-10, true), (0.0, true), (-0.01, true)] {
        // The fourth surface moves down to -3 deg at 10 deg/s.
        let mut deflections = surfaces(FAR).surfaces;
        deflections[3] += left * 10f64.to_radians();
        assert!((actuators.time_left(&drive, &deflections)[3] - left).abs() < 1e-15);
        let before = deflections[3];
        actuators.settle(0.3, &drive, &mut deflections);
        let expected = if arrives { (-3f64).to_radians() } else { before };
        assert_eq!(deflections[3], expected, "{left}");
        let after = actuators.commanded(0.3, &surfaces(FAR), &deflections);
        assert_eq!(actuators.rates(&after)[3] == 0.0, arrives, "{left}");
        assert_eq!(
            actuators.time_left(&after, &deflections)[3] == f64::INFINITY,
            arrives,
            "{left}"
        );
    }
}

#[test]
fn taking_the_same_command_again_changes_nothing() {
    let actuators = actuators(JetMode::OnOff);
    let command = surfaces(FAR);
    let mut often = Surfaces::zeros();
    for k in 0..400 {
        let time = 0.013 * f64::from(k);
        let drive = actuators.commanded(time, &command, &often);
        for i in 0..SURFACES {
            often[i] +=
                actuators.rates(&drive)[i] * actuators.time_left(&drive, &often)[i].min(0.013);
        }
        actuators.settle(time + 0.013, &drive, &mut often);
        let once = moved(&actuators, &command, 0.0, time + 0.013).0;
        assert!((once - often).amax() < 1e-14);
    }
}

#[test]
fn published_moments_at_rest() {
    // Wu 2015, (64): jets 3 and 7; flaps at 2 and -1 deg in the representative effectiveness
    let mut command = surfaces([0.0, 0.0, 0.0, 0.0, 2.0, -1.0, 0.0, 0.0]);
    (command.jets[2], command.jets[6]) = (1.0, 1.0);
    let actuators = actuators(JetMode::OnOff);
    let drive = actuators.commanded(0.0, &command, &Surfaces::zeros());
    let jets = Vector3::new(11625.0 - 11623.0, -9466.0 - 9465.0, 0.0);
    assert!((actuators.moment(&drive, &Surfaces::zeros(), &FIXED) - jets).amax() < 1e-9);
    let flaps = Vector3::new(3.0 * 1375.0, -5100.0, -3000.0);
    assert!((actuators.moment(&drive, &command.surfaces, &FIXED) - jets - flaps).amax() < 1e-9);
}

#[test]
fn jets_switch_at_one_half_when_commands_are_taken() {
    let actuators = actuators(JetMode::OnOff);
    let mut command = Command::default();
    let full = Vector3::new(0.0, -498.0, 19897.0);
    for (value, on) in [(0.0, 0.0), (0.4999, 0.0), (0.5, 1.0), (1.0, 1.0), (7.0, 1.0), (-7.0, 0.0)]
    {
        command.jets[0] = value;
        let drive = actuators.commanded(0.0, &command, &Surfaces::zeros());
        assert_eq!(actuators.moment(&drive, &Surfaces::zeros(), &FIXED), full * on, "{value}");
    }
    assert!(actuators.moment_by_jets(&command).iter().all(|derivative| *derivative == 0.0));
}

#[test]
fn duty_cycles_scale_the_thrust_and_are_cut_off() {
    let actuators = actuators(JetMode::Duty);
    let mut command = Command::default();
    let full = Vector3::new(0.0, -498.0, 19897.0);
    for (value, duty) in [(0.0, 0.0), (0.25, 0.25), (1.0, 1.0), (1.5, 1.0), (-0.5, 0.0)] {
        command.jets[0] = value;
        let drive = actuators.commanded(0.0, &command, &Surfaces::zeros());
        let moment = actuators.moment(&drive, &Surfaces::zeros(), &FIXED);
        assert!((moment - full * duty).amax() < 1e-9, "{value}");
        let slope = if value == duty { full } else { Vector3::zeros() };
        assert!((actuators.moment_by_jets(&command).column(0) - slope).amax() < 1e-9);
    }
}

#[test]
fn aerodynamics_and_density_biases_multiply() {
    let effectors = Effectors::published();
    let command = surfaces([-5.0, -3.0, -5.0, -3.0, 5.0, 3.0, 0.0, 0.0]);
    let moment = |pressure: f64, scale: f64| {
        let dynamic_pressure = pressure * effectors.reference_pressure;
        let config = Config {
            effectors: effectors.clone(),
            jet_mode: JetMode::OnOff,
            dynamic_pressure,
            mach: 9.8,
            aerodynamics_scale: scale,
        };
        let actuators = Actuators::new(&config).unwrap();
        let drive = actuators.commanded(0.0, &command, &Surfaces::zeros());
        actuators.moment(&drive, &command.surfaces, &FIXED)
    };
    let (nominal, biased) = (moment(1.0, 1.0), moment(0.9, 0.9));
    assert!(nominal.amin() > 500.0);
    assert!((biased - nominal * 0.81).amax() < 1e-9);
}

#[test]
fn a_negative_scale_is_refused_by_name() {
    let effectors = Effectors::published();
    let config = Config {
        effectors,
        jet_mode: JetMode::OnOff,
        dynamic_pressure: 1e3,
        mach: 9.8,
        aerodynamics_scale: -1.0,
    };
    let text = Actuators::new(&config).unwrap_err().to_string();
    assert!(text.contains("aerodynamics.scale"));
}
