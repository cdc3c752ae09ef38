//! Tests of reference profiles: derivatives against differences, the spline against closed forms,
//! and tables that are refused.

use crate::prelude::*;
use vehicle::profile::{AngleProfile, Segment, Wave};
use vehicle::table::LookupTable;
use vehicle::{Profile, Reference};

/// Largest difference between the profile's rates and accelerations and the numerical derivatives
/// of its angles, at times away from jumps.
fn derivative_error(profile: &Profile, from: f64, to: f64) -> f64 {
    let h = 1e-3;
    let jumps: Vec<f64> = match profile {
        Profile::Piecewise(segments) => segments.iter().map(|segment| segment.until).collect(),
        Profile::Table(_) => vec![],
    };
    let times = (0..400).map(|k| from + (to - from) * (f64::from(k) + 0.37) / 400.0);
    times
        .filter(|time| jumps.iter().all(|jump| (time - jump).abs() > 3.0 * h))
        .map(|time| {
            let [a, b, c, d, e] = [-2.0, -1.0, 0.0, 1.0, 2.0].map(|k| profile.at(time + k * h));
            let difference = |value: fn(&Reference) -> Vector3<f64>| {
                (value(&a) - value(&b) * 8.0 + value(&d) * 8.0 - value(&e)) / (12.0 * h)
            };
            let rates = (difference(|r| r.angles) - c.rates).amax();
            rates.max((difference(|r| r.rates) - c.accelerations).amax())
        })
        .fold(0.0, f64::max)
}

fn smooth(t: f64) -> Vector3<f64> {
    Vector3::new(0.2 + 0.1 * (0.5 * t).sin(), 0.05 * (0.3 * t).cos(), -0.5 + 0.002 * t * t)
}

fn smooth_table(points: u32) -> LookupTable {
    let times: Vec<f64> = (0..=points).map(|k| 20.0 * f64::from(k) / f64::from(points)).collect();
    let angles = times.iter().map(|&t| smooth(t)).collect();
    LookupTable::new(times, angles).unwrap()
}

#[test]
fn oracle_derivatives_of_every_profile_against_differences() {
    let (a, b) = (Vector3::new(0.1, -0.2, 0.3), Vector3::new(0.4, 0.5, -0.6));
    let profiles = [
        ("crmpc2022", Scenario::crmpc2022().reference),
        ("tvsmc2015", Scenario::tvsmc2015().reference),
        ("twoLoop", Scenario::two_loop().reference),
        ("constant", Profile::constant(a)),
        ("step", Profile::step(a, b, 3.0)),
        ("sine", Profile::sine(a, b, 0.8, 0.3)),
    ];
    for (name, profile) in profiles {
        let error = derivative_error(&profile, 0.0, 50.0);
        assert!(error < 1e-11, "{name}: {error}");
    }
    // The third derivative of the spline jumps across knots.
    let error = derivative_error(&Profile::Table(smooth_table(200)), 0.1, 19.9);
    assert!(error < 1e-4, "table: {error}");
}

#[test]
fn oracle_sine_has_its_phase_and_amplitude() {
    let (mean, amplitude) = (Vector3::new(0.1, 0.2, 0.3), Vector3::new(1.0, -2.0, 3.0));
    let at = Profile::sine(mean, amplitude, 0.8, 0.3).at(2.5);
    assert!((at.angles - mean - amplitude * (0.8f64 * 2.5 + 0.3).sin()).amax() < 1e-15);
    assert!((at.rates - amplitude * 0.8 * (0.8f64 * 2.5 + 0.3).cos()).amax() < 1e-15);
}

#[test]
fn oracle_waves_add_up_whichever_of_them_share_a_frequency() {
    let wave = |frequency| Wave { frequency, sine: 0.1 * frequency, cosine: 0.3 };
    let frequencies = [vec![0.5, 0.25], vec![0.25, 0.0, 0.5], vec![0.5]];
    let angles = frequencies
        .clone()
        .map(|axis| AngleProfile { constant: 0.2, waves: axis.into_iter().map(wave).collect() });
    let profile = Profile::Piecewise(vec![Segment { until: f64::INFINITY, angles }]);
    let at = profile.at(3.0);
    for (i, axis) in frequencies.iter().enumerate() {
        let angle: f64 =
            axis.iter().map(|w| 0.1 * w * (w * 3.0).sin() + 0.3 * (w * 3.0).cos()).sum();
        let rate: f64 =
            axis.iter().map(|w| w * (0.1 * w * (w * 3.0).cos() - 0.3 * (w * 3.0).sin())).sum();
        assert!(
            (at.angles[i] - 0.2 - angle).abs() < 1e-15 && (at.rates[i] - rate).abs() < 1e-15,
            "{i}"
        );
    }
}

#[test]
fn oracle_spline_reproduces_polynomials_of_its_degree() {
    for (points, degree) in [(2, 1), (3, 2), (4, 3), (5, 3), (9, 3)] {
        let times: Vec<f64> =
            (0..points).map(|k| f64::from(k) * (1.0 + 0.1 * f64::from(k))).collect();
        let polynomial =
            |t: f64| Vector3::new(1.0 + t, 2.0 - t.powi(degree.min(2)), t.powi(degree) - 3.0 * t);
        let table = LookupTable::new(times.clone(), times.iter().map(|&t| polynomial(t)).collect())
            .unwrap();
        for k in 0..=100 {
            let t = times[times.len() - 1] * f64::from(k) / 100.0;
            let error = (table.at(t).angles - polynomial(t)).amax();
            assert!(error < 1e-10, "{points} points at {t}: {error}");
        }
    }
}

