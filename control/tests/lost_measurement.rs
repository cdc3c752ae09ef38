//! A measurement that is not finite is refused by every law, and leaves no trace.

use crate::prelude::*;
use control::sliding::Settings;

/// Returns the measurement with one of its numbers replaced.
fn replaced(measured: &Measurement, place: usize, by: f64) -> Measurement {
    let mut measured = *measured;
    let (quantity, component) = (place / 3, place % 3);
    let vectors = [
        &mut measured.angles,
        &mut measured.rates,
        &mut measured.turn,
        &mut measured.known_moment,
        measured.achieved_moment.insert(Vector3::zeros()),
    ];
    vectors.into_iter().nth(quantity).unwrap()[component] = by;
    measured
}

/// Flies the law with a wrong measurement before each right one.
fn assert_refuses<C: Controller>(name: &str, mut law: C, period: f64) {
    let scenario = Scenario::crmpc2022();
    let mut plant = Plant::new(&scenario.config(0.01), 0.0).unwrap();
    let reference = |time| scenario.reference.at(time);
    let bytes = |memory: &C::Memory| postcard::to_allocvec(memory).unwrap();
    let (mut memory, mut place) = (law.memory(), 0);
    for tick in 0..40 {
        let time = tick as f64 * period;
        let measured =
            Measurement { angles: plant.angles(), rates: plant.rates(), ..Measurement::default() };
        let before = bytes(&memory);
        let wrong = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY][place / 15];
        let wrong = replaced(&measured, place % 15, wrong);
        let moment = law.update(&mut memory, tick, time, &wrong, &reference);
        assert!(moment.iter().all(|value| value.is_nan()), "{name}, {wrong:?}: {moment}");
        assert_eq!(bytes(&memory), before, "{name}, {wrong:?}");
        let moment = law.update(&mut memory, tick, time, &measured, &reference);
        assert!(moment.iter().all(|value| value.is_finite()), "{name}, tick {tick}");
        plant.advance(time, time + period, moment).unwrap();
        place = (place + 1) % 45;
    }
}

#[test]
fn a_measurement_that_is_not_finite_leaves_no_trace_in_any_law() {
    for constraints in [Constraints::Robust, Constraints::Paper] {
        let settings = settings(constraints);
        assert_refuses("CRMPC", Crmpc::new(settings).unwrap(), FEEDBACK);
    }
    let body = settings(Constraints::Robust).body;
    let latency = Latency { measurement: 0.0, action: 0.06 };
    let delayed = Delayed::new(lqr(), body, FEEDBACK, latency, f64::INFINITY).unwrap();
    assert_refuses("LQR with a delay", delayed, FEEDBACK);
    assert_refuses("LQR", lqr(), FEEDBACK);
    assert_refuses("DLMPC", Dlmpc::new(dlmpc::Settings::published()).unwrap(), FEEDBACK);
    let fbl = FblSettings::published();
    assert_refuses("FBL", Fbl::new(fbl).unwrap(), fbl.period);
    let btvsmc: Btvsmc = Tvsmc::new(Settings::btvsmc_do()).unwrap();
    assert_refuses("BTVSMC/DO", btvsmc, fbl.period);
    let sotvsmc: SotvsmcDo = Tvsmc::new(Settings::sotvsmc_do()).unwrap();
    assert_refuses("SOTVSMC/DO", sotvsmc, fbl.period);
    let two_loop = TwoLoopSettings::ours();
    assert_refuses("TwoLoopSMC", TwoLoopSmc::new(two_loop).unwrap(), two_loop.period);
}
