//! Values that the plant refuses, and the reasons.

use super::{actuated, config, flaps, undisturbed};
use crate::prelude::*;
use vehicle::Error;
use vehicle::actuators::JetMode;

#[test]
fn singular_attitude_and_wrong_input_stop_the_plant_with_a_reason() {
    // Without Ixz the yaw rate alone carries beta straight to 90°.
    let mut straight = undisturbed(Vector6::new(0.0, 1.5, 0.0, 0.0, 0.0, -0.5), 0.01);
    straight.inertia.Ixz = 0.0;
    let mut plant = Plant::new(&straight, 0.0).unwrap();
    let error = plant.advance(0.0, 2.0, Vector3::zeros()).unwrap_err();
    assert!(matches!(error, Error::Singular { .. }), "{error}");
    assert!(plant.state.iter().all(|value| value.is_finite()) && plant.angles().y.cos() > 0.0);

    let mut plant = Plant::new(&config(), 0.0).unwrap();
    for bad in [f64::NAN, f64::INFINITY] {
        let error = plant.advance(0.0, 0.04, Vector3::repeat(bad)).unwrap_err();
        assert!(matches!(error, Error::NotFinite { what: "moment", .. }), "{error}");
        assert_eq!(plant.state, config().initial);
    }
}

#[test]
fn a_command_that_is_no_number_is_an_error() {
    let mut plant = Plant::new(&actuated(State::zeros(), JetMode::OnOff), 0.0).unwrap();
    let outcome = plant.advance_with(0.0, 1.0, &flaps(f64::NAN), |_| Input::default());
    let refusal = outcome.unwrap_err().to_string();
    assert!(refusal.contains("command"), "{refusal}");
    assert_eq!(plant.state, State::zeros());
}

/// Neither a delay nor a converter can take a moment that changes within a step.
#[test]
fn a_moment_with_derivatives_is_refused_by_the_parameter_that_cannot_take_it() {
    let (delayed, converted) =
        (Config { moment_delay: 0.1, ..config() }, Config { moment_resolution: 1.0, ..config() });
    let profiles: [fn(f64) -> f64; 2] = [|t| t, |t| t * (t - 0.04)];
    for (config, name, profiles) in [
        (delayed, "actuation.delay", &profiles[..]),
        (converted, "actuation.resolution", &profiles[..1]),
    ] {
        let mut plant = Plant::new(&config, 0.0).unwrap();
        for profile in profiles {
            let input = |time: f64| Vector3::new(0.0, 1e4 * profile(time), 0.0).into();
            let outcome = plant.advance_with(0.0, 0.04, &Command::default(), input);
            let text = outcome.unwrap_err().to_string();
            assert!(text.contains(name) && text.contains("derivatives"), "{text}");
        }
        let error = plant.advance(0.0, 0.04, Vector3::repeat(f64::NAN)).unwrap_err();
        assert!(matches!(error, Error::NotFinite { what: "moment", .. }), "{error}");
    }
}
