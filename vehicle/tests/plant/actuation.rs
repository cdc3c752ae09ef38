//! The control moment: surfaces and jets, delay and conversion.

use super::{actuated, config, flaps, kinds, moment, undisturbed};
use crate::prelude::*;
use vehicle::actuators::JetMode;

#[test]
fn oracle_flaps_turn_the_nose_at_their_rate_and_then_stay() {
    // At beta = 0 both flaps give a pure pitching moment: M = -2 · 5100 N m/deg · 10 deg/s · t up
    // to -2 deg at 0.2 s, then constant.
    let config = actuated(State::new(0.1, 0.0, 0.2, 0.0, 0.0, 0.0), JetMode::OnOff);
    let inertia = config.inertia.Iyy * config.inertia_scale;
    let mut plant = Plant::new(&config, 0.0).unwrap();
    plant.advance_with(0.0, 1.0, &flaps(-2.0), |_| Input::default()).unwrap();
    let (slope, full) = (2.0 * 5100.0 * 10.0 / inertia, 2.0 * 5100.0 * 2.0 / inertia);
    let q = slope * 0.2 * 0.2 / 2.0 + full * 0.8;
    let alpha = 0.1 + slope * 0.2f64.powi(3) / 6.0 + slope * 0.02 * 0.8 + full * 0.8 * 0.8 / 2.0;
    assert!((plant.rates() - Vector3::new(0.0, q, 0.0)).amax() < 1e-16, "{}", plant.rates().y - q);
    assert!((plant.angles().x - alpha).abs() < 1e-15, "{}", plant.angles().x - alpha);
    assert_eq!(plant.deflections, flaps(-2.0).surfaces);
}

#[test]
fn with_actuators_the_input_moment_does_not_act_and_without_them_commands_do_not() {
    let start = State::new(0.1, 0.05, 0.2, 0.01, 0.02, -0.01);
    let moment = Vector3::new(1e4, -2e4, 3e4);
    let end = |config: &Config, (moment, command): (Vector3<f64>, Command)| {
        let mut plant = Plant::new(config, 0.0).unwrap();
        plant.advance_with(0.0, 1.0, &command, |_| moment.into()).unwrap();
        plant.state
    };
    let mut command = flaps(5.0);
    command.jets[0] = 1.0;
    let [with, without] = [actuated(start, JetMode::OnOff), undisturbed(start, 0.05)];
    let (neither, both) = ((Vector3::zeros(), Command::default()), (moment, command));
    assert_eq!(end(&with, both), end(&with, (neither.0, command)));
    assert_eq!(end(&without, both), end(&without, (moment, neither.1)));
    assert_ne!(end(&with, both), end(&with, neither));
    assert_ne!(end(&without, both), end(&without, neither));
}

#[test]
fn one_long_step_equals_short_ones_with_actuators() {
    let start = State::new(0.1, 0.05, 0.2, 0.01, 0.02, -0.01);
    for jet_mode in [JetMode::OnOff, JetMode::Duty] {
        let config = Config { step: 1e-3, ..actuated(start, jet_mode) };
        let mut command = flaps(6.0);
        command.surfaces[0] = -0.05;
        (command.jets[2], command.jets[5]) = (0.7, 0.3);
        let input = Input::default();
        let [mut long, mut short] = [0, 1].map(|_| Plant::new(&config, 0.0).unwrap());
        long.advance_with(0.0, 2.0, &command, |_| input).unwrap();
        for k in 0..50 {
            short
                .advance_with(0.04 * f64::from(k), 0.04 * f64::from(k + 1), &command, |_| input)
                .unwrap();
        }
        assert!((long.state - short.state).amax() < 1e-13, "{jet_mode:?}: {long:?}");
    }
}

#[test]
fn oracle_a_delayed_moment_acts_that_much_later() {
    // The comparison plant gets the same moments without delay, in steps that begin where they
    // arrive.
    for delay in [1e-3, 0.04, 0.1, 0.117, 0.12, 1.0] {
        for config in kinds() {
            let mut delayed =
                Plant::new(&Config { moment_delay: delay, ..config.clone() }, 0.0).unwrap();
            let mut direct = Plant::new(&config, 0.0).unwrap();
            let (mut reached, mut arrived) = (0.0, 0);
            let acting =
                |arrived: u32| if arrived == 0 { Vector3::zeros() } else { moment(arrived - 1) };
            for k in 0..100 {
                let to = 0.04 * f64::from(k + 1);
                delayed.advance(0.04 * f64::from(k), to, moment(k)).unwrap();
                while 0.04 * f64::from(arrived) + delay < to + 1e-9 {
                    let arrival = 0.04 * f64::from(arrived) + delay;
                    direct.advance(reached, arrival, acting(arrived)).unwrap();
                    (reached, arrived) = (arrival, arrived + 1);
                }
                direct.advance(reached, to, acting(arrived)).unwrap();
                reached = reached.max(to);
                let kind = config.disturbance.kind;
                assert!((delayed.state - direct.state).amax() < 1e-11, "{delay} s, {kind:?}, {k}");
                let input = moment(k + 1).into();
                let held = delayed.in_force(to, &input, &Command::default());
                assert_eq!(
                    delayed.applied_moment(None, &input, &held),
                    acting(arrived),
                    "{delay} s, {kind:?}, {k}"
                );
            }
        }
    }
}

#[test]
fn oracle_a_converted_moment_acts_as_the_rounded_one_does() {
    let step = 700.0;
    let converted_config = Config { moment_resolution: step, ..config() };
    let delayed_config = Config { moment_delay: 0.05, ..config() };
    let delayed_converted_config = Config { moment_delay: 0.05, ..converted_config.clone() };
    for (with, without) in
        [(&converted_config, &config()), (&delayed_converted_config, &delayed_config)]
    {
        let [mut converted, mut rounded] =
            [with, without].map(|config| Plant::new(config, 0.0).unwrap());
        for k in 0..50 {
            let (from, to) = (0.04 * f64::from(k), 0.04 * f64::from(k + 1));
            converted.advance(from, to, moment(k)).unwrap();
            rounded.advance(from, to, (moment(k) / step).map(f64::round) * step).unwrap();
            assert_eq!(converted.state, rounded.state, "{k}");
        }
        let held = converted.in_force(2.0, &moment(50).into(), &Command::default());
        let applied = converted.applied_moment(None, &moment(50).into(), &held) / step;
        assert!((applied - applied.map(f64::round)).amax() < 1e-12 && applied.amax() > 1.0);
    }
}
