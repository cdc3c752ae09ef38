use super::*;
use cosim::experiment::MeasureKind;
use toml::Spanned;

fn measured(
    kind: MeasureKind,
    over: Option<[f64; 2]>,
    size: Option<f64>,
    rows: &[[f64; 2]],
) -> Option<f64> {
    let signals = Spanned::new(0..0, "x".to_string());
    let (band, bound) = if kind == MeasureKind::Leaving { (None, size) } else { (size, None) };
    let measure = Measure { kind, signals, over, band, bound, ..measure("kind = \"rms\"") };
    let mut gauge = Gauge::empty(&measure, measure.quantity().unwrap(), Vec::new());
    for (time, row) in rows.iter().enumerate() {
        gauge.see(time as f64, row);
    }
    gauge.value()
}

/// Parses a measure from its TOML text.
fn measure(text: &str) -> Measure {
    toml::from_str(&format!("signals = \"x\"\n{text}")).unwrap()
}

#[test]
fn oracle_each_kind_by_hand() {
    let rows = [[10.0, -1.0], [3.0, 0.0], [0.1, 0.6], [0.4, 0.015], [-0.15, 0.0], [0.0, 0.01]];
    assert_eq!(measured(MeasureKind::Largest, None, None, &rows), Some(10.0));
    assert_eq!(measured(MeasureKind::Largest, Some([1.0, 2.0]), None, &rows), Some(3.0));
    assert_eq!(measured(MeasureKind::Rms, Some([0.5, 1.5]), None, &rows), Some(3.0));
    assert_eq!(measured(MeasureKind::Pulses, None, None, &rows), Some(2.0));
    // 6.5 + 1.55 + 0.25 + 0.125 - 0.075
    let integral = measured(MeasureKind::Integral, None, None, &rows).unwrap();
    assert!((integral - 8.35).abs() < 1e-12);
    // The first signal is within 0.2 from 4 s on, the second within 0.02 from 3 s on.
    assert_eq!(measured(MeasureKind::Settling, None, Some(0.02), &rows), Some(4.0));
    assert_eq!(measured(MeasureKind::Settling, None, Some(0.001), &rows), None);
    // Within the band at the last sample alone, for less than a tenth of the time.
    assert_eq!(measured(MeasureKind::Settling, None, Some(0.011), &rows), None);
    assert_eq!(measured(MeasureKind::Rms, Some([7.0, 8.0]), None, &rows), None);
    assert_eq!(measured(MeasureKind::Rises, None, None, &rows), Some(2.0));
    // 7 + 2.9 + 0.3 + 0.55 + 0.15, and 1 + 0.6 + 0.585 + 0.015 + 0.01
    let variation = measured(MeasureKind::Variation, None, None, &rows).unwrap();
    assert!((variation - 13.11).abs() < 1e-12, "{variation}");
    assert_eq!(measured(MeasureKind::Leaving, Some([1.0, 5.0]), Some(0.5), &rows), Some(1.0));
    assert_eq!(measured(MeasureKind::Leaving, Some([2.0, 5.0]), Some(0.7), &rows), None);
}

#[test]
fn a_measure_that_cannot_be_meant_is_refused() {
    let fault = |text: &str| measure(text).fault();
    assert!(fault("kind = \"rms\"\nover = [2.0, 1.0]").unwrap().contains("over"));
    assert!(fault("kind = \"settling\"").unwrap().contains("band"));
    assert!(fault("kind = \"rms\"\nband = 0.1").unwrap().contains("band"));
    assert!(fault("kind = \"rms\"\nevery = 0").unwrap().contains("every"));
    assert_eq!(fault("kind = \"settling\"\nband = 0.1"), None);
    assert!(fault("kind = \"leaving\"").unwrap().contains("bound"));
    assert!(fault("kind = \"largest\"\nbound = 1.0").unwrap().contains("bound"));
    assert_eq!(fault("kind = \"leaving\"\nbound = 1.0"), None);
    assert!(fault("kind = \"share\"").unwrap().contains("bound"));
    assert_eq!(fault("kind = \"share\"\nbound = 0.0"), None);
    assert_eq!(fault("kind = \"settling\"\nbound = 0.1"), None);
    assert!(fault("kind = \"settling\"\nbound = 0.1\nband = 0.1").unwrap().contains("either"));
    assert!(fault("kind = \"rms-above\"").unwrap().contains("frequency"));
    assert!(fault("kind = \"rms\"\nfrequency = 5.0").unwrap().contains("frequency"));
    assert_eq!(fault("kind = \"rms-above\"\nfrequency = 5.0"), None);
}

/// Computes a measure of the first of two variables from rows of both.
fn taken(text: &str, rows: &[[f64; 2]]) -> Option<f64> {
    let measure = measure(text);
    let mut gauge =
        Gauge::empty(&measure, measure.quantity().unwrap(), vec![Resolved::variable(0)]);
    gauge.each = measure.each.as_ref().map(|_| (1, 0.0));
    for (tick, row) in rows.iter().enumerate() {
        let (time, last) = (tick as f64, tick + 1 == rows.len());
        gauge.observe(&Sample { tick: tick as u64, time, last, values: row }).unwrap();
    }
    gauge.value()
}

#[test]
fn oracle_which_points_are_taken_by_hand() {
    let rows = [[3.0, 1.0], [100.0, 1.0], [4.0, 2.0], [50.0, 2.0]];
    assert_eq!(taken("kind = \"settling\"\nbound = 60.0", &rows), Some(2.0));
    assert_eq!(taken("kind = \"rises\"\nbound = 50.0", &rows), Some(1.0));
    assert_eq!(taken("kind = \"rms\"\nevery = 2", &rows), Some(12.5_f64.sqrt()));
    assert_eq!(taken("kind = \"mean\"\nsteps = true", &rows), Some(107.0 / 3.0));
    // A sample at which the count has not grown is not used.
    let each = "each = \"a.count\"";
    assert_eq!(taken(&format!("kind = \"mean\"\n{each}"), &rows), Some(3.5));
    let unit = "unit = { name = \"ms\", factor = 1e3 }";
    assert_eq!(taken(&format!("kind = \"p99\"\n{each}\n{unit}"), &rows), Some(4000.0));
    assert_eq!(taken("kind = \"last\"", &rows), Some(50.0));
    assert_eq!(taken("kind = \"largest\"", &rows), Some(100.0));
    assert_eq!(taken("kind = \"p99\"", &[[0.0, 0.0]; 0]), None);
}

#[test]
fn oracle_shares_by_hand() {
    let rows = [[0.5, 0.0], [-2.0, 0.0], [3.0, 0.0], [f64::NAN, 0.0]];
    assert_eq!(taken("kind = \"share\"\nbound = 2.0", &rows), Some(0.5));
}

#[test]
fn oracle_the_99th_percentile_is_the_nearest_rank() {
    let rows: Vec<[f64; 2]> = (1..=200).rev().map(|k| [f64::from(k), 0.0]).collect();
    assert_eq!(taken("kind = \"p99\"", &rows), Some(198.0));
}

#[test]
fn a_value_that_is_not_a_number_is_not_hidden() {
    let rows = [[1.0, 0.0], [f64::NAN, 0.0], [2.0, 0.0]];
    assert!(taken("kind = \"largest\"", &rows).unwrap().is_nan());
}
