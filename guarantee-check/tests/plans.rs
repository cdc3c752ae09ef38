//! Plans that are recorded from flights are confirmed, for every kind of settings.

use guarantee_check::draws;
use guarantee_check::tally::{Tally, check_flights};

#[test]
fn recorded_plans_of_every_kind_of_settings_are_confirmed() {
    let mut total = Tally::default();
    for seed in 0..8 {
        let Some(settings) = draws::accepted(seed) else { continue };
        let tally = check_flights(&settings, seed..=seed, 1.0).unwrap();
        assert_eq!(tally.outside, 0, "draw {seed}");
        assert_eq!(tally.not_confirmed, 0, "draw {seed}: {:?}", tally.refuted);
        total.add(tally);
    }
    assert!(total.plans > 15 && total.left.unwrap().confirmed(), "{total:?}");
}
