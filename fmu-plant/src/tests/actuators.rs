//! Surfaces and jets, and the events at which surfaces come to rest.

use super::model_exchange::{exchange, indicators, integrate, states};
use super::prelude::*;
use super::{actuate, outputs, started, step};

/// Commands beyond the limits, at the limits and within them.
const FAR: [f64; 8] = [-90.0, 4.0, -3.0, 0.0, 90.0, 0.0, 0.0, 0.0];

fn command(instance: &mut ReentryPlant, degrees: [f64; 8]) {
    instance.parameters.kind = DisturbanceKind::None;
    actuate(instance);
    instance.command.surfaces = Surfaces::from(degrees).map(f64::to_radians);
}

pub(super) fn far(instance: &mut ReentryPlant) {
    command(instance, FAR);
}

/// Returns an instance in model exchange after the first event.
fn commanded(degrees: [f64; 8]) -> ReentryPlant {
    let mut instance = started(|instance| command(instance, degrees));
    instance.new_discrete_states(0.0).unwrap();
    instance
}

/// Sets a deflection (rad), as an importer does.
fn deflect(instance: &mut ReentryPlant, surface: usize, deflection: f64) {
    let mut states = states(instance);
    states[6 + surface] = deflection;
    instance.set_continuous_states(states.as_slice());
}

#[test]
fn published_rate_limit_and_state_events_where_surfaces_stop() {
    // Wu 2015, (63): 10 deg/s; commands beyond the limits of -25, 0 and 30 deg stop there.
    let mut instance = started(far);
    let events = exchange(&mut instance, 0.0, 4.0);
    let expected = [0.0, 0.3, 2.5, 3.0];
    assert_eq!(events.len(), expected.len(), "{events:?}");
    assert!(events.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{events:?}");
    let stop = [-25.0, 0.0, -3.0, 0.0, 30.0, 0.0, 0.0, 0.0].map(f64::to_radians);
    assert_eq!(outputs(&mut instance, 4.0).deflections, Surfaces::from(stop), "to the last bit");
    assert_eq!(indicators(&mut instance, 4.0), [1.0; INDICATORS]);
}

#[test]
fn between_events_indicators_are_the_time_left_whatever_trial_states_are_set() {
    let mut instance = commanded(FAR);
    let start = states(&instance);
    let expected = [2.5, 1.0, 0.3, 1.0, 3.0, 1.0, 1.0, 1.0, 1.0, 1.0];
    let near = |actual: [f64; INDICATORS], shift: f64| {
        let expected = [2.5 - shift, 1.0, 0.3 - shift, 1.0, 3.0 - shift, 1.0, 1.0, 1.0, 1.0, 1.0];
        assert!(actual.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-14), "{actual:?}");
    };
    near(indicators(&mut instance, 0.0), 0.0);
    let rates = outputs(&mut instance, 0.0).deflection_rates;
    for reach in [0.1, 0.3 + 1e-9, 0.4, 7.0] {
        let mut trial = start;
        for i in 0..8 {
            trial[6 + i] += rates[i] * reach;
        }
        instance.set_continuous_states(trial.as_slice());
        near(indicators(&mut instance, reach), reach);
        assert_eq!(outputs(&mut instance, reach).deflection_rates, rates);
    }
    instance.set_continuous_states(start.as_slice());
    assert_eq!(indicators(&mut instance, 0.0).map(|z| (z * 1e12).round() / 1e12), expected);
}

#[test]
fn an_event_puts_a_deflection_on_its_target_however_it_was_located() {
    // The third surface is at -3 deg after 0.3 s. An importer stops before, at, or after that.
    for (late, arrives) in
        [(-1e-3, false), (-1e-8, false), (-1e-12, true), (0.0, true), (1e-9, true), (0.04, true)]
    {
        let mut instance = commanded(FAR);
        let rates = outputs(&mut instance, 0.0).deflection_rates;
        let mut y = states(&instance);
        for i in 0..8 {
            y[6 + i] += rates[i] * (0.3 + late);
        }
        instance.set_continuous_states(y.as_slice());
        let before = states(&instance);
        let info = instance.new_discrete_states(0.3 + late).unwrap();
        let actual = outputs(&mut instance, 0.3 + late);
        assert_eq!(info.states_changed, states(&instance) != before, "{late}");
        assert_eq!(actual.deflection_rates[2] == 0.0, arrives, "{late}");
        if arrives {
            assert_eq!(actual.deflections[2], (-3f64).to_radians(), "{late}");
        }
        assert!(indicators(&mut instance, 0.3 + late).iter().all(|z| *z > 0.0), "{late}");
        // A second event at the same time, or a later one, changes nothing but the readings of the
        // sensors.
        let after = (states(&instance), actual);
        for time in [0.3 + late, 0.3 + late + 1e-6] {
            assert!(!instance.new_discrete_states(time).unwrap().states_changed);
            let actual = Output { measured: actual.measured, ..outputs(&mut instance, time) };
            assert_eq!((states(&instance), actual), after, "{late}");
        }
    }
}

