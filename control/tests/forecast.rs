//! The forecast of a reference that is given from outside.

use crate::prelude::*;
use proptest::prelude::*;

fn vector(range: std::ops::Range<f64>) -> impl Strategy<Value = Vector3<f64>> {
    prop::array::uniform3(range).prop_map(Vector3::from)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    /// Each angle moves on by its derivatives over the delay, and then stops in the least time: its
    /// rate falls to zero after v|v|/(2 a).
    #[test]
    fn oracle_each_angle_goes_on_at_its_rate_and_brakes(
        angles in vector(-2.0..2.0),
        rates in vector(-0.2..0.2),
        accelerations in vector(-0.1..0.1),
        braking in vector(0.001..0.1),
        from in -10.0..10.0,
        delay in 0.0..0.5,
        since in 0.0..60.0,
    ) {
        let given = Reference { angles, rates, accelerations };
        let until = from + delay;
        let preview = Preview::External(Forecast { given, from, until, braking: Some(braking) });
        prop_assert_eq!(preview.at(from), given);
        prop_assert_eq!(preview.at(from - since), given);
        let acts = preview.at(until);
        prop_assert_eq!(acts.accelerations, accelerations);
        let moved: Vector3<f64> = rates + accelerations * delay;
        prop_assert!((acts.rates - moved).amax() < 1e-12);
        let h = 1e-6;
        let t = from + since + 1e-3;
        let [before, now, after] = [t - h, t, t + h].map(|time| preview.at(time));
        let end = preview.at(from + 1e4);
        for i in 0..3 {
            let slope = (after.angles[i] - before.angles[i]) / (2.0 * h);
            prop_assert!((slope - now.rates[i]).abs() < 1e-6, "{slope} {}", now.rates[i]);
            let is_steady = before.accelerations[i] == after.accelerations[i];
            let bend = (after.rates[i] - before.rates[i]) / (2.0 * h);
            prop_assert!(!is_steady || (bend - now.accelerations[i]).abs() < 1e-6);
            let way = 0.5 * acts.rates[i] * acts.rates[i].abs() / braking[i];
            prop_assert!((end.angles[i] - acts.angles[i] - way).abs() < 1e-11);
            prop_assert_eq!([end.rates[i], end.accelerations[i]], [0.0; 2]);
        }
    }

    #[test]
    fn without_braking_the_given_reference_counts_until_it_acts_and_the_angles_stay(
        angles in vector(-2.0..2.0), rates in vector(-0.2..0.2), since in 1e-9..60.0, delay in 0.0..0.5,
    ) {
        let given = Reference { angles, rates, ..Reference::default() };
        let preview = Preview::External(Forecast { given, from: 0.0, until: delay, braking: None });
        prop_assert_eq!(preview.at(delay), given);
        prop_assert_eq!(preview.at(delay + since), Reference { angles, ..Reference::default() });
    }
}
