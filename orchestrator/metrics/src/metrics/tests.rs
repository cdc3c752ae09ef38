use super::*;
use cosim::experiment::Measure;

/// Creates meters for angles and their references (rad), the moment as a multiple of its limit, and
/// the number of the solver's solutions.
fn meters() -> Meters {
    let difference = |axis: usize| Resolved {
        factor: 1_f64.to_degrees(),
        unit: "deg".into(),
        ..Resolved::difference(axis, axis + 3)
    };
    let gauge = |text: &str, signals: Vec<Resolved>| {
        let measure: Measure = toml::from_str(&format!("signals = \"x\"\n{text}")).unwrap();
        Some(Gauge::empty(&measure, measure.quantity().unwrap(), signals))
    };
    let errors = || vec![difference(0), difference(1), difference(2)];
    let count = Resolved { is_integer: true, ..Resolved::variable(7) };
    let gauges = [
        ("cms", gauge("kind = \"rms\"\nsteps = true", vec![Resolved::variable(6)])),
        ("ems_deg", gauge("kind = \"rms\"\nsteps = true", errors())),
        ("fallbacks", None),
        ("solves", gauge("kind = \"last\"", vec![count])),
    ];
    let loss = Loss {
        what: "attitude lost".into(),
        list: "error".into(),
        section: "[observe.loss]".into(),
        signals: errors(),
        beyond: 5.5_f64.to_degrees(),
        ends_run: false,
        at: None,
        before: Vec::new(),
        away: 0.0,
    };
    Meters {
        gauges: gauges.map(|(name, gauge)| (name.to_string(), gauge)).into(),
        guarantee: (None, None),
        loss: Some(loss),
        goal: None,
        cut_off: None,
        samples: 0,
        completed: false,
    }
}

fn feed(meters: &mut Meters, rows: &[[f64; 8]]) {
    for (tick, row) in rows.iter().enumerate() {
        let (time, last) = (tick as f64, tick + 1 == rows.len());
        meters.observe(&Sample { tick: tick as u64, time, last, values: row }).unwrap();
    }
}

#[test]
fn oracle_metrics_by_hand() {
    let mut meters = meters();
    feed(
        &mut meters,
        &[
            // The error is (3, 4, 0) rad, with square 25.
            [3.0, 4.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0],
            // The error is (0, 0, 1), with square 1.
            [1.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 1.0],
            // No step begins at the stop time, so this row does not count for the means.
            [2.0, 2.0, 2.0, 0.0, 0.0, 0.0, 1.2, 2.0],
        ],
    );
    let metrics = meters.metrics();
    let near = |name: &str, b: f64| {
        let a = metrics.number(name);
        assert!((a.unwrap() - b).abs() < 1e-12, "{name}: {a:?} {b}");
    };
    near("ems_deg", 13.0_f64.sqrt().to_degrees());
    near("cms", 0.5_f64.sqrt());
    assert_eq!(metrics.asked["solves"], Some(Value::Count(2)));
    assert_eq!(metrics.units["ems_deg"], "deg");
    assert!(metrics.completed && metrics.samples == 3 && metrics.lost_at.is_none());
}

#[test]
fn a_run_is_lost_beyond_its_bound_or_where_the_signal_is_no_number() {
    let row = |alpha: f64| {
        let mut row = [0.0; 8];
        row[0] = alpha;
        row
    };
    let mut meters_in_bounds = meters();
    feed(&mut meters_in_bounds, &[row(0.5), row(-5.4), row(5.5)]);
    assert_eq!(
        (meters_in_bounds.metrics().lost_at, meters_in_bounds.metrics().completed),
        (None, true)
    );
    for lost in [5.6, f64::NAN] {
        let mut meters = meters();
        feed(&mut meters, &[row(0.5), row(lost), row(20.0), row(0.0)]);
        assert_eq!((meters.metrics().lost_at, meters.metrics().completed), (Some(1.0), true));
    }
    let mut ending = meters().ending_when_lost();
    ending.observe(&Sample { tick: 2, time: 0.2, last: false, values: &row(1.0) }).unwrap();
    let sample = Sample { tick: 3, time: 0.1 + 0.2, last: false, values: &row(6.0) };
    let error = ending.observe(&sample).unwrap_err();
    assert_eq!(error.exit_code(), 3);
    assert!(
        error
            .to_string()
            .starts_with("attitude lost at t = 0.3 s: the norm of \"error\" exceeds 315.1"),
        "{error}"
    );
}

#[test]
fn a_command_or_a_far_start_is_no_loss() {
    let row = |alpha: f64, reference: f64| {
        let mut row = [0.0; 8];
        (row[0], row[3]) = (alpha, reference);
        row
    };
    // It starts far, follows a far command, and falls behind one that runs away.
    let mut followed = meters();
    let rows = [row(7.0, 0.0), row(4.0, 0.0), row(3.0, -9.0), row(-5.0, -9.0), row(-4.9, 2.0)];
    feed(&mut followed, &rows);
    assert_eq!(followed.metrics().lost_at, None);
    // It moves away from a far command, and then from one that is there.
    for rows in [
        [row(0.0, -9.0), row(2.0, -9.0), row(3.0, -9.0)],
        [row(0.0, 0.0), row(2.0, 0.0), row(5.6, 0.0)],
    ] {
        let mut lost = meters();
        feed(&mut lost, &rows);
        assert_eq!(lost.metrics().lost_at, Some(2.0));
    }
}

#[test]
fn a_run_that_misses_its_goal_is_not_completed() {
    let [near, far] = [0.5, 6.0].map(|alpha| {
        let mut row = [0.0; 8];
        row[0] = alpha;
        row
    });
    let with_goal = |cut_off: Option<u64>| {
        let bound = meters().loss.map(|loss| Loss { what: "target missed".into(), ..loss });
        Meters { goal: bound, loss: None, cut_off, ..meters() }
    };
    // A large error on the way does not count.
    for (last, cut_off, completed) in
        [(near, None, true), (far, None, false), ([f64::NAN; 8], None, false), (far, Some(2), true)]
    {
        let mut meters = with_goal(cut_off);
        feed(&mut meters, &[near, far, last]);
        assert_eq!(meters.metrics().completed, completed, "{last:?} {cut_off:?}");
        let mut ending = with_goal(cut_off).ending_when_lost();
        let sample = Sample { tick: 2, time: 2.0, last: true, values: &last };
        assert_eq!(ending.observe(&sample).is_ok(), completed);
    }
    let sample = Sample { tick: 2, time: 2.0, last: true, values: &far };
    let error = with_goal(None).ending_when_lost().observe(&sample).unwrap_err();
    assert!(error.to_string().starts_with("target missed at t = 2 s: the norm of"), "{error}");
    assert_eq!(error.exit_code(), 3);
}

#[test]
fn what_is_missing_is_null_and_what_is_kept_reads_back() {
    let mut meters = meters();
    feed(&mut meters, &[[0.0; 8]]);
    let json = serde_json::to_value(meters.metrics()).unwrap();
    for key in ["ems_deg", "cms", "fallbacks", "real_time_factor", "lost_at"] {
        assert!(json.as_object().unwrap()[key].is_null(), "{key}");
    }
    assert_eq!(meters.metrics().asked["solves"], Some(Value::Count(0)));
    let back: Metrics = serde_json::from_value(json).unwrap();
    assert_eq!(back.asked, meters.metrics().asked);
}