#[test]
fn spline_is_continuous_to_the_second_derivative_and_meets_its_points() {
    let table = smooth_table(7);
    for k in 0..=7 {
        let knot = 20.0 * f64::from(k) / 7.0;
        assert!((table.at(knot).angles - smooth(knot)).amax() < 1e-14);
        if (1..7).contains(&k) {
            let (before, after) = (table.at(knot - 1e-9), table.at(knot + 1e-9));
            assert!((before.rates - after.rates).amax() < 1e-9);
            assert!((before.accelerations - after.accelerations).amax() < 1e-9);
        }
    }
}

#[test]
fn table_is_held_beyond_its_ends() {
    let table = smooth_table(7);
    for (time, end) in [(-1.0, 0.0), (20.5, 20.0), (1e9, 20.0)] {
        assert_eq!(
            table.at(time),
            Reference { angles: table.at(end).angles, ..Reference::default() }
        );
    }
    let one = LookupTable::new(vec![1.0], vec![Vector3::repeat(0.1)]).unwrap();
    assert_eq!(one.at(1.0).angles, Vector3::repeat(0.1));
}

fn read(text: &str) -> Result<LookupTable, vehicle::Error> {
    LookupTable::from_csv("turn.csv", text.as_bytes())
}

#[test]
fn csv_is_read_in_the_stated_units_and_any_order_of_columns() {
    let table = read(
        "# turn\nsigma_deg, time_s, alpha_rad, beta_deg\n-30, 0, 0.1, 0\n\n-20, 2.5, 0.2, 9\n",
    )
    .unwrap();
    let end = table.at(2.5).angles;
    assert!((end - Vector3::new(0.2, 9f64.to_radians(), -20f64.to_radians())).amax() < 1e-15);
}

#[test]
fn csv_faults_are_named_with_file_line_and_column() {
    let head = "time_s,alpha_deg,beta_deg,sigma_deg\n";
    for (text, named) in [
        (format!("{head}0,1,2,3\n1,1,x,3\n"), "turn.csv, line 3, column beta_deg: 'x'"),
        (format!("{head}0,1,2,3\n1,1,NaN,3\n"), "line 3, column beta_deg"),
        (format!("{head}# c\n0,1,2,3\n0,1,2,3\n"), "line 4, column time_s: 0 does not come after"),
        (format!("{head}0,1,2\n"), "line 2: 3 values where the headings name 4"),
        (head.to_string(), "no points"),
        (
            "time_s,alpha,beta_deg,sigma_deg\n".into(),
            "column alpha: is missing; its heading is alpha_rad or alpha_deg",
        ),
        (format!("q,{head}"), "column q: is not a column"),
        ("time_s,alpha_deg,alpha_rad,beta_deg,sigma_deg\n".into(), "column alpha: is given twice"),
        (String::new(), "column time: is missing; its heading is time_s"),
    ] {
        let message = read(&text).unwrap_err().to_string();
        assert!(
            message.contains(named) && message.contains("turn.csv"),
            "{message}\nshould hold {named}"
        );
    }
    let missing = LookupTable::from_csv_file("no/such.csv".as_ref()).unwrap_err().to_string();
    assert!(missing.contains("no/such.csv"), "{missing}");
}

#[test]
fn a_table_of_more_points_than_anybody_needs_is_refused() {
    let table_of = |n: u32| {
        LookupTable::new((0..n).map(f64::from).collect(), vec![Vector3::zeros(); n as usize])
    };
    assert!(table_of(100_000).is_ok());
    let text = table_of(100_001).unwrap_err().to_string();
    assert!(text.contains("more than 100000 points"), "{text}");
    let lines: Vec<_> = (0..=100_000).map(|k| format!("{k},0,0,0")).collect();
    let csv = format!("time_s,alpha_deg,beta_deg,sigma_deg\n{}", lines.join("\n"));
    let text = LookupTable::from_csv("it.csv", csv.as_bytes()).unwrap_err().to_string();
    assert!(text.contains("it.csv, line 100002") && text.contains("points"), "{text}");
}

#[test]
fn oracle_a_file_that_counts_from_one_end_to_the_other_has_no_jump() {
    let rows = (0..40).map(|k| {
        let sigma = f64::from(k) * 20.0;
        format!("{k},5,0,{}\n", (sigma + 180.0).rem_euclid(360.0) - 180.0)
    });
    let text = format!("time_s,alpha_deg,beta_deg,sigma_deg\n{}", rows.collect::<String>());
    let table = LookupTable::from_csv("turns.csv", text.as_bytes()).unwrap();
    for k in 0..390 {
        let time = 0.1 * f64::from(k);
        let reference = table.at(time);
        assert!((reference.angles.z.to_degrees() - 20.0 * time).abs() < 1e-9, "{time}");
        assert!((reference.rates.z.to_degrees() - 20.0).abs() < 1e-9, "{time}");
    }
}