#[test]
fn a_new_command_at_an_event_starts_from_the_old_target() {
    let mut instance = commanded(FAR);
    deflect(&mut instance, 2, (-3.5f64).to_radians());
    instance.command.surfaces[2] = (-1f64).to_radians();
    assert!(instance.new_discrete_states(0.35).unwrap().states_changed);
    let actual = outputs(&mut instance, 0.35);
    assert_eq!(actual.deflections[2], (-3f64).to_radians());
    assert!((actual.deflection_rates[2].to_degrees() - 10.0).abs() < 1e-12);
}

#[test]
fn an_importer_may_restart_from_other_deflections() {
    let mut instance = commanded([0.0; 8]);
    deflect(&mut instance, 4, 0.1);
    assert!(!instance.new_discrete_states(0.0).unwrap().states_changed);
    let actual = outputs(&mut instance, 0.0);
    assert_eq!(actual.deflections[4], 0.1);
    assert!((actual.deflection_rates[4].to_degrees() + 10.0).abs() < 1e-12);
}

#[test]
fn published_moments_of_jets_act_from_the_communication_point_on() {
    // Wu 2015, (64): column 4 as printed and as the mirror image of column 8.
    for (symmetric, pitch) in [(false, 10944.0), (true, 11798.0)] {
        let mut instance = started(|instance| {
            instance.parameters.actuation = Actuation::SurfacesAndJets;
            instance.parameters.jet_symmetric = symmetric;
        });
        assert_eq!(outputs(&mut instance, 0.0).applied_moment, Vector3::zeros());
        instance.command.jets[3] = 1.0;
        assert_eq!(
            outputs(&mut instance, 0.0).applied_moment,
            Vector3::new(-6912.0, pitch, -11798.0)
        );
    }
}

#[test]
fn in_model_exchange_jets_switch_and_surfaces_turn_at_events_only() {
    let mut instance =
        started(|instance| instance.parameters.actuation = Actuation::SurfacesAndJets);
    instance.new_discrete_states(0.0).unwrap();
    instance.command.jets[0] = 1.0;
    instance.command.surfaces[4] = 0.1;
    let before = outputs(&mut instance, 0.01);
    assert_eq!((before.applied_moment, before.deflections), (Vector3::zeros(), Surfaces::zeros()));
    assert_eq!(before.deflection_rates, Surfaces::zeros());
    instance.new_discrete_states(0.01).unwrap();
    assert_eq!(outputs(&mut instance, 0.01).applied_moment, Vector3::new(0.0, -498.0, 19897.0));
    let reached = integrate(&mut instance, 0.01, 0.02);
    assert!((outputs(&mut instance, reached).deflections[4].to_degrees() - 0.1).abs() < 1e-12);
}

#[test]
fn oracle_dynamic_pressure_and_biases_of_aerodynamics_and_density() {
    let flaps = |[density_scale, aerodynamics_scale]: [f64; 2]| {
        let mut instance = started(|instance| {
            let p = &mut instance.parameters;
            p.actuation = Actuation::SurfacesAndJets;
            (p.density_scale, p.aerodynamics_scale) = (density_scale, aerodynamics_scale);
            instance.command.surfaces[4] = 0.1;
            instance.command.surfaces[5] = 0.1;
        });
        step(&mut instance, 0.0, 1.0).unwrap();
        let output = outputs(&mut instance, 1.0);
        (output.passage.dynamic_pressure, output.applied_moment)
    };
    let [nominal, biased] = [[1.0, 1.0], [0.9, 0.8]].map(flaps);
    // Flight at 55 km and Mach 9.8 in the US Standard Atmosphere 1976.
    assert!((nominal.0 - 2858.9).abs() < 0.05, "{}", nominal.0);
    assert!((biased.0 / nominal.0 - 0.9).abs() < 1e-14);
    let pitch = -2.0 * 5100.0 * 0.1f64.to_degrees() * 2858.9 / 2859.0;
    assert!((nominal.1 - Vector3::new(0.0, pitch, 0.0)).amax() < 2e-5 * pitch.abs());
    assert!((biased.1 - nominal.1 * 0.72).amax() < 1e-9);
}
