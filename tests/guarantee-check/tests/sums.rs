//! The sums behind the guarantee, computed anew for settings that are drawn.

use control::crmpc::{Design, Guarantee, Lemmas, Settings};
use guarantee_check::{assessment, draws};

#[test]
fn the_sums_hold_for_every_kind_of_drawn_settings() {
    let mut checked = 0;
    for seed in 0..60 {
        let Some(drawn) = draws::with_slow_errors(seed) else { continue };
        // Every part of the deviation counts: errors, tensor and delay at once.
        let error = 0.01_f64.to_radians();
        let settings = Settings {
            delay: drawn.delay.max(0.03),
            tensor_error: drawn.tensor_error.max(0.01),
            angle_error: drawn.angle_error.max(error),
            rate_error: drawn.rate_error.max(error),
            guarantee: Guarantee::BestEffort,
            ..drawn
        };
        let settings = settings.resolved().unwrap();
        let design = Design::new(&settings).unwrap();
        if design.accepted_share < 1.0 {
            continue;
        }
        let (bounds, rate) = (Lemmas::new(&settings), design.assessment.terminal_rate);
        let found = assessment::check(&settings, &bounds, &design.tightening, rate).unwrap();
        for finding in found {
            assert!(finding.holds(), "draw {seed}: {finding:?}");
        }
        checked += 1;
    }
    assert!(checked > 10, "{checked}");
}
