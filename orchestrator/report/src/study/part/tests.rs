use super::*;

#[test]
fn oracle_shares_and_ratios_by_hand() {
    let mut inside = Compared::default();
    for magnitude in [0.5, 2.0, 3.0, 2.0] {
        inside.see(magnitude, 2.0);
    }
    assert_eq!(inside, Compared { inside: 3, samples: 4, largest: 3.0, ratio: 1.5 });
}

#[test]
fn a_magnitude_that_is_not_a_number_is_outside_and_seen() {
    let mut inside = Compared::default();
    inside.see(f64::NAN, 2.0);
    assert!(inside.inside == 0 && inside.largest.is_nan());
}

#[test]
fn a_band_holds_all_values() {
    let mut spread = BTreeMap::new();
    let signal = Signal::try_from("a.b".to_string()).unwrap();
    widen(&mut spread, &signal, &[1.0, 5.0]);
    widen(&mut spread, &signal, &[2.0, 3.0]);
    assert_eq!(spread[&signal], Spread { low: vec![1.0, 3.0], high: vec![2.0, 5.0] });
}
