//! Values that the plant refuses, and the reasons.

use super::{actuated, config, flaps, undisturbed};
use nalgebra::{Vector3, Vector6};
use vehicle::Error;
use vehicle::actuators::{Command, JetMode};
use vehicle::plant::{Config, Input, Plant, State};

#[test]
fn singular_attitude_and_wrong_input_stop_the_plant_with_a_reason() {
    // Without Ixz the yaw rate alone carries beta straight to 90°.
    let mut straight = undisturbed(Vector6::new(0.0, 1.5, 0.0, 0.0, 0.0, -0.5), 0.01);
    straight.inertia.Ixz = 0.0;
    let mut plant = Plant::new(&straight, 0.0).unwrap();
    let error = plant.advance(0.0, 2.0, Vector3::zeros()).unwrap_err();
    assert!(matches!(error, Error::Singular { .. }), "{error}");
    assert!(
        plant.state.iter().all(|value| value.is_finite())
            && plant.angles().y < std::f64::consts::FRAC_PI_2
    );

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
    let refusal = plant
        .advance_with(0.0, 1.0, &flaps(f64::NAN), |_| Input::default())
        .unwrap_err()
        .to_string();
    assert!(refusal.contains("command"), "{refusal}");
    assert_eq!(plant.state, State::zeros());
}

#[test]
fn a_delay_that_cannot_work_is_refused_by_name() {
    let mut plant = Plant::new(&Config { moment_delay: 0.1, ..config() }, 0.0).unwrap();
    let profiles: [fn(f64) -> f64; 2] = [|t| t, |t| t * (t - 0.04)];
    for profile in profiles {
        let input = |time: f64| Vector3::new(0.0, 1e4 * profile(time), 0.0).into();
        let text =
            plant.advance_with(0.0, 0.04, &Command::default(), input).unwrap_err().to_string();
        assert!(text.contains("actuation.delay") && text.contains("derivatives"), "{text}");
    }
    let error = plant.advance(0.0, 0.04, Vector3::repeat(f64::NAN)).unwrap_err();
    assert!(matches!(error, Error::NotFinite { what: "moment", .. }), "{error}");
}

#[test]
fn a_converter_that_cannot_work_is_refused_by_name() {
    let mut plant = Plant::new(&Config { moment_resolution: 1.0, ..config() }, 0.0).unwrap();
    let ramp = |time: f64| Vector3::new(0.0, 1e4 * time, 0.0).into();
    let text = plant.advance_with(0.0, 0.04, &Command::default(), ramp).unwrap_err().to_string();
    assert!(text.contains("actuation.resolution") && text.contains("derivatives"), "{text}");
    let error = plant.advance(0.0, 0.04, Vector3::repeat(f64::NAN)).unwrap_err();
    assert!(matches!(error, Error::NotFinite { what: "moment", .. }), "{error}");
}
