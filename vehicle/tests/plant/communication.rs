//! Communication points, which change nothing, and saved states.

use super::{config, kinds, moment, on_a_turntable};
use crate::prelude::*;
use proptest::prelude::*;
use vehicle::turntable;

fn long_and_short_steps(config: &Config) -> impl Iterator<Item = (State, State)> {
    let [mut long, mut short] = [0, 1].map(|_| Plant::new(config, 0.0).unwrap());
    let time = |tick: u32| f64::from(tick) * 0.04;
    (0..25).map(move |k| {
        long.advance(time(5 * k), time(5 * k + 5), moment(k)).unwrap();
        for j in 5 * k..5 * k + 5 {
            short.advance(time(j), time(j + 1), moment(k)).unwrap();
        }
        (long.state, short.state)
    })
}

#[test]
fn one_long_step_equals_five_short_ones_bit_for_bit() {
    for kind in [DisturbanceKind::White, DisturbanceKind::AlongRate, DisturbanceKind::AgainstMoment]
    {
        let mut config = config();
        config.disturbance.kind = kind;
        assert!(long_and_short_steps(&config).all(|(long, short)| long == short), "{kind:?}");
    }
}

#[test]
fn a_clock_that_is_accumulated_makes_no_slivers() {
    let config = config();
    let [mut exact, mut accumulated] = [0, 1].map(|_| Plant::new(&config, 0.0).unwrap());
    let mut time = 0.0;
    for k in 0..1250 {
        exact.advance(f64::from(k) * 0.04, f64::from(k + 1) * 0.04, Vector3::zeros()).unwrap();
        let mut calls = 0;
        let count = |_| {
            calls += 1;
            Input::default()
        };
        accumulated.advance_with(time, time + 0.04, &Command::default(), count).unwrap();
        assert_eq!(calls, 1 + 4 * 4, "step {k}");
        time += 0.04;
        if exact.angles().y.abs() > 1.2 {
            return;
        }
        assert!((exact.state - accumulated.state).amax() < 1e-11, "step {k}");
    }
}

#[test]
fn serialised_mid_run_it_goes_on_bit_for_bit() {
    for config in kinds() {
        let mut plant = Plant::new(&config, 0.0).unwrap();
        plant.advance(0.0, 0.5, moment(1)).unwrap();
        let text = toml::to_string(&plant).unwrap();
        let mut restored: Plant = toml::from_str(&text).unwrap();
        plant.advance(0.5, 1.5, moment(2)).unwrap();
        restored.advance(0.5, 1.5, moment(2)).unwrap();
        assert_eq!(plant, restored);
    }
}

proptest! {
    #[test]
    fn any_communication_points_lead_to_the_same_state(
        mut points in proptest::collection::vec(0.0..2.0, 0..40),
        kind in prop::sample::select(vec![DisturbanceKind::White, DisturbanceKind::Constant, DisturbanceKind::Sine, DisturbanceKind::Square, DisturbanceKind::Table]),
    ) {
        let mut config = kinds().find(|config| config.disturbance.kind == kind).unwrap();
        config.disturbance.end = 1.5;
        let [mut whole, mut parts] = [0, 1].map(|_| Plant::new(&config, 0.0).unwrap());
        let push = |t: f64| Vector3::new(2e4 * t.sin(), -1e4, 1e4 * t).into();
        whole.advance_with(0.0, 2.0, &Command::default(), push).unwrap();
        points.push(2.0);
        points.sort_by(f64::total_cmp);
        let mut from = 0.0;
        for to in points {
            parts.advance_with(from, to, &Command::default(), push).unwrap();
            from = to;
        }
        prop_assert!((whole.state - parts.state).amax() < 1e-11, "{}", whole.state - parts.state);
    }
}

#[test]
fn samples_on_a_turntable_do_not_depend_on_the_communication_step() {
    let [mut long, mut short] = [0, 1].map(|_| Plant::new(&on_a_turntable(), 0.0).unwrap());
    let mut on_the_vehicle =
        Plant::new(&Config { turntable: turntable::Config::default(), ..on_a_turntable() }, 0.0)
            .unwrap();
    for k in 0..25 {
        let time = 0.04 * f64::from(k);
        for plant in [&mut long, &mut on_the_vehicle] {
            plant.advance(time, time + 0.04, moment(k)).unwrap();
        }
        for i in 0..8 {
            let from = time + 0.005 * f64::from(i);
            short.advance(from, from + 0.005, moment(k)).unwrap();
        }
        let input = moment(k).into();
        let [at_long, at_short, at_vehicle] =
            [&long, &short, &on_the_vehicle].map(|plant| plant.measured(None, time + 0.04, &input));
        assert_eq!(at_long.number, at_short.number);
        for i in 0..3 {
            let scale = at_long.readings[i].amax();
            assert!((at_long.readings[i] - at_short.readings[i]).amax() <= 1e-9 * scale, "{k} {i}");
        }
        assert_ne!(at_long.readings, at_vehicle.readings, "{k}");
    }
}
